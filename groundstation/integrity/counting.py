"""Clock of a log whose device times count up from power-up.

Nothing sets it, so it has no steps. Its records come topic by topic out of many buffers: an order between topics proves
nothing, and each record keeps its own time. Times far from those of the records around them are not believed: an
autopilot that begins a log writes the newest value of every topic with the time at which it was published, minutes
before, and some topics never advance their time at all. Such records are placed where they stand in the log.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.toml_settings import number
from groundstation.base.units import NS_PER_S
from groundstation.integrity import time_passes
from groundstation.integrity.clock import ClockModel, interpolated, start_of, zero_of
from groundstation.integrity.clock_steps import middle_of
from groundstation.integrity.thinning import Measured, Thinner
from groundstation.integrity.time_passes import passes_over, starts_of_runs

FROZEN_SHARE, FROZEN_LEAST_RECORDS = 0.9, 10


@dataclass(frozen=True)
class CountingSettings:
    """Criteria for believing the times of a counting clock.

    Parameters
    ----------
    tolerance_s : float
        A record may be written so much later than others of its time: slow topics are up to two seconds old.
    run_records : int
        Number of records in a row, each within the tolerance of the one before, that are believed wherever they stand.
    """

    tolerance_s: float = number(3.0, 0.001, 1e6)
    run_records: int = number(50, 1, 1_000_000)


def is_frozen(times: int, repeats: int) -> bool:
    """Tell whether a topic repeats one time instead of telling when its values were true.

    Examples
    --------
    >>> is_frozen(20, repeats=19), is_frozen(20, repeats=0)
    (True, False)
    """
    return times >= FROZEN_LEAST_RECORDS and repeats >= FROZEN_SHARE * (times - 1)


def estimate_counting_clock(
    record_index: Int64Array,
    device_time_ns: Column,
    frozen: BoolArray,
    utc_of_zero_ns: int | None,
    *,
    settings: CountingSettings | None = None,
) -> ClockModel:
    """Model a counting clock.

    Parameters
    ----------
    record_index : ndarray of int64, shape (n,)
        Places of the records, strictly increasing.
    device_time_ns : Column of int64, shape (n,)
    frozen : ndarray of bool, shape (n,)
        Records of topics whose time does not advance.
    utc_of_zero_ns : int or None
        UTC of power-up.

    Returns
    -------
    ClockModel
        Without ``lateness_ns``, which needs the topics.

    Examples
    --------
    >>> seconds = np.array([90, 3, 91, 92, 94, 93, 95, 96, 97])  # 3: published long before; 93: written late
    >>> clock = estimate_counting_clock(np.arange(9), Column(seconds * NS_PER_S), np.zeros(9, dtype=bool), None)
    >>> (clock.time_ns(np.arange(9), Column(seconds * NS_PER_S)) / NS_PER_S).tolist(), clock.stale_times
    ([90.0, 90.5, 91.0, 92.0, 94.0, 93.0, 95.0, 96.0, 97.0], 1)
    """
    settings = settings or CountingSettings()
    has_time = device_time_ns.mask
    usable = has_time & ~frozen
    if not usable.any():
        usable, frozen = has_time, np.zeros(len(has_time), dtype=bool)
    tolerance_ns = round(settings.tolerance_s * NS_PER_S)
    index, time = record_index[usable], device_time_ns.values[usable]
    if not len(time):
        return ClockModel(missing_times=len(record_index))
    judged = _judged(time, tolerance_ns, settings.run_records)
    is_wanted = ~usable
    if len(judged.rows):
        believed = np.ones(len(time), dtype=bool)
        believed[judged.rows] = False
        is_wanted[np.flatnonzero(usable)[judged.rows]] = True
        index, time = index[believed], time[believed]
    wanted = np.flatnonzero(is_wanted)
    placed = interpolated(record_index[wanted], index, time, 0.0)
    fits = (frozen & has_time)[wanted] & (np.abs(device_time_ns.values[wanted] - placed) <= tolerance_ns)
    frozen_stale = int((frozen & has_time).sum() - fits.sum())
    wanted, placed = record_index[wanted[~fits]], placed[~fits]
    told = _measured(time, tolerance_ns, settings.run_records)
    zero = zero_of(told.earliest_ns, told.latest_ns, utc_of_zero_ns)
    late = index[:0]
    if told.lateness_ns > tolerance_ns:
        late = index[np.maximum.accumulate(time) - time > tolerance_ns]
    return ClockModel(
        is_absolute=zero.is_absolute,
        period_ns=told.period_ns,
        starts=record_index[:1].copy(),
        offsets_ns=np.array([zero.ns], dtype=np.int64),
        placed_index=wanted,
        placed_ns=placed + zero.ns,
        missing_times=int((~has_time).sum()),
        implausible_times=judged.ahead,
        stale_times=judged.stale + frozen_stale,
        stray_rows=len(late),
        stray_index=late.copy(),
        is_unordered=bool(len(late)),
        shift_ns=0 if zero.is_absolute else zero.ns,
        has_times=True,
        is_counting=True,
        start=start_of(int(time[0]), utc_of_zero_ns),
        first_device_ns=int(time[0]) + (utc_of_zero_ns or 0),
        longest_step_ns=told.longest_step_ns,
    )


def _measured(time: Int64Array, tolerance_ns: int, run_records: int) -> Measured:
    """Return the figures of records that are believed."""
    if passes_over(time, least=time_passes.MANY_IN_ALL):
        return Thinner(tolerance_ns, run_records).measured(time)
    steps = np.diff(time)
    lateness_ns = int((np.maximum.accumulate(time) - time).max())
    period_ns = int(middle_of(steps[steps > 0]))
    return Measured(int(time.min()), int(time.max()), lateness_ns, int(steps.max(initial=0)), period_ns)


class _Judged(NamedTuple):
    """Rows of doubted records, and how many of them are stale, and how many ahead."""

    rows: Int64Array
    stale: int
    ahead: int


def _judged(time: Int64Array, tolerance_ns: int, run_records: int) -> _Judged:
    """Return the records earlier, and later, than the runs around them allow.

    A run is a stretch of records each within the tolerance of the one before. Long runs are believed; a short one is
    believed when it lies between the end of the long run before it and the start of the one after, both widened by the
    tolerance.
    """
    starts = starts_of_runs(time, tolerance_ns)
    lengths = np.diff(starts, append=len(time))
    is_long = lengths >= min(run_records, int(lengths.max()))
    long = np.flatnonzero(is_long)
    after = np.searchsorted(long, np.arange(len(starts)))
    last, first = time[starts + lengths - 1], time[starts]
    before_ns = last[long[np.maximum(after - 1, 0)]]
    after_ns = first[long[np.minimum(after, len(long) - 1)]]
    before_ns = np.where(after > 0, before_ns, after_ns)
    after_ns = np.where(after < len(long), after_ns, before_ns)
    stale = ~is_long & (first < np.minimum(before_ns, after_ns) - tolerance_ns)
    ahead = ~is_long & (last > np.maximum(before_ns, after_ns) + tolerance_ns) & ~stale
    doubted = stale | ahead
    rows = np.flatnonzero(np.repeat(doubted, lengths)) if doubted.any() else np.zeros(0, dtype=np.int64)
    return _Judged(rows, int(lengths[stale].sum()), int(lengths[ahead].sum()))
