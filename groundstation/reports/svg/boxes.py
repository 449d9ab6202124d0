"""Places of frames in a picture.

Room for the texts around them, columns that agree, windows; in points.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.plots import extents
from groundstation.plots.marks import Cells, Floats
from groundstation.plots.plot import WIDTH_MM, Panel, Plot, Row
from groundstation.plots.scales import ScaleSpan
from groundstation.reports.svg.font import LINE_SHARE, SIZE_PT, TITLE_PT, label, lines_of, width_pt
from groundstation.reports.svg.legend import LINE_PT, Entry, above, beside_pt, entries_of
from groundstation.reports.svg.ticks import Tick, own_ticks, ticks_of

PT_PER_MM = 72.0 / 25.4
WIDTH_PT = WIDTH_MM * PT_PER_MM
TICK_PT, TO_TEXT_PT, TO_TITLE_PT = 3.0, 2.5, 3.5
EDGE_PT, BETWEEN_PT, ROWS_PT = 11.0, 14.0, 11.0  # right of the last frame, between frames, between rows
LEAST_PT, WINDOWS_PT, LEAST_WINDOW_PT = 24.0, 9.0 * PT_PER_MM, 20.0 * PT_PER_MM
BAR_PT, TO_BAR_PT = 4.0 * PT_PER_MM, 10.0  # the scale of cells
SCALE_PT = TO_BAR_PT + BAR_PT + 46.0
MOST_OF_A_NAME, MOST_OF_A_TITLE = 44, 90
_Rooms: TypeAlias = list[list[float]]  # of each panel, by rows


@dataclass(frozen=True)
class Box:
    """One frame: a window of a panel.

    Places are points from the upper left corner of the picture.
    """

    panel: Panel
    left: float
    top: float
    width: float
    height: float
    x: ScaleSpan
    y: ScaleSpan
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    has_x_texts: bool
    has_y_texts: bool
    x_title: str
    y_title: str

    def across(self, values: Floats) -> Floats:
        """Return points from the left edge of the picture."""
        return np.asarray(self.left + self.width * self.x.shares(values))

    def down(self, values: Floats) -> Floats:
        """Return points from the upper edge of the picture."""
        return np.asarray(self.top + self.height * (1.0 - self.y.shares(values)))

    @property
    def bottom(self) -> float:
        """Points of its lower edge from the upper one of the picture."""
        return self.top + self.height

    @property
    def right(self) -> float:
        """Points of its right edge from the left one of the picture."""
        return self.left + self.width


@dataclass(frozen=True)
class PlacedPanel:
    """One panel: its frames from the left, and the texts above and beside them."""

    panel: Panel
    boxes: tuple[Box, ...]
    title: str
    entries: tuple[Entry, ...]
    lines: tuple[tuple[Entry, ...], ...]  # of the legend above, from the top
    has_own_line: bool  # the title stands above the legend
    has_scale: bool  # of cells, beside it

    @property
    def right(self) -> float:
        """Points of its right edge from the left one of the picture."""
        return self.boxes[-1].right


@dataclass(frozen=True)
class _Told:
    """A panel before it has a place."""

    panel: Panel
    x: ScaleSpan
    y: tuple[ScaleSpan, ...]  # in each window of the other axis
    y_ticks: tuple[tuple[Tick, ...], ...]
    entries: tuple[Entry, ...]
    has_x_texts: bool
    has_scale: bool
    left_pt: float
    right_pt: float


def placed(plot: Plot) -> tuple[tuple[PlacedPanel, ...], float]:
    """Return all panels with their places, row by row, and the height of the picture, points."""
    rows, lefts, rights, widths = _with_room(plot)
    found: list[PlacedPanel] = []
    y = 4.0
    for number, (row, told) in enumerate(zip(plot.rows, rows, strict=True)):
        height = max(row.height_mm * PT_PER_MM, 4.0)
        x = 0.0
        line: list[PlacedPanel] = []
        for column, one in enumerate(told):
            x += lefts[number][column] + (BETWEEN_PT if column else 0.0)
            gap = max(_gap_pt(rows[place][column]) for place in _chain(plot, number, column))
            line.append(_placed(one, x, widths[number][column], height, gap))
            x += widths[number][column] + rights[number][column]
        y += max((_above_pt(one) for one in line), default=0.0)
        found += [replace(one, boxes=tuple(replace(box, top=y) for box in one.boxes)) for one in line]
        y += height + max((_below_pt(one) for one in line), default=0.0)
        y += 0.0 if number == len(rows) - 1 else ROWS_PT if row.shares_x else 0.5 * ROWS_PT
    return tuple(found), y + 3.0


def _with_room(plot: Plot) -> tuple[list[list[_Told]], _Rooms, _Rooms, _Rooms]:
    """Return all panels, the room left and right of them and their widths.

    Maps leave room for the numbers of their final axes.
    """
    rows = _told(plot)
    for _ in range(2):
        lefts, rights = _columns(plot, rows)
        widths = [_widths(plot, row, lefts, rights) for row in range(len(rows))]
        grown = _maps(plot, rows, widths)
        rows = [
            [replace(one, left_pt=max(one.left_pt, other.left_pt)) for one, other in zip(*pair, strict=True)]
            for pair in zip(rows, grown, strict=True)
        ]
    return grown, lefts, rights, widths


def _told(plot: Plot) -> list[list[_Told]]:
    rows: list[list[_Told]] = []
    for number, row in enumerate(plot.rows):
        line = []
        for column, panel in enumerate(row.panels):
            chain = [plot.rows[place].panels[column] for place in _chain(plot, number, column)]
            drawn = np.concatenate([extents.x_extent(one.marks) for one in chain])
            x = extents.x_span(chain[-1], drawn)
            y = extents.y_spans(panel, len(extents.windows_of(panel, x)))
            ticks = tuple(_y_ticks(panel, span, row.height_mm * PT_PER_MM) for span in y)
            entries = entries_of(panel)
            left = _left_pt(panel, ticks[0], row.height_mm * PT_PER_MM)
            right = beside_pt(entries) if panel.legend == "beside" else 0.0
            has_scale = _has_scale(row, column)
            right += SCALE_PT if has_scale else 0.0
            line.append(_Told(panel, x, y, ticks, entries, not row.shares_x, has_scale, left, right))
        rows.append(line)
    return rows


def _chain(plot: Plot, row: int, column: int) -> range:
    """Return the rows whose panel in a column shares its horizontal axis with that of a row.

    The rows are in order from the top.
    """
    first = last = row
    while first and plot.rows[first - 1].shares_x and column < len(plot.rows[first - 1].panels):
        first -= 1
    while plot.rows[last].shares_x and last + 1 < len(plot.rows) and column < len(plot.rows[last + 1].panels):
        last += 1
    return range(first, last + 1)


def _y_ticks(panel: Panel, span: ScaleSpan, length_pt: float) -> tuple[Tick, ...]:
    names = extents.names_of(panel)
    if names:
        return tuple((place, label(name, MOST_OF_A_NAME)) for place, name in names if np.isfinite(place))
    if panel.y.ticks:
        return own_ticks(panel.y.ticks)
    return () if panel.nothing and not panel.marks else ticks_of(span, length_pt, is_upright=True)


def widest(ticks: Sequence[Tick]) -> float:
    """Return the width of the longest text among ticks, points."""
    return max((width_pt(text) for _, text in ticks), default=0.0)


def title_lines(title: str, room_pt: float) -> list[str]:
    """Return the title of an upright axis in as many lines as it needs."""
    return lines_of(label(title, MOST_OF_A_TITLE), room_pt) if title else []


def _left_pt(panel: Panel, ticks: Sequence[Tick], height_pt: float) -> float:
    """Return the room left of a panel for its numbers and its title."""
    return TICK_PT + TO_TEXT_PT + widest(ticks) + _title_pt(panel, height_pt)


def _title_pt(panel: Panel, height_pt: float) -> float:
    lines = len(title_lines(panel.y.title, height_pt + 16.0))
    return TO_TITLE_PT + LINE_SHARE * SIZE_PT * lines if lines else 0.0


def scale_of(panel: Panel) -> Cells | None:
    """Return the cells whose scale stands beside a panel, None without any."""
    return next((mark for mark in panel.marks if isinstance(mark, Cells)), None)


def _has_scale(row: Row, column: int) -> bool:
    """Tell whether the scale of cells stands beside a panel.

    Several alike in a row have one, beside the last.
    """
    here = [scale_of(panel) for panel in row.panels[column : column + 2]]
    alike = [(one.low, one.high, one.title, one.is_log) for one in here if one is not None]
    return here[0] is not None and (len(alike) < 2 or alike[0] != alike[1])


def _columns(plot: Plot, rows: list[list[_Told]]) -> tuple[_Rooms, _Rooms]:
    """Return the room left and right of each panel, equal for panels above each other.

    Rows count together only where their panels are equal.
    """
    keys = [_shares(row) for row in plot.rows]
    lefts = [
        [
            max(
                (rows[other][column].left_pt for other in _alike(keys, row, column) if column < len(rows[other])),
                default=0.0,
            )
            for column in range(len(keys[row]))
        ]
        for row in range(len(rows))
    ]
    rights = [
        [
            max(
                (
                    one[column].right_pt
                    for one, key in zip(rows, keys, strict=True)
                    if key == keys[row] and column < len(one)
                ),
                default=0.0,
            )
            for column in range(len(keys[row]))
        ]
        for row in range(len(rows))
    ]
    return lefts, rights


def _shares(row: Row) -> tuple[float, ...]:
    """Return shares of the width of a row, those of columns without a panel among them."""
    shares = [round(max(panel.share, 1e-3), 3) for panel in row.panels]
    return (*shares, *[1.0] * (row.columns - len(shares)))


def _alike(keys: Sequence[tuple[float, ...]], row: int, column: int) -> list[int]:
    return [other for other, key in enumerate(keys) if key and (key == keys[row] or not column)]


def _widths(plot: Plot, row: int, lefts: _Rooms, rights: _Rooms) -> list[float]:
    shares = _shares(plot.rows[row])
    room = WIDTH_PT - EDGE_PT - sum(lefts[row]) - sum(rights[row]) - BETWEEN_PT * (len(shares) - 1)
    return [max(room * share / sum(shares), LEAST_PT) for share in shares]


def _maps(plot: Plot, rows: list[list[_Told]], widths: _Rooms) -> list[list[_Told]]:
    """Return the panels, both axes of maps at one scale.

    A panel that shares the axis of a map shows the same range.
    """
    rows = [list(row) for row in rows]
    for number, row in enumerate(plot.rows):
        for column, told in enumerate(rows[number]):
            if not told.panel.is_map or len(told.y) > 1 or {told.x.scale, told.y[0].scale} != {"linear"}:
                continue
            x, y = extents.equal(told.x, told.y[0], widths[number][column], row.height_mm * PT_PER_MM)
            ticks = _y_ticks(told.panel, y, row.height_mm * PT_PER_MM)
            left = _left_pt(told.panel, ticks, row.height_mm * PT_PER_MM)
            rows[number][column] = replace(told, x=x, y=(y,), y_ticks=(ticks,), left_pt=left)
            for place in _chain(plot, number, column):
                rows[place][column] = replace(rows[place][column], x=x)
    return rows


def _gap_pt(told: _Told) -> float:
    """Return the room between the windows of a panel, for the numbers of their own ranges."""
    has_own = len(set(told.y)) > 1
    return max(WINDOWS_PT, max(map(widest, told.y_ticks[1:])) + 10.0) if has_own else WINDOWS_PT


def _placed(told: _Told, left: float, width: float, height: float, gap: float) -> PlacedPanel:
    panel = told.panel
    windows = extents.windows_of(panel, told.x)
    lengths = np.array([window.high - window.low for window in windows])
    has_own = len(set(told.y)) > 1
    room = width - gap * (len(windows) - 1)
    widths = np.maximum(np.abs(lengths) / np.abs(lengths).sum() * room, min(LEAST_WINDOW_PT, room / len(windows)))
    widths *= room / widths.sum()
    boxes = []
    columns = zip(windows, widths.tolist(), told.y, told.y_ticks, strict=True)
    for place, (window, wide, upright, ticks) in enumerate(columns):
        is_widest = place == int(np.argmax(widths))
        boxes.append(
            Box(
                *(panel, left, 0.0, wide, height, window, upright),
                x_ticks=_x_ticks(panel, window, wide),
                y_ticks=ticks,
                has_x_texts=told.has_x_texts,
                has_y_texts=has_own or not place,
                x_title=label(panel.x.title, MOST_OF_A_TITLE) if told.has_x_texts and is_widest else "",
                y_title="" if place else label(panel.y.title, MOST_OF_A_TITLE),
            )
        )
        left += wide + gap
    title = label(panel.title, MOST_OF_A_TITLE)
    lines = above(told.entries, width) if panel.legend == "above" else ()
    taken = sum(entry.width_pt for entry in lines[0]) if lines else 0.0
    has_own_line = bool(title and lines) and (len(lines) > 1 or width_pt(title, TITLE_PT, True) + taken + 10.0 > width)
    return PlacedPanel(panel, tuple(boxes), title, told.entries, lines, has_own_line, told.has_scale)


def _x_ticks(panel: Panel, span: ScaleSpan, width: float) -> tuple[Tick, ...]:
    if panel.x.names:
        return tuple((place, label(name, 24)) for place, name in panel.x.names if np.isfinite(place))
    return own_ticks(panel.x.ticks) if panel.x.ticks else ticks_of(span, width, is_upright=False)


def _above_pt(one: PlacedPanel) -> float:
    lines = len(one.lines) + (1 if one.has_own_line or (one.title and not one.lines) else 0)
    return lines * LINE_PT + (3.0 if lines else 0.0)


def _below_pt(one: PlacedPanel) -> float:
    if not one.boxes[0].has_x_texts:
        return 0.0
    text = TICK_PT + TO_TEXT_PT + SIZE_PT
    return text + (LINE_SHARE * SIZE_PT + 2.0 if any(box.x_title for box in one.boxes) else 0.0)
