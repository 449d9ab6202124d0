"""Two analyses of one log that answer the same question: agreement within intervals."""

import math

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95

AGREE_SIGMAS, CONTRADICT_SIGMAS = 2.0, 3.0


@dataclass(frozen=True)
class OneFinding:
    """Value that one analysis found, with its sigma and its origin."""

    origin: str
    value: float
    sigma: float

    @property
    def interval95(self) -> tuple[float, float]:
        return self.value - NORMAL_95 * self.sigma, self.value + NORMAL_95 * self.sigma


@dataclass(frozen=True)
class Agreement:
    """Two findings on one question.

    ``between_sigma`` is what may have changed between them.
    """

    question: str
    unit: str
    first: OneFinding
    second: OneFinding
    between_sigma: float = 0.0

    @property
    def difference(self) -> float:
        """First minus second."""
        return self.first.value - self.second.value

    @property
    def sigmas(self) -> float:
        """Difference of the two in sigmas.

        Examples
        --------
        >>> taxi, turns = OneFinding("by taxi", 1.0, 0.3), OneFinding("by turns", 0.5, 0.4)
        >>> Agreement("heading error", "deg", taxi, turns).sigmas
        1.0
        """
        return abs(self.difference) / math.hypot(self.first.sigma, self.second.sigma, self.between_sigma)

    @property
    def agrees(self) -> bool:
        return self.sigmas <= AGREE_SIGMAS
