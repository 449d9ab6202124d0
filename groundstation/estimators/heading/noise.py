"""Likelihood of the heading differences and the standstill velocities under one noise model, by a Kalman filter.

The model, in words. At standstill each component of the GNSS velocity is white noise plus a first-order
Gauss-Markov process. On taxi the same processes, turned across the track and divided by the speed, stand in the
difference d = INS heading - track, beside the sway of the airframe (a noise-driven damped oscillator), white
heading noise, the error looked for and, where asked, an antenna arm:

    d_i = error + arm * (-omega_i / V_i) + sway(t_i) + (sin(track) g_N - cos(track) g_E) / V_i + white_i

Everything is linear and Gaussian, samples may come at any times, and what counts for the error of a mean, the
spectral density at zero frequency, is that of the model. The regression coefficients are found by generalised least
squares: data and regressors pass through one filter (the augmented filter).

Source: P. de Jong, The diffuse Kalman filter, Annals of Statistics 19 (1991), section 2; A. C. Harvey, Forecasting,
Structural Time Series Models and the Kalman Filter, 1989, sections 3.4 and 9.
"""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import compiled

FloatArray = NDArray[np.float64]

# Parameters, all as natural logarithms, in this order.
WHITE, CORRELATED, TAU, SWAY, FREQUENCY, DAMPING, HEADING_WHITE, MOTION = range(8)
PARAMETER_NAMES = (
    "white_mps",
    "correlated_mps",
    "correlation_s",
    "sway_deg",
    "sway_hz",
    "sway_damping",
    "heading_white_deg",
    "motion_factor",  # correlated GNSS error in motion over that at standstill
)
DAMPING_MAX = 0.99
_LOG_2PI = math.log(2.0 * math.pi)


