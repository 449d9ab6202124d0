"""Sensors beside an inertial unit and GNSS: barometer, wheels, magnetometer."""

from dataclasses import field, fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.atmosphere import SEA_LEVEL_K, SEA_LEVEL_PA
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.records import frozen
from groundstation.simulation.imu.motion import Motion, TrueStates, true_states
from groundstation.simulation.imu.settings import BarometerSettings, CompassSettings, ImuSettings, WheelSettings
from groundstation.simulation.processes import gauss_markov

FloatArray = NDArray[np.float64]
LAPSE_K_PER_M, EXPONENT = 0.0065, 9.80665 / (287.05287 * 0.0065)
ROUNDS = 20  # of the compass heading whose deviation leads to the magnetic one


@dataclass(frozen=True)
class SimulatedAids:
    """Readings of aids as logged; without rows where a sensor is not there.

    Parameters
    ----------
    baro_s, pressure_altitude_m : ndarrays, shape (b,)
    wheel_s, speed_mps : ndarrays, shape (w,)
        Along the nose.
    compass_s : ndarray, shape (c,)
    field_nt : ndarray, shape (c, 3)
        Along body axes, forward, right, down; the deviation is in it.
    """

    baro_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    pressure_altitude_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    wheel_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    speed_mps: FloatArray = field(default_factory=lambda: np.zeros(0))
    compass_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    field_nt: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


def sense(motion: Motion, rng: np.random.Generator, *, settings: ImuSettings, start_utc_ns: int) -> SimulatedAids:
    """Return the readings of the aids that the settings give a rate.

    Each draws from a stream of its own. ``start_utc_ns`` is the date of the declination.
    """
    of_baro, of_wheels, of_compass = rng.spawn(3)
    readings: dict[str, FloatArray] = {}
    if settings.barometer.rate_hz > 0.0:
        readings |= _barometer(motion, of_baro, settings.duration_s, settings.barometer)
    if settings.wheels.rate_hz > 0.0:
        readings |= _wheels(motion, of_wheels, settings.duration_s, settings.wheels)
    if settings.compass.rate_hz > 0.0:
        readings |= _compass(motion, of_compass, settings.duration_s, settings.compass, start_utc_ns)
    return SimulatedAids(**readings)


def _barometer(
    motion: Motion, rng: np.random.Generator, duration_s: float, settings: BarometerSettings
) -> dict[str, FloatArray]:
    step_s = 1.0 / settings.rate_hz
    time_s = np.arange(step_s, duration_s, step_s)
    shape, states = (len(time_s),), true_states(motion, time_s - settings.latency_s)
    error = (
        settings.noise_m * rng.standard_normal(shape)
        + gauss_markov(rng, shape, step_s, settings.gust_m, settings.gust_s)
        + gauss_markov(rng, shape, step_s, settings.drift_m, settings.drift_s)
    )
    height = states.height_m[0] + (states.height_m - states.height_m[0]) * settings.scale
    return {"baro_s": time_s, "pressure_altitude_m": height + settings.offset_m + error}


def pressure_pa(altitude_m: FloatArray) -> FloatArray:
    """Return the pressure of the standard atmosphere below 11 km.

    Examples
    --------
    >>> pressure_pa(np.array([0.0, 1000.0])).round(0).tolist()
    [101325.0, 89875.0]
    """
    return np.asarray(SEA_LEVEL_PA * (1.0 - LAPSE_K_PER_M * altitude_m / SEA_LEVEL_K) ** EXPONENT)


def _wheels(
    motion: Motion, rng: np.random.Generator, duration_s: float, settings: WheelSettings
) -> dict[str, FloatArray]:
    step_s = 1.0 / settings.rate_hz
    time_s = np.arange(step_s, duration_s, step_s)
    states = true_states(motion, time_s)
    ahead = np.einsum("ni,ni->n", states.n_from_b[:, :, 0], states.velocity_mps)
    noise = settings.noise_mps * rng.standard_normal(len(time_s))
    return {"wheel_s": time_s, "speed_mps": ahead * settings.scale + noise * (np.abs(ahead) > 0.01)}


def _compass(
    motion: Motion, rng: np.random.Generator, duration_s: float, settings: CompassSettings, start_utc_ns: int
) -> dict[str, FloatArray]:
    step_s = 1.0 / settings.rate_hz
    time_s = np.arange(step_s, duration_s, step_s)
    states = true_states(motion, time_s)
    earth = declination_along(states.latitude_deg, states.longitude_deg, states.height_m, start_utc_ns)
    error = gauss_markov(rng, (len(time_s),), step_s, settings.error_deg, settings.error_s)
    magnetic = states.heading_deg - earth.values_deg + error
    heading = magnetic.copy()
    for _ in range(ROUNDS):
        heading = magnetic - _deviation(heading, settings.deviation_deg)
    true_nt = _field(states, heading, earth.horizontal_nt, earth.down_nt)
    return {"compass_s": time_s, "field_nt": true_nt + settings.noise_nt * rng.standard_normal(true_nt.shape)}


def _deviation(heading_deg: FloatArray, a_to_e: tuple[float, float, float, float, float]) -> FloatArray:
    c = np.deg2rad(heading_deg)
    return np.asarray(np.stack([np.ones_like(c), np.sin(c), np.cos(c), np.sin(2 * c), np.cos(2 * c)], axis=1) @ a_to_e)


def _field(states: TrueStates, heading_deg: FloatArray, horizontal_nt: FloatArray, down_nt: FloatArray) -> FloatArray:
    """Return the field along body axes at a compass heading and the true roll and pitch."""
    roll, pitch, heading = (np.deg2rad(one) for one in (states.roll_deg, states.pitch_deg, heading_deg))
    ahead, aside = horizontal_nt * np.cos(heading), -horizontal_nt * np.sin(heading)
    lowered = np.sin(pitch) * ahead + np.cos(pitch) * down_nt
    return np.stack(
        [
            np.cos(pitch) * ahead - np.sin(pitch) * down_nt,
            np.cos(roll) * aside + np.sin(roll) * lowered,
            np.cos(roll) * lowered - np.sin(roll) * aside,
        ],
        axis=1,
    )
