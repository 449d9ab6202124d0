"""Figures of the report as matplotlib figures that a notebook shows, painted by the report's own code."""

import io
from typing import Any

from matplotlib.figure import Figure

from groundstation.reports.drawing import Drawing, Sketch, report_style, sketching
from groundstation.reports.flight_report import sketched_document
from groundstation.reports.frames import MM_PER_INCH
from groundstation.results.files import SavedFlight

SHOWN_DPI = 144  # sharp on screens of two pixels a point


class NotebookFigure(Figure):
    """A matplotlib figure that a notebook shows without pyplot, on white whatever the notebook's ground."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with report_style():
            self.savefig(buffer, format="png", dpi=SHOWN_DPI, facecolor=self.get_facecolor())
        return buffer.getvalue()


def sketches_of(saved: SavedFlight) -> dict[str, tuple[Drawing, Sketch]]:
    """Every figure of a flight's report by its key, in the order of the report, none painted yet."""
    with sketching() as sketches:
        document = sketched_document(saved)
    drawings = [part for section in document.sections for part in section.parts if isinstance(part, Drawing)]
    return {drawing.svg: (drawing, sketches[drawing.svg]) for drawing in drawings}


def figure_from(sketch: Sketch) -> Any:
    """Paint a sketch; the figure may be changed and saved like any other of matplotlib's."""
    with report_style():
        size = (sketch.width_mm / MM_PER_INCH, sketch.height_mm / MM_PER_INCH)
        figure = NotebookFigure(figsize=size, facecolor="white")
        sketch.paint(figure)
        figure.draw_without_rendering()  # ticks are made when first drawn, in the style of that moment
    return figure
