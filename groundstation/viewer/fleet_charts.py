"""Charts of a fleet: figures of each aircraft by flight with their control limits, and the skill of the forecast."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.records import BoolArray, Int64Array
from groundstation.results.figures import numbers
from groundstation.results.fleet import FleetResults
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart
from groundstation.viewer.colours import Colour
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.names import clean_text, path_parts, words
from groundstation.viewer.recorder import Line
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import lanes, plot

UNNAMED = "aircraft not named"
VERDICTS: Final[dict[str, Colour]] = {
    "accept": colours.GREEN,
    "advisory": colours.YELLOW_GREEN,
    "reject": colours.VERMILION,
    "extend": colours.ORANGE,
    "undecided": colours.GREY,
    "not assessed": colours.DIM,
}
HEADING, RATE = "error_deg", "radial_error_rate_fit_nmiph"
TITLES = {HEADING: "Heading error ± 95 %, deg", RATE: "INS radial error rate, nmi/h"}
PATHS = {HEADING: "heading_error", RATE: "radial_error_rate"}
DOT, MARK, THIN = 3.5, 6.0, 1.0
MOST_IN_LEGEND = 8
MOST_AIRCRAFT = 40  # with a tab of their own


@dataclass(frozen=True)
class Aircraft:
    """One aircraft: its name as logged, its label, entity and colour."""

    name: str
    label: str
    entity: str
    colour: Colour


def aircraft_of(fleet: FleetResults) -> tuple[Aircraft, ...]:
    """The aircraft in order, each an entity of its own."""
    names = fleet.aircraft
    parts = path_parts(names)
    shades = colours.for_series(len(names))
    return tuple(
        Aircraft(name, clean_text(name) or UNNAMED, f"aircraft/{part}", shade)
        for name, part, shade in zip(names, parts, shades, strict=True)
    )


def log_aircraft(recorder: FleetRecorder, fleet: FleetResults, aircraft: Aircraft) -> list[str]:
    """Log the figures of an aircraft and its verdicts; names of the quantities it has."""
    flights = fleet.flights
    rows = recorder.order[(flights["aircraft"] == aircraft.name)[recorder.order]]
    places = recorder.numbers(flights["flight_id"][rows])
    states = [str(verdict) or "not assessed" for verdict in flights["verdict"][rows].tolist()]
    recorder.lane(f"{aircraft.entity}/verdict", places, states, VERDICTS)
    found = []
    for quantity, name in PATHS.items():
        values = numbers(flights, quantity)[rows]
        if not np.isfinite(values).any():
            continue
        found.append(quantity)
        path = f"{aircraft.entity}/{name}"
        line = Line(f"{aircraft.label}, {TITLES[quantity].rpartition(', ')[2]}", aircraft.colour, DOT)
        recorder.dots(f"{path}/flights", places, values, line)
        if quantity == HEADING:
            _interval(recorder, fleet, aircraft, rows, f"{path}/interval95")
        _control(recorder, fleet, aircraft, quantity, path)
    return found


def _interval(recorder: FleetRecorder, fleet: FleetResults, aircraft: Aircraft, rows: Int64Array, path: str) -> None:
    """Log the 95 % interval of the heading error, a filled band for each stretch between changes of level."""
    flights = fleet.flights
    places = recorder.numbers(flights["flight_id"][rows])
    ends = np.column_stack([numbers(flights, f"confidence95_{end}_deg")[rows] for end in ("low", "high")])
    name = f"{aircraft.label}, 95 %, deg"
    if len(places) == 1:  # a band of one flight is not seen
        recorder.points(path, places, ends, [Line(name, aircraft.colour, DOT)] * 2)
        return
    stretch = np.searchsorted(_firsts(recorder, fleet, aircraft, HEADING), places, side="right")
    for one in np.unique(stretch).tolist():
        mine = stretch == one
        middle, half = ends[mine].mean(axis=1), 0.5 * np.ptp(ends[mine], axis=1)
        recorder.band(f"{path}/{one}", places[mine], middle, half, Line(name, aircraft.colour, THIN))


def _firsts(recorder: FleetRecorder, fleet: FleetResults, aircraft: Aircraft, quantity: str) -> Int64Array:
    """Numbers of the flights at which a quantity of an aircraft has a new level, in order."""
    mine = [one.flight_id for one in fleet.change_points if (one.aircraft, one.quantity) == (aircraft.name, quantity)]
    return np.sort(recorder.numbers(np.array(mine, dtype=np.str_)))


def _interrupted(values: FloatArray, places: Int64Array, firsts: Int64Array) -> FloatArray:
    """Columns for every stretch between change points, NaN elsewhere: lines end where the level changes."""
    stretch = np.searchsorted(firsts, places, side="right")
    return np.column_stack([np.where((stretch == one)[:, None], values, np.nan) for one in range(len(firsts) + 1)])


def _control(recorder: FleetRecorder, fleet: FleetResults, aircraft: Aircraft, quantity: str, path: str) -> None:
    """Log level and control limits, interrupted at change points; the change points; the flights outside the limits."""
    trend = fleet.trend
    mine = (trend.aircraft == aircraft.name) & (trend.quantity == quantity)
    if not mine.any():
        return
    unit = TITLES[quantity].rpartition(", ")[2]
    places = recorder.numbers(trend.flight_id[mine])
    firsts = _firsts(recorder, fleet, aircraft, quantity)
    level, low, high = trend.level[mine], trend.low[mine], trend.high[mine]
    styles = [
        Line(f"level, {unit}", colours.LIGHT, THIN),
        Line(f"control limits, {unit}", colours.DIM, THIN),
        Line(f"control limits, {unit}", colours.DIM, THIN),
    ]
    pieces = _interrupted(np.column_stack([level, low, high]), places, firsts)
    recorder.lines(f"{path}/limits", places, pieces, styles * (len(firsts) + 1))
    outside = trend.is_outside[mine]
    if outside.any():
        line = Line(f"outside the limits, {unit}", colours.YELLOW, MARK)
        recorder.dots(f"{path}/outside", places[outside], trend.value[mine][outside], line)
    if len(firsts):
        line = Line(f"new level, {unit}", colours.VERMILION, MARK)
        recorder.dots(f"{path}/change", firsts, level[np.searchsorted(places, firsts)], line)


def over_time(found: Sequence[tuple[Aircraft, Sequence[str]]], quantity: str) -> list[rrb.View]:
    """The view of one quantity of several aircraft; none when no one has it."""
    having = [one for one, quantities in found if quantity in quantities]
    if not having:
        return []
    names = having[0].label if len(having) == 1 else "by aircraft"
    paths = [f"{one.entity}/{PATHS[quantity]}" for one in having]
    return [plot(f"{TITLES[quantity]}, {names}", paths, legend=len(having) <= MOST_IN_LEGEND)]


def verdicts(aircraft: Sequence[Aircraft]) -> rrb.View:
    """Lanes of the verdicts: each holds until the next flight of the aircraft."""
    return lanes("Verdict on the heading correction", [f"{one.entity}/verdict" for one in aircraft])


def skill_over_flights(recorder: FleetRecorder, fleet: FleetResults) -> list[rrb.View]:
    """Log the forecast skill of every flight, a series a horizon; the view."""
    found = fleet.skill_flights
    rms = found.rms_m
    if not np.isfinite(rms).any():
        return []
    ids, row_of = np.unique(recorder.numbers(found.flight_id), return_inverse=True)
    horizons, column_of = np.unique(found.horizon_min, return_inverse=True)
    table = np.full((len(ids), len(horizons)), np.nan)
    table[row_of, column_of] = rms
    shades = colours.for_series(len(horizons))
    series = [
        Line(f"after {horizon:g} min, m", shade, DOT) for horizon, shade in zip(horizons.tolist(), shades, strict=True)
    ]
    recorder.points("forecast/rms_by_flight", ids, table, series)
    return [plot("RMS radial error of the shipped forecast by flight, m", "forecast/rms_by_flight")]


def skill_by_horizon(recorder: FleetRecorder, fleet: FleetResults) -> list[rrb.View]:
    """Draw the skill of every method over all flights by horizon, both axes logarithmic."""
    curves: list[tuple[FloatArray, FloatArray, Line]] = []
    methods = list(dict.fromkeys(one.method for one in fleet.skill))
    for method, shade in zip(methods, colours.for_series(len(methods)), strict=True):
        mine = [one for one in fleet.skill if one.method == method and one.rms_m > 0.0]
        x, y = np.array([one.horizon_min for one in mine]), np.array([one.rms_m for one in mine])
        curves.append((x, y, Line(words(method), shade, 2.0)))
    x, y = (np.concatenate([one[axis] for one in curves] or [np.zeros(0)]) for axis in (0, 1))
    if len(x) < 2 or not _positive(x).all() or not _positive(y).all():
        return []
    chart = Chart(
        recorder,
        "forecast/rms_by_horizon",
        Axis("horizon, min", float(x.min()) / 1.1, float(x.max()) * 1.1, "log"),
        Axis("RMS radial error over all starts of all flights, m,", float(y.min()) / 1.3, float(y.max()) * 1.3, "log"),
    )
    chart.curves("methods", curves)
    chart.legend([line for _, _, line in curves])
    return [chart.view()]


def _positive(values: FloatArray) -> BoolArray:
    return np.isfinite(values) & (values > 0.0)
