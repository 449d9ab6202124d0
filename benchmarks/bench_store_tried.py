"""Ways of writing and reading chunks that were weighed and not taken, each beside the way that was.

On the rows of the part ``store``: random walks of ten doubles.
"""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numba
import numpy as np
import zstandard

from benchmarks.bench_store import batches_of, write_store
from benchmarks.least import chunks_of, compress
from benchmarks.record import ROUNDS, Book, by_turns
from groundstation.base.records import RecordBatch
from groundstation.store import writer
from groundstation.store.marks import RECORD_PREFIX
from groundstation.store.messages import HEAD
from groundstation.store.writer import ZSTD_LEVEL

ROWS = 1_000_000


@numba.njit(nogil=True)
def columns_by_rows(buffer: np.ndarray, stride: int, places: np.ndarray, out: np.ndarray) -> None:
    """Copy the doubles of records to columns, a record at a time."""
    for row in range(out.shape[1]):
        for column in range(len(places)):
            at, value = row * stride + places[column], np.uint64(0)
            for k in range(8):
                value |= np.uint64(buffer[at + k]) << np.uint64(8 * k)
            out[column, row] = value


def columns_by_numpy(buffer: np.ndarray, stride: int, places: np.ndarray, out: np.ndarray) -> None:
    """Copy the doubles of records to columns, a column at a time."""
    for column, place in enumerate(places):
        out[column] = np.ndarray(out.shape[1], "<u8", buffer, place, stride)


def main() -> None:
    """Measure and record."""
    batches = batches_of(ROWS)
    with Book("store_tried") as book, tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.mcap"
        write_store(path, batches)
        chunks = chunks_of(path)
        joined = b"".join(chunks)
        size = compress(chunks)
        works: dict[str, Callable[[], object]] = {
            "as it is": partial(compress, chunks),
            "zstd's own two threads": partial(compress, chunks, threads=2),
            "all chunks in one call, two threads": lambda: zstandard.ZstdCompressor(
                level=ZSTD_LEVEL
            ).multi_compress_to_buffer(chunks, threads=2),
        }
        sizes = dict.fromkeys(works, size)
        for level in (-3, 1):
            works[f"level {level}"] = partial(compress, chunks, level)
            sizes[f"level {level}"] = compress(chunks, level)
        for kib in (256, 4096):
            cut = [joined[at : at + (kib << 10)] for at in range(0, len(joined), kib << 10)]
            works[f"chunks of {kib} KiB"] = partial(compress, cut)
            sizes[f"chunks of {kib} KiB"] = compress(cut)
        times = by_turns(works, ROUNDS)
        for name in list(works)[1:]:
            note = f"{sizes[name] / size - 1.0:+.1%} of bytes"
            for by_clock in (False, True):
                what = f"compressing, {name}{', by the clock' if by_clock else ''}"
                book.against(what, times[name], times["as it is"], "as it is", by_clock=by_clock, note=note)
        threads_that_compress(book, path, batches)
        loops(book, max(chunks, key=len))


def threads_that_compress(book: Book, path: Path, batches: list[RecordBatch]) -> None:
    """Record a file written with one thread that compresses beside two."""

    def with_threads(count: int) -> None:
        before, writer.COMPRESSING = writer.COMPRESSING, count
        write_store(path, batches)
        writer.COMPRESSING = before

    times = by_turns({"one": partial(with_threads, 1), "two": partial(with_threads, 2)}, ROUNDS)
    for by_clock in (False, True):
        what = f"tables to MCAP, one thread compresses{', by the clock' if by_clock else ''}"
        book.against(what, times["one"], times["two"], "two threads", by_clock=by_clock)


def loops(book: Book, chunk: bytes) -> None:
    """Record the columns of a chunk by a compiled loop over records beside numpy's copies of columns."""
    buffer = np.frombuffer(chunk, np.uint8)
    stride = int(np.frombuffer(chunk, HEAD, 1)["length"][0]) + RECORD_PREFIX
    places = np.arange(HEAD.itemsize + 1, stride, 9)
    out = np.empty((len(places), len(buffer) // stride), np.uint64)
    ways = {"compiled": columns_by_rows, "numpy": columns_by_numpy}
    works = {name: partial(way, buffer, stride, places, out) for name, way in ways.items()}
    times = by_turns(works, ROUNDS, dict.fromkeys(works, 200))
    what = f"{len(places)} columns of a chunk by one compiled loop"
    book.against(what, times["compiled"], times["numpy"], "numpy, a column at a time")


if __name__ == "__main__":
    main()
