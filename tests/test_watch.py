"""watch: logs are run once they are stable, again when they change; a watch that is killed goes on where it was."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from groundstation.base.errors import UsageError
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import silent
from groundstation.pipeline.verbs import watching
from groundstation.pipeline.verbs.watched_batch import WatchedLogs, run_batch
from groundstation.pipeline.verbs.watching import signature_of, watch

SAMPLES = Path(__file__).parents[1] / "sample_logs"
LONG_S = 120.0  # for a process on a busy machine


class StopError(Exception):
    """The end of a script of looks."""


class Looks:
    """A watch whose waits are steps of a script, and whose batches are only taken down."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, refused: tuple[str, ...] = ()) -> None:
        self.folder, self.said, self.batches = folder, list[str](), list[list[str]]()
        self._refused = list(refused)
        monkeypatch.setattr(watching, "run_batch", self._run)

    def _run(self, batch: WatchedLogs, _listen: object) -> tuple[Outcome, ...] | str:
        if self._refused:
            return self._refused.pop(0)
        self.batches.append([path.name for path in batch.paths])
        return tuple(Outcome(str(path), "done", "") for path in batch.paths)

    def play(self, *steps: Callable[[], object]) -> list[list[str]]:
        script = iter(steps)

        def wait(_seconds: float) -> None:
            step = next(script, None)
            if step is None:
                raise StopError
            step()

        out = self.folder / "out"
        with pytest.raises(StopError):
            list(watch(self.folder, out, Configuration(), every_s=1.0, say=self.said.append, wait=wait))
        return self.batches


def nothing() -> None:
    """A look at which nothing has happened."""


def test_a_log_is_run_once_when_it_has_stopped_growing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "day" / "a.csv"
    log.parent.mkdir()
    log.write_text("1")

    def grow() -> None:
        log.write_text(log.read_text() + "1")

    assert Looks(tmp_path, monkeypatch).play(grow, grow, nothing, nothing, nothing) == [["a.csv"]]


def test_a_batch_has_the_limits_that_the_watch_was_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.csv").write_text("1")
    batches = list[WatchedLogs]()
    monkeypatch.setattr(watching, "run_batch", lambda batch, _listen: batches.append(batch) or ())
    options = {"only_results": True, "timeout_s": 7.0, "wait": lambda _seconds: None, "say": print}
    list(watch(tmp_path, tmp_path / "out", Configuration(), every_s=1.0, once=True, **options))
    (batch,) = batches
    assert (batch.only_results, batch.timeout_s, batch.is_first, batch.force) == (True, 7.0, True, False)


def test_a_log_that_is_replaced_is_run_again_and_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("1")

    def replace() -> None:
        (tmp_path / "new").write_text("2")
        os.utime(tmp_path / "new", ns=(1, 1))
        (tmp_path / "new").replace(tmp_path / "b.csv")

    batches = Looks(tmp_path, monkeypatch).play(nothing, replace, nothing, nothing)
    assert batches == [["a.csv", "b.csv"], ["b.csv"]]


def test_what_is_no_log_yet_or_never_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.csv.part", ".a.csv.x8Gh", "aircraft.toml", "out/index.json", "out/index.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("1")
    assert Looks(tmp_path, monkeypatch).play(nothing, nothing) == []


def test_what_was_refused_is_tried_again_and_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.csv").write_text("1")
    looks = Looks(tmp_path, monkeypatch, refused=("another run", "another run"))
    assert looks.play(nothing, nothing, nothing, nothing) == [["a.csv"]]
    assert looks.said[0].startswith(f"watching {tmp_path}: 1 file there now") and looks.said[1:] == ["another run"]


def test_a_look_that_could_run_nothing_has_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.csv").write_text("1")
    looks, out = Looks(tmp_path, monkeypatch, refused=("another run",)), tmp_path / "out"
    (found,) = watch(tmp_path, out, Configuration(), every_s=0.0, once=True, say=looks.said.append, wait=lambda _: None)
    assert [(one.state, one.text) for one in found] == [("failed", "another run")]
    assert not looks.said  # it is told as what became of the look, not twice


