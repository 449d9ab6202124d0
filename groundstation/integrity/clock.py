"""Clock model: corrected time of each record, from its device time and place in the log.

Corrected time = device time + an offset that is constant between clock steps. A recorder whose clock is set during the
log (GNSS time arrives) writes a step. Times after the last step are believed, and those before are moved so that the
step becomes one nominal period. A few rows out of order are no step; they are sorted. Rows without a time get one from
their neighbours. Nothing here knows the wall clock: without absolute time, time counts from the log's zero.
``relations`` compare that time with other clocks of the log; they change nothing.
"""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.clock import Clock, Start, StepEntry
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, RecordBatch, frozen
from groundstation.base.timescales import duration_text, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_relation import ClockRelation, mistake_of_step
from groundstation.integrity.clock_steps import ClockSettings, ClockStep, ClockSteps
from groundstation.integrity.power_ups import Wrap

LARGEST_NS = 2**62  # largest time, and largest offset: sums fit 64 bits
FIRST_NS = iso_to_utc_ns("1980-01-08T00:00:00Z")[0]  # a clock before it was not set: 1970, or the zero of GPS


@dataclass(frozen=True)
class ClockModel:
    """Corrected time as a function of device time and place.

    Parameters
    ----------
    is_absolute : bool
        True where corrected time is UTC nanoseconds since 1970; else nanoseconds since the log's zero.
    period_ns : int
        Nominal time between timed records; 0 when there are fewer than two.
    starts, offsets_ns : ndarray of int64, shape (segments,)
        First record of each segment and what is added to its device times.
    placed_index, placed_ns : ndarray of int64, shape (m,)
        Records whose own time is absent or not believed, and the corrected time they are given.
    steps : tuple of ClockStep
    missing_times, implausible_times, stray_rows : int
        Records without a time, with a time that cannot be true, and out of order.
    is_unordered : bool
    shift_ns : int
        Nanoseconds added to all times so that none is negative (logs without UTC).
    has_times : bool
        False when no record has a time: then nothing can be placed.
    stray_index : ndarray of int64
        Records that are out of order with a time that is believed.
    stale_times : int
        Records of a counting clock with the time of an earlier publication (see ``integrity.counting``).
    lateness_ns : mapping of topic to int
        Largest time by which a record comes after a later one of its topic: the hold-back that restores order.
    is_counting : bool
        A counting clock (see ``integrity.counting``): records of several sources may share a time.
    start : {'utc', 'unset', 'own_zero'}
        Where the device's clock began: at a date, at one before its recorder can have been built (1970: it was not
        set), or at its own zero (power-up, or the start of the log).
    first_device_ns : int
        Device time of the first record that has one; UTC of a clock that tells UTC.
    relations : tuple of ClockRelation
        Comparisons of corrected time with other clocks of the log; they never change it.
    longest_step_ns : int
        The longest step ahead between two records.
    wraps : tuple of Wrap
        Where the counter wrapped and went on.
    """

    is_absolute: bool = False
    period_ns: int = 0
    starts: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    offsets_ns: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    placed_index: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    placed_ns: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    steps: tuple[ClockStep, ...] = ()
    missing_times: int = 0
    implausible_times: int = 0
    stray_rows: int = 0
    is_unordered: bool = False
    shift_ns: int = 0
    has_times: bool = False
    stray_index: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    stale_times: int = 0
    lateness_ns: Mapping[str, int] = field(default_factory=dict)
    is_counting: bool = False
    start: Start = "own_zero"
    first_device_ns: int = 0
    relations: tuple[ClockRelation, ...] = ()
    longest_step_ns: int = 0
    wraps: tuple[Wrap, ...] = ()

    def __post_init__(self) -> None:
        for name in ("starts", "offsets_ns", "placed_index", "placed_ns", "stray_index"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def is_shift(self, first: int, last: int) -> bool:
        """Tell whether records between two places are moved by one offset, and none is placed."""
        if len(self.starts) > 1:
            return False
        low, high = self.placed_index.searchsorted((first, last + 1))
        return bool(low == high)

    def time_ns(self, record_index: Int64Array, device_time_ns: Column, out: Int64Array | None = None) -> Int64Array:
        """Corrected time, nanoseconds, shape (n,), of records given by place and device time.

        Records without a time of their own must be among those the survey saw. ``out`` is an array to write it to.
        """
        time = np.add(device_time_ns.values, self._offset_ns(record_index), out=out)
        if not len(self.placed_index) or not len(record_index):
            return np.asarray(time, dtype=np.int64)
        if (record_index[1:] <= record_index[:-1]).any():
            if self.placed_index[-1] < record_index.min() or self.placed_index[0] > record_index.max():
                return np.asarray(time, dtype=np.int64)
            at = np.minimum(np.searchsorted(self.placed_index, record_index), len(self.placed_index) - 1)
            is_placed = self.placed_index[at] == record_index
            time[is_placed] = self.placed_ns[at[is_placed]]
            return np.asarray(time, dtype=np.int64)
        low, high = np.searchsorted(self.placed_index, (record_index[0], record_index[-1] + 1))
        if low == high:
            return np.asarray(time, dtype=np.int64)
        at = np.searchsorted(record_index, self.placed_index[low:high])  # few are placed: they are looked for
        found = record_index[at] == self.placed_index[low:high]
        time[at[found]] = self.placed_ns[low:high][found]
        return np.asarray(time, dtype=np.int64)

    def _offset_ns(self, record_index: Int64Array) -> Any:
        """Return the offset to add to the device times of records."""
        if len(self.starts) == 1:
            return self.offsets_ns[0]
        return ClockOffsets(self.starts, self.offsets_ns).at(record_index)

    def valid_ns(
        self, record_index: Int64Array, device_time_ns: Column, validity_ns: Int64Array, time_ns: Int64Array
    ) -> Int64Array:
        """Correct times of validity, which readers give by the device's clock.

        They are moved as that clock is. Values that were true when their record was written, or in a record without a
        device time, are valid at the record's corrected time ``time_ns``, wherever it was placed.
        """
        has_own = validity_ns != device_time_ns.values
        if device_time_ns.present is not None:
            has_own &= device_time_ns.present
        return np.where(has_own, validity_ns + self._offset_ns(record_index), time_ns)

    def correct(self, batch: RecordBatch) -> RecordBatch:
        """Return the batch with ``time_ns`` set, its rows in the order of the source."""
        index, device_ns, validity_ns = batch.record_index, batch.device_time_ns, batch.validity_time_ns
        time_ns = self.time_ns(index, device_ns)
        if validity_ns is not None:
            validity_ns = self.valid_ns(index, device_ns, validity_ns, time_ns)
        return RecordBatch(batch.topic, index, device_ns, batch.columns, time_ns, validity_ns)

    def on(self, offsets: "ClockOffsets", first_device_ns: int) -> "ClockModel":
        """Return the model of the device's own times, for a model of times moved by ``offsets``."""
        starts = np.union1d(self.starts, offsets.starts)
        return replace(
            self,
            starts=starts,
            offsets_ns=self._offset_ns(starts) + offsets.at(starts),
            first_device_ns=first_device_ns,
        )

    def text(self, time_ns: int) -> str:
        """Write a time for people: ISO UTC, or ``+mm:ss`` from the log's zero."""
        if self.is_absolute:
            return utc_ns_to_iso(time_ns)
        seconds = time_ns / NS_PER_S
        return f"{'-' if seconds < 0 else '+'}{duration_text(abs(seconds))}"

    def document(self) -> Clock:
        """Return the form to keep: seconds to the millisecond."""
        own_zero = f"{self.first_device_ns / NS_PER_S:.3f} s"
        return Clock(
            is_absolute=self.is_absolute,
            nominal_period_s=round(self.period_ns / NS_PER_S, 6),
            start=self.start,
            first_device_time=own_zero if self.start == "own_zero" else utc_ns_to_iso(self.first_device_ns),
            steps=tuple(
                StepEntry(
                    record_index=step.record_index,
                    kind=step.kind,
                    size_s=round(step.size_s, 3),
                    records_before=step.records_before,
                    shift_of_earlier_s=round(step.shift_s, 3),
                    set_s=round(step.set_s, 3),
                    mistake=self.mistake(step),
                )
                for step in self.steps
            ),
            missing_times=self.missing_times,
            implausible_times=self.implausible_times,
            stale_times=self.stale_times,
            stray_rows=self.stray_rows,
            is_unordered=self.is_unordered,
            is_counting=self.is_counting,
            shift_s=round(self.shift_ns / NS_PER_S, 3),
            relations=tuple(relation.entry(self.text, has_utc=self.is_absolute) for relation in self.relations),
        )

    def mistake(self, step: ClockStep) -> str:
        """Name the error that a step put right; empty where it has no name."""
        return mistake_of_step(step.set_s, step.device_after_ns + int(self.offsets_ns[-1])) if self.is_absolute else ""


@dataclass(frozen=True)
class ClockOffsets:
    """Offsets to add to device times from certain records on, by another clock of the log."""

    starts: Int64Array
    offsets_ns: Int64Array

    @classmethod
    def of(cls, offsets: tuple[tuple[int, int], ...]) -> "ClockOffsets | None":
        """Make offsets from those that a reader states; None where it states none."""
        if not offsets:
            return None
        starts, added = np.array(sorted(offsets), dtype=np.int64).T
        return cls(starts, added)

    def at(self, record_index: Int64Array) -> Int64Array:
        """Return the offset to add to the device time of each record."""
        return np.asarray(self.offsets_ns[np.maximum(np.searchsorted(self.starts, record_index, side="right") - 1, 0)])

    def moved(self, record_index: Int64Array, device_time_ns: Column) -> Column:
        """Return the device times of records with the offsets added."""
        return Column(device_time_ns.values + self.at(record_index), device_time_ns.present)


def estimate_clock(
    record_index: Int64Array,
    device_time_ns: Column,
    utc_of_zero_ns: int | None,
    *,
    settings: ClockSettings | None = None,
) -> ClockModel:
    """Model the clock of a log.

    Parameters
    ----------
    record_index : ndarray of int64, shape (n,)
        Places of the records, strictly increasing.
    device_time_ns : Column of int64, shape (n,)
    utc_of_zero_ns : int or None
        UTC of device time zero.

    Returns
    -------
    ClockModel
        Without ``lateness_ns``, which needs the topics.

    Examples
    --------
    >>> seconds = np.array([7, 8, 9, 7, 8, 9, 10])  # set back by two seconds and a period
    >>> clock = estimate_clock(np.arange(7), Column(seconds * NS_PER_S), None)
    >>> clock.time_ns(np.arange(7), Column(seconds * NS_PER_S)) // NS_PER_S
    array([ 4,  5,  6,  7,  8,  9, 10])
    """
    timed = device_time_ns.mask
    index, time = record_index, device_time_ns.values
    if not timed.all():
        index, time = index[timed], time[timed]
    if not len(time):
        return ClockModel(missing_times=len(record_index))
    found = ClockSteps(index, time, settings or ClockSettings())
    if any(abs(offset) > LARGEST_NS for offset in found.offsets_ns()):
        found.sort()
    offsets = np.array(found.offsets_ns(), dtype=np.int64)
    starts = np.array([record_index[0], *(index[at] for at, _last in found.steps)], dtype=np.int64)
    own = time + offsets[np.searchsorted(starts, index, side="right") - 1]
    believed = ~found.implausible
    nodes = believed & ~found.stray
    placed_index = np.concatenate((record_index[~timed], index[found.implausible]))
    placed_index.sort()
    placed = interpolated(placed_index, index[nodes], own[nodes], found.period_per_record_ns)
    times = [part for part in (own if believed.all() else own[believed], placed) if len(part)]
    zero = zero_of(min(int(part.min()) for part in times), max(int(part.max()) for part in times), utc_of_zero_ns)
    return ClockModel(
        is_absolute=zero.is_absolute,
        period_ns=found.period_ns,
        starts=starts,
        offsets_ns=offsets + zero.ns,
        placed_index=placed_index,
        placed_ns=placed + zero.ns,
        steps=found.described(offsets),
        missing_times=int((~timed).sum()),
        implausible_times=int(found.implausible.sum()),
        stray_rows=int((found.stray & believed).sum()),
        is_unordered=found.is_unordered,
        shift_ns=0 if zero.is_absolute else zero.ns,
        has_times=True,
        stray_index=index[found.stray & believed],
        start=start_of(int(time[0]), utc_of_zero_ns),
        first_device_ns=int(time[0]) + (utc_of_zero_ns or 0),
        longest_step_ns=found.longest_step_ns,
    )


_END_NS = iso_to_utc_ns("2262-01-01T00:00:00Z")[0]


class Zero(NamedTuple):
    """Offset to add to all times, and whether they are UTC with it."""

    is_absolute: bool
    ns: int


def zero_of(earliest_ns: int, latest_ns: int, utc_of_zero_ns: int | None) -> Zero:
    """Return the offset to add to all times: UTC of zero, or as much as leaves none negative.

    Nothing is recorded before 1970, nor after 2261, the last whole year that 64 bits hold; a clock that stays before
    1980 was never set.
    """
    if utc_of_zero_ns is not None and 0 <= earliest_ns + utc_of_zero_ns <= latest_ns + utc_of_zero_ns < _END_NS:
        is_set = latest_ns + utc_of_zero_ns >= FIRST_NS
        return Zero(is_set, utc_of_zero_ns if is_set else max(0, -earliest_ns))
    return Zero(False, max(0, -earliest_ns))


def start_of(first_device_ns: int, utc_of_zero_ns: int | None) -> Start:
    """Tell how the clock of a device began.

    Examples
    --------
    >>> start_of(5, None), start_of(5, 0), start_of(5, 1_777_874_400_000_000_000)
    ('own_zero', 'unset', 'utc')
    """
    if utc_of_zero_ns is None:
        return "own_zero"
    return "utc" if first_device_ns + utc_of_zero_ns >= FIRST_NS else "unset"


def interpolated(wanted: Int64Array, index: Int64Array, time: Int64Array, period_ns: float) -> Int64Array:
    """Interpolate times of records by their place in the log, in integers throughout.

    Outside the known places the nominal period is used. No record is placed further than :data:`LARGEST_NS` from zero.
    """
    if not len(wanted):
        return np.zeros(0, dtype=np.int64)
    after = np.searchsorted(index, wanted)
    low, high = np.clip(after - 1, 0, len(index) - 1), np.clip(after, 0, len(index) - 1)
    inside = (after > 0) & (after < len(index))
    share = np.where(inside, (wanted - index[low]) / np.maximum(index[high] - index[low], 1), 0.0)
    between = np.rint((time[high] - time[low]) * share).astype(np.int64)
    shift = np.clip(np.rint((wanted - index[low]) * period_ns), -LARGEST_NS - time[low], LARGEST_NS - time[low])
    outside = np.where(inside, 0, shift).astype(np.int64)
    return np.asarray(time[low] + np.where(inside, between, outside), dtype=np.int64)
