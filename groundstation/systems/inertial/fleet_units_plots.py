"""Plot: rate of each INS unit over dates, with trend, moves and changes."""

from dataclasses import replace

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.chapters.fleet.common import aircraft_name
from groundstation.chapters.plots.common import label
from groundstation.chapters.plots.fleet.common import Places, date_axis, seconds_of
from groundstation.chapters.wording import plural
from groundstation.plots.marks import AnyMark, Band, Bars, Curve, Dots, Floats, Limit
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_units import RATE, FleetUnitFlights, FleetUnitRow
from groundstation.systems.inertial.fleet_units_chapter import serial_name, shown

MOST_PANELS = 8
PANEL_MM = 26.0
Y_TITLE = "rate, nmi/h"
FAR = 2.5  # a limit further away than so many times the largest rate is not drawn


def over_dates(fleet: FleetResults) -> Plot | None:
    """Return the rate of every flight of each unit over dates; None without one."""
    rows = shown(fleet, MOST_PANELS)
    if not rows:
        return None
    known = _counted(fleet.unit_flights)
    ends = [one.due_utc_ns for one in rows if one.due_utc_ns is not None]
    times = np.concatenate([fleet.unit_flights.start_utc[known], np.array(ends, dtype="datetime64[ns]")])
    dates = date_axis(times)
    seconds = dict(
        zip(fleet.unit_flights.flight_id.tolist(), seconds_of(fleet.unit_flights.start_utc).tolist(), strict=True)
    )

    def places(ids: "np.ndarray[tuple[int, ...], np.dtype[np.str_]]") -> Floats:
        return np.array([seconds.get(one, np.nan) for one in ids.tolist()], dtype=np.float64)

    panels = []
    for one in rows:
        told = chart(fleet, one, dates, places)
        ahead = _ahead(one)
        marks = (*told.marks, *ahead)
        panels.append(replace(told, marks=marks, legend="above" if one is rows[0] else ""))
    total = sum(one.counted > 0 for one in fleet.units)
    more = f" {len(rows)} of {total} units: those to calibrate first." if len(rows) < total else ""
    return Plot(
        "fleet.units",
        "Rate of each unit over time",
        "A dot for each flight, with the 95 % interval of its measurement where it has one; line and band: trend since "
        "the last change with its 95 % interval; dotted: the unit flies in another aircraft; c: a change of level; "
        f"dashed: the limit.{more}",
        "Radial error rate of each INS unit by serial over dates, with trend, moves, changes and limit.",
        tuple(Row((panel,), PANEL_MM, shares_x=panel is not panels[-1]) for panel in panels),
    )


def chart(fleet: FleetResults, one: FleetUnitRow, x: Axis, places: Places) -> Panel:
    """Describe the flights of a unit, its trend, its moves and its changes.

    Parameters
    ----------
    fleet : FleetResults
    one : FleetUnitRow
    x : Axis
    places : callable
        Places of flights along it, by their ids.
    """
    table = fleet.unit_flights.where(_counted(fleet.unit_flights) & (fleet.unit_flights.ins_serial == one.ins_serial))
    at = places(table.flight_id)
    order = np.argsort(at, kind="stable")
    table, at = table.where(order), at[order]
    marks: list[AnyMark] = []
    moved = 0
    for event in fleet.unit_events:
        if event.ins_serial != one.ins_serial or not event.flight_id:
            continue
        place = float(places(np.array([event.flight_id], dtype=np.str_))[0])
        if event.kind == "moved":
            moved += 1
            text = f" {label(aircraft_name(event.aircraft), 12)}"
            marks.append(Limit(value=place, is_upright=True, role="faint", dash="dotted", label=text))
        elif event.kind == "changed" and event.quantity == RATE:
            marks.append(Limit(value=place, is_upright=True, role="bad", dash="dashed", emphasis="thin", label=" c"))
    has_line = np.isfinite(table.line_nmiph)
    if has_line.any():
        line = table.where(has_line)
        marks.append(
            Band(
                x=at[has_line],
                low=np.maximum(line.line_low_nmiph, 0.0),
                high=line.line_high_nmiph,
                role="answer",
                name="trend, 95 %",
                emphasis="faint",
            )
        )
        marks.append(Curve(x=at[has_line], y=line.line_nmiph, role="answer", name="trend"))
    has_half = np.isfinite(table.rate_nmiph_half95)
    if has_half.any():
        own = table.where(has_half)
        marks.append(
            Bars(x=at[has_half], y=own.rate_nmiph, half=own.rate_nmiph_half95, role="ins", name="flight, 95 %")
        )
    marks.append(Dots(x=at, y=table.rate_nmiph, role="ins", name="flight", emphasis="bold"))
    highest = float(np.max(table.rate_nmiph)) if len(table) else 1.0
    if one.limit_nmiph is not None and one.limit_nmiph <= FAR * highest:
        marks.append(Limit(value=one.limit_nmiph, role="limit", name="limit"))
        highest = max(highest, one.limit_nmiph)
    title = f"{label(serial_name(one.ins_serial), 24)}, {plural(one.counted, 'flight')}"
    return Panel(marks, x, Axis(Y_TITLE, low=0.0, high=1.15 * highest), title=title)


def _ahead(one: FleetUnitRow) -> list[AnyMark]:
    """Return the trend from the last flight to the day on which it reaches the limit."""
    if one.outlook != "due" or one.due_utc_ns is None or one.last_utc_ns is None:
        return []
    if one.rate_nmiph is None or one.limit_nmiph is None:
        return []
    ends = np.array([one.last_utc_ns, one.due_utc_ns], dtype=np.float64) / NS_PER_S
    return [Curve(x=ends, y=np.array([one.rate_nmiph, one.limit_nmiph]), role="answer", dash="dashed")]


def _counted(table: FleetUnitFlights) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
    known = np.isfinite(table.rate_nmiph) & (table.reason == "") & (table.why_undated == "")
    return np.asarray(known & (table.ins_serial != ""))
