"""The honest interval: the heading error averaged over what the noise may be, given standstill and taxi data.

The width of an interval hangs on the spectral density at zero frequency, which one run shows only dimly. So the
parameters of the noise model (``noise.py``) are not fixed at a best fit: they have broad priors, their
posterior is sampled, and the answer is the mixture of the normal distributions that belong to the draws. Short runs
and short standstills get heavier tails by themselves.

The sampling itself is in ``sampling.py``.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.units import ARCMIN_PER_DEG, DEG_PER_RAD
from groundstation.estimators.heading import noise
from groundstation.estimators.heading.sampling import find_mode, sample

FloatArray = NDArray[np.float64]

# Priors: each parameter is log-normal. (median, sigma of the natural logarithm): two sigma either side reach over
# 0.007-0.37 m/s, 0.007-0.12 m/s, 0.36-44 s, 0.05-3 deg, 0.1-1.3 Hz, 0.012-0.99, 0.003-0.2 deg, 0.2-5 times,
# 0.1-11 arcmin, 0.1-40 arcmin, 8-440 s.
PRIOR: dict[str, tuple[float, float]] = {
    "white_mps": (0.05, 1.0),
    "correlated_mps": (0.03, 0.7),
    "correlation_s": (4.0, 1.2),
    "sway_deg": (0.4, 1.0),
    "sway_hz": (0.36, 0.65),
    "sway_damping": (0.15, 1.25),
    "heading_white_deg": (0.025, 1.05),
    "motion_factor": (1.0, 0.8),
    "segment_deg": (1.0 / ARCMIN_PER_DEG, 1.2),
    "wander_deg": (2.0 / ARCMIN_PER_DEG, 1.5),
    "wander_s": (60.0, 1.0),
}
PRIOR_MEAN = np.log([PRIOR[name][0] for name in noise.PARAMETER_NAMES])
PRIOR_SIGMA = np.array([PRIOR[name][1] for name in noise.PARAMETER_NAMES])
SPREAD = (noise.SEGMENT, noise.WANDER)  # what parts of a run have of their own
LEAST_WEIGHT, LEAST_VARIANCE_DEG2 = 1e-5, 1e-18  # of a draw, times the mean; below it there is nothing to add
DRAWS_OF_GROWTH = 200
NO_SPREAD = np.log(1e-3 / ARCMIN_PER_DEG)


@dataclass(frozen=True)
class StandstillVelocities:
    """GNSS velocity at standstill, m/s, shapes (n,); ``gap_s`` from its end to the first taxi sample, None: unlinked.

    ``restart`` is the index at which the stretch that is linked to taxi begins, the others standing before it.
    """

    time_s: FloatArray
    north_mps: FloatArray
    east_mps: FloatArray
    restart: int = 0
    gap_s: float | None = None


NO_STANDSTILL = StandstillVelocities(np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Regressor:
    """A known shape times an unknown factor with a normal prior, beside the constant error.

    ``is_apart``: what it leaves in the error is told apart from what was measured.
    """

    values: FloatArray
    prior_mean: float
    prior_sigma: float
    is_apart: bool = False


@dataclass(frozen=True)
class Differences:
    """Heading differences to be averaged, shapes (n,).

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


