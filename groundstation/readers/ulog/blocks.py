"""Cut a ULog into blocks of messages, each under the definitions in force.

Bytes that belong to no message are counted.
"""

from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.records import Damage, Int64Array
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source
from groundstation.readers.ulog import scan
from groundstation.readers.ulog.formats import Flattener, MessageFormat, TopicLayout, parse_format
from groundstation.readers.ulog.messages import FILE_HEADER_BYTES, FLAGS_BYTES, MAGIC, FlagBits, flag_bits, text_of

BLOCK_BYTES = 8 << 20
KEPT_BYTES = 32 << 20  # size of a log whose blocks may all be kept for the second pass
MAX_TOPICS = 30_000  # numbers of topics have 16 bits
DEFINITIONS_SHOWN = 20  # bad definitions told one by one; the others are told together
SLACK = 7  # bytes behind the data, so that a row may be rounded up to a multiple of eight
IDS = 1 << 16
NOT_SUBSCRIBED = -scan.DATA  # topic number of data messages whose subscription is not there


@dataclass(frozen=True, eq=False)
class Topic:
    """Subscription: a topic's instance and the layout of its messages.

    ``layout`` is None when the log does not define it.
    """

    number: int
    name: str
    instance: int
    layout: TopicLayout | None


@dataclass(frozen=True, eq=False)
class UlogBlock:
    """Messages of one stretch of the file, in file order.

    Use a block before the next one is asked for.

    Parameters
    ----------
    data : ndarray of uint8
        Ends :data:`SLACK` bytes behind the last message.
    at : ndarray of int64, shape (n,)
        Where each message begins in ``data``.
    topic : ndarray of int32, shape (n,)
        Number of the topic of data messages, minus the type of all others.
    first_index : int
        Place of the first message among those of the file.
    topics : list of Topic
        By number; grows from block to block.
    """

    data: NDArray[np.uint8]
    at: Int64Array
    topic: NDArray[np.int32]
    first_index: int
    topics: list[Topic]

    def groups(self) -> Iterator[tuple[Topic, Int64Array]]:
        """Yield each topic that occurs, and the numbers (from 0) of its messages, increasing."""
        order = np.argsort(self.topic.astype(np.int16), kind="stable")  # 16 bits: sorted by radix
        numbers = self.topic[order]
        starts = np.flatnonzero(np.diff(numbers, prepend=-(1 << 20)))
        for start, end in zip(starts, [*starts[1:], len(order)], strict=True):
            if numbers[start] >= 0:
                yield self.topics[int(numbers[start])], order[start:end].astype(np.int64)

    def rows(self, layout: TopicLayout, which: Int64Array) -> NDArray[Any]:
        """Return the data of some messages of one topic as a structured array, shape (n,).

        The array is a copy.
        """
        width = layout.row_bytes
        windows = np.ndarray((len(self.data) - width + 1,), f"V{width}", self.data, strides=(1,))
        return windows[self.at[which] + (scan.HEADER + 2)].view(layout.dtype)

    def controls(self) -> Iterator[tuple[int, str, bytes]]:
        """Yield number, type and body of the messages that are not data."""
        for number in np.flatnonzero(self.topic < 0).tolist():
            yield number, chr(-int(self.topic[number])), self.body(number)

    def body(self, number: int) -> bytes:
        """Bytes of a message behind its header."""
        at = int(self.at[number])
        size = int(self.data[at]) | int(self.data[at + 1]) << 8
        return self.data[at + scan.HEADER : at + scan.HEADER + size].tobytes()


