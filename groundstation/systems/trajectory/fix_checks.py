"""Check of GNSS velocities against positions: swapped or reversed components."""

from itertools import permutations, product

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import north_east_m
from groundstation.systems.trajectory.inputs import GnssFixes

STEP_S, LONGEST_STEP_S = 1.0, 4.0
MOVES_MPS = 2.0
FEWEST = 20
BETTER = 4.0  # times, in the median of squared misfits
VERTICAL_MPS = 0.3  # standard deviation that shows a sign
OPPOSITE = -0.5  # correlation


def wrong_velocity(gnss: GnssFixes) -> str:
    """Return how velocities differ from the way of the positions; empty where they agree.

    Each of the eight ways to swap and to reverse north and east is held against the displacements over a second.
    """
    moved, mean = _steps(gnss)
    fast = np.hypot(moved[:, 0], moved[:, 1]) >= MOVES_MPS
    if fast.sum() >= FEWEST:
        told = _horizontal(moved[fast, :2], mean[fast, :2])
        if told:
            return f"GNSS velocities do not go along its positions: {told}"
    rise, climb = moved[:, 2], mean[:, 2]
    known = np.isfinite(rise) & np.isfinite(climb)
    shows = known.sum() >= FEWEST and min(rise[known].std(), climb[known].std()) >= VERTICAL_MPS
    if shows and np.corrcoef(rise[known], climb[known])[0, 1] < OPPOSITE:
        return "GNSS velocities do not go along its heights: velocity down is reversed"
    return ""


def _horizontal(moved: FloatArray, mean: FloatArray) -> str:
    ways = [
        (swap, signs, np.median(((mean[:, list(swap)] * np.array(signs) - moved) ** 2).sum(axis=1)))
        for swap in permutations(range(2))
        for signs in product((1.0, -1.0), repeat=2)
    ]
    swap, signs, least = min(ways, key=lambda one: one[2])
    if ways[0][2] <= BETTER * least:
        return ""
    told = ["north and east are swapped"] if swap == (1, 0) else []
    reversed_ones = [name for name, sign in zip(("north", "east"), signs, strict=True) if sign < 0.0]
    return " and ".join([*told, *(f"{name} is reversed" for name in reversed_ones)])


def _steps(gnss: GnssFixes) -> tuple[FloatArray, FloatArray]:
    """Return mean velocities by positions and by velocities over steps of a second.

    North, east, up, shape (n, 3).
    """
    known = (
        np.isfinite(gnss.velocity_mps[:, :2]).all(axis=1)
        & np.isfinite(gnss.latitude_deg)
        & np.isfinite(gnss.longitude_deg)
    )
    time_s, velocity = gnss.time_s[known], gnss.velocity_mps[known]
    if len(time_s) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3))
    latitude, longitude = gnss.latitude_deg[known], gnss.longitude_deg[known]
    north, east = north_east_m(latitude, longitude, float(latitude[0]), float(longitude[0]))
    place = np.column_stack([north, east, gnss.height_m[known]])
    gathered = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s)[:, None], axis=0)]
    )
    chosen = np.flatnonzero(np.concatenate([[True], np.diff(np.floor((time_s - time_s[0]) / STEP_S + 0.25)) > 0]))
    length = np.diff(time_s[chosen])[:, None]
    moved, mean = np.diff(place[chosen], axis=0) / length, np.diff(gathered[chosen], axis=0) / length
    fits = (length[:, 0] <= LONGEST_STEP_S) & (length[:, 0] > 0.0)
    return moved[fits], mean[fits] * np.array([1.0, 1.0, -1.0])
