"""Mapping of bus words to signals by ICDs.

It works on the raw topics, of a recording or of its MCAP alike.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Item, LogHeader, RecordBatch, Remark
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.base.words import counted
from groundstation.readers import imu
from groundstation.readers.chapter10.bus_words import ANY_ERROR, TOPIC_429, TOPIC_1553, bounded, words_of
from groundstation.readers.chapter10.contents import KEYS, BusNames, channel_of, keys_429, keys_1553
from groundstation.readers.chapter10.pieces import SAMPLE_NS, WordSamples, completed, merged
from groundstation.readers.icd import (
    Element,
    Icd,
    Message1553,
    Word429,
    decode_429,
    decode_1553,
    numbered,
    signal_values,
    usable_1553,
)
from groundstation.readers.icd.model import REVERSED_BYTE
from groundstation.readers.places import nowhere, placed

# Codes of the remarks that naming makes.
NO_ICD = "no_icd"
NAMING_CODES = ("icd", "icd_of_another", "mapped", "several_units", "derived", "bus_errors", "not_used", NO_ICD)
_SIX_AXES = (*imu.RATES, *imu.ACCELERATIONS)
TRANSMITS = 0x400
WRONG_WORD = 6  # flags of a 429 word: format or parity error seen by the recorder
TIME_TAG = "time_tag"  # element that counts the samples of a message sent more often than it is computed


class SeenWords:
    """Command words and labels that are on the buses of each channel."""

    def __init__(self) -> None:
        self._keys: dict[str, BoolArray] = {}

    def add(self, batch: RecordBatch) -> None:
        """Take in a batch of bus words; others are passed over."""
        if batch.topic.startswith(TOPIC_429):
            words, sub_channel = batch.columns["word"].values, batch.columns["sub_channel"].values
            self.of(batch.topic)[keys_429(sub_channel.astype(np.uint16), words.astype(np.uint32))] = True
        elif batch.topic.startswith(TOPIC_1553):
            commands = keys_1553(words_of(batch), batch.columns["block_status"].values.astype(np.uint16))
            for keys in commands:
                self.of(batch.topic)[keys] = True

    def of(self, topic: str) -> BoolArray:
        """Return which keys a raw topic has, shape (65536,), to be marked by the caller."""
        return self._keys.setdefault(topic, np.zeros(KEYS, dtype=bool))

    def places(self, holder: Word429 | Message1553, names: BusNames) -> list[tuple[int, int | None]]:
        """Return the channels (for 429 also the buses, from 1) where a word or message is."""
        prefix = TOPIC_429 if isinstance(holder, Word429) else TOPIC_1553
        found: list[tuple[int, int | None]] = []
        for topic, keys in sorted(self._keys.items(), key=lambda one: channel_of(one[0])):
            channel = channel_of(topic)
            if not topic.startswith(prefix):
                continue
            if isinstance(holder, Word429):
                buses = np.flatnonzero(keys[int(REVERSED_BYTE[holder.label]) :: 256]) + 1
                found += [
                    (channel, bus) for bus in buses.tolist() if holder.is_on(names.of(channel, bus), channel, bus)
                ]
            elif holder.is_on(names.of(channel), channel):
                is_there = any(side and keys[side] for side in (holder.transmit, holder.receive))
                found += [(channel, None)] if is_there else []
        return found


@dataclass(frozen=True)
class NamedWords:
    """Words and messages of the ICDs that are on the buses, each with its place."""

    words: tuple[Word429, ...]
    messages: tuple[Message1553, ...]
    remarks: tuple[Remark, ...]


def found_on(seen: SeenWords, icds: Sequence[Icd], names: BusNames) -> NamedWords:
    """Find the words and messages of the ICDs that are on the buses.

    A word that may be on any bus is one of another unit on each.
    """
    words: list[Word429] = []
    messages: list[Message1553] = []
    remarks = []
    for icd in icds:
        count = 0
        holders: tuple[Word429 | Message1553, ...] = (*icd.words_429, *icd.messages_1553)
        for holder in holders:
            places = seen.places(holder, names)
            count += bool(places)
            for channel, bus in places:
                placed = _placed(holder, channel, bus, names)
                (words if isinstance(holder, Word429) else messages).append(placed)
        text = f"ICD {icd.name}: {count} of its {len(icd)} words and messages are on the buses"
        remarks += [Remark("icd" if count else "icd_of_another", text), *(Remark("icd", note) for note in icd.notes)]
    of_words, of_messages = numbered(tuple(words), tuple(messages))
    return NamedWords(of_words, of_messages, tuple(remarks))


def _placed(holder: Any, channel: int, bus: int | None, names: BusNames) -> Any:
    """Return the word or message at one of its places.

    The units of one that may be on any bus are numbered by place.
    """
    elements = holder.elements
    if not holder.bus and holder.channel is None:
        elements = tuple(
            replace(one, is_by_name=True) if one.signal and one.signal.count(".") == 1 else one for one in elements
        )
    where = {"channel": channel, "bus": names.of(channel, bus)} | ({} if bus is None else {"subchannel": bus})
    return replace(holder, elements=elements, **where)


@dataclass
class _Tally:
    """Counts of the used and the unusable rows of a word or message, by reason."""

    used: int = 0
    unusable: int = 0
    errors: int = 0
    short: int = 0
    repeats: int = 0


@dataclass
class _Table:
    """Words or messages of one raw topic by their keys."""

    group: NDArray[np.int16] = field(default_factory=lambda: np.full(KEYS, -1, dtype=np.int16))
    holders: list[list[Any]] = field(default_factory=list)

    def add(self, key: int, holder: Any) -> None:
        if self.group[key] < 0:
            self.group[key] = len(self.holders)
            self.holders.append([])
        self.holders[self.group[key]].append(holder)

    def each(self) -> list[Any]:
        """Return every word or message once."""
        return list({id(holder): holder for several in self.holders for holder in several}.values())

    def rows(self, keys: NDArray[np.uint16]) -> Iterator[tuple[Any, NDArray[np.int64]]]:
        """Yield each word or message that occurs, and its rows; those of one key share them."""
        groups = self.group[keys]
        wanted = np.flatnonzero(groups >= 0)
        groups = groups[wanted]
        for number in np.unique(groups).tolist():
            rows = wanted[groups == number]
            for holder in self.holders[number]:
                yield holder, rows


class Namer:
    """Converter of bus words to signals.

    Parameters
    ----------
    found : NamedWords
    """

    def __init__(self, found: NamedWords) -> None:
        self._found = found
        self._tables: dict[str, _Table] = {}
        self._tallies: dict[str, _Tally] = {}
        self._sources: dict[str, dict[str, None]] = {}
        self._tags: dict[str, int] = {}
        self._derived: dict[str, None] = {}
        self._flagged: dict[str, tuple[int, int]] = {}
        self._nowhere: Counter[str] = Counter()
        self._units: dict[str, str] = {}
        every: list[Element] = [one for word in found.words for one in word.elements if one.signal]
        every += [one for message in found.messages for one in message.elements if one.signal]
        signals = [str(one.signal).rpartition(".") for one in every]
        self._with_velocity = {topic for topic, _dot, name in signals if name == "velocity_north_mps"}
        told = {(topic, name) for topic, _dot, name in signals}
        inertial = {topic for topic, _name in told if kind_of(topic) == "ins"}
        units = {topic: f"imu{topic.removeprefix('ins')}" for topic in inertial}
        fed = {topic for topic, _name in told}
        self._inertial = {
            topic: unit
            for topic, unit in units.items()
            if unit not in fed and all((topic, name) in told for name in _SIX_AXES)
        }
        for word in found.words:
            key = ((word.subchannel or 1) - 1) << 8 | int(REVERSED_BYTE[word.label])
            self._tables.setdefault(f"{TOPIC_429}{word.channel}", _Table()).add(key, word)
        for message in found.messages:
            for side in {message.transmit, message.receive} - {0}:
                self._tables.setdefault(f"{TOPIC_1553}{message.channel}", _Table()).add(side, message)

    def signals(self, batch: RecordBatch) -> Iterator[RecordBatch]:
        """Yield batches of the signals in a batch of bus words."""
        table = self._tables.get(batch.topic)
        if table is None:
            return
        is_429 = batch.topic.startswith(TOPIC_429)
        pieces = self._of_429(batch, table) if is_429 else self._of_1553(batch, table)
        by_topic: dict[str, list[WordSamples]] = {}
        for topic, piece in pieces:
            by_topic.setdefault(topic, []).append(piece)
        for topic, several in by_topic.items():
            ready, derived = completed(kind_of(topic), several, has_velocity=topic in self._with_velocity)
            if derived:
                self._derived[topic] = None
            made = merged(topic, ready, SAMPLE_NS if is_429 else 0) if ready else None
            if made is not None:
                yield from bounded(self._placed(made))
                yield from self._unit(made)

    def _unit(self, batch: RecordBatch) -> Iterator[RecordBatch]:
        """Yield samples of ``imu`` from rows of an INS that have all six axes."""
        unit = self._inertial.get(batch.topic)
        if unit is None or not all(name in batch.columns for name in _SIX_AXES):
            return
        whole = np.logical_and.reduce([batch.columns[name].mask for name in _SIX_AXES])
        if whole.any():
            self._units[unit] = batch.topic
            columns = imu.samples({name: batch.columns[name] for name in _SIX_AXES})
            yield from bounded(RecordBatch(unit, batch.record_index, batch.device_time_ns, columns).take(whole))

    def _placed(self, batch: RecordBatch) -> RecordBatch:
        """Drop positions of zeros, which a unit sends before it has one."""
        columns, zeros = placed(batch.topic, batch.columns)
        if not len(zeros):
            return batch
        self._nowhere[batch.topic] += len(zeros)
        rows = np.logical_or.reduce([column.mask for column in columns.values()] or [np.zeros(len(batch), dtype=bool)])
        return RecordBatch(batch.topic, batch.record_index, batch.device_time_ns, columns).take(rows)

    def _of_429(self, batch: RecordBatch, table: _Table) -> Iterator[tuple[str, WordSamples]]:
        words = batch.columns["word"].values.astype(np.uint32, copy=False)
        keys = keys_429(batch.columns["sub_channel"].values.astype(np.uint16, copy=False), words)
        wrong = (batch.columns["flags"].values & WRONG_WORD) != 0
        for holder, rows in table.rows(keys):
            rows = rows[holder.takes(words[rows])]
            tally = self._tally(holder)
            sound = rows[~wrong[rows]]
            tally.errors += len(rows) - len(sound)
            if not len(sound):
                continue
            decoded = [(one, *decode_429(words[sound], one)) for one in holder.elements if one.signal]
            usable = [np.asarray(good) for _element, _values, good in decoded]
            any_usable = np.logical_or.reduce(usable) if usable else np.zeros(len(sound), dtype=bool)
            tally.used += int(np.count_nonzero(any_usable))
            tally.unusable += int(np.count_nonzero(~any_usable)) if decoded else 0
            for element, values, good in decoded:
                fine = {"fine_of": element.fine_of} if element.fine_of else {}
                yield from self._piece(batch, holder, sound[good], [(element, values[good], None)], **fine)

    def _of_1553(self, batch: RecordBatch, table: _Table) -> Iterator[tuple[str, WordSamples]]:
        words, status = words_of(batch), batch.columns["block_status"].values.astype(np.uint16, copy=False)
        counts = batch.columns["word_count"].values.astype(np.int64)
        first, second = keys_1553(words, status)
        has_error = (status & ANY_ERROR) != 0
        errors, total = self._flagged.get(batch.topic, (0, 0))
        self._flagged[batch.topic] = errors + int(np.count_nonzero(has_error)), total + len(batch)
        # Data follow the commands, and where a terminal sends them its status.
        starts = np.where(second > 0, 3, np.where(first & TRANSMITS, 2, 1))
        wanted = np.flatnonzero((table.group[first] >= 0) | (table.group[second] >= 0))
        for holder in table.each():
            rows = wanted[holder.takes(first[wanted], second[wanted])]
            yield from self._message(batch, holder, rows, words, starts, counts, has_error)

    def _message(
        self, batch: RecordBatch, holder: Message1553, rows: Any, words: Any, starts: Any, counts: Any, has_error: Any
    ) -> Iterator[tuple[str, WordSamples]]:
        tally = self._tally(holder)
        sound = rows[~has_error[rows]]
        tally.errors += len(rows) - len(sound)
        whole = sound[starts[sound] + holder.word_count <= counts[sound]]
        tally.short += len(sound) - len(whole)
        if not len(whole):
            return
        data = words[whole[:, None], starts[whole][:, None] + np.arange(holder.word_count)]
        is_new = self._is_new(holder, data)
        tally.repeats += int(np.count_nonzero(~is_new))
        whole, data = whole[is_new], data[is_new]
        tally.used += len(whole)
        wanted = [one for one in holder.elements if one.signal]
        decoded = [(one, decode_1553(data, one), usable_1553(data, one)) for one in wanted]
        if decoded and len(whole):
            yield from self._piece(batch, holder, whole, decoded)

    def _is_new(self, holder: Message1553, data: NDArray[np.uint16]) -> BoolArray:
        """Tell which messages have another time tag than the one before.

        Messages without a tag are all new.
        """
        tag = next((one for one in holder.elements if one.name == TIME_TAG), None)
        if tag is None:
            return np.ones(len(data), dtype=bool)
        tags = data[:, tag.offset].astype(np.int64)
        key = _key(holder)
        is_new: BoolArray = np.diff(tags, prepend=self._tags.get(key, -1)) != 0
        self._tags[key] = int(tags[-1])
        return is_new

    def _piece(
        self,
        batch: RecordBatch,
        holder: Any,
        rows: Any,
        decoded: Iterable[tuple[Any, Any, BoolArray | None]],
        **more: str,
    ) -> Iterator[tuple[str, WordSamples]]:
        """Decoded elements of the same rows, a piece for each topic that they feed."""
        if not len(rows):
            return
        topics: dict[str, dict[str, tuple[Any, BoolArray]]] = {}
        for element, values, good in decoded:
            topic, _, name = element.signal.rpartition(".")
            known = np.isfinite(converted := signal_values(values, element))
            topics.setdefault(topic, {})[name] = converted, known if good is None else known & good
        for topic, fields in topics.items():
            self._sources.setdefault(topic, {})[_title(holder)] = None
            index, time_ns = batch.record_index[rows], batch.device_time_ns.values[rows]
            yield topic, WordSamples(holder.name, index, time_ns, fields, **more)

    def _tally(self, holder: Any) -> _Tally:
        return self._tallies.setdefault(_title(holder), _Tally())

    def remarks(self) -> Iterator[Item]:
        """Yield remarks on what serves each topic, and what was not used."""
        for topic, sources in sorted(self._sources.items()):
            yield Remark("mapped", f"{topic} from {'; '.join(sources)}", topic)
        for unit, topic in sorted(self._units.items()):
            text = f"{unit} from the body rates and accelerations of {topic}; {imu.POINT_SAMPLES}"
            yield Remark("mapped", text, unit)
        for kind in sorted({kind_of(topic) for topic in self._sources}):
            units = topics_of_kind(kind, tuple(self._sources))
            if len(units) > 1:
                text = f"{len(units)} units of {kind}: an analysis uses the first that has what it needs"
                yield Remark("several_units", text)
        for topic in self._derived:
            text = f"{topic}.velocity_north_mps and velocity_east_mps derived from ground speed and true track"
            yield Remark("derived", text, topic, ("velocity_north_mps", "velocity_east_mps"))
        for topic, (errors, total) in sorted(self._flagged.items()):
            if errors:
                yield Remark(
                    "bus_errors",
                    f"{topic}: {errors} of {counted(total, 'message')} with an error: kept, not used",
                    topic,
                )
        for topic, count in sorted(self._nowhere.items()):
            yield nowhere(topic, count)
        for title, tally in self._tallies.items():
            why = [
                f"{count} {text}"
                for count, text in (
                    (
                        tally.unusable,
                        "say that they hold no computed data, a test or a failure, or have a wrong parity",
                    ),
                    (tally.errors, "have a bus error"),
                    (tally.short, "are shorter than the ICD says"),
                    (tally.repeats, "repeat a sample (time tag)"),
                )
                if count
            ]
            if why:
                yield Remark("not_used", f"{title}: {tally.used} used; {', '.join(why)}")


def _key(holder: Any) -> str:
    return f"{holder.name} {holder.channel}"


def _title(holder: Any) -> str:
    """Return name and place of a word or message, for people."""
    bus = f"{holder.bus} (channel {holder.channel}" if holder.bus else f"channel {holder.channel}"
    place = f"{bus})" if holder.bus else bus
    if isinstance(holder, Word429):
        return f"{holder.name} (label {holder.label:03o}) of {place}"
    command = holder.transmit or holder.receive
    return f"{holder.name} (RT {command >> 11} {'T' if holder.transmit else 'R'} SA {command >> 5 & 31}) of {place}"


def named(items: Iterable[Item], icds: Sequence[Icd], seen: SeenWords) -> Iterator[Item]:
    """Yield the items of a log, and after bus words the signals that ICDs find in them."""
    namer: Namer | None = None
    for item in items:
        yield item
        if isinstance(item, LogHeader):
            found = found_on(seen, icds, BusNames(item.metadata))
            namer = Namer(found)
        elif isinstance(item, RecordBatch) and namer is not None:
            yield from namer.signals(item)
    if namer is not None:
        yield from found.remarks
        yield from namer.remarks()
