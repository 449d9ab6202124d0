"""Noise of two primaries by the source's formula, without it, and a consider filter.

The secondary hears primaries that range to the navigation controller alone, whose own position error c is common to
all. The primaries are the same under the three rules: their errors with c are kept as a covariance C = E(x c'), c is
considered and not estimated (Schmidt). The rules differ in what the secondary takes for the noise of its ranges:

- ``multilevel_noise``: h P h' of each primary and the noise of the link, nothing between them;
- ``published_formula``: the same, with h_a C_a Pc^-1 C_b' h_b' between two primaries, as the source has it;
- ``considered_errors``: no noise but that of the link; all errors of the primaries are considered with their
  covariances in time, among themselves and with the secondary. Only the secondary's own states are corrected by its
  ranges, so ranks stand. No message of the source could carry it: it is what an honest filter of ranks can reach.

It is of aircraft with ranges in a local frame, and it takes messages without delay.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapter 4; Schmidt, Application of
state-space methods to navigation problems, 1966.
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.timeline import timeline
from groundstation.systems.cooperative.tracks import AlgorithmRun, JudgedMeasurements, VehicleTrack
from groundstation.systems.cooperative.vehicles import Vehicle

RULES = ("multilevel_noise", "published_formula", "considered_errors")
KeptRow = tuple[float, FloatArray, FloatArray, FloatArray]  # time, position, state, covariance


class _Considered:
    """States and joint covariance of all aircraft and points.

    A range corrects its receiver alone.
    """

    def __init__(self, prepared: Prepared) -> None:
        self.prepared, self.vehicles = prepared, prepared.vehicles
        edges = [0, *accumulate(vehicle.size for vehicle in self.vehicles)]
        self.places = [slice(one, two) for one, two in pairwise(edges)]
        self.first_point = edges[-1]
        variance = np.repeat(prepared.points.sigma_m**2, 2)
        starts = [vehicle.start() for vehicle in self.vehicles]
        self.x, self.times = [x for x, _ in starts], [vehicle.first_s for vehicle in self.vehicles]
        self.P = np.diag(np.concatenate([*(np.diag(P) for _, P in starts), variance]))

    def advance(self, who: int, to_s: float) -> None:
        """Move one aircraft on."""
        if to_s > self.times[who] + 1e-12:
            place = self.places[who]
            self.x[who], phi, noise = self.vehicles[who].step(self.x[who], self.times[who], to_s)
            self.P[place] = phi @ self.P[place]
            self.P[:, place] = self.P[:, place] @ phi.T
            self.P[place, place] += noise
            self.times[who] = to_s

    def use(self, number: int) -> None:
        """Correct the receiver of one range."""
        events = self.prepared.events
        who, source, at_s = int(events.receiver[number]), int(events.source[number]), float(events.time_s[number])
        vehicle, h = self.vehicles[who], np.zeros(len(self.P))
        self.advance(who, at_s)
        source_m, clock_m = events.place_m[number], 0.0
        if events.kind[number] == PEER:
            self.advance(source, at_s)
            peer = self.vehicles[source]
            source_m, derivative = peer.place(self.x[source], at_s)
            clock_m = float(self.x[source][peer.clock])
        distance, h[self.places[who]], direction = _line(vehicle, self.x[who], at_s, source_m)
        if events.kind[number] == PEER:
            h[self.places[source]] = -direction @ derivative
            h[self.places[source].start + peer.clock] -= 1.0
        else:
            at = self.first_point + 2 * source
            h[at : at + 2] = direction @ self.prepared.points.axes[source]
        innovation = float(events.value_m[number] - distance - self.x[who][vehicle.clock] + clock_m)
        shared, place = self.P @ h, self.places[who]
        total = float(h @ shared + events.variance_m2[number])
        gain = shared[place] / total
        self.x[who] = self.x[who] + gain * innovation
        both = self.P[place] - np.outer(gain, shared)
        self.P[place], self.P[:, place] = both, both.T
        own = both[:, place] - np.outer(shared[place], gain) + total * np.outer(gain, gain)
        self.P[place, place] = 0.5 * (own + own.T)


@dataclass
class _Filter:
    """Time, state, covariance and covariance with the controller's error."""

    time_s: float
    x: FloatArray
    P: FloatArray
    C: FloatArray

    def advance(self, vehicle: Vehicle, to_s: float) -> None:
        """Move on."""
        if to_s > self.time_s + 1e-12:
            self.x, phi, noise = vehicle.step(self.x, self.time_s, to_s)
            self.P, self.C, self.time_s = phi @ self.P @ phi.T + noise, phi @ self.C, to_s

    def update(
        self, innovation: FloatArray, H: FloatArray, T: FloatArray, R: FloatArray, variance: FloatArray, is_kept: bool
    ) -> None:
        """Correct by rows whose noise is T c + v, v of covariance R; C is kept where ``is_kept``."""
        Pc = np.diag(variance)
        cross = self.C @ T.T if is_kept else np.zeros((len(self.x), len(T)))
        S = H @ self.P @ H.T + H @ cross + cross.T @ H.T + T @ Pc @ T.T + R
        gain = np.linalg.solve(S, (self.P @ H.T + cross).T).T
        self.x = self.x + gain @ innovation
        P = self.P - gain @ S @ gain.T
        self.P = 0.5 * (P + P.T)
        if is_kept:
            self.C = self.C - gain @ (H @ self.C + T @ Pc)


