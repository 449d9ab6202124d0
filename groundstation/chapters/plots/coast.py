"""Coastline beneath a map in metres north and east of the start."""

from math import hypot

import numpy as np

from groundstation.base.coastline import COARSE_M, ERROR_M, NAME, coastline_near
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import plan_north_east_m
from groundstation.chapters.wording import number
from groundstation.plots.marks import Floats, Outlines
from groundstation.results.arrays.typed import Flags

LEAST_ERRORS = 10.0  # a map of fewer errors of the coastline has none: a wrong line is worse than none
SEEN, DRAWN = 1.0, 1.3  # half widths of a frame: where its coast is surely seen, as far as it may reach
STEPS = 800.0  # along the longer side of a map: what is finer is not seen
MOST_PLACES, MOST_OF_A_RING, MOST_RINGS = 3000, 400, 100
COARSER = 1.5
MARGIN_OF_PLAN = 1.5  # distances on the Earth over those on the plan, a continent away


@dataclass(frozen=True)
class Coast:
    """Lines of the coast, shape (n, 2), metres east and north of the start, and their error."""

    rings: tuple[Floats, ...]
    error_m: float

    def outlines(self, unit_m: float) -> Outlines:
        """Return them as a mark on a map, so many metres a unit."""
        return Outlines(rings=tuple(ring / unit_m for ring in self.rings), role="faint", emphasis="faint")

    @property
    def caption(self) -> str:
        """Sentence on where it comes from and how good it is."""
        return f"Coastline: {NAME}, ±{number(self.error_m / 1000.0, 0)} km."


def coast(
    middle_m: tuple[float, float], half_m: tuple[float, float], origin_deg: tuple[float, float], *, is_polar: bool
) -> Coast | None:
    """Return the coast around the frame of a map.

    None where the map is too small for it, or no coast lies in the frame.

    Parameters
    ----------
    middle_m, half_m : pair of float
        Middle and half the size of the frame, metres east and north of the origin.
    origin_deg : pair of float
        Latitude and longitude of the start, degrees.
    is_polar : bool
        The map is drawn as seen from above its start (:func:`~groundstation.base.geodesy.plan_north_east_m`).
    """
    if not 2.0 * max(half_m) >= LEAST_ERRORS * ERROR_M:
        return None
    farthest = hypot(*(abs(at) + DRAWN * half for at, half in zip(middle_m, half_m, strict=True)))
    step = 2.0 * DRAWN * max(half_m) / STEPS
    coarse = COARSE_M if step >= COARSE_M else 0.0
    latitude, longitude = coastline_near(*origin_deg, MARGIN_OF_PLAN * farthest, step)
    north, east = plan_north_east_m(latitude, longitude, *origin_deg, is_polar=is_polar)
    if not _meets(east, north, middle_m, half_m, SEEN).any():
        return None
    drawn = _meets(east, north, middle_m, half_m, DRAWN)
    rows = np.flatnonzero(np.append(drawn, False) | np.append(False, drawn))
    starts = np.append(True, ~drawn[rows[:-1]] | (np.diff(rows) > 1))
    rings = _rings(np.column_stack([east[rows], north[rows]]), starts, step)
    while sum(map(len, rings)) > MOST_PLACES:
        step *= COARSER
        rings = _rings(np.column_stack([east[rows], north[rows]]), starts, step)
    return Coast(rings, hypot(ERROR_M, coarse, step))


def _meets(
    east: Floats, north: Floats, middle_m: tuple[float, float], half_m: tuple[float, float], share: float
) -> Flags:
    """Tell which of the lines between places have a part in the frame, none at a gap."""
    meets = np.ones(max(len(east) - 1, 0), dtype=bool)
    with np.errstate(invalid="ignore"):
        for along, middle, half in zip((east, north), middle_m, half_m, strict=True):
            lower, upper = np.minimum(along[1:], along[:-1]), np.maximum(along[1:], along[:-1])
            meets &= (upper >= middle - share * half) & (lower <= middle + share * half)
    return meets


def _rings(places: Floats, starts: Flags, step: float) -> tuple[Floats, ...]:
    """Return lines with about one place a step, the largest of them.

    None has more places than a painter draws.
    """
    keep = np.append(True, np.any(np.diff(np.rint(places / step), axis=0) != 0.0, axis=1)) | starts
    places, begins = places[keep], np.flatnonzero(starts[keep])
    sizes = np.maximum.reduceat(places, begins) - np.minimum.reduceat(places, begins)
    largest = np.sort(np.argsort(-sizes.max(axis=1), kind="stable")[:MOST_RINGS])
    ends = np.append(begins[1:], len(places))
    found = []
    for first, last in zip(begins[largest].tolist(), ends[largest].tolist(), strict=True):
        for cut in range(first, last - 1, MOST_OF_A_RING - 1):
            found.append(places[cut : min(cut + MOST_OF_A_RING, last)])
    return tuple(found)
