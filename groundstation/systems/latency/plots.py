"""Plot of latency: what is left between sensor and INS against the latency tried."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import label
from groundstation.plots.marks import SERIES, AnyMark, Curve, Spans
from groundstation.plots.plot import Axis, Describe, Panel, Plot, one_panel
from groundstation.results.flight import FlightResults
from groundstation.systems.latency.answer import Latencies
from groundstation.systems.latency.arrays import LatencySearch

MOST_PAIRS = len(SERIES)


def search(results: FlightResults) -> Plot | None:
    """Return the residual of every pair against the latency tried; None without the arrays."""
    answer, data = results.answer(Latencies), results.rows_of(LatencySearch)
    if answer is None or data is None:
        return None
    delay, residual = data.latency_s, data.residual
    known = [row for row in answer.rows if np.any((data.other == row.other) & (data.quantity == row.quantity))]
    curves: list[AnyMark] = []
    shades: list[AnyMark] = []
    for row, role in zip(known, SERIES, strict=False):
        mine = (data.other == row.other) & (data.quantity == row.quantity) & (residual > 0.0)
        if not mine.any():
            continue
        text = label(f"{row.other} {row.quantity}")
        curves.append(Curve(x=delay[mine], y=residual[mine] / residual[mine].min(), role=role, name=text))
        if row.confidence95_s is not None and np.isfinite(row.confidence95_s).all():
            start, end = (np.array([value]) for value in row.confidence95_s)
            shades.append(Spans(start=start, end=end, kind=np.array([""]), role=role))
    panel = Panel((*shades, *curves), Axis("latency tried, s"), Axis("residual over the smallest", "log"))
    return Plot(
        "latency.search",
        "Search",
        "RMS residual between sensor and INS for each latency tried. A sharp minimum means that the motion shows the "
        "latency. Shaded: 95 % interval." + (f" The first {MOST_PAIRS} pairs." if len(known) > MOST_PAIRS else ""),
        "Residual between sensors and INS against the latency tried, one line for each pair.",
        one_panel(panel, 44.0),
        ("latency_search",),
    )


PLOTS: Mapping[str, Describe] = {
    "latency.search": search,
}
