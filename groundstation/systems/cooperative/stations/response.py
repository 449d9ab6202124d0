"""Response of the smoother's problem to columns of residuals."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.cooperative.smoother.chain import KEPT_BYTES, Problem, add_blocks, turned

_State = tuple[FloatArray, FloatArray]  # covariance and means after a knot's rows


@dataclass(frozen=True)
class Response:
    """Response to c columns of residuals, and last to the problem's own.

    Parameters
    ----------
    moved : ndarray, shape (t, N, c + 1)
        States.
    left : ndarray, shape (r, c + 1)
        Residuals that are left.
    duals : ndarray, shape (t, N, c + 1)
        Duals of start and motion: times the variance they are what these had to give.
    spread : tuple of ndarray
        Covariance of the duals when all is as believed: of the start (N,), and of each group's motion, times the noise,
        summed over the knots, (v, n, n).
    """

    moved: FloatArray
    left: FloatArray
    duals: FloatArray
    spread: tuple[FloatArray, ...]


def respond(problem: Problem, columns: FloatArray) -> Response:
    """Solve a problem for columns of residuals (r, c), and for its own.

    The passes are those of the smoother's chain, for all columns at once.
    """
    residual = np.column_stack([columns, problem.residual])
    size, width = len(problem.start), residual.shape[1]
    dual, L = np.zeros((size, width)), np.zeros((size, size))
    spread = [np.zeros(noise.shape[1:]) for noise in problem.noise]
    duals = np.empty((problem.knots, size, width))
    for knot, after, U in _backwards(problem, residual):
        H, part = _dense(problem, knot)
        A = (H.T * problem.weight[part]) @ H
        both = U + dual
        dual = both - A @ (after @ both)
        duals[knot] = dual
        kept_share = np.eye(size) - A @ after
        L = kept_share @ L @ kept_share.T + kept_share @ A
        if knot:
            for group, (span, noise) in enumerate(zip(problem.spans, problem.noise, strict=True)):
                v, n = noise.shape[1:3]
                own = L[span, span].reshape(v, n, v, n)[range(v), :, range(v), :]
                spread[group] += noise[knot - 1] * own
            dual = dual.copy()
            for span, phi in zip(problem.spans, problem.phi, strict=True):
                turned(L, span, phi[knot - 1].swapaxes(1, 2))
                _turn(dual, span, phi[knot - 1].swapaxes(1, 2))
    x = problem.variance[:, None] * duals[0]
    x[:, -1] += problem.start
    moved = np.empty_like(duals)
    moved[0] = x
    for knot in range(1, problem.knots):
        x = x.copy()
        for span, phi, noise in zip(problem.spans, problem.phi, problem.noise, strict=True):
            _turn(x, span, phi[knot - 1])
            v, n = phi.shape[1:3]
            x[span] += (noise[knot - 1] @ duals[knot, span].reshape(v, n, width)).reshape(v * n, width)
        x[:, -1] += problem.defect[knot - 1]
        moved[knot] = x
    left = residual.copy()
    for knot in range(problem.knots):
        H, part = _dense(problem, knot)
        left[part] -= H @ moved[knot]
    return Response(moved, left, duals, (np.diag(L).copy(), *spread))


def _backwards(problem: Problem, residual: FloatArray) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield the knots from the last to the first, with covariances and what their rows tell.

    What a pass keeps is bounded: beyond it, pieces are passed again.
    """
    size = len(problem.start)
    pieces = min(problem.knots, max(1, int(np.ceil(8.0 * size * size * problem.knots / KEPT_BYTES))))
    edges = np.linspace(0, problem.knots, pieces + 1).astype(int).tolist()
    means = np.zeros((size, residual.shape[1]))
    means[:, -1] = problem.start
    state: _State = np.diag(problem.variance), means
    starts = []
    for first, last in pairwise(edges):
        starts.append(state)
        for knot in range(first, last) if last < problem.knots else ():
            state = _forward(problem, residual, state, knot)[:2]
    for first, last in reversed(list(pairwise(edges))):
        state, kept = starts.pop(), []
        for knot in range(first, last):
            P, M, U = _forward(problem, residual, state, knot)
            state = P, M
            kept.append((knot, P, U))
        while kept:
            yield kept.pop()


def _forward(
    problem: Problem, residual: FloatArray, state: _State, knot: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return covariance and means after a knot's rows, and what the rows tell."""
    P, M = state
    if knot:
        P, M = P.copy(), M.copy()
        for span, phi, noise in zip(problem.spans, problem.phi, problem.noise, strict=True):
            _turn(M, span, phi[knot - 1])
            turned(P, span, phi[knot - 1])
            add_blocks(P, span, noise[knot - 1])
        M[:, -1] += problem.defect[knot - 1]
    H, part = _dense(problem, knot)
    weighted = H.T * problem.weight[part]
    A = weighted @ H
    U = weighted @ residual[part] - A @ M
    after = np.asarray(np.linalg.solve(np.eye(len(P)) + P @ A, P))
    P = 0.5 * (after + after.T)
    return P, M + P @ U, U


def _dense(problem: Problem, knot: int) -> tuple[FloatArray, slice]:
    part = slice(int(problem.first[knot]), int(problem.first[knot + 1]))
    H = np.zeros((part.stop - part.start, len(problem.start) + 1))
    H[np.arange(len(H))[:, None], problem.columns[part]] = problem.values[part]
    return H[:, :-1], part


def _turn(M: FloatArray, span: slice, phi: FloatArray) -> None:
    v, n = phi.shape[:2]
    M[span] = (phi @ M[span].reshape(v, n, M.shape[1])).reshape(v * n, M.shape[1])
