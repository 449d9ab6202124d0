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
LANES = 40  # draws that go through a filter side by side: the processor takes several of them in one step
DAMPING_MAX = 0.99
_LOG_2PI = math.log(2.0 * math.pi)


class NoiseWorkspace(NamedTuple):
    """Working arrays of the loops, made once for many calls.

    Of the filters, a lane for each draw: q, P, x, K, H, S and its inverse, the three noise parameters as they enter,
    sums of products, innovations, decays, F, and what they leave; of ``solve_normal_equations``: the matrix beside its
    inverse and the right side; the others are what ``evaluate`` hands from one to the other.
    """

    q: FloatArray  # (STATES, lanes)
    P: FloatArray  # (STATES, STATES, lanes), its lower half and what is told in taxi_filter
    x: FloatArray  # (c, STATES, lanes)
    K: FloatArray  # (STATES, lanes)
    H: FloatArray  # (2, lanes)
    S: FloatArray  # (2, lanes)
    noise: FloatArray  # (3, lanes)
    total: FloatArray  # (c, c, lanes)
    innovation: FloatArray  # (c, lanes)
    keep: FloatArray  # (STATES, lanes)
    F: FloatArray  # (2, 2, lanes)
    turned: FloatArray  # (lanes,)
    start: FloatArray  # (3, lanes)
    history: FloatArray  # (n, 1 + STATES) or (0, 1 + STATES)
    log_likelihood: FloatArray  # (lanes,)
    log_determinant: FloatArray  # (lanes,)
    information: FloatArray  # (lanes, checkpoints, c, c)
    matrix: FloatArray  # (c - 1, 2 (c - 1))
    right: FloatArray  # (c - 1,)
    mean: FloatArray  # (c - 1,)
    inverse: FloatArray  # (c - 1, c - 1)


def room_for(width: int, checkpoints: int = 1, *, lanes: int = LANES, history: int = 0) -> NoiseWorkspace:
    """Return working arrays for ``width`` columns, data and regressors.

    With ``history``, they hold the states of so many samples too.
    """
    rest = width - 1
    return NoiseWorkspace(
        q=np.zeros((STATES, lanes)),
        P=np.zeros((STATES, STATES, lanes)),
        x=np.zeros((width, STATES, lanes)),
        K=np.zeros((STATES, lanes)),
        H=np.zeros((2, lanes)),
        S=np.zeros((2, lanes)),
        noise=np.zeros((3, lanes)),
        total=np.zeros((width, width, lanes)),
        innovation=np.zeros((width, lanes)),
        keep=np.zeros((STATES, lanes)),
        F=np.zeros((2, 2, lanes)),
        turned=np.zeros(lanes),
        start=np.zeros((3, lanes)),
        history=np.zeros((history, 1 + STATES)),
        log_likelihood=np.zeros(lanes),
        log_determinant=np.zeros(lanes),
        information=np.zeros((lanes, checkpoints, width, width)),
        matrix=np.zeros((rest, 2 * rest)),
        right=np.zeros(rest),
        mean=np.zeros(rest),
        inverse=np.zeros((rest, rest)),
    )


@in_place
def standstill_filter(
    time_s: FloatArray, north: FloatArray, east: FloatArray, restart: int, thetas: FloatArray, room: NoiseWorkspace
) -> None:
    """Compute the log likelihood of standstill velocities and the last state.

    The state is mean north, mean east and their variance.

    ``thetas``, shape (k, 11), are as many draws as the room has lanes, or fewer; ``restart`` is the index at which the
    filter starts afresh (a second, unconnected stretch).
    """
    lanes = len(thetas)
    variance, white, keep, total, misfit = room.q[0], room.noise[0], room.keep[0], room.S[0], room.S[1]
    g_north, g_east, p, log_likelihood = room.start[0], room.start[1], room.start[2], room.log_likelihood
    for k in range(lanes):
        white[k], variance[k] = math.exp(2.0 * thetas[k, WHITE]), math.exp(2.0 * thetas[k, CORRELATED])
        g_north[k], g_east[k], p[k], log_likelihood[k] = 0.0, 0.0, variance[k], 0.0
    last_step = -1.0
    for i in range(len(time_s)):
        if i == restart:
            for k in range(lanes):
                g_north[k], g_east[k], p[k] = 0.0, 0.0, variance[k]
        elif i > 0:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                last_step = step
                for k in range(lanes):
                    keep[k] = math.exp(-step / math.exp(thetas[k, TAU]))
            for k in range(lanes):
                g_north[k] *= keep[k]
                g_east[k] *= keep[k]
                p[k] = keep[k] * keep[k] * (p[k] - variance[k]) + variance[k]
        for k in range(lanes):
            total[k] = p[k] + white[k]
            gain = p[k] / total[k]
            v_north, v_east = north[i] - g_north[k], east[i] - g_east[k]
            g_north[k] += gain * v_north
            g_east[k] += gain * v_east
            p[k] *= 1.0 - gain
            misfit[k] = 0.5 * (v_north * v_north + v_east * v_east) / total[k]
        for k in range(lanes):
            log_likelihood[k] -= math.log(total[k]) + misfit[k]
    for k in range(lanes):
        log_likelihood[k] -= len(time_s) * _LOG_2PI


