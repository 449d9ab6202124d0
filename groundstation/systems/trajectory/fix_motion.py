"""Motion that fixes show: their velocity, or the change of their place."""

import numpy as np

from groundstation.base.geodesy import curvature_radii_m
from groundstation.systems.trajectory.inputs import GnssFixes
from groundstation.systems.trajectory.states import FloatArray

SPAN_S = 4.0  # of the places whose change is taken for a velocity
LONGEST_S = 10.0


def motion_of(gnss: GnssFixes) -> FloatArray:
    """Return the velocity of the antenna at each fix, north, east, down, shape (m, 3).

    NaN where nothing shows it.

    Where a receiver logs no velocity it is the slope of the places over four seconds; a missing vertical velocity is 0.
    """
    velocity = np.array(gnss.velocity_mps)
    lacking = ~np.isfinite(velocity[:, :2]).all(axis=1)
    if lacking.any():
        velocity[lacking] = _by_places(gnss)[lacking]
    known = np.isfinite(velocity[:, :2]).all(axis=1)
    velocity[:, 2] = np.where(known & ~np.isfinite(velocity[:, 2]), 0.0, velocity[:, 2])
    return velocity


def _by_places(gnss: GnssFixes) -> FloatArray:
    found = np.full((len(gnss), 3), np.nan)
    have = np.flatnonzero(np.isfinite(gnss.latitude_deg) & np.isfinite(gnss.longitude_deg))
    if len(have) < 2:
        return found
    time_s = gnss.time_s[have]
    last = np.clip(np.searchsorted(time_s, time_s + 0.5 * SPAN_S, side="right") - 1, 0, len(have) - 1)
    first = np.clip(np.searchsorted(time_s, time_s - 0.5 * SPAN_S), 0, len(have) - 1)
    last, first = np.maximum(last, np.minimum(first + 1, len(have) - 1)), np.minimum(first, len(have) - 2)
    span_s = time_s[last] - time_s[first]
    north, east = curvature_radii_m(gnss.latitude_deg[have])
    place = np.column_stack(
        [
            np.radians(gnss.latitude_deg[have]) * north,
            np.radians(gnss.longitude_deg[have]) * east * np.cos(np.radians(gnss.latitude_deg[have])),
            -np.nan_to_num(gnss.height_m[have]),
        ]
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = (place[last] - place[first]) / span_s[:, None]
    found[have] = np.where(((span_s > 0.0) & (span_s <= LONGEST_S))[:, None], slope, np.nan)
    return found
