"""Centralised extended Kalman filter of all vehicles.

It has 7 k states in a local frame, 13 k (15 k) in the global one. A vehicle's block is moved on when a measurement or
an output asks for it: noise of different vehicles is independent, so that blocks may stand at different times. Vehicles
that are not there yet keep their start. Ground points whose own position is uncertain are constant states. Dead
reckoning is the same filter without measurements.

A range between two aircraft is linearised, value and direction, about a reference place of each: its dead reckoning
less an offset, at first 0. While the line between the estimates lies within ``KNOWN_WRONG_SIGMAS`` claimed sigmas of
the reference line, across it, the reference stays: directions that follow the estimate tell of a turn of the whole
group, which ranges inside it cannot see (first-estimates Jacobian: Huang, Mourikis and Roumeliotis, 2010). Beyond, the
reference is known to be wrong and both its ends move to the estimate. Ranges to points and satellites do see a turn of
the group: with any of them a range is linearised at the estimate, unless the settings say otherwise, for the curvature
that the reference neglects then costs more than it saves. A direction that stays while the value is taken at the
estimate is no such filter: for aircraft in line its sign across the line may be the wrong one, and every update then
drives the estimate further away.

Source: Kalman, A new approach to linear filtering and prediction problems, 1960; sequential use of simultaneous
measurements: Maybeck, Stochastic Models, Estimation, and Control, volume 1, 1979, section 5.6.
"""

from itertools import pairwise

import numpy as np
from scipy.linalg.blas import dger

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import LinearisedMeasurement, rows_of
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, RunRecorder, steps
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, POINT, SATELLITE
from groundstation.systems.cooperative.messages import report_bytes
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import SAME_TIME_S
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE

KNOWN_WRONG_SIGMAS = 3.0
SAME_INSTANT_S = 1e-12
SLAB = 8192  # entries of a matrix up to which OpenBLAS starts no threads, which wait for each other on a busy machine


class JointRow:
    """One scalar measurement by the joint state: its derivative in pieces, zero elsewhere."""

    __slots__ = ("event", "innovation", "pieces", "variance")

    def __init__(
        self, event: MeasurementEvent, row: LinearisedMeasurement, pieces: list[tuple[slice, FloatArray]]
    ) -> None:
        self.event, self.innovation, self.variance, self.pieces = event, row.innovation, row.variance, pieces

    def shared(self, P: FloatArray) -> FloatArray:
        """Return P h', shape (N,)."""
        (place, h), *others = self.pieces
        g = h @ P[place]
        for place, h in others:
            g += h @ P[place]
        return np.asarray(g)

    def of(self, x: FloatArray) -> float:
        """Return h x."""
        return float(sum(h @ x[place] for place, h in self.pieces))


