"""Gaps in the times of one topic, and pauses of the whole log."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.base.units import NS_PER_S


class Pause(NamedTuple):
    """Time without any record, by the recorder's own doing: from and to, corrected."""

    start_ns: int
    end_ns: int

    @property
    def length_s(self) -> float:
        """Seconds without a record."""
        return (self.end_ns - self.start_ns) / NS_PER_S


def logged_ns(time_ns: Int64Array, pauses: Sequence[Pause]) -> Int64Array:
    """Return times on a clock that stands still in pauses, shape as ``time_ns``.

    ``pauses`` are in order and apart.

    Examples
    --------
    >>> logged_ns(np.array([0, 9, 10, 15, 20, 25]), [Pause(10, 20)]).tolist()
    [0, 9, 10, 10, 10, 15]
    """
    if not pauses:
        return time_ns
    start, end = np.array(pauses, dtype=np.int64).T
    passed = np.concatenate(([0], np.cumsum(end - start)))
    behind = np.searchsorted(start, time_ns, side="right")
    running = np.where(behind > 0, np.maximum(end[behind - 1] - time_ns, 0), 0)
    return np.asarray(time_ns - passed[behind] + running, dtype=np.int64)


@dataclass(frozen=True)
class Gaps:
    """Gaps of one topic, shape (n,).

    ``start_ns`` is the last sample before each gap (corrected nanoseconds), ``length_s`` the seconds to the next
    sample. A pause of the log stands for a sample at either end of it.
    """

    topic: str
    start_ns: Int64Array
    length_s: np.ndarray[Any, np.dtype[np.float64]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "start_ns", frozen(self.start_ns))
        object.__setattr__(self, "length_s", frozen(self.length_s))

    def __len__(self) -> int:
        return len(self.start_ns)
