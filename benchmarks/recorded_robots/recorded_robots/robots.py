"""Session of ground robots with odometry and cameras, whose logs are joined by robot.

The frame is local, x of the motion capture north. Every robot starts at its true pose of the first time at which all
robots have odometry and truth; from then on truth only judges. Odometry is averaged over ``bin_s``. The range of a
camera is the distance along its optical axis: it is divided by the cosine of the bearing.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.findings import Finding
from groundstation.base.signals import topics_of_kind
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import NO_SLOT, GroundPoint, Odometry, Ranges, Session
from groundstation.tables.session_tracks import aircraft_named
from groundstation.tables.table import Flight, Table

POSE = "position_north_m", "position_east_m", "true_heading_deg"
LARGEST_BEARING_DEG = 80.0
LONGEST_HOLD_S = 1.5  # longest hold of an odometry reading; a longer one is a gap
SEES, BLIND = 1, 2  # ranks


@dataclass(frozen=True)
class RobotSettings:
    """Assumptions of the assembly: step of the odometry, sigmas of one reading.

    Their growth is the filters' concern.
    """

    bin_s: float = number(0.2, 0.01, 10.0)
    range_sigma_m: float = number(0.01, 1e-4)
    bearing_sigma_deg: float = number(0.6, 1e-3)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class RobotSession:
    """Session of robots, with the truth to judge it by.

    The truth is by vehicle: time_s (n,), position_m (n, 3).
    """

    session: Session
    truth: Mapping[str, tuple[FloatArray, FloatArray]]
    findings: tuple[Finding, ...] = ()
    start_ns: int = 0


@dataclass
class _Robot:
    """Contents of the logs of one robot, wherever they were written."""

    name: str
    odometry: Table | None = None
    truth: Table | None = None
    links: list[Table] = field(default_factory=list)


def session_of_robots(
    flights: Iterable[Flight],
    landmarks: Sequence[GroundPoint],
    subjects: Mapping[str, str],
    *,
    settings: RobotSettings | None = None,
) -> RobotSession:
    """Put the logs of several robots together.

    Parameters
    ----------
    flights : iterable of Flight
        Several of one robot are joined; ``metadata["aircraft"]`` names it.
    landmarks : sequence of GroundPoint
    subjects : mapping of str to str
        Robot or landmark by the name of the link topic (a barcode).

    Returns
    -------
    RobotSession
        Parts that cannot be used are left out, each with a finding; without a vehicle where nothing is left.
    """
    settings, findings = settings or RobotSettings(), list[Finding]()
    robots = _joined(flights, findings)
    zero_ns = max((_first_ns(robot) for robot in robots), default=0)
    vehicles, truth = [], {}
    for robot in robots:
        track = _odometry(robot, zero_ns, settings.bin_s)
        if track is None:
            findings.append(_left_out(robot.name, "its odometry ends before the others begin"))
            continue
        vehicles.append(track)
        if track.gap_s.any():
            findings.append(_gap_found(track, settings.bin_s))
        truth[robot.name] = _truth(robot, zero_ns)
    names = {track.name for track in vehicles} | {point.name for point in landmarks}
    ranges = _ranges([one for one in robots if one.name in truth], subjects, names, zero_ns, settings, findings)
    ranks = {track.name: SEES for track in vehicles}
    session = Session("local", tuple(vehicles), tuple(landmarks), ranges, ranks=ranks)
    return RobotSession(session, truth, tuple(findings), zero_ns)


def blinded(session: Session, robots: Sequence[str]) -> Session:
    """Return the session without the landmarks that some robots see.

    The rank of these robots is then below that of the others.
    """
    points = {point.name for point in session.points}
    table = session.ranges
    lost = np.isin(table.receiver, list(robots)) & np.isin(table.source, list(points))
    ranks = {track.name: BLIND if track.name in robots else SEES for track in session.vehicles}
    return replace(session, ranges=table.take(~lost), ranks=ranks)


def _left_out(name: str, why: str) -> Finding:
    return Finding("warn", "session.no_dead_reckoning", f"{name} is left out: {why}", name)


def _gap_found(track: Odometry, bin_s: float) -> Finding:
    lost_s, longest_s = float(np.count_nonzero(track.gap_s)) * bin_s, float(track.gap_s.max())
    text = f"{track.name} has no odometry for {lost_s:.0f} s, {longest_s:.1f} s at a time: its last reading is held"
    return Finding("warn", "session.odometry_gap", text, track.name)


def _joined(flights: Iterable[Flight], findings: list[Finding]) -> list[_Robot]:
    """Robots with odometry and a pose to start from, in the order of their names."""
    robots: dict[str, _Robot] = {}
    for flight in flights:
        name = aircraft_named(flight.metadata, flight.source_name)
        robot = robots.setdefault(name, _Robot(name))
        for topic in flight.topics():
            if topic == "odometry":
                robot.odometry = flight[topic]
            elif topic == "truth":
                robot.truth = flight[topic]
        robot.links += [flight[topic] for topic in topics_of_kind("link", flight.topics())]
    whole = []
    for robot in sorted(robots.values(), key=lambda one: one.name):
        lacking = [
            what
            for what, table, fields in (
                ("odometry", robot.odometry, ("speed_mps", "turn_rate_dps")),
                ("truth to start from", robot.truth, POSE),
            )
            if table is None or not table.valid(*fields).any()
        ]
        if lacking:
            findings.append(_left_out(robot.name, f"no {' and no '.join(lacking)}"))
        else:
            whole.append(robot)
        if not lacking and not robot.links:
            text = f"{robot.name} has measured nothing"
            findings.append(Finding("warn", "session.no_links", text, robot.name))
    return whole


def _first_ns(robot: _Robot) -> int:
    assert robot.odometry is not None and robot.truth is not None
    return max(int(table.time_ns[0]) for table in (robot.odometry, robot.truth))


def _pose(robot: _Robot, zero_ns: int) -> tuple[FloatArray, FloatArray]:
    """Return time in seconds, and north, east and unwrapped heading in radians.

    Rows are left out where one of them is no number.
    """
    assert robot.truth is not None
    good = robot.truth.valid(*POSE)
    time_s = (robot.truth.time_ns[good] - zero_ns) / NS_PER_S
    north, east, heading = (robot.truth.values(name)[good] for name in POSE)
    return time_s, np.column_stack([north, east, np.unwrap(np.deg2rad(heading))])


def _truth(robot: _Robot, zero_ns: int) -> tuple[FloatArray, FloatArray]:
    time_s, pose = _pose(robot, zero_ns)
    return time_s, np.column_stack([pose[:, :2], np.zeros(len(pose))])


def _odometry(robot: _Robot, zero_ns: int, bin_s: float) -> Odometry | None:
    """Mean speed and turn rate over bins; a reading is held until the next."""
    assert robot.odometry is not None
    table = robot.odometry.take(robot.odometry.valid("speed_mps", "turn_rate_dps")).unique_times()
    time_s = (table.time_ns - zero_ns) / NS_PER_S
    if len(time_s) < 2 or time_s[-1] < 2.0 * bin_s:
        return None
    edges = np.arange(0.0, time_s[-1], bin_s)
    means = []
    for name in ("speed_mps", "turn_rate_dps"):
        whole = np.concatenate([[0.0], np.cumsum(table.values(name)[:-1] * np.diff(time_s))])
        means.append(np.diff(np.interp(edges, time_s, whole)) / bin_s)
    speed, turn = means
    at_s, pose = _pose(robot, zero_ns)
    north, east, heading = (float(np.interp(0.0, at_s, pose[:, k])) for k in range(3))
    gap_s = _gaps(time_s, edges)
    return Odometry(robot.name, edges[:-1], speed, turn, (north, east), float(np.rad2deg(heading)), gap_s)


def _gaps(time_s: FloatArray, edges: FloatArray) -> FloatArray:
    """Length of the gap that each bin lies in, 0 where there is none."""
    found = np.zeros(len(edges) - 1)
    for row in np.flatnonzero(np.diff(time_s) > LONGEST_HOLD_S):
        inside = (edges[1:] > time_s[row]) & (edges[:-1] < time_s[row + 1])
        found[inside] = time_s[row + 1] - time_s[row]
    return found


def _ranges(
    robots: Sequence[_Robot],
    subjects: Mapping[str, str],
    names: set[str],
    zero_ns: int,
    settings: RobotSettings,
    findings: list[Finding],
) -> Ranges:
    """Return the sightings of the cameras, in order of time; sightings of nobody are counted."""
    rows: list[tuple[FloatArray, FloatArray, FloatArray, str, str]] = []
    unknown, steep, count = 0, 0, 0
    for robot in robots:
        for table in robot.links:
            source = subjects.get(table.topic.partition(".")[2], "")
            count += len(table)
            if source not in names or source == robot.name:
                unknown += len(table)
                continue
            bearing = table.values("relative_bearing_deg")
            is_level = ~(np.abs(bearing) > LARGEST_BEARING_DEG)
            steep += int((~is_level).sum())
            time_s = (table.time_ns - zero_ns)[is_level] / NS_PER_S
            along = table.values("pseudorange_m")[is_level]
            rows.append((time_s, along, bearing[is_level], robot.name, source))
    for number_of, code, text in (
        (unknown, "unknown_source", "sightings of a barcode that is no landmark and no other robot of the session"),
        (steep, "not_ahead", f"sightings more than {LARGEST_BEARING_DEG:g} deg from the optical axis"),
    ):
        if number_of:
            findings.append(
                Finding("warn", f"session.{code}", f"left out {number_of} of {count} {text}", count=number_of)
            )
    if not rows:
        return replace(Ranges.none(), is_two_way=True)
    time_s, along, bearing = (np.concatenate([row[k] for row in rows]) for k in range(3))
    sizes, n = [len(row[0]) for row in rows], len(time_s)
    receivers, sources = np.repeat([row[3] for row in rows], sizes), np.repeat([row[4] for row in rows], sizes)
    order = np.lexsort((sources, receivers, time_s))
    return Ranges(
        time_s[order],
        receivers[order],
        sources[order],
        (along / np.cos(np.deg2rad(bearing)))[order],
        np.full(n, settings.range_sigma_m),
        np.full(n, NO_SLOT),
        bearing[order],
        np.full(n, settings.bearing_sigma_deg),
        is_two_way=True,
    )
