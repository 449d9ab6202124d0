"""Logs of several aircraft made into one session on one clock.

Parts that could not be used become findings.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.datums import BY_NAME
from groundstation.base.ecef import ecef_m, geodetic_deg_m
from groundstation.base.findings import Finding
from groundstation.base.local_frame import LocalFrame
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import GroundPoint, SatelliteRanges, Session
from groundstation.tables.session_clock import LogOffset, place_logs
from groundstation.tables.session_ranges import gather_ranges
from groundstation.tables.session_settings import SessionSettings, Stations
from groundstation.tables.session_tracks import (
    InsRows,
    NoTrackError,
    aircraft_named,
    dead_reckoning,
    ins_rows,
    truth_of,
)
from groundstation.tables.table import Flight

LEAST_TOLD_S = 0.001  # a smaller offset of a clock is not worth a line
Truth = Mapping[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class ClockRow:
    """Offset of the clock of one log: log time less that of the group.

    It comes from the times of transmission. ``offset_s`` is that of its longest stretch between leaps, None without
    ranges; ``is_corrected`` says whether it was taken off.
    """

    aircraft: str
    log: str
    has_utc: bool
    ranges: int
    offset_s: float | None
    leaps: int
    is_corrected: bool


@dataclass(frozen=True)
class AssembledSession:
    """A session made of logs.

    Parameters
    ----------
    session : Session
    truth : mapping of str to (time_s (n,), position_m (n, 3))
        Truth of the aircraft whose log has it, frame of the session; only judges.
    findings : tuple of Finding
    clocks : tuple of ClockRow
        Clock of every log that has a place in the session.
    start_ns : int
        Session time zero: the first dead reckoning; UTC where ``has_utc``.
    has_utc : bool
    origin : LocalFrame, optional
        Origin of a session in a local frame.
    """

    session: Session
    truth: Truth
    findings: tuple[Finding, ...] = ()
    clocks: tuple[ClockRow, ...] = ()
    start_ns: int = 0
    has_utc: bool = False
    origin: LocalFrame | None = None

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last dead reckoning."""
        return max((float(one.time_s[-1]) for one in self.session.vehicles if len(one)), default=0.0)


@dataclass
class _Members:
    """Logs that are still in the session, by aircraft, and findings on the others."""

    flights: dict[str, Flight]
    findings: list[Finding] = field(default_factory=list)

    def leave_out(self, name: str, code: str, text: str, count: int | None = None) -> None:
        flight = self.flights.pop(name)
        self.findings.append(Finding("warn", f"session.{code}", text, name, flight.source_name, count))


def session_from_flights(
    flights: Iterable[Flight], stations: Stations | None = None, *, settings: SessionSettings | None = None
) -> AssembledSession:
    """Put the logs of several aircraft together.

    Parameters
    ----------
    flights : iterable of Flight
        Their order does not count. ``metadata["aircraft"]`` is the name that the link topics of the others use.
    stations : Stations, optional
    settings : SessionSettings, optional

    Returns
    -------
    AssembledSession
        Parts that cannot be used are left out, each with a finding; a session without a vehicle where nothing is left.
    """
    stations, settings = stations or Stations(), settings or SessionSettings()
    members = _named(flights)
    placed, group_ns, agreeing = _on_one_clock(members, settings)
    rows = _with_tracks(members, placed, settings.epoch_s)
    _together(members, {name: (int(one.time_ns[0]), int(one.time_ns[-1])) for name, one in rows.items()})
    start_ns = min((int(rows[name].time_ns[0]) for name in members.flights), default=0)
    has_utc = any(flight.has_utc for flight in members.flights.values())
    vehicles, truth = [], {}
    for name, flight in members.flights.items():
        vehicles.append(dead_reckoning(name, rows[name], start_ns, stations.origin))
        known = truth_of(flight, placed[name], start_ns, stations.origin)
        if known is not None:
            truth[name] = known
    points = tuple(_point(stations, place) for place in range(len(stations.stations)))
    places = {name: placed[name] for name in members.flights}
    ranges, found = gather_ranges(members.flights, places, vehicles, points, start_ns, group_ns, settings)
    clocks = tuple(_clock_row(name, members.flights[name], placed[name], settings) for name in members.flights)
    told = [finding for row in clocks for finding in _clock_findings(row, len(clocks), agreeing)]
    session = Session(
        frame="ecef" if stations.origin is None else "local",
        vehicles=tuple(vehicles),
        points=points,
        ranges=ranges,
        satellites=_satellites(members.flights, placed, start_ns, settings),
        ranks=_ranks(members.flights, stations),
    )
    findings = (*members.findings, *told, *found)
    return AssembledSession(session, truth, findings, clocks, start_ns, has_utc, stations.origin)


