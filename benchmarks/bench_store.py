"""The store against the mcap library with its protobuf decoder, side by side in one run: rows a second and ratios.

A topic of ten double fields, random walks (whose last digits do not compress), checksums and indexes on. All that is
measured runs in one thread; figures are rows per second of processor time, which other programs on the machine disturb
least, best of several rounds that take turns; the rate by the clock stands beside.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from groundstation.base.records import Column, RecordBatch
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read
from groundstation.store.schema import canonical_type
from groundstation.store.writer import ZSTD_LEVEL, StoreWriter

FIELDS = tuple(field.name for field in canonical_type("ins").own_fields[:10])
T0_NS, STEP_NS = 1_777_874_400_000_000_000, 10_000_000
BATCH_ROWS = 65_536
READ_GOAL_RATIO, READ_GOAL_ROWS, WRITE_GOAL_ROWS = 30.0, 3e6, 1e6


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


def read_store(path: Path) -> dict[str, np.ndarray]:
    """Columns of the topic, each in one array."""
    batches = [item for item in read(path) if isinstance(item, RecordBatch)]
    columns = {name: np.concatenate([batch.columns[name].values for batch in batches]) for name in FIELDS}
    columns["time_ns"] = np.concatenate([batch.time_ns for batch in batches])
    columns["device_time_ns"] = np.concatenate([batch.device_time_ns.values for batch in batches])
    columns["record_index"] = np.concatenate([batch.record_index for batch in batches])
    return columns


def read_peer(path: Path) -> dict[str, np.ndarray]:
    """The same columns through mcap and mcap_protobuf."""
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


def chunks_of(path: Path) -> list[bytes]:
    """What stands in the chunks of a file, decompressed: all that zstd has to do when it is written."""
    with path.open("rb") as file:
        chunks = [record for record in StreamReader(file, emit_chunks=True).records if isinstance(record, Chunk)]
    return [zstandard.ZstdDecompressor().decompress(one.data, one.uncompressed_size) for one in chunks]


def compress(chunks: list[bytes]) -> None:
    """Compress chunks as the store does, and nothing else."""
    compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
    for one in chunks:
        compressor.compress(one)


class Work:
    """Something to do again and again, and its best rates, in rows per second of processor time and by the clock."""

    def __init__(self, rows: int, do: Callable[[], object]) -> None:
        self.rows, self._do = rows, do
        self.rate = self.clock_rate = 0.0

    def round(self) -> None:
        """Do it once."""
        clock, processor = time.perf_counter(), time.process_time()
        self._do()
        self.rate = max(self.rate, self.rows / (time.process_time() - processor))
        self.clock_rate = max(self.clock_rate, self.rows / (time.perf_counter() - clock))

    def line(self, name: str, peer: "Work | None" = None) -> str:
        """One line of the report."""
        ratio = f"{self.rate / peer.rate:6.1f} x peer" if peer else ""
        return f"{name:36}{self.rate:12,.0f} rows/s (by the clock {self.clock_rate:12,.0f}) {ratio}".rstrip()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--peer-rows", type=int, default=50_000)
    parser.add_argument("--rounds", type=int, default=6)
    options = parser.parse_args()
    batches, few = batches_of(options.rows), batches_of(options.peer_rows)
    gaps = batches_of(options.rows, share=0.9)
    with tempfile.TemporaryDirectory() as folder:
        full, small, sparse, other = (Path(folder) / f"{name}.mcap" for name in ("full", "small", "sparse", "other"))
        works = {
            "write": Work(options.rows, lambda: write_store(full, batches)),
            "write peer": Work(options.peer_rows, lambda: write_peer(other, few)),
            "read": Work(options.rows, lambda: read_store(full)),
            "read peer": Work(options.peer_rows, lambda: read_peer(small)),
            "write gaps": Work(options.rows, lambda: write_store(sparse, gaps)),
            "read gaps": Work(options.rows, lambda: read_store(sparse)),
        }
        write_store(small, few)
        write_store(full, batches)
        chunks = chunks_of(full)
        works["zstd"] = Work(options.rows, lambda: compress(chunks))
        for _ in range(options.rounds):
            for work in works.values():
                work.round()
        size = full.stat().st_size
        ours, theirs = read_store(small), read_peer(small)
        assert all(np.array_equal(ours[name], theirs[name]) for name in theirs), "both must read the same values"
    read, read_peer_work, write = works["read"], works["read peer"], works["write"]
    print(f"topic of {len(FIELDS)} double fields, {options.rows} rows, {size / options.rows:.0f} bytes a row")
    print(read.line("MCAP -> tables, store", read_peer_work))
    print(read_peer_work.line("MCAP -> tables, mcap + protobuf"))
    print(write.line("tables -> MCAP, store", works["write peer"]))
    print(works["write peer"].line("tables -> MCAP, mcap + protobuf"))
    zstd = works["zstd"]
    print(zstd.line("  zstd alone, the same chunks"))
    shares = zstd.rate / write.rate, zstd.clock_rate / write.clock_rate
    print(
        f"  tables -> MCAP takes {shares[0]:.2f} times the processor time of zstd, {shares[1]:.2f} times by the clock"
    )
    print("a tenth of the values absent at random:")
    print(works["read gaps"].line("MCAP -> tables, store"))
    print(works["write gaps"].line("tables -> MCAP, store"))
    met = read.rate >= max(READ_GOAL_RATIO * read_peer_work.rate, READ_GOAL_ROWS) and write.rate >= WRITE_GOAL_ROWS
    goals = f"read {READ_GOAL_RATIO:.0f} x peer and {READ_GOAL_ROWS:,.0f} rows/s, write {WRITE_GOAL_ROWS:,.0f} rows/s"
    print(f"goals ({goals}): {'met' if met else 'NOT met on this machine now'}")


if __name__ == "__main__":
    main()
