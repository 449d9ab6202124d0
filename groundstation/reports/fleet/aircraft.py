"""Chapters: the heading error and the drift of the INS by aircraft."""

from typing import Any

import numpy as np

from groundstation.chapters.parts import Grid, Head, Note, Section
from groundstation.chapters.wording import number, percent
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.fleet.common import (
    ROW_MM,
    aircraft_name,
    bounded,
    dot_size,
    left_out,
    name_axis,
    plural,
    rows_shown,
    span_of,
)
from groundstation.results.fleet import AircraftRow, FleetResults

MOST_DOTS = 2000
RATE = "radial_error_rate_50_nmiph"
WORST_RATE = "radial_error_rate_95_nmiph"
HEADING_LEAD = (
    "Does an aircraft's INS, or its mounting, err in one direction? The mean of each over its flights; those with the "
    "verdict reject enter no mean."
)
RATE_LEAD = (
    "How fast the position of the unaided INS drifts: radial error over time, half of each flight below the rate shown."
)


def heading(fleet: FleetResults) -> Section:
    """Build the chapter on the heading error."""
    title = "Heading error by aircraft"
    assessed = [row for row in fleet.by_aircraft[1:] if row.mean_deg is not None]
    if not assessed:
        text = "No flight of a named aircraft has a heading error."
        return Section("aircraft", title, HEADING_LEAD, (Note(text, "unknown"),))
    return Section("aircraft", title, HEADING_LEAD, (_forest(fleet, assessed), _table(fleet)))


def _forest(fleet: FleetResults, assessed: list[AircraftRow]) -> Drawing:
    by_name = {row.aircraft: row for row in assessed}
    shown = [by_name[name] for name in rows_shown({row.aircraft: row.averaged for row in assessed})]
    error, owner = fleet.flights["error_deg"], fleet.flights["aircraft"]
    whole = fleet.by_aircraft[0].mean_deg
    most = max(MOST_DOTS // len(shown), 20)
    height = 18.0 + ROW_MM * (len(shown) + 1)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 58, 12, 174, height - 6)
        for place, row in enumerate(shown):
            own = d.finite(error[owner == row.aircraft])
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
        f"Line: mean over the whole fleet.{left_out(len(shown), len(assessed))}"
    )
    alt = "Forest plot of the mean heading error of each aircraft with its 95 percent interval."
    return Drawing("Mean error of each aircraft", caption, alt, d.draw("fleet-forest", height, paint))


def _table(fleet: FleetResults) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flights", True), Head("Assessed", True), Head("In the mean", True)),
        *(Head("Mean error, °", True), Head("95 % interval", True)),
        *(Head("Between flights, °", True), Head("Within, °", True), Head("Unexplained", True), Head("Samples", True)),
    )
    rows = [
        (
            aircraft_name(row.aircraft) if place else "Whole fleet",
            *(number(count, 0) for count in (row.flights, row.assessed, row.averaged)),
            bounded(row.mean_deg, 3, signed=True),
            span_of(row.confidence95_deg, 3, "°"),
            *(bounded(value, 3) for value in (row.sigma_between_deg, row.sigma_within_deg)),
            percent(row.heterogeneity),
            number(row.samples, 0),
        )
        for place, row in enumerate(fleet.by_aircraft)
    ]
    caption = (
        "Every flight counts as one. Between flights: σ of the true errors, what the flights' own standard errors "
        "explain taken away; unexplained: its share of the variance. Within: σ of the samples about the mean of their "
        "flight. No interval for a single flight, nor for several aircraft together."
    )
    return Grid("Error by aircraft", heads, rows, caption)


# ---------------------------------------------------------------------------------------------------- drift of the INS


def ins(fleet: FleetResults) -> Section | None:
    """Build the chapter on the drift of the INS; None where no flight has a rate."""
    title, flights = "Drift of the INS by aircraft", fleet.flights
    has_rate = np.isfinite(flights[RATE]) & (flights[RATE] > 0.0)
    if not has_rate.any():
        return None
    unaided = has_rate & (flights["ins_kind"] == "unaided")
    parts = []
    if other := int(np.sum(has_rate & ~unaided)):
        told = plural(other, "flight is left out: its INS is", "flights are left out: their INS is")
        parts.append(Note(f"{told} aided by GNSS, or may be, and the rate says nothing about it.", "unknown"))
    if not unaided.any():
        return Section("ins", title, RATE_LEAD, parts)
    owner = flights["aircraft"][unaided]
    rates = {name: flights[RATE][unaided][owner == name] for name in np.unique(owner).tolist()}
    worst = {name: flights[WORST_RATE][unaided][owner == name] for name in rates}
    return Section("ins", title, RATE_LEAD, (*parts, _rates(rates), _rate_table(rates, worst)))


def median_rate(fleet: FleetResults) -> tuple[float | None, int]:
    """Median over the unaided flights of their rate, nautical miles per hour, and how many these are."""
    rate = d.finite(fleet.flights[RATE][fleet.flights["ins_kind"] == "unaided"])
    return (float(np.median(rate)), len(rate)) if len(rate) else (None, 0)


def _rates(rates: dict[str, Any]) -> Drawing:
    shown = rows_shown({name: len(values) for name, values in rates.items()})
    most = max(MOST_DOTS // len(shown), 20)
    height = 18.0 + ROW_MM * (len(shown) + 1)
    drawn = d.finite(*(rates[name] for name in shown))

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


def _rate_table(rates: dict[str, Any], worst: dict[str, Any]) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flights", True), Head("Lowest", True)),
        *(Head("Median", True), Head("Highest", True), Head("Highest, 95 % of the time below", True)),
    )
    rows = [
        (
            aircraft_name(name),
            number(len(own), 0),
            *(bounded(float(value), 2) for value in (own.min(), np.median(own), own.max())),
            bounded(float(np.max(d.finite(worst[name]), initial=-np.inf)), 2),
        )
        for name, own in sorted(rates.items())
    ]
    return Grid("Error rate by aircraft, nmi/h", heads, rows, "Over the flights; half of the time of each below.")
