"""Records of a ROS 1 bag that stand in no chunk.

They are found one after the other, and searched for where bytes are damaged.

Source: http://wiki.ros.org/Bags/Format/2.0.
"""

import re
from collections.abc import Iterator
from dataclasses import field
from itertools import islice
from typing import BinaryIO, NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.readers.bags.marks import ROS1_MAGIC

MESSAGE, HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
MAX_HEADER_BYTES, MOST_FIELDS = 4096, 32  # largest header, and fields in it; also of the description of a connection
SEARCH_BYTES = 1 << 20
BEYOND_BYTES = 4096  # room for a header that begins within a record and ends behind it
BACK_BYTES, MOST_BEGINNINGS = 512, 8  # how far before an operation its header may begin, and places that are tried
MOST_TRIES = 5_000  # for one file: damaged bytes look like an operation once in many gigabytes
LOOKED_AT, MOST_TRIED = 1 << 16, 200  # bytes of a file without the first ones of a bag, and headers in them
INDEX_BYTES = 64 << 20  # largest index
# Every record's header has the field "op" of one byte: 4 bytes of length, "op=", the number.
OP = re.compile(rb"\x04\0\0\0op=[\x02-\x07]")
OP_OUTSIDE = re.compile(rb"\x04\0\0\0op=[\x04-\x06]")  # operations of records outside chunks
# A header begins with its length and that of its first field, then a name; both lengths are below a megabyte.
_BEGINNING = re.compile(rb"(?=[\0-\xff]{2}[\0-\x0f]\0[\0-\xff]{2}[\0-\x0f]\0[a-z_])")


class RecordHeader(NamedTuple):
    """Header of a record, and where its data begins and ends."""

    op: int
    fields: dict[bytes, bytes]
    data_at: int
    end: int


