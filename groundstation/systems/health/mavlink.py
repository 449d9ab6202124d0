"""Evidence of health in telemetry (tlog), of ArduPilot and of PX4.

EKF_STATUS_REPORT of ArduPilot has square roots of test ratios under the name of variances; ESTIMATOR_STATUS of PX4 the
ratios. Messages without a time of their own come late by what the radio held them up: setpoints are not set against the
attitude, nor inertial units against each other.

Source: MAVLink common.xml and ardupilotmega.xml as of pymavlink 2.4; ArduPilot GCS_MAVLink, 4.7.0-dev of 2025-10-24.
"""

import re
from collections.abc import Iterator

import numpy as np

from groundstation.base.ardupilot_codes import MODES
from groundstation.base.units import NS_PER_S
from groundstation.systems.health import ardupilot_sensors
from groundstation.systems.health.ardupilot_control import STEPS_PER_DB, used, voltage
from groundstation.systems.health.evidence import ZERO, Event, Evidence, blank
from groundstation.systems.health.logged import Series, bit, changes, is_number
from groundstation.systems.health.messages import texts
from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight, Table

LINK_LOST_S = 5.0  # without a heartbeat, which comes once a second
LEAST_HEARTBEATS = 5
UNKNOWN_8, UNKNOWN_16 = 255.0, 65_535.0
PX4 = 12.0
_ROOTS = (
    ("velocity_variance", "GNSS velocity"),
    ("pos_horiz_variance", "GNSS position"),
    ("pos_vert_variance", "height"),
    ("compass_variance", "magnetic field"),
    ("airspeed_variance", "airspeed"),
)
_RATIOS = (
    ("vel_ratio", "GNSS velocity"),
    ("pos_horiz_ratio", "GNSS position"),
    ("pos_vert_ratio", "height"),
    ("mag_ratio", "magnetic field"),
    ("tas_ratio", "airspeed"),
)
_EKF_FLAGS = ((15, "GNSS glitch, said by the filter"), (7, "no position aiding"), (10, "filter not initialised"))
_ESTIMATOR_FLAGS = ((10, "GNSS glitch, said by the filter"), (7, "no position aiding"), (11, "accelerometer error"))
_SENSORS = {  # bits of SYS_STATUS
    0: "gyro",
    1: "accelerometer",
    2: "magnetometer",
    3: "barometer",
    4: "airspeed",
    5: "GNSS",
    6: "optical flow",
    15: "motor outputs",
    16: "remote control",
    17: "second gyro",
    18: "second accelerometer",
    19: "second magnetometer",
    20: "geofence",
    21: "AHRS",
    24: "logging",
    25: "battery",
    30: "propulsion",
}
_BAD_STATES = {5.0: "critical", 6.0: "emergency", 8.0: "termination"}
_COPTERS, _ROVERS, _SUBS = (2.0, 3.0, 4.0, 13.0, 14.0, 15.0, 29.0, 35.0), (10.0, 11.0), (12.0,)
_PX4_MODES = {1: "Manual", 2: "Altitude", 3: "Position", 4: "Auto", 5: "Acro", 6: "Offboard", 7: "Stabilized"}
_PX4_AUTO = {
    1: "Ready",
    2: "Take-off",
    3: "Hold",
    4: "Mission",
    5: "Return",
    6: "Land",
    8: "Follow",
    9: "Precision land",
}


def applies(flight: Flight) -> bool:
    """Tell whether a flight is from telemetry of a vehicle."""
    return "raw.HEARTBEAT" in flight and is_number(flight["raw.HEARTBEAT"], "base_mode")


def evidence(flight: Flight) -> tuple[Evidence, ...]:
    """Return what was told of the aircraft's health."""
    parts = (
        *(_filter, ardupilot_sensors.gnss, _receivers, _vibration, ardupilot_sensors.magnetometers),
        *(_offsets, _states, _battery, _radio, _link),
    )
    return tuple(one for of_kind in parts for one in of_kind(flight) if len(one.time_ns))


