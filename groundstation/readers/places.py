"""Rows with latitude and longitude zero: a receiver without a position writes them."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.geodesy import has_position
from groundstation.base.records import BoolArray, Column

PLACED = ("ins", "gnss")  # kinds of topics that tell a place; one that a simulator tells as truth is what it is
_PLACE = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m")
_MOTION = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps", "ground_speed_mps", "track_deg")


def without_place(latitude: Column, longitude: Column) -> BoolArray:
    """Rows with a latitude and a longitude that are both zero, shape (n,).

    Examples
    --------
    >>> zero, place = np.array([0.0, 0.0, 0.0]), np.array([0.0, 38.0, np.nan])
    >>> without_place(Column(zero), Column(place)).tolist()
    [True, False, False]
    """
    present = latitude.mask & longitude.mask
    finite = np.isfinite(latitude.values) & np.isfinite(longitude.values)
    return np.asarray(present & finite & ~has_position(latitude.values, longitude.values))


def zeroed(kind: str, fields: Mapping[str, Column], is_zero: BoolArray) -> dict[str, BoolArray]:
    """Masks of the values that fall away where rows have no place, by field, shape (n,) each.

    The height goes with the place. A receiver that has no place has no velocity either: what it tells of motion goes
    where all of it is zero.

    Parameters
    ----------
    kind : str
        ``gnss`` or ``ins``.
    fields : mapping of field to Column
    is_zero : ndarray of bool, shape (n,)
    """
    absent = {name: is_zero for name in _PLACE if name in fields}
    moving = [fields[name] for name in _MOTION if name in fields]
    if kind == "gnss" and moving:
        is_still = np.logical_and.reduce([~one.mask | (one.values == 0.0) for one in moving])
        absent |= {name: is_zero & is_still for name in _MOTION if name in fields}
    return absent
