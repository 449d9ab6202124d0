"""Compiled loops of the coupled model: filter and forecast with a sparse matrix that changes along the flight.

The pattern of the matrix is fixed (``rows``, ``columns``), its values come with each interval.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import compiled
from groundstation.base.records import Int64Array
from groundstation.estimators.inertial.model import FloatArray

SIZE = 14
LONGEST_STEP_S = 10.0  # (Earth and Schuler rate x step)^5 / 120: below 1e-10 of the state
REJECTED, ABSENT, USED = -1, 0, 1


@compiled
def exponential(rows: Int64Array, columns: Int64Array, values: FloatArray, seconds: float, E: FloatArray) -> None:
    """Fill E, shape (14, 14), with exp(A t) to the fourth order; A sparse, ``values`` at ``rows``, ``columns``."""
    B = np.zeros((14, 14))
    for i in range(14):
        for j in range(14):
            E[i, j] = 0.0
        E[i, i] = 1.0
    for order in range(4, 0, -1):  # Horner: E = I + A t / order E
        for i in range(14):
            for j in range(14):
                B[i, j] = 0.0
        factor = seconds / order
        for e in range(len(values)):
            i, r, a = rows[e], columns[e], values[e] * factor
            for j in range(14):
                B[i, j] += a * E[r, j]
        for i in range(14):
            for j in range(14):
                E[i, j] = B[i, j]
            E[i, i] += 1.0


@compiled
def _update(now: FloatArray, p: FloatArray, h: int, residual: float, R: float, K: FloatArray, w: FloatArray) -> None:
    """Update states and covariance with a measurement of the single state h; ``K``, ``w`` are room."""
    s = p[h, h] + R
    for i in range(14):
        K[i] = p[i, h] / s
        now[i] += K[i] * residual
    for i in range(14):  # Joseph: w = (I - K H) p, then w (I - K H)' + K R K'
        for j in range(14):
            w[i, j] = p[i, j] - K[i] * p[h, j]
    for j in range(14):
        w[h, j] = (1.0 - K[h]) * p[h, j]
    for i in range(14):
        for j in range(i, 14):
            kept = w[i, j] - w[i, h] * K[j]
            if j == h:
                kept = w[i, h] * (1.0 - K[h])
            total = kept + K[i] * R * K[j]
            p[i, j] = total
            p[j, i] = total


@compiled
def _open(p: FloatArray, variances: FloatArray) -> None:
    """Add variances to position and velocity of both channels."""
    for m in range(2):
        p[m, m] += variances[m]
        p[6 + m, 6 + m] += variances[m]


@compiled
def run_coupled_filter(
    interval_s: FloatArray,
    rows: Int64Array,
    columns: Int64Array,
    values: FloatArray,
    density: FloatArray,
    z: FloatArray,
    reset: FloatArray,
    P0: FloatArray,
    R: FloatArray,
    believed: FloatArray,
    gate: float,
    patience: Int64Array,
    opened: FloatArray,
    x: FloatArray,
    variance: FloatArray,
    y: FloatArray,
    S: FloatArray,
    state: NDArray[np.int8],
) -> int:
    """Run the Kalman filter over epochs; sequential scalar updates in Joseph form.

    Parameters
    ----------
    interval_s : ndarray, shape (n,)
        Since the epoch before; sub-stepped at 10 s or less, the process noise half before and half after a step.
    rows, columns : ndarrays of int, shape (m,)
    values : ndarray, shape (n, m)
        Entries of A over the interval before each epoch.
    density : ndarray, shape (14,)
        Power spectral densities of the white noises.
    z : ndarray, shape (n, 2, 2)
        Measurements (position, velocity; north, east), NaN where absent.
    reset : ndarray, shape (n, 2)
        Variance added to position and velocity before the epoch.
    P0 : ndarray, shape (14, 14)
        The state at the first epoch is zero.
    R, believed : ndarrays, shape (2,)
        Variances of position and velocity measurements, as they are weighted and as single ones are believed to err.
    gate : float
        Both channels' measurement is rejected where y^2 exceeds so many times its variance with ``believed`` in one.
    patience : ndarray of int, shape (2,)
        So many rejections in a row of one kind, and it is the filter that is wrong: it is opened again.
    opened : ndarray, shape (2,)
        Variance then added to position and velocity.
    x, variance : ndarrays, shape (n, 14)
        Filled: states and their variances after the update.
    y, S : ndarrays, shape (n, 2, 2)
        Filled: innovations and their variances, as predicted from the epoch before.
    state : ndarray of int8, shape (n, 2, 2)
        Filled: rejected -1, absent 0, used 1.

    Returns
    -------
    int
        How often the filter was opened again.

    Source: Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V (Joseph's form).
    """
    p, w, E = P0.copy(), np.zeros((14, 14)), np.eye(14)
    now, new, K = np.zeros(14), np.zeros(14), np.zeros(14)
    in_a_row, reopened = np.zeros(2, dtype=np.int64), 0
    for k in range(z.shape[0]):
        if k > 0:
            parts = max(1, int(np.ceil(interval_s[k] / LONGEST_STEP_S - 1e-9)))
            seconds = interval_s[k] / parts
            exponential(rows, columns, values[k], seconds, E)
            for _ in range(parts):
                for i in range(14):
                    p[i, i] += 0.5 * seconds * density[i]
                    for j in range(14):
                        w[i, j] = 0.0
                    new[i] = 0.0
                for i in range(14):
                    for r in range(14):
                        a = E[i, r]
                        if a != 0.0:
                            new[i] += a * now[r]
                            for j in range(14):
                                w[i, j] += a * p[r, j]
                for i in range(14):
                    now[i] = new[i]
                for j in range(14):
                    for i in range(j + 1):
                        p[i, j] = 0.0
                    for r in range(14):
                        a = E[j, r]
                        if a != 0.0:
                            for i in range(j + 1):
                                p[i, j] += a * w[i, r]
                    for i in range(j + 1):
                        p[j, i] = p[i, j]
                for i in range(14):
                    p[i, i] += 0.5 * seconds * density[i]
        _open(p, reset[k])
        for m in range(2):
            is_there, is_good = False, True
            for c in range(2):
                i = 6 * c + m
                y[k, m, c] = z[k, m, c] - now[i]
                S[k, m, c] = p[i, i] + R[m]
                state[k, m, c] = ABSENT
                if np.isfinite(y[k, m, c]):
                    state[k, m, c] = USED
                    is_there = True
                    if y[k, m, c] * y[k, m, c] > gate * (p[i, i] + believed[m]):
                        is_good = False
                else:
                    y[k, m, c], S[k, m, c] = np.nan, np.nan
            if is_there and is_good:
                in_a_row[m] = 0
            elif not is_good:
                in_a_row[m] += 1
                if in_a_row[m] > patience[m]:
                    _open(p, opened)
                    for c in range(2):
                        if state[k, m, c] != ABSENT:
                            S[k, m, c] = p[6 * c + m, 6 * c + m] + R[m]
                    in_a_row[:] = 0
                    reopened += 1
                    is_good = True
            for c in range(2):
                if state[k, m, c] == ABSENT:
                    continue
                if not is_good:
                    state[k, m, c] = REJECTED
                    continue
                h = 6 * c + m
                _update(now, p, h, z[k, m, c] - now[h], R[m], K, w)
        for i in range(14):
            x[k, i] = now[i]
            variance[k, i] = p[i, i]
    return reopened


@compiled
def run_coupled_forecast(
    start: FloatArray,
    known: FloatArray,
    rows: Int64Array,
    columns: Int64Array,
    values: FloatArray,
    step_s: float,
    every: int,
    built_up: FloatArray,
) -> None:
    """Forecast one start in equal steps of 10 s or less along the INS's own motion.

    Parameters
    ----------
    start : ndarray, shape (14,)
        Its position is not used.
    known : ndarray, shape (2,)
        Position error at the start, metres.
    rows, columns, values
        Pattern (m,) and entries (steps, m) of A over each step.
    every : int
        Steps between two leads that are kept.
    built_up : ndarray, shape (leads, 2)
        Filled: position error built up since the start, metres.
    """
    x, term, new = start.copy(), np.zeros(14), np.zeros(14)
    x[0], x[6] = known[0], known[1]
    for lead in range(built_up.shape[0]):
        for part in range(every):
            k = lead * every + part
            for i in range(14):
                term[i] = x[i]
            for order in range(1, 5):
                for i in range(14):
                    new[i] = 0.0
                for e in range(values.shape[1]):
                    new[rows[e]] += values[k, e] * term[columns[e]]
                for i in range(14):
                    term[i] = new[i] * step_s / order
                    x[i] += term[i]
        built_up[lead, 0] = x[0] - known[0]
        built_up[lead, 1] = x[6] - known[1]