def events(flight: Flight) -> tuple[Event, ...]:
    """Return what happened, in order of time."""
    return tuple(sorted((*texts(flight), *_modes(flight)), key=lambda one: one.time_ns))


def _table(flight: Flight, name: str) -> Table | None:
    topic = f"raw.{name}"
    return flight[topic] if topic in flight and len(flight[topic]) else None


def _is_px4(flight: Flight) -> bool:
    table = flight["raw.HEARTBEAT"]
    return is_number(table, "autopilot") and bool(np.nanmedian(table.values("autopilot")) == PX4)


def _filter(flight: Flight) -> Iterator[Evidence]:
    """Yield innovations of the filter.

    A ratio that is zero throughout is of a sensor that was never fused; a message that is, of no filter.
    """
    for name, quantity, fields, flags in (
        ("EKF_STATUS_REPORT", "test_ratio_root", _ROOTS, _EKF_FLAGS),
        ("ESTIMATOR_STATUS", "test_ratio", _RATIOS, _ESTIMATOR_FLAGS),
    ):
        table = _table(flight, name)
        if table is None:
            continue
        known = [field for field, _sensor in fields if is_number(table, field)]
        told = (*known, *(("flags",) if is_number(table, "flags") else ()))
        if known and not any(np.any(table.values(field) != 0.0) for field in told):
            yield blank("innovations", table.topic, table.time_ns, f"{name} is {ZERO}")
        for field, sensor in fields:
            if field in known and np.any(table.values(field) > 0.0):
                yield _of("innovations", quantity, sensor, table, field)
        if is_number(table, "flags") and np.any(table.values("flags") > 0.0):
            for place, sensor in flags:
                value = bit(table.values("flags"), place)
                if place == flags[0][0] or np.any(value > 0.0):
                    source = f"{table.topic}.flags"
                    yield Evidence("innovations", "filter_warning", sensor, source, "", table.time_ns, value)


def _receivers(flight: Flight) -> Iterator[Evidence]:
    """Yield the kind of fix and claimed accuracies; zero is unknown."""
    for number, name in enumerate(("GPS_RAW_INT", "GPS2_RAW")):
        table = _table(flight, name)
        if table is None:
            continue
        sensor = f"GNSS {number + 1}"
        if is_number(table, "fix_type"):
            yield _of("gnss", "fix_type", sensor, table, "fix_type", "", number)
        for field, quantity in (("h_acc", "eph_m"), ("v_acc", "epv_m")):
            if is_number(table, field) and np.any(table.values(field) > 0.0):
                value = np.where(table.values(field) > 0.0, table.values(field) * 1e-3, np.nan)
                source = f"{table.topic}.{field}"
                yield Evidence("gnss", quantity, sensor, source, "m", table.time_ns, value, number)


def _vibration(flight: Flight) -> Iterator[Evidence]:
    """Yield vibration, which PX4 sends in other units, and counters of clipped samples."""
    table = _table(flight, "VIBRATION")
    if table is None:
        return
    fields = [field for axis in "xyz" if is_number(table, field := f"vibration_{axis}") and not _is_px4(flight)]
    if fields and not any(np.any(table.values(field) != 0.0) for field in fields):
        yield blank("vibration", table.topic, table.time_ns, f"VIBRATION is {ZERO}")
    for field in fields:
        if np.any(table.values(field) != 0.0):
            yield _of("vibration", "vibration_mps2", f"IMU 1 {field[-1]}", table, field, "m/s2")
    for number in range(3):
        field = f"clipping_{number}"
        if is_number(table, field):
            yield _of("clipping", "clipping", f"IMU {number + 1}", table, field, "", number)


def _offsets(flight: Flight) -> Iterator[Evidence]:
    table = _table(flight, "SENSOR_OFFSETS")
    fields = ("mag_ofs_x", "mag_ofs_y", "mag_ofs_z")
    if table is not None and is_number(table, *fields):
        value = np.sqrt(sum(np.square(table.values(field)) for field in fields))
        source = f"{table.topic}.mag_ofs_x, y, z"
        yield Evidence("magnetometer", "compass_offset", "magnetometer 1", source, "mgauss", table.time_ns, value)


