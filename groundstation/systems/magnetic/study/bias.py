"""Bias of one branch and of the average of opposite branches, by formula.

The bias grows with a power of the bank.
"""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.simulation.deviation import deviation_truth
from groundstation.simulation.scenario import MagnetometerSettings
from groundstation.systems.magnetic.study.cases import EXACT_BANKS_DEG, PUBLISHED_FIELD_NT

UNIT_BANK_DEG = 20.0
EXPONENTS = np.arange(0.5, 4.001, 0.02)  # tried where a floor of noise is fitted besides


@dataclass(frozen=True)
class Biases:
    """RMS over the circle of steady banks minus level flight, by bank, shapes (k,)."""

    one_branch_deg: FloatArray
    average_deg: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "one_branch_deg", frozen(self.one_branch_deg))
        object.__setattr__(self, "average_deg", frozen(self.average_deg))


def formula_biases(settings: MagnetometerSettings) -> Biases:
    """Return the biases of one magnetometer at the banks of ``EXACT_BANKS_DEG``.

    The field is that of the published figures. No flight: a bank held exactly on every heading, no noise.
    """
    field = np.array(PUBLISHED_FIELD_NT)
    level = deviation_truth(settings, field).compass_error_deg
    branch, average = [], []
    for bank in EXACT_BANKS_DEG:
        both = [
            wrap_180(deviation_truth(settings, field, roll_deg=side * bank).compass_error_deg - level)
            for side in (1.0, -1.0)
        ]
        branch.append(np.sqrt(np.mean(np.square(both))))
        average.append(np.sqrt(np.mean(np.square(0.5 * (both[0] + both[1])))))
    return Biases(np.array(branch), np.array(average))


def power_law(bank_deg: FloatArray, rms_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit exponent p and size g of g (bank / 20 deg)^p to RMS values, shape (draws, k).

    Both have the shape (draws,). Least squares of the logarithms.

    Examples
    --------
    >>> p, g = power_law(np.array([10.0, 20.0, 30.0]), np.array([[0.1, 0.4, 0.9]]))
    >>> round(float(p[0]), 6), round(float(g[0]), 6)
    (2.0, 0.4)
    """
    x = np.log(np.asarray(bank_deg) / UNIT_BANK_DEG)
    y = np.log(rms_deg)
    exponent = (y - y.mean(axis=1, keepdims=True)) @ (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    return exponent, np.exp(y.mean(axis=1) - exponent * x.mean())


def power_law_above_floor(bank_deg: FloatArray, rms_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit exponent and size to RMS values that hold a floor f of noise.

    rms^2 = f^2 + g^2 (bank / 20 deg)^(2 p), f^2 >= 0. For each of ``EXPONENTS`` f^2 and g^2 are linear; the exponent of
    least squared relative error wins.

    Examples
    --------
    >>> bank = np.array([10.0, 20.0, 30.0, 40.0])
    >>> p, g = power_law_above_floor(bank, np.hypot(0.3, 0.4 * (bank / 20.0) ** 2)[None, :])
    >>> round(float(p[0]), 6), round(float(g[0]), 6)
    (2.0, 0.4)
    """
    square = np.square(rms_deg)
    best = np.full(len(square), np.inf)
    exponent, size = np.full(len(square), np.nan), np.full(len(square), np.nan)
    for power in EXPONENTS:
        ones = 1.0 / square
        growing = np.square((np.asarray(bank_deg) / UNIT_BANK_DEG) ** power) / square
        a, b, c = (np.sum(one * other, axis=1) for one, other in ((ones, ones), (ones, growing), (growing, growing)))
        d, e = ones.sum(axis=1), growing.sum(axis=1)
        floor = (c * d - b * e) / (a * c - b * b)
        floor = np.maximum(floor, 0.0)
        gain = np.where(floor > 0.0, (a * e - b * d) / (a * c - b * b), e / c)
        left = np.sum((ones * floor[:, None] + growing * gain[:, None] - 1.0) ** 2, axis=1)
        is_better = (left < best) & (gain > 0.0)
        best = np.where(is_better, left, best)
        exponent, size = np.where(is_better, power, exponent), np.where(is_better, np.sqrt(np.abs(gain)), size)
    return exponent, size


def bank_at(limit_deg: float, exponent: FloatArray, size: FloatArray) -> FloatArray:
    """Return the bank at which a power law passes a limit, degrees.

    Examples
    --------
    >>> float(bank_at(0.1, np.array([2.0]), np.array([0.4]))[0])
    10.0
    """
    return np.asarray(UNIT_BANK_DEG * (limit_deg / size) ** (1.0 / exponent))
