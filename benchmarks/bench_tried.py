"""Ways that were weighed for speed and not taken, each beside the way that was.

A preloaded server of workers beside spawned ones; Arrow IPC between the stages of a run beside the MCAP; numba's
parallel loops beside serial ones; the standard library's dataclasses beside ours; parts of numpy that a conversion
loads; another interpreter, named by ``OTHER_PYTHON`` (with the package installed), beside this one.
"""

import dataclasses
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from multiprocessing.context import BaseContext
from pathlib import Path

import numba
import numpy as np
import pyarrow as pa

from benchmarks.bench_memory import flight_csv
from benchmarks.bench_verbs import LOGS_OF
from benchmarks.record import ROUNDS, Book, by_turns
from benchmarks.recorded import are_here
from groundstation.base.dataclasses import dataclass as lazy_dataclass
from groundstation.base.records import RecordBatch
from groundstation.pipeline.many_flights.processes.workers import TASKS_PER_PROCESS
from groundstation.pipeline.verbs.provenance import CHECKOUT
from groundstation.store.reader import read
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.table import Flight

COMMAND = ["-m", "groundstation"]
SMALL = CHECKOUT / "sample_logs" / "taxi-good.csv"
# What a server may hold before it forks: no numba, no Arrow, no Rerun, whose threads a fork would freeze.
PRELOADED = ["numpy", "groundstation.pipeline.one_flight.job", "groundstation.pipeline.one_flight.convert"]
FEW_ROUNDS, HOUR_ROWS, DRAWS, EPOCHS, CLASSES = 3, 360_000, 40, 100_000, 500
ONE_IMPORT = re.compile(r"import time:\s+(\d+) \|\s+\d+ \|\s+(\S+)")


def work_of_a_worker() -> None:
    """Import what the first job of a worker needs."""
    import groundstation.pipeline.one_flight.convert
    import groundstation.pipeline.one_flight.job  # noqa: F401


def clock_of_a_worker(context: BaseContext) -> float:
    """Return seconds by the clock until a new worker has what its first job needs."""
    started = time.perf_counter()
    process = context.Process(target=work_of_a_worker)  # type: ignore[attr-defined]
    process.start()
    process.join()
    return time.perf_counter() - started


def workers(book: Book) -> None:
    """Record the start of a worker: spawned, and forked by a server that has loaded the package."""
    served = multiprocessing.get_context("forkserver")
    served.set_forkserver_preload(PRELOADED)
    sides = {"spawned": multiprocessing.get_context("spawn"), "forked by a preloaded server": served}
    for context in sides.values():
        clock_of_a_worker(context)  # starts the server
    seen: dict[str, list[float]] = {name: [] for name in sides}
    for _ in range(ROUNDS):
        for name, context in sides.items():
            seen[name].append(clock_of_a_worker(context))
    for name, seconds in seen.items():
        note = f"one in {TASKS_PER_PROCESS} flights" if name == "spawned" else ""
        book.figure(f"a worker is ready, {name}", seconds, "s by the clock", note=note)


def stages_by_arrow(book: Book, folder: Path) -> None:
    """Record how long the tables of an hour take from the MCAP, and from a file of Arrow IPC."""
    csv, mcap = folder / "hour.csv", folder / "hour.mcap"
    flight_csv(csv, HOUR_ROWS)
    subprocess.run([sys.executable, *COMMAND, "convert", str(csv), "-q", "-o", str(mcap)], check=True)
    flight = tables_of(mcap)
    paths = {}
    for topic, table in flight.tables.items():
        columns = {"time_ns": table.time_ns, **{name: one.values for name, one in table.columns.items()}}
        data = pa.table(columns)
        paths[topic] = folder / f"{topic}.arrow"
        with pa.OSFile(str(paths[topic]), "wb") as sink, pa.ipc.new_file(sink, data.schema) as writer:
            writer.write_table(data)

    def from_arrow() -> list[dict[str, np.ndarray]]:
        found = []
        for path in paths.values():
            with pa.memory_map(str(path)) as source:
                table = pa.ipc.open_file(source).read_all()
                found.append({name: table[name].to_numpy().copy() for name in table.column_names})
        return found

    works: dict[str, Callable[[], object]] = {
        "MCAP": lambda: tables_of(mcap),
        "Arrow IPC": from_arrow,
    }
    times = by_turns(works, min(ROUNDS, FEW_ROUNDS))
    note = f"beside the MCAP, which is written all the same: {sum(map(size_of, paths.values())) / 1e6:.3g} MB more"
    book.against(
        "tables of an hour at 100 Hz, from the MCAP", times["MCAP"], times["Arrow IPC"], "Arrow IPC", note=note
    )


def tables_of(mcap: Path) -> Flight:
    """Return the tables of an MCAP."""
    batches = (item for item in read(mcap) if isinstance(item, RecordBatch))
    return flight_from_batches(batches, metadata={}, has_utc=True, source_name=mcap.name)


def size_of(path: Path) -> int:
    """Return the bytes of a file."""
    return path.stat().st_size


