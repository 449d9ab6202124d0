"""Chapter: skill of the forecast without GNSS over all flights."""

from typing import Any

import numpy as np

from groundstation.chapters.parts import Cell, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import clean, is_number, number, percent
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.forecast import OTHERS
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.common import bounded, colours_of, date_axis, date_numbers, dot_size, plural
from groundstation.results.fleet import FleetResults, FleetSkill
from groundstation.results.forecast import HORIZONS_MIN, METHODS

HEADLINE_MIN = 60.0
MOST_DOTS = 1500
CONFIDENCE = 95.0
LEAD = (
    "GNSS taken away on paper at many moments of every flight: radial position error built up since, over all starts "
    "of all flights."
)


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None without any forecast."""
    rows = [row for row in fleet.skill if row.rms_m > 0.0]
    if not rows:
        return None
    shipped = shipped_method(fleet)
    parts: list[Part] = []
    rated = np.isin(fleet.flights["flight_id"], fleet.skill_flights["flight_id"])
    if aided := int(np.sum(rated & (fleet.flights["ins_kind"] != "unaided"))):
        told = plural(aided, "flight has", "flights have")
        text = (
            f"{told} an INS that is aided by GNSS, or may be: their starts are in here, and look better than they are."
        )
        parts.append(Note(text, "warn"))
    parts += [_growth(fleet, rows, shipped), _by_horizon(rows, shipped)]
    if len(fleet.skill_flights):
        parts.append(_flights(fleet))
    return Section("forecast", "Forecast skill", LEAD, (*parts, _in_detail(fleet, rows)))


def shipped_method(fleet: FleetResults) -> str:
    """The method that most flights ship, the first in the order of the methods where several do; empty without any."""
    names, counts = np.unique(fleet.skill_flights["method"], return_counts=True)
    return str(names[int(np.argmax(counts))]) if len(names) else ""


def headline(fleet: FleetResults) -> FleetSkill | None:
    """The shipped method after an hour, or at its longest horizon before that."""
    mine = [row for row in fleet.skill if row.method == shipped_method(fleet)]
    exact = [row for row in mine if row.horizon_min == HEADLINE_MIN]
    found = exact or mine
    return found[-1] if found else None


def method_title(name: str) -> str:
    """A method in words."""
    return METHODS.get(name, clean(name))


def _growth(fleet: FleetResults, rows: list[FleetSkill], shipped: str) -> Drawing:
    methods = list(dict.fromkeys(row.method for row in rows))
    others = (name for name in methods if name not in ("raw_ins", shipped))
    colours = {"raw_ins": d.INS, shipped: d.USED} | dict(zip(others, OTHERS, strict=False))
    own = fleet.skill_flights["method"] == shipped
    horizon, rms = (fleet.skill_flights[key][own] for key in ("horizon_min", "rms_m"))
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


def _by_horizon(rows: list[FleetSkill], shipped: str) -> Grid:
    known = sorted({row.horizon_min for row in rows})
    horizons = [value for value in known if value in HORIZONS_MIN] or known[: len(HORIZONS_MIN)]
    found = {(row.method, row.horizon_min): row.rms_m for row in rows}
    heads = (Head("Method"), *(Head(f"{value:g} min", True) for value in horizons))
    table = [
        (
            f"{method_title(name)}{' (shipped)' if name == shipped else ''}",
            *(bounded(found.get((name, value)), 0) for value in horizons),
        )
        for name in dict.fromkeys(row.method for row in rows)
    ]
    return Grid("RMS radial error by horizon, m", heads, table, "Mean squares merged by the number of starts.")


def _flights(fleet: FleetResults) -> Drawing:
    table, shipped = fleet.skill_flights, shipped_method(fleet)
    horizons = np.unique(table["horizon_min"])
    horizon = HEADLINE_MIN if HEADLINE_MIN in horizons else float(horizons[-1])
    own = np.flatnonzero((table["horizon_min"] == horizon) & (table["rms_m"] > 0.0))
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
    timed = own[~np.isnat(table["start_utc"][own])]
    if not len(timed):
        layout.nothing(axes, "no flight with a time")
        return
    axes.set_yscale("log")
    colours = colours_of(fleet)
    time, rms, owner = (table[key][timed] for key in ("start_utc", "rms_m", "aircraft"))
    for colour in dict.fromkeys(colours[name] for name in owner.tolist()):
        mine = np.array([colours[name] == colour for name in owner.tolist()])
        d.dots(axes, date_numbers(time[mine]), rms[mine], colour, dot_size(len(timed)), MOST_DOTS)
    low, high = float(rms.min()), float(rms.max())
    axes.set_ylim(min(low / 1.3, np.sqrt(low * high) / 3.0), max(high * 1.3, np.sqrt(low * high) * 3.0))
    plain_log(axes.yaxis)
    date_axis(axes, time)


def _in_detail(fleet: FleetResults, rows: list[FleetSkill]) -> Grid:
    shipped = set(fleet.skill_flights["method"].tolist())
    heads = (
        *(
            Head("Method"),
            Head("Horizon, min", True),
            Head("Flights", True),
            Head("Starts", True),
            Head("RMS, m", True),
        ),
        *(Head("Median flight, m", True), Head("Worst flight, m", True)),
        *(Head("Inside 95 % band", True), Head("of starts", True), Head("NEES within limits", True)),
    )
    table: list[tuple[Cell, ...]] = [
        (
            *(method_title(row.method), f"{row.horizon_min:g}", number(row.flights, 0), number(row.starts, 0)),
            *(bounded(value, 0) for value in (row.rms_m, row.median_flight_rms_m, row.highest_flight_rms_m)),
            percent(row.coverage95),
            number(row.coverage_starts, 0) if is_number(row.coverage95) else "",
            f"{row.flights_within} of {row.flights_judged}" if row.flights_judged else "",
        )
        for row in rows
        if row.method in shipped
    ]
    caption = (
        "Median and worst of the flights' own RMS. Outages of one flight overlap: the band is judged over flights, "
        "each by its NEES where it has starts enough."
    )
    return Grid("The shipped method in detail", heads, table, caption)
