"""Figures of the standstill stage: errors of the velocity components, density of the mean speed."""

from typing import Any

import numpy as np

from groundstation.chapters.wording import is_number, number
from groundstation.plots.ranges import broken_at_gaps, finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.heading import StandstillMeanSpeed, StandstillVelocity
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult, Standstill

RAW_LIMIT_MPS = 0.2
MEAN_LIMIT_MPS = 0.01


def _assessed(results: FlightResults) -> Standstill | None:
    answer = results.answer(HeadingResult)
    return None if answer is None else answer.standstill


def components(results: FlightResults) -> Drawing | None:
    """Velocity components at standstill over time and against each other (figure 2a of the paper)."""
    data = results.rows_of(StandstillVelocity)
    if data is None:
        return None
    time, inside = data.time_s, data.is_in_interval
    north, east = data.velocity_north_mps, data.velocity_east_mps
    still = _assessed(results)
    count = int(np.count_nonzero(inside & np.isfinite(north) & np.isfinite(east)))
    known = np.abs(finite(north[inside], east[inside]) if inside.any() else finite(north, east))
    reach = 1.1 * max(float(known.max()) if known.size else 0.0, RAW_LIMIT_MPS)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 101, 65)
        window = finite(time[inside]) if inside.any() else finite(time)
        moments, *lines = broken_at_gaps(time, north, east)
        d.line(axes, moments, lines[0], d.INS, 0.8, 3000, label="north")
        d.line(axes, moments, lines[1], d.GNSS, 0.8, 3000, label="east")
        if inside.any() and window.size:
            axes.axvspan(
                float(window.min()), float(window.max()), color="#eef3f7", linewidth=0, zorder=0, label="interval"
            )
        axes.set_ylim(-reach, reach)
        low, high = (float(window.min()), float(window.max())) if window.size else (0.0, 1.0)
        layout.time_axis(axes, *padded(low, high, 0.15, 2.0))
        axes.set_ylabel("GNSS velocity, m/s")
        layout.legend_above(axes)
        _plane(layout.place(figure, 121, 12, 174, 65), north[inside], east[inside], reach, still)

    caption = (
        f"The aircraft stands still: the GNSS velocity is its error. n = {number(count, 0)}. Right: in the plane; "
        f"circle: {RAW_LIMIT_MPS} m/s (2 σ stated for GLONASS and GPS); cross: mean."
    )
    alt = "North and east velocity at standstill over time, and scattered in the plane around zero."
    return Drawing(
        "GNSS velocity errors at standstill", caption, alt, d.draw("components", 72, paint), ("standstill_velocity",)
    )


def _plane(axes: Any, north: Any, east: Any, reach: float, still: Standstill | None) -> None:
    from matplotlib.patches import Circle

    axes.set_aspect("equal")
    axes.add_patch(
        Circle((0.0, 0.0), RAW_LIMIT_MPS, fill=False, edgecolor=d.LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
    )
    d.dots(axes, east, north, d.USED, 1.6, 2000, alpha=0.6)
    if still is not None and is_number(still.mean_east_mps) and is_number(still.mean_north_mps):
        axes.plot([still.mean_east_mps], [still.mean_north_mps], "+", color=d.INK, markersize=9, markeredgewidth=1.2)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("east, m/s")
    axes.set_ylabel("north, m/s")


def mean_speed(results: FlightResults) -> Drawing | None:
    """Density of the mean speed over 10 s and 30 s with the limit (figure 2b of the paper)."""
    data = results.rows_of(StandstillMeanSpeed)
    if data is None:
        return None
    window, speed, height = data.window_s, data.speed_of_mean_mps, data.density_per_mps
    windows = sorted(set(finite(window).tolist()))
    still = _assessed(results)
    measured = None if still is None else still.speed_of_mean_mps

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 60)
        for length, colour in zip(windows, d.SERIES, strict=False):
            rows = window == length
            axes.fill_between(speed[rows], height[rows], step="mid", color=colour, alpha=0.12, linewidth=0)
            name = f"intervals of {length:g} s"
            axes.plot(speed[rows], height[rows], drawstyle="steps-mid", color=colour, linewidth=1.2, label=name)
        layout.limit_line(axes, MEAN_LIMIT_MPS, f"limit {MEAN_LIMIT_MPS} m/s", vertical=True)
        if is_number(measured):
            axes.axvline(measured, color=d.USED, linewidth=1.0, label=f"this interval: {number(measured, 4, 'm/s')}")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("length of the mean velocity vector, m/s")
        axes.set_ylabel("probability density, s/m")
        layout.legend_above(axes)

    caption = (
        "Mean speed over overlapping intervals. Longer averaging moves the density below the limit: if 10 s fail, "
        "measure longer instead of rejecting."
    )
    alt = "Densities of the mean speed for two interval lengths against the limit of 0.01 m/s."
    return Drawing(
        "Density of the mean speed at standstill",
        caption,
        alt,
        d.draw("mean-speed", 68, paint),
        ("standstill_mean_speed",),
    )
