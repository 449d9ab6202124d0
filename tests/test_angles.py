"""Angles within two turns are wrapped without a division, and to the bit as with one."""

import numpy as np
import pytest

from groundstation.base import angles

EDGES_DEG = (-360.0, -359.99999999999994, -1e-15, -5e-324, -0.0, 0.0, 359.99999999999994, 360.0, 719.9999999999999)


def divided(angle_deg: angles.FloatArray) -> angles.FloatArray:
    """Bring angles into [0, 360) by a division, as the definition has it."""
    remainder = np.mod(angle_deg, 360.0)
    return np.where(remainder >= 360.0, 0.0, remainder)


def test_wrapped_as_by_a_division() -> None:
    """Compare at the edges, in between and where there is no angle."""
    random = np.random.default_rng(4).uniform(-360.0, 719.9, 10_000)
    given = np.concatenate([EDGES_DEG, random, [np.nan]])
    assert angles.wrap_360(given).tobytes() == divided(given).tobytes()


def test_no_division_within_two_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refuse the division that takes twenty times as long; farther away it is needed."""
    monkeypatch.setattr(angles.np, "mod", None)
    assert angles.wrap_360([-90.0, 45.0, 365.0]).tolist() == [270.0, 45.0, 5.0]
    with pytest.raises(TypeError):
        angles.wrap_360([725.0])
