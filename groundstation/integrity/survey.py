"""One pass over a log: its header, clock model and ledger.

Kept are 12 bytes a record for each set of topics that are sampled together, beyond 16 MiB in a temporary file.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.records import (
    BoolArray,
    Column,
    Damage,
    Int64Array,
    Item,
    LogHeader,
    RecordBatch,
    Remark,
)
from groundstation.base.signals import field_of
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import Clock, ClockSettings, estimate_clock
from groundstation.integrity.counting import CountingSettings, estimate_counting_clock
from groundstation.integrity.ledger import FieldLedger, Gaps, Ledger, LedgerSettings, TopicLedger, topic_ledger
from groundstation.integrity.ordering import joined_columns
from groundstation.integrity.places import Kept, Places
from groundstation.integrity.thinning import Thinner


@dataclass(frozen=True)
class Survey:
    """What one pass over a log tells.

    Parameters
    ----------
    header : LogHeader
    clock : Clock
        Turns device times into corrected times.
    ledger : Ledger
    """

    header: LogHeader
    clock: Clock
    ledger: Ledger

    @property
    def damages(self) -> tuple[Damage, ...]:
        """What could not be read."""
        return self.ledger.damages

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What the reader derived or assumed."""
        return self.ledger.remarks

    @property
    def gaps(self) -> tuple[Gaps, ...]:
        """Gaps of each topic that has any, on the corrected clock."""
        return self.ledger.gaps


@dataclass
class _FieldTally:
    """Counts of one field, growing batch by batch."""

    low: float
    high: float
    is_known: bool = True  # of a field that nobody knows, infinity may be meant: "no limit"
    present: int = 0
    nan: int = 0
    out_of_range: int = 0
    first_out_of_range: int | None = None

    def add(self, column: Column, record_index: Int64Array) -> None:
        values, mask = column.values, column.present
        self.present += len(column) if mask is None else int(np.count_nonzero(mask))
        if values.dtype.kind != "f":
            return
        nan = np.isnan(values)
        self.nan += int(np.count_nonzero(nan if mask is None else nan & mask))
        if not self.is_known:
            return
        outside = (values < self.low) | (values > self.high) | np.isinf(values)
        if mask is not None:
            outside &= mask
        if outside.any():
            self.out_of_range += int(np.count_nonzero(outside))
            if self.first_out_of_range is None:
                self.first_out_of_range = int(record_index[np.argmax(outside)])

    def ledger(self, name: str) -> FieldLedger:
        return FieldLedger(
            name, self.present, self.nan, self.out_of_range, self.first_out_of_range, self.low, self.high
        )


def _tally_fields(fields: dict[str, _FieldTally], batch: RecordBatch) -> None:
    """Add a batch to the counts of its topic's fields."""
    for name, column in batch.columns.items():
        tally = fields.get(name)
        if tally is None:
            known = field_of(batch.topic, name)
            low, high = (known.low, known.high) if known else (float("-inf"), float("inf"))
            tally = fields[name] = _FieldTally(low, high, known is not None)
        tally.add(column, batch.record_index)


@dataclass
class _TopicTally:
    """Times and counts of one topic, growing batch by batch."""

    topic: str
    pieces: list[Kept] = field(default_factory=list)
    fields: dict[str, _FieldTally] = field(default_factory=dict)

    def add(self, batch: RecordBatch, piece: Kept) -> None:
        """Count one more batch."""
        self.pieces.append(piece)
        _tally_fields(self.fields, batch)

    def ledger(self, order: "_Order", settings: LedgerSettings) -> TopicLedger:
        """The topic's ledger."""
        fields = tuple(tally.ledger(name) for name, tally in self.fields.items())
        return topic_ledger(
            self.topic,
            order.time_ns,
            backward_steps=order.backward_steps,
            stray_rows=order.stray_rows,
            fields=fields,
            settings=settings,
        )


class _Order(NamedTuple):
    """Corrected times of a topic in order, and how far it was from it: lateness in nanoseconds, counts."""

    time_ns: Int64Array
    lateness_ns: int
    backward_steps: int
    stray_rows: int


def _order_of(places: Places, pieces: Sequence[Kept], clock: Clock) -> _Order:
    """The order of the records of some pieces, taken piece by piece."""
    time_ns = np.empty(sum(kept.count for kept in pieces), dtype=np.int64)
    at = backward = stray = 0
    before = np.zeros(0, dtype=np.int64)
    for kept in pieces:
        piece = places.piece(kept)
        time_ns[at : at + kept.count] = clock.time_ns(piece.index, piece.time)
        timed = np.concatenate((before, piece.timed))
        backward += int(np.count_nonzero(timed[1:] < timed[:-1]))
        stray += int(np.isin(piece.index, clock.stray_index).sum()) if len(clock.stray_index) else 0
        at, before = at + kept.count, timed[-1:]
    lateness = 0
    if (time_ns[1:] < time_ns[:-1]).any():
        lateness = int((np.maximum.accumulate(time_ns) - time_ns).max())
        time_ns.sort(kind="stable")
    return _Order(time_ns, lateness, backward, stray)


