"""Chapter: skill of the forecast without GNSS over all flights."""

import numpy as np

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import aircraft_name, bounded
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Note, Part, Section
from groundstation.chapters.wording import clean, is_number, number, percent, plural
from groundstation.results.fleet import WHOLE_FLEET, FleetResults, FleetSkill
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN, FORECAST_METHODS

HEADLINE_MIN = 60.0
MOST_WITH_ALL_METHODS = 6  # aircraft; of more the table has the raw INS and the shipped method
LEAD = (
    "GNSS is withheld in the analysis at many moments of every flight: the radial position error that grows after "
    "each, over all starts"
)


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None without any forecast."""
    rows = drawn(fleet)
    if not rows:
        return None
    parts: list[Part] = []
    aided_ids = fleet.flights["flight_id"][fleet.flights["ins_kind"] != "unaided"]
    if aided := len(set(aided_ids.tolist()).intersection(fleet.skill_flights.flight_id.tolist())):
        told = plural(aided, "flight has", "flights have")
        text = (
            f"{told} an INS that is aided by GNSS, or may be: their starts are included and look better than they are."
        )
        parts.append(Note(text, "warn"))
    parts += [Figure("fleet.growth"), _by_horizon(fleet, rows)]
    if len(fleet.skill_flights):
        parts.append(Figure("fleet.skill"))
    return Section("forecast", "Forecast skill", f"{LEAD}{_of_whom(fleet)}", (*parts, _in_detail(fleet, rows)))


def parted(fleet: FleetResults) -> tuple[str, ...]:
    """Return the aircraft of which each has its own rows; none where all are told as one."""
    names = dict.fromkeys(row.aircraft for row in fleet.skill_by_aircraft)
    return tuple(names) if len(names) > 1 else ()


def drawn(fleet: FleetResults) -> list[FleetSkill]:
    """Return the rows with an error above zero, by aircraft, method and horizon."""
    rows = fleet.skill_by_aircraft if parted(fleet) else fleet.skill
    return [row for row in rows if row.rms_m > 0.0]


def shipped_method(fleet: FleetResults, aircraft: str = WHOLE_FLEET) -> str:
    """Return the method that most flights ship, or most of an aircraft; empty without any.

    The first in the order of the methods where several are equal.
    """
    table = fleet.skill_flights
    own = table.method if aircraft == WHOLE_FLEET else table.method[table.aircraft == aircraft]
    names, counts = np.unique(own, return_counts=True)
    return str(names[int(np.argmax(counts))]) if len(names) else ""


def _of_whom(fleet: FleetResults) -> str:
    """Return the end of the lead: whose flights a row merges."""
    table = fleet.skill_flights
    nameless = len(set(table.flight_id[table.aircraft == WHOLE_FLEET].tolist()))
    if parted(fleet):
        left_out = f" {plural(nameless, 'flight names', 'flights name')} none and stand as dots alone."
        return f" of an aircraft: flights of different aircraft are never merged.{left_out if nameless else ''}"
    named = [name for name in fleet.aircraft if name]
    if not named:
        return " of all flights. The logs name no aircraft: if they are of several, the figures are of none of them."
    if nameless:
        one = (
            f"{aircraft_name(named[0])}; {plural(nameless, 'flight', 'flights')} whose log names none count as its own"
        )
        return f" of all flights. All are of {one}."
    return f" of all flights. All are of {aircraft_name(named[0])}."


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
    remark = f"RMS over {plural(row.starts, 'start')} on {plural(row.flights, 'flight')}"
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


def _by_horizon(fleet: FleetResults, rows: list[FleetSkill]) -> Grid:
    known = sorted({row.horizon_min for row in rows})
    horizons = [value for value in known if value in FORECAST_HORIZONS_MIN] or known[: len(FORECAST_HORIZONS_MIN)]
    found = {(row.aircraft, row.method, row.horizon_min): row.rms_m for row in rows}
    names, caption = parted(fleet), "Mean squares merged by the number of starts."
    heads = (*_owner_heads(names), Head("Method"), *(Head(f"{value:g} min", True) for value in horizons))
    kept = dict.fromkeys((row.aircraft, row.method) for row in rows)
    if len(names) > MOST_WITH_ALL_METHODS:
        kept = dict.fromkeys(key for key in kept if key[1] in ("raw_ins", shipped_method(fleet, key[0])))
        caption += " Of so many aircraft the raw INS and the shipped method; the report of a flight has every method."
    table = [
        (
            *_owner(names, owner),
            f"{method_title(name)}{' (shipped)' if name == shipped_method(fleet, owner) else ''}",
            *(bounded(found.get((owner, name, value)), 0) for value in horizons),
        )
        for owner, name in kept
    ]
    return Grid("RMS radial error by horizon, m", heads, table, caption)


def _owner_heads(names: tuple[str, ...]) -> tuple[Head, ...]:
    return (Head("Aircraft"),) if names else ()


def _owner(names: tuple[str, ...], aircraft: str) -> tuple[str, ...]:
    return (aircraft_name(aircraft),) if names else ()


def _in_detail(fleet: FleetResults, rows: list[FleetSkill]) -> Grid:
    names, table = parted(fleet), fleet.skill_flights
    shipped = set(zip(table.aircraft.tolist(), table.method.tolist(), strict=True))
    shipped |= {(WHOLE_FLEET, method) for method in table.method.tolist()}
    heads = (
        *_owner_heads(names),
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
    told: list[tuple[Cell, ...]] = [
        (
            *_owner(names, row.aircraft),
            *(method_title(row.method), f"{row.horizon_min:g}", number(row.flights, 0), number(row.starts, 0)),
            *(bounded(value, 0) for value in (row.rms_m, row.median_flight_rms_m, row.highest_flight_rms_m)),
            percent(row.coverage95),
            number(row.coverage_starts, 0) if is_number(row.coverage95) else "",
            f"{row.flights_within} of {row.flights_judged}" if row.flights_judged else "",
        )
        for row in rows
        if (row.aircraft, row.method) in shipped
    ]
    caption = (
        "Median and worst of the flights' own RMS. Outages of one flight overlap, so the band is judged over flights, "
        "each by its NEES where it has enough starts."
    )
    return Grid("The shipped method in detail", heads, told, caption)
