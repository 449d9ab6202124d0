"""Vehicle's clock in a telemetry log: times of validity, though frames arrive late.

Frames also arrive in bursts. Most messages state the time since the sender was switched on (``time_boot_ms``,
``time_usec``), or since 1970. Receipt less clock is never below the offset between the two: its lower envelope places
the clock on the time of receipt. SYSTEM_TIME states UTC. A message without a time is placed by those that its system
sent before and behind it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.clock_offsets import ClockJump, Offsets, offsets_by
from groundstation.readers.tlog.dialect import DialectMessage, messages
from groundstation.readers.tlog.frames import FrameBlock
from groundstation.readers.two_clocks import (
    FEWEST_READINGS,
    ClockReadings,
    ClockStretch,
    ReadingSequence,
    ReceiptLine,
    lower_line,
    stretches_of,
)

Key: TypeAlias = tuple[int, int, bool]  # sender, number of message, and whether its times count from 1970
NS_PER_MS, NS_PER_US = 1_000_000, 1_000
SINCE_1970_US = 10**15  # a larger time_usec counts from 1970, a smaller one from when the sender was switched on
_LAST_US = 4_102_444_800 * 10**6  # 2100
RECEIPT_STEP_S = 10.0  # least step of the ground station's clock ahead: a link may stay late by less
LEAST_PACE = 0.1  # least pace of a clock against the time of receipt
SHARE_STEPS = 512
MOST_SHARE = 0.5  # least share of a message's frames whose times go with its sender's clock
OFF_S = 5.0  # largest difference between the times of a message and its sender's clock
ROLLOVER_S, DAY_S = 1_024 * 604_800, 86_400
MOST_JUMPS = 1_000
_WRAP_MS, _EDGE_MS = 1 << 32, 3_600_000  # time_boot_ms starts again after 49.7 days; distance that counts as near to it
_UTC_READINGS = 20
# Messages whose times are read for the clock of their sender, the best first; any others where it sends none of them.
_STEADY = (
    *("ATTITUDE", "ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT", "RAW_IMU", "HIGHRES_IMU", "SCALED_IMU"),
    *("SCALED_PRESSURE", "SYSTEM_TIME", "GPS_RAW_INT", "GPS2_RAW"),
)


@dataclass(frozen=True)
class TimeField:
    """Field of a message with its time, and how to read it."""

    name: str
    unit_ns: int
    is_short: bool

    @classmethod
    def of(cls, message: DialectMessage) -> "TimeField | None":
        """Return the time field of a message, None without one."""
        units = {"time_boot_ms": NS_PER_MS, "time_boot_us": NS_PER_US, "time_usec": NS_PER_US}
        for name, unit_ns in units.items():
            if message.dtype.fields is not None and name in message.dtype.fields:
                return cls(name, unit_ns, message.dtype.fields[name][0].itemsize < 8)
        return None


@cache
def time_fields() -> Mapping[int, TimeField]:
    """Return the time fields by number of message."""
    found = {number: TimeField.of(message) for number, message in messages().items()}
    return {number: one for number, one in found.items() if one is not None}


@cache
def _steady() -> frozenset[int]:
    return frozenset(number for number, message in messages().items() if message.name in _STEADY)


@dataclass
class _Unwrapped:
    """Counter that goes on where a number of 32 bits starts again."""

    wraps: int = 0
    last: int | None = None

    def take(self, values_ms: Int64Array) -> Int64Array:
        """Take in values in the order of the log and return them counted on."""
        before = np.concatenate(([values_ms[0] if self.last is None else self.last], values_ms[:-1]))
        is_end, is_start = before > _WRAP_MS - _EDGE_MS, before < _EDGE_MS
        ahead = is_end & (values_ms < _EDGE_MS)
        back = is_start & (values_ms > _WRAP_MS - _EDGE_MS)  # a late one of before
        wraps = self.wraps + np.cumsum(ahead.astype(np.int64) - back)
        self.wraps, self.last = int(wraps[-1]), int(values_ms[-1])
        return np.asarray(values_ms + np.maximum(wraps, 0) * _WRAP_MS)


@dataclass
class TimeReader:
    """Reader of the times in frames of one message of one sender."""

    number: int
    unwrapped: _Unwrapped = field(default_factory=_Unwrapped)

    def read(self, block: FrameBlock, which: Int64Array) -> tuple[Int64Array, BoolArray]:
        """Return times in nanoseconds, and which of them count from 1970; shape (n,) each.

        A time is -1 where there is none.
        """
        one = time_fields()[self.number]
        numbers = block.rows(which, messages()[self.number])[one.name]
        if one.unit_ns == NS_PER_MS:
            return self.unwrapped.take(numbers.astype(np.int64)) * NS_PER_MS, np.zeros(len(which), dtype=bool)
        good = numbers < np.uint64(_LAST_US)
        time_us = np.where(good, numbers, 0).astype(np.int64)
        return np.where(good, time_us * one.unit_ns, -1), time_us >= SINCE_1970_US


@dataclass(frozen=True, eq=False)
class Epoch:
    """Sender's clock from one start to the next: the offset from its times to UTC.

    ``line`` places it on the time of receipt; ``utc_ns`` is by the sender itself, None where it does not tell.
    """

    first: int
    line: ReceiptLine
    utc_ns: int | None

    def utc_of(self, clock_ns: Int64Array, ground_ns: int) -> Int64Array:
        """Return UTC of times of the clock; ``ground_ns`` is the ground station's error."""
        if self.utc_ns is not None:
            return np.asarray(clock_ns + self.utc_ns)
        return np.asarray(clock_ns + self.line.at(clock_ns) + ground_ns)


