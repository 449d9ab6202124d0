"""Compiled loops of the smoothers, backwards over the filter's record.

The letters are those of ``kernels``, and

===  =====================================================================================
a    lambda of the book, shape (c, n): what the later data say about the state, in units 1/x
A    its covariance, Lambda of the book, shape (n, n), symmetric
===  =====================================================================================

No covariance is inverted, so that states which the data do not see do no harm.

Source: A. E. Bryson, M. Frazier, Smoothing for linear and nonlinear dynamic systems, 1963; G. J. Bierman, Fixed
interval smoothing with discrete measurements, Int. J. Control 18, 1973, equations 8-13; the same estimate as that of
H. E. Rauch, F. Tung, C. T. Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3, 1965.
"""

from groundstation.base.compile import in_place, inlined
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import (
    USED,
    Back,
    Dynamics,
    FilterRecord,
    FloatArray,
    MeasurementRows,
    Pattern,
    Schedule,
    States,
)


@inlined
def absorb_covariance(
    states: States,
    columns: Int64Array,
    values: FloatArray,
    first: int,
    last: int,
    K: FloatArray,
    m: int,
    s: float,
    A: FloatArray,
    u: FloatArray,
) -> None:
    """Add a measurement to A: A <- (I - K h)' A (I - K h) + h' h / S, gain ``K[m]``.

    Only rows and columns of h change. ``u`` (n,) is room.
    """
    n = len(states)
    total = 1.0 / s
    for i in range(n):
        u[i] = 0.0
        for j in range(n):
            u[i] += A[i, j] * K[m, j]
        total += K[m, i] * u[i]
    for e in range(first, last):
        r, value = columns[e], values[e]
        for i in range(n):
            A[r, i] -= value * u[i]
        for i in range(n):
            A[i, r] -= value * u[i]
        for f in range(first, last):
            A[r, columns[f]] += value * values[f] * total
    for e in range(first, last):
        for i in range(n):
            A[columns[e], i] = A[i, columns[e]]


@inlined
def absorb_states(
    states: States,
    columns: Int64Array,
    values: FloatArray,
    first: int,
    last: int,
    K: FloatArray,
    m: int,
    y: FloatArray,
    s: float,
    a: FloatArray,
) -> None:
    """Add a measurement to a: a <- (I - K h)' a - h' y / S, every right-hand side.

    A ``y`` without length counts as zero.
    """
    for c in range(a.shape[0]):
        total = 0.0
        for i in range(len(states)):
            total += K[m, i] * a[c, i]
        if len(y) > 0:
            total += y[m, c] / s
        for e in range(first, last):
            a[c, columns[e]] -= values[e] * total


@inlined
def carry_covariance_back(
    states: States, pattern: Pattern, F: FloatArray, step: int, A: FloatArray, w: FloatArray
) -> None:
    """Carry A back over a step: A <- F' A F. ``w`` (n, n) is room."""
    n = len(states)
    if F.ndim == 3:
        for i in range(n):
            for j in range(n):
                w[i, j] = 0.0
            for r in range(n):
                value = F[step, r, i]
                if value != 0.0:
                    for j in range(n):
                        w[i, j] += value * A[r, j]
        for i in range(n):
            for j in range(i, n):
                total = 0.0
                for r in range(n):
                    total += F[step, r, j] * w[i, r]
                A[i, j] = total
                A[j, i] = total
    else:
        rows, starts, columns = pattern
        for i in range(n):
            for j in range(n):
                w[i, j] = A[i, j]
        for t in range(len(rows)):  # w = F' A
            for j in range(n):
                w[rows[t], j] = 0.0
        for t in range(len(rows)):
            for e in range(starts[t], starts[t + 1]):
                r, value = columns[e], F[step, e]
                for j in range(n):
                    w[r, j] += value * A[rows[t], j]
        for i in range(n):  # A = w F
            for j in range(n):
                A[i, j] = w[i, j]
            for t in range(len(rows)):
                A[i, rows[t]] = 0.0
            for t in range(len(rows)):
                for e in range(starts[t], starts[t + 1]):
                    A[i, columns[e]] += w[i, rows[t]] * F[step, e]
        for i in range(n):
            for j in range(i):
                A[i, j] = A[j, i]


@inlined
def carry_states_back(states: States, pattern: Pattern, F: FloatArray, step: int, a: FloatArray, w: FloatArray) -> None:
    """Carry a back over a step: a <- F' a, every right-hand side.

    The first row of ``w`` is room.
    """
    n = len(states)
    rows, starts, columns = pattern
    for c in range(a.shape[0]):
        if F.ndim == 3:
            for j in range(n):
                total = 0.0
                for i in range(n):
                    total += F[step, i, j] * a[c, i]
                w[0, j] = total
        else:
            for j in range(n):
                w[0, j] = a[c, j]
            for t in range(len(rows)):
                w[0, rows[t]] = 0.0
            for t in range(len(rows)):
                value = a[c, rows[t]]
                for e in range(starts[t], starts[t + 1]):
                    w[0, columns[e]] += F[step, e] * value
        for j in range(n):
            a[c, j] = w[0, j]


