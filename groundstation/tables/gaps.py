"""Gaps in the times of a table: find them, split at them, break plotted lines there."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Table

STEPS_OF_A_GAP = 3.0


@dataclass(frozen=True)
class Gap:
    """Stretch without samples: after row ``row`` at ``start_ns``, nothing for ``length_s``."""

    row: int
    start_ns: int
    length_s: float

    @property
    def end_ns(self) -> int:
        """Time of the first sample after the gap."""
        return self.start_ns + round(self.length_s * NS_PER_S)


def largest_step_s(time_ns: Int64Array, steps: float = STEPS_OF_A_GAP, at_least_s: float = 0.0) -> float:
    """Return the longest step that is not a gap.

    A gap is a step longer than ``steps`` median steps, and than ``at_least_s``. Repeated times do not count as steps.
    Fewer than two different times have no step: infinity.

    Examples
    --------
    >>> largest_step_s(np.array([0, 0, 20, 40, 60]) * 1_000_000)
    0.06
    """
    steps_ns = np.diff(time_ns)
    steps_ns = steps_ns[steps_ns > 0]
    if not steps_ns.size:
        return float("inf")
    return max(steps * float(np.median(steps_ns)) / NS_PER_S, at_least_s)


def seconds_covered(time_s: FloatArray, longest_gap_s: float) -> float:
    """Seconds that samples stand for: the steps between them that are no gap."""
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if len(steps) else 0.0
    return float(steps[steps <= max(longest_gap_s, 3.0 * usual)].sum())


def find_gaps(table: Table, *names: str, largest_s: float | None = None) -> tuple[Gap, ...]:
    """Gaps of a table in order of time.

    Parameters
    ----------
    table : Table
    names : str
        Fields that must be known (present and finite) for a row to count; none: every row counts.
    largest_s : float, optional
        Longest step that is no gap. Default: :func:`largest_step_s` of the rows that count.

    Examples
    --------
    >>> time_ns = np.array([0, 1, 2, 9, 10]) * NS_PER_S
    >>> table = Table("gnss", time_ns, {}, np.arange(5), Column(time_ns))
    >>> find_gaps(table)
    (Gap(row=2, start_ns=2000000000, length_s=7.0),)
    """
    rows = np.flatnonzero(table.valid(*names))
    time_ns = table.time_ns[rows]
    after = _rows_before_gaps(time_ns, largest_s)
    lengths_s = (time_ns[after + 1] - time_ns[after]) / NS_PER_S
    return tuple(
        Gap(int(row), int(start_ns), float(length_s))
        for row, start_ns, length_s in zip(rows[after], time_ns[after], lengths_s, strict=True)
    )


def split_at_gaps(table: Table, *, largest_s: float | None = None) -> tuple[Table, ...]:
    """The pieces of a table between its gaps, none for an empty table; nothing is copied."""
    if not len(table):
        return ()
    after = _rows_before_gaps(table.time_ns, largest_s)
    bounds = [0, *(int(row) + 1 for row in after), len(table)]
    return tuple(table.take(slice(start, end)) for start, end in pairwise(bounds))


def with_gap_breaks(table: Table, *, largest_s: float | None = None) -> Table:
    """A table for plotting: one row of NaN in every gap, so that a line breaks there.

    The row stands one nanosecond after the last sample. Its numbers are NaN and present (a plot must get them; integers
    become floats when there is a gap), bool and text absent, its place in the source -1.
    """
    after = _rows_before_gaps(table.time_ns, largest_s)
    if not after.size:
        return table
    at = after + 1
    return Table(
        table.topic,
        np.insert(table.time_ns, at, table.time_ns[after] + 1),
        {name: _broken(column, at) for name, column in table.columns.items()},
        np.insert(table.record_index, at, -1),
        Column(np.insert(table.device_time_ns.values, at, 0), np.insert(table.device_time_ns.mask, at, False)),
    )


def break_lines(
    time_ns: Int64Array, columns: Sequence[FloatArray], *, largest_s: float | None = None
) -> tuple[Int64Array, tuple[FloatArray, ...]]:
    """Insert a row of NaN in every gap of float columns, each (n,) or (n, k).

    The times get a row there, too, as in :func:`with_gap_breaks`.
    """
    after = _rows_before_gaps(time_ns, largest_s)
    at = after + 1
    broken = tuple(np.insert(np.asarray(column, dtype=np.float64), at, np.nan, axis=0) for column in columns)
    return np.insert(time_ns, at, time_ns[after] + 1), broken


def _rows_before_gaps(time_ns: Int64Array, largest_s: float | None) -> NDArray[np.intp]:
    limit_s = largest_step_s(time_ns) if largest_s is None else largest_s
    return np.flatnonzero(np.diff(time_ns) > limit_s * NS_PER_S)


def _broken(column: Column, at: NDArray[np.intp]) -> Column:
    kind = column.values.dtype.kind
    if kind in "fiu":
        values = column.values if kind == "f" else column.values.astype(np.float64)
        present = None if column.present is None else np.insert(column.present, at, True)
        return Column(np.insert(values, at, np.nan), present)
    mask: BoolArray = np.insert(column.mask, at, False)
    return Column(np.insert(column.values, at, np.zeros(1, dtype=column.values.dtype)[0]), mask)
