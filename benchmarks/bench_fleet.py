"""Many flights: one and two worker processes, a Dask cluster beside them, memory of a worker, killed runs continued.

``bench_fleet.py [FLIGHTS]``, 500 without it: wall seconds; other programs slow all of them. ``bench_fleet.py [FLIGHTS]
pair`` ends behind one and two workers, some ten minutes for 500 flights. ``bench_fleet.py FLIGHTS stages`` tells what
one process spends on a flight, by stage, with everything and with results alone, and results alone of flights with an
INS; a limit beside them is what compiled loops and Parquet take of it. With ``--pdf`` behind them PDFs are written too.
"""

import filecmp
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from unittest import mock

import psutil
from pyarrow import parquet

from benchmarks.record import Book, Goal
from groundstation.base.machine_code import Linked
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.synthesis import simulate_to

COMMAND = [sys.executable, "-m", "groundstation"]
PDF = [one for one in sys.argv[1:] if one == "--pdf"]
FLIGHTS, DAMAGED_SHARE, AIRCRAFT = 500, 0.03, 5
ONE_GOAL, TWO_GOAL = Goal(300.0), Goal(1.9, "at least")  # of 500 flights; of two workers
# Of results alone on one core: 500 flights in 120 s, and what NGAFID's baseline takes of a short flight
ALONE_GOAL, INS_GOAL = Goal(0.24), Goal(0.3)
INS_SCENARIO = "ins-fleet"
SCENARIOS = ("taxi-good", "taxi-short", "taxi-drift")
KILLS, FLIGHTS_KILLED = 10, 20
IDENTICAL = {".html", ".pdf", ".csv"}
IDENTICAL_NAMES = {"summary.json", "index.json"}


def make_logs(folder: Path, flights: int) -> int:
    """Simulate flights of several aircraft over a year, 3 % of them cut, flipped or emptied; bytes of all."""
    folder.mkdir()
    rng = random.Random(3)
    damaged = set(rng.sample(range(flights), round(DAMAGED_SHARE * flights)))
    for number in range(flights):
        (path,) = simulate_to(SCENARIOS[number % len(SCENARIOS)], folder / "new", seed=number, force=True)[:1]
        start = datetime(2025, 1, 1, 6, tzinfo=UTC) + timedelta(days=365.0 * number / flights)
        told = {"aircraft": f"A-{number % AIRCRAFT}", "flight": number, "start_utc": f"{start:%Y-%m-%dT%H:%M:%SZ}"}
        lines = path.read_text().splitlines(keepends=True)
        lines = [line for line in lines if line.split(":")[0].removeprefix("# ") not in told]
        data = bytearray("".join([*(f"# {key}: {value}\n" for key, value in told.items()), *lines]).encode())
        if number in damaged:
            data = harmed(data, number % 3, rng)
        (folder / f"{number:05d}.csv").write_bytes(data)
        path.unlink()
    (folder / "new").rmdir()
    return sum(path.stat().st_size for path in folder.iterdir())


def harmed(data: bytearray, kind: int, rng: random.Random) -> bytearray:
    """A log that is cut, has flipped bits, or is empty."""
    if kind == 0:
        return data[: rng.randrange(len(data))]
    if kind == 1:
        for _ in range(200):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return data
    return bytearray()


