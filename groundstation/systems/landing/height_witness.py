"""Touchdown by a height that reaches the ground, and a sink rate that ends there.

Samples descend, then perhaps float at a slow sink rate down to the contact, then are on the ground. The likelihood of a
contact is that of this order, with the start of the float, its sink rate and the error of the ground averaged out.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.landing.ground import (
    HEIGHT_CORRELATION_S,
    LATE_S,
    LATE_SIGMA_S,
    SPEED_NOISE_MPS,
    UNEVEN,
    Ground,
    Heights,
)
from groundstation.systems.landing.witnesses import Hint, decaying_sum

AIR_HEIGHT_M = 1.5  # mean height in the last seconds before a touchdown
AIR_SINK_MPS, AIR_SINK_SIGMA_MPS = 0.8, 0.8  # vertical speed there
FLOATS, FLOAT_S = 0.5, 4.0  # share of landings that float close to the ground, and for how long in the mean
FLOAT_SINKS_MPS = (0.04, 0.1, 0.25)
SPEED_CORRELATION_S = 0.5  # errors of neighbouring vertical speeds are one
CLOCK_S = 0.15  # between the times of topics
COARSE_S = 0.15  # step of contacts and starts of a float that are tried
NODES = np.linspace(-2.4, 2.4, 9)  # of the error of the ground that all samples share, in sigmas


def by_height(heights: Heights, ground: Ground | None, grid_s: FloatArray) -> Hint:
    """Likelihood of the contact by the heights of one source."""
    field = heights.kind.field.removesuffix("_m").replace("_", " ")
    name = "radio altitude" if heights.kind.topic_kind == "radio_altimeter" else f"height ({field})"
    rate = heights.rate_hz
    if ground is None:
        return Hint(name, heights.topic, rate, None, "no roll-out behind it")
    rows = (heights.time_s >= grid_s[0] - 1.0 / max(rate, 0.1)) & (heights.time_s <= grid_s[-1])
    if rows.sum() < 3:
        return Hint(name, heights.topic, rate, None, "too few samples")
    time_s, along, speed = heights.time_s[rows], heights.along_m[rows], heights.speed_mps[rows]
    above = heights.height_m[rows] - ground.height_m(along)
    if not (above > 3.0 * ground.noise_m).any():
        return Hint(name, heights.topic, rate, None, "does not come down to the ground of the roll-out")
    coarse_s = np.arange(grid_s[0], grid_s[-1] + COARSE_S, COARSE_S)
    shown = above - NODES[:, None] * ground.sigma_m(along, heights.kind)
    weight = min(1.0, 1.0 / (rate * HEIGHT_CORRELATION_S))
    log = _of_heights(time_s, shown, ground.noise_m, weight, coarse_s)
    sink = heights.down_mps[rows] + ground.slope * speed - ground.down_offset_mps
    known = np.isfinite(sink)
    if known.sum() >= 3:
        shown = sink[known] - NODES[:, None] * UNEVEN * speed[known]
        log = log + _of_sinks(time_s[known], shown, min(1.0, 1.0 / (rate * SPEED_CORRELATION_S)), coarse_s)
    likelihood = np.exp(np.interp(grid_s, coarse_s, log - log.max()))
    is_late = heights.kind.topic_kind == "gnss"
    late_s, clock_s = (LATE_S, float(np.hypot(LATE_SIGMA_S, CLOCK_S))) if is_late else (0.0, CLOCK_S)
    step = float(grid_s[1] - grid_s[0])
    reach = np.arange(-2.0, 2.0 + 0.5 * step, step)
    kernel = np.exp(-0.5 * ((reach + late_s) / clock_s) ** 2)
    return Hint(name, heights.topic, rate, np.convolve(likelihood, kernel / kernel.sum(), mode="same"))


def _of_heights(
    time_s: FloatArray, shown_m: FloatArray, noise_m: float, weight: float, contact_s: FloatArray
) -> FloatArray:
    """Log likelihood over contacts by heights above the ground.

    Shape (nodes, n) -> (contacts,). In a float the height is its sink rate times the time to the contact.
    """
    from scipy.special import log_ndtr

    before = np.searchsorted(time_s, contact_s, side="left")
    counted = weight * before.astype(float)
    off = np.log(noise_m * np.sqrt(2.0 * np.pi))

    def sums(values: FloatArray) -> FloatArray:
        return np.concatenate([np.zeros((len(NODES), 1)), np.cumsum(weight * values, axis=1)], axis=1)[:, before]

    mean = AIR_HEIGHT_M
    air = 0.5 * (noise_m / mean) ** 2 - shown_m / mean - np.log(mean) + log_ndtr(shown_m / noise_m - noise_m / mean)
    descent, ground = sums(air), sums(-0.5 * (shown_m / noise_m) ** 2 - off)
    since = time_s - contact_s[0]
    at = contact_s - contact_s[0]
    lasts = at[:, None] - at  # contact after the start of the float
    prior = np.where(lasts >= 0.0, -lasts / FLOAT_S, -np.inf) + np.log(COARSE_S / FLOAT_S)
    floats = []
    for sink in FLOAT_SINKS_MPS:
        first, second = sums(shown_m + sink * since), sums((shown_m + sink * since) ** 2)
        for node in range(len(NODES)):
            squares = second[node][:, None] - second[node]
            squares = squares - 2.0 * sink * at[:, None] * (first[node][:, None] - first[node])
            squares = squares + (sink * at[:, None]) ** 2 * (counted[:, None] - counted)
            every = descent[node] - 0.5 * squares / noise_m**2 - off * (counted[:, None] - counted) + prior
            floats.append(_log_sum(every, 1))
    floating = _log_sum(np.array(floats).reshape(len(FLOAT_SINKS_MPS), len(NODES), -1), 0)
    return _over_nodes(descent, floating - np.log(len(FLOAT_SINKS_MPS)), ground)


def _of_sinks(time_s: FloatArray, shown_mps: FloatArray, weight: float, contact_s: FloatArray) -> FloatArray:
    """Log likelihood over contacts by sink rates; high above, any is one of flight."""
    before = np.searchsorted(time_s, contact_s, side="left")

    def sums(values: FloatArray) -> FloatArray:
        return np.concatenate([np.zeros((len(NODES), 1)), np.cumsum(weight * values, axis=1)], axis=1)[:, before]

    sigma = float(np.hypot(AIR_SINK_SIGMA_MPS, SPEED_NOISE_MPS))
    any_high = np.clip(shown_mps, AIR_SINK_MPS - 3.0 * sigma, AIR_SINK_MPS + sigma)
    descent, ground = sums(_log_normal(any_high, AIR_SINK_MPS, sigma)), sums(_log_normal(shown_mps, 0.0))
    keep = float(np.exp(-COARSE_S / FLOAT_S))
    floats = []
    for sink in FLOAT_SINKS_MPS:
        floating = sums(_log_normal(shown_mps, sink))
        start = descent - floating
        highest = start.max(axis=1, keepdims=True)
        begun = decaying_sum(COARSE_S / FLOAT_S, keep, np.exp(start - highest))
        floats.append(np.log(begun + 1e-300) + highest + floating)
    return _over_nodes(descent, _log_sum(np.array(floats), 0) - np.log(len(FLOAT_SINKS_MPS)), ground)


def _over_nodes(descent: FloatArray, floating: FloatArray, ground: FloatArray) -> FloatArray:
    """Average the likelihood over the shared error.

    All are sums up to each contact, shape (nodes, contacts).
    """
    air = np.logaddexp(np.log(1.0 - FLOATS) + descent, np.log(FLOATS) + floating)
    return _log_sum(air + ground[:, -1:] - ground - 0.5 * NODES[:, None] ** 2, 0)


def _log_sum(values: FloatArray, axis: int) -> FloatArray:
    highest = values.max(axis=axis, keepdims=True)
    total = np.sum(np.exp(values - highest), axis=axis) + 1e-300
    return np.asarray(np.log(total) + np.squeeze(highest, axis=axis))


def _log_normal(values: FloatArray, mean: float, sigma: float = SPEED_NOISE_MPS) -> FloatArray:
    return np.asarray(-0.5 * ((values - mean) / sigma) ** 2 - np.log(sigma * np.sqrt(2.0 * np.pi)))
