"""Ground proof and phases: no sample in the air may pass for ground, whatever flies and however it is logged."""

import gc
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column, RecordBatch
from groundstation.base.units import NS_PER_S
from groundstation.tables import phases as module
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.motion import LONGEST_GRID, Motion, motion_of, window_sum
from groundstation.tables.phases import PHASES, STEP_NS, Phases, flight_phases, ground_mask
from groundstation.tables.table import Flight, Table
from groundstation.tables.vehicle import ALWAYS_ON_GROUND

Floats = NDArray[np.float64]
STEP_S = 0.02
GROUND_M = 120.0


@dataclass(frozen=True)
class Course:
    """Truth at 50 Hz: what the vehicle did. ``contact`` is True on the ground."""

    speed_mps: Floats
    height_m: Floats
    roll_deg: Floats
    pitch_deg: Floats
    heading_deg: Floats
    contact: NDArray[np.bool_]

    @property
    def time_s(self) -> Floats:
        return np.arange(len(self.speed_mps)) * STEP_S


def course(*legs: tuple[float, float, float, float, float, float]) -> Course:
    """Legs of (duration s, speed, height, roll, pitch, heading) reached at their ends; contact where height is 0."""
    knots = np.array([legs[0], *legs])
    time = np.cumsum(knots[:, 0]) - knots[0, 0]
    at = np.arange(0.0, time[-1], STEP_S)
    speed, height, roll, pitch, heading = (np.interp(at, time, knots[:, column]) for column in range(1, 6))
    return Course(speed, height, roll, pitch, heading, height <= 0.0)


def light_aircraft() -> Course:
    """Stand, taxi at 8 m/s with a turn, line up, take off, circuit, land, taxi, stand."""
    return course(
        (40, 0, 0, 0, 2, 10), (10, 8, 0, 0, 2, 10), (60, 8, 0, 1, 2, 10), (15, 8, 0, -1, 2, 100), (10, 0, 0, 0, 2, 100),
        (15, 0, 0, 0, 2, 100), (18, 32, 0, 0, 2, 100), (4, 34, 0, 0, 6, 100), (60, 40, 200, 0, 8, 100),
        (5, 42, 205, 20, 3, 100), (30, 42, 210, 20, 2, 280), (5, 42, 210, 0, 2, 280), (60, 40, 210, 0, 2, 280),
        (40, 40, 210, 20, 2, 460), (90, 33, 3, 0, -2, 460), (6, 31, 0.3, 0, 4, 460), (3, 29, 0, 0, 4, 460),
        (25, 8, 0, 0, 2, 460), (40, 8, 0, 0, 2, 480), (10, 0, 0, 0, 2, 480), (30, 0, 0, 0, 2, 480),
    )  # fmt: skip


def smooth_noise(rng: np.random.Generator, count: int, sigma: float, seconds: float) -> Floats:
    knots = rng.normal(0.0, sigma, int(count * STEP_S / seconds) + 3)
    return np.interp(np.arange(count) * STEP_S / seconds, np.arange(len(knots)), knots)


def flight_of(
    truth: Course,
    *,
    seed: int = 0,
    rates_hz: tuple[float, float] = (50.0, 5.0),
    shaking_deg: Floats | float = 0.0,
    altitude_drift_m: Floats | float = 0.0,
    weight_on_wheels: NDArray[np.bool_] | None = None,
    has_ins_position: bool = False,
    start_ns: int = 1_777_874_400_000_000_000,
) -> Flight:
    """Log a course: INS attitude, GNSS position and velocity with noise, as a real receiver's."""
    rng = np.random.default_rng(seed)
    time_s, count = truth.time_s, len(truth.speed_mps)
    heading_rad = np.deg2rad(truth.heading_deg)
    north = np.cumsum(truth.speed_mps * np.cos(heading_rad)) * STEP_S
    east = np.cumsum(truth.speed_mps * np.sin(heading_rad)) * STEP_S
    latitude, longitude = latitude_longitude_deg(north, east, 56.0, 179.995)
    climb = np.gradient(truth.height_m, STEP_S)
    altitude = GROUND_M + truth.height_m + smooth_noise(rng, count, 0.7, 20.0) + altitude_drift_m
    shake = np.broadcast_to(shaking_deg, count)
    angles = {
        name: values + shake * smooth_noise(rng, count, 1.0, 0.7) + rng.normal(0.0, 0.03, count)
        for name, values in (("roll_deg", truth.roll_deg), ("pitch_deg", truth.pitch_deg))
    }
    ins = {**angles, "true_heading_deg": wrap_360(truth.heading_deg + shake * smooth_noise(rng, count, 1.0, 1.5))}
    gnss = {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "altitude_msl_m": altitude,
        "velocity_north_mps": truth.speed_mps * np.cos(heading_rad) + rng.normal(0.0, 0.05, count),
        "velocity_east_mps": truth.speed_mps * np.sin(heading_rad) + rng.normal(0.0, 0.05, count),
        "velocity_down_mps": -climb + rng.normal(0.0, 0.08, count),
    }
    tables = [sampled("ins", ins, time_s, rates_hz[0], start_ns), sampled("gnss", gnss, time_s, rates_hz[1], start_ns)]
    if weight_on_wheels is not None:
        wheels = {"weight_on_wheels": weight_on_wheels}
        tables.append(sampled("discrete", wheels, time_s, 10.0, start_ns))
    return Flight({table.topic: table for table in tables}, {}, start_ns, True, "made")