@inlined
def _oscillator(theta: FloatArray, step_s: float, F: FloatArray, lane: int) -> None:
    """Write the exact transition of sway and its rate over a step.

    It goes into a lane of F, shape (2, 2, lanes).
    """
    natural = 2.0 * math.pi * math.exp(theta[FREQUENCY])
    zeta = min(math.exp(theta[DAMPING]), DAMPING_MAX)
    decay, damped = zeta * natural, natural * math.sqrt(1.0 - zeta * zeta)
    shrink, sine, cosine = math.exp(-decay * step_s), math.sin(damped * step_s), math.cos(damped * step_s)
    F[0, 0, lane], F[0, 1, lane] = shrink * (cosine + decay / damped * sine), shrink * sine / damped
    F[1, 0, lane], F[1, 1, lane] = -natural * natural * F[0, 1, lane], shrink * (cosine - decay / damped * sine)


@in_place
def _turn(F: FloatArray, sway: FloatArray, rate: FloatArray, turned: FloatArray, lanes: int) -> None:
    """Carry sway and sway rate, each of shape (lanes,), over a step.

    ``turned`` is working space for one of them.
    """
    for k in range(lanes):
        turned[k] = F[0, 0, k] * sway[k] + F[0, 1, k] * rate[k]
    for k in range(lanes):
        rate[k] = F[1, 0, k] * sway[k] + F[1, 1, k] * rate[k]
    for k in range(lanes):
        sway[k] = turned[k]


