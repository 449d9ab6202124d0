"""Evidence of PX4's control and supplies.

Battery, links, tracking of setpoints, saturation, switches, faults, CPU.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.systems.health.evidence import Evidence, FloatArray, blank
from groundstation.systems.health.lean import between, down_of
from groundstation.systems.health.motors import at_limit, motors_of
from groundstation.systems.health.px4_topics import Topic, evidence_of, newest, topic, topics
from groundstation.tables.table import Flight

SETPOINT_OLD_S = 0.5  # one that is older is not flown to
RATE_MEAN_S = 0.25  # of rates, whose noise is no error
PWM_LOW, PWM_FULL = 800.0, 2000.0  # outputs in microseconds
STAYS = 0.9  # of the log: an output that is at its end so long is no motor
NEEDED: Mapping[str, str] = {  # flags that count in modes that need what they miss
    "angular_velocity_invalid": "mode_req_angular_velocity",
    "attitude_invalid": "mode_req_attitude",
    "local_altitude_invalid": "mode_req_local_alt",
    "local_position_invalid": "mode_req_local_position",
    "local_position_invalid_relaxed": "mode_req_local_position_relaxed",
    "global_position_invalid": "mode_req_global_position",
    "auto_mission_missing": "mode_req_mission",
    "offboard_control_signal_lost": "mode_req_offboard_signal",
    "home_position_invalid": "mode_req_home_position",
    "manual_control_signal_lost": "mode_req_manual_control",
}
ALWAYS = (  # flags that count in every mode
    *("geofence_breached", "mission_failure", "vtol_fixed_wing_system_failure", "wind_limit_exceeded"),
    *("flight_time_limit_exceeded", "navigator_failure", "fd_critical_failure", "fd_esc_arming_failure"),
    *("fd_imbalanced_prop", "fd_motor_failure"),
)
STATUS = (  # of vehicle_status, old and new
    *("failsafe", "engine_failure", "engine_failure_cmd", "mission_failure", "failure_detector_status"),
)
CHANGED = (  # topic, field, what was switched
    ("estimator_selector_status", "primary_instance", "estimator"),
    ("sensor_selection", "accel_device_id", "accelerometer"),
    ("sensor_selection", "gyro_device_id", "gyro"),
    ("vehicle_magnetometer", "device_id", "magnetometer"),
    ("vehicle_gps_position", "device_id", "GNSS receiver"),
    ("vehicle_air_data", "baro_device_id", "barometer"),
)
CHARGING = 7.0


def control_evidence(flight: Flight) -> Iterator[Evidence]:
    """Yield what the autopilot logs of its supplies, links, control and faults."""
    yield from _battery(flight)
    yield from _links(flight)
    yield from _attitude(flight)
    yield from _rates(flight)
    yield from _saturation(flight)
    yield from _switches(flight)
    yield from _faults(flight)
    yield from _timing(flight)


def _battery(flight: Flight) -> Iterator[Evidence]:
    for one in topics(flight, "battery_status"):
        name = f"battery {one.instance + 1}"
        is_there = one.values("connected") != 0.0
        remaining, warning = one.values("remaining"), one.values("warning")
        if bool((is_there & (remaining > 0.0)).any()):
            value = np.where(is_there & (remaining >= 0.0), remaining, np.nan)
            yield evidence_of("battery", "battery_remaining", name, one, "remaining", value)
        if bool((is_there & np.isfinite(warning)).any()):
            value = np.where(is_there & (warning != CHARGING), warning, np.nan)
            yield evidence_of("battery", "battery_warning", name, one, "warning", value)
        for field, quantity, unit, least in (
            ("voltage_v", "battery_v", "V", 0.0),
            ("current_a", "battery_a", "A", -1.0),
        ):
            value = np.where(is_there & (one.values(field) > least), one.values(field), np.nan)
            if bool((value > 0.0).any()):
                yield evidence_of("battery", quantity, name, one, field, value, unit)
            elif quantity == "battery_v" and one.has(field):
                why = "no voltage" if is_there.any() else "not connected"
                yield blank("battery", one.source(field), one.time_ns, f"{name} not measured ({one.name}: {why})")
    power = topic(flight, "system_power")
    if power is None:
        return
    for field in ("voltage5v_v", "voltage5V_v"):
        value = power.values(field)
        if bool((value > 0.0).any()):
            shown = np.where((value > 0.0) & (power.values("usb_connected") != 1.0), value, np.nan)
            yield evidence_of("battery", "supply_v", "", power, field, shown, "V")


def _links(flight: Flight) -> Iterator[Evidence]:
    """Yield the links; one that is lost throughout was never there."""
    for name, fields, quantity, sensor in (
        ("input_rc", ("rc_lost", "rc_failsafe"), "rc_lost", ""),
        ("vehicle_status", ("rc_signal_lost",), "rc_lost", "autopilot"),
        ("failsafe_flags", ("manual_control_signal_lost",), "rc_lost", "autopilot"),
        ("vehicle_status", ("data_link_lost", "gcs_connection_lost"), "data_link_lost", ""),
        ("failsafe_flags", ("gcs_connection_lost",), "data_link_lost", ""),
    ):
        one = topic(flight, name)
        for field in fields:
            if one is not None and one.has(field) and bool((one.values(field) == 0.0).any()):
                yield evidence_of("link", quantity, sensor or field.replace("_", " "), one, field)


def _down(quaternion: FloatArray) -> FloatArray:
    """Return the direction of down in the body, shape (n, 3).

    It has roll and pitch, and no heading.
    """
    w, x, y, z = quaternion.T
    with np.errstate(invalid="ignore", divide="ignore"):
        down = np.column_stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)])
        return np.asarray(down / np.linalg.norm(down, axis=1)[:, None])


def _attitude(flight: Flight) -> Iterator[Evidence]:
    """Yield the angle between tilt and its setpoint, where one is flown to."""
    wanted, attitude = topic(flight, "vehicle_attitude_setpoint"), topic(flight, "vehicle_attitude")
    if wanted is None or attitude is None or not attitude.has("q[0]"):
        return
    down = _down(attitude.vector("q", 4))
    if wanted.has("q_d[0]") and bool((np.abs(wanted.values("q_d[0]")) > 0.0).any()):
        asked, field = _down(wanted.vector("q_d", 4)), "q_d"
    elif wanted.has("roll_body", "pitch_body"):
        asked = down_of(np.rad2deg(wanted.values("roll_body")), np.rad2deg(wanted.values("pitch_body")))
        field = "roll_body"
    else:
        return
    asked_at = newest(wanted, asked, attitude.time_ns, SETPOINT_OLD_S)
    mode = topic(flight, "vehicle_control_mode")
    off = between(down, asked_at)
    if mode is not None and mode.has("flag_control_attitude_enabled"):
        flown = newest(mode, mode.values("flag_control_attitude_enabled"), attitude.time_ns, 2.0)
        off[flown == 0.0] = np.nan
    if np.isfinite(off).any():
        source = wanted.source(field)
        yield Evidence("tracking", "attitude_tracking_deg", "tilt", source, "deg", attitude.time_ns, off)
        yield Evidence("tracking", "attitude_lost_deg", "", source, "deg", attitude.time_ns, off)


def _rates(flight: Flight) -> Iterator[Evidence]:
    """Yield the difference between rates and their setpoints.

    It is a mean over a quarter of a second: their noise is no error.
    """
    wanted = topic(flight, "vehicle_rates_setpoint")
    found, fields = topic(flight, "vehicle_angular_velocity"), ("xyz[0]", "xyz[1]", "xyz[2]")
    if found is None or not found.has(*fields):
        found, fields = topic(flight, "vehicle_attitude", "rate_ctrl_status"), ("rollspeed", "pitchspeed", "yawspeed")
    if found is None or not found.has(*fields):
        found, fields = topic(flight, "sensor_combined"), ("gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]")
    if wanted is None or found is None or not found.has(*fields) or not wanted.has("roll", "pitch", "yaw"):
        return
    asked = np.column_stack([wanted.values(axis) for axis in ("roll", "pitch", "yaw")])
    flown = np.column_stack([found.values(field) for field in fields])
    off = np.rad2deg(_meaned(found, flown - newest(wanted, asked, found.time_ns, SETPOINT_OLD_S)))
    if np.isfinite(off).any():
        source = wanted.source("roll")
        yield Evidence("tracking", "rate_tracking_dps", "rates", source, "deg/s", found.time_ns, off)


def _meaned(one: Topic, value: FloatArray) -> FloatArray:
    """Return the length of the running mean of vectors, NaN where one is missing."""
    if len(value) < 2:
        return np.asarray(np.linalg.norm(value, axis=1))
    step_s = float(np.median(np.diff(one.time_ns))) * 1e-9
    count = max(1, round(RATE_MEAN_S / max(step_s, 1e-3)))
    summed = np.concatenate([np.zeros((1, 3)), np.cumsum(np.nan_to_num(value), axis=0)])
    last = np.arange(1, len(value) + 1)
    first = np.maximum(last - count, 0)
    mean = (summed[last] - summed[first]) / (last - first)[:, None]
    return np.where(np.isfinite(value).all(axis=1), np.linalg.norm(mean, axis=1), np.nan)


def _saturation(flight: Flight) -> Iterator[Evidence]:
    allocator = topic(flight, "control_allocator_status")
    if allocator is not None:
        for field, sensor in (("torque_setpoint_achieved", "torque"), ("thrust_setpoint_achieved", "thrust")):
            if allocator.has(field):
                missed = np.asarray(1.0 - allocator.values(field))
                yield evidence_of("saturation", "saturation", sensor, allocator, field, missed)
        return
    motors = motors_of(flight)
    if motors is not None:
        yield Evidence("saturation", "output_full", "motors", motors.source, "", motors.time_ns, at_limit(motors))
        return
    for one in topics(flight, "actuator_outputs"):
        values = one.vector("output", 8)
        is_pulse = np.nanmedian(values, axis=0) > PWM_LOW if len(values) else np.zeros(8, dtype=bool)
        moves = is_pulse & (np.nanmax(values, axis=0) > np.nanmin(values, axis=0))
        if moves.any():
            full = _at_full(values[:, moves])
            yield evidence_of("saturation", "output_full", f"outputs {one.instance}", one, "output", full)


def _at_full(values: FloatArray) -> FloatArray:
    """Tell where an output is at its end, but for those that stay there: 1 or 0, shape (n,)."""
    full = values >= PWM_FULL
    used = full.mean(axis=0) < STAYS
    return np.asarray(full[:, used].any(axis=1), dtype=np.float64)


def _switches(flight: Flight) -> Iterator[Evidence]:
    """Yield how often a source was exchanged: a counter that rises with each other number."""
    for name, field, what in CHANGED:
        one = topic(flight, name)
        if one is not None and one.has(field):
            value = one.values(field)
            known = np.flatnonzero(np.isfinite(value) & (value > 0.0 if "device" in field else True))
            changes = np.full(len(value), np.nan)
            if known.size:
                changes[known] = np.concatenate([[0.0], np.cumsum(np.diff(value[known]) != 0.0)])
                yield evidence_of("switches", "switches", what, one, field, changes)


def _faults(flight: Flight) -> Iterator[Evidence]:
    status = topic(flight, "vehicle_status")
    for field in STATUS:
        if status is not None and status.has(field):
            yield evidence_of("faults", "fault", field.replace("_", " "), status, field, np.sign(status.values(field)))
    flags = topic(flight, "failsafe_flags")
    if flags is None:
        return
    for field in ALWAYS:
        if flags.has(field):
            sensor = field.replace("fd_", "").replace("_", " ")
            yield evidence_of("faults", "fault", sensor, flags, field, np.sign(flags.values(field)))
    if flags.has("local_position_accuracy_low"):
        yield evidence_of("faults", "caution", "position accuracy low", flags, "local_position_accuracy_low")
    if status is None or not status.has("nav_state"):
        return
    mode = newest(status, status.values("nav_state"), flags.time_ns, 5.0)
    for field, needed in NEEDED.items():
        if flags.has(field, needed):
            required = flags.values(needed)
            known = np.isfinite(mode) & np.isfinite(required) & np.isfinite(flags.values(field))
            asked = np.where(known, required, 0.0).astype(np.int64) >> np.where(known, mode, 0.0).astype(np.int64) & 1
            value = np.where(known, (asked == 1) & (flags.values(field) > 0.0), np.nan)
            yield evidence_of("faults", "fault", field.replace("_", " "), flags, field, value)


def _timing(flight: Flight) -> Iterator[Evidence]:
    load = topic(flight, "cpuload")
    if load is not None and load.has("load"):
        yield evidence_of("timing", "cpu_load", "", load, "load")
    if "raw.ulog.information" not in flight and "raw.ulog.parameters" not in flight:
        return
    lost = topic(flight, "ulog.dropouts")
    end_ns = flight.start_ns + round(flight.duration_s * 1e9)
    time_ns = np.arange(flight.start_ns, end_ns + 1, 1_000_000_000, dtype=np.int64)  # nothing lost is told too
    total = np.zeros(len(time_ns))
    if lost is not None and lost.has("duration_ms"):
        time_ns = np.sort(np.concatenate([time_ns, lost.time_ns]))
        duration = np.nan_to_num(lost.values("duration_ms"))
        total = np.concatenate([[0.0], np.cumsum(duration)])[np.searchsorted(lost.time_ns, time_ns, side="right")]
    yield Evidence("timing", "dropouts_ms", "", "ULog dropouts", "ms", time_ns, total)
