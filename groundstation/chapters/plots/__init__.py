"""Plots of chapters: a figure is told once, as a description beside the chapter that mentions it."""

from collections.abc import Callable

from groundstation.chapters.generic import SERIES as GENERIC_SERIES
from groundstation.chapters.plots import (
    flight,
    forecast,
    generic,
    heading,
    inertial,
    landing,
    landing_beacons,
    landing_ranges,
    latency,
    magnetic,
    quality,
    reference,
    standstill,
    together,
)
from groundstation.plots.plot import Plot
from groundstation.results.flight import FlightResults

# By the name that a chapter gives; a figure that is one of several alike gets which.
PLOTS: dict[str, Callable[[FlightResults], Plot | None] | Callable[[FlightResults, str], Plot | None]] = {
    GENERIC_SERIES: generic.series,
    "heading.difference": heading.difference,
    "heading.density": heading.density,
    "heading.convergence": heading.convergence,
    "heading.taxi": heading.taxi,
    "heading.forest": heading.forest,
    "heading.spectrum": heading.spectrum,
    "standstill.components": standstill.components,
    "standstill.mean_speed": standstill.mean_speed,
    "forecast.growth": forecast.growth,
    "forecast.calibration": forecast.calibration,
    "forecast.hindcast_map": forecast.hindcast_map,
    "inertial.state": inertial.state,
    "inertial.tilt_and_drift": inertial.tilt_and_drift,
    "inertial.radial": inertial.radial,
    "inertial.innovations": inertial.innovations,
    "inertial.observability": inertial.observability,
    "inertial.differences": inertial.differences,
    "inertial.own_innovations": inertial.own_innovations,
    "landing_beacons.deviations": landing_beacons.deviations,
    "landing_ranges.space": landing_ranges.space,
    "landing_ranges.accuracy": landing_ranges.accuracy,
    "landing_ranges.trials": landing_ranges.trials,
    "latency.search": latency.search,
    "together.motion": together.motion,
    "magnetic.deviation": magnetic.deviation,
    "magnetic.held_out": magnetic.held_out,
    "magnetic.track": magnetic.track,
    "magnetic.branches": magnetic.branches,
    "magnetic.modulus": magnetic.modulus,
    "magnetic.ground_runs": magnetic.ground_runs,
    "landing.deviations": landing.deviations,
    "landing.final": landing.final,
    "landing.protection": landing.protection,
    "overview.track": flight.track_map,
    "overview.profile": flight.profile,
    "overview.attitude": flight.attitude,
    "overview.states": flight.states,
    "quality.gaps": quality.gaps,
    "reference.errors": reference.errors,
    "reference.track": reference.track,
    "reference.claims": reference.claims,
}
