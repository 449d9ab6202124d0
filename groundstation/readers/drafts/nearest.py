"""Advice on a table that no profile claims: the nearest, what it lacks, its names."""

import re
from collections.abc import Iterable, Sequence

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, near_names
from groundstation.readers.drafts.sample import TableSample, sample_of
from groundstation.readers.drafts.time_guess import TimeGuess
from groundstation.readers.drafts.times import time_of
from groundstation.readers.drafts.words import meaning_of
from groundstation.readers.profile import Profile
from groundstation.readers.source import Source

FEWEST_SHARED, LEAST_SHARE = 4, 0.5  # columns, one fewer of others' profiles, and their share of those of the profile
MOST_NAMED = 8
_FEWEST_ROWS = 3  # and columns, of a table without names
_SENTENCE = re.compile(r"(?:^|\s)[$!][A-Z]{2}[A-Z0-9]{3}$")  # NMEA, whose damage its own reader tells
_FEWEST_OF_NUMBERS = 2  # of its columns: lines of a text count themselves
_MOST_SEARCHED = 500  # names among which a similar one is looked for


@dataclass(frozen=True)
class Advice:
    """Words on a table that no profile claims, and the next step."""

    found: str
    next_step: str


def advice_on(source: Source, profiles: Iterable[Profile], page: str) -> Advice | None:
    """Return advice on a table; None where the file is none.

    Parameters
    ----------
    source : Source
    profiles : iterable of Profile
        Those that were tried.
    page : str
        Page that tells the names of the flat CSV.
    """
    try:
        sample = sample_of(source)
    except GroundstationError:
        return None
    known = [one for one in sample.meanings if one is not None]
    near = _nearest(sample, profiles)
    draft = f"groundstation profile new {source.name}"
    if sample.header is None:
        return _without_names(sample, draft)
    if len(known) < 2 and not near and len(sample.names) < _FEWEST_ROWS:
        return None
    found = f"a table that no profile claims (row {sample.header.number}: {_listed(sample.names)})"
    try:
        time = time_of(sample)
    except GroundstationError as error:
        return Advice(f"{found}{near}; {error.found}", error.next_step) if len(known) > 1 or near else None
    names = _canonical(sample, time)
    odd = [part for part in time.doubt.split("; ") if re.search("month|date", part)]
    near += "".join(f"; time: {part}" for part in odd)
    return Advice(found + near, f"name them {', '.join(names)} ({page}), or: {draft}" if names else draft)


def _without_names(sample: TableSample, draft: str) -> Advice | None:
    """Return advice on a table without a row of names.

    None where its rows are few, lines of a text, or sentences of a receiver.
    """
    rows, count = sum(map(len, sample.blocks)), len(sample.names)
    of_numbers = sum(map(sample.is_of_numbers, range(count)))
    if rows < _FEWEST_ROWS or count < _FEWEST_ROWS or of_numbers < _FEWEST_OF_NUMBERS:
        return None
    if any(_SENTENCE.search(cell) for row in sample.blocks[0] for cell in row):
        return None
    parted = "blanks" if sample.is_spaced else f"{sample.delimiter!r}"
    found = f"a table without a row of names ({count} columns parted by {parted}, the first row: "
    return Advice(f"{found}{_listed(sample.blocks[0][0])})", draft)


def _listed(names: Sequence[str]) -> str:
    shown = [name if len(name) <= 30 else f"{name[:27]}..." for name in names[:MOST_NAMED]]
    return ", ".join(shown) + (", ..." if len(names) > MOST_NAMED else "")


def _nearest(sample: TableSample, profiles: Iterable[Profile]) -> str:
    """Name the profile that comes nearest, and what the table lacks of it."""
    there, best = {name.lower() for name in sample.names}, (0.0, "")
    for profile in profiles:
        asked = dict.fromkeys((*profile.time.asked, *profile.required))
        wanted = dict.fromkeys((*asked, *(rule.name for rule in profile.columns)))
        shared = sum(name.lower() in there for name in wanted)
        share = shared / max(1, len(wanted))
        if shared >= FEWEST_SHARED - (not profile.first_lines) and share >= LEAST_SHARE and share > best[0]:
            if not profile.first_lines:
                asked |= dict.fromkeys(rule.name for rule in profile.columns if not rule.is_optional)
            missing = [name for name in asked if name.lower() not in there]
            missing = missing or [rule.name for rule in profile.columns if rule.name.lower() not in there]
            lacks = f"it lacks {_listed(missing)}" if missing else "its first line is another"
            best = share, f"; nearest is profile {profile.name}: {lacks}"
    return best[1]


def _canonical(sample: TableSample, time: TimeGuess) -> list[str]:
    """Return the names of the flat CSV for a small table that needs nothing else."""
    if len(sample.names) > MOST_NAMED or len(time.columns) != 1:
        return []
    kind = time.lines[0].partition('"')[2].rstrip('"')
    of_time = {"iso": "time_utc", "seconds": "time_s", "nanoseconds": "time_ns"}.get(kind)
    is_other_unit = kind == "seconds" and 'unit = "s"' not in time.lines
    if of_time is None or is_other_unit:
        return []
    names = []
    for at, meaning in enumerate(sample.meanings):
        if at in time.columns:
            names.append(of_time)
        elif meaning is None or not meaning.field:
            return []
        else:
            if meaning.sign < 0 or meaning.scale != 1.0 or not _is_plain(meaning.unit, meaning.field):
                return []
            names.append(meaning.target)
    return names if len(set(names)) == len(names) > 1 else []


def _is_plain(unit: str, field: str) -> bool:
    """Tell whether a unit is that of the field."""
    return not unit or field.endswith(f"_{unit}")


def nearest_names(name: str, target: str, names: Sequence[str], most: int = 3) -> tuple[str, ...]:
    """Return the columns that a missing one may be: of the same meaning, then spelled alike.

    Parameters
    ----------
    name, target : str
        Name that a profile asks for, and ``topic.field`` that it feeds; empty for the time.
    names : sequence of str
        Columns of the table that nothing takes yet.

    Examples
    --------
    >>> nearest_names("Hdg", "ins.true_heading_deg", ("Time", "True Heading (deg)", "Hgt"))
    ('True Heading (deg)', 'Hgt')
    """
    field = target.rpartition(".")[2]
    same = []
    for one in names[:_MOST_SEARCHED]:
        meaning = meaning_of(one)
        if meaning is not None and (meaning.field == field if field else meaning.role in ("time", "date", "clock")):
            same.append(one)
    alike = near_names(name, names[:_MOST_SEARCHED], most)
    by_case = [one for one in names if one.lower() == name.lower()]
    return tuple(dict.fromkeys((*by_case, *same, *alike)))[:most]


def why_no_header(source: Source, profile: Profile) -> str:
    """Return what the header row of a table lacks of a profile, with the nearest names."""
    try:
        sample = sample_of(source)
    except GroundstationError as error:
        return error.found
    if sample.header is None:
        return f"the table has no row of names: give them as recognise.names, {len(sample.names)} of them"
    targets = {rule.name: f"{rule.topic}.{rule.field.name}" for rule in profile.columns}
    wanted = dict.fromkeys((*profile.required, *profile.time.asked))
    told = []
    for name in wanted:
        if name not in sample.names:
            near = nearest_names(name, targets.get(name, ""), sample.names)
            told.append(f"{name!r}" + (f" (nearest: {', '.join(map(repr, near))})" if near else ""))
    lacks = f"lacks {', '.join(told)}" if told else "is parted in another way"
    return f"row {sample.header.number}, which looks like the header, {lacks}"
