"""A simulated approach by beacons, and the site that goes with it."""

from dataclasses import replace
from functools import cache
from typing import Any

from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.landing_aids import RunwayPlaces, runway_places
from groundstation.simulation.scenario import Scenario, load_scenario
from groundstation.systems.known import Beacon, Known, Runway, SiteData
from groundstation.tables.phases import flight_phases

BEACONS = (Beacon("outer", 4000.0), Beacon("inner", 1000.0), Beacon("side", 0.0, 500.0))


def approach_scenario(**changes: Any) -> Scenario:
    """The shipped approach; ``changes`` are of its direction finder, its radio altimeter or itself."""
    scenario = load_scenario("approach-beacons")
    assert scenario.adf is not None
    assert scenario.radio_altimeter is not None
    adf = {name: value for name, value in changes.items() if hasattr(scenario.adf, name)}
    radio = {name: value for name, value in changes.items() if name == "rise_m_per_km"}
    return replace(
        scenario, adf=replace(scenario.adf, **adf), radio_altimeter=replace(scenario.radio_altimeter, **radio)
    )


@cache
def flown(scenario: Scenario) -> tuple[Simulated, RunwayPlaces]:
    """A flight, and its places about the runway."""
    simulated = simulate(scenario)
    return simulated, runway_places(simulated.trajectory, scenario.runway)


def known_of(simulated: Simulated, places: RunwayPlaces, beacons: tuple[Beacon, ...] = BEACONS) -> Known:
    """What an analysis may know: phases, and the site."""
    site = SiteData(runways=(Runway("06", places.course_deg),), beacons=beacons)
    return Known(flight_phases(simulated.flight), site=site)
