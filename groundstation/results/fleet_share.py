"""Share of one flight in the fleet, as the systems give it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.results.fleet_units import UnitOfFlight

NORMAL_95 = 1.959964
LARGEST = 1e15  # no figure of a flight is larger: what is comes from a file that is damaged


@dataclass(frozen=True)
class FleetSamples:
    """Heading samples of a flight, without the rows that only break lines.

    ``error_deg`` is NaN below walking pace.

    ``about_estimate_deg`` are the errors of the used ones, about the flight's estimate, so that none is cut at 180 deg.
    """

    columns: Mapping[str, NDArray[Any]]
    about_estimate_deg: NDArray[Any]


@dataclass(frozen=True)
class Check:
    """Comparison of an estimate with something independent of it.

    It has the residual, the sigma claimed for it, and whether it is inside 95 %.

    ``z`` is the residual over the sigma. ``verdict`` is that on the estimate; empty where it was not judged.
    """

    quantity: str
    z: float
    is_inside: bool
    residual_deg: float = math.nan
    sigma_deg: float = math.nan
    verdict: str = ""


@dataclass(frozen=True)
class SkillOfFlight:
    """Forecast skill of one method at one horizon on one flight.

    ``coverage95`` is NaN where there is no band. ``is_within`` says whether NEES of the flight is within its 95 %
    limits, None where it has too few starts to judge.
    """

    method: str
    horizon_min: float
    starts: int
    rms_m: float
    coverage95: float
    is_within: bool | None = None


@dataclass(frozen=True)
class SystemShare:
    """Share of one flight that one system adds.

    Parameters
    ----------
    samples : FleetSamples, optional
        Of the heading.
    shipped, skill
        The shipped method of the forecast, and the skill of each.
    checks : sequence of Check
        Comparisons of its answers with something independent.
    units : sequence of UnitOfFlight
        What each INS adds to the history of its unit.
    """

    samples: FleetSamples | None = None
    shipped: str = ""
    skill: Sequence[SkillOfFlight] = ()
    checks: Sequence[Check] = ()
    units: Sequence[UnitOfFlight] = ()


def to_number(value: Any) -> float:
    """A JSON value as a float; NaN when it is no finite number, or an absurd one.

    Examples
    --------
    >>> to_number(3), to_number("3"), to_number(True), to_number(None), to_number(10**400)
    (3.0, nan, nan, nan, nan)
    """
    if not isinstance(value, int | float) or isinstance(value, bool):
        return math.nan
    return float(value) if abs(value) <= LARGEST else math.nan


def check_of(quantity: str, residual: float | None, sigma: float, verdict: str) -> Check | None:
    """Return the comparison of an estimate, degrees; None without a residual or a sigma."""
    residual_deg, sigma_deg = to_number(residual), to_number(sigma)
    if math.isnan(residual_deg) or not sigma_deg > 0.0:
        return None
    is_inside = abs(residual_deg) <= NORMAL_95 * sigma_deg
    return Check(quantity, residual_deg / sigma_deg, is_inside, residual_deg, sigma_deg, verdict)
