"""Plots of a flight's report, by the names that notebooks use."""

from groundstation.base.failures import attempt
from groundstation.chapters.generic import SERIES as GENERIC_SERIES
from groundstation.chapters.parts import Figure
from groundstation.plots.plot import Plot
from groundstation.reports.drawing import plot_of
from groundstation.reports.sections import told_sections
from groundstation.results.files import SavedFlight
from groundstation.systems.system import Systems

# Scripts rely on these: names that are not the chapter's with hyphens, and chapters that their names leave out.
NAMES = {
    "forecast.hindcast_map": "map-hindcast",
    "inertial.state": "inertial",
    "inertial.tilt_and_drift": "inertial-tilt",
    "landing_beacons.deviations": "landing-beacons",
    "landing_ranges.accuracy": "landing-accuracy",
    "landing_ranges.space": "landing-space",
    "landing_ranges.trials": "landing-trials",
    "magnetic.ground_runs": "magnetic-ground",
    "overview.track": "map",
    "reference.errors": "reference",
    "together.motion": "together",
    GENERIC_SERIES: "series",
}
LEFT_OUT = {"forecast", "heading", "overview", "quality", "standstill"}


def plots_of(saved: SavedFlight, systems: Systems) -> dict[str, Plot]:
    """Every plot of a flight's report by its name, in the order of the report."""
    sections = (section for part in told_sections(saved, systems) for section in part)
    figures = [part for section in sections for part in section.parts if isinstance(part, Figure)]
    return {name_of(one): plot for one in figures if (plot := _told(one, saved, systems)) is not None}


def name_of(figure: Figure) -> str:
    """Return the name of a figure, and which of several alike it is.

    Examples
    --------
    >>> [name_of(Figure(*of)) for of in (("heading.density",), ("overview.track",), ("inertial.state", "position"))]
    ['density', 'map', 'inertial-position']
    """
    chapter, _, rest = figure.name.partition(".")
    usual = (rest if chapter in LEFT_OUT else f"{chapter}-{rest}").replace("_", "-")
    return "-".join(filter(None, (NAMES.get(figure.name, usual), figure.of.replace(" ", "-"))))


def _told(figure: Figure, saved: SavedFlight, systems: Systems) -> Plot | None:
    return attempt("figure", figure.full_name, plot_of, systems.plots, figure, saved.results)
