"""Days: the beginning of one told as text, and the days that pass in times of the day."""

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S

_DAY_NS = 86_400 * NS_PER_S
_LAST_NS = 2**62 - _DAY_NS  # as that of times in cells
_EPOCH_DAY = datetime(1970, 1, 1).toordinal()


def day_ns(text: str, formats: tuple[str, ...]) -> int | None:
    """Return the beginning of a day, ns since 1970; None where no strptime format fits.

    Examples
    --------
    >>> day_ns("2/1/70", ("%Y-%m-%d", "%d/%m/%y"))
    86400000000000
    """
    for form in formats:
        try:
            found_ns = (datetime.strptime(text, form).toordinal() - _EPOCH_DAY) * _DAY_NS
        except ValueError:
            continue
        if abs(found_ns) < _LAST_NS:
            return found_ns
    return None


@dataclass
class DayCount:
    """Days that have passed since the first row, where rows tell the time of the day alone.

    A time that is most of a day before the one above is of the next day; a clock that is set goes back by less.
    """

    _last_ns: int = -1
    _days: int = 0

    def days_ns(self, time_ns: Int64Array, present: BoolArray) -> Int64Array:
        """Return the time to add to times of the day, nanoseconds, shape (n,).

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
        days = self._days + np.cumsum((steps < -_DAY_NS // 2).astype(np.int64) - (steps > _DAY_NS // 2))
        self._last_ns, self._days = int(known[-1]), int(days[-1])
        found = np.zeros(len(time_ns), dtype=np.int64)
        found[present] = days * _DAY_NS
        return found
