"""Means and slopes of a velocity with intervals that know its rounding and its slow noise."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import student_quantile
from groundstation.methods.intervals import BOUND95
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_growth import means_of

CIRCLE95 = 2.447746830680816  # sigmas of one axis: radius that holds 95 % of a round normal distribution
FEWEST_MEANS = 5
ROUNDED = float(1.0 / np.sqrt(12.0))
LEAST_STEP = 1e-9
STUDIED_STEPS = 4000


@dataclass(frozen=True)
class AxisSlope:
    """Value of one axis with its sigma, as wide as a normal one that holds 95 %."""

    value: float
    sigma: float

    @property
    def measured(self) -> Measured:
        """The value with half of its 95 % interval."""
        return Measured(self.value, BOUND95 * self.sigma)


def length_of(north: AxisSlope, east: AxisSlope) -> Measured:
    """Return the length of two axes; the interval holds it wherever the pair may lie."""
    value = float(np.hypot(north.value, east.value))
    return Measured(value, float(CIRCLE95 * max(north.sigma, east.sigma)))


def slopes_of(time_s: FloatArray, velocity_mps: FloatArray) -> tuple[AxisSlope, AxisSlope] | None:
    """Return the slope of both axes per second; None with too few means of ten seconds.

    The sigma is that of the scatter of the means about a parabola, by Student's quantile, and of the rounding.
    """
    known = np.isfinite(velocity_mps).all(axis=1)
    mean_s, means = means_of(time_s[known], velocity_mps[known])
    if len(mean_s) < FEWEST_MEANS:
        return None
    centred = mean_s - np.mean(mean_s)
    spread = float(np.sum(centred**2))
    length_s = float(np.ptp(mean_s))
    found = []
    for axis in range(2):
        slope = float(np.sum(centred * means[:, axis])) / spread
        rest = _beyond(centred, means[:, axis], 2)
        found.append(
            AxisSlope(slope, _sigma(rest, 3, 1.0 / np.sqrt(spread), step_of(velocity_mps[known, axis]), length_s))
        )
    return found[0], found[1]


def means_with_sigma(time_s: FloatArray, velocity_mps: FloatArray) -> tuple[AxisSlope, AxisSlope] | None:
    """Return the mean of both axes; None with too few means of ten seconds."""
    known = np.isfinite(velocity_mps).all(axis=1)
    mean_s, means = means_of(time_s[known], velocity_mps[known])
    if len(mean_s) < FEWEST_MEANS:
        return None
    found = []
    for axis in range(2):
        rest = _beyond(mean_s - mean_s[0], means[:, axis], 1)
        sigma = _sigma(rest, 2, 1.0 / np.sqrt(len(mean_s)), step_of(velocity_mps[known, axis]), 1.0)
        found.append(AxisSlope(float(np.mean(means[:, axis])), sigma))
    return found[0], found[1]


def _beyond(time_s: FloatArray, values: FloatArray, degree: int) -> FloatArray:
    """Return what a polynomial leaves: a drift, and its bend, are no noise."""
    design = np.vander(time_s / max(float(np.abs(time_s).max()), 1.0), degree + 1)
    return np.asarray(values - design @ np.linalg.lstsq(design, values, rcond=None)[0])


def _sigma(rest: FloatArray, fitted: int, gain: float, step: float, over: float) -> float:
    """Return the sigma by the scatter of means that was left, and by rounding.

    Means next to each other that are alike count for fewer.
    """
    freedom = max(len(rest) - fitted, 1)
    scatter = float(np.sqrt(np.sum(rest**2) / freedom))
    alike = float(np.sum(rest[1:] * rest[:-1]) / max(float(np.sum(rest**2)), 1e-300))
    colour = np.sqrt((1.0 + alike) / (1.0 - alike)) if 0.0 < alike < 1.0 else 1.0
    student = float(student_quantile(0.975, freedom)) / BOUND95
    rounding = ROUNDED * step / max(over, 1.0)
    return float(np.hypot(student * colour * scatter * gain, rounding))


def step_of(values: FloatArray) -> float:
    """Return the step in which numbers are written, 0 where they are not rounded visibly.

    Examples
    --------
    >>> round(step_of(np.array([0.0, 0.25, 0.125, 0.5, 0.375])), 3)
    0.125
    """
    distinct = np.unique(values[:STUDIED_STEPS])
    steps = np.diff(distinct)
    steps = steps[steps > LEAST_STEP]
    return float(steps.min()) if len(steps) and len(distinct) < 0.5 * len(values[:STUDIED_STEPS]) + 4 else 0.0
