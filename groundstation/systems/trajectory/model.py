"""Numbers of the model: noise of the unit, errors of GNSS, sigmas at the start."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import MPS2_PER_G
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.states import (
    BA,
    BARO,
    BG,
    FAST,
    HEIGHT,
    LAG,
    LAT,
    LEV,
    MA,
    MG,
    MNT,
    NO_SLIP,
    POSITION,
    SA,
    SG,
    SLOW,
    STATES,
    VELOCITY,
    WHEEL,
    WHL,
    FloatArray,
    Gate,
    Noise,
)

DEG = np.pi / 180.0
HOUR = 3600.0
AID_LATE_S = 0.1  # sigma of the time of a barometer and of wheels, whose lag is not estimated


@dataclass(frozen=True)
class Model:
    """Noise of the unit and errors of the aids; what the fit changes.

    Parameters
    ----------
    gyro_noise_deg_rth, accel_noise_mps_rth : float
        Angle and velocity random walk, deg and m/s in the square root of an hour.
    gyro_walk_dps_rth, accel_walk_mg_rth : float
        Random walk of the biases: deg/s, and mg, in the square root of an hour.
    position_scale, velocity_scale : float
        White error of GNSS beside the sigma that the receiver states.
    velocity_down_scale : float
        That of the vertical velocity beside the horizontal one.
    position_floor_m, velocity_floor_mps : float
        White error however small the stated sigma.
    slow_scale, fast_scale : float
        Sigma of the slow and the fast error of GNSS position beside the stated sigma's median.
    slow_s, fast_s : float
        Their correlation times.
    slip_mps : float
        Sigma of the sideways and upward velocity of what rolls.
    gyro_imperfection, accel_imperfection : float
        Sigmas of scale factors and misalignments beside those of :class:`StartSigmas`.
    slip_walk_deg_rts : float
        Random walk of the direction of travel in the unit, deg in the square root of a second: slip lasts for seconds
        to minutes, in bends, on a crowned road, by the wind.
    baro_m : float
        White error of the barometric height, in means of a second.
    baro_walk_m_rth : float
        Random walk of its offset, m in the square root of an hour; its correlation time is an hour.
    wheel_mps : float
        White error of the speed of the wheels.
    jitter_s : float
        Sigma of the stamps of GNSS against those of the unit.
    """

    gyro_noise_deg_rth: float = 0.6
    accel_noise_mps_rth: float = 0.12
    gyro_walk_dps_rth: float = 0.05
    accel_walk_mg_rth: float = 3.0
    position_scale: float = 0.5
    velocity_scale: float = 1.0
    velocity_down_scale: float = 1.0
    position_floor_m: float = 0.005
    velocity_floor_mps: float = 0.01
    slow_scale: float = 1.0
    fast_scale: float = 0.5
    slow_s: float = 300.0
    fast_s: float = 10.0
    slip_mps: float = 0.1
    slip_walk_deg_rts: float = 0.05
    baro_m: float = 0.4
    baro_walk_m_rth: float = 10.0
    wheel_mps: float = 0.1
    jitter_s: float = 0.003
    gyro_imperfection: float = 1.0
    accel_imperfection: float = 1.0

    def noise(self, sigma_m: FloatArray) -> Noise:
        """Return the numbers as the loops take them.

        ``sigma_m`` (3,) is the median of the stated sigmas.
        """
        root = np.sqrt(HOUR)
        return Noise(
            np.array(
                [
                    (self.gyro_noise_deg_rth * DEG / root) ** 2,
                    (self.accel_noise_mps_rth / root) ** 2,
                    (self.gyro_walk_dps_rth * DEG / root) ** 2,
                    (self.accel_walk_mg_rth * 1e-3 * MPS2_PER_G / root) ** 2,
                    (self.slip_walk_deg_rts * DEG) ** 2,
                ]
            ),
            np.array([self.slow_s, self.fast_s, HOUR]),
            np.concatenate(
                [(self.slow_scale * sigma_m) ** 2, (self.fast_scale * sigma_m) ** 2, [0.5 * self.baro_walk_m_rth**2]]
            ),
        )

    def weighted(self, seen: Observations) -> Observations:
        """Return the observations with the variances of this model."""
        variance = np.array(seen.variance)
        for kind, scale, floor in (
            (POSITION, self.position_scale, self.position_floor_m),
            (VELOCITY, self.velocity_scale, self.velocity_floor_mps),
            (NO_SLIP, self.slip_mps, 0.0),
            (HEIGHT, self.baro_m, 0.0),
            (WHEEL, self.wheel_mps, 0.0),
        ):
            of = seen.kind == kind
            late_s = AID_LATE_S if kind in (HEIGHT, WHEEL) else self.jitter_s
            variance[of] = variance[of] * scale**2 + floor**2 + (seen.change[of] * late_s) ** 2
        variance[seen.kind == VELOCITY, 2] *= self.velocity_down_scale**2
        return replace(seen, variance=variance)

    def changed(self, factors: dict[str, float]) -> "Model":
        """Return the model with some numbers multiplied."""
        return replace(self, **{name: getattr(self, name) * factor for name, factor in factors.items()})


@dataclass(frozen=True)
class StartSigmas:
    """Sigmas of the constants at the start of a pass."""

    gyro_bias_dps: float = 1.0
    accel_bias_mg: float = 50.0
    gyro_scale: float = 0.005
    misalignment_deg: float = 0.3
    accel_scale: float = 0.005
    accel_square_deg: float = 0.3
    lever_m: float = 1.0
    latency_s: float = 0.2
    lag_s: float = 0.1
    mounting_deg: float = 5.0
    baro_m: float = 5.0
    wheel_scale: float = 0.03

    def variances(
        self, noise: Noise, model: Model, *, has_latency: bool, has_slip: bool, has_baro: bool, has_wheels: bool
    ) -> FloatArray:
        """Return the variances of the states from BG on, shape (STATES,).

        Those of navigation are zero.
        """
        v = np.zeros(STATES)
        v[BG : BG + 3] = (self.gyro_bias_dps * DEG) ** 2
        v[BA : BA + 3] = (self.accel_bias_mg * 1e-3 * MPS2_PER_G) ** 2
        v[SG : SG + 3] = (model.gyro_imperfection * self.gyro_scale) ** 2
        v[MG : MG + 6] = (model.gyro_imperfection * self.misalignment_deg * DEG) ** 2
        v[SA : SA + 3] = (model.accel_imperfection * self.accel_scale) ** 2
        v[MA : MA + 3] = (model.accel_imperfection * self.accel_square_deg * DEG) ** 2
        v[LEV : LEV + 3] = self.lever_m**2
        v[LAT] = self.latency_s**2 if has_latency else 0.0
        v[LAG] = self.lag_s**2 if has_latency else 0.0
        v[SLOW:FAST] = noise.variance[:3]
        v[FAST:MNT] = noise.variance[3:6]
        v[MNT:BARO] = (self.mounting_deg * DEG) ** 2 if has_slip else 0.0
        v[BARO] = self.baro_m**2 if has_baro else 0.0
        v[WHL] = self.wheel_scale**2 if has_wheels else 0.0
        return v


def gate(sigmas: float = 5.0) -> Gate:
    """Return the rules of the gate."""
    opened = np.concatenate([np.full(3, 5.0**2), np.full(3, 2.0**2), np.full(2, (3.0 * DEG) ** 2), [(10.0 * DEG) ** 2]])
    return Gate(sigmas**2, 10, opened)
