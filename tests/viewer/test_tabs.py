"""A plot is told once: what a tab logs by hand is listed here with its reason, and each mark of a plot is drawn."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
import rerun as rr

import groundstation.systems
import groundstation.viewer.tabs
from groundstation.plots.marks import Band, Cells, Curve, Lanes, Limit, Spans, Told
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.viewer.plot_views import panels_of, runs_of
from groundstation.viewer.recorder import Recorder
from tests.every_mark import DRAWN
from tests.recording_contents import Contents

TABS = Path(groundstation.viewer.tabs.__file__).parent
ROOM, SYSTEMS = TABS.parent, Path(groundstation.systems.__file__).parent
LOGGING = {"lines", "thinned", "band", "dots", "lane", "spans"}  # of a Recorder
# What is not told once. A tab that is not here shows plots of its chapter alone.
BY_HAND = {
    "overview": {"lines", "spans"},  # more series than the page has, and lanes with all states
    "raw": {"lines", "lane"},  # the tables themselves
    "quality": {"thinned", "spans"},  # the same; every gap, where the page widens and counts them
    "health/tab": {"spans"},  # lanes of the checks, with marks of what happened
    "inertial/tab": {"lane"},  # states of the filter: grounds of the page's panels
    "cooperative/tab": {"lines", "spans"},  # sources heard, lanes of links
    "planning/landing/tab": {"lines"},  # speed of the moving point, beside its space
    "magnetic/tab": {"dots"},  # a lane for each check, whose states are grades: the page has all in one panel
}
BY_RERUN = {  # spaces, maps, tensors, and what grows with time
    *("planning/session/tab", "planning/session/placement_tab", "planning/landing/tab", "landing/tab"),
    *("flight_space", "track", "cooperative/space_tab", "magnetic/field_tab"),
    *("heading/distribution_tab", "inertial/forecast_tab", "trajectory/space_tab"),
}
# The same of the room itself: fleet, comparison, plan, session, and what all painters log with.
ROOM_BY_HAND = {
    "fleet_charts": {"lane"},  # the verdict of every flight: the page has it in the table of flights
    "plot_views": {"lines", "band", "dots", "spans"},  # the painter
}
ROOM_BY_RERUN = {
    "fleet_density",  # grows flight by flight
    *("chart", "recorder"),  # the painters
}
DRAWN_BY_RERUN = re.compile(
    r"rr\.(Boxes|Points|LineStrips|BarChart|SeriesLines|SeriesPoints|Measurements|Tensor|Image)"
)


def calls_of(path: Path) -> set[str]:
    """Names of the methods that a tab calls of a recorder."""
    found = (node.func for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call))
    names = (one for one in found if isinstance(one, ast.Attribute))
    return {one.attr for one in names if isinstance(one.value, ast.Name) and one.value.id == "recorder"} & LOGGING


def draws_by_rerun(path: Path) -> bool:
    return any(
        isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "rr"
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
    )


def test_tabs_that_log_by_hand_are_listed() -> None:
    paths = {path.stem: path for path in sorted(TABS.glob("*.py"))}
    paths |= {path.relative_to(SYSTEMS).with_suffix("").as_posix(): path for path in sorted(SYSTEMS.rglob("*tab.py"))}
    assert {name: calls for name, path in paths.items() if (calls := calls_of(path))} == BY_HAND
    assert {name for name, path in paths.items() if draws_by_rerun(path)} == BY_RERUN


def test_the_room_logs_by_hand_where_it_is_listed() -> None:
    paths = sorted(ROOM.glob("*.py"))
    assert {path.stem: calls for path in paths if (calls := calls_of(path))} == ROOM_BY_HAND
    assert {path.stem for path in paths if DRAWN_BY_RERUN.search(path.read_text("utf-8"))} == ROOM_BY_RERUN


def logged(folder: Path, plot: Plot, *, is_run: bool = False) -> Contents:
    """What a plot leaves in a recording."""
    with rr.RecordingStream("plot") as stream:
        stream.save(folder / "a.rrd")
        recorder = Recorder(stream, 0, has_utc=False)
        assert runs_of(recorder, plot, "run") if is_run else panels_of(recorder, plot)
        stream.disconnect()
    return Contents(folder / "a.rrd")


def entities(contents: Contents) -> set[str]:
    """What is drawn beside axes."""
    every = {*contents.fixed, *contents.batches}
    return {one for one in every if "/axes/" not in one and not one.startswith("/__")}


@pytest.mark.parametrize("name", DRAWN)
def test_each_mark_is_drawn_on_a_chart(name: str, tmp_path: Path) -> None:
    told = Plot("a.plot", "A plot", "", "", one_panel(Panel([DRAWN[name]], Axis("x"), Axis("y, m")), 40.0))
    assert entities(logged(tmp_path, told))


def test_over_flight_time_values_are_as_told_and_broken_at_gaps(tmp_path: Path) -> None:
    time_s = np.concatenate([np.arange(0.0, 20.0), np.arange(50.0, 60.0)])
    value = np.sin(time_s)
    marks = [
        Band(x=time_s, low=value - 0.5, high=value + 0.5, role="answer", name="95 %"),
        Curve(x=time_s, y=value, role="answer", name="estimate"),
        Curve(x=time_s, y=2.0 * value, role="ins", name="INS"),
        Limit(value=3.0, name="limit"),
        Spans(start=time_s[:1], end=time_s[1:2], kind=np.array(["taxi"])),
    ]
    contents = logged(
        tmp_path, Plot("a.plot", "A", "", "", one_panel(Panel(marks, Axis(scale="time"), Axis("b, m")), 40.0))
    )
    at_ns, middle, half = contents.band("/a/plot/b/c00_band")
    known = np.isfinite(middle)
    assert (np.rint(at_ns[known] / 1e9) == time_s).all() and (middle[known] == value).all()
    assert half[known] == pytest.approx(0.5)
    assert np.isnan(middle).sum() == 1, "the gap"
    line = contents.scalars("/a/plot/b/b00_lines")[1][:, 0]
    assert (line[np.isfinite(line)] == 2.0 * value).all() and np.isnan(line).sum() == 1
    assert (contents.scalars("/a/plot/b/a_limits")[1] == 3.0).all()


def test_a_line_of_one_moment_is_a_dot(tmp_path: Path) -> None:
    curve = Curve(x=np.array([3.0]), y=np.array([0.5]), name="estimate")
    told = Plot("a.plot", "A", "", "", one_panel(Panel([curve], Axis(scale="time"), Axis("b, m")), 40.0))
    contents = logged(tmp_path, told)
    (entity,) = entities(contents)
    assert "SeriesPoints:markers" in contents.fixed[entity][0].schema.names
    assert contents.scalars(entity)[1].tolist() == [[0.5]]


def test_long_names_beside_a_chart_are_wrapped_and_not_cut(tmp_path: Path) -> None:
    names = ["95 % of the smoothed solution, by its own sigma", "forward filter, at the end of the outage"]
    marks = [Curve(x=np.arange(5.0), y=np.arange(5.0) + place, name=name) for place, name in enumerate(names)]
    contents = logged(tmp_path, Plot("a.plot", "A", "", "", one_panel(Panel(marks, Axis("x"), Axis("y, m")), 40.0)))
    (batch,) = contents.fixed["/a/plot/y/legend"]
    assert [" ".join(label.split()) for label in batch.column("Points2D:labels").to_pylist()[0]] == names


def test_states_are_one_lane_with_those_that_the_page_leaves_out(tmp_path: Path) -> None:
    state = np.array(["used", "odd", "used"])
    lanes = Lanes(start=np.arange(3.0), end=np.arange(3.0) + 1.0, state=state, order=("used",))
    contents = logged(tmp_path, Plot("a.plot", "A", "", "", one_panel(Panel([lanes], Axis(scale="time")), 40.0)))
    batches = contents.batches["/a/plot/lanes"]
    assert [row[0] for batch in batches for row in batch.column("StateChange:state").to_pylist()] == [*state, ""]


def test_a_logarithmic_axis_over_time_is_a_chart_with_a_cursor(tmp_path: Path) -> None:
    curve = Curve(x=np.arange(10.0), y=10.0 ** np.arange(10.0))
    told = Plot("a.plot", "A", "", "", one_panel(Panel([curve], Axis(scale="time"), Axis("b, m", "log")), 40.0))
    contents = logged(tmp_path, told)
    (batch,) = contents.fixed["/a/plot/b/00_curve"]
    (strip,) = batch.column("LineStrips2D:strips").to_pylist()[0]
    assert np.ptp(np.diff(np.array(strip)[:, 1])) == pytest.approx(0.0, abs=1e-4), "a straight line"
    assert contents.times("/a/plot/b/cursor").max() >= 9e9


def test_each_window_has_a_chart_of_what_lies_in_it(tmp_path: Path) -> None:
    x = Axis(scale="time", windows=((0.0, 10.0), (100.0, 110.0)))
    time_s = np.arange(0.0, 120.0)
    told = Plot("a.plot", "A", "", "", (Row((Panel([Curve(x=time_s, y=time_s)], x, Axis("b, m")),)),))
    contents = logged(tmp_path, told, is_run=True)
    for number in (1, 2):
        (batch,) = contents.fixed[f"/run/{number}/b/00_curve"]
        (strip,) = batch.column("LineStrips2D:strips").to_pylist()[0]
        assert len(strip) == 11


def test_the_place_at_a_time_moves(tmp_path: Path) -> None:
    x = np.arange(5.0)
    marks = [Curve(x=x, y=x), Told(x=x, y=x, value=10.0 * x, title="flight time", is_time=True)]
    contents = logged(
        tmp_path, Plot("a.plot", "A", "", "", one_panel(Panel(marks, Axis("x"), Axis("y"), is_map=True), 40.0))
    )
    assert (contents.times("/a/plot/y/01_told/0") == (1e10 * x).astype(np.int64)).all()


def test_why_a_panel_is_empty_is_a_text(tmp_path: Path) -> None:
    panel = Panel((), Axis(scale="time"), Axis("b, m"), nothing="no *height*")
    assert logged(tmp_path, Plot("a.plot", "A", "", "", one_panel(panel, 40.0))).text("/a/plot/b") == "no \\*height\\*"


def test_cells_have_the_colours_of_their_values(tmp_path: Path) -> None:
    cells = Cells(x=np.arange(2.0), y=np.arange(1.0), values=np.array([[0.0, 1.0]]), low=0.0, high=1.0, title="m")
    contents = logged(tmp_path, Plot("a.plot", "A", "", "", one_panel(Panel([cells], Axis("x"), Axis("y")), 40.0)))
    (batch,) = contents.fixed["/a/plot/y/00_cells/0"]
    assert len(set(batch.column("LineStrips2D:colors").to_pylist()[0])) == 2
