"""Figure: whether stated sigmas are honest, by independent checks over all flights."""

from typing import Any

import numpy as np

from groundstation.chapters.fleet.common import plural
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet.common import name_axis
from groundstation.results.fleet import FleetCalibration, FleetResults

PANELS, PANELS_MM = 3, 50.0  # histograms side by side, and the height of a row of them
SHORT = {
    "reference": "Parking reference",
    "runway": "Runway",
    "onboard": "Found on board",
    "truth_heading": "Heading, by a reference",
    "truth_gnss": "GNSS position",
    "truth_ins": "INS position",
    "truth_corrected": "INS, filtered",
    "truth_smoothed": "INS, smoothed",
}


def checks(fleet: FleetResults) -> Drawing:
    """Draw the share of the checks inside, and where they fell."""
    rows = fleet.calibration
    below = PANELS_MM * (-(-len(rows) // PANELS))  # of the histograms
    height = 14.0 + below + 8.0 * len(rows)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 62, 12.0 + below, 174, height - 2.0)
        for place, row in enumerate(rows):
            bar = 100.0 * np.array([row.confidence95])
            d.bars(axes, bar[:, 0], bar[:, 1], place, d.USED, 2.4)
            axes.plot([100.0 * row.share_inside], [place], "o", color=d.USED, markersize=4.5)
        axes.axvline(100.0 * rows[0].stated, color=d.LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
        name_axis(axes, [f"{_short(row)}  ·  {plural(row.checks, 'check')}" for row in rows])
        low = min(row.confidence95[0] for row in rows)
        axes.set_xlim(max(100.0 * low - 5.0, -2.0), 102.0)
        axes.set_xlabel("inside the stated 95 % interval, %")
        for place, row in enumerate(rows):
            left, line = 16.0 + 56.0 * (place % PANELS), place // PANELS
            bottom = 12.0 + below - PANELS_MM * (line + 1)
            panel = layout.place(figure, left, bottom, left + 46.0, bottom + 30.0)
            panel.stairs(
                row.pit, np.linspace(0.0, 1.0, len(row.pit) + 1), fill=True, facecolor=d.FILL, edgecolor=d.USED
            )
            panel.axhline(row.checks / len(row.pit), color=d.INK, linewidth=0.8, linestyle=":")
            panel.set_title(_short(row))
            panel.set_xlim(0.0, 1.0)
            panel.set_xlabel("probability integral transform")
            if place % PANELS == 0:
                panel.set_ylabel("checks")

    caption = (
        "Above: share of the checks inside with its exact 95 % interval; with honest sigmas it contains the dashed "
        "line. Below: where the checks fell in the distribution claimed for them; flat (dotted) is honest, high at "
        "both ends too sure, high in the middle too careful, high at one end biased."
    )
    alt = "Share of checks inside the stated interval, and histograms of their probability integral transform."
    return Drawing("Checks inside the stated interval", caption, alt, d.draw("fleet-calibration", height, paint))


def _short(row: FleetCalibration) -> str:
    return SHORT.get(row.quantity) or d.label(row.quantity, 20)
