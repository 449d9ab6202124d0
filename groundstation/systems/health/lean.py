"""Lean of an aircraft: direction of down in its body, which has no heading in it."""

import numpy as np

from groundstation.systems.health.logged import FloatArray


def down_of(roll_deg: FloatArray, pitch_deg: FloatArray) -> FloatArray:
    """Return the direction of down in the body (forward, right, down), shape (n, 3).

    Roll and pitch have shape (n,).

    Examples
    --------
    >>> down_of(np.array([180.0]), np.array([0.0])).round(3) + 0.0
    array([[ 0.,  0., -1.]])
    """
    roll, pitch = np.deg2rad(roll_deg), np.deg2rad(pitch_deg)
    return np.column_stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])


def between(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the angle between two directions of unit length, degrees, shape (n,).

    It is NaN where one is missing.

    Examples
    --------
    >>> between(down_of(np.array([10.0]), np.array([0.0])), down_of(np.array([-20.0]), np.array([0.0]))).round(6)
    array([30.])
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.rad2deg(np.arccos(np.clip(np.sum(one * other, axis=1), -1.0, 1.0))))
