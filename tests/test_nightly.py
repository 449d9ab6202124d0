"""A night over a bucket: a cluster of which one worker is killed and one hangs, damaged logs, twins; then again."""

import json
import math
import random
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import LocalCluster

from groundstation.pipeline.many_flights.remote.folder import RemoteFolder
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome, worst_code
from tests.test_remote import bucket
from tests.test_resume import SHORT

__all__ = ["bucket"]
RUNS_TO_A_LIMIT, SHORTEST_LIMIT_S = 3.0, 20.0  # the time limit: as many times the run of one log, on this machine now
HANGS, KILLS = b"# HANGS", b"# KILLS ONCE"
READER = f"""
import multiprocessing
import os
import signal
import time
from pathlib import Path

from groundstation.base.records import LogHeader
from groundstation.readers import flat_csv
from groundstation.readers.source import Claim

NAME, KILLED, HUNG = "hostile", Path(__file__).with_name("killed"), Path(__file__).with_name("hung")


def sniff(source):
    return Claim(NAME) if source.head.startswith(({HANGS!r}, {KILLS!r})) else None


def read(source):
    if source.head.startswith({HANGS!r}):
        yield LogHeader(NAME)
        with HUNG.open("a") as file:
            file.write("hung ")
        time.sleep(3600.0)
    for item in flat_csv.read(source):
        yield item
        if not KILLED.exists() and multiprocessing.parent_process() is not None:
            KILLED.touch()
            os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A reader of somebody else that hangs, or kills its process once: the folder where it tells of that."""
    packages = tmp_path / "packages"
    (packages / "hostile-1.0.dist-info").mkdir(parents=True)
    (packages / "hostile.py").write_text(READER)
    (packages / "hostile-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: hostile\nVersion: 1.0\n")
    (packages / "hostile-1.0.dist-info" / "entry_points.txt").write_text("[groundstation.readers]\nhostile = hostile\n")
    monkeypatch.syspath_prepend(packages)  # workers find it as this process does
    return packages


@pytest.fixture
def cluster(bucket: str, hostile: Path) -> Iterator[str]:
    """The scheduler of two workers, which inherit what reaches the bucket and where the reader is."""
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as found:
        yield found.scheduler_address


def make_logs(folder: Path, count: int) -> dict[str, str]:
    """Logs with their kinds: whole ones, every tenth damaged, and one each that hangs, kills its worker, is a twin."""
    folder.mkdir()
    rng, kinds = random.Random(5), {}
    for number in range(count):
        name, content = f"{number:03d}.csv", SHORT.read_bytes().replace(b"# flight: ", b"# flight: %03d" % number)
        kinds[name] = "whole"
        if number % 10 == 1:
            kinds[name] = ("cut", "header", "flipped")[number // 10 % 3]
            if kinds[name] == "flipped":
                damaged = bytearray(content)
                for _ in range(200):
                    damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
                content = bytes(damaged)
            else:
                is_cut, header = kinds[name] == "cut", b"# flight: %d\ntime_s,ins.true_heading_deg\n" % number
                content = content[: len(content) // 2] if is_cut else header
        (folder / name).write_bytes(content)
    (folder / "hangs.csv").write_bytes(HANGS)
    (folder / "kills.csv").write_bytes(KILLS + b"\n" + SHORT.read_bytes())
    shutil.copy(folder / "000.csv", folder / "twin.csv")
    return kinds | {"hangs.csv": "hanging", "kills.csv": "whole", "twin.csv": "twin"}


def run_all(source: str, out: str, cluster: str, timeout_s: float = math.inf) -> dict[str, Outcome]:
    """One run on a cluster, results alone: recordings and reports add nothing but time. Outcomes by name of the log."""
    outcomes = run_many([source], out, Configuration(), scheduler=cluster, only_results=True, timeout_s=timeout_s)
    return {Path(one.source).name: one for one in outcomes}


@pytest.mark.slow  # with two logs too, as it has to wait for one that hangs
@pytest.mark.parametrize("count", [2, 300])
def test_a_night_over_a_bucket(bucket: str, cluster: str, hostile: Path, tmp_path: Path, count: int) -> None:
    kinds = make_logs(tmp_path / "logs", count)
    source, out = f"{bucket}/logs", f"{bucket}/out"
    RemoteFolder(source).send(tmp_path / "logs")
    began = time.monotonic()
    (first,) = run_all(f"{source}/000.csv", out, cluster).values()
    limit_s = max(SHORTEST_LIMIT_S, RUNS_TO_A_LIMIT * (time.monotonic() - began))  # a busy machine is slow, not hanging

    outcomes = run_all(source, out, cluster, limit_s)
    assert (hostile / "killed").exists() and sorted(outcomes) == sorted(kinds)
    states = {"whole": {"done"}, "hanging": {"failed"}, "twin": {"skipped"}, "header": {"failed"}}
    for name, kind in kinds.items():
        one = outcomes[name]
        assert one.state in states.get(kind, {"done", "data_lost", "failed"}), (name, kind, one)
        assert "internal error" not in one.text, (name, kind, one)
    assert outcomes["000.csv"].was_finished and outcomes["000.csv"].flight_id == first.flight_id
    assert outcomes["hangs.csv"].text == f"hangs.csv: not done within {limit_s:g} s (--timeout), ended"
    assert outcomes["twin.csv"].text.endswith("000.csv, listed once") and worst_code(tuple(outcomes.values())) == 1
    rows = json.loads(RemoteFolder(out).read("index.json") or b"")["rows"]
    flights = {row["flight_id"] for row in rows if row["kind"] == "flight"}
    assert flights == {one.flight_id for one in outcomes.values() if one.flight_id}
    assert {name for name in RemoteFolder(out).names() if name.startswith(".") and name != ".logs"} <= {".lock"}
    assert RemoteFolder(out).names(".lock") == []
    print(f"{count} logs and three in {time.monotonic() - began:.0f} s, with a limit of {limit_s:.0f} s")

    RemoteFolder(source).remove("hangs.csv")
    again = run_all(source, out, cluster)
    assert {name: (one.state, one.flight_id) for name, one in again.items()} == {
        name: (one.state, one.flight_id) for name, one in outcomes.items() if name != "hangs.csv"
    }
    assert all(one.was_finished for one in again.values() if one.flight_id)
    assert (hostile / "hung").read_text() == "hung "  # not once more in another worker
