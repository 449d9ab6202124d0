"""Log of an inertial unit as PX4 writes it: ULog.

Increments are in vehicle_imu, fixes in vehicle_gps_position, the barometer in vehicle_air_data.

Source: PX4 User Guide, ULog File Format; fields of VehicleImu, SensorGps and VehicleAirData of PX4 1.14.
"""

import struct
from pathlib import Path

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.base.version import __version__
from groundstation.simulation.imu.aids import pressure_pa
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.packed import Packed, joined, records
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.simulation.imu.tables import nanoseconds

MAGIC = b"ULog\x01\x12\x35\x01"
BOOT_US = 5_000_000  # the autopilot has run for five seconds when the log begins
_KINDS = {"uint64_t": "<u8", "uint32_t": "<u4", "int32_t": "<i4", "uint16_t": "<u2", "uint8_t": "u1", "bool": "u1"}
_KINDS |= {"float": "<f4", "double": "<f8", "float[3]": "<3f4", "float[4]": "<4f4"}
IMU = (
    "uint64_t timestamp;uint64_t timestamp_sample;uint32_t accel_device_id;uint32_t gyro_device_id;"
    "float[3] delta_angle;float[3] delta_velocity;uint32_t delta_angle_dt;uint32_t delta_velocity_dt;"
    "uint8_t delta_angle_clipping;uint8_t delta_velocity_clipping;uint8_t accel_calibration_count;"
    "uint8_t gyro_calibration_count;"
)
RATES = "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;float[3] xyz_derivative;"
FORCES = "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;"
GPS = (
    "uint64_t timestamp;uint64_t timestamp_sample;double latitude_deg;double longitude_deg;double altitude_msl_m;"
    "double altitude_ellipsoid_m;uint64_t time_utc_usec;uint32_t device_id;float s_variance_m_s;float c_variance_rad;"
    "float eph;float epv;float hdop;float vdop;int32_t noise_per_ms;int32_t jamming_indicator;float vel_m_s;"
    "float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;float cog_rad;int32_t timestamp_time_relative;float heading;"
    "float heading_offset;float heading_accuracy;uint16_t automatic_gain_control;uint8_t fix_type;"
    "uint8_t jamming_state;uint8_t spoofing_state;bool vel_ned_valid;uint8_t satellites_used;"
)
AIR = (
    "uint64_t timestamp;uint64_t timestamp_sample;uint32_t baro_device_id;float baro_alt_meter;float baro_temp_celcius;"
    "float baro_pressure_pa;float rho;"
)
FIX_3D, FIX_RTK = 3, 6


def write_ulog(path: Path, flight: ImuFlight, scenario: ImuScenario) -> None:
    """Write the log as ULog.

    A unit that does not integrate is in vehicle_angular_velocity and vehicle_acceleration.
    """
    stamp_us = BOOT_US + nanoseconds(flight.time_s) // 1000
    logged_us = np.maximum.accumulate(stamp_us)
    layouts = {"vehicle_gps_position": GPS}
    layouts |= (
        {"vehicle_imu": IMU}
        if flight.is_integral
        else {"vehicle_angular_velocity": RATES, "vehicle_acceleration": FORCES}
    )
    rows = [(_gps_us(flight), _gps(flight, scenario, 0))]
    if flight.is_integral:
        rows.append((logged_us, _imu(flight, stamp_us, 1)))
    else:
        step_s = flight.interval_s[:, None]
        rows.append((logged_us, _samples(RATES, stamp_us, flight.delta_angle_rad / step_s, 1)))
        rows.append((logged_us, _samples(FORCES, stamp_us, flight.delta_velocity_mps / step_s, 2)))
    if len(flight.aids.baro_s):
        layouts["vehicle_air_data"] = AIR
        rows.append(_air(flight, len(layouts) - 1))
    head = [MAGIC + struct.pack("<Q", BOOT_US), _message("B", bytes(40))]
    head += [_message("F", f"{name}:{layout}".encode()) for name, layout in layouts.items()]
    head += [_info("sys_name", "PX4"), _info("ver_sw_release", "simulated"), _info("sys_toolchain", __version__)]
    head += [_message("A", struct.pack("<BH", 0, number) + name.encode()) for number, name in enumerate(layouts)]
    path.write_bytes(b"".join(head) + joined(rows))


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _info(name: str, text: str) -> bytes:
    key = f"char[{len(text)}] {name}".encode()
    return _message("I", bytes([len(key)]) + key + text.encode())


