"""Limits of honest units: growth exceeded in a stated share of simulated flights.

``units_limits.toml`` beside this file has them, written by
``python -m groundstation.systems.inertial.study.units_limits``.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
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
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
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


def pair_limits_of(classes: tuple[str, str], hours: float, *, is_start_known: bool) -> GrowthLimits | None:
    """Return the limits of the difference of two units; None where a class is unknown.

    Of two classes the variances add: the limit is the root of the mean square of those of each class with itself.

    Examples
    --------
    >>> one, other = (limits_of(name, 2.0, is_start_known=True).pair for name in ("navigation", "tactical"))
    >>> both = pair_limits_of(("navigation", "tactical"), 2.0, is_start_known=True)
    >>> round(both.rate_nmiph, 1), round(other.rate_nmiph / 2**0.5, 1), one.rate_nmiph < 3.0
    (155.5, 155.5, True)
    """
    found = [limits_of(name, hours, is_start_known=is_start_known) for name in classes]
    pairs = [one.pair for one in found if one is not None]
    if len(pairs) < len(classes):
        return None
    return GrowthLimits(
        *(
            float(np.sqrt(np.mean([getattr(one, name) ** 2 for one in pairs])))
            for name in ("rate_nmiph", "velocity_mps", "heading_deg")
        )
    )


def share_of_limits() -> float:
    """Return the share of flights of honest units in which a single limit is exceeded."""
    return float(_table()["false_alarm_share"])
