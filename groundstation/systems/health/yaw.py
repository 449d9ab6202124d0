"""Yaw of the autopilot against its own compass.

Its heading is atan2(-(f_y cos r - f_z sin r), f_x cos p + (f_y sin r + f_z cos r) sin p) + declination, with the field
f in the body, roll r and pitch p. It ignores the deviation of the aircraft, and rows that lean by more than 30 deg,
where an error of roll or pitch turns the steep field into one of heading.

Source: Caruso, Applications of Magnetic Sensors for Low Cost Compass Systems, 2000.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.angles import unwrap, wrap_180
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.systems.health.ardupilot_sensors import FORWARD, is_off
from groundstation.systems.health.evidence import Evidence, FloatArray
from groundstation.systems.health.lean import down_of
from groundstation.systems.health.logged import Series, at
from groundstation.systems.health.parameters import stated_declination
from groundstation.systems.health.world_field import first_position
from groundstation.tables.parameters import Parameters, parameters_of
from groundstation.tables.table import Flight, Table

QUANTITY = "yaw_against_compass_deg"
LARGEST_LEAN_DEG = 30.0
BY_COMPASS = (0.0, 1.0, 2.0, 3.0)  # EK3_SRC1_YAW: none, compass, GPS, GPS and compass; others need not tell north
EXTERNAL_YAW = 8  # bit of EKF2_EV_CTRL


def evidence(flight: Flight) -> Iterator[Evidence]:
    """Yield how far the yaw is off the heading of each compass in use."""
    parameters = parameters_of(flight)
    attitude = next((flight[one] for one in topics_of_kind("ins", flight.topics()) if _has_attitude(flight[one])), None)
    if attitude is None or not _tells_north(parameters):
        return
    is_true = attitude.has("true_heading_deg")
    declination = _declination(flight, parameters) if is_true else (0.0, "")
    if declination is None:
        return
    yaw = attitude.values("true_heading_deg" if is_true else "magnetic_heading_deg")
    roll, pitch = attitude.values("roll_deg"), attitude.values("pitch_deg")
    for number, topic in enumerate(topics_of_kind("magnetometer", flight.topics()), start=1):
        table = flight[topic]
        if not table.has(*FORWARD) or is_off(parameters, "COMPASS_USE", number - 1):
            continue
        angles = [at(Series(attitude.time_ns, unwrap(one)), table.time_ns) for one in (roll, pitch, yaw)]
        field = np.stack([table.values(name) for name in FORWARD])
        heading = magnetic_heading_deg(field, angles[0], angles[1]) + declination[0]
        level = down_of(angles[0], angles[1])[:, 2] >= np.cos(np.deg2rad(LARGEST_LEAN_DEG))
        value = np.where(level, np.abs(wrap_180(angles[2] - heading)), np.nan)
        source = f"{topic} against {attitude.topic}{declination[1]}"
        yield Evidence("yaw", QUANTITY, f"magnetometer {number}", source, "deg", table.time_ns, value, number - 1)


def magnetic_heading_deg(field: FloatArray, roll_deg: FloatArray, pitch_deg: FloatArray) -> FloatArray:
    """Return the magnetic heading of a field (forward, right, down), degrees, shape (n,).

    Examples
    --------
    >>> magnetic_heading_deg(np.array([[0.0], [-20.0], [40.0]]), np.zeros(1), np.zeros(1))
    array([90.])
    """
    roll, pitch = np.deg2rad(roll_deg), np.deg2rad(pitch_deg)
    forward, right, down = field
    ahead = forward * np.cos(pitch) + (right * np.sin(roll) + down * np.cos(roll)) * np.sin(pitch)
    aside = right * np.cos(roll) - down * np.sin(roll)
    return np.asarray(np.rad2deg(np.arctan2(-aside, ahead)))


def _has_attitude(table: Table) -> bool:
    return table.has("roll_deg", "pitch_deg") and (table.has("true_heading_deg") or table.has("magnetic_heading_deg"))


def _tells_north(parameters: Parameters) -> bool:
    """Tell whether the yaw is one from north.

    That of a camera or another computer need not be.
    """
    by_camera = int(parameters.value("EKF2_EV_CTRL") or 0.0) & EXTERNAL_YAW
    return (parameters.value("EK3_SRC1_YAW") or 0.0) in BY_COMPASS and not by_camera


def _declination(flight: Flight, parameters: Parameters) -> tuple[float, str] | None:
    """Return the declination and its source in words: the world model, else what is set.

    Without a position nor a setting the autopilot has none either. None where it may know one that the log does not
    tell.
    """
    place = first_position(flight)
    if place is not None and flight.has_utc:
        try:
            model = declination_along(*place, flight.start_ns)
        except NotAssessableError:
            pass
        else:
            return float(model.values_deg[0]), f" and {float(model.values_deg[0]):.1f} deg of the {model.model}"
    _name, stated = stated_declination(parameters)
    if stated:
        return stated, f" and {stated:.1f} deg as set"
    return (0.0, "") if place is None else None
