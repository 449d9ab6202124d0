"""Straight epochs left out as ground is not proven: what they say against the answer is heard."""

from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np
import pytest

import groundstation
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.chapters.parts import Facts
from groundstation.results.flight import KIND_OF_VEHICLE, WHY_THAT_VEHICLE, FlightResults, NotAssessable
from groundstation.results.gates import Gate
from groundstation.simulation.taxi import TaxiCase, draw_run, simulate_taxi, taxi_flight
from groundstation.systems.heading.analysis import HEADING
from groundstation.systems.heading.answer import HeadingResult, UnprovenGround
from groundstation.systems.heading.claim_chapter import claim
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.gates_answer import UNPROVEN, UNPROVEN_OPEN, WHOLE
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftClass, AircraftData
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight
from groundstation.tables.vehicle import Vehicle
from tests.real_logs import real_log
from tests.report_example import example, heading_result
from tests.told import next_steps

CASE = TaxiCase(
    segments_s=(45.0, 45.0), turns_deg=(-95.0,), correlated_mps=0.002, correlation_s=1.0, sway_sigma_deg=0.3
)
AIRCRAFT = AircraftData(antenna_arm_m=4.0, sideslip_sigma_deg=0.1, mounting_sigma_deg=0.05)
FEW = HeadingSettings(posterior_draws=1000)
FOUND = Phases((), "", vehicle=Vehicle("rolls", "stops, up to 8 m/s"))
STATED = Phases((), "", vehicle=Vehicle("rolls", "aircraft file", True))
UNKNOWN = Phases((), "", vehicle=Vehicle(None, "nothing says it"))
WANDER_DEG = 1.0  # of the heading between the two straights


@dataclass(frozen=True)
class Contact:
    mask: BoolArray
    method: str = "detector"


@pytest.fixture(scope="module")
def steady() -> Flight:
    return taxi_flight(simulate_taxi(CASE, np.random.default_rng(1)))


@pytest.fixture(scope="module")
def turn_s(steady: Flight) -> float:
    """Flight second between the two straights."""
    first, second = estimate_heading_error(steady, settings=FEW).segments
    return 0.5 * (first.end_s + second.start_s)


def wandering(flight: Flight, turn_s: float) -> Flight:
    """The same with an INS heading that grows within 20 s about the turn."""
    ins, time_s = flight["ins"], flight.time_s("ins")
    grown = np.interp(time_s, [turn_s - 10.0, turn_s + 10.0], [0.0, WANDER_DEG])
    heading = Column((ins.values("true_heading_deg") + grown) % 360.0)
    table = replace(ins, columns={**ins.columns, "true_heading_deg": heading})
    return replace(flight, tables={**flight.tables, "ins": table})


def found_before(flight: Flight, end_s: float, phases: Phases) -> HeadingResult:
    """The answer where ground contact is proven before a time only."""

    def proof(time_ns: Int64Array) -> Contact:
        return Contact(np.asarray(flight.seconds(time_ns) < end_s))

    return estimate_heading_error(flight, settings=FEW, aircraft=AIRCRAFT, on_ground=proof, phases=phases)


def gate_of(found: HeadingResult) -> Gate:
    return next(gate for gate in found.gates if gate.name == UNPROVEN)


def test_an_accept_does_not_hang_on_the_epochs_left_out(steady: Flight, turn_s: float) -> None:
    found = found_before(wandering(steady, turn_s), turn_s, FOUND)
    left = found.unproven_ground
    assert left is not None and left.epochs == left.straight - found.samples
    assert found.verdict == "reject" and found.correction_deg is None
    gate = gate_of(found)
    assert gate.state == "failed" and gate.value is not None and gate.value >= 1.0
    assert "left out as ground is not proven" in found.verdict_reason
    assert "parts of the taxi disagree" in found.verdict_reason
    assert found.error_deg == pytest.approx(0.8, abs=0.2), "the number stays that of proven ground"
    assert left.error_deg == pytest.approx(0.8 + 0.5 * WANDER_DEG, abs=0.3)


def test_epochs_left_out_that_agree_leave_the_accept_and_are_told(steady: Flight, turn_s: float) -> None:
    found = found_before(steady, turn_s, FOUND)
    assert gate_of(found).state == "passed" and found.verdict == "accept"
    left = found.unproven_ground
    assert left is not None and left.error_deg == pytest.approx(found.error_deg, abs=0.1)
    told = f"{left.epochs} of {left.straight} straight epochs left out as ground is not proven"
    assert told in HEADING.sentence({"heading": found})
    assert any(sentence.startswith(f"{told}, with them") for sentence in claim(found).sentences)


