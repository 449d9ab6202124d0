"""Cut a log into blocks of records that the definitions in force describe.

Bytes that belong to no record are counted.
"""

from collections.abc import Iterator
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Int64Array
from groundstation.readers.dataflash import scan
from groundstation.readers.dataflash.definitions import (
    FMT_BYTES,
    FMT_ID,
    HEADER_BYTES,
    RecordDefinition,
    fmt_definition,
    parse_fmt,
)
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source

BLOCK_BYTES = 4 << 20
REFUSED_SHOWN = 20  # definitions left out that are told one by one
MAX_SPANS = 4_096
BYTES_KEPT, RECORDS_KEPT = 96 << 20, 1 << 22  # log whose places are kept for a second pass, 5 bytes a record
MOST_LOGS, MOST_DEFINITIONS = 256, 10_000  # joined in a file, and different ones in it: more is no log but an attack
_LOG_BEGINS = bytes((FMT_ID, FMT_BYTES)) + b"FMT"  # every log begins with the definition of definitions
FILLERS = (b"\0", b"\xff")  # bytes with which a recorder fills the rest of a page


@dataclass(frozen=True, eq=False)
class RecordBlock:
    """Records of one stretch of the file.

    Parameters
    ----------
    data : ndarray of uint8
    offsets : ndarray of int64, shape (n,)
        Where each record begins in ``data``.
    types : ndarray of uint8, shape (n,)
    first_index : int
        Place of the first record among those of the file.
    definitions : mapping of type id to RecordDefinition
    """

    data: NDArray[np.uint8]
    offsets: Int64Array
    types: NDArray[np.uint8]
    first_index: int
    definitions: dict[int, RecordDefinition]

    def groups(self) -> Iterator[tuple[RecordDefinition, Int64Array]]:
        """Yield each record type that occurs, and the numbers of its records in the block.

        Records are numbered from 0; the numbers increase.
        """
        order = np.argsort(self.types, kind="stable")
        counts = np.bincount(self.types)
        ends = np.cumsum(counts)
        for type_id in np.flatnonzero(counts).tolist():
            yield self.definitions[type_id], order[ends[type_id] - counts[type_id] : ends[type_id]]

    def records(self, definition: RecordDefinition, which: Int64Array) -> NDArray[Any]:
        """Records of one type as a structured array, shape (n,), copied from the block."""
        length = definition.length
        at_any_byte = np.ndarray((len(self.data) - length + 1,), f"V{length}", self.data.data, strides=(1,))
        return at_any_byte[self.offsets[which]].view(definition.dtype)


class _Places(NamedTuple):
    """A block without its data, in little memory."""

    offsets: NDArray[np.uint32]
    types: NDArray[np.uint8]
    first_index: int
    definitions: dict[int, RecordDefinition]

    @classmethod
    def of(cls, block: RecordBlock) -> "_Places":
        return cls(block.offsets.astype(np.uint32), block.types, block.first_index, block.definitions)

    def block(self, data: NDArray[np.uint8]) -> RecordBlock:
        return RecordBlock(data, self.offsets.astype(np.int64), self.types, self.first_index, self.definitions)


class _Chunk(NamedTuple):
    """Data that were at hand at once: their bytes, how many of them are done, their blocks."""

    length: int
    done: int
    blocks: list[_Places]


@dataclass
class UnusedSpans:
    """Bytes of a log that belong to no record."""

    skipped: SkippedBytes
    padding: tuple[int, int] | None = None
    cut: tuple[int, int, str] | None = None

    def damages(self) -> Iterator[Damage]:
        """Yield the skipped bytes and a record cut off by the end, in the order of the file."""
        yield from self.skipped.damages()
        if self.cut is not None:
            start, end, name = self.cut
            what = (
                f"bytes of a record ({name}) that the end of the file cuts off" if name else "bytes of a record cut off"
            )
            yield Damage("truncated", bytes_place(start, end), end - start, what)
        if self.padding is not None:
            start, end = self.padding
            what = "filler bytes behind the last record"
            yield Damage("padding", bytes_place(start, end), end - start, what, loses_data=False)


