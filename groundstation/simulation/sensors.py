"""INS, GNSS receiver, barometer, air data and switches: what each logs of a true motion.

Error = reading - truth everywhere. Every sensor draws from its own generator, in a fixed order, whatever is switched
off, and rounds to its resolution.
"""

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.flight_errors import flight_errors
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import TopicReadings, every, quantised, quantised_heading
from groundstation.simulation.scenario import (
    AirSettings,
    BaroSettings,
    DiscreteSettings,
    EventMarker,
    GnssSettings,
    InsSettings,
    LogInterval,
    TruthSettings,
    Wind,
)
from groundstation.simulation.trajectory import Trajectory

TRUTH_RESOLUTION = {"deg": 1e-9, "heading": 1e-6, "mps": 1e-6, "m": 1e-4, "dps": 1e-6}


def truth_readings(trajectory: Trajectory, settings: TruthSettings) -> TopicReadings:
    """The true motion of the reference point and the nose, as topic ``truth``."""
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    step = TRUTH_RESOLUTION
    return _motion_readings(
        "truth", motion, motion.heading_deg, step["deg"], step["m"], step["mps"], step["heading"], step["heading"]
    )


def ins_readings(
    trajectory: Trajectory, settings: InsSettings, rng: np.random.Generator, seed: int = 0
) -> TopicReadings:
    """Return the readings of the INS at the reference point.

    They have the errors of its error model (``seed`` draws those of a class) and the noise of its output.
    """
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    n = len(motion)
    noise = rng.standard_normal((7, n))
    time_s = motion.time_ns / NS_PER_S
    errors = flight_errors(motion, settings, seed)
    (north_m, east_m), (north_mps, east_mps) = errors.position_m, errors.velocity_mps
    meridian, prime_vertical = curvature_radii_m(motion.latitude_deg)
    east_radius = (prime_vertical + motion.altitude_m) * np.cos(np.deg2rad(motion.latitude_deg))
    wander = np.zeros((2, n))
    if settings.attitude_wander_deg > 0.0:
        sigma, tau = settings.attitude_wander_deg, settings.attitude_wander_s
        wander = gauss_markov(rng, (2, n), 1.0 / settings.rate_hz, sigma, tau)
    values = {name: getattr(motion, name) for name in Trajectory.__dataclass_fields__} | {
        "latitude_deg": motion.latitude_deg + np.rad2deg(north_m / (meridian + motion.altitude_m)),
        "longitude_deg": wrap_180(motion.longitude_deg + np.rad2deg(east_m / east_radius)),
        "velocity_north_mps": motion.velocity_north_mps + north_mps + settings.velocity_noise_mps * noise[0],
        "velocity_east_mps": motion.velocity_east_mps + east_mps + settings.velocity_noise_mps * noise[1],
        "velocity_down_mps": motion.velocity_down_mps + settings.velocity_noise_mps * noise[2],
        "roll_deg": motion.roll_deg + errors.roll_deg + wander[0] + settings.attitude_noise_deg * noise[3],
        "pitch_deg": motion.pitch_deg + errors.pitch_deg + wander[1] + settings.attitude_noise_deg * noise[4],
    }
    heading = motion.heading_deg + errors.heading_deg + settings.heading_noise_deg * noise[5]
    readings = _motion_readings(
        "ins",
        Trajectory(**values),
        heading,
        settings.position_resolution_deg,
        settings.altitude_resolution_m,
        settings.velocity_resolution_mps,
        settings.attitude_resolution_deg,
        settings.heading_resolution_deg,
        settings.rate_resolution_dps,
    )
    aligned = time_s >= settings.align_s
    columns = dict(readings.columns) | {
        "mode": Column(np.where(aligned, "nav", "align")),
        "valid": Column(aligned),
    }
    return TopicReadings("ins", readings.time_ns, columns, readings.resolution)


