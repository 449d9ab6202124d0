"""Evidence of an ArduPilot's power, links and control.

Source: ArduPilot, AP_Logger/LogStructure.h of all versions from 2013 to 4.7.0-dev of 2025-10-24 (CURR: hundredths of
volt and ampere in integers until 3.3, Vcc in millivolts); SERVOn_FUNCTION of AP SRV_Channel.h; wiki, telemetry radios:
RSSI and noise in steps of 1.9 per dB.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.ardupilot_sensors import supply
from groundstation.systems.health.evidence import Evidence, blank
from groundstation.systems.health.lean import between, down_of
from groundstation.systems.health.logged import (
    FloatArray,
    Series,
    bit,
    instances,
    is_integer,
    is_number,
    lasting,
    latest,
    named,
)
from groundstation.systems.health.motors import FULL, OUTPUTS, at_limit, motors_of
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight

LOW_AFTER_S = 10.0  # BATT_LOW_TIMER
LEAST_VOLT = 2.0  # a battery that is never above it is none
STEPS_PER_DB = 1.9
# Modes without a setpoint of attitude: MANUAL, TRAINING, ACRO, INITIALISING, QACRO of planes; ACRO, FLIP of copters.
FREE = {"plane": (0.0, 3.0, 4.0, 16.0, 23.0), "copter": (1.0, 14.0)}
SURFACES = (4, 19, 21, 24, 25, 77, 78, 79, 80, 86, 87)
DEFAULT_CAPACITY_MAH = 3300.0


def battery(flight: Flight) -> Iterator[Evidence]:
    """Yield the battery's state by the log's own limits, its charge, the board's supply."""
    parameters = parameters_of(flight)
    for table, instance in instances(flight, "BAT", "BAT2") or instances(flight, "CURR", "CUR2"):
        field = named(table, "Volt")
        if field:
            volt = table.values(field) * (0.01 if is_integer(table, field) else 1.0)
            yield from voltage(f"{table.topic}.{field}", table.time_ns, volt, instance, parameters)
            yield from used("battery_v", f"{table.topic}.{field}", table.time_ns, volt, instance)
        field = named(table, "Curr")
        if field:
            ampere = table.values(field) * (0.01 if is_integer(table, field) else 1.0)
            yield from used("battery_a", f"{table.topic}.{field}", table.time_ns, ampere, instance)
        if is_number(table, "RemPct") and parameters.value(_prefix(instance) + "CAPACITY") != DEFAULT_CAPACITY_MAH:
            left = table.values("RemPct")
            left = np.where(left <= 100.0, left / 100.0, np.nan)
            source = f"{table.topic}.RemPct"
            yield Evidence("battery", "battery_remaining", f"battery {instance + 1}", source, "", table.time_ns, left)
    for name in ("POWR", "CURR"):
        topic = f"raw.{name}"
        if topic in flight and is_number(flight[topic], "Vcc"):
            table = flight[topic]
            volt = table.values("Vcc")
            volt = np.where(volt > 0.0, volt * (0.001 if np.nanmedian(volt) > 100.0 else 1.0), np.nan)
            if np.isfinite(volt).any():
                yield from supply(f"{topic}.Vcc", table.time_ns, volt)
                return


def used(quantity: str, source: str, time_ns: Int64Array, value: FloatArray, instance: int) -> Iterator[Evidence]:
    """Yield voltage or current of a battery as it is.

    A battery of a few volts is none, and one without any voltage not measured; one without current tells none.
    """
    is_volt, name = quantity == "battery_v", f"battery {instance + 1}"
    known = value[np.isfinite(value)]
    if is_volt and len(time_ns) and not np.any(known > LEAST_VOLT):
        most = known.max(initial=0.0)
        told = "no voltage" if not most > 0.0 else f"at most {most:.1f} V"
        yield blank("battery", source, time_ns, f"{name} not measured ({source.removeprefix('raw.')}: {told})")
    value = np.where(value > (LEAST_VOLT if is_volt else -1.0), value, np.nan)
    if np.any(value > 0.0):
        yield Evidence("battery", quantity, name, source, "V" if is_volt else "A", time_ns, value, instance)


