"""Turns of axes: 24 ways in which a case can stand square to a body, and 24 mirrored."""

from itertools import permutations, product

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.attitude import rotation_n_from_b

FORWARD, RIGHT, DOWN = np.eye(3)
_NAMES = ("forward", "right", "down")
_OPPOSITE = ("back", "left", "up")


def signed_permutations() -> FloatArray:
    """Return the 48 matrices that swap axes and turn them round, the identity first.

    Those with determinant 1 are turns, the others mirror.

    Examples
    --------
    >>> found = signed_permutations()
    >>> len(found), int((np.linalg.det(found) > 0).sum())
    (48, 24)
    """
    rows = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return np.array(rows)


def axis_turns() -> FloatArray:
    """Return the 24 right-handed turns, shape (24, 3, 3), the identity first."""
    every = signed_permutations()
    turns: FloatArray = every[np.linalg.det(every) > 0.0]
    return turns


def from_angles(roll_pitch_yaw_deg: tuple[float, float, float] | FloatArray) -> FloatArray:
    """Return body_from_case of a case that stands at roll, pitch and yaw to the body.

    Examples
    --------
    >>> (from_angles((0.0, 0.0, 90.0)) @ FORWARD).round(9).tolist()  # the case's x axis points right
    [0.0, 1.0, 0.0]
    """
    turn: FloatArray = rotation_n_from_b(np.asarray(roll_pitch_yaw_deg, dtype=np.float64)[None, :])[0]
    return turn


def angles_of(rotation: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw of rotations, shape (..., 3, 3), in degrees.

    It is the inverse of :func:`from_angles`.

    Examples
    --------
    >>> angles_of(from_angles((10.0, -20.0, 30.0))).round(9).tolist()
    [10.0, -20.0, 30.0]
    """
    roll = np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2])
    pitch = -np.arcsin(np.clip(rotation[..., 2, 0], -1.0, 1.0))
    yaw = np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])
    angles: FloatArray = np.rad2deg(np.stack([roll, pitch, yaw], axis=-1))
    return angles


def with_travel_forward(body_from_case: FloatArray, yaw_deg: float, pitch_deg: float) -> FloatArray:
    """Return the turn after which a direction of travel lies forward, shape (3, 3).

    Parameters
    ----------
    body_from_case : ndarray, shape (3, 3)
    yaw_deg, pitch_deg : float
        Of the travel in the axes that ``body_from_case`` gives: to the right, and up. The roll about it stays.

    Examples
    --------
    >>> case_aft_up = from_angles((180.0, 0.0, 180.0))
    >>> angles_of(with_travel_forward(case_aft_up, 5.0, 7.0)).round(2).tolist()
    [179.39, 6.97, 174.96]
    """
    turned: FloatArray = from_angles((0.0, pitch_deg, yaw_deg)).T @ body_from_case
    return turned


def angle_between_deg(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the angles between rotations, shape (...), in degrees.

    Examples
    --------
    >>> round(float(angle_between_deg(np.eye(3), from_angles((0.0, 0.0, 90.0)))), 6)
    90.0
    """
    trace = np.einsum("...ij,...ij->...", one, other)
    angles: FloatArray = np.rad2deg(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))
    return angles


def axes_told(body_from_case: FloatArray) -> str:
    """Return where the axes of the case point, for people.

    Examples
    --------
    >>> axes_told(from_angles((180.0, 0.0, 90.0)))
    'x right, y forward, z up'
    """
    told = []
    for axis, column in zip("xyz", body_from_case.T, strict=True):
        most = int(np.argmax(np.abs(column)))
        told.append(f"{axis} {(_NAMES if column[most] > 0.0 else _OPPOSITE)[most]}")
    return ", ".join(told)
