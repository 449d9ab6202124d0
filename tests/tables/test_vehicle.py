"""Kind of vehicle and likely phases: what speed and height show, and that nothing is proven by them."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.tables.phases import Phases, flight_phases, ground_mask
from groundstation.tables.table import Flight, Table
from groundstation.tables.vehicle import STATED_BY
from tests.tables.test_phases import (
    STEP_S,
    Course,
    assert_covers,
    course,
    flight_of,
    hovering,
    light_aircraft,
    real_flight,
    sampled,
    touch_and_go,
)

Floats = NDArray[np.float64]


def car() -> Course:
    """Stand, drive over a hill of 6 %, stop at a light, drive back down, stand."""
    return course(
        *((20, 0, 0, 0, 0, 0), (10, 14, 0, 0, 0, 0), (60, 14, 50, 0, 0, 0), (8, 0, 50, 0, 0, 0), (15, 0, 50, 0, 0, 0)),
        *((10, 14, 50, 0, 0, 180), (60, 14, 0, 0, 0, 180), (8, 0, 0, 0, 0, 180), (20, 0, 0, 0, 0, 180)),
    )


def walk() -> Course:
    return course((15, 0, 0, 0, 0, 30), (3, 1.3, 0, 0, 0, 30), (90, 1.4, 1, 0, 0, 200), (3, 0, 1, 0, 0, 200))


def without(flight: Flight, *topics: str, metadata: Mapping[str, str] | None = None) -> Flight:
    tables = {name: table for name, table in flight.tables.items() if name not in topics}
    return replace(flight, tables=tables, metadata=metadata or {})


def seconds(phases: Phases, phase: str) -> float:
    return sum(one.end_s - one.start_s for one in phases.likely if one.phase == phase)


def agreement(flight: Flight, truth: Course) -> tuple[Phases, float]:
    """Phases of a flight, and the share of the time in which likely ground and flight are the truth."""
    phases = flight_phases(flight)
    assert_covers(phases, flight)
    assert phases.likely[0].start_s == 0.0 and phases.likely[-1].end_s == flight.duration_s
    place = np.searchsorted([one.start_s for one in phases.likely], truth.time_s, side="right") - 1
    flies = np.array([one.phase == "airborne" for one in phases.likely])[place]
    return phases, float(np.mean(flies == ~truth.contact))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("make", [light_aircraft, touch_and_go])
def test_an_aeroplane_without_attitude_is_found_and_its_flight_is_likely(make: type[Course], seed: int) -> None:
    truth = make()
    phases, share = agreement(without(flight_of(truth, seed=seed), "ins"), truth)
    assert phases.vehicle.kind == "flies" and not phases.vehicle.is_stated
    assert phases.method.startswith("none: no roll and pitch")
    assert [one.phase for one in phases.intervals] == ["unknown"], "nothing is proven by speed and height"
    assert share > 0.95
    assert not any(one.is_proven for one in phases.likely)
    assert seconds(phases, "take-off run") > 2.0 and seconds(phases, "landing roll") > 2.0


def test_a_likely_phase_proves_no_ground() -> None:
    for truth in (light_aircraft(), car(), walk()):
        flight = without(flight_of(truth), "ins")
        phases = flight_phases(flight)
        assert seconds(phases, "standstill") > 10.0
        assert not ground_mask(flight, flight["gnss"].time_ns).mask.any()


@pytest.mark.parametrize("seed", range(3))
def test_a_car_and_a_walk_are_found_by_satellites_alone(seed: int) -> None:
    for truth, kind, moving in ((car(), "rolls", "driving"), (walk(), "walks", "walking")):
        on_ground = replace(truth, contact=np.ones(len(truth.contact), dtype=bool))
        phases, share = agreement(without(flight_of(truth, seed=seed), "ins"), on_ground)
        assert phases.vehicle.kind == kind, phases.vehicle
        assert {one.phase for one in phases.likely} <= {"standstill", moving, "unknown"}
        assert seconds(phases, "unknown") < 1.0 and share > 0.99
        moving_s = np.count_nonzero(truth.speed_mps > 0.5) * STEP_S
        assert seconds(phases, moving) == pytest.approx(moving_s, abs=4.0)


def test_a_multirotor_that_rises_on_the_spot_flies() -> None:
    truth = hovering()
    phases, share = agreement(without(flight_of(truth), "ins"), truth)
    assert phases.vehicle.kind == "flies" and share > 0.9


def with_height(flight: Flight, truth: Course, topic: str, name: str) -> Flight:
    table = sampled(topic, {name: truth.height_m}, truth.time_s, 1.0, flight.start_ns)
    return replace(flight, tables={**flight.tables, topic: table})


@pytest.mark.parametrize(("topic", "name"), [("baro", "height_above_airfield_m"), ("radio_altimeter", "height_m")])
def test_height_that_the_log_counts_from_the_ground_tells_flight(topic: str, name: str) -> None:
    truth = light_aircraft()
    flight = with_height(without(flight_of(truth), "ins", "gnss"), truth, topic, name)
    phases, share = agreement(flight, truth)
    assert phases.vehicle.kind == "flies" and share > 0.95
    assert seconds(phases, "on the ground") > 100.0 and seconds(phases, "taxi") == 0.0, "there is no speed"


def test_a_stuck_radio_altimeter_puts_no_flight_on_the_ground() -> None:
    fast = course((60, 80, 300, 0, 0, 0), (60, 80, 900, 0, 0, 0), (60, 80, 900, 0, 0, 0))
    flight = without(flight_of(fast), "ins")
    stuck = replace(fast, height_m=np.zeros(len(fast.height_m)))
    phases, _ = agreement(with_height(flight, stuck, "radio_altimeter", "height_m"), fast)
    assert seconds(phases, "taxi") == 0.0 and seconds(phases, "standstill") == 0.0


def test_a_satellite_altitude_that_wanders_alone_is_no_flight() -> None:
    """A robot at 1 m/s whose receiver wanders by 40 m: neither pressure nor upward speed shows it."""
    truth = course(
        (20, 0, 0, 0, 0, 0), (1, 1, 0, 0, 0, 0), (200, 1, 0, 0, 0, 720), (1, 0, 0, 0, 0, 720), (20, 0, 0, 0, 0, 720)
    )
    flight = without(flight_of(truth, altitude_drift_m=20.0 * np.sin(truth.time_s / 6.0)), "ins")
    assert flight_phases(flight).vehicle.kind == "walks", "as slow as a walk"
    wheels = sampled("odometry", {"speed_mps": truth.speed_mps}, truth.time_s, 10.0, flight.start_ns)
    phases = flight_phases(replace(flight, tables={**flight.tables, "odometry": wheels}))
    assert (phases.vehicle.kind, phases.vehicle.why) == ("rolls", "wheel odometry in the log")
    alone = flight_phases(replace(flight, tables={"odometry": wheels}))
    assert seconds(alone, "driving") > 190.0, "the wheels tell the speed"


def test_level_and_steady_travel_is_no_known_kind() -> None:
    truth = course((200, 12, 50, 0, 0, 0), (0.02, 12, 50, 0, 0, 0))
    phases = flight_phases(without(flight_of(truth), "ins"))
    assert phases.vehicle.kind is None
    assert {one.phase for one in phases.likely} <= {"moving", "unknown"} and seconds(phases, "moving") > 190.0


def test_a_receiver_at_rest_stands() -> None:
    truth = course((200, 0, 0, 0, 0, 0), (0.02, 0, 0, 0, 0, 0))
    phases = flight_phases(without(flight_of(truth), "ins"))
    assert phases.vehicle.kind is None and phases.vehicle.why.startswith("it never moved")
    assert seconds(phases, "standstill") > 195.0


@pytest.mark.parametrize(
    ("metadata", "kind", "why"),
    [
        ({"vehicle": "rolls"}, "rolls", "head of the log"),
        ({"vehicle": " Walks "}, "walks", "head of the log"),
        ({"vehicle": "floats", STATED_BY: "aircraft file"}, "floats", "aircraft file"),
        ({"always_on_ground": "yes"}, "rolls", "head of the log"),
        ({"vehicle": "ArduRover"}, "rolls", "firmware ArduRover"),
        ({"vehicle": "APM:Copter"}, "flies", "firmware APM:Copter"),
        ({"vehicle": "system 1, component 1"}, "walks", ""),
        ({"vehicle": "hovercraft"}, "walks", ""),
    ],
)
def test_a_stated_kind_comes_before_what_is_found(metadata: dict[str, str], kind: str, why: str) -> None:
    vehicle = flight_phases(without(flight_of(walk()), "ins", metadata=metadata)).vehicle
    assert (vehicle.kind, vehicle.is_stated, vehicle.contradiction) == (kind, bool(why), "")
    assert vehicle.why == why or not why


def test_what_is_stated_to_roll_is_on_the_ground_throughout_by_either_name() -> None:
    flight = flight_of(walk())
    for metadata in ({"vehicle": "rolls"}, {"always_on_ground": "true"}):
        stated = replace(flight, metadata=metadata)
        proof = ground_mask(stated, stated["gnss"].time_ns)
        assert proof.mask.all() and proof.method == "said to be always on the ground"
        assert {one.phase for one in flight_phases(stated).intervals} == {"standstill", "driving"}
    walks = replace(flight, metadata={"vehicle": "walks"})
    assert not ground_mask(walks, walks["gnss"].time_ns).mask.all(), "a walk proves no rolling"


@pytest.mark.parametrize("kind", ["rolls", "walks", "floats"])
def test_a_stated_kind_that_the_log_contradicts_stays_and_says_so(kind: str) -> None:
    truth = light_aircraft()
    flown = flight_of(truth, weight_on_wheels=truth.contact)
    vehicle = flight_phases(replace(flown, metadata={"vehicle": kind})).vehicle
    assert vehicle.kind == kind
    assert vehicle.contradiction.startswith(f"head of the log: {kind}, but weight on wheels: ")
    assert not flight_phases(replace(flown, metadata={"vehicle": "flies"})).vehicle.contradiction


@pytest.mark.parametrize(("number", "kind"), [(2.0, "flies"), (10.0, "rolls"), (11.0, "floats"), (6.0, "walks")])
def test_the_type_that_an_autopilot_logs_tells_the_kind(number: float, kind: str) -> None:
    flight = without(flight_of(walk()), "ins")
    times = flight.start_ns + np.arange(10, dtype=np.int64) * NS_PER_S
    status = Table(
        "raw.vehicle_status", times, {"system_type": Column(np.full(10, number))}, np.arange(10), Column(times)
    )
    assert flight_phases(replace(flight, tables={**flight.tables, status.topic: status})).vehicle.kind == kind


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "kind", "moving"),
    [
        ("approach/flight_with_go_around_and_landing.hdf5", "flies", "airborne"),
        ("approach/coreg.hdf5", "flies", "airborne"),
        ("foreign/robot_localization_husky_test1.bag", "rolls", "driving"),
        ("foreign/robot_localization_jackal_test2.bag", "rolls", "driving"),
        ("gnss/walk_0827_gnss_1730.ubx", "walks", "walking"),
        ("gnss/drive_0708_gnss_1934_sf.pos", "rolls", "driving"),
    ],
)
def test_real_logs_that_proved_nothing_have_phases(name: str, kind: str, moving: str) -> None:
    flight = real_flight(name)
    phases = flight_phases(flight)
    assert [one.phase for one in phases.intervals] == ["unknown"] and phases.method.startswith("none: ")
    assert phases.vehicle.kind == kind
    assert seconds(phases, "unknown") < 0.01 * flight.duration_s
    assert seconds(phases, moving) > 0.7 * flight.duration_s


@pytest.mark.real_log
@pytest.mark.parametrize("left_out", [("discrete",), ("discrete", "radio_altimeter.1", "radio_altimeter.2", "air")])
def test_a_real_airliner_without_its_switch_flies_when_the_switch_says_so(left_out: tuple[str, ...]) -> None:
    flight = real_flight("approach/Specimen_Flight.hdf5")
    (truth,) = (one for one in flight_phases(flight).intervals if one.phase == "airborne")
    likely = flight_phases(without(flight, *left_out))
    assert seconds(likely, "airborne") == pytest.approx(truth.end_s - truth.start_s, abs=10.0)