def sampled(topic: str, columns: dict[str, NDArray], time_s: Floats, rate_hz: float, start_ns: int) -> Table:  # type: ignore[type-arg]
    rows = np.arange(0, len(time_s), round(1.0 / (rate_hz * STEP_S)))
    time_ns = start_ns + np.round(time_s[rows] * NS_PER_S).astype(np.int64)
    return Table(topic, time_ns, {k: Column(v[rows]) for k, v in columns.items()}, rows, Column(time_ns))


def prove(flight: Flight, truth: Course) -> tuple[NDArray[np.bool_], str]:
    """Mask at the 50 Hz of the truth, after the two things that always hold: no air passes, phases cover the flight."""
    proof = ground_mask(flight, flight.start_ns + np.round(truth.time_s * NS_PER_S).astype(np.int64))
    in_air = np.flatnonzero(proof.mask & ~truth.contact)
    assert not in_air.size, f"air passes for ground at {truth.time_s[in_air[0]]:.2f} s by {proof.method}"
    assert_covers(flight_phases(flight), flight)
    return proof.mask, proof.method


def assert_covers(phases: Phases, flight: Flight) -> None:
    assert phases.start_s[0] == 0.0
    assert phases.end_s[-1] == flight.duration_s
    assert np.array_equal(phases.start_s[1:], phases.end_s[:-1])
    assert (phases.end_s > phases.start_s).all()
    assert set(phases.phase) <= set(PHASES)
    assert all(first != second for first, second in zip(phases.phase, phases.phase[1:], strict=False))


def order_of(phases: Phases, shortest_s: float = 1.0) -> list[str]:
    """Phases in order without the unknown and the short ones, neighbours of one name joined."""
    names = [
        interval.phase
        for interval in phases.intervals
        if interval.end_s - interval.start_s >= shortest_s and interval.phase != "unknown"
    ]
    return [name for row, name in enumerate(names) if row == 0 or names[row - 1] != name]


@pytest.mark.parametrize("rates_hz", [(50.0, 5.0), (50.0, 1.0), (1.0, 1.0), (10.0, 10.0)])
@pytest.mark.parametrize("seed", range(3))
def test_taxi_of_a_light_aircraft_is_proven_and_its_flight_is_not(seed: int, rates_hz: tuple[float, float]) -> None:
    truth = light_aircraft()
    flight = flight_of(truth, seed=seed, rates_hz=rates_hz)
    mask, method = prove(flight, truth)
    assert method.startswith("detector: standstills and rolling that adjoins them below ")
    taxi = truth.contact & (truth.speed_mps > 6.0) & (truth.speed_mps < 9.0)
    assert np.mean(mask[taxi]) > 0.9
    assert np.mean(mask[truth.contact & (truth.speed_mps == 0.0)]) > 0.97


@pytest.mark.parametrize("seed", range(3))
def test_phases_of_a_light_aircraft(seed: int) -> None:
    truth = light_aircraft()
    expected = [
        *("standstill", "taxi", "standstill", "take-off run", "airborne", "landing roll", "taxi", "standstill"),
    ]
    by_detector, by_wheels = (
        flight_phases(flight_of(truth, seed=seed, weight_on_wheels=wheels)) for wheels in (None, truth.contact)
    )
    lift_off = truth.time_s[np.argmin(truth.contact)]
    touch_down = truth.time_s[len(truth.contact) - np.argmin(truth.contact[::-1])]
    for phases, tolerance_s in (
        (by_detector, 7.5),
        (by_wheels, 0.3),
    ):  # a float of 7 s below 2.2 m, altitudes off by 0.7
        assert order_of(phases, 6.0) == expected
        (air,) = (interval for interval in phases.intervals if interval.phase == "airborne")
        assert air.start_s == pytest.approx(lift_off, abs=tolerance_s)
        assert air.end_s == pytest.approx(touch_down, abs=tolerance_s)
    assert by_wheels.method == "weight on wheels"
    assert by_wheels.at(np.array([-1.0, 5.0, lift_off + 30.0, 1e6, np.nan])).tolist() == [
        *("unknown", "standstill", "airborne", "unknown", "unknown"),
    ]
    assert by_wheels.seconds_in("airborne") == pytest.approx(touch_down - lift_off, abs=0.5)


