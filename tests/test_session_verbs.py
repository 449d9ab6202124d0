"""What every verb makes of the folder of a session."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.cli.main import main
from groundstation.pipeline.many_flights.inputs import flight_folders, session_folders
from groundstation.pipeline.verbs.compare import compare
from groundstation.pipeline.verbs.serve import recordings_in
from groundstation.simulation.session_log import write_session
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeTracks
from groundstation.systems.cooperative.comparison_plots import session_errors
from groundstation.systems.cooperative.graph_files import g2o_file
from groundstation.viewer.fleet_catalog import SESSIONS, catalog_server
from tests.recording_contents import Contents
from tests.saved import load
from tests.session_example import SEED, SHORT


def called(*arguments: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Flights and their session, as ``run`` leaves them."""
    logs, folder = tmp_path_factory.mktemp("logs"), tmp_path_factory.mktemp("out")
    write_session(SHORT, logs, "example", SEED)
    assert called("run", logs, "-o", folder, "--config", logs / "settings.toml", "-j", "1", "--no-pdf", "-q") == 0
    return folder


@pytest.fixture
def session(out: Path) -> Path:
    (found,) = session_folders(out)
    return found


@pytest.mark.parametrize("verb", ["info", "check", "convert", "clip"])
def test_verbs_for_one_log_refuse_a_session_in_a_line(
    verb: str, session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = ["-o", str(tmp_path / "x.mcap")] if verb in ("convert", "clip") else []
    assert called(verb, session, *output) == 2
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert "found a session of several aircraft, expected a log: manifest.json in it names its logs" in told.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("of", ["", "summary.json"])
def test_list_tells_the_analyses_of_a_session(of: str, session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert called("list", session / of, "--json") == 0
    (entry,) = json.loads(capsys.readouterr().out)
    assert (entry["name"], entry["would_run"], entry["reason"]) == ("cooperative", True, "")


def test_list_takes_a_flight_folder(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert called("list", flight_folders(out)[0], "--json") == 0
    entries = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert "no GNSS velocity" in entries["heading"]["reason"]


def test_a_session_is_run_again_with_other_settings(session: Path, tmp_path: Path) -> None:
    assert called("cooperative", session, "-o", tmp_path, "-q", "--no-pdf") == 0
    (again,) = session_folders(tmp_path)
    one, other = (load(folder).results for folder in (session, again))
    assert again.name == session.name
    assert one.source.sha256 == other.source.sha256

    found, saved, _ = compare(session, again)
    deltas = {delta.name: delta for delta in found.deltas}
    assert found.is_same_log and found.alignment.event == "utc"
    reckoned = deltas["cooperative.algorithms.dead_reckoning.two_sigma_r_m"]
    assert reckoned.is_main and reckoned.delta is not None and reckoned.delta > 100.0, "the shipped sigma is larger"
    assert "cooperative.vehicles.centralised.A.sigma_north_m" in deltas
    assert "cooperative.links.A.B.ranges" in deltas
    assert {"cooperative.ins.position_m"} <= {pair.name for pair in found.settings}
    assert called("compare", session, again, "-o", tmp_path / "c") == 0
    html = (tmp_path / "c" / "compare.html").read_text(encoding="utf-8")
    assert "Both come from the same logs" in html and html.count("<svg") == 4  # each curve with its difference
    entities = Contents(tmp_path / "c" / "compare.rrd").batches
    drawn = {f"/comparison/session_errors-{name}" for name in ("two_sigma_r_m", "rms_error_m")}
    assert all(any(entity.startswith(one) for entity in entities) for one in drawn), entities
    assert session_errors(saved) is not None


def test_the_curves_of_a_comparison_are_those_of_the_tracks(session: Path) -> None:
    saved = load(session)
    curves, tracks = session_errors(saved), saved.figure("cooperative_tracks")
    assert curves is not None and tracks is not None
    last = (tracks["algorithm"] == "smoothed") & (tracks["time_s"] == tracks["time_s"].max())
    assert last.sum() == 3
    assert curves["two_sigma_r_m"][-1] == tracks["two_sigma_r_m"][last].max()
    assert curves["rms_error_m"][-1] == pytest.approx(np.sqrt(np.mean(tracks["error_m"][last] ** 2)))


def test_a_session_is_not_compared_with_a_flight(out: Path, session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = flight_folders(out)[0]
    for pair in ((session, flight), (flight, session)):
        assert called("compare", *pair) == 2
        told = capsys.readouterr().err
        assert told.count("\n") == 1
        assert f"{session.name}: found a session of several aircraft, expected a flight" in told


def test_serve_offers_sessions_as_a_data_set_of_their_own(out: Path, session: Path) -> None:
    from tests.test_serve import client_of

    flights, sessions, fleet = recordings_in(out, lambda _text: None)
    assert [path.stem for path in flights] == [folder.name for folder in flight_folders(out)]
    assert fleet == out / "fleet.rrd"
    with catalog_server(flights, fleet, host="127.0.0.1", port=0, sessions=sessions) as catalog:
        assert catalog.sessions == (session.name,)
        dataset = client_of(catalog.url).get_dataset(SESSIONS)
        assert dataset.segment_ids() == [session.name]
        assert dataset.default_blueprint() is not None


def test_open_takes_a_session(session: Path) -> None:
    import groundstation

    opened = groundstation.open(session)
    assert opened.results.metadata["aircraft"] == "A, B, C"
    with pytest.raises(groundstation.GroundstationError, match="a session of several aircraft"):
        opened.tables["ins"]


def test_a_session_goes_to_tum_files_that_hold_its_tracks(session: Path, tmp_path: Path) -> None:
    assert called("export", session, "-o", tmp_path / "t.tum") == 0
    saved = load(session)
    tracks, answer = saved.results.rows_of(CooperativeTracks), saved.results.answer(CooperativeResult)
    assert tracks is not None and answer is not None and saved.results.start_utc_ns is not None
    places = {}
    for name in answer.vehicle_names:
        table = np.loadtxt(tmp_path / f"t_{name}.tum")  # as evo does: numbers apart from comments
        mine = (tracks.vehicle == name) & (tracks.algorithm == answer.default_algorithm)
        assert table[:, 0] - saved.results.start_utc_ns / 1e9 == pytest.approx(tracks.time_s[mine], abs=1e-6)
        assert (table[:, 4:] == [0, 0, 0, 1]).all()
        places[name] = table[:, 1:4], np.stack([tracks.x_m, tracks.y_m, tracks.z_m], axis=1)[mine]
    (one, there), (two, here) = places["A"], places["B"]
    assert np.linalg.norm(one - two, axis=1) == pytest.approx(np.linalg.norm(there - here, axis=1), abs=1e-3)


def graph_of(path: Path) -> tuple[dict[int, np.ndarray], list[tuple[int, int, list[float]]], dict[str, int]]:
    """Vertices and range edges of a g2o file, read by the grammar of its own documentation; how often each tag is."""
    places, ranges, tags = dict[int, np.ndarray](), [], dict[str, int]()
    length = {"VERTEX_SE3:QUAT": 8, "VERTEX_TRACKXYZ": 4, "FIX": 1, "EDGE_SE3:QUAT": 2 + 7 + 21, "EDGE_RANGE": 4}
    for line in path.read_text().splitlines():
        tag, _, rest = line.partition(" ")
        if tag == "#":
            continue
        numbers = rest.split()
        assert len(numbers) == length[tag]
        tags[tag] = tags.get(tag, 0) + 1
        if tag.startswith("VERTEX"):
            places[int(numbers[0])] = np.array([float(one) for one in numbers[1:4]])
        elif tag.startswith("EDGE"):
            assert {int(one) for one in numbers[:2]} <= places.keys()
            if tag == "EDGE_RANGE":
                ranges.append((int(numbers[0]), int(numbers[1]), [float(one) for one in numbers[2:]]))
    return places, ranges, tags


def test_a_session_goes_to_a_graph_whose_ranges_fit_its_poses(session: Path, tmp_path: Path) -> None:
    assert called("export", session, "-o", tmp_path / "g.g2o", "--track", "centralised") == 0
    places, ranges, tags = graph_of(tmp_path / "g.g2o")
    epochs = tags["VERTEX_SE3:QUAT"]
    assert (tags["VERTEX_TRACKXYZ"], tags["FIX"], tags["EDGE_SE3:QUAT"]) == (2, 2, epochs - 3)
    away = [np.linalg.norm(places[a] - places[b]) - read for a, b, (read, _) in ranges]
    assert len(ranges) > 100 and np.std(away) < 30.0, "10 m of noise, and what the filter did not know yet"
    assert {round(1.0 / information**0.5, 6) for _, _, (_, information) in ranges} == {10.0}


def test_a_station_that_the_answer_surveys_is_free_in_the_graph(session: Path, tmp_path: Path) -> None:
    results = load(session).results
    answer = results.answer(CooperativeResult)
    assert answer is not None and answer.stations is not None
    one, two = answer.stations.rows
    two = replace(two, verdict="off", used_sigma_m=900.0, survey_north_m=300.0, survey_east_m=-400.0)
    stations = replace(answer.stations, rows=(one, two))
    surveyed = replace(results, answers={**results.answers, "cooperative": replace(answer, stations=stations)})
    (tmp_path / "before.g2o").write_text(g2o_file(results, "")[""])
    (tmp_path / "after.g2o").write_text(g2o_file(surveyed, "")[""])
    (before, _, fixed), (after, _, free) = graph_of(tmp_path / "before.g2o"), graph_of(tmp_path / "after.g2o")
    assert (fixed["FIX"], free["FIX"]) == (2, 1)
    assert after[0] == pytest.approx(before[0])
    assert np.linalg.norm(after[1] - before[1]) == pytest.approx(500.0, abs=0.1)
    assert (after[1] - before[1])[:2] == pytest.approx([-400.0, 300.0], abs=10.0)  # axes of another point


def test_what_a_session_cannot_be_written_as_is_said(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, more, text in (
        ("t.kml", (), "expected one of .tum, .g2o"),
        ("t.g2o", ("--track", "gnss"), "expected one of dead_reckoning, centralised"),
    ):
        assert called("export", session, "-o", tmp_path / name, *more) == 2
        assert text in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
