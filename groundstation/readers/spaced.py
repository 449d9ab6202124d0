"""Tables with blanks between columns, or columns of fixed width, seen with tabs.

A blank before each cell is shown as a tab, so every byte stays at its place: lines, their numbers and the bytes where
they begin are those of the file. Lines of fixed width are written anew: into memory, or into
a temporary file where they are many.
"""

import io
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.readers.held import HeldBytes, HeldView
from groundstation.readers.positioned import Positioned
from groundstation.readers.row_shapes import COMPILED_BYTES, RowShape, shape_of
from groundstation.readers.source import HEAD_BYTES, MadeSource, Source

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

_BLANK, _TAB, _LF, _CR = 32, 9, 10, 13
_NUMERIC = np.frombuffer(b"0123456789+-.", np.uint8)
_BEFORE_BYTES = 1 << 16  # looked at before a place for the beginning of its line
_PIECE_BYTES = 1 << 20
_WRITTEN_BYTES = 4 << 20
_LINE_BYTES = 16  # of a line, at least, in most tables
_MOST_BYTES = 1 << 26  # of a piece with tabs


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
        return tabbed(head + (b"\n" if is_whole else b""), self.cells, self.joined)[: len(head)]

    @property
    def lines(self) -> Source:
        """The source without tabs."""
        return self.whole

    def rows(self, lines: bytes) -> tuple[bytes, RowShape | None]:
        """Return lines with a tab before each cell; many lines without other blanks."""
        if len(lines) < COMPILED_BYTES or b'"' in lines:  # a cell in quotes keeps its blanks
            return tabbed(lines, self.cells, self.joined), None
        return _tightened(lines, self.cells, self.joined, keeps_blanks=False)

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
        ended = data if data[-1:] in (b"\n", b"\r") else data + b"\n"
        self._from, self._ready = start, tabbed(ended, self._cells, self._joined)[: len(data)]


def tabbed(lines: bytes, cells: int = 0, joined: Sequence[int] = ()) -> bytes:
    """Return lines with a tab for the last blank before each cell but the first.

    The last line is ended. ``cells`` and ``joined`` are those of :class:`SpacedSource`.

    Examples
    --------
    >>> line = b"  7  47 00 12.5   3 \\n"
    >>> tabbed(line), tabbed(line, 5, (1, 2))
    (b'  7 \\t47\\t00\\t12.5  \\t3 \\n', b'  7 \\t47 00 12.5  \\t3 \\n')
    """
    if len(lines) < COMPILED_BYTES:
        return _tabbed(np.frombuffer(lines, np.uint8), cells, joined)
    return _tightened(lines, cells, joined, keeps_blanks=True)[0]


