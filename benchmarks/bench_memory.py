"""Peak memory of `convert` against the size of the log, DataFlash, ULog and flat CSV: it must not grow with it.

VmHWM is all that was resident at its highest, shared libraries among it; RssAnon is what the process holds itself,
looked at every few milliseconds. Both are set against those of a process that has imported the same and converted
nothing. Logs are a recorded or simulated one with its data repeated, times going on.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from bench_ulog import data_messages
from recorded import LOGS, are_here

from groundstation.integrity import ordering, survey  # noqa: F401 -- imported before the base is taken
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers.dataflash.blocks import Scanner
from groundstation.readers.source import Source
from groundstation.readers.table_reader import TableReader  # noqa: F401
from groundstation.readers.ulog import reader  # noqa: F401
from groundstation.store import writer  # noqa: F401

ROOT = Path(__file__).parents[1]
SIZES_MB = (15, 60, 240)
LIMIT_MB = 250  # above the base, at any size


def repeated_dataflash(source: Path, target: Path, size: int) -> None:
    """The records behind the definitions again and again."""
    data = np.fromfile(source, np.uint8)
    blocks = list(Scanner(Source(source)))  # the file is one piece: offsets count from its start
    types, offsets = (np.concatenate([getattr(block, name) for block in blocks]) for name in ("types", "offsets"))
    first = int(offsets[np.flatnonzero(types == 128)[-1] + 1])
    body, times, span_ns = data[first:].copy(), [], 0
    for block in blocks:
        for definition, which in block.groups():
            if definition.time_field is not None and definition.dtype.fields is not None:
                name, unit_ns = definition.time_field
                dtype, offset = definition.dtype.fields[name][:2]
                at = block.offsets[which][:, None] + offset + np.arange(dtype.itemsize) - first
                at = at[at[:, 0] >= 0]
                times.append((at, body[at].view(dtype), unit_ns))
                span_ns = max(span_ns, int(times[-1][1].max(initial=0)) * unit_ns)
    span_ns += -span_ns % 1_000_000
    with target.open("wb") as stream:
        stream.write(data.tobytes())
        for turn in range(1, size // len(body)):
            for at, values, unit_ns in times:
                body[at] = (values + values.dtype.type(turn * span_ns // unit_ns)).view(np.uint8)
            stream.write(body.tobytes())


def repeated_ulog(source: Path, target: Path, size: int) -> None:
    """The data messages again and again."""
    data = source.read_bytes()
    starts = np.array(data_messages(data))
    body = np.frombuffer(data, np.uint8)[starts[0] :].copy()
    at = (starts - starts[0])[:, None] + 5 + np.arange(8)
    times = body[at].view("<u8")
    span_us = np.uint64(int(times.max()) + 10_000_000)
    with target.open("wb") as stream:
        stream.write(data)
        for turn in range(1, max(1, round(size / len(data)))):
            body[at] = np.where(times > 0, times + np.uint64(turn) * span_us, 0).astype("<u8").view(np.uint8)
            stream.write(body.tobytes())


def repeated_csv(source: Path, target: Path, size: int) -> None:
    """The rows again and again; time stands first in them."""
    lines = source.read_text().splitlines()
    top = next(at for at, line in enumerate(lines) if not line.startswith("#")) + 1
    rows = [(float(time_s), rest) for time_s, _, rest in (line.partition(",") for line in lines[top:])]
    span_s, turn = rows[-1][0] + rows[1][0], 0
    with target.open("w") as stream:
        stream.write("\n".join([*lines[:top], ""]))
        while stream.tell() < size:
            stream.writelines(f"{time_s + turn * span_s:.4f},{rest}\n" for time_s, rest in rows)
            turn += 1


def status_mb(name: str) -> float:
    """A figure of this process, MB."""
    found = re.search(rf"{name}:\s*(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return int(found[1]) / 1024


def child(path: Path) -> None:
    """Convert a log in this process and print base and peak of VmHWM and of RssAnon, and processor seconds."""
    base, seen, is_done = (status_mb("VmHWM"), status_mb("RssAnon")), [0.0], threading.Event()

    def look() -> None:
        while not is_done.wait(0.004):
            seen.append(status_mb("RssAnon"))

    thread = threading.Thread(target=look)
    thread.start()
    started = time.process_time()
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        convert_log(open_log(path), Path(folder) / "out.mcap")
    seconds = time.process_time() - started
    is_done.set()
    thread.join()
    print(base[0], status_mb("VmHWM"), base[1], max(seen), seconds)


def main() -> None:
    """Print a table of peaks, and whether all are within the limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES_MB, metavar="MB")
    options = parser.parse_args()
    if options.child:
        child(options.child)
        return
    makers: dict[str, tuple[Path, Callable[[Path, Path, int], Any]]] = {
        "BIN": (LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN", repeated_dataflash),
        "ulg": (LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg", repeated_ulog),
        "csv": (ROOT / "sample_logs" / "taxi-good.csv", repeated_csv),
    }
    highest = 0.0
    for suffix, (source, make) in makers.items():
        for size in options.sizes if are_here(source) else ():
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"log.{suffix}"
                make(source, path, size * 1_000_000)
                command = [sys.executable, __file__, "--child", str(path)]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                size_mb = path.stat().st_size / 1e6
            base, peak, anonymous_base, anonymous, seconds = (float(word) for word in done.stdout.split())
            highest = max(highest, peak - base)
            print(
                f"{suffix} {size_mb:4.0f} MB: VmHWM {peak:4.0f} MB, {peak - base:+4.0f}; "
                f"RssAnon {anonymous:4.0f} MB, {anonymous - anonymous_base:+4.0f}; {seconds:5.1f} s of processor time"
            )
    print(f"highest above the base {highest:.0f} MB, {LIMIT_MB} allowed: {'met' if highest <= LIMIT_MB else 'NOT met'}")


if __name__ == "__main__":
    main()
