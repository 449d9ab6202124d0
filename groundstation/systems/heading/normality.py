"""Normality of the differences: sizes of the deviation, gated, and p-values, shown."""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import two_sided_p
from groundstation.systems.heading.settings import HeadingSettings

FloatArray = NDArray[np.float64]
LEAST_SAMPLES = 20
MADE_FOR_SAMPLES, SCATTER_SIGMAS = 400, 3.0  # of the limits of skewness, kurtosis and distance
LEAST_SPREAD_DEG = 1e-6  # below it there is nothing to fit a normal to


@dataclass(frozen=True)
class Normality:
    """Sizes of the deviation from a normal distribution, with p-values.

    The p-values take the samples as independent. The p-values are shown and not gated: with hundreds of samples they
    reject good runs.
    """

    skewness: float
    excess_kurtosis: float
    distance: float
    skewness_p: float
    kurtosis_p: float
    distance_p: float


def normality(difference_deg: FloatArray) -> Normality | None:
    """Return skewness, excess kurtosis and largest distance to the fitted normal distribution.

    The distance is that between the distribution functions of sample and fit. None for fewer than 20 samples or
    differences without spread.

    Source: moments as in Pearson; distance as in Lilliefors, On the Kolmogorov-Smirnov test for normality with mean and
    variance unknown, 1967. Its p-value is that of a known normal (too large, and said so), by the approximation of
    Stephens, Journal of the Royal Statistical Society B 32 (1970), 115-122.
    """
    from scipy.special import kolmogorov, ndtr

    count = len(difference_deg)
    spread = float(np.std(difference_deg)) if count else 0.0
    if count < LEAST_SAMPLES or spread < LEAST_SPREAD_DEG:
        return None
    standard = np.sort((difference_deg - np.mean(difference_deg)) / spread)
    skewness, kurtosis = float(np.mean(standard**3)), float(np.mean(standard**4))
    below, share = ndtr(standard), np.arange(count + 1) / count
    distance = float(max(np.max(share[1:] - below), np.max(below - share[:-1])))
    return Normality(
        skewness=skewness,
        excess_kurtosis=kurtosis - 3.0,
        distance=distance,
        skewness_p=two_sided_p(skewness_z(skewness, count)),
        kurtosis_p=two_sided_p(kurtosis_z(kurtosis, count)),
        distance_p=float(kolmogorov(distance * (math.sqrt(count) + 0.12 + 0.11 / math.sqrt(count)))),
    )


def skewness_z(skewness: float, count: int) -> float:
    """Return the skewness of a sample as a standard normal value.

    That holds if the samples are normal and independent.

    Source: D'Agostino, Biometrika 57 (1970), 679-681.
    """
    n = float(count)
    y = skewness * math.sqrt((n + 1.0) * (n + 3.0) / (6.0 * (n - 2.0)))
    beta = 3.0 * (n * n + 27.0 * n - 70.0) * (n + 1.0) * (n + 3.0)
    beta /= (n - 2.0) * (n + 5.0) * (n + 7.0) * (n + 9.0)
    w2 = math.sqrt(2.0 * (beta - 1.0)) - 1.0
    return math.asinh(y * math.sqrt((w2 - 1.0) / 2.0)) / math.sqrt(0.5 * math.log(w2))


def kurtosis_z(kurtosis: float, count: int) -> float:
    """Kurtosis (3 for a normal distribution) of a sample as a standard normal value.

    Source: Anscombe, Glynn, Biometrika 70 (1983), 227-234.
    """
    n = float(count)
    mean = 3.0 * (n - 1.0) / (n + 1.0)
    variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0) ** 2 * (n + 3.0) * (n + 5.0))
    x = (kurtosis - mean) / math.sqrt(variance)
    skew = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
    skew *= math.sqrt(6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0)))
    a = 6.0 + 8.0 / skew * (2.0 / skew + math.sqrt(1.0 + 4.0 / skew**2))
    root = math.cbrt((1.0 - 2.0 / a) / (1.0 + x * math.sqrt(2.0 / (a - 4.0))))
    return (1.0 - 2.0 / (9.0 * a) - root) / math.sqrt(2.0 / (9.0 * a))


def normality_limits(settings: HeadingSettings, samples: int) -> tuple[float, tuple[float, float], float]:
    """Limits of skewness, excess kurtosis and distance for so many samples.

    The settings are for 400 samples; fewer scatter more by themselves, by three standard errors: sqrt(6 / n) and
    sqrt(24 / n) of the moments, 0.35 / sqrt(n) of the distance.
    """

    def more(variance: float) -> float:
        return SCATTER_SIGMAS * float(np.sqrt(variance) * max(samples**-0.5 - MADE_FOR_SAMPLES**-0.5, 0.0))

    low, high = settings.excess_kurtosis_range
    kurtosis = low - more(24.0), high + more(24.0)
    return settings.skewness_max + more(6.0), kurtosis, settings.normal_distance_max + more(0.35**2)
