"""Page of a comparison: the differences of two flights, and their figures over each other."""

from collections.abc import Callable, Sequence

from groundstation.base.failures import attempt
from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.parts import Section, kept
from groundstation.chapters.plots.comparison import COMPARED, Side
from groundstation.plots.plot import Plot
from groundstation.reports.drawing import Drawing, drawing_of
from groundstation.reports.page import TEMPLATES, render
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.results.forecast import ForecastResult


def comparison_html(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> str:
    """Render the page of a comparison as a complete HTML document, without parts that fail."""
    sections = (
        attempt("chapter", "answers", answers, comparison),
        attempt("chapter", "figures", _figures, comparison, a, b),
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


def _figures(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> Section | None:
    """Return figures of both flights over each other, without those that fail."""
    sides = (
        Side("A", a, _default_method(a)),
        Side("B", b, _default_method(b), comparison.alignment.offset_s),
    )
    parts = kept(attempt("figure", name, _drawn, tell, sides) for name, tell in COMPARED.items())
    return Section("figures", "Figures", "A blue, B orange; thin lines are 95 % bands.", parts) if parts else None


def _drawn(tell: Callable[[Sequence[Side]], Plot | None], sides: Sequence[Side]) -> Drawing | None:
    return drawing_of(tell(sides))


def _default_method(saved: SavedFlight) -> str:
    forecast = saved.results.answer(ForecastResult)
    return "" if forecast is None else forecast.default_method
