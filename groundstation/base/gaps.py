"""Gaps in the times of one topic."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.base.records import Int64Array, frozen


@dataclass(frozen=True)
class Gaps:
    """Gaps of one topic, shape (n,).

    ``start_ns`` is the last sample before each gap (corrected nanoseconds), ``length_s`` the seconds to the next
    sample.
    """

    topic: str
    start_ns: Int64Array
    length_s: np.ndarray[Any, np.dtype[np.float64]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "start_ns", frozen(self.start_ns))
        object.__setattr__(self, "length_s", frozen(self.length_s))

    def __len__(self) -> int:
        return len(self.start_ns)
