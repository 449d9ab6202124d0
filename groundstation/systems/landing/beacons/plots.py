"""Plot of landing by locators: deviations with bands, limits of the categories."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import M_PER_KM
from groundstation.plots.marks import AnyMark, Band, Dots, Floats, Limit, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95
from groundstation.systems.landing.arrays import BeaconsPath
from groundstation.systems.landing.beacons.answer import BeaconLanding

FARTHEST_M, NEAREST_M, LATERAL_M, VERTICAL_M = 5000.0, -500.0, 150.0, 40.0
MEDIAN_OF = 15  # places: the band of one place jumps with it
MOST_DRAWN = 7  # as many as series have colours


def deviations(results: FlightResults) -> Plot | None:
    """Return deviations right of the course and above the glide path of every approach."""
    answer, data = results.answer(BeaconLanding), results.rows_of(BeaconsPath)
    if answer is None or data is None:
        return None
    lateral = _marks(answer, data, data.lateral_m, data.lateral_sigma_m, [one.horizontal_m for one in CATEGORIES])
    vertical = _marks(answer, data, data.glide_path_m, data.glide_path_sigma_m, [one.vertical_m for one in CATEGORIES])
    x = Axis("before the threshold, km", low=FARTHEST_M / M_PER_KM, high=NEAREST_M / M_PER_KM)
    above = Panel(lateral, x, Axis("right of course, m", low=-LATERAL_M, high=LATERAL_M))
    below = Panel(vertical, x, Axis("above glide path, m", low=-VERTICAL_M, high=VERTICAL_M), legend="")
    return Plot(
        "landing_beacons.deviations",
        "Deviations",
        "Every position found by three bearings (dots) and the 95 % band of a single one about zero. Dashed: limits "
        "of the categories, the outermost named; dotted: locators. Distance: of a straight flight through all "
        "positions. Points beyond the axes are cut.",
        "Deviation from course and from glide path against distance, with bands and category limits.",
        (Row((above,), 46.0, shares_x=True), Row((below,), 46.0)),
        ("landing_beacons_path",),
    )


def _marks(
    answer: BeaconLanding, data: BeaconsPath, values: Floats, sigma: Floats, limits: list[float]
) -> list[AnyMark]:
    """Return bands of all approaches, limits and locators, then the positions."""
    before = data.straight_before_threshold_m
    marks: list[AnyMark] = []
    dots: list[AnyMark] = []
    for place, one in enumerate(answer.approaches[:MOST_DRAWN]):
        rows = np.flatnonzero((data.approach == one.approach) & (before < FARTHEST_M) & (before > NEAREST_M))
        x, half = before[rows] / M_PER_KM, _running_median(LINEAR_95 * sigma[rows])
        name = "95 % of one position" if one.approach == 1 else ""
        marks.append(Band(x=x, low=-half, high=half, role="answer", name=name))
        dots.append(Dots(x=x, y=values[rows], role=series(place), name=f"approach {one.approach}", emphasis="bold"))
    for limit in dict.fromkeys(limits):
        marks.append(Limit(value=limit, name=CATEGORIES[0].name if limit == limits[0] else ""))
        marks.append(Limit(value=-limit))
    for beacon in answer.beacons:
        if abs(beacon.right_m) < LATERAL_M:
            at = beacon.before_threshold_m / M_PER_KM
            marks.append(Limit(value=at, is_upright=True, role="ink", dash="dotted", emphasis="thin"))
    return [*marks, *dots]


def _running_median(values: Floats) -> Floats:
    """Return the median of so many neighbours, NaN left out; the ends repeat."""
    padded = np.pad(values, MEDIAN_OF // 2, mode="edge")
    neighbours = np.lib.stride_tricks.sliding_window_view(padded, MEDIAN_OF)
    known = np.isfinite(neighbours).any(axis=1)
    out = np.full(len(values), np.nan)
    out[known] = np.nanmedian(neighbours[known], axis=1)
    return out


PLOTS: Mapping[str, Describe] = {
    "landing_beacons.deviations": deviations,
}
