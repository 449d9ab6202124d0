"""Distinct values, the median and other quantiles, by sorting.

``np.unique``, ``np.median`` and ``np.quantile`` import numpy's masked arrays, which nothing else of a conversion needs.
"""

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Scalar = TypeVar("Scalar", bound=np.generic)


def distinct(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """Return the distinct values, rising, shape (k,), as ``np.unique`` does: NaN once.

    Examples
    --------
    >>> distinct(np.array([3, 1, 3])).tolist(), distinct(np.array([np.nan, 1.0, np.nan])).tolist()
    ([1, 3], [1.0, nan])
    """
    ordered = np.sort(values, axis=None)
    is_new = np.ones(len(ordered), dtype=bool)
    is_new[1:] = ordered[1:] != ordered[:-1]
    if ordered.dtype.kind == "f":
        is_new[1:] &= ~np.isnan(ordered[:-1])
    return ordered[is_new]


def median(values: NDArray[np.floating]) -> float:
    """Return the median as ``np.median`` does; NaN where any value is.

    Examples
    --------
    >>> median(np.array([3.0, 1.0, 2.0])), median(np.array([4.0, 1.0])), median(np.array([1.0, np.nan]))
    (2.0, 2.5, nan)
    """
    ordered = np.sort(values, axis=None)
    count = len(ordered)
    if not count or np.isnan(ordered[-1]):
        return math.nan
    return float(0.5 * (ordered[(count - 1) // 2] + ordered[count // 2]))


def quantile(values: NDArray[np.floating | np.integer], share: float) -> float:
    """Return the value below which a share of others lies, as ``np.quantile`` does.

    It is linear between two of them; NaN where any value is.

    Examples
    --------
    >>> quantile(np.array([5, 1, 4, 2]), 0.5), quantile(np.array([4.0, 1.0, np.nan]), 0.9)
    (3.0, nan)
    """
    ordered = np.sort(values, axis=None)
    if not len(ordered) or np.isnan(ordered[-1]):
        return math.nan
    at = share * (len(ordered) - 1)
    low = math.floor(at)
    below, above = ordered[low], ordered[min(low + 1, len(ordered) - 1)]
    part = at - low
    return float(below + (above - below) * part if part < 0.5 else above - (above - below) * (1.0 - part))
