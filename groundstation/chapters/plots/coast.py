"""Coastline beneath a map in metres north and east of the start."""

from itertools import pairwise
from math import hypot

import numpy as np

from groundstation.base.coastline import ERROR_M, NAME, coastline_near
from groundstation.base.geodesy import plan_north_east_m
from groundstation.chapters.wording import number
from groundstation.plots.marks import Floats, Outlines
from groundstation.results.arrays.typed import Flags

LEAST_ERRORS = 10.0  # a map of fewer errors of the coastline has none: a wrong line is worse than none
CAPTION = f" Coastline: {NAME}, ±{number(ERROR_M / 1000.0, 0)} km."
SEEN, DRAWN = 1.0, 1.3  # half widths of a frame: where its coast is surely seen, as far as it may reach
STEPS = 1200.0  # along the longer side of a map: what is finer is not seen
MOST_PLACES, MOST_OF_A_RING, MOST_RINGS = 4000, 400, 300
COARSER = 1.5
MARGIN_OF_PLAN = 1.5  # distances on the Earth over those on the plan, a continent away


def coast(
    middle_m: tuple[float, float], half_m: tuple[float, float], origin_deg: tuple[float, float], *, is_polar: bool
) -> tuple[Floats, ...]:
    """Return lines of the coast around a frame, shape (n, 2), metres east and north.

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
        return ()
    farthest = hypot(*(abs(at) + DRAWN * half for at, half in zip(middle_m, half_m, strict=True)))
    latitude, longitude = coastline_near(*origin_deg, MARGIN_OF_PLAN * farthest)
    north, east = plan_north_east_m(latitude, longitude, *origin_deg, is_polar=is_polar)
    if not _meets(east, north, middle_m, half_m, SEEN).any():
        return ()
    drawn = _meets(east, north, middle_m, half_m, DRAWN)
    rows = np.flatnonzero(np.append(drawn, False) | np.append(False, drawn))
    breaks = ~drawn[np.minimum(rows[:-1], len(drawn) - 1)] | (np.diff(rows) > 1)
    starts = np.append(True, breaks)
    step = 2.0 * DRAWN * max(half_m) / STEPS
    while True:
        rings = _largest(_rings(np.column_stack([east[rows], north[rows]]), starts, step))
        if sum(map(len, rings)) <= MOST_PLACES:
            return rings
        step *= COARSER


def _meets(
    east: Floats, north: Floats, middle_m: tuple[float, float], half_m: tuple[float, float], share: float
) -> Flags:
    """Tell which lines between places have a part in the frame."""
    meets = np.ones(max(len(east) - 1, 0), dtype=bool)
    with np.errstate(invalid="ignore"):
        for along, middle, half in zip((east, north), middle_m, half_m, strict=True):
            lower, upper = np.minimum(along[1:], along[:-1]), np.maximum(along[1:], along[:-1])
            meets &= (upper >= middle - share * half) & (lower <= middle + share * half)
    return meets


def _rings(places: Floats, starts: Flags, step: float) -> list[Floats]:
    """Return lines with one place where several are nearer than a step."""
    keep = np.append(True, np.any(np.diff(np.rint(places / step), axis=0) != 0.0, axis=1)) | starts
    places, begins = places[keep], np.flatnonzero(starts[keep])
    found = []
    for first, last in pairwise([*begins.tolist(), len(places)]):
        for cut in range(first, last - 1, MOST_OF_A_RING - 1):
            found.append(places[cut : min(cut + MOST_OF_A_RING, last)])
    return found


def _largest(rings: list[Floats]) -> tuple[Floats, ...]:
    """Return the largest lines, as many as a painter draws, in their order."""
    if len(rings) <= MOST_RINGS:
        return tuple(rings)
    sizes = np.array([np.ptp(ring, axis=0).max() for ring in rings])
    return tuple(rings[place] for place in np.sort(np.argsort(-sizes, kind="stable")[:MOST_RINGS]).tolist())


def outlines(rings: tuple[Floats, ...], scale: float) -> Outlines:
    """Return the coast as a mark, so many units a metre."""
    return Outlines(rings=tuple(scale * ring for ring in rings), role="faint", emphasis="thin")
