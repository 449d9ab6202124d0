"""Chapter: latency between sensors: how much later than the INS each shows the same motion."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.reports import drawing as d
from groundstation.reports.parts import Drawing, Grid, Head, Mark, Note, Section
from groundstation.reports.sections.inertial_figures import plain_log
from groundstation.reports.sections.saved import mapping, not_assessable_reason, numbers, objects, texts
from groundstation.reports.wording import interval, is_number, number, significant, typeset
from groundstation.results.files import SavedFlight

LEAD = (
    "How much later than the INS each sensor shows the same motion, by the time stamps of the log: positive is later. "
    "Estimated from ordinary motion; straight and level flight shows nothing of it."
)
MOST_PAIRS = len(d.SERIES)


def build(saved: SavedFlight) -> Section | None:
    """Build the chapter; None when the flight was not assessed and no reason is known."""
    rows = objects(mapping(saved.summary, "results", "latency"), "rows")
    if not rows:
        reason = not_assessable_reason(saved, "latency")
        note = Note(f"Not assessable: {reason}", "unknown")
        return Section("latency", "Latency between sensors", LEAD, (note,)) if reason else None
    parts = (_table(rows), _search(saved, rows))
    return Section("latency", "Latency between sensors", LEAD, tuple(part for part in parts if part is not None))


def _table(rows: list[Mapping[str, Any]]) -> Grid:
    heads = (
        *(Head("Sensor"), Head("Quantity"), Head("State"), Head("Latency, s", True), Head("95 % interval", True)),
        *(Head("Windows", True), Head("Motion in 1 s / left, RMS", True), Head("What it rests on, or why not")),
    )
    cells = [
        (
            f"{row.get('other')} against {row.get('reference')}",
            str(row.get("quantity") or ""),
            Mark("good", "observed") if row.get("state") == "observed" else Mark("unknown", "not observable"),
            number(row.get("latency_s"), 3, signed=True),
            interval(row.get("confidence95_s"), 3, "s"),
            f"{number(row.get('effective_windows'), 1)} of {number(row.get('windows'), 0)}",
            f"{significant(row.get('motion'))} / {significant(row.get('residual'))} {row.get('unit')}",
            typeset(str(row.get("reason") or "")),
        )
        for row in rows
    ]
    caption = (
        "Windows: degrees of freedom of the interval, of the windows used; motion slower than a window is taken away."
    )
    return Grid("Latencies", heads, cells, caption, ("latency_search",))


def _search(saved: SavedFlight, rows: list[Mapping[str, Any]]) -> Drawing | None:
    data = saved.figure("latency_search")
    if data is None:
        return None
    delay, residual = numbers(data, "latency_s"), numbers(data, "residual")
    other, quantity = texts(data, "other"), texts(data, "quantity")
    known = [row for row in rows if np.any((other == row.get("other")) & (quantity == row.get("quantity")))]

    def paint(figure: Any) -> None:
        axes = d.place(figure, 18, 12, 174, 56)
        for row, colour in zip(known, d.SERIES, strict=False):
            mine = (other == row.get("other")) & (quantity == row.get("quantity")) & (residual > 0.0)
            if not mine.any():
                continue
            text = d.label(f"{row.get('other')} {row.get('quantity')}")
            d.line(axes, delay[mine], residual[mine] / residual[mine].min(), colour, 1.2, label=text)
            bounds = row.get("confidence95_s")
            if isinstance(bounds, list) and len(bounds) == 2 and all(map(is_number, bounds)):
                axes.axvspan(bounds[0], bounds[1], color=colour, alpha=0.25, linewidth=0)
        axes.set_yscale("log")
        plain_log(axes.yaxis)
        axes.set_xlabel("latency tried, s")
        axes.set_ylabel("residual over the smallest")
        d.legend_above(axes, 4)

    caption = (
        "RMS of what is left between sensor and INS, over the smallest, against the latency tried; a sharp valley is "
        "motion that tells. Shaded: the 95 % interval of what is observed."
        + (f" The first {MOST_PAIRS} pairs." if len(known) > MOST_PAIRS else "")
    )
    alt = "Residual between sensors and INS against the latency tried, one line for each pair."
    return Drawing("Search", caption, alt, d.draw("latency-search", 66, paint), ("latency_search",))