@pytest.mark.parametrize("slope", [-0.01, 0.01])
@pytest.mark.parametrize("rates_hz", [(50.0, 5.0), (50.0, 1.0)])
@pytest.mark.parametrize("seed", range(3))
def test_a_flare_over_a_sloping_runway_is_flown(seed: int, rates_hz: tuple[float, float], slope: float) -> None:
    truth = light_aircraft()
    touch_down = len(truth.contact) - int(np.argmin(truth.contact[::-1]))
    along_m = np.cumsum(truth.speed_mps) * STEP_S
    along_m -= along_m[touch_down] - 900.0  # the runway begins 900 m before the touch-down, and is 1500 m long
    flight = flight_of(truth, seed=seed, rates_hz=rates_hz, altitude_drift_m=slope * np.clip(along_m, 0.0, 1500.0))
    phases = flight_phases(flight)
    (air,) = (interval for interval in phases.intervals if interval.phase == "airborne")
    assert np.interp(air.end_s, truth.time_s, truth.height_m) < 3.0  # 1.5 m, the error of altitudes and of the slope
    assert air.end_s < truth.time_s[touch_down] + 3.0
    for one in phases.likely:
        rows = (truth.time_s >= one.start_s) & (truth.time_s < one.end_s)
        assert truth.contact[rows].all() or one.phase == "airborne" or not one.is_proven, one
    (run,) = (one for one in phases.intervals if one.phase == "landing roll")
    assert run.start_s == air.end_s
    parts = [(one.is_proven, one.end_s) for one in phases.likely if one.phase == "landing roll"]
    assert [is_proven for is_proven, _ in parts] == [False, True] and parts[1][1] == run.end_s


def test_turning_the_world_or_shifting_time_changes_nothing() -> None:
    truth = light_aircraft()
    turned = replace(truth, heading_deg=truth.heading_deg + 137.0)
    mask, _ = prove(flight_of(truth), truth)
    assert np.mean(mask == prove(flight_of(turned), turned)[0]) > 0.99  # the noise falls otherwise on the axes
    assert np.array_equal(mask, prove(flight_of(truth, start_ns=0), truth)[0])


def test_the_motion_of_a_flight_is_found_once_and_forgotten_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = light_aircraft()
    asked: list[Flight] = []

    def motion(flight: Flight) -> Motion:
        asked.append(flight)
        return motion_of(flight)

    monkeypatch.setattr(module, "motion_of", motion)
    flights = [flight_of(truth), replace(flight_of(truth), metadata={ALWAYS_ON_GROUND: "yes"})]
    times = flights[0].start_ns + np.arange(0, 600, dtype=np.int64) * NS_PER_S
    alone = ground_mask(flight_of(truth), times)
    del asked[:]
    found = flight_phases(flights[0])
    again = [ground_mask(flights[0], times) for _ in range(3)]
    assert len(asked) == 1 and all(np.array_equal(one.mask, alone.mask) for one in again)
    assert not np.all(alone.mask) and np.all(ground_mask(flights[1], times).mask), "each has its own"
    assert found == flight_phases(flights[0])
    theirs = {id(one) for one in flights}
    assert theirs <= {flight for flight, _ in module._KEPT}
    asked.clear()
    del flights
    gc.collect()
    assert theirs.isdisjoint(flight for flight, _ in module._KEPT)


def test_drifting_satellite_altitude_does_not_stop_the_taxi() -> None:
    """A receiver that settles by 25 m over the first five minutes, as after a cold start."""
    truth = course(
        (120, 0, 0, 0, 2, 10), (10, 8, 0, 0, 2, 10), (120, 8, 0, 0, 2, 10), (10, 0, 0, 0, 2, 10), (30, 0, 0, 0, 2, 10)
    )
    drift = -25.0 * np.exp(-truth.time_s / 100.0)
    mask, _ = prove(flight_of(truth, altitude_drift_m=drift), truth)
    assert np.mean(mask[truth.speed_mps > 6.0]) > 0.9


