"""Solver of the least-squares problem, a chain of knots, by a pass forth and one back.

The normal equations of a batch over all knots are block tridiagonal. Eliminating the knots in order of time is a Kalman
filter over the chain, substituting back is the smoother of Bryson and Frazier: dual variables run back, and the states
follow from them. In this form states without noise and constants need no inverse of their noise. Covariances of the
answer are the diagonal blocks of the inverse of the same matrix.

Source: Bryson and Ho, Applied Optimal Control, 1975, section 13.2; Bell, The iterated Kalman smoother as a Gauss-Newton
method, SIAM Journal on Optimization 4(3), 1994; Bierman, Factorization Methods for Discrete Sequential Estimation,
1977, section 10.2 (covariances from the duals).
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array

KEPT_BYTES = 1e8  # of what a pass keeps for the way back; beyond, pieces are passed again
SPARSE_FROM = 120  # states, from which on the rows of a knot are multiplied as sparse ones


@dataclass(frozen=True)
class Problem:
    """One linearised problem about reference states.

    Parameters
    ----------
    spans : sequence of slice
        States of each group.
    phi, noise : sequences of ndarray, shape (t - 1, v, n, n)
        Of each group; all else is constant.
    defect : ndarray, shape (t - 1, N)
        Moved reference less the reference behind.
    start : ndarray, shape (N,)
        Believed start less the reference there.
    variance : ndarray, shape (N,)
        Of the start.
    first, columns, values, residual, weight
        Rows, see ``Rows``; the weight is one over the variance.
    """

    spans: Sequence[slice]
    phi: Sequence[FloatArray]
    noise: Sequence[FloatArray]
    defect: FloatArray
    start: FloatArray
    variance: FloatArray
    first: Int64Array
    columns: Int64Array
    values: FloatArray
    residual: FloatArray
    weight: FloatArray

    @property
    def knots(self) -> int:
        """Number of knots."""
        return len(self.first) - 1


class FewRows(NamedTuple):
    """Update of a knot by its rows: residual = H x + noise.

    ``gain``, ``inverse`` of the covariance of the innovations, and that times the innovations, ``a``.
    """

    H: FloatArray
    gain: FloatArray
    inverse: FloatArray
    a: FloatArray

    def back(self, dual: FloatArray) -> FloatArray:
        """Return the dual before the update from that behind it."""
        return np.asarray(dual + self.H.T @ (self.a - self.gain.T @ dual))

    def back_matrix(self, dual: FloatArray, behind: FloatArray) -> FloatArray:
        """Return the matrix of the dual before the update.

        ``behind`` is the product of the covariance with that behind it.
        """
        turned = dual - self.H.T @ (self.gain.T @ dual)
        out = turned - (turned @ self.gain) @ self.H + self.H.T @ self.inverse @ self.H
        return np.asarray(0.5 * (out + out.T))


class ManyRows(NamedTuple):
    """Update of a knot by more rows than states.

    ``A`` is their information, ``P`` the covariance after them.
    """

    A: FloatArray  # or sparse
    P: FloatArray
    u: FloatArray

    def back(self, dual: FloatArray) -> FloatArray:
        """Return the dual before the update from that behind it."""
        both = self.u + dual
        return np.asarray(both - self.A @ (self.P @ both))

    def back_matrix(self, dual: FloatArray, behind: FloatArray) -> FloatArray:
        """Return the matrix of the dual before the update.

        ``behind`` is the product of the covariance with that behind it.
        """
        turned = dual - self.A @ behind
        out = turned - _right(_right(turned, self.P) - np.eye(len(dual)), self.A) - self.A @ _right(self.P, self.A)
        return np.asarray(0.5 * (out + out.T))


Update = FewRows | ManyRows


def _right(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return left times right, where the right one is symmetric and may be sparse."""
    return np.asarray((right @ left.T).T)


def turned(P: FloatArray, span: slice, phi: FloatArray) -> None:
    """Turn the states of a group in both directions of a covariance: P <- F P F', in place."""
    v, n = phi.shape[:2]
    wide = P.shape[0]
    P[span] = (phi @ P[span].reshape(v, n, wide)).reshape(v * n, wide)
    columns = np.ascontiguousarray(P[:, span].T).reshape(v, n, wide)
    P[:, span] = (phi @ columns).reshape(v * n, wide).T


def add_blocks(P: FloatArray, span: slice, blocks: FloatArray) -> None:
    """Add a block for each vehicle of a group to the diagonal, in place."""
    v, n = blocks.shape[:2]
    rows = span.start + np.arange(v * n).reshape(v, n)
    P[rows[:, :, None], rows[:, None, :]] += blocks


def turned_vector(x: FloatArray, span: slice, phi: FloatArray, *, back: bool = False) -> None:
    """Turn the states of a group in a vector, or by the transpose, in place."""
    v, n = phi.shape[:2]
    x[span] = ((phi.swapaxes(1, 2) if back else phi) @ x[span].reshape(v, n, 1)).ravel()


def updated(
    m: FloatArray, P: FloatArray, columns: Int64Array, values: FloatArray, residual: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray, Update | None]:
    """Use the rows of a knot: mean and covariance after it, and what the way back needs."""
    size, rows = len(m), len(residual)
    if not rows:
        return m, P, None
    if rows > size:
        return _many(m, P, columns, values, residual, weight)
    H = np.zeros((rows, size + 1))
    H[np.arange(rows)[:, None], columns] = values
    H = H[:, :size]
    shared = P @ H.T
    S = H @ shared
    S[range(rows), range(rows)] += 1.0 / weight
    inverse = np.asarray(np.linalg.inv(S), dtype=np.float64)
    gain, a = shared @ inverse, inverse @ (residual - H @ m)
    P = P - gain @ shared.T
    return m + shared @ a, 0.5 * (P + P.T), FewRows(H, gain, inverse, a)


