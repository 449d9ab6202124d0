"""Statistics of many parts merged from n, mean and M2, never from means of means."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.dataclasses import dataclass


@dataclass(frozen=True)
class Moments:
    """Number of values, their mean, and M2, the sum of squares about the mean."""

    count: int = 0
    mean: float = 0.0
    m2: float = 0.0

    @property
    def sigma(self) -> float:
        """Standard deviation with divisor n - 1, NaN for fewer than two values."""
        return math.sqrt(self.m2 / (self.count - 1)) if self.count > 1 else math.nan


def moments_of(values: ArrayLike) -> Moments:
    """Moments of values; those that are not finite are left out.

    Examples
    --------
    >>> moments_of([1.0, 2.0, float("nan"), 3.0])
    Moments(count=3, mean=2.0, m2=2.0)
    """
    known = np.asarray(values, dtype=np.float64).ravel()
    known = known[np.isfinite(known)]
    if not len(known):
        return Moments()
    mean = float(np.mean(known))
    return Moments(len(known), mean, float(np.sum((known - mean) ** 2)))


def merged(parts: Iterable[Moments]) -> Moments:
    """Moments of all values of the parts together.

    With d = mean_b - mean_a and n = n_a + n_b: mean = mean_a + d n_b / n, M2 = M2_a + M2_b + d^2 n_a n_b / n.

    Source: Chan, Golub, LeVeque, Algorithms for computing the sample variance, The American Statistician 37 (1983),
    eq. (2.1).

    Examples
    --------
    >>> merged([moments_of([1.0, 2.0]), Moments(), moments_of([6.0])]) == moments_of([1.0, 2.0, 6.0])
    True
    """
    count, mean, m2 = 0, 0.0, 0.0
    for part in parts:
        if not part.count:
            continue
        total = count + part.count
        step = part.mean - mean
        m2 += part.m2 + step * step * count * part.count / total
        mean += step * part.count / total
        count = total
    return Moments(count, mean, m2)
