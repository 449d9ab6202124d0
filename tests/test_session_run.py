"""Sessions that ``run`` finds among the flights of a folder."""

import json
import random
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import fsspec
import pytest
import rerun.blueprint as rrb

from groundstation.cli.main import main
from groundstation.pipeline.many_flights.inputs import flight_folders, session_folders
from groundstation.pipeline.many_flights.remote.folder import RemoteFolder
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.sessions import search as session_search
from groundstation.pipeline.many_flights.sessions.search import Member, Span, sessions_among
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.files import load, load_document, load_manifest
from groundstation.results.flight import FlightResults
from groundstation.simulation.session_log import write_session
from groundstation.systems import systems
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.viewer.file_contents import layout_of
from tests.session_example import SEED, SHORT

IDENTITY = "20180305T120000Z_session_A-B-C"
NS = 10**9
WEEK_S, LEAP_S = 604_800, 1_000
FAR_DEG = 1.0  # of a station's latitude: 111 km

# ------------------------------------------------------------------------------------------------ the search alone


def flight(name: str, aircraft: str, hears: str, span_s: tuple[int, int] | None) -> Member:
    span = None if span_s is None else (span_s[0] * NS, span_s[1] * NS)
    return Member(Path(name), aircraft, frozenset(hears.split()), span)


def searched(*flights: Member, heard: dict[str, Span] | None = None) -> tuple[list[list[str]], dict[str, str]]:
    groups, apart = sessions_among(flights, lambda folder: (heard or {}).get(folder.name))
    return [[one.folder.name for one in group] for group in groups], {one.folder.name: one.reason for one in apart}


def test_flights_hang_together_by_any_chain() -> None:
    a, b, c = flight("a", "A", "B", (0, 10)), flight("b", "B", "", (5, 30)), flight("c", "C", "B N1", (25, 40))
    lonely = flight("d", "D", "N1", (0, 40))
    assert searched(a, b, c, lonely) == ([["a", "b", "c"]], {})


def test_a_link_to_an_aircraft_of_another_day_is_told() -> None:
    a, b = flight("a", "A", "B", (0, 10)), flight("b", "B", "A", (110, 120))
    groups, apart = searched(a, b)
    assert groups == []
    assert apart["a"] == "ranges to B, in no session: none of their flights overlaps, 100 s away at least"
    assert apart.keys() == {"a", "b"}
    assert searched(a) == ([], {}), "of an aircraft that is nowhere there is nothing to tell"


def test_a_clock_that_is_wrong_hides_no_session() -> None:
    a, b = flight("a", "A", "B", (0, 10)), flight("b", "B", "A", (WEEK_S, WEEK_S + 10))
    assert searched(a, b, heard={"a": (0, 9), "b": (1, 10)})[0] == [["a", "b"]]
    nowhere = replace(b, span_ns=None)
    assert searched(a, nowhere, heard={"a": (0, 9), "b": (1, 10)})[0] == [["a", "b"]]
    assert searched(a, b, heard={"a": (0, 9), "b": (10, 20)})[0] == []


def test_times_of_transmission_that_begin_anew_every_day_join_no_days() -> None:
    days = [flight(f"{name}{day}", name.upper(), "A B", (day, day + 10)) for day in (0, 100) for name in "ab"]
    heard = {one.folder.name: (0, 9) for one in days}
    assert searched(*days, heard=heard)[0] == [["a0", "b0"], ["a100", "b100"]]
    assert searched(*days[:3], heard=heard)[0] == [["a0", "b0"]], "b has a partner of its own day"


def test_logs_that_follow_each_other_go_with_those_of_their_time() -> None:
    parts = [
        *(flight("a1", "A", "B", (0, 11)), flight("a2", "A", "B", (11, 20))),
        *(flight("b1", "B", "A", (0, 10)), flight("b2", "B", "A", (10, 20))),
    ]
    assert searched(*parts)[0] == [["a1", "b1"], ["a2", "b2"]]
    groups, apart = searched(flight("a", "A", "", (0, 20)), *parts[2:])
    assert groups == [["a", "b1"]]
    assert "are in one with another B flight" in apart["b2"]


