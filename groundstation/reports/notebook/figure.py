"""Plot as a matplotlib figure, with all samples.

Frames, ticks, legends and labels are those of the page's picture. matplotlib is used through its object-oriented
interface alone: no pyplot, no global figure.
"""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedFormatter, FixedLocator, Formatter, Locator, NullLocator
from matplotlib.transforms import ScaledTranslation

from groundstation.plots.extents import has_rows, names_of
from groundstation.plots.marks import Cells
from groundstation.plots.plot import Plot
from groundstation.plots.scales import ScaleSpan
from groundstation.reports.notebook.shapes import ABOVE_ALL, draw, handle_of
from groundstation.reports.svg import boxes as b
from groundstation.reports.svg.boxes import Box, PlacedPanel
from groundstation.reports.svg.cells import span_of_colours
from groundstation.reports.svg.colours import EDGE, FAINT, GRID, INK, PAPER
from groundstation.reports.svg.font import SIZE_PT, TITLE_PT, label, lines_of, middle
from groundstation.reports.svg.labels import HALO_PT, labels_of
from groundstation.reports.svg.legend import BETWEEN_PT, GAP_PT, LINE_PT, SIGN_PT, Entry
from groundstation.reports.svg.map_scale import BAR_PT, END_PT, NORTH, map_scale_of
from groundstation.reports.svg.ticks import ticks_of

SHOWN_DPI = 144  # sharp on screens of two pixels a point
POINTS_PER_INCH = 72.0
COLOUR_BAR = "<colorbar>"  # as matplotlib names the axes of its own
MARGIN_PT = 4.0  # left and right of what the page has: matplotlib's letters are a little wider
WHOLE_WIDTH_PT = b.WIDTH_PT + 2.0 * MARGIN_PT
ABOVE_PT, BESIDE_PT = 3.0, 8.0  # from a frame to what is written above and beside it
Corner: TypeAlias = Literal["lower right", "upper left"]
STYLE: dict[str, Any] = {
    "text.parse_math": False,  # a dollar sign in a topic's name is a dollar sign
    "text.color": INK,
    "font.family": "DejaVu Sans",
    "font.size": SIZE_PT,
    "lines.scale_dashes": False,
    "axes.facecolor": "none",
    "axes.titlesize": TITLE_PT,
    "axes.titleweight": "bold",
    "axes.labelcolor": INK,
    "axes.labelpad": b.TO_TITLE_PT,
    "axes.edgecolor": EDGE,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    **{f"{axis}tick.color": EDGE for axis in "xy"},
    **{f"{axis}tick.labelcolor": INK for axis in "xy"},
    **{f"{axis}tick.major.width": 0.6 for axis in "xy"},
    **{f"{axis}tick.major.size": b.TICK_PT for axis in "xy"},
    **{f"{axis}tick.major.pad": b.TO_TEXT_PT for axis in "xy"},
    "legend.frameon": False,
    "legend.fontsize": SIZE_PT,
    "legend.borderpad": 0.0,
    "legend.borderaxespad": 0.0,
    "legend.handlelength": SIGN_PT / SIZE_PT,
    "legend.handletextpad": GAP_PT / SIZE_PT,
    "legend.columnspacing": BETWEEN_PT / SIZE_PT,
    "legend.labelspacing": 0.3,
}


class NotebookFigure(Figure):
    """Matplotlib figure that a notebook shows without pyplot, on white.

    The background of the notebook has no effect.
    """

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with _style():
            self.savefig(buffer, format="png", dpi=SHOWN_DPI, facecolor=self.get_facecolor())
        return buffer.getvalue()


def figure_of(plot: Plot) -> NotebookFigure:
    """Paint a plot; the figure may be changed and saved like any other of matplotlib's."""
    panels, height = b.placed(plot)
    with _style():
        size = (WHOLE_WIDTH_PT / POINTS_PER_INCH, height / POINTS_PER_INCH)
        figure = NotebookFigure(figsize=size, facecolor=PAPER)
        drawn = iter([_panel(figure, one, height) for one in panels])
        rows = [[next(drawn) for _ in row.panels] for row in plot.rows]
        for row, upper, lower in zip(plot.rows, rows, rows[1:], strict=False):
            for above, below in zip(upper, lower, strict=False) if row.shares_x else ():
                for axes, other in zip(above, below, strict=False):
                    axes.sharex(other)
        figure.draw_without_rendering()  # ticks are made when first drawn, in the style of that moment
    return figure


