"""One pass over a log: its header, clock model and ledger.

Kept are 17 bytes a record for each set of topics that are sampled together, nothing else.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

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
from groundstation.integrity.clock import Clock, ClockSettings, estimate_clock
from groundstation.integrity.counting import estimate_counting_clock, frozen_records
from groundstation.integrity.ledger import FieldLedger, Gaps, Ledger, LedgerSettings, TopicLedger, topic_ledger


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
        mask = column.present
        self.present += len(column) if mask is None else int(mask.sum())
        if column.values.dtype.kind != "f":
            return
        values = column.values
        nan = np.isnan(values)
        outside = (values < self.low) | (values > self.high)
        if self.is_known:
            outside |= np.isinf(values)
        if mask is not None:
            nan, outside = nan & mask, outside & mask
        self.nan += int(nan.sum())
        if outside.any():
            self.out_of_range += int(outside.sum())
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


@dataclass(frozen=True, eq=False)
class _Piece:
    """Places and device times of one batch; topics that are sampled together share it."""

    index: Int64Array
    time: Int64Array
    mask: BoolArray

    def holds(self, batch: RecordBatch) -> bool:
        """Whether it is the places and times of this batch."""
        return (
            np.array_equal(self.index, batch.record_index)
            and np.array_equal(self.time, batch.device_time_ns.values)
            and np.array_equal(self.mask, batch.device_time_ns.mask)
        )


class _Pieces:
    """Makes pieces, the same one for batches with the same places and times, and joins them."""

    def __init__(self) -> None:
        self._recent: deque[_Piece] = deque(maxlen=8)
        self._joined: dict[tuple[int, ...], _Piece] = {}

    def of(self, batch: RecordBatch) -> _Piece:
        """The piece of a batch."""
        for piece in self._recent:
            if piece.holds(batch):
                return piece
        device = batch.device_time_ns
        piece = _Piece(np.array(batch.record_index), np.array(device.values, dtype=np.int64), np.array(device.mask))
        self._recent.append(piece)
        return piece

    def joined(self, pieces: list[_Piece]) -> _Piece:
        """One piece of several; the same one for topics that share them all."""
        key = tuple(id(piece) for piece in pieces)
        if key not in self._joined:
            self._joined[key] = _Piece(
                np.concatenate([piece.index for piece in pieces]),
                np.concatenate([piece.time for piece in pieces]),
                np.concatenate([piece.mask for piece in pieces]),
            )
        return self._joined[key]


@dataclass
class _TopicTally:
    """Times and counts of one topic, growing batch by batch."""

    topic: str
    pieces: list[_Piece] = field(default_factory=list)
    fields: dict[str, _FieldTally] = field(default_factory=dict)

    def add(self, batch: RecordBatch, piece: _Piece) -> None:
        """Count one more batch."""
        self.pieces.append(piece)
        _tally_fields(self.fields, batch)

    def ledger(self, whole: _Piece, clock: Clock, settings: LedgerSettings) -> tuple[TopicLedger, int]:
        """The topic's ledger and the lateness of its records, nanoseconds."""
        time = clock.time_ns(whole.index, Column(whole.time))
        lateness = int((np.maximum.accumulate(time) - time).max())
        timed = whole.time[whole.mask]
        ledger = topic_ledger(
            self.topic,
            np.sort(time, kind="stable") if lateness else time,
            backward_steps=int((np.diff(timed) < 0).sum()),
            stray_rows=int(np.isin(whole.index, clock.stray_index).sum()) if len(clock.stray_index) else 0,
            fields=tuple(tally.ledger(name) for name, tally in self.fields.items()),
            settings=settings,
        )
        return ledger, lateness


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
    pieces = _Pieces()
    for item in items:
        if isinstance(item, RecordBatch):
            if len(item):
                tallies.setdefault(item.topic, _TopicTally(item.topic)).add(item, pieces.of(item))
        elif isinstance(item, Damage):
            damages.append(item)
        elif isinstance(item, Remark):
            remarks.append(item)
        else:
            header = item
    joined = {topic: pieces.joined(tallies[topic].pieces) for topic in sorted(tallies)}
    clock = _clock_of(header, joined.values(), clock_settings)
    settings = ledger_settings or LedgerSettings()
    named = joined.items() if clock.has_times else ()
    results = [tallies[topic].ledger(whole, clock, settings) for topic, whole in named]
    topics = tuple(ledger for ledger, _lateness in results)
    clock = replace(clock, lateness_ns={ledger.topic: lateness for ledger, lateness in results})
    return Survey(header, clock, Ledger(topics, clock, tuple(damages), tuple(remarks), settings))


def _clock_of(header: LogHeader, pieces: Iterable[_Piece], settings: ClockSettings | None) -> Clock:
    """The model of the log's clock, of the kind that its reader names."""
    index, time = _all_records(pieces)
    if not header.has_counting_clock:
        return estimate_clock(index, time, header.utc_of_zero_ns, settings=settings)
    frozen = frozen_records(index, ((piece.index, piece.time, piece.mask) for piece in pieces))
    return estimate_counting_clock(index, time, frozen, header.utc_of_zero_ns)


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


def _all_records(pieces: Iterable[_Piece]) -> tuple[Int64Array, Column]:
    """Places and device times of all records of a log, each place once, in order."""
    distinct = list({id(piece): piece for piece in pieces}.values())
    if not distinct:
        return np.zeros(0, dtype=np.int64), Column(np.zeros(0, dtype=np.int64))
    largest = max(distinct, key=lambda piece: len(piece.index))
    if all(_contains(largest.index, piece.index) for piece in distinct):
        return largest.index, Column(largest.time, largest.mask)
    return _united(distinct)


def _united(pieces: list[_Piece]) -> tuple[Int64Array, Column]:
    """Records of all pieces in order of their places, each place once."""
    start, end = min(int(piece.index[0]) for piece in pieces), max(int(piece.index[-1]) for piece in pieces) + 1
    if end - start <= 4 * sum(len(piece.index) for piece in pieces):  # places without many holes need no sorting
        seen, mask = np.zeros(end - start, dtype=bool), np.zeros(end - start, dtype=bool)
        time = np.zeros(end - start, dtype=np.int64)
        for piece in reversed(pieces):
            at = piece.index - start
            seen[at], time[at], mask[at] = True, piece.time, piece.mask
        places = np.flatnonzero(seen)
        return places + start, Column(time[places], mask[places])
    index, first = np.unique(np.concatenate([piece.index for piece in pieces]), return_index=True)
    time = np.concatenate([piece.time for piece in pieces])[first]
    return index, Column(time, np.concatenate([piece.mask for piece in pieces])[first])


def _contains(whole: Int64Array, part: Int64Array) -> bool:
    """Whether every element of ``part`` occurs in ``whole``, both increasing."""
    at = np.minimum(np.searchsorted(whole, part), len(whole) - 1)
    return bool((whole[at] == part).all())