def test_a_folder_of_others_is_refused_before_the_first_log_arrives(tmp_path: Path) -> None:
    incoming, out = tmp_path / "in", tmp_path / "out"
    for folder in (incoming, out):
        folder.mkdir()
    (out / "letter.txt").write_text("not ours")
    with pytest.raises(UsageError, match="did not make"):
        next(watch(incoming, out, Configuration(), every_s=0.1, say=print))


def test_a_share_that_goes_and_comes_back_is_no_reason_to_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    share = tmp_path / "share"
    share.mkdir()
    (share / "a.csv").write_text("1")
    looks = Looks(share, monkeypatch)
    away = tmp_path / "away"
    batches = looks.play(nothing, lambda: share.rename(away), nothing, lambda: away.rename(share), nothing, nothing)
    assert batches == [["a.csv"]]
    assert len(looks.said) == 2


def test_a_bag_is_as_large_as_its_files(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("1")
    (tmp_path / "bag.mcap").write_text("1")
    before = signature_of(tmp_path / "metadata.yaml")
    (tmp_path / "bag.mcap").write_text("12")
    assert signature_of(tmp_path / "metadata.yaml") != before


def test_a_folder_that_is_not_there_or_is_the_results_is_a_usage_error(tmp_path: Path) -> None:
    for folder in (tmp_path / "none", tmp_path):
        with pytest.raises(UsageError):
            next(watch(folder, tmp_path, Configuration(), every_s=0.1, say=print))


def batch_of(out: Path, *paths: Path, is_first: bool = False) -> WatchedLogs:
    return WatchedLogs(paths, out, Configuration(), "none", False, 1, None, False, is_first)


@pytest.mark.slow
def test_the_index_keeps_what_gave_no_flight(tmp_path: Path) -> None:
    note, bad, out = tmp_path / "note.txt", tmp_path / "bad.ulg", tmp_path / "out"
    note.write_text("lunch at noon")
    bad.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8))
    first = run_batch(batch_of(out, bad, note, is_first=True), silent)
    second = run_batch(batch_of(out, SAMPLES / "taxi-short.csv"), silent)
    assert sorted(one.state for one in first) == ["failed", "skipped"]  # type: ignore[union-attr]
    assert [one.state for one in second] == ["done"]  # type: ignore[union-attr]
    rows = json.loads((out / "index.json").read_text())["rows"]
    assert sorted(row["kind"] for row in rows) == ["failed", "flight", "skipped"]


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[[], "subprocess.Popen[str]"]]:
    """Starts a watch of ``in`` into ``out``; what still runs at the end is killed."""
    processes: list[subprocess.Popen[str]] = []

    def start() -> "subprocess.Popen[str]":
        command = [sys.executable, "-m", "groundstation", "watch", str(tmp_path / "in"), "-o", str(tmp_path / "out")]
        options = ["--every", "0.3", "--no-pdf", "-j", "1"]
        process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + LONG_S
    while not is_so():
        assert time.monotonic() < end_s, "it did not happen"
        time.sleep(0.05)


@pytest.mark.slow
def test_a_watch_that_is_killed_goes_on_and_ends_at_ctrl_c(
    tmp_path: Path, started: Callable[[], "subprocess.Popen[str]"]
) -> None:
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    shutil.copy(SAMPLES / "taxi-short.csv", folder)
    first = started()
    until(lambda: any(out.glob(".partial-*")))  # in the middle of the first log
    first.send_signal(signal.SIGKILL)
    first.wait()
    shutil.copy(SAMPLES / "taxi-notime.csv", folder)
    second = started()
    until(lambda: (out / "summary.html").is_file() and len(list(out.glob("*/manifest.json"))) == 2)
    until(lambda: len(json.loads((out / "index.json").read_text())["rows"]) == 2)
    second.send_signal(signal.SIGINT)
    _, error = second.communicate(timeout=LONG_S)
    assert second.returncode == 0
    assert error.strip().endswith("the same command continues with the rest")
    assert not list(out.glob(".partial-*"))
