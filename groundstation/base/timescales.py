"""Times as integer nanoseconds: decimal seconds, ISO 8601 text and back, never through floating point."""

import re
from datetime import UTC, datetime, timedelta, timezone

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
    """UTC nanoseconds since 1970 of an ISO 8601 time, and whether the text named a zone (none is read as UTC).

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
    """Length of time for people: ``+12:34.5`` style without sign, hours only when there are any.

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
