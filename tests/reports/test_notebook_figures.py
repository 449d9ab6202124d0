"""Plots as matplotlib figures: every series with all its samples, axes as described, no text beyond the edges."""

import dataclasses
from collections.abc import Callable, Iterator
from itertools import chain, combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection, QuadMesh
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import StepPatch
from matplotlib.text import Text

from groundstation.plots import marks
from groundstation.plots.extents import edges
from groundstation.plots.marks import AnyMark, Floats, Points
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.reports.notebook.figure import COLOUR_BAR, figure_of
from groundstation.reports.svg.colours import COLOURS, PAPER
from groundstation.reports.svg.legend import entries_of
from groundstation.systems import systems
from tests.every_mark import DRAWN, X, Y, empty, plot_of
from tests.plot_cases import CASES, names_of
from tests.reports.test_fleet_report import fleet_of
from tests.told import PLOTS

ROUNDING = {"rtol": 1e-9, "atol": 1e-9}
POINTS_PER_INCH = 72.0
MEET_PT = 2.5  # letters do not touch while the boxes about two lines, empty above and below, share less
FEWEST = {"report": 24, "magnetic": 18, "bare": 0}  # plots of a case, else two
QUICK = ("report", "landing", "placement", "session", "bare", "fleet")  # figures of every kind of mark


def of_case(case: str) -> Iterator[Plot]:
    results = CASES[case]()
    for name, describe in PLOTS.items():
        told: Any = describe
        plots = (told(results, *of) for of in names_of(name, results))
        yield from (plot for plot in plots if plot is not None)


def of_fleet() -> Iterator[Plot]:
    fleet = fleet_of(60)
    for name in systems().fleet_plots:
        if name not in ("fleet.trend", "fleet.deviation", "fleet.installation", "fleet.units"):
            describe: Any = systems().fleet_plots[name]
            plot = describe(fleet)
            assert plot is not None
            yield plot


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "case", [*QUICK, *(pytest.param(case, marks=pytest.mark.slow) for case in CASES if case not in QUICK)]
)
def test_a_figure_shows_what_is_described(case: str) -> None:
    plots = list(of_fleet() if case == "fleet" else of_case(case))
    assert len(plots) >= FEWEST.get(case, 2)
    for plot in plots:
        figure = figure_of(plot)
        for panel, windows in framed(plot, figure):
            for axes in windows:
                for mark in panel.marks:
                    is_there(mark, axes, plot.name)
            has_words_and_ends(plot, panel, windows)
        texts_have_room(figure, plot.name)


def has_words_and_ends(plot: Plot, panel: Panel, windows: list[Axes]) -> None:
    """Check titles with their units, legend, ranges and the reason of an empty panel."""
    assert windows[0].get_ylabel().replace("\n", " ") == panel.y.title
    told = {axes.get_xlabel() for axes in windows} - {""}
    assert told <= {panel.x.title} and (told or is_shared(plot, panel) or not panel.x.title)
    assert windows[0].get_title(loc="left") == panel.title
    assert in_legends(windows) == [entry.name for entry in entries_of(panel)]
    for place, axes in enumerate(windows):
        same_ends(axes.get_xlim(), panel.x, panel, panel.x.windows[place : place + 1])
        same_ends(axes.get_ylim(), panel.y, panel, panel.y.ranges[place : place + 1])
        if panel.nothing:
            assert panel.nothing in {text.get_text().replace("\n", " ") for text in axes.texts}


def texts_have_room(figure: Figure, where: str) -> None:
    """Check that no text is cut at the edges and that none meets another; labels of points apart."""
    figure.draw_without_rendering()
    width, height = figure.bbox.width, figure.bbox.height
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts_of(figure)]
    for text, box in boxes:
        assert box.x0 >= 0.0 and box.x1 <= width and box.y0 >= 0.0 and box.y1 <= height, (where, text)
    pixels = MEET_PT * figure.dpi / POINTS_PER_INCH
    for (text, one), (other_text, other) in combinations(boxes, 2):
        across, up = min(one.x1, other.x1) - max(one.x0, other.x0), min(one.y1, other.y1) - max(one.y0, other.y0)
        assert across < pixels or up < pixels, (where, text, other_text)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize("scale", ["linear", "log", "symlog", "time", "angle", "date"])
def test_every_mark_stands_on_every_scale_and_draws_nothing_where_it_is_empty(name: str, scale: Any) -> None:
    mark = DRAWN[name]
    axes = figure_of(plot_of(mark, x=Axis("across", scale))).axes[0]
    is_there(mark, axes, name)
    nothing = empty(mark)
    assert nothing is not None
    figure_of(plot_of(nothing, y=Axis("up", "linear" if scale == "time" else scale))).draw_without_rendering()


