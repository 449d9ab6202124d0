"""Reader for the messages of an MCAP of any program.

It reads the messages of every intact chunk, and those outside chunks, as far as they go. A cut file gives what stands
before the cut, and the beginning of its last chunk. Where no record can be recognised the next chunk is searched for; a
chunk whose checksum is wrong is lost. The sequence numbers of a channel show whether a chunk is missing.
"""

import re
from collections.abc import Iterator
from typing import BinaryIO, TypeAlias

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Schema

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.store.decompress import MAX_CHUNK_BYTES, ChunkError, decompress
from groundstation.store.framing import (
    MAX_RECORD_BYTES,
    ChunkHead,
    Summary,
    ends_whole,
    parse_record,
    parse_records,
    read_chunk_head,
    read_summary,
)
from groundstation.store.marks import MAGIC, RECORD_PREFIX, SEARCH_BYTES
from groundstation.store.messages import HEAD, ByteArray, ChunkMessages
from groundstation.store.walk import find_messages

PEEK_BYTES = 64
MOST_EXPANDED, FREE_BYTES = 200, 64 << 20  # chunks expand to so many times the file's size, or to so much
_CHUNK = re.compile(rb"\x06(?=[\0-\xff]{5}\0{3})")  # opcode and a length below 2**40
_MESSAGE = re.compile(rb"\x05(?=[\0-\xff]{3}\0{5})")
_KNOWN_OPCODES = frozenset(range(Opcode.HEADER, Opcode.DATA_END + 1))
FEWEST_STEPS = 10
LONGEST_JUMP = 1_000_000
_WRAP = 1 << 32


@dataclass(frozen=True, eq=False)
class ForeignMessages:
    """Messages of one channel that stand together.

    ``places`` (n,) are their places among the messages of the file.
    """

    channel: Channel
    schema: Schema | None
    messages: ChunkMessages
    places: "np.ndarray[tuple[int], np.dtype[np.int64]]"


@dataclass(frozen=True)
class ForeignLost:
    """Loss of ``count`` of ``what`` in the bytes ``start`` to ``end`` of the file.

    ``before`` is the number of the message that the loss comes before.
    """

    start: int
    end: int
    what: str
    count: int
    before: int
    is_cut: bool = False


@dataclass(frozen=True)
class UnknownChannel:
    """Messages of a channel that no record of the file defines."""

    messages: int


@dataclass(frozen=True)
class Missing:
    """Messages of a topic that the file counts and that are not in it."""

    topic: str
    count: int
    what: str


Found: TypeAlias = ForeignMessages | ForeignLost | UnknownChannel | Missing


def read_header(head: bytes) -> Header | None:
    """Read the header in the first bytes of an MCAP."""
    start = len(MAGIC) + RECORD_PREFIX
    length = int.from_bytes(head[len(MAGIC) + 1 : start], "little")
    is_header = head.startswith(MAGIC + bytes([Opcode.HEADER])) and start + length <= len(head)
    record = parse_record(Opcode.HEADER, head[start : start + length]) if is_header else None
    return record if isinstance(record, Header) else None


