"""Values of a table at other times: joined on time, never by row number.

The largest gap is stated.
"""

from collections.abc import Callable, Iterable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.signals import field_of
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Table

Choice = Literal["previous", "nearest"]
FOREVER_S = 9e9  # some 285 years: what int64 nanoseconds hold
Wrap = Callable[[FloatArray], FloatArray]


def join(
    table: Table,
    at_ns: Int64Array,
    names: Iterable[str] | None = None,
    *,
    largest_gap_s: float,
    choice: Choice = "previous",
) -> Table:
    """The fields of a table at other times.

    Numbers are interpolated linearly between the known samples on either side, headings, longitudes and other angles of
    a full turn along the shorter arc; bool and text are taken from the previous or the nearest sample. Samples that are
    absent or NaN are passed over. Nothing is extrapolated.

    Parameters
    ----------
    table : Table
    at_ns : ndarray of int64, shape (m,)
        Times asked for, in any order.
    names : iterable of str, optional
        Fields, all by default.
    largest_gap_s : float
        Longest step between two samples that is interpolated over, and greatest distance to a sample that is held. A
        time that has a sample takes it whatever lies around.
    choice : {'previous', 'nearest'}
        For bool and text.

    Returns
    -------
    Table
        ``time_ns`` is ``at_ns``; absent where there was no sample near enough. Of several samples of one time numbers
        take the first (as :meth:`Table.unique_times`), a held state the last. ``record_index`` is -1: these are not
        records.

    Examples
    --------
    >>> time_ns = np.array([0, 1]) * NS_PER_S
    >>> ins = Table("ins", time_ns, {"true_heading_deg": Column(np.array([358.0, 4.0]))}, time_ns, Column(time_ns))
    >>> joined = join(ins, np.array([500_000_000, 2_000_000_000]), largest_gap_s=1.0)
    >>> joined.values("true_heading_deg").tolist()
    [1.0, nan]
    """
    wanted = list(table.columns) if names is None else [name for name in names if name in table.columns]
    at = np.asarray(at_ns, dtype=np.int64)
    gap_ns = round(min(largest_gap_s, FOREVER_S) * NS_PER_S)
    columns = {
        name: _interpolated(table, name, at, gap_ns)
        if table.columns[name].values.dtype.kind in "fiu"
        else _held(table, name, at, gap_ns, choice)
        for name in wanted
    }
    nowhere = np.full(len(at), -1, dtype=np.int64)
    return Table(table.topic, at, columns, nowhere, Column(np.zeros(len(at), dtype=np.int64), np.zeros(len(at), bool)))


def values_at(table: Table, name: str, at_ns: Int64Array, *, largest_gap_s: float) -> FloatArray:
    """Return one number field at other times, shape (m,), NaN where not known.

    It is :func:`join` of a single field.
    """
    if name not in table.columns:
        return np.full(len(at_ns), np.nan)
    return join(table, at_ns, [name], largest_gap_s=largest_gap_s).values(name)


def _wrap_of(table: Table, name: str) -> Wrap | None:
    """Return the function that wraps the angles of a field; None for plain numbers.

    Only the angles of a field that goes all the way round are wrapped.
    """
    field = field_of(table.topic, name)
    if field is None or field.unit != "deg":
        return None
    if field.is_heading:
        return wrap_360
    return wrap_180 if field.low <= -180.0 and field.high >= 180.0 else None


def _as_it_is(number: FloatArray) -> FloatArray:
    return number


def _interpolated(table: Table, name: str, at_ns: Int64Array, gap_ns: int) -> Column:
    values = table.values(name)
    time_ns, values = _known_once(table.time_ns, values)
    if not len(values):
        return Column(np.full(len(at_ns), np.nan), np.zeros(len(at_ns), dtype=bool))
    after = np.searchsorted(time_ns, at_ns, side="left")
    right = np.minimum(after, len(values) - 1)
    is_sample = time_ns[right] == at_ns
    left = np.where(is_sample, right, np.maximum(after - 1, 0))
    step_ns = time_ns[right] - time_ns[left]
    is_between = (after > 0) & (after < len(values)) & (step_ns <= gap_ns)
    share = (at_ns - time_ns[left]) / np.maximum(step_ns, 1)
    difference = values[right] - values[left]
    wrap = _wrap_of(table, name) or _as_it_is
    if wrap is not _as_it_is:
        difference = wrap_180(difference)
    joined = wrap(values[left] + share * difference)
    present = is_sample | is_between
    return Column(np.where(present, joined, np.nan), present)


def _known_once(time_ns: Int64Array, values: FloatArray) -> tuple[Int64Array, FloatArray]:
    """Return the times and values that are known, the first of one time.

    Nothing is copied where that is all.
    """
    known = np.isfinite(values)
    if not known.all():
        time_ns, values = time_ns[known], values[known]
    is_first = np.ones(len(time_ns), dtype=bool)
    np.greater(time_ns[1:], time_ns[:-1], out=is_first[1:])
    return (time_ns, values) if is_first.all() else (time_ns[is_first], values[is_first])


def _held(table: Table, name: str, at_ns: Int64Array, gap_ns: int, choice: Choice) -> Column:
    column = table.columns[name]
    known = np.flatnonzero(column.mask)
    if not known.size:
        return Column(np.zeros(len(at_ns), dtype=column.values.dtype), np.zeros(len(at_ns), dtype=bool))
    time_ns = table.time_ns[known]
    before = np.searchsorted(time_ns, at_ns, side="right") - 1  # the last of repeated times
    row, present = _clipped(before, len(known)), before >= 0
    if choice == "nearest":
        after = _clipped(before + 1, len(known))
        is_nearer = ~present | (np.abs(time_ns[after] - at_ns) < np.abs(at_ns - time_ns[row]))
        row, present = np.where(is_nearer, after, row), np.ones(len(at_ns), dtype=bool)
    present = present & (np.abs(at_ns - time_ns[row]) <= gap_ns)
    values = column.values[known[row]]
    return Column(np.where(present, values, np.zeros(1, dtype=values.dtype)), _all_or_mask(present))


def _clipped(row: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    return np.asarray(np.clip(row, 0, count - 1))


def _all_or_mask(present: BoolArray) -> BoolArray | None:
    return None if present.all() else present
