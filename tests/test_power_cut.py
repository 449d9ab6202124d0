"""A loss of power: what is in place is on the disk, and a file that was lost all the same is made again."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from groundstation.base import to_disk
from groundstation.pipeline.many_flights.fleet.keys import KEYS
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.one_flight import flight
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.identity import sha256_of
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.files import load_manifest
from groundstation.store.info import StoreInfo
from groundstation.store.writer import StoreWriter
from tests.test_resume import SHORT, assert_equal_runs, copied, flight_in

BY_CONTENT = (".rrd", ".mcap", ".parquet")  # no two recordings are equal to the byte
KILLS = 40  # more than a run waits for the disk


@pytest.fixture(scope="module")
def finished(finished_run: Callable[..., Outcome]) -> Path:
    """OUT of a run of the short sample: shared, to be copied."""
    return Path(finished_run(SHORT.stem).folder).parent


def kinds(out: Path) -> dict[str, list[str]]:
    """Files of an OUT by what a run does for one that is emptied; of samples and datasets the first."""
    folder = flight_in(out)
    inside = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    (mcap,), reports = (name for name in inside if name.endswith(".mcap")), {"report.html"}
    everything = {"to run": {mcap}, "manifest": {"manifest.json"}, "summary": {"summary.json"}, "to report": reports}
    everything["to analyse"] = inside - set().union(*everything.values())
    found = {plan: [f"{folder.name}/{name}" for name in sorted(names)] for plan, names in everything.items()}
    found["beside"] = [path.name for path in out.iterdir() if path.is_file() and path.name != ".lock"]
    for pattern in ("flights.parquet/*", f"{KEYS}/*", "samples.parquet/*/*/*"):
        found["beside"].append(str(min(out.glob(pattern)).relative_to(out)))
    return found


def lose(path: Path, size: int = 0) -> None:
    """Cut a file as a loss of power does: its time stays, and so does that of its folder."""
    times = [(one, one.stat().st_mtime_ns) for one in (path, path.parent)]
    os.truncate(path, size)
    for one, time_ns in times:
        os.utime(one, ns=(time_ns, time_ns))


def is_whole(path: Path, like: Path) -> bool:
    if path.suffix in BY_CONTENT or path.name == "manifest.json":
        return path.stat().st_size > like.stat().st_size / 2
    return path.read_bytes() == like.read_bytes()


def test_every_file_of_a_flight_is_in_its_manifest(finished: Path) -> None:
    folder = flight_in(finished)
    manifest, sizes = load_manifest(folder), {}
    for path in folder.rglob("*"):
        if path.is_file() and path.name != "manifest.json":
            sizes[path.relative_to(folder).as_posix()] = path.stat().st_size
    assert {name: file.size_bytes for name, file in manifest.files.items()} == sizes
    (mcap,) = folder.glob("*.mcap")
    assert manifest.files[mcap.name].sha256 == sha256_of(mcap)


def test_every_emptied_file_is_missed(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    for plan, names in kinds(finished).items():
        for name in names if plan != "beside" else ():  # the next run makes those anew in any case
            lose(out / name)
            text = plan_many([SHORT], out, Configuration())[0].text
            assert text.startswith(plan if plan.startswith("to ") else "to run"), name
            shutil.copy2(finished / name, out / name)
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"


@pytest.mark.parametrize("kind", ["to run", "manifest", "summary", "to report", "to analyse", "beside"])
def test_emptied_files_are_made_again(finished: Path, tmp_path: Path, kind: str) -> None:
    out, names = copied(finished, tmp_path / "out"), kinds(finished)[kind]
    assert names
    for name in names:
        lose(out / name)
    (outcome, *_problems) = run_many([SHORT], out, Configuration(), jobs=1)
    assert outcome.state == "done" and outcome.was_finished == (kind == "beside")
    assert all(is_whole(out / name, finished / name) for name in names)
    assert_equal_runs(out, finished)
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"


@pytest.mark.parametrize(
    ("lost", "plan"),
    [
        ("*.mcap", "to run"),
        ("*.rrd", "to analyse"),
        ("arrays/*", "to analyse"),
        ("tables/*", "to analyse"),
        ("report.*", "to report"),
    ],
)
def test_a_file_of_another_size_is_made_again(finished: Path, tmp_path: Path, lost: str, plan: str) -> None:
    for number, path in enumerate(sorted(flight_in(finished).glob(lost))):
        out = copied(finished, tmp_path / str(number))
        lose(out / path.relative_to(finished), path.stat().st_size - 1)
        assert plan_many([SHORT], out, Configuration())[0].text.startswith(plan), path.name


def test_an_mcap_with_another_content_is_made_again_and_one_with_another_time_is_not(
    finished: Path, tmp_path: Path
) -> None:
    out = copied(finished, tmp_path / "out")
    (mcap,) = flight_in(out).glob("*.mcap")
    os.utime(mcap, ns=(0, 0))
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"
    content = bytearray(mcap.read_bytes())
    content[len(content) // 2] ^= 1
    mcap.write_bytes(content)
    assert plan_many([SHORT], out, Configuration())[0].text == "to run"


def test_a_manifest_without_sizes_is_that_of_an_earlier_version(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    folder = flight_in(out)
    told = json.loads((folder / "manifest.json").read_text())
    del told["files"]
    (folder / "manifest.json").write_text(json.dumps(told))
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"
    with (folder / "report.html").open("a") as file:
        file.write(" ")
    assert plan_many([SHORT], out, Configuration())[0].text == "finished, nothing to do"
    lose(folder / "report.html")
    assert plan_many([SHORT], out, Configuration())[0].text == "to report again"
    run_many([SHORT], out, Configuration(), jobs=1)
    assert_equal_runs(out, finished) and not load_manifest(folder).files


def test_what_is_reported_again_is_taken_down_and_nothing_else(finished: Path, tmp_path: Path) -> None:
    from groundstation.pipeline.many_flights.fleet.publishing import report_again

    out = copied(finished, tmp_path / "out")
    folder = flight_in(out)
    (recording,) = folder.glob("*.rrd")
    (folder / "report.html").write_text("of another version")
    lose(recording)
    report_again(out)
    assert load_manifest(folder).files["report.html"].size_bytes == (folder / "report.html").stat().st_size
    assert plan_many([SHORT], out, Configuration())[0].text.startswith("to analyse"), "the recording is still lost"
    report_again(out, with_pdf=True)
    assert "report.pdf" in load_manifest(folder).files
    report_again(out)
    assert "report.pdf" not in load_manifest(folder).files


def test_an_mcap_has_the_digest_of_what_was_written(tmp_path: Path) -> None:
    with StoreWriter(tmp_path / "a.mcap", StoreInfo(source_name="a")) as writer:
        pass
    assert writer.sha256 == sha256_of(tmp_path / "a.mcap")


def test_all_is_on_the_disk_before_a_flight_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that forgets what it was not asked to keep: a flight in its place has nothing but what was kept."""
    kept: dict[int, int] = {}  # number of a file -> its size when the disk was asked

    def keep(number: int, path: Path) -> None:
        found = os.fstat(number)
        kept[found.st_ino] = found.st_size

    monkeypatch.setattr(to_disk, "sync_open", keep)
    monkeypatch.setattr("groundstation.store.writer.sync_open", keep)
    run_many([SHORT], tmp_path / "out", Configuration(), jobs=1)
    for path in (*tmp_path.rglob("*"),):
        if path.is_file() and path.name != ".lock":
            assert kept.get(path.stat().st_ino) == path.stat().st_size, path
    folder = flight_in(tmp_path / "out")
    assert {folder.stat().st_ino, folder.parent.stat().st_ino, (folder / "arrays").stat().st_ino} <= kept.keys()


