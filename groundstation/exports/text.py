"""Numbers in the form that text formats want."""

import math

from groundstation.base.angles import FloatArray


def number(value: float, digits: int) -> str:
    """Write a number with so many decimals at most; empty where it is not known.

    Examples
    --------
    >>> number(1.5, 3), number(-0.0001, 3), number(float("nan"), 3)
    ('1.5', '0', '')
    """
    if not math.isfinite(value):
        return ""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"
    return "0" if text == "-0" else text


def coordinates(values_deg: FloatArray) -> list[str]:
    """Write degrees with nine decimals, 0.1 mm."""
    return [number(value, 9) for value in values_deg.tolist()]
