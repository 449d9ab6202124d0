"""Parts: slopes of the charted quantities of aircraft, in sentences and in a table."""

import numpy as np

from groundstation.chapters.fleet.common import QUANTITIES, aircraft_name, bounded, day, figure_of, title_of
from groundstation.chapters.parts import Cell, Grid, Head, Mark
from groundstation.chapters.wording import ABSENT, number, plural
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_trends import SlopeRow

CAPTION = (
    "Flights since the last change of level, or all, six or more. Slope: median over all pairs of flights; in "
    "brackets 95 %, from the scatter of the flights. Level now: the line at the last flight. A slope is called where "
    "the flights show a change that a line explains as well as a step does. Limits: --unit-limits; of vibration and "
    "HDOP that from which the check warns; of the test ratio 1. The date continues the line."
)


def sloping(fleet: FleetResults) -> list[SlopeRow]:
    """Return the lines that are slopes."""
    return [one for one in fleet.slopes if one.is_slope]


def sentence_of(one: SlopeRow, fleet: FleetResults) -> str:
    """Return a slope as a sentence: how fast, how sure, since when, when it reaches its limit."""
    slope, low, high = (_slope(one, value) for value in one.per_flight)
    told = (
        f"{aircraft_name(one.aircraft)}: {title_of(one.quantity)} {_verb(one)} by {slope} a flight (95 % {low} … "
        f"{high}) over {plural(one.flights, 'flight')} since {_since(one, fleet)}, now "
        f"{figure_of(one.quantity, one.level)}"
    )
    due = _due(one)
    return f"{told}; {due}." if due else f"{told}."


def _since(one: SlopeRow, fleet: FleetResults) -> str:
    """Return the day from which on a line runs, and whether a step is there."""
    changes = ((change.aircraft, change.quantity, change.start_utc_ns) for change in fleet.change_points)
    step = "the last step, " if (one.aircraft, one.quantity, one.since_utc_ns) in changes else ""
    return f"{step}{_date(one.since_utc_ns)}"


def grid(fleet: FleetResults) -> Grid | None:
    """Return the table of lines, slopes first; None without any."""
    if not fleet.slopes:
        return None
    heads = (
        *(Head("Aircraft"), Head("Quantity"), Head("Flights", True), Head("Slope a flight", True)),
        *(Head("Level now", True), Head("State"), Head("Limit", True), Head("Reached on")),
    )
    order = sorted(fleet.slopes, key=lambda one: not one.is_slope)
    return Grid("Slopes since the last step", heads, [_row(one) for one in order], CAPTION)


def _row(one: SlopeRow) -> tuple[Cell, ...]:
    title, unit, places = QUANTITIES[one.quantity]
    slope, low, high = (_slope(one, value, has_unit=False) for value in one.per_flight)
    level, least, most = (bounded(value, places) for value in (one.level, one.level_low, one.level_high))
    state: Cell = Mark("bad", "beyond") if one.is_over else Mark("warn", _verb(one)) if one.is_slope else "no slope"
    due = ABSENT
    if one.due_utc_ns is not None:
        due = f"{_date(one.due_utc_ns)} ({_date(one.due_earliest_utc_ns)} … {_end(one)})"
    return (
        *(aircraft_name(one.aircraft), f"{title}, {unit}" if unit else title, number(one.flights, 0)),
        *(f"{slope} ({low} … {high})", f"{level} ({least} … {most})", state),
        *(ABSENT if one.limit is None else bounded(one.limit, places), due),
    )


def _limit(one: SlopeRow) -> str:
    return figure_of(one.quantity, one.limit).lstrip("+")


def _end(one: SlopeRow) -> str:
    return "no sure end" if one.due_latest_utc_ns is None else _date(one.due_latest_utc_ns)


def _slope(one: SlopeRow, value: float, *, has_unit: bool = True) -> str:
    """Return a slope in the unit of its quantity, with a decimal more."""
    _, unit, places = QUANTITIES[one.quantity]
    return bounded(value, max(places + 1, 3), unit if has_unit else "", signed=True)


def _verb(one: SlopeRow) -> str:
    return "rises" if one.slope_per_year > 0.0 else "falls"


def _due(one: SlopeRow) -> str:
    """Return when the limit is reached; empty without a limit."""
    if one.limit is None:
        return ""
    limit = _limit(one)
    if one.is_over:
        return f"beyond its limit of {limit}"
    if one.due_utc_ns is None:
        return f"does not reach {limit} in ten years"
    return f"reaches {limit} on {_date(one.due_utc_ns)} (95 % {_date(one.due_earliest_utc_ns)} … {_end(one)})"


def _date(time_ns: int | None) -> str:
    return ABSENT if time_ns is None else day(np.datetime64(time_ns, "ns"))
