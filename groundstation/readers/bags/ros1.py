"""Bags of ROS 1 (version 2.0): records of a header and data, most of them in compressed chunks.

The index at the end is not used: a bag that was cut has none. Where no record can be recognised the next one is
searched for. A bag has no checksums.

Source: http://wiki.ros.org/Bags/Format/2.0.
"""

import bz2
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import BinaryIO, NamedTuple

import lz4.frame
import numpy as np

from groundstation.base.records import Damage
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.messages import Block, Connection, Part
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
MAX_HEADER_BYTES = 1 << 20
MAX_CHUNK_BYTES = 256 << 20  # decompressed; recorders close a chunk at 768 kB
SEARCH_BYTES = 1 << 20
BEYOND_BYTES = 4096  # room for a header that begins within a record and ends behind it
LOOKED_AT, MOST_TRIED = 1 << 16, 200  # bytes of a file without the first ones of a bag, and headers in them
# Every record's header has the field "op" of one byte: 4 bytes of length, "op=", the number.
_OP = re.compile(rb"\x04\0\0\0op=[\x02-\x07]")
_OP_OUTSIDE = re.compile(rb"\x04\0\0\0op=[\x04-\x06]")  # of records that stand in no chunk


_TIME = struct.Struct("<II")


class _Head(NamedTuple):
    """Header of a record, and where its data begins and ends."""

    op: int
    fields: dict[bytes, bytes]
    data_at: int
    end: int


def parse_header(data: bytes) -> dict[bytes, bytes] | None:
    """Fields of a header; None when the bytes are none.

    Examples
    --------
    >>> parse_header(b"\\x04\\0\\0\\0op=\\x05")
    {b'op': b'\\x05'}
    """
    fields: dict[bytes, bytes] = {}
    at = 0
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "little")
        name, equals, value = data[at + 4 : at + 4 + length].partition(b"=")
        at += 4 + length
        if not equals or at > len(data):
            return None
        fields[name] = value
    return fields


def _number(fields: dict[bytes, bytes], name: bytes) -> int | None:
    value = fields.get(name)
    return int.from_bytes(value, "little") if value is not None and len(value) <= 8 else None


def _head_at(data: bytes, at: int, size: int) -> _Head | None:
    """The record at a place of ``data`` (which may end behind its header); ``size`` bounds its end."""
    length = int.from_bytes(data[at : at + 4], "little")
    if not 8 <= length <= MAX_HEADER_BYTES or at + 8 + length > len(data):
        return None
    fields = parse_header(data[at + 4 : at + 4 + length])
    op = _number(fields, b"op") if fields else None
    if fields is None or op is None or not MESSAGE <= op <= CONNECTION:
        return None
    data_at = at + 8 + length
    return _Head(op, fields, data_at, data_at + int.from_bytes(data[data_at - 4 : data_at], "little"))


def _heads_in(block: bytes, ops: re.Pattern[bytes]) -> Iterator[tuple[int, _Head]]:
    """Headers of records in some bytes, told by their operation, with where each begins."""
    for match in ops.finditer(block):
        # The fields of a header have no order: it begins at one of the lengths before.
        for back in range(4, min(match.start(), 512) + 1):
            head = _head_at(block, match.start() - back, len(block))
            if head is not None and match.end() <= head.data_at - 4:
                yield match.start() - back, head
                break


def has_chunk(head: bytes) -> bool:
    """Whether a chunk of a bag begins in the first bytes of a file, whatever stands before it."""
    heads = islice(_heads_in(head[:LOOKED_AT], _OP_OUTSIDE), MOST_TRIED)
    return any(one.op == CHUNK and {b"compression", b"size"} <= one.fields.keys() for _, one in heads)


@dataclass
class _Gathered:
    """Messages of one connection in a chunk."""

    starts: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    times: list[int] = field(default_factory=list)
    index: list[int] = field(default_factory=list)


