"""Reading of PX4's own topics.

Columns may be missing, estimators several, and counters wrap.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.health.evidence import Evidence, FloatArray
from groundstation.tables.table import Flight, Table

RAW = "raw."
MOST_INSTANCES = 9
SELECTOR = "raw.estimator_selector_status"
BEYOND_REASON = 1e15  # an integer up to here is exact, and no field of an autopilot is larger
NEWEST_OLD_S = 1.0  # a value of another topic that is older says nothing


@dataclass(frozen=True, eq=False)
class Topic:
    """One instance of a topic: its name in the log, number and table."""

    name: str
    instance: int
    table: Table

    def has(self, *fields: str) -> bool:
        """Tell whether each field has at least one finite value."""
        return all(field in self.table.columns and bool(np.isfinite(self.values(field)).any()) for field in fields)

    def values(self, field: str) -> FloatArray:
        """Return a field, NaN where it is absent, not in the log, or no number of this world."""
        column = self.table.columns.get(field)
        if column is None or column.values.dtype.kind not in "fiub":
            return np.full(len(self.table), np.nan)
        value = self.table.values(field)
        return np.where(np.abs(value) < BEYOND_REASON, value, np.nan)

    def vector(self, field: str, size: int = 3) -> FloatArray:
        """Return the elements of an array field, shape (n, size)."""
        return np.column_stack([self.values(f"{field}[{place}]") for place in range(size)])

    def source(self, field: str) -> str:
        """Return topic and field, as an answer quotes them."""
        return f"{self.name}.{field}"

    @property
    def time_ns(self) -> Int64Array:
        """Corrected time of its rows."""
        return self.table.time_ns


def topics(flight: Flight, name: str) -> Iterator[Topic]:
    """Yield the instances of a topic that have rows.

    ``vehicle_imu_status``, ``vehicle_imu_status.1`` ...
    """
    for instance in range(MOST_INSTANCES):
        full = f"{RAW}{name}" if instance == 0 else f"{RAW}{name}.{instance}"
        if full in flight and len(flight[full]):
            yield Topic(full, instance, flight[full])


def topic(flight: Flight, *names: str) -> Topic | None:
    """Return the first instance of the first topic that is there."""
    return next((one for name in names for one in topics(flight, name)), None)


def estimators(flight: Flight, name: str) -> list[tuple[Topic, BoolArray]]:
    """Return the instances of an estimator's topic.

    With each the rows in which it was the one that flew the aircraft.

    Without ``estimator_selector_status`` it is the first.
    """
    found = list(topics(flight, name))
    selector = topic(flight, "estimator_selector_status")
    if selector is None or not selector.has("primary_instance"):
        return [(one, np.ones(len(one.table), dtype=bool)) for one in found[:1]]
    primary = selector.values("primary_instance")
    chosen = []
    for one in found:
        row = np.searchsorted(selector.time_ns, one.time_ns, side="right") - 1
        is_primary = primary[np.maximum(row, 0)] == one.instance
        if is_primary.any():
            chosen.append((one, is_primary))
    return chosen


def evidence_of(
    check: str, quantity: str, sensor: str, one: Topic, field: str, value: FloatArray | None = None, unit: str = ""
) -> Evidence:
    """Return evidence from a field of a topic, or from what was made of it."""
    shown = one.values(field) if value is None else value
    return Evidence(check, quantity, sensor, one.source(field), unit, one.time_ns, shown, one.instance)


def largest(one: Topic, fields: Sequence[str]) -> FloatArray:
    """Return the largest of several fields in each row, NaN where none has a value."""
    values = np.column_stack([one.values(field) for field in fields])
    known = np.isfinite(values)
    return np.where(known.any(axis=1), np.where(known, values, -np.inf).max(axis=1), np.nan)


def counted(value: FloatArray, modulus: int = 256) -> FloatArray:
    """Return a counter that wraps as one that only rises from zero.

    A jump beyond half its range is a new start.

    Examples
    --------
    >>> counted(np.array([254.0, 255.0, 1.0, 0.0])).tolist()
    [0.0, 1.0, 3.0, 3.0]
    """
    known = np.flatnonzero(np.isfinite(value))
    out = np.full(len(value), np.nan)
    if known.size:
        steps = np.diff(value[known]) % modulus
        out[known] = np.concatenate([[0.0], np.cumsum(np.where(steps > modulus / 2, 0.0, steps))])
    return out


def newest(one: Topic, value: NDArray[np.float64], at_ns: Int64Array, oldest_s: float = NEWEST_OLD_S) -> FloatArray:
    """Return the newest row of a topic at given times.

    NaN where there is none or it is too old.

    ``value`` has shape (n,) or (n, k).
    """
    row = np.searchsorted(one.time_ns, at_ns, side="right") - 1
    kept = np.maximum(row, 0)
    is_old = (row < 0) | (at_ns - one.time_ns[kept] > oldest_s * 1e9)
    out = np.array(value[kept], dtype=np.float64)
    out[is_old] = np.nan
    return out
