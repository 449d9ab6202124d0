"""Tab of an answer that has none of its own: what its chapter tells, and its figures over time, one view per unit."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.by_answer import chapter_of
from groundstation.chapters.generic import columns_by_unit, figures_over_time, quantity, titled
from groundstation.chapters.markdown import markdown
from groundstation.results.answer import Answer
from groundstation.results.figures import numbers
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.names import label, path_parts
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after
from groundstation.viewer.views import document, plot


def generic_tab(recorder: Recorder, results: FlightResults, answer: Answer) -> rrb.Container:
    """Log the tab of any answer."""
    section, path = chapter_of(results, answer), answer.analysis
    recorder.document(f"{path}/answer", markdown(section))
    text = document("What was found", f"{path}/answer")
    plots = [view for name in figures_over_time(results, path) for view in _plots(recorder, results, path, name)]
    columns: list[rrb.View | rrb.Container] = [rrb.Vertical(contents=plots), text] if plots else [text]
    return rrb.Horizontal(contents=columns, column_shares=[3.0, 2.0][: len(columns)], name=section.title)


def _plots(recorder: Recorder, results: FlightResults, path: str, name: str) -> list[rrb.View]:
    """The columns of a figure over flight time, a view for each unit."""
    figure = results.figure_with_rows(name)
    if figure is None:
        return []
    time_s = numbers(figure, "time_s")
    known = np.flatnonzero(np.isfinite(time_s))
    order = known[np.argsort(time_s[known], kind="stable")]
    time_ns = recorder.time_ns(time_s[order])
    views: list[rrb.View] = []
    groups = columns_by_unit(figure)
    for (unit, columns), part in zip(groups.items(), path_parts(unit or "number" for unit in groups), strict=True):
        shades = colours.for_series(len(columns))
        lines = [Line(label(column), shade) for column, shade in zip(columns, shades, strict=True)]
        values = np.column_stack([numbers(figure, column)[order] for column in columns])
        entity = f"{path}/{path_parts([name])[0]}/{part}"
        recorder.lines(entity, time_ns, values, lines, gap_after(time_ns))
        views.append(plot(", ".join(filter(None, (_title(name, columns), unit))), entity))
    return views


def _title(name: str, columns: tuple[str, ...]) -> str:
    told = f"{quantity(name)[0]}: {quantity(columns[0])[0]}" if len(columns) == 1 else quantity(name)[0]
    return titled(told)
