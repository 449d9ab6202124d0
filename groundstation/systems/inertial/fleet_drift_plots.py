"""Plot: the drift of the INS by aircraft."""

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import ROW_MM, left_out, log_limits, name_axis, rows_shown
from groundstation.chapters.wording import plural
from groundstation.plots.marks import AnyMark, Dots, Intervals
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.plots.ranges import finite
from groundstation.results.fleet import FleetResults
from groundstation.systems.inertial.fleet_drift_chapter import RATE, unaided_figures


def rates(fleet: FleetResults) -> Plot:
    """Return the error rate of the unaided INS of every flight."""
    found = unaided_figures(fleet, RATE)
    shown = rows_shown({name: len(values) for name, values in found.items()})
    marks: list[AnyMark] = []
    for place, name in enumerate(shown):
        own = np.sort(np.asarray(found[name], dtype=np.float64))
        marks.append(Dots(x=own, y=np.full(len(own), float(place)), role="ins", emphasis="bold"))
        marks.append(Intervals(row=place, value=float(np.median(own)), symbol="diamond", role="ink"))
    low, high = log_limits(finite(*(found[name] for name in shown)))
    names = [f"{label(aircraft_name(name), 20)}  ·  {plural(len(found[name]), 'flight')}" for name in shown]
    x = Axis("radial error rate, nmi/h", "log", low, high)
    return Plot(
        "fleet.rates",
        "Error rate of every flight",
        f"A dot for each flight; black: median of the aircraft.{left_out(len(shown), len(found))}",
        "INS error rate of every flight by aircraft with the median of each.",
        one_panel(Panel(marks, x, name_axis(names), legend=""), ROW_MM * (len(shown) + 1)),
    )
