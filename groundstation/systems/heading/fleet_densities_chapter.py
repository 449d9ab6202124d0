"""Chapter on the density of the heading error of every flight.

Overlaid with the fitted normal (figure 3 of the paper).
"""

from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.parts import Figure, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import number
from groundstation.results.fleet import FleetResults

LEAD = "INS heading − GNSS track of the used samples, flight by flight, on one scale with the normal fitted to "


def build(fleet: FleetResults) -> Section:
    """Build the chapter."""
    lead = f"{LEAD}{_of_whom(fleet)}"
    if not len(fleet.densities):
        note = Note("No flight has samples of the heading error.", "unknown")
        return Section("densities", "Density of the heading error", lead, (note,))
    parts: list[Part] = [Figure("fleet.densities")]
    if len(fleet.densities.named) > 1:
        parts.append(Figure("fleet.densities_by_aircraft"))
    parts.append(_normals(fleet))
    return Section("densities", "Density of the heading error", lead, parts)


def _of_whom(fleet: FleetResults) -> str:
    """Return the end of the lead: whose samples the normal is fitted to."""
    names = fleet.densities.named
    if len(names) > 1:
        return "those of each aircraft: figure 3 of the paper. Samples of different aircraft are never merged."
    alone = len(names) == 1 and set(fleet.densities.aircraft.tolist()) == set(names)
    whose = f" All are of {aircraft_name(names[0])}." if alone else ""
    return f"all: figure 3 of the paper over this fleet.{whose}"


def _normals(fleet: FleetResults) -> Grid:
    heads = (
        *(Head("Aircraft"), Head("Flights", True), Head("Samples", True)),
        *(Head("Mean, °", True), Head("σ, °", True)),
    )
    rows = [
        (
            aircraft_name(one.aircraft) if place else "Whole fleet",
            *(number(one.flights, 0), number(one.samples, 0)),
            *(angle(one.mean_deg, ""), number(one.sigma_deg, 3)),
        )
        for place, one in enumerate(fleet.normals)
        if place or len(fleet.normals) < 3
    ]
    caption = "Merged from number, mean and sum of squares of each flight: the same as the samples in one array."
    return Grid("Fitted normals", heads, rows, caption)


def angle(value: float, unit: str = "°") -> str:
    """Return an angle as this chapter writes it."""
    return number(value, 3, unit, signed=True)
