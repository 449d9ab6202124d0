"""Compiled loops of the channel filter and its smoother. Letters as in the books; shapes stand in each docstring.

Both channels share one covariance: it depends on the times and on which measurements were used, not on their values.
An outlier is therefore judged for both channels together and used or left out in both.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import compiled
from groundstation.base.records import Int64Array
from groundstation.estimators.inertial.model import FloatArray

REJECTED, ABSENT, USED = -1, 0, 1

Marks = NDArray[np.int8]


@compiled
def run_filter(
    step: Int64Array,
    transitions: FloatArray,
    noises: FloatArray,
    z: FloatArray,
    drive: FloatArray,
    reset: FloatArray,
    x0: FloatArray,
    P0: FloatArray,
    R: FloatArray,
    gate: float,
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    y: FloatArray,
    S: FloatArray,
    state: Marks,
) -> None:
    """Run the Kalman filter over epochs; sequential scalar updates in Joseph form.

    Parameters
    ----------
    step : ndarray of int, shape (n,)
        Which transition leads to each epoch; the first is not used.
    transitions, noises : ndarrays, shape (m, 6, 6)
        Phi and Q of each distinct interval.
    z : ndarray, shape (n, 2, c)
        Measurements of position and velocity error per channel, NaN where absent (in any channel: in all).
    drive : ndarray, shape (n, 2, 2)
        Known rates (1/s) by which the position error of channel i is dragged by that of channel j (transport).
    reset : ndarray, shape (n, 2)
        Variance added to position and velocity before the epoch (an INS reset); 0 elsewhere.
    x0, P0 : ndarrays, shapes (6, c), (6, 6)
    R : ndarray, shape (n, 2)
        Variances of the measurements.
    gate : float
        An epoch's measurement is rejected where y^2 / S exceeds it in any channel.
    x, P : ndarrays, shapes (n, 6, c), (n, 6, 6)
        Filled: states and covariance after the update.
    K, y, S : ndarrays, shapes (n, 2, 6), (n, 2, c), (n, 2)
        Filled: gains, innovations, their variances.
    state : ndarray of int8, shape (n, 2)
        Filled: rejected -1, absent 0, used 1.

    Source: Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V (Joseph's form).
    """
    n, channels = z.shape[0], z.shape[2]
    p, w = P0.copy(), np.zeros((6, 6))
    now, new = x0.copy(), np.zeros((6, channels))
    for k in range(n):
        if k > 0:
            F, Q = transitions[step[k]], noises[step[k]]
            for c in range(channels):
                for i in range(3):  # rows of position, velocity and tilt; the drifts follow
                    total = F[i, i] * now[i, c]
                    for j in range(1, 6):
                        if j != i:
                            total += F[i, j] * now[j, c]
                    new[i, c] = total
                new[3, c] = now[3, c] + F[3, 4] * now[4, c]
                new[4, c] = now[4, c]
                new[5, c] = F[5, 5] * now[5, c]
            if channels == 2:
                for c in range(2):
                    new[0, c] += drive[k, c, 0] * now[0, 0] + drive[k, c, 1] * now[0, 1]
            for c in range(channels):
                for i in range(6):
                    now[i, c] = new[i, c]
            for j in range(6):  # w = F p, with the zeros of F left out
                for i in range(3):
                    total = F[i, 1] * p[1, j] + F[i, 2] * p[2, j] + F[i, 3] * p[3, j]
                    total += F[i, 4] * p[4, j] + F[i, 5] * p[5, j]
                    if i == 0:
                        total += p[0, j]
                    w[i, j] = total
                w[3, j] = p[3, j] + F[3, 4] * p[4, j]
                w[4, j] = p[4, j]
                w[5, j] = F[5, 5] * p[5, j]
            for i in range(6):  # p = w F' + Q, upper half
                for j in range(i, 6):
                    if j < 3:
                        total = w[i, 1] * F[j, 1] + w[i, 2] * F[j, 2] + w[i, 3] * F[j, 3]
                        total += w[i, 4] * F[j, 4] + w[i, 5] * F[j, 5]
                        if j == 0:
                            total += w[i, 0]
                    elif j == 3:
                        total = w[i, 3] + w[i, 4] * F[3, 4]
                    elif j == 4:
                        total = w[i, 4]
                    else:
                        total = w[i, 5] * F[5, 5]
                    total += Q[i, j]
                    p[i, j] = total
                    p[j, i] = total
        p[0, 0] += reset[k, 0]
        p[1, 1] += reset[k, 1]
        for m in range(2):
            state[k, m] = ABSENT
            S[k, m] = np.nan
            is_there = True
            for c in range(channels):
                y[k, m, c] = z[k, m, c] - now[m, c]
                if not np.isfinite(y[k, m, c]):
                    is_there = False
            if not is_there:
                for i in range(6):
                    K[k, m, i] = 0.0
                continue
            s = p[m, m] + R[k, m]
            S[k, m] = s
            is_good = True
            for c in range(channels):
                if y[k, m, c] * y[k, m, c] > gate * s:
                    is_good = False
            if not is_good:
                state[k, m] = REJECTED
                for i in range(6):
                    K[k, m, i] = 0.0
                continue
            state[k, m] = USED
            for i in range(6):
                K[k, m, i] = p[i, m] / s
            for c in range(channels):
                for i in range(6):
                    now[i, c] += K[k, m, i] * y[k, m, c]
            # Joseph: (I - K H) p (I - K H)' + K R K', written out for H of a single one; w holds row m.
            for i in range(6):
                w[0, i] = p[m, i]
            for i in range(6):
                for j in range(i, 6):
                    total = p[i, j] - K[k, m, i] * w[0, j] - K[k, m, j] * w[0, i] + K[k, m, i] * K[k, m, j] * s
                    p[i, j] = total
                    p[j, i] = total
        for i in range(6):
            for c in range(channels):
                x[k, i, c] = now[i, c]
            for j in range(6):
                P[k, i, j] = p[i, j]


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
    a, b = np.zeros((6, channels)), np.zeros((6, channels))  # lambda of the book, and room
    A, B = np.zeros((6, 6)), np.zeros((6, 6))  # Lambda of the book, and room
    h = np.zeros(6)
    for k in range(last, first - 1, -1):
        for i in range(6):
            total = P[k, i, i]
            for j in range(6):
                h[j] = 0.0
                for e in range(6):
                    h[j] += A[j, e] * P[k, e, i]
            for j in range(6):
                total -= P[k, i, j] * h[j]
            variance[k, i] = total
            for c in range(channels):
                back = x[k, i, c]
                for j in range(6):
                    back -= P[k, i, j] * a[j, c]
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
                    total += K[k, m, i] * a[i, c]
                a[m, c] -= total + y[k, m, c] / s
            # A = (I - K H)' A (I - K H) + H' H / s: only row and column m change
            dot = 0.0
            for i in range(6):
                h[i] = 0.0
                for j in range(6):
                    h[i] += A[i, j] * K[k, m, j]
            for i in range(6):
                dot += K[k, m, i] * h[i]
            corner = A[m, m] - 2.0 * h[m] + dot + 1.0 / s
            for i in range(6):
                A[i, m] -= h[i]
                A[m, i] = A[i, m]
            A[m, m] = corner
        F = transitions[step[k]]
        for c in range(channels):
            for j in range(6):
                total = 0.0
                for i in range(6):
                    total += F[i, j] * a[i, c]
                b[j, c] = total
            for j in range(6):
                a[j, c] = b[j, c]
        for i in range(6):
            for j in range(6):
                total = 0.0
                for e in range(6):
                    total += A[i, e] * F[e, j]
                B[i, j] = total
        for i in range(6):
            for j in range(i, 6):
                total = 0.0
                for e in range(6):
                    total += F[e, i] * B[e, j]
                A[i, j] = total
                A[j, i] = total


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
    a, b = np.zeros(6), np.zeros(6)
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
            F = transitions[step[k]]
            b[0] = a[0]
            for j in range(1, 6):
                b[j] = F[0, j] * a[0] + F[1, j] * a[1] + F[2, j] * a[2]
            a[0], a[1], a[2] = b[0], b[1], b[2]
            a[4] = b[4] + F[3, 4] * a[3] + a[4]
            a[3] += b[3]
            a[5] = b[5] + F[5, 5] * a[5]
        k = first[s]
        for i in range(6):
            total = x[k, i]
            for j in range(6):
                total -= P[k, i, j] * a[j]
            past[s, i] = total


@compiled
def run_forecast(
    starts: FloatArray,
    transition: FloatArray,
    is_held: bool,
    drag: FloatArray,
    known: FloatArray,
    every: int,
    built_up: FloatArray,
) -> None:
    """Forecast from each start in equal steps; the position error is dragged over the sphere as the aircraft flies.

    Parameters
    ----------
    starts : ndarray, shape (s, 6, c)
    transition : ndarray, shape (6, 6)
        Phi of one step.
    is_held : bool
        The velocity is held and the model not used.
    drag : ndarray, shape (s, steps, 2, 2)
        Known rates times the step, along the flight of each start.
    known : ndarray, shape (s, c)
        Position error at the start, metres.
    every : int
        Steps between two leads that are kept.
    built_up : ndarray, shape (s, leads, c)
        Filled: position error built up since the start, metres. As many steps as it has room for.
    """
    channels, leads = starts.shape[2], built_up.shape[1]
    F, seconds = transition, 0.0
    if is_held:
        seconds = transition[3, 4]
    x, new, before = np.zeros((6, channels)), np.zeros((3, channels)), np.zeros(channels)
    for s in range(len(starts)):
        for c in range(channels):
            for i in range(6):
                x[i, c] = starts[s, i, c]
        for lead in range(leads):
            for part in range(every):
                k = lead * every + part
                for c in range(channels):
                    before[c] = known[s, c] + x[0, c]
                    if is_held:
                        x[0, c] += x[1, c] * seconds
                        continue
                    for i in range(3):
                        total = F[i, 1] * x[1, c] + F[i, 2] * x[2, c] + F[i, 3] * x[3, c]
                        total += F[i, 4] * x[4, c] + F[i, 5] * x[5, c]
                        new[i, c] = total
                    x[0, c] += new[0, c]
                    x[1, c], x[2, c] = new[1, c], new[2, c]
                    x[3, c] += F[3, 4] * x[4, c]
                    x[5, c] *= F[5, 5]
                if channels == 2:
                    for c in range(2):
                        x[0, c] += drag[s, k, c, 0] * before[0] + drag[s, k, c, 1] * before[1]
            for c in range(channels):
                built_up[s, lead, c] = x[0, c]


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
                C[i, j] = 1.0 if i == j else 0.0  # the transpose of the closed loop, built from its end
        for k in range(last[s], first[s], -1):
            for m in range(1, -1, -1):
                if state[k, m] != USED:
                    continue
                dot = 0.0
                for i in range(6):
                    h[i] = 0.0
                    for j in range(6):
                        h[i] += A[i, j] * K[k, m, j]
                for i in range(6):
                    dot += K[k, m, i] * h[i]
                corner = A[m, m] - 2.0 * h[m] + dot + 1.0 / S[k, m]
                for i in range(6):
                    A[i, m] -= h[i]
                    A[m, i] = A[i, m]
                A[m, m] = corner
                for j in range(6):
                    total = 0.0
                    for i in range(6):
                        total += K[k, m, i] * C[i, j]
                    C[m, j] -= total
            F = transitions[step[k]]
            for i in range(6):
                for j in range(6):
                    total, other = 0.0, 0.0
                    for e in range(6):
                        total += A[i, e] * F[e, j]
                        other += F[e, i] * C[e, j]
                    B[i, j] = total
                    smoothed[s, i, j] = other
            for i in range(6):
                for j in range(6):
                    C[i, j] = smoothed[s, i, j]
                for j in range(i, 6):
                    total = 0.0
                    for e in range(6):
                        total += F[e, i] * B[e, j]
                    A[i, j] = total
                    A[j, i] = total
        k = first[s]
        for i in range(6):
            for j in range(6):
                closed[s, i, j] = C[j, i]
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
