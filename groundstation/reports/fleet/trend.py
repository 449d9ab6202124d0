"""Chapter: trend of each aircraft over time, as a control chart with its changes of level."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.parts import Cell, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import number, significant
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.aircraft import log_limits
from groundstation.reports.fleet.common import (
    aircraft_name,
    date_axis,
    date_numbers,
    day,
    dot_size,
    figure_of,
    plural,
    title_of,
)
from groundstation.results.fleet import ChangePoint, FleetResults

MOST_PANELS = 8
MOST_DOTS = 600  # in a panel
PANEL_MM = 33.0
QUANTITIES = {"error_deg": "error, °", "radial_error_rate_50_nmiph": "nmi/h"}
POSITIVE = "radial_error_rate_50_nmiph"
LEAD = "Has an aircraft changed? Every flight in order of time against the level of its aircraft."


def build(fleet: FleetResults) -> Section:
    """Build the chapter."""
    fewest = fleet.stated.get("fewest_flights_for_a_trend")
    if not len(fleet.trend):
        needed = f"{number(fewest, 0)} flights" if fewest is not None else "more flights"
        text = f"No aircraft has the {needed} with a time that a trend needs."
        return Section("trend", "Trend over time", LEAD, (Note(text, "unknown"),))
    parts: list[Part | None] = [_changes(fleet)]
    for quantity in QUANTITIES:
        parts += [_charts(fleet, quantity), _levels(fleet, quantity)]
    return Section("trend", "Trend over time", LEAD, tuple(part for part in parts if part is not None))


def _changes(fleet: FleetResults) -> Part:
    if not fleet.change_points:
        return Note("No change of level was found.", "good")
    heads = (
        *(Head("No."), Head("Aircraft"), Head("Quantity"), Head("From flight"), Head("Of")),
        *(Head("Level before", True), Head("after", True), Head("Flights before", True), Head("after", True)),
        Head("p", True),
    )
    rows = [
        (
            *(str(place), aircraft_name(change.aircraft), title_of(change.quantity), change.flight_id),
            day(np.datetime64(change.start_utc_ns, "ns")),
            *(figure_of(change.quantity, level) for level in (change.level_before, change.level_after)),
            *(number(count, 0) for count in (change.flights_before, change.flights_after)),
            significant(change.p_value, 2),
        )
        for place, change in enumerate(fleet.change_points, 1)
    ]
    caption = (
        "Levels are medians; p: the chance of so large a step anywhere in a steady series. Numbers as in the charts."
    )
    return Grid("Changes of level", heads, rows, caption)


def _own(fleet: FleetResults, quantity: str, name: str) -> NDArray[np.intp]:
    return np.flatnonzero((fleet.trend["quantity"] == quantity) & (fleet.trend["aircraft"] == name))


def _charted(fleet: FleetResults, quantity: str) -> list[str]:
    return sorted(set(fleet.trend["aircraft"][fleet.trend["quantity"] == quantity].tolist()))


def _changes_of(fleet: FleetResults, quantity: str, name: str) -> list[tuple[int, ChangePoint]]:
    numbered = enumerate(fleet.change_points, 1)
    return [(place, one) for place, one in numbered if (one.aircraft, one.quantity) == (name, quantity)]


def _charts(fleet: FleetResults, quantity: str) -> Drawing | None:
    names = _charted(fleet, quantity)
    if not names:
        return None
    rows = {name: _own(fleet, quantity, name) for name in names}
    outside = {name: int(fleet.trend["is_outside"][rows[name]].sum()) for name in names}
    changed = {name: len(_changes_of(fleet, quantity, name)) for name in names}
    first = sorted(names, key=lambda name: (-changed[name], -outside[name], -len(rows[name]), name))
    shown = sorted(first[:MOST_PANELS])
    times = fleet.trend["start_utc"][fleet.trend["quantity"] == quantity]
    height = 14.0 + PANEL_MM * len(shown)

    def paint(figure: Any) -> None:
        for place, name in enumerate(shown):
            bottom = height - 4.0 - PANEL_MM * (place + 1) + 2.0
            axes = layout.place(figure, 18, bottom, 174, bottom + PANEL_MM - 9.0)
            _paint_chart(axes, fleet, quantity, name, rows[name])
            date_axis(axes, times)
            axes.set_title(f"{d.label(name, 24)}, {plural(len(rows[name]), 'flight')}")
            axes.set_ylabel(QUANTITIES[quantity])
            if place < len(shown) - 1:
                axes.tick_params(labelbottom=False)
                axes.xaxis.get_offset_text().set_visible(False)
            if place == 0:
                layout.legend_above(axes)

    more = ""
    if len(shown) < len(names):
        more = f" {len(shown)} of {len(names)} aircraft: those with changes first, then with flights outside."
    caption = (
        "Line: level, the median between changes; dashed: control limits of single flights; orange: outside them. "
        f"Numbered: the first flight of a new level.{more}"
    )
    alt = f"Control charts of the {title_of(quantity)} by aircraft over time."
    title = f"Control chart of the {title_of(quantity)}"
    return Drawing(title, caption, alt, d.draw(f"fleet-trend-{quantity.replace('_', '-')}", height, paint))


def _paint_chart(axes: Any, fleet: FleetResults, quantity: str, name: str, rows: NDArray[np.intp]) -> None:
    columns = ("value", "level", "low", "high")
    value, level, low, high = (fleet.trend[key][rows] for key in columns)
    time, is_outside = date_numbers(fleet.trend["start_utc"][rows]), fleet.trend["is_outside"][rows]
    d.dots(axes, time[~is_outside], value[~is_outside], d.INS, dot_size(len(rows)), MOST_DOTS, label="flight")
    if is_outside.any():
        d.dots(axes, time[is_outside], value[is_outside], d.GNSS, 4.0, MOST_DOTS, label="outside the limits", zorder=4)
    for place, run in enumerate(_runs(level, low, high)):
        span = [time[run[0]], time[run[-1]]]
        axes.plot(span, [level[run[0]]] * 2, color=d.INK, linewidth=1.2, label=None if place else "level", zorder=3)
        for limit, text in ((low, None), (high, None if place else "limits")):
            style = {"color": d.LIMIT, "linewidth": 0.9, "linestyle": (0, (4, 2))}
            axes.plot(span, [limit[run[0]]] * 2, label=text, zorder=2, **style)
    for number_, change in _changes_of(fleet, quantity, name):
        start = float(date_numbers(np.array([change.start_utc_ns], dtype="datetime64[ns]"))[0])
        axes.axvline(start, color=d.INK, linewidth=0.8, linestyle=":")
        layout.beside(axes, start, 0.86, f" {number_}", d.INK, axes.get_xaxis_transform(), "left")
    drawn = d.finite(value, low, high)
    if quantity == POSITIVE:
        axes.set_yscale("log")
        plain_log(axes.yaxis)
        axes.set_ylim(*log_limits(drawn[drawn > 0.0]))
    else:
        axes.set_ylim(*layout.padded(float(drawn.min()), float(drawn.max()), 0.08, 0.05))


def _runs(*columns: NDArray[np.float64]) -> Sequence[NDArray[np.intp]]:
    """Stretches in which no column changes (NaN equals NaN)."""
    same = [(column[1:] == column[:-1]) | (np.isnan(column[1:]) & np.isnan(column[:-1])) for column in columns]
    return np.split(np.arange(len(columns[0])), np.flatnonzero(~np.logical_and.reduce(same)) + 1)


def _levels(fleet: FleetResults, quantity: str) -> Grid | None:
    heads = (
        *(Head("Aircraft"), Head("Flights", True), Head("From"), Head("To"), Head("Level now", True)),
        *(Head("Low limit", True), Head("High limit", True), Head("Outside", True), Head("Changes", True)),
    )
    rows: list[tuple[Cell, ...]] = []
    for name in _charted(fleet, quantity):
        own = _own(fleet, quantity, name)
        now = {key: float(fleet.trend[key][own[-1]]) for key in ("level", "low", "high")}
        rows.append(
            (
                *(aircraft_name(name), number(len(own), 0)),
                *(day(fleet.trend["start_utc"][row]) for row in (own[0], own[-1])),
                *(figure_of(quantity, value) for value in now.values()),
                number(int(fleet.trend["is_outside"][own].sum()), 0),
                number(len(_changes_of(fleet, quantity, name)), 0),
            )
        )
    return Grid(f"Levels of the {title_of(quantity)}", heads, rows) if rows else None