@in_place
def taxi_filter(
    time_s: FloatArray,
    columns: FloatArray,
    from_north: FloatArray,
    from_east: FloatArray,
    is_start: NDArray[np.bool_],
    start_gap_s: float,
    thetas: FloatArray,
    checkpoints: NDArray[np.int64],
    room: NoiseWorkspace,
) -> None:
    """Filter the differences and the regressors.

    It leaves the sum of the logarithms of innovation variances, and the information.

    The information, in a lane's part of shape (m, c, c), is the sums of products of whitened columns after so many
    samples as ``checkpoints`` say.

    Parameters
    ----------
    columns : ndarray, shape (n, c)
        Column 0 the differences, degrees, the others the regressors.
    from_north, from_east : ndarray, shape (n,)
        Change of the difference, degrees, by one m/s of GNSS velocity error.
    is_start : ndarray of bool, shape (n,)
        First sample of a segment: its own error is drawn afresh there.
    start_gap_s
        Time since the standstill state ``room.start`` (mean north, mean east, variance); negative: no standstill.
    thetas : ndarray, shape (k, 11)
        As many draws as the room has lanes, or fewer.
    checkpoints : ndarray of int64, shape (m,)
        Numbers of samples, increasing.
    room : NoiseWorkspace
        Where it has room for the history, S and K of every sample, of the first draw, are written.

    Letters: P covariance and x states in the order of ``STATES``; q stationary variances; S innovation variance
    (deg^2), K gain, H measurement, F the transition of the oscillator, the other states decaying by ``keep``. P is
    symmetric, so its lower half is carried; of sway and sway rate also [2, 3], which is [3, 2] but for rounding.
    """
    lanes, width, states = len(thetas), columns.shape[1], len(room.keep)
    q, P, x, K, H, S, inverse = room.q, room.P, room.x, room.K, room.H, room.S[0], room.S[1]
    white2, heading2, motion = room.noise[0], room.noise[1], room.noise[2]
    total, innovation, keep, F, log_determinant = room.total, room.innovation, room.keep, room.F, room.log_determinant
    history = room.history
    for k in range(lanes):
        theta = thetas[k]
        white2[k], heading2[k] = math.exp(2.0 * theta[WHITE]), math.exp(2.0 * theta[HEADING_WHITE])
        motion[k] = math.exp(theta[MOTION])
        q[0, k] = q[1, k] = math.exp(2.0 * theta[CORRELATED])
        q[2, k] = math.exp(2.0 * theta[SWAY])
        q[3, k] = q[2, k] * (2.0 * math.pi * math.exp(theta[FREQUENCY])) ** 2
        q[4, k], q[5, k] = math.exp(2.0 * theta[SEGMENT]), math.exp(2.0 * theta[WANDER])
        log_determinant[k] = 0.0
        for a in range(states):
            for b in range(states):
                P[a, b, k] = 0.0
            P[a, a, k], keep[a, k] = q[a, k], 1.0
        for j in range(width):
            for a in range(states):
                x[j, a, k] = 0.0
            for m in range(width):
                total[j, m, k] = 0.0
        if start_gap_s >= 0.0:
            kept = math.exp(-start_gap_s / math.exp(theta[TAU]))
            P[0, 0, k] = P[1, 1, k] = kept * kept * (room.start[2, k] - q[0, k]) + q[0, k]
            x[0, 0, k], x[0, 1, k] = kept * room.start[0, k], kept * room.start[1, k]
    last_step, written = -1.0, 0
    for i in range(len(time_s)):
        if i > 0:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                last_step = step
                for k in range(lanes):
                    theta = thetas[k]
                    keep[0, k] = keep[1, k] = math.exp(-step / math.exp(theta[TAU]))
                    keep[5, k] = math.exp(-step / math.exp(theta[WANDER_TAU]))
                    _oscillator(theta, step, F, k)
            fresh = 0.0 if is_start[i] else 1.0
            for k in range(lanes):
                keep[4, k] = fresh
            # Stationary covariance is diagonal, so only the deviation from it is moved: no process-noise matrix.
            for a in range(states):
                for k in range(lanes):
                    P[a, a, k] -= q[a, k]
            for b in range(4):
                _turn(F, P[2, b], P[3, b], room.turned, lanes)
            for a in range(2, states):
                _turn(F, P[a, 2], P[a, 3], room.turned, lanes)
            for a in range(states):
                for b in range(a + 1):
                    for k in range(lanes):
                        P[a, b, k] *= keep[a, k] * keep[b, k]
            for a in range(states):
                for k in range(lanes):
                    P[a, a, k] += q[a, k]
            for j in range(width):
                _turn(F, x[j, 2], x[j, 3], room.turned, lanes)
                for a in range(states):
                    for k in range(lanes):
                        x[j, a, k] *= keep[a, k]
        for k in range(lanes):
            H[0, k], H[1, k] = motion[k] * from_north[i], motion[k] * from_east[i]
            S[k] = white2[k] * (from_north[i] * from_north[i] + from_east[i] * from_east[i]) + heading2[k]
        for a in range(states):
            north, east, sway = P[a, 0], P[max(a, 1), min(a, 1)], P[max(a, 2), min(a, 2)]
            segment, wander = P[max(a, 4), min(a, 4)], P[5, a]
            for k in range(lanes):
                K[a, k] = north[k] * H[0, k] + east[k] * H[1, k] + sway[k] + segment[k] + wander[k]
        for k in range(lanes):
            S[k] = S[k] + H[0, k] * K[0, k] + H[1, k] * K[1, k] + K[2, k] + K[4, k] + K[5, k]
            inverse[k] = 1.0 / S[k]
        for k in range(lanes):
            log_determinant[k] += math.log(S[k])
        for k in range(lanes):
            P[2, 3, k] -= K[2, k] * K[3, k] * inverse[k]
        for a in range(states):
            for b in range(a + 1):
                for k in range(lanes):
                    P[a, b, k] -= K[a, k] * K[b, k] * inverse[k]
        for a in range(states):
            for k in range(lanes):
                K[a, k] *= inverse[k]
        if len(history) > 0:
            history[i, 0] = S[0]
            for a in range(states):  # a slice would take as long to compile as all the rest
                history[i, 1 + a] = K[a, 0]
        for j in range(width):
            for k in range(lanes):
                innovation[j, k] = (
                    columns[i, j] - H[0, k] * x[j, 0, k] - H[1, k] * x[j, 1, k] - x[j, 2, k] - x[j, 4, k] - x[j, 5, k]
                )
            for a in range(states):
                for k in range(lanes):
                    x[j, a, k] += K[a, k] * innovation[j, k]
            for m in range(j + 1):
                for k in range(lanes):
                    total[j, m, k] += innovation[j, k] * innovation[m, k] * inverse[k]
        if written < len(checkpoints) and i + 1 == checkpoints[written]:
            for k in range(lanes):
                for j in range(width):
                    for m in range(j + 1):
                        room.information[k, written, j, m] = total[j, m, k]
                        room.information[k, written, m, j] = total[j, m, k]
            written += 1


