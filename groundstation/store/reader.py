"""Read a store file: facts, then batches chunk by chunk, then the damage."""

import os
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.records import Channel, Schema

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.records import MAX_BATCH_ROWS, Damage, Item, LogHeader, RecordBatch
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.store.channel import COLUMNS_KEY, DERIVED_KEY
from groundstation.store.framing import Summary, read_summary
from groundstation.store.info import StoreInfo, definition_checksums, from_strings
from groundstation.store.messages import ChunkMessages
from groundstation.store.recognition import is_groundstation_mcap
from groundstation.store.recovery import (
    Intact,
    Lost,
    chunks_by_index,
    chunks_by_walk,
    find_facts,
    index_fits,
    search_definitions,
)
from groundstation.store.schema import WireField, message_type, own_columns
from groundstation.store.wire import DecodedColumns, decode

READER = "groundstation-mcap"
PLACES_BYTES = 64 << 20  # bound of the working arrays for one piece of a chunk


def read_info(path: str | os.PathLike[str]) -> StoreInfo:
    """Read the facts about a store file, blank where they are lost.

    A lost source name is that of the file.

    Raises
    ------
    UnreadableLogError
        When the file cannot be opened or is not of the store.
    """
    with _opened(path) as (file, _):
        info = from_strings(find_facts(file)[0])
    return info if info.source_name else replace(info, source_name=Path(path).name)


@dataclass(frozen=True)
class StorePart:
    """Part of a store file: the records from ``start_ns`` on and before ``end_ns``.

    Only topics for which ``wants`` is true belong to it.
    """

    start_ns: int
    end_ns: int
    wants: Callable[[str], bool] = lambda _topic: True

    def cut(self, batch: RecordBatch) -> RecordBatch:
        """Return the rows of a batch that belong to the part; none of an unwanted topic."""
        assert batch.time_ns is not None
        if not self.wants(batch.topic):
            return batch.take(slice(0, 0))
        first, last = np.searchsorted(batch.time_ns, [self.start_ns, self.end_ns])
        return batch if last - first == len(batch) else batch.take(slice(first, last))


def read(path: str | os.PathLike[str], part: StorePart | None = None) -> Iterator[Item]:
    """Yield the items of a store file: one LogHeader, then batches and damage in file order.

    Batches have ``time_ns`` and, where it differs, ``validity_time_ns``; their columns are those that the topic had, in
    the source's names and types. The header's ``utc_of_zero_ns`` is 0 when times are UTC, None for NOTIME. One chunk is
    held at a time. For a ``part`` only the chunks that the index places in it are read; without an index all are.

    Raises
    ------
    UnreadableLogError
        When the file cannot be opened or is not of the store. All that is wrong inside is a Damage.
    """
    with _opened(path) as (file, size):
        facts, is_intact = find_facts(file)
        info = from_strings(facts)
        yield LogHeader(READER, dict(info.metadata), 0 if info.has_utc else None)
        if not is_intact:
            yield Damage("corrupt", "metadata", 1, "metadata record and its copy: what the file is of is uncertain")
        summary = read_summary(file, size)
        by_index = summary is not None and summary.is_intact and summary.is_in_place and index_fits(file, summary)
        definitions = _definitions(file, size, summary, definition_checksums(facts) if is_intact else {})
        reading = _Reading(definitions, info.has_utc)
        if summary is not None and by_index:
            found = chunks_by_index(file, summary if part is None else _narrowed(summary, part, definitions))
        else:
            found = chunks_by_walk(file, size)
        is_cut = False
        missing = _Missing(info)
        for chunk in found:
            if isinstance(chunk, Lost):
                is_cut |= chunk.is_cut
                items: Iterator[RecordBatch | Damage] = iter([reading.damage(chunk)])
            else:
                items = reading.batches(chunk) if part is None else _cut(reading.batches(chunk), part)
            for item in items:
                missing.take(item)
                yield item
        if part is None and is_intact:
            yield from missing.damages()
        if not by_index and not is_cut:
            what = "summary at the end of the file, or what stands before it; the chunks were found by walking the file"
            yield Damage("corrupt", "summary", 1, what, loses_data=False)


