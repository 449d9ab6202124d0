"""Sections of a table: a header line in the middle of a file governs the rows below it.

Logs that were appended to each other, or recorders that begin anew in the same file, write a second header: with other
columns, other units, another time zero.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from typing import BinaryIO

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage, Remark
from groundstation.readers.dialect import Dialect, HeadLine
from groundstation.readers.layout import TableLayout
from groundstation.readers.source import Source

MOST = 500  # more headers that change something are no log: what follows is left out
_PIECE_BYTES, _LONGEST_LINE = 1 << 17, 8 << 20
_ABOVE_BYTES, _BELOW_BYTES = 1 << 16, 1 << 14  # how far from a header line its preamble and its rows are looked at
_MARK_OF_UTF8 = "\ufeff"  # a file that was appended to another brings its own
_SHORT = 2  # characters: such a name stands in many a row
_WORD = re.compile(rb"[\n\r][ \"#]*[A-Za-z_]")
_WORD_OF_LF = re.compile(rb"\n[ \"#]*[A-Za-z_]")  # the same where lines end with a line feed: found sooner


@dataclass(frozen=True)
class TableSection:
    """Rows below one header.

    Parameters
    ----------
    dialect : Dialect
        With the bytes where the rows begin and end.
    layout : TableLayout
    shift_ns : int, optional
        From the time of these rows to that of the log's header; None where nothing tells it: the rows have no time.
    facts : mapping of str to str
        What its header says, where it is not that of the log.
    """

    dialect: Dialect
    layout: TableLayout
    shift_ns: int | None = 0
    facts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class HeaderPlace:
    """Header line, and the lines between it and the header before, with their first bytes."""

    line: HeadLine
    first_byte: int
    above: tuple[HeadLine, ...]
    above_from: tuple[int, ...]


def header_places(
    source: Source, first: HeadLine, encoding: str, mark: re.Pattern[bytes], is_header: Callable[[str], bool]
) -> Iterator[HeaderPlace]:
    """Lines below the first header that are headers too.

    Parameters
    ----------
    source : Source
    first : HeadLine
        The last line of the first header; looked for is behind it.
    encoding : str
    mark : pattern
        Stands in every header line, and in hardly any row.
    is_header : callable
        Tells of a line with the mark whether it is a header.
    """
    after = first
    with source.open() as again:
        for line, start in lines_with(source, first, encoding, mark):
            if is_header(line.text):
                yield HeaderPlace(line, start, *_above(again, after, line.number, start, encoding, _separator(source)))
                after = line


def mark_of(name: str) -> re.Pattern[bytes]:
    """Return a mark of header lines: a name in them, or a first letter if it is short."""
    return _WORD if len(name) <= _SHORT else re.compile(re.escape(name.encode()))


def lines_with(
    source: Source, first: HeadLine, encoding: str, mark: re.Pattern[bytes]
) -> Iterator[tuple[HeadLine, int]]:
    """Whole lines behind a line that have a mark, and their first bytes."""
    separator = _separator(source)
    base, rest = first.next_byte - len(separator), b""  # every piece begins with the end of the line before
    number, counted = first.number + 1, first.next_byte
    with source.open() as stream, source.open() as again:
        stream.seek(base)
        while data := stream.read(_PIECE_BYTES):
            piece = rest + data if rest else data
            end = piece.rfind(separator)
            if end <= 0 and len(piece) > _LONGEST_LINE:
                base, rest = base + len(piece) - 1, piece[-1:]
                continue
            at = 0
            in_piece = _WORD_OF_LF if mark is _WORD and not _has_lone_cr(piece) else mark
            is_none = mark is _WORD and not _has_letters(piece)
            while end > 0 and not is_none and (hit := in_piece.search(piece, at, end)) is not None:
                start, at = piece.rfind(separator, 0, hit.end()) + 1, piece.find(separator, hit.end())
                if counted < base:
                    number, counted = number + _count(again, counted, base, separator), base
                number, counted = number + piece.count(separator, counted - base, start), base + start
                text = piece[start:at].decode(encoding, errors="replace").rstrip("\r").removeprefix(_MARK_OF_UTF8)
                yield HeadLine(number, base + at + 1, text, True), counted
            base, rest = base + max(end, 0), piece[max(end, 0) :]


def _has_lone_cr(piece: bytes) -> bool:
    return b"\r" in piece and piece.count(b"\r") != piece.count(b"\r\n")


def _has_letters(piece: bytes) -> bool:
    """Tell whether there may be a letter: numbers and what parts them have smaller bytes."""
    return bool(np.frombuffer(piece, np.uint8).max(initial=0) >= ord("A"))


def _count(stream: BinaryIO, start: int, end: int, separator: bytes) -> int:
    """Line ends between two bytes of a file."""
    stream.seek(start)
    count = 0
    while start < end and (data := stream.read(min(_PIECE_BYTES, end - start))):
        count, start = count + data.count(separator), start + len(data)
    return count


def lines_below(source: Source, line: HeadLine, encoding: str) -> tuple[HeadLine, ...]:
    """The first lines below a header."""
    separator = _separator(source)
    with source.open() as stream:
        stream.seek(line.next_byte)
        content = stream.read(_BELOW_BYTES).split(separator)[:-1]
    found, next_byte = [], line.next_byte
    for offset, text in enumerate(content, start=1):
        next_byte += len(text) + len(separator)
        found.append(
            HeadLine(line.number + offset, next_byte, text.decode(encoding, errors="replace").rstrip("\r"), True)
        )
    return tuple(found)


def _separator(source: Source) -> bytes:
    return b"\n" if b"\n" in source.head or b"\r" not in source.head else b"\r"


def ended(section: TableSection, end_byte: int) -> TableSection:
    """Return a section whose rows end at ``end_byte``, where the next header begins."""
    return replace(section, dialect=replace(section.dialect, end_byte=end_byte))


def left_out(source: Source, line: int, first_byte: int) -> Damage:
    """Return damage for the lines from a header on that is one too many."""
    with source.open() as stream:
        count = _count(stream, first_byte, source.size, _separator(source))
    what = f"lines behind the first {MOST} headers, each unlike the one before: left out"
    return Damage("dropped_rows", f"rows {line} to {line + max(count, 1) - 1}", max(count, 1), what)


def without_headers(section: TableSection) -> TableSection:
    """Return a section in which no repeated header line is looked for."""
    return replace(section, dialect=replace(section.dialect, header_lines=frozenset()))


def told(place: HeaderPlace, is_same: bool, shift_ns: int | None = 0) -> Remark:
    """Return a remark on a header inside the file: it has other columns, or another time.

    The header governs the rows below it.
    """
    what = "is that of a log with another zero of time" if is_same else "names other columns"
    text = f"the header in row {place.line.number} {what}: it governs the rows below it"
    if shift_ns is None:
        text += ", whose times nothing ties to those above: they are left out"
    return Remark("second_header", text)


def _above(
    stream: BinaryIO, after: HeadLine, number: int, start: int, encoding: str, separator: bytes
) -> tuple[tuple[HeadLine, ...], tuple[int, ...]]:
    """Lines between the header before and a line, and their first bytes."""
    begin = max(after.next_byte, start - _ABOVE_BYTES)
    stream.seek(begin)
    lines = stream.read(start - begin).split(separator)[:-1]
    if begin > after.next_byte:
        lines = lines[1:]  # the first may be half of one
    found, starts, next_byte = [], [], start
    for offset, content in enumerate(reversed(lines), start=1):
        text = content.decode(encoding, errors="replace").rstrip("\r")
        found.append(HeadLine(number - offset, next_byte, text, True))
        next_byte -= len(content) + len(separator)
        starts.append(next_byte)
    return tuple(reversed(found)), tuple(reversed(starts))
