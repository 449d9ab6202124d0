"""Six-state channel model of system 2 as a truth generator.

The filter's model is exactly true of the errors that it makes.
"""

from functools import lru_cache

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import compiled
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.ins_class import InsClass
from groundstation.simulation.ins_draw import DPH

RADIUS_M = 6_371_009.0  # mean radius (IUGG), which with standard gravity gives the Schuler period its 84.4 min
POSITION, VELOCITY, TILT, CONSTANT, TREND, RANDOM = range(6)


@dataclass(frozen=True)
class ChannelTruth:
    """States of c channels at n times in SI units.

    Tilt is positive where it makes the velocity error fall. ``states`` has shape (c, n, 6): position error m, velocity
    error m/s, tilt rad, constant drift rad/s, its first derivative rad/s^2, random drift rad/s.
    """

    states: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", frozen(self.states))

    @property
    def drift_radps(self) -> FloatArray:
        """Whole drift, shape (c, n); the trend is inside the second state's growth."""
        return np.asarray(self.states[..., CONSTANT] + self.states[..., RANDOM])


def channel_matrix(beta_per_s: float, gravity_mps2: float = MPS2_PER_G, radius_m: float = RADIUS_M) -> FloatArray:
    """Return A of the channel, shape (6, 6). Source: Neusypin et al., Herald of BMSTU, 2003."""
    out = np.zeros((6, 6))
    out[POSITION, VELOCITY] = 1.0
    out[VELOCITY, TILT] = -gravity_mps2
    out[TILT, VELOCITY] = 1.0 / radius_m
    out[TILT, CONSTANT] = out[TILT, RANDOM] = out[CONSTANT, TREND] = 1.0
    out[RANDOM, RANDOM] = -beta_per_s
    return out


def channel_sigmas(ins: InsClass) -> FloatArray:
    """Standard deviations of the state at the start, shape (6,)."""
    return np.array(
        [
            ins.initial_position_m,
            ins.initial_velocity_mps,
            ins.initial_tilt_rad,
            DPH * ins.gyro_constant_dph,
            DPH * ins.gyro_trend_dph_per_h / 3600.0,
            DPH * ins.gyro_random_dph,
        ]
    )


def channel_noise(ins: InsClass, matrix: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Exact transition and covariance of the process noise of one step, shapes (6, 6).

    Source: Van Loan, Computing integrals involving the matrix exponential, IEEE Trans. Automatic Control 23, 1978.
    """
    from scipy.linalg import expm

    density = np.zeros((6, 6))
    density[VELOCITY, VELOCITY] = ins.velocity_random_walk_mps_per_sqrt_s**2
    density[TILT, TILT] = (np.deg2rad(ins.angle_random_walk_deg_per_sqrt_h) / 60.0) ** 2
    density[RANDOM, RANDOM] = 2.0 / ins.gyro_correlation_s * (DPH * ins.gyro_random_dph) ** 2
    # In units in which every entry of A is near the Schuler rate: in SI units the small states drown in rounding.
    gravity = -matrix[VELOCITY, TILT]
    rate = np.sqrt(gravity * matrix[TILT, VELOCITY])
    unit = np.array([1.0, rate, rate**2 / gravity, rate**3 / gravity, rate**4 / gravity, rate**3 / gravity])
    change = matrix * unit / unit[:, None]
    block = np.block([[-change, density / np.outer(unit, unit)], [np.zeros((6, 6)), change.T]]) * step_s
    exponential = expm(block)
    transition = exponential[6:, 6:].T
    covariance = transition @ exponential[:6, 6:] * np.outer(unit, unit)
    return transition * unit[:, None] / unit, 0.5 * (covariance + covariance.T)


def channel_truth(
    ins: InsClass,
    epochs: int,
    step_s: float,
    rng: np.random.Generator,
    *,
    channels: int = 2,
    gravity_mps2: float = MPS2_PER_G,
    radius_m: float = RADIUS_M,
) -> ChannelTruth:
    """Draw channels of the filter's own model, x' = A x + noise.

    They are stepped with the exact exponential.

    Parameters
    ----------
    ins : InsClass
        Its initial sigmas, gyro constant, trend and random drift, velocity and angle random walk. The rest of the
        class (accelerometers, azimuth, deflection) has no place in the model.
    epochs : int
    step_s : float
    rng : numpy.random.Generator
    channels : int
    gravity_mps2, radius_m : float
        Gravity and radius of the model; the filter to match needs the same.
    """
    transition, factor = _step_of(ins, step_s, gravity_mps2, radius_m)
    states = rng.standard_normal((channels, epochs, 6))
    states[:, 0] *= channel_sigmas(ins)
    _step(states, transition, factor)
    return ChannelTruth(states)


@lru_cache(maxsize=16)
def _step_of(ins: InsClass, step_s: float, gravity_mps2: float, radius_m: float) -> tuple[FloatArray, FloatArray]:
    """Return the transition of a step and the factor of its noise, shapes (6, 6).

    The factor makes the noise of unit white noise.
    """
    matrix = channel_matrix(1.0 / ins.gyro_correlation_s, gravity_mps2, radius_m)
    transition, covariance = channel_noise(ins, matrix, step_s)
    is_driven = np.diag(covariance) > 1e-40  # the constant drift and its trend are not; rounding must not drive them
    scale = np.sqrt(
        np.where(is_driven, np.diag(covariance), 1.0)
    )  # from 1e-14 rad/s to 1e-4 m/s: correlate, then factor
    covariance = np.where(is_driven[:, None] & is_driven[None, :], covariance, 0.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return frozen(transition), frozen(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


@compiled
def _step(states, transition, factor):  # type: ignore[no-untyped-def]
    """Turn unit white noise (rows from the second on) into states, in place."""
    channels, epochs, size = states.shape
    noise = np.zeros(size)
    for channel in range(channels):
        for k in range(1, epochs):
            for i in range(size):
                noise[i] = states[channel, k, i]
            for i in range(size):
                total = 0.0
                for j in range(size):
                    total += transition[i, j] * states[channel, k - 1, j] + factor[i, j] * noise[j]
                states[channel, k, i] = total
