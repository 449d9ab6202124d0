"""Axes that many plots have: flight time, whole or broken, and zero lines.

Zero lines run across a panel.
"""

from collections.abc import Sequence

from groundstation.plots.marks import Limit
from groundstation.plots.plot import Axis

SECONDS_PER_HOUR = 3600.0
ZERO = Limit(value=0.0, role="faint", dash="", emphasis="faint")


def time_axis(low: float, high: float) -> Axis:
    """Return the axis of flight time between two moments; one second about a single moment.

    Examples
    --------
    >>> time_axis(0.0, 90.0).title, time_axis(5.0, 4000.0).title, time_axis(5.0, 5.0).high
    ('flight time, min:s', 'flight time, h:min:s', 6.0)
    """
    low, high = (low, high) if high > low else (low - 1.0, low + 1.0)
    return Axis(_title(high), "time", low, high)


def broken_time_axis(windows: Sequence[tuple[float, float]]) -> Axis:
    """Return an axis of flight time that shows some spans alone.

    Its title is that of the longest span.
    """
    longest = max(windows, key=lambda span: span[1] - span[0])
    return Axis(_title(longest[1]), "time", windows[0][0], windows[-1][1], windows=tuple(windows))


def _title(high: float) -> str:
    return "flight time, h:min:s" if high >= SECONDS_PER_HOUR else "flight time, min:s"
