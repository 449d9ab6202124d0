"""The Chapter 10 reader against pychapter10, side by side in one run: MB/s, ratios, and peak memory.

The same work on both sides: every packet, every message and word with its time, and the navigation messages decoded.
Ours gives columns; pychapter10 gives objects, of which the navigation words are then taken. The log is the given
recording, repeated with its counter and sequence numbers going on.
"""

import argparse
import math
import struct
import subprocess
import sys
import tempfile
from dataclasses import astuple
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.record import ROUNDS, Book, Goal, Times, by_turns
from benchmarks.recorded import LOGS, are_here
from groundstation.base.records import RecordBatch
from groundstation.readers import registry
from groundstation.readers.icd import Icd, load

DATA = LOGS / "ch10"
SPEED_GOAL, TIMES_GOAL, DAMAGED_GOAL = Goal(100.0, "at least"), Goal(10.0, "at least"), Goal(1.5)
DAMAGE_EVERY = 20_000  # bytes between flipped ones
PEER_MB = 2  # of the log that the peer reads: it needs a second for each, and its time grows with it
_PEAK = "{}\nprint(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')))"


def packets_of(data: bytes) -> list[tuple[int, int]]:
    """Where the packets of an undamaged recording begin and end; one that is cut is left out."""
    at, found = 0, []
    while at + 24 <= len(data):
        length = int.from_bytes(data[at + 4 : at + 8], "little")
        if at + length > len(data):
            break
        found.append((at, at + length))
        at += length
    return found


def repeated(data: bytes, times: int, target: Path) -> None:
    """Write a recording several times, counters and sequence numbers going on, sums right again.

    The stamps of 1553 messages count on with those of their packets.
    """
    spans = packets_of(data)
    counters = [int.from_bytes(data[at + 16 : at + 22], "little") for at, _end in spans]
    step = max(counters) - min(counters) + 10_000_000
    numbers: dict[int, int] = {}
    with target.open("wb") as stream:
        for turn in range(times):
            for at, end in spans:
                if turn and data[at + 15] == 1:
                    continue
                stream.write(_moved(bytearray(data[at:end]), turn * step, numbers))


def _moved(packet: bytearray, shift: int, numbers: dict[int, int]) -> bytes:
    channel = int.from_bytes(packet[2:4], "little")
    packet[13] = numbers.get(channel, packet[13])
    numbers[channel] = (packet[13] + 1) % 256
    _add(packet, 16, shift)
    packet[22:24] = struct.pack("<H", sum(struct.unpack_from("<11H", packet)) & 0xFFFF)
    if packet[15] == 0x19 and shift:
        at, end = 28, 24 + int.from_bytes(packet[8:12], "little")
        while at + 14 <= end:
            _add(packet, at, shift)
            length = int.from_bytes(packet[at + 12 : at + 14], "little")
            at += 14 + length + length % 2
    kind = packet[14] & 3
    if kind:
        width = (0, 1, 2, 4)[kind]
        total = int(np.frombuffer(packet[24:-width], f"<u{width}").sum(dtype=np.uint64)) % (1 << 8 * width)
        packet[-width:] = total.to_bytes(width, "little")
    return bytes(packet)


def _add(packet: bytearray, at: int, shift: int) -> None:
    packet[at : at + 6] = (int.from_bytes(packet[at : at + 6], "little") + shift).to_bytes(6, "little")


def damaged(data: bytes) -> bytes:
    """The log with a byte flipped here and there."""
    out = bytearray(data)
    for at in range(20_000, len(out), DAMAGE_EVERY):
        out[at] ^= 0xFF
    return bytes(out)


def ours(path: Path, icds: tuple[Icd, ...]) -> int:
    """Read everything; gives the navigation samples."""
    batches = (item for item in registry.read(path, icds=icds) if isinstance(item, RecordBatch))
    return sum(len(batch) for batch in batches if batch.topic.startswith("ins"))


