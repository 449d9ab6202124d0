"""A compass that gives heading alone, in flight: known deviations come back, with honest errors and reasons."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.clock import Clock
from groundstation.base.errors import NotAssessableError, UsageError
from groundstation.base.ledger import Ledger
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.chapters.parts import Grid, Note
from groundstation.pipeline.one_flight.analyse import Given, analyse
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.files import save
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Manifest
from groundstation.results.roles import LETTERS
from groundstation.simulation.flux_valve import FluxFlight, FluxFlightSettings, simulate_flux_flight, valve_heading_deg
from groundstation.systems.known import Known
from groundstation.systems.magnetic import examine_flux as examining
from groundstation.systems.magnetic.apply_deviation import APPLIED, NOT_APPLIED, apply_deviation
from groundstation.systems.magnetic.chapter import magnetic
from groundstation.systems.magnetic.deviation_answer import (
    deviation_csv,
    deviation_from_csv,
    deviation_from_summary,
    flux_deviation_of,
)
from groundstation.systems.magnetic.deviation_to_apply import Apply
from groundstation.systems.magnetic.flux_advice_chapter import advise
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.flux_bank import followed, lean_error_deg
from groundstation.systems.magnetic.flux_epochs import find_legs, gather_epochs
from groundstation.systems.magnetic.flux_estimate import estimate_flux_deviation
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.flux_verdict import flux_rejudge
from groundstation.systems.magnetic.flux_wind import solve_wind
from groundstation.systems.magnetic.steer_card_page import steer_card
from groundstation.systems.magnetic.study.flux import CELLS, FluxRun, coverage_table, fly_and_judge
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.saved import load
from tests.schema_fields import SCHEMA
from tests.told import next_steps

SURE = 4.0  # sigmas: 5 coefficients of a few flights each
SEED = 3
EXACT_DEG = 1e-9
SAMPLED_MPS = 0.6  # gusts of 0.5 m/s over a minute, airspeed noise
TWO, FOUR = (0.0, 180.0), (0.0, 90.0, 180.0, 270.0)


@cache
def flown(**changes: object) -> FluxFlight:
    return simulate_flux_flight(replace(FluxFlightSettings(), **changes), SEED)  # type: ignore[arg-type]


@cache
def found(**changes: object) -> FluxDeviation:
    return estimate_flux_deviation(flown(**changes).flight)


def with_columns(flight: Flight, topic: str, **columns: np.ndarray) -> Flight:
    """The flight with other columns in a topic."""
    table = flight[topic]
    made = {**table.columns, **{name: Column(values) for name, values in columns.items()}}
    return replace(flight, tables={**flight.tables, topic: replace(table, columns=made)})


def without(flight: Flight, topic: str) -> Flight:
    return replace(flight, tables={name: table for name, table in flight.tables.items() if name != topic})


def whole(flight: Flight | None = None) -> FlightResults:
    """A whole run of a flight with a flux valve, eight legs, an INS."""
    source = Source("flux.csv", "ab" * 32, 1, "flat-csv")
    given = Given("NOTIME_abababab", source, Ledger(), Clock(), (), has_lost_data=False)
    return analyse(flight or flown().flight, given, Configuration())


whole_of_the_family = cache(whole)


def expect_truth(answer: FluxDeviation, truth_deg: np.ndarray) -> int:
    """Every coefficient given is within its sigma; returns their number."""
    given = 0
    for letter, true in zip(LETTERS, truth_deg, strict=True):
        row = answer.coefficient(letter)
        if row.value_deg is not None:
            given += 1
            assert abs(row.value_deg - true) < SURE * row.sigma_deg
    return given


def test_a_right_turn_through_north_lags_and_through_south_leads() -> None:
    """Northern hemisphere: the classic northerly turning error; the simulator's own field says the same."""
    heading = np.array([0.0, 90.0, 180.0, 270.0, 33.0])
    lean = np.full(5, 12.0)
    error = lean_error_deg(heading, lean, np.full(5, 50.0 / 17.0))
    assert error[0] < -20.0
    assert error[2] > 20.0
    by_field = wrap_180(valve_heading_deg(heading, lean, 17e3, 50e3) - heading)
    assert error == pytest.approx(by_field, abs=EXACT_DEG)
    assert lean_error_deg(heading, lean, np.full(5, -50.0 / 17.0))[0] > 20.0


