"""Find the intact chunks of a file, whatever happened to the rest of it.

With an intact summary its chunk indexes say where each chunk is and what it holds, so that only the chunk's own data
and checksum matter. Without one the file is walked record by record; where no record can be recognised the next chunk
is searched for by its signature. A chunk counts only when its checksum is right.
"""

import re
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import BinaryIO, TypeAlias, cast

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Metadata, Schema

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.store.channel import COLUMNS_KEY, DERIVED_KEY
from groundstation.store.decompress import MAX_CHUNK_BYTES, ChunkError, Unpacker
from groundstation.store.framing import (
    INDEX_ENTRY,
    MAX_RECORD_BYTES,
    ChunkHead,
    Summary,
    ends_whole,
    parse_record,
    read_chunk_head,
    read_message_index,
    split_messages,
)
from groundstation.store.info import COPY_NAME, is_intact
from groundstation.store.marks import MAGIC, METADATA_NAME, PACKAGE, RECORD_PREFIX, SEARCH_BYTES
from groundstation.store.messages import ChunkMessages
from groundstation.store.schema import message_type, own_columns

# A chunk record of the writer: this text stands 37 bytes from its start, zstd's magic number 8 bytes after it.
SIGNATURE = struct.pack("<I4s", 4, b"zstd")
SIGNATURE_AT = 37
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
PEEK_BYTES = 64
# Opcode and length of what may be a schema or channel record of less than 16 MiB.
_DEFINITION = re.compile(rb"[\x03\x04](?=[\x00-\xff]{3}\x00{5})")
_ENCODING = struct.pack("<I", 8) + b"protobuf"  # stands behind the name of either
_NAME_BYTES = 4096  # names of topics and types are shorter
_MOST_DEFINITIONS = 1 << 17  # twice as many as there are channel ids
_READ_AGAIN = 16  # bytes that may be read for each byte of a file: what is read may turn out to be none, time and again
_CALL_BYTES = 64  # cost of a call, in bytes
_INDEX_BYTES = RECORD_PREFIX + 6  # size of a MessageIndex without its entries


@dataclass(frozen=True)
class Intact:
    """Chunk with the right checksum: its messages by channel."""

    start: int
    messages: list[ChunkMessages]


@dataclass(frozen=True)
class Lost:
    """Unusable bytes ``start`` to ``end`` of the file, and what is known of them.

    ``channels`` are the ids, ``count`` the messages and ``span`` their first and last log time, where known;
    ``is_cut`` when the file ends there without its summary.
    """

    start: int
    end: int
    reason: str
    channels: tuple[int, ...] = ()
    count: int | None = None
    span: tuple[int, int] | None = None
    is_cut: bool = False


Found: TypeAlias = Intact | Lost


class _TooMuchReadError(Exception):
    """Error of reading more than a file that is damaged by accident asks for."""


class _Bounded:
    """File of which at most so many bytes are read."""

    def __init__(self, file: BinaryIO, most: int) -> None:
        self._file, self._left = file, most

    def seek(self, at: int) -> int:
        return self._file.seek(at)

    def read(self, length: int) -> bytes:
        data = self._file.read(length)
        self._left -= len(data) + _CALL_BYTES
        if self._left < 0:
            raise _TooMuchReadError
        return data


def bounded(file: BinaryIO, size: int) -> BinaryIO:
    """Return the file with a bound on reading, for work on ``size`` bytes of it.

    Reading more than is due to them raises an error.
    """
    return cast(BinaryIO, _Bounded(file, _READ_AGAIN * size + MAX_RECORD_BYTES))


def _read(file: BinaryIO, at: int, length: int) -> bytes:
    file.seek(at)
    return file.read(length)


def _opened(unpacker: Unpacker, data: memoryview, compression: str, size: int, crc: int) -> list[ChunkMessages]:
    """Return the messages of a chunk's compressed data; ChunkError when it is not intact."""
    messages = split_messages(unpacker.decompress(compression, data, size, crc))
    if messages is None:
        raise ChunkError("its records do not fit together")
    return messages


