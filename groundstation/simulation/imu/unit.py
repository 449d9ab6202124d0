"""Inertial unit: what it measures, and the stamps of its log."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.imu.imu_class import ImuClass
from groundstation.simulation.imu.motion import Motion, exact_increments, true_states
from groundstation.simulation.imu.settings import ImuSettings, MountingSettings, StampSettings, VibrationSettings
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.scenario import LogInterval

FloatArray = NDArray[np.float64]
SECONDS_PER_HOUR = 3600.0
TONES = (1.0, 1.37, 2.13)  # of a vibration, times its frequency


@dataclass(frozen=True)
class SensorErrors:
    """Errors of three gyros or three accelerometers in the axes of the case.

    measured = (I + matrix) true + bias + noise, in rad/s or m/s^2. ``bias`` has the shape (n, 3), ``walk`` is the sigma
    of the noise of an increment over the root of its interval.
    """

    matrix: FloatArray
    bias: FloatArray
    walk: float
    resolution: float


def draw_errors(
    unit: ImuClass, rng: np.random.Generator, count: int, settings: ImuSettings
) -> tuple[SensorErrors, SensorErrors]:
    """Draw the errors of the gyros and of the accelerometers of one unit of a class."""
    micro_g = 1e-6 * MPS2_PER_G
    dph = np.deg2rad(1.0 / SECONDS_PER_HOUR)
    factor, step_s = settings.error_factor, 1.0 / settings.rate_hz
    gyro = _draw(
        rng,
        count,
        step_s,
        constant=factor * unit.gyro_constant_dph * dph,
        random=factor * unit.gyro_random_dph * dph,
        correlation_s=unit.gyro_correlation_s,
        matrix=_matrix(rng, factor, unit.gyro_scale_factor_ppm, unit.gyro_cross_axis_ppm, settings),
        walk=factor * np.deg2rad(unit.angle_random_walk_deg_per_sqrt_h) / np.sqrt(SECONDS_PER_HOUR),
        resolution=np.deg2rad(unit.rate_resolution_dps) if factor else 0.0,
    )
    accelerometer = _draw(
        rng,
        count,
        step_s,
        constant=factor * unit.accelerometer_constant_ug * micro_g,
        random=factor * unit.accelerometer_random_ug * micro_g,
        correlation_s=unit.accelerometer_correlation_s,
        matrix=_matrix(rng, factor, unit.accelerometer_scale_factor_ppm, unit.accelerometer_cross_axis_ppm, settings),
        walk=factor * unit.velocity_random_walk_mps_per_sqrt_s,
        resolution=unit.acceleration_resolution_mps2 if factor else 0.0,
    )
    return gyro, accelerometer


def _draw(
    rng: np.random.Generator,
    count: int,
    step_s: float,
    *,
    constant: float,
    random: float,
    correlation_s: float,
    matrix: FloatArray,
    walk: float,
    resolution: float,
) -> SensorErrors:
    bias = constant * rng.standard_normal(3) + gauss_markov(rng, (3, count), step_s, random, correlation_s).T
    return SensorErrors(matrix, bias, float(walk), float(resolution))


def _matrix(
    rng: np.random.Generator, factor: float, scale_ppm: float, cross_ppm: float, settings: ImuSettings
) -> FloatArray:
    """Draw scale factors on the diagonal and misalignments beside it."""
    scale = 1e-6 * scale_ppm if settings.scale_factor is None else settings.scale_factor
    cross = 1e-6 * cross_ppm if settings.misalignment_deg is None else float(np.deg2rad(settings.misalignment_deg))
    sigma = np.where(np.eye(3, dtype=bool), scale, cross)
    return np.asarray(factor * sigma * rng.standard_normal((3, 3)))


def case_from_body(mounting: MountingSettings) -> FloatArray:
    """Return the matrix that turns vectors of the body to the axes of the case, shape (3, 3)."""
    turns = rotation_n_from_b(np.array([mounting.axes_deg, mounting.small_deg]))
    matrix = (turns[0] @ turns[1]).T
    if mounting.mirrored:
        matrix = matrix.copy()
        matrix["xyz".index(mounting.mirrored)] *= -1.0
    return np.asarray(matrix)


def measured(
    motion: Motion,
    end_s: FloatArray,
    errors: tuple[SensorErrors, SensorErrors],
    rng: np.random.Generator,
    settings: ImuSettings,
) -> tuple[FloatArray, FloatArray]:
    """Return the increments of angle and of velocity that a unit measures, shape (n, 3) each.

    Parameters
    ----------
    motion : Motion
    end_s : ndarray, shape (n,)
        True ends of the intervals, each 1 / rate long.
    errors : pair of SensorErrors
        Of the gyros and of the accelerometers.
    rng : numpy.random.Generator
    settings : ImuSettings
    """
    step_s = 1.0 / settings.rate_hz
    if settings.is_integral:
        true = exact_increments(motion, end_s - step_s, end_s)
    else:
        states = true_states(motion, end_s)
        true = step_s * np.concatenate([states.rate_radps, states.force_mps2], axis=1)
    true = true + _vibration(settings.vibration, end_s, step_s, rng, is_integral=settings.is_integral)
    case = case_from_body(settings.mounting)
    found = []
    for sensor, part in zip(errors, (true[:, :3], true[:, 3:]), strict=True):
        noise = sensor.walk * np.sqrt(step_s) * rng.standard_normal(part.shape)
        one = part @ ((np.eye(3) + sensor.matrix) @ case).T + sensor.bias * step_s + noise
        found.append(_in_steps(one, sensor.resolution * step_s, is_integral=settings.is_integral))
    return found[0], found[1]


def _in_steps(increments: FloatArray, step: float, *, is_integral: bool) -> FloatArray:
    """Round to whole steps; a unit that integrates carries the rest to its next increment."""
    if step == 0.0:
        return increments
    if not is_integral:
        return np.asarray(step * np.rint(increments / step))
    return np.asarray(step * np.diff(np.rint(np.cumsum(increments, axis=0) / step), axis=0, prepend=0.0))


def _vibration(
    settings: VibrationSettings, end_s: FloatArray, step_s: float, rng: np.random.Generator, *, is_integral: bool
) -> FloatArray:
    """Increments of a vibration: integrals of its sines, or their samples times the interval."""
    sizes = np.array([np.deg2rad(settings.rate_dps)] * 3 + [settings.acceleration_mps2] * 3)
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(TONES), 6))
    total = np.zeros((len(end_s), 6))
    if not sizes.any():
        return total
    for tone, phase in zip(TONES, phases, strict=True):
        rate = 2.0 * np.pi * settings.frequency_hz * tone
        angle = rate * end_s[:, None] + phase
        if is_integral:
            total += (np.cos(angle - rate * step_s) - np.cos(angle)) / rate
        else:
            total += np.sin(angle) * step_s
    return np.asarray(total * sizes * np.sqrt(2.0 / len(TONES)))


def stamps(settings: StampSettings, end_s: FloatArray, step_s: float, rng: np.random.Generator) -> FloatArray:
    """Return the stamps of samples that truly end at some times, shape (n,)."""
    late = settings.jitter_s * rng.standard_normal(len(end_s))
    chance = rng.uniform(size=len(end_s))
    stamp = np.sort(end_s + late) if settings.jitter_s else end_s.copy()
    is_double = chance < settings.duplicated
    is_backward = ~is_double & (chance < settings.duplicated + settings.backward)
    is_double[:1] = is_backward[:1] = False
    before = np.concatenate([stamp[:1], stamp[:-1]])
    return np.where(is_double, before, np.where(is_backward, before - 1.5 * step_s, stamp))


def outside(time_s: FloatArray, intervals: tuple[LogInterval, ...]) -> BoolArray:
    """Tell which times lie in none of some intervals."""
    kept = np.ones(len(time_s), dtype=bool)
    for one in intervals:
        kept &= (time_s < one.from_s) | (time_s >= one.to_s)
    return kept
