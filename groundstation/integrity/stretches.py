"""Stretches in which a field does not change, found batch by batch, and where records stand in time."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.integrity.clock import Clock

MOST_STRETCHES = 512  # kept of a field: the longest
CHANGES_MEASURED = 512  # of a batch
FloatArray = NDArray[np.float64]


class Place(NamedTuple):
    """Where a record stands: its number in the source, and its device time (0 where it has none)."""

    record_index: int
    device_ns: int

    def time_ns(self, clock: Clock) -> int:
        """Its corrected time."""
        time = clock.time_ns(np.array([self.record_index]), Column(np.array([self.device_ns], dtype=np.int64)))
        return int(time[0])


class Stretch(NamedTuple):
    """Samples in a row with one value: the first, the last, how many."""

    first: Place
    last: Place
    samples: int
    value: float


class Constancy:
    """How long a field keeps its value.

    Attributes
    ----------
    samples, changes : int
        Finite samples so far, and how many of them differ from the one before.
    resolution : float
        Smallest change seen while some samples did not change; 0 when that never happened.
    """

    def __init__(self, min_samples: int) -> None:
        self.samples = self.changes = 0
        self.resolution = 0.0
        self._min_samples = min_samples
        self._kept: list[Stretch] = []
        self._open: Stretch | None = None

    def add(
        self, values: FloatArray, record_index: Int64Array, device_ns: Int64Array, rows: Int64Array | None = None
    ) -> None:
        """Go on with more samples, all of them finite; ``rows`` of the batch they stand in, all of it without."""
        count = len(values)
        if not count:
            return
        differs: BoolArray = values[1:] != values[:-1]
        changes = int(np.count_nonzero(differs))
        before = self._open
        joins = before is not None and before.value == values[0]
        self.samples += count
        self.changes += changes + int(before is not None and not joins)
        for start, end in _ends_and_long(differs, changes, self._min_samples):
            ends = (start, end - 1) if rows is None else (rows[start], rows[end - 1])
            first, last = (Place(int(record_index[row]), int(device_ns[row])) for row in ends)
            stretch = Stretch(first, last, end - start, float(values[start]))
            if start == 0 and before is not None and joins:
                stretch = Stretch(before.first, last, before.samples + stretch.samples, before.value)
            elif self._open is not None:
                self._keep(self._open)
            self._open = stretch
        if 0 < changes < count - 1:
            at = np.flatnonzero(differs)[:CHANGES_MEASURED]
            smallest = float(np.abs(values[at + 1] - values[at]).min())
            self.resolution = min(self.resolution or smallest, smallest)

    def stretches(self) -> list[Stretch]:
        """The long ones, in the order of the log."""
        if self._open is not None:
            self._keep(self._open)
            self._open = None
        return sorted(self._kept, key=lambda stretch: stretch.first.record_index)

    def usual_samples(self, without: Stretch) -> float:
        """Mean length of all other stretches; infinite when there is none."""
        others = self.changes
        return (self.samples - without.samples) / others if others else float("inf")

    def _keep(self, stretch: Stretch) -> None:
        if stretch.samples >= self._min_samples:
            self._kept.append(stretch)
        if len(self._kept) > MOST_STRETCHES:
            self._kept = sorted(self._kept, key=lambda one: -one.samples)[: MOST_STRETCHES // 2]


def _ends_and_long(differs: BoolArray, changes: int, min_samples: int) -> list[tuple[int, int]]:
    """The first and the last stretch of some samples, and the long ones between: where they start and end."""
    count = len(differs) + 1
    if changes == count - 1:  # every sample differs: the usual case of what is measured
        return [(0, 1), (count - 1, count)] if count > 1 else [(0, 1)]
    starts = np.concatenate(([0], np.flatnonzero(differs) + 1)) if changes else np.zeros(1, dtype=np.int64)
    ends = np.append(starts[1:], count)
    wanted = ends - starts >= min_samples
    wanted[0] = wanted[-1] = True
    return [(int(start), int(end)) for start, end in zip(starts[wanted], ends[wanted], strict=True)]


class Sampler:
    """Some rows of a topic, evenly spread however long it is: never more than ``most``."""

    def __init__(self, most: int = 16_384) -> None:
        self._most, self._every, self._seen = most, 1, 0
        self._parts: list[tuple[Int64Array, dict[str, NDArray[Any]]]] = []
        self._count = 0

    def rows(self, count: int) -> slice:
        """Which of the next rows are wanted."""
        first = -self._seen % self._every
        self._seen += count
        return slice(first, None, self._every)

    def put(self, index: Int64Array, columns: dict[str, NDArray[Any]]) -> None:
        """Keep the rows that were asked for."""
        if not len(index):
            return
        self._parts.append((index, columns))
        self._count += len(index)
        while self._count > self._most:
            kept_index, kept = self.all()
            self._parts = [(kept_index[::2], {name: values[::2] for name, values in kept.items()})]
            self._count, self._every = len(kept_index[::2]), 2 * self._every

    def all(self) -> tuple[Int64Array, dict[str, NDArray[Any]]]:
        """Places and values of what is kept; NaN where a part lacks a field."""
        if not self._parts:
            return np.zeros(0, dtype=np.int64), {}
        if len(self._parts) == 1:
            return self._parts[0]
        names = dict.fromkeys(name for _index, columns in self._parts for name in columns)
        index = np.concatenate([index for index, _columns in self._parts])
        whole = {
            name: np.concatenate(
                [columns[name] if name in columns else np.full(len(part), np.nan) for part, columns in self._parts]
            )
            for name in names
        }
        self._parts = [(index, whole)]
        return index, whole
