"""Compiled parts of the Kalman filter: predict, innovate, update.

They are functions on arrays that other compiled loops call.

Letters, the same in all of this folder:

=======  ==========================================================================================
x        states, shape (c, n): c right-hand sides share one covariance; c = 0 is covariance alone
p        covariance of the errors of each of them, shape (n, n), symmetric to the last bit
F        transition: dense, shape (n, n), or the values (m,) of a :class:`Pattern`
Q        covariance of the process noise: dense, shape (n, n), or values (q,) at rows <= columns
h        row of the measurement matrix: ``values[first:last]`` at ``columns[first:last]``
R        variance of the measurement's noise
y        innovation: measured minus predicted
S        its variance, h p h' + R
K        gain, shape (n,)
g        p h', shape (n,)
w        room, shape (n, n)
=======  ==========================================================================================

``states`` is 0, 1, ... n - 1: as a tuple where the compiler shall know how many there are (a small system: its loops
are unrolled), as an array where it need not. The dimensions of F and Q tell whether they are dense, when a function is
compiled. Everything is changed in place; room is handed in, nothing is allocated.

Source: R. E. Kalman, A new approach to linear filtering and prediction problems, J. Basic Engineering 82, 1960;
R. S. Bucy, P. D. Joseph, Filtering for Stochastic Processes with Applications to Guidance, 1968, section 9.3;
G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapters II and V.
"""

from groundstation.base.compile import inlined
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import FloatArray, Pattern, States


@inlined
def predict_covariance(
    states: States, pattern: Pattern, F: FloatArray, step: int, p: FloatArray, w: FloatArray
) -> None:
    """Predict the covariance: p <- F p F'.

    A sparse F costs 1.5 n products for each entry. One half is computed and mirrored.
    """
    n = len(states)
    if F.ndim == 3:
        for i in range(n):
            for j in range(n):
                w[i, j] = 0.0
            for r in range(n):
                a = F[step, i, r]
                if a != 0.0:
                    for j in range(n):
                        w[i, j] += a * p[r, j]
        for i in range(n):
            for j in range(i, n):
                total = 0.0
                for r in range(n):
                    total += F[step, j, r] * w[i, r]
                p[i, j] = total
                p[j, i] = total
    else:
        rows, starts, columns = pattern
        count = len(rows)
        for t in range(count):  # w = F p, the rows that change
            for j in range(n):
                w[t, j] = 0.0
            for e in range(starts[t], starts[t + 1]):
                a, r = F[step, e], columns[e]
                for j in range(n):
                    w[t, j] += a * p[r, j]
        if count < n:
            for t in range(count):
                r = rows[t]
                for j in range(n):
                    p[r, j] = w[t, j]
                    p[j, r] = w[t, j]
        for t in range(count):
            i = rows[t]
            for u in range(t, count):
                total = 0.0
                for e in range(starts[u], starts[u + 1]):
                    total += F[step, e] * w[t, columns[e]]
                j = rows[u]
                p[i, j] = total
                p[j, i] = total


@inlined
def predict_states(states: States, pattern: Pattern, F: FloatArray, step: int, x: FloatArray, w: FloatArray) -> None:
    """Predict the states: x <- F x, every right-hand side."""
    n = len(states)
    for c in range(x.shape[0]):
        if F.ndim == 3:
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += F[step, i, j] * x[c, j]
                w[0, i] = total
            for i in range(n):
                x[c, i] = w[0, i]
        else:
            rows, starts, columns = pattern
            for t in range(len(rows)):
                total = 0.0
                for e in range(starts[t], starts[t + 1]):
                    total += F[step, e] * x[c, columns[e]]
                w[0, t] = total
            for t in range(len(rows)):
                x[c, rows[t]] = w[0, t]


