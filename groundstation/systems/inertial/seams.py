"""Return of GNSS after an outage: consistent fixes against the forecast of the filter.

A forecast may be off by more than the model says: an INS of another quality, turns that the model does not know. Fixes
that come back after an outage and agree among themselves are then used, and it is the sigma of the filter that is
widened: by the factor that explains the innovations, no more, and from the last fix before the outage on.

Fixes of a receiver that is wrong or misled agree among themselves too. Without an outage they are never used in this
way. After one, position and velocity together must be off as the model errs: within :data:`REACH` gates each, and by no
more than a factor of :data:`FACTOR_MAX` together. Fixes further off wait for :data:`PATIENCE_S`, and a finding reports
them.
"""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.systems.inertial.model import FloatArray

OUTAGE_S = 10.0  # without any fix: the forecast is what the next one is compared with
OUTAGE_INTERVALS = 3.0  # of a receiver that is slow
AGREEING_S, AGREEING_FIXES = 5.0, 3  # so long, and so many at least, must fixes agree
AGREEING_SIGMAS = 3.0  # of a single fix, as the gate believes it
# Simulated flights of the class that manoeuvre: the worst of 2268 returns after 1 to 60 min was 7.8 sigma off; of 32
# beyond the gate none needed a factor above 7.1
REACH = 2.0  # gates: no innovation that is further off is explained by any factor
FACTOR_MAX = 10.0  # of position and velocity together
PATIENCE_S = 60.0  # GNSS rejected for so long is believed again


@dataclass(frozen=True)
class Seam:
    """A return of GNSS for which the filter's own sigma was too small.

    Parameters
    ----------
    last, first, back : int
        Epochs: of the last fix used before the outage, of the first one behind it, of the first of those that agree.
    factor : float
        What the sigma of the forecast had to be multiplied by.
    covariance : ndarray, shape (k, k)
        Of the states after epoch ``last``.
    """

    last: int
    first: int
    back: int
    factor: float
    covariance: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen(self.covariance))


def returns_of(time_s: FloatArray, is_fix: BoolArray) -> Int64Array:
    """Return the epochs at which GNSS comes back after an outage.

    The first fix of all is one too, where it comes so late.
    """
    fixes = np.flatnonzero(is_fix)
    if not len(fixes):
        return fixes
    usual_s = float(np.median(np.diff(time_s[fixes]))) if len(fixes) > 1 else 0.0
    before = np.append(time_s[0], time_s[fixes[:-1]])
    is_return: BoolArray = time_s[fixes] - before >= max(OUTAGE_S, OUTAGE_INTERVALS * usual_s)
    return fixes[is_return]


def fixes_since(time_s: FloatArray, position_m: FloatArray, velocity_mps: FloatArray, back: int) -> Int64Array:
    """Return the epochs of fixes from a return on, as long as the filter has patience.

    Positions count if there are any, else velocities; a channel that is never measured does not. The time for judging
    them is included.
    """
    end = int(np.searchsorted(time_s, time_s[back] + PATIENCE_S + AGREEING_S))
    values = position_m if np.isfinite(position_m).any() else velocity_mps
    measured = np.isfinite(values).any(axis=0)
    return back + np.flatnonzero(np.isfinite(values[back:end, measured]).all(axis=1))


