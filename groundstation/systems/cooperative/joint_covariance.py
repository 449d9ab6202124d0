"""Joint covariance of all vehicles and uncertain points along given tracks.

It needs no innovation: derivatives are taken about the tracks at the times of output, and moved on between them. So it
tells what any rule for the gain makes of the errors under the stated sigmas, and what a filter knew of two vehicles
together where it kept only what it knew of each.

Source: Gelb (editor), Applied optimal estimation, 1974, section 7.2.
"""

from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import LinearisedMeasurement, rows_of
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, steps
from groundstation.systems.cooperative.loop_types import PEER, POINT, USED
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun, VehicleTrack

Part = tuple[slice, FloatArray]


@dataclass(frozen=True)
class LinearisedRow:
    """One scalar measurement with its derivatives by the states that it depends on.

    ``by_source`` is by the states of the peer or by the error of the uncertain point; None for any other source.
    """

    row: LinearisedMeasurement
    by_source: FloatArray | None


class JointCovariance:
    """States about which to linearise, and the joint covariance."""

    def __init__(self, prepared: Prepared, about: Sequence[VehicleTrack]) -> None:
        self.prepared, self.about = prepared, about
        vehicles = prepared.vehicles
        edges = [0, *accumulate(vehicle.size for vehicle in vehicles)]
        self.places = [slice(one, two) for one, two in pairwise(edges)]
        starts = [vehicle.start() for vehicle in vehicles]
        self.x, self.times = [x for x, _ in starts], [vehicle.first_s for vehicle in vehicles]
        uncertain = [i for i, point in enumerate(prepared.session.points) if point.position_sigma_m > 0.0]
        self.points = {i: slice(edges[-1] + 2 * k, edges[-1] + 2 * k + 2) for k, i in enumerate(uncertain)}
        self.P = np.zeros((edges[-1] + 2 * len(uncertain),) * 2)
        for place, (_, P) in zip(self.places, starts, strict=True):
            self.P[place, place] = P
        for i, place in self.points.items():
            self.P[place, place] = prepared.session.points[i].position_sigma_m ** 2 * np.eye(2)
        self._outputs = [0 for _ in vehicles]

    def advance(self, who: int, to_s: float) -> tuple[FloatArray, FloatArray] | None:
        """Move one vehicle on; return its transition and noise, None where it is there already."""
        if to_s <= self.times[who] + 1e-12:
            return None
        place = self.places[who]
        self.x[who], phi, noise = self.prepared.vehicles[who].step(self.x[who], self.times[who], to_s)
        self.P[place] = phi @ self.P[place]
        self.P[:, place] = self.P[:, place] @ phi.T
        self.P[place, place] += noise
        self.times[who] = to_s
        return phi, noise

    def output(self, who: int) -> None:
        """Take a vehicle's state from its track, whose next output this is."""
        if self.about and self._outputs[who] < len(self.about[who].state):
            self.x[who] = np.array(self.about[who].state[self._outputs[who]])
        self._outputs[who] += 1

    def rows(self, event: MeasurementEvent) -> list[LinearisedRow]:
        """Return the rows of an event at the vehicles' own times."""
        source_m, clock_m, derivative, sights = None, 0.0, np.zeros((3, 0)), self.prepared.sights
        if event.kind == PEER:
            peer, x, sight = self.prepared.vehicles[event.source], self.x[event.source], sights.source(event.number)
            if sight is None:
                source_m, derivative = peer.place(x, event.time_s)
            else:
                source_m, derivative = sight.reading + sight.derivative @ x, sight.derivative
            clock_m = float(x[peer.clock]) if peer.clock >= 0 else 0.0
        mine, found = self.prepared.vehicles[event.receiver], []
        sight = sights.receiver(event.number)
        for row in rows_of(event, mine, self.x[event.receiver], source_m, clock_m, sight=sight):
            by_source = None
            if event.kind == PEER:
                by_source = row.by_source(self.prepared.vehicles[event.source], derivative)
            elif event.kind == POINT and event.source in self.points:
                by_source = -row.place @ self.prepared.points.axes[event.source]
            found.append(LinearisedRow(row, by_source))
        return found

    def parts(self, event: MeasurementEvent, one: LinearisedRow) -> list[Part]:
        """Return where the derivatives of a row stand in the joint state."""
        found = [(self.places[event.receiver], one.row.receiver)]
        if one.by_source is not None:
            place = self.places[event.source] if event.kind == PEER else self.points[event.source]
            found.append((place, one.by_source))
        return found

    def correct(self, h: Sequence[Part], gain: Sequence[Part], variance: float) -> None:
        """Give the covariance (I - K h) P (I - K h)' + K r K'."""
        shared = sum((self.P[:, place] @ part for place, part in h), start=np.zeros(len(self.P)))
        total = sum(float(part @ shared[place]) for place, part in h) + variance
        for place, part in gain:
            self.P[place] -= np.outer(part, shared)
            self.P[:, place] -= np.outer(shared, part)
        for place, part in gain:
            for other, other_part in gain:
                self.P[place, other] += total * np.outer(part, other_part)

    def update(self, h: Sequence[Part], variance: float) -> None:
        """Correct by the gain that is best for all."""
        shared = sum((self.P[:, place] @ part for place, part in h), start=np.zeros(len(self.P)))
        total = sum(float(part @ shared[place]) for place, part in h) + variance
        self.P -= np.outer(shared, shared / total)


def joint_covariances(
    prepared: Prepared, settings: CooperativeSettings, run: AlgorithmRun
) -> Iterator[tuple[float, JointCovariance]]:
    """Give the joint covariance of a centralised run at each time of output.

    It uses what the run used. It ignores that a run opens doubtful states after many rejections.
    """
    joint, is_used = JointCovariance(prepared, run.tracks), used_events(prepared, run)
    latest_s = None
    for at_s, what in steps(prepared, settings, together=False):
        if isinstance(what, int):
            if latest_s is not None and at_s > latest_s:
                yield latest_s, joint
            latest_s = at_s
            joint.advance(what, at_s)
            joint.output(what)
            continue
        if latest_s is not None:
            yield latest_s, joint
            latest_s = None
        event = what[0]
        if is_used[event.number]:
            for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
                joint.advance(who, event.time_s)
            for one in joint.rows(event):
                joint.update(joint.parts(event, one), one.row.variance)
    if latest_s is not None:
        yield latest_s, joint


def used_events(prepared: Prepared, run: AlgorithmRun) -> BoolArray:
    """Tell which events a run used; all rows of an event have to pass."""
    used = np.zeros(len(prepared.events.time_s), dtype=bool)
    used[run.judged.event] = True
    used[run.judged.event[run.judged.mark != USED]] = False
    return used
