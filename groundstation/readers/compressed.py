"""Compressed logs: gzip and zstd, told by their content.

They are decompressed once into an unnamed temporary file.

Sizes that the file declares are not believed: what comes out is counted, and stops at a bound. What a cut or damaged
file still gives is kept.
"""

import os
import tempfile
import weakref
import zlib
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import zstandard

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage
from groundstation.readers.positioned import Positioned

GZIP_MAGIC, ZSTD_MAGIC = b"\x1f\x8b\x08", b"\x28\xb5\x2f\xfd"
MAX_RATIO = 200  # a recorded flight shrinks 2 to 20 times, a table of constants some 100 times
MIN_LIMIT_BYTES = 64 << 20  # small files may expand this far whatever the ratio
MAX_LIMIT_BYTES = 64 << 30
FREE_FRAMES, BYTES_PER_FRAME = 10_000, 512  # more frames than the first, each of fewer bytes, are no log
_READ_BYTES = 256 << 10
_STEP_BYTES = 1 << 20
_GZIP_HEADER_BYTES = 70_000  # names, comments and extras are shorter
_GZIP_STEP_BYTES = 4 << 10  # where data is damaged, a step is repeated byte by byte
_ZSTD_STEP_BYTES = 256  # decompressobj has no bound on its output: 256 bytes expand to 8 MiB at most
_Pieces = Iterator[bytes]


@dataclass(frozen=True)
class Expanded:
    """Content of a compressed file: a temporary file, its size, and the damage met.

    ``damage`` is None when the file was whole.
    """

    file: BinaryIO
    size: int
    damage: Damage | None


def compression_of(start: bytes) -> str:
    """Return ``gzip``, ``zstd`` or an empty text, by the first bytes of a file.

    Examples
    --------
    >>> compression_of(bytes.fromhex("1f8b0800")), compression_of(b"ULog")
    ('gzip', '')
    """
    return "gzip" if start.startswith(GZIP_MAGIC) else "zstd" if start.startswith(ZSTD_MAGIC) else ""


def head_of(stream: BinaryIO, compression: str, size: int) -> bytes:
    """The first ``size`` decompressed bytes, fewer where there are no more."""
    head = bytearray()
    try:
        for piece in _PIECES[compression](stream):
            head += piece
            if len(head) >= size:
                break
    except _Broken:
        pass  # the head is what came before; the damage is reported when all is read
    return bytes(head[:size])


def expand(stream: BinaryIO, compression: str, compressed_size: int, name: str) -> Expanded:
    """Decompress all of a file into an unnamed temporary file.

    Raises
    ------
    UnreadableLogError
        When it expands beyond :data:`MAX_RATIO` times its size (64 MiB at least, 64 GiB at most), or the disk is full.
    """
    limit = min(max(MAX_RATIO * compressed_size, MIN_LIMIT_BYTES), MAX_LIMIT_BYTES)
    size, damage = 0, None
    try:
        file = unnamed_file()
        try:
            for piece in _PIECES[compression](stream):
                size += len(piece)
                if size > limit:
                    raise UnreadableLogError(
                        name, f"{compression} data that expands beyond {limit} bytes", "", "decompress it yourself"
                    )
                file.write(piece)
        except _Broken as broken:
            damage = Damage(broken.kind, f"byte {size} of the decompressed log", 1, f"{compression} data: {broken}")
        file.flush()
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UnreadableLogError(name, f"{compression} data that cannot be decompressed ({reason})") from error
    return Expanded(file, size, damage)


def unnamed_file() -> BinaryIO:
    """Return an empty temporary file that is closed with its last user.

    Python does not warn that it was left open.
    """
    with tempfile.TemporaryFile() as made:
        descriptor = os.dup(made.fileno())
    file = os.fdopen(descriptor, "w+b", closefd=False)
    weakref.finalize(file, os.close, descriptor)
    return file


class FileWindow(Positioned):
    """A read-only view of a shared file with a position of its own."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._size = file, size

    def _length(self) -> int:
        return self._size

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer`` from the position on and return the number of bytes."""
        self._file.seek(self._at)
        count: int = self._file.readinto(buffer)  # type: ignore[attr-defined]
        self._at += count
        return count


