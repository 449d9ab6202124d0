"""Mean error of an aircraft over its flights, with an interval by the spread of flights."""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import student_quantile
from groundstation.methods.fleet.moments import moments_of

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class MeanOverFlights:
    """Mean of a quantity over flights, in its unit.

    All but ``flights`` and ``mean`` are NaN for a single flight. ``low``, ``high`` bound its interval,
    ``sigma_between`` is the spread of the flights' true values, and ``heterogeneity`` the share of the variance of
    their values that the flights' own sigmas do not explain.
    """

    flights: int
    mean: float
    low: float
    high: float
    sigma_between: float
    heterogeneity: float


def mean_over_flights(value: FloatArray, sigma: FloatArray, *, confidence: float = 0.95) -> MeanOverFlights | None:
    """Estimate the mean of a quantity over flights whose true values differ.

    Parameters
    ----------
    value : ndarray, shape (n,)
        One per flight; those that are not finite are left out.
    sigma : ndarray, shape (n,)
        Standard error of each; one that is missing is taken to be like the others, none at all to be zero.
    confidence : float

    Returns
    -------
    MeanOverFlights or None
        None without a finite value.

    Notes
    -----
    Random effects: value_i = mean + b_i + e_i, var(b) = tau^2 between flights, var(e_i) = sigma_i^2. Each flight counts
    as one, however many samples it has: mean +- t(n - 1) s / sqrt(n), s the standard deviation of the values;
    tau^2 = s^2 - mean of sigma_i^2, or 0; heterogeneity = tau^2 / s^2. Weights 1 / (sigma_i^2 + tau^2) were tried and
    left (docs/fleet.md). The flights are taken to be independent and normal about the mean; a trend or an outlier
    widens the interval and is told apart elsewhere.

    Source: Hedges, A random effects model for effect sizes, Psychological Bulletin 93 (1983), 388-395 (tau^2).

    Examples
    --------
    >>> found = mean_over_flights(np.array([0.9, 1.1, 1.0]), np.array([0.06, 0.06, 0.06]))
    >>> round(found.mean, 6), round(found.high - found.mean, 4)  # 4.303 x 0.1 / sqrt(3)
    (1.0, 0.2484)
    >>> round(found.sigma_between, 6), round(found.heterogeneity, 6)  # 0.1^2 - 0.06^2
    (0.08, 0.64)
    """
    found = moments_of(value)
    if not found.count:
        return None
    if found.count == 1:
        return MeanOverFlights(1, found.mean, *(4 * (math.nan,)))
    half = student_quantile(0.5 + 0.5 * confidence, found.count - 1) * found.sigma / math.sqrt(found.count)
    stated = sigma[np.isfinite(value) & np.isfinite(sigma)]
    between2 = max(found.sigma**2 - float(np.mean(stated**2)), 0.0) if len(stated) else found.sigma**2
    heterogeneity = between2 / found.sigma**2 if found.sigma > 0.0 else 0.0
    between = math.sqrt(between2)
    return MeanOverFlights(found.count, found.mean, found.mean - half, found.mean + half, between, heterogeneity)
