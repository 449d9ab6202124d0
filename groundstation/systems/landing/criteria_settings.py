"""Limits and weights of the criteria of approaches: the table ``[landing.criteria]``."""

import math
from dataclasses import dataclass, fields

from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import M_PER_FOOT, MPS_PER_KNOT


@dataclass(frozen=True)
class Limits:
    """Bounds of one criterion and its weight in the user's own score.

    The unit is that of the criterion. Without bounds the value is told and not judged.
    """

    at_least: float | None = number(None)
    at_most: float | None = number(None)
    weight: float = number(0.0, 0.0, 1_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.at_least is not None and self.at_most is not None and self.at_least > self.at_most:
            raise SettingsError("at_least", f"{self.at_least:g}", f"no more than at_most, {self.at_most:g}")

    @property
    def is_set(self) -> bool:
        """Tell whether there is a bound."""
        return self.at_least is not None or self.at_most is not None


@dataclass(frozen=True)
class CriteriaSettings:
    """Limits of every criterion, by its name; those of the type or the operator are left open.

    Of ``lateral`` to ``speed`` the limits in ``[landing]`` count where none is given here. ``flap`` and ``gear`` are
    heights; none given: the check height.
    """

    lateral: Limits = Limits()
    vertical: Limits = Limits()
    sink_rate: Limits = Limits()
    bank: Limits = Limits()
    speed: Limits = Limits()
    flap: Limits = Limits()
    gear: Limits = Limits()
    thrust: Limits = Limits()
    tailwind: Limits = Limits(at_most=10.0 * MPS_PER_KNOT)  # Transport Canada AC 525-008, 3.0: more needs tests
    crosswind: Limits = Limits()
    threshold_height: Limits = Limits()
    threshold_speed: Limits = Limits()
    flare: Limits = Limits()
    floating: Limits = Limits()
    # FAA Pilot/Controller Glossary, touchdown zone: the first 3000 ft of the runway.
    touchdown: Limits = Limits(at_least=0.0, at_most=3_000.0 * M_PER_FOOT)
    aiming_point: Limits = Limits()
    runway_remaining: Limits = Limits()
    centre_line: Limits = Limits()
    landing_flap: Limits = Limits()
    landing_pitch: Limits = Limits()
    landing_bank: Limits = Limits()
    landing_sink: Limits = Limits()
    landing_load: Limits = Limits()

    def of(self, name: str) -> Limits:
        """The limits of one criterion."""
        found: Limits = getattr(self, name)
        return found

    def told(self) -> dict[str, float]:
        """Every bound and weight that is set, by its key in the settings file."""
        return {
            f"criteria.{one.name}.{key.name}": value
            for one in fields(self)
            for key in fields(Limits)
            if (value := getattr(self.of(one.name), key.name)) is not None and not (key.name == "weight" and value == 0)
        }


def is_within(value: float, limits: Limits) -> bool:
    """Tell whether a value keeps both bounds.

    Examples
    --------
    >>> is_within(2.0, Limits(at_most=2.0)), is_within(math.nan, Limits(at_least=1.0))
    (True, False)
    """
    low = -math.inf if limits.at_least is None else limits.at_least
    high = math.inf if limits.at_most is None else limits.at_most
    return low <= value <= high
