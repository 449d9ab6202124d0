"""Tab on data quality: rates and gaps of each topic, and the quality that GNSS stated."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.ledger import PauseEntry
from groundstation.base.signals import topics_of_kind
from groundstation.chapters.markdown import markdown
from groundstation.chapters.quality import quality as quality_chapter
from groundstation.results.arrays.flight import GapRows, LedgerRows
from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight, Table
from groundstation.viewer import colours
from groundstation.viewer.names import label, path_parts, topic_label
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, lanes, plot

PLOTS = {
    "GNSS dilution of precision": ("gdop", "pdop", "hdop"),
    "GNSS satellites used": ("satellites_used",),
    "GNSS velocity sigma, m/s": ("velocity_sigma_mps",),
}
PLOT_ROWS = 20_000
PART = "quality"  # what answers without a tab name to stand here


def quality(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container:
    """Log the data quality tab: every flight has a ledger."""
    recorder.document("quality/ledger", _ledger_text(recorder, results))
    top: list[rrb.View | rrb.Container] = [document("Integrity ledger", "quality/ledger")]
    receivers = [flight[topic] for topic in topics_of_kind("gnss", flight.topics())]
    plots = []
    for title, names in PLOTS.items():
        logged = [path for receiver in receivers for path in _plot(recorder, receiver, names)]
        if logged:
            plots.append(plot(title, logged, legend=len(names) > 1 or len(logged) > 1))
    if plots:
        top.append(rrb.Vertical(contents=plots))
    parts: list[rrb.View | rrb.Container] = [rrb.Horizontal(contents=top, column_shares=[3.0, 2.0][: len(top)])]
    paths = _coverage(recorder, results)
    if paths:
        parts.append(lanes("Where data is and where it is missing", paths))
    return rrb.Vertical(contents=parts, name="Data quality")


def _coverage(recorder: Recorder, results: FlightResults) -> list[str]:
    """Log one lane per topic: data from first to last sample, except gaps and pauses."""
    ledger = results.rows_of(LedgerRows)
    if ledger is None:
        return []
    gaps = results.rows_of(GapRows)
    topics = ledger.topic.tolist()
    paths = []
    rows = zip(topics, path_parts(topics), ledger.first_s, ledger.last_s, strict=True)
    for topic, part, first, last in rows:
        if not last > first:  # nothing, or a single sample: no stretch of time to draw
            continue
        starts, ends, states = _spans(topic, float(first), float(last), gaps, results.ledger.pauses)
        path = f"coverage/{part}"
        recorder.spans(path, starts, ends, states, colours.DATA_STATES)
        paths.append(path)
    return paths


def _spans(
    topic: str, first: float, last: float, gaps: GapRows | None, pauses: tuple[PauseEntry, ...]
) -> tuple[FloatArray, FloatArray, np.ndarray]:
    holes = [(one.start_s, one.start_s + one.length_s, "not logged") for one in pauses if first < one.start_s < last]
    if gaps is not None:
        mine = gaps.topic == topic
        holes += [
            (float(start), float(start + length), "gap")
            for start, length in zip(gaps.start_s[mine], gaps.length_s[mine], strict=True)
        ]
    begins, ends, states = [first], [], ["data"]
    for start, end, state in sorted(holes):
        ends += [start, end]
        begins += [start, end]
        states += [state, "data"]
    return np.array(begins), np.array([*ends, last]), np.array(states)


def _plot(recorder: Recorder, table_of_topic: Table, names: tuple[str, ...]) -> list[str]:
    known = [name for name in names if table_of_topic.has(name)]
    if not known or not len(table_of_topic):
        return []
    values = np.column_stack([table_of_topic.values(name) for name in known])
    path = f"quality/{path_parts([table_of_topic.topic])[0]}/{known[0]}"
    lines = [
        Line(f"{topic_label(table_of_topic.topic)} {label(name)}", colour)
        for name, colour in zip(known, colours.for_series(len(known)), strict=True)
    ]
    time_ns = table_of_topic.time_ns
    recorder.thinned(path, time_ns, values, lines, gap_after(time_ns), PLOT_ROWS)
    return [path]


def _ledger_text(recorder: Recorder, results: FlightResults) -> str:
    """Return the chapter on quality, and those of the answers that are shown beside it."""
    names = {name for tab in recorder.systems.tabs_of(None) if tab.part_of == PART for name in tab.shows}
    answered = names & results.answers.keys()
    told = (chapter.build(results) for chapter in recorder.systems.chapters.flight if chapter.name in answered)
    beside = (markdown(section, level=2) for section in told if section is not None)
    return "\n\n".join((markdown(quality_chapter(results)), *beside))
