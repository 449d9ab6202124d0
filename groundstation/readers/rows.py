"""Cut a delimited file into blocks of sound rows.

Damaged rows are counted and left out.

The scanner looks at bytes alone (vectorised): a row is sound when it has the number of cells that the header has. So
one flipped bit costs a row or a cell, never the rest of a block, and the CSV parser needs no quoting rules.
"""

import re
from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import BoolArray, Int64Array
from groundstation.readers.dialect import Dialect, normal_form
from groundstation.readers.losses import Losses
from groundstation.readers.row_shapes import RowShape, shape_of
from groundstation.readers.source import Source

BLOCK_BYTES = 4 << 20
MAX_LINE_BYTES = 8 << 20
MOST_SKIPPED = 10_000  # lines inside a file that are kept: more are no headers
_LF, _QUOTE = 10, 34
_PADDED_QUOTE = re.compile(r'" +(?=[,;\t]|$)')
_NOTHING = b" \t\x1a"  # a line of nothing else is blank: padding, or the end mark of DOS
_STRANGE = b"\x1a"  # takes the place of NUL and lone CR: no number, no text that a recorder writes
_QUOTED_DELIMITER = "\x1f"  # takes the place of a delimiter inside quotes until the cell is a text again


@dataclass(frozen=True)
class RowBlock:
    """Sound rows as UTF-8 text, each ended by a line feed, and their line numbers (from 1)."""

    text: bytes
    line_numbers: Int64Array


def restore_delimiters(text: str, delimiter: str) -> str:
    """Restore the delimiters that stood inside quotes in a text cell."""
    return text.replace(_QUOTED_DELIMITER, delimiter)


class RowScanner:
    """Iterator over the blocks of sound rows of a source; counts losses into ``losses``.

    ``is_compiled``: cells are counted by a compiled loop where there are many rows.
    """

    def __init__(self, source: Source, dialect: Dialect, losses: Losses, *, is_compiled: bool = False) -> None:
        self._is_compiled = is_compiled
        self._source, self._dialect, self._losses = source, dialect, losses
        self._next_line = dialect.first_line
        # Lines left out behind a header may lie behind the end of its rows.
        self._left = None if dialect.end_byte is None else max(0, dialect.end_byte - dialect.first_byte)
        self._newline = b"\n" if b"\n" in source.head or b"\r" not in source.head else b"\r"
        self.ends_without_newline = False
        self.skipped: dict[int, str] = {}  # header and comment lines inside the file, by their numbers

    def __iter__(self) -> Iterator[RowBlock]:
        with self._source.lines.open() as stream:
            stream.seek(self._dialect.first_byte)
            for piece, is_cut in self._pieces(stream):
                text, shape = self._source.rows(piece)
                clean = self._clean(text)
                block = self._scan(clean, is_cut, shape if clean is text else None)
                if len(block.line_numbers):
                    yield block

    def _read(self, stream: BinaryIO) -> bytes:
        try:
            data = stream.read(BLOCK_BYTES if self._left is None else min(BLOCK_BYTES, self._left))
        except OSError as error:  # a failing disk or network share
            where = f"{self._source.name}, row {self._next_line}"
            raise UnreadableLogError(where, f"no more data ({error.strerror})", "", "copy the file again") from error
        if self._left is not None:
            self._left -= len(data)
        return data

    def _pieces(self, stream: BinaryIO) -> Iterator[tuple[bytes, bool]]:
        """Yield pieces of whole lines.

        The last line of a file that ends without a line feed comes alone, marked as cut.
        """
        rest = b""
        while data := self._read(stream):
            if self._newline != b"\n":
                data = data.replace(self._newline, b"\n")
            end = data.rfind(b"\n")
            if end < 0 and not rest.strip(b"\0") and not data.strip(b"\0"):
                continue  # a file that was made longer than its data: NUL bytes without end
            if end < 0:
                rest += data
                if len(rest) > MAX_LINE_BYTES:
                    rest = self._skip_huge_line(stream)
                continue
            yield rest + data[: end + 1], False
            rest = data[end + 1 :]
        if rest:
            yield rest + b"\n", True

    def _skip_huge_line(self, stream: BinaryIO) -> bytes:
        line = np.array([self._next_line])
        self._losses.add("dropped_rows", f"row longer than {MAX_LINE_BYTES >> 20} MiB", line)
        self._next_line += 1
        while data := self._read(stream):
            end = data.find(self._newline)
            if end >= 0:
                stream.seek(end + 1 - len(data), 1)
                self._left = None if self._left is None else self._left + len(data) - end - 1
                break
        return b""

    def _clean(self, piece: bytes) -> bytes:
        """Return UTF-8 text with LF line ends; a mark replaces bytes that are no text."""
        if not piece.isascii():
            encoding = self._dialect.encoding
            piece = piece.decode(encoding, errors="replace").encode("utf-8")
        if b"\r" in piece:
            piece = piece.replace(b"\r\n", b"\n").replace(b"\r", _STRANGE)
        return piece.replace(b"\0", _STRANGE) if b"\0" in piece else piece

    def _scan(self, text: bytes, is_cut: bool, shape: RowShape | None) -> RowBlock:
        if b'"' in text:
            text, shape = without_quotes(text, self._dialect.delimiter), None
        array = np.frombuffer(text, dtype=np.uint8)
        shape = shape or shape_of(text, self._dialect.delimiter, is_compiled=self._is_compiled)
        ends, cells = shape.ends, shape.cells
        starts = np.concatenate(([0], ends[:-1] + 1))
        numbers = self._next_line + np.arange(len(ends), dtype=np.int64)
        self._next_line += len(ends)
        skipped = self._skipped_lines(text, array, starts, ends, cells, numbers)
        sound = (cells == self._dialect.cells) & ~skipped
        self.ends_without_newline |= is_cut and bool(sound.all())
        if sound.all():
            return RowBlock(text, numbers)
        unsound = np.flatnonzero(~sound & ~skipped)
        filled = [bool(text[starts[at] : ends[at]].strip(_NOTHING)) for at in unsound]
        unsound = unsound[np.array(filled, dtype=bool)]
        self._count_unsound(cells[unsound], numbers[unsound], is_cut)
        return RowBlock(array[np.repeat(sound, ends - starts + 1)].tobytes(), numbers[sound])

    def _skipped_lines(
        self, text: bytes, array: NDArray[np.uint8], starts: Any, ends: Any, cells: Any, numbers: Int64Array
    ) -> BoolArray:
        """Mark repeats of the header lines and comment lines inside the file; they lose nothing."""
        headers, delimiter = self._dialect.header_lines, self._dialect.delimiter
        repeats = np.zeros(len(starts), dtype=bool)
        for mark in {max(line.split(delimiter), key=len).encode("utf-8") for line in headers} - {b""}:
            position = text.find(mark)
            while position >= 0:
                at = int(np.searchsorted(ends, position))
                line = text[starts[at] : ends[at]].decode("utf-8")
                repeats[at] = normal_form(line, delimiter) in headers
                position = text.find(mark, int(ends[at]))
        comments = (array[starts] == ord("#")) & (cells != self._dialect.cells) & ~repeats
        for at in np.flatnonzero(repeats | comments)[: MOST_SKIPPED - len(self.skipped)].tolist():
            self.skipped[int(numbers[at])] = text[starts[at] : ends[at]].decode("utf-8")
        self._losses.add("repeated_header", "header lines inside the file, skipped", numbers[repeats], loses_data=False)
        self._losses.add("comment_line", "comment lines inside the file, skipped", numbers[comments], loses_data=False)
        skipped: BoolArray = repeats | comments
        return skipped

    def _count_unsound(self, cells: Any, numbers: Int64Array, is_cut: bool) -> None:
        expected = self._dialect.cells
        if is_cut:
            self._losses.add("truncated", f"row of {expected} cells cut by the end of the file", numbers)
            return
        few = cells < expected
        self._losses.add("dropped_rows", f"rows with fewer cells than the header's {expected}", numbers[few])
        self._losses.add("dropped_rows", f"rows with more cells than the header's {expected}", numbers[~few])


