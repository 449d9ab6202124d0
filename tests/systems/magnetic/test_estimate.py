"""The magnetic estimator on whole flights: exact without noise, honest with it, silent with a reason otherwise."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.base.serial import to_json
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.results.roles import LETTERS
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.latency.answer import Latencies, Latency
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight, Table
from tests.systems.magnetic.example import EIGHT, HARD_NT, LEVEL, SOFT, Made, make, table, taxi_heading

EXACT_DEG = 1e-9
FROM_GRID_DEG = 1e-3  # A to E are read off a curve sampled every half degree
NOISE = {"heading_noise_deg": 0.1, "attitude_noise_deg": 0.1, "field_noise_nt": 50.0, "bank_sway_deg": 0.7}
LEVEL_STRETCHES = 10  # of the flight made, each 10 to 30 s
DIP_MOVES = 0.01  # of a sigma: a dip that is known otherwise
FLIGHTS = 40


def estimated(made: Made, **options: Any) -> MagneticResult:
    return estimate_deviation(made.flight, **{"heading": taxi_heading(), "phases": made.phases, **options})


def changed(made: Made, topic: str, change: Callable[[Table], Table]) -> Made:
    return replace(made, flight=replace(made.flight, tables={**made.flight.tables, topic: change(made.flight[topic])}))


def with_column(name: str, values: np.ndarray) -> Callable[[Table], Table]:
    return lambda table: replace(table, columns={**table.columns, name: Column(values)})


def values_of(coefficients: dict[str, float]) -> list[float]:
    return [coefficients[letter] for letter in LETTERS]


def shape_sigmas(result: MagneticResult) -> np.ndarray:
    return np.array([result.method("poisson_attitude").coefficients_sigma_deg[letter] for letter in "BCDE"])


def state_of(result: MagneticResult, gate: str) -> str:
    return next(item.state for item in result.gates if item.name == gate)


# Exact, signs


def test_noiseless_flight_gives_the_iron_to_rounding() -> None:
    made = make()
    result = estimated(made)
    assert result.poisson is not None
    assert result.poisson.hard_iron_nt == pytest.approx(HARD_NT, abs=1e-6)
    assert np.array(result.poisson.soft_iron) == pytest.approx(np.array(SOFT), abs=1e-11)
    row = result.method("poisson_attitude")
    assert row.held_out_after_deg == pytest.approx(0.0, abs=EXACT_DEG)
    assert values_of(row.coefficients_deg) == pytest.approx(made.coefficients_deg, abs=FROM_GRID_DEG)
    assert (result.verdict, result.recommended_method) == ("accept", "poisson_attitude")
    assert result.residual_rms_deg is not None
    assert result.residual_rms_deg.before > 3.0


def test_table_is_level_flight_plus_the_forecast_bias() -> None:
    made = make()
    result = estimated(made)
    figure = next(item for item in result.figures if item.name == "magnetic_table")
    at_level = np.array(result.card[0].deviation_deg)
    steer = result.card[0].steer_deg
    average = np.interp(steer, figure["uncorrected_magnetic_heading_deg"], -figure["deviation_deg"], period=360.0)
    bias = np.interp(steer, figure["uncorrected_magnetic_heading_deg"], figure["bank_bias_deg"], period=360.0)
    assert average - bias == pytest.approx(-at_level, abs=0.02)  # means over bins of 1 deg
    assert result.table_fit_rms_deg == pytest.approx(0.0, abs=0.1)


def test_deviation_is_minus_error_with_declination_removed() -> None:
    """Worked example: no iron, declination +12: magnetic heading is 12 deg less than true, the deviation is nothing."""
    made = make(hard_nt=(0.0, 0.0, 0.0), soft=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    result = estimated(made)
    assert made.declination_deg > 11.0
    assert np.array(result.compass_error_deg) == pytest.approx(-made.declination_deg, abs=1e-6)
    assert np.array(result.deviation_deg) == pytest.approx(0.0, abs=1e-6)


def test_an_ins_heading_too_large_makes_a_too_small() -> None:
    right, wrong = estimated(make()), estimated(make(ins_error_deg=0.5))
    change = np.subtract(values_of(wrong.coefficients_deg), values_of(right.coefficients_deg))
    assert change == pytest.approx([-0.5, 0.0, 0.0, 0.0, 0.0], abs=FROM_GRID_DEG)
    aligned = estimated(make(ins_error_deg=0.5), heading=taxi_heading(error_deg=0.5))
    assert values_of(aligned.coefficients_deg) == pytest.approx(values_of(right.coefficients_deg), abs=EXACT_DEG)


def test_sigma_of_a_is_the_quadrature_of_its_parts() -> None:
    result = estimated(make(**NOISE))
    total = math.sqrt(sum(part.sigma_deg**2 for part in result.a_parts))
    assert result.coefficients_sigma_deg["A"] == pytest.approx(total, rel=1e-6)
    assert {part.name for part in result.a_parts} >= {"alignment", "declination", "INS drift until the figure"}
    assert result.coefficients_sigma_deg["A"] > result.declination.sigma_deg > 0.3


@pytest.mark.parametrize(("horizontal_nt", "down_nt"), [(133.0, 0.0), (0.0, 282.0), (-133.0, 141.0)])
def test_a_field_off_the_model_leaves_b_to_e_and_shows_in_the_dip(horizontal_nt: float, down_nt: float) -> None:
    """Z that the readings show beyond the model's H / Z is told, and D does not take it upon itself."""
    made = make(field_error_nt=(horizontal_nt, down_nt), field_noise_nt=20.0, attitude_noise_deg=0.02)
    result = estimated(made)
    row = result.method("poisson_attitude")
    error = np.array([row.coefficients_deg[letter] for letter in "BCDE"]) - made.coefficients_deg[1:]
    assert (np.abs(error) < 2.5 * shape_sigmas(result)).all()
    assert abs(error[2]) < 0.02  # 0.1 deg and more where Z is taken from the model


