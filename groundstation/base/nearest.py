"""Nearest samples of a series in order of time."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def nearest_rows(times: NDArray[Any], at: NDArray[Any], *, takes_later: bool = False) -> NDArray[np.intp]:
    """Return the rows of the samples nearest to some times.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Never decreasing, at least one, in any unit.
    at : ndarray, shape (m,)
        Times asked for, in any order and the same unit.
    takes_later : bool
        Of two samples as near take the later one.

    Returns
    -------
    ndarray of int, shape (m,)

    Examples
    --------
    >>> times, at = np.array([0, 10, 20]), np.array([-3, 4, 5, 99])
    >>> nearest_rows(times, at).tolist(), nearest_rows(times, at, takes_later=True).tolist()
    ([0, 0, 0, 2], [0, 0, 1, 2])
    """
    after = np.minimum(np.searchsorted(times, at), len(times) - 1)
    before = np.maximum(after - 1, 0)
    to_before, to_after = np.abs(at - times[before]), np.abs(times[after] - at)
    is_before = to_before < to_after if takes_later else to_before <= to_after
    return np.where(is_before, before, after)
