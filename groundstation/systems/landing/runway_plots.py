"""Plot of the runway from above, with the touchdown and the positions around it."""

import numpy as np

from groundstation.plots.marks import AnyMark, Dots, Limit, Outlines, Points
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.results.flight import FlightResults
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.arrays import LandingPath
from groundstation.systems.landing.criteria_chapter import value_text

BEFORE_M = 1_200.0  # the threshold, from where positions are drawn
BEYOND_M = 200.0  # the end
LEAST_HALF_M = 60.0  # of the picture across
USUAL_WIDTH_M = 45.0  # drawn where none is known


def runway_from_above(results: FlightResults, of: str) -> Plot | None:
    """Return the runway with the positions around the touchdown; None without a runway."""
    answer, data = results.answer(LandingResult), results.rows_of(LandingPath)
    one = None if answer is None else next((row for row in answer.approaches if str(row.number) == of), None)
    if one is None or data is None or not one.runway.is_surveyed or not one.runway.length_m:
        return None
    own = data.where((data.approach == one.number) & (data.distance_m < BEFORE_M))
    if not len(own):
        return None
    end_m = one.runway.length_m - (one.runway.displaced_m or 0.0)
    marks: list[AnyMark] = [
        Outlines(rings=_rings(one, end_m), role="unused", name="runway", is_filled=True),
        Limit(value=0.0, role="faint", emphasis="thin", dash="dotted"),
        Limit(value=0.0, is_upright=True, role="limit", label="threshold", emphasis="thin"),
    ]
    across = own.across_m[np.isfinite(own.across_m)]
    half_m = max(LEAST_HALF_M, 1.25 * float(np.max(np.abs(across)))) if across.size else LEAST_HALF_M
    marks.append(Dots(x=-own.distance_m, y=own.across_m, role="ins", name="positions"))
    if one.touchdown is not None:
        row = [int(np.argmin(np.abs(own.time_s - one.touchdown.time_s)))]
        marks.append(Points(x=-own.distance_m[row], y=own.across_m[row], role="gnss", name="touchdown"))
    x = Axis("beyond the threshold, m", low=-BEFORE_M, high=end_m + BEYOND_M)
    panel = Panel(marks, x, Axis("right of it, m", low=half_m, high=-half_m))
    return Plot(
        f"landing.runway.{of}",
        f"Approach {one.number}: on the runway",
        f"Runway {one.runway.name} as the {one.runway.placed_by} has it, the positions and the touchdown as recorded. "
        f"{_corrected(one)}{_sigmas(one)}Scales differ.",
        "The runway from above with the recorded positions and the touchdown.",
        one_panel(panel, 30.0),
        ("landing_path",),
    )


def _rings(one: Approach, end_m: float) -> tuple[np.ndarray, ...]:
    """Return the outlines of the runway: before the threshold, and from it to the end."""
    half_m = 0.5 * (one.runway.width_m or USUAL_WIDTH_M)
    edges = [(0.0, end_m)]
    if one.runway.displaced_m:
        edges.append((-one.runway.displaced_m, 0.0))
    return tuple(
        np.array([(low, -half_m), (high, -half_m), (high, half_m), (low, half_m), (low, -half_m)])
        for low, high in edges
    )


def _corrected(one: Approach) -> str:
    """Return where the touchdown was without the error of the positions, if it is known."""
    found = {row.name: row for row in one.criteria if row.value is not None}
    past, aside = found.get("touchdown"), found.get("centre_line")
    recorded_m = None if one.touchdown is None else one.touchdown.past_threshold_m
    if past is None or past.value is None or aside is None or recorded_m is None:
        return ""
    if round(past.value) == round(recorded_m):
        return ""
    return f"Corrected, it is {value_text(past)} beyond the threshold, {value_text(aside)} off the centre line. "


def _sigmas(one: Approach) -> str:
    if one.runway.along_sigma_m is None or one.runway.across_sigma_m is None:
        return ""
    return f"Its place: σ {one.runway.along_sigma_m:.0f} m along, {one.runway.across_sigma_m:.0f} m across. "