def test_epochs_left_out_that_ask_for_more_data_alone_do_not_reject() -> None:
    """A short taxi, whose epochs together are known worse than by the proven ones: no contradiction."""
    run = draw_run("wide", 4711, 46)
    flight, end_s = taxi_flight(run), run.taxi_start_s + 0.6 * float(run.gnss_time_s[-1] - run.taxi_start_s)
    aircraft = replace(
        AircraftData(antenna_arm_m=run.case.antenna_arm_m if run.case.is_arm_known else None, antenna_arm_sigma_m=0.05),
        aircraft_class=cast(AircraftClass, run.case.disturbance.aircraft_class),
    )
    metar = run.case.disturbance.metar

    def proof(time_ns: Int64Array) -> Contact:
        return Contact(np.asarray(flight.seconds(time_ns) < end_s))

    judged = partial(estimate_heading_error, flight, settings=FEW, aircraft=aircraft, weather=(metar,) if metar else ())
    found, together = judged(on_ground=proof, phases=FOUND), judged()
    assert {one.name for one in together.gates if one.state == "failed" and one.required} == {WHOLE}
    assert (found.verdict, together.verdict) == ("extend", "extend")
    states = {one.name: one.state for one in found.gates}
    assert (states[UNPROVEN], states[UNPROVEN_OPEN]) == ("passed", "failed")
    assert "straight epochs left out as ground is not proven, with them " in found.verdict_reason


@pytest.mark.parametrize("phases", [STATED, UNKNOWN])
def test_a_vehicle_that_may_fly_is_not_taken_as_on_the_ground(steady: Flight, turn_s: float, phases: Phases) -> None:
    found = found_before(wandering(steady, turn_s), turn_s, phases)
    assert gate_of(found).state == "not_measured" and not gate_of(found).required
    assert found.unproven_ground is not None and found.unproven_ground.error_deg is None
    assert "left out as ground is not proven" in gate_of(found).reason


def test_where_none_is_left_out_nothing_is_estimated_twice(steady: Flight) -> None:
    found = estimate_heading_error(steady, settings=FEW, phases=FOUND)
    assert found.unproven_ground is None
    assert gate_of(found).state == "passed" and gate_of(found).value == 0.0
    alone = estimate_heading_error(steady, settings=FEW)
    assert (found.error_deg, found.gates) == (alone.error_deg, alone.gates)


@pytest.mark.parametrize(
    ("kind", "why", "line", "text"),
    [
        ("rolls", "found: stops", "Check", 'state vehicle = "rolls"'),
        ("unknown", "it never moved", "Record", "weight on wheels"),
    ],
)
def test_advice_says_what_would_prove_the_ground(kind: str, why: str, line: str, text: str) -> None:
    results = example(
        replace(heading_result(), unproven_ground=UnprovenGround(40, 60)),
        metadata={KIND_OF_VEHICLE: kind, WHY_THAT_VEHICLE: why},
    )
    assert text in advice(results)[line]


def test_a_car_without_a_proven_epoch_is_asked_for_its_kind() -> None:
    reason = "no straight taxi: of 986 epochs above 6 m/s before lift-off: not proven ground 986"
    results = example(
        None,
        metadata={KIND_OF_VEHICLE: "rolls", WHY_THAT_VEHICLE: "found: stops"},
        not_assessable=(NotAssessable("heading", reason),),
    )
    assert 'state vehicle = "rolls"' in advice(results)["Check"]


def advice(results: FlightResults) -> dict[str, str]:
    section = next_steps(results)
    assert section is not None and isinstance(section.parts[0], Facts)
    return {label: str(text) for label, text, _ in section.parts[0].pairs}


@pytest.mark.real_log
def test_a_drive_whose_heading_wanders_is_not_accepted_by_a_third_of_it() -> None:
    """A car by an INS of two antennas that wanders by 0.3 to 0.8 deg; two thirds of the straights are not proven."""
    found = groundstation.open(real_log("reference_heading/pntos_drive_first_half.csv")).results.answer(HeadingResult)
    assert found is not None and found.unproven_ground is not None
    assert found.verdict == "reject" and gate_of(found).state == "failed"
    assert found.unproven_ground.epochs > 0.6 * found.unproven_ground.straight
    assert found.unproven_ground.error_deg == pytest.approx(0.5, abs=0.1)
    assert "heading error drifts" in gate_of(found).reason
