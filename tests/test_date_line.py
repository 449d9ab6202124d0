"""Flights across the date line and over a pole: one piece on the map, cut where a format needs it, nothing fails."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
from hypothesis import given
from hypothesis import strategies as st
from rerun.experimental import ViewerClient

from groundstation.base.ecef import ecef_from_n, ecef_m
from groundstation.base.geodesy import continuous_longitude_deg, north_east_m, plan_north_east_m
from groundstation.base.local_frame import plane_through
from groundstation.exports.gpx import write_gpx
from groundstation.exports.kml import write_kml
from groundstation.exports.tracks import Track
from groundstation.methods.fleet.ins_errors import ins_errors
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.results.flight import FlightResults
from groundstation.simulation.approach import TrueRunway, simulate_approach
from groundstation.viewer import colours
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.tabs import track as track_tab
from groundstation.viewer.tabs.track import MAP_LATITUDE_DEG, zoom_of
from tests.figure_arrays import filled
from tests.recording_contents import Contents
from tests.systems.landing.test_approaches import EXACT, PLAIN, only
from tests.told import write_recording
from tests.viewer_example import make_flight, make_results
from tests.viewer_shots import SATURATED, SMALL, colourful, picture, settled

KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
GPX = "{http://www.topografix.com/GPX/1/1}"
START_NS = 1_777_874_400_000_000_000  # 2026-05-04T06:00Z
ROUNDING_DEG = 1e-9
SHAPE_SHARE = 2e-3  # a sphere and the ellipsoid


def on_180(longitude_deg: np.ndarray) -> np.ndarray:
    """Longitudes as logs have them."""
    return np.asarray(np.mod(longitude_deg + 180.0, 360.0) - 180.0)


@given(
    st.floats(-180.0, 180.0),
    st.lists(st.floats(-179.0, 179.0) | st.just(float("nan")), min_size=1, max_size=50),
)
def test_a_path_has_no_step_of_a_turn_whatever_the_longitude_it_begins_at(start: float, steps: list[float]) -> None:
    moves = np.array(steps)
    path = start + np.cumsum(np.nan_to_num(moves))
    logged = np.where(np.isnan(moves), np.nan, on_180(path))
    found = continuous_longitude_deg(logged)
    known = np.isfinite(logged)
    assert (np.isfinite(found) == known).all()
    if known.any():
        assert np.abs(on_180(found[known] - logged[known])) == pytest.approx(0.0, abs=1e-6)
        whole = np.append(np.abs(np.diff(found[known])), 0.0)
        assert whole.max() <= 180.0 + 1e-6
        assert abs(found[known].min() + found[known].max()) <= 360.0 + 1e-6
        if (np.abs(np.diff(logged[known])) < 180.0).all():
            assert (found[known] == logged[known]).all(), "a path on one side is left as it is"


def test_a_plan_is_the_same_wherever_on_a_parallel_it_lies() -> None:
    latitude, longitude = 56.0 + 0.1 * np.sin(np.arange(50.0)), 0.2 * np.arange(50.0)
    plain = plan_north_east_m(latitude, longitude, 56.0, 0.0)
    assert np.array_equal(plain, north_east_m(latitude, longitude, 56.0, 0.0))
    moved = plan_north_east_m(latitude, on_180(longitude + 178.0), 56.0, 178.0)
    assert np.allclose(plain, moved, atol=1e-6)


def over_the_pole(n: int = 61, beside_m: float = 0.0, sign: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude of a straight flight of some 90 km, its middle so far from a pole."""
    along_m = np.linspace(-45_000.0, 45_000.0, n)
    latitude = 90.0 - np.rad2deg(np.hypot(along_m, beside_m) / 6_399_594.0)
    return sign * latitude, on_180(np.rad2deg(np.arctan2(along_m, beside_m)) + 100.0)


