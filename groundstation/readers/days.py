"""Days and weeks that pass in times of the day and of the week; a day told as text."""

from dataclasses import field
from datetime import datetime

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.months import with_number

_DAY_NS = 86_400 * NS_PER_S
ROLLOVER_WEEKS = 1024
_WEEK_NS, _NEAR_NS = 7 * _DAY_NS, 3600 * NS_PER_S  # an hour about the end of a week
_LAST_NS = 2**62 - _DAY_NS  # as that of times in cells
_EPOCH_DAY = datetime(1970, 1, 1).toordinal()


def day_ns(text: str, formats: tuple[str, ...]) -> int | None:
    """Return the beginning of a day, ns since 1970; None where no strptime format fits.

    The name of a month (%b, %B) may be that of another language.

    Examples
    --------
    >>> day_ns("2/1/70", ("%Y-%m-%d", "%d/%m/%y"))
    86400000000000
    >>> day_ns("2 Jän 1970", ("%d %b %Y",))
    86400000000000
    """
    text = with_number(text)
    for form in formats:
        try:
            found_ns = (
                datetime.strptime(text, form.replace("%b", "%m").replace("%B", "%m")).toordinal() - _EPOCH_DAY
            ) * _DAY_NS
        except ValueError:
            continue
        if abs(found_ns) < _LAST_NS:
            return found_ns
    return None


@dataclass
class WeekCount:
    """Week that a writer counts late.

    Its seconds begin anew at midnight of Saturday, and the week stays. ``late`` is the week that stands for the one
    after it, ``first`` the week of the first row, ``rows`` counts the rows that have it.
    """

    late: int | None = None
    first: int | None = None
    rows: int = 0
    _last: tuple[int, int] = (-1, 0)

    def rollovers(self, week: FloatArray) -> FloatArray:
        """Return 1024 weeks for each row behind a rollover inside the file, shape (n,).

        Examples
        --------
        >>> WeekCount().rollovers(np.array([1023.0, 0.0, 1.0])).tolist()
        [0.0, 1024.0, 1024.0]
        """
        if self.first is None and len(week):
            self.first = int(week[0])
        return np.where(week < (self.first or 0) - ROLLOVER_WEEKS / 2, float(ROLLOVER_WEEKS), 0.0)

    def to_add(self, week: Int64Array, second_ns: Int64Array) -> Int64Array:
        """Return the weeks to add to those of rows, shape (n,).

        Examples
        --------
        >>> hour = 3600 * NS_PER_S
        >>> seconds = np.array([168 * hour - 1, 0, hour, 2 * hour])
        >>> WeekCount().to_add(np.array([7, 7, 7, 8]), seconds).tolist()
        [0, 1, 1, 0]
        """
        found = np.zeros(len(week), dtype=np.int64)
        if not len(week):
            return found
        before, second_before = np.append(self._last[0], week[:-1]), np.append(self._last[1], second_ns[:-1])
        is_turn = (week == before) & (second_before > _WEEK_NS - _NEAR_NS) & (second_before < _WEEK_NS)
        is_turn &= second_ns < _NEAR_NS
        self._last = int(week[-1]), int(second_ns[-1])
        if self.late is None and not is_turn.any():
            return found
        for at in np.flatnonzero(is_turn | (week != before) | (np.arange(len(week)) == 0)).tolist():
            number = int(week[at])
            self.late = number if is_turn[at] else self.late if number == self.late else None
            found[at:] = self.late is not None
        self.rows += int(found.sum())
        return found


@dataclass
class DayCount:
    """Days that have passed since the first row, where rows tell the time of the day alone.

    A time that is most of a day before the one above is of the next day; a clock that is set goes back by less.
    """

    weeks: WeekCount = field(default_factory=WeekCount)
    _last_ns: int = -1
    _days: int = 0

    def days_ns(self, time_ns: Int64Array, present: BoolArray, period_ns: int = _DAY_NS) -> Int64Array:
        """Return the time to add to times of the day, nanoseconds, shape (n,).

        A counter that wraps has another period.

        Examples
        --------
        >>> hours = np.array([23, 0, 1, 23]) * 3600 * NS_PER_S
        >>> (DayCount().days_ns(hours, np.ones(4, dtype=bool)) // (86400 * NS_PER_S)).tolist()
        [0, 1, 1, 0]
        """
        known = time_ns[present]
        if not len(known):
            return np.zeros(len(time_ns), dtype=np.int64)
        before = np.append(known[0] if self._last_ns < 0 else self._last_ns, known[:-1])
        steps = known - before
        days = self._days + np.cumsum((steps < -period_ns // 2).astype(np.int64) - (steps > period_ns // 2))
        self._last_ns, self._days = int(known[-1]), int(days[-1])
        found = np.zeros(len(time_ns), dtype=np.int64)
        found[present] = days * period_ns
        return found
