"""Where the processor time of each verb goes, and the limits beside it.

Each verb runs as a user types it, in a process of its own (benchmarks/sampler.py): the share of imports, reading,
ledger, MCAP, tables, estimating, saving, recording, page, and of the threads beside the main one (compressing, Rerun).
What is left is the interpreter's start and end. Limits of the same log: the bare interpreter, bare imports, SHA-256,
zstd alone on the same chunks, a copy in memory, writing the MCAP to the disk.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.bench_memory import flight_csv
from benchmarks.least import chunks_of, compress
from benchmarks.record import ROUNDS, Book, by_turns
from benchmarks.recorded import LOGS, are_here
from groundstation.pipeline.verbs.provenance import CHECKOUT

SAMPLER = CHECKOUT / "benchmarks" / "sampler.py"
FEW_ROUNDS = 3
HOUR_ROWS = 360_000  # 100 Hz
ANSWERS = (0, 3, 4)  # exit codes: done, data lost, a limit reached
LOGS_OF = {
    "small CSV": CHECKOUT / "sample_logs" / "taxi-good.csv",
    "ULog": LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg",
    "DataFlash": LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN",
}
WORDS = {
    "imports": "imports",
    "readers": "reading",
    "integrity": "ledger",
    "store": "MCAP",
    "tables": "tables",
    "systems": "estimating",
    "methods": "estimating",
    "results": "saving",
    "viewer": "recording",
    "chapters": "page",
    "plots": "page",
    "reports": "page",
    "exports": "page",
    "simulation": "simulation",
    "pipeline": "between the rooms",
    "_threads": "other threads",
}


def verbs_of(log: Path, out: Path) -> dict[str, list[str]]:
    """Return the commands that are measured, in their order: report needs what run made."""
    return {
        "info": ["info", str(log)],
        "check": ["check", str(log)],
        "check --for": ["check", str(log), "--for", "heading"],
        "convert": ["convert", str(log), "-q", "--force", "-o", str(out / "x.mcap")],
        "run": ["run", str(log), "-q", "--redo", "-o", str(out / "run")],
        "report": ["report", str(out / "run")],
    }


def sampled(command: list[str], told: Path) -> tuple[float, dict[str, float]]:
    """Return processor seconds of a verb's process, and those of each stage."""
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen([sys.executable, str(SAMPLER), str(told), *command], stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in ANSWERS:
            said.seek(0)
            raise SystemExit(f"{' '.join(command)}: {said.read().decode(errors='replace')[-300:]}")
    whole_s = usage.ru_utime + usage.ru_stime
    stages: dict[str, float] = {}
    for room, seconds in json.loads(told.read_text(encoding="utf-8")).items():
        word = WORDS.get(room, room)
        stages[word] = stages.get(word, 0.0) + seconds
    stages["start and end"] = max(whole_s - sum(stages.values()), 0.0)
    return whole_s, stages


def shares_told(stages: dict[str, float], whole_s: float) -> str:
    """Return stages as one line, the longest first; those below one percent left out.

    Examples
    --------
    >>> shares_told({"ledger": 0.25, "imports": 0.75, "page": 0.001}, 1.0)
    'imports 0.75 s (75 %), ledger 0.25 s (25 %)'
    """
    ordered = sorted(stages.items(), key=lambda one: -one[1])
    shown = [(stage, seconds) for stage, seconds in ordered if seconds >= 0.01 * whole_s]
    return ", ".join(f"{stage} {seconds:.2g} s ({100.0 * seconds / whole_s:.0f} %)" for stage, seconds in shown)


def profile(book: Book, name: str, log: Path, folder: Path) -> None:
    """Record each verb on a log."""
    what = f"{name} of {log.stat().st_size / 1e6:.2g} MB"
    for verb, command in verbs_of(log, folder).items():
        sampled(command, folder / "told.json")  # compiles
        runs = [sampled(command, folder / "told.json") for _ in range(min(ROUNDS, FEW_ROUNDS))]
        whole_s, stages = sorted(runs, key=lambda one: one[0])[len(runs) // 2]
        book.figure(f"{verb}, {what}", [one for one, _ in runs], "s", note=shares_told(stages, whole_s))
    limits(book, what, log, folder)


def limits(book: Book, what: str, log: Path, folder: Path) -> None:
    """Record what bounds a log's verbs."""
    data, mcap = log.read_bytes(), folder / "x.mcap"
    chunks, written = chunks_of(mcap), mcap.read_bytes()
    works: dict[str, Callable[[], object]] = {
        "SHA-256": lambda: hashlib.sha256(data).digest(),
        "copy in memory": lambda: bytearray(data),
        f"zstd alone on {sum(map(len, chunks)) / 1e6:.2g} MB of messages": lambda: compress(chunks),
    }
    for name, times in by_turns(works, ROUNDS).items():
        book.figure(f"limit: {name}, {what}", times.processor_s, "s")
    seconds = [write_s(folder / "written", written) for _ in range(min(ROUNDS, FEW_ROUNDS))]
    book.figure(f"limit: {len(written) / 1e6:.2g} MB to the disk, {what}", seconds, "s by the clock")


def write_s(path: Path, data: bytes) -> float:
    """Return the seconds until a new file is on the disk."""
    started = time.perf_counter()
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    return time.perf_counter() - started


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", nargs="*", default=[*LOGS_OF, "hour at 100 Hz"], help="of these alone")
    options = parser.parse_args()
    with Book("verbs") as book:
        starts = {"bare interpreter": "pass", "bare imports of numpy and pyarrow": "import numpy, pyarrow"}
        works = {
            name: lambda code=code: subprocess.run([sys.executable, "-c", code], check=True)  # type: ignore[misc]
            for name, code in starts.items()
        }
        for name, times in by_turns(works, ROUNDS).items():
            book.figure(f"limit: {name}", times.processor_s, "s")
        for name in options.logs:
            with tempfile.TemporaryDirectory() as folder:
                log = LOGS_OF.get(name, Path(folder) / "hour.csv")
                if name not in LOGS_OF:
                    flight_csv(log, HOUR_ROWS)
                elif not are_here(log):
                    book.not_measured(name, "no recorded log")
                    continue
                profile(book, name, log, Path(folder))


if __name__ == "__main__":
    main()
