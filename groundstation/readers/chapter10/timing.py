"""UTC of the relative time counter, by the time packets.

Where these have no year, it comes from elsewhere.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import UTC, date, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, Remark, UtcReadings
from groundstation.base.timescales import leap_seconds_at, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.readers.chapter10.tmats import YEARS, Tmats
from groundstation.readers.rollover import OtherDate, rollovers
from groundstation.readers.start import zero_of_readings

NS_PER_DAY = 86_400 * NS_PER_S
_GPS_NATIVE, _NONE = 5, 15
_RESTART_NS = -NS_PER_S  # step of the counter where recordings are joined end to end
_SPREAD_NS = 500_000_000  # readings that differ by more are of a clock that was set
_TMATS_DAYS = 40.0
_LABEL_260 = 0x0D  # octal 260 as it stands in a word, its first bit last


@dataclass(frozen=True)
class Reading:
    """Time that a time packet states.

    Parameters
    ----------
    channel : int
    device_ns : int
        The counter when it was true.
    year : int or None
        None where the packet has the day of the year alone.
    day : int
        Of the year, 1 to 366.
    time_of_day_ns : int
    is_gps : bool
        GPS time, not UTC.
    place : int
        Byte of the file at which the packet begins.
    """

    channel: int
    device_ns: int
    year: int | None
    day: int
    time_of_day_ns: int
    is_gps: bool = False
    place: int = 0


def reading(channel: int, device_ns: int, specific_word: int, body: bytes) -> Reading | None:
    """Read a time packet of format 1; None where it states no time.

    Source: IRIG 106-22 Chapter 11, 11.2.3.2; binary coded decimals, hundredths of a second first.

    Examples
    --------
    >>> found = reading(1, 0, 0x10, bytes.fromhex("0012471643030000"))
    >>> found.day, found.time_of_day_ns / 3.6e12
    (343, 16.786666666666665)
    """
    source, form, has_date = specific_word & 15, specific_word >> 4 & 15, bool(specific_word & 0x200)
    if _NONE in (source, form) or len(body) < (8 if has_date else 6):
        return None
    digits = [body[at] >> shift & 15 for at in range(8 if len(body) >= 8 else 6) for shift in (0, 4)]
    if max(digits[:8]) > 9 or max(digits[8:10]) > 9:
        return None
    hundredths = digits[0] + 10 * digits[1]
    second, minute, hour = digits[2] + 10 * digits[3], digits[4] + 10 * digits[5], digits[6] + 10 * digits[7]
    if second > 60 or minute > 59 or hour > 23:
        return None
    time_ns = (hour * 3600 + minute * 60 + second) * NS_PER_S + hundredths * 10_000_000
    day, year = digits[8] + 10 * digits[9] + 100 * (digits[10] & 3), None
    if has_date:
        month = digits[10] + 10 * (digits[11] & 1)
        year = digits[12] + 10 * digits[13] + 100 * digits[14] + 1000 * (digits[15] & 3)
        try:
            day = date(year, month, digits[8] + 10 * digits[9]).timetuple().tm_yday
        except ValueError:
            return None
    if not 1 <= day <= 366 or (year is not None and year not in YEARS):
        return None
    return Reading(channel, device_ns, year, day, time_ns, form == _GPS_NATIVE)


def dates_in(words: NDArray[np.uint32]) -> Counter[date]:
    """Return the dates of ARINC-429 words with label 260, and how often each occurs.

    The year is of this century.

    Source: ARINC 429, part 1: day in bits 24 to 29, month in 19 to 23, year in 11 to 18, binary coded decimals.
    """
    found: Counter[date] = Counter()
    for word in words[((words & 0xFF) == _LABEL_260) & (words >> 29 & 3 == 0)].tolist():
        digits = [word >> 10 & 15, word >> 14 & 15, word >> 18 & 15, word >> 22 & 1, word >> 23 & 15, word >> 27 & 3]
        if max(digits) > 9:
            continue
        try:
            day = date(2000 + digits[0] + 10 * digits[1], digits[2] + 10 * digits[3], digits[4] + 10 * digits[5])
        except ValueError:
            continue
        found[day] += 1
    return found


@dataclass(frozen=True)
class CounterZero:
    """UTC of the counter's zero, None when nothing tells it, and what was assumed.

    ``readings`` are there where the counter starts again (recordings joined end to end) or wraps: its zero is another
    one behind that place.
    """

    utc_of_zero_ns: int | None
    remarks: tuple[Remark, ...]
    readings: UtcReadings | None = None


def start_of(readings: Sequence[Reading], dates: Counter[date], tmats: Tmats) -> CounterZero:
    """Return the UTC of the counter's zero: the median over the readings of one channel.

    It is the channel that has most readings. If the time source was set in the recording, its last readings count. A
    date that is behind that of TMATS by whole rollovers of the GPS week is of a source that missed them.

    Examples
    --------
    >>> one = Reading(1, 5_000_000_000, None, 343, 60_000_000_000)
    >>> utc_ns_to_iso(start_of([one], Counter({date(2011, 12, 9): 1}), Tmats()).utc_of_zero_ns)
    '2011-12-09T00:00:55.000Z'
    """
    if not readings:
        return CounterZero(None, (Remark("no_time_packets", "no time packet: times are those of the counter, no UTC"),))
    channels = Counter(one.channel for one in readings)
    chosen = min(channels, key=lambda channel: (-channels[channel], channel))
    used = [one for one in readings if one.channel == chosen]
    year, remarks = _year_of(used[0], dates, tmats)
    if year is None:
        return CounterZero(None, remarks)
    every = _every_zero(used, year)
    zeros = every[_last_start(used) :]
    zero = zero_of_readings(zeros)
    moment_ns = zero.ns + used[-1].device_ns
    behind = rollovers(moment_ns, others=_of_tmats(tmats) if used[0].year is not None else ())
    shift_ns = behind.shift_ns(moment_ns, is_gps_time=used[-1].is_gps)
    utc_ns = zero.ns + shift_ns
    packets = counted(len(used), "time packet")
    text = f"UTC from {packets} of channel {chosen}: the counter's zero is {utc_ns_to_iso(utc_ns, 6)}"
    name = f"time channel {chosen}"
    parted = [*zero.remarks(name)] if zero.passed_over else [*_spread(zeros, chosen)]
    others = [
        _other(channel, [one for one in readings if one.channel == channel], year, zero.ns)
        for channel in sorted(channels)
        if channel != chosen
    ]
    remarks = (Remark("utc_from_time_packets", text), *remarks, *parted, *behind.remarks, *others)
    places = np.array([one.place for one in used], dtype=np.int64)
    is_one = len(zeros) == len(every)
    return CounterZero(utc_ns, remarks, None if is_one else UtcReadings(places, every + shift_ns))


def _of_tmats(tmats: Tmats) -> tuple[OtherDate, ...]:
    """Return the date of TMATS; it may be some weeks older than the recording."""
    if tmats.day is None:
        return ()
    day, code = tmats.day
    noon_ns = int(datetime(day.year, day.month, day.day, 12, tzinfo=UTC).timestamp()) * NS_PER_S
    return (OtherDate(f"TMATS ({code})", noon_ns, within_days=_TMATS_DAYS),)


def _year_of(first: Reading, dates: Counter[date], tmats: Tmats) -> tuple[int | None, tuple[Remark, ...]]:
    """Year of the first reading, and how it is known."""
    if first.year is not None:
        return first.year, ()
    lacks = f"the time packets tell day {first.day} and no year"
    # The date of the bus may have turned since the first time packet, or be about to.
    on_bus = [day for day, _count in dates.most_common() if abs(day.timetuple().tm_yday - first.day) <= 1]
    if on_bus:
        return on_bus[0].year, (Remark("year_from_bus", f"{lacks}: {on_bus[0].year} by label 260 ({on_bus[0]})"),)
    if tmats.day is not None:
        day, code = tmats.day
        near = [date(year, 1, 1) + timedelta(first.day - 1) for year in (day.year - 1, day.year, day.year + 1)]
        year = min(near, key=lambda one: abs(one - day)).year
        text = f"{lacks}: {year} is assumed, by which it is nearest to the date of TMATS ({code}: {day})"
        return year, (Remark("assumed_year", text),)
    when = utc_ns_to_iso(first.time_of_day_ns).partition("T")[2]
    text = f"{lacks}, and neither label 260 nor TMATS has a date: no UTC (day {first.day} {when} at the first of them)"
    return None, (Remark("year_unknown", text),)


def _last_start(used: Sequence[Reading]) -> int:
    """Return the place of the first reading after the counter's last restart."""
    steps = np.diff(np.array([one.device_ns for one in used], dtype=np.int64))
    restarts = np.flatnonzero(steps < _RESTART_NS)
    return int(restarts[-1]) + 1 if len(restarts) else 0


