"""Pictures written from the description of a plot: whole XML whatever is drawn, equal bytes, numbers that are right."""

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from groundstation.chapters.parts import Document, Figure, Front, Section
from groundstation.plots.marks import Band, Cells, Curve, Dots, Histogram, Limit, Points, Spans, Told
from groundstation.plots.plot import Axis, Panel, Plot, Row, Scale, one_panel
from groundstation.reports.drawing import drawing_of, drawn_by
from groundstation.reports.live import page_data
from groundstation.reports.pdf import pdf_bytes
from groundstation.reports.svg.boxes import TICK_PT, TO_TEXT_PT, TO_TITLE_PT, placed, widest
from groundstation.reports.svg.colours import COLOURS
from groundstation.reports.svg.font import LINE_SHARE, SIZE_PT, width_pt
from groundstation.reports.svg.labels import labels_of
from groundstation.reports.svg.path import dots, polyline
from groundstation.reports.svg.picture import picture_of
from groundstation.reports.svg.thinning import shown_rows
from tests.every_mark import DRAWN, X, Y, empty, plot_of
from tests.plot_cases import CASES, names_of
from tests.told import PLOTS

NUMBER = re.compile(r"-?\d*\.?\d+")
HOSTILE = '</text><script>alert("x")</script>]]> & \' \x00\x1b[2J\u202e\ud800 一' + "é" * 500
SCALES: tuple[Scale, ...] = ("linear", "log", "symlog", "time", "angle", "date")
LINES = ("amber", "red", "at most")
NASTY = {
    "nothing": [],
    "one": [3.0],
    "none is known": [np.nan, np.nan],
    "infinite": [1.0, np.inf, -np.inf, 2.0, np.nan],
    "all one": [7.0, 7.0, 7.0],
    "huge": [-1.7e308, 1.7e308],
    "tiny": [1e-300, 2e-300],
    "near": [1e15, 1e15 + 0.25],
    "denormal": [0.0, 5e-324],
}


def parsed(plot: Plot) -> ET.Element:
    return ET.fromstring(picture_of(plot))


def texts(plot: Plot) -> list[str]:
    return [element.text or "" for element in parsed(plot).iter("text")]


def drawn_path(text: str) -> list[tuple[float, float]]:
    """Places of a path of m and l steps."""
    places, pen = [], np.zeros(2)
    for command, rest in re.findall(r"([MmlLh])([^MmlLhz]*)", text):
        numbers = [float(number) for number in NUMBER.findall(rest)]
        if command == "h":
            continue
        for at in range(0, len(numbers), 2):
            step = np.array(numbers[at : at + 2])
            pen = step if command in "ML" and at == 0 else pen + step
            places.append((float(pen[0]), float(pen[1])))
    return places


@pytest.mark.parametrize("kind", DRAWN)
def test_every_mark_draws_and_an_empty_one_does(kind: str) -> None:
    mark = DRAWN[kind]
    bare, full = picture_of(plot_of()), picture_of(plot_of(mark))
    ET.fromstring(full)
    assert len(re.findall("<path", full)) > len(re.findall("<path", bare))
    nothing = empty(mark)
    assert nothing is not None
    ET.fromstring(picture_of(plot_of(nothing)))


def test_all_marks_together_take_the_colours_of_their_roles() -> None:
    colours = set(re.findall("#[0-9a-f]{6}", picture_of(plot_of(*DRAWN.values()))))
    assert {COLOURS["ins"], COLOURS["gnss"], COLOURS["limit"], COLOURS["ink"]} <= colours


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("kind", NASTY)
def test_no_number_breaks_a_picture(kind: str, scale: Scale) -> None:
    values = np.array(NASTY[kind])
    marks = (Curve(x=values, y=values, name="c"), Dots(x=values, y=values), Band(x=values, low=-values, high=values))
    for axes in ((Axis(scale=scale), Axis(scale=scale)), (Axis(), Axis(scale=scale)), (Axis(scale=scale), Axis())):
        picture = picture_of(plot_of(*marks, x=axes[0], y=axes[1]))
        ET.fromstring(picture)
        assert not re.search(r"\b(nan|inf)\b", picture)
        page_data([picture.panels], [picture.frames])