class Joint:
    """State x and covariance P of all vehicles and uncertain points."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self.prepared, self.about_reckoning = prepared, is_about_reckoning(prepared, settings)
        starts = [vehicle.start() for vehicle in prepared.vehicles]
        edges = np.concatenate([[0], np.cumsum([len(x) for x, _ in starts])]).tolist()
        self.slices = [slice(one, two) for one, two in pairwise(edges)]
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
        self._slabs = [slice(at, at + max(SLAB // total, 1)) for at in range(0, total, max(SLAB // total, 1))]
        self.offsets_m = np.zeros((len(prepared.vehicles), 3))  # dead reckoning less reference place

    def advance(self, who: int, to_s: float) -> None:
        """Move one vehicle's block on."""
        if to_s <= self.times[who] + SAME_INSTANT_S:
            return
        place, P = self.slices[who], self.P
        self.x[place], phi, noise = self.prepared.vehicles[who].step(self.x[place], self.times[who], to_s)
        rows = phi @ P[place]
        rows[:, place] = rows[:, place] @ phi.T + noise
        P[place] = rows
        P[:, place] = rows.T
        self.times[who] = to_s

    def rows(self, event: MeasurementEvent) -> list[JointRow]:
        """Return the rows of an event at the vehicles' own times."""
        vehicles, sights, who = self.prepared.vehicles, self.prepared.sights, event.receiver
        x, back = self._at(who, event.time_s)
        source_m, clock_m, derivative = None, 0.0, None
        there: FloatArray | None = None
        if event.kind == PEER:
            peer = vehicles[event.source]
            x_there, there = self._at(event.source, event.time_s)
            sight = sights.source(event.number)
            if sight is None:
                source_m, derivative = peer.place(x_there, event.time_s)
            else:
                derivative = sight.derivative
                source_m = sight.reading + derivative @ x_there
            clock_m = float(x_there[peer.clock]) if peer.clock >= 0 else 0.0
        elif event.kind == POINT and event.source in self.points:
            source_m = event.place_m - self.prepared.points.axes[event.source] @ self.x[self.points[event.source]]
        about = self._reference_line(event) if self.about_reckoning else None
        found = []
        for row in rows_of(event, vehicles[who], x, source_m, clock_m, about, sights.receiver(event.number)):
            pieces = [(self.slices[who], row.receiver if back is None else row.receiver @ back)]
            if derivative is not None:
                h = row.by_source(vehicles[event.source], derivative)
                pieces.append((self.slices[event.source], h if there is None else h @ there))
            elif event.kind == POINT and event.source in self.points:
                pieces.append((self.points[event.source], -row.place @ self.prepared.points.axes[event.source]))
            found.append(JointRow(event, row, pieces))
        return found

    def _reference_line(self, event: MeasurementEvent) -> FloatArray | None:
        """Return the line between two aircraft about which their range is linearised.

        Its ends move when known to be wrong.
        """
        one, two = self.prepared.sights.receiver(event.number), self.prepared.sights.source(event.number)
        if event.kind != PEER or one is None or two is None:
            return None
        ends, offsets = (event.receiver, event.source), self.offsets_m
        here_off = one.derivative @ self._at(ends[0], event.time_s)[0]
        there_off = two.derivative @ self._at(ends[1], event.time_s)[0]
        line = event.arm_m + one.reading - offsets[ends[0]] - two.reading + offsets[ends[1]]
        away = event.arm_m + one.reading + here_off - two.reading - there_off - line
        across = away - line * float(line @ away) / float(line @ line)
        by_here, by_there = across @ one.derivative, -(across @ two.derivative)
        a, b, P = self.slices[ends[0]], self.slices[ends[1]], self.P
        variance = by_here @ P[a, a] @ by_here + 2.0 * (by_here @ P[a, b] @ by_there) + by_there @ P[b, b] @ by_there
        if float(across @ across) ** 2 > KNOWN_WRONG_SIGMAS**2 * float(variance):
            offsets[ends[0]], offsets[ends[1]] = -here_off, -there_off
            return np.asarray(line + away)
        return np.asarray(line)

    def _at(self, who: int, at_s: float) -> tuple[FloatArray, FloatArray | None]:
        """Return a vehicle's state at a time not later than its own, and its derivative.

        The derivative is by the state that it has; None: the time is its own.
        """
        x = self.x[self.slices[who]]
        if abs(at_s - self.times[who]) < SAME_INSTANT_S:
            return x, None
        moved, phi, _ = self.prepared.vehicles[who].step(x, self.times[who], at_s)
        return moved, phi

    def update(self, row: JointRow, g: FloatArray, total: float) -> None:
        """Use one scalar measurement with the optimal gain.

        g = P h'; ``total`` is the innovation's variance. P stays symmetric to the last bit. Where h is a single state,
        its row becomes g R / S: a product, which stays positive, where a difference of nearly equal numbers stood.
        """
        gain = g / total
        self.x += gain * row.innovation
        scaled = g / np.sqrt(total)
        for rows in self._slabs:  # in place: the transpose is as Fortran has matrices
            dger(-1.0, scaled, scaled[rows], a=self.P[rows].T, overwrite_a=1)
        if len(row.pieces) == 1 and np.count_nonzero(row.pieces[0][1]) == 1:
            place, h = row.pieces[0]
            at = int(np.flatnonzero(h)[0])
            self.P[place.start + at] = self.P[:, place.start + at] = row.variance * gain / h[at]


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
    if not uses_measurements:
        return _dead_reckoning(prepared, settings)
    joint, recorder = Joint(prepared, settings), RunRecorder(prepared.vehicles)
    rejected = [0] * len(prepared.vehicles)
    together = settings.update == "simultaneous"
    for at_s, what in steps(prepared, settings, together=together):
        if isinstance(what, int):
            joint.advance(what, at_s)
            recorder.keep(what, at_s, joint.x[joint.slices[what]], joint.P[joint.slices[what], joint.slices[what]])
            continue
        for event in what:
            for who in _members(event):
                joint.advance(who, at_s)
        before = None if innovates else joint.x.copy()
        if together:
            _use_together(joint, what, settings, recorder, rejected)
        else:
            _use_one(joint, what[0], settings, recorder, rejected)
        if before is not None:
            joint.x[:] = before
    recorder.messages = reports(prepared, settings)
    return recorder.finish("centralised", settings.update)


