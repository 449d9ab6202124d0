"""Thinning of the records of a counting clock that leaves its estimate the same.

A long log has millions of records, each within the tolerance of the one before. Kept are those that
:func:`groundstation.integrity.counting.estimate_counting_clock` has to see: without a time or frozen, their neighbours,
the ends of runs and as much of each run as makes it a long one, late ones, and of all others those at which time enters
or leaves a stretch of half the tolerance, so that runs hold together.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.records import BoolArray, Int64Array
from groundstation.integrity import time_passes
from groundstation.integrity.time_passes import (
    EARLIEST,
    LATENESS,
    LATEST,
    LONGEST,
    REST,
    TABLE_STEPS,
    UNIT_NS,
    follow,
    new_state,
    passes_over,
    starts_of_runs,
)


class Measured(NamedTuple):
    """Times of many records: the ends, the largest lateness, the longest step, the median one."""

    earliest_ns: int
    latest_ns: int
    lateness_ns: int
    longest_step_ns: int
    period_ns: int


class Thinner:
    """Thinner of the windows of a log, which come in its order.

    Parameters
    ----------
    tolerance_ns, run_records : int
        As the clock's settings have them.
    """

    def __init__(self, tolerance_ns: int, run_records: int) -> None:
        self._tolerance_ns, self._run_records = tolerance_ns, run_records
        self._state = new_state()
        self._steps: list[tuple[Int64Array, Int64Array]] = []
        self._table = np.zeros(0, dtype=np.int64)  # numbers of steps ahead, by their length in units

    def kept(self, time_ns: Int64Array, usable: BoolArray) -> BoolArray:
        """Tell which records of a window are needed, shape (n,).

        ``usable`` are those with a time that is not frozen.
        """
        places = np.flatnonzero(usable)
        if not len(places):
            return np.ones(len(usable), dtype=bool)
        if len(places) == len(usable):
            return self._kept(time_ns)
        kept = self._kept(time_ns[places])
        beside = np.searchsorted(places, np.flatnonzero(~usable))
        kept[np.minimum(beside, len(places) - 1)] = kept[np.maximum(beside - 1, 0)] = True
        wanted = ~usable
        wanted[places] = kept
        return wanted

    def _kept(self, time: Int64Array) -> BoolArray:
        """Tell which of the usable records are needed, whatever stands between them."""
        starts = starts_of_runs(time, self._tolerance_ns)
        lengths = np.diff(starts, append=len(time))
        ahead = self._ahead(time, starts, lengths)
        if passes_over(time, least=time_passes.MANY_IN_ALL):
            return self._followed(time, starts, ahead)
        steps = np.diff(time)
        self._steps.append(np.unique(steps[steps > 0], return_counts=True))
        kept = self._of_runs(time, starts, lengths, ahead)
        stretch = time // (self._tolerance_ns // 2)
        enters = stretch[1:] != stretch[:-1]
        kept[1:] |= enters
        kept[:-1] |= enters
        return kept

    def _followed(self, time: Int64Array, starts: Int64Array, ahead: BoolArray) -> BoolArray:
        """Tell it of many records, in one pass."""
        if not len(self._table):
            self._table = np.zeros(TABLE_STEPS, dtype=np.int64)
        kept, rest = np.empty(len(time), dtype=bool), np.empty(len(time), dtype=np.int64)
        follow(time, starts, ahead, self._tolerance_ns, self._run_records, kept, self._table, rest, self._state)
        if self._state[REST]:
            self._steps.append(np.unique(rest[: self._state[REST]], return_counts=True))
        return kept

    def measured(self, time: Int64Array) -> Measured:
        """Return the figures of many records that are all believed."""
        self._followed(time, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=bool))
        earliest, latest, lateness, longest = self._state[[EARLIEST, LATEST, LATENESS, LONGEST]].tolist()
        return Measured(earliest, latest, lateness, longest, self.period_ns)

    @property
    def period_ns(self) -> int:
        """Median of the forward steps between usable records of the thinned windows; 0 of none."""
        met = np.flatnonzero(self._table)
        parts = [*self._steps, (met * UNIT_NS, self._table[met])]
        steps, counts = (np.concatenate(several) for several in zip(*parts, strict=True))
        order = np.argsort(steps, kind="stable")
        reached = np.cumsum(counts[order])
        if not len(reached):
            return 0
        middle = np.searchsorted(reached, ((reached[-1] - 1) // 2, reached[-1] // 2), side="right")
        return int(steps[order[middle]].sum()) // 2

    def _of_runs(self, time: Int64Array, starts: Int64Array, lengths: Int64Array, ahead: BoolArray) -> BoolArray:
        """Select beginnings of runs, both ends of the window, and late records."""
        begins = np.zeros(len(time) + 1, dtype=np.int8)
        begins[starts] = 1
        begins[starts + np.minimum(lengths, self._run_records)] -= 1  # behind the beginning of a run
        kept: BoolArray = np.cumsum(begins[:-1], dtype=np.int8) > 0
        kept[-self._run_records :] = True
        seen = np.where(np.repeat(ahead, lengths), time.min(), time) if ahead.any() else time
        latest = np.maximum(np.maximum.accumulate(seen), self._state[LATEST])
        self._state[LATEST] = latest[-1]
        kept |= latest - time > self._tolerance_ns
        return kept

    def _ahead(self, time: Int64Array, starts: Int64Array, lengths: Int64Array) -> BoolArray:
        """Select short runs later than the long ones around them allow: they make nothing late."""
        long = np.flatnonzero(lengths >= self._run_records)
        after = np.searchsorted(long, np.arange(len(starts)))
        is_between = (after > 0) & (after < len(long)) & (lengths < self._run_records)
        if not is_between.any():
            return is_between
        last = time[starts + lengths - 1]
        before_ns, after_ns = last[long[np.maximum(after - 1, 0)]], time[starts][long[np.minimum(after, len(long) - 1)]]
        ahead: BoolArray = is_between & (last > np.maximum(before_ns, after_ns) + self._tolerance_ns)
        return ahead
