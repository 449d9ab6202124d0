"""What the chapters of the fleet report share: words for quantities and aircraft, their colours, axes of dates."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.verdict import VERDICTS
from groundstation.chapters.wording import ABSENT, clean, is_number, named_quantity, number
from groundstation.reports import drawing as d
from groundstation.results.fleet import FleetResults

NOT_NAMED = "not named"
MOST_ROWS = 40  # aircraft in a figure with a line for each: more and the page is full
ONE_COLOUR = d.INS
BEYOND_REASON = 1e6
ROW_MM = 4.8
QUANTITIES: Mapping[str, tuple[str, str, int]] = {  # title, unit, decimals
    "error_deg": ("heading error", "°", 3),
    "standard_error_deg": ("standard error of the heading error", "°", 3),
    "estimate_sd_deg": ("spread of the differences", "°", 3),
    "onboard_difference_deg": ("heading error found on board − ours", "°", 3),
    "reference_residual_arcmin": ("parking heading − reference", "′", 1),
    "radial_error_rate_50_nmiph": ("INS error rate", "nmi/h", 2),
    "forecast_60min_rms_m": ("forecast error after 60 min", "m", 0),
}


def title_of(quantity: str) -> str:
    """A quantity in words."""
    return QUANTITIES[quantity][0] if quantity in QUANTITIES else named_quantity(quantity)[0]


def figure_of(quantity: str, value: float | None) -> str:
    """A value of a quantity with its unit; angles carry their sign."""
    _, unit, places = QUANTITIES.get(quantity, (*named_quantity(quantity), 3))
    return bounded(value, places, unit, signed=unit in "°′")


def bounded(value: float | None, places: int, unit: str = "", *, signed: bool = False) -> str:
    """A number as it is written, or that it is beyond all reason: digits without end would burst a column.

    Examples
    --------
    >>> bounded(0.456, 2, "m"), bounded(-1e15, 2, "°"), bounded(None, 2)
    ('0.46\u202fm', '< −1\u202f000\u202f000°', '—')
    """
    if not is_number(value) or abs(value) <= BEYOND_REASON:
        return number(value, places, unit, signed=signed)
    return f"{'<' if value < 0 else '>'} {number(math.copysign(BEYOND_REASON, value), 0, unit)}"


def span_of(bounds: tuple[float, float] | None, places: int, unit: str) -> str:
    """An interval, each end written as :func:`bounded` does."""
    return ABSENT if bounds is None else " … ".join(bounded(end, places, unit, signed=True) for end in bounds)


def aircraft_name(name: str, most: int = 40) -> str:
    """The name of an aircraft, shortened where it is very long, or that the log has none."""
    name = clean(name) or NOT_NAMED
    return name if len(name) <= most else name[: most - 1] + "…"


def verdict_words(verdict: str) -> str:
    """A verdict as a word for counts."""
    return VERDICTS[verdict].text.lower() if verdict in VERDICTS else "not assessable"


def day(time: np.datetime64) -> str:
    """The day of a time: 2026-05-04; an em dash where it is missing."""
    return ABSENT if np.isnat(time) else str(time.astype("datetime64[D]"))


def minute(time: np.datetime64) -> str:
    """A time to the minute: 2026-05-04 06:00; an em dash where it is missing."""
    return ABSENT if np.isnat(time) else str(time.astype("datetime64[m]")).replace("T", " ")


def plural(count: int, one: str, many: str = "") -> str:
    """A count with its noun.

    Examples
    --------
    >>> plural(1, "flight"), plural(3, "log"), plural(2, "is", "are")
    ('1 flight', '3 logs', '2 are')
    """
    return f"{number(count, 0)} {one if count == 1 else many or one + 's'}"


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
