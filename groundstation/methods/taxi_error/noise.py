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


# Rows of the table of lanes: where each begins. Constant places let the processor keep what it works on at hand.
_ROWS = tuple(range(0, 51 * LANES, LANES))
WHITE2, HEADING2, MOTION_FACTOR, LOG_DETERMINANT, LOG_LIKELIHOOD = _ROWS[:5]
START_NORTH, START_EAST, START_VARIANCE = _ROWS[5:8]  # GNSS state at the end of standstill
Q_GNSS, Q_SWAY, Q_RATE, Q_SEGMENT, Q_WANDER = _ROWS[8:13]  # stationary variances
KEEP_GNSS, KEEP_WANDER = _ROWS[13:15]  # shares that are left after a step
F_22, F_23, F_32, F_33 = _ROWS[15:19]  # transition of sway and sway rate over a step
H_NORTH, H_EAST, S, INVERSE_S = _ROWS[19:23]
K_0, K_1, K_2, K_3, K_4, K_5 = _ROWS[23:29]
P_00, P_10, P_11, P_20, P_21, P_22, P_30, P_31, P_32, P_33, P_23 = _ROWS[29:40]
P_40, P_41, P_42, P_43, P_44, P_50, P_51, P_52, P_53, P_54, P_55 = _ROWS[40:51]


class NoiseWorkspace(NamedTuple):
    """Working arrays of the loops, made once for many calls.

    Of the filters, a lane for each draw: the table of lanes, states, innovations and sums of products of each column;
    of ``solve_normal_equations``: the matrix beside its inverse and the right side; the others are what ``evaluate``
    hands from one to the other.
    """

    lanes: FloatArray  # (51 LANES,), rows as named above
    x: FloatArray  # (c, STATES LANES)
    innovation: FloatArray  # (c, LANES)
    total: FloatArray  # (c, c, LANES)
    draws: FloatArray  # (LANES, 11)
    history: FloatArray  # (n, 1 + STATES) or (0, 1 + STATES)
    information: FloatArray  # (LANES, checkpoints, c, c)
    matrix: FloatArray  # (c - 1, 2 (c - 1))
    right: FloatArray  # (c - 1,)
    mean: FloatArray  # (c - 1,)
    inverse: FloatArray  # (c - 1, c - 1)


def room_for(width: int, checkpoints: int = 1, *, history: int = 0) -> NoiseWorkspace:
    """Return working arrays for ``width`` columns, data and regressors.

    With ``history``, they hold the states of so many samples too.
    """
    rest = width - 1
    return NoiseWorkspace(
        lanes=np.zeros(len(_ROWS) * LANES),
        x=np.zeros((width, STATES * LANES)),
        innovation=np.zeros((width, LANES)),
        total=np.zeros((width, width, LANES)),
        draws=np.zeros((LANES, len(PARAMETER_NAMES))),
        history=np.zeros((history, 1 + STATES)),
        information=np.zeros((LANES, checkpoints, width, width)),
        matrix=np.zeros((rest, 2 * rest)),
        right=np.zeros(rest),
        mean=np.zeros(rest),
        inverse=np.zeros((rest, rest)),
    )


@in_place
def standstill_filter(
    time_s: FloatArray, north: FloatArray, east: FloatArray, restart: int, thetas: FloatArray, lanes: FloatArray
) -> None:
    """Compute the log likelihood of standstill velocities and the last state.

    The state is mean north, mean east and their variance.

    ``thetas``, shape (LANES, 11), are the draws; ``restart`` is the index at which the filter starts afresh (a second,
    unconnected stretch).
    """
    for k in range(LANES):
        lanes[WHITE2 + k], lanes[Q_GNSS + k] = math.exp(2.0 * thetas[k, WHITE]), math.exp(2.0 * thetas[k, CORRELATED])
        lanes[START_NORTH + k], lanes[START_EAST + k], lanes[START_VARIANCE + k] = 0.0, 0.0, lanes[Q_GNSS + k]
        lanes[LOG_LIKELIHOOD + k] = 0.0
    last_step = -1.0
    for i in range(len(time_s)):
        if i == restart:
            for k in range(LANES):
                lanes[START_NORTH + k], lanes[START_EAST + k] = 0.0, 0.0
                lanes[START_VARIANCE + k] = lanes[Q_GNSS + k]
        elif i > 0:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                last_step = step
                for k in range(LANES):
                    lanes[KEEP_GNSS + k] = math.exp(-step / math.exp(thetas[k, TAU]))
            for k in range(LANES):
                keep, variance = lanes[KEEP_GNSS + k], lanes[Q_GNSS + k]
                lanes[START_NORTH + k] *= keep
                lanes[START_EAST + k] *= keep
                lanes[START_VARIANCE + k] = keep * keep * (lanes[START_VARIANCE + k] - variance) + variance
        for k in range(LANES):
            p = lanes[START_VARIANCE + k]
            total = p + lanes[WHITE2 + k]
            gain = p / total
            v_north, v_east = north[i] - lanes[START_NORTH + k], east[i] - lanes[START_EAST + k]
            lanes[START_NORTH + k] += gain * v_north
            lanes[START_EAST + k] += gain * v_east
            lanes[START_VARIANCE + k] = p * (1.0 - gain)
            lanes[S + k] = total
            lanes[INVERSE_S + k] = 0.5 * (v_north * v_north + v_east * v_east) / total
        for k in range(LANES):
            lanes[LOG_LIKELIHOOD + k] -= math.log(lanes[S + k]) + lanes[INVERSE_S + k]
    for k in range(LANES):
        lanes[LOG_LIKELIHOOD + k] -= len(time_s) * _LOG_2PI


