"""Panel of a plot as a chart: axes, marks in their order, names of marks that have one."""

from collections.abc import Callable
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
import rerun.blueprint as rrb

from groundstation.plots import extents, marks
from groundstation.plots.marks import AnyMark
from groundstation.plots.plot import Axis, Panel
from groundstation.plots.scales import ScaleSpan
from groundstation.plots.viridis import viridis
from groundstation.viewer import colours
from groundstation.viewer.chart import FILLING, WIDTH, Chart, ChartAxis
from groundstation.viewer.colours import Colour
from groundstation.viewer.names import clean_text
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray

HEIGHT = 100.0  # of a box, which is 160 wide
SYMBOL, HERE = 4.0, 5.0  # radii in points of the screen
FIRST, STEP = 1.0, 0.1  # where the first mark stands before the grid, the next one before it
BESIDE = 6.0  # room of a label above its place
ROW = 0.25  # half the height of a lane
COLOURS = 24  # of a scale of cells


def chart_view(
    recorder: Recorder, path: str, panel: Panel, name: str, height: float = HEIGHT, window: int | None = None
) -> rrb.Spatial2DView:
    """Log a panel as a chart under ``path``.

    A chart over flight time has a cursor; one with a broken axis shows one window.
    """
    shown = panel if window is None else _of_window(panel, window)
    x, y = extents.x_span(shown, extents.x_extent(shown.marks)), extents.y_span(shown)
    if shown.is_map:
        x, y = extents.equal(x, y, WIDTH, height)
    chart = Chart(recorder, path, _axis(shown.x, x, ()), _axis(shown.y, y, extents.names_of(shown)), height)
    places = {id(mark): place for place, mark in enumerate(shown.marks)}
    for kind, group in groupby(shown.marks, key=type):
        several = list(group)
        order = FIRST + STEP * places[id(several[0])]
        draw: Callable[[Chart, str, list[Any], float], None] = _DRAWN[kind]
        draw(chart, f"{places[id(several[0])]:02d}_{kind.__name__.lower()}", several, order)
    named = {mark.name: colours.ROLES[mark.role] for mark in shown.marks if mark.name}
    if shown.legend and len(named) > 1:
        lines = [Line(clean_text(text), shade) for text, shade in named.items()]
        chart.legend(lines, is_beside=shown.legend == "beside")
    if shown.x.scale == "time":
        chart.cursor()
    return chart.view(name)


def _axis(told: Axis, span: ScaleSpan, names: tuple[tuple[float, str], ...]) -> ChartAxis:
    texts = tuple((place, clean_text(text)) for place, text in names)
    texts = texts or tuple((place, f"{place:g}") for place in told.ticks)
    return ChartAxis(told.title, span.low, span.high, span.scale, span.linear_to, texts)


def _of_window(panel: Panel, window: int) -> Panel:
    """Return a panel over one of the windows of its axis of time."""
    x = panel.x
    low, high = x.windows[window]
    ends = panel.y.ranges[window] if panel.y.ranges else (panel.y.low, panel.y.high)
    inside = [_cut(mark, low, high) for mark in panel.marks]
    return replace(
        panel,
        marks=inside,
        x=replace(x, low=low, high=high, windows=()),
        y=replace(panel.y, low=ends[0], high=ends[1], ranges=()),
    )


def _cut(mark: AnyMark, low: float, high: float) -> AnyMark:
    """Return the part of a mark between two places; marks without samples stay whole."""
    if not isinstance(mark, marks.Curve | marks.Dots | marks.Band):
        return mark
    with np.errstate(invalid="ignore"):
        rows = (mark.x >= low) & (mark.x <= high)
    changed: dict[str, Any] = {
        name: values[rows] for name, values in vars(mark).items() if isinstance(values, np.ndarray)
    }
    return replace(mark, **changed)


def _line(mark: marks.Mark, width: float) -> Line:
    return Line(clean_text(mark.name), colours.ROLES[mark.role], width)


def _curves(chart: Chart, name: str, several: list[marks.Curve], order: float) -> None:
    drawn = []
    for mark in several:
        x, y = _stepped(mark.x, mark.y) if mark.steps else (mark.x, mark.y)
        drawn.append((x, y, _line(mark, 0.5 * colours.LINE[mark.emphasis])))
    chart.curves(name, drawn, order=order)


