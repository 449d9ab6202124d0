"""Search for sessions among the flights of a folder.

They are flights that name each other over the link, and overlap.

Two flights belong together when one has a topic ``link.<aircraft of the other>`` and both were in the air at a time; so
do those that they belong with. Where UTC puts a flight beside nobody whom it heard, the times of transmission do: a
clock that is wrong, or none at all, does not hide a session.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from functools import cache
from itertools import accumulate
from pathlib import Path

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.results.files import load_document
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.session_clock import transmission_ns
from groundstation.tables.session_tracks import aircraft_named

STRAY_SHARE = 0.01  # at either end, of times of transmission: a few that are wrong place no flight
Span = tuple[int, int]  # nanoseconds, UTC or those of the link


@dataclass(frozen=True)
class Member:
    """A flight as far as the search goes.

    Parameters
    ----------
    folder : Path
    aircraft : str
    hears : frozenset of str
        Names of its link topics.
    span_ns : (int, int), optional
        In UTC, None without it.
    """

    folder: Path
    aircraft: str
    hears: frozenset[str]
    span_ns: Span | None


@dataclass(frozen=True)
class LoneFlight:
    """Flight that names others over the link, and is in no session with them.

    The reason is one line.
    """

    folder: Path
    reason: str


def members_of(found: Scan, flight_ids: Set[str] | None = None) -> tuple[Member, ...]:
    """Flights of a folder, or some of them, in the order of their names.

    Those that cannot be read are left out.
    """
    known = found.fresh if flight_ids is None else found.fresh.only(flight_ids)
    columns = map(known.column, ("link_name", "hears", "start_ns", "end_ns"))
    members = [
        Member(
            found.out / name,
            aircraft,
            _names_of(hears),
            None if start_ns is None or end_ns is None else (start_ns, end_ns),
        )
        for name, aircraft, hears, start_ns, end_ns in zip(known, *columns, strict=True)
    ]
    for name in found.stale:
        if flight_ids is None or name in flight_ids:
            with suppress(GroundstationError):  # the index tells of it
                members.append(_member(found.out / name))
    return tuple(sorted(members, key=lambda one: one.folder.name))


def ranging_with(found: Scan, flight_ids: Set[str]) -> tuple[Member, ...]:
    """Flights of a folder that a chain of links joins to some, as :func:`members_of` has them.

    A chain goes from an aircraft to those whom one of its flights heard, or who heard it.
    """
    links = found.fresh.table.select(["link_name", "hears"]).group_by(["link_name", "hears"]).aggregate([])
    rows = zip(*(links.column(name).to_pylist() for name in ("link_name", "hears")), strict=True)
    heard = [(aircraft, _names_of(hears)) for aircraft, hears in rows]
    unread = members_of(replace(found, fresh=found.fresh.only(())))
    heard += [(one.aircraft, one.hears) for one in unread]
    beside: dict[str, set[str]] = {aircraft: set() for aircraft, _ in heard}
    for aircraft, names in heard:
        for name in names & beside.keys():
            beside[aircraft].add(name)
            beside[name].add(aircraft)
    reached: set[str] = set()
    left = {one.aircraft for one in members_of(found, flight_ids)}
    while left:
        reached.add(name := left.pop())
        left |= beside[name] - reached
    aircraft_of = zip(found.fresh, found.fresh.column("link_name"), strict=True)
    return members_of(replace(found, fresh=found.fresh.only([name for name, one in aircraft_of if one in reached])))


def _names_of(hears: str) -> frozenset[str]:
    return frozenset(filter(None, hears.split("\n")))


def _member(folder: Path) -> Member:
    document = load_document(folder)
    flight, topics = document.flight, tuple(document.ledger.topics)
    hears = frozenset(topic.partition(".")[2] for topic in topics_of_kind("link", topics))
    span_ns = None
    if flight.start_utc is not None:
        start_ns = iso_to_utc_ns(flight.start_utc)[0]
        span_ns = start_ns, start_ns + round(flight.duration_s * NS_PER_S)
    return Member(folder, aircraft_named(flight.metadata, flight.source.name), hears, span_ns)


def sessions_among(
    members: Sequence[Member], heard_span_ns: Callable[[Path], Span | None], told_of: Set[str] | None = None
) -> tuple[list[tuple[Member, ...]], list[LoneFlight]]:
    """Put flights together that belong together.

    Parameters
    ----------
    members : sequence of Member
    heard_span_ns : callable
        First and last time of transmission that a flight heard; asked for where UTC does not tell.
    told_of : set of str, optional
        Flights to tell of when they are in no group; left out: all.

    Returns
    -------
    list of tuple of Member, list of Apart
        Each group of two aircraft or more; and the flights that are in none, though a flight of an aircraft that they
        heard is there.
    """
    edges = _best(overlapping(members, lambda one: one.span_ns), lambda one: one.span_ns)
    joined = frozenset((one.folder, other.aircraft) for edge in edges for one, other in (edge, edge[::-1]))
    span_of = cache(lambda one: heard_span_ns(one.folder))
    edges += _best(overlapping(members, span_of, joined), span_of)
    groups = _groups(members, edges)
    grouped = {one.folder for group in groups for one in group}
    named: dict[str, list[Member]] = {}
    for one in members:
        named.setdefault(one.aircraft, []).append(one)
    apart = [
        LoneFlight(one.folder, _reason(one, named, grouped))
        for one in members
        if one.folder not in grouped
        and (told_of is None or one.folder.name in told_of)
        and (one.hears - {one.aircraft}) & named.keys()
    ]
    return groups, apart


def heard_span_ns(mcap: Path) -> Span | None:
    """First and last time of transmission in an MCAP, on the clock of the link.

    None where there is none.
    """
    from groundstation.store.reader import StorePart, read

    everything = np.iinfo(np.int64)
    part = StorePart(everything.min, everything.max, lambda topic: kind_of(topic) == "link")
    batches = (item for item in read(mcap, part) if isinstance(item, RecordBatch))
    flight = flight_from_batches(batches, metadata={}, has_utc=False, source_name=mcap.name)
    heard = [sent[known] for sent, known in map(transmission_ns, flight.tables.values())]
    sent_ns = np.sort(np.concatenate(heard)) if heard else np.zeros(0, dtype=np.int64)
    if not len(sent_ns):
        return None
    stray = int(STRAY_SHARE * len(sent_ns))
    return int(sent_ns[stray]), int(sent_ns[-1 - stray])


@dataclass(frozen=True)
class _Timed:
    """Flights of one aircraft in the order in which they begin.

    Those that overlap a span are found without asking all.

    Parameters
    ----------
    numbers : sequence of int
        Which members they are.
    starts_ns, ends_ns : sequence of int
        Begin of each, and the last end of it and those before it.
    """

    numbers: Sequence[int]
    starts_ns: Sequence[int]
    ends_ns: Sequence[int]

    @classmethod
    def of(cls, spans: Mapping[int, Span | None]) -> "_Timed":
        """Order members by their spans, given by number; one without a span overlaps nothing."""
        timed = sorted((span, number) for number, span in spans.items() if span is not None)
        ends_ns = accumulate((end_ns for (_, end_ns), _ in timed), max)
        return cls([number for _, number in timed], [start_ns for (start_ns, _), _ in timed], list(ends_ns))

    def near(self, span: Span) -> list[int]:
        """Numbers of all that overlap a span, and of some that do not, in order."""
        return sorted(self.numbers[bisect_right(self.ends_ns, span[0]) : bisect_left(self.starts_ns, span[1])])


def overlapping(
    members: Sequence[Member],
    span_of: Callable[[Member], Span | None],
    joined: Set[tuple[Path, str]] = frozenset(),
) -> list[tuple[Member, Member]]:
    """Pairs of flights of different aircraft that overlap, of which one heard the other.

    Left out are those of which one has a partner of the other's aircraft already: ``joined`` has flights with the
    aircraft of their partners.
    """
    named: dict[str, list[int]] = {}
    for number, one in enumerate(members):
        named.setdefault(one.aircraft, []).append(number)

    @cache
    def free_of(name: str, aircraft: str) -> list[int]:
        """Flights of an aircraft without a partner of another one."""
        return [number for number in named.get(name, ()) if (members[number].folder, aircraft) not in joined]

    @cache
    def timed(name: str, aircraft: str) -> _Timed:
        return _Timed.of({number: span_of(members[number]) for number in free_of(name, aircraft)})

    found: dict[tuple[int, int], tuple[Member, Member]] = {}
    for number, one in enumerate(members):
        for name in sorted(one.hears - {one.aircraft}):
            asking = one.aircraft if joined else ""
            if (one.folder, name) in joined or not free_of(name, asking) or (span := span_of(one)) is None:
                continue
            for other in timed(name, asking).near(span):
                if overlap_ns(span, span_of(members[other])) > 0:
                    found.setdefault((min(number, other), max(number, other)), (one, members[other]))
    return list(found.values())


def overlap_ns(one: Span | None, other: Span | None) -> int:
    """Time for which two spans overlap.

    Negative: the time between them, 0 without a span.
    """
    return 0 if one is None or other is None else min(one[1], other[1]) - max(one[0], other[0])


def _best(
    overlapping: Sequence[tuple[Member, Member]], span_of: Callable[[Member], Span | None]
) -> list[tuple[Member, Member]]:
    """Best pairs of flights that overlap.

    Of several flights of one aircraft that overlap a flight, the one that does so longest stays, with those that
    overlap it.

    A recorder that begins a new log in the air gives flights that follow each other: each goes with those of its time.
    Two recorders of one aircraft give flights that overlap: both stay.
    """
    longest: dict[tuple[Path, str], Member] = {}
    for one, other in (way for pair in overlapping for way in (pair, pair[::-1])):
        best = longest.setdefault((one.folder, other.aircraft), other)
        mine = span_of(one)
        if overlap_ns(mine, span_of(other)) > overlap_ns(mine, span_of(best)):
            longest[one.folder, other.aircraft] = other

    def is_chosen(one: Member, other: Member) -> bool:
        best = longest[one.folder, other.aircraft]
        return best is other or overlap_ns(span_of(best), span_of(other)) > 0

    return [(one, other) for one, other in overlapping if is_chosen(one, other) and is_chosen(other, one)]


def _groups(members: Sequence[Member], edges: Iterable[tuple[Member, Member]]) -> list[tuple[Member, ...]]:
    """Flights that hang together by any chain of edges, in the order of the flights."""
    group_of = {one.folder: [number] for number, one in enumerate(members)}
    for one, other in edges:
        kept, gone = sorted((group_of[one.folder], group_of[other.folder]), key=len, reverse=True)
        if kept is not gone:
            kept += gone
            group_of |= {members[number].folder: kept for number in gone}
    groups = {min(group): sorted(group) for group in group_of.values() if len(group) > 1}
    return [tuple(members[number] for number in group) for _, group in sorted(groups.items())]


def _reason(one: Member, named: Mapping[str, Sequence[Member]], grouped: set[Path]) -> str:
    """Reason why a flight is in no session, though flights of aircraft it heard are there."""
    others = [other for name in one.hears - {one.aircraft} for other in named.get(name, ())]
    names = ", ".join(sorted({other.aircraft for other in others}))
    if any(overlap_ns(one.span_ns, other.span_ns) > 0 and other.folder in grouped for other in others):
        return f"ranges to {names}, in no session: flights that overlap are in one with another {one.aircraft} flight"
    away_ns = [-overlap_ns(one.span_ns, other.span_ns) for other in others if one.span_ns and other.span_ns]
    nearest = f", {min(away_ns) / NS_PER_S:.0f} s away at least" if away_ns else ""
    return f"ranges to {names}, in no session: none of their flights overlaps{nearest}"
