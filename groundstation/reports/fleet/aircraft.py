"""Figures: the heading error and the drift of the INS by aircraft."""

from typing import Any

import numpy as np

from groundstation.chapters.fleet.aircraft import RATE, assessed, unaided_figures
from groundstation.chapters.fleet.common import aircraft_name, plural
from groundstation.plots.ranges import finite
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.common import ROW_MM, dot_size, left_out, name_axis, rows_shown
from groundstation.results.fleet import FleetResults

MOST_DOTS = 2000


def forest(fleet: FleetResults) -> Drawing:
    """Draw the mean error of each aircraft."""
    by_name = {row.aircraft: row for row in assessed(fleet)}
    shown = [by_name[name] for name in rows_shown({row.aircraft: row.averaged for row in by_name.values()})]
    error, owner = fleet.flights["error_deg"], fleet.flights["aircraft"]
    whole = fleet.by_aircraft[0].mean_deg
    most = max(MOST_DOTS // len(shown), 20)
    height = 18.0 + ROW_MM * (len(shown) + 1)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 58, 12, 174, height - 6)
        for place, row in enumerate(shown):
            own = finite(error[owner == row.aircraft])
            d.dots(axes, own, np.full(len(own), place), d.UNUSED, dot_size(len(own)), most, zorder=1.5)
            if row.confidence95_deg is not None:
                bar = np.array([row.confidence95_deg])
                d.bars(axes, bar[:, 0], bar[:, 1], place, d.USED, 2.4)
            axes.plot([row.mean_deg], [place], "o", color=d.USED, markersize=4.5, zorder=4)
        if whole is not None:
            axes.axvline(whole, color=d.INK, linewidth=0.6)
        axes.axvline(0.0, color=d.FAINT, linewidth=0.6, linestyle=":")
        name_axis(axes, [f"{d.label(row.aircraft, 20)}  ·  {plural(row.averaged, 'flight')}" for row in shown])
        axes.set_xlabel("heading error, °")

    caption = (
        "Green: mean over the flights with its 95 % interval, from the spread between flights; grey: single flights, "
        "the rejected among them. "
        f"Line: mean over the whole fleet.{left_out(len(shown), len(by_name))}"
    )
    alt = "Forest plot of the mean heading error of each aircraft with its 95 percent interval."
    return Drawing("Mean error of each aircraft", caption, alt, d.draw("fleet-forest", height, paint))


def rates(fleet: FleetResults) -> Drawing:
    """Draw the error rate of the unaided INS of every flight."""
    rates = unaided_figures(fleet, RATE)
    shown = rows_shown({name: len(values) for name, values in rates.items()})
    most = max(MOST_DOTS // len(shown), 20)
    height = 18.0 + ROW_MM * (len(shown) + 1)
    drawn = finite(*(rates[name] for name in shown))

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 58, 12, 174, height - 6)
        axes.set_xscale("log")
        for place, name in enumerate(shown):
            own = np.sort(rates[name])
            d.dots(axes, own, np.full(len(own), place), d.INS, dot_size(len(own)), most, alpha=0.6)
            axes.plot([np.median(own)], [place], "|", color=d.INK, markersize=10.0, markeredgewidth=1.6, zorder=4)
        plain_log(axes.xaxis)
        axes.set_xlim(*log_limits(drawn))
        names = [f"{d.label(aircraft_name(name), 20)}  ·  {plural(len(rates[name]), 'flight')}" for name in shown]
        name_axis(axes, names)
        axes.set_xlabel("radial error rate, nmi/h")

    caption = f"A dot for each flight; black: median of the aircraft.{left_out(len(shown), len(rates))}"
    alt = "INS error rate of every flight by aircraft with the median of each."
    return Drawing("Error rate of every flight", caption, alt, d.draw("fleet-rates", height, paint))


def log_limits(values: Any) -> tuple[float, float]:
    """Limits of a logarithmic axis around positive values, wide enough for two round ticks."""
    low, high = float(np.min(values)), float(np.max(values))
    middle = float(np.sqrt(low) * np.sqrt(high))
    return min(low / 1.2, middle / 3.0), max(high * 1.2, middle * 3.0)
