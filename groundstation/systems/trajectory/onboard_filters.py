"""Filters of a log whose output can be compared, the one that flew the aircraft first.

They are the topics ``ins``, and the lanes of an autopilot that runs several: XKF1, NKF1 of ArduPilot;
estimator_attitude with estimator_local_position of PX4.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import Column
from groundstation.base.signals import topics_of_kind
from groundstation.systems.trajectory.onboard_offsets import euler_deg
from groundstation.systems.trajectory.solution import FloatArray
from groundstation.tables.filter_of_ins import filter_of_ins
from groundstation.tables.table import Flight, Table

RAW = "raw."
MOST_LANES = 6
ARDUPILOT = {"XKF1": "EKF3", "NKF1": "EKF2"}
FIELDS = {
    "roll_deg": "Roll",
    "pitch_deg": "Pitch",
    "true_heading_deg": "Yaw",
    "velocity_north_mps": "VN",
    "velocity_east_mps": "VE",
    "velocity_down_mps": "VD",
    "position_north_m": "PN",
    "position_east_m": "PE",
    "position_down_m": "PD",
}
PX4_MOTION = dict(zip((*FIELDS,)[3:], ("vx", "vy", "vz", "x", "y", "z"), strict=True))
NEAR_NS = 200_000_000  # between attitude and motion of one lane


@dataclass(frozen=True)
class LoggedFilter:
    """Output of a filter: topic, table with the fields of ``ins``, name.

    ``flew`` is None where the log does not tell whether it flew the aircraft; ``source`` is what tells it.
    """

    topic: str
    table: Table
    name: str = ""
    flew: bool | None = None
    source: str = ""


def filters_of(flight: Flight) -> tuple[LoggedFilter, ...]:
    """Return the filters of a log: the one that flew first, one that surely did not last."""
    found = []
    for topic in sorted(topics_of_kind("ins", flight.topics())):
        of = filter_of_ins(flight, topic)
        found.append(LoggedFilter(topic, flight[topic], of.name, of.flew, of.source))
    order = {True: 0, None: 1, False: 2}
    found.sort(key=lambda one: order[one.flew])
    lanes = [one for read in (_ardupilot_lanes, _px4_lanes) for one in read(flight)]
    return (*found, *(lanes[:MOST_LANES] if len(lanes) > 1 else ()))


def _ardupilot_lanes(flight: Flight) -> Iterator[LoggedFilter]:
    for record, name in ARDUPILOT.items():
        for lane in range(MOST_LANES):
            topic = f"{RAW}{record}.{lane}"
            if topic in flight and flight[topic].has(*FIELDS.values()):
                table = flight[topic]
                columns = {field: table.columns[source] for field, source in FIELDS.items()}
                used = _share_in_use(flight, f"{RAW}{record[:3]}4", lane)
                yield _lane(topic, _made(table, columns), f"{name} lane {lane}", used, "primary lane PI")


def _share_in_use(flight: Flight, status: str, lane: int) -> float | None:
    """Return the share of the log in which a lane was in use; None where it is not told."""
    told = next((one for one in (status, f"{status}.0") if one in flight and flight[one].has("PI")), None)
    if told is None:
        return None
    primary = flight[told].values("PI")
    return float(np.mean(primary[np.isfinite(primary)] == lane)) if np.isfinite(primary).any() else None


def _px4_lanes(flight: Flight) -> Iterator[LoggedFilter]:
    selector = f"{RAW}estimator_selector_status"
    quaternion = tuple(f"q[{place}]" for place in range(4))
    for lane in range(MOST_LANES):
        end = f".{lane}" if lane else ""
        attitude, motion = f"{RAW}estimator_attitude{end}", f"{RAW}estimator_local_position{end}"
        if attitude not in flight or not flight[attitude].has(*quaternion):
            continue
        table = flight[attitude]
        angles = _angles_deg(np.column_stack([table.values(one) for one in quaternion]))
        columns = {name: Column(values) for name, values in zip((*FIELDS,)[:3], angles.T, strict=True)}
        if motion in flight and flight[motion].has(*PX4_MOTION.values()) and len(flight[motion]):
            columns |= _nearest(table, flight[motion])
        used = None
        if selector in flight and flight[selector].has("primary_instance"):
            used = float(np.mean(flight[selector].values("primary_instance") == lane))
        yield _lane(attitude, _made(table, columns), f"PX4 EKF2 lane {lane}", used, "primary_instance of the selector")


def _angles_deg(q: FloatArray) -> FloatArray:
    """Return roll, pitch and heading of quaternions n from b, scalar first."""
    w, x, y, z = (q / np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-12)).T
    rotation = np.empty((len(q), 3, 3))
    rotation[:, 0, 0], rotation[:, 1, 0] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    rotation[:, 2, 0], rotation[:, 2, 1] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)
    rotation[:, 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return euler_deg(rotation)


def _nearest(table: Table, motion: Table) -> dict[str, Column]:
    """Return the motion of a lane at the nearest times of its attitude."""
    row = nearest_rows(motion.time_ns, table.time_ns, takes_later=True)
    near = np.abs(motion.time_ns[row] - table.time_ns) <= NEAR_NS
    return {name: Column(motion.values(source)[row], near) for name, source in PX4_MOTION.items()}


def _made(table: Table, columns: dict[str, Column]) -> Table:
    return Table(table.topic, table.time_ns, columns, table.record_index, table.device_time_ns)


def _lane(topic: str, table: Table, name: str, used: float | None, source: str) -> LoggedFilter:
    """Return a lane; it flew the aircraft where it was in use for more than half of the log."""
    told = "" if used is None else f"{source}, {used:.0%} of the log"
    return LoggedFilter(topic, table, name, None if used is None else used > 0.5, told)
