"""Items of a telemetry log: batches of every message, raw and canonical, then remarks and damages."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Column, Damage, Int64Array, Item, LogHeader, RecordBatch, Remark
from groundstation.base.signals import EVENT_SEPARATOR, RAW_PREFIX
from groundstation.readers.mapping import Assignment, Offer, assigned, mapped
from groundstation.readers.parts import Part, bounded, merged, occupied
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source
from groundstation.readers.tlog.canonical import ARMED, INSTANCES, ROLES
from groundstation.readers.tlog.dialect import MOST_IDS, Message, crc_extras, messages

BLOCK_BYTES = 4 << 20
AUTOPILOT = 1  # component
_NS_PER_US = 1_000


@dataclass(frozen=True, eq=False)
class _Block:
    """Frames of one stretch: columns as in :mod:`scan`, and the bytes they stand in."""

    data: NDArray[np.uint8]
    frames: NDArray[np.int64]
    first_index: int


@dataclass
class _Frames:
    """Iterates over the frames of a log in blocks."""

    source: Source
    skipped: SkippedBytes = field(default_factory=lambda: SkippedBytes("frame"))
    unknown: int = 0
    cut: tuple[int, int] | None = None

    def __iter__(self) -> Iterator[_Block]:
        from groundstation.readers.tlog import scan

        data, base, count = np.zeros(0, dtype=np.uint8), 0, 0
        with self.source.open() as stream:
            while True:
                more = np.frombuffer(stream.read(BLOCK_BYTES), np.uint8)
                is_last = len(more) < BLOCK_BYTES
                data = np.concatenate((data, more))
                found, skipped, told = scan.room(len(data))
                at, begun = 0, base
                while at < len(data):
                    view = data[at:]
                    frames = scan.scan(view, is_last, crc_extras(), found, skipped, told)
                    spans, done, unknown = told.tolist()
                    self.unknown += unknown
                    self._note(view, skipped[:spans], begun + at, count, is_last and at + done == len(data))
                    if frames:
                        yield _Block(view, found[:frames].copy(), count)
                        count += frames
                    at += done
                    if not done or (not is_last and at + scan.LONGEST > len(data)):
                        break
                data, base = data[at:], base + at
                if is_last:
                    return

    def _note(self, data: NDArray[np.uint8], spans: NDArray[np.int64], base: int, count: int, ends: bool) -> None:
        """Count stretches that belong to no frame; the last of the file is a frame that was cut."""
        for number, (start, end, before) in enumerate(spans.tolist()):
            if ends and number == len(spans) - 1 and end == len(data) and _begins_frame(data[start:end]):
                self.cut = base + start, base + end
            else:
                self.skipped.add(base + start, base + end, count + before)

    def damages(self) -> Iterator[Damage]:
        """What was skipped or cut."""
        yield from self.skipped.damages()
        if self.cut is not None:
            start, end = self.cut
            yield Damage("truncated", bytes_place(start, end), end - start, "bytes of a frame that is cut off")
        if self.unknown:
            what = "frames of messages that the tables do not have"
            yield Damage("dropped_channel", "the whole log", self.unknown, what)


def _begins_frame(data: NDArray[np.uint8]) -> bool:
    """Whether bytes are a time and the beginning of a frame, or the beginning of a time."""
    return len(data) < 18 or int(data[8]) in (0xFE, 0xFD)


def items(source: Source, reader_name: str) -> Iterator[Item]:
    """Items of a telemetry log."""
    known = messages()
    vehicle, met = _survey(source)
    metadata = {"vehicle": f"system {vehicle >> 8}, component {vehicle & 255}"}
    yield LogHeader(reader_name, metadata, utc_of_zero_ns=0, has_counting_clock=True)
    served = _served(met)
    frames, armed = _Frames(source), _Arming()
    for block in frames:
        canonical: dict[str, list[Part]] = {}
        for system in np.unique(block.frames[:, 2]).tolist():
            of_system = np.flatnonzero(block.frames[:, 2] == system)
            for number, which in _by_number(block, of_system):
                message = known[number]
                part = _part(block, which, message)
                suffix = "" if system == vehicle else f".{system >> 8}_{system & 255}"
                yield from bounded(
                    RecordBatch(f"{RAW_PREFIX}{message.name}{suffix}", part.index, part.time, part.columns)
                )
                if system == vehicle:
                    _take(canonical, part, served.get(message.name, ()))
                    armed.take(canonical, part, message.name)
        for topic, parts in sorted(canonical.items()):
            batch = merged(topic, parts)
            yield from bounded(batch)
    yield from _remarks(served)
    yield from frames.damages()


def _by_number(block: _Block, rows: Int64Array) -> Iterator[tuple[int, Int64Array]]:
    """Each message that occurs among frames, by its number, and which of the block's frames are of it."""
    order = rows[np.argsort(block.frames[rows, 1], kind="stable")]
    numbers = block.frames[order, 1]
    for which in np.split(order, np.flatnonzero(np.diff(numbers)) + 1):
        yield int(block.frames[which[0], 1]), which


