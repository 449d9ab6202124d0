"""Antenna arm and GNSS-INS time offset, from the turns.

The middle of the main-gear axle moves along the nose; an antenna a metres ahead of it moves sideways with omega x a.
With S the measured speed of the antenna, sin(track - heading) = a omega / S exactly, so in turns

    sin(d - error) = -a omega / S + (time offset) omega + noise,

the offset being the age of the GNSS velocity at its time stamp. At one speed arm and offset cannot be told
apart: the prior of the offset bounds what the arm may be.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import DEG_PER_RAD
from groundstation.methods.taxi.gating import NOT_TAXI
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.methods.taxi_error.interval import HeadingDifferences, Regressor, fixed_noise_estimate, misfit
from groundstation.methods.taxi_error.priors import PRIOR_MEAN
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftData

FloatArray = NDArray[np.float64]
ERROR_PRIOR_SIGMA_DEG = 0.3  # of the median of the straight samples, as the error that the turns share
LEAST_TURNING = 10  # samples
LARGEST_SINE = 0.5  # sideways speed of the antenna over its speed: beyond, the tyres slip


@dataclass(frozen=True)
class ArmKnowledge:
    """Knowledge of lever arm and time offset before the straight samples are used.

    Parameters
    ----------
    arm_m, arm_sigma_m, offset_s, offset_sigma_s : float
        Means and standard deviations (aircraft file, turns or prior).
    applied_arm_m : float
        Arm taken out of the velocities (0 where it is neither known nor observable).
    origin : {'aircraft file', 'estimated', 'not observable'}
    is_offset_observable : bool
    """

    arm_m: float
    arm_sigma_m: float
    offset_s: float
    offset_sigma_s: float
    applied_arm_m: float
    origin: str
    is_offset_observable: bool


def know_arm(samples: TaxiSamples, aircraft: AircraftData, settings: HeadingSettings) -> ArmKnowledge:
    """Arm and time offset from the aircraft file and the turns.

    Parameters
    ----------
    samples : TaxiSamples
        Gated, with the velocities of the antenna.
    """
    is_known = aircraft.antenna_arm_m is not None
    arm = aircraft.antenna_arm_m if aircraft.antenna_arm_m is not None else settings.arm_prior_m
    arm_sigma = aircraft.antenna_arm_sigma_m if is_known else settings.arm_prior_sigma_m
    offset, offset_sigma = 0.0, settings.offset_prior_sigma_s
    turning = _turning(samples, settings)
    if turning.sum() >= LEAST_TURNING and samples.interval_s <= settings.arm_interval_max_s:
        (arm, offset), (arm_sigma, offset_sigma) = _from_turns(samples, turning, (arm, arm_sigma), settings)
    is_observable = arm_sigma <= settings.arm_observable_sigma_m
    origin = "aircraft file" if is_known else "estimated" if is_observable else "not observable"
    return ArmKnowledge(
        arm_m=arm,
        arm_sigma_m=arm_sigma,
        offset_s=offset,
        offset_sigma_s=offset_sigma,
        applied_arm_m=aircraft.antenna_arm_m if aircraft.antenna_arm_m is not None else arm if is_observable else 0.0,
        origin=origin,
        is_offset_observable=offset_sigma <= settings.offset_observable_sigma_s,
    )


def _turning(samples: TaxiSamples, settings: HeadingSettings) -> NDArray[np.bool_]:
    """Find moving epochs outside the straight samples that turn slowly enough.

    Their antenna moves sideways no faster than the method holds.
    """
    speed = np.maximum(samples.speed_mps, 1e-3)
    with np.errstate(invalid="ignore"):
        sine = np.abs(np.deg2rad(samples.arm_rate_dps)) * settings.arm_prior_m / speed
        turning = (
            ~samples.is_used
            & (speed > settings.arm_speed_min_mps)
            & (speed < settings.taxi_speed_max_mps)
            & np.isfinite(samples.heading_deg)
            & (sine < LARGEST_SINE)
            & ~(samples.geometry > settings.geometry_max)
            & ~(samples.integrity == 0.0)
        )
    if samples.ground_method:
        turning &= samples.on_ground
    return np.asarray(turning & ~np.isin(samples.gate, ["excluded", "outlier", "too fast", *NOT_TAXI]))


def _from_turns(
    samples: TaxiSamples, turning: NDArray[np.bool_], arm: tuple[float, float], settings: HeadingSettings
) -> tuple[tuple[float, float], tuple[float, float]]:
    difference = samples.difference_deg
    error = float(wrap_180(np.median(wrap_180(difference[samples.is_used] - difference[samples.is_used][0]))))
    error += float(difference[samples.is_used][0])
    sine = np.sin(np.deg2rad(wrap_180(difference[turning] - error)))
    rate, speed = samples.arm_rate_dps[turning], samples.speed_mps[turning]
    index = np.flatnonzero(turning)
    keep = np.abs(sine) < LARGEST_SINE
    if keep.sum() < LEAST_TURNING:
        return (arm[0], 0.0), (arm[1], settings.offset_prior_sigma_s)
    differences = HeadingDifferences(
        time_s=samples.time_s[index][keep],
        difference_deg=sine[keep] * DEG_PER_RAD,
        direction_deg=wrap_360(samples.heading_deg[index][keep] - error),
        speed_mps=speed[keep],
        regressors=(
            Regressor(-rate[keep] / speed[keep], *arm),
            Regressor(rate[keep], 0.0, settings.offset_prior_sigma_s),
        ),
        error_prior_deg=(0.0, ERROR_PRIOR_SIGMA_DEG),
    )
    mean, sigma = fixed_noise_estimate(differences, PRIOR_MEAN[None, :])
    excess = np.sqrt(max(misfit(differences, PRIOR_MEAN), 1.0))
    return (float(mean[1]), float(mean[2])), (
        min(float(sigma[1] * excess), arm[1]),
        min(float(sigma[2] * excess), settings.offset_prior_sigma_s),
    )


def straight_regressors(samples: TaxiSamples, knowledge: ArmKnowledge) -> tuple[Regressor, ...]:
    """Return regressors of the straight samples for the rest of arm and time offset.

    They tell what both may still do inside the gates. ``samples`` are the used ones, with ``applied_arm_m`` taken out.
    """
    rate = np.nan_to_num(samples.arm_rate_dps)
    per_metre = -rate / samples.speed_mps
    return (
        Regressor(per_metre, knowledge.arm_m - knowledge.applied_arm_m, max(knowledge.arm_sigma_m, 1e-3)),
        Regressor(rate, knowledge.offset_s, max(knowledge.offset_sigma_s, 1e-4)),
    )
