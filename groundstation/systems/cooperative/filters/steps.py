"""Measurements one by one in the order of the filter, and what it writes down of them."""

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.aircraft_motion import places
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import GATED, USED, Events
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, JudgedMeasurements, VehicleTrack
from groundstation.systems.cooperative.vehicles import Vehicle

AT_ONCE = 4096  # measurements that are objects at one time
Group = tuple[float, tuple["MeasurementEvent", ...]]
Output = tuple[float, int]


class MeasurementEvent(NamedTuple):
    """One measurement: a row of ``loop_types.Events``, and its number there."""

    time_s: float
    kind: int
    receiver: int
    source: int
    value_m: float
    variance_m2: float
    slot: int
    place_m: FloatArray
    bearing_rad: float
    bearing_variance_rad2: float
    is_two_way: bool
    arm_m: FloatArray
    spread: float
    number: int


def _measurements(events: Events) -> Iterator[MeasurementEvent]:
    for first in range(0, len(events.time_s), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        columns = [column[part].tolist() if column.ndim == 1 else list(column[part]) for column in events]
        yield from map(MeasurementEvent._make, zip(*columns, range(first, first + len(columns[0])), strict=True))


def steps(prepared: Prepared, settings: CooperativeSettings, *, together: bool) -> Iterator[Group | Output]:
    """Groups of measurements and outputs (a vehicle) in order of time."""
    items = timeline(prepared, settings, together=together)
    events = _measurements(prepared.events)
    for at_s, who, first, last in zip(*(column.tolist() for column in items), strict=True):
        yield (at_s, who) if who >= 0 else (at_s, tuple(next(events) for _ in range(first, last)))


class RunRecorder:
    """Collects what becomes an :class:`AlgorithmRun`."""

    def __init__(self, vehicles: tuple[Vehicle, ...]) -> None:
        self.vehicles = vehicles
        self.counts: Counter[str] = Counter()
        self.messages: dict[str, tuple[int, int]] = {}
        self.map_time_s: list[float] = []
        self.map_radius: list[float] = []
        self._judged: list[tuple[int, float, float, int]] = []
        self._rows: list[list[tuple[float, FloatArray, FloatArray]]] = [[] for _ in vehicles]

    def keep(self, who: int, time_s: float, x: FloatArray, P: FloatArray) -> None:
        """Keep a vehicle's state at a time of output."""
        self._rows[who].append((time_s, x.copy(), P.copy()))

    def judge(self, event: MeasurementEvent, innovation: float, variance: float, passes: bool) -> None:
        """Count a measurement and keep how it was judged."""
        self._judged.append((event.number, innovation, variance, USED if passes else GATED))

    def opened(self, vehicle: Vehicle) -> None:
        """Count that a vehicle's doubtful states were opened because nothing fitted any more."""
        self.counts["clock_leaps" if vehicle.clock >= 0 else "reopened"] += 1

    def sent(self, who: int, size: int) -> None:
        """Count a message of a vehicle."""
        name = self.vehicles[who].name
        messages, total = self.messages.get(name, (0, 0))
        self.messages[name] = (messages + 1, total + size)

    def finish(self, algorithm: str, update: str) -> AlgorithmRun:
        """Return everything as one frozen answer."""
        tracks = []
        for vehicle, rows in zip(self.vehicles, self._rows, strict=True):
            n, m = len(rows), vehicle.size
            time_s, state = np.array([row[0] for row in rows]), np.array([row[1] for row in rows]).reshape(n, m)
            covariance = np.array([row[2] for row in rows]).reshape(n, m, m)
            position_m = _positions(vehicle, time_s, state)
            tracks.append(VehicleTrack(vehicle.name, time_s, position_m, state, covariance, vehicle.height))
        judged = np.array(self._judged).reshape(-1, 4).T
        mark = judged[3].astype(np.int64)
        for name, value in (("used", USED), ("gated", GATED)):
            if count := int((mark == value).sum()):
                self.counts[name] = count
        return AlgorithmRun(
            algorithm,
            update,
            tuple(tracks),
            JudgedMeasurements(judged[0].astype(np.int64), judged[1], np.sqrt(judged[2]), mark),
            dict(self.counts),
            dict(self.messages),
            np.array(self.map_time_s),
            np.array(self.map_radius),
        )


def _positions(vehicle: Vehicle, time_s: FloatArray, state: FloatArray) -> FloatArray:
    if not isinstance(vehicle, Aircraft):
        return np.array([vehicle.place(x, at_s)[0] for x, at_s in zip(state, time_s.tolist(), strict=True)]).reshape(
            -1, 3
        )
    at = places(vehicle, time_s)
    return np.asarray(at.reading + np.einsum("mas,ms->ma", at.derivative, state[:, at.states]))
