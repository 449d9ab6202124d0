"""Three clocks of a bag: log time, publish time, header stamp.

This module finds which of them was set, and which is believed. Log time is that of the recorder's computer. Where it
steps while stamps go on smoothly, the clock was set: log time is moved by as much. Stamps are believed where they go
with the log time, or where they go on smoothly while messages were logged in bursts.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags.messages import Connection
from groundstation.readers.bags.sources import WriteTimes
from groundstation.readers.clock_offsets import ClockJump, Offsets, offsets_by
from groundstation.readers.two_clocks import FEWEST_READINGS, ClockReadings, ClockStretch, ReadingSequence, stretches_of

LARGEST_LAG_S = 2.0  # between header stamp and log time: a larger lag means another clock
MOST_QUEUED_S = 60.0  # longest time that a message waits for the recorder
USUAL_SHARE = 0.99  # share of a topic's stamps that must be within that lag, while neither clock steps
BELIEVED_SHARE = 0.5  # share of a topic's messages whose stamps go with the log time: the others have log time
FIRST_NS = iso_to_utc_ns("1980-01-08T00:00:00Z")[0]  # a clock before it was not set
MOST_SAMPLES = 4_096
MOST_JUMPS = 1_000
_LEAP_S = 5.0  # leap of a topic's log time between two messages: another clock may have been set there
_SLIP_NS = 60 * NS_PER_S  # longest slip, from the last message before it to the first one after it
_LARGEST_LAG_NS = int(LARGEST_LAG_S * NS_PER_S)


def was_set(jumps: Sequence[ClockJump], offsets: Offsets) -> bool:
    """Tell whether a corrected log time falls by a second or more, or leaps from before 1980.

    A slip of a few messages does not count.

    Parameters
    ----------
    jumps : sequence of ClockJump
        Of one connection.
    offsets : Offsets
    """
    number = 0
    while number < len(jumps):
        jump = jumps[number]
        before_ns, time_ns = np.array([jump.before_ns, jump.time_ns]) + offsets.at(np.array([jump.before, jump.record]))
        back = next((at for at in range(number + 1, len(jumps)) if _is_back(jump, jumps[at])), None)
        if back is None and (time_ns <= before_ns - NS_PER_S or before_ns < FIRST_NS <= time_ns):
            return True
        number = number + 1 if back is None else back + 1
    return False


def _is_back(jump: ClockJump, later: ClockJump) -> bool:
    """Tell whether the log time returns to its old course a few messages after a jump."""
    return later.number - jump.number < FEWEST_READINGS and 0 <= later.time_ns - jump.before_ns < _SLIP_NS


@dataclass
class ThinnedColumns:
    """Columns of integers, thinned evenly as they grow.

    Each row that is kept stands for ``stride`` rows.
    """

    columns: int
    stride: int = 1
    count: int = 0
    _kept: list[Int64Array] = field(default_factory=list)
    _size: int = 0

    def take(self, *columns: Int64Array) -> None:
        """Add rows."""
        rows = np.stack(columns)[:, -self.count % self.stride :: self.stride]
        self._kept.append(rows)
        self._size += rows.shape[1]
        self.count += len(columns[0])
        while self._size > MOST_SAMPLES:
            self._kept = [self.all()[:, ::2]]
            self._size, self.stride = self._kept[0].shape[1], 2 * self.stride

    def all(self) -> Int64Array:
        """Return the rows that are kept, shape (columns, n)."""
        return np.concatenate([np.zeros((self.columns, 0), dtype=np.int64), *self._kept], axis=1)


@dataclass
class Stamped:
    """Log times and stamps of one connection.

    Attributes
    ----------
    log : ThinnedColumns
        Log times.
    stamps : ThinnedColumns
        Record, log time and stamp of messages that have one.
    readings : ClockReadings
        Of the stamps, against log time.
    jumps : list of ClockJump
    """

    log: ThinnedColumns = field(default_factory=lambda: ThinnedColumns(1))
    stamps: ThinnedColumns = field(default_factory=lambda: ThinnedColumns(3))
    readings: ClockReadings = field(default_factory=ClockReadings)
    jumps: list[ClockJump] = field(default_factory=list)
    _last: Int64Array = field(default_factory=lambda: np.zeros((2, 0), dtype=np.int64))

    def take(self, record_index: Int64Array, log_ns: Int64Array, rows: Int64Array, stamp_ns: Int64Array) -> None:
        """Add messages in the order of the log; ``stamp_ns`` are the stamps of ``rows``."""
        self.log.take(log_ns)
        self.stamps.take(record_index[rows], log_ns[rows], stamp_ns)
        self.readings.take(record_index[rows], log_ns[rows], stamp_ns)
        new = np.stack((record_index, log_ns))
        times = np.concatenate((self._last, new), axis=1)
        change = np.diff(times[1] // NS_PER_S)
        for at in np.flatnonzero((change < 0) | (change > _LEAP_S))[: MOST_JUMPS - len(self.jumps)].tolist():
            before, behind = times[:, at].tolist(), times[:, at + 1].tolist()
            number = self.log.count - times.shape[1] + at + 1
            self.jumps.append(ClockJump(number, before[0], behind[0], before[1], behind[1]))
        self._last = new[:, -1:]

    @cached_property
    def track(self) -> ReadingSequence:
        """Readings of the stamps, once all were taken."""
        return self.readings.all()

    @cached_property
    def stretches(self) -> list[ClockStretch]:
        """Readings of the stamps, parted where one of the clocks was set."""
        return stretches_of(self.track)

    def line(self, connection: Connection) -> WriteTimes:
        """Return the log times at which the connection was written."""
        return WriteTimes(connection, np.sort(self.log.all()[0]), self.log.stride)


def told(offsets: Offsets, names: Mapping[int, str]) -> str:
    """Describe for people how the clock was set; ``names`` are topics by their numbers."""
    parts = [f"by {size_ns / NS_PER_S:+.3f} s before record {record}" for record, size_ns in offsets.steps()]
    if not parts:
        added_s = int(offsets.added_ns[0]) / NS_PER_S
        return f"the clock of log time was never set: {added_s:+.3f} s are added, by the stamps of messages"
    by = ", ".join(names[number] for number in offsets.by)
    return f"the clock of log time was set {', '.join(parts)}, as the stamps of {by} show: it is moved to go on"


def offsets_of(stamped: Mapping[int, Stamped]) -> Offsets:
    """Return offsets that make log times go on smoothly with the stamps.

    Zero where the clock was set right.

    Parameters
    ----------
    stamped : mapping of connection number to Stamped
    """
    known = {number: one for number, one in stamped.items() if one.track.readings >= FEWEST_READINGS}
    tracks = {number: one.track for number, one in known.items()}
    stretches = {number: one.stretches for number, one in known.items()}
    offsets = offsets_by(stretches, [jump for one in stamped.values() for jump in one.jumps])
    right = [_added_where_right(track, offsets) for track in tracks.values()]
    if sure := [one for one in right if one is not None]:
        _start, added_ns = max(sure)  # where the log time was last right, nothing is added
        return offsets.plus(-added_ns)
    unset_ns = _least_unset(tracks.values(), offsets)
    return offsets.plus(-int(offsets.added_ns[-1]) if unset_ns is None else -unset_ns)


def _added_where_right(track: ReadingSequence, offsets: Offsets) -> tuple[int, int] | None:
    """Return first record and offset of the last stretch of log time that can be right.

    It is plausible and near the stamps.
    """
    for place in range(len(offsets.starts) - 1, -1, -1):
        end = offsets.starts[place + 1] if place + 1 < len(offsets.starts) else np.iinfo(np.int64).max
        within = track.take((track.record_index >= offsets.starts[place]) & (track.record_index < end))
        if len(within) < min(FEWEST_READINGS, len(track)) or np.median(within.receipt_ns) < FIRST_NS:
            continue
        if _is_near(within):
            return int(offsets.starts[place]), int(offsets.added_ns[place])
    return None


def _least_unset(tracks: Iterable[ReadingSequence], offsets: Offsets) -> int | None:
    """Return the least difference between a log time that was never set and dated stamps.

    None where there are none.
    """
    levels = []
    for track in tracks:
        is_date = track.clock_ns >= FIRST_NS
        if (track.receipt_ns < FIRST_NS).all() and is_date.mean() > BELIEVED_SHARE:
            moved = offsets.moved(track.take(is_date))
            levels += [one.level_ns for one in stretches_of(moved)][-1:]
    return min(levels, default=None)


@dataclass(frozen=True, eq=False)
class Lags:
    """Lags of a source's messages: how long after their stamps they were logged.

    Parameters
    ----------
    lag_ns : ndarray of int64
        Of a sample of its messages, by the corrected log time, while the stamps go with it.
    share : float
        Of its messages while they do.
    is_queued : bool
        Messages waited for the recorder: they were logged in bursts while their stamps go on smoothly.
    offsets : Offsets
        Of the log time that they are compared with: none where the stamps are by the recorder's own clock.
    is_stopped : bool
        The log time stands still while the stamps go on: it tells nothing of them.
    """

    lag_ns: Int64Array
    share: float
    is_queued: bool
    offsets: Offsets
    is_stopped: bool = False

    @classmethod
    def of(cls, several: Sequence[Stamped], offsets: Offsets) -> "Lags":
        """Compute the lags of a source from what was seen of its connections."""
        if several and all(map(_is_stopped, several)):
            lag_ns = np.concatenate([cls._of([one], offsets).lag_ns for one in several])
            return cls(lag_ns, 1.0, True, offsets, is_stopped=True)
        moved = cls._of(several, offsets)
        if not offsets.stated or moved.share == 1.0:
            return moved
        own = cls._of(several, Offsets())
        return own if own.share > moved.share else moved

    @classmethod
    def _of(cls, several: Sequence[Stamped], offsets: Offsets) -> "Lags":
        near, far, readings, total = [], [], 0, 0
        for one in several:
            track = one.track
            parted = stretches_of(offsets.moved(track)) if offsets.stated else one.stretches
            stretches = [found for found in parted if _is_near(found.track)]
            record, log_ns, stamp_ns = one.stamps.all()
            late_ns = log_ns + offsets.at(record) - stamp_ns
            is_within = np.zeros(len(record), dtype=bool)
            for found in stretches:
                is_within |= (record >= found.track.record_index[0]) & (record <= found.track.record_index[-1])
            astray = _astray(track, stretches)
            if len(astray):
                is_within &= ~np.isin(record, astray)
            near.append(np.stack((late_ns, log_ns, stamp_ns))[:, is_within])
            far.append(late_ns)
            readings += sum(found.track.readings for found in stretches)
            total += track.readings
        late = np.concatenate(near, axis=1) if near else np.zeros((3, 0), dtype=np.int64)
        if not late.shape[1]:
            return cls(np.concatenate([late[0], *far]), 0.0, False, offsets)
        return cls(late[0], readings / max(total, 1), all(map(_is_queued, near)), offsets)

    @property
    def usual_ns(self) -> int:
        """Median of the lags."""
        return int(np.sort(self.lag_ns)[len(self.lag_ns) // 2]) if len(self.lag_ns) else 0

    @property
    def most_ns(self) -> int:
        """Longest lag that is believed."""
        return round((MOST_QUEUED_S if self.is_queued else LARGEST_LAG_S) * NS_PER_S)

    @property
    def are_good(self) -> bool:
        """Tell whether the stamps are believed."""
        if self.is_stopped or self.share < BELIEVED_SHARE:
            return self.is_stopped
        return bool(self.believed(self.lag_ns).mean() >= USUAL_SHARE)

    def believed(self, lag_ns: Int64Array) -> BoolArray:
        """Tell which stamps are near enough to the log time, shape (n,)."""
        if self.is_stopped:
            return np.ones(len(lag_ns), dtype=bool)
        return (lag_ns >= -_LARGEST_LAG_NS) & (lag_ns <= self.most_ns)

    def may_be_late(self, lag_ns: Int64Array) -> BoolArray:
        """Tell which messages may have waited, if their stamps are in order, shape (n,)."""
        return (lag_ns > 0) & (lag_ns <= round(MOST_QUEUED_S * NS_PER_S))

    def text(self) -> str:
        """Describe the lags: the median and the range."""
        if self.is_stopped:
            return "unknown, log time stands still"
        lags_s = np.sort(self.lag_ns) / NS_PER_S
        low, middle, high = lags_s[0], lags_s[len(lags_s) // 2], lags_s[-1]
        return f"{middle:.3f} s ({low:.3f} to {high:.3f})"


def _is_stopped(one: Stamped) -> bool:
    """Tell whether the log time stands still while stamps that are a date go on."""
    _record, log_ns, stamp_ns = one.stamps.all()
    if len(log_ns) < FEWEST_READINGS or np.ptp(one.log.all()[0]) or stamp_ns.min() < FIRST_NS:
        return False
    return bool((np.diff(stamp_ns) >= 0).all() and np.ptp(stamp_ns) > _LARGEST_LAG_NS)


def _is_near(track: ReadingSequence) -> bool:
    low = np.quantile(track.late_ns, 0.1, method="lower")
    return bool(abs(int(low)) <= _LARGEST_LAG_NS)


def _astray(track: ReadingSequence, stretches: Sequence[ClockStretch]) -> Int64Array:
    """Return the records of readings that are not of the stretches.

    A few readings in a row that did not merely wait are included.
    """
    sound = [track.record_index[:0], *(one.track.record_index for one in stretches)]
    kept = np.concatenate(sound)
    found = [np.setdiff1d(track.record_index, kept) if len(kept) < len(track) else kept[:0]]
    for one in stretches:
        is_far = (one.track.late_ns < -_LARGEST_LAG_NS) | (one.track.late_ns > MOST_QUEUED_S * NS_PER_S)
        edges = np.flatnonzero(np.diff(np.concatenate(([False], is_far, [False]))))
        for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            run = one.track.take(slice(start, end))
            if run.readings < FEWEST_READINGS:
                found.append(run.record_index)
    return np.concatenate(found).astype(np.int64)


def _is_queued(late: Int64Array) -> bool:
    """Tell whether messages waited, by their lags, log times and stamps.

    If they did, the stamps are evener than the log times.
    """
    if not np.any(late[0] > _LARGEST_LAG_NS):
        return True  # none did
    stamp, log = (float(np.mean(np.abs(change - np.median(change)))) for change in np.diff(late[[2, 1]], axis=1))
    return stamp < 0.5 * log
