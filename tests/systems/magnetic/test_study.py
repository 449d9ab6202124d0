"""The magnetic study on a few flights: exact without noise, the claim and its limit, refusals, tables and page."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.results.figures import FigureData
from groundstation.simulation.magnetic_family import MagneticFamilySettings, draw_magnetic_scenario
from groundstation.simulation.scenario import MagnetometerSettings
from groundstation.systems import study
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.study import runs as magnetic_runs
from groundstation.systems.magnetic.study import tables as magnetic_tables
from groundstation.systems.magnetic.study.bias import formula_biases, power_law_above_floor
from groundstation.systems.magnetic.study.cases import (
    BANK,
    BANK_DEG,
    CLAIM,
    DIP,
    EXACT,
    INCOMPLETE,
    REFERENCE,
    SWEEPS,
    SWEPT,
    WIDE,
    Setup,
    seed_of,
)
from groundstation.systems.magnetic.study.coverage import coverage_table
from groundstation.systems.magnetic.study.flights import Hangar, judged_outcome
from groundstation.systems.magnetic.study.judge import (
    METHODS,
    NOT_ASSESSABLE,
    JudgedAnswer,
    JudgedMethod,
    errors_deg,
    level_circle,
)
from groundstation.systems.magnetic.study.magnetic import study_magnetic
from groundstation.systems.magnetic.study.page import (
    claim_text,
    coefficient_claim,
    limit_text,
    refusal_text,
    residual_claim,
)
from groundstation.systems.magnetic.study.runs import SeedJob, SeedOutcome, fly_job, run_jobs
from groundstation.systems.magnetic.study.tables import (
    BETTER,
    HELD_OUT,
    IRON,
    TABLE,
    UNDECIDED,
    WORSE,
    OutcomeSample,
    finding,
    resampling,
    rows_where,
    samples_of,
)
from groundstation.systems.study import StudyResult
from groundstation.tables.phases import PhaseInterval, Phases
from tests.told import missing_in

SEED, FEW = 5, 4
MANY, MANY_SEED = 200, 71
EXACT_IRON_DEG = 0.02  # readings rounded to 1 nT of 17 000, attitude noise of 0.005 deg times Z / H
SHIFTED_BINS_DEG = 0.02  # the readings fall into other bins of the table
WIDE_EXPONENT = 0.35  # of a few irons: harmonics of the bank itself and of the bins of the table
AIRBORNE = Phases((PhaseInterval(0.0, 1e5, "airborne"),), "made")
CLAIMED = tuple(setup for _bank, setup in CLAIM.points)


def job(run: int, flown: tuple[Setup, ...] = (), *, is_incomplete: bool = False, judged: bool = False) -> SeedJob:
    return SeedJob(run, seed_of(SEED, run), flown, MagneticFamilySettings() if judged else None, is_incomplete)


@pytest.fixture(scope="module")
def claimed() -> tuple[SeedOutcome, ...]:
    return run_jobs([job(run, CLAIMED) for run in range(FEW)])


def of_method(outcome: JudgedAnswer, method: str, *, whole: bool = True) -> float:
    return float((outcome.rms_deg if whole else outcome.shape_deg)[METHODS.index(method)])


# Flights


def test_iron_is_exact_without_noise_and_one_branch_is_worst(claimed: tuple[SeedOutcome, ...]) -> None:
    for run in claimed:
        at20 = run.swept[2]
        assert of_method(at20, IRON) < EXACT_IRON_DEG
        assert of_method(at20, IRON) < of_method(at20, TABLE) < of_method(at20, "one_branch")


def test_what_the_models_declination_lacks_stands_in_what_is_left() -> None:
    """True = magnetic + declination: a world that has more makes the corrected magnetic heading too large."""
    hangar, left, declination = Hangar(seed_of(SEED, 0)), [], []
    for family in (EXACT, replace(EXACT, field_error_sigmas=1.0)):
        flown = hangar.flown(draw_magnetic_scenario(family, hangar.seed), Setup(family, is_aligned=False))
        result = estimate_deviation(flown.flight, phases=AIRBORNE)
        middle = flown.field_ned_nt[len(flown.field_ned_nt) // 2]
        left.append(errors_deg(level_circle(flown, middle), result)[TABLE][0])
        declination.append(float(np.rad2deg(np.arctan2(middle[1], middle[0]))))
    lacking = declination[1] - declination[0]
    assert abs(lacking) > 0.1
    assert np.mean(left[1] - left[0]) == pytest.approx(lacking, abs=SHIFTED_BINS_DEG)


def test_taxi_aligns_the_ins_and_an_hour_of_drift_comes_back() -> None:
    hangar = Hangar(seed_of(SEED, 1))
    far = replace(SWEPT, heading_error_sigma_deg=5.0)
    wrong = abs(draw_magnetic_scenario(far, hangar.seed).ins.azimuth_error_deg)
    aligned, loose = (hangar.outcome(Setup(far, is_aligned=is_aligned)) for is_aligned in (True, False))
    assert wrong > 1.5
    assert of_method(aligned, IRON) < 1.5
    assert of_method(loose, IRON) > of_method(aligned, IRON) + 0.5 * wrong
    drifting = replace(far, drift_sigma_dph=3.0)
    drift = draw_magnetic_scenario(drifting, hangar.seed).ins.azimuth_drift_dph
    later, sooner = (hangar.outcome(Setup(drifting, hours_since_taxi=hours)) for hours in (1.0, 0.0))
    means = [one.judged[TABLE].coefficient_ratio[0] for one in (later, sooner)]
    assert np.sign(means[0] - means[1]) == np.sign(-drift)


def test_a_whole_flight_is_answered_and_judged() -> None:
    outcome = judged_outcome(MagneticFamilySettings(), seed_of(SEED, 0))
    assert outcome.verdict == "accept", outcome.reason
    assert of_method(outcome, IRON) < of_method(outcome, "none")
    for judged in outcome.judged.values():
        assert np.isfinite([judged.held_out_ratio, judged.own_ratio, judged.curve_ratio]).all()
        assert judged.held_out_rms_deg < outcome.before_rms_deg
        assert (np.diff(judged.curve_inside) >= 0.0).all()


@pytest.mark.slow
def test_seed_decides_everything_in_one_process_and_in_several(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = [job(run, (REFERENCE,)) for run in (0, 1)]
    alone = run_jobs(jobs)
    monkeypatch.setattr(study, "POOLED_FROM", 1)
    pooled = run_jobs(jobs)
    for one, other in zip(alone, pooled, strict=True):
        assert np.array_equal(one.swept[0].rms_deg, other.swept[0].rms_deg, equal_nan=True)
        assert np.array_equal(one.biases.average_deg, other.biases.average_deg)
    assert not np.array_equal(alone[0].swept[0].rms_deg, alone[1].swept[0].rms_deg)
    assert np.array_equal(fly_job(jobs[1]).swept[0].shape_deg, alone[1].swept[0].shape_deg, equal_nan=True)


def test_points_of_a_sweep_share_iron_and_errors() -> None:
    seed = seed_of(SEED, 2)
    at10, at30 = (draw_magnetic_scenario(setup.family, seed) for _bank, setup in (BANK.points[0], BANK.points[4]))
    assert at10.magnetometer == at30.magnetometer
    assert at10.ins == at30.ins
    assert at10.legs != at30.legs
    assert len({seed_of(one, run) for one in (0, 1) for run in range(1000)}) == 2000


@pytest.mark.parametrize("kind", INCOMPLETE)
def test_incomplete_figures_are_not_accepted(kind: str) -> None:
    outcome = Hangar(seed_of(SEED, 0)).outcome(REFERENCE, INCOMPLETE[kind](BANK_DEG))
    assert outcome.verdict in (NOT_ASSESSABLE, "reject")
    assert outcome.reason


# The claim and its limit


def test_claim_and_its_limit_hold_loosely(claimed: tuple[SeedOutcome, ...]) -> None:
    samples = samples_of(claimed, CLAIMED, SEED)
    claim = magnetic_tables.claim_table(claimed, samples)
    assert (claim["left"] < 0.6).all()
    assert (np.diff(claim["flown_average_deg"]) > 0.0).all()
    assert claim["formula_average_deg"] == pytest.approx(claim["flown_average_deg"], rel=0.35)  # H and Z differ by 3 %
    power = magnetic_tables.power_table(claimed, samples | {setup: samples[CLAIMED[0]] for _bank, setup in BANK.points})
    assert power["exponent"][:2] == pytest.approx(2.0, abs=WIDE_EXPONENT)


def test_bias_by_formula_is_nothing_without_iron_and_as_published_with_it() -> None:
    nothing = formula_biases(MagnetometerSettings(hard_iron_nt=(0.0, 0.0, 0.0)))
    assert nothing.average_deg == pytest.approx(0.0, abs=1e-9)
    drawn = [draw_magnetic_scenario(EXACT, seed_of(SEED, run)).magnetometer for run in range(60)]
    biases = [formula_biases(one) for one in drawn if one is not None]
    rms = np.sqrt(np.mean([np.square(one.average_deg) for one in biases], axis=0))
    assert rms[[0, 2, 4]] == pytest.approx([0.12, 0.46, 1.04], rel=0.2)  # 4 times the sampling error of 60 draws


@pytest.mark.parametrize(("exponent", "floor"), [(2.0, 0.4), (1.5, 0.1), (2.5, 0.0)])
def test_power_is_found_above_a_floor_of_noise(exponent: float, floor: float) -> None:
    banks = np.array([10.0, 15.0, 20.0, 25.0, 30.0])
    found, size = power_law_above_floor(banks, np.hypot(floor, 0.5 * (banks / 20.0) ** exponent)[None, :])
    assert (float(found[0]), float(size[0])) == pytest.approx((exponent, 0.5), abs=0.01)


# Tables and words of known outcomes


def known(rms_deg: float, ratio: float, verdict: str = "accept", reason: str = "") -> JudgedAnswer:
    """A flight on which every method errs by a figure and both judged ones by so many sigmas."""
    judged = JudgedMethod(np.full(5, ratio), np.array([abs(ratio) <= k for k in (1, 2, 3)], dtype=float),
                    float(abs(ratio) <= 1.96), abs(ratio), ratio, ratio, rms_deg, rms_deg)  # fmt: skip
    errors = np.full(len(METHODS), rms_deg)
    return JudgedAnswer(verdict, reason, errors, errors, True, 70.0, 17e3, {TABLE: judged, IRON: judged}, 2.0 * rms_deg,
                   IRON)  # fmt: skip


def sample(outcomes: list[JudgedAnswer]) -> OutcomeSample:
    return OutcomeSample(tuple(outcomes), resampling(len(outcomes), 1))


def test_rms_and_limits_of_known_flights() -> None:
    found = sample([known(3.0, 0.0), known(4.0, 0.0), known(float("nan"), 0.0)])
    drawn = found.rms(found.of_method(TABLE, whole=True))
    assert drawn[0] == pytest.approx(np.sqrt(12.5))
    assert magnetic_tables.interval(drawn)[1:] == pytest.approx((3.0, 4.0))
    assert (finding(0.5, 0.9), finding(0.9, 1.1), finding(1.1, 2.0)) == (BETTER, UNDECIDED, WORSE)
    assert finding(float("nan"), 1.0) == ""


def test_coverage_is_counted_and_told() -> None:
    honest = [known(1.0, ratio) for ratio in (0.5,) * 96 + (2.5,) * 4]
    table = magnetic_tables.honesty_table(sample(honest))
    row = np.flatnonzero(rows_where(table, method=IRON, error_of=HELD_OUT))[0]
    assert (table["inside1"][row], table["inside2"][row], table["inside3"][row]) == (0.96, 0.96, 1.0)
    assert table["inside2_low"][row] < 0.96 < table["inside2_high"][row]
    assert residual_claim(table, IRON).endswith("95 % wanted: reached.")
    few = magnetic_tables.honesty_table(sample([known(1.0, ratio) for ratio in (0.5,) * 93 + (2.5,) * 7]))
    assert residual_claim(few, IRON).endswith("missed by less than its sampling error.")
    none = magnetic_tables.honesty_table(sample([known(1.0, ratio) for ratio in (0.5,) * 50 + (3.5,) * 50]))
    assert residual_claim(none, IRON).endswith("missed.")
    assert "in 250 of 500 cases (50.0 %)" in coefficient_claim(none, IRON)
    assert coefficient_claim(table, IRON).endswith("None is shown to be worse than stated.")
    assert "worse than stated: A (50.0 % within 2 sigma), B" in coefficient_claim(none, IRON)


def test_coverage_of_a_cell_is_that_of_its_accepted_flights() -> None:
    flights = [known(0.2, 0.5), known(0.4, 2.5), known(9.0, 9.0, "reject")]
    table = coverage_table([("wide", "cell", flights), ("wide", "none", flights[2:])])
    assert (table["flights"].tolist(), table["accepted"].tolist()) == ([3, 1], [2, 0])
    assert (table["iron_a_to_e"][0], table["recommended_level"][0]) == (0.5, 0.5)
    assert table["iron_d_ratio"][0] == pytest.approx(np.sqrt((0.5**2 + 2.5**2) / 2.0))
    assert (table["recommended_rms_deg"][0], table["recommended_worst_deg"][0]) == (pytest.approx(np.sqrt(0.1)), 0.4)
    assert np.isnan(table["iron_level"][1])
    assert table.name not in {f"magnetic_{sweep.name}" for sweep in SWEEPS}


def test_reasons_are_counted_without_their_numbers() -> None:
    late, early = (
        f"no opposite turns that cover the circle: at {at} s +400 deg at +20 deg of bank: no opposite turn; at 900 s"
        for at in (37, 412)
    )
    refused = [known(1.0, 0.0, NOT_ASSESSABLE, text) for text in (late, early)]
    counted = magnetic_tables.reasons_of(refused)
    assert counted == {"no opposite turns that cover the circle: no opposite turn": 2}
    verdicts = magnetic_tables.verdict_table(sample([*refused, known(1.0, 0.0)]), (), {})
    assert (verdicts["accepted"][0], verdicts["not_assessable"][0], verdicts["modulus_refused"][0]) == (1, 2, 3)
    assert verdicts["most_frequent_reason"][0] == "no opposite turns that cover the circle: no opposite turn"


def test_words_of_refusals_follow_the_table() -> None:
    def told(verdict: str) -> str:
        half, right = known(1.0, 0.0, "reject", "too little"), known(1.0, 0.0, verdict, "none opposite")
        outcomes = {"half circles": half, "right turn": right}
        run = SeedOutcome(0, (), None, outcomes, formula_biases(MagnetometerSettings()))
        return refusal_text(magnetic_tables.incomplete_table([run]))

    assert told(NOT_ASSESSABLE).startswith("All 2 flights")
    assert not missing_in(told("accept"), "1 of 2 flights", "accepted were 1: right turn")


def test_words_of_the_claim_follow_the_table(claimed: tuple[SeedOutcome, ...]) -> None:
    samples = samples_of(claimed, CLAIMED, SEED)
    claim = magnetic_tables.claim_table(claimed, samples)
    assert claim_text(claim).startswith("The claim is confirmed with a limit")
    denied = FigureData(claim.name, {**claim.columns, "left_high": np.ones(len(claim))}, claim.digits)
    assert claim_text(denied).startswith("The claim is not confirmed")
    power = magnetic_tables.power_table(claimed, samples | {setup: samples[CLAIMED[0]] for _bank, setup in BANK.points})
    steep = FigureData(
        power.name,
        {**power.columns, **{f"exponent{end}": np.full(len(power), 3.0) for end in ("", "_low", "_high")}},
        power.digits,
    )
    assert "not as its square" in limit_text(steep)


@pytest.mark.slow
def test_study_has_its_tables_and_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each kind of incomplete figure is flown by a test of its own, and two points are a sweep, too."""
    incomplete = dict(list(INCOMPLETE.items())[:2])
    monkeypatch.setattr(magnetic_runs, "INCOMPLETE", incomplete)
    sweeps, lines = (BANK, replace(DIP, points=DIP.points[1:3])), list[str]()
    study = study_magnetic(runs=2, seed=SEED, progress=lines.append, sweeps=sweeps)
    assert isinstance(study, StudyResult)
    assert (study.name, len(lines)) == ("magnetic", 2)
    tables = {table.name: table for table in study.tables}
    assert len(tables) == len(study.tables)
    assert all(len(table) for table in study.tables)
    for sweep in sweeps:
        table = tables[f"magnetic_{sweep.name}"]
        assert len(table) == len(sweep.points) * len(METHODS)
        assert set(table["flights"]) == {2}
    assert set(tables["magnetic_incomplete"]["figure"]) == set(incomplete)
    cells = tables["magnetic_cells"]
    assert cells["cell"][cells["family"] == "wide"].tolist() == list(WIDE)[:2]
    assert (tables["magnetic_verdicts"]["accepted"] <= tables["magnetic_verdicts"]["flights"]).all()
    for text in ("## Is what is left within the stated sigma?", "The claim is ", "grows as bank to the power"):
        assert text in study.markdown
    assert "nan" not in study.markdown


@pytest.mark.slow
def test_two_hundred_flights_keep_what_is_claimed() -> None:
    study = study_magnetic(runs=MANY, seed=MANY_SEED)
    tables = {table.name: table for table in study.tables}
    honesty = tables["magnetic_honesty"]
    for method in (TABLE, IRON):
        held_out = np.flatnonzero(rows_where(honesty, method=method, error_of=HELD_OUT))[0]
        assert honesty["inside2"][held_out] >= 0.95
        for letter in "ABCDE":
            row = np.flatnonzero(rows_where(honesty, method=method, error_of=letter))[0]
            assert honesty["inside3"][row] >= 0.985, (method, letter)
    claim, power = tables["magnetic_claim"], tables["magnetic_power"]
    published = np.isfinite(claim["published_deg"])
    assert claim["formula_average_deg"][published] == pytest.approx(claim["published_deg"][published], rel=0.12)
    assert power["exponent"][:2] == pytest.approx(2.0, abs=0.15)
    assert 14.0 < power["bank_deg"][1] < 18.0
    incomplete = tables["magnetic_incomplete"]
    assert "accept" not in incomplete["verdict"]
