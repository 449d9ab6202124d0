"""Numbers of a path in few characters.

Hundredths of a point (0.004 mm), each as a step from the one before.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.plots.marks import Floats

FAR_PT = 20_000.0  # what lies farther away is moved there: it is outside of every picture
NO_LENGTH = "h0"  # a stroke to where it begins: a dot if its ends are round
_KEPT = 4_000
Steps = NDArray[np.int64]


class _Words(dict[int, str]):
    """Texts of numbers in hundredths, by the number.

    A space comes first where no minus separates it from the number before.

    Source: W3C, Scalable Vector Graphics 2, 9.3.9: the grammar of path data.
    """

    def __missing__(self, hundredths: int) -> str:
        whole, rest = divmod(abs(hundredths), 100)
        text = f"{whole or ''}.{rest:02d}".rstrip("0") if rest else str(whole)
        word = ("-" if hundredths < 0 else " ") + text
        if abs(hundredths) <= _KEPT:
            self[hundredths] = word
        return word


_WORDS = _Words()


def words(hundredths: NDArray[np.int64]) -> str:
    """Return numbers of a path one after another.

    Examples
    --------
    >>> words(np.array([50, -125, 0, 300]))
    ' .5-1.25 0 3'
    """
    return "".join(each(hundredths))


def hundredths(values: Floats) -> Steps:
    """Return places rounded to hundredths of a point."""
    return np.rint(100.0 * np.clip(values, -FAR_PT, FAR_PT)).astype(np.int64)


def polyline(x: Floats, y: Floats, starts: NDArray[np.bool_]) -> str:
    """Return the path through finite places, with a new piece where ``starts`` is true.

    A single place is a stroke of no length.

    Parameters
    ----------
    x, y : (n,) float array
        Points.
    starts : (n,) bool array
        True where a piece begins; the first is taken for true.
    """
    if not x.size:
        return ""
    places = np.column_stack([hundredths(x), hundredths(y)])
    starts = starts.copy()
    starts[0] = True
    keep = _corners(places, starts)
    places, starts = places[keep], starts[keep]
    steps = places.copy()
    steps[1:] -= places[:-1]
    begins = np.flatnonzero(starts)
    ends = np.append(begins[1:], len(places))
    parts = []
    for first, last in zip(begins.tolist(), ends.tolist(), strict=True):
        rest = "l" + words(steps[first + 1 : last]).lstrip() if last - first > 1 else NO_LENGTH
        parts.append("m" + words(steps[first : first + 1]).lstrip() + rest)
    return "M" + "".join(parts)[1:]


def _corners(places: Steps, starts: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the rows of the places that the line needs.

    No doubles, none on the straight line between others.
    """
    moves = np.ones(len(places), dtype=bool)
    moves[1:] = starts[1:] | np.any(places[1:] != places[:-1], axis=1)
    rows = np.flatnonzero(moves)
    if len(rows) < 3:
        return rows
    steps = np.diff(places[rows], axis=0)
    before, after = steps[:-1], steps[1:]
    is_straight = before[:, 0] * after[:, 1] == before[:, 1] * after[:, 0]
    goes_on = before[:, 0] * after[:, 0] + before[:, 1] * after[:, 1] > 0
    is_inner = ~starts[rows[1:-1]] & ~starts[rows[2:]]
    keep = np.ones(len(rows), dtype=bool)
    keep[1:-1] = ~(is_straight & goes_on & is_inner)
    return rows[keep]


def strokes(start: Floats, end: Floats, y: Floats) -> str:
    """Return the path of level strokes from ``start`` to ``end``."""
    if not start.size:
        return ""
    left, right, height = hundredths(start), hundredths(end), hundredths(y)
    moves = np.column_stack([left - np.append(0, right[:-1]), np.diff(height, prepend=0), right - left])
    told = each(moves)
    parts = [
        f"m{across.lstrip()}{up}h{length.lstrip()}"
        for across, up, length in zip(told[::3], told[1::3], told[2::3], strict=True)
    ]
    return "M" + "".join(parts)[1:]


def boxes(left: Floats, right: Floats, upper: Floats, lower: Floats) -> str:
    """Return the path of boxes between places of their edges, whichever of two comes first."""
    x, y = hundredths(np.minimum(left, right)), hundredths(np.minimum(upper, lower))
    wide, high = hundredths(np.maximum(left, right)) - x, hundredths(np.maximum(upper, lower)) - y
    moves = np.column_stack([np.diff(x, prepend=0), np.diff(y, prepend=0), wide, high, -wide])
    told = each(moves)
    parts = [
        f"m{one.lstrip()}{two}h{three.lstrip()}v{four.lstrip()}h{five}z"
        for one, two, three, four, five in zip(*(told[place::5] for place in range(5)), strict=True)
    ]
    return "M" + "".join(parts)[1:]


def dots(x: Floats, y: Floats) -> str:
    """Return the path of strokes of no length: with round ends they are dots."""
    if not x.size:
        return ""
    places = np.column_stack([hundredths(x), hundredths(y)])
    told = each(np.diff(places, axis=0, prepend=np.zeros((1, 2), dtype=np.int64)))
    parts = [one.lstrip() + other for one, other in zip(told[::2], told[1::2], strict=True)]
    return "M" + "h0m".join(parts) + "h0"


def each(counts: NDArray[np.int64]) -> list[str]:
    """Return the numbers of a path one by one, from hundredths.

    A space stands before a number without a minus.

    Examples
    --------
    >>> each(np.array([50, -125]))
    [' .5', '-1.25']
    """
    return list(map(_WORDS.__getitem__, counts.ravel().tolist()))
