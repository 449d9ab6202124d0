"""Compiled loops of the smoothers: fixed interval, fixed lag, and the covariance between two epochs of a lag.

Backwards in the form of Bryson and Frazier. Letters as in the books; shapes stand in each docstring.
"""

import numpy as np

from groundstation.base.compile import compiled
from groundstation.base.records import Int64Array
from groundstation.estimators.inertial.kernels import USED, Marks
from groundstation.estimators.inertial.model import FloatArray


@compiled
def _absorb(A: FloatArray, K: FloatArray, s: float, m: int, h: FloatArray) -> None:
    """A <- (I - K H)' A (I - K H) + H' H / s, H of the single state m: its row and column change. ``h`` is room."""
    dot = 0.0
    for i in range(6):
        h[i] = 0.0
        for j in range(6):
            h[i] += A[i, j] * K[j]
    for i in range(6):
        dot += K[i] * h[i]
    corner = A[m, m] - 2.0 * h[m] + dot + 1.0 / s
    for i in range(6):
        A[i, m] -= h[i]
        A[m, i] = A[i, m]
    A[m, m] = corner


@compiled
def _carry_back(A: FloatArray, F: FloatArray, B: FloatArray) -> None:
    """A <- F' A F for symmetric A, with the zeros of the transition F left out. ``B`` is room."""
    for i in range(6):
        B[i, 0] = A[i, 0]
        for j in range(1, 6):
            B[i, j] = A[i, 0] * F[0, j] + A[i, 1] * F[1, j] + A[i, 2] * F[2, j]
        B[i, 3] += A[i, 3]
        B[i, 4] += A[i, 3] * F[3, 4] + A[i, 4]
        B[i, 5] += A[i, 5] * F[5, 5]
    for j in range(6):
        A[0, j] = B[0, j]
        A[j, 0] = B[0, j]
    for i in range(1, 6):
        for j in range(i, 6):
            total = F[0, i] * B[0, j] + F[1, i] * B[1, j] + F[2, i] * B[2, j]
            if i == 3:
                total += B[3, j]
            elif i == 4:
                total += F[3, 4] * B[3, j] + B[4, j]
            elif i == 5:
                total += F[5, 5] * B[5, j]
            A[i, j] = total
            A[j, i] = total


@compiled
def _carry_state_back(a: FloatArray, F: FloatArray) -> None:
    """a <- F' a, shape (6,), with the zeros of the transition F left out."""
    position, velocity, tilt, drift = a[0], a[1], a[2], a[3]
    for j in range(1, 3):
        a[j] = F[0, j] * position + F[1, j] * velocity + F[2, j] * tilt
    for j in range(3, 6):
        carried = F[0, j] * position + F[1, j] * velocity + F[2, j] * tilt
        a[j] = carried + (F[5, 5] * a[5] if j == 5 else a[j])
    a[4] += F[3, 4] * drift


@compiled
def run_smoother(
    step: Int64Array,
    transitions: FloatArray,
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    y: FloatArray,
    S: FloatArray,
    state: Marks,
    first: int,
    last: int,
    xs: FloatArray,
    variance: FloatArray,
) -> None:
    """Smooth epochs ``first`` to ``last`` with all data in between and no later ones (fixed interval).

    The Bryson-Frazier form of the Rauch-Tung-Striebel smoother: no covariance is inverted, so that states which the
    data do not see do no harm.

    Parameters
    ----------
    step, transitions, x, P, K, y, S, state
        As :func:`run_filter` had and filled them.
    xs, variance : ndarrays, shapes (n, 6, c), (n, 6)
        Filled from ``first`` to ``last``: smoothed states and the variances of each.

    Source: Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18, 1973, equations 8-13.
    """
    channels = x.shape[2]
    a = np.zeros((channels, 6))  # lambda of the book
    A, B = np.zeros((6, 6)), np.zeros((6, 6))  # Lambda of the book, and room
    h = np.zeros(6)
    for k in range(last, first - 1, -1):
        for i in range(6):
            total = P[k, i, i]
            for j in range(6):  # A is symmetric: twice its upper half
                inner = A[j, j] * P[k, i, j]
                for e in range(j + 1, 6):
                    inner += 2.0 * A[j, e] * P[k, i, e]
                total -= P[k, i, j] * inner
            variance[k, i] = total
            for c in range(channels):
                back = x[k, i, c]
                for j in range(6):
                    back -= P[k, i, j] * a[c, j]
                xs[k, i, c] = back
        if k == first:
            break
        for m in range(1, -1, -1):
            if state[k, m] != USED:
                continue
            s = S[k, m]
            for c in range(channels):
                total = 0.0
                for i in range(6):
                    total += K[k, m, i] * a[c, i]
                a[c, m] -= total + y[k, m, c] / s
            _absorb(A, K[k, m], s, m, h)
        F = transitions[step[k]]
        for c in range(channels):
            _carry_state_back(a[c], F)
        _carry_back(A, F, B)


