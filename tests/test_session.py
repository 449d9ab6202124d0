"""Logs of several aircraft from the command line to an analysed session."""

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from groundstation.chapters.parts import Facts, Figure, Grid, Mark, Note, Section
from groundstation.cli.main import main
from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.inputs import flight_folders, session_folders
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.pipeline.verbs.cooperative import run_session
from groundstation.plots.extents import x_extent, y_extent, y_span
from groundstation.plots.marks import Outlines
from groundstation.results.figures import FigureData
from groundstation.results.files import load_manifest
from groundstation.results.flight import FlightResults
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_log import write_session
from groundstation.systems.cooperative.analysis import COOPERATIVE, NIS_MAX, innovations_of
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeTracks
from groundstation.systems.cooperative.chapter import TITLES, cooperative, in_text, session_front, trusted, worst_first
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.plots import errors, session_map
from groundstation.systems.cooperative.settings import ALGORITHMS, CooperativeSettings, InsBelief
from groundstation.systems.known import SessionKnown
from tests.recording_contents import Contents
from tests.saved import load
from tests.session_example import SEED, SHORT, simulated
from tests.systems.cooperative.example import believed, truth_of
from tests.told import front

IDENTITY = "20180305T120000Z_session_A-B-C"
SCHEMA = json.loads((Path(__file__).parents[1] / "schemas" / "summary.schema.json").read_text(encoding="utf-8"))
EPOCHS = round(SHORT.duration_s) + 1  # of a second each
SAME_M = 0.01  # what 0.1 mm and 0.01 mm/s of the logs, and 0.1 mm of a range, leave of positions


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    write_session(SHORT, folder, "example", SEED)
    return folder


