"""MCAP at the level of records: chunks, their messages, the summary.

Nothing here trusts a length that a file states.

Source: MCAP format specification, https://mcap.dev/spec.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from io import BytesIO
from typing import Any, BinaryIO, NamedTuple, cast

import numpy as np
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.store.marks import MAGIC, RECORD_PREFIX
from groundstation.store.messages import HEAD, MESSAGE_OPCODE, ByteArray, ChunkMessages

MAX_RECORD_BYTES = 64 << 20  # largest record that is read whole
FOOTER_BYTES = RECORD_PREFIX + 20
SHIFTED_BYTES = 8 << 20  # part of the end searched for a summary; only one of a million chunks is longer
_PREFIX = struct.Struct("<BQ")
_DATA_END = _PREFIX.pack(Opcode.DATA_END, 4)
_CHUNK_HEAD = struct.Struct("<BQQQQII")  # opcode, length, start, end, uncompressed size, crc, length of compression
_INDEX_HEAD = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries
_CHUNK_INDEX = np.dtype(
    [
        ("opcode", "u1"), ("length", "<u8"), ("start_ns", "<u8"), ("end_ns", "<u8"), ("at", "<u8"),
        ("chunk_bytes", "<u8"), ("map_bytes", "<u4"), ("channel_id", "<u2"), ("index_at", "<u8"),
        ("index_bytes", "<u8"), ("text_bytes", "<u4"), ("compression", "S4"), ("packed_bytes", "<u8"),
        ("raw_bytes", "<u8"),
    ]
)  # fmt: skip
INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
assert HEAD.fields is not None
_SEQUENCE_AT = HEAD.fields["sequence"][1]

_READABLE: Mapping[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}


def to_bytes(*records: McapRecord) -> bytes:
    """Return MCAP records as bytes, one after the other."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return cast(bytes, builder.end())


def parse_record(opcode: int, payload: bytes) -> McapRecord | None:
    """Parse a payload; None when it is not exactly one record of that kind."""
    kind = _READABLE.get(opcode)
    if kind is None:
        return None
    stream = ReadDataStream(BytesIO(payload))
    try:
        record = kind.read(stream)
    except (McapError, ValueError, struct.error, EOFError, OverflowError, MemoryError):
        return None
    return cast(McapRecord, record) if stream.count == len(payload) else None