def test_a_lag_follows_a_step_by_its_time_constant_and_starts_anew_after_a_gap() -> None:
    time = np.concatenate([np.arange(101.0), 500.0 + np.arange(3.0)])
    step = np.concatenate([[0.0], np.ones(100), 5.0 * np.ones(3)])[:, None]
    at_once, late = followed(time, step, np.array([0.0, 20.0]))
    assert at_once == pytest.approx(step)
    assert late[20, 0] == pytest.approx(1.0 - math.exp(-1.0))
    assert late[101, 0] == pytest.approx(5.0)


def test_a_to_e_come_back_against_an_ins_and_the_turns_tell_that_the_valve_hangs() -> None:
    answer = found()
    assert answer.verdict == "accept"
    assert (answer.reference.name, answer.reference.topic) == ("ins", "ins")
    assert expect_truth(answer, flown().coefficients_deg) == len(LETTERS)
    bank = answer.bank_error
    assert bank.lean95 is not None
    assert bank.lag95_s is not None
    assert bank.lean95[0] <= 1.0 <= bank.lean95[1]
    assert bank.lag95_s[0] <= 1.0 <= bank.lag95_s[1]
    assert bank.bank_max_deg is not None
    assert bank.bank_max_deg < 3.0
    turns = answer.method("opposite_turns")
    assert turns.state == "refused"
    assert answer.residual_rms_deg is not None
    assert answer.residual_rms_deg.after < 0.3 * answer.residual_rms_deg.before
    assert len(answer.card) == 12
    for row in answer.card:
        assert float(wrap_180(row.steer_deg + row.deviation_deg - row.magnetic_heading_deg)) == pytest.approx(0.0)


def test_a_to_e_come_back_with_the_wind_solved_and_no_ins() -> None:
    answer = found(with_ins=False)
    assert answer.reference.name == "wind"
    assert answer.verdict == "accept"
    assert expect_truth(answer, flown(with_ins=False).coefficients_deg) == len(LETTERS)
    assert answer.wind is not None
    assert {one.name for one in answer.references} == {"states", "ins", "wind"}


def test_the_wind_is_solved_without_the_compass() -> None:
    """The compass gives the first guess of the nose alone: another deviation gives the same wind."""
    winds = []
    for scale in (0.0, 2.0):
        made = flown(with_ins=False, coefficients_sigma_deg=tuple(scale * part for part in (1.0, 3.0, 3.0, 1.0, 1.0)))
        settings = MagneticFluxSettings()
        epochs = gather_epochs(made.flight, "ins", flight_phases(made.flight), settings)
        solved = solve_wind(epochs, find_legs(epochs, settings), settings)
        assert solved is not None
        winds.append(solved.wind_mps)
        true_rad = np.deg2rad(made.true_heading_deg)
        nose = np.stack([np.cos(true_rad), np.sin(true_rad)], axis=1)
        left = (epochs.velocity_mps - 60.0 * nose - solved.wind_mps)[epochs.is_airborne]
        assert np.abs(np.median(left, axis=0)).max() < SAMPLED_MPS
    assert np.abs(winds[0] - winds[1]).max() < 0.05


def test_a_slaved_gyro_is_seen_and_its_legs_are_corrected() -> None:
    answer = found(slaved_s=80.0)
    bank = answer.bank_error
    assert bank.lag95_s is not None
    assert bank.lag95_s[0] <= 80.0 <= bank.lag95_s[1]
    assert bank.after_turn_s is not None
    assert bank.after_turn_s > 60.0
    assert expect_truth(answer, flown(slaved_s=80.0).coefficients_deg) >= 3
    assert any("slaved gyro" in remark for remark in answer.remarks)


@pytest.mark.parametrize("change", [{"with_ins": False, "headings_deg": FOUR}, {"bank_deg": 6.0}])
def test_few_or_shallow_turns_show_a_slaved_gyro(change: dict[str, Any]) -> None:
    """Unseen, a gyro slaved over a minute would bias B and C by two to four degrees."""
    answer = found(slaved_s=80.0, **change)
    assert answer.bank_error.lag95_s is not None
    assert answer.bank_error.lag95_s[0] <= 80.0 <= answer.bank_error.lag95_s[1]
    assert expect_truth(answer, flown(slaved_s=80.0, **change).coefficients_deg) >= 3


