"""Writer of one topic: batches become message records, gathered until they fill a chunk."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.source_units import source_units
from groundstation.base.units import NS_PER_S
from groundstation.store.messages import ByteArray
from groundstation.store.schema import GrowingType, WireField, columns_text
from groundstation.store.wire import Slot, encode, slot_of, taken

CHUNK_BYTES = 1 << 20  # a chunk is closed when it has so many bytes: a flipped bit loses no more
CHUNK_SPAN_NS = 300 * NS_PER_S  # or at each such boundary of time, which bounds the loss of slow topics
SHORT_SPAN_NS = 60 * NS_PER_S  # or at such a boundary when it has enough bytes to be worth a chunk
SHORT_SPAN_BYTES = 32 << 10
SMALL_BYTES, MOST_SMALL = 1 << 10, 4_096  # a chunk takes as long as a hundred rows: of so small ones a file has few
COLUMNS_KEY = "columns"
DERIVED_KEY = "derived_from"  # in the metadata of a channel made from another one: reading skips it


@dataclass(frozen=True)
class Chunk:
    """Message records of one channel, ready to be compressed.

    Bytes, times and places of the messages, in pieces; ``nbytes`` are those of all messages.
    """

    channel_id: int
    topic: str
    buffers: Sequence[ByteArray]
    log_times: Sequence[Int64Array]
    starts: Sequence[Int64Array]
    nbytes: int


class Pace:
    """Time after which a topic gets a chunk, however few bytes it has.

    It grows with the number of such chunks in the file.

    A flight has some hundred of them; a log of a row a day would have as many as rows.
    """

    def __init__(self) -> None:
        self._small = 0

    def count(self, nbytes: int) -> None:
        """Take note of a chunk of so many bytes."""
        self._small += nbytes < SMALL_BYTES

    @property
    def span_ns(self) -> int:
        """Time between two boundaries, four times as long after each ``MOST_SMALL`` small chunks."""
        return CHUNK_SPAN_NS << 2 * min(self._small // MOST_SMALL, 12)


class ChannelWriter:
    """Writer of the batches of one topic as chunks.

    Parameters
    ----------
    channel_id : int
    topic : str
    emit : callable
        Takes each full :class:`Chunk`.
    """

    def __init__(self, channel_id: int, topic: str, emit: Callable[[Chunk], None]) -> None:
        self.id = channel_id
        self.topic = topic
        self.count = 0
        self.pace = Pace()  # the file puts its own here
        self._emit = emit
        self._buffers: list[ByteArray] = []
        self._times: list[Int64Array] = []
        self._starts: list[Int64Array] = []
        self._bytes = 0
        self._piece_ns = 0
        self._last_ns = 0

    def slots(self, batch: RecordBatch) -> list[Slot]:
        """Return the values of a batch as they are written, in order of field numbers."""
        raise NotImplementedError

    def definition(self, metadata: Mapping[str, str] = MappingProxyType({})) -> tuple[Schema, Channel]:
        """Return the schema and channel records for everything written.

        The ``metadata`` of the file may state units.
        """
        raise NotImplementedError

    def write(self, batch: RecordBatch) -> None:
        """Take in a batch; full chunks are emitted."""
        time_ns = self._checked_times(batch)
        row_bytes = 64 + sum(2 + _width(column.values.dtype) for column in batch.columns.values())
        publish_ns = time_ns if batch.validity_time_ns is None else batch.validity_time_ns
        slots = self.slots(batch)
        for pieces in _together(_pieces(time_ns, row_bytes, self.pace.span_ns), CHUNK_BYTES // row_bytes):
            rows = slice(pieces[0].start, pieces[-1].stop)
            buffer, starts = encode(self.id, self.count, time_ns[rows], publish_ns[rows], taken(slots, rows))
            self.count += len(starts)
            for piece in pieces:
                self._close_at_boundary(int(time_ns[piece.start]))
                first, behind = piece.start - rows.start, piece.stop - rows.start
                end = starts[behind] if behind < len(starts) else len(buffer)
                self._append(time_ns[piece], starts[first:behind], buffer[starts[first] : end])
                if self._bytes >= CHUNK_BYTES * 7 // 8:
                    self.flush()

    def _close_at_boundary(self, time_ns: int) -> None:
        before, self._piece_ns = self._piece_ns, time_ns
        span = SHORT_SPAN_NS if self._bytes >= SHORT_SPAN_BYTES else CHUNK_SPAN_NS
        if self._bytes < SMALL_BYTES:
            span = self.pace.span_ns
        if before // span != time_ns // span:
            self.flush()

    def _append(self, time_ns: Int64Array, starts: Int64Array, buffer: ByteArray) -> None:
        """Gather records.

        ``starts`` may count from any place: the first record is the first of the buffer.
        """
        self._buffers.append(buffer)
        self._times.append(time_ns)
        self._starts.append(starts + (self._bytes - starts[0]))
        self._bytes += len(buffer)

    def flush(self) -> None:
        """Emit what is gathered as a chunk."""
        if not self._bytes:
            return
        chunk = Chunk(self.id, self.topic, self._buffers, self._times, self._starts, self._bytes)
        self.pace.count(self._bytes)
        self._buffers, self._times, self._starts, self._bytes = [], [], [], 0
        self._emit(chunk)

    def _checked_times(self, batch: RecordBatch) -> Int64Array:
        where = f"topic {batch.topic}, record {int(batch.record_index[0])}"
        if batch.time_ns is None:
            raise GroundstationError(where, "no corrected time", "time_ns set", "apply the clock model first")
        time_ns = np.asarray(batch.time_ns, dtype=np.int64)
        if time_ns[0] < self._last_ns or (time_ns[1:] < time_ns[:-1]).any():
            falls = np.flatnonzero(np.diff(time_ns, prepend=self._last_ns) < 0)
            place = f"topic {batch.topic}, record {int(batch.record_index[falls[0]])}"
            time = int(time_ns[falls[0]])
            expected = "not negative" if time < 0 else "no less than the time before"
            raise GroundstationError(place, f"time {time} ns", expected, "sort the rows by corrected time")
        self._last_ns = int(time_ns[-1])
        return time_ns


class TopicWriter(ChannelWriter):
    """Writer of the channel of a topic.

    A canonical topic has its compiled message type, any other a type made of its columns.
    """

    def __init__(self, channel_id: int, topic: str, name: str, emit: Callable[[Chunk], None]) -> None:
        super().__init__(channel_id, topic, emit)
        self._type = GrowingType(topic, name)
        self._device_time, self._record_index = self._type.common_fields

    def slots(self, batch: RecordBatch) -> list[Slot]:
        """Return common fields, then the batch's columns in order of their numbers."""
        device_time = batch.device_time_ns
        fields = {name: self._type.field_for(name, column.values.dtype) for name, column in batch.columns.items()}
        common = [
            slot_of(self._device_time, device_time.values.astype("<i8", copy=False), device_time.present),
            slot_of(self._record_index, batch.record_index.astype("<u8"), None),
        ]
        ordered = sorted(fields.items(), key=lambda item: item[1].number)
        return common + [self._slot(field, batch.columns[name]) for name, field in ordered]

    def _slot(self, field: WireField, column: Column) -> Slot:
        values = column.values
        if values.dtype != field.dtype and not (field.dtype.kind == values.dtype.kind == "U"):
            values = self._converted(field, values, column.present)
        if field.wire_dtype is not None:
            values = values.astype(field.wire_dtype, copy=False)
        return slot_of(field, values, column.present)

    def _converted(self, field: WireField, values: NDArray[Any], present: BoolArray | None) -> NDArray[Any]:
        """Convert values to the dtype of the channel's first batch, where nothing is lost by it.

        Fields that are stored in single precision are rounded.
        """
        numbers = "biuf"
        if self._type.is_rounded(field, values.dtype):
            with np.errstate(over="ignore", invalid="ignore"):
                return values.astype(field.dtype)
        if values.dtype.kind in numbers and field.dtype.kind in numbers:
            with np.errstate(invalid="ignore"):
                converted = values.astype(field.dtype)
                back = converted.astype(values.dtype)
                same = (back == values) | (back != back) & (values != values)
            if bool(same.all() if present is None else same[present].all()):
                return converted
        where = f"topic {self.topic}, column {field.column}"
        raise GroundstationError(where, f"values of {values.dtype}", f"{field.dtype} as in the batches before")

    def definition(self, metadata: Mapping[str, str] = MappingProxyType({})) -> tuple[Schema, Channel]:
        """Schema and channel records, with every column that was written."""
        units = source_units(metadata, self.topic, [field.column for field in self._type.own_fields])
        message = self._type.message_type(units)
        schema = Schema(id=self.id, name=message.name, encoding="protobuf", data=message.descriptor_set)
        return schema, channel_record(self.id, self.topic, {COLUMNS_KEY: columns_text(self._type.own_fields)})


