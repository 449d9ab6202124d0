"""Axes painted by matplotlib and panels of a description as the same plain things, so that they can be compared."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle, StepPatch

from groundstation.plots import marks
from groundstation.plots.marks import AnyMark, Floats
from groundstation.plots.plot import Axis, Panel, Plot
from groundstation.reports import drawing as d
from groundstation.reports.frames import MM_PER_INCH, TIME
from groundstation.reports.frames import _names as names_beside

EMPTY = np.zeros(0)
BOLD_PT, FAINT_PT = 1.6, 0.6  # widths of lines from and up to which they are so
# What each role was before there were roles.
COLOURS: dict[str, set[str]] = {
    "ins": {d.INS, "#b9d3e6"},
    "gnss": {d.GNSS},
    "answer": {d.USED, d.FILL},
    "unused": {d.UNUSED},
    "limit": {d.LIMIT},
    "ink": {d.INK},
    "faint": {d.FAINT, "#eef3f7", "#999999", "#eef0f2", *d.PHASE_COLOURS.values()},
    "warn": {"#e69f00", "#fbe9c6"},
    "bad": {"#b3261e"},
    "truth": {"#c3c9d0"},
    "other": {"#cc79a7"},
    "paper": {"white", "#ffffff"},
    **{role: {colour} for role, colour in zip(marks.SERIES, d.SERIES, strict=True)},
}
COLOURS["series 6"] |= {"#3a86c8"}


@dataclass(frozen=True, eq=False)
class Thing:
    """One thing on axes: kind, name in the legend, colours it may have, coordinates, weight."""

    kind: str
    name: str
    colours: frozenset[str]
    is_dashed: bool = False
    x: Floats = field(default_factory=lambda: EMPTY)
    y: Floats = field(default_factory=lambda: EMPTY)
    upper: Floats = field(default_factory=lambda: EMPTY)
    text: str = ""
    weight: str = ""  # of a line: bold, faint, or neither


@dataclass(frozen=True)
class Shown:
    """Axes or a panel: titles, scales, ranges (None: as matplotlib or a painter finds it), names of places, things."""

    title: str
    x_title: str
    y_title: str
    scales: tuple[str, str]
    x_range: tuple[float | None, float | None]
    y_range: tuple[float | None, float | None]
    names: tuple[tuple[float, str], ...]
    is_map: bool
    legend: frozenset[str]
    height_mm: float
    things: tuple[Thing, ...]
    told: marks.Told | None
    nothing: str = ""


# ----------------------------------------------------------------------------------------------- as painted


def painted(sketch: d.Sketch) -> list[Shown]:
    """Axes of a sketch from the top, and from left to right in a row; scales of colour are left out."""
    with d.report_style():
        figure = Figure(figsize=(sketch.width_mm / MM_PER_INCH, sketch.height_mm / MM_PER_INCH))
        sketch.paint(figure)
        height = sketch.height_mm
        kept = [axes for axes in figure.axes if not hasattr(axes, "_colorbar")]
        kept.sort(key=lambda axes: (-round(axes.get_position().y0 * height), axes.get_position().x0))
        return [_painted(axes, height) for axes in kept]


def _painted(axes: Any, figure_mm: float) -> Shown:
    told = getattr(axes, "samples_told", None)
    return Shown(
        axes.get_title(loc="left"),
        axes.get_xlabel(),
        axes.get_ylabel(),
        (_scale_of(axes), axes.get_yscale()),
        (None, None) if axes.get_autoscalex_on() else axes.get_xlim(),
        (None, None) if axes.get_autoscaley_on() else axes.get_ylim(),
        names_beside(axes),
        axes.get_aspect() != "auto",
        frozenset() if axes.get_legend() is None else frozenset(axes.get_legend_handles_labels()[1]),
        axes.get_position().height * figure_mm,
        tuple(_things_on(axes)),
        None if told is None else marks.Told(x=told.x, y=told.y, value=told.value, title=told.title),
        next((text.get_text() for text in axes.texts if text.get_transform() == axes.transAxes), ""),
    )


def _scale_of(axes: Any) -> str:
    is_date = "Date" in type(axes.xaxis.get_major_formatter()).__name__
    return "time" if axes.get_label() == TIME else "date" if is_date else str(axes.get_xscale())


def _name(artist: Any) -> str:
    text = str(artist.get_label())
    return "" if text.startswith("_") or text == "None" else text


def _one(colour: Any) -> frozenset[str]:
    return frozenset({str(to_hex(colour))})


def _things_on(axes: Any) -> Iterator[Thing]:
    in_legend = {to_hex(one.get_color()): _name(one) for one in axes.lines if not len(one.get_xdata())}
    bars = {id(line) for container in axes.containers for line in (container[0], *container[1])}
    for container in axes.containers:
        data, _, (stems,) = container
        x, y = (np.asarray(values, dtype=float) for values in data.get_data())
        ends = np.array([segment[:, 1] for segment in stems.get_segments()])
        name = str(container.get_label())
        yield Thing("bars", name, _one(data.get_color()), x=x, y=y, upper=0.5 * (ends[:, 1] - ends[:, 0]))
    dotted = {to_hex(patch.get_edgecolor()) for patch in axes.patches if isinstance(patch, PathPatch)}
    of_lines = {colour: name for colour, name in in_legend.items() if colour not in dotted}
    for line in axes.lines:
        if len(line.get_xdata()) and id(line) not in bars:
            for thing in _line(axes, line):  # the first of a colour has the name that stands in the legend alone
                name = "" if thing.name or thing.kind != "line" else of_lines.pop(min(thing.colours), "")
                yield replace(thing, name=thing.name or name)
    for band in axes.collections:
        if isinstance(band, PolyCollection):
            yield from _band(band)
        elif isinstance(band, QuadContourSet):
            levels = np.asarray(band.levels, dtype=np.float64)
            yield Thing("cells", "", frozenset(), x=levels[:1], y=levels[-2:-1], upper=levels[-1:])
    for patch in axes.patches:
        yield _patch(patch, in_legend)
    for text in axes.texts:
        if text.get_transform() != axes.transAxes and text.get_text():
            is_beside_a_line = getattr(text, "xycoords", None) == axes.get_yaxis_transform()
            place = getattr(text, "xy", None) or text.get_position()
            is_at_an_upright = getattr(text, "xycoords", None) == axes.get_xaxis_transform()
            x = EMPTY if is_beside_a_line else np.array([place[0]])
            y = EMPTY if is_at_an_upright else np.array([place[1]])
            yield Thing("text", "", frozenset(), x=x, y=y, text=text.get_text())


def _line(axes: Any, line: Any) -> Iterator[Thing]:
    x, y = (np.asarray(values, dtype=np.float64) for values in line.get_data(orig=False))
    colour = _one(line.get_color())
    is_dashed = line.get_linestyle() not in ("-", "None")
    width = line.get_linewidth()
    weight = "bold" if width >= BOLD_PT else "faint" if width <= FAINT_PT else ""
    if line.get_transform() == axes.get_xaxis_transform(which="grid"):
        yield Thing("upright", _name(line), colour, is_dashed, x=x[:1], weight=weight)
    elif line.get_transform() == axes.get_yaxis_transform(which="grid"):
        yield Thing("level", _name(line), colour, is_dashed, y=y[:1], weight=weight)
    else:
        name = _name(line)
        if line.get_linestyle() not in ("None", "none", ""):
            kind = "steps" if line.get_drawstyle() == "steps-mid" else "line"
            if line.get_drawstyle() == "steps-post":  # described by its corners
                x, y = np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]
            yield Thing(kind, name, colour, is_dashed, x, y, weight=weight)
            name = ""
        if line.get_marker() not in ("None", "none", "", None):
            edge = line.get_markeredgecolor() if line.get_color() == "white" else line.get_color()
            yield Thing("dots", name, _one(edge), x=x, y=y)


def _band(band: Any) -> Iterator[Thing]:
    xs, lows, highs = [EMPTY], [EMPTY], [EMPTY]
    is_stepped = False
    for path in band.get_paths():
        corners = path.vertices
        count = (len(corners) - 3) // 2
        there, back = corners[1 : count + 1], corners[count + 2 : 2 * count + 2][::-1]
        xs.append(there[:, 0])
        lows.append(there[:, 1])
        highs.append(back[:, 1])
        is_stepped |= bool(count > 2 and np.array_equal(there[1:-1:2, 0], there[2::2, 0]))
    colour = band.get_facecolor()
    if len(colour) and sum(map(len, xs)):
        kind = "stepped band" if is_stepped else "band"
        yield Thing(
            kind, _name(band), _one(colour[0]), False, *(np.concatenate(values) for values in (xs, lows, highs))
        )


def _patch(patch: Any, in_legend: dict[str, str]) -> Thing:
    if isinstance(patch, StepPatch):
        values, edges, _ = patch.get_data()
        return Thing("histogram", _name(patch), _one(patch.get_edgecolor()), x=np.asarray(edges), y=np.asarray(values))
    if isinstance(patch, Rectangle):
        x = np.array([patch.get_x()])
        return Thing("span", _name(patch), _one(patch.get_facecolor()), x=x, upper=x + patch.get_width())
    if isinstance(patch, Circle):
        return Thing("circle", "", _one(patch.get_edgecolor()), True, x=np.array([patch.get_radius()]))
    if isinstance(patch, PathPatch):
        corners, colour = patch.get_path().vertices, to_hex(patch.get_edgecolor())
        start, end, y = corners[::2, 0], corners[1::2, 0], corners[::2, 1]
        if patch.get_capstyle() == "round":
            return Thing("dots", _name(patch) or in_legend.get(colour, ""), frozenset({colour}), x=start, y=y)
        return Thing("lanes", "", frozenset({colour}), x=start, y=y, upper=end)
    assert isinstance(patch, Polygon), type(patch)
    corners = patch.get_xy()
    return Thing("line", _name(patch), _one(patch.get_edgecolor()), x=corners[:, 0], y=corners[:, 1])


# ----------------------------------------------------------------------------------------------- as described


def described(plot: Plot) -> list[list[Shown]]:
    """Panels of a description in the order of :func:`painted`, each with its windows."""
    found = []
    for row in plot.rows:
        for panel in row.panels:
            windows = panel.x.windows or (None,)
            found.append(
                [_described(panel, row.height_mm, row.shares_x, place, window) for place, window in enumerate(windows)]
            )
    return found


def _described(panel: Panel, height_mm: float, shares_x: bool, place: int, window: tuple[float, float] | None) -> Shown:
    x, y = panel.x, panel.y
    lanes = next((mark for mark in panel.marks if isinstance(mark, marks.Lanes)), None)
    names = y.names if lanes is None else tuple((float(row), name) for row, name in enumerate(lanes.order))
    y_range = y.ranges[place] if y.ranges else (y.low, y.high)
    if lanes is not None:
        y_range = len(lanes.order) - 0.4, -0.6
    told = next((mark for mark in panel.marks if isinstance(mark, marks.Told)), None)
    cells = next((mark for mark in panel.marks if isinstance(mark, marks.Cells)), None)
    if cells is not None:
        across, up = np.meshgrid(cells.x, cells.y)
        told = marks.Told(x=across.ravel(), y=up.ravel(), value=cells.values.ravel(), title=cells.title)
    things = [thing for mark in panel.marks for thing in _things(mark, window)]
    return Shown(
        panel.title,
        "" if shares_x else x.title,
        y.title,
        (_scale(x), _scale(y)),
        window or (x.low, x.high),
        y_range,
        names,
        panel.is_map,
        frozenset(_legend(panel)) if panel.legend else frozenset(),
        height_mm,
        tuple(things),
        told,
        panel.nothing,
    )


def _legend(panel: Panel) -> Iterator[str]:
    for mark in panel.marks:
        if isinstance(mark, marks.Spans) and mark.name:
            yield from (kind or mark.name for kind in mark.kind.tolist())
        elif mark.name:
            yield mark.name


def _scale(axis: Axis) -> str:
    return "linear" if axis.scale == "angle" else axis.scale


def _things(mark: AnyMark, window: tuple[float, float] | None) -> Iterator[Thing]:
    colours = frozenset(to_hex(colour) for colour in COLOURS[mark.role])
    name = mark.name
    weight = mark.emphasis if mark.emphasis in ("bold", "faint") else ""
    if isinstance(mark, marks.Curve):
        x, y = _within(window, mark.x, mark.y)
        yield Thing("steps" if mark.steps else "line", name, colours, bool(mark.dash), x, y, weight=weight)
    elif isinstance(mark, marks.Dots | marks.Points):
        x, y = _within(window, mark.x, mark.y)
        yield Thing("dots", name, colours, x=x, y=y)
        if isinstance(mark, marks.Points):
            for across, up, text in zip(mark.x, mark.y, mark.labels, strict=False):
                yield Thing("text", "", frozenset(), x=np.array([across]), y=np.array([up]), text=text)
    elif isinstance(mark, marks.Band):
        kind = "stepped band" if mark.steps else "band"
        yield Thing(kind, name, colours, False, *_within(window, mark.x, mark.low, mark.high))
    elif isinstance(mark, marks.Histogram):
        yield Thing("histogram", name, colours, x=mark.edges, y=mark.heights)
    elif isinstance(mark, marks.Limit):
        at = np.array([mark.value])
        kind = "upright" if mark.is_upright else "level"
        x, y = (at, EMPTY) if mark.is_upright else (EMPTY, at)
        yield Thing(kind, name, colours, bool(mark.dash), x, y, weight=weight)
        if mark.label:
            yield Thing("text", "", frozenset(), x=x, y=y, text=mark.label)
    elif isinstance(mark, marks.Spans):
        seen: set[str] = set()
        for start, end, kind in zip(mark.start, mark.end, mark.kind.tolist(), strict=True):
            shown = (kind or name) if name and kind not in seen else ""
            seen.add(kind)
            yield Thing("span", shown, colours, x=np.array([start]), upper=np.array([end]))
    elif isinstance(mark, marks.Lanes):
        yield from _lanes(mark, window)
    else:
        yield from _other(mark, name, colours)


def _other(mark: AnyMark, name: str, colours: frozenset[str]) -> Iterator[Thing]:
    if isinstance(mark, marks.Bars):
        yield Thing("bars", name, colours, x=mark.x, y=mark.y, upper=mark.half)
    elif isinstance(mark, marks.Intervals):
        for ends, heavy in ((mark.thin, ""), (mark.thick, "bold")):
            if ends is not None:
                yield Thing("line", "", colours, x=np.array(ends), y=np.full(2, float(mark.row)), weight=heavy)
        yield Thing("dots", name, colours, x=np.array([mark.value]), y=np.array([float(mark.row)]))
    elif isinstance(mark, marks.Outlines):
        for ring in mark.rings:
            if mark.dash:
                yield Thing("circle", "", colours, True, x=np.array([float(np.hypot(*ring[0]))]))
            else:
                faint = "faint" if mark.emphasis == "faint" else ""
                yield Thing("line", name, colours, x=ring[:, 0], y=ring[:, 1], weight=faint)
        for text, ring in zip(mark.labels, mark.rings, strict=False):
            middle = ring[:-1].mean(axis=0)
            yield Thing("text", "", frozenset(), x=middle[:1], y=middle[1:], text=text)
    elif isinstance(mark, marks.Cells):
        ends = np.array([mark.low]), np.array([mark.high])
        yield Thing("cells", "", frozenset(), x=ends[0], y=ends[1], upper=ends[1])
    else:
        assert isinstance(mark, marks.Told), type(mark)


def _lanes(mark: marks.Lanes, window: tuple[float, float] | None) -> Iterator[Thing]:
    low, high = window or (-np.inf, np.inf)
    for row, state in enumerate(mark.order):
        mine = (mark.state == state) & np.isfinite(mark.start) & np.isfinite(mark.end)
        mine &= (mark.end >= low) & (mark.start <= high)
        if mine.any():
            role = cast(str, mark.roles.get(state, mark.role))
            colours = frozenset(to_hex(colour) for colour in COLOURS[role])
            heights = np.full(int(mine.sum()), float(row))
            yield Thing("lanes", "", colours, x=mark.start[mine], y=heights, upper=mark.end[mine])


def _within(window: tuple[float, float] | None, x: Floats, *others: Floats) -> tuple[Floats, ...]:
    if window is None:
        return x, *others
    inside = (x >= window[0]) & (x <= window[1])
    return x[inside], *(values[inside] for values in others)