class Definitions:
    """Formats and subscriptions in force, and the damage found in them.

    Attributes
    ----------
    topics : list of Topic
    least, most, number : ndarray of int64, shape (65536,)
        By message id: sizes of its data and number of its topic, as the scan takes them.
    """

    def __init__(self) -> None:
        self.topics: list[Topic] = []
        self.damages: list[Damage] = []
        self.least = np.zeros(IDS, dtype=np.int64)
        self.most = np.full(IDS, scan.NOT_SUBSCRIBED, dtype=np.int64)
        self.number = np.full(IDS, NOT_SUBSCRIBED, dtype=np.int64)
        self._formats: dict[str, MessageFormat] = {}
        self._flattener = Flattener(self._formats)
        self._layouts: dict[str, TopicLayout] = {}
        self._known: dict[tuple[str, int], Topic] = {}

    def heed(self, kind: str, body: bytes, place: int) -> None:
        """Take in a format or a subscription that begins at byte ``place``."""
        try:
            if kind == "F":
                fresh = parse_format(text_of(body))
                if self._formats.get(fresh.name) != fresh:
                    self._formats[fresh.name] = fresh
                    self._layouts.clear()
            elif kind == "A":
                self._subscribe(body, place)
        except GroundstationError as error:
            self.damages.append(Damage("corrupt", f"byte {place}", 1, f"definition that cannot be used ({error})"))

    def _subscribe(self, body: bytes, place: int) -> None:
        instance, message_id, name = body[0], body[1] | body[2] << 8, text_of(body[3:])
        layout = self._layout(name, place)
        topic = self._known.get((name, instance))
        if topic is None or topic.layout != layout:
            if len(self.topics) >= MAX_TOPICS:
                raise GroundstationError("log", f"more than {MAX_TOPICS} topics")
            topic = self._known[name, instance] = Topic(len(self.topics), name, instance, layout)
            self.topics.append(topic)
        self.number[message_id] = topic.number
        self.least[message_id] = layout.least_bytes if layout else 0
        self.most[message_id] = layout.most_bytes if layout else scan.NOT_SUBSCRIBED

    def _layout(self, name: str, place: int) -> TopicLayout | None:
        if name not in self._layouts:
            try:
                self._layouts[name] = self._flattener.layout(name)
            except GroundstationError as error:
                what = f"topic {name[:80]} whose definition cannot be used ({error})"
                self.damages.append(Damage("dropped_channel", f"byte {place}", 1, what))
                return None
        return self._layouts[name]


def flags_of(source: Source) -> FlagBits | None:
    """Return the flags of a log, or None.

    None where the log has no flags, and where no message follows them: bytes of the flags are then missing, or there
    are too many.
    """
    flags = flag_bits(source.head)
    if flags is None or flags.is_plain:
        return flags
    head, none = np.frombuffer(bytearray(source.head), dtype=np.uint8), Definitions()
    return flags if scan.leads_on(head, flags.end, len(head), none.least, none.most) else None