@dataclass(frozen=True, eq=False)
class SenderClock:
    """Clock of one sender (system x 256 + component).

    Parameters
    ----------
    reference : int
        Number of the message that is read for it.
    trusted : frozenset of int
        Numbers of the messages whose times are by it.
    epochs : tuple of Epoch
    counts_from_1970 : bool
        Its times are UTC by themselves.
    unix_ns : int or None
        UTC less its times, for messages that count from 1970; None where nothing tells it.
    """

    reference: int
    trusted: frozenset[int]
    epochs: tuple[Epoch, ...]
    counts_from_1970: bool
    unix_ns: int | None

    def epoch_of(self, record_index: Int64Array) -> Int64Array:
        """Return the number of the epoch of records."""
        starts = [epoch.first for epoch in self.epochs[1:]]
        return np.asarray(np.searchsorted(np.array(starts, dtype=np.int64), record_index, side="right"))

    def utc_of(self, record_index: Int64Array, clock_ns: Int64Array, ground_ns: int) -> Int64Array:
        """UTC of the times in records."""
        if len(self.epochs) == 1:
            return self.epochs[0].utc_of(clock_ns, ground_ns)
        found = np.zeros(len(clock_ns), dtype=np.int64)
        of = self.epoch_of(record_index)
        for place in np.unique(of).tolist():
            rows = of == place
            found[rows] = self.epochs[place].utc_of(clock_ns[rows], ground_ns)
        return found

    def late_ns(self, record_index: Int64Array, received_ns: Int64Array, clock_ns: Int64Array) -> Int64Array:
        """Return how late records arrived, by the ground station's clock."""
        found = received_ns - clock_ns
        if len(self.epochs) == 1:
            return np.asarray(found - self.epochs[0].line.at(clock_ns))
        of = self.epoch_of(record_index)
        for place in np.unique(of).tolist():
            rows = of == place
            found[rows] -= self.epochs[place].line.at(clock_ns[rows])
        return np.asarray(found)

    def lateness(self, track: ReadingSequence, since_1970: bool) -> "Lateness":
        """Return how late the readings of a message arrived.

        Only those whose relation to the clock is known.
        """
        own_ns = self.by_its_clock(track.clock_ns, np.full(len(track), since_1970))
        known = track.take(own_ns >= 0)
        late_ns = self.late_ns(known.record_index, known.receipt_ns, own_ns[own_ns >= 0])
        return Lateness(known.record_index, known.number, late_ns)

    def by_its_clock(self, time_ns: Int64Array, since_1970: BoolArray) -> Int64Array:
        """Return times of messages by this clock, -1 where the relation is unknown."""
        if not since_1970.any() and not self.counts_from_1970:
            return time_ns
        if self.counts_from_1970:
            return np.where(since_1970, time_ns, -1)
        if self.unix_ns is None:
            return np.where(since_1970, -1, time_ns)
        return np.where(since_1970, time_ns - self.unix_ns, time_ns)


@dataclass(frozen=True, eq=False)
class TlogClocks:
    """Clocks of all senders of a log.

    Parameters
    ----------
    senders : mapping of int to SenderClock
    offsets : Offsets
        How times of receipt are moved: where the ground station's clock was set, and to UTC.
    ground_ns : int
        What is added to the ground station's clock, as it was at the end, to have UTC.
    """

    senders: Mapping[int, SenderClock]
    offsets: Offsets
    ground_ns: int


