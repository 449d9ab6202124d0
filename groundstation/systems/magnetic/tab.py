"""Tab on magnetic deviation: by each method against heading, branches, errors, field.

Errors and field over time.
"""

import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.arrays import CorrectedHeadingRows
from groundstation.systems.magnetic.chapter import magnetic as chapter
from groundstation.systems.magnetic.field_tab import sphere
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.ground_answer import GroundDeviation
from groundstation.viewer import colours
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.views import document, plot

DOT = 1.6


def magnetic(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the magnetic deviation; None when the flight was not assessed.

    The overview says why.
    """
    section = chapter(results)
    if section is None or not any(results.answer(kind) for kind in (MagneticResult, GroundDeviation, FluxDeviation)):
        return None
    recorder.document("magnetic/answer", markdown(section))

    def views(*names: str) -> list[rrb.View]:
        return [view for name in names for view in panels_of(recorder, plot_of(recorder, name, results))]

    left = views("magnetic.deviation", "magnetic.branches", "magnetic.flux_legs", "magnetic.ground_runs")
    middle = [*views("magnetic.held_out", "magnetic.modulus", "magnetic.flux_turns"), *_applied(recorder, results)]
    right = [*sphere(recorder, results), *views("magnetic.track"), document("Verdict and card", "magnetic/answer")]
    columns = [rrb.Vertical(contents=column) for column in (left, middle, right) if column]
    return rrb.Horizontal(contents=columns, name="Magnetic")


def _applied(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Log the magnetic heading before and after a deviation was applied to the log."""
    figure = results.rows_of(CorrectedHeadingRows)
    if figure is None:
        return []
    time_ns = recorder.time_ns(figure.time_s)
    for title, values, shade in (
        ("uncorrected", figure.uncorrected_magnetic_heading_deg, colours.SAMPLES),
        ("corrected", figure.magnetic_heading_deg, colours.ANSWER),
    ):
        recorder.dots(f"magnetic/heading/{title}", time_ns, values, Line(f"{title}, deg", shade, DOT))
    title = "Magnetic heading, deg: as read grey, with the deviation applied green"
    return [plot(title, "magnetic/heading", legend=False)]
