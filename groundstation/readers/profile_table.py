"""Items of a table that a profile matches: its sections, clock and vehicles."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.slips import slips
from groundstation.readers.days import day_ns
from groundstation.readers.dialect import Dialect
from groundstation.readers.drafts.reasons import with_reasons
from groundstation.readers.layout import TableLayout
from groundstation.readers.losses import Losses
from groundstation.readers.misnamed import misnamed
from groundstation.readers.profile import Profile
from groundstation.readers.profile_fit import Fit, delimiter_of, fit_below
from groundstation.readers.profile_layout import layout_of
from groundstation.readers.profile_match import fitted, seen_as, with_joined
from groundstation.readers.profile_sources import READER
from groundstation.readers.rtklib_tag import TaggedClock, clock_by_tag
from groundstation.readers.sections import MOST, TableSection, header_places, left_out, lines_with, mark_of, told
from groundstation.readers.source import Source
from groundstation.readers.spaced import SpacedSource
from groundstation.readers.start import unusable_references, utc_of_zero

MOST_DOUBTS = 10  # of a draft, told one by one
FEWEST_ROWS = 3  # above the header row that are those of another log

if TYPE_CHECKING:
    from groundstation.readers.vehicles import Vehicles


def items(whole: Source, fit: Fit) -> Iterator[Item]:
    """Yield the items of a table that a profile matches."""
    from groundstation.readers.table_clock import with_clock
    from groundstation.readers.table_reader import TableReader, truncated_header

    source = seen_as(whole, fit.profile, fit.cells, fit.joined)
    utc_of_zero_ns, remarks = _utc_of_zero(fit, fit.metadata)
    clock: TaggedClock | None = None
    if fit.profile.time.has_tag and fit.last.ended:
        clock, remarks = _clock_by_tag(source, fit)
        utc_of_zero_ns = utc_of_zero_ns if clock is None else clock.utc_of_zero_ns
    header = LogHeader(f"{READER} {fit.profile.name}", fit.metadata, utc_of_zero_ns)
    if not fit.last.ended:
        yield header
        yield truncated_header(fit.last.number)
        return
    sections, section_remarks = _sections(source, fit, utc_of_zero_ns)
    above = _rows_of_another(fit)
    sections = [*([TableSection(above, sections[0].layout)] if above else []), *sections]
    header, sections, clock_remarks = with_clock(source, header, sections, fit.profile.time)
    losses = Losses()
    vehicles = _vehicles(source, fit, sections, losses)
    if vehicles is not None:
        source, sections = vehicles.source, list(vehicles.sections)
        header = replace(header, metadata={**header.metadata, **sections[0].facts})
        clock_remarks = (*clock_remarks, vehicles.remark)
    rows = TableReader(source, sections, losses).items(header)
    yield next(rows)
    yield from _doubts(fit.profile)
    yield from dict.fromkeys([*remarks, *clock_remarks, *section_remarks, *unusable_references(fit.metadata)])
    yield from () if above else _above(fit)
    time = ", ".join(name for name in fit.profile.time.columns if name in fit.position)
    places = {f"{rule.topic}.{rule.field.name}": rule.name for rule in fit.profile.columns} | {
        time: fit.profile.time.columns[0]
    }
    words = {f"{rule.topic}.{rule.field.name}": dict(rule.values) for rule in fit.profile.columns if rule.values}
    for item in with_reasons(misnamed(rows, _slips(fit), fit.header.number), source, places, time, words):
        yield item if clock is None or not isinstance(item, RecordBatch) else _undrifted(item, clock)


def _doubts(profile: Profile) -> Iterator[Remark]:
    """Yield what a draft assumes that nobody has looked at."""
    if profile.doubts:
        more = f" and {len(profile.doubts) - MOST_DOUBTS} more" if len(profile.doubts) > MOST_DOUBTS else ""
        told = "; ".join(profile.doubts[:MOST_DOUBTS])
        where = f"{profile.path.name} has question marks"
        yield Remark("unchecked_draft", f"{where}: {told}{more}: correct each line, or take its mark away")


def _vehicles(source: Source, fit: Fit, sections: Sequence[TableSection], losses: Losses) -> "Vehicles | None":
    """Bring the rows of each vehicle together, if a column tells them apart."""
    if not fit.profile.key:
        return None
    from groundstation.readers.vehicles import by_vehicle

    name = fit.profile.key
    return by_vehicle(source, sections[0], fit.position[name], name, fit.profile.only, losses)


def _clock_by_tag(source: Source, fit: Fit) -> tuple[TaggedClock | None, list[Remark]]:
    layout, _remarks = layout_of(fit, source, None, None)
    return clock_by_tag(source, fit.dialect_to(None), layout)


def _undrifted(batch: RecordBatch, clock: TaggedClock) -> RecordBatch:
    """Return a batch with times of validity by the host's clock."""
    return replace(batch, validity_time_ns=clock.validity_ns(batch.device_time_ns.values.astype(np.int64)))


