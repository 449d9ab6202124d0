"""Rows that hold zeros in place of values: no position, or a filter without states."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.geodesy import NO_POSITION, has_position
from groundstation.base.records import BoolArray, Column, Damage, Int64Array
from groundstation.base.signals import kind_of

PLACED = ("ins", "gnss")  # kinds of topics that tell a place; one that a simulator tells as truth is what it is
_PLACE = (
    *("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m"),
    *("horizontal_sigma_m", "vertical_sigma_m"),
)
_MOTION = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps", "ground_speed_mps", "track_deg")


def without_place(latitude: Column, longitude: Column) -> BoolArray:
    """Tell which rows have a latitude and a longitude that are both zero, shape (n,).

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
    """Return masks, by field, of values to drop where rows have no position, shape (n,).

    The height and the sigmas go with the place. A receiver that has no place has no velocity either: its motion is
    dropped where all of it is zero.

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


def placed(topic: str, columns: Mapping[str, Column]) -> tuple[dict[str, Column], Int64Array]:
    """Drop the values of fixes at latitude and longitude 0, and return the rows of these.

    A fix without a place has no integrity. Columns of which nothing is left are left out.

    Examples
    --------
    >>> latitude, longitude = Column(np.array([0.0, 56.0])), Column(np.array([1e-9, 0.0]))
    >>> found, rows = placed("gnss", {"latitude_deg": latitude, "longitude_deg": longitude})
    >>> found["latitude_deg"].mask.tolist(), rows.tolist()
    ([False, True], [0])
    """
    if not columns.keys() >= {"latitude_deg", "longitude_deg"}:
        return dict(columns), np.zeros(0, dtype=np.int64)
    is_zero = without_place(columns["latitude_deg"], columns["longitude_deg"])
    if not is_zero.any():
        return dict(columns), np.zeros(0, dtype=np.int64)
    kept = dict(columns)
    for name, absent in zeroed(kind_of(topic), columns, is_zero).items():
        kept[name] = Column(kept[name].values, kept[name].mask & ~absent)
    if "integrity_ok" in kept:
        kept["integrity_ok"] = Column(kept["integrity_ok"].values & ~is_zero, kept["integrity_ok"].present)
    return {name: one for name, one in kept.items() if one.mask.any()}, np.flatnonzero(is_zero)


def nowhere(topic: str, count: int, place: str = "the whole log") -> Damage:
    """Return a damage that counts rows without a position; the raw values keep it."""
    return Damage("no_position", place, count, NO_POSITION, topic, loses_data=False)


def unready_filter(topic: str, count: int, records: str) -> Damage:
    """Return a damage that counts rows of a filter that was not initialised.

    The raw values keep them.
    """
    what = f"records of {records} while the filter was not initialised, by its own status: not taken for a solution"
    return Damage("no_solution", "the whole log", count, what, topic, loses_data=False)
