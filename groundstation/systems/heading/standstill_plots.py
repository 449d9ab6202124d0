"""Plots of the standstill stage: velocity errors, density of the mean speed."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.wording import is_number, number
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Dots, Floats, Limit, Outlines, Points, Spans, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, finite, padded
from groundstation.results.flight import FlightResults
from groundstation.systems.heading.answer import MEAN_SPEED_LIMIT, RAW_SPEED_LIMIT, HeadingResult, Standstill
from groundstation.systems.heading.arrays import StandstillMeanSpeed, StandstillVelocity

ROUND = np.linspace(0.0, 2.0 * np.pi, 73)


def _assessed(results: FlightResults) -> Standstill | None:
    answer = results.answer(HeadingResult)
    return None if answer is None else answer.standstill


def _limit_mps(results: FlightResults, limit: tuple[str, float]) -> float:
    """Return a limit of speed that the answer rests on, the shipped one without an answer."""
    answer = results.answer(HeadingResult)
    return limit[1] if answer is None else answer.setting(*limit)


def components(results: FlightResults) -> Plot | None:
    """Return velocity components at standstill over time and against each other.

    Figure 2a of the paper.
    """
    data = results.rows_of(StandstillVelocity)
    if data is None:
        return None
    time, inside = data.time_s, data.is_in_interval
    limit_mps = _limit_mps(results, RAW_SPEED_LIMIT)
    north, east = data.velocity_north_mps, data.velocity_east_mps
    count = int(np.count_nonzero(inside & np.isfinite(north) & np.isfinite(east)))
    known = np.abs(finite(north[inside], east[inside]) if inside.any() else finite(north, east))
    reach = 1.1 * max(float(known.max()) if known.size else 0.0, limit_mps)
    window = finite(time[inside]) if inside.any() else finite(time)
    low, high = (float(window.min()), float(window.max())) if window.size else (0.0, 1.0)
    moments, *lines = broken_at_gaps(time, north, east)
    marks: list[AnyMark] = []
    if inside.any() and window.size:
        start, end = np.array([low]), np.array([high])
        marks.append(Spans(start=start, end=end, kind=np.array([""]), role="faint", name="interval", emphasis="faint"))
    marks.append(Curve(x=moments, y=lines[0], role="ins", name="north", emphasis="thin"))
    marks.append(Curve(x=moments, y=lines[1], role="gnss", name="east", emphasis="thin"))
    velocity = Axis("GNSS velocity, m/s", low=-reach, high=reach)
    over_time = Panel(marks, time_axis(*padded(low, high, 0.15, 2.0)), velocity, share=1.6)
    plane = _plane(north[inside], east[inside], reach, limit_mps, _assessed(results))
    origin = " (2 σ stated for GLONASS and GPS)" if limit_mps == RAW_SPEED_LIMIT[1] else ""
    caption = (
        f"The aircraft stands still: the GNSS velocity is its error. n = {number(count, 0)}. Right: in the plane; "
        f"circle: {limit_mps:g} m/s{origin}; cross: mean."
    )
    return Plot(
        "standstill.components",
        "GNSS velocity errors at standstill",
        caption,
        "North and east velocity at standstill over time, and scattered in the plane around zero.",
        (Row((over_time, plane), 53.0),),
        ("standstill_velocity",),
    )


def _plane(north: Floats, east: Floats, reach: float, limit_mps: float, still: Standstill | None) -> Panel:
    circle = limit_mps * np.column_stack([np.cos(ROUND), np.sin(ROUND)])
    marks: list[AnyMark] = [
        Outlines(rings=(circle,), role="limit", dash="dashed"),
        Dots(x=east, y=north, role="answer"),
    ]
    if still is not None and is_number(still.mean_east_mps) and is_number(still.mean_north_mps):
        mean = np.array([still.mean_east_mps]), np.array([still.mean_north_mps])
        marks.append(Points(x=mean[0], y=mean[1], symbol="cross", role="ink", emphasis="bold"))
    x, y = (Axis(title, low=-reach, high=reach) for title in ("east, m/s", "north, m/s"))
    return Panel(marks, x, y, legend="", is_map=True)


def mean_speed(results: FlightResults) -> Plot | None:
    """Return the density of the mean speed over 10 s and 30 s with the limit.

    Figure 2b of the paper.
    """
    data = results.rows_of(StandstillMeanSpeed)
    if data is None:
        return None
    window, speed, height = data.window_s, data.speed_of_mean_mps, data.density_per_mps
    still, limit_mps = _assessed(results), _limit_mps(results, MEAN_SPEED_LIMIT)
    measured = None if still is None else still.speed_of_mean_mps
    marks: list[AnyMark] = []
    for place, length in enumerate(sorted(set(finite(window).tolist()))):
        rows = window == length
        x, y, role = speed[rows], height[rows], series(place)
        marks.append(Band(x=x, low=np.zeros(len(x)), high=y, steps=True, role=role, emphasis="faint"))
        marks.append(Curve(x=x, y=y, steps=True, role=role, name=f"intervals of {length:g} s"))
    marks.append(Limit(value=limit_mps, is_upright=True, name=f"limit {limit_mps:g} m/s"))
    if is_number(measured):
        name = f"this interval: {number(measured, 4, 'm/s')}"
        marks.append(Limit(value=measured, is_upright=True, role="answer", dash="", name=name))
    x_axis = Axis("length of the mean velocity vector, m/s", low=0.0)
    return Plot(
        "standstill.mean_speed",
        "Density of the mean speed at standstill",
        "Mean speed over overlapping intervals. Longer averaging moves the density below the limit: if 10 s fail, "
        "measure longer instead of rejecting.",
        f"Densities of the mean speed for two interval lengths against the limit of {limit_mps:g} m/s.",
        one_panel(Panel(marks, x_axis, Axis("probability density, s/m", low=0.0)), 48.0),
        ("standstill_mean_speed",),
    )


PLOTS: Mapping[str, Describe] = {
    "standstill.components": components,
    "standstill.mean_speed": mean_speed,
}
