"""Contents of a log, counted batch by batch: fields, counters, motion, drop-outs, rows."""

import math
from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.base.signals import is_canonical, kind_of
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.contradictions import Contradiction, contradictions
from groundstation.integrity.inertial import InertialTally, is_inertial
from groundstation.integrity.ledger import FieldCounts
from groundstation.integrity.limits import Thresholds
from groundstation.integrity.pauses import Arming, armings_in, says_no_log_while_disarmed
from groundstation.integrity.sequence import Counter, Sequence, counters_of
from groundstation.integrity.spans import RecorderDropout, Timeline
from groundstation.integrity.stretches import Constancy, RecordPlace, Sampler
from groundstation.integrity.stuck import Judge, MotionSampler, StuckPlace, watch

FloatArray = NDArray[np.float64]

PARAMETERS, NAME_OF_ONE, VALUE_OF_ONE = "raw.PARM", "Name", "Value"  # of ArduPilot
DROPOUTS, DROPOUT_LENGTH = "raw.ulog.dropouts", "duration_ms"
MOST_DROPOUTS = MOST_ARMINGS = 10_000


@dataclass
class _FieldTally:
    """Counts of one field, growing batch by batch."""

    low: float
    high: float
    is_known: bool = True  # in an unknown field, infinity may be meant: "no limit"
    constancy: Constancy | None = None
    present: int = 0
    nan: int = 0
    out_of_range: int = 0
    first: RecordPlace | None = None
    last: RecordPlace | None = None

    def add(self, column: Column, rows: Int64Array | None, record_index: Int64Array, device_ns: Int64Array) -> None:
        """Count a batch; ``rows`` are those where the column is present, None for all."""
        self.present += len(column.values) if rows is None else len(rows)
        if column.values.dtype.kind != "f":
            return
        values = column.values if rows is None else column.values.take(rows)  # two thirds of an index's time
        if self._may_be_odd(values):
            values, rows = self._without_odd(values, rows, record_index, device_ns)
        if self.constancy is not None:
            self.constancy.add(values, record_index, device_ns, rows)

    def _may_be_odd(self, values: FloatArray) -> bool:
        """Tell whether there may be a NaN, or a value out of range.

        Two passes over the values tell it, one where nobody knows the range.
        """
        most = np.maximum.reduce(values, initial=-np.inf)
        if not self.is_known:
            return math.isnan(most)
        least = np.minimum.reduce(values, initial=np.inf)
        return not (least >= self.low and most <= self.high and math.isfinite(least) and math.isfinite(most))

    def _without_odd(
        self, values: FloatArray, rows: Int64Array | None, record_index: Int64Array, device_ns: Int64Array
    ) -> tuple[FloatArray, Int64Array | None]:
        """Count NaN and values out of range; return the values that are not NaN, and their rows."""
        if self.is_known:
            at = np.flatnonzero((values < self.low) | (values > self.high) | np.isinf(values))
            if len(at):
                self._add_outside(at if rows is None else rows[at], record_index, device_ns)
        nan = np.isnan(values)
        count = int(np.count_nonzero(nan))
        if not count:
            return values, rows
        self.nan += count
        kept = np.flatnonzero(~nan)
        return values[kept], kept if rows is None else rows[kept]

    def _add_outside(self, at: Int64Array, record_index: Int64Array, device_ns: Int64Array) -> None:
        self.out_of_range += len(at)
        first, last = (RecordPlace(int(record_index[one]), int(device_ns[one])) for one in (at[0], at[-1]))
        self.first, self.last = self.first or first, last

    def ledger(self, name: str, clock: ClockModel, stuck: tuple[StuckPlace, ...]) -> FieldCounts:
        return FieldCounts(
            name,
            self.present,
            self.nan,
            self.out_of_range,
            self.first.record_index if self.first else None,
            self.low,
            self.high,
            self.first.time_ns(clock) if self.first else None,
            self.last.time_ns(clock) if self.last else None,
            stuck,
        )


@dataclass
class _TopicTally:
    fields: dict[str, _FieldTally] = field(default_factory=dict)
    counters: dict[str, Counter] | None = None
    inertial: InertialTally | None = None


