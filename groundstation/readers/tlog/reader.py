"""Items of a telemetry log: batches of every message, then remarks and damage.

Each message comes raw, and canonical where a rule serves it.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.log_levels import severity_of_level
from groundstation.base.records import Column, Damage, Int64Array, Item, LogHeader, Remark
from groundstation.base.signals import EVENT_SEPARATOR, RAW_PREFIX
from groundstation.readers.mapping import Assignment, OfferedMessages, assigned, mapped
from groundstation.readers.parts import TopicPart, bounded, merged, occupied, one_row_each
from groundstation.readers.places import placed, unready_filter
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source
from groundstation.readers.tlog.canonical import ARMED, INSTANCES, ROLES
from groundstation.readers.tlog.clock import ClockSurvey, TlogClocks
from groundstation.readers.tlog.clock_remarks import clock_remarks
from groundstation.readers.tlog.dialect import DialectMessage, crc_extras, messages
from groundstation.readers.tlog.frames import FrameBlock
from groundstation.readers.tlog.own_estimate import STATUS, OwnEstimate
from groundstation.readers.tlog.timer import Timer

BLOCK_BYTES = 4 << 20
KEPT_BYTES = 32 << 20  # size of a log whose frames are kept for the second pass
AUTOPILOT = 1  # component


@dataclass
class _Frames:
    """Iterable over the frames of a log in blocks; again from memory if they are few."""

    source: Source
    skipped: SkippedBytes = field(default_factory=lambda: SkippedBytes("frame"))
    unknown: int = 0
    cut: tuple[int, int] | None = None
    _kept: list[FrameBlock] | None = None

    def __iter__(self) -> Iterator[FrameBlock]:
        if self._kept is not None:
            yield from self._kept
            return
        self.skipped, self.unknown, self.cut = SkippedBytes("frame"), 0, None
        kept: list[FrameBlock] | None = []
        size = 0
        for block in self._scanned():
            size += len(block.data)
            if kept is not None:
                kept.append(block)
            if size > KEPT_BYTES:
                kept = None  # it is read again: memory does not grow with the log
            yield block
        self._kept = kept

    def _scanned(self) -> Iterator[FrameBlock]:
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
                        yield FrameBlock(view, found[:frames].copy(), count)
                        count += frames
                    at += done
                    if not done or (not is_last and at + scan.LONGEST > len(data)):
                        break
                data, base = data[at:], base + at
                if is_last:
                    return

    def _note(self, data: NDArray[np.uint8], spans: NDArray[np.int64], base: int, count: int, ends: bool) -> None:
        """Count stretches of no frame; the last one may be a frame that was cut."""
        for number, (start, end, before) in enumerate(spans.tolist()):
            if ends and number == len(spans) - 1 and end == len(data) and _begins_frame(data[start:end]):
                self.cut = base + start, base + end
            else:
                self.skipped.add(base + start, base + end, count + before)

    def damages(self) -> Iterator[Damage]:
        """Yield the bytes that were skipped or cut."""
        yield from self.skipped.damages()
        if self.cut is not None:
            start, end = self.cut
            yield Damage("truncated", bytes_place(start, end), end - start, "bytes of a frame that is cut off")
        if self.unknown:
            what = "frames of messages that the tables do not have"
            yield Damage("dropped_channel", "the whole log", self.unknown, what)


def _begins_frame(data: NDArray[np.uint8]) -> bool:
    """Tell whether bytes are a time and the beginning of a frame, or the beginning of a time."""
    return len(data) < 18 or int(data[8]) in (0xFE, 0xFD)


def items(source: Source, reader_name: str) -> Iterator[Item]:
    """Items of a telemetry log."""
    known, frames = messages(), _Frames(source)
    vehicle, met, clocks = _survey(frames)
    metadata = {"vehicle": f"system {vehicle >> 8}, component {vehicle & 255}"}
    yield LogHeader(
        reader_name, metadata, utc_of_zero_ns=0, has_counting_clock=True, clock_offsets=clocks.offsets.stated
    )
    served = _served(met)
    armed, timer = _Arming(), Timer(clocks)
    nowhere: Counter[str] = Counter()
    filled: set[str] = set()
    own = OwnEstimate()
    for block, following in _with_next(frames):
        canonical: dict[str, list[TopicPart]] = {}
        validity_ns = timer.validity_ns(block, following)
        own.begin(block.first_index)
        parts_of = (
            (system, known[number].name, _part(block, which, known[number], validity_ns))
            for system, number, which in sorted(block.groups, key=lambda group: known[group[1]].name != STATUS)
        )
        for system, name, part in parts_of:
            suffix = "" if system == vehicle else f".{system >> 8}_{system & 255}"
            yield from bounded(merged(f"{RAW_PREFIX}{name}{suffix}", [part]))
            if system == vehicle:
                own.see(name, part)
                _take(canonical, part, served.get(name, ()), nowhere, own)
                armed.take(canonical, part, name)
        filled |= canonical.keys()
        for topic, parts in sorted(canonical.items()):
            batch = merged(topic, parts)
            yield from bounded(one_row_each(batch) if len(parts) > 1 else batch)
    yield from map(own.told, _remarks(served, filled))
    yield from clock_remarks(clocks, vehicle, timer)
    for topic, count in sorted(nowhere.items()):
        if count:
            yield Remark("no_position", f"{topic}: {count} {NO_POSITION}", topic, ("latitude_deg", "longitude_deg"))
    if own.unready:
        yield unready_filter("ins", own.unready, "GLOBAL_POSITION_INT")
    yield from frames.damages()


def _with_next(blocks: Iterable[FrameBlock]) -> Iterator[tuple[FrameBlock, FrameBlock | None]]:
    """Yield each block with the one that follows."""
    before = None
    for block in blocks:
        if before is not None:
            yield before, block
        before = block
    if before is not None:
        yield before, None


def _survey(frames: Iterable[FrameBlock]) -> tuple[int, dict[str, frozenset[str]], TlogClocks]:
    """Find the vehicle, the columns of its messages, and the clocks of all senders.

    The vehicle (system x 256 + component) is the one that tells its attitude most often.
    """
    known = messages()
    counts: dict[tuple[int, int], int] = {}
    clocks = ClockSurvey()
    for block in frames:
        for system, number, which in block.groups:
            counts[system, number] = counts.get((system, number), 0) + len(which)
        clocks.take(block)
    own: dict[int, int] = {}
    for (system, number), count in counts.items():
        own[system] = own.get(system, 0) + count * (1_000 if known[number].name == "ATTITUDE" else 1)
    vehicle = max(own, key=lambda system: (own[system], -system), default=256 + AUTOPILOT)
    met = (known[number] for system, number in counts if system == vehicle)
    columns = {message.name: frozenset(message.dtype.names or ()) for message in met}
    return vehicle, columns, clocks.clocks(vehicle)


def _part(block: FrameBlock, which: Int64Array, message: DialectMessage, validity_ns: Int64Array | None) -> TopicPart:
    """Columns of one message's frames."""
    rows_of = block.rows(which, message)
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
    validity = None if validity_ns is None else validity_ns[which]
    return TopicPart(block.first_index + which, block.received.take(which), columns, validity, message.name)


