"""Clock of a table that asks for a look at its rows.

Weeks may have rolled over; a counter stands beside UTC.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.base.records import LogHeader, Remark
from groundstation.base.timescales import ROLLOVER_NS, ROLLOVER_WEEKS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.readers.counted_utc import counted_utc
from groundstation.readers.profile import TimeColumns
from groundstation.readers.rollover import CODE
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source
from groundstation.readers.table_reader import first_times


def with_clock(
    source: Source, header: LogHeader, sections: Sequence[TableSection], time: TimeColumns
) -> tuple[LogHeader, list[TableSection], tuple[Remark, ...]]:
    """Return header and sections with the clock that the rows show, and remarks on it."""
    if time.kind == "gps_week":
        weeks, remarks = _rolled_over(source, sections[0], time.earliest_year)
        return header, [_timed(one, weeks=weeks) for one in sections] if weeks else list(sections), remarks
    if time.kind == "utc_counter":
        found = counted_utc(source, sections[0])
        header = replace(
            header,
            utc_of_zero_ns=found.utc_of_zero_ns,
            has_counting_clock=found.kind == "utc_counter",
            utc_readings=found.readings,
        )
        return header, [_timed(one, kind=found.kind, modulus_ns=found.modulus_ns) for one in sections], found.remarks
    return header, list(sections), ()


def _timed(section: TableSection, **changes: Any) -> TableSection:
    time = replace(section.layout.time, **changes)
    return replace(section, layout=replace(section.layout, time=time))


def _rolled_over(source: Source, section: TableSection, year: int) -> tuple[int, tuple[Remark, ...]]:
    """Return the weeks to add to those of the rows, and remarks on them."""
    times, _zoneless = first_times(source, section.dialect, section.layout)
    rows = np.flatnonzero(times.mask)
    if not len(rows) or not year:
        return 0, ()
    told_ns, earliest_ns = int(times.values[rows[0]]), iso_to_utc_ns(f"{year}-01-01T00:00:00Z")[0]
    count = -(-max(0, earliest_ns - told_ns) // ROLLOVER_NS)
    if not count:
        return 0, ()
    dates = [utc_ns_to_iso(told_ns + number * ROLLOVER_NS, 0)[:10] for number in (0, count)]
    text = f"the date told, {dates[0]}, is before {year}, so the GPS week rolled over: read as {dates[1]}"
    return count * ROLLOVER_WEEKS, (Remark(CODE, text),)
