"""Figure: the magnetic deviation that flights found."""

from typing import Any

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.fleet.deviation import usable
from groundstation.chapters.wording import number
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet.common import colours_of
from groundstation.results.fleet import FleetResults

MOST_CURVES = 60


def curves(fleet: FleetResults) -> Drawing:
    """Draw the deviation that every flight found."""
    rows, colours = usable(fleet), colours_of(fleet)
    shown = rows[:MOST_CURVES]
    heading_deg = np.arange(0.0, 361.0, 2.0)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 136, 62)
        named: set[str] = set()
        for row in shown:
            label = None if row.aircraft in named else d.label(aircraft_name(row.aircraft), 20)
            named.add(row.aircraft)
            axes.plot(
                heading_deg,
                row.error_deg(heading_deg),
                color=colours[row.aircraft],
                linewidth=1.1,
                alpha=0.8,
                label=label,
            )
        axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(np.arange(0, 361, 45))
        axes.set_xlabel("uncorrected magnetic heading, °")
        axes.set_ylabel("error, °")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), labelspacing=0.7)

    more = f" The first {MOST_CURVES} of {number(len(rows), 0)}." if len(rows) > MOST_CURVES else ""
    caption = f"A to E of each flight, level, declination removed; rejected flights are left out.{more}"
    alt = "Error of the magnetic heading against heading, a curve for each flight, coloured by aircraft."
    return Drawing("Error of every flight", caption, alt, d.draw("fleet-deviation", 70, paint))
