"""Errors of a simulated flight's INS.

They are the closed Schuler solution of its settings, or the full truth of a class.
"""

from collections.abc import Callable

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import MPS2_PER_G, NS_PER_S
from groundstation.simulation.readings import generator
from groundstation.simulation.scenario import InsSettings
from groundstation.simulation.trajectory import Trajectory

EARTH_RADIUS_M = 6_371_009.0  # mean radius (IUGG), which gives the Schuler period its 84.4 min
SCHULER_RADPS = float(np.sqrt(MPS2_PER_G / EARTH_RADIUS_M))
FASTEST_HZ = 10.0  # the full truth is propagated at no higher rate and read between


@dataclass(frozen=True)
class FlightErrors:
    """Errors at the n samples of the INS, INS - truth, without the noise of its output.

    Parameters
    ----------
    position_m, velocity_mps : tuple of two ndarray, shape (n,)
        North, east; position on the local tangent.
    heading_deg, roll_deg, pitch_deg : ndarray, shape (n,)
        Mounting included.
    """

    position_m: tuple[FloatArray, FloatArray]
    velocity_mps: tuple[FloatArray, FloatArray]
    heading_deg: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray


def flight_errors(motion: Trajectory, settings: InsSettings, seed: int) -> FlightErrors:
    """Errors of the INS of a scenario along its true motion, given at the samples of the INS."""
    if settings.error_model == "full":
        return _full_errors(motion, settings, seed)
    time_s = motion.time_ns / NS_PER_S
    north, east = (schuler_error(time_s, settings, channel) for channel in (0, 1))
    heading = heading_error_deg(time_s, settings)
    if settings.turns_velocity:
        turned = turned_velocity_error(time_s, motion.velocity_north_mps, motion.velocity_east_mps, settings)
        north, east = ((own[0] + added[0], own[1] + added[1]) for own, added in zip((north, east), turned, strict=True))
    roll, pitch = (np.full(len(motion), error) for error in (settings.roll_error_deg, settings.pitch_error_deg))
    return FlightErrors((north[0], east[0]), (north[1], east[1]), heading, roll, pitch)


def heading_error_deg(time_s: FloatArray, settings: InsSettings) -> FloatArray:
    """Return INS heading minus nose heading without noise, degrees, shape as the time.

    It is the azimuth error, its drift and the mounting.
    """
    drift = settings.azimuth_drift_dph / 3600.0
    return np.asarray(settings.azimuth_error_deg + settings.boresight_deg + drift * time_s)


def schuler_error(time_s: FloatArray, settings: InsSettings, channel: int) -> tuple[FloatArray, FloatArray]:
    """Return position (m) and velocity (m/s) error of one channel under a constant drift.

    Horizontal channel 0 is north, 1 is east. Closed solution of dp' = dv, dv' = -g phi, phi' = dv / R + drift, the
    model of system 2 without its slow states. Ignored: coupling of the channels, curvature of the path. Source:
    Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3.
    """
    speed, rate, radius = settings.velocity_error_mps[channel], SCHULER_RADPS, EARTH_RADIUS_M
    tilt_rad = np.deg2rad(settings.tilt_arcsec[channel] / 3600.0)
    drift_radps = np.deg2rad(settings.drift_dph[channel] / 3600.0)
    phase = rate * time_s
    swing = 1.0 - np.cos(phase)
    velocity = speed * np.cos(phase) - radius * rate * tilt_rad * np.sin(phase) - radius * drift_radps * swing
    position = (
        settings.position_error_m[channel]
        + speed * np.sin(phase) / rate
        - radius * tilt_rad * swing
        - radius * drift_radps * (time_s - np.sin(phase) / rate)
    )
    return np.asarray(position), np.asarray(velocity)


def turned_velocity_error(
    time_s: FloatArray, north_mps: FloatArray, east_mps: FloatArray, settings: InsSettings
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return position (m) and velocity (m/s) errors that an azimuth error causes.

    They are given for north, then east. The azimuth error psi turns each acceleration. dv' = -g phi + psi x
    (-acceleration east, +acceleration north), phi' = dv / R: each change of velocity starts a Schuler oscillation of
    its own. The mounting turns nothing. Ignored: Earth's rotation seen by the azimuth error, which alignment on the
    ground balances. Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3.
    """
    azimuth_rad = np.deg2rad(heading_error_deg(time_s, settings) - settings.boresight_deg)
    cosine, sine = np.cos(SCHULER_RADPS * time_s), np.sin(SCHULER_RADPS * time_s)
    found = []
    for gained in (-azimuth_rad * np.gradient(east_mps, time_s), azimuth_rad * np.gradient(north_mps, time_s)):
        velocity = cosine * _integral(time_s, gained * cosine) + sine * _integral(time_s, gained * sine)
        found.append((_integral(time_s, velocity), velocity))
    return found[0], found[1]


def _integral(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Integral from the first time on by trapezoids, shape (n,)."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time_s)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _full_errors(motion: Trajectory, settings: InsSettings, seed: int) -> FlightErrors:
    from groundstation.simulation.ins_class import load_ins_class  # numba is imported where it is needed
    from groundstation.simulation.ins_draw import draw_heading_wander, draw_sensor_errors
    from groundstation.simulation.ins_errors import TrueMotion, propagate

    ins = load_ins_class(settings.ins_class)
    stride = max(int(settings.rate_hz / FASTEST_HZ), 1)
    knots = motion.at(np.arange(0, len(motion), stride))
    names = ("latitude_deg", "altitude_m", "velocity_north_mps", "velocity_east_mps", "velocity_down_mps")
    values = {name: getattr(knots, name) for name in (*names, "heading_deg", "roll_deg")}
    time_s = knots.time_ns / NS_PER_S
    truth = TrueMotion(time_s=time_s, **values)

    def streams(name: str) -> np.random.Generator:
        return generator(seed, f"ins {name}")

    sensors = draw_sensor_errors(ins, truth, streams, body_fixed=ins.is_strapdown)
    errors = propagate(truth, sensors, body_fixed=ins.is_strapdown)
    wander = draw_heading_wander(streams("heading"), time_s, knots.heading_deg, ins.heading)
    between = _reader(motion.time_ns / NS_PER_S, time_s)
    heading_rad = np.deg2rad(motion.heading_deg)
    phi_north, phi_east = between(errors.tilt_rad[0, :, 1]), between(-errors.tilt_rad[0, :, 0])
    about_forward = phi_north * np.cos(heading_rad) + phi_east * np.sin(heading_rad)
    about_right = phi_east * np.cos(heading_rad) - phi_north * np.sin(heading_rad)
    return FlightErrors(
        position_m=(between(errors.position_m[0, :, 0]), between(errors.position_m[0, :, 1])),
        velocity_mps=(between(errors.velocity_mps[0, :, 0]), between(errors.velocity_mps[0, :, 1])),
        heading_deg=settings.boresight_deg + between(np.rad2deg(errors.azimuth_rad[0]) + wander),
        roll_deg=settings.roll_error_deg - np.rad2deg(about_forward),
        pitch_deg=settings.pitch_error_deg - np.rad2deg(about_right),
    )


def _reader(at_s: FloatArray, time_s: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return a function that interpolates values to the wanted times.

    Beyond the end it goes on along the last slope: the last step may be cut short.
    """

    def between(values: FloatArray) -> FloatArray:
        slope = (values[-1] - values[-2]) / (time_s[-1] - time_s[-2])
        return np.asarray(np.interp(at_s, time_s, values) + slope * np.maximum(at_s - time_s[-1], 0.0))

    return between
