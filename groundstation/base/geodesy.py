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
MEAN_RADIUS_M = 6_371_000.0  # of a sphere: enough for the size of a step
METRES_PER_DEG = 111_195.0  # of latitude on that sphere, rounded
NO_POSITION_DEG = 1e-7  # a centimetre: a receiver or a filter without a position writes zeros
NO_POSITION = "records with latitude and longitude 0: no position, kept as raw values alone"
MOST_ON_EARTH_DEG = {"latitude_deg": 90.0, "longitude_deg": 360.0}  # some count longitudes from 0 to 360
POLAR_LATITUDE_DEG = 85.0  # from here on a plan is drawn as seen from above its origin


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
    """Return latitude and longitude in degrees, both NaN where one of them is impossible.

    Impossible is a latitude beyond 90 deg or a longitude beyond a turn.

    Examples
    --------
    >>> latitude, longitude = on_earth([56.0, 1e308, 56.0], [38.0, 38.0, np.inf])
    >>> latitude.tolist(), longitude.tolist()
    ([56.0, nan, nan], [38.0, nan, nan])
    """
    latitude, longitude = np.asarray(latitude_deg, dtype=np.float64), np.asarray(longitude_deg, dtype=np.float64)
    most_latitude_deg, most_longitude_deg = MOST_ON_EARTH_DEG.values()
    is_place = (np.abs(latitude) <= most_latitude_deg) & (np.abs(longitude) <= most_longitude_deg)
    return np.where(is_place, latitude, np.nan), np.where(is_place, longitude, np.nan)


def has_position(latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> BoolArray:
    """Tell which rows have a position: both angles finite and not both near zero.

    Near zero is below ``NO_POSITION_DEG``.

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


def continuous_longitude_deg(longitude_deg: ArrayLike) -> FloatArray:
    """Longitudes of a path, shape (n,), without a step at the date line; NaN stays NaN.

    Each is within half a turn of the known one before it, so that some lie beyond 180 deg; the middle of the path does
    not. A path that does not cross the date line is returned as it is.

    Examples
    --------
    >>> continuous_longitude_deg([179.5, np.nan, -179.75]).tolist(), continuous_longitude_deg([-179.5, 179.75]).tolist()
    ([179.5, nan, 180.25], [-179.5, -180.25])
    >>> continuous_longitude_deg([179.9, -179.0]).tolist()
    [-180.1, -179.0]
    """
    longitude = np.array(longitude_deg, dtype=np.float64)
    known = np.isfinite(longitude)
    if known.any():
        path = np.unwrap(longitude[known], period=360.0)
        longitude[known] = path - 360.0 * np.round(0.5 * (path.min() + path.max()) / 360.0)
    return longitude


def north_east_m(
    latitude_deg: ArrayLike,
    longitude_deg: ArrayLike,
    origin_latitude_deg: FloatArray | float,
    origin_longitude_deg: FloatArray | float,
    altitude_m: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Displacements in metres north and east, from one origin or each from its own.

    They are good to 0.1 % within 50 km. The date line is crossed as if it were not there. An impossible position (a
    latitude beyond 90 deg, a longitude beyond a turn) has NaN.

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


def is_near_pole(latitude_deg: ArrayLike) -> bool:
    """Tell whether one of some places lies so near a pole that a plan is drawn from above.

    Examples
    --------
    >>> is_near_pole([56.0, np.nan, -89.0]), is_near_pole(56.0)
    (True, False)
    """
    with np.errstate(invalid="ignore"):
        return bool((np.abs(np.asarray(latitude_deg, dtype=np.float64)) > POLAR_LATITUDE_DEG).any())


def plan_north_east_m(
    latitude_deg: ArrayLike,
    longitude_deg: ArrayLike,
    origin_latitude_deg: float,
    origin_longitude_deg: float,
    *,
    is_polar: bool | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Places on a plan, metres north and east of an origin; true in shape near a pole too.

    Where one place lies beyond 85 deg of latitude, all are drawn at their distance and direction from the origin
    (azimuthal equidistant), so that a straight flight over a pole is a straight line. ``is_polar`` says so for places
    that are drawn on the plan of others.

    Examples
    --------
    >>> north, east = plan_north_east_m([89.0, 90.0, 89.0], [30.0, 0.0, -150.0], 89.0, 30.0)
    >>> (north / 1e3).round(1).tolist(), (abs(east) < 0.001).tolist()
    ([0.0, 111.7, 223.4], [True, True, True])
    """
    latitude, longitude = on_earth(latitude_deg, longitude_deg)
    if is_polar is None:
        is_polar = is_near_pole(np.append(latitude, origin_latitude_deg))
    if not is_polar:
        return north_east_m(latitude, longitude, origin_latitude_deg, origin_longitude_deg)
    latitude_rad, difference_rad = np.deg2rad(latitude), np.deg2rad(longitude - origin_longitude_deg)
    origin_rad = np.deg2rad(origin_latitude_deg)
    north = np.sin(latitude_rad) * np.cos(origin_rad) - np.cos(latitude_rad) * np.sin(origin_rad) * np.cos(
        difference_rad
    )
    east = np.cos(latitude_rad) * np.sin(difference_rad)
    up = np.sin(latitude_rad) * np.sin(origin_rad) + np.cos(latitude_rad) * np.cos(origin_rad) * np.cos(difference_rad)
    across = np.hypot(north, east)
    meridian, _unused = curvature_radii_m(origin_latitude_deg)
    scale = np.arctan2(across, up) * meridian / np.where(across > 0.0, across, 1.0)
    return north * scale, east * scale


def latitude_longitude_deg(
    north_m: ArrayLike, east_m: ArrayLike, origin_latitude_deg: float, origin_longitude_deg: float
) -> tuple[FloatArray, FloatArray]:
    """Return latitude and longitude, degrees, of displacements from an origin.

    It is the inverse of :func:`north_east_m`.

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


def displaced_deg(
    latitude_deg: FloatArray, longitude_deg: FloatArray, altitude_m: FloatArray, moved_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return latitude and longitude, degrees, of places moved on the tangent plane of each.

    Parameters
    ----------
    latitude_deg, longitude_deg, altitude_m : ndarray, shape (n,)
    moved_m : ndarray, shape (n, 2)
        North and east, metres.

    Examples
    --------
    >>> latitude, longitude = displaced_deg(*np.array([[56.0], [179.99], [0.0]]), np.array([[0.0, 1000.0]]))
    >>> round(float(latitude[0]), 4), round(float(longitude[0]), 4)
    (56.0, -179.994)
    """
    meridian, prime_vertical = curvature_radii_m(latitude_deg)
    parallel = (prime_vertical + altitude_m) * np.cos(np.deg2rad(latitude_deg))
    latitude = latitude_deg + np.rad2deg(moved_m[:, 0] / (meridian + altitude_m))
    return np.asarray(latitude), np.asarray(wrap_180(longitude_deg + np.rad2deg(moved_m[:, 1] / parallel)))
