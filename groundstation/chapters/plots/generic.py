"""Plot that any answer has: arrays over flight time, one panel for each unit."""

import numpy as np

from groundstation.chapters.generic import columns_by_unit, quantity, titled
from groundstation.chapters.plots.common import label
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import Curve
from groundstation.plots.marks import series as series_role
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.plots.ranges import broken_at_gaps, padded
from groundstation.results.figures import numbers
from groundstation.results.flight import FlightResults


def series(results: FlightResults, name: str) -> Plot | None:
    """Return the columns of a figure over its ``time_s``; None without a number to draw.

    Columns of one unit share a panel.
    """
    data = results.figure_with_rows(name)
    if data is None:
        return None
    order = np.argsort(numbers(data, "time_s"), kind="stable")
    time = numbers(data, "time_s")[order]
    units = columns_by_unit(data)
    if not units or not np.isfinite(time).any():
        return None
    panels = []
    for unit, columns in units.items():
        marks = []
        for place, column in enumerate(columns):
            x, y = broken_at_gaps(time, numbers(data, column)[order])
            marks.append(Curve(x=x, y=y, role=series_role(place), name=label(quantity(column)[0])))
        alone = quantity(columns[0])[0] if len(columns) == 1 else ""
        y_axis = Axis(label(", ".join(filter(None, (alone, unit)))))
        ends = padded(float(np.nanmin(time)), float(np.nanmax(time)))
        panels.append(Panel(marks, time_axis(*ends), y_axis))
    title = titled(quantity(name)[0])
    return Plot(
        f"generic.series.{name}",
        title,
        f"Over flight time, n = {len(data)} rows; a line breaks where values are missing.",
        f"{title} over flight time.",
        tuple(Row((panel,), 44.0, shares_x=panel is not panels[-1]) for panel in panels),
        (name,),
    )