class _Missing:
    """Comparison of the rows that the file's ledger counts with those that are there.

    A chunk may be gone with all that told of it.
    """

    def __init__(self, info: StoreInfo) -> None:
        self._left = Counter({topic: entry.rows for topic, entry in info.ledger.topics.items()})
        self._is_told = False

    def take(self, item: RecordBatch | Damage) -> None:
        """Count rows that are there, and note loss that was reported already."""
        if isinstance(item, RecordBatch):
            self._left[item.topic] -= len(item)
        elif item.loses_data:
            self._is_told = True

    def damages(self) -> Iterator[Damage]:
        """Yield the rows that are missing by the ledger.

        Nothing where a loss was reported that may be the same.
        """
        for topic, count in self._left.items():
            if count > 0 and not self._is_told:
                what = "messages that the ledger in the file counts and that are not in it"
                yield Damage("dropped_rows", "the whole log", count, what, topic)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[BinaryIO, int]]:
    """Open a store file and give its size; errors of reading come in one line."""
    try:
        with Path(path).open("rb") as file:
            if not is_groundstation_mcap(path):
                raise UnreadableLogError(str(path), "a file of another program", "an MCAP that groundstation wrote")
            yield file, os.fstat(file.fileno()).st_size
    except OSError as error:
        raise UnreadableLogError(str(path), f"cannot be read ({error.strerror})") from error


@dataclass(frozen=True)
class _Definition:
    """Decoding of a channel: its topic and the fields that its columns come from.

    With ``fields`` None the channel is not decoded.
    """

    topic: str
    fields: tuple[WireField, ...] | None
    is_derived: bool = False


def _definitions(
    file: BinaryIO, size: int, summary: Summary | None, checksums: dict[str, int]
) -> dict[int, _Definition]:
    """Return definitions by channel id: from an intact summary, else any in the file.

    Where the metadata has their checksums, only definitions that agree with them count.
    """
    if summary is None or not summary.is_intact or not _agrees(summary, checksums):
        summary = search_definitions(file, size, checksums)
    schemas, channels = summary.schemas, summary.channels
    return {number: _definition(channel, schemas.get(channel.schema_id)) for number, channel in channels.items()}


def _agrees(summary: Summary, checksums: dict[str, int]) -> bool:
    return not checksums or all(checksums.get(key) == zlib.crc32(raw) for key, raw in summary.definitions.items())


def _definition(channel: Channel, schema: Schema | None) -> _Definition:
    if DERIVED_KEY in channel.metadata:
        return _Definition(channel.topic, None, is_derived=True)
    if schema is None:
        return _Definition(channel.topic, None)
    columns = channel.metadata.get(COLUMNS_KEY, "")
    try:
        message = message_type(schema.data, schema.name, columns)
    except GroundstationError:
        return _Definition(channel.topic, None)
    names = own_columns(columns)
    own = message.own_fields if names is None else tuple(field for field in message.own_fields if field.name in names)
    return _Definition(channel.topic, (*message.fields[:2], *own))


def _narrowed(summary: Summary, part: StorePart, definitions: dict[int, _Definition]) -> Summary:
    """Return the summary with only the chunks that may hold records of a part."""
    unwanted = {number for number, one in definitions.items() if one.is_derived or not part.wants(one.topic)}
    chunks = [
        index
        for index in summary.chunks
        if index.message_start_time < part.end_ns
        and index.message_end_time >= part.start_ns
        and not (index.message_index_offsets and index.message_index_offsets.keys() <= unwanted)
    ]
    return replace(summary, chunks=chunks)


def _cut(items: Iterator[RecordBatch | Damage], part: StorePart) -> Iterator[RecordBatch | Damage]:
    for item in items:
        kept = part.cut(item) if isinstance(item, RecordBatch) else item
        if not isinstance(kept, RecordBatch) or len(kept):
            yield kept