class ForeignMcap:
    """Iterator over the content of a file, in its order.

    Parameters
    ----------
    file : binary file
    size : int
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._size = file, size
        self._known = Summary()
        self._count = self._unknown = 0
        self._met: dict[int, Sequences] = {}
        self._room = max(FREE_BYTES, MOST_EXPANDED * size)  # bytes that chunks may still expand to

    def __iter__(self) -> Iterator[Found]:
        summary = read_summary(self._file, self._size)
        if summary is not None:
            self._known = summary  # definitions whose first copy is damaged
        has_end = ends_whole(self._file, self._size)
        at = len(MAGIC)
        loose = bytearray()  # messages outside chunks, until there are enough to be worth a block
        while at < self._size:
            peek = self._read(at, PEEK_BYTES)
            head = read_chunk_head(peek)
            end = at + RECORD_PREFIX + int.from_bytes(peek[1:RECORD_PREFIX], "little")
            if head is not None and (head.length <= MAX_CHUNK_BYTES + PEEK_BYTES):
                yield from self._chunk(at, head)
                if at + head.length > self._size:
                    return
                at += head.length
            elif len(peek) < RECORD_PREFIX or peek[0] not in _KNOWN_OPCODES or end > self._size:
                place = self.find_chunk(at + 1)
                is_cut = place == self._size and not has_end
                yield ForeignLost(at, place, "bytes that are no record", place - at, self._count, is_cut)
                if is_cut:
                    break
                at = place
            elif peek[0] == Opcode.DATA_END:
                break
            else:
                if peek[0] in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL) and end - at <= MAX_RECORD_BYTES:
                    loose += self._read(at, end - at)
                at = end
                if len(loose) < SEARCH_BYTES and at < self._size:
                    continue
            if loose:
                yield from self._records(np.frombuffer(bytes(loose), np.uint8), at - len(loose), at)
                loose.clear()
        if loose:
            yield from self._records(np.frombuffer(bytes(loose), np.uint8), at - len(loose), at)
        if not has_end:
            yield ForeignLost(self._size, self._size, "file that ends without its summary", 1, self._count, True)
        if self._unknown:
            yield UnknownChannel(self._unknown)
        yield from self._missing()

    def _missing(self) -> Iterator[Missing]:
        """Yield the messages that the statistics count and that were not met.

        Where the statistics show none, the sequence numbers of the messages do.
        """
        counts = self._known.message_counts
        gone = {number: counts.get(number, 0) - self._met[number].count for number in self._met}
        gone |= {number: count for number, count in counts.items() if number not in self._met}
        what = "messages that the statistics of the file count and that are not in it"
        if not any(count > 0 for count in gone.values()):
            gone = {number: met.missing for number, met in self._met.items()}
            what = "messages missing between two chunks by their sequence numbers, which run through everywhere else"
        for number, count in sorted(gone.items()):
            if count > 0 and number in self._known.channels:
                yield Missing(self._known.channels[number].topic, count, what)

    def _read(self, at: int, length: int) -> bytes:
        self._file.seek(at)
        return self._file.read(length)

    def find_chunk(self, start: int) -> int:
        """Return the place of the next chunk from ``start`` on, or the size of the file."""
        at = start
        while at < self._size:
            block = self._read(at, SEARCH_BYTES + PEEK_BYTES)
            for match in _CHUNK.finditer(block, 0, SEARCH_BYTES):
                head = read_chunk_head(block[match.start() : match.start() + PEEK_BYTES])
                if head is not None and at + match.start() + head.data_at < self._size:
                    return at + match.start()
            at += SEARCH_BYTES
        return self._size

    def _chunk(self, at: int, head: ChunkHead) -> Iterator[Found]:
        data = self._read(at + head.data_at, head.length - head.data_at)
        end = at + head.length
        if end > self._size:
            raw = _beginning(head.compression, data, head.uncompressed_size)
            yield from self._records(raw[: _whole_records(raw.tobytes())], at, end)
            what = f"bytes of a chunk that is cut; {len(raw)} bytes of its content are kept"
            yield ForeignLost(at, self._size, what, self._size - at, self._count, True)
            return
        try:
            self._room -= head.uncompressed_size
            if self._room < 0:
                raise ChunkError(f"the file expands to more than {MOST_EXPANDED} times its size")
            raw = decompress(head.compression, data, head.uncompressed_size, head.crc or None)
        except ChunkError as error:
            yield ForeignLost(at, end, f"bytes of a chunk that is lost: {error}", end - at, self._count)
            return
        yield from self._records(raw, at, end)

    def _stretches(self, raw: ByteArray, at: int, end: int) -> Iterator[Found]:
        """Yield consecutive records of a chunk without a checksum.

        After bytes that are no record, the next one is searched for.
        """
        data, start = raw.tobytes(), 0
        while start < len(data):
            whole = _whole_records(data, start)
            yield from self._records(raw[start:whole], at, end)
            if whole == len(data):
                return
            start = _next_message(data, whole + 1)
            yield ForeignLost(at, end, "bytes of a chunk's content that are no record", start - whole, self._count)

    def _records(self, raw: ByteArray, at: int, end: int) -> Iterator[Found]:
        """Yield the messages among consecutive records; definitions are taken in."""
        found = find_messages(raw)
        if found is None:
            yield from self._stretches(raw, at, end)
            return
        starts, sizes = found
        self._define(raw, starts, sizes)
        if not len(starts):
            return
        everything = ChunkMessages(raw, 0, starts, sizes, 0)
        ids = everything.head("channel_id")
        places = np.arange(self._count, self._count + len(starts), dtype=np.int64)
        self._count += len(starts)
        for number in np.unique(ids).tolist():
            rows = np.flatnonzero(ids == number)
            self._met.setdefault(number, Sequences()).take(everything.take(rows).head("sequence"))
            channel = self._known.channels.get(number)
            if channel is None:
                self._unknown += len(rows)
                continue
            schema = self._known.schemas.get(channel.schema_id)
            messages = ChunkMessages(raw, number, starts[rows], sizes[rows], 0)
            yield ForeignMessages(channel, schema, messages, places[rows])

    def _define(self, raw: ByteArray, starts: "np.ndarray", sizes: "np.ndarray") -> None:
        """Take in the definitions that stand between messages."""
        if int(sizes.sum()) == len(raw):
            return
        ends = np.concatenate(([0], starts + sizes))
        for start, end in zip(ends, np.append(starts, len(raw)), strict=True):
            if end > start:
                for opcode, record in parse_records(raw[start:end].tobytes()):
                    if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                        parsed = parse_record(opcode, record[RECORD_PREFIX:])
                        if isinstance(parsed, Schema | Channel) and not self._is_sure_of(parsed):
                            self._known.add(parsed, b"")

    def _is_sure_of(self, found: Schema | Channel) -> bool:
        """Tell whether an intact summary defines the same id.

        The summary has a checksum, which the definition here may lack.
        """
        known = self._known.schemas if isinstance(found, Schema) else self._known.channels
        return self._known.is_intact and found.id in known


def _whole_records(data: bytes, start: int = 0) -> int:
    """Return the end of the whole records that follow one another from a place on.

    Nothing is copied.
    """
    at = start
    while at + RECORD_PREFIX <= len(data):
        end = at + RECORD_PREFIX + int.from_bytes(data[at + 1 : at + RECORD_PREFIX], "little")
        if end > len(data) or (data[at] == Opcode.MESSAGE and end - at < HEAD.itemsize):
            break
        at = end
    return at


def _next_message(data: bytes, start: int) -> int:
    """Return the place of the next message after damage.

    Two whole messages must stand there, or one that ends the data.
    """
    for match in _MESSAGE.finditer(data, start):
        at = match.start()
        for _number in range(2):
            at += RECORD_PREFIX + int.from_bytes(data[at + 1 : at + RECORD_PREFIX], "little")
            if at >= len(data) or data[at] != Opcode.MESSAGE:
                break
        if at == len(data) or (at < len(data) and data[at] == Opcode.MESSAGE):
            return match.start()
    return len(data)


def _beginning(compression: str, data: bytes, size: int) -> ByteArray:
    """Decompress the beginning of a chunk's data, as far as it goes."""
    limit = min(size, MAX_CHUNK_BYTES)
    raw = bytearray()
    try:
        if compression == "zstd":
            reader = zstandard.ZstdDecompressor(max_window_size=128 << 20).decompressobj()
            for at in range(0, len(data), 1 << 14):
                raw += reader.decompress(data[at : at + (1 << 14)])
                if len(raw) > limit:
                    break
        elif compression == "lz4":
            raw += lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=limit)
        else:
            raw += data
    except (zstandard.ZstdError, RuntimeError, ValueError, EOFError):
        pass  # the data before the damage are kept
    return np.frombuffer(bytes(raw[:limit]), np.uint8)


@dataclass
class Sequences:
    """Check of the sequence numbers of one channel, block by block.

    Attributes
    ----------
    count : int
        Messages met.
    steps : int
        From one message to the next inside of blocks.
    missing : int
        Numbers left out between blocks; 0 where any is left out inside of one, for then they tell no missing block.
    """

    count: int = 0
    steps: int = 0
    _last: int = -1
    _missing: int = 0
    _is_counting: bool = True

    def take(self, numbers: Int64Array) -> None:
        """Take in the messages of a block, shape (n,), at least one."""
        inside = np.diff(numbers) % _WRAP
        self._is_counting &= bool((inside == 1).all())
        self.steps += len(inside)
        if self.count:
            jump = (int(numbers[0]) - self._last) % _WRAP
            self._is_counting &= 1 <= jump <= LONGEST_JUMP
            self._missing += jump - 1
        self.count += len(numbers)
        self._last = int(numbers[-1])

    @property
    def missing(self) -> int:
        """Sequence numbers missing between blocks, where all others are consecutive."""
        return self._missing if self._is_counting and self.steps >= FEWEST_STEPS else 0