def test_two_recorders_of_one_aircraft_both_stay() -> None:
    a, again, b = flight("a", "A", "B", (0, 10)), flight("a_", "A", "B", (0, 9)), flight("b", "B", "A", (0, 10))
    assert searched(a, again, b)[0] == [["a", "a_", "b"]]


def pairs_of_all(flights: Sequence[Member], span_of: Callable[[Member], Span | None]) -> list[tuple[Member, Member]]:
    """Every two flights that overlap and of which one heard the other's name: each is held beside each."""
    found = {}
    for one in flights:
        for other in sorted(flights, key=lambda one: one.aircraft):
            spans = span_of(one), span_of(other)
            if other.aircraft in one.hears - {one.aircraft} and None not in spans and _overlap_s(*spans) > 0:
                found.setdefault(frozenset((one.folder, other.folder)), (one, other))
    return list(found.values())


def _overlap_s(*spans: Span | None) -> int:
    return min(span[1] for span in spans if span) - max(span[0] for span in spans if span)


@pytest.mark.parametrize("seed", range(8))
def test_flights_in_the_order_of_their_times_are_found_as_by_asking_every_pair(seed: int) -> None:
    rng = random.Random(seed)

    def span() -> Span | None:
        begin = rng.randrange(60)
        return None if rng.random() < 0.1 else (begin, begin + rng.choice((0, 3, 3, 20)))

    flights = [
        flight(f"{number}", rng.choice("ABCD"), " ".join(rng.sample("ABCDN", rng.randrange(4))), span())
        for number in range(40)
    ]
    by_utc = session_search.overlapping(flights, lambda one: one.span_ns)
    assert by_utc == pairs_of_all(flights, lambda one: one.span_ns) and by_utc
    joined = {(one.folder, other.aircraft) for pair in by_utc[::3] for one, other in (pair, pair[::-1])}
    heard = {one.folder: span() for one in flights}
    expected = [
        (one, other)
        for one, other in pairs_of_all(flights, lambda one: heard[one.folder])
        if (one.folder, other.aircraft) not in joined and (other.folder, one.aircraft) not in joined
    ]
    assert session_search.overlapping(flights, lambda one: heard[one.folder], joined) == expected


def test_of_flights_that_follow_each_other_only_neighbours_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    flights = [flight(f"{name}{day}", name, "A B", (20 * day, 20 * day + 10)) for day in range(500) for name in "AB"]
    compared: list[int] = []
    overlap_ns = session_search.overlap_ns
    monkeypatch.setattr(session_search, "overlap_ns", lambda *spans: compared.append(1) or overlap_ns(*spans))
    groups, apart = sessions_among(flights, lambda folder: None)
    assert len(groups) == 500 and not apart
    assert len(compared) < 20 * len(flights)  # of 250 000 pairs


# ------------------------------------------------------------------------------------------------ through ``run``


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    write_session(SHORT, folder, "example", SEED)
    return folder


@pytest.fixture(scope="module")
def configuration(logs: Path) -> Configuration:
    return load_configuration(logs / "settings.toml")


