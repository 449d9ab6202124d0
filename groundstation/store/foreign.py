"""What an MCAP of another program holds: channels, schemas, counts and times. Its messages are not decoded."""

import os
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Header, Schema

from groundstation.base.errors import UnreadableLogError
from groundstation.base.timescales import duration_text, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.store.framing import (
    MAGIC,
    MAX_RECORD_BYTES,
    ChunkError,
    Summary,
    decompress,
    parse_record,
    parse_records,
    read_chunk_head,
    read_summary,
)
from groundstation.store.messages import HEAD, RECORD_PREFIX

MAX_UTC_NS = 1 << 62  # year 2116: times past it are no times


@dataclass(frozen=True)
class ForeignChannel:
    """One channel: topic, name of its schema, encoding of its messages, how many there are."""

    topic: str
    schema: str
    encoding: str
    messages: int


@dataclass(frozen=True)
class ForeignMcap:
    """What an MCAP of another program holds.

    Parameters
    ----------
    facts : mapping of str to str
        For people: library, profile, messages, start, duration, where known.
    channels : tuple of ForeignChannel
        In order of topic.
    is_damaged : bool
        The file is cut or its summary is not intact.
    start_ns, end_ns : int, optional
        First and last log time.
    """

    facts: Mapping[str, str]
    channels: tuple[ForeignChannel, ...]
    is_damaged: bool
    start_ns: int | None = None
    end_ns: int | None = None


class _Census:
    """Definitions and messages met while walking a file that has no usable summary."""

    def __init__(self) -> None:
        self.found = Summary()
        self.counts: dict[int, int] = {}
        self.start_ns: int | None = None
        self.end_ns: int | None = None
        self.is_damaged = False

    def add(self, opcode: int, raw: bytes) -> None:
        """Count a message, or take in a definition."""
        if opcode == Opcode.MESSAGE and len(raw) >= HEAD.itemsize:
            channel_id = int.from_bytes(raw[9:11], "little")
            time_ns = int.from_bytes(raw[15:23], "little")
            self.counts[channel_id] = self.counts.get(channel_id, 0) + 1
            self.start_ns = time_ns if self.start_ns is None else min(self.start_ns, time_ns)
            self.end_ns = time_ns if self.end_ns is None else max(self.end_ns, time_ns)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            record = parse_record(opcode, raw[RECORD_PREFIX:])
            if record is not None:
                self.found.add(record, b"")


def describe_foreign(path: str | os.PathLike[str]) -> ForeignMcap:
    """Channels, schemas, message counts and time span of any MCAP file.

    From its summary where that is intact, else by walking its records as far as they go.

    Raises
    ------
    UnreadableLogError
        When the file cannot be opened or is not an MCAP at all.
    """
    with _opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        header = _header(file)
        summary = read_summary(file, size)
        statistics = summary.statistics if summary is not None and summary.is_intact else None
        if summary is not None and statistics is not None and (summary.channels or not statistics.channel_count):
            times = (statistics.message_start_time, statistics.message_end_time) if statistics.message_count else None
            counts = statistics.channel_message_counts
            return _described(header, summary, counts, times, is_damaged=False)
        census = _walk(file, size)
        times = None if census.start_ns is None or census.end_ns is None else (census.start_ns, census.end_ns)
        return _described(header, census.found, census.counts, times, is_damaged=census.is_damaged)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    try:
        with closing(Path(path).open("rb")) as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise UnreadableLogError(str(path), "no MCAP magic number", "an MCAP file")
            yield file
    except OSError as error:
        raise UnreadableLogError(str(path), f"cannot be read ({error.strerror})") from error


def _header(file: BinaryIO) -> Header | None:
    file.seek(len(MAGIC))
    start = file.read(RECORD_PREFIX)
    length = min(int.from_bytes(start[1:], "little"), MAX_RECORD_BYTES)
    record = parse_record(Opcode.HEADER, file.read(length)) if start[:1] == bytes([Opcode.HEADER]) else None
    return record if isinstance(record, Header) else None


def _walk(file: BinaryIO, size: int) -> _Census:
    """Count what stands in the file, up to its end or the first record that is not whole."""
    census = _Census()
    at = len(MAGIC)
    while True:
        file.seek(at)
        start = file.read(RECORD_PREFIX)
        end = at + RECORD_PREFIX + int.from_bytes(start[1:], "little")
        if len(start) < RECORD_PREFIX or end > size:
            census.is_damaged = True
            return census
        if start[0] == Opcode.CHUNK:
            _walk_chunk(file, at, end, census)
        elif start[0] in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
            census.add(start[0], start + file.read(min(end - at - RECORD_PREFIX, MAX_RECORD_BYTES)))
        elif start[0] in (Opcode.DATA_END, Opcode.FOOTER):
            return census
        at = end


def _walk_chunk(file: BinaryIO, at: int, end: int, census: _Census) -> None:
    if end - at > MAX_RECORD_BYTES:
        census.is_damaged = True
        return
    file.seek(at)
    data = file.read(end - at)
    head = read_chunk_head(data)
    try:
        if head is None:
            raise ChunkError("is no chunk")
        raw = decompress(head.compression, memoryview(data)[head.data_at :], head.uncompressed_size, head.crc or None)
    except ChunkError:
        census.is_damaged = True
        return
    for opcode, record in parse_records(raw.tobytes()):
        census.add(opcode, record)


def _described(
    header: Header | None,
    found: Summary,
    counts: Mapping[int, int],
    times: tuple[int, int] | None,
    *,
    is_damaged: bool,
) -> ForeignMcap:
    facts = {} if header is None else {"library": header.library, "profile": header.profile}
    facts["messages"] = str(sum(counts.values()))
    if times is not None and 0 <= times[0] <= times[1] < MAX_UTC_NS:
        facts["start"] = utc_ns_to_iso(times[0])
        facts["duration"] = duration_text((times[1] - times[0]) / NS_PER_S)
    channels = (_channel(channel, found.schemas, counts) for channel in found.channels.values())
    return ForeignMcap(
        MappingProxyType({key: value for key, value in facts.items() if value}),
        tuple(sorted(channels, key=lambda channel: (channel.topic, channel.schema))),
        is_damaged,
        *(times or (None, None)),
    )


def _channel(channel: Channel, schemas: Mapping[int, Schema], counts: Mapping[int, int]) -> ForeignChannel:
    schema = schemas.get(channel.schema_id)
    name = schema.name if schema is not None else ""
    return ForeignChannel(channel.topic, name, channel.message_encoding, counts.get(channel.id, 0))
