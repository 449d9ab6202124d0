"""Dates and times of day in the cells of a table."""

import re

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.readers.dates import clock_ns
from groundstation.readers.drafts.causes import date_order
from groundstation.readers.drafts.sample import ENOUGH, TableSample
from groundstation.readers.months import MONTHS, NAME

_NUMBERED = r"\d{4}[/.-]\d\d?[/.-]\d\d?|\d{1,2}[/.-]\d{1,2}[/.-](?:\d{4}|\d\d)"
_PARTED = r"(?:\. ?|[-/ ])"
_NAMED = rf"\d{{1,2}}{_PARTED}{NAME}{_PARTED}(?:\d{{4}}|\d\d)|{NAME}{_PARTED}\d{{1,2}}{_PARTED}\d{{4}}"
_DAY = re.compile(rf"{_NUMBERED}|\d{{8}}|{_NAMED}")
_CLOCK = re.compile(r"\d{1,2}:\d\d:\d\d(?:[.,]\d*)?(?: ?[AaPp]\.?[Mm]\.?)?|\d{1,2}:\d\d ?[AaPp]\.?[Mm]\.?")
_DIGITS = re.compile(r"(?:[01]\d|2[0-3])[0-5]\d[0-5]\d(?:[.,]\d*)?")  # hhmmss
_SIX = re.compile(r"(\d\d)(\d\d)(\d\d)")
DATE_AND_CLOCK = re.compile(rf"({_NUMBERED}|{_NAMED})(?:,? +|T)({_CLOCK.pattern})")


def is_clock(sample: TableSample, at: int) -> bool:
    """Tell whether a column is a time of day; six digits are where the name says so."""
    if are(sample, at, _CLOCK):
        return True
    meaning = sample.meanings[at]
    is_named = meaning is not None and meaning.role in ("time", "clock") and not meaning.unit
    return is_named and are(sample, at, _DIGITS, share=1.0)


def is_day(sample: TableSample, at: int) -> bool:
    """Tell whether a column is of dates; digits alone are where the name says so."""
    meaning = sample.meanings[at]
    is_named = meaning is not None and meaning.role == "date"
    if are(sample, at, _DAY) and not is_clock(sample, at):
        return is_named or bool(re.search("[-/. ]", sample.filled(at)[0]))
    return is_named and are(sample, at, _SIX)


def date_formats(cells: list[str]) -> tuple[str, str]:
    """Return the strptime format of dates, and a doubt."""
    first = cells[0]
    if _SIX.fullmatch(first):
        return _six_digits(cells)
    if name := re.search(NAME, first):
        if name[0].lower() not in MONTHS:
            return "", ""
        year = "%Y" if re.search(r"\d{4}$", first) else "%y"
        form = re.sub(r"\d{2,4}$", year, first.replace(name[0], "%b"))
        return re.sub(r"(?<![%\d])\d{1,2}(?!\d)", "%d", form, count=1), ""
    sign = next((one for one in "-/." if one in first), "")
    if re.match(r"\d{4}", first):
        return f"%Y{sign}%m{sign}%d", ""
    year = "%Y" if re.search(r"\d{4}$", first) else "%y"
    order = date_order(cells)
    if order == "month/day":
        return f"%m{sign}%d{sign}{year}", "month before day, as in the US"
    if order == "day/month":
        return f"%d{sign}%m{sign}{year}", ""
    if order == "unclear":
        is_us = sign == "/"
        text = f"%m{sign}%d{sign}{year}" if is_us else f"%d{sign}%m{sign}{year}"
        return text, f"day and month cannot be told apart: {'month' if is_us else 'day'} first is assumed"
    return "", ""


def _six_digits(cells: list[str]) -> tuple[str, str]:
    """Return the format of dates such as 240518, and a doubt: the year is first or last."""
    parts = np.array([[int(part) for part in match.groups()] for cell in cells if (match := _SIX.fullmatch(cell))])
    first, last = parts[:, 0], parts[:, 2]
    is_year_first = first.max() > 31 or not (last.max() > 31 or len(np.unique(first)) > len(np.unique(last)))
    is_sure = first.max() > 31 or last.max() > 31
    form, told = ("%y%m%d", "year, month, day") if is_year_first else ("%d%m%y", "day, month, year")
    return form, "" if is_sure else f"six digits of a date: {told} assumed"


def clock_seconds(cell: str) -> float:
    value = clock_ns(cell.strip())
    return np.nan if value is None else value / NS_PER_S


def are(sample: TableSample, at: int, pattern: re.Pattern[str], share: float = ENOUGH) -> bool:
    filled = sample.filled(at)
    return len(filled) > 0.5 * len(sample.columns[at]) and sum(
        bool(pattern.fullmatch(cell.strip())) for cell in filled
    ) >= share * len(filled)
