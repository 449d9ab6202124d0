"""Plots of the approaches: deviations with corridors, the final, protection levels.

The final from above and from the side.
"""

import math
from collections.abc import Mapping

import numpy as np

from groundstation.base.units import DOTS_PER_FULL_SCALE
from groundstation.chapters.plots.common import M_PER_KM, has_values
from groundstation.chapters.wording import number
from groundstation.plots.axes import ZERO, broken_time_axis, time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Dots, Floats, Limit, Points, Role, Told
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import padded
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES
from groundstation.systems.landing.answer import AlongError, Approach, LandingResult
from groundstation.systems.landing.arrays import LandingPath, LandingProtection
from groundstation.systems.landing.runway_plots import runway_from_above

CATEGORY_ROLES: tuple[Role, ...] = ("series 5", "series 4", "series 7")
LEAST_REACH_M, LINEAR_M = 30.0, 20.0
TICKS_M = (10.0, 20.0, 100.0, 500.0, 2000.0)
BEHIND_KM = -0.5  # the axis goes on at least so far behind the threshold
THRESHOLD = Limit(value=0.0, is_upright=True, role="faint", dash="", emphasis="faint")


def _parts(results: FlightResults, of: str) -> tuple[Approach, LandingPath] | None:
    """Return the approach and its samples."""
    answer, data = results.answer(LandingResult), results.rows_of(LandingPath)
    one = None if answer is None else next((row for row in answer.approaches if str(row.number) == of), None)
    if one is None or data is None:
        return None
    own = data.where(data.approach == one.number)
    return (one, own) if len(own) else None


def deviations(results: FlightResults, of: str) -> Plot | None:
    """Return lateral and vertical deviation over distance.

    One dot of the guidance and the figures of the categories are drawn too.
    """
    found = _parts(results, of)
    if found is None:
        return None
    one, own = found
    height = np.where(own.distance_m > 0.0, own.height_m - own.path_height_m, np.nan)
    lateral = _deviation(own, own.lateral_guidance_m, own.across_m, own.lateral_dot_m, is_vertical=False)
    vertical = _deviation(own, own.vertical_guidance_m, height, own.vertical_dot_m, is_vertical=True)
    return Plot(
        f"landing.deviations.{of}",
        f"Approach {one.number}: deviations",
        "Line: deviation by the guidance, in metres. Dots: the same by recorded positions, and by the recorded height. "
        "Shade: one dot. Broken lines: ± 95 % figures of the categories (horizontal and vertical), CAT II and III ILS "
        f"look-alike. Linear within {LINEAR_M:g} m, logarithmic beyond. {_apart(one)}",
        "Lateral and vertical deviation of the approach against distance to the threshold.",
        (Row((lateral,), 38.0, shares_x=True), Row((vertical,), 38.0)),
        ("landing_path",),
    )


def _apart(one: Approach) -> str:
    """Return why dots and line differ: errors of the recorded positions, their steps."""
    if not one.guidance_topic:
        return ""
    of_these = one.position_topic
    across = next((row for row in one.position_errors if row.topic == of_these and row.error_m is not None), None)
    along = next((row for row in one.along_errors if row.topic == of_these and row.error_m is not None), None)
    told = []
    if across is not None and across.error_m is not None:
        side = "right" if across.error_m > 0.0 else "left"
        told.append(f"{number(abs(across.error_m), 0, 'm')} {side} of where the localizer has the aircraft")
    if along is not None and along.error_m is not None:
        side = "ahead of" if along.error_m > 0.0 else "behind"
        told.append(f"{number(abs(along.error_m), 0, 'm')} {side} where height and glide path have it")
    if not told:
        return "Dots and line differ by the errors of positions, height and guidance."
    step = one.position_step_m
    steps = f", in steps of {number(step[0], 0)} × {number(step[1], 0, 'm')}" if step else ""
    where = f"at the threshold the positions are {' and '.join(told)}{steps}"
    return f"Dots and line differ: {where}. {_of_the_height(one, along)}"


