"""Whole processes, as a user types them: our verbs on logs of each format and size, beside the commands of peers.

Every command is a new process; its wall seconds and its processor seconds (user and system) are those that the
operating system counted. Commands of one log take turns, so that what else the machine does slows all alike.
``--against FOLDER`` measures another checkout of the package beside this one.
``--cold`` adds the first run on a new machine: nothing compiled yet.

Logs are a recorded or simulated one: its beginning for the small, its data repeated, times going on, for the long.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.bench_memory import ROOT, repeated_csv, repeated_dataflash, repeated_ulog
from benchmarks.record import ROUNDS, Book, Goal, Times
from benchmarks.recorded import LOGS, are_here
from groundstation.base.units import NS_PER_S

IMPORTS = "bare imports of numpy and pyarrow"
# What no conversion does without: of a table, and of any other log.
NEEDED = "import numpy, typer, mcap.records, zstandard, lz4.frame, google.protobuf.descriptor_pb2"
NEEDED_OF_TABLES = f"{NEEDED}, pyarrow.csv, pyarrow.compute"
SMALL_GOAL, DATAFLASH_GOAL, ULOG_GOAL = Goal(2.5), Goal(3.2), Goal(1.3)
SIZES_KB = (20, 2_000, 15_000)  # and 60_000 by --sizes-kb
SMALL_BYTES, LARGE_BYTES = 100_000, 5_000_000
VERBS = ("info", "check", "convert")
WHOLE_VERBS = ("run", "report", "view")  # minutes for a long log: asked for by name; report and view need the run
SOURCES: dict[str, tuple[Path, Callable[[Path, Path, int], None]]] = {
    "csv": (ROOT / "sample_logs" / "taxi-good.csv", repeated_csv),
    "ulg": (LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg", repeated_ulog),
    "BIN": (LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN", repeated_dataflash),
}
READ_CSV = "import sys, pandas; pandas.read_csv(sys.argv[1], comment='#')"
PARSE_ULOG = "import sys; from pyulog import ULog; ULog(sys.argv[1])"
VIEW = """
import sys
import groundstation.viewer.launch as launch
launch.open_viewer = lambda *_, **__: 0  # the viewer itself is Rerun's
from groundstation.cli.main import main
sys.argv[1:] = ["view", sys.argv[1], "--web"]
main()
"""
API = "import sys, groundstation; groundstation.open(sys.argv[1])"


@dataclass
class Timed:
    """A command and what its runs took, wall and processor seconds."""

    name: str
    command: list[str]
    environment: dict[str, str]
    runs: list[tuple[float, float]] = field(default_factory=list)
    why_not: str = ""

    def run(self) -> None:
        """Run it once and keep the times; codes up to 3 are answers (3: data lost)."""
        with tempfile.TemporaryFile() as said:
            started = time.perf_counter_ns()
            # Elsewhere: Python would import the package from the folder it is started in.
            process = subprocess.Popen(self.command, stdout=said, stderr=said, env=self.environment, cwd="/")
            _, status, usage = os.wait4(process.pid, 0)
            wall_s = (time.perf_counter_ns() - started) / NS_PER_S
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode not in (0, 3):
                said.seek(0)
                self.why_not = f"code {process.returncode}: {said.read().decode(errors='replace').strip()[-100:]}"
        self.runs.append((wall_s, usage.ru_utime + usage.ru_stime))

    @property
    def times(self) -> Times:
        """Seconds of its runs."""
        return Times(tuple(processor for _, processor in self.runs), tuple(wall for wall, _ in self.runs))


def make_log(suffix: str, size_kb: int, folder: Path) -> Path | None:
    """A log of about a size; None where the recorded one is absent."""
    source, repeat = SOURCES[suffix]
    if not are_here(source):
        return None
    target = folder / f"log_{size_kb}.{suffix}"
    if size_kb * 1_000 >= 0.9 * source.stat().st_size:
        repeat(source, target, size_kb * 1_000)
    else:
        beginning = source.read_bytes()[: size_kb * 1_000]
        target.write_bytes(beginning[: beginning.rindex(b"\n") + 1] if suffix == "csv" else beginning)
    return target


def environment_of_all() -> dict[str, str]:
    """The environment as of a user, whose modules are compiled once and not in every process.

    numpy's BLAS starts no threads: on some machines they spin while it is imported, and every side has them.
    """
    usual = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return usual | {"OPENBLAS_NUM_THREADS": "1"}


def peers(log: Path, out: Path) -> Iterator[tuple[str, list[str]]]:
    """Commands of peers on a log; those that are not installed are left out."""
    if log.suffix == ".csv":
        yield "pandas.read_csv", [sys.executable, "-c", READ_CSV, str(log)]
    elif log.suffix == ".ulg":
        yield "pyulog: parse", [sys.executable, "-c", PARSE_ULOG, str(log)]
        yield "ulog_info", ["ulog_info", str(log)]
        yield "ulog2csv", ["ulog2csv", "-o", str(out), str(log)]
    elif log.suffix == ".BIN":
        yield "mavlogdump.py --types GPS", ["mavlogdump.py", "--types", "GPS", str(log)]
    else:
        yield "mcap info", ["mcap", "info", str(log)]


def commands(log: Path, work: Path, verbs: list[str], against: Path | None, *, is_alone: bool) -> list[Timed]:
    """What is run on a log: our verbs, the same of another checkout, the peers' unless ours are alone."""
    found = []
    for label, root in (("groundstation", ROOT), *([("against", against)] if against else [])):
        environment = environment_of_all() | {"PYTHONPATH": str(root)}
        ours = [sys.executable, "-m", "groundstation"]
        for verb in verbs:
            target = str(work / f"{label}_{verb}")
            written = {"convert": ["--force", "-q", "-o", f"{target}.mcap"], "run": ["--redo", "-q", "-o", target]}
            if verb == "convert" and log.suffix == ".mcap":
                continue
            place = str(work / f"{label}_run")
            if verb == "view":
                for name, what in (("LOG", str(log)), ("OUT", place)):
                    found.append(Timed(f"{label} view {name}", [sys.executable, "-c", VIEW, what], environment))
                continue
            what = place if verb == "report" else str(log)
            found.append(Timed(f"{label} {verb}", [*ours, verb, what, *written.get(verb, [])], environment))
        found.append(Timed(f"{label}.open(log)", [sys.executable, "-c", API, str(log)], environment))
    for name, command in () if is_alone else peers(log, work):
        program = shutil.which(command[0], path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
        if program is None:
            print(f"  {name}: {command[0]} is not installed, left out")
        else:
            found.append(Timed(name, [program, *command[1:]], environment_of_all()))
    return found


def measure(book: Book, what: str, log: Path, options: argparse.Namespace) -> None:
    """Run all commands on a log by turns and record their medians, beside what bounds them."""
    with tempfile.TemporaryDirectory() as folder:
        timed = commands(log, Path(folder), options.verbs, options.against, is_alone=options.no_peers)
        bare = Timed(IMPORTS, [sys.executable, "-c", "import numpy, pyarrow"], environment_of_all())
        needed = Timed(
            "limit: imports of other packages that convert needs",
            [sys.executable, "-c", NEEDED_OF_TABLES if log.suffix == ".csv" else NEEDED],
            environment_of_all(),
        )
        timed += [bare, needed]
        if options.cold:
            for one in timed:
                cold = Timed(f"{one.name}, cold", one.command, {**one.environment, "NUMBA_CACHE_DIR": f"{folder}/new"})
                if one.environment.get("PYTHONPATH"):
                    shutil.rmtree(f"{folder}/new", ignore_errors=True)
                    cold.run()
                    book.figure(f"{cold.name}, {what}", cold.times.processor_s, "s")
        for turn in range(options.rounds + 1):
            for one in timed:
                one.run()
                if turn == 0:
                    one.runs.clear()  # filled the caches
    for one in timed:
        if one.why_not:
            book.not_measured(f"{one.name}, {what}", one.why_not)
        elif one is not bare:
            goal = goal_of(one.name, log)
            book.against(f"{one.name}, {what}", one.times, bare.times, IMPORTS, goal=goal)
    parse = next((one for one in timed if one.name == "pyulog: parse" and not one.why_not), None)
    ours = next((one for one in timed if one.name == "groundstation convert" and not one.why_not), None)
    if parse is not None and ours is not None and log.stat().st_size > LARGE_BYTES:
        given = {"distribution": "pyulog", "goal": ULOG_GOAL, "by_clock": True}
        book.against(f"groundstation convert, {what}", ours.times, parse.times, "process with pyulog's parse", **given)


def goal_of(name: str, log: Path) -> Goal | None:
    """Return the goal of a command, of bare imports."""
    size = log.stat().st_size
    if name != "groundstation convert" or size > LARGE_BYTES:
        return None
    return SMALL_GOAL if size < SMALL_BYTES else DATAFLASH_GOAL if log.suffix == ".BIN" else None


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--formats", nargs="+", default=[*SOURCES, "mcap"], metavar="SUFFIX")
    parser.add_argument("--sizes-kb", nargs="+", type=int, default=SIZES_KB, metavar="KB")
    parser.add_argument("--verbs", nargs="+", default=list(VERBS), help=f"of {', '.join((*VERBS, *WHOLE_VERBS))}")
    parser.add_argument("--no-peers", action="store_true", help="our verbs alone")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--cold", action="store_true", help="also with nothing compiled")
    parser.add_argument(
        "--against", type=lambda text: Path(text).resolve(), help="another checkout, measured beside this one"
    )
    options = parser.parse_args()
    with Book("process") as book, tempfile.TemporaryDirectory() as folder:
        for suffix in options.formats:
            for size_kb in options.sizes_kb:
                log = make_log("csv" if suffix == "mcap" else suffix, size_kb, Path(folder))
                if log is None:
                    book.not_measured(f".{suffix}", "no recorded log")
                    break
                if suffix == "mcap":
                    target, csv = log.with_suffix(".mcap"), log
                    command = [sys.executable, "-m", "groundstation", "convert", str(csv), "-q", "-o", str(target)]
                    subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True)
                    csv.unlink()
                    log = target
                measure(book, f".{suffix} of {size_kb} kB", log, options)
                log.unlink()


if __name__ == "__main__":
    main()
