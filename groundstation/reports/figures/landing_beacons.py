"""Figure of landing by locators: deviations along the approach with their bands, and the limits of the categories."""

from typing import Any

import numpy as np

from groundstation.reports import drawing as d
from groundstation.reports.drawing import Drawing
from groundstation.results.figures import numbers
from groundstation.results.flight import FlightResults
from groundstation.results.landing_beacons import BeaconLanding
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95

FARTHEST_M, LATERAL_M, VERTICAL_M = 5000.0, 150.0, 40.0
M_PER_KM = 1000.0


def deviations(results: FlightResults) -> Drawing | None:
    """Right of the course and above the glide path by distance, every approach."""
    answer, data = results.answer(BeaconLanding), results.figure_with_rows("landing_beacons_path")
    if answer is None or data is None:
        return None
    number, before = numbers(data, "approach"), numbers(data, "before_threshold_m")

    def paint(figure: Any) -> None:
        for top, column, most, limits, title in (
            (118, "lateral", LATERAL_M, [one.horizontal_m for one in CATEGORIES], "right of course, m"),
            (60, "glide_path", VERTICAL_M, [one.vertical_m for one in CATEGORIES], "above glide path, m"),
        ):
            axes = d.place(figure, 18, top - 46, 174, top)
            for one, colour in zip(answer.approaches, d.SERIES, strict=False):
                rows = np.flatnonzero((number == one.approach) & (before < FARTHEST_M))
                x, y = before[rows] / M_PER_KM, numbers(data, f"{column}_m")[rows]
                half = LINEAR_95 * numbers(data, f"{column}_sigma_m")[rows]
                d.dots(axes, x, y, colour, 2.6, label=f"approach {one.approach}")
                d.line(axes, x, half, d.FAINT, 0.9, label="95 % of one place" if one.approach == 1 else None)
                d.line(axes, x, -half, d.FAINT, 0.9)
            for limit, category in zip(dict.fromkeys(limits), ("CAT I", "CAT II", "CAT III"), strict=False):
                d.limit_line(axes, limit, category if limit == limits[0] else "")
                d.limit_line(axes, -limit, "")
            for beacon in answer.beacons:
                if abs(beacon.right_m) < LATERAL_M:
                    axes.axvline(beacon.before_threshold_m / M_PER_KM, color=d.INK, linewidth=0.7, linestyle=":")
            axes.set_ylim(-most, most)
            axes.set_xlim(FARTHEST_M / M_PER_KM, float(np.nanmin(before[before < FARTHEST_M])) / M_PER_KM)
            axes.set_ylabel(title)
            if column == "glide_path":
                axes.set_xlabel("before the threshold, km")
            else:
                d.legend_above(axes, 4)

    caption = (
        "Every place found by three bearings (dots) and the 95 % band of a single one about zero. Dashed: limits of "
        "the categories, the outermost named; dotted: locators. What lies beyond the axes is cut."
    )
    alt = "Deviation from course and from glide path against distance, with bands and category limits."
    return Drawing("Deviations", caption, alt, d.draw("landing-beacons", 126, paint), ("landing_beacons_path",))
