"""Line fitted to the difference of two clocks, with its uncertainty.

The line is broken where one of the clocks was set or changed its rate. The difference of the two is fitted by a line
through the medians of blocks of samples, which late messages do not move. Steps are found where the medians of a few
samples before and after differ; changes of rate where two lines explain the blocks much better than one. Standard
errors allow for noise that is correlated from block to block, for the few blocks (Student) and for readings that are
rounded: 1.96 of them hold the truth in 95 of 100 logs, in 92 when noise is correlated over a tenth of the log.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_relation import ClockBreak, ClockSegment

FloatArray = NDArray[np.float64]

BLOCKS, LEAST_IN_BLOCK, FEWEST_BLOCKS = 32, 3, 4  # blocks of a line, samples in a block, least number of blocks
SPLIT_BLOCKS, LEAST_IN_SPLIT_BLOCK, SIDE_BLOCKS = 96, 5, 6  # where a change of rate is looked for
SPLIT_GAIN, SPLIT_RATIO = 16.0, 9.0  # least gain of two lines over one; by tests/integrity/test_clock_fit.py
SIDE_SAMPLES = 5  # samples on either side of a step
MOST_BREAKS = 40
JITTER_TIMES = 8.0
SIGNIFICANT = 4.0  # standard errors
FLOOR_S = 1e-6
SETTLED_S = 1e-9  # a line that moves less is found
_MAD = 1.4826


@dataclass(frozen=True)
class Fitted:
    """Segments, the breaks between them, and the scatter of samples about the lines.

    The scatter is 1.4826 x the median, in seconds.
    """

    segments: tuple[ClockSegment, ...] = ()
    breaks: tuple[ClockBreak, ...] = ()
    residual_s: float = 0.0


class _Line(NamedTuple):
    """Line offset + slope (t - middle_s), with standard errors.

    A slope with an infinite standard error is not known.
    """

    middle_s: float
    offset_s: float
    slope: float
    offset_sigma_s: float
    slope_sigma: float

    def at(self, time_s: FloatArray | float) -> FloatArray:
        return np.asarray(self.offset_s + self.slope * (np.asarray(time_s) - self.middle_s))

    def sigma_at(self, time_s: float) -> float:
        away = 0.0 if np.isinf(self.slope_sigma) else self.slope_sigma * (time_s - self.middle_s)
        return float(np.hypot(self.offset_sigma_s, away))


def fit_relation(
    time_ns: Int64Array, reference_ns: Int64Array, *, step_s: float, observable_ppm: float, bound_s: float = 0.0
) -> Fitted:
    """Fit reference minus recorder time.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (n,)
        Corrected recorder time, in order, none negative, n at least 1.
    reference_ns : ndarray of int64, shape (n,)
        The reference at those moments, none negative.
    step_s : float
        Smaller steps are none.
    observable_ppm : float
        A drift is observed when twice its standard error is less, or it is four times its standard error.
    bound_s : float
        Largest rounding of readings of the reference, in a way that scatter need not show.

    Returns
    -------
    Fitted

    Examples
    --------
    A recorder that is fast by 50 ppm counts 100.005 s in 100 s:

    >>> true_ns = np.arange(0, 101) * NS_PER_S
    >>> found = fit_relation(true_ns + true_ns // 20_000, true_ns, step_s=0.25, observable_ppm=100.0)
    >>> [round(segment.drift_ppm, 3) for segment in found.segments], found.breaks
    ([50.0], ())
    """
    difference_ns = reference_ns - time_ns
    zero_ns, base_ns = int(time_ns[0]), int(np.sort(difference_ns)[len(difference_ns) // 2])
    time_s = (time_ns - zero_ns) / NS_PER_S
    whole_s = difference_ns // NS_PER_S - base_ns // NS_PER_S  # nanoseconds less nanoseconds may not fit 64 bits
    offset_s = whole_s + (difference_ns % NS_PER_S - base_ns % NS_PER_S) / NS_PER_S
    pieces = _pieces(_steps(time_s, offset_s, step_s, bound_s), len(time_s))
    rates: set[int] = set()
    for first, stop in pieces:
        rates |= _rate_changes(time_s, offset_s, first, stop, bound_s)
    steps = {first for first, _stop in pieces[1:]}
    pieces = _pieces(sorted(steps | rates), len(time_s))
    lines = [_line(time_s[first:stop], offset_s[first:stop], bound_s) for first, stop in pieces]
    segments = []
    for (first, stop), line in zip(pieces, lines, strict=True):
        start_ns, end_ns = int(time_ns[first]), int(time_ns[stop - 1])
        middle_s = 0.5 * float(time_s[first] + time_s[stop - 1])
        offset_ns = base_ns + round(float(line.at(middle_s)) * NS_PER_S)
        whole = ClockSegment(start_ns, end_ns, stop - first, offset_ns, line.sigma_at(middle_s))
        segments.append(_with_drift(whole, line, observable_ppm))
    changes = [_difference(before.drift_ppm, after.drift_ppm) for before, after in pairwise(segments)]
    breaks = tuple(
        replace(_break(time_s, first, *pair, is_step=first in steps, zero_ns=zero_ns), drift_change_ppm=change)
        for (first, _stop), pair, change in zip(pieces[1:], pairwise(lines), changes, strict=True)
    )
    residual_s = np.concatenate(
        [offset_s[first:stop] - line.at(time_s[first:stop]) for (first, stop), line in zip(pieces, lines, strict=True)]
    )
    return Fitted(tuple(segments), breaks, _scatter(residual_s))


def _difference(before: float | None, after: float | None) -> float | None:
    return None if before is None or after is None else after - before


def _pieces(starts: list[int], count: int) -> list[tuple[int, int]]:
    ends = [0, *starts, count]
    return list(pairwise(ends))


def _with_drift(segment: ClockSegment, line: _Line, observable_ppm: float) -> ClockSegment:
    """Convert the slope to drift: the recorder's rate is 1 / (1 + slope) of the reference's."""
    if np.isinf(line.slope_sigma) or line.slope <= -1.0:
        return segment
    drift_ppm = 1e6 * (1.0 / (1.0 + line.slope) - 1.0)
    sigma_ppm = 1e6 * line.slope_sigma / (1.0 + line.slope) ** 2
    is_observed = NORMAL_95 * sigma_ppm <= observable_ppm or abs(drift_ppm) > SIGNIFICANT * sigma_ppm
    return replace(segment, drift_ppm=drift_ppm if is_observed else None, drift_sigma_ppm=sigma_ppm)


def _break(time_s: FloatArray, first: int, before: _Line, after: _Line, *, is_step: bool, zero_ns: int) -> ClockBreak:
    """Place the break: a step between two samples, a change of rate where two lines meet."""
    at_s = 0.5 * float(time_s[first - 1] + time_s[first])
    sigma_s = float(time_s[first] - time_s[first - 1]) / 12**0.5
    step_s = float(after.at(at_s) - before.at(at_s))
    step_sigma_s = float(np.hypot(before.sigma_at(at_s), after.sigma_at(at_s)))
    if is_step:
        return ClockBreak(zero_ns + round(at_s * NS_PER_S), sigma_s, "step", step_s, step_sigma_s)
    change = after.slope - before.slope
    if change:  # lines of one slope meet nowhere
        meets_s = at_s - step_s / change
        sigma_s = float(np.hypot(sigma_s, step_sigma_s / abs(change)))
        if abs(meets_s - at_s) < SIGNIFICANT * sigma_s:  # else the rate changed by and by
            at_s = meets_s
    return ClockBreak(zero_ns + round(at_s * NS_PER_S), sigma_s, "rate", 0.0, step_sigma_s)


def _scatter(residual_s: FloatArray) -> float:
    return _MAD * _median(np.abs(residual_s))


def _median(values: FloatArray) -> float:
    """Return the median of finite values, as numpy's but without its checks."""
    middle = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, middle)[middle])
    ordered = np.partition(values, (middle - 1, middle))
    return 0.5 * float(ordered[middle - 1] + ordered[middle])


