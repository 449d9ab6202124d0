"""Random errors of one INS of a class: sensors, gravity, alignment, heading output."""

from collections.abc import Callable

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import compiled
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.ins_class import HeadingWander, InsClass
from groundstation.simulation.ins_errors import SensorErrors, TrueMotion, normal_gravity_mps2
from groundstation.simulation.processes import gauss_markov

DPH = float(np.deg2rad(1.0 / 3600.0))
MICRO_G = 1e-6 * MPS2_PER_G
ARCSEC = float(np.deg2rad(1.0 / 3600.0))
Streams = Callable[[str], np.random.Generator]


def draw_sensor_errors(
    ins: InsClass,
    motion: TrueMotion,
    streams: Streams,
    *,
    earth_rate: bool = True,
    body_fixed: bool = True,
    deflection: bool = True,
) -> SensorErrors:
    """Draw the errors of one INS along one flight.

    Parameters
    ----------
    ins : InsClass
    motion : TrueMotion
        One flight, n times, evenly spaced.
    streams : callable
        Gives a generator for a name ("ins constants", "gyro", "accelerometer", "deflection"), so that a switch never
        moves another error's noise.
    earth_rate, body_fixed, deflection : bool
        As in :func:`groundstation.simulation.ins_errors.propagate`; ``deflection`` False: gravity is normal.
    """
    n = len(motion.time_s)
    step_s = float(motion.time_s[1] - motion.time_s[0])
    constants, gyro, accelerometer = (streams(name) for name in ("ins constants", "gyro", "accelerometer"))
    fixed = constants.standard_normal(40)
    trend = DPH * ins.gyro_trend_dph_per_h * fixed[3:6, None] * motion.time_s / 3600.0
    slow = gauss_markov(gyro, (3, n), step_s, DPH * ins.gyro_random_dph, ins.gyro_correlation_s)
    gyro_error = DPH * ins.gyro_constant_dph * fixed[0:3, None] + trend + slow
    walk = np.deg2rad(ins.angle_random_walk_deg_per_sqrt_h) / 60.0  # rad / sqrt(s)
    gyro_white = walk / np.sqrt(step_s) * gyro.standard_normal((3, n)) if walk else np.zeros((3, n))
    acceleration = MICRO_G * ins.accelerometer_constant_ug * fixed[6:9, None] + gauss_markov(
        accelerometer, (3, n), step_s, MICRO_G * ins.accelerometer_random_ug, ins.accelerometer_correlation_s
    )
    settled = acceleration[:, 0].copy()  # acceleration that levelling sees: noise is averaged out
    noise = ins.velocity_random_walk_mps_per_sqrt_s / np.sqrt(step_s)
    acceleration += noise * accelerometer.standard_normal((3, n))
    gravity = np.zeros((n, 2))
    if deflection and ins.deflection_arcsec > 0.0:
        unit = spatial_gauss_markov(streams("deflection"), motion, ins.deflection_correlation_km * 1000.0)
        gravity = MPS2_PER_G * ARCSEC * ins.deflection_arcsec * unit
    tilt, azimuth = _alignment(ins, motion, settled, gyro_error[:, 0], gravity[0], earth_rate, body_fixed)
    return SensorErrors(
        gyro_radps=np.ascontiguousarray(gyro_error.T)[None],
        gyro_white_radps=np.ascontiguousarray(gyro_white.T)[None],
        accelerometer_mps2=np.ascontiguousarray(acceleration.T)[None],
        gyro_scale=_scale(ins.gyro_scale_factor_ppm, ins.gyro_cross_axis_ppm, fixed[9:18])[None],
        accelerometer_scale=_scale(ins.accelerometer_scale_factor_ppm, ins.accelerometer_cross_axis_ppm, fixed[18:27])[
            None
        ],
        deflection_mps2=gravity[None],
        position_m=ins.initial_position_m * fixed[None, 27:29],
        velocity_mps=ins.initial_velocity_mps * fixed[None, 29:31],
        tilt_rad=(tilt + ins.initial_tilt_rad * fixed[31:33])[None],
        azimuth_rad=np.array([azimuth + np.deg2rad(ins.initial_azimuth_deg) * fixed[33]]),
    )


def _scale(diagonal_ppm: float, cross_ppm: float, normal: FloatArray) -> FloatArray:
    size = np.full((3, 3), cross_ppm) + (diagonal_ppm - cross_ppm) * np.eye(3)
    return 1e-6 * size * normal.reshape(3, 3)


