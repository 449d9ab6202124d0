"""GNSS receiver beside an inertial unit: coloured errors, lever arm, latency."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, frozen
from groundstation.simulation.imu.motion import Motion, true_states
from groundstation.simulation.imu.settings import ReceiverSettings
from groundstation.simulation.imu.unit import outside
from groundstation.simulation.processes import gauss_markov

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SimulatedFixes:
    """Fixes of a receiver as logged, and the times at which they were valid.

    Parameters
    ----------
    time_s : ndarray, shape (m,)
        Stamps of the log: validity + latency.
    validity_s : ndarray, shape (m,)
        True times of validity.
    latitude_deg, longitude_deg, height_m : ndarrays, shape (m,)
        Of the antenna, height above the ellipsoid.
    velocity_mps, position_sigma_m, velocity_sigma_mps : ndarrays, shape (m, 3)
        North, east, down; the sigmas as the receiver states them.
    is_precise : ndarray of bool, shape (m,)
    position_error_m, velocity_error_mps : ndarrays, shape (m, 3)
        Measured - true.
    """

    time_s: FloatArray
    validity_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    velocity_mps: FloatArray
    position_sigma_m: FloatArray
    velocity_sigma_mps: FloatArray
    is_precise: BoolArray
    position_error_m: FloatArray
    velocity_error_mps: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


def receive(
    motion: Motion,
    duration_s: float,
    lever_arm_m: tuple[float, float, float],
    rng: np.random.Generator,
    *,
    settings: ReceiverSettings,
) -> SimulatedFixes:
    """Return the fixes of a log; the first is valid within the first period."""
    step_s = 1.0 / settings.rate_hz
    validity = np.arange(rng.uniform(0.0, step_s), duration_s, step_s)
    shape = (3, len(validity))
    axis = np.array([1.0, 1.0, settings.vertical_factor])
    position_error = (
        axis
        * (
            settings.position_white_m * rng.standard_normal(shape)
            + gauss_markov(rng, shape, step_s, settings.position_slow_m, settings.slow_s)
            + gauss_markov(rng, shape, step_s, settings.position_fast_m, settings.fast_s)
        ).T
    )
    velocity_error = axis * settings.velocity_white_mps * rng.standard_normal(shape).T
    kept = outside(validity, settings.outages)
    validity, position_error, velocity_error = validity[kept], position_error[kept], velocity_error[kept]
    states = true_states(motion, validity)
    arm = np.asarray(lever_arm_m, dtype=np.float64)
    offset = states.n_from_b @ arm
    swing = np.einsum("nij,nj->ni", states.n_from_b, np.cross(states.rate_earth_radps, arm))
    moved = offset + position_error
    meridian, normal = curvature_radii_m(states.latitude_deg)
    parallel = (normal + states.height_m) * np.cos(np.deg2rad(states.latitude_deg))
    total = np.sqrt(settings.position_white_m**2 + settings.position_slow_m**2 + settings.position_fast_m**2)
    every = np.ones((len(validity), 1))
    return SimulatedFixes(
        validity + settings.latency_s,
        validity,
        states.latitude_deg + np.rad2deg(moved[:, 0] / (meridian + states.height_m)),
        wrap_180(states.longitude_deg + np.rad2deg(moved[:, 1] / parallel)),
        states.height_m - moved[:, 2],
        states.velocity_mps + swing + velocity_error,
        every * axis * float(total) * settings.stated_factor,
        every * axis * settings.velocity_white_mps * settings.stated_factor,
        np.full(len(validity), settings.is_precise),
        position_error,
        velocity_error,
    )
