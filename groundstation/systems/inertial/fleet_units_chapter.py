"""Chapter: every INS by its serial, where it sat, how it changes, when to calibrate it."""

from collections import Counter

import numpy as np

from groundstation.chapters.fleet.chapter import KeyFigure
from groundstation.chapters.fleet.common import aircraft_name, bounded, day
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, clean, is_number, number, plural
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_units import RATE, UNIT_FIGURES, FleetUnitRow, UnitEventRow, UnitTrendRow

TITLE = "INS units by serial"
LEAD = (
    "How each INS errs over time, in whatever aircraft it sat: the rate of every flight, its trend since the last "
    "change, and the day on which the trend reaches the limit."
)
URGENT = ("over", "may_be_over", "due")
EVENTS = {
    "moved": "moved",
    "replaced": "replaced",
    "changed": "changed level",
    "gap": "did not fly",
    "two_aircraft": "two aircraft",
    "clock": "clock not set",
    "spelled_alike": "spelled alike",
}
DOUBTS = ("two_aircraft", "clock", "spelled_alike")
LIMIT_BY = {"stated": "stated"}  # every other is that of a class
LONGEST = 28  # characters of a serial


def build(fleet: FleetResults) -> Section | None:
    """Build the chapter; None where no flight states the serial of an INS."""
    if not fleet.units:
        return None
    parts: list[Part] = [*_notes(fleet), _table(fleet)]
    if any(one.counted for one in fleet.units):
        parts.append(Figure("fleet.units"))
    parts += [one for one in (_figures(fleet), _events(fleet)) if one is not None]
    return Section("units", TITLE, LEAD, tuple(parts))


def figures(fleet: FleetResults) -> tuple[KeyFigure, ...]:
    """Return how many units are due, or over their limit."""
    urgent = [one for one in fleet.units if one.outlook in URGENT]
    if not urgent:
        return ()
    over = sum(one.outlook != "due" for one in urgent)
    remark = f"of {plural(len(fleet.units), 'unit')}; {number(over, 0)} at or over the limit now"
    return (("INS to calibrate", number(len(urgent), 0), remark),)


def shown(fleet: FleetResults, most: int) -> list[FleetUnitRow]:
    """Return units for a figure: those to calibrate, then those with most flights."""
    known = [one for one in fleet.units if one.counted]
    order = sorted(known, key=lambda one: (one.outlook not in URGENT, -one.counted, one.place))
    return sorted(order[:most], key=lambda one: one.place)


def serial_name(serial: str) -> str:
    """Return a serial for people, shortened where very long."""
    name = clean(serial)
    return name if len(name) <= LONGEST else name[: LONGEST - 1] + "…"


def _notes(fleet: FleetResults) -> list[Part]:
    table = fleet.unit_flights
    parts: list[Part] = []
    if without := len(set(table.flight_id[table.ins_serial == ""].tolist())):
        told, are = plural(without, "flight states", "flights state"), "it is" if without == 1 else "they are"
        parts.append(Note(f"{told} no serial of an INS: {are} in no history.", "unknown"))
    has_serial = table.ins_serial != ""
    reasons = Counter(one for one in table.reason[has_serial].tolist() if one)
    if reasons:
        told = "; ".join(f"{number(count, 0)}: {clean(reason)}" for reason, count in reasons.most_common(5))
        parts.append(Note(f"{plural(sum(reasons.values()), 'record')} without a rate that counts. {told}."))
    undated = int(np.sum(has_serial & (table.why_undated != "")))
    if undated:
        told = plural(undated, "record has", "records have")
        parts.append(Note(f"{told} no date that can be believed: in no trend.", "warn"))
    return parts


def _table(fleet: FleetResults) -> Grid:
    heads = (
        *(Head("Serial"), Head("Aircraft"), Head("Outlook"), Head("Flights", True)),
        *(Head("Rate now, nmi/h", True), Head("per year", True), Head("Limit", True)),
    )
    rows = [_row(one) for one in fleet.units]
    caption = (
        "Flights: those with a rate that counts. Rate now: the line at the last flight, by the median of all pairs of "
        "flights since the last change; without an interval the median of the flights. In brackets 95 %, from the "
        "scatter between flights. A limit of the class is what an honest unit exceeds in one of 250 flights of that "
        "length; --unit-limits states your own."
    )
    return Grid("Units", heads, rows, caption)


