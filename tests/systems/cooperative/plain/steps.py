"""Measurements one by one in the order of the filter, and what it writes down of them."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import GATED, USED
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, JudgedMeasurements, VehicleTrack
from groundstation.systems.cooperative.vehicles import Vehicle

Group = tuple[float, tuple["MeasurementEvent", ...]]
Output = tuple[float, int]


@dataclass(frozen=True, slots=True)
class MeasurementEvent:
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


def steps(prepared: Prepared, settings: CooperativeSettings, *, together: bool) -> Iterator[Group | Output]:
    """Groups of measurements and outputs (a vehicle) in order of time."""
    items = timeline(prepared, settings, together=together)
    columns: list[list[Any]] = [column.tolist() if column.ndim == 1 else list(column) for column in prepared.events]
    columns.append(list(range(len(prepared.events.time_s))))
    events = [MeasurementEvent(*row) for row in zip(*columns, strict=True)]
    for at_s, who, first, last in zip(*(column.tolist() for column in items), strict=True):
        yield (at_s, who) if who >= 0 else (at_s, tuple(events[first:last]))


class RunRecorder:
    """Collects what becomes an :class:`AlgorithmRun`."""

    def __init__(self, vehicles: tuple[Vehicle, ...]) -> None:
        self.vehicles = vehicles
        self.counts: Counter[str] = Counter()
        self.messages: dict[str, tuple[int, int]] = {}
        self.map_time_s: list[float] = []
        self.map_radius: list[float] = []
        self._judged: list[tuple[int, float, float, int]] = []
        self._rows: list[list[tuple[float, FloatArray, FloatArray, FloatArray]]] = [[] for _ in vehicles]

    def keep(self, who: int, time_s: float, x: FloatArray, P: FloatArray) -> None:
        """Keep a vehicle's state at a time of output."""
        position, _ = self.vehicles[who].place(x, time_s)
        self._rows[who].append((time_s, position, x.copy(), P.copy()))

    def judge(self, event: MeasurementEvent, innovation: float, variance: float, passes: bool) -> None:
        """Count a measurement and keep how it was judged."""
        self.counts["used" if passes else "gated"] += 1
        self._judged.append((event.number, innovation, float(np.sqrt(variance)), USED if passes else GATED))

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
            tracks.append(
                VehicleTrack(
                    vehicle.name,
                    np.array([row[0] for row in rows]),
                    np.array([row[1] for row in rows]).reshape(n, 3),
                    np.array([row[2] for row in rows]).reshape(n, m),
                    np.array([row[3] for row in rows]).reshape(n, m, m),
                    vehicle.height,
                )
            )
        judged = np.array(self._judged).reshape(-1, 4).T
        return AlgorithmRun(
            algorithm,
            update,
            tuple(tracks),
            JudgedMeasurements(judged[0].astype(np.int64), judged[1], judged[2], judged[3].astype(np.int64)),
            dict(self.counts),
            dict(self.messages),
            np.array(self.map_time_s),
            np.array(self.map_radius),
        )
