"""WGS-84 ellipsoid: radii of curvature and small displacements.

Source: NIMA TR8350.2, Department of Defense World Geodetic System 1984, third edition (2000), tables 3.1 and 3.3.
"""

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.records import BoolArray

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
EARTH_RATE_RADPS = 7.292115e-5
NO_POSITION_DEG = 1e-7  # a centimetre: a receiver or a filter without a position writes zeros
NO_POSITION = "records with latitude and longitude 0: no position, kept as raw values alone"


def curvature_radii_m(latitude_deg: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Meridian and prime-vertical radii of curvature, metres, shape as the latitude.

    Examples
    --------
    >>> meridian, prime_vertical = curvature_radii_m(0.0)
    >>> round(float(meridian), 3), round(float(prime_vertical), 3)
    (6335439.327, 6378137.0)
    """
    sine = np.sin(np.deg2rad(np.asarray(latitude_deg, dtype=np.float64)))
    denominator = 1.0 - ECCENTRICITY_SQUARED * sine * sine
    prime_vertical = SEMI_MAJOR_M / np.sqrt(denominator)
    return prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / denominator, prime_vertical


def on_earth(latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude, degrees, both NaN where the latitude is beyond 90 deg or the longitude beyond a turn.

    Examples
    --------
    >>> latitude, longitude = on_earth([56.0, 1e308, 56.0], [38.0, 38.0, np.inf])
    >>> latitude.tolist(), longitude.tolist()
    ([56.0, nan, nan], [38.0, nan, nan])
    """
    latitude, longitude = np.asarray(latitude_deg, dtype=np.float64), np.asarray(longitude_deg, dtype=np.float64)
    is_place = (np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 360.0)
    return np.where(is_place, latitude, np.nan), np.where(is_place, longitude, np.nan)


def has_position(latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> BoolArray:
    """Rows with a position: both angles are finite, and not both are below ``NO_POSITION_DEG``.

    Parameters
    ----------
    latitude_deg, longitude_deg : array_like, same shape
        As the device wrote them, degrees.

    Returns
    -------
    ndarray of bool, same shape
        False where the device had no position yet. A place on the equator or on the meridian of Greenwich is one.

    Examples
    --------
    >>> has_position([56.0, 0.0, 0.0, 3e-8, np.nan], [38.0, 0.0, 38.0, -3e-8, 38.0]).tolist()
    [True, False, True, False, False]
    """
    latitude, longitude = np.asarray(latitude_deg, dtype=np.float64), np.asarray(longitude_deg, dtype=np.float64)
    is_zero = (np.abs(latitude) < NO_POSITION_DEG) & (np.abs(longitude) < NO_POSITION_DEG)
    return np.asarray(np.isfinite(latitude) & np.isfinite(longitude) & ~is_zero)


def north_east_m(
    latitude_deg: ArrayLike,
    longitude_deg: ArrayLike,
    origin_latitude_deg: float,
    origin_longitude_deg: float,
    altitude_m: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Displacements from an origin in metres north and east, good to 0.1 % within 50 km.

    The date line is crossed as if it were not there. What is no position (a latitude beyond 90 deg, a longitude beyond
    a turn) has no displacement: NaN.

    Examples
    --------
    >>> north, east = north_east_m(0.001, -179.999, 0.0, 179.999)
    >>> round(float(north), 2), round(float(east), 2)
    (110.57, 222.64)
    """
    latitude, longitude = on_earth(latitude_deg, longitude_deg)
    meridian, prime_vertical = curvature_radii_m(0.5 * (latitude + origin_latitude_deg))
    mid_latitude_rad = np.deg2rad(0.5 * (latitude + origin_latitude_deg))
    north = np.deg2rad(latitude - origin_latitude_deg) * (meridian + altitude_m)
    difference = wrap_180(longitude - origin_longitude_deg)
    east = np.deg2rad(difference) * (prime_vertical + altitude_m) * np.cos(mid_latitude_rad)
    return north, east


def latitude_longitude_deg(
    north_m: ArrayLike, east_m: ArrayLike, origin_latitude_deg: float, origin_longitude_deg: float
) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude, degrees, of displacements from an origin: the inverse of :func:`north_east_m`.

    Examples
    --------
    >>> latitude, longitude = latitude_longitude_deg(1000.0, 2000.0, 56.0, 179.99)
    >>> north, east = north_east_m(latitude, longitude, 56.0, 179.99)
    >>> round(float(north), 6), round(float(east), 6)
    (1000.0, 2000.0)
    """
    north = np.asarray(north_m, dtype=np.float64)
    latitude = np.asarray(origin_latitude_deg + np.rad2deg(north / SEMI_MAJOR_M))
    for _ in range(4):  # fixed point; contracts by the eccentricity squared (0.7 %) each time
        meridian, _unused = curvature_radii_m(0.5 * (latitude + origin_latitude_deg))
        latitude = origin_latitude_deg + np.rad2deg(north / meridian)
    _unused, prime_vertical = curvature_radii_m(0.5 * (latitude + origin_latitude_deg))
    mid_latitude_rad = np.deg2rad(0.5 * (latitude + origin_latitude_deg))
    difference_deg = np.rad2deg(np.asarray(east_m, dtype=np.float64) / (prime_vertical * np.cos(mid_latitude_rad)))
    return latitude, wrap_180(origin_longitude_deg + difference_deg)
