"""Series of a figure of one unit: changes of level, the line behind them, date of a limit."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.methods.fleet.changes import Change, ChangeSettings, find_changes
from groundstation.methods.fleet.slopes import Line, line_of

FloatArray = NDArray[np.float64]
HORIZON_DAYS = 3652.5  # a date further ahead is not stated
STEP_DAYS = 1.0
SMALLEST = 1e-12


@dataclass(frozen=True)
class SeriesSettings:
    """Settings of the search for changes in the series of a unit.

    A unit has five figures: with 0.01 each at most 5 % of steady units show a change in any.
    """

    changes: ChangeSettings = field(default_factory=lambda: ChangeSettings(false_change=0.01))


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
    any distribution. A slope looks to it like steps: where a line through all flights explains them no worse than the
    steps do (sum of distances, with the price of each parameter as of Schwarz, 1978, for Laplace's distribution), the
    steps are taken back and looked for about the line.
    """
    limits = (settings or SeriesSettings()).changes
    shown = np.log(np.maximum(value, SMALLEST)) if is_positive else value
    found, is_sloped = find_changes(shown, settings=limits), False
    whole = line_of(day, shown) if found else None
    if found and whole is not None and len(shown) == whole.flights:
        about = shown - whole.at(day)
        steps = shown - _levels(shown, found)
        if _price(about, 2) <= _price(steps, 2 * len(found) + 1):
            found, is_sloped = find_changes(about, settings=limits), True
    since = found[-1].index if found else 0
    return UnitSeries(found, line_of(day[since:], value[since:]), since, is_sloped)


def _levels(value: FloatArray, changes: tuple[Change, ...]) -> FloatArray:
    parts = np.split(value, [change.index for change in changes])
    return np.concatenate([np.full(len(part), np.median(part)) for part in parts])


def _price(residual: FloatArray, parameters: int) -> float:
    n = len(residual)
    return 2.0 * n * float(np.log(np.mean(np.abs(residual)) + SMALLEST)) + parameters * float(np.log(n))


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
