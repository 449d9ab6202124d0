"""Compiled loop of the approach: an extended filter over the measurements.

It is linearised about its own estimate.
"""

import numpy as np

from groundstation.base.compile import compiled
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.arrays import FloatArray, Pattern, States
from groundstation.methods.kalman.kernels import (
    add_noise,
    correct_states,
    predict_covariance,
    predict_states,
    update_covariance,
)


@compiled
def filter_approach(
    states: States,
    pattern: Pattern,
    F: FloatArray,
    noise_rows: Int64Array,
    noise_columns: Int64Array,
    Q: FloatArray,
    columns: Int64Array,
    has_place: Int64Array,
    slow: int,
    reading_m: FloatArray,
    reference_m: FloatArray,
    reference_p: FloatArray,
    is_curved: bool,
    points_m: FloatArray,
    range_m: FloatArray,
    variance_m2: float,
    x: FloatArray,
    p: FloatArray,
    every: int,
    place_x: FloatArray,
    place_p: FloatArray,
    innovation: FloatArray,
    height: FloatArray,
) -> None:
    """Filter one approach.

    Parameters
    ----------
    columns : ndarray of int, shape (w,)
        States of a row: along, right, up, clock; along, right, up of the moving point; slow error of the point, which
        is put in for each. Those that do not exist have their coefficient 0.
    has_place : ndarray of int, shape (k,)
        1 where the point's own place is estimated.
    slow : int
        First slow error, -1: none.
    reading_m : ndarray, shape (n, 3)
        INS and barometric readings of the place.
    reference_m : ndarray, shape (n, 3)
        Errors of those readings about which a range is linearised; NaN: about the filter's own estimate.
    reference_p : ndarray, shape (3, 3)
        How wrong those may be.
    is_curved : bool
        Whether terms of second order enter.
    points_m : ndarray, shape (n, k, 3)
        Known or reported places of the points.
    range_m : ndarray, shape (n, k)
        NaN where there is none.
    x, p : ndarrays, shapes (1, s), (s, s)
        Start; changed.
    place_x, place_p : ndarrays, shapes (n // every + 1, 3), (n // every + 1, 3, 3)
        Filled: estimated errors of the place and their covariance after each ``every``-th epoch.
    innovation : ndarray, shape (n, k)
        Filled: over its sigma.
    height : ndarray, shape (n, 2)
        Filled: estimated error of the height and its variance after every epoch.

    Notes
    -----
    Range = |place - point| + clock + slow error. Its second derivative across the line, (I - u u') / range, times the
    covariance of the line about which it is linearised, c, gives mean tr(c) / 2 and variance tr(c c) / 2 of what the
    linear term leaves out; both enter (Gaussian filter of second order: Jazwinski, Stochastic Processes and Filtering
    Theory, 1970, section 9.3).
    """
    n, count = range_m.shape
    w, g, gain = p * 0.0, x[0] * 0.0, x[0] * 0.0
    h: FloatArray = np.zeros(len(columns))
    c = place_p[0] * 0.0
    for k in range(n):
        if k > 0:
            predict_states(states, pattern, F, 0, x, w)
            predict_covariance(states, pattern, F, 0, p, w)
            add_noise(states, noise_rows, noise_columns, Q, 0, p)
        is_own = reference_m[k, 0] != reference_m[k, 0]
        for i in range(count):
            moves = has_place[i] == 1
            square = 0.0
            for a in range(3):
                about = x[0, columns[a]] if is_own else reference_m[k, a]
                line = reading_m[k, a] - about - points_m[k, i, a]
                if moves:
                    line += x[0, columns[4 + a]]
                h[a] = line
                square += line * line
            distance = square**0.5
            for a in range(3):
                h[a] = h[a] / distance
            mean, spread = 0.0, 0.0
            if not is_own:
                for a in range(3):
                    mean -= h[a] * (x[0, columns[a]] - reference_m[k, a])
            for a in range(3 if is_curved else 0):  # c = (I - u u') P / distance
                for b in range(3):
                    total = 0.0
                    for e in range(3):
                        across = (1.0 if a == e else 0.0) - h[a] * h[e]
                        spread_of = p[columns[e], columns[b]] if is_own else reference_p[e, b]
                        if moves:
                            spread_of += p[columns[4 + e], columns[4 + b]]
                            if is_own:
                                spread_of -= p[columns[e], columns[4 + b]] + p[columns[4 + e], columns[b]]
                        total += across * spread_of
                    c[a, b] = total / distance
            for a in range(3 if is_curved else 0):
                mean += 0.5 * c[a, a]
                for b in range(3):
                    spread += 0.5 * c[a, b] * c[b, a]
            for a in range(3):
                h[4 + a] = h[a] if moves else 0.0
                h[a] = -h[a]
            h[3] = 1.0
            expected = distance + mean + x[0, columns[3]]
            h[7] = 0.0
            if slow >= 0:
                columns[7] = slow + i
                h[7] = 1.0
                expected += x[0, slow + i]
            y = range_m[k, i] - expected
            innovation[k, i] = y
            if y == y:
                s = update_covariance(states, columns, h, 0, 8, variance_m2 + spread, has_place[:0], p, g, gain)
                correct_states(states, gain, y, x, 0)
                innovation[k, i] = y / s**0.5
        height[k, 0], height[k, 1] = x[0, columns[2]], p[columns[2], columns[2]]
        if k % every == 0:
            for a in range(3):
                place_x[k // every, a] = x[0, columns[a]]
                for b in range(3):
                    place_p[k // every, a, b] = p[columns[a], columns[b]]


@compiled
def smooth_walk(height: FloatArray, step_variance: float) -> None:
    """Smooth the estimates of a random walk in place, as if it were alone.

    Shape (n, 2): estimate and variance.

    Source: Rauch, Tung and Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3(8), 1965.
    """
    for k in range(len(height) - 2, -1, -1):
        share = height[k, 1] / (height[k, 1] + step_variance)
        height[k, 0] += share * (height[k + 1, 0] - height[k, 0])
