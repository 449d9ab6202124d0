"""Steps of the clock that stamped the records on receipt, as offsets by record.

They are found by clocks whose readings are in the records.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.readers.two_clocks import ClockStretch, ReadingSequence


class ClockJump(NamedTuple):
    """Two consecutive records between which the receiver's clock falls, or leaps.

    ``number`` is the place of the second among those of its source; then records and times of both.
    """

    number: int
    before: int
    record: int
    before_ns: int
    time_ns: int


@dataclass(frozen=True, eq=False)
class Offsets:
    """Offsets added to times of receipt: ``added_ns[k]`` from record ``starts[k]`` on.

    Without steps, 0 is added. ``by`` has the numbers of the clocks that the offsets were found by.
    """

    starts: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    added_ns: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    by: tuple[int, ...] = ()

    def at(self, record_index: Int64Array) -> Int64Array:
        """Return the offset that is added to the times of some records."""
        if len(self.starts) == 1:
            return np.full(len(record_index), self.added_ns[0])
        place = np.searchsorted(self.starts, record_index, side="right") - 1
        return np.asarray(self.added_ns[np.maximum(place, 0)])

    def plus(self, added_ns: int) -> "Offsets":
        """Return the offsets with ``added_ns`` added everywhere."""
        return Offsets(self.starts, self.added_ns + added_ns, self.by)

    def moved(self, track: ReadingSequence) -> ReadingSequence:
        """Return readings with the corrected time of receipt."""
        return ReadingSequence(
            track.record_index, track.receipt_ns + self.at(track.record_index), track.clock_ns, track.number
        )

    @property
    def stated(self) -> tuple[tuple[int, int], ...]:
        """Offsets in the form in which the header of a log states them.

        Pairs of first record and nanoseconds; empty where nothing is added.
        """
        if not self.added_ns.any():
            return ()
        return tuple(zip(self.starts.tolist(), self.added_ns.tolist(), strict=True))

    def steps(self) -> Iterable[tuple[int, int]]:
        """Yield the records before which the clock was set, and by how much, nanoseconds."""
        for at, by in enumerate(np.diff(self.added_ns).tolist(), start=1):
            if by:
                yield int(self.starts[at]), -by


class _Step(NamedTuple):
    """Step of the receiver's clock between two records, as ``readings`` of a clock show it."""

    after: int
    first: int
    size_ns: int
    readings: int
    by: int


def offsets_by(clocks: Mapping[int, Sequence[ClockStretch]], jumps: Sequence[ClockJump] = ()) -> Offsets:
    """Return offsets that make times of receipt follow the readings of some clocks smoothly.

    The offset is zero before the first step.

    Parameters
    ----------
    clocks : mapping of number to sequence of ClockStretch
        Readings of each clock, parted where one of the two was set.
    jumps : sequence of ClockJump
        Of records without a reading as well: where between two readings the clock was set.
    """
    starts, added, by = [0], [0], list[int]()
    for step in _united(_steps(clocks), jumps):
        starts.append(step.first)
        added.append(added[-1] - step.size_ns)
        by.append(step.by)
    return Offsets(np.array(starts, dtype=np.int64), np.array(added, dtype=np.int64), tuple(dict.fromkeys(by)))


def _steps(clocks: Mapping[int, Sequence[ClockStretch]]) -> list[_Step]:
    found = []
    for number, stretches in clocks.items():
        readings = sum(one.track.readings for one in stretches)
        for before, stretch in pairwise(stretches):
            if stretch.stepped == "receipt":
                first = int(stretch.track.record_index[0])
                found.append(_Step(stretch.after, first, stretch.level_ns - before.level_ns, readings, number))
    return found


def _united(steps: list[_Step], jumps: Sequence[ClockJump]) -> list[_Step]:
    """Merge steps that several clocks show into one.

    It is placed at the first record that is known to be behind it.
    """
    united: list[_Step] = []
    for step in sorted(steps, key=lambda step: (step.first, step.after)):
        if united and step.after < united[-1].first:
            last = united[-1]
            best = max(last, step, key=lambda one: one.readings)
            united[-1] = best._replace(after=max(last.after, step.after), first=min(last.first, step.first))
        else:
            united.append(step)
    return [step._replace(first=min([step.first, *_behind(step, jumps)])) for step in united]


def _behind(step: _Step, jumps: Sequence[ClockJump]) -> Iterable[int]:
    """Yield records after the step, by jumps of about its size between its readings."""
    for jump in jumps:
        if step.after < jump.record < step.first and abs(jump.time_ns - jump.before_ns) > abs(step.size_ns) // 2:
            yield jump.record
