"""Three-axis magnetometer in the field of the World Magnetic Model."""

import math

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import SettingsError
from groundstation.base.records import Column
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.simulation.readings import Readings, every, quantised
from groundstation.simulation.scenario import MagnetometerSettings, Scenario
from groundstation.simulation.trajectory import Trajectory, rotation_n_from_b

FIELD_KNOT_S = 60.0  # the model is evaluated once a minute and interpolated: the field changes slowly with the place
AXES = ("forward", "right", "down")


def magnetometer_readings(
    trajectory: Trajectory, scenario: Scenario, settings: MagnetometerSettings, rng: np.random.Generator
) -> Readings:
    """Field in body axes through soft and hard iron, with noise, rounded."""
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    body_from_n = np.swapaxes(rotation_n_from_b(motion.roll_deg, motion.pitch_deg, motion.heading_deg), 1, 2)
    field_body = np.einsum("nij,nj->ni", body_from_n, field_ned_nt(motion, decimal_year(scenario, settings)))
    reading = field_body @ np.array(settings.soft_iron).T + np.array(settings.hard_iron_nt)
    reading = reading + settings.noise_nt * rng.standard_normal(reading.shape)
    columns = {
        f"field_{axis}_nt": Column(quantised(reading[:, i], settings.resolution_nt)) for i, axis in enumerate(AXES)
    }
    return Readings("magnetometer", motion.time_ns, columns, dict.fromkeys(columns, settings.resolution_nt))


def decimal_year(scenario: Scenario, settings: MagnetometerSettings) -> float:
    """Date of the field as a decimal year: the settings' own, else that of ``start_utc``."""
    if settings.decimal_year is not None:
        return settings.decimal_year
    if scenario.start_utc_ns is None:
        raise SettingsError(
            f"{scenario.name}, key magnetometer.decimal_year", "no date", "a year where start_utc is absent"
        )
    year, month, day = (int(part) for part in utc_ns_to_iso(scenario.start_utc_ns)[:10].split("-"))
    return year + ((month - 1) * 30.4375 + day) / 365.25


def field_ned_nt(motion: Trajectory, year: float) -> FloatArray:
    """Field north, east, down in nanotesla, shape (n, 3).

    Source: NOAA, The US/UK World Magnetic Model, epochs 2010 to 2025, as packaged by pygeomag.
    """
    from pygeomag import GeoMag

    model = GeoMag(base_year=math.floor(year))
    time_s = motion.time_ns / NS_PER_S
    knots = np.unique(np.append(np.arange(0.0, time_s[-1], FIELD_KNOT_S), time_s[-1]))
    field = []
    for place in np.searchsorted(time_s, knots):
        answer = model.calculate(
            glat=float(motion.latitude_deg[place]),
            glon=float(motion.longitude_deg[place]),
            alt=float(motion.altitude_m[place]) / 1000.0,
            time=year,
        )
        field.append([answer.x, answer.y, answer.z])
    by_axis = np.array(field).T
    return np.stack([np.interp(time_s, knots, values) for values in by_axis], axis=1)
