"""Figure of landing by locators: deviations along the approach with their bands, and the limits of the categories."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.landing import BeaconsPath
from groundstation.results.flight import FlightResults
from groundstation.results.landing_beacons import BeaconLanding
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95

FARTHEST_M, NEAREST_M, LATERAL_M, VERTICAL_M = 5000.0, -500.0, 150.0, 40.0
MEDIAN_OF = 15  # places: the band of one place jumps with it
M_PER_KM = 1000.0


def deviations(results: FlightResults) -> Drawing | None:
    """Right of the course and above the glide path by distance, every approach."""
    answer, data = results.answer(BeaconLanding), results.rows_of(BeaconsPath)
    if answer is None or data is None:
        return None
    number, before = data.approach, data.straight_before_threshold_m
    lateral, vertical = (data.lateral_m, data.lateral_sigma_m), (data.glide_path_m, data.glide_path_sigma_m)

    def paint(figure: Any) -> None:
        for top, values, sigma, most, limits, title in (
            (118, *lateral, LATERAL_M, [one.horizontal_m for one in CATEGORIES], "right of course, m"),
            (60, *vertical, VERTICAL_M, [one.vertical_m for one in CATEGORIES], "above glide path, m"),
        ):
            axes = layout.place(figure, 18, top - 46, 174, top)
            for one, colour in zip(answer.approaches, d.SERIES, strict=False):
                rows = np.flatnonzero((number == one.approach) & (before < FARTHEST_M) & (before > NEAREST_M))
                x, y = before[rows] / M_PER_KM, values[rows]
                half = _running_median(LINEAR_95 * sigma[rows])
                name = "95 % of one position" if one.approach == 1 else None
                axes.fill_between(x, -half, half, color=d.FILL, linewidth=0, label=name, zorder=0.5)
                d.dots(axes, x, y, colour, 2.6, label=f"approach {one.approach}", zorder=4)
            for limit in dict.fromkeys(limits):
                layout.limit_line(axes, limit, CATEGORIES[0].name if limit == limits[0] else "")
                axes.axhline(-limit, color=d.LIMIT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)
            for beacon in answer.beacons:
                if abs(beacon.right_m) < LATERAL_M:
                    axes.axvline(beacon.before_threshold_m / M_PER_KM, color=d.INK, linewidth=0.7, linestyle=":")
            axes.set_ylim(-most, most)
            axes.set_xlim(FARTHEST_M / M_PER_KM, NEAREST_M / M_PER_KM)
            axes.set_ylabel(title)
            if top == 60:
                axes.set_xlabel("before the threshold, km")
            else:
                layout.legend_above(axes, 4)

    caption = (
        "Every position found by three bearings (dots) and the 95 % band of a single one about zero. Dashed: limits "
        "of the categories, the outermost named; dotted: locators. Distance: of a straight flight through all "
        "positions. Points beyond the axes are cut."
    )
    alt = "Deviation from course and from glide path against distance, with bands and category limits."
    return Drawing("Deviations", caption, alt, d.draw("landing-beacons", 126, paint), ("landing_beacons_path",))


def _running_median(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median of so many neighbours, NaN left out; the ends repeat."""
    padded = np.pad(values, MEDIAN_OF // 2, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, MEDIAN_OF)
    known = np.isfinite(windows).any(axis=1)
    out = np.full(len(values), np.nan)
    out[known] = np.nanmedian(windows[known], axis=1)
    return out
