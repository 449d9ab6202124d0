"""Acceptance gates, as the verdicts of all systems rest on them: figure, limit, state.

Reasons that name gates are put in plain words for readers who do not know the method.
"""

import math
from typing import Literal

import numpy as np

from groundstation.base.dataclasses import dataclass

GateState = Literal["passed", "failed", "not_measured"]
Sense = Literal["at_most", "at_least", "between"]
Bound = tuple[float | None, float | None]  # lowest and highest value with which a gate passes
STORED_STEP = 1e-6  # limits in summary.json are rounded to it
NOT_PROVEN = "ground contact not proven for"  # so many epochs
NO_CONTACT = "no GNSS epoch with ground contact proven"
WITHOUT_ROLLING = "without rolling"  # how a vehicle without wheels sets down


@dataclass(frozen=True)
class Gate:
    """One acceptance gate: figure, limit, unit, state.

    ``value`` is None when it could not be measured.

    ``limit`` is a number that the figure must reach or not exceed, as ``sense`` says, or a pair [low, high];
    ``required`` gates decide the verdict, others inform.
    ``reason`` says in a few words why it failed or was not measured.
    """

    name: str  #: Stable name for scripts.
    title: str  #: Name for people.
    value: float | None  #: The figure; null when it could not be measured.
    limit: float | tuple[float, float]  #: Number to reach or not to exceed, as `sense` says, or a pair [low, high].
    unit: str  #: Unit of figure and limit.
    state: GateState  #: passed, failed or not_measured.
    required: bool = True  #: Whether it decides the verdict; others inform.
    reason: str = ""  #: Few words on why it failed or was not measured.
    sense: Sense = "at_most"  #: How figure and limit compare: at_most, at_least or between.

    def under(self, bound: Bound) -> "Gate":
        """The same value against another limit; the gate itself where the limit is the one it has.

        Examples
        --------
        >>> Gate("e", "precision e", 0.04, 0.05, "deg", "passed").under((None, 0.03)).state
        'failed'
        """
        other = judged_gate(
            bound, self.name, self.title, self.value, unit=self.unit, reason=self.reason, required=self.required
        )
        is_same = np.allclose(np.atleast_1d(self.limit), np.atleast_1d(other.limit), rtol=0.0, atol=STORED_STEP)
        return self if is_same else other


def judged_gate(
    bound: Bound,
    name: str,
    title: str,
    value: float | None,
    *,
    unit: str = "",
    reason: str = "",
    required: bool = True,
) -> Gate:
    """Make a gate that passes where low <= value <= high.

    Its limit is the one bound given, or both.
    """
    low, high = bound
    bounds = tuple(end for end in bound if end is not None)
    limit = bounds[0] if len(bounds) == 1 else (bounds[0], bounds[1])
    sense: Sense = "between" if len(bounds) == 2 else "at_most" if low is None else "at_least"
    if value is None or not math.isfinite(value):
        return Gate(name, title, None, limit, unit, "not_measured", required, reason or "not measurable", sense)
    passed = (low is None or value >= low) and (high is None or value <= high)
    return Gate(name, title, float(value), limit, unit, "passed" if passed else "failed", required, reason, sense)


def in_plain_words(reason: str) -> str:
    """Return the reason with the names of gates in plain words.

    Examples
    --------
    >>> in_plain_words("no straight taxi: of 9 epochs above 6 m/s before lift-off: not proven ground 9")
    'no straight taxi: of 9 epochs above 6 m/s before lift-off: ground contact not proven for 9'
    """
    return reason.replace("not proven ground ", f"{NOT_PROVEN} ")
