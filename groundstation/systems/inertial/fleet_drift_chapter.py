"""Chapter: the drift of the INS by aircraft."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import aircraft_name, bounded
from groundstation.chapters.parts import Figure, Grid, Head, Note, Section
from groundstation.chapters.wording import number, plural
from groundstation.results.fleet import FleetResults

RATE = "radial_error_rate_fit_nmiph"
LEAD = (
    "How fast the position of the unaided INS drifts: radial error over the hours since navigation began, "
    "time-position fit of each flight."
)


def build(fleet: FleetResults) -> Section | None:
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
        return Section("ins", title, LEAD, parts)
    rates = unaided_figures(fleet, RATE)
    return Section("ins", title, LEAD, (*parts, Figure("fleet.rates"), _table(rates)))


def figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the median rate of an aircraft; of several the lowest and the highest."""
    rates = unaided_figures(fleet, RATE)
    if not rates:
        return ()
    flights = plural(sum(map(len, rates.values())), "unaided flight")
    medians = [float(np.median(own)) for own in rates.values()]
    if len(medians) == 1:
        return (("INS drift", bounded(medians[0], 2, "nmi/h"), f"median of {flights}"),)
    told = f"medians of {plural(len(medians), 'aircraft', 'aircraft')}, {flights}"
    return (("INS drift", f"{bounded(min(medians), 2)} … {bounded(max(medians), 2, 'nmi/h')}", told),)


def _has_rate(fleet: FleetResults) -> NDArray[np.bool_]:
    rate = fleet.flights[RATE]
    return np.asarray(np.isfinite(rate) & (rate > 0.0))


def unaided_figures(fleet: FleetResults, quantity: str) -> dict[str, Any]:
    """Return a quantity of the flights whose unaided INS has a rate, by aircraft."""
    rows = _has_rate(fleet) & (fleet.flights["ins_kind"] == "unaided")
    owner, values = fleet.flights["aircraft"][rows], fleet.flights[quantity][rows]
    return {name: values[owner == name] for name in np.unique(owner).tolist()}


def _table(rates: dict[str, Any]) -> Grid:
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
