"""Facts of a log for its header: firmware, key parameters, units, and the UTC of power-up."""

import re

import numpy as np

from groundstation.base.records import BoolArray, Int64Array, Remark, UtcReadings
from groundstation.base.signals import RAW_PREFIX
from groundstation.base.sorted_values import quantile
from groundstation.base.source_units import PREFIX
from groundstation.base.timescales import gps_week_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.readers.dataflash.overview import DataflashOverview, GpsTimes
from groundstation.readers.rollover import Earliest, rollovers
from groundstation.readers.start import zero_of_readings

_VEHICLE = re.compile(r"\b(Ardu(?:Plane|Copter|Rover|Sub)|APM:(?:Plane|Copter|Rover)|Blimp|AntennaTracker|Rover)\b")
# Parameters that change what the navigation data mean.
_KEY_PARAMETERS = re.compile(
    r"AHRS_(EKF_TYPE|EKF_USE|ORIENTATION|TRIM_[XYZ]|GPS_USE)|EK[23]_(ENABLE|PRIMARY|MAG_CAL|SRC1_YAW|GPS_TYPE)|"
    r"COMPASS_(DEC|AUTODEC|USE|ORIENT|EXTERNAL|LEARN|(OFS|DIA|ODI|MOT)_[XYZ])|"
    r"GPS_(TYPE|TYPE2|AUTO_SWITCH|DELAY_MS|POS1_[XYZ])|INS_POS1_[XYZ]|LOG_BITMASK|SYSID_THISMAV|FRAME_CLASS"
)
_FIRST_WEEK, _LAST_WEEK = 1_000, 4_000  # 1999 to 2056: other numbers are no date of a log
_FEWEST = 3  # fixes in earlier weeks, as a receiver tells that counts to 1023 alone
_VERSION = re.compile(r"\bV(\d+)\.(\d+)")
# Version of ArduPilot -> the year its development began. Source: its releases on GitHub.
_YEARS = {
    (2, 0): 2012,
    (3, 0): 2013,
    (4, 0): 2019,
    (4, 1): 2020,
    (4, 2): 2021,
    (4, 3): 2022,
    (4, 5): 2023,
    (4, 6): 2024,
}
_FORMAT = Earliest(2010, "the DataFlash format", moves=False)
_MS_PER_WEEK = 604_800_000
_RESTART_NS = -NS_PER_S
_SPREAD_NS = 2 * NS_PER_S
_DRIFT, _MOST_DRIFT = 1e-3, 0.5  # a quartz is within 1e-4; more than half is no drift


def metadata(found: DataflashOverview) -> dict[str, str]:
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


def utc_readings(times: GpsTimes, firmware: str = "") -> UtcReadings | None:
    """Return the UTC of the autopilot's time zero by each fix, if that zero changes.

    It changes when the autopilot was started again; otherwise the result is None.
    """
    good, device_ns = _dated(times), times.device_ns
    if not (np.diff(device_ns[good]) < _RESTART_NS).any():
        return None
    utc_ns = gps_week_to_utc_ns(times.week[good], times.week_ms[good])
    behind = rollovers(int(utc_ns[-1]), earliest=_earliest(firmware))
    utc_ns = utc_ns + behind.shift_ns(int(utc_ns[-1]), is_gps_time=True)
    return UtcReadings(times.record_index[good], utc_ns - device_ns[good])


