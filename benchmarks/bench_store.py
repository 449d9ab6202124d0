"""The store against the mcap library with its protobuf decoder, side by side in one run: rows a second and ratios.

A topic of ten double fields, random walks (whose last digits do not compress), checksums and indexes on.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer

from benchmarks.least import chunks_of, compress, write_the_least
from benchmarks.record import ROUNDS, Book, Goal, Times, by_turns
from groundstation.base.records import Column, RecordBatch
from groundstation.store.decompress import crc32
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read
from groundstation.store.schema import canonical_type
from groundstation.store.writer import ZSTD_LEVEL, StoreWriter
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.table import Table

FIELDS = tuple(field.name for field in canonical_type("ins").own_fields[:10])
T0_NS, STEP_NS = 1_777_874_400_000_000_000, 10_000_000
BATCH_ROWS = 65_536
READ_GOAL, ZSTD_GOAL = Goal(30.0, "at least"), Goal(1.3)
READ_ROWS_GOAL, WRITE_ROWS_GOAL = Goal(3e6, "at least"), Goal(1e6, "at least")


def batches_of(rows: int, share: float = 1.0) -> list[RecordBatch]:
    """Batches of an ins topic with ten fields, each a random walk; ``share`` of the values present."""
    rng = np.random.default_rng(1)
    out = []
    for first in range(0, rows, BATCH_ROWS):
        index = np.arange(first, min(first + BATCH_ROWS, rows))
        time_ns = T0_NS + index * STEP_NS
        columns = {}
        for name in FIELDS:
            values = np.cumsum(rng.normal(size=len(index)))
            columns[name] = Column(values, None if share == 1.0 else rng.random(len(index)) < share)
        out.append(RecordBatch("ins", index, Column(time_ns + 5), columns, time_ns))
    return out


def write_store(path: Path, batches: list[RecordBatch]) -> None:
    with StoreWriter(path, StoreInfo(has_utc=True)) as writer:
        for batch in batches:
            writer.write(batch)


def read_store(path: Path, rows: int) -> Table:
    """The table of the topic as ``run`` makes it; the number of its rows is known."""
    batches = (item for item in read(path) if isinstance(item, RecordBatch))
    flight = flight_from_batches(batches, metadata={}, has_utc=True, source_name=path.name, rows={"ins": rows})
    return flight["ins"]


def columns_of(table: Table) -> dict[str, np.ndarray]:
    """Columns of a table by the names that the peer has."""
    columns = {name: table.columns[name].values for name in FIELDS}
    others = {"time_ns": table.time_ns, "device_time_ns": table.device_time_ns.values}
    return columns | others | {"record_index": table.record_index}


def read_peer(path: Path) -> dict[str, np.ndarray]:
    """The same columns through mcap and mcap_protobuf."""
    from mcap_protobuf.decoder import DecoderFactory

    names = (*FIELDS, "device_time_ns", "record_index")
    rows: dict[str, list[float]] = {name: [] for name in ("time_ns", *names)}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, _, message, value in reader.iter_decoded_messages(topics=["ins"], log_time_order=False):
            rows["time_ns"].append(message.log_time)
            for name in names:
                rows[name].append(getattr(value, name))
    return {name: np.array(values) for name, values in rows.items()}


def write_peer(path: Path, batches: list[RecordBatch]) -> None:
    """The same messages through protobuf's own encoder and mcap's Writer."""
    from google.protobuf import descriptor_pool, message_factory
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    kind = canonical_type("ins")
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(kind.descriptor_set).file:
        pool.Add(file)
    make = message_factory.GetMessageClass(pool.FindMessageTypeByName(kind.name))
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "ins", "protobuf", writer.register_schema(kind.name, "protobuf", kind.descriptor_set)
        )
        for batch in batches:
            columns = [column.values.tolist() for column in batch.columns.values()]
            device = batch.device_time_ns.values.tolist()
            for row, time_ns in enumerate(batch.time_ns.tolist()):
                values = {name: column[row] for name, column in zip(FIELDS, columns, strict=True)}
                message = make(device_time_ns=device[row], record_index=int(batch.record_index[row]), **values)
                writer.add_message(channel, time_ns, message.SerializeToString(), time_ns)
        writer.finish()


def read_the_least(packed: list[tuple[bytes, int]], rows: int) -> None:
    """Decompress chunks, check them, and copy as many bytes to new memory as the table has."""
    decompressor = zstandard.ZstdDecompressor()
    table, at = np.empty((len(FIELDS) + 3) * rows * 8, np.uint8), 0
    for data, size in packed:
        chunk = decompressor.decompress(data, size)
        crc32(chunk)
        part = table[at : at + size]
        part[:] = np.frombuffer(chunk, np.uint8, len(part))
        at += len(part)


def scaled(times: Times, rows: int, peer_rows: int) -> Times:
    """Return times of the peer, who has fewer rows, as if it had as many."""
    factor = rows / peer_rows
    return Times(tuple(factor * one for one in times.processor_s), tuple(factor * one for one in times.clock_s))


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--peer-rows", type=int, default=50_000)
    options = parser.parse_args()
    batches, few = batches_of(options.rows), batches_of(options.peer_rows)
    gaps = batches_of(options.rows, share=0.9)
    with Book("store") as book, tempfile.TemporaryDirectory() as folder:
        full, small, sparse, other = (Path(folder) / f"{name}.mcap" for name in ("full", "small", "sparse", "other"))
        write_store(small, few)
        write_store(full, batches)
        write_store(sparse, gaps)
        chunks = chunks_of(full)
        compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        packed = [(compressor.compress(one), len(one)) for one in chunks]
        works: dict[str, Callable[[], object]] = {
            "write": lambda: write_store(full, batches),
            "read": lambda: read_store(full, options.rows),
            "write gaps": lambda: write_store(sparse, gaps),
            "read gaps": lambda: read_store(sparse, options.rows),
            "zstd": lambda: compress(chunks),
            "least": lambda: write_the_least(chunks, other),
            "least read": lambda: read_the_least(packed, options.rows),
        }
        if book.has("mcap-protobuf-support"):
            works |= {"write peer": lambda: write_peer(other, few), "read peer": lambda: read_peer(small)}
            ours, theirs = columns_of(read_store(small, options.peer_rows)), read_peer(small)
            assert all(np.array_equal(ours[name], theirs[name]) for name in theirs), "both must read the same values"
        times = by_turns(works, ROUNDS)
        record(book, times, options.rows, options.peer_rows)


def record(book: Book, times: dict[str, Times], rows: int, peer_rows: int) -> None:
    """Record the figures."""
    rates = {name: [rows / one for one in side.processor_s] for name, side in times.items()}
    name = "mcap with protobuf"
    for work, what, rows_goal, goal in (
        ("read", "MCAP to tables", READ_ROWS_GOAL, READ_GOAL),
        ("write", "tables to MCAP", WRITE_ROWS_GOAL, None),
    ):
        told = f"{what}, {len(FIELDS)} doubles a row"
        book.figure(told, rates[work], "rows/s of processor time", goal=rows_goal)
        if f"{work} peer" in times:
            peer = scaled(times[f"{work} peer"], rows, peer_rows)
            given = {"goal": goal, "is_times": True, "distribution": "mcap"}
            book.against(f"{told}, {rows} rows", times[work], peer, name, **given)
        book.figure(f"{what}, a tenth of the values absent", rates[f"{work} gaps"], "rows/s of processor time")
    what = "tables to MCAP, of zstd alone on the same chunks"
    book.against(what, times["write"], times["zstd"], "zstandard", goal=ZSTD_GOAL)
    book.against(f"{what}, by the clock", times["write"], times["zstd"], "zstandard", by_clock=True)
    least = "limit: one copy, checksum, zstd, SHA-256 and one file of the same bytes"
    book.against(f"{least}, of zstd alone", times["least"], times["zstd"], "zstandard")
    book.against("tables to MCAP, of that limit", times["write"], times["least"], "the limit")
    least = "limit: zstd and checksum of the same chunks, one copy of the tables"
    book.against(f"MCAP to tables, of the {least}", times["read"], times["least read"], "the limit")


if __name__ == "__main__":
    main()
