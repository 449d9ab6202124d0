"""Limits of honest units: growth exceeded in a stated share of simulated flights.

``units_limits.toml`` beside this file has them, written by
``python -m groundstation.systems.inertial.study.units_limits``.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from groundstation.base.toml_text import toml_table

FILE = "units_limits.toml"


@dataclass(frozen=True)
class GrowthLimits:
    """Limits on the growth of one unit against the truth, or of the difference of two.

    ``heading_deg`` is on the median of the heading difference.
    """

    rate_nmiph: float
    velocity_mps: float
    heading_deg: float


@dataclass(frozen=True)
class ClassLimits:
    """Limits of a class at a length of flight, and the class and share they are of."""

    ins_class: str
    false_alarm_share: float
    single: GrowthLimits
    pair: GrowthLimits


@cache
def _table() -> dict[str, Any]:
    text = (resources.files("groundstation.systems.inertial") / FILE).read_text(encoding="utf-8")
    return toml_table(text, FILE, "limits of honest units")


def limits_of(ins_class: str, hours: float, *, is_start_known: bool) -> ClassLimits | None:
    """Return the limits of a class for a length of flight, None for an unknown class.

    ``is_start_known`` False: navigation began some unknown time, up to two hours, before the log. Limits of other
    lengths are interpolated, logarithm against logarithm, and held beyond the ends.
    """
    table = _table()
    found = table["classes"].get(ins_class)
    if found is None:
        return None
    part = found["known" if is_start_known else "unknown"]
    at = np.log(np.maximum(hours, 1e-3))

    def value(name: str) -> float:
        return float(np.exp(np.interp(at, np.log(table["hours"]), np.log(part[name]))))

    single, pair = (
        GrowthLimits(*(value(f"{of}_{name}") for name in ("rate_nmiph", "velocity_mps", "heading_deg")))
        for of in ("single", "pair")
    )
    return ClassLimits(ins_class, float(table["false_alarm_share"]), single, pair)


def share_of_limits() -> float:
    """Return the share of flights of honest units in which a single limit is exceeded."""
    return float(_table()["false_alarm_share"])
