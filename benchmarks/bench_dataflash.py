"""DataFlash to tables and to MCAP against pymavlink's recv_msg loop; a damaged log against a good one; peak memory.

The longer logs are the recorded one, its data repeated.
"""

import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.least import chunks_of, write_the_least
from benchmarks.record import ROUNDS, Book, Goal, Times, by_turns
from benchmarks.recorded import LOGS, are_here
from groundstation.base.records import RecordBatch
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.ordering import corrected
from groundstation.integrity.survey import survey
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers.dataflash import read
from groundstation.readers.dataflash.blocks import Scanner
from groundstation.readers.dataflash.values import rows_of
from groundstation.readers.source import Source
from groundstation.tables.assemble import flight_from_batches

LONG_BYTES = (14_000_000, 60_000_000)
REPEATS = 4  # of ours in each round
TABLES_GOAL, CONVERT_GOAL, DAMAGED_GOAL = Goal(25.0, "at least"), Goal(6.0, "at least"), Goal(1.5)
LONG_ROUNDS = 3


def repeated(source: Path, target: Path, size: int) -> None:
    """A long log: the records behind the definitions again and again, their times going on."""
    data = np.fromfile(source, np.uint8)
    blocks = list(Scanner(Source(source)))  # the file is one piece: offsets count from its start
    types, offsets = (np.concatenate([getattr(block, name) for block in blocks]) for name in ("types", "offsets"))
    first = int(offsets[np.flatnonzero(types == 128)[-1] + 1])
    body = data[first:].copy()
    places, last = [], 0
    for block in blocks:
        for definition, which in block.groups():
            if definition.time_field is not None:
                name, _unit = definition.time_field
                assert definition.dtype.fields is not None
                at = block.offsets[which][:, None] + definition.dtype.fields[name][1] + np.arange(4) - first
                places.append(at[at[:, 0] >= 0])
                last = max(last, int(body[at[-1]].view("<u4")[0]))
    index = np.concatenate(places)
    with target.open("wb") as stream:
        stream.write(data.tobytes())
        for repeat in range(1, size // len(body)):
            copy = body.copy()
            times = body[index].reshape(-1).view("<u4") + np.uint32(repeat * last)
            copy[index] = times.view(np.uint8).reshape(-1, 4)
            stream.write(copy.tobytes())


def damaged(source: Path, target: Path, seed: int = 1) -> None:
    """A copy with one bit in 5000 bytes flipped and one page in 100 overwritten by zeros."""
    rng = np.random.default_rng(seed)
    data = np.fromfile(source, np.uint8)
    at = rng.integers(10_000, len(data), len(data) // 5000)
    data[at] ^= (1 << rng.integers(0, 8, len(at))).astype(np.uint8)
    for page in rng.integers(10_000, len(data) - 4096, len(data) // 409_600):
        data[page : page + 4096] = 0
    data.tofile(target)


def to_tables(path: Path, *, is_surveyed: bool = True) -> int:
    """Read and make the tables of all topics, the clock repaired and a ledger made; returns the number of records."""
    items = list(read(Source(path)))
    clock, rows = ClockModel(has_times=True), Counter[str]()
    for item in items if not is_surveyed else ():
        if isinstance(item, RecordBatch):
            rows[item.topic] += len(item)
    if is_surveyed:
        found = survey(items)
        clock, rows = found.clock, Counter(found.ledger.rows)
    batches = corrected(items, clock, for_tables=True)
    flight = flight_from_batches(batches, metadata={}, has_utc=clock.is_absolute, source_name=path.name, rows=rows)
    return sum(len(table) for topic, table in flight.tables.items() if topic.startswith("raw."))


def least_work(path: Path) -> None:
    """Find the records, copy each of their fields once, and go once over its numbers.

    No canonical field is made and nothing is counted: tables with a ledger cannot take less in numpy.
    """
    for block in Scanner(Source(path)):
        for definition, which in block.groups():
            records = block.records(definition, which)
            for spec in definition.fields:
                values = np.ascontiguousarray(records[spec.name])
                if values.dtype.kind in "iuf" and values.ndim == 1:
                    np.maximum.reduce(values)


def raw_tables(path: Path) -> None:
    """Make the tables of the raw topics alone, with nothing counted: the second limit.

    Records are found, each field becomes a column in its unit, texts among them, and so do places and times; the
    columns are laid together, numbers gone over once and times twice.
    """
    parts: dict[str, list[list[np.ndarray]]] = {}
    for block in Scanner(Source(path)):
        for definition, which in block.groups():
            if definition.fields:
                rows = rows_of(definition, block.records(definition, which), block.first_index + which)
                columns = [column.values for column in rows.columns().values()]
                parts.setdefault(definition.name, []).append([rows.time_ns.values, rows.record_index, *columns])
    for several in parts.values():
        tables = [np.concatenate(pieces) for pieces in zip(*several, strict=True)]
        np.diff(tables[0]).max(initial=0)
        for values in tables:
            if values.dtype.kind in "iuf":
                np.maximum.reduce(values)


def surveyed(path: Path) -> None:
    """Do what convert does before it writes: read, make the ledger, bring the records in order of time."""
    items = list(read(Source(path)))
    for _batch in corrected(items, survey(items).clock):
        pass


def least_convert(path: Path, chunks: list[bytes], target: Path) -> None:
    """Do what convert does before it writes, then what no writer can leave out."""
    surveyed(path)
    write_the_least(chunks, target)


def by_pymavlink(path: Path, values: bool) -> int:
    """Take every message of a log; with its ``values``, or without a look at them."""
    from pymavlink.DFReader import DFReader_binary

    count = 0
    with DFReader_binary(str(path)) as reader:
        while (message := reader.recv_msg()) is not None:
            if values:
                message.to_dict()
            count += 1
    return count


def peak_mb(path: Path, work: str) -> float:
    """Peak resident memory of a process that reads a log (``read``) or converts it (``convert``)."""
    done = subprocess.run([sys.executable, __file__, work, str(path)], check=True, capture_output=True, text=True)
    return float(done.stdout)


def child(work: str, path: Path) -> None:
    """Do the work and print the peak memory of this process, MB."""
    if work == "read":
        for _item in read(Source(path)):
            pass
    elif work == "convert":
        convert_log(open_log(path), path.with_suffix(".mcap"))
    status = Path("/proc/self/status").read_text()  # a child's ru_maxrss begins at that of its parent
    print(int(re.search(r"VmHWM:\s*(\d+) kB", status)[1]) / 1024)  # type: ignore[index]


def new_each_time(work: Callable[[], object], written: Path) -> Callable[[], object]:
    """Return the work after its file is removed: to free the blocks of an old one takes time too."""

    def do() -> object:
        written.unlink(missing_ok=True)
        return work()

    return do


def report(book: Book, path: Path, folder: Path, rounds: int) -> None:
    """Record the figures of one log."""
    target, broken = folder / "x.mcap", folder / "broken.BIN"
    damaged(path, broken)
    convert_log(open_log(path), target)
    chunks = chunks_of(target)
    works: dict[str, Callable[[], object]] = {
        "read": lambda: list(read(Source(path))),
        "tables alone": lambda: to_tables(path, is_surveyed=False),
        "to tables": lambda: to_tables(path),
        "convert": new_each_time(lambda: convert_log(open_log(path), target), target),
        "broken": lambda: to_tables(broken),
        "least": lambda: least_work(path),
        "raw": lambda: raw_tables(path),
        "surveyed": lambda: surveyed(path),
        "least convert": lambda: least_convert(path, chunks, broken.with_name("least.mcap")),
    }
    repeats = dict.fromkeys(works, REPEATS)
    has_peer = book.has("pymavlink")
    if has_peer:
        works["bare"] = lambda: by_pymavlink(path, values=False)
        works["values"] = lambda: by_pymavlink(path, values=True)
    times = by_turns(works, rounds, repeats)
    log = f"DataFlash of {path.stat().st_size / 1e6:.0f} MB"
    if has_peer:
        beside_pymavlink(book, log, times)
    book.against(f"{log}, damaged, to tables", times["broken"], times["to tables"], "the good log", goal=DAMAGED_GOAL)
    base = peak_mb(path, "nothing")
    for work in ("read", "convert"):
        book.figure(f"peak memory, {log}, {work}", peak_mb(path, work), "MB", note=f"{base:.0f} MB of it the program")


def beside_pymavlink(book: Book, log: str, times: dict[str, Times]) -> None:
    """Record the figures beside the bare recv_msg loop, and beside the loop that reads its values."""
    for work, what, goal in (
        ("tables alone", "to tables without ledger", None),
        ("to tables", "to tables with ledger", TABLES_GOAL),
        ("convert", "to MCAP", CONVERT_GOAL),
        ("least", "limit: records found, fields copied and gone over once", None),
        ("raw", "limit: tables of raw topics alone, scaled, nothing counted", None),
        ("surveyed", "limit: read, ledger made, nothing written", None),
        ("least convert", "limit: read, ledger made, then the least of writing", None),
    ):
        for peer, told, limit in (("bare", "recv_msg", goal), ("values", "recv_msg with its values", None)):
            given = {"goal": limit, "is_times": True, "distribution": "pymavlink"}
            if peer == "values" and what.startswith("limit"):
                continue
            book.against(f"{log} {what}", times[work], times[peer], f"pymavlink {told}", **given)


def main() -> None:
    """Record speeds and memory for the largest recorded flight and for long logs made from it."""
    if len(sys.argv) > 2:
        child(sys.argv[1], Path(sys.argv[2]))
        return
    log = LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN"
    with Book("dataflash") as book, tempfile.TemporaryDirectory() as folder:
        if not are_here(log):
            book.not_measured("every figure", "no recorded log")
            return
        flight = Path(folder) / log.name
        flight.write_bytes(log.read_bytes())
        report(book, flight, Path(folder), ROUNDS)
        for size in LONG_BYTES:
            long = Path(folder) / f"long_{size // 1_000_000}.BIN"
            repeated(flight, long, size)
            report(book, long, Path(folder), min(ROUNDS, LONG_ROUNDS))


if __name__ == "__main__":
    main()