def test_strength_of_the_field_is_in_the_sigma_of_the_soft_iron_alone() -> None:
    """The readings show Z / H, so that the model's H and Z both say the strength; no heading depends on it."""
    made = make()
    exact = MagneticSettings(attitude_wander_deg=0.0, declination_deg=made.declination_deg, declination_sigma_deg=0.0)
    result = estimated(made, settings=exact, heading=taxi_heading(standard_error_deg=0.0))
    assert result.poisson is not None
    of_strength = 1.0 / np.hypot(made.horizontal_nt / 133.0, made.down_nt / 141.0)
    diagonal = np.diag(result.poisson.soft_iron_sigma)
    assert diagonal == pytest.approx(of_strength * np.diag(SOFT), rel=0.02)
    assert (shape_sigmas(result) < 0.02).all()


def test_wander_of_the_attitude_stands_in_the_sigmas_of_b_and_c() -> None:
    """The settings' counts as four stretches of level flight, beside those of this flight, which show none."""
    steady, wandering = (estimated(make(), settings=MagneticSettings(attitude_wander_deg=deg)) for deg in (0.0, 0.1))
    field = steady.declination
    assert field.horizontal_nt is not None and field.down_nt is not None
    assert steady.attitude_wander_deg == pytest.approx(0.0, abs=1e-9)
    assert wandering.attitude_wander_deg == pytest.approx(0.1 * math.sqrt(4.0 / (4.0 + LEVEL_STRETCHES - 1)))
    expected = wandering.attitude_wander_deg * abs(field.down_nt) / field.horizontal_nt
    for name in ("compass_table", "poisson_attitude"):
        low, high = (result.method(name).coefficients_sigma_deg for result in (steady, wandering))
        added = {letter: np.sqrt(max(high[letter] ** 2 - low[letter] ** 2, 0.0)) for letter in LETTERS}
        assert (added["B"], added["C"]) == pytest.approx((expected, expected), rel=DIP_MOVES)
        others = [added[letter] for letter in ("A", "D", "E")]  # the iron's through the dip besides
        assert (np.array(others) > 0.2 * expected).all() and (np.array(others) < 0.7 * expected).all()


