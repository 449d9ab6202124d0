"""The standard atmosphere: altitude of a static pressure."""

from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray

SEA_LEVEL_PA, SEA_LEVEL_K = 101_325.0, 288.15
HIGHEST_PA, LOWEST_PA = 120_000.0, 500.0  # -1.5 and 36 km: beyond these a number is no pressure around an aircraft
REFUSED = f"pressures outside {LOWEST_PA / 100:g} to {HIGHEST_PA / 100:g} hPa, kept as raw values alone"
_GAS_CONSTANT, _GRAVITY = 287.05287, 9.80665  # J/(kg K), m/s^2
_LAYERS = ((0.0, -0.0065), (11_000.0, 0.0), (20_000.0, 0.0010), (32_000.0, 0.0028))  # base, m; lapse upwards, K/m


def _falls_to(height_m: float, base_k: float, lapse_k_per_m: float) -> float:
    """Return the pressure at a height above a layer's base, as a share of that at the base."""
    if lapse_k_per_m == 0.0:
        return float(np.exp(-_GRAVITY * height_m / (_GAS_CONSTANT * base_k)))
    top_k = base_k + lapse_k_per_m * height_m
    return float((top_k / base_k) ** (-_GRAVITY / (_GAS_CONSTANT * lapse_k_per_m)))


def _climbs(share: FloatArray, base_k: float, lapse_k_per_m: float) -> FloatArray:
    """Return the height above a layer's base, m, where the pressure is a share of the base's."""
    if lapse_k_per_m == 0.0:
        return np.asarray(-_GAS_CONSTANT * base_k / _GRAVITY * np.log(share))
    exponent = -_GAS_CONSTANT * lapse_k_per_m / _GRAVITY
    return np.asarray(base_k / -lapse_k_per_m * (1.0 - share**exponent))


def pressure_altitude_m(pressure_pa: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return the pressure altitude, and a mask of the pressures refused.

    Each layer has a constant lapse L of the temperature T from its base upwards, and the air rests in it:
    p = p_b (1 + L (H - H_b) / T_b)^(-g / (R L)), or p_b exp(-g (H - H_b) / (R T_b)) where L = 0; solved for H.

    Parameters
    ----------
    pressure_pa : ndarray, any shape
        Static pressure, Pa.

    Returns
    -------
    altitude_m : ndarray, same shape
        Geopotential altitude, m, as altimeters show it (at 15 km 35 m less than the geometric one); NaN where the
        pressure is NaN or refused.
    is_refused : ndarray of bool, same shape
        Where the number is below ``LOWEST_PA`` or above ``HIGHEST_PA``. A NaN is none of these: it stays a NaN.

    Notes
    -----
    Source: U.S. Standard Atmosphere, 1976, eqs. 33a and 33b, table 4; ICAO Doc 7488/3 (1993) is the same up to 32 km.

    Examples
    --------
    >>> altitude_m, is_refused = pressure_altitude_m(np.array([101325.0, 89874.6, 22632.06, 12044.6, 5474.89, 0.0]))
    >>> altitude_m.round(0).tolist(), is_refused.tolist()
    ([0.0, 1000.0, 11000.0, 15000.0, 20000.0, nan], [False, False, False, False, False, True])
    """
    with np.errstate(invalid="ignore"):  # some NaN signal when they are compared
        is_refused = (pressure_pa < LOWEST_PA) | (pressure_pa > HIGHEST_PA)
        pressure = np.where(is_refused, np.nan, pressure_pa)
        base_pa, base_k = SEA_LEVEL_PA, SEA_LEVEL_K
        altitude = _climbs(pressure / base_pa, base_k, _LAYERS[0][1])
        for (below_m, lapse), (base_m, lapse_above) in pairwise(_LAYERS):
            base_pa *= _falls_to(base_m - below_m, base_k, lapse)
            base_k += lapse * (base_m - below_m)
            altitude = np.where(pressure < base_pa, base_m + _climbs(pressure / base_pa, base_k, lapse_above), altitude)
    return altitude, is_refused