@dataclass(frozen=True)
class ErrorPosterior:
    """Posterior of the heading error: a mixture of normals, one for each draw of the noise parameters.

    Parameters
    ----------
    mean_deg, sigma_deg, weight : ndarray, shape (k,)
    measured_sigma_deg : ndarray, shape (k,)
        Sigma without what the regressors leave in the error that are told apart.
    coefficients, coefficient_sigma : ndarray, shape (k, c)
        Regression coefficients of each draw, the heading error first.
    growth_sigma_deg : ndarray, shape (g, m)
        Measured sigma of draws of equal weight after the samples counted in ``growth_samples``.
    parameters : ndarray, shape (k, 11)
        Draws, natural logarithms, in the order of ``noise.PARAMETER_NAMES``.
    effective_draws : float
        1 / sum of squared weights: a small figure means a badly sampled posterior.
    has_converged : bool
        Whether the search for the maximum ended at one.
    """

    mean_deg: FloatArray
    sigma_deg: FloatArray
    measured_sigma_deg: FloatArray
    weight: FloatArray
    coefficients: FloatArray
    coefficient_sigma: FloatArray
    growth_samples: NDArray[np.int64]
    growth_sigma_deg: FloatArray
    parameters: FloatArray
    effective_draws: float
    has_converged: bool

    @property
    def error_deg(self) -> float:
        """Posterior mean."""
        return float(self.weight @ self.mean_deg)

    @property
    def standard_error_deg(self) -> float:
        """Posterior standard deviation."""
        return float(np.sqrt(self.weight @ (self.sigma_deg**2 + (self.mean_deg - self.error_deg) ** 2)))

    @property
    def apart_sigma_deg(self) -> float:
        """Standard deviation of what the regressors told apart leave in the error."""
        return float(np.sqrt(self.weight @ np.maximum(self.sigma_deg**2 - self.measured_sigma_deg**2, 0.0)))

    def typical(self) -> FloatArray:
        """Posterior mean of the parameters (natural logarithms), shape (11,)."""
        return np.asarray(self.weight @ self.parameters)

    def parameter(self, name: str) -> float:
        """Posterior median of one parameter, in its unit."""
        values = self.parameters[:, noise.PARAMETER_NAMES.index(name)]
        order = np.argsort(values)
        return float(np.exp(values[order][np.searchsorted(np.cumsum(self.weight[order]), 0.5)]))

    def coefficient(self, index: int) -> tuple[float, float]:
        """Posterior mean and standard deviation of a regression coefficient."""
        mean = float(self.weight @ self.coefficients[:, index])
        spread = self.coefficient_sigma[:, index] ** 2 + (self.coefficients[:, index] - mean) ** 2
        return mean, float(np.sqrt(self.weight @ spread))

    def interval_deg(
        self, probability: float = 0.95, extra_sigma_deg: float = 0.0, *, is_measured: bool = False
    ) -> tuple[float, float]:
        """Equal-tailed interval of the mixture, widened by a further independent sigma.

        ``is_measured``: without what the regressors leave in the error that are told apart.
        """
        sigma = np.hypot(self.measured_sigma_deg if is_measured else self.sigma_deg, extra_sigma_deg)
        tail = 0.5 * (1.0 - probability)
        return (
            mixture_quantile(tail, self.mean_deg, sigma, self.weight),
            mixture_quantile(1.0 - tail, self.mean_deg, sigma, self.weight),
        )

    def growth_half_width_deg(self, probability: float = 0.95, extra_sigma_deg: float = 0.0) -> FloatArray:
        """Half width of the interval after ``growth_samples``, shape (m,), noise and terms told apart as at the end."""
        extra_deg = np.hypot(self.apart_sigma_deg, extra_sigma_deg)
        upper = 0.5 * (1.0 + probability)
        columns = np.hypot(self.growth_sigma_deg, extra_deg).T
        zeros, even = np.zeros(columns.shape[1]), np.full(columns.shape[1], 1.0 / columns.shape[1])
        return np.array([mixture_quantile(upper, zeros, sigma, even) for sigma in columns])

    def even_draws(self, count: int = 40) -> FloatArray:
        """Draws of the parameters with equal weights, shape (count, 11): systematic resampling."""
        return even_draws(self.parameters, self.weight, count)

    def draws_of_ordinary_parts(self, count: int = 40) -> FloatArray:
        """The same, parts of a run taken to have no more of their own than usual: what they say beyond that shows."""
        draws = self.even_draws(count)
        draws[:, SPREAD] = PRIOR_MEAN[np.array(SPREAD)]
        return draws


def even_draws(points: FloatArray, weight: FloatArray, count: int) -> FloatArray:
    """Draws with equal weights, shape (count, p), from weighted ones: systematic resampling."""
    places = (np.arange(count) + 0.5) / count
    return np.asarray(points[np.minimum(np.searchsorted(np.cumsum(weight), places), len(weight) - 1)])


