"""Coarse search for the lag between two motions on an even grid, and for clock steps."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.several_logs.channels import SignalPair, TopicSignals
from groundstation.systems.several_logs.settings import TwoClocksSettings

GAP_S = 2.5  # nothing is interpolated over a longer one
CLIP = 5.0  # standard deviations: no single sample decides
FIT_CORRELATION = 0.8  # of a stretch whose own place is believed
STRETCHES_BESIDE = 3
GAP_LOSS = 0.05  # share of what a change of lag explains that its place in a gap may cost
LIVELY = 0.1  # share of the usual motion that a stretch must have to be judged


@dataclass(frozen=True)
class CoarseLag:
    """Lag between two logs: ``lag_s`` added to seconds of the other gives those of the first.

    ``correlation`` is that of the two motions at this lag, ``rival`` the next best fit as a share of the best.
    """

    lag_s: float
    correlation: float
    rival: float
    overlap_s: float


@dataclass(frozen=True)
class Grids:
    """Both motions on even grids of ``step_s``: (c, n) and (c, m).

    Slow motion is filtered out; zero where nothing is known.
    """

    first: FloatArray
    other: FloatArray
    first_start_s: float
    other_start_s: float
    step_s: float


def grids_of(pair: SignalPair, settings: TwoClocksSettings) -> Grids:
    """Put both motions of a pair on grids, each signal in its own standard deviations."""
    step_s = max(settings.grid_s, 0.5 * min(pair.first.interval_s, pair.other.interval_s))
    first, first_start_s = _grid(pair.first, step_s, settings.high_pass_s)
    other, other_start_s = _grid(pair.other, step_s, settings.high_pass_s)
    size = np.maximum(_spread(first), _spread(other))[:, None]
    size[size == 0.0] = 1.0
    first, other = np.clip(first / size, -CLIP, CLIP), np.clip(other / size, -CLIP, CLIP)
    return Grids(first, other, first_start_s, other_start_s, step_s)


def _grid(side: TopicSignals, step_s: float, high_pass_s: float) -> tuple[FloatArray, float]:
    start_s = float(np.floor(side.time_s[0] / step_s) * step_s)
    at_s = np.arange(start_s, side.time_s[-1] + step_s, step_s)
    after = np.clip(np.searchsorted(side.time_s, at_s), 1, len(side.time_s) - 1)
    known = (side.time_s[after] - side.time_s[after - 1] <= GAP_S) & (at_s <= side.time_s[-1])
    known &= at_s >= side.time_s[0]
    half = max(round(0.5 * high_pass_s / step_s), 1)
    count = _box(known.astype(np.float64), half)
    rows = []
    for column in side.values.T:
        values = np.where(known, np.interp(at_s, side.time_s, column), 0.0)
        rows.append(np.where(known, values - _box(values, half) / np.maximum(count, 1.0), 0.0))
    return np.array(rows), start_s


def _box(values: FloatArray, half: int) -> FloatArray:
    """Sum of the values from ``half`` before to ``half`` after."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    row = np.arange(len(values))
    return np.asarray(total[np.minimum(row + half + 1, len(values))] - total[np.maximum(row - half, 0)])


def _spread(values: FloatArray) -> FloatArray:
    """Root mean square of what is not zero, shape (c,)."""
    count = np.maximum(np.count_nonzero(values, axis=1), 1)
    return np.asarray(np.sqrt(np.sum(values**2, axis=1) / count))


