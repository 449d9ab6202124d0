"""Figures drawn live: the data beside a picture are what the picture shows, and a page holds them safely."""

import base64
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from groundstation.plots.ranges import broken_at_gaps, windows
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.frames import TIME
from groundstation.reports.live import Panel, page_data

TIME_S = np.arange(0.0, 100.0)


def panels(paint: Callable[[Any], None]) -> tuple[Panel, ...]:
    """What a page gets of a painted figure."""
    return d.draw("test", 60, paint).panels


def test_curves_dots_bands_and_limits_are_those_of_the_picture() -> None:
    value = np.sin(TIME_S)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 50)
        axes.fill_between(TIME_S, value - 1.0, value + 2.0, color=d.USED, alpha=0.2, label="band")
        d.line(axes, TIME_S, value, d.INS, label="curve")
        d.dots(axes, TIME_S[::-1], value[::-1], d.GNSS, label="dots")
        layout.limit_line(axes, 0.5, "limit")
        layout.time_axis(axes, 0.0, 99.0)

    (panel,) = panels(paint)
    assert panel.is_time and panel.x_range == (0.0, 99.0) and panel.x_title.startswith("flight time")
    found = {curve.name: curve for curve in panel.curves}
    assert [found[name].kind for name in ("band", "curve", "dots", "limit")] == ["band", "line", "dots", "line"]
    for name in ("curve", "dots"):
        np.testing.assert_array_equal(found[name].x, TIME_S)
        np.testing.assert_allclose(found[name].y, value)
    np.testing.assert_allclose([found["band"].y, found["band"].upper], [value - 1.0, value + 2.0])
    np.testing.assert_array_equal([found["limit"].x, found["limit"].y], [[0.0, 99.0], [0.5, 0.5]])
    assert found["limit"].is_dashed and not found["curve"].is_dashed


def test_a_break_of_a_line_stays_one() -> None:
    def paint(figure: Any) -> None:
        time, value = broken_at_gaps([0.0, 1.0, 2.0, 9.0, 10.0], [1.0, 2.0, 3.0, 4.0, 5.0])
        d.line(layout.place(figure, 16, 12, 174, 50), time, value, d.INS)

    ((curve,),) = [panel.curves for panel in panels(paint)]
    assert np.all(np.diff(curve.x) > 0.0), "the break has a place of its own"
    assert np.flatnonzero(np.isnan(curve.y)).tolist() == [3] and 2.0 < curve.x[3] < 9.0


def test_lanes_keep_their_names_and_grounds_theirs() -> None:
    def paint(figure: Any) -> None:
        axes = layout.place(figure, 30, 12, 174, 50)
        start, end = np.array([0.0, 20.0]), np.array([10.0, 30.0])
        d.lanes(axes, start, end, np.array(["used", "turning"]), ["used", "turning"], {})
        d.spans(axes, start, end, np.array(["taxi", "airborne"]), d.PHASE_COLOURS)
        layout.time_axis(axes, 0.0, 40.0)

    (panel,) = panels(paint)
    assert dict(panel.names) == {0.0: "used", 1.0: "turning"}
    assert [(low, high, name) for low, high, _, name in panel.grounds] == [(0, 10, "taxi"), (20, 30, "airborne")]
    assert [(curve.x.tolist(), curve.upper.tolist()) for curve in panel.curves] == [([0.0], [10.0]), ([20.0], [30.0])]


def test_a_map_and_an_axis_of_names_stay_pictures() -> None:
    def a_map(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 50)
        axes.set_aspect("equal", adjustable="datalim")
        d.line(axes, TIME_S, TIME_S, d.INS)

    def names(figure: Any) -> None:
        axes = layout.place(figure, 60, 12, 174, 50)
        axes.plot([1.0], [0.0], "o")
        axes.set_yticks([0.0], ["whole run"])

    def backwards(figure: Any) -> None:
        d.line(layout.place(figure, 16, 12, 174, 50), [0.0, 2.0, 1.0], [0.0, 1.0, 2.0], d.INS)

    assert panels(a_map) == panels(names) == panels(backwards) == ()


def test_the_frame_of_a_picture_is_where_its_axes_stand() -> None:
    def a_map(figure: Any) -> None:
        axes, bar = layout.place(figure, 16, 12, 150, 50), layout.place(figure, 156, 12, 160, 50)
        axes.set_aspect("equal", adjustable="datalim")
        filled = axes.contourf([0.0, 100.0], [0.0, 100.0], [[1.0, 2.0], [3.0, 4.0]])
        figure.colorbar(filled, cax=bar)
        d.tell(axes, TIME_S, np.where(TIME_S < 90.0, TIME_S, np.nan), TIME_S + 7.0, TIME)
        axes.set_xlabel("east, m")

    def names(figure: Any) -> None:
        axes = layout.place(figure, 60, 12, 174, 50)
        axes.plot([1.0], [0.0], "o")
        axes.set_yticks([0.0], ["whole run"])

    (frame,) = d.draw("test", 60, a_map).frames
    assert np.allclose((frame.left_mm, frame.bottom_mm, frame.width_mm, frame.height_mm), (16, 12, 134, 38))
    assert (frame.x_title, frame.names) == ("east, m", ())
    wide, high = (np.ptp(limits) for limits in (frame.x_range, frame.y_range))
    assert np.isclose(wide / high, 134 / 38)  # equal scales
    assert frame.samples is not None and frame.samples.value.tolist() == (TIME_S[:90] + 7.0).tolist()
    assert d.draw("test", 60, names).frames[0].names == ((0.0, "whole run"),)
    page = json.loads(page_data([], [(frame,)]))
    x, y, value = (page["arrays"][place] for place in page["pictures"][0][0]["samples"])
    assert (x == y, x == value) == (True, False) and page["pictures"][0][0]["of"] == TIME


def test_a_broken_time_axis_has_a_panel_for_each_run() -> None:
    time = np.concatenate([np.arange(0.0, 40.0), np.arange(2000.0, 2080.0)])
    spans = windows(time)

    def paint(figure: Any) -> None:
        for axes in layout.time_panels(figure, (16, 12, 174, 50), spans):
            d.line(axes, time, np.ones(len(time)), d.INS)

    first, second = panels(paint)
    assert first.x_range[1] < 50.0 and second.x_range[0] > 1990.0
    assert first.left_mm + first.width_mm < second.left_mm and first.y_range == second.y_range
    assert np.isclose(second.width_mm / first.width_mm, (spans[1][1] - spans[1][0]) / (spans[0][1] - spans[0][0]))


def test_a_page_holds_equal_arrays_once_and_no_markup() -> None:
    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 50)
        d.line(axes, TIME_S, TIME_S + 0.1, d.INS, label="</script><b>")
        d.line(axes, TIME_S, 2.0 * TIME_S, d.GNSS, label="two")

    text = page_data([panels(paint)])
    assert "<" not in text
    page = json.loads(text)
    one, two = page["figures"][0][0]["curves"]
    assert one["name"] == "</script><b>" and one["x"] == two["x"] and one["y"] != two["y"]
    values = np.frombuffer(base64.b64decode(page["arrays"][one["y"]]), "<f4")
    np.testing.assert_allclose(values, TIME_S + 0.1, rtol=1e-6)
