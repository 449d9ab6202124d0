"""Decentralised filter with stored pairwise cross-covariances.

It is close to the centralised one, at the price of an answer to each message.

Each vehicle i keeps its own state and, for every other j, a factor s_ij so that the cross-covariance is s_ij s_ji'. It
moves the factor on and corrects it by itself; only the two vehicles of a range exchange anything, and they update as
one filter of both. What one of them alone sees corrects nobody else (suboptimal, yet the factors stay right). Factors
towards third vehicles are scaled by P_i(after) P_i(before)^-1: that is the method's one approximation. The receiver
answers in the same slot: latency has no meaning here.

Source: Luft, Schubert, Roumeliotis and Burgard, Recursive decentralized localization for multi-robot systems with
asynchronous pairwise communication, International Journal of Robotics Research 37(10), 2018, algorithm 1 and section 4.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.error_map import spectral_radius, unit_rows
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.observation import LinearisedMeasurement, rows_of
from groundstation.systems.cooperative.filters.steps import MeasurementEvent, RunRecorder, steps
from groundstation.systems.cooperative.loop_types import PEER, POINT
from groundstation.systems.cooperative.messages import pairwise_bytes
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun
from groundstation.systems.cooperative.vehicles import PATIENCE


class Factors:
    """Factors of one vehicle towards others, side by side.

    A vehicle's motion and its own updates multiply every factor by the same matrix: it is kept, and multiplied in when
    a factor is asked for or given.
    """

    def __init__(self, size: int) -> None:
        self._places: dict[int, slice] = {}
        self._size, self._end = size, 0
        self._wide = np.zeros((size, 0))
        self._due: FloatArray | None = None

    def multiply(self, by: FloatArray) -> None:
        """Multiply every factor by a matrix from the left."""
        if self._places:
            self._due = by if self._due is None else by @ self._due

    def get(self, other: int) -> FloatArray | None:
        """Return the factor towards another vehicle; None where there is none."""
        self._settle()
        return self._wide[:, self._places[other]] if other in self._places else None

    def put(self, other: int, factor: FloatArray) -> None:
        """Replace the factor towards another vehicle."""
        self._settle()
        if other not in self._places:
            self._places[other] = slice(self._end, self._end + factor.shape[1])
            self._end += factor.shape[1]
            self._wide = np.concatenate([self._wide, factor], axis=1)
        else:
            self._wide[:, self._places[other]] = factor

    def has_third(self, other: int) -> bool:
        """Tell whether there is a factor towards another vehicle than this one."""
        return len(self._places) > (other in self._places)

    def _settle(self) -> None:
        if self._due is not None:
            self._wide, self._due = self._due @ self._wide, None


class _Member:
    """One vehicle: time, state, covariance, factors towards the others, error map rows."""

    def __init__(self, time_s: float, x: FloatArray, P: FloatArray, map_rows: FloatArray) -> None:
        self.time_s, self.x, self.P, self.map_rows = time_s, x, P, map_rows
        self.factors, self.rejected = Factors(len(x)), 0


class Pairwise:
    """All vehicles of a session; sequential by its nature."""

    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self._prepared, self._settings, self._vehicles = prepared, settings, prepared.vehicles
        self.recorder = RunRecorder(prepared.vehicles)
        self._unit_map = unit_rows([vehicle.size for vehicle in prepared.vehicles], settings.map_window_s)
        self._window_end_s = float("-inf")
        self._members = [
            _Member(vehicle.first_s, *vehicle.start(), rows)
            for vehicle, rows in zip(prepared.vehicles, self._unit_map, strict=True)
        ]

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
        one.x, phi, noise = self._vehicles[who].step(one.x, one.time_s, to_s)
        one.P = phi @ one.P @ phi.T + noise
        one.factors.multiply(phi)
        one.map_rows, one.time_s = phi @ one.map_rows, to_s

    def _use(self, event: MeasurementEvent) -> None:
        self._advance(event.receiver, event.time_s)
        if event.kind == PEER:
            self._advance(event.source, event.time_s)
            sizes = pairwise_bytes(self._vehicles[event.receiver].size, self._vehicles[event.source].size)
            self.recorder.sent(event.source, sizes[0])
            self.recorder.sent(event.receiver, sizes[1])
        rows, derivative = self._rows(event)
        if not rows:
            self.recorder.counts["lost"] += 1
        for number in range(len(rows)):
            if number:
                rows, derivative = self._rows(event)  # about the estimate that the row before left
            if event.kind == PEER:
                passes = self._relative(event, rows[number], derivative)
            else:
                passes = self._private(event, rows[number])
            if not passes:
                break

    def _rows(self, event: MeasurementEvent) -> tuple[list[LinearisedMeasurement], FloatArray]:
        """Rows of an event, and the derivative of a peer's place by its state."""
        one, sights = self._members[event.receiver], self._prepared.sights
        source_m, clock_m, derivative = None, 0.0, np.zeros((3, 0))
        if event.kind == PEER:
            vehicle, other = self._vehicles[event.source], self._members[event.source]
            sight = sights.source(event.number)
            if sight is None:
                source_m, derivative = vehicle.place(other.x, event.time_s)
            else:
                derivative = sight.derivative
                source_m = sight.reading + derivative @ other.x
            clock_m = float(other.x[vehicle.clock]) if vehicle.clock >= 0 else 0.0
        sight = sights.receiver(event.number)
        return rows_of(event, self._vehicles[event.receiver], one.x, source_m, clock_m, sight=sight), derivative

    def _passes(self, event: MeasurementEvent, row: LinearisedMeasurement, total: float) -> bool:
        total -= row.variance * (1.0 - event.spread)
        passes = (
            self._settings.gate_sigma <= 0.0 or row.innovation * row.innovation <= self._settings.gate_sigma**2 * total
        )
        self.recorder.judge(event, row.innovation, total, passes)
        for who in (event.receiver, event.source) if event.kind == PEER else (event.receiver,):
            one = self._members[who]
            one.rejected = 0 if passes else one.rejected + 1
            if one.rejected >= PATIENCE:
                vehicle, one.rejected = self._vehicles[who], 0
                self.recorder.opened(vehicle)
                for state, variance in vehicle.doubts.items():
                    one.P[state, state] += variance
        return passes

    def _private(self, event: MeasurementEvent, row: LinearisedMeasurement) -> bool:
        """Use a range to a point or satellite; no other vehicle is told."""
        one, variance = self._members[event.receiver], row.variance
        if event.kind == POINT:
            sigma = self._prepared.session.points[event.source].position_sigma_m
            if sigma > 0.0:
                variance += sigma**2 * float(np.sum((row.place @ self._prepared.points.axes[event.source]) ** 2))
        shared = one.P @ row.receiver
        total = float(row.receiver @ shared) + variance
        if not self._passes(event, row, total):
            return False
        gain = shared / total
        one.x = one.x + gain * row.innovation
        one.P = one.P - np.multiply.outer(shared, gain)
        kept = np.eye(len(one.x)) - np.multiply.outer(gain, row.receiver)
        one.factors.multiply(kept)
        if one.map_rows.size:
            one.map_rows = kept @ one.map_rows
        return True

    def _relative(self, event: MeasurementEvent, row: LinearisedMeasurement, derivative: FloatArray) -> bool:
        """Use a range between two vehicles: both are updated as one filter."""
        i, j = event.receiver, event.source
        one, other, n = self._members[i], self._members[j], len(self._members[i].x)
        h, h_other = row.receiver, row.by_source(self._vehicles[j], derivative)
        forth, back = one.factors.get(j), other.factors.get(i)
        cross = np.zeros((n, len(other.x))) if forth is None or back is None else forth @ back.T
        g, g_other = one.P @ h + cross @ h_other, h @ cross + other.P @ h_other
        total = float(h @ g) + float(h_other @ g_other) + row.variance
        if total <= 0.0 or not self._passes(event, row, total):
            return False
        for who, shared, peer in ((one, g, j), (other, g_other, i)):
            after = who.P - np.multiply.outer(shared, shared / total)
            if who.factors.has_third(peer):
                who.factors.multiply(after_over_before(after, who.P))
            who.x, who.P = who.x + shared * (row.innovation / total), after
        one.factors.put(j, cross - np.multiply.outer(g, g_other / total))
        other.factors.put(i, np.eye(len(other.x)))
        if one.map_rows.size:
            mixed = (h @ one.map_rows + h_other @ other.map_rows) / total
            one.map_rows = one.map_rows - np.multiply.outer(g, mixed)
            other.map_rows = other.map_rows - np.multiply.outer(g_other, mixed)
        return True


def after_over_before(after: FloatArray, before: FloatArray) -> FloatArray:
    """Return after @ inverse(before), scaled by the sigmas.

    States differ by eight powers of ten. Those that are known exactly, before and after, have a 0 in it.

    Examples
    --------
    >>> after_over_before(np.diag([1.0, 0.0]), np.diag([4.0, 0.0])).tolist()
    [[0.25, 0.0], [0.0, 0.0]]
    """
    is_exact = before.diagonal() <= 0.0
    sigma = np.sqrt(np.where(is_exact, 1.0, before.diagonal()))
    normal = before / np.multiply.outer(sigma, sigma)
    normal[is_exact, is_exact] = 1.0
    return np.asarray(np.linalg.solve(normal, (after / sigma).T).T / sigma)


def run_pairwise(prepared: Prepared, settings: CooperativeSettings) -> AlgorithmRun:
    """Run the filter with pairwise cross-covariances; sequential by its nature."""
    return Pairwise(prepared, settings).run()
