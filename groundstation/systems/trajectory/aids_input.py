"""Aids of a flight beside GNSS: barometer, wheels, compass."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.systems.known import Known
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.aids_answer import AidRow
from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import AidReadings, CompassReadings, GnssFixes
from groundstation.systems.trajectory.pressure_checks import Beside, beside_gnss, stuck
from groundstation.systems.trajectory.sampling import thinned
from groundstation.tables.table import Flight, Table

FIELD = tuple(f"field_{axis}_nt" for axis in ("forward", "right", "down"))
FEWEST = 30  # readings
HEIGHT_S, SPEED_S, COMPASS_S = 1.0, 0.5, 1.0  # of a mean
HEIGHT_EVERY_S = 5.0
SLOWEST_MPS = 0.7  # usual speed in fast travel
CHANGES_MPS = 2.0  # of GNSS while a speed is stuck
WHEEL_SCALE = 0.15  # tyres differ by less: beyond it the speed has another unit
UNITS = {3.6: "km/h", 2.237: "mph", 1.944: "knots"}
SAME_UNIT = 0.05


@dataclass(frozen=True)
class Aids:
    """Aids that a flight has, without those that cannot be right; a row for each."""

    height: AidReadings | None = None
    speed: AidReadings | None = None
    compass: CompassReadings | None = None
    rows: tuple[AidRow, ...] = ()


def aids_of(
    flight: Flight, known: Known, gnss: GnssFixes, settings: AidSettings, *, rolls: bool, is_mounted: bool = True
) -> Aids:
    """Return the aids of a flight.

    Parameters
    ----------
    rolls : bool
        The vehicle rolls: its wheels count.
    is_mounted : bool
        The axes of the unit are those of the body: a magnetic heading is one of them.
    """
    rows: list[AidRow] = []
    height = _height(flight, gnss, settings, rows) if settings.use_barometer else None
    speed = _speed(flight, gnss, settings, rows, rolls=rolls) if settings.use_wheel_speed else None
    compass = _compass(flight, known, gnss, settings, rows, is_mounted=is_mounted)
    return Aids(height, speed, compass, tuple(rows))


def _topics(flight: Flight, kind: str, named: str, *fields: str) -> tuple[str, ...]:
    """Return the topics of a kind that have the fields, or the one that is named."""
    having = tuple(one for one in topics_of_kind(kind, flight.topics()) if flight[one].has(*fields))
    if not named:
        return having
    if named not in having:
        raise NotAssessableError("trajectory", f"no topic {named} with {fields[0]}")
    return (named,)


# ----------------------------------------------------------------------------------------------------- barometer


def _height(flight: Flight, gnss: GnssFixes, settings: AidSettings, rows: list[AidRow]) -> AidReadings | None:
    """Return the heights of the first barometer that agrees with GNSS."""
    for topic in _topics(flight, "baro", settings.barometer_topic, "pressure_altitude_m"):
        time_s, value = _known(flight, topic, "pressure_altitude_m")
        found = beside_gnss(*_means(time_s, value, HEIGHT_S, np.median), time_s, value, gnss, settings)
        rows.append(AidRow("barometer", topic, not found.wrong, found.wrong or found.told, bool(found.wrong)))
        if not found.wrong:
            return _readings(found)
    return None


def _readings(found: Beside) -> AidReadings:
    """Return heights a few seconds apart.

    Gusts and the wash of a propeller last so long: they look like noise then.
    """
    rows = np.flatnonzero(thinned(found.time_s, HEIGHT_EVERY_S))
    slope = _slope(found.time_s, found.height_m)
    return AidReadings(found.time_s[rows], found.height_m[rows], slope[rows])


def _known(flight: Flight, topic: str, name: str) -> tuple[FloatArray, FloatArray]:
    """Return flight seconds and values of the rows that have one."""
    table = flight[topic].trusted().unique_times()
    table = table.take(table.valid(name))
    return flight.seconds(table.time_ns), table.values(name)


def _means(time_s: FloatArray, value: FloatArray, step_s: float, of: object) -> tuple[FloatArray, FloatArray]:
    """Return the mean times of bins, and the medians or the means of the values in them."""
    if not len(time_s):
        return time_s, value
    starts = np.flatnonzero(np.concatenate([[True], np.diff(np.floor(time_s / step_s)) > 0]))
    parts = np.split(np.arange(len(time_s)), starts[1:])
    reduce = np.median if of is np.median else np.mean
    return (
        np.array([time_s[part].mean() for part in parts]),
        np.array([float(reduce(value[part])) for part in parts]),
    )


def _slope(time_s: FloatArray, value: FloatArray) -> FloatArray:
    return np.asarray(np.gradient(value, time_s)) if len(time_s) > 1 else np.zeros(len(time_s))


# --------------------------------------------------------------------------------------------------------- wheels


def _speed(
    flight: Flight, gnss: GnssFixes, settings: AidSettings, rows: list[AidRow], *, rolls: bool
) -> AidReadings | None:
    """Return the speed of the first wheels that agree with GNSS."""
    for topic in _topics(flight, "odometry", settings.wheel_topic, "speed_mps"):
        if not rolls:
            rows.append(AidRow("wheel speed", topic, False, "the vehicle is not known to roll"))
            continue
        if not settings.use_no_sideways_motion:
            text = "where they point in the unit is known by no sideways motion alone, which is switched off"
            rows.append(AidRow("wheel speed", topic, False, text))
            continue
        time_s, value = _known(flight, topic, "speed_mps")
        wrong, told = _wheels_beside(time_s, value, gnss, settings)
        rows.append(AidRow("wheel speed", topic, not wrong, wrong or told, bool(wrong)))
        if not wrong:
            time_s, value = _means(time_s, value, SPEED_S, np.mean)
            return AidReadings(time_s, value, _slope(time_s, value))
    return None


def _wheels_beside(time_s: FloatArray, value: FloatArray, gnss: GnssFixes, settings: AidSettings) -> tuple[str, str]:
    """Return why a speed cannot be that of the wheels, else how it stands beside GNSS."""
    if len(time_s) < FEWEST:
        return f"only {len(time_s)} readings", ""
    motion = motion_of(gnss)
    known = np.isfinite(motion[:, :2]).all(axis=1)
    if not known.any():
        return "no speed of GNSS beside it", ""
    speed = np.interp(time_s, gnss.time_s[known], np.hypot(motion[known, 0], motion[known, 1]))
    size = np.abs(value)
    fast = size > 0.5 * float(np.quantile(size, 0.95))  # by the wheels: the speed by GNSS may be noise
    usual_mps = float(np.median(speed[fast])) if fast.sum() >= FEWEST else 0.0
    if usual_mps < SLOWEST_MPS:
        return f"{usual_mps:.1f} m/s by GNSS while it is fast, at least {SLOWEST_MPS:g} are needed", ""
    stuck_s = stuck(time_s, value, (time_s, speed), settings.stuck_s, CHANGES_MPS)
    if stuck_s:
        return f"it keeps one value for {stuck_s:.0f} s while GNSS changes its speed", ""
    ratio = float(np.median(value[fast])) / usual_mps
    if abs(ratio - 1.0) > WHEEL_SCALE:
        unit = next((name for per, name in UNITS.items() if abs(abs(ratio) / per - 1.0) < SAME_UNIT), "")
        also = f": {unit} in place of m/s" if unit else ": reversed, or of another unit"
        return f"it is {ratio:.2f} times the speed of GNSS{also}", ""
    return "", f"{ratio:.3f} times the speed of GNSS"


# -------------------------------------------------------------------------------------------------------- compass


def _compass(
    flight: Flight, known: Known, gnss: GnssFixes, settings: AidSettings, rows: list[AidRow], *, is_mounted: bool
) -> CompassReadings | None:
    """Return the readings of the compass whose deviation the aircraft file states."""
    if not settings.use_magnetic_heading:
        return None
    topic, table, is_field = _compass_table(flight, settings)
    stated = known.aircraft.compass_deviation_deg
    if stated is None:
        if table is not None:
            text = "the aircraft file states no deviation (compass_deviation_deg)"
            rows.append(AidRow("magnetic heading", topic, False, text))
        return None
    why = ""
    if table is None:
        why = "neither a magnetometer of three axes nor a magnetic heading in the log"
    elif not flight.has_utc:
        why = "no date in the log, so no declination"
    elif not is_mounted:
        why = "how the inertial unit stands in the vehicle is not known"
    elif len(table) < FEWEST:
        why = f"only {len(table)} readings"
    if why or table is None:
        rows.append(AidRow("magnetic heading", topic, False, why))
        return None
    time_s = flight.seconds(table.time_ns)
    first = np.flatnonzero(np.concatenate([[True], np.diff(np.floor(time_s / COMPASS_S)) > 0]))
    table, time_s = table.take(first), time_s[first]
    try:
        declination_deg = _declination(flight, time_s, gnss)
    except NotAssessableError as error:
        rows.append(AidRow("magnetic heading", topic, False, str(error.found)))
        return None
    rows.append(AidRow("magnetic heading", topic, True, "by the deviation that the aircraft file states"))
    nothing = np.full(len(time_s), np.nan)
    field = np.column_stack([table.values(one) if is_field else nothing for one in FIELD])
    heading = nothing if is_field else table.values("magnetic_heading_deg")
    return CompassReadings(time_s, field, heading, declination_deg, stated, known.aircraft.compass_sigma_deg)


def _compass_table(flight: Flight, settings: AidSettings) -> tuple[str, Table | None, bool]:
    """Return the topic of the compass, its readings, and True where they have three axes."""
    for kind, fields in (("magnetometer", FIELD), ("ins", ("magnetic_heading_deg",))):
        for topic in topics_of_kind(kind, flight.topics()):
            if flight[topic].has(*fields) and settings.compass_topic in ("", topic):
                table = flight[topic].trusted().unique_times()
                return topic, table.take(table.valid(*fields)), kind == "magnetometer"
    if settings.compass_topic:
        raise NotAssessableError("trajectory", f"no compass in a topic {settings.compass_topic}")
    return "", None, False


def _declination(flight: Flight, time_s: FloatArray, gnss: GnssFixes) -> FloatArray:
    """Return the declination at times, from the places of GNSS."""
    known = np.isfinite(gnss.latitude_deg) & np.isfinite(gnss.longitude_deg)
    longitude = np.unwrap(gnss.longitude_deg[known], period=360.0)
    place = [
        np.interp(time_s, gnss.time_s[known], one)
        for one in (gnss.latitude_deg[known], longitude, np.nan_to_num(gnss.height_m[known]))
    ]
    return declination_along(place[0], place[1], place[2], flight.start_ns).values_deg