def csvs(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.csv"))


def called(*arguments: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


def of(logs: Path, out: Path, *more: str | Path) -> Sequence[str | Path]:
    stations, settings = logs / "stations.toml", logs / "settings.toml"
    return ("cooperative", *csvs(logs), "--stations", stations, "--config", settings, "-o", out, *more)


@pytest.fixture(scope="module")
def out(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished session; those that change it copy it."""
    folder = tmp_path_factory.mktemp("out")
    assert called(*of(logs, folder, "-q")) == 0
    return folder


@pytest.fixture(scope="module")
def results(out: Path) -> FlightResults:
    return load(out / IDENTITY).results


@pytest.fixture
def answer(results: FlightResults) -> CooperativeResult:
    found = results.answer(CooperativeResult)
    assert found is not None
    return found


def test_the_folder_of_a_session(out: Path, logs: Path) -> None:
    folder = out / IDENTITY
    names = {path.name for path in folder.iterdir()}
    assert {"summary.json", "manifest.json", "tables", "report.html", f"{IDENTITY}.rrd"} <= names
    assert session_folders(out) == [folder]
    assert flight_folders(out) == []
    manifest = load_manifest(folder)
    assert sorted(log.name for log in manifest.logs) == [path.name for path in csvs(logs)]
    for log in manifest.logs:
        assert Path(log.path).is_file()
        assert (folder / log.mcap).is_file()
        assert len(log.sha256) == 64
    assert manifest.configuration["stations"]["stations"][0]["name"] == "N1"


def test_the_summary_obeys_the_schema(out: Path, answer: CooperativeResult) -> None:
    document = json.loads((out / IDENTITY / "summary.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    assert document["flight"]["aircraft"] == "A, B, C"
    assert document["flight"]["start_utc"] == "2018-03-05T12:00:00.000Z"
    assert set(document["results"]) == {"cooperative"}
    assert document["status"] == "ok"
    assert [row.algorithm for row in answer.algorithms] == list(ALGORITHMS)
    assert answer.settings["ins.position_m"] == SHORT.errors.position_m, "the settings beside the logs were used"


def test_the_session_from_simulation_and_through_the_logs_gives_the_same(results: FlightResults) -> None:
    simulated = simulate_session(SHORT, SEED)
    direct, _ = estimate_session(simulated.session, settings=believed(SHORT), truth=truth_of(simulated))
    through = results.figure_with_rows("cooperative_tracks")
    expected = next(figure for figure in direct.figures if figure.name == "cooperative_tracks")
    assert through is not None
    for algorithm in ("dead_reckoning", "centralised"):
        rows, others = through["algorithm"] == algorithm, expected["algorithm"] == algorithm
        assert through["vehicle"][rows].tolist() == expected["vehicle"][others].tolist()
        for column in ("x_m", "y_m", "z_m", "two_sigma_r_m", "error_m"):
            assert through[column][rows] == pytest.approx(expected[column][others], abs=SAME_M), (algorithm, column)


def test_a_finished_session_is_not_run_again(
    out: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    summary, page = copy / IDENTITY / "summary.json", copy / IDENTITY / "report.html"
    before = summary.stat().st_mtime_ns
    page.unlink()
    assert called(*of(logs, copy, "--json")) == 0
    assert summary.stat().st_mtime_ns == before
    assert page.read_bytes() == (out / IDENTITY / "report.html").read_bytes()
    (told,) = json.loads(capsys.readouterr().out)
    assert (told["state"], told["flight_id"]) == ("done", IDENTITY)
    assert "3 aircraft, smoothed: 2 sigma_r" in told["text"]


def test_a_finished_session_gets_its_pdf_and_keeps_it(
    out: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    folder = copy / IDENTITY
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    del before[folder / "manifest.json"]

    def was_finished(*more: str) -> bool:
        assert called(*of(logs, copy, "--json", *more)) == 0
        return bool(json.loads(capsys.readouterr().out)[0]["was_finished"])

    assert not was_finished("--pdf")
    assert {path: path.read_bytes() for path in before} == before
    pdf = (folder / "report.pdf").read_bytes()
    assert "report.pdf" in load_manifest(folder).files
    assert was_finished("--pdf") and was_finished() and (folder / "report.pdf").read_bytes() == pdf
    (folder / "report.pdf").write_bytes(pdf[:100])
    assert was_finished() and not was_finished("--pdf") and (folder / "report.pdf").read_bytes() == pdf
    done = report_again(copy)
    assert done.removed == [folder / "report.pdf"] and not done.removed[0].exists()


def test_another_setting_runs_it_again_in_its_place(out: Path, logs: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    config = tmp_path / "c.toml"
    config.write_text("[cooperative]\noutput_step_s = 10.0\n[session]\nrange_sigma_m = 20.0\n")
    assert called("cooperative", *csvs(logs), "--config", config, "-o", copy, "-q", "--no-pdf") == 0
    assert [folder.name for folder in session_folders(copy)] == [IDENTITY]
    found = load(copy / IDENTITY).results
    answer = found.answer(CooperativeResult)
    assert answer is not None
    assert answer.settings["output_step_s"] == 10.0
    assert {finding.code for finding in found.findings} >= {"session.unknown_source"}, "no stations were given"


def test_mcaps_go_in_by_reference_in_any_order(out: Path, logs: Path, tmp_path: Path) -> None:
    mcaps = sorted((out / IDENTITY / "mcap").glob("*.mcap"), reverse=True)
    configuration = load_configuration(logs / "settings.toml")
    (outcome,) = run_session(mcaps, tmp_path / "out", configuration, stations=logs / "stations.toml", with_pdf=False)
    assert outcome.state == "done"
    assert outcome.flight_id == IDENTITY
    folder = Path(outcome.folder)
    assert not (folder / "mcap").exists()
    assert sorted(log.mcap for log in load_manifest(folder).logs) == sorted(str(path.absolute()) for path in mcaps)
    one, other = (json.loads((path / IDENTITY / "summary.json").read_text()) for path in (out, tmp_path / "out"))
    assert one["results"] == other["results"]
    assert one["flight"]["source"]["sha256"] == other["flight"]["source"]["sha256"]


def test_wrong_input_is_told_in_a_line(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert called("cooperative", tmp_path / "no.csv", "-o", tmp_path / "a") == 2
    for name, text, said in (
        ("stations", "[[stations]]\nname = 'N1'\n", "latitude_deg"),
        ("config", "[cooperative]\ngate = 3\n", "key cooperative.gate"),
        ("config", "[session]\nrange_sigma_m = -1\n", "key session.range_sigma_m"),
    ):
        file = tmp_path / f"{name}.toml"
        file.write_text(text)
        assert called("cooperative", *csvs(logs), f"--{name}", file, "-o", tmp_path / "a") == 2
        told = capsys.readouterr().err
        assert said in told and "Traceback" not in told
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "letter.txt").write_text("mine")
    assert called("cooperative", *csvs(logs), "-o", foreign) == 2
    assert not (tmp_path / "a").exists()


def test_a_log_that_cannot_be_read_stops_no_other(logs: Path, tmp_path: Path) -> None:
    bad = tmp_path / "C.csv"
    bad.write_bytes(b"\x00\x01nothing")
    first, second, _ = csvs(logs)
    outcomes = run_session([first, second, bad], tmp_path / "out", Configuration(), with_pdf=False)
    assert [outcome.state for outcome in outcomes] == ["failed", "done"]
    found = load(Path(outcomes[1].folder)).results
    assert found.metadata["aircraft"] == "A, B"
    codes = {(finding.code, finding.topic) for finding in found.findings}
    assert ("session.unknown_source", "link.C") in codes


def test_a_cut_log_loses_data_and_says_so(logs: Path, tmp_path: Path) -> None:
    first, second, third = csvs(logs)
    cut = tmp_path / third.name
    cut.write_bytes(third.read_bytes()[:-20])
    (outcome,) = run_session([first, second, cut], tmp_path / "out", Configuration(), with_pdf=False)
    assert (outcome.state, outcome.code) == ("data_lost", 3)
    found = load(Path(outcome.folder)).results
    assert found.status == "degraded"
    assert [finding.place for finding in found.findings if finding.code == "session.lost_data"] == [third.name]


def test_logs_without_dead_reckoning_are_an_error_and_leave_nothing(tmp_path: Path) -> None:
    log = tmp_path / "x.csv"
    log.write_text("# aircraft: X\ntime_s,baro.pressure_altitude_m\n0,100\n1,101\n2,102\n")
    (outcome,) = run_session([log], tmp_path / "out", Configuration(), with_pdf=False)
    assert (outcome.state, outcome.code) == ("failed", 1)
    assert "no INS with latitude" in outcome.text
    assert session_folders(tmp_path / "out") == []
    assert [path for path in (tmp_path / "out").iterdir() if path.is_dir()] == []


def test_reports_are_made_again_from_the_folder_alone(out: Path, tmp_path: Path) -> None:
    copy = tmp_path / IDENTITY
    shutil.copytree(out / IDENTITY, copy)
    (copy / "report.html").unlink()
    paths, problems, removed = report_again(copy)
    assert not problems and not removed
    assert [path.name for path in paths] == ["report.html"]
    assert (copy / "report.html").read_bytes() == (out / IDENTITY / "report.html").read_bytes()


def test_reports_of_an_out_with_nothing_but_sessions(out: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    (copy / IDENTITY / "report.html").unlink()
    problems = report_again(copy).problems
    assert not [one for one in problems if one.code]
    assert (copy / IDENTITY / "report.html").is_file()


# ------------------------------------------------------------------------------------------------ chapter and page


def section_of(results: FlightResults) -> Section:
    section = cooperative(results)
    assert section is not None
    return section


def grids(section: Section) -> dict[str, Grid]:
    return {part.title: part for part in section.parts if isinstance(part, Grid)}


def test_every_algorithm_has_a_title() -> None:
    assert list(TITLES) == list(ALGORITHMS)


def test_the_front_says_what_was_found(results: FlightResults, answer: CooperativeResult) -> None:
    best, top = trusted(answer), front(results)
    assert top.legend and replace(top, legend=()) == session_front(results, tuple(top.pairs))
    assert top.title == "Session of A, B, C"
    assert top.headline.startswith(f"{TITLES[best.algorithm]}: 2σ_r ")
    assert {label: value for label, value, _ in top.figures}.keys() >= {
        "2σ_r",
        "RMS error",
        "Dead reckoning alone",
    }
    assert "eading" not in top.headline


def test_the_algorithm_to_trust(answer: CooperativeResult) -> None:
    def among(*changes: dict[str, object]) -> str:
        rows = answer.algorithms[: len(changes)]
        changed = tuple(replace(row, **change) for row, change in zip(rows, changes, strict=True))  # type: ignore[arg-type]
        return trusted(replace(answer, algorithms=changed)).algorithm

    sound = {"is_consistent": True, "diverges": False, "nees": 2.0, "nees_high": 3.0}
    wrong = {"is_consistent": False, "diverges": False, "rms_m": 5.0, "nees": 4.0, "nees_high": 3.0}
    careful = {"is_consistent": False, "diverges": False, "rms_m": 5.0, "nees": 0.1, "nees_high": 3.0}
    assert among({**sound, "rms_m": 1.0}, {**sound, "rms_m": 9.0}, {**sound, "rms_m": 5.0}) == "centralised"
    assert among({**sound, "rms_m": 1.0}, {**wrong, "rms_m": 9.0}, {**sound, "rms_m": 5.0}) == "neighbour_exact"
    assert among({**sound, "rms_m": 1.0}, {**sound, "rms_m": 9.0}, wrong) == "centralised"
    assert among({**sound, "rms_m": 1.0}, careful, {**sound, "rms_m": 1.0}) == "centralised"  # errs less than it says
    lost = {**sound, "diverges": True, "rms_m": 1.0}
    assert among({**sound, "rms_m": 1.0}, {**sound, "rms_m": 9.0}, lost) == "centralised"
    unknown = {"is_consistent": None, "diverges": None, "rms_m": None, "nees": None, "nees_high": None}
    assert among(unknown, unknown, unknown) == "centralised"
    assert among(unknown) == "dead_reckoning"


def test_the_chapter_tells_algorithms_aircraft_geometry_links_and_clocks(
    results: FlightResults, answer: CooperativeResult
) -> None:
    section = section_of(results)
    found = grids(section)
    best = trusted(answer)
    names = [row[0].text for row in found["Algorithms"].rows if isinstance(row[0], Mark)]
    assert names == list(TITLES.values())
    (chosen,) = [row[0].text for row in found["Algorithms"].rows if isinstance(row[0], Mark) and row[0].tone == "good"]
    assert chosen == TITLES[best.algorithm]
    assert [row[0] for row in found[f"Aircraft, {in_text(best.algorithm)}"].rows] == ["A", "B", "C"]
    assert [row[0] for row in found["Geometry"].rows] == ["A", "B", "C"]
    assert len(found["Links"].rows) == len(answer.links)
    residuals = [row.residual_rms_m for row in worst_first(answer.links)]
    assert residuals == sorted(residuals, key=lambda value: -(value or 0.0))
    assert [row[:3] for row in found["Clocks of the logs"].rows] == [
        (name, f"example-{name}.csv", "yes") for name in "ABC"
    ]
    figures = [part.name for part in section.parts if isinstance(part, Figure)]
    assert figures == [f"cooperative.{name}" for name in ("map", "errors", "geometry", "links")]
    assert any(isinstance(part, Facts) and part.compact for part in section.parts)


def test_without_truth_nothing_is_judged(results: FlightResults, answer: CooperativeResult) -> None:
    nothing = dict.fromkeys(("rms_m", "nees", "nees_low", "nees_high", "bound_ratio", "diverges", "is_consistent"))
    rows = tuple(replace(row, **nothing) for row in answer.algorithms)  # type: ignore[arg-type]
    blind = replace(results, answers={"cooperative": replace(answer, algorithms=rows)})
    section = section_of(blind)
    (note,) = [part for part in section.above if isinstance(part, Note)]
    assert note.tone == "unknown"
    assert "no log holds a truth" in note.text
    cells = [cell.text for row in grids(section)["Algorithms"].rows for cell in row[1:] if isinstance(cell, Mark)]
    assert set(cells) == {"no truth"}
    assert front(blind).verdict == Mark("unknown", "Not judged")


def with_tracks(results: FlightResults, **columns: np.ndarray) -> FlightResults:
    """The results with some columns of the tracks in place of their own."""
    return replace(
        results,
        figures=tuple(
            FigureData(one.name, {**one.columns, **(columns if one.name == "cooperative_tracks" else {})}, one.digits)
            for one in results.figures
        ),
    )


def test_ellipses_never_squeeze_the_map(results: FlightResults) -> None:
    def mapped(of: FlightResults) -> tuple[str, list[float], int]:
        drawn = session_map(of)
        assert drawn is not None
        marks = drawn.rows[0].panels[0].marks
        rings = sum(len(mark.rings) for mark in marks if isinstance(mark, Outlines))
        return drawn.caption, [*x_extent(marks), *y_extent(marks)], rings

    data = results.rows_of(CooperativeTracks)
    assert data is not None
    caption, ends, rings = mapped(results)
    assert rings == 24 and "wider" not in caption
    late = data.time_s > 0.5 * data.time_s.max()
    wide = with_tracks(results, sigma_north_m=np.where(late, 1e7, data.sigma_north_m))
    caption, with_wide, rings = mapped(wide)
    assert with_wide == ends and rings == 12 and "; 12 wider than the map are not drawn" in caption


def test_errors_that_span_two_decades_have_a_logarithmic_axis(results: FlightResults) -> None:
    data = results.rows_of(CooperativeTracks)
    assert data is not None
    for largest, scale in ((30.0, "linear"), (3000.0, "log")):
        bound = np.where(data.algorithm == "dead_reckoning", largest, np.linspace(20.0, 29.0, len(data.time_s)))
        drawn = errors(with_tracks(results, two_sigma_r_m=bound, error_m=np.full(len(bound), 12.0)))
        assert drawn is not None
        for panel in (panel for row in drawn.rows for panel in row.panels):
            span = y_span(panel)
            assert span.scale == scale and span.low <= 12.0 and span.high >= largest, "all three curves are seen"


def test_a_session_without_an_answer_says_why(results: FlightResults) -> None:
    from groundstation.results.flight import NotAssessable

    bare = replace(results, answers={}, not_assessable=(NotAssessable("cooperative", "no range at all"),))
    assert bare.is_session
    top = front(bare)
    assert top.headline == "Navigation between aircraft: not assessable"
    assert top.sentences == ("No range at all.",)


def test_the_page_is_a_session_report_without_a_chapter_on_the_heading(out: Path) -> None:
    page = (out / IDENTITY / "report.html").read_text(encoding="utf-8")
    assert "Session report" in page
    assert "eading correction" not in page
    assert page.count("<svg") == 4
    for chapter in ("cooperative", "findings", "provenance"):
        assert f'<section id="{chapter}"' in page


# ------------------------------------------------------------------------------------------------ recording


@pytest.fixture(scope="module")
def contents(out: Path) -> Contents:
    return Contents(out / IDENTITY / f"{IDENTITY}.rrd")


def test_the_recording_has_both_timelines_and_every_aircraft(contents: Contents) -> None:
    assert contents.timelines == {"utc", "flight_time"}
    for name in "ABC":
        for entity in (f"/space/{name}/now", f"/space/{name}/ellipsoid", f"/cooperative/errors/{name}/c00_band"):
            assert sum(batch.num_rows for batch in contents.batches[entity]) == EPOCHS, entity
        assert f"/space/{name}/track" in contents.fixed
    assert "/space/stations" in contents.fixed


def test_ellipsoids_are_those_of_two_sigma(contents: Contents, results: FlightResults) -> None:
    tracks = results.figure_with_rows("cooperative_tracks")
    assert tracks is not None
    rows = (tracks["algorithm"] == "smoothed") & (tracks["vehicle"] == "B")
    reckoned = tracks["sigma_up_m"][tracks["algorithm"] == "dead_reckoning"]
    assert reckoned == pytest.approx(SHORT.errors.baro_m, rel=0.01), "the barometer's alone"
    (batch,) = contents.batches["/space/B/ellipsoid"]
    half_m, turn = (
        np.array([row[0] for row in batch.column(f"Ellipsoids3D:{name}").to_pylist()])
        for name in ("half_sizes", "quaternions")
    )
    assert half_m[:, 2] == pytest.approx(2.0 * tracks["sigma_up_m"][rows], rel=1e-5)
    angle_rad = 2.0 * np.arctan2(turn[:, 2], turn[:, 3])  # of the first half axis, from east to north
    first, second = half_m[:, 0] ** 2, half_m[:, 1] ** 2
    east = first * np.cos(angle_rad) ** 2 + second * np.sin(angle_rad) ** 2
    north = first * np.sin(angle_rad) ** 2 + second * np.cos(angle_rad) ** 2
    both = (first - second) * np.sin(angle_rad) * np.cos(angle_rad)
    assert east == pytest.approx(4.0 * tracks["sigma_east_m"][rows] ** 2, rel=1e-4)
    assert north == pytest.approx(4.0 * tracks["sigma_north_m"][rows] ** 2, rel=1e-4)
    expected = 4.0 * (tracks["correlation_north_east"] * tracks["sigma_north_m"] * tracks["sigma_east_m"])[rows]
    assert both == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_links_are_drawn_at_every_second_and_have_lanes(contents: Contents, answer: CooperativeResult) -> None:
    strips = contents.batches["/space/links"]
    rows = [len(row) for batch in strips for row in batch.column("LineStrips3D:strips").to_pylist()]
    assert len(rows) == EPOCHS
    assert set(rows[:-1]) == {len([row for row in answer.links if row.kind != "satellite"])}
    assert rows[-1] == 0, "behind the last range nothing is drawn"
    assert len([entity for entity in contents.batches if entity.startswith("/cooperative/links/")]) == 12


def test_errors_and_geometry_in_the_recording_are_those_of_the_results(
    contents: Contents, results: FlightResults, answer: CooperativeResult
) -> None:
    tracks = results.figure_with_rows("cooperative_tracks")
    assert tracks is not None
    rows = (tracks["algorithm"] == trusted(answer).algorithm) & (tracks["vehicle"] == "B")
    time_ns, values = contents.scalars("/cooperative/errors/B/b00_lines")
    assert time_ns == pytest.approx(tracks["time_s"][rows] * 1e9)
    assert values[:, 1] == pytest.approx(tracks["error_m"][rows]), "behind dead reckoning"
    _, middle, half = contents.band("/cooperative/errors/B/c00_band")
    assert not middle.any() and half == pytest.approx(tracks["two_sigma_r_m"][rows])
    geometry = results.figure_with_rows("cooperative_geometry")
    assert geometry is not None
    _, determinant = contents.scalars("/cooperative/geometry/det_H_H/b00_lines")
    assert determinant[:, 0] == pytest.approx(geometry["determinant"][geometry["vehicle"] == "A"])


def without_digits(text: str) -> str:
    return re.sub(r"\d", "", text)


def test_the_text_of_the_recording_is_the_chapter(contents: Contents, results: FlightResults) -> None:
    from groundstation.chapters.markdown import markdown

    section = section_of(results)
    text = contents.text("/cooperative/answer")
    assert without_digits(text) == without_digits(markdown(section)), "equal but for the digits that saving rounds"
    assert text.splitlines()[0].startswith("# ")
    assert "2σ" in text.splitlines()[0]


def test_view_takes_a_session_folder(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.viewer import launch

    opened: list[Path] = []

    def open_viewer(what: Path, **_options: object) -> int:
        opened.append(what)
        return 0

    monkeypatch.setattr(launch, "open_viewer", open_viewer)
    monkeypatch.setenv("DISPLAY", ":0")
    assert called("view", out / IDENTITY) == 0
    assert opened == [out / IDENTITY / f"{IDENTITY}.rrd"]


def test_ranges_that_contradict_the_stated_sigmas_are_a_warning(
    results: FlightResults, answer: CooperativeResult
) -> None:
    """Without any truth: a filter that is too sure is told by its innovations."""
    assert not [finding for finding in results.findings if finding.code == "cooperative.too_sure"]
    assert max(innovations_of(answer).values()) < NIS_MAX
    session = simulated(SHORT).session
    belief = InsBelief(position_m=1.0, velocity_mps=0.001, baro_m=0.1, clock_m=0.1, clock_mps=0.001)
    sure = CooperativeSettings(ins=belief, gate_sigma=0.0)
    found = run_analyses((COOPERATIVE,), session, SessionKnown(settings={"cooperative": sure}))
    (finding, *_) = (one for one in found.findings["cooperative"] if one.code == "cooperative.too_sure")
    assert finding.severity == "warn" and "instead of 1;" in finding.text
    assert "sigma too small" in COOPERATIVE.sentence(found.answers)


def test_a_station_a_little_off_is_named_by_its_ranges() -> None:
    """Nearer than what the assembly takes for far: the test of the stations finds it, without that the gate."""

    def named(north_m: float, *, judges_stations: bool) -> list[tuple[str, str]]:
        session = simulated(SHORT).session
        first = session.points[0]
        x, y, z = first.position_m
        moved = replace(session, points=(replace(first, position_m=(x + north_m, y, z)), *session.points[1:]))
        found = run_analyses(
            (COOPERATIVE,),
            moved,
            SessionKnown(settings={"cooperative": believed(SHORT, judges_stations=judges_stations)}),
        )
        return [(one.code, one.place) for one in found.findings["cooperative"] if "station" in one.code]

    name = simulated(SHORT).session.points[0].name
    assert named(0.0, judges_stations=True) == named(0.0, judges_stations=False) == []
    assert named(1000.0, judges_stations=True) == [("cooperative.station_drift", name)]
    assert named(1000.0, judges_stations=False) == [("cooperative.misplaced_station", name)]


def test_run_into_the_same_folder_leaves_the_session_be(out: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    log = Path(__file__).parents[1] / "sample_logs" / "taxi-short.csv"
    assert called("run", log, "-o", copy, "-q", "--no-pdf", "-j", "1") == 0
    rows = json.loads((copy / "index.json").read_text(encoding="utf-8"))["rows"]
    assert [(row["kind"], row["source"]) for row in rows] == [
        ("flight", "taxi-short.csv"),
        ("session", "session of A, B, C"),
    ]
    assert len(flight_folders(copy)) == 1
    assert [folder.name for folder in session_folders(copy)] == [IDENTITY]
    assert (copy / IDENTITY / "report.html").read_bytes() == (out / IDENTITY / "report.html").read_bytes()
