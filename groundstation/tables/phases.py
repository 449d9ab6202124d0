"""Phases of a flight, and the intervals in which it is proven to be on the ground."""

import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.tables.detector import Detection, GroundSettings, detect_ground, lasting
from groundstation.tables.lift_off import between_lift_off_and_touch_down
from groundstation.tables.likely import likely_of
from groundstation.tables.motion import (
    RATE_HZ,
    Motion,
    grid_size,
    motion_of,
    running_mean,
    runs,
)
from groundstation.tables.table import Flight
from groundstation.tables.travel import travel_of
from groundstation.tables.vehicle import Vehicle, VehicleKind, is_rotorcraft, is_stated_to_roll, vehicle_of
from groundstation.tables.wheels import LONGEST_HOLD_S, contact_of, disbelief, held

Phase = Literal[
    "unknown",
    "standstill",
    "taxi",
    "take-off run",
    "airborne",
    "landing roll",
    "driving",
    "walking",
    "under way",
    "on the ground",
    "moving",
]
PHASES: tuple[Phase, ...] = get_args(Phase)
UNKNOWN, STANDSTILL, TAXI, TAKE_OFF_RUN, AIRBORNE, LANDING_ROLL = range(6)
DRIVING, WALKING, UNDER_WAY, SOMEWHERE_ON_GROUND, MOVING = range(6, len(PHASES))
ON_GROUND: dict[VehicleKind | None, int] = {"rolls": DRIVING, "walks": WALKING, "floats": UNDER_WAY}  # else taxi

GROUND_PHASES: tuple[Phase, ...] = (
    "standstill",
    "taxi",
    "take-off run",
    "landing roll",
    "driving",
    "walking",
    "under way",
    "on the ground",
)

STEP_NS = round(NS_PER_S / RATE_HZ)
LEAST_COVERAGE = 0.5  # share of the flight for which a flag must speak
RUN_SHARE = 0.25  # a run begins and a roll ends at this share of the speed at lift-off and touch-down
SLOWEST_RUN_MPS = 3.0  # an aircraft that lifts off slower made no run
SHORTEST_STANDSTILL_S = 3.0
TURNS_DPS, TURNS_S = 3.0, 2.0  # a vehicle that turns so fast for so long does not stand


NO_VEHICLE = Vehicle(None, "nothing says it")


@dataclass(frozen=True)
class GroundProof:
    """Ground contact at given times.

    Parameters
    ----------
    mask : ndarray of bool, shape (n,)
        True only where contact is proven. False means airborne or not known.
    method : str
        ``weight on wheels``, ``landed flag``, ``detector`` with what it rests on, or ``none: `` and the reason.
    """

    mask: BoolArray
    method: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "mask", frozen(self.mask))


@dataclass(frozen=True)
class PhaseInterval:
    """One phase from ``start_s`` to ``end_s``, flight seconds.

    ``is_proven`` is False where speed and height make it likely and nothing proves it.
    """

    start_s: float
    end_s: float
    phase: Phase
    is_proven: bool = True


@dataclass(frozen=True)
class Phases:
    """Phases of a flight, and the method that found them.

    The intervals do not overlap and reach from its first to its last sample.

    Parameters
    ----------
    intervals : tuple of PhaseInterval
        What is proven, runs and rolls whole, and ``unknown`` elsewhere: all that a method may rest on.
    method : str
    likely : tuple of PhaseInterval
        The same with what is likely in place of ``unknown``: for people.
    vehicle : Vehicle
        Kind of vehicle, which names the phases on the ground: taxi, driving, walking, under way or on the ground.
    """

    intervals: tuple[PhaseInterval, ...]
    method: str
    likely: tuple[PhaseInterval, ...] = ()
    vehicle: Vehicle = NO_VEHICLE

    @property
    def start_s(self) -> FloatArray:
        """Starts of the intervals, shape (k,)."""
        return np.array([interval.start_s for interval in self.intervals], dtype=np.float64)

    @property
    def end_s(self) -> FloatArray:
        """Ends of the intervals, shape (k,)."""
        return np.array([interval.end_s for interval in self.intervals], dtype=np.float64)

    @property
    def phase(self) -> NDArray[np.str_]:
        """Names of the phases, shape (k,)."""
        return np.array([interval.phase for interval in self.intervals], dtype="U16")

    def at(self, time_s: FloatArray) -> NDArray[np.str_]:
        """Phase at flight times, shape as ``time_s``; ``unknown`` outside the flight."""
        if not self.intervals:
            return np.full(np.shape(time_s), "unknown", dtype="U16")
        index = np.searchsorted(self.start_s, time_s, side="right") - 1
        is_inside = (index >= 0) & (np.asarray(time_s) <= self.end_s[-1])
        return np.where(is_inside, self.phase[index], "unknown")

    def seconds_in(self, phase: Phase) -> float:
        """Total length of a phase, seconds."""
        return sum(interval.end_s - interval.start_s for interval in self.intervals if interval.phase == phase)


