"""The forecast study on a few flights: where windows help and where they do not, honesty, tables and page."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UsageError
from groundstation.pipeline.verbs.catalogue import catalogue
from groundstation.pipeline.verbs.synthesis import study_to
from groundstation.results.figures import FigureData
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.simulation.inertial_family import simulate_family
from groundstation.systems import systems
from groundstation.systems.inertial import coupled
from groundstation.systems.inertial.coupled_forecast import StepsAhead
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.study import forecast
from groundstation.systems.inertial.study import tables as forecast_tables
from groundstation.systems.inertial.study.cases import FIRST_SEED, NEW_ROUTES, FilterCase, epochs_of, study_cases
from groundstation.systems.inertial.study.coupled_bank import (
    LEAD_STEP_S,
    LEADS,
    VARIANCE_STEP_S,
    SetForecasts,
    fly_bank,
    grown_variances,
)
from groundstation.systems.inertial.study.forecast import study_forecast
from groundstation.systems.inertial.study.outages import fly_with_outages, outages_of
from groundstation.systems.inertial.study.runs import (
    COUPLED,
    METHOD_NAMES,
    STUDY_HORIZONS_MIN,
    CaseFlight,
    replay_flight,
    run_cases,
)
from groundstation.systems.inertial.study.tables import BETTER, UNDECIDED, WORSE, Resampled, finding
from groundstation.systems.study import StudyResult

SEED, FLIGHTS = 5, 12
SETTINGS = InertialSettings()
CASES = {case.name: case for case in study_cases(SEED)}
SHORT = ("matched", "coloured", "gated", "inflated", "walk")
LEFT_OUT = tuple(case.name for case in CASES.values() if case.is_held_out)[1:]  # of a study as a whole
COVERAGE_SPREAD = (
    0.03  # of the mean over 12 flights: 0.008 a flight's spread of 0.03, doubled, and the scale's own noise
)
ROUNDING_M = 1e-9


@pytest.fixture(scope="module")
def outcomes() -> dict[str, tuple[CaseFlight, ...]]:
    return run_cases([CASES[name] for name in SHORT], FLIGHTS, FLIGHTS, SETTINGS)


@pytest.fixture(scope="module")
def samples(outcomes: dict[str, tuple[CaseFlight, ...]]) -> dict[str, Resampled]:
    return {name: Resampled.of(several, SEED) for name, several in outcomes.items()}


def at_horizon(values: np.ndarray, minutes: float) -> float:
    return float(values[0, STUDY_HORIZONS_MIN.index(minutes)])


@pytest.mark.slow
def test_windows_hurt_where_the_model_is_exactly_true(samples: dict[str, Resampled]) -> None:
    ratio = samples["matched"].ratio("windows")
    assert at_horizon(ratio, 10.0) > 1.5
    low = np.quantile(ratio[1:], 0.025, axis=0)
    assert low[0] > 1.0
    assert at_horizon(ratio, 10.0) > at_horizon(ratio, 60.0) > 1.0


@pytest.mark.slow
def test_windows_help_where_coloured_gnss_is_taken_for_white(samples: dict[str, Resampled]) -> None:
    ratio = samples["coloured"].ratio("windows")
    assert (np.quantile(ratio[1:], 0.975, axis=0) < 0.9).all()


@pytest.mark.slow
def test_inflating_r_honestly_beats_windows(samples: dict[str, Resampled]) -> None:
    cured = samples["inflated"].rms_m("last_estimate") / samples["coloured"].rms_m("windows")
    assert at_horizon(cured, 10.0) < 0.8
    assert at_horizon(cured, 60.0) < 0.9
    assert at_horizon(samples["inflated"].ratio("windows"), 10.0) > 1.2


@pytest.mark.slow
def test_windows_of_a_walking_drift_hurt_at_first_and_help_beyond_an_hour(samples: dict[str, Resampled]) -> None:
    ratio = samples["walk"].ratio("windows")
    assert at_horizon(ratio, 10.0) > 1.2
    assert at_horizon(ratio, 84.0) < 1.0
    assert at_horizon(samples["walk"].ratio("drift_windows"), 30.0) < 0.9


@pytest.mark.slow
def test_sigma_of_the_matched_last_estimate_is_honest(outcomes: dict[str, tuple[CaseFlight, ...]]) -> None:
    table = forecast_tables.honesty_table({"matched": outcomes["matched"]})
    chosen = (table["method"] == "last_estimate") & (table["horizon_min"] <= 30.0)
    assert table["coverage95"][chosen] == pytest.approx(0.95, abs=COVERAGE_SPREAD)
    assert table["coverage95_model"][chosen] == pytest.approx(0.95, abs=COVERAGE_SPREAD)
    assert ((table["coverage50"] < table["coverage68"]) & (table["coverage68"] < table["coverage95"])).all()
    share = table["flights_within"][table["method"] == "last_estimate"]
    assert (share >= 0.6).all()  # of 12 flights that the model fits: fewer than 8 once in 10 000 times
    assert (table["coverage95_worst"] <= table["coverage95"] + table["coverage95_sigma"]).all()
    inside = (table["first_model"] >= table["first_low"]) & (table["first_model"] <= table["first_high"])
    assert inside[table["method"] == "last_estimate"].all()


def test_outcomes_do_not_depend_on_how_many_run_or_on_threads() -> None:
    case = CASES["walk"]
    several = run_cases([case], 2, 2, SETTINGS)[case.name]
    batch = simulate_family(case.family, 1, case.seed, first_run=1)
    again = replay_flight(case, batch, 0, False, SETTINGS)
    assert np.array_equal(again.mean_square_m2, several[1].mean_square_m2, equal_nan=True)
    assert not np.array_equal(again.mean_square_m2, several[0].mean_square_m2, equal_nan=True)


def test_forecast_is_judged_by_the_truth_and_not_by_gnss() -> None:
    """Raw INS from the start at 3 h: exactly the true error that builds up, whatever GNSS shows."""
    case = CASES["matched"]
    batch = simulate_family(case.family, 1, case.seed)
    outcome = replay_flight(case, batch, 0, False, SETTINGS)
    place = (METHOD_NAMES.index("raw_ins"), 4, 0)
    built = batch.position_error_m[0, 11_400] - batch.position_error_m[0, 10_800]
    assert np.sqrt(outcome.mean_square_m2[place]) == pytest.approx(np.hypot(*built), abs=ROUNDING_M)
    assert np.isnan(outcome.mean_square_m2[0, 4, STUDY_HORIZONS_MIN.index(120.0)])  # 3 h and 120 min do not fit


def test_seeds_were_not_used_for_tuning_and_pairs_share_flights() -> None:
    assert all(case.seed >= FIRST_SEED for case in study_cases(0))
    assert not {case.seed for case in study_cases(1)} & {case.seed for case in study_cases(2)}
    assert CASES["coloured"].seed == CASES["inflated"].seed == CASES["gated"].seed
    assert CASES["coloured"].family == CASES["inflated"].family
    assert CASES["matched"].family == CASES["walk"].family
    assert sum(case.is_held_out for case in CASES.values()) == 8
    assert [case.name for case in CASES.values() if case.is_new] == list(NEW_ROUTES)
    assert all(case.family.each_its_own == case.is_new for case in CASES.values())


def test_a_case_measures_what_it_says() -> None:
    case = replace(CASES["straight"], family=replace(CASES["straight"].family, duration_s=900.0))
    batch = simulate_family(case.family, 1, case.seed)
    epochs = epochs_of(case, batch, 0)
    assert np.isfinite(epochs.velocity_mps).all()
    assert np.any(epochs.drag_per_s != 0.0)
    expected = batch.position_error_m[0] - batch.gnss_position_error_m[0]
    assert np.array_equal(epochs.position_m, expected)
    assert np.isnan(epochs_of(CASES["matched"], batch, 0).velocity_mps).all()


def flat(value: float) -> CaseFlight:
    """A flight on which every method errs by ``value`` metres, the windows by half as much again."""
    squares = np.full((len(METHOD_NAMES), 5, len(STUDY_HORIZONS_MIN)), value**2)
    squares[METHOD_NAMES.index("windows")] *= 1.5**2
    return CaseFlight(squares, 0.0, None)


def test_rms_ratios_and_limits_of_known_flights() -> None:
    sample = Resampled.of([flat(3.0), flat(4.0)], seed=1)
    assert at_horizon(sample.rms_m("raw_ins"), 10.0) == pytest.approx(np.sqrt(12.5))
    assert np.unique(np.round(sample.ratio("windows"), 12)) == pytest.approx([1.5])
    _, low, high = forecast_tables.interval(sample.rms_m("raw_ins"))
    assert (low[0], high[0]) == pytest.approx((3.0, 4.0))
    table = forecast_tables.ratio_table({"flat": sample})
    windows = table["method"] == "windows"
    assert set(table["finding"][windows]) == {WORSE}
    assert set(table["finding"][~windows]) == {UNDECIDED}
    assert (finding(0.5, 0.9), finding(0.9, 1.1), finding(float("nan"), 1.0)) == (BETTER, UNDECIDED, "")


def test_held_out_winner_is_the_least_geometric_mean() -> None:
    case: FilterCase = CASES["straight"]
    table = forecast_tables.held_out_table([case], {case.name: Resampled.of([flat(3.0), flat(4.0)], seed=1)})
    assert table["method"][-1] == "windows"
    assert table["score"][-1] == pytest.approx(1.5)


@pytest.mark.slow
@pytest.mark.parametrize("left_out", [LEFT_OUT, ()], ids=["few", "all"])
def test_study_writes_its_tables_and_page(monkeypatch: pytest.MonkeyPatch, left_out: tuple[str, ...]) -> None:
    cases = {name: case for name, case in CASES.items() if name not in left_out}
    monkeypatch.setattr(forecast, "study_cases", lambda _seed: tuple(cases.values()))
    lines: list[str] = []
    study = study_forecast(runs=2, seed=SEED, progress=lines.append)
    assert isinstance(study, StudyResult)
    assert study.name == "forecast"
    assert len(lines) == 2 * len({case.seed for case in cases.values()})
    tables: dict[str, FigureData] = {table.name: table for table in study.tables}
    assert len(tables) == len(study.tables)
    assert all(len(table) for table in study.tables)
    assert set(tables["forecast_rms"]["method"]) == {*FORECAST_METHODS, COUPLED}
    held_out = {case.name for case in cases.values() if case.is_held_out}
    assert set(tables["forecast_rms"]["case"][tables["forecast_rms"]["method"] == COUPLED]) == held_out
    assert set(tables["forecast_rms"]["starts"]) == {"all", "1.5 h", "2 h", "2.5 h", "3 h"}
    assert set(tables["forecast_rms"]["case"]) == set(cases)
    assert set(tables["forecast_honesty"]["case"]) == {"matched", *held_out}
    assert set(tables["forecast_outages"]["case"]) == held_out
    assert set(tables["forecast_coupled_bank"]["case"]) == held_out
    for text in (
        "Outages in the log",
        "Are windows better than the last estimate?",
        "Best by score: ",
        "confirmed at ",
    ):
        assert text in study.markdown
    assert "nan" not in study.markdown


def test_the_bank_on_the_coupled_model_is_weighted_by_what_was_over() -> None:
    """Before any outage was over the weights are those given; a set that forecasts well gets the weight later."""
    start_s = 1800.0 + 300.0 * np.arange(30)
    rng = np.random.default_rng(2)
    actual = rng.normal(0.0, 50.0, (30, LEADS, 2))
    mean = np.stack([actual + rng.normal(0.0, 10.0, actual.shape), actual + rng.normal(0.0, 300.0, actual.shape)])
    sets = SetForecasts(mean, np.full(mean.shape, 100.0))
    replay = Hindcast(np.arange(30), start_s, LEAD_STEP_S * np.arange(1.0, LEADS + 1.0), {}, actual)
    weight = sets.weights(replay, np.zeros(LEADS), np.array([0.25, 0.75]))
    assert weight.sum(axis=0) == pytest.approx(1.0)
    assert weight[0, :2] == pytest.approx(0.25) and weight[0, 2:].min() > 0.99
    mixed, variance = sets.mixed(weight)
    assert np.abs(mixed[2:] - mean[0, 2:]).max() < 1.0
    apart = mean[0, 0] - mean[1, 0]
    assert variance[0] == pytest.approx(100.0 + 0.25 * 0.75 * np.square(apart))


def test_the_bank_on_the_coupled_model_forecasts_about_as_well_as_the_class() -> None:
    found = fly_bank(CASES["straight"], 0, SETTINGS)
    ratio = np.sqrt(found.mean_square_m2 / found.mean_square_m2[0])
    assert ratio[0] == pytest.approx(1.0) and (ratio > 0.7).all() and (ratio < 1.4).all()
    assert not np.allclose(ratio[1], ratio[2])
    assert (found.inside > 0.6).all() and (found.inside <= 1.0).all()


def test_outages_are_drawn_by_flight_and_leave_gnss_between_them() -> None:
    time_s = np.arange(16_001.0)
    several = [outages_of(time_s, 50_920, run) for run in range(20)]
    assert several[3] == outages_of(time_s, 50_920, 3) != several[4]
    lengths = np.array([end - begin for gaps in several for begin, end in gaps])
    assert 60.0 <= lengths.min() < 120.0 and 1800.0 < lengths.max() <= 3600.0
    assert all(gaps[0][0] == 3600.0 and gaps[-1][1] <= 15_100.0 for gaps in several)
    between = np.array([later - end for gaps in several for (_, end), (later, _) in pairwise(gaps)])
    assert between.min() >= 900.0 and between.max() <= 1800.0


def test_a_flight_with_outages_is_smoothed_as_well_as_without_a_gate() -> None:
    found = fly_with_outages(CASES["manoeuvring"], 0, SETTINGS)
    assert found.outages >= 3 and len(found.through) == found.outages and found.reopened == 0
    assert found.smoothed_m < 1.2 * found.free_m
    assert np.isfinite(found.after).any() and np.isfinite(found.undisturbed).any()


def test_every_study_is_listed_and_no_other_is_run(tmp_path: Path) -> None:
    listed = [entry["name"] for entry in catalogue() if entry["kind"] == "study"]
    names = ["heading", "crew", "installation", "forecast", "causes", "units", "ground", "units_over_time"]
    names += [
        "trajectory",
        "magnetic",
        "flux",
        "criteria",
        "approach",
        "along",
        "runways",
        "touchdown",
        "cooperative",
        "stations",
        "control",
        "landing",
    ]
    assert listed == [one.name for one in systems().studies] == names
    with pytest.raises(UsageError, match="one of heading, crew, installation, forecast"):
        study_to("weather", tmp_path / "out", runs=10, seed=1, force=False, listen=lambda event: None)
    assert not (tmp_path / "out").exists()


def test_variance_carried_back_from_the_leads_is_that_carried_forward() -> None:
    """Any entries of A, two starts, three sets of noise: sigma to rounding."""
    rng = np.random.default_rng(4)
    values = 1e-4 * rng.standard_normal((200, len(coupled.PATTERN)))
    step = rng.integers(0, 200, (2, 10 * LEADS))
    half = rng.standard_normal((3, 2, coupled.SIZE, coupled.SIZE))
    P, densities = half @ np.swapaxes(half, 2, 3), rng.uniform(0.0, 1.0, (3, coupled.SIZE))
    found = grown_variances(StepsAhead(slice(None), values, step, VARIANCE_STEP_S, 10), P, densities)
    for place in range(3):
        forward = coupled.RATES.variances(values, step, VARIANCE_STEP_S, 10, P[place], densities[place])
        assert found[place] == pytest.approx(forward[:, :, coupled.CHANNELS[:, 0]], rel=1e-9)
