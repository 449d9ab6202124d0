"""Quantiles and p-values of the usual distributions, from scipy.special alone.

Importing scipy.stats takes 0.6 s.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
NORMAL_95 = 1.96  # an error of one axis stays within so many sigma in 95 % of cases


def chi_square_quantile(probability: float, freedom: ArrayLike) -> FloatArray:
    """Return the value that chi-square stays below with the given probability.

    ``freedom`` is the degrees of freedom; the result has its shape.

    Examples
    --------
    >>> round(float(chi_square_quantile(0.95, 2)), 3)
    5.991
    """
    from scipy.special import chdtri

    return np.asarray(chdtri(np.asarray(freedom, dtype=np.float64), 1.0 - probability), dtype=np.float64)


def student_quantile(probability: float, freedom: float) -> float:
    """Return the value that Student's t stays below with the given probability.

    ``freedom`` is the degrees of freedom.

    Examples
    --------
    >>> round(student_quantile(0.975, 2.0), 3)
    4.303
    """
    from scipy.special import stdtrit

    return float(stdtrit(freedom, probability))


def share_quantile(probability: float, successes: float, failures: float) -> float:
    """Quantile of the beta distribution with these two parameters.

    Examples
    --------
    >>> round(share_quantile(0.5, 1.0, 1.0), 6)
    0.5
    """
    from scipy.special import betaincinv

    return float(betaincinv(successes, failures, probability))


def length_quantile(probability: float, length: float, sigma: float) -> float:
    """Return a quantile of the length of a noisy vector in the plane (Rice distribution).

    ``length`` is the length of the vector without noise. Both components have the standard deviation ``sigma`` > 0.

    Examples
    --------
    >>> round(length_quantile(0.95, 0.0, 1.0), 4)  # Rayleigh: sqrt(-2 log 0.05)
    2.4477
    """
    from scipy.special import chndtrix

    return sigma * math.sqrt(float(chndtrix(probability, 2.0, (length / sigma) ** 2)))


def two_sided_p(z: float) -> float:
    """Probability that a standard normal value is farther from 0 than ``z``.

    Examples
    --------
    >>> round(two_sided_p(1.959964), 4)
    0.05
    """
    return math.erfc(abs(z) / math.sqrt(2.0))
