"""Words of the fleet report's chapters for quantities, aircraft, times and counts."""

import math
from collections.abc import Mapping

import numpy as np

from groundstation.chapters.gates import VERDICTS
from groundstation.chapters.wording import ABSENT, clean, is_number, named_quantity, number

NOT_NAMED = "not named"
BEYOND_REASON = 1e6
QUANTITIES: Mapping[str, tuple[str, str, int]] = {  # title, unit, decimals
    "error_deg": ("heading error", "°", 3),
    "standard_error_deg": ("standard error of the heading error", "°", 3),
    "estimate_sd_deg": ("spread of the differences", "°", 3),
    "onboard_difference_deg": ("heading error found on board − ours", "°", 3),
    "reference_residual_arcmin": ("parking heading − reference", "′", 1),
    "radial_error_rate_fit_nmiph": ("INS error rate", "nmi/h", 2),
    "forecast_60min_rms_m": ("forecast error after 60 min", "m", 0),
    "health_vibration_mps2": ("vibration in the air", "m/s²", 2),
    "health_hdop": ("HDOP in the air", "", 2),
    "health_test_ratio": ("largest innovation test ratio", "", 2),
    "onboard_heading_rms_deg": ("heading error of the on-board filter, RMS", "°", 2),
    "onboard_tilt_rms_deg": ("tilt error of the on-board filter, RMS", "°", 2),
}


def title_of(quantity: str) -> str:
    """Return a quantity in words."""
    return QUANTITIES[quantity][0] if quantity in QUANTITIES else named_quantity(quantity)[0]


def figure_of(quantity: str, value: float | None) -> str:
    """Return a value of a quantity with its unit; angles carry their sign, but for RMS."""
    _, unit, places = QUANTITIES.get(quantity, (*named_quantity(quantity), 3))
    return bounded(value, places, unit, signed=unit in ("°", "′") and not quantity.endswith("_rms_deg"))


def bounded(value: float | None, places: int, unit: str = "", *, signed: bool = False) -> str:
    """Return a number as text, or "> 1 000 000" for one beyond reason.

    Digits without end would burst a column.

    Examples
    --------
    >>> bounded(0.456, 2, "m"), bounded(-1e15, 2, "°"), bounded(None, 2)
    ('0.46 m', '< −1 000 000°', '—')
    """
    if not is_number(value) or abs(value) <= BEYOND_REASON:
        return number(value, places, unit, signed=signed)
    return f"{'<' if value < 0 else '>'} {number(math.copysign(BEYOND_REASON, value), 0, unit)}"


def span_of(bounds: tuple[float, float] | None, places: int, unit: str) -> str:
    """Return an interval, each end written as :func:`bounded` does."""
    return ABSENT if bounds is None else " … ".join(bounded(end, places, unit, signed=True) for end in bounds)


def aircraft_name(name: str, most: int = 40) -> str:
    """Return the name of an aircraft, shortened where very long; "not named" without one."""
    name = clean(name) or NOT_NAMED
    return name if len(name) <= most else name[: most - 1] + "…"


def verdict_words(verdict: str) -> str:
    """Return a verdict as a word for counts."""
    return VERDICTS[verdict].text.lower() if verdict in VERDICTS else "not assessable"


def day(time: np.datetime64) -> str:
    """Return the day of a time: 2026-05-04; an em dash where it is missing."""
    return ABSENT if np.isnat(time) else str(time.astype("datetime64[D]"))


def minute(time: np.datetime64) -> str:
    """Return a time to the minute: 2026-05-04 06:00; an em dash where it is missing."""
    return ABSENT if np.isnat(time) else str(time.astype("datetime64[m]")).replace("T", " ")