def _named(flights: Iterable[Flight]) -> _Members:
    """Sort flights by the name of their aircraft; of several of one aircraft keep the longest."""
    found: dict[str, list[Flight]] = {}
    for flight in flights:
        found.setdefault(aircraft_named(flight.metadata, flight.source_name), []).append(flight)
    members = _Members({})
    for name, same in sorted(found.items()):
        ordered = sorted(same, key=lambda one: (-one.duration_s, one.source_name))
        members.flights[name] = ordered[0]
        for other in ordered[1:]:
            text = f"{len(same)} logs of {name}: {ordered[0].source_name} is used, {other.source_name} left out"
            finding = Finding("warn", "session.same_aircraft", text, name, other.source_name, len(same))
            members.findings.append(finding)
    return members


def _on_one_clock(members: _Members, settings: SessionSettings) -> tuple[dict[str, LogOffset], int, int]:
    placed, group_ns, agreeing = place_logs(members.flights, settings.clock_limit_s)
    for name in [name for name in members.flights if name not in placed]:
        text = f"{name} has neither UTC nor times of transmission: nothing relates its clock to that of the others"
        members.leave_out(name, "no_clock", text)
    return placed, group_ns, agreeing


def _with_tracks(members: _Members, placed: Mapping[str, LogOffset], step_s: float) -> dict[str, InsRows]:
    """Return the INS rows for dead reckoning of every log that has any."""
    rows = {}
    for name in list(members.flights):
        try:
            rows[name] = ins_rows(members.flights[name], placed[name], step_s)
        except NoTrackError as error:
            members.leave_out(name, "no_dead_reckoning", f"{name} has no dead reckoning: {error}")
            continue
        if rows[name].remark:
            text = f"height of {name} is {rows[name].remark}"
            members.findings.append(Finding("info", "session.height", text, name, rows[name].table.topic))
    return rows


def _together(members: _Members, spans: Mapping[str, tuple[int, int]]) -> None:
    """Keep the largest set of logs that overlap, one with another.

    Among equally large sets the first one is kept.
    """
    left = sorted(members.flights, key=lambda name: spans[name])
    groups: list[list[str]] = []
    end = 0
    for name in left:
        if groups and spans[name][0] < end:
            groups[-1].append(name)
            end = max(end, spans[name][1])
        else:
            groups.append([name])
            end = spans[name][1]
    kept = max(groups, key=len, default=[])
    for group in groups:
        for name in group if group is not kept else ():
            away_s = _away_s(spans[name], [spans[other] for other in kept])
            text = f"{name} does not overlap with {', '.join(sorted(kept))}: {away_s:.0f} s between them"
            members.leave_out(name, "no_overlap", text)


def _away_s(span: tuple[int, int], others: Sequence[tuple[int, int]]) -> float:
    first, last = min(one[0] for one in others), max(one[1] for one in others)
    return max(first - span[1], span[0] - last) / NS_PER_S


