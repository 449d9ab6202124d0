"""Filters in which every vehicle estimates its own states alone and hears what its neighbours broadcast.

Four algorithms differ in what they make of a neighbour's estimate:

- ``neighbour_exact``: it is the truth.
- ``ranked``: only neighbours of a higher rank are used, and h P h' of their covariance is added to the noise.
- ``modified``: ranked, all ranges of a frame together; the noise of two neighbours is correlated by what they share:
  each keeps and broadcasts its covariance C with the errors of uncertain ground points (a consider filter), and the
  noise of neighbours a and b has the covariance h_a C_a Pc^-1 C_b' h_b'.
- ``split_intersection``: a covariance has an independent part and one that may be correlated with anything; the latter
  is fused by covariance intersection. All that was ever broadcast counts as correlated, and so does all that is heard:
  others have heard it too. What gathers between two transmissions is independent. Consistent whatever the correlation.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapters 3 and 4 (the first three);
Schmidt, Application of state-space methods to navigation problems, 1966 (consider states); Julier and Uhlmann, General
decentralized data fusion with covariance intersection, 2001 (split form); Li and Nashashibi, Cooperative multi-vehicle
localization using split covariance intersection filter, 2013, equations 10 to 14.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.estimators.cooperative.centralised import LEAP_M, PATIENCE
from groundstation.estimators.cooperative.error_map import Other, corrected_rows, spectral_radius, unit_rows
from groundstation.estimators.cooperative.events import HEIGHT, PEER, POINT, Event, Prepared
from groundstation.estimators.cooperative.messages import Broadcast, decode
from groundstation.estimators.cooperative.observation import Row, rows_of
from groundstation.estimators.cooperative.settings import CooperativeSettings
from groundstation.estimators.cooperative.timeline import timeline
from groundstation.estimators.cooperative.tracks import GATED, USED, AlgorithmRun, Recorder
from groundstation.tables.session import NO_SLOT

WEIGHTS = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.995, 0.999])
RANKED = ("ranked", "modified")


@dataclass(frozen=True, slots=True)
class Own:
    """One vehicle's filter: state, covariance, independent part (split), covariance with the points, error map rows."""

    time_s: float
    x: FloatArray
    P: FloatArray
    independent: FloatArray
    shared: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class Heard:
    """A broadcast and, for the error map alone, the derivative and rows of its sender."""

    message: Broadcast
    derivative: FloatArray
    map_rows: FloatArray


@dataclass(frozen=True, slots=True)
class Used:
    """One row ready for an update: derivative by the state now, by the shared errors, and what its source brings."""

    event: Event
    row: Row
    h: FloatArray
    by_shared: FloatArray
    heard: Heard | None


