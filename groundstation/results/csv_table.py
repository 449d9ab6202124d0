"""Table of numbers and texts as readable CSV.

``"%.3f" % number`` takes a fifth of a microsecond, and the readable tables of a flight have 200 000 cells: a tenth of
what a short flight takes. Of a long table the digits of a column are looked up in numpy, four at a time: a third of
that time, for the same text.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.digits import digits_of
from groundstation.base.printable import csv_cell
from groundstation.results.figures import FigureData

Words = NDArray[np.uint32]  # four bytes of text each; a byte that is zero is not written
Integers = NDArray[np.int64]
Column = tuple[NDArray[Any], int]  # values and the decimals they are rounded to

LEAST_ROWS = 100  # of fewer, Python is faster
ROWS_AT_ONCE = 4096  # what is worked on stays near the processor
MOST_PLACES = 15
MOST_NUMBER = 1e15  # a rounded number below it differs from its neighbours in the decimals that are written
WIDEST_TEXT = 64  # bytes: a cell takes as much room as the widest of its column
_DIGITS, _POWER = 4, 10_000  # of a word
_NOT_WRITTEN = b"\0"


def csv_text(figure: FigureData, line_end: str = "\n") -> str:
    """Return a figure's arrays as readable CSV: rounded, NaN empty.

    No cell holds what a spreadsheet would run as a formula.
    """
    columns = [(values, figure.digits.get(name, digits_of(name))) for name, values in figure.columns.items()]
    head = ",".join(csv_cell(name) for name in figure.columns)
    rows = long_rows(columns, line_end)
    return head + (short_rows(columns, line_end) if rows is None else rows) + line_end


def short_rows(columns: Sequence[Column], line_end: str) -> str:
    """Write the rows of a table, a cell at a time.

    ``line_end`` stands before each row, a comma between cells.
    """
    forms, cells = [], []
    for values, places in columns:
        form, column = _cells(values, places)
        forms.append(form)
        cells.append(column)
    row = line_end + ",".join(forms)
    count = len(cells[0]) if cells else 0
    return row * count % tuple(chain.from_iterable(zip(*cells, strict=True)))


def _cells(values: NDArray[Any], places: int) -> tuple[str, list[Any]]:
    """Return the form of a cell and what goes into it.

    All cells of a table are written in one go.
    """
    kind = values.dtype.kind
    if kind == "f":
        rounded = np.round(values.astype(np.float64), places) + 0.0
        form, numbers, is_known = f"%.{places}f", rounded.tolist(), np.isfinite(rounded)
        if is_known.all():
            return form, numbers
        return "%s", [form % one if known else "" for one, known in zip(numbers, is_known.tolist(), strict=True)]
    if kind in "biu":
        return "%d", values.tolist()
    texts = list(map(str, values.tolist()))
    cell_of = {text: csv_cell(text) for text in set(texts)}  # few, each many times
    return "%s", [cell_of[text] for text in texts]


def long_rows(columns: Sequence[Column], line_end: str) -> str | None:
    """Write the rows of a table, a column at a time, as :func:`short_rows` does.

    Parameters
    ----------
    columns : sequence of (ndarray, int)
        Values, shape (n,), and the decimals they are rounded to. What is not finite gives an empty cell.
    line_end : str

    Returns
    -------
    str or None
        None for what this way does not write: few rows, numbers beyond 1e15, long texts.

    Examples
    --------
    >>> values = np.array([-0.26, np.nan, 12.0] * 50)
    >>> long_rows([(values, 1), (np.arange(150), 0)], "|")[:20]
    '|-0.3,0|,1|12.0,2|-0'
    """
    lengths = {len(values) for values, _ in columns}
    count = min(lengths, default=0)
    if count < LEAST_ROWS or len(lengths) > 1:
        return None
    parts = []
    for first in range(0, count, ROWS_AT_ONCE):
        some, words = slice(first, min(first + ROWS_AT_ONCE, count)), list[Words]()
        for number, (values, places) in enumerate(columns):
            before = "," if number else line_end
            try:
                words += _words_of(values[some], places, before.encode())
            except _OtherwiseError:
                return None
        text = np.ascontiguousarray(np.stack(words, axis=1)).tobytes()
        parts.append(text.translate(None, _NOT_WRITTEN))
    return b"".join(parts).decode()


class _OtherwiseError(Exception):
    """Cells that are to be written in another way."""


def _words_of(values: NDArray[Any], places: int, before: bytes) -> Iterator[Words]:
    """Write what stands before the cells of a column, then the cells."""
    kind = values.dtype.kind
    if kind == "b":
        yield from _decimals(values.astype(np.int64), None, 0, before)
    elif kind in "iu":
        if len(values) and (int(values.min()) <= np.iinfo(np.int64).min or int(values.max()) > np.iinfo(np.int64).max):
            raise _OtherwiseError
        numbers = values.astype(np.int64)
        yield from _decimals(np.abs(numbers), numbers < 0, 0, before)
    elif kind == "f":
        if not 0 <= places <= MOST_PLACES:
            raise _OtherwiseError
        # numpy rounds like this and divides by the power of ten: of that, "%.nf" writes the digits of this
        shifted = np.rint(values.astype(np.float64) * 10.0**places)
        is_known = np.isfinite(shifted)
        shifted[~is_known] = 0.0
        size = np.abs(shifted)
        if len(size) and size.max() >= MOST_NUMBER:
            raise _OtherwiseError
        words = _decimals(size.astype(np.int64), shifted < 0.0, places, before)
        yield next(words)
        yield from words if is_known.all() else (np.where(is_known, word, np.uint32(0)) for word in words)
    else:
        yield np.full(len(values), _word(before), np.uint32)
        yield from _texts(values.tolist())


def _decimals(numbers: Integers, is_negative: NDArray[np.bool_] | None, places: int, before: bytes) -> Iterator[Words]:
    """Write numbers that are so many times ten to the power of -``places``."""
    signs = np.array([_word(before), _word(before + b"-")], np.uint32)
    yield np.full(len(numbers), signs[0]) if is_negative is None else signs[is_negative.astype(np.intp)]
    whole = numbers // 10**places if places else numbers
    yield from _groups(whole, len(str(int(whole.max()))) if len(whole) else 1)
    if places:
        rest = numbers - whole * 10**places
        after = places // _DIGITS * _DIGITS  # digits in words of their own, behind those beside the point
        beside = rest // 10**after
        yield _beside_point(places - after).take(beside)
        if after:
            yield from _groups(rest - beside * 10**after, after, is_filled=True)


def _groups(numbers: Integers, digits: int, *, is_filled: bool = False) -> Iterator[Words]:
    """Write whole numbers of at most so many digits.

    The zeros in front are left out, or fill the number up.
    """
    power = _POWER ** ((digits - 1) // _DIGITS)
    is_begun: NDArray[np.bool_] | bool = is_filled
    while power > 1:
        group = numbers // power
        numbers = numbers - group * power
        is_shown = is_begun | (group > 0)
        word = _digits().take(group + _POWER * (1 - np.asarray(is_begun, np.int64)))
        yield word if is_filled else np.where(is_shown, word, np.uint32(0))
        is_begun, power = is_shown, power // _POWER
    yield _digits().take(numbers + _POWER * (1 - np.asarray(is_begun, np.int64)))


def _texts(values: list[Any]) -> Iterator[Words]:
    texts = list(map(str, values))
    cell_of = {text: csv_cell(text).encode() for text in set(texts)}  # few, each many times
    width = max(map(len, cell_of.values()), default=0)
    if width > WIDEST_TEXT:
        raise _OtherwiseError
    count = -(-width // _DIGITS)
    if count:
        cells = np.array([cell_of[text] for text in texts], f"S{count * _DIGITS}")
        yield from cells.view(np.uint32).reshape(len(cells), count).T


def _word(text: bytes) -> int:
    if len(text) > _DIGITS:
        raise _OtherwiseError
    return int(np.frombuffer(text.ljust(_DIGITS, _NOT_WRITTEN), np.uint32)[0])


@cache
def _digits() -> Words:
    """Return the words of 0000 to 9999, then of 0 to 9999 without the zeros in front."""
    powers = 10 ** np.arange(_DIGITS)[::-1]
    numbers = np.arange(_POWER)[:, None]
    marks = (numbers // powers % 10 + ord("0")).astype(np.uint8)
    is_shown = (numbers >= powers) | (powers == 1)
    return np.concatenate([marks, marks * is_shown]).view(np.uint32)[:, 0]


@cache
def _beside_point(digits: int) -> Words:
    """Return the words of a decimal point and so many digits behind it, at most three."""
    return _table([f".{number:0{digits}d}" if digits else "." for number in range(10**digits)])


def _table(words: Sequence[str]) -> Words:
    return np.array(words, f"S{_DIGITS}").view(np.uint32)
