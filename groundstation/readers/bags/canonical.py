"""Canonical signals from robots' messages: fields, units and frames by message type.

Units and frames are those of the message definitions and of REP 103, 105 and 145: metres, radians, tesla; east-north-up
and forward-left-up.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column
from groundstation.base.units import DEG_PER_RAD
from groundstation.readers.bags.values import Values, attitude, body, level, rotated
from groundstation.readers.imu import samples
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.mapping import Columns, direction

NT_PER_TESLA = 1e9
RATES = ("rate_x_dps", "rate_y_dps", "rate_z_dps")
ACCEL = ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2")
FIELD = ("field_forward_nt", "field_right_nt", "field_down_nt")
VELOCITY = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps")
POSITION = ("position_north_m", "position_east_m", "position_down_m")
EARTH_FRAMES = frozenset({"map", "earth", "enu", "world", "utm", "ned", "local_enu", "local_ned"})  # x is east


@dataclass(frozen=True)
class Message:
    """Message type and the canonical columns that it gives.

    Parameters
    ----------
    role : str
        ``imu``, ``fix``, ``odometry``, ``pose``, ``twist``, ``magnetometer``.
    needs : tuple of str
        Columns without which nothing is mapped.
    columns : callable
        Values to canonical columns.
    """

    role: str
    needs: tuple[str, ...]
    columns: Callable[[Values], Columns]


def is_ned(values: Values) -> bool:
    """Tell whether a message names a frame that is north-east-down already.

    By REP 103 the name of such a frame ends with ``_ned``.
    """
    return _frame(values) == "ned" or _frame(values).endswith("_ned")


def is_earth_frame(values: Values) -> bool:
    """Tell whether a message names a frame whose axes are those of the earth.

    By REP 105 ``odom`` begins anywhere.
    """
    return _frame(values) in EARTH_FRAMES or _frame(values).endswith(("_enu", "_ned"))


def _frame(values: Values) -> str:
    return (values.text("header.frame_id") or values.text("frame_id")).strip("/").rpartition("/")[2]


def imu(values: Values) -> Columns:
    """Return attitude, rates and specific force.

    A covariance that begins with -1 says that a driver has no such value.
    """
    known = {name: _is_known(values, f"{name}_covariance[0]") for name in _IMU_PARTS}
    columns: Columns = {}
    if values.has_triple("orientation"):
        columns |= attitude(values, "orientation", known["orientation"])
    columns |= body(values, "angular_velocity", RATES, DEG_PER_RAD, known["angular_velocity"])
    return columns | body(values, "linear_acceleration", ACCEL, 1.0, known["linear_acceleration"])


_IMU_PARTS = ("orientation", "angular_velocity", "linear_acceleration")


def imu_samples(values: Values) -> Columns:
    """Return the topic ``imu`` of an IMU message: samples, as the message tells no interval."""
    columns = imu(values)
    return samples({name: columns[name] for name in (*RATES, *ACCEL)})


def _is_known(values: Values, covariance: str) -> np.ndarray | None:
    return values[covariance] != -1.0 if covariance in values else None


def navsatfix(values: Values) -> Columns:
    """Return the position where the receiver has a fix; a NaN altitude is absent."""
    has_fix = values["status.status"] >= 0.0
    altitude = values["altitude"]
    return {
        "latitude_deg": Column(values["latitude"], has_fix),
        "longitude_deg": Column(values["longitude"], has_fix),
        "altitude_ellipsoid_m": _where(altitude, has_fix & ~np.isnan(altitude)),
        "integrity_ok": Column(has_fix),
        "fix": _fix(values),
        **sigmas(values, has_fix),
    }


def _fix(values: Values) -> Column:
    """Return the kind of the fix by its status.

    -1 is none, 0 a fix, 1 one corrected by satellites, 2 from the ground. Drivers state RTK as corrected from the
    ground (2), so ``dgnss`` may be better than it says. -2 is unknown.
    """
    status = values["status.status"]
    return Column(np.select([status < 0.0, status < 1.0], ["none", "3d"], "dgnss"), status >= -1.0)


def sigmas(values: Values, present: np.ndarray) -> Columns:
    """Return the standard deviations of a position by its covariance, east-north-up.

    Only where the message says that the covariance is known.
    """
    if not all(name in values for name in _COVARIANCE):
        return {}
    east, north, up = (values[name] for name in _COVARIANCE[:3])
    kind = values.column(_COVARIANCE[3])
    of_kind = ~np.isin(kind.values, _UNKNOWN) if kind.values.dtype.kind == "U" else kind.values > 0
    with np.errstate(invalid="ignore", over="ignore"):
        level = east + north
        is_known = present & kind.mask & of_kind
        columns = {"horizontal_sigma_m": level, "vertical_sigma_m": up}
        columns |= {"position_north_sigma_m": north, "position_east_sigma_m": east}
        known = {name: is_known & np.isfinite(one) & (one > 0.0) for name, one in columns.items()}
    return {name: _where(np.sqrt(np.where(known[name], one, 0.0)), known[name]) for name, one in columns.items()}


_COVARIANCE = (*(f"position_covariance[{place}]" for place in (0, 4, 8)), "position_covariance_type")
_UNKNOWN = ("UNKNOWN", "COVARIANCE_TYPE_UNKNOWN", "")  # names of the number 0, where a message has names


def location_fix(values: Values) -> Columns:
    """Return the position of Foxglove's LocationFix; an altitude of exactly 0 was not set."""
    columns = {"latitude_deg": values["latitude"], "longitude_deg": values["longitude"]}
    found = {name: Column(part, ~np.isnan(part)) for name, part in columns.items()}
    if "altitude" in values:
        altitude = values["altitude"]
        found["altitude_ellipsoid_m"] = _where(altitude, np.isfinite(altitude) & (altitude != 0.0))
    return found | sigmas(values, found["latitude_deg"].mask & found["longitude_deg"].mask)


