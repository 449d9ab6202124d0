"""Quantiles and p-values of the usual distributions, written out or from scipy.special.

Importing scipy.stats takes 0.6 s. scipy.special takes a tenth of a second, which a verb that asks for intervals of a
mean, a share or a length alone is spared.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
_MANY = 1000.0  # degrees of freedom, times the square of the normal quantile, above which the expansion serves
_LARGE = 100.0  # from here on the series of the ratio of gamma functions is exact
_LARGE_FOR_STIRLING = 15.0
_LOG_OF_LARGEST = 709.0  # of a float
_ANGLES, _BEYOND = 64, 9.0  # steps of an integral over normal noise, which is never beyond so many sigma
_MOST_STEPS, _SETTLED = 100, 1e-15
_MOST_TERMS, _LAST_TERM = 100_000, 1e-16
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


@lru_cache(maxsize=1024)
def student_quantile(probability: float, freedom: float) -> float:
    """Return the value that Student's t stays below with the given probability.

    ``freedom`` is the degrees of freedom, of any size above 0. The logarithm of the chance to exceed a value is nearly
    straight over the logarithm of that value, so Newton's steps there settle from any beginning; many degrees of
    freedom have the expansion about the normal quantile.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, eq. 26.7.5; Press et al., Numerical
    Recipes, third edition, 2007, section 6.4 (the incomplete beta function as a continued fraction).

    Examples
    --------
    >>> round(student_quantile(0.975, 2.0), 3)
    4.303
    """
    if not (0.0 <= probability <= 1.0 and freedom > 0.0):
        return math.nan
    if probability <= 0.5:
        return -_student_above(probability, freedom)
    return _student_above(1.0 - probability, freedom)


def _student_above(chance: float, freedom: float) -> float:
    """Return the value of 0 or more that Student's t exceeds with a chance of at most a half."""
    if chance in (0.0, 0.5):
        return 0.0 if chance else math.inf
    z = normal_above(chance)
    if freedom > _MANY * max(1.0, z * z):
        return _student_of_many(z, freedom)
    log_density_at_0 = math.log(_gamma_ratio(0.5 * freedom) / math.sqrt(math.pi * freedom))
    value = z if freedom > 2.0 else _student_in_tail(chance, freedom, log_density_at_0)
    for _ in range(_MOST_STEPS):
        square = value * value / freedom
        if math.isinf(square):
            return value  # the power law is exact there
        log_weight = math.log(value) + log_density_at_0 - 0.5 * (freedom + 1.0) * math.log1p(square)
        if value * value * (freedom + 2.0) > 3.0 * freedom:
            share = _beta_fraction(0.5 * freedom, 0.5, 1.0 / (1.0 + square)) / freedom
            log_above, slope = log_weight + math.log(share), 1.0 / share
        else:
            weight = math.exp(log_weight)
            above = 0.5 - weight * _beta_fraction(0.5, 0.5 * freedom, square / (1.0 + square))
            log_above, slope = math.log(above), weight / above
        step = (log_above - math.log(chance)) / slope
        value *= math.exp(step)
        if abs(step) < _SETTLED:
            break
    return value


def _student_in_tail(chance: float, freedom: float, log_density_at_0: float) -> float:
    """Return the value by the power law of the tail, which it never exceeds.

    Newton's steps go down from there.
    """
    log_value = (log_density_at_0 - math.log(chance) + 0.5 * (freedom - 1.0) * math.log(freedom)) / freedom
    return math.exp(log_value) if log_value < _LOG_OF_LARGEST else math.inf


