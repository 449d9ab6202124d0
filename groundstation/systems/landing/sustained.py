"""Values that last: the worst that a stretch keeps for some seconds, and where."""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.tables.motion import runs


class Worst(NamedTuple):
    """The greatest value that lasted, and the row at which it was first reached for good."""

    value: float
    row: int


def worst_sustained(time_s: FloatArray, values: FloatArray, for_s: float) -> Worst | None:
    """Return the greatest level that the values kept for ``for_s`` or more.

    Where no stretch is so long, a shorter one counts by what it keeps all along. Missing samples end a stretch.

    Examples
    --------
    >>> at = np.arange(8.0)
    >>> worst_sustained(at, np.array([0.0, 9.0, 0.0, 3.0, 4.0, 5.0, 3.0, 0.0]), 3.0)
    Worst(value=3.0, row=3)
    """
    lasted, shorter = list[Worst](), list[Worst]()
    for first, last in runs(np.isfinite(values)):
        for start in range(first, last):
            stop = int(np.searchsorted(time_s[:last], time_s[start] + for_s - 1e-9, side="left"))
            if stop < last:
                lasted.append(Worst(float(np.min(values[start : stop + 1])), start))
                continue
            if start == first:
                shorter.append(Worst(float(np.min(values[first:last])), first))
            break
    return max(lasted or shorter, key=lambda one: one.value, default=None)


def lasting(time_s: FloatArray, is_over: np.ndarray, for_s: float) -> tuple[tuple[int, int], ...]:
    """Return the runs [first, last) of rows that last for ``for_s`` or more."""
    return tuple(
        (first, last) for first, last in runs(np.asarray(is_over)) if time_s[last - 1] - time_s[first] >= for_s - 1e-9
    )