def _data(layout: str, number: int, count: int, **values: object) -> Packed:
    """Return data messages of one layout; fields without values are zero."""
    named = [one.split(" ") for one in layout.rstrip(";").split(";")]
    size = 2 + sum(np.dtype(_KINDS[kind]).itemsize for kind, _name in named)
    fields = [(name, _KINDS[kind], values.get(name, 0)) for kind, name in named]
    return records(count, ("size", "<u2", size), ("type", "u1", ord("D")), ("id", "<u2", number), *fields)


def _imu(flight: ImuFlight, stamp_us: Int64Array, number: int) -> Packed:
    interval_us = np.rint(flight.interval_s * 1e6)
    return _data(
        IMU,
        number,
        len(stamp_us),
        timestamp=stamp_us,
        timestamp_sample=stamp_us,
        accel_device_id=1,
        gyro_device_id=1,
        delta_angle=flight.delta_angle_rad,
        delta_velocity=flight.delta_velocity_mps,
        delta_angle_dt=interval_us,
        delta_velocity_dt=interval_us,
    )


def _samples(layout: str, stamp_us: Int64Array, values: np.ndarray, number: int) -> Packed:
    return _data(layout, number, len(stamp_us), timestamp=stamp_us, timestamp_sample=stamp_us, xyz=values)


def _air(flight: ImuFlight, number: int) -> tuple[Int64Array, Packed]:
    stamp_us = BOOT_US + nanoseconds(flight.aids.baro_s) // 1000
    altitude_m = flight.aids.pressure_altitude_m
    stamps = {"timestamp": stamp_us, "timestamp_sample": stamp_us}
    found = _data(
        AIR, number, len(stamp_us), **stamps, baro_alt_meter=altitude_m, baro_pressure_pa=pressure_pa(altitude_m)
    )
    return stamp_us, found


def _gps_us(flight: ImuFlight) -> Int64Array:
    return BOOT_US + nanoseconds(flight.gnss.time_s) // 1000


def _gps(flight: ImuFlight, scenario: ImuScenario, number: int) -> Packed:
    fixes, stamp_us = flight.gnss, _gps_us(flight)
    north, east, down = fixes.velocity_mps.T
    return _data(
        GPS,
        number,
        len(stamp_us),
        timestamp=stamp_us,
        latitude_deg=fixes.latitude_deg,
        longitude_deg=fixes.longitude_deg,
        altitude_msl_m=fixes.height_m,
        altitude_ellipsoid_m=fixes.height_m,
        time_utc_usec=(scenario.start_utc_ns + nanoseconds(fixes.validity_s)) // 1000,
        s_variance_m_s=fixes.velocity_sigma_mps[:, 0],
        eph=np.hypot(fixes.position_sigma_m[:, 0], fixes.position_sigma_m[:, 1]),
        epv=fixes.position_sigma_m[:, 2],
        hdop=0.8,
        vdop=1.2,
        vel_m_s=np.hypot(north, east),
        vel_n_m_s=north,
        vel_e_m_s=east,
        vel_d_m_s=down,
        cog_rad=np.arctan2(east, north),
        heading=np.nan,
        heading_offset=np.nan,
        fix_type=np.where(fixes.is_precise, FIX_RTK, FIX_3D),
        vel_ned_valid=1,
        satellites_used=16,
    )
