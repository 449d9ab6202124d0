"""Series of a figure of one unit: changes of level, the line behind them, date of a limit."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.changes import Change, ChangeSettings, find_changes
from groundstation.methods.fleet.slopes import Line, line_of

FloatArray = NDArray[np.float64]
HORIZON_DAYS = 3652.5  # a date further ahead is not stated
STEP_DAYS = 1.0
SMALLEST = 1e-12
CLIPPED = 4.0  # robust sigmas beyond which a flight is drawn in


@dataclass(frozen=True)
class SeriesSettings:
    """Settings of the search for changes in the series of a unit.

    A unit has five figures: with 0.01 each at most 5 % of steady units show a change in any. ``false_steps`` is the
    chance of steps being called in a series that has a slope; ``draws`` orders tell it.
    """

    changes: ChangeSettings = field(default_factory=lambda: ChangeSettings(false_change=0.01))
    false_steps: float = 0.01
    draws: int = 999


@dataclass(frozen=True)
class UnitSeries:
    """Changes of a series, and the line through the flights since the last of them.

    ``line`` is None where there are fewer than six. ``since`` is the place of the first of them. ``is_sloped``: the
    changes are about a line through all flights, not about levels.
    """

    changes: tuple[Change, ...]
    line: Line | None
    since: int
    is_sloped: bool = False


@dataclass(frozen=True)
class Crossing:
    """Days at which a line reaches a limit, None where it does not within ten years.

    ``earliest`` and ``latest`` are the ends of the 95 % interval.
    """

    best: float | None
    earliest: float | None
    latest: float | None


def series_of(
    day: FloatArray, value: FloatArray, *, settings: SeriesSettings | None = None, is_positive: bool = False
) -> UnitSeries:
    """Find the changes of a series and the line since the last of them.

    Parameters
    ----------
    day, value : ndarray, shape (n,)
        In order of time, finite.
    settings : SeriesSettings, optional
    is_positive : bool
        Changes and their comparison with a line are looked for in the logarithm.

    Notes
    -----
    Changes are those of :func:`groundstation.methods.fleet.changes.find_changes`, whose rate of false ones holds for
    any distribution. A slope looks to it like steps: unless a step explains the flights better than a line does, by
    more than it would by chance if the line were true (its residuals in random orders), the steps are taken back and
    looked for about the line.
    """
    settings = settings or SeriesSettings()
    limits = settings.changes
    shown = np.log(np.maximum(value, SMALLEST)) if is_positive else value
    found, is_sloped = find_changes(shown, settings=limits), False
    curve = curve_of(day, value, shown, is_positive=is_positive) if found else None
    if curve is not None and _chance_of_steps(day, shown, curve, settings) > settings.false_steps:
        found, is_sloped = find_changes(shown - curve, settings=limits), True
    since = found[-1].index if found else 0
    return UnitSeries(found, line_of(day[since:], value[since:]), since, is_sloped)


def curve_of(day: FloatArray, value: FloatArray, shown: FloatArray, *, is_positive: bool) -> FloatArray | None:
    """Return the line through a series.

    Of a positive one it is that of values or of logarithms, whichever is nearer.
    """
    line = line_of(day, shown)
    if line is None:
        return None
    curves = [line.at(day)]
    plain = line_of(day, value) if is_positive else None
    if plain is not None and np.all(plain.at(day) > 0.0):
        curves.append(np.log(plain.at(day)))
    return min(curves, key=lambda one: float(np.sum(np.abs(shown - one))))


def _chance_of_steps(day: FloatArray, shown: FloatArray, curve: FloatArray, settings: SeriesSettings) -> float:
    """Return the chance that a step explains flights about a curve so much better.

    The residuals of the curve are put in random orders; wild ones are drawn in before.
    """
    residual = shown - curve
    middle = float(np.median(residual))
    spread = float(np.median(np.abs(residual - middle))) / 0.674490
    residual = np.clip(residual, middle - CLIPPED * spread, middle + CLIPPED * spread)
    rng = np.random.default_rng([settings.changes.seed, len(shown)])
    orders = rng.permuted(np.tile(residual, (settings.draws, 1)), axis=1)
    gains = _gain_of_step(day, np.vstack([residual, orders]) + curve, curve, settings.changes.fewest_in_level)
    return float((1 + np.sum(gains[1:] >= gains[0] - 1e-12)) / (1 + settings.draws))


def _gain_of_step(day: FloatArray, rows: FloatArray, curve: FloatArray, fewest: int) -> FloatArray:
    """Return the gain of the best step over a line or the curve, a row each.

    It is the logarithm of what these leave less that of what the step leaves.
    """
    n = rows.shape[1]

    def left(about: FloatArray) -> FloatArray:
        return np.asarray(np.sum((about - about.mean(axis=1, keepdims=True)) ** 2, axis=1))

    total, time = left(rows), day - day.mean()
    sloped = total - (rows @ time) ** 2 / max(float(time @ time), SMALLEST)
    smooth = np.minimum(sloped, left(rows - curve))
    before = np.arange(fewest, n - fewest + 1)
    sums = np.cumsum(rows - rows.mean(axis=1, keepdims=True), axis=1)[:, before - 1]
    stepped = total - np.max(sums**2 * (n / (before * (n - before))), axis=1)
    return np.asarray(np.log(np.maximum(smooth, SMALLEST)) - np.log(np.maximum(stepped, SMALLEST)))


def crossing_of(day: FloatArray, value: FloatArray, limit: float) -> Crossing:
    """Return when the trend of a positive figure rises to a limit, from its last flight on.

    Nobody knows the law of ageing: a line through the values and one through their logarithms are both continued. The
    date is that of the one that is nearer to the flights, the interval holds those of both.
    """
    ahead = np.arange(0.0, HORIZON_DAYS, STEP_DAYS)
    time = day[-1] + ahead
    plain = line_of(day, value)
    logarithm = line_of(day, np.log(np.maximum(value, SMALLEST)))
    if plain is None or logarithm is None:
        return Crossing(None, None, None)
    lines = ((plain, limit), (logarithm, float(np.log(limit))))
    misses = [
        float(np.sum(np.abs(value - plain.at(day)))),
        float(np.sum(np.abs(value - np.exp(logarithm.at(day))))),
    ]
    best = [_first(time, line.at(time), level) for line, level in lines][int(np.argmin(misses))]
    earliest = [_first(time, line.bounds(time)[1], level) for line, level in lines]
    latest = [_first(time, line.bounds(time)[0], level) for line, level in lines]
    known = [one for one in earliest if one is not None]
    return Crossing(
        best,
        min(known) if known else None,
        None if None in latest else max(one for one in latest if one is not None),
    )


def line_crossing(line: Line, now: float, limit: float) -> Crossing:
    """Return when a rising line reaches a limit, from ``now`` on."""
    time = now + np.arange(0.0, HORIZON_DAYS, STEP_DAYS)
    low, high = line.bounds(time)
    return Crossing(_first(time, line.at(time), limit), _first(time, high, limit), _first(time, low, limit))


def _first(time: FloatArray, line: FloatArray, limit: float) -> float | None:
    above = np.flatnonzero(line >= limit)
    return float(time[above[0]]) if len(above) else None


def flights_missing(line: Line, limit: float, now: float, period: float) -> int | None:
    """Return how many flights more would tell that a limit is not reached within a period.

    At the present rate of flying and the present scatter; the interval of a slope shrinks with the power 1.5 of the
    flights. 0 where it is told already, None where the line itself reaches the limit.
    """
    allowed = (limit - float(line.at(np.array([now]))[0])) / period
    if allowed <= line.slope:
        return None
    half = line.slope_high - line.slope
    if half <= allowed - line.slope:
        return 0
    needed = line.flights * (half / (allowed - line.slope)) ** (2.0 / 3.0)
    return max(int(np.ceil(min(needed, 1e6))) - line.flights, 1)
