"""Absolute times of a stream.

Receivers write the time of the week or of the day, and the date in some messages only.

Every message that tells the full time is an anchor; another takes the week or day that brings it nearest to the anchor
before it. So weeks and days roll over by themselves, also where the message that tells them comes late. GPS time is
turned into UTC by the leap seconds of its day, never by the receiver's: before its almanac that number is a guess.

A receiver knows the time of the week, or of the day, before it knows the week: anchors of another week or date than the
others are put on that of the others (:func:`on_one_date`), and so are the times that messages make of their own week.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.timescales import (
    GPS_EPOCH_NS,
    ROLLOVER_NS,
    ROLLOVER_WEEKS,
    WEEK_NS,
    gps_week_to_utc_ns,
    leap_seconds_late,
    weeks_later_ns,
)
from groundstation.base.units import NS_PER_S

WEEK_MS = 604_800_000
DAY_NS = 86_400 * NS_PER_S
NS_PER_MS = 1_000_000
BEFORE_FIRST_NS = 3_600 * NS_PER_S  # a time so long before the first full one is a counter that was not set yet
_GOES_ON_NS = 120 * NS_PER_S  # largest step between two full times of one stretch
_FEWEST = 3  # full times of a date that is believed, but for the last one
_STEADY, _MOST_STEPS = 3, 3  # times around a step of UTC; steps of a stream
_DAYS_A_WEEK = 7


@dataclass(frozen=True)
class LateStretch:
    """Sentences up to a place in the file whose UTC is late for lack of leap seconds.

    ``last_place`` is that of the last one with a date, ``first_place`` that of the first one which is right, and
    ``day_ns`` its time of the day: other sentences of its epoch may stand before it. ``late_s`` is by how much.
    """

    last_place: int
    first_place: int
    day_ns: int
    late_s: int


@dataclass(frozen=True, eq=False)
class Anchors:
    """Places in the file (increasing) where the full time is known, in UTC nanoseconds.

    ``week_ms`` are the week's milliseconds told there (-1: none). ``late`` are stretches of sentences whose times of
    the day are late.
    """

    places: Int64Array
    utc_ns: Int64Array
    week_ms: Int64Array
    late: tuple[LateStretch, ...] = ()

    def __len__(self) -> int:
        return len(self.places)

    def of_week(self, places: Int64Array, week_ms: Int64Array) -> Column:
        """Return the UTC of times of the week in milliseconds.

        It is that of the anchor itself where both are of one epoch. Without an anchor it is the time of the week,
        counted on.
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
        """Return the UTC of times of the day in nanoseconds.

        Without an anchor it is the time of the day, counted on.
        """
        day_ns = self._in_time(places, day_ns)
        if not len(self):
            return Column(unrolled(day_ns, DAY_NS))
        at = self._before(places)
        near_ns = self.utc_ns[at]
        midnight = near_ns // DAY_NS * DAY_NS
        utc_ns = _nearest([midnight + step * DAY_NS + day_ns for step in (-1, 0, 1)], near_ns)
        next_ns = self.utc_ns[np.minimum(at + 1, len(self) - 1)]  # the date of an epoch may stand in its last sentence
        is_same = next_ns % DAY_NS // NS_PER_S == day_ns // NS_PER_S
        utc_ns = np.where(is_same, next_ns // DAY_NS * DAY_NS + day_ns, utc_ns)
        return self._credible(places, utc_ns, np.ones(len(places), dtype=bool))

    def in_their_week(self, places: Int64Array, time: Column) -> Column:
        """Put UTC of messages with an own week into the week nearest to the anchor."""
        if not len(self):
            return time
        weeks = np.rint((self.utc_ns[self._before(places)] - time.values) / WEEK_NS).astype(np.int64)
        weeks = np.where(time.mask, weeks, 0)
        return Column(weeks_later_ns(time.values, weeks), time.present) if weeks.any() else time

    def _in_time(self, places: Int64Array, day_ns: Int64Array) -> Int64Array:
        """Correct times of the day for leap seconds that were not learnt yet."""
        for one in self.late:
            is_right = (places >= one.first_place) | ((places > one.last_place) & (day_ns == one.day_ns))
            day_ns = np.where(is_right, day_ns, (day_ns - one.late_s * NS_PER_S) % DAY_NS)
        return day_ns

    def _before(self, places: Int64Array) -> Int64Array:
        return np.maximum(np.searchsorted(self.places, places, side="right") - 1, 0)

    def _credible(self, places: Int64Array, utc_ns: Int64Array, is_sound: BoolArray) -> Column:
        is_early = (places < self.places[0]) & (np.abs(utc_ns - self.utc_ns[0]) > BEFORE_FIRST_NS)
        present = is_sound & ~is_early
        return Column(np.where(present, utc_ns, 0), None if present.all() else present)


_NOTHING: Int64Array = np.zeros(0, dtype=np.int64)
NO_ANCHORS = Anchors(_NOTHING, _NOTHING, _NOTHING)


def on_one_date(anchors: Anchors, *, is_gps_time: bool) -> tuple[Anchors, tuple[tuple[int, int], ...]]:
    """Put anchors on one date; return also (number, days before) of each other date.

    Times that jump by whole days and go on are those of a receiver that did not know its week or date yet, or was late
    with a new one. Such a receiver states a date of the past, so the latest date counts that is stated a few times, or
    last.

    Examples
    --------
    >>> seconds = np.arange(6) * NS_PER_S + np.array([0, 0, -7, -7, 0, 0]) * DAY_NS + 10**18
    >>> found, others = on_one_date(Anchors(np.arange(6), seconds, np.full(6, -1)), is_gps_time=False)
    >>> ((found.utc_ns - 10**18) // NS_PER_S).tolist(), others
    ([0, 1, 2, 3, 4, 5], ((2, 7),))
    """
    steps_ns = np.diff(anchors.utc_ns)
    days = np.rint(steps_ns / DAY_NS).astype(np.int64)
    goes_on = np.abs(steps_ns - days * DAY_NS) < _GOES_ON_NS
    if not (goes_on & (days != 0)).any():
        return anchors, ()
    stretch = np.append(0, np.cumsum((days != 0) & ~goes_on))
    level = np.append(0, np.cumsum(np.where(goes_on, days, 0)))
    later = np.zeros(len(level), dtype=np.int64)
    for number in np.unique(stretch).tolist():
        rows = np.flatnonzero(stretch == number)
        levels, counts = np.unique(level[rows], return_counts=True)
        believed = max([*levels[counts >= _FEWEST].tolist(), int(level[rows[-1]])])
        later[rows] = believed - level[rows]
    others = tuple((int((later == one).sum()), int(one)) for one in np.unique(later[later != 0]).tolist())
    weeks = later // _DAYS_A_WEEK if is_gps_time and not (later % _DAYS_A_WEEK).any() else None
    utc_ns = anchors.utc_ns + later * DAY_NS if weeks is None else weeks_later_ns(anchors.utc_ns, weeks)
    return replace(anchors, utc_ns=utc_ns), others


def moved_on(anchors: Anchors, rollovers: int, *, is_gps_time: bool) -> Anchors:
    """Move anchors by rollovers of the week, as UTC of GPS time or as stated UTC."""
    if not rollovers:
        return anchors
    if is_gps_time:
        return replace(anchors, utc_ns=weeks_later_ns(anchors.utc_ns, rollovers * ROLLOVER_WEEKS))
    return replace(anchors, utc_ns=anchors.utc_ns + rollovers * ROLLOVER_NS)


def late_stretches(anchors: Anchors) -> tuple[LateStretch, ...]:
    """Find stretches of sentences before the leap seconds were learnt: UTC falls back.

    UTC falls by whole seconds, and times go on steadily before and after. A lateness of no more than the time between
    two sentences is not seen.
    """
    is_new = np.append(True, np.diff(anchors.utc_ns) != 0) if len(anchors) else np.zeros(0, dtype=bool)
    places, utc_ns = anchors.places[is_new], anchors.utc_ns[is_new]
    steps_ns = np.diff(utc_ns)
    falls = np.flatnonzero(steps_ns < 0)
    if not 0 < len(falls) <= _MOST_STEPS:
        return ()
    period_ns = int(np.median(steps_ns[steps_ns > 0])) if (steps_ns > 0).any() else 0
    return tuple(_late(places, utc_ns, steps_ns, period_ns, falls))


def _late(
    places: Int64Array, utc_ns: Int64Array, steps_ns: Int64Array, period_ns: int, falls: Int64Array
) -> Iterator[LateStretch]:
    for at in falls.tolist():
        around = np.concatenate([steps_ns[max(at - _STEADY, 0) : at], steps_ns[at + 1 : at + 1 + _STEADY]])
        is_steady = len(around) == 2 * _STEADY and bool((np.abs(around - period_ns) < period_ns // 2).all())
        late_s = leap_seconds_late(period_ns - int(steps_ns[at]))
        if is_steady and late_s:
            yield LateStretch(int(places[at]), int(places[at + 1]), int(utc_ns[at + 1] % DAY_NS), late_s)


def _nearest(choices: list[Int64Array], near_ns: Int64Array) -> Int64Array:
    several = np.stack(choices)
    best = np.abs(several - near_ns).argmin(axis=0)
    return np.asarray(several[best, np.arange(several.shape[1])], dtype=np.int64)


def unrolled(values: Int64Array, period: int) -> Int64Array:
    """Count values on that start again after ``period``.

    Examples
    --------
    >>> unrolled(np.array([80, 95, 5, 20]), 100).tolist()
    [80, 95, 105, 120]
    """
    steps = np.diff(values, prepend=values[:1])
    turns = (steps < -period // 2).astype(np.int64) - (steps > period // 2)
    return np.asarray(values + period * np.cumsum(turns), dtype=np.int64)


def fine_utc_ns(utc_ns: Int64Array, week_ms: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return the UTC of a fix by its time of the week, and the error of its stated UTC.

    The fraction is that of its UTC. The error is in whole seconds.

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
    """Return UTC nanoseconds at the beginning of days, and whether the days exist."""
    sound = (month >= 1) & (month <= 12) & (day >= 1) & (year >= 1980) & (year < 2200)
    months = (np.where(sound, year, 1980) - 1970) * 12 + np.where(sound, month, 1) - 1
    first = months.astype("datetime64[M]").astype("datetime64[D]")
    following = (months + 1).astype("datetime64[M]").astype("datetime64[D]")
    sound = sound & (day <= (following - first).astype(np.int64))
    return (first.astype(np.int64) + np.where(sound, day, 1) - 1) * DAY_NS, sound


def gps_to_utc_ns(week: Int64Array, week_s: Int64Array | np.ndarray) -> Int64Array:
    """Return UTC of GPS week and (fractional) seconds of week, to about a nanosecond."""
    ns = np.round(np.asarray(week_s, dtype=np.float64) * 1e9).astype(np.int64)
    return gps_week_to_utc_ns(week, ns // NS_PER_MS) + ns % NS_PER_MS
