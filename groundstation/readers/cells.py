"""Text cells to typed columns, whole columns at a time.

A cell that cannot be read is marked, never guessed.

Each function takes a pyarrow string array (null = empty cell) and gives values, where they are present, and where a
cell stood that could not be read.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from groundstation.base import arrow_compute as pc
from groundstation.base import arrow_values as arrow
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import MAX_TEXT_CHARACTERS, BoolArray, Column, Int64Array
from groundstation.base.timescales import iso_to_utc_ns

MAX_TIME_NS = 2**62  # UTC until 2116; sums and differences of two such times fit 64 bits
_NUMBER = r"^[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?|(?i:nan|inf|infinity))$"
_DECIMAL_DIGITS = 19  # digits before the point: what 64 bits can hold
_DECIMAL = rf"^[+-]?\d{{1,{_DECIMAL_DIGITS}}}(?:\.\d*)?$"
_EXPONENT = re.compile(r"[+-]?(?:\d{1,30}\.?\d{0,30}|\.\d{1,30})[eE][+-]?\d{1,2}")
_INTEGER = r"^[+-]?\d{1,18}$"
_DMS = (
    r"^\s*(?P<before>[NSEWnsew]?)\s*(?P<sign>[+-]?)\s*(?P<degrees>\d{1,3})(?:\s*[:°d]\s*|\s+)"
    r"(?P<minutes>\d{1,2}(?:\.\d*)?)(?:\s*[:'′m]\s*|\s+|$)"
    r"(?P<seconds>(?:\d{1,2}(?:\.\d*)?)?)\s*[\"″s]?\s*(?P<behind>[NSEWnsew]?)\s*$"
)
_SIDED = (
    r"^\s*(?P<before>[NSEWnsew]?)\s*(?P<sign>[+-]?)\s*(?P<degrees>\d{1,3}(?:\.\d*)?)\s*°?\s*(?P<behind>[NSEWnsew]?)\s*$"
)
_SLASHED = re.compile(r"\d{4}[/.]\d{1,2}[/.]\d{1,2}\b")
_TWO_SIGNS = r"^\+-"  # a Garmin G5 writes its plus in front of every number
_NOT_TEXT = r"[\x00-\x08\x0a-\x1e\x7f\x{FFFD}]"


@dataclass(frozen=True)
class TableCells:
    """Column as read: its values, the unreadable cells, and the texts that were cut.

    Each has shape (n,).
    """

    column: Column
    unreadable: BoolArray
    cut: BoolArray | None = None

    def take(self, index: NDArray[np.integer[Any]]) -> "TableCells":
        """Return the rows that ``index`` selects."""
        cut = self.cut[index] if self.cut is not None and self.cut.any() else None
        return TableCells(self.column.take(index), self.unreadable[index], cut)


def distinct(text: Any) -> tuple[Any, NDArray[np.integer[Any]]]:
    """Return the distinct cells of a column, a null last, and which of them each cell is.

    Examples
    --------
    >>> words, index = distinct(pa.array(["nav", None, "nav", "align"]))
    >>> words.to_pylist(), index.tolist()
    (['nav', 'align', None], [0, 2, 0, 1])
    """
    coded = pc.dictionary_encode(text)
    words = coded.dictionary
    return pa.concat_arrays([words, pa.nulls(1, words.type)]), arrow.values(coded.indices, len(words))


def trimmed(text: Any) -> Any:
    """Trim cells; a cell of nothing but padding becomes empty (null)."""
    stripped = pc.utf8_trim_whitespace(text)
    return pc.if_else(pc.equal(stripped, arrow.EMPTY_TEXT), arrow.NO_TEXT, stripped)


def without(text: Any, missing: Sequence[str]) -> Any:
    """Return cells without those that mean no value."""
    return pc.if_else(pc.is_in(text, value_set=arrow.texts(missing)), arrow.NO_TEXT, text)


def cleaned(text: Any, missing: Sequence[str]) -> Any:
    """Trim cells; those that are empty, or mean no value, become null."""
    return without(trimmed(text), missing) if missing else trimmed(text)


def with_point(text: Any) -> Any:
    """Return cells with a point for a decimal comma."""
    return pc.replace_substring(text, ",", ".", max_replacements=1)


def part_of(text: Any, number: int) -> Any:
    """Return one of the words of each cell, counted from 1; null where there are fewer.

    Examples
    --------
    >>> part_of(pa.array(["47.5 -8.25", "47.5", None]), 2).to_pylist()
    ['-8.25', None, None]
    """
    # \x1f stands for a delimiter that stood inside quotes
    words = pc.extract_regex(text, rf"^(?:[^\s,;\x1f]+[\s,;\x1f]+){{{number - 1}}}(?P<word>[^\s,;\x1f]+)")
    return pc.struct_field(words, [0])


def degrees(text: Any, among_parts: bool = False) -> TableCells:
    """Convert degrees, minutes and seconds in one cell to degrees; plain degrees go through.

    The parts may be parted by blanks, colons or their signs; the seconds may be absent. A sign stands before, or a
    letter N, S, E or W on either side, of plain degrees too. ``among_parts``: other cells of the column have minutes.

    Examples
    --------
    >>> read = degrees(pa.array(["-0 30 00", "47:12:36.0", "8 30.5 W", "12°30′18″S", "-8.5", "47 61 0", "8.25W"]))
    >>> read.column.values.tolist(), read.unreadable.tolist()
    ([-0.5, 47.21, -8.508333333333333, -12.505, -8.5, nan, -8.25], [False, False, False, False, False, True, False])
    """
    array, unreadable = _cast(text, pa.float64(), _NUMBER, is_sound=not among_parts)
    if not unreadable.any():
        return TableCells(_column(array, float("nan")), unreadable)
    parts, plain_parts = pc.extract_regex(text, _DMS), pc.extract_regex(text, _SIDED)
    before, sign, whole, minutes, seconds, behind = (pc.struct_field(parts, [at]) for at in range(6))
    before, sign, whole, behind = (
        pc.coalesce(one, pc.struct_field(plain_parts, [at])) for at, one in enumerate((before, sign, whole, behind))
    )
    found = arrow.is_valid(whole)
    values = [_part_values(one) for one in (whole, minutes, seconds)]
    found &= (values[1] < 60.0) & (values[2] < 60.0)
    letters = pc.binary_join_element_wise(before, sign, behind, "")
    is_minus = arrow.mask(pc.fill_null(pc.match_substring_regex(letters, "[-SWsw]"), arrow.FALSE))
    size = values[0] + values[1] / 60.0 + values[2] / 3600.0
    plain = arrow.is_valid(array)
    values_deg = np.where(plain, arrow.values(array, float("nan")), np.where(is_minus, -size, size))
    present = plain | found
    return TableCells(Column(np.where(present, values_deg, np.nan), present), arrow.is_valid(text) & ~present)


def degrees_and_minutes(text: Any) -> TableCells:
    """Convert degrees and minutes that are run together, as receivers write them, to degrees.

    A sign stands before, or a letter N, S, E or W on either side.

    Examples
    --------
    >>> read = degrees_and_minutes(pa.array(["4730.6", "-00815.0", "W12215.6", "4761.0", None]))
    >>> read.column.values.round(6).tolist(), read.unreadable.tolist()
    ([47.51, -8.25, -122.26, nan, nan], [False, False, False, True, False])
    """
    parts = pc.extract_regex(
        text, r"^\s*(?P<before>[NSEWnsew]?)\s*(?P<number>[+-]?\d+(?:\.\d*)?)\s*(?P<side>[NSEWnsew]?)\s*$"
    )
    read = numbers(pc.struct_field(parts, [1]))
    letters = pc.binary_join_element_wise(pc.struct_field(parts, [0]), pc.struct_field(parts, [2]), "")
    is_minus = arrow.mask(pc.fill_null(pc.match_substring_regex(letters, "[SWsw]"), arrow.FALSE))
    size = np.abs(read.column.values)
    whole, minutes = np.divmod(size, 100.0)
    present = read.column.mask & (minutes < 60.0)
    values = np.copysign(whole + minutes / 60.0, read.column.values) * np.where(is_minus, -1.0, 1.0)
    return TableCells(Column(np.where(present, values, np.nan), present), arrow.is_valid(text) & ~present)


def _part_values(text: Any) -> NDArray[np.float64]:
    filled = pc.if_else(pc.equal(pc.fill_null(text, arrow.EMPTY_TEXT), arrow.EMPTY_TEXT), arrow.texts(["0"])[0], text)
    return np.asarray(arrow.values(pc.cast(filled, pa.float64()), 0.0))


def looked_up(text: Any, listed: Mapping[str, float | str | bool], filler: float | str | bool) -> TableCells:
    """Convert cells to the values that are listed for them.

    A number counts however it is written. A cell that is not listed is unreadable.

    Examples
    --------
    >>> read = looked_up(pa.array(["1", "2.0", None, "7"]), {"1": 0.05, "2": 0.4}, float("nan"))
    >>> read.column.values.tolist(), read.unreadable.tolist()
    ([0.05, 0.4, nan, nan], [False, False, False, True])
    """
    coded = pc.dictionary_encode(text, null_encoding="encode")
    found = [None if word is None else _listed(word, listed) for word in coded.dictionary.to_pylist()] or [None]
    values = np.array([filler if one is None else one for one in found])
    known = np.array([one is not None for one in found])
    index = arrow.values(coded.indices, 0)
    return TableCells(Column(values[index], known[index]), arrow.is_valid(text) & ~known[index])


def _listed(word: str, listed: Mapping[str, float | str | bool]) -> float | str | bool | None:
    if word in listed:
        return listed[word]
    try:
        number = float(word)
    except ValueError:
        return None
    return listed.get(f"{number:g}")


def roots(read: TableCells) -> TableCells:
    """Return standard deviations of variances; one below zero is unreadable.

    Examples
    --------
    >>> read = roots(numbers(pa.array(["0.25", "-1"])))
    >>> read.column.values.tolist(), read.unreadable.tolist()
    ([0.5, nan], [False, True])
    """
    mask = read.column.mask
    is_below = mask & (read.column.values < 0.0)
    values = np.sqrt(np.where(is_below, np.nan, read.column.values))
    return TableCells(Column(values, mask & ~is_below), read.unreadable | is_below)


def _cast(text: Any, target: Any, pattern: str, is_sound: bool = True) -> tuple[Any, BoolArray]:
    """Cast a column; where that fails, cast what matches ``pattern`` and mark the rest.

    A column that is not sound is taken as one that fails.
    """
    options = pc.CastOptions(target_type=target, allow_decimal_truncate=True)
    if is_sound:
        with suppress(pa.ArrowException):
            return pc.cast(text, options=options), np.zeros(len(text), dtype=bool)
    fits = pc.fill_null(pc.match_substring_regex(text, pattern), arrow.FALSE)
    kept = pc.if_else(fits, text, arrow.NO_TEXT)
    return pc.cast(kept, options=options), arrow.is_valid(text) & ~arrow.mask(fits)


def _column(array: Any, filler: float | int) -> Column:
    return Column(arrow.values(array, filler), arrow.is_valid(array) if array.null_count else None)


def numbers(text: Any) -> TableCells:
    """Convert decimal numbers to float64; ``nan`` in a cell is a NaN that the device wrote.

    Examples
    --------
    >>> read = numbers(pa.array(["1.5", None, "nan", "1.5x", "+-2"]))
    >>> read.column.values.tolist(), read.column.mask.tolist(), read.unreadable.tolist()
    ([1.5, nan, nan, nan, -2.0], [True, False, True, False, True], [False, False, False, True, False])
    """
    array, unreadable = _cast(text, pa.float64(), _NUMBER)
    if unreadable.any():
        array, unreadable = _cast(_one_sign(text), pa.float64(), _NUMBER)
    return TableCells(_column(array, float("nan")), unreadable)


def ready_numbers(array: Any) -> TableCells:
    """Wrap a float64 column that the CSV parser itself has converted."""
    return TableCells(_column(array, float("nan")), np.zeros(len(array), dtype=bool))


def are_numbers(text: Any) -> bool:
    """Tell whether every cell that is not empty is a number."""
    if pc.all(pc.match_substring_regex(text, _NUMBER), min_count=0).as_py():
        return True
    if not pc.any(pc.starts_with(text, "+-")).as_py():
        return False
    return bool(pc.all(pc.match_substring_regex(_one_sign(text), _NUMBER), min_count=0).as_py())


def _one_sign(text: Any) -> Any:
    """Convert numbers such as ``+-2.5`` to ``-2.5``."""
    return pc.replace_substring_regex(text, _TWO_SIGNS, "-")


def flags(text: Any) -> TableCells:
    """Convert ``0``, ``1``, ``true``, ``false`` (any case) to bool.

    Examples
    --------
    >>> read = flags(pa.array(["1", "False", None, "2"]))
    >>> read.column.values.tolist(), read.column.mask.tolist(), read.unreadable.tolist()
    ([True, False, False, False], [True, True, False, False], [False, False, False, True])
    """
    lower = pc.utf8_lower(text)
    true, false = (
        arrow.mask(pc.is_in(lower, value_set=arrow.texts(words))) for words in (["1", "true"], ["0", "false"])
    )
    return TableCells(Column(true, true | false), arrow.is_valid(text) & ~true & ~false)


def words(text: Any, restore: Callable[[str], str] = str) -> TableCells:
    """Convert cells to fixed-width unicode.

    Cells with control characters or broken encoding are unreadable.

    Examples
    --------
    >>> read = words(pa.array(["nav", None, "n\\x1av"]))
    >>> read.column.values.tolist(), read.unreadable.tolist()
    (['nav', '', ''], [False, False, True])
    """
    strange = arrow.mask(pc.fill_null(pc.match_substring_regex(text, _NOT_TEXT), arrow.FALSE))
    present = arrow.is_valid(text) & ~strange
    coded = pc.dictionary_encode(
        pc.fill_null(pc.if_else(arrow.flags(present), text, arrow.EMPTY_TEXT), arrow.EMPTY_TEXT)
    )
    distinct = [restore(word) for word in coded.dictionary.to_pylist()] or [""]
    index = arrow.values(coded.indices, 0)
    long = np.array([len(word) > MAX_TEXT_CHARACTERS for word in distinct])
    values = np.array([word[:MAX_TEXT_CHARACTERS] for word in distinct], dtype=np.str_)
    return TableCells(Column(values[index], present), strange, long[index] if long.any() else None)


def decimal_ns(text: Any, digits: int = 9, multiple: int = 1) -> TableCells:
    """Convert decimal numbers of a unit of time to integer nanoseconds, exactly.

    Digits below a nanosecond are cut off.

    Parameters
    ----------
    digits, multiple : int
        The unit is ``10**digits`` x ``multiple`` nanoseconds: 9 and 1 for seconds, 6 and 1 for milliseconds, 9 and 60
        for minutes.

    Examples
    --------
    >>> decimal_ns(pa.array(["1700000000.123456789", "-0.5", "x", "1.5e1"])).column.values.tolist()
    [1700000000123456789, -500000000, 0, 15000000000]
    >>> decimal_ns(pa.array(["1700000000123.4567899"]), 6).column.values.tolist()
    [1700000000123456789]
    """
    filled, fits = arrow.is_valid(text), pc.fill_null(pc.match_substring_regex(text, _DECIMAL), arrow.FALSE)
    kept = pc.if_else(fits, text, arrow.NO_TEXT)
    target = pa.decimal128(_DECIMAL_DIGITS + digits, digits)
    decimals = pc.cast(kept, options=pc.CastOptions(target_type=target, allow_decimal_truncate=True))
    # A decimal128 is a 128-bit integer, here of nanoseconds: its low half is the int64 wanted.
    halves = np.frombuffer(decimals.buffers()[1], dtype=np.int64, count=2 * (len(decimals) + decimals.offset))
    low, high = halves[2 * decimals.offset :: 2], halves[2 * decimals.offset + 1 :: 2]
    values, readable = low.copy(), arrow.mask(fits) & (high == low >> 63)
    for at in np.flatnonzero(filled & ~arrow.mask(fits)):  # 1.5e3: rare, so one by one
        exact = _exact(text[int(at)].as_py(), digits)
        values[at], readable[at] = exact or 0, exact is not None
    readable &= (values > -MAX_TIME_NS // multiple) & (values < MAX_TIME_NS // multiple)
    return _times(np.where(readable, values, 0) * multiple, filled, readable)


def _exact(text: str, digits: int) -> int | None:
    """Return a number with an exponent times ``10**digits``, cut to a whole number.

    None when the text is no such number, or the result is beyond 64 bits.
    """
    if not _EXPONENT.fullmatch(text):
        return None
    whole = int(Decimal(text).scaleb(digits))
    return whole if abs(whole) < MAX_TIME_NS else None


def integers_ns(text: Any) -> TableCells:
    """Convert whole numbers of nanoseconds."""
    array, unreadable = _cast(text, pa.int64(), _INTEGER)
    filled = arrow.is_valid(text)
    return _times(arrow.values(array, 0), filled, filled & ~unreadable)


def _times(values: Int64Array, filled: BoolArray, readable: BoolArray) -> TableCells:
    """Return the times of cells that are filled and readable.

    A time beyond the range of :data:`MAX_TIME_NS` counts as unreadable.
    """
    present = readable & (values > -MAX_TIME_NS) & (values < MAX_TIME_NS)  # of the least integer abs() is negative
    return TableCells(Column(np.where(present, values, 0), present), filled & ~present)


def iso_ns(text: Any) -> tuple[TableCells, BoolArray]:
    """ISO 8601 times as UTC nanoseconds since 1970, and where no zone was named (read as UTC).

    Slashes or points may part the date: 2026/05/04 06:00:01.

    Examples
    --------
    >>> cells, zoneless = iso_ns(pa.array(["2026-05-04T06:00:00.25Z", "2026-05-04 06:00:01", "later"]))
    >>> cells.column.values.tolist(), zoneless.tolist()
    ([1777874400250000000, 1777874401000000000, 0], [False, True, False])
    """
    text = _dashed(text)
    for target, zoneless in ((pa.timestamp("ns", tz="UTC"), False), (pa.timestamp("ns"), True)):
        try:
            whole = pc.cast(pc.cast(text, target), pa.int64())
        except pa.ArrowException:
            continue
        filled = arrow.is_valid(text)
        read = _times(arrow.values(whole, 0), filled, filled)
        return read, read.column.mask & zoneless
    return _iso_one_by_one(text)


def _dashed(text: Any) -> Any:
    """Return times whose dates have dashes: 2026-05-04 of 2026/05/04 or 2026.5.4."""
    first = next((cell for cell in text[:100].to_pylist() if cell), "")
    if not _SLASHED.match(first):
        return text
    text = pc.replace_substring_regex(text, r"^(\d{4})[/.](\d{1,2})[/.](\d{1,2})\b", r"\1-0\2-0\3")
    return pc.replace_substring_regex(text, r"^(\d{4})-0?(\d\d)-0?(\d\d)\b", r"\1-\2-\3")


def _iso_one_by_one(text: Any) -> tuple[TableCells, BoolArray]:
    values = np.zeros(len(text), dtype=np.int64)
    readable, zoneless = np.zeros(len(text), dtype=bool), np.zeros(len(text), dtype=bool)
    for at, cell in enumerate(text.to_pylist()):
        if cell is None:
            continue
        try:
            utc_ns, named_zone = iso_to_utc_ns(cell)
        except GroundstationError:
            continue
        if abs(utc_ns) < MAX_TIME_NS:
            values[at], readable[at], zoneless[at] = utc_ns, True, not named_zone
    return _times(values, arrow.is_valid(text), readable), zoneless
