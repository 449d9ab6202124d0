"""Plot: the magnetic deviation that flights found."""

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import roles_of
from groundstation.chapters.wording import number
from groundstation.plots.axes import ZERO
from groundstation.plots.marks import AnyMark, Curve
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.results.fleet import FleetResults
from groundstation.systems.magnetic.fleet_chapter import usable

MOST_CURVES = 60


def curves(fleet: FleetResults) -> Plot:
    """Return the deviation that every flight found."""
    rows, roles = usable(fleet), roles_of(fleet)
    heading_deg = np.arange(0.0, 361.0, 2.0)
    marks: list[AnyMark] = [ZERO]
    named: set[str] = set()
    for row in rows[:MOST_CURVES]:
        name = "" if row.aircraft in named else label(aircraft_name(row.aircraft), 20)
        named.add(row.aircraft)
        marks.append(Curve(x=heading_deg, y=row.error_deg(heading_deg), role=roles[row.aircraft], name=name))
    ticks = tuple(np.arange(0.0, 361.0, 45.0).tolist())
    x = Axis("uncorrected magnetic heading, °", "angle", 0.0, 360.0, ticks=ticks)
    more = f" The first {MOST_CURVES} of {number(len(rows), 0)}." if len(rows) > MOST_CURVES else ""
    return Plot(
        "fleet.deviation",
        "Error of every flight",
        f"A to E of each flight, level, declination removed; rejected flights are left out.{more}",
        "Error of the magnetic heading against heading, a curve for each flight, coloured by aircraft.",
        one_panel(Panel(marks, x, Axis("error, °"), legend="beside"), 50.0),
    )