def mixture_quantile(probability: float, mean: FloatArray, sigma: FloatArray, weight: FloatArray) -> float:
    """Quantile of a mixture of normal distributions, by bisection.

    Examples
    --------
    >>> round(mixture_quantile(0.975, np.zeros(2), np.array([1.0, 1.0]), np.array([0.3, 0.7])), 3)
    1.96
    """
    from scipy.special import ndtr

    low, high = float(np.min(mean - 12.0 * sigma)), float(np.max(mean + 12.0 * sigma))
    for _ in range(60):
        middle = 0.5 * (low + high)
        if float(weight @ ndtr((middle - mean) / sigma)) < probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@dataclass
class _Target:
    """Log posterior density of the noise parameters, with the error and the coefficients integrated out."""

    standstill: StandstillVelocities
    differences: Differences

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
        self.last = np.array([len(data.time_s)], dtype=np.int64)

    def evaluate(self, thetas: FloatArray, checkpoints: NDArray[np.int64]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log posterior (k,), coefficients (k, c), variances (k, m, c); thetas (k, 11)."""
        count, width = len(thetas), self.taxi[1].shape[1] - 1
        log_likelihood, estimate = np.empty(count), np.empty((count, width))
        variance = np.empty((count, len(checkpoints), width))
        bounded = np.clip(thetas, PRIOR_MEAN - 6.0 * PRIOR_SIGMA, PRIOR_MEAN + 6.0 * PRIOR_SIGMA)
        room = noise.room_for(width + 1, len(checkpoints))
        noise.evaluate(
            bounded, self.still, self.taxi, self.prior, checkpoints, log_likelihood, estimate, variance, room
        )
        scaled = ((thetas - PRIOR_MEAN) / PRIOR_SIGMA)[:, self.free]
        return log_likelihood - 0.5 * np.sum(scaled**2, axis=1), estimate, variance

    def whole(self, thetas: FloatArray) -> FloatArray:
        """All parameters, shape (k, 11), from those that are sampled."""
        out = np.full((len(thetas), len(PRIOR_MEAN)), PRIOR_MEAN)
        out[:, SPREAD] = NO_SPREAD
        out[:, self.free] = thetas
        return out

    def log_density(self, thetas: FloatArray) -> FloatArray:
        return self.evaluate(self.whole(thetas), self.last)[0]


def _start(differences: Differences, standstill: StandstillVelocities) -> FloatArray:
    """A first guess of the parameters from plain standard deviations."""
    theta = PRIOR_MEAN.copy()
    if len(standstill.time_s) > 20:
        steps = np.concatenate([np.diff(standstill.north_mps), np.diff(standstill.east_mps)])
        theta[noise.WHITE] = np.log(max(float(np.std(steps)) / np.sqrt(2.0), 1e-3))
    spread = float(np.std(differences.difference_deg))
    theta[noise.SWAY] = np.log(min(max(spread, 0.02), 3.0))
    return theta


def error_posterior(
    differences: Differences,
    standstill: StandstillVelocities = NO_STANDSTILL,
    *,
    draws: int = 4000,
    seed: int = 2015,
    growth: int = 30,
) -> ErrorPosterior:
    """Sample the posterior of the heading error.

    Parameters
    ----------
    differences : Differences
    standstill : StandstillVelocities
        Empty where there is none: the priors then stand alone.
    draws : int
        Draws of the noise parameters (up to three times as many where the posterior is awkward).
    seed : int
        Of the draws: the same data always give the same interval.
    growth : int
        Steps at which the growing precision is reported.
    """
    count = len(differences.time_s)
    checkpoints = np.unique(np.linspace(min(2, count), count, growth).astype(np.int64))
    target = _Target(standstill, without_apart(differences))
    scale = PRIOR_SIGMA[target.free]
    mode, has_converged = find_mode(target.log_density, _start(differences, standstill)[target.free], scale)
    found: list[tuple[FloatArray, FloatArray]] = []

    def evaluate(thetas: FloatArray) -> FloatArray:
        density, estimate, variance = target.evaluate(target.whole(thetas), target.last)
        found.append((estimate, variance[:, -1]))
        return density

    points, weight = sample(target.log_density, mode, scale, draws, np.random.default_rng(seed), evaluate)
    coefficients, variance = (np.vstack(arrays) for arrays in zip(*found, strict=True))
    kept = weight > LEAST_WEIGHT / len(weight)
    points, weight = target.whole(points[kept]), weight[kept] / weight[kept].sum()
    coefficients, measured = coefficients[kept], np.sqrt(np.maximum(variance[kept], LEAST_VARIANCE_DEG2))
    coefficients[:, 0] += target.reference_deg
    apart_deg = _left_in_error(differences, np.asarray(weight @ points))
    _density, _estimate, growing = target.evaluate(even_draws(points, weight, DRAWS_OF_GROWTH), checkpoints)
    return ErrorPosterior(
        mean_deg=coefficients[:, 0],
        sigma_deg=np.hypot(measured[:, 0], apart_deg),
        measured_sigma_deg=measured[:, 0],
        weight=weight,
        coefficients=coefficients,
        coefficient_sigma=measured,
        growth_samples=checkpoints,
        growth_sigma_deg=np.sqrt(np.maximum(growing[:, :, 0], LEAST_VARIANCE_DEG2)),
        parameters=points,
        effective_draws=float(1.0 / np.sum(weight**2)),
        has_converged=has_converged,
    )


def _left_in_error(differences: Differences, parameters: FloatArray) -> float:
    """Standard deviation of what the terms told apart leave in the error, degrees.

    They do not move the number, for from a few directions they would extrapolate: so all of them that the weights of
    the samples let through is in it, and as the number is linear in the differences, that is what it would be were
    each term the differences.
    """
    variance, measured = 0.0, without_apart(differences)
    known = tuple(replace(one, prior_mean=0.0) for one in measured.regressors)
    for term in (one for one in differences.regressors if one.is_apart):
        alone = replace(measured, difference_deg=term.values, regressors=known, error_prior_deg=None)
        through = float(fixed_noise_estimate(alone, parameters[None, :])[0][0])
        variance += (term.prior_sigma * through) ** 2
    return float(np.sqrt(variance))


def without_apart(differences: Differences) -> Differences:
    """The same without the regressors that are told apart."""
    return replace(differences, regressors=tuple(one for one in differences.regressors if not one.is_apart))


def fixed_noise_estimate(
    differences: Differences, parameters: FloatArray, standstill: StandstillVelocities = NO_STANDSTILL
) -> tuple[FloatArray, FloatArray]:
    """Coefficients and their standard deviations, shapes (c,), averaged over given draws of the noise parameters.

    The error comes first, then the factors of the regressors. For parts of a run (segments, directions) and further
    regressors (drift), with the noise as found from the whole of it.
    """
    target = _Target(standstill, differences)
    _log_density, coefficients, variance = target.evaluate(parameters, target.last)
    coefficients[:, 0] += target.reference_deg
    mean = coefficients.mean(axis=0)
    spread = variance[:, -1, :].mean(axis=0) + coefficients.var(axis=0)
    return mean, np.sqrt(np.maximum(spread, 0.0))


def misfit(differences: Differences, parameters: FloatArray) -> float:
    """Mean square of the whitened residuals: 1 where the differences are as noisy as the parameters say, shape ()."""
    target = _Target(NO_STANDSTILL, differences)
    width = int(target.taxi[1].shape[1])
    room = noise.room_for(width)
    noise.taxi_filter(*target.taxi, -1.0, parameters, room.start, target.last, room.information, room.history, room)
    information, mean = room.information, room.mean
    noise.solve_normal_equations(information[0], target.prior[0], target.prior[1], mean, room.inverse, room)
    full = np.concatenate([[1.0], -mean])
    squares = float(np.sum(np.outer(full, full) * information[0]))
    return squares / max(len(differences.time_s) - width + 1, 1)


def sample_weights(differences: Differences, parameters: FloatArray) -> FloatArray:
    """Weight of every sample in the estimate of the error, shape (n,), sum 1, for given noise parameters."""
    target = _Target(NO_STANDSTILL, differences)
    time_s, columns, from_north, from_east, is_start = target.taxi
    history = np.zeros((len(time_s), 1 + noise.STATES))
    room, weights = noise.room_for(columns.shape[1]), np.zeros(len(time_s))
    noise.taxi_filter(*target.taxi, -1.0, parameters, room.start, target.last, room.information, history, room)
    noise.generalised_weights(
        time_s, from_north, from_east, is_start, parameters, history, room, np.zeros(len(time_s)), weights
    )
    return weights
