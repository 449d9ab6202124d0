"""Chapter: trend of each aircraft over time, as a control chart with its changes of level."""

import numpy as np
from numpy.typing import NDArray

from groundstation.chapters.fleet import slopes
from groundstation.chapters.fleet.common import (
    aircraft_name,
    day,
    figure_of,
    title_of,
)
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import ABSENT, number, significant
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_trends import ChangePoint

QUANTITIES = {
    "error_deg": "error, °",
    "radial_error_rate_fit_nmiph": "nmi/h",
    "health_vibration_mps2": "m/s²",
    "health_hdop": "HDOP",
    "health_test_ratio": "test ratio",
    "onboard_heading_rms_deg": "heading of the filter, °",
    "onboard_tilt_rms_deg": "tilt of the filter, °",
}
LEAD = "Has an aircraft changed? Every flight in order of time against the level of its aircraft."


def build(fleet: FleetResults) -> Section:
    """Build the chapter."""
    fewest = fleet.stated.get("fewest_flights_for_a_trend")
    if not len(fleet.trend):
        needed = f"{number(fewest, 0)} flights" if fewest is not None else "more flights"
        text = f"No aircraft has the {needed} with a time that a trend needs."
        return Section("trend", "Trend over time", LEAD, (Note(text, "unknown"),))
    parts: list[Part | None] = [_changes(fleet), slopes.grid(fleet)]
    for quantity in QUANTITIES:
        parts += [Figure("fleet.trend", quantity), _levels(fleet, quantity)]
    return Section("trend", "Trend over time", LEAD, tuple(part for part in parts if part is not None))


def _changes(fleet: FleetResults) -> Part:
    if not fleet.change_points:
        return Note("No change of level was found.", "good")
    heads = (
        *(Head("No."), Head("Aircraft"), Head("Quantity"), Head("From flight"), Head("Of")),
        *(Head("Level before", True), Head("after", True), Head("Flights before", True), Head("after", True)),
        Head("p", True),
    )
    rows = [
        (
            *(str(place), aircraft_name(change.aircraft), title_of(change.quantity), change.flight_id),
            day(np.datetime64(change.start_utc_ns, "ns")),
            *(figure_of(change.quantity, level) for level in (change.level_before, change.level_after)),
            *(number(count, 0) for count in (change.flights_before, change.flights_after)),
            significant(change.p_value, 2),
        )
        for place, change in enumerate(fleet.change_points, 1)
    ]
    caption = (
        "Levels are medians; p: the chance of so large a step anywhere in a steady series. Numbers as in the charts."
    )
    return Grid("Changes of level", heads, rows, caption)


def flights_of(fleet: FleetResults, quantity: str, name: str) -> NDArray[np.intp]:
    """Return rows of the trend of a quantity of an aircraft."""
    return np.flatnonzero((fleet.trend.quantity == quantity) & (fleet.trend.aircraft == name))


def charted(fleet: FleetResults, quantity: str) -> list[str]:
    """Return aircraft with a trend of a quantity."""
    return sorted(set(fleet.trend.aircraft[fleet.trend.quantity == quantity].tolist()))


def changes_of(fleet: FleetResults, quantity: str, name: str) -> list[tuple[int, ChangePoint]]:
    """Return changes of level of a quantity of an aircraft, numbered as in table and chart."""
    numbered = enumerate(fleet.change_points, 1)
    return [(place, one) for place, one in numbered if (one.aircraft, one.quantity) == (name, quantity)]


def _levels(fleet: FleetResults, quantity: str) -> Grid | None:
    heads = [
        *(Head("Aircraft"), Head("Flights", True), Head("From"), Head("To"), Head("Level now", True)),
        *(Head("Control limits", True), Head("Outside", True), Head("Changes", True)),
    ]
    limits = fleet.trend.limit[fleet.trend.quantity == quantity]
    has_limit = bool(np.isfinite(limits).any())
    heads += [Head("Limit", True)] if has_limit else []
    rows: list[tuple[Cell, ...]] = []
    for name in charted(fleet, quantity):
        own = flights_of(fleet, quantity, name)
        last = fleet.trend.where(own[-1:])
        level, low, high, limit = (float(values[0]) for values in (last.level, last.low, last.high, last.limit))
        rows.append(
            (
                *(aircraft_name(name), number(len(own), 0)),
                *(day(fleet.trend.start_utc[row]) for row in (own[0], own[-1])),
                figure_of(quantity, level),
                f"{figure_of(quantity, low)} … {figure_of(quantity, high)}",
                number(int(fleet.trend.is_outside[own].sum()), 0),
                number(len(changes_of(fleet, quantity, name)), 0),
                *((figure_of(quantity, limit).lstrip("+") if np.isfinite(limit) else ABSENT,) if has_limit else ()),
            )
        )
    return Grid(f"Levels of the {title_of(quantity)}", heads, rows) if rows else None