def gnss_readings(trajectory: Trajectory, settings: GnssSettings, rng: np.random.Generator) -> TopicReadings:
    """Return the readings of GNSS at its antenna.

    They are position and velocity with white and correlated errors, quality, outages, latency.
    """
    index = every(trajectory, settings.rate_hz)
    antenna = trajectory.at(index).moved_to(
        (settings.antenna_forward_m, settings.antenna_right_m, settings.antenna_down_m)
    )
    n, step_s = len(antenna), 1.0 / settings.rate_hz
    white = rng.standard_normal((6, n))
    slow_velocity = gauss_markov(rng, (3, n), step_s, 1.0, settings.velocity_correlation_s)
    slow_position = gauss_markov(rng, (3, n), step_s, 1.0, settings.position_correlation_s)
    factor = np.array([[1.0], [1.0], [settings.vertical_factor]])
    velocity_error = settings.velocity_white_mps * white[:3] + settings.velocity_correlated_mps * slow_velocity
    position_error = settings.position_white_m * white[3:] + settings.position_correlated_m * slow_position
    velocity_error, position_error = factor * velocity_error, factor * position_error
    good = ~_inside(antenna.time_ns, settings.low_integrity)
    velocity_error[1] += np.where(good, 0.0, settings.jump_mps)
    meridian, prime_vertical = curvature_radii_m(antenna.latitude_deg)
    east_radius = (prime_vertical + antenna.altitude_m) * np.cos(np.deg2rad(antenna.latitude_deg))
    velocity = np.stack([antenna.velocity_north_mps, antenna.velocity_east_mps, antenna.velocity_down_mps])
    values = {
        "latitude_deg": antenna.latitude_deg + np.rad2deg(position_error[0] / (meridian + antenna.altitude_m)),
        "longitude_deg": wrap_180(antenna.longitude_deg + np.rad2deg(position_error[1] / east_radius)),
        "altitude_ellipsoid_m": antenna.altitude_m - position_error[2],
    }
    readings = _gnss_fields(values, velocity + velocity_error, good, settings)
    kept = ~_inside(antenna.time_ns, settings.outages)
    rows = np.repeat(np.flatnonzero(kept), settings.repeat)
    shift_ns = np.tile(np.arange(settings.repeat), int(kept.sum())) * round(step_s * NS_PER_S) // settings.repeat
    time_ns = antenna.time_ns[rows] + shift_ns + round(settings.latency_s * NS_PER_S)
    in_log = time_ns <= trajectory.time_ns[-1]
    columns = {name: column.take(rows[in_log]) for name, column in readings.columns.items()}
    return TopicReadings("gnss", time_ns[in_log], columns, readings.resolution)


def _gnss_fields(
    position: dict[str, FloatArray], velocity_mps: FloatArray, good: BoolArray, settings: GnssSettings
) -> TopicReadings:
    n = velocity_mps.shape[1]
    speed_sigma = float(np.hypot(settings.velocity_white_mps, settings.velocity_correlated_mps))
    resolution = {
        "latitude_deg": settings.position_resolution_deg,
        "longitude_deg": settings.position_resolution_deg,
        "altitude_ellipsoid_m": settings.altitude_resolution_m,
        "velocity_north_mps": settings.velocity_resolution_mps,
        "velocity_east_mps": settings.velocity_resolution_mps,
        "velocity_down_mps": settings.velocity_resolution_mps,
        "ground_speed_mps": settings.velocity_resolution_mps,
        "gdop": 0.1,
        "pdop": 0.1,
        "hdop": 0.1,
        "velocity_sigma_mps": 0.001,
        "satellites_used": 1.0,
    }
    values = position | {
        "velocity_north_mps": velocity_mps[0],
        "velocity_east_mps": velocity_mps[1],
        "velocity_down_mps": velocity_mps[2],
        "ground_speed_mps": np.hypot(velocity_mps[0], velocity_mps[1]),
        "gdop": np.full(n, settings.gdop),
        "pdop": np.full(n, 0.88 * settings.gdop),  # usual proportions of an open sky
        "hdop": np.full(n, 0.5 * settings.gdop),
        "velocity_sigma_mps": np.full(n, speed_sigma),
        "satellites_used": np.full(n, float(settings.satellites)),
    }
    columns = {name: Column(quantised(value, resolution[name])) for name, value in values.items()}
    track = direction_of(velocity_mps[0], velocity_mps[1])
    columns["track_deg"] = Column(quantised_heading(track, settings.track_resolution_deg))
    columns["constellation"] = Column(np.full(n, settings.constellation))
    columns["integrity_ok"] = Column(good)
    resolution["track_deg"] = settings.track_resolution_deg
    return TopicReadings("gnss", np.zeros(n, dtype=np.int64), columns, resolution)


