"""Compiled loops of the channel filter and of the forecast. Letters as in the books; shapes stand in each docstring.

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
