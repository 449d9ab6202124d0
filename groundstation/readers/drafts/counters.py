"""Times of rows that are numbers: counters, seconds since 1970, GPS week and its seconds."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.toml_text import quoted
from groundstation.readers.drafts.clocks import is_clock
from groundstation.readers.drafts.column import both
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.time_guess import (
    NAMED,
    PRIME,
    RISING,
    SECONDS,
    TimeGuess,
    doubt_of_order,
    moves,
    rank_of,
)
from groundstation.readers.drafts.words import TIME_WORDS, in_brackets, words_of

_SINCE_1970 = {"s": (8e8, 4e9), "ms": (8e11, 4e12), "us": (8e14, 4e15), "ns": (8e17, 4e18)}
_COUNTED = 0.75  # share of the steps that do not go back of a column that has a unit of time, and another name
_WEEK_S = 604_800.0


def of_week(sample: TableSample) -> Iterator[TimeGuess]:
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
    steps = np.nan_to_num(np.diff(seconds, prepend=seconds[:1]))  # the week may stay where its seconds begin anew
    seconds = seconds + np.cumsum((steps < -_WEEK_S / 2).astype(int) - (steps > _WEEK_S / 2)) * _WEEK_S
    if moves(seconds, NAMED):
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


def of_numbers(sample: TableSample) -> Iterator[TimeGuess]:
    for at, name in enumerate(sample.names):
        meaning = sample.meanings[at]
        if is_clock(sample, at):
            continue
        is_of_week = meaning is not None and meaning.role == "tow"
        told = (
            meaning.unit if meaning else next(filter(None, map(TIME_WORDS.get, map(str.lower, in_brackets(name)))), "")
        )
        is_named = is_of_week or (meaning.role == "time" if meaning else bool(told))
        if meaning is not None and not is_named:
            continue
        values = sample.numbers(at)
        known = values[np.isfinite(values)]
        if len(known) < (1 if is_named else 2) or len(known) < 0.5 * len(values) or not sample.is_of_numbers(at):
            continue
        share = (NAMED if meaning or _falls_are_wraps(known) else _COUNTED) if is_named else RISING
        if not moves(values, share):
            continue
        middle, step = float(np.median(known)), _step(sample, at)
        since = next((unit for unit, (low, high) in _SINCE_1970.items() if low < middle < high), "")
        is_first = at == next((place for place, column in enumerate(sample.columns) if any(column)), 0)
        if (not is_named and not (is_first or since)) or not (np.isfinite(step) or len(known) == 1):
            continue
        if not is_named and not since and len(np.unique(known)) < PRIME * len(known):
            continue
        unit, doubt = (since, "") if since else _unit_by(told, known, step)
        found = f"{'named so' if is_named else 'numbers that rise'}, "
        found += f"steps of {step:g}" if len(known) > 1 else "one row"
        why = f"counts from 1970 in {unit}" if since else found
        if since and "gps" in name.lower() and unit == "s" and middle < 1.5e9:
            doubt = "seconds since 1970 assumed: GPS seconds count from 1980 and differ by leap seconds"
        if is_of_week:
            unit = (meaning.unit if meaning else "") or ("ms" if float(np.max(known)) > 2 * _WEEK_S else "s")
            doubt = "seconds of the GPS week without the week: no absolute time"
        doubt = both(doubt, doubt_of_order(values))
        lines = (f'kind = "{"unix" if since else "seconds"}"', f"column = {quoted(name)}", f'unit = "{unit}"')
        rank = rank_of(sample, at) + (bool(since) if is_named else -2)  # seconds since 1970 need no zone
        yield TimeGuess((at,), lines, why, values * SECONDS[unit], bool(since), doubt, rank)


def _falls_are_wraps(known: FloatArray) -> bool:
    """Tell whether numbers fall by most of their range alone, as a counter does that wraps.

    Examples
    --------
    >>> _falls_are_wraps(np.array([8.0, 9.0, 0.0, 1.0])), _falls_are_wraps(np.array([8.0, 9.0, 7.0, 1.0]))
    (True, False)
    """
    steps = np.diff(known)
    return bool(np.all(steps[steps < 0.0] < -0.5 * np.ptp(known)))


def of_fractions(sample: TableSample, utc: TimeGuess) -> Iterator[TimeGuess]:
    """Yield columns that count the fraction of the second of a time in whole seconds."""
    for at, name in enumerate(sample.names):
        values = sample.numbers(at)
        known = values[np.isfinite(values)]
        is_taken = at in utc.columns or (sample.meanings[at] is not None and sample.meanings[at].role != "time")  # type: ignore[union-attr]
        if is_taken or not sample.is_of_numbers(at) or known.min() < 0.0 or known.max() <= 0.0:
            continue
        told = next(filter(None, map(TIME_WORDS.get, (*words_of(name), *map(str.lower, in_brackets(name))))), "")
        unit = (
            told if told in ("ms", "us", "ns") else "s" if known.max() < 1.0 else "ms" if known.max() < 1000.0 else ""
        )
        seconds = utc.seconds + values * SECONDS.get(unit, np.nan)
        if unit and known.max() * SECONDS[unit] < 1.0 and moves(seconds):
            lines = ('kind = "seconds"', f"column = {quoted(name)}", f'unit = "{unit}"')
            yield TimeGuess((at,), lines, "", seconds, False, rank=utc.rank)


def _unit_by(told: str, known: FloatArray, step: float) -> tuple[str, str]:
    """Return the unit of a counter, as its name tells it or its steps show."""
    if told:
        return told, ""
    if not np.isfinite(step):
        return "s", "unit s assumed: one row alone"
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