@dataclass(frozen=True)
class _HeardRange:
    """A range of the secondary: predicted less measured, and what is in its noise.

    ``by_common`` is its derivative by the controller's error, ``own_m2`` the variance of the rest.
    """

    time_s: float
    innovation: float
    h: FloatArray
    by_common: FloatArray
    own_m2: float


def run_rule(prepared: Prepared, settings: CooperativeSettings, rule: str) -> AlgorithmRun:
    """Run the primaries and the secondaries of a session under one rule."""
    if rule == "considered_errors":
        return _run_considered(prepared, settings)
    vehicles, events = prepared.vehicles, prepared.events
    variance = np.repeat(prepared.points.sigma_m**2, 2)
    own = [_Filter(one.first_s, *one.start(), np.zeros((one.size, len(variance)))) for one in vehicles]
    rows: list[list[KeptRow]] = [[] for _ in vehicles]
    items = timeline(prepared, settings, together=True)
    for at_s, who, first, last in zip(*(column.tolist() for column in items), strict=True):
        if who >= 0:
            own[who].advance(vehicles[who], at_s)
            place, _ = vehicles[who].place(own[who].x, at_s)
            rows[who].append((at_s, place, own[who].x.copy(), own[who].P.copy()))
            continue
        frame = np.arange(first, last)
        for number in frame[events.kind[frame] == POINT].tolist():
            _range_to_point(prepared, own, number, variance)
        peers = frame[events.kind[frame] == PEER]
        for receiver in np.unique(events.receiver[peers]).tolist():
            mine = list(peers[events.receiver[peers] == receiver].tolist())
            mine = [n for n in mine if prepared.ranks[events.source[n]] < prepared.ranks[receiver]]
            if mine:
                own[receiver].advance(vehicles[receiver], at_s)
                heard = [_heard(prepared, own, number, at_s) for number in mine]
                _update_secondary(own[receiver], heard, variance, rule)
    return _finished(prepared, rule, "simultaneous", rows)


def _run_considered(prepared: Prepared, settings: CooperativeSettings) -> AlgorithmRun:
    joint, events, ranks = _Considered(prepared), prepared.events, prepared.ranks
    rows: list[list[KeptRow]] = [[] for _ in prepared.vehicles]
    items = timeline(prepared, settings, together=False)
    for at_s, who, number in zip(items.time_s.tolist(), items.vehicle.tolist(), items.first.tolist(), strict=True):
        if who >= 0:
            joint.advance(who, at_s)
            place, x = prepared.vehicles[who].place(joint.x[who], at_s)[0], joint.x[who]
            rows[who].append((at_s, place, x.copy(), joint.P[joint.places[who], joint.places[who]].copy()))
        elif events.kind[number] == POINT or ranks[events.source[number]] < ranks[events.receiver[number]]:
            joint.use(number)
    return _finished(prepared, "considered_errors", "sequential", rows)