def gps_fix(values: Values) -> Columns:
    """Return position, velocity and dilution of gps_msgs/GPSFix (gpsd).

    NaN is a value that the message does not have.
    """
    has_fix = values["status.status"] >= 0.0
    track, speed = values["track"], values["speed"]
    has_track = has_fix & np.isfinite(track) & np.isfinite(speed)
    north, east = velocity_from_track(np.where(has_track, track, 0.0), np.where(has_track, speed, 0.0))
    columns = {
        name: _where(values[source] * sign, has_fix & np.isfinite(values[source]))
        for name, (source, sign) in _GPS_FIX.items()
        if source in values
    }
    columns["track_deg"] = direction(np.where(has_track, track, 0.0), has_track)
    columns["velocity_north_mps"], columns["velocity_east_mps"] = Column(north, has_track), Column(east, has_track)
    columns["integrity_ok"] = Column(has_fix)
    columns["fix"] = _fix(values)
    if "status.satellites_used" in values:
        columns["satellites_used"] = Column(values["status.satellites_used"])
    if "status.satellites_visible" in values:
        visible = values["status.satellites_visible"]
        columns["satellites_tracked"] = Column(visible, visible > 0.0)
    return columns | sigmas(values, has_fix)


_GPS_FIX: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "latitude_deg": ("latitude", 1.0),
        "longitude_deg": ("longitude", 1.0),
        "altitude_ellipsoid_m": ("altitude", 1.0),
        "ground_speed_mps": ("speed", 1.0),
        "velocity_down_mps": ("climb", -1.0),
        "gdop": ("gdop", 1.0),
        "pdop": ("pdop", 1.0),
        "hdop": ("hdop", 1.0),
    }
)


def _where(values: np.ndarray, present: np.ndarray) -> Column:
    return Column(np.where(present, values, 0.0), present)


def magnetic_field(values: Values) -> Columns:
    """Magnetic field along the body's axes."""
    return body(values, "magnetic_field", FIELD, NT_PER_TESLA, None)


def wheel_odometry(values: Values) -> Columns:
    """Return speed forward and rate of turn to the right of odometry with a free origin."""
    return {
        "speed_mps": Column(values["twist.twist.linear.x"]),
        "turn_rate_dps": Column(-values["twist.twist.angular.z"] * DEG_PER_RAD),
    }


def odometry(values: Values) -> Columns:
    """Return attitude, local position and velocity of an odometry in an earth frame.

    Its frame must have the axes of the earth.
    """
    x, y, z = rotated(values, "pose.pose.orientation", "twist.twist.linear")
    velocity = _ned(values, x, y, z, VELOCITY)
    rates = body(values, "twist.twist.angular", RATES, DEG_PER_RAD, None, is_turned=not is_ned(values))
    has_rates = any(np.any(column.values != 0.0) for column in rates.values())
    return _pose(values, "pose.pose") | velocity | (rates if has_rates else {})


def _pose(values: Values, name: str) -> Columns:
    columns = attitude(values, f"{name}.orientation", None, is_turned=not is_ned(values))
    position = values.triple(f"{name}.position")
    if any(np.any(part != 0.0) for part in position):  # a driver that has none writes zeros
        columns |= _ned(values, *position, POSITION)
    return columns


def _ned(values: Values, x: np.ndarray, y: np.ndarray, z: np.ndarray, fields: tuple[str, str, str]) -> Columns:
    return level(y, x, -z, fields) if is_ned(values) else level(x, y, z, fields)


def pose(name: str) -> Callable[[Values], Columns]:
    """Return the rule for a pose in the field ``name``."""
    return lambda values: _pose(values, name)


def twist(name: str) -> Callable[[Values], Columns]:
    """Return the rule for a velocity along the axes of the earth in the field ``name``."""
    return lambda values: _ned(values, *values.triple(f"{name}.linear"), VELOCITY)


_FIX = ("latitude", "longitude")
_ROS_FIX = Message("fix", (*_FIX, "altitude", "status.status"), navsatfix)
_FOXGLOVE_FIX = Message("fix", _FIX, location_fix)
_GPSD_FIX = Message("fix", (*_FIX, "track", "speed", "status.status"), gps_fix)
_POSE = Message("pose", ("pose.orientation.w", "pose.position.x"), pose("pose"))
MESSAGES: Mapping[str, Message] = MappingProxyType(
    {
        "sensor_msgs/Imu": Message("imu", ("angular_velocity.x", "linear_acceleration.x"), imu),
        "sensor_msgs/MagneticField": Message("magnetometer", ("magnetic_field.x",), magnetic_field),
        "sensor_msgs/NavSatFix": _ROS_FIX,
        "gps_msgs/GPSFix": _GPSD_FIX,
        "gps_common/GPSFix": _GPSD_FIX,
        "foxglove.LocationFix": _FOXGLOVE_FIX,
        "foxglove_msgs/LocationFix": _FOXGLOVE_FIX,
        "foxglove.PoseInFrame": _POSE,
        "foxglove_msgs/PoseInFrame": _POSE,
        "geometry_msgs/PoseStamped": _POSE,
        "geometry_msgs/PoseWithCovarianceStamped": Message("pose", ("pose.pose.orientation.w",), pose("pose.pose")),
        "geometry_msgs/TwistStamped": Message("twist", ("twist.linear.x",), twist("twist")),
        "geometry_msgs/TwistWithCovarianceStamped": Message("twist", ("twist.twist.linear.x",), twist("twist.twist")),
        "nav_msgs/Odometry": Message("odometry", ("pose.pose.orientation.w", "twist.twist.linear.x"), odometry),
    }
)