def channel_record(channel_id: int, topic: str, metadata: Mapping[str, str]) -> Channel:
    """Return the record of a channel whose schema has the same number."""
    return Channel(
        id=channel_id, topic=topic, message_encoding="protobuf", metadata=dict(metadata), schema_id=channel_id
    )


def _width(dtype: np.dtype[Any]) -> int:
    """Return about as many bytes as a value takes in a message."""
    return dtype.itemsize // 4 if dtype.kind == "U" else dtype.itemsize


def _pieces(time_ns: Int64Array, row_bytes: int, span_ns: int = CHUNK_SPAN_NS) -> Iterator[slice]:
    """Cut rows into pieces of at most a chunk's bytes that cross no chunk boundary.

    ``span_ns`` lies between two boundaries for so few rows that they make a small chunk.
    """
    at, count = 0, len(time_ns)
    most_rows = max(1, CHUNK_BYTES // row_bytes)
    while at < count:
        ahead = time_ns[at : at + most_rows]
        rows = _rows_before_boundary(ahead, SHORT_SPAN_NS)
        if rows * row_bytes < SHORT_SPAN_BYTES:
            rows = _rows_before_boundary(ahead, CHUNK_SPAN_NS)
        if rows * row_bytes < SMALL_BYTES and span_ns > CHUNK_SPAN_NS:
            rows = _rows_before_boundary(ahead, span_ns)
        yield slice(at, at + rows)
        at += rows


def _together(pieces: Iterable[slice], most_rows: int) -> Iterator[list[slice]]:
    """Group consecutive pieces into at most so many rows; a group is encoded at once."""
    group: list[slice] = []
    for piece in pieces:
        if group and piece.stop - group[0].start > most_rows:
            yield group
            group = []
        group.append(piece)
    if group:
        yield group


def _rows_before_boundary(time_ns: Int64Array, span_ns: int) -> int:
    boundary_ns = (int(time_ns[0]) // span_ns + 1) * span_ns
    return len(time_ns) if time_ns[-1] < boundary_ns else int(time_ns.searchsorted(boundary_ns))
