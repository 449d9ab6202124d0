"""Figure: trend of each aircraft over time, as a control chart with its changes of level."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.common import plural, title_of
from groundstation.chapters.fleet.trend import QUANTITIES, changes_of, charted, flights_of
from groundstation.plots.ranges import finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.aircraft import log_limits
from groundstation.reports.fleet.common import date_axis, date_numbers, dot_size
from groundstation.results.fleet import FleetResults

MOST_PANELS = 8
MOST_DOTS = 600  # in a panel
PANEL_MM = 33.0
POSITIVE = "radial_error_rate_fit_nmiph"


def charts(fleet: FleetResults, quantity: str) -> Drawing | None:
    """Draw the control charts of a quantity, one for each aircraft; None where there is none."""
    names = charted(fleet, quantity)
    if not names:
        return None
    rows = {name: flights_of(fleet, quantity, name) for name in names}
    outside = {name: int(fleet.trend.is_outside[rows[name]].sum()) for name in names}
    changed = {name: len(changes_of(fleet, quantity, name)) for name in names}
    first = sorted(names, key=lambda name: (-changed[name], -outside[name], -len(rows[name]), name))
    shown = sorted(first[:MOST_PANELS])
    times = fleet.trend.start_utc[fleet.trend.quantity == quantity]
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
    own = fleet.trend.where(rows)
    value, level, low, high = own.value, own.level, own.low, own.high
    time, is_outside = date_numbers(own.start_utc), own.is_outside
    d.dots(axes, time[~is_outside], value[~is_outside], d.INS, dot_size(len(rows)), MOST_DOTS, label="flight")
    if is_outside.any():
        d.dots(axes, time[is_outside], value[is_outside], d.GNSS, 4.0, MOST_DOTS, label="outside the limits", zorder=4)
    for place, run in enumerate(_runs(level, low, high)):
        span = [time[run[0]], time[run[-1]]]
        axes.plot(span, [level[run[0]]] * 2, color=d.INK, linewidth=1.2, label=None if place else "level", zorder=3)
        for limit, text in ((low, None), (high, None if place else "limits")):
            style = {"color": d.LIMIT, "linewidth": 0.9, "linestyle": (0, (4, 2))}
            axes.plot(span, [limit[run[0]]] * 2, label=text, zorder=2, **style)
    for number_, change in changes_of(fleet, quantity, name):
        start = float(date_numbers(np.array([change.start_utc_ns], dtype="datetime64[ns]"))[0])
        axes.axvline(start, color=d.INK, linewidth=0.8, linestyle=":")
        layout.beside(axes, start, 0.86, f" {number_}", d.INK, axes.get_xaxis_transform(), "left")
    drawn = finite(value, low, high)
    if quantity == POSITIVE:
        axes.set_yscale("log")
        plain_log(axes.yaxis)
        axes.set_ylim(*log_limits(drawn[drawn > 0.0]))
    else:
        axes.set_ylim(*padded(float(drawn.min()), float(drawn.max()), 0.08, 0.05))


def _runs(*columns: NDArray[np.float64]) -> Sequence[NDArray[np.intp]]:
    """Stretches in which no column changes (NaN equals NaN)."""
    same = [(column[1:] == column[:-1]) | (np.isnan(column[1:]) & np.isnan(column[:-1])) for column in columns]
    return np.split(np.arange(len(columns[0])), np.flatnonzero(~np.logical_and.reduce(same)) + 1)
