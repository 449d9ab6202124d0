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
def run_filter(
    step: Int64Array,
    transitions: FloatArray,
    noises: FloatArray,
    z: FloatArray,
    drive: FloatArray,
    push: FloatArray,
    reset: FloatArray,
    x0: FloatArray,
    P0: FloatArray,
    R: FloatArray,
    believed: FloatArray,
    gate: float,
    patience: Int64Array,
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    y: FloatArray,
    S: FloatArray,
    state: Marks,
) -> int:
    """Run the Kalman filter over epochs; sequential scalar updates in Joseph form.

    Parameters
    ----------
    step : ndarray of int, shape (n,)
        Which transition leads to each epoch; the first is not used.
    transitions, noises : ndarrays, shape (m, 6, 6)
        Phi and Q of each distinct interval.
    z : ndarray, shape (n, 2, c)
        Measurements of position and velocity error per channel, NaN where absent (in any channel: in all).
    drive : ndarray, shape (n, c, c)
        Share of its position error by which that of channel i is dragged by channel j in the step (transport).
    push : ndarray, shape (n, c)
        Metres by which the position error grows in the step besides.
    reset : ndarray, shape (n, 2)
        Variance added to position and velocity before the epoch (an INS reset); 0 elsewhere.
    x0, P0 : ndarrays, shapes (6, c), (6, 6)
    R, believed : ndarrays, shape (2,)
        Variances of the measurements, as they are weighted and as single ones are believed to err.
    gate : float
        A measurement is rejected where y^2 exceeds so many times its variance with ``believed``, in any channel.
    patience : ndarray of int, shape (2,)
        So many rejections in a row of one kind, and it is the filter that is wrong: the state that was measured is
        opened by the square of the innovation.
    x, P : ndarrays, shapes (n, 6, c), (n, 6, 6)
        Filled: states and covariance after the update.
    K, y, S : ndarrays, shapes (n, 2, 6), (n, 2, c), (n, 2)
        Filled: gains, innovations, their variances.
    state : ndarray of int8, shape (n, 2)
        Filled: rejected -1, absent 0, used 1.

    Returns
    -------
    int
        How often the filter was opened again.

    Source: Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V (Joseph's form).
    """
    n, channels = z.shape[0], z.shape[2]
    p, w = P0.copy(), np.zeros((6, 6))
    now, new = x0.copy(), np.zeros((6, channels))
    in_a_row, reopened = np.zeros(2, dtype=np.int64), 0
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
            for c in range(channels):
                new[0, c] += push[k, c]
                for j in range(channels):
                    new[0, c] += drive[k, c, j] * now[0, j]
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
            s = p[m, m] + R[m]
            S[k, m] = s
            is_good = True
            for c in range(channels):
                if y[k, m, c] * y[k, m, c] > gate * (p[m, m] + believed[m]):
                    is_good = False
            if is_good:
                in_a_row[m] = 0
            else:
                in_a_row[m] += 1
                if in_a_row[m] > patience[m]:
                    for c in range(channels):
                        p[m, m] += y[k, m, c] * y[k, m, c]
                    s = p[m, m] + R[m]
                    S[k, m] = s
                    in_a_row[:] = 0
                    reopened += 1
                    is_good = True
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
            # Joseph: V = (I - K H) p, then V (I - K H)' + K R K', for H of the single state m. Of V a row and a column
            # are needed again: w[0] is row m of p, w[1] column m of V.
            rest = 1.0 - K[k, m, m]
            for i in range(6):
                w[0, i] = p[m, i]
                w[1, i] = p[i, m] - K[k, m, i] * p[m, m]
            w[1, m] = rest * p[m, m]
            for i in range(6):
                gain = K[k, m, i]
                for j in range(i, 6):
                    total = p[i, j] - gain * w[0, j] - (w[1, i] - gain * R[m]) * K[k, m, j]
                    p[i, j] = total
                    p[j, i] = total
            # the variance measured: a product where a difference of nearly equal numbers stood
            p[m, m] = w[1, m] * rest + K[k, m, m] * R[m] * K[k, m, m]
        for i in range(6):
            for c in range(channels):
                x[k, i, c] = now[i, c]
            for j in range(6):
                P[k, i, j] = p[i, j]
    return reopened


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
