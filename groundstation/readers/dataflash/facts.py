"""Facts of a log for its header: firmware, key parameters, units, and the UTC of power-up."""

import re

import numpy as np

from groundstation.base.records import BoolArray, Int64Array, Remark, UtcReadings
from groundstation.base.signals import RAW_PREFIX
from groundstation.base.source_units import PREFIX
from groundstation.base.timescales import gps_week_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.readers.dataflash.overview import GpsTimes, Overview

_VEHICLE = re.compile(r"\b(Ardu(?:Plane|Copter|Rover|Sub)|APM:(?:Plane|Copter|Rover)|Blimp|AntennaTracker|Rover)\b")
# Parameters that change what the navigation data mean.
_KEY_PARAMETERS = re.compile(
    r"AHRS_(EKF_TYPE|EKF_USE|ORIENTATION|TRIM_[XYZ]|GPS_USE)|EK[23]_(ENABLE|PRIMARY|MAG_CAL|SRC1_YAW|GPS_TYPE)|"
    r"COMPASS_(DEC|AUTODEC|USE|ORIENT|EXTERNAL|LEARN|(OFS|DIA|ODI|MOT)_[XYZ])|"
    r"GPS_(TYPE|TYPE2|AUTO_SWITCH|DELAY_MS|POS1_[XYZ])|INS_POS1_[XYZ]|LOG_BITMASK|SYSID_THISMAV|FRAME_CLASS"
)
_FIRST_WEEK, _LAST_WEEK = 1_000, 4_000  # 1999 to 2056: other numbers are no date of a log
_MS_PER_WEEK = 604_800_000
_RESTART_NS = -NS_PER_S
_SPREAD_NS = 2 * NS_PER_S
_DRIFT, _MOST_DRIFT = 1e-3, 0.5  # a quartz is within 1e-4; more than half is no drift


def metadata(found: Overview) -> dict[str, str]:
    """Firmware, vehicle, key parameters and units, as texts."""
    facts: dict[str, str] = {}
    for message in found.messages:
        vehicle = _VEHICLE.search(message)
        if vehicle:
            facts |= {"firmware": message, "vehicle": vehicle.group(1)}
            break
    for name, value in sorted(found.parameters.items()):
        if _KEY_PARAMETERS.fullmatch(name):
            facts[f"parameter.{name}"] = f"{value:.7g}"
    for name, definition in sorted(found.types.items()):
        units = found.units.describe(definition)
        if units and name not in ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG"):
            facts[f"{PREFIX}{RAW_PREFIX}{name}"] = units
    return facts


def utc_readings(times: GpsTimes) -> UtcReadings | None:
    """UTC of the autopilot's time zero by each fix, where that zero changes: the autopilot was started again."""
    good, device_ns = _plausible(times), times.device_ns
    if not (np.diff(device_ns[good]) < _RESTART_NS).any():
        return None
    zeros = gps_week_to_utc_ns(times.week[good], times.week_ms[good]) - device_ns[good]
    return UtcReadings(times.record_index[good], zeros)


def _plausible(times: GpsTimes) -> BoolArray:
    """Fixes whose week and time may be those of a log, shape (n,)."""
    is_week = (times.week >= _FIRST_WEEK) & (times.week < _LAST_WEEK)
    return np.asarray(is_week & (times.week_ms >= 0) & (times.week_ms < _MS_PER_WEEK))


def utc_of_power_up(times: GpsTimes) -> tuple[int | None, list[Remark]]:
    """UTC nanoseconds of the autopilot's time zero, None when no receiver told the time, and what was assumed.

    The median over all fixes of UTC by GPS week minus the autopilot's clock. Where the clock starts again (logs joined
    end to end) the fixes after its last start count: the clock model believes what comes after the last step.

    Examples
    --------
    >>> week, ms = np.full(5, 2000), 1000 * np.arange(5)
    >>> utc, _ = utc_of_power_up(GpsTimes(week, ms, 1_000_000 * (ms + 7000)))
    >>> utc_ns_to_iso(utc)
    '2018-05-05T23:59:35.000Z'
    """
    good = _plausible(times)
    if not good.any():
        return None, []
    device_ns = times.device_ns[good]
    zeros = gps_week_to_utc_ns(times.week[good], times.week_ms[good]) - device_ns
    restarts = np.flatnonzero(np.diff(device_ns) < _RESTART_NS)
    if len(restarts) and len(device_ns) - restarts[-1] > 2:
        zeros = zeros[restarts[-1] + 1 :]
        device_ns = device_ns[restarts[-1] + 1 :]
    utc_ns = int(np.sort(zeros)[len(zeros) // 2])
    text = (
        f"UTC from GPS week and time of {len(zeros)} fixes less leap seconds: power-up at {utc_ns_to_iso(utc_ns)}; "
        "late by the receiver's delay, some 0.1 to 0.2 s"
    )
    return utc_ns, [Remark("utc_from_gps", text), *_disagreement(zeros, device_ns)]


def _disagreement(zeros_ns: Int64Array, device_ns: Int64Array) -> list[Remark]:
    """What is to be said when the autopilot's clock and GPS time drift apart: speeds and rates suffer from it."""
    low, high = np.percentile(zeros_ns - zeros_ns[0], (5.0, 95.0))
    if high - low <= _SPREAD_NS:
        return []
    text = f"the difference of GPS time and the autopilot's clock changes by {(high - low) / NS_PER_S:.1f} s in the log"
    half = len(zeros_ns) // 2
    change, span = (
        np.median(values[half:]) - np.median(values[:half]) for values in (zeros_ns - zeros_ns[0], device_ns)
    )
    drift = change / max(span, 1.0)
    if _DRIFT < abs(drift) < _MOST_DRIFT:
        pace = "slow" if drift > 0 else "fast"
        text += f": the clock runs {abs(drift) / (1 + drift):.1%} {pace}, and UTC fits in the middle of the log only"
    return [Remark("clock_disagrees", text)]
