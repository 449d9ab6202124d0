"""Figures of the approaches: deviations with corridors, the final from above and from the side, protection levels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.base.units import DOTS_PER_FULL_SCALE
from groundstation.plots.ranges import padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.results.arrays.landing import LandingPath, LandingProtection
from groundstation.results.flight import FlightResults
from groundstation.results.landing import Approach, LandingResult
from groundstation.results.landing_categories import CATEGORIES

M_PER_KM = 1000.0
CATEGORY_COLOURS = ("#e69f00", "#cc79a7", "#7a6a00")
LEAST_REACH_M, LINEAR_M = 30.0, 20.0
MARKS_M = (10.0, 20.0, 100.0, 500.0, 2000.0)


def _parts(results: FlightResults, of: str) -> tuple[Approach, LandingPath, NDArray[np.intp]] | None:
    """The approach, all samples, and which of them are its own."""
    answer, data = results.answer(LandingResult), results.rows_of(LandingPath)
    one = None if answer is None else next((row for row in answer.approaches if str(row.number) == of), None)
    if one is None or data is None:
        return None
    mine = np.flatnonzero(data.approach == one.number)
    return (one, data, mine) if len(mine) else None


def deviations(results: FlightResults, of: str) -> Drawing | None:
    """Lateral and vertical deviation over distance, with a dot of the guidance and the figures of the categories."""
    found = _parts(results, of)
    if found is None:
        return None
    one, data, mine = found
    own = data.where(mine)
    distance = own.distance_m
    before = distance > 0.0
    height = np.where(before, own.height_m - own.path_height_m, np.nan)
    panels = (
        ("right of the course", own.lateral_guidance_m, own.across_m, own.lateral_dot_m),
        ("above the path", own.vertical_guidance_m, height, own.vertical_dot_m),
    )

    def paint(figure: Any) -> None:
        for place, (name, guided, placed, dot_m) in enumerate(panels):
            axes = layout.place(figure, 18, 60 - 48 * place, 174, 98 - 48 * place)
            _corridors(axes, distance, dot_m, vertical=bool(place))
            d.dots(axes, distance / M_PER_KM, placed, d.UNUSED, 2.0, label="positions" if not place else "height")
            d.line(axes, distance / M_PER_KM, guided, d.INS, 1.3, label="guidance")
            axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
            axes.axvline(0.0, color=d.FAINT, linewidth=0.6)
            _scale(axes, _reach(guided, placed, before))
            axes.set_xlim(float(np.nanmax(distance)) / M_PER_KM, min(float(np.nanmin(distance)), -500.0) / M_PER_KM)
            axes.set_ylabel(f"{name}, m")
            axes.set_xlabel("distance before the threshold, km" if place else "")
            if not place:
                layout.legend_above(axes, 7)

    caption = (
        "Line: deviation by the guidance, in metres. Dots: the same by recorded positions, and by the recorded height. "
        "Shade: one dot. Broken lines: ± 95 % figures of the categories (horizontal and vertical), CAT II and III ILS "
        "look-alike. Linear within 20 m, logarithmic beyond."
    )
    alt = "Lateral and vertical deviation of the approach against distance to the threshold."
    title = f"Approach {one.number}: deviations"
    return Drawing(title, caption, alt, d.draw(f"landing-deviations-{of}", 104, paint), ("landing_path",))


def _corridors(axes: Any, distance_m: FloatArray, dot_m: FloatArray, *, vertical: bool) -> None:
    order = np.argsort(distance_m)
    x = distance_m[order] / M_PER_KM
    axes.fill_between(x, -dot_m[order], dot_m[order], color=d.FILL, alpha=0.45, linewidth=0, label="one dot")
    for category, colour in zip(CATEGORIES, CATEGORY_COLOURS, strict=True):
        half = category.vertical_m if vertical else category.horizontal_m
        for sign in (-1.0, 1.0):
            name = category.name if sign > 0.0 else "_"
            axes.axhline(sign * half, color=colour, linewidth=0.8, linestyle=(0, (4, 2)), label=name)


def _scale(axes: Any, reach_m: float) -> None:
    """Linear where the categories are, logarithmic beyond: corridors of metres and turns of kilometres are seen."""
    axes.set_yscale("symlog", linthresh=LINEAR_M, linscale=1.2)
    marks = [mark for mark in MARKS_M if mark <= reach_m]
    axes.set_yticks([*(-mark for mark in reversed(marks)), 0.0, *marks])
    axes.yaxis.set_major_formatter(lambda value, _place: f"{value:g}".replace("-", "\u2212"))
    axes.minorticks_off()
    axes.set_ylim(-reach_m, reach_m)


def _reach(guided: FloatArray, placed: FloatArray, before: BoolArray) -> float:
    known = [np.abs(values[before & np.isfinite(values)]) for values in (guided, placed)]
    largest = [float(np.quantile(values, 0.97)) for values in known if values.size]
    return max([LEAST_REACH_M, *(1.15 * value for value in largest)])


def final(results: FlightResults, of: str) -> Drawing | None:
    """The final from above, and from the side."""
    found = _parts(results, of)
    if found is None:
        return None
    one, data, mine = found
    distance, across = (values[mine] / M_PER_KM for values in (data.distance_m, data.across_m))
    height, path = data.height_m[mine], data.path_height_m[mine]

    def paint(figure: Any) -> None:
        above = layout.place(figure, 18, 54, 174, 82)
        _from_above(above, one, data.time_s[mine], distance, across, data.lateral_dot_m[mine])
        side = layout.place(figure, 18, 12, 174, 45)
        d.line(side, distance, path, d.LIMIT, 0.9, label="path")
        d.line(side, distance, height, d.INS, 1.2, label="flown")
        for gate in one.stabilised:
            side.axhline(gate.height_m, color=d.FAINT, linewidth=0.6, linestyle=(0, (2, 2)))
        if np.isfinite(height).any():
            side.set_ylim(*padded(0.0, float(np.nanmax(height))))
        else:
            layout.nothing(side, "no height above the threshold")
        for axes in (above, side):
            axes.set_xlim(float(np.nanmax(distance)), min(float(np.nanmin(distance)), -0.5))
        side.set_xlabel("distance before the threshold, km")
        side.set_ylabel("height, m")
        layout.legend_above(side, 3)

    where = "threshold of the site file" if one.runway.placed_by == "site file" else one.runway.place_reason
    caption = (
        f"Above: positions against the course line and its sector of ± 2 dots, scales differ. Below: height by "
        f"{one.height_source or 'nothing'} and the path; fine lines are the gate heights. Threshold: {where}."
    )
    alt = "The final from above with the course sector, and from the side with the glide path."
    svg = d.draw(f"landing-final-{of}", 88, paint)
    return Drawing(f"Approach {one.number}: the final", caption, alt, svg, ("landing_path",))


def _from_above(
    axes: Any, one: Approach, time_s: FloatArray, distance_km: FloatArray, across_km: FloatArray, dot_m: FloatArray
) -> None:
    edge = DOTS_PER_FULL_SCALE * dot_m / M_PER_KM
    axes.fill_between(distance_km, -edge, edge, color=d.FILL, alpha=0.5, linewidth=0, label="course sector")
    length_km = (one.runway.length_m or 0.0) / M_PER_KM
    if length_km:
        d.line(axes, np.array([0.0, -length_km]), np.zeros(2), d.INK, 3.0, label="runway")
    axes.axhline(0.0, color=d.LIMIT, linewidth=0.8)
    d.line(axes, distance_km, across_km, d.INS, 1.1, label="positions")
    if one.touchdown is not None:
        place = int(np.argmin(np.abs(time_s - one.touchdown.time_s)))
        axes.plot([distance_km[place]], [across_km[place]], "o", color=d.GNSS, markersize=4.0, label="touchdown")
    reach = max(1.3 * float(np.nanmax(np.abs(across_km))), 0.3)
    axes.set_ylim(-reach, reach)
    axes.set_ylabel("right of the course, km")
    layout.legend_above(axes, 5)


def protection(results: FlightResults, of: str) -> Drawing | None:
    """Protection levels against alarm limits over time: the part of a Stanford plot that a log without truth has."""
    found, data = _parts(results, of), results.rows_of(LandingProtection)
    if found is None or data is None:
        return None
    one = found[0]
    own = data.where(data.approach == one.number)
    time_s = own.time_s
    if not time_s.size:
        return None

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 56)
        for axis, colour, level, limit in (
            ("horizontal", d.GNSS, own.horizontal_protection_m, own.horizontal_alarm_limit_m),
            ("vertical", d.USED, own.vertical_protection_m, own.vertical_alarm_limit_m),
        ):
            d.line(axes, time_s, level, colour, 1.3, label=f"{axis} protection level")
            if np.isfinite(limit).any():
                d.line(axes, time_s, limit, colour, 0.9, linestyle=(0, (4, 2)), label=f"{axis} alarm limit")
        axes.set_yscale("log")
        plain_log(axes.yaxis)
        axes.set_ylabel("m")
        layout.time_axis(axes, float(time_s[0]), float(time_s[-1]))
        layout.legend_above(axes, 4)

    caption = (
        "The greater of two kinds of protection level. The error itself is not known, so a Stanford plot is not "
        "possible; the figure only shows whether the receiver should have raised an alarm."
    )
    alt = "Protection levels against alarm limits over flight time."
    svg = d.draw(f"landing-protection-{of}", 62, paint)
    return Drawing(f"Approach {one.number}: protection levels", caption, alt, svg, ("landing_protection",))