def _of_the_height(one: Approach, along: AlongError | None) -> str:
    """Return how far the positions' error along the course moves the dots of the height."""
    if along is None or along.error_m is None:
        return ""
    slope = math.tan(math.radians(one.runway.glide_angle_deg))
    here_m, per_km_m = along.error_m * slope, ((along.scale or 1.0) - 1.0) * M_PER_KM * slope
    more = f", {number(per_km_m, 0, 'm', signed=True)} more for each km before it (scale of height and distance)"
    return (
        f"That moves the dots of the height by {number(here_m, 0, 'm', signed=True)} at the threshold"
        f"{more if round(per_km_m) else ''}."
    )


def _deviation(own: LandingPath, guided: Floats, placed: Floats, dot_m: Floats, *, is_vertical: bool) -> Panel:
    distance_km, order = own.distance_m / M_PER_KM, np.argsort(own.distance_m)
    edge = dot_m[order]
    marks: list[AnyMark] = [
        Band(x=distance_km[order], low=-edge, high=edge, role="answer", name="one dot", emphasis="faint")
    ]
    for category, role in zip(CATEGORIES, CATEGORY_ROLES, strict=True):
        half = category.vertical_m if is_vertical else category.horizontal_m
        marks.append(Limit(value=-half, role=role, emphasis="thin"))
        marks.append(Limit(value=half, role=role, name=category.name, emphasis="thin"))
    marks += [ZERO, THRESHOLD]
    marks.append(Dots(x=distance_km, y=placed, role="unused", name="height" if is_vertical else "positions"))
    marks.append(Curve(x=distance_km, y=guided, role="ins", name="guidance"))
    flown = guided if np.isfinite(guided).any() else placed
    marks.append(Told(x=distance_km, y=flown, value=own.time_s, title="", is_time=True))
    reach = _reach(guided, placed, own.distance_m > 0.0)
    ticks = [tick for tick in TICKS_M if tick <= reach]
    y = Axis(
        "above the path, m" if is_vertical else "right of the course, m",
        "symlog",
        -reach,
        reach,
        linear_to=LINEAR_M,
        ticks=(*(-tick for tick in reversed(ticks)), 0.0, *ticks),
    )
    return Panel(marks, _distance(own), y, legend="" if is_vertical else "above")


def _distance(own: LandingPath) -> Axis:
    """Return the distance before the threshold, flown from left to right."""
    far, near = float(np.nanmax(own.distance_m)), float(np.nanmin(own.distance_m))
    return Axis("distance before the threshold, km", low=far / M_PER_KM, high=min(near / M_PER_KM, BEHIND_KM))


def _reach(guided: Floats, placed: Floats, before: np.ndarray) -> float:
    known = [np.abs(values[before & np.isfinite(values)]) for values in (guided, placed)]
    largest = [float(np.quantile(values, 0.97)) for values in known if values.size]
    return max([LEAST_REACH_M, *(1.15 * value for value in largest)])


def final(results: FlightResults, of: str) -> Plot | None:
    """Return the final from above, and from the side."""
    found = _parts(results, of)
    if found is None:
        return None
    one, own = found
    where = f"that of the {one.runway.placed_by}" if one.runway.is_surveyed else one.runway.place_reason
    return Plot(
        f"landing.final.{of}",
        f"Approach {one.number}: the final",
        f"Above: positions as recorded, the course line and its sector of ± {DOTS_PER_FULL_SCALE:g} dots, scales "
        f"differ. Below: height by {one.height_source or 'nothing'} at these positions, and the path; fine lines are "
        f"the check heights. Threshold: {where}.",
        "The final from above with the course sector, and from the side with the glide path.",
        (Row((_from_above(one, own),), 28.0, shares_x=True), Row((_from_the_side(one, own),), 33.0)),
        ("landing_path",),
    )


