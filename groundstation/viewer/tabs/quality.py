"""Data quality: what each topic delivered, where data is missing, and how good GNSS said it was."""

from dataclasses import replace

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.serial import to_json_exactly
from groundstation.base.signals import topics_of_kind
from groundstation.chapters.latency import latency
from groundstation.chapters.markdown import markdown
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.results.latency import Latencies
from groundstation.tables.table import Flight, Table
from groundstation.viewer import colours
from groundstation.viewer.markdown import markdown_text, table
from groundstation.viewer.names import label, path_parts, topic_label, words
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, figure_of, lanes, numbers, plot

LEDGER_HEADINGS = {
    "topic": "topic",
    "rows": "rows",
    "first_s": "first, s",
    "last_s": "last, s",
    "nominal_rate_hz": "nominal, Hz",
    "actual_rate_hz": "actual, Hz",
    "coverage": "coverage",
    "gaps": "gaps",
    "longest_gap_s": "longest gap, s",
    "duplicates": "duplicates",
    "backward_steps": "backward steps",
    "stray_rows": "stray rows",
    "dropped_rows": "dropped rows",
    "lost_by_counter": "lost by counter",
    "out_of_range": "values out of range",
    "stuck": "stuck stretches",
}
PLOTS = {
    "GNSS dilution of precision": ("gdop", "pdop", "hdop"),
    "GNSS satellites used": ("satellites_used",),
    "GNSS velocity sigma, m/s": ("velocity_sigma_mps",),
}
PLOT_ROWS = 20_000


def quality(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container:
    """Log the data quality tab: every flight has a ledger."""
    recorder.document("quality/ledger", _ledger_text(results))
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
    """One lane a topic: data from its first to its last sample, interrupted by its gaps."""
    ledger = figure_of(results, "ledger", "topic", "first_s", "last_s")
    if ledger is None:
        return []
    gaps = figure_of(results, "gaps", "topic", "start_s", "length_s")
    topics = [str(topic) for topic in ledger["topic"]]
    paths = []
    rows = zip(topics, path_parts(topics), numbers(ledger, "first_s"), numbers(ledger, "last_s"), strict=True)
    for topic, part, first, last in rows:
        if not last > first:  # nothing, or a single sample: no stretch of time to draw
            continue
        starts, ends, states = _spans(topic, float(first), float(last), gaps)
        path = f"coverage/{part}"
        recorder.spans(path, starts, ends, states, colours.DATA_STATES)
        paths.append(path)
    return paths


def _spans(topic: str, first: float, last: float, gaps: FigureData | None) -> tuple[FloatArray, FloatArray, np.ndarray]:
    begins, ends, states = [first], [], ["data"]
    if gaps is not None:
        mine = gaps["topic"] == topic
        for start, length in zip(numbers(gaps, "start_s")[mine], numbers(gaps, "length_s")[mine], strict=True):
            ends += [float(start), float(start + length)]
            begins += [float(start), float(start + length)]
            states += ["gap", "data"]
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


def _ledger_text(results: FlightResults) -> str:
    parts = [f"# {markdown_text(results.flight_id)}: {results.status}"]
    source = results.source
    parts.append(
        f"{markdown_text(source.name)}, read by {markdown_text(source.reader)}, {source.size_bytes} bytes, "
        f"SHA-256 {markdown_text(source.sha256[:16])}"
    )
    ledger = figure_of(results, "ledger", "topic")
    if ledger is not None:
        shown = [name for name in LEDGER_HEADINGS if name in ledger.columns]
        rows = [[_cell(name, ledger[name][row]) for name in shown] for row in range(len(ledger))]
        parts.append(table([LEDGER_HEADINGS[name] for name in shown], rows))
    else:
        rows = [
            [markdown_text(topic), f"{100.0 * share:.2f} %"] for topic, share in sorted(results.completeness.items())
        ]
        parts.append(table(["topic", "share of expected samples"], rows) if rows else "No ledger.")
    if results.clock.first_device_time:
        plain = to_json_exactly(replace(results.clock, relations=()))
        del plain["relations"]
        for relation in results.clock.relations:
            told = [f"{one.offset}, {one.drift}" for one in relation.segments] or [relation.reason]
            plain[f"{relation.clock}: {relation.source}"] = "; ".join(told)
        clock = [[markdown_text(words(str(name))), markdown_text(str(value))] for name, value in plain.items()]
        parts += ["## Clock", table(["clock", "value"], clock)]
    section = latency(results) if results.answer(Latencies) else None
    if section is not None:
        parts.append(markdown(section, level=2))
    return "\n\n".join(parts)


def _cell(name: str, value: object) -> str:
    if name == "topic":
        return markdown_text(str(value))
    number = float(value)  # type: ignore[arg-type]
    if not np.isfinite(number):
        return "–"
    if name == "coverage":
        return f"{100.0 * number:.2f} %"
    return f"{number:.3f}" if name.endswith(("_s", "_hz")) else f"{number:.0f}"