def index_fits(file: BinaryIO, summary: Summary) -> bool:
    """Tell whether chunks stand where the indexes say.

    One misplaced chunk may be damaged; two show that bytes were lost or added.
    """
    astray = 0
    for index in summary.chunks:
        head = read_chunk_head(_read(file, index.chunk_start_offset, PEEK_BYTES))
        astray += head is None or head.length != index.chunk_length
        if astray > 1:
            return False
    return True


def chunks_by_index(file: BinaryIO, summary: Summary) -> Iterator[Found]:
    """Yield the chunks of a file with an intact summary, in the order of the file.

    The messages of a chunk are gone when the next one is asked for.
    """
    free_from, unpacker = len(MAGIC), Unpacker()
    for index in sorted(summary.chunks, key=lambda index: index.chunk_start_offset):
        start, length = index.chunk_start_offset, index.chunk_length
        inside = free_from <= start and start + length <= summary.start and index.compressed_size <= length
        if not inside or length > MAX_CHUNK_BYTES:
            yield _lost(index, None, "its index leads outside the file")
            continue
        free_from = start + length
        data = unpacker.read(file, start, length)
        head = read_chunk_head(data, need_lengths=False)
        try:
            if head is None:
                raise ChunkError("is too short")
            content = data[length - index.compressed_size :]
            messages = _opened(unpacker, content, index.compression, index.uncompressed_size, head.crc)
        except ChunkError as error:
            known = read_message_index(_read(file, free_from, min(index.message_index_length, MAX_RECORD_BYTES)))
            yield _lost(index, known[1] if known else None, str(error))
        else:
            yield Intact(start, messages)


def _lost(index: ChunkIndex, count: int | None, reason: str) -> Lost:
    start = index.chunk_start_offset
    span = (index.message_start_time, index.message_end_time)
    return Lost(start, start + index.chunk_length, reason, tuple(index.message_index_offsets), count, span)


def chunks_by_walk(file: BinaryIO, size: int) -> Iterator[Found]:
    """Yield the chunks of a file without a usable summary, in the order of the file.

    The messages of a chunk are gone when the next one is asked for.
    The last item is a :class:`Lost` of ``is_cut`` when the file ends before its data does, without bytes where a whole
    record stands before the cut.
    """
    at, has_end = len(MAGIC), ends_whole(file, size)
    try:
        for found in _walked(bounded(file, size), at, size, has_end):
            at = found.start
            yield found
    except _TooMuchReadError:
        yield Lost(at, size, "heads of chunks that contradict each other: given up")


def _walked(file: BinaryIO, at: int, size: int, has_end: bool) -> Iterator[Found]:
    unpacker = Unpacker()
    while at < size:
        peek = _read(file, at, PEEK_BYTES)
        head = _chunk_at(peek, at, size)
        if head is not None:
            found, at = _try_chunk(unpacker, file, at, size, head)
            yield found
            continue
        end = _record_end(file, at, size, peek)
        if end is None or (not _is_plausible(file, end, size) and find_chunk(file, at + 1, size) < end):
            end = find_chunk(file, at + 1, size)
            yield Lost(at, end, "no record can be recognised", is_cut=end == size and not has_end)
            if end == size:
                return
        elif peek[0] == Opcode.DATA_END:
            end = find_chunk(file, at, size)
            if end == size:
                return
            yield Lost(at, end, "chunks follow the end of the data")
        at = end
    if not has_end:
        yield Lost(size, size, "the file ends without its summary", is_cut=True)