def _from_above(one: Approach, own: LandingPath) -> Panel:
    distance, across = own.distance_m / M_PER_KM, own.across_m / M_PER_KM
    edge = DOTS_PER_FULL_SCALE * own.lateral_dot_m / M_PER_KM
    marks: list[AnyMark] = [
        Band(x=distance, low=-edge, high=edge, role="answer", name="course sector", emphasis="faint")
    ]
    marks.append(Limit(value=0.0, dash="", emphasis="thin"))
    length_km = (one.runway.length_m or 0.0) / M_PER_KM
    if length_km:
        runway = np.array([0.0, -length_km])
        marks.append(Curve(x=runway, y=np.zeros(2), role="ink", name="runway", emphasis="bold"))
    marks.append(Curve(x=distance, y=across, role="ins", name="positions"))
    if one.touchdown is not None:
        place = [int(np.argmin(np.abs(own.time_s - one.touchdown.time_s)))]
        marks.append(Points(x=distance[place], y=across[place], role="gnss", name="touchdown"))
    reach = max(1.3 * float(np.nanmax(np.abs(across))), 0.3)
    return Panel(marks, _distance(own), Axis("right of it, km", low=-reach, high=reach))


def _from_the_side(one: Approach, own: LandingPath) -> Panel:
    distance = own.distance_m / M_PER_KM
    marks: list[AnyMark] = [
        Limit(value=check.height_m, role="faint", dash="dotted", emphasis="faint") for check in one.stabilised
    ]
    marks.append(Curve(x=distance, y=own.path_height_m, role="limit", name="path", emphasis="thin"))
    marks.append(Curve(x=distance, y=own.height_m, role="ins", name="flown"))
    y, nothing = Axis("height, m"), "no height above the threshold"
    if np.isfinite(own.height_m).any():
        low, high = padded(0.0, float(np.nanmax(own.height_m)))
        y, nothing = Axis("height, m", low=low, high=high), ""
    return Panel(marks, _distance(own), y, nothing=nothing)


def motion(results: FlightResults, of: str) -> Plot | None:
    """Return sink rate and bank over the time of the approach.

    Only the recording shows this plot: a page has no room.
    """
    found = _parts(results, of)
    if found is None:
        return None
    one, own = found
    listed: tuple[tuple[str, Role, Floats], ...] = (
        ("sink rate, m/s", "ins", own.sink_rate_mps),
        ("bank, °", "gnss", own.bank_deg),
    )
    marks = [Curve(x=own.time_s, y=y, role=role, name=name) for name, role, y in listed if has_values(y)]
    if not marks:
        return None
    time = broken_time_axis([(float(own.time_s[0]), float(own.time_s[-1]))])  # a frame of its own
    return Plot(
        f"landing.motion.{of}",
        f"Approach {one.number}: sink rate and bank",
        "How fast the aircraft sank, and how it banked.",
        "Sink rate and bank of the approach over flight time.",
        one_panel(Panel(marks, time, Axis("sink rate, m/s, and bank, °")), 40.0),
        ("landing_path",),
    )


def protection(results: FlightResults, of: str) -> Plot | None:
    """Return protection levels against alarm limits over time.

    The part of a Stanford plot that a log without truth has.
    """
    found, data = _parts(results, of), results.rows_of(LandingProtection)
    if found is None or data is None:
        return None
    one = found[0]
    own = data.where(data.approach == one.number)
    if not len(own):
        return None
    levels: tuple[tuple[str, Role, Floats, Floats], ...] = (
        ("horizontal", "gnss", own.horizontal_protection_m, own.horizontal_alarm_limit_m),
        ("vertical", "answer", own.vertical_protection_m, own.vertical_alarm_limit_m),
    )
    marks: list[AnyMark] = []
    for axis, role, level, limit in levels:
        marks.append(Curve(x=own.time_s, y=level, role=role, name=f"{axis} protection level"))
        if np.isfinite(limit).any():
            name = f"{axis} alarm limit"
            marks.append(Curve(x=own.time_s, y=limit, role=role, name=name, dash="dashed", emphasis="thin"))
    panel = Panel(marks, time_axis(float(own.time_s[0]), float(own.time_s[-1])), Axis("m", "log"))
    return Plot(
        f"landing.protection.{of}",
        f"Approach {one.number}: protection levels",
        "The greater of two kinds of protection level. The error itself is not known, so a Stanford plot is not "
        "possible; the figure only shows whether the receiver should have raised an alarm.",
        "Protection levels against alarm limits over flight time.",
        one_panel(panel, 44.0),
        ("landing_protection",),
    )


PLOTS: Mapping[str, Describe] = {
    "landing.deviations": deviations,
    "landing.final": final,
    "landing.motion": motion,
    "landing.runway": runway_from_above,
    "landing.protection": protection,
}