def hovering() -> Course:
    """Multirotor: stand, climb, hover, dash at 8 m/s, hover, land."""
    return course(
        (30, 0, 0, 0, 0, 50), (6, 0, 12, 0, 0, 50), (60, 0, 12, 0, 0, 50), (3, 8, 12, 0, -9, 50),
        (40, 8, 12, 0, -6, 50), (3, 0, 12, 0, 9, 50), (1, 0, 12, 0, 0, 50), (60, 0, 12, 0, 0, 50),
        (25, 0, 0, 0, 0, 50), (30, 0, 0, 0, 0, 50),
    )  # fmt: skip


@pytest.mark.parametrize("shaking_deg", [0.0, 0.4, 1.0])  # 0: a hover as steady as a parked aircraft
@pytest.mark.parametrize("seed", range(3))
def test_hovering_multirotor_is_only_proven_where_it_stands(seed: int, shaking_deg: float) -> None:
    truth = hovering()
    mask, _ = prove(flight_of(truth, seed=seed, shaking_deg=np.where(truth.contact, 0.0, shaking_deg)), truth)
    assert np.mean(mask[truth.contact]) > 0.8


def test_hover_in_a_log_that_starts_and_ends_in_the_air_is_not_proven() -> None:
    truth = course(
        (60, 0, 30, 0, 0, 50),
        (5, 8, 30, 0, -8, 50),
        (60, 8, 30, 0, -6, 50),
        (5, 0, 30, 0, 0, 50),
        (60, 0, 30, 0, 0, 50),
    )
    mask, method = prove(flight_of(truth, shaking_deg=0.5), truth)
    assert not mask.any()
    assert method == "none: no standstill of a parked vehicle (no weight on wheels)"


def hand_launch() -> Course:
    """UAV: lies, is carried and thrown, flies level for ten seconds, climbs, circles, lands on its belly."""
    return course(
        (30, 0, 0, 0, 0, 0), (2, 0, 1.2, 20, 20, 30), (15, 1.5, 1.2, -25, 5, 90), (10, 0, 1.6, 3, 10, 90),
        (0.6, 14, 2, 0, 5, 90), (10, 15, 2, 0, 3, 90), (20, 15, 60, 0, 12, 90), (5, 15, 60, 30, 2, 90),
        (60, 16, 60, 30, 2, 1000), (5, 16, 60, 0, 2, 1000), (40, 14, 1, 0, -5, 1000), (3, 12, 0, 0, 2, 1000),
        (2, 0, 0, 3, 1, 1010), (40, 0, 0, 3, 1, 1010),
    )  # fmt: skip


def carried_and_launched_twice() -> tuple[Course, Floats]:
    """Stand, be carried at 2 m, fly; land, be carried again, hop to 20 m; and where it shakes in somebody's hands."""
    truth = course(
        (40, 0, 0, 0, 0, 0), (2, 1.5, 2, 0, 0, 0), (40, 1.5, 2, 8, 4, 90), (20, 0.2, 2, 6, 4, 90),
        (4, 12, 8, 0, 8, 90), (20, 12, 45, 0, 4, 90), (90, 12, 45, 20, 0, 810), (25, 10, 2, 0, -3, 810),
        (3, 8, 0, 0, 0, 810), (4, 0, 0, 0, 0, 810), (40, 0, 0, 0, 0, 810), (2, 1.5, 2, 0, 0, 810),
        (40, 1.5, 2, 8, 4, 900), (3, 12, 6, 0, 8, 900), (8, 12, 20, 0, 4, 900), (40, 12, 20, 20, 0, 1260),
        (12, 10, 2, 0, -3, 1260), (3, 8, 0, 0, 0, 1260), (4, 0, 0, 0, 0, 1260), (40, 0, 0, 0, 0, 1260),
    )  # fmt: skip
    return truth, np.where((truth.height_m > 0.0) & (truth.speed_mps < 2.0), 1.5, 0.0)


def catapult() -> Course:
    """UAV: stands on a rail, leaves it level at 16 m/s within a second and stays two metres up for eight seconds."""
    return course(
        (40, 0, 0, 0, 5, 90), (0.8, 16, 0.5, 0, 5, 90), (8, 16, 2, 0, 4, 90), (30, 17, 120, 0, 10, 90),
        (5, 17, 120, 25, 2, 90), (60, 17, 120, 25, 2, 1000), (5, 17, 120, 0, 2, 1000), (60, 16, 120, 0, 2, 1000),
    )  # fmt: skip


