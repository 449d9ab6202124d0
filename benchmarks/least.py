"""What no writer of a store file can leave out: the limit beside which `convert` and the store are measured."""

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from groundstation.store.decompress import crc32
from groundstation.store.writer import ZSTD_LEVEL


def chunks_of(path: Path) -> list[bytes]:
    """What stands in the chunks of a file, decompressed: all that zstd has to do when it is written."""
    with path.open("rb") as file:
        chunks = [record for record in StreamReader(file, emit_chunks=True).records if isinstance(record, Chunk)]
    return [zstandard.ZstdDecompressor().decompress(one.data, one.uncompressed_size) for one in chunks]


def compress(chunks: list[bytes], level: int = ZSTD_LEVEL, threads: int = 0) -> int:
    """Compress chunks one after the other, and nothing else; return the bytes of what comes out."""
    compressor = zstandard.ZstdCompressor(level=level, threads=threads)
    return sum(len(compressor.compress(one)) for one in chunks)


def write_the_least(chunks: list[bytes], path: Path, threads: int = 1) -> None:
    """Do what no writer of such a file can leave out.

    Each byte copied once, its checksum, zstd, the digest of the file, the file on the disk. With two ``threads`` each
    has every second chunk, and the digest is made beside the file.
    """
    shares = [chunks[first::threads] for first in range(threads)]
    digest = hashlib.sha256()
    with ThreadPoolExecutor(threads) as pool, path.open("wb") as file:
        for packed in pool.map(_packed, shares):
            digested = pool.submit(lambda packed=packed: [digest.update(one) for one in packed])  # type: ignore[misc]
            file.writelines(packed)
            digested.result()
        file.flush()
        os.fsync(file.fileno())


def _packed(chunks: list[bytes]) -> list[bytes]:
    """Return chunks compressed, each copied and checked before."""
    room = memoryview(bytearray(max(map(len, chunks), default=0)))
    compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
    packed = []
    for one in chunks:
        room[: len(one)] = one
        packed.append(compressor.compress(room[: len(one)]))
        crc32(room[: len(one)])
    return packed
