"""Tables with UTC in whole seconds beside a counter that tells the fraction."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, Remark, UtcReadings
from groundstation.base.units import NS_PER_S
from groundstation.readers.days import DayCount
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
    modulus_ns : int
        Nanoseconds after which the counter begins anew while UTC goes on; 0: it does not.
    """

    kind: str
    utc_of_zero_ns: int | None
    readings: UtcReadings | None = None
    remarks: tuple[Remark, ...] = ()
    modulus_ns: int = 0


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
    modulus_ns = _modulus_ns(counter_ns, utc_ns, 10**rule.digits * rule.multiple)
    if modulus_ns:
        counter_ns = counter_ns + DayCount().days_ns(counter_ns, np.ones(len(counter_ns), dtype=bool), modulus_ns)
    found = told_at_zero(utc_ns, counter_ns)
    rows = changes if len(changes) else np.array([0])
    readings = UtcReadings(lines[rows], utc_ns[rows] - counter_ns[rows])
    text = f"UTC of the counter's zero by {len(rows)} changes of the second, which agree within {found.spread_s:.2f} s"
    told = [Remark("utc_from_seconds", text), *found.remarks("UTC of the rows")]
    if modulus_ns:
        wraps = f"{rule.names[0]}: the counter begins anew every {modulus_ns / NS_PER_S:g} s, and is counted on"
        told.append(Remark("counter_wraps", wraps))
    return CountedUtc("utc_counter", found.ns, readings, tuple(told), modulus_ns)


def _modulus_ns(counter_ns: Int64Array, utc_ns: Int64Array, tick_ns: int) -> int:
    """Return the period of a counter that begins anew while UTC goes on, ns; 0 of none.

    A restart is none: UTC then stands still for longer, or the counter falls from no such number.

    Examples
    --------
    >>> counter, utc = np.array([65_000, 65_500, 464, 964]) * 10**6, np.array([7, 7, 8, 8]) * NS_PER_S
    >>> _modulus_ns(counter, utc, 10**6), _modulus_ns(counter, utc * 10, 10**6), _modulus_ns(counter // 2, utc, 10**6)
    (65536000000, 0, 0)
    """
    steps = np.diff(counter_ns)
    falls = np.flatnonzero(steps < 0)
    if not len(falls) or not (steps > 0).any():
        return 0
    period_ns = int(np.median(steps[steps > 0]))
    going_on = np.diff(utc_ns)[falls] <= NS_PER_S + 2 * period_ns
    spans = period_ns - steps[falls]
    near = [one for one in _moduli(tick_ns) if np.all(np.abs(spans - one) <= max(period_ns, tick_ns))]
    return near[0] if near and going_on.all() and counter_ns.max() < near[0] else 0


def _moduli(tick_ns: int) -> Iterator[int]:
    """Yield the periods of counters of bits, of decimal digits and of clocks."""
    ticks = (*(1 << bits for bits in (8, 16, 24, 31, 32)), *(10**digits for digits in range(2, 10)))
    yield from (tick_ns * count for count in ticks)
    yield from (NS_PER_S * seconds for seconds in (60, 3600, 43_200, 86_400, 604_800))


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
