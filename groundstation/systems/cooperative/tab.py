"""Tab on cooperative navigation: aircraft in space with ellipsoids and links.

Beside them: errors, geometry, and links in time.
"""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.front import front
from groundstation.chapters.markdown import front_markdown, markdown
from groundstation.results.arrays.typed import Counts, Texts
from groundstation.results.flight import FlightResults
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeGeometry, CooperativeLinks
from groundstation.systems.cooperative.chapter import cooperative as chapter
from groundstation.systems.cooperative.chapter import worst_first
from groundstation.systems.cooperative.plots import errors_over_time
from groundstation.systems.cooperative.space_tab import space
from groundstation.viewer import colours
from groundstation.viewer.names import clean_text, path_parts
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, lanes, plot

MOST_LANES = 24
LINK_STATES = {"ranging": colours.ANSWER, "gated": colours.LIMIT, "silent": colours.DIM}
SILENT_FRAMES = 3.0  # so many ordinary steps without a range are silence


def cooperative(recorder: Recorder, results: FlightResults) -> rrb.Container:
    """Log the tab of a session; without an answer it is the text that says why."""
    answer, section = results.answer(CooperativeResult), chapter(results)
    if answer is None or section is None:
        recorder.document("cooperative/answer", front_markdown(front(results, recorder.systems.chapters)))
        return rrb.Vertical(contents=[document("Session", "cooperative/answer")], name="Cooperative")
    recorder.document("cooperative/answer", markdown(section))
    text = document("Algorithms, geometry and links", "cooperative/answer")
    left = [*space(recorder, answer, results), text]
    middle = panels_of(recorder, errors_over_time(results))
    geometry = panels_of(recorder, plot_of(recorder, "cooperative.geometry", results))
    right = [*_sources(recorder, answer, results), *geometry, *_links(recorder, answer, results)]
    columns = [rrb.Vertical(contents=column) for column in (left, middle, right) if column]
    return rrb.Horizontal(contents=columns, column_shares=[1.6, 1.0, 1.0][: len(columns)], name="Cooperative")


def _sources(recorder: Recorder, answer: CooperativeResult, results: FlightResults) -> list[rrb.View]:
    """Log the number of sources that each aircraft hears; the page has them in its table."""
    data = results.rows_of(CooperativeGeometry)
    if data is None or not np.isfinite(data.sources).any():
        return []
    path, names = "cooperative/sources", answer.vehicle_names
    for name, part, shade in zip(names, path_parts(names), colours.for_series(len(names)), strict=True):
        rows = data.vehicle == name
        if rows.any():
            time_ns = recorder.time_ns(data.time_s[rows])
            values = np.asarray(data.sources[rows], dtype=np.float64)[:, None]
            recorder.lines(f"{path}/{part}", time_ns, values, [Line(clean_text(name), shade, 1.0)], gap_after(time_ns))
    return [plot("Sources heard", path)]


def _links(recorder: Recorder, answer: CooperativeResult, results: FlightResults) -> list[rrb.View]:
    """Log a lane each for the worst links: ranging, gated, silent."""
    data = results.rows_of(CooperativeLinks)
    if data is None:
        return []
    ordered = [row for row in worst_first(answer.links) if row.kind != "satellite"]
    shown = ordered[:MOST_LANES]
    parts = path_parts([f"{row.receiver} from {row.source}" for row in shown])
    end_s = float(data.time_s.max())
    paths = []
    for row, part in zip(shown, parts, strict=True):
        mine = (data.receiver == row.receiver) & (data.source == row.source)
        if not mine.any():
            continue
        path = f"cooperative/links/{part}"
        start, end, state = link_spans(data.time_s[mine], data.mark[mine], end_s)
        recorder.spans(path, start, end, state, LINK_STATES)
        paths.append(path)
    more = f", the worst {len(shown)} of {len(ordered)}" if len(shown) < len(ordered) else ""
    return [lanes(f"Links{more}", paths)] if paths else []


def link_spans(time_s: FloatArray, mark: Counts, end_s: float) -> tuple[FloatArray, FloatArray, Texts]:
    """Return stretches in which a link ranges, is gated, or is silent, to the session's end.

    Examples
    --------
    >>> time_s = np.array([0.0, 1.0, 2.0, 3.0, 20.0, 21.0])
    >>> start, end, state = link_spans(time_s, np.array([1, 1, -1, 1, 1, 1]), 30.0)
    >>> list(zip(start.tolist(), end.tolist(), state.tolist()))
    ... # doctest: +NORMALIZE_WHITESPACE
    [(0.0, 2.0, 'ranging'), (2.0, 3.0, 'gated'), (3.0, 4.0, 'ranging'), (4.0, 20.0, 'silent'),
     (20.0, 22.0, 'ranging'), (22.0, 30.0, 'silent')]
    """
    order = np.argsort(time_s, kind="stable")
    time_s, state = time_s[order], np.where(mark[order] > 0, "ranging", "gated")
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    ends = np.append(time_s[1:], end_s)
    is_long = ends - time_s > SILENT_FRAMES * max(step, 1e-9)
    begins, names = [], []
    for begin, name, silent in zip(time_s.tolist(), state.tolist(), is_long.tolist(), strict=True):
        begins.append(begin)
        names.append(name)
        if silent:
            begins.append(begin + step)
            names.append("silent")
    keep = [place for place in range(len(names)) if not place or names[place] != names[place - 1]]
    start = np.array(begins)[keep]
    return start, np.append(start[1:], max(end_s, float(start[-1]))), np.array(names)[keep]