def _clock_row(name: str, flight: Flight, placed: LogOffset, settings: SessionSettings) -> ClockRow:
    clock = placed.clock
    is_corrected = bool(clock.rows and flight.has_utc and np.any(placed.shift_ns))
    offset_s = None
    if clock.rows and flight.has_utc:
        offset_s = int(placed.residual_ns[int(np.argmax(clock.stretch_rows))]) / NS_PER_S
    leaps = max(len(clock.offset_ns) - 1, 0)
    return ClockRow(name, flight.source_name, flight.has_utc, clock.rows, offset_s, leaps, is_corrected)


def _clock_findings(row: ClockRow, logs: int, agreeing: int) -> list[Finding]:
    found = []
    if row.offset_s is not None and abs(row.offset_s) > LEAST_TOLD_S:
        what = "taken off" if row.is_corrected else "left as it is: it may be a delay of the recorder"
        doubt = "" if 2 * agreeing > logs or not row.is_corrected else "; no majority tells which clock is right"
        text = f"clock of {row.aircraft} {row.offset_s:+.3f} s from that of the group; {what}{doubt}"
        found.append(Finding("warn" if row.is_corrected else "info", "session.clock_offset", text, row.aircraft))
    if row.leaps:
        text = (
            f"clock of {row.aircraft} leaps {row.leaps} times against the link; each stretch is put in its place, rows "
            "between two are left out"
        )
        found.append(Finding("warn", "session.clock_leap", text, row.aircraft, row.log, row.leaps))
    return found


def _point(stations: Stations, place: int) -> GroundPoint:
    one = stations.stations[place]
    latitude, longitude = one.latitude_deg, one.longitude_deg
    if stations.datum in BY_NAME:
        found = geodetic_deg_m(BY_NAME[stations.datum].to_wgs84_m(latitude, longitude, 0.0))
        latitude, longitude = float(found[0]), float(found[1])
    position = ecef_m(latitude, longitude, one.altitude_ellipsoid_m)
    if stations.origin is not None:
        position = stations.origin.from_ecef_m(position)
    x, y, z = position.tolist()
    return GroundPoint(one.name, (x, y, z), one.position_sigma_m, (latitude, longitude))


def _ranks(flights: Mapping[str, Flight], stations: Stations) -> dict[str, int]:
    """Return the ranks that the stations file states, else those the aircraft broadcast last."""
    ranks: dict[str, int] = {}
    for flight in flights.values():
        for topic in topics_of_kind("link", flight.topics()):
            heard = flight[topic].values("rank")
            heard = heard[np.isfinite(heard) & (np.abs(heard) < 1e6)]
            if len(heard):
                ranks[topic.partition(".")[2]] = int(heard[-1])
    return ranks | dict(stations.ranks) | {one.name: one.rank for one in stations.stations}


def _satellites(
    flights: Mapping[str, Flight], placed: Mapping[str, LogOffset], start_ns: int, settings: SessionSettings
) -> SatelliteRanges:
    """Return the pseudo-ranges to satellites, invalid ones included.

    The estimators leave out and count what is no number.
    """
    times: list[Int64Array] = []
    values: list[FloatArray] = []
    names: list[tuple[str, str, int]] = []
    for name, flight in flights.items():
        for topic in topics_of_kind("satellite", flight.topics()):
            every = flight[topic]
            table = every.take(placed[name].clock.is_certain(every.record_index))
            times.append(placed[name].time_ns(table) - start_ns)
            values.append(np.column_stack([table.values(column) for column in ("pseudorange_m", "x_m", "y_m", "z_m")]))
            names.append((name, topic.partition(".")[2], len(table)))
    if not times:
        return SatelliteRanges.none()
    time_s, read = np.concatenate(times) / NS_PER_S, np.concatenate(values)
    order = np.argsort(time_s, kind="stable")
    receiver, satellite = (np.repeat([row[k] for row in names], [row[2] for row in names]) for k in (0, 1))
    sigma = np.full(len(time_s), settings.satellite_range_sigma_m)
    return SatelliteRanges(time_s[order], receiver[order], satellite[order], read[order, 0], sigma, read[order, 1:])
