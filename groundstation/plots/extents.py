"""Ends of the axes of a panel, from all that is drawn, from named rows, or from windows."""

from collections.abc import Sequence

import numpy as np

from groundstation.plots.marks import (
    AnyMark,
    Band,
    Bars,
    Cells,
    Curve,
    Dots,
    Floats,
    Histogram,
    Intervals,
    Lanes,
    Limit,
    Outlines,
    Points,
    Spans,
)
from groundstation.plots.plot import Panel
from groundstation.plots.ranges import finite
from groundstation.plots.scales import NO_PLACES, ScaleSpan, span_of

ABOVE_ROWS, BELOW_ROWS = 0.6, 0.6  # share of a row before the first and behind the last


def edges(centres: Floats) -> Floats:
    """Return the edges of cells about their places, halfway between these.

    There is one more than places.

    Examples
    --------
    >>> edges(np.array([1.0, 2.0, 4.0])).tolist()
    [0.5, 1.5, 3.0, 5.0]
    """
    if len(centres) < 2:
        return np.array([centres[0] - 0.5, centres[0] + 0.5]) if len(centres) else np.zeros(0)
    with np.errstate(invalid="ignore", over="ignore"):
        inner = 0.5 * centres[1:] + 0.5 * centres[:-1]
        return np.concatenate([[2.0 * centres[0] - inner[0]], inner, [2.0 * centres[-1] - inner[-1]]])


def x_extent(marks: Sequence[AnyMark]) -> Floats:
    """The finite ends of all marks along the horizontal axis."""
    return _ends([_x_of(mark) for mark in marks])


def y_extent(marks: Sequence[AnyMark]) -> Floats:
    """The finite ends of all marks along the vertical axis."""
    return _ends([_y_of(mark) for mark in marks])


def _ends(arrays: Sequence[Floats]) -> Floats:
    known = finite(*arrays)
    return np.array([known.min(), known.max()]) if known.size else known


def _x_of(mark: AnyMark) -> Floats:
    if isinstance(mark, Curve | Dots | Band | Bars | Points):
        return mark.x
    if isinstance(mark, Lanes | Spans):
        return np.concatenate([mark.start, mark.end])
    if isinstance(mark, Limit):
        return np.array([mark.value] if mark.is_upright else [])
    if isinstance(mark, Histogram):
        return mark.edges
    if isinstance(mark, Intervals):
        return np.array([mark.value, *(mark.thin or ()), *(mark.thick or ())])
    if isinstance(mark, Outlines):
        return np.concatenate([np.zeros(0), *(ring[:, 0] for ring in mark.rings if mark.makes_room)])
    return edges(mark.x) if isinstance(mark, Cells) else np.zeros(0)


def _y_of(mark: AnyMark) -> Floats:
    if isinstance(mark, Curve | Dots | Points):
        return mark.y
    if isinstance(mark, Band):
        return np.concatenate([mark.low, mark.high])
    if isinstance(mark, Bars):
        half = np.where(np.isfinite(mark.half), mark.half, 0.0)
        return np.concatenate([mark.y - half, mark.y + half])
    if isinstance(mark, Limit):
        return np.array([] if mark.is_upright else [mark.value])
    if isinstance(mark, Histogram):
        return np.append(mark.heights, 0.0)
    if isinstance(mark, Outlines):
        return np.concatenate([np.zeros(0), *(ring[:, 1] for ring in mark.rings if mark.makes_room)])
    return edges(mark.y) if isinstance(mark, Cells) else np.zeros(0)


def names_of(panel: Panel) -> tuple[tuple[float, str], ...]:
    """Return the places of the vertical axis that have a name.

    The names are the axis' own, else the lanes of what stands on it.
    """
    lanes = sorted((mark.order for mark in panel.marks if isinstance(mark, Lanes)), key=len)
    return panel.y.names or tuple((float(place), name) for place, name in enumerate(lanes[-1] if lanes else ()))


def has_rows(panel: Panel) -> bool:
    """Tell whether the vertical axis counts rows from the top."""
    return any(isinstance(mark, Lanes | Intervals) for mark in panel.marks)


def y_spans(panel: Panel, count: int) -> tuple[ScaleSpan, ...]:
    """Ends of the vertical axis in each of so many windows."""
    whole = y_span(panel)
    own = panel.y.ranges if len(panel.y.ranges) == count else ()
    return tuple(span_of(whole.scale, *ends, NO_PLACES, whole.linear_to) for ends in own) or (whole,) * count


def y_span(panel: Panel) -> ScaleSpan:
    """Ends of the vertical axis."""
    axis, drawn = panel.y, y_extent(panel.marks)
    if has_rows(panel):
        places = [place for place, _ in names_of(panel)]
        places += [float(mark.row) for mark in panel.marks if isinstance(mark, Intervals)]
        last = max((place for place in places if np.isfinite(place)), default=0.0)
        ends = last + BELOW_ROWS if axis.low is None else axis.low, -ABOVE_ROWS if axis.high is None else axis.high
        return span_of("linear", *ends, NO_PLACES, is_tight=True)
    is_bars = any(isinstance(mark, Histogram) for mark in panel.marks)
    low = 0.0 if axis.low is None and is_bars and drawn.size and drawn[0] >= 0.0 and axis.scale != "log" else axis.low
    return span_of(axis.scale, low, axis.high, drawn, axis.linear_to, is_tight=_is_grid(panel))


def x_span(panel: Panel, drawn: Floats) -> ScaleSpan:
    """Return the ends of the horizontal axis.

    ``drawn`` are those of what stands on it and on panels that share it.
    """
    axis = panel.x
    return span_of(
        axis.scale,
        axis.low,
        axis.high,
        drawn,
        axis.linear_to,
        is_tight=axis.scale in ("time", "date") or _is_grid(panel),
    )


def _is_grid(panel: Panel) -> bool:
    return any(isinstance(mark, Cells) for mark in panel.marks)


def windows_of(panel: Panel, span: ScaleSpan) -> tuple[ScaleSpan, ...]:
    """Return the spans of the horizontal axis that have a frame each.

    There is one, or the windows of a broken axis.
    """
    known = [(low, high) for low, high in panel.x.windows if np.isfinite([low, high]).all() and high > low]
    if not known:
        return (span,)
    return tuple(span_of(span.scale, *ends, NO_PLACES, span.linear_to, is_tight=True) for ends in known)


def equal(x: ScaleSpan, y: ScaleSpan, width_pt: float, height_pt: float) -> tuple[ScaleSpan, ScaleSpan]:
    """Bring both axes of a map to one scale; the one with room to spare shows more.

    Examples
    --------
    >>> x, y = equal(ScaleSpan("linear", 0.0, 10.0), ScaleSpan("linear", 0.0, 10.0), 200.0, 100.0)
    >>> x.low, x.high, y.low, y.high
    (-5.0, 15.0, 0.0, 10.0)
    """
    per_pt = max(abs(x.high - x.low) / width_pt, abs(y.high - y.low) / height_pt)
    return _grown(x, per_pt * width_pt), _grown(y, per_pt * height_pt)


def _grown(span: ScaleSpan, length: float) -> ScaleSpan:
    middle, half = 0.5 * (span.low + span.high), 0.5 * np.copysign(length, span.high - span.low)
    return span_of(span.scale, float(middle - half), float(middle + half), NO_PLACES, is_tight=True)
