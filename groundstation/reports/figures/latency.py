"""Figure of the chapter on latency: what is left between sensor and INS against the latency tried."""

from typing import Any

import numpy as np

from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.results.arrays.flight import LatencySearch
from groundstation.results.flight import FlightResults
from groundstation.results.latency import Latencies

MOST_PAIRS = len(d.SERIES)


def search(results: FlightResults) -> Drawing | None:
    """The residual of every pair against the latency tried; None without the arrays."""
    answer, data = results.answer(Latencies), results.rows_of(LatencySearch)
    if answer is None or data is None:
        return None
    delay, residual = data.latency_s, data.residual
    other, quantity = data.other, data.quantity
    known = [row for row in answer.rows if np.any((other == row.other) & (quantity == row.quantity))]

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 56)
        for row, colour in zip(known, d.SERIES, strict=False):
            mine = (other == row.other) & (quantity == row.quantity) & (residual > 0.0)
            if not mine.any():
                continue
            text = d.label(f"{row.other} {row.quantity}")
            d.line(axes, delay[mine], residual[mine] / residual[mine].min(), colour, 1.2, label=text)
            if row.confidence95_s is not None and np.isfinite(row.confidence95_s).all():
                axes.axvspan(*row.confidence95_s, color=colour, alpha=0.25, linewidth=0)
        axes.set_yscale("log")
        plain_log(axes.yaxis)
        axes.set_xlabel("latency tried, s")
        axes.set_ylabel("residual over the smallest")
        layout.legend_above(axes, 4)

    caption = (
        "RMS residual between sensor and INS for each latency tried. A sharp minimum means that the motion shows the "
        "latency. Shaded: 95 % interval." + (f" The first {MOST_PAIRS} pairs." if len(known) > MOST_PAIRS else "")
    )
    alt = "Residual between sensors and INS against the latency tried, one line for each pair."
    return Drawing("Search", caption, alt, d.draw("latency-search", 66, paint), ("latency_search",))