def ends_after_a_low_lift_off() -> Course:
    """The log stops soon after a float of fifteen seconds, with no circuit to learn flying speeds from."""
    return course((40, 0, 0, 0, 2, 0), (20, 30, 0, 0, 2, 0), (15, 33, 1.0, 0, 4, 0), (6, 35, 15, 0, 7, 0))


def into_strong_wind() -> Course:
    """Ground speed of 5 m/s in the climb and 25 m/s downwind: slow is not on the ground."""
    return course(
        (40, 0, 0, 0, 2, 0), (4, 4, 0, 0, 3, 0), (30, 5, 60, 0, 10, 0), (6, 5, 62, 25, 3, 0), (12, 25, 62, 25, 2, 180),
        (60, 25, 62, 0, 2, 180), (12, 5, 62, 25, 2, 360), (60, 5, 2, 0, -2, 360), (5, 4, 0, 0, 3, 360),
        (2, 0, 0, 0, 2, 360), (30, 0, 0, 0, 2, 360),
    )  # fmt: skip


def touch_and_go() -> Course:
    legs = [
        (30, 0, 0, 0, 2, 0),
        (15, 30, 0, 0, 2, 0),
        (40, 35, 150, 0, 7, 0),
        (20, 35, 150, 20, 2, 180),
        (60, 35, 150, 0, 2, 180),
    ]
    legs += [
        (20, 35, 150, 20, 2, 360),
        (60, 30, 0, 0, -1, 360),
        (6, 24, 0, 0, 2, 360),
        (8, 31, 0, 0, 2, 360),
        (40, 35, 150, 0, 7, 360),
    ]
    legs += [(60, 35, 150, 0, 2, 360), (60, 30, 0, 0, -1, 360), (20, 0, 0, 0, 2, 360), (30, 0, 0, 0, 2, 360)]
    return course(*legs)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "make",
    [hand_launch, catapult, ends_after_a_low_lift_off, into_strong_wind, touch_and_go],
    ids=lambda make: make.__name__,
)
@pytest.mark.parametrize("rates_hz", [(50.0, 5.0), (50.0, 1.0), (1.0, 1.0)])
@pytest.mark.parametrize("seed", range(3))
def test_no_air_passes(make: Callable[[], Course], rates_hz: tuple[float, float], seed: int) -> None:
    truth = make()
    shaking = np.where(truth.contact, 0.0, 0.5)
    mask, _ = prove(flight_of(truth, seed=seed, rates_hz=rates_hz, shaking_deg=shaking), truth)
    assert mask[(truth.time_s > 2.0) & (truth.time_s < 25.0)].all()  # every one of them stands at the start


@pytest.mark.parametrize("seed", range(3))
def test_what_is_carried_does_not_fly_and_a_low_hop_does(seed: int) -> None:
    truth, shaking_deg = carried_and_launched_twice()
    flight = flight_of(truth, seed=seed, shaking_deg=shaking_deg)
    label = flight_phases(flight).at(truth.time_s)
    is_carried, is_flying = shaking_deg > 0.0, (truth.height_m > 5.0) & (truth.speed_mps > 8.0)
    assert np.mean(label[is_flying] == "airborne") > 0.99
    assert np.sum(label[is_carried] == "airborne") * STEP_S < 1.0
    assert order_of(flight_phases(flight)).count("airborne") == 2


def test_log_that_starts_in_the_air_proves_only_what_adjoins_its_last_standstill() -> None:
    whole = light_aircraft()
    rows = slice(int(250.0 / STEP_S), None)
    truth = Course(*(getattr(whole, name)[rows] for name in Course.__dataclass_fields__))
    flight = flight_of(truth)
    mask, _ = prove(flight, truth)
    assert mask[-100:].all()
    assert "take-off run" not in flight_phases(flight).phase


def test_a_gap_in_the_data_ends_the_proof() -> None:
    truth = light_aircraft()
    flight = flight_of(truth)
    lost = (flight.time_s("gnss") > 70.0) & (flight.time_s("gnss") < 80.0)
    cut = Flight({"ins": flight["ins"], "gnss": flight["gnss"].take(~lost)}, {}, flight.start_ns, True, "cut")
    mask, _ = prove(cut, truth)
    assert not mask[(truth.time_s > 68.0) & (truth.time_s < 82.0)].any()
    assert mask[(truth.time_s > 52.0) & (truth.time_s < 60.0)].all()
    assert mask[(truth.time_s > 90.0) & (truth.time_s < 100.0)].all()  # from the standstill of the line-up, backward


