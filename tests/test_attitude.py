"""Quaternions of attitude, against the directions of nose, left wing and roof as trigonometry has them."""

import numpy as np
import pytest

from groundstation.base.attitude import quaternion_enu_from_flu_xyzw


def turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A vector turned by unit quaternions x y z w: v + 2 u x (u x v + w v)."""
    u, w = quaternion[:, :3], quaternion[:, 3:]
    return vector + 2.0 * np.cross(u, np.cross(u, vector) + w * vector)


def test_nose_wing_and_roof_point_where_the_angles_say() -> None:
    rng = np.random.default_rng(4)
    roll, pitch, heading = rng.uniform(-180, 180, 50), rng.uniform(-90, 90, 50), rng.uniform(0, 360, 50)
    quaternion = quaternion_enu_from_flu_xyzw(roll, pitch, heading)
    r, p, h = (np.deg2rad(angle) for angle in (roll, pitch, heading))
    nose = np.column_stack([np.cos(p) * np.sin(h), np.cos(p) * np.cos(h), np.sin(p)])
    level_left = np.column_stack([-np.cos(h), np.sin(h), np.zeros(50)])
    level_roof = np.cross(nose, level_left)
    left = np.cos(r)[:, None] * level_left + np.sin(r)[:, None] * level_roof  # right wing down lifts the left one
    assert turned(quaternion, np.array([1.0, 0.0, 0.0])) == pytest.approx(nose, abs=1e-12)
    assert turned(quaternion, np.array([0.0, 1.0, 0.0])) == pytest.approx(left, abs=1e-12)
    assert turned(quaternion, np.array([0.0, 0.0, 1.0])) == pytest.approx(np.cross(nose, left), abs=1e-12)


def test_what_is_not_known_stays_so() -> None:
    unknown = quaternion_enu_from_flu_xyzw(np.zeros(1), np.array([np.nan]), np.zeros(1))
    assert np.isnan(unknown).all()
