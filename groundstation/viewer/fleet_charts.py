"""Charts of a fleet by flight number: the plots of its page, and verdict lanes."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import rerun.blueprint as rrb

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import capitalised
from groundstation.chapters.fleet.common import title_of
from groundstation.chapters.fleet.trend import QUANTITIES
from groundstation.chapters.plots.fleet.trend import HEADING, POSITIVE, chart
from groundstation.plots.marks import Curve, Role, series
from groundstation.plots.plot import Axis, Panel
from groundstation.results.fleet import FleetResults
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.names import clean_text, path_parts
from groundstation.viewer.plot_views import over_time
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
PATHS = {HEADING: "heading_error", POSITIVE: "radial_error_rate"}
BY_NUMBER = Axis("number of the flight")
MOST_IN_LEGEND = 8
MOST_AIRCRAFT = 40  # with a tab of their own


@dataclass(frozen=True)
class ChartedAircraft:
    """One aircraft: its name as logged, its label, its entity, and the role of its flights."""

    name: str
    label: str
    entity: str
    role: Role


def aircraft_of(fleet: FleetResults) -> tuple[ChartedAircraft, ...]:
    """The aircraft in order, each an entity of its own."""
    names = fleet.aircraft
    return tuple(
        ChartedAircraft(name, clean_text(name) or UNNAMED, f"aircraft/{part}", series(place))
        for place, (name, part) in enumerate(zip(names, path_parts(names), strict=True))
    )


def is_judged(fleet: FleetResults, aircraft: ChartedAircraft) -> bool:
    """Tell whether any flight of an aircraft has a verdict on its heading."""
    flights = fleet.flights
    return bool((flights["verdict"][flights["aircraft"] == aircraft.name] != "").any())


def log_aircraft(recorder: FleetRecorder, fleet: FleetResults, aircraft: ChartedAircraft) -> dict[str, rrb.View]:
    """Log the figures of an aircraft and its verdicts; the views of the quantities it has."""
    flights = fleet.flights
    rows = recorder.order[(flights["aircraft"] == aircraft.name)[recorder.order]]
    states = [str(verdict) or "not assessed" for verdict in flights["verdict"][rows].tolist()]
    if is_judged(fleet, aircraft):
        recorder.lane(f"{aircraft.entity}/verdict", recorder.numbers(flights["flight_id"][rows]), states, VERDICTS)
    views = {}
    for quantity, name in PATHS.items():
        told = chart(fleet, quantity, aircraft.name, BY_NUMBER, recorder.places, aircraft.label, aircraft.role)
        if told is not None:
            views[quantity] = over_time(recorder, f"{aircraft.entity}/{name}", _alone(told), _title(quantity))
    return views


def _alone(told: Panel) -> Panel:
    """Return the chart of an aircraft for its own page.

    Without a level, the axis holds its intervals too.
    """
    has_level = any(isinstance(mark, Curve) for mark in told.marks)
    return replace(told, legend="", y=told.y if has_level else replace(told.y, low=None, high=None))


def _title(quantity: str) -> str:
    title, unit = title_of(quantity), QUANTITIES[quantity].rpartition(", ")[2]
    return f"{capitalised(title)}, {unit}"


def by_aircraft(having: Sequence[ChartedAircraft], quantity: str) -> list[rrb.View]:
    """The view of one quantity of all aircraft that have it; none when no one has it."""
    if not having:
        return []
    paths = [f"{one.entity}/{PATHS[quantity]}" for one in having]
    return [plot(_title(quantity), paths, legend=len(having) <= MOST_IN_LEGEND)]


def verdicts(aircraft: Sequence[ChartedAircraft]) -> rrb.View:
    """Lanes of the verdicts: each holds until the next flight of the aircraft."""
    return lanes("Verdict on the heading correction", [f"{one.entity}/verdict" for one in aircraft])
