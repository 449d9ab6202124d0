"""MAVLink messages as canonical signals.

Units and frames are those of the message definitions (common.xml).

The vehicle's axes are forward-right-down, those of the earth north-east-down: nothing is turned.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from groundstation.base.geodesy import has_position
from groundstation.base.records import BoolArray, Column
from groundstation.base.units import DEG_PER_RAD, MPS2_PER_G, NT_PER_GAUSS
from groundstation.readers import imu
from groundstation.readers.layout import velocity_from_track, wind_from_direction
from groundstation.readers.mapping import Columns, NumericColumns, Role, SourceRule, direction, named, pressure_altitude

UNKNOWN_16 = 65_535.0
ARMED, ON_GROUND = 128, 1
_2D_FIX, _3D_FIX, _CORRECTED = 2.0, 3.0, 4.0
# GPS_FIX_TYPE: 0 and 1 no fix, 4 DGPS or SBAS, 7 a fixed place of a base station.
_FIXES = np.array(["none", "none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "other", "ppp", "other"])
_ACCEL_BITS, _RATE_BITS, _TEMPERATURE_BIT = 0b111, 0b111000, 1 << 12  # HIGHRES_IMU_UPDATED_FLAGS
_UNKNOWN_32 = 4_294_967_295.0


def attitude(rows: NumericColumns) -> Columns:
    """Roll, pitch, heading and rates."""
    angles = {
        name: Column(rows[source] * DEG_PER_RAD) for name, source in (("roll_deg", "roll"), ("pitch_deg", "pitch"))
    }
    finite = np.isfinite(rows["yaw"])
    rates = zip("xyz", ("rollspeed", "pitchspeed", "yawspeed"), strict=True)
    return {
        **angles,
        "true_heading_deg": direction(np.where(finite, rows["yaw"], 0.0) * DEG_PER_RAD, finite),
        **{f"rate_{axis}_dps": Column(rows[source] * DEG_PER_RAD) for axis, source in rates},
    }


def global_position(rows: NumericColumns) -> Columns:
    """Position and velocity of the autopilot's filter; zeros before it has a position."""
    known = has_position(rows["lat"] * 1e-7, rows["lon"] * 1e-7)
    return {
        "latitude_deg": Column(rows["lat"] * 1e-7),
        "longitude_deg": Column(rows["lon"] * 1e-7),
        "altitude_msl_m": Column(rows["alt"] * 1e-3),
        "velocity_north_mps": Column(rows["vx"] * 0.01, known),
        "velocity_east_mps": Column(rows["vy"] * 0.01, known),
        "velocity_down_mps": Column(rows["vz"] * 0.01, known),
    }


def gnss(rows: NumericColumns) -> Columns:
    """Return the fix of a receiver; unknown values are the largest number, or zero."""
    has_fix = rows["fix_type"] >= _2D_FIX
    has_track = has_fix & (rows["cog"] != UNKNOWN_16) & (rows["vel"] != UNKNOWN_16)
    speed, track = rows["vel"] * 0.01, rows["cog"] * 0.01
    north, east = velocity_from_track(track, speed)
    columns = {
        "latitude_deg": Column(rows["lat"] * 1e-7, has_fix),
        "longitude_deg": Column(rows["lon"] * 1e-7, has_fix),
        "altitude_msl_m": Column(rows["alt"] * 1e-3, rows["fix_type"] >= _3D_FIX),
        "ground_speed_mps": Column(speed, has_fix & (rows["vel"] != UNKNOWN_16)),
        "track_deg": direction(track, has_track),
        "velocity_north_mps": Column(north, has_track),
        "velocity_east_mps": Column(east, has_track),
        "hdop": Column(rows["eph"] * 0.01, rows["eph"] != UNKNOWN_16),
        "satellites_used": Column(rows["satellites_visible"], rows["satellites_visible"] != 255.0),
        "integrity_ok": Column(rows["fix_type"] >= _3D_FIX),
        "fix": named(rows["fix_type"], _FIXES),
    }
    for name, source in _EXTENSIONS:
        if source in rows:  # an extension: zero where the sender has none
            columns[name] = Column(rows[source] * 1e-3, has_fix & (rows[source] != 0.0))
    if "dgps_age" in rows:
        age_ms = rows["dgps_age"]
        is_told = (rows["fix_type"] >= _CORRECTED) & (age_ms > 0.0) & (age_ms < _UNKNOWN_32)
        columns["age_of_corrections_s"] = Column(age_ms * 1e-3, is_told)
    return columns


_EXTENSIONS = (
    ("altitude_ellipsoid_m", "alt_ellipsoid"),
    ("velocity_sigma_mps", "vel_acc"),
    ("horizontal_sigma_m", "h_acc"),
    ("vertical_sigma_m", "v_acc"),
)


