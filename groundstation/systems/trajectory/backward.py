"""Compiled smoother of a pass: fixed interval, in the form of Bryson and Frazier.

``a`` and ``A`` are the adjoint of the correction and its covariance: the correction given all data is x - p a, its
covariance p - p A p. They go back over the gains that the filter kept; no matrix is inverted.

Source: G. J. Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18, 1973.
"""

from groundstation.base.compile import in_place, inlined
from groundstation.methods.kalman.arrays import Pattern
from groundstation.systems.trajectory.states import (
    ATT,
    KEPT_ROWS,
    LEV,
    NAVIGATION,
    STATES,
    WIDTH,
    FloatArray,
    Linear,
    Schedule,
    Solved,
)


@in_place
def adjoint_over_scalar(at: int, linear: Linear, solved: Solved, a: FloatArray) -> float:
    """Take the adjoint back over one scalar measurement: a <- (I - K h)' a - h' y / S.

    Returns the adjoint of the noise of the measurement itself.
    """
    K = solved.K[at]
    total: float = solved.y[at] * (1.0 / solved.S[at])
    for j in range(STATES):
        total += K[j] * a[j]
    for e in range(WIDTH):
        value = linear.h[at, e]
        if value != 0.0:
            a[linear.columns[at, e]] -= value * total
    return total


@inlined
def fill_product(A: FloatArray, v: FloatArray, u: FloatArray) -> None:
    """Fill u with A v, for a symmetric A.

    Five columns at once, in the order of one after the other: those take twice as long.
    """
    for i in range(STATES):
        u[i] = 0.0
    for j in range(0, STATES, 5):
        for i in range(STATES):
            total = u[i] + v[j] * A[j, i]
            total += v[j + 1] * A[j + 1, i]
            total += v[j + 2] * A[j + 2, i]
            total += v[j + 3] * A[j + 3, i]
            total += v[j + 4] * A[j + 4, i]
            u[i] = total


@in_place
def spread_over_scalar(at: int, linear: Linear, solved: Solved, A: FloatArray, u: FloatArray) -> float:
    """Take the adjoint's covariance back over one: A <- (I - K h)' A (I - K h) + h' h / S.

    Returns that of the noise of the measurement itself.
    """
    K = solved.K[at]
    inner: float = 1.0 / solved.S[at]
    fill_product(A, K, u)
    for j in range(STATES):
        inner += K[j] * u[j]
    for e in range(WIDTH):
        value = linear.h[at, e]
        if value == 0.0:
            continue
        r = linear.columns[at, e]
        for j in range(STATES):
            A[r, j] -= value * u[j]
        beside = value * inner - u[r]
        for f in range(WIDTH):
            A[r, linear.columns[at, f]] += beside * linear.h[at, f]
    for e in range(WIDTH):
        if linear.h[at, e] != 0.0:
            r = linear.columns[at, e]
            for j in range(STATES):
                A[j, r] = A[r, j]
    return inner


@in_place
def adjoint_over_step(e: int, pattern: Pattern, linear: Linear, a: FloatArray, u: FloatArray) -> None:
    """Take the adjoint back over the transition that leads to epoch e: a <- F' a.

    The rows of navigation are a block over the states before LEV, each other row of the pattern has a factor alone.
    """
    F = linear.F[e]
    for c in range(LEV):
        total = a[c] if c >= NAVIGATION else 0.0
        for r in range(NAVIGATION):
            total += F[r * LEV + c] * a[r]
        u[c] = total
    for c in range(LEV):
        a[c] = u[c]
    rows, starts, _columns = pattern
    for t in range(NAVIGATION, len(rows)):
        a[rows[t]] *= F[starts[t]]


