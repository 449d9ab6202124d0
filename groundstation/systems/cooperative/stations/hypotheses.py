"""Likelihood-ratio tests of single stations: shifted, or with ranges too long by a delay.

With information C and score y of the numbers of one hypothesis, T = y' C^-1 y is chi-square with as many degrees of
freedom when the stations are right, and has the noncentrality d' C d when the numbers are d. All stations are asked at
once, so each is asked at the level of the session over the number of questions (Bonferroni).
"""

import math
from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import chi_square_quantile
from groundstation.base.records import frozen
from groundstation.systems.cooperative.stations.information import EACH, StationInformation

FALSE_ALARMS = 0.01  # of sessions with right stations, by the model
FOUND = 0.95  # of errors of the smallest size that counts as detectable
CANNOT_TELL = 2.0 * math.log(100.0)  # twice the log of a likelihood ratio below which two hypotheses stay open
SHIFT, DELAY = "shift", "delay"
AXES = {SHIFT: slice(0, 2), DELAY: slice(2, 3)}
UNSEEN = 1e-10  # information below it (a sigma of 100 km) is none


@dataclass(frozen=True)
class StationTest:
    """One hypothesis on one station.

    Parameters
    ----------
    station : int
    kind : str
        SHIFT or DELAY.
    statistic : float
        Twice the log of the likelihood ratio.
    error_m : ndarray, shape (2,) or (1,)
        Best numbers: believed less true place, north and east; or delay.
    covariance_m2 : ndarray
    """

    station: int
    kind: str
    statistic: float
    error_m: FloatArray
    covariance_m2: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "error_m", frozen(self.error_m))
        object.__setattr__(self, "covariance_m2", frozen(self.covariance_m2))

    @property
    def chance(self) -> float:
        """Chance of so large a statistic when the station is right."""
        return chance_of(self.statistic, len(self.error_m))

    @property
    def size_m(self) -> float:
        """Size of the error."""
        return float(np.sqrt((self.error_m**2).sum()))

    @property
    def size_sigma_m(self) -> float:
        """Sigma of the size, along the error."""
        if self.size_m <= 0.0:
            return float(np.sqrt(np.trace(self.covariance_m2)))
        along = self.error_m / self.size_m
        return float(np.sqrt(along @ self.covariance_m2 @ along))

    @property
    def largest_m(self) -> float:
        """Size with twice the sigma of its worst direction."""
        return self.size_m + 2.0 * float(np.sqrt(np.linalg.eigvalsh(self.covariance_m2)[-1]))


def chance_of(statistic: float, freedom: int) -> float:
    """Return the chance that chi-square with one or two degrees of freedom is larger.

    Examples
    --------
    >>> round(chance_of(3.841, 1), 4), round(chance_of(5.991, 2), 4)
    (0.05, 0.05)
    """
    return math.erfc(math.sqrt(0.5 * statistic)) if freedom == 1 else math.exp(-0.5 * statistic)


def station_tests(information: StationInformation, asked: Sequence[int]) -> tuple[StationTest, ...]:
    """Test stations for a shift and for a delay; what cannot be seen at all is left out."""
    found = []
    for station in asked:
        for kind, axes in AXES.items():
            part = slice(EACH * station + axes.start, EACH * station + axes.stop)
            C, y = information.matrix[part, part], information.score[part]
            if float(np.linalg.eigvalsh(C)[0]) > UNSEEN:
                covariance = np.asarray(np.linalg.inv(C), dtype=np.float64)
                found.append(StationTest(station, kind, float(y @ covariance @ y), covariance @ y, covariance))
    return tuple(found)


def alarms(tests: Sequence[StationTest], level: float = FALSE_ALARMS) -> bool:
    """Tell whether any of the tests refuses its station."""
    return any(test.chance * len(tests) < level for test in tests)


def open_hypotheses(tests: Sequence[StationTest]) -> tuple[StationTest, ...]:
    """Return the hypotheses about as good as the best, the best first."""
    ordered = sorted(tests, key=lambda test: -test.statistic)
    return tuple(test for test in ordered if ordered[0].statistic - test.statistic < CANNOT_TELL)


def noncentrality(questions: int, level: float = FALSE_ALARMS) -> float:
    """Return the noncentrality that the test of a shift finds with the probability ``FOUND``.

    Examples
    --------
    >>> round(noncentrality(1, 0.05), 2)
    15.44
    """
    from scipy.special import chndtrinc

    limit = float(chi_square_quantile(1.0 - level / max(questions, 1), 2))
    return float(chndtrinc(limit, 2.0, 1.0 - FOUND))
