"""Plot: trend of each aircraft over time, as a control chart with its changes of level.

The page draws one over dates, the recording over the numbers of flights: there flights without a time have a place.
"""

from collections.abc import Set
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.common import title_of
from groundstation.chapters.fleet.trend import QUANTITIES, changes_of, charted, flights_of
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import Places, date_axis, log_limits, seconds_of
from groundstation.chapters.wording import plural
from groundstation.plots.marks import AnyMark, Band, Curve, Dots, Floats, Limit, Role
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.plots.ranges import finite, padded
from groundstation.results.arrays.fleet import FleetTrend
from groundstation.results.figures import numbers
from groundstation.results.fleet import FleetResults

DOTTED = "Dotted red: the limit that is stated, or from which the check warns; one far above is in the table alone. "
SHADED = "Shaded: the 95 % intervals of the flights. "
MOST_PANELS = 8
PANEL_MM = 24.0
LIMIT = "limit"
FARTHEST_LIMIT = 5.0  # times the largest value
HEADING, POSITIVE = "error_deg", "radial_error_rate_fit_nmiph"


def charts(fleet: FleetResults, quantity: str) -> Plot | None:
    """Return control charts of a quantity, one for each aircraft; None where there is none."""
    names = charted(fleet, quantity)
    if not names:
        return None
    rows = {name: flights_of(fleet, quantity, name) for name in names}
    outside = {name: int(fleet.trend.is_outside[rows[name]].sum()) for name in names}
    changed = {name: len(changes_of(fleet, quantity, name)) for name in names}
    first = sorted(names, key=lambda name: (-changed[name], -outside[name], -len(rows[name]), name))
    shown = sorted(first[:MOST_PANELS])
    dates = date_axis(fleet.trend.start_utc[fleet.trend.quantity == quantity])
    places = _dates_of(fleet)
    own_limits = fleet.trend.limit[fleet.trend.quantity == quantity]
    panels = [
        replace(
            told,
            title=f"{label(name, 24)}, {plural(len(rows[name]), 'flight')}",
            legend="above" if name == shown[0] else "",
        )
        for name in shown
        if (told := chart(fleet, quantity, name, dates, places)) is not None
    ]
    more = ""
    if len(shown) < len(names):
        more = f" {len(shown)} of {len(names)} aircraft: those with changes first, then with flights outside."
    return Plot(
        f"fleet.trend.{quantity}",
        f"Control chart of the {title_of(quantity)}",
        "Line: level, the median between changes, or the slope; dashed: control limits of single flights; red: "
        f"outside them. {DOTTED if np.isfinite(own_limits).any() else ''}"
        f"{SHADED if quantity == HEADING else ''}Numbered: the first flight of a new level.{more}",
        f"Control charts of the {title_of(quantity)} by aircraft over time.",
        tuple(Row((panel,), PANEL_MM, shares_x=panel is not panels[-1]) for panel in panels),
    )