@inlined
def add_noise(states: States, rows: Int64Array, columns: Int64Array, Q: FloatArray, step: int, p: FloatArray) -> None:
    """Add process noise: p <- p + Q.

    Every entry of a sparse Q off the diagonal is added on both sides of it.
    """
    if Q.ndim == 3:
        for i in range(len(states)):
            for j in range(len(states)):
                p[i, j] += Q[step, i, j]
    else:
        for e in range(len(rows)):
            i, j = rows[e], columns[e]
            p[i, j] += Q[step, e]
            if i != j:
                p[j, i] = p[i, j]


@inlined
def predicted(columns: Int64Array, values: FloatArray, first: int, last: int, x: FloatArray, c: int) -> float:
    """Return h x of right-hand side c."""
    total = 0.0
    for e in range(first, last):
        total += values[e] * x[c, columns[e]]
    return total


@inlined
def predicted_variance(columns: Int64Array, values: FloatArray, first: int, last: int, p: FloatArray) -> float:
    """Return h p h'."""
    total = 0.0
    for e in range(first, last):
        inner = 0.0
        for f in range(first, last):
            inner += values[f] * p[columns[e], columns[f]]
        total += values[e] * inner
    return total


@inlined
def update_covariance(
    states: States,
    columns: Int64Array,
    values: FloatArray,
    first: int,
    last: int,
    R: float,
    held: Int64Array,
    p: FloatArray,
    g: FloatArray,
    K: FloatArray,
) -> float:
    """Update p with a scalar measurement, fill the gain, return the innovation's variance S.

    Parameters
    ----------
    columns, values, first, last
        The row h.
    R : float
        Variance of the measurement; positive.
    held : ndarray of int, shape (s,)
        States that are considered and not estimated (Schmidt): their gain is set to zero. The covariance of the other
        states with them is kept right, their own is left alone.
    g, K : ndarrays, shape (n,)
        Filled: room, and the gain.

    Where nothing is held the gain is the optimal one, and p becomes p - g g' / S: g_i g_j is the same number for
    (j, i), so p stays symmetric to the last bit. With a gain partly set to zero the covariance of the error is
    (I - K h) p (I - K h)' + K R K' (Joseph); multiplied out that is p - K t' - t K' with t = g - S K / 2, symmetric to
    the last bit too. Rows where both vectors vanish are not touched. Where h is a single state, its row becomes
    p h' R / S: a product, which stays positive, where a difference of nearly equal numbers stood.

    Source: Bucy and Joseph 1968; S. F. Schmidt, Application of state-space methods to navigation problems, 1966.
    """
    n = len(states)
    for i in range(n):
        g[i] = 0.0
    for e in range(first, last):
        a, r = values[e], columns[e]
        for i in range(n):
            g[i] += a * p[r, i]
    s = R
    for e in range(first, last):
        s += values[e] * g[columns[e]]
    weight = 1.0 / s
    for i in range(n):
        K[i] = g[i] * weight
    if len(held) == 0:
        for i in range(n):
            a = g[i]
            if a != 0.0:
                for j in range(n):
                    p[i, j] -= a * g[j] * weight
    else:
        for e in range(len(held)):
            K[held[e]] = 0.0
        for i in range(n):
            g[i] -= 0.5 * s * K[i]
        for i in range(n):
            a, b = K[i], g[i]
            if a != 0.0 or b != 0.0:
                for j in range(n):
                    p[i, j] -= a * g[j] + b * K[j]
    r = columns[first]
    is_single = last - first == 1 and K[r] != 0.0
    for i in range(n if is_single else 0):
        total = R * K[i] if len(held) == 0 or K[i] != 0.0 else R / s * g[i]  # all of g is left for a held state
        p[r, i] = total / values[first]
        p[i, r] = total / values[first]
    return s


@inlined
def correct_states(states: States, K: FloatArray, y: float, x: FloatArray, c: int) -> None:
    """Correct the states: x <- x + K y, right-hand side c."""
    for i in range(len(states)):
        x[c, i] += K[i] * y
