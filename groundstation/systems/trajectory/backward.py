"""Compiled smoother of a pass: fixed interval, in the form of Bryson and Frazier.

``a`` and ``A`` are the adjoint of the correction and its covariance: the correction given all data is x - p a, its
covariance p - p A p. They go back over the gains that the filter kept; no matrix is inverted.

Source: G. J. Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18, 1973.
"""

from groundstation.base.compile import in_place
from groundstation.methods.kalman.arrays import Pattern
from groundstation.systems.trajectory.states import (
    KEPT_ROWS,
    NAVIGATION,
    STATES,
    WIDTH,
    FloatArray,
    Linear,
    Schedule,
    Solved,
)


@in_place
def back_over_scalar(at: int, linear: Linear, solved: Solved, a: FloatArray, A: FloatArray, u: FloatArray) -> None:
    """Take the adjoint back over one scalar measurement.

    a <- (I - K h)' a - h' y / S; A <- (I - K h)' A (I - K h) + h' h / S.
    """
    K, weight = solved.K[at], 1.0 / solved.S[at]
    total = 0.0
    for j in range(STATES):
        total += K[j] * a[j]
    inner = 0.0
    for i in range(STATES):
        s = 0.0
        for j in range(STATES):
            s += A[i, j] * K[j]
        u[i] = s  # A K
        inner += K[i] * s
    total += solved.y[at] * weight
    inner += weight
    for e in range(WIDTH):
        value = linear.h[at, e]
        if value == 0.0:
            continue
        r = linear.columns[at, e]
        a[r] -= value * total
        for j in range(STATES):
            A[r, j] -= value * u[j]
            A[j, r] -= value * u[j]
    for e in range(WIDTH):
        value = linear.h[at, e]
        if value == 0.0:
            continue
        r = linear.columns[at, e]
        for f in range(WIDTH):
            A[r, linear.columns[at, f]] += value * linear.h[at, f] * inner


@in_place
def back_over_step(
    e: int, pattern: Pattern, linear: Linear, a: FloatArray, A: FloatArray, w: FloatArray, u: FloatArray
) -> None:
    """Take the adjoint back over the transition that leads to epoch e: a <- F' a, A <- F' A F."""
    rows, starts, columns = pattern
    F = linear.F[e]
    for j in range(STATES):
        u[j] = a[j]
        for i in range(STATES):
            w[i, j] = A[i, j]
    # columns of A F, then rows of F' (A F); rows of F that are those of the identity stay
    for t in range(len(rows)):
        r = rows[t]
        u[r] = 0.0
        for i in range(STATES):
            w[i, r] = 0.0
    for t in range(len(rows)):
        r = rows[t]
        for q in range(starts[t], starts[t + 1]):
            c, value = columns[q], F[q]
            if value != 0.0:
                u[c] += value * a[r]
                for i in range(STATES):
                    w[i, c] += value * A[i, r]
    for i in range(STATES):
        a[i] = u[i]
        for j in range(STATES):
            A[i, j] = w[i, j]
    for t in range(len(rows)):
        r = rows[t]
        for j in range(STATES):
            A[r, j] = 0.0
    for t in range(len(rows)):
        r = rows[t]
        for q in range(starts[t], starts[t + 1]):
            c, value = columns[q], F[q]
            if value != 0.0:
                for j in range(STATES):
                    A[c, j] += value * w[r, j]


@in_place
def run_backward(
    schedule: Schedule,
    pattern: Pattern,
    linear: Linear,
    solved: Solved,
    begin: int,
    end: int,
    seldom: int,
    a: FloatArray,
    A: FloatArray,
    w: FloatArray,
    u: FloatArray,
    x: FloatArray,
    variance: FloatArray,
    plane: FloatArray,
    first_x: FloatArray,
    first_p: FloatArray,
) -> None:
    """Smooth epochs ``end - 1`` back to ``begin``.

    Parameters
    ----------
    seldom : int
        Epochs between two variances of the biases, which walk slowly.
    a, A : ndarrays, shapes (n,), (n, n)
        Zero at the end of the data; changed in place.
    w, u : ndarrays, shapes (n, n), (n,)
        Room.
    x, variance : ndarrays, shapes (e, KEPT_ROWS), (e, KEPT_ROWS)
        Filled: smoothed correction to the estimate before the measurements of each epoch, and its variance.
    plane : ndarray, shape (e,)
        Filled: covariance of the smoothed position, north with east.
    first_x : ndarray, shape (n,)
        Filled: p a at the start with the covariance ``first_p`` of the start, negative: correction of the start.
    """
    for e in range(end - 1, begin - 1, -1):
        for m in range(schedule.seen[e + 1] - 1, schedule.seen[e] - 1, -1):
            for i in range(2, -1, -1):
                if solved.mark[3 * m + i] == 1:
                    back_over_scalar(3 * m + i, linear, solved, a, A, u)
        for i in range(KEPT_ROWS):
            total, spread, beside = 0.0, 0.0, 0.0
            for j in range(STATES):
                total += solved.p[e, i, j] * a[j]
            x[e, i] = -total
            if i >= NAVIGATION and e % seldom != 0 and e < end - 1:  # biases walk slowly
                variance[e, i] = variance[e + 1, i]
                continue
            for j in range(STATES):
                s = 0.0
                for r in range(STATES):
                    s += A[j, r] * solved.p[e, i, r]
                spread += solved.p[e, i, j] * s
                beside += solved.p[e, 0, j] * s
            variance[e, i] = solved.p[e, i, i] - spread
            if i == 1:
                plane[e] = solved.p[e, 0, 1] - beside
        back_over_step(e, pattern, linear, a, A, w, u)
    for i in range(STATES):
        total = 0.0
        for j in range(STATES):
            total += first_p[i, j] * a[j]
        first_x[i] = -total