def filtered(measured: np.ndarray, noises: np.ndarray, out: np.ndarray) -> None:
    """Filter one series by a random walk with many noises, a draw at a time."""
    for draw in numba.prange(len(noises)):
        state, variance = 0.0, 1.0
        for epoch in range(len(measured)):
            variance += noises[draw]
            gain = variance / (variance + 1.0)
            state += gain * (measured[epoch] - state)
            variance *= 1.0 - gain
        out[draw] = state


def parallel_loops(book: Book) -> None:
    """Record a loop over draws, compiled for one thread and for several: its compiling, and its run."""
    rng = np.random.default_rng(4)
    given = (np.cumsum(rng.normal(size=EPOCHS)), np.linspace(0.001, 1.0, DRAWS), np.zeros(DRAWS))
    compiled: dict[str, Callable[..., None]] = {}
    numba.njit(filtered)(*given)  # starts the compiler
    for name, parallel in (("one thread", False), ("several threads", True)):
        loop = numba.njit(filtered, parallel=parallel)
        started = time.process_time()
        loop(*given)
        book.figure(f"a loop over {DRAWS} draws for {name}: compiling", time.process_time() - started, "s")
        compiled[name] = loop
    times = by_turns({name: partial(loop, *given) for name, loop in compiled.items()})
    what = f"a loop over {DRAWS} draws of {EPOCHS} epochs for several threads"
    book.against(f"{what}, by the clock", times["several threads"], times["one thread"], "one thread", by_clock=True)
    book.against(what, times["several threads"], times["one thread"], "one thread")


def classes(book: Book) -> None:
    """Record what a dataclass costs that is defined and never used, and one that is used once."""
    makers = {"ours": lazy_dataclass, "standard": dataclasses.dataclass}
    for what, use in (("never used", False), ("used once", True)):
        times = by_turns({name: partial(defined, make, use=use) for name, make in makers.items()})
        told = f"{CLASSES} dataclasses of five fields, {what}"
        book.against(told, times["ours"], times["standard"], "dataclasses", is_times=True)


def defined(make: Callable[..., Callable[[type], type]], *, use: bool) -> None:
    """Define classes, and make an instance of each where they are used."""
    for _ in range(CLASSES):

        class Row:
            """A row."""

            a: int
            b: float = 1.0
            c: str = ""
            d: tuple[int, ...] = ()
            e: list[int] = dataclasses.field(default_factory=list)

        made = make(frozen=True)(Row)
        if use:
            made(1)


def numpy_parts(book: Book, folder: Path) -> None:
    """Record what a conversion imports of numpy beyond what ``import numpy`` does."""
    verb = [*COMMAND, "convert", str(SMALL), "-q", "--force", "-o", str(folder / "x.mcap")]
    beyond = []
    for _ in range(ROUNDS):
        bare, ours = (imports_of(arguments) for arguments in (["-c", "import numpy"], verb))
        beyond.append(1e-6 * sum(took for name, took in ours.items() if name.startswith("numpy.") and name not in bare))
    book.figure("parts of numpy that convert of a small CSV loads beyond bare numpy", beyond, "s by the clock")


def imports_of(arguments: list[str]) -> dict[str, int]:
    """Return microseconds of each import of a process, its own imports left out."""
    done = subprocess.run([sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True)
    return {name: int(took) for took, name in ONE_IMPORT.findall(done.stderr)}


def other_interpreter(book: Book, folder: Path) -> None:
    """Record verbs under another interpreter beside this one."""
    other = os.environ.get("OTHER_PYTHON", "")
    if not other:
        book.not_measured("verbs under another interpreter", "OTHER_PYTHON names none")
        return
    told = subprocess.run([*other.split(), "-VV"], capture_output=True, text=True, check=True).stdout.strip()
    sides = {"this": [sys.executable], "other": other.split()}
    logs = {"CSV of 20 kB": SMALL, "ULog of 14 MB": LOGS_OF["ULog"], "DataFlash of 2 MB": LOGS_OF["DataFlash"]}
    for name, log in logs.items():
        if not are_here(log):
            book.not_measured(f"convert, {name}, under another interpreter", "no recorded log")
            continue
        verb = [*COMMAND, "convert", str(log), "-q", "--force", "-o", str(folder / "x.mcap")]
        times = by_turns({side: partial(converted, [*start, *verb]) for side, start in sides.items()})
        book.against(f"convert, {name}, {told[:40]}", times["other"], times["this"], f"Python {sys.version.split()[0]}")


def converted(command: list[str]) -> None:
    """Run a conversion; code 3 is an answer, data lost."""
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{command[0]}: {done.stderr.decode(errors='replace')[-300:]}")


def main() -> None:
    """Measure and record."""
    with Book("tried") as book, tempfile.TemporaryDirectory() as folder:
        workers(book)
        stages_by_arrow(book, Path(folder))
        parallel_loops(book)
        classes(book)
        numpy_parts(book, Path(folder))
        other_interpreter(book, Path(folder))


if __name__ == "__main__":
    main()
