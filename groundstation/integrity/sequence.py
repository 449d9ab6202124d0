"""Lost records by record counters and by the recorder's own counters of losses."""

from dataclasses import field
from fnmatch import fnmatchcase
from functools import lru_cache

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.ledger import CounterEntry
from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.limits import SequenceLimits
from groundstation.integrity.stretches import RecordPlace

LISTED = 100
_LARGEST = 2.0**53
_WRAPS = (1 << 8, 1 << 16, 1 << 24, 1 << 32, 1 << 48)


@dataclass(frozen=True)
class Sequence:
    """Losses that one counter shows.

    Parameters
    ----------
    field : str
    kind : {'records', 'losses'}
        It counts the records of its topic, or what the recorder lost.
    lost : int
        Records missing between records of the log; of losses, by how much the counter grew.
    before : int
        Value of a counter of losses at the first record.
    resets : int
        Steps back, or too far ahead, that are no wrap.
    places : tuple of (int, int)
        Corrected time of the record after each loss, and how many; the first hundred.
    """

    field: str
    kind: str
    lost: int
    before: int = 0
    resets: int = 0
    places: tuple[tuple[int, int], ...] = ()

    def entry(self, clock: ClockModel) -> CounterEntry:
        """Return the form to keep."""
        return CounterEntry(
            field=self.field,
            kind=self.kind,
            lost=self.lost,
            before=self.before,
            resets=self.resets,
            listed=tuple((clock.text(time_ns), lost) for time_ns, lost in self.places),
        )


@dataclass
class Counter:
    """Counter in one field, followed batch by batch."""

    name: str
    counts_losses: bool
    limits: SequenceLimits
    steps: int = 0
    units: int = 0
    lost: int = 0
    resets: int = 0
    first: int | None = None
    last: int = 0
    places: list[tuple[RecordPlace, int]] = field(default_factory=list)

    def add(self, column: Column, record_index: Int64Array, device_ns: Int64Array) -> None:
        """Continue with a batch."""
        values = column.values
        if values.dtype.kind not in "uif":
            return
        good = column.mask & (np.abs(values.astype(np.float64)) < _LARGEST)  # NaN is not
        if not good.any():
            return
        count = values[good].astype(np.int64)
        index, device = record_index[good], device_ns[good]
        if self.first is None:
            self.first = self.last = int(count[0])
            count, index, device = count[1:], index[1:], device[1:]
        if len(count):
            self._count(_unwrapped(count, self.last, self.limits.longest_jump), index, device)
            self.last = int(count[-1])

    def _count(self, step: Int64Array, index: Int64Array, device: Int64Array) -> None:
        """Count steps; ``index`` and ``device`` are those of the records after them."""
        usual = 0 if self.counts_losses else 1
        self.steps += len(step)
        self.units += int(np.count_nonzero(step == 1))
        self.resets += int(np.count_nonzero((step < 0) | (step > self.limits.longest_jump)))
        lost = np.flatnonzero((step > usual) & (step <= self.limits.longest_jump))
        self.lost += int((step[lost] - usual).sum())
        for at in lost[: LISTED - len(self.places)].tolist():
            self.places.append((RecordPlace(int(index[at]), int(device[at])), int(step[at]) - usual))

    def sequence(self, clock: ClockModel) -> Sequence | None:
        """Return the losses that the counter shows; None when it is no counter after all."""
        if self.first is None:
            return None
        if not self.counts_losses and (
            self.steps < self.limits.fewest_steps or self.units <= self.limits.unit_share * self.steps
        ):
            return None
        places = tuple((place.time_ns(clock), lost) for place, lost in self.places)
        kind = "losses" if self.counts_losses else "records"
        before = self.first if self.counts_losses else 0
        return Sequence(self.name, kind, self.lost, before, self.resets, places)


def _unwrapped(count: Int64Array, before: int, longest_jump: int) -> Int64Array:
    """Return the steps of a counter; one that wraps at 8, 16, 24, 32 or 48 bits goes on."""
    previous = np.concatenate(([before], count[:-1]))
    step = count - previous
    for wrap in _WRAPS:
        ahead = step + wrap
        fits = (step < 0) & (previous < wrap) & (count >= 0) & (ahead <= min(longest_jump, wrap // 4))
        step = np.where(fits, ahead, step)
    return np.asarray(step, dtype=np.int64)


def counters_of(batch: RecordBatch, limits: SequenceLimits) -> dict[str, Counter]:
    """The counters among the fields of a topic."""
    found, loss_fields = {}, _loss_fields(limits)
    for name in batch.columns:
        counts_losses = name in loss_fields and any(
            fnmatchcase(f"{batch.topic}.{name}", pattern) for pattern in limits.loss_counters
        )
        if counts_losses or name.lower() in limits.fields:
            found[name] = Counter(name, counts_losses, limits)
    return found


@lru_cache(maxsize=8)
def _loss_fields(limits: SequenceLimits) -> frozenset[str]:
    """Return the fields of the patterns of loss counters.

    That is what follows the last dot, for which no wildcard stands.
    """
    return frozenset(pattern.rpartition(".")[2] for pattern in limits.loss_counters)
