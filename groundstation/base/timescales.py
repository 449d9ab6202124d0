"""Times as integer nanoseconds: decimal seconds, ISO 8601 text and back, without floats."""

import re
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.base.units import NS_PER_S

_DECIMAL = re.compile(r"([+-]?)(\d+)(?:\.(\d*))?$")
_ISO = re.compile(r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d)(?::(\d\d)(?:[.,](\d+))?)?\s*(Z|z|UTC|[+-]\d\d:?\d\d)?$")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def seconds_text_to_ns(text: str) -> int:
    """Nanoseconds of a decimal number of seconds, exact; digits past the ninth are cut.

    Raises
    ------
    GroundstationError
        When the text is not a plain decimal number.

    Examples
    --------
    >>> seconds_text_to_ns("1700000000.123456789"), seconds_text_to_ns("-0.5")
    (1700000000123456789, -500000000)
    """
    match = _DECIMAL.match(text.strip())
    if match is None:
        raise GroundstationError("time", repr(text), "decimal seconds such as 12.345")
    sign, whole, fraction = match.groups()
    ns = int(whole) * NS_PER_S + int(((fraction or "") + "000000000")[:9])
    return -ns if sign == "-" else ns


def iso_to_utc_ns(text: str) -> tuple[int, bool]:
    """Return UTC nanoseconds since 1970 of an ISO 8601 time, and whether it names a zone.

    Text without a zone is read as UTC.

    Raises
    ------
    GroundstationError
        When the text is not a date and time.

    Examples
    --------
    >>> iso_to_utc_ns("2026-05-04T06:00:00.25Z")
    (1777874400250000000, True)
    >>> iso_to_utc_ns("2026-05-04 09:00:00+03:00")
    (1777874400000000000, True)
    >>> iso_to_utc_ns("2026-05-04T06:00")[1]
    False
    """
    match = _ISO.match(text.strip())
    if match is None:
        raise GroundstationError("time", repr(text), "ISO 8601 such as 2026-05-04T06:00:00Z")
    year, month, day, hour, minute, second, fraction, zone = match.groups()
    offset = UTC
    if zone and zone[0] in "+-":
        digits = zone[1:].replace(":", "")
        shift = timedelta(hours=int(digits[:2]), minutes=int(digits[2:]))
        if shift >= timedelta(days=1):
            raise GroundstationError("time", repr(text), "a zone within 24 h of UTC")
        offset = timezone(shift if zone[0] == "+" else -shift)
    try:
        moment = datetime(
            int(year), int(month), int(day), int(hour), int(minute), min(int(second or 0), 59), tzinfo=offset
        )
    except ValueError as error:
        raise GroundstationError("time", repr(text), "a date and time that exist") from error
    whole = round((moment - _EPOCH).total_seconds()) + (1 if second == "60" else 0)
    return whole * NS_PER_S + int(((fraction or "") + "000000000")[:9]), bool(zone)