class MessageWalk:
    """One pass over the messages of a log.

    Parameters
    ----------
    source : Source

    Attributes
    ----------
    definitions : Definitions
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.definitions = Definitions()
        self._skipped = SkippedBytes("message")
        self._ends: list[Damage] = []
        self.log_starts: list[int] = []  # places of the first messages of further logs
        self._index = 0
        self._capacity = max(1024, BLOCK_BYTES // 16)

    @property
    def may_be_kept(self) -> bool:
        """Tell whether blocks stay valid while later ones are read.

        If not, each block is valid until the next one is read.
        """
        return self._source.size <= KEPT_BYTES

    def __iter__(self) -> Iterator[UlogBlock]:
        with self._source.open() as stream:
            flags = flags_of(self._source)
            if flags and flags.is_damaged:
                place, count = bytes_place(FILE_HEADER_BYTES, flags.end), flags.end - FILE_HEADER_BYTES
                what = f"bytes of flags that no version has ({flags.incompatible.hex()}), read without them"
                self._ends.append(Damage("corrupt", place, count, what))
            start = min(flags.end if flags else FILE_HEADER_BYTES, self._source.size)
            for end in self._section_ends(start, flags.appended_offsets if flags else ()):
                yield from self._section(stream, start, end)
                start = end

    def _section_ends(self, start: int, appended: tuple[int, ...]) -> list[int]:
        """Return the places where sections of the file end.

        A message that was cut when data was appended does not reach into the next section.
        """
        size = self._source.size
        offsets = sorted(appended)
        beyond = [offset for offset in offsets if offset > size]
        if beyond:
            text = f"data appended at byte {beyond[0]}, behind the end of the file"
            self._ends.append(Damage("truncated", f"byte {size}", 1, text))
        return [*(offset for offset in dict.fromkeys(offsets) if start < offset < size), size]

    def _section(self, stream: BinaryIO, start: int, end: int) -> Iterator[UlogBlock]:
        """Yield blocks of the messages in the bytes from ``start`` to ``end``."""
        state = scan.new_state()
        room = min(BLOCK_BYTES + 2 * scan.LOOKAHEAD, end - start)
        buffer = np.zeros(room + SLACK, dtype=np.uint8)
        base, filled, is_end = start, 0, False
        while not is_end:
            done = int(state[scan.POSITION])
            base, filled, state[scan.POSITION] = base + done, filled - done, 0
            before = buffer
            if self.may_be_kept and base > start:
                buffer = np.zeros(room + SLACK, dtype=np.uint8)  # the one before is that of the blocks before
            buffer[:filled] = before[done : done + filled]
            if state[scan.SKIP_START] != scan.NOWHERE:
                state[scan.SKIP_START] -= done
            fresh = self._read(stream, base + filled, buffer[filled : min(room, end - base)])
            filled += fresh
            is_end = base + filled >= end or not fresh
            yield from self._messages(buffer[: filled + SLACK], is_end, base, state)
        self._close(stream, state, base, base + filled)

    def _messages(self, data: NDArray[np.uint8], is_end: bool, base: int, state: Int64Array) -> Iterator[UlogBlock]:
        """Yield blocks of the messages in ``data``, which begins at byte ``base`` of the file.

        ``data`` includes the slack.
        """
        definitions = self.definitions
        spans = np.zeros((4096, 3), dtype=np.int64)
        reason = scan.FULL
        while reason != scan.MORE_DATA:
            at, topic = np.empty(self._capacity, dtype=np.int64), np.empty(self._capacity, dtype=np.int32)
            state[scan.COUNT], reason = 0, scan.DEFINITION
            while reason == scan.DEFINITION:
                state[scan.SPANS] = 0
                tables = definitions.least, definitions.most, definitions.number
                reason = scan.scan(
                    data[: len(data) - SLACK], 0 if is_end else scan.LOOKAHEAD, *tables, at, topic, spans, state
                )
                for start, end, before in spans[: state[scan.SPANS]].tolist():
                    self._note_skipped(data[start:end], base + start, self._index + before)
                if reason == scan.DEFINITION:
                    last = int(state[scan.COUNT]) - 1
                    place = int(at[last])
                    size = int(data[place]) | int(data[place + 1]) << 8
                    body = data[place + scan.HEADER : place + scan.HEADER + size].tobytes()
                    definitions.heed(chr(-int(topic[last])), body, base + place)
            count = int(state[scan.COUNT])
            if count:
                yield UlogBlock(data, at[:count], topic[:count], self._index, definitions.topics)
                self._index += count

    def _note_skipped(self, data: NDArray[np.uint8], start: int, behind: int) -> None:
        """Count bytes of no message; the header of a further log does not count."""
        bytes_, end = data.tobytes(), start + len(data)
        at = bytes_.find(MAGIC)
        if at < 0:
            self._skipped.add(start, end, behind)
            return
        self.log_starts.append(behind)
        header_end = at + FILE_HEADER_BYTES
        flags = flag_bits(bytes_[at : header_end + FLAGS_BYTES])
        rest = start + at + flags.end if flags else start + header_end
        for first, last in ((start, start + at), (rest, end)):
            if first < last:
                self._skipped.add(first, last, behind)

    def _read(self, stream: BinaryIO, place: int, into: NDArray[np.uint8]) -> int:
        """Fill ``into`` with bytes from ``place`` on and return their number."""
        try:
            stream.seek(place)
            count: int = stream.readinto(into.data)  # type: ignore[attr-defined]
            return count
        except OSError as error:  # a failing disk or network share
            where = f"{self._source.name}, byte {place}"
            raise UnreadableLogError(where, f"no more data ({error.strerror})", "", "copy the file again") from error

    def _close(self, stream: BinaryIO, state: NDArray[np.int64], base: int, end: int) -> None:
        """Count what is left at the end of a section."""
        cut = int(state[scan.CUT_AT])
        stop = end if cut == scan.NOWHERE else base + cut
        if state[scan.SKIP_START] != scan.NOWHERE:
            start = base + int(state[scan.SKIP_START])
            if stop == end and self._is_filler(stream, start, end):
                what = "zero bytes behind the last message"
                self._ends.append(Damage("filler", f"bytes {start} to {end - 1}", end - start, what, loses_data=False))
            else:
                self._skipped.add(start, stop, self._index)
        if stop < end:
            is_last = end >= self._source.size
            what = f"bytes of a message cut by {'the end of the file' if is_last else 'data that was appended'}"
            between = None if is_last else (self._index - 1, self._index)
            self._ends.append(Damage("truncated", f"byte {stop}", end - stop, what, between_records=between))

    def _is_filler(self, stream: BinaryIO, start: int, end: int) -> bool:
        """Tell whether all bytes of a stretch are zero, as in a file made longer than its data."""
        piece = np.empty(min(1 << 20, end - start), dtype=np.uint8)
        counts = ((at, self._read(stream, at, piece[: end - at])) for at in range(start, end, len(piece)))
        return not any(piece[:count].any() for _at, count in counts)

    def damages(self) -> Iterator[Damage]:
        """Yield the damage found, once all blocks have been read."""
        listed = self.definitions.damages
        yield from listed[:DEFINITIONS_SHOWN]
        if len(listed) > DEFINITIONS_SHOWN:
            rest = listed[DEFINITIONS_SHOWN:]
            yield Damage("corrupt", f"from {rest[0].place} on", len(rest), "more definitions that cannot be used")
        yield from self._skipped.damages()
        yield from self._ends
