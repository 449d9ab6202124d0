"""Bytes made once and read anywhere: in memory while they are few, else in a file."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator
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
        self._most, self.size = most, 0
        self._pieces, self._starts = list[memoryview](), list[int]()  # as they came, and where each begins
        self._file: BinaryIO | None = None  # has them all once they are many

    def write(self, data: Any) -> int:
        """Append bytes, which nobody changes afterwards, and return their number."""
        count = len(data)
        if self._file is None and self.size + count > self._most:
            self._file = unnamed_file()
            self._file.writelines(self._pieces)
            self._pieces, self._starts = [], []
        if self._file is not None:
            self._file.seek(self.size)
            self._file.write(data)
        elif count:
            self._starts.append(self.size)
            self._pieces.append(memoryview(data))
        self.size += count
        return count

    def extend(self, pieces: Iterable[Any]) -> None:
        """Append pieces of bytes."""
        for piece in pieces:
            self.write(piece)

    def read(self, at: int, size: int) -> bytes:
        """Return bytes from a place on."""
        if self._file is None:
            return b"".join(self._views(at, size))
        self._file.seek(at)
        return self._file.read(size)

    def readinto(self, at: int, buffer: "WriteableBuffer") -> int:
        """Fill a buffer from a place on and return the number of bytes."""
        if self._file is not None:
            self._file.seek(at)
            count: int = self._file.readinto(buffer)  # type: ignore[attr-defined]
            return count
        into, filled = memoryview(buffer).cast("B"), 0
        for view in self._views(at, len(into)):
            into[filled : filled + len(view)] = view
            filled += len(view)
        return filled

    def _views(self, at: int, size: int) -> Iterator[memoryview]:
        """Yield up to so many bytes in memory from a place on, as they lie in the pieces."""
        for place in range(max(bisect_right(self._starts, at) - 1, 0), len(self._pieces)):
            start = self._starts[place]
            if start >= at + size:
                return
            yield self._pieces[place][max(at - start, 0) : at + size - start]


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
