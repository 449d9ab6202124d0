"""The ULog reader against pyulog, side by side in one run: seconds, ratios, and peak memory.

All topics are read on both sides: ours raw and canonical, pyulog's as it offers them. The 57 MB log is the given one
with its data repeated, times shifted.
"""

import argparse
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.least import chunks_of, write_the_least
from benchmarks.record import ROUNDS, Book, Goal, by_turns
from benchmarks.recorded import LOGS, are_here
from groundstation.base.records import Column, RecordBatch
from groundstation.integrity.ordering import corrected
from groundstation.integrity.survey import survey
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry

DEFAULT_LOG = LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg"
TABLES_GOAL, CONVERT_GOAL, DAMAGED_GOAL = Goal(5.0, "at least"), Goal(0.5), Goal(1.5)
REPEATS = 4
DAMAGE_EVERY = 20_000  # bytes between flipped ones: some 700 damaged places in 14 MB
_PEAK = "{}\nprint(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')))"
_PEAK_IMPORTS = "from groundstation.readers import registry\nfrom groundstation.readers.ulog import reader"


def tables_of(path: Path) -> dict[str, dict[str, Column]]:
    """All columns of a log by topic, each in one array."""
    parts: dict[str, list[RecordBatch]] = {}
    for item in registry.read(path):
        if isinstance(item, RecordBatch):
            parts.setdefault(item.topic, []).append(item)
    return {topic: {name: _joined(name, several) for name in several[0].columns} for topic, several in parts.items()}


def surveyed(path: Path) -> None:
    """Do what convert does before it writes: read, make the ledger, bring the records in order of time."""
    items = list(registry.read(path))
    for _batch in corrected(items, survey(items).clock):
        pass


def least(path: Path, chunks: list[bytes], target: Path) -> None:
    """Do what convert does before it writes, then what no writer can leave out, on two cores.

    The first must be over before the second begins: the time in a message is that of a clock which the whole log tells.
    """
    surveyed(path)
    write_the_least(chunks, target, threads=2)


def _joined(name: str, batches: list[RecordBatch]) -> Column:
    columns = [batch.columns[name] for batch in batches if name in batch.columns]
    present = None if all(c.present is None for c in columns) else np.concatenate([c.mask for c in columns])
    return Column(np.concatenate([column.values for column in columns]), present)


def data_messages(data: bytes) -> list[int]:
    """Where the data messages of an undamaged log begin."""
    at, starts = 16, []
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<HB", data, at)
        starts += [at] if kind == ord("D") else []
        at += 3 + size
    return starts


def repeated(data: bytes, times: int) -> bytes:
    """The log with its data messages repeated, their times (the first eight bytes of the data) shifted."""
    starts = np.array(data_messages(data))
    body = np.frombuffer(data, dtype=np.uint8)[starts[0] :]
    places = (starts - starts[0])[:, None] + 5 + np.arange(8)
    stamps = body[places].copy().view("<u8")
    span = int(stamps.max()) + 10_000_000
    out = [data[: starts[0]]]
    for turn in range(times):
        copy = body.copy()
        copy[places] = np.where(stamps > 0, stamps + np.uint64(turn * span), 0).astype("<u8").view(np.uint8)
        out.append(copy.tobytes())
    return b"".join(out)


def damaged(data: bytes) -> bytes:
    """The log with a byte flipped here and there in its data."""
    out = bytearray(data)
    for at in range(data_messages(data)[0] + 1_000, len(out), DAMAGE_EVERY):
        out[at] ^= 0xFF
    return bytes(out)


def peak_mb(code: str) -> float:
    """Peak resident memory of a fresh interpreter that runs ``code``, MB."""
    done = subprocess.run([sys.executable, "-c", _PEAK.format(code)], capture_output=True, text=True, check=True)
    return int(done.stdout.split()[-1]) / 1024


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, default=DEFAULT_LOG)
    options = parser.parse_args()
    with Book("ulog") as book, tempfile.TemporaryDirectory() as folder:
        if not are_here(options.log):
            book.not_measured("every figure", "no recorded log")
            return
        data = options.log.read_bytes()
        paths = {name: Path(folder) / f"{name}.ulg" for name in ("whole", "long", "damaged")}
        for name, content in (("whole", data), ("long", repeated(data, REPEATS)), ("damaged", damaged(data))):
            paths[name].write_bytes(content)
        measure(book, paths, Path(folder) / "out.mcap")


def measure(book: Book, paths: dict[str, Path], target: Path) -> None:
    """Measure the logs and record the figures."""
    works: dict[str, Callable[[], object]] = {"damaged tables": lambda: tables_of(paths["damaged"])}
    has_peer = book.has("pyulog")
    for name in ("whole", "long"):
        path = paths[name]
        works[f"{name} tables"] = lambda path=path: tables_of(path)  # type: ignore[misc]
        works[f"{name} convert"] = lambda path=path: convert_log(open_log(path), target)  # type: ignore[misc]
        works[f"{name} surveyed"] = lambda path=path: surveyed(path)  # type: ignore[misc]
        convert_log(open_log(path), target)
        works[f"{name} least"] = partial(least, path, chunks_of(target), target.with_name("least"))
        if has_peer:
            from pyulog import ULog

            works[f"{name} pyulog"] = lambda path=path: ULog(str(path))  # type: ignore[misc]
    times = by_turns(works, ROUNDS)
    for name in ("whole", "long"):
        size = f"{paths[name].stat().st_size / 1e6:.0f} MB"
        if has_peer:
            peer = times[f"{name} pyulog"]
            goal = {"goal": TABLES_GOAL, "is_times": True}
            book.against(f"ULog of {size} to tables, all topics", times[f"{name} tables"], peer, "pyulog", **goal)
            convert = f"ULog of {size} to MCAP, of pyulog's bare parse"
            book.against(convert, times[f"{name} convert"], peer, "pyulog", note="two threads, both counted")
            by_clock = {"goal": CONVERT_GOAL, "by_clock": True}
            book.against(f"{convert}, by the clock", times[f"{name} convert"], peer, "pyulog", **by_clock)
            for work, what in (("surveyed", "nothing written"), ("least", "then the least of writing on two cores")):
                limit = f"ULog of {size} limit: read, ledger made, {what}, by the clock"
                book.against(limit, times[f"{name} {work}"], peer, "pyulog", by_clock=True)
        memory(book, paths[name], size, has_peer=has_peer)
    what = f"ULog damaged every {DAMAGE_EVERY} bytes to tables"
    book.against(what, times["damaged tables"], times["whole tables"], "the good log", goal=DAMAGED_GOAL)


def memory(book: Book, path: Path, size: str, *, has_peer: bool) -> None:
    """Record peak memory of a process that reads a log, and pyulog's."""
    base = peak_mb(_PEAK_IMPORTS)
    ours = peak_mb(f"{_PEAK_IMPORTS}\nfor item in registry.read({str(path)!r}): pass")
    theirs = f"; pyulog {peak_mb(f'from pyulog import ULog; log = ULog({str(path)!r})'):.0f} MB" if has_peer else ""
    book.figure(f"peak memory, ULog of {size} read", ours, "MB", note=f"{base:.0f} MB of it the program{theirs}")


if __name__ == "__main__":
    main()
