"""Alignment, stand after it, shutdown, alignments between: simulated flights that begin and end parked."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.records import Column
from groundstation.chapters.markdown import markdown
from groundstation.methods.ins_noise import load_class
from groundstation.plots.marks import Limit, Spans
from groundstation.simulation.ins_parked import ParkedFlight, ParkedSettings, simulate_parked
from groundstation.systems.inertial.alignment_analysis import GROUND
from groundstation.systems.inertial.alignment_answer import GroundResult, InsRealignment
from groundstation.systems.inertial.alignment_chapter import ground
from groundstation.systems.inertial.alignment_ends import drift_limit_mps2
from groundstation.systems.inertial.alignment_findings import assess_ground, told_by_ground
from groundstation.systems.inertial.alignment_plots import ground_marks
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.inertial.gives import given_by
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.study.ground import coverage_of, told_of
from groundstation.systems.inertial.study.ground_runs import CASES, judge_parked
from groundstation.systems.known import AircraftData, Known
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight
from tests.report_example import example
from tests.systems.inertial.flights import changed, without_rows

SETTINGS = InertialSettings()
ARCSEC = np.rad2deg(1.0) * 3600.0
SEED = 3


@cache
def parked(**wanted: object) -> ParkedFlight:
    return simulate_parked(ParkedSettings(**({"flight_s": 3000.0} | wanted)), SEED)  # type: ignore[arg-type]


def assess(flight: Flight, aircraft: AircraftData | None = None) -> tuple[GroundResult, tuple[Finding, ...]]:
    known = Known(Phases((), "not asked for"), aircraft=aircraft or AircraftData(), settings={"inertial": SETTINGS})
    try:
        found = INERTIAL.run(flight, known, SETTINGS)
        workings = {} if found.workings is None else {"inertial": found.workings}
        known = replace(known, answers={"inertial": found.answer}, workings=workings)
    except NotAssessableError:
        pass
    return assess_ground(flight, known, SETTINGS)


def with_mode(flight: Flight, mode: np.ndarray) -> Flight:
    table = flight["ins"]
    return replace(
        flight, tables={**flight.tables, "ins": replace(table, columns={**table.columns, "mode": Column(mode)})}
    )


def codes(findings: tuple[Finding, ...]) -> list[str]:
    return [one.code for one in findings]


def test_a_flight_from_alignment_to_parking_is_told_as_it_was() -> None:
    made = parked()
    found, findings = assess(made.log)
    before, end = found.alignment, found.shutdown
    assert (before.kind, before.basis, before.is_cut) == ("gyrocompass", "mode", True)
    assert before.length_s == pytest.approx(600.0, abs=1.0)
    assert before.is_moved is False
    assert found.start_s == pytest.approx(made.start_s, abs=1.0)
    assert codes(findings) == []
    standing = found.standing
    assert standing is not None and not standing.is_above
    rows = (made.time_s >= standing.start_s) & (made.time_s < standing.end_s)
    slope = 60.0 * np.hypot(*np.polyfit(made.time_s[rows], made.velocity_error_mps[rows], 1)[0])
    assert abs(standing.size_mps_per_min.value - slope) <= standing.size_mps_per_min.half95
    assert end.is_parked and end.reason == ""
    assert end.residual_speed_mps is not None and end.position_error_m is not None
    assert abs(end.residual_speed_mps.value - np.hypot(*made.velocity_error_mps[-30])) < 0.05
    assert abs(end.position_error_m.value - np.hypot(*made.position_error_m[-30])) <= end.position_error_m.half95
    assert end.hours == pytest.approx((made.time_s[-1] - made.start_s) / 3600.0, abs=0.01)
    assert end.terminal_rate_nmiph is not None and end.hours is not None
    assert end.terminal_rate_nmiph.value == pytest.approx(end.position_error_m.value / 1852.0 / end.hours)
    start = found.at_start
    assert start is not None and start.tilt_north_arcsec is not None and start.azimuth_deg is not None
    assert abs(start.tilt_north_arcsec.value - ARCSEC * made.tilt_rad[0, 0]) < 2.0 * start.tilt_north_arcsec.half95
    assert abs(start.azimuth_deg.value - np.rad2deg(made.azimuth_error_rad[0])) < 2.0 * start.azimuth_deg.half95


def test_velocities_of_zero_show_an_alignment_without_a_mode() -> None:
    found, _ = assess(parked(alignment="still").log)
    assert (found.alignment.basis, found.alignment.kind) == ("still_output", "gyrocompass")
    assert found.alignment.length_s == pytest.approx(600.0, abs=2.0)


def test_a_log_that_begins_navigating_at_a_stand_says_that_the_alignment_lies_before() -> None:
    found, _ = assess(parked(alignment="none").log)
    assert (found.alignment.kind, found.alignment.basis, found.alignment.length_s) == ("unknown", "standstill", None)
    assert "navigates already" in found.alignment.reason
    assert found.standing is not None


def test_a_short_alignment_is_a_stored_heading_and_what_is_stated_goes_first() -> None:
    made = parked(align_s=90.0)
    late = without_rows(made.log, "ins", made.log.time_s("ins") >= 20.0)
    shown = with_mode(late, np.where(late.time_s("ins") < 30.0, "attitude", late["ins"].text("mode")))
    found, _ = assess(shown)
    assert (found.alignment.kind, found.alignment.is_cut) == ("stored_heading", False)
    stated, _ = assess(shown, AircraftData(ins_alignment="gyrocompass"))
    assert stated.alignment.kind == "gyrocompass" and "stated" in stated.alignment.reason


def test_an_aircraft_that_is_towed_while_it_aligns_is_a_finding() -> None:
    found, findings = assess(parked(tug_m=40.0).log)
    assert found.alignment.is_moved and found.alignment.moved_m == pytest.approx(40.0, abs=8.0)
    assert found.alignment.moved_at_s == pytest.approx(280.0, abs=5.0)
    assert "ins_ground.moved" in codes(findings)


def test_a_drift_above_the_class_is_a_finding() -> None:
    found, findings = assess(parked(warm_up_ug=4000.0, warm_up_s=300.0).log)
    assert found.standing is not None and found.standing.is_above
    assert "ins_ground.standing_drift" in codes(findings)
    sentence = GROUND.sentence({"ins_ground": found})
    assert "drifts" in sentence


def test_a_log_that_begins_and_ends_in_flight_has_neither_stand() -> None:
    log = parked().log
    for topic in ("ins", "gnss"):
        time_s = log.time_s(topic)
        log = without_rows(log, topic, (time_s > 1500.0) & (time_s < 3000.0))
    found, _ = assess(log)
    assert found.alignment.kind == "unknown" and "in motion" in found.alignment.reason
    assert found.standing is None and "does not stand" in found.standing_reason
    assert not found.shutdown.is_parked and found.shutdown.residual_speed_mps is None
    assert found.shutdown.position_error_m is not None and found.shutdown.terminal_rate_nmiph is None
    assert found.at_start is not None and found.at_start.tilt_north_arcsec is None


def test_two_seconds_of_stand_are_no_stand() -> None:
    found, _ = assess(parked(stand_s=0.0, park_s=0.0).log)
    made = parked(stand_s=0.0, park_s=0.0)
    cut = made.log
    for topic in ("ins", "gnss"):
        time_s = cut.time_s(topic)
        cut = without_rows(cut, topic, (time_s < made.start_s) | (time_s > made.start_s + 33.0))
    short, _ = assess(cut)
    assert short.standing is None
    assert found.alignment.kind == "gyrocompass"


def test_without_gnss_at_the_stand_the_residual_speed_is_still_told() -> None:
    made = parked()
    log = without_rows(made.log, "gnss", made.log.time_s("gnss") < made.log.time_s("gnss")[-1] - 400.0)
    found, _ = assess(log)
    end = found.shutdown
    assert end.is_parked and "last one known" in end.reason
    assert end.residual_speed_mps is not None and end.position_at_s is not None
    assert abs(end.residual_speed_mps.value - np.hypot(*made.velocity_error_mps[-30])) < 0.05
    assert end.position_at_s < log.time_s("ins")[-1] - 390.0


def test_gnss_that_comes_later_leaves_motion_during_the_alignment_unknown() -> None:
    made = parked()
    log = without_rows(made.log, "gnss", made.log.time_s("gnss") > 700.0)
    found, _ = assess(log)
    assert found.alignment.length_s == pytest.approx(600.0, abs=1.0)
    assert found.alignment.is_moved is None
    assert found.standing is not None


def test_without_gnss_at_all_alignment_and_residual_speed_remain() -> None:
    made = parked()
    log = replace(made.log, tables={"ins": made.log["ins"]})
    found, _ = assess(log)
    assert found.alignment.kind == "gyrocompass" and found.gnss_topic == ""
    assert found.standing is not None and found.shutdown.residual_speed_mps is not None
    assert found.shutdown.position_error_m is None and found.shutdown.reason.endswith("not compared with GNSS")


def test_a_mode_that_flickers_is_no_alignment() -> None:
    made = parked()
    time_s = made.log.time_s("ins")
    mode = made.log["ins"].text("mode").copy()
    mode[(time_s > 2000.0) & (time_s < 2002.5)] = "align"
    mode[(time_s > 300.0) & (time_s < 302.5)] = "nav"
    found, findings = assess(with_mode(made.log, mode))
    assert found.mode_flicker == 2 and "ins_ground.flicker" in codes(findings)
    assert found.alignment.length_s == pytest.approx(600.0, abs=1.0)
    assert [one for one in found.realignments if one.is_aligned] == []


def test_what_an_alignment_in_flight_changed_is_told() -> None:
    made = parked(flight_s=4800.0)
    time_s = made.log.time_s("ins")
    mode = made.log["ins"].text("mode").copy()
    mode[(time_s >= 2400.0) & (time_s < 2520.0)] = "align"
    log = with_mode(made.log, mode)
    north = 500.0 / 6.371e6 * np.rad2deg(1.0) * (time_s >= 2520.0)
    log = changed(
        log,
        "ins",
        latitude_deg=log["ins"].values("latitude_deg") + north,
        velocity_east_mps=log["ins"].values("velocity_east_mps") + 2.0 * (time_s >= 2520.0),
    )
    found, _ = assess(log)
    (one,) = found.realignments
    assert one.is_aligned and one.place == "moving" and (one.start_s, one.end_s) == (2400.0, 2520.0)
    assert one.position_step_m is not None and one.velocity_step_mps is not None
    drift_m = made.position_error_m[time_s[made.log["ins"].text("mode") != "align"] >= 2400.0][[0, 120]]
    step = drift_m[1] - drift_m[0] + [500.0, 0.0]
    assert abs(one.position_step_m.value - np.hypot(*step)) <= one.position_step_m.half95
    assert one.velocity_step_mps.value == pytest.approx(2.0, abs=0.5)
    assert one.rate_before_nmiph is not None and one.rate_after_nmiph is not None
    assert found.alignment.length_s == pytest.approx(600.0, abs=1.0)


def test_a_turn_of_the_heading_by_an_alignment_at_a_stand_is_told() -> None:
    made = parked(stand_s=900.0)
    time_s = made.log.time_s("ins")
    mode = made.log["ins"].text("mode").copy()
    mode[(time_s >= 900.0) & (time_s < 1200.0)] = "align"
    heading = made.log["ins"].values("true_heading_deg") + 0.5 * (time_s >= 1200.0)
    found, _ = assess(changed(with_mode(made.log, mode), "ins", true_heading_deg=np.mod(heading, 360.0)))
    assert [one.place for one in found.realignments] == ["standing"]
    step = found.realignments[0].heading_step_deg
    assert step is not None and step.value == pytest.approx(0.5, abs=0.05) and step.half95 < 0.1


def test_a_step_of_the_clock_makes_no_traceback() -> None:
    made = parked()
    log = made.log
    for topic in ("ins", "gnss"):
        table = log[topic]
        late_ns = np.where(log.time_s(topic) > 2000.0, 3_600_000_000_000, 0)
        log = replace(log, tables={**log.tables, topic: replace(table, time_ns=table.time_ns + late_ns)})
    found, _ = assess(log)
    assert found.alignment.kind == "gyrocompass" and found.shutdown.is_parked


def test_an_ins_that_gnss_holds_has_kind_and_shutdown_and_no_drift() -> None:
    made = parked()
    text = np.where(made.log["ins"].text("mode") == "align", "align", "gnss_aided")
    log = with_mode(made.log, text)
    known = Known(Phases((), "not asked for"), settings={"inertial": SETTINGS})
    assert GROUND.applies(log, known)
    found, _ = assess(log)
    assert found.kind == "gnss_aided" and found.alignment.kind == "gnss_aided"
    assert found.standing is None and "GNSS holds" in found.standing_reason
    assert found.at_start is None and found.shutdown.terminal_rate_nmiph is None
    assert found.shutdown.residual_speed_mps is not None
    never = with_mode(made.log, np.full(len(text), "gnss_aided"))
    assert not GROUND.applies(never, known)


def test_check_says_what_of_the_ground_a_log_gives() -> None:
    made = parked()
    assert told_by_ground(made.log) == (
        "alignment: by the logged mode, 600 s",
        "shutdown: parked at the end, with GNSS",
    )
    alone = replace(made.log, tables={"ins": made.log["ins"]})
    assert "without GNSS" in told_by_ground(alone)[1]
    assert told_by_ground(replace(made.log, tables={"gnss": made.log["gnss"]})) == ()


def test_the_page_tells_the_table_and_warns_where_there_is_something_to_warn_of() -> None:
    calm, _ = assess(parked().log)
    section = ground(example(calm))
    assert section is not None and section.claim is None
    text = markdown(section)
    for told in ("Gyrocompass", "at least 10:00", "Tilt at the start", "Terminal error rate", "parked from"):
        assert told in text, told
    moved, _ = assess(parked(tug_m=40.0).log)
    section = ground(example(moved))
    assert section is not None and section.claim is not None and "Moved" in section.claim.mark.text
    assert "The aircraft moved by up to" in markdown(section)


def test_plots_of_errors_show_alignment_and_stands() -> None:
    found, _ = assess(parked().log)
    again = replace(found, realignments=(InsRealignment(2000.0, 2100.0, True, "moving"),))
    marks = ground_marks(example(again), named=True)
    assert [mark.name for mark in marks if isinstance(mark, Spans)] == ["alignment", "standing"]
    assert [mark.value for mark in marks if isinstance(mark, Limit)] == [2100.0]
    assert ground_marks(example(), named=True) == []


def test_a_class_of_its_own_has_a_limit_by_its_noise() -> None:
    own = replace(load_class("navigation"), name="own")
    limits = [drift_limit_mps2(one, 0.0, 300.0) for one in (load_class("navigation"), own)]
    assert 0.0 < limits[0] < limits[1]
    assert drift_limit_mps2(own, 600.0, 300.0) > limits[1]


def test_the_study_holds_every_interval_against_the_truth() -> None:
    outcome = judge_parked("navigation, manoeuvring", replace(CASES["navigation, manoeuvring"], flight_s=2000.0), 5, 0)
    assert outcome.why_not == "" and outcome.kind == "gyrocompass" and outcome.is_moved is False
    assert {cell.quantity.split(",")[0] for cell in outcome.cells} >= {
        *("tilt", "standing drift", "speed at shutdown", "position at the end", "terminal rate")
    }
    off = replace(outcome, cells=tuple(replace(cell, error=2.0 * cell.half95) for cell in outcome.cells))
    table = coverage_of([outcome, off])
    assert set(table["values"].tolist()) <= {2, 4} and max(table["inside95"].tolist()) <= 0.5
    assert told_of([outcome])["kind"].tolist() == [1.0]


def test_check_lists_each_part_of_the_page_in_a_line() -> None:
    made = parked()
    known = Known(Phases((), "not asked for"), settings={"inertial": SETTINGS})
    lines = given_by(made.log, known, SETTINGS)
    assert [line.partition(":")[0] for line in lines] == ["causes", "alignment", "shutdown"]
    assert "in axes of the body too" in lines[0]
    valve = changed(made.log, "ins", magnetic_heading_deg=made.log["ins"].values("true_heading_deg"))
    assert given_by(valve, known, SETTINGS)[-1].startswith("flux valve: the magnetic heading of ins")
    assert not any(line.startswith("causes") for line in given_by(replace(made.log, tables={}), known, SETTINGS))