def _stepped(x: FloatArray, *columns: FloatArray) -> tuple[FloatArray, ...]:
    """Return a step curve: each value held about its place."""
    return np.repeat(extents.edges(x), 2)[1:-1], *(np.repeat(values, 2) for values in columns)


def _dots(chart: Chart, name: str, several: list[marks.Dots], order: float) -> None:
    for place, mark in enumerate(several):
        line = _line(mark, colours.DOT[mark.emphasis])
        chart.dots(f"{name}/{place}", mark.x, mark.y, line, order + STEP * place)


def _bands(chart: Chart, name: str, several: list[marks.Band], order: float) -> None:
    for place, mark in enumerate(several):
        shade, behind = colours.ROLES[mark.role], FILLING + 0.01 * order
        if mark.steps:
            x, shades = extents.edges(mark.x), [colours.faint(shade)] * len(mark.x)
            chart.boxes(f"{name}/{place}", (x[:-1], x[1:]), (mark.low, mark.high), shades, behind)
        else:
            chart.band(f"{name}/{place}", mark.x, mark.low, mark.high, shade, order=behind)


def _histograms(chart: Chart, name: str, several: list[marks.Histogram], order: float) -> None:
    for place, mark in enumerate(several):
        ends = np.full(len(mark.heights), chart.y.within(np.zeros(1))[0]), mark.heights
        shades = [colours.faint(colours.ROLES[mark.role])] * len(mark.heights)
        chart.boxes(f"{name}/{place}", (mark.edges[:-1], mark.edges[1:]), ends, shades, order)


def _lanes(chart: Chart, name: str, several: list[marks.Lanes], order: float) -> None:
    for number, mark in enumerate(several):
        for place, state in enumerate(mark.order):
            rows = mark.state == state
            ends = np.full(int(rows.sum()), place - ROW), np.full(int(rows.sum()), place + ROW)
            shades = [colours.ROLES[mark.roles.get(state, mark.role)]] * int(rows.sum())
            chart.boxes(f"{name}/{number}/{place}", (mark.start[rows], mark.end[rows]), ends, shades, order)


def _spans(chart: Chart, name: str, several: list[marks.Spans], _: float) -> None:
    for place, mark in enumerate(several):
        ends = np.full(len(mark.start), chart.y.low), np.full(len(mark.start), chart.y.high)
        kinds = (colours.PHASES.get(kind, colours.ROLES[mark.role]) for kind in mark.kind.tolist())
        shades = [colours.faint(shade) for shade in kinds]
        chart.boxes(f"{name}/{place}", (mark.start, mark.end), ends, shades)


def _limits(chart: Chart, name: str, several: list[marks.Limit], order: float) -> None:
    drawn, labels = [], []
    for mark in several:
        along = chart.y if mark.is_upright else chart.x
        own, ends = np.full(2, mark.value), np.array([along.low, along.high])
        x, y = (own, ends) if mark.is_upright else (ends, own)
        drawn.append((x, y, _line(mark, 0.5 * min(colours.LINE[mark.emphasis], colours.LINE["thin"]))))
        if mark.label:
            middle = chart.points(x, y).mean(axis=0)
            labels.append((middle - np.array([0.0, BESIDE]), mark.label, colours.ROLES[mark.role]))
    chart.curves(name, drawn, order=order)
    _label(chart, name, labels)


def _bars(chart: Chart, name: str, several: list[marks.Bars], order: float) -> None:
    drawn = []
    for place, mark in enumerate(several):
        for x, y, half in zip(mark.x, mark.y, np.nan_to_num(mark.half), strict=True):
            line = _line(mark, 0.5 * colours.LINE["thin"])
            drawn.append((np.full(2, x), chart.y.within(np.array([y - half, y + half])), line))
        chart.dots(f"{name}/values/{place}", mark.x, mark.y, _line(mark, SYMBOL), order + STEP)
    chart.curves(name, drawn, order=order)