@pytest.mark.parametrize("beside_m", [0.0, 200.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_straight_flight_over_a_pole_is_a_straight_line_on_the_plan(beside_m: float, sign: float) -> None:
    latitude, longitude = over_the_pole(beside_m=beside_m, sign=sign)
    north, east = plan_north_east_m(latitude, longitude, float(latitude[0]), float(longitude[0]))
    assert np.hypot(north, east) == pytest.approx(np.linspace(0.0, 90_000.0, len(north)), rel=SHAPE_SHARE, abs=1.0)
    across = (north * east[-1] - east * north[-1]) / np.hypot(north[-1], east[-1])
    assert np.abs(across).max() < SHAPE_SHARE * 90_000.0
    assert sign * north[-1] > 89_000.0, "towards the pole to begin with"


def recorded(tmp_path: Path, latitude: np.ndarray, longitude: np.ndarray) -> Contents:
    """The recording of a flight with these places."""
    flight = make_flight(60.0, 10.0)
    whole: FlightResults = make_results(flight, with_heading=False)
    overview = {
        "time_s": np.linspace(0.0, 59.0, len(latitude)),
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "ground_speed_mps": np.full(len(latitude), 100.0),
    }
    figures = tuple(one for one in whole.figures if one.name not in ("overview", "phases"))
    results = replace(whole, answers={}, figures=(filled("overview", **overview), *figures))
    write_recording(tmp_path / "a.rrd", flight, results)
    return Contents(tmp_path / "a.rrd")


def strips_of(contents: Contents) -> list[np.ndarray]:
    """Lines on the map, latitude and longitude."""
    rows = [
        batch.column("GeoLineStrings:line_strings").to_pylist()[0]
        for batch in contents.fixed["/map/track"]
        if "GeoLineStrings:line_strings" in batch.schema.names
    ]
    return [np.array(strip) for strip in rows[0]]


def test_the_map_of_a_recording_draws_a_flight_across_the_date_line_in_one_piece(tmp_path: Path) -> None:
    path = 179.95 + 0.1 * np.sin(np.linspace(0.0, 6.0, 60))
    latitude = -16.7 + np.linspace(0.0, 0.02, 60)
    contents = recorded(tmp_path, latitude, on_180(path))
    (strip,) = strips_of(contents)
    assert strip[:, 1] == pytest.approx(path, abs=ROUNDING_DEG)
    assert np.ptp(strip[:, 1]) < 0.21, "no line round the globe"
    (batch,) = contents.batches["/map/now"]
    now = np.array([row[0] for row in batch.column("GeoPoints:positions").to_pylist()])
    assert now == pytest.approx(strip, abs=ROUNDING_DEG), "the aircraft is on its track"
    elsewhere = np.column_stack([latitude, path - 100.0])
    assert zoom_of(strip) == pytest.approx(zoom_of(elsewhere)) and zoom_of(strip) > 9.0


def test_the_map_of_a_recording_ends_where_its_projection_does(tmp_path: Path) -> None:
    (strip,) = strips_of(recorded(tmp_path, *over_the_pole()))
    assert np.abs(strip[:, 0]).max() == MAP_LATITUDE_DEG and np.isfinite(strip).all()


@pytest.mark.viewer
def test_the_viewer_shows_the_flight_on_both_sides_of_the_date_line(
    tmp_path: Path, headless_viewer: Callable[[Path], ViewerClient]
) -> None:
    turn, known = np.linspace(0.0, 2.0 * np.pi, 60), np.ones(60, dtype=bool)
    place = np.column_stack([-16.7 + 0.08 * np.sin(turn), on_180(180.0 + 0.08 * np.cos(turn))])
    with rr.RecordingStream("map", recording_id="map", send_properties=False) as stream:
        stream.save(tmp_path / "map.rrd")
        stream.set_log_time_enabled(False)
        recorder = Recorder(stream, 0, has_utc=False)
        view = track_tab._map(recorder, turn, place, known, [slice(0, 60)], [colours.GNSS])
        stream.send_blueprint(rrb.Blueprint(rrb.Tabs(contents=[view]), auto_views=False))
        stream.disconnect()
    client = headless_viewer(tmp_path / "map.rrd")
    settled(client, max_size=SMALL)  # until the blueprint is there the view is another
    (shown,) = client.get_state().views
    pixels = picture(client.take_screenshot(shown.view_id))
    assert colourful(pixels) > 400
    rows, columns = np.nonzero(pixels.max(axis=2) - pixels.min(axis=2) > SATURATED)
    assert np.ptp(rows) > 0.2 * pixels.shape[0], "zoomed in on the flight"
    assert np.ptp(columns) == pytest.approx(np.ptp(rows), rel=0.2), "as round as it was flown"
    middle = (pixels.shape[0] // 2, pixels.shape[1] // 2)
    inside = pixels[middle[0] - 20 : middle[0] + 20, middle[1] - 20 : middle[1] + 20]
    assert colourful(inside) == 0, "no line across it, round the globe"


def track(longitude: np.ndarray, *, has_utc: bool = True) -> Track:
    count = len(longitude)
    columns = {"altitude_msl_m": np.linspace(100.0, 110.0, count), "hdop": np.full(count, 0.8)}
    time_ns = START_NS + np.arange(count) * 1_000_000_000
    return Track("gnss", "gnss", time_ns, START_NS, has_utc, np.linspace(10.0, 11.0, count), longitude, columns)


ACROSS = np.array([179.0, 179.9, -179.7, -179.0, 179.5, 179.0])


@given(st.lists(st.floats(-180.0, 180.0), min_size=1, max_size=30))
def test_pieces_of_a_track_hold_every_row_once_and_cross_nothing(longitude: list[float]) -> None:
    one = track(np.array(longitude))
    rows = [row for piece in one.pieces() for row in range(piece.start, piece.stop)]
    assert rows == list(range(len(longitude)))
    for piece in one.pieces():
        assert (np.abs(np.diff(one.longitude_deg[piece])) <= 180.0).all()


def test_a_kml_track_is_cut_at_the_date_line(tmp_path: Path) -> None:
    write_kml(tmp_path / "a.kml", "a", [track(ACROSS)])
    root = ET.parse(tmp_path / "a.kml").getroot()
    (whole,) = root.iter(f"{GX}MultiTrack")
    parts = whole.findall(f"{GX}Track")
    spots = [[[float(one) for one in str(spot.text).split()] for spot in part.iter(f"{GX}coord")] for part in parts]
    assert [[spot[0] for spot in part] for part in spots] == [[179.0, 179.9], [-179.7, -179.0], [179.5, 179.0]]
    for part in parts:
        count = len(part.findall(f"{GX}coord"))
        assert len(part.findall(f"{KML}when")) == count
        assert {len(array) for array in part.iter(f"{GX}SimpleArrayData")} == {count}
    write_kml(tmp_path / "b.kml", "a", [track(ACROSS[:2])])
    assert not list(ET.parse(tmp_path / "b.kml").getroot().iter(f"{GX}MultiTrack")), "one that crosses none is whole"


def test_a_kml_line_ends_at_the_date_line_and_begins_there_again(tmp_path: Path) -> None:
    write_kml(tmp_path / "a.kml", "a", [track(ACROSS, has_utc=False)])
    (whole,) = ET.parse(tmp_path / "a.kml").getroot().iter(f"{KML}MultiGeometry")
    lines = [
        np.array([[float(one) for one in spot.split(",")] for spot in str(line.findtext(f"{KML}coordinates")).split()])
        for line in whole.iter(f"{KML}LineString")
    ]
    assert [line[:, 0].tolist() for line in lines] == [
        [179.0, 179.9, 180.0],
        [-180.0, -179.7, -179.0, -180.0],
        [180.0, 179.5, 179.0],
    ]
    for before, after in pairwise(lines):
        assert before[-1, 1:].tolist() == after[0, 1:].tolist(), "one place, height too"
    assert lines[0][-1, 1] == pytest.approx(10.2 + 0.2 * 0.1 / 0.4) and lines[0][-1, 2] == pytest.approx(102.5)


def test_a_gpx_track_begins_a_segment_behind_the_date_line(tmp_path: Path) -> None:
    write_gpx(tmp_path / "a.gpx", "a", [track(ACROSS)])
    segments = list(ET.parse(tmp_path / "a.gpx").getroot().iter(f"{GPX}trkseg"))
    longitudes = [[float(str(point.get("lon"))) for point in one] for one in segments]
    assert longitudes == [[179.0, 179.9], [-179.7, -179.0], [179.5, 179.0]]


@pytest.mark.parametrize("longitude_deg", [38.0, 180.0, -179.9999])
def test_a_touchdown_on_the_date_line_is_where_it_is(longitude_deg: float) -> None:
    scenario = replace(PLAIN, runway=TrueRunway(56.0, longitude_deg, 90.0), recorded=EXACT)
    plain = only(simulate_approach(replace(PLAIN, runway=TrueRunway(56.0, 38.0, 90.0), recorded=EXACT)))
    moved = only(simulate_approach(scenario))
    assert moved.touchdown is not None and plain.touchdown is not None
    assert float(on_180(np.array(moved.touchdown.longitude_deg - longitude_deg))) == pytest.approx(
        plain.touchdown.longitude_deg - 38.0, abs=1e-6
    )
    assert moved.touchdown.sink_rate_mps == pytest.approx(plain.touchdown.sink_rate_mps, abs=1e-3)


def test_errors_along_and_across_do_not_jump_with_a_place_missing_at_the_date_line() -> None:
    time = np.arange(0.0, 3600.0, 10.0)
    longitude = 179.0 + 0.01 * np.arange(len(time))
    latitude = np.full(len(time), 60.0)
    missing = longitude.copy()
    missing[100] = np.nan  # just there
    errors = np.linspace(0.0, 1000.0, len(time)), np.zeros(len(time))
    for places in (longitude, on_180(missing), on_180(longitude)):
        found = ins_errors(time, *errors, latitude, places)
        assert np.nanmax(np.abs(found.along_nmi)) < 1e-6, "flown east, wrong to the north"


def test_a_session_round_a_pole_has_a_plane() -> None:
    place = ecef_m(np.full(4, 89.9), np.array([0.0, 90.0, 180.0, -90.0]), np.zeros(4))
    assert plane_through(place).latitude_deg == pytest.approx(90.0, abs=1e-6)


def log_of(path: Path, latitude: np.ndarray, longitude: np.ndarray) -> Path:
    """A flat CSV of an aircraft that was at these places, 1 s apart."""
    time = np.arange(float(len(latitude)))
    velocity = np.gradient(ecef_m(latitude, longitude, np.full(len(time), 9000.0)), time, axis=0)
    north, east, _down = np.einsum("nij,ni->jn", ecef_from_n(latitude, longitude), velocity)
    heading = np.mod(np.rad2deg(np.arctan2(east, north)) + 1.0, 360.0)
    columns = {
        "time_s": time,
        "gnss.latitude_deg": latitude,
        "gnss.longitude_deg": longitude,
        "gnss.velocity_north_mps": north,
        "gnss.velocity_east_mps": east,
        "gnss.gdop": np.full(len(time), 1.5),
        "ins.latitude_deg": latitude,
        "ins.longitude_deg": longitude,
        "ins.velocity_north_mps": north + 0.1 + 1e-4 * time,
        "ins.velocity_east_mps": east - 0.1,
        "ins.true_heading_deg": heading,
        "ins.roll_deg": np.zeros(len(time)),
        "ins.pitch_deg": np.zeros(len(time)),
    }
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.8f}" for value in row) for row in rows)]
    path.write_text("# start_utc: 2026-05-04T06:00:00Z\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_flights_over_a_pole_and_across_the_date_line_are_run_to_the_end(tmp_path: Path) -> None:
    turn = np.linspace(0.0, 6.0, 601)
    exact = over_the_pole(601)
    exact[0][300] = 90.0
    places = {
        "pole": exact,
        "beside": over_the_pole(601, 200.0),
        "circle": (60.0 + 0.1 * np.sin(turn), np.mod(180.0 + 0.1 * np.cos(turn), 360.0)),  # as some count, to 360
    }
    logs = [log_of(tmp_path / f"{name}.csv", *place) for name, place in places.items()]
    outcomes = run_many(logs, tmp_path / "out", Configuration(), jobs=1, with_pdf=False)
    assert [(one.state, one.text) for one in outcomes if one.state != "done"] == []
    for one in outcomes:
        summary = json.loads((Path(one.folder) / "summary.json").read_text(encoding="utf-8"))
        assert summary["status"] == "ok"
        assert (Path(one.folder) / "report.html").stat().st_size > 20_000