def test_without_a_turn_nothing_is_accepted_unless_no_gyro_is_stated() -> None:
    none = MagneticFluxSettings(turn_bank_min_deg=80.0)  # no turn counts
    answer = estimate_flux_deviation(flown().flight, settings=none)
    assert (answer.verdict, answer.bank_error.state) == ("undecided", "not observable")
    assert "no turn above 80 deg of bank" in answer.verdict_reason
    (advice,) = advise(replace(whole_of_the_family(), answers={answer.analysis: answer}))
    assert (advice.line, advice.text) == ("Fly", "a turn of more than 3° of bank between straight legs")
    stated = estimate_flux_deviation(flown().flight, settings=replace(none, may_be_slaved=False))
    assert stated.verdict == "accept"


def test_a_log_with_heading_alone_is_not_asked_for_a_magnetometer() -> None:
    assert not list(advise(whole_of_the_family()))
    section = next_steps(whole_of_the_family())
    assert section is None or "magnetometer" not in str(section)


def test_opposite_turns_serve_a_level_valve_and_are_refused_for_one_that_hangs() -> None:
    level = found(lean=0.0, headings_deg=TWO, full_turns=2)
    assert level.recommended_method == "opposite_turns"
    assert level.verdict == "accept"
    assert expect_truth(level, flown(lean=0.0, headings_deg=TWO, full_turns=2).coefficients_deg) == len(LETTERS)
    assert any("no bank error is seen" in remark for remark in level.remarks)
    hangs = found(headings_deg=FOUR, full_turns=2, lean=0.5)
    row = hangs.method("opposite_turns")
    assert row.state == "refused"
    assert "bank and lag leave" in row.reason
    assert hangs.recommended_method == "straight_legs"
    slow = found(lean=0.0, slaved_s=60.0, full_turns=2)
    assert "bank and lag leave" in slow.method("opposite_turns").reason


def test_few_headings_give_a_reason_with_what_they_do_show() -> None:
    with pytest.raises(
        NotAssessableError, match=r"2 directions, widest gap 1[89]\d deg, do not show .*; error .* deg at"
    ):
        found(headings_deg=TWO, with_ins=False)


def test_four_headings_show_a_b_and_c() -> None:
    answer = found(headings_deg=FOUR)
    assert [answer.coefficient(letter).state for letter in "ABC"] == ["found"] * 3
    assert "not separable" in answer.coefficient("E").reason or "not separable" in answer.coefficient("D").reason
    assert answer.residual_rms_deg is None


def test_pieces_of_one_leg_are_not_several() -> None:
    """What a leg has of its own its pieces have together: a leg ten times as long tells hardly more of B."""
    short, long = found(), found(leg_s=1200.0)
    assert len(long.used) > 8 * len(short.used)
    assert long.coefficient("B").sigma_deg > 0.6 * short.coefficient("B").sigma_deg
    assert expect_truth(long, flown(leg_s=1200.0).coefficients_deg) == len(LETTERS)


def test_an_error_of_the_declination_goes_into_a_one_to_one() -> None:
    flight = flown().flight
    one, other = (
        estimate_flux_deviation(flight, settings=MagneticFluxSettings(declination_deg=stated)) for stated in (9.0, 9.5)
    )
    for letter, moved in zip(LETTERS, (0.5, 0.0, 0.0, 0.0, 0.0), strict=True):
        before, after = one.coefficient(letter).value_deg, other.coefficient(letter).value_deg
        assert before is not None
        assert after is not None
        assert after - before == pytest.approx(moved, abs=0.02)
    assert any(part.name == "declination" for part in one.a_parts)


def test_a_magnetic_heading_that_an_ins_computes_has_no_compass_in_it() -> None:
    flight = flown().flight
    true = flight["ins"].values("true_heading_deg")
    computed = with_columns(flight, "ins", magnetic_heading_deg=np.round(wrap_360(true - 11.3), 2) % 360.0)
    with pytest.raises(NotAssessableError, match="less a stored variation"):
        estimate_flux_deviation(computed)


@pytest.mark.parametrize(
    ("missing", "reason"),
    [
        (("gnss", "air"), "neither GNSS velocity nor true airspeed"),
        (("air",), "no true airspeed"),
        (("ins",), "no magnetic"),
    ],
)
def test_what_is_missing_is_one_line(missing: tuple[str, ...], reason: str) -> None:
    flight = flown(with_ins=False).flight
    for topic in missing:
        flight = without(flight, topic)
    with pytest.raises(NotAssessableError, match=reason) as told:
        estimate_flux_deviation(flight)
    assert "\n" not in str(told.value)


