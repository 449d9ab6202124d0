"""Positions: a pair of angles that is one, and a pair of zeros that is none."""

import numpy as np
import pytest

from groundstation.base.geodesy import NO_POSITION_DEG, has_position


@pytest.mark.parametrize(
    ("latitude_deg", "longitude_deg", "expected"),
    [
        (0.0, 0.0, False),
        (-0.0, 9e-8, False),
        (-9e-8, 9e-8, False),
        (NO_POSITION_DEG, 0.0, True),  # one step of an integer in 1e-7 deg
        (0.0, -NO_POSITION_DEG, True),
        (0.0, 38.0, True),  # on the equator
        (51.5, 0.0, True),  # on the meridian of Greenwich
        (-33.9, -179.9, True),
        (np.nan, 38.0, False),
        (0.0, np.nan, False),
        (np.inf, 38.0, False),
    ],
)
def test_two_zeros_are_no_position(latitude_deg: float, longitude_deg: float, expected: bool) -> None:
    assert bool(has_position(latitude_deg, longitude_deg)) is expected
    found = has_position(np.array([56.0, latitude_deg]), np.array([38.0, longitude_deg]))
    assert found.dtype == np.bool_ and found.tolist() == [True, expected]


def test_single_precision_is_taken() -> None:
    assert has_position(np.zeros(2, dtype=np.float32), np.array([0.0, 8.5], dtype=np.float32)).tolist() == [False, True]