def _try_chunk(unpacker: Unpacker, file: BinaryIO, at: int, size: int, head: ChunkHead) -> tuple[Found, int]:
    """Return the chunk at ``at`` and the place to go on from."""
    data = _read(file, at, head.length)
    end = at + head.length
    try:
        content = memoryview(data)[head.data_at :]
        messages = _opened(unpacker, content, head.compression, head.uncompressed_size, head.crc)
    except ChunkError as error:
        if not _is_plausible(file, end, size):  # the stated length cannot be trusted then
            end = find_chunk(file, at + 1, size)
            return Lost(at, end, str(error)), end
        known = read_message_index(_index_record(file, end))
        if known is None:
            return Lost(at, end, str(error), span=(head.start_time, head.end_time)), end
        channel, count, first, last = known
        return Lost(at, end, str(error), (channel,), count, (first, last)), end
    # The indexes have no checksum and are not needed: pass over as many bytes as they must have.
    after = end + sum(_INDEX_BYTES + INDEX_ENTRY.itemsize * len(one) for one in messages)
    return Intact(at, messages), after if after <= size and _is_plausible(file, after, size) else end


def _index_record(file: BinaryIO, at: int) -> bytes:
    prefix = _read(file, at, RECORD_PREFIX)
    length = int.from_bytes(prefix[1:], "little")
    return _read(file, at, min(RECORD_PREFIX + length, MAX_RECORD_BYTES))


def _chunk_at(peek: bytes, at: int, size: int) -> ChunkHead | None:
    """Return the head of a chunk that lies wholly inside the file."""
    head = read_chunk_head(peek)
    return head if head is not None and head.length <= min(size - at, MAX_CHUNK_BYTES) else None


def _record_end(file: BinaryIO, at: int, size: int, peek: bytes) -> int | None:
    """Return the end of the record at ``at``.

    None when there is no whole record other than a chunk.
    """
    if len(peek) < RECORD_PREFIX:
        return None
    length = int.from_bytes(peek[1:RECORD_PREFIX], "little")
    end = at + RECORD_PREFIX + length
    if end > size or length > MAX_RECORD_BYTES:
        return None
    if peek[0] == Opcode.MESSAGE_INDEX:
        return end if read_message_index(_read(file, at, RECORD_PREFIX + length)) is not None else None
    return end if parse_record(peek[0], _read(file, at + RECORD_PREFIX, length)) is not None else None


def _is_plausible(file: BinaryIO, at: int, size: int) -> bool:
    """Tell whether a record starts at ``at``, or the file ends there."""
    if at == size:
        return True
    peek = _read(file, at, PEEK_BYTES)
    return _chunk_at(peek, at, size) is not None or _record_end(file, at, size, peek) is not None


def find_chunk(file: BinaryIO, start: int, size: int) -> int:
    """Return the place of the next chunk from ``start`` on, ``size`` when there is none."""
    at = start + SIGNATURE_AT
    while (hit := find_bytes(file, SIGNATURE, at)) is not None:
        peek = _read(file, hit - SIGNATURE_AT, PEEK_BYTES)
        head = _chunk_at(peek, hit - SIGNATURE_AT, size)
        if head is not None and peek[head.data_at : head.data_at + 4] == ZSTD_MAGIC:
            return hit - SIGNATURE_AT
        at = hit + 1
    return size


def find_bytes(file: BinaryIO, needle: bytes, start: int) -> int | None:
    """Return the place of the first ``needle`` from ``start`` on.

    The file is searched in blocks, small ones first.
    """
    at, size = start, PEEK_BYTES
    while True:
        block = _read(file, at, size)
        hit = block.find(needle)
        if hit >= 0:
            return at + hit
        if len(block) < size:
            return None
        at += len(block) - len(needle) + 1
        size = min(8 * size, SEARCH_BYTES)


def find_facts(file: BinaryIO) -> tuple[dict[str, str], bool]:
    """Return the strings of the file's metadata record, or of its copy.

    Also whether they are as they were written.
    """
    fallback: dict[str, str] = {}
    for name in (METADATA_NAME, COPY_NAME):
        needle = struct.pack("<I", len(name)) + name.encode()
        place = find_bytes(file, needle, len(MAGIC) + RECORD_PREFIX)
        if place is None:
            continue
        strings = _facts_at(file, place, len(needle))
        if is_intact(strings):
            return strings, True
        fallback = fallback or strings
    return fallback, False


