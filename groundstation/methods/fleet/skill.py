"""Forecast skill of many flights merged from sums over their starts."""

import math
from array import array
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.results.fleet import WHOLE_FLEET, FleetSkill
from groundstation.results.fleet_share import SkillOfFlight
from groundstation.results.forecast_methods import FORECAST_METHODS


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

    ``aircraft`` is the one whose flights are added; empty: all.

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

    def __init__(self, aircraft: str = WHOLE_FLEET) -> None:
        self.aircraft = aircraft
        self._sums: dict[tuple[str, float], _Sums] = {}

    def add(self, row: SkillOfFlight) -> None:
        """Add a row of one flight."""
        self.add_columns(_columns_of(row))

    def add_columns(self, rows: Mapping[str, NDArray[Any]]) -> None:
        """Add rows of flights: the fields of :class:`SkillOfFlight` as columns.

        ``is_within`` is -1 where it is None.
        """
        for key, own in _groups(rows["method"], rows["horizon_min"]).items():
            sums = self._sums.setdefault(key, _Sums())
            starts, rms_m, coverage = (rows[name][own] for name in ("starts", "rms_m", "coverage95"))
            judged, known = rows["is_within"][own] >= 0, np.isfinite(coverage)
            sums.starts += int(starts.sum())
            sums.squares_m2 = _added(sums.squares_m2, starts * rms_m**2)
            sums.rms_m.extend(rms_m.tolist())
            sums.judged += int(judged.sum())
            sums.within += int((rows["is_within"][own] > 0).sum())
            sums.covered = _added(sums.covered, (starts * coverage)[known])
            sums.coverage_starts += int(starts[known].sum())

    def rows(self) -> tuple[FleetSkill, ...]:
        """Return what was added, by method in the order of ``FORECAST_METHODS``, then by horizon."""
        order = {name: place for place, name in enumerate(FORECAST_METHODS)}
        keys = sorted(self._sums, key=lambda key: (order.get(key[0], len(order)), *key))
        return tuple(_row(self.aircraft, method, horizon_min, self._sums) for method, horizon_min in keys)


def _columns_of(row: SkillOfFlight) -> dict[str, NDArray[Any]]:
    within = -1 if row.is_within is None else int(row.is_within)
    columns = {name: np.array([value]) for name, value in vars(row).items() if name != "is_within"}
    return {**columns, "method": np.array([row.method], dtype=object), "is_within": np.array([within])}


def _groups(method: NDArray[Any], horizon_min: NDArray[np.float64]) -> dict[tuple[str, float], NDArray[np.intp]]:
    """Rows of each method and horizon."""
    if not len(method):
        return {}
    names, name = np.unique(method, return_inverse=True)
    horizons, horizon = np.unique(horizon_min, return_inverse=True)
    code = name * len(horizons) + horizon
    order = np.argsort(code, kind="stable")
    codes, starts = np.unique(code[order], return_index=True)
    parts = np.split(order, starts[1:])
    return {
        (str(names[one // len(horizons)]), float(horizons[one % len(horizons)])): part
        for one, part in zip(codes.tolist(), parts, strict=True)
    }


def _added(total: float, values: NDArray[np.float64]) -> float:
    """A total with values added one after the other: the same however the flights are parted."""
    return float(np.cumsum(np.concatenate([[total], values]))[-1])


def _row(aircraft: str, method: str, horizon_min: float, all_sums: Mapping[tuple[str, float], _Sums]) -> FleetSkill:
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
        aircraft=aircraft,
    )


class SkillMergers:
    """Mergers of all flights, and of those of each named aircraft."""

    def __init__(self) -> None:
        self.whole = SkillMerger()
        self._own: dict[str, SkillMerger] = {}

    def add(self, row: SkillOfFlight, aircraft: str) -> None:
        """Add a row of one flight, and the aircraft it is of."""
        self.add_columns(_columns_of(row), np.array([aircraft]))

    def add_columns(self, rows: Mapping[str, NDArray[Any]], aircraft: NDArray[np.str_]) -> None:
        """Add rows of flights; ``aircraft`` is that of each row, empty where its log names none."""
        self.whole.add_columns(rows)
        for name in np.unique(aircraft[aircraft != WHOLE_FLEET]).tolist():
            own = aircraft == name
            self._own.setdefault(name, SkillMerger(name)).add_columns(
                {key: values[own] for key, values in rows.items()}
            )

    def by_aircraft(self) -> tuple[FleetSkill, ...]:
        """Return the rows of each aircraft, by its name."""
        return tuple(row for name in sorted(self._own) for row in self._own[name].rows())
