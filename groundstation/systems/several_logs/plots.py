"""Plot of several logs: the motion that two of them show, and the difference."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.generic import quantity
from groundstation.chapters.plots.common import label
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import Curve
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.plots.ranges import broken_at_gaps, padded
from groundstation.results.flight import FlightResults
from groundstation.systems.several_logs.answer import Together
from groundstation.systems.several_logs.arrays import JoinedDifference, JoinedMotion

PANEL_MM = 40.0


def motion(results: FlightResults, of: str) -> Plot | None:
    """Return both motions in one panel, and the joined log minus the other below.

    None without the arrays.
    """
    answer, name = results.answer(Together), of or "a"
    both = results.rows_of(JoinedMotion, name)
    left = results.rows_of(JoinedDifference, name)
    if answer is None or both is None or left is None:
        return None
    log = next(one for one in answer.logs if one.label == of)
    shown = next(one for one in answer.agreement if one.label == of)
    reference, other = both.motion.values()
    (difference,) = left.difference.values()
    time = both.time_s
    ends = time_axis(*padded(float(np.nanmin(time)), float(np.nanmax(time))))
    moments, *lines = broken_at_gaps(time, reference, other, difference)
    above = (
        Curve(x=moments, y=lines[0], role="series 1", name=label(log.reference_topic), emphasis="bold"),
        Curve(x=moments, y=lines[1], role="series 2", name=label(log.topic), emphasis="thin"),
    )
    below = (ZERO, Curve(x=moments, y=lines[2], role="series 3", emphasis="thin"))
    return Plot(
        ".".join(filter(None, ("together.motion", of))),
        f"Motion of {log.source_name}",
        f"Above: {quantity(shown.signal)[0]} of {log.reference_topic} and {log.topic} on the clock of the flight. "
        f"Below: {log.topic} minus {log.reference_topic}; peaks where the motion changes mean that the clocks do not "
        "agree.",
        f"{shown.signal} of {log.reference_topic} and {log.topic} over flight time, and their difference.",
        (
            Row((Panel(above, ends, Axis(label(f"{shown.signal}, {shown.unit}"))),), PANEL_MM, shares_x=True),
            Row((Panel(below, ends, Axis(label(f"difference, {shown.unit}")), legend=""),), PANEL_MM),
        ),
        (both.name, left.name),
    )


PLOTS: Mapping[str, Describe] = {
    "together.motion": motion,
}
