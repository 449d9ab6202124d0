"""The smaller verbs: info, convert, simulate, study, list, report; what they print and write."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.base.version import __version__
from groundstation.cli.main import app
from groundstation.pipeline.verbs import synthesis
from groundstation.pipeline.verbs.provenance import commit_of, this_machine, version_told
from groundstation.pipeline.verbs.synthesis import EVIDENCE
from groundstation.simulation.scenario import scenario_names
from groundstation.systems import systems
from groundstation.systems.study import StudyResult, section
from groundstation.systems.system import Study, System, Systems

SAMPLES = Path(__file__).parents[1] / "sample_logs"


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


def test_info_tells_topics_rates_and_findings(tmp_path: Path) -> None:
    code, text, err = groundstation("info", str(SAMPLES / "taxi-good.csv"))
    assert (code, err) == (0, "")
    assert "flat-csv" in text and "gnss" in text and "2026-05-04T06:00:00" in text
    code, text, _ = groundstation("info", str(SAMPLES / "taxi-good.csv"), "--json")
    described = json.loads(text)
    rows = {topic["name"]: topic["rows"] for topic in described["topics"]}
    assert code == 0 and rows["gnss"] == rows["ins"] > 1000


def test_info_of_a_damaged_log_is_exit_3() -> None:
    code, text, _ = groundstation("info", str(SAMPLES / "taxi-damaged.csv"))
    assert code == 3 and "stepped back" in text


def test_info_of_the_mcap_tells_what_the_log_told(tmp_path: Path) -> None:
    mcap = tmp_path / "x.mcap"
    assert groundstation("convert", str(SAMPLES / "taxi-good.csv"), "-o", str(mcap))[0] == 0
    first, second = (
        json.loads(groundstation("info", str(path), "--json")[1]) for path in (SAMPLES / "taxi-good.csv", mcap)
    )
    strip = [{key: topic[key] for key in ("name", "rows", "rate_hz", "span_s")} for topic in first["topics"]]
    assert [{key: topic[key] for key in strip[0]} for topic in second["topics"]] == strip


def test_a_foreign_mcap_is_listed_by_info_and_run_finds_nothing_to_assess(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "foreign.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "somebody")
        schema = writer.register_schema("Thing", "jsonschema", b"{}")
        channel = writer.register_channel("/thing", "json", schema)
        writer.add_message(channel, 10**18, b"{}", 10**18)
        writer.finish()
    code, text, _ = groundstation("info", str(path))
    assert code == 0 and "raw.thing" in text and "Thing" in text
    code, text, _ = groundstation("run", str(path), "-o", str(tmp_path / "out"), "--no-pdf")
    assert code == 0 and "20010909T014640Z" in text


def test_convert_does_not_overwrite_without_force(tmp_path: Path) -> None:
    target = tmp_path / "x.mcap"
    target.write_text("mine", encoding="utf-8")
    arguments = ["convert", str(SAMPLES / "taxi-good.csv"), "-o", str(target)]
    code, _, err = groundstation(*arguments)
    assert code == 2 and "-f" in err and target.read_text(encoding="utf-8") == "mine"
    assert groundstation(*arguments, "-f")[0] == 0


def test_simulate_writes_what_run_accepts(tmp_path: Path) -> None:
    code, out, _ = groundstation("simulate", "taxi-short", "-o", str(tmp_path), "--seed", "3")
    assert code == 0
    log = Path(out.strip())
    assert log.is_file()
    assert groundstation("simulate", "taxi-short", "-o", str(tmp_path))[0] == 2
    assert groundstation("info", str(log))[0] == 0
    code, _, err = groundstation("simulate", "no-such", "-o", str(tmp_path))
    assert code == 2 and "taxi-good" in err


def test_list_names_analyses_formats_and_scenarios() -> None:
    code, text, _ = groundstation("list")
    assert code == 0
    assert all(name in text for name in ("heading", "flat-csv", *scenario_names()))


def test_list_of_a_log_says_whether_it_would_run_and_why_not(tmp_path: Path) -> None:
    assert "would run" in groundstation("list", str(SAMPLES / "taxi-good.csv"))[1]
    log = tmp_path / "still.csv"
    log.write_text("time_s,ins.true_heading_deg\n0,1\n1,1\n2,1\n", encoding="utf-8")
    code, text, _ = groundstation("list", str(log), "--json")
    answers = {entry["name"]: entry for entry in json.loads(text)}
    assert code == 0 and set(answers) == {
        "heading",
        "inertial",
        "ins_causes",
        "forecast",
        "latency",
        "magnetic",
        "magnetic_ground",
        "landing",
        "landing_beacons",
        "reference",
    }
    assert not any(entry["would_run"] for entry in answers.values())
    assert "GNSS" in answers["heading"]["reason"] and "INS position" in answers["inertial"]["reason"]


def test_every_study_that_is_listed_can_be_called(tmp_path: Path) -> None:
    for name in (one.name for one in systems().studies):
        (tmp_path / f"{name}.md").touch()  # a page that is there stops the study before its first run
        code, _, told = groundstation("study", name, "-o", str(tmp_path))
        assert (code, "a file that exists" in told) == (2, True)


def test_a_study_that_reads_files_has_them_and_no_other_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def study(*, runs: int, seed: int, progress: Callable[[str], None], inputs: Path) -> StudyResult:
        return StudyResult("read", (), (section(f"{inputs.name} read"),))

    reading = System("reading", studies=(Study("read", "what is read", lambda: study, reads="a folder of logs"),))
    monkeypatch.setattr(synthesis, "systems", lambda: Systems((*systems().every, reading)))
    out = ("-o", str(tmp_path / "out"))
    assert groundstation("study", "read", "--input", str(tmp_path / "logs"), *out)[:2] == (0, "# logs read\n\n")
    title, line = (tmp_path / "out" / EVIDENCE).read_text(encoding="utf-8").strip().split("\n\n")
    assert title == "# logs read" and "\n" not in line
    command = f"groundstation study read --runs 200 --seed 71 --input {tmp_path / 'logs'} -o DIR"
    assert line.startswith(f"Made by `{command}`; {version_told()}; 20")
    assert line.endswith(f" UTC; {this_machine()}.")
    code, _, told = groundstation("study", "read", "-o", str(tmp_path / "other"))
    assert code == 2 and "read without --input, expected a folder of logs" in told
    code, _, told = groundstation("study", "heading", "--input", str(tmp_path), "-o", str(tmp_path / "other"))
    assert code == 2 and "--input with heading, which reads no files, expected read" in told


def test_version_told_names_the_commit_of_a_checkout_alone(tmp_path: Path) -> None:
    assert commit_of(tmp_path) == "" and version_told(tmp_path) == f"groundstation {__version__}"
    (tmp_path / ".git").mkdir()  # nothing in it: git refuses
    assert commit_of(tmp_path) == ""


@pytest.mark.slow
def test_study_writes_page_and_tables(tmp_path: Path) -> None:
    code, text, _ = groundstation("study", "heading", "-o", str(tmp_path), "--runs", "10")
    assert code == 0
    assert text.strip() == (tmp_path / "heading.md").read_text(encoding="utf-8").strip()
    assert (tmp_path / "tables/heading_published.csv").is_file()
    kept = (tmp_path / "runs/heading-wide-73.jsonl").stat().st_mtime_ns
    assert groundstation("study", "heading", "-o", str(tmp_path), "--runs", "10")[:2] == (0, text), "none made again"
    assert (tmp_path / "runs/heading-wide-73.jsonl").stat().st_mtime_ns == kept
    assert groundstation("study", "magnetic", "-o", str(tmp_path), "--minutes", "1")[0] == 2


def test_progress_as_json_lines_goes_to_stderr(tmp_path: Path) -> None:
    arguments = ["run", str(SAMPLES / "taxi-short.csv"), "-o", str(tmp_path / "out"), "--no-pdf", "--progress", "json"]
    code, _, err = groundstation(*arguments)
    events = [json.loads(line) for line in err.splitlines()]
    assert code == 0 and [events[0]["event"], events[-1]["event"]] == ["begin", "end"]


def test_fail_on_reaches_exit_4(tmp_path: Path) -> None:
    arguments = ["run", str(SAMPLES / "taxi-drift.csv"), "-o", str(tmp_path / "out"), "--no-pdf"]
    assert groundstation(*arguments)[0] == 0
    assert groundstation(*arguments, "--fail-on", "warn")[0] == 4


@pytest.mark.slow
def test_a_report_that_cannot_be_written_stops_no_other(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert groundstation("run", str(SAMPLES / "taxi-short.csv"), "-o", str(out), "--no-pdf")[0] == 0
    (flight,) = (path.parent for path in out.glob("*/summary.json"))
    first = shutil.copytree(flight, out / "0")
    (first / "report.html").unlink()
    (first / "report.html").mkdir()
    (flight / "report.html").unlink()
    code, text, err = groundstation("report", str(out), "--no-pdf")
    assert code == 1 and err == f"error: {first / 'report.html'}: Is a directory\n"
    assert str(flight / "report.html") in text and (flight / "report.html").is_file()


def test_results_go_to_stdout_and_nothing_else_does(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("taxi-short.csv", "taxi-damaged.csv", "README.md"):
        shutil.copy(SAMPLES / name, logs)
    arguments = ["run", str(logs), "-o", str(tmp_path / "out"), "--json", "-j", "1", "--no-pdf"]
    code, out, err = groundstation(*arguments)
    assert code == 3
    assert {entry["state"] for entry in json.loads(out)} == {"done", "data_lost", "skipped"}
    assert "Traceback" not in err


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX pipes")
def test_a_closed_pipe_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -m groundstation list | head -n 1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, env=dict(os.environ)
    )
    assert done.stderr == "" and done.stdout.startswith("analyses")