@compiled
def run_fixed_lag(
    step: Int64Array,
    transitions: FloatArray,
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    y: FloatArray,
    S: FloatArray,
    state: Marks,
    first: Int64Array,
    last: Int64Array,
    past: FloatArray,
) -> None:
    """Smooth epoch ``first[i]`` with the data up to ``last[i]``, for each i: the state alone, one channel.

    Parameters
    ----------
    step, transitions, K, S, state
        As :func:`run_filter` had and filled them.
    x, P, y : ndarrays, shapes (n, 6), (n, 6, 6), (n, 2)
        Of one channel.
    first, last : ndarrays of int, shape (s,)
    past : ndarray, shape (s, 6)
        Filled.
    """
    a = np.zeros(6)
    for s in range(len(first)):
        for i in range(6):
            a[i] = 0.0
        for k in range(last[s], first[s], -1):
            for m in range(1, -1, -1):
                if state[k, m] == USED:
                    total = y[k, m] / S[k, m]
                    for i in range(6):
                        total += K[k, m, i] * a[i]
                    a[m] -= total
            _carry_state_back(a, transitions[step[k]])
        k = first[s]
        for i in range(6):
            total = x[k, i]
            for j in range(6):
                total -= P[k, i, j] * a[j]
            past[s, i] = total


@compiled
def run_lag_covariance(
    step: Int64Array,
    transitions: FloatArray,
    P: FloatArray,
    K: FloatArray,
    S: FloatArray,
    state: Marks,
    first: Int64Array,
    last: Int64Array,
    smoothed: FloatArray,
    closed: FloatArray,
) -> None:
    """Covariance of epoch ``first[i]`` given the data up to ``last[i]``, and how errors travel between, for each i.

    Parameters
    ----------
    step, transitions, P, K, S, state
        As :func:`run_filter` had and filled them.
    first, last : ndarrays of int, shape (s,)
    smoothed : ndarray, shape (s, 6, 6)
        Filled: P at first - P Lambda P (Bierman, 1973).
    closed : ndarray, shape (s, 6, 6)
        Filled: product of (I - K H) Phi from first to last: error at last that an error at first leaves.
    """
    A, B = np.zeros((6, 6)), np.zeros((6, 6))
    C, h = np.zeros((6, 6)), np.zeros(6)
    for s in range(len(first)):
        for i in range(6):
            for j in range(6):
                A[i, j] = 0.0
                C[i, j] = 1.0 if i == j else 0.0  # rows of the closed loop, built from its end
        for k in range(last[s], first[s], -1):
            for m in range(1, -1, -1):
                if state[k, m] != USED:
                    continue
                _absorb(A, K[k, m], S[k, m], m, h)
                for j in range(6):
                    total = 0.0
                    for i in range(6):
                        total += K[k, m, i] * C[j, i]
                    C[j, m] -= total
            F = transitions[step[k]]
            _carry_back(A, F, B)
            for i in range(6):
                _carry_state_back(C[i], F)
        k = first[s]
        for i in range(6):
            for j in range(6):
                closed[s, i, j] = C[i, j]
                total = 0.0
                for e in range(6):
                    total += A[i, e] * P[k, e, j]
                B[i, j] = total
        for i in range(6):
            for j in range(6):
                total = P[k, i, j]
                for e in range(6):
                    total -= P[k, i, e] * B[e, j]
                smoothed[s, i, j] = total
