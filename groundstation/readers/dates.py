"""Conversion of local date, time and UTC offset in columns of text to UTC nanoseconds."""

import re
from typing import Any

import numpy as np

from groundstation.base import arrow_compute as pc
from groundstation.base import arrow_values as arrow
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.cells import TableCells
from groundstation.readers.days import day_ns

_CLOCK = re.compile(
    r"(?P<hour>\d\d?)(?P<sign>:?)(?P<minute>\d\d)(?:(?P=sign)(?P<second>\d\d)(?:[.,](?P<fraction>\d*))?)?"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?",
    re.ASCII,
)


def clock_ns(text: str, formats: tuple[str, ...] = ()) -> int | None:
    """Return the time since midnight of ``14:13:51.25``, ``2:13:51 PM`` or ``141351.25``.

    Examples
    --------
    >>> clock_ns("00:00:01.5"), clock_ns("12:00:01 AM"), clock_ns("000001"), clock_ns("12:03")
    (1500000000, 1000000000, 1000000000, None)
    """
    match = _CLOCK.fullmatch(text)
    if match is None:
        return None
    hour, minute, second = (int(part or 0) for part in match.group("hour", "minute", "second"))
    if half := match["half"]:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + (12 if half in "Pp" else 0)
    elif match["second"] is None:  # 12:03 may be minutes and seconds
        return None
    if hour > 23 or minute > 59 or second > 60:
        return None
    return (hour * 3600 + minute * 60 + second) * NS_PER_S + int(((match["fraction"] or "") + "000000000")[:9])


def _offset_ns(text: str, formats: tuple[str, ...]) -> int | None:
    sign = -1 if text.startswith("-") else 1
    hours, colon, minutes = text.lstrip("+-").partition(":")
    if not hours.isdecimal() or not (minutes or "0").isdecimal() or (colon and not minutes):
        return None
    total_min = int(hours) * 60 + int(minutes or 0)
    return sign * total_min * 60 * NS_PER_S if total_min < 24 * 60 else None


def _each_distinct(text: Any, parse: Any, formats: tuple[str, ...]) -> tuple[Int64Array, BoolArray, BoolArray]:
    """Parse every distinct text once; return values, presence, and unreadable cells."""
    coded = pc.dictionary_encode(text, null_encoding="encode")
    parsed = [None if word is None else parse(word, formats) for word in coded.dictionary.to_pylist()]
    values = np.array([0 if value is None else value for value in parsed] or [0], dtype=np.int64)
    known = np.array([value is not None for value in parsed] or [False], dtype=bool)
    index = arrow.values(coded.indices, 0)
    filled = arrow.is_valid(text)
    return values[index], known[index], filled & ~known[index]


def local_ns(date: Any, time: Any, offset: Any | None, date_formats: tuple[str, ...]) -> TableCells:
    """UTC nanoseconds since 1970 of local date and time: date + time - offset.

    A row has a time when date and time are there; an empty offset is zero, an unreadable one makes the time unreadable.

    Examples
    --------
    >>> import pyarrow as pa
    >>> read = local_ns(pa.array(["23/06/2021", None]), pa.array(["14:13:51", "14:13:52"]), pa.array(["+01:00", ""]),
    ...                 ("%Y-%m-%d", "%d/%m/%Y"))
    >>> read.column.values.tolist(), read.column.mask.tolist()
    ([1624454031000000000, 0], [True, False])
    """
    days, has_day, bad_day = _each_distinct(date, day_ns, date_formats)
    times, has_time, bad_time = _each_distinct(time, clock_ns, ())
    unreadable = bad_day | bad_time
    if offset is None:
        offsets = np.zeros(len(days), dtype=np.int64)
    else:
        offsets, _known, bad_offset = _each_distinct(offset, _offset_ns, ())
        unreadable = unreadable | (bad_offset & has_day & has_time)
    present = has_day & has_time & ~unreadable
    return TableCells(Column(np.where(present, days + times - offsets, 0), present), unreadable)


def parted(text: Any, date_formats: tuple[str, ...]) -> tuple[Any, Any]:
    """Return the dates and the times of day of cells that have both.

    A blank, a comma and a blank, or a T is between them; a date has as many blanks as its first format. A comma inside
    quotes is seen as the sign for it.

    Examples
    --------
    >>> import pyarrow as pa
    >>> date, time = parted(pa.array(["6/23/2021, 2:13:51 PM", "later"]), ("%m/%d/%Y",))
    >>> date.to_pylist(), time.to_pylist()
    (['6/23/2021', 'later'], ['2:13:51 PM', 'later'])
    """
    blanks = date_formats[0].count(" ") if date_formats else 0
    found = pc.extract_regex(text, rf"^(?P<date>\S+?(?: +\S+?){{{blanks}}})[.,]?\x1f?(?:T|\s+)(?P<time>\d.*)$")
    # A cell that is no date and time stays whole, to be counted as unreadable.
    date, time = (pc.struct_field(found, [at]) for at in (0, 1))
    return pc.coalesce(date, text), pc.coalesce(time, text)


def time_of_day_ns(text: Any) -> TableCells:
    """Nanoseconds since midnight of times such as ``14:13:51.25``.

    Examples
    --------
    >>> import pyarrow as pa
    >>> time_of_day_ns(pa.array(["00:00:01.5", "later", None])).column.values.tolist()
    [1500000000, 0, 0]
    """
    values, known, unreadable = _each_distinct(text, clock_ns, ())
    return TableCells(Column(values, known), unreadable)