@pytest.mark.parametrize("ends", [(np.nan, np.nan), (1.0, 1.0), (5.0, None), (None, -5.0), (np.inf, 0.0), (9.0, 1.0)])
@pytest.mark.parametrize("scale", SCALES)
def test_no_end_of_an_axis_breaks_a_picture(ends: tuple[float | None, float | None], scale: Scale) -> None:
    axis = Axis(scale=scale, low=ends[0], high=ends[1])
    picture = picture_of(plot_of(DRAWN["curve"], x=axis, y=axis))
    ET.fromstring(picture)
    assert not re.search(r"\b(nan|inf)\b", picture)


def test_hostile_names_are_text_and_nothing_else() -> None:
    points = Points(x=X, y=Y, name=HOSTILE, labels=(HOSTILE,) * 5)
    spans = Spans(start=X, end=X + 1.0, kind=np.array([HOSTILE] * 5), name=HOSTILE)
    cells = Cells(x=X, y=X, values=np.outer(Y, Y), low=1.0, high=20.0, title=HOSTILE)
    axis = Axis(HOSTILE, names=((1.0, HOSTILE),))
    panel = Panel((points, spans, cells, Limit(value=2.0, label=HOSTILE)), axis, axis, HOSTILE, nothing=HOSTILE)
    whole = Plot(HOSTILE, HOSTILE, HOSTILE, HOSTILE, one_panel(panel, 40.0))
    picture = picture_of(whole)
    elements = list(ET.fromstring(picture).iter())
    assert {element.tag for element in elements} <= {"svg", "defs", "clipPath", "path", "g", "text"}
    assert max(len(element.text or "") for element in elements) <= 200
    assert "\u202e" not in picture
    assert "\x1b" not in picture
    assert all(re.fullmatch("[A-Za-z0-9_-]+", element.get("id", "a")) for element in elements)
    assert len(picture) < 40_000


def test_picture_refers_to_nothing_outside_and_has_no_style_sheet() -> None:
    picture = picture_of(plot_of(*DRAWN.values()))
    assert picture.startswith('<svg viewBox="0 0 504.57 ')
    assert not re.search(r"<style|<script|href|http|<image|<use", picture)
    assert set(re.findall(r"url\(#([^)]*)\)", picture)) == set(re.findall(r' id="([^"]*)"', picture)) == {"made-c0"}
    assert 'aria-hidden="true"' in picture


def test_equal_descriptions_give_equal_bytes() -> None:
    first, again = (picture_of(plot_of(*DRAWN.values())) for _ in range(2))
    assert first == again


def test_line_stands_where_its_numbers_say() -> None:
    curve = Curve(x=np.array([0.0, 10.0, 20.0]), y=np.array([0.0, 5.0, 1.0]), role="ins")
    plot = plot_of(curve, x=Axis(low=0.0, high=20.0), y=Axis(low=0.0, high=5.0))
    svg = picture_of(plot)
    (frame,) = svg.panels
    path = next(element for element in ET.fromstring(svg).iter("path") if element.get("stroke") == COLOURS["ins"])
    left, width = frame.left_mm * 72 / 25.4, frame.width_mm * 72 / 25.4
    total = float(ET.fromstring(svg).get("viewBox", "").split()[3])
    top = total - (frame.bottom_mm + frame.height_mm) * 72 / 25.4
    height = frame.height_mm * 72 / 25.4
    expected = [(left, top + height), (left + 0.5 * width, top), (left + width, top + 0.8 * height)]
    assert drawn_path(path.get("d", "")) == pytest.approx(np.array(expected), abs=0.02)
    assert frame.height_mm == pytest.approx(40.0)


def test_many_samples_are_thinned_so_that_extremes_and_gaps_stay() -> None:
    rng = np.random.default_rng(1)
    y = rng.normal(0.0, 1.0, 50_000)
    y[12_345], y[40_001], y[20_000:20_500] = 99.0, -99.0, np.nan
    rows, starts = shown_rows(np.arange(50_000.0), y, 1000)
    assert len(rows) <= 1000
    assert {12_345, 40_001, 0, 49_999, 19_999, 20_500} <= set(rows.tolist())
    assert rows[starts].tolist() == [0, 20_500]
    picture = picture_of(plot_of(Curve(x=np.arange(50_000.0), y=y)))
    assert len(picture) < 14_000
    many = picture_of(plot_of(Dots(x=np.arange(50_000.0), y=y)))
    assert many.count("h0") == 2500


def test_gaps_without_number_stay_within_the_bound() -> None:
    y = np.where(np.arange(20_000) % 2 == 0, 1.0, np.nan)
    rows, starts = shown_rows(np.arange(20_000.0), y, 1000)
    assert 400 <= len(rows) <= 1000
    assert starts.all()


