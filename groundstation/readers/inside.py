"""Header and comment lines inside a table, as an appended log has at its start."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from groundstation.base.records import Column, Int64Array, NewLog
from groundstation.readers.start import utc_of_zero

NOTHING: Mapping[int, Mapping[str, str]] = MappingProxyType({})


def new_logs(
    lines: Mapping[int, str], told: Mapping[int, Mapping[str, str]] = NOTHING, zero_ns: int | None = None
) -> Iterator[NewLog]:
    """Yield the logs that begin at header or comment lines inside a table.

    Lines that follow one another directly belong to one log.

    Parameters
    ----------
    lines : mapping of line number to text
    told : mapping of line number to facts
        What is known of some of the lines.
    zero_ns : int or None
        UTC of time zero by the header of the file: times below a line that states another one are by this, too.

    Examples
    --------
    >>> [(one.record_index, dict(one.metadata)) for one in new_logs({7: "# aircraft: B", 8: "time_s,ins.roll_deg"})]
    [(7, {'aircraft': 'B'})]
    """
    first, facts = -1, dict[str, str]()
    for number, text in sorted(lines.items()):
        if first >= 0 and number - 1 not in lines:
            yield _new_log(first, facts, zero_ns)
            first, facts = -1, {}
        first = number if first < 0 else first
        facts |= {**told.get(number, {}), **_entry(text)}
    if first >= 0:
        yield _new_log(first, facts, zero_ns)


def _new_log(first: int, facts: Mapping[str, str], zero_ns: int | None) -> NewLog:
    """Return a log with the UTC of its time zero, where it states one."""
    own_ns = utc_of_zero(facts)[0]
    return NewLog(first, facts, own_ns if own_ns is None or zero_ns is None else zero_ns)


def with_own_zeros(time: Column, numbers: Int64Array, lines: Mapping[int, str], zero_ns: int | None) -> Column:
    """Refer times of rows to the time zero of the file's header.

    It shifts the rows below a line that states another time zero.

    Parameters
    ----------
    time : Column of int64, shape (n,)
    numbers : ndarray of int64, shape (n,)
        Line numbers of the rows.
    lines : mapping of line number to text
    zero_ns : int or None
        UTC of time zero by the header of the file; without it no zero is related to it.
    """
    if zero_ns is None or not lines:
        return time
    stated = [(0, zero_ns), *((number, ns) for number, text in sorted(lines.items()) if (ns := _zero_ns(text)))]
    if len(stated) == 1:
        return time
    places, zeros = (np.array(column, dtype=np.int64) for column in zip(*stated, strict=True))
    shift_ns = zeros[np.searchsorted(places, numbers, side="right") - 1] - zero_ns
    return Column(time.values + shift_ns, time.present)


def _zero_ns(text: str) -> int | None:
    """Return the UTC of time zero that a line states."""
    return utc_of_zero(_entry(text))[0]


def _entry(text: str) -> dict[str, str]:
    """Metadata in a comment line."""
    key, colon, value = text.lstrip("#").partition(":")
    return {key.strip(): value.strip()} if text.startswith("#") and colon and key.strip() else {}
