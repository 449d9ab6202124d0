"""Time of the rows of a table, found by names and values."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import UnreadableLogError
from groundstation.base.toml_text import quoted
from groundstation.base.units import NS_PER_S
from groundstation.readers.dates import clock_ns
from groundstation.readers.days import day_ns
from groundstation.readers.drafts.causes import cause_of_times, date_order
from groundstation.readers.drafts.sample import ENOUGH, TableSample
from groundstation.readers.drafts.words import meaning_of

_ISO = re.compile(r"\d{4}[-/.]\d\d?[-/.]\d\d?[T ]\d\d?:\d\d.*")
_DAY = re.compile(r"\d{4}([-/.])\d\d?\1\d\d?|\d{8}|\d{1,2}[/.-]\d{1,2}[/.-](?:\d{4}|\d\d)|\d{1,2}-[A-Za-z]{3}-\d{4}")
_CLOCK = re.compile(r"\d{1,2}:\d\d:\d\d(?:[.,]\d*)?(?: ?[AaPp]\.?[Mm]\.?)?|\d{1,2}:\d\d ?[AaPp]\.?[Mm]\.?")
_DIGITS = re.compile(r"(?:[01]\d|2[0-3])[0-5]\d[0-5]\d(?:[.,]\d*)?")  # hhmmss
_SIX = re.compile(r"(\d\d)(\d\d)(\d\d)")
_BOTH = re.compile(
    r"(\d{4}[/.-]\d\d?[/.-]\d\d?|\d{1,2}[/.-]\d{1,2}[/.-](?:\d{4}|\d\d)|\d{1,2}-[A-Za-z]{3}-\d{4})(?:,? +|T)"
    rf"({_CLOCK.pattern})"
)
# A date in the name of a file or above the rows: its pattern, and its strptime format.
_TOLD_DAYS = (
    (r"(\d{4}-\d\d-\d\d)", "%Y-%m-%d"),
    (r"(\d{4}_\d\d_\d\d)", "%Y_%m_%d"),
    (r"(?<!\d)((?:19|20)\d{6})(?!\d)", "%Y%m%d"),
    (r"(\d\d\.\d\d\.\d{4})", "%d.%m.%Y"),
)
_DAY_S = 86_400.0
_OFFSET = re.compile(r"[+-]\d{1,2}:?\d\d")
_RISING = 0.98  # share of the steps that do not go back
_SINCE_1970 = {"s": (8e8, 4e9), "ms": (8e11, 4e12), "us": (8e14, 4e15), "ns": (8e17, 4e18)}
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
_PRIME = 0.9  # share of rows with a time of their own
_WEEK_S = 604_800.0


@dataclass(frozen=True)
class TimeGuess:
    """Time of the rows: the columns, the lines of ``[time]``, why.

    ``seconds`` are the times of the rows of the sample, NaN where there are none. ``doubt``: what the user has to look
    at. ``metadata``: further lines of the profile, which tell the day.
    """

    columns: tuple[int, ...]
    lines: tuple[str, ...]
    why: str
    seconds: FloatArray
    is_absolute: bool
    doubt: str = ""
    rank: int = 0
    metadata: tuple[str, ...] = ()

    @property
    def own(self) -> float:
        """Share of the rows that have a time of their own."""
        known = self.seconds[np.isfinite(self.seconds)]
        return len(np.unique(known)) / max(1, len(known))


def time_of(sample: TableSample) -> TimeGuess:
    """Return the time of the rows.

    An absolute time is taken before a counter, unless it repeats: a counter then tells the rows apart.

    Raises
    ------
    UnreadableLogError
        When no column is a time; the cause is named where it is known.
    """
    found = [*_of_iso(sample), *_of_local(sample), *_of_both_in_one(sample), *_of_week(sample), *_of_numbers(sample)]
    found += [] if any(one.is_absolute for one in found) else [*_of_day(sample)]
    if not found:
        raise UnreadableLogError(sample.name, *_no_time(sample))
    found += [*_of_both(sample, found)]
    fine = [one for one in found if one.own >= _PRIME] or found
    return max(fine, key=lambda one: (one.is_absolute, one.rank, one.own))


def _of_both(sample: TableSample, found: list[TimeGuess]) -> Iterator[TimeGuess]:
    """Yield UTC in whole seconds together with a counter that tells the rows apart."""
    utc = next((one for one in found if one.is_absolute and one.own < _PRIME), None)
    counter = next((one for one in found if not one.is_absolute and one.own >= _PRIME), None)
    if utc is None or counter is None or any(one.is_absolute and one.own >= _PRIME for one in found):
        return
    of_utc = [line.replace("column =", "utc =") for line in utc.lines[1:] if not line.startswith("offset")]
    of_counter = [line.replace("column =", "counter =") for line in counter.lines[1:]]
    yield TimeGuess(
        (*counter.columns, *utc.columns),
        ('kind = "utc_counter"', *of_counter, *of_utc),
        f"{utc.why}, in whole seconds, beside a counter",
        counter.seconds,
        True,
        "; ".join(filter(None, (utc.doubt, counter.doubt))),
        counter.rank + 1,
    )


def _of_week(sample: TableSample) -> Iterator[TimeGuess]:
    """Yield GPS week and seconds of the week."""
    by_role = {one.role: at for at, one in reversed(list(enumerate(sample.meanings))) if one is not None and one.role}
    if not {"week", "tow"} <= by_role.keys():
        return
    week, tow = by_role["week"], by_role["tow"]
    seconds, weeks = sample.numbers(tow), sample.numbers(week)
    if not (sample.is_of_numbers(tow) and sample.is_of_numbers(week)):
        return
    unit = "ms" if np.nanmax(seconds) > 2 * _WEEK_S else "s"
    seconds = seconds * SECONDS[unit] + weeks * _WEEK_S
    if _rises(seconds) and np.nanmax(seconds) > np.nanmin(seconds):
        lines: tuple[str, ...] = (
            'kind = "gps_week"',
            f"week = {quoted(sample.names[week])}",
            f"seconds = {quoted(sample.names[tow])}",
            f'unit = "{unit}"',
        )
        doubt = ""
        if np.nanmax(weeks) < 1024:
            lines, doubt = (*lines, "earliest_year = 2000"), "weeks below 1024 have rolled over: read as from 2000 on"
        yield TimeGuess((week, tow), lines, "GPS week and seconds of the week", seconds, True, doubt, 3)


def _no_time(sample: TableSample) -> tuple[str, str, str]:
    """Return what was found instead of a time, what was expected, and the next step."""
    for at, name in enumerate(sample.names):
        meaning, cells = sample.meanings[at], sample.filled(at)
        is_named = meaning is not None and meaning.role in ("time", "date", "clock")
        if cells and (is_named or date_order(cells)) and (cause := cause_of_times(cells)):
            return f"no time that can be read: column {name!r} has {cause}", "", ""
    names = ", ".join(sample.names[:8]) + (", ..." if len(sample.names) > 8 else "")
    return (
        f"no column that is a time among {names}",
        "numbers that rise, or dates",
        "add a column with the time of each row",
    )


def _of_iso(sample: TableSample) -> Iterator[TimeGuess]:
    for at, name in enumerate(sample.names):
        cells = sample.columns[at]
        filled = sample.filled(at)
        if not filled or sum(map(bool, map(_ISO.fullmatch, filled))) < ENOUGH * len(filled):
            continue
        if len(filled) < 0.5 * len(cells):
            continue
        seconds = _iso_seconds(cells)
        if _rises(seconds) and np.ptp(seconds[np.isfinite(seconds)]) > 0.0:
            doubt = "" if re.search(r"Z$|[+-]\d\d:?\d\d$|UTC$", filled[0].strip()) else "names no zone: read as UTC"
            lines = ('kind = "iso"', f"column = {quoted(name)}")
            yield TimeGuess(
                (at,), lines, f"dates such as {filled[0]}", seconds, True, doubt=doubt, rank=_rank(sample, at)
            )


def _iso_seconds(cells: tuple[str, ...]) -> FloatArray:
    """Return rough times since 1970 in seconds: good for steps, not for reading."""
    found = np.full(len(cells), np.nan)
    for at, cell in enumerate(cells):
        match = re.match(r"(\d{4})[-/.](\d\d?)[-/.](\d\d?)[T ](\d\d?):(\d\d)(?::(\d\d(?:[.,]\d+)?))?", cell)
        if match:
            year, month, day, hour, minute = (int(part) for part in match.groups()[:5])
            if 1 <= month <= 12 and 1 <= day <= 31:
                days = np.datetime64(f"{year:04d}-{month:02d}-01", "D").astype(np.int64) + day - 1
                found[at] = (
                    days * 86400.0 + hour * 3600 + minute * 60 + float((match.group(6) or "0").replace(",", "."))
                )
    return found


def _of_local(sample: TableSample) -> Iterator[TimeGuess]:
    days = [at for at in range(len(sample.names)) if _is_day(sample, at)]
    clocks = [at for at in range(len(sample.names)) if _is_clock(sample, at)]
    if not days or not clocks:
        return
    day, clock = days[0], clocks[0]
    formats, doubt = _date_formats(sample.filled(day))
    if not formats:
        return
    offset = next((at for at in range(len(sample.names)) if _are(sample, at, _OFFSET)), None)
    zone = '"UTC"' if offset is None else quoted(sample.names[offset])
    if offset is None:
        doubt = _both_doubts(doubt, _zone_doubt(sample, day, clock))
    lines = (
        'kind = "local"',
        f"date = {quoted(sample.names[day])}",
        f"time = {quoted(sample.names[clock])}",
        f"offset = {zone}",
        f'date_formats = ["{formats}"]',
    )
    seconds = np.array([_clock_seconds(cell) for cell in sample.columns[clock]])
    columns = (day, clock) if offset is None else (day, clock, offset)
    yield TimeGuess(columns, lines, "date and time of day in two columns", seconds, True, doubt=doubt, rank=2)


def _of_both_in_one(sample: TableSample) -> Iterator[TimeGuess]:
    """Yield dates and times of day in one column that are not ISO 8601."""
    for at, name in enumerate(sample.names):
        if not _are(sample, at, _BOTH):
            continue
        matches = [_BOTH.fullmatch(cell.strip()) for cell in sample.columns[at]]
        formats, doubt = _date_formats([match[1] for match in matches if match])
        if not formats:
            continue
        days = [match[1] if match else "" for match in matches]
        changes = np.cumsum([bool(day) and day != before for before, day in zip(days, ["", *days], strict=False)])
        clock = np.array([_clock_seconds(match[2]) if match else np.nan for match in matches])
        seconds = clock + changes * _DAY_S
        lines = (
            'kind = "local"',
            f"column = {quoted(name)}",
            'offset = "UTC"',
            f'date_formats = ["{formats}"]',
        )
        doubt = _both_doubts(doubt, _zone_doubt(sample, at))
        example = sample.filled(at)[0]
        yield TimeGuess((at,), lines, f"dates such as {example}", seconds, True, doubt=doubt, rank=_rank(sample, at))


def _of_day(sample: TableSample) -> Iterator[TimeGuess]:
    """Yield times of day; the name of the file, or a line above the rows, may tell the date."""
    for at, name in enumerate(sample.names):
        if not _is_clock(sample, at):
            continue
        seconds = np.array([_clock_seconds(cell) for cell in sample.columns[at]])
        steps = np.diff(seconds, prepend=seconds[:1])
        seconds = seconds + np.cumsum(np.nan_to_num(steps) < -_DAY_S / 2) * _DAY_S
        if not _rises(seconds) or not np.ptp(seconds[np.isfinite(seconds)]) > 0.0:
            continue
        table, pattern, form, where = _told_day(sample)
        entry = f"day = '{pattern}'" if pattern else 'day = "unknown"  # ? put the date here, as 2026-05-04'
        lines = ('kind = "time_of_day"', f"column = {quoted(name)}", 'date = "day"', f'date_formats = ["{form}"]')
        doubt = f"times of day; the date is that {where}" if pattern else "times of day without a date: put it below"
        doubt = _both_doubts(doubt, _zone_doubt(sample, at))
        yield TimeGuess(
            (at,), lines, f"times of day such as {sample.filled(at)[0]}", seconds, bool(pattern), doubt, -1,
            ("", f"[metadata.{table}]", entry),
        )  # fmt: skip


def _told_day(sample: TableSample) -> tuple[str, str, str, str]:
    """Return table of the metadata, pattern, format and place of a date outside the rows."""
    above = "\n".join(sample.above)
    for text, table, where in ((sample.name, "find_in_name", "in the name of the file"), (above, "find", "above")):
        slashed = re.search(r"(?<!\d)\d{1,2}/\d{1,2}/\d{4}", text)
        form = {"month/day": "%m/%d/%Y", "day/month": "%d/%m/%Y"}.get(date_order([slashed[0]]) if slashed else "", "")
        own = [(r"(?<!\d)(\d{1,2}/\d{1,2}/\d{4})", form)] if form else []
        for pattern, form in (*_TOLD_DAYS, *own):
            match = re.search(pattern, text)
            if match and day_ns(match[1], (form,)) is not None:
                return table, pattern, form, where
    return "set", "", "%Y-%m-%d", ""


def _zone_doubt(sample: TableSample, *columns: int) -> str:
    """Return the doubt that no name tells a zone."""
    is_utc = any(word in sample.names[at].lower() for at in columns for word in ("utc", "gmt", "zulu"))
    return "" if is_utc else "nothing names the zone: read as UTC"


def _both_doubts(one: str, other: str) -> str:
    return "; ".join(filter(None, (one, other)))


def _is_clock(sample: TableSample, at: int) -> bool:
    """Tell whether a column is a time of day; six digits are where the name says so."""
    if _are(sample, at, _CLOCK):
        return True
    meaning = sample.meanings[at]
    is_named = meaning is not None and meaning.role in ("time", "clock") and not meaning.unit
    return is_named and _are(sample, at, _DIGITS, share=1.0)


def _is_day(sample: TableSample, at: int) -> bool:
    """Tell whether a column is of dates; digits alone are where the name says so."""
    meaning = sample.meanings[at]
    is_named = meaning is not None and meaning.role == "date"
    if _are(sample, at, _DAY) and not _is_clock(sample, at):
        return is_named or bool(re.search("[-/.]", sample.filled(at)[0]))
    return is_named and _are(sample, at, _SIX)


def _date_formats(cells: list[str]) -> tuple[str, str]:
    """Return the strptime format of dates, and a doubt."""
    first = cells[0]
    if _SIX.fullmatch(first):
        return _six_digits(cells)
    if re.search("[A-Za-z]", first):
        return "%d-%b-%Y", ""
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


def _clock_seconds(cell: str) -> float:
    value = clock_ns(cell.strip())
    return np.nan if value is None else value / NS_PER_S


def _are(sample: TableSample, at: int, pattern: re.Pattern[str], share: float = ENOUGH) -> bool:
    filled = sample.filled(at)
    return len(filled) > 0.5 * len(sample.columns[at]) and sum(
        bool(pattern.fullmatch(cell.strip())) for cell in filled
    ) >= share * len(filled)


def _of_numbers(sample: TableSample) -> Iterator[TimeGuess]:
    for at, name in enumerate(sample.names):
        meaning = sample.meanings[at]
        if _is_clock(sample, at):
            continue
        is_of_week = meaning is not None and meaning.role == "tow"
        is_named = is_of_week or (meaning is not None and meaning.role == "time")
        if meaning is not None and not is_named:
            continue
        values = sample.numbers(at)
        known = values[np.isfinite(values)]
        if len(known) < 2 or len(known) < 0.5 * len(values) or not sample.is_of_numbers(at):
            continue
        if not _rises(values) or np.ptp(known) <= 0.0:
            continue
        middle, step = float(np.median(known)), _step(sample, at)
        since = next((unit for unit, (low, high) in _SINCE_1970.items() if low < middle < high), "")
        is_first = at == next((place for place, column in enumerate(sample.columns) if any(column)), 0)
        if (not is_named and not (is_first or since)) or not np.isfinite(step):
            continue
        if not is_named and not since and len(np.unique(known)) < _PRIME * len(known):
            continue
        unit, doubt = (since, "") if since else _unit_by(meaning.unit if meaning else "", known, step)
        why = (
            f"counts from 1970 in {unit}"
            if since
            else f"{'named so' if is_named else 'numbers that rise'}, steps of {step:g}"
        )
        if since and "gps" in name.lower() and unit == "s" and middle < 1.5e9:
            doubt = "seconds since 1970 assumed: GPS seconds count from 1980 and differ by leap seconds"
        if is_of_week:
            unit = (meaning.unit if meaning else "") or ("ms" if float(np.max(known)) > 2 * _WEEK_S else "s")
            doubt = "seconds of the GPS week without the week: no absolute time"
        lines = (f'kind = "{"unix" if since else "seconds"}"', f"column = {quoted(name)}", f'unit = "{unit}"')
        rank = _rank(sample, at) + (bool(since) if is_named else -2)  # seconds since 1970 need no zone
        yield TimeGuess((at,), lines, why, values * SECONDS[unit], bool(since), doubt, rank)


def _rank(sample: TableSample, at: int) -> int:
    """Return how well a name fits: one that is known before others."""
    meaning = sample.meanings[at] or meaning_of(sample.names[at].rpartition(".")[2])
    return 2 if meaning is not None and meaning.role == "time" else 0


def _unit_by(told: str, known: FloatArray, step: float) -> tuple[str, str]:
    """Return the unit of a counter, as its name tells it or its steps show."""
    if told:
        return told, ""
    is_whole = bool(np.all(known == np.floor(known)))
    if not is_whole:
        unit = "s" if step < 50.0 else "ms"
    else:
        unit = "s" if step <= 5.0 else "ms" if step < 2000.0 else "us" if step < 1e7 else "ns"
    return unit, f"unit {unit} by its steps of {step:g}: check it"


def _step(sample: TableSample, at: int) -> float:
    """Return the median step between rows, zeros left out."""
    steps = np.concatenate([np.diff(part) for part in sample.parts(at)])
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    return float(np.median(steps)) if len(steps) else np.nan


def _rises(values: FloatArray) -> bool:
    """Tell whether numbers hardly ever go back."""
    steps = np.diff(values[np.isfinite(values)])
    return len(steps) > 0 and bool(np.count_nonzero(steps >= 0.0) >= _RISING * len(steps))
