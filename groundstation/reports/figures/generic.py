"""Figure of the chapter that any answer has: arrays over flight time, one panel for each unit."""

import itertools
from typing import Any

import numpy as np

from groundstation.chapters.generic import columns_by_unit, quantity, titled
from groundstation.plots.ranges import broken_at_gaps, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.figures import numbers
from groundstation.results.flight import FlightResults

PANEL_MM, GAP_MM, BOTTOM_MM = 44.0, 9.0, 12.0


def series(results: FlightResults, name: str) -> Drawing | None:
    """The columns of a figure over its ``time_s``, those of one unit together; None without a number to draw."""
    data = results.figure_with_rows(name)
    if data is None:
        return None
    order = np.argsort(numbers(data, "time_s"), kind="stable")
    time = numbers(data, "time_s")[order]
    panels = columns_by_unit(data)
    if not panels or not np.isfinite(time).any():
        return None
    height = BOTTOM_MM + len(panels) * (PANEL_MM + GAP_MM)

    def paint(figure: Any) -> None:
        for place, (unit, columns) in enumerate(reversed(list(panels.items()))):
            bottom = BOTTOM_MM + place * (PANEL_MM + GAP_MM)
            axes = layout.place(figure, 18, bottom, 174, bottom + PANEL_MM)
            for column, colour in zip(columns, itertools.cycle(d.SERIES), strict=False):
                x, y = broken_at_gaps(time, numbers(data, column)[order])
                d.line(axes, x, y, colour, 1.0, label=d.label(quantity(column)[0]))
            axes.set_ylabel(
                d.label(", ".join(filter(None, (quantity(columns[0])[0] if len(columns) == 1 else "", unit))))
            )
            layout.time_axis(axes, *padded(float(np.nanmin(time)), float(np.nanmax(time))), title=place == 0)
            layout.legend_above(axes, 4)

    title = titled(quantity(name)[0])
    caption = f"Over flight time, n = {len(data)} rows; a line breaks where values are missing."
    alt = f"{title} over flight time."
    sketch = d.draw(f"series-{name}", height, paint)
    return Drawing(title, caption, alt, sketch, (name,))
