"""Accuracy that categories of precision approach require, and the 95 % figures for it.

Accuracy only: integrity, continuity and availability are further requirements, and nothing here shows them.

The error along one axis stays within 1.96 sigma in 95 % of cases; the radius of an error in a plane stays within
2.45 sigma where both sigmas are equal, and within something between the two where they are not
(:func:`radius_95_m`). The two are never mixed: "horizontal" and "vertical" of a category are a radius and an axis,
"lateral" is an axis.

Source: after ICAO Annex 10, the table of Satellite Navigation 1, 2020, doi 10.1186/s43020-020-00010-2. The rows of
category II and III are "ILS look-alike" values: derived from what an ILS delivers, not requirements on a satellite or
range system of its own. Tolerance of the mean course line of an ILS at the threshold: ICAO Annex 10, volume I, 3.1.3.6.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import frozen

LINEAR_95 = NORMAL_95  # 95 % of one Gaussian error lie within so many sigma
RADIAL_95 = 2.447747  # the same of the radius of two with equal sigmas: sqrt(-2 ln 0.05)
_ANGLES, _RATIOS, _HALVINGS = 720, 201, 50


@dataclass(frozen=True)
class Category:
    """Accuracy of one row of the table, 95 %.

    Parameters
    ----------
    name : str
    horizontal_m : float
        Radius.
    vertical_m : float
        Axis. Category I allows a range of values; this is its wide end.
    strict_vertical_m : float
        Its narrow end; equal where there is one value.
    is_ils_look_alike : bool
    course_line_m : float
        Tolerance of the mean course line of an ILS of this category at the threshold: of the line, not a total error.
    """

    name: str
    horizontal_m: float
    vertical_m: float
    strict_vertical_m: float
    is_ils_look_alike: bool
    course_line_m: float

    @property
    def label(self) -> str:
        """Name, with the kind of the row."""
        return f"{self.name} (ILS look-alike)" if self.is_ils_look_alike else self.name


CATEGORIES: tuple[Category, ...] = (
    Category("CAT I", 16.0, 6.0, 4.0, is_ils_look_alike=False, course_line_m=10.5),
    Category("CAT II and IIIA", 6.9, 2.0, 2.0, is_ils_look_alike=True, course_line_m=7.5),
    Category("CAT IIIB", 6.1, 2.0, 2.0, is_ils_look_alike=True, course_line_m=3.0),
)
ACCURACY_ONLY = "Accuracy only: integrity, continuity and availability are not shown by these figures."


def category_met(horizontal_95_m: float, vertical_95_m: float) -> Category | None:
    """Return the most demanding category whose accuracy both figures meet.

    It is None where they meet none (or are NaN).

    Examples
    --------
    >>> category_met(6.5, 1.9).name, category_met(6.5, 5.0).name, category_met(20.0, 1.0)
    ('CAT II and IIIA', 'CAT I', None)
    """
    met = [one for one in CATEGORIES if horizontal_95_m <= one.horizontal_m and vertical_95_m <= one.vertical_m]
    return met[-1] if met else None


def axis_category_met(error_95_m: float, axis: str) -> Category | None:
    """Return the most demanding category whose horizontal or vertical figure is met alone.

    "lateral" is one axis of the horizontal one.

    Examples
    --------
    >>> axis_category_met(7.0, "horizontal").name, axis_category_met(2.1, "vertical").name
    ('CAT I', 'CAT I')
    """
    met = [one for one in CATEGORIES if error_95_m <= (one.vertical_m if axis == "vertical" else one.horizontal_m)]
    return met[-1] if met else None


@cache
def _radial_factors() -> tuple[FloatArray, FloatArray]:
    """95 % radius over the larger sigma, by the ratio of the smaller one to it."""
    ratio = np.linspace(0.0, 1.0, _RATIOS)
    angle_rad = (np.arange(_ANGLES) + 0.5) * (2.0 * np.pi / _ANGLES)
    length2 = np.cos(angle_rad) ** 2 + np.outer(ratio**2, np.sin(angle_rad) ** 2)
    low, high = np.full(_RATIOS, 1.9), np.full(_RATIOS, 2.5)
    for _ in range(_HALVINGS):  # the share outside falls with the radius
        middle = 0.5 * (low + high)
        outside = np.exp(-0.5 * middle[:, None] ** 2 / length2).mean(axis=1)
        low, high = np.where(outside > 0.05, middle, low), np.where(outside > 0.05, high, middle)
    return frozen(ratio), frozen(0.5 * (low + high))


def radius_95_m(covariance_m2: ArrayLike) -> FloatArray:
    """Radius within which 95 % of errors in a plane lie.

    Parameters
    ----------
    covariance_m2 : ndarray, shape (..., 2, 2)

    Returns
    -------
    ndarray, shape (...)

    Notes
    -----
    With x = s1 r cos a, y = s2 r sin a, where r is Rayleigh and a uniform, the share outside R is the mean over a of
    exp(-R^2 / (2 (s1^2 cos^2 a + s2^2 sin^2 a))).

    Examples
    --------
    >>> radius_95_m(np.eye(2)).round(3).item(), radius_95_m(np.diag([1.0, 0.0])).round(2).item()
    (2.448, 1.96)
    """
    variances = np.clip(np.linalg.eigvalsh(np.asarray(covariance_m2, dtype=np.float64)), 0.0, None)
    small, large = np.sqrt(variances[..., 0]), np.sqrt(variances[..., 1])
    ratio = np.divide(small, large, out=np.zeros_like(large), where=large > 0.0)
    return np.asarray(large * np.interp(ratio, *_radial_factors()))


def axis_95_m(sigma_m: ArrayLike) -> FloatArray:
    """Half width that holds 95 % of the errors of one axis."""
    return np.asarray(LINEAR_95 * np.asarray(sigma_m, dtype=np.float64))
