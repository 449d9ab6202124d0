"""The figures of a report, drawn where a chapter says one stands."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from groundstation.base.failures import attempt
from groundstation.chapters.generic import SERIES as GENERIC_SERIES
from groundstation.chapters.parts import Figure, Part, Section
from groundstation.plots.plot import Plot
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures import (
    control,
    cooperative,
    forecast,
    generic,
    heading,
    inertial,
    landing,
    landing_beacons,
    landing_ranges,
    latency,
    magnetic,
    magnetic_ground,
    overview,
    placement,
    quality,
    reference,
    standstill,
    together,
)
from groundstation.reports.svg.picture import picture_of
from groundstation.results.flight import FlightResults

Drawn = Drawing | Plot | Sequence[Drawing | Plot] | None

# By the name that a chapter gives; a figure that is one of several alike gets which.
DRAWERS: dict[str, Callable[[FlightResults], Drawn] | Callable[[FlightResults, str], Drawn]] = {
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
    "magnetic.ground_runs": magnetic_ground.ground_runs,
    "landing.deviations": landing.deviations,
    "landing.final": landing.final,
    "landing.protection": landing.protection,
    "overview.track": overview.track_map,
    "overview.profile": overview.profile,
    "overview.attitude": overview.attitude,
    "overview.states": overview.states,
    "quality.gaps": quality.gaps,
    "reference.errors": reference.errors,
    "reference.track": reference.track,
    "reference.claims": reference.claims,
    "cooperative.map": cooperative.session_map,
    "cooperative.errors": cooperative.errors,
    "cooperative.geometry": cooperative.geometry,
    "cooperative.links": cooperative.links,
    "control.paths": control.paths,
    "control.measures": control.measures,
    "control.law": control.law,
    "placement.map": placement.accuracy_map,
    "placement.accuracy": placement.accuracy,
}


def with_drawings(section: Section, results: FlightResults) -> Section:
    """The section with its figures drawn; one whose arrays are missing is left out."""
    return drawn_by(DRAWERS, section, results)


def drawn_by(drawers: Mapping[str, Callable[..., Drawn]], section: Section, results: object) -> Section:
    """Section with its figures drawn by those who know their names, without those that fail."""
    parts: list[Part] = []
    for part in section.parts:
        if not isinstance(part, Figure):
            parts.append(part)
            continue
        name = ".".join(filter(None, (part.name, part.of)))
        found = attempt("figure", name, _drawings, drawers[part.name], results, *([part.of] if part.of else []))
        parts += [replace(one, name=name) for one in found or ()]
    return replace(section, parts=tuple(parts))


def _drawings(drawer: Callable[..., Drawn], *of: object) -> list[Drawing]:
    """What a drawer makes, each description of a plot as a picture."""
    drawn = drawer(*of)
    several = [drawn] if isinstance(drawn, Drawing | Plot) else drawn or ()
    return [drawing_of(one) if isinstance(one, Plot) else one for one in several]


def drawing_of(plot: Plot) -> Drawing:
    """The part of a report that shows a plot."""
    return Drawing(plot.title, plot.caption, plot.alt, picture_of(plot), plot.numbers, plot.name)