@inlined
def _oscillator(theta: FloatArray, step_s: float, lanes: FloatArray, k: int) -> None:
    """Write the exact transition of sway and its rate over a step.

    It goes into lane ``k`` of the table.
    """
    natural = 2.0 * math.pi * math.exp(theta[FREQUENCY])
    zeta = min(math.exp(theta[DAMPING]), DAMPING_MAX)
    decay, damped = zeta * natural, natural * math.sqrt(1.0 - zeta * zeta)
    shrink, sine, cosine = math.exp(-decay * step_s), math.sin(damped * step_s), math.cos(damped * step_s)
    lanes[F_22 + k], lanes[F_23 + k] = shrink * (cosine + decay / damped * sine), shrink * sine / damped
    lanes[F_32 + k], lanes[F_33 + k] = -natural * natural * lanes[F_23 + k], shrink * (cosine - decay / damped * sine)


@in_place
def _begin(thetas: FloatArray, start_gap_s: float, lanes: FloatArray) -> None:
    """Write noise, the first covariance, and a transition that changes nothing."""
    for at in range(P_00, P_55 + LANES):
        lanes[at] = 0.0
    for k in range(LANES):
        theta = thetas[k]
        lanes[WHITE2 + k], lanes[HEADING2 + k] = math.exp(2.0 * theta[WHITE]), math.exp(2.0 * theta[HEADING_WHITE])
        lanes[MOTION_FACTOR + k], lanes[LOG_DETERMINANT + k] = math.exp(theta[MOTION]), 0.0
        lanes[Q_GNSS + k], lanes[Q_SWAY + k] = math.exp(2.0 * theta[CORRELATED]), math.exp(2.0 * theta[SWAY])
        lanes[Q_RATE + k] = lanes[Q_SWAY + k] * (2.0 * math.pi * math.exp(theta[FREQUENCY])) ** 2
        lanes[Q_SEGMENT + k], lanes[Q_WANDER + k] = math.exp(2.0 * theta[SEGMENT]), math.exp(2.0 * theta[WANDER])
        lanes[P_00 + k], lanes[P_11 + k] = lanes[Q_GNSS + k], lanes[Q_GNSS + k]
        lanes[P_22 + k], lanes[P_33 + k] = lanes[Q_SWAY + k], lanes[Q_RATE + k]
        lanes[P_44 + k], lanes[P_55 + k] = lanes[Q_SEGMENT + k], lanes[Q_WANDER + k]
        lanes[KEEP_GNSS + k] = lanes[KEEP_WANDER + k] = lanes[F_22 + k] = lanes[F_33 + k] = 1.0
        lanes[F_23 + k] = lanes[F_32 + k] = 0.0
        if start_gap_s >= 0.0:
            kept, q = math.exp(-start_gap_s / math.exp(theta[TAU])), lanes[Q_GNSS + k]
            lanes[P_00 + k] = lanes[P_11 + k] = kept * kept * (lanes[START_VARIANCE + k] - q) + q


