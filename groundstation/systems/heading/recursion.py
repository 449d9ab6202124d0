"""Running figures of the paper after every sample: mean, variance, precision e, quality."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Running:
    """Figures after samples 1 to n, shapes (n,), degrees; NaN where fewer samples than needed.

    Parameters
    ----------
    mean_deg : m_i, the heading error so far
    sigma_deg : s_i, standard deviation of the differences about m_i
    precision_deg : e_i = 1.96 sqrt(s2_i / (i - 1))
    quality_deg : standard deviation of m_1 ... m_i about their own mean
    """

    mean_deg: FloatArray
    sigma_deg: FloatArray
    precision_deg: FloatArray
    quality_deg: FloatArray

    def __len__(self) -> int:
        return len(self.mean_deg)


def _running_moments(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return running mean and standard deviation (divisor i) of values, shape (n,).

    They are about a shift that keeps them exact.
    """
    count = np.arange(1, len(values) + 1)
    shift = float(np.median(values)) if len(values) else 0.0
    centred = values - shift
    mean = np.cumsum(centred) / count
    # Chan et al.: the sum of squares grows by (x_i - m_(i-1)) (x_i - m_i), which is never negative.
    before = np.concatenate([[0.0], mean[:-1]])
    squares = np.cumsum((centred - before) * (centred - mean))
    return mean + shift, np.sqrt(np.maximum(squares, 0.0) / count)


def run_recursion(difference_deg: FloatArray) -> Running:
    """Run the paper's recursion over differences d = INS heading - track, shape (n,).

    The differences are wrapped about their centre. m_i = m_(i-1) - (m_(i-1) - d_i) / i; s2_i = (1/i) sum (d - m_i)^2,
    in the one-pass form of Welford (1962); e_i = 1.96 sqrt(s2_i / (i - 1)); quality: the same standard deviation of the
    running mean about its own mean.

    Source: Markelov, Kostishin, Shukalov, 2015 (the variance recursion is only partly legible in print).

    Examples
    --------
    >>> running = run_recursion(np.array([1.0, 2.0, 3.0]))
    >>> [float(value) for value in running.mean_deg]
    [1.0, 1.5, 2.0]
    >>> round(float(running.precision_deg[-1]), 4)  # 1.96 sqrt((2 / 3) / 2)
    1.1316
    >>> round(float(running.quality_deg[-1]), 4)  # of 1.0, 1.5, 2.0
    0.4082
    """
    difference = np.asarray(difference_deg, dtype=np.float64)
    mean, sigma = _running_moments(difference)
    _mean_of_means, quality = _running_moments(mean)
    count = np.arange(1, len(difference) + 1)
    precision = np.full(len(difference), np.nan)
    precision[1:] = NORMAL_95 * sigma[1:] / np.sqrt(count[1:] - 1.0)
    return Running(mean, sigma, precision, quality)