def _alignment(
    ins: InsClass,
    motion: TrueMotion,
    accelerometer_mps2: FloatArray,
    gyro_radps: FloatArray,
    deflection_mps2: FloatArray,
    earth_rate: bool,
    body_fixed: bool,
) -> tuple[FloatArray, float]:
    """Return the tilts and heading error that an alignment on the ground leaves.

    At rest there is no velocity and no tilt rate.

    Source: Titterton and Weston 2004, chapter 10: tilt = accelerometer bias / g, azimuth = east drift /
    (Earth rate x cos latitude).
    """
    heading = np.deg2rad(motion.heading_deg[0, 0]) if body_fixed else 0.0
    sine, cosine = np.sin(heading), np.cos(heading)
    latitude_deg = float(motion.latitude_deg[0, 0])
    gravity = normal_gravity_mps2(latitude_deg, float(motion.altitude_m[0, 0]))
    tilt, azimuth = np.zeros(2), 0.0
    if ins.is_levelled:
        north = accelerometer_mps2[0] * cosine - accelerometer_mps2[1] * sine + deflection_mps2[0]
        east = accelerometer_mps2[0] * sine + accelerometer_mps2[1] * cosine + deflection_mps2[1]
        tilt = np.array([north, east]) / gravity
    if ins.is_gyrocompassed and earth_rate:
        east_drift = gyro_radps[0] * sine + gyro_radps[1] * cosine
        latitude = np.deg2rad(latitude_deg)
        azimuth = -(east_drift / EARTH_RATE_RADPS - np.sin(latitude) * tilt[1]) / np.cos(latitude)
    return tilt, float(azimuth)


def spatial_gauss_markov(rng: np.random.Generator, motion: TrueMotion, correlation_m: float) -> FloatArray:
    """Draw a pair of unit processes along one flight's path.

    Their correlation is exp(-distance travelled / correlation length).

    Returns
    -------
    ndarray, shape (n, 2)

    Source: Jekeli, Inertial Navigation Systems with Geodetic Applications, 2001, chapter 6 (gravity as a stochastic
    process along the track).
    """
    speed = np.hypot(motion.velocity_north_mps[0], motion.velocity_east_mps[0])
    moved_m = 0.5 * (speed[1:] + speed[:-1]) * np.diff(motion.time_s)
    out = rng.standard_normal((len(motion.time_s), 2))
    _first_order(out, np.exp(-moved_m / correlation_m))
    return out


def draw_heading_wander(
    rng: np.random.Generator, time_s: FloatArray, heading_deg: FloatArray, settings: HeadingWander
) -> FloatArray:
    """Draw the wander of the heading output, degrees.

    It is a constant and a random walk that turns pull back. d' = -|turn rate| / turn_deg d + white noise;
    ``heading_deg`` need not be continuous. This is an error of the output, not of the platform: 0.1 deg of true azimuth
    error would drive the north channel with 0.026 deg/h cos(lat).

    Parameters
    ----------
    time_s, heading_deg : ndarray, shape (n,)

    Source: features of the recorded true heading error of a Laseref IV (NCAR GV, flight rf15 of DEEPWAVE).
    """
    n = len(time_s)
    offset, noise = settings.offset_deg * rng.standard_normal(), rng.standard_normal((n, 1))
    step_s = np.diff(time_s)
    turned = np.abs(np.mod(np.diff(heading_deg) + 180.0, 360.0) - 180.0)
    keep = np.exp(-turned / settings.turn_deg)
    drive = np.append(0.0, settings.drift_deg_per_sqrt_h * np.sqrt(step_s / 3600.0))
    walk = noise * drive[:, None]
    _pulled_back(walk, keep)
    return np.asarray(offset + walk[:, 0])


@compiled
def _first_order(values, keep):  # type: ignore[no-untyped-def]
    """Turn unit white noise into a stationary unit process, in place."""
    n, width = values.shape
    for k in range(1, n):
        drive = np.sqrt(1.0 - keep[k - 1] * keep[k - 1])
        for i in range(width):
            values[k, i] = keep[k - 1] * values[k - 1, i] + drive * values[k, i]


@compiled
def _pulled_back(values, keep):  # type: ignore[no-untyped-def]
    n, width = values.shape
    for k in range(1, n):
        for i in range(width):
            values[k, i] += keep[k - 1] * values[k - 1, i]
