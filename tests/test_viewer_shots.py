"""The real viewer, headless: every view of every tab draws the flight, and complains of nothing."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rerun.experimental import ViewerClient

from groundstation.results.flight import FlightResults
from groundstation.tables.table import Flight
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.recording import send_flight, stream_recording
from tests.viewer_example import make_flight, make_results
from tests.viewer_shots import colourful, open_recording, pages, picture

pytestmark = pytest.mark.viewer

LEAST_PIXELS = 40  # a thin line across a small view colours some hundreds
TEXT_LEVEL, LEAST_TEXT = 100, 200  # brightness and number of pixels of text
DRAWN_IN_COLOUR = {"TimeSeries", "StateTimeline", "BarChart", "2D", "Map"}


@dataclass(frozen=True)
class Opened:
    """A running viewer with the recording open, and a recording of the same layout that holds no data."""

    client: ViewerClient
    path: Path
    blank: Path


@pytest.fixture(scope="module")
def flight() -> Flight:
    return make_flight(240.0, 20.0)


@pytest.fixture(scope="module")
def results(flight: Flight) -> FlightResults:
    return make_results(flight)


@pytest.fixture(scope="module")
def opened(
    flight: Flight,
    results: FlightResults,
    headless_viewer: Callable[[Path], ViewerClient],
    tmp_path_factory: pytest.TempPathFactory,
) -> Opened:
    folder = tmp_path_factory.mktemp("viewer")
    path, blank = folder / "flight.rrd", folder / "blank.rrd"
    _write_both(path, blank, flight, results)
    return Opened(headless_viewer(path), path, blank)


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


def _shots(client: ViewerClient) -> dict[str, tuple[str, str, np.ndarray]]:
    """Each view's own picture: view id -> class, title, pixels. A view that stands on several pages is taken once."""
    shots: dict[str, tuple[str, str, np.ndarray]] = {}
    for page, views in pages(client):
        for view in views:
            if view.view_id not in shots:
                pixels = picture(client.take_screenshot(view.view_id))  # the page has come to rest
                shots[view.view_id] = (view.view_class, f"{page}: {view.name}", pixels)
    return shots


def test_every_view_of_every_tab_shows_data_and_complains_of_nothing(opened: Opened) -> None:
    full = _shots(opened.client)
    state = opened.client.get_state()
    assert len(full) == len(state.views), "a view was not visited"
    assert {view.name: view.reports for view in state.views if view.reports} == {}
    assert [entry.message for entry in opened.client.get_logs() if entry.level == "ERROR"] == []
    (recording,) = state.recordings
    assert {timeline.name for timeline in recording.timelines} == {"utc", "flight_time"}
    assert (recording.current_timeline, recording.current_time) == ("flight_time", 0), "opened at its beginning, paused"

    open_recording(opened.client, opened.blank)
    empty = _shots(opened.client)
    assert empty.keys() == full.keys()
    for view_id, (kind, title, pixels) in full.items():
        nothing = empty[view_id][2]
        if kind in DRAWN_IN_COLOUR:
            assert colourful(pixels) > colourful(nothing) + LEAST_PIXELS, f"{title}: nothing drawn"
        else:
            brightness = (pixels.max(axis=2) > TEXT_LEVEL).sum() - (nothing.max(axis=2) > TEXT_LEVEL).sum()
            assert brightness > LEAST_TEXT, f"{title}: no text"


def test_a_flight_streams_into_a_running_viewer(opened: Opened, results: FlightResults) -> None:
    flight = make_flight(240.0, 20.0, has_utc=False)
    opened.client.close("all")
    stream_recording(flight, make_results(flight, flight_id="NOTIME_01234567"), connect_url=opened.client.url)
    (recording,) = opened.client.get_state().recordings
    assert recording.store_id.endswith(":NOTIME_01234567")
    assert {timeline.name for timeline in recording.timelines} == {"flight_time"}