class Scanner:
    """Iterator over the blocks of a log.

    Definitions are taken in as they come. One that contradicts an earlier one of the same id is believed while no
    record of that id was met, or when a new log has begun in the file (logs joined end to end): a flipped bit in a late
    definition must not cost the records of another type.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.spans = UnusedSpans(SkippedBytes("record"))
        self.refused: list[tuple[int, RecordDefinition]] = []
        self.refused_more = 0
        self._met = 0
        self.log_starts: list[int] = []  # places of the records with which further logs begin
        self.definitions = {FMT_ID: fmt_definition()}
        self._lengths = np.zeros(256, dtype=np.int64)
        self._time_kind = np.zeros(256, dtype=np.int64)
        self._lengths[FMT_ID] = FMT_BYTES
        self.payloads: dict[int, bytes] = {}
        self._seen = np.zeros(256, dtype=bool)  # types met since the log (of those joined in the file) began
        self._state = scan.new_state()
        self._base = 0  # place in the file of the first byte of the data at hand
        self._count = 0
        self._spans = np.empty((MAX_SPANS, 3), dtype=np.int64)
        self._chunks: list[_Chunk] = []
        self._keeps = source.size <= BYTES_KEPT  # a compressed one may turn out longer

    def __iter__(self) -> Iterator[RecordBlock]:
        data = np.zeros(0, dtype=np.uint8)
        with self._source.open() as stream:
            while True:
                data, is_last = self._longer(data, stream)
                blocks: list[_Places] = []
                for block in self._blocks(data, is_last):
                    if self._keeps:
                        blocks.append(_Places.of(block))
                    yield block
                done = int(self._state[scan.POSITION])
                self._chunks.append(_Chunk(len(data), done, blocks))
                if self._count > RECORDS_KEPT:
                    self._keeps = False
                if not self._keeps:
                    self._chunks.clear()
                if is_last:
                    break
                data, self._base = data[done:], self._base + done
                self._state[scan.POSITION] = 0
                if self._state[scan.SKIP_START] != scan.NOWHERE:
                    self._state[scan.SKIP_START] -= done
        self._finish(data)

    def again(self) -> Iterator[RecordBlock]:
        """Yield the same blocks once more.

        Records are searched for again only where they were too many to keep their places.

        Raises
        ------
        UnreadableLogError
            When the log is shorter than it was.
        """
        if not self._keeps:
            yield from Scanner(self._source)
            return
        data = np.zeros(0, dtype=np.uint8)
        with self._source.open() as stream:
            for chunk in self._chunks:
                data, _is_last = self._longer(data, stream)
                if len(data) < chunk.length:
                    raise UnreadableLogError(self._source.name, "changed while it was read", "", "read it again")
                yield from (places.block(data) for places in chunk.blocks)
                data = data[chunk.done :]

    def _longer(self, data: NDArray[np.uint8], stream: BinaryIO) -> tuple[NDArray[np.uint8], bool]:
        """Append the next block of the file to the data; tell whether it was the last."""
        whole = np.empty(len(data) + BLOCK_BYTES, dtype=np.uint8)
        whole[: len(data)] = data
        try:
            count = stream.readinto(whole[len(data) :])  # type: ignore[attr-defined]
            return whole[: len(data) + count], count < BLOCK_BYTES
        except OSError as error:  # a failing disk or network share
            raise UnreadableLogError(
                self._source.name, f"no more data ({error.strerror})", "", "copy it again"
            ) from error

    def _blocks(self, data: NDArray[np.uint8], is_last: bool) -> Iterator[RecordBlock]:
        """Yield the blocks of the data at hand.

        There are several where a definition changes or where there are very many records.
        """
        offsets = np.empty(len(data) // HEADER_BYTES + 1, dtype=np.int64)
        types = np.empty(len(offsets), dtype=np.uint8)
        magic = scan.magic_places(data)
        state = self._state
        state[scan.COUNT] = state[scan.MAGIC] = 0
        limit = len(data) if is_last else len(data) - scan.LOOKAHEAD
        while state[scan.POSITION] < limit:
            state[scan.SPANS] = 0
            stopped = scan.scan(
                data, magic, is_last, FMT_ID, self._lengths, self._time_kind, offsets, types, self._spans, state
            )
            for start, end, before in self._spans[: state[scan.SPANS]].tolist():
                self.spans.skipped.add(self._base + start, self._base + end, self._count + before)
            if stopped:
                count = int(state[scan.COUNT])
                at = int(offsets[count - 1])
                payload = data[at + HEADER_BYTES : at + FMT_BYTES].tobytes()
                if payload.startswith(_LOG_BEGINS) and (self._count or count > 1) and len(self.log_starts) < MOST_LOGS:
                    self.log_starts.append(self._count + count - 1)
                    yield from self._block(data, offsets, types)
                    self._seen[:] = False
                new = self._accepted(payload, types, self._base + at)
                if new is not None:
                    self._define(new)
        yield from self._block(data, offsets, types)

    def _block(self, data: NDArray[np.uint8], offsets: Int64Array, types: NDArray[np.uint8]) -> Iterator[RecordBlock]:
        count = int(self._state[scan.COUNT])
        if count:
            block = RecordBlock(data, offsets[:count].copy(), types[:count].copy(), self._count, dict(self.definitions))
            self._seen |= np.bincount(block.types, minlength=len(self._seen)) > 0
            self._count += count
            self._state[scan.COUNT] = 0
            yield block

    def _accepted(self, payload: bytes, types: NDArray[np.uint8], place: int) -> RecordDefinition | None:
        """Return the definition of a FMT record if it is new and believed."""
        type_id = payload[0]
        if type_id == FMT_ID or self.payloads.get(type_id) == payload:
            return None
        self._met += 1
        new = parse_fmt(payload) if self._met <= MOST_DEFINITIONS else None
        if new is not None and not self._contradicts(type_id, types):
            self.payloads[type_id] = payload
            return new
        if new is not None and len(self.refused) < REFUSED_SHOWN:
            self.refused.append((place, new))
        elif self.refused:
            self.refused_more += 1
        return None

    def _contradicts(self, type_id: int, types: NDArray[np.uint8]) -> bool:
        """Tell whether records of the id of a new definition were met under another one."""
        pending = types[: int(self._state[scan.COUNT])]
        return type_id in self.definitions and (bool(self._seen[type_id]) or bool((pending == type_id).any()))

    def _define(self, new: RecordDefinition) -> None:
        self.definitions[new.type_id] = new
        self._lengths[new.type_id] = new.length
        self._time_kind[new.type_id] = _time_kind(new)

    def _finish(self, data: NDArray[np.uint8]) -> None:
        """Account for the bytes behind the last record."""
        size = self._base + len(data)
        cut_at, skip_start = int(self._state[scan.CUT_AT]), int(self._state[scan.SKIP_START])
        if cut_at != scan.NOWHERE:
            definition = self.definitions.get(int(data[cut_at + 2])) if cut_at + 2 < len(data) else None
            self.spans.cut = (self._base + cut_at, size, definition.name if definition else "")
        elif skip_start != scan.NOWHERE:
            left = data[max(skip_start, 0) :].tobytes()
            if skip_start >= 0 and any(not left.strip(filler) for filler in FILLERS):
                self.spans.padding = (self._base + skip_start, size)
            else:
                self.spans.skipped.add(self._base + skip_start, size, self._count)


def _time_kind(definition: RecordDefinition) -> int:
    """Return the code by which the scan finds the time of a record of this type."""
    time = definition.time_field
    if time is None or definition.fields[0].name != time[0]:
        return scan.NO_TIME
    character = definition.fields[0].character
    if character in "qQ" and time[0] == "TimeUS":
        return scan.TIME_US_8
    if character in "iI":
        return scan.TIME_US_4 if time[0] == "TimeUS" else scan.TIME_MS
    return scan.NO_TIME
