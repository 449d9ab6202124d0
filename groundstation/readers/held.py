"""Bytes made once and read anywhere: in memory while they are few, else in a file."""

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, BinaryIO

from groundstation.readers.compressed import unnamed_file
from groundstation.readers.positioned import Positioned

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

MOST_HELD_BYTES = 1 << 26


class HeldBytes:
    """Bytes that are written at the end and read anywhere.

    Examples
    --------
    >>> held = HeldBytes(most=3)
    >>> held.write(b"abc"), held.write(b"de"), held.read(1, 3), held.size
    (3, 2, b'bcd', 5)
    """

    def __init__(self, most: int = MOST_HELD_BYTES) -> None:
        self._stream: BinaryIO = io.BytesIO()
        self._most, self._is_file = most, False
        self.size = 0

    def write(self, data: Any) -> int:
        """Append bytes and return their number."""
        self._stream.seek(self.size)
        self.size += len(data)
        if self.size > self._most and not self._is_file:
            held, self._stream, self._is_file = self._stream, unnamed_file(), True
            self._stream.write(held.getbuffer())  # type: ignore[attr-defined]
        return self._stream.write(data)

    def extend(self, pieces: Iterable[Any]) -> None:
        """Append pieces of bytes."""
        for piece in pieces:
            self.write(piece)

    def read(self, at: int, size: int) -> bytes:
        """Return bytes from a place on."""
        self._stream.seek(at)
        return self._stream.read(size)

    def readinto(self, at: int, buffer: "WriteableBuffer") -> int:
        """Fill a buffer from a place on and return the number of bytes."""
        self._stream.seek(at)
        count: int = self._stream.readinto(buffer)  # type: ignore[attr-defined]
        return count


class HeldView(Positioned):
    """Read-only view of held bytes with a position of its own."""

    def __init__(self, held: HeldBytes) -> None:
        self._held = held

    def _length(self) -> int:
        return self._held.size

    def readinto(self, buffer: "WriteableBuffer") -> int:
        """Fill ``buffer`` from the position on and return the number of bytes."""
        count = self._held.readinto(self._at, buffer)
        self._at += count
        return count
