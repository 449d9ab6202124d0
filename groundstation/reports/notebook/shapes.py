"""Marks of a plot as artists of matplotlib, with every sample that they have."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import Bbox, TransformedBbox

from groundstation.plots.extents import edges
from groundstation.plots.marks import (
    AnyMark,
    Band,
    Bars,
    Cells,
    Curve,
    Dash,
    Dots,
    Floats,
    Histogram,
    Intervals,
    Lanes,
    Limit,
    Outlines,
    Points,
    Spans,
    Symbol,
)
from groundstation.reports.svg import colours, symbols
from groundstation.reports.svg.boxes import Box
from groundstation.reports.svg.cells import colour_of_step, span_of_colours
from groundstation.reports.svg.font import label
from groundstation.reports.svg.legend import MOST_OF_A_NAME, Entry
from groundstation.reports.svg.shapes import LANE_PT, LEAST_LANE_PT, is_within, stepped
from groundstation.reports.svg.thinning import shown_rows

MOST_DRAWN_ONE_BY_ONE = 20_000  # dots of a vector file; more stand in it as an image
BEYOND_PT = 4.0  # as far a symbol at the edge of a frame reaches out of it
GROUND, ABOVE_GRID, ABOVE_ALL = 0.1, 2.0, 3.0  # orders of drawing; matplotlib has the grid at 0.5
BAR_DOT_PT, CAP_PT, BAR_PT = 3.6, 2.0, 0.9
STEM_PT, LEGEND_DOT_PT = 8.0, 2.6
# A symbol's name in matplotlib and how many times the usual size it has there.
SYMBOLS: dict[Symbol, tuple[str, float]] = {
    "dot": ("o", 1.0),
    "circle": ("o", 1.2),
    "ring": ("o", 1.2),
    "triangle": ("^", 1.09),
    "cross": ("x", 1.0),
    "star": ("*", 1.7),
    "diamond": ("D", 1.02),
}
Look: TypeAlias = dict[str, Any]


def draw(mark: AnyMark, axes: Axes, box: Box, place: int) -> None:
    """Draw a mark on axes with the limits of a frame; later places lie over earlier ones."""
    shape = _SHAPES.get(type(mark))
    if shape is None:
        return
    order = GROUND if isinstance(mark, Spans | Cells) else ABOVE_GRID if is_within(mark) else ABOVE_ALL
    look: Look = {"zorder": order + 1e-4 * place}
    if mark.name and not isinstance(mark, Spans | Cells | Lanes):
        look["label"] = label(mark.name, MOST_OF_A_NAME)
    shape(mark, axes, box, look)


def handle_of(entry: Entry) -> Any:
    """Return the sign of an entry of a legend."""
    mark, colour = entry.mark, colours.COLOURS[entry.mark.role]
    if isinstance(mark, Spans):
        shade, alpha = colours.shade_of(entry.kind, mark.role, mark.emphasis)
        return Patch(facecolor=shade, alpha=alpha, linewidth=0.0)
    if isinstance(mark, Band):
        return Patch(facecolor=colour, alpha=colours.SHADE[mark.emphasis], linewidth=0.0)
    if isinstance(mark, Histogram):
        return Patch(**_histogram_look(colour))
    if isinstance(mark, Dots):
        return Line2D([], [], linestyle="", marker="o", markersize=LEGEND_DOT_PT, color=colour, markeredgewidth=0.0)
    if isinstance(mark, Points | Intervals):
        return Line2D([], [], **_symbol_look(mark.symbol, colour, is_hollow=getattr(mark, "is_hollow", False)))
    if isinstance(mark, Bars):
        stem = Line2D([], [], linestyle="", marker="|", markersize=STEM_PT, color=colour)
        return stem, Line2D([], [], linestyle="", marker="o", markersize=BAR_DOT_PT, color=colour)
    if isinstance(mark, Curve | Limit | Outlines):
        widths = colours.LIMIT_PT if isinstance(mark, Limit) else colours.LINE_PT
        return Line2D([], [], color=colour, linewidth=widths[mark.emphasis], linestyle=_dash(mark.dash))
    return Line2D([], [], linestyle="")


def _curve(mark: Curve, axes: Axes, box: Box, look: Look) -> None:
    x, y = _held(mark.x, mark.y) if mark.steps else (mark.x, mark.y)
    width = colours.LINE_PT[mark.emphasis]
    begins = np.flatnonzero(_begins(np.isfinite(x) & np.isfinite(y))).tolist()
    dots: Look = {}
    if begins[1:] or len(x) == 1:  # a sample between gaps is a dot, as wide as the line
        dots = {"marker": "o", "markersize": width, "markeredgewidth": 0.0, "markevery": begins}
    axes.plot(x, y, color=colours.COLOURS[mark.role], linewidth=width, linestyle=_dash(mark.dash), **dots, **look)


def _begins(is_known: Any) -> Any:
    """Tell where known samples begin, behind a gap."""
    return is_known & ~np.concatenate([[False], is_known[:-1]])


def _held(x: Floats, *values: Floats) -> tuple[Floats, ...]:
    """Return places and values of step lines; NaN between pieces.

    A step line holds each value about its place.
    """
    known = np.where(np.isfinite(values).all(axis=0), x, np.nan)
    rows, starts = shown_rows(known, known, len(x))
    wide, _, begins = stepped(x[rows], rows.astype(np.float64), starts)
    gaps = np.flatnonzero(begins[1:]) + 1
    return tuple(np.insert(column, gaps, np.nan) for column in (wide, *(np.repeat(one[rows], 2) for one in values)))


def _dash(dash: Dash) -> Any:
    return (0.0, [float(length) for length in colours.DASHES[dash].split()]) if dash else "-"


def _dots(mark: Dots, axes: Axes, box: Box, look: Look) -> None:
    axes.plot(
        *(mark.x, mark.y),
        color=colours.COLOURS[mark.role],
        alpha=colours.DOT[mark.emphasis],
        linestyle="",
        marker="o",
        markersize=colours.DOT_PT[mark.emphasis],
        markeredgewidth=0.0,
        rasterized=len(mark.x) > MOST_DRAWN_ONE_BY_ONE,
        **look,
    )


def _band(mark: Band, axes: Axes, box: Box, look: Look) -> None:
    x, low, high = _held(mark.x, mark.low, mark.high) if mark.steps else (mark.x, mark.low, mark.high)
    known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    shade = {"color": colours.COLOURS[mark.role], "alpha": colours.SHADE[mark.emphasis], "linewidth": 0.0}
    axes.fill_between(x, low, high, where=known, **shade, **look)  # type: ignore[arg-type]


def _histogram(mark: Histogram, axes: Axes, box: Box, look: Look) -> None:
    if len(mark.heights) and len(mark.edges) == len(mark.heights) + 1 and np.isfinite(mark.edges).all():
        heights = np.where(np.isfinite(mark.heights), mark.heights, 0.0)
        axes.stairs(heights, mark.edges, fill=True, **_histogram_look(colours.COLOURS[mark.role]), **look)


def _histogram_look(colour: str) -> Look:
    return {"facecolor": colours.with_alpha(colour, 0.19), "edgecolor": colour, "linewidth": 0.6}


def _lanes(mark: Lanes, axes: Axes, box: Box, look: Look) -> None:
    high = LANE_PT / box.height * abs(box.y.high - box.y.low)
    for row, name in enumerate(mark.order):
        colour = colours.COLOURS[mark.roles.get(name, mark.role)]
        shade = {"color": colour, "alpha": colours.LANE[mark.emphasis], "linewidth": LEAST_LANE_PT}
        ranges = _ranges(mark.start, mark.end, mark.state == name)
        axes.broken_barh(ranges, (row - 0.5 * high, high), **shade, **look)  # type: ignore[arg-type]


def _spans(mark: Spans, axes: Axes, box: Box, look: Look) -> None:
    for kind in dict.fromkeys(mark.kind.tolist()):
        shade, alpha = colours.shade_of(kind, mark.role, mark.emphasis)
        name: Look = {"label": label(kind or mark.name, MOST_OF_A_NAME)} if mark.name else {}
        ranges = _ranges(mark.start, mark.end, mark.kind == kind)
        whole = axes.get_xaxis_transform()
        axes.broken_barh(ranges, (0.0, 1.0), transform=whole, color=shade, alpha=alpha, linewidth=0.0, **name, **look)


def _ranges(start: Floats, end: Floats, rows: Any) -> list[tuple[float, float]]:
    """Return starts and lengths of the known rows."""
    known = rows & np.isfinite(start) & np.isfinite(end)
    return list(zip(start[known].tolist(), (end - start)[known].tolist(), strict=True))


def _limit(mark: Limit, axes: Axes, box: Box, look: Look) -> None:
    if np.isfinite(mark.value):
        width, dash = colours.LIMIT_PT[mark.emphasis], _dash(mark.dash)
        across = axes.axvline if mark.is_upright else axes.axhline
        across(mark.value, color=colours.COLOURS[mark.role], linewidth=width, linestyle=dash, **look)


def _bars(mark: Bars, axes: Axes, box: Box, look: Look) -> None:
    lines = {"elinewidth": BAR_PT, "capthick": BAR_PT, "capsize": CAP_PT}
    colour, half = colours.COLOURS[mark.role], np.abs(mark.half)
    dots = {"fmt": "o", "markersize": BAR_DOT_PT - BAR_PT, "markeredgewidth": BAR_PT, "color": colour}
    axes.errorbar(mark.x, mark.y, yerr=half, **dots, **lines, **look)  # type: ignore[arg-type]


def _intervals(mark: Intervals, axes: Axes, box: Box, look: Look) -> None:
    colour, row = colours.COLOURS[mark.role], float(mark.row)
    order = {"zorder": look["zorder"]}
    for ends, width in ((mark.thin, 1.2), (mark.thick, 2.8)):
        if ends is not None:
            axes.plot(ends, (row, row), color=colour, linewidth=width, solid_capstyle="butt", **order)
    _reaching_out(axes.plot([mark.value], [row], **_symbol_look(mark.symbol, colour), **look), axes, box)


def _points(mark: Points, axes: Axes, box: Box, look: Look) -> None:
    symbol = _symbol_look(mark.symbol, colours.COLOURS[mark.role], is_hollow=mark.is_hollow)
    _reaching_out(axes.plot(mark.x, mark.y, **symbol, **look), axes, box)


def _symbol_look(symbol: Symbol, colour: str, *, is_hollow: bool = False) -> Look:
    marker, share = SYMBOLS[symbol]
    look = {"linestyle": "", "color": colour, "marker": marker, "markersize": share * colours.SYMBOL_PT}
    if symbol == "cross":
        return look | {"markeredgewidth": symbols.CROSS_PT}
    if symbol == "ring" or is_hollow:
        return look | {"markerfacecolor": colours.PAPER, "markeredgewidth": symbols.EDGE_PT}
    return look | {"markeredgewidth": 0.0}


def _reaching_out(lines: Sequence[Line2D], axes: Axes, box: Box) -> None:
    """Clip symbols a little beyond the frame, not at its edge."""
    x, y = BEYOND_PT / box.width, BEYOND_PT / box.height
    for line in lines:
        line.set_clip_box(TransformedBbox(Bbox([[-x, -y], [1.0 + x, 1.0 + y]]), axes.transAxes))


def _outlines(mark: Outlines, axes: Axes, box: Box, look: Look) -> None:
    colour, width = colours.COLOURS[mark.role], colours.LINE_PT[mark.emphasis]
    line = {"edgecolor": colour, "linewidth": width, "linestyle": _dash(mark.dash)}
    face = "none"
    if mark.is_filled:  # legible over cells
        under = PolyCollection(mark.rings, facecolor=colours.PAPER, alpha=0.75, linewidth=0.0, zorder=look["zorder"])
        axes.add_collection(under, autolim=False)
        face = colours.with_alpha(colour, 0.12)
    axes.add_collection(PolyCollection(mark.rings, closed=False, facecolor=face, **line, **look), autolim=False)


def _cells(mark: Cells, axes: Axes, box: Box, look: Look) -> None:
    x, y = edges(mark.x), edges(mark.y)
    if not mark.values.size or mark.values.shape != (len(mark.y), len(mark.x)):
        return
    if np.isfinite(x).all() and np.isfinite(y).all():
        span = span_of_colours(mark)
        norm = (LogNorm if mark.is_log else Normalize)(span.low, span.high, clip=True)
        steps = ListedColormap([colour_of_step(step) for step in range(colours.STEPS)])
        axes.pcolormesh(x, y, mark.values, cmap=steps, norm=norm, shading="flat", **look)


_SHAPES: dict[type, Callable[[Any, Axes, Box, Look], None]] = {
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
    Cells: _cells,
}
