"""Plot: the heading error by aircraft."""

import numpy as np

from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import ROW_MM, left_out, name_axis, rows_shown
from groundstation.chapters.wording import plural
from groundstation.plots.marks import AnyMark, Dots, Intervals, Limit
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.plots.ranges import finite
from groundstation.results.fleet import FleetResults
from groundstation.systems.heading.fleet_chapter import assessed


def forest(fleet: FleetResults) -> Plot:
    """Return the mean error of each aircraft."""
    by_name = {row.aircraft: row for row in assessed(fleet)}
    shown = [by_name[name] for name in rows_shown({row.aircraft: row.averaged for row in by_name.values()})]
    error, owner = fleet.flights["error_deg"], fleet.flights["aircraft"]
    marks: list[AnyMark] = [Limit(value=0.0, is_upright=True, role="faint", dash="dotted", emphasis="faint")]
    for place, row in enumerate(shown):
        own = finite(error[owner == row.aircraft])
        marks.append(Dots(x=own, y=np.full(len(own), float(place)), role="unused", emphasis="bold"))
        if row.mean_deg is not None:
            marks.append(Intervals(row=place, value=row.mean_deg, thick=row.confidence95_deg, role="answer"))
    names = [f"{label(row.aircraft, 20)}  ·  {plural(row.averaged, 'flight')}" for row in shown]
    return Plot(
        "fleet.forest",
        "Mean error of each aircraft",
        "Green: mean over the flights with its 95 % interval, from the spread between flights; grey: single flights, "
        f"the rejected among them.{left_out(len(shown), len(by_name))}",
        "Forest plot of the mean heading error of each aircraft with its 95 percent interval.",
        one_panel(Panel(marks, Axis("heading error, °"), name_axis(names), legend=""), ROW_MM * (len(shown) + 1)),
    )