def _rows_of_another(fit: Fit) -> Dialect | None:
    """Return the dialect of the rows above the header, if they belong to another log.

    That log has the same columns.
    """
    if not fit.profile.first_lines or len(fit.rows_above) < FEWEST_ROWS:
        return None
    below = [line for line in fit.above if line.number > fit.rows_above[-1].number]
    if not any(line.text.lstrip().startswith(fit.profile.first_lines) for line in below):
        return None
    return replace(fit.dialect_to(None), first_byte=0, first_line=1, end_byte=fit.rows_above[-1].next_byte)


def _above(fit: Fit) -> Iterator[Damage]:
    """Yield damage for rows above the header: nothing names their columns."""
    if fit.rows_above:
        first, last = fit.rows_above[0].number, fit.rows_above[-1].number
        place = f"row {first}" if first == last else f"rows {first} to {last}"
        yield Damage("dropped_rows", place, len(fit.rows_above), "rows above the header that names their columns")


def _sections(
    source: Source, first: Fit, utc_of_zero_ns: int | None
) -> tuple[list[TableSection], list[Remark | Damage]]:
    """Rows below each header that names other columns or another zero of time."""
    fits, ends, shifts = [first], list[int](), [0]
    remarks: list[Remark | Damage] = []
    profile = first.profile
    mark = mark_of(max((*profile.required, *profile.time.asked), key=len))
    stands_again, last_byte, own_until = False, None, first.last.number
    places = (
        ()
        if profile.names or profile.key or not _may_have_headers(source, first, mark)
        else header_places(source, first.last, first.encoding, mark, lambda line: bool(delimiter_of(line, profile)))
    )
    for place in places:
        if place.line.number <= own_until:
            continue  # a header's own row of other names
        stands_again = True
        if fits[-1].is_repeated(place):
            own_until = place.line.number + len(fits[-1].behind)
            continue
        found, end_byte = fit_below(source, fits[-1], place)
        own_until = found.last.number
        utc_ns, _remarks = _utc_of_zero(found, found.metadata)
        shift_ns = shifts[-1] if utc_ns is None or utc_of_zero_ns is None else utc_ns - utc_of_zero_ns
        is_same = found.names_as(fits[-1])
        if is_same and shift_ns == shifts[-1]:
            continue
        if len(fits) == MOST:
            remarks.append(left_out(source, place.line.number, place.first_byte))
            last_byte = place.first_byte
            break
        remarks.append(told(place, is_same))
        fits, ends, shifts = [*fits, found], [*ends, end_byte], [*shifts, shift_ns]
    sections = list[TableSection]()
    for fit, end, shift_ns in zip(fits, (*ends, last_byte), shifts, strict=True):
        layout, more = layout_of(fit, source, utc_of_zero_ns, end)
        facts = fit.metadata if sections else {}
        sections.append(TableSection(fit.dialect_to(end, stands_again), layout, shift_ns, facts))
        remarks += more
    return sections, remarks


def _may_have_headers(source: Source, first: Fit, mark: re.Pattern[bytes]) -> bool:
    """Tell whether a mark of header lines stands below the first header.

    Blanks need not be turned into tabs for that.
    """
    if not isinstance(source, SpacedSource):
        return True
    return next(iter(lines_with(source.whole, first.last, first.encoding, mark)), None) is not None


def _utc_of_zero(fit: Fit, metadata: Mapping[str, str]) -> tuple[int | None, list[Remark]]:
    time = fit.profile.time
    if time.kind in ("iso", "unix") or time.is_utc:
        return 0, []
    if time.kind == "gps_week":
        return 0, [Remark("converted", "times are GPS time: UTC is less the leap seconds of the day")]
    if time.kind == "time_of_day":
        told = metadata.get(time.date, "")
        if day_ns(told, time.date_formats) is not None:
            return 0, [Remark("assumed_utc", "the times of the day name no zone: read as UTC")]
        return None, [Remark("no_date", f"no date ({told[:40]!r}): the flight has no absolute time")]
    if time.kind == "local":
        has_offset = len(time.columns) == 3 and time.columns[2] in fit.position
        assumed = Remark("assumed_utc", "date and time have no offset column: read as UTC")
        return 0, [] if has_offset else [assumed]
    return utc_of_zero(metadata)


def _slips(fit: Fit) -> dict[tuple[str, str], tuple[str, str]]:
    """Find columns whose names are almost those of the profile.

    Returns, by raw topic and name, the name found and the name that was probably meant.
    """
    known = (*(name for rule in fit.profile.columns for name in rule.names), *fit.profile.time.columns)
    return {(fit.profile.raw_topic, name): (name, meant) for name, meant in slips(fit.names, known).items()}


def laid(source: Source, profile: Profile) -> tuple[Fit, TableLayout]:
    """Return the match of a profile to a table, and the layout that it gives.

    Raises
    ------
    UnreadableLogError
        When the file has no header row with the columns that the profile asks for.
    """
    try:
        fit = with_joined(source, fitted(source, profile))
        seen = seen_as(source, profile, fit.cells, fit.joined)
        utc_of_zero_ns, _remarks = _utc_of_zero(fit, fit.metadata)
        return fit, layout_of(fit, seen, utc_of_zero_ns, None)[0]
    finally:
        source.seen.clear()
