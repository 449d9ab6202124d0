"""Bounds on the work that a bag may cause, by its size.

Chunks expand, and a message may be made to take long. Steps are some microseconds of decoding. Messages of recorded
bags take less than a tenth of what is allowed.
"""

from groundstation.base.dataclasses import dataclass

FREE_STEPS, STEPS_PER_BYTE = 1_000_000, 4
FREE_MESSAGES, BYTES_PER_MESSAGE = 200_000, 2  # messages of any file, and what one more takes of it when compressed
FIRST_LOOK = 4  # a first look may take as much by this factor less
STEPS_PER_VALUE, BYTES_PER_STEP = 3, 16


@dataclass
class StepBudget:
    """Work in steps that are left.

    Parameters
    ----------
    steps : int

    Examples
    --------
    >>> work = StepBudget.of(0)
    >>> work.spend(FREE_STEPS), work.spend(1)
    (True, False)
    """

    steps: int

    @classmethod
    def of(cls, size: int) -> "StepBudget":
        """Return the work that a file of so many bytes is given."""
        return cls(FREE_STEPS + STEPS_PER_BYTE * size)

    def of_a_first_look(self) -> "StepBudget":
        """Return the work that a first look may take."""
        return StepBudget(self.steps // FIRST_LOOK)

    def spend(self, steps: int) -> bool:
        """Take some steps; False when there are none left."""
        self.steps -= steps
        return self.steps >= 0


def most_messages(size: int) -> int:
    """Messages that a file of so many bytes may hold."""
    return FREE_MESSAGES + size // BYTES_PER_MESSAGE
