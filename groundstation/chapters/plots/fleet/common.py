"""Parts that the plots of the fleet report share: roles, rows of names, axes of dates."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.units import NS_PER_S
from groundstation.chapters.wording import number
from groundstation.plots.marks import SERIES, Floats, Role
from groundstation.plots.plot import Axis
from groundstation.results.fleet import FleetResults

Places = Callable[[NDArray[np.str_]], Floats]  # of flights by their ids along an axis, NaN where one has none

MOST_ROWS = 40  # aircraft in a plot with a row for each: more and the page is full
ROW_MM = 4.8
HALF_A_DAY_S = 43_200.0


def roles_of(fleet: FleetResults) -> dict[str, Role]:
    """Return a role for each aircraft; one for all where aircraft outnumber the roles."""
    names = [name for name in fleet.aircraft if name]
    alike: tuple[Role, ...] = ("ins",)
    own = SERIES if len(names) <= len(SERIES) else alike * len(names)
    return {**dict(zip(names, own, strict=False)), "": "faint"}


def rows_shown(counts: Mapping[str, int], most: int = MOST_ROWS) -> list[str]:
    """Return names for a plot in their order: all of them, or those with the most flights."""
    kept = set(sorted(counts, key=lambda name: (-counts[name], name))[:most])
    return [name for name in sorted(counts) if name in kept]


def left_out(shown: int, total: int, noun: str = "aircraft") -> str:
    """Return the sentence of a caption on aircraft left out of a plot; empty without any."""
    return "" if shown >= total else f" The {shown} of {number(total, 0)} {noun} with the most flights."


def name_axis(names: Sequence[str]) -> Axis:
    """Return an axis with a row for each name, the first on top."""
    return Axis(low=len(names) - 0.4, high=-0.6, names=tuple((float(row), name) for row, name in enumerate(names)))


def seconds_of(time: NDArray[np.datetime64]) -> Floats:
    """Return times as seconds since 1970, NaN where there is none."""
    numbers = time.astype("datetime64[ns]").astype(np.int64) / NS_PER_S
    return np.where(np.isnat(time), np.nan, numbers)


def date_axis(time: NDArray[np.datetime64]) -> Axis:
    """Return an axis of dates around some times, NaT left out."""
    known = seconds_of(time[~np.isnat(time)])
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    margin = max(0.02 * (high - low), HALF_A_DAY_S)
    return Axis(scale="date", low=low - margin, high=high + margin)


def log_limits(values: Floats) -> tuple[float, float]:
    """Return ends of a logarithmic axis around positive values, with two round ticks or more."""
    low, high = float(np.min(values)), float(np.max(values))
    middle = float(np.sqrt(low) * np.sqrt(high))
    return min(low / 1.2, middle / 3.0), max(high * 1.2, middle * 3.0)
