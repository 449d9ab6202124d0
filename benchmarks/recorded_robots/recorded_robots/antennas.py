"""Vehicles whose antennas measure two-way ranges: poses and ranges joined into a session.

Topics ``truth.<vehicle>`` hold the poses, ``link.<antenna>-<antenna>`` the ranges; which antenna is whose, and where it
stands on its vehicle, is told beside the logs. The frame is local, north-east-down.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray, unwrap
from groundstation.base.findings import Finding
from groundstation.base.records import frozen
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import NO_SLOT, Ranges
from groundstation.tables.table import Flight, Table

PLACE = "position_north_m", "position_east_m", "position_down_m"
ATTITUDE = "roll_deg", "pitch_deg", "true_heading_deg"


@dataclass(frozen=True)
class Poses:
    """Poses of one vehicle by a reference system.

    Parameters
    ----------
    name : str
    time_s : ndarray, shape (n,)
        Increasing.
    position_m : ndarray, shape (n, 3)
        North, east, down.
    attitude_deg : ndarray, shape (n, 3)
        Roll, pitch and heading, the latter unwrapped.
    """

    name: str
    time_s: FloatArray
    position_m: FloatArray
    attitude_deg: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "position_m", "attitude_deg"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def n_from_b(self, time_s: FloatArray) -> FloatArray:
        """Return rotations from body to north-east-down at other times, shape (m, 3, 3).

        Attitude is interpolated.
        """
        angles = [np.deg2rad(np.interp(time_s, self.time_s, column)) for column in self.attitude_deg.T]
        (sr, sp, sh), (cr, cp, ch) = np.sin(angles), np.cos(angles)
        rows = [
            [ch * cp, ch * sp * sr - sh * cr, ch * sp * cr + sh * sr],
            [sh * cp, sh * sp * sr + ch * cr, sh * sp * cr - ch * sr],
            [-sp, cp * sr, cp * cr],
        ]
        return np.moveaxis(np.array(rows), 2, 0)


@dataclass(frozen=True)
class Antenna:
    """Antenna of a vehicle, or a ground point, which has no arm.

    ``arm_m`` is forward, right and down of the vehicle's place.
    """

    owner: str
    arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class AntennaLog:
    """Log with the antennas behind the two names of its link topics, and its vehicles.

    Vehicles are keyed by the names of the log.
    """

    flight: Flight
    antennas: tuple[Mapping[str, Antenna], Mapping[str, Antenna]]
    vehicles: Mapping[str, str]


def poses_of(logs: Sequence[AntennaLog], zero_ns: int) -> dict[str, Poses]:
    """Poses of every vehicle, from the first log that has them."""
    found: dict[str, Poses] = {}
    for log in logs:
        for topic in topics_of_kind("truth", log.flight.topics()):
            name = log.vehicles.get(topic.partition(".")[2], "")
            table = log.flight[topic]
            table = table.take(table.valid(*PLACE, *ATTITUDE)).unique_times()
            if name and name not in found and len(table) > 1:
                attitude = [table.values(column) for column in ATTITUDE]
                attitude[2] = unwrap(attitude[2])
                position = np.column_stack([table.values(column) for column in PLACE])
                time_s = (table.time_ns - zero_ns) / NS_PER_S
                found[name] = Poses(name, time_s, position, np.column_stack(attitude))
    return found


def start_ns(logs: Iterable[AntennaLog]) -> int:
    """The first pose of any log."""
    times = [
        int(log.flight[topic].time_ns[0])
        for log in logs
        for topic in topics_of_kind("truth", log.flight.topics())
        if len(log.flight[topic])
    ]
    return min(times, default=0)


def antenna_ranges(
    logs: Sequence[AntennaLog], believed: Mapping[str, Poses], points: Sequence[str], zero_ns: int, sigma_m: float
) -> tuple[Ranges, tuple[Finding, ...]]:
    """Ranges between vehicles and points, with the lever arms that the vehicles believe in.

    Parameters
    ----------
    logs : sequence of AntennaLog
    believed : mapping of str to Poses
        Poses whose attitude turns the lever arms.
    points : sequence of str
    sigma_m : float
        Sigma of one range.

    Returns
    -------
    Ranges, tuple of Finding
        Ranges of unknown antennas are left out and counted.
    """
    parts: list[tuple[FloatArray, FloatArray, FloatArray, str, str]] = []
    unknown = count = 0
    for log in logs:
        for topic in topics_of_kind("link", log.flight.topics()):
            table = log.flight[topic]
            table = table.take(table.valid("pseudorange_m"))
            count += len(table)
            one, _, two = topic.partition(".")[2].partition("-")
            ends = [log.antennas[0].get(one), log.antennas[1].get(two)]
            if ends[0] is not None and ends[0].owner in points:
                ends.reverse()  # a ground point receives nothing here
            receiver, source = ends
            if receiver is None or source is None or receiver.owner == source.owner or receiver.owner not in believed:
                unknown += len(table)
            elif source.owner in believed or source.owner in points:
                parts.append(_part(table, receiver, source, believed, zero_ns))
            else:
                unknown += len(table)
    text = f"left out {unknown} of {count} ranges of antennas that belong to no vehicle or point of the session"
    findings = (Finding("warn", "session.unknown_source", text, count=unknown),) if unknown else ()
    if not parts:
        return Ranges.none(), findings
    time_s, distance, arm = (np.concatenate([part[k] for part in parts]) for k in range(3))
    sizes, n = [len(part[0]) for part in parts], len(time_s)
    receivers, sources = np.repeat([part[3] for part in parts], sizes), np.repeat([part[4] for part in parts], sizes)
    order = np.argsort(time_s, kind="stable")
    ranges = Ranges(
        time_s[order],
        receivers[order],
        sources[order],
        distance[order],
        np.full(n, sigma_m),
        np.full(n, NO_SLOT),
        is_two_way=True,
        arm_m=arm[order],
    )
    return ranges, findings


def _part(
    table: Table, receiver: Antenna, source: Antenna, believed: Mapping[str, Poses], zero_ns: int
) -> tuple[FloatArray, FloatArray, FloatArray, str, str]:
    time_s = (table.time_ns - zero_ns) / NS_PER_S
    arm = np.zeros((len(time_s), 3))
    for end, sign in ((receiver, 1.0), (source, -1.0)):
        if end.owner in believed:
            arm = arm + sign * believed[end.owner].n_from_b(time_s) @ np.array(end.arm_m)
    return time_s, table.values("pseudorange_m"), arm, receiver.owner, source.owner
