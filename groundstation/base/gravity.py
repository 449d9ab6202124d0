"""Normal gravity of WGS-84: the figures, and gravity by latitude and height.

Source: NIMA TR8350.2, Department of Defense World Geodetic System 1984, third edition (2000), tables 3.1 to 3.4.
"""

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M

GRAVITY_EQUATOR_MPS2 = 9.7803253359
SOMIGLIANA = 0.00193185265241
GEODETIC_RATIO = 0.00344978650684  # omega^2 a^2 b / GM


def normal_gravity_mps2(latitude_deg: ArrayLike, height_m: ArrayLike) -> FloatArray:
    """Normal gravity, m/s^2 downwards, at latitudes and heights above the ellipsoid.

    gamma = gamma_0 (1 - 2 (1 + f + m - 2 f sin^2 L) h / a + 3 h^2 / a^2), gamma_0 by Somigliana. It ignores the part
    to the north, 8e-9 m/s^2 a metre of height, and is good to 1e-6 m/s^2 below 20 km.

    Source: NIMA TR8350.2, 3rd ed. 2000, equations 4-1 and 4-3.

    Examples
    --------
    >>> normal_gravity_mps2([0.0, 45.0, 90.0], 0.0).round(8).tolist()
    [9.78032534, 9.80619777, 9.83218494]
    >>> float(normal_gravity_mps2(0.0, 1000.0).round(5))
    9.77724
    """
    sine_squared = np.sin(np.deg2rad(np.asarray(latitude_deg, dtype=np.float64))) ** 2
    height = np.asarray(height_m, dtype=np.float64) / SEMI_MAJOR_M
    at_zero = (
        GRAVITY_EQUATOR_MPS2 * (1.0 + SOMIGLIANA * sine_squared) / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine_squared)
    )
    first = 2.0 * (1.0 + FLATTENING + GEODETIC_RATIO - 2.0 * FLATTENING * sine_squared)
    return np.asarray(at_zero * (1.0 - first * height + 3.0 * height * height))
