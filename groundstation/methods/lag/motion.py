"""Motion of an aircraft, in the form in which records of it are compared."""

import numpy as np

from groundstation.base.angles import FloatArray

SLOW_MPS = 3.0  # the track of a slower aircraft does not show where the nose points


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