@pytest.mark.parametrize("name", [name for name in DRAWN if "limit" not in name])
def test_every_mark_is_seen(name: str) -> None:
    def ink(*drawn: AnyMark) -> int:
        canvas = FigureCanvasAgg(
            figure_of(plot_of(*drawn, x=Axis("", "linear", -1.0, 6.0), y=Axis("", low=-1, high=7)))
        )
        canvas.draw()
        return int((np.asarray(canvas.buffer_rgba())[:, :, :3] < 250).any(axis=2).sum())

    nothing = empty(DRAWN[name])
    assert nothing is not None and ink(DRAWN[name]) > ink(nothing)


def test_colours_and_widths_are_those_of_the_page() -> None:
    axes = figure_of(plot_of(DRAWN["curve"], DRAWN["dots"], DRAWN["upright limit"])).axes[0]
    curve, dots, limit = axes.lines
    assert [to_hex(str(line.get_color())) for line in axes.lines] == [COLOURS[one] for one in ("ins", "gnss", "limit")]
    assert (curve.get_linewidth(), dots.get_markersize(), limit.get_linewidth()) == (1.1, 1.8, 0.9)
    assert limit.get_zorder() > dots.get_zorder() > curve.get_zorder()


def test_a_sample_between_gaps_is_a_dot() -> None:
    alone = marks.Curve(x=X, y=np.array([1.0, np.nan, 2.0, np.nan, 3.0]))
    whole = marks.Curve(x=X, y=Y)
    assert figure_of(plot_of(alone)).axes[0].lines[0].get_markevery() == [0, 2, 4]
    assert figure_of(plot_of(whole)).axes[0].lines[0].get_marker() == "None"


def test_every_dot_is_seen_in_a_png() -> None:
    three = marks.Dots(x=np.array([1.0, 3.0, 5.0]), y=np.full(3, 2.0), role="ins", emphasis="bold")
    figure = figure_of(plot_of(three, x=Axis("", "linear", 0.0, 6.0), y=Axis("", "linear", 0.0, 4.0)))
    for part in (*figure.axes[0].spines.values(), figure.axes[0].xaxis, figure.axes[0].yaxis):
        part.set_visible(False)
    figure.axes[0].set_title("", loc="left")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    inked = np.asarray(canvas.buffer_rgba())[:, :, 0].min(axis=0) < 128
    assert np.count_nonzero(np.diff(inked.astype(int)) == 1) == 3


def test_ticks_follow_the_axis_that_is_moved() -> None:
    figure = figure_of(plot_of(DRAWN["curve"], x=Axis("flight time, min:s", "time", 0.0, 600.0)))
    axes = figure.axes[0]
    assert "4:00" in shown(axes)
    axes.set_xlim(4000.0, 4060.0)
    assert "1:07:00" in shown(axes) and "4:00" not in shown(axes)
    angle = figure_of(plot_of(DRAWN["curve"], x=Axis("heading, °", "angle", 0.0, 360.0))).axes[0]
    assert shown(angle)[:3] == ["0", "30", "60"]


def shown(axes: Axes) -> list[str]:
    axes.get_figure(root=True).draw_without_rendering()  # type: ignore[union-attr]
    low, high = sorted(axes.get_xlim())
    return [tick.label1.get_text() for tick in axes.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]


def test_a_broken_axis_has_a_frame_for_each_window_and_a_map_one_scale() -> None:
    axis = Axis("flight time, min:s", "time", 0.0, 600.0, windows=((0.0, 60.0), (400.0, 600.0)))
    first, second = figure_of(plot_of(DRAWN["curve"], x=axis, y=Axis("up", ranges=((0.0, 6.0), (9.0, 3.0))))).axes
    assert (first.get_xlim(), second.get_xlim()) == ((0.0, 60.0), (400.0, 600.0))
    assert (first.get_ylim(), second.get_ylim()) == ((0.0, 6.0), (9.0, 3.0))
    plot = Plot("a", "A", "", "", one_panel(Panel([DRAWN["outlines"]], is_map=True), 60.0))
    chart = figure_of(plot).axes[0]
    chart.set_xlim(0.0, 40.0)
    chart.get_figure(root=True).draw_without_rendering()  # type: ignore[union-attr]
    per_metre = [chart.bbox.width / np.ptp(chart.get_xlim()), chart.bbox.height / np.ptp(chart.get_ylim())]
    assert per_metre[0] == pytest.approx(per_metre[1])


def test_panels_that_share_an_axis_move_together() -> None:
    panel = Panel([DRAWN["curve"]], Axis("across"), Axis("up"))
    figure = figure_of(Plot("a", "A", "", "", (Row((panel,), shares_x=True), Row((panel,)))))
    above, below = figure.axes
    above.set_xlim(1.0, 2.0)
    assert below.get_xlim() == (1.0, 2.0) and (above.get_xlabel(), below.get_xlabel()) == ("", "across")


