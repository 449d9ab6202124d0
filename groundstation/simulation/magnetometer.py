"""Three-axis magnetometer in the field of the World Magnetic Model and the aircraft."""

import math

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import Column
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.simulation.electric import current_a
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import TopicReadings, every, quantised
from groundstation.simulation.scenario import Airport, Anomaly, MagnetometerSettings, Scenario
from groundstation.simulation.trajectory import Trajectory, rotation_n_from_b

FIELD_KNOT_S = 60.0  # the model is evaluated once a minute and interpolated: the field changes slowly with the place
AXES = ("forward", "right", "down")
MODEL_YEARS = range(2010, 2030)  # that the sets of pygeomag serve


def magnetometer_readings(
    trajectory: Trajectory, scenario: Scenario, settings: MagnetometerSettings, rng: np.random.Generator
) -> TopicReadings:
    """Return the field at the sensor's axes with noise, rounded, recorded ``latency_s`` late.

    The noise is white and correlated.
    """
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    body_from_n = np.swapaxes(rotation_n_from_b(motion.roll_deg, motion.pitch_deg, motion.heading_deg), 1, 2)
    field_body = np.einsum("nij,nj->ni", body_from_n, world_field_nt(motion, scenario, settings))
    current = current_a(motion.time_ns / NS_PER_S, scenario.electric)
    reading = sensed_nt(field_body, motion.roll_deg, current, settings)
    reading = reading + settings.noise_nt * rng.standard_normal(reading.shape)
    if settings.correlated_nt > 0.0:
        shape, step_s = (3, len(motion)), 1.0 / settings.rate_hz
        reading = reading + gauss_markov(rng, shape, step_s, settings.correlated_nt, settings.correlation_s).T
    time_ns = motion.time_ns + round(settings.latency_s * NS_PER_S)
    in_log = time_ns <= trajectory.time_ns[-1]
    columns = {
        f"field_{axis}_nt": Column(quantised(reading[in_log, i], settings.resolution_nt)) for i, axis in enumerate(AXES)
    }
    return TopicReadings("magnetometer", time_ns[in_log], columns, dict.fromkeys(columns, settings.resolution_nt))


def sensed_nt(
    field_body_nt: FloatArray, roll_deg: FloatArray, current_a: FloatArray, settings: MagnetometerSettings
) -> FloatArray:
    """Return the reading of a magnetometer without noise in the world's field.

    reading = scale * sensor_from_body @ (soft iron @ field + hard iron + coupling * current
    + odd * sin(roll) + even * sin(roll)^2).

    Parameters
    ----------
    field_body_nt : ndarray, shape (n, 3)
        Field of the world along the aircraft's axes forward, right, down.
    roll_deg, current_a : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n, 3)

    Ignored: iron that remembers (hysteresis).

    Source: Poisson, Mémoire sur la théorie du magnétisme, 1824; in the letters of Evans and Smith, Admiralty Manual for
    Ascertaining and Applying the Deviations of the Compass, 1862, soft iron is I + (a b c; d e f; g h k), hard iron
    (P, Q, R).

    Examples
    --------
    >>> level, none = np.array([[17e3, 0.0, 50e3]]), np.zeros(1)
    >>> sensed_nt(level, none, none, MagnetometerSettings(hard_iron_nt=(300.0, -200.0, 100.0))).tolist()
    [[17300.0, -200.0, 50100.0]]
    """
    sine = np.sin(np.deg2rad(roll_deg))[:, None]
    at_sensor = field_body_nt @ np.array(settings.soft_iron).T + np.array(settings.hard_iron_nt)
    at_sensor = at_sensor + np.array(settings.current_nt_per_a) * np.asarray(current_a)[:, None]
    at_sensor = at_sensor + np.array(settings.bank_odd_nt) * sine + np.array(settings.bank_even_nt) * sine**2
    body_from_sensor = rotation_n_from_b(*(np.array([angle]) for angle in settings.misalignment_deg))[0]
    return np.asarray(at_sensor @ body_from_sensor * np.array(settings.scale))


def world_field_nt(motion: Trajectory, scenario: Scenario, settings: MagnetometerSettings) -> FloatArray:
    """Field of the world north, east, down along a motion, shape (n, 3).

    The settings' own, else the model's; and what the world has more.

    Raises
    ------
    SettingsError
        When the flight has no date, or no model serves it.
    """
    if settings.world_field_nt is not None:
        field = np.tile(np.array(settings.world_field_nt), (len(motion), 1))
    else:
        field = field_ned_nt(motion, decimal_year(scenario, settings), scenario.name)
    if settings.anomaly is not None:
        field = field + anomaly_nt(motion, scenario.airport, settings.anomaly)
    return np.asarray(field + np.array(settings.field_error_nt))


def anomaly_nt(motion: Trajectory, airport: Airport, anomaly: Anomaly) -> FloatArray:
    """Return the field of a plane wave of the crust along a motion, shape (n, 3).

    It is north, east, down, and free of curl and divergence. It is -grad V of V = amplitude / k exp(-k height) cos(k .
    position + phase), the exponential counted as 1 at the altitude flown: horizontal and vertical parts have one
    amplitude and are a quarter of a wave apart.

    Source: Blakely, Potential Theory in Gravity and Magnetic Applications, 1995, section 11.1.
    """
    north_m = np.deg2rad(motion.latitude_deg - airport.latitude_deg) * SEMI_MAJOR_M
    east_m = np.deg2rad(wrap_180(motion.longitude_deg - airport.longitude_deg)) * SEMI_MAJOR_M
    east_m = east_m * np.cos(np.deg2rad(airport.latitude_deg))
    cosine, sine = (float(of(np.deg2rad(anomaly.direction_deg))) for of in (np.cos, np.sin))
    phase_rad = 2.0 * np.pi / anomaly.wavelength_m * (cosine * north_m + sine * east_m)
    phase_rad = phase_rad + np.deg2rad(anomaly.phase_deg)
    parts = [cosine * np.sin(phase_rad), sine * np.sin(phase_rad), -np.cos(phase_rad)]
    return anomaly.amplitude_nt * np.stack(parts, axis=1)


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


def field_ned_nt(motion: Trajectory, year: float, name: str = "scenario") -> FloatArray:
    """Field of the World Magnetic Model north, east, down in nanotesla, shape (n, 3).

    Source: NOAA, The US/UK World Magnetic Model, epochs 2010 to 2025, as packaged by pygeomag.
    """
    from pygeomag import GeoMag

    if math.floor(year) not in MODEL_YEARS:
        expected = f"a year from {MODEL_YEARS[0]} to {MODEL_YEARS[-1]}, which the world magnetic models serve"
        raise SettingsError(f"{name}, key magnetometer.decimal_year", f"{year:.2f}", expected)
    model = GeoMag(base_year=math.floor(year))
    time_s = motion.time_ns / NS_PER_S
    knots = np.unique(np.append(np.arange(time_s[0], time_s[-1], FIELD_KNOT_S), time_s[-1]))
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