@in_place
def run_smoother(
    states: States,
    dynamics: Dynamics,
    schedule: Schedule,
    lines: MeasurementRows,
    record: FilterRecord,
    room: Back,
    begin: int,
    end: int,
    xs: FloatArray,
    variance: FloatArray,
) -> None:
    """Smooth epochs ``begin`` to ``end`` with all data in between (fixed interval).

    No later data is used.

    Parameters
    ----------
    record : FilterRecord
        As the filter filled it, with x, P and K.
    xs, variance : ndarrays, shapes (n, states, c), (n, states)
        Filled from ``begin`` to ``end``: smoothed states and the variances of each.
    """
    n, channels = len(states), record.x.shape[2]
    pattern, F = dynamics.pattern, dynamics.F
    step, bounds, row = schedule.step, schedule.first, schedule.row
    starts, columns, values = lines.starts, lines.columns, lines.values
    x, P, K, y, S, mark = record.x, record.P, record.K, record.y, record.S, record.mark
    a, A, _, w, u = room
    a[:], A[:] = 0.0, 0.0
    for k in range(end, begin - 1, -1):
        for i in range(n):
            total = P[k, i, i]
            for j in range(n):  # A is symmetric: twice its upper half
                inner = A[j, j] * P[k, i, j]
                for e in range(j + 1, n):
                    inner += 2.0 * A[j, e] * P[k, i, e]
                total -= P[k, i, j] * inner
            variance[k, i] = total
            for c in range(channels):
                back = x[k, i, c]
                for j in range(n):
                    back -= P[k, i, j] * a[c, j]
                xs[k, i, c] = back
        for m in range(bounds[k + 1] - 1, bounds[k] - 1 if k > begin else bounds[k + 1] - 1, -1):
            first, last = starts[row[m]], starts[row[m] + 1]
            if mark[m] == USED:
                absorb_states(states, columns, values, first, last, K, m, y, S[m], a)
                absorb_covariance(states, columns, values, first, last, K, m, S[m], A, u)
        if k > begin and step[k] >= 0:
            carry_states_back(states, pattern, F, step[k], a, w)
            carry_covariance_back(states, pattern, F, step[k], A, w)


@in_place
def run_fixed_lag(
    states: States,
    dynamics: Dynamics,
    schedule: Schedule,
    lines: MeasurementRows,
    record: FilterRecord,
    room: Back,
    begin: Int64Array,
    end: Int64Array,
    past: FloatArray,
) -> None:
    """Smooth epoch ``begin[i]`` with the data up to ``end[i]``, for each i.

    ``past`` (s, states, c) is filled with the states alone.
    """
    n, channels = len(states), record.x.shape[2]
    pattern, F = dynamics.pattern, dynamics.F
    step, bounds, row = schedule.step, schedule.first, schedule.row
    starts, columns, values = lines.starts, lines.columns, lines.values
    x, P, K, y, S, mark = record.x, record.P, record.K, record.y, record.S, record.mark
    a, _, _, w, _ = room
    for s in range(len(begin)):
        a[:] = 0.0
        for k in range(end[s], begin[s], -1):
            for m in range(bounds[k + 1] - 1, bounds[k] - 1, -1):
                first, last = starts[row[m]], starts[row[m] + 1]
                if mark[m] == USED:
                    absorb_states(states, columns, values, first, last, K, m, y, S[m], a)
            if step[k] >= 0:
                carry_states_back(states, pattern, F, step[k], a, w)
        k = begin[s]
        for i in range(n):
            for c in range(channels):
                total = x[k, i, c]
                for j in range(n):
                    total -= P[k, i, j] * a[c, j]
                past[s, i, c] = total


@in_place
def run_lag_covariance(
    states: States,
    dynamics: Dynamics,
    schedule: Schedule,
    lines: MeasurementRows,
    record: FilterRecord,
    room: Back,
    begin: Int64Array,
    end: Int64Array,
    smoothed: FloatArray,
    closed: FloatArray,
) -> None:
    """Fill the covariance of epoch ``begin[i]`` given the data up to ``end[i]``, for each i.

    ``closed`` tells how errors travel from one epoch to the other.

    Parameters
    ----------
    smoothed : ndarray, shape (s, states, states)
        Filled: P at begin - P A P.
    closed : ndarray, shape (s, states, states)
        Filled: product of (I - K h) F from begin to end: error at end that an error at begin leaves.
    """
    n = len(states)
    pattern, F = dynamics.pattern, dynamics.F
    step, bounds, row = schedule.step, schedule.first, schedule.row
    starts, columns, values = lines.starts, lines.columns, lines.values
    P, K, S, mark = record.P, record.K, record.S, record.mark
    _, A, C, w, u = room
    nothing = record.y[:0]
    for s in range(len(begin)):
        for i in range(n):
            for j in range(n):
                A[i, j] = 0.0
                C[i, j] = 1.0 if i == j else 0.0  # rows of the closed loop, built from its end
        for k in range(end[s], begin[s], -1):
            for m in range(bounds[k + 1] - 1, bounds[k] - 1, -1):
                first, last = starts[row[m]], starts[row[m] + 1]
                if mark[m] == USED:
                    absorb_states(states, columns, values, first, last, K, m, nothing, S[m], C)
                    absorb_covariance(states, columns, values, first, last, K, m, S[m], A, u)
            if step[k] >= 0:
                carry_covariance_back(states, pattern, F, step[k], A, w)
                carry_states_back(states, pattern, F, step[k], C, w)
        k = begin[s]
        for i in range(n):
            for j in range(n):
                closed[s, i, j] = C[i, j]
                total = 0.0
                for e in range(n):
                    total += A[i, e] * P[k, e, j]
                w[i, j] = total
        for i in range(n):
            for j in range(n):
                total = P[k, i, j]
                for e in range(n):
                    total -= P[k, i, e] * w[e, j]
                smoothed[s, i, j] = total