def test_path_keeps_every_corner_and_only_corners() -> None:
    x = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 2.5])
    y = np.array([0.0, 1.0, 2.0, 2.0, 2.0, 2.0])
    starts = np.zeros(6, dtype=bool)
    assert drawn_path(polyline(x, y, starts)) == [(0.0, 0.0), (2.0, 2.0), (3.0, 2.0), (2.5, 2.0)]
    starts[3] = True
    assert polyline(x, y, starts) == "M0 0l2 2m0 0l1 0-.5 0"
    assert polyline(x[:1], y[:1], starts[:1]) == "M0 0h0"
    assert dots(x[:2], y[:2]) == "M0 0h0m1 1h0"


def test_sample_between_gaps_is_a_dot() -> None:
    y = np.array([1.0, np.nan, 2.0, np.nan, 1.0])
    picture = picture_of(plot_of(Curve(x=X, y=y)))
    assert picture.count("h0") == 3
    assert "stroke-linecap:round" in picture


def test_panels_for_the_page_hold_the_numbers_of_the_description() -> None:
    y = Y.copy()
    y[2] = np.nan
    marks = (
        Curve(x=X, y=y, role="ins", name="line", emphasis="bold", dash="dotted"),
        Dots(x=X[::-1], y=Y, role="gnss", name="dots"),
        Band(x=X, low=Y - 1.0, high=Y + 1.0, name="band"),
        Limit(value=2.0, name="limit"),
        Limit(value=3.0, is_upright=True),
        Histogram(edges=np.arange(3.0), heights=np.array([2.0, 4.0])),
        Spans(start=X[:1], end=X[1:2], kind=np.array(["taxi"]), name="phase"),
        DRAWN["lanes"],
        Told(x=X, y=Y, value=10.0 * Y, title="told"),
    )
    svg = picture_of(plot_of(*marks, x=Axis("t", "time", 0.0, 4.0), y=Axis("u", low=-1.0, high=6.0)))
    (panel,) = svg.panels
    assert svg.frames == ()
    assert (panel.x_range, panel.y_range, panel.is_time) == ((0.0, 4.0), (-1.0, 6.0), True)
    assert (panel.title, panel.x_title, panel.y_title) == ("A panel", "t", "u")
    line, scatter, band, limit, bars, *lanes = panel.curves
    assert (line.kind, line.name, line.colour, line.width, line.is_dashed) == ("line", "line", "#0072b2", 2.2, True)
    np.testing.assert_array_equal(line.x, [0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(line.y, [1.0, 3.0, np.nan, 5.0, 4.0])
    np.testing.assert_array_equal(scatter.x, X)
    np.testing.assert_array_equal(scatter.y, Y[::-1])
    np.testing.assert_array_equal((band.x, band.y, band.upper), (X, Y - 1.0, Y + 1.0))
    np.testing.assert_array_equal((limit.x, limit.y), ([0.0, 4.0], [2.0, 2.0]))
    np.testing.assert_allclose(bars.x, [0.0, 1.0, 1.0, 2.0], atol=1e-6)
    np.testing.assert_array_equal(bars.upper, [2.0, 2.0, 4.0, 4.0])
    assert np.all(np.diff(np.float32(bars.x)) > 0.0)
    assert [one.kind for one in lanes] == ["lanes", "lanes"]
    np.testing.assert_array_equal(lanes[1].x, [1.0, 3.0])
    np.testing.assert_array_equal(lanes[1].upper, [1.5, 3.5])
    assert panel.marks == ((3.0, COLOURS["limit"]),)
    assert panel.grounds == ((0.0, 1.0, "#f6e3b4", "taxi"),)
    assert panel.names == ((0.0, "a"), (1.0, "b"))
    assert panel.samples is not None
    np.testing.assert_array_equal(panel.samples.value, 10.0 * Y)


def test_gap_without_a_sample_breaks_the_live_line_too() -> None:
    x = np.array([0.0, 1.0, np.nan, 2.0, 3.0])
    (panel,) = picture_of(plot_of(Curve(x=x, y=Y))).panels
    np.testing.assert_array_equal(panel.curves[0].y, [1.0, 3.0, np.nan, 5.0, 4.0])
    assert panel.curves[0].x[2] == 1.5


@pytest.mark.parametrize("mark", ["intervals", "outlines", "cells", "bars", "points"])
def test_what_cannot_live_is_a_picture_with_frames(mark: str) -> None:
    svg = picture_of(plot_of(DRAWN[mark]))
    assert svg.panels == ()
    assert len(svg.frames) == 1


def test_cells_tell_their_values() -> None:
    (frame,) = picture_of(plot_of(DRAWN["cells"])).frames
    assert frame.samples is not None
    assert frame.samples.title == "sigma, m"
    assert sorted(frame.samples.value) == sorted(np.outer(Y, Y).ravel())


def test_broken_axis_has_a_frame_for_each_window() -> None:
    time = np.concatenate([np.arange(0.0, 60.0), np.arange(600.0, 660.0)])
    axis = Axis(scale="time", windows=((0.0, 60.0), (600.0, 660.0)))
    panels = picture_of(plot_of(Curve(x=time, y=np.sin(time)), x=axis)).panels
    assert [panel.x_range for panel in panels] == [(0.0, 60.0), (600.0, 660.0)]
    assert panels[0].y_range == panels[1].y_range
    assert [panel.y_title for panel in panels] == ["up", ""]
    own = picture_of(plot_of(Curve(x=time, y=time), x=axis, y=Axis(ranges=((0.0, 60.0), (600.0, 660.0))))).panels
    assert [panel.y_range for panel in own] == [(0.0, 60.0), (600.0, 660.0)]


def test_rows_share_an_axis_and_stand_above_each_other() -> None:
    above, below = (Panel((Curve(x=x, y=x),), Axis("t")) for x in (X, 1000.0 * X))
    plot = Plot("made", "", "", "", (Row((above,), 30.0, shares_x=True), Row((below,), 20.0)))
    first, second = picture_of(plot).panels
    assert first.x_range == second.x_range
    assert (first.left_mm, first.width_mm) == (second.left_mm, second.width_mm)
    assert first.bottom_mm > second.bottom_mm + second.height_mm
    assert (first.x_title, second.x_title) == ("", "t")


def test_row_of_fewer_panels_keeps_the_columns_of_the_others() -> None:
    one = Panel((Curve(x=X, y=Y),), Axis("t"))
    plot = Plot("made", "", "", "", (Row((one, one), 30.0), Row((one,), 30.0, columns=2)))
    left, right, below = picture_of(plot).panels
    assert (below.left_mm, below.width_mm) == (left.left_mm, left.width_mm)
    assert right.left_mm > left.left_mm + left.width_mm


def test_map_has_one_scale() -> None:
    x, y = np.array([0.0, 10.0]), np.array([0.0, 1000.0])
    plot = plot_of(Curve(x=x, y=y))
    map_of = replace(plot, rows=(Row((replace(plot.panels[0], is_map=True),), 40.0),))
    (frame,) = picture_of(map_of).frames
    per_mm = [abs(high - low) for low, high in (frame.x_range, frame.y_range)]
    assert per_mm[0] / frame.width_mm == pytest.approx(per_mm[1] / frame.height_mm, rel=1e-5)


def test_empty_panel_says_why() -> None:
    panel = Panel((), y=Axis("height, m"), nothing="no height above the threshold")
    assert "no height above the threshold" in texts(Plot("made", "", "", "", one_panel(panel, 30.0)))


def test_legend_names_each_once() -> None:
    marks = (Curve(x=X, y=Y, name="same"), Curve(x=X, y=Y + 1.0, name="same"), DRAWN["spans"])
    told = texts(plot_of(*marks))
    assert told.count("same") == 1
    assert {"taxi", "what"} <= set(told)


def test_legend_without_end_is_bounded() -> None:
    marks = [Curve(x=X, y=Y, name=f"line {number}") for number in range(300)]
    told = texts(plot_of(*marks))
    assert "… 271 more" in told
    assert sum(text.startswith("line") for text in told) == 29


def test_figure_of_a_chapter_is_drawn_by_the_name_that_the_chapter_gives() -> None:
    section = Section("a", "A", "", (Figure("made"), Figure("none")))
    plot = replace(plot_of(DRAWN["curve"]), numbers=("overview",))
    drawn = drawn_by({"made": lambda _: plot, "none": lambda _: None}, section, None)
    assert drawn.parts == (drawing_of(plot, "made"),)


def test_paper_has_the_text_of_a_picture_in_its_font() -> None:
    section = Section("a", "A", "", (drawing_of(plot_of(*DRAWN.values())),))
    document = Document("Report", "x", Front("x"), (section,))
    first, again = pdf_bytes(document), pdf_bytes(document)
    assert first == again
    assert b"DejaVuSans" in first


def test_writer_needs_neither_matplotlib_nor_typst() -> None:
    told = "import sys, groundstation.reports.svg.picture; print({'matplotlib', 'typst', 'PIL'} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "set()"


def test_widths_are_those_of_the_font() -> None:
    from fontTools.ttLib import TTFont

    from groundstation.reports.svg.font import FONTS, widths

    for name, is_bold in (("DejaVuSans.ttf", False), ("DejaVuSans-Bold.ttf", True)):
        font = TTFont(FONTS / name)
        advances, units = font["hmtx"], font["head"].unitsPerEm
        expected = {mark: advances[glyph][0] / units for mark, glyph in font.getBestCmap().items()}
        assert widths(is_bold) == pytest.approx(expected)


@pytest.mark.parametrize("case", ["report", "landing", "placement"])
def test_every_plot_of_a_chapter_is_a_picture_of_bounded_size(case: str) -> None:
    results = CASES[case]()
    plots = [plot for name, tell in PLOTS.items() for of in names_of(name, results) if (plot := tell(results, *of))]
    assert plots
    for plot in plots:
        picture = picture_of(plot)
        ET.fromstring(picture)
        marks = sum(len(panel.marks) * max(len(panel.x.windows), 1) for panel in plot.panels)
        assert len(picture) < 10_000 + 30_000 * marks
        has_symlog = any(panel.y.scale == "symlog" for panel in plot.panels)  # the page cannot tell values of one
        assert picture.panels or picture.frames or has_symlog


def test_a_map_has_room_for_the_numbers_it_comes_to() -> None:
    flat = Curve(x=np.array([0.0, 3e6]), y=np.array([0.0, 1.0]))
    panel = Panel([flat], Axis("east, m"), Axis("north, m"), is_map=True)
    ((one,), _) = placed(Plot("a", "A", "", "", one_panel(panel, 60.0)))
    box = one.boxes[0]
    assert widest(box.y_ticks) > 30.0
    assert box.left >= TICK_PT + TO_TEXT_PT + widest(box.y_ticks) + TO_TITLE_PT + LINE_SHARE * SIZE_PT - 1e-9


def test_windows_of_panels_that_share_an_axis_stand_above_each_other() -> None:
    axis = Axis("flight time, min:s", "time", 0.0, 600.0, windows=((0.0, 60.0), (400.0, 600.0)))
    curve = Curve(x=X, y=Y)
    above = Panel([curve], axis, Axis("up", ranges=((0.0, 6.0), (12345.0, 12346.0))))
    rows = (Row((above,), shares_x=True), Row((Panel([curve], axis, Axis("up")),)))
    upper, lower = placed(Plot("a", "A", "", "", rows))[0]
    assert [(box.left, box.right) for box in upper.boxes] == [(box.left, box.right) for box in lower.boxes]


@pytest.mark.parametrize("is_upright", [False, True])
@pytest.mark.parametrize("apart", [0.0, 0.05, 0.3, 3.0])
def test_labels_of_lines_near_each_other_and_of_a_point_between_stand_clear(apart: float, is_upright: bool) -> None:
    level = np.array([5.0 + apart * place for place in range(3)])
    lines = [Limit(value=one, is_upright=is_upright, label=name) for one, name in zip(level, LINES, strict=True)]
    point = Points(x=np.array([level[0] if is_upright else 6.6]), y=np.array([9.4 if is_upright else level[0]]))
    marks = (*lines, replace(point, labels=("threshold",)))
    plot = plot_of(*marks, x=Axis("x", "linear", 0.0, 20.0), y=Axis("y", "linear", 0.0, 20.0))
    (box,) = [one for panel in placed(plot)[0] for one in panel.boxes]
    found = labels_of(box)
    assert [one.text for one in found] == [*LINES, "threshold"]
    bounds = [(one.left, one.base - SIZE_PT, one.left + width_pt(one.text), one.base) for one in found]
    for place, one in enumerate(bounds):
        assert box.left <= one[0] and one[2] <= box.right and one[1] >= box.top and one[3] <= box.bottom
        for other in bounds[:place]:
            across, down = min(one[2], other[2]) - max(one[0], other[0]), min(one[3], other[3]) - max(one[1], other[1])
            assert across <= 0.0 or down <= 0.0, (found[place].text, apart)
    assert all(abs(one.y - one.base) < 3.0 for one in found[:3]) or is_upright, "a label stands at its own line"
