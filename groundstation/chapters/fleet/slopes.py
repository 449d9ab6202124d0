"""Parts: slopes of the charted quantities of aircraft, in sentences and in a table."""

import numpy as np

from groundstation.chapters.fleet.common import aircraft_name, day, figure_of, title_of
from groundstation.chapters.parts import Cell, Grid, Head, Mark
from groundstation.chapters.wording import ABSENT, number
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_trends import SlopeRow

CAPTION = (
    "Flights since the last change of level, six or more. Slope: median over all pairs of flights; in brackets 95 %, "
    "from the scatter of the flights. Level now: the line at the last flight. A slope is called where the flights "
    "show a change that a line explains as well as a step does. Limits: --unit-limits; of the test ratio 1. The date "
    "continues the line."
)


def sloping(fleet: FleetResults) -> list[SlopeRow]:
    """Return the lines that are slopes."""
    return [one for one in fleet.slopes if one.is_slope]


def sentence_of(one: SlopeRow) -> str:
    """Return a slope as a sentence: how fast, how sure, since when, when it reaches its limit."""
    slope, low, high = (figure_of(one.quantity, value) for value in one.per_flight)
    told = (
        f"{aircraft_name(one.aircraft)}: {title_of(one.quantity)} {_verb(one)} by {slope} a flight (95 % {low} … "
        f"{high}) over {number(one.flights, 0)} flights since {_date(one.since_utc_ns)}, now "
        f"{figure_of(one.quantity, one.level)}"
    )
    due = _due(one)
    return f"{told}; {due}." if due else f"{told}."


def grid(fleet: FleetResults) -> Grid | None:
    """Return the table of lines, slopes first; None without any."""
    if not fleet.slopes:
        return None
    heads = (
        *(Head("Aircraft"), Head("Quantity"), Head("Flights", True), Head("From"), Head("Slope a flight", True)),
        *(Head("95 %", True), Head("a year", True), Head("Level now", True), Head("95 %", True), Head("Outlook")),
    )
    order = sorted(fleet.slopes, key=lambda one: not one.is_slope)
    return Grid("Slopes", heads, [_row(one) for one in order], CAPTION)


def _row(one: SlopeRow) -> tuple[Cell, ...]:
    slope, low, high = (figure_of(one.quantity, value) for value in one.per_flight)
    levels = (figure_of(one.quantity, value) for value in (one.level_low, one.level_high))
    outlook: Cell = "no slope is shown"
    if one.is_slope or one.is_over:
        text = _due(one) or _verb(one)
        outlook = Mark("bad" if one.is_over else "warn", text)
    return (
        *(aircraft_name(one.aircraft), title_of(one.quantity), number(one.flights, 0), _date(one.since_utc_ns)),
        *(slope, f"{low} … {high}", figure_of(one.quantity, one.slope_per_year)),
        *(figure_of(one.quantity, one.level), " … ".join(levels), outlook),
    )


def _verb(one: SlopeRow) -> str:
    return "rises" if one.slope_per_year > 0.0 else "falls"


def _due(one: SlopeRow) -> str:
    """Return when the limit is reached; empty without a limit."""
    if one.limit is None:
        return ""
    limit = figure_of(one.quantity, one.limit).lstrip("+")
    if one.is_over:
        return f"beyond its limit of {limit}"
    if one.due_utc_ns is None:
        return f"does not reach {limit} in ten years"
    end = "no sure end" if one.due_latest_utc_ns is None else _date(one.due_latest_utc_ns)
    return f"reaches {limit} on {_date(one.due_utc_ns)} (95 % {_date(one.due_earliest_utc_ns)} … {end})"


def _date(time_ns: int | None) -> str:
    return ABSENT if time_ns is None else day(np.datetime64(time_ns, "ns"))