def ground_mask(flight: Flight, time_ns: Int64Array, *, settings: GroundSettings | None = None) -> GroundProof:
    """Prove ground contact at given times.

    A log whose metadata say ``vehicle`` rolls (or ``always_on_ground``) is on the ground throughout. Weight on wheels
    (or an autopilot's landed flag) decides where it is logged often enough and is plausible: a flag that stays on the
    wheels high above the ground at speed is not believed. Else the motion has to prove it, see
    :func:`groundstation.tables.detector.detect_ground`.

    Parameters
    ----------
    flight : Flight
    time_ns : ndarray of int64, shape (n,)
        Corrected times, in any order.
    settings : GroundSettings, optional

    Returns
    -------
    GroundProof
    """
    with _evidence_of(flight, settings) as evidence:
        return evidence.proof(np.asarray(time_ns, dtype=np.int64))


def flight_phases(flight: Flight, *, settings: GroundSettings | None = None) -> Phases:
    """Divide a flight into standstill, taxi, take-off run, airborne, landing roll and unknown.

    What rolls, walks or floats drives, walks or is under way in place of taxi; a multirotor or helicopter is on the
    ground, and makes neither run nor roll. Standstill and taxi are proven ground
    (:func:`ground_mask`). Airborne is weight off wheels, or, by the detector, everything between lift-off and
    touch-down around sure flight, both read off the altitude. A take-off run is the stretch before lift-off that is
    faster than a quarter of the speed there, a landing roll the like after touch-down: these two may hold samples that
    are not proven ground, which ``likely`` tells apart. All else is unknown in ``intervals``, and in ``likely`` what
    :func:`groundstation.tables.likely.likely_of` makes of it.
    """
    with _evidence_of(flight, settings) as evidence:
        size = grid_size(flight)
        if size <= 1:
            return Phases((), evidence.method)
        travel = travel_of(flight, evidence.motion)
        contact = None if evidence.against_flag else evidence.contact
        vehicle = vehicle_of(flight, travel, contact, evidence.detection)
        rolling = ON_GROUND.get(vehicle.kind, SOMEWHERE_ON_GROUND if is_rotorcraft(flight) else TAXI)
        proven = _labels(evidence, evidence.ground, evidence.airborne, evidence.motion.speed_mps, rolling)
        found = likely_of(
            travel, evidence.motion, vehicle.kind, (evidence.ground, evidence.airborne), evidence.detection
        )
        label = _labels(evidence, found.ground, found.airborne, travel.speed_mps, rolling)
        label[found.moving & (label == UNKNOWN)] = MOVING
        is_known = proven != UNKNOWN
        label[is_known] = proven[is_known]
        is_proven = is_known & (evidence.ground | (proven == AIRBORNE))  # the rest of a run or roll is only likely
        label[(label == rolling) & ~np.isfinite(travel.speed_mps)] = SOMEWHERE_ON_GROUND
        return Phases(
            _intervals(flight, proven, np.ones(size, dtype=bool)),
            evidence.method,
            _intervals(flight, label, is_proven),
            vehicle,
        )