def scaled_imu(rows: NumericColumns) -> Columns:
    """Samples of specific force in milli-g and of rates in milliradians per second."""
    columns = {f"accel_{axis}_mps2": Column(rows[f"{axis}acc"] * 1e-3 * MPS2_PER_G) for axis in "xyz"}
    columns |= {f"rate_{axis}_dps": Column(rows[f"{axis}gyro"] * 1e-3 * DEG_PER_RAD) for axis in "xyz"}
    if "temperature" in rows:  # an extension, hundredths of a degree: zero where the sender has none
        columns["temperature_c"] = Column(rows["temperature"] * 0.01, rows["temperature"] != 0.0)
    return imu.samples(columns)


def precise_imu(rows: NumericColumns) -> Columns:
    """Samples of HIGHRES_IMU, in SI units; its bits tell which values are new."""
    told = rows["fields_updated"].astype(np.int64) if "fields_updated" in rows else np.full(len(rows["xacc"]), -1)
    has_accel, has_rates = (told & bits == bits for bits in (_ACCEL_BITS, _RATE_BITS))
    columns = {f"accel_{axis}_mps2": Column(rows[f"{axis}acc"], has_accel) for axis in "xyz"}
    columns |= {f"rate_{axis}_dps": Column(rows[f"{axis}gyro"] * DEG_PER_RAD, has_rates) for axis in "xyz"}
    columns["temperature_c"] = Column(rows["temperature"], told & _TEMPERATURE_BIT != 0)
    return imu.samples(columns)


def field(rows: NumericColumns) -> Columns:
    """Return the magnetic field from milligauss; zeros without a compass are absent."""
    known: BoolArray = (rows["xmag"] != 0.0) | (rows["ymag"] != 0.0) | (rows["zmag"] != 0.0)
    axes = zip("xyz", ("forward", "right", "down"), strict=True)
    return {f"field_{name}_nt": Column(rows[f"{axis}mag"] * 1e-3 * NT_PER_GAUSS, known) for axis, name in axes}


def pressure(rows: NumericColumns) -> Columns:
    """Pressure in hectopascal, as altitude in the standard atmosphere."""
    return pressure_altitude(rows["press_abs"] * 100.0)


def battery(rows: NumericColumns) -> Columns:
    """Return the current of the first battery; -1 is absent."""
    known = rows["current_battery"] >= 0.0
    if "id" in rows:
        known &= rows["id"] == 0.0
    return {"current_a": Column(rows["current_battery"] * 0.01, known)}


def wind(rows: NumericColumns) -> Columns:
    """Return the wind velocity from the direction the wind blows from."""
    north, east = wind_from_direction(rows["direction"], rows["speed"])
    return {"wind_north_mps": Column(north), "wind_east_mps": Column(east)}


def landed(rows: NumericColumns) -> Columns:
    """Return weight on wheels by the autopilot; 0 is unknown."""
    return {"weight_on_wheels": Column(rows["landed_state"] == ON_GROUND, rows["landed_state"] != 0.0)}


_ALTITUDE = {"pressure_altitude_m": "pressure in the standard atmosphere"}
_TRACK = dict.fromkeys(("velocity_north_mps", "velocity_east_mps"), "track and ground speed of the receiver")
OF_FILTER = "attitude of the autopilot's filter"
_HEADING = {"true_heading_deg": f"{OF_FILTER} (ATTITUDE), true where it knows the declination"}
RECEIVER = "GPS"
# Messages that are instances of one source; every other message is its own.
INSTANCES: Mapping[str, tuple[str, int]] = MappingProxyType({"GPS_RAW_INT": (RECEIVER, 0), "GPS2_RAW": (RECEIVER, 1)})
_INERTIAL = (*(f"{axis}acc" for axis in "xyz"), *(f"{axis}gyro" for axis in "xyz"))
_MAG = ("xmag", "ymag", "zmag")
_CURRENT = ("current_battery",)
ROLES: tuple[Role, ...] = (
    Role("ins", (SourceRule("ATTITUDE", ("roll", "pitch", "yaw"), attitude, _HEADING),)),
    Role("ins", (SourceRule("GLOBAL_POSITION_INT", ("lat", "lon", "alt"), global_position),)),
    Role("gnss", (SourceRule(RECEIVER, ("lat", "lon", "fix_type"), gnss, _TRACK),), has_instances=True),
    Role("magnetometer", (SourceRule("SCALED_IMU", _MAG, field), SourceRule("RAW_IMU", _MAG, field))),
    Role(
        "imu",
        (
            SourceRule("HIGHRES_IMU", (*_INERTIAL, "temperature"), precise_imu, imu.TOLD_SAMPLES),
            SourceRule("SCALED_IMU", _INERTIAL, scaled_imu, imu.TOLD_SAMPLES),
            SourceRule("RAW_IMU", _INERTIAL, scaled_imu, imu.TOLD_SAMPLES),
        ),
    ),
    Role("baro", (SourceRule("SCALED_PRESSURE", ("press_abs",), pressure, _ALTITUDE),)),
    Role("electric", (SourceRule("BATTERY_STATUS", _CURRENT, battery), SourceRule("SYS_STATUS", _CURRENT, battery))),
    Role("air", (SourceRule("WIND", ("direction", "speed"), wind),)),
    Role("discrete", (SourceRule("EXTENDED_SYS_STATE", ("landed_state",), landed),)),
)