def _row(one: FleetUnitRow) -> tuple[Cell, ...]:
    limit = (
        ABSENT if one.limit_nmiph is None else f"{bounded(one.limit_nmiph, 2)}, {LIMIT_BY.get(one.limit_by, 'class')}"
    )
    rate, slope = bounded(one.rate_nmiph, 2), bounded(one.slope_nmiph_per_year, 2, signed=True)
    slopes = _span(one.slope_low_nmiph_per_year, one.slope_high_nmiph_per_year, 2, signed=True)
    return (
        *(serial_name(one.ins_serial), _aircraft(one), _mark(one.outlook, clean(one.text))),
        f"{number(one.counted, 0)} of {number(one.flights, 0)}",
        f"{rate} ({_span(one.rate_low_nmiph, one.rate_high_nmiph, 2)})" if is_number(one.rate_low_nmiph) else rate,
        f"{slope} ({slopes})" if is_number(one.slope_nmiph_per_year) else slope,
        limit,
    )


def _mark(outlook: str, text: str) -> Cell:
    if outlook == "over":
        return Mark("bad", text)
    if outlook in URGENT:
        return Mark("warn", text)
    return Mark("good", text) if outlook == "steady" else text


def _aircraft(one: FleetUnitRow) -> str:
    names = one.aircraft.split(", ") if one.aircraft else [""]
    return " → ".join(aircraft_name(name, 16) for name in names)


def _span(low: float | None, high: float | None, places: int, *, signed: bool = False) -> str:
    if not (is_number(low) and is_number(high)):
        return ABSENT
    return f"{bounded(low, places, signed=signed)} … {bounded(high, places, signed=signed)}"


def _figures(fleet: FleetResults) -> Grid | None:
    """Return tilt, azimuth and drifts of each unit over time."""
    rows = [_figure(one) for one in fleet.unit_trends if one.quantity != RATE]
    if not rows:
        return None
    heads = (
        *(Head("Serial"), Head("Figure"), Head("Flights", True), Head("Now", True), Head("95 %", True)),
        *(Head("per year", True), Head("95 %", True), Head("Between flights", True), Head("Changes", True)),
    )
    caption = (
        "Since the last change. Tilt: its size at the start of navigation, by the Schuler wave of the first period; "
        "drifts: only of flights that show them, in the channels north and east, so routes move them too."
    )
    return Grid("Other figures of the units", heads, rows, caption)


def _figure(one: UnitTrendRow) -> tuple[Cell, ...]:
    title, unit, places, is_positive = UNIT_FIGURES[one.quantity]
    signed, low = not is_positive, one.level_low
    low = max(low, 0.0) if is_positive and low is not None else low
    return (
        *(serial_name(one.ins_serial), f"{title}, {unit}", number(one.flights, 0)),
        bounded(one.level, places, signed=signed),
        _span(low, one.level_high, places, signed=signed),
        bounded(one.slope_per_year, places, signed=True),
        _span(one.slope_low_per_year, one.slope_high_per_year, places, signed=True),
        bounded(one.scatter, places),
        number(one.changes, 0),
    )


def _events(fleet: FleetResults) -> Grid | None:
    if not fleet.unit_events:
        return None
    rows = [_event(one) for one in fleet.unit_events]
    heads = (Head("Serial"), Head("Day"), Head("What"), Head("In words"), Head("Flight"))
    caption = (
        "Moves and replacements by the serials that the flights state: the unit was moved between the two days. A "
        "change of level is found in 1 % of steady series."
    )
    return Grid("What happened to the units", heads, rows, caption)


def _event(one: UnitEventRow) -> tuple[Cell, ...]:
    what = EVENTS[one.kind]
    return (
        serial_name(one.ins_serial),
        ABSENT if one.start_utc_ns is None else day(np.datetime64(one.start_utc_ns, "ns")),
        Mark("warn", what) if one.kind in DOUBTS else what,
        clean(one.text),
        one.flight_id or ABSENT,
    )