def test_wander_that_level_flight_shows_is_believed() -> None:
    made = make()
    time_s = made.flight.time_s("ins")
    roll = made.flight["ins"].values("roll_deg") + 0.4 * np.sin(2.0 * np.pi * time_s / 260.0)
    calm, wandering = estimated(made), estimated(changed(made, "ins", with_column("roll_deg", roll)))
    assert calm.attitude_wander_deg is not None and calm.attitude_wander_deg < 0.04
    assert wandering.attitude_wander_deg is not None and 0.15 < wandering.attitude_wander_deg < 0.4
    assert (shape_sigmas(wandering)[:2] > 4.0 * shape_sigmas(calm)[:2]).all()


def test_field_far_off_the_model_is_rejected() -> None:
    result = estimated(make(field_error_nt=(0.0, -2000.0)))
    assert (result.verdict, state_of(result, "dip")) == ("reject", "failed")
    assert state_of(estimated(make()), "dip") == "passed"


def test_turning_the_world_reordering_topics_and_shifting_time_change_nothing() -> None:
    before = estimated(make())
    turned = estimated(make(turn_world_deg=137.0))
    assert values_of(turned.method("poisson_attitude").coefficients_deg) == pytest.approx(
        values_of(before.method("poisson_attitude").coefficients_deg), abs=EXACT_DEG
    )
    assert values_of(turned.coefficients_deg) == pytest.approx(values_of(before.coefficients_deg), abs=0.05)
    made = make()
    twin = replace(make(hard_nt=(9e3, 0.0, 0.0)).flight["magnetometer"], topic="magnetometer.2")
    tables = {"magnetometer.2": twin, **dict(reversed(list(made.flight.tables.items())))}
    reordered = estimated(replace(made, flight=replace(made.flight, tables=tables)))
    assert replace(reordered, figures=()) == replace(before, figures=())
    later = 1000 * NS_PER_S
    tables = {name: replace(item, time_ns=item.time_ns + later) for name, item in made.flight.tables.items()}
    shifted = estimated(
        replace(made, flight=replace(made.flight, tables=tables, start_ns=made.flight.start_ns + later))
    )
    assert values_of(shifted.coefficients_deg) == pytest.approx(values_of(before.coefficients_deg), abs=1e-5)
    other = changed(made, "ins", lambda table: table.take(np.random.default_rng(2).random(len(table)) > 0.33))
    assert values_of(estimated(other).coefficients_deg) == pytest.approx(values_of(before.coefficients_deg), abs=0.01)


# Honest


@pytest.mark.slow
def test_coverage_over_forty_flights() -> None:
    """A to E within 3 sigma, held-out mean within 2, over irons of 1500 nT and 0.02, seeds 1000 to 1039."""
    within3: list[bool] = []
    within2: list[bool] = []
    for seed in range(FLIGHTS):
        rng = np.random.default_rng(1000 + seed)
        soft = np.eye(3) + 0.02 * rng.standard_normal((3, 3))
        made = make(
            seed=seed,
            hard_nt=tuple(1500.0 * rng.standard_normal(3)),
            soft=tuple(map(tuple, soft)),
            ins_error_deg=0.1 * rng.standard_normal(),
            declination_error_deg=0.4 * rng.standard_normal(),
            **NOISE,
        )
        result = estimated(made)
        for name in ("compass_table", "poisson_attitude"):
            row = next(item for item in result.methods if item.name == name)
            error = np.subtract(values_of(row.coefficients_deg), made.coefficients_deg)
            within3 += list(np.abs(error) <= 3.0 * np.array(values_of(row.coefficients_sigma_deg)))
            assert row.held_out_mean_deg is not None
            assert row.held_out_mean_sigma_deg is not None
            within2.append(abs(row.held_out_mean_deg) <= 2.0 * row.held_out_mean_sigma_deg)
    assert np.mean(within3) >= 0.98  # 0.9973 less 5 binomial sigma of some 200 independent ones
    assert np.mean(within2) >= 0.85  # 0.954 less 3 binomial sigma of 40


