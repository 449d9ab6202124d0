"""The standard atmosphere against its published tables, against the air at rest, and at its edges."""

import numpy as np
import pytest

from groundstation.base.atmosphere import HIGHEST_PA, LOWEST_PA, pressure_altitude_m

# U.S. Standard Atmosphere, 1976, table I: geopotential altitude (m), pressure (Pa)
TABLE = [
    (-500.0, 107_478.0),
    (0.0, 101_325.0),
    (1_000.0, 89_874.6),
    (5_000.0, 54_019.9),
    (10_000.0, 26_436.3),
    (11_000.0, 22_632.06),
    (15_000.0, 12_044.6),
    (20_000.0, 5_474.889),
    (25_000.0, 2_511.02),
    (30_000.0, 1_171.87),
    (32_000.0, 868.0187),
]


@pytest.mark.parametrize(("altitude_m", "pressure_pa"), TABLE)
def test_the_published_table(altitude_m: float, pressure_pa: float) -> None:
    found, is_refused = pressure_altitude_m(np.array([pressure_pa]))
    assert found[0] == pytest.approx(altitude_m, abs=0.5), "the table's last digit"
    assert not is_refused[0]


def test_the_air_rests_in_every_layer() -> None:
    """dp/dH = -p g / (R T): a second way to the same answer, by differences."""
    pressure = np.geomspace(LOWEST_PA, HIGHEST_PA, 200_001)
    altitude, is_refused = pressure_altitude_m(pressure)
    assert not is_refused.any()
    temperature = np.interp(altitude, [-2e3, 11e3, 20e3, 32e3, 47e3], [301.15, 216.65, 216.65, 228.65, 270.65])
    slope = np.diff(altitude) / np.diff(np.log(pressure))
    expected = -287.05287 * (temperature[1:] + temperature[:-1]) / 2.0 / 9.80665
    assert np.abs(slope / expected - 1.0).max() < 1e-6, "steps of 0.0027 % in pressure, kinks of T between two of them"


def test_what_is_no_pressure_is_refused_and_a_missing_reading_is_not() -> None:
    pressure = np.array([-1.0, 0.0, 499.9, 500.0, 120_000.0, 120_000.1, np.inf, -np.inf, np.nan])
    altitude, is_refused = pressure_altitude_m(pressure)
    assert is_refused.tolist() == [True, True, True, False, False, True, True, True, False]
    assert np.isfinite(altitude).tolist() == [False, False, False, True, True, False, False, False, False]