def _states(flight: Flight) -> Iterator[Evidence]:
    """Yield the state of the vehicle, sensors it calls unhealthy, and its load."""
    beat = flight["raw.HEARTBEAT"]
    if is_number(beat, "system_status"):
        bad = np.isin(beat.values("system_status"), list(_BAD_STATES)).astype(np.float64)
        source = f"{beat.topic}.system_status"
        yield Evidence("faults", "fault", "state critical or emergency", source, "", beat.time_ns, bad)
    table = _table(flight, "SYS_STATUS")
    names = [f"onboard_control_sensors_{word}" for word in ("present", "enabled", "health")]
    if table is None:
        return
    if is_number(table, *names):
        present, enabled, healthy = (table.values(name) for name in names)
        source = f"{table.topic}.{names[2]}"
        for place, sensor in _SENSORS.items():
            is_used = (bit(present, place) > 0.0) & (bit(enabled, place) > 0.0)
            bad = np.where(is_used, 1.0 - bit(healthy, place), np.nan)
            if np.any(bad > 0.0):
                yield Evidence("faults", "caution", f"{sensor} unhealthy", source, "", table.time_ns, bad)
    if is_number(table, "load") and np.any(table.values("load") > 0.0):
        value = table.values("load") / 1000.0
        yield Evidence("timing", "cpu_load", "processor", f"{table.topic}.load", "", table.time_ns, value)
    if is_number(table, "drop_rate_comm") and np.any(table.values("drop_rate_comm") > 0.0):
        value = table.values("drop_rate_comm") / 10_000.0
        source = f"{table.topic}.drop_rate_comm"
        yield Evidence("link", "packets_lost", "as the autopilot counts", source, "", table.time_ns, value)


def _battery(flight: Flight) -> Iterator[Evidence]:
    table = _table(flight, "SYS_STATUS")
    if table is not None and is_number(table, "voltage_battery"):
        milli = table.values("voltage_battery")
        volt = np.where((milli > 0.0) & (milli != UNKNOWN_16), milli * 1e-3, np.nan)
        yield from voltage(f"{table.topic}.voltage_battery", table.time_ns, volt, 0, parameters_of(flight))
        yield from used("battery_v", f"{table.topic}.voltage_battery", table.time_ns, volt, 0)
    if table is not None and is_number(table, "current_battery"):
        ampere = np.where(table.values("current_battery") >= 0.0, 0.01 * table.values("current_battery"), np.nan)
        yield from used("battery_a", f"{table.topic}.current_battery", table.time_ns, ampere, 0)
    if table is not None and is_number(table, "battery_remaining"):
        left = table.values("battery_remaining")
        left = np.where(left >= 0.0, left / 100.0, np.nan)
        if np.isfinite(left).any():
            source = f"{table.topic}.battery_remaining"
            yield Evidence("battery", "battery_remaining", "battery 1", source, "", table.time_ns, left)
    for name in ("POWER_STATUS", "HWSTATUS"):
        supply = _table(flight, name)
        if supply is not None and is_number(supply, "Vcc") and np.any(supply.values("Vcc") > 0.0):
            volt = np.where(supply.values("Vcc") > 0.0, supply.values("Vcc") * 1e-3, np.nan)
            yield from ardupilot_sensors.supply(f"{supply.topic}.Vcc", supply.time_ns, volt)
            return


