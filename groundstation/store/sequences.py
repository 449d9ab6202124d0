"""Sequence numbers of the messages of one channel; they show whether a chunk is missing."""

from dataclasses import dataclass

import numpy as np

from groundstation.base.records import Int64Array

FEWEST_STEPS = 10
LONGEST_JUMP = 1_000_000
_WRAP = 1 << 32


@dataclass
class Sequences:
    """Check of the sequence numbers of one channel, block by block.

    Attributes
    ----------
    count : int
        Messages met.
    steps : int
        From one message to the next inside of blocks.
    missing : int
        Numbers left out between blocks; 0 where any is left out inside of one, for then they tell no missing block.
    """

    count: int = 0
    steps: int = 0
    _last: int = -1
    _missing: int = 0
    _is_counting: bool = True

    def take(self, numbers: Int64Array) -> None:
        """Take in the messages of a block, shape (n,), at least one."""
        inside = np.diff(numbers) % _WRAP
        self._is_counting &= bool((inside == 1).all())
        self.steps += len(inside)
        if self.count:
            jump = (int(numbers[0]) - self._last) % _WRAP
            self._is_counting &= 1 <= jump <= LONGEST_JUMP
            self._missing += jump - 1
        self.count += len(numbers)
        self._last = int(numbers[-1])

    @property
    def missing(self) -> int:
        """Sequence numbers missing between blocks, where all others are consecutive."""
        return self._missing if self._is_counting and self.steps >= FEWEST_STEPS else 0