def timed(arguments: list[str]) -> tuple[float, float, str]:
    """Wall seconds of a run, peak resident MB of its largest process, and its last line."""
    with tempfile.TemporaryFile() as told:
        started = time.perf_counter()
        process = psutil.Popen([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=told)
        peak = 0
        while process.poll() is None:
            peak = max(peak, largest_bytes(process))
            time.sleep(0.2)
        seconds = time.perf_counter() - started
        told.seek(0)
        return seconds, peak / 1e6, told.read().decode().strip().splitlines()[-1]


def stages(book: Book, logs: Path, root: Path, flights: int) -> None:
    """Record processor seconds a flight by stage, in this process alone: everything, then results alone."""
    simulate_to(INS_SCENARIO, root / "ins")
    of_ins = sorted(path for path in (root / "ins").glob("*.csv") if "truth" not in path.name)
    shown = {"with_pdf": bool(PDF)}
    by_stage(book, f"one of {flights} flights, everything", [logs], root / "everything", shown)
    what, alone = "flights, results alone", {"only_results": True}
    by_stage(book, f"one of {flights} {what}", [logs], root / "alone", alone, ALONE_GOAL)
    by_stage(book, f"one of {len(of_ins)} {INS_SCENARIO} {what}", of_ins, root / "of_ins", alone, INS_GOAL)


def by_stage(
    book: Book, what: str, logs: list[Path], out: Path, options: dict[str, bool], goal: Goal | None = None
) -> None:
    """Record processor seconds a flight of a run, by stage, and what of it no Python can save."""
    spent: Counter[str] = Counter()
    in_loops, in_parquet = measured(Linked.__call__), measured(parquet.write_table)
    started = time.process_time()
    with (
        mock.patch("time.perf_counter", time.process_time),  # what outcomes tell is then processor time
        mock.patch.object(Linked, "__call__", in_loops),
        mock.patch.object(parquet, "write_table", in_parquet),
    ):
        done = run_many(logs, out, Configuration(), jobs=1, **options)
    whole_s = time.process_time() - started
    for outcome in done:
        spent.update(outcome.times_s)
    spent["beside the flights"] = whole_s - sum(spent.values())
    book.figure(what, whole_s / len(done), "s", goal=goal)
    for stage, seconds in spent.items():
        book.figure(f"{what}: {stage}", seconds / len(done), "s")
    least = sum(in_loops.seconds) + sum(in_parquet.seconds)
    book.figure(f"limit: compiled loops and Parquet, {what}", least / len(done), "s")


def measured(function: Callable[..., Any]) -> Any:
    """Return a function that keeps the processor seconds of its calls in ``seconds``.

    They are those of the thread that calls: two loops at once would count each other's.
    """

    def timed_one(*arguments: Any, **options: Any) -> Any:
        begin = time.thread_time()
        try:
            return function(*arguments, **options)
        finally:
            seconds.append(time.thread_time() - begin)

    seconds: list[float] = []
    timed_one.seconds = seconds  # type: ignore[attr-defined]
    return timed_one


def largest_bytes(process: psutil.Process) -> int:
    """Resident bytes of the largest of a process and its children."""
    sizes = []
    for one in (process, *process.children(recursive=True)):
        try:
            sizes.append(one.memory_info().rss)
        except psutil.Error:
            continue
    return max(sizes, default=0)


def different(one: Path, other: Path) -> list[str]:
    """Files of two runs that are promised identical and are not."""
    names = [
        {
            str(path.relative_to(folder))
            for path in folder.rglob("*")
            if path.is_file() and (path.suffix in IDENTICAL or path.name in IDENTICAL_NAMES)
        }
        for folder in (one, other)
    ]
    common = sorted(names[0] & names[1])
    _same, changed, broken = filecmp.cmpfiles(one, other, common, shallow=False)
    return sorted([*(names[0] ^ names[1]), *changed, *broken])


def kills(logs: Path, out: Path) -> None:
    """Kill a run at random moments, and continue it each time until it ends."""
    rng = random.Random(5)
    command = [*COMMAND, "run", str(logs), "-o", str(out), "-j", "2", "-q", *PDF]
    for _ in range(KILLS):
        process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(2.0, 9.0))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=False, stderr=subprocess.DEVNULL)


def main() -> None:
    """Measure and record."""
    flights = next((int(one) for one in sys.argv[1:] if one.isdigit()), FLIGHTS)
    with Book("fleet") as book, tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        size = make_logs(root / "logs", flights)
        if "stages" in sys.argv[1:]:
            stages(book, root / "logs", root, flights)
            return
        workers(book, root, f"{flights} flights of {size / 1e6:.0f} MB, {DAMAGED_SHARE:.0%} damaged", flights)


def workers(book: Book, root: Path, what: str, flights: int) -> None:
    """Record runs with one and two workers, a cluster, and runs that were killed."""
    logs, seconds = str(root / "logs"), {}
    for jobs in (1, 2):
        arguments = ["run", logs, "-o", str(root / f"j{jobs}"), "-j", str(jobs), *PDF]
        seconds[jobs], peak_mb, told = timed(arguments)
        goal = ONE_GOAL if jobs == 1 and flights == FLIGHTS else None
        book.figure(f"{what}, -j {jobs}", seconds[jobs], "s by the clock", goal=goal, note=told)
        book.figure(f"{what}, -j {jobs}, largest process", peak_mb, "MB")
    same = different(root / "j1", root / "j2")
    note = f"differ: {', '.join(same[:5])}" if same else "files identical"
    book.figure(f"{what}, two workers", seconds[1] / seconds[2], "times as fast as one", goal=TWO_GOAL, note=note)
    if "pair" in sys.argv[1:]:
        return
    again, _peak, _told = timed(["run", logs, "-o", str(root / "j2"), "-j", "2", *PDF])
    book.figure(f"{what}, again, nothing to do", again, "s by the clock")
    if book.has("distributed"):
        from distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            command = ["run", logs, "-o", str(root / "dask"), "--scheduler", cluster.scheduler_address, *PDF]
            dask_s, _peak, _told = timed(command)
        same = different(root / "dask", root / "j2")
        note = f"differ: {', '.join(same[:5])}" if same else "files identical"
        book.figure(f"{what}, Dask with two workers", dask_s / seconds[2], "of -j 2", note=note)
    few = root / "few"
    few.mkdir()
    for path in sorted((root / "logs").iterdir())[:FLIGHTS_KILLED]:
        (few / path.name).write_bytes(path.read_bytes())
    timed(["run", str(few), "-o", str(root / "whole"), "-j", "2", *PDF])
    kills(few, root / "killed")
    count = len(different(root / "whole", root / "killed"))
    killed = f"{FLIGHTS_KILLED} flights, {KILLS} times killed and continued: files that differ"
    book.figure(killed, float(count), "files", goal=Goal(0.0))


if __name__ == "__main__":
    main()
