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


def over_time(fleet: FleetResults, place: str) -> Drawing | None:
    """Draw what was known before each flight of an installation, and the residual of each; None with fewer than two."""
    row = next(one for one in fleet.installations if str(one.place) == place)
    own = fleet.installation_flights.where(rows_of(fleet, row.place))
    if not np.isfinite(own.sum_deg).any():
        return None
    number = np.arange(1, len(own) + 1)
    panels = (
        (own.sum_deg, own.sum_sigma_deg, "mounting with steady sideslip, °"),
        (own.factor, own.factor_sigma, "factor, ° per m/s"),
    )

    def paint(figure: Any) -> None:
        for left, right, (known, sigma, title) in zip((18, 106), (88, 176), panels, strict=True):
            axes = layout.place(figure, left, 12, right, 44)
            half = NORMAL_95 * sigma
            axes.fill_between(number, known - half, known + half, color=d.FILL, linewidth=0)
            axes.plot(number, known, color=d.USED, linewidth=1.2)
            d.dots(axes, number, known, d.USED, dot_size(len(own)))
            axes.set_xlim(0.5, len(own) + 0.5)
            axes.set_xlabel("flight of the serial")
            axes.set_ylabel(title)

    caption = f"{name_of(row)}: what the flights before each one said, with the 95 % interval; the first had nothing."
    alt = "Learned mounting and crosswind factor with their intervals, flight by flight."
    return Drawing("What was known before each flight", caption, alt, d.draw(f"fleet-installation-{place}", 50, paint))
