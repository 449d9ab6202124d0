"""Tab of an answer that has no tab of its own.

Its chapter, and its figures over time, one view per unit.
"""

import rerun.blueprint as rrb

from groundstation.chapters.by_answer import chapter_of
from groundstation.chapters.generic import SERIES, figures_over_time
from groundstation.chapters.markdown import markdown
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document


def generic_tab(recorder: Recorder, results: FlightResults, answer: Answer) -> rrb.Container:
    """Log the tab of any answer."""
    section, path = chapter_of(results, answer, recorder.systems.chapters), answer.analysis
    recorder.document(f"{path}/answer", markdown(section))
    text = document("What was found", f"{path}/answer")
    told = (plot_of(recorder, SERIES, results, name) for name in figures_over_time(results, path))
    plots = [view for one in told if one is not None for view in panels_of(recorder, one, of=one.title)]
    columns: list[rrb.View | rrb.Container] = [rrb.Vertical(contents=plots), text] if plots else [text]
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0][: len(columns)], name=section.title)
