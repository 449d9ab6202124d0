"""Logs in processes of their own: what goes beyond its limits costs itself alone, and nothing of it is left."""

import gzip
import multiprocessing
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError, SettingsError, UsageError
from groundstation.base.garbage import NEW_OBJECTS
from groundstation.pipeline.many_flights.processes import apart
from groundstation.pipeline.many_flights.processes.apart import DIED, bounds_of, outcomes_apart
from groundstation.pipeline.many_flights.processes.confined import ProcessLimits
from groundstation.pipeline.many_flights.processes.crews import crew_for
from groundstation.pipeline.many_flights.runs import batch as batch_of_logs
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.pipeline.one_flight.isolation import Isolation
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import keys_of
from groundstation.pipeline.verbs import watched_batch
from groundstation.pipeline.verbs.check import check_many
from groundstation.pipeline.verbs.check_apart import check_apart, describe_apart
from groundstation.pipeline.verbs.conversions import convert_many
from groundstation.pipeline.verbs.describe import describe
from groundstation.pipeline.verbs.watched_batch import WatchedLogs
from groundstation.readers import registry
from groundstation.results.flight import Source
from tests.apart_deeds import Deed, act
from tests.test_cli import groundstation
from tests.test_resume import SAMPLES, SHORT, assert_equal_runs

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no limits for processes here")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells of the processes below another")
ISOLATED = ProcessLimits(60.0, memory_bytes=1 << 30, file_bytes=1 << 20, is_isolated=True)


def run(
    names: list[str], out: Path, bounds: ProcessLimits, *, workers: int = 2, listen: Listener = silent
) -> list[Outcome]:
    jobs = [Deed(name, out) for name in names]
    ended = dict(outcomes_apart(enumerate(jobs), act, workers=workers, listen=listen, bounds=bounds))
    return [ended[number] for number in range(len(jobs))]


def is_alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@LINUX
def test_each_limit_costs_the_log_that_goes_beyond_it_alone(tmp_path: Path) -> None:
    events: list[Event] = []
    names = ["good", "takes_memory", "asks_for_memory", "writes_much", "crashes", "exits", "raises", "good"]
    found = run(names, tmp_path, ISOLATED, listen=events.append)
    assert found[0] == Outcome(str(tmp_path / "good"), "done", "a line", times_s={"acting": 1.5}) == found[-1]
    said = {name: one.text for name, one in zip(names, found, strict=True)}
    assert said["takes_memory"] == "takes_memory: more than 1074 MB of memory (isolation.memory_mb), ended"
    assert said["crashes"] == "crashes: its process died (SIGSEGV)"
    for name in ("asks_for_memory", "writes_much", "exits", "raises"):
        assert said[name] in (f"{name}: its process died", f"{name}: {DIED}")
    assert {one.state for one in found[1:-1]} == {"failed"} and all("\n" not in one.text for one in found)
    assert (tmp_path / "much").stat().st_size <= ISOLATED.file_bytes
    assert [event.name for event in events].count("good") == 2


@pytest.mark.parametrize("is_isolated", [True, False])
def test_a_log_of_its_own_process_has_garbage_searched_for_as_rarely_as_in_a_run(
    tmp_path: Path, is_isolated: bool
) -> None:
    (done,) = run(["threshold"], tmp_path, ProcessLimits(60.0, is_isolated=is_isolated))
    assert (done.state, (tmp_path / "threshold").read_text()) == ("done", str(NEW_OBJECTS))


@pytest.mark.parametrize("is_isolated", [True, False])
def test_a_log_that_takes_too_long_is_ended(tmp_path: Path, is_isolated: bool) -> None:
    (late,) = run(["hangs"], tmp_path, ProcessLimits(1.0, is_isolated=is_isolated))
    assert late.text == "hangs: not done within 1 s (--timeout), ended"
    assert not multiprocessing.active_children()


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize("name", ["leaves_children", "leaves_children_and_hangs"])
def test_no_child_outlives_its_log(tmp_path: Path, name: str) -> None:
    (found,) = run([name], tmp_path, replace(ISOLATED, time_s=5.0))
    assert found.state == ("done" if name == "leaves_children" else "failed")
    children = [int(file.read_text()) for file in tmp_path.glob("child*")]
    assert len(children) == 3 and not any(map(is_alive, children))


@LINUX
def test_no_right_is_gained(tmp_path: Path) -> None:
    assert run(["gains_rights"], tmp_path, ISOLATED)[0].state == "done"


