"""Rows of several vehicles in one table, brought together vehicle by vehicle.

The rows of a block are put in the order of their vehicles into memory, or a temporary file. The table is then read as
if the rows of each vehicle stood together, the one that comes last in the file first: so its times lie before those
above it, and each is a log of its own.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import pyarrow as pa

from groundstation.base import arrow_values as arrow
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, Remark
from groundstation.readers.cells import trimmed
from groundstation.readers.dialect import Dialect
from groundstation.readers.held import HeldBytes
from groundstation.readers.losses import Losses
from groundstation.readers.positioned import Positioned
from groundstation.readers.row_shapes import RowShape, cell_places, shape_of
from groundstation.readers.rows import RowBlock, RowScanner
from groundstation.readers.sections import MOST, TableSection
from groundstation.readers.source import MadeSource, Source

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer


@dataclass(frozen=True)
class _Chunk:
    """Rows of one vehicle that stand together in the temporary file."""

    at: int
    size: int
    rows: int


@dataclass(frozen=True)
class GroupedSource(MadeSource):
    """Rows of a table, vehicle by vehicle."""

    file: HeldBytes
    chunks: tuple[_Chunk, ...]
    delimiter: str

    def rows(self, lines: bytes) -> tuple[bytes, RowShape | None]:
        """Return the lines, and their shape."""
        return lines, shape_of(lines, self.delimiter, is_compiled=True)

    @property
    def size(self) -> int:
        """Size in bytes."""
        return sum(one.size for one in self.chunks)

    def open(self) -> BinaryIO:
        """Open the rows, from the first on."""
        return io.BufferedReader(_Chunks(self.file, self.chunks))


class _Chunks(Positioned):
    """Pieces of a file in another order."""

    def __init__(self, file: HeldBytes, chunks: Sequence[_Chunk]) -> None:
        self._file, self._chunks = file, chunks
        self._ends = np.cumsum([one.size for one in chunks], dtype=np.int64)

    def _length(self) -> int:
        return int(self._ends[-1]) if len(self._ends) else 0

    def readinto(self, buffer: "WriteableBuffer") -> int:
        view = memoryview(buffer).cast("B")
        number = int(np.searchsorted(self._ends, self._at, side="right"))
        if number == len(self._chunks):
            return 0
        chunk = self._chunks[number]
        left = int(self._ends[number]) - self._at
        count = self._file.readinto(chunk.at + chunk.size - left, view[: min(left, len(view))])
        self._at += count
        return count


@dataclass(frozen=True)
class Vehicles:
    """Table of several vehicles: its source, a section for each, and a remark on them."""

    source: Source
    sections: tuple[TableSection, ...]
    remark: Remark


def by_vehicle(
    source: Source, section: TableSection, column: int, name: str, only: Sequence[str], losses: Losses
) -> Vehicles | None:
    """Bring the rows of each vehicle together.

    Parameters
    ----------
    source : Source
    section : TableSection
        All rows of the table.
    column : int
        The one that tells the vehicle.
    name : str
        Its name.
    only : sequence of str
        Vehicles that are read; all where it is empty.
    losses : Losses
        Takes what is lost.

    Returns
    -------
    Vehicles or None
        None where no row tells its vehicle.
    """
    file, chunks, at = HeldBytes(), dict[str, list[_Chunk]](), 0
    for block in RowScanner(source, section.dialect, losses, is_compiled=True):
        for key, rows, lines in _parted(block, section.dialect, column):
            if not key:
                losses.add("dropped_rows", f"rows without a {name}", lines)
            elif not only or key in only:
                chunks.setdefault(key, []).append(_Chunk(at, len(rows), len(lines)))
                at += file.write(rows)
    counts = {key: sum(one.rows for one in several) for key, several in chunks.items()}
    most = set(sorted(counts, key=lambda key: -counts[key])[:MOST])
    if not most:
        return None
    left = sum(count for key, count in counts.items() if key not in most)
    if left:
        lines = np.full(left, section.dialect.first_line, dtype=np.int64)
        losses.add("dropped_rows", f"rows of vehicles beyond the {MOST} with the most rows", lines)
    kept = [key for key in reversed(chunks) if key in most]
    sections, first_byte, first_line = list[TableSection](), 0, section.dialect.first_line
    for key in kept:
        end_byte = first_byte + sum(one.size for one in chunks[key])
        dialect = Dialect("utf-8", section.dialect.delimiter, section.dialect.cells, first_byte, first_line)
        facts = {**section.facts, "aircraft": key}
        sections.append(replace(section, dialect=replace(dialect, end_byte=end_byte), facts=facts))
        first_byte, first_line = end_byte, first_line + counts[key] + 1  # a place for the log that begins there
    text = f"{len(kept)} vehicles by {name}, a log each; records are numbered vehicle by vehicle, the last one first"
    found = GroupedSource(source.path, file, tuple(one for key in kept for one in chunks[key]), dialect.delimiter)
    return Vehicles(found, tuple(sections), Remark("vehicles", text))


def _parted(block: RowBlock, dialect: Dialect, column: int) -> Iterator[tuple[str, bytes, Int64Array]]:
    """Yield the rows of each vehicle in a block, with their line numbers.

    Its name is empty where none is told.
    """
    first, behind, ends = cell_places(block.text, dialect.delimiter, dialect.cells, column)
    starts = np.concatenate(([0], ends[:-1] + 1))
    keys = _texts(block.text, first, behind).dictionary_encode(null_encoding="encode")
    codes = arrow.values(keys.indices, 0).astype(np.int64)
    order = np.argsort(codes, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(codes[order])) + 1)
    names = [word or "" for word in keys.dictionary.to_pylist()]
    for own in sorted(groups, key=lambda rows: int(rows[0])):
        yield names[codes[own[0]]], _rows(block.text, starts, ends, own), block.line_numbers[own]


def _rows(text: bytes, starts: Int64Array, ends: Int64Array, wanted: Int64Array) -> bytes:
    """Return some of the rows of a text, in their order."""
    breaks = np.flatnonzero(np.diff(wanted) != 1)
    first, last = wanted[np.concatenate(([0], breaks + 1))], wanted[np.append(breaks, len(wanted) - 1)]
    return b"".join(
        [text[start : end + 1] for start, end in zip(starts[first].tolist(), ends[last].tolist(), strict=True)]
    )


def _texts(text: bytes, starts: Int64Array, ends: Int64Array) -> Any:
    """Return trimmed cells as an arrow array, null where empty."""
    sizes = ends - starts
    behind = np.cumsum(sizes)
    places = np.arange(behind[-1]) + np.repeat(starts - behind + sizes, sizes)
    content = pa.py_buffer(np.frombuffer(text, np.uint8)[places])
    offsets = pa.py_buffer(np.append(np.int32(0), behind.astype(np.int32)))
    return trimmed(pa.Array.from_buffers(pa.string(), len(sizes), [None, offsets, content]))