@dataclass(frozen=True)
class Fixes:
    """Fixes since a return, k of them, and the filter's forecast of each at the outage's end.

    Parameters
    ----------
    time_s : ndarray, shape (k,)
    measured, predicted : ndarrays, shape (k, 2, c)
        Position and velocity, INS minus GNSS; NaN where absent.
    covariance : ndarray, shape (k, 2 c, 2 c)
        Of what is predicted: positions of the channels, then velocities.
    believed : ndarray, shape (2,)
        Variances of a single position and velocity.
    """

    time_s: FloatArray
    measured: FloatArray
    predicted: FloatArray
    covariance: FloatArray
    believed: FloatArray

    def seam(self, gate: float) -> tuple[int, float] | None:
        """Return the first row of the fixes that agree, and the factor on the forecast's sigma.

        It is the factor that explains the fixes. None where no fixes agree, where the filter's own gate lets them pass,
        where one of their means is beyond :data:`REACH` gates, and where it takes more than :data:`FACTOR_MAX`.
        """
        agreeing = self.first_agreeing()
        if agreeing is None:
            return None
        innovation = (self.measured - self.predicted)[agreeing].mean(axis=0).ravel()
        known, predicted = np.isfinite(innovation), self.covariance[agreeing.start]
        y, predicted = innovation[known], predicted[np.ix_(known, known)]
        believed = np.repeat(self.believed, self.measured.shape[2])[known]
        furthest = float(np.max(np.square(y) / (np.diag(predicted) + believed)))
        if not gate < furthest <= REACH**2 * gate:
            return None
        factor = factor_of(y, predicted, believed)
        return (agreeing.start, factor) if factor <= FACTOR_MAX else None

    def first_agreeing(self) -> slice | None:
        """Rows of the earliest stretch in which fixes agree among themselves; None where none do.

        Positions move by the integral of the velocities measured (on a straight line where none are), velocities change
        steadily: in a turn the differences of a receiver that is late turn too.
        """
        for first in range(len(self.time_s)):
            end = int(np.searchsorted(self.time_s, self.time_s[first] + AGREEING_S - 1e-6)) + 1
            rows = slice(first, max(end, first + AGREEING_FIXES))
            if rows.stop > len(self.time_s):
                return None
            if self._agree(rows):
                return rows
        return None

    def _agree(self, rows: slice) -> bool:
        time_s, measured = self.time_s[rows], self.measured[rows]
        limit = AGREEING_SIGMAS * np.sqrt(self.believed)
        for position, velocity in zip(measured[:, 0].T, measured[:, 1].T, strict=True):
            is_moved = bool(np.isfinite(velocity).all())
            moved = _integral(time_s, velocity) if is_moved else _line(time_s, position)
            apart = position - moved
            if np.abs(apart - apart.mean()).max() > limit[0]:  # not of a NaN
                return False
            if is_moved and np.abs(velocity - _line(time_s, velocity)).max() > limit[1]:
                return False
        return True


def _integral(time_s: FloatArray, rate: FloatArray) -> FloatArray:
    """Integral of a rate over time by the trapezoidal rule, zero at the first time."""
    return np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s)))


def _line(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Straight line through values by least squares, at the same times."""
    apart_s = time_s - time_s.mean()
    return np.asarray(values.mean() + apart_s * (apart_s @ values) / (apart_s @ apart_s))


def factor_of(innovation: FloatArray, predicted: FloatArray, believed: FloatArray) -> float:
    """Return the smallest factor on a forecast's sigma that explains innovations.

    Infinite where none does.

    Parameters
    ----------
    innovation : ndarray, shape (m,)
        Measured minus predicted, position and velocity together.
    predicted : ndarray, shape (m, m)
        Covariance of what is predicted.
    believed : ndarray, shape (m,)
        Variances of the measurements.

    y' (factor^2 predicted + believed)^-1 y = m: as large as it is on average when the model is true.

    Examples
    --------
    >>> round(factor_of(np.array([60.0]), np.array([[100.0]]), np.array([0.0])), 3)
    6.0
    """
    root = 1.0 / np.sqrt(believed + 1e-12 * predicted.trace())
    values, vectors = np.linalg.eigh(root[:, None] * predicted * root)
    squares = np.square(vectors.T @ (root * innovation))
    low, high = 0.0, np.log(FACTOR_MAX) + 1.0

    def explained(logarithm: float) -> bool:
        return bool(np.sum(squares / (np.maximum(values, 0.0) * np.exp(2.0 * logarithm) + 1.0)) <= len(innovation))

    if explained(low):
        return 1.0
    if not explained(high):
        return np.inf
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if explained(middle) else (middle, high)
    return float(np.exp(high))