class _Blocks:
    """Blocks of equal numbers of samples; left-over samples lie between the blocks."""

    def __init__(self, samples: int, blocks: int) -> None:
        self._shape = blocks, samples // blocks
        self._starts = (np.arange(blocks) * (samples / blocks)).astype(np.int64)
        self._is_all = samples % blocks == 0
        self._places = None if self._is_all else self._starts[:, None] + np.arange(self._shape[1])

    def medians(self, values: FloatArray) -> FloatArray:
        """Median of each block."""
        middle, is_odd = divmod(self._shape[1], 2)
        rows = values.reshape(self._shape) if self._places is None else values[self._places]
        ordered = np.partition(rows, middle if is_odd else (middle - 1, middle), axis=1)
        return np.asarray(ordered[:, middle] if is_odd else 0.5 * (ordered[:, middle - 1] + ordered[:, middle]))

    def medians_in_order(self, values: FloatArray) -> FloatArray:
        """Median of each block of values that never fall: the one in the middle."""
        middle, is_odd = divmod(self._shape[1], 2)
        at = self._starts + middle
        return np.asarray(values[at] if is_odd else 0.5 * (values[at - 1] + values[at]))


def _medians_of_five(values: FloatArray) -> FloatArray:
    """Median of each value and the four behind it, shape (n - 4,), by comparing whole columns."""
    a, b, c, d, e = (values[at : len(values) - 4 + at] for at in range(5))
    low, high = np.minimum(a, b), np.maximum(a, b)
    low, high = np.maximum(low, np.minimum(c, d)), np.minimum(high, np.maximum(c, d))  # neither least nor most of four
    return np.asarray(np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), e)))


