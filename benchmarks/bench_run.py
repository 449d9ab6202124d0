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
        for path in sorted((root / "warm").rglob("*")):
            if path.suffix in (".mcap", ".rrd", ".html") and path.parent.parent == root / "warm":
                book.figure(f"{what}: {path.suffix[1:]} written", path.stat().st_size / 1e6, "MB")


if __name__ == "__main__":
    main()
