"""Local north-east-down frame: the plane that touches the ellipsoid at an origin.

All aircraft of a session share its axes.
"""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, ecef_m, geodetic_deg_m
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number, required_number

MOST_LATITUDE_DEG = 90.0 - 1e-7  # highest latitude of an origin: 1 cm from the pole there is a north


@dataclass(frozen=True)
class LocalFrame:
    """Origin of a local frame; the axes are north, east and down at that point.

    Distances in it are those in ECEF. Down is the vertical of the origin alone: 60 km away the ellipsoid lies 280 m
    below the plane, and north differs by the convergence of the meridians.
    """

    latitude_deg: float = required_number(-90.0, 90.0)
    longitude_deg: float = required_number(-180.0, 180.0)
    altitude_ellipsoid_m: float = number(0.0, -1000.0, 100_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if abs(self.latitude_deg) == 90.0:
            raise SettingsError("latitude_deg", f"{self.latitude_deg:g}", "an origin with a north: no pole")

    @cached_property
    def _origin_m(self) -> FloatArray:
        return ecef_m(self.latitude_deg, self.longitude_deg, self.altitude_ellipsoid_m)

    @cached_property
    def _axes(self) -> FloatArray:
        return ecef_from_n(self.latitude_deg, self.longitude_deg)

    def to_ecef_m(self, position_m: ArrayLike) -> FloatArray:
        """ECEF positions of local ones, shape (..., 3).

        Examples
        --------
        >>> frame = LocalFrame(56.0, 38.0)
        >>> frame.from_ecef_m(frame.to_ecef_m([50_000.0, -30_000.0, -900.0])).round(6).tolist()
        [50000.0, -30000.0, -900.0]
        """
        return np.asarray(self._origin_m + np.asarray(position_m, dtype=np.float64) @ self._axes.T)

    def from_ecef_m(self, position_m: ArrayLike) -> FloatArray:
        """Local positions of ECEF ones, shape (..., 3)."""
        return np.asarray((np.asarray(position_m, dtype=np.float64) - self._origin_m) @ self._axes)

    def turned_to(self, latitude_deg: ArrayLike, longitude_deg: ArrayLike, vector: ArrayLike) -> FloatArray:
        """Turn local vectors (n, 3) to north, east and down of the places (n,)."""
        there = ecef_from_n(latitude_deg, longitude_deg)
        return np.asarray(np.einsum("nij,ni->nj", there, np.asarray(vector) @ self._axes.T))

    def turned_from(self, latitude_deg: ArrayLike, longitude_deg: ArrayLike, vector: ArrayLike) -> FloatArray:
        """Turn vectors (n, 3) from north, east and down of places (n,) to the axes of this frame."""
        there = ecef_from_n(latitude_deg, longitude_deg)
        return np.asarray(np.einsum("nij,nj->ni", there, np.asarray(vector, dtype=np.float64)) @ self._axes)


def heading_of(vector: FloatArray) -> FloatArray:
    """Heading, degrees, of vectors north, east (and down), shape (n, 2 or more)."""
    return np.asarray(wrap_360(np.rad2deg(np.arctan2(vector[:, 1], vector[:, 0]))))


def level_direction(heading_deg: ArrayLike) -> FloatArray:
    """Unit vectors north, east, down of headings, shape (n, 3)."""
    heading_rad = np.deg2rad(heading_deg)
    return np.stack([np.cos(heading_rad), np.sin(heading_rad), np.zeros_like(heading_rad)], axis=-1)


def plane_through(position_m: FloatArray) -> LocalFrame:
    """Return the frame whose origin is below the mean of ECEF positions (n, 3).

    The origin lies on the ellipsoid. NaN rows are left out.

    Examples
    --------
    >>> found = plane_through(ecef_m([55.0, 57.0], [38.0, 38.0], [0.0, 9000.0]))
    >>> round(found.latitude_deg), round(found.longitude_deg), found.altitude_ellipsoid_m
    (56, 38, 0.0)
    """
    middle = position_m[np.isfinite(position_m).all(axis=1)].mean(axis=0)
    latitude, longitude, _ = geodetic_deg_m(middle)
    return LocalFrame(float(np.clip(latitude, -MOST_LATITUDE_DEG, MOST_LATITUDE_DEG)), float(longitude))
