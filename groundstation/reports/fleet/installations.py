"""Figure: mounting and crosswind factor of an installation as its flights teach them."""

from typing import Any

import numpy as np

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.fleet.installations import name_of, rows_of
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet.common import dot_size
from groundstation.results.fleet import FleetResults

PANELS = (
    ("sum_deg", "sum_sigma_deg", "mounting with steady sideslip, °"),
    ("factor", "factor_sigma", "factor, ° per m/s"),
)


def over_time(fleet: FleetResults, place: str) -> Drawing | None:
    """Draw what was known before each flight of an installation, and the residual of each; None with fewer than two."""
    row = next(one for one in fleet.installations if str(one.place) == place)
    rows, flights = rows_of(fleet, row.place), fleet.installation_flights
    known = {name: flights[name][rows] for pair in PANELS for name in pair[:2]}
    if not np.isfinite(known["sum_deg"]).any():
        return None
    number = np.arange(1, len(rows) + 1)

    def paint(figure: Any) -> None:
        for left, right, (name, sigma, title) in zip((18, 106), (88, 176), PANELS, strict=True):
            axes = layout.place(figure, left, 12, right, 44)
            half = NORMAL_95 * known[sigma]
            axes.fill_between(number, known[name] - half, known[name] + half, color=d.FILL, linewidth=0)
            axes.plot(number, known[name], color=d.USED, linewidth=1.2)
            d.dots(axes, number, known[name], d.USED, dot_size(len(rows)))
            axes.set_xlim(0.5, len(rows) + 0.5)
            axes.set_xlabel("flight of the serial")
            axes.set_ylabel(title)

    caption = f"{name_of(row)}: what the flights before each one said, with the 95 % interval; the first had nothing."
    alt = "Learned mounting and crosswind factor with their intervals, flight by flight."
    return Drawing("What was known before each flight", caption, alt, d.draw(f"fleet-installation-{place}", 50, paint))
