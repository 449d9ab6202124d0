"""Robust slope of a series of flights over time, with an interval from their own scatter.

Nothing is taken from what a flight claims of its own accuracy: flights of one unit differ by far more than that.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

FloatArray = NDArray[np.float64]
NORMAL_TAIL = 1.959964  # two-sided 95 %
FEWEST = 6  # flights: with five no order is rare enough for the level, with four none for the slope
MOST = 400  # flights: of more the latest are taken, as pairs grow with the square
EXACT_UP_TO = 60  # flights for which all orders are counted
ALIKE_SIGMAS = 1.645  # of the correlation of neighbours above which it widens the intervals


@dataclass(frozen=True)
class Line:
    """Line through a series: level at its middle and slope, each with a 95 % interval.

    Parameters
    ----------
    middle : float
        Time of ``level``.
    level, level_low, level_high : float
    slope, slope_low, slope_high : float
        Per unit of time.
    scatter : float
        Robust standard deviation of the flights about the line.
    flights : int
    """

    middle: float
    level: float
    level_low: float
    level_high: float
    slope: float
    slope_low: float
    slope_high: float
    scatter: float
    flights: int

    def at(self, time: FloatArray) -> FloatArray:
        """Return the line at times, shape (n,)."""
        return np.asarray(self.level + self.slope * (time - self.middle))

    def bounds(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the 95 % interval of the line at times: level and slope err independently."""
        away = time - self.middle
        far = np.abs(away)
        up = np.where(away >= 0.0, self.slope_high - self.slope, self.slope - self.slope_low)
        down = np.where(away >= 0.0, self.slope - self.slope_low, self.slope_high - self.slope)
        line = self.at(time)
        low = line - np.hypot(self.level - self.level_low, down * far)
        return low, line + np.hypot(self.level_high - self.level, up * far)


def line_of(time: FloatArray, value: FloatArray) -> Line | None:
    """Fit a line to a series; None with fewer than six flights, or all at one time.

    Parameters
    ----------
    time, value : ndarray, shape (n,)
        In order of time, finite.

    Notes
    -----
    Slope: the median over all pairs of flights (Theil, 1950). Its interval are two of the ordered pairs, by the exact
    distribution of the number of inversions when all orders are equally likely (Sen, 1968): it holds whatever the
    distribution of the scatter, as long as flights are exchangeable about the line. Level: the median about the slope,
    with its order statistics. Where neighbours are alike, both intervals are those of fewer flights (Hamed and Rao,
    1998, for an autoregression of first order).

    Examples
    --------
    >>> line = line_of(np.arange(8.0), np.array([0.1, 1.0, 2.1, 2.9, 4.0, 5.2, 5.9, 100.0]))
    >>> round(line.slope, 2), line.slope_low > 0.8
    (1.01, True)
    """
    time, value = time[-MOST:], value[-MOST:]
    n = len(time)
    if n < FEWEST or time[-1] <= time[0]:
        return None
    first, second = np.triu_indices(n, 1)
    apart = time[second] - time[first]
    known = apart > 0.0
    slopes = np.sort((value[second] - value[first])[known] / apart[known])
    slope, middle = float(np.median(slopes)), float(time.mean())
    about = value - slope * (time - middle)
    widening = _widening(about)
    reach = _inversions(n) if n <= EXACT_UP_TO and widening == 1.0 and known.all() else None
    if reach is None:
        reach = _inversions_about(time, len(slopes), widening)
    ordered = np.sort(about)
    depth = _depth(n, widening)
    level = float(np.median(ordered))
    return Line(
        middle,
        level,
        float(ordered[depth]),
        float(ordered[n - 1 - depth]),
        slope,
        float(slopes[reach]),
        float(slopes[len(slopes) - 1 - reach]),
        float(np.median(np.abs(about - level))) / 0.674490,
        n,
    )


@lru_cache(maxsize=128)
def _inversions(n: int) -> int:
    """Return how many pairs may be left out at each end: exactly 95 % or more remain."""
    count = np.ones(1)
    for size in range(2, n + 1):
        count = np.convolve(count, np.full(size, 1.0 / size))
    below = np.cumsum(count)
    return max(int(np.searchsorted(below, 0.025, side="right")) - 1, 0)


def _inversions_about(time: FloatArray, pairs: int, widening: float) -> int:
    """Return the same by the normal distribution.

    It is for long series, equal times and flights that are alike.
    """
    n = len(time)
    _, ties = np.unique(time, return_counts=True)
    variance = (n * (n - 1) * (2 * n + 5) - float(np.sum(ties * (ties - 1) * (2 * ties + 5)))) / 18.0
    reach = NORMAL_TAIL * float(np.sqrt(variance * widening))
    return int(np.clip(np.floor(0.5 * (pairs - reach)) - 1, 0, (pairs - 1) // 2))


def _depth(n: int, widening: float) -> int:
    """Return how many of the ordered flights may be left out at each end for the level."""
    fewer = n / widening
    if widening == 1.0 and n <= EXACT_UP_TO:
        count = np.ones(1)
        for _ in range(n):
            count = np.convolve(count, [0.5, 0.5])
        return max(int(np.searchsorted(np.cumsum(count), 0.025, side="right")) - 1, 0)
    share = 0.5 * (1.0 - NORMAL_TAIL / float(np.sqrt(fewer)))
    return int(np.clip(np.floor(share * n) - 1, 0, (n - 1) // 2))


def _widening(about: FloatArray) -> float:
    """Return the factor on the variance where neighbours are alike; 1 where they are not."""
    n = len(about)
    ranks = np.argsort(np.argsort(about)) - 0.5 * (n - 1)
    alike = float(ranks[1:] @ ranks[:-1]) / float(ranks @ ranks)
    if alike * np.sqrt(n) < ALIKE_SIGMAS:
        return 1.0
    lags = np.arange(1, n)
    return 1.0 + 2.0 * float(np.sum((1.0 - lags / n) * alike**lags))
