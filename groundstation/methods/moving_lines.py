"""Straight lines fitted over moving windows, by differences of running sums."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
EDGE_S = 1e-6  # a sample at the very edge of a window belongs to it


def window_bounds(at: FloatArray, time_s: FloatArray, window_s: float) -> tuple[IndexArray, IndexArray]:
    """Return first index and one past the last of the samples around each time.

    They lie within half a window of it. The shapes are that of ``at``.
    """
    low = np.searchsorted(time_s, at - 0.5 * window_s - EDGE_S)
    return low, np.searchsorted(time_s, at + 0.5 * window_s + EDGE_S)


def fitted_lines(
    at: FloatArray, time_s: FloatArray, values: FloatArray, low: IndexArray, high: IndexArray
) -> tuple[FloatArray, FloatArray]:
    """Least-squares lines through the samples ``low`` to ``high`` - 1 of each window.

    Parameters
    ----------
    at : ndarray, shape (m,)
        Times at which the lines are read.
    time_s, values : ndarray, shape (n,), n at least 1

    Returns
    -------
    slope, value : ndarray, shape (m,)
        Slope per second, and height of the line at ``at``; NaN where a window has fewer than two samples.

    Examples
    --------
    >>> time_s = np.arange(5.0)
    >>> slope, value = fitted_lines(np.array([2.5]), time_s, 3.0 * time_s, np.array([1]), np.array([4]))
    >>> float(slope[0]), float(value[0])
    (3.0, 7.5)
    """
    x, y = time_s - time_s[0], values - values[0]  # small numbers keep the sums exact
    sums = [np.concatenate([[0.0], np.cumsum(part)]) for part in (np.ones(len(x)), x, y, x * x, x * y)]
    n, sx, sy, sxx, sxy = (part[high] - part[low] for part in sums)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (sxy - sx * sy / n) / (sxx - sx * sx / n)
        value = values[0] + sy / n + slope * (at - time_s[0] - sx / n)
    enough = n >= 2
    return np.where(enough, slope, np.nan), np.where(enough, value, np.nan)
