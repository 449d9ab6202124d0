"""The error ellipse of a horizontal position."""

import numpy as np

from groundstation.base.angles import FloatArray


def principal_axes(
    sigma_north: FloatArray, sigma_east: FloatArray, correlation: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Find the axes of error ellipses.

    Parameters
    ----------
    sigma_north, sigma_east : ndarrays, shape (n,)
        Of one unit.
    correlation : ndarray, shape (n,)
        Of the errors north and east, -1 to 1.

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