def utc_ns_to_iso(utc_ns: int, digits: int = 3) -> str:
    """ISO 8601 text of UTC nanoseconds, rounded to ``digits`` decimals of a second (0 to 9).

    Examples
    --------
    >>> utc_ns_to_iso(1777874400250000000)
    '2026-05-04T06:00:00.250Z'
    """
    step = 10 ** (9 - digits)
    rounded = (utc_ns + step // 2) // step * step
    seconds, ns = divmod(rounded, NS_PER_S)
    text = (_EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%dT%H:%M:%S")
    return text + (f".{ns:09d}"[: digits + 1] if digits else "") + "Z"


def utc_ns_to_stamp(utc_ns: int) -> str:
    """Compact UTC stamp for file names, whole seconds cut: ``20260504T060000Z``.

    Examples
    --------
    >>> utc_ns_to_stamp(1777874400999999999)
    '20260504T060000Z'
    """
    return (_EPOCH + timedelta(seconds=utc_ns // NS_PER_S)).strftime("%Y%m%dT%H%M%SZ")


def duration_text(seconds: float) -> str:
    """Format a length of time for people, as ``12:34.5``, with hours only when there are any.

    It has no sign.

    Examples
    --------
    >>> duration_text(75.25), duration_text(3725.0)
    ('1:15.2', '1:02:05.0')
    """
    tenths = round(seconds * 10 - 1e-9)
    minutes, rest = divmod(tenths, 600)
    hours, minutes = divmod(minutes, 60)
    tail = f"{rest // 10:02d}.{rest % 10}"
    return f"{hours}:{minutes:02d}:{tail}" if hours else f"{minutes}:{tail}"


# First day of each GPS-UTC difference in whole seconds. Source: IERS Bulletin C; the IANA list leap-seconds.list.
_LEAP_SECONDS = (
    ("1981-07-01", 1),
    ("1982-07-01", 2),
    ("1983-07-01", 3),
    ("1985-07-01", 4),
    ("1988-01-01", 5),
    ("1990-01-01", 6),
    ("1991-01-01", 7),
    ("1992-07-01", 8),
    ("1993-07-01", 9),
    ("1994-07-01", 10),
    ("1996-01-01", 11),
    ("1997-07-01", 12),
    ("1999-01-01", 13),
    ("2006-01-01", 14),
    ("2009-01-01", 15),
    ("2012-07-01", 16),
    ("2015-07-01", 17),
    ("2017-01-01", 18),
)
_GPS_EPOCH_S = 315_964_800  # 1980-01-06, seconds since 1970
GPS_EPOCH_NS = _GPS_EPOCH_S * NS_PER_S
_S_PER_WEEK = 604_800
ROLLOVER_WEEKS = 1_024  # the GPS week of the satellites' message has ten bits
WEEK_NS = _S_PER_WEEK * NS_PER_S
ROLLOVER_NS = ROLLOVER_WEEKS * WEEK_NS


def leap_seconds_at(utc_ns: int) -> int:
    """GPS time less UTC, whole seconds.

    Examples
    --------
    >>> leap_seconds_at(iso_to_utc_ns("2016-12-31T12:00Z")[0]), leap_seconds_at(iso_to_utc_ns("2026-05-04T06:00Z")[0])
    (17, 18)
    """
    return max((leap for day, leap in _LEAP_SECONDS if iso_to_utc_ns(f"{day}T00:00Z")[0] <= utc_ns), default=0)


MOST_LEAP_S = 20  # GPS time less UTC, for some years to come
_NEAR_WEEK_S, _NEAR_SECOND_S = 30, 0.15  # tolerance of whole weeks (leap seconds may be wrong too) and whole seconds


def whole_weeks(difference_ns: int) -> int:
    """Weeks by which two times differ, 0 where they do not differ by whole weeks.

    Examples
    --------
    >>> whole_weeks(-604_800 * NS_PER_S), whole_weeks(3 * 604_800 * NS_PER_S + 5), whole_weeks(86_400 * NS_PER_S)
    (-1, 3, 0)
    """
    weeks = round(difference_ns / WEEK_NS)
    return weeks if abs(difference_ns - weeks * WEEK_NS) < _NEAR_WEEK_S * NS_PER_S else 0


def leap_seconds_late(difference_ns: int) -> int:
    """Whole seconds by which a time is late for want of leap seconds, 0 where it is not.

    Examples
    --------
    >>> leap_seconds_late(2_010_000_000), leap_seconds_late(2_500_000_000), leap_seconds_late(-2 * NS_PER_S)
    (2, 0, 0)
    """
    whole_s = round(difference_ns / NS_PER_S)
    is_near = abs(difference_ns - whole_s * NS_PER_S) < _NEAR_SECOND_S * NS_PER_S
    return whole_s if is_near and 0 < whole_s <= MOST_LEAP_S else 0


def gps_week_to_utc_ns(week: NDArray[np.int64] | int, week_ms: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """Return UTC nanoseconds since 1970 of GPS week and milliseconds of the week.

    The leap seconds of that day are taken off. Weeks count from 6 January 1980 without rolling over at 1024.

    Examples
    --------
    The week of 31 December 2016, before and after the last leap second so far:

    >>> [utc_ns_to_iso(int(gps_week_to_utc_ns(1930, ms))) for ms in (16_000, 18_000)]
    ['2016-12-31T23:59:59.000Z', '2017-01-01T00:00:00.000Z']
    """
    gps_s = np.asarray(week, dtype=np.int64) * _S_PER_WEEK + np.asarray(week_ms, dtype=np.int64) // 1000
    days = np.array([day for day, _leap in _LEAP_SECONDS], dtype="datetime64[s]").astype(np.int64)
    leaps = np.array([0, *(leap for _day, leap in _LEAP_SECONDS)], dtype=np.int64)
    starts_s = days - _GPS_EPOCH_S + leaps[1:]
    leap_s = leaps[np.searchsorted(starts_s, gps_s, side="right")]
    whole_ns = (gps_s + _GPS_EPOCH_S - leap_s) * NS_PER_S
    return np.asarray(whole_ns + np.asarray(week_ms, dtype=np.int64) % 1000 * 1_000_000, dtype=np.int64)


def utc_to_gps_ns(utc_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Date and time of GPS time of moments in UTC: the inverse of :func:`gps_to_utc_ns`.

    Examples
    --------
    >>> told = np.array([iso_to_utc_ns("2025-08-28T17:30:21.749Z")[0]])
    >>> utc_ns_to_iso(int(utc_to_gps_ns(told)[0])), bool((gps_to_utc_ns(utc_to_gps_ns(told)) == told).all())
    ('2025-08-28T17:30:39.749Z', True)
    """
    days_s = np.array([day for day, _leap in _LEAP_SECONDS], dtype="datetime64[s]").astype(np.int64)
    leaps = np.array([0, *(leap for _day, leap in _LEAP_SECONDS)], dtype=np.int64)
    utc_ns = np.asarray(utc_ns, dtype=np.int64)
    return np.asarray(utc_ns + leaps[np.searchsorted(days_s, utc_ns // NS_PER_S, side="right")] * NS_PER_S)


def weeks_later_ns(utc_ns: NDArray[np.int64], weeks: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """UTC of the same second of another GPS week: leap seconds may have come between.

    Examples
    --------
    >>> told = np.array([iso_to_utc_ns("2004-09-20T10:00:05Z")[0]])
    >>> utc_ns_to_iso(int(weeks_later_ns(told, ROLLOVER_WEEKS)[0]))
    '2024-05-06T10:00:00.000Z'
    """
    return gps_to_utc_ns(utc_to_gps_ns(utc_ns) + np.asarray(weeks, dtype=np.int64) * WEEK_NS)


def gps_to_utc_ns(gps_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return UTC nanoseconds of moments written as date and time of GPS time.

    Both count from 1970; the leap seconds of GPS time are taken off.

    Examples
    --------
    >>> utc_ns_to_iso(int(gps_to_utc_ns(np.array([iso_to_utc_ns("2025-08-28T17:30:39.749Z")[0]]))[0]))
    '2025-08-28T17:30:21.749Z'
    """
    week_ms, rest_ns = np.divmod(np.asarray(gps_ns, dtype=np.int64) - GPS_EPOCH_NS, 1_000_000)
    return np.asarray(gps_week_to_utc_ns(0, week_ms) + rest_ns, dtype=np.int64)
