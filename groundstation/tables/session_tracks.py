"""Dead reckoning and truth of one log in the frame and on the clock of its session."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, ecef_m
from groundstation.base.local_frame import LocalFrame, heading_of, level_direction
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.session import DeadReckoning
from groundstation.tables.session_clock import LogOffset
from groundstation.tables.table import Flight, Table

LEVEL = "latitude_deg", "longitude_deg"
SPEED = "velocity_north_mps", "velocity_east_mps"
HEIGHTS = {"altitude_ellipsoid_m": "", "altitude_msl_m": "the height above mean sea level, tens of metres from it"}
LONGEST_BARO_GAP_S = 10.0
SAME_EPOCH = 1e-3  # share of a step


class NoTrackError(Exception):
    """Error: a log has no dead reckoning, for the reason given."""


def aircraft_named(metadata: Mapping[str, str], source_name: str) -> str:
    """Name of an aircraft: what the log says, else that of the file without its ending."""
    return metadata.get("aircraft", "").strip() or source_name.rpartition(".")[0] or source_name


@dataclass(frozen=True)
class InsRows:
    """Rows of an INS for dead reckoning, in order of session time (nanoseconds, absolute).

    ``remark`` says what stands for the height where the INS has none above the ellipsoid.
    """

    table: Table
    time_ns: Int64Array
    height_m: FloatArray
    velocity_mps: FloatArray
    remark: str


def ins_rows(flight: Flight, placed: LogOffset, step_s: float) -> InsRows:
    """Rows with position and velocity of the first INS that has both.

    Parameters
    ----------
    flight : Flight
    placed : LogOffset
        Its place on the clock of the session.
    step_s : float
        One row is kept of each step.

    Raises
    ------
    NoTrackError
        When no INS has position, velocity and height.
    """
    fit = [topic for topic in topics_of_kind("ins", flight.topics()) if flight[topic].has(*LEVEL, *SPEED)]
    if not fit:
        raise NoTrackError("no INS with latitude, longitude and velocities north and east")
    table = flight[fit[0]]
    height, remark = _height_m(flight, table)
    velocity = np.column_stack([table.values(axis) for axis in (*SPEED, "velocity_down_mps")])
    if not table.has("velocity_down_mps"):
        velocity[:, 2] = 0.0
    time_ns = placed.time_ns(table)
    good = table.valid(*LEVEL, *SPEED) & np.isfinite(height) & np.isfinite(velocity[:, 2])
    good &= placed.clock.is_certain(table.record_index)
    if table.has("valid"):
        good &= table.values("valid") != 0.0
    keep = np.flatnonzero(good)
    keep = keep[np.argsort(time_ns[keep], kind="stable")]
    keep = keep[_spaced(time_ns[keep], step_s)]
    if not len(keep):
        raise NoTrackError(f"{fit[0]} has no row with position, velocity and height")
    return InsRows(table.take(keep), time_ns[keep], height[keep], velocity[keep], remark)


def dead_reckoning(name: str, rows: InsRows, start_ns: int, origin: LocalFrame | None) -> DeadReckoning:
    """Make dead reckoning in ECEF, or in the local frame of an origin.

    ``start_ns`` is session time zero.
    """
    table, velocity = rows.table, rows.velocity_mps
    time_s = (rows.time_ns - start_ns) / NS_PER_S
    latitude, longitude = (table.values(column) for column in LEVEL)
    heading = table.values("true_heading_deg")
    position = ecef_m(latitude, longitude, rows.height_m)
    if origin is None:
        axes = ecef_from_n(latitude, longitude)
        return DeadReckoning(name, time_s, position, velocity, axes, latitude, heading)
    axes = np.broadcast_to(np.eye(3), (len(time_s), 3, 3)).copy()
    turned = origin.turned_from(latitude, longitude, velocity)
    nose = heading_of(origin.turned_from(latitude, longitude, level_direction(heading)))
    nowhere = np.full(len(time_s), np.nan)
    return DeadReckoning(name, time_s, origin.from_ecef_m(position), turned, axes, nowhere, nose)


def _spaced(time_ns: Int64Array, step_s: float) -> BoolArray:
    """Tell which rows lie in another time step than the row before.

    Rows of equal time leave one.
    """
    if not len(time_ns):
        return np.zeros(0, dtype=bool)
    step_ns = max(int(step_s * NS_PER_S), 1)
    place = (time_ns - time_ns[0] + int(SAME_EPOCH * step_ns)) // step_ns
    return np.asarray(np.concatenate([[True], np.diff(place) > 0]))


def _height_m(flight: Flight, table: Table) -> tuple[FloatArray, str]:
    """Height above the ellipsoid, and what stands for it where the INS has none."""
    for column, remark in HEIGHTS.items():
        if table.has(column):
            return table.values(column), remark
    for topic in topics_of_kind("baro", flight.topics()):
        baro = flight[topic]
        known = baro.valid("pressure_altitude_m")
        if known.any():
            time_ns, read = baro.time_ns[known], baro.values("pressure_altitude_m")[known]
            height = np.interp(table.time_ns - time_ns[0], time_ns - time_ns[0], read)
            after = np.clip(np.searchsorted(time_ns, table.time_ns), 1, len(time_ns) - 1) if len(time_ns) > 1 else 0
            near = np.minimum(np.abs(table.time_ns - time_ns[after]), np.abs(table.time_ns - time_ns[after - 1]))
            height[near > int(LONGEST_BARO_GAP_S * NS_PER_S)] = np.nan
            return height, f"the pressure altitude of {topic}"
    raise NoTrackError("neither the INS nor a barometric altimeter has a height")


def truth_of(
    flight: Flight, placed: LogOffset, start_ns: int, origin: LocalFrame | None
) -> tuple[FloatArray, FloatArray] | None:
    """Time and position of the truth in a log, None where there is none."""
    columns = (*LEVEL, "altitude_ellipsoid_m")
    if "truth" not in flight or not flight["truth"].has(*columns):
        return None
    table = flight["truth"]
    keep = np.flatnonzero(table.valid(*columns) & placed.clock.is_certain(table.record_index))
    time_ns = placed.time_ns(table)[keep] - start_ns
    keep, time_ns = keep[np.argsort(time_ns, kind="stable")], np.sort(time_ns)
    position = ecef_m(*(table.values(column)[keep] for column in columns))
    return time_ns / NS_PER_S, position if origin is None else origin.from_ecef_m(position)
