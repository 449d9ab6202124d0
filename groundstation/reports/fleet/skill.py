"""Figures: skill of the forecast without GNSS over all flights."""

from typing import Any

import numpy as np

from groundstation.chapters.fleet.skill import HEADLINE_MIN, drawn, method_title, shipped_method
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.forecast import OTHERS
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.common import colours_of, date_axis, date_numbers, dot_size
from groundstation.results.fleet import FleetResults

MOST_DOTS = 1500
CONFIDENCE = 95.0


def growth(fleet: FleetResults) -> Drawing:
    """Draw the error of each method against the horizon."""
    rows, shipped = drawn(fleet), shipped_method(fleet)
    methods = list(dict.fromkeys(row.method for row in rows))
    others = (name for name in methods if name not in ("raw_ins", shipped))
    colours = {"raw_ins": d.INS, shipped: d.USED} | dict(zip(others, OTHERS, strict=False))
    own = fleet.skill_flights.method == shipped
    horizon, rms = fleet.skill_flights.horizon_min[own], fleet.skill_flights.rms_m[own]
    highest = {name: max(row.rms_m for row in rows if row.method == name) for name in methods}

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 112, 82)
        axes.set_xscale("log")
        axes.set_yscale("log")
        is_positive = (rms > 0.0) & (horizon > 0.0)
        d.dots(
            axes,
            horizon[is_positive],
            rms[is_positive],
            d.UNUSED,
            2.0,
            MOST_DOTS,
            label="flights (shipped)",
            zorder=1.5,
        )
        for name in sorted(methods, key=lambda name: -highest[name]):
            line = sorted((row.horizon_min, row.rms_m) for row in rows if row.method == name and row.horizon_min > 0.0)
            width, order = (2.6, 4) if name == shipped else (1.0, 2)
            text = f"{method_title(name)}{' (shipped)' if name == shipped else ''}"
            x, y = ([pair[place] for pair in line] for place in (0, 1))
            axes.plot(x, y, color=colours.get(name, d.FAINT), linewidth=width, label=d.label(text), zorder=order)
        plain_log(axes.xaxis)
        plain_log(axes.yaxis)
        axes.set_xlabel("horizon, min without GNSS")
        axes.set_ylabel("RMS radial error, m")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), labelspacing=0.7)

    caption = "Root mean square over all starts of all flights, by method; grey: the shipped method on each flight."
    alt = "RMS forecast error against horizon for each method, with the single flights, logarithmic axes."
    return Drawing("How the error grows", caption, alt, d.draw("fleet-growth", 90, paint))


def flights(fleet: FleetResults) -> Drawing:
    """Draw the shipped method on every flight, and how honest its band is."""
    table, shipped = fleet.skill_flights, shipped_method(fleet)
    horizons = np.unique(table.horizon_min)
    horizon = HEADLINE_MIN if HEADLINE_MIN in horizons else float(horizons[-1])
    own = np.flatnonzero((table.horizon_min == horizon) & (table.rms_m > 0.0))
    covered = sorted(
        (row.horizon_min, row.coverage95)
        for row in fleet.skill
        if row.method == shipped and row.coverage95 is not None and np.isfinite(row.horizon_min)
    )

    def paint(figure: Any) -> None:
        left, right = layout.place(figure, 16, 12, 112, 54), layout.place(figure, 132, 12, 174, 54)
        _paint_flights(left, fleet, own)
        left.set_ylabel(f"RMS after {horizon:g} min, m")
        if covered:
            right.plot(*zip(*((x, 100.0 * y) for x, y in covered), strict=True), "o-", color=d.USED, markersize=3.0)
            layout.limit_line(right, CONFIDENCE, "wanted", colour=d.USED)
        else:
            layout.nothing(right, "no band claimed")
        right.set_ylim(0.0, 105.0)
        right.set_xlabel("horizon, min")
        right.set_ylabel("inside the 95 % band, %")

    caption = (
        f"Left: the shipped method on every flight after {horizon:g} min without GNSS. Right: share of the errors of "
        "all starts inside the band that the forecast claims; below the dashed line it is overconfident."
    )
    alt = "Forecast error of every flight over time, and coverage of the forecast's band by horizon."
    return Drawing("Flights and coverage", caption, alt, d.draw("fleet-skill", 62, paint))


def _paint_flights(axes: Any, fleet: FleetResults, own: Any) -> None:
    table = fleet.skill_flights
    timed = own[~np.isnat(table.start_utc[own])]
    if not len(timed):
        layout.nothing(axes, "no flight with a time")
        return
    axes.set_yscale("log")
    colours = colours_of(fleet)
    time, rms, owner = table.start_utc[timed], table.rms_m[timed], table.aircraft[timed]
    for colour in dict.fromkeys(colours[name] for name in owner.tolist()):
        mine = np.array([colours[name] == colour for name in owner.tolist()])
        d.dots(axes, date_numbers(time[mine]), rms[mine], colour, dot_size(len(timed)), MOST_DOTS)
    low, high = float(rms.min()), float(rms.max())
    axes.set_ylim(min(low / 1.3, np.sqrt(low * high) / 3.0), max(high * 1.3, np.sqrt(low * high) * 3.0))
    plain_log(axes.yaxis)
    date_axis(axes, time)
