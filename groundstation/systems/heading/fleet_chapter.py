"""Chapter: the heading error by aircraft."""

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import (
    aircraft_name,
    bounded,
    span_of,
)
from groundstation.chapters.parts import Figure, Grid, Head, Note, Section
from groundstation.chapters.wording import number, percent, plural
from groundstation.results.fleet import AircraftRow, FleetResults

LEAD = (
    "Does an aircraft's INS, or its mounting, err in one direction? The mean of each over its flights; flights with "
    "the verdict reject are left out."
)


def build(fleet: FleetResults) -> Section:
    """Build the chapter on the heading error."""
    title = "Heading error by aircraft"
    if not assessed(fleet):
        text = "No flight of a named aircraft has a heading error."
        return Section("aircraft", title, LEAD, (Note(text, "unknown"),))
    return Section("aircraft", title, LEAD, (Figure("fleet.forest"), _table(fleet)))


def figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the mean error of an aircraft; of several the lowest and the highest."""
    whole = fleet.by_aircraft[0] if fleet.by_aircraft else None
    if whole is None or whole.mean_deg is None:
        return ()
    means = [row.mean_deg for row in fleet.by_aircraft[1:] if row.mean_deg is not None]
    if len(means) > 1:
        span = span_of((min(means), max(means)), 3, "°")
        return (("Heading error", span, f"means of {plural(len(means), 'aircraft', 'aircraft')}"),)
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
        if place or len(fleet.by_aircraft) < 3  # a mean over several aircraft is of none of them
    ]
    caption = (
        "Every flight counts as one. Between flights: σ of the true errors, without what the flights' own standard "
        "errors explain; unexplained: its share of the variance. Within: σ of the samples about the mean of their "
        "flight. There is no interval for a single flight, or for several aircraft together."
    )
    return Grid("Error by aircraft", heads, rows, caption)
