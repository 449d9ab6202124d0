"""What a page draws live: the data beside a picture are what the picture shows, and a page holds them safely."""

import base64
import json

import numpy as np

from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Curve, Lanes, Points, Spans, Told
from groundstation.plots.plot import Axis
from groundstation.plots.ranges import broken_at_gaps
from groundstation.reports.live import TIME, LivePanel, page_data
from groundstation.reports.svg.picture import picture_of
from tests.every_mark import DRAWN, plot_of

TIME_S = np.arange(0.0, 100.0)


def panels(*marks: AnyMark, x: Axis | None = None, y: Axis | None = None) -> tuple[LivePanel, ...]:
    """What a page gets of a plot of one panel."""
    return picture_of(plot_of(*marks, x=x, y=y)).panels


def test_a_break_of_a_line_stays_one() -> None:
    time, value = broken_at_gaps([0.0, 1.0, 2.0, 9.0, 10.0], [1.0, 2.0, 3.0, 4.0, 5.0])
    ((curve,),) = [panel.curves for panel in panels(Curve(x=time, y=value))]
    assert np.all(np.diff(curve.x) > 0.0), "the break has a place of its own"
    assert np.flatnonzero(np.isnan(curve.y)).tolist() == [3] and 2.0 < curve.x[3] < 9.0


def test_lanes_keep_their_names_and_grounds_theirs() -> None:
    start, end = np.array([0.0, 20.0]), np.array([10.0, 30.0])
    lanes = Lanes(start=start, end=end, state=np.array(["used", "turning"]), order=("used", "turning"))
    spans = Spans(start=start, end=end, kind=np.array(["taxi", "airborne"]), name="phase")
    (panel,) = panels(lanes, spans, x=time_axis(0.0, 40.0))
    assert panel.is_time and panel.x_range == (0.0, 40.0)
    assert dict(panel.names) == {0.0: "used", 1.0: "turning"}
    assert [(low, high, name) for low, high, _, name in panel.grounds] == [(0, 10, "taxi"), (20, 30, "airborne")]
    assert [(curve.x.tolist(), curve.upper.tolist()) for curve in panel.curves] == [([0.0], [10.0]), ([20.0], [30.0])]


def test_what_is_no_line_over_a_number_stays_a_picture() -> None:
    there_and_back = Curve(x=np.array([0.0, 2.0, 1.0]), y=np.array([0.0, 1.0, 2.0]))
    named = Points(x=np.ones(1), y=np.zeros(1))
    assert panels(there_and_back) == panels(named, y=Axis(names=((0.0, "whole run"),))) == panels(DRAWN["cells"]) == ()


def test_samples_that_tell_their_time_tell_it_near_the_cursor() -> None:
    x = np.where(TIME_S < 90.0, TIME_S, np.nan)
    there_and_back = Curve(x=np.array([0.0, 2.0, 1.0]), y=np.array([0.0, 1.0, 2.0]))
    told = Told(x=x, y=x, value=TIME_S + 7.0, title="", is_time=True)
    (frame,) = picture_of(plot_of(there_and_back, told)).frames
    assert frame.samples is not None and frame.samples.value.tolist() == (TIME_S[:90] + 7.0).tolist()
    page = json.loads(page_data([], [(frame,)]))
    x_at, y_at, value = (page["arrays"][place] for place in page["pictures"][0][0]["samples"])
    assert (x_at == y_at, x_at == value) == (True, False) and page["pictures"][0][0]["of"] == TIME


def test_a_page_holds_equal_arrays_once_and_no_markup() -> None:
    marks = Curve(x=TIME_S, y=TIME_S + 0.1, name="</script><b>"), Curve(x=TIME_S, y=2.0 * TIME_S, name="two")
    text = page_data([panels(*marks)])
    assert "<" not in text
    page = json.loads(text)
    one, two = page["figures"][0][0]["curves"]
    assert one["name"] == "</script><b>" and one["x"] == two["x"] and one["y"] != two["y"]
    values = np.frombuffer(base64.b64decode(page["arrays"][one["y"]]), "<f4")
    np.testing.assert_allclose(values, TIME_S + 0.1, rtol=1e-6)
