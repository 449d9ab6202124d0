"""Magnetic field along body axes: levelled to a heading, and turned from the earth's."""

import numpy as np

from groundstation.base.angles import FloatArray, direction_of


def levelled_heading_deg(field_nt: FloatArray, roll_deg: FloatArray, pitch_deg: FloatArray) -> FloatArray:
    """Return the magnetic heading in [0, 360), shape (n,), of a levelled magnetometer.

    A magnetometer of three axes is levelled by the attitude. The field, shape (n, 3), forward-right-down, is turned
    back by roll and pitch; north lies where its horizontal part points.

    Examples
    --------
    A nose to magnetic east has north on its left:

    >>> float(levelled_heading_deg(np.array([[0.0, -17000.0, 50000.0]]), np.zeros(1), np.zeros(1))[0])
    90.0
    """
    (sin_r, cos_r), (sin_p, cos_p) = _sin_cos(roll_deg), _sin_cos(pitch_deg)
    forward, right, down = np.moveaxis(np.asarray(field_nt, dtype=np.float64), -1, 0)
    north = cos_p * forward + sin_p * (sin_r * right + cos_r * down)
    east = cos_r * right - sin_r * down
    return direction_of(north, -east)


def field_in_body(
    horizontal_nt: float, down_nt: float, heading_deg: FloatArray, roll_deg: FloatArray, pitch_deg: FloatArray
) -> FloatArray:
    """Return the earth's field along body axes, shape (n, 3), at a magnetic heading.

    The axes are forward, right, down.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, equation 3.47, transposed.

    Examples
    --------
    >>> field_in_body(17.0, 50.0, np.array([90.0]), np.zeros(1), np.zeros(1)).round(9).tolist()
    [[0.0, -17.0, 50.0]]
    """
    (sin_r, cos_r), (sin_p, cos_p), (sin_h, cos_h) = (_sin_cos(angle) for angle in (roll_deg, pitch_deg, heading_deg))
    ahead, aside = horizontal_nt * cos_h, -horizontal_nt * sin_h
    lowered = sin_p * ahead + cos_p * down_nt
    return np.stack(
        [cos_p * ahead - sin_p * down_nt, cos_r * aside + sin_r * lowered, cos_r * lowered - sin_r * aside], axis=-1
    )


def _sin_cos(angle_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    angle_rad = np.deg2rad(angle_deg)
    return np.sin(angle_rad), np.cos(angle_rad)
