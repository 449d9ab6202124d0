"""Plots of the fleet report; those of one system stand in its folder."""

from collections.abc import Callable

from groundstation.chapters.plots.fleet import trend
from groundstation.plots.plot import Plot
from groundstation.results.fleet import FleetResults

# By the name that a chapter gives; a plot that is one of several alike gets which.
FLEET_PLOTS: dict[str, Callable[[FleetResults], Plot] | Callable[[FleetResults, str], Plot | None]] = {
    "fleet.trend": trend.charts,
}