def _intervals(flight: Flight, label: NDArray[np.int64], is_proven: BoolArray) -> tuple[PhaseInterval, ...]:
    """Intervals of one label and one kind of proof, from the start of the flight to its end."""
    edges = np.flatnonzero((np.diff(label) != 0) | (np.diff(is_proven.astype(np.int8)) != 0)) + 1
    bounds = [0.0, *(float(edge) / RATE_HZ for edge in edges), flight.duration_s]
    rows = [0, *edges.tolist()]
    return tuple(
        PhaseInterval(start, end, PHASES[label[row]], bool(is_proven[row]))
        for row, (start, end) in zip(rows, pairwise(bounds), strict=True)
    )


@contextmanager
def _evidence_of(flight: Flight, settings: GroundSettings | None) -> Iterator["_Evidence"]:
    """Yield the evidence in a flight, kept as long as the flight is.

    Analyses ask for the ground one after the other. The motion, which is large, is not kept.
    """
    key = id(flight), settings or GroundSettings()
    kept = _KEPT.get(key)
    if kept is None:
        kept = _KEPT[key] = _Evidence(flight, key[1])
        weakref.finalize(flight, _KEPT.pop, key, None)
    try:
        yield kept
    finally:
        kept.__dict__.pop("motion", None)


class _Evidence:
    """Evidence for ground and for flight, computed once.

    It is the flag if it can be believed, else the detector.
    """

    def __init__(self, flight: Flight, settings: GroundSettings) -> None:
        self._flight, self.settings = weakref.ref(flight), settings
        self.contact = contact_of(flight)
        self.is_always_on_ground = is_stated_to_roll(flight.metadata)

    @property
    def flight(self) -> Flight:
        """Flight that the evidence is of; whoever asks for evidence holds it."""
        flight = self._flight()
        assert flight is not None
        return flight

    @cached_property
    def grid_ns(self) -> Int64Array:
        return self.flight.start_ns + np.arange(grid_size(self.flight), dtype=np.int64) * STEP_NS

    @cached_property
    def motion(self) -> Motion:
        return motion_of(self.flight)

    @cached_property
    def detection(self) -> Detection:
        return detect_ground(self.motion, self.settings)

    @cached_property
    def against_flag(self) -> str:
        """Reason why the flag is not used; empty when it is."""
        if self.contact is None:
            return "no weight on wheels"
        proves, denies = held(self.contact, self.grid_ns)
        if np.count_nonzero(proves | denies) < LEAST_COVERAGE * len(self.grid_ns):
            return f"{self.contact.name} logged too rarely, {counted(len(self.contact.time_ns), 'sample')}"
        return disbelief(self.contact, self.motion, self.grid_ns)

    @property
    def method(self) -> str:
        if self.is_always_on_ground:
            return "said to be always on the ground"
        if self.contact is not None and not self.against_flag:
            return self.contact.name
        if not len(self.grid_ns):
            return "none: no samples, or a span of many days"
        if self.detection.reason:
            return f"none: {self.detection.reason} ({self.against_flag})"
        limit = self.detection.speed_limit_mps
        return f"detector: standstills and rolling that adjoins them below {limit:.1f} m/s ({self.against_flag})"

    def proof(self, time_ns: Int64Array) -> GroundProof:
        if self.is_always_on_ground:
            return GroundProof(np.ones(len(time_ns), dtype=bool), self.method)
        if self.contact is not None and not self.against_flag:
            return GroundProof(held(self.contact, time_ns)[0], self.method)
        size = len(self.grid_ns)
        if not size:
            return GroundProof(np.zeros(len(time_ns), dtype=bool), self.method)
        cell, rest = np.divmod(time_ns - self.flight.start_ns, STEP_NS)
        inside = (cell >= 0) & (cell < size)
        lower, upper = np.clip(cell, 0, size - 1), np.clip(cell + (rest > 0), 0, size - 1)
        return GroundProof(inside & self.ground[lower] & self.ground[upper], self.method)

    @cached_property
    def ground(self) -> BoolArray:
        """Proven contact on the grid."""
        if self.is_always_on_ground:
            return np.ones(len(self.grid_ns), dtype=bool)
        if self.contact is None:
            return self.detection.ground
        proves, denies = held(self.contact, self.grid_ns)
        if not self.against_flag:
            return proves
        rare = "too rarely" in self.against_flag  # a rare flag cannot prove, but it can deny
        return np.asarray(self.detection.ground & ~denies) if rare else self.detection.ground

    @property
    def airborne(self) -> BoolArray:
        """Flight on the grid, from lift-off to touch-down."""
        if self.is_always_on_ground:
            return np.zeros(len(self.grid_ns), dtype=bool)
        if self.contact is not None and not self.against_flag:
            return _up_to_the_ground(held(self.contact, self.grid_ns)[1], self.ground)
        return between_lift_off_and_touch_down(self.motion, self.ground, self.detection, self.settings)


