"""Landing by locators in the study.

Errors along the approach by propagation and by drawn bearings.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.methods.bearings import (
    distance_from_bearing_m,
    distance_sigma_m,
    relative_bearings,
    side_from_difference_m,
    side_sigma_m,
    solve_bearings,
)
from groundstation.results.figures import FigureData
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95, axis_category_met
from groundstation.systems.planning.landing.study.tables import table

OUTER_M, INNER_M, SIDE_M = 4000.0, 1000.0, 500.0
BEACONS_M = np.array([(-OUTER_M, 0.0), (-INNER_M, 0.0), (0.0, SIDE_M)])
BEARING_SIGMAS_DEG = (1.0, 2.0, 3.0)
DISTANCES_M = (7000.0, 5000.0, 3000.0, 2000.0, 1500.0, 750.0, 500.0, 320.0, 200.0, 100.0, 0.0)
GLIDE_DEG, HEIGHT_SIGMA_M, CRAB_DEG = 3.0, 0.5, 5.0
CAT_II = CATEGORIES[1]
SPAN_STEP_M = 5.0


def bearing_table(runs: int, seed: int) -> FigureData:
    """Tabulate 95 % errors of side, distance and height above the glide path by distance.

    ``formula``: the source's, on the course, by propagation; ``drawn``: the same formulas fed with drawn bearings;
    ``joint``: all three bearings at once, drawn, as the analysis of a log solves them.
    """
    rows = []
    for sigma_deg in BEARING_SIGMAS_DEG:
        for before_m in DISTANCES_M:
            rng = np.random.default_rng([seed, round(10 * sigma_deg), round(before_m)])
            rows.append((sigma_deg, before_m, *_errors_95(rng, before_m, sigma_deg, runs)))
    names = (
        *("bearing_sigma_deg", "before_threshold_m", "lateral_formula_m", "lateral_drawn_m", "lateral_joint_m"),
        *("glide_path_formula_m", "glide_path_drawn_m", "glide_path_joint_m", "joint_solved"),
        *("lateral_category", "vertical_category", "category_two_laterally", "category_two_in_height"),
    )
    return table("landing_bearings", names, rows)


def _errors_95(rng: np.random.Generator, before_m: float, sigma_deg: float, runs: int) -> tuple[object, ...]:
    slope = float(np.tan(np.deg2rad(GLIDE_DEG)))
    exact = relative_bearings([-before_m], [0.0], [CRAB_DEG], BEACONS_M)
    seen = exact + sigma_deg * rng.standard_normal((runs, 3))
    height = HEIGHT_SIGMA_M * rng.standard_normal(runs)
    lateral = LINEAR_95 * float(side_sigma_m(before_m, sigma_deg, OUTER_M, INNER_M))
    glide = LINEAR_95 * float(np.hypot(HEIGHT_SIGMA_M, slope * distance_sigma_m(before_m, sigma_deg, SIDE_M)))
    course_deg = seen[:, 0] - (0.0 if before_m > OUTER_M else 180.0)  # the outer locator ahead, or behind
    distance = distance_from_bearing_m(seen[:, 2] - course_deg, SIDE_M)
    side = side_from_difference_m(seen[:, 0] - seen[:, 1], before_m, OUTER_M, INNER_M)
    joint = solve_bearings(seen, BEACONS_M, sigma_deg)
    met = axis_category_met(lateral, "horizontal"), axis_category_met(glide, "vertical")
    return (
        *(lateral, _share_95(side), _share_95(joint.right_m)),
        *(
            glide,
            _share_95(height - slope * (distance - before_m)),
            _share_95(height + slope * (joint.along_m + before_m)),
        ),
        float(np.isfinite(joint.along_m).mean()),
        *(one.name if one else "none" for one in met),
        "holds" if lateral <= CAT_II.horizontal_m else "refuted",
        "holds" if glide <= CAT_II.vertical_m else "refuted",
    )


def _share_95(error: FloatArray) -> float:
    known = np.abs(error[np.isfinite(error)])
    return float(np.quantile(known, 0.95)) if len(known) else float("nan")


def bearing_spans() -> FigureData:
    """Tabulate where each category is met by the source's formulas, m before the threshold."""
    before = np.arange(0.0, 8000.0, SPAN_STEP_M)
    slope = float(np.tan(np.deg2rad(GLIDE_DEG)))
    rows = []
    for sigma_deg in BEARING_SIGMAS_DEG:
        lateral = LINEAR_95 * side_sigma_m(before, sigma_deg, OUTER_M, INNER_M)
        glide = LINEAR_95 * np.hypot(HEIGHT_SIGMA_M, slope * distance_sigma_m(before, sigma_deg, SIDE_M))
        for category in CATEGORIES:
            for axis, met in (
                ("lateral", lateral <= category.horizontal_m),
                ("vertical", glide <= category.vertical_m),
            ):
                rows.append((sigma_deg, category.name, axis, _told(before, met)))
    return table("landing_bearing_spans", ("bearing_sigma_deg", "category", "axis", "before_threshold_m"), rows)


def _told(before_m: FloatArray, met: np.ndarray) -> str:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], met, [False]]).astype(np.int8))).reshape(-1, 2)
    return ", ".join(f"{before_m[last - 1]:.0f} to {before_m[first]:.0f}" for first, last in edges[::-1]) or "nowhere"