def chart(
    fleet: FleetResults, quantity: str, name: str, x: Axis, places: Places, title: str = "flight", role: Role = "ins"
) -> Panel | None:
    """Describe the control chart of one quantity of an aircraft.

    It has the flights with their intervals, the level and the limits. None without a number.

    Parameters
    ----------
    fleet : FleetResults
    quantity, name : str
        Name is that of the aircraft.
    x : Axis
    places : callable
        Places of flights along it, by their ids.
    title : str
        Of a flight in the legend.
    role : Role
        Of a flight.
    """
    flights = fleet.flights
    rows = np.flatnonzero((flights["aircraft"] == name) & np.isfinite(numbers(flights, quantity)))
    time, rows = _in_order(places(flights["flight_id"][rows]), rows)
    value = numbers(flights, quantity)[rows]
    if not len(rows):
        return None
    own = fleet.trend.where(flights_of(fleet, quantity, name))
    is_outside = np.isin(flights["flight_id"][rows], own.flight_id[own.is_outside])
    changes = changes_of(fleet, quantity, name)
    at, changed = places(np.array([one.flight_id for _, one in changes], dtype=np.str_)), [one for _, one in changes]
    marks: list[AnyMark] = []
    for (number, _), place in zip(changes, at.tolist(), strict=True):
        shown = f" {number}"
        marks.append(Limit(value=place, is_upright=True, role="ink", dash="dotted", emphasis="thin", label=shown))
    if quantity == HEADING:
        ends = numbers(flights, "confidence95_low_deg")[rows], numbers(flights, "confidence95_high_deg")[rows]
        marks += _intervals(time, ends, np.sort(at), f"{title}, 95 %", role)
    marks += _levels(places(own.flight_id), own, {one.flight_id for one in changed})
    if len(at):
        after = np.array([one.level_after for one in changed])
        marks.append(Dots(x=at, y=after, role="ink", name="new level", emphasis="bold"))
    marks.append(Dots(x=time[~is_outside], y=value[~is_outside], role=role, name=title, emphasis="bold"))
    if is_outside.any():
        text = "outside the limits"
        marks.append(Dots(x=time[is_outside], y=value[is_outside], role="bad", name=text, emphasis="bold"))
    limits = _limits(own, value)
    marks += [Limit(value=limit, role="bad", dash="dotted", name=LIMIT if limit > 0.0 else "") for limit in limits]
    known = finite(value, own.low, own.high, limits)
    is_log = quantity == POSITIVE and bool((known > 0.0).any())
    low, high = log_limits(known[known > 0.0]) if is_log else padded(float(known.min()), float(known.max()), 0.08, 0.05)
    return Panel(marks, x, Axis(QUANTITIES[quantity], "log" if is_log else "linear", low, high))


def _limits(own: FleetTrend, value: Floats) -> Floats:
    """Return the limits that stand in a chart, to either side where values are.

    One that is far from every flight would flatten the chart, and is left to the table.
    """
    known = finite(own.limit)
    if not len(known):
        return np.zeros(0)
    limit, largest = float(known[-1]), float(np.abs(value).max(initial=0.0))
    if limit > FARTHEST_LIMIT * largest:
        return np.zeros(0)
    has_below = bool((value < 0.0).any()) and -float(value.min()) * FARTHEST_LIMIT >= limit
    return np.array([limit, -limit] if has_below else [limit])


def _in_order(places: Floats, rows: NDArray[np.intp]) -> tuple[Floats, NDArray[np.intp]]:
    """Places in their order, and the rows that have one."""
    order = np.argsort(places, kind="stable")
    order = order[np.isfinite(places[order])]
    return places[order], rows[order]


def _dates_of(fleet: FleetResults) -> Places:
    """Places of flights on an axis of dates."""
    known = dict(zip(fleet.flights["flight_id"].tolist(), seconds_of(fleet.flights["start_utc"]).tolist(), strict=True))
    return lambda ids: np.array([known[one] for one in ids.tolist()], dtype=np.float64)


def _intervals(time: Floats, ends: tuple[Floats, Floats], firsts: Floats, title: str, role: Role) -> list[AnyMark]:
    """Return bands of the intervals of flights.

    A band ends where the level changes, at the places ``firsts``.
    """
    low, high = ends
    known = np.isfinite(low) & np.isfinite(high)
    stretch = np.searchsorted(firsts, time, side="right")
    bands: list[AnyMark] = []
    for one in range(len(firsts) + 1):
        mine = known & (stretch == one)
        if mine.any():
            bands.append(Band(x=time[mine], low=low[mine], high=high[mine], role=role, name=title, emphasis="faint"))
    return bands


def _levels(time: Floats, own: FleetTrend, firsts: Set[str]) -> list[AnyMark]:
    """Level and limits of each run between changes: flat, or along a slope."""
    marks: list[AnyMark] = []
    starts = [place for place, name in enumerate(own.flight_id.tolist()) if name in firsts]
    for place, run in enumerate(np.split(np.arange(len(time)), starts) if len(time) else ()):
        is_flat = bool(np.all(own.level[run] == own.level[run[0]]))
        run = run[[0, -1]] if is_flat else run
        for limit, title in ((own.low, ""), (own.high, "" if place else "limits")):
            marks.append(Curve(x=time[run], y=limit[run], role="limit", name=title, dash="dashed", emphasis="thin"))
        marks.append(Curve(x=time[run], y=own.level[run], role="ink", name="" if place else "level"))
    return marks
