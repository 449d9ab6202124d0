"""Views with the defaults of this room.

Every time axis is open on the whole flight; names take the place of axis titles.
"""

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.words import capitalised
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line


def whole_flight() -> rrb.TimeAxis:
    """Return a time axis open on everything.

    It is the one range that holds on ``utc`` and on ``flight_time``.
    """
    everything = rr.TimeRange(start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite())
    return rrb.TimeAxis(view_range=everything)


def plot(
    name: str, contents: str | Sequence[str], *, axis_range: tuple[float, float] | None = None, legend: bool = True
) -> rrb.TimeSeriesView:
    """Return a time series view of the entities named.

    ``axis_range`` fixes the vertical axis, else it fits the data.
    """
    entities = [contents] if isinstance(contents, str) else list(contents)
    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ /{entity}/**" for entity in entities],
        axis_x=whole_flight(),
        axis_y=None if axis_range is None else rrb.ScalarAxis(range=axis_range),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=legend),
    )


def lanes(name: str, contents: str | Sequence[str]) -> rrb.StateTimelineView:
    """Return the state lanes of the entities named."""
    entities = [contents] if isinstance(contents, str) else list(contents)
    return rrb.StateTimelineView(
        name=name, origin="/", contents=[f"+ /{entity}/**" for entity in entities], time_view=whole_flight()
    )


def told_by_colour(lines: Sequence[Line], unit: str) -> str:
    """Return the title of a view without a legend: each line with its colour in words.

    A legend would cover the lines.

    Examples
    --------
    >>> told_by_colour([Line("heading", colours.INS), Line("track", colours.GNSS)], "deg")
    'Heading (blue), track (orange), deg'
    >>> told_by_colour([Line("altitude", colours.INS)], "m")
    'Altitude, m'
    """
    names = [f"{line.name} ({colours.WORDS[line.colour]})" if len(lines) > 1 else line.name for line in lines]
    told = ", ".join([*names, unit])
    return capitalised(told)


def document(name: str, path: str) -> rrb.TextDocumentView:
    """Return a text panel."""
    return rrb.TextDocumentView(name=name, origin=f"/{path}")
