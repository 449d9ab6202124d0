"""Plot: trend of each aircraft over time, as a control chart with its changes of level."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.common import plural, title_of
from groundstation.chapters.fleet.trend import QUANTITIES, changes_of, charted, flights_of
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import date_axis, log_limits, seconds_of
from groundstation.plots.marks import AnyMark, Curve, Dots, Floats, Limit
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.plots.ranges import finite, padded
from groundstation.results.fleet import FleetResults

MOST_PANELS = 8
PANEL_MM = 24.0
POSITIVE = "radial_error_rate_fit_nmiph"


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
    panels = [_chart(fleet, quantity, name, rows[name], dates, legend=name == shown[0]) for name in shown]
    more = ""
    if len(shown) < len(names):
        more = f" {len(shown)} of {len(names)} aircraft: those with changes first, then with flights outside."
    return Plot(
        f"fleet.trend.{quantity}",
        f"Control chart of the {title_of(quantity)}",
        "Line: level, the median between changes; dashed: control limits of single flights; orange: outside them. "
        f"Numbered: the first flight of a new level.{more}",
        f"Control charts of the {title_of(quantity)} by aircraft over time.",
        tuple(Row((panel,), PANEL_MM, shares_x=panel is not panels[-1]) for panel in panels),
    )


def _chart(
    fleet: FleetResults, quantity: str, name: str, rows: NDArray[np.intp], dates: Axis, *, legend: bool
) -> Panel:
    own = fleet.trend.where(rows)
    time, outside = seconds_of(own.start_utc), own.is_outside
    marks: list[AnyMark] = []
    for number, change in changes_of(fleet, quantity, name):
        at = float(seconds_of(np.array([change.start_utc_ns], dtype="datetime64[ns]"))[0])
        shown = f" {number}"
        marks.append(Limit(value=at, is_upright=True, role="ink", dash="dotted", emphasis="thin", label=shown))
    for place, run in enumerate(_runs(own.level, own.low, own.high)):
        span = np.array([time[run[0]], time[run[-1]]])
        for limit, title in ((own.low, ""), (own.high, "" if place else "limits")):
            marks.append(Curve(x=span, y=np.full(2, limit[run[0]]), role="limit", name=title, dash="dashed"))
        title = "" if place else "level"
        marks.append(Curve(x=span, y=np.full(2, own.level[run[0]]), role="ink", name=title))
    marks.append(Dots(x=time[~outside], y=own.value[~outside], role="ins", name="flight", emphasis="bold"))
    if outside.any():
        title = "outside the limits"
        marks.append(Dots(x=time[outside], y=own.value[outside], role="gnss", name=title, emphasis="bold"))
    known = finite(own.value, own.low, own.high)
    is_log = quantity == POSITIVE
    ends = log_limits(known[known > 0.0]) if is_log else padded(float(known.min()), float(known.max()), 0.08, 0.05)
    y = Axis(QUANTITIES[quantity], "log" if is_log else "linear", *ends)
    title = f"{label(name, 24)}, {plural(len(rows), 'flight')}"
    return Panel(marks, dates, y, title=title, legend="above" if legend else "")


def _runs(*columns: Floats) -> Sequence[NDArray[np.intp]]:
    """Return stretches in which no column changes (NaN equals NaN)."""
    same = [(column[1:] == column[:-1]) | (np.isnan(column[1:]) & np.isnan(column[:-1])) for column in columns]
    return np.split(np.arange(len(columns[0])), np.flatnonzero(~np.logical_and.reduce(same)) + 1)
