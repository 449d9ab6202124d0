"""One pass over a log: its header, clock model and ledger.

Kept are places and times, 16 bytes a record, for each set of topics that are sampled together; when there are more than
24 MiB of them, all go to a temporary file, 12 bytes a record; times of validity take 8 bytes more. Rates and gaps are
those of the times at which values were valid.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.gaps import Gaps, Pause
from groundstation.base.garbage import give_back
from groundstation.base.records import Damage, Int64Array, Item, LogHeader, NewLog, RecordBatch, Remark
from groundstation.integrity.breaks_off import broken_off
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.clock_dates import doubtful_dates
from groundstation.integrity.clock_references import ClockReferences
from groundstation.integrity.contents import Contents
from groundstation.integrity.ledger import LedgerCounts, TopicCounts, topic_ledger
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.integrity.pauses import Outline, outline_of, pauses_of, stops_of
from groundstation.integrity.places import PieceOnDisk, Places
from groundstation.integrity.rhythm import rhythm_of
from groundstation.integrity.source_clock import ClockPass, PowerUpClock, clock_of
from groundstation.integrity.steps_by_source import StepsBySource

MANY_RECORDS = 4_000_000  # from which the times of a topic may take more memory than anything before


@dataclass(frozen=True)
class Survey:
    """Results of one pass over a log.

    Parameters
    ----------
    header : LogHeader
    clock : ClockModel
        Turns device times into corrected times.
    ledger : LedgerCounts
    """

    header: LogHeader
    clock: ClockModel
    ledger: LedgerCounts

    @property
    def power_ups(self) -> tuple[PowerUpClock, ...]:
        """Power-ups of the source, where it holds several."""
        return self.ledger.power_ups

    @property
    def damages(self) -> tuple[Damage, ...]:
        """Records and bytes that could not be read."""
        return self.ledger.damages

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """Remarks of the reader: values that it derived or assumed."""
        return self.ledger.remarks

    @property
    def gaps(self) -> tuple[Gaps, ...]:
        """Gaps of each topic that has any, on the corrected clock."""
        return self.ledger.gaps


class _Order(NamedTuple):
    """Times of validity of a topic in order, and the disorder of its records.

    The disorder is lateness in nanoseconds, and counts of rows.
    """

    valid_ns: Int64Array
    lateness_ns: int
    backward_steps: int
    stray_rows: int


def _order_of(places: Places, pieces: Sequence[PieceOnDisk], clock: ClockModel) -> _Order:
    """The order of the records of some pieces, taken piece by piece."""
    time_ns = np.empty(sum(kept.count for kept in pieces), dtype=np.int64)
    valid_ns = np.empty_like(time_ns) if any(kept.has_validity for kept in pieces) else time_ns
    at = backward = stray = 0
    before_ns: int | None = None
    for kept in pieces:
        piece = places.piece(kept)
        rows = slice(at, at + kept.count)
        clock.time_ns(piece.index, piece.time, out=time_ns[rows])
        if valid_ns is not time_ns:
            own_ns = piece.time.values if piece.validity_ns is None else piece.validity_ns
            valid_ns[rows] = clock.valid_ns(piece.index, piece.time, own_ns, time_ns[rows])
        timed = piece.timed
        backward += int(np.count_nonzero(timed[1:] < timed[:-1]))
        if kept.times:
            backward += before_ns is not None and kept.times[0] < before_ns
            before_ns = kept.times[1]
        stray += int(np.isin(piece.index, clock.stray_index).sum()) if len(clock.stray_index) else 0
        at += kept.count
    lateness = 0
    is_rising = not backward and all(kept.is_timed and clock.is_shift(kept.first, kept.last) for kept in pieces)
    if not is_rising and (time_ns[1:] < time_ns[:-1]).any():
        lateness = int((np.maximum.accumulate(time_ns) - time_ns).max())
    if not (is_rising and valid_ns is time_ns) and (valid_ns[1:] < valid_ns[:-1]).any():
        valid_ns.sort(kind="stable")
    return _Order(valid_ns, lateness, backward, stray)


def survey(items: Iterable[Item], *, thresholds: Thresholds | None = None) -> Survey:
    """Read a log once and report its contents.

    Parameters
    ----------
    items : iterable of Item
        As a reader yields them.
    thresholds : Thresholds, optional
        Limits of the ledger; the shipped ones when left out.

    Returns
    -------
    Survey
        With the clock that :func:`groundstation.integrity.ordering.corrected` needs for the second pass.
    """
    with closing(Places()) as places:
        return _surveyed(items, places, thresholds or shipped())


def _surveyed(items: Iterable[Item], places: Places, limits: Thresholds) -> Survey:
    header = LogHeader("")
    new_logs: list[NewLog] = []
    damages: list[Damage] = []
    remarks: list[Remark] = []
    pieces: dict[str, list[PieceOnDisk]] = {}
    contents, references = Contents(limits), ClockReferences(limits.clock_relation)
    steps = StepsBySource()
    for item in items:
        if isinstance(item, RecordBatch):
            if len(item):
                steps.add(item)
                pieces.setdefault(item.topic, []).append(places.of(item))
                contents.add(item)
                references.add(item)
        elif isinstance(item, Damage):
            damages.append(item)
        elif isinstance(item, Remark):
            remarks.append(item)
        elif isinstance(item, NewLog):
            new_logs.append(item)
        else:
            header = item
    if places.records > MANY_RECORDS:
        give_back()
    clock, parts = clock_of(ClockPass(header, tuple(new_logs), places, pieces, references), limits)
    clock = replace(clock, relations=references.relations(clock))
    found, silences = _NO_TOPICS, _Silences()
    if clock.has_times:
        found, silences = _counted(partial(_times, places, pieces, clock, steps), contents, clock, limits)
    topics = found.topics
    remarks += doubtful_dates(header.reader, clock, topics, remarks)
    clock = replace(clock, lateness_ns=found.lateness_ns)
    dropouts, timeline = (contents.dropouts(clock), contents.timeline(clock)) if clock.has_times else ((), None)
    against = contents.contradictions(clock, header.metadata) if clock.has_times else ()
    told = tuple(damages), tuple(remarks), limits, dropouts, timeline, against, parts
    ledger = LedgerCounts(topics, clock, *told, *silences)
    return Survey(header, clock, replace(ledger, damages=(*damages, *broken_off(ledger))))


class _Silences(NamedTuple):
    """Pauses of a log, and its stops that nothing explains."""

    pauses: tuple[Pause, ...] = ()
    stops: tuple[Pause, ...] = ()


class _Times(NamedTuple):
    """Corrected times of a topic in order, shape (n,), and the order of its records."""

    topic: str
    time_ns: Int64Array
    backward_steps: int = 0
    stray_rows: int = 0
    lateness_ns: int = 0


class _Counted(NamedTuple):
    """Ledgers of topics by name, how late their records are, outlines of their times."""

    topics: tuple[TopicCounts, ...]
    lateness_ns: dict[str, int]
    outlines: tuple[Outline, ...]


_NO_TOPICS = _Counted((), {}, ())


def _times(
    places: Places, pieces: Mapping[str, Sequence[PieceOnDisk]], clock: ClockModel, steps: StepsBySource
) -> Iterator[_Times]:
    """Yield the times of all topics; those that are sampled together share theirs."""
    together: dict[tuple[int, ...], list[str]] = {}
    for topic, several in pieces.items():
        together.setdefault(tuple(kept.number for kept in several), []).append(topic)
    for topics in together.values():
        order = _order_of(places, pieces[topics[0]], clock)
        for topic in topics:
            backward = steps.counts.get(topic, order.backward_steps)
            yield _Times(topic, order.valid_ns, backward, order.stray_rows, order.lateness_ns)
        del order  # before the times of the next topic are laid together: those of one are in memory at a time


def _counted(
    times: Callable[[], Iterable[_Times]], contents: Contents, clock: ClockModel, limits: Thresholds
) -> tuple[_Counted, _Silences]:
    """Return the ledgers of all topics, and the silences of the log.

    Where it has pauses the topics are counted again, by a rhythm that knows them.
    """
    found = _count(times(), contents, clock, limits)
    armings, is_by_setting = contents.armings(clock), contents.is_silent_while_disarmed
    pauses = pauses_of(found.outlines, armings, limits.gaps, is_by_setting=is_by_setting)
    if pauses:
        found = _count(times(), contents, clock, limits, pauses)
    return found, _Silences(pauses, stops_of(found.outlines, limits.gaps))


def _count(
    times: Iterable[_Times],
    contents: Contents,
    clock: ClockModel,
    limits: Thresholds,
    pauses: tuple[Pause, ...] = (),
) -> _Counted:
    """Return the ledgers of all topics, in alphabetical order."""
    ledgers, lateness_ns, outlines = [], {}, []
    for topic, time_ns, backward_steps, stray_rows, late_ns in times:
        rhythm = rhythm_of(topic, time_ns, limits, pauses)
        ledger = topic_ledger(
            topic,
            time_ns,
            backward_steps=backward_steps,
            stray_rows=stray_rows,
            fields=contents.fields(topic, clock),
            sequences=contents.sequences(topic, clock),
            increments_s=contents.increments_s(topic),
            rhythm=rhythm,
        )
        ledgers.append(ledger)
        lateness_ns[topic] = late_ns
        outlines.append(outline_of(topic, time_ns, rhythm, limits.gaps))
        is_long = len(time_ns) > MANY_RECORDS // 4
        del time_ns, rhythm
        if is_long:
            give_back()
    ledgers.sort(key=lambda ledger: ledger.topic)
    return _Counted(tuple(ledgers), lateness_ns, tuple(one for one in outlines if one is not None))


class Census:
    """Count of the records of a store file, whose corrected time is known."""

    def __init__(self, is_absolute: bool, thresholds: Thresholds | None = None, *, is_counting: bool = False) -> None:
        self._clock = ClockModel(is_absolute=is_absolute, is_counting=is_counting)
        self._thresholds = thresholds or shipped()
        self._times: dict[str, list[Int64Array]] = {}
        self._contents = Contents(self._thresholds)
        self.rows = 0

    def add(self, batch: RecordBatch) -> None:
        """Count a batch with ``time_ns``."""
        self.rows += len(batch)
        if not len(batch) or batch.time_ns is None:
            return
        valid_ns = batch.time_ns if batch.validity_time_ns is None else batch.validity_time_ns
        self._times.setdefault(batch.topic, []).append(np.array(valid_ns))
        self._contents.add(batch, batch.time_ns)

    def ledger(self, damages: Sequence[Damage] = ()) -> LedgerCounts:
        """Return the ledger of the file; device order and device clock are not in it."""
        clock, contents, limits = self._clock, self._contents, self._thresholds
        found, silences = _counted(self._sorted, contents, clock, limits)
        dropouts, timeline = contents.dropouts(clock), contents.timeline(clock)
        return LedgerCounts(found.topics, clock, tuple(damages), (), limits, dropouts, timeline, (), (), *silences)

    def _sorted(self) -> Iterator[_Times]:
        for topic, pieces in self._times.items():
            yield _Times(topic, np.sort(np.concatenate(pieces), kind="stable"))
