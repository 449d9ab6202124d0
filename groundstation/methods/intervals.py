"""Intervals and sizes of samples that several systems state."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.quantiles import chi_square_quantile, share_quantile


def share_interval(inside: float, checks: float, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a share.

    For correlated checks, both numbers are effective ones.

    Source: Clopper, Pearson, Biometrika 26 (1934), 404-413.

    Examples
    --------
    >>> [round(bound, 4) for bound in share_interval(19, 20)]
    [0.7513, 0.9987]
    >>> share_interval(0, 0)
    (0.0, 1.0)
    """
    tail = 0.5 * (1.0 - confidence)
    low = share_quantile(tail, inside, checks - inside + 1) if inside > 0.0 else 0.0
    high = share_quantile(1.0 - tail, inside + 1, checks - inside) if inside < checks else 1.0
    return low, high


def wilson_interval(hits: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return Wilson's interval of a share; (0, 1) without trials.

    On average over the shares it holds the truth as often as it says, where the exact one holds it more often.

    Source: E. B. Wilson, Journal of the American Statistical Association 22 (1927), 209-212.

    Examples
    --------
    >>> [round(bound, 4) for bound in wilson_interval(1, 10)]
    [0.0179, 0.4042]
    >>> wilson_interval(0, 0)
    (0.0, 1.0)
    """
    if not trials:
        return 0.0, 1.0
    z = float(np.sqrt(chi_square_quantile(confidence, 1.0)))
    share, extra = hits / trials, z * z / trials
    middle = (share + 0.5 * extra) / (1.0 + extra)
    half = z / (1.0 + extra) * float(np.sqrt(share * (1.0 - share) / trials + extra / (4.0 * trials)))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def nees_limits(freedom: int, independent: int, share: float = 0.95) -> tuple[float, float]:
    """Return the limits of the mean of ``independent`` normalised squared errors.

    Each has ``freedom`` degrees of freedom; ``share`` of the means lie inside.

    Examples
    --------
    >>> low, high = nees_limits(2, 100)
    >>> round(low, 2), round(high, 2)
    (1.63, 2.41)
    """
    total = freedom * independent
    low, high = (
        float(chi_square_quantile(part, total)) / independent for part in (0.5 - 0.5 * share, 0.5 + 0.5 * share)
    )
    return low, high


def effective_samples(values: FloatArray, about: float | None = None) -> float:
    """Return the number of independent samples that give the mean the same variance.

    It is n / (1 + 2 sum of autocorrelations). The sum ends at the first pair of lags whose sum is not positive.
    ``about`` is the true mean where it is known, else that of the samples: errors that are claimed to have none are one
    another's repetition where they share one.

    Source: C. J. Geyer, Practical Markov chain Monte Carlo, Statistical Science 7 (1992), section 3.3 (initial
    positive sequence).
    """
    count = len(values)
    centred = values - (np.mean(values) if about is None else about)
    variance = float(np.mean(centred**2))
    if count < 4 or variance <= 0.0:
        return float(count)
    size = 2 ** int(np.ceil(np.log2(2 * count)))
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[:count] / (count * variance)
    pairs = correlation[0 : count - 1 : 2] + correlation[1:count:2]
    end = int(np.argmax(pairs <= 0.0)) if bool(np.any(pairs <= 0.0)) else len(pairs)
    factor = max(2.0 * float(np.sum(pairs[:end])) - 1.0, 1.0 / count)
    return float(np.clip(count / factor, 1.0, count))


def slope_through_origin(hours: FloatArray, error: FloatArray, weight: FloatArray) -> float:
    """Fit error = slope times hours by least squares.

    Examples
    --------
    >>> slope_through_origin(np.array([1.0, 2.0]), np.array([0.5, 1.0]), np.ones(2))
    0.5
    """
    return float(np.sum(weight * hours * error) / np.sum(weight * hours**2))


BOUND95 = 1.959963984540054  # standard errors, of the normal distribution
DENSITY_AT_MEAN = 0.3989422804014327  # of the standard normal distribution
MOST_STEPS, SMALLEST_STEP = 120, 1e-14  # of the search of a quantile; in sigmas of the whole


def mixture_quantile(probability: float, mean: FloatArray, sigma: FloatArray, weight: FloatArray) -> float:
    """Quantile of a mixture of normal distributions, by Newton's method between bounds.

    The bounds close in with every step. Where a step leaves them, or is not half as long as the one before the last,
    the middle between them is next: there are never many more steps than bisection takes, and seldom more than eight.

    Source: W. Press et al., Numerical Recipes, third edition, 2007, section 9.4 (rtsafe).

    Examples
    --------
    >>> round(mixture_quantile(0.975, np.zeros(2), np.array([1.0, 1.0]), np.array([0.3, 0.7])), 3)
    1.96
    """
    from scipy.special import ndtr, ndtri

    low, high = float(np.min(mean - 12.0 * sigma)), float(np.max(mean + 12.0 * sigma))
    middle = float(weight @ mean)
    spread = float(np.sqrt(weight @ (sigma**2 + (mean - middle) ** 2)))
    at = min(max(middle + spread * float(ndtri(probability)), low), high)
    steps = (high - low, high - low)
    for _ in range(MOST_STEPS):
        apart = (at - mean) / sigma
        missing = probability - float(weight @ ndtr(apart))
        low, high = (at, high) if missing > 0.0 else (low, at)
        density = float(weight @ (np.exp(-0.5 * apart * apart) / sigma)) * DENSITY_AT_MEAN
        step = missing / density if density > 0.0 else np.inf
        if abs(step) <= SMALLEST_STEP * spread:
            return at + step
        if not low < at + step < high or abs(step) > 0.5 * abs(steps[0]):
            step = 0.5 * (low + high) - at
            if step in (low - at, high - at):  # no number lies between
                return at
        at, steps = at + step, (steps[1], step)
    return at
