"""UTC of a recorder's time zero, from the metadata of a log or a clock in it."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from itertools import pairwise

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Int64Array, Remark
from groundstation.base.sorted_values import quantile
from groundstation.base.timescales import iso_to_utc_ns, leap_seconds_late, whole_weeks
from groundstation.base.units import NS_PER_S

_FIRST_UTC_NS = iso_to_utc_ns("1678-01-01T00:00:00Z")[0]  # range that 64 bits of nanoseconds hold
_LAST_UTC_NS = iso_to_utc_ns("2262-01-01T00:00:00Z")[0]
_REFERENCES = {
    "reference.parking_heading_deg": (-360.0, 720.0, "a heading in degrees"),
    "reference.parking_heading_sigma_deg": (math.ulp(0.0), 360.0, "degrees above 0"),
}


def unusable_references(metadata: Mapping[str, str]) -> list[Remark]:
    """A remark for each reference in the metadata that is no number in its range.

    Examples
    --------
    >>> [remark.text for remark in unusable_references({"reference.parking_heading_deg": "north"})]
    ["reference.parking_heading_deg: 'north' is not a heading in degrees: there is no such reference"]
    """
    remarks = []
    for key, (low, high, what) in _REFERENCES.items():
        text = metadata.get(key, "")
        if text and not low <= _number(text) <= high:
            remarks.append(
                Remark("unreadable_metadata", f"{key}: {text[:40]!r} is not {what}: there is no such reference")
            )
    return remarks


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def utc_of_zero(metadata: Mapping[str, str]) -> tuple[int | None, list[Remark]]:
    """Return the UTC nanoseconds of device time zero by ``start_utc``, and remarks.

    None without ``start_utc``. The remarks tell what was assumed.

    Examples
    --------
    >>> utc_of_zero({"start_utc": "1970-01-01T00:00:02Z"}), utc_of_zero({})
    ((2000000000, []), (None, []))
    """
    text = metadata.get("start_utc", "")
    if not text:
        return None, []
    try:
        utc_ns, named_zone = iso_to_utc_ns(text)
        if not _FIRST_UTC_NS <= utc_ns < _LAST_UTC_NS:
            raise GroundstationError("time", repr(text), "a year from 1678 to 2261")
    except GroundstationError as error:
        return None, [Remark("unreadable_metadata", f"start_utc: {error}; the flight has no absolute time")]
    return utc_ns, [] if named_zone else [Remark("assumed_utc", f"start_utc {text} names no zone: read as UTC")]


_JUMP_NS = NS_PER_S // 2  # jump between two levels; messages of a receiver come late by less
_SAME_NS = 7 * NS_PER_S // 10  # middles of one level
_FEWEST, _MOST_PIECES = 3, 1_000  # readings of a level; pieces between jumps, of which more are no levels but noise
_FEW_READINGS, _FEW = 10, 0.1  # readings of an unexplained level, and their share: fewer are late messages
_HALF_DAY_NS = 43_200 * NS_PER_S


@dataclass(frozen=True, eq=False)
class ToldZero:
    """UTC of the recorder's time zero by the readings of another clock.

    Parameters
    ----------
    ns : int
        Median of the readings that count.
    zeros_ns : ndarray of int64, shape (m,)
        What each of them says.
    passed_over : tuple of (int, int)
        Levels that do not count, in the order of the log: how many readings, and their median less ``ns``.
    """

    ns: int
    zeros_ns: Int64Array
    passed_over: tuple[tuple[int, int], ...] = ()

    @property
    def spread_s(self) -> float:
        """Spread in seconds that contains nine tenths of the readings."""
        return quantile(np.abs(self.zeros_ns - self.ns), 0.9) / NS_PER_S

    def remarks(self, clock: str) -> Iterator[Remark]:
        """Yield a remark on each level that does not count; ``clock`` names its source."""
        for count, away_ns in self.passed_over:
            weeks, late_s = whole_weeks(away_ns), leap_seconds_late(away_ns)
            begins = f"{clock}: {count} reading{'s' if count > 1 else ''}"
            if weeks:
                side = "before" if weeks < 0 else "after"
                number = f"{abs(weeks)} week{'s' if abs(weeks) > 1 else ''}"
                text = f"{begins} told a date {number} {side} that of the others: the week was not known yet"
                yield Remark("week_number", text)
            elif late_s:
                text = f"{begins} told UTC {late_s} s late, by leap seconds that were not learnt yet"
                yield Remark("leap_seconds", text)
            else:
                text = f"{begins} told a time {away_ns / NS_PER_S:+.3f} s off that of the others: the clock was set"
                yield Remark("clock_disagrees", text)


@dataclass
class _Level:
    """Readings that agree; ``pieces`` are their stretches (first, stop)."""

    pieces: list[tuple[int, int]] = field(default_factory=list)
    middle_ns: int = 0

    @property
    def readings(self) -> int:
        """Number of readings."""
        return sum(stop - first for first, stop in self.pieces)


def told_at_zero(told_ns: Int64Array, device_ns: Int64Array) -> ToldZero:
    """Return the time by another clock when the recorder's was at zero.

    Where readings repeat a time only the first counts, for the others are older than they say: a clock may state whole
    seconds. Where times repeat, it is not known when the log's first time was stated first.

    Parameters
    ----------
    told_ns, device_ns : ndarray of int64, shape (n,)
        Times by both clocks in the order of the log; n at least 1.

    Examples
    --------
    >>> found = told_at_zero(np.array([70, 70, 80, 80, 80, 90]), np.array([5, 7, 12, 14, 16, 22]))
    >>> found.ns, found.zeros_ns
    (68, array([68, 68]))
    """
    is_first = np.append(True, told_ns[1:] != told_ns[:-1])
    if not is_first.all():
        is_first[0] = not is_first[1:].any()
    return zero_of_readings((told_ns - device_ns)[is_first])


def zero_of_readings(zeros_ns: Int64Array) -> ToldZero:
    """Return the zero by readings of another clock; if that was set, the last level counts.

    A receiver states UTC some seconds late until it has heard of the leap seconds, and a date of the past until it
    knows the week. So the latest date counts, and among the levels on that date the last one. If the receiver started
    again in the log and fell back, it is the level before.

    Parameters
    ----------
    zeros_ns : ndarray of int64, shape (n,)
        UTC less device time of each reading, in the order of the log; n at least 1.

    Examples
    --------
    Leap seconds that are learnt after four of seven readings, and one reading that is wrong:

    >>> found = zero_of_readings(np.array([2, 2, 2, 2, 90, 0, 0, 0]) * NS_PER_S)
    >>> found.ns, [remark.text for remark in found.remarks("GNSS time")]
    (0, ['GNSS time: 4 readings told UTC 2 s late, by leap seconds that were not learnt yet'])
    """
    levels = _without_excursions(_levels(zeros_ns))
    if len(levels) < 2:
        return ToldZero(_middle(zeros_ns), zeros_ns)
    counting = _counting(levels)
    alike = [one for one in levels if abs(one.middle_ns - counting.middle_ns) < _SAME_NS]
    rows = [np.arange(*piece) for level in alike for piece in level.pieces]
    used = zeros_ns[np.sort(np.concatenate(rows))]
    ns = _middle(used)
    passed = [(one.readings, one.middle_ns - ns) for one in levels if one not in alike]
    return ToldZero(ns, used, tuple(passed))


def _middle(values: Int64Array) -> int:
    return int(np.sort(values)[len(values) // 2])  # a float has no room for nanoseconds since 1970


def _levels(zeros_ns: Int64Array) -> list[_Level]:
    """Group readings into levels; none where all agree, or hardly any two do."""
    jumps = np.flatnonzero(np.abs(np.diff(zeros_ns)) > _JUMP_NS) + 1
    if not 0 < len(jumps) < _MOST_PIECES:
        return []
    ends = [0, *jumps.tolist(), len(zeros_ns)]
    pieces = [(first, stop) for first, stop in pairwise(ends) if stop - first >= _FEWEST]
    if 2 * sum(stop - first for first, stop in pieces) < len(zeros_ns):
        return []
    levels: list[_Level] = []
    for first, stop in pieces:
        middle_ns = _middle(zeros_ns[first:stop])
        if levels and _goes_on(zeros_ns, levels[-1], first, middle_ns):
            levels[-1].pieces.append((first, stop))
            levels[-1].middle_ns = _middle(np.concatenate([zeros_ns[slice(*piece)] for piece in levels[-1].pieces]))
        else:
            levels.append(_Level([(first, stop)], middle_ns))
    return levels


def _without_excursions(levels: list[_Level]) -> list[_Level]:
    """Drop levels that late messages cause.

    These are unexplained levels that are short, or after which all is as before.
    """
    kept: list[_Level] = []
    for at, one in enumerate(levels):
        neighbours = levels[max(at - 1, 0) : at] + levels[at + 1 : at + 2]
        away_ns = [one.middle_ns - other.middle_ns for other in neighbours]
        returns = len(away_ns) > 1 and abs(away_ns[1] - away_ns[0]) < _SAME_NS
        few = one.readings < min(_FEW_READINGS, _FEW * sum(other.readings for other in levels))
        is_leap = any(leap_seconds_late(abs(away)) for away in away_ns) and not (returns and few)
        if is_leap or any(whole_weeks(away) for away in away_ns) or not (returns or few):
            kept.append(one)
    is_one = all(abs(one.middle_ns - kept[0].middle_ns) < _SAME_NS for one in kept)
    return [] if is_one else kept


def _goes_on(zeros_ns: Int64Array, level: _Level, first: int, middle_ns: int) -> bool:
    """Tell whether readings continue a level: after an outlier, or as clocks drift."""
    _first, stop = level.pieces[-1]
    return (
        abs(middle_ns - level.middle_ns) < _SAME_NS
        or abs(_middle(zeros_ns[first : first + _FEWEST]) - _middle(zeros_ns[stop - _FEWEST : stop])) < _JUMP_NS
    )


def _counting(levels: list[_Level]) -> _Level:
    newest_ns = max(one.middle_ns for one in levels)
    dated = [one for one in levels if newest_ns - one.middle_ns < _HALF_DAY_NS]
    last = dated[-1]
    again = next(at for at, one in enumerate(dated) if abs(one.middle_ns - last.middle_ns) < _SAME_NS)
    learnt = [one for one in dated[again:] if leap_seconds_late(last.middle_ns - one.middle_ns)]
    return min(learnt, key=lambda one: one.middle_ns, default=last)
