"""Second pass over a ULog: batches of every topic, then remarks and damage.

Each topic comes raw, and canonical where a rule serves it.
"""

import re
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.atmosphere import REFUSED
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import (
    Column,
    Damage,
    Int64Array,
    Item,
    LogHeader,
    NewLog,
    RecordBatch,
    Remark,
)
from groundstation.base.signals import EVENT_SEPARATOR
from groundstation.readers.mapping import mapped
from groundstation.readers.parts import TopicPart, bounded, merged, occupied, sampled_ns
from groundstation.readers.places import nowhere, placed
from groundstation.readers.source import Source
from groundstation.readers.ulog.blocks import NOT_SUBSCRIBED, MessageWalk, Topic, UlogBlock
from groundstation.readers.ulog.canonical import MODE_NAMES, MODES, TopicRows
from groundstation.readers.ulog.formats import TIMESTAMP
from groundstation.readers.ulog.survey import UlogOverview, overview
from groundstation.readers.ulog.texts import MAX_TIME_US, TextTopics, device_time

MAX_NAME_CHARACTERS = 200
_ODD = re.compile(r"[^A-Za-z0-9_\-/]")
_WITH_MODE, _OF_PRESSURE = "true_heading_deg", "pressure_altitude_m"
_ALTITUDES = ("sensor_combined",)  # topics that tell the altitude itself, not the pressure


@dataclass
class _Losses:
    """Data without a usable definition, times that no clock shows, refused values."""

    unreadable: dict[str, int] = field(default_factory=dict)
    beyond: dict[str, int] = field(default_factory=dict)
    refused: dict[tuple[str, str], int] = field(default_factory=dict)
    nowhere: Counter[str] = field(default_factory=Counter)

    def refuse(self, topic: str, what: str, count: int) -> None:
        """Count values that are not canonical; the log's own are kept."""
        if count:
            self.refused[topic, what] = self.refused.get((topic, what), 0) + count

    def damages(self) -> Iterator[Damage]:
        """Yield one damage for each topic."""
        for name, count in self.unreadable.items():
            yield Damage("dropped_channel", "the whole log", count, f"messages of {name} without a usable definition")
        for topic, count in self.beyond.items():
            what = "times more than 292 years after power-up"
            yield Damage("unreadable_cells", "the whole log", count, what, topic)
        for (topic, what), count in self.refused.items():
            yield Damage("unreadable_cells", "the whole log", count, what, topic, loses_data=False)
        yield from (nowhere(topic, count) for topic, count in self.nowhere.items() if count)


def items(source: Source, reader_name: str, start_us: int) -> Iterator[Item]:
    """Yield the items of a log; ``start_us`` is when its header says that logging began."""
    walk = MessageWalk(source)
    kept = deque(walk) if walk.may_be_kept else None
    found = overview(walk if kept is None else kept, walk.definitions)
    yield LogHeader(reader_name, found.metadata, found.utc_of_zero_ns, has_counting_clock=True)
    if kept is None:
        walk = MessageWalk(source)
    losses = _Losses()
    texts = TextTopics(start_us if start_us <= MAX_TIME_US else 0)
    raw, canonical = _RawTopics(losses, found.odd_flags), _CanonicalTopics(losses, found)
    newest_us = 0
    for block in walk if kept is None else _let_go(kept):
        messages_us = np.zeros(len(block.at), dtype=np.uint64)
        for topic, which in block.groups():
            if topic.layout is None:
                losses.unreadable[topic.name] = losses.unreadable.get(topic.name, 0) + len(which)
                continue
            rows = block.rows(topic.layout, which)
            if topic.layout.timestamp_offset is not None:
                messages_us[which] = rows[TIMESTAMP]
            index, time = block.first_index + which, device_time(messages_us[which])
            yield from raw.batches(topic, index, time, rows)
            canonical.take(topic, index, time, rows)
        yield from canonical.batches()
        unsubscribed = int((block.topic == NOT_SUBSCRIBED).sum())
        if unsubscribed:
            name = "topics that were not subscribed"
            losses.unreadable[name] = losses.unreadable.get(name, 0) + unsubscribed
        controls = np.flatnonzero(block.topic < 0)
        newest = _newest_before(np.append(controls, len(messages_us)), messages_us, newest_us)
        yield from texts.batches(block, newest[:-1])
        newest_us = int(newest[-1])
    yield from map(NewLog, walk.log_starts)
    yield from found.remarks
    yield from canonical.remarks()
    yield from walk.damages()
    yield from losses.damages()
    yield from texts.damages()


