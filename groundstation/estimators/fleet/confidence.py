"""Confidence in a share of flights: exact binomial limits, order statistics, correlation.

The last says what flights of one INS are worth.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import share_quantile

FloatArray = NDArray[np.float64]
MOST_FLIGHTS = 1_000_000


def share_low(flights: float, over: float, confidence: float) -> float:
    """Return the lower limit of the share within, from ``flights`` of which ``over`` are not.

    Both may be effective numbers.

    Source: Clopper, Pearson, Biometrika 26 (1934), 404-413, one-sided.

    Examples
    --------
    >>> round(share_low(59, 0, 0.95), 4), round(share_low(58, 0, 0.95), 4), share_low(0, 0, 0.95)
    (0.9505, 0.9497, 0.0)
    """
    within = flights - over
    return share_quantile(1.0 - confidence, within, over + 1.0) if within > 0.0 else 0.0


def share_high(flights: float, over: float, confidence: float) -> float:
    """Upper limit of the share within.

    Examples
    --------
    >>> share_high(59, 0, 0.95), round(share_high(20, 4, 0.95), 3)
    (1.0, 0.929)
    """
    return share_quantile(confidence, flights - over + 1.0, over) if over > 0.0 else 1.0


def flights_needed(over: float, share: float, confidence: float) -> int:
    """Fewest flights with which the share is shown, if ``over`` of them are over.

    Source: Wilks, Annals of Mathematical Statistics 12 (1941), 91-96 (order statistics as limits of a share).

    Examples
    --------
    >>> [flights_needed(over, 0.95, 0.95) for over in (0, 1, 2)]
    [59, 93, 124]
    """
    low, high = math.floor(over), math.floor(over) + 1
    while share_low(high, over, confidence) < share:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if share_low(middle, over, confidence) >= share else (middle, high)
    return high


def flights_needed_at_share(share_over: float, share: float, confidence: float) -> int | None:
    """Return the fewest flights that show the share, if a fixed part is over; None if never.

    Examples
    --------
    >>> flights_needed_at_share(0.0, 0.95, 0.95), flights_needed_at_share(0.05, 0.95, 0.95)
    (59, None)
    """
    if share_over >= 1.0 - share:
        return None

    def is_shown(flights: int) -> bool:
        return share_low(flights, share_over * flights, confidence) >= share

    low, high = 0, 1
    while not is_shown(high):
        low, high = high, 2 * high
        if high > MOST_FLIGHTS:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_shown(middle) else (middle, high)
    return high


def order_bound(values: FloatArray, effective: float, share: float, confidence: float) -> float | None:
    """Return the upper limit of what ``share`` of the flights stay below.

    It is the largest value but as many as may lie above it. ``effective`` <= n is the number of independent flights
    that the values are worth. None with too few.

    Examples
    --------
    >>> order_bound(np.arange(59.0), 59, 0.95, 0.95), order_bound(np.arange(58.0), 58, 0.95, 0.95)
    (58.0, None)
    >>> order_bound(np.arange(93.0), 93, 0.95, 0.95)
    91.0
    """
    count = len(values)
    worth = effective / count if count else 0.0
    above = 0
    while above < count and share_low(effective, above * worth, confidence) >= share:
        above += 1
    return float(np.sort(values)[count - above]) if above else None


def correlation_within(values: FloatArray, groups: Sequence[str], confidence: float) -> float:
    """Return an upper limit of the correlation of two values of one group, 0 to 1.

    It is by a one-way analysis of variance. With one group nothing tells it: 1. With no group of two, 0: nothing is
    shared.

    Source: Searle, Biometrics 27 (1971), 1-76, for the interval; groups of unequal size by their effective size.
    """
    from scipy.special import fdtri

    names = np.asarray(groups)
    sizes = np.array([int(np.sum(names == name)) for name in np.unique(names)], dtype=np.float64)
    count, kinds = float(sizes.sum()), len(sizes)
    if sizes.max(initial=1.0) <= 1.0:
        return 0.0
    if kinds < 2:
        return 1.0
    own = [values[names == name] for name in np.unique(names)]
    means = np.array([one.mean() for one in own])
    within = sum(float(np.sum((one - one.mean()) ** 2)) for one in own)
    between = float(np.sum(sizes * (means - values.mean()) ** 2)) / (kinds - 1)
    within /= count - kinds
    size = (count - float(np.sum(sizes**2)) / count) / (kinds - 1)
    if within <= 0.0:
        return 1.0 if between > 0.0 else 0.0
    ratio = between / within / float(fdtri(kinds - 1, count - kinds, 1.0 - confidence))
    return float(np.clip((ratio - 1.0) / (ratio - 1.0 + size), 0.0, 1.0))


def effective_flights(groups: Sequence[str], correlation: float) -> float:
    """Independent flights that flights of some INS are worth, those of one INS correlated.

    n / (1 + (m - 1) correlation), m the mean number of flights of the INS of a flight. With a correlation of one it is
    the number of INS if each flew as often, and fewer if some flew more than others.

    Source: Kish, Survey Sampling (1965), design effect; Korn, Graubard, Survey Methodology 24 (1998), 193-201, for
    exact limits of a share from the effective number.

    Examples
    --------
    >>> effective_flights(["a"] * 10 + ["b"] * 10, 0.0), effective_flights(["a"] * 10 + ["b"] * 10, 1.0)
    (20.0, 2.0)
    >>> round(effective_flights(["a"] * 9 + ["b"], 1.0), 2)
    1.22
    """
    sizes = np.unique(np.asarray(groups), return_counts=True)[1].astype(np.float64)
    if not len(sizes):
        return 0.0
    count = float(sizes.sum())
    mean_size = float(np.sum(sizes**2)) / count
    return count / (1.0 + (mean_size - 1.0) * correlation)