def _intervals(chart: Chart, name: str, several: list[marks.Intervals], order: float) -> None:
    drawn = []
    for mark in several:
        for ends, width in ((mark.thin, colours.LINE["thin"]), (mark.thick, 2.0 * colours.LINE["bold"])):
            if ends is not None:
                row = np.full(2, float(mark.row))
                drawn.append((chart.x.within(np.array(ends)), row, _line(mark, 0.5 * width)))
    chart.curves(name, drawn, order=order)
    for role, group in groupby(several, key=lambda mark: mark.role):
        rows = list(group)
        x, y = np.array([mark.value for mark in rows]), np.array([float(mark.row) for mark in rows])
        line = Line("", colours.ROLES[role], SYMBOL)
        chart.dots(f"{name}/values/{rows[0].row}", x, y, line, order + STEP)


def _points(chart: Chart, name: str, several: list[marks.Points], order: float) -> None:
    labels = []
    for place, mark in enumerate(several):
        line = _line(mark, SYMBOL if mark.emphasis != "bold" else 1.5 * SYMBOL)
        chart.dots(f"{name}/{place}", mark.x, mark.y, line, order + STEP * place)
        at = chart.points(mark.x, mark.y) - np.array([0.0, BESIDE])
        labels += [(one, text, line.colour) for one, text in zip(at, mark.labels, strict=False)]
    _label(chart, name, labels)


def _outlines(chart: Chart, name: str, several: list[marks.Outlines], order: float) -> None:
    drawn, labels = [], []
    for mark in several:
        line = _line(mark, 0.5 * colours.LINE[mark.emphasis])
        drawn += [(ring[:, 0], ring[:, 1], line) for ring in mark.rings]
        for ring, text in zip(mark.rings, mark.labels, strict=False):
            labels.append((chart.points(ring[:-1, 0], ring[:-1, 1]).mean(axis=0), text, line.colour))
    chart.curves(name, drawn, order=order)
    _label(chart, name, labels)


def _cells(chart: Chart, name: str, several: list[marks.Cells], _: float) -> None:
    for place, mark in enumerate(several):
        scale = ScaleSpan("log" if mark.is_log else "linear", mark.low, mark.high)
        share = np.clip(scale.shares(mark.values), 0.0, 1.0)
        row, column = np.nonzero(np.isfinite(share))
        x, y = extents.edges(mark.x), extents.edges(mark.y)
        palette = [viridis((step + 0.5) / COLOURS) for step in range(COLOURS)]
        steps = np.minimum(share[row, column] * COLOURS, COLOURS - 1).astype(np.int64)
        shades = [(*palette[step], 255) for step in steps.tolist()]
        chart.boxes(f"{name}/{place}", (x[column], x[column + 1]), (y[row], y[row + 1]), shades)
        ends = f"{clean_text(mark.title)}: {mark.low:g} dark, {mark.high:g} light"
        chart.note(f"{name}/{place}/scale", ends)


def _told(chart: Chart, name: str, several: list[marks.Told], _: float) -> None:
    """Log marks at the aircraft's place at the cursor, where time is described."""
    for place, mark in enumerate(several):
        if mark.is_time:
            chart.moving(f"{name}/{place}", mark.value, mark.x, mark.y, _line(replace(mark, name=""), HERE))


def _label(chart: Chart, name: str, labels: list[tuple[FloatArray, str, Colour]]) -> None:
    shown = [one for one in labels if one[1] and np.isfinite(one[0]).all()]
    if shown:
        places, texts, shades = zip(*shown, strict=True)
        chart.texts(f"{name}/labels", np.array(places), [clean_text(text) for text in texts], shades)


_DRAWN: dict[type[AnyMark], Callable[[Chart, str, list[Any], float], None]] = {
    marks.Curve: _curves,
    marks.Dots: _dots,
    marks.Band: _bands,
    marks.Histogram: _histograms,
    marks.Lanes: _lanes,
    marks.Spans: _spans,
    marks.Limit: _limits,
    marks.Bars: _bars,
    marks.Intervals: _intervals,
    marks.Points: _points,
    marks.Outlines: _outlines,
    marks.Cells: _cells,
    marks.Told: _told,
}