def peer(path: Path, icds: tuple[Icd, ...]) -> int:
    """The same by pychapter10: messages as it gives them, navigation words by struct; gives their number."""
    from chapter10 import C10

    commands = {side for icd in icds for one in icd.messages_1553 for side in (one.transmit, one.receive) if side}
    found = 0
    with path.open("rb") as stream:
        for packet in C10(stream):
            if packet.data_type == 0x38:
                for word in packet:
                    int.from_bytes(word.data, "little")
            elif packet.data_type == 0x19:
                for message in packet:
                    words = struct.unpack(f"<{len(message.data) // 2}H", message.data)
                    if words and words[0] in commands and not message.me and len(words) >= 34:
                        found += bool(_navigation(words[2:34]))
    return found


def _navigation(words: tuple[int, ...]) -> tuple[float, ...]:
    angles = [((word ^ 0x8000) - 0x8000) * 180.0 / 2**15 for word in words[8:13]]
    high, low, longitude = words[20], words[21], (words[22] << 16 | words[23]) ^ 0x80000000
    sine = (((high << 16 | low) ^ 0x80000000) - 0x80000000) / 2**30
    latitude = math.degrees(math.asin(max(-1.0, min(1.0, sine))))
    return (*angles, latitude, (longitude - 0x80000000) * 180.0 / 2**31, words[24] * 4 * 0.3048)


def peak_mb(path: Path, icd: Path) -> float:
    """Peak resident memory of a fresh interpreter that reads a log, MB."""
    code = (
        "from pathlib import Path\nfrom groundstation.readers import registry\n"
        "from groundstation.readers.icd import load\n"
        f"for item in registry.read(Path({str(path)!r}), icds=(load(Path({str(icd)!r})),)): pass"
    )
    done = subprocess.run([sys.executable, "-c", _PEAK.format(code)], capture_output=True, text=True, check=True)
    return int(done.stdout.split()[-1]) / 1024


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--log", type=Path, nargs="*", default=[DATA / "iliad_1553.c10", DATA / "kc135_429_1553_1MB.c10"]
    )
    parser.add_argument("--icd", type=Path, default=DATA / "icd" / "example_1553_egi.yaml")
    parser.add_argument("--large-mb", type=int, default=0, help="also peak memory of a log of this size")
    options = parser.parse_args()
    with Book("chapter10") as book, tempfile.TemporaryDirectory() as folder:
        if not are_here(*options.log, options.icd):
            book.not_measured("every figure", "no recorded log")
            return
        icds = (load(options.icd),)
        for log in options.log:
            measure(book, log, icds, Path(folder))
        if options.large_mb:
            data = options.log[0].read_bytes()
            for size_mb in (options.large_mb // 10, options.large_mb):
                large = Path(folder) / "large.c10"
                repeated(data, size_mb * 1_000_000 // len(data) + 1, large)
                size = large.stat().st_size / 1e6
                book.figure(f"peak memory, Chapter 10 of {size:.0f} MB read", peak_mb(large, options.icd), "MB")
                large.unlink()


def measure(book: Book, log: Path, icds: tuple[Icd, ...], folder: Path) -> None:
    """Measure a recording, and record the figures."""
    data = log.read_bytes()
    paths = {name: folder / f"{name}.c10" for name in ("long", "short", "damaged")}
    repeated(data, 64, paths["long"])
    repeated(data, PEER_MB, paths["short"])
    paths["damaged"].write_bytes(damaged(paths["long"].read_bytes()))
    sizes = {name: path.stat().st_size / 1e6 for name, path in paths.items()}
    works = {name: partial(ours, paths[name], icds) for name in ("long", "damaged")}
    has_peer = book.has("pychapter10")
    if has_peer:
        works["peer"] = partial(peer, paths["short"], icds)
    times = by_turns(works, ROUNDS)
    what = f"Chapter 10 ({log.stem}) of {sizes['long']:.0f} MB to tables"
    speeds = [sizes["long"] / one for one in times["long"].processor_s]
    book.figure(what, speeds, "MB/s of processor time", goal=SPEED_GOAL)
    if has_peer:
        factor = sizes["long"] / sizes["short"]
        as_long = Times(*(tuple(factor * one for one in side) for side in astuple(times["peer"])))
        book.against(what, times["long"], as_long, "pychapter10", goal=TIMES_GOAL, is_times=True)
    book.against(
        f"{what}, damaged every {DAMAGE_EVERY} bytes",
        times["damaged"],
        times["long"],
        "the good log",
        goal=DAMAGED_GOAL,
    )


if __name__ == "__main__":
    main()