def test_latency_cancels_in_the_table_and_is_put_back_where_known() -> None:
    exact, late = estimated(make()), make(latency_s=0.3)
    found = estimated(late)
    assert values_of(found.coefficients_deg) == pytest.approx(values_of(exact.coefficients_deg), abs=0.1)
    assert any("differ by twice" in remark for remark in found.remarks)
    row = Latency("ins", "magnetometer", "field", "observed", "", 0.3, 0.01, (0.28, 0.32))
    known = estimated(late, latencies=Latencies((row,)))
    assert known.method("poisson_attitude").held_out_after_deg == pytest.approx(0.0, abs=1e-6)
    assert any("latency of +0.300 s" in remark for remark in known.remarks)


def test_current_is_fitted_where_it_is_logged() -> None:
    made = make(current_nt_per_a=(12.0, -8.0, 5.0))
    found = estimated(made)
    assert found.poisson is not None
    assert found.poisson.current_effect_nt_per_a == pytest.approx((12.0, -8.0, 5.0), abs=1e-6)
    assert found.method("poisson_attitude").held_out_after_deg == pytest.approx(0.0, abs=1e-6)
    blind = replace(made, flight=replace(made.flight, tables={k: made.flight[k] for k in ("ins", "magnetometer")}))
    worse = estimated(blind).method("poisson_attitude").held_out_after_deg
    assert worse is not None
    assert worse > 0.5


def test_repeated_figures_are_compared() -> None:
    made = make(turns=(*LEVEL[:3], *EIGHT, *LEVEL[3:], *EIGHT))
    result = estimated(made)
    assert len(result.swings) == 2
    assert result.swings[0].difference_rms_deg == pytest.approx(0.0, abs=0.02)
    assert state_of(result, "repeatability") == "passed"
    half = result.swings[1].start_s - 1.0
    moved = made.flight["magnetometer"].values("field_forward_nt") + 600.0 * (made.flight.time_s("magnetometer") > half)
    other = estimated(changed(made, "magnetometer", with_column("field_forward_nt", moved)))
    assert other.verdict == "reject"
    assert "repeated figures" in other.verdict_reason


def test_free_field_finds_the_dip() -> None:
    made = make()
    undated = replace(made, flight=replace(made.flight, has_utc=False))
    settings = MagneticSettings(declination_deg=made.declination_deg)
    result = estimated(undated, settings=settings)
    assert (result.declination.model, result.declination.horizontal_nt) == ("as stated", None)
    left = result.method("poisson_attitude").held_out_after_deg
    assert left == pytest.approx(0.0, abs=0.01)  # the search for the dip ends within 1e-5 of it


def test_constant_modulus_states_its_condition_number() -> None:
    row = estimated(make(**NOISE)).method("constant_modulus")
    assert row.state == "refused"
    assert row.condition_number is not None
    assert f"condition number {row.condition_number:.3g}" in row.reason


def test_card_leads_from_reading_to_heading() -> None:
    result = estimated(make(**NOISE), settings=MagneticSettings(card_step_deg=15))
    assert len(result.card) == 24
    for row in result.card:
        assert (row.steer_deg + row.deviation_deg - row.magnetic_heading_deg + 180.0) % 360.0 == pytest.approx(180.0)
        assert row.sigma_deg > 0.0
    assert json.dumps(to_json(result), allow_nan=False)


