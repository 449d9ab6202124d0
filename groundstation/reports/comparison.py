"""Page of a comparison: the differences of two flights, and their figures over each other."""

from collections.abc import Sequence

from groundstation.base.failures import attempt
from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.parts import Section, kept
from groundstation.chapters.plots.comparison import COMPARED, PlottedSide, Tell, sides_of
from groundstation.reports.drawing import Drawing, drawing_of
from groundstation.reports.page import TEMPLATES, render
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.systems.system import Systems


def comparison_html(comparison: Comparison, a: SavedFlight, b: SavedFlight, systems: Systems) -> str:
    """Render the page of a comparison as a complete HTML document, without parts that fail."""
    sections = (
        attempt("chapter", "answers", answers, comparison),
        attempt("chapter", "figures", _figures, comparison, a, b, systems),
        attempt("chapter", "settings", settings, comparison),
        attempt("chapter", "findings", findings, comparison),
    )
    return render(
        "compare.html.j2",
        title=f"{comparison.a.flight_id} and {comparison.b.flight_id}",
        opening=opening(comparison),
        sections=[section for section in sections if section is not None],
        style=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
    )


def _figures(comparison: Comparison, a: SavedFlight, b: SavedFlight, systems: Systems) -> Section | None:
    """Return figures of both flights over each other, without those that fail."""
    sides = sides_of(comparison, a, b)
    every = (COMPARED, *(one.figures for one in systems.compared))
    parts = kept(attempt("figure", name, _drawn, tell, sides) for figures in every for name, tell in figures.items())
    return (
        Section("figures", "Figures", "A blue, B orange; the shade about a line is its 95 % band.", parts)
        if parts
        else None
    )


def _drawn(tell: Tell, sides: Sequence[PlottedSide]) -> Drawing | None:
    return drawing_of(tell(sides))
