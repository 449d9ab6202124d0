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
from groundstation.integrity.clock import ClockModel, interpolated, start_of, zero_of
from groundstation.integrity.clock_steps import middle_of

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
    index, time = record_index[usable], device_time_ns.values[usable]
    if not len(time):
        return ClockModel(missing_times=len(record_index))
    tolerance_ns = round(settings.tolerance_s * NS_PER_S)
    judged = _judged(time, tolerance_ns, settings.run_records)
    doubted = judged.stale | judged.ahead
    is_wanted = ~usable
    if doubted.any():
        is_wanted[np.flatnonzero(usable)[doubted]] = True
        index, time = index[~doubted], time[~doubted]
    wanted = np.flatnonzero(is_wanted)
    placed = interpolated(record_index[wanted], index, time, 0.0)
    fits = (frozen & has_time)[wanted] & (np.abs(device_time_ns.values[wanted] - placed) <= tolerance_ns)
    frozen_stale = int((frozen & has_time).sum() - fits.sum())
    wanted, placed = record_index[wanted[~fits]], placed[~fits]
    zero = zero_of(int(time.min()), int(time.max()), utc_of_zero_ns)
    late = np.maximum.accumulate(time) - time > tolerance_ns
    steps = np.diff(time)
    return ClockModel(
        is_absolute=zero.is_absolute,
        period_ns=int(middle_of(steps[steps > 0])),
        starts=record_index[:1],
        offsets_ns=np.array([zero.ns], dtype=np.int64),
        placed_index=wanted,
        placed_ns=placed + zero.ns,
        missing_times=int((~has_time).sum()),
        implausible_times=int(judged.ahead.sum()),
        stale_times=int(judged.stale.sum()) + frozen_stale,
        stray_rows=int(np.count_nonzero(late)),
        stray_index=index[late],
        is_unordered=bool(late.any()),
        shift_ns=0 if zero.is_absolute else zero.ns,
        has_times=True,
        is_counting=True,
        start=start_of(int(time[0]), utc_of_zero_ns),
        first_device_ns=int(time[0]) + (utc_of_zero_ns or 0),
        longest_step_ns=int(steps.max(initial=0)),
    )


class _Judged(NamedTuple):
    stale: BoolArray
    ahead: BoolArray


def _judged(time: Int64Array, tolerance_ns: int, run_records: int) -> _Judged:
    """Return masks of records earlier, and later, than the runs around them allow, shape (n,).

    A run is a stretch of records each within the tolerance of the one before. Long runs are believed; a short one is
    believed when it lies between the end of the long run before it and the start of the one after, both widened by the
    tolerance.
    """
    starts = np.concatenate(([0], np.flatnonzero(np.abs(np.diff(time)) > tolerance_ns) + 1))
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
    return _Judged(np.repeat(stale, lengths), np.repeat(ahead, lengths))
