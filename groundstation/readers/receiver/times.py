"""Absolute times of a stream: receivers write the time of the week or of the day, and the date in some messages only.

Every message that tells the full time is an anchor; another takes the week or day that brings it nearest to the anchor
before it. So weeks and days roll over by themselves, also where the message that tells them comes late. GPS time is
turned into UTC by the leap seconds of its day, never by the receiver's: before its almanac that number is a guess.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.timescales import GPS_EPOCH_NS, gps_week_to_utc_ns
from groundstation.base.units import NS_PER_S

WEEK_MS = 604_800_000
DAY_NS = 86_400 * NS_PER_S
NS_PER_MS = 1_000_000
BEFORE_FIRST_NS = 3_600 * NS_PER_S  # a time so long before the first full one is a counter that was not set yet


@dataclass(frozen=True, eq=False)
class Anchors:
    """Places in the file (increasing) at which the full time is known, UTC nanoseconds, and the week's milliseconds
    told there (-1: none)."""

    places: Int64Array
    utc_ns: Int64Array
    week_ms: Int64Array

    def __len__(self) -> int:
        return len(self.places)

    def of_week(self, places: Int64Array, week_ms: Int64Array) -> Column:
        """UTC of times of the week in milliseconds; that of the anchor itself where both are of one epoch.

        Without an anchor the times of the week, counted on.
        """
        if not len(self):
            return Column(unrolled(week_ms, WEEK_MS) * NS_PER_MS, week_ms < WEEK_MS)
        at = self._before(places)
        near_ns = self.utc_ns[at]
        week = (near_ns - GPS_EPOCH_NS) // NS_PER_MS // WEEK_MS
        choices = [gps_week_to_utc_ns(week + step, week_ms) for step in (-1, 0, 1)]
        utc_ns = _nearest(choices, near_ns)
        for other in (at, np.minimum(at + 1, len(self) - 1)):
            is_same = (self.week_ms[other] == week_ms) & (np.abs(self.utc_ns[other] - utc_ns) < NS_PER_S)
            utc_ns = np.where(is_same, self.utc_ns[other], utc_ns)
        return self._credible(places, utc_ns, week_ms < WEEK_MS)

    def of_day(self, places: Int64Array, day_ns: Int64Array) -> Column:
        """UTC of times of the day in nanoseconds; without an anchor the times of the day, counted on."""
        if not len(self):
            return Column(unrolled(day_ns, DAY_NS))
        near_ns = self.utc_ns[self._before(places)]
        midnight = near_ns // DAY_NS * DAY_NS
        utc_ns = _nearest([midnight + step * DAY_NS + day_ns for step in (-1, 0, 1)], near_ns)
        return self._credible(places, utc_ns, np.ones(len(places), dtype=bool))

    def _before(self, places: Int64Array) -> Int64Array:
        return np.maximum(np.searchsorted(self.places, places, side="right") - 1, 0)

    def _credible(self, places: Int64Array, utc_ns: Int64Array, is_sound: BoolArray) -> Column:
        is_early = (places < self.places[0]) & (np.abs(utc_ns - self.utc_ns[0]) > BEFORE_FIRST_NS)
        present = is_sound & ~is_early
        return Column(np.where(present, utc_ns, 0), None if present.all() else present)


def _nearest(choices: list[Int64Array], near_ns: Int64Array) -> Int64Array:
    several = np.stack(choices)
    best = np.abs(several - near_ns).argmin(axis=0)
    return np.asarray(several[best, np.arange(several.shape[1])], dtype=np.int64)


def unrolled(values: Int64Array, period: int) -> Int64Array:
    """Values that start again after ``period``, counted on.

    Examples
    --------
    >>> unrolled(np.array([80, 95, 5, 20]), 100).tolist()
    [80, 95, 105, 120]
    """
    steps = np.diff(values, prepend=values[:1])
    turns = (steps < -period // 2).astype(np.int64) - (steps > period // 2)
    return np.asarray(values + period * np.cumsum(turns), dtype=np.int64)


def fine_utc_ns(utc_ns: Int64Array, week_ms: Int64Array) -> tuple[Int64Array, Int64Array]:
    """UTC of a fix by its time of the week with the fraction of its UTC, and how many seconds the told UTC was wrong.

    Parameters
    ----------
    utc_ns, week_ms : ndarrays of int64, shape (n,)
        UTC as the receiver told it, to the nanosecond, and the same moment in milliseconds of the GPS week.

    Examples
    --------
    A receiver that has no almanac yet and takes 16 leap seconds for 18:

    >>> from groundstation.base.timescales import iso_to_utc_ns
    >>> told, _zone = iso_to_utc_ns("2025-08-28T17:30:23.749542955Z")
    >>> utc_ns, wrong_s = fine_utc_ns(np.array([told]), np.array([408_639_750]))
    >>> int(utc_ns[0]) - told, wrong_s.tolist()
    (-2000000000, [2])
    """
    week = (utc_ns - GPS_EPOCH_NS) // NS_PER_MS // WEEK_MS
    by_week = _nearest([gps_week_to_utc_ns(week + step, week_ms) for step in (-1, 0, 1)], utc_ns)
    wrong_s = np.round((utc_ns - by_week) / NS_PER_S).astype(np.int64)
    return utc_ns - wrong_s * NS_PER_S, wrong_s


def calendar_ns(year: Int64Array, month: Int64Array, day: Int64Array) -> tuple[Int64Array, BoolArray]:
    """UTC nanoseconds at the beginning of a day, and whether there is such a day."""
    sound = (month >= 1) & (month <= 12) & (day >= 1) & (year >= 1980) & (year < 2200)
    months = (np.where(sound, year, 1980) - 1970) * 12 + np.where(sound, month, 1) - 1
    first = months.astype("datetime64[M]").astype("datetime64[D]")
    following = (months + 1).astype("datetime64[M]").astype("datetime64[D]")
    sound = sound & (day <= (following - first).astype(np.int64))
    return (first.astype(np.int64) + np.where(sound, day, 1) - 1) * DAY_NS, sound


def gps_to_utc_ns(week: Int64Array, week_s: Int64Array | np.ndarray) -> Int64Array:
    """UTC of GPS week and (fractional) seconds of the week, to about a nanosecond."""
    ns = np.round(np.asarray(week_s, dtype=np.float64) * 1e9).astype(np.int64)
    return gps_week_to_utc_ns(week, ns // NS_PER_MS) + ns % NS_PER_MS