class Ros1Bag:
    """Iterates over the messages of a bag.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._connections: dict[int, Connection] = {}
        self._count = 0
        self._unknown = 0
        self._skipped = SkippedBytes("record")
        # Headers of messages differ in their time alone: where it stands by their length, the connection by the rest.
        self._time_places: dict[int, int] = {}
        self._heads: dict[bytes, int] = {}

    def __iter__(self) -> Iterator[Part]:
        with self._source.open() as stream:
            yield from self._records(stream, self._source.size)
        yield from self._skipped.damages()
        if self._unknown:
            what = "messages of a connection that is not in the file"
            yield Damage("dropped_channel", "the whole log", self._unknown, what)

    def _records(self, stream: BinaryIO, size: int) -> Iterator[Part]:
        at = len(MAGIC) if self._source.head.startswith(MAGIC) else 0
        while at < size:
            head = self._read_head(stream, at, size)
            if head is None:
                place = self._next_record(stream, at + 1, size)
                self._skipped.add(at, place, self._count)
                at = place
                continue
            stream.seek(head.data_at)
            is_cut = head.end > size
            if is_cut and (head.op != CHUNK or self._next_record(stream, head.data_at, size, _OP_OUTSIDE) < size):
                place = self._next_record(stream, at + 1, size)  # its length is not to be trusted, or the end is cut
                if place == size:
                    yield Damage("truncated", bytes_place(at, size), size - at, "bytes of a record cut off")
                else:
                    self._skipped.add(at, place, self._count)
                at = place
                continue
            if not is_cut and (place := self._record_inside(stream, head, size)):
                self._skipped.add(at, place, self._count)  # bytes are missing in it, and its length leads too far
                at = place
                continue
            if head.op == CHUNK:
                stream.seek(head.data_at)
                yield from self._chunk(head, stream.read(min(head.end, size) - head.data_at), at, is_cut)
            elif head.op in (MESSAGE, CONNECTION):
                yield from self._messages(_read(stream, at, head.end - at), bytes_place(at, head.end))
            at = head.end if not is_cut else size

    def _record_inside(self, stream: BinaryIO, head: _Head, size: int) -> int:
        """Where the next record begins within one behind which none does; 0 for a record that ends where it says."""
        if head.end >= size or self._read_head(stream, head.end, size) is not None:
            return 0
        place = self._next_record(stream, head.data_at, min(size, head.end + BEYOND_BYTES), _OP_OUTSIDE)
        return place if place < head.end else 0

    def _read_head(self, stream: BinaryIO, at: int, size: int) -> _Head | None:
        data = _read(stream, at, 4096)
        length = int.from_bytes(data[:4], "little")
        if 4096 < length + 8 <= MAX_HEADER_BYTES:
            data = _read(stream, at, length + 8)
        head = _head_at(data, 0, size)
        return None if head is None else head._replace(data_at=at + head.data_at, end=at + head.end)

    def _next_record(self, stream: BinaryIO, start: int, size: int, ops: re.Pattern[bytes] = _OP) -> int:
        """Where a record begins from ``start`` on, told by its operation; ``size`` when none does."""
        at = start
        while at < size:
            block = _read(stream, at, min(SEARCH_BYTES, size - at) + 64)
            for begin, head in _heads_in(block, ops):
                if at + head.data_at <= size:
                    return at + begin
            if len(block) <= SEARCH_BYTES:
                return size
            at += SEARCH_BYTES
        return size

    def _chunk(self, head: _Head, data: bytes, at: int, is_cut: bool) -> Iterator[Part]:
        compression = head.fields.get(b"compression", b"")
        size = _number(head.fields, b"size") or 0
        content, reason = _decompress(compression, data, min(size, MAX_CHUNK_BYTES))
        place = bytes_place(at, head.data_at + len(data))
        if is_cut:
            what = f"chunk that the end of the file cuts off, {len(content)} of {size} bytes kept"
            yield Damage("truncated", place, 1, what)
        elif reason or len(content) != size:
            what = f"chunk that {reason or 'has another size than it claims'}, {len(content)} of {size} bytes kept"
            yield Damage("corrupt", place, 1, what)
        yield from self._messages(content, place, is_told=len(content) != size)

    def _messages(self, content: bytes, place: str, *, is_told: bool = False) -> Iterator[Part]:
        """Messages that stand one after the other; definitions among them are taken in."""
        found: dict[int, _Gathered] = {}
        at = lost = 0
        while at < len(content):
            end = self._known_message(content, at, found)
            if end:
                at = end
                continue
            head = _head_at(content, at, len(content))
            if head is None or head.end > len(content):
                match = next((one.start() for one in _OP.finditer(content, at + 5)), len(content))
                begins = (begin for begin in range(max(at + 1, match - 512), match) if _fits(content, begin, match))
                behind = next(begins, match + 1 if match < len(content) else match)
                lost += behind - at if behind < len(content) or not is_told else 0
                at = behind
                continue
            if head.op == CONNECTION:
                self._connect(head, content[head.data_at : head.end])
            elif head.op == MESSAGE:
                self._message(content, at, head, found)
            at = head.end
        if lost:
            yield Damage("corrupt", place, lost, "bytes of a chunk's content that are no record")
        buffer = np.frombuffer(content, np.uint8)
        for number, one in found.items():
            times = np.array(one.times, dtype=np.int64)
            yield Block(
                self._connections[number],
                buffer,
                np.array(one.starts, dtype=np.int64),
                np.array(one.sizes, dtype=np.int64),
                times,
                times,
                np.array(one.index, dtype=np.int64),
            )

    def _message(self, content: bytes, at: int, head: _Head, found: dict[int, _Gathered]) -> None:
        number, time = _number(head.fields, b"conn"), head.fields.get(b"time", b"")
        if number not in self._connections or number is None or len(time) != 8:
            self._unknown += 1
            return
        time_at = content.find(b"time=" + time, at, head.data_at) + 5 - at
        length = head.data_at - at - 8
        self._time_places[length] = time_at
        self._heads[content[at + 4 : at + time_at] + content[at + time_at + 8 : at + 4 + length]] = number
        self._known_message(content, at, found)

    def _known_message(self, content: bytes, at: int, found: dict[int, _Gathered]) -> int:
        """Take in a message whose header is known but for its time; returns where it ends, 0 when it is another."""
        length = int.from_bytes(content[at : at + 4], "little")
        place = at + self._time_places.get(length, 0)
        number = self._heads.get(content[at + 4 : place] + content[place + 8 : at + 4 + length]) if place > at else None
        start = at + 8 + length
        end = start + int.from_bytes(content[start - 4 : start], "little")
        if number is None or end > len(content):
            return 0
        seconds, rest_ns = _TIME.unpack_from(content, place)
        one = found.setdefault(number, _Gathered())
        one.starts.append(start)
        one.sizes.append(end - start)
        one.times.append(seconds * NS_PER_S + rest_ns)
        one.index.append(self._count)
        self._count += 1
        return end

    def _connect(self, head: _Head, data: bytes) -> None:
        number, more = _number(head.fields, b"conn"), parse_header(data)
        if number is None or more is None or number in self._connections:
            return
        topic = head.fields.get(b"topic", more.get(b"topic", b"")).decode("utf-8", "replace")
        kind = plain_name(more.get(b"type", b"").decode("utf-8", "replace"))
        schema = more.get(b"message_definition", b"")
        self._connections[number] = Connection(len(self._connections), topic, kind, "ros1", "ros1msg", schema)


def _fits(content: bytes, begin: int, within: int) -> bool:
    head = _head_at(content, begin, len(content))
    return head is not None and head.end <= len(content) and head.data_at > within


def _read(stream: BinaryIO, at: int, size: int) -> bytes:
    stream.seek(at)
    return stream.read(size)


def _decompress(compression: bytes, data: bytes, size: int) -> tuple[bytes, str]:
    """What a chunk holds, no more than it claims, and why it is not all; damaged ones give what stands before."""
    if compression in (b"none", b""):
        return data[:size], ""
    if compression not in (b"bz2", b"lz4"):
        return b"", f"is compressed in a way that is not known ({compression[:20]!r})"
    reader = bz2.BZ2Decompressor() if compression == b"bz2" else lz4.frame.LZ4FrameDecompressor()
    pieces, length = [], 0
    try:
        for at in range(0, len(data), 1 << 16):
            if reader.eof:
                break
            pieces.append(reader.decompress(data[at : at + (1 << 16)], size - length + 1))
            length += len(pieces[-1])
            while not reader.eof and not reader.needs_input and length <= size:
                pieces.append(reader.decompress(b"", size - length + 1))
                length += len(pieces[-1])
                if not pieces[-1]:
                    break
            if length > size:
                return b"".join(pieces)[:size], "expands beyond its size"
    except (OSError, RuntimeError, ValueError, EOFError):
        return b"".join(pieces), "cannot be decompressed"
    return b"".join(pieces), ""