def test_weight_on_wheels_is_believed_and_needs_a_sample_on_either_side() -> None:
    truth = light_aircraft()
    flight = flight_of(truth, weight_on_wheels=truth.contact)
    mask, method = prove(flight, truth)
    assert method == "weight on wheels"
    assert np.count_nonzero(truth.contact & ~mask) * STEP_S < 0.5
    lift_off_ns = flight.start_ns + round(truth.time_s[np.argmin(truth.contact)] * NS_PER_S)
    wheels = flight["discrete"]
    lost = np.abs(wheels.time_ns - lift_off_ns) < 4 * NS_PER_S
    cut = Flight({**flight.tables, "discrete": wheels.take(~lost)}, {}, flight.start_ns, True, "cut")
    mask, _ = prove(cut, truth)
    near = np.abs(truth.time_s - (lift_off_ns - flight.start_ns) / NS_PER_S) < 3.9
    assert not mask[near].any()


@pytest.mark.parametrize("is_inverted", [False, True])
def test_weight_on_wheels_that_cannot_be_is_not_believed(is_inverted: bool) -> None:
    truth = light_aircraft()
    stuck = ~truth.contact if is_inverted else np.ones(len(truth.contact), dtype=bool)
    mask, method = prove(flight_of(truth, weight_on_wheels=stuck), truth)
    assert method.startswith("detector")
    assert "weight on wheels not believed: on the ground from" in method
    assert mask[truth.time_s < 30.0].all()


def test_weight_on_wheels_logged_on_change_can_deny_but_not_prove() -> None:
    truth = light_aircraft()
    flight = flight_of(truth, weight_on_wheels=truth.contact)
    wheels = flight["discrete"]
    changes = np.flatnonzero(np.diff(wheels.values("weight_on_wheels"), prepend=-1.0) != 0.0)
    rare = Flight({**flight.tables, "discrete": wheels.take(changes)}, {}, flight.start_ns, True, "rare")
    mask, method = prove(rare, truth)
    assert "logged too rarely, 3 samples" in method
    assert mask[truth.time_s < 30.0].all()


@pytest.mark.parametrize(
    ("firmware", "mav_type", "expected"),
    [
        ("ArduCopter", None, "on the ground"),
        ("", 2.0, "on the ground"),
        ("ArduPlane", None, "taxi"),
        ("", 1.0, "taxi"),
        ("", 22.0, "taxi"),
        ("", None, "taxi"),
    ],
    ids=["ArduPilot copter", "PX4 quadrotor", "ArduPilot plane", "PX4 plane", "PX4 tiltrotor", "unknown"],
)
def test_a_rotorcraft_does_not_taxi_it_is_on_the_ground(firmware: str, mav_type: float | None, expected: str) -> None:
    truth = light_aircraft()
    plain = flight_of(truth, weight_on_wheels=truth.contact)
    tables, time_ns = dict(plain.tables), plain["discrete"].time_ns[:2]
    if mav_type is not None:
        kind, rows = {"system_type": Column(np.full(2, mav_type))}, np.arange(2)
        tables["raw.vehicle_status"] = Table("raw.vehicle_status", time_ns, kind, rows, Column(time_ns))
    flight = Flight(tables, {"vehicle": firmware} if firmware else {}, plain.start_ns, True, "a.log")
    found = flight_phases(flight)
    names = {one.phase for one in found.likely}
    assert expected in names and names.isdisjoint({"taxi", "on the ground"} - {expected})
    assert ("take-off run" in names) == ("landing roll" in names) == (expected == "taxi")
    ground = ("taxi", "on the ground", "take-off run", "landing roll", "standstill")
    assert sum(found.seconds_in(one) for one in ground) == pytest.approx(
        sum(flight_phases(plain).seconds_in(one) for one in ground)
    )


def test_landed_flag_of_an_autopilot_is_named() -> None:
    truth = light_aircraft()
    flight = flight_of(truth, weight_on_wheels=truth.contact)
    columns = {"landed": flight["discrete"].columns["weight_on_wheels"]}
    wheels = flight["discrete"]
    landed = Table("raw.vehicle_land_detected", wheels.time_ns, columns, wheels.record_index, wheels.device_time_ns)
    tables = {"ins": flight["ins"], "gnss": flight["gnss"], landed.topic: landed}
    assert prove(Flight(tables, {}, flight.start_ns, True, "px4"), truth)[1] == "landed flag"


