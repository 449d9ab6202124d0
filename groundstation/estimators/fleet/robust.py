"""Robust centre and spread of flights, and the distance from them by chance alone.

Single wild flights do not move them.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import student_quantile

FloatArray = NDArray[np.float64]
NORMAL_MAD = 0.674490  # median of |x| of a standard normal
NORMAL_STEP = 0.953873  # median of |x - y| of two of them
# Values that are worth one degree of freedom of the spread: so chosen that simulated normal series of 6 to 200 values
# are called out of limits as often as stated (docs/fleet.md).
VALUES_PER_FREEDOM_MAD = 2.2
VALUES_PER_FREEDOM_STEP = 1.8


def sigma_of_spread(value: FloatArray) -> float:
    """Standard deviation of a normal from the median distance to the median; NaN for nothing.

    Examples
    --------
    >>> round(sigma_of_spread(np.array([1.0, 2.0, 3.0, 4.0, 1000.0])), 4)
    1.4826
    """
    return float(np.median(np.abs(value - np.median(value)))) / NORMAL_MAD if len(value) else float("nan")


def sigma_of_steps(step: FloatArray) -> float:
    """Return a normal's standard deviation from the median of successive differences.

    A change of level hardly moves it.

    Examples
    --------
    >>> round(sigma_of_steps(np.diff([0.0, 1.0, 0.0, 1.0, 50.0, 51.0, 50.0])), 4)
    1.0484
    """
    return float(np.median(np.abs(step))) / NORMAL_STEP if len(step) else float("nan")


def limit_in_sigmas(values: int, chance: float, values_per_freedom: float) -> float:
    """Return the robust sigmas a value may be away before chance alone is below ``chance``.

    Two-sided. Student's quantile: a spread from few values is itself uncertain.

    Examples
    --------
    >>> round(limit_in_sigmas(100_000, 0.0027, VALUES_PER_FREEDOM_STEP), 2)
    3.0
    >>> round(limit_in_sigmas(10, 0.0027, VALUES_PER_FREEDOM_STEP), 1)
    5.1
    """
    return student_quantile(1.0 - 0.5 * chance, max(values / values_per_freedom, 1.0))