def test_a_dollar_sign_is_a_dollar_sign_and_a_style_of_the_user_does_not_reach_the_figure() -> None:
    import matplotlib

    plot = plot_of(marks.Curve(x=X, y=Y, name="a $x$"), y=Axis("cost, $m$"))
    with matplotlib.rc_context({"font.size": 30.0, "axes.facecolor": "black", "text.parse_math": True}):
        figure = figure_of(plot)
    assert all(not text.get_parse_math() for text in texts_of(figure))
    assert {text.get_fontsize() for text in texts_of(figure)} == {8.0, 8.5}
    assert to_rgba(figure.get_facecolor()) == to_rgba(PAPER) and to_rgba(figure.axes[0].get_facecolor())[3] == 0.0


def framed(plot: Plot, figure: Figure) -> Iterator[tuple[Panel, list[Axes]]]:
    """Panels with the axes of their windows."""
    left = iter([axes for axes in figure.axes if axes.get_label() != COLOUR_BAR])
    for panel in plot.panels:
        yield panel, [next(left) for _ in panel.x.windows or (None,)]
    assert next(left, None) is None


def is_shared(plot: Plot, panel: Panel) -> bool:
    return any(row.shares_x and any(panel is one for one in row.panels) for row in plot.rows)


def same_ends(ends: tuple[float, float], axis: Axis, panel: Panel, own: tuple[tuple[float, float], ...]) -> None:
    if own:
        np.testing.assert_allclose(ends, own[0], **ROUNDING)
    elif axis.low is not None and axis.high is not None and axis.low != axis.high and not panel.is_map:
        np.testing.assert_allclose(ends, (axis.low, axis.high), **ROUNDING)


def in_legends(windows: list[Axes]) -> list[str]:
    legends = [one for axes in windows for one in axes.get_children() if isinstance(one, Legend)]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def texts_of(figure: Figure) -> list[Text]:
    """Texts that are seen: numbers, titles, legends, labels."""
    found: list[Text] = []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = (tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)
            found += [tick.label1 for tick in ticks if tick.label1.get_visible()]
            found.append(axis.label)
        legends = (one for one in axes.get_children() if isinstance(one, Legend))
        found += chain.from_iterable(legend.get_texts() for legend in legends)
        found += [one for one in axes.get_children() if isinstance(one, Text) and one.get_position()[1] >= 1.0]
    return [text for text in found if text.get_text()]


def is_there(mark: AnyMark, axes: Axes, where: str) -> None:
    """Find the artist of a mark: of its colour, with equal values."""
    finders: dict[type, Callable[[Any, Axes], bool]] = {
        marks.Curve: _has_curve,
        marks.Dots: _has_line,
        marks.Points: _has_line,
        marks.Band: _has_band,
        marks.Histogram: _has_histogram,
        marks.Lanes: _has_lanes,
        marks.Spans: _has_spans,
        marks.Limit: _has_limit,
        marks.Bars: _has_bars,
        marks.Intervals: _has_intervals,
        marks.Outlines: _has_outlines,
        marks.Cells: _has_cells,
    }
    if not isinstance(mark, marks.Told):
        assert finders[type(mark)](mark, axes), (where, dataclasses.replace(mark))


def lines_in(axes: Axes, colour: str) -> list[Line2D]:
    return [line for line in axes.lines if to_hex(str(line.get_color())) == colour]


def same(one: Any, other: Any) -> bool:
    return np.array_equal(np.asarray(one, dtype=float), np.asarray(other, dtype=float), equal_nan=True)


def _has_line(mark: marks.Curve | marks.Dots | Points, axes: Axes) -> bool:
    lines = lines_in(axes, COLOURS[mark.role])
    return any(same(line.get_xdata(), mark.x) and same(line.get_ydata(), mark.y) for line in lines)


def _has_curve(mark: marks.Curve, axes: Axes) -> bool:
    if not mark.steps:
        return _has_line(mark, axes)
    held = np.repeat(mark.y[np.isfinite(mark.x) & np.isfinite(mark.y)], 2)
    heights = (np.asarray(line.get_ydata(), dtype=float) for line in lines_in(axes, COLOURS[mark.role]))
    return any(same(values[np.isfinite(values)], held) for values in heights)


def corners_in(axes: Axes, colour: str) -> set[tuple[float, float]]:
    """Corners of all polygons of a colour."""
    found = (
        one
        for one in axes.collections
        if isinstance(one, PolyCollection) and len(one.get_facecolor()) and to_hex(one.get_facecolor()[0]) == colour
    )
    return {tuple(corner) for one in found for path in one.get_paths() for corner in path.vertices.tolist()}


