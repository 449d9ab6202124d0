"""Raw messages whose names, fields and numbering changed between versions."""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.nearest import nearest_rows
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]
INSTANCE_FIELDS = ("I", "C", "Instance", "Inst", "IMU", "instance")
MOST_INSTANCES = 16


class Logged(NamedTuple):
    """Records of one sensor."""

    table: Table
    instance: int


class Series(NamedTuple):
    """Values along corrected time, shape (n,) each."""

    time_ns: Int64Array
    value: FloatArray


def instances(flight: Flight, *names: str) -> tuple[Logged, ...]:
    """Return the records of each sensor of a type.

    ``names`` are the types in which firmware numbers the sensors, ``("GPS", "GPS2")``; a type with a field for the
    instance has a topic for each, ``raw.GPS.0``, or one topic with them mixed.
    """
    found: dict[int, Table] = {}
    for place, name in enumerate(names):
        pattern = re.compile(rf"raw\.{re.escape(name)}(?:\.(\d+))?")
        for topic in flight.topics():
            match = pattern.fullmatch(topic)
            if match and len(flight[topic]):
                for instance, table in _apart(flight[topic], int(match[1]) if match[1] else place):
                    found.setdefault(instance, table)
    return tuple(Logged(found[instance], instance) for instance in sorted(found))


def _apart(table: Table, otherwise: int) -> Iterator[tuple[int, Table]]:
    """Yield the instances that are mixed in a table; the table itself where it is of one."""
    field = next((name for name in INSTANCE_FIELDS if is_number(table, name)), None)
    if field is None:
        yield otherwise, table
        return
    value = table.values(field)
    every = np.unique(value[np.isfinite(value)])
    if len(every) < 2 or len(every) > MOST_INSTANCES:
        yield int(every[0]) if len(every) == 1 and every[0] >= 0 else otherwise, table
        return
    for one in every[every >= 0]:
        yield int(one), table.take(value == one)


def is_number(table: Table, *names: str) -> bool:
    """Tell whether fields are there with numbers.

    A field that became text in some firmware is not, nor one that is not a number throughout.
    """
    return all(table.has(name) and _is_number(table, name) for name in names)


def _is_number(table: Table, name: str) -> bool:
    kind = table.columns[name].values.dtype.kind
    return kind in "iub" or (kind == "f" and bool(np.isfinite(table.values(name)).any()))


def named(table: Table, *names: str) -> str:
    """Return the first of some names under which the table has numbers; empty without one."""
    return next((name for name in names if is_number(table, name)), "")


def is_integer(table: Table, name: str) -> bool:
    """Tell whether a field was logged as an integer: old firmware counted hundredths in them."""
    return table.columns[name].values.dtype.kind in "iu"


def length(table: Table, names: tuple[str, ...]) -> FloatArray:
    """Return the length of a vector of three fields, shape (n,)."""
    return np.sqrt(sum(np.square(table.values(name)) for name in names))


def at(series: Series, time_ns: Int64Array, largest_gap_s: float = 1.0) -> FloatArray:
    """Interpolate linearly; NaN outside, and in gaps that are too long."""
    finite = np.isfinite(series.value)
    time, value = series.time_ns[finite], series.value[finite]
    if len(time) < 2:
        return np.full(len(time_ns), np.nan)
    zero = int(time[0])
    found = np.interp((time_ns - zero) / NS_PER_S, (time - zero) / NS_PER_S, value, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(time, time_ns, side="left"), 1, len(time) - 1)
    return np.where((time[after] - time[after - 1]) / NS_PER_S > largest_gap_s, np.nan, found)


def latest(series: Series, time_ns: Int64Array) -> FloatArray:
    """Return the newest value at each time; NaN before the first."""
    finite = np.isfinite(series.value)
    time, value = series.time_ns[finite], series.value[finite]
    if not len(time):
        return np.full(len(time_ns), np.nan)
    place = np.searchsorted(time, time_ns, side="right") - 1
    return np.where(place >= 0, value[np.maximum(place, 0)], np.nan)


