"""Times of rows: the cells of the columns of time become nanoseconds."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.base import arrow_values as arrow
from groundstation.base.records import Column
from groundstation.base.timescales import gps_week_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers import cells
from groundstation.readers.cells import TableCells
from groundstation.readers.dates import local_ns, parted, time_of_day_ns
from groundstation.readers.days import DayCount, WeekCount
from groundstation.readers.layout import TimeRule

_MOST_WEEKS, _MOST_WEEK_NS = 10_000, 2 * 604_800 * NS_PER_S  # some writers let the seconds run on over the week


def times_of(rule: TimeRule, texts: Sequence[Any], days: DayCount) -> tuple[TableCells, int]:
    """Return the times of rows in nanoseconds, and the number of those that name no zone.

    Parameters
    ----------
    rule : TimeRule
    texts : sequence of pyarrow string array
        Cells of its columns.
    days : DayCount
        Of the rows above.
    """
    if rule.kind in ("seconds", "unix", "utc_counter"):
        return _of_counter(rule, texts[0], days), 0
    if rule.kind == "nanoseconds":
        return cells.integers_ns(texts[0]), 0
    if rule.kind == "gps_week":
        return _of_week(rule, texts, days.weeks), 0
    if rule.kind == "time_of_day":
        return _of_day(rule, texts[0], days), 0
    if rule.kind == "utc_fraction":
        utc, zoneless = utc_of(texts[1:], rule.date_formats)
        return _added(cells.decimal_ns(texts[0], rule.digits, rule.multiple), utc), zoneless
    if rule.kind == "local" and rule.columns[0] == rule.columns[1]:
        texts = (*parted(texts[0], rule.date_formats), *texts[2:])
    return utc_of(texts, rule.date_formats)


def utc_of(texts: Sequence[Any], date_formats: tuple[str, ...]) -> tuple[TableCells, int]:
    """Return UTC of one column (ISO 8601) or of date, time and offset.

    Returns also the number of times without a zone.
    """
    if len(texts) == 1:
        read, zoneless = cells.iso_ns(texts[0])
        return read, int(zoneless.sum())
    offset = texts[2] if len(texts) > 2 else None
    read = local_ns(texts[0], texts[1], offset, date_formats)
    return read, 0 if offset is None else int(np.count_nonzero(read.column.mask & ~arrow.is_valid(offset)))


def _of_counter(rule: TimeRule, text: Any, days: DayCount) -> TableCells:
    read = cells.decimal_ns(text, rule.digits, rule.multiple)
    if not rule.modulus_ns:
        return read
    mask = read.column.mask
    time_ns = read.column.values + days.days_ns(read.column.values, mask, rule.modulus_ns)
    return TableCells(Column(np.where(mask, time_ns, 0), mask), read.unreadable)


def _of_week(rule: TimeRule, texts: Sequence[Any], weeks: WeekCount) -> TableCells:
    """Return UTC of GPS weeks and seconds of the week."""
    week, second = cells.numbers(texts[0]), cells.decimal_ns(texts[1], rule.digits, rule.multiple)
    number = np.where(week.column.mask & np.isfinite(week.column.values), week.column.values, -1.0)
    is_week = (number >= 0.0) & (number < _MOST_WEEKS) & (number == np.floor(number))
    is_second = second.column.mask & (second.column.values >= 0) & (second.column.values < _MOST_WEEK_NS)
    present = is_week & is_second
    if rule.weeks:
        number[present] += weeks.rollovers(number[present])
    number[present] += weeks.to_add(number[present].astype(np.int64), second.column.values[present])
    whole_ms, rest_ns = np.divmod(np.where(present, second.column.values, 0), 1_000_000)
    utc_ns = gps_week_to_utc_ns(np.where(present, number, 0.0).astype(np.int64) + rule.weeks, whole_ms) + rest_ns
    filled = arrow.is_valid(texts[0]) & arrow.is_valid(texts[1])
    return TableCells(Column(np.where(present, utc_ns, 0), present), filled & ~present)


def _of_day(rule: TimeRule, text: Any, days: DayCount) -> TableCells:
    read = time_of_day_ns(text)
    mask = read.column.mask
    time_ns = read.column.values + days.days_ns(read.column.values, mask) + rule.day_ns
    return TableCells(Column(np.where(mask, time_ns, 0), mask), read.unreadable)


def _added(one: TableCells, other: TableCells) -> TableCells:
    present = one.column.mask & other.column.mask
    total = np.where(present, one.column.values + other.column.values, 0)
    return TableCells(Column(total, present), one.unreadable | other.unreadable)