class Contents:
    """Counter of the batches of a log; its counts are read once the clock is known."""

    def __init__(self, thresholds: Thresholds) -> None:
        self._thresholds = thresholds
        self._topics: dict[str, _TopicTally] = {}
        self._motion = MotionSampler()
        self._timeline = Sampler()
        self._dropouts: list[tuple[RecordPlace, float]] = []
        self._armings: list[tuple[RecordPlace, bool]] = []
        self._is_silent_while_disarmed: bool | None = None
        self._judge: Judge | None = None

    def add(self, batch: RecordBatch, device_ns: Int64Array | None = None) -> None:
        """Count a batch.

        ``device_ns`` are the times to go by, those of the device unless they are given.
        """
        device_ns = batch.device_time_ns.values if device_ns is None else device_ns
        tally = self._topics.setdefault(batch.topic, _TopicTally())
        rows_of: dict[int, Int64Array | None] = {}  # columns of one source share the array that tells where they are
        for name, column in batch.columns.items():
            mask, rows = column.present, None
            if mask is not None:
                if id(mask) not in rows_of:
                    rows_of[id(mask)] = None if mask.all() else np.flatnonzero(mask)
                rows = rows_of[id(mask)]
            found = tally.fields.get(name) or self._new_field(tally, batch.topic, name)
            found.add(column, rows, batch.record_index, device_ns)
        if tally.counters is None:
            tally.counters = counters_of(batch, self._thresholds.sequence)
        for name, counter in tally.counters.items():
            if name in batch.columns:
                counter.add(batch.columns[name], batch.record_index, device_ns)
        if is_inertial(batch.topic):
            tally.inertial = tally.inertial or InertialTally()
            tally.inertial.add(batch)
        self._motion.add(batch, device_ns)
        self._sample(batch, device_ns)
        if kind_of(batch.topic) == "event" and "name" in batch.columns:
            self._add_armings(batch.columns["name"], batch.record_index, device_ns)
        if batch.topic == PARAMETERS and {NAME_OF_ONE, VALUE_OF_ONE} <= batch.columns.keys():
            told = says_no_log_while_disarmed(batch.columns[NAME_OF_ONE], batch.columns[VALUE_OF_ONE])
            self._is_silent_while_disarmed = self._is_silent_while_disarmed if told is None else told
        if batch.topic == DROPOUTS and DROPOUT_LENGTH in batch.columns:
            self._add_dropouts(batch.columns[DROPOUT_LENGTH], batch.record_index, device_ns)

    def _new_field(self, tally: _TopicTally, topic: str, name: str) -> _FieldTally:
        known = self._thresholds.range_of(topic, name)
        low, high = known or (float("-inf"), float("inf"))
        constancy = watch(topic, name, self._thresholds.stuck)
        found = tally.fields[name] = _FieldTally(low, high, known is not None, constancy)
        return found

    def _sample(self, batch: RecordBatch, device_ns: Int64Array) -> None:
        """Keep some rows of canonical topics, which give the time of a row that was lost."""
        if not is_canonical(batch.topic):
            return
        rows = self._timeline.rows(len(batch))
        self._timeline.put(np.array(batch.record_index[rows]), {"time": np.array(device_ns[rows], dtype=np.int64)})

    def _add_dropouts(self, column: Column, record_index: Int64Array, device_ns: Int64Array) -> None:
        for at in np.flatnonzero(column.mask)[: MOST_DROPOUTS - len(self._dropouts)].tolist():
            length_s = float(column.values[at]) / 1e3
            if length_s > 0.0:
                self._dropouts.append((RecordPlace(int(record_index[at]), int(device_ns[at])), length_s))

    def _add_armings(self, column: Column, record_index: Int64Array, device_ns: Int64Array) -> None:
        for at, is_armed in armings_in(column)[: MOST_ARMINGS - len(self._armings)]:
            self._armings.append((RecordPlace(int(record_index[at]), int(device_ns[at])), is_armed))

    def armings(self, clock: ClockModel) -> tuple[Arming, ...]:
        """Changes between armed and disarmed that the events tell."""
        return tuple(Arming(place.time_ns(clock), is_armed) for place, is_armed in self._armings)

    @property
    def is_silent_while_disarmed(self) -> bool:
        """Truth of a setting in the log that says that nothing is logged while disarmed."""
        return bool(self._is_silent_while_disarmed)

    def fields(self, topic: str, clock: ClockModel) -> tuple[FieldCounts, ...]:
        """Ledgers of a topic's fields."""
        if self._judge is None:
            self._judge = Judge(self._motion, clock, self._thresholds.stuck)
        tallies = self._topics[topic].fields
        watched = {name: tally.constancy for name, tally in tallies.items() if tally.constancy is not None}
        stuck = self._judge.stuck(topic, watched)
        found = tuple(tally.ledger(name, clock, stuck.get(name, ())) for name, tally in tallies.items())
        inertial = self._topics[topic].inertial
        return found if inertial is None else tuple(replace(one, at_end=inertial.at_end(one.name)) for one in found)

    def increments_s(self, topic: str) -> float | None:
        """Return the time that the increments of an inertial unit cover; None without any."""
        inertial = self._topics[topic].inertial
        return inertial.increments_s if inertial is not None and inertial.increments_s else None

    def contradictions(self, clock: ClockModel, metadata: Mapping[str, str]) -> tuple[Contradiction, ...]:
        """Places where the motion of the log contradicts itself."""
        return contradictions(self._motion, clock, self._topics, metadata)

    def sequences(self, topic: str, clock: ClockModel) -> tuple[Sequence, ...]:
        """Return the losses that the counters of a topic show."""
        counters = self._topics[topic].counters or {}
        return tuple(told for told in (counter.sequence(clock) for counter in counters.values()) if told is not None)

    def dropouts(self, clock: ClockModel) -> tuple[RecorderDropout, ...]:
        """Drop-outs that the recorder marked."""
        return tuple(RecorderDropout(place.time_ns(clock), length_s) for place, length_s in self._dropouts)

    def timeline(self, clock: ClockModel) -> Timeline:
        """Times of rows."""
        index, columns = self._timeline.all()
        return Timeline.of(index, columns.get("time", np.zeros(0, dtype=np.int64)), clock)