def _dead_reckoning(prepared: Prepared, settings: CooperativeSettings) -> AlgorithmRun:
    """Move every vehicle alone from output to output."""
    recorder = RunRecorder(prepared.vehicles)
    states = [vehicle.start() for vehicle in prepared.vehicles]
    times = [vehicle.first_s for vehicle in prepared.vehicles]
    for at_s, what in steps(prepared, settings, together=True):
        if isinstance(what, int):
            if at_s > times[what] + SAME_INSTANT_S:
                (x, P), vehicle = states[what], prepared.vehicles[what]
                x, phi, noise = vehicle.step(x, times[what], at_s)
                states[what], times[what] = (x, phi @ P @ phi.T + noise), at_s
            recorder.keep(what, at_s, *states[what])
    return recorder.finish("dead_reckoning", settings.update)


def _members(event: MeasurementEvent) -> tuple[int, ...]:
    return (event.receiver, event.source) if event.kind == PEER else (event.receiver,)


def _judge(
    joint: Joint, row: JointRow, settings: CooperativeSettings, recorder: RunRecorder, rejected: list[int]
) -> tuple[FloatArray, float] | None:
    """Return P h' and the innovation's variance of a row inside the gate; None outside.

    Opens the states in doubt of a vehicle none of whose ranges fits any more.
    """
    g, event = row.shared(joint.P), row.event
    spread = row.of(g)
    total = spread + row.variance * event.spread
    gated = settings.gate_sigma > 0.0 and row.innovation * row.innovation > settings.gate_sigma**2 * total
    recorder.judge(event, row.innovation, total, not gated)
    for who in _members(event):
        rejected[who] = rejected[who] + 1 if gated else 0
        if rejected[who] >= PATIENCE and event.kind != HEIGHT:
            vehicle = joint.prepared.vehicles[who]
            rejected[who] = 0
            recorder.opened(vehicle)
            for state, variance in vehicle.doubts.items():
                at = joint.slices[who].start + state
                joint.P[at, at] += variance
    return None if gated else (g, spread + row.variance)


def _use_one(
    joint: Joint, event: MeasurementEvent, settings: CooperativeSettings, recorder: RunRecorder, rejected: list[int]
) -> None:
    rows = joint.rows(event)
    if not rows:
        recorder.counts["lost"] += 1
    for k, row in enumerate(rows):
        judged = _judge(joint, row, settings, recorder, rejected)
        if judged is None:
            break  # the bearing of a wrong range is another object's
        joint.update(row, *judged)
        if k == 0 and len(rows) > 1:  # the second row about the new estimate
            rows[1:] = joint.rows(event)[1:]


def _use_together(
    joint: Joint,
    events: tuple[MeasurementEvent, ...],
    settings: CooperativeSettings,
    recorder: RunRecorder,
    rejected: list[int],
) -> None:
    """Use all measurements in one update, linearised once.

    Their noise is independent, so they may be used one after the other, each with what those before it have moved taken
    off its innovation.
    """
    kept = []
    for event in events:
        rows = joint.rows(event)
        if not rows:
            recorder.counts["lost"] += 1
        kept += [row for row in rows if _judge(joint, row, settings, recorder, rejected) is not None]
    before = joint.x.copy()
    for row in kept:
        g = row.shared(joint.P)
        row.innovation -= row.of(joint.x - before)
        joint.update(row, g, row.of(g) + row.variance)


def is_about_reckoning(prepared: Prepared, settings: CooperativeSettings) -> bool:
    """Tell whether ranges between aircraft are linearised about their dead reckoning."""
    if settings.derivatives == "auto":
        return not np.isin(prepared.events.kind, (POINT, SATELLITE)).any()
    return settings.derivatives == "reckoning"


def reports(prepared: Prepared, settings: CooperativeSettings) -> dict[str, tuple[int, int]]:
    """Count the vehicles' reports to the centre and their bytes.

    Once a frame each sends its dead reckoning and what it measured.
    """
    events = prepared.events
    frame = np.floor((events.time_s + SAME_TIME_S) / settings.frame_s).astype(np.int64)
    report, ranges = np.unique(frame * len(prepared.vehicles) + events.receiver, return_counts=True)
    found: dict[str, tuple[int, int]] = {}
    for who, vehicle in enumerate(prepared.vehicles):
        mine = ranges[report % len(prepared.vehicles) == who].tolist()
        if mine:
            found[vehicle.name] = (len(mine), sum(report_bytes(count) for count in mine))
    return found
