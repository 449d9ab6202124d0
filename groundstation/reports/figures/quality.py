"""Figure of the chapter on data quality: where data are present and where they are missing, by topic."""

from typing import Any

import numpy as np

from groundstation.chapters.wording import number
from groundstation.plots.ranges import finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.flight import GapRows, LedgerRows
from groundstation.results.flight import FlightResults

MOST_LANES = 24


def gaps(results: FlightResults) -> Drawing | None:
    """Strips of data and gaps over flight time; None without a ledger."""
    ledger, holes = results.rows_of(LedgerRows), results.rows_of(GapRows)
    if ledger is None:
        return None
    topic, first, last = ledger.topic, ledger.first_s, ledger.last_s
    gap_topic = np.zeros(0, dtype=np.str_) if holes is None else holes.topic
    order = sorted(range(len(topic)), key=lambda row: (topic[row] not in gap_topic, row))[:MOST_LANES]
    order.sort()
    times = finite(first, last)
    if not times.size:
        return None
    low, high = padded(float(times.min()), float(times.max()), 0.01, 0.5)
    height, least = 20.0 + 4.6 * len(order), (high - low) / 400.0  # narrower marks would not be seen

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 44, 12, 174, height - 6)
        for place, row in enumerate(order):
            here = slice(row, row + 1)
            d.bars(axes, first[here], np.maximum(last[here], first[here] + least), place, "#b9d3e6", 6.0)
            if holes is not None:
                _gap_marks(axes, holes, gap_topic == topic[row], place, least)
        axes.set_yticks(range(len(order)), [d.label(topic[row], 24) for row in order])
        axes.set_ylim(len(order) - 0.4, -0.6)
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        layout.time_axis(axes, low, high)

    count = 0 if holes is None else len(holes)
    caption = f"Blue: data; red: gaps, n = {number(count, 0)}{', widened to be seen' if count else ''}."
    caption += f" {len(order)} of {len(topic)} topics." if len(order) < len(topic) else ""
    names = ("ledger",) if holes is None else ("ledger", "gaps")
    return Drawing(
        "Gaps", caption, "Strips of data and gaps by topic over flight time.", d.draw("gaps", height, paint), names
    )


def _gap_marks(axes: Any, gaps: GapRows, rows: Any, place: int, least: float) -> None:
    start, length = gaps.start_s[rows], gaps.length_s[rows]
    largest = np.sort(np.argsort(-length, kind="stable")[:500])
    d.bars(axes, start[largest], start[largest] + np.maximum(length[largest], least), place, "#b3261e", 6.0)
