"""Guess of the time of the rows of a table, and what makes numbers a time."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.words import meaning_of

RISING = 0.98  # share of the steps that do not go back
NAMED = 0.5  # the same of a column that is called a time, or is written like one
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
PRIME = 0.9  # share of rows with a time of their own


@dataclass(frozen=True)
class TimeGuess:
    """Time of the rows: the columns, the lines of ``[time]``, why.

    ``seconds`` are the times of the rows of the sample, NaN where there are none. ``doubt``: what the user has to look
    at. ``metadata``: further lines of the profile, which tell the day.
    """

    columns: tuple[int, ...]
    lines: tuple[str, ...]
    why: str
    seconds: FloatArray
    is_absolute: bool
    doubt: str = ""
    rank: int = 0
    metadata: tuple[str, ...] = ()

    @property
    def own(self) -> float:
        """Share of the rows that have a time of their own."""
        known = self.seconds[np.isfinite(self.seconds)]
        return len(np.unique(known)) / max(1, len(known))


def rank_of(sample: TableSample, at: int) -> int:
    """Return how well a name fits: one that is known before others."""
    meaning = sample.meanings[at] or meaning_of(sample.names[at].rpartition(".")[2])
    return 2 if meaning is not None and meaning.role == "time" else 0


def moves(values: FloatArray, share: float = RISING) -> bool:
    """Tell whether numbers may be times: one alone, or some that rise in most steps.

    Examples
    --------
    >>> moves(np.array([0.0, 1.0, 1.0, 3.0])), moves(np.array([7.0])), moves(np.array([7.0, 7.0]))
    (True, True, False)
    """
    known = values[np.isfinite(values)]
    steps = np.diff(known)
    if len(steps) == 0:
        return len(known) == 1
    return bool(np.count_nonzero(steps >= 0.0) >= share * len(steps)) and bool(np.any(steps > 0.0))


def doubt_of_order(values: FloatArray) -> str:
    """Return the doubt that some times go back."""
    steps = np.diff(values[np.isfinite(values)])
    back = int(np.count_nonzero(steps < 0.0))
    if back <= (1.0 - RISING) * len(steps):
        return ""
    return f"{back} of {len(steps)} steps go back: rows out of order, or a counter that begins anew"
