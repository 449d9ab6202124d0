"""Constant offsets of an on-board filter with their sigmas: turn, place, delay.

All are found robustly: a filter that went wrong for a third of the log moves none of them.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.methods.intervals import effective_samples
from groundstation.systems.trajectory.solution import FloatArray

SIGMA_OF_MEDIAN = 1.4826  # sigma over the median size of normal errors
OWN_S = 60.0  # errors of the smoothed solution last so long
TUKEY = 4.685  # sigmas from which an error has no weight
STEPS = 8
ARM_SIGMA_M, DATUM_SIGMA_M = 30.0, 1000.0  # priors of an antenna's place on the vehicle, and of another datum
ARM_FLOOR_M = 0.03  # what the velocities of one filter may be apart from its attitude by
FEWEST = 30
LEVEL_SHARE = 0.4  # of the values, in the narrowest band
MOST_WIDTHS = 10.0  # of it, in 90 % of the values: normal ones have 3.1
TURNED = 0.7  # mean of the headings as unit vectors: above it the vehicle has not turned enough
LEAST_SCALE = 1e-9


class Constant(NamedTuple):
    """Constant with its sigma."""

    value: float
    sigma: float

    @property
    def is_told(self) -> bool:
        """Tell whether it differs from zero beyond 95 %."""
        return abs(self.value) > NORMAL_95 * self.sigma


class PlaceOffset(NamedTuple):
    """Offset on the vehicle and on the earth; ``fitted``, north and east, has shape (n, 2)."""

    forward: Constant
    right: Constant
    north: Constant
    east: Constant
    fitted: FloatArray


def centre_of(values: FloatArray, own_sigma: FloatArray, length_s: float) -> Constant:
    """Return the median and its sigma; NaN is passed over.

    The sigma has the scatter of the values, correlated as they are, and that of the smoothed solution, of which a log
    of ``length_s`` has an independent value each minute.
    """
    known = _one_level(values[np.isfinite(values)])
    if not len(known):
        return Constant(float("nan"), float("inf"))
    middle = float(np.median(known))
    own = float(np.sqrt(np.nanmedian(own_sigma**2) / max(length_s / OWN_S, 1.0)))
    return Constant(middle, float(np.hypot(_sigma_of_mean(known - middle), own)))


def _one_level(values: FloatArray) -> FloatArray:
    """Return the values of the fullest level where they lie at several; else all of them."""
    count = int(LEVEL_SHARE * len(values))
    if count < FEWEST:
        return values
    ordered = np.sort(values)
    widths = ordered[count:] - ordered[:-count]
    first = int(np.argmin(widths))
    low, high, width = ordered[first], ordered[first + count], max(float(widths[first]), LEAST_SCALE)
    is_between = not low - width <= np.median(values) <= high + width
    if not is_between and float(np.ptp(np.percentile(values, (5.0, 95.0)))) < MOST_WIDTHS * width:
        return values
    return np.asarray(values[(values >= low - width) & (values <= high + width)])


def constant_turn(ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Return the turn b from c, shape (3, 3), of ``theirs = ours @ turn``.

    These are rotations n from b and n from c, shape (n, 3, 3).
    """
    relative = np.einsum("nji,njk->nik", ours, theirs)
    left, _unused, right = np.linalg.svd(relative.mean(axis=0))
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    for _ in range(STEPS):
        rest = np.einsum("ji,njk->nik", turn, relative)
        twice = np.column_stack(
            [rest[:, 2, 1] - rest[:, 1, 2], rest[:, 0, 2] - rest[:, 2, 0], rest[:, 1, 0] - rest[:, 0, 1]]
        )
        step = 0.5 * np.median(twice, axis=0)
        turn = turn @ _rotation(step)
        if np.abs(step).max() < 1e-9:
            break
    return np.asarray(turn)


def euler_deg(n_from_b: FloatArray) -> FloatArray:
    """Return roll, pitch and heading, shape (n, 3), of rotations, shape (n, 3, 3)."""
    roll = np.arctan2(n_from_b[:, 2, 1], n_from_b[:, 2, 2])
    pitch = -np.arcsin(np.clip(n_from_b[:, 2, 0], -1.0, 1.0))
    heading = np.arctan2(n_from_b[:, 1, 0], n_from_b[:, 0, 0])
    return np.asarray(np.rad2deg(np.column_stack([roll, pitch, heading])))


def arm_by_turning(error_mps: FloatArray, heading_deg: FloatArray, rate_radps: FloatArray) -> tuple[Constant, Constant]:
    """Return the place on the vehicle, forward and right, that its turning shows."""
    known = np.isfinite(error_mps).all(axis=1) & np.isfinite(heading_deg) & np.isfinite(rate_radps)
    if known.sum() < FEWEST:
        return Constant(0.0, ARM_SIGMA_M), Constant(0.0, ARM_SIGMA_M)
    heading, rate = np.deg2rad(heading_deg[known]), rate_radps[known]
    sin, cos = rate * np.sin(heading), rate * np.cos(heading)
    design = np.array([[-sin, -cos], [cos, -sin]]).transpose(2, 0, 1)
    solved, covariance = _robust_fit(design, error_mps[known], np.full(2, ARM_SIGMA_M), np.zeros(2))
    forward, right = np.sqrt(np.diag(covariance) + ARM_FLOOR_M**2)
    return Constant(float(solved[0]), float(forward)), Constant(float(solved[1]), float(right))