def _has_band(mark: marks.Band, axes: Axes) -> bool:
    known = np.isfinite(mark.x) & np.isfinite(mark.low) & np.isfinite(mark.high)
    corners = corners_in(axes, COLOURS[mark.role])
    wanted = chain(zip(mark.x[known], mark.low[known], strict=True), zip(mark.x[known], mark.high[known], strict=True))
    if mark.steps:
        return {y for _, y in wanted} <= {y for _, y in corners}
    return {(float(x), float(y)) for x, y in wanted} <= corners


def _has_histogram(mark: marks.Histogram, axes: Axes) -> bool:
    steps = [patch.get_data() for patch in axes.patches if isinstance(patch, StepPatch)]
    heights = np.where(np.isfinite(mark.heights), mark.heights, 0.0)
    return not len(heights) or any(same(one.values, heights) and same(one.edges, mark.edges) for one in steps)


def _has_lanes(mark: marks.Lanes, axes: Axes) -> bool:
    for row, state in enumerate(mark.order):
        rows = (mark.state == state) & np.isfinite(mark.start) & np.isfinite(mark.end)
        corners = [(x, y) for x, y in corners_in(axes, COLOURS[mark.roles.get(state, mark.role)]) if abs(y - row) < 0.5]
        if not has_ends([x for x, _ in corners], mark.start[rows], mark.end[rows]):
            return False
    return True


def _has_spans(mark: marks.Spans, axes: Axes) -> bool:
    rows = np.isfinite(mark.start) & np.isfinite(mark.end)
    polygons = (one for one in axes.collections if isinstance(one, PolyCollection))
    places = [x for one in polygons for path in one.get_paths() for x in path.vertices[:, 0].tolist()]
    return has_ends(places, mark.start[rows], mark.end[rows])


def has_ends(places: list[float], start: Floats, end: Floats) -> bool:
    wanted, known = np.concatenate([start, end]), np.sort(places)
    if not len(wanted):
        return True
    near = known[np.clip(np.searchsorted(known, wanted - 1e-6), 0, max(len(known) - 1, 0))] if len(known) else known
    return len(near) == len(wanted) and bool(np.allclose(near, wanted, rtol=1e-9, atol=2e-6))


def _has_limit(mark: marks.Limit, axes: Axes) -> bool:
    found = (line.get_xdata() if mark.is_upright else line.get_ydata() for line in lines_in(axes, COLOURS[mark.role]))
    is_drawn = any(same(ends, [mark.value, mark.value]) for ends in found)
    low, high = sorted(axes.get_xlim() if mark.is_upright else axes.get_ylim())
    is_inside = low < mark.value < high
    is_labelled = not (mark.label and is_inside) or mark.label in {text.get_text() for text in axes.texts}
    return (is_drawn or not np.isfinite(mark.value)) and is_labelled


def _has_bars(mark: marks.Bars, axes: Axes) -> bool:
    stems = [one for one in axes.collections if isinstance(one, LineCollection)]
    ends = {tuple(corner) for one in stems for segment in one.get_segments() for corner in np.asarray(segment).tolist()}
    known = np.isfinite(mark.half) & np.isfinite(mark.y)
    wanted = {(float(x), float(y)) for x, y in zip(mark.x[known], (mark.y - mark.half)[known], strict=True)}
    wanted |= {(float(x), float(y)) for x, y in zip(mark.x[known], (mark.y + mark.half)[known], strict=True)}
    return _has_line(marks.Dots(x=mark.x, y=mark.y, role=mark.role), axes) and wanted <= ends


def _has_intervals(mark: marks.Intervals, axes: Axes) -> bool:
    lines = lines_in(axes, COLOURS[mark.role])
    places = [(*np.asarray(line.get_xdata()).tolist(),) for line in lines if mark.row in line.get_ydata()]
    wanted = [(mark.value,), *(ends for ends in (mark.thin, mark.thick) if ends is not None)]
    return all(any(same(one, place) for place in places) for one in wanted)


def _has_outlines(mark: marks.Outlines, axes: Axes) -> bool:
    rings = [path.vertices for one in axes.collections if isinstance(one, PolyCollection) for path in one.get_paths()]
    return all(any(same(ring, other) for other in rings) for ring in mark.rings)


def _has_cells(mark: marks.Cells, axes: Axes) -> bool:
    meshes = [one for one in axes.collections if isinstance(one, QuadMesh)]
    corners = np.stack(np.meshgrid(edges(mark.x), edges(mark.y)), axis=-1)
    return not mark.values.size or any(
        same(np.ma.filled(one.get_array(), np.nan).reshape(mark.values.shape), mark.values)
        and same(one.get_coordinates(), corners)
        and (one.norm.vmin, one.norm.vmax) == (mark.low, mark.high)
        for one in meshes
    )
