"""Times of an inertial unit on a line: its clock is better than the stamps of its samples.

Stamps are late by a few milliseconds, come in batches, repeat or go back; the unit itself samples evenly, or tells the
length of each interval.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TRUSTED_S = 1e-4  # stamps that are so even are left as they are
TRUSTED_STEPS = 0.02  # likewise, of a step
BLOCK_S = 10.0  # over which the middle of the stamps is taken
FEWEST_OF_BLOCK = 50
WINDOW, MOST_OF_WINDOW = 25, 500  # samples either side of a place where some may be lost
BATCHED_SHARE = 0.3  # of steps next to nothing: several samples share a stamp
NOTHING = 0.2  # of a step
WANDERS = 3.0  # residuals of a line against steps: 0.7 for even samples, 5 and more for a random walk
RATE_CHANGES = 1.25
WHOLE = 0.25  # of a step: nearness to a whole number of steps
FEW = 0.005
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class Line:
    """Times of samples without jitter.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Strictly increasing within a block.
    residual_s : ndarray, shape (n,)
        Stamp minus time; 0 where the stamps were left.
    lost : int
        Samples that are missing inside.
    is_moved : bool
    wanders : bool
        The steps are uneven in themselves: no line fits.
    """

    time_s: FloatArray
    residual_s: FloatArray
    lost: int = 0
    is_moved: bool = False
    wanders: bool = False


def blocks_of(stamp_s: FloatArray, segment_s: float) -> list[slice]:
    """Return stretches of samples between long gaps, steps back, and changes of the rate."""
    step = np.diff(stamp_s)
    edges = np.flatnonzero((step > segment_s) | (step < -segment_s)) + 1
    found = []
    for start, end in zip((0, *edges.tolist()), (*edges.tolist(), len(stamp_s)), strict=True):
        inner = _rate_edges(stamp_s[start:end])
        places = [start, *(start + at for at in inner), end]
        found += [slice(a, b) for a, b in pairwise(places) if b > a]
    return found


def on_a_line(stamp_s: FloatArray, interval_s: FloatArray | None = None) -> Line:
    """Return the times of evenly sampled data from jittered stamps.

    Parameters
    ----------
    stamp_s : ndarray, shape (n,)
        In the order in which the unit made the samples.
    interval_s : ndarray, shape (n,), optional
        Length of the interval that ends at each sample, where the unit tells it.

    Notes
    -----
    The samples are counted, lost ones too; the middle of stamp minus count times step over blocks of ten seconds,
    joined by straight lines, is the offset of the unit's clock.
    """
    count = len(stamp_s)
    untouched = Line(stamp_s, np.zeros(count))
    if count < 2:
        return untouched
    steps = np.diff(stamp_s)
    if interval_s is not None and (steps > 0.0).all() and _agree(steps, interval_s[1:]):
        return untouched
    step_s, batch = _usual_step(stamp_s, interval_s)
    if not step_s > 0.0:
        return untouched
    told_s = np.full(count, step_s) if interval_s is None else interval_s
    own_s: FloatArray = np.concatenate(([0.0], np.cumsum(told_s[1:])))
    lost = _lost_before(stamp_s - own_s, steps, step_s, batch, interval_s)
    own_s = np.asarray(own_s + step_s * np.cumsum(lost))
    offset_s = _offset(own_s, stamp_s - own_s, step_s)
    residual_s = stamp_s - own_s - offset_s
    time_s = own_s + offset_s
    spread_s = MAD_TO_SIGMA * float(np.median(np.abs(residual_s)))
    small_s = max(TRUSTED_S, TRUSTED_STEPS * step_s)
    is_even = max(spread_s, float(np.percentile(np.abs(residual_s), 99.0)) / 3.0) <= small_s
    total = int(lost.sum())
    if is_even and (steps > 0.0).all():
        return Line(stamp_s, residual_s, total)
    uneven_s = float(np.std(np.clip(steps, *np.percentile(steps, (1.0, 99.0)))))
    if (batch == 1 and spread_s > max(WANDERS * uneven_s, small_s)) or not (np.diff(time_s) > 0.0).all():
        return Line(stamp_s, np.zeros(count), wanders=True)
    return Line(time_s, residual_s, total, is_moved=True)


def _agree(steps: FloatArray, interval_s: FloatArray) -> bool:
    """Tell whether the stamps have no jitter.

    Most of their steps are the intervals, and none is shorter.
    """
    more_s, small_s = steps - interval_s, np.maximum(TRUSTED_S, TRUSTED_STEPS * interval_s)
    return bool(np.mean(np.abs(more_s) < small_s) > 0.5 and np.mean(more_s < -small_s) < FEW)


def _usual_step(stamp_s: FloatArray, interval_s: FloatArray | None) -> tuple[float, int]:
    """Return the step of a unit's clock, and how many samples share a stamp."""
    count = len(stamp_s)
    mean_s = _mean_step(stamp_s)
    steps = np.diff(stamp_s)
    shared = float(np.mean(steps < NOTHING * mean_s)) if mean_s > 0.0 else 0.0
    batch = round(1.0 / max(1.0 - shared, 1.0 / count)) if shared > BATCHED_SHARE else 1
    if interval_s is not None:
        return float(np.median(interval_s)), batch
    if batch > 1:
        return mean_s, batch
    median_s = float(np.median(steps))
    if median_s > 0.0 and mean_s > (1.0 + WHOLE / 5.0) * median_s:  # some are lost, unless the digits are few
        whole = np.rint(steps / median_s)
        near = np.abs(steps / median_s - whole) < WHOLE
        if np.mean(near) > 0.9 and np.mean(steps[near & (whole >= 1)] > 1.5 * median_s) > 0.01:
            kept = near & (whole >= 1)
            return float(steps[kept].sum() / whole[kept].sum()), 1
    return mean_s, 1


