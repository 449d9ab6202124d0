"""Five classical deviation coefficients, with errors that allow for correlated residuals."""

import math
from collections.abc import Callable

import numpy as np

from groundstation.base.angles import FloatArray

COEFFICIENTS = 5
OVER_CIRCLE = np.array([1.0, 0.5, 0.5, 0.5, 0.5])  # mean squares of 1, sin, cos, sin 2, cos 2
INFLATION_MAX = 4.0
BANDWIDTH_FACTOR = 1.1447  # Andrews 1991, equation 6.2, Bartlett kernel
BANDWIDTH_SHARE = 0.1


def design(heading_deg: FloatArray) -> FloatArray:
    """Return the columns 1, sin c, cos c, sin 2c, cos 2c, shape (n, 5)."""
    rad = np.deg2rad(np.asarray(heading_deg, dtype=np.float64))
    return np.stack([np.ones_like(rad), np.sin(rad), np.cos(rad), np.sin(2 * rad), np.cos(2 * rad)], axis=-1)


def fit(
    heading_deg: FloatArray, error_deg: FloatArray, weight: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Fit the coefficients A to E, shape (5,), and their covariance, shape (5, 5).

    The fit is by weighted least squares. Errors must not wrap: they are differences from a middle, not headings.
    Samples come in order of time or of heading.

    Examples
    --------
    >>> heading = np.arange(360.0)
    >>> values, _ = fit(heading, design(heading) @ [1.0, 2.0, -3.0, 0.5, 0.0])
    >>> values.round(9).tolist()
    [1.0, 2.0, -3.0, 0.5, 0.0]
    """
    columns = design(heading_deg)
    weighted = columns if weight is None else columns * weight[:, None]
    bread = _bread(columns, weighted)
    values = bread @ (weighted.T @ error_deg)
    residual = error_deg - columns @ values
    correlation = autocorrelation(residual, COEFFICIENTS)
    middle = long_run(weighted * residual[:, None], correlation) * inflation(len(residual), COEFFICIENTS, correlation)
    return values, bread @ middle @ bread


def fit_to(heading_deg: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return a function that gives the coefficients of :func:`fit` alone, shape (5,).

    It serves many errors on the same headings.
    """
    columns = design(heading_deg)
    bread = _bread(columns, columns)
    return lambda error_deg: bread @ (columns.T @ error_deg)


def _bread(columns: FloatArray, weighted: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.pinv(columns.T @ weighted), dtype=np.float64)


def autocorrelation(residual: FloatArray, parameters: int) -> float:
    """Return the correlation of neighbours, in [0, 0.995].

    It is freed of the bias that fitting so many slow regressors makes.

    Source: M. G. Kendall, Biometrika 41 (1954) 403-404, whose (1 + 3 r) / n is that of a mean; k (1 + r) / n + 2 r / n
    here.
    """
    power, count = float(np.sum(residual**2)), len(residual)
    if count < 3 or power <= 0.0:
        return 0.0
    raw = float(np.sum(residual[1:] * residual[:-1]) / power)
    return float(np.clip(raw + (parameters * (1.0 + raw) + 2.0 * raw) / count, 0.0, 0.995)) if raw > 0.0 else 0.0


def inflation(samples: int, parameters: int, correlation: float) -> float:
    """Return the factor n / (n - k) on a variance, at most 4.

    n is the number of independent samples that correlated ones are worth. They are worth no more than the windows of
    :func:`long_run`, among which the parameters take theirs.

    Examples
    --------
    >>> round(inflation(3000, 5, 0.0), 1), inflation(3, 5, 0.0)
    (2.0, 4.0)
    """
    worth = samples * (1.0 - correlation) / (1.0 + correlation)
    worth = min(worth, samples / _width(samples)) if samples else 0.0
    return worth / max(worth - parameters, worth / INFLATION_MAX) if worth > 0.0 else INFLATION_MAX


def long_run(scores: FloatArray, correlation: float) -> FloatArray:
    """Return the covariance of the sum of correlated scores, shape (n, k) -> (k, k).

    The scores are prewhitened, then summed with Bartlett weights. Scores are whitened by the first-order
    autocorrelation of the residuals, and the sum is recoloured by 1 / (1 - correlation)^2. Wander below white noise
    does not show in the correlation of neighbours, so the weights reach over ``BANDWIDTH_SHARE`` of the samples at
    least. With them the covariance is that of sums over windows.

    Source: D. W. K. Andrews, J. C. Monahan, Econometrica 60 (1992) 953-966; W. K. Newey, K. D. West, Econometrica 55
    (1987) 703-708.
    """
    if not len(scores):
        return np.zeros((scores.shape[1], scores.shape[1]))
    white = scores.copy()
    white[1:] -= correlation * scores[:-1]
    width = _width(len(scores))
    running = np.cumsum(np.pad(white, ((width, width - 1), (0, 0))), axis=0)
    windows = running[width:] - running[:-width]
    return np.asarray(windows.T @ windows / (width * (1.0 - correlation) ** 2))


def _width(samples: int) -> int:
    """Return the number of samples over which the weights reach."""
    lags: float = max(BANDWIDTH_FACTOR * samples ** (1.0 / 3.0), BANDWIDTH_SHARE * samples)
    return min(1 + math.ceil(lags), samples)