class _Reading:
    """Conversion of chunks to items, by the definitions of one file."""

    def __init__(self, definitions: dict[int, _Definition], has_utc: bool) -> None:
        self._definitions = definitions
        self._has_utc = has_utc
        self._last_ns: dict[int, int] = {}  # channel -> time of its last message
        self._seen: set[tuple[int, int]] = set()  # channel and sequence number of the first message of each chunk

    def batches(self, chunk: Intact) -> Iterator[RecordBatch | Damage]:
        """Yield the batches of a chunk's messages."""
        for messages in chunk.messages:
            definition = self._definitions.get(messages.channel_id)
            if definition is not None and definition.is_derived:
                continue
            place = f"chunk at byte {chunk.start}"
            if not self._is_next(messages):
                topic, repeated = definition.topic if definition else "", self._is_repeated(messages)
                what = "messages that stand in the file twice" if repeated else "messages that are not in order of time"
                yield Damage("corrupt", place, len(messages), what, topic, loses_data=not repeated)
                continue
            if definition is None or definition.fields is None:
                topic = definition.topic if definition else ""
                yield Damage("dropped_channel", place, len(messages), "messages whose definition is lost", topic)
                continue
            unreadable = 0
            for part in _parts(messages, len(definition.fields)):
                for decoded in decode(part, definition.fields):
                    batch = _batch(part, decoded, definition)
                    unreadable += decoded.taken - len(batch)
                    if len(batch):
                        yield batch
            if unreadable:
                yield Damage("corrupt", place, unreadable, "messages that are not of their schema", definition.topic)

    def _is_next(self, messages: ChunkMessages) -> bool:
        """Tell whether a chunk is in order of time and follows those before.

        A damaged disk may repeat or move a chunk.
        """
        time_ns = messages.log_time
        if (time_ns[1:] < time_ns[:-1]).any() or int(time_ns[0]) < self._last_ns.get(messages.channel_id, 0):
            return False
        if self._is_repeated(messages):
            return False
        self._seen.add((messages.channel_id, messages.first_sequence))
        self._last_ns[messages.channel_id] = int(time_ns[-1])
        return True

    def _is_repeated(self, messages: ChunkMessages) -> bool:
        return (messages.channel_id, messages.first_sequence) in self._seen

    def damage(self, lost: Lost) -> Damage:
        """Return a stretch of lost bytes as damage."""
        known = [self._definitions[number] for number in lost.channels if number in self._definitions]
        topic = ", ".join(definition.topic for definition in known)
        loses = not known or not all(definition.is_derived for definition in known)
        place = f"byte {lost.start} to {lost.end}"
        if lost.is_cut and lost.start == lost.end:
            what = f"bytes of an unfinished record, but {lost.reason}; what followed is not known"
            return Damage("truncated", f"byte {lost.start}", 0, what)
        if lost.is_cut:
            what = f"bytes of an unfinished record: {lost.reason}; what followed is not known"
            return Damage("truncated", f"byte {lost.start}", lost.end - lost.start, what)
        span = "" if lost.span is None else f", {self._time(lost.span[0])} to {self._time(lost.span[1])}"
        if lost.count is None:
            return Damage("corrupt", place, lost.end - lost.start, f"bytes{span}: {lost.reason}", topic, loses)
        return Damage("corrupt", place, lost.count, f"messages{span}: chunk: {lost.reason}", topic, loses)

    def _time(self, time_ns: int) -> str:
        try:
            return utc_ns_to_iso(time_ns) if self._has_utc else f"{time_ns / NS_PER_S:.3f} s"
        except (ValueError, OverflowError, GroundstationError):
            return f"{time_ns} ns"


def _parts(messages: ChunkMessages, field_count: int) -> Iterator[ChunkMessages]:
    """Split messages into parts small enough for a batch and its working arrays."""
    most = max(1, min(MAX_BATCH_ROWS, PLACES_BYTES // (16 * field_count)))
    if len(messages) <= most:
        yield messages
        return
    for start in range(0, len(messages), most):
        yield messages.take(slice(start, start + most))


def _batch(messages: ChunkMessages, decoded: DecodedColumns, definition: _Definition) -> RecordBatch:
    """Return the batch of decoded messages.

    Messages without a record index are not the store's, and are left out.
    """
    assert definition.fields is not None
    if decoded.rows is not None:
        messages = messages.take(decoded.rows)
    time_ns, validity_ns = messages.log_time, messages.head("publish_time")
    device_time, record_index, *columns = decoded.columns
    batch = RecordBatch(
        definition.topic,
        record_index.values.astype(np.int64, copy=False),
        device_time,
        {field.column: column for field, column in zip(definition.fields[2:], columns, strict=True)},
        time_ns,
        None if np.array_equal(time_ns, validity_ns) else validity_ns,
    )
    return batch if record_index.present is None else batch.take(record_index.present)
