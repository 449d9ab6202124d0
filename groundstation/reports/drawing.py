"""Plots of a report as pictures, with the panels that a page draws live over them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.failures import attempt
from groundstation.chapters.parts import Figure, Part, Section, kept
from groundstation.plots.plot import Plot
from groundstation.reports.live import Svg
from groundstation.reports.svg.picture import picture_of


@dataclass(frozen=True)
class Drawing(Part):
    """One figure.

    Parameters
    ----------
    title, caption, alt : str
        The caption says what one sees, how many samples, what the lines are; alt is for those who cannot see it.
    svg : Svg
        The only text that the page passes on unescaped: made by reports.svg alone.
    numbers : sequence of str
        Names of the figure data; the readable copies are tables/<name>.csv.
    name : str
        What the chapter calls the figure.
    """

    kind: ClassVar[str] = "drawing"
    title: str
    caption: str
    alt: str
    svg: Svg
    numbers: Sequence[str] = ()
    name: str = ""


def plot_of(plots: Mapping[str, Callable[..., Plot | None]], figure: Figure, results: object) -> Plot | None:
    """Return the plot of a figure of a chapter; None where there is nothing to show."""
    return plots[figure.name](results, *((figure.of,) if figure.of else ()))


def drawing_of(plot: Plot | None, name: str = "") -> Drawing | None:
    """Return the part of a report that shows a plot, by its name or another; None without one."""
    if plot is None:
        return None
    return Drawing(plot.title, plot.caption, plot.alt, picture_of(plot), plot.numbers, name or plot.name)


def drawn_by(plots: Mapping[str, Callable[..., Plot | None]], section: Section, results: object) -> Section:
    """Return a section with the plots of its figures drawn.

    Plots that fail or have nothing to show are left out.
    """
    return replace(section, parts=kept(_drawn(plots, part, results) for part in section.parts))


def _drawn(plots: Mapping[str, Callable[..., Plot | None]], part: Part, results: object) -> Part | None:
    """Return a figure as a drawing, by its name in the chapter; any other part as it is."""
    if not isinstance(part, Figure):
        return part
    name = part.full_name
    return attempt("figure", name, lambda: drawing_of(plot_of(plots, part, results), name))
