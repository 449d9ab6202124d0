"""UBX messages of a block: their names, times, and the full times that they state."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.timescales import MOST_LEAP_S
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver import scan
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.messages import Messages
from groundstation.readers.receiver.stream import Frames
from groundstation.readers.receiver.times import (
    NO_ANCHORS,
    Anchors,
    calendar_ns,
    fine_utc_ns,
    gps_to_utc_ns,
)
from groundstation.readers.receiver.ubx_messages import is_version, layout_of, name_of

HEADER_BYTES = 6
FIRST_WEEK, LAST_WEEK = 1_000, 4_000  # 1999 to 2056: other numbers are no date of a log
S_PER_WEEK = 604_800.0
_SECONDS = {"NAV-PVT": "second", "NAV-PVAT": "sec", "NAV-TIMEUTC": "sec", "HNR-PVT": "second"}
_SECONDS |= {f"NAV2-{name[4:]}": second for name, second in _SECONDS.items() if name.startswith("NAV-")}
# Message -> the field with its flags, and the bits that call the week and its time valid.
_WEEKS = {"NAV-TIMEGPS": ("valid", 3), "NAV2-TIMEGPS": ("valid", 3), "NAV-SOL": ("flags", 12)}
# Message -> the fields with the leap seconds and with its flags, and the bit that calls them valid.
_LEAPS = {
    "NAV-TIMEGPS": ("leapS", "valid", 4),
    "NAV-TIMELS": ("currLs", "valid", 1),
    "RXM-RAWX": ("leapS", "recStat", 1),
}
_LEAPS |= {f"NAV2-{name[4:]}": told for name, told in _LEAPS.items() if name.startswith("NAV-")}
_CLASSES = {"NAV": 0x01, "NAV2": 0x29, "HNR": 0x28}
_ITOW_AT_4 = (0x14, 0x13, 0x3C, 0x3B)  # HPPOSLLH, HPPOSECEF, RELPOSNED, SVIN have a version in front
_HNR_INS = 0x02  # message of the class HNR whose time stands elsewhere


def messages_of(frames: Frames) -> Iterator[Messages]:
    """Yield UBX messages of a block by name; short ones apart, by their length."""
    which = frames.of(scan.UBX)
    at = frames.offsets[which]
    code = frames.data[at + 2].astype(np.int64) * 256 + frames.data[at + 3]
    sizes = frames.lengths[which] - scan.UBX_EXTRA
    for number in np.unique(code).tolist():
        of_code = np.flatnonzero(code == number)
        for size in np.unique(sizes[of_code]).tolist():
            name = name_of(number, size)
            text = layout_of(name)
            known = layout(text) if text else None
            is_open = known is None or size >= known.size
            rows = of_code[sizes[of_code] >= size] if is_open else of_code[sizes[of_code] == size]
            places, payload_at = frames.places[which[rows]], at[rows] + HEADER_BYTES
            is_sound = known is None or size >= known.needed or is_version(name, size)
            yield Messages(name, frames, places, payload_at, sizes[rows], known, is_sound)
            if is_open:
                break


def time_of(messages: Messages, anchors: Anchors) -> Column:
    """Return the UTC of each message; absent for messages without a time."""
    if messages.has("iTOW"):
        return anchors.of_week(messages.places, messages.head()["iTOW"].astype(np.int64))
    if messages.has("rcvTow") and messages.has("week"):
        head = messages.head()
        sound = _is_gps_time(head["week"], head["rcvTow"])
        utc_ns = gps_to_utc_ns(np.where(sound, head["week"], 0), np.where(sound, head["rcvTow"], 0.0))
        own_week = Column(np.where(sound, utc_ns, 0), None if sound.all() else sound)
        return anchors.in_their_week(messages.places, own_week)
    return Column(np.zeros(len(messages), dtype=np.int64), np.zeros(len(messages), dtype=bool))


def timed(frames: Frames, anchors: Anchors) -> list[tuple[Messages, Column]]:
    """Return the messages of a block with their times.

    A message without a time has that of the message with a time before it.
    """
    several = [(messages, time_of(messages, anchors)) for messages in messages_of(frames)]
    known = [(messages.places[time.mask], time.values[time.mask]) for messages, time in several]
    if not known:
        return several
    places, utc_ns = (np.concatenate(parts) for parts in zip(*known, strict=True))
    order = np.argsort(places, kind="stable")
    places, utc_ns = places[order], utc_ns[order]
    return [(messages, _filled(messages, time, places, utc_ns)) for messages, time in several]


def _filled(messages: Messages, time: Column, places: Int64Array, utc_ns: Int64Array) -> Column:
    if time.mask.any() or not len(places):  # a message that tells its time is not given another
        return time
    at = np.searchsorted(places, messages.places) - 1
    return Column(np.where(at >= 0, utc_ns[np.maximum(at, 0)], 0), at >= 0)


def _is_gps_time(week: NDArray[Any], week_s: NDArray[Any]) -> BoolArray:
    return np.asarray((week >= FIRST_WEEK) & (week < LAST_WEEK) & (week_s >= 0.0) & (week_s < S_PER_WEEK))


@dataclass
class FullTimes:
    """Collector of the full times that the messages of a stream state.

    ``wrong_leaps`` counts the fixes whose UTC had another number of leap seconds than the day has, by the difference;
    ``leaps`` the messages that state their number.
    """

    _places: list[Int64Array] = field(default_factory=list)
    _utc_ns: list[Int64Array] = field(default_factory=list)
    _week_ms: list[Int64Array] = field(default_factory=list)
    wrong_leaps: dict[int, int] = field(default_factory=dict)
    leaps: Counter[int] = field(default_factory=Counter)

    def take(self, messages: Messages) -> None:
        """Take in messages that may state the full time."""
        head = messages.head() if messages.layout is not None and len(messages) and messages.has("iTOW") else None
        if messages.name in _SECONDS and head is not None:
            self._of_calendar(messages, head)
        elif messages.name in _WEEKS and head is not None:
            self._of_week(messages, head)
        elif messages.name == "RXM-RAWX" and messages.has("rcvTow"):
            self.take_time(messages.places, time_of(messages, NO_ANCHORS))
        self._note_leaps(messages)

    def _note_leaps(self, messages: Messages) -> None:
        """Count the leap seconds that messages state, where they call them valid."""
        if messages.name not in _LEAPS or not messages.has(_LEAPS[messages.name][0]):
            return
        number, flags, bit = _LEAPS[messages.name]
        head = messages.head()
        told, counts = np.unique(head[number][(head[flags] & bit) != 0], return_counts=True)
        self.leaps.update(dict(zip(told.tolist(), counts.tolist(), strict=True)))

    def note_utc_offset(self, messages: Messages) -> None:
        """Count the leap seconds that TIME of NovAtel states, where it knows UTC."""
        if messages.name == "TIME" and messages.layout is not None and messages.size >= messages.layout.size:
            head = messages.head()
            known = (head["utc_status"] > 0) & (np.abs(head["utc_offset"]) <= MOST_LEAP_S)
            self.leaps.update((-np.rint(head["utc_offset"][known])).astype(np.int64).tolist())

    def take_time(self, places: Int64Array, time: Column) -> None:
        """Take in messages that each state their full time."""
        self._add(places, time.values, np.full(len(places), -1), time.mask)

    def anchors(self) -> Anchors:
        """Return the gathered anchors, in the order of the file."""
        if not self._places:
            return NO_ANCHORS
        places, utc_ns, week_ms = (np.concatenate(parts) for parts in (self._places, self._utc_ns, self._week_ms))
        order = np.argsort(places, kind="stable")
        return Anchors(places[order], utc_ns[order], week_ms[order])

    def _add(self, places: Int64Array, utc_ns: Int64Array, week_ms: Int64Array, sound: BoolArray) -> None:
        if sound.any():
            self._places.append(places[sound])
            self._utc_ns.append(utc_ns[sound])
            self._week_ms.append(week_ms[sound])

    def _of_week(self, messages: Messages, head: NDArray[Any]) -> None:
        week_ms = head["iTOW"].astype(np.int64)
        flags, bits = _WEEKS[messages.name]
        sound = (head[flags] & bits == bits) & _is_gps_time(head["week"], week_ms / 1e3)
        sound &= np.abs(head["fTOW"]) <= 500_000
        utc_ns = gps_to_utc_ns(np.where(sound, head["week"], 0), np.where(sound, week_ms, 0) / 1e3) + head["fTOW"]
        self._add(messages.places, utc_ns, week_ms, np.asarray(sound))

    def _of_calendar(self, messages: Messages, head: NDArray[Any]) -> None:
        """Take in dates and times of fixes that are called valid.

        Nanoseconds may be negative: they are added.
        """
        year, month, day = (head[name].astype(np.int64) for name in ("year", "month", "day"))
        midnight_ns, sound = calendar_ns(year, month, day)
        needed = 7 if messages.name.endswith("TIMEUTC") else 3
        sound = sound & (head["valid"] & needed == needed) & (np.abs(head["nano"]) <= NS_PER_S)
        second_s = (head["hour"].astype(np.int64) * 60 + head["min"]) * 60 + head[_SECONDS[messages.name]]
        week_ms = head["iTOW"].astype(np.int64)
        sound &= (second_s <= 86_400) & (week_ms < 604_800_000)
        told_ns = np.where(sound, midnight_ns + second_s * NS_PER_S + head["nano"], 0)
        utc_ns, wrong_s = fine_utc_ns(told_ns, np.where(sound, week_ms, 0))
        sound &= np.abs(wrong_s) <= 60
        for wrong, count in zip(*np.unique(wrong_s[sound], return_counts=True), strict=True):
            if wrong:
                self.wrong_leaps[int(wrong)] = self.wrong_leaps.get(int(wrong), 0) + int(count)
        self._add(messages.places, utc_ns, week_ms, sound)


def epoch_start(frames: Frames, leader: str) -> int:
    """Return the number of the first message of the last epoch in a block.

    ``len(frames)`` where there is none. Messages of the class of the leading one count: the others of its epoch stand
    beside it.
    """
    which = frames.of(scan.UBX)
    at = frames.offsets[which]
    family = leader.partition("-")[0]
    counts = (frames.data[at + 2] == _CLASSES[family]) & (frames.lengths[which] >= scan.UBX_EXTRA + 8)
    if family == "HNR":
        counts &= frames.data[at + 3] != _HNR_INS
    which, at = which[counts], at[counts]
    if not len(which):
        return len(frames)
    shift = np.where(np.isin(frames.data[at + 3], _ITOW_AT_4), 4, 0)
    week_ms = frames.bytes_at(at + HEADER_BYTES + shift, 4).copy().view("<u4")[:, 0]
    earlier = np.flatnonzero(week_ms != week_ms[-1])
    return int(which[earlier[-1] + 1]) if len(earlier) else int(which[0])
