"""Steps of a recorder's clock, and rows out of order that are no steps."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.toml_settings import number
from groundstation.base.units import NS_PER_S

_DAY_NS = 86_400 * NS_PER_S


@dataclass(frozen=True)
class ClockSettings:
    """Criteria of a clock step.

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
        Seconds added to the times of those records.
    set_s : float
        Seconds by which the clock was set: the step less the nominal time between the two records.
    """

    record_index: int
    kind: Literal["backward", "forward"]
    size_s: float
    device_before_ns: int
    device_after_ns: int
    records_before: int
    shift_s: float
    set_s: float


def middle_of(steps: Int64Array) -> float:
    """Return the median of steps, 0 if there are none.

    Examples
    --------
    >>> middle_of(np.array([5, 1, 4, 2])), middle_of(np.array([], dtype=int))
    (3.0, 0.0)
    """
    return quantile(steps, 0.5) if len(steps) else 0.0


def quantile(values: Int64Array, share: float) -> float:
    """Return the value below which a share of integers in any order lies, interpolated.

    It is selected, which takes a sixth of the time of sorting the steps of a log.

    Examples
    --------
    >>> quantile(np.array([5, 1, 4, 2]), 0.5), quantile(np.array([5, 1, 4, 2]), 1.0)
    (3.0, 5.0)
    """
    return quantiles(values, (share,))[0]


def quantiles(values: Int64Array, shares: Sequence[float]) -> list[float]:
    """Return several quantiles, each as :func:`quantile` does, by one selection.

    Examples
    --------
    >>> quantiles(np.array([5, 1, 4, 2]), (0.5, 1.0))
    [3.0, 5.0]
    """
    last = len(values) - 1
    found = []
    places = [(int(share * last), min(int(share * last) + 1, last)) for share in shares]
    ordered = np.partition(values, sorted({place for pair in places for place in pair}))
    for share, (low, high) in zip(shares, places, strict=True):
        below, above = int(ordered[low]), int(ordered[high])
        found.append(float(below + (share * last - low) * (above - below)))
    return found


class ClockSteps:
    """Clock steps and stray rows among the timed records.

    Positions here count timed records only.
    """

    def __init__(self, index: Int64Array, time: Int64Array, settings: ClockSettings) -> None:
        self.index, self.time, self.settings = index, time, settings
        self.stray: BoolArray = np.zeros(len(time), dtype=bool)
        self.implausible: BoolArray = np.zeros(len(time), dtype=bool)
        self.steps: list[tuple[int, int]] = []  # first record after, last sound record before
        changes = np.diff(time)
        ahead = changes[changes > 0]
        self.longest_step_ns = int(ahead.max(initial=0))
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
        """Treat the log as unordered: no steps, each record at its own time."""
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
        """Return the steps in the form of the ledger."""
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
                set_s=int(offsets[number] - offsets[number + 1]) / NS_PER_S,
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
        """Find rows just before ``at`` that jumped ahead, with order restored at ``at``."""
        if size >= 0:
            return None
        jump = max(1.5 * self.period_ns, 0.5 * -size)
        for first in range(last, max(0, last - self.settings.stray_rows), -1):
            before = first - 1
            if self.time[at] >= self.time[before] and self.time[first] - self.time[before] > jump:
                return first, at
        return None

    def _strays_from(self, at: int, last: int, size: int) -> tuple[int, int] | None:
        """Find rows from ``at`` on that are out of order, with order restored after them.

        The end of the log serves as well as restored order.
        """
        count = len(self.time)
        jump = max(1.5 * self.period_ns, 0.5 * abs(size))
        for stop in range(at + 1, min(count, at + self.settings.stray_rows + 1)):
            restored = 0 <= self.time[stop] - self.time[last] <= self._forward_ns
            if restored and abs(int(self.time[stop] - self.time[stop - 1])) > jump:
                return at, stop
        return (at, count) if count - at < self.settings.rows_after_step else None

    def _judge_strays(self, first: int, stop: int) -> None:
        """Mark stray rows whose time is wrong rather than their place.

        The log has a hole where such a row stands.
        """
        before = first - 1
        rows = stop - first
        away = np.abs(self.time[first:stop] - self.time[before]) > _DAY_NS
        if stop < len(self.time):
            hole = int(self.time[stop] - self.time[before]) > (rows + 0.5) * self.period_ns
            self.implausible[first:stop] = away | hole
        else:
            self.implausible[first:stop] = away