def _tightened(lines: bytes, cells: int, joined: Sequence[int], *, keeps_blanks: bool) -> tuple[bytes, RowShape]:
    text = np.frombuffer(lines, np.uint8)
    is_joined = np.zeros(max(joined, default=-1) + 1, np.bool_)
    is_joined[list(joined)] = True
    tight = np.empty(len(text), np.uint8)
    shape = np.empty((2, len(text) // _LINE_BYTES + 1), np.int64)
    size = tighten(text, tight, shape, keeps_blanks, cells, is_joined)
    if size < 0:  # many short lines
        shape = np.empty((2, np.count_nonzero(text == _LF) + 1), np.int64)
        size = tighten(text, tight, shape, keeps_blanks, cells, is_joined)
    count = int(shape[0, -1])
    return tight[:size].tobytes(), RowShape(shape[0, :count], shape[1, :count])


def _tabbed(text: NDArray[np.uint8], cells: int, joined: Sequence[int]) -> bytes:
    """Return what :func:`tabbed` does without compiled code."""
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
def tighten(text: Any, tight: Any, shape: Any, keeps_blanks: bool, cells: int, is_joined: Any) -> int:
    """Write lines with a tab between cells and no other blanks, and return their length.

    It is -1 where there are more lines than the shape has room for. A line that begins with blanks keeps one, and a
    comment all: they are told by their first character.

    Parameters
    ----------
    text, tight : ndarray of uint8, shape (n,)
        Lines, the last one ended; receives them.
    shape : ndarray of int64, shape (2, lines + 1)
        Receives the place of each line feed in ``tight`` and the number of cells before it; in its last column the
        number of lines.
    keeps_blanks : bool
        Every line keeps its blanks.
    cells : int
        As that of :class:`SpacedSource`.
    is_joined : ndarray of bool, shape (k,)
        Gaps that part no cells in such rows.
    """
    at, size, most, end, lines = 0, 0, len(is_joined), len(text), 0
    first, first_size, gaps, count, before, is_torn = 0, 0, 0, 1, 1, False
    is_kept = keeps_blanks or (end > 0 and text[0] == 35)
    while 0 <= at < end and size >= 0:  # no place is negative, and the compiler is told so
        one = text[at]
        if one > 32:
            tight[size] = one
            size += 1
            at += 1
        elif one == 32 or one == 9:
            start = at
            while at < end and (text[at] == 32 or text[at] == 9):
                at += 1
            is_inside = start > first and at < end and text[at] != 10 and text[at] != 13
            left = at - start - (1 if is_inside else 0) if is_kept else 1 if start == first else 0
            for _blank in range(left):
                tight[size] = 32
                size += 1
            if is_inside:
                is_part = not is_torn or 48 <= text[at] <= 57 or text[at] == 43 or text[at] == 45 or text[at] == 46
                is_blank = gaps < most and is_joined[gaps] and is_part
                tight[size] = 32 if is_blank else 9
                count += 0 if is_blank else 1
                size += 1
                gaps += 1
        else:
            ends = one == 10 or one == 13
            if ends and most > 0 and gaps != cells - 1 and not is_torn:
                # Such a row must not look whole with its parts taken for columns: it is written again.
                at, size, gaps, is_torn = first, first_size, 0, True
                count = before  # cells before a lone carriage return are of the same line
                continue
            if one == 10:
                if lines == shape.shape[1] - 1:
                    return -1
                shape[0, lines], shape[1, lines] = size, count
                lines, count = lines + 1, 1
            tight[size] = one
            size += 1
            at += 1
            if ends:
                first, first_size, gaps, is_torn, before = at, size, 0, False, count
                is_kept = keeps_blanks or (at < end and text[at] == 35)
    shape[0, shape.shape[1] - 1] = lines
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
        return self._written.size

    def open(self) -> BinaryIO:
        """Open for reading bytes with tabs."""
        return io.BufferedReader(HeldView(self._written))

    @cached_property
    def _written(self) -> HeldBytes:
        held = HeldBytes()
        with self.whole.open() as stream:
            rest = b""
            while data := stream.read(_WRITTEN_BYTES):
                end = data.rfind(b"\n") + 1
                if not end and len(rest) < _WRITTEN_BYTES:
                    rest += data
                    continue
                held.extend(self._parted(rest + data[:end] if end else rest))
                rest = data[end:] if end else data
        held.extend(self._parted(rest))
        return held

    def rows(self, lines: bytes) -> tuple[bytes, RowShape | None]:
        """Return the lines, and their shape."""
        return lines, shape_of(lines, "\t", is_compiled=True)

    def _parted(self, lines: bytes) -> Iterator[Any]:
        """Yield lines with a tab between the columns."""
        bounds = (0, *np.cumsum(self.widths)[:-1].tolist())
        if not lines.isascii():  # a character may have several bytes
            yield from (_parted_characters(line, bounds) for line in io.BytesIO(lines))
            return
        most = len(lines) + lines.count(b"\n") * len(bounds)
        if len(lines) < COMPILED_BYTES or most > _MOST_BYTES or not lines.endswith(b"\n"):
            yield from (_parted_line(line, bounds) for line in io.BytesIO(lines))
            return
        text, made = np.frombuffer(lines, np.uint8), np.empty(most, np.uint8)
        yield made[: part(text, made, np.array(bounds, np.int64), b'"' in lines)]


def _parted_line(line: bytes, bounds: Sequence[int]) -> bytes:
    """Return a line with a tab before each column but the first.

    A line without an end has no cells behind the place where it is cut.
    """
    content = line.rstrip(b"\r\n")
    if not content.strip() or content.startswith(b"#"):
        return line
    if not line.endswith(b"\n"):
        bounds = [at for at in bounds if at < len(content)]
    cells = [content[at:end] for at, end in zip(bounds, (*bounds[1:], None), strict=True)]
    return b"\t".join(cells) + line[len(content) :]


def _parted_characters(line: bytes, bounds: Sequence[int]) -> bytes:
    """Return a line with a tab before each column, of widths in characters of UTF-8.

    A byte that is none of UTF-8 counts as a character: those of cp1251 are.
    """
    text = line.decode("utf-8", errors="surrogateescape")
    places = [len(text[:at].encode("utf-8", errors="surrogateescape")) for at in bounds]
    return _parted_line(line, places)


@in_place
def part(text: Any, made: Any, bounds: Any, has_quotes: bool) -> int:
    """Write lines with a tab before each column but the first; return their length.

    A row that begins with a number loses the blanks around its cells, but for one in front of the first; not where
    there are quotes. Blank lines and comments stay as they are.

    Parameters
    ----------
    text, made : ndarray of uint8
        Lines, each ended; receives them.
    bounds : ndarray of int64, shape (columns,)
        First byte of each column in a line.
    """
    at, size, columns = 0, 0, len(bounds)
    while at < len(text):
        first = at
        if at >= 0:  # no place is negative, and the compiler is told so: else it asks for each byte
            while text[at] != 10:
                at += 1
        at += 1
        end = at - 1
        while end > first and text[end - 1] == 13:
            end -= 1
        behind = first
        while behind < end and (text[behind] == 32 or 9 <= text[behind] <= 13):
            behind += 1
        if behind == end or text[first] == 35:
            for place in range(first, at):
                made[size] = text[place]
                size += 1
            continue
        one = text[behind]
        is_tight = not has_quotes and (48 <= one <= 57 or one == 43 or one == 45 or one == 46)
        for column in range(columns):
            start = min(first + bounds[column], end)
            stop = min(first + bounds[column + 1], end) if column + 1 < columns else end
            if column:
                made[size] = 9
                size += 1
            elif is_tight and start < stop and text[start] == 32:
                made[size] = 32
                size += 1
            if is_tight:
                while start < stop and text[start] == 32:
                    start += 1
                while stop > start and text[stop - 1] == 32:
                    stop -= 1
            if start >= 0 and size >= 0:
                count = stop - start
                for place in range(count):
                    made[size + place] = text[start + place]
                if count > 0:
                    size += count
        for place in range(end, at):
            made[size] = text[place]
            size += 1
    return size