def normal_above(chance: float) -> float:
    """Return the value that a standard normal one exceeds with a chance.

    That is more than 0 and at most a half.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, eq. 26.2.23, to 5e-4, then Halley's steps.

    Examples
    --------
    >>> round(normal_above(0.025), 6)
    1.959964
    """
    root = math.sqrt(-2.0 * math.log(chance))
    z = root - (2.515517 + root * (0.802853 + root * 0.010328)) / (
        1.0 + root * (1.432788 + root * (0.189269 + root * 0.001308))
    )
    for _ in range(3):
        density = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
        step = (0.5 * math.erfc(z / math.sqrt(2.0)) - chance) / density
        z += step / (1.0 - 0.5 * z * step)
    return max(z, 0.0)


def normal_below(values: FloatArray) -> FloatArray:
    """Return the chance that a standard normal value is below each of these, shape (n,).

    Examples
    --------
    >>> normal_below(np.array([-1.959964, 0.0])).round(3).tolist()
    [0.025, 0.5]
    """
    return np.array([0.5 * math.erfc(-math.sqrt(0.5) * value) for value in values.tolist()], dtype=np.float64)


def _student_of_many(z: float, freedom: float) -> float:
    """Return the quantile of Student's t by that of the normal distribution.

    Cut after the fourth power of 1 / freedom: the next term is below 1e-17 of the value where it is used.
    """
    s, r = z * z, 1.0 / freedom
    first = (s + 1.0) / 4.0
    second = ((5.0 * s + 16.0) * s + 3.0) / 96.0
    third = (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0
    fourth = ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0
    return z * (1.0 + r * (first + r * (second + r * (third + r * fourth))))


def _gamma_ratio(a: float) -> float:
    """Return gamma(a + 1/2) / gamma(a); logarithms of the two would cancel to some 1e-12."""
    if a < _LARGE:
        return math.gamma(a + 0.5) / math.gamma(a)
    r = 1.0 / a
    series = 1.0 + r * (-1 / 8 + r * (1 / 128 + r * (5 / 1024 + r * (-21 / 32768 - r * 399 / 262144))))
    return math.sqrt(a) * series


def _beta_fraction(a: float, b: float, x: float) -> float:
    """Return the continued fraction of the incomplete beta function, by Lentz's method.

    With it, the regularised function is x**a (1 - x)**b / (a B(a, b)) times this; it converges fast below
    x = (a + 1) / (a + b + 2).
    """
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    fraction = d
    for m in range(1, _MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        d, c = 1.0 / (1.0 + even * d), 1.0 + even / c
        fraction *= d * c
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        d, c = 1.0 / (1.0 + odd * d), 1.0 + odd / c
        fraction *= d * c
        if abs(d * c - 1.0) < _LAST_TERM:
            break
    return fraction


def share_quantile(probability: float, successes: float, failures: float) -> float:
    """Quantile of the beta distribution with these two parameters.

    Newton's steps inside an interval that holds it and is halved where a step would leave it.

    Examples
    --------
    >>> round(share_quantile(0.5, 1.0, 1.0), 6)
    0.5
    """
    if not (0.0 <= probability <= 1.0 and 0.0 < successes < math.inf and 0.0 < failures < math.inf):
        return math.nan
    if probability in (0.0, 1.0):
        return float(probability)
    low, high, share = 0.0, 1.0, successes / (successes + failures)
    for _ in range(_MOST_STEPS):
        off, slope = _share_below(share, successes, failures, probability)
        low, high = (share, high) if off < 0.0 else (low, share)
        beside = share - off / slope if slope else low
        beside = beside if low < beside < high else 0.5 * (low + high)
        is_settled, share = abs(beside - share) <= _SETTLED * share, beside
        if is_settled:
            break
    return share


def _share_below(share: float, a: float, b: float, probability: float) -> tuple[float, float]:
    """Return the chance of a smaller share, less a probability, and its slope.

    The shares have a beta distribution. The weight x**a (1 - x)**b / B(a, b) is taken about its top, where no large
    logarithms cancel.

    Source: Loader, Fast and accurate computation of binomial probabilities, 2000.
    """
    total, rest = a + b, 1.0 - share
    top = math.sqrt(a * b / (2.0 * math.pi * total))
    beyond = total * share - a
    shape = a * _log_ratio(total * share, a, beyond) + b * _log_ratio(total * rest, b, -beyond)
    weight = top * math.exp(shape + _stirling_error(total) - _stirling_error(a) - _stirling_error(b))
    if share < (a + 1.0) / (total + 2.0):
        off = weight * _beta_fraction(a, b, share) / a - probability
    else:
        off = (1.0 - probability) - weight * _beta_fraction(b, a, rest) / b
    return off, weight / (share * rest) if rest else 0.0


def _log_ratio(value: float, top: float, beyond: float) -> float:
    """Return the logarithm of one value over another.

    It is taken of their difference where they are close.
    """
    if abs(beyond) < 0.5 * top:
        return math.log1p(beyond / top)
    return math.log(value / top) if value else -math.inf


def _stirling_error(z: float) -> float:
    """Return the logarithm of gamma(z + 1) less that of Stirling's formula."""
    if z < _LARGE_FOR_STIRLING:
        return math.lgamma(z + 1.0) - (z + 0.5) * math.log(z) + z - 0.5 * math.log(2.0 * math.pi)
    r = 1.0 / (z * z)
    return (1 / 12 - r * (1 / 360 - r * (1 / 1260 - r * (1 / 1680 - r * (1 / 1188))))) / z


def length_quantile(probability: float, length: float, sigma: float) -> float:
    """Return a quantile of the length of a noisy vector in the plane (Rice distribution).

    ``length`` is the length of the vector without noise. Both components have the standard deviation ``sigma`` > 0.
    The quantile lies above those of the noise alone and of the component along the vector, and below the sum of
    ``length`` and that of the noise: it is searched there by the method of false position (Illinois).

    Examples
    --------
    >>> round(length_quantile(0.95, 0.0, 1.0), 4)  # Rayleigh: sqrt(-2 log 0.05)
    2.4477
    """
    if not 0.0 <= probability < 1.0:
        return math.inf if probability == 1.0 else math.nan
    true = abs(length) / sigma
    of_noise = math.sqrt(2.0 * abs(math.log1p(-probability)))
    if not true:
        return sigma * of_noise
    along = normal_above(1.0 - probability) if probability > 0.5 else 0.0
    low, high = max(of_noise, true + along) if probability > 0.5 else of_noise, true + of_noise
    under, over = _share_within(low, true) - probability, _share_within(high, true) - probability
    for _ in range(_MOST_STEPS):
        middle = (low * over - high * under) / (over - under) if under < 0.0 < over else low
        if not low + _SETTLED * low < middle < high - _SETTLED * high:
            break
        found = _share_within(middle, true) - probability
        if found < 0.0:
            low, under, over = middle, found, 0.5 * over
        else:
            high, over, under = middle, found, 0.5 * under
    return sigma * (low if -under < over else high)


def _share_within(length: float, true: float) -> float:
    """Return the chance that a noisy vector is no longer than ``length``.

    Its noise is 1 in each component. The integral over the component across is one over the angle of a smooth function
    of period pi, or of one that ends at nothing: sums at even steps give it to rounding.
    """
    half = math.asin(min(1.0, _BEYOND / length)) if length else 0.0
    total = 0.0
    for step in range(_ANGLES):
        angle = half * (step + 0.5) / _ANGLES
        along, across = length * math.cos(angle), length * math.sin(angle)
        inside = math.erfc((true - along) * math.sqrt(0.5)) - math.erfc((true + along) * math.sqrt(0.5))
        total += inside * math.exp(-0.5 * across * across) * along
    return total * half / _ANGLES / math.sqrt(2.0 * math.pi)


def two_sided_p(z: float) -> float:
    """Probability that a standard normal value is farther from 0 than ``z``.

    Examples
    --------
    >>> round(two_sided_p(1.959964), 4)
    0.05
    """
    return math.erfc(abs(z) / math.sqrt(2.0))
