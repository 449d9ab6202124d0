"""Plots of the fleet report that show all flights; those of one system stand in its folder."""

from collections.abc import Callable

from groundstation.chapters.plots.fleet import aircraft, calibration, densities, installations, skill, trend
from groundstation.plots.plot import Plot
from groundstation.results.fleet import FleetResults

# By the name that a chapter gives; a plot that is one of several alike gets which.
FLEET_PLOTS: dict[str, Callable[[FleetResults], Plot] | Callable[[FleetResults, str], Plot | None]] = {
    "fleet.forest": aircraft.forest,
    "fleet.rates": aircraft.rates,
    "fleet.trend": trend.charts,
    "fleet.growth": skill.growth,
    "fleet.skill": skill.flights,
    "fleet.calibration": calibration.checks,
    "fleet.densities": densities.overlay,
    "fleet.densities_by_aircraft": densities.by_aircraft,
    "fleet.installation": installations.over_time,
}