def test_a_log_of_a_quarter_of_a_second_is_told_in_epochs() -> None:
    """Two readings 0.25 s apart are an epoch, one a second, and not a second of heading."""
    flight = flown().flight
    ins = flight["ins"]
    rows = np.flatnonzero(ins.time_ns <= ins.time_ns[0] + NS_PER_S // 4)
    short = replace(flight, tables={**flight.tables, "ins": ins.take(rows)})
    with pytest.raises(NotAssessableError) as told:
        gather_epochs(short, "ins", flight_phases(short), MagneticFluxSettings())
    assert "1 epoch of magnetic heading, one a second: 60 needed" in str(told.value)


def test_readings_that_are_missing_or_stuck_are_no_traceback() -> None:
    flight = flown(with_ins=False).flight
    heading = flight["ins"].values("magnetic_heading_deg").copy()
    gaps = heading.copy()
    gaps[200:500] = np.nan
    assert estimate_flux_deviation(with_columns(flight, "ins", magnetic_heading_deg=gaps)).legs
    for broken in (np.full(len(heading), np.nan), np.full(len(heading), 77.0)):
        try:
            answer = estimate_flux_deviation(with_columns(flight, "ins", magnetic_heading_deg=broken))
        except NotAssessableError:
            continue
        assert answer.verdict == "reject"


def test_a_steep_dip_is_rejected_and_other_limits_judge_again() -> None:
    flight = flown().flight
    strict = MagneticFluxSettings(dip_max_deg=60.0)
    answer = estimate_flux_deviation(flight, settings=strict)
    assert answer.verdict == "reject"
    assert "dip" in answer.verdict_reason
    (again,) = flux_rejudge(answer, MagneticFluxSettings())
    assert (again.before, again.after) == ("reject", "accept")


def test_a_variation_of_the_log_that_is_off_is_told() -> None:
    flight = flown(with_ins=False).flight
    shown = flight["ins"].values("magnetic_heading_deg")
    flight = with_columns(flight, "ins", true_heading_deg=wrap_360(shown + 8.0), pitch_deg=np.zeros(len(shown)))
    flight = replace(flight, metadata={**flight.metadata, "derived.ins.true_heading_deg": "magnetic plus variation"})
    answer = estimate_flux_deviation(flight)
    assert answer.reference.name == "wind"
    assert answer.logged_variation_deg == pytest.approx(8.0)
    assert any("own variation" in remark for remark in answer.remarks)
    assert any("AHRS" in remark for remark in answer.remarks)


def test_a_whole_run_tells_it_saves_it_and_applies_it(tmp_path: Path) -> None:
    results = whole_of_the_family()
    answer = results.answer(FluxDeviation)
    assert answer is not None
    (finding,) = (one for one in results.findings if one.code.startswith("magnetic_flux."))
    assert (finding.severity, finding.code) == ("info", "magnetic_flux.accept")
    save(tmp_path, results, Manifest())
    saved = load(tmp_path)
    assert {"magnetic_flux_epochs", "magnetic_flux_curve"} <= set(saved.figures)
    own = {"$schema": SCHEMA["$schema"], "$ref": "#/$defs/magnetic_flux", "$defs": SCHEMA["$defs"]}
    jsonschema.Draft202012Validator(own).validate(saved.summary["results"]["magnetic_flux"])
    back = saved.results.answer(FluxDeviation)
    assert back is not None
    assert back.bank_error.lean == pytest.approx(answer.bank_error.lean, abs=1e-3)
    by_summary = deviation_from_summary(saved.summary, "summary.json")
    table = deviation_csv(saved.results)
    assert table is not None
    by_csv = deviation_from_csv(table, "deviation.csv")
    assert by_csv.table_deg == pytest.approx(by_summary.table_deg, abs=1e-3)
    assert by_csv.is_of_heading
    flight = flown().flight
    for asked in (Apply(), Apply(by_csv, "ab" * 32)):
        done = apply_deviation(flight, results, asked, Known(phases=flight_phases(flight)))
        assert APPLIED in {one.code for one in done.results.findings}
        assert done.corrected is not None
        epochs = gather_epochs(flight, "ins", flight_phases(flight), MagneticFluxSettings())
        rows = np.concatenate([np.arange(first, last) for first, last in find_legs(epochs, MagneticFluxSettings())])
        true = flown().true_heading_deg[rows]
        before, after = (
            float(np.std(wrap_180(heading[rows] - true)))
            for heading in (done.corrected.uncorrected_deg, done.corrected.magnetic_heading_deg)
        )
        assert after < 0.3 * before
    rejected = replace(flux_deviation_of(answer, "F", "A"), verdict="undecided")
    refused = apply_deviation(flight, results, Apply(rejected, ""), Known(phases=flight_phases(flight)))
    assert NOT_APPLIED in {one.code for one in refused.results.findings}
    with pytest.raises(UsageError):
        deviation_from_csv(table.replace("straight_legs", "guess"), "deviation.csv")


def test_the_chapter_and_the_card_tell_it() -> None:
    results = whole_of_the_family()
    section = magnetic(results)
    assert section is not None
    titles = {part.title for part in section.parts if isinstance(part, Grid)}
    assert {"Coefficients of the compass", "Steer card of the compass", "Legs and turns side by side"} <= titles
    first = next(part for part in section.parts if isinstance(part, Note))
    assert first.text.startswith("Accept:")
    answer = results.answer(FluxDeviation)
    assert answer is not None
    card = steer_card(results, answer)
    assert len(card.lines) == 12
    assert ("Swung against", "INS true heading") in card.pairs
    assert "straight legs" in card.remarks[0]


def test_check_says_what_is_missing_before_anything_is_run() -> None:
    for changes, count in (({}, 0), ({"headings_deg": TWO}, 1)):
        flight = flown(**changes).flight
        known = Known(phases=flight_phases(flight))
        assert len(examining.examine_flux(flight, known, MagneticFluxSettings())) == count
    flight = without(flown(with_ins=False).flight, "air")
    with pytest.raises(NotAssessableError, match="no true heading"):
        examining.examine_flux(flight, Known(phases=flight_phases(flight)), MagneticFluxSettings())


def test_turning_the_world_and_shifting_time_change_nothing() -> None:
    """Ten days later the same flight gives the same deviation, but for the change of the declination."""
    flight = flown().flight
    later_ns = 10 * 86_400 * NS_PER_S
    tables = {name: replace(table, time_ns=table.time_ns + later_ns) for name, table in flight.tables.items()}
    later = estimate_flux_deviation(replace(flight, tables=tables, start_ns=flight.start_ns + later_ns))
    for letter in LETTERS:
        one, other = found().coefficient(letter), later.coefficient(letter)
        assert one.value_deg == pytest.approx(other.value_deg, abs=0.01)


def test_the_table_of_the_study_counts_what_is_inside() -> None:
    runs = [
        FluxRun("INS", "accept", {"A": 1.0, "B": 2.5}, {"A": 0.1, "B": 0.5}, {"A": 0.1, "B": 0.2}),
        FluxRun("INS", "not assessable", {}, {}, {}),
    ]
    table = coverage_table({"INS": runs})
    assert (int(table["given"][0]), float(table["inside95"][0])) == (2, 0.5)
    assert (float(table["inside95_a"][0]), float(table["inside95_b"][0])) == (1.0, 0.0)
    assert fly_and_judge("two legs", 4).verdict == "not assessable"


@pytest.mark.slow
def test_sigma_covers_the_truth_where_nothing_breaks_it() -> None:
    """20 flights a cell of the family, seeds 1 to 20."""
    for cell in CELLS:
        if cell.endswith("load") or cell == "two legs":  # a load that changes in flight is the broken assumption
            continue
        runs = [fly_and_judge(cell, seed) for seed in range(1, 21)]
        ratios = np.array([value for one in runs for value in one.ratios.values()])
        assert len(ratios) >= 40
        assert np.mean(np.abs(ratios) < 1.96) > 0.88


@pytest.mark.slow
def test_recorded_flights_of_a_g1000_give_one_line(tmp_path: Path) -> None:
    path = real_log("g1000/log_210623_141501_TEST1.csv")
    converted = convert_log(open_log(path), tmp_path / "log.mcap")
    flight = read_flight(tmp_path / "log.mcap", converted)
    with pytest.raises(NotAssessableError, match="straight legs in 2 directions") as told:
        estimate_flux_deviation(flight)
    assert "\n" not in str(told.value)
