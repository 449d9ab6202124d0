"""Rows of a line: where it must break, and which rows can be left out.

No value is ever altered.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Int64Array

FloatArray = NDArray[np.float64]

GAP_STEPS = 3.0  # a step longer than this many ordinary ones is a gap; ordinary: the 90th percentile, so that
ORDINARY_QUANTILE = 0.9  # irregular sampling (events, values sent on change) is not cut to pieces
ROWS_AT_ONCE = 1 << 18
FEW_ROWS = 10  # too few to say what an ordinary step is


def gap_after(time_ns: Int64Array) -> BoolArray:
    """Tell whether the line breaks between a row and the next one, shape (n - 1,).

    Examples
    --------
    >>> gap_after(np.array([*range(20), 40, 41])).nonzero()[0].tolist()
    [19]
    """
    count = max(len(time_ns) - 1, 0)
    breaks = np.zeros(count, dtype=bool)
    if count < FEW_ROWS:
        return breaks
    ordinary = float(np.quantile(np.diff(time_ns), ORDINARY_QUANTILE, overwrite_input=True))
    for part in _parts(count):
        breaks[part] = np.diff(time_ns[part.start : part.stop + 1]) > GAP_STEPS * max(ordinary, 1.0)
    return breaks


def _parts(rows: int) -> Iterator[slice]:
    """Yield the rows in parts: working arrays do not grow with a log."""
    return (slice(start, min(start + ROWS_AT_ONCE, rows)) for start in range(0, rows, ROWS_AT_ONCE))


def covers_gap(time_ns: Int64Array, gap_starts_ns: Int64Array) -> BoolArray:
    """Tell whether a listed gap begins between a row and the next one, shape (n - 1,).

    Examples
    --------
    >>> covers_gap(np.array([0, 10, 30]), np.array([10])).tolist()
    [False, True]
    """
    breaks = np.zeros(max(len(time_ns) - 1, 0), dtype=bool)
    after = np.searchsorted(time_ns, gap_starts_ns, side="right") - 1
    breaks[after[(after >= 0) & (after < len(breaks))]] = True
    return breaks


def wraps_after(heading_deg: FloatArray) -> BoolArray:
    """Tell whether a heading jumps across north between a row and the next, shape (n - 1,).

    The heading has the shape (n,) or (n, k).

    Examples
    --------
    >>> wraps_after(np.array([358.0, 359.5, 0.5, 2.0])).tolist()
    [False, True, False]
    """
    jumps = np.abs(np.diff(heading_deg, axis=0)) > 180.0
    return np.asarray(jumps.any(axis=tuple(range(1, jumps.ndim))))


def break_line(time_ns: Int64Array, values: FloatArray, breaks: BoolArray) -> tuple[Int64Array, FloatArray]:
    """Insert a row of NaN one nanosecond after each row before a break.

    Rerun joins points across missing rows.

    Examples
    --------
    >>> time_ns, values = break_line(np.array([0, 10, 90]), np.array([[1.0], [2.0], [3.0]]), np.array([False, True]))
    >>> time_ns.tolist(), values[:, 0].tolist()
    ([0, 10, 11, 90], [1.0, 2.0, nan, 3.0])
    """
    where = np.flatnonzero(breaks) + 1
    if not where.size:
        return time_ns, values
    return np.insert(time_ns, where, time_ns[where - 1] + 1), np.insert(values, where, np.nan, axis=0)


def thin(values: FloatArray, breaks: BoolArray, limit: int) -> Int64Array:
    """Choose rows that keep the picture of a line, as :func:`thin_series`; shape (n, k).

    Examples
    --------
    >>> spike = np.zeros((1000, 1)); spike[617] = 9.0
    >>> kept = thin(spike, np.zeros(999, dtype=bool), 100)
    >>> len(kept) <= 100, 617 in kept
    (True, True)
    """
    return thin_series(list(values.T), breaks, limit)


def thin_series(series: Sequence[FloatArray], breaks: BoolArray, limit: int) -> Int64Array:
    """Choose rows that keep the picture of lines that share their rows.

    The extremes of every series in every stretch, and both sides of each break.

    Parameters
    ----------
    series : sequence of ndarray, each of shape (n,)
    breaks : ndarray of bool, shape (n - 1,)
        A line breaks between row i and row i + 1.
    limit : int
        Rows wanted. Rows beside breaks and at the ends of runs of NaN come on top of it.

    Returns
    -------
    ndarray of int64
        Positions of the rows kept, increasing; all of them when n <= limit.
    """
    rows = len(series[0])
    if rows <= limit:
        return np.arange(rows, dtype=np.int64)
    stretches = max(limit // (2 * len(series)), 1)
    length = -(-rows // stretches)
    keep = np.zeros(stretches * length, dtype=bool)
    edges = breaks.copy()
    for values in series:
        _keep_extremes(values, length, keep)
        unknown = np.isnan(values)
        edges |= unknown[1:] != unknown[:-1]
    keep = keep[:rows]
    keep[:-1] |= edges
    keep[1:] |= edges
    keep[[0, -1]] = True
    return np.flatnonzero(keep)


def _keep_extremes(values: FloatArray, length: int, keep: BoolArray) -> None:
    """Mark the lowest and the highest row of every stretch, some stretches at a time."""
    at_once = max(ROWS_AT_ONCE // length, 1)
    for first in range(0, -(-len(values) // length), at_once):
        part = values[first * length : (first + at_once) * length]
        padded = np.full((-(-len(part) // length), length), np.nan)
        padded.ravel()[: len(part)] = part
        unknown = np.isnan(padded)
        starts = (first + np.arange(len(padded))) * length
        for filler, find in ((np.inf, np.argmin), (-np.inf, np.argmax)):
            padded[unknown] = filler
            keep[find(padded, axis=1) + starts] = True


def rows_that_fit(rows: list[int], widths: list[int], scalars: int) -> int:
    """Return the largest row limit for which all groups hold at most ``scalars`` numbers.

    Short groups stay whole and leave their share to the long ones.

    Examples
    --------
    >>> rows_that_fit([10, 1000, 1000], [1, 1, 1], 410)
    200
    """
    left, width_left = scalars, sum(widths)
    for count, width in sorted(zip(rows, widths, strict=True)):
        if count * width_left > left:
            return max(left // width_left, FEW_ROWS)
        left -= count * width
        width_left -= width
    return max(rows, default=FEW_ROWS)


def runs(states: NDArray[np.str_]) -> Int64Array:
    """Return positions at which a state differs from the one before, the first row among them.

    Examples
    --------
    >>> runs(np.array(["align", "align", "nav", "nav", "align"])).tolist()
    [0, 2, 4]
    """
    if not len(states):
        return np.zeros(0, dtype=np.int64)
    return np.concatenate([[0], np.flatnonzero(states[1:] != states[:-1]) + 1]).astype(np.int64)
