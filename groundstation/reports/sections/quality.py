"""Chapter: how good the data are: rates, gaps, order, clock."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.chapters.parts import Facts, Grid, Head, Note, Section
from groundstation.chapters.wording import (
    any_value,
    named_quantity,
    number,
    number_with_unit,
    significant,
    typeset,
    words,
)
from groundstation.reports import drawing as d
from groundstation.reports.drawing import Drawing
from groundstation.reports.sections.saved import mapping, objects
from groundstation.results.figures import FigureData, numbers, texts
from groundstation.results.files import SavedFlight

MOST_TOPICS = 60
MOST_LANES = 24
MOST_ENTRIES = 20
MOST_DAMAGES = 60
COUNT_TITLES = {
    "gaps": "Gaps",
    "duplicates": "Duplicates",
    "backward_steps": "Steps back",
    "stray_rows": "Stray",
    "dropped_rows": "Dropped",
    "lost_by_counter": "Lost by counter",
    "out_of_range": "Out of range",
    "stuck": "Stuck",
}


def build(saved: SavedFlight) -> Section:
    """Build the chapter."""
    parts = (
        _ledger(saved),
        _gaps(saved),
        _nested(saved, "clock", "Clock model"),
        _clock_steps(saved),
        _other_clocks(saved),
        _damages(saved),
        _nested(saved, "ledger", "Ledger of the log"),
    )
    shown = tuple(part for part in parts if part is not None)
    lead = "What the recorder delivered: rates, gaps and order of every topic, and how its clock was read."
    return Section("quality", "Data quality", lead, shown or (Note("No ledger was saved."),))


def _ledger(saved: SavedFlight) -> Grid | None:
    data = saved.figure("ledger")
    if data is None:
        return None
    counts = (
        *("gaps", "duplicates", "backward_steps", "stray_rows", "dropped_rows"),
        *(name for name in ("lost_by_counter", "out_of_range", "stuck") if name in data.columns),
    )
    columns = {
        name: numbers(data, name)
        for name in ("rows", "nominal_rate_hz", "actual_rate_hz", "longest_gap_s", "coverage", *counts)
    }
    rows = []
    for place, topic in enumerate(texts(data, "topic").tolist()[:MOST_TOPICS]):
        row = {name: float(values[place]) for name, values in columns.items()}
        rates = f"{significant(row['actual_rate_hz'])} / {significant(row['nominal_rate_hz'])}"
        fixed = (
            topic,
            number(row["rows"], 0),
            rates,
            number(row["coverage"] * 100, 1, "%"),
            number(row["longest_gap_s"], 2),
        )
        rows.append((*fixed, *(number(row[name], 0) for name in counts)))
    heads = (
        *(
            Head("Topic"),
            Head("Rows", True),
            Head("Rate / nominal, Hz", True),
            Head("Coverage", True),
            Head("Longest gap, s", True),
        ),
        *(Head(COUNT_TITLES[name], True) for name in counts),
    )
    more = len(data) - len(rows)
    caption = f"{more} more topics in the table file." if more else ""
    return Grid("Topics", heads, rows, caption, ("ledger",))


def _gaps(saved: SavedFlight) -> Drawing | None:
    ledger, gaps = saved.figure("ledger"), saved.figure("gaps")
    if ledger is None:
        return None
    topic, first, last = texts(ledger, "topic"), numbers(ledger, "first_s"), numbers(ledger, "last_s")
    gap_topic = np.zeros(0, dtype=np.str_) if gaps is None else texts(gaps, "topic")
    order = sorted(range(len(topic)), key=lambda row: (topic[row] not in gap_topic, row))[:MOST_LANES]
    order.sort()
    times = d.finite(first, last)
    if not times.size:
        return None
    low, high = d.padded(float(times.min()), float(times.max()), 0.01, 0.5)
    height, least = 20.0 + 4.6 * len(order), (high - low) / 400.0  # narrower marks would not be seen

    def paint(figure: Any) -> None:
        axes = d.place(figure, 44, 12, 174, height - 6)
        for place, row in enumerate(order):
            here = slice(row, row + 1)
            d.bars(axes, first[here], np.maximum(last[here], first[here] + least), place, "#b9d3e6", 6.0)
            if gaps is not None:
                _gap_marks(axes, gaps, gap_topic == topic[row], place, least)
        axes.set_yticks(range(len(order)), [d.label(topic[row], 24) for row in order])
        axes.set_ylim(len(order) - 0.4, -0.6)
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        d.time_axis(axes, low, high)

    count = 0 if gaps is None else len(gaps)
    caption = f"Blue: data present; red: gaps, n = {number(count, 0)}, drawn at least wide enough to be seen."
    caption += f" {len(order)} of {len(topic)} topics." if len(order) < len(topic) else ""
    names = ("ledger",) if gaps is None else ("ledger", "gaps")
    return Drawing(
        "Gaps", caption, "Strips of data and gaps by topic over flight time.", d.draw("gaps", height, paint), names
    )


def _gap_marks(axes: Any, gaps: FigureData, rows: Any, place: int, least: float) -> None:
    start, length = numbers(gaps, "start_s")[rows], numbers(gaps, "length_s")[rows]
    largest = np.sort(np.argsort(-length, kind="stable")[:500])
    d.bars(axes, start[largest], start[largest] + np.maximum(length[largest], least), place, "#b3261e", 6.0)


def _nested(saved: SavedFlight, key: str, title: str) -> Facts | None:
    told_above = {
        "topics",
        "damages",
        "remarks",
        "spans",
        "spans_more",
        "steps",
        "relations",
    }  # in tables of their own; remarks are findings
    document = {name: value for name, value in mapping(saved.summary, key).items() if name not in told_above}
    pairs = [(name, value, "") for name, value in _flat(document)]
    return Facts(title, pairs) if pairs else None


def _clock_steps(saved: SavedFlight) -> Grid | None:
    steps = objects(mapping(saved.summary, "clock"), "steps")
    rows = [
        (
            number(step.get("record_index"), 0),
            number(step.get("size_s"), 3, signed=True),
            number(step.get("set_s"), 3, signed=True),
            number(step.get("records_before"), 0),
            words(str(step.get("mistake") or "")),
        )
        for step in steps[:MOST_ENTRIES]
    ]
    titles = ("Record", "Step, s", "Clock set by, s", "Records before it, moved")
    heads = (*(Head(title, True) for title in titles), Head("What"))
    return Grid("Steps of the recorder's clock", heads, rows) if rows else None


def _other_clocks(saved: SavedFlight) -> Grid | None:
    """The recorder's clock by the others of the log: segments, the breaks between them, errors that have a name."""
    rows = []
    for relation in objects(mapping(saved.summary, "clock"), "relations"):
        name = f"{str(relation.get('clock')).upper()} · {relation.get('source')}"
        if relation.get("reason"):
            rows.append((name, "", "", str(relation["reason"]), "", ""))
        rows += [
            (
                name,
                str(one.get("start")),
                number(one.get("length_s"), 1),
                typeset(str(one.get("offset"))),
                typeset(str(one.get("drift"))),
                number(relation.get("residual_s"), 4),
            )
            for one in objects(relation, "segments")
        ]
        for one in objects(relation, "breaks"):
            step = number(one.get("step_s"), 3, "s", signed=True) if one.get("kind") == "step" else ""
            change = number(one.get("drift_change_ppm"), 1, "ppm", signed=True)
            rows.append((f"{name}: {one.get('kind')} changes", str(one.get("time")), "", step, change, ""))
        rows += [
            (f"{name}: error", str(one.get("time") or ""), "", typeset(str(one.get("text"))), "", "")
            for one in objects(relation, "mistakes")
        ]
    heads = (
        Head("Other clock"),
        Head("From"),
        Head("Length, s", True),
        Head("Other less recorder"),
        Head("Drift of the recorder"),
        Head("Scatter, s", True),
    )
    caption = (
        "± is one standard error; positive drift: the recorder is fast. Corrected time is the recorder's, moved where "
        "its clock was set, and not changed by its drift. UTC of autopilots' logs comes from GNSS time itself."
    )
    return Grid("The recorder's clock by others", heads, rows[:MOST_TOPICS], caption) if rows else None


