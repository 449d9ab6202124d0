"""Decimals that a number is rounded to in text and files, chosen by its name."""

import math
from collections.abc import Mapping
from functools import cache

from groundstation.base.unit_names import UNITS

# Decimals by full name, where the unit is not enough. 6 where neither says anything.
DIGITS_BY_NAME: Mapping[str, int] = {
    "drift_deg_per_h": 2,
    "drift_sigma_deg_per_h": 2,
    "latitude_deg": 7,
    "longitude_deg": 7,
    "end_latitude_deg": 7,
    "end_longitude_deg": 7,
    "far_latitude_deg": 7,
    "far_longitude_deg": 7,
    "start_s": 3,
    "end_s": 3,
    "taxi_seconds": 1,
    "value": 5,
    "reference_residual_arcmin": 2,
}
HOURS_AND_MINUTES: Mapping[str, int] = {"min": 3, "h": 4}  # "min" is a unit after a length of time, else "at least"
USUAL = 6


@cache
def digits_of(name: str) -> int:
    """Decimals a number is rounded to, from its field name.

    Examples
    --------
    >>> digits_of("error_deg"), digits_of("ground_speed_mps"), digits_of("drift_deg_per_h"), digits_of("share")
    (4, 4, 2, 6)
    >>> digits_of("north_drift_sigma_dph"), digits_of("radial_error_rate_50_nmiph"), digits_of("horizon_min")
    (6, 4, 3)
    """
    if name in DIGITS_BY_NAME:
        return DIGITS_BY_NAME[name]
    for part in reversed(name.split("_")):
        unit = part.rstrip("0123456789")
        decimals = UNITS[unit].decimals if unit in UNITS else HOURS_AND_MINUTES.get(unit)
        if decimals is not None:
            return decimals
    return USUAL


def rounded(value: float, digits: int | None) -> float | None:
    """Round a number for JSON, never to minus zero; None where it is not finite.

    With ``digits`` None it is not rounded.

    Examples
    --------
    >>> rounded(1.23456, 2), rounded(-0.001, 2), rounded(math.nan, 2)
    (1.23, 0.0, None)
    """
    if not math.isfinite(value):
        return None
    return value if digits is None else round(value, digits) + 0.0
