"""Geodetic datums other than WGS-84 that places on the ground are stated in.

Each is the transformation that its authority publishes, as the EPSG dataset has it. Differences of a metre and less
(PZ-90.11, GSK-2011) cannot be seen by ranges over a link and are not among them.

Source: EPSG Geodetic Parameter Dataset, operations by their codes; of these 5044 and 5043 are those of GOST R
51794-2008, kept in GOST 32453-2017; EPSG Guidance Note 7-2, section 4.3 (coordinate frame rotation); ellipsoids EPSG
7024 (Krassowsky 1940), 7022 (International 1924), 7008 (Clarke 1866), 7004 (Bessel 1841).
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, ecef_m

RAD_PER_ARCSEC = float(np.deg2rad(1.0 / 3600.0))


@dataclass(frozen=True)
class Datum:
    """Datum with its transformation to WGS-84: translation, coordinate frame rotation, scale.

    Parameters
    ----------
    name : str
    epsg : int
        Code of the transformation.
    axis_m, flattening : float
        Ellipsoid: semi-major axis, inverse flattening.
    shift_m : three floats
    rotation_arcsec : three floats
        As a rotation of the coordinate frame.
    scale_ppm : float
    accuracy_m : float
        As the dataset states it.
    south_deg, north_deg, west_deg, east_deg : float
        Where the datum is in use.
    """

    name: str
    epsg: int
    axis_m: float
    flattening: float
    shift_m: tuple[float, float, float]
    rotation_arcsec: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale_ppm: float = 0.0
    accuracy_m: float = 10.0
    south_deg: float = -90.0
    north_deg: float = 90.0
    west_deg: float = -180.0
    east_deg: float = 180.0

    def is_used_at(self, latitude_deg: float, longitude_deg: float) -> bool:
        """Tell whether the datum is in use there; across the date line east is below west."""
        between = self.west_deg <= longitude_deg <= self.east_deg
        if self.east_deg < self.west_deg:
            between = longitude_deg >= self.west_deg or longitude_deg <= self.east_deg
        return between and self.south_deg <= latitude_deg <= self.north_deg

    def to_wgs84_m(self, latitude_deg: float, longitude_deg: float, height_m: float) -> FloatArray:
        """Return the WGS-84 position (ECEF) of coordinates in this datum, shape (3,)."""
        latitude, longitude = np.deg2rad(latitude_deg), np.deg2rad(longitude_deg)
        e2 = (2.0 - 1.0 / self.flattening) / self.flattening
        normal = self.axis_m / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        x = (normal + height_m) * np.cos(latitude) * np.cos(longitude)
        y = (normal + height_m) * np.cos(latitude) * np.sin(longitude)
        z = (normal * (1.0 - e2) + height_m) * np.sin(latitude)
        rx, ry, rz = (angle * RAD_PER_ARCSEC for angle in self.rotation_arcsec)
        turned = np.array([x + rz * y - ry * z, -rz * x + y + rx * z, ry * x - rx * y + z])
        return np.asarray(self.shift_m) + (1.0 + 1e-6 * self.scale_ppm) * turned

    def error_m(self, latitude_deg: float, longitude_deg: float) -> FloatArray:
        """Return believed less true place (north, east) of coordinates taken for WGS-84.

        Examples
        --------
        >>> SK_42.error_m(55.75, 37.6).round(0).tolist()
        [-5.0, 118.0]
        """
        wrong = ecef_m(latitude_deg, longitude_deg, 0.0) - self.to_wgs84_m(latitude_deg, longitude_deg, 0.0)
        return np.asarray((ecef_from_n(latitude_deg, longitude_deg).T @ wrong)[:2])


KRASSOWSKY = (6_378_245.0, 298.3)
SK_42 = Datum(
    "SK-42", 5044, *KRASSOWSKY, (23.57, -140.95, -79.8), (0.0, -0.35, -0.79), -0.22, 3.0, 41.0, 82.0, 19.0, -168.0
)
DATUMS = (
    SK_42,
    Datum(
        "SK-95", 5043, *KRASSOWSKY, (24.47, -130.89, -81.56), (0.0, 0.0, -0.13), -0.22, 1.0, 41.0, 82.0, 18.0, -168.0
    ),
    Datum(
        "ED50",
        1133,
        6_378_388.0,
        297.0,
        (-87.0, -98.0, -121.0),
        accuracy_m=10.0,
        south_deg=25.0,
        north_deg=85.0,
        west_deg=-17.0,
        east_deg=49.0,
    ),
    Datum(
        "NAD27",
        1173,
        6_378_206.4,
        294.978698213898,
        (-8.0, 160.0, 176.0),
        accuracy_m=10.0,
        south_deg=7.0,
        north_deg=84.0,
        west_deg=-173.0,
        east_deg=-47.0,
    ),
    Datum(
        "Tokyo",
        15484,
        6_377_397.155,
        299.1528128,
        (-146.414, 507.337, 680.507),
        accuracy_m=9.0,
        south_deg=20.0,
        north_deg=46.0,
        west_deg=122.0,
        east_deg=154.0,
    ),
)
BY_NAME = {datum.name: datum for datum in DATUMS}
