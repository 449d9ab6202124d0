"""Faults while a run writes: a full or read-only disk, an end by force, two runs at once; then the run is continued.

What a fault may cost is its own run: no traceback, no folder that looks finished and is not, and the run that follows
gives what one run from scratch gives.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.progress import Event
from tests.test_resume import SAMPLES, SHORT, assert_equal_runs

STAGES = ("converting", "reading the MCAP", "estimating", "saving", "recording", "reporting")
DISK_BYTES = 40_000_000
PATIENCE_S = 120.0


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A small file system of its own, where this user may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "none", str(place)]
    if not shutil.which("mount") or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("cannot mount a file system: not root, or not allowed to")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def fill(disk: Path) -> None:
    """Write until nothing more goes."""
    with (disk / "filler").open("ab", buffering=0) as file:
        for size in (1 << 20, 1 << 12, 1):
            try:
                while file.write(b"x" * size) == size:
                    pass
            except OSError:
                continue


def make_room(disk: Path) -> None:
    (disk / "filler").unlink()


def forbid_writing(disk: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=False, capture_output=True)


def allow_writing(disk: Path) -> None:
    subprocess.run(["mount", "-o", "remount,rw", str(disk)], check=True)


def run_with_fault(out: Path, stage: str, fault: Callable[[], None]) -> str:
    """Run the short sample, a fault coming in at the beginning of a stage; returns what the run says of it."""
    came = []

    def listen(event: Event) -> None:
        if event.kind == "stage" and event.text == stage and not came:
            came.append(stage)
            fault()

    try:
        outcome, *beside = run_many([SHORT], out, Configuration(), jobs=1, with_pdf=False, listen=listen)
    finally:
        assert came
    assert {one.state for one in (outcome, *beside)} == {"failed"}  # the pages of all flights cannot be written either
    return outcome.text


def finished_flights(out: Path) -> list[Path]:
    return list(out.glob("[!.]*/manifest.json"))


def continued(out: Path, whole: Path) -> None:
    (outcome,) = run_many([SHORT], out, Configuration(), jobs=1, with_pdf=False)
    assert outcome.state == "done" and not list(out.glob(".partial*"))
    assert_equal_runs(out, whole)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """OUT of an undisturbed run."""
    out = tmp_path_factory.mktemp("whole") / "out"
    run_many([SHORT], out, Configuration(), jobs=1, with_pdf=False)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_a_disk_that_is_full_fails_the_log_and_the_run_goes_on_later(disk: Path, whole: Path, stage: str) -> None:
    text = run_with_fault(disk / "out", stage, lambda: fill(disk))
    assert "No space left" in text and "\n" not in text
    assert not finished_flights(disk / "out")
    make_room(disk)
    continued(disk / "out", whole)


def run_command(out: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "groundstation", "run", str(SHORT), "-o", str(out), "--no-pdf", "-q", *options]


@pytest.mark.parametrize("fault", ["full", "read-only"])
def test_the_command_line_says_in_lines_that_it_cannot_write(disk: Path, fault: str) -> None:
    if fault == "full":
        fill(disk)
    else:
        forbid_writing(disk)
    ran = subprocess.run(run_command(disk / "out"), check=False, capture_output=True, text=True, timeout=PATIENCE_S)
    reason = {"full": "No space left", "read-only": "Read-only file system"}[fault]
    told = ran.stderr.splitlines()  # of the log and of each page that cannot be written
    assert (ran.returncode, ran.stdout) == (1, "") and told
    assert all(line.startswith("error: ") and reason in line for line in told)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize("stage", STAGES)
def test_killed_in_any_stage_the_next_run_gives_the_same(tmp_path: Path, whole: Path, stage: str) -> None:
    out = tmp_path / "out"
    program = (
        "import os, signal, sys; from pathlib import Path; from tests.test_faults import run_with_fault;"
        "run_with_fault(Path(sys.argv[1]), sys.argv[2], lambda: os.kill(os.getpid(), signal.SIGKILL))"
    )
    ended = subprocess.run([sys.executable, "-c", program, str(out), stage], cwd=SAMPLES.parent, timeout=PATIENCE_S)
    assert ended.returncode == -signal.SIGKILL
    assert not finished_flights(out)
    continued(out, whole)


def members(group: int) -> list[str]:
    """Processes of a group that run; not those whose entry nobody has fetched."""
    found = []
    for one in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = one.read_text().rpartition(")")
        except OSError:  # it ended meanwhile
            continue
        state, _parent, of_group = rest.split()[:3]
        found += [name] if int(of_group) == group and state != "Z" else []
    return found


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to look for processes")
@pytest.mark.parametrize("moment_s", [0.5, 2.0, 4.0])
def test_ctrl_c_ends_two_workers_without_a_traceback(tmp_path: Path, moment_s: float) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "groundstation", "run", str(SAMPLES), "-o", str(out), "-j", "2", "--no-pdf"]
    with subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True) as process:
        begin = time.monotonic()
        while not (out / "index.json").exists() and process.poll() is None:
            assert time.monotonic() - begin < PATIENCE_S
            time.sleep(0.02)
        time.sleep(moment_s)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all processes of the run
        _, told = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130 and "Traceback" not in told
    deadline = time.monotonic() + 10.0
    while left := members(process.pid):
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


@pytest.mark.slow
def test_of_two_runs_into_one_folder_one_is_refused(tmp_path: Path, whole: Path) -> None:
    out = tmp_path / "out"
    both = [
        subprocess.Popen(run_command(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    told = [process.communicate(timeout=PATIENCE_S)[1] for process in both]
    codes = [process.returncode for process in both]
    assert sorted(codes) == [0, 2]
    assert "another run is writing into it" in told[codes.index(2)]
    assert_equal_runs(out, whole)