def test_the_figure_eight_of_the_simulator_gives_its_iron_back() -> None:
    """Another room made the flight; the INS is 0.99 deg wrong, found on taxi."""
    scenario = load_scenario("figure-eight")
    assert scenario.magnetometer is not None
    flight = simulate(scenario).flight
    result = estimate_deviation(flight, heading=estimate_heading_error(flight))
    assert result.poisson is not None
    error = np.subtract(result.poisson.hard_iron_nt, scenario.magnetometer.hard_iron_nt)
    assert np.all(np.abs(error) < 4.0 * np.array(result.poisson.hard_iron_sigma_nt))
    soft = np.abs(np.subtract(result.poisson.soft_iron, scenario.magnetometer.soft_iron))
    assert np.all(soft < 4.0 * np.array(result.poisson.soft_iron_sigma))
    assert result.residual_rms_deg is not None
    assert result.residual_rms_deg.after < 0.2 < 2.0 < result.residual_rms_deg.before


# Refused, with the reason


@pytest.mark.parametrize(
    ("turns", "reason"),
    [
        (LEVEL[:1], "no opposite turns"),
        (((20.0, 380.0),), "no opposite turn"),
        (((20.0, 380.0), (-27.0, -380.0)), "20 deg, opposite 27 deg, may differ by 3"),
        (((20.0, 200.0), (-20.0, -200.0)), "of the circle"),
        (((55.0, 380.0), (-55.0, -380.0)), "bank 55 deg, at most 50"),
    ],
)
def test_what_is_no_figure_says_why(turns: tuple[tuple[float, float], ...], reason: str) -> None:
    with pytest.raises(NotAssessableError, match="cover the circle") as caught:
        estimated(make(turns=turns))
    assert reason in str(caught.value)


def test_a_changing_altitude_or_bank_is_rejected() -> None:
    made = make(turns=EIGHT)
    climbing = 1000.0 + 2.0 * made.flight.time_s("ins")
    with pytest.raises(NotAssessableError, match=r"altitude changed by \d+ m, at most 100"):
        estimated(changed(made, "ins", with_column("altitude_ellipsoid_m", climbing)))
    with pytest.raises(NotAssessableError, match=r"unsteady bank: standard deviation"):
        estimated(make(turns=EIGHT, bank_sway_deg=2.5), settings=MagneticSettings(bank_sd_max_deg=1.0))


def test_an_incomplete_figure_is_used_but_rejected() -> None:
    result = estimated(make(turns=(*LEVEL, (20.0, 330.0), (-20.0, -330.0))))
    assert 0.75 <= result.coverage.share < 0.98
    assert result.coverage.interpolated_bins > 7
    assert result.verdict == "reject"
    assert "circle covered" in result.verdict_reason
    assert np.isfinite(result.deviation_deg).all()


def test_a_figure_alone_leaves_nothing_to_judge_by() -> None:
    result = estimated(make(turns=EIGHT), settings=MagneticSettings(held_out_samples_min=2000))
    assert (result.verdict, result.residual_rms_deg) == ("undecided", None)
    assert state_of(result, "held_out") == "not_measured"


@pytest.mark.parametrize(("before", "is_told"), [(np.nan, True), (0.0, True), (-1.0, False)])
def test_a_correction_entered_after_the_alignment_is_told(before: float, is_told: bool) -> None:
    """It stands nowhere before it is entered, as in a log whose field is absent until then, or changes."""
    made = make()
    aligned_at_s = estimated(made).alignment.aligned_at_s
    assert aligned_at_s is not None
    times_s = np.array([aligned_at_s - 2.0, aligned_at_s - 1.0, aligned_at_s + 5.0, aligned_at_s + 6.0])
    time_ns = made.flight.start_ns + np.round(times_s * NS_PER_S).astype(np.int64)
    values = np.array([before, before, -1.0, -1.0])
    onboard = table("onboard", time_ns, {"correction_entered_deg": values})
    flight = replace(made.flight, tables={**made.flight.tables, "onboard": onboard})
    remarks = estimated(replace(made, flight=flight)).remarks
    assert any("a correction of -1.00 deg was entered" in remark for remark in remarks) == is_told