def _student(freedom: float) -> float:
    """Factor from 1.96 to the 0.975 quantile of Student's t, by the expansion in 1 / freedom.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 26.7.5; at 2 degrees of freedom 5 % low.
    """
    z, n = NORMAL_95, freedom
    second, third = 5 * z**5 + 16 * z**3 + 3 * z, 3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z
    return (z + (z**3 + z) / (4 * n) + second / (96 * n**2) + third / (384 * n**3)) / z


def _correlation(residual: FloatArray) -> float:
    """Return the correlation of neighbouring residuals of a line, in [0, 0.95].

    It is corrected for its bias, -(2 + 4 r) / n.

    Source: Stine and Shaman, A fixed point characterization for bias of autoregressive estimators, Annals of Statistics
    17 (1989) 1275; tests/integrity/test_clock_fit.py.
    """
    power = float(residual @ residual)
    if power == 0.0:
        return 0.0
    found = float(residual[1:] @ residual[:-1]) / power
    return float(np.clip(found + (2.0 + 4.0 * max(found, 0.0)) / len(residual), 0.0, 0.95))


def _line(time_s: FloatArray, offset_s: FloatArray, bound_s: float) -> _Line:
    """Line through the medians of blocks of equal numbers of samples."""
    blocks = min(BLOCKS, len(time_s) // LEAST_IN_BLOCK)
    rounding_s = max(bound_s, FLOOR_S)
    of_blocks = _Blocks(len(time_s), max(blocks, 1))
    at_s = of_blocks.medians_in_order(time_s)
    middle_s = float(at_s.mean())
    lever_s = at_s - middle_s
    if blocks < FEWEST_BLOCKS or np.ptp(lever_s) == 0.0:
        level_s = _median(offset_s)
        sigma_s = float(np.hypot(_scatter(offset_s - level_s), rounding_s / 12**0.5))
        return _Line(middle_s, level_s, 0.0, sigma_s, float("inf"))
    lever_s -= lever_s.mean()  # the first mean of times that hardly differ is rounded
    power = float(lever_s @ lever_s)
    offset = slope = 0.0
    span_s = float(time_s[-1] - time_s[0])
    left_s = offset_s
    residual = of_blocks.medians(left_s)
    for _turn in range(4):  # medians of what a line leaves, for a steep line moves them within a block
        more, steeper = float(residual.mean()), float(lever_s @ residual) / power
        offset, slope = offset + more, slope + steeper
        left_s = offset_s - offset - slope * (time_s - middle_s)
        residual = of_blocks.medians(left_s)
        if abs(more) + abs(steeper) * span_s < SETTLED_S:
            break
    offset_sigma_s, slope_sigma = _standard_errors(residual, lever_s)
    scatter_s = _scatter(left_s)
    hidden = 0.0 if scatter_s > 0.2 * rounding_s else rounding_s / (3**0.5 * span_s)
    return _Line(
        middle_s,
        offset,
        slope,
        float(np.hypot(offset_sigma_s, rounding_s / 12**0.5)),
        float(np.hypot(slope_sigma, hidden)),
    )


def _standard_errors(residual: FloatArray, lever: FloatArray) -> tuple[float, float]:
    """Return the standard errors of level and slope of a line, from its residuals.

    The noise is taken to be correlated from neighbour to neighbour. The more it is, the fewer the degrees of freedom:
    (n - 2) (1 - r) / (1 + r).
    """
    count, power, correlation = len(residual), float(lever @ lever), _correlation(residual)
    places = np.arange(count)
    correlated = (correlation**places)[np.abs(places[:, None] - places)]
    design = np.column_stack([np.full(count, count**-0.5), lever / power**0.5])
    spread = design.T @ correlated @ design
    variance = float(residual @ residual) / (count - float(np.trace(spread)))
    factor = _student(max((count - 2) * (1.0 - correlation) / (1.0 + correlation), 2.0))
    level, slope = factor * np.sqrt(variance * np.diag(spread))
    return float(level / count**0.5), float(slope / power**0.5)


def _steps(time_s: FloatArray, offset_s: FloatArray, step_s: float, bound_s: float) -> list[int]:
    """Find the first samples after steps.

    At a step the medians of a few samples before and after differ by more than their jitter.
    """
    count, side = len(time_s), SIDE_SAMPLES
    if count < 2 * side:
        return []
    spans, changes = np.diff(time_s), np.diff(offset_s)
    goes_on = spans > 0
    slope = _median(changes[goes_on] / spans[goes_on]) if goes_on.any() else 0.0
    level = offset_s - slope * time_s
    jitter_s = _scatter(np.diff(level)) / 2**0.5
    least_s = max(step_s, JITTER_TIMES * jitter_s, 1.5 * bound_s)
    middles = _medians_of_five(level)
    size = np.abs(middles[side:] - middles[:-side])  # size of a step before sample side + place
    found: list[int] = []
    for place in np.flatnonzero(size > least_s).tolist():
        at = place + side
        if found and at - found[-1] < 2 * side:  # the same step
            continue
        window = slice(at - side, min(at + 3 * side, count))
        before, after = middles[place], _median(level[window][-side:])
        closer = np.abs(level[window] - after) - np.abs(level[window] - before)
        first = int(np.argmin(np.concatenate(([0.0], np.cumsum(-closer)))))  # samples before the step fit what was
        if 0 < first < len(closer) and abs(after - before) > least_s:
            found.append(window.start + first)
    return found[:MOST_BREAKS]


def _rate_changes(time_s: FloatArray, offset_s: FloatArray, first: int, stop: int, bound_s: float) -> set[int]:
    """First samples after changes of rate between two places, found one after the other."""
    blocks = min(SPLIT_BLOCKS, (stop - first) // LEAST_IN_SPLIT_BLOCK)
    if blocks < 2 * SIDE_BLOCKS:
        return set()
    time, offset = time_s[first:stop], offset_s[first:stop]
    of_blocks = _Blocks(len(time), blocks)
    at_s, level = of_blocks.medians_in_order(time), of_blocks.medians(offset)
    split = _best_split(at_s, level, max(bound_s, FLOOR_S))
    if not split:
        return set()
    at = first + int(np.searchsorted(time, 0.5 * (at_s[split - 1] + at_s[split])))
    least, most = first + 4 * LEAST_IN_SPLIT_BLOCK, stop - 4 * LEAST_IN_SPLIT_BLOCK
    for _turn in range(4):  # to where the lines meet
        before = _line(time_s[first:at], offset_s[first:at], bound_s)
        after = _line(time_s[at:stop], offset_s[at:stop], bound_s)
        if after.slope == before.slope:
            return set()
        meets_s = time_s[at] - float(after.at(time_s[at]) - before.at(time_s[at])) / (after.slope - before.slope)
        last, at = at, int(np.clip(np.searchsorted(time_s, meets_s), least, most))
        if at == last:
            break
    sigma = float(np.hypot(before.slope_sigma, after.slope_sigma))
    if not abs(after.slope - before.slope) > SIGNIFICANT * sigma:
        return set()
    sides = ((first, at), (at, stop))
    return {at}.union(*(_rate_changes(time_s, offset_s, low, high, bound_s) for low, high in sides))


def _best_split(at_s: FloatArray, level: FloatArray, rounding_s: float) -> int:
    """Return the block before which a second line explains much; 0 where one line will do."""
    floor = len(at_s) * rounding_s**2 / 12.0
    forward, backward = _left_over(at_s, level), _left_over(at_s[::-1], level[::-1])[::-1]
    whole = forward[-1]
    places = np.arange(SIDE_BLOCKS, len(at_s) - SIDE_BLOCKS + 1)
    both = forward[places - 1] + backward[places]
    best = int(np.argmin(both))
    split = int(places[best])
    ratio = (whole + floor) / (float(both[best]) + floor)
    residual = np.concatenate([_residual(at_s[:split], level[:split]), _residual(at_s[split:], level[split:])])
    correlation = _correlation(residual)
    gain = len(at_s) * (1.0 - correlation) / (1.0 + correlation) * np.log(ratio)
    return split if gain > SPLIT_GAIN or ratio > SPLIT_RATIO else 0


def _residual(at_s: FloatArray, level: FloatArray) -> FloatArray:
    lever = at_s - at_s.mean()
    left = level - level.mean()
    return np.asarray(left - lever * float(lever @ left) / max(float(lever @ lever), 1e-300))


def _left_over(at_s: FloatArray, level: FloatArray) -> FloatArray:
    """Sum of squares that a line leaves of the first 1, 2, ... values, shape (n,)."""
    time, value = at_s - at_s.mean(), level - _median(level)
    count = np.arange(1, len(at_s) + 1)
    sums = [np.cumsum(one) for one in (time, value, time * time, time * value, value * value)]
    power = np.maximum(sums[2] - sums[0] ** 2 / count, 1e-300)
    common = sums[3] - sums[0] * sums[1] / count
    return np.asarray(np.maximum(sums[4] - sums[1] ** 2 / count - common**2 / power, 0.0))
