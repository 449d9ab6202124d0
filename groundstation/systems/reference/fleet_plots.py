"""Plot: whether stated sigmas are honest, by independent checks over all flights."""

import numpy as np

from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import name_axis
from groundstation.chapters.wording import plural
from groundstation.plots.marks import AnyMark, Histogram, Intervals, Limit
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.results.fleet import FleetCalibration, FleetResults

PANELS, PANEL_MM = 3, 30.0  # histograms side by side
SHORT = {
    "reference": "Parking reference",
    "runway": "Runway",
    "onboard": "Found on board",
    "truth_heading": "Heading, by a reference",
    "truth_gnss": "GNSS position",
    "truth_ins": "INS position",
    "truth_corrected": "INS, filtered",
    "truth_smoothed": "INS, smoothed",
    "truth_trajectory": "best trajectory",
}


def checks(fleet: FleetResults) -> Plot:
    """Return the share of the checks inside, and where they fell."""
    rows = fleet.calibration
    marks: list[AnyMark] = [Limit(value=100.0 * rows[0].stated, is_upright=True)]
    for place, row in enumerate(rows):
        low, high = (100.0 * bound for bound in row.confidence95)
        marks.append(Intervals(row=place, value=100.0 * row.share_inside, thick=(low, high), role="answer"))
    least = 100.0 * min(row.confidence95[0] for row in rows)
    x = Axis("inside the stated 95 % interval, %", low=max(least - 5.0, -2.0), high=102.0)
    names = name_axis([f"{_short(row)}  ·  {plural(row.checks, 'check')}" for row in rows])
    panels = [_transform(row, is_first=place % PANELS == 0) for place, row in enumerate(rows)]
    below = (Row(tuple(panels[at : at + PANELS]), PANEL_MM, columns=PANELS) for at in range(0, len(panels), PANELS))
    return Plot(
        "fleet.calibration",
        "Checks inside the stated interval",
        "Above: share of the checks inside with its exact 95 % interval; with honest sigmas it contains the dashed "
        "line. Below: where the checks fell in the distribution claimed for them; flat (dotted) is honest, high at "
        "both ends too sure, high in the middle too careful, high at one end biased.",
        "Share of checks inside the stated interval, and histograms of their probability integral transform.",
        (Row((Panel(marks, x, names, legend=""),), 8.0 * len(rows)), *below),
    )


def _transform(row: FleetCalibration, *, is_first: bool) -> Panel:
    heights = np.asarray(row.pit, dtype=np.float64)
    marks = (
        Histogram(edges=np.linspace(0.0, 1.0, len(heights) + 1), heights=heights, role="answer"),
        Limit(value=row.checks / len(heights), role="ink", dash="dotted", emphasis="thin"),
    )
    x = Axis("probability integral transform", low=0.0, high=1.0)
    return Panel(marks, x, Axis("checks" if is_first else ""), title=_short(row), legend="")


def _short(row: FleetCalibration) -> str:
    return SHORT.get(row.quantity) or label(row.quantity, 20)