def _mean_step(stamp_s: FloatArray) -> float:
    """Return the median over windows of the mean step."""
    count = len(stamp_s)
    window = int(np.clip(count // 8, 1, 400))
    return float(np.median((stamp_s[window:] - stamp_s[:-window]) / window))


def _lost_before(
    residual_s: FloatArray, steps: FloatArray, step_s: float, batch: int, interval_s: FloatArray | None
) -> IntArray:
    """Return how many samples are missing before each one."""
    count = len(residual_s)
    lost = np.zeros(count, dtype=np.int64)
    expected = steps / step_s if interval_s is None else 1.0 + (steps - interval_s[1:]) / step_s
    whole = np.rint(expected)
    if batch == 1 and np.mean(np.abs(expected - whole) < WHOLE) > 0.95 and (whole >= 1).all():
        lost[1:] = whole.astype(np.int64) - 1
        if 2 * int(lost.sum()) <= count:
            return lost
        lost[:] = 0
    half = 3 * batch if batch > 1 else _enough(steps, step_s)
    if count < 4 * half:
        return _by_single_steps(lost, steps, step_s, batch)
    from scipy.ndimage import median_filter  # with scipy.special 0.2 s, which clocks without losses are spared

    for _ in range(20):
        level = median_filter(residual_s - step_s * np.cumsum(lost), 2 * half + 1, mode="nearest")
        rise = np.zeros(count)
        rise[half:-half] = level[2 * half :] - level[: -2 * half]
        places = _peaks(rise, step_s, half)
        if not places:
            return lost
        for at in places:
            around = residual_s[at - half : at + half] - step_s * np.cumsum(lost)[at - half : at + half]
            place = _change(around)
            missing = round(float(np.median(around[place:]) - np.median(around[:place])) / step_s)
            lost[at - half + place] += max(1, missing)
    return lost


def _enough(steps: FloatArray, step_s: float) -> int:
    """Return how many stamps have a middle that is known to an eighth of a step."""
    jitter_s = MAD_TO_SIGMA * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
    return int(np.clip(2.0 * (10.0 * jitter_s / step_s) ** 2, WINDOW, MOST_OF_WINDOW))


def _change(values: FloatArray) -> int:
    """Return the first value of the upper of two levels."""
    quarter = max(len(values) // 4, 1)
    middle = 0.5 * (np.median(values[:quarter]) + np.median(values[-quarter:]))
    return int(np.clip(np.argmin(np.cumsum(values - middle)) + 1, quarter // 2, len(values) - quarter // 2))


def _peaks(rise: FloatArray, step_s: float, half: int) -> list[int]:
    """Return places where the level of the stamps rises by most of a step or more."""
    places: list[int] = []
    high = np.flatnonzero(rise > 0.7 * step_s)
    for part in np.split(high, np.flatnonzero(np.diff(high) > 1) + 1) if high.size else ():
        if part.size > half // 2:
            at = int(part[np.argmax(rise[part])])
            if not places or at - places[-1] > 2 * half:
                places.append(at)
    return places


def _by_single_steps(lost: IntArray, steps: FloatArray, step_s: float, batch: int) -> IntArray:
    """Return losses of a short stretch: steps of two or more."""
    if batch == 1:
        lost[1:] = np.maximum(np.rint(steps / step_s).astype(np.int64) - 1, 0)
        if np.abs(steps / step_s - 1.0 - lost[1:]).max(initial=0.0) > WHOLE:
            lost[:] = 0
    return lost


def _offset(own_s: FloatArray, residual_s: FloatArray, step_s: float) -> FloatArray:
    """Return the offset of the stamps from the unit's own clock.

    It is the middles of blocks, joined by straight lines.
    """
    span_s = float(own_s[-1] - own_s[0])
    per_block = max(FEWEST_OF_BLOCK, round(BLOCK_S / step_s))
    blocks = len(own_s) // per_block
    if blocks < 2 or span_s <= 0.0:
        return np.full(len(own_s), np.median(residual_s)) + _slope(own_s, residual_s)
    middles, levels = [], []
    for part in np.array_split(np.arange(len(own_s)), blocks):
        middles.append(float(np.mean(own_s[part])))
        levels.append(float(np.median(residual_s[part])))
    x, y = np.array(middles), np.array(levels)
    inner = np.interp(own_s, x, y)
    before, after = own_s < x[0], own_s > x[-1]
    inner[before] += (own_s[before] - x[0]) * (y[1] - y[0]) / (x[1] - x[0])
    inner[after] += (own_s[after] - x[-1]) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.asarray(inner)


def _slope(own_s: FloatArray, residual_s: FloatArray) -> FloatArray:
    """Return a straight line through the residuals of a short stretch, by its thirds."""
    third = len(own_s) // 3
    if third < 5:
        return np.zeros(len(own_s))
    first, last = slice(0, third), slice(len(own_s) - third, None)
    run_s = float(np.mean(own_s[last]) - np.mean(own_s[first]))
    slope = float(np.median(residual_s[last]) - np.median(residual_s[first])) / run_s if run_s > 0.0 else 0.0
    return np.asarray(slope * (own_s - np.mean(own_s)))


def _rate_edges(stamp_s: FloatArray) -> list[int]:
    """Return places where the rate changes for good."""
    count = len(stamp_s)
    window = 2 * WINDOW
    if count < 6 * window:
        return []
    mean_s = (stamp_s[window::window] - stamp_s[:-window:window]) / window
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(mean_s, 2, mode="edge"), 5)
    smooth = np.maximum(np.sort(beside, axis=1)[:, 2], 1e-9)  # medians of five
    edges: list[int] = []
    level = float(smooth[0])
    for at in range(1, len(smooth)):
        ratio = smooth[at] / level
        if max(ratio, 1.0 / ratio) > RATE_CHANGES:
            other = float(smooth[min(at + 1, len(smooth) - 1)])
            low, high = max(0, (at - 3) * window), min(count - 1, (at + 3) * window)
            drift = np.cumsum(np.diff(stamp_s[low : high + 1]) - 0.5 * (level + other))
            edges.append(low + 1 + int(np.argmin(drift) if other > level else np.argmax(drift)))
            level = other
    return sorted({at for at in edges if 0 < at < count})