PROGRAM = """
import os, signal, sys
from pathlib import Path
from groundstation.base import to_disk
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from tests.test_power_cut import SHORT

left, real = [int(sys.argv[2])], to_disk.sync_file

def sync_or_die(path):
    left[0] -= 1
    if left[0] < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    real(path)

to_disk.SIDE_BY_SIDE = 1
for name in [name for name, module in sys.modules.items() if getattr(module, "sync_file", None) is real]:
    sys.modules[name].sync_file = sync_or_die
run_many([SHORT], Path(sys.argv[1]), Configuration(), jobs=1)
"""


@pytest.mark.slow
@pytest.mark.parametrize("moment", [1, *(pytest.param(at, marks=pytest.mark.slow) for at in (0, *range(2, 80, 3)))])
def test_killed_while_it_waits_for_the_disk_the_next_run_gives_the_same(
    finished: Path, tmp_path: Path, moment: int
) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path), str(moment)], check=False, capture_output=True)
    assert done.returncode in (0, -signal.SIGKILL), done.stderr.decode()
    assert done.returncode or moment > KILLS
    run_many([SHORT], tmp_path, Configuration(), jobs=1)
    assert_equal_runs(tmp_path, finished)


@pytest.mark.slow
def test_killed_while_a_flight_is_put_into_place_the_next_run_gives_the_same(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the place of an earlier one: what was moved stays away from what was not."""

    class KilledError(BaseException):
        pass

    out, left = copied(finished, tmp_path / "out"), 0

    def sync_or_die(_path: Path) -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise KilledError

    for moment in range(2):
        left = moment
        with monkeypatch.context() as patch, pytest.raises(KilledError):
            patch.setattr(flight, "sync_folder", sync_or_die)
            run_many([SHORT], out, Configuration(), jobs=1, redo=True)
        assert not (out / flight_in(finished).name / "manifest.json").exists()
        run_many([SHORT], out, Configuration(), jobs=1)
        assert_equal_runs(out, finished)