def test_low_altitude_is_told() -> None:
    result = estimated(make(altitude_m=600.0))
    assert state_of(result, "altitude") == "failed"
    assert result.verdict == "accept"
    assert any("below 1000 m" in remark for remark in result.remarks)


def test_a_date_no_model_serves_is_named() -> None:
    made = make()
    step = iso_to_utc_ns("2031-07-01T00:00:00Z")[0] - made.flight.start_ns
    tables = {name: replace(made.flight[name], time_ns=made.flight[name].time_ns + step) for name in made.flight.tables}
    late = replace(made, flight=replace(made.flight, tables=tables, start_ns=made.flight.start_ns + step))
    with pytest.raises(NotAssessableError, match="2031-07-01"):
        estimated(late)
    with pytest.raises(NotAssessableError, match="no date"):
        estimated(replace(made, flight=replace(made.flight, has_utc=False)))


def test_a_heading_that_may_be_magnetic_is_no_reference() -> None:
    made = make()
    with pytest.raises(NotAssessableError, match="no independent reference"):
        estimated(made, kinds={"ins": "gnss_aided"})
    aided = changed(made, "ins", lambda table: with_column("mode", np.full(len(table), "gnss_aided"))(table))
    with pytest.raises(NotAssessableError, match="no independent reference"):
        estimated(aided)
    trusted = estimated(aided, settings=MagneticSettings(trusts_aided_heading=True))
    assert any("the settings state" in remark for remark in trusted.remarks)
    derived = {"derived.ins.true_heading_deg": "magnetic_heading_deg and variation"}
    with pytest.raises(NotAssessableError, match="derived the true heading"):
        estimated(replace(made, flight=replace(made.flight, metadata=derived)))


def nothing(table: Table) -> Table:
    return table.take(slice(0, 0))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("topic", "change", "reason"),
    [
        ("magnetometer", nothing, "no three-axis magnetometer"),
        ("magnetometer", lambda table: table.take(slice(0, 1)), "too few readings"),
        ("ins", lambda table: table.take(slice(0, 1)), "too few readings"),
        ("ins", nothing, "no INS with roll"),
        ("magnetometer", lambda t: with_column("field_down_nt", np.full(len(t), np.nan))(t), "too few readings"),
        ("ins", lambda t: with_column("roll_deg", np.full(len(t), np.nan))(t), "too few readings"),
        ("ins", lambda t: with_column("valid", np.zeros(len(t), dtype=bool))(t), "too few readings"),
        ("ins", lambda table: table.take(slice(0, 900)), "turn"),
        ("ins", lambda table: table.take(slice(None, None, 50)), "no turn of steady bank"),
    ],
)
def test_what_is_missing_is_named(topic: str, change: Callable[[Table], Table], reason: str) -> None:
    with pytest.raises(NotAssessableError, match=reason):
        estimated(changed(make(), topic, change))
    with pytest.raises(NotAssessableError, match="no three-axis magnetometer"):
        estimate_deviation(Flight({}))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("value", [0.0, 1.0, -5e4, 1e300, np.inf])
def test_a_dead_or_wild_axis_gives_no_accepted_answer(value: float) -> None:
    made = make()
    dead = changed(made, "magnetometer", lambda t: with_column("field_right_nt", np.full(len(t), value))(t))
    try:
        result = estimated(dead)
    except NotAssessableError:
        return
    assert result.verdict != "accept"


def test_wild_readings_and_gaps_do_little() -> None:
    made = make()
    rng = np.random.default_rng(5)
    field = made.flight["magnetometer"].values("field_right_nt").copy()
    field[rng.integers(0, len(field), 40)] += 20_000.0
    field[rng.integers(0, len(field), 200)] = np.nan
    result = estimated(changed(made, "magnetometer", with_column("field_right_nt", field)))
    errors = np.subtract(values_of(result.method("poisson_attitude").coefficients_deg), made.coefficients_deg)
    assert np.abs(errors).max() < 0.05
