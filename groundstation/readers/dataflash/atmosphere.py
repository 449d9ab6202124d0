"""Pressure altitude of the standard atmosphere."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray

_SEA_LEVEL_PA, _SEA_LEVEL_K = 101_325.0, 288.15
_LAPSE_K_PER_M, _GAS_CONSTANT, _GRAVITY = 0.0065, 287.05287, 9.80665
_TROPOPAUSE_M = 11_000.0
_HIGHEST_PA, _LOWEST_PA = 120_000.0, 500.0  # beyond these a number is no pressure of the atmosphere


def pressure_altitude_m(pressure_pa: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Pressure altitude, metres, and where the pressure is one at all; up to 20 km.

    Source: ICAO Doc 7488/3, Manual of the ICAO Standard Atmosphere (1993): constant lapse rate up to 11 km, then
    constant temperature.

    Examples
    --------
    >>> altitude, is_pressure = pressure_altitude_m(np.array([101325.0, 89874.6, 22632.06, 5474.9, 0.0]))
    >>> altitude.round(0).tolist(), is_pressure.tolist()
    ([0.0, 1000.0, 11000.0, 20000.0, nan], [True, True, True, True, False])
    """
    is_pressure = (pressure_pa >= _LOWEST_PA) & (pressure_pa <= _HIGHEST_PA)
    ratio = np.where(is_pressure, pressure_pa, np.nan) / _SEA_LEVEL_PA
    exponent = _GRAVITY / (_GAS_CONSTANT * _LAPSE_K_PER_M)
    below = _SEA_LEVEL_K / _LAPSE_K_PER_M * (1.0 - ratio ** (1.0 / exponent))
    tropopause_k = _SEA_LEVEL_K - _LAPSE_K_PER_M * _TROPOPAUSE_M
    tropopause_ratio = (tropopause_k / _SEA_LEVEL_K) ** exponent
    above = _TROPOPAUSE_M - _GAS_CONSTANT * tropopause_k / _GRAVITY * np.log(ratio / tropopause_ratio)
    return np.where(ratio >= tropopause_ratio, below, above), is_pressure