def place_of(grids: Grids, settings: TwoClocksSettings, near_s: tuple[float, float] | None) -> CoarseLag | None:
    """Find the lag at which the two motions fit best; ``near_s`` bounds it.

    None where they never overlap. The product of the two motions is held against what chance gives, its standard
    deviation for motions that have nothing to do with each other: a short common part counts less than a long one.
    """
    a, b, step_s = grids.first, grids.other, grids.step_s
    size = a.shape[1] + b.shape[1]
    length = 1 << (size - 1).bit_length()

    def product(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.fft.irfft(np.sum(np.fft.rfft(x, length) * np.conj(np.fft.rfft(y, length)), axis=0), length)

    known = [(np.any(one != 0.0, axis=0)).astype(np.float64)[None] for one in (a, b)]
    ones = [np.broadcast_to(one, part.shape) for one, part in zip(known, (a, b), strict=True)]
    together = np.maximum(product(known[0], known[1]), 0.0) * step_s
    both = product(a, b)
    chance = np.sqrt(np.maximum(product(a**2, b**2), 1e-9))
    energy = np.sqrt(np.maximum(product(a**2, ones[1]), 1e-9) * np.maximum(product(ones[0], b**2), 1e-9))
    shift = np.fft.fftfreq(length, 1.0 / length)
    lag_s = shift * step_s + grids.first_start_s - grids.other_start_s
    allowed = together >= min(settings.overlap_min_s, 0.5 * min(float(np.sum(one)) for one in known) * step_s)
    if near_s is not None:
        allowed &= (lag_s >= near_s[0]) & (lag_s <= near_s[1])
    if not allowed.any():
        return None
    fit = np.where(allowed, both / chance, -np.inf)
    best = int(np.argmax(fit))
    away = np.abs(lag_s - lag_s[best]) > 0.5 * settings.high_pass_s
    rival = float(np.max(np.where(away, fit, -np.inf))) / max(float(fit[best]), 1e-9)
    correlation = float(both[best] / max(float(energy[best]), 1e-9))
    return CoarseLag(float(lag_s[best]), correlation, max(rival, 0.0), float(together[best]))


def steps_of(grids: Grids, place: CoarseLag, settings: TwoClocksSettings) -> list[tuple[float, float]]:
    """Find the stretches between steps of a clock.

    Each is given by its begin, in seconds of the other log, and its lag. The lag is found anew in windows of the other
    log that move; where it changes by more than ``step_s`` and stays there, a clock was set.
    """
    at_s, lags_s = _local_lags(grids, place, settings)
    begins = [(-np.inf, place.lag_s)]
    if len(lags_s) < 2:
        return begins
    found, start = [], 0
    for number in range(STRETCHES_BESIDE, len(lags_s) - STRETCHES_BESIDE + 1):
        sides = lags_s[max(start, number - STRETCHES_BESIDE) : number], lags_s[number : number + STRETCHES_BESIDE]
        before, after = (float(np.median(side)) for side in sides)
        spread_s = max(float(np.ptp(side)) for side in sides)
        if len(sides[0]) == STRETCHES_BESIDE and abs(after - before) > max(settings.step_s, 2.0 * spread_s):
            found.append((number, before, after))
            start = number
    if not found:
        return [(-np.inf, float(np.median(lags_s)))]
    begins = [(-np.inf, found[0][1])]
    for number, before, after in found:
        begins.append((_moment(grids, before, after, (at_s[number - 1], at_s[number]), settings), after))
    return begins


def _local_lags(grids: Grids, place: CoarseLag, settings: TwoClocksSettings) -> tuple[FloatArray, FloatArray]:
    """Return the lag in windows of the other log that move, with their middles, shapes (k,).

    The middles are in seconds of the other log.
    """
    step_s = grids.step_s
    length, reach = round(settings.step_window_s / step_s), round(settings.step_search_s / step_s)
    usual = float(np.mean(grids.other**2))
    at_s, lags_s = [], []
    for begin in range(0, grids.other.shape[1] - length + 1, length // 2):
        window = grids.other[:, begin : begin + length]
        energy = float(np.sum(window**2))
        middle = _row_in_first(grids, begin, place.lag_s)
        low, high = middle - reach, middle + reach + length
        if energy < LIVELY * usual * window.size or low < 0 or high > grids.first.shape[1]:
            continue
        views = np.lib.stride_tricks.sliding_window_view(grids.first[:, low:high], length, axis=1)
        fit = np.einsum("csn,cn->s", views, window) / np.sqrt(
            np.maximum(np.einsum("csn,csn->s", views, views), 1e-9) * energy
        )
        best = int(np.argmax(fit))
        if fit[best] >= FIT_CORRELATION:
            at_s.append(grids.other_start_s + (begin + 0.5 * length) * step_s)
            lags_s.append(place.lag_s + (best - reach) * step_s)
    return np.array(at_s), np.array(lags_s)


def _row_in_first(grids: Grids, row: int, lag_s: float) -> int:
    return round((grids.other_start_s + lag_s - grids.first_start_s) / grids.step_s) + row


def _moment(
    grids: Grids, before_s: float, after_s: float, between_s: tuple[float, float], settings: TwoClocksSettings
) -> float:
    """Return the second of the other log at which the lag changes.

    It is the one that leaves the least residual.
    """
    low, high = (
        round((second - grids.other_start_s) / grids.step_s)
        for second in (between_s[0] - 0.5 * settings.step_window_s, between_s[1] + 0.5 * settings.step_window_s)
    )
    rows = np.arange(max(low, 0), min(high, grids.other.shape[1]))
    rows = rows[np.any(grids.other[:, rows] != 0.0, axis=0)]  # not those in a gap
    left = []
    for lag_s in (before_s, after_s):
        there = np.clip(rows + _row_in_first(grids, 0, lag_s), 0, grids.first.shape[1] - 1)
        left.append(np.sum((grids.other[:, rows] - grids.first[:, there]) ** 2, axis=0))
    gain = np.concatenate([[0.0], np.cumsum(left[0] - left[1])])  # of changing before each row, up to a constant
    row = int(np.argmin(gain[1:-1])) + 1
    gaps = np.flatnonzero(np.diff(rows) > 1) + 1  # a clock that is set ahead leaves one
    gaps = gaps[gain[gaps] - gain[row] <= GAP_LOSS * float(np.ptp(gain))]
    if gaps.size:
        row = int(gaps[np.argmin(gain[gaps])])
    return float(grids.other_start_s + 0.5 * (rows[row - 1] + rows[row]) * grids.step_s)
