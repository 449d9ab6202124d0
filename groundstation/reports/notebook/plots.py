"""Plots of a flight's report, by the names that notebooks use."""

from groundstation.base.failures import attempt
from groundstation.chapters.generic import SERIES as GENERIC_SERIES
from groundstation.chapters.parts import Figure
from groundstation.plots.plot import Plot
from groundstation.reports.drawing import plot_of
from groundstation.reports.sections import told_sections
from groundstation.results.files import SavedFlight
from groundstation.systems.system import Systems

# As System.notebook_names, for the chapters of every flight.
NAMES = {"overview": "", "overview.track": "map", "quality": "", GENERIC_SERIES: "series"}


def plots_of(saved: SavedFlight, systems: Systems) -> dict[str, Plot]:
    """Every plot of a flight's report by its name, in the order of the report."""
    sections = (section for part in told_sections(saved, systems) for section in part)
    figures = [part for section in sections for part in section.parts if isinstance(part, Figure)]
    return {name_of(one, systems): plot for one in figures if (plot := _told(one, saved, systems)) is not None}


def name_of(figure: Figure, systems: Systems) -> str:
    """Return the name of a figure, and which of several alike it is.

    Examples
    --------
    >>> from groundstation.systems.system import System
    >>> own = Systems((System("wind", notebook_names={"wind.speed": "wind"}),))
    >>> [name_of(Figure(*of), own) for of in (("overview.track",), ("wind.speed", "north"), ("wind.gust_rows",))]
    ['map', 'wind-north', 'wind-gust-rows']
    """
    names = dict(NAMES)
    for system in systems.every:
        names |= system.notebook_names
    chapter, _, rest = figure.name.partition(".")
    usual = "-".join(filter(None, (names.get(chapter, chapter), rest))).replace("_", "-")
    return "-".join(filter(None, (names.get(figure.name, usual), figure.of.replace(" ", "-"))))


def _told(figure: Figure, saved: SavedFlight, systems: Systems) -> Plot | None:
    return attempt("figure", figure.full_name, plot_of, systems.plots, figure, saved.results)