def _damages(saved: SavedFlight) -> Grid | Note:
    damages = objects(mapping(saved.summary, "ledger"), "damages")
    if not damages:
        return Note("No damage was found in the log: nothing lost, nothing unreadable.", "good")
    rows = [
        (
            words(str(item.get("kind") or "")),
            str(item.get("what") or ""),
            " · ".join(str(item.get(key)) for key in ("topic", "place") if item.get(key)),
            number(item.get("count"), 0),
            "yes" if item.get("loses_data") else "no",
        )
        for item in damages[:MOST_DAMAGES]
    ]
    heads = (Head("Kind"), Head("What"), Head("Where"), Head("Count", True), Head("Data lost"))
    more = len(damages) - len(rows)
    return Grid("Damage to the log", heads, rows, f"{more} more in summary.json." if more else "")


def _flat(document: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """A JSON object as pairs of a title and a value; what is nested is told in one line each."""
    out: list[tuple[str, str]] = []
    for key, value in document.items():
        name, unit = named_quantity(str(key))
        title = f"{above} · {name}" if above else name
        if isinstance(value, Mapping) and len(value) <= MOST_ENTRIES:
            out += _flat(value, title)
        elif isinstance(value, Mapping | list) and len(value) > MOST_ENTRIES:
            out.append((title, f"{len(value)} entries in summary.json"))
        elif isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
            for count, item in enumerate(value, 1):
                told = "; ".join(f"{name} {text}" for name, text in _flat(item))
                out.append((f"{title} {count}", told))
        else:
            out.append((title, number_with_unit(any_value(value), unit)))
    return out
