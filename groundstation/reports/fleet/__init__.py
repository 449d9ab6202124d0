"""The figures of the fleet report, drawn where a chapter says one stands."""

from collections.abc import Callable

from groundstation.reports.drawing import Drawing
from groundstation.reports.fleet import aircraft, calibration, densities, deviation, installations, skill, trend
from groundstation.results.fleet import FleetResults

# By the name that a chapter gives; a figure that is one of several alike gets which.
DRAWERS: dict[str, Callable[[FleetResults], Drawing] | Callable[[FleetResults, str], Drawing | None]] = {
    "fleet.forest": aircraft.forest,
    "fleet.rates": aircraft.rates,
    "fleet.trend": trend.charts,
    "fleet.growth": skill.growth,
    "fleet.skill": skill.flights,
    "fleet.calibration": calibration.checks,
    "fleet.densities": densities.overlay,
    "fleet.densities_by_aircraft": densities.by_aircraft,
    "fleet.deviation": deviation.curves,
    "fleet.installation": installations.over_time,
}