def _prefix(instance: int) -> str:
    return "BATT_" if instance == 0 else f"BATT{instance + 1}_"


def voltage(
    source: str, time_ns: Int64Array, volt: FloatArray, instance: int, parameters: Parameters
) -> Iterator[Evidence]:
    """Yield 1 where the voltage stays below the low limit, 2 below the critical one.

    Without a limit in the log nothing is said: the number of cells is not known. A battery that is below its limit all
    the time, at a few volts, is none: the aircraft was on another supply.
    """
    names = (f"{_prefix(instance)}LOW_VOLT", *(("FS_BATT_VOLTAGE", "LOW_VOLT") if instance == 0 else ()))
    low, critical = parameters.value(*names), parameters.value(f"{_prefix(instance)}CRT_VOLT")
    if not low or not np.any(volt > LEAST_VOLT):
        return
    time_s = (time_ns - time_ns[0]) / NS_PER_S
    after_s = parameters.value("BATT_LOW_TIMER") or LOW_AFTER_S
    state = lasting(time_s, volt < low, after_s).astype(np.float64)
    if critical:
        state += lasting(time_s, volt < critical, after_s)
    state = np.where(np.isfinite(volt), state, np.nan)
    told = f"{source} below {low:g} V" + (f" and {critical:g} V" if critical else "")
    yield Evidence("battery", "battery_warning", f"battery {instance + 1}", told, "", time_ns, state, instance)


def link(flight: Flight) -> Iterator[Evidence]:
    """Yield signal and failsafe of the remote control, margin of the radio, packets lost."""
    for table, _ in instances(flight, "RSSI"):
        if is_number(table, "RXRSSI") and np.any(table.values("RXRSSI") > 0.0):
            value = table.values("RXRSSI")
            yield Evidence("link", "rc_rssi", "remote control", f"{table.topic}.RXRSSI", "", table.time_ns, value)
    for table, _ in instances(flight, "RCI2"):
        if is_number(table, "Flags"):
            lost = bit(table.values("Flags"), 1)
            yield Evidence("link", "rc_lost", "remote control", f"{table.topic}.Flags", "", table.time_ns, lost)
    for table, _ in instances(flight, "RAD"):
        for signal, noise, sensor in (
            ("RSSI", "Noise", "radio, aircraft"),
            ("RemRSSI", "RemNoise", "radio, ground"),
        ):
            if is_number(table, signal, noise) and np.any(table.values(signal) > 0.0):
                margin = (table.values(signal) - table.values(noise)) / STEPS_PER_DB
                source = f"{table.topic}.{signal} - {noise}"
                yield Evidence("link", "radio_margin_db", sensor, source, "dB", table.time_ns, margin)
    for table, instance in instances(flight, "MAV"):
        if is_number(table, "rxp", "rxdp") and np.any(table.values("rxp") > 0.0):
            lost, received = _steps(table.values("rxdp")), _steps(table.values("rxp"))
            share = lost / np.where(lost + received > 0.0, lost + received, np.nan)
            source = f"{table.topic}.rxdp / (rxp + rxdp)"
            yield Evidence("link", "packets_lost", f"telemetry {instance}", source, "", table.time_ns, share, instance)


def _steps(counter: FloatArray) -> FloatArray:
    """Return by how much a counter of 16 bits rose since the row before."""
    return np.mod(np.diff(counter, prepend=counter[:1]), 65_536.0)


