"""The main job from end to end: logs in, folders of results out."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.inputs import flight_folders
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration, WrittenInterval
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.outcome import Outcome, worst_code
from groundstation.pipeline.verbs.conversions import convert_many
from tests.real_logs import real_log
from tests.saved import load

SAMPLES = Path(__file__).parents[1] / "sample_logs"
SEEDS = [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))]
BYTE_IDENTICAL = ("summary.json", "report.html", "tables")


@pytest.fixture(scope="module")
def good(finished_run: Callable[..., Outcome]) -> Outcome:
    """The accepted sample log: shared, to be copied."""
    return finished_run("taxi-good")


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a flight that are promised byte for byte."""
    files = [folder / name for name in BYTE_IDENTICAL]
    listed = [path for path in files if path.is_file()] + sorted((folder / "tables").iterdir())
    return {str(path.relative_to(folder)): path.read_bytes() for path in listed}


def test_the_good_sample_is_accepted_with_all_its_files(good: Outcome) -> None:
    folder = Path(good.folder)
    assert good.state == "done" and good.code == 0
    names = {path.name for path in folder.iterdir()}
    identity = good.flight_id
    assert names == {
        *("summary.json", "manifest.json", "report.html", "arrays", "tables"),
        *(f"{identity}.mcap", f"{identity}.rrd"),
    }
    summary = load(folder).summary
    assert summary["results"]["heading"]["verdict"] == "accept"
    assert summary["status"] == "ok"
    assert summary["flight"]["id"] == identity


def test_the_index_lists_the_flight(good: Outcome) -> None:
    index = json.loads((Path(good.folder).parent / "index.json").read_text(encoding="utf-8"))
    (row,) = index["rows"]
    assert row["flight_id"] == good.flight_id and row["verdict"] == "accept"
    assert (Path(good.folder).parent / row["report"]).is_file()


def test_the_mcap_gives_what_the_log_gave(good: Outcome, tmp_path: Path) -> None:
    mcap = Path(good.folder) / f"{good.flight_id}.mcap"
    (again,) = run_many([mcap], tmp_path / "out", Configuration(), only_results=True)
    assert again.flight_id == good.flight_id
    first, second = (load(Path(outcome.folder)).summary for outcome in (good, again))
    for key in ("results", "ledger", "clock", "completeness", "findings", "status"):
        assert second[key] == first[key], key


def test_a_second_run_is_byte_identical(finished_run: Callable[..., Outcome], tmp_path: Path) -> None:
    first = finished_run("taxi-short")
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    command = [
        sys.executable,
        "-m",
        "groundstation",
        "run",
        str(SAMPLES / "taxi-short.csv"),
        "-o",
        str(tmp_path / "out"),
    ]
    subprocess.run(command, check=True, capture_output=True, env=environment)
    assert contents(tmp_path / "out" / first.flight_id) == contents(Path(first.folder))


def test_the_report_is_made_again_from_the_saved_results_alone(good: Outcome, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(Path(good.folder).parent, tmp_path / "out")) / good.flight_id
    before = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    assert folder / "report.html" in report_again(folder.parent)[0]
    assert (folder / "report.html").read_bytes() == before


def test_excluding_an_interval_changes_the_answer_and_is_kept(good: Outcome, tmp_path: Path) -> None:
    segment = load(Path(good.folder)).summary["results"]["heading"]["segments"][0]
    excluded = WrittenInterval(str(segment["start_s"]), str(segment["end_s"]), "for the test")
    job = Job(SAMPLES / "taxi-good.csv", tmp_path, Configuration(exclude=(excluded,)), only_results=True)
    outcome = run_flight(job)
    heading = load(Path(outcome.folder)).summary["results"]["heading"]
    before = load(Path(good.folder)).summary["results"]["heading"]
    assert heading["samples"] < before["samples"]
    assert json.loads((Path(outcome.folder) / "manifest.json").read_text(encoding="utf-8"))["configuration"]["exclude"]