def _many(
    m: FloatArray, P: FloatArray, columns: Int64Array, values: FloatArray, residual: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray, ManyRows]:
    size, rows = len(m), len(residual)
    A: FloatArray
    if size < SPARSE_FROM:
        H = np.zeros((rows, size + 1))
        H[np.arange(rows)[:, None], columns] = values
        H = H[:, :size]
        A, g = (H.T * weight) @ H, H.T @ (weight * residual)
    else:
        from scipy.sparse import csr_matrix

        starts = np.arange(rows + 1) * columns.shape[1]
        sparse = csr_matrix((values.ravel(), columns.ravel(), starts), shape=(rows, size + 1))[:, :size]
        A, g = (sparse.T.multiply(weight) @ sparse).tocsr(), sparse.T @ (weight * residual)
    u = g - A @ m
    after = np.linalg.solve(np.eye(size) + _right(P, A), P)
    after = 0.5 * (after + after.T)
    return m + after @ u, after, ManyRows(A, after, u)


class Chain:
    """A linearised problem with what its passes keep."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        size, knots = len(problem.start), problem.knots
        each = 8.0 * (2.0 * size * size + 2.0 * size * max(1.0, min(len(problem.residual) / knots, size)))
        pieces = max(1, int(np.ceil(each * knots / KEPT_BYTES)))
        self._edges = np.linspace(0, knots, min(pieces, knots) + 1).astype(int)

    def solve(self) -> tuple[FloatArray, FloatArray]:
        """Return what is to be added to the reference states (t, N), and the duals (t, N)."""
        problem = self._problem
        duals = np.zeros((problem.knots, len(problem.start)))
        dual = np.zeros(len(problem.start))
        for knot, update, _P in self._backwards(with_covariance=False):
            if update is not None:
                dual = update.back(dual)
            duals[knot] = dual
            self._back_over(dual := dual.copy(), knot)
        step = np.empty_like(duals)
        x = problem.start + problem.variance * duals[0]
        step[0] = x
        for knot in range(1, problem.knots):
            x = x.copy()
            for span, phi, noise in zip(problem.spans, problem.phi, problem.noise, strict=True):
                turned_vector(x, span, phi[knot - 1])
                v, n = phi.shape[1:3]
                x[span] += (noise[knot - 1] @ duals[knot, span].reshape(v, n, 1)).ravel()
            x += problem.defect[knot - 1]
            step[knot] = x
        return step, duals

    def covariances(self) -> Iterator[tuple[int, FloatArray, FloatArray, FloatArray]]:
        """Yield the knots from the last to the first, each with what makes its covariance.

        They are the filter's covariance after its rows P, the matrix of the duals L behind it, and L P: the smoothed
        covariance is P - P L P (see ``block``).
        """
        size = len(self._problem.start)
        L = np.zeros((size, size))
        for knot, update, P in self._backwards(with_covariance=True):
            assert P is not None
            behind = P @ L
            yield knot, P, L, behind
            L = L if update is None else update.back_matrix(L, behind)
            for span, phi in zip(self._problem.spans, self._problem.phi, strict=True):
                if knot:
                    turned(L, span, phi[knot - 1].swapaxes(1, 2))

    def _back_over(self, dual: FloatArray, knot: int) -> None:
        for span, phi in zip(self._problem.spans, self._problem.phi, strict=True):
            if knot:
                turned_vector(dual, span, phi[knot - 1], back=True)

    def _backwards(self, *, with_covariance: bool) -> Iterator[tuple[int, Update | None, FloatArray | None]]:
        """Yield the knots from the last to the first, with updates and covariances."""
        problem, edges = self._problem, self._edges
        state = problem.start.copy(), np.diag(problem.variance)
        starts = []
        for piece in range(len(edges) - 1):  # the last is kept on the way, the others are passed again
            starts.append(state)
            if piece < len(edges) - 2:
                for knot in range(edges[piece], edges[piece + 1]):
                    state = self._forward(*state, knot)[:2]
        for piece in range(len(edges) - 2, -1, -1):
            state = starts.pop()
            kept = []
            for knot in range(edges[piece], edges[piece + 1]):
                m, P, update = self._forward(*state, knot)
                state = m, P
                kept.append((knot, update, P if with_covariance else None))
            while kept:
                yield kept.pop()

    def _forward(self, m: FloatArray, P: FloatArray, knot: int) -> tuple[FloatArray, FloatArray, Update | None]:
        """Return mean and covariance after a knot's rows from those after the knot before it."""
        problem = self._problem
        if knot:
            m, P = m.copy(), P.copy()
            for span, phi, noise in zip(problem.spans, problem.phi, problem.noise, strict=True):
                turned_vector(m, span, phi[knot - 1])
                turned(P, span, phi[knot - 1])
                add_blocks(P, span, noise[knot - 1])
            m += problem.defect[knot - 1]
        rows = slice(problem.first[knot], problem.first[knot + 1])
        return updated(m, P, problem.columns[rows], problem.values[rows], problem.residual[rows], problem.weight[rows])


def block(P: FloatArray, behind: FloatArray, states: Int64Array | slice) -> FloatArray:
    """Return a block of the smoothed covariance P - P L P; ``behind`` is P L."""
    out = P[states][:, states] - behind[states] @ P[:, states]
    return np.asarray(0.5 * (out + out.T))