@compiled
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
    """Log likelihood of standstill velocities; leaves mean north, mean east and variance of the last state in ``out``.

    ``restart`` is the index at which the filter starts afresh (a second, unconnected stretch).
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


@compiled
def taxi_filter(
    time_s: FloatArray,
    columns: FloatArray,
    from_north: FloatArray,
    from_east: FloatArray,
    start_gap_s: float,
    theta: FloatArray,
    start: FloatArray,
    checkpoints: NDArray[np.int64],
    information: FloatArray,
    history: FloatArray,
) -> float:
    """Filter the differences and the regressors; returns the sum of log innovation variances.

    Parameters
    ----------
    columns : ndarray, shape (n, c)
        Column 0 the differences, degrees, the others the regressors.
    from_north, from_east : ndarray, shape (n,)
        What one m/s of GNSS velocity error does to the difference, degrees.
    start_gap_s, start
        Time since the standstill state ``start`` (mean north, mean east, variance); negative: no standstill.
    checkpoints : ndarray of int64, shape (k,)
        Numbers of samples, increasing, after which the information is written out.
    information : ndarray, shape (k, c, c)
        Out: sums of products of whitened columns.
    history : ndarray, shape (n, 5) or (0, 5)
        Out, where there is room: S and K of every sample.

    Letters: P covariance and x states in the order g_north, g_east (m/s), sway (deg), sway rate (deg/s);
    S innovation variance (deg^2), K gain, F the transition of the oscillator.
    """
    count, width = columns.shape
    white2, variance = math.exp(2.0 * theta[0]), math.exp(2.0 * theta[1])
    tau, sway2 = math.exp(theta[2]), math.exp(2.0 * theta[3])
    natural = 2.0 * math.pi * math.exp(theta[4])
    zeta = min(math.exp(theta[5]), DAMPING_MAX)
    heading2 = math.exp(2.0 * theta[6])
    motion = math.exp(theta[7])
    decay, damped = zeta * natural, natural * math.sqrt(1.0 - zeta * zeta)
    rate2 = sway2 * natural * natural

    p00 = p11 = variance
    p22, p33 = sway2, rate2
    p01 = p02 = p03 = p12 = p13 = p23 = 0.0
    x = np.zeros((width, 4))
    if start_gap_s >= 0.0:
        keep = math.exp(-start_gap_s / tau)
        p00 = p11 = keep * keep * (start[2] - variance) + variance
        x[0, 0], x[0, 1] = keep * start[0], keep * start[1]
    total = np.zeros((width, width))
    innovation = np.zeros(width)
    log_determinant, last_step = 0.0, -1.0
    keep = f00 = f01 = f10 = f11 = 0.0
    written = 0
    for i in range(count):
        if i > 0:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                last_step, keep, shrink = step, math.exp(-step / tau), math.exp(-decay * step)
                sine, cosine = math.sin(damped * step), math.cos(damped * step)
                f00 = shrink * (cosine + decay / damped * sine)
                f01 = shrink * sine / damped
                f10 = -natural * natural * f01
                f11 = shrink * (cosine - decay / damped * sine)
            keep2 = keep * keep
            p00 = keep2 * (p00 - variance) + variance
            p11 = keep2 * (p11 - variance) + variance
            p01 *= keep2
            p02, p03 = keep * (f00 * p02 + f01 * p03), keep * (f10 * p02 + f11 * p03)
            p12, p13 = keep * (f00 * p12 + f01 * p13), keep * (f10 * p12 + f11 * p13)
            # Stationary covariance is diagonal, so only the deviation from it is moved: no process-noise matrix.
            q22, q33 = p22 - sway2, p33 - rate2
            a0, a1 = f00 * q22 + f01 * p23, f00 * p23 + f01 * q33
            b0, b1 = f10 * q22 + f11 * p23, f10 * p23 + f11 * q33
            p22, p23, p33 = a0 * f00 + a1 * f01 + sway2, a0 * f10 + a1 * f11, b0 * f10 + b1 * f11 + rate2
            for j in range(width):
                x[j, 0] *= keep
                x[j, 1] *= keep
                sway, rate = x[j, 2], x[j, 3]
                x[j, 2], x[j, 3] = f00 * sway + f01 * rate, f10 * sway + f11 * rate
        h0, h1 = motion * from_north[i], motion * from_east[i]
        c0 = p00 * h0 + p01 * h1 + p02
        c1 = p01 * h0 + p11 * h1 + p12
        c2 = p02 * h0 + p12 * h1 + p22
        c3 = p03 * h0 + p13 * h1 + p23
        s = h0 * c0 + h1 * c1 + c2 + white2 * (from_north[i] * from_north[i] + from_east[i] * from_east[i]) + heading2
        log_determinant += math.log(s)
        k0, k1, k2, k3 = c0 / s, c1 / s, c2 / s, c3 / s
        if len(history) > 0:
            history[i, 0], history[i, 1], history[i, 2], history[i, 3], history[i, 4] = s, k0, k1, k2, k3
        p00 -= k0 * c0
        p01 -= k0 * c1
        p02 -= k0 * c2
        p03 -= k0 * c3
        p11 -= k1 * c1
        p12 -= k1 * c2
        p13 -= k1 * c3
        p22 -= k2 * c2
        p23 -= k2 * c3
        p33 -= k3 * c3
        for j in range(width):
            v = columns[i, j] - h0 * x[j, 0] - h1 * x[j, 1] - x[j, 2]
            x[j, 0] += k0 * v
            x[j, 1] += k1 * v
            x[j, 2] += k2 * v
            x[j, 3] += k3 * v
            innovation[j] = v
            for m in range(j + 1):
                total[j, m] += v * innovation[m] / s
        if written < len(checkpoints) and i + 1 == checkpoints[written]:
            for j in range(width):
                for m in range(j + 1):
                    information[written, j, m] = total[j, m]
                    information[written, m, j] = total[j, m]
            written += 1
    return log_determinant


@compiled
def generalised_weights(
    time_s: FloatArray, from_north: FloatArray, from_east: FloatArray, theta: FloatArray, history: FloatArray
) -> FloatArray:
    """Weight of every sample in the generalised least-squares mean, shape (n,), sum 1.

    The weights are the row sums of the inverse covariance: the gradient of half the quadratic form of a constant,
    taken backwards through the filter whose ``history`` (S and K) is given. Letters as in ``taxi_filter``.
    """
    count = len(time_s)
    tau, motion = math.exp(theta[2]), math.exp(theta[7])
    natural = 2.0 * math.pi * math.exp(theta[4])
    zeta = min(math.exp(theta[5]), DAMPING_MAX)
    decay, damped = zeta * natural, natural * math.sqrt(1.0 - zeta * zeta)
    transition = np.zeros((count, 5))
    innovation = np.zeros(count)
    x0 = x1 = x2 = x3 = 0.0
    for i in range(count):
        step = time_s[i] - time_s[i - 1] if i > 0 else 0.0
        shrink, sine, cosine = math.exp(-decay * step), math.sin(damped * step), math.cos(damped * step)
        keep = math.exp(-step / tau)
        f00, f01 = shrink * (cosine + decay / damped * sine), shrink * sine / damped
        f10, f11 = -natural * natural * f01, shrink * (cosine - decay / damped * sine)
        transition[i, 0], transition[i, 1], transition[i, 2] = keep, f00, f01
        transition[i, 3], transition[i, 4] = f10, f11
        x0, x1, x2, x3 = keep * x0, keep * x1, f00 * x2 + f01 * x3, f10 * x2 + f11 * x3
        v = 1.0 - motion * (from_north[i] * x0 + from_east[i] * x1) - x2
        innovation[i] = v
        x0, x1 = x0 + history[i, 1] * v, x1 + history[i, 2] * v
        x2, x3 = x2 + history[i, 3] * v, x3 + history[i, 4] * v
    weights = np.zeros(count)
    r0 = r1 = r2 = r3 = 0.0
    for i in range(count - 1, -1, -1):
        u = innovation[i] / history[i, 0]
        u += history[i, 1] * r0 + history[i, 2] * r1 + history[i, 3] * r2 + history[i, 4] * r3
        weights[i] = u
        r0, r1, r2 = r0 - motion * from_north[i] * u, r1 - motion * from_east[i] * u, r2 - u
        keep = transition[i, 0]
        r0, r1 = keep * r0, keep * r1
        r2, r3 = transition[i, 1] * r2 + transition[i, 3] * r3, transition[i, 2] * r2 + transition[i, 4] * r3
    total = weights.sum()
    for i in range(count):
        weights[i] /= total
    return weights


@compiled
def solve_normal_equations(
    information: FloatArray, prior_mean: FloatArray, prior_precision: FloatArray, mean: FloatArray, inverse: FloatArray
) -> float:
    """Solve the normal equations with normal priors; returns log determinant plus residual sum of squares.

    ``information`` has shape (c, c), column 0 the data; ``mean`` (c - 1,) and ``inverse`` (c - 1, c - 1) are written.
    A prior precision of 0 is a flat prior. Gauss-Jordan: the matrix is positive definite and at most 3 by 3.
    """
    width = len(prior_mean)
    work = np.zeros((width, 2 * width))
    right = np.zeros(width)
    squares = information[0, 0]
    for j in range(width):
        for m in range(width):
            work[j, m] = information[j + 1, m + 1]
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


@compiled
def evaluate(
    thetas: FloatArray,
    standstill: tuple[FloatArray, FloatArray, FloatArray, int, float],
    taxi: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    prior: tuple[FloatArray, FloatArray],
    checkpoints: NDArray[np.int64],
    log_likelihood: FloatArray,
    estimate: FloatArray,
    variance: FloatArray,
) -> None:
    """Log likelihood, estimate and its variance for every row of ``thetas``, shape (k, 8).

    Parameters
    ----------
    standstill : (time_s, north, east, restart, gap_s)
        Velocities at standstill; ``gap_s`` from its last sample to the first of taxi, negative: not linked.
    taxi : (time_s, columns, from_north, from_east)
        As in ``taxi_filter``.
    prior : (mean, precision), shapes (c - 1,)
        Normal priors of the regression coefficients.
    checkpoints : ndarray of int64, shape (m,)
        The last is n.
    log_likelihood, estimate, variance : ndarray, shapes (k,), (k, c - 1), (k, m, c - 1)
        Out: log likelihood, coefficients, and the variances of the coefficients at the checkpoints.
    """
    width = taxi[1].shape[1]
    information = np.zeros((len(checkpoints), width, width))
    start = np.zeros(3)
    mean, inverse = np.zeros(width - 1), np.zeros((width - 1, width - 1))
    history = np.zeros((0, 5))
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
            taxi[0], taxi[1], taxi[2], taxi[3], gap_s, theta, start, checkpoints, information, history
        )
        rest = 0.0
        for m in range(len(checkpoints)):
            rest = solve_normal_equations(information[m], prior[0], prior[1], mean, inverse)
            for j in range(width - 1):
                variance[k, m, j] = inverse[j, j]
        for j in range(width - 1):
            estimate[k, j] = mean[j]
        log_likelihood[k] = total - 0.5 * (log_determinant + rest)
