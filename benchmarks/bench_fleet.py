"""Many flights: one and two worker processes, a Dask cluster beside them, memory of a worker, killed runs continued.

``bench_fleet.py [FLIGHTS]``, 500 without it: wall seconds; other programs slow all of them. ``bench_fleet.py FLIGHTS
stages`` tells what one process spends on a flight, by stage, with everything and with results alone. With ``--pdf``
behind them PDFs are written too.
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
from datetime import UTC, datetime, timedelta
from pathlib import Path
from unittest import mock

import psutil
from distributed import LocalCluster

from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.synthesis import simulate_to

COMMAND = [sys.executable, "-m", "groundstation"]
PDF = [one for one in sys.argv[1:] if one == "--pdf"]
FLIGHTS, DAMAGED_SHARE, AIRCRAFT = 500, 0.03, 5
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


def stages(logs: Path, root: Path, flights: int) -> None:
    """Print processor seconds a flight by stage, in this process alone: everything, then results alone."""
    for name, only_results in (("everything", False), ("results alone", True)):
        started = time.process_time()
        with mock.patch("time.perf_counter", time.process_time):  # what outcomes tell is then processor time
            whole = {"only_results": True} if only_results else {"with_pdf": bool(PDF)}
            done = run_many([logs], root / name, Configuration(), jobs=1, **whole)
        whole_s = time.process_time() - started
        spent: Counter[str] = Counter()
        for outcome in done:
            spent.update(outcome.times_s)
        spent["beside the flights"] = whole_s - sum(spent.values())
        told = ", ".join(f"{stage} {seconds / flights:.3f}" for stage, seconds in spent.items())
        print(f"{name}: {whole_s / flights:.2f} s of processor time a flight: {told}", flush=True)


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


def kills(logs: Path, whole: Path, root: Path) -> str:
    """Kill a run at random moments, continue it each time, and compare it with one that was left alone."""
    rng = random.Random(5)
    out = root / "killed"
    command = [*COMMAND, "run", str(logs), "-o", str(out), "-j", "2", "-q", *PDF]
    for _ in range(KILLS):
        process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(2.0, 9.0))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=False, stderr=subprocess.DEVNULL)
    changed = different(whole, out)
    return "identical" if not changed else f"{len(changed)} files differ: {', '.join(changed[:5])}"


def main() -> None:
    """Print all figures."""
    flights = next((int(one) for one in sys.argv[1:] if one.isdigit()), FLIGHTS)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        size = make_logs(root / "logs", flights)
        print(f"{flights} flights, {size / 1e6:.0f} MB, {DAMAGED_SHARE:.0%} damaged", flush=True)
        if "stages" in sys.argv[2:]:
            stages(root / "logs", root, flights)
            return
        seconds = {}
        for jobs in (1, 2):
            arguments = ["run", str(root / "logs"), "-o", str(root / f"j{jobs}"), "-j", str(jobs), *PDF]
            seconds[jobs], peak_mb, told = timed(arguments)
            print(f"-j {jobs}    {seconds[jobs]:7.1f} s, largest process {peak_mb:.0f} MB; {told}", flush=True)
        print(f"two workers {seconds[1] / seconds[2]:.2f} times as fast as one, 1.8 wanted")
        print(f"-j 1 and -j 2: {different(root / 'j1', root / 'j2') or 'identical'}", flush=True)
        again, _peak, _told = timed(["run", str(root / "logs"), "-o", str(root / "j2"), "-j", "2", *PDF])
        print(f"again   {again:7.1f} s, nothing to do", flush=True)
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            arguments = [
                "run",
                str(root / "logs"),
                "-o",
                str(root / "dask"),
                "--scheduler",
                cluster.scheduler_address,
                *PDF,
            ]
            dask_s, _peak, _told = timed(arguments)
        print(f"Dask    {dask_s:7.1f} s with two workers, {dask_s / seconds[2]:.2f} of -j 2", flush=True)
        print(f"Dask and -j 2: {different(root / 'dask', root / 'j2') or 'identical'}", flush=True)
        few = root / "few"
        few.mkdir()
        for path in sorted((root / "logs").iterdir())[:FLIGHTS_KILLED]:
            (few / path.name).write_bytes(path.read_bytes())
        timed(["run", str(few), "-o", str(root / "whole"), "-j", "2", *PDF])
        print(f"{KILLS} times killed and continued, {FLIGHTS_KILLED} flights: {kills(few, root / 'whole', root)}")


if __name__ == "__main__":
    main()
