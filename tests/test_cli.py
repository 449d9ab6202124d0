"""The command line: what it imports, what it prints where, and its exit codes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from groundstation.base import compile as compiling
from groundstation.cli.application import EXAMPLES, VERBS, examples
from groundstation.cli.main import app
from tests.readers.dataflash_writer import flight_log
from tests.readers.receiver_writer import nmea

HEAVY = (
    "cattrs",
    *("numpy", "pandas", "pyarrow", "numba", "scipy", "rerun", "matplotlib", "mcap", "google.protobuf"),
    *("jinja2", "typst"),
    *("groundstation.pipeline.many_flights.runs.batch", "groundstation.readers", "groundstation.viewer"),
)


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys\n"
        "from groundstation.cli.main import main\n"
        f"try: main({arguments!r})\n"
        "except SystemExit as stop: assert not stop.code\n"
        f"print('HEAVY', [name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "HEAVY []"


def test_every_verb_has_help() -> None:
    _, text, _ = groundstation("--help")
    assert re.findall(r"^\W (\w+)  ", text[text.index("Commands") :], re.MULTILINE) == list(VERBS)
    for verb in VERBS:
        code, verb_text, _ = groundstation(verb, "--help")
        assert code == 0 and "Usage" in verb_text


def test_a_name_does_not_drive_the_terminal(tmp_path: Path) -> None:
    code, _, err = groundstation("info", str(tmp_path / "a\x1b[2J.csv"))
    assert code == 2 and "a?[2J.csv" in err and "\x1b" not in err


def test_a_code_page_that_lacks_a_sign_loses_no_answer(tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    log.write_text("# aircraft: 飛 σ\ntime_s,ins.true_heading_deg\n0,1\n1,1\n2,1\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "groundstation", "info", str(log)],
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "cp1251"},
        check=False,
    )
    assert done.returncode == 0 and done.stderr == b""
    assert b"\\u98db \\u03c3" in done.stdout


def test_wrong_usage_is_exit_2() -> None:
    assert groundstation("run")[0] == 2
    assert groundstation("run", "x.csv", "-o", "out", "--fail-on", "sometimes")[0] == 2
    assert groundstation("nonsense")[0] == 2


def test_a_missing_file_is_one_line_on_stderr(tmp_path: Path) -> None:
    for verb in ("info", "check", "list"):
        code, out, err = groundstation(verb, str(tmp_path / "none.csv"))
        assert (code, out) == (2, "")
        assert err.count("\n") == 1 and "none.csv" in err


@pytest.mark.parametrize("content", [b"", b"\x00" * 100, b"hello world\n", bytes(range(256)) * 8, b"\xa3\x95\x80" * 50])
def test_what_no_reader_claims_is_exit_1_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "odd.bin"
    path.write_bytes(content)
    for arguments in (["info", str(path)], ["check", str(path)], ["run", str(path), "-o", str(tmp_path / "out")]):
        code, _, err = groundstation(*arguments)
        assert code == 1, err
        assert len(err.strip().splitlines()) == 1 and "odd.bin" in err and "Traceback" not in err


def test_a_log_in_which_nothing_survives_has_one_answer(tmp_path: Path) -> None:
    log = tmp_path / "flight.BIN"
    log.write_bytes(flight_log(1).content[: 3 * 89])  # definitions alone
    for verb in (
        ["info"],
        ["check"],
        ["convert", "-o", str(tmp_path / "a.mcap")],
        ["run", "-o", str(tmp_path / "out")],
    ):
        code, out, err = groundstation(*verb, str(log))
        assert code == 1 and err.startswith("error: flight.BIN: no readable record"), (verb, code, err)
        assert err.count("\n") == 1 and ("format:" in out) == (verb == ["info"])


def test_records_without_a_time_are_said_to_be_there_by_every_verb(tmp_path: Path) -> None:
    log = tmp_path / "compass.nmea"
    log.write_bytes(b"".join(nmea(f"HEHDT,{at}.0,T") for at in range(60)))
    for verb in (["info"], ["check"], ["run", "-o", str(tmp_path / "out")]):
        code, _out, err = groundstation(*verb, str(log))
        assert code == 1 and err.startswith("error: compass.nmea: no readable record has a time, of 60"), (verb, err)


def test_a_foreign_file_in_a_folder_is_skipped_and_listed(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs/readme.txt").write_text("notes", encoding="utf-8")
    code, _, err = groundstation("run", str(tmp_path / "logs"), "-o", str(tmp_path / "out"))
    assert code == 0
    assert "skipped: readme.txt" in err
    assert "readme.txt" in (tmp_path / "out/index.csv").read_text(encoding="utf-8")


def test_settings_beside_logs_are_no_logs_and_what_is_skipped_is_told_by_reason(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("a.txt", "b.txt", "stations.toml", "settings.toml"):
        (logs / name).write_text("notes", encoding="utf-8")
    (logs / "alt.csv").write_text("time_s,baro.pressure_altitude_m\n0,1\n1,1\n2,1\n", encoding="utf-8")
    arguments = ("run", str(logs), "-o", str(tmp_path / "out"), "--no-pdf", "-j", "1")
    _, planned, err = groundstation(*arguments, "--dry-run")
    assert planned == "alt.csv  to run\n" and "skipped 2 files" in err and "toml" not in err
    assert not (tmp_path / "out").exists()
    code, first, err = groundstation(*arguments)
    assert code == 0 and "  NOTIME_" in first
    assert first.startswith("alt.csv  2 s of barometer at 1 Hz; nothing lost; not assessable: heading (")
    (line,) = [line for line in err.splitlines() if line.startswith("skipped")]
    assert line.startswith("skipped 2 files, a.txt, b.txt: found text that no reader claims")
    _, second, err = groundstation(*arguments)
    assert second == first.replace("  NOTIME_", "  finished before  NOTIME_")
    assert err.splitlines()[-1].endswith("; 1 was finished before")


def test_an_interrupted_run_says_how_to_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("groundstation.pipeline.many_flights.runs.batch.run_many", interrupted)
    code, out, err = groundstation("run", str(tmp_path), "-o", "out")
    assert (code, out) == (130, "")
    assert err == "interrupted: out keeps what is finished; the same command continues with the rest\n"


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb != "plan"])
def test_the_examples_of_every_verb_can_be_copied(verb: str) -> None:
    command = typer.main.get_command(app)
    assert isinstance(command, typer.core.TyperGroup)
    found = command.commands[verb]
    assert found.epilog == examples(verb)
    for line in EXAMPLES[verb]:
        name, *arguments = line.split()
        assert name == verb
        found.make_context(verb, arguments)  # raises where an option is not one of the verb


def test_an_output_that_is_not_ours_needs_force(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time_s,baro.pressure_altitude_m\n0,1\n1,1\n2,1\n", encoding="utf-8")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/precious.txt").write_text("mine", encoding="utf-8")
    arguments = ["run", str(tmp_path / "log.csv"), "-o", str(tmp_path / "out")]
    code, _, err = groundstation(*arguments)
    assert code == 2 and "-f" in err
    assert groundstation(*arguments, "-f")[0] == 0
    assert (tmp_path / "out/precious.txt").read_text(encoding="utf-8") == "mine"
    assert groundstation(*arguments)[0] == 0, "an own OUT is continued"


def test_verbose_says_why_compiled_code_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time_s,ins.true_heading_deg\n0,1\n1,1\n2,1\n")
    shared = tmp_path / "shared"
    shared.mkdir()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(shared))
    monkeypatch.setattr(compiling, "hand_of_others", lambda folder: f"others may write into {folder}")
    monkeypatch.setattr(compiling, "_cache_folder", compiling._cache_folder.__wrapped__)
    words = f"compiled code is not kept ({shared}: others may write into {shared})"
    assert groundstation("check", str(log), "--progress", "none", "-v")[2].count(words) == 1
    assert words not in groundstation("check", str(log), "--progress", "none")[2]