def _survey(source: Source) -> tuple[int, dict[str, frozenset[str]]]:
    """The vehicle (system x 256 + component) that tells its attitude most often, and the columns of its messages."""
    known = messages()
    counts: dict[tuple[int, int], int] = {}
    for block in _Frames(source):
        pairs, times = np.unique(block.frames[:, 2] * MOST_IDS + block.frames[:, 1], return_counts=True)
        for pair, count in zip(pairs.tolist(), times.tolist(), strict=True):
            counts[divmod(pair, MOST_IDS)] = counts.get(divmod(pair, MOST_IDS), 0) + count
    own: dict[int, int] = {}
    for (system, number), count in counts.items():
        own[system] = own.get(system, 0) + count * (1_000 if known[number].name == "ATTITUDE" else 1)
    vehicle = max(own, key=lambda system: (own[system], -system), default=256 + AUTOPILOT)
    met = (known[number] for system, number in counts if system == vehicle)
    return vehicle, {message.name: frozenset(message.dtype.names or ()) for message in met}


def _part(block: _Block, which: Int64Array, message: Message) -> Part:
    """Columns of one message's frames; a payload of version 2 leaves out the zeros at its end."""
    frames = block.frames[which]
    size = message.dtype.itemsize
    payloads = np.zeros((len(which), size), dtype=np.uint8)
    lengths = np.minimum(frames[:, 4], size)
    for length in np.unique(lengths[lengths > 0]).tolist():
        rows = np.flatnonzero(lengths == length)
        at_any_byte = np.ndarray((len(block.data) - length + 1,), f"V{length}", block.data.data, strides=(1,))
        payloads[rows, :length] = at_any_byte[frames[rows, 3]].view(np.uint8).reshape(len(rows), length)
    rows_of = payloads.view(message.dtype)[:, 0]
    columns: dict[str, Column] = {}
    for name in message.dtype.names or ():
        values = rows_of[name]
        if name in message.texts:
            found, place = np.unique(values, return_inverse=True)
            texts = [text.split(b"\0")[0].decode("utf-8", "replace") for text in found.tolist()]
            columns[name] = Column(np.array(texts, dtype=np.str_)[place])
        elif name in message.arrays:
            columns |= {f"{name}[{k}]": Column(values[:, k].copy()) for k in range(message.arrays[name])}
        else:
            columns[name] = Column(values.copy())
    time_us = frames[:, 0]
    is_time = (time_us >= 0) & (time_us < (1 << 62) // _NS_PER_US)
    time = Column(np.where(is_time, time_us, 0) * _NS_PER_US, None if is_time.all() else is_time)
    return Part(block.first_index + which, time, columns)


def _served(met: Mapping[str, frozenset[str]]) -> dict[str, list[Assignment]]:
    """What messages with these columns feed, by their names."""
    names = {INSTANCES.get(name, (name, 0)): name for name in met}
    offers = [Offer(*source, met[name]) for source, name in names.items()]
    served: dict[str, list[Assignment]] = {}
    for one in assigned(ROLES, offers):
        served.setdefault(names[one.offer.source, one.offer.instance], []).append(one)
    return served


def _take(canonical: dict[str, list[Part]], part: Part, assignments: Sequence[Assignment]) -> None:
    """Add what a message gives to canonical topics."""
    if not assignments:
        return
    numbers = {
        name: one.values.astype(np.float64) for name, one in part.columns.items() if one.values.dtype.kind != "U"
    }
    for one in assignments:
        with np.errstate(over="ignore", invalid="ignore"):
            columns = one.rule.columns(numbers)
        kept = occupied(Part(part.index, part.time, columns))
        if kept is not None:
            canonical.setdefault(one.topic, []).append(kept)


@dataclass
class _Arming:
    """Events: texts of the autopilot, and changes between armed and disarmed."""

    is_armed: bool | None = None

    def take(self, canonical: dict[str, list[Part]], part: Part, name: str) -> None:
        """Add the events of a message."""
        if name == "STATUSTEXT":
            texts = part.columns["text"].values
            shown = np.flatnonzero(texts != "")
            names = np.char.replace(texts[shown], EVENT_SEPARATOR.strip(), ";")
            self._add(canonical, part, shown, names)
        elif name == "HEARTBEAT":
            armed = (part.columns["base_mode"].values & ARMED) != 0
            before = np.concatenate(([armed[0] if self.is_armed is None else self.is_armed], armed[:-1]))
            changed = np.flatnonzero((armed != before) | (np.arange(len(armed)) == 0) & (self.is_armed is None))
            self.is_armed = bool(armed[-1])
            self._add(canonical, part, changed, np.where(armed[changed], "armed", "disarmed"))

    def _add(self, canonical: dict[str, list[Part]], part: Part, rows: Int64Array, names: NDArray[np.str_]) -> None:
        if len(rows):
            event = Part(part.index[rows], part.time.take(rows), {"name": Column(names)})
            canonical.setdefault("event", []).append(event)


def _remarks(served: Mapping[str, Sequence[Assignment]]) -> Iterator[Remark]:
    """What serves as what, and by which clock."""
    sources: dict[str, list[str]] = {}
    for name, several in served.items():
        for one in several:
            sources.setdefault(one.topic, []).append(name)
            yield from one.rule.told(one.topic)
    yield from mapped(sources)
    text = "times are those of receipt on the ground, by the ground station's clock; the link's delay is in them"
    yield Remark("clock_used", text)