@in_place
def _carry_covariance(lanes: FloatArray, fresh: float) -> None:
    """Carry the covariance over a step; ``fresh`` is 0 where a segment begins, else 1.

    Stationary covariance is diagonal, so only the deviation from it is moved: no process-noise matrix.
    """
    for k in range(LANES):
        gnss, wander = lanes[KEEP_GNSS + k], lanes[KEEP_WANDER + k]
        f22, f23, f32, f33 = lanes[F_22 + k], lanes[F_23 + k], lanes[F_32 + k], lanes[F_33 + k]
        lanes[P_00 + k] = (lanes[P_00 + k] - lanes[Q_GNSS + k]) * (gnss * gnss) + lanes[Q_GNSS + k]
        lanes[P_10 + k] *= gnss * gnss
        lanes[P_11 + k] = (lanes[P_11 + k] - lanes[Q_GNSS + k]) * (gnss * gnss) + lanes[Q_GNSS + k]
        p20, p30 = lanes[P_20 + k], lanes[P_30 + k]
        lanes[P_20 + k], lanes[P_30 + k] = (f22 * p20 + f23 * p30) * gnss, (f32 * p20 + f33 * p30) * gnss
        p21, p31 = lanes[P_21 + k], lanes[P_31 + k]
        lanes[P_21 + k], lanes[P_31 + k] = (f22 * p21 + f23 * p31) * gnss, (f32 * p21 + f33 * p31) * gnss
        sway, rate = lanes[P_22 + k] - lanes[Q_SWAY + k], lanes[P_33 + k] - lanes[Q_RATE + k]
        turned22, turned32 = f22 * sway + f23 * lanes[P_32 + k], f32 * sway + f33 * lanes[P_32 + k]
        turned23, turned33 = f22 * lanes[P_23 + k] + f23 * rate, f32 * lanes[P_23 + k] + f33 * rate
        lanes[P_22 + k] = f22 * turned22 + f23 * turned23 + lanes[Q_SWAY + k]
        lanes[P_23 + k] = f32 * turned22 + f33 * turned23
        lanes[P_32 + k] = f22 * turned32 + f23 * turned33
        lanes[P_33 + k] = f32 * turned32 + f33 * turned33 + lanes[Q_RATE + k]
        p42, p43, p52, p53 = lanes[P_42 + k], lanes[P_43 + k], lanes[P_52 + k], lanes[P_53 + k]
        lanes[P_40 + k] *= fresh * gnss
        lanes[P_41 + k] *= fresh * gnss
        lanes[P_42 + k], lanes[P_43 + k] = (f22 * p42 + f23 * p43) * fresh, (f32 * p42 + f33 * p43) * fresh
        lanes[P_44 + k] = (lanes[P_44 + k] - lanes[Q_SEGMENT + k]) * (fresh * fresh) + lanes[Q_SEGMENT + k]
        lanes[P_50 + k] *= wander * gnss
        lanes[P_51 + k] *= wander * gnss
        lanes[P_52 + k], lanes[P_53 + k] = (f22 * p52 + f23 * p53) * wander, (f32 * p52 + f33 * p53) * wander
        lanes[P_54 + k] *= wander * fresh
        lanes[P_55 + k] = (lanes[P_55 + k] - lanes[Q_WANDER + k]) * (wander * wander) + lanes[Q_WANDER + k]