def _let_go(blocks: deque[UlogBlock]) -> Iterator[UlogBlock]:
    """Yield blocks; each is freed once it is done."""
    while blocks:
        yield blocks.popleft()


def _newest_before(places: Int64Array, messages_us: NDArray[np.uint64], newest_us: int) -> Int64Array:
    """Return the time of the last data message before each place, in microseconds.

    A data message whose time is zero or out of range is passed over.
    """
    has_time = np.flatnonzero((messages_us > 0) & (messages_us <= MAX_TIME_US))
    if not len(has_time):
        return np.full(len(places), newest_us, dtype=np.int64)
    last = np.searchsorted(has_time, places) - 1
    times = messages_us[has_time[np.maximum(last, 0)]].astype(np.int64)
    return np.where(last >= 0, times, newest_us)


class _RawTopics:
    """Batches of the log's own topics: ``raw.<topic>``, ``raw.<topic>.<instance>``.

    Instance 0 has no number in its name.
    """

    def __init__(self, losses: _Losses, odd_flags: set[tuple[int, str]]) -> None:
        self._losses, self._odd_flags = losses, odd_flags
        self._names: dict[int, str] = {}
        self._taken: set[str] = set()

    def batches(self, topic: Topic, index: Int64Array, time: Column, rows: NDArray[Any]) -> Iterator[RecordBatch]:
        """Rows of one topic with all its columns; the time of publication is the device time."""
        layout = topic.layout
        assert layout is not None and rows.dtype.names is not None
        name = self._name(topic)
        if time.present is not None and layout.timestamp_offset is not None:
            beyond = int((rows[TIMESTAMP] > MAX_TIME_US).sum())
            if beyond:
                self._losses.beyond[name] = self._losses.beyond.get(name, 0) + beyond
        flags = {column for column in layout.flags if (topic.number, column) not in self._odd_flags}
        columns = {
            column: Column(rows[column] != 0 if column in flags else rows[column])
            for column in rows.dtype.names
            if column != TIMESTAMP or layout.timestamp_offset is None or len(rows.dtype.names) == 1
        }
        yield from bounded(RecordBatch(name, index, time, columns))

    def _name(self, topic: Topic) -> str:
        if topic.number not in self._names:
            base = f"raw.{_ODD.sub('_', topic.name[:MAX_NAME_CHARACTERS]) or '_'}"
            name = base = f"{base}.{topic.instance}" if topic.instance else base
            copy = 1
            while name in self._taken:
                copy += 1
                name = f"{base}_{copy}"
            self._taken.add(name)
            self._names[topic.number] = name
        return self._names[topic.number]


