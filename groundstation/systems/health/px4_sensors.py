"""Evidence of PX4's sensors.

GNSS, interference, vibration, clipping, magnetometer, IMU against IMU.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.systems.health.evidence import Evidence, FloatArray
from groundstation.systems.health.px4_estimator import is_aligned
from groundstation.systems.health.px4_topics import Topic, estimators, evidence_of, newest, topic, topics
from groundstation.tables.table import Flight

LEAST_FIX = 3.0
LEAST_ROWS = 20  # fewer samples of field and thrust show no relation
THRUST_MOVES = 0.1  # it shows nothing where thrust hardly changes
THRUSTS = (  # topic, field, sign
    ("vehicle_thrust_setpoint", "xyz[2]", -1.0),
    ("actuator_controls_0", "control[3]", 1.0),
    ("vehicle_rates_setpoint", "thrust_body[2]", -1.0),
    ("vehicle_rates_setpoint", "thrust", 1.0),
)


def sensor_evidence(flight: Flight) -> Iterator[Evidence]:
    """Yield what the sensors log of themselves."""
    receivers = list(topics(flight, "vehicle_gps_position"))  # the one that the filter is given, of several a blend
    for one in receivers or list(topics(flight, "sensor_gps")):
        yield from _gnss(one)
    yield from _vibration(flight)
    yield from _clipping(flight)
    yield from _magnetometer(flight)
    yield from _imus(flight)


def _gnss(one: Topic) -> Iterator[Evidence]:
    """Yield what a receiver claims.

    Without a fix it claims nothing, and zero is what it does not know.
    """
    name = f"GNSS {one.instance + 1}" if one.instance else "GNSS"
    fix = one.values("fix_type")
    is_fixed = ~(fix < LEAST_FIX)
    if one.has("fix_type"):
        yield evidence_of("gnss", "fix_type", name, one, "fix_type", fix)
    if one.has("satellites_used"):
        satellites = one.values("satellites_used")
        yield evidence_of(
            "gnss", "satellites", name, one, "satellites_used", np.where(satellites < 255, satellites, np.nan)
        )
    for field, quantity, unit in (
        ("hdop", "hdop", ""),
        ("s_variance_m_s", "speed_accuracy_mps", "m/s"),
        ("eph", "eph_m", "m"),
        ("epv", "epv_m", "m"),
    ):
        value = one.values(field)
        known = is_fixed & (value > 0.0)
        if known.any():
            yield evidence_of("gnss", quantity, name, one, field, np.where(known, value, np.nan), unit)
    for field, quantity in (
        ("jamming_indicator", "jamming_indicator"),
        ("jamming_state", "jamming_state"),
        ("spoofing_state", "spoofing_state"),
    ):
        value = one.values(field)
        if bool((value > 0.0).any()):
            shown = value if field == "jamming_indicator" else np.where(value > 0.0, value, np.nan)
            yield evidence_of("interference", quantity, name, one, field, shown)


def _vibration(flight: Flight) -> Iterator[Evidence]:
    """Yield the vibration metrics; up to 1.12 they are of changes in one step, in other units."""
    found = False
    for one in topics(flight, "vehicle_imu_status"):
        imu, is_new = f"IMU {one.instance}", "delta_angle_coning_metric" in one.table.columns
        if not is_new and "gyro_coning_vibration" not in one.table.columns:
            continue  # of neither era: the unit is not known
        for field, quantity, unit in (
            ("accel_vibration_metric", "accel_vibration_mps2" if is_new else "delta_velocity_vibration_mps", ""),
            ("gyro_vibration_metric", "gyro_vibration_radps" if is_new else "delta_angle_vibration_rad", ""),
            ("delta_angle_coning_metric" if is_new else "gyro_coning_vibration", "coning_rad2", ""),
        ):
            if one.has(field) and bool((one.values(field) > 0.0).any()):
                found = True
                yield evidence_of("vibration", quantity, imu, one, field, unit=unit)
    if found or not is_aligned(flight):
        return
    for one, rows in estimators(flight, "estimator_status"):
        for place, quantity in enumerate(("coning_rad2", "delta_angle_vibration_rad", "delta_velocity_vibration_mps")):
            value = np.where(rows, one.values(f"vibe[{place}]"), np.nan)
            if bool((value > 0.0).any()):
                yield evidence_of("vibration", quantity, "IMU", one, f"vibe[{place}]", value)


def _clipping(flight: Flight) -> Iterator[Evidence]:
    for one in topics(flight, "vehicle_imu_status"):
        axes = [f"accel_clipping[{axis}]" for axis in range(3)]
        if one.has(*axes):
            total = np.sum([one.values(field) for field in axes], axis=0)
            yield evidence_of("clipping", "clipping", f"IMU {one.instance}", one, "accel_clipping", total)
    for one, rows in estimators(flight, "estimator_status_flags"):
        if one.has("fs_bad_acc_clipping"):
            value = np.where(rows, one.values("fs_bad_acc_clipping"), np.nan)
            yield evidence_of("clipping", "clipping_flag", "filter", one, "fs_bad_acc_clipping", value)


def _magnetometer(flight: Flight) -> Iterator[Evidence]:
    one = topic(flight, "vehicle_magnetometer", "sensor_mag")
    if one is None:
        return
    field = "magnetometer_ga" if one.has("magnetometer_ga[0]") else "x"
    parts = one.vector(field) if field != "x" else np.column_stack([one.values(axis) for axis in "xyz"])
    length = np.linalg.norm(parts, axis=1)
    length[length == 0.0] = np.nan
    if not np.isfinite(length).any():
        return
    yield evidence_of("magnetometer", "field_length_gauss", "", one, field, length, "gauss")
    usual = float(np.nanmedian(length))
    yield evidence_of("magnetometer", "field_change", "", one, field, np.abs(length / usual - 1.0))
    thrust = _thrust(flight, one)
    if thrust is not None:
        by_thrust = _explained(length, thrust)
        if by_thrust is not None:
            yield evidence_of("magnetometer", "field_with_throttle", "", one, field, by_thrust / usual)
    for flags, rows in estimators(flight, "estimator_status_flags"):
        for flag, sensor in (("cs_mag_fault", "magnetometer fault"), ("cs_mag_field_disturbed", "field disturbed")):
            if flags.has(flag):
                value = np.where(rows, flags.values(flag), np.nan)
                yield evidence_of("magnetometer", "magnetometer_flag", sensor, flags, flag, value)


def _thrust(flight: Flight, one: Topic) -> FloatArray | None:
    for name, field, sign in THRUSTS:
        found = topic(flight, name)
        if found is not None and found.has(field):
            return newest(found, sign * found.values(field), one.time_ns)
    return None


def _explained(length: FloatArray, thrust: FloatArray) -> FloatArray | None:
    """Return by how much the field's length follows thrust, from the least thrust up.

    Least squares; None where thrust does not move.
    """
    known = np.isfinite(length) & np.isfinite(thrust) & (thrust > 0.0)
    if np.count_nonzero(known) < LEAST_ROWS or np.ptp(thrust[known]) < THRUST_MOVES:
        return None
    moved = thrust[known] - thrust[known].mean()
    slope = float(moved @ (length[known] - length[known].mean()) / (moved @ moved))
    return np.where(known, np.abs(slope) * (thrust - float(np.min(thrust[known]))), np.nan)


def _imus(flight: Flight) -> Iterator[Evidence]:
    """Yield how far each IMU is from their mean; one alone is not compared."""
    one = topic(flight, "sensors_status_imu")
    if one is not None:
        for field, ids, quantity, unit in (
            ("gyro_inconsistency_rad_s", "gyro_device_ids", "gyro_difference_radps", "rad/s"),
            ("accel_inconsistency_m_s_s", "accel_device_ids", "accel_difference_mps2", "m/s2"),
        ):
            there = [place for place in range(4) if bool((one.values(f"{ids}[{place}]") > 0.0).any())]
            for place in there if len(there) > 1 else ():
                yield evidence_of("imu", quantity, f"IMU {place}", one, f"{field}[{place}]", unit=unit)
    else:
        before = topic(flight, "sensor_preflight")  # up to 1.11; the largest difference between two
        for field, quantity, unit in (
            ("gyro_inconsistency_rad_s", "gyro_difference_radps", "rad/s"),
            ("accel_inconsistency_m_s_s", "accel_difference_mps2", "m/s2"),
        ):
            if before is not None and bool((before.values(field) > 0.0).any()):
                yield evidence_of("imu", quantity, "largest", before, field, unit=unit)
    for status in topics(flight, "vehicle_imu_status"):
        for field, sensor in (("accel_error_count", "accelerometer"), ("gyro_error_count", "gyro")):
            if status.has(field):
                name = f"{sensor} {status.instance}"
                yield evidence_of("imu", "sensor_errors", name, status, field)