@in_place
def _measure(lanes: FloatArray, from_north: float, from_east: float) -> None:
    """Take a sample into the covariance; leaves H, S, 1 / S and K."""
    for k in range(LANES):
        h0, h1 = lanes[MOTION_FACTOR + k] * from_north, lanes[MOTION_FACTOR + k] * from_east
        p10, p20, p21, p32 = lanes[P_10 + k], lanes[P_20 + k], lanes[P_21 + k], lanes[P_32 + k]
        p40, p41, p42, p43 = lanes[P_40 + k], lanes[P_41 + k], lanes[P_42 + k], lanes[P_43 + k]
        p50, p51, p52, p53 = lanes[P_50 + k], lanes[P_51 + k], lanes[P_52 + k], lanes[P_53 + k]
        p54 = lanes[P_54 + k]
        k0 = lanes[P_00 + k] * h0 + p10 * h1 + p20 + p40 + p50
        k1 = p10 * h0 + lanes[P_11 + k] * h1 + p21 + p41 + p51
        k2 = p20 * h0 + p21 * h1 + lanes[P_22 + k] + p42 + p52
        k3 = lanes[P_30 + k] * h0 + lanes[P_31 + k] * h1 + p32 + p43 + p53
        k4 = p40 * h0 + p41 * h1 + p42 + lanes[P_44 + k] + p54
        k5 = p50 * h0 + p51 * h1 + p52 + p54 + lanes[P_55 + k]
        of_white = lanes[WHITE2 + k] * (from_north * from_north + from_east * from_east) + lanes[HEADING2 + k]
        s = of_white + h0 * k0 + h1 * k1 + k2 + k4 + k5
        inverse = 1.0 / s
        lanes[H_NORTH + k], lanes[H_EAST + k], lanes[S + k], lanes[INVERSE_S + k] = h0, h1, s, inverse
        lanes[P_00 + k] -= k0 * k0 * inverse
        lanes[P_10 + k], lanes[P_11 + k] = p10 - k1 * k0 * inverse, lanes[P_11 + k] - k1 * k1 * inverse
        lanes[P_20 + k], lanes[P_21 + k] = p20 - k2 * k0 * inverse, p21 - k2 * k1 * inverse
        lanes[P_22 + k], lanes[P_23 + k] = lanes[P_22 + k] - k2 * k2 * inverse, lanes[P_23 + k] - k2 * k3 * inverse
        lanes[P_30 + k], lanes[P_31 + k] = lanes[P_30 + k] - k3 * k0 * inverse, lanes[P_31 + k] - k3 * k1 * inverse
        lanes[P_32 + k], lanes[P_33 + k] = p32 - k3 * k2 * inverse, lanes[P_33 + k] - k3 * k3 * inverse
        lanes[P_40 + k], lanes[P_41 + k] = p40 - k4 * k0 * inverse, p41 - k4 * k1 * inverse
        lanes[P_42 + k], lanes[P_43 + k] = p42 - k4 * k2 * inverse, p43 - k4 * k3 * inverse
        lanes[P_44 + k] -= k4 * k4 * inverse
        lanes[P_50 + k], lanes[P_51 + k] = p50 - k5 * k0 * inverse, p51 - k5 * k1 * inverse
        lanes[P_52 + k], lanes[P_53 + k] = p52 - k5 * k2 * inverse, p53 - k5 * k3 * inverse
        lanes[P_54 + k], lanes[P_55 + k] = p54 - k5 * k4 * inverse, lanes[P_55 + k] - k5 * k5 * inverse
        lanes[K_0 + k], lanes[K_1 + k], lanes[K_2 + k] = k0 * inverse, k1 * inverse, k2 * inverse
        lanes[K_3 + k], lanes[K_4 + k], lanes[K_5 + k] = k3 * inverse, k4 * inverse, k5 * inverse