@pytest.fixture(scope="module")
def out(logs: Path, configuration: Configuration, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run; those that change it copy it."""
    folder = tmp_path_factory.mktemp("out")
    outcomes = run_many([logs], folder, configuration, jobs=1, with_pdf=False)
    assert [(one.is_session, one.state) for one in outcomes if one.folder] == [(False, "done")] * 3 + [(True, "done")]
    return folder


def results_in(folder: Path) -> FlightResults:
    return load(folder, systems().answer_types).results


def rows_of(out: Path) -> list[dict[str, object]]:
    return list(json.loads((out / "index.json").read_text(encoding="utf-8"))["rows"])


def sessions_in(outcomes: Sequence[Outcome]) -> list[Outcome]:
    return [one for one in outcomes if one.is_session]


def test_a_folder_of_logs_gives_its_flights_and_their_session(out: Path, logs: Path) -> None:
    assert [folder.name for folder in flight_folders(out)] == [f"20180305T120000Z_{name}_example" for name in "ABC"]
    assert [folder.name for folder in session_folders(out)] == [IDENTITY]
    folder = out / IDENTITY
    manifest = load_manifest(folder)
    assert manifest.is_found
    assert sorted(log.mcap for log in manifest.logs) == [
        f"../{one.name}/{one.name}.mcap" for one in flight_folders(out)
    ]
    assert all((folder / log.mcap).is_file() for log in manifest.logs)
    assert not (folder / "mcap").exists()
    results = results_in(folder)
    answer = results.answer(CooperativeResult)
    assert answer is not None
    assert answer.point_names == ("N1", "N2"), "of stations.toml beside the logs"
    assert [finding.code for finding in results.findings if finding.code.startswith("session")] == ["session.stations"]


def test_a_session_stands_in_the_index_behind_the_flights(out: Path) -> None:
    rows = rows_of(out)
    assert [row["kind"] for row in rows] == ["flight"] * 3 + ["session"]
    row = rows[3]
    assert (row["flight_id"], row["aircraft"], row["status"]) == (IDENTITY, "A, B, C", "ok")
    assert row["report"] == f"{IDENTITY}/report.html"
    assert row["mcap"] is None
    assert row["error_deg"] is None


def test_a_second_run_does_nothing_and_the_lines_are_the_same(
    out: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    before = {path: path.stat().st_mtime_ns for path in (copy / IDENTITY).rglob("*") if path.is_file()}
    call = ["run", logs, "-o", copy, "--config", logs / "settings.toml", "-j", "1", "--no-pdf"]
    assert called(*call, "--json", "--progress", "json") == 0
    assert {path: path.stat().st_mtime_ns for path in (copy / IDENTITY).rglob("*") if path.is_file()} == before
    told = capsys.readouterr()
    (session,) = [entry for entry in json.loads(told.out) if entry.get("kind") == "session"]
    assert (session["state"], session["flight_id"], session["exit_code"]) == ("done", IDENTITY, 0)
    assert session["text"].startswith("3 aircraft, smoothed: 2 sigma_r")
    events = [json.loads(line) for line in told.err.splitlines() if line.startswith("{")]
    assert [event["total"] for event in events if event["event"] == "begin"] == [3, 4]
    assert events[-1]["event"] == "end" and events[-1]["text"] == session["text"]
    assert session["was_finished"] is True
    assert called(*call, "--dry-run") == 0
    (planned,) = [line for line in capsys.readouterr().out.splitlines() if "session" in line]
    assert planned.endswith(f"  {IDENTITY}  session finished, nothing to do")
    (copy / IDENTITY / "report.html").unlink()
    assert called(*call, "--dry-run") == 0 and "session to report again" in capsys.readouterr().out
    assert called("run", logs, "-o", tmp_path / "new", "--dry-run") == 0
    assert "sessions  looked for among the flights once the logs are read" in capsys.readouterr().out.splitlines()
    assert called(*call) == 0
    assert (copy / IDENTITY / "report.html").read_bytes() == (out / IDENTITY / "report.html").read_bytes()
    assert "; 1 session: 1 done" in capsys.readouterr().err


def called(*arguments: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


@pytest.mark.slow
def test_any_number_of_processes_gives_equal_bytes(
    out: Path, logs: Path, configuration: Configuration, tmp_path: Path
) -> None:
    run_many([logs], tmp_path, configuration, jobs=2, with_pdf=False)
    promised = ("*.json", "*.csv", "*.html", "tables/*.csv")
    for folder in (Path(), Path(IDENTITY)):
        names = {path.relative_to(out) for pattern in promised for path in (out / folder).glob(pattern)}
        for name in names - {Path(IDENTITY) / "manifest.json"}:
            assert (tmp_path / name).read_bytes() == (out / name).read_bytes(), name


@pytest.mark.slow
def test_a_run_elsewhere_gives_the_session_too(
    out: Path, logs: Path, configuration: Configuration, tmp_path: Path
) -> None:
    store = fsspec.filesystem("memory")
    store.store.clear()
    store.pseudo_dirs[:] = [""]
    few = tmp_path / "few"
    few.mkdir()
    for name in ("example-A.csv", "example-B.csv"):
        shutil.copy(logs / name, few)
    far, stations = RemoteFolder("memory://out"), logs / "stations.toml"

    def ran(folder: Path) -> list[Outcome]:
        return sessions_in(
            run_many([folder], far.url, configuration, jobs=1, with_pdf=False, stations=stations),
        )

    (session,) = ran(few)
    assert session.folder == session.flight_id == "20180305T120000Z_session_A-B"
    assert far.read(f"{session.flight_id}/report.html")
    (session,) = ran(logs)
    assert session.flight_id == IDENTITY
    assert "20180305T120000Z_session_A-B" not in far.names()
    summary = json.loads(far.read(f"{IDENTITY}/summary.json") or b"")
    assert summary["results"] == json.loads((out / IDENTITY / "summary.json").read_text())["results"]
    made = far.read(f"{IDENTITY}/manifest.json")
    assert ran(logs) == [replace(session, times_s={}, was_finished=True)], "nothing is done again"
    assert far.read(f"{IDENTITY}/manifest.json") == made
    page = far.read(f"{IDENTITY}/report.html")
    far.remove(f"{IDENTITY}/report.html")
    ran(logs)
    assert far.read(f"{IDENTITY}/report.html") == page
    index = json.loads(far.read("index.json") or b"")["rows"]
    assert [row["flight_id"] for row in index if row["kind"] == "session"] == [IDENTITY]


@pytest.mark.slow
def test_the_session_grows_with_its_flights_and_one_of_the_verb_stays(
    logs: Path, configuration: Configuration, tmp_path: Path
) -> None:
    one, other, third = sorted(logs.glob("*.csv"))
    out, stations = tmp_path / "out", logs / "stations.toml"
    found = sessions_in(run_many([one, other], out, configuration, jobs=1, with_pdf=False))
    assert [session.flight_id for session in found] == ["20180305T120000Z_session_A-B"]
    assert called("cooperative", one, third, "--stations", stations, "-o", out, "--no-pdf", "-q") == 0
    by_hand = out / "20180305T120000Z_session_A-C"
    before = (by_hand / "manifest.json").read_bytes()
    found = sessions_in(run_many([third], out, configuration, jobs=1, with_pdf=False))
    assert [session.flight_id for session in found] == [IDENTITY]
    assert [folder.name for folder in session_folders(out)] == [IDENTITY, by_hand.name]
    assert (by_hand / "manifest.json").read_bytes() == before


@pytest.mark.slow
def test_a_run_leaves_what_the_verb_made_of_the_same_logs(out: Path, logs: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    assert called("cooperative", *flight_folders(copy), "-o", copy, "--no-pdf", "-q") == 0
    manifest = (copy / IDENTITY / "manifest.json").read_bytes()
    assert not load_manifest(copy / IDENTITY).is_found
    (session,) = sessions_in(run_many([logs], copy, Configuration(), jobs=1, with_pdf=False))
    assert (session.state, session.flight_id) == ("done", IDENTITY)
    assert (copy / IDENTITY / "manifest.json").read_bytes() == manifest
    codes = {finding.code for finding in load_document(copy / IDENTITY).findings}
    assert codes >= {"session.assumed_sigmas", "session.no_stations", "session.unknown_source"}


@pytest.mark.slow
def test_stations_files_that_cannot_be_used(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "logs"
    shutil.copytree(logs, folder)
    (folder / "stations.toml").write_text("[[stations]]\nname = 'N1'\n")
    outcomes = run_many([folder], tmp_path / "out", Configuration(), jobs=1, with_pdf=False)
    (session,) = sessions_in(outcomes)
    findings = {finding.code: finding for finding in results_in(Path(session.folder)).findings}
    assert findings["session.stations"].severity == "warn"
    assert "cannot be used" in findings["session.stations"].text
    call = ("run", logs, "-o", tmp_path / "other", "--stations", folder / "stations.toml")
    assert called(*call) == 2
    assert "latitude_deg" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


# ------------------------------------------------------------------------------------------------ bad input


Rows = list[list[str]]


def edited(path: Path, change: Callable[[list[str], Rows], None]) -> None:
    """Change the cells of a log: its heads and its rows, in place."""
    lines = path.read_text(encoding="utf-8").splitlines()
    first = next(number for number, line in enumerate(lines) if not line.startswith("#"))
    heads, rows = lines[first].split(","), [line.split(",") for line in lines[first + 1 :]]
    change(heads, rows)
    path.write_text("\n".join([*lines[:first], ",".join(heads), *map(",".join, rows)]) + "\n", encoding="utf-8")


@pytest.fixture
def copied(logs: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "logs"
    shutil.copytree(logs, folder)
    return folder


def findings_of(folder: Path, configuration: Configuration, out: Path) -> dict[str, str]:
    """Run a folder; the findings of its one session, text by code."""
    outcomes = run_many([folder], out, configuration, jobs=1, with_pdf=False)
    (session,) = sessions_in(outcomes)
    assert session.state == "done", session.text
    found = results_in(Path(session.folder))
    assert found.answer(CooperativeResult) is not None
    return {finding.code: f"{finding.severity}: {finding.text}" for finding in found.findings}


@pytest.mark.slow
def test_bad_ranges_and_a_station_in_the_wrong_place(
    copied: Path, configuration: Configuration, tmp_path: Path
) -> None:
    def spoil(heads: list[str], rows: Rows) -> None:
        place = heads.index("link.B.pseudorange_m")
        heard = [row for row in rows if row[place]]
        heard[0][place], heard[1][place] = "nan", "-1e6"

    def rename(heads: list[str], _rows: Rows) -> None:
        heads[:] = [head.replace("link.A.", "link.Z.") for head in heads]

    edited(copied / "example-A.csv", spoil)
    edited(copied / "example-B.csv", rename)
    stations = copied / "stations.toml"
    text = stations.read_text()
    latitude = text.split("latitude_deg = ")[1].split()[0]
    stations.write_text(text.replace(latitude, str(float(latitude) + FAR_DEG), 1))
    found = findings_of(copied, configuration, tmp_path / "out")
    assert found["session.not_a_number"] == "warn: left out 1 ranges that are no numbers"
    assert found["session.negative_range"] == "warn: left out 1 negative ranges that no clock explains"
    assert "ranges to Z: no log and no station of that name" in found["session.unknown_source"]
    assert "to station N1: it is not where the ranges put it" in found["session.station_far"]


@pytest.mark.slow
def test_a_clock_a_week_off(copied: Path, configuration: Configuration, tmp_path: Path) -> None:
    log = copied / "example-C.csv"
    log.write_text(log.read_text().replace("2018-03-05T12:00:00.000Z", "2018-03-12T12:00:00.000Z"))
    found = findings_of(copied, configuration, tmp_path / "out")
    assert found["session.clock_offset"].startswith(f"warn: clock of C +{WEEK_S}.000 s from that of the group; taken")
    assert (tmp_path / "out" / IDENTITY).is_dir()


@pytest.mark.slow
def test_a_clock_that_leaps_and_an_aircraft_that_is_there_twice(
    copied: Path, configuration: Configuration, tmp_path: Path
) -> None:
    def leap(_heads: list[str], rows: Rows) -> None:
        for row in rows[len(rows) // 2 :]:
            row[0] = f"{float(row[0]) + LEAP_S:.9f}"

    shorter = (copied / "example-C.csv").read_text().splitlines()[:-20]
    (copied / "second-C.csv").write_text("\n".join(shorter) + "\n")
    edited(copied / "example-B.csv", leap)
    found = findings_of(copied, configuration, tmp_path / "out")
    assert found["session.clock_leap"].startswith("warn: clock of B leaps 1 times against the link")
    assert found["session.same_aircraft"] == "warn: 2 logs of C: example-C.csv is used, second-C.csv left out"


def test_logs_that_do_not_overlap_and_a_peer_without_a_log(
    copied: Path, configuration: Configuration, tmp_path: Path
) -> None:
    def begin(_heads: list[str], rows: Rows) -> None:
        rows[:] = [row for row in rows if float(row[0]) < 6.0]

    def end(_heads: list[str], rows: Rows) -> None:
        rows[:] = [row for row in rows if float(row[0]) > 14.0]

    (copied / "example-C.csv").unlink()
    edited(copied / "example-A.csv", begin)
    edited(copied / "example-B.csv", end)
    outcomes = run_many([copied], tmp_path / "out", configuration, jobs=1, with_pdf=False)
    told = sessions_in(outcomes)
    assert [one.state for one in told] == ["skipped", "skipped"]
    assert all("in no session: none of their flights overlaps, " in one.text for one in told)
    assert [row["kind"] for row in rows_of(tmp_path / "out")] == ["flight"] * 2
    assert session_folders(tmp_path / "out") == []


def test_links_without_dead_reckoning_are_no_session_and_no_error(
    copied: Path, configuration: Configuration, tmp_path: Path
) -> None:
    for path in copied.glob("*.csv"):
        edited(
            path, lambda heads, _rows: heads.__setitem__(slice(None), [head.replace("ins.", "raw_") for head in heads])
        )
    outcomes = run_many([copied], tmp_path / "out", configuration, jobs=1, with_pdf=False)
    (session,) = sessions_in(outcomes)
    assert session.state == "skipped"
    assert "no aircraft with dead reckoning" in session.text
    assert not session_folders(tmp_path / "out")


def test_a_warning_of_the_session_reaches_the_exit_code(logs: Path, tmp_path: Path) -> None:
    call = ("run", *sorted(logs.glob("*.csv"))[:2], "-o", tmp_path / "out", "-q", "--no-pdf", "-j", "1")
    assert called(*call, "--fail-on", "fail") == 0
    assert called(*call, "--fail-on", "warn") == 4, "ranges to C: no log"


def test_a_session_shows_the_layout_that_was_saved_from_one(logs: Path, tmp_path: Path) -> None:
    page = rrb.Vertical(contents=[rrb.TextDocumentView(origin="/cooperative/answer")], name="Mine")
    rrb.Blueprint(rrb.Tabs(page), auto_views=False).save("groundstation another", str(tmp_path / "mine.rbl"))
    call = ("run", *sorted(logs.glob("*.csv"))[:2], "-o", tmp_path / "out", "-q", "-j", "1")
    assert called(*call, "--layout", tmp_path / "mine.rbl") == 0
    (session,) = session_folders(tmp_path / "out")
    tabs = {path.parent.name: [tab.name for tab in layout_of(path)] for path in (tmp_path / "out").glob("*/*.rrd")}
    assert tabs.pop(session.name) == ["Mine"] and len(tabs) == 2
    assert all("Overview" in found for found in tabs.values()), "flights keep their own"


# ------------------------------------------------------------------------------------------------ the fleet


def test_the_fleet_lists_the_session_with_its_report(out: Path) -> None:
    from groundstation.pipeline.many_flights.fleet.statistics import gather
    from groundstation.viewer.fleet_recorder import FleetRecorder
    from groundstation.viewer.fleet_text import flights_text
    from groundstation.viewer.recording import open_stream

    fleet = gather(out)
    answer = results_in(out / IDENTITY).answer(CooperativeResult)
    assert answer is not None
    (row,) = fleet.sessions
    smoothed, reckoned = (
        next(one for one in answer.algorithms if one.algorithm == name) for name in ("smoothed", "dead_reckoning")
    )
    assert (row.session_id, row.aircraft, row.algorithm) == (IDENTITY, "A, B, C", "smoothed")
    assert (row.two_sigma_r_m, row.rms_m) == (smoothed.two_sigma_r_m, smoothed.rms_m)
    assert row.reckoned_two_sigma_r_m == reckoned.two_sigma_r_m
    assert len(fleet) == 3
    page = (out / "summary.html").read_text(encoding="utf-8")
    assert '<section id="sessions"' in page
    assert f'href="{IDENTITY}/report.html"' in page
    with open_stream("fleet") as stream:
        text = flights_text(FleetRecorder(stream, fleet, systems()), fleet)
    assert f"({IDENTITY}/{IDENTITY}.rrd)" in text
    assert fleet.to_frame("sessions")["session_id"].tolist() == [IDENTITY]


def test_a_session_that_cannot_be_read_is_told(out: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    (copy / IDENTITY / "summary.json").write_text("{")
    assert called("report", copy, "--no-pdf") == 1
    assert [row["source"] for row in rows_of(copy) if row["kind"] == "failed"] == [str(copy / IDENTITY)]
    assert 'id="sessions"' not in (copy / "summary.html").read_text(encoding="utf-8")
