"""Consecutive files of one recording, seen as one file; bytes in memory, seen as a file."""

import io
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import accumulate
from typing import Any, BinaryIO

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage
from groundstation.readers.dialect import DELIMITERS
from groundstation.readers.positioned import Positioned
from groundstation.readers.source import HEAD_BYTES, MadeSource, Source

_LOOKED_AT = 1 << 16  # bytes at the end of a file and at the beginning of the next in which lines are looked for


@dataclass(frozen=True)
class JoinedSource(MadeSource):
    """Files that were written one after the other, seen as one file.

    Their bytes follow one another.

    Containers of messages are read file by file, from ``files``.

    Parameters
    ----------
    path : Path
        Of the first.
    files : tuple of Source
        All of them.
    """

    files: tuple[Source, ...] = ()

    @cached_property
    def size(self) -> int:
        """Bytes of all files, decompressed."""
        return self._ends[-1]

    @cached_property
    def head(self) -> bytes:
        """First bytes, of as many files as it takes."""
        head = b""
        for piece in self._pieces:
            head += piece if isinstance(piece, bytes) else piece.head
            if len(head) >= HEAD_BYTES or (not isinstance(piece, bytes) and piece.size > len(piece.head)):
                break
        return head[:HEAD_BYTES]

    @cached_property
    def is_empty(self) -> bool:
        """Tell whether all files are empty."""
        return all(file.is_empty for file in self.files)

    def open(self) -> BinaryIO:
        """Open for reading bytes; errors are those of a single file."""
        return io.BufferedReader(_Chain(self._pieces, self._ends))

    def damages(self) -> tuple[Damage, ...]:
        """Damage of compressed files, once they were opened."""
        return tuple(replace(one, place=f"{file.name}, {one.place}") for file in self.files for one in file.damages())

    @cached_property
    def _pieces(self) -> "tuple[Source | bytes, ...]":
        """Files, and a line feed between two where rows of a table would run together."""
        pieces: list[Source | bytes] = [self.files[0]]
        for before, file in zip(self.files, self.files[1:], strict=False):
            pieces += [*([b"\n"] if _runs_together(before, file) else []), file]
        return tuple(pieces)

    @cached_property
    def _ends(self) -> list[int]:
        return list(accumulate(len(piece) if isinstance(piece, bytes) else piece.size for piece in self._pieces))


@dataclass(frozen=True)
class BytesSource(MadeSource):
    """Bytes in memory, under the name of a file."""

    content: bytes = b""

    @property
    def size(self) -> int:
        """Number of bytes."""
        return len(self.content)

    @property
    def head(self) -> bytes:
        """First bytes."""
        return self.content[:HEAD_BYTES]

    @property
    def is_empty(self) -> bool:
        """Tell whether there are no bytes."""
        return not self.content

    def open(self) -> BinaryIO:
        """Open for reading bytes."""
        return io.BytesIO(self.content)


class _Chain(Positioned):
    """Read-only view of consecutive files, each opened when it is first read."""

    def __init__(self, pieces: "Sequence[Source | bytes]", ends: Sequence[int]) -> None:
        self._pieces, self._ends = pieces, ends
        self._open: tuple[int, BinaryIO] | None = None

    def _length(self) -> int:
        return self._ends[-1]

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer`` from the position on and return the number of bytes.

        It stops at the end of the file that the position is in.
        """
        number = bisect_right(self._ends, self._at)
        if number == len(self._ends):
            return 0
        piece, start = self._pieces[number], self._ends[number - 1] if number else 0
        if self._open is None or self._open[0] != number:
            self._close()
            self._open = number, io.BytesIO(piece) if isinstance(piece, bytes) else piece.open()
        stream = self._open[1]
        stream.seek(self._at - start)
        count: int = stream.readinto(memoryview(buffer)[: self._ends[number] - self._at])  # type: ignore[attr-defined]
        self._at += count
        return count

    def close(self) -> None:
        """Close the view, and the file that is open."""
        self._close()
        super().close()

    def _close(self) -> None:
        if self._open is not None:
            self._open[1].close()
            self._open = None


def _runs_together(before: Source, behind: Source) -> bool:
    """Tell whether a file ends in a row without line end, before a file that begins a line."""
    with before.open() as stream:
        stream.seek(max(0, before.size - _LOOKED_AT))
        lines = stream.read().splitlines(keepends=True)
    if len(lines) < 2 or lines[-1].endswith((b"\n", b"\r")):
        return False
    first = behind.head[:_LOOKED_AT].split(b"\n", 1)[0]
    if b"\0" in lines[-1] or b"\0" in first:
        return False
    if first.startswith((b"#", b"$", b"!")):
        return True
    cells = _cells(lines[-2], lines[-2])
    return cells > 1 and cells == _cells(lines[-1], lines[-2]) == _cells(first, lines[-2])


def _cells(line: bytes, like: bytes) -> int:
    """Return the number of cells of a row, split like the row ``like``.

    The delimiter is the one that ``like`` has most of, else blanks.
    """
    mark = max((delimiter.encode() for delimiter in DELIMITERS), key=like.count)
    return line.count(mark) + 1 if mark in like else len(line.split())
