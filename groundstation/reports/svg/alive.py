"""Panels of a plot for the page's script, and frames of plots that stay pictures.

They come straight from the description of the plot.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.plots.extents import has_rows, names_of
from groundstation.plots.marks import (
    AnyMark,
    Band,
    Cells,
    Curve,
    Dots,
    Floats,
    Histogram,
    Lanes,
    Limit,
    Points,
    Spans,
    Told,
)
from groundstation.plots.ranges import thin
from groundstation.plots.scales import NO_PLACES, ScaleSpan
from groundstation.reports import live
from groundstation.reports.live import TIME, CursorValues, Frame
from groundstation.reports.svg import colours
from groundstation.reports.svg.boxes import PT_PER_MM, Box, PlacedPanel
from groundstation.reports.svg.font import label
from groundstation.reports.svg.legend import MOST_OF_A_NAME, ground
from groundstation.reports.svg.shapes import stepped
from groundstation.reports.svg.thinning import shown_rows

MOST_SAMPLES = 5000
LARGEST = float(np.finfo(np.float32).max)  # that the page holds
_UNTOLD = {"symlog", "date"}  # scales whose values the page does not tell
JUST_BELOW = np.nextafter(np.float32(1.0), np.float32(0.0))


def frames_of(panels: Sequence[PlacedPanel], height_pt: float) -> tuple[Frame, ...]:
    """Return the frames of a picture, except for axes whose values the page does not show."""
    boxes = [box for one in panels for box in one.boxes]
    return tuple(_frame(box, height_pt) for box in boxes if not _UNTOLD & {box.x.scale, box.y.scale})


def panels_of(panels: Sequence[PlacedPanel], height_pt: float) -> tuple[live.LivePanel, ...]:
    """Return the panels of a plot from left to right and from top to bottom.

    Empty where one of them cannot be drawn live.
    """
    found = []
    for one in panels:
        if not can_live(one):
            return ()
        for box in one.boxes:
            curves = [_held(curve) for mark in one.panel.marks for curve in _curves(mark, box)]
            found.append(
                live.LivePanel(
                    **vars(_frame(box, height_pt)),
                    grounds=_grounds(box),
                    marks=_uprights(box),
                    curves=tuple(curves),
                )
            )
    return tuple(found)


def _held(curve: live.LiveCurve) -> live.LiveCurve:
    """Return the curve with numbers that the page holds."""
    x, y, upper = (np.clip(values, -LARGEST, LARGEST) for values in (curve.x, curve.y, curve.upper))
    return replace(curve, x=x, y=y, upper=upper)


def can_live(one: PlacedPanel) -> bool:
    """Tell whether the page's script can draw all marks of a panel.

    It draws lines, dots, bands, lanes.
    """
    panel = one.panel
    if panel.is_map or panel.nothing or panel.x.names or _UNTOLD & {panel.x.scale, panel.y.scale}:
        return False
    has_lanes = any(isinstance(mark, Lanes) for mark in panel.marks)
    if (names_of(panel) or has_rows(panel)) and not has_lanes:
        return False
    return all(_is_known(mark) for mark in panel.marks)


def _is_known(mark: AnyMark) -> bool:
    if isinstance(mark, Curve | Band):
        return _goes_one_way(mark.x)
    if isinstance(mark, Points):
        return not any(mark.labels) and mark.symbol in ("dot", "circle", "ring")
    return isinstance(mark, Dots | Histogram | Lanes | Spans | Limit | Told)


def _goes_one_way(x: Floats) -> bool:
    known = x[np.isfinite(x)]
    steps = np.sign(known[1:] - known[:-1]) if np.all(np.abs(known) <= LARGEST) else np.array([1.0, -1.0])
    return bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))


def _frame(box: Box, height_pt: float) -> Frame:
    left, bottom = box.left / PT_PER_MM, (height_pt - box.bottom) / PT_PER_MM
    names = tuple((float(place), label(name, 44)) for place, name in names_of(box.panel))
    return Frame(
        *(left, bottom, box.width / PT_PER_MM, box.height / PT_PER_MM),
        *(label(box.panel.title, 90) if box.has_y_texts else "", box.x_title, box.y_title),
        *(box.x.scale == "time", box.x.scale == "log", box.y.scale == "log"),
        x_range=_single(box.x),
        y_range=_single(box.y),
        names=names,
        samples=_samples(box),
    )


def _single(span: ScaleSpan) -> tuple[float, float]:
    """Return the ends of a scale as float32 holds them."""
    low, high = (float(np.float32(min(max(end, -LARGEST), LARGEST))) for end in (span.low, span.high))
    return low, high


def _samples(box: Box) -> CursorValues | None:
    """Return the values shown near the cursor: those of samples, else those of cells."""
    told = next((mark for mark in box.panel.marks if isinstance(mark, Told)), None)
    if told is not None:
        columns = told.x, told.y, told.value
        title = TIME if told.is_time else label(told.title)
    else:
        cells = next((mark for mark in box.panel.marks if isinstance(mark, Cells)), None)
        if cells is None or cells.values.shape != (len(cells.y), len(cells.x)):
            return None
        across, up = np.meshgrid(cells.x, cells.y)
        columns, title = (across.ravel(), up.ravel(), cells.values.ravel()), label(cells.title)
    known = np.flatnonzero(np.isfinite(np.array(columns)).all(axis=0))
    rows = known[thin(len(known), MOST_SAMPLES)]
    return CursorValues(title, *(np.clip(column[rows], -LARGEST, LARGEST) for column in columns))


def _grounds(box: Box) -> tuple[tuple[float, float, str, str], ...]:
    """Return shaded spans; a kind that the legend names has its name."""
    found = []
    for mark in box.panel.marks:
        if isinstance(mark, Spans):
            for low, high, kind in zip(mark.start.tolist(), mark.end.tolist(), mark.kind.tolist(), strict=True):
                if np.isfinite(low) and np.isfinite(high):
                    colour, opacity = colours.shade_of(kind, mark.role, mark.emphasis)
                    shade = colour if opacity == 1.0 else colours.with_alpha(colour, opacity)
                    found.append((low, high, shade, ground(mark, kind).name if mark.name else ""))
    return tuple(found)


def _uprights(box: Box) -> tuple[tuple[float, str], ...]:
    limits = (mark for mark in box.panel.marks if isinstance(mark, Limit) and mark.is_upright)
    return tuple((float(mark.value), colours.COLOURS[mark.role]) for mark in limits if np.isfinite(mark.value))


def _curves(mark: AnyMark, box: Box) -> list[live.LiveCurve]:
    colour, name = colours.COLOURS[mark.role], label(mark.name, MOST_OF_A_NAME)
    width = colours.LINE_PT[mark.emphasis]
    if isinstance(mark, Curve):
        share = colours.LINE[mark.emphasis]
        stroke = colour if share == 1.0 else colours.with_alpha(colour, share)
        return [live.LiveCurve("line", name, stroke, width, bool(mark.dash), *_line(mark, box), NO_PLACES)]
    if isinstance(mark, Dots | Points):
        size = colours.DOT_PT[mark.emphasis] if isinstance(mark, Dots) else 3.0
        known = np.flatnonzero(_has_place(mark.x, box.x.scale) & _has_place(mark.y, box.y.scale))
        rows = known[thin(len(known), MOST_SAMPLES)]
        rows = rows[np.argsort(mark.x[rows], kind="stable")]
        return [live.LiveCurve("dots", name, colour, size, False, mark.x[rows], mark.y[rows], NO_PLACES)]
    if isinstance(mark, Band):
        shade = colours.with_alpha(colour, colours.SHADE[mark.emphasis])
        return [live.LiveCurve("band", name, shade, 0.0, False, *_band(mark, box))]
    if isinstance(mark, Histogram):
        return [live.LiveCurve("band", name, colours.with_alpha(colour, 0.19), 0.0, False, *_bars(mark))]
    if isinstance(mark, Limit) and not mark.is_upright and np.isfinite(mark.value):
        ends = np.sort(np.array([box.x.low, box.x.high]))
        return [
            live.LiveCurve(
                "line",
                name or label(mark.label, MOST_OF_A_NAME),
                colour,
                colours.LIMIT_PT[mark.emphasis],
                bool(mark.dash),
                ends,
                np.full(2, mark.value),
                NO_PLACES,
            )
        ]
    return _lanes(mark) if isinstance(mark, Lanes) else []


def _has_place(values: Floats, scale: str) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    with np.errstate(invalid="ignore"):
        return (np.abs(values) <= LARGEST) & ((values > 0.0) | (scale != "log"))


def _line(mark: Curve, box: Box) -> tuple[Floats, Floats]:
    """Return the samples of a curve from left to right.

    A gap gets a sample of its own in its middle, NaN in y.
    """
    x = np.where(_has_place(mark.x, box.x.scale), mark.x, np.nan)
    y = np.where(_has_place(mark.y, box.y.scale), mark.y, np.nan)
    if _is_backwards(x):
        x, y = x[::-1], y[::-1]
    rows, starts = shown_rows(x, y, MOST_SAMPLES)
    x, y = x[rows], y[rows]
    if mark.steps:
        x, y, starts = stepped(x, y, starts)
        x = _one_after_another(x)
    breaks = np.flatnonzero(starts)[1:]
    if not len(breaks):
        return x, y
    return np.insert(x, breaks, 0.5 * (x[breaks - 1] + x[breaks])), np.insert(y, breaks, np.nan)


def _is_backwards(x: Floats) -> bool:
    known = x[np.isfinite(x)]
    return bool(known.size > 1 and known[0] > known[-1])


def _band(mark: Band, box: Box) -> tuple[Floats, Floats, Floats]:
    known = _has_place(mark.x, box.x.scale) & _has_place(mark.low, box.y.scale) & _has_place(mark.high, box.y.scale)
    x, low, high = np.where(known, mark.x, np.nan), mark.low, mark.high
    if _is_backwards(x):
        x, low, high = x[::-1], low[::-1], high[::-1]
    rows, starts = shown_rows(x, low, MOST_SAMPLES)
    x, low, high = x[rows], low[rows], high[rows]
    if mark.steps:
        (x, low, starts), high = stepped(x, low, starts), stepped(x, high, starts)[1]
        x = _one_after_another(x)
    breaks = np.flatnonzero(starts)[1:]
    x = np.insert(x, breaks, 0.5 * (x[breaks - 1] + x[breaks]))
    return x, np.insert(low, breaks, np.nan), np.insert(high, breaks, np.nan)


def _one_after_another(x: Floats) -> Floats:
    """Return the places of steps; of two at one place the first moves just before the second."""
    if not x.size:
        return x
    inner = x.copy()
    is_double = np.append(x[1:] == x[:-1], False)
    inner[is_double] -= (1.0 - JUST_BELOW) * np.maximum(np.abs(x[is_double]), 1e-30)
    return np.asarray(np.maximum.accumulate(inner))


def _bars(mark: Histogram) -> tuple[Floats, Floats, Floats]:
    if len(mark.edges) != len(mark.heights) + 1 or not len(mark.heights):
        return NO_PLACES, NO_PLACES, NO_PLACES
    x = _one_after_another(np.repeat(mark.edges, 2)[1:-1])
    return x, np.zeros(len(x)), np.repeat(np.nan_to_num(mark.heights), 2)


def _lanes(mark: Lanes) -> list[live.LiveCurve]:
    found = []
    for place, name in enumerate(mark.order):
        rows = np.flatnonzero((mark.state == name) & np.isfinite(mark.start) & np.isfinite(mark.end))
        rows = rows[thin(len(rows), MOST_SAMPLES)]
        if len(rows):
            colour = colours.COLOURS[mark.roles.get(name, mark.role)]
            heights = np.full(len(rows), float(place))
            found.append(live.LiveCurve("lanes", "", colour, 7.0, False, mark.start[rows], heights, mark.end[rows]))
    return found
