"""A night over a bucket: a cluster of which a worker is killed and another hangs, damaged logs, twins; then again."""

import json
import os
import random
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest
from distributed import LocalCluster

from groundstation.pipeline.many_flights.batch import run_many
from groundstation.pipeline.many_flights.remote import RemoteFolder
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome, worst_code
from tests.test_remote import bucket
from tests.test_resume import SHORT

__all__ = ["bucket"]
TIMEOUT_S = 150.0  # far above what a log of half a minute takes on a busy machine, imports of its worker with it
HANGING = b"HANGING LOG"
READER = f"""
import time
from groundstation.base.records import LogHeader
from groundstation.readers.source import Claim

NAME = "hanging"


def sniff(source):
    return Claim(NAME) if source.head.startswith({HANGING!r}) else None


def read(source):
    yield LogHeader(NAME)
    time.sleep(3600.0)
"""


@pytest.fixture
def hanging_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that never ends, as a package of somebody else: workers find it as this process does."""
    packages = tmp_path / "packages"
    (packages / "hanging-1.0.dist-info").mkdir(parents=True)
    (packages / "hanging.py").write_text(READER)
    (packages / "hanging-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: hanging\nVersion: 1.0\n")
    (packages / "hanging-1.0.dist-info" / "entry_points.txt").write_text("[groundstation.readers]\nhanging = hanging\n")
    monkeypatch.syspath_prepend(packages)


def make_logs(folder: Path, count: int) -> dict[str, str]:
    """Logs with their kinds: whole ones of one recorder, every tenth damaged, one that hangs, one that is a twin."""
    folder.mkdir()
    rng, kinds = random.Random(5), {}
    for number in range(count):
        name, content = f"{number:03d}.csv", SHORT.read_bytes().replace(b"# flight: ", b"# flight: %03d" % number)
        kinds[name] = "whole"
        if number % 10 == 3:
            kinds[name] = ("cut", "header", "flipped")[number // 10 % 3]
            if kinds[name] == "flipped":
                damaged = bytearray(content)
                for _ in range(200):
                    damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
                content = bytes(damaged)
            else:
                content = content[: len(content) // 2] if kinds[name] == "cut" else b"time_s,ins.true_heading_deg\n"
        (folder / name).write_bytes(content)
    (folder / "hangs.bin").write_bytes(HANGING)
    shutil.copy(folder / "000.csv", folder / "twin.csv")
    return kinds | {"hangs.bin": "hanging", "twin.csv": "twin"}


def night(source: str, out: str, *, is_killing: bool) -> tuple[Outcome, ...]:
    """One run on a cluster of two workers, of which the first that is busy is killed."""
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        killed = threading.Event()

        def kill_one() -> None:
            while not killed.is_set():
                busy = [one for one in cluster.scheduler.workers.values() if one.processing]
                nannies = [one for one in cluster.workers.values() if busy and one.worker_address == busy[0].address]
                if nannies and nannies[0].process is not None:
                    time.sleep(2.0)
                    os.kill(nannies[0].process.pid, signal.SIGKILL)
                    killed.set()
                time.sleep(0.05)

        killer = threading.Thread(target=kill_one, daemon=True)
        if is_killing:
            killer.start()
        outcomes = run_many(
            [source], out, Configuration(), scheduler=cluster.scheduler_address, timeout_s=TIMEOUT_S, with_pdf=False
        )
        assert killed.is_set() == is_killing
        killed.set()
    return outcomes


@pytest.mark.slow  # the time limit alone is minutes: a busy machine must not take a whole log for one that hangs
@pytest.mark.usefixtures("hanging_reader")
@pytest.mark.parametrize("count", [4, 300])
def test_a_night_over_a_bucket(bucket: str, tmp_path: Path, count: int) -> None:
    kinds = make_logs(tmp_path / "logs", count)
    source, out = f"{bucket}/logs", f"{bucket}/out"
    RemoteFolder(source).send(tmp_path / "logs")
    began = time.monotonic()
    outcomes = {Path(one.source).name: one for one in night(source, out, is_killing=True)}
    assert sorted(outcomes) == sorted(kinds)
    for name, kind in kinds.items():
        one = outcomes[name]
        states = {
            "whole": {"done"},
            "hanging": {"failed"},
            "twin": {"skipped"},
            "header": {"failed"},
        }.get(kind, {"done", "data_lost", "failed"})
        assert one.state in states and "internal error" not in one.text, (name, kind, one)
    assert outcomes["hangs.bin"].text == f"hangs.bin: not done within {TIMEOUT_S:g} s (--timeout), ended"
    assert outcomes["twin.csv"].text.endswith("000.csv, listed once") and worst_code(tuple(outcomes.values())) == 1
    rows = json.loads(RemoteFolder(out).read("index.json") or b"")["rows"]
    flights = {row["flight_id"] for row in rows if row["kind"] == "flight"}
    assert flights == {one.flight_id for one in outcomes.values() if one.flight_id}
    assert {name for name in RemoteFolder(out).names() if name.startswith(".") and name != ".logs"} <= {".lock"}
    assert RemoteFolder(out).names(".lock") == []
    print(f"{count} logs in {time.monotonic() - began:.0f} s")
    if count > 4:
        again = {Path(one.source).name: one for one in night(source, out, is_killing=False)}
        assert {name: (one.state, one.flight_id) for name, one in again.items()} == {
            name: (one.state, one.flight_id) for name, one in outcomes.items()
        }
        assert all(one.was_finished for one in again.values() if one.flight_id)
