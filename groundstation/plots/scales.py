"""Scales of axes: place of a value between the ends, and ends for an axis without any."""

import math

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.plots.marks import Floats
from groundstation.plots.plot import Scale
from groundstation.plots.ranges import finite

LINEAR_SHARE = 10.0 / 9.0  # decades from zero to where a symlog scale becomes logarithmic
MARGIN = 0.05  # margin on either side, as a share of what is drawn
LEAST_SPAN = 1e-9  # least span as a share of the greater end: nearer ends are moved apart
SMALLEST = 1e-200  # ends nearer to each other are one, and nothing smaller stands on a logarithmic scale
LEAST_LINEAR = 1e-100
LARGEST = 1e200  # larger numbers count as infinite; squares of smaller ones are finite
NO_PLACES: Floats = np.zeros(0)


@dataclass(frozen=True)
class ScaleSpan:
    """Scale with its ends; one that runs backwards has the greater first."""

    scale: Scale
    low: float
    high: float
    linear_to: float = 1.0

    def shares(self, values: Floats) -> Floats:
        """Share of the way from ``low`` to ``high``; NaN where the scale has no place for a value."""
        ends = self._drawn(np.array([self.low, self.high]))
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray((self._drawn(values) - ends[0]) / (ends[1] - ends[0]), dtype=np.float64)

    def share(self, value: float) -> float:
        """Share of the way for one value."""
        return float(self.shares(np.array([value]))[0])

    def _drawn(self, values: Floats) -> Floats:
        values = np.where(np.isfinite(values), np.clip(values, -10.0 * LARGEST, 10.0 * LARGEST), np.nan)
        if self.scale == "log":
            return np.asarray(np.log10(np.where(values >= SMALLEST, values, np.nan)))
        if self.scale == "symlog":
            size = np.abs(values) / self.linear_to
            with np.errstate(divide="ignore"):
                beyond = LINEAR_SHARE + np.log10(np.maximum(size, 1.0))
            return np.asarray(np.sign(values) * np.where(size <= 1.0, LINEAR_SHARE * size, beyond))
        return values


def span_of(
    scale: Scale,
    low: float | None,
    high: float | None,
    drawn: Floats,
    linear_to: float = 1.0,
    *,
    is_tight: bool = False,
) -> ScaleSpan:
    """Return the scale with ends: its own, else those of what is drawn.

    The latter get a little around them unless ``is_tight``.

    Examples
    --------
    >>> span_of("linear", None, 10.0, np.array([0.0, 4.0]), is_tight=True)
    ScaleSpan(scale='linear', low=0.0, high=10.0, linear_to=1.0)
    >>> span_of("log", None, None, np.zeros(0), is_tight=True).low
    1.0
    """
    linear_to = min(max(linear_to, LEAST_LINEAR), LARGEST) if math.isfinite(linear_to) and linear_to > 0.0 else 1.0
    known = np.clip(finite(drawn), -LARGEST, LARGEST)
    if scale == "log":
        known = known[known >= SMALLEST]
        low, high = (end if end is None or end >= SMALLEST else None for end in (low, high))
    given = [None if end is None or not math.isfinite(end) else min(max(end, -LARGEST), LARGEST) for end in (low, high)]
    is_reversed = all(end is not None for end in given) and given[0] > given[1]  # type: ignore[operator]
    if is_reversed:
        given.reverse()
    ends = [float(known.min()), float(known.max())] if known.size else _about(scale, *given)
    first, last = (own if own is not None else end for own, end in zip(given, ends, strict=True))
    first, last = _apart(scale, first, last)
    if not is_tight:
        first, last = _wider(scale, (first, last), (given[0] is None, given[1] is None), linear_to)
    return ScaleSpan(scale, last, first, linear_to) if is_reversed else ScaleSpan(scale, first, last, linear_to)


def _about(scale: Scale, low: float | None, high: float | None) -> list[float]:
    """Return ends for an axis where nothing is drawn, from the one end that is known."""
    if scale == "log":
        return [low or 0.1 * (high or 10.0), high or 10.0 * (low or 1.0)]
    return [(1.0 if high is None else high) - 1.0 if low is None else low, (low or 0.0) + 1.0 if high is None else high]


def _apart(scale: Scale, first: float, last: float) -> tuple[float, float]:
    """Return ends that are apart, so far that numbers lie between them."""
    first, last = min(first, last), max(first, last)
    least = max(LEAST_SPAN * max(abs(first), abs(last)), SMALLEST)
    if scale == "log":
        return (first, last) if last > first * (1.0 + LEAST_SPAN) else (first / 2.0, last * 2.0)
    if last - first > least:
        return first, last
    margin = 10.0 * least if scale in ("time", "angle", "date") else 0.05 * abs(first)
    margin = max(margin, 1.0 if scale in ("time", "angle", "date") else 1e-6)
    return first - margin, last + margin


def _wider(
    scale: Scale, ends: tuple[float, float], is_open: tuple[bool, bool], linear_to: float
) -> tuple[float, float]:
    """Return the ends with a margin where they are not given."""
    span = ScaleSpan(scale, *ends, linear_to)
    if scale == "log":
        factor = 10.0 ** (MARGIN * (math.log10(ends[1]) - math.log10(ends[0])))
        return ends[0] / (factor if is_open[0] else 1.0), ends[1] * (factor if is_open[1] else 1.0)
    margin = MARGIN * (span.high - span.low)
    return ends[0] - (margin if is_open[0] else 0.0), ends[1] + (margin if is_open[1] else 0.0)