class ClockSurvey:
    """Collector of readings of all clocks from the frames of a log."""

    def __init__(self) -> None:
        self._readers: dict[tuple[int, int], TimeReader] = {}
        self._readings: dict[Key, ClockReadings] = {}
        self._utc: dict[int, ClockReadings] = {}
        self._jumps: list[ClockJump] = []
        self._last: tuple[int, int] | None = None

    def take(self, block: FrameBlock) -> None:
        """Take in the readings of a block."""
        received = block.received
        self._note_jumps(block.record_index, received)
        for sender, groups in block.by_sender():
            timed = [(number, which) for number, which in groups if number in time_fields()]
            steady = [(number, which) for number, which in timed if number in _steady()]
            for number, which in steady or timed:
                self._take(block, sender, number, which if received.present is None else which[received.mask[which]])

    def _take(self, block: FrameBlock, sender: int, number: int, which: Int64Array) -> None:
        one = time_fields()[number]
        if (one.is_short and one.unit_ns == NS_PER_US) or not len(which):
            return
        reader = self._readers.setdefault((sender, number), TimeReader(number))
        time_ns, since_1970 = reader.read(block, which)
        for of_1970 in (False, True):
            good = (since_1970 == of_1970) & (time_ns >= 0)
            if good.any():
                own = which if good.all() else which[good]
                readings = self._readings.setdefault((sender, number, of_1970), ClockReadings())
                readings.take(block.record_index[own], block.received.values[own], time_ns[good])
        if messages()[number].name == "SYSTEM_TIME":
            self._take_utc(block, sender, number, which, time_ns)

    def _take_utc(self, block: FrameBlock, sender: int, number: int, which: Int64Array, boot_ns: Int64Array) -> None:
        unix_us = block.rows(which, messages()[number])["time_unix_usec"]
        good = (unix_us >= np.uint64(SINCE_1970_US)) & (unix_us < np.uint64(_LAST_US)) & (boot_ns > 0)
        unix_ns = np.where(good, unix_us, 0).astype(np.int64) * NS_PER_US
        utc = self._utc.setdefault(sender, ClockReadings())
        utc.take(block.record_index[which[good]], unix_ns[good], boot_ns[good])

    def _note_jumps(self, index: Int64Array, received: Column) -> None:
        time_ns = received.values
        if received.present is not None:
            index, time_ns = index[received.present], time_ns[received.present]
        if not len(index):
            return
        if self._last is not None:
            index, time_ns = np.append(self._last[0], index), np.append(self._last[1], time_ns)
        changes = np.diff(time_ns)
        odd = np.flatnonzero((changes < -NS_PER_S) | (changes > RECEIPT_STEP_S * NS_PER_S))
        for at in odd[: MOST_JUMPS - len(self._jumps)].tolist():
            records, times = index[at : at + 2].tolist(), time_ns[at : at + 2].tolist()
            self._jumps.append(ClockJump(records[1], *records, *times))
        self._last = int(index[-1]), int(time_ns[-1])

    def clocks(self, vehicle: int) -> TlogClocks:
        """Return the clocks that were found."""
        tracks = {key: readings.all() for key, readings in self._readings.items()}
        parted: dict[int, list[ClockStretch]] = {}
        found: dict[int, Key] = {}
        for sender in sorted({key[0] for key in tracks}):
            for key in self._ranked(sender, tracks):
                stretches = stretches_of(tracks[key], receipt_step_s=RECEIPT_STEP_S)
                if _pace(stretches) > LEAST_PACE:
                    found[sender], parted[sender] = key, stretches
                    break
        offsets = offsets_by(parted, self._jumps)
        offsets = offsets.plus(-int(offsets.added_ns[-1]))  # the clock is right that stood last
        if offsets.stated:
            moved = {sender: offsets.moved(tracks[key]) for sender, key in found.items()}
            parted = {sender: stretches_of(track, receipt_step_s=RECEIPT_STEP_S) for sender, track in moved.items()}
        senders = {sender: self._clock_of(key, parted[sender], tracks, offsets) for sender, key in found.items()}
        by = {sender: tracks[key] for sender, key in found.items()}
        ground_ns = _ground_ns(senders, by, vehicle)
        return TlogClocks(senders, offsets.plus(ground_ns), ground_ns)

    def _ranked(self, sender: int, tracks: Mapping[Key, ReadingSequence]) -> list[Key]:
        """Rank the messages that may serve as the clock of a sender, the best first."""
        known = messages()
        places = {name: place for place, name in enumerate(_STEADY)}

        def rank(key: Key) -> tuple[bool, bool, int, int, int]:
            few = tracks[key].readings < FEWEST_READINGS
            return few, key[2], places.get(known[key[1]].name, len(places)), -tracks[key].readings, key[1]

        return sorted((key for key in tracks if key[0] == sender), key=rank)

    def _clock_of(
        self, key: Key, stretches: Sequence[ClockStretch], tracks: Mapping[Key, ReadingSequence], offsets: Offsets
    ) -> SenderClock:
        sender, number, of_1970 = key
        lines = [lower_line(one.track) for one in stretches]
        utc = self._utc[sender].all() if sender in self._utc and not of_1970 else None
        ends = [int(one.track.record_index[0]) for one in stretches[1:]]
        epochs = tuple(
            Epoch(first, line, 0 if of_1970 else _utc_within(utc, first, end, line))
            for first, end, line in zip([0, *ends], [*ends, 1 << 62], lines, strict=True)
        )
        own = {other: offsets.moved(track) for other, track in tracks.items() if other[0] == sender}
        unix_ns = next((epoch.utc_ns for epoch in reversed(epochs) if epoch.utc_ns is not None), None)
        if unix_ns is None and not of_1970 and (levels := [_level(track) for other, track in own.items() if other[2]]):
            unix_ns = lines[-1].offset_ns - min(levels)
            epochs = (*epochs[:-1], replace(epochs[-1], utc_ns=unix_ns))
        clock = SenderClock(number, frozenset(), epochs, of_1970, unix_ns)
        late = {other: clock.lateness(track, other[2]) for other, track in own.items()}
        trusted = [other for other in late if _go_together(late[key], late[other])]
        unread = time_fields().keys() - {other[1] for other in own}  # each frame of these is judged by itself
        return replace(clock, trusted=frozenset({other[1] for other in trusted} | unread))


