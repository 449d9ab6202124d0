"""Sections of a table: a header line in the middle of a file governs the rows below it.

Logs that were appended to each other, or recorders that begin anew in the same file, write a second header: with other
columns, other units, another time zero.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO

from groundstation.base.records import Remark
from groundstation.readers.dialect import Dialect, Line
from groundstation.readers.layout import Layout
from groundstation.readers.source import Source

MOST = 500  # more headers that change something are no log: what follows is read by the last of them
_PIECE_BYTES, _LONGEST_LINE = 1 << 20, 8 << 20
_ABOVE_BYTES, _BELOW_BYTES = 1 << 16, 1 << 14  # how far from a header line its preamble and its rows are looked at
_SHORT = 3  # characters: names that stand in many a cell are looked for as whole cells
_CELL = rb"(?m)(?:^|[,;\t])[ \"#]*%s[ \"]*(?=[,;\t\r]|$)"


@dataclass(frozen=True)
class Section:
    """Rows below one header.

    Parameters
    ----------
    dialect : Dialect
        With the bytes where the rows begin and end.
    layout : Layout
    shift_ns : int, optional
        From the time of these rows to that of the log's header; None where nothing tells it: the rows have no time.
    """

    dialect: Dialect
    layout: Layout
    shift_ns: int | None = 0


@dataclass(frozen=True)
class Place:
    """A line that may be a header, and the lines above it down to the header before."""

    line: Line
    first_byte: int
    above: tuple[Line, ...]


def header_places(
    source: Source, first: Line, encoding: str, names: Sequence[str], is_header: Callable[[str], bool]
) -> Iterator[Place]:
    """Lines below the first header that are headers too.

    Parameters
    ----------
    source : Source
    first : Line
        The first header line; looked for is behind it.
    encoding : str
    names : sequence of str
        Names of which every header has at least one.
    is_header : callable
        Tells of a line with one of the names whether it is a header.
    """
    separator, after = _separator(source), first
    with source.open() as again:
        for line, start in lines_with(source, first, encoding, names):
            if is_header(line.text):
                yield Place(line, start, _above(again, after, line.number, start, encoding, separator))
                after = line


def lines_with(source: Source, first: Line, encoding: str, marks: Sequence[str]) -> Iterator[tuple[Line, int]]:
    """Whole lines behind a line that have one of the marks, and their first bytes; a short name is a cell."""
    separator = _separator(source)
    base, number, rest = first.next_byte, first.number + 1, b""
    with source.open() as stream:
        stream.seek(base)
        while data := stream.read(_PIECE_BYTES):
            piece = rest + data
            end = piece.rfind(separator) + 1
            if not end and len(piece) > _LONGEST_LINE:
                base, rest = base + len(piece), b""
                continue
            rest, piece, counted = piece[end:], piece[:end], 0
            for start in sorted({start for mark in marks for start in _starts(piece, mark.encode(), separator)}):
                number += piece.count(separator, counted, start)
                counted = start
                behind = piece.find(separator, start) + 1
                text = piece[start:behind].decode(encoding, errors="replace").rstrip("\r\n")
                yield Line(number, base + behind, text, True), base + start
            number += piece.count(separator, counted)
            base += end


def lines_below(source: Source, line: Line, encoding: str) -> tuple[Line, ...]:
    """The first lines below a header."""
    separator = _separator(source)
    with source.open() as stream:
        stream.seek(line.next_byte)
        content = stream.read(_BELOW_BYTES).split(separator)[:-1]
    found, next_byte = [], line.next_byte
    for offset, text in enumerate(content, start=1):
        next_byte += len(text) + len(separator)
        found.append(Line(line.number + offset, next_byte, text.decode(encoding, errors="replace").rstrip("\r"), True))
    return tuple(found)


def _separator(source: Source) -> bytes:
    return b"\n" if b"\n" in source.head or b"\r" not in source.head else b"\r"


def ended(section: Section, end_byte: int) -> Section:
    """A section whose rows end where the next header, or what belongs to it, begins."""
    return replace(section, dialect=replace(section.dialect, end_byte=end_byte))


def told(place: Place, is_same: bool, shift_ns: int | None = 0) -> Remark:
    """A remark that the rows below a place have a header of their own: other columns, or the same with another time."""
    what = "is that of a log with another zero of time" if is_same else "names other columns"
    text = f"the header in row {place.line.number} {what}: it governs the rows below it"
    if shift_ns is None:
        text += ", whose times nothing ties to those above: they are left out"
    return Remark("second_header", text)


def _starts(piece: bytes, name: bytes, separator: bytes) -> Iterator[int]:
    """Where the lines begin that have a mark; a short name must be a whole cell."""
    if len(name) <= _SHORT and name.isalnum():
        yield from {
            piece.rfind(separator, 0, hit.start() + 1) + 1 for hit in re.finditer(_CELL % re.escape(name), piece)
        }
        return
    at = piece.find(name)
    while at >= 0:
        yield piece.rfind(separator, 0, at) + 1
        at = piece.find(name, piece.find(separator, at))


def _above(stream: BinaryIO, after: Line, number: int, start: int, encoding: str, separator: bytes) -> tuple[Line, ...]:
    """Lines between the header before and a line."""
    begin = max(after.next_byte, start - _ABOVE_BYTES)
    stream.seek(begin)
    lines = stream.read(start - begin).split(separator)[:-1]
    if begin > after.next_byte:
        lines = lines[1:]  # the first may be half of one
    found, next_byte = [], start
    for offset, content in enumerate(reversed(lines), start=1):
        text = content.decode(encoding, errors="replace").rstrip("\r")
        found.append(Line(number - offset, next_byte, text, True))
        next_byte -= len(content) + len(separator)
    return tuple(reversed(found))
