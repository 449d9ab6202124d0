"""Errors of INS, barometric altimeter and clocks of the aircraft of a session.

They are drawn without integration error. Local frame: position is the integral of a Gauss-Markov velocity error, a
clock's offset that of a Gauss-Markov frequency offset; both pairs are stepped with the exact transition and covariance.
Global frame: the full linear error propagation of :mod:`groundstation.simulation.ins_errors` on a platform slaved to
north.

Source: Van Loan, Computing integrals involving the matrix exponential, 1978 (the covariance of a step, here in closed
form); Gelb, Applied Optimal Estimation, 1974, section 3.8.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.simulation.ins_errors import InsErrors, SensorErrors, TrueMotion, propagate
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.session_motion import AircraftMotion
from groundstation.simulation.session_scenario import SessionErrorSigmas, SessionScenario

RAD_PER_ARCSEC = float(np.deg2rad(1.0 / 3600.0))
SMALL_STEP = (
    1e-3  # share of the correlation time below which the closed form of the variance loses digits, not its series
)


@dataclass(frozen=True)
class VehicleErrors:
    """Errors of one aircraft over the grid; error = reading - truth.

    Parameters
    ----------
    position_m, velocity_mps : ndarray, shape (n, 2)
        North and east.
    tilt_rad, drift_radps : ndarray, shape (n, 3)
        Tilt and drift of the platform about north, east and down; zeros in a local frame.
    height_m : ndarray, shape (n,)
        Error of the barometric height, up positive.
    clock_m, clock_mps : ndarray, shape (n,)
        Offset and frequency offset of the link's clock, times the speed of light.
    receiver_clock_m, receiver_clock_mps : ndarray, shape (n,)
        Errors of the satellite receiver's clock; the same arrays where there is one clock.
    """

    position_m: FloatArray
    velocity_mps: FloatArray
    tilt_rad: FloatArray
    drift_radps: FloatArray
    height_m: FloatArray
    clock_m: FloatArray
    clock_mps: FloatArray
    receiver_clock_m: FloatArray
    receiver_clock_mps: FloatArray

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            object.__setattr__(self, name, frozen(value))


def integrated_gauss_markov(
    rng: np.random.Generator, shape: tuple[int, ...], step_s: float, start: float, sigma: float, correlation_s: float
) -> tuple[FloatArray, FloatArray]:
    """Draw a stationary Gauss-Markov process and its integral.

    The integral starts at ``start`` (one sigma).

    Parameters
    ----------
    shape : tuple of int
        Time runs along the last axis.

    Returns
    -------
    integral, process : ndarrays of that shape

    Notes
    -----
    With e = exp(-h / tau): the process keeps e of itself, the integral gains tau (1 - e) of it; the covariance of what
    is added in a step h is sigma^2 [1 - e^2, tau (1 - e)^2; ., 2 tau h - tau^2 (3 - 4 e + e^2)].
    """
    ratio = step_s / correlation_s
    lost = -np.expm1(-ratio)
    rate_variance = -np.expm1(-2.0 * ratio)
    cross = correlation_s * lost**2
    if ratio < SMALL_STEP:
        variance = correlation_s**2 * ratio**3 * (2.0 / 3.0 - ratio / 2.0 + 7.0 * ratio**2 / 30.0)
    else:
        variance = correlation_s**2 * (2.0 * ratio - 2.0 * lost - lost**2)
    offset = start * rng.standard_normal((*shape[:-1], 1))
    process = np.empty(shape)
    process[..., :1] = sigma * rng.standard_normal((*shape[:-1], 1))
    white = rng.standard_normal((2, *shape[:-1], shape[-1] - 1))
    added = sigma * np.sqrt(rate_variance) * white[0]
    rest = np.sqrt(max(variance - cross**2 / rate_variance, 0.0)) if rate_variance > 0.0 else 0.0
    moved = sigma * (cross / np.sqrt(rate_variance) * white[0] + rest * white[1])
    from scipy.signal import lfilter

    keep = 1.0 - lost
    process[..., 1:] = lfilter([1.0], [1.0, -keep], added, axis=-1, zi=keep * process[..., :1])[0]
    gained = correlation_s * lost * process[..., :-1] + moved
    return np.concatenate([offset, offset + np.cumsum(gained, axis=-1)], axis=-1), process


def draw_errors(
    scenario: SessionScenario, motion: AircraftMotion, height_above_m: float, rng: np.random.Generator
) -> VehicleErrors:
    """Draw the errors of one aircraft that flies at a constant height."""
    errors, n = scenario.errors, len(motion.time_s)
    step_s = float(motion.time_s[1] - motion.time_s[0])
    height = gauss_markov(rng, (n,), step_s, errors.baro_m, errors.baro_s)
    clock = integrated_gauss_markov(rng, (n,), step_s, errors.clock_m, errors.clock_mps, errors.clock_s)
    receiver = clock
    if errors.has_separate_clocks:
        receiver = integrated_gauss_markov(rng, (n,), step_s, errors.clock_m, errors.clock_mps, errors.clock_s)
    if scenario.frame == "local":
        position, velocity = integrated_gauss_markov(
            rng, (2, n), step_s, errors.position_m, errors.velocity_mps, errors.velocity_s
        )
        nothing = np.zeros((n, 3))
        return VehicleErrors(position.T, velocity.T, nothing, nothing, height, *clock, *receiver)
    inertial, drift = _inertial_errors(errors, motion, height_above_m, rng)
    tilt = np.stack([inertial.tilt_rad[0, :, 1], -inertial.tilt_rad[0, :, 0], -inertial.azimuth_rad[0]], axis=-1)
    return VehicleErrors(inertial.position_m[0], inertial.velocity_mps[0], tilt, drift, height, *clock, *receiver)


def _inertial_errors(
    errors: SessionErrorSigmas, motion: AircraftMotion, height_above_m: float, rng: np.random.Generator
) -> tuple[InsErrors, FloatArray]:
    n = len(motion.time_s)
    step_s = float(motion.time_s[1] - motion.time_s[0])
    drift = gauss_markov(rng, (3, n), step_s, errors.gyro_dph * RAD_PER_ARCSEC, errors.gyro_s).T
    start = rng.standard_normal((4, 2))
    sensors = replace(
        SensorErrors.none(1, n),
        gyro_radps=np.ascontiguousarray(drift)[None],
        position_m=errors.position_m * start[None, 0],
        velocity_mps=errors.velocity_mps * start[None, 1],
        tilt_rad=errors.tilt_arcsec * RAD_PER_ARCSEC * start[None, 2],
        azimuth_rad=errors.azimuth_arcmin * 60.0 * RAD_PER_ARCSEC * start[3, :1],
    )
    flown = TrueMotion(
        motion.time_s,
        motion.latitude_deg,
        np.full(n, height_above_m),
        motion.velocity_mps[:, 0],
        motion.velocity_mps[:, 1],
        motion.velocity_mps[:, 2],
        motion.track_deg,
        np.zeros(n),
    )
    return propagate(flown, sensors, body_fixed=False), drift