class Lateness(NamedTuple):
    """Lateness of some records, and their places among all of their message; shape (n,) each."""

    record_index: Int64Array
    number: Int64Array
    late_ns: Int64Array


def _pace(stretches: Sequence[ClockStretch]) -> float:
    """Return the pace of a clock: its time over time of receipt."""
    clock = sum(int(np.ptp(one.track.clock_ns)) for one in stretches)
    receipt = sum(int(np.ptp(one.track.receipt_ns)) for one in stretches)
    return clock / receipt if receipt else float(clock > 0)


def _level(track: ReadingSequence) -> int:
    """Return the least difference of receipt and clock in the last stretch of readings."""
    return stretches_of(track, receipt_step_s=RECEIPT_STEP_S)[-1].level_ns


def _go_together(reference: Lateness, other: Lateness) -> bool:
    """Tell whether the times of a message are by the clock of its sender.

    They are when they are mostly as late as those that are read for it.
    """
    if len(other.late_ns) == 0:
        return False
    off_ns = other.late_ns - np.interp(other.record_index, reference.record_index, reference.late_ns)
    evenly = np.linspace(other.number[0], other.number[-1], SHARE_STEPS)  # the readings kept are not evenly spread
    return bool(np.mean(np.abs(np.interp(evenly, other.number, off_ns)) <= OFF_S * NS_PER_S) >= MOST_SHARE)


def _utc_within(utc: ReadingSequence | None, first: int, end: int, line: ReceiptLine) -> int | None:
    """Return UTC less the clock by SYSTEM_TIME between two records: its last level.

    None where SYSTEM_TIME does not tell.
    """
    if utc is None:
        return None
    within = utc.take((utc.record_index >= first) & (utc.record_index < end))
    if not len(within):
        return None
    utc_ns = int(np.sort(within.late_ns[-_UTC_READINGS:])[len(within.late_ns[-_UTC_READINGS:]) // 2])
    away_s = (line.offset_ns - utc_ns) / NS_PER_S
    weeks = round(away_s / ROLLOVER_S)
    return None if weeks and abs(away_s - weeks * ROLLOVER_S) < DAY_S else utc_ns  # its receiver counts other weeks


def _ground_ns(senders: Mapping[int, SenderClock], by: Mapping[int, ReadingSequence], vehicle: int) -> int:
    """Return what must be added to the ground station's clock to get UTC.

    It follows from the vehicle, or another sender that states UTC.
    """
    for sender in sorted(senders, key=lambda sender: (sender != vehicle, sender)):
        for epoch in reversed(senders[sender].epochs):
            if epoch.utc_ns is not None:
                within = by[sender].take(by[sender].record_index >= epoch.first)
                clock_ns = within.clock_ns[-1:] if len(within) else by[sender].clock_ns[-1:]
                return epoch.utc_ns - int(epoch.line.at(clock_ns)[0])
    return 0