@contextmanager
def _style() -> Iterator[None]:
    """Set matplotlib's look to the report's for a while.

    The user's matplotlibrc has no effect.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)  # type: ignore[arg-type]
        yield


class _Places(Locator):
    """Places of ticks as the page has them, wherever the axis is moved."""

    def __init__(self, span: ScaleSpan, *, is_upright: bool) -> None:
        self.span, self.is_upright = span, is_upright
        self.texts: dict[float, str] = {}

    def __call__(self) -> Sequence[float]:
        return self.tick_values(*self.axis.get_view_interval())  # type: ignore[union-attr]

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Return places between two ends, by the length that the axis has now."""
        size = self.axis.axes.bbox  # type: ignore[union-attr]
        pixels = size.height if self.is_upright else size.width
        length_pt = POINTS_PER_INCH * pixels / self.axis.get_figure(root=True).dpi  # type: ignore[union-attr]
        span = ScaleSpan(self.span.scale, float(vmin), float(vmax), self.span.linear_to)
        self.texts = dict(ticks_of(span, max(length_pt, 1.0), is_upright=self.is_upright))
        return list(self.texts)


class _Texts(Formatter):
    """Formatter of the texts at the places of a locator."""

    def __init__(self, places: _Places) -> None:
        self.places = places

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self.places.texts.get(float(x), f"{x:g}")


def _panel(figure: Figure, one: PlacedPanel, height: float) -> list[Axes]:
    found = [_frame(figure, box, height) for box in one.boxes]
    if one.title:
        lines = len(one.lines) if one.has_own_line else 0
        pad = ABOVE_PT + LINE_PT * (0.5 + lines) - middle(TITLE_PT)
        found[0].set_title(one.title, loc="left", pad=pad)
    for place, line in enumerate(one.lines):
        _legend(found[-1], line, "lower right", (0.0, ABOVE_PT + LINE_PT * (len(one.lines) - 1 - place)))
    if one.panel.legend == "beside" and one.entries:
        across = BESIDE_PT + (b.SCALE_PT if one.has_scale else 0.0)
        _legend(found[-1], one.entries, "upper left", (across, 0.0))
    cells = b.scale_of(one.panel)
    if cells is not None and one.has_scale:
        _scale_beside(figure, cells, found[-1], one.boxes[-1], height)
    return found


def _frame(figure: Figure, box: Box, height: float) -> Axes:
    panel = box.panel
    axes = figure.add_axes(_place(box.left, box.bottom, box.width, box.height, height))
    for axis, span, is_upright in ((axes.xaxis, box.x, False), (axes.yaxis, box.y, True)):
        if span.scale in ("log", "symlog"):
            more = {"linthresh": span.linear_to, "linscale": 1.0} if span.scale == "symlog" else {}
            (axes.set_yscale if is_upright else axes.set_xscale)(span.scale, **more)
        told = panel.y if is_upright else panel.x
        is_told = bool(told.ticks or told.names or (is_upright and (names_of(panel) or not box.y_ticks)))
        _ticks(axis, span, (box.y_ticks if is_upright else box.x_ticks) if is_told else None, is_upright=is_upright)
    axes.set_xlim(box.x.low, box.x.high)
    axes.set_ylim(box.y.low, box.y.high)
    if panel.is_map and {box.x.scale, box.y.scale} == {"linear"}:
        axes.set_aspect("equal", adjustable="datalim")
    has_grid, is_named = not any(isinstance(mark, Cells) for mark in panel.marks), bool(names_of(panel))
    axes.grid(has_grid, axis="x")
    axes.grid(has_grid and not (is_named or has_rows(panel)), axis="y")
    axes.tick_params("x", labelbottom=box.has_x_texts)
    axes.tick_params("y", labelleft=box.has_y_texts, length=0.0 if is_named else b.TICK_PT)
    axes.set_xlabel(box.x_title)
    axes.set_ylabel("\n".join(b.title_lines(box.y_title, box.height + 2.0 * SIZE_PT)))
    for place, mark in enumerate(panel.marks):
        draw(mark, axes, box, place)
    axes.set(xlim=(box.x.low, box.x.high), ylim=(box.y.low, box.y.high))
    _labels(axes, box, height)
    _map_scale(axes, box)
    if panel.nothing:
        told_lines = "\n".join(lines_of(label(panel.nothing, 200), box.width - SIZE_PT, 4))
        axes.text(0.5, 0.5, told_lines, transform=axes.transAxes, ha="center", va="center", color=FAINT)
    return axes


