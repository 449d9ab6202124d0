"""Ranges of a session from the link topics of its logs, and the faults of some of them."""

from collections.abc import Mapping, Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import NO_SLOT, DeadReckoning, GroundPoint, Ranges
from groundstation.tables.session_clock import LogOffset, transmission_ns, travel_ns
from groundstation.tables.session_settings import SessionSettings
from groundstation.tables.table import Flight, Table

LEAST_RESIDUALS = 5  # fewer ranges say nothing of a station's place


@dataclass(frozen=True)
class _Link:
    """One direction of one link.

    It has times of transmission in session nanoseconds, pseudo-ranges and slots.
    """

    receiver: str
    source: str
    topic: str
    sent_ns: Int64Array
    read_m: FloatArray
    slot: Int64Array

    def take(self, rows: BoolArray) -> "_Link":
        return _Link(self.receiver, self.source, self.topic, self.sent_ns[rows], self.read_m[rows], self.slot[rows])


def gather_ranges(
    flights: Mapping[str, Flight],
    placed: Mapping[str, LogOffset],
    vehicles: Sequence[DeadReckoning],
    points: Sequence[GroundPoint],
    start_ns: int,
    group_ns: int,
    settings: SessionSettings,
) -> tuple[Ranges, list[Finding]]:
    """Ranges between the vehicles and to the points, in order of transmission.

    Parameters
    ----------
    flights, placed : mappings by aircraft
    vehicles, points
        Vehicles and points whose names a range may have as its source.
    start_ns, group_ns : int
        Session time zero, and session time less link time.
    settings : SessionSettings

    Returns
    -------
    Ranges, list of Finding
    """
    findings: list[Finding] = []
    links: list[_Link] = []
    names = {*flights, *(point.name for point in points)}
    missing: dict[str, dict[str, int]] = {}
    for name, flight in flights.items():
        for topic in topics_of_kind("link", flight.topics()):
            source = topic.partition(".")[2]
            if source in names and source != name:
                links.append(_link(name, source, flight[topic], placed[name], start_ns, group_ns, settings, findings))
            else:
                missing.setdefault(source, {})[name] = len(flight[topic])
    findings += [_missing(source, heard, source in flights) for source, heard in sorted(missing.items())]
    far, told = _far_stations(links, vehicles, points, settings)
    return _in_order([link for link in links if link.source not in far], list(flights), settings), [*findings, *told]


def _missing(source: str, heard: Mapping[str, int], is_itself: bool) -> Finding:
    count, where = sum(heard.values()), ", ".join(sorted(heard))
    what = "its own ranges" if is_itself else f"ranges to {source or 'nobody'}: no log and no station of that name"
    return Finding("warn", "session.unknown_source", f"left out {count} {what}", f"link.{source}", where, count)


def _link(
    name: str,
    source: str,
    table: Table,
    placed: LogOffset,
    start_ns: int,
    group_ns: int,
    settings: SessionSettings,
    findings: list[Finding],
) -> _Link:
    read = table.values("pseudorange_m")
    is_there = table.columns["pseudorange_m"].mask if "pseudorange_m" in table else np.zeros(len(table), dtype=bool)
    arrival_ns, flown_ns = placed.time_ns(table), travel_ns(read)
    sent_ns, known = transmission_ns(table)
    sent_ns = np.where(known, sent_ns + group_ns, arrival_ns - flown_ns)
    no_number = is_there & ~np.isfinite(read)
    negative = np.isfinite(read) & (read < 0.0)
    absurd = negative & (read < (0.0 if settings.two_way else -settings.negative_limit_m))
    late = np.isfinite(read) & (np.abs(arrival_ns - flown_ns - sent_ns) > 2 * int(settings.clock_limit_s * NS_PER_S))
    _tell(findings, "not_a_number", "left out {} ranges that are no numbers", no_number, table, name)
    _tell(findings, "negative_range", "left out {} negative ranges that no clock explains", absurd, table, name)
    kept = "kept {} negative ranges: the clocks may explain them"
    _tell(findings, "negative_range", kept, negative & ~absurd, table, name, is_grave=False)
    apart = "left out {} ranges whose time of transmission is not that of the log"
    _tell(findings, "stray_time", apart, late & ~absurd, table, name)
    slot = table.values("slot")
    numbered = np.isfinite(slot) & (np.abs(slot) < 2**53)
    slots = np.where(numbered, np.where(numbered, slot, 0.0).astype(np.int64), NO_SLOT)
    link = _Link(name, source, table.topic, sent_ns - start_ns, read, slots)
    return link.take(np.isfinite(read) & ~absurd & ~late)


def _tell(
    findings: list[Finding], code: str, text: str, rows: BoolArray, table: Table, name: str, is_grave: bool = True
) -> None:
    count = int(rows.sum())
    if count:
        first = int(table.record_index[np.flatnonzero(rows)[0]])
        place = f"{name}, from record {first}"
        findings.append(
            Finding("warn" if is_grave else "info", f"session.{code}", text.format(count), table.topic, place, count)
        )


def _far_stations(
    links: Sequence[_Link],
    vehicles: Sequence[DeadReckoning],
    points: Sequence[GroundPoint],
    settings: SessionSettings,
) -> tuple[set[str], list[Finding]]:
    """Find stations that no range agrees with: their place, or their name, is wrong."""
    tracks = {vehicle.name: vehicle for vehicle in vehicles}
    far, findings = set(), []
    for point in points:
        mine = [link for link in links if link.source == point.name and len(link.read_m) >= LEAST_RESIDUALS]
        middles = [_median_residual_m(link, tracks[link.receiver], point) for link in mine]
        if not middles or min(map(abs, middles)) <= settings.station_limit_m:
            continue
        far.add(point.name)
        count = sum(len(link.read_m) for link in mine)
        told = ", ".join(
            f"{link.receiver} {middle / 1000.0:+.1f} km" for link, middle in zip(mine, middles, strict=True)
        )
        text = f"left out {count} ranges to station {point.name}: it is not where the ranges put it ({told})"
        findings.append(Finding("warn", "session.station_far", text, f"link.{point.name}", point.name, count))
    return far, findings


def _median_residual_m(link: _Link, track: DeadReckoning, point: GroundPoint) -> float:
    """Median of measured less dead-reckoned range, clocks and errors of the INS in it."""
    time_s = link.sent_ns / NS_PER_S
    place = np.column_stack([np.interp(time_s, track.time_s, track.position_m[:, k]) for k in range(3)])
    return float(np.median(link.read_m - np.linalg.norm(place - np.array(point.position_m), axis=1)))


def _in_order(links: Sequence[_Link], receivers: Sequence[str], settings: SessionSettings) -> Ranges:
    """One table in order of transmission; rows of one time in the order of the receivers."""
    if not any(len(link.read_m) for link in links):
        return Ranges.none()
    counts = [len(link.read_m) for link in links]
    sent = np.concatenate([link.sent_ns for link in links])
    places = np.repeat([receivers.index(link.receiver) for link in links], counts)
    order = np.lexsort((places, sent))
    return Ranges(
        sent[order] / NS_PER_S,
        np.repeat([link.receiver for link in links], counts)[order],
        np.repeat([link.source for link in links], counts)[order],
        np.concatenate([link.read_m for link in links])[order],
        np.full(len(order), settings.range_sigma_m),
        np.concatenate([link.slot for link in links])[order],
        is_two_way=settings.two_way,
    )
