"""Table of the patent: compass error for each degree of magnetic heading.

Opposite banks are averaged.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.methods import harmonics
from groundstation.systems.magnetic.manoeuvre import BINS

CENTRES_DEG: FloatArray = np.arange(BINS, dtype=np.float64) + 0.5
fit_to_circle = harmonics.fit_to(CENTRES_DEG)


@dataclass(frozen=True)
class CompassTable:
    """Compass error, magnetic minus true heading, in bins [k, k + 1) of magnetic heading.

    Arrays have shape (360,). ``right_deg``, ``left_deg``: branches, NaN where empty. ``average_deg`` is known
    everywhere: where a branch is empty (``is_measured`` False) that branch is interpolated on the circle. ``curve_deg``
    is the fit of A to E, whose ``coefficients_deg`` (5,) have declination in A; ``covariance`` (5, 5) is statistical.
    """

    right_deg: FloatArray
    left_deg: FloatArray
    average_deg: FloatArray
    is_measured: BoolArray
    coefficients_deg: FloatArray
    covariance: FloatArray
    curve_deg: FloatArray
    samples: int

    @property
    def fit_rms_deg(self) -> float:
        """RMS distance of A to E from the table over the measured bins."""
        left = wrap_180(self.average_deg - self.curve_deg)[self.is_measured]
        return float(np.sqrt(np.mean(left**2))) if left.size else float("nan")


def build_table(
    heading_deg: FloatArray, error_deg: FloatArray, right: NDArray[np.intp], left: NDArray[np.intp]
) -> CompassTable:
    """Average the compass error of both branches at equal magnetic headings.

    Errors are averaged about their mean direction, so that they may lie anywhere on the circle. A to E are fitted to
    each branch by itself, in order of time, and averaged: what is odd in bank cancels and does not widen their errors.
    """
    rows = np.concatenate([right, left])
    middle = mean_heading(error_deg[rows])
    about = wrap_180(error_deg - middle)
    branches = [_binned(heading_deg[one], about[one]) for one in (right, left)]
    average = 0.5 * (filled_on_circle(branches[0]) + filled_on_circle(branches[1]))
    is_measured = np.isfinite(branches[0]) & np.isfinite(branches[1])
    coefficients, covariance = _fit(heading_deg, about, right, left)
    coefficients[0] = wrap_180(coefficients[0] + middle)
    curve = harmonics.design(CENTRES_DEG) @ coefficients
    return CompassTable(
        wrap_180(branches[0] + middle),
        wrap_180(branches[1] + middle),
        wrap_180(average + middle),
        is_measured,
        coefficients,
        covariance,
        curve,
        len(rows),
    )


def filled_on_circle(values: FloatArray) -> FloatArray:
    """Bins with the empty ones interpolated between their neighbours on the circle.

    Examples
    --------
    >>> table = np.full(360, np.nan)
    >>> table[[10, 350]] = 1.0, 3.0
    >>> filled_on_circle(table)[[0, 180]].tolist()
    [2.0, 2.0]
    """
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        return values.copy()
    return np.interp(np.arange(len(values)), known, values[known], period=len(values))


def bin_of(heading_deg: FloatArray) -> NDArray[np.intp]:
    """Bin [k, k + 1) of each heading."""
    return np.minimum(np.asarray(heading_deg).astype(np.intp), BINS - 1)


def _binned(heading_deg: FloatArray, values: FloatArray) -> FloatArray:
    bins = bin_of(heading_deg)
    count = np.bincount(bins, minlength=BINS)
    total = np.bincount(bins, weights=values, minlength=BINS)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _fit(
    heading_deg: FloatArray, about_deg: FloatArray, right: NDArray[np.intp], left: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Fit A to E of the average: half the sum of those of the branches.

    Bins count alike, as in the table.
    """
    parts = []
    for rows in (right, left):
        bins = bin_of(heading_deg[rows])
        weight = 1.0 / np.bincount(bins, minlength=BINS)[bins]
        parts.append(harmonics.fit(heading_deg[rows], about_deg[rows], weight))
    (first, first_covariance), (second, second_covariance) = parts
    return 0.5 * (first + second), 0.25 * (first_covariance + second_covariance)
