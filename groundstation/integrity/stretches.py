"""Stretches in which a field does not change, and places of records in time.

They are found batch by batch.
"""

from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.integrity.clock import ClockModel

MOST_STRETCHES = 512  # kept of a field: the longest
CHANGES_MEASURED = 512  # number of changes of a batch that are measured
FloatArray = NDArray[np.float64]


class RecordPlace(NamedTuple):
    """Place of a record: its number in the source, and its device time (0 if it has none)."""

    record_index: int
    device_ns: int

    def time_ns(self, clock: ClockModel) -> int:
        """Return the corrected time of the record."""
        time = clock.time_ns(np.array([self.record_index]), Column(np.array([self.device_ns], dtype=np.int64)))
        return int(time[0])


class ConstantStretch(NamedTuple):
    """Consecutive samples with one value: the first, the last, their number."""

    first: RecordPlace
    last: RecordPlace
    samples: int
    value: float


_STRETCH = np.dtype(
    [
        ("first_index", np.int64),
        ("first_ns", np.int64),
        ("last_index", np.int64),
        ("last_ns", np.int64),
        ("samples", np.int64),
        ("value", np.float64),
    ]
)


class Constancy:
    """Lengths of the stretches over which a field keeps its value.

    Attributes
    ----------
    samples, changes : int
        Finite samples so far, and how many of them differ from the one before.

    ``has_steps`` false: nobody asks for the resolution, and it stays 0.
    """

    def __init__(self, min_samples: int, has_steps: bool = True) -> None:
        self._has_steps = has_steps
        self.samples = self.changes = 0
        self._step = self._smallest = 0.0
        self._min_samples = min_samples
        self._kept: list[NDArray[Any]] = []  # ended, and long enough
        self._open = np.zeros(0, dtype=_STRETCH)  # the one that may go on, once there is one

    def add(
        self, values: FloatArray, record_index: Int64Array, device_ns: Int64Array, rows: Int64Array | None = None
    ) -> None:
        """Add more samples, all finite.

        ``rows`` are their rows in the batch; without them, the samples are all of it.
        """
        count = len(values)
        if not count:
            return
        differs: BoolArray = values[1:] != values[:-1]
        changes = int(np.count_nonzero(differs))
        if changes == count - 1:  # every sample differs: the usual case of what is measured
            starts = np.array([0, count - 1] if count > 1 else [0])
            ends = starts + 1
        else:
            borders = np.flatnonzero(differs) + 1
            starts, ends = _ends_and_long(borders, count, self._min_samples)
            if self._has_steps:
                self._measure(values, differs, borders[:CHANGES_MEASURED])
        first, last = (starts, ends - 1) if rows is None else (rows[starts], rows[ends - 1])
        found = np.empty(len(starts), dtype=_STRETCH)
        found["first_index"], found["first_ns"] = record_index[first], device_ns[first]
        found["last_index"], found["last_ns"] = record_index[last], device_ns[last]
        found["samples"], found["value"] = ends - starts, values[starts]
        self.samples += count
        self.changes += changes
        if len(self._open) and self._open["value"][0] == found["value"][0]:
            found["samples"][0] += self._open["samples"][0]
            found["first_index"][0], found["first_ns"][0] = self._open["first_index"][0], self._open["first_ns"][0]
        else:
            self.changes += len(self._open)
            self._keep(self._open)
        self._keep(found[:-1])
        self._open = found[-1:]

    def _measure(self, values: FloatArray, differs: BoolArray, changed: Int64Array) -> None:
        """Take note of the smallest of some changes; ``changed`` are the samples behind them."""
        if not len(changed):
            return
        with np.errstate(over="ignore", invalid="ignore"):  # from one end of a float to the other, or no numbers
            smallest = float(np.abs(values[changed] - values[changed - 1]).min())
            step = _step_between_held(values, differs, changed)
        self._smallest = min(self._smallest or smallest, smallest)
        self._step = min(self._step or step, step or self._step)

    @property
    def resolution(self) -> float:
        """Smallest step from one value that lasts to the next.

        A value interpolated between the two, by a reader that puts fields on one clock, is no step. Where values never
        last one after the other, the smallest change of a batch with some that did not change; 0 without any.
        """
        return self._step or self._smallest

    def stretches(self, times_usual: float = 0.0) -> list[ConstantStretch]:
        """Return the long stretches, in the order of the log.

        Each has at least so many times the samples of the others (:meth:`usual_samples`).
        """
        self._keep(self._open)
        self._open = self._open[:0]
        found = []
        for kept in self._kept:
            samples = kept["samples"]
            others = (self.samples - samples) / self.changes if self.changes else np.full(len(kept), np.inf)
            found += kept[samples >= times_usual * others].tolist() if times_usual else kept.tolist()
        found.sort(key=itemgetter(0))
        return [ConstantStretch(RecordPlace(*row[:2]), RecordPlace(*row[2:4]), *row[4:]) for row in found]

    def usual_samples(self, without: ConstantStretch) -> float:
        """Mean length of all other stretches; infinite when there is none."""
        others = self.changes
        return (self.samples - without.samples) / others if others else float("inf")

    def _keep(self, ended: NDArray[Any]) -> None:
        long = ended[ended["samples"] >= self._min_samples]
        if not len(long):
            return
        self._kept.append(long)
        if sum(map(len, self._kept)) > MOST_STRETCHES:
            kept = np.concatenate(self._kept)
            self._kept = [kept[np.argsort(-kept["samples"], kind="stable")[: MOST_STRETCHES // 2]]]


def _step_between_held(values: FloatArray, differs: BoolArray, changed: Int64Array) -> float:
    """Return the smallest step from one value that lasts to the next; 0 without any.

    A value lasts for two samples or more, and at most one sample lies between the two. ``changed`` are the samples
    behind the changes to be looked at, ``differs`` tells which samples the next one differs from.
    """
    inside = changed[(changed >= 2) & (changed < len(differs))]
    inside = inside[~differs[inside - 2]]  # those before which a value lasted
    is_next = ~differs[inside]
    apart = inside[~is_next]
    apart = apart[apart + 1 < len(differs)]
    apart = apart[~differs[apart + 1]]
    steps = np.concatenate(
        (np.abs(values[inside] - values[inside - 1])[is_next], np.abs(values[apart + 1] - values[apart - 1]))
    )
    steps = steps[steps > 0.0]
    return float(steps.min()) if len(steps) else 0.0


def _ends_and_long(borders: Int64Array, count: int, min_samples: int) -> tuple[Int64Array, Int64Array]:
    """Return starts and ends of the first, the last and the long stretches of samples.

    ``borders`` are those of the ``count`` samples that differ from the one before.
    """
    if not len(borders):
        return np.array([0]), np.array([count])
    long = np.flatnonzero(borders[1:] - borders[:-1] >= min_samples)
    starts = np.concatenate(([0], borders[long], borders[-1:]))
    return starts, np.concatenate((borders[:1], borders[long + 1], [count]))


class Sampler:
    """Sample of a topic's rows, evenly spread: never more than ``most`` however long it is."""

    def __init__(self, most: int = 16_384) -> None:
        self._most, self._every, self._seen = most, 1, 0
        self._parts: list[tuple[Int64Array, dict[str, NDArray[Any]]]] = []
        self._count = 0

    def rows(self, count: int) -> slice:
        """Return the slice of the next rows that are wanted."""
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
        """Return places and values of the kept rows; NaN where a part lacks a field."""
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
