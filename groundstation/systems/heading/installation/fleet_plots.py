"""Plot: mounting and crosswind factor of an installation as its flights teach them."""

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.plots.marks import Band, Curve, Dots, Floats
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.results.fleet import FleetResults
from groundstation.systems.heading.installation.fleet_chapter import name_of, rows_of


def over_time(fleet: FleetResults, place: str) -> Plot | None:
    """Return what was known of an installation before each flight; None with fewer than two."""
    row = next(one for one in fleet.installations if str(one.place) == place)
    own = fleet.installation_flights.where(rows_of(fleet, row.place))
    if not np.isfinite(own.sum_deg).any():
        return None
    panels = (
        _panel(own.sum_deg, own.sum_sigma_deg, "mounting with steady sideslip, °"),
        _panel(own.factor, own.factor_sigma, "factor, ° per m/s"),
    )
    return Plot(
        f"fleet.installation.{place}",
        "What was known before each flight",
        f"{name_of(row)}: what the flights before each one said, with the 95 % interval; the first had nothing.",
        "Learned mounting and crosswind factor with their intervals, flight by flight.",
        (Row(panels, 32.0),),
    )


def _panel(known: Floats, sigma: Floats, title: str) -> Panel:
    number, half = np.arange(1.0, len(known) + 1.0), NORMAL_95 * sigma
    marks = (
        Band(x=number, low=known - half, high=known + half, role="answer"),
        Curve(x=number, y=known, role="answer"),
        Dots(x=number, y=known, role="answer"),
    )
    return Panel(marks, Axis("flight of the serial", low=0.5, high=len(known) + 0.5), Axis(title), legend="")
