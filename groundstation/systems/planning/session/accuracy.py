"""Accuracy of a session that has not been flown, and its derivative by every position.

The covariance of the centralised local filter needs the geometry alone. Seven states an aircraft that is not exact:
position north, east (m), velocity north, east (m/s), height (m), clock offset (m), clock frequency (m/s).

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapter 5.2, equation (28): the covariance
as function of the control; the adjoint is that of the sequential scalar update (see :func:`_carry_back`).
"""

from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import compiled
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.filter import FilterRun, Measurements, Start, run_filter
from groundstation.methods.kalman.transition import Transition
from groundstation.methods.link_dynamics import discretise, local_dynamics
from groundstation.systems.planning.session.scenario import SessionPlan

STATES = 7
NORTH, EAST, HEIGHT, CLOCK = 0, 1, 4, 5
PLACE = np.array([NORTH, EAST, HEIGHT])


@dataclass(frozen=True)
class Links:
    """Ranging links: ``receiver`` and ``source`` (l,) number the sources, aircraft first.

    ``line_m`` (epochs, l, 3) leads from source to receiver, ``range_m`` is (epochs, l).
    """

    receiver: Int64Array
    source: Int64Array
    line_m: FloatArray
    range_m: FloatArray

    @cached_property
    def direction(self) -> FloatArray:
        """Unit vectors from source to receiver, shape (epochs, l, 3)."""
        return frozen(self.line_m / self.range_m[:, :, None])

    def by_position(self, by_direction: FloatArray, sources: int) -> FloatArray:
        """Derivative by positions (epochs, sources, 3) from that by the directions (epochs, l, 3)."""
        along = np.einsum("kla,kla->kl", by_direction, self.direction)
        by_line = (by_direction - along[:, :, None] * self.direction) / self.range_m[:, :, None]
        found = np.zeros((len(by_line), sources, 3))
        for link, (receiver, source) in enumerate(zip(self.receiver.tolist(), self.source.tolist(), strict=True)):
            found[:, receiver] += by_line[:, link]
            found[:, source] -= by_line[:, link]
        return found


