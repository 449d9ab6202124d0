"""Figure of the chapter on several logs: the motion that two of them show, and the difference."""

from typing import Any

import numpy as np

from groundstation.chapters.generic import quantity
from groundstation.plots.ranges import broken_at_gaps, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.together import JoinedDifference, JoinedMotion
from groundstation.results.flight import FlightResults
from groundstation.results.together import Together

PANEL_MM, GAP_MM, BOTTOM_MM = 40.0, 8.0, 12.0


def motion(results: FlightResults, label: str) -> Drawing | None:
    """Both motions over each other, and below what the joined log shows less the other; None without the arrays."""
    answer, name = results.answer(Together), label or "a"
    both = results.rows_of(JoinedMotion, name)
    left = results.rows_of(JoinedDifference, name)
    if answer is None or both is None or left is None:
        return None
    log = next(one for one in answer.logs if one.label == label)
    shown = next(one for one in answer.agreement if one.label == label)
    time = both.time_s
    reference, other = both.motion.values()
    (difference,) = left.difference.values()
    ends = padded(float(np.nanmin(time)), float(np.nanmax(time)))

    def paint(figure: Any) -> None:
        above = layout.place(figure, 18, BOTTOM_MM + PANEL_MM + GAP_MM, 174, BOTTOM_MM + 2 * PANEL_MM + GAP_MM)
        for values, topic, colour, width in (
            (reference, log.reference_topic, d.SERIES[0], 2.2),
            (other, log.topic, d.SERIES[1], 0.9),
        ):
            x, y = broken_at_gaps(time, values)
            d.line(above, x, y, colour, width, label=d.label(topic))
        above.set_ylabel(d.label(f"{shown.signal}, {shown.unit}"))
        layout.time_axis(above, *ends, title=False)
        layout.legend_above(above, 2)
        below = layout.place(figure, 18, BOTTOM_MM, 174, BOTTOM_MM + PANEL_MM)
        x, y = broken_at_gaps(time, difference)
        d.line(below, x, y, d.SERIES[2], 0.8)
        below.axhline(0.0, color="0.6", linewidth=0.6)
        below.set_ylabel(d.label(f"difference, {shown.unit}"))
        layout.time_axis(below, *ends)

    caption = (
        f"Above: {quantity(shown.signal)[0]} of {log.reference_topic} and {log.topic} on the clock of the flight. "
        f"Below: {log.topic} minus {log.reference_topic}; peaks where the motion changes mean that the clocks do not "
        "agree."
    )
    alt = f"{shown.signal} of {log.reference_topic} and {log.topic} over flight time, and their difference."
    sketch = d.draw(f"together-{name}", BOTTOM_MM + 2 * (PANEL_MM + GAP_MM), paint)
    return Drawing(f"Motion of {log.source_name}", caption, alt, sketch, (both.name, left.name))