@pytest.mark.parametrize("topic", ["ins", "gnss"])
def test_without_what_it_needs_nothing_is_proven_and_the_reason_is_given(topic: str) -> None:
    truth = light_aircraft()
    flight = flight_of(truth)
    alone = Flight({topic: flight[topic]}, {}, flight.start_ns, True, "part")
    mask, method = prove(alone, truth)
    assert not mask.any()
    missing = "ground speed" if topic == "ins" else "roll and pitch"
    assert method == f"none: no {missing} in the log (no weight on wheels)"
    phases = flight_phases(alone)
    assert phases.phase.tolist() == ["unknown"]


def test_each_quantity_is_that_of_the_first_ins_that_has_it() -> None:
    """An INS with a heading alone came first on the buses of a real aircraft: "no ground speed in the log"."""
    flight = flight_of(light_aircraft(), rates_hz=(5.0, 5.0))
    whole = replace(flight["ins"], columns={**flight["gnss"].columns, **flight["ins"].columns})
    attitude = ("roll_deg", "pitch_deg", "true_heading_deg")
    split = {
        "ins.1": ("true_heading_deg",),
        "ins.2": attitude,
        "ins.3": tuple(name for name in whole.columns if name not in attitude),
    }
    tables = {
        topic: replace(whole, topic=topic, columns={name: whole.columns[name] for name in names})
        for topic, names in split.items()
    }
    one, several = (motion_of(replace(flight, tables=tables)) for tables in ({"ins": whole}, tables))
    for name in ("speed_mps", "roll_deg", "pitch_deg", "heading_deg", "north_m", "climb_mps", "all_altitudes_m"):
        assert np.isfinite(getattr(one, name)).any(), name
        np.testing.assert_array_equal(getattr(several, name), getattr(one, name), err_msg=name)


def test_nan_everywhere_one_sample_and_no_sample() -> None:
    truth = light_aircraft()
    flight = flight_of(truth)
    gnss = flight["gnss"]
    unknown = {name: Column(np.full(len(gnss), np.nan)) for name in gnss.columns}
    blank = Table("gnss", gnss.time_ns, unknown, gnss.record_index, gnss.device_time_ns)
    assert not prove(Flight({**flight.tables, "gnss": blank}, {}, flight.start_ns, True, "nan"), truth)[0].any()
    one = Flight({"ins": flight["ins"].take([0])}, {}, flight.start_ns, True, "one")
    for case in (one, Flight({}), Flight({"ins": Table.empty("ins")})):
        assert flight_phases(case).intervals == ()
        assert flight_phases(case).at(np.array([0.0])).tolist() == ["unknown"]
        assert ground_mask(case, np.array([0, case.start_ns])).mask.tolist() == [False, False]
        assert ground_mask(case, np.zeros(0, dtype=np.int64)).mask.shape == (0,)


def test_a_stuck_altitude_proves_nothing() -> None:
    truth = light_aircraft()
    flight = flight_of(replace(truth, height_m=np.zeros(len(truth.height_m))))
    gnss = flight["gnss"]
    stuck = Column(np.full(len(gnss), 120.0))
    tables = {**flight.tables, "gnss": replace(gnss, columns={**gnss.columns, "altitude_msl_m": stuck})}
    mask, _ = prove(Flight(tables, {}, flight.start_ns, True, "stuck"), truth)
    assert np.max(truth.speed_mps[mask], initial=0.0) < 15.0


REAL_LOGS = Path(os.environ.get("GROUNDSTATION_REAL_LOGS") or Path(__file__).parents[3] / "shared" / "data")


def real_flight(name: str) -> Flight:
    """A real log as its reader gives it, on the recorder's own clock."""
    path = REAL_LOGS / name
    if not path.exists():
        pytest.skip(f"{path} is not here: set GROUNDSTATION_REAL_LOGS")
    from groundstation.readers.registry import read

    batches = [item.take(item.device_time_ns.mask) for item in read(path) if isinstance(item, RecordBatch)]
    timed = [replace(batch, time_ns=batch.device_time_ns.values) for batch in batches]
    return flight_from_batches(timed, metadata={}, has_utc=False, source_name=name)


@pytest.mark.real_log
def test_real_uav_carried_by_hand_taxied_flown_and_carried_home() -> None:
    flight = real_flight("fixedwing/umn_thor_flight75.csv")
    phases = flight_phases(flight)
    assert_covers(phases, flight)
    assert order_of(phases, 2.5) == [
        *("standstill", "taxi", "standstill", "take-off run", "airborne", "landing roll", "standstill"),
    ]
    mask = ground_mask(flight, flight["ins"].time_ns).mask
    time_s = flight.time_s("ins")
    carried = ((time_s > 84.0) & (time_s < 106.0)) | ((time_s > 606.0) & (time_s < 624.0))
    flying = (time_s > 208.0) & (time_s < 582.0)  # by eye: speed, altitude, attitude
    assert not mask[carried | flying].any()
    assert mask[(time_s > 112.0) & (time_s < 200.0)].all()


