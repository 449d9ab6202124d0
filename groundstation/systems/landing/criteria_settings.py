"""Limits and weights of the criteria of approaches: the table ``[landing.criteria]``."""

import math
from dataclasses import fields

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import M_PER_FOOT, MPS_PER_KNOT


@dataclass(frozen=True)
class Limits:
    """Bounds of one criterion and its weight in the user's own score.

    The unit is that of the criterion. Without bounds the value is told and not judged.
    """

    # Lowest value that is met, in the unit of the criterion; empty: no such limit.
    at_least: float | None = number(None)
    # Highest value that is met, in the unit of the criterion; empty: no such limit.
    at_most: float | None = number(None)
    weight: float = number(0.0, 0.0, 1_000.0)  # weight of the criterion in the user's own score; 0: none

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

    lateral: Limits = Limits()  # course deviation, dots; FSF 7.1 element 8
    vertical: Limits = Limits()  # glide path deviation, dots; FSF 7.1 element 8
    sink_rate: Limits = Limits()  # sink rate on the approach, m/s; FSF 7.1 element 5
    bank: Limits = Limits()  # bank on the approach, deg; Airbus FOBN
    speed: Limits = Limits()  # airspeed on the approach, m/s; FSF 7.1 element 3
    flap: Limits = Limits()  # height at which the landing flap is set, m; FSF 7.1 element 4
    gear: Limits = Limits()  # height at which the gear is down, m; FSF 7.1 element 4
    thrust: Limits = Limits()  # lowest thrust on the approach, %; FSF 7.1 element 6
    # Tailwind, m/s; Transport Canada AC 525-008, 3.0: more needs tests.
    tailwind: Limits = Limits(at_most=10.0 * MPS_PER_KNOT)
    crosswind: Limits = Limits()  # crosswind, m/s; flight manual
    threshold_height: Limits = Limits()  # height over the threshold, m; FSF 8.3
    threshold_speed: Limits = Limits()  # airspeed over the threshold, m/s; EASA GM2 ORO.AOC.130
    flare: Limits = Limits()  # time from 50 ft to the touchdown, s; FSF 8.3
    floating: Limits = Limits()  # distance from 20 ft to the touchdown, m; FSF 8.3
    # Touchdown beyond the threshold, m; FAA Pilot/Controller Glossary, touchdown zone: the first 3000 ft.
    touchdown: Limits = Limits(at_least=0.0, at_most=3_000.0 * M_PER_FOOT)
    aiming_point: Limits = Limits()  # touchdown beyond the aiming point, m; ICAO Annex 14, volume I, table 5-1
    runway_remaining: Limits = Limits()  # runway remaining at the touchdown, m; operator
    centre_line: Limits = Limits()  # distance off the centre line at the touchdown, m; operator
    landing_flap: Limits = Limits()  # flap at the touchdown, deg; EASA GM2 ORO.AOC.130
    landing_pitch: Limits = Limits()  # pitch at the touchdown, deg; EASA GM2 ORO.AOC.130
    landing_bank: Limits = Limits()  # bank below 20 ft, deg; EASA GM2 ORO.AOC.130
    landing_sink: Limits = Limits()  # sink rate at the touchdown, m/s; operator
    landing_load: Limits = Limits()  # peak load at the touchdown, g; EASA GM2 ORO.AOC.130

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