def tracking(flight: Flight) -> Iterator[Evidence]:
    """Yield attitude and rate against their setpoints, in modes that have one."""
    for topic, wanted, had in (
        ("raw.ATT", ("DesRoll", "DesPitch"), ("Roll", "Pitch")),
        ("raw.CTUN", ("NavRoll", "NavPitch"), ("Roll", "Pitch")),  # planes before ATT had setpoints
    ):
        if topic in flight and is_number(flight[topic], *wanted, *had):
            table = flight[topic]
            apart = [
                np.abs(wrap_180(table.values(one) - table.values(two))) for one, two in zip(wanted, had, strict=True)
            ]
            value = np.where(_is_held(flight, table.time_ns), np.max(np.stack(apart), axis=0), np.nan)
            if np.isfinite(value).any():
                source = f"{topic}.{', '.join(wanted)}"
                sensor = "roll and pitch"
                yield Evidence("tracking", "attitude_tracking_deg", sensor, source, "deg", table.time_ns, value)
                off = between(*(down_of(*(table.values(name) for name in names)) for names in (wanted, had)))
                off[np.isnan(value)] = np.nan
                yield Evidence("tracking", "attitude_lost_deg", "", source, "deg", table.time_ns, off)
            break
    if "raw.RATE" in flight and is_number(flight["raw.RATE"], "RDes", "R", "PDes", "P"):
        table = flight["raw.RATE"]
        apart = [np.abs(table.values(one) - table.values(two)) for one, two in (("RDes", "R"), ("PDes", "P"))]
        value = np.max(np.stack(apart), axis=0)
        yield Evidence("tracking", "rate_tracking_dps", "roll and pitch", "raw.RATE", "deg/s", table.time_ns, value)


def _is_held(flight: Flight, time_ns: Int64Array) -> BoolArray:
    """Tell when a mode with a setpoint of attitude was flown; always without modes."""
    if "raw.MODE" not in flight:
        return np.ones(len(time_ns), dtype=bool)
    table = flight["raw.MODE"]
    field = named(table, "ModeNum", "Mode")
    if not field:
        return np.ones(len(time_ns), dtype=bool)
    mode = latest(Series(table.time_ns, table.values(field)), time_ns)
    return np.isfinite(mode) & ~np.isin(
        mode, FREE["copter" if "Copter" in flight.metadata.get("vehicle", "") else "plane"]
    )


def saturation(flight: Flight) -> Iterator[Evidence]:
    """Yield 1 where a motor is at a limit of its output, or a surface at an end of its travel.

    What an output does, and its ends, stand in the parameters: without them nothing is said.
    """
    if "raw.RCOU" not in flight:
        return
    table, parameters = flight["raw.RCOU"], parameters_of(flight)
    motors = motors_of(flight)
    if motors is not None:
        source = f"raw.RCOU, outputs {', '.join(str(one.number) for one in motors.each)}"
        yield Evidence("saturation", "output_full", "motors", source, "", table.time_ns, at_limit(motors))
    found: list[FloatArray] = []
    fields: list[str] = []
    for number in range(1, OUTPUTS + 1):
        field = named(table, f"C{number}", f"Ch{number}", f"Chan{number}")
        ends = _ends_of_surface(parameters, number)
        if field and ends is not None:
            pulse, (low, high) = table.values(field), ends
            pulse = np.where((pulse > 500.0) & (pulse < 2500.0), pulse, np.nan)
            share = (pulse - low) / (high - low)
            found.append(np.where(np.isfinite(share), (share >= FULL) | (share <= 1.0 - FULL), np.nan))
            fields.append(field)
    if found:
        source = f"raw.RCOU.{', '.join(fields)}"
        yield Evidence("saturation", "output_full", "surfaces", source, "", table.time_ns, _any(np.stack(found)))


def _any(values: FloatArray) -> FloatArray:
    """Return 1 where any is set, NaN where none is known."""
    known = np.isfinite(values)
    return np.where(known.any(axis=0), np.max(np.where(known, values, 0.0), axis=0), np.nan)


def _ends_of_surface(parameters: Parameters, number: int) -> tuple[float, float] | None:
    """Return the ends of an output to a surface; None of any other."""
    function = parameters.value(f"SERVO{number}_FUNCTION", f"RC{number}_FUNCTION")
    low, high = (parameters.value(f"SERVO{number}_{end}", f"RC{number}_{end}") for end in ("MIN", "MAX"))
    if function is None or int(function) not in SURFACES:
        return None
    return (low, high) if low and high and high > low else None