@pytest.mark.real_log
def test_real_cruise_with_weight_off_wheels_has_no_ground() -> None:
    flight = real_flight("inertial/gv_ff02.csv")
    proof = ground_mask(flight, flight["gnss"].time_ns)
    assert (proof.method, bool(proof.mask.any())) == ("weight on wheels", False)
    assert order_of(flight_phases(flight), 20.0) == ["airborne"]


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "lift_off_s", "touch_down_s"),  # by eye: pitch and altitude; touch-down of the analysis of landings
    [("log_210623_141501_TEST1.csv", 843.0, 4355.5), ("log_220417_125002_LFQA.csv", 671.0, 2668.4)],
)
def test_real_light_aircraft_at_one_hertz(name: str, lift_off_s: float, touch_down_s: float) -> None:
    flight = real_flight(f"g1000/{name}")
    phases = flight_phases(flight)
    assert_covers(phases, flight)
    (air,) = (interval for interval in phases.intervals if interval.phase == "airborne")
    assert air.start_s == pytest.approx(lift_off_s, abs=1.5)
    assert air.end_s == pytest.approx(touch_down_s, abs=2.0)
    table = flight["gnss"]
    mask, time_s = ground_mask(flight, table.time_ns).mask, flight.time_s("gnss")
    speed = np.hypot(table.values("velocity_north_mps"), table.values("velocity_east_mps"))
    assert not mask[(time_s > lift_off_s) & (time_s < touch_down_s)].any()
    assert np.count_nonzero(mask & (speed > 6.0)) >= 30  # take-off run and landing roll: its taxi never is so fast


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["log_220416_161856_LFQA.csv", "log_220502_135932_EGPN.csv"])
def test_real_light_aircraft_that_only_taxied(name: str) -> None:
    flight = real_flight(f"g1000/{name}")
    phases = flight_phases(flight)
    assert set(phases.phase) == {"unknown", "standstill", "taxi"}
    first = int(np.argmax(flight["gnss"].valid("latitude_deg")))  # the rows before it say that there is no fix
    fixed_s = flight.duration_s - flight.time_s("gnss")[first]
    assert phases.seconds_in("standstill") + phases.seconds_in("taxi") > 0.9 * fixed_s


@pytest.mark.parametrize("half", [0, 1, 3, 9, 40])
@pytest.mark.parametrize("shape", [(0,), (1,), (9,), (2, 31)])
def test_a_sum_over_a_window_is_cut_at_the_ends(half: int, shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(3).integers(-9, 9, shape).astype(float)
    rows = range(shape[-1])
    told = [values[..., max(row - half, 0) : row + half + 1].sum(axis=-1) for row in rows]
    assert np.array_equal(np.moveaxis(window_sum(values, half), -1, 0), np.reshape(told, (shape[-1], *shape[:-1])))


def test_a_span_of_many_days_has_no_phases_and_says_so() -> None:
    time_ns = np.array([0, LONGEST_GRID * STEP_NS])
    columns = {"ground_speed_mps": Column(np.zeros(2))}
    batch = RecordBatch("gnss", np.arange(2), Column(time_ns), columns, time_ns)
    flight = flight_from_batches([batch], metadata={}, has_utc=False, source_name="days.csv")
    phases = flight_phases(flight)
    assert phases.intervals == () and "a span of many days" in phases.method


def test_what_turns_by_hand_does_not_stand() -> None:
    """A model carried slowly turns by 150 deg in ten seconds; an estimate that jumps is none that turns."""
    heading = np.concatenate([np.full(3000, 8.0), np.linspace(8.0, 158.0, 1000), np.full(6000, 158.0)])
    heading[7000:] = 318.0
    count = len(heading)
    zero = np.zeros(count)
    still = Course(zero, zero, zero, zero, heading, np.ones(count, dtype=bool))
    phases = flight_phases(flight_of(still, weight_on_wheels=np.ones(count, dtype=bool)))
    standing = [(one.start_s, one.end_s) for one in phases.likely if one.phase == "standstill"]
    assert standing[0][1] == pytest.approx(3000 * STEP_S, abs=1.0)
    assert standing[1] == pytest.approx((4000 * STEP_S, (count - 1) * STEP_S), abs=1.0), "the jump is no turn"