class _CanonicalTopics:
    """Canonical columns of a block; rows of several sources are put in the order of the log."""

    def __init__(self, losses: _Losses, found: UlogOverview) -> None:
        self._losses, self._found = losses, found
        self._parts: dict[str, list[TopicPart]] = {}
        self._armed: bool | None = None
        self._flight_mode: float | None = None
        self._mode = "gnss_aided" if found.fixed else "attitude"
        self._filled: set[str] = set()

    def take(self, topic: Topic, index: Int64Array, time: Column, rows: NDArray[Any]) -> None:
        """Convert the data that a block has of a PX4 topic."""
        values = TopicRows(rows)
        of_topic: dict[str, dict[str, Column]] = {}
        sampled: dict[str, Int64Array | None] = {}
        for assignment in self._found.assignments.get((topic.name, topic.instance), ()):
            if all(name in values for name in assignment.rule.needs):
                of_topic.setdefault(assignment.topic, {}).update(assignment.rule.columns(values))
                if assignment.rule.sampled in values:
                    told_us = rows[assignment.rule.sampled]
                    told_ns = np.where(told_us <= MAX_TIME_US, told_us, 0).astype(np.int64) * 1_000
                    sampled[assignment.topic] = sampled_ns(time, told_ns)
        for name, columns in of_topic.items():
            if _WITH_MODE in columns:
                columns["mode"] = Column(np.full(len(rows), self._mode), columns[_WITH_MODE].present)
            if _OF_PRESSURE in columns and topic.name not in _ALTITUDES:
                self._note_refused(name, columns[_OF_PRESSURE])
            columns, zeros = placed(name, columns)
            self._losses.nowhere[name] += len(zeros)
            source = f"{topic.name}.{topic.instance}"
            part = occupied(TopicPart(index, time, columns, sampled.get(name), source))
            if part is not None:
                self._parts.setdefault(name, []).append(part)
        if self._found.arming and topic.instance == 0 and topic.name == self._found.arming[0]:
            self._note_arming(index, time, values)
        if topic.instance == 0 and topic.name == MODES[0] and MODES[1] in values:
            self._note_mode(index, time, values[MODES[1]])

    def _note_refused(self, topic: str, altitude: Column) -> None:
        refused = 0 if altitude.present is None else int((~altitude.present).sum())
        self._losses.refuse(topic, REFUSED, refused)

    def _note_mode(self, index: Int64Array, time: Column, modes: NDArray[Any]) -> None:
        """Changes of the flight mode as events, the first mode among them."""
        changed = np.concatenate(([modes[0] != self._flight_mode], modes[1:] != modes[:-1]))
        self._flight_mode = float(modes[-1])
        if changed.any():
            names = np.array([f"mode {MODE_NAMES.get(mode) or format(mode, 'g')}" for mode in modes[changed].tolist()])
            self._parts.setdefault("event", []).append(
                TopicPart(index[changed], time.take(changed), {"name": Column(names)})
            )

    def _note_arming(self, index: Int64Array, time: Column, values: TopicRows) -> None:
        """Changes between armed and disarmed as events, the first state among them."""
        assert self._found.arming is not None
        _source, column, armed_value = self._found.arming
        if column not in values:
            return
        armed = values[column] == armed_value
        before = np.concatenate(([armed[0] if self._armed is None else self._armed], armed[:-1]))
        changed = armed != before
        changed[0] |= self._armed is None
        self._armed = bool(armed[-1])
        if changed.any():
            names = np.where(armed[changed], "armed", "disarmed")
            part = TopicPart(index[changed], time.take(changed), {"name": Column(names)})
            self._parts.setdefault("event", []).append(part)

    def batches(self) -> Iterator[RecordBatch]:
        """Yield batches of what was taken since the last call."""
        parts, self._parts = self._parts, {}
        self._filled |= parts.keys()
        for topic, several in parts.items():
            batch = merged(topic, several)
            yield from bounded(_one_row_each(batch) if topic == "event" else batch)

    def remarks(self) -> Iterator[Remark]:
        """Yield remarks that tell which PX4 topics serve each canonical topic."""
        sources: dict[str, list[str]] = {}
        for (source, instance), assignments in sorted(self._found.assignments.items()):
            for assignment in assignments:
                name = f"{source}.{instance}" if instance else source
                if name not in sources.setdefault(assignment.topic, []):
                    sources[assignment.topic].append(name)
        yield from mapped(sources, self._filled)
        if any(a.topic == "ins" for several in self._found.assignments.values() for a in several):
            text = "ins.mode: the autopilot's own filter; gnss_aided when the log has a satellite fix, else attitude"
            yield Remark("derived", text, "ins", ("mode",))


def _one_row_each(events: RecordBatch) -> RecordBatch:
    """Merge the events of one message into one row, with their names joined.

    One message may both arm and change the mode.
    """
    first = np.flatnonzero(np.diff(events.record_index, prepend=-1) > 0)
    if len(first) == len(events):
        return events
    names = np.split(events.columns["name"].values, first[1:])
    joined = Column(np.array([EVENT_SEPARATOR.join(part.tolist()) for part in names]))
    return RecordBatch(events.topic, events.record_index[first], events.device_time_ns.take(first), {"name": joined})
