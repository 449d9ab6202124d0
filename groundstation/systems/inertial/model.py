"""Error model of one horizontal channel: six states, transition, process noise.

The transition is the exact exponential or the paper's I + A T. Shared by both channels: neither the transition nor the
noise depends on which way is north.
"""

import math
from functools import lru_cache
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import SEMI_MAJOR_M, curvature_radii_m
from groundstation.base.records import frozen

FloatArray = NDArray[np.float64]
Transition = Literal["exact", "first_order"]

STATES = ("position", "velocity", "tilt", "drift", "drift_rate", "random_drift")
POSITION, VELOCITY, TILT, DRIFT, DRIFT_RATE, RANDOM_DRIFT = range(6)
SIZE = len(STATES)
LONGEST_STEP_S = 10.0  # of the process noise: Simpson's rule is good to (Schuler rate x step)^4, 3e-8
FIRST_ORDER_STEP_S = 1.0  # I + A T gains 0.8e-6 of amplitude a second at this step

GRAVITY_EQUATOR_MPS2, GRAVITY_POLE_FACTOR = 9.7803253359, 0.00193185265241  # WGS-84, Somigliana
GRAVITY_ECCENTRICITY_SQUARED = 0.00669437999013
KEPT_NOISES = 4096  # of the process noises made last: 288 bytes each, the same few are asked for again and again


@overload
def normal_gravity_mps2(latitude_deg: float, altitude_m: float) -> float: ...
@overload
def normal_gravity_mps2(latitude_deg: FloatArray, altitude_m: FloatArray) -> FloatArray: ...
def normal_gravity_mps2(latitude_deg: ArrayLike, altitude_m: ArrayLike) -> float | FloatArray:
    """Return the normal gravity, m/s^2, at latitudes and altitudes above the ellipsoid.

    Numbers give a number, arrays an array.

    Source: NIMA TR8350.2, 2000, equations 4-1 and 4-3 (the first two terms of the height).

    Examples
    --------
    >>> round(normal_gravity_mps2(45.0, 0.0), 5)
    9.8062
    >>> normal_gravity_mps2(np.array([0.0, 90.0]), np.array([0.0, 10_000.0])).round(5).tolist()
    [9.78033, 9.80135]
    """
    sine_squared = np.sin(np.deg2rad(np.asarray(latitude_deg, dtype=np.float64))) ** 2
    at_zero = (
        GRAVITY_EQUATOR_MPS2
        * (1.0 + GRAVITY_POLE_FACTOR * sine_squared)
        / np.sqrt(1.0 - GRAVITY_ECCENTRICITY_SQUARED * sine_squared)
    )
    gravity = np.asarray(at_zero * (1.0 - 2.0 * np.asarray(altitude_m, dtype=np.float64) / SEMI_MAJOR_M))
    return gravity if gravity.ndim else float(gravity)


