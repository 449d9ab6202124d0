"""Samples of a curve that are drawn, where they are too many: extremes and gaps stay."""

import numpy as np
from numpy.typing import NDArray

from groundstation.plots.marks import Floats

Rows = NDArray[np.int64]


def shown_rows(x: Floats, y: Floats, most: int) -> tuple[Rows, NDArray[np.bool_]]:
    """Return the rows of finite samples to draw, at most ``most``, and where pieces begin.

    A piece begins after a gap. Samples are cut into spans of as many each; of each the least and the largest stay, and
    the ends of pieces while these are not many.

    Examples
    --------
    >>> y = np.array([0.0, 1.0, np.nan, 9.0, 2.0, 2.0])
    >>> rows, starts = shown_rows(np.arange(6.0), y, 100)
    >>> rows.tolist(), starts.tolist()
    ([0, 1, 3, 4, 5], [True, False, True, False, False])
    """
    is_known = np.isfinite(x) & np.isfinite(y)
    known = np.flatnonzero(is_known)
    if len(known) > most:
        known = known[_extremes(known, y[known], most)]
    starts = np.zeros(len(known), dtype=bool)
    if not is_known.all():
        gone = np.cumsum(~is_known)[known]
        starts[1:] = gone[1:] > gone[:-1]
    if len(starts):
        starts[0] = True
    return known, starts


def _extremes(known: Rows, y: Floats, most: int) -> Rows:
    count = len(known)
    ends = np.flatnonzero(np.diff(known) > 1)
    ends = np.concatenate([[0], ends, ends + 1, [count - 1]])
    if len(ends) > most // 4:
        ends = np.array([0, count - 1])
    spans = (most - len(ends)) // 2
    size = -(-count // spans)
    filled = np.append(y, np.full(size * spans - count, y[-1])).reshape(spans, size)
    offset = size * np.arange(spans)
    rows = np.concatenate([ends, offset + filled.argmin(axis=1), offset + filled.argmax(axis=1)])
    return np.unique(np.minimum(rows, count - 1)).astype(np.int64)
