"""Raw inertial units of PX4: topic ``imu`` from the messages that hold it, best first."""

from collections.abc import Callable

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.units import DEG_PER_RAD
from groundstation.readers import imu
from groundstation.readers.mapping import Columns, NumericColumns, Role, SourceRule
from groundstation.readers.ulog.canonical import NOT_THERE, SAMPLED, vector_of

_S_PER_US = 1e-6


def vehicle_imu(rows: NumericColumns) -> Columns:
    """Return the increments of one unit, and how many axes were clipped.

    Its intervals are in microseconds.
    """
    angles, velocities = ([rows[f"{name}[{k}]"] for k in range(3)] for name in ("delta_angle", "delta_velocity"))
    if "dt" in rows:  # betas of PX4 1.11
        columns = imu.increments(angles, velocities, rows["dt"] * _S_PER_US)
    else:
        intervals = (rows[f"{name}_dt"] * _S_PER_US for name in ("delta_angle", "delta_velocity"))
        columns = imu.increments(angles, velocities, *intervals)
    return columns | _clipping(rows, ("delta_angle_clipping",), ("delta_velocity_clipping", "clipping"))


def sensor_combined(rows: NumericColumns) -> Columns:
    """Return the increments of the sensors in use.

    They are mean rates and specific forces times their own integration times.
    """
    gyro_s, accelerometer_s = (_integration_s(rows[f"{name}_integral_dt"]) for name in ("gyro", "accelerometer"))
    mark = "accelerometer_timestamp_relative"
    angles = [rows[f"gyro_rad[{k}]"] * gyro_s for k in range(3)]
    velocities = [rows[f"accelerometer_m_s2[{k}]"] * accelerometer_s for k in range(3)]
    is_there = rows[mark] != NOT_THERE if mark in rows else None
    columns = imu.increments(angles, velocities, gyro_s, accelerometer_s, has_velocity=is_there)
    return columns | _clipping(rows, ("gyro_clipping",), ("accelerometer_clipping",))


def _integration_s(times: FloatArray) -> FloatArray:
    """Return integration times in seconds; from PX4 1.6 on they are logged in microseconds."""
    with np.errstate(invalid="ignore"):
        return np.where(times < 1.0, times, times * _S_PER_US)


def _clipping(rows: NumericColumns, *sources: tuple[str, ...]) -> Columns:
    found: Columns = {}
    for field, names in zip(("gyro_clipping", "accel_clipping"), sources, strict=True):
        logged = next((name for name in names if name in rows), None)
        if logged is not None:
            found[field] = imu.bits(rows[logged])
    return found


def _imu_samples(fields: tuple[str, ...], factor: float) -> Callable[[NumericColumns], Columns]:
    plain = vector_of(fields, "xyz", factor)  # type: ignore[arg-type]
    return lambda rows: imu.samples(plain(rows))


_THREE = range(3)
_VEHICLE_IMU = (
    *(f"delta_angle[{k}]" for k in _THREE),
    *(f"delta_velocity[{k}]" for k in _THREE),
)
_INTERVALS = (("delta_angle_dt", "delta_velocity_dt"), ("dt",))
_COMBINED = (
    *(f"gyro_rad[{k}]" for k in _THREE),
    *(f"accelerometer_m_s2[{k}]" for k in _THREE),
    *("gyro_integral_dt", "accelerometer_integral_dt"),
)
_XYZ = tuple(f"xyz[{k}]" for k in _THREE)
_COMBINED_TEXT = "mean rate and specific force of sensor_combined, times their own integration times"
# Sources of `imu`, best first: the roles of each. Which has enough of the records is told by their counts.
IMU_ROLES: tuple[tuple[Role, ...], ...] = (
    (
        Role(
            "imu",
            tuple(
                SourceRule("vehicle_imu", (*_VEHICLE_IMU, *needed), vehicle_imu, sampled=SAMPLED)
                for needed in _INTERVALS
            ),
            has_instances=True,
        ),
    ),
    (
        Role(
            "imu",
            (
                SourceRule(
                    "sensor_combined",
                    _COMBINED,
                    sensor_combined,
                    dict.fromkeys((*imu.ANGLES, *imu.VELOCITIES), _COMBINED_TEXT),
                ),
            ),
        ),
    ),
    tuple(
        Role(
            "imu",
            (
                SourceRule(
                    source, _XYZ, _imu_samples(fields, factor), dict.fromkeys(fields, imu.POINT_SAMPLES), SAMPLED
                ),
            ),
        )
        for source, fields, factor in (
            ("vehicle_angular_velocity", imu.RATES, DEG_PER_RAD),
            ("vehicle_acceleration", imu.ACCELERATIONS, 1.0),
        )
    ),
)
