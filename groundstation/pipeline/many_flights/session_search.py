"""Sessions among the flights of a folder: flights that name each other over the link, and overlap.

Two flights belong together when one has a topic ``link.<aircraft of the other>`` and both were in the air at a time; so
do those that they belong with. Where UTC puts a flight beside nobody whom it heard, the times of transmission do: a
clock that is wrong, or none at all, does not hide a session.
"""

from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.many_flights.fleet_store import Scan
from groundstation.pipeline.many_flights.flight_keys import Key
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
class Apart:
    """A flight that names others over the link, and is in no session with them; why, in one line."""

    folder: Path
    reason: str


def members_of(found: Scan, flight_ids: Set[str] | None = None) -> tuple[Member, ...]:
    """The flights of a folder, or some of them, in the order of their names, those that cannot be read left out."""
    members = []
    for name in found.names if flight_ids is None else sorted(flight_ids):
        known = found.fresh.get(name)
        if known is None and name not in found.stale:
            continue
        try:
            members.append(_member(found.out / name) if known is None else _known_member(found.out / name, known))
        except GroundstationError:  # the index tells of it
            continue
    return tuple(members)


def _known_member(folder: Path, known: Key) -> Member:
    span_ns = None if known.start_ns is None or known.end_ns is None else (known.start_ns, known.end_ns)
    return Member(folder, known.link_name, frozenset(filter(None, known.hears.split("\n"))), span_ns)


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
    members: Sequence[Member], heard_span_ns: Callable[[Path], Span | None]
) -> tuple[list[tuple[Member, ...]], list[Apart]]:
    """Put flights together that belong together.

    Parameters
    ----------
    members : sequence of Member
    heard_span_ns : callable
        First and last time of transmission that a flight heard; asked for where UTC does not tell.

    Returns
    -------
    list of tuple of Member, list of Apart
        Each group of two aircraft or more; and the flights that are in none, though a flight of an aircraft that they
        heard is there.
    """
    pairs = _pairs(members)
    edges = _best(pairs, lambda one: one.span_ns)
    joined = {(one.folder, other.aircraft) for edge in edges for one, other in (edge, edge[::-1])}
    lonely = [
        (one, other)
        for one, other in pairs
        if (one.folder, other.aircraft) not in joined and (other.folder, one.aircraft) not in joined
    ]
    edges += _best(lonely, cache(lambda one: heard_span_ns(one.folder)))
    groups = _groups(members, edges)
    grouped = {one.folder for group in groups for one in group}
    flown = {one.aircraft for one in members}
    apart = [
        Apart(one.folder, _reason(one, members, grouped))
        for one in members
        if one.folder not in grouped and one.hears & (flown - {one.aircraft})
    ]
    return groups, apart


def heard_span_ns(mcap: Path) -> Span | None:
    """First and last time of transmission in an MCAP, on the clock of the link; None where there is none."""
    from groundstation.store.reader import Part, read

    everything = np.iinfo(np.int64)
    part = Part(everything.min, everything.max, lambda topic: kind_of(topic) == "link")
    batches = (item for item in read(mcap, part) if isinstance(item, RecordBatch))
    flight = flight_from_batches(batches, metadata={}, has_utc=False, source_name=mcap.name)
    heard = [sent[known] for sent, known in map(transmission_ns, flight.tables.values())]
    sent_ns = np.sort(np.concatenate(heard)) if heard else np.zeros(0, dtype=np.int64)
    if not len(sent_ns):
        return None
    stray = int(STRAY_SHARE * len(sent_ns))
    return int(sent_ns[stray]), int(sent_ns[-1 - stray])


def _pairs(members: Sequence[Member]) -> list[tuple[Member, Member]]:
    """Pairs of flights of different aircraft of which one heard the other's name."""
    named: dict[str, list[Member]] = {}
    for one in members:
        named.setdefault(one.aircraft, []).append(one)
    found = {
        frozenset((one.folder, other.folder)): (one, other)
        for one in members
        for name in sorted(one.hears - {one.aircraft})
        for other in named.get(name, ())
    }
    return list(found.values())


def _overlap_ns(one: Span | None, other: Span | None) -> int:
    return 0 if one is None or other is None else min(one[1], other[1]) - max(one[0], other[0])


def _best(
    pairs: Iterable[tuple[Member, Member]], span_of: Callable[[Member], Span | None]
) -> list[tuple[Member, Member]]:
    """Pairs that overlap; of several flights of one aircraft the one that overlaps longest, and what overlaps that.

    A recorder that begins a new log in the air gives flights that follow each other: each goes with those of its time.
    Two recorders of one aircraft give flights that overlap: both stay.
    """
    overlapping = [(one, other) for one, other in pairs if _overlap_ns(span_of(one), span_of(other)) > 0]
    longest: dict[tuple[Path, str], Member] = {}
    for one, other in (way for pair in overlapping for way in (pair, pair[::-1])):
        best = longest.setdefault((one.folder, other.aircraft), other)
        mine = span_of(one)
        if _overlap_ns(mine, span_of(other)) > _overlap_ns(mine, span_of(best)):
            longest[one.folder, other.aircraft] = other

    def is_chosen(one: Member, other: Member) -> bool:
        best = longest[one.folder, other.aircraft]
        return best is other or _overlap_ns(span_of(best), span_of(other)) > 0

    return [(one, other) for one, other in overlapping if is_chosen(one, other) and is_chosen(other, one)]


def _groups(members: Sequence[Member], edges: Iterable[tuple[Member, Member]]) -> list[tuple[Member, ...]]:
    """Flights that hang together by any chain of edges, in the order of the flights."""
    group_of = {one.folder: number for number, one in enumerate(members)}
    for one, other in edges:
        kept, gone = sorted((group_of[one.folder], group_of[other.folder]))
        group_of = {folder: kept if number == gone else number for folder, number in group_of.items()}
    groups: dict[int, list[Member]] = {}
    for one in members:
        groups.setdefault(group_of[one.folder], []).append(one)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def _reason(one: Member, members: Sequence[Member], grouped: set[Path]) -> str:
    """Why a flight is in no session, though flights of aircraft that it heard are there."""
    others = [other for other in members if other.aircraft in one.hears - {one.aircraft}]
    names = ", ".join(sorted({other.aircraft for other in others}))
    if any(_overlap_ns(one.span_ns, other.span_ns) > 0 and other.folder in grouped for other in others):
        return f"ranges to {names}, in no session: the flights that overlap are in one with another of {one.aircraft}"
    away_ns = [-_overlap_ns(one.span_ns, other.span_ns) for other in others if one.span_ns and other.span_ns]
    nearest = f", {min(away_ns) / NS_PER_S:.0f} s away at the least" if away_ns else ""
    return f"ranges to {names}, in no session: no flight of these overlaps{nearest}"