def utc_of_power_up(times: GpsTimes, firmware: str = "") -> tuple[int | None, list[Remark]]:
    """Return the UTC nanoseconds of the autopilot's time zero, and remarks.

    None when no receiver told the time. The remarks tell what was assumed. The value is the median of UTC by GPS week
    minus the autopilot's clock, over the fixes that count. Where the clock starts again (logs joined end to end) the
    fixes after its last start count: the clock model believes what comes after the last step. ``firmware`` shows
    whether the date can be true.

    Examples
    --------
    >>> week, ms = np.full(5, 2000), 1000 * np.arange(5)
    >>> utc, _ = utc_of_power_up(GpsTimes(week, ms, 1_000_000 * (ms + 7000)))
    >>> utc_ns_to_iso(utc)
    '2018-05-05T23:59:35.000Z'
    """
    good = _dated(times)
    if not good.any():
        return None, []
    device_ns = times.device_ns[good]
    zeros = gps_week_to_utc_ns(times.week[good], times.week_ms[good]) - device_ns
    restarts = np.flatnonzero(np.diff(device_ns) < _RESTART_NS)
    if len(restarts) and len(device_ns) - restarts[-1] > 2:
        zeros = zeros[restarts[-1] + 1 :]
        device_ns = device_ns[restarts[-1] + 1 :]
    told = zero_of_readings(zeros)
    moment_ns = told.ns + int(device_ns[-1])
    found = rollovers(moment_ns, earliest=_earliest(firmware))
    utc_ns = told.ns + found.shift_ns(moment_ns, is_gps_time=True)
    text = (
        f"UTC from GPS week and time of {counted(len(told.zeros_ns), 'fix', 'fixes')} less leap seconds: power-up at "
        f"{utc_ns_to_iso(utc_ns)}; late by the receiver's delay, some 0.1 to 0.2 s"
    )
    remarks = [Remark("utc_from_gps", text), *told.remarks("GPS time"), *found.remarks]
    unknown = int((times.week == 0).sum())
    if unknown:
        text = f"GPS time: {counted(unknown, 'fix', 'fixes')} told week 0: the week was not known yet"
        remarks.append(Remark("week_number", text))
    return utc_ns, remarks if told.passed_over else [*remarks, *_disagreement(zeros, device_ns)]


def _dated(times: GpsTimes) -> BoolArray:
    """Tell which fixes have a credible week, shape (n,); else a few that agree on any."""
    in_week = (times.week_ms >= 0) & (times.week_ms < _MS_PER_WEEK)
    good = in_week & (times.week >= _FIRST_WEEK) & (times.week < _LAST_WEEK)
    early = in_week & (times.week > 0) & (times.week < _FIRST_WEEK)
    return early if not good.any() and early.sum() >= _FEWEST else good


def _earliest(firmware: str) -> Earliest:
    """Return the year before which a firmware, or else the format, did not exist.

    Examples
    --------
    >>> _earliest("ArduCopter V4.2.3 (b11c6af3)").year, _earliest("ArduPlane V4.7.0-dev").year, _earliest("").year
    (2021, 2024, 2010)
    """
    found = _VERSION.search(firmware)
    years = [year for version, year in _YEARS.items() if found and version <= (int(found[1]), int(found[2]))]
    return Earliest(max(years), f"ArduPilot {found[0]}") if found and years else _FORMAT


def _disagreement(zeros_ns: Int64Array, device_ns: Int64Array) -> list[Remark]:
    """Return a remark when the autopilot's clock and GPS time drift apart.

    Speeds and rates suffer from such a drift.
    """
    low, high = (quantile(zeros_ns - zeros_ns[0], share) for share in (0.05, 0.95))
    if high - low <= _SPREAD_NS:
        return []
    text = f"the difference of GPS time and the autopilot's clock changes by {(high - low) / NS_PER_S:.1f} s in the log"
    half = len(zeros_ns) // 2
    change, span = (
        quantile(values[half:], 0.5) - quantile(values[:half], 0.5) for values in (zeros_ns - zeros_ns[0], device_ns)
    )
    drift = change / max(span, 1.0)
    if _DRIFT < abs(drift) < _MOST_DRIFT:
        pace = "slow" if drift > 0 else "fast"
        text += f": the clock runs {abs(drift) / (1 + drift):.1%} {pace}, and UTC fits in the middle of the log only"
    return [Remark("clock_disagrees", text)]