def _finished(prepared: Prepared, rule: str, update: str, rows: Sequence[Sequence[KeptRow]]) -> AlgorithmRun:
    vehicles = prepared.vehicles
    return AlgorithmRun(
        rule,
        update,
        tuple(_track(vehicle, kept) for vehicle, kept in zip(vehicles, rows, strict=True)),
        JudgedMeasurements(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64)),
        {},
        {},
        np.zeros(0),
        np.zeros(0),
    )


def _track(vehicle: Vehicle, kept: Sequence[KeptRow]) -> VehicleTrack:
    times, places, states, covariances = (np.array(part) for part in zip(*kept, strict=True))
    return VehicleTrack(vehicle.name, times, places, states, covariances, vehicle.height)


def _line(vehicle: Vehicle, x: FloatArray, at_s: float, source_m: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return distance, its derivative by the receiver's state (with its clock) and direction."""
    place, derivative = vehicle.place(x, at_s)
    away = place - source_m
    distance = float(np.linalg.norm(away))
    direction = away / distance
    h = direction @ derivative
    h[vehicle.clock] += 1.0
    return distance, h, direction


def _range_to_point(prepared: Prepared, own: list[_Filter], number: int, variance: FloatArray) -> None:
    events = prepared.events
    who, at_s, point = int(events.receiver[number]), float(events.time_s[number]), int(events.source[number])
    vehicle, mine = prepared.vehicles[who], own[who]
    mine.advance(vehicle, at_s)
    distance, h, direction = _line(vehicle, mine.x, at_s, events.place_m[number])
    T = np.zeros((1, len(variance)))
    T[0, 2 * point : 2 * point + 2] = direction @ prepared.points.axes[point]
    innovation = np.array([events.value_m[number] - distance - mine.x[vehicle.clock]])
    mine.update(innovation, h[None], T, np.array([[events.variance_m2[number]]]), variance, True)


def _heard(prepared: Prepared, own: list[_Filter], number: int, at_s: float) -> _HeardRange:
    """Return one range of a secondary, referred to its state at ``at_s``."""
    events = prepared.events
    who, source, sent_s = int(events.receiver[number]), int(events.source[number]), float(events.time_s[number])
    vehicle, peer, mine, other = prepared.vehicles[who], prepared.vehicles[source], own[who], own[source]
    other.advance(peer, sent_s)
    source_m, derivative = peer.place(other.x, sent_s)
    x, back = mine.x, np.eye(vehicle.size)
    if abs(sent_s - at_s) > 1e-12:
        x, back, _ = vehicle.step(mine.x, at_s, sent_s)
    distance, h, direction = _line(vehicle, x, sent_s, source_m)
    by_peer = -direction @ derivative
    by_peer[peer.clock] -= 1.0
    innovation = float(events.value_m[number] - distance - x[vehicle.clock] + other.x[peer.clock])
    common = by_peer @ other.C
    return _HeardRange(
        sent_s, innovation, h @ back, common, float(by_peer @ other.P @ by_peer + events.variance_m2[number])
    )


def _update_secondary(mine: _Filter, heard: Sequence[_HeardRange], variance: FloatArray, rule: str) -> None:
    inverse = np.divide(1.0, variance, out=np.zeros_like(variance), where=variance > 0.0)
    T = np.array([one.by_common * inverse for one in heard])  # C Pc^-1: what of the common error is in the range
    R = np.diag([one.own_m2 for one in heard])
    between = T @ np.diag(variance) @ T.T
    if rule == "multilevel_noise":
        T = np.zeros_like(T)
    else:
        R = R - np.diag(np.diag(between))  # the diagonal has all of h P h' once, with the common part in T c
    innovation, H = np.array([one.innovation for one in heard]), np.array([one.h for one in heard])
    mine.update(innovation, H, T, R, variance, is_kept=False)
