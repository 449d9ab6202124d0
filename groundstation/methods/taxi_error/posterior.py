"""Posterior of the heading error as a mixture of normal distributions, and its intervals."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.intervals import mixture_quantile
from groundstation.methods.taxi_error import noise
from groundstation.methods.taxi_error.priors import PRIOR_MEAN, SPREAD

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ErrorPosterior:
    """Posterior of the heading error: a mixture of normals.

    There is one for each draw of the noise parameters.

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
        True where the search for the maximum ended at one.
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
        """Standard deviation that the regressors told apart leave in the error."""
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
        """Return the half width of the interval after ``growth_samples``, shape (m,).

        The noise and the terms told apart are those at the end.
        """
        extra_deg = np.hypot(self.apart_sigma_deg, extra_sigma_deg)
        upper = 0.5 * (1.0 + probability)
        columns = np.hypot(self.growth_sigma_deg, extra_deg).T
        zeros, even = np.zeros(columns.shape[1]), np.full(columns.shape[1], 1.0 / columns.shape[1])
        return np.array([mixture_quantile(upper, zeros, sigma, even) for sigma in columns])

    def even_draws(self, count: int = 40) -> FloatArray:
        """Draws of the parameters with equal weights, shape (count, 11): systematic resampling."""
        return even_draws(self.parameters, self.weight, count)

    def draws_of_ordinary_parts(self, count: int = 40) -> FloatArray:
        """Return draws in which parts of a run have no more error of their own than usual.

        So an unusual error of a part shows.
        """
        draws = self.even_draws(count)
        draws[:, SPREAD] = PRIOR_MEAN[np.array(SPREAD)]
        return draws


def even_draws(points: FloatArray, weight: FloatArray, count: int) -> FloatArray:
    """Draws with equal weights, shape (count, p), from weighted ones: systematic resampling."""
    places = (np.arange(count) + 0.5) / count
    return np.asarray(points[np.minimum(np.searchsorted(np.cumsum(weight), places), len(weight) - 1)])
