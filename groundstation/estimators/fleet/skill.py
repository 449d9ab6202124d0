"""Forecast skill of many flights merged from sums over their starts."""

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from groundstation.results.fleet import FleetSkill
from groundstation.results.forecast import METHODS


@dataclass(frozen=True)
class SkillOfFlight:
    """Forecast skill of one method at one horizon on one flight; ``coverage95`` NaN where there is no band.

    ``is_within`` says whether NEES of the flight is within its 95 % limits, None where it has too few starts to judge.
    """

    method: str
    horizon_min: float
    starts: int
    rms_m: float
    coverage95: float
    is_within: bool | None = None


@dataclass
class _Sums:
    starts: int = 0
    squares_m2: float = 0.0
    covered: float = 0.0
    coverage_starts: int = 0
    judged: int = 0
    within: int = 0
    rms_m: array = field(default_factory=lambda: array("d"))


class SkillMerger:
    """Sums by method and horizon; flights are added one after the other.

    mean square = sum of starts x rms^2 / sum of starts, coverage likewise: what all starts in one array would give,
    never a mean of RMSE.

    Examples
    --------
    >>> merger = SkillMerger()
    >>> merger.add(SkillOfFlight("last_estimate", 30.0, starts=3, rms_m=3.0, coverage95=1.0))
    >>> merger.add(SkillOfFlight("last_estimate", 30.0, starts=1, rms_m=5.0, coverage95=0.0))
    >>> (row,) = merger.rows()
    >>> round(row.rms_m**2, 6), row.coverage95, row.median_flight_rms_m  # (3 x 9 + 1 x 25) / 4
    (13.0, 0.75, 4.0)
    """

    def __init__(self) -> None:
        self._sums: dict[tuple[str, float], _Sums] = {}

    def add(self, row: SkillOfFlight) -> None:
        """Add a row of one flight."""
        sums = self._sums.setdefault((row.method, row.horizon_min), _Sums())
        sums.starts += row.starts
        sums.squares_m2 += row.starts * row.rms_m**2
        sums.rms_m.append(row.rms_m)
        if row.is_within is not None:
            sums.judged += 1
            sums.within += row.is_within
        if math.isfinite(row.coverage95):
            sums.covered += row.starts * row.coverage95
            sums.coverage_starts += row.starts

    def rows(self) -> tuple[FleetSkill, ...]:
        """What was added, by method in the order of ``METHODS``, then by horizon."""
        order = {name: place for place, name in enumerate(METHODS)}
        keys = sorted(self._sums, key=lambda key: (order.get(key[0], len(order)), *key))
        return tuple(_row(method, horizon_min, self._sums) for method, horizon_min in keys)


def _row(method: str, horizon_min: float, all_sums: Mapping[tuple[str, float], _Sums]) -> FleetSkill:
    sums = all_sums[method, horizon_min]
    return FleetSkill(
        method,
        horizon_min,
        flights=len(sums.rms_m),
        starts=sums.starts,
        rms_m=math.sqrt(sums.squares_m2 / sums.starts),
        median_flight_rms_m=float(np.median(sums.rms_m)),
        highest_flight_rms_m=max(sums.rms_m),
        coverage95=sums.covered / sums.coverage_starts if sums.coverage_starts else None,
        coverage_starts=sums.coverage_starts,
        flights_judged=sums.judged,
        flights_within=sums.within,
    )
