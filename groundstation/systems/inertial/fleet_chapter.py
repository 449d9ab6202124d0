"""Chapter: skill of the forecast without GNSS over all flights."""

import numpy as np

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import bounded, plural
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import clean, is_number, number, percent
from groundstation.results.fleet import FleetResults, FleetSkill
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN, FORECAST_METHODS

HEADLINE_MIN = 60.0
LEAD = (
    "GNSS is withheld in the analysis at many moments of every flight: the radial position error that grows after "
    "each, over all starts of all flights."
)


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None without any forecast."""
    rows = drawn(fleet)
    if not rows:
        return None
    shipped = shipped_method(fleet)
    parts: list[Part] = []
    aided_ids = fleet.flights["flight_id"][fleet.flights["ins_kind"] != "unaided"]
    if aided := len(set(aided_ids.tolist()).intersection(fleet.skill_flights.flight_id.tolist())):
        told = plural(aided, "flight has", "flights have")
        text = (
            f"{told} an INS that is aided by GNSS, or may be: their starts are included and look better than they are."
        )
        parts.append(Note(text, "warn"))
    parts += [Figure("fleet.growth"), _by_horizon(rows, shipped)]
    if len(fleet.skill_flights):
        parts.append(Figure("fleet.skill"))
    return Section("forecast", "Forecast skill", LEAD, (*parts, _in_detail(fleet, rows)))


def drawn(fleet: FleetResults) -> list[FleetSkill]:
    """Return the rows with an error above zero, by method and horizon."""
    return [row for row in fleet.skill if row.rms_m > 0.0]


def shipped_method(fleet: FleetResults) -> str:
    """Return the method that most flights ship; empty without any.

    The first in the order of the methods where several are equal.
    """
    names, counts = np.unique(fleet.skill_flights.method, return_counts=True)
    return str(names[int(np.argmax(counts))]) if len(names) else ""


def headline(fleet: FleetResults) -> FleetSkill | None:
    """Return the shipped method after an hour, or at its longest horizon before that."""
    mine = [row for row in fleet.skill if row.method == shipped_method(fleet)]
    exact = [row for row in mine if row.horizon_min == HEADLINE_MIN]
    found = exact or mine
    return found[-1] if found else None


def figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return the RMS error of the shipped method on an aircraft, of several the ends."""
    row = headline(fleet)
    if row is None:
        return ()
    title, each = f"Forecast, {row.horizon_min:g} min", by_aircraft(fleet, row)
    remark = f"RMS over {number(row.starts, 0)} starts on {plural(row.flights, 'flight')}"
    if len(each) < 2:
        return ((title, bounded(row.rms_m, 0, "m"), remark),)
    low, high = bounded(min(each.values()), 0), bounded(max(each.values()), 0, "m")
    return ((title, f"{low} … {high}", f"{plural(len(each), 'aircraft', 'aircraft')}; {remark}"),)


def by_aircraft(fleet: FleetResults, row: FleetSkill) -> dict[str, float]:
    """Return the RMS error of a method at a horizon on each aircraft, merged by the starts."""
    table = fleet.skill_flights
    rows = (table.method == row.method) & (table.horizon_min == row.horizon_min) & np.isfinite(table.rms_m)
    owner, starts, squares = table.aircraft[rows], table.starts[rows], table.rms_m[rows] ** 2
    merged = {}
    for name in np.unique(owner).tolist():
        mine = owner == name
        if (count := float(starts[mine].sum())) > 0.0:
            merged[name] = float(np.sqrt(np.sum(starts[mine] * squares[mine]) / count))
    return merged


def method_title(name: str) -> str:
    """Return a method in words."""
    return FORECAST_METHODS.get(name, clean(name))


def _by_horizon(rows: list[FleetSkill], shipped: str) -> Grid:
    known = sorted({row.horizon_min for row in rows})
    horizons = [value for value in known if value in FORECAST_HORIZONS_MIN] or known[: len(FORECAST_HORIZONS_MIN)]
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


def _in_detail(fleet: FleetResults, rows: list[FleetSkill]) -> Grid:
    shipped = set(fleet.skill_flights.method.tolist())
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
        "Median and worst of the flights' own RMS. Outages of one flight overlap, so the band is judged over flights, "
        "each by its NEES where it has enough starts."
    )
    return Grid("The shipped method in detail", heads, table, caption)
