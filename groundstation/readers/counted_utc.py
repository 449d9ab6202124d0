"""Tables with UTC in whole seconds beside a counter that tells the fraction."""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.records import Int64Array, Remark, UtcReadings
from groundstation.base.units import NS_PER_S
from groundstation.readers.layout import TableLayout, TimeRule
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source
from groundstation.readers.start import told_at_zero
from groundstation.readers.table_reader import all_times


@dataclass(frozen=True, eq=False)
class CountedUtc:
    """Form of a counter beside UTC, and UTC of its zero.

    Parameters
    ----------
    kind : {'utc_counter', 'utc_fraction'}
        The counter runs on, or begins anew with each second.
    utc_of_zero_ns : int, optional
    readings : UtcReadings, optional
        Of a counter that runs on, at the rows where another second begins.
    remarks : tuple of Remark
    """

    kind: str
    utc_of_zero_ns: int | None
    readings: UtcReadings | None = None
    remarks: tuple[Remark, ...] = ()


def counted_utc(source: Source, section: TableSection) -> CountedUtc:
    """Find out how a counter beside UTC counts, and its zero.

    A row where the second changes comes up to one period of the rows after the change: UTC by the counter is late by
    half of that in the mean. A counter that falls where the second changes counts the fraction of the second.
    """
    rule = section.layout.time
    utc = TimeRule(
        "iso" if len(rule.columns) == 2 else "local", rule.columns[1:], rule.names, date_formats=rule.date_formats
    )
    lines, counter_ns, utc_ns = _both(source, section, utc)
    if not len(lines):
        return CountedUtc("utc_counter", None, remarks=(Remark("no_utc", "no row has UTC beside its counter"),))
    changes = np.flatnonzero(np.diff(utc_ns)) + 1
    steps = counter_ns[changes] - counter_ns[changes - 1]
    if len(steps) and np.median(steps) < 0 and counter_ns.min() >= 0 and counter_ns.max() < 2 * NS_PER_S:
        text = f"{rule.names[0]}: the counter begins anew with each second: it is its fraction"
        return CountedUtc("utc_fraction", 0, remarks=(Remark("utc_fraction", text),))
    found = told_at_zero(utc_ns, counter_ns)
    rows = changes if len(changes) else np.array([0])
    readings = UtcReadings(lines[rows], utc_ns[rows] - counter_ns[rows])
    text = f"UTC of the counter's zero by {len(rows)} changes of the second, which agree within {found.spread_s:.2f} s"
    return CountedUtc(
        "utc_counter", found.ns, readings, (Remark("utc_from_seconds", text), *found.remarks("UTC of the rows"))
    )


def _both(source: Source, section: TableSection, utc: TimeRule) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Line numbers, counter and UTC of the rows that have both."""
    found: list[tuple[Int64Array, Int64Array, Int64Array]] = []
    of_utc = replace(section, layout=TableLayout(utc, (), decimal_comma=False, missing=section.layout.missing))
    for (lines, counter), (_lines, told) in zip(all_times(source, section), all_times(source, of_utc), strict=True):
        both = counter.mask & told.mask
        found.append((lines[both], counter.values[both], told.values[both]))
    if not found:
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing, nothing
    lines, counter_ns, utc_ns = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return lines, counter_ns, utc_ns