def nearest(time_ns: Int64Array, other_ns: Int64Array, largest_gap_s: float) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the place of the nearest other sample, and whether it is near enough.

    Of two as near it is the earlier one.
    """
    if not len(other_ns):
        return np.zeros(len(time_ns), dtype=np.intp), np.zeros(len(time_ns), dtype=bool)
    place = nearest_rows(other_ns, time_ns)
    return place, np.asarray(np.abs(other_ns[place] - time_ns) / NS_PER_S <= largest_gap_s)


def bit(value: FloatArray, number: int) -> FloatArray:
    """Return a bit of a mask as 0 or 1, NaN where the mask is absent."""
    known = np.isfinite(value)
    mask = np.where(known, value, 0.0).astype(np.int64)
    return np.where(known, ((mask >> number) & 1).astype(np.float64), np.nan)


def changes(series: Series) -> NDArray[np.intp]:
    """Return the places at which a value differs from the last known one before."""
    known = np.flatnonzero(np.isfinite(series.value))
    return np.asarray(known[1:][np.diff(series.value[known]) != 0.0])


def counted(series: Series) -> FloatArray:
    """Return how often a value has changed so far, shape (n,); NaN where it is absent."""
    step = np.zeros(len(series.value))
    step[changes(series)] = 1.0
    return np.where(np.isfinite(series.value), np.cumsum(step), np.nan)


def low_pass(time_s: FloatArray, value: FloatArray, constant_s: float, longest_step_s: float) -> FloatArray:
    """Filter columns by y += (x - y) dt / constant, from 0; shape as ``value``.

    A missing value leaves the filter where it is. Steps of time are cut at ``longest_step_s``. Blocks are short enough
    for the product of the factors not to underflow.
    """
    step = np.minimum(np.diff(time_s, prepend=time_s[0]), longest_step_s)
    gain = np.clip(step / constant_s, 0.0, 1.0 - 1e-9)[:, None]
    gain = np.where(np.isfinite(value).all(axis=1, keepdims=True), gain, 0.0)
    clean, out, last = np.nan_to_num(value), np.empty_like(value), np.zeros(value.shape[1])
    for start in range(0, len(value), 256):
        part = slice(start, start + 256)
        kept = np.cumprod(1.0 - gain[part], axis=0)
        out[part] = kept * (last + np.cumsum(gain[part] * clean[part] / kept, axis=0))
        last = out[part][-1]
    return out


def mean_over(time_s: FloatArray, value: FloatArray, window_s: float) -> FloatArray:
    """Return the mean of the window before each sample; NaN until the window is full."""
    total = np.vstack([np.zeros(value.shape[1]), np.cumsum(np.nan_to_num(value), axis=0)])
    known = np.concatenate([[0], np.cumsum(np.isfinite(value).all(axis=1))])
    first = np.searchsorted(time_s, time_s - window_s, side="right")
    last = np.arange(1, len(time_s) + 1)
    count = (known[last] - known[first]).astype(np.float64)[:, None]
    mean = (total[last] - total[first]) / np.where(count > 0, count, np.nan)
    return np.where((time_s - time_s[0] >= window_s)[:, None], mean, np.nan)


def lasting(time_s: FloatArray, is_true: BoolArray, hold_s: float) -> BoolArray:
    """Tell where a condition has held for so long."""
    changed = np.flatnonzero(np.diff(is_true, prepend=not is_true[0])) if len(is_true) else np.zeros(0, dtype=np.intp)
    if not len(changed):
        return np.zeros(len(is_true), dtype=bool)
    begun = time_s[changed[np.searchsorted(changed, np.arange(len(is_true)), side="right") - 1]]
    return np.asarray(is_true & (time_s - begun >= hold_s))
