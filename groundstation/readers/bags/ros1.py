"""Bags of ROS 1 (version 2.0): records of a header and data, mostly in compressed chunks.

The index at the end tells the connections before the first chunk is read, and how many messages there should be; a bag
that was cut has none, and is read without. A bag has no checksums.

Source: http://wiki.ros.org/Bags/Format/2.0.
"""

import bz2
import struct
from collections.abc import Iterator
from dataclasses import field

import lz4.frame
import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.marks import ROS1_MAGIC
from groundstation.readers.bags.messages import Connection, ConnectionBlock, Missing, Part, counted_by
from groundstation.readers.bags.ros1_records import (
    CHUNK,
    CONNECTION,
    MESSAGE,
    OP,
    Index,
    Record,
    RecordHeader,
    Records,
    Tries,
    head_at,
    heads_in,
    number_of,
    parse_header,
)
from groundstation.readers.bags.work import most_messages
from groundstation.readers.compressed import MAX_RATIO
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source

MAX_CHUNK_BYTES = 256 << 20  # decompressed; recorders close a chunk at 768 kB
FREE_BYTES = 32 << 20  # size that chunks may expand to, whatever the size of the file
MOST_SEARCHED = 20_000  # times that a record is searched for in the contents of chunks
_TIME = struct.Struct("<II")


@dataclass
class _Gathered:
    """Messages of one connection in a chunk."""

    starts: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    times: list[int] = field(default_factory=list)
    index: list[int] = field(default_factory=list)


