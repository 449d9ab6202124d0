"""Full times of a stream on the date that is known, and remarks on them."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field, replace

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Remark
from groundstation.base.timescales import ROLLOVER_NS, iso_to_utc_ns, leap_seconds_at, utc_ns_to_iso
from groundstation.base.words import counted
from groundstation.readers.receiver.times import DAY_NS, Anchors, late_stretches, moved_on, on_one_date
from groundstation.readers.rollover import Earliest, OtherDate, rollovers

_UNSET_NS = iso_to_utc_ns("1980-01-08T00:00:00Z")[0]  # a time before it is of a clock that was not set
# Leap seconds in sentences of makers: PUBX,04 of u-blox (D: the firmware's default), PGRMF of Garmin.
_LEAP_SECONDS = re.compile(rb"\$(?:PUBX,04(?:,[^,*\r\n]*){4}|PGRMF(?:,[^,*\r\n]*){4}),(\d\d)D?,")
# Hardware of u-blox by its number -> the year in which it came. Source: u-blox, product announcements.
_HARDWARE: Mapping[str, int] = {"00070000": 2012, "00080000": 2013, "00190000": 2018, "000A0000": 2020}
_NEWEST_NS = iso_to_utc_ns(f"{max(_HARDWARE.values()) + 1}-01-01T00:00:00Z")[0]
_IN_TEXT = re.compile(rb"HW UBX[^\r\n*]{0,24}?(000[0-9A]0000|00190000)")


@dataclass
class DateFacts:
    """Times and facts of a stream that show its date.

    Parameters
    ----------
    of_week, of_day : Anchors
        Full times by GPS week or by the calendar of binary messages, and by sentences.
    leaps : Counter of int
        Leap seconds that binary messages state, and how often.
    wrong_leaps : mapping of int to int
        Fixes whose UTC had another number of leap seconds than the day told, by the seconds it was late.
    head : bytes
        Beginning of the stream.
    hardware : str
        The receiver's own word on its hardware; empty where it is silent.
    """

    of_week: Anchors
    of_day: Anchors
    leaps: Counter[int] = field(default_factory=Counter)
    wrong_leaps: Mapping[int, int] = field(default_factory=dict)
    head: bytes = b""
    hardware: str = ""


@dataclass(frozen=True)
class Dated:
    """Full times to be used, and remarks."""

    anchors: Anchors
    remarks: tuple[Remark, ...] = ()


def dated(told: DateFacts) -> Dated:
    """Put the full times of a stream on one date: of its messages, else of its sentences."""
    of_week, weeks = on_one_date(_set(told.of_week), is_gps_time=True)
    of_day, days = on_one_date(_set(told.of_day), is_gps_time=False)
    late = late_stretches(of_day)
    remarks = [*_of_another_date("messages", weeks), *_of_another_date("sentences", days)]
    remarks += [
        Remark("leap_seconds", f"sentences told UTC {one.late_s} s late, until the leap seconds were learnt: put right")
        for one in late
    ]
    is_gps_time = bool(len(of_week))
    anchors, other = (of_week, of_day) if is_gps_time else (of_day, of_week)
    if not len(anchors):
        return Dated(anchors, tuple(remarks))
    last_ns = int(anchors.utc_ns[-1])
    is_old = last_ns < _NEWEST_NS  # nothing that a stream states can contradict a newer date
    leap_s, earliest = (_leap_seconds(told, last_ns), _earliest(told)) if is_old else (None, None)
    found = rollovers(last_ns, leap_s=leap_s, earliest=earliest, others=_others(other))
    remarks += found.remarks
    if not found.count:
        remarks += [*_wrong_leaps(told.wrong_leaps), *_apart(of_week, of_day)]
    anchors = moved_on(anchors, found.count, is_gps_time=is_gps_time)
    return Dated(replace(anchors, late=late), tuple(remarks))


def _set(anchors: Anchors) -> Anchors:
    """Drop anchors of a clock that was not set, if any clock was."""
    is_set = anchors.utc_ns >= _UNSET_NS
    if is_set.all() or not is_set.any():
        return anchors
    return Anchors(anchors.places[is_set], anchors.utc_ns[is_set], anchors.week_ms[is_set])


def _leap_seconds(told: DateFacts, last_ns: int) -> int | None:
    """Leap seconds that a stream states most often, or its UTC and time of week differ by."""
    leaps = Counter(told.leaps)
    leaps.update(int(text) for text in _LEAP_SECONDS.findall(told.head))
    for late_s, count in told.wrong_leaps.items():
        leaps[leap_seconds_at(last_ns) - late_s] += count
    return max(leaps, key=lambda leap_s: (leaps[leap_s], leap_s), default=None)


def _earliest(told: DateFacts) -> Earliest | None:
    """The year of the receiver's hardware, where it is told."""
    in_text = _IN_TEXT.search(told.head)
    number = told.hardware or (in_text[1].decode("ascii") if in_text else "")
    return Earliest(_HARDWARE[number], f"the receiver's hardware ({number})") if number in _HARDWARE else None


def _others(anchors: Anchors) -> tuple[OtherDate, ...]:
    return (OtherDate("the other protocol of the stream", int(anchors.utc_ns[-1])),) if len(anchors) else ()


def _of_another_date(name: str, others: tuple[tuple[int, int], ...]) -> Iterator[Remark]:
    for count, days in others:
        weeks, rest = divmod(days, 7)
        away = f"{days} day" if rest else f"{weeks} week"
        away += "s" if (days if rest else weeks) > 1 else ""
        text = f"{count} {name} told a date {away} before that of the others: the date was not known yet; put right"
        yield Remark("week_number", text)


def _wrong_leaps(wrong_leaps: Mapping[int, int]) -> Iterator[Remark]:
    for wrong_s, count in sorted(wrong_leaps.items()):
        text = (
            f"{counted(count, 'fix', 'fixes')} told UTC {abs(wrong_s)} s {'late' if wrong_s > 0 else 'early'}, "
            "as a receiver does before "
            "its first almanac: their times are GPS time less the leap seconds of the day"
        )
        yield Remark("leap_seconds", text)


def _apart(of_week: Anchors, of_day: Anchors) -> Iterator[Remark]:
    """Yield a remark that binary messages and sentences state different days."""
    if not len(of_week) or not len(of_day):
        return
    by_week_ns, by_day_ns = int(of_week.utc_ns[-1]), int(of_day.utc_ns[-1])
    if abs(by_day_ns - by_week_ns) > DAY_NS:
        text = (
            f"sentences tell {utc_ns_to_iso(by_day_ns, 0)}, binary messages {utc_ns_to_iso(by_week_ns, 0)}: "
            "the binary ones are believed"
        )
        if by_week_ns - by_day_ns > ROLLOVER_NS - DAY_NS:
            text += " (the GPS week rolled over)"
        yield Remark("date_disagrees", text)