@in_place
def _filter_column(measured: float, fresh: float, lanes: FloatArray, x: FloatArray, innovation: FloatArray) -> None:
    """Carry states of a column over a step, correct by its sample, leave innovations."""
    for k in range(LANES):
        sway, rate = x[2 * LANES + k], x[3 * LANES + k]
        x0, x1 = x[k] * lanes[KEEP_GNSS + k], x[LANES + k] * lanes[KEEP_GNSS + k]
        x2 = lanes[F_22 + k] * sway + lanes[F_23 + k] * rate
        x3 = lanes[F_32 + k] * sway + lanes[F_33 + k] * rate
        x4, x5 = x[4 * LANES + k] * fresh, x[5 * LANES + k] * lanes[KEEP_WANDER + k]
        left = measured - lanes[H_NORTH + k] * x0 - lanes[H_EAST + k] * x1 - x2 - x4 - x5
        innovation[k] = left
        x[k], x[LANES + k] = x0 + lanes[K_0 + k] * left, x1 + lanes[K_1 + k] * left
        x[2 * LANES + k], x[3 * LANES + k] = x2 + lanes[K_2 + k] * left, x3 + lanes[K_3 + k] * left
        x[4 * LANES + k], x[5 * LANES + k] = x4 + lanes[K_4 + k] * left, x5 + lanes[K_5 + k] * left


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
        Time since the standstill state in the table of lanes; negative: no standstill.
    thetas : ndarray, shape (LANES, 11)
    checkpoints : ndarray of int64, shape (m,)
        Numbers of samples, increasing.
    room : NoiseWorkspace
        Where it has room for the history, S and K of every sample, of the first draw, are written.

    Letters: P covariance and x states in the order of ``STATES``; q stationary variances; S innovation variance
    (deg^2), K gain, H measurement, F the transition of the oscillator, the other states decaying by what is kept. P is
    symmetric, so its lower half is carried; of sway and sway rate also [2, 3], which is [3, 2] but for rounding.
    """
    width, lanes, x, total, innovation = columns.shape[1], room.lanes, room.x, room.total, room.innovation
    history = room.history
    _begin(thetas, start_gap_s, lanes)
    for j in range(width):
        for at in range(STATES * LANES):
            x[j, at] = 0.0
        for m in range(width):
            for k in range(LANES):
                total[j, m, k] = 0.0
    if start_gap_s >= 0.0:
        for k in range(LANES):
            kept = math.exp(-start_gap_s / math.exp(thetas[k, TAU]))
            x[0, k], x[0, LANES + k] = kept * lanes[START_NORTH + k], kept * lanes[START_EAST + k]
    last_step, written, fresh = -1.0, 0, 1.0
    for i in range(len(time_s)):
        if i > 0:
            step = time_s[i] - time_s[i - 1]
            if abs(step - last_step) > 1e-6:
                last_step = step
                for k in range(LANES):
                    lanes[KEEP_GNSS + k] = math.exp(-step / math.exp(thetas[k, TAU]))
                    lanes[KEEP_WANDER + k] = math.exp(-step / math.exp(thetas[k, WANDER_TAU]))
                    _oscillator(thetas[k], step, lanes, k)
            fresh = 0.0 if is_start[i] else 1.0
            _carry_covariance(lanes, fresh)
        _measure(lanes, from_north[i], from_east[i])
        for k in range(LANES):
            lanes[LOG_DETERMINANT + k] += math.log(lanes[S + k])
        if len(history) > 0:
            history[i, 0] = lanes[S]
            for a in range(STATES):  # a slice would take as long to compile as all the rest
                history[i, 1 + a] = lanes[K_0 + a * LANES]
        for j in range(width):
            _filter_column(columns[i, j], fresh, lanes, x[j], innovation[j])
            for m in range(j + 1):
                for k in range(LANES):
                    total[j, m, k] += innovation[j, k] * innovation[m, k] * lanes[INVERSE_S + k]
        if written < len(checkpoints) and i + 1 == checkpoints[written]:
            for k in range(LANES):
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
    gradient with respect to the state. ``innovation`` of shape (n,) is room to work in, as are the room's first states.
    """
    count, motion = len(time_s), math.exp(theta[MOTION])
    lanes, history, states = room.lanes, room.history, room.x[0]
    keep, H, x, r = states[:STATES], states[STATES : 2 * STATES], states[2 * STATES : 3 * STATES], states[-STATES:]
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
        _oscillator(theta, step, lanes, 0)
        H[0], H[1] = motion * from_north[i], motion * from_east[i]
        if is_forward:
            sway, rate = x[2], x[3]
            x[2], x[3] = lanes[F_22] * sway + lanes[F_23] * rate, lanes[F_32] * sway + lanes[F_33] * rate
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
            sway, rate = r[2], r[3]
            r[2], r[3] = lanes[F_22] * sway + lanes[F_32] * rate, lanes[F_23] * sway + lanes[F_33] * rate
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
    information, mean, inverse, draws, lanes = room.information, room.mean, room.inverse, room.draws, room.lanes
    for first in range(0, len(thetas), LANES):
        count = min(LANES, len(thetas) - first)
        for lane in range(LANES):  # those left over repeat the last draw
            for at in range(thetas.shape[1]):
                draws[lane, at] = thetas[first + min(lane, count - 1), at]
        standstill_filter(standstill[0], standstill[1], standstill[2], standstill[3], draws, lanes)
        taxi_filter(taxi[0], taxi[1], taxi[2], taxi[3], taxi[4], standstill[4], draws, checkpoints, room)
        for lane in range(count):
            k, rest = first + lane, 0.0
            for m in range(len(checkpoints)):
                rest = solve_normal_equations(information[lane, m], prior[0], prior[1], mean, inverse, room)
                for j in range(width - 1):
                    variance[k, m, j] = inverse[j, j]
            for j in range(width - 1):
                estimate[k, j] = mean[j]
            log_likelihood[k] = lanes[LOG_LIKELIHOOD + lane] - 0.5 * (lanes[LOG_DETERMINANT + lane] + rest)
            if len(prior_of_alone[0]) < width - 1:
                means, precisions = prior_of_alone
                solve_normal_equations(information[lane, last], means, precisions, mean, inverse, room)
            alone[k, 0], alone[k, 1] = mean[0], inverse[0, 0]