class Ros1Bag:
    """Iterable over the messages of a bag.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._connections: dict[int, Connection] = {}
        self._met: dict[int, int] = {}
        self._count = self._chunks = 0
        self._unknown = self._searched = self._expanded = 0
        self._tries = Tries()
        self._skipped = SkippedBytes("record")
        # Headers of messages differ in their time alone: where it stands by their length, the connection by the rest.
        self._time_places: dict[int, int] = {}
        self._heads: dict[bytes, int] = {}

    def __iter__(self) -> Iterator[Part]:
        with self._source.open() as stream:
            index = Index.of(stream, self._source.size)
            for head, data in index.connections.values():
                self._connect(head, data)
            records = Records(stream, self._source.size)
            for record in records:
                yield from self._record(records, record)
        yield from self._skipped.damages()
        if self._unknown:
            what = "messages of a connection that is not in the file"
            yield Damage("dropped_channel", "the whole log", self._unknown, what)
        yield from self._missing(index)

    def _record(self, records: Records, record: Record) -> Iterator[Part]:
        head, start, end = record.head, record.start, record.end
        if head is None:
            if record.is_cut:
                yield Damage("truncated", bytes_place(start, end), end - start, "bytes of a record cut off")
            else:
                self._skipped.add(start, end, self._count)
        elif head.op == CHUNK:
            self._chunks += 1
            yield from self._chunk(head, records.read(head.data_at, end - head.data_at), start, record.is_cut)
        elif head.op in (MESSAGE, CONNECTION):
            yield from self._messages(records.read(start, end - start), bytes_place(start, end))

    def _missing(self, index: Index) -> Iterator[Missing | Damage]:
        """Yield the messages and chunks that the bag counts and that were not met.

        A bag without its index was cut.
        """
        is_told = False
        if not self._source.head.startswith(ROS1_MAGIC) and not self._skipped:
            yield Damage("corrupt", "byte 0", 1, "header of the bag is missing", loses_data=False)
        for number, count in sorted(index.messages.items()):
            lost = count - self._met.get(number, 0)
            if lost > 0 and number in self._connections:
                yield Missing(self._connections[number].topic, lost, counted_by("index of the bag"))
                is_told = True
        chunks, end = max(index.listed, index.chunks or 0), f"byte {self._source.size}"
        lost = chunks - self._chunks
        if not index.is_there and not (index.chunks == 0 and index.index_at == self._source.size):
            what = f"chunks of the {chunks} that the bag counts are gone; the index at its end is gone too"
            if lost <= 0:
                lost, what = 1, "index at the end of the bag is missing: it was not closed, or it is cut"
            yield Damage("truncated", end, lost, what)
        elif lost > 0 and not is_told:
            yield Damage("dropped_rows", "the whole log", lost, f"chunks of the {chunks} that the bag counts are gone")

    def _chunk(self, head: RecordHeader, data: bytes, at: int, is_cut: bool) -> Iterator[Part]:
        compression = head.fields.get(b"compression", b"")
        size = number_of(head.fields, b"size") or 0
        left = max(FREE_BYTES, MAX_RATIO * self._source.size) - self._expanded
        content, reason = _decompress(compression, data, min(size, MAX_CHUNK_BYTES, left))
        self._expanded += len(content)
        place = bytes_place(at, head.data_at + len(data))
        if is_cut:
            what = f"chunk that the end of the file cuts off, {len(content)} of {size} bytes kept"
            yield Damage("truncated", place, 1, what)
        elif reason or len(content) != size:
            what = f"chunk that {reason or 'has another size than it claims'}, {len(content)} of {size} bytes kept"
            yield Damage("corrupt", place, 1, what)
        yield from self._messages(content, place, is_told=len(content) != size)

    def _messages(self, content: bytes, place: str, *, is_told: bool = False) -> Iterator[Part]:
        """Read consecutive messages; definitions among them are taken in."""
        found: dict[int, _Gathered] = {}
        at = lost = 0
        most = most_messages(self._source.size) + 1  # one more than is allowed: reported as too many
        while at < len(content) and self._count <= most:
            end = self._known_message(content, at, found)
            if end:
                at = end
                continue
            head = head_at(content, at)
            if head is None or head.end > len(content):
                behind = self._behind(content, at)
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
            self._met[number] = self._met.get(number, 0) + len(one.times)
            times = np.array(one.times, dtype=np.int64)
            yield ConnectionBlock(
                self._connections[number],
                buffer,
                np.array(one.starts, dtype=np.int64),
                np.array(one.sizes, dtype=np.int64),
                times,
                times,
                np.array(one.index, dtype=np.int64),
            )

    def _behind(self, content: bytes, at: int) -> int:
        """Return the place of the next record behind bytes that are none.

        The end of the content when there is no record, or when this was asked too often: then the rest is given up.
        """
        self._searched += 1
        if self._searched > MOST_SEARCHED:
            return len(content)
        heads = heads_in(content, OP, self._tries, at + 1)
        return next((begin for begin, head in heads if head.end <= len(content)), len(content))

    def _message(self, content: bytes, at: int, head: RecordHeader, found: dict[int, _Gathered]) -> None:
        number, time = number_of(head.fields, b"conn"), head.fields.get(b"time", b"")
        if number not in self._connections or number is None or len(time) != 8:
            self._unknown += 1
            return
        time_at = content.find(b"time=" + time, at, head.data_at) + 5 - at
        length = head.data_at - at - 8
        self._time_places[length] = time_at
        self._heads[content[at + 4 : at + time_at] + content[at + time_at + 8 : at + 4 + length]] = number
        self._known_message(content, at, found)

    def _known_message(self, content: bytes, at: int, found: dict[int, _Gathered]) -> int:
        """Take in a message whose header is known but for its time; return its end.

        0 when it is another message.
        """
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

    def _connect(self, head: RecordHeader, data: bytes) -> None:
        number, more = number_of(head.fields, b"conn"), parse_header(data)
        if number is None or more is None or number in self._connections:
            return
        topic = head.fields.get(b"topic", more.get(b"topic", b"")).decode("utf-8", "replace")
        kind = plain_name(more.get(b"type", b"").decode("utf-8", "replace"))
        schema = more.get(b"message_definition", b"")
        publisher = more.get(b"callerid", b"").decode("utf-8", "replace") or f"connection {number}"
        place = len(self._connections)
        self._connections[number] = Connection(place, topic, kind, "ros1", "ros1msg", schema, publisher)


def _decompress(compression: bytes, data: bytes, size: int) -> tuple[bytes, str]:
    """Decompress a chunk to at most the size it claims, and say why it is not all.

    A damaged chunk gives what stands before the damage.
    """
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