def baro_readings(trajectory: Trajectory, settings: BaroSettings, rng: np.random.Generator) -> TopicReadings:
    """Pressure altitude: ellipsoid altitude + offset + noise."""
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    altitude = motion.altitude_m + settings.offset_m + settings.noise_m * rng.standard_normal(len(motion))
    column = Column(quantised(altitude, settings.resolution_m))
    return TopicReadings(
        "baro", motion.time_ns, {"pressure_altitude_m": column}, {"pressure_altitude_m": settings.resolution_m}
    )


def air_readings(trajectory: Trajectory, settings: AirSettings, wind: Wind, rng: np.random.Generator) -> TopicReadings:
    """True airspeed along the airspeed vector, and the wind when asked for."""
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    noise = rng.standard_normal((3, len(motion)))
    airspeed = np.maximum(motion.airspeed_mps + settings.airspeed_noise_mps * noise[0], 0.0)
    columns = {"true_airspeed_mps": Column(quantised(airspeed, settings.resolution_mps))}
    if settings.with_wind:
        for name, value, row in (("north", wind.north_mps, 1), ("east", wind.east_mps, 2)):
            values = value + settings.wind_noise_mps * noise[row]
            columns[f"wind_{name}_mps"] = Column(quantised(values, settings.resolution_mps))
    return TopicReadings("air", motion.time_ns, columns, dict.fromkeys(columns, settings.resolution_mps))


def discrete_readings(trajectory: Trajectory, settings: DiscreteSettings) -> TopicReadings:
    """Weight-on-wheels switch: true on the ground, open from lift-off to touchdown."""
    motion = trajectory.at(every(trajectory, settings.rate_hz))
    return TopicReadings("discrete", motion.time_ns, {"weight_on_wheels": Column(~motion.airborne)})


def event_readings(trajectory: Trajectory, events: tuple[EventMarker, ...]) -> TopicReadings:
    """Place markers at the first row of the internal grid not before their time.

    Markers after the end are left out.
    """
    named = sorted((event for event in events), key=lambda event: event.time_s)
    times = [-(-round(event.time_s * NS_PER_S) // trajectory.step_ns) * trajectory.step_ns for event in named]
    kept = [(time, event.name) for time, event in zip(times, named, strict=True) if time <= trajectory.time_ns[-1]]
    names = np.array([name for _, name in kept], dtype=np.str_)
    return TopicReadings("event", np.array([time for time, _ in kept], dtype=np.int64), {"name": Column(names)})


def _inside(time_ns: Int64Array, intervals: tuple[LogInterval, ...]) -> BoolArray:
    inside = np.zeros(len(time_ns), dtype=bool)
    for interval in intervals:
        inside |= (time_ns >= round(interval.from_s * NS_PER_S)) & (time_ns < round(interval.to_s * NS_PER_S))
    return inside


def _motion_readings(
    topic: str,
    motion: Trajectory,
    heading_deg: FloatArray,
    position_step_deg: float,
    altitude_step_m: float,
    velocity_step_mps: float,
    attitude_step_deg: float,
    heading_step_deg: float,
    rate_step_dps: float = TRUTH_RESOLUTION["dps"],
) -> TopicReadings:
    """The fields of ``ins`` and ``truth``, rounded."""
    resolution = {
        "latitude_deg": position_step_deg,
        "longitude_deg": position_step_deg,
        "altitude_ellipsoid_m": altitude_step_m,
        "velocity_north_mps": velocity_step_mps,
        "velocity_east_mps": velocity_step_mps,
        "velocity_down_mps": velocity_step_mps,
        "roll_deg": attitude_step_deg,
        "pitch_deg": attitude_step_deg,
        "rate_x_dps": rate_step_dps,
        "rate_y_dps": rate_step_dps,
        "rate_z_dps": rate_step_dps,
    }
    source = {"altitude_ellipsoid_m": "altitude_m"}
    columns = {
        name: Column(quantised(getattr(motion, source.get(name, name)), step)) for name, step in resolution.items()
    }
    columns["true_heading_deg"] = Column(quantised_heading(heading_deg, heading_step_deg))
    return TopicReadings(topic, motion.time_ns, columns, resolution | {"true_heading_deg": heading_step_deg})
