"""The clock model: corrected time of every record, from its device time and its place in the log.

Corrected time = device time + an offset that is constant between clock steps. A recorder whose clock is set during
the log (GNSS time arrives) writes a step; what comes after the last step is believed, and what comes before is moved so
that the step becomes one nominal period. A few rows out of order are no step; they are sorted. Rows without a time get
one from their neighbours. Nothing here knows the wall clock: without absolute time, time counts from the log's zero.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch, frozen
from groundstation.base.timescales import duration_text, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.toml_settings import number
from groundstation.base.units import NS_PER_S

_DAY_NS = 86_400 * NS_PER_S
LARGEST_NS = 2**62  # of a time and of what is added to it: sums fit 64 bits


@dataclass(frozen=True)
class ClockSettings:
    """What counts as a clock step.

    Parameters
    ----------
    stray_rows : int
        A run of at most this many rows out of order, with order restored after it, is stray rows and not a step.
    rows_after_step : int
        A step needs at least this many rows after it; fewer at the end of the log are stray.
    unordered_share : float
        With more backward steps than this share of the rows the log is taken as unordered: sorted, without steps.
    forward_step_s : float
        A longer jump ahead is a clock that was set; a shorter one is a gap in the data.
    """

    stray_rows: int = number(5, 0)
    rows_after_step: int = number(3, 1)
    unordered_share: float = number(0.2, 0.0, 1.0)
    forward_step_s: float = number(86_400.0, 1.0, 1e9)


@dataclass(frozen=True)
class ClockStep:
    """A step of the recorder's clock.

    Parameters
    ----------
    record_index : int
        First record after the step.
    kind : {'backward', 'forward'}
    size_s : float
        Device time after the step minus device time before it.
    device_before_ns, device_after_ns : int
        Device times on both sides (UTC when the log is absolute).
    records_before : int
        Timed records since the previous step.
    shift_s : float
        What was added to the times of those records.
    """

    record_index: int
    kind: Literal["backward", "forward"]
    size_s: float
    device_before_ns: int
    device_after_ns: int
    records_before: int
    shift_s: float


@dataclass(frozen=True)
class Clock:
    """Corrected time as a function of device time and place.

    Parameters
    ----------
    is_absolute : bool
        Whether corrected time is UTC nanoseconds since 1970; else nanoseconds since the log's zero.
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
        What was added to all times so that none is negative (logs without UTC).
    has_times : bool
        False when no record has a time: then nothing can be placed.
    stray_index : ndarray of int64
        Records that are out of order with a time that is believed.
    stale_times : int
        Records of a counting clock with the time of an earlier publication (see ``integrity.counting``).
    lateness_ns : mapping of topic to int
        How far a record comes after a later one of its topic, at most: the hold-back that restores order.
    is_counting : bool
        A counting clock (see ``integrity.counting``): records of several sources may share a time.
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

    def __post_init__(self) -> None:
        for name in ("starts", "offsets_ns", "placed_index", "placed_ns", "stray_index"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def time_ns(self, record_index: Int64Array, device_time_ns: Column) -> Int64Array:
        """Corrected time, nanoseconds, shape (n,), of records given by place and device time.

        Records without a time of their own must be among those the survey saw.
        """
        if len(self.starts) == 1:
            time = device_time_ns.values + self.offsets_ns[0]
        else:
            segment = np.searchsorted(self.starts, record_index, side="right") - 1
            time = device_time_ns.values + self.offsets_ns[np.maximum(segment, 0)]
        if not len(self.placed_index) or not len(record_index):
            return np.asarray(time, dtype=np.int64)
        if (record_index[1:] <= record_index[:-1]).any():
            at = np.minimum(np.searchsorted(self.placed_index, record_index), len(self.placed_index) - 1)
            return np.where(self.placed_index[at] == record_index, self.placed_ns[at], time)
        low, high = np.searchsorted(self.placed_index, (record_index[0], record_index[-1] + 1))
        at = np.searchsorted(record_index, self.placed_index[low:high])  # few are placed: they are looked for
        found = record_index[at] == self.placed_index[low:high]
        time[at[found]] = self.placed_ns[low:high][found]
        return np.asarray(time, dtype=np.int64)

    def correct(self, batch: RecordBatch) -> RecordBatch:
        """The batch with ``time_ns`` set, its rows in the order of the source."""
        return RecordBatch(
            batch.topic,
            batch.record_index,
            batch.device_time_ns,
            batch.columns,
            self.time_ns(batch.record_index, batch.device_time_ns),
            batch.validity_time_ns,
        )

    def text(self, time_ns: int) -> str:
        """A time for people: ISO UTC, or ``+mm:ss`` from the log's zero."""
        if self.is_absolute:
            return utc_ns_to_iso(time_ns)
        seconds = time_ns / NS_PER_S
        return f"{'-' if seconds < 0 else '+'}{duration_text(abs(seconds))}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-able summary, times in seconds rounded to the millisecond."""
        return {
            "is_absolute": self.is_absolute,
            "nominal_period_s": round(self.period_ns / NS_PER_S, 6),
            "steps": [
                {
                    "record_index": step.record_index,
                    "kind": step.kind,
                    "size_s": round(step.size_s, 3),
                    "records_before": step.records_before,
                    "shift_of_earlier_s": round(step.shift_s, 3),
                }
                for step in self.steps
            ],
            "missing_times": self.missing_times,
            "implausible_times": self.implausible_times,
            "stale_times": self.stale_times,
            "stray_rows": self.stray_rows,
            "is_unordered": self.is_unordered,
            "is_counting": self.is_counting,
            "shift_s": round(self.shift_ns / NS_PER_S, 3),
        }


def estimate_clock(
    record_index: Int64Array,
    device_time_ns: Column,
    utc_of_zero_ns: int | None,
    *,
    settings: ClockSettings | None = None,
) -> Clock:
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
    Clock
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
        return Clock(missing_times=len(record_index))
    found = _Steps(index, time, settings or ClockSettings())
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
    return Clock(
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
    )


_END_NS = iso_to_utc_ns("2262-01-01T00:00:00Z")[0]


class Zero(NamedTuple):
    """What is added to all times, and whether they then are UTC."""

    is_absolute: bool
    ns: int


def zero_of(earliest_ns: int, latest_ns: int, utc_of_zero_ns: int | None) -> Zero:
    """What to add to all times: UTC of zero, or as much as leaves none negative.

    Nothing is recorded before 1970, nor after 2261, the last whole year that 64 bits hold.
    """
    if utc_of_zero_ns is not None and 0 <= earliest_ns + utc_of_zero_ns <= latest_ns + utc_of_zero_ns < _END_NS:
        return Zero(True, utc_of_zero_ns)
    return Zero(False, max(0, -earliest_ns))


def middle_of(steps: Int64Array) -> float:
    """Median of steps, 0 of none: by a sort, as the selection of ``np.median`` is slow on steps that keep repeating.

    Examples
    --------
    >>> middle_of(np.array([5, 1, 4, 2])), middle_of(np.array([], dtype=int))
    (3.0, 0.0)
    """
    return quantile(np.sort(steps), 0.5) if len(steps) else 0.0


def quantile(ordered: Int64Array, share: float) -> float:
    """Value below which a share of ordered integers lies, between two of them by proportion.

    Examples
    --------
    >>> quantile(np.array([1, 2, 4, 5]), 0.5), quantile(np.array([1, 2, 4, 5]), 1.0)
    (3.0, 5.0)
    """
    at = share * (len(ordered) - 1)
    low = int(at)
    below, above = int(ordered[low]), int(ordered[min(low + 1, len(ordered) - 1)])
    return below + (at - low) * (above - below)


class _Steps:
    """Clock steps and stray rows among the timed records (positions here count timed records only)."""

    def __init__(self, index: Int64Array, time: Int64Array, settings: ClockSettings) -> None:
        self.index, self.time, self.settings = index, time, settings
        self.stray: BoolArray = np.zeros(len(time), dtype=bool)
        self.implausible: BoolArray = np.zeros(len(time), dtype=bool)
        self.steps: list[tuple[int, int]] = []  # first record after, last sound record before
        changes = np.diff(time)
        ahead = changes[changes > 0]
        self.period_ns = int(middle_of(ahead))
        self._spacing = middle_of(np.diff(index)) if len(index) > 1 else 1.0
        self._forward_ns = round(settings.forward_step_s * NS_PER_S)
        backward = int((changes < 0).sum())
        self.is_unordered = backward > max(2.0, settings.unordered_share * len(time))
        if self.is_unordered:
            self.sort()
            return
        for at in np.flatnonzero((changes < 0) | (changes > self._forward_ns)) + 1:
            self._judge(int(at))

    def sort(self) -> None:
        """Take the log as unordered: without steps, each record at its own time."""
        self.is_unordered, self.steps = True, []
        self.implausible[:] = self.stray[:] = False
        self.stray[1:] = self.time[1:] < np.maximum.accumulate(self.time)[:-1]

    @property
    def period_per_record_ns(self) -> float:
        """Nominal period for one step of record_index."""
        return self.period_ns / self._spacing if self._spacing else 0.0

    def offsets_ns(self) -> list[int]:
        """Offset of each segment; the last one's is zero."""
        offsets = [0]
        for at, last in reversed(self.steps):
            records = max(1, round((self.index[at] - self.index[last]) / self._spacing))
            offsets.append(offsets[-1] + int(self.time[at] - self.time[last]) - records * self.period_ns)
        return offsets[::-1]

    def described(self, offsets: Int64Array) -> tuple[ClockStep, ...]:
        """The steps as the ledger tells them."""
        firsts = [0, *(at for at, _last in self.steps)]
        return tuple(
            ClockStep(
                record_index=int(self.index[at]),
                kind="backward" if self.time[at] < self.time[last] else "forward",
                size_s=int(self.time[at] - self.time[last]) / NS_PER_S,
                device_before_ns=int(self.time[last]),
                device_after_ns=int(self.time[at]),
                records_before=at - firsts[number],
                shift_s=int(offsets[number]) / NS_PER_S,
            )
            for number, (at, last) in enumerate(self.steps)
        )

    def _judge(self, at: int) -> None:
        """Tell a step at ``at`` from stray rows around it."""
        if self.stray[at]:
            return
        last = at - 1
        while last >= 0 and self.stray[last]:
            last -= 1
        if last < 0:
            return
        size = int(self.time[at] - self.time[last])
        if 0 <= size <= self._forward_ns:
            return
        runs = [self._strays_from(at, last, size), self._strays_before(at, last, size)]
        known = [run for run in runs if run is not None]
        if not known:
            self.steps.append((at, last))
            return
        first, stop = min(known, key=lambda run: run[1] - run[0])  # few late rows rather than many early ones
        self.stray[first:stop] = True
        self._judge_strays(first, stop)

    def _strays_before(self, at: int, last: int, size: int) -> tuple[int, int] | None:
        """Rows just before ``at`` that jumped ahead, the order being restored at ``at``."""
        if size >= 0:
            return None
        jump = max(1.5 * self.period_ns, 0.5 * -size)
        for first in range(last, max(0, last - self.settings.stray_rows), -1):
            before = first - 1
            if self.time[at] >= self.time[before] and self.time[first] - self.time[before] > jump:
                return first, at
        return None

    def _strays_from(self, at: int, last: int, size: int) -> tuple[int, int] | None:
        """Rows from ``at`` on that are out of order, the order being restored after them (or the log ends)."""
        count = len(self.time)
        jump = max(1.5 * self.period_ns, 0.5 * abs(size))
        for stop in range(at + 1, min(count, at + self.settings.stray_rows + 1)):
            restored = 0 <= self.time[stop] - self.time[last] <= self._forward_ns
            if restored and abs(int(self.time[stop] - self.time[stop - 1])) > jump:
                return at, stop
        return (at, count) if count - at < self.settings.rows_after_step else None

    def _judge_strays(self, first: int, stop: int) -> None:
        """A stray row for which the log has a hole where it stands has a wrong time, not a wrong place."""
        before = first - 1
        rows = stop - first
        away = np.abs(self.time[first:stop] - self.time[before]) > _DAY_NS
        if stop < len(self.time):
            hole = int(self.time[stop] - self.time[before]) > (rows + 0.5) * self.period_ns
            self.implausible[first:stop] = away | hole
        else:
            self.implausible[first:stop] = away


def interpolated(wanted: Int64Array, index: Int64Array, time: Int64Array, period_ns: float) -> Int64Array:
    """Times of places between known ones by place, outside them by the nominal period; integers throughout.

    None is placed further than :data:`LARGEST_NS` from zero.
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
