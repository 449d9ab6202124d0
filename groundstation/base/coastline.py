"""Coastline of the Earth: Natural Earth 1:10m, simplified, public domain.

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
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import BoolArray

FILE = Path(__file__).with_name("coastline.npz")
NAME = "Natural Earth 1:10m"
ERROR_M = 2000.0  # 90 % of its length lie within
LONGEST_DEG = 0.51  # of latitude or longitude between two places of a line
COARSE_M = 8000.0  # as far the coarse line lies from the other
HALF_TURN_DEG = 180.0
Whole: TypeAlias = NDArray[np.int32]


@dataclass(frozen=True)
class _Kept:
    """Places in whole units, shape (2, n), longitude first, and where lines begin.

    Those of maps of a continent are apart.
    """

    places: Whole
    starts: BoolArray
    coarse_places: Whole
    coarse_starts: BoolArray
    unit_deg: float


@cache
def _kept() -> _Kept:
    with np.load(FILE, allow_pickle=False) as kept:
        steps, begins, counts, unit_deg = (kept[name] for name in ("steps", "starts", "counts", "unit_deg"))
        coarse = np.unpackbits(kept["coarse"], count=steps.shape[1] + len(counts)).view(np.bool_)
    first = np.append(0, np.cumsum(counts + 1)[:-1])
    starts = np.zeros(len(coarse), dtype=bool)
    starts[first] = True
    moves = np.empty((2, len(coarse)), dtype=np.int32)
    moves[:, ~starts] = steps
    moves[:, first] = begins
    ends = begins + np.add.reduceat(steps, np.append(0, np.cumsum(counts)[:-1]), axis=1, dtype=np.int32)
    moves[:, first[1:]] -= ends[:, :-1]
    places = np.cumsum(moves, axis=1, dtype=np.int32)
    return _Kept(places, starts, places[:, coarse], starts[coarse], float(unit_deg))


def coastline_near(
    latitude_deg: float, longitude_deg: float, distance_m: float, step_m: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return latitudes and longitudes of the coastline around a place, NaN between its lines.

    All of it within the distance is there, and some beyond; where steps of 8 km cannot be seen, as lines within 8 km of
    it. Longitudes are within half a turn of the place's; a line is broken where it passes the meridian opposite.

    Examples
    --------
    >>> latitude, longitude = coastline_near(-34.83, 20.0, 5_000.0)  # Cape Agulhas
    >>> bool(np.nanmin(latitude) > -34.9), coastline_near(50.0, 80.0, 5_000.0)[0].size
    (True, 0)
    """
    kept = _kept()
    places, starts, longest_deg = kept.places, kept.starts, LONGEST_DEG
    if step_m >= COARSE_M:
        places, starts, longest_deg = kept.coarse_places, kept.coarse_starts, HALF_TURN_DEG
    half_deg = min(degrees(distance_m / SEMI_MAJOR_M) * 1.01 + longest_deg, HALF_TURN_DEG)
    above = places[1] - round(latitude_deg / kept.unit_deg)
    places, starts = _of_rows(places, starts, np.abs(above) <= round(half_deg / kept.unit_deg))
    east = wrap_180(kept.unit_deg * places[0] - longitude_deg)
    near = np.abs(east) <= _half_width_deg(latitude_deg, half_deg)
    places, starts = _of_rows(places, starts, near)
    east = east[near]
    starts[1:] |= np.abs(np.diff(east)) > HALF_TURN_DEG
    after = np.flatnonzero(starts[1:]) + 1
    return np.insert(kept.unit_deg * places[1], after, np.nan), np.insert(longitude_deg + east, after, np.nan)


def _of_rows(places: Whole, starts: BoolArray, keep: BoolArray) -> tuple[Whole, BoolArray]:
    """Return some of the places; a line begins behind each that is left out."""
    rows = np.flatnonzero(keep)
    begins = starts[rows]
    begins[1:] |= np.diff(rows) > 1
    return places[:, rows], begins


def _half_width_deg(latitude_deg: float, half_deg: float) -> float:
    """Return how far a circle about a place reaches in longitude; half a turn around a pole."""
    if abs(latitude_deg) + half_deg >= 90.0:
        return HALF_TURN_DEG
    return degrees(asin(min(sin(radians(half_deg)) / cos(radians(latitude_deg)), 1.0)))