class _Broken(Exception):  # noqa: N818 -- a signal inside this module
    """Compressed data that ends early or makes no sense from some place on."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


class _FrameCount:
    """Count of members or frames; a file of little but their headers is no log."""

    def __init__(self) -> None:
        self._count = self._bytes = 0

    def add(self, size: int) -> None:
        """Count one of ``size`` decompressed bytes."""
        self._count, self._bytes = self._count + 1, self._bytes + size
        if self._count > FREE_FRAMES + self._bytes // BYTES_PER_FRAME:
            raise _Broken("corrupt", f"it is cut into {self._count} frames of {self._bytes} bytes in all")


def _gzip_pieces(stream: BinaryIO) -> _Pieces:
    """Yield decompressed pieces of all members of a gzip file.

    Zero bytes after the last member are padding.

    The frame of a member is read here: zlib's own reader withholds what it has when the checksum behind is wrong.
    """
    data, at, count = stream.read(_READ_BYTES), 0, _FrameCount()
    while at < len(data):
        if len(data) - at < _GZIP_HEADER_BYTES:
            data, at = data[at:] + stream.read(_READ_BYTES), 0
        at = _behind_gzip_header(data, at)
        member, checksum, size = zlib.decompressobj(wbits=-15), 0, 0
        while not member.eof:
            if at >= len(data):
                data, at = stream.read(_READ_BYTES), 0
            if not data:
                raise _Broken("truncated", "it ends early: the file was cut")
            step, before = data[at : at + _GZIP_STEP_BYTES], member.copy()
            try:
                piece = member.decompress(step, _STEP_BYTES)
            except zlib.error as error:
                yield from _last_pieces(before, step)
                raise _Broken("corrupt", "it makes no sense from here on") from error
            at += len(step) - len(member.unused_data if member.eof else member.unconsumed_tail)
            checksum, size = zlib.crc32(piece, checksum), size + len(piece)
            if piece:
                yield piece
        if len(data) - at < 8:
            data, at = data[at:] + stream.read(_READ_BYTES), 0
        if len(data) - at < 8:
            raise _Broken("truncated", "it ends before its checksum: the file was cut")
        if data[at : at + 8] != checksum.to_bytes(4, "little") + (size & 0xFFFFFFFF).to_bytes(4, "little"):
            raise _Broken("corrupt", "its checksum or size is not that of what came out")
        count.add(size)
        at += 8
        data, at = (data, at) if at < len(data) else (stream.read(_READ_BYTES), 0)
        while at < len(data) and not data[at] and not data[at:].strip(b"\0"):
            data, at = stream.read(_READ_BYTES), 0


def _last_pieces(member: Any, data: bytes) -> _Pieces:
    """Yield what a broken member still gives before the place where it breaks, byte by byte."""
    for at in range(len(data)):
        try:
            piece = member.decompress(data[at : at + 1])
        except zlib.error:
            return
        if piece:
            yield piece


def _behind_gzip_header(data: bytes, at: int) -> int:
    """Return the end of the header of the gzip member that begins at ``at`` (RFC 1952)."""
    if not data.startswith(GZIP_MAGIC, at):
        raise _Broken("corrupt", "it makes no sense from here on")
    flags, at = (data[at + 3] if len(data) > at + 3 else 0), at + 10
    if flags & 4:
        at += 2 + int.from_bytes(data[at : at + 2], "little")
    for flag in (8, 16):  # name and comment, each ended by a zero byte
        if flags & flag:
            end = data.find(b"\0", at)
            at = len(data) + 1 if end < 0 else end + 1
    at += 2 if flags & 2 else 0
    if at > len(data):
        raise _Broken("truncated", "it ends within its header")
    return at


def _zstd_pieces(stream: BinaryIO) -> _Pieces:
    """Decompressed pieces of all frames of a zstd file."""
    data, at, count = stream.read(_READ_BYTES), 0, _FrameCount()
    frame: Any = None
    size = 0
    while at < len(data) or frame is not None:
        if frame is None:
            frame, size = zstandard.ZstdDecompressor(max_window_size=128 << 20).decompressobj(), 0
        if at >= len(data):
            raise _Broken("truncated", "it ends early: the file was cut")
        step = data[at : at + _ZSTD_STEP_BYTES]
        try:
            piece = frame.decompress(step)
        except zstandard.ZstdError as error:
            raise _Broken("corrupt", "it makes no sense from here on") from error
        at, size = at + len(step), size + len(piece)
        if piece:
            yield piece
        if frame.eof:
            at -= len(frame.unused_data)
            frame = None
            count.add(size)
        if at >= len(data):
            data, at = stream.read(_READ_BYTES), 0


_PIECES: dict[str, Callable[[BinaryIO], _Pieces]] = {"gzip": _gzip_pieces, "zstd": _zstd_pieces}
COMPRESSIONS = tuple(_PIECES)
