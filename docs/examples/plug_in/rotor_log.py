"""Rotor log: eight bytes ROTORLOG, then records of time in ms (uint32) and turns per minute (float32)."""

from collections.abc import Iterator
from itertools import count

import numpy as np

from groundstation.base.records import MAX_BATCH_ROWS, Column, Damage, Item, LogHeader, RecordBatch
from groundstation.readers.source import Claim, Source

NAME = "rotor-log"
MAGIC = b"ROTORLOG"
RECORD = np.dtype([("time_ms", "<u4"), ("speed_rpm", "<f4")])


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with the magic bytes."""
    return Claim(NAME) if source.head.startswith(MAGIC) else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, then the rotor's speed; a last record that was cut is damage."""
    yield LogHeader(NAME)
    with source.open() as stream:
        stream.seek(len(MAGIC))
        for first in count(0, MAX_BATCH_ROWS):
            content = stream.read(MAX_BATCH_ROWS * RECORD.itemsize)
            whole = len(content) // RECORD.itemsize
            records = np.frombuffer(content, RECORD, whole)
            if whole:
                time_ns = records["time_ms"].astype(np.int64) * 1_000_000
                speed_hz = records["speed_rpm"].astype(np.float64) / 60.0
                index = np.arange(first, first + whole, dtype=np.int64)
                yield RecordBatch("rotor", index, Column(time_ns), {"speed_hz": Column(speed_hz)})
            left = len(content) - whole * RECORD.itemsize
            if left:
                yield Damage("truncated", f"record {first + whole}", left, "bytes of a record that was cut", "rotor")
            if whole < MAX_BATCH_ROWS:
                return
