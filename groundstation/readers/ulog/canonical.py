"""Canonical signals from PX4 topics: the message, field and unit of each.

Field names changed between versions of PX4; of the rules of a role the first whose topic has data with the fields it
needs is taken. Units and senses are those of the message definitions (PX4-Autopilot, msg/*.msg, versions 1.4 to 1.16).
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import Column
from groundstation.base.units import DEG_PER_RAD, NT_PER_GAUSS
from groundstation.readers.mapping import (
    Columns,
    NumericColumns,
    Role,
    SourceRule,
    direction,
    holds,
    named,
    pressure_altitude,
    scaled,
)

_DOWNWARD = 25  # distance_sensor.orientation: ROTATION_DOWNWARD_FACING
_2D_FIX, FIX_3D, _EXTRAPOLATED = 2, 3, 8
# sensor_gps.fix_type: 0 and 1 no fix, 4 corrected code, 8 extrapolated; 7 is not used.
_FIXES = np.array(["none", "none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "other", "dead_reckoning", "other"])
NOT_THERE = 0x7FFFFFFF  # sensor_combined.<sensor>_timestamp_relative of a sensor that is not there
_HPA_BELOW = 1_200.0  # sensor_baro.pressure is in hPa before PX4 1.13, in Pa from then on
_UNKNOWN_CURRENT = -1.0
SAMPLED = "timestamp_sample"  # when the values were true, microseconds; 0 where a driver does not tell


class TopicRows:
    """Data of some messages of one topic, as floating-point numbers."""

    def __init__(self, rows: NDArray[Any]) -> None:
        self._rows = rows
        self._names = frozenset(rows.dtype.names or ())

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, name: str) -> bool:
        return name in self._names

    def __getitem__(self, name: str) -> FloatArray:
        with np.errstate(invalid="ignore"):  # some NaN of four bytes signal when they are widened
            return np.asarray(self._rows[name].astype(np.float64))


def vector_of(fields: tuple[str, str, str], name: str, factor: float) -> Callable[[NumericColumns], Columns]:
    return scaled({field: (f"{name}[{axis}]", factor) for axis, field in enumerate(fields)})


def _rule(source: str, fields: Mapping[str, tuple[str, float]], **derived: str) -> SourceRule:
    return SourceRule(source, tuple(name for name, _factor in fields.values()), scaled(fields), derived)


def attitude_from_quaternion(rows: NumericColumns) -> Columns:
    """Return roll, pitch and heading of the quaternion ``q`` (w, x, y, z).

    ``q`` turns body forward-right-down into north-east-down. A quaternion whose length is not one counts as missing:
    PX4 writes zeros before the filter has started.
    """
    w, x, y, z = (rows[f"q[{k}]"] for k in range(4))
    with np.errstate(invalid="ignore", over="ignore"):
        norm = w * w + x * x + y * y + z * z
        present = np.isnan(norm) | (np.abs(norm - 1.0) < 0.1)
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return {
            "roll_deg": Column(roll * DEG_PER_RAD, present),
            "pitch_deg": Column(pitch * DEG_PER_RAD, present),
            "true_heading_deg": direction(heading * DEG_PER_RAD, present),
        }


def attitude_from_angles(rows: NumericColumns) -> Columns:
    """Roll, pitch and heading that PX4 logged as angles (before 1.5)."""
    with np.errstate(invalid="ignore", over="ignore"):
        heading = direction(rows["yaw"] * DEG_PER_RAD)
    roll, pitch = rows["roll"] * DEG_PER_RAD, rows["pitch"] * DEG_PER_RAD
    return {"roll_deg": Column(roll), "pitch_deg": Column(pitch), "true_heading_deg": heading}


def local_velocity(rows: NumericColumns) -> Columns:
    """Velocity of ``vehicle_local_position``, absent where the filter calls it invalid."""
    level, vertical = holds(rows, "v_xy_valid"), holds(rows, "v_z_valid")
    return {
        "velocity_north_mps": Column(rows["vx"], level),
        "velocity_east_mps": Column(rows["vy"], level),
        "velocity_down_mps": Column(rows["vz"], vertical),
    }


def global_position(rows: NumericColumns) -> Columns:
    """Position of ``vehicle_global_position``; its flags of validity came with PX4 1.16."""
    level, vertical = holds(rows, "lat_lon_valid"), holds(rows, "alt_valid")
    columns = {"latitude_deg": Column(rows["lat"], level), "longitude_deg": Column(rows["lon"], level)}
    names = {"altitude_msl_m": "alt", "altitude_ellipsoid_m": "alt_ellipsoid"}
    return columns | {field: Column(rows[name], vertical) for field, name in names.items() if name in rows}


def gnss(rows: NumericColumns) -> Columns:
    """Fix of a satellite receiver; position and velocity are absent where there is no fix."""
    fix = rows["fix_type"] >= _2D_FIX
    velocity = holds(rows, "vel_ned_valid")
    velocity = fix if velocity is None else fix & velocity
    columns = {}
    for field, choices in _GNSS_FIELDS.items():
        name, factor = next(((name, factor) for name, factor in choices if name in rows), ("", 0.0))
        if name:
            is_velocity = field.startswith(("velocity", "ground", "track"))
            known = velocity if is_velocity else fix
            values = rows[name]
            if field in _NEVER_ZERO:
                known = known & ~(values <= 0.0)
            columns[field] = Column(values * factor, known)
    if {"altitude_msl_m", "altitude_ellipsoid_m"} <= columns.keys():
        columns["altitude_ellipsoid_m"] = _filled(columns["altitude_ellipsoid_m"], columns["altitude_msl_m"])
    if "track_deg" in columns:
        with np.errstate(invalid="ignore"):
            columns["track_deg"] = direction(columns["track_deg"].values, velocity)
    if "satellites_used" in rows:
        columns["satellites_used"] = Column(rows["satellites_used"])
    columns["integrity_ok"] = Column((rows["fix_type"] >= FIX_3D) & (rows["fix_type"] != _EXTRAPOLATED))
    columns["fix"] = named(rows["fix_type"], _FIXES)
    return columns


def _filled(ellipsoid: Column, msl: Column) -> Column:
    """Return the height above the ellipsoid where a driver filled it in; else it is 0."""
    return Column(ellipsoid.values, ellipsoid.mask & ((ellipsoid.values != 0.0) | (msl.values == 0.0)))


_GNSS_FIELDS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "latitude_deg": (("latitude_deg", 1.0), ("lat", 1e-7)),
    "longitude_deg": (("longitude_deg", 1.0), ("lon", 1e-7)),
    "altitude_msl_m": (("altitude_msl_m", 1.0), ("alt", 1e-3)),
    "altitude_ellipsoid_m": (("altitude_ellipsoid_m", 1.0), ("alt_ellipsoid", 1e-3)),
    "velocity_north_mps": (("vel_n_m_s", 1.0),),
    "velocity_east_mps": (("vel_e_m_s", 1.0),),
    "velocity_down_mps": (("vel_d_m_s", 1.0),),
    "ground_speed_mps": (("vel_m_s", 1.0),),
    "track_deg": (("cog_rad", DEG_PER_RAD),),
    "hdop": (("hdop", 1.0),),
    "velocity_sigma_mps": (("s_variance_m_s", 1.0),),
    "horizontal_sigma_m": (("eph", 1.0),),
    "vertical_sigma_m": (("epv", 1.0),),
}
# A driver that does not know them leaves 0.
_NEVER_ZERO = ("hdop", "velocity_sigma_mps", "horizontal_sigma_m", "vertical_sigma_m")


def _air_data(rows: NumericColumns) -> Columns:
    return pressure_altitude(rows["baro_pressure_pa"])


def _barometer(rows: NumericColumns) -> Columns:
    pressure = rows["pressure"]
    with np.errstate(invalid="ignore"):
        pascals = np.where(pressure < _HPA_BELOW, pressure * 100.0, pressure)
    return pressure_altitude(pascals)


def _wind(rows: NumericColumns) -> Columns:
    """Wind of the filter; a variance of 0 is that of a filter that has not started."""
    known = None
    for north, east in (("variance_north", "variance_east"), ("covariance_north", "covariance_east")):
        if north in rows and east in rows:
            known = (rows[north] != 0.0) | (rows[east] != 0.0)
    names = {"wind_north_mps": "windspeed_north", "wind_east_mps": "windspeed_east"}
    return {field: Column(rows[name], known) for field, name in names.items()}


def _current(rows: NumericColumns) -> Columns:
    current = rows["current_a"]
    return {"current_a": Column(current, current != _UNKNOWN_CURRENT)}


def _height(rows: NumericColumns) -> Columns:
    present = rows["orientation"] == _DOWNWARD
    if "signal_quality" in rows:
        present &= rows["signal_quality"] != 0.0
    return {"height_m": Column(rows["current_distance"], present)}


def _throttle(rows: NumericColumns) -> Columns:
    """Throttle that the controllers ask for: index 3 of msg/actuator_controls.msg."""
    return {"throttle_share": Column(rows["control[3]"])}


def _landed(rows: NumericColumns) -> Columns:
    landed = holds(rows, "landed")
    return {"weight_on_wheels": Column(landed)} if landed is not None else {}


_RATES = ("rate_x_dps", "rate_y_dps", "rate_z_dps")
_ACCEL = ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2")
_FIELD = ("field_forward_nt", "field_right_nt", "field_down_nt")
_HEADING = {"true_heading_deg": "attitude of the autopilot's filter (vehicle_attitude)"}
_QUATERNION = tuple(f"q[{k}]" for k in range(4))
_PRESSURE = {"pressure_altitude_m": "pressure in the standard atmosphere"}
_WIND_NEEDS = ("windspeed_north", "windspeed_east")
_GNSS_NEEDS = ("fix_type",)


def _vector_rule(
    source: str, name: str, fields: tuple[str, str, str], factor: float = 1.0, **derived: str
) -> SourceRule:
    return SourceRule(source, tuple(f"{name}[{axis}]" for axis in range(3)), vector_of(fields, name, factor), derived)


def _while_there(sensor: str, rule: SourceRule) -> SourceRule:
    """Return a rule of ``sensor_combined``: values are absent where the sensor is.

    The message itself says where.
    """
    mark = f"{sensor}_timestamp_relative"

    def columns(rows: NumericColumns) -> Columns:
        found = rule.columns(rows)
        if mark not in rows:
            return found
        is_there = rows[mark] != NOT_THERE
        return {field: Column(column.values, column.mask & is_there) for field, column in found.items()}

    return SourceRule(rule.source, rule.needs, columns, rule.derived)


ROLES: tuple[Role, ...] = (
    Role(
        "ins",
        (
            SourceRule("vehicle_attitude", _QUATERNION, attitude_from_quaternion, _HEADING),
            SourceRule("vehicle_attitude", ("roll", "pitch", "yaw"), attitude_from_angles, _HEADING),
        ),
    ),
    Role(
        "ins",
        (
            _vector_rule("vehicle_angular_velocity", "xyz", _RATES, DEG_PER_RAD),
            _rule(
                "vehicle_attitude",
                {
                    field: (name, DEG_PER_RAD)
                    for field, name in zip(_RATES, ("rollspeed", "pitchspeed", "yawspeed"), strict=True)
                },
            ),
            _vector_rule("sensor_combined", "gyro_rad", _RATES, DEG_PER_RAD),
        ),
    ),
    Role(
        "ins",
        (
            _vector_rule("vehicle_acceleration", "xyz", _ACCEL),
            _while_there("accelerometer", _vector_rule("sensor_combined", "accelerometer_m_s2", _ACCEL)),
        ),
    ),
    Role(
        "ins",
        (
            SourceRule("vehicle_local_position", ("vx", "vy", "vz"), local_velocity),
            _rule(
                "vehicle_global_position",
                {f"velocity_{axis}_mps": (f"vel_{axis[0]}", 1.0) for axis in ("north", "east", "down")},
            ),
        ),
    ),
    Role("ins", (SourceRule("vehicle_global_position", ("lat", "lon", "alt"), global_position),)),
    Role(
        "gnss",
        tuple(SourceRule(name, _GNSS_NEEDS, gnss, sampled=SAMPLED) for name in ("vehicle_gps_position", "sensor_gps")),
        has_instances=True,
    ),
    Role(
        "magnetometer",
        (
            _vector_rule("vehicle_magnetometer", "magnetometer_ga", _FIELD, NT_PER_GAUSS),
            _while_there("magnetometer", _vector_rule("sensor_combined", "magnetometer_ga", _FIELD, NT_PER_GAUSS)),
            _rule(
                "sensor_mag",
                {field: (axis, NT_PER_GAUSS) for field, axis in zip(_FIELD, "xyz", strict=True)},
                **dict.fromkeys(_FIELD, "sensor_mag, without the autopilot's calibration"),
            ),
        ),
        has_instances=True,
    ),
    Role("electric", (SourceRule("battery_status", ("current_a",), _current),), has_instances=True),
    Role(
        "baro",
        (
            SourceRule("vehicle_air_data", ("baro_pressure_pa",), _air_data, _PRESSURE),
            _while_there("baro", _rule("sensor_combined", {"pressure_altitude_m": ("baro_alt_meter", 1.0)})),
            SourceRule("sensor_baro", ("pressure",), _barometer, _PRESSURE),
        ),
    ),
    Role(
        "air",
        (
            _rule("airspeed_validated", {"true_airspeed_mps": ("true_airspeed_m_s", 1.0)}),
            _rule("airspeed", {"true_airspeed_mps": ("true_airspeed_m_s", 1.0)}),
        ),
    ),
    Role("air", tuple(SourceRule(name, _WIND_NEEDS, _wind) for name in ("wind", "wind_estimate", "estimator_wind"))),
    Role(
        "radio_altimeter",
        (SourceRule("distance_sensor", ("current_distance", "orientation"), _height),),
        has_instances=True,
    ),
    Role("engine", (SourceRule("actuator_controls_0", ("control[3]",), _throttle),)),
    Role(
        "discrete",
        (
            SourceRule(
                "vehicle_land_detected",
                ("landed",),
                _landed,
                {"weight_on_wheels": "landed flag of the autopilot (vehicle_land_detected)"},
            ),
        ),
    ),
)
MODES = ("vehicle_status", "nav_state")
# PX4 msg/VehicleStatus.msg NAVIGATION_STATE_*: those that kept their meaning from 1.4 on; others stay numbers.
MODE_NAMES: Mapping[int, str] = MappingProxyType(
    {
        0: "MANUAL",
        1: "ALTCTL",
        2: "POSCTL",
        3: "AUTO_MISSION",
        4: "AUTO_LOITER",
        5: "AUTO_RTL",
        10: "ACRO",
        12: "DESCEND",
        13: "TERMINATION",
        14: "OFFBOARD",
        15: "STAB",
        17: "AUTO_TAKEOFF",
        18: "AUTO_LAND",
        19: "AUTO_FOLLOW_TARGET",
        20: "AUTO_PRECLAND",
        21: "ORBIT",
        22: "AUTO_VTOL_TAKEOFF",
    }
)
ARMING: tuple[tuple[str, str, int], ...] = (("vehicle_status", "arming_state", 2), ("actuator_armed", "armed", 1))