def without_quotes(text: bytes, delimiter: str) -> bytes:
    """Remove the quotes around cells.

    Delimiters inside quotes become a mark (see :func:`restore_delimiters`).

    Where every quote opens or closes a whole cell the quotes are simply cut out; else the lines that have quotes
    are taken one by one. A quote that does not match anything stays: it makes its own cell unreadable, no other.

    Examples
    --------
    >>> [without_quotes(line, ",") for line in (b'1,"2",3', b'4,"5,6",7', b'8,"9,10')]
    [b'1,2,3', b'4,5\\x1f6,7', b'8,"9,10']
    """
    array = np.frombuffer(text, dtype=np.uint8)
    quotes = np.flatnonzero(array == _QUOTE)
    before = np.where(quotes > 0, array[quotes - 1], _LF)
    after = array[np.minimum(quotes + 1, len(array) - 1)]
    opening = np.isin(before, (ord(delimiter), _LF))
    closing = np.isin(after, (ord(delimiter), _LF))
    delimiters = np.flatnonzero((array == ord(delimiter)) | (array == _LF))
    if len(quotes) % 2 == 0 and opening[::2].all() and closing[1::2].all():
        inside = np.searchsorted(delimiters, quotes)
        if (inside[::2] == inside[1::2]).all():
            return bytes(array[array != _QUOTE])
    lines = text.split(b"\n")
    return b"\n".join(_line_without_quotes(line, delimiter) if b'"' in line else line for line in lines)


def _line_without_quotes(line: bytes, delimiter: str) -> bytes:
    import csv

    text = _PADDED_QUOTE.sub('"', line.decode("utf-8"))
    try:
        rows = list(csv.reader([text], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error:
        return line
    cells = rows[0] if len(rows) == 1 else []
    return (
        delimiter.join(cell.replace(delimiter, _QUOTED_DELIMITER) for cell in cells).encode("utf-8") if cells else line
    )
