"""Spans in which the on-board filter was wrong beyond 95 %, by hysteresis."""

import math

import numpy as np

from groundstation.base.quantiles import NORMAL_95, length_quantile
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.onboard_answer import WrongSpan
from groundstation.systems.trajectory.solution import FloatArray

CORRELATION_S = 60.0  # errors of the smoothed solution last so long: a log has so many independent looks at it
JOINED_S = 10.0  # two spans with less between them are one
LEAST_S = 2.0  # a shorter one is an outlier
MOST_SPANS = 10
HALF = 0.5  # of the least error that is told: below it a span ends


def wrong_spans(
    time_s: FloatArray, error: FloatArray, sigma: FloatArray, offset_sigma: float, least: float
) -> tuple[WrongSpan, ...]:
    """Find the spans in which an error is beyond its own 95 %, the worst first.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Even enough: each error stands for the time about it.
    error : ndarray, shape (n,) or (n, 2)
        Signed, or a vector in the plane.
    sigma : ndarray, shape (n,)
        Of the smoothed solution; of a vector that of one axis.
    offset_sigma : float
        Of the constant that was taken off.
    least : float
        A smaller error is none, however small the sigma.

    Notes
    -----
    A span begins where the error is beyond what one of all independent looks at the log reaches by chance in 5 % of
    logs (Bonferroni), and ends where it is inside the 95 % of a single look. The sigma of the smoothed solution is
    taken as one and the same error all through a span: averaging makes it no smaller.
    """
    total = np.hypot(sigma, offset_sigma)
    length_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    probability = 1.0 - 0.05 / max(length_s / CORRELATION_S, 1.0)
    found = []
    if error.ndim > 1:
        size = np.hypot(error[:, 0], error[:, 1])
        begins, holds = _radius(probability), _radius(0.95)
        for first, last in _runs(time_s, size, total, begins, holds, least):
            found.append(_span(time_s, size, total, first, last))
    else:
        begins, holds = _normal(probability), NORMAL_95
        for sign in (1.0, -1.0):
            for first, last in _runs(time_s, sign * error, total, begins, holds, least):
                found.append(_span(time_s, error, total, first, last))
    sure = [one for one in found if abs(one.value) > one.half95]
    return tuple(sorted(sure, key=lambda one: one.half95 - abs(one.value))[:MOST_SPANS])


def _radius(probability: float) -> float:
    return length_quantile(probability, 0.0, 1.0)


def _normal(probability: float) -> float:
    """Return the two-sided quantile of a normal value; that of one look is NORMAL_95."""
    from scipy.special import ndtri

    return float(ndtri(0.5 + 0.5 * probability))


def _runs(
    time_s: FloatArray, size: FloatArray, total: FloatArray, begins: float, holds: float, least: float
) -> list[tuple[int, int]]:
    """Return ends of the runs that hold and somewhere begin, joined over short pauses."""
    known = np.isfinite(size) & np.isfinite(total)
    value = np.where(known, size, 0.0)
    bound = np.where(known, total, math.inf)
    holding: BoolArray = (value > holds * bound) & (value > HALF * least)
    beginning = (value > begins * bound) & (value > least)
    at = np.flatnonzero(holding)
    if not len(at):
        return []
    breaks = np.flatnonzero(np.diff(time_s[at]) > JOINED_S)
    firsts, lasts = at[np.append(0, breaks + 1)], at[np.append(breaks, len(at) - 1)]
    return [
        (int(first), int(last))
        for first, last in zip(firsts, lasts, strict=True)
        if time_s[last] - time_s[first] >= LEAST_S and beginning[first : last + 1].any()
    ]


def _span(time_s: FloatArray, values: FloatArray, total: FloatArray, first: int, last: int) -> WrongSpan:
    inside = values[first : last + 1]
    largest = inside[int(np.nanargmax(np.abs(inside)))]
    half95 = NORMAL_95 * float(np.sqrt(np.nanmedian(total[first : last + 1] ** 2)))
    ends = (float(time_s[first]), float(time_s[last]))
    return WrongSpan(*ends, float(np.nanmedian(inside)), half95, float(largest))