def parse_records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and whole bytes of consecutive records.

    It ends where a length leads outside the data.
    """
    at = 0
    while at + RECORD_PREFIX <= len(data):
        opcode, length = _PREFIX.unpack_from(data, at)
        end = at + RECORD_PREFIX + length
        if end > len(data):
            return
        yield opcode, data[at:end]
        at = end


def message_index(channel_id: int, log_time: Int64Array, starts: Int64Array) -> bytes:
    """Return the MessageIndex record of a chunk: time and place of each message.

    The one in mcap.records would take a list of pairs.
    """
    entries = np.empty(len(log_time), INDEX_ENTRY)
    entries["time"] = log_time
    entries["offset"] = starts
    return _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + entries.nbytes, channel_id, entries.nbytes) + entries.tobytes()


class ChunkPlace(NamedTuple):
    """Facts of a zstd chunk of one channel, for the summary.

    ``chunk_bytes`` and ``index_bytes`` are those of its record and of the message index behind it, ``packed_bytes`` and
    ``raw_bytes`` those of its messages. The record stands at byte ``at`` of the file.
    """

    channel_id: int
    start_ns: int
    end_ns: int
    chunk_bytes: int
    index_bytes: int
    packed_bytes: int
    raw_bytes: int
    at: int = 0


def chunk_indexes(chunks: Sequence[ChunkPlace]) -> bytes:
    """Return the ChunkIndex records of chunks, in their order.

    mcap.records would write them field by field.
    """
    if not chunks:
        return b""
    entries = np.empty(len(chunks), _CHUNK_INDEX)
    entries["opcode"], entries["length"] = Opcode.CHUNK_INDEX, _CHUNK_INDEX.itemsize - RECORD_PREFIX
    entries["map_bytes"], entries["text_bytes"], entries["compression"] = 10, 4, b"zstd"
    for name, values in zip(ChunkPlace._fields, zip(*chunks, strict=True), strict=True):
        entries[name] = values
    entries["index_at"] = entries["at"] + entries["chunk_bytes"]
    return entries.tobytes()


def read_message_index(data: bytes) -> tuple[int, int, int, int] | None:
    """Read a MessageIndex record at the start of ``data``.

    Returns its channel, number of messages, first and last time; None where there is no such record.

    ``data`` needs the whole record: entries must be in order of time and of place to be believed.
    """
    if len(data) < _INDEX_HEAD.size:
        return None
    opcode, length, channel_id, nbytes = _INDEX_HEAD.unpack_from(data)
    whole = length == nbytes + 6 and nbytes % INDEX_ENTRY.itemsize == 0 and nbytes <= len(data) - _INDEX_HEAD.size
    if opcode != Opcode.MESSAGE_INDEX or not whole or not nbytes:
        return None
    entries = np.frombuffer(data, INDEX_ENTRY, nbytes // INDEX_ENTRY.itemsize, _INDEX_HEAD.size)
    times, offsets = entries["time"], entries["offset"]
    if (times[1:] < times[:-1]).any() or (offsets[1:] <= offsets[:-1]).any():
        return None
    return channel_id, len(entries), int(times[0]), int(times[-1])


@dataclass(frozen=True)
class ChunkHead:
    """Fields that stand before a chunk's compressed data.

    ``length`` is that of the whole record, ``data_at`` the place of the data in it.
    """

    length: int
    start_time: int
    end_time: int
    uncompressed_size: int
    crc: int
    compression: str
    data_at: int


def chunk_head(start_time: int, end_time: int, uncompressed_size: int, crc: int, data_length: int) -> bytes:
    """Return the bytes that stand before a chunk's zstd data.

    mcap.records would copy the data twice.
    """
    tail = b"zstd" + struct.pack("<Q", data_length)
    length = _CHUNK_HEAD.size + len(tail) + data_length - RECORD_PREFIX
    return _CHUNK_HEAD.pack(Opcode.CHUNK, length, start_time, end_time, uncompressed_size, crc, 4) + tail


def read_chunk_head(data: bytes | memoryview, *, need_lengths: bool = True) -> ChunkHead | None:
    """Read the head of the chunk at the start of ``data``; None when it is inconsistent.

    Without ``need_lengths`` only the places are used: for a chunk whose extent an index tells.
    """
    if len(data) < _CHUNK_HEAD.size + 12:
        return None
    opcode, length, start, end, size, crc, text_length = _CHUNK_HEAD.unpack_from(data)
    if not need_lengths:
        return ChunkHead(len(data), start, end, size, crc, "", 0)
    data_at = _CHUNK_HEAD.size + text_length + 8
    if opcode != Opcode.CHUNK or text_length > 4 or length + RECORD_PREFIX < data_at:
        return None
    compression = bytes(data[_CHUNK_HEAD.size : data_at - 8])
    (data_length,) = struct.unpack_from("<Q", data, data_at - 8)
    if data_length != length + RECORD_PREFIX - data_at or compression not in (b"zstd", b"lz4", b""):
        return None
    return ChunkHead(length + RECORD_PREFIX, start, end, size, crc, compression.decode(), data_at)


def split_messages(buffer: ByteArray) -> list[ChunkMessages] | None:
    """Split a chunk into messages by channel; None when it is not made of whole records."""
    if not len(buffer):
        return []
    even = _evenly_spaced(buffer)
    if even is not None:
        return [even]
    from groundstation.store.walk import find_messages

    found = find_messages(buffer)
    if found is None:
        return None
    starts, sizes = found
    ids = ChunkMessages(buffer, 0, starts, sizes, 0).head("channel_id")
    if len(ids) and (ids == ids[0]).all():
        return [ChunkMessages(buffer, int(ids[0]), starts, sizes, 0)]
    order = np.argsort(ids, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(ids[order])) + 1) if len(ids) else []
    return [ChunkMessages(buffer, int(ids[rows[0]]), starts[rows], sizes[rows], 0) for rows in groups]


def _evenly_spaced(buffer: ByteArray) -> ChunkMessages | None:
    """Return the messages of a chunk in which all have one length and one channel."""
    if len(buffer) < HEAD.itemsize or buffer[0] != MESSAGE_OPCODE:
        return None
    head = np.frombuffer(buffer, HEAD, 1)[0]
    stride = int(head["length"]) + RECORD_PREFIX
    if stride < HEAD.itemsize or stride > len(buffer) or len(buffer) % stride:
        return None
    count = len(buffer) // stride
    messages = ChunkMessages(
        buffer,
        int(head["channel_id"]),
        np.arange(0, len(buffer), stride, dtype=np.int64),
        np.broadcast_to(np.int64(stride), count),
        stride,
    )
    return messages if messages.is_alike(0, _SEQUENCE_AT) else None


@dataclass
class Summary:
    """The summary section: definitions and indexes; ``is_intact`` when its checksum was right.

    ``is_in_place`` when it stands where the footer says: else bytes before it were lost or added, and the places it
    states are wrong.
    """

    start: int = 0
    is_intact: bool = False
    is_in_place: bool = True
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    definitions: dict[str, bytes] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    statistics: Statistics | None = None
    metadata: list[MetadataIndex] = field(default_factory=list)

    @property
    def message_counts(self) -> dict[int, int]:
        """Number of messages by channel, by statistics that agree with themselves.

        Empty where there are none.
        """
        found = self.statistics
        if not self.is_intact or found is None or sum(found.channel_message_counts.values()) != found.message_count:
            return {}
        return dict(found.channel_message_counts)

    def add(self, record: McapRecord, raw: bytes) -> None:
        """Take in one record."""
        if isinstance(record, Schema):
            self.schemas[record.id] = record
            self.definitions[f"schema {record.id}"] = raw
        elif isinstance(record, Channel):
            self.channels[record.id] = record
            self.definitions[f"channel {record.id}"] = raw
        elif isinstance(record, ChunkIndex):
            self.chunks.append(record)
        elif isinstance(record, Statistics):
            self.statistics = record
        elif isinstance(record, MetadataIndex):
            self.metadata.append(record)


def _footer(file: BinaryIO, size: int) -> tuple[bytes, Footer] | None:
    """Return the last bytes of a file and the footer in them; None without a footer."""
    tail = FOOTER_BYTES + len(MAGIC)
    if size < len(MAGIC) + tail:
        return None
    file.seek(size - tail)
    end = file.read(tail)
    opcode, length = _PREFIX.unpack_from(end)
    footer = parse_record(opcode, end[RECORD_PREFIX:FOOTER_BYTES])
    if not isinstance(footer, Footer) or length != 20 or end[FOOTER_BYTES:] != MAGIC:
        return None
    return end, footer


def ends_whole(file: BinaryIO, size: int) -> bool:
    """Tell whether a file has a footer at its end: if so, it was not cut.

    There may be damage inside all the same.
    """
    return _footer(file, size) is not None


def _summary_crc(data: bytes, end: bytes) -> int:
    """Return the checksum of a summary and of the footer behind it."""
    return zlib.crc32(end[: FOOTER_BYTES - 4], zlib.crc32(data))


def _shifted_summary(file: BinaryIO, end: bytes, footer: Footer, stop: int) -> bytes:
    """Return the summary between the end of data and the footer, if its checksum is right.

    Else nothing.
    """
    file.seek(max(0, stop - SHIFTED_BYTES))
    tail = file.read(min(stop, SHIFTED_BYTES))
    at = tail.rfind(_DATA_END)
    data = tail[at + len(_DATA_END) + 4 :] if at >= 0 else b""
    return data if footer.summary_crc and footer.summary_crc == _summary_crc(data, end) else b""


def read_summary(file: BinaryIO, size: int) -> Summary | None:
    """Read the summary of a file of ``size`` bytes.

    None when it has no footer at its end, or no summary. A summary that does not stand where the footer says is looked
    for behind the end of data. A summary with a wrong checksum is read as far as it goes, ``is_intact`` False.
    """
    found = _footer(file, size)
    if found is None:
        return None
    end, footer = found
    start, stop = footer.summary_start, size - len(end)
    summary, data = Summary(start), b""
    if len(MAGIC) <= start <= stop and stop - start <= MAX_RECORD_BYTES:
        file.seek(start)
        data = file.read(stop - start)
        summary.is_intact = footer.summary_crc in (0, _summary_crc(data, end))
    if not summary.is_intact and (shifted := _shifted_summary(file, end, footer, stop)):
        data = shifted
        summary = Summary(stop - len(data), is_intact=True, is_in_place=False)
    if not data:
        return None
    for opcode, raw in parse_records(data):
        record = parse_record(opcode, raw[RECORD_PREFIX:])
        if record is not None:
            summary.add(record, raw)
    return summary
