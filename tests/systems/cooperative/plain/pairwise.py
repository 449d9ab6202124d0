"""Filter with pairwise cross-covariances in plain numpy.

The method stands in cooperative/pairwise.py.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.error_map import spectral_radius
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.messages import pairwise_bytes
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE
from tests.systems.cooperative.plain.error_map import unit_rows
from tests.systems.cooperative.plain.observation import LinearisedMeasurement, rows_of
from tests.systems.cooperative.plain.steps import MeasurementEvent, RunRecorder, steps


class _Member:
    """One vehicle: time, state, covariance, factors towards the others, error map rows."""

    def __init__(self, time_s: float, x: FloatArray, P: FloatArray, map_rows: FloatArray) -> None:
        self.time_s, self.x, self.P, self.map_rows = time_s, x, P, map_rows
        self.factors: dict[int, FloatArray] = {}


class Pairwise:
    """All vehicles of a session; sequential by its nature."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self._prepared, self._settings = prepared, settings
        self.recorder = RunRecorder(prepared.vehicles)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles], settings.map_window_s)
        self._window_end_s = float("-inf")
        self._members = [
            _Member(vehicle.first_s, *vehicle.start(), rows)
            for vehicle, rows in zip(prepared.vehicles, self._unit_map, strict=True)
        ]
        self._rejected = [0] * len(prepared.vehicles)

    def run(self) -> AlgorithmRun:
        """Work through the session."""
        for at_s, what in steps(self._prepared, self._settings, together=False):
            if at_s >= self._window_end_s:
                self._begin_window(at_s)
            if isinstance(what, int):
                self._advance(what, at_s)
                self.recorder.keep(what, at_s, self._members[what].x, self._members[what].P)
            else:
                self._use(what[0])
        return self.recorder.finish("pairwise", "sequential")

    def _begin_window(self, at_s: float) -> None:
        if np.isfinite(self._window_end_s):
            self.recorder.map_time_s.append(at_s)
            self.recorder.map_radius.append(spectral_radius([one.map_rows for one in self._members]))
        self._window_end_s = at_s + (self._settings.map_window_s or np.inf)
        for one, rows in zip(self._members, self._unit_map, strict=True):
            one.map_rows = rows

    def _advance(self, who: int, to_s: float) -> None:
        one = self._members[who]
        if to_s <= one.time_s + 1e-12:
            return
        one.x, phi, noise = self._prepared.vehicles[who].step(one.x, one.time_s, to_s)
        one.P = phi @ one.P @ phi.T + noise
        one.factors = {other: phi @ factor for other, factor in one.factors.items()}
        one.map_rows, one.time_s = phi @ one.map_rows, to_s

    def _use(self, event: MeasurementEvent) -> None:
        self._advance(event.receiver, event.time_s)
        if event.kind == PEER:
            self._advance(event.source, event.time_s)
            sizes = pairwise_bytes(self._prepared.vehicles[event.receiver].size, self._members[event.source].x.size)
            self.recorder.sent(event.source, sizes[0])
            self.recorder.sent(event.receiver, sizes[1])
        rows = self._rows(event)
        if not rows:
            self.recorder.counts["lost"] += 1
        for number in range(len(rows)):
            if number:
                rows = self._rows(event)  # about the estimate that the row before left
            if not (self._relative if event.kind == PEER else self._private)(event, rows[number]):
                break

    def _rows(self, event: MeasurementEvent) -> list[LinearisedMeasurement]:
        one = self._members[event.receiver]
        source_m, clock_m = None, 0.0
        if event.kind == PEER:
            vehicle, other = self._prepared.vehicles[event.source], self._members[event.source]
            source_m, _ = vehicle.place(other.x, event.time_s)
            clock_m = float(other.x[vehicle.clock]) if vehicle.clock >= 0 else 0.0
        return rows_of(event, self._prepared.vehicles[event.receiver], one.x, source_m, clock_m)

    def _passes(self, event: MeasurementEvent, row: LinearisedMeasurement, total: float) -> bool:
        total -= row.variance * (1.0 - event.spread)
        passes = self._settings.gate_sigma <= 0.0 or row.innovation**2 <= self._settings.gate_sigma**2 * total
        self.recorder.judge(event, row.innovation, total, passes)
        for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
            vehicle = self._prepared.vehicles[who]
            self._rejected[who] = 0 if passes else self._rejected[who] + 1
            if self._rejected[who] >= PATIENCE:
                self._rejected[who] = 0
                self.recorder.opened(vehicle)
                for state, variance in vehicle.doubts.items():
                    self._members[who].P[state, state] += variance
        return passes

    def _private(self, event: MeasurementEvent, row: LinearisedMeasurement) -> bool:
        """Use a range to a point or satellite; no other vehicle is told."""
        one, variance = self._members[event.receiver], row.variance
        if event.kind == POINT:
            sigma = self._prepared.session.points[event.source].position_sigma_m
            variance += sigma**2 * float(np.sum((row.place @ self._prepared.points.axes[event.source]) ** 2))
        shared = one.P @ row.receiver
        total = float(row.receiver @ shared) + variance
        if not self._passes(event, row, total):
            return False
        gain = shared / total
        kept = np.eye(len(one.x)) - np.outer(gain, row.receiver)
        one.x = one.x + gain * row.innovation
        one.P = one.P - np.outer(shared, gain)
        one.factors = {other: kept @ factor for other, factor in one.factors.items()}
        one.map_rows = kept @ one.map_rows
        return True

    def _relative(self, event: MeasurementEvent, row: LinearisedMeasurement) -> bool:
        """Use a range between two vehicles: both are updated as one filter."""
        i, j = event.receiver, event.source
        one, other = self._members[i], self._members[j]
        vehicle = self._prepared.vehicles[j]
        _, derivative = vehicle.place(other.x, event.time_s)
        n = len(one.x)
        h = np.concatenate([row.receiver, row.by_source(vehicle, derivative)])
        cross = one.factors[j] @ other.factors[i].T if j in one.factors else np.zeros((n, len(other.x)))
        P = np.block([[one.P, cross], [cross.T, other.P]])
        shared = P @ h
        total = float(h @ shared) + row.variance
        if total <= 0.0 or not self._passes(event, row, total):
            return False
        gain = shared / total
        after = P - np.outer(shared, gain)
        for who, before, place in ((one, one.P, slice(0, n)), (other, other.P, slice(n, None))):
            scale = after_over_before(after[place, place], before)
            who.factors = {
                third: factor if third in (i, j) else scale @ factor for third, factor in who.factors.items()
            }
        mixed = h[:n] @ one.map_rows + h[n:] @ other.map_rows
        one.x, other.x = one.x + gain[:n] * row.innovation, other.x + gain[n:] * row.innovation
        one.P, other.P = after[:n, :n].copy(), after[n:, n:].copy()
        one.factors[j], other.factors[i] = after[:n, n:].copy(), np.eye(len(other.x))
        one.map_rows = one.map_rows - np.outer(gain[:n], mixed)
        other.map_rows = other.map_rows - np.outer(gain[n:], mixed)
        return True


def after_over_before(after: FloatArray, before: FloatArray) -> FloatArray:
    """Return after @ inverse(before), scaled by the sigmas.

    States differ by eight powers of ten.
    """
    sigma = np.sqrt(np.diag(before))
    normal = before / np.outer(sigma, sigma)
    return np.asarray(np.linalg.solve(normal, (after / sigma).T).T / sigma)


def run_pairwise(prepared: Prepared, settings: CooperativeSettings) -> AlgorithmRun:
    """Run the filter with pairwise cross-covariances."""
    return Pairwise(prepared, settings).run()
