"""Coastline of the Earth, without a network: Natural Earth 1:10m, simplified.

``benchmarks/make_coastline.py`` makes ``coastline.npz`` and measures its error against GSHHG 2.3.6: of the line's
length half is within 0.5 km of the shore, 90 % within 1.8 km. Of the shores 90 % have the line within 3.3 km: islands
below 2 km2 and narrow bays are not in it, nor are lakes.
"""

from functools import cache
from math import asin, cos, degrees, radians, sin
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.geodesy import SEMI_MAJOR_M

FILE = Path(__file__).with_name("coastline.npz")
NAME = "Natural Earth 1:10m"
ERROR_M = 2000.0  # 90 % of its length lie within
LONGEST_DEG = 0.51  # of latitude or longitude between two places of a line
HALF_TURN_DEG = 180.0
Whole: TypeAlias = NDArray[np.int32]


@cache
def _kept() -> tuple[Whole, NDArray[np.bool_], float]:
    """Return all places in whole units, shape (2, n), where lines begin, and the unit."""
    with np.load(FILE, allow_pickle=False) as kept:
        steps, starts, counts, unit_deg = (kept[name] for name in ("steps", "starts", "counts", "unit_deg"))
    behind = np.cumsum(counts + 1)
    first = np.append(0, behind[:-1])
    begins = np.zeros(behind[-1], dtype=bool)
    begins[first] = True
    places = np.empty((2, len(begins)), dtype=np.int32)
    places[:, ~begins] = steps
    ends = starts + np.add.reduceat(steps, np.append(0, np.cumsum(counts)[:-1]), axis=1, dtype=np.int32)
    places[:, first] = starts
    places[:, first[1:]] -= ends[:, :-1]
    return np.cumsum(places, axis=1, dtype=np.int32), begins, float(unit_deg)


def coastline_near(latitude_deg: float, longitude_deg: float, distance_m: float) -> tuple[FloatArray, FloatArray]:
    """Return latitudes and longitudes of the coastline around a place, NaN between its lines.

    All of it within the distance is there, and some beyond. Longitudes are within half a turn of the place's; a line is
    broken where it passes the meridian opposite.

    Examples
    --------
    >>> latitude, longitude = coastline_near(-34.83, 20.0, 5_000.0)  # Cape Agulhas
    >>> bool(np.nanmin(latitude) > -34.9), coastline_near(50.0, 80.0, 5_000.0)[0].size
    (True, 0)
    """
    places, begins, unit_deg = _kept()
    half_deg = min(degrees(distance_m / SEMI_MAJOR_M) * 1.01, HALF_TURN_DEG)
    latitude = unit_deg * places[1]
    near = np.flatnonzero(np.abs(latitude - latitude_deg) <= half_deg + LONGEST_DEG)
    east = wrap_180(unit_deg * places[0, near] - longitude_deg)
    inside = np.abs(east) <= _half_width_deg(latitude_deg, half_deg) + LONGEST_DEG
    rows, east = near[inside], east[inside]
    if not rows.size:
        return np.zeros(0), np.zeros(0)
    breaks = begins[rows[1:]] | (np.diff(rows) > 1) | (np.abs(np.diff(east)) > HALF_TURN_DEG)
    after = np.flatnonzero(breaks) + 1
    return np.insert(latitude[rows], after, np.nan), np.insert(longitude_deg + east, after, np.nan)


def _half_width_deg(latitude_deg: float, half_deg: float) -> float:
    """Return how far a circle about a place reaches in longitude; half a turn around a pole."""
    if abs(latitude_deg) + half_deg >= 90.0:
        return HALF_TURN_DEG
    return degrees(asin(min(sin(radians(half_deg)) / cos(radians(latitude_deg)), 1.0)))
