"""Statistics over a fleet: merged without loss, intervals and alarms that keep to the rates they state."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.methods.fleet import answer
from groundstation.methods.fleet.aircraft import mean_over_flights
from groundstation.methods.fleet.answer import calibrate
from groundstation.methods.fleet.changes import ChangeSettings, control_chart, find_changes
from groundstation.methods.fleet.density import MOST_BINS, densities_of, histogram_of
from groundstation.methods.fleet.deviation import deviations
from groundstation.methods.fleet.moments import Moments, merged, moments_of
from groundstation.methods.fleet.outliers import find_outliers
from groundstation.methods.fleet.skill import SkillMerger
from groundstation.methods.fleet.trends import trends
from groundstation.methods.intervals import share_interval
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS
from groundstation.results.columns import READ_BY_FLEETS
from groundstation.results.figures import FigureData
from groundstation.results.fleet_share import SkillOfFlight
from groundstation.results.fleet_units import UnitLimits
from groundstation.systems import systems
from tests.fleet_example import flights_table

LUCK_SIGMAS = 4.0  # of a share counted over simulated series: a right rate is outside once in sixteen thousand tests
DAY_NS = 86_400_000_000_000
EMPTY = {"number": math.nan, "count": math.nan, "flag": False, "time": None, "text": "", "category": ""}


def reach(rate: float, count: int) -> float:
    """How far a share of ``count`` may be from its rate by luck."""
    return LUCK_SIGMAS * math.sqrt(rate * (1.0 - rate) / count)


def table(**columns: object) -> FigureData:
    """A table of flights with the columns given, the rest missing."""
    count = len(next(iter(columns.values())))  # type: ignore[arg-type]
    given = {"flight_id": [f"F{number:04d}" for number in range(count)], "aircraft": ["A12"] * count} | columns
    return flights_table({one.name: given.get(one.name, [EMPTY[one.kind]] * count) for one in FLIGHT_COLUMNS})


def test_moments_of_parts_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(1)
    values = 1e6 + rng.normal(0.0, 0.01, 5000)  # sums of squares would lose every digit
    parts = [moments_of(part) for part in np.split(values, [0, 1, 7, 7, 4000])]
    for order in (parts, parts[::-1], [merged(parts[:3]), merged(parts[3:])]):
        whole = merged(order)
        assert whole.count == 5000
        assert whole.mean == pytest.approx(np.mean(values), rel=1e-14)
        assert whole.m2 == pytest.approx(5000 * np.var(values), rel=1e-6)
    assert merged([]) == Moments() and math.isnan(moments_of([1.0]).sigma)


def test_interval_of_equally_known_flights_is_that_of_student() -> None:
    from scipy.stats import t

    values = np.random.default_rng(2).normal(0.4, 0.3, 9)
    found = mean_over_flights(values, np.full(9, 0.02))
    assert found is not None and found.mean == pytest.approx(values.mean())
    half = t.ppf(0.975, 8) * values.std(ddof=1) / 3.0
    assert found.high - found.mean == pytest.approx(half, rel=1e-9)
    assert found.sigma_between**2 == pytest.approx(values.var(ddof=1) - 0.02**2, rel=1e-6)


@pytest.mark.parametrize("flights", [3, 6, 20])
@pytest.mark.parametrize("sigma_between", [0.0, 0.05, 0.3])
def test_interval_of_an_aircraft_holds_its_mean(flights: int, sigma_between: float) -> None:
    rng = np.random.default_rng([3, flights])
    runs, hits = 600, 0
    for _ in range(runs):
        sigma = rng.uniform(0.02, 0.2, flights)
        found = mean_over_flights(1.0 + rng.normal(0.0, np.hypot(sigma, sigma_between)), sigma)
        hits += found is not None and found.low <= 1.0 <= found.high
    # Student's interval is exact for equal sigmas, and errs to the wide side where they differ.
    assert 0.95 - reach(0.95, runs) < hits / runs < 0.97 + reach(0.97, runs)


def test_mean_of_few_or_odd_flights() -> None:
    none, nan = np.zeros(0), math.nan
    assert mean_over_flights(none, none) is None and mean_over_flights(np.array([nan]), np.array([0.1])) is None
    single = mean_over_flights(np.array([2.0, nan]), np.array([0.1, 0.1]))
    assert single is not None and single.mean == 2.0 and math.isnan(single.low)
    alike = mean_over_flights(np.full(4, 0.5), np.full(4, nan))
    assert alike is not None and (alike.low, alike.mean, alike.high, alike.sigma_between) == (0.5, 0.5, 0.5, 0.0)
    precise = mean_over_flights(np.array([0.0, 1.0, 5.0]), np.array([0.001, 1.0, nan]))
    assert precise is not None and precise.mean == 2.0  # one precise flight does not speak for the aircraft
    assert precise.sigma_between**2 == pytest.approx(7.0 - 0.5, rel=1e-5)


@pytest.mark.parametrize("flights", [12, 60])
@pytest.mark.parametrize("tails", ["normal", "heavy"])
def test_false_changes_come_as_often_as_stated(flights: int, tails: str) -> None:
    rng = np.random.default_rng([4, flights])
    runs, settings = 800, ChangeSettings(false_change=0.05)
    draw = rng.normal if tails == "normal" else lambda size: rng.standard_t(2, size)
    found = sum(bool(find_changes(draw(size=flights), settings=settings)) for _ in range(runs)) / runs
    assert abs(found - 0.05) < reach(0.05, runs) + 0.005  # ranks take whole numbers, and the orders are drawn


def test_a_step_is_found_soon_and_in_its_place() -> None:
    rng = np.random.default_rng(5)
    delays, places = [], []
    for _ in range(60):
        value = rng.normal(size=60)
        value[30:] += 3.0
        looks = (after for after in range(1, 31) if find_changes(value[: 30 + after]))
        delays.append(next(looks, 99))
        places.append(find_changes(value)[0].index)
    assert np.median(delays) <= 6 and max(delays) <= 15
    assert np.mean(np.abs(np.array(places) - 30) <= 1) > 0.9


def test_several_levels_are_told_apart_and_wild_flights_are_none() -> None:
    rng = np.random.default_rng(6)
    value = rng.normal(0.0, 0.1, 90) + np.repeat([0.0, 1.0, 0.3], 30)
    assert [change.index for change in find_changes(value)] == [30, 60]
    steady = rng.normal(0.0, 0.1, 40)
    steady[[11, 12]] = 50.0
    assert find_changes(steady) == ()
    assert find_changes(np.full(50, 0.25)) == () and find_changes(np.zeros(0)) == ()


def test_control_limits_follow_the_levels() -> None:
    rng = np.random.default_rng(7)
    value = rng.normal(0.0, 0.1, 80) + np.repeat([0.0, 2.0], 40)
    value[60] = 3.5
    chart = control_chart(value)
    assert chart is not None and [change.index for change in chart.changes] == [40]
    assert abs(chart.level[0]) < 0.06 and abs(chart.level[-1] - 2.0) < 0.06
    assert np.flatnonzero(chart.is_outside(value)).tolist() == [60]
    assert chart.high[0] - chart.level[0] == pytest.approx(3.0 * 0.1, rel=0.4)
    assert control_chart(value[:7]) is None
    same = control_chart(np.full(20, 1.0))
    assert same is not None and not same.is_outside(np.full(20, 1.0)).any() and np.isnan(same.high).all()


@pytest.mark.parametrize("flights", [8, 20, 100])
def test_steady_flights_are_outside_the_limits_as_often_as_stated(flights: int) -> None:
    rng = np.random.default_rng([8, flights])
    settings = ChangeSettings(false_alarm=0.02)
    series = rng.normal(size=(20_000 // flights, flights))
    charts = [control_chart(value, settings=settings) for value in series]
    outside = [chart.is_outside(value) for chart, value in zip(charts, series, strict=True) if chart is not None]
    assert 0.01 < np.mean(outside) < 0.03  # Student's quantile stands in for what is not quite his distribution


@pytest.mark.parametrize("sizes", [(8,) * 6, (20,) * 10, (8, 12, 20, 50, 100)], ids=len)
def test_a_clean_fleet_has_an_outlier_as_seldom_as_stated(sizes: tuple[int, ...]) -> None:
    rng = np.random.default_rng([9, len(sizes)])
    runs = 500
    found = sum(bool(find_outliers({str(at): rng.normal(size=n) for at, n in enumerate(sizes)})) for _ in range(runs))
    assert 0.01 < found / runs < 0.05 + reach(0.05, runs)


def test_outliers_are_named_with_their_flight_and_reason() -> None:
    rng = np.random.default_rng(10)
    error, rate = rng.normal(1.0, 0.1, 40), np.exp(rng.normal(0.0, 0.5, 40))
    error[7], rate[9], rate[20] = -1.0, 300.0, -1.0
    found = answer.outliers(table(error_deg=error, radial_error_rate_fit_nmiph=rate))
    assert [(one.flight_id, one.quantity) for one in found] == [
        ("F0007", "error_deg"),
        ("F0009", "radial_error_rate_fit_nmiph"),
    ]
    assert found[0].z < -10.0 and found[0].typical == pytest.approx(1.0, abs=0.1)
    assert "heading error, deg: -1, usual for this aircraft" in found[0].reason
    assert answer.outliers(table(error_deg=error, aircraft=[""] * 40)) == ()


def test_an_aircraft_that_shakes_more_than_it_did_is_an_outlier_and_a_change() -> None:
    rng = np.random.default_rng(12)
    vibration = np.exp(rng.normal(np.log(2.0), 0.1, 40))
    vibration[11], start = 9.0, [int(1_700_000_000_000_000_000 + day * DAY_NS) for day in range(40)]
    found = answer.outliers(table(health_vibration_mps2=vibration))
    assert [(one.flight_id, one.quantity) for one in found] == [("F0011", "health_vibration_mps2")]
    assert "vibration in the air, m/s2: 9, usual for this aircraft 1.98" in found[0].reason
    risen = np.where(np.arange(40) >= 20, 2.0, 1.0) * np.exp(rng.normal(np.log(2.0), 0.1, 40))
    changes = trends(table(health_vibration_mps2=risen, start_utc=start), ChangeSettings()).changes
    assert ("health_vibration_mps2", "F0020") in [(one.quantity, one.flight_id) for one in changes]


def test_trend_is_in_order_of_time_and_names_the_first_flight_of_a_level() -> None:
    rng = np.random.default_rng(11)
    order = rng.permutation(50)  # flights are listed by name, flown in another order
    error = rng.normal(0.0, 0.1, 50) + np.where(order >= 25, 1.0, 0.0)
    start = [int(1_700_000_000_000_000_000 + day * DAY_NS) for day in order]
    names = ["A12"] * 47 + [""] * 3
    flights = table(error_deg=error, start_utc=[None, *start[1:]], aircraft=names)
    found = trends(flights, ChangeSettings())
    trend, changes = found.charts, found.changes
    kept = list(range(1, 47))
    assert len(trend) == len(kept) and set(trend["quantity"].tolist()) == {"error_deg"}
    assert (np.diff(trend["start_utc"]) > np.timedelta64(0)).all()
    (change,) = changes
    first = min((order[at], at) for at in kept if order[at] >= 25)[1]
    assert change.flight_id == f"F{first:04d}" and change.start_utc_ns == start[first]
    assert change.level_after - change.level_before == pytest.approx(1.0, abs=0.15)
    assert change.flights_before + change.flights_after == len(kept) and change.p_value <= 0.01


def days(count: int) -> list[int]:
    """Starts of daily flights."""
    return [1_700_000_000_000_000_000 + day * DAY_NS for day in range(count)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slow_drift_is_a_slope_with_the_date_of_the_limit(sign: float) -> None:
    drift = sign * (0.08 * np.arange(20) + np.random.default_rng(21).normal(0.0, 0.1, 20))
    found = trends(table(error_deg=drift, start_utc=days(20)), ChangeSettings(), UnitLimits(heading_error_deg=2.0))
    (slope,) = found.slopes
    assert not found.changes and slope.is_slope and slope.flights == 20 and not slope.is_over
    assert slope.slope_per_flight == pytest.approx(sign * 0.08, abs=0.008)
    low, high = sorted(slope.per_flight[1:])
    assert low < sign * 0.08 < high and high - low < 0.03
    due = 1_700_000_000_000_000_000 + 25 * DAY_NS  # 2 deg at 0.08 deg a day
    assert slope.due_earliest_utc_ns and slope.due_utc_ns and slope.due_latest_utc_ns
    assert slope.due_earliest_utc_ns <= due + DAY_NS and slope.due_latest_utc_ns >= due - DAY_NS
    assert abs(slope.due_utc_ns - due) <= 2 * DAY_NS
    assert not found.charts.is_outside.any() and np.ptp(found.charts.level) == pytest.approx(1.52, abs=0.2)
    (bare,) = trends(table(error_deg=drift, start_utc=days(20)), ChangeSettings()).slopes
    assert bare.is_slope and bare.limit is None and bare.due_utc_ns is None
    own = UnitLimits(heading_error_deg=1.0)
    (over,) = trends(table(error_deg=drift, start_utc=days(20)), ChangeSettings(), own).slopes
    assert over.is_over and over.due_utc_ns is None


def test_a_step_is_no_slope_and_steady_flights_have_none() -> None:
    rng = np.random.default_rng(22)
    called = {"step": 0, "slope": 0, "steady": 0}
    for _ in range(12):
        noise, at = rng.normal(0.0, 0.1, 20), np.arange(20)
        shapes = {"step": np.where(at >= 8, 1.0, 0.0), "slope": 0.08 * at, "steady": np.zeros(20)}
        for name, shape in shapes.items():
            found = trends(table(error_deg=noise + shape, start_utc=days(20)), ChangeSettings())
            is_sloped = any(one.is_slope for one in found.slopes)
            called[name] += is_sloped if name != "step" else is_sloped or len(found.changes) != 1
    assert called["step"] <= 2 and called["slope"] >= 10 and called["steady"] <= 1


def test_flights_at_one_time_and_ratios_that_rise() -> None:
    same = trends(table(error_deg=0.08 * np.arange(20), start_utc=days(1) * 20), ChangeSettings())
    assert same.slopes == () and len(same.charts) == 20
    ratio = 0.3 + 0.02 * np.arange(30) + np.random.default_rng(23).normal(0.0, 0.01, 30)
    (slope,) = trends(table(health_test_ratio=ratio, start_utc=days(30)), ChangeSettings()).slopes
    assert slope.is_slope and slope.limit == 1.0 and slope.due_utc_ns is not None
    (falling,) = trends(table(health_test_ratio=ratio[::-1], start_utc=days(30)), ChangeSettings()).slopes
    assert falling.is_slope and falling.slope_per_year < 0.0 and falling.due_utc_ns is None


def test_by_aircraft_counts_flights_and_merges_samples() -> None:
    rng = np.random.default_rng(12)
    parts = [rng.normal(mean, 0.5, 200) for mean in (1.0, 1.2, -3.0)]
    found = [moments_of(part) for part in parts]
    flights = table(
        aircraft=["B", "B", "A", "", "B"],
        error_deg=[1.0, 1.2, -3.0, 0.0, math.nan],
        standard_error_deg=[0.05] * 5,
        verdict=["accept", "extend", "accept", "accept", ""],
        samples=[200.0, 200.0, 200.0, math.nan, math.nan],
        sample_mean_deg=[*(one.mean for one in found), math.nan, math.nan],
        sample_m2_deg2=[*(one.m2 for one in found), math.nan, math.nan],
    )
    whole, only, both = answer.by_aircraft(flights)
    assert [row.aircraft for row in (whole, only, both)] == ["", "A", "B"]
    assert (both.flights, both.assessed, both.accepted, both.samples) == (3, 2, 1, 400)
    assert both.mean_deg == pytest.approx(1.1) and both.confidence95_deg is not None
    assert both.sample_mean_deg == pytest.approx(np.mean(parts[:2]))
    within = np.concatenate([part - part.mean() for part in parts[:2]])
    assert both.sigma_within_deg == pytest.approx(math.sqrt(np.sum(within**2) / 398))
    assert only.confidence95_deg is None and only.mean_deg == -3.0
    assert whole.confidence95_deg is None and whole.flights == 5 and whole.assessed == 4
    assert answer.by_aircraft(table(error_deg=[])) == ()


def test_rejected_flights_enter_no_mean() -> None:
    flights = table(
        aircraft=["A"] * 3,
        error_deg=[1.0, 1.2, 40.0],
        standard_error_deg=[0.05] * 3,
        verdict=["accept", "undecided", "reject"],
        samples=[100.0] * 3,
        sample_mean_deg=[1.0, 1.2, 40.0],
        sample_m2_deg2=[25.0] * 3,
    )
    whole, one = answer.by_aircraft(flights)
    assert (one.flights, one.assessed, one.averaged, one.samples) == (3, 3, 2, 200)
    assert one.mean_deg == whole.mean_deg == pytest.approx(1.1) and one.sample_mean_deg == pytest.approx(1.1)


def test_normals_are_those_of_all_samples_together() -> None:
    rng = np.random.default_rng(13)
    parts = [rng.normal(mean, 0.5, size) for mean, size in ((1.0, 40), (1.2, 4000), (-3.0, 70))]
    whole, a, b = answer.normals_of(["B", "B", "A"], [moments_of(part) for part in parts])
    assert (whole.aircraft, a.aircraft, b.aircraft) == ("", "A", "B") and whole.samples == 4110
    assert whole.sigma_deg == pytest.approx(np.std(np.concatenate(parts), ddof=1))
    assert b.mean_deg == pytest.approx(np.mean(np.concatenate(parts[:2])))  # not the mean of the means


def test_flights_are_judged_one_by_one_where_they_have_starts_enough() -> None:
    merger = SkillMerger()
    for verdict in (True, False, True, None):
        merger.add(SkillOfFlight("noise_bank", 60.0, 10, 100.0, 0.9, is_within=verdict))
    (row,) = merger.rows()
    assert (row.flights, row.flights_judged, row.flights_within) == (4, 3, 2)


def test_skill_is_what_all_starts_in_one_array_give() -> None:
    rng = np.random.default_rng(14)
    errors = [np.abs(rng.normal(0.0, scale, size)) for scale, size in ((1.0, 3), (10.0, 40), (100.0, 7))]
    merger = SkillMerger()
    for part in errors:
        rms, covered = float(np.sqrt(np.mean(part**2))), float(np.mean(part < 20.0))
        merger.add(SkillOfFlight("last_estimate", 60.0, len(part), rms, covered))
        merger.add(SkillOfFlight("raw_ins", 60.0, len(part), 2.0 * rms, math.nan))
    raw, last = merger.rows()
    every = np.concatenate(errors)
    assert (last.flights, last.starts, last.coverage_starts) == (3, 50, 50)
    assert last.rms_m == pytest.approx(np.sqrt(np.mean(every**2)))
    assert last.coverage95 == pytest.approx(np.mean(every < 20.0))
    assert raw.method == "raw_ins" and raw.coverage95 is None and raw.rms_m == pytest.approx(2.0 * last.rms_m)


def test_densities_are_histograms_of_the_samples_on_one_grid() -> None:
    rng = np.random.default_rng(15)
    parts = [rng.normal(mean, sigma, 900) for mean, sigma in ((1.0, 0.5), (-2.0, 0.4), (0.2, 0.7))]
    moments, histograms = [moments_of(part) for part in parts], [histogram_of(part) for part in parts]
    found = densities_of(["a", "b", "c"], ["A", "B", ""], moments, histograms)
    steps = np.diff(found.edge_deg)
    assert steps == pytest.approx(steps[0]) and steps[0] == pytest.approx(0.1)
    for row, part in zip(found.density_per_deg, parts, strict=True):
        assert row == pytest.approx(np.histogram(part, found.edge_deg)[0] / (900 * steps[0]), abs=0.02)
        assert row.sum() * steps[0] == pytest.approx(1.0, abs=0.002)
    assert found.pooled_per_deg == pytest.approx(found.density_per_deg.mean(axis=0), abs=1e-5)


def test_one_wild_flight_does_not_spoil_the_grid_of_the_others() -> None:
    rng = np.random.default_rng(16)
    parts = [rng.normal(mean, 0.5, 400) for mean in (0.0, 0.3, 150.0)]
    found = densities_of(
        list("abc"), list("AAA"), [moments_of(part) for part in parts], [histogram_of(part) for part in parts]
    )
    assert len(found.pooled_per_deg) == MOST_BINS and np.diff(found.edge_deg)[0] < 0.12
    inside = found.density_per_deg.sum(axis=1) * np.diff(found.edge_deg)[0]
    assert inside == pytest.approx([1.0, 1.0, 0.0], abs=0.01)
    empty = densities_of([], [], [], [])
    assert len(empty) == 0 and empty.pooled_per_deg.tolist() == [0.0]


def test_honest_sigmas_look_honest_and_proud_ones_do_not() -> None:
    rng = np.random.default_rng(17)
    z = rng.normal(size=400)
    honest, proud = (calibrate("reference", "", z * scale, np.abs(z * scale) < 1.96) for scale in (1.0, 2.0))
    assert honest is not None and proud is not None
    assert honest.confidence95[0] < 0.95 < honest.confidence95[1] and max(honest.pit) < 70
    assert honest.z_sigma == pytest.approx(1.0, abs=0.15) and honest.inside == round(400 * honest.share_inside)
    assert proud.confidence95[1] < 0.95 and proud.pit[0] + proud.pit[-1] > 180
    assert calibrate("reference", "", np.zeros(0), np.zeros(0, dtype=bool)) is None
    single = calibrate("reference", "", np.array([0.1]), np.array([True]))
    assert single is not None and single.z_sigma is None and sum(single.pit) == 1


def test_interval_of_a_share_is_exact() -> None:
    from scipy.stats import binom

    low, high = share_interval(7, 30)
    assert binom.sf(6, 30, low) == pytest.approx(0.025) and binom.cdf(7, 30, high) == pytest.approx(0.025)
    assert share_interval(30, 30)[1] == 1.0 and share_interval(0, 30)[0] == 0.0


def deviation_columns(values: np.ndarray, sigma: float, verdict: str = "accept") -> dict[str, list[object]]:
    """Columns of flights with coefficients A to E, shape (n, 5), all of one sigma."""
    columns: dict[str, list[object]] = {"magnetic_verdict": [verdict] * len(values)}
    for place, letter in enumerate("abcde"):
        columns[f"magnetic_{letter}_deg"] = values[:, place].tolist()
        columns[f"magnetic_{letter}_sigma_deg"] = [sigma] * len(values)
    return columns


def test_deviation_that_changed_is_far_from_those_of_the_other_flights() -> None:
    values = np.tile([179.9, 1.0, 2.0, 0.0, 0.5], (4, 1))
    values[1, 0] = -179.9  # 0.2 deg away, not 359.8
    values[3] += [0.0, 3.0, 0.0, 0.0, 0.0]
    rows = deviations(table(**deviation_columns(values, 0.1)))
    assert [row.others for row in rows] == [3] * 4
    assert rows[3].difference_rms_deg == pytest.approx(math.hypot(0.2 / 3.0, 3.0 / math.sqrt(2.0)))
    assert rows[3].expected_rms_deg == pytest.approx(math.sqrt(3.0 * 0.01 * (1.0 + 1.0 / 3.0)))
    assert rows[0].difference_rms_deg < 0.8


def test_difference_of_deviations_that_did_not_change_is_as_expected() -> None:
    rng = np.random.default_rng(21)
    sigma = 0.2
    told = []
    for _ in range(400):
        rows = deviations(table(**deviation_columns(rng.normal(0.0, sigma, (3, 5)), sigma)))
        told += [(row.difference_rms_deg, row.expected_rms_deg) for row in rows]
    difference, expected = np.array(told, dtype=float).T
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(np.mean(expected), rel=0.05)
    assert np.mean(difference > 3.0 * expected) < 0.001


def test_rejected_and_nameless_flights_are_told_and_not_compared() -> None:
    columns = deviation_columns(np.zeros((4, 5)), 0.1)
    columns["magnetic_verdict"][0] = "reject"
    columns["magnetic_a_deg"][1] = math.nan
    rows = deviations(table(aircraft=["B", "B", "B", ""], **columns))
    assert [(row.flight_id, row.others, row.difference_rms_deg) for row in rows] == [
        ("F0003", 0, None),
        ("F0000", 0, None),
        ("F0002", 0, None),
    ]


def test_flux_valves_are_compared_with_flux_valves_by_what_both_show() -> None:
    values = np.array([[0.0, 1.0, 2.0, math.nan, math.nan], [0.0, 4.0, 2.0, 0.5, 0.5], [9.0, 9.0, 9.0, 9.0, 9.0]])
    columns = {name.replace("magnetic", "flux"): mine for name, mine in deviation_columns(values, 0.1).items()}
    columns["flux_a_deg"][2] = math.nan  # the third has a magnetometer
    other = deviation_columns(np.array([[math.nan] * 5, [math.nan] * 5, [9.0] * 5]), 0.1)
    rows = deviations(table(**columns, **other))
    assert [(row.sensor, row.flight_id, row.others) for row in rows] == [
        ("magnetometer", "F0002", 0),
        ("flux", "F0000", 1),
        ("flux", "F0001", 1),
    ]
    assert rows[1].difference_rms_deg == rows[2].difference_rms_deg == pytest.approx(3.0 / math.sqrt(2.0))
    assert rows[1].expected_rms_deg == pytest.approx(math.sqrt(0.02 * (1.0 + 0.5 + 0.5)))
    assert np.isfinite(rows[1].error_deg(np.array([0.0, 90.0]))).all()


def test_columns_that_statistics_read_are_those_that_systems_give() -> None:
    """A table of flights has them even without the system; a name told twice must not drift."""
    given = {column.name: column.kind for column in FLIGHT_COLUMNS}
    assert {name: given.get(name) for name in READ_BY_FLEETS} == READ_BY_FLEETS


def test_every_column_of_a_system_that_pages_of_fleets_read_is_there_without_the_system() -> None:
    """One that was not left the page of a fleet out where the system was not installed."""
    given = {column.name for analysis in systems().analyses for column in analysis.columns}
    package = Path(groundstation.__file__).parent
    readers = [path for folder in ("chapters", "methods") for path in (package / folder).rglob("fleet/*.py")]
    read = {
        node.slice.value
        for path in (*readers, *package.glob("viewer/fleet*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and node.slice.value in given
    }
    assert "forecast_60min_p95_m" in read
    assert read - READ_BY_FLEETS.keys() == set()