@dataclass(frozen=True)
class Accuracy:
    """Covariances of a session (epochs, n, n), and what gave them.

    The first is before any range.
    """

    covariance: FloatArray
    links: Links
    rows: FloatArray  # (epochs - 1, l, n)
    run: FilterRun

    def __post_init__(self) -> None:
        for name in ("covariance", "rows"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


class AccuracyModel:
    """Covariance of the centralised filter along given tracks, and its derivative.

    ``dynamics``, ``noise`` and ``start`` are transition and noise of a step and the covariance before it, (n, n);
    ``variance_m2`` is that of a range of one step.

    Parameters
    ----------
    plan : SessionPlan
    """

    def __init__(self, plan: SessionPlan) -> None:
        self.plan = plan
        self.estimated = [number for number, one in enumerate(plan.aircraft) if not one.is_exact]
        self.size = STATES * len(self.estimated)
        self.sources = len(plan.aircraft) + len(plan.points)
        self.user = plan.aircraft.index(plan.user)
        pairs = [(one, other) for one in self.estimated for other in range(self.sources) if other != one]
        self._receiver, self._source = (np.array(column) for column in zip(*pairs, strict=True))
        self.variance_m2 = plan.ranging.variance_m2(plan.step_s)
        self.dynamics, self.noise, self.start = self._models()
        rows, columns = np.nonzero(self.dynamics)
        noisy_rows, noisy_columns = np.nonzero(np.triu(self.noise))
        values, noise = self.dynamics[rows, columns][None], self.noise[noisy_rows, noisy_columns][None]
        self._transition = Transition.sparse(self.size, rows, columns, values, noisy_rows, noisy_columns, noise)

    def first_of(self, aircraft: int) -> int:
        """Index of the first state of an aircraft; -1 for an exact one and for a ground point."""
        return STATES * self.estimated.index(aircraft) if aircraft in self.estimated else -1

    def _models(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return transition and noise covariance over a step, and the covariance at the start.

        They are of all aircraft.
        """
        F, Q, P = (np.zeros((self.size, self.size)) for _ in range(3))
        for place, number in enumerate(self.estimated):
            errors = self.plan.aircraft[number].errors
            own = slice(STATES * place, STATES * (place + 1))
            times = errors.velocity_s, errors.baro_s, errors.clock_s
            sigma = np.array([errors.velocity_mps, errors.baro_m, errors.clock_mps])
            density = np.zeros(STATES)
            driven = 2.0 * sigma**2 / times
            density[2] = density[3] = driven[0]
            density[HEIGHT], density[6] = driven[1], driven[2]
            F[own, own], Q[own, own] = discretise(local_dynamics(*times), density, self.plan.step_s)
            p = errors.position_m, errors.position_m, errors.velocity_mps, errors.velocity_mps, errors.baro_m
            P[own, own] = np.diag(np.square([*p, errors.clock_m, errors.clock_mps]))
        return F, Q, P

    def links(self, position_m: FloatArray) -> Links:
        """Lines of all ranges, at every epoch but the first."""
        line = position_m[1:, self._receiver] - position_m[1:, self._source]
        return Links(self._receiver, self._source, line, np.linalg.norm(line, axis=2))

    def rows(self, links: Links) -> FloatArray:
        """Rows of the measurement matrix, shape (epochs, l, n)."""
        H = np.zeros((*links.range_m.shape, self.size))
        clock = 0.0 if self.plan.ranging.is_two_way else 1.0
        for link, pair in enumerate(zip(links.receiver.tolist(), links.source.tolist(), strict=True)):
            for who, sign in zip(pair, (1.0, -1.0), strict=True):
                first = self.first_of(who)
                if first >= 0:
                    H[:, link, first + PLACE] = sign * links.direction[:, link]
                    H[:, link, first + CLOCK] = sign * clock
        return H

    def accuracy(self, position_m: FloatArray) -> Accuracy:
        """Covariances along tracks.

        Parameters
        ----------
        position_m : ndarray, shape (epochs, sources, 3)
            North, east, up.
        """
        links = self.links(position_m)
        H = self.rows(links)
        epochs, count, n = H.shape
        at = np.repeat(np.arange(epochs), count)
        flat, nothing = H.reshape(-1, n), np.zeros((epochs * count, 0))
        kind = np.tile(np.arange(count), epochs)
        measured = Measurements.of(at, nothing, np.arange(n), flat, self.variance_m2, kind=kind)
        step = np.zeros(epochs, dtype=np.int64)
        run = run_filter(self._transition, step, measured, Start(np.zeros((n, 0)), self.start))
        return Accuracy(np.concatenate([self.start[None], run.P]), links, H, run)

    def by_position(self, found: Accuracy, by_covariance: FloatArray) -> FloatArray:
        """Derivative of a measure of the covariances by every position.

        Parameters
        ----------
        found : Accuracy
        by_covariance : ndarray, shape (epochs, n, n)
            Symmetric derivative of the measure by the covariance at each epoch.

        Returns
        -------
        ndarray, shape (epochs, sources, 3)
        """
        by_rows = np.empty(found.rows.shape)
        _carry_back(
            self.dynamics,
            np.ascontiguousarray(found.rows),
            found.covariance[1:],
            found.run.record.K,
            found.run.record.S,
            np.array(by_covariance[1:], order="C"),
            by_rows,
        )
        by_direction = np.zeros(found.links.line_m.shape)
        for link, pair in enumerate(zip(found.links.receiver.tolist(), found.links.source.tolist(), strict=True)):
            for who, sign in zip(pair, (1.0, -1.0), strict=True):
                first = self.first_of(who)
                if first >= 0:
                    by_direction[:, link] += sign * by_rows[:, link][:, first + PLACE]
        by_place = found.links.by_position(by_direction, self.sources)
        return np.concatenate([np.zeros((1, self.sources, 3)), by_place])


@compiled
def _carry_back(F, rows, covariance, K, S, by_P, by_rows):  # type: ignore[no-untyped-def]
    """Fill the derivative by every row h of the measurement matrix, from last to first.

    L is the derivative by the covariance. Through an update P+ = (I - K h) P with K = P h' / S: L <- (I - K h)' L
    (I - K h), and the derivative by h is -2 P+ L K, for d(P+^-1) = (dh' h + h' dh) / R and P+ h' = R K. The covariance
    before the update is P+ + K K' S. Through a prediction P = F P F' + Q: L <- F' L F.
    """
    epochs, links, n = rows.shape
    P, L, room = np.empty((n, n)), np.zeros((n, n)), np.empty((n, n))
    moved = np.empty(n)
    for k in range(epochs - 1, -1, -1):
        for i in range(n):
            for j in range(n):
                P[i, j] = covariance[k, i, j]
                L[i, j] += by_P[k, i, j]
        for link in range(links - 1, -1, -1):
            m = k * links + link
            quadratic = 0.0
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += L[i, j] * K[m, j]
                moved[i] = total
                quadratic += K[m, i] * total
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += P[i, j] * moved[j]
                by_rows[k, link, i] = -2.0 * total
            for i in range(n):
                for j in range(n):
                    hi, hj = rows[k, link, i], rows[k, link, j]
                    L[i, j] += hi * hj * quadratic - hi * moved[j] - moved[i] * hj
                    P[i, j] += K[m, i] * K[m, j] * S[m]
        for i in range(n):
            for j in range(n):
                total = 0.0
                for r in range(n):
                    if F[r, j] != 0.0:
                        total += L[i, r] * F[r, j]
                room[i, j] = total
        for i in range(n):
            for j in range(n):
                total = 0.0
                for r in range(n):
                    if F[r, i] != 0.0:
                        total += F[r, i] * room[r, j]
                L[i, j] = total
