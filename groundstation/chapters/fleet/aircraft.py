"""Chapters: the heading error and the drift of the INS by aircraft."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import (
    aircraft_name,
    bounded,
    plural,
    span_of,
)
from groundstation.chapters.parts import Figure, Grid, Head, Note, Section
from groundstation.chapters.wording import number, percent
from groundstation.results.fleet import AircraftRow, FleetResults

RATE = "radial_error_rate_fit_nmiph"
HEADING_LEAD = (
    "Does an aircraft's INS, or its mounting, err in one direction? The mean of each over its flights; flights with "
    "the verdict reject are left out."
)
RATE_LEAD = (
    "How fast the position of the unaided INS drifts: radial error over the hours since navigation began, "
    "time-position fit of each flight."
)


def heading(fleet: FleetResults) -> Section:
    """Build the chapter on the heading error."""
    title = "Heading error by aircraft"
    if not assessed(fleet):
        text = "No flight of a named aircraft has a heading error."
        return Section("aircraft", title, HEADING_LEAD, (Note(text, "unknown"),))
    return Section("aircraft", title, HEADING_LEAD, (Figure("fleet.forest"), _table(fleet)))


def heading_figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the mean error of the whole fleet."""
    whole = fleet.by_aircraft[0] if fleet.by_aircraft else None
    if whole is None or whole.mean_deg is None:
        return ()
    rejected = whole.assessed - whole.averaged
    remark = f"mean over {plural(whole.averaged, 'flight')}"
    remark += f"; {number(rejected, 0)} rejected left out" if rejected else ""
    return (("Heading error", bounded(whole.mean_deg, 3, "°", signed=True), remark),)


def assessed(fleet: FleetResults) -> list[AircraftRow]:
    """Return the aircraft with a heading error."""
    return [row for row in fleet.by_aircraft[1:] if row.mean_deg is not None]


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
        "Every flight counts as one. Between flights: σ of the true errors, without what the flights' own standard "
        "errors explain; unexplained: its share of the variance. Within: σ of the samples about the mean of their "
        "flight. There is no interval for a single flight, or for several aircraft together."
    )
    return Grid("Error by aircraft", heads, rows, caption)


def ins(fleet: FleetResults) -> Section | None:
    """Build the chapter on the drift of the INS; None where no flight has a rate."""
    title, flights = "Drift of the INS by aircraft", fleet.flights
    has_rate = _has_rate(fleet)
    if not has_rate.any():
        return None
    unaided = has_rate & (flights["ins_kind"] == "unaided")
    parts = []
    if other := int(np.sum(has_rate & ~unaided)):
        told = plural(other, "flight is left out: its INS is", "flights are left out: their INS is")
        parts.append(Note(f"{told} aided by GNSS, or may be, so the rate does not show its drift.", "unknown"))
    if not unaided.any():
        return Section("ins", title, RATE_LEAD, parts)
    rates = unaided_figures(fleet, RATE)
    return Section("ins", title, RATE_LEAD, (*parts, Figure("fleet.rates"), _rate_table(rates)))


def ins_figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the median rate of the unaided flights."""
    rate, flights = median_rate(fleet)
    if rate is None:
        return ()
    return (("INS drift", bounded(rate, 2, "nmi/h"), f"median of {plural(flights, 'unaided flight')}"),)


def _has_rate(fleet: FleetResults) -> NDArray[np.bool_]:
    rate = fleet.flights[RATE]
    return np.asarray(np.isfinite(rate) & (rate > 0.0))


def unaided_figures(fleet: FleetResults, quantity: str) -> dict[str, Any]:
    """Return a quantity of the flights whose unaided INS has a rate, by aircraft."""
    rows = _has_rate(fleet) & (fleet.flights["ins_kind"] == "unaided")
    owner, values = fleet.flights["aircraft"][rows], fleet.flights[quantity][rows]
    return {name: values[owner == name] for name in np.unique(owner).tolist()}


def median_rate(fleet: FleetResults) -> tuple[float | None, int]:
    """Return the median rate of the unaided flights, nmi/h, and the number of these flights."""
    rate = fleet.flights[RATE][fleet.flights["ins_kind"] == "unaided"]
    rate = rate[np.isfinite(rate)]
    return (float(np.median(rate)), len(rate)) if len(rate) else (None, 0)


def _rate_table(rates: dict[str, Any]) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flights", True), Head("Lowest", True)),
        *(Head("Median", True), Head("Highest", True)),
    )
    rows = [
        (
            aircraft_name(name),
            number(len(own), 0),
            *(bounded(float(value), 2) for value in (own.min(), np.median(own), own.max())),
        )
        for name, own in sorted(rates.items())
    ]
    return Grid(
        "Error rate by aircraft, nmi/h",
        heads,
        rows,
        "Over the flights, the time-position fit of each.",
    )
