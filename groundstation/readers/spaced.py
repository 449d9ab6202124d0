"""Tables with blanks between columns, or columns of fixed width, seen with tabs.

A blank before each cell is shown as a tab, so every byte stays at its place: lines, their numbers and the bytes where
they begin are those of the file. Where cells of fixed width touch, the lines are written anew into a temporary file.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place
from groundstation.base.records import BoolArray
from groundstation.readers.compressed import FileWindow, unnamed_file
from groundstation.readers.positioned import Positioned
from groundstation.readers.source import HEAD_BYTES, MadeSource, RowShape, Source

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_BLANK, _TAB, _LF, _CR = 32, 9, 10, 13
_NUMERIC = np.frombuffer(b"0123456789+-.", np.uint8)
_BEFORE_BYTES = 1 << 16  # looked at before a place for the beginning of its line
_PIECE_BYTES = 1 << 20
_COMPILED_BYTES = 1 << 18  # below it numpy takes a moment, and a compiler some seconds


@dataclass(frozen=True)
class SpacedSource(MadeSource):
    """Another source with a tab before each cell.

    Parameters
    ----------
    whole : Source
    cells : int
        Number of cells of a row in which cells belong together; 0: there are none.
    joined : tuple of int
        Gaps of such rows, counted from 0, that part no cells: ``47 00 12.5`` of degrees, minutes and seconds.
    """

    whole: Source
    cells: int = 0
    joined: tuple[int, ...] = ()

    @cached_property
    def size(self) -> int:
        """Size in bytes."""
        return self.whole.size

    @cached_property
    def head(self) -> bytes:
        """The first bytes, with tabs."""
        head = self.whole.head
        is_whole = len(head) < HEAD_BYTES
        return tabbed(np.frombuffer(head + (b"\n" if is_whole else b""), np.uint8), self.cells, self.joined)[
            : len(head)
        ]

    @property
    def lines(self) -> Source:
        """The source without tabs."""
        return self.whole

    def rows(self, lines: bytes) -> tuple[bytes, RowShape | None]:
        """Return lines with a tab before each cell, and no other blanks where there are many lines."""
        text = np.frombuffer(lines, np.uint8)
        if len(lines) < _COMPILED_BYTES or b'"' in lines:  # a cell in quotes keeps its blanks
            return tabbed(text, self.cells, self.joined), None
        is_joined = np.zeros(max(self.joined, default=-1) + 1, np.bool_)
        is_joined[list(self.joined)] = True
        tight, shape = np.empty(len(text), np.uint8), np.empty((2, np.count_nonzero(text == _LF)), np.int64)
        size = tighten(text, tight, shape, self.cells, is_joined)
        return tight[:size].tobytes(), RowShape(shape[0], shape[1])

    def open(self) -> BinaryIO:
        """Open for reading bytes with tabs."""
        return io.BufferedReader(_Tabs(self.whole.open(), self.cells, self.joined), _PIECE_BYTES)


class _Tabs(Positioned):
    """Bytes of a stream with a tab before each cell, from any place on."""

    def __init__(self, stream: BinaryIO, cells: int, joined: tuple[int, ...]) -> None:
        self._stream, self._cells, self._joined = stream, cells, joined
        self._from, self._ready = 0, b""  # whole lines that are converted, and where they begin

    def _length(self) -> int:
        return self._stream.seek(0, io.SEEK_END)

    def close(self) -> None:
        self._stream.close()
        super().close()

    def readinto(self, buffer: "WriteableBuffer") -> int:
        view = memoryview(buffer).cast("B")
        if not self._from <= self._at < self._from + len(self._ready):
            self._convert()
        begin = self._at - self._from
        count = min(len(view), len(self._ready) - begin)
        if count <= 0:
            return 0
        view[:count] = self._ready[begin : begin + count]
        self._at += count
        return count

    def _convert(self) -> None:
        """Convert the lines around the place that is asked for."""
        is_next = self._at == self._from + len(self._ready)
        start = self._at if is_next else max(0, self._at - _BEFORE_BYTES)
        self._stream.seek(start)
        data = self._stream.read(_PIECE_BYTES + self._at - start)
        if not is_next and start:
            line = max(data.rfind(b"\n", 0, self._at - start), data.rfind(b"\r", 0, self._at - start)) + 1
            start, data = start + line, data[line:]
        more = self._stream.read(1) if data else b""
        if more:
            end = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1
            data = data[:end] if end > self._at - start else data + more  # else a line longer than a piece
        array = np.frombuffer(data if data[-1:] in (b"\n", b"\r") else data + b"\n", np.uint8)
        self._from, self._ready = start, tabbed(array, self._cells, self._joined)[: len(data)]


def tabbed(text: NDArray[np.uint8], cells: int = 0, joined: Sequence[int] = ()) -> bytes:
    """Return lines with a tab for the last blank before each cell but the first.

    Parameters
    ----------
    text : ndarray of uint8, shape (n,)
        Lines, the last one ended.
    cells, joined
        As those of :class:`SpacedSource`.

    Examples
    --------
    >>> line = np.frombuffer(b"  7  47 00 12.5   3 \\n", np.uint8)
    >>> tabbed(line), tabbed(line, 5, (1, 2))
    (b'  7 \\t47\\t00\\t12.5  \\t3 \\n', b'  7 \\t47 00 12.5  \\t3 \\n')
    """
    converted = text.copy()
    converted[text == _TAB] = _BLANK
    is_blank = converted == _BLANK
    changes = np.flatnonzero(is_blank[1:] != is_blank[:-1]) + 1
    if len(is_blank) and is_blank[0]:
        changes = changes[1:]  # blanks before the first cell part none
    starts, begins = changes[: len(changes) // 2 * 2 : 2], changes[1::2]  # of each run of blanks, and behind it
    begins = begins[~_ends_line(text[starts - 1]) & ~_ends_line(text[begins])]
    converted[begins - 1] = _TAB
    if joined and len(begins):
        line = np.searchsorted(np.flatnonzero(_ends_line(text)), begins)
        first = np.flatnonzero(np.append(True, line[1:] != line[:-1]))
        counts = np.diff(np.append(first, len(begins)))
        number = np.arange(len(begins)) - np.repeat(first, counts)
        # A row that is cut or torn has other cells, and must not look whole with its parts taken for columns.
        is_part = (np.repeat(counts, counts) == cells - 1) | np.isin(text[begins], _NUMERIC)
        inside = is_part & np.isin(number, joined)
        converted[begins[inside] - 1] = _BLANK
    return converted.tobytes()


@in_place
def tighten(text: Any, tight: Any, shape: Any, cells: int, is_joined: Any) -> int:
    """Write lines with a tab between cells and no other blanks; return their length.

    A line that begins with blanks keeps one, and a comment all: they are told by their first character.

    Parameters
    ----------
    text, tight : ndarray of uint8, shape (n,)
        Lines, the last one ended; receives them.
    shape : ndarray of int64, shape (2, lines)
        Receives the place of each line feed in ``tight``, and the number of cells before it.
    cells : int
        As that of :class:`SpacedSource`.
    is_joined : ndarray of bool, shape (k,)
        Gaps that part no cells in such rows.
    """
    at, size, most, end, line, count = 0, 0, len(is_joined), len(text), 0, 1
    while at < end:
        is_comment, gaps, gap = text[at] == 35, 0, 0
        if most > 0:
            ahead = at
            while ahead < end and text[ahead] != 10 and text[ahead] != 13:
                is_blank = text[ahead] == 32 or text[ahead] == 9
                was_blank = ahead > at and (text[ahead - 1] == 32 or text[ahead - 1] == 9)
                gaps += 1 if was_blank and not is_blank else 0
                ahead += 1
            gaps -= 1 if text[at] == 32 or text[at] == 9 else 0
        first = at
        while at < end:
            one = text[at]
            if one > 32:
                tight[size] = one
                size += 1
                at += 1
            elif one == 32 or one == 9:
                start = at
                while at < end and (text[at] == 32 or text[at] == 9):
                    at += 1
                is_last = at == end or text[at] == 10 or text[at] == 13
                is_inside = start > first and not is_last
                kept = at - start - (1 if is_inside else 0) if is_comment else 1 if start == first else 0
                for _blank in range(kept):
                    tight[size] = 32
                    size += 1
                if is_inside:
                    is_part = gaps == cells - 1 or (at < end and (48 <= text[at] <= 57 or text[at] in (43, 45, 46)))
                    is_blank = gap < most and is_joined[gap] and is_part
                    tight[size] = 32 if is_blank else 9
                    count += 0 if is_blank else 1
                    size += 1
                    gap += 1
            else:
                if one == 10:
                    shape[0, line], shape[1, line] = size, count
                    line, count = line + 1, 1
                tight[size] = one
                size += 1
                at += 1
                if one == 10 or one == 13:
                    break
    return size


def _ends_line(characters: NDArray[np.uint8]) -> BoolArray:
    return np.asarray((characters == _LF) | (characters == _CR))


@dataclass(frozen=True)
class FixedSource(MadeSource):
    """Another source whose columns have fixed widths, with a tab between the columns.

    A line that is shorter than the columns has empty cells; what stands behind the last column belongs to it.
    """

    whole: Source
    widths: tuple[int, ...]

    @cached_property
    def size(self) -> int:
        """Size in bytes, tabs counted."""
        return self._written[1]

    def open(self) -> BinaryIO:
        """Open for reading bytes with tabs."""
        return io.BufferedReader(FileWindow(*self._written))

    @cached_property
    def _written(self) -> tuple[BinaryIO, int]:
        file, size = unnamed_file(), 0
        ends = np.cumsum(self.widths)[:-1].tolist()
        with self.whole.open() as stream:
            for line in iter(lambda: stream.readline(_PIECE_BYTES), b""):
                content = line.rstrip(b"\r\n")
                cells = [content[at:end] for at, end in zip((0, *ends), (*ends, None), strict=True)]
                is_row = bool(content.strip()) and not content.startswith(b"#")
                made = b"\t".join(cells) + line[len(content) :] if is_row else line
                size += file.write(made)
        file.flush()
        return file, size