@in_place
def generalised_weights(
    time_s: FloatArray,
    from_north: FloatArray,
    from_east: FloatArray,
    is_start: NDArray[np.bool_],
    theta: FloatArray,
    room: NoiseWorkspace,
    innovation: FloatArray,
    weights: FloatArray,
) -> None:
    """Fill ``weights``, shape (n,), sum 1, with each sample's weight in the estimated mean.

    The weights are the row sums of the inverse covariance: the gradient of half the quadratic form of a constant,
    taken backwards through the filter whose history (S and K) is in the room. Letters as in ``taxi_filter``; r is the
    gradient with respect to the state. ``innovation`` of shape (n,) is room to work in, as are the room's first lanes.
    """
    count, motion = len(time_s), math.exp(theta[MOTION])
    H, x, r, keep, F, history = room.q, room.x[0], room.K, room.keep, room.F, room.history
    for a in range(STATES):
        H[a, 0], x[a, 0], r[a, 0], keep[a, 0] = 0.0, 0.0, 0.0, 1.0
    H[2, 0] = H[4, 0] = H[5, 0] = 1.0
    for turn in range(2 * count):
        is_forward = turn < count
        i = turn if is_forward else 2 * count - 1 - turn
        step = time_s[i] - time_s[i - 1] if i > 0 else 0.0
        keep[0, 0] = keep[1, 0] = math.exp(-step / math.exp(theta[TAU]))
        keep[5, 0] = math.exp(-step / math.exp(theta[WANDER_TAU]))
        keep[4, 0] = 0.0 if is_start[i] else 1.0
        _oscillator(theta, step, F, 0)
        H[0, 0], H[1, 0] = motion * from_north[i], motion * from_east[i]
        if is_forward:
            _turn(F, x[2], x[3], room.turned, 1)
            innovation[i] = 1.0
            for a in range(STATES):
                x[a, 0] *= keep[a, 0]
                innovation[i] -= H[a, 0] * x[a, 0]
            for a in range(STATES):
                x[a, 0] += history[i, 1 + a] * innovation[i]
        else:
            weights[i] = innovation[i] / history[i, 0]
            for a in range(STATES):
                weights[i] += history[i, 1 + a] * r[a, 0]
            for a in range(STATES):
                r[a, 0] = (r[a, 0] - H[a, 0] * weights[i]) * keep[a, 0]
            sway, rate = r[2, 0], r[3, 0]
            r[2, 0], r[3, 0] = F[0, 0, 0] * sway + F[1, 0, 0] * rate, F[0, 1, 0] * sway + F[1, 1, 0] * rate
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
    room: NoiseWorkspace,
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
    room: NoiseWorkspace,
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
    width, last = taxi[1].shape[1], len(checkpoints) - 1
    information, mean, inverse = room.information, room.mean, room.inverse
    first, lanes = 0, len(room.S[0])
    while first < len(thetas):
        some = thetas[first : first + lanes]
        standstill_filter(standstill[0], standstill[1], standstill[2], standstill[3], some, room)
        taxi_filter(taxi[0], taxi[1], taxi[2], taxi[3], taxi[4], standstill[4], some, checkpoints, room)
        for lane in range(len(some)):
            k, rest = first + lane, 0.0
            for m in range(len(checkpoints)):
                rest = solve_normal_equations(information[lane, m], prior[0], prior[1], mean, inverse, room)
                for j in range(width - 1):
                    variance[k, m, j] = inverse[j, j]
            for j in range(width - 1):
                estimate[k, j] = mean[j]
            log_likelihood[k] = room.log_likelihood[lane] - 0.5 * (room.log_determinant[lane] + rest)
            if len(prior_of_alone[0]) < width - 1:
                means, precisions = prior_of_alone
                solve_normal_equations(information[lane, last], means, precisions, mean, inverse, room)
            alone[k, 0], alone[k, 1] = mean[0], inverse[0, 0]
        first += lanes