def test_a_folder_with_all_samples_gives_each_its_truth(tmp_path: Path) -> None:
    outcomes = run_many([SAMPLES], tmp_path / "out", Configuration(), jobs=1, only_results=True)
    by_name = {Path(outcome.source).stem: outcome for outcome in outcomes}
    verdict = {
        name: load(Path(outcome.folder)).summary["results"].get("heading", {}).get("verdict")
        for name, outcome in by_name.items()
        if outcome.flight_id
    }
    assert verdict["taxi-good"] == "accept"
    assert verdict["taxi-drift"] == "reject"
    assert verdict["taxi-short"] == "advisory"
    assert verdict["taxi-notime"] == "undecided"
    assert by_name["taxi-notime"].flight_id.startswith("NOTIME_")
    assert by_name["taxi-damaged"].state == "data_lost"
    assert worst_code(outcomes) == 3
    assert not list((tmp_path / "out").glob(".partial*"))


def test_two_logs_of_one_flight_get_their_digests_and_twins_are_told(tmp_path: Path) -> None:
    text = "# start_utc: 2026-05-04T06:00:00Z\ntime_s,baro.pressure_altitude_m\n"
    rows = "".join(f"{second},100.0\n" for second in range(30))
    for name, content in (("a", text + rows), ("b", text + rows + "30,101.0\n"), ("c", text + rows)):
        (tmp_path / f"{name}.csv").write_text(content, encoding="utf-8")
    logs = [tmp_path / f"{name}.csv" for name in "abc"]
    outcomes = run_many(logs, tmp_path / "out", Configuration(), jobs=1, with_pdf=False)
    assert [outcome.state for outcome in outcomes] == ["done", "done", "skipped"]
    assert [outcome.flight_id for outcome in outcomes[:2]] == [
        f"20260504T060000Z_{outcome.sha256[:8]}" for outcome in outcomes[:2]
    ]
    assert "same content as" in outcomes[2].text


