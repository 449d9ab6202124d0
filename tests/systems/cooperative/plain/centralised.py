"""Centralised filter in plain numpy; the method stands in cooperative/centralised.py."""

from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import Pattern
from groundstation.methods.kalman.kernels import add_noise, predict_covariance, update_covariance
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.centralised import KNOWN_WRONG_SIGMAS, is_about_reckoning, reports
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE
from tests.systems.cooperative.plain.observation import LinearisedMeasurement, rows_of
from tests.systems.cooperative.plain.steps import MeasurementEvent, RunRecorder, steps


class _Joint:
    """State x and covariance P of all vehicles and uncertain points."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self.prepared, self.about_reckoning = prepared, is_about_reckoning(prepared, settings)
        starts = [vehicle.start() for vehicle in prepared.vehicles]
        sizes = [len(x) for x, _ in starts]
        edges = np.concatenate([[0], np.cumsum(sizes)])
        self.slices = [slice(int(one), int(two)) for one, two in pairwise(edges)]
        uncertain = [i for i, point in enumerate(prepared.session.points) if point.position_sigma_m > 0.0]
        total = int(edges[-1])
        self.points = {i: slice(total + 2 * k, total + 2 * k + 2) for k, i in enumerate(uncertain)}
        total += 2 * len(uncertain)
        self.x, self.P = np.zeros(total), np.zeros((total, total))
        for place, (x, P) in zip(self.slices, starts, strict=True):
            self.x[place], self.P[place, place] = x, P
        for i, place in self.points.items():
            self.P[place, place] = prepared.session.points[i].position_sigma_m ** 2 * np.eye(2)
        self.times = [vehicle.first_s for vehicle in prepared.vehicles]
        self.offsets_m = np.zeros((len(prepared.vehicles), 3))  # dead reckoning less reference place
        self._states, self._held = np.arange(total), np.zeros(0, dtype=np.int64)
        self._room, self._g, self._gain = np.zeros((total, total)), np.zeros(total), np.zeros(total)
        self._patterns = [_whole_block(place.start, size) for place, size in zip(self.slices, sizes, strict=True)]

    def advance(self, who: int, to_s: float) -> None:
        """Move one vehicle's block on."""
        if to_s <= self.times[who] + 1e-12:
            return
        place = self.slices[who]
        x, phi, noise = self.prepared.vehicles[who].step(self.x[place], self.times[who], to_s)
        self.x[place] = x
        pattern, rows, columns = self._patterns[who]
        predict_covariance(self._states, pattern, phi.reshape(1, -1), 0, self.P, self._room)
        block = noise[rows - place.start, columns - place.start]
        add_noise(self._states, rows, columns, block.reshape(1, -1), 0, self.P)
        self.times[who] = to_s

    def rows(self, event: MeasurementEvent) -> list[tuple[LinearisedMeasurement, FloatArray]]:
        """Return the rows of an event at the vehicles' own times.

        Each comes with its derivative by the whole state.
        """
        vehicles, found = self.prepared.vehicles, []
        here = self._at(event.receiver, event.time_s)
        source_m, clock_m = None, 0.0
        there: tuple[FloatArray, FloatArray] | None = None
        derivative = np.zeros((3, 0))
        if event.kind == PEER:
            peer = vehicles[event.source]
            there = self._at(event.source, event.time_s)
            source_m, derivative = peer.place(there[0], event.time_s)
            clock_m = float(there[0][peer.clock]) if peer.clock >= 0 else 0.0
        elif event.kind == POINT and event.source in self.points:
            source_m = event.place_m - self.prepared.points.axes[event.source] @ self.x[self.points[event.source]]
        about = self._reference_line(event) if self.about_reckoning else None
        for row in rows_of(event, vehicles[event.receiver], here[0], source_m, clock_m, about):
            h = np.zeros(len(self.x))
            h[self.slices[event.receiver]] = row.receiver @ here[1]
            if there is not None:
                h[self.slices[event.source]] = row.by_source(vehicles[event.source], derivative) @ there[1]
            elif event.kind == POINT and event.source in self.points:
                h[self.points[event.source]] = -row.place @ self.prepared.points.axes[event.source]
            found.append((row, h))
        return found

    def _reference_line(self, event: MeasurementEvent) -> FloatArray | None:
        """Return the line between two aircraft about which their range is linearised.

        Its ends move when known to be wrong.
        """
        vehicles = self.prepared.vehicles
        ends = (event.receiver, event.source)
        if event.kind != PEER or any(vehicles[who].clock < 0 for who in ends):
            return None
        x = [self._at(who, event.time_s)[0] for who in ends]
        (here, by_here), (there, by_there) = (
            vehicles[who].place(state, event.time_s) for who, state in zip(ends, x, strict=True)
        )
        read = [here - by_here @ x[0], there - by_there @ x[1]]
        line = event.arm_m + read[0] - self.offsets_m[ends[0]] - read[1] + self.offsets_m[ends[1]]
        away = event.arm_m + here - there - line
        across = away - line * float(line @ away) / float(line @ line)
        derivative = np.zeros((3, len(self.x)))
        derivative[:, self.slices[ends[0]]], derivative[:, self.slices[ends[1]]] = by_here, -by_there
        shared = across @ derivative
        if float(across @ across) ** 2 > KNOWN_WRONG_SIGMAS**2 * float(shared @ self.P @ shared):
            self.offsets_m[ends[0]], self.offsets_m[ends[1]] = read[0] - here, read[1] - there
            return np.asarray(event.arm_m + here - there)
        return np.asarray(line)

    def _at(self, who: int, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Return a vehicle's state at a time not later than its own, and its derivative.

        The derivative is by the state that it has.
        """
        x = self.x[self.slices[who]]
        if abs(at_s - self.times[who]) < 1e-12:
            return x, np.eye(len(x))
        moved, phi, _ = self.prepared.vehicles[who].step(x, self.times[who], at_s)
        return moved, phi

    def update(self, h: FloatArray, innovation: float, variance: float) -> None:
        """Use one scalar measurement with the optimal gain, in the core's symmetric form."""
        columns = np.flatnonzero(h)
        update_covariance(
            self._states, columns, h[columns], 0, len(columns), variance, self._held, self.P, self._g, self._gain
        )
        self.x += self._gain * innovation

    def update_together(self, H: FloatArray, innovation: FloatArray, variance: FloatArray) -> None:
        """Use several measurements in one step."""
        shared = self.P @ H.T
        S = H @ shared + np.diag(variance)
        gain = np.linalg.solve(S, shared.T).T
        self.x += gain @ innovation
        self.P -= gain @ shared.T
        self.P = 0.5 * (self.P + self.P.T)


def _whole_block(first: int, size: int) -> tuple[Pattern, Int64Array, Int64Array]:
    """Return the entries of one vehicle's transition and of its noise (one diagonal side)."""
    rows = np.arange(first, first + size)
    one, two = np.triu_indices(size)
    return Pattern(rows, size * np.arange(size + 1), np.tile(rows, size)), one + first, two + first


def run_centralised(
    prepared: Prepared, settings: CooperativeSettings, *, uses_measurements: bool = True, innovates: bool = True
) -> AlgorithmRun:
    """Run the centralised filter, or without measurements dead reckoning.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    uses_measurements : bool
        False: the start and the noise alone.
    innovates : bool
        False: measurements shrink the covariance and leave the state where it is, as if each were predicted exactly.
    """
    joint, recorder = _Joint(prepared, settings), RunRecorder(prepared.vehicles)
    rejected = [0] * len(prepared.vehicles)
    together = settings.update == "simultaneous"
    for at_s, what in steps(prepared, settings, together=together):
        if isinstance(what, int):
            joint.advance(what, at_s)
            recorder.keep(what, at_s, joint.x[joint.slices[what]], joint.P[joint.slices[what], joint.slices[what]])
        elif uses_measurements:
            for who in sorted({one for event in what for one in _members(event)}):
                joint.advance(who, at_s)
            before = joint.x.copy()
            if together:
                _use_together(joint, what, settings, recorder, rejected)
            else:
                _use_one(joint, what[0], settings, recorder, rejected)
            if not innovates:
                joint.x[:] = before
    if uses_measurements:
        recorder.messages = reports(prepared, settings)
    return recorder.finish("centralised" if uses_measurements else "dead_reckoning", settings.update)


def _members(event: MeasurementEvent) -> tuple[int, ...]:
    return (event.receiver, event.source) if event.kind == PEER else (event.receiver,)


def _is_gated(
    joint: _Joint, event: MeasurementEvent, row: LinearisedMeasurement, h: FloatArray, settings: CooperativeSettings
) -> tuple[bool, float]:
    total = float(h @ joint.P @ h) + row.variance * event.spread
    return settings.gate_sigma > 0.0 and row.innovation**2 > settings.gate_sigma**2 * total, total


def _use_one(
    joint: _Joint, event: MeasurementEvent, settings: CooperativeSettings, recorder: RunRecorder, rejected: list[int]
) -> None:
    rows = joint.rows(event)
    if not rows:
        recorder.counts["lost"] += 1
    for k, (row, h) in enumerate(rows):
        gated, total = _is_gated(joint, event, row, h, settings)
        recorder.judge(event, row.innovation, total, not gated)
        _count_rejections(joint, event, gated, rejected, recorder)
        if gated:
            break  # the bearing of a wrong range is another object's
        joint.update(h, row.innovation, row.variance)
        if k == 0 and len(rows) > 1:  # the second row about the new estimate
            rows[1:] = joint.rows(event)[1:]


def _use_together(
    joint: _Joint,
    events: tuple[MeasurementEvent, ...],
    settings: CooperativeSettings,
    recorder: RunRecorder,
    rejected: list[int],
) -> None:
    kept = []
    for event in events:
        rows = joint.rows(event)
        if not rows:
            recorder.counts["lost"] += 1
        for row, h in rows:
            gated, total = _is_gated(joint, event, row, h, settings)
            recorder.judge(event, row.innovation, total, not gated)
            _count_rejections(joint, event, gated, rejected, recorder)
            if not gated:
                kept.append((row, h))
    if kept:
        joint.update_together(
            np.array([h for _, h in kept]),
            np.array([row.innovation for row, _ in kept]),
            np.array([row.variance for row, _ in kept]),
        )


def _count_rejections(
    joint: _Joint, event: MeasurementEvent, gated: bool, rejected: list[int], recorder: RunRecorder
) -> None:
    """Open the states in doubt of a vehicle none of whose ranges fits any more."""
    for who in _members(event):
        rejected[who] = rejected[who] + 1 if gated else 0
        vehicle = joint.prepared.vehicles[who]
        if rejected[who] >= PATIENCE and event.kind != HEIGHT:
            rejected[who] = 0
            recorder.opened(vehicle)
            for state, variance in vehicle.doubts.items():
                at = joint.slices[who].start + state
                joint.P[at, at] += variance
