"""Estimate of the heading error: posterior, drift, segments and directions.

It starts from gated samples.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import mean_heading, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.methods.taxi.samples import TaxiSamples, take_samples, without_arm
from groundstation.methods.taxi_error.interval import (
    HeadingDifferences,
    Regressor,
    StandstillVelocities,
    error_posterior,
    fixed_noise_estimate,
    sample_weights,
    without_apart,
)
from groundstation.methods.taxi_error.posterior import ErrorPosterior
from groundstation.systems.heading.answer import HeadingStep, TaxiSegment
from groundstation.systems.heading.arms import ArmKnowledge, know_arm, straight_regressors
from groundstation.systems.heading.recursion import Running, run_recursion
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.standstill import StandstillData
from groundstation.systems.heading.steady import SteadyPrior
from groundstation.systems.known import AircraftData

FloatArray = NDArray[np.float64]
DRAWS_FOR_PARTS = 24
MOST_SAMPLES = 3000  # of the honest interval; a longer taxi at a high rate is thinned
LEAST_DRIFT_S = 5.0
LEAST_IN_DIRECTION = 20  # samples
STEP_SIGMA_DEG = 0.05  # of the size of a step, read off the INS heading
MOST_STEPS = 8  # that have a coefficient each: time goes by the square of their number, and a single one is rejected
FLAT_DEG_PER_S = 1e3


@dataclass(frozen=True)
class Solution:
    """Everything found from the used samples.

    Parameters
    ----------
    samples, used : TaxiSamples
        All and the used ones, the applied arm taken out.
    differences : HeadingDifferences
        Of the used samples, without a jump at +-180 deg, the mean sideslip of a known wind taken off.
    posterior : ErrorPosterior
    without_wind_deg : ndarray, shape (n,)
        The differences less what the terms of the wind are found to make in each direction.
    growth_samples : ndarray of int64
        Numbers of used samples at which the posterior's growth was taken.
    running : Running
        The paper's recursion over the differences as measured.
    knowledge : ArmKnowledge
    uncorrected_deg : float
        Plain mean of the differences with the velocity of the antenna.
    weight : ndarray, shape of samples
        Weight in the estimate, mean 1 over the used samples, 0 elsewhere.
    reference_time_s : float
        Weighted mean time: the error belongs to it.
    drift_deg_per_h, drift_sigma_deg_per_h : float or None
    segments, directions : tuple of TaxiSegment
    parts : tuple of TaxiSegment
        The segments, long ones cut: what their errors say against each other is judged.
    wind_of_parts_deg : ndarray, shape (parts, terms)
        What one sigma of each term of the wind makes of the error of each part.
    steps : tuple of HeadingStep
    sideslip_deg : float or None
        Mean sideslip taken off, by the weights of the samples; None where no wind is known.
    mean_direction : (north, east)
        Mean of the unit vectors of motion, by those weights: a wind's part across it is what the sideslip is made by.
    """

    samples: TaxiSamples
    used: TaxiSamples
    differences: HeadingDifferences
    posterior: ErrorPosterior
    without_wind_deg: FloatArray
    growth_samples: NDArray[np.int64]
    running: Running
    knowledge: ArmKnowledge
    uncorrected_deg: float
    weight: FloatArray
    reference_time_s: float
    drift_deg_per_h: float | None
    drift_sigma_deg_per_h: float | None
    segments: tuple[TaxiSegment, ...]
    directions: tuple[TaxiSegment, ...]
    parts: tuple[TaxiSegment, ...]
    wind_of_parts_deg: FloatArray
    steps: tuple[HeadingStep, ...]
    sideslip_deg: float | None
    mean_direction: tuple[float, float]


def _centred(difference_deg: FloatArray) -> FloatArray:
    """Differences without a jump at +-180 deg: wrapped about their own direction."""
    centre = float(wrap_180(mean_heading(difference_deg)))
    return np.asarray(centre + wrap_180(difference_deg - centre))


def _differences(
    used: TaxiSamples, knowledge: ArmKnowledge, steady: SteadyPrior, steps: tuple[HeadingStep, ...]
) -> HeadingDifferences:
    difference = _centred(used.difference_deg)
    direction = wrap_360(used.heading_deg - np.median(difference))
    difference = difference - steady.sideslip_deg(direction)
    return HeadingDifferences(
        time_s=used.time_s,
        difference_deg=difference,
        direction_deg=direction,
        speed_mps=used.speed_mps,
        regressors=(*straight_regressors(used, knowledge), *steady.regressors(direction), *_before(used, steps)),
        segment=used.segment,
    )


def _before(used: TaxiSamples, steps: tuple[HeadingStep, ...]) -> tuple[Regressor, ...]:
    """Return regressors of the steps in the heading, 1 before each step.

    The error is that after the last step; differences before a step are smaller by its size. Of more than
    ``MOST_STEPS`` the largest have a coefficient each, the others one that scales all of them, with the variance that
    they would have one by one where each counts as much as it is large.
    """
    by_size = sorted(steps, key=lambda step: -abs(step.size_deg))
    before = [(used.time_s < step.time_s).astype(np.float64) for step in by_size]
    alone = [
        Regressor(rows, -step.size_deg, STEP_SIGMA_DEG)
        for rows, step in sorted(zip(before[:MOST_STEPS], by_size, strict=False), key=lambda pair: pair[1].time_s)
    ]
    if len(steps) <= MOST_STEPS:
        return tuple(alone)
    sizes_deg = np.array([step.size_deg for step in by_size[MOST_STEPS:]])
    together = Regressor(
        sizes_deg @ np.array(before[MOST_STEPS:]), -1.0, STEP_SIGMA_DEG / float(np.sqrt(np.mean(sizes_deg**2)))
    )
    return (*alone, together)


def solve(
    antenna: TaxiSamples,
    standstill: StandstillData,
    aircraft: AircraftData,
    settings: HeadingSettings,
    steady: SteadyPrior,
    steps: tuple[HeadingStep, ...] = (),
) -> Solution:
    """Find the error from gated samples with the velocities of the antenna."""
    knowledge = know_arm(antenna, aircraft, settings)
    uncorrected = _centred(antenna.difference_deg[antenna.is_used])
    samples = without_arm(antenna, knowledge.applied_arm_m, float(np.median(uncorrected)))
    used = take_samples(samples, samples.is_used)
    differences = _differences(used, knowledge, steady, steps)
    thinning = -(-len(used) // MOST_SAMPLES)
    thinned = _part(differences, slice(None, None, thinning))
    velocities = _velocities(antenna, standstill, float(used.time_s[0]), settings)
    posterior = error_posterior(thinned, velocities, draws=settings.posterior_draws, seed=settings.posterior_seed)
    weight = sample_weights(differences, posterior.typical())
    reference_time_s = _reference_time_s(used.time_s, weight, steps)
    draws = posterior.draws_of_ordinary_parts(DRAWS_FOR_PARTS)
    drift, drift_sigma = _drift(thinned, reference_time_s, draws)
    segments = tuple(_segment(differences, used, used.segment == number, draws) for number in np.unique(used.segment))
    direction_rad = np.deg2rad(differences.direction_deg)
    parts = _parts(differences, used, segments, draws, settings.part_max_s)
    full_weight = np.zeros(len(samples))
    full_weight[samples.is_used] = weight * len(used)
    return Solution(
        samples=samples,
        used=used,
        differences=differences,
        posterior=posterior,
        without_wind_deg=differences.difference_deg - _wind_found(differences, posterior),
        growth_samples=posterior.growth_samples * thinning,
        running=run_recursion(_centred(used.difference_deg)),
        sideslip_deg=None if steady.wind is None else float(weight @ steady.sideslip_deg(differences.direction_deg)),
        mean_direction=(float(weight @ np.cos(direction_rad)), float(weight @ np.sin(direction_rad))),
        knowledge=knowledge,
        uncorrected_deg=float(wrap_180(np.mean(uncorrected))),
        weight=full_weight,
        reference_time_s=reference_time_s,
        drift_deg_per_h=drift,
        drift_sigma_deg_per_h=drift_sigma,
        segments=segments,
        directions=_directions(differences, used, segments, draws),
        parts=parts,
        wind_of_parts_deg=_wind_of(parts, differences),
        steps=steps,
    )


def _reference_time_s(time_s: FloatArray, weight: FloatArray, steps: tuple[HeadingStep, ...]) -> float:
    """Return the weighted mean time of the samples after the last step, whose error is told."""
    current = np.where(time_s >= max((step.time_s for step in steps), default=-np.inf), weight, 0.0)
    return float(np.sum(current * time_s) / np.sum(current)) if current.any() else steps[-1].time_s


def _part(differences: HeadingDifferences, index: slice | BoolArray) -> HeadingDifferences:
    return replace(
        differences,
        time_s=differences.time_s[index],
        difference_deg=differences.difference_deg[index],
        direction_deg=differences.direction_deg[index],
        speed_mps=differences.speed_mps[index],
        regressors=tuple(replace(item, values=item.values[index]) for item in differences.regressors),
        segment=None if differences.segment is None else differences.segment[index],
    )


def _velocities(
    antenna: TaxiSamples, standstill: StandstillData, taxi_start_s: float, settings: HeadingSettings
) -> StandstillVelocities:
    """Return the standstill velocities for the noise model.

    At most ``spectrum_max_s`` of them are taken, those before taxi at the end. Stretches during or after taxi stand
    first, not linked to it.
    """
    if not standstill.is_informative:
        return StandstillVelocities(np.zeros(0), np.zeros(0), np.zeros(0))
    index = np.flatnonzero(standstill.is_still)
    before = index[antenna.time_s[index] < taxi_start_s]
    later = index[antenna.time_s[index] >= taxi_start_s]
    most = max(int(settings.spectrum_max_s / max(antenna.interval_s, 0.01)), 10)
    before = before[-most:]
    later = later[: max(most - len(before), 0)]
    order = np.concatenate([later, before])
    gap = taxi_start_s - float(antenna.time_s[before[-1]]) if len(before) else None
    return StandstillVelocities(
        antenna.time_s[order], antenna.north_mps[order], antenna.east_mps[order], len(later), gap
    )


def _drift(
    differences: HeadingDifferences, reference_time_s: float, draws: FloatArray
) -> tuple[float | None, float | None]:
    """Slope of the error and its standard deviation, deg/h, by generalised least squares."""
    if float(np.ptp(differences.time_s)) < LEAST_DRIFT_S:
        return None, None
    slope = Regressor(differences.time_s - reference_time_s, 0.0, FLAT_DEG_PER_S)
    mean, sigma = fixed_noise_estimate(replace(differences, regressors=(*differences.regressors, slope)), draws)
    return float(mean[-1]) * 3600.0, float(sigma[-1]) * 3600.0


def _segment(differences: HeadingDifferences, used: TaxiSamples, mask: BoolArray, draws: FloatArray) -> TaxiSegment:
    mean, sigma = fixed_noise_estimate(without_apart(_part(differences, mask)), draws)
    return TaxiSegment(
        start_s=float(used.time_s[mask][0]),
        end_s=float(used.time_s[mask][-1]),
        samples=int(mask.sum()),
        mean_track_deg=mean_heading(used.track_deg[mask]),
        mean_speed_mps=float(np.mean(used.speed_mps[mask])),
        error_deg=float(mean[0]),
        sigma_deg=float(sigma[0]),
    )


def _parts(
    differences: HeadingDifferences,
    used: TaxiSamples,
    segments: tuple[TaxiSegment, ...],
    draws: FloatArray,
    longest_s: float,
) -> tuple[TaxiSegment, ...]:
    """The segments, those longer than ``longest_s`` cut into equal parts."""
    parts = []
    for segment in segments:
        count = int(np.ceil(max(segment.end_s - segment.start_s, 1e-9) / longest_s))
        if count == 1:
            parts.append(segment)
            continue
        inside = (used.time_s >= segment.start_s) & (used.time_s <= segment.end_s)
        share = (used.time_s - segment.start_s) / (segment.end_s - segment.start_s)
        number = np.minimum((share * count).astype(np.int64), count - 1)
        masks = (inside & (number == part) for part in range(count))
        parts += [_segment(differences, used, mask, draws) for mask in masks if mask.sum() > 1]
    return tuple(parts)


def _wind_found(differences: HeadingDifferences, posterior: ErrorPosterior) -> FloatArray:
    """Return the part of each difference by the terms told apart, degrees.

    Zero where one direction hides them.
    """
    known = 1 + len(without_apart(differences).regressors)
    terms = differences.apart
    found = [posterior.coefficient(place)[0] for place in range(known, posterior.coefficients.shape[1])]
    return sum(
        (size * term.values for size, term in zip(found, terms, strict=False)), np.zeros(len(differences.time_s))
    )


def _wind_of(parts: tuple[TaxiSegment, ...], differences: HeadingDifferences) -> FloatArray:
    """Return one sigma of each term told apart, averaged over each part, (parts, terms).

    Degrees.
    """
    terms, time_s = differences.apart, differences.time_s
    inside = [(time_s >= part.start_s) & (time_s <= part.end_s) for part in parts]
    means = [[one.prior_sigma * float(np.mean(one.values[mask])) for one in terms] for mask in inside]
    return np.array(means).reshape(len(parts), len(terms))


def _directions(
    differences: HeadingDifferences, used: TaxiSamples, segments: tuple[TaxiSegment, ...], draws: FloatArray
) -> tuple[TaxiSegment, ...]:
    """Estimate the error out and back; empty if the taxi went one way.

    A back-taxi tells what turns with the aircraft from what does not.
    """
    away = np.abs(wrap_180(used.track_deg - segments[0].mean_track_deg))
    groups = [away <= 45.0, away >= 135.0]
    if not all(int(group.sum()) >= LEAST_IN_DIRECTION for group in groups):
        return ()
    return tuple(_segment(differences, used, group, draws) for group in groups)
