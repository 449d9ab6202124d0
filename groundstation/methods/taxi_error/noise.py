"""Likelihood of heading differences and standstill velocities, by a Kalman filter.

One noise model holds for both.

The model, in words. At standstill each component of the GNSS velocity is white noise plus a first-order
Gauss-Markov process. On taxi the same processes, turned across the track and divided by the speed, stand in the
difference d = INS heading - track, beside the sway of the airframe (a noise-driven damped oscillator), white
heading noise, the error looked for and, where asked, an antenna arm:

    d_i = error + arm * (-omega_i / V_i) + segment + wander(t_i) + sway(t_i)
          + (sin(track) g_N - cos(track) g_E) / V_i + white_i

Each segment has an error of its own, and INS heading minus path wanders (a first-order Gauss-Markov process): what
segments and minutes say against each other is in the sizes of the two.

Everything is linear and Gaussian, samples may come at any times, and what counts for the error of a mean, the
spectral density at zero frequency, is that of the model. The regression coefficients are found by generalised least
squares: data and regressors pass through one filter (the augmented filter).

Source: P. de Jong, The diffuse Kalman filter, Annals of Statistics 19 (1991), section 2; A. C. Harvey, Forecasting,
Structural Time Series Models and the Kalman Filter, 1989, sections 3.4 and 9.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, inlined

FloatArray = NDArray[np.float64]

# Parameters, all as natural logarithms, in this order.
WHITE, CORRELATED, TAU, SWAY, FREQUENCY, DAMPING, HEADING_WHITE, MOTION, SEGMENT, WANDER, WANDER_TAU = range(11)
PARAMETER_NAMES = (
    "white_mps",
    "correlated_mps",
    "correlation_s",
    "sway_deg",
    "sway_hz",
    "sway_damping",
    "heading_white_deg",
    "motion_factor",  # correlated GNSS error in motion over that at standstill
    "segment_deg",  # error that each segment has of its own
    "wander_deg",  # slow wander of INS heading minus path
    "wander_s",
)
STATES = 6  # GNSS north and east (m/s), sway (deg), sway rate (deg/s), own error of the segment, wander (deg)
DAMPING_MAX = 0.99
_LOG_2PI = math.log(2.0 * math.pi)


class Room(NamedTuple):
    """Working arrays of the loops, made once for many calls.

    So the loops make no array, and are found again without numba. The arrays of ``taxi_filter`` are q, P, x, K, H, the
    sums of products, innovations, decays and F; those of ``solve_normal_equations`` are the matrix beside its inverse
    and the right side; the others are what ``evaluate`` hands from one to the other.
    """

    q: FloatArray  # (STATES,)
    P: FloatArray  # (STATES, STATES)
    x: FloatArray  # (c, STATES)
    K: FloatArray  # (STATES,)
    H: FloatArray  # (STATES,)
    total: FloatArray  # (c, c)
    innovation: FloatArray  # (c,)
    keep: FloatArray  # (STATES,)
    F: FloatArray  # (2, 2)
    matrix: FloatArray  # (c - 1, 2 (c - 1))
    right: FloatArray  # (c - 1,)
    start: FloatArray  # (3,)
    information: FloatArray  # (checkpoints, c, c)
    history: FloatArray  # (0, 1 + STATES)
    mean: FloatArray  # (c - 1,)
    inverse: FloatArray  # (c - 1, c - 1)


def room_for(width: int, checkpoints: int = 1) -> Room:
    """Make working arrays for ``width`` columns, data and regressors."""
    rest = width - 1
    return Room(
        q=np.zeros(STATES),
        P=np.zeros((STATES, STATES)),
        x=np.zeros((width, STATES)),
        K=np.zeros(STATES),
        H=np.zeros(STATES),
        total=np.zeros((width, width)),
        innovation=np.zeros(width),
        keep=np.zeros(STATES),
        F=np.zeros((2, 2)),
        matrix=np.zeros((rest, 2 * rest)),
        right=np.zeros(rest),
        start=np.zeros(3),
        information=np.zeros((checkpoints, width, width)),
        history=np.zeros((0, 1 + STATES)),
        mean=np.zeros(rest),
        inverse=np.zeros((rest, rest)),
    )


@in_place
def standstill_filter(
    time_s: FloatArray,
    north: FloatArray,
    east: FloatArray,
    restart: int,
    white_variance: float,
    variance: float,
    tau: float,
    out: FloatArray,
) -> float:
    """Return the log likelihood of standstill velocities.

    Mean north, mean east and variance of the last state are left in ``out``. ``restart`` is the index at which the
    filter starts afresh (a second, unconnected stretch).
    """
    log_likelihood = 0.0
    p, g_north, g_east = variance, 0.0, 0.0
    last_step, keep = -1.0, 0.0
    for i in range(len(time_s)):
        if i == 0 or i == restart:
            p, g_north, g_east = variance, 0.0, 0.0
        else:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                keep, last_step = math.exp(-step / tau), step
            g_north *= keep
            g_east *= keep
            p = keep * keep * (p - variance) + variance
        total = p + white_variance
        gain = p / total
        v_north, v_east = north[i] - g_north, east[i] - g_east
        g_north += gain * v_north
        g_east += gain * v_east
        p *= 1.0 - gain
        log_likelihood -= math.log(total) + 0.5 * (v_north * v_north + v_east * v_east) / total
    out[0], out[1], out[2] = g_north, g_east, p
    return log_likelihood - len(time_s) * _LOG_2PI


@inlined
def _oscillator(theta: FloatArray, step_s: float, f: FloatArray) -> None:
    """Fill ``f``, shape (2, 2), with the exact transition of sway and sway rate over a step."""
    natural = 2.0 * math.pi * math.exp(theta[FREQUENCY])
    zeta = min(math.exp(theta[DAMPING]), DAMPING_MAX)
    decay, damped = zeta * natural, natural * math.sqrt(1.0 - zeta * zeta)
    shrink, sine, cosine = math.exp(-decay * step_s), math.sin(damped * step_s), math.cos(damped * step_s)
    f[0, 0], f[0, 1] = shrink * (cosine + decay / damped * sine), shrink * sine / damped
    f[1, 0], f[1, 1] = -natural * natural * f[0, 1], shrink * (cosine - decay / damped * sine)


@in_place
def taxi_filter(
    time_s: FloatArray,
    columns: FloatArray,
    from_north: FloatArray,
    from_east: FloatArray,
    is_start: NDArray[np.bool_],
    start_gap_s: float,
    theta: FloatArray,
    start: FloatArray,
    checkpoints: NDArray[np.int64],
    information: FloatArray,
    history: FloatArray,
    room: Room,
) -> float:
    """Filter the differences and the regressors; returns the sum of log innovation variances.

    Parameters
    ----------
    columns : ndarray, shape (n, c)
        Column 0 the differences, degrees, the others the regressors.
    from_north, from_east : ndarray, shape (n,)
        Change of the difference, degrees, by one m/s of GNSS velocity error.
    is_start : ndarray of bool, shape (n,)
        First sample of a segment: its own error is drawn afresh there.
    start_gap_s, start
        Time since the standstill state ``start`` (mean north, mean east, variance); negative: no standstill.
    checkpoints : ndarray of int64, shape (k,)
        Numbers of samples, increasing, after which the information is written out.
    information : ndarray, shape (k, c, c)
        Out: sums of products of whitened columns.
    history : ndarray, shape (n, 7) or (0, 7)
        Out, where there is room: S and K of every sample.

    Letters: P covariance and x states in the order of ``STATES``; q stationary variances; S innovation variance
    (deg^2), K gain, H measurement, F the transition of the oscillator, the other states decaying by ``keep``.
    """
    count, width = columns.shape
    white2, heading2 = math.exp(2.0 * theta[WHITE]), math.exp(2.0 * theta[HEADING_WHITE])
    motion = math.exp(theta[MOTION])
    q, P, x, K, H = room.q, room.P, room.x, room.K, room.H
    total, innovation, keep, F = room.total, room.innovation, room.keep, room.F
    q[0] = q[1] = math.exp(2.0 * theta[CORRELATED])
    q[2] = math.exp(2.0 * theta[SWAY])
    q[3] = q[2] * (2.0 * math.pi * math.exp(theta[FREQUENCY])) ** 2
    q[4], q[5] = math.exp(2.0 * theta[SEGMENT]), math.exp(2.0 * theta[WANDER])
    for a in range(STATES):
        for b in range(STATES):
            P[a, b] = 0.0
        P[a, a] = q[a]
        keep[a], H[a] = 1.0, 0.0
    for j in range(width):
        for a in range(STATES):
            x[j, a] = 0.0
        for m in range(width):
            total[j, m] = 0.0
    if start_gap_s >= 0.0:
        kept = math.exp(-start_gap_s / math.exp(theta[TAU]))
        P[0, 0] = P[1, 1] = kept * kept * (start[2] - q[0]) + q[0]
        x[0, 0], x[0, 1] = kept * start[0], kept * start[1]
    log_determinant, last_step, written = 0.0, -1.0, 0
    for i in range(count):
        step = time_s[i] - time_s[i - 1] if i > 0 else 0.0
        if i > 0:
            if abs(step - last_step) > 1e-6:
                last_step = step
                keep[0] = keep[1] = math.exp(-step / math.exp(theta[TAU]))
                keep[5] = math.exp(-step / math.exp(theta[WANDER_TAU]))
                _oscillator(theta, step, F)
            # Stationary covariance is diagonal, so only the deviation from it is moved: no process-noise matrix.
            for a in range(STATES):
                P[a, a] -= q[a]
            for a in range(STATES):
                low, high = P[2, a], P[3, a]
                P[2, a], P[3, a] = F[0, 0] * low + F[0, 1] * high, F[1, 0] * low + F[1, 1] * high
            for a in range(STATES):
                low, high = P[a, 2], P[a, 3]
                P[a, 2], P[a, 3] = F[0, 0] * low + F[0, 1] * high, F[1, 0] * low + F[1, 1] * high
            fresh = 0.0 if is_start[i] else 1.0
            keep[4] = fresh
            for a in range(STATES):
                for b in range(STATES):
                    P[a, b] *= keep[a] * keep[b]
            for a in range(STATES):
                P[a, a] += q[a]
            for j in range(width):
                low, high = x[j, 2], x[j, 3]
                x[j, 2], x[j, 3] = F[0, 0] * low + F[0, 1] * high, F[1, 0] * low + F[1, 1] * high
                for a in range(STATES):
                    x[j, a] *= keep[a]
        H[0], H[1], H[2], H[4], H[5] = motion * from_north[i], motion * from_east[i], 1.0, 1.0, 1.0
        s = white2 * (from_north[i] * from_north[i] + from_east[i] * from_east[i]) + heading2
        for a in range(STATES):
            K[a] = P[a, 0] * H[0] + P[a, 1] * H[1] + P[a, 2] + P[a, 4] + P[a, 5]
            s += H[a] * K[a]
        log_determinant += math.log(s)
        inverse = 1.0 / s
        for a in range(STATES):
            for b in range(STATES):
                P[a, b] -= K[a] * K[b] * inverse
        for a in range(STATES):
            K[a] *= inverse
        if len(history) > 0:
            history[i, 0] = s
            for a in range(STATES):  # a slice would take as long to compile as all the rest
                history[i, 1 + a] = K[a]
        for j in range(width):
            v = columns[i, j] - H[0] * x[j, 0] - H[1] * x[j, 1] - x[j, 2] - x[j, 4] - x[j, 5]
            for a in range(STATES):
                x[j, a] += K[a] * v
            innovation[j] = v
            for m in range(j + 1):
                total[j, m] += v * innovation[m] * inverse
        if written < len(checkpoints) and i + 1 == checkpoints[written]:
            for j in range(width):
                for m in range(j + 1):
                    information[written, j, m] = total[j, m]
                    information[written, m, j] = total[j, m]
            written += 1
    return log_determinant


@in_place
def generalised_weights(
    time_s: FloatArray,
    from_north: FloatArray,
    from_east: FloatArray,
    is_start: NDArray[np.bool_],
    theta: FloatArray,
    history: FloatArray,
    room: Room,
    innovation: FloatArray,
    weights: FloatArray,
) -> None:
    """Fill ``weights``, shape (n,), sum 1, with each sample's weight in the estimated mean.

    The mean is that by generalised least squares. The weights are the row sums of the inverse covariance: the gradient
    of half the quadratic form of a constant, taken backwards through the filter whose ``history`` (S and K) is given.
    Letters as in ``taxi_filter``; r is the gradient with respect to the state. ``innovation`` of shape (n,) is room to
    work in.
    """
    count, motion = len(time_s), math.exp(theta[MOTION])
    H, x, r, keep, F = room.H, room.x[0], room.K, room.keep, room.F
    for a in range(STATES):
        H[a], x[a], r[a], keep[a] = 0.0, 0.0, 0.0, 1.0
    H[2] = H[4] = H[5] = 1.0
    for turn in range(2 * count):
        is_forward = turn < count
        i = turn if is_forward else 2 * count - 1 - turn
        step = time_s[i] - time_s[i - 1] if i > 0 else 0.0
        keep[0] = keep[1] = math.exp(-step / math.exp(theta[TAU]))
        keep[5] = math.exp(-step / math.exp(theta[WANDER_TAU]))
        keep[4] = 0.0 if is_start[i] else 1.0
        _oscillator(theta, step, F)
        H[0], H[1] = motion * from_north[i], motion * from_east[i]
        if is_forward:
            x[2], x[3] = F[0, 0] * x[2] + F[0, 1] * x[3], F[1, 0] * x[2] + F[1, 1] * x[3]
            innovation[i] = 1.0
            for a in range(STATES):
                x[a] *= keep[a]
                innovation[i] -= H[a] * x[a]
            for a in range(STATES):
                x[a] += history[i, 1 + a] * innovation[i]
        else:
            weights[i] = innovation[i] / history[i, 0]
            for a in range(STATES):
                weights[i] += history[i, 1 + a] * r[a]
            for a in range(STATES):
                r[a] = (r[a] - H[a] * weights[i]) * keep[a]
            r[2], r[3] = F[0, 0] * r[2] + F[1, 0] * r[3], F[0, 1] * r[2] + F[1, 1] * r[3]
    total = 0.0
    for i in range(count):
        total += weights[i]
    for i in range(count):
        weights[i] /= total


@in_place
def solve_normal_equations(
    information: FloatArray,
    prior_mean: FloatArray,
    prior_precision: FloatArray,
    mean: FloatArray,
    inverse: FloatArray,
    room: Room,
) -> float:
    """Solve the normal equations with normal priors.

    The result is log determinant plus residual sum of squares. ``information`` has shape (c, c), column 0 the data;
    ``mean`` (c - 1,) and ``inverse`` (c - 1, c - 1) are written. A prior precision of 0 is a flat prior. Gauss-Jordan:
    the matrix is positive definite and small.
    """
    width = len(prior_mean)
    work, right = room.matrix, room.right
    squares = information[0, 0]
    for j in range(width):
        for m in range(width):
            work[j, m] = information[j + 1, m + 1]
            work[j, width + m] = 0.0
        work[j, j] += prior_precision[j]
        work[j, width + j] = 1.0
        right[j] = information[j + 1, 0] + prior_precision[j] * prior_mean[j]
        squares += prior_precision[j] * prior_mean[j] * prior_mean[j]
    log_determinant = 0.0
    pivot = 0.0
    for j in range(width):
        pivot = work[j, j]
        log_determinant += math.log(max(pivot, 1e-300))
        if prior_precision[j] > 0.0:
            log_determinant -= math.log(prior_precision[j])
        for m in range(2 * width):
            work[j, m] /= pivot
        for other in range(width):
            if other != j:
                factor = work[other, j]
                for m in range(2 * width):
                    work[other, m] -= factor * work[j, m]
    for j in range(width):
        mean[j] = 0.0
        for m in range(width):
            inverse[j, m] = work[j, width + m]
            mean[j] += work[j, width + m] * right[m]
        squares -= mean[j] * right[j]
    return float(log_determinant + squares)


@in_place
def evaluate(
    thetas: FloatArray,
    standstill: tuple[FloatArray, FloatArray, FloatArray, int, float],
    taxi: tuple[FloatArray, FloatArray, FloatArray, FloatArray, NDArray[np.bool_]],
    prior: tuple[FloatArray, FloatArray],
    checkpoints: NDArray[np.int64],
    log_likelihood: FloatArray,
    estimate: FloatArray,
    variance: FloatArray,
    prior_of_alone: tuple[FloatArray, FloatArray],
    alone: FloatArray,
    room: Room,
) -> None:
    """Fill log likelihood, estimate and its variance for every row of ``thetas``.

    ``thetas`` has the shape (k, 11).

    Parameters
    ----------
    standstill : (time_s, north, east, restart, gap_s)
        Velocities at standstill; ``gap_s`` from its last sample to the first of taxi, negative: not linked.
    taxi : (time_s, columns, from_north, from_east, is_start)
        As in ``taxi_filter``.
    prior : (mean, precision), shapes (c - 1,)
        Normal priors of the regression coefficients.
    checkpoints : ndarray of int64, shape (m,)
        The last is n.
    log_likelihood, estimate, variance : ndarray, shapes (k,), (k, c - 1), (k, m, c - 1)
        Out: log likelihood, coefficients, and the variances of the coefficients at the checkpoints.
    prior_of_alone : (mean, precision), shapes (a,)
        Prior of the first ``a`` coefficients, taken without the others.
    alone : ndarray, shape (k, 2)
        Out: the first coefficient and its variance, were the coefficients after the first ``a`` known to be zero.
    """
    width = taxi[1].shape[1]
    information, start, mean, inverse, history = room.information, room.start, room.mean, room.inverse, room.history
    for k in range(len(thetas)):
        theta = thetas[k]
        total = standstill_filter(
            standstill[0],
            standstill[1],
            standstill[2],
            standstill[3],
            math.exp(2.0 * theta[0]),
            math.exp(2.0 * theta[1]),
            math.exp(theta[2]),
            start,
        )
        gap_s = standstill[4]
        log_determinant = taxi_filter(
            taxi[0], taxi[1], taxi[2], taxi[3], taxi[4], gap_s, theta, start, checkpoints, information, history, room
        )
        rest = 0.0
        for m in range(len(checkpoints)):
            rest = solve_normal_equations(information[m], prior[0], prior[1], mean, inverse, room)
            for j in range(width - 1):
                variance[k, m, j] = inverse[j, j]
        for j in range(width - 1):
            estimate[k, j] = mean[j]
        log_likelihood[k] = total - 0.5 * (log_determinant + rest)
        if len(prior_of_alone[0]) < width - 1:
            last = len(checkpoints) - 1
            rest = solve_normal_equations(information[last], prior_of_alone[0], prior_of_alone[1], mean, inverse, room)
        alone[k, 0], alone[k, 1] = mean[0], inverse[0, 0]
