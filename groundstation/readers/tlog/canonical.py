"""MAVLink messages as canonical signals. Units and frames are those of the message definitions (common.xml).

The vehicle's axes are forward-right-down, those of the earth north-east-down: nothing is turned.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.atmosphere import pressure_altitude_m
from groundstation.base.records import BoolArray, Column
from groundstation.base.units import DEG_PER_RAD, MPS2_PER_G, NT_PER_GAUSS
from groundstation.readers.layout import velocity_from_track, wind_from_direction

FloatArray = NDArray[np.float64]
Columns = dict[str, Column]
Fields = Mapping[str, FloatArray]
UNKNOWN_16 = 65_535.0
ARMED, ON_GROUND = 128, 1
_2D_FIX, _3D_FIX = 2.0, 3.0


@dataclass(frozen=True)
class Rule:
    """What a message gives to a canonical topic, and what a user must know of it."""

    topic: str
    columns: Callable[[Fields], Columns]
    remark: str = ""


def attitude(rows: Fields) -> Columns:
    """Roll, pitch, heading and rates."""
    angles = {
        name: Column(rows[source] * DEG_PER_RAD) for name, source in (("roll_deg", "roll"), ("pitch_deg", "pitch"))
    }
    finite = np.isfinite(rows["yaw"])
    heading = wrap_360(np.where(finite, rows["yaw"], 0.0) * DEG_PER_RAD)
    rates = zip("xyz", ("rollspeed", "pitchspeed", "yawspeed"), strict=True)
    return {
        **angles,
        "true_heading_deg": Column(np.asarray(heading), finite),
        **{f"rate_{axis}_dps": Column(rows[source] * DEG_PER_RAD) for axis, source in rates},
    }


def global_position(rows: Fields) -> Columns:
    """Position and velocity of the autopilot's filter; zeros before it has a position."""
    known = (rows["lat"] != 0.0) | (rows["lon"] != 0.0)
    return {
        "latitude_deg": Column(rows["lat"] * 1e-7, known),
        "longitude_deg": Column(rows["lon"] * 1e-7, known),
        "altitude_msl_m": Column(rows["alt"] * 1e-3, known),
        "velocity_north_mps": Column(rows["vx"] * 0.01, known),
        "velocity_east_mps": Column(rows["vy"] * 0.01, known),
        "velocity_down_mps": Column(rows["vz"] * 0.01, known),
    }


def gnss(rows: Fields) -> Columns:
    """Fix of a receiver; what it does not know is the largest number, or zero."""
    has_fix = rows["fix_type"] >= _2D_FIX
    has_track = has_fix & (rows["cog"] != UNKNOWN_16) & (rows["vel"] != UNKNOWN_16)
    speed, track = rows["vel"] * 0.01, rows["cog"] * 0.01
    north, east = velocity_from_track(track, speed)
    columns = {
        "latitude_deg": Column(rows["lat"] * 1e-7, has_fix),
        "longitude_deg": Column(rows["lon"] * 1e-7, has_fix),
        "altitude_msl_m": Column(rows["alt"] * 1e-3, rows["fix_type"] >= _3D_FIX),
        "ground_speed_mps": Column(speed, has_fix & (rows["vel"] != UNKNOWN_16)),
        "track_deg": Column(np.asarray(wrap_360(track)), has_track),
        "velocity_north_mps": Column(north, has_track),
        "velocity_east_mps": Column(east, has_track),
        "hdop": Column(rows["eph"] * 0.01, rows["eph"] != UNKNOWN_16),
        "satellites_used": Column(rows["satellites_visible"], rows["satellites_visible"] != 255.0),
        "integrity_ok": Column(rows["fix_type"] >= _3D_FIX),
    }
    for name, source in (("altitude_ellipsoid_m", "alt_ellipsoid"), ("velocity_sigma_mps", "vel_acc")):
        if source in rows:  # an extension: zero where the sender has none
            columns[name] = Column(rows[source] * 1e-3, has_fix & (rows[source] != 0.0))
    return columns


def imu(rows: Fields) -> Columns:
    """Specific force in milli-g, rates in milliradians per second."""
    columns = {f"accel_{axis}_mps2": Column(rows[f"{axis}acc"] * 1e-3 * MPS2_PER_G) for axis in "xyz"}
    return columns | {f"rate_{axis}_dps": Column(rows[f"{axis}gyro"] * 1e-3 * DEG_PER_RAD) for axis in "xyz"}


def field(rows: Fields) -> Columns:
    """Magnetic field in milligauss; zeros of a vehicle without a compass are none."""
    known: BoolArray = (rows["xmag"] != 0.0) | (rows["ymag"] != 0.0) | (rows["zmag"] != 0.0)
    axes = zip("xyz", ("forward", "right", "down"), strict=True)
    return {f"field_{name}_nt": Column(rows[f"{axis}mag"] * 1e-3 * NT_PER_GAUSS, known) for axis, name in axes}


def pressure(rows: Fields) -> Columns:
    """Pressure in hectopascal, as altitude in the standard atmosphere."""
    altitude, is_refused = pressure_altitude_m(rows["press_abs"] * 100.0)
    return {"pressure_altitude_m": Column(altitude, ~is_refused)}


def battery(rows: Fields) -> Columns:
    """Current of the first battery; -1 is none."""
    known = rows["current_battery"] >= 0.0
    if "id" in rows:
        known &= rows["id"] == 0.0
    return {"current_a": Column(rows["current_battery"] * 0.01, known)}


def wind(rows: Fields) -> Columns:
    """Velocity of the air from the direction the wind blows from."""
    north, east = wind_from_direction(rows["direction"], rows["speed"])
    return {"wind_north_mps": Column(north), "wind_east_mps": Column(east)}


def landed(rows: Fields) -> Columns:
    """Weight on wheels by the autopilot; 0 is not known."""
    return {"weight_on_wheels": Column(rows["landed_state"] == ON_GROUND, rows["landed_state"] != 0.0)}


_ALTITUDE = "pressure in the standard atmosphere"
_TRACK = "track and ground speed of the receiver"
_HEADING = "attitude of the autopilot's filter (ATTITUDE), true where it knows the declination"
# Message -> what it gives. Of those that give the same, the first that is in the log does.
RULES: Mapping[str, tuple[Rule, ...]] = MappingProxyType(
    {
        "ATTITUDE": (Rule("ins", attitude, _HEADING),),
        "GLOBAL_POSITION_INT": (Rule("ins", global_position),),
        "GPS_RAW_INT": (Rule("gnss.1", gnss, _TRACK),),
        "GPS2_RAW": (Rule("gnss.2", gnss, _TRACK),),
        "SCALED_IMU": (Rule("magnetometer", field),),
        "RAW_IMU": (Rule("magnetometer", field),),
        "SCALED_PRESSURE": (Rule("baro", pressure, _ALTITUDE),),
        "BATTERY_STATUS": (Rule("electric", battery),),
        "SYS_STATUS": (Rule("electric", battery),),
        "WIND": (Rule("air", wind),),
        "EXTENDED_SYS_STATE": (Rule("discrete", landed),),
    }
)
INSTEAD: Mapping[str, str] = MappingProxyType({"RAW_IMU": "SCALED_IMU", "SYS_STATUS": "BATTERY_STATUS"})
