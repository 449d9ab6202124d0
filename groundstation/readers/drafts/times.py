"""Time of the rows of a table, found by names and values."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import UnreadableLogError
from groundstation.base.toml_text import quoted
from groundstation.readers.days import day_ns
from groundstation.readers.drafts.causes import cause_of_times, date_order
from groundstation.readers.drafts.clocks import DATE_AND_CLOCK, are, clock_seconds, date_formats, is_clock, is_day
from groundstation.readers.drafts.column import both
from groundstation.readers.drafts.counters import of_fractions, of_numbers, of_week
from groundstation.readers.drafts.sample import ENOUGH, TableSample
from groundstation.readers.drafts.time_guess import NAMED, PRIME, TimeGuess, moves, rank_of

_ISO = re.compile(r"\d{4}[-/.]\d\d?[-/.]\d\d?[T ]\d\d?:\d\d.*")
# A date in the name of a file or above the rows: its pattern, and its strptime format.
_TOLD_DAYS = (
    (r"(\d{4}-\d\d-\d\d)", "%Y-%m-%d"),
    (r"(\d{4}_\d\d_\d\d)", "%Y_%m_%d"),
    (r"(?<!\d)((?:19|20)\d{6})(?!\d)", "%Y%m%d"),
    (r"(\d\d\.\d\d\.\d{4})", "%d.%m.%Y"),
)
_DAY_S = 86_400.0
_OFFSET = re.compile(r"[+-]\d{1,2}:?\d\d")


def time_of(sample: TableSample) -> TimeGuess:
    """Return the time of the rows.

    An absolute time is taken before a counter, unless it repeats: a counter then tells the rows apart.

    Raises
    ------
    UnreadableLogError
        When no column is a time; the cause is named where it is known.
    """
    found = [*_of_iso(sample), *_of_local(sample), *_of_both_in_one(sample), *of_week(sample), *of_numbers(sample)]
    found += [] if any(one.is_absolute for one in found) else [*_of_day(sample)]
    if not found:
        raise UnreadableLogError(sample.name, *_no_time(sample))
    found += [*_of_both(sample, found)]
    fine = [one for one in found if one.own >= PRIME] or found
    best = max(fine, key=lambda one: (one.is_absolute, one.rank, one.own))
    repeats = "" if best.own >= PRIME else "rows repeat the time of others: no column tells the fraction of the second"
    return replace(best, doubt=both(best.doubt, repeats))


def _of_both(sample: TableSample, found: list[TimeGuess]) -> Iterator[TimeGuess]:
    """Yield UTC in whole seconds together with a counter that tells the rows apart."""
    utc = next((one for one in found if one.is_absolute and one.own < PRIME), None)
    if utc is None or any(one.is_absolute and one.own >= PRIME for one in found):
        return
    counters = [one for one in found if not one.is_absolute and one.own >= PRIME]
    for counter in counters[:1] or of_fractions(sample, utc):
        of_utc = [line.replace("column =", "utc =") for line in utc.lines[1:] if not line.startswith("offset")]
        of_counter = [line.replace("column =", "counter =") for line in counter.lines[1:]]
        yield TimeGuess(
            (*counter.columns, *utc.columns),
            ('kind = "utc_counter"', *of_counter, *of_utc),
            f"{utc.why}, in whole seconds, beside a {'counter' if counters else 'fraction of the second'}",
            counter.seconds,
            True,
            both(utc.doubt, counter.doubt),
            counter.rank + 1,
        )
        return


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
        "add a column with the time of each row"
        if sample.header is not None or sample.are_given
        else "name the columns, as in --names ax,ay,az,time_ms",
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
        if moves(seconds, NAMED):
            doubt = "" if re.search(r"Z$|[+-]\d\d:?\d\d$|UTC$", filled[0].strip()) else "names no zone: read as UTC"
            lines = ('kind = "iso"', f"column = {quoted(name)}")
            yield TimeGuess(
                (at,), lines, f"dates such as {filled[0]}", seconds, True, doubt=doubt, rank=rank_of(sample, at)
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
    days = [at for at in range(len(sample.names)) if is_day(sample, at)]
    clocks = [at for at in range(len(sample.names)) if is_clock(sample, at)]
    if not days or not clocks:
        return
    day, clock = days[0], clocks[0]
    formats, doubt = date_formats(sample.filled(day))
    if not formats:
        return
    offset = next((at for at in range(len(sample.names)) if are(sample, at, _OFFSET)), None)
    zone = '"UTC"' if offset is None else quoted(sample.names[offset])
    if offset is None:
        doubt = both(doubt, _zone_doubt(sample, day, clock))
    lines = (
        'kind = "local"',
        f"date = {quoted(sample.names[day])}",
        f"time = {quoted(sample.names[clock])}",
        f"offset = {zone}",
        f'date_formats = ["{formats}"]',
    )
    seconds = np.array([clock_seconds(cell) for cell in sample.columns[clock]])
    columns = (day, clock) if offset is None else (day, clock, offset)
    yield TimeGuess(columns, lines, "date and time of day in two columns", seconds, True, doubt=doubt, rank=2)


def _of_both_in_one(sample: TableSample) -> Iterator[TimeGuess]:
    """Yield dates and times of day in one column that are not ISO 8601."""
    for at, name in enumerate(sample.names):
        if not are(sample, at, DATE_AND_CLOCK):
            continue
        matches = [DATE_AND_CLOCK.fullmatch(cell.strip()) for cell in sample.columns[at]]
        formats, doubt = date_formats([match[1] for match in matches if match])
        if not formats:
            continue
        days = [match[1] if match else "" for match in matches]
        changes = np.cumsum([bool(day) and day != before for before, day in zip(days, ["", *days], strict=False)])
        clock = np.array([clock_seconds(match[2]) if match else np.nan for match in matches])
        seconds = clock + changes * _DAY_S
        lines = (
            'kind = "local"',
            f"column = {quoted(name)}",
            'offset = "UTC"',
            f'date_formats = ["{formats}"]',
        )
        doubt = both(doubt, _zone_doubt(sample, at))
        example = sample.filled(at)[0]
        yield TimeGuess((at,), lines, f"dates such as {example}", seconds, True, doubt=doubt, rank=rank_of(sample, at))


def _of_day(sample: TableSample) -> Iterator[TimeGuess]:
    """Yield times of day; the name of the file, or a line above the rows, may tell the date."""
    for at, name in enumerate(sample.names):
        if not is_clock(sample, at):
            continue
        seconds = np.array([clock_seconds(cell) for cell in sample.columns[at]])
        steps = np.diff(seconds, prepend=seconds[:1])
        seconds = seconds + np.cumsum(np.nan_to_num(steps) < -_DAY_S / 2) * _DAY_S
        if not moves(seconds, NAMED):
            continue
        table, pattern, form, where = _told_day(sample)
        entry = f"day = '{pattern}'" if pattern else 'day = "unknown"  # ? put the date here, as 2026-05-04'
        lines = ('kind = "time_of_day"', f"column = {quoted(name)}", 'date = "day"', f'date_formats = ["{form}"]')
        doubt = f"times of day; the date is that {where}" if pattern else "times of day without a date: put it below"
        doubt = both(doubt, _zone_doubt(sample, at))
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