@dataclass(frozen=True)
class ChannelModel:
    """Error dynamics of one channel.

    x = [position error m, velocity error m/s, platform tilt rad, constant gyro drift rad/s, its derivative rad/s^2,
    random gyro drift rad/s]; position' = velocity, velocity' = -g tilt, tilt' = velocity / R + drift + random drift,
    drift' = drift rate, random drift' = -beta random drift + noise.

    Parameters
    ----------
    gravity_mps2, radius_m : float
        g and R; the Schuler rate is sqrt(g / R).
    beta_per_s : float
        Inverse correlation time of the random drift.
    transition : {'exact', 'first_order'}
        The matrix exponential, or the paper's I + A T at steps of at most one second.

    Source: Neusypin, Smolkin, Kharin, Kopelovich, Staroverov, Herald of BMSTU, 2003 (matrix A).
    """

    gravity_mps2: float
    radius_m: float
    beta_per_s: float
    transition: Transition = "exact"

    @classmethod
    def at(
        cls, latitude_deg: float, altitude_m: float, beta_per_s: float, transition: Transition = "exact"
    ) -> "ChannelModel":
        """The model of a place: normal gravity, mean of the two radii of curvature plus altitude.

        Examples
        --------
        >>> round(ChannelModel.at(0.0, 0.0, 1 / 3600).schuler_period_min, 1)
        84.4
        """
        meridian, prime_vertical = curvature_radii_m(latitude_deg)
        radius = math.sqrt(float(meridian) * float(prime_vertical)) + altitude_m
        return cls(normal_gravity_mps2(latitude_deg, altitude_m), radius, beta_per_s, transition)

    @property
    def schuler_rate_radps(self) -> float:
        """Schuler rate sqrt(g / R), rad/s."""
        return math.sqrt(self.gravity_mps2 / self.radius_m)

    @property
    def schuler_period_min(self) -> float:
        """Schuler period, minutes."""
        return 2.0 * math.pi / self.schuler_rate_radps / 60.0

    def matrix(self) -> FloatArray:
        """A of x' = A x, shape (6, 6), SI units."""
        out = np.zeros((SIZE, SIZE))
        out[POSITION, VELOCITY] = 1.0
        out[VELOCITY, TILT] = -self.gravity_mps2
        out[TILT, VELOCITY] = 1.0 / self.radius_m
        out[TILT, DRIFT] = out[TILT, RANDOM_DRIFT] = 1.0
        out[DRIFT, DRIFT_RATE] = 1.0
        out[RANDOM_DRIFT, RANDOM_DRIFT] = -self.beta_per_s
        return out

    def transition_over(self, seconds: float) -> FloatArray:
        """Transition matrix over a time, shape (6, 6)."""
        if self.transition == "exact":
            return self._exponential(seconds)
        steps = max(1, math.ceil(seconds / FIRST_ORDER_STEP_S - 1e-9))
        return np.linalg.matrix_power(np.eye(SIZE) + self.matrix() * (seconds / steps), steps)

    def _exponential(self, seconds: float) -> FloatArray:
        """Return exp(A t) in closed form.

        It is the Schuler oscillator driven by a start, a step, a ramp and an exponential.
        """
        rate, beta, g = self.schuler_rate_radps, self.beta_per_s, self.gravity_mps2
        radius, t = self.radius_m, seconds
        sine, cosine = math.sin(rate * t), math.cos(rate * t)
        versine = 2.0 * math.sin(0.5 * rate * t) ** 2  # 1 - cos without cancellation
        lag = t - sine / rate
        decay = math.exp(-beta * t)
        decayed = -math.expm1(-beta * t) / beta if beta > 0.0 else t  # integral of the decay
        both = rate * rate + beta * beta
        out = np.eye(SIZE)
        out[POSITION, VELOCITY:] = (
            sine / rate,
            -radius * versine,
            -radius * lag,
            -radius * (0.5 * t * t - versine / rate**2),
            -g / both * (decayed - sine / rate + beta * versine / rate**2),
        )
        out[VELOCITY, VELOCITY:] = (
            cosine,
            -g * sine / rate,
            -radius * versine,
            -radius * lag,
            -g / both * (decay - cosine + beta * sine / rate),
        )
        out[TILT, VELOCITY:] = (
            sine * rate / g,
            cosine,
            sine / rate,
            versine / rate**2,
            (beta * (cosine - decay) + rate * sine) / both,
        )
        out[DRIFT, DRIFT_RATE] = t
        out[RANDOM_DRIFT, RANDOM_DRIFT] = decay
        return out

    def process_noise_over(self, seconds: float, density: FloatArray) -> FloatArray:
        """Covariance that white noise adds over a time, shape (6, 6), read-only.

        Parameters
        ----------
        seconds : float
        density : ndarray, shape (6,)
            Power spectral density that enters each state, unit of the state squared per second.

        Simpson's rule over steps of at most :data:`LONGEST_STEP_S`.
        """
        return _noise_over(self, float(seconds), tuple(np.asarray(density).tolist()))


@lru_cache(KEPT_NOISES)
def _noise_over(model: ChannelModel, seconds: float, density: tuple[float, ...]) -> FloatArray:
    """Return what :meth:`ChannelModel.process_noise_over` says."""
    steps = max(1, math.ceil(seconds / LONGEST_STEP_S - 1e-9))
    step = seconds / steps
    whole, half = model.transition_over(step), model.transition_over(0.5 * step)
    noise = np.diag(density)
    once = step / 6.0 * (noise + 4.0 * half @ noise @ half.T + whole @ noise @ whole.T)
    total = once
    for _ in range(steps - 1):
        total = whole @ total @ whole.T + once
    return frozen(0.5 * (total + total.T))