@in_place
def spread_over_step(e: int, pattern: Pattern, linear: Linear, A: FloatArray, w: FloatArray) -> None:
    """Take the adjoint's covariance back over the transition to epoch e: A <- F' A F."""
    F = linear.F[e]
    for c in range(LEV):  # w = F' A, the rows that change by navigation, which are nine
        keep = 1.0 if c >= NAVIGATION else 0.0
        f0, f1, f2, f3, f4 = F[c], F[LEV + c], F[2 * LEV + c], F[3 * LEV + c], F[4 * LEV + c]
        f5, f6, f7, f8 = F[5 * LEV + c], F[6 * LEV + c], F[7 * LEV + c], F[8 * LEV + c]
        for j in range(STATES):
            total = keep * A[c, j] + f0 * A[0, j] + f1 * A[1, j] + f2 * A[2, j] + f3 * A[3, j]
            w[c, j] = total + f4 * A[4, j] + f5 * A[5, j] + f6 * A[6, j] + f7 * A[7, j] + f8 * A[8, j]
    for c in range(LEV):  # (F' A) F
        f0, f1, f2, f3, f4, f5, f6, f7, f8 = (
            w[c, 0],
            w[c, 1],
            w[c, 2],
            w[c, 3],
            w[c, 4],
            w[c, 5],
            w[c, 6],
            w[c, 7],
            w[c, 8],
        )
        for j in range(c, LEV):
            total = w[c, j] if j >= NAVIGATION else 0.0
            total += f0 * F[j]
            total += f1 * F[LEV + j]
            total += f2 * F[2 * LEV + j]
            total += f3 * F[3 * LEV + j]
            total += f4 * F[4 * LEV + j]
            total += f5 * F[5 * LEV + j]
            total += f6 * F[6 * LEV + j]
            total += f7 * F[7 * LEV + j]
            A[c, j] = total + f8 * F[8 * LEV + j]
        for j in range(LEV, STATES):
            A[c, j] = w[c, j]
    rows, starts, _columns = pattern
    for t in range(NAVIGATION, len(rows)):
        r, value = rows[t], F[starts[t]]
        for i in range(r + 1):
            A[i, r] *= value
        for j in range(r, STATES):
            A[r, j] *= value
    for i in range(STATES):
        for j in range(i):
            A[i, j] = A[j, i]


@in_place
def run_backward(
    schedule: Schedule,
    pattern: Pattern,
    linear: Linear,
    solved: Solved,
    end: int,
    spread_from: int,
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
    """Smooth epochs ``end - 1`` back to the first.

    Parameters
    ----------
    solved : Solved
        ``row`` tells which epochs are smoothed.
    spread_from : int
        First epoch with a variance that is wanted; ``end`` where none is.
    seldom : int
        Epochs between two variances of the biases, which walk slowly.
    a, A : ndarrays, shapes (n,), (n, n)
        Zero at the end of the data; changed in place.
    w, u : ndarrays, shapes (n, n), (n,)
        Room.
    x, variance : ndarrays, shapes (e, KEPT_ROWS), (e, KEPT_ROWS)
        Filled: smoothed correction to the estimate before the measurements of each epoch, and its variance.
    plane : ndarray, shape (e, 2)
        Filled: covariances of north with east: of the smoothed position, and of the smoothed attitude.
    first_x : ndarray, shape (n,)
        Filled: p a at the start with the covariance ``first_p`` of the start, negative: correction of the start.
    """
    for e in range(end - 1, -1, -1):
        is_spread, row = e >= spread_from, solved.row[e]
        for m in range(schedule.seen[e + 1] - 1, schedule.seen[e] - 1, -1):
            for i in range(2, -1, -1):
                if solved.mark[3 * m + i] == 1:
                    if is_spread:
                        spread_over_scalar(3 * m + i, linear, solved, A, u)
                    adjoint_over_scalar(3 * m + i, linear, solved, a)
        for i in range(KEPT_ROWS if row >= 0 else 0):
            total, spread, beside = 0.0, 0.0, 0.0
            for j in range(STATES):
                total += solved.p[row, i, j] * a[j]
            x[e, i] = -total
            if not is_spread:
                continue
            if i >= NAVIGATION and e % seldom != 0 and e < end - 1:  # biases walk slowly
                variance[e, i] = variance[e + 1, i]
                continue
            fill_product(A, solved.p[row, i], u)
            for j in range(STATES):
                spread += solved.p[row, i, j] * u[j]
            variance[e, i] = solved.p[row, i, i] - spread
            if i in (1, ATT + 1):
                for j in range(STATES):
                    beside += solved.p[row, i - 1, j] * u[j]
                plane[e, 0 if i == 1 else 1] = solved.p[row, i - 1, i] - beside
        if is_spread:
            spread_over_step(e, pattern, linear, A, w)
        adjoint_over_step(e, pattern, linear, a, u)
    for i in range(STATES):
        total = 0.0
        for j in range(STATES):
            total += first_p[i, j] * a[j]
        first_x[i] = -total
