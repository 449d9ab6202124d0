"""Headings, differences of headings and directions of vectors, in degrees.

Headings live in [0, 360), clockwise from north; differences in [-180, 180). A heading is never averaged,
filtered or interpolated as a plain number: use these functions.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
STEPS_AT_ONCE = 1 << 18  # working arrays do not grow with a log


def wrap_360(angle_deg: ArrayLike) -> FloatArray:
    """Bring angles into [0, 360) degrees.

    ``numpy.mod(-1e-15, 360)`` is exactly 360.0; that value is brought back to 0.

    Examples
    --------
    >>> float(wrap_360(-1e-15)), float(wrap_360(725.0))
    (0.0, 5.0)
    """
    angle = np.asarray(angle_deg, dtype=np.float64)
    least, most = (extreme.reduce(angle, None, initial=0.0) for extreme in (np.fmin, np.fmax))
    if angle.ndim and least >= -360.0 and most < 720.0:  # equal to a division to the bit, in a tenth of its time
        wrapped = angle + 0.0  # 0.0, not -0.0
        np.add(wrapped, 360.0, out=wrapped, where=wrapped < 0.0)
        np.subtract(wrapped, 360.0, out=wrapped, where=wrapped >= 360.0)
        return wrapped
    wrapped = np.mod(angle, 360.0)
    return np.where(wrapped >= 360.0, 0.0, wrapped)[()]


def wrap_180(angle_deg: ArrayLike) -> FloatArray:
    """Bring differences of angles into [-180, 180) degrees.

    Examples
    --------
    >>> float(wrap_180(180.0)), float(wrap_180(359.0)), float(wrap_180(1.0 - 359.0))
    (-180.0, -1.0, 2.0)
    """
    return (wrap_360(np.asarray(angle_deg, dtype=np.float64) + 180.0) - 180.0)[()]


def unwrap(heading_deg: ArrayLike) -> FloatArray:
    """Turn headings, shape (n,), into a continuous angle in degrees without jumps at north.

    NaN stays NaN.

    Examples
    --------
    >>> [float(angle) for angle in unwrap([359.0, 1.0, 3.0])]
    [359.0, 361.0, 363.0]
    """
    heading = np.asarray(heading_deg, dtype=np.float64)
    out = heading.copy()
    known = np.isfinite(heading)
    if not known.all():
        out[known] = unwrap(heading[known]) if known.any() else np.nan
        return out
    turned = 0.0  # since the first
    for start in range(1, len(heading), STEPS_AT_ONCE):
        part = slice(start, start + STEPS_AT_ONCE)
        steps = np.asarray(wrap_180(np.diff(heading[start - 1 : start + STEPS_AT_ONCE])))
        steps[0] += turned
        np.cumsum(steps, out=steps)
        turned = steps[-1]
        out[part] = heading[0] + steps
    return out


def interpolate_heading(at: ArrayLike, time: ArrayLike, heading_deg: ArrayLike) -> FloatArray:
    """Interpolate headings linearly along the shorter arc.

    Parameters
    ----------
    at, time : array_like, shapes (m,) and (n,)
        Times asked for and times of the samples, in one unit, ``time`` increasing. Outside the samples the
        answer is NaN: nothing is extrapolated.
    heading_deg : array_like, shape (n,)

    Returns
    -------
    ndarray, shape (m,), in [0, 360)

    Examples
    --------
    >>> float(interpolate_heading([0.5], [0.0, 1.0], [359.0, 2.0])[0])
    0.5
    """
    continuous = unwrap(heading_deg)
    at_array, time_array = np.asarray(at, dtype=np.float64), np.asarray(time, dtype=np.float64)
    return wrap_360(np.interp(at_array, time_array, continuous, left=np.nan, right=np.nan))


def mean_heading(heading_deg: ArrayLike, weight: ArrayLike | None = None) -> float:
    """Average headings on the circle, in [0, 360).

    NaN samples are left out; the answer is NaN where no sample is left.

    Examples
    --------
    >>> round(mean_heading([350.0, 20.0]), 9)
    5.0
    """
    heading = np.asarray(heading_deg, dtype=np.float64)
    weights = np.ones_like(heading) if weight is None else np.asarray(weight, dtype=np.float64)
    known = np.isfinite(heading) & np.isfinite(weights)
    if not known.any():
        return float("nan")
    radians = np.deg2rad(heading[known])
    north, east = np.sum(weights[known] * np.cos(radians)), np.sum(weights[known] * np.sin(radians))
    return float(wrap_360(np.rad2deg(np.arctan2(east, north))))


def direction_of(north: ArrayLike, east: ArrayLike) -> FloatArray:
    """Return the direction of horizontal vectors, degrees clockwise from north, in [0, 360).

    For a velocity this is the track angle.

    Examples
    --------
    >>> float(direction_of(0.0, -3.0))
    270.0
    """
    east_array, north_array = np.asarray(east, dtype=np.float64), np.asarray(north, dtype=np.float64)
    return wrap_360(np.rad2deg(np.arctan2(east_array, north_array)))
