"""Dates 1024 weeks in the past: a receiver that missed a rollover of the GPS week.

The week counts to 1023 in the satellites' message. A receiver whose firmware is old takes it for a week of the 1024
before; the time of the day stays right. Such a date is never ahead of the true one, so what else a log knows of its
date can show by how many rollovers it is behind.

Source: u-blox, GPS week number rollover workaround (UBX-19016936); gpsd, timebase.c.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Remark
from groundstation.base.timescales import (
    ROLLOVER_NS,
    ROLLOVER_WEEKS,
    iso_to_utc_ns,
    leap_seconds_at,
    utc_ns_to_iso,
    weeks_later_ns,
)
from groundstation.base.units import NS_PER_S

CODE = "week_rollover"
_MOST = 3  # rollovers: 59 years
_YEARS_IN_USE = 12  # years that a firmware or a receiver stays in use after its release
_DAY_NS = 86_400 * NS_PER_S


@dataclass(frozen=True)
class Earliest:
    """Year before which something in the log did not exist, such as ``PX4 v1.11``.

    ``moves`` is False for what stays in use for decades, such as a format: it shows that a date is wrong, not by how
    much.
    """

    year: int
    what: str
    moves: bool = True


@dataclass(frozen=True)
class OtherDate:
    """UTC of the same moment by another clock of the log, within ``within_days``."""

    name: str
    utc_ns: int
    within_days: float = 2.0


@dataclass(frozen=True)
class Rollovers:
    """Number of rollovers that a date lags, and remarks on it."""

    count: int = 0
    remarks: tuple[Remark, ...] = ()

    def shift_ns(self, told_ns: int, *, is_gps_time: bool) -> int:
        """Return the nanoseconds to add to stated UTC, or to UTC made of GPS time that day.

        Examples
        --------
        >>> told_ns = iso_to_utc_ns("2004-09-20T10:00:05Z")[0]  # 10:00:18 GPS time less the 13 leap seconds of 2004
        >>> utc_ns_to_iso(told_ns + Rollovers(1).shift_ns(told_ns, is_gps_time=True))
        '2024-05-06T10:00:00.000Z'
        """
        if is_gps_time:
            return int(weeks_later_ns(np.array([told_ns]), self.count * ROLLOVER_WEEKS)[0]) - told_ns
        return self.count * ROLLOVER_NS


def rollovers(
    told_ns: int,
    *,
    leap_s: int | None = None,
    earliest: Earliest | None = None,
    others: tuple[OtherDate, ...] = (),
) -> Rollovers:
    """Count the rollovers that a date lags the true one, as far as the log shows.

    Parameters
    ----------
    told_ns : int
        UTC as it was told, nanoseconds.
    leap_s : int, optional
        Leap seconds between GPS time and UTC that the log states: no receiver knows those that come later, so more
        than the day had show a later day.
    earliest : Earliest, optional
    others : tuple of OtherDate

    Returns
    -------
    Rollovers
        With count 0 where the date agrees with all, or where nothing shows by how much it is behind.

    Examples
    --------
    >>> found = rollovers(iso_to_utc_ns("2004-09-20T10:00:00Z")[0], leap_s=18)
    >>> found.count, found.remarks[0].text
    (1, 'the date told, 2004-09-20, is 1024 weeks behind (the GPS week rolled over): 18 leap seconds are stated, and \
that day had 13; read as 2024-05-06')
    """
    for count, why in _shown(told_ns, leap_s, earliest, others):
        true_ns = told_ns + count * ROLLOVER_NS
        text = (
            f"the date told, {_day(told_ns)}, is {count * ROLLOVER_WEEKS} weeks behind (the GPS week rolled over): "
            f"{why}; read as {_day(true_ns)}"
        )
        return Rollovers(count, (Remark(CODE, text),))
    if earliest is not None and told_ns < _year_ns(earliest.year):
        text = (
            f"the date told, {_day(told_ns)}, cannot be true: {earliest.what} came in {earliest.year} or later. If the "
            f"GPS week rolled over, the log is of {_day(told_ns + ROLLOVER_NS)}; the time is kept as it was told"
        )
        return Rollovers(0, (Remark(CODE, text),))
    return Rollovers()


def _shown(
    told_ns: int, leap_s: int | None, earliest: Earliest | None, others: tuple[OtherDate, ...]
) -> Iterator[tuple[int, str]]:
    """Yield the rollovers that each piece of evidence shows, the surest first."""
    later = [(count, told_ns + count * ROLLOVER_NS) for count in range(1, _MOST + 1)]
    if leap_s is not None and leap_s > leap_seconds_at(told_ns):
        count = next((count for count, utc_ns in later if leap_seconds_at(utc_ns) >= leap_s), 0)
        if count:
            yield count, f"{leap_s} leap seconds are stated, and that day had {leap_seconds_at(told_ns)}"
    for other in others:
        for count, utc_ns in later:
            if abs(other.utc_ns - utc_ns) <= other.within_days * _DAY_NS:
                yield count, f"{other.name} tells {_day(other.utc_ns)}"
    if earliest is not None and earliest.moves and told_ns < _year_ns(earliest.year):
        last_ns = _year_ns(earliest.year + _YEARS_IN_USE)
        count = next((count for count, utc_ns in later if _year_ns(earliest.year) <= utc_ns < last_ns), 0)
        if count:
            yield count, f"{earliest.what} came in {earliest.year} or later"


def _year_ns(year: int) -> int:
    return iso_to_utc_ns(f"{year}-01-01T00:00:00Z")[0]


def _day(utc_ns: int) -> str:
    return utc_ns_to_iso(utc_ns, 0)[:10]
