"""Distinct values and the median, by sorting.

``np.unique`` and ``np.median`` import numpy's masked arrays, which nothing else of a conversion needs.
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
