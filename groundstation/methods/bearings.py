"""Place of an aircraft by relative bearings of beacons, and how bearing errors act on it.

Frame of the runway: along (in the direction of landing), right and up from the middle of the threshold. A beacon at
(X, Y) is seen from the place (x, y) with heading p off the course at the relative bearing atan2(Y - y, X - x) - p,
clockwise. Two bearings of locators on the axis differ by what the side of the course makes alone: heading cancels.

Source: O. N. Skrypnik, thesis on navigation between aircraft, 2010, chapter 6. It gives the difference of bearings for
the side and D = D0 cot(bearing) for the distance of an aircraft on the course; both are here, beside the joint solution
that needs neither.
"""

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen

ITERATIONS, FIRST_DAMPING, SETTLED_M = 40, 1e-2, 0.01
FARTHEST_M, BESIDE_M = 50_000.0, 20.0
LEAST_DETERMINANT = 1e-24  # of the squared Jacobian over metres: beacons on one line


@dataclass(frozen=True)
class BearingFix:
    """Places found, shape (n,) each; NaN where there is none.

    Parameters
    ----------
    along_m, right_m, off_course_deg : ndarrays
        Place, and heading minus course.
    covariance : ndarray, shape (n, 2, 2)
        Of along and right, m^2, from independent errors of the bearings.
    """

    along_m: FloatArray
    right_m: FloatArray
    off_course_deg: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        for name in ("along_m", "right_m", "off_course_deg", "covariance"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def relative_bearings(
    along_m: ArrayLike, right_m: ArrayLike, off_course_deg: ArrayLike, beacons_m: FloatArray
) -> FloatArray:
    """Return the relative bearings of beacons (k, 2) from places (n,), shape (n, k).

    Degrees in [-180, 180).

    Examples
    --------
    >>> relative_bearings([-1000.0], [0.0], [5.0], np.array([[0.0, 1000.0], [-4000.0, 0.0]])).round(6).tolist()
    [[40.0, 175.0]]
    """
    ahead = beacons_m[:, 0] - np.atleast_1d(along_m)[:, None]
    aside = beacons_m[:, 1] - np.atleast_1d(right_m)[:, None]
    return wrap_180(np.rad2deg(np.arctan2(aside, ahead)) - np.atleast_1d(off_course_deg)[:, None])


def side_from_difference_m(
    difference_deg: ArrayLike, before_m: ArrayLike, outer_m: float, inner_m: float
) -> FloatArray:
    """Return the deviation right of the course by the bearings of two locators.

    The difference is the bearing of the outer locator minus that of the inner one, at a known distance. Its sign
    changes where a locator is passed.

    Parameters
    ----------
    difference_deg, before_m : array_like
        Difference, and distance of the aircraft before the threshold.
    outer_m, inner_m : float
        Distances of the locators before the threshold.

    Notes
    -----
    tan(difference) = -y B / (g + y^2), with B = outer - inner and g = (before - outer)(before - inner); the root that
    is 0 with the difference.

    Examples
    --------
    Right of the course by 50 m, 2500 m before the threshold: the outer locator is behind, the inner one ahead.

    >>> seen = relative_bearings([-2500.0], [50.0], [7.0], np.array([[-4000.0, 0.0], [-1000.0, 0.0]]))
    >>> round(side_from_difference_m(seen[:, 0] - seen[:, 1], 2500.0, 4000.0, 1000.0).item(), 6)
    50.0
    """
    t, before = np.tan(np.deg2rad(difference_deg)), np.asarray(before_m, dtype=np.float64)
    base, g = outer_m - inner_m, (before - outer_m) * (before - inner_m)
    root = base * base - 4.0 * g * t * t
    with np.errstate(invalid="ignore"):
        return np.asarray(-2.0 * g * t / (base + np.sqrt(root)))


def side_sigma_m(before_m: ArrayLike, bearing_sigma_deg: float, outer_m: float, inner_m: float) -> FloatArray:
    """Return the sigma of :func:`side_from_difference_m` near the course.

    It is sqrt(2) sigma |(before - outer)(before - inner)| / (outer - inner).

    Examples
    --------
    >>> round(2.0 * side_sigma_m(320.0, 1.0, 4000.0, 1000.0).item())
    41
    """
    before, sigma_rad = np.asarray(before_m, dtype=np.float64), np.deg2rad(bearing_sigma_deg)
    return np.asarray(np.sqrt(2.0) * sigma_rad * np.abs((before - outer_m) * (before - inner_m)) / (outer_m - inner_m))


def distance_from_bearing_m(bearing_deg: ArrayLike, side_m: float) -> FloatArray:
    """Return the distance before the threshold by the bearing of a beacon level with it.

    It is D0 cot(bearing), the bearing being counted from the course.

    Examples
    --------
    1000 m before the threshold, the beacon 1000 m aside. Taken from the nose, 5 degrees of crab either way read:

    >>> distance_from_bearing_m([45.0, 50.0, 40.0], 1000.0).round().tolist()
    [1000.0, 839.0, 1192.0]
    """
    return np.asarray(side_m / np.tan(np.deg2rad(bearing_deg)))


def distance_sigma_m(before_m: ArrayLike, bearing_sigma_deg: float, side_m: float) -> FloatArray:
    """Return the sigma of :func:`distance_from_bearing_m`: sqrt(2) sigma (D0^2 + D^2) / |D0|.

    The course is taken from one locator.

    Examples
    --------
    >>> round(distance_sigma_m(0.0, 1.0, 500.0).item(), 1)
    12.3
    """
    before = np.asarray(before_m, dtype=np.float64)
    return np.asarray(np.sqrt(2.0) * np.deg2rad(bearing_sigma_deg) * (side_m**2 + before**2) / abs(side_m))


def solve_bearings(bearings_deg: FloatArray, beacons_m: FloatArray, sigma_deg: float) -> BearingFix:
    """Solve for place and heading off the course by the bearings of three beacons or more.

    By least squares over the relative bearings.

    Parameters
    ----------
    bearings_deg : ndarray, shape (n, k)
        NaN where a beacon is not heard or is overhead; fewer than three give no place.
    beacons_m : ndarray, shape (k, 2)
        Along and right.
    sigma_deg : float
        Of each bearing.

    Notes
    -----
    Levenberg and Marquardt from a start on the course, at the distance that the beacon farthest from the axis shows
    against the line of the others. What does not settle, or leaves a bearing unexplained, is NaN.

    Source: Marquardt, An algorithm for least-squares estimation of nonlinear parameters, J. SIAM 11(2), 1963.
    """
    known = np.isfinite(bearings_deg)
    place, damping = _start(bearings_deg, beacons_m), np.full(len(bearings_deg), FIRST_DAMPING)
    residual = _residual(bearings_deg, place, beacons_m)
    for _ in range(ITERATIONS):
        normal, gradient = _normal(place, beacons_m, known, residual)
        damped = normal + damping[:, None, None] * normal * np.eye(3)
        tried = place + np.linalg.solve(_regular(damped), gradient[..., None])[..., 0]
        new = _residual(bearings_deg, tried, beacons_m)
        is_better = (new**2).sum(axis=1) < (residual**2).sum(axis=1)
        place, residual = np.where(is_better[:, None], tried, place), np.where(is_better[:, None], new, residual)
        damping = np.clip(np.where(is_better, 0.2 * damping, 5.0 * damping), 1e-12, 1e6)
    normal, gradient = _normal(place, beacons_m, known, residual)
    step = np.linalg.solve(_regular(normal), gradient[..., None])[..., 0]
    settled = (np.abs(step[:, :2]) < SETTLED_M).all(axis=1) & (np.abs(place[:, :2]) < FARTHEST_M).all(axis=1)
    with np.errstate(over="ignore"):
        good = settled & (known.sum(axis=1) >= 3) & (np.linalg.det(normal) > LEAST_DETERMINANT)
    place = np.where(good[:, None], place, np.nan)
    covariance = np.linalg.inv(_regular(normal)) * np.deg2rad(sigma_deg) ** 2
    covariance[~good] = np.nan
    return BearingFix(place[:, 0], place[:, 1], wrap_180(np.rad2deg(place[:, 2])), covariance[:, :2, :2])


def _residual(bearings_deg: FloatArray, place: FloatArray, beacons_m: FloatArray) -> FloatArray:
    """Bearings measured minus expected, radians, 0 where there is none."""
    expected = relative_bearings(place[:, 0], place[:, 1], np.rad2deg(place[:, 2]), beacons_m)
    return np.nan_to_num(np.deg2rad(wrap_180(bearings_deg - expected)))


def _normal(
    place: FloatArray, beacons_m: FloatArray, known: BoolArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    jacobian = _jacobian(place, beacons_m) * known[..., None]
    across = np.swapaxes(jacobian, 1, 2)
    return across @ jacobian, (across @ residual[..., None])[..., 0]


def _regular(matrices: FloatArray) -> FloatArray:
    """Matrices that can be solved: those that cannot become the identity."""
    return np.where((np.linalg.det(matrices) > LEAST_DETERMINANT)[:, None, None], matrices, np.eye(3))


def _start(bearings_deg: FloatArray, beacons_m: FloatArray) -> FloatArray:
    """Return a first place: distance by the beacon aside, side by the others' difference.

    The distance is kept within the stretch that locators ahead and behind leave. The beacon farthest from the axis is
    the one aside; the line of the others is the course, in the sense that has it on its own side.
    """
    aside = int(np.argmax(np.abs(beacons_m[:, 1])))
    others = [place for place in range(len(beacons_m)) if place != aside]
    doubled_rad = 2.0 * np.deg2rad(bearings_deg[:, others])  # ahead and behind are one line
    line_deg = 0.5 * np.rad2deg(np.arctan2(np.nansum(np.sin(doubled_rad), 1), np.nansum(np.cos(doubled_rad), 1)))
    side_m = beacons_m[aside, 1]
    is_reversed = wrap_180(bearings_deg[:, aside] - line_deg) * side_m < 0.0
    line_deg = np.where(is_reversed, wrap_180(line_deg + 180.0), line_deg)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = beacons_m[aside, 0] - side_m / np.tan(np.deg2rad(bearings_deg[:, aside] - line_deg))
        is_ahead = np.cos(np.deg2rad(bearings_deg[:, others] - line_deg[:, None])) > 0.0
    low = np.where(is_ahead, -FARTHEST_M, beacons_m[others, 0] + BESIDE_M).max(axis=1)
    high = np.where(is_ahead, beacons_m[others, 0] - BESIDE_M, FARTHEST_M).min(axis=1)
    along = np.clip(along, low, np.maximum(low, high))
    one, two = others[:2]
    difference = bearings_deg[:, one] - bearings_deg[:, two]
    right = side_from_difference_m(difference, -along, -float(beacons_m[one, 0]), -float(beacons_m[two, 0]))
    return np.column_stack([along, np.nan_to_num(right), -np.deg2rad(line_deg)])


def _jacobian(place: FloatArray, beacons_m: FloatArray) -> FloatArray:
    """Return the derivatives of the bearings (radians), shape (n, k, 3).

    They are by along, right and heading off the course.
    """
    ahead = beacons_m[:, 0] - place[:, 0, None]
    aside = beacons_m[:, 1] - place[:, 1, None]
    square = ahead**2 + aside**2
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = [aside / square, -ahead / square, -np.ones_like(square)]
    return np.nan_to_num(np.stack(rows, axis=-1))
