"""The error ellipse of a horizontal position."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray

BoolArray = NDArray[np.bool_]
ELLIPSE_95 = float(np.sqrt(-2.0 * np.log(0.05)))  # sigmas of the ellipse that holds 95 % of a normal pair
ROUND = np.linspace(0.0, 2.0 * np.pi, 49)
SEEN_SHARE = 0.03  # least width of an ellipse that is seen, as a share of the map's side
LARGEST_SHARE = 0.1  # most that an enlarged ellipse is wide about its middle, as such a share


def principal_axes(
    sigma_north: FloatArray, sigma_east: FloatArray, correlation: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Find the axes of error ellipses.

    Parameters
    ----------
    sigma_north, sigma_east : ndarrays, shape (n,)
        Both in the same unit.
    correlation : ndarray, shape (n,)
        Correlation of the errors north and east, -1 to 1.

    Returns
    -------
    ndarrays, shape (n,)
        Sigma along the major and along the minor axis, in the unit of the input, and the azimuth of the major axis in
        degrees, clockwise from north, -90 to 90.

    Examples
    --------
    >>> one = lambda *values: [round(float(part[0]), 6) for part in principal_axes(*(np.array([v]) for v in values))]
    >>> one(2.0, 1.0, 0.0), one(1.0, 2.0, 0.0), one(1.0, 1.0, 1.0)
    ([2.0, 1.0, 0.0], [2.0, 1.0, 90.0], [1.414214, 0.0, 45.0])
    """
    north, east, both = sigma_north**2, sigma_east**2, correlation * sigma_north * sigma_east
    middle, half = 0.5 * (north + east), np.hypot(0.5 * (north - east), both)
    azimuth_deg = np.rad2deg(0.5 * np.arctan2(2.0 * both, north - east))
    return np.sqrt(middle + half), np.sqrt(np.clip(middle - half, 0.0, None)), azimuth_deg


def outlines(sigma_north: FloatArray, sigma_east: FloatArray, correlation: FloatArray, sigmas: float) -> FloatArray:
    """Return outlines of error ellipses about the origin, north and east, shape (n, 49, 2).

    ``sigmas`` says how many standard deviations they have as half axes.

    Examples
    --------
    >>> one = outlines(np.array([2.0]), np.array([1.0]), np.array([0.0]), 2.0)[0]
    >>> one[0].tolist(), np.round(one[12], 9).tolist()
    ([4.0, 0.0], [0.0, 2.0])
    """
    across = np.sqrt(np.clip(1.0 - correlation**2, 0.0, None))
    north = sigma_north[:, None] * np.cos(ROUND)
    east = sigma_east[:, None] * (correlation[:, None] * np.cos(ROUND) + across[:, None] * np.sin(ROUND))
    return sigmas * np.stack([north, east], axis=2)


def fits(side_m: float, half_m: FloatArray) -> BoolArray:
    """Tell of each ellipse whether a map has room for it: it is at most as wide as the map.

    Examples
    --------
    >>> fits(100.0, np.array([50.0, 51.0, np.nan])).tolist()
    [True, False, False]
    """
    return np.asarray(2.0 * half_m <= side_m)


def told_ellipses(which: str, larger: int, left_out: int) -> str:
    """Return the sentence of a caption on ellipses: how enlarged, how many not drawn.

    Examples
    --------
    >>> told_ellipses("Ellipses: 95 %", 2000, 0), told_ellipses("Ellipses: 95 %", 1, 3)
    ('Ellipses: 95 %, drawn 2000 times their size.', 'Ellipses: 95 %; 3 wider than the map are not drawn.')
    """
    size = f", drawn {larger} times their size" if larger > 1 else ""
    are = "is" if left_out == 1 else "are"
    wider = f"; {left_out} wider than the map {are} not drawn" if left_out else ""
    return f"{which}{size}{wider}."


def magnified(side_m: float, half_m: FloatArray) -> int:
    """Return the factor by which ellipses are enlarged on a map: 1, 2, 5, 10, 20 ...

    An ellipse of the middle size is then seen, and the largest leaves the map to the track.

    Parameters
    ----------
    side_m : float
        Side of the map.
    half_m : ndarray, shape (n,)
        Half width of each ellipse; NaN where it has none.

    Examples
    --------
    >>> one = lambda side_m, *half_m: magnified(side_m, np.array(half_m))
    >>> one(100.0, 5.0), one(10_000.0, 2.0), one(10_000.0, 2.0, 2.0, 40.0), one(0.0, 0.0), one(1.0)
    (1, 100, 20, 1, 1)
    """
    half_m = half_m[half_m > 0.0]
    if not len(half_m):
        return 1
    wanted = side_m * min(SEEN_SHARE / float(np.median(half_m)), LARGEST_SHARE / float(half_m.max()))
    if not 1.0 <= wanted < np.inf:
        return 1
    decade: int = 10 ** int(np.floor(np.log10(wanted)))
    return decade * max(step for step in (1, 2, 5) if step * decade <= wanted)