def survey(
    items: Iterable[Item],
    *,
    clock_settings: ClockSettings | None = None,
    ledger_settings: LedgerSettings | None = None,
) -> Survey:
    """Read a log once and say what is in it.

    Parameters
    ----------
    items : iterable of Item
        As a reader yields them.

    Returns
    -------
    Survey
        With the clock that :func:`groundstation.integrity.ordering.corrected` needs for the second pass.
    """
    header = LogHeader("")
    damages: list[Damage] = []
    remarks: list[Remark] = []
    tallies: dict[str, _TopicTally] = {}
    places = Places()
    for item in items:
        if isinstance(item, RecordBatch):
            if len(item):
                tallies.setdefault(item.topic, _TopicTally(item.topic)).add(item, places.of(item))
        elif isinstance(item, Damage):
            damages.append(item)
        elif isinstance(item, Remark):
            remarks.append(item)
        else:
            header = item
    clock = _clock_of(header, places, [tallies[topic].pieces for topic in sorted(tallies)], clock_settings)
    settings = ledger_settings or LedgerSettings()
    results = _ledgers(places, tallies.values(), clock, settings) if clock.has_times else []
    topics = tuple(ledger for ledger, _lateness in results)
    clock = replace(clock, lateness_ns={ledger.topic: lateness for ledger, lateness in results})
    return Survey(header, clock, Ledger(topics, clock, tuple(damages), tuple(remarks), settings))


def _ledgers(
    places: Places, tallies: Iterable[_TopicTally], clock: Clock, settings: LedgerSettings
) -> list[tuple[TopicLedger, int]]:
    """Ledgers and latenesses of all topics in alphabetical order; topics that are sampled together share theirs."""
    together: dict[tuple[int, ...], list[_TopicTally]] = {}
    for tally in tallies:
        together.setdefault(tuple(kept.number for kept in tally.pieces), []).append(tally)
    results = []
    for several in together.values():
        order = _order_of(places, several[0].pieces, clock)
        results += [(tally.ledger(order, settings), order.lateness_ns) for tally in several]
    return sorted(results, key=lambda result: result[0].topic)


def _clock_of(
    header: LogHeader, places: Places, topics: Sequence[Sequence[Kept]], settings: ClockSettings | None
) -> Clock:
    """The model of the log's clock, of the kind that its reader names."""
    if header.has_counting_clock:
        return _counting_clock(header, places, topics)
    index, time = places.in_one(topics)
    return estimate_clock(index, time, header.utc_of_zero_ns, settings=settings)


def _counting_clock(header: LogHeader, places: Places, topics: Sequence[Sequence[Kept]]) -> Clock:
    """The model of a counting clock; of a long log only the records that have a say are laid together."""
    settings = CountingSettings()
    thinner = Thinner(round(settings.tolerance_s * NS_PER_S), settings.run_records)
    windows: list[tuple[Int64Array, Column, BoolArray]] = []
    for index, time, frozen in places.in_order(topics):
        if not places.is_long:
            return estimate_counting_clock(index, time, frozen, header.utc_of_zero_ns, settings=settings)
        kept = thinner.kept(time.values, time.mask & ~frozen)
        windows.append((index[kept], time.take(kept), frozen[kept]))
    if not windows:
        return Clock()
    clock = estimate_counting_clock(
        np.concatenate([index for index, _time, _frozen in windows]),
        joined_columns([time for _index, time, _frozen in windows]),
        np.concatenate([frozen for _index, _time, frozen in windows]),
        header.utc_of_zero_ns,
        settings=settings,
    )
    return replace(clock, period_ns=thinner.period_ns) if clock.has_times else clock


class Census:
    """Ledger of records whose corrected time is known: what is left in a store file that was damaged."""

    def __init__(self, is_absolute: bool) -> None:
        self._clock = Clock(is_absolute=is_absolute)
        self._times: dict[str, list[Int64Array]] = {}
        self._fields: dict[str, dict[str, _FieldTally]] = {}
        self.rows = 0

    def add(self, batch: RecordBatch) -> None:
        """Count a batch with ``time_ns``."""
        self.rows += len(batch)
        if not len(batch) or batch.time_ns is None:
            return
        self._times.setdefault(batch.topic, []).append(np.array(batch.time_ns))
        _tally_fields(self._fields.setdefault(batch.topic, {}), batch)

    def to_dict(self) -> dict[str, Any]:
        """Topics as in the ledger's plain form, in alphabetical order."""
        found = {}
        for topic, times in sorted(self._times.items()):
            ledger = topic_ledger(
                topic,
                np.sort(np.concatenate(times), kind="stable"),
                backward_steps=0,
                stray_rows=0,
                fields=tuple(tally.ledger(name) for name, tally in self._fields[topic].items()),
                settings=LedgerSettings(),
            )
            found[topic] = ledger.to_dict(self._clock)
        return found
