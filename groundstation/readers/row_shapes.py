"""Shape of rows: where lines end, and how many cells they have."""

from typing import Any

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array

COMPILED_BYTES = 1 << 20  # below it numpy takes a moment, and a compiler some seconds once
_LF = 10


@dataclass(frozen=True)
class RowShape:
    """Shape of rows: the byte of each line feed, and the number of cells before it."""

    ends: Int64Array
    cells: Int64Array


def shape_of(lines: bytes, delimiter: str, *, is_compiled: bool = False) -> RowShape:
    """Return the shape of ended lines.

    Many lines are gone through by a compiled loop, where that is asked for.

    Examples
    --------
    >>> shape = shape_of(b"1,2\\n,,\\n", ",")
    >>> shape.ends.tolist(), shape.cells.tolist()
    ([3, 6], [2, 3])
    """
    text = np.frombuffer(lines, np.uint8)
    if is_compiled and len(lines) >= COMPILED_BYTES:
        found = np.empty((2, np.count_nonzero(text == _LF)), np.int64)
        count_cells(text, ord(delimiter), found)
        return RowShape(found[0], found[1])
    is_end = text == _LF
    places = np.flatnonzero(is_end | (text == ord(delimiter)))
    closes = np.flatnonzero(is_end[places])
    return RowShape(places[closes], np.diff(closes, prepend=-1))


def cell_places(lines: bytes, delimiter: str, cells: int, column: int) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Return the first byte and the end of one cell of each line, and the line's end.

    Every line has the same number of cells.

    Examples
    --------
    >>> [one.tolist() for one in cell_places(b"1,ab,3\\n4,c,5\\n", ",", 3, 1)]
    [[2, 9], [4, 10], [6, 12]]
    """
    text = np.frombuffer(lines, np.uint8)
    if len(lines) >= COMPILED_BYTES:
        found = np.empty((3, np.count_nonzero(text == _LF)), np.int64)
        find_cells(text, ord(delimiter), column, found)
        return found[0], found[1], found[2]
    ends = np.flatnonzero(text == _LF)
    before = np.concatenate(([-1], ends[:-1]))
    delimiters = np.flatnonzero(text == ord(delimiter)).reshape(len(ends), cells - 1)
    bounds = np.column_stack((before, delimiters, ends))
    return bounds[:, column] + 1, bounds[:, column + 1], ends


@in_place
def find_cells(text: Any, delimiter: int, column: int, places: Any) -> None:
    """Find one cell of each line.

    ``places`` (3, lines) receives its first byte, its end and the line's end.
    """
    line, cell, start = 0, 0, 0
    for at in range(len(text)):
        if text[at] == delimiter or text[at] == 10:
            if cell == column:
                places[0, line], places[1, line] = start, at
            cell, start = cell + 1, at + 1
            if text[at] == 10:
                places[2, line] = at
                line, cell = line + 1, 0


@in_place
def count_cells(text: Any, delimiter: int, shape: Any) -> None:
    """Count the cells of each line.

    ``shape`` (2, lines) receives the place of each line feed and the number of cells before it.
    """
    line, count = 0, 1
    for at in range(len(text)):
        count += text[at] == delimiter
        if text[at] == 10:
            shape[0, line], shape[1, line] = at, count
            line, count = line + 1, 1
