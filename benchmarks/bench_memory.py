"""Peak memory of `convert` against the size of the log, and of `run` against its rows.

Memory of `convert` must not grow with the log: DataFlash, ULog and flat CSV.

VmHWM is all that was resident at its highest, shared libraries among it; RssAnon is what the process holds itself,
looked at every few milliseconds. Both are set against those of a process that has imported the same and converted
nothing. Logs are a recorded or simulated one with its data repeated, times going on. `run` takes flat CSVs of 7 columns
at 100 Hz; its growth is that of the peak from the shorter to the longer.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.bench_ulog import data_messages
from benchmarks.record import Book, Goal
from benchmarks.recorded import LOGS, are_here
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
LIMIT = Goal(250.0)  # MB above the base, at any size
ROWS = (1_000_000, 3_000_000)
GROWTH_GOAL = Goal(100.0)  # bytes a row
AT_ONCE = 100_000  # rows of a CSV that are written at once


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


def flight_csv(target: Path, rows: int) -> None:
    """Write a flat CSV of one INS at 100 Hz, 7 columns: an aircraft that turns."""
    names = ("latitude_deg", "longitude_deg", "altitude_msl_m", "velocity_north_mps", "velocity_east_mps", "roll_deg")
    latitude_deg, longitude_deg = 47.5, 8.5
    with target.open("w") as stream:
        stream.write("# aircraft: A1\n# start_utc: 2026-05-04T06:00:00Z\n")
        stream.write(",".join(["time_s", *(f"ins.{name}" for name in names), "ins.true_heading_deg"]) + "\n")
        for first in range(0, rows, AT_ONCE):
            time_s = np.arange(first, min(first + AT_ONCE, rows)) / 100.0
            heading = np.mod(30.0 + 0.5 * time_s, 360.0)
            north, east = 60.0 * np.cos(np.radians(heading)), 60.0 * np.sin(np.radians(heading))
            latitude = latitude_deg + np.cumsum(north) / 11.1e6
            longitude = longitude_deg + np.cumsum(east) / 7.5e6
            latitude_deg, longitude_deg = float(latitude[-1]), float(longitude[-1])
            height, roll = 900.0 + 20.0 * np.sin(time_s / 60.0), 20.0 * np.sin(time_s / 20.0)
            columns = np.column_stack([time_s, latitude, longitude, height, north, east, roll, heading])
            np.savetxt(stream, columns, fmt="%.2f,%.8f,%.8f,%.3f,%.4f,%.4f,%.4f,%.4f")


def peak_of_run_mb(log: Path, out: Path) -> float:
    """Return the peak resident memory of a `run` in a process of its own, MB."""
    with tempfile.TemporaryFile() as said:
        command = [sys.executable, "-m", "groundstation", "run", str(log), "-o", str(out), "-q"]
        process = subprocess.Popen(command, stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            said.seek(0)
            raise SystemExit(f"run ended with {process.returncode}: {said.read().decode(errors='replace')[-300:]}")
    return usage.ru_maxrss / 1024


def of_run(book: Book, rows: Sequence[int]) -> None:
    """Record peaks of `run`, and the growth a row."""
    peaks = {}
    with tempfile.TemporaryDirectory() as folder:
        for count in rows:
            log = Path(folder) / f"{count}.csv"
            flight_csv(log, count)
            peaks[count] = peak_of_run_mb(log, Path(folder) / f"out_{count}")
            book.figure(f"peak memory, run of {count} rows of 7 columns", peaks[count], "MB")
    if len(rows) > 1:
        few, many = min(rows), max(rows)
        growth = (peaks[many] - peaks[few]) * (1 << 20) / (many - few)
        book.figure("growth of run's peak, 7 columns", growth, "bytes a row", goal=GROWTH_GOAL)


def main() -> None:
    """Record peaks, and whether all are within the limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES_MB, metavar="MB")
    parser.add_argument("--rows", type=int, nargs="*", default=ROWS, help="rows of the logs that `run` takes")
    options = parser.parse_args()
    if options.child:
        child(options.child)
        return
    with Book("memory") as book:
        of_run(book, options.rows)
        of_convert(book, options.sizes)


def of_convert(book: Book, sizes: Sequence[int]) -> None:
    """Record peaks of `convert` above those of a process that has imported the same."""
    makers: dict[str, tuple[Path, Callable[[Path, Path, int], Any]]] = {
        "BIN": (LOGS / "dataflash" / "TestLog2_REENCODED_plane.BIN", repeated_dataflash),
        "ulg": (LOGS / "ulog" / "Proto_FLT09_REENCODED_fixedwing.ulg", repeated_ulog),
        "csv": (ROOT / "sample_logs" / "taxi-good.csv", repeated_csv),
    }
    for suffix, (source, make) in makers.items():
        if not are_here(source):
            book.not_measured(f"peak memory, convert of .{suffix}", "no recorded log")
            continue
        for size in sizes:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"log.{suffix}"
                make(source, path, size * 1_000_000)
                command = [sys.executable, "-m", "benchmarks.bench_memory", "--child", str(path)]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                size_mb = path.stat().st_size / 1e6
            base, peak, own_base, own, _seconds = (float(word) for word in done.stdout.split())
            note = f"{base:.0f} MB before the log is opened; RssAnon {own:.0f} MB, {own - own_base:+.0f}"
            what = f"peak memory above the program, convert of {size_mb:.0f} MB of .{suffix}"
            book.figure(what, peak - base, "MB", goal=LIMIT, note=note)


if __name__ == "__main__":
    main()