_KEPT: dict[tuple[int, GroundSettings], _Evidence] = {}  # by the identity of a flight that is there


def _labels(
    evidence: _Evidence, ground: BoolArray, airborne: BoolArray, speed: FloatArray, rolling: int
) -> NDArray[np.int64]:
    """Phase of every grid time, as its place in PHASES.

    ``rolling`` is that of moving on the ground.
    """
    label = np.where(ground, rolling, UNKNOWN)
    is_slow = ground & (running_mean(speed, 0.5) <= evidence.settings.standstill_speed_mps)
    is_slow &= ~_turns(evidence.motion)
    for start, end in runs(is_slow):
        if end - start >= SHORTEST_STANDSTILL_S * RATE_HZ:
            label[start:end] = STANDSTILL
    label[airborne] = AIRBORNE
    flights = runs(label == AIRBORNE)
    gaps = zip([0, *(end for _, end in flights)], [*(start for start, _ in flights), len(label)], strict=True)
    for start, end in gaps:  # the parts between two flights, before the first and after the last
        if end > start and ground[start:end].any() and rolling != SOMEWHERE_ON_GROUND:
            _mark_runs(label, speed, start, end)
    return label


def _turns(motion: Motion) -> BoolArray:
    """Tell where the attitude turns; a jump of the estimate is no turn."""
    turns = np.zeros(len(motion), dtype=bool)
    half = round(0.5 * RATE_HZ)
    for angle_deg in (motion.heading_deg, motion.roll_deg, motion.pitch_deg):
        if len(motion) > 2 * half:
            rate_dps = np.abs(angle_deg[2 * half :] - angle_deg[: -2 * half]) / (2 * half / RATE_HZ)
            turns[half : len(motion) - half] |= lasting(rate_dps > TURNS_DPS, TURNS_S)
    return turns


def _mark_runs(label: NDArray[np.int64], speed_mps: FloatArray, start: int, end: int) -> None:
    """Mark landing roll and take-off run in rows [start, end) between flights.

    The slowest row parts a touch-and-go.
    """
    slowest = start + int(np.argmin(np.nan_to_num(speed_mps[start:end], nan=0.0)))
    if start > 0 and speed_mps[start] >= SLOWEST_RUN_MPS:
        last, least = start, RUN_SHARE * speed_mps[start]
        while last < (slowest if end < len(label) else end) and speed_mps[last] > least:
            last += 1
        label[start:last] = LANDING_ROLL
    if end < len(label) and speed_mps[end - 1] >= SLOWEST_RUN_MPS:
        first, least = end, RUN_SHARE * speed_mps[end - 1]
        while first > (slowest if start > 0 else 0) and speed_mps[first - 1] > least:
            first -= 1
        label[first:end] = TAKE_OFF_RUN


def _up_to_the_ground(denied: BoolArray, ground: BoolArray) -> BoolArray:
    """Tell where the flag shows flight.

    The instants between its last sample on the ground and its first off it count as flight.
    """
    airborne = denied.copy()
    for start, end in runs(~denied & ~ground):
        is_between = start > 0 and ground[start - 1] and end < len(denied) and denied[end]
        if is_between and end - start <= LONGEST_HOLD_S * RATE_HZ:
            airborne[start:end] = True
    return airborne
