"""Honest interval: the heading error averaged over the possible noise.

Standstill and taxi data tell what noise is possible. The width of an interval hangs on the spectral density at zero
frequency, which one run shows only dimly. So the parameters of the noise model (``noise.py``) are not fixed at a best
fit: they have broad priors, their posterior is sampled, and the answer is the mixture of the normal distributions that
belong to the draws. Short runs and short standstills get heavier tails by themselves.

The sampling itself is in ``sampling.py``.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.halves import both, cores
from groundstation.base.units import ARCMIN_PER_DEG, DEG_PER_RAD
from groundstation.methods.taxi_error import noise
from groundstation.methods.taxi_error.posterior import ErrorPosterior, even_draws
from groundstation.methods.taxi_error.priors import PRIOR_MEAN, PRIOR_SIGMA, SPREAD
from groundstation.methods.taxi_error.sampling import find_mode, sample

FloatArray = NDArray[np.float64]

LEAST_WEIGHT, LEAST_VARIANCE_DEG2 = 1e-5, 1e-18  # draws below this share of the mean weight add nothing
DRAWS_OF_GROWTH = 200
NO_SPREAD = np.log(1e-3 / ARCMIN_PER_DEG)
NOTICED_DEG = 0.03  # least change of a term told apart along a taxi for the noise model to have it
WIDEST_GAP_DEG = 210.0  # between the directions of a taxi that goes there and back


@dataclass(frozen=True)
class StandstillVelocities:
    """GNSS velocity at standstill, m/s, shapes (n,).

    ``gap_s`` is the time from its end to the first taxi sample, None where the two are not linked. ``restart`` is the
    index at which the stretch that is linked to taxi begins, the others standing before it.
    """

    time_s: FloatArray
    north_mps: FloatArray
    east_mps: FloatArray
    restart: int = 0
    gap_s: float | None = None


NO_STANDSTILL = StandstillVelocities(np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Regressor:
    """Known shape times an unknown factor with a normal prior, beside the constant error.

    ``is_apart``: what it leaves in the error is told apart from what was measured.
    """

    values: FloatArray
    prior_mean: float
    prior_sigma: float
    is_apart: bool = False


@dataclass(frozen=True)
class HeadingDifferences:
    """Heading differences to average, shapes (n,).

    Parameters
    ----------
    time_s, difference_deg, speed_mps : ndarray, shape (n,)
    direction_deg : ndarray, shape (n,)
        Direction of motion free of GNSS noise: the INS heading less the median difference. With the measured track
        in its place a large velocity error along the track would "explain" the noise of the track by itself.
    regressors : tuple of Regressor
        Known shapes with unknown factors, beside the constant error.
    error_prior_deg : (mean, sigma), optional
        Prior of the error; flat without one.
    segment : ndarray of int64, shape (n,), optional
        Number of the segment of each; without it all are of one piece: no error of a segment's own, and no wander.
    """

    time_s: FloatArray
    difference_deg: FloatArray
    direction_deg: FloatArray
    speed_mps: FloatArray
    regressors: tuple[Regressor, ...] = ()
    error_prior_deg: tuple[float, float] | None = None
    segment: NDArray[np.int64] | None = None

    @property
    def apart(self) -> tuple[Regressor, ...]:
        """The regressors that are told apart."""
        return tuple(one for one in self.regressors if one.is_apart)


class _Found(NamedTuple):
    """Results of k draws: log posterior (k,), coefficients (k, c), variances (k, m, c).

    ``alone`` is error and variance, shape (k, 2), as they would be if the terms told apart were known to be zero.
    """

    density: FloatArray
    estimate: FloatArray
    variance: FloatArray
    alone: FloatArray


@dataclass
class _Target:
    """Log posterior density of the noise parameters.

    The error and the coefficients are integrated out. ``apart``: so many regressors at the end are told apart.
    """

    standstill: StandstillVelocities
    differences: HeadingDifferences
    apart: int = 0

    def __post_init__(self) -> None:
        data, still = self.differences, self.standstill
        self.reference_deg = float(np.median(data.difference_deg))
        columns = [data.difference_deg - self.reference_deg, np.ones(len(data.time_s))]
        columns += [regressor.values for regressor in data.regressors]
        direction_rad = np.deg2rad(data.direction_deg)
        scale = DEG_PER_RAD / data.speed_mps
        self.taxi = (
            np.ascontiguousarray(data.time_s, dtype=np.float64),
            np.ascontiguousarray(np.column_stack(columns)),
            np.sin(direction_rad) * scale,
            -np.cos(direction_rad) * scale,
            np.diff(data.segment, prepend=data.segment[:1]) != 0
            if data.segment is not None
            else np.zeros(len(data.time_s), dtype=bool),
        )
        self.width = len(columns)
        self.free = np.arange(len(PRIOR_MEAN) if data.segment is not None else noise.SEGMENT)
        gap_s = -1.0 if still.gap_s is None else float(still.gap_s)
        self.still = (
            np.ascontiguousarray(still.time_s, dtype=np.float64),
            np.ascontiguousarray(still.north_mps, dtype=np.float64),
            np.ascontiguousarray(still.east_mps, dtype=np.float64),
            int(still.restart),
            gap_s,
        )
        mean, sigma = data.error_prior_deg or (self.reference_deg, np.inf)
        sigmas = np.array([sigma, *(regressor.prior_sigma for regressor in data.regressors)])
        means = [mean - self.reference_deg, *(regressor.prior_mean for regressor in data.regressors)]
        self.prior = (np.array(means), 1.0 / np.maximum(sigmas, 1e-6) ** 2)
        without = len(means) - self.apart
        self.prior_of_alone = (self.prior[0][:without].copy(), self.prior[1][:without].copy())
        self.last = np.array([len(data.time_s)], dtype=np.int64)

    def evaluate(self, thetas: FloatArray, checkpoints: NDArray[np.int64]) -> _Found:
        """Return the results for draws of the noise parameters, shape (k, 11)."""
        bounded = np.clip(thetas, PRIOR_MEAN - 6.0 * PRIOR_SIGMA, PRIOR_MEAN + 6.0 * PRIOR_SIGMA)
        found = self.likelihood(bounded, checkpoints, noise.room_for(self.width, len(checkpoints)))
        scaled = ((thetas - PRIOR_MEAN) / PRIOR_SIGMA)[:, self.free]
        return found._replace(density=found.density - 0.5 * np.sum(scaled**2, axis=1))

    def likelihood(self, thetas: FloatArray, checkpoints: NDArray[np.int64], room: noise.NoiseWorkspace) -> _Found:
        """Return the same with the log likelihood alone as density.

        ``room`` then holds the results of the loops: of few draws, which no second core shares.
        """
        count, rest = len(thetas), self.width - 1
        log_likelihood, estimate = np.empty(count), np.empty((count, rest))
        variance, alone = np.empty((count, len(checkpoints), rest)), np.empty((count, 2))

        def fill(part: slice, room: noise.NoiseWorkspace) -> None:
            out = log_likelihood[part], estimate[part], variance[part], self.prior_of_alone, alone[part]
            noise.evaluate(thetas[part], self.still, self.taxi, self.prior, checkpoints, *out, room)

        rounds = -(-count // noise.LANES)
        if rounds > 1 and cores() > 1:
            half = -(-rounds // 2) * noise.LANES
            other = noise.room_for(self.width, len(checkpoints))
            both(partial(fill, slice(half), room), partial(fill, slice(half, count), other))
        else:
            fill(slice(count), room)
        return _Found(log_likelihood, estimate, variance, alone)

    def whole(self, thetas: FloatArray) -> FloatArray:
        """Return all parameters, shape (k, 11), from the sampled ones."""
        out = np.full((len(thetas), len(PRIOR_MEAN)), PRIOR_MEAN)
        out[:, SPREAD] = NO_SPREAD
        out[:, self.free] = thetas
        return out

    def log_density(self, thetas: FloatArray) -> FloatArray:
        return self.evaluate(self.whole(thetas), self.last).density


def _start(differences: HeadingDifferences, standstill: StandstillVelocities) -> FloatArray:
    """Return a first guess of the parameters from plain standard deviations."""
    theta = PRIOR_MEAN.copy()
    if len(standstill.time_s) > 20:
        steps = np.concatenate([np.diff(standstill.north_mps), np.diff(standstill.east_mps)])
        theta[noise.WHITE] = np.log(max(float(np.std(steps)) / np.sqrt(2.0), 1e-3))
    spread = float(np.std(differences.difference_deg))
    theta[noise.SWAY] = np.log(min(max(spread, 0.02), 3.0))
    return theta


def error_posterior(
    differences: HeadingDifferences,
    standstill: StandstillVelocities = NO_STANDSTILL,
    *,
    draws: int = 4000,
    seed: int = 2015,
    growth: int = 30,
) -> ErrorPosterior:
    """Sample the posterior of the heading error.

    Parameters
    ----------
    differences : HeadingDifferences
    standstill : StandstillVelocities
        Empty where there is none: the priors then stand alone.
    draws : int
        Draws of the noise parameters (up to three times as many where the posterior is awkward).
    seed : int
        Seed of the draws: the same data always give the same interval.
    growth : int
        Steps at which the growing precision is reported.
    """
    count = len(differences.time_s)
    checkpoints = np.unique(np.linspace(min(2, count), count, growth).astype(np.int64))
    target = _target_of(differences, standstill)
    scale = PRIOR_SIGMA[target.free]
    mode, has_converged = find_mode(target.log_density, _start(differences, standstill)[target.free], scale)
    found: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def evaluate(thetas: FloatArray) -> FloatArray:
        now = target.evaluate(target.whole(thetas), target.last)
        found.append((now.estimate, now.variance[:, -1], now.alone))
        return now.density

    points, weight = sample(target.log_density, mode, scale, draws, np.random.default_rng(seed), evaluate)
    coefficients, variance, alone = (np.vstack(arrays) for arrays in zip(*found, strict=True))
    kept = weight > LEAST_WEIGHT / len(weight)
    points, weight = target.whole(points[kept]), weight[kept] / weight[kept].sum()
    coefficients, variance, alone = coefficients[kept], np.maximum(variance[kept], LEAST_VARIANCE_DEG2), alone[kept]
    measured_deg = np.sqrt(np.maximum(alone[:, 1], LEAST_VARIANCE_DEG2))
    if target.apart and goes_there_and_back(differences.direction_deg):
        sigma_deg = np.sqrt(np.maximum(variance[:, 0], measured_deg**2))
    else:  # a number moved by them would be an extrapolation
        coefficients[:, 0], variance[:, 0] = alone[:, 0], measured_deg**2
        sigma_deg = np.hypot(measured_deg, _left_in_error(differences, np.asarray(weight @ points)))
    coefficients[:, 0] += target.reference_deg
    plain = _Target(standstill, without_apart(differences)) if target.apart else target
    growing = plain.evaluate(even_draws(points, weight, DRAWS_OF_GROWTH), checkpoints).variance
    return ErrorPosterior(
        mean_deg=coefficients[:, 0],
        sigma_deg=sigma_deg,
        measured_sigma_deg=measured_deg,
        weight=weight,
        coefficients=coefficients,
        coefficient_sigma=np.sqrt(variance),
        growth_samples=checkpoints,
        growth_sigma_deg=np.sqrt(np.maximum(growing[:, :, 0], LEAST_VARIANCE_DEG2)),
        parameters=points,
        effective_draws=float(1.0 / np.sum(weight**2)),
        has_converged=has_converged,
    )


def _target_of(differences: HeadingDifferences, standstill: StandstillVelocities) -> _Target:
    """Return the target of the noise parameters.

    Where the terms told apart differ along the taxi, they are its last regressors. Directions then disagree by what a
    crosswind does; without these terms that would be taken for errors of the INS.
    """
    apart = differences.apart
    if all(float(np.ptp(one.values)) * one.prior_sigma < NOTICED_DEG for one in apart):
        return _Target(standstill, without_apart(differences))
    known = without_apart(differences).regressors
    return _Target(standstill, replace(differences, regressors=(*known, *apart)), len(apart))


def goes_there_and_back(direction_deg: FloatArray) -> bool:
    """Tell whether directions of motion leave no wide gap.

    An error that turns with the aircraft then shows by itself.

    Examples
    --------
    >>> [goes_there_and_back(np.array(one)) for one in ([10.0, 190.0], [10.0, 100.0], [0.0, 120.0, 240.0])]
    [True, False, True]
    """
    ordered = np.sort(wrap_360(direction_deg))
    return bool(np.max(np.diff(ordered, append=ordered[0] + 360.0)) <= WIDEST_GAP_DEG)


def _left_in_error(differences: HeadingDifferences, parameters: FloatArray) -> float:
    """Return the standard deviation that the terms told apart leave in the error, degrees.

    Where a taxi does not go there and back they do not move the number, for they would extrapolate: so all of them that
    the weights of the samples let through is in it, and as the number is linear in the differences, that is what it
    would be were each term the differences.
    """
    variance, measured = 0.0, without_apart(differences)
    known = tuple(replace(one, prior_mean=0.0) for one in measured.regressors)
    for term in differences.apart:
        alone = replace(measured, difference_deg=term.values, regressors=known, error_prior_deg=None)
        through = float(fixed_noise_estimate(alone, parameters[None, :])[0][0])
        variance += (term.prior_sigma * through) ** 2
    return float(np.sqrt(variance))


def without_apart(differences: HeadingDifferences) -> HeadingDifferences:
    """Return the differences without the regressors that are told apart."""
    return replace(differences, regressors=tuple(one for one in differences.regressors if not one.is_apart))


def fixed_noise_estimate(
    differences: HeadingDifferences, parameters: FloatArray, standstill: StandstillVelocities = NO_STANDSTILL
) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and their standard deviations, shapes (c,), for given noise.

    They are averaged over given draws of the noise parameters. The error comes first, then the factors of the
    regressors. It serves parts of a run (segments, directions) and further regressors (drift), with the noise as found
    from the whole run.
    """
    target = _Target(standstill, differences)
    _log_density, coefficients, variance, _alone = target.evaluate(parameters, target.last)
    coefficients[:, 0] += target.reference_deg
    mean = coefficients.mean(axis=0)
    spread = variance[:, -1, :].mean(axis=0) + coefficients.var(axis=0)
    return mean, np.sqrt(np.maximum(spread, 0.0))


def misfit(differences: HeadingDifferences, parameters: FloatArray) -> float:
    """Return the mean square of the whitened residuals, shape ().

    It is 1 where the differences are as noisy as the parameters say.
    """
    target = _Target(NO_STANDSTILL, differences)
    room = noise.room_for(target.width)
    target.likelihood(parameters[None, :], target.last, room)
    full = np.concatenate([[1.0], -room.mean])
    squares = float(np.sum(np.outer(full, full) * room.information[0, 0]))
    return squares / max(len(differences.time_s) - target.width + 1, 1)


def sample_weights(differences: HeadingDifferences, parameters: FloatArray) -> FloatArray:
    """Return the weight of every sample in the estimate of the error, shape (n,), sum 1.

    The noise parameters are given.
    """
    target = _Target(NO_STANDSTILL, differences)
    time_s, _columns, from_north, from_east, is_start = target.taxi
    room = noise.room_for(target.width, history=len(time_s))
    target.likelihood(parameters[None, :], target.last, room)
    innovation, weights = np.zeros((2, len(time_s)))
    noise.generalised_weights(time_s, from_north, from_east, is_start, parameters, room, innovation, weights)
    return weights
