"""The real viewer, headless: every view of every tab draws the flight, and complains of nothing."""

from collections.abc import Callable, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rerun.experimental import ViewerClient

from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight
from groundstation.viewer.recorder import Recorder
from tests.told import send_flight, stream_recording
from tests.viewer_example import make_flight, make_results
from tests.viewer_shots import ALL_OR_SOME, chosen, colourful, drawn_in, open_recording, pages

pytestmark = pytest.mark.viewer

LEAST_PIXELS = 40  # a thin line across a small view colours some hundreds
TEXT_LEVEL, LEAST_TEXT = 100, 200  # brightness and number of pixels of text
DRAWN_IN_COLOUR = {"TimeSeries", "StateTimeline", "BarChart", "2D", "Map"}


@dataclass(frozen=True)
class Opened:
    """A running viewer with a recording open that has the flight's layout and no data; and the flight's recording."""

    client: ViewerClient
    path: Path


@pytest.fixture(scope="module")
def flight() -> Flight:
    return make_flight(240.0, 20.0)


@pytest.fixture(scope="module")
def results(flight: Flight) -> FlightResults:
    return make_results(flight)


@pytest.fixture(scope="module")
def recordings(flight: Flight, results: FlightResults, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The flight, and its layout without data."""
    folder = tmp_path_factory.mktemp("viewer")
    path, blank = folder / "flight.rrd", folder / "blank.rrd"
    _write_both(path, blank, flight, results)
    return path, blank


@pytest.fixture
def opened(recordings: tuple[Path, Path], headless_viewer: Callable[[Path], ViewerClient]) -> Opened:
    path, blank = recordings
    return Opened(headless_viewer(blank), path)


def _write_both(path: Path, blank: Path, flight: Flight, results: FlightResults) -> None:
    with rr.RecordingStream("flight", recording_id="flight", send_properties=False) as stream:
        stream.set_log_time_enabled(False)
        stream.save(path)
        layout = send_flight(stream, flight, results)
        stream.disconnect()
    with rr.RecordingStream("blank", recording_id="blank", send_properties=False) as stream:
        stream.save(blank)
        ends_ns = flight["ins"].time_ns[[0, -1]]
        indexes = Recorder(stream, flight.start_ns, flight.has_utc).indexes(ends_ns)
        stream.send_columns("nothing", indexes, rr.Scalars.columns(scalars=np.zeros(2)))
        stream.send_blueprint(layout)
        stream.disconnect()


def _brightness(pixels: np.ndarray) -> int:
    return int((pixels.max(axis=2) > TEXT_LEVEL).sum())


def _shots(
    client: ViewerClient, enough: dict[str, int], wanted: Set[str], is_every: bool = True
) -> dict[str, tuple[str, int]]:
    """What each view that is wanted drew: view id -> page and title, number of coloured or of bright pixels.

    A view is shot again until it drew what is ``enough`` for it. A view that stands on several pages is taken once.
    """
    shots: dict[str, tuple[str, int]] = {}
    for page, views in pages(client, at_rest=False):
        for view in chosen(views, is_every):
            if view.view_id in shots or view.view_id not in wanted:
                continue
            measure = colourful if view.view_class in DRAWN_IN_COLOUR else _brightness
            drawn = drawn_in(client, view.view_id, measure, enough.get(view.view_id, -1))
            shots[view.view_id] = (f"{page}: {view.name} ({view.view_class})", drawn)
    return shots


@ALL_OR_SOME
def test_views_of_every_tab_show_data_and_complain_of_nothing(opened: Opened, is_every: bool) -> None:
    views = opened.client.get_state().views
    coloured = {view.view_id: view.view_class for view in views if view.view_class in DRAWN_IN_COLOUR}
    one_of_each = {view_class: view_id for view_id, view_class in coloured.items()}.values()
    texts = {view.view_id: view for view in views if view.view_id not in coloured}
    # a text without data is its title, so the longest title of each class tells what any other must exceed
    longest = {texts[one].view_class: one for one in sorted(texts, key=lambda one: len(texts[one].name or ""))}
    blank = _shots(opened.client, {}, {*longest.values(), *one_of_each})
    assert [blank[view_id] for view_id in one_of_each if blank[view_id][1]] == [], "coloured without data"
    enough = dict.fromkeys(coloured, LEAST_PIXELS)
    enough |= {one: blank[longest[view.view_class]][1] + LEAST_TEXT for one, view in texts.items()}

    open_recording(opened.client, opened.path)
    state = opened.client.get_state()
    (recording,) = state.recordings
    assert {timeline.name for timeline in recording.timelines} == {"utc", "flight_time"}
    assert (recording.current_timeline, recording.current_time) == ("flight_time", 0), "opened at its beginning, paused"
    full = _shots(opened.client, enough, enough.keys(), is_every)
    class_of = {view.view_id: view.view_class for view in views}
    assert {class_of[one] for one in full} == set(class_of.values())
    assert full.keys() == enough.keys() or not is_every, "a view was not visited"
    assert [title for view_id, (title, drawn) in full.items() if drawn <= enough[view_id]] == [], "nothing drawn"
    state = opened.client.get_state()
    assert {view.name: view.reports for view in state.views if view.reports} == {}
    assert [entry.message for entry in opened.client.get_logs() if entry.level == "ERROR"] == []


def test_a_flight_streams_into_a_running_viewer(opened: Opened, results: FlightResults) -> None:
    flight = make_flight(240.0, 20.0, has_utc=False)
    opened.client.close("all")
    stream_recording(flight, make_results(flight, flight_id="NOTIME_01234567"), connect_url=opened.client.url)
    (recording,) = opened.client.get_state().recordings
    assert recording.store_id.endswith(":NOTIME_01234567")
    assert {timeline.name for timeline in recording.timelines} == {"flight_time"}
