"""Decompression of chunks, each into the memory of the one before."""

from typing import BinaryIO, TypeAlias

import lz4.frame
import numpy as np
import zstandard

from groundstation.store.messages import ByteArray

try:  # a tenth of the time of zlib, which serves where there is no build of it
    from zlib_ng.zlib_ng import crc32
except ImportError:
    from zlib import crc32

__all__ = ["MAX_CHUNK_BYTES", "ChunkError", "Unpacker", "crc32", "decompress"]
MAX_CHUNK_BYTES = 64 << 20  # largest chunk, decompressed; the writer's have about one megabyte
Buffer: TypeAlias = bytes | memoryview


class ChunkError(Exception):
    """Error of a chunk that cannot be used; the text says why."""


class Room:
    """Memory for one thing at a time, which grows with the largest.

    New memory takes the system as long as zstd takes to fill it.
    """

    def __init__(self) -> None:
        self._memory = np.empty(0, np.uint8)

    def of(self, size: int) -> ByteArray:
        """Return so many bytes; what was in them before is overwritten."""
        if size > len(self._memory):
            self._memory = np.empty(size, np.uint8)
        return self._memory[:size]


class Unpacker:
    """Reading and decompression of one chunk after the other.

    What it returned for a chunk holds until the next one.
    """

    def __init__(self) -> None:
        self._packed, self._unpacked = Room(), Room()
        self._zstd = zstandard.ZstdDecompressor()

    def read(self, file: BinaryIO, at: int, length: int) -> memoryview:
        """Return bytes of a file, fewer at its end."""
        file.seek(at)
        into = self._packed.of(length).data
        return into[: file.readinto(into)]  # type: ignore[attr-defined]

    def decompress(self, compression: str, data: Buffer, size: int, crc: int | None) -> ByteArray:
        """Decompress the records of a chunk and check its checksum.

        Parameters
        ----------
        compression : {'zstd', 'lz4', ''}
        data : bytes-like
        size : int
            Bytes that must come out; no more is ever allocated than this and ``MAX_CHUNK_BYTES``.
        crc : int, optional
            CRC-32 of what comes out; None when there is none to compare.

        Raises
        ------
        ChunkError
            When the data is not what was written.
        """
        if size > MAX_CHUNK_BYTES:
            raise ChunkError(f"claims {size} bytes, more than {MAX_CHUNK_BYTES}")
        try:
            if compression == "zstd":
                raw = self._of_zstd(data, size)
            elif compression == "lz4":
                raw = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
            else:
                raw = bytes(data)
        except (zstandard.ZstdError, RuntimeError, ValueError, EOFError, MemoryError):
            raise ChunkError("cannot be decompressed") from None
        if len(raw) != size:
            raise ChunkError("has another size than it claims")
        if crc is not None and crc32(raw) != crc:
            raise ChunkError("checksum differs")
        return np.frombuffer(raw, np.uint8)

    def _of_zstd(self, data: Buffer, size: int) -> Buffer:
        """Decompress one zstd frame.

        The size that the frame claims is compared first: a frame that claims none may be of any size.
        """
        claimed = zstandard.get_frame_parameters(data).content_size
        if claimed not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise ChunkError("has another size than it claims")
        if size == 0:
            return b""
        if claimed != size:
            return self._zstd.decompress(data, max_output_size=size)
        into = self._unpacked.of(size).data
        with self._zstd.stream_reader(data) as frame:
            if frame.readinto(into) < size:
                raise ChunkError("cannot be decompressed")
        return into.toreadonly()


def decompress(compression: str, data: Buffer, size: int, crc: int | None) -> ByteArray:
    """Decompress a chunk into memory of its own, as :meth:`Unpacker.decompress` does."""
    return Unpacker().decompress(compression, data, size, crc)