def _served(met: Mapping[str, frozenset[str]]) -> dict[str, list[Assignment]]:
    """Return, by message name, the canonical topics that messages with these columns feed."""
    names = {INSTANCES.get(name, (name, 0)): name for name in met}
    offers = [OfferedMessages(*source, met[name]) for source, name in names.items()]
    served: dict[str, list[Assignment]] = {}
    for one in assigned(ROLES, offers):
        served.setdefault(names[one.offer.source, one.offer.instance], []).append(one)
    return served


def _take(
    canonical: dict[str, list[TopicPart]],
    part: TopicPart,
    assignments: Sequence[Assignment],
    nowhere: Counter[str],
    own: OwnEstimate,
) -> None:
    """Add the values of a message to canonical topics; ``nowhere`` counts missing positions."""
    if not assignments:
        return
    with np.errstate(invalid="ignore"):  # a signalling NaN would warn
        numbers = {
            name: one.values.astype(np.float64) for name, one in part.columns.items() if one.values.dtype.kind != "U"
        }
    for one in assignments:
        with np.errstate(over="ignore", invalid="ignore"):
            columns, zeros = placed(one.topic, one.rule.columns(numbers))
        nowhere[one.topic] += len(zeros)
        if one.topic == "ins":
            columns = own.ready(columns, part.index)
        kept = occupied(replace(part, columns=columns))
        if kept is not None:
            canonical.setdefault(one.topic, []).append(kept)


@dataclass
class _Arming:
    """Events: texts of the autopilot, and changes between armed and disarmed."""

    is_armed: bool | None = None

    def take(self, canonical: dict[str, list[TopicPart]], part: TopicPart, name: str) -> None:
        """Add the events of a message."""
        if name == "STATUSTEXT":
            texts = part.columns["text"].values
            shown = np.flatnonzero(texts != "")
            names = np.char.replace(texts[shown], EVENT_SEPARATOR.strip(), ";")
            levels = part.columns["severity"].values[shown].tolist()
            grades = [severity_of_level(level, text) for level, text in zip(levels, texts[shown].tolist(), strict=True)]
            self._add(canonical, part, shown, names, np.array(grades, dtype=np.str_))
        elif name == "HEARTBEAT":
            armed = (part.columns["base_mode"].values & ARMED) != 0
            before = np.concatenate(([armed[0] if self.is_armed is None else self.is_armed], armed[:-1]))
            changed = np.flatnonzero((armed != before) | (np.arange(len(armed)) == 0) & (self.is_armed is None))
            self.is_armed = bool(armed[-1])
            names = np.where(armed[changed], "armed", "disarmed")
            self._add(canonical, part, changed, names, np.full(len(changed), "info"))

    def _add(
        self,
        canonical: dict[str, list[TopicPart]],
        part: TopicPart,
        rows: Int64Array,
        names: NDArray[np.str_],
        grades: NDArray[np.str_],
    ) -> None:
        if len(rows):
            validity_ns = None if part.validity_ns is None else part.validity_ns[rows]
            event = TopicPart(
                part.index[rows], part.time.take(rows), {"name": Column(names), "severity": Column(grades)}, validity_ns
            )
            canonical.setdefault("event", []).append(event)


def _remarks(served: Mapping[str, Sequence[Assignment]], filled: Collection[str]) -> Iterator[Remark]:
    """Yield remarks on what serves each topic."""
    sources: dict[str, list[str]] = {}
    for name, several in served.items():
        for one in several:
            sources.setdefault(one.topic, []).append(name)
            if one.topic in filled:
                yield from one.rule.told(one.topic)
    yield from mapped(sources, filled)
