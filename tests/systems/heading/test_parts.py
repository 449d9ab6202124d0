"""Parts of the heading estimator: recursion, pairing, gates, standstill, arm, checks, references, verdict."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from groundstation.base.angles import wrap_360
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.records import Column
from groundstation.base.toml_settings import settings_from
from groundstation.methods.intervals import effective_samples
from groundstation.methods.taxi.gating import gate_samples, intervals_without_epoch
from groundstation.methods.taxi.samples import TaxiSamples, pair_samples, window_slope, without_arm
from groundstation.methods.taxi.settings import GroundLimits
from groundstation.results.chosen import Interval
from groundstation.results.gates import Gate
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.taxi import TaxiCase, noiseless, simulate_taxi, table_of, taxi_flight
from groundstation.systems.heading.answer import Verdict
from groundstation.systems.heading.arms import know_arm
from groundstation.systems.heading.checks import about_running_line
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.normality import kurtosis_z, normality, skewness_z
from groundstation.systems.heading.reason_answer import ALL_PASSED, GOOD_TO, why_alone
from groundstation.systems.heading.recursion import run_recursion
from groundstation.systems.heading.references import (
    logged_reference,
    onboard_comparison,
    parking_reference,
    reference_conflict,
    runway_checks,
    shrunk_drift,
)
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.standstill import find_standstill, speed_bound_mps
from groundstation.systems.heading.steps import heading_steps
from groundstation.systems.heading.verdict import CURES, decide, explain
from groundstation.systems.known import AircraftData, Runway, SiteData, Stand
from groundstation.tables.epochs import distinct_epochs
from groundstation.tables.table import Flight, Table

SETTINGS = HeadingSettings()
ROUNDING_DEG = 1e-9
TWO_TURNS = TaxiCase(segments_s=(30.0, 30.0, 30.0), turns_deg=(90.0, -100.0), antenna_arm_m=4.0)


def paired(case: TaxiCase, seed: int = 0, settings: HeadingSettings = SETTINGS) -> TaxiSamples:
    flight = taxi_flight(simulate_taxi(case, np.random.default_rng(seed)))
    return gate_samples(pair_samples(flight, "ins", "gnss", settings=settings), settings)


def simple_samples(time_s: np.ndarray, north: np.ndarray, east: np.ndarray, heading: np.ndarray) -> TaxiSamples:
    count = len(time_s)
    zeros, nothing = np.zeros(count), np.full(count, np.nan)
    return TaxiSamples(
        time_s, (time_s * 1e9).astype(np.int64), heading, north, east, zeros, zeros, nothing, nothing,
        np.ones(count, dtype=bool), np.zeros(count, dtype=bool), np.full(count, "", dtype="U20"),
        np.zeros(count, dtype=np.int64),
        ground_method="weight on wheels",
    )  # fmt: skip


# The recursion


def test_recursion_is_the_plain_definition() -> None:
    difference = 170.0 + np.random.default_rng(1).normal(0.0, 0.5, 300)
    running = run_recursion(difference)
    means = np.array([difference[: i + 1].mean() for i in range(300)])
    assert running.mean_deg == pytest.approx(means, abs=ROUNDING_DEG)
    assert running.sigma_deg[-1] == pytest.approx(difference.std(), abs=ROUNDING_DEG)
    assert running.precision_deg[-1] == pytest.approx(1.96 * difference.std() / np.sqrt(299), abs=ROUNDING_DEG)
    assert running.quality_deg[-1] == pytest.approx(means.std(), abs=ROUNDING_DEG)


def test_four_hundred_cycles_of_half_a_degree_are_precise_enough() -> None:
    difference = np.tile([0.51, -0.51], 200)
    assert run_recursion(difference).precision_deg[-1] == pytest.approx(0.05, abs=2e-4)


def test_quality_of_a_drift_of_two_degrees_a_minute() -> None:
    time_min = np.arange(1200) / 600.0
    assert run_recursion(2.0 * time_min).quality_deg[-1] == pytest.approx(0.58, abs=0.01)


# Pairing


def test_track_of_every_quadrant() -> None:
    """Worked examples of the sign: INS shows 91 deg, motion due east: the INS reads 1 deg too much."""
    for north, east, heading, error in ((0.0, 8.0, 91.0, 1.0), (-8.0, 0.0, 179.0, -1.0), (8.0, 0.0, 359.5, -0.5)):
        samples = simple_samples(np.zeros(1), np.array([north]), np.array([east]), np.array([heading]))
        assert float(samples.difference_deg[0]) == pytest.approx(error, abs=ROUNDING_DEG)


def gnss_table(north: np.ndarray, repeat: int = 1) -> Table:
    values = np.repeat(north, repeat)
    time_ns = (np.arange(len(values)) * 1e8 / repeat).astype(np.int64)
    return table_of("gnss", time_ns, {"velocity_north_mps": values, "velocity_east_mps": values})


def test_rows_repeated_by_a_fast_recorder_count_once() -> None:
    north = np.random.default_rng(2).normal(8.0, 0.05, 100)
    assert len(distinct_epochs(gnss_table(north, repeat=5))) == 100
    assert len(distinct_epochs(gnss_table(north))) == 100


def test_a_receiver_that_holds_zero_at_standstill_keeps_its_epochs() -> None:
    north = np.concatenate([np.zeros(50), np.random.default_rng(3).normal(8.0, 0.05, 100)])
    assert len(distinct_epochs(gnss_table(north))) == 150


def test_rows_of_one_time_count_once() -> None:
    table = gnss_table(np.random.default_rng(4).normal(8.0, 0.05, 50))
    doubled = table.take(np.repeat(np.arange(50), 2))
    assert len(distinct_epochs(doubled)) == 50


def test_window_slope_is_exact_on_a_line_and_widens_thin_windows() -> None:
    time_s = np.arange(20.0)
    at = np.array([3.25, 10.0])
    assert window_slope(at, time_s, 3.0 * time_s - 7.0, 2.0) == pytest.approx([3.0, 3.0])
    assert window_slope(at, time_s, 3.0 * time_s - 7.0, 0.0) == pytest.approx([3.0, 3.0])
    assert np.isnan(window_slope(at, time_s[:1], time_s[:1], 2.0)).all()


def test_heading_is_not_interpolated_over_a_long_gap() -> None:
    flight = taxi_flight(simulate_taxi(TaxiCase(), np.random.default_rng(5)))
    ins = flight["ins"]
    seconds = flight.seconds(ins.time_ns)
    cut = ins.take((seconds < 100.0) | (seconds > 102.0))
    samples = pair_samples(replace(flight, tables={**flight.tables, "ins": cut}), "ins", "gnss", settings=SETTINGS)
    inside = (samples.time_s >= 100.0) & (samples.time_s <= 102.0)
    assert np.isnan(samples.heading_deg[inside]).all()
    assert np.isfinite(samples.heading_deg[~inside]).all()


# Gates of the samples


def test_gates_name_the_reason() -> None:
    samples = paired(TWO_TURNS)
    names = set(np.unique(samples.gate))
    assert names == {"used", "too slow", "turning"}
    assert samples.speed_mps[samples.is_used].min() > 6.0
    assert np.abs(samples.rate_dps[samples.is_used]).max() <= 1.0
    assert samples.segment.max() == 3
    assert (samples.segment[~samples.is_used] == 0).all()


def test_geometry_integrity_and_intervals_take_samples_out() -> None:
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    pair = pair_samples(flight, "ins", "gnss", settings=SETTINGS)
    plain = gate_samples(pair, SETTINGS)
    used = np.flatnonzero(plain.is_used)
    geometry, integrity = pair.geometry.copy(), pair.integrity.copy()
    geometry[used[:50]] = 2.3
    integrity[used[50:80]] = 0.0
    start, end = float(pair.time_s[used[100]]), float(pair.time_s[used[119]])
    excluded = (Interval(start, end, "exclude"),)
    gated = gate_samples(replace(pair, geometry=geometry, integrity=integrity), SETTINGS, excluded)
    assert (gated.gate[used[:50]] == "geometry").all()
    assert (gated.gate[used[50:80]] == "integrity").all()
    assert (gated.gate[used[100:120]] == "excluded").all()


def test_forced_interval_overrides_speed_and_turn() -> None:
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    pair = pair_samples(flight, "ins", "gnss", settings=SETTINGS)
    plain = gate_samples(pair, SETTINGS)
    slow = plain.time_s[plain.gate == "too slow"][-100]
    forced = gate_samples(pair, SETTINGS, (Interval(slow - 1.0, slow + 1.0, "force"),))
    assert forced.is_used.sum() > plain.is_used.sum()


def test_outliers_of_tens_of_degrees_are_left_out_and_nothing_else() -> None:
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    pair = pair_samples(flight, "ins", "gnss", settings=SETTINGS)
    plain = gate_samples(pair, SETTINGS)
    assert (plain.gate == "outlier").sum() == 0
    hit = np.flatnonzero(plain.is_used)[[20, 200, 201]]
    north, east = pair.north_mps.copy(), pair.east_mps.copy()
    north[hit], east[hit] = north[hit] - 0.5 * east[hit], east[hit] + 0.5 * north[hit]
    gated = gate_samples(replace(pair, north_mps=north, east_mps=east), SETTINGS)
    assert np.flatnonzero(gated.gate == "outlier").tolist() == hit.tolist()


def test_an_epoch_alone_between_turns_is_named_for_what_it_is() -> None:
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    pair = pair_samples(flight, "ins", "gnss", settings=SETTINGS)
    used = np.flatnonzero(gate_samples(pair, SETTINGS).is_used)
    alone = int(used[300])
    ends = [float(pair.time_s[alone + step]) for step in (-100, -1, 1, 100)]
    gated = gate_samples(pair, SETTINGS, (Interval(*ends[:2], "exclude"), Interval(*ends[2:], "exclude")))
    assert gated.gate[alone] == "single epoch"
    assert not np.char.find(gated.gate, "gap").max() >= 0, "no epoch is missing"


def test_gnss_gap_closes_the_segment() -> None:
    flight = taxi_flight(simulate_taxi(TaxiCase(sway_sigma_deg=0.0), np.random.default_rng(0)))
    gnss = flight["gnss"]
    seconds = flight.seconds(gnss.time_ns)
    cut = gnss.take((seconds < 110.0) | (seconds > 111.0))
    flight = replace(flight, tables={**flight.tables, "gnss": cut})
    samples = gate_samples(pair_samples(flight, "ins", "gnss", settings=SETTINGS), SETTINGS)
    before, after = samples.segment[samples.time_s < 110.0].max(), samples.segment[samples.time_s > 111.0].max()
    assert after == before + 1


def test_samples_after_lift_off_are_not_looked_at() -> None:
    flight = taxi_flight(simulate_taxi(TaxiCase(), np.random.default_rng(0)))
    gnss = flight["gnss"]
    fast = flight.seconds(gnss.time_ns) > 120.0
    north = np.where(fast, 80.0, gnss.values("velocity_north_mps"))
    tables = dict(flight.tables)
    tables["gnss"] = replace(gnss, columns={**gnss.columns, "velocity_north_mps": Column(north)})
    tables["discrete"] = table_of("discrete", gnss.time_ns, {"weight_on_wheels": ~fast})
    samples = pair_samples(replace(flight, tables=tables), "ins", "gnss", settings=SETTINGS)
    assert samples.time_s.max() <= 120.0
    del tables["discrete"]
    assert pair_samples(replace(flight, tables=tables), "ins", "gnss", settings=SETTINGS).time_s.max() <= 120.0


@pytest.mark.parametrize("with_later_runs", [False, True])
def test_a_log_that_begins_in_the_air_is_not_assessable(with_later_runs: bool) -> None:
    flight = taxi_flight(simulate_taxi(TaxiCase(), np.random.default_rng(0)))
    gnss = flight["gnss"]
    fast = replace(gnss, columns={**gnss.columns, "velocity_north_mps": Column(np.full(len(gnss), 80.0))})
    tables = {name: table for name, table in flight.tables.items() if name != "discrete"} | {"gnss": fast}
    with pytest.raises(NotAssessableError, match="gnss: no GNSS epoch before lift-off: the log begins in the air"):
        pair_samples(replace(flight, tables=tables), "ins", "gnss", settings=SETTINGS, with_later_runs=with_later_runs)


def test_intervals_that_touch_no_epoch_are_told() -> None:
    samples = paired(TWO_TURNS)
    first, second, last = float(samples.time_s[0]), float(samples.time_s[1]), float(samples.time_s[-1])
    touching = Interval(first, first)
    between, after = Interval(first + 0.01, second - 0.01, "force"), Interval(last + 1.0, last + 2.0)
    assert intervals_without_epoch(samples.time_s, (touching, between, after)) == (between, after)
    assert intervals_without_epoch(samples.time_s, ()) == ()
    assert intervals_without_epoch(np.zeros(0), (touching,)) == (touching,)


@pytest.mark.parametrize("ends", [(np.nan, 1.0), (0.0, np.inf), (-np.inf, 0.0)])
def test_an_interval_has_finite_ends(ends: tuple[float, float]) -> None:
    with pytest.raises(SettingsError, match="finite flight seconds"):
        Interval(*ends)


# Standstill


def test_standstill_assesses_the_last_thirty_seconds() -> None:
    case = TaxiCase(standstill_s=100.0, white_mps=0.05, correlated_mps=0.0)
    found = find_standstill(paired(case), SETTINGS)
    assert found.answer is not None
    assert found.answer.end_s - found.answer.start_s == pytest.approx(30.0, abs=0.11)
    assert 96.0 < found.answer.end_s <= 98.5
    assert found.answer.sigma_north_mps == pytest.approx(0.05, rel=0.15)
    assert found.answer.speed_of_mean_mps < 0.01 < found.answer.mean_of_speed_mps
    assert found.is_informative


def test_short_standstill_is_none() -> None:
    assert find_standstill(paired(TaxiCase(standstill_s=11.0)), SETTINGS).answer is None


def test_held_velocity_says_nothing_of_the_noise() -> None:
    samples = paired(TaxiCase(standstill_s=60.0))
    still = samples.time_s < 60.0
    held = replace(
        samples,
        north_mps=np.where(still, 0.0, samples.north_mps),
        east_mps=np.where(still, 0.0, samples.east_mps),
    )
    assert not find_standstill(held, SETTINGS).is_informative


def test_effective_samples_of_a_gauss_markov_process() -> None:
    rng = np.random.default_rng(6)
    paths = gauss_markov(rng, (200, 3000), 0.1, 1.0, 2.0)
    expected = 3000 * 0.1 / (2.0 * 2.0)
    assert np.mean([effective_samples(path) for path in paths]) == pytest.approx(expected, rel=0.25)
    white = rng.standard_normal(3000)
    assert effective_samples(white) > 2000


def test_speed_bound_holds_the_true_mean_97_times_of_100() -> None:
    rng = np.random.default_rng(7)
    bound = speed_bound_mps(0.02, 0.005)
    lengths = np.hypot(0.02 + 0.005 * rng.standard_normal(20000), 0.005 * rng.standard_normal(20000))
    assert np.mean(lengths <= bound) == pytest.approx(0.97, abs=0.005)


# Lever arm


def test_antenna_arm_is_taken_out_exactly() -> None:
    """Worked example: nose north, turning right at 10 deg/s, antenna 4 m ahead: it moves east at 0.698 m/s."""
    sideways = np.deg2rad(10.0) * 4.0
    samples = simple_samples(np.zeros(1), np.array([5.0]), np.array([sideways]), np.array([0.0]))
    axle = without_arm(replace(samples, arm_rate_dps=np.array([10.0])), 4.0)
    assert (float(axle.north_mps[0]), float(axle.east_mps[0])) == pytest.approx((5.0, 0.0), abs=1e-12)


def test_arm_is_found_from_turns() -> None:
    found = know_arm(paired(noiseless(TWO_TURNS)), AircraftData(), SETTINGS)
    assert found.origin == "estimated"
    assert found.arm_m == pytest.approx(4.0, abs=0.05)
    assert found.offset_s == pytest.approx(0.0, abs=0.01)


def test_arm_found_is_within_its_sigma() -> None:
    errors = []
    for seed in range(12):
        found = know_arm(paired(TWO_TURNS, seed), AircraftData(), SETTINGS)
        errors.append((found.arm_m - 4.0) / found.arm_sigma_m)
    assert np.mean(np.square(errors)) < 2.2  # 99.5 % point of chi-square over 12 degrees of freedom, per degree


def test_late_gnss_velocities_are_found_from_turns() -> None:
    """The velocity of time t is stamped t + 0.2 s: d = heading(t) - track(t - 0.2 s), an offset of +0.2 s."""
    run = simulate_taxi(noiseless(TWO_TURNS), np.random.default_rng(0))
    flight = taxi_flight(replace(run, gnss_time_s=run.gnss_time_s + 0.2))
    settings = HeadingSettings(offset_prior_sigma_s=1.0)
    samples = gate_samples(pair_samples(flight, "ins", "gnss", settings=settings), settings)
    found = know_arm(samples, AircraftData(antenna_arm_m=4.0), settings)
    assert found.offset_s == pytest.approx(0.2, abs=0.02)


def test_unknown_arm_without_turns_is_not_observable() -> None:
    samples = paired(TaxiCase(segments_s=(60.0,)))
    straight = samples.time_s > samples.time_s[samples.is_used][0]
    gate = np.where(straight | samples.is_used, samples.gate, "excluded")
    found = know_arm(replace(samples, gate=gate), AircraftData(), replace(SETTINGS, arm_speed_min_mps=7.0))
    assert found.applied_arm_m == 0.0
    assert found.origin == "not observable"


def test_turns_that_the_method_does_not_hold_for_leave_the_arm_as_it_was() -> None:
    """Where the heading is far from the track in every turn nothing is left to estimate from: no median of nothing."""
    samples = paired(noiseless(TWO_TURNS))
    turned = np.where(samples.is_used, samples.heading_deg, wrap_360(samples.heading_deg + 120.0))
    found = know_arm(replace(samples, heading_deg=turned), AircraftData(), SETTINGS)
    assert (found.arm_m, found.arm_sigma_m) == (SETTINGS.arm_prior_m, SETTINGS.arm_prior_sigma_m)
    assert found.origin == "not observable" and not found.is_offset_observable


def test_arm_is_not_read_from_a_slow_log() -> None:
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    slow = replace(flight, tables={**flight.tables, "gnss": flight["gnss"].take(slice(0, None, 10))})
    samples = gate_samples(pair_samples(slow, "ins", "gnss", settings=SETTINGS), SETTINGS)
    assert know_arm(samples, AircraftData(), SETTINGS).origin == "not observable"


# Checks


def test_normality_sizes() -> None:
    rng = np.random.default_rng(8)
    normal = normality(rng.standard_normal(5000))
    assert normal is not None
    assert abs(normal.skewness) < 0.15
    assert abs(normal.excess_kurtosis) < 0.3
    assert normal.distance < 0.02
    two_humps = normality(np.concatenate([rng.normal(-3, 0.3, 500), rng.normal(3, 0.3, 500)]))
    assert two_humps is not None
    assert two_humps.excess_kurtosis < -1.2
    assert two_humps.distance > 0.08
    assert normality(np.full(100, 1.0)) is None


@pytest.mark.parametrize("count", [20, 400])
def test_normality_p_values_are_those_of_scipy(count: int) -> None:
    values = np.random.default_rng(count).standard_t(6, count)
    found = normality(values)
    assert found is not None
    standard = (values - values.mean()) / values.std()
    distance = stats.kstest(standard, "norm")
    assert found.distance == pytest.approx(distance.statistic, rel=1e-12)
    assert found.distance_p == pytest.approx(distance.pvalue, rel=0.05)  # that one is exact, ours an approximation
    assert skewness_z(found.skewness, count) == pytest.approx(stats.skewtest(standard).statistic, rel=1e-10)
    assert kurtosis_z(found.excess_kurtosis + 3.0, count) == pytest.approx(
        stats.kurtosistest(standard).statistic, rel=1e-10
    )


def test_running_line_follows_a_turn_and_leaves_the_sway() -> None:
    time_s = np.arange(600) / 10.0
    sway = 0.5 * np.sin(2 * np.pi * 0.4 * time_s)
    residual = about_running_line(time_s, (350.0 + 0.5 * time_s + sway) % 360.0, np.ones(600, dtype=np.int64), 5.0)
    assert np.std(residual[50:-50]) == pytest.approx(0.5 / np.sqrt(2.0), rel=0.05)
    straight = about_running_line(time_s, (350.0 + 0.5 * time_s) % 360.0, np.ones(600, dtype=np.int64), 5.0)
    assert np.nanmax(np.abs(straight)) < 1e-9


# References


def test_runway_check_against_its_bearing() -> None:
    """INS shows 91.2 deg on a runway of 90 deg: error +1.2; the taxi said +1.0: difference +0.2."""
    time_s = np.arange(50) / 10.0
    samples = simple_samples(time_s, np.zeros(50), np.full(50, 30.0), np.full(50, 91.2))
    site = SiteData(runways=(Runway("27", 270.0), Runway("09", 90.0)))
    (check,) = runway_checks(samples, site, 1.0, 0.1, SETTINGS)
    assert check.name == "09"
    assert check.error_deg == pytest.approx(1.2)
    assert check.difference_deg == pytest.approx(0.2)
    assert runway_checks(samples, SiteData(runways=(Runway("18", 180.0),)), 1.0, 0.1, SETTINGS) == ()


def test_onboard_figures_stand_beside_ours() -> None:
    time_ns = np.array([0, 1_000_000_000], dtype=np.int64)
    table = table_of(
        "onboard",
        time_ns,
        {
            "heading_error_deg": np.array([0.5, 0.9]),
            "cycles": np.array([100.0, 450.0]),
            "status": np.array(["run", "ok"]),
        },
    )
    found = onboard_comparison(Flight({"onboard": table}), 10.0, 0.8)
    assert found is not None
    assert (found.heading_error_deg, found.cycles, found.status) == (0.9, 450.0, "ok")
    assert found.difference_error_deg == pytest.approx(0.1)
    assert onboard_comparison(Flight({}), 10.0, 0.8) is None


def test_drift_of_taxi_is_shrunk_to_what_an_ins_can_drift() -> None:
    assert shrunk_drift(0.1) == pytest.approx((0.0, 0.1))
    drift, sigma = shrunk_drift(0.1, (0.1, 0.01))
    assert drift == pytest.approx(0.1, rel=0.02)
    assert sigma == pytest.approx(0.01, rel=0.01)


def test_reference_of_the_log_is_a_finite_heading_with_its_sigma() -> None:
    heading, sigma = "reference.parking_heading_deg", "reference.parking_heading_sigma_deg"
    for text in ("", "north", "nan", "inf"):
        assert logged_reference({heading: text}) is None
    for text, expected in (("0.02", 0.02), ("0", 0.05), ("-1", 0.05), ("nan", 0.05), ("inf", 0.05), ("?", 0.05)):
        found = logged_reference({heading: "361.5", sigma: text})
        assert found is not None
        assert (found.heading_deg, found.sigma_deg) == (1.5, expected)
    assert logged_reference({sigma: "0.02"}) is None


def test_site_file_and_log_that_disagree_are_told() -> None:
    """Worked example: 0.01 and 0.40 deg apart across north, sigmas 0.10 and 0.09: 3 sigma are 0.404 deg."""
    site = SiteData(stands=(Stand("7", 360.0, 0.10),))
    heading, sigma = "reference.parking_heading_deg", "reference.parking_heading_sigma_deg"
    assert reference_conflict({heading: "359.99", sigma: "0.09"}, site) is None
    assert reference_conflict({heading: "359.60", sigma: "0.09"}, site) is None
    told = reference_conflict({heading: "359.59", sigma: "0.09"}, site)
    assert told is not None and "0.00 deg (site file, stand 7), 359.59 deg (log)" in told
    sure = SiteData(stands=(Stand("7", 0.0, 0.0),))
    assert reference_conflict({heading: "0.14", sigma: "0.001"}, sure) is None, "never below 3 x 0.05 deg"
    assert reference_conflict({heading: "0.16", sigma: "0.001"}, sure) is not None
    assert reference_conflict({}, site) is None
    assert reference_conflict({heading: "90"}, SiteData()) is None
    used = parking_reference({heading: "90"}, site)
    assert used is not None and used.heading_deg == 0.0


# Settings


@pytest.mark.parametrize(
    ("made", "table", "says"),
    [
        (AircraftData, {"entry_step_deg": 0}, r"file, key entry_step_deg: found 0, expected within \[1e-06, 10\]"),
        (AircraftData, {"entry_step_deg": -0.1}, "key entry_step_deg: found -0.1"),
        (AircraftData, {"mounting_deg": 400}, r"key mounting_deg: found 400, expected within \[-10, 10\]"),
        (AircraftData, {"mounting_sigma_deg": -1}, "key mounting_sigma_deg: found -1, expected 0 or more"),
        (AircraftData, {"antenna_arm_sigma_m": -1}, "key antenna_arm_sigma_m"),
        (AircraftData, {"antenna_arm_m": 51.0}, "key antenna_arm_m"),
        (SiteData, {"stands": [{"name": "7", "heading_deg": 1e9}]}, r"key stands\[0\].heading_deg: found 1e\+09"),
        (SiteData, {"stands": [{"name": "7", "heading_deg": 1, "sigma_deg": -1}]}, r"key stands\[0\].sigma_deg"),
        (SiteData, {"stand": "9Z", "stands": [{"name": "7", "heading_deg": 1}]}, "key stand: found '9Z', expected one"),
        (SiteData, {"stand": "9Z"}, "key stand: found '9Z', expected a stand listed"),
        (SiteData, {"stands": [{"name": "7", "heading_deg": 1}] * 2}, "key stands: found '7' more than once"),
        (SiteData, {"runways": [{"name": "09", "true_bearing_deg": 90}] * 2}, "key runways: found '09' more than once"),
        (SiteData, {"runways": [{"name": "09", "true_bearing_deg": -1}]}, r"key runways\[0\].true_bearing_deg"),
        (
            SiteData,
            {"runways": [{"name": "09", "true_bearing_deg": 90, "latitude_deg": 48}]},
            r"file, key runways\[0\].longitude_deg: found nothing, expected a value, as latitude_deg has one",
        ),
        (
            SiteData,
            {"runways": [{"name": "09", "true_bearing_deg": 90, "latitude_deg": 91, "longitude_deg": 0}]},
            r"key runways\[0\].latitude_deg: found 91",
        ),
        (HeadingSettings, {"posterior_draws": 0}, "key posterior_draws: found 0, expected 100 or more"),
        (HeadingSettings, {"growth_steps": 1}, "key growth_steps"),
        (HeadingSettings, {"geometry_share_min": 1.1}, "key geometry_share_min"),
        (HeadingSettings, {"taxi_speed_min_mps": 25}, "key taxi_speed_min_mps: found 25, expected at most taxi_sp"),
        (HeadingSettings, {"standstill_max_s": 5}, "key standstill_min_s: found 10, expected at most"),
        (HeadingSettings, {"variance_ratio_range": [2.0, 0.5]}, "key variance_ratio_range: found 2 to 0.5"),
    ],
)
def test_a_value_that_cannot_be_used_is_refused_by_file_and_key(made: type, table: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        settings_from(made, table, "file")


@pytest.mark.parametrize(
    "make",
    [
        lambda: AircraftData(mounting_deg=np.nan),
        lambda: AircraftData(antenna_arm_sigma_m=np.inf),
        lambda: AircraftData(entry_step_deg=0.0),
        lambda: Stand("7", 361.0),
        lambda: Runway("09", np.inf),
        lambda: HeadingSettings(precision_max_deg=np.inf),
        lambda: HeadingSettings(excess_kurtosis_range=(np.nan, 2.0)),
        lambda: HeadingSettings(quality_max_deg=-1.0),
    ],
)
def test_settings_made_without_a_file_are_checked_too(make: Callable[[], object]) -> None:
    with pytest.raises(SettingsError):
        make()


def test_the_ends_of_the_ranges_can_be_used() -> None:
    """The fewest draws and steps still give an answer; a runway at a position, a stand at 360 deg are in order."""
    site = SiteData((Stand("7", 360.0),), (Runway("09", 0.0, 0.0, -90.0, 180.0),), "7")
    assert site.parked_on() == site.stands[0]
    settings = HeadingSettings(posterior_draws=100, growth_steps=2)
    aircraft = AircraftData(antenna_arm_m=4.0, antenna_arm_sigma_m=0.0, entry_step_deg=10.0)
    flight = taxi_flight(simulate_taxi(TWO_TURNS, np.random.default_rng(0)))
    found = estimate_heading_error(flight, settings=settings, aircraft=aircraft)
    assert np.isfinite([found.error_deg, *found.confidence95_deg]).all()


# Verdict


def back_taxi(seed: int, rate_dps: float = 8.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, INS heading at 10 Hz and where it turns: two half turns whose rate is there within one sample, and sway."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 120.0, 0.1) + rng.uniform(0.0, 0.1)
    heading_deg = 350.0 + 0.7 * np.sin(2.0 * np.pi * rng.uniform(0.2, 0.6) * time_s + rng.uniform(0.0, 6.0))
    is_turning = np.zeros(len(time_s), dtype=bool)
    for start_s, hand in ((rng.uniform(30.0, 35.0), 1.0), (rng.uniform(70.0, 75.0), -1.0)):
        turned_s = np.clip(time_s - start_s, 0.0, 180.0 / rate_dps)
        heading_deg += hand * rate_dps * turned_s
        is_turning |= (turned_s > 2.0) & (turned_s < 180.0 / rate_dps - 2.0)
    return time_s, np.round((heading_deg + rng.normal(0.0, 0.02, len(time_s))) / 0.01) * 0.01 % 360.0, is_turning


def test_an_abrupt_turn_is_no_step() -> None:
    assert [seed for seed in range(40) if heading_steps(*back_taxi(seed)[:2], SETTINGS)] == []


@pytest.mark.parametrize("is_in_turn", [False, True])
def test_a_step_is_found_on_the_straight_and_in_a_turn(is_in_turn: bool) -> None:
    found = 0
    for seed in range(40):
        time_s, heading_deg, is_turning = back_taxi(seed)
        rng = np.random.default_rng(1000 + seed)
        place = int(rng.choice(np.flatnonzero(is_turning) if is_in_turn else np.arange(60, 280)))
        stepped = (heading_deg + 0.3 * (np.arange(len(time_s)) >= place)) % 360.0
        steps = heading_steps(time_s, stepped, SETTINGS)
        found += len(steps) == 1 and abs(steps[0].time_s - time_s[place]) < 0.05
    assert found >= 39


def test_a_spike_of_the_heading_is_no_step() -> None:
    time_s, heading_deg, _is_turning = back_taxi(1)
    spiked = (heading_deg + 0.5 * (np.arange(len(time_s)) == 150)) % 360.0
    assert heading_steps(time_s, spiked, SETTINGS) == ()


def gate(name: str, state: str, required: bool = True) -> Gate:
    return Gate(name, name, 1.0, 2.0, "", state, required)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("states", "verdict"),
    [
        ((("quality", "passed"), ("precision", "passed")), "accept"),
        ((("quality", "passed"), ("precision", "failed")), "extend"),
        ((("quality", "failed"), ("precision", "failed")), "reject"),
        ((("geometry", "not_measured"), ("precision", "passed")), "undecided"),
        ((("geometry", "not_measured"), ("precision", "failed")), "extend"),
        ((("whole_half_width", "failed"), ("precision", "passed")), "advisory"),
        ((("whole_half_width", "failed"), ("half_width", "passed")), "extend"),
        ((("whole_half_width", "failed"), ("precision", "failed")), "extend"),
        ((("whole_half_width", "failed"), ("steps", "failed")), "reject"),
        ((("whole_half_width", "failed"), ("geometry", "not_measured")), "undecided"),
        ((("standstill_speed_of_mean", "failed"), ("precision", "passed")), "reject"),
    ],
)
def test_verdict_follows_from_the_gates(states: tuple[tuple[str, str], ...], verdict: str) -> None:
    gates = tuple(gate(name, state) for name, state in states)
    assert decide(gates, None, SETTINGS)[0] == verdict
    informing = gate("segments", "failed", required=False)
    assert decide((*gates, informing), None, SETTINGS)[0] == verdict


def test_short_standstill_that_fails_asks_for_more() -> None:
    standstill = find_standstill(paired(TaxiCase(standstill_s=18.0)), SETTINGS).answer
    assert standstill is not None
    assert decide((gate("standstill_speed_of_mean", "failed"),), standstill, SETTINGS)[0] == "extend"
    whole = find_standstill(paired(TaxiCase(standstill_s=60.0)), SETTINGS).answer
    assert decide((gate("standstill_speed_of_mean", "failed"),), whole, SETTINGS)[0] == "reject"


def test_number_to_type_has_the_other_sign() -> None:
    assert explain("accept", (), 0.83, 0.1) == "every required gate passed: enter -0.8 deg"
    assert "Not to be entered" in explain("reject", (gate("quality", "failed"),), 0.83, 0.1)


@pytest.mark.parametrize(
    ("verdict", "against", "why"),
    [
        ("accept", (), (ALL_PASSED,)),
        ("advisory", (("whole_half_width", "failed"),), (CURES,)),
        ("reject", (("quality", "failed"), ("steps", "failed")), ("steps", "running mean")),
        ("extend", (("taxi_seconds", "failed"), ("precision", "failed")), ("of straight taxi", "precision e")),
        ("undecided", (("integrity", "not_measured"),), ("GNSS integrity",)),
    ],
)
def test_reason_of_each_verdict_is_taken_apart_as_it_was_written(
    verdict: Verdict, against: tuple[tuple[str, str], ...], why: tuple[str, ...]
) -> None:
    """Nothing of the number to enter, nor of how good it is, is left in the parts."""
    gates = tuple(gate(name, state) for name, state in against)
    reason = explain(verdict, gates, 0.83, 0.1, 0.4)
    assert "-0.8 deg" in reason and (verdict == "advisory") == reason.startswith(GOOD_TO)
    parts = why_alone(reason)
    assert len(parts) == len(why) and all(word in part for word, part in zip(why, parts, strict=True))
    assert not [part for part in parts if "-0.8" in part or "entered" in part or "enter " in part or "arcmin" in part]


def test_every_failed_required_gate_is_told_the_plain_ones_first() -> None:
    names = ("skewness", "variance_ratio", "precision", "outliers", "before_take_off")
    verdict, against = decide(tuple(gate(name, "failed") for name in names), None, SETTINGS)
    assert verdict == "reject" and {one.name for one in against} == set(names)
    text = explain(verdict, against, 0.62, 0.1)
    told = ("before take-off", "outliers", "precision e", "scatter", "skewness", "Not to be entered: -0.6 deg")
    assert [text.index(part) for part in told] == sorted(text.index(part) for part in told)


def test_limits_of_other_headings_are_those_of_system_1() -> None:
    for field in fields(GroundLimits):
        assert getattr(GroundLimits(), field.name) == getattr(HeadingSettings(), field.name), field.name