def _facts_at(file: BinaryIO, place: int, name_bytes: int) -> dict[str, str]:
    """Return the strings of a Metadata record whose name stands at ``place``.

    The length of its map is used, not that of the record.
    """
    (length,) = struct.unpack("<I", _read(file, place + name_bytes, 4).ljust(4, b"\0"))
    if length > MAX_RECORD_BYTES:
        return {}
    record = parse_record(Opcode.METADATA, _read(file, place, name_bytes + 4 + length))
    return record.metadata if isinstance(record, Metadata) else {}


def chunk_bytes(file: BinaryIO, size: int) -> int:
    """Count the bytes of a file that stand in chunks, by their heads alone."""
    total, at = 0, find_chunk(file, 0, size)
    while (head := _chunk_at(_read(file, at, PEEK_BYTES), at, size)) is not None:
        total += head.length
        at = find_chunk(file, at + head.length, size)
    return total


def definitions_in(file: BinaryIO, start: int, end: int) -> Iterator[tuple[Schema | Channel, bytes]]:
    """Yield the schemas and channels that begin in a part of a file, and their bytes.

    They are recognised by their form.
    """
    with suppress(_TooMuchReadError):
        yield from _definitions_in(bounded(file, end - start), start, end)


def _definitions_in(file: BinaryIO, start: int, end: int) -> Iterator[tuple[Schema | Channel, bytes]]:
    overlap = RECORD_PREFIX + 8 + _NAME_BYTES + len(_ENCODING)
    for base in range(start, end, SEARCH_BYTES):
        block = _read(file, base, SEARCH_BYTES + overlap)
        for match in _DEFINITION.finditer(block):
            at = match.start()
            if at >= min(SEARCH_BYTES, end - base):
                break
            name_at = at + RECORD_PREFIX + (2 if block[at] == Opcode.SCHEMA else 4)
            behind = name_at + 4 + int.from_bytes(block[name_at : name_at + 4], "little")
            if block[behind : behind + len(_ENCODING)] != _ENCODING:
                continue
            length = int.from_bytes(block[at + 1 : at + RECORD_PREFIX], "little")
            raw = _read(file, base + at, RECORD_PREFIX + length)
            record = parse_record(raw[0], raw[RECORD_PREFIX:])
            if isinstance(record, Schema | Channel):
                yield record, raw


def is_own_schema(schema: Schema) -> bool:
    """Tell whether a schema is a message type of the store."""
    try:
        return schema.name.startswith(f"{PACKAGE}.") and bool(message_type(schema.data, schema.name))
    except GroundstationError:
        return False


def search_definitions(file: BinaryIO, size: int, checksums: Mapping[str, int]) -> Summary:
    """Search schemas and channels wherever they stand in the file.

    For each id the definition counts that agrees with its checksum. Without checksums it is one that can be used, and
    of those the one that is found most often, or the first.
    """
    times: Counter[tuple[str, int]] = Counter()
    known: dict[tuple[str, int], tuple[Schema | Channel, bytes]] = {}
    for record, raw in definitions_in(file, 0, size):
        key = f"{'schema' if isinstance(record, Schema) else 'channel'} {record.id}", zlib.crc32(raw)
        if not checksums or checksums.get(key[0]) == key[1]:
            times[key] += 1
            known.setdefault(key, (record, raw))
        if len(known) > _MOST_DEFINITIONS:
            break
    rivals = Counter(name for name, _ in known)
    ranked = sorted(known, key=lambda key: (rivals[key[0]] > 1 and not _is_usable(known[key][0]), -times[key]))
    found = Summary()
    for key in ranked:
        if key[0] not in found.definitions:
            found.add(*known[key])
    return found


def _is_usable(record: Schema | Channel) -> bool:
    """Tell whether messages could be read by a definition."""
    if isinstance(record, Channel):
        return DERIVED_KEY in record.metadata or own_columns(record.metadata.get(COLUMNS_KEY, "")) is not None
    return is_own_schema(record)
