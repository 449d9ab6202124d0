"""Earth-centred, Earth-fixed positions on WGS-84, and local north-east-down axes.

Source: Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. 2013, equations
2.112 (to ECEF), 2.150 (axes), 2.113 and appendix C (back, by iteration).
"""

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M, curvature_radii_m

ITERATIONS = 6  # each gains more than two digits below 100 km


def ecef_m(latitude_deg: ArrayLike, longitude_deg: ArrayLike, height_m: ArrayLike) -> FloatArray:
    """Position in ECEF, metres, shape (..., 3).

    Examples
    --------
    >>> ecef_m(0.0, 90.0, 100.0).round(3).tolist()
    [0.0, 6378237.0, 0.0]
    """
    latitude_rad, longitude_rad = np.deg2rad(latitude_deg), np.deg2rad(longitude_deg)
    height = np.asarray(height_m, dtype=np.float64)
    _, normal = curvature_radii_m(latitude_deg)
    across = (normal + height) * np.cos(latitude_rad)
    up = (normal * (1.0 - ECCENTRICITY_SQUARED) + height) * np.sin(latitude_rad)
    return np.stack([across * np.cos(longitude_rad), across * np.sin(longitude_rad), up], axis=-1)


def geodetic_deg_m(position_m: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return latitude, longitude (degrees) and ellipsoid height (metres) of ECEF positions.

    Positions have the shape (..., 3), in metres.

    Examples
    --------
    >>> latitude, longitude, height = geodetic_deg_m(ecef_m(56.0, 38.0, 10_000.0))
    >>> round(float(latitude), 9), round(float(longitude), 9), round(float(height), 6)
    (56.0, 38.0, 10000.0)
    """
    x, y, z = np.moveaxis(np.asarray(position_m, dtype=np.float64), -1, 0)
    across = np.hypot(x, y)
    latitude_rad = np.arctan2(z, across * (1.0 - ECCENTRICITY_SQUARED))
    for _ in range(ITERATIONS):
        sine = np.sin(latitude_rad)
        normal = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
        latitude_rad = np.arctan2(z + ECCENTRICITY_SQUARED * normal * sine, across)
    sine, cosine = np.sin(latitude_rad), np.cos(latitude_rad)
    normal = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    height = across * cosine + z * sine - normal * (1.0 - ECCENTRICITY_SQUARED * sine * sine)
    return np.rad2deg(latitude_rad), np.rad2deg(np.arctan2(y, x)), height


def ecef_from_n(latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> FloatArray:
    """Return the rotation from north-east-down to ECEF, shape (..., 3, 3).

    Its columns are north, east and down in ECEF.

    Examples
    --------
    >>> ecef_from_n(0.0, 90.0).round(12)[:, 0].tolist()  # north
    [0.0, 0.0, 1.0]
    """
    latitude_rad, longitude_rad = np.broadcast_arrays(np.deg2rad(latitude_deg), np.deg2rad(longitude_deg))
    sine, cosine = np.sin(latitude_rad), np.cos(latitude_rad)
    sine_l, cosine_l = np.sin(longitude_rad), np.cos(longitude_rad)
    north = np.stack([0.0 - sine * cosine_l, 0.0 - sine * sine_l, cosine], axis=-1)
    east = np.stack([-sine_l, cosine_l, np.zeros_like(sine)], axis=-1)
    down = np.stack([-cosine * cosine_l, -cosine * sine_l, -sine], axis=-1)
    return np.stack([north, east, down], axis=-1)
