"""Evidence of an ArduPilot's sensors, and of its timing.

Source: ArduPilot, AP_Logger/LogStructure.h of all versions from 2013 to 4.7.0-dev of 2025-10-24; u-blox 8 / M8 receiver
description, UBX-MON-HW (jamInd 0 to 255).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S, NT_PER_GAUSS
from groundstation.systems.health.evidence import Event, Evidence
from groundstation.systems.health.logged import (
    FloatArray,
    Logged,
    Series,
    changes,
    counted,
    instances,
    is_integer,
    is_number,
    latest,
    length,
    low_pass,
    mean_over,
    named,
    nearest,
)
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight, Table

UNKNOWN_ACCURACY_M = 655.0  # the largest that fits: the receiver tells none
UNKNOWN_HDOP = 99.0  # 99.99: the receiver tells none
GYRO, ACCEL = ("GyrX", "GyrY", "GyrZ"), ("AccX", "AccY", "AccZ")
FORWARD = ("field_forward_nt", "field_right_nt", "field_down_nt")
GYRO_MEAN_S, ACCEL_CONSTANT_S, LONGEST_STEP_S = 2.0, 5.0, 0.1
LEAST_RANGE = 0.2  # of throttle, of its full scale: with less it shows no interference
LEAST_ROWS = 20


def gnss(flight: Flight) -> Iterator[Evidence]:
    """Yield the evidence of receivers that any autopilot logs, from the canonical topics."""
    for number, topic in enumerate(topics_of_kind("gnss", flight.topics()), start=1):
        table, sensor = flight[topic], f"GNSS {number}"
        for field, quantity, unit in (
            ("satellites_used", "satellites", ""),
            ("hdop", "hdop", ""),
            ("velocity_sigma_mps", "speed_accuracy_mps", "m/s"),
        ):
            if table.has(field):
                value = table.values(field)
                if field == "hdop":
                    value = np.where(value >= UNKNOWN_HDOP, np.nan, value)
                source = f"{topic}.{field}"
                yield Evidence("gnss", quantity, sensor, source, unit, table.time_ns, value, number - 1)


def receivers(flight: Flight) -> Iterator[Evidence]:
    """Yield the kind of fix, claimed accuracies and interference of each receiver."""
    for table, instance in instances(flight, "GPS", "GPS2"):
        if is_number(table, "Status"):
            yield _of("gnss", "fix_type", f"GNSS {instance + 1}", table, "Status", "", instance)
    for table, instance in instances(flight, "GPA", "GPA2"):
        for field, quantity in (("HAcc", "eph_m"), ("VAcc", "epv_m")):
            if is_number(table, field) and np.any(table.values(field) > 0.0):
                value = np.where(table.values(field) < UNKNOWN_ACCURACY_M, table.values(field), np.nan)
                source, sensor = f"{table.topic}.{field}", f"GNSS {instance + 1}"
                yield Evidence("gnss", quantity, sensor, source, "m", table.time_ns, value, instance)
    for table, instance in instances(flight, "UBX3"):  # of 2014; GPA holds them since
        for field, quantity, unit in (
            ("hAcc", "eph_m", "m"),
            ("vAcc", "epv_m", "m"),
            ("sAcc", "speed_accuracy_mps", "m/s"),
        ):
            if is_number(table, field):
                yield _of("gnss", quantity, f"GNSS {instance + 1}", table, field, unit, instance)
    for table, instance in instances(flight, "UBX1"):
        noise = named(table, "noisePerMS")
        is_monitored = not noise or np.any(table.values(noise) > 0.0)  # zeros: the receiver has no such message
        if is_number(table, "jamInd") and is_monitored:
            yield _of("interference", "jamming_indicator", f"GNSS {instance + 1}", table, "jamInd", "", instance)


def receiver_switches(flight: Flight) -> Iterator[Evidence]:
    """Yield how often the receiver in use has changed, where there are several."""
    used = [one for one in instances(flight, "GPS", "GPS2") if is_number(one.table, "U")]
    if len(used) > 1:
        table = used[0].table
        count = counted(Series(table.time_ns, table.values("U")))
        yield Evidence("switches", "switches", "GNSS receiver", f"{table.topic}.U", "", table.time_ns, count)


def receiver_events(flight: Flight) -> Iterator[Event]:
    """Yield changes of the receiver in use (GPS.U)."""
    for table, instance in instances(flight, "GPS", "GPS2"):
        if is_number(table, "U"):
            used = Series(table.time_ns, table.values("U"))
            for row in changes(used):
                if used.value[row]:
                    text = f"GNSS {instance + 1} is in use from here on"
                    yield Event("switches", int(table.time_ns[row]), "warn", text, f"{table.topic}.U")


def vibration(flight: Flight) -> Iterator[Evidence]:
    """Yield vibration of each axis, and the counters of clipped samples."""
    parameters = parameters_of(flight)
    for table, instance in instances(flight, "VIBE"):
        if is_off(parameters, "INS_USE", instance):
            continue
        for axis in "XYZ":
            if is_number(table, f"Vibe{axis}"):
                sensor = f"IMU {instance + 1} {axis.lower()}"
                yield _of("vibration", "vibration_mps2", sensor, table, f"Vibe{axis}", "m/s2", instance)
        if is_number(table, "Clip"):
            yield _of("clipping", "clipping", f"IMU {instance + 1}", table, "Clip", "", instance)
        for other in range(3):
            if is_number(table, f"Clip{other}") and not is_off(parameters, "INS_USE", other):
                yield _of("clipping", "clipping", f"IMU {other + 1}", table, f"Clip{other}", "", other)


def magnetometers(flight: Flight) -> Iterator[Evidence]:
    """Yield length and change of the field, offsets, and what the throttle adds to it."""
    power, name, full = throttle(flight)
    parameters = parameters_of(flight)
    for number, topic in enumerate(topics_of_kind("magnetometer", flight.topics()), start=1):
        table, sensor = flight[topic], f"magnetometer {number}"
        if not table.has(*FORWARD) or is_off(parameters, "COMPASS_USE", number - 1):
            continue
        field = length(table, FORWARD) / NT_PER_GAUSS
        field = np.where(field > 0.0, field, np.nan)
        if np.count_nonzero(np.isfinite(field)) < LEAST_ROWS:
            continue
        usual = float(np.nanmedian(field))
        source = f"{topic}, length of the field"
        yield Evidence("magnetometer", "field_length_gauss", sensor, source, "gauss", table.time_ns, field, number - 1)
        change = np.abs(field / usual - 1.0)
        yield Evidence("magnetometer", "field_change", sensor, source, "", table.time_ns, change, number - 1)
        made = _by_throttle(Series(table.time_ns, field), power, full, usual)
        if made is not None:
            source = f"{topic} against {name}"
            yield Evidence("magnetometer", "field_with_throttle", sensor, source, "", table.time_ns, made, number - 1)
    for table, instance in instances(flight, "MAG", "MAG2", "MAG3"):
        offsets = ("OfsX", "OfsY", "OfsZ")
        if is_number(table, *offsets) and not is_off(parameters, "COMPASS_USE", instance):
            source = f"{table.topic}.{', '.join(offsets)}"
            value = length(table, offsets) * _milligauss(table)
            sensor = f"magnetometer {instance + 1}"
            yield Evidence("magnetometer", "compass_offset", sensor, source, "mgauss", table.time_ns, value, instance)


def is_off(parameters: Parameters, name: str, instance: int) -> bool:
    """Tell whether a sensor is switched off in the parameters: it concerns nobody."""
    return parameters.value(name + ("" if instance == 0 else f"{instance + 1}")) == 0.0


def _milligauss(table: Table) -> float:
    """Return the factor to milligauss: 1000 where a log has gauss.

    No compass measures a field below 2 mG.
    """
    field = np.abs(table.values("MagX")) if is_number(table, "MagX") else np.zeros(1)
    return 1.0 if is_integer(table, "OfsX") or np.nanmax(field, initial=0.0) > 2.0 else 1000.0


def throttle(flight: Flight) -> tuple[Series, str, float]:
    """Return throttle or current along time, its field, and the value that counts as full.

    Copters logged throttle in thousandths (to 3.2), then as a share; planes in per cent. A current has no full scale:
    its own range counts.
    """
    for name in ("CTUN", "CURR"):
        topic = f"raw.{name}"
        if topic not in flight:
            continue
        table = flight[topic]
        field = named(table, "ThO", "ThrOut", "Thr", "Throttle")
        if field:
            value = table.values(field)
            most = float(np.nanmax(value, initial=0.0))
            full = 1.0 if most <= 1.5 and not is_integer(table, field) else 100.0 if most <= 150.0 else 1000.0
            return Series(table.time_ns, value), f"{name}.{field}", full
    if "raw.VFR_HUD" in flight and is_number(flight["raw.VFR_HUD"], "throttle"):
        table = flight["raw.VFR_HUD"]
        return Series(table.time_ns, table.values("throttle")), "VFR_HUD.throttle", 100.0
    for table, _ in instances(flight, "BAT", "BAT2"):
        if is_number(table, "Curr") and np.any(table.values("Curr") > 0.0):
            value = table.values("Curr")
            return Series(table.time_ns, value), f"{table.topic}.Curr", float(np.nanmax(value))
    return Series(np.zeros(0, dtype=np.int64), np.zeros(0)), "", 1.0


def _by_throttle(field: Series, power: Series, full: float, usual: float) -> FloatArray | None:
    """Return what throttle adds to the field, as a share of the field at idle, along time.

    It is the slope of a straight line.

    None where the throttle hardly moved, or where the line explains less than a tenth of the variance: then nothing is
    said, neither good nor bad, of a field that something else changed.
    """
    if not len(power.time_ns) or not full > 0.0:
        return None
    share = latest(power, field.time_ns) / full
    known = np.isfinite(share) & np.isfinite(field.value)
    if np.count_nonzero(known) < LEAST_ROWS:
        return None
    low, high = np.quantile(share[known], (0.05, 0.95))
    if high - low < LEAST_RANGE:
        return None
    x, y = share[known] - share[known].mean(), field.value[known] - field.value[known].mean()
    slope = float(x @ y / (x @ x))
    explained = slope * float(x @ y) / max(float(y @ y), 1e-30)
    if explained < 0.1 and np.std(y) > 0.05 * usual:
        return None
    idle = float(field.value[known].mean() + slope * (low - share[known].mean()))
    return np.asarray(np.abs(slope * (share - low)) / max(idle, 0.1 * usual))


def inertial(flight: Flight) -> Iterator[Evidence]:
    """Yield differences of gyros and accelerometers, and units that call themselves unhealthy."""
    parameters = parameters_of(flight)
    logged = instances(flight, "IMU", "IMU2", "IMU3")
    every = [one for one in logged if not is_off(parameters, "INS_USE", one.instance)]
    for table, instance in every:
        health = [name for name in ("GH", "AH", "GyHlt", "AcHlt") if is_number(table, name)]
        if health:
            bad = 1.0 - np.min(np.stack([table.values(name) for name in health]), axis=0).clip(0.0, 1.0)
            source = f"{table.topic}.{', '.join(health)}"
            yield Evidence("imu", "imu_unhealthy", f"IMU {instance + 1}", source, "", table.time_ns, bad, instance)
        for fields, sensor in ((("EG", "ErrG"), "gyro"), (("EA", "ErrA"), "accelerometer")):
            field = named(table, *fields)
            if field:
                yield _of("imu", "sensor_errors", f"IMU {instance + 1} {sensor}", table, field, "", instance)
    for other in every[1:]:
        yield from _against(every[0], other)


def _against(first: Logged, other: Logged) -> Iterator[Evidence]:
    table, second = first.table, other.table
    place, is_near = nearest(table.time_ns, second.time_ns, LONGEST_STEP_S)
    time_s = (table.time_ns - table.time_ns[0]) / NS_PER_S
    sensor, source = (
        f"IMU {other.instance + 1} against IMU {first.instance + 1}",
        f"{second.topic} against {table.topic}",
    )
    if is_number(table, *GYRO) and is_number(second, *GYRO):
        apart = _apart(table, second, GYRO, place, is_near)
        value = np.max(np.abs(mean_over(time_s, apart, GYRO_MEAN_S)), axis=1)
        yield Evidence("imu", "gyro_difference_radps", sensor, source, "rad/s", table.time_ns, value, other.instance)
    if is_number(table, *ACCEL) and is_number(second, *ACCEL):
        apart = _apart(table, second, ACCEL, place, is_near)
        value = np.linalg.norm(low_pass(time_s, apart, ACCEL_CONSTANT_S, LONGEST_STEP_S), axis=1)
        yield Evidence("imu", "accel_difference_mps2", sensor, source, "m/s2", table.time_ns, value, other.instance)


def _apart(
    table: Table, other: Table, names: tuple[str, ...], place: NDArray[np.intp], is_near: BoolArray
) -> FloatArray:
    apart = np.stack([table.values(name) - other.values(name)[place] for name in names], axis=1)
    return np.where(is_near[:, None], apart, np.nan)


def timing(flight: Flight) -> Iterator[Evidence]:
    """Yield slow loops, load of the processor, errors of buses, and records dropped."""
    for table, _ in instances(flight, "PM"):
        loops = named(table, "NLoop", "NL")
        if loops and is_number(table, "NLon"):
            count = table.values(loops)
            slow = table.values("NLon") / np.where(count > 0.0, count, np.nan)
            source = f"{table.topic}.NLon / {loops}"
            yield Evidence("timing", "slow_loops", "main loop", source, "", table.time_ns, slow)
        if is_number(table, "Load") and np.any(table.values("Load") > 0.0):
            load = table.values("Load") / 1000.0
            yield Evidence("timing", "cpu_load", "processor", f"{table.topic}.Load", "", table.time_ns, load)
        for field, sensor in (("I2CErr", "I2C bus"), ("INSErr", "inertial sensors")):
            if is_number(table, field):
                yield _of("imu", "sensor_errors", sensor, table, field)
        field = named(table, "IntE", "IntErr", "InE")
        if field:
            is_set = (table.values(field) != 0.0).astype(np.float64)
            yield Evidence("faults", "fault", "internal errors", f"{table.topic}.{field}", "", table.time_ns, is_set)
    for table, _ in instances(flight, "DSF"):
        if is_number(table, "Dp"):
            yield _of("timing", "dropped_records", "log", table, "Dp")


def supply(source: str, time_ns: Int64Array, volt: FloatArray) -> Iterator[Evidence]:
    """Yield the supply of the board, and how far it has swung so far."""
    yield Evidence("battery", "supply_v", "", source, "V", time_ns, volt)
    swing = np.fmax.accumulate(volt) - np.fmin.accumulate(volt)
    yield Evidence("battery", "supply_swing_v", "", source, "V", time_ns, swing)


def _of(
    check: str, quantity: str, sensor: str, table: Table, field: str, unit: str = "", instance: int | None = None
) -> Evidence:
    source = f"{table.topic}.{field}"
    return Evidence(check, quantity, sensor, source, unit, table.time_ns, table.values(field), instance)
