"""Power-ups in one source: where a counter restarts, and where one of n bits wraps.

The source is seen as runs of records whose times follow one another. The first time of a run tells how it belongs to
those before it: it goes on, it is the same counter behind its wrap, or it is another power-up.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.timescales import GPS_EPOCH_NS, leap_seconds_at
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_relation import QUARTER_S, ROLLOVER_S, WEEK_S

LAST_RECORD = 1 << 62
MOST_RUNS = 100_000  # with more runs no record follows another: order is lost, and so are the starts
TOLERANCE_NS, PERIODS, MOST_NS = 3 * NS_PER_S, 3, 60 * NS_PER_S  # a record follows another within both, and the last
SHUFFLED_SHARE = 0.2  # largest ratio of runs to records: beyond it nothing follows anything
FEWEST_RECORDS = 20  # least length of a run that counts; a shorter one is late, early or damaged
LEAST_NS = 10 * NS_PER_S  # a smaller step back is a clock that was set
SHORT_NS = 20 * NS_PER_S  # a power-up that is shorter is none, unless another log begins behind it
NEAR_NS, NEAR_SHARE = 5 * NS_PER_S, 0.1  # distance from the first time, and share of the length so far
BOOT_NS = 30 * NS_PER_S  # a counter so soon after its zero has just been started
PART_NS = 10 * NS_PER_S  # a log that begins so soon after the one before is a part of it
MARKED_NS = 60 * NS_PER_S  # the same of a clock that tells UTC, which may be set where a log begins
SET_NS = 600 * NS_PER_S  # nobody sets a clock back by so much, but for a wrong time zone or week
SILENT_NS, YEAR_NS = 3_600 * NS_PER_S, 366 * 86_400 * NS_PER_S  # a silence that is another power-up; longer: set late
LASTING_NS = 60 * NS_PER_S  # both sides of such a step
WRAP_NS = 5 * NS_PER_S  # the counter stands so near to 2^n before it wraps
PLAUSIBLE_NS = NS_PER_S  # from the last record before a wrap to the first behind it, unless the usual step is longer
_LATE_NS = 30 * NS_PER_S  # records of the time before a wrap come no later


class RecordRun(NamedTuple):
    """Records whose times follow one another: place and device time of both ends, and number."""

    first_index: int
    last_index: int
    first_ns: int
    last_ns: int
    records: int


@dataclass(frozen=True)
class Wrap:
    """A counter that wrapped and goes on.

    Parameters
    ----------
    record_index : int
        First record behind it.
    modulus_ns : int
        Nanoseconds added to the times from there on.
    what : str
        The counter, in words.
    middle_ns : int
        Device times behind it are below, those before it above.
    early_from, late_until : int
        Between these records, those of before and behind the wrap stand mixed.
    """

    record_index: int
    modulus_ns: int
    what: str
    middle_ns: int
    early_from: int
    late_until: int

    def added_ns(self, record_index: Int64Array, time_ns: Int64Array) -> Int64Array:
        """Return the time that the wrap adds to device times, shape (n,)."""
        is_behind = record_index >= self.record_index
        is_low = time_ns < self.middle_ns
        is_mixed = (record_index >= self.early_from) & (record_index <= self.late_until)
        return np.where(np.where(is_mixed, is_low, is_behind), self.modulus_ns, 0)


@dataclass(frozen=True)
class PowerUp:
    """One power-up of a recorder in a source that may hold several.

    Parameters
    ----------
    first, end : int
        Its first record, and the first one of the next.
    wraps : tuple of Wrap
    is_marked : bool
        Another log begins there, by what stands in the source.
    is_ahead : bool
        Its device times are ahead of those before: the same counter, after a pause.
    """

    first: int = 0
    end: int = LAST_RECORD
    wraps: tuple[Wrap, ...] = ()
    is_marked: bool = False
    is_ahead: bool = False

    def unwrapped_ns(self, record_index: Int64Array, time_ns: Int64Array) -> Int64Array:
        """Return the device times of its records as a counter without an end has them, shape (n,)."""
        for wrap in self.wraps:
            time_ns = time_ns + wrap.added_ns(record_index, time_ns)
        return time_ns


@dataclass(frozen=True)
class Evidence:
    """Knowledge of a source beside the times of its records.

    Parameters
    ----------
    is_utc : bool
        Device times tell UTC: the clock can be set, and does not start at power-up.
    period_ns : int
        Nominal time between records.
    new_logs : sequence of int
        Places where another log begins, by what stands there.
    steps_back : callable
        Tells whether most topics go back by themselves at a place, among those with times beyond the middle of what is
        before it: topic behind topic is no power-up.
    zero_ns : callable
        UTC of device time zero by the readings between two places; None without any.
    """

    is_utc: bool = False
    period_ns: int = 0
    new_logs: Sequence[int] = ()
    steps_back: Callable[[int, int], bool] = lambda _place, _middle_ns: True
    zero_ns: Callable[[int, int], int | None] = lambda _first, _end: None


def power_ups(windows: Iterable[tuple[Int64Array, Int64Array]], evidence: Evidence) -> tuple[PowerUp, ...]:
    """Find the power-ups of a source, in the order of its records.

    There is one, without wraps, where the source holds nothing odd.

    Parameters
    ----------
    windows : iterable of (ndarray, ndarray)
        Places and device times of the records that have one, in the order of the source.

    Examples
    --------
    >>> index, seconds = np.arange(200), np.tile(np.arange(100), 2)
    >>> [found.first for found in power_ups([(index, seconds * NS_PER_S)], Evidence())]
    [0, 100]
    """
    runs = _runs(windows, min(max(TOLERANCE_NS, PERIODS * evidence.period_ns), MOST_NS))
    if not 1 < len(runs) <= min(MOST_RUNS, 2 + SHUFFLED_SHARE * sum(run.records for run in runs)):
        return (PowerUp(),)
    return _Walk(runs, evidence).result()


def _runs(windows: Iterable[tuple[Int64Array, Int64Array]], tolerance_ns: int) -> list[RecordRun]:
    """Return the runs of the records of all windows, in order.

    Where there are more than ``MOST_RUNS``, the list only shows that there are too many.
    """
    runs: list[RecordRun] = []
    for index, time in windows:
        if not len(time):
            continue
        starts = np.concatenate(([0], np.flatnonzero(np.abs(np.diff(time)) > tolerance_ns) + 1))
        if len(starts) + len(runs) > MOST_RUNS:
            return runs + [RecordRun(0, 0, 0, 0, 0)] * (MOST_RUNS + 1)
        last = np.append(starts[1:], len(time)) - 1
        columns = index[starts], index[last], time[starts], time[last], last - starts + 1
        new = [RecordRun(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
        if runs and abs(new[0].first_ns - runs[-1].last_ns) <= tolerance_ns:
            before, first = runs.pop(), new[0]
            new[0] = RecordRun(
                before.first_index, first.last_index, before.first_ns, first.last_ns, before.records + first.records
            )
        runs += new
    return runs


@dataclass
class _Level:
    """State of the counter of a power-up.

    It has its first time, its last one without wraps, and the time that wraps add.
    """

    first_ns: int
    top_ns: int
    added_ns: int = 0

    @property
    def length_ns(self) -> int:
        return self.top_ns - self.first_ns


@dataclass
class _Walk:
    """Walk through the long runs, one after the other.

    Short runs belong to whatever is around them.
    """

    runs: Sequence[RecordRun]
    evidence: Evidence
    found: list[PowerUp] = field(default_factory=lambda: [PowerUp()])

    def result(self) -> tuple[PowerUp, ...]:
        fewest = min(FEWEST_RECORDS, max(run.records for run in self.runs))
        long = [number for number, run in enumerate(self.runs) if run.records >= fewest]
        first = self.runs[long[0]]
        level = _Level(first.first_ns, max(first.first_ns, first.last_ns))
        for before, number in pairwise(long):
            run = self.runs[number]
            mark = self._mark(before, number)
            wrap = None if mark is not None else self._wrap(level, before, number)
            place = self._place(level, before, number) if mark is None else mark
            if wrap is not None:
                self.found[-1] = replace(self.found[-1], wraps=(*self.found[-1].wraps, wrap))
                level.added_ns += wrap.modulus_ns
            elif self._is_restart(level, number, long, place, is_marked=mark is not None):
                self.found[-1] = replace(self.found[-1], end=place)
                is_ahead = run.first_ns + level.added_ns > level.top_ns
                self.found.append(PowerUp(first=place, is_marked=mark is not None, is_ahead=is_ahead))
                level = _Level(run.first_ns, run.first_ns)
            level.top_ns = max(level.top_ns, run.last_ns + level.added_ns)
        return tuple(self.found)

    def _mark(self, before: int, number: int) -> int | None:
        """Return the place between two runs where another log begins, None without one."""
        marks = self.evidence.new_logs
        at = bisect_left(marks, self.runs[before].last_index + 1)
        return marks[at] if at < len(marks) and marks[at] <= self.runs[number].first_index else None

    def _place(self, level: _Level, before: int, number: int) -> int:
        """Return the place where a power-up would begin after a long run.

        It is behind the last run that is not below it.
        """
        floor_ns = level.top_ns - level.added_ns - TOLERANCE_NS
        lower = (at for at in range(before + 1, number) if self.runs[at].first_ns < floor_ns)
        return self.runs[next(lower, number) - 1].last_index + 1

    def _is_restart(self, level: _Level, number: int, long: Sequence[int], place: int, *, is_marked: bool) -> bool:
        """Tell whether a long run is of another power-up, which then begins at ``place``."""
        run = self.runs[number]
        step_ns = run.first_ns + level.added_ns - level.top_ns
        if is_marked:
            low_ns, high_ns = (-MARKED_NS, MARKED_NS) if self.evidence.is_utc else (-TOLERANCE_NS, PART_NS)
            return not low_ns <= step_ns <= high_ns
        middle_ns = (level.first_ns + level.top_ns) // 2 - level.added_ns
        is_apart = step_ns > 0 or run.last_ns < level.first_ns
        if not is_apart and not self.evidence.steps_back(place, middle_ns):
            return False
        if self._is_restored(level, number, long):
            return False
        if self._is_set_nowhere(step_ns) and level.length_ns >= LASTING_NS and self._lasts(number):
            return True
        return not self.evidence.is_utc and step_ns < -LEAST_NS and self._is_at_its_start(level, run)

    def _is_at_its_start(self, level: _Level, run: RecordRun) -> bool:
        """Tell whether a counter is back near its first value, or near zero."""
        near_ns = max(NEAR_NS, round(NEAR_SHARE * level.length_ns))
        is_near = abs(run.first_ns - level.first_ns) <= near_ns or 0 <= run.first_ns <= BOOT_NS
        return is_near and level.length_ns >= SHORT_NS

    def _is_set_nowhere(self, step_ns: int) -> bool:
        """Tell whether a step is none that sets a clock: no time zone, no GPS week."""
        if _is_near_multiple(step_ns, QUARTER_S * NS_PER_S) or _is_near_multiple(step_ns, ROLLOVER_S * NS_PER_S):
            return False
        return step_ns < -SET_NS or (self.evidence.is_utc and SILENT_NS < step_ns < YEAR_NS)

    def _lasts(self, number: int) -> bool:
        """Tell whether the records that begin with a run go on for a while."""
        start_ns = self.runs[number].first_ns
        return any(LASTING_NS <= run.last_ns - start_ns < YEAR_NS for run in self.runs[number:])

    def _is_restored(self, level: _Level, number: int, long: Sequence[int]) -> bool:
        """Tell whether the records that follow are merely a stretch out of its place.

        Behind it the records go on from before it.
        """
        start, raw_top_ns = self.runs[number].first_ns, level.top_ns - level.added_ns
        behind = [one for one in long if one >= number]
        for one, other in pairwise(behind):
            last_ns, next_ns = self.runs[one].last_ns, self.runs[other].first_ns
            if next_ns - last_ns > LEAST_NS and -TOLERANCE_NS <= next_ns - raw_top_ns <= LEAST_NS:
                return 2 * (last_ns - start) < level.length_ns
        return False

    def _wrap(self, level: _Level, before: int, number: int) -> Wrap | None:
        """The wrap between two long runs, None where there is none."""
        run, top_ns = self.runs[number], level.top_ns - level.added_ns
        plausible_ns = min(max(PLAUSIBLE_NS, PERIODS * self.evidence.period_ns), WRAP_NS)
        known = _week_wrap(top_ns, run.first_ns) if self.evidence.is_utc else _wrap_of(top_ns, run.first_ns)
        if known is None or run.first_ns + known[0] - top_ns > plausible_ns:
            return None
        begins, ends = self.runs[before].first_index, self._until(number, top_ns)
        zeros = self.evidence.zero_ns(begins, run.first_index), self.evidence.zero_ns(run.first_index, ends)
        if zeros[0] is not None and zeros[1] is not None and abs(zeros[1] - zeros[0] - known[0]) > WRAP_NS:
            return None  # by the time of another clock it is another power-up
        middle_ns = (top_ns + run.first_ns) // 2
        mixed = self.runs[before].last_index + 1, self._late_until(number, top_ns)
        return Wrap(run.first_index, *known, middle_ns, *mixed)

    def _until(self, number: int, top_ns: int) -> int:
        """Return the end of what follows a wrap without another step back."""
        for one, other in pairwise(self.runs[number:]):
            if other.first_ns < one.last_ns - LEAST_NS and one.last_ns < top_ns - _LATE_NS:
                return other.first_index
        return LAST_RECORD

    def _late_until(self, number: int, top_ns: int) -> int:
        """Return the last record behind a wrap whose time is from before it."""
        until = self.runs[number].first_index
        for run in self.runs[number:]:
            if run.first_ns >= top_ns - _LATE_NS:
                until = run.last_index
            elif run.last_ns - self.runs[number].first_ns > _LATE_NS:
                break
        return until


def _is_near_multiple(step_ns: int, unit_ns: int) -> bool:
    """Tell whether a step is a multiple of a unit, to 5 s, and not zero."""
    times = round(step_ns / unit_ns)
    return times != 0 and abs(step_ns - times * unit_ns) <= 5 * NS_PER_S


def _wrap_of(before_ns: int, after_ns: int) -> tuple[int, str] | None:
    """Return the value at which a counter wraps, and its kind; None if the step is no wrap.

    Examples
    --------
    >>> _wrap_of((1 << 32) * 1_000_000 - 20_000_000, 30_000_000), _wrap_of(90 * NS_PER_S, 0)
    ((4294967296000000, 'counter of 32 bits and 1 ms'), None)
    """
    for modulus_ns, what in _MODULI:
        window_ns = min(WRAP_NS, modulus_ns // 20)
        if 0 < modulus_ns - before_ns <= window_ns and 0 <= after_ns <= window_ns:
            return modulus_ns, what
    return None


def _week_wrap(before_ns: int, after_ns: int) -> tuple[int, str] | None:
    """Return the wrap of UTC that a receiver made from a GPS week of 10 or 13 bits.

    It has the form of :func:`_wrap_of`. The leap seconds are those of two days.

    Examples
    --------
    >>> from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
    >>> before, after = (iso_to_utc_ns(text)[0] for text in ("2019-04-06T23:59:41.9Z", "1999-08-21T23:59:47.1Z"))
    >>> utc_ns_to_iso(after + _week_wrap(before, after)[0])
    '2019-04-06T23:59:42.100Z'
    """
    leaps = [leap_seconds_at(one) * NS_PER_S for one in (before_ns, after_ns)]
    before, after = before_ns - GPS_EPOCH_NS + leaps[0], after_ns - GPS_EPOCH_NS + leaps[1]
    for weeks in (1 << 10, 1 << 13):
        modulus_ns = weeks * WEEK_S * NS_PER_S
        is_full = 0 < modulus_ns - before % modulus_ns <= WRAP_NS
        if after < before and is_full and after % modulus_ns <= WRAP_NS:
            rounds = before // modulus_ns + 1 - after // modulus_ns
            return rounds * modulus_ns + leaps[1] - leaps[0], f"GPS week of {weeks} weeks"
    return None


def _moduli() -> tuple[tuple[int, str], ...]:
    """List counters of 24, 32 and 48 bits by their ticks, and those of a day and of a week.

    Counters that last less than a minute are left out.
    """
    names = {100: "100 ns", 1_000: "1 µs", 10_000: "10 µs", 100_000: "0.1 ms", 1_000_000: "1 ms", 10_000_000: "10 ms"}
    found = [
        ((1 << bits) * tick, f"counter of {bits} bits and {name}")
        for bits in (24, 32, 48)
        for tick, name in names.items()
        if 60 * NS_PER_S < (1 << bits) * tick < LAST_RECORD
    ]
    return (*found, (86_400 * NS_PER_S, "time of day"), (WEEK_S * NS_PER_S, "time of the week"))


_MODULI = _moduli()
