"""Degrees, minutes and seconds in the cells of a column, by one compiled pass.

What is written in an unusual way is left to :func:`groundstation.readers.cells.degrees`; values are equal to the bit.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from groundstation.base import arrow_compute as pc
from groundstation.base import arrow_values as arrow
from groundstation.base.compile import in_place, inlined
from groundstation.base.records import Column
from groundstation.readers import cells
from groundstation.readers.cells import TableCells
from groundstation.readers.layout import number_of

_POWERS = 10.0 ** np.arange(16)  # a whole number of 15 digits over one of these is the double next to the decimal
_NOTHING, _PLAIN, _PARTS, _OTHER = 0, 1, 2, 3  # states of a cell
COMPILED_ROWS = 10_000  # below them the other way takes a moment, and a compiler some seconds once


def is_quick(missing: Sequence[str], rows: int) -> bool:
    """Tell whether :func:`degrees` reads a column.

    No text that means no value may look like an angle.
    """
    return rows >= COMPILED_ROWS and all(
        number_of(text) is not None or not any(map(str.isdigit, text)) for text in missing
    )


def degrees(text: Any, cleaned: Callable[[Any], Any]) -> TableCells:
    """Convert degrees, minutes and seconds in one cell to degrees; plain degrees go through.

    Parameters
    ----------
    text : pyarrow array of string
        Cells with what blanks stand around them.
    cleaned : callable
        Trims cells that are read one by one, and drops those that mean no value.

    Examples
    --------
    >>> read = degrees(arrow.texts(["-0 30 00", " 47:12:36.0", "8 30.5 W", "12°30′18″S", "-8.5", ""]), cells.trimmed)
    >>> read.column.values.tolist()
    [-0.5, 47.21, -8.508333333333333, -12.505, -8.5, nan]
    """
    count = len(text)
    _valid, ends, content = text.buffers()
    offsets = np.frombuffer(ends, np.int32, count=count + 1, offset=4 * text.offset)
    data = np.zeros(0, np.uint8) if content is None else np.frombuffer(content, np.uint8)
    values, states = np.full(count, np.nan), np.zeros(count, np.uint8)
    others = read_angles(data, offsets, _POWERS, values, states)
    present, unreadable = states != _NOTHING, np.zeros(count, dtype=bool)
    if others:
        left = states == _OTHER
        read = cells.degrees(cleaned(pc.filter(text, arrow.flags(left))), among_parts=bool((states == _PARTS).any()))
        values[left], present[left], unreadable[left] = read.column.values, read.column.mask, read.unreadable
    return TableCells(Column(values, None if present.all() else present), unreadable)


@inlined
def _is_blank(one: int) -> bool:
    return one == 32 or one == 9


@inlined
def _is_digit(one: int) -> bool:
    return 48 <= one <= 57


@inlined
def _is_letter(one: int) -> bool:
    """Tell whether a byte is one of NSEW, in either case."""
    upper = one & 0xDF
    return upper == 78 or upper == 83 or upper == 69 or upper == 87


@inlined
def _is_minus(one: int) -> bool:
    upper = one & 0xDF
    return upper == 83 or upper == 87


@inlined
def _behind_blanks(data: Any, at: int, end: int) -> int:
    while at < end and (data[at] == 32 or data[at] == 9):
        at += 1
    return at


@inlined
def _behind_sign(data: Any, at: int, end: int, part: int) -> int:
    """Return the place behind the sign of degrees, minutes or seconds (parts 0, 1, 2)."""
    if at >= end:
        return at
    one = data[at]
    if part == 0:
        if one == 58 or one == 100:  # : d
            return at + 1
        return at + 2 if one == 0xC2 and at + 1 < end and data[at + 1] == 0xB0 else at  # °
    if (part == 1 and (one == 58 or one == 39 or one == 109)) or (part == 2 and (one == 34 or one == 115)):
        return at + 1  # : ' m, or " s
    if one == 0xE2 and at + 2 < end and data[at + 1] == 0x80 and data[at + 2] == 0xB1 + part:  # ′ and ″
        return at + 3
    return at


@in_place
def read_angles(data: Any, offsets: Any, powers: Any, values: Any, states: Any) -> int:
    """Read the angles of cells, and return how many are written in another way.

    Parameters
    ----------
    data : ndarray of uint8
        UTF-8 of all cells.
    offsets : ndarray of int32, shape (n + 1,)
        Where each begins, and the last one ends.
    powers : ndarray, shape (16,)
        Of ten.
    values : ndarray, shape (n,)
        Receives degrees.
    states : ndarray of uint8, shape (n,)
        Receives 0 for cells of nothing, 1 for plain degrees, 2 for degrees and minutes, 3 for others.
    """
    others = 0
    for row in range(len(states)):
        at, end = int(offsets[row]), int(offsets[row + 1])
        at = _behind_blanks(data, at, end)
        while end > at and _is_blank(data[end - 1]):
            end -= 1
        if at == end:
            continue
        is_good, is_plain, minus = True, True, False
        if _is_letter(data[at]):
            minus, is_plain = _is_minus(data[at]), False
            at = _behind_blanks(data, at + 1, end)
        if at < end and (data[at] == 45 or data[at] == 43):
            minus, is_plain = minus or data[at] == 45, is_plain and data[at] == 45
            at += 1
            is_plain = is_plain and at < end and not _is_blank(data[at])
            at = _behind_blanks(data, at, end)
        total, state = 0.0, 2
        for part in range(3):
            whole, digits, decimals = 0, 0, 0
            while at < end and _is_digit(data[at]) and digits < 16:
                whole = whole * 10 + (int(data[at]) - 48)
                digits += 1
                at += 1
            wholes = digits
            if at < end and data[at] == 46 and digits > 0:
                at += 1
                while at < end and _is_digit(data[at]) and digits < 16:
                    whole = whole * 10 + (int(data[at]) - 48)
                    digits += 1
                    decimals += 1
                    at += 1
                is_good = is_good and decimals > 0
            is_good = is_good and digits <= 15
            if not is_good:
                break
            value = float(whole) / powers[decimals]
            if part == 0:
                total = value
                if at == end:
                    is_good, state = is_plain and digits > 0, 1
                    break
                is_good = decimals == 0 and 1 <= wholes <= 3
            elif part == 1:
                total = total + value / 60.0
                is_good = 1 <= wholes <= 2 and value < 60.0
            else:
                total = total + value / 3600.0
                is_good = wholes <= 2 and value < 60.0
            if not is_good:
                break
            sign = _behind_blanks(data, at, end)
            behind = _behind_sign(data, sign, end, part)
            is_good = part == 2 or behind > at or (part == 1 and at == end)
            at = _behind_blanks(data, behind, end)
        if is_good and state == 2:
            if at < end and _is_letter(data[at]):
                minus = minus or _is_minus(data[at])
                at = _behind_blanks(data, at + 1, end)
            is_good = at == end
        if is_good:
            values[row] = -total if minus else total
            states[row] = state
        else:
            states[row] = 3
            others += 1
    return others
