"""Attitude as a rotation from body axes to north-east-down, and as a quaternion.

The quaternion is for programs that draw. Its axes are east-north-up and forward-left-up; the scalar is last.
"""

import numpy as np

from groundstation.base.angles import FloatArray


def quaternion_enu_from_flu_xyzw(roll_deg: FloatArray, pitch_deg: FloatArray, heading_deg: FloatArray) -> FloatArray:
    """Turn from body axes forward-left-up to east-north-up.

    Yaw about up is 90 degrees minus the heading; pitching up turns the other way about left; roll about forward is the
    same on both sides.

    Parameters
    ----------
    roll_deg, pitch_deg, heading_deg : ndarray, shape (n,)
        Right wing down and nose up positive; clockwise from north.

    Returns
    -------
    ndarray, shape (n, 4)
        Unit quaternions x, y, z, w; NaN where an angle is.

    Examples
    --------
    >>> level_to_east = quaternion_enu_from_flu_xyzw(*np.array([[0.0], [0.0], [90.0]]))
    >>> (level_to_east + 0.0).tolist()
    [[0.0, 0.0, 0.0, 1.0]]
    """
    roll, pitch, yaw = (np.deg2rad(0.5 * angle) for angle in (roll_deg, -pitch_deg, 90.0 - heading_deg))
    sin_r, sin_p, sin_y = np.sin(roll), np.sin(pitch), np.sin(yaw)
    cos_r, cos_p, cos_y = np.cos(roll), np.cos(pitch), np.cos(yaw)
    return np.column_stack(
        [
            sin_r * cos_p * cos_y - cos_r * sin_p * sin_y,
            cos_r * sin_p * cos_y + sin_r * cos_p * sin_y,
            cos_r * cos_p * sin_y - sin_r * sin_p * cos_y,
            cos_r * cos_p * cos_y + sin_r * sin_p * sin_y,
        ]
    )


def rotation_n_from_b(attitude_deg: FloatArray) -> FloatArray:
    """Return rotations, shape (m, 3, 3), by roll, pitch and heading, shape (m, 3).

    Angles that are not known are zero.
    """
    roll, pitch, yaw = np.deg2rad(np.nan_to_num(attitude_deg)).T
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(part), np.cos(part)) for part in (roll, pitch, yaw))
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    ).transpose(2, 0, 1)