def _every_zero(used: Iterable[Reading], year: int) -> Int64Array:
    """Return UTC less the counter for each reading; a day that falls begins a new year."""
    zeros: list[int] = []
    before: Reading | None = None
    for one in used:
        if before is not None and before.day - one.day > 180:
            year += 1
        day = datetime(one.year or year, 1, 1, tzinfo=UTC) + timedelta(one.day - 1)
        utc_ns = int(day.timestamp()) * NS_PER_S + one.time_of_day_ns
        if one.is_gps:
            utc_ns -= leap_seconds_at(utc_ns) * NS_PER_S
        zeros.append(utc_ns - one.device_ns)
        before = one
    return np.array(zeros, dtype=np.int64)


def _spread(zeros: Int64Array, channel: int) -> Iterable[Remark]:
    """Yield a remark when the readings do not run with the counter."""
    spread_ns = int(zeros.max() - zeros.min())
    if spread_ns > _SPREAD_NS:
        text = (
            f"time channel {channel} and the counter part by {spread_ns / NS_PER_S:.1f} s in the recording: one was "
            "set, or lost its source; UTC is that of the middle reading"
        )
        yield Remark("clock_disagrees", text)


def _other(channel: int, readings: Sequence[Reading], year: int, utc_ns: int) -> Remark:
    zeros = _every_zero(readings, year)[_last_start(readings) :]
    apart_s = (int(np.sort(zeros)[len(zeros) // 2]) - utc_ns) / NS_PER_S
    code = "clock_disagrees" if abs(apart_s) > _SPREAD_NS / NS_PER_S else "other_time_channel"
    return Remark(
        code, f"time channel {channel} ({counted(len(readings), 'packet')}) differs by {apart_s:+.3f} s: it is not used"
    )
