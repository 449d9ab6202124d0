"""Turns between the axes of a unit and those of its vehicle."""

import numpy as np
import pytest

from groundstation.systems.trajectory.axis_turns import angles_of, from_angles, with_travel_forward


@pytest.mark.parametrize(("yaw_deg", "pitch_deg"), [(5.0, 7.0), (-5.3, 7.3), (40.0, -30.0), (-170.0, 1.0)])
def test_a_mounting_that_is_stated_as_told_puts_the_travel_forward(yaw_deg: float, pitch_deg: float) -> None:
    """Angles told are those of the aircraft file: in these axes the travel is forward, without signs too."""
    yaw, pitch = np.radians([yaw_deg, pitch_deg])
    travel = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)])
    body_from_case = from_angles((180.0, 3.0, 180.0))
    turned = with_travel_forward(body_from_case, yaw_deg, pitch_deg)
    stated = from_angles(tuple(angles_of(turned) % 360.0))
    assert stated @ body_from_case.T @ travel == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
