"""Second pass over a bag: batches of every topic, raw and canonical, remarks and damage."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.records import (
    MAX_TEXT_CHARACTERS,
    BoolArray,
    Column,
    Damage,
    Int64Array,
    Item,
    LogHeader,
    RecordBatch,
    Remark,
)
from groundstation.base.signals import RAW_PREFIX
from groundstation.readers.bags.bag import Bag
from groundstation.readers.bags.clocks import LARGEST_LAG_S
from groundstation.readers.bags.decode import DecodedMessages, Decoder
from groundstation.readers.bags.kinds import kind_of
from groundstation.readers.bags.messages import Connection, ConnectionBlock, joined
from groundstation.readers.bags.profile import MessageProfile
from groundstation.readers.bags.shapes import MOST_COLUMNS
from groundstation.readers.bags.sources import Key, key_of
from groundstation.readers.bags.survey import BagSurvey, survey
from groundstation.readers.bags.work import StepBudget
from groundstation.readers.parts import TopicPart, bounded, merged, occupied, one_row_each
from groundstation.readers.places import nowhere, placed
from groundstation.readers.source import Source

GATHERED_BYTES = 8 << 20  # size of messages that are decoded together
MESSAGE_BYTES = 64  # memory that a message takes beside its own bytes
LATEST_NS = 1 << 62
MAX_NAME_CHARACTERS = 200
PUBLISHED, PUBLISHER = "publish_time_ns", "publisher"
_ODD = re.compile(r"[^A-Za-z0-9_\-/]")


def items(source: Source, reader_name: str, profile: MessageProfile | None = None) -> Iterator[Item]:
    """Yield the items of a bag; ``profile`` says what its own messages mean."""
    bag = Bag(source)
    found = survey(bag, profile)
    names = _raw_names(found)
    yield LogHeader(
        f"{reader_name} {kind_of(source)}",
        {f"type.{names[number]}": _type_text(seen.connection) for number, seen in sorted(found.seen.items())},
        utc_of_zero_ns=0,
        has_counting_clock=not found.is_set,
        clock_offsets=found.offsets.stated,
    )
    topics = _Topics(found, names, StepBudget.of(bag.size))
    gathered: dict[int, list[ConnectionBlock]] = {}
    size, newest = 0, -1
    for part in bag:
        if isinstance(part, Damage):
            yield part
            continue
        if size > GATHERED_BYTES and part.record_index[0] > newest:  # a topic of several sources stays in order
            yield from topics.batches(gathered)
            gathered, size = {}, 0
        gathered.setdefault(part.connection.number, []).append(part)
        size += int(part.sizes.sum()) + MESSAGE_BYTES * len(part)
        newest = max(newest, int(part.record_index[-1]))
    yield from topics.batches(gathered)
    yield from found.remarks
    yield from topics.remarks()
    yield from topics.damages()


def _type_text(connection: Connection) -> str:
    return f"{connection.type or 'unknown type'} ({connection.encoding or 'unknown encoding'})"


def _raw_names(found: BagSurvey) -> dict[int, str]:
    """Return the raw topic of each connection, the same for all that write one topic.

    A name that clashes gets a number.
    """
    names: dict[int, str] = {}
    given: dict[Key, str] = {}
    for number, seen in sorted(found.seen.items()):
        key = key_of(seen.connection)
        if key not in given:
            plain = _ODD.sub("_", seen.connection.topic.strip("/")[:MAX_NAME_CHARACTERS]) or "_"
            name = base = RAW_PREFIX + plain
            copy = 1
            while name in given.values():
                copy += 1
                name = f"{base}_{copy}"
            given[key] = name
        names[number] = given[key]
    return names


def _publishers(found: BagSurvey, names: dict[int, str]) -> dict[int, str]:
    """Return the publisher of each connection, where several sources write its raw topic."""
    writers = Counter(names[seen.connection.number] for seen in found.sources)
    return {
        number: seen.connection.publisher
        for seen in found.sources
        for number in seen.numbers
        if writers[names[number]] > 1
    }


def _fits_in(time_ns: Int64Array, record_index: Int64Array, is_far: BoolArray) -> BoolArray:
    """Tell which times lie between those of the near records before and behind, shape (n,).

    Near records are those that are not far from the log time.
    """
    order = np.argsort(record_index)
    time_ns, near = time_ns[order], np.flatnonzero(~is_far[order])
    fits = np.zeros(len(order), dtype=bool)
    if len(near):
        at = np.searchsorted(near, np.arange(len(order)))
        before = np.where(at > 0, time_ns[near[np.maximum(at - 1, 0)]], np.iinfo(np.int64).min)
        behind = np.where(at < len(near), time_ns[near[np.minimum(at, len(near) - 1)]], np.iinfo(np.int64).max)
        fits[order] = (before <= time_ns) & (time_ns <= behind)
    return fits


class _Topics:
    """Decoder of blocks into batches of topics."""

    def __init__(self, found: BagSurvey, names: dict[int, str], work: StepBudget) -> None:
        self._work = work
        self._found, self._names, self._publishers = found, names, _publishers(found, names)
        self._decoders: dict[int, Decoder] = {}
        self._kinds: dict[str, dict[str, str]] = {}
        self._far_stamps: dict[str, int] = {}
        self._nowhere: Counter[str] = Counter()

    def batches(self, gathered: dict[int, list[ConnectionBlock]]) -> Iterator[RecordBatch]:
        """Yield the batches of blocks that stand together in the log."""
        canonical: dict[str, list[TopicPart]] = {}
        raw: dict[str, list[TopicPart]] = {}
        for block in joined(gathered):
            number = block.connection.number
            decoder = self._decoder(block.connection)
            for decoded in decoder.decode(block):
                part = self._part(block, decoded)
                raw.setdefault(self._names[number], []).append(part)
                for feed in self._found.feeds.get(number, ()):
                    columns, zeros = placed(feed.topic, feed.of(decoded.columns))
                    self._nowhere[feed.topic] += len(zeros)
                    of_topic = occupied(replace(part, columns=columns))
                    if of_topic is not None:
                        canonical.setdefault(feed.topic, []).append(of_topic)
        for topic, parts in raw.items():
            yield from bounded(merged(topic, parts))
        for topic, parts in sorted(canonical.items()):
            yield from bounded(one_row_each(merged(topic, parts)) if len(parts) > 1 else merged(topic, parts))

    def _part(self, block: ConnectionBlock, decoded: DecodedMessages) -> TopicPart:
        """Return raw columns of decoded messages, with their three times."""
        log_ns, publish_ns = block.log_time_ns[decoded.rows], block.publish_time_ns[decoded.rows]
        is_time = (log_ns >= 0) & (log_ns < LATEST_NS)
        columns = dict(decoded.columns)
        if (publish_ns != log_ns).any():
            columns[PUBLISHED] = Column(publish_ns)
        publisher = self._publishers.get(block.connection.number)
        if publisher is not None:
            columns[PUBLISHER] = Column(np.full(len(log_ns), publisher[:MAX_TEXT_CHARACTERS] or "_"))
        time = Column(log_ns, None if is_time.all() else is_time)
        index = block.record_index[decoded.rows]
        number = block.connection.number
        return TopicPart(index, time, columns, self._validity(number, decoded, index, log_ns), str(number))

    def _decoder(self, connection: Connection) -> Decoder:
        kinds = self._kinds.setdefault(self._names[connection.number], {})
        return self._decoders.setdefault(connection.number, Decoder(connection, kinds=kinds, work=self._work))

    def _validity(
        self, number: int, decoded: DecodedMessages, record_index: Int64Array, log_ns: Int64Array
    ) -> Int64Array | None:
        """Return times of validity: header stamps where they are believed, else log time.

        The stamps are by the recorder's clock. The log time counts where a stamp is far from it. A log time that is out
        of order while the stamps are in order is not believed either.
        """
        lags = self._found.lags.get(number)
        stamp_ns = self._found.seen[number].stamp_of(decoded.columns) if lags is not None else None
        if stamp_ns is None or lags is None:
            return None
        stamp_ns = stamp_ns - lags.offsets.at(record_index)
        is_far = ~lags.believed(log_ns - stamp_ns)
        if not is_far.any():
            return stamp_ns
        is_in_order = _fits_in(stamp_ns, record_index, is_far)
        is_late = is_in_order & lags.may_be_late(log_ns - stamp_ns)
        has_log_time = _fits_in(log_ns, record_index, is_far)
        is_far &= ~is_late & ~(is_in_order & ~has_log_time)
        if is_far.any():
            name = self._names[number]
            self._far_stamps[name] = self._far_stamps.get(name, 0) + int(is_far.sum())
        logged_ns = np.where(has_log_time, log_ns - lags.usual_ns, log_ns)  # of no log time the clock's model has one
        return np.where(is_far, logged_ns, stamp_ns)

    def remarks(self) -> Iterator[Remark]:
        """Yield remarks on what was not kept as columns, and on stamps that were not believed."""
        for number, decoder in sorted(self._decoders.items()):
            if decoder.shortened:
                names = ", ".join(list(decoder.shortened)[:5])
                text = f"arrays too long for columns: of {names} the number of elements is kept"
                yield Remark("shortened", text, self._names[number])
        for topic, count in self._far_stamps.items():
            text = (
                f"{count} header stamps more than {LARGEST_LAG_S:g} s from the log time: log time is used for them, "
                "less what the others are logged after their stamp"
            )
            yield Remark("clock_used", text, topic)

    def damages(self) -> Iterator[Damage]:
        """Yield unreadable messages, of which time and length are kept, and missing positions."""
        for topic, count in sorted(self._nowhere.items()):
            if count:
                yield nowhere(topic, count)
        for number, decoder in sorted(self._decoders.items()):
            if decoder.given_up:
                what = "messages that take more work than a file of this size is given: time and length are kept"
                yield Damage("corrupt", "the whole log", decoder.given_up, what, self._names[number])
            if decoder.left_out:
                what = f"values of fields beyond the first {MOST_COLUMNS} different ones"
                yield Damage("unreadable_cells", "the whole log", decoder.left_out, what, self._names[number])
            if decoder.unreadable > decoder.given_up:
                why = f"of {decoder.reason}" if decoder.reason else "that their definition does not describe"
                what = f"messages {why}: time and length are kept"
                kind = "dropped_channel" if decoder.reason else "corrupt"
                yield Damage(kind, "the whole log", decoder.unreadable - decoder.given_up, what, self._names[number])