PROGRAM = """
import sys
from pathlib import Path
from tests.test_apart import ISOLATED, run
run(["leaves_children_and_hangs"], Path(sys.argv[1]), ISOLATED)
"""


@pytest.mark.slow
@LINUX
def test_a_run_that_is_killed_takes_the_processes_of_its_logs_with_it(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(tmp_path)])
    deadline = time.monotonic() + 60.0
    while len(list(tmp_path.glob("child*"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.kill()
    process.wait()
    children = [int(file.read_text()) for file in tmp_path.glob("child*")]
    assert len(children) == 3
    while any(map(is_alive, children)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(is_alive, children))


@pytest.mark.parametrize(
    "message", [b"", b"{", b"[" * 2_000, b"null", b'{"ended": 1, "event": {"a": 2}}', b'{"found": 3}']
)
def test_what_cannot_be_understood_is_a_log_that_failed(message: bytes, tmp_path: Path) -> None:
    receiver, sender = multiprocessing.Pipe(duplex=False)
    one = apart._Running(0, Deed("log", tmp_path), multiprocessing.Process(), receiver, ProcessLimits(), float("inf"))
    sender.send_bytes(message)
    sender.close()
    while not one.is_ended:
        assert not list(one.take())
    answer = one.answer(Outcome, lambda job, reason: Outcome(job.log, "failed", f"{job.name}: {reason}"))
    assert answer.state == "failed" and answer.text.startswith("log: its process ")


def test_an_isolated_run_gives_what_any_other_gives_and_is_continued(tmp_path: Path) -> None:
    run_many([SHORT], tmp_path / "one", Configuration(), jobs=1, only_results=True)
    for number in range(2):
        (outcome,) = run_many([SHORT], tmp_path / "two", Configuration(), jobs=1, only_results=True, is_isolated=True)
        assert (outcome.state, outcome.was_finished) == ("done", number == 1)
        assert_equal_runs(tmp_path / "one", tmp_path / "two")
    with_limits = Configuration({"isolation": {"memory_mb": 2000}}, files={"isolation": "ours.toml"})
    (outcome,) = run_many([SHORT], tmp_path / "two", with_limits, jobs=1, only_results=True)
    assert outcome.was_finished, "limits change no result"


@pytest.mark.slow
def test_checks_and_descriptions_are_those_of_this_process() -> None:
    logs, bounds = [SAMPLES / "taxi-damaged.csv", SAMPLES / "README.md"], ProcessLimits(120.0)
    assert check_apart(logs, Configuration(), bounds, purpose="heading") == check_many(
        logs, Configuration(), purpose="heading"
    )
    assert describe_apart(SHORT, None, (), bounds) == describe(SHORT)
    with pytest.raises(GroundstationError) as there:
        describe_apart(SAMPLES / "README.md", None, (), bounds)
    with pytest.raises(GroundstationError) as here_too:
        describe(SAMPLES / "README.md")
    assert str(there.value) == str(here_too.value)


def long_log(path: Path) -> Path:
    """Write 36 MB: with its process, which loads all libraries, no machine reads it in a second."""
    names = ",".join(["ins.roll_deg", "ins.pitch_deg", *(f"a{number}" for number in range(1_500))])
    path.write_text(f"time_s,{names}\n" + "".join(f"{row / 10}{',1.5' * 1_502}\n" for row in range(6_000)))
    return path


@pytest.mark.slow
def test_the_verbs_keep_a_limit_of_time(tmp_path: Path) -> None:
    long = long_log(tmp_path / "long.csv")
    for verb, *more in (("info",), ("check",), ("convert", "-o", str(tmp_path / "out.mcap"))):
        code, _, err = groundstation(verb, str(long), *more, "--timeout", "1")
        assert (code, err) == (1, "error: long.csv: not done within 1 s (--timeout), ended\n"), verb
    assert {path.name for path in tmp_path.iterdir()} == {"long.csv"}


def test_conversions_apart_give_the_same_file(tmp_path: Path) -> None:
    for name, bounds in (("a.mcap", None), ("b.mcap", ProcessLimits(300.0))):
        assert convert_many([SHORT], tmp_path / name, bounds=bounds)[0].state == "done"
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_the_shorter_limit_of_time_counts_and_is_named() -> None:
    assert bounds_of(None, 5.0) == ProcessLimits(5.0)
    by_option, by_settings = bounds_of(Isolation(), 5.0), bounds_of(Isolation(time_s=3.0), 5.0)
    assert (by_option.time_s, by_option.time_from) == (5.0, "--timeout")
    assert (by_settings.time_s, by_settings.time_from) == (3.0, "isolation.time_s")
    assert by_settings.memory_bytes == 4_000_000_000 and by_settings.is_isolated


def test_limits_are_settings_and_not_in_keys_or_manifests(tmp_path: Path) -> None:
    file = tmp_path / "settings.toml"
    file.write_text("[isolation]\nmemory_mb = 900.0\n")
    configuration = load_configuration(file)
    assert configuration.isolation == Isolation(memory_mb=900.0) and configuration.to_dict() == {}
    source = Source("a", "b", 1, "c")
    assert keys_of(source, configuration) == keys_of(source, Configuration())
    file.write_text("[isolation]\nmemory_mb = 1.0\n")
    with pytest.raises(SettingsError, match="memory_mb"):
        load_configuration(file)


def test_what_reads_logs_elsewhere_or_here_is_refused_with_it(tmp_path: Path) -> None:
    for more in (["--dry-run"], ["--scheduler", "tcp://a:1"], ["--together"]):
        code, _, err = groundstation("run", str(SHORT), str(SHORT), "-o", str(tmp_path / "out"), "--isolate", *more)
        assert code == 2 and "--isolate" in err
    assert not (tmp_path / "out").exists()


def test_a_system_without_limits_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "fork")
    with pytest.raises(UsageError, match="Linux or macOS"):
        bounds_of(Isolation())


def test_one_log_is_read_apart_too() -> None:
    assert crew_for("", 1, 1, silent, bounds=ISOLATED).func is outcomes_apart


def test_a_watch_that_isolates_reads_no_log_in_its_own_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is given to a process of its own; of the others no more than the first bytes are looked at."""
    (tmp_path / "a.csv").write_bytes(SHORT.read_bytes())
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b"time_s,ins.roll_deg\n0,1\n1,2\n"))
    (tmp_path / "note.txt").write_text("lunch at noon")
    given = list[tuple[list[str], list[Path], bool]]()

    def take(paths: list[str], *_: object, unclaimed: list[Path], is_isolated: bool, **__: object) -> tuple[Outcome]:
        given.append((sorted(Path(path).name for path in paths), unclaimed, is_isolated))
        return (Outcome(str(tmp_path / "a.csv"), "done", ""),)

    def refuse(*_: object) -> None:
        raise AssertionError("it is read here")

    for name in ("identify", "read"):
        monkeypatch.setattr(registry, name, refuse)
    monkeypatch.setattr(batch_of_logs, "run_many", take)
    monkeypatch.setattr(watched_batch, "_list_too", lambda *_: None)
    paths = tuple(tmp_path / name for name in ("a.csv", "a.csv.gz", "note.txt"))
    one = WatchedLogs(paths, tmp_path / "out", Configuration(), "none", False, 1, None, False, True, is_isolated=True)
    assert [outcome.state for outcome in watched_batch._outcomes(one, silent)] == ["skipped", "done"]
    assert given == [(["a.csv", "a.csv.gz"], [tmp_path / "note.txt"], True)]


@pytest.mark.slow
def test_a_watch_and_a_check_keep_the_limits(tmp_path: Path) -> None:
    """By the command, with the limits of settings: the size of a file for `watch` and `run`, time for `check`."""
    folder, settings = tmp_path / "in", tmp_path / "settings.toml"
    folder.mkdir()
    numbers = np.random.default_rng(39).random((20_000, 20))
    rows = (f"{row / 50:.2f},{','.join(f'{one:.9f}' for one in line)}\n" for row, line in enumerate(numbers))
    names = ",".join(["ins.roll_deg", *(f"a{number}" for number in range(19))])
    (folder / "large.csv").write_text(f"time_s,{names}\n" + "".join(rows))
    settings.write_text("[isolation]\nfile_mb = 1.0\n")
    same = ("--isolate", "--config", str(settings), "--progress", "none")
    for verb, *more in (("run", "--only", "results"), ("watch", "--only", "results", "--once", "--every", "0.1")):
        out = tmp_path / verb
        code, _, err = groundstation(verb, str(folder), "-o", str(out), *same, *more)
        assert code == 1 and "flight.mcap: cannot be written (File too large)" in err, verb
        assert not [path for path in out.iterdir() if path.is_dir() and path.name.startswith(".partial")]
    settings.write_text("[isolation]\ntime_s = 1.0\n")
    code, _, err = groundstation("check", str(long_log(tmp_path / "long.csv")), *same)
    assert (code, err) == (1, "error: long.csv: not done within 1 s (isolation.time_s), ended\n")
    assert not multiprocessing.active_children()
