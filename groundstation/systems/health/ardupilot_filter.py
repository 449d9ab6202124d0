"""Evidence of ArduPilot's Kalman filters, and of DCM beside them.

SV, SP, SH, SM and SVT are square roots of innovation test ratios in every firmware that logs them (EKF1 of 2014, EKF2,
EKF3): above 1 the filter rejects. They are hundredths in 16 bits: a negative one has run over, and is 655.36 more.
Gyro biases are degrees per second, accelerometer biases m/s2 (EKF3) or hundredths of it in a byte (EKF1, EKF2).

Source: ArduPilot, AP_NavEKF3_Logging.cpp, AP_NavEKF2_Logging.cpp, AP_Nav_Common.h, 4.7.0-dev of 2025-10-24;
DataFlash/LogFile.cpp, commit 9e73155 of 2014-12-01.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.ardupilot_codes import ESTIMATORS
from groundstation.base.geodesy import continuous_longitude_deg, has_position
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.evidence import ZERO, Event, Evidence, blank
from groundstation.systems.health.logged import (
    FloatArray,
    Logged,
    Series,
    at,
    bit,
    changes,
    counted,
    instances,
    is_integer,
    is_number,
    latest,
    length,
    named,
)
from groundstation.tables.estimator_in_use import EstimatorInUse, estimator_in_use
from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight, Table

# Filter -> types of its records by lane, of status, of its state, and of its biases.
FILTERS = {
    "EKF3": (("XKF4", "XKF9"), ("XKF1", "XKF6"), ("XKF2", "XKF7")),
    "EKF2": (("NKF4", "NKF9"), ("NKF1", "NKF6"), ("NKF2", "NKF7")),
    "EKF1": (("EKF4",), ("EKF1",), ("EKF2",)),
}
_AIDS = (  # field, sensor, bit of the timeouts
    ("SV", "GNSS velocity", 1),
    ("SP", "GNSS position", 0),
    ("SH", "height", 2),
    ("SM", "magnetic field", 3),
    ("SVT", "airspeed", 4),
)
_WARNINGS = ((14, "GNSS glitch, said by the filter"), (7, "no position aiding"), (18, "dead reckoning"))
_FAULTS = {
    0: "attitude not a number",
    1: "velocity not a number",
    2: "magnetometer X badly conditioned",
    3: "magnetometer Y badly conditioned",
    4: "magnetometer Z badly conditioned",
    5: "airspeed badly conditioned",
    6: "sideslip badly conditioned",
    7: "not initialised",
}
_NOT_INITIALISED = 7  # bit of the faults: the ratios are zeros then
_WRAP = 655.36
_STEP_M = 2.0  # a position that leaves its own velocity by more was reset
_LARGEST_STEP_S = 0.25
FILTER_WARNING = "filter_warning"
UNUSED = "_unused"  # of the quantities of a filter that did not fly the aircraft


def evidence(flight: Flight) -> Iterator[Evidence]:
    """Yield the evidence of every filter that was logged."""
    used = estimator_in_use(flight)
    for name, (status, state, bias) in FILTERS.items():
        lanes = instances(flight, *status)
        if not lanes:
            continue
        is_used = used is None or used.flew(name)
        suffix, words = ("", "") if is_used else (UNUSED, f" ({name}, not in use)")
        ratios = list(_ratios(lanes, used, name))
        for quantity, sensor, series, source in ratios:
            yield Evidence("innovations", quantity + suffix, sensor + words, source, "", series.time_ns, series.value)
        if is_used and not ratios:
            table = lanes[0].table
            yield blank("innovations", table.topic, table.time_ns, f"{table.topic.removeprefix('raw.')} is {ZERO}")
        for sensor, series, source in _states(lanes, used, name):
            is_fault = source.endswith(".FS")
            check, grade = (
                ("faults", "fault" if is_used else "caution") if is_fault else ("innovations", FILTER_WARNING)
            )
            if is_used or is_fault:
                yield Evidence(check, grade, f"{name} {sensor}", source, "", series.time_ns, series.value)
        if is_used:
            yield from _biases(flight, name, (state, bias), lanes)
        if is_used:
            yield from _switches(flight, name, lanes)
    yield from _not_the_one_set(flight, used)
    yield from _differences(flight, used)


def _switches(flight: Flight, name: str, lanes: tuple[Logged, ...]) -> Iterator[Evidence]:
    """Yield how often the lane has changed, and how often the position was reset."""
    lane_of = primary_lane(flight, name)
    if len(lane_of.time_ns):
        source = f"{lanes[0].table.topic}.PI"
        yield Evidence("switches", "switches", f"{name} lane", source, "", lane_of.time_ns, counted(lane_of))
    for table, lane in lanes:
        if is_number(table, "OFN", "OFE") and name != "EKF1" and _is_primary(table, lane).any():
            count = np.zeros(len(table))
            count[_reset_rows(table)] = 1.0
            source = f"{table.topic}.OFN, OFE"
            yield Evidence("resets", "resets", f"{name} position", source, "", table.time_ns, np.cumsum(count), lane)


def _not_the_one_set(flight: Flight, used: EstimatorInUse | None) -> Iterator[Evidence]:
    """Yield when another estimator flew than the one that is set.

    DCM does while the filter is not ready.
    """
    wanted = _wanted(flight)
    if used is None or "AEKF" not in used.source or not wanted:
        return
    table = flight["raw.ATT"]
    other = (~used.at(wanted, table.time_ns)).astype(np.float64)
    sensor = f"{wanted} is set, {used.name} flew" if not used.flew(wanted) else f"{wanted} is set"
    yield Evidence("innovations", "not_the_one_set", sensor, "raw.ATT.AEKF", "", table.time_ns, other)


def _wanted(flight: Flight) -> str:
    kind = parameters_of(flight).value("AHRS_EKF_TYPE")
    return ESTIMATORS.get(int(kind), "") if kind is not None else ""


def _ratios(
    lanes: tuple[Logged, ...], used: EstimatorInUse | None, name: str
) -> Iterator[tuple[str, str, Series, str]]:
    """Yield roots of test ratios and timeouts of each sensor that the filter ever fused."""
    for field, sensor, place in _AIDS:
        parts = [(table, _root(table, field)) for table, _ in lanes]
        series, source = _of_primary(lanes, [value for _, value in parts], used, name)
        if not np.any(series.value > 0.0):
            continue
        yield "test_ratio_root", sensor, series, f"{source}.{field}"
        late = [bit(table.values("TS"), place) if is_number(table, "TS") else None for table, _ in lanes]
        if all(one is not None for one in late):
            series, source = _of_primary(lanes, late, used, name)
            yield "aiding_timeout", sensor, series, f"{source}.TS"


def _root(table: Table, field: str) -> FloatArray | None:
    names = [one for one in (field, *(f"{field}{axis}" for axis in "XYZ")) if is_number(table, one)]
    if not names:
        return None
    value = np.stack([table.values(one) for one in names])
    value = np.max(np.where(value < 0.0, value + _WRAP, value), axis=0)
    if is_number(table, "FS"):
        value = np.where(bit(table.values("FS"), _NOT_INITIALISED) == 1.0, np.nan, value)
    return np.asarray(value)


def _states(lanes: tuple[Logged, ...], used: EstimatorInUse | None, name: str) -> Iterator[tuple[str, Series, str]]:
    """Yield fault bits that were ever set, and warnings of the solution status."""
    if all(is_number(table, "FS") for table, _ in lanes):
        for place, words in _FAULTS.items():
            series, source = _of_primary(lanes, [bit(table.values("FS"), place) for table, _ in lanes], used, name)
            if place == 0 or np.any(series.value > 0.0):
                yield (words if np.any(series.value > 0.0) else "numerical faults"), series, f"{source}.FS"
    if all(is_number(table, "SS") for table, _ in lanes):
        for place, words in _WARNINGS:
            series, source = _of_primary(lanes, [bit(table.values("SS"), place) for table, _ in lanes], used, name)
            if place == _WARNINGS[0][0] or np.any(series.value > 0.0):
                yield words, series, f"{source}.SS"


def _of_primary(
    lanes: tuple[Logged, ...], values: list[FloatArray | None], used: EstimatorInUse | None, name: str
) -> tuple[Series, str]:
    """Return the values of the lane in use along time, and their topic.

    They are NaN where the filter itself was not in use.
    """
    times, kept, topics = [], [], []
    for (table, lane), value in zip(lanes, values, strict=True):
        if value is None:
            continue
        mine = _is_primary(table, lane)
        if mine.any():
            times.append(table.time_ns[mine])
            kept.append(value[mine])
            topics.append(table.topic)
    if not times:
        return Series(np.zeros(0, dtype=np.int64), np.zeros(0)), lanes[0].table.topic
    time_ns, value = np.concatenate(times), np.concatenate(kept)
    if len(times) > 1:
        order = np.argsort(time_ns, kind="stable")
        time_ns, value = time_ns[order], value[order]
    if used is not None and used.flew(name):
        value = np.where(used.at(name, time_ns), value, np.nan)
    return Series(time_ns, value), " and ".join(topics)


def _is_primary(table: Table, lane: int) -> BoolArray:
    """Tell where a lane says that it is the one in use; the first where none says it."""
    if is_number(table, "PI"):
        return np.asarray(table.values("PI") == lane)
    return np.full(len(table), lane == 0)


def primary_lane(flight: Flight, name: str) -> Series:
    """Return the lane in use along time, as the first lane tells it; empty without one."""
    for table, _ in instances(flight, *FILTERS[name][0])[:1]:
        if is_number(table, "PI"):
            lane = table.values("PI")
            return Series(table.time_ns, np.where(lane >= 0.0, lane, np.nan))
    return Series(np.zeros(0, dtype=np.int64), np.zeros(0))


def _biases(
    flight: Flight, name: str, types: tuple[tuple[str, ...], ...], lanes: tuple[Logged, ...]
) -> Iterator[Evidence]:
    lane_of = primary_lane(flight, name)
    state, bias = types
    gyro, accel = ("GX", "GY", "GZ"), ("AX", "AY", "AZ")
    for kinds, quantity, unit, sensor in (
        (state, "gyro_bias_radps", "rad/s", "gyro bias"),
        (bias, "accel_bias_mps2", "m/s2", "accelerometer bias"),
    ):
        for table, lane in instances(flight, *kinds):
            field = named(table, "AZbias", "AZ1bias")
            if quantity.startswith("gyro") and is_number(table, *gyro):
                value, fields = np.deg2rad(length(table, gyro)), "GX, GY, GZ"
            elif quantity.startswith("accel") and is_number(table, *accel):
                value, fields = length(table, accel) * (0.01 if is_integer(table, "AX") else 1.0), "AX, AY, AZ"
            elif quantity.startswith("accel") and field:
                value, fields = np.abs(table.values(field)) * (0.01 if is_integer(table, field) else 1.0), field
            else:
                continue
            if len(lane_of.time_ns):
                value = np.where(latest(lane_of, table.time_ns) == lane, value, np.nan)
            elif lane != lanes[0].instance:
                continue
            if np.any(value > 0.0):
                source = f"{table.topic}.{fields}"
                yield Evidence("imu", quantity, sensor, source, unit, table.time_ns, value, lane)


def _differences(flight: Flight, used: EstimatorInUse | None) -> Iterator[Evidence]:
    """Yield what parts AHR2, the estimator beside it, from what flew."""
    if "raw.AHR2" not in flight or "raw.ATT" not in flight:
        return
    second, first = flight["raw.AHR2"], flight["raw.ATT"]
    beside = " and ".join(used.others) if used is not None and used.others and used.name == "DCM" else ""
    suffix, words = (UNUSED, f"{beside}, not in use") if beside else ("", "AHR2, the estimator beside it")
    other, names = _position(flight)
    if other is not None and is_number(second, "Lat", "Lng"):
        value = _distance_m(second, other, names)
        if np.isfinite(value).any():
            source = f"raw.AHR2 against {other.topic}"
            yield Evidence("resets", "position_difference_m" + suffix, words, source, "m", second.time_ns, value)
    angles = [name for name in ("Roll", "Pitch") if is_number(second, name) and is_number(first, name)]
    if angles:
        apart = [
            np.abs(wrap_180(second.values(name) - at(Series(first.time_ns, first.values(name)), second.time_ns)))
            for name in angles
        ]
        value = np.max(np.stack(apart), axis=0)
        source = "raw.AHR2 against raw.ATT"
        yield Evidence("resets", "attitude_difference_deg" + suffix, words, source, "deg", second.time_ns, value)


def _position(flight: Flight) -> tuple[Table | None, tuple[str, str]]:
    """Return the position that flew, else that of GNSS."""
    if "raw.POS" in flight and is_number(flight["raw.POS"], "Lat", "Lng"):
        return flight["raw.POS"], ("Lat", "Lng")
    for topic in ("gnss", "gnss.1"):
        if topic in flight and flight[topic].has("latitude_deg", "longitude_deg"):
            return flight[topic], ("latitude_deg", "longitude_deg")
    return None, ("", "")


def _distance_m(table: Table, other: Table, names: tuple[str, str]) -> FloatArray:
    latitude, longitude = table.values("Lat"), table.values("Lng")
    latitude = np.where(has_position(latitude, longitude), latitude, np.nan)
    other_latitude, other_longitude = (other.values(name) for name in names)
    placed = has_position(other_latitude, other_longitude)
    other_longitude = continuous_longitude_deg(other_longitude)
    north = latitude - at(Series(other.time_ns, np.where(placed, other_latitude, np.nan)), table.time_ns)
    east = wrap_180(longitude - at(Series(other.time_ns, np.where(placed, other_longitude, np.nan)), table.time_ns))
    return np.hypot(north, east * np.cos(np.deg2rad(latitude))) * 111_195.0  # m a degree of the mean sphere


def events(flight: Flight) -> Iterator[Event]:
    """Yield resets of position, and switches of lane and of estimator."""
    used = estimator_in_use(flight)
    for name, (status, state, _) in FILTERS.items():
        if used is not None and not used.flew(name):
            continue
        lane_of = primary_lane(flight, name)
        for row in changes(lane_of):
            text = f"{name} switched to lane {lane_of.value[row]:.0f}"
            yield Event("switches", int(lane_of.time_ns[row]), "warn", text, f"raw.{status[0]}.PI")
        yield from _selections(flight, name, lane_of)
        told: list[Int64Array] = []
        for table, lane in instances(flight, *status):
            if is_number(table, "OFN", "OFE") and name != "EKF1" and _is_primary(table, lane).any():
                rows = _reset_rows(table)
                told.append(table.time_ns[rows])
                for row in rows:
                    by_m = np.hypot(table.values("OFN")[row], table.values("OFE")[row])
                    text = f"{name} reset its position by {by_m:.1f} m"
                    yield Event("resets", int(table.time_ns[row]), "warn", text, f"{table.topic}.OFN, OFE")
        yield from _steps(flight, name, state, lane_of, np.concatenate(told) if told else np.zeros(0, dtype=np.int64))
    yield from _estimators(flight, used)


def _reset_rows(table: Table) -> NDArray[np.intp]:
    by = np.stack([np.diff(table.values("OFN")), np.diff(table.values("OFE"))])
    return np.flatnonzero(np.isfinite(by).all(axis=0) & (by != 0.0).any(axis=0)) + 1


def _steps(flight: Flight, name: str, types: tuple[str, ...], lane_of: Series, told_ns: Int64Array) -> Iterator[Event]:
    """Yield steps of the position that its own velocity does not explain.

    One within a second of a reset that is told is that reset.
    """
    for table, lane in instances(flight, *types):
        if not is_number(table, "PN", "PE", "VN", "VE") or len(table) < 3:
            continue
        time_s = (table.time_ns - table.time_ns[0]) / NS_PER_S
        step_s = np.diff(time_s)
        rest = []
        for axis in "NE":
            speed = table.values(f"V{axis}")
            rest.append(np.diff(table.values(f"P{axis}")) - 0.5 * (speed[1:] + speed[:-1]) * step_s)
        jump = np.hypot(*rest)
        rows = np.flatnonzero((jump > _STEP_M) & (step_s < _LARGEST_STEP_S)) + 1
        if len(lane_of.time_ns):
            rows = rows[latest(lane_of, table.time_ns[rows]) == lane]
        elif lane:
            continue
        for row in rows:
            if not np.any(np.abs(told_ns - table.time_ns[row]) < NS_PER_S):
                text = f"{name} moved its position by {jump[row - 1]:.1f} m at once"
                yield Event("resets", int(table.time_ns[row]), "warn", text, f"{table.topic}.PN, PE")


def _selections(flight: Flight, name: str, lane_of: Series) -> Iterator[Event]:
    """Yield changes of the sensor that the lane in use works with (XKFS)."""
    if name != "EKF3":
        return
    for table, lane in instances(flight, "XKFS"):
        for field, sensor in (("MI", "compass"), ("BI", "barometer"), ("GI", "GNSS receiver"), ("AI", "airspeed")):
            if not is_number(table, field):
                continue
            series = Series(table.time_ns, table.values(field))
            for row in changes(series):
                if not len(lane_of.time_ns) or latest(lane_of, table.time_ns[row : row + 1])[0] == lane:
                    text = f"EKF3 lane {lane} changed to {sensor} {series.value[row]:.0f}"
                    yield Event("switches", int(table.time_ns[row]), "warn", text, f"{table.topic}.{field}")


def _estimators(flight: Flight, used: EstimatorInUse | None) -> Iterator[Event]:
    """Yield changes of the estimator that flies."""
    if used is None or "AEKF" not in used.source:
        return
    for time_ns, before, name in zip(used.times_ns[1:], used.names[:-1], used.names[1:], strict=True):
        text = f"{name} took over from {before}"
        yield Event("switches", time_ns, "fail" if name == "DCM" else "warn", text, "raw.ATT.AEKF")
