"""Marks drawn in a frame, as SVG.

Too many samples are thinned, samples without a place are left out.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from groundstation.plots.extents import edges
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
from groundstation.plots.ranges import thin
from groundstation.reports.svg import colours, path
from groundstation.reports.svg.boxes import Box
from groundstation.reports.svg.cells import cells_shape
from groundstation.reports.svg.symbols import look, outline, symbol
from groundstation.reports.svg.thinning import shown_rows

MOST_POINTS, MOST_DOTS, MOST_SYMBOLS, MOST_RINGS, MOST_STROKES = 1000, 2500, 600, 400, 2000
LANE_PT, LEAST_LANE_PT, ROUND = 7.0, 0.25, ' style="stroke-linecap:round"'


def shape(mark: AnyMark, box: Box) -> str:
    """Return a mark as SVG in its frame; empty where no part of it can be seen."""
    draw: Callable[[Any, Box], str] | None = _SHAPES.get(type(mark))
    return draw(mark, box) if draw else ""


def is_within(mark: AnyMark) -> bool:
    """Tell whether a mark is cut at the edges of the frame; symbols are not."""
    return not isinstance(mark, Points | Intervals)


def _curve(mark: Curve, box: Box) -> str:
    x, y = box.across(mark.x), box.down(mark.y)
    rows, starts = shown_rows(x, y, MOST_POINTS // 2 if mark.steps else MOST_POINTS)
    if not len(rows):
        return ""
    x, y = x[rows], y[rows]
    if mark.steps:
        x, y, starts = stepped(x, y, starts)
    width = colours.LINE_PT[mark.emphasis]
    dash = colours.dashes(mark.dash)
    told = path.polyline(x, y, starts)
    ends = ROUND if path.NO_LENGTH in told else ""  # a sample between gaps is a dot
    look = dash + ends + colours.opacity("stroke", colours.LINE[mark.emphasis])
    return _stroked(told, colours.COLOURS[mark.role], width, look)


def stepped(x: Floats, y: Floats, starts: Any) -> tuple[Floats, Floats, Any]:
    """Return a line that holds each value about its place, and where its pieces begin."""
    wide, high, begins = [np.zeros(0)], [np.zeros(0)], [np.zeros(0, dtype=bool)]
    bounds = [*np.flatnonzero(starts).tolist(), len(x)]
    for first, last in pairwise(bounds):
        wide.append(np.repeat(edges(x[first:last]), 2)[1:-1])
        high.append(np.repeat(y[first:last], 2))
        begins.append(np.arange(2 * (last - first)) == 0)
    return np.concatenate(wide), np.concatenate(high), np.concatenate(begins)


def _stroked(told: str, colour: str, width: float, more: str = "") -> str:
    return f'<path d="{told}" fill="none" stroke="{colour}" stroke-width="{width:g}"{more}/>' if told else ""


def _dots(mark: Dots, box: Box) -> str:
    x, y = box.across(mark.x), box.down(mark.y)
    rows = np.flatnonzero(_seen(x, y, box))
    rows = rows[thin(len(rows), MOST_DOTS)]
    colour, look = colours.COLOURS[mark.role], colours.opacity("stroke", colours.DOT[mark.emphasis]) + ROUND
    return _stroked(path.dots(x[rows], y[rows]), colour, colours.DOT_PT[mark.emphasis], look)


def _seen(x: Floats, y: Floats, box: Box, beyond: float = 2.0) -> Any:
    """Tell which places lie in the frame, or so near that a dot there reaches into it."""
    with np.errstate(invalid="ignore"):
        return (
            (x >= box.left - beyond) & (x <= box.right + beyond) & (y >= box.top - beyond) & (y <= box.bottom + beyond)
        )


def _band(mark: Band, box: Box) -> str:
    x = box.across(mark.x)
    low, high = _kept(box.down(mark.low), box), _kept(box.down(mark.high), box)
    rows, starts = _both(x, low, high, MOST_POINTS // (4 if mark.steps else 2))
    parts = []
    bounds = [*np.flatnonzero(starts).tolist(), len(rows)]
    for first, last in pairwise(bounds):
        piece = rows[first:last]
        wide, lower, upper = x[piece], low[piece], high[piece]
        if mark.steps:
            begins = np.arange(len(piece)) == 0
            (wide, lower, _), upper = stepped(wide, lower, begins), np.repeat(upper, 2)
        around = np.concatenate([wide, wide[::-1]]), np.concatenate([upper, lower[::-1]])
        if len(wide) > 1:
            parts.append(path.polyline(*around, np.zeros(2 * len(wide), dtype=bool)) + "z")
    return _filled("".join(parts), mark)


def _kept(places: Floats, box: Box) -> Floats:
    """Clip the edges of a band not far beyond the frame.

    Farther out they cannot be seen.
    """
    return np.clip(places, box.top - 10.0, box.bottom + 10.0)


def _both(x: Floats, low: Floats, high: Floats, most: int) -> tuple[Any, Any]:
    """Return rows of a band: half of them by its lower edge, half by its upper one."""
    known = np.where(np.isfinite(low) & np.isfinite(high), x, np.nan)
    if np.isfinite(known).sum() <= most:
        return shown_rows(known, low, most)
    rows = np.union1d(shown_rows(known, low, most // 2)[0], shown_rows(known, high, most // 2)[0])
    gone = np.cumsum(~np.isfinite(known))
    return rows, np.diff(gone[rows], prepend=-1) > 0


def _filled(told: str, mark: Band) -> str:
    shade = f'fill="{colours.COLOURS[mark.role]}" fill-opacity="{colours.SHADE[mark.emphasis]:g}"'
    return f'<path d="{told}" {shade}/>' if told else ""


def _histogram(mark: Histogram, box: Box) -> str:
    if len(mark.heights) == 0 or len(mark.edges) != len(mark.heights) + 1:
        return ""
    x = np.repeat(box.across(mark.edges), 2)
    foot = box.down(np.array([max(0.0, min(box.y.low, box.y.high)) if box.y.scale == "log" else 0.0]))
    foot = np.where(np.isfinite(foot), foot, box.bottom)
    heights = np.where(np.isfinite(mark.heights), mark.heights, 0.0)
    tops = box.down(heights)
    tops = np.where(np.isfinite(tops), tops, foot)
    y = np.concatenate([foot, np.repeat(tops, 2), foot])
    known = np.isfinite(x)
    told = path.polyline(x[known], y[known], np.zeros(int(known.sum()), dtype=bool))
    colour = colours.COLOURS[mark.role]
    return f'<path d="{told}z" fill="{colour}" fill-opacity=".19" stroke="{colour}" stroke-width=".6"/>' if told else ""


def _lanes(mark: Lanes, box: Box) -> str:
    parts = []
    for place, name in enumerate(mark.order):
        rows = np.flatnonzero((mark.state == name) & np.isfinite(mark.start) & np.isfinite(mark.end))
        rows = rows[thin(len(rows), MOST_STROKES)]
        left, right = (np.clip(box.across(ends[rows]), box.left, box.right) for ends in (mark.start, mark.end))
        seen = right >= left
        y = box.down(np.full(int(seen.sum()), float(place)))
        told = path.strokes(left[seen], np.maximum(right, left + LEAST_LANE_PT)[seen], y)
        shade = colours.opacity("stroke", colours.LANE[mark.emphasis])
        parts.append(_stroked(told, colours.COLOURS[mark.roles.get(name, mark.role)], LANE_PT, shade))
    return "".join(parts)


def _spans(mark: Spans, box: Box) -> str:
    left, right = (np.clip(box.across(ends), box.left, box.right) for ends in (mark.start, mark.end))
    parts = []
    for kind in dict.fromkeys(mark.kind.tolist()):
        rows = np.flatnonzero((mark.kind == kind) & (right > left))
        rows = rows[thin(len(rows), MOST_STROKES)]
        shade, share = colours.shade_of(kind, mark.role, mark.emphasis)
        if len(rows):
            edge = np.full(len(rows), box.top), np.full(len(rows), box.bottom)
            told = path.boxes(left[rows], right[rows], *edge)
            parts.append(f'<path d="{told}" fill="{shade}"{colours.opacity("fill", share)}/>')
    return "".join(parts)


def _limit(mark: Limit, box: Box) -> str:
    place = (box.across if mark.is_upright else box.down)(np.array([mark.value]))[0]
    if not np.isfinite(place):
        return ""
    place = round(min(max(float(place), -1e4), 1e4), 2)
    told = (
        f"M{place:g} {box.top:.2f}V{box.bottom:.2f}"
        if mark.is_upright
        else f"M{box.left:.2f} {place:g}H{box.right:.2f}"
    )
    dash = colours.dashes(mark.dash)
    return _stroked(told, colours.COLOURS[mark.role], colours.LIMIT_PT[mark.emphasis], dash)


def _bars(mark: Bars, box: Box) -> str:
    half = np.where(np.isfinite(mark.half), mark.half, np.nan)
    x, y = box.across(mark.x), box.down(mark.y)
    low, high = (_kept(box.down(ends), box) for ends in (mark.y - half, mark.y + half))
    whole = np.flatnonzero(np.isfinite(x) & np.isfinite(low) & np.isfinite(high))[:MOST_SYMBOLS]
    colour = colours.COLOURS[mark.role]
    lines = "".join(f"M{x[row]:.2f} {low[row]:.2f}V{high[row]:.2f}" for row in whole.tolist())
    ends = np.concatenate([low[whole], high[whole]])
    across = np.concatenate([x[whole], x[whole]])
    caps = path.strokes(across - 2.0, across + 2.0, ends)
    seen = np.flatnonzero(_seen(x, y, box))[:MOST_SYMBOLS]
    return _stroked(lines + caps, colour, 0.9) + _stroked(path.dots(x[seen], y[seen]), colour, 3.6, ROUND)


def _intervals(mark: Intervals, box: Box) -> str:
    y = float(box.down(np.array([float(mark.row)]))[0])
    colour = colours.COLOURS[mark.role]
    parts = []
    for pair, width in ((mark.thin, 1.2), (mark.thick, 2.8)):
        if pair is not None and np.isfinite(pair).all():
            ends = np.clip(np.sort(box.across(np.array(pair))), box.left, box.right)
            parts.append(_stroked(f"M{ends[0]:.2f} {y:.2f}H{ends[1]:.2f}", colour, width))
    x = float(box.across(np.array([mark.value]))[0])
    if box.left - 0.1 <= x <= box.right + 0.1:
        parts.append(symbol(mark.symbol, x, y, colours.SYMBOL_PT, colour))
    return "".join(parts)


def _points(mark: Points, box: Box) -> str:
    x, y = box.across(mark.x), box.down(mark.y)
    rows = np.flatnonzero(_seen(x, y, box, 0.1))
    rows = rows[thin(len(rows), MOST_SYMBOLS)]
    half = 0.5 * colours.SYMBOL_PT
    told = "".join(outline(mark.symbol, float(x[row]), float(y[row]), half) for row in rows.tolist())
    colour = colours.COLOURS[mark.role]
    return f'<path d="{told}" {look(mark.symbol, colour, is_hollow=mark.is_hollow)}/>' if told else ""


def _outlines(mark: Outlines, box: Box) -> str:
    rings = [mark.rings[place] for place in thin(len(mark.rings), MOST_RINGS).tolist()]
    parts = []
    corners = np.concatenate([np.zeros((0, 2)), *rings])
    across, down = box.across(corners[:, 0]), box.down(corners[:, 1])
    ends = np.cumsum([len(ring) for ring in rings])
    for x, y in zip(np.split(across, ends[:-1]), np.split(down, ends[:-1]), strict=True):
        rows, starts = shown_rows(x, y, MOST_POINTS // 2)
        parts.append(path.polyline(x[rows], y[rows], starts))
    colour, told = colours.COLOURS[mark.role], "".join(parts)
    if mark.is_filled and told:
        under = f'<path d="{told}" fill="{colours.PAPER}" fill-opacity=".75"/>'  # legible over cells
        shade = f'fill="{colour}" fill-opacity=".12" stroke="{colour}"'
        return f'{under}<path d="{told}" {shade} stroke-width="{colours.LINE_PT[mark.emphasis]:g}"/>'
    dash = colours.dashes(mark.dash)
    return _stroked(told, colour, colours.LINE_PT[mark.emphasis], dash)


_SHAPES: dict[type, Callable[[Any, Box], str]] = {
    Curve: _curve,
    Dots: _dots,
    Band: _band,
    Histogram: _histogram,
    Lanes: _lanes,
    Spans: _spans,
    Limit: _limit,
    Bars: _bars,
    Intervals: _intervals,
    Points: _points,
    Outlines: _outlines,
    Cells: cells_shape,
}
