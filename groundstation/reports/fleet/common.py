"""What the figures of the fleet report share: colours of aircraft, lines of names, axes of dates."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.wording import number
from groundstation.reports import drawing as d
from groundstation.results.fleet import FleetResults

MOST_ROWS = 40  # aircraft in a figure with a line for each: more and the page is full
ONE_COLOUR = d.INS
ROW_MM = 4.8


def colours_of(fleet: FleetResults) -> dict[str, str]:
    """A colour for each aircraft; one for all where there are more aircraft than colours."""
    names = [name for name in fleet.aircraft if name]
    own = d.SERIES if len(names) <= len(d.SERIES) else (ONE_COLOUR,) * len(names)
    return dict(zip(names, own, strict=False)) | {"": d.FAINT}


def rows_shown(counts: Mapping[str, int], most: int = MOST_ROWS) -> list[str]:
    """Names for a figure in their order: all of them, or those with the most flights."""
    kept = set(sorted(counts, key=lambda name: (-counts[name], name))[:most])
    return [name for name in sorted(counts) if name in kept]


def left_out(shown: int, total: int, noun: str = "aircraft") -> str:
    """The sentence of a caption about what a figure leaves out; empty where it leaves out nothing."""
    return "" if shown >= total else f" The {shown} of {number(total, 0)} {noun} with the most flights."


def dot_size(count: int) -> float:
    """Size of the dots of a line of flights, in points: smaller where they are many."""
    return 3.4 if count <= 60 else 2.2


def name_axis(axes: Any, names: list[str]) -> None:
    """Give every aircraft a line of its own, the first on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0)


def date_axis(axes: Any, time: NDArray[np.datetime64]) -> None:
    """Scale the horizontal axis as dates around some times, NaT left out."""
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    known = time[~np.isnat(time)]
    low, high = (known.min(), known.max()) if len(known) else (np.datetime64(0, "ns"), np.datetime64(0, "ns"))
    margin = max((high - low) * 0.02, np.timedelta64(12, "h"))
    axes.set_xlim(low - margin, high + margin)
    locator = AutoDateLocator(minticks=3, maxticks=8)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def date_numbers(time: NDArray[np.datetime64]) -> NDArray[np.float64]:
    """Times as the numbers of an axis of dates."""
    from matplotlib.dates import date2num

    return np.asarray(date2num(time), dtype=np.float64)
