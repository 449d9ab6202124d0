"""What works through the rows of a long log in parts: the same bits as at once."""

from dataclasses import fields

import numpy as np
import pytest

from groundstation.base import angles
from groundstation.base.records import Column
from groundstation.methods import overview
from groundstation.tables import motion
from groundstation.tables.table import Flight, Table

ROWS = 1500


def flight(seed: int) -> Flight:
    rng = np.random.default_rng(seed)
    time_ns = np.sort(rng.integers(0, 120_000_000_000, ROWS))
    time_ns[200:700] = time_ns[200]  # many rows at one grid time
    time_ns.sort()
    walk = {name: np.cumsum(rng.normal(size=ROWS)) for name in ("north", "east", "down", "turn")}
    values = {
        "latitude_deg": 47.0 + 1e-5 * walk["north"],
        "longitude_deg": 8.0 + 1e-5 * walk["east"],
        "altitude_msl_m": 500.0 - walk["down"],
        "velocity_north_mps": 5.0 + walk["north"],
        "velocity_east_mps": walk["east"],
        "velocity_down_mps": 0.1 * walk["down"],
        "roll_deg": walk["turn"],
        "pitch_deg": 0.1 * walk["turn"],
        "true_heading_deg": np.mod(20.0 * walk["turn"], 360.0),
    }
    columns = {name: Column(one, rng.random(ROWS) < 0.9) for name, one in values.items()}
    table = Table("ins", time_ns, columns, np.arange(ROWS), Column(time_ns))
    return Flight({"ins": table}, {}, int(time_ns[0]), True)


@pytest.mark.parametrize("seed", [1, 2])
def test_motion_and_track_in_parts(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    given, found = flight(seed), []
    for at_once in (1 << 18, 97, 1):
        monkeypatch.setattr(motion, "ROWS_AT_ONCE", at_once)
        monkeypatch.setattr(overview, "ROWS_AT_ONCE", at_once)
        monkeypatch.setattr(angles, "STEPS_AT_ONCE", at_once)
        whole = motion.motion_of(given)
        arrays = {field.name: getattr(whole, field.name) for field in fields(whole)}
        shown = overview.overview(given, None, None)
        assert shown is not None and np.isfinite(shown.track_deg).any()
        found.append({**arrays, "track": shown.track_deg})
    for name, first in found[0].items():
        assert np.isfinite(first).any() or name == "pressure_altitude_m"
        assert all(np.array_equal(first, other[name], equal_nan=True) for other in found[1:]), name


def test_unwrapped_headings_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    heading = np.mod(np.cumsum(np.random.default_rng(3).normal(0.0, 40.0, 500)), 360.0)
    heading[::7] = np.nan
    whole, known = angles.unwrap(heading), np.isfinite(heading)
    assert np.array_equal(np.isfinite(whole), known)
    assert np.allclose(whole[known], np.unwrap(heading[known], period=360.0), rtol=0.0, atol=1e-9)
    for at_once in (1, 13):
        monkeypatch.setattr(angles, "STEPS_AT_ONCE", at_once)
        assert np.array_equal(angles.unwrap(heading), whole, equal_nan=True)