def _radio(flight: Flight) -> Iterator[Evidence]:
    """Yield the fade margin of the radio, and the remote control's signal.

    The radio tells it under a number of its own.
    """
    pattern = re.compile(r"raw\.RADIO(?:_STATUS)?(?:\.\d+_\d+)?")
    for topic in flight.topics():
        if not pattern.fullmatch(topic):
            continue
        table = flight[topic]
        for signal, noise, sensor in (("rssi", "noise", "radio, ground"), ("remrssi", "remnoise", "radio, aircraft")):
            if is_number(table, signal, noise):
                level, floor = table.values(signal), table.values(noise)
                known = (level > 0.0) & (level < UNKNOWN_8) & (floor < UNKNOWN_8)
                margin = np.where(known, (level - floor) / STEPS_PER_DB, np.nan)
                source = f"{topic}.{signal} - {noise}"
                yield Evidence("link", "radio_margin_db", sensor, source, "dB", table.time_ns, margin)
    for name in ("RC_CHANNELS", "RC_CHANNELS_RAW"):
        control = _table(flight, name)
        if control is not None and is_number(control, "rssi"):
            value = control.values("rssi")
            value = np.where(value < UNKNOWN_8, value / 254.0, np.nan)
            if np.any(value > 0.0):
                source = f"{control.topic}.rssi"
                yield Evidence("link", "rc_rssi", "remote control", source, "", control.time_ns, value)
                return


def _link(flight: Flight) -> Iterator[Evidence]:
    """Yield, once a second, whether no heartbeat had come for five seconds."""
    beats = flight["raw.HEARTBEAT"].time_ns
    if len(beats) < LEAST_HEARTBEATS:
        return
    step_ns = int(NS_PER_S)
    time_ns = np.arange(int(beats[0]), int(beats[-1]) + 1, step_ns, dtype=np.int64)
    before = beats[np.searchsorted(beats, time_ns, side="right") - 1]
    lost = ((time_ns - before) / NS_PER_S > LINK_LOST_S).astype(np.float64)
    yield Evidence("link", "data_link_lost", "telemetry", "raw.HEARTBEAT, none for 5 s", "", time_ns, lost)


def _modes(flight: Flight) -> Iterator[Event]:
    """Yield changes of mode, arming and state."""
    table = flight["raw.HEARTBEAT"]
    if is_number(table, "custom_mode"):
        mode = Series(table.time_ns, table.values("custom_mode"))
        for row in (*np.flatnonzero(np.isfinite(mode.value))[:1], *changes(mode)):
            text = f"mode {_mode_name(flight, int(mode.value[row]))}"
            yield Event("modes", int(table.time_ns[row]), "info", text, f"{table.topic}.custom_mode")
    armed = Series(table.time_ns, bit(table.values("base_mode"), 7))
    for row in (*np.flatnonzero(np.isfinite(armed.value))[:1], *changes(armed)):
        text = "armed" if armed.value[row] else "disarmed"
        yield Event("modes", int(table.time_ns[row]), "info", text, f"{table.topic}.base_mode")
    if is_number(table, "system_status"):
        state = Series(table.time_ns, table.values("system_status"))
        for row in changes(state):
            if state.value[row] in _BAD_STATES:
                text = f"state {_BAD_STATES[float(state.value[row])]}"
                yield Event("faults", int(table.time_ns[row]), "fail", text, f"{table.topic}.system_status")


def _mode_name(flight: Flight, number: int) -> str:
    table = flight["raw.HEARTBEAT"]
    if _is_px4(flight):
        main, sub = (number >> 16) & 0xFF, (number >> 24) & 0xFF
        name = _PX4_MODES.get(main, f"{main}")
        return f"{name}, {_PX4_AUTO.get(sub, sub)}" if main == 4 and sub else name
    kind = float(np.nanmedian(table.values("type"))) if is_number(table, "type") else 0.0
    vehicle = "ArduPlane"
    for kinds, name in ((_COPTERS, "ArduCopter"), (_ROVERS, "ArduRover"), (_SUBS, "ArduSub")):
        vehicle = name if kind in kinds else vehicle
    names = MODES[vehicle]
    return names[number] if 0 <= number < len(names) and names[number] else str(number)


def _of(
    check: str, quantity: str, sensor: str, table: Table, field: str, unit: str = "", instance: int | None = None
) -> Evidence:
    source = f"{table.topic}.{field}"
    return Evidence(check, quantity, sensor, source, unit, table.time_ns, table.values(field), instance)