def _place(left: float, bottom: float, wide: float, high: float, height: float) -> tuple[float, float, float, float]:
    """Return shares of a figure from points, which are counted from its upper left corner."""
    return (MARGIN_PT + left) / WHOLE_WIDTH_PT, 1.0 - bottom / height, wide / WHOLE_WIDTH_PT, high / height


def _ticks(axis: Axis, span: ScaleSpan, ticks: Sequence[tuple[float, str]] | None, *, is_upright: bool) -> None:
    """Set ticks at given places, else where the page has them."""
    axis.set_minor_locator(NullLocator())
    if ticks is None:
        places = _Places(span, is_upright=is_upright)
        axis.set_major_locator(places)
        axis.set_major_formatter(_Texts(places))
    else:
        axis.set_major_locator(FixedLocator([place for place, _ in ticks]))
        axis.set_major_formatter(FixedFormatter([text for _, text in ticks]))


def _legend(axes: Axes, entries: Sequence[Entry], corner: Corner, offset_pt: tuple[float, float]) -> None:
    """Draw one line or one column of a legend, off the upper right corner of a frame."""
    inches = axes.get_figure(root=True).dpi_scale_trans  # type: ignore[union-attr]
    shift = ScaledTranslation(offset_pt[0] / POINTS_PER_INCH, offset_pt[1] / POINTS_PER_INCH, inches)
    columns = len(entries) if corner == "lower right" else 1
    legend = Legend(
        axes,
        [handle_of(entry) for entry in entries],
        [entry.name for entry in entries],
        loc=corner,
        ncols=columns,
        bbox_to_anchor=(1.0, 1.0),
        bbox_transform=axes.transAxes + shift,
    )
    axes.add_artist(legend)


def _labels(axes: Axes, box: Box, height: float) -> None:
    """Draw labels that stay at their places when the axes are moved."""
    pixels = axes.get_figure(root=True).dpi / POINTS_PER_INCH  # type: ignore[union-attr]
    to_data = axes.transData.inverted()
    for one in labels_of(box):
        x, y = to_data.transform((pixels * (MARGIN_PT + one.x), pixels * (height - one.y)))
        axes.annotate(
            one.text,
            (float(x), float(y)),
            (one.left - one.x, one.y - one.base),
            textcoords="offset points",
            color=one.colour,
            path_effects=[withStroke(linewidth=HALO_PT, foreground=PAPER)],
        )


def _map_scale(axes: Axes, box: Box) -> None:
    """Draw scale bar and arrow of a map, which stay at their places when the axes are moved."""
    scale = map_scale_of(box)
    if scale is None:
        return
    halo = [withStroke(linewidth=BAR_PT + HALO_PT, foreground=PAPER)]
    left, bottom = _value(box, scale.left, scale.bottom)
    right, upper = _value(box, scale.right, scale.bottom - END_PT)
    look: dict[str, Any] = {"color": INK, "path_effects": halo, "zorder": ABOVE_ALL + 1.0}
    axes.plot([left, left, right, right], [upper, bottom, bottom, upper], linewidth=BAR_PT, **look)
    arrow = [_value(box, *corner) for corner in scale.corners]
    axes.add_patch(Polygon(arrow, closed=True, linewidth=0.0, **look))
    for text, x, base in ((scale.text, scale.middle, scale.number_base), (NORTH, scale.arrow, scale.letter_base)):
        place = _value(box, x, scale.bottom)
        beside = (0.0, scale.bottom - base)
        axes.annotate(text, place, beside, textcoords="offset points", ha="center", va="baseline", **look)


def _value(box: Box, x: float, y: float) -> tuple[float, float]:
    """Return the values of both axes at a place in points."""
    across, up = (x - box.left) / box.width, (box.bottom - y) / box.height
    return box.x.low + across * (box.x.high - box.x.low), box.y.low + up * (box.y.high - box.y.low)


def _scale_beside(figure: Figure, cells: Cells, axes: Axes, box: Box, height: float) -> None:
    mesh = next((one for one in axes.collections if isinstance(one, QuadMesh)), None)
    if mesh is None:
        return
    place = _place(box.right + b.TO_BAR_PT, box.bottom, b.BAR_PT, box.height, height)
    beside = figure.add_axes(place, label=COLOUR_BAR)
    figure.colorbar(mesh, cax=beside)
    _ticks(beside.yaxis, span_of_colours(cells), None, is_upright=True)
    beside.set_ylabel(label(cells.title, b.MOST_OF_A_TITLE))
