"""Tab of the log: findings and events as lines in time, and the findings by severity.

Gaps have lines of their own, so that they do not bury the others.
"""

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.findings import SEVERITIES, Finding, place_time_ns
from groundstation.base.signals import RAW_PREFIX, topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.chapters.findings import findings
from groundstation.chapters.markdown import part_markdown
from groundstation.results.arrays.flight import GapRows
from groundstation.results.flight import FlightResults
from groundstation.results.grouped_findings import grouped
from groundstation.tables.table import Flight
from groundstation.viewer.names import topic_label
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.views import document

MAX_GAPS = 2_000  # of all topics; the lanes of the data quality tab show every one


def log(recorder: Recorder, flight: Flight, results: FlightResults) -> rrb.Container:
    """Log the text log; lines without a time of their own stand at flight time zero."""
    _findings(recorder, flight, results)
    _events(recorder, flight)
    columns = rrb.TextLogColumns(text_log_columns=["loglevel", "body"])  # and the time on the timeline chosen
    paths = ["+ /log/findings", "+ /log/events"]
    left: list[rrb.View] = [rrb.TextLogView(name="Findings and events in time", contents=paths, columns=columns)]
    if _gaps(recorder, results):
        left.append(rrb.TextLogView(name="Gaps in time", origin="/log/gaps", columns=columns))
    recorder.document("log/by_gravity", _by_gravity(results))
    gravest = document("Findings, most severe first", "log/by_gravity")
    column = rrb.Vertical(contents=left, row_shares=[2.0, 1.0][: len(left)])
    return rrb.Horizontal(contents=[column, gravest], name="Log")


def _by_gravity(results: FlightResults) -> str:
    """Return warnings and failures as a table; remarks stand in the list in time."""
    section = findings(results)
    beside = ["Remarks stand in the list beside."] if section.appendix else []
    return "\n\n".join((part_markdown(section.parts[0], level=1), *beside))


def _findings(recorder: Recorder, flight: Flight, results: FlightResults) -> None:
    entries = [
        (place_s(finding.place, flight), f"{finding.text}{_tail(finding)} [{finding.code}]", finding.severity)
        for finding in grouped(results.findings)
    ]
    told = " ".join(finding.text for finding in results.findings)
    entries += [
        (0.0, f"not assessed: {entry.analysis}: {entry.reason}", "info")
        for entry in results.not_assessable
        if entry.reason not in told
    ]
    if not entries:
        entries = [(0.0, "no findings", "info")]
    entries.sort(key=lambda entry: (entry[0], -SEVERITIES.index(entry[2])))
    times, texts, severities = zip(*entries, strict=True)
    recorder.texts("log/findings", recorder.time_ns(np.array(times)), texts, severities)


def place_s(place: str, flight: Flight) -> float:
    """Return the flight seconds in the place of a finding.

    0 when the place names a row, a byte, nothing, or a time outside the flight.

    Examples
    --------
    >>> place_s("at 12.4 s", Flight({})), place_s("row 7", Flight({}))
    (0.0, 0.0)
    """
    time_ns = place_time_ns(place, flight.start_ns, has_utc=flight.has_utc)
    found = 0.0 if time_ns is None else (time_ns - flight.start_ns) / NS_PER_S
    return found if 0.0 <= found <= flight.duration_s else 0.0


def _tail(finding: Finding) -> str:
    """Return topic and place of a finding, where its text does not name them."""
    parts = [part for part in (finding.topic, finding.place) if part and part not in finding.text]
    return f" ({', '.join(parts)})" if parts else ""


def _events(recorder: Recorder, flight: Flight) -> None:
    for topic in topics_of_kind("event", flight.topics()):
        events = flight[topic]
        names = events.text("name")
        said = np.flatnonzero(names != "")
        if said.size:
            texts = [f"{topic_label(topic)}: {name}" for name in names[said].tolist()]
            grades = [grade if grade in SEVERITIES else "info" for grade in events.text("severity")[said].tolist()]
            recorder.texts("log/events", events.time_ns[said], texts, grades)


def _gaps(recorder: Recorder, results: FlightResults) -> bool:
    """Log the longest gaps; False where there are none."""
    gaps = results.rows_of(GapRows)
    if gaps is None:
        return False
    start, length = gaps.start_s, gaps.length_s
    # One drop-out hits everything: a hundred raw topics would only repeat it. Theirs are findings and lanes.
    ours = np.flatnonzero([not topic.startswith(RAW_PREFIX) for topic in gaps.topic.tolist()])
    rows = np.sort(ours[np.argsort(-length[ours], kind="stable")[:MAX_GAPS]])
    if not rows.size:
        return False
    texts = [f"gap of {length[row]:.3f} s in {gaps.topic[row]}" for row in rows]
    if len(rows) < len(gaps):
        texts[0] += f" ({len(rows)} of {len(gaps)} gaps are listed here; the tab Data quality shows every one)"
    recorder.texts("log/gaps", recorder.time_ns(start[rows]), texts, ["info"] * len(texts))
    return True