def place_offset(
    error_m: FloatArray,
    heading_deg: FloatArray,
    own_sigma_m: FloatArray,
    length_s: float,
    arm: tuple[Constant, Constant],
) -> PlaceOffset:
    """Fit a constant place on the vehicle and one on the earth to errors, shape (n, 2).

    ``arm`` is what velocities already say of the former. The latter is left out where the vehicle has not turned: the
    two are then the same.
    """
    known = np.isfinite(error_m).all(axis=1) & np.isfinite(heading_deg)
    heading = np.deg2rad(heading_deg[known])
    sin, cos, one, none = np.sin(heading), np.cos(heading), np.ones(len(heading)), np.zeros(len(heading))
    design = np.array([[cos, -sin, one, none], [sin, cos, none, one]]).transpose(2, 0, 1)
    has_turned = len(heading) > 0 and np.hypot(sin.mean(), cos.mean()) < TURNED
    prior = np.array([arm[0].sigma, arm[1].sigma, DATUM_SIGMA_M, DATUM_SIGMA_M])
    prior[2:] = prior[2:] if has_turned else LEAST_SCALE
    error = error_m[known]
    if not len(error):
        nothing = Constant(0.0, float("inf"))
        return PlaceOffset(nothing, nothing, nothing, nothing, np.zeros_like(error_m))
    solved, covariance = _robust_fit(design, error, prior, np.array([arm[0].value, arm[1].value, 0.0, 0.0]))
    own = np.nanmedian(own_sigma_m[known] ** 2) / max(length_s / OWN_S, 1.0)
    sigma = np.sqrt(np.minimum(np.diag(covariance) + own, prior**2))
    full = np.deg2rad(np.nan_to_num(heading_deg))
    fitted = np.column_stack(
        [
            np.cos(full) * solved[0] - np.sin(full) * solved[1] + solved[2],
            np.sin(full) * solved[0] + np.cos(full) * solved[1] + solved[3],
        ]
    )
    forward, right, north, east = (
        Constant(float(value), float(spread)) for value, spread in zip(solved, sigma, strict=True)
    )
    return PlaceOffset(forward, right, north, east, fitted)


def time_shift(error: FloatArray, slope: FloatArray) -> Constant:
    """Fit the delay in ``error = -delay * rate``, both of shape (n, k).

    Each of the k quantities has a constant of its own, and counts by its scatter. Sigma is infinite without motion.
    """
    x, y = [], []
    for one, rate in zip(error.T, slope.T, strict=True):
        known = np.isfinite(one) & np.isfinite(rate)
        if known.any():
            rest = one - np.median(one[known])
            scale = max(SIGMA_OF_MEDIAN * float(np.median(np.abs(rest[known]))), LEAST_SCALE)
            x.append(np.where(known, -rate, 0.0) / scale)
            y.append(np.where(known, rest, 0.0) / scale)
    if not x:
        return Constant(0.0, float("inf"))
    rates, rests, delay = np.array(x), np.array(y), 0.0
    weight = np.ones_like(rates)
    for _ in range(STEPS):
        weight = _tukey(rests - delay * rates)
        information = float(np.sum(weight * rates**2))
        if not information > 0.0:
            return Constant(0.0, float("inf"))
        delay = float(np.sum(weight * rates * rests)) / information
    score = np.sum(weight * rates * (rests - delay * rates), axis=0)
    return Constant(delay, _sigma_of_mean(score) * len(score) / float(np.sum(weight * rates**2)))


def _robust_fit(
    design: FloatArray, error: FloatArray, prior_sigma: FloatArray, prior_mean: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the constants and their covariance; design (n, 2, q), error (n, 2)."""
    rest = error - np.median(error, axis=0)
    prior, scale, solved = np.diag(prior_sigma**-2.0), 1.0, np.zeros(design.shape[2])
    normal, weight = prior, np.ones(len(error))
    for step in range(2 * STEPS):
        size = np.hypot(rest[:, 0], rest[:, 1])
        scale = max(float(np.median(size)) / 1.1774, LEAST_SCALE)  # the median of a vector's length in sigmas
        weight = _tukey(size / scale) if step else np.where(size <= 3.0 * scale, 1.0, 0.0)
        normal = np.einsum("n,nij,nik->jk", weight, design, design) + prior * scale**2
        right = np.einsum("n,nij,ni->j", weight, design, error) + prior @ prior_mean * scale**2
        solved = np.linalg.solve(normal, right)
        rest = error - design @ solved
    clipped = np.clip(rest, -TUKEY * scale, TUKEY * scale)
    repeats = max(len(error) / min(effective_samples(one) for one in clipped.T), 1.0)
    return solved, np.asarray(scale**2 * repeats * np.linalg.inv(normal))


def _tukey(deviation: FloatArray) -> FloatArray:
    """Return the weights of deviations in sigmas, zero beyond 4.7."""
    return np.asarray(np.where(np.abs(deviation) < TUKEY, (1.0 - (deviation / TUKEY) ** 2) ** 2, 0.0))


def _sigma_of_mean(centred: FloatArray) -> float:
    """Return the standard error of a mean of correlated values, outliers held back."""
    scatter = SIGMA_OF_MEDIAN * float(np.median(np.abs(centred)))
    if not scatter > 0.0:
        scatter = float(np.std(centred))
    held = np.clip(centred, -3.0 * scatter, 3.0 * scatter)
    return float(scatter / effective_samples(held) ** 0.5)


def _rotation(vector: FloatArray) -> FloatArray:
    """Return the rotation by a vector, rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-12:
        return np.asarray(np.eye(3) + skew)
    return np.asarray(np.eye(3) + np.sin(angle) / angle * skew + (1.0 - np.cos(angle)) / angle**2 * skew @ skew)