def parse_header(data: bytes) -> dict[bytes, bytes] | None:
    """Parse the fields of a header; None when the bytes are no header.

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
        if len(fields) > MOST_FIELDS:
            return None
    return fields


def number_of(fields: dict[bytes, bytes], name: bytes) -> int | None:
    """Return an unsigned number of a header; None when the header lacks it."""
    value = fields.get(name)
    return int.from_bytes(value, "little") if value is not None and len(value) <= 8 else None


def head_at(data: bytes, at: int) -> RecordHeader | None:
    """Return the record at a place of ``data``, which may end behind its header."""
    length = int.from_bytes(data[at : at + 4], "little")
    if not 8 <= length <= MAX_HEADER_BYTES or at + 8 + length > len(data):
        return None
    fields = parse_header(data[at + 4 : at + 4 + length])
    op = number_of(fields, b"op") if fields else None
    if fields is None or op is None or not MESSAGE <= op <= CONNECTION:
        return None
    data_at = at + 8 + length
    return RecordHeader(op, fields, data_at, data_at + int.from_bytes(data[data_at - 4 : data_at], "little"))


@dataclass
class Tries:
    """Number of false headers that may still be met in the search for records.

    Their bytes look like the operation of a record and are none.
    """

    left: int = MOST_TRIES


def heads_in(block: bytes, ops: re.Pattern[bytes], tries: Tries, start: int = 0) -> Iterator[tuple[int, RecordHeader]]:
    """Yield the headers of records in some bytes and their places, by their operation."""
    for match in ops.finditer(block, start):
        tries.left -= 1
        if tries.left < 0:
            return
        first = max(start, match.start() - BACK_BYTES)
        # The fields of a header have no order: it begins at one of the lengths before, most likely a near one.
        begins = [one.start() for one in _BEGINNING.finditer(block, first, match.start() + 8)]
        for begin in reversed(begins[-MOST_BEGINNINGS:]):
            head = head_at(block, begin)
            if head is not None and begin < match.start() and match.end() <= head.data_at - 4:
                tries.left += 1
                yield begin, head
                break


def has_chunk(head: bytes) -> bool:
    """Tell whether a chunk of a bag begins in the first bytes of a file.

    Anything may stand before it.
    """
    heads = islice(heads_in(head[:LOOKED_AT], OP_OUTSIDE, Tries()), MOST_TRIED)
    return any(one.op == CHUNK and {b"compression", b"size"} <= one.fields.keys() for _, one in heads)


@dataclass(frozen=True)
class Record:
    """Record in the bytes ``start`` to ``end`` of the file; without a head, bytes of none.

    ``is_cut``: the file ends before the record does.
    """

    start: int
    end: int
    head: RecordHeader | None = None
    is_cut: bool = False


@dataclass(frozen=True)
class Records:
    """Iterable over the records of a bag that stand in no chunk, and the bytes between them.

    Parameters
    ----------
    stream : binary file
    size : int
        Bytes of the file.
    tries : Tries
    """

    stream: BinaryIO
    size: int
    tries: Tries = field(default_factory=Tries)

    def __iter__(self) -> Iterator[Record]:
        at = len(ROS1_MAGIC) if self.read(0, len(ROS1_MAGIC)) == ROS1_MAGIC else 0
        while at < self.size:
            record = self._record(at)
            yield record
            at = record.end

    def _record(self, at: int) -> Record:
        head = self.head(at)
        if head is None:
            return Record(at, self._next(at + 1, self.size))
        if head.end > self.size:
            if head.op == CHUNK and self._next(head.data_at, self.size, OP_OUTSIDE) == self.size:
                return Record(at, self.size, head, is_cut=True)
            end = self._next(at + 1, self.size)  # the stated length cannot be trusted, or the end is cut
            return Record(at, end, is_cut=end == self.size)
        inside = self._inside(head)
        return Record(at, inside) if inside else Record(at, head.end, head)

    def _inside(self, head: RecordHeader) -> int:
        """Return the place of the next record inside one that states too large a length.

        Bytes are missing in such a record, and no other begins where it says that it ends. 0 for a record that ends
        where it says.
        """
        if head.end >= self.size or self.head(head.end) is not None:
            return 0
        place = self._next(head.data_at, min(self.size, head.end + BEYOND_BYTES), OP_OUTSIDE)
        return place if place < head.end else 0

    def head(self, at: int) -> RecordHeader | None:
        """Return the header of the record at a place of the file."""
        head = head_at(self.read(at, MAX_HEADER_BYTES + 8), 0)
        return None if head is None else head._replace(data_at=at + head.data_at, end=at + head.end)

    def _next(self, start: int, end: int, ops: re.Pattern[bytes] = OP) -> int:
        """Return the first place from ``start`` on where a record begins, by its operation.

        ``end`` when none does before it.
        """
        at = start
        while at < end:
            block = self.read(at, min(SEARCH_BYTES, end - at) + 64)
            for begin, head in heads_in(block, ops, self.tries):
                if at + head.data_at <= end:
                    return at + begin
            if len(block) <= SEARCH_BYTES or self.tries.left < 0:
                return end
            at += SEARCH_BYTES
        return end

    def read(self, at: int, size: int) -> bytes:
        """Read bytes of the file; none beyond its end, which damaged bytes may name."""
        if at >= self.size:
            return b""
        self.stream.seek(at)
        return self.stream.read(size)


@dataclass
class Index:
    """Statements of a bag about itself.

    Attributes
    ----------
    index_at : int, optional
        Where its index begins, by the first record; 0 in a bag that was never closed, None in one without that record.
    chunks : int, optional
        How many chunks it has, by the first record.
    connections : dict of number to (header, data)
    messages : dict of number to int
        Messages of each connection, by what the index says of the chunks.
    listed : int
        Chunks that the index lists.
    """

    index_at: int | None = None
    chunks: int | None = None
    connections: dict[int, tuple[RecordHeader, bytes]] = field(default_factory=dict)
    messages: dict[int, int] = field(default_factory=dict)
    listed: int = 0

    @property
    def is_there(self) -> bool:
        """Tell whether anything of the index was found."""
        return bool(self.listed or self.connections)

    @classmethod
    def of(cls, stream: BinaryIO, size: int) -> "Index":
        """Read the index of a file; if it is not at its place, search the records for it."""
        records, found = Records(stream, size), cls()
        first = records.head(len(ROS1_MAGIC)) if records.read(0, len(ROS1_MAGIC)) == ROS1_MAGIC else None
        if first is not None and first.op == HEADER:
            found.index_at = number_of(first.fields, b"index_pos")
            found.chunks = number_of(first.fields, b"chunk_count")
        head = records.head(found.index_at) if found.index_at else None
        while head is not None and head.op in (CONNECTION, CHUNK_INFO) and head.end <= size:
            found.take(head, records.read(head.data_at, min(head.end - head.data_at, INDEX_BYTES)))
            head = records.head(head.end)
        if found.is_there and found.listed == found.chunks:
            return found
        found = cls(found.index_at, found.chunks)  # not at its place, or not all of it
        for record in records:
            if record.head is not None and record.head.op in (CONNECTION, CHUNK_INFO) and not record.is_cut:
                length = min(record.end - record.head.data_at, INDEX_BYTES)
                found.take(record.head, records.read(record.head.data_at, length))
        return found

    def take(self, head: RecordHeader, data: bytes) -> None:
        """Take in a record of the index."""
        if head.op == CONNECTION:
            number = number_of(head.fields, b"conn")
            if number is not None:
                self.connections.setdefault(number, (head, data))
            return
        self.listed += 1
        for at in range(0, len(data) - 7, 8):
            number = int.from_bytes(data[at : at + 4], "little")
            count = int.from_bytes(data[at + 4 : at + 8], "little")
            self.messages[number] = self.messages.get(number, 0) + count
