"""The ULog reader against pyulog, side by side in one run: seconds, ratios, and peak memory.

All topics are read on both sides: ours raw and canonical, pyulog's as it offers them. Figures are processor seconds,
which other programs on the machine disturb least, best of several rounds that take turns; the seconds by the clock
stand beside. The 60 MB log is the given one with its data repeated, times shifted.
"""

import argparse
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pyulog import ULog
from recorded import LOGS, are_here

from groundstation.base.records import Column, RecordBatch
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry

DEFAULT_LOG = LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg"
TABLES_GOAL, CONVERT_GOAL, DAMAGED_GOAL = 5.0, 1.0, 1.5
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


class Work:
    """Something to do again and again, and its best times, processor and clock."""

    def __init__(self, do: Callable[[], object]) -> None:
        self._do = do
        self.seconds = self.clock_seconds = float("inf")

    def round(self) -> None:
        """Do it once."""
        clock, processor = time.perf_counter(), time.process_time()
        self._do()
        self.seconds = min(self.seconds, time.process_time() - processor)
        self.clock_seconds = min(self.clock_seconds, time.perf_counter() - clock)

    def line(self, name: str, note: str = "") -> str:
        """One line of the report."""
        return f"{name:44}{self.seconds * 1e3:9.1f} ms (by the clock {self.clock_seconds * 1e3:9.1f})  {note}".rstrip()


def peak_mb(code: str) -> float:
    """Peak resident memory of a fresh interpreter that runs ``code``, MB."""
    done = subprocess.run([sys.executable, "-c", _PEAK.format(code)], capture_output=True, text=True, check=True)
    return int(done.stdout.split()[-1]) / 1024


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, default=DEFAULT_LOG)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    if not are_here(options.log):
        return
    data = options.log.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        paths = {name: Path(folder) / f"{name}.ulg" for name in ("whole", "long", "damaged")}
        for name, content in (("whole", data), ("long", repeated(data, REPEATS)), ("damaged", damaged(data))):
            paths[name].write_bytes(content)
        target = Path(folder) / "out.mcap"
        works = {}
        for name in ("whole", "long"):
            path = paths[name]
            works[name, "pyulog"] = Work(lambda path=path: ULog(str(path)))
            works[name, "tables"] = Work(lambda path=path: tables_of(path))
            works[name, "convert"] = Work(lambda path=path: convert_log(open_log(path), target))
        works["damaged", "tables"] = Work(lambda: tables_of(paths["damaged"]))
        tables_of(paths["whole"])  # compiles
        for _ in range(options.rounds):
            for work in works.values():
                work.round()
        met = _report(works, paths)
        _report_memory(paths)
    goals = f"tables {TABLES_GOAL:g} x pyulog, convert within its parse, damaged within {DAMAGED_GOAL:g} x"
    print(f"goals ({goals}): {'met' if met else 'NOT met on this machine now'}")


def _report(works: dict[tuple[str, str], Work], paths: dict[str, Path]) -> bool:
    met = True
    for name in ("whole", "long"):
        peer, tables, convert = (works[name, what] for what in ("pyulog", "tables", "convert"))
        print(f"{paths[name].stat().st_size / 1e6:.1f} MB")
        print(peer.line("  pyulog, bare parse"))
        print(tables.line("  ULog -> tables", f"{peer.seconds / tables.seconds:.1f} times as fast as pyulog"))
        print(convert.line("  convert to MCAP", f"{convert.seconds / peer.seconds:.2f} of pyulog's parse"))
        met &= peer.seconds >= TABLES_GOAL * tables.seconds and convert.seconds <= CONVERT_GOAL * peer.seconds
    ratio = works["damaged", "tables"].seconds / works["whole", "tables"].seconds
    print(works["damaged", "tables"].line(f"damaged every {DAMAGE_EVERY} bytes -> tables", f"{ratio:.2f} of the whole"))
    return met and ratio <= DAMAGED_GOAL


def _report_memory(paths: dict[str, Path]) -> None:
    base = peak_mb(_PEAK_IMPORTS)
    for name in ("whole", "long"):
        path, size = str(paths[name]), paths[name].stat().st_size / 1e6
        ours = peak_mb(f"{_PEAK_IMPORTS}\nfor item in registry.read({path!r}): pass")
        theirs = peak_mb(f"from pyulog import ULog\nlog = ULog({path!r})")
        print(f"{size:.1f} MB: peak {ours:.0f} MB ({base:.0f} MB of it the program), pyulog {theirs:.0f} MB")


if __name__ == "__main__":
    main()
