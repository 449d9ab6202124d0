"""`run` on one hour at 100 Hz: seconds, by stage, peak memory, and compile time apart; ``--pdf``: with PDFs."""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.record import ROUNDS, Book, Goal

COMMAND = [sys.executable, "-m", "groundstation"]
CLOCK_GOAL, MEMORY_GOAL = Goal(4.0), Goal(450.0)
FEW_ROUNDS = 3
# What no run does without: the packages, the cells of the log as numbers, and the loops over them.
PACKAGES = (
    "import numpy, typer, pyarrow.csv, pyarrow.compute, pyarrow.parquet, scipy.special, zstandard, mcap.records, "
    "google.protobuf.descriptor_pb2, cattrs, jinja2, llvmlite.binding, rerun.blueprint"
)
CELLS = """
import sys
from itertools import takewhile
import pyarrow.csv
above = sum(1 for _ in takewhile(lambda line: line.startswith("#"), open(sys.argv[1])))
pyarrow.csv.read_csv(sys.argv[1], read_options=pyarrow.csv.ReadOptions(skip_rows=above))
"""
LOOPS = """
import sys, time
from groundstation.base import machine_code
from groundstation.cli.main import main
call, spent_s = machine_code.Linked.__call__, []
def timed(loop, *arguments):
    begin = time.thread_time()
    try:
        return call(loop, *arguments)
    finally:
        spent_s.append(time.thread_time() - begin)
machine_code.Linked.__call__ = timed
sys.argv[1:] = ["run", sys.argv[1], "-o", sys.argv[2], "--redo", "-q"]
try:
    main()
finally:
    print(f"loops {sum(spent_s):.4f} first {time.thread_time():.4f}")
"""


class Run:
    """One `run` in a process of its own: its seconds, its peak memory, and the stages it tells of."""

    def __init__(self, log: Path, out: Path, cache: Path, options: list[str]) -> None:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
        with tempfile.TemporaryFile() as said:
            started = time.perf_counter()
            command = [*COMMAND, "run", str(log), "-o", str(out), "--redo", "-v", *options]
            process = subprocess.Popen(command, stdout=said, stderr=said, env=environment)
            _, status, usage = os.wait4(process.pid, 0)
            self.clock_s = time.perf_counter() - started
            process.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            text = said.read().decode(errors="replace")
        if process.returncode:
            raise SystemExit(f"run ended with {process.returncode}: {text[-300:]}")
        self.processor_s, self.peak_mb = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
        self.stages = {name.strip(): float(told) for name, told in re.findall(r"([a-z A-Z]+) ([0-9.]+) s\b", text)}


def limits(book: Book, what: str, log: Path, root: Path) -> None:
    """Record what bounds a run, in processor time: packages, the log's cells as numbers, compiled loops; their sum.

    By the clock no run takes less than its first thread works: the second core has imports, compressing and half the
    draws of the heading, and Python lets one thread at a time through.
    """
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(root / "cache")}
    figures: dict[str, list[float]] = {
        "imports of other packages": [],
        "its cells by pyarrow": [],
        "compiled loops": [],
    }
    first_s: list[float] = []
    for _ in range(min(ROUNDS, FEW_ROUNDS)):
        packages_s = _processor_s(PACKAGES, environment)
        figures["imports of other packages"].append(packages_s)
        figures["its cells by pyarrow"].append(_processor_s(f"{PACKAGES}{CELLS}", environment, str(log)) - packages_s)
        command = [sys.executable, "-c", LOOPS, str(log), str(root / "loops")]
        told = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
        loops_s, _, first_thread_s = told.rpartition("loops ")[2].split()
        figures["compiled loops"].append(float(loops_s))
        first_s.append(float(first_thread_s))
    for name, seconds in figures.items():
        book.figure(f"limit: {name}, {what}", seconds, "s")
    book.figure(f"limit by the clock: what its first thread works, {what}", first_s, "s")
    book.figure(f"limit: these together, {what}", [sum(each) for each in zip(*figures.values(), strict=True)], "s")


def _processor_s(code: str, environment: dict[str, str], *arguments: str) -> float:
    """Return the processor seconds of a process that runs some code."""
    process = subprocess.Popen([sys.executable, "-c", code, *arguments], env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"the limit's code ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Record seconds with an empty and with a filled compile cache, stages, file sizes and peak memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pdf", action="store_true")
    options = ["--pdf"] if parser.parse_args().pdf else []
    with Book("run") as book, tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        subprocess.run([*COMMAND, "simulate", "hour-100hz", "-o", str(root / "log")], check=True, capture_output=True)
        log = next((root / "log").glob("*.csv"))
        cold = Run(log, root / "cold", root / "cache", options)
        runs = [Run(log, root / "warm", root / "cache", options) for _ in range(min(ROUNDS, FEW_ROUNDS))]
        what = f"run of the hour at 100 Hz ({log.stat().st_size / 1e6:.0f} MB of CSV){', with PDF' if options else ''}"
        book.figure(what, [one.processor_s for one in runs], "s")
        book.figure(f"{what}, by the clock", [one.clock_s for one in runs], "s", goal=CLOCK_GOAL)
        book.figure(f"{what}, peak memory", [one.peak_mb for one in runs], "MB", goal=MEMORY_GOAL)
        book.figure(f"{what}, what the first run compiles", cold.processor_s - runs[0].processor_s, "s")
        for stage in runs[0].stages:
            seconds = [one.stages[stage] for one in runs if stage in one.stages]
            book.figure(f"{what}: {stage}", seconds, "s by the clock")
        limits(book, what, log, root)
        for path in sorted((root / "warm").rglob("*")):
            if path.suffix in (".mcap", ".rrd", ".html") and path.parent.parent == root / "warm":
                book.figure(f"{what}: {path.suffix[1:]} written", path.stat().st_size / 1e6, "MB")


if __name__ == "__main__":
    main()