def test_a_bad_log_never_stops_the_others(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_bytes(b"time_s,ins.true_heading_deg\n")
    (tmp_path / "odd.csv").write_bytes(b"\xff\xfe\x00")
    good = tmp_path / "good.csv"
    good.write_text("time_s,ins.true_heading_deg\n0,1\n1,2\n", encoding="utf-8")
    logs = [tmp_path / "bad.csv", tmp_path / "odd.csv", good]
    outcomes = run_many(logs, tmp_path / "out", Configuration(), jobs=1, with_pdf=False)
    assert {Path(outcome.source).name: outcome.code for outcome in outcomes} == {
        "bad.csv": 1,
        "odd.csv": 1,
        "good.csv": 0,
    }
    assert all("\n" not in outcome.text and "internal error" not in outcome.text for outcome in outcomes)


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A log cut somewhere or with some bytes changed."""
    if rng.random() < 0.3:
        return data[: int(rng.integers(0, len(data)))]
    changed = bytearray(data)
    for place in rng.integers(0, len(data), int(rng.integers(1, 40))):
        changed[place] = int(rng.integers(0, 256))
    return bytes(changed)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damaged_log_ends_in_one_line_or_in_results(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = tmp_path / "log.csv"
    log.write_bytes(mutated((SAMPLES / "taxi-short.csv").read_bytes(), rng))
    outcome = run_flight(Job(log, tmp_path / "out", Configuration(), with_pdf=False))
    assert outcome.code in (0, 1, 3)
    assert "internal error" not in outcome.text and "\n" not in outcome.text


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damaged_mcap_ends_in_one_line_or_in_results(good: Outcome, tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    path = tmp_path / "flight.mcap"
    path.write_bytes(mutated((Path(good.folder) / f"{good.flight_id}.mcap").read_bytes(), rng))
    outcome = run_flight(Job(path, tmp_path / "out", Configuration(), with_pdf=False))
    assert outcome.code in (1, 3) or outcome.state == "done"
    assert "internal error" not in outcome.text and "\n" not in outcome.text


def test_convert_writes_one_file_or_a_folder(tmp_path: Path) -> None:
    one = convert_many([SAMPLES / "taxi-good.csv"], tmp_path / "one.mcap")
    several = convert_many([SAMPLES / "taxi-good.csv", SAMPLES / "taxi-short.csv"], tmp_path / "many")
    assert [outcome.state for outcome in (*one, *several)] == ["done"] * 3
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "many/taxi-good.mcap").read_bytes()


@pytest.mark.real_log
@pytest.mark.parametrize(
    "name",
    ["g1000/log_220416_161856_LFQA.csv", "g1000/log_220502_135932_EGPN.csv"],
)
def test_a_taxi_that_never_reaches_the_speed_gate_is_not_assessable(tmp_path: Path, name: str) -> None:
    outcome = run_flight(Job(real_log(name), tmp_path, Configuration(), only_results=True))
    entries = load(Path(outcome.folder)).summary["not_assessable"]
    reasons = {entry["analysis"]: entry["reason"] for entry in entries}
    assert "6" in reasons["heading"] and "m/s" in reasons["heading"]


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["g1000/log_210623_141501_TEST1.csv", "g1000/log_220417_125002_LFQA.csv"])
def test_straight_taxi_after_the_flight_alone_is_not_assessable(tmp_path: Path, name: str) -> None:
    """23 s and 3 s after landing, none before take-off: no red reject over a good flight."""
    outcome = run_flight(Job(real_log(name), tmp_path, Configuration(), only_results=True))
    summary = load(Path(outcome.folder)).summary
    reasons = {entry["analysis"]: entry["reason"] for entry in summary["not_assessable"]}
    assert "heading" not in summary["results"]
    assert "no straight taxi before take-off" in reasons["heading"] and "after the flight" in reasons["heading"]
    settings = Configuration({"heading": {"runs": "all_ground"}})
    again = run_flight(Job(real_log(name), tmp_path / "all", settings, only_results=True))
    found = load(Path(again.folder)).summary
    if "TEST1" in name:
        assert found["results"]["heading"]["verdict"] == "reject"
        assert found["results"]["heading"]["precision_deg"] > 0.05
    else:
        assert "heading" not in found["results"], "3 s are too few however they are asked for"


@pytest.mark.slow
def test_copies_of_one_log_are_kept_once_however_many_run_at_a_time(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log = "time_s,baro.pressure_altitude_m\n" + "".join(f"{second},100.0\n" for second in range(30))
    for name in ("b", "a", "c"):
        (tmp_path / f"logs/{name}.csv").write_text(log, encoding="utf-8")
    outcomes = run_many([tmp_path / "logs"], tmp_path / "out", Configuration(), jobs=2, only_results=True)
    assert [outcome.state for outcome in outcomes] == ["done", "skipped", "skipped"]
    (folder,) = flight_folders(tmp_path / "out")
    assert {path.suffix for path in folder.iterdir()} >= {".mcap", ".json"}
    assert load(folder).summary["flight"]["source"]["name"] == "a.csv"


def test_a_log_and_its_mcap_are_one_flight(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log = tmp_path / "logs/x.csv"
    log.write_bytes((SAMPLES / "taxi-notime.csv").read_bytes())
    convert_many([log], tmp_path / "logs/x.mcap")
    outcomes = run_many([tmp_path / "logs"], tmp_path / "out", Configuration(), jobs=1, only_results=True)
    assert [outcome.state for outcome in outcomes] == ["done", "skipped"]
    assert outcomes[0].flight_id == f"NOTIME_{outcomes[0].sha256[:8]}"


def test_damage_of_an_mcap_is_kept_with_it(good: Outcome, tmp_path: Path) -> None:
    whole = Path(good.folder) / f"{good.flight_id}.mcap"
    data = bytearray(whole.read_bytes())
    with whole.open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes  # type: ignore[union-attr]
    by_channel = Counter(tuple(chunk.message_index_offsets) for chunk in chunks)
    of_channel = [one for one in chunks if tuple(one.message_index_offsets) == by_channel.most_common(1)[0][0]]
    chunk = of_channel[len(of_channel) // 2]  # neither the first of its topic nor the last
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 1
    (tmp_path / "flipped.mcap").write_bytes(data)
    (first,) = convert_many([tmp_path / "flipped.mcap"], tmp_path / "again.mcap")
    outcome = run_flight(Job(tmp_path / "again.mcap", tmp_path / "out", Configuration(), only_results=True))
    assert (first.state, outcome.state) == ("data_lost", "data_lost")
    summary, before = load(Path(outcome.folder)).summary, load(Path(good.folder)).summary
    assert summary["status"] == "degraded" and summary["ledger"]["damages"]
    rows = {topic: entry["rows"] for topic, entry in summary["ledger"]["topics"].items()}
    rows_before = {topic: entry["rows"] for topic, entry in before["ledger"]["topics"].items()}
    assert sum(rows.values()) < sum(rows_before.values())
    assert min(summary["completeness"].values()) < 1.0


@pytest.mark.slow
def test_a_killed_run_keeps_what_was_finished_and_can_go_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "groundstation",
        "run",
        str(SAMPLES),
        "-o",
        str(out),
        "-j",
        "1",
        "--only",
        "results",
    ]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not list(out.glob("2*/manifest.json")):
            assert process.poll() is None, "the run ended before it could be killed"
            time.sleep(0.02)
        process.kill()
    (outcome, *_) = run_many([SAMPLES / "taxi-short.csv"], out, Configuration(), only_results=True)
    assert outcome.state == "done"
    assert not list(out.glob(".partial*"))
    index = json.loads((out / "index.json").read_text(encoding="utf-8"))
    assert len(index["rows"]) >= 2


def test_a_broken_flight_folder_is_told_and_stops_nothing(good: Outcome, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(Path(good.folder), out / good.flight_id)
    (out / good.flight_id / "arrays/overview.parquet").write_bytes(b"PAR1")
    (out / "index.json").write_text('{"rows": []}', encoding="utf-8")
    (out / "index.csv").write_text("", encoding="utf-8")
    outcomes = run_many([SAMPLES / "taxi-short.csv"], out, Configuration(), with_pdf=False)
    assert [outcome.state for outcome in outcomes] == ["done", "failed"]
    written, problems, _removed = report_again(out)
    assert len(problems) == 1 and "overview.parquet" in problems[0].text
    assert any(path.name == "report.html" for path in written)


def test_reports_again_make_the_index_again(good: Outcome, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(Path(good.folder), out / good.flight_id)
    report_again(out)
    assert good.flight_id in (out / "index.csv").read_text(encoding="utf-8")


def test_a_rerun_leaves_notes_of_the_crew_alone(finished_run: Callable[..., Outcome], tmp_path: Path) -> None:
    outcome = finished_run("taxi-short")
    out = Path(shutil.copytree(Path(outcome.folder).parent, tmp_path / "out"))
    notes = out / outcome.flight_id / "notes.txt"
    notes.write_text("mine", encoding="utf-8")
    for redo in (False, True):
        run_many([SAMPLES / "taxi-short.csv"], out, Configuration(), with_pdf=False, redo=redo)
        assert notes.read_text(encoding="utf-8") == "mine"


def test_what_is_no_regular_file_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    outcome = run_flight(Job(tmp_path / "pipe", tmp_path / "out", Configuration()))
    assert outcome.code == 1 and "no regular file" in outcome.text


def test_utc_intervals_of_a_flight_without_utc_are_a_finding(tmp_path: Path) -> None:
    interval = WrittenInterval("2026-05-04T06:00:00Z", "2026-05-04T06:01:00Z")
    outcome = run_flight(
        Job(SAMPLES / "taxi-notime.csv", tmp_path, Configuration(exclude=(interval,)), only_results=True)
    )
    summary = load(Path(outcome.folder)).summary
    assert outcome.code == 0 and "UTC" in summary["not_assessable"][0]["reason"]