class Decentralised:
    """All vehicles of a session under one of the algorithms."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> None:
        self._prepared, self._settings, self._algorithm = prepared, settings, algorithm
        points = prepared.session.points
        self._uncertain = [i for i, point in enumerate(points) if point.position_sigma_m > 0.0]
        sigmas = [points[i].position_sigma_m for i in self._uncertain for _ in range(2)]
        self._Pc = np.diag(np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self._inverse_Pc = np.diag(1.0 / np.square(sigmas)) if sigmas else np.zeros((0, 0))
        self.recorder = Recorder(prepared.vehicles)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles])
        self._window_end_s = float("-inf")
        self._own: list[Own] = []
        for rows, vehicle in zip(self._unit_map, prepared.vehicles, strict=True):
            x, P = vehicle.start()
            self._own.append(Own(vehicle.first_s, x, P, P.copy(), np.zeros((vehicle.size, len(sigmas))), rows))
        self._history: deque[tuple[int, list[Own]]] = deque(maxlen=settings.latency_slots + 1)
        self._heard: dict[tuple[int, int], Heard] = {}
        self._rejected = [0] * len(prepared.vehicles)

    def run(self) -> AlgorithmRun:
        """Work through the session."""
        together = self._settings.update == "simultaneous" or self._algorithm == "modified"
        for at_s, what in timeline(self._prepared, self._settings, together=together):
            if at_s >= self._window_end_s:
                self._begin_window(at_s)
            if isinstance(what, int):
                self._own[what] = self._moved(what, self._own[what], at_s)
                self.recorder.keep(what, at_s, self._own[what].x, self._own[what].P)
            else:
                self._use(what, at_s)
        return self.recorder.finish(self._algorithm, "simultaneous" if together else "sequential")

    def _begin_window(self, at_s: float) -> None:
        """Judge the error map and begin it anew; errors of messages under way count as those of their senders now."""
        if np.isfinite(self._window_end_s):
            self.recorder.map_time_s.append(at_s)
            self.recorder.map_radius.append(spectral_radius([own.map_rows for own in self._own]))
        self._window_end_s = at_s + self._settings.map_window_s
        self._own = [replace(own, map_rows=rows) for own, rows in zip(self._own, self._unit_map, strict=True)]
        self._history.clear()
        self._heard.clear()

    def _moved(self, who: int, own: Own, to_s: float) -> Own:
        """A vehicle's filter at another time."""
        if abs(to_s - own.time_s) < 1e-12:
            return own
        x, phi, noise = self._prepared.vehicles[who].step(own.x, own.time_s, to_s)
        if to_s < own.time_s:
            noise = np.zeros_like(noise)
        return Own(
            to_s,
            x,
            phi @ own.P @ phi.T + noise,
            phi @ own.independent @ phi.T + noise,
            phi @ own.shared,
            phi @ own.map_rows,
        )

    def _use(self, events: tuple[Event, ...], at_s: float) -> None:
        """One measurement, or all of a frame, receiver by receiver."""
        heard = [self._listen(event) if event.kind == PEER else None for event in events]
        for who in dict.fromkeys(event.receiver for event in events):
            mine = [(event, h) for event, h in zip(events, heard, strict=True) if event.receiver == who]
            mine = [(event, h) for event, h in mine if self._is_used(event, h)]
            if not mine:
                continue
            self._own[who] = self._moved(who, self._own[who], at_s)
            rows = [used for event, h in mine for used in self._rows(who, event, h)]
            rows = [used for used in rows if self._passes(who, used)]
            if rows and self._algorithm == "split_intersection":
                about = self._own[who].x
                for used in rows:
                    self._own[who] = self._split_update(self._own[who], used, about)
            elif rows:
                self._own[who] = self._update(self._own[who], rows)

    def _is_used(self, event: Event, heard: Heard | None) -> bool:
        if event.kind != PEER:
            return True
        if self._algorithm in RANKED and self._prepared.ranks[event.source] >= self._prepared.ranks[event.receiver]:
            self.recorder.counts["unused"] += 1
            return False
        if heard is None:
            self.recorder.counts["lost"] += 1
        return heard is not None

    def _listen(self, event: Event) -> Heard | None:
        """What the source of a range told in its slot: its knowledge of some slots ago, at the time of transmission."""
        key = (event.source, event.slot)
        if event.slot != NO_SLOT and key in self._heard:
            return self._heard[key]
        own = self._own[event.source]
        if event.slot != NO_SLOT:
            if not self._history or self._history[-1][0] != event.slot:
                self._history.append((event.slot, list(self._own)))
                self._heard.clear()
            own = self._history[0][1][event.source]
        own = self._moved(event.source, own, event.time_s)
        vehicle = self._prepared.vehicles[event.source]
        place, derivative = vehicle.place(own.x, event.time_s)
        clock = np.zeros(vehicle.size)
        if vehicle.clock >= 0:
            clock[vehicle.clock] = 1.0
        told = np.concatenate([derivative, clock[None]])
        algorithm = self._algorithm
        message = Broadcast(
            event.source,
            self._prepared.ranks[event.source],
            max(event.slot, 0),
            place,
            float(clock @ own.x),
            None if algorithm == "neighbour_exact" else told @ own.P @ told.T,
            told @ own.shared if algorithm == "modified" else None,
        )
        sent = message.encode()
        self.recorder.sent(event.source, len(sent))
        mine = self._own[event.source]
        self._own[event.source] = replace(mine, independent=np.zeros_like(mine.independent))  # all may be known now
        heard = Heard(decode(sent, algorithm), told, own.map_rows)
        if event.slot != NO_SLOT:
            self._heard[key] = heard
        return heard

    def _rows(self, who: int, event: Event, heard: Heard | None) -> list[Used]:
        """Linearised measurements of an event, referred to the receiver's state now."""
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        x, back = own.x, np.eye(vehicle.size)
        if abs(event.time_s - own.time_s) > 1e-12:
            x, back, _ = vehicle.step(own.x, own.time_s, event.time_s)
        source_m = None if heard is None else heard.message.place_m
        clock_m = 0.0 if heard is None else heard.message.clock_m
        found = []
        for row in rows_of(event, vehicle, x, source_m, clock_m):
            by_shared = np.zeros(len(self._Pc))
            if event.kind == POINT and event.source in self._uncertain:
                at = 2 * self._uncertain.index(event.source)
                by_shared[at : at + 2] = -row.place @ self._prepared.point_axes[event.source]
            found.append(Used(event, row, row.receiver @ back, by_shared, heard))
        if not found:
            self.recorder.counts["lost"] += 1
        return found

    def _noise(self, used: Used) -> tuple[float, float]:
        """Variance that is the measurement's own, and that its source brings with it."""
        brought = 0.0
        if used.heard is not None and used.heard.message.covariance is not None:
            told = np.append(used.row.place, used.row.clock)
            brought = float(told @ used.heard.message.covariance @ told)
        elif self._algorithm != "neighbour_exact":
            brought = float(used.by_shared @ self._Pc @ used.by_shared)
        return used.row.variance, max(brought, 0.0)

    def _passes(self, who: int, used: Used) -> bool:
        """Whether the innovation is inside the gate; counts, and opens the clock after many rejections."""
        own, vehicle = self._own[who], self._prepared.vehicles[who]
        total = float(used.h @ own.P @ used.h) + sum(self._noise(used))
        passes = self._settings.gate_sigma <= 0.0 or used.row.innovation**2 <= self._settings.gate_sigma**2 * total
        self.recorder.judge(used.event, used.row.innovation, total, USED if passes else GATED)
        self._rejected[who] = 0 if passes else self._rejected[who] + 1
        if self._rejected[who] >= PATIENCE and vehicle.clock >= 0 and used.event.kind != HEIGHT:
            self._rejected[who] = 0
            self.recorder.counts["clock_leaps"] += 1
            P = own.P.copy()
            for clock in {vehicle.clock, vehicle.receiver_clock}:
                P[clock, clock] += LEAP_M**2
            self._own[who] = replace(own, P=P)
        return passes

    def _update(self, own: Own, rows: list[Used]) -> Own:
        """Kalman update with the noise of the algorithm; shared errors are considered, not estimated."""
        H = np.array([used.h for used in rows])
        Hc = np.array([used.by_shared for used in rows])
        R = np.diag([sum(self._noise(used)) for used in rows])
        shared, told = own.shared, np.zeros_like(Hc)
        if self._algorithm == "modified":
            for number, used in enumerate(rows):
                if used.heard is not None and used.heard.message.shared is not None:
                    told[number] = np.append(used.row.place, used.row.clock) @ used.heard.message.shared
            R = R + self._through_what_they_share(rows, told)
        cross = shared @ Hc.T if self._algorithm == "modified" else np.zeros((len(own.x), len(rows)))
        S = H @ own.P @ H.T + H @ cross + cross.T @ H.T + R
        gain = np.linalg.solve(S, (own.P @ H.T + cross).T).T
        x = own.x + gain @ np.array([used.row.innovation for used in rows])
        P = own.P - gain @ S @ gain.T
        if self._algorithm == "modified":
            shared = shared - gain @ (H @ shared + Hc @ self._Pc + told)
        return Own(own.time_s, x, 0.5 * (P + P.T), own.independent, shared, self._mixed(own, gain, H, rows))

    def _through_what_they_share(self, rows: list[Used], told: FloatArray) -> FloatArray:
        """Covariance of the noise of different neighbours (and points) through the uncertain ground points."""
        through = told + np.array([used.by_shared for used in rows]) @ self._Pc
        between = through @ self._inverse_Pc @ through.T if len(self._Pc) else np.zeros((len(rows), len(rows)))
        sources = [(used.event.kind, used.event.source) for used in rows]
        for i, one in enumerate(sources):
            for j, two in enumerate(sources):
                if one == two and i != j and one[0] == PEER:  # two rows of one neighbour share all its error
                    a, b = (np.append(rows[k].row.place, rows[k].row.clock) for k in (i, j))
                    heard = rows[i].heard
                    if heard is not None and heard.message.covariance is not None:
                        between[i, j] = float(a @ heard.message.covariance @ b)
        np.fill_diagonal(between, 0.0)
        return between

    def _split_update(self, own: Own, used: Used, about: FloatArray) -> Own:
        """Split covariance intersection with one scalar measurement; the weight that leaves the least position error.

        ``about`` is the state that the measurement was linearised about.
        """
        independent_noise, dependent_noise = self._noise(used)
        h, dependent = used.h, own.P - own.independent
        weight = 1.0
        if dependent_noise > 0.0:
            weight = self._best_weight(h, dependent, own.independent, dependent_noise, independent_noise)
        if weight == 0.0:
            return own  # every weight leaves a larger position error than none
        P1 = dependent / weight + own.independent
        noise = independent_noise + (dependent_noise / (1.0 - weight) if dependent_noise > 0.0 else 0.0)
        S = float(h @ P1 @ h) + noise
        gain = P1 @ h / S
        P = P1 - np.outer(gain, gain) * S
        kept = np.eye(len(own.x)) - np.outer(gain, h)
        independent = kept @ own.independent @ kept.T + np.outer(gain, gain) * independent_noise
        innovation = used.row.innovation - float(h @ (own.x - about))
        rows = self._mixed(own, gain[:, None], h[None], [used])
        return Own(own.time_s, own.x + gain * innovation, P, independent, own.shared, rows)

    @staticmethod
    def _best_weight(
        h: FloatArray, dependent: FloatArray, independent: FloatArray, dependent_noise: float, independent_noise: float
    ) -> float:
        by_dependent, by_independent = dependent @ h, independent @ h
        horizontal = by_dependent[:2, None] / WEIGHTS + by_independent[:2, None]
        S = (h @ by_dependent) / WEIGHTS + h @ by_independent + dependent_noise / (1.0 - WEIGHTS) + independent_noise
        trace = (dependent[0, 0] + dependent[1, 1]) / WEIGHTS + independent[0, 0] + independent[1, 1]
        left = trace - (horizontal**2).sum(axis=0) / S
        best = int(np.argmin(left))
        now = dependent[0, 0] + dependent[1, 1] + independent[0, 0] + independent[1, 1]
        return float(WEIGHTS[best]) if left[best] < now else 0.0

    @staticmethod
    def _mixed(own: Own, gain: FloatArray, H: FloatArray, rows: list[Used]) -> FloatArray:
        """Rows of the error map after an update."""
        others: list[Other | None] = []
        for used in rows:
            if used.heard is None:
                others.append(None)
            else:
                told = np.append(used.row.place, used.row.clock) @ used.heard.derivative
                others.append((told, used.heard.map_rows))
        return corrected_rows(own.map_rows, gain, H, others)


def run_decentralised(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    """Run one of the four decentralised algorithms."""
    return Decentralised(prepared, settings, algorithm).run()
