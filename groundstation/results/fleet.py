"""Answers over a fleet of flights, for the fleet report, fleet.rrd and notebooks."""

from collections.abc import Mapping
from dataclasses import field, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnknownNameError
from groundstation.base.records import frozen
from groundstation.base.serial import to_json
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.results.arrays.fleet import FleetChecks, FleetInstallationFlights, FleetSkillFlights, FleetTrend
from groundstation.results.figures import FigureData
from groundstation.results.fleet_trends import ChangePoint, SlopeRow
from groundstation.results.fleet_units import FleetUnitFlights, FleetUnitRow, UnitEventRow, UnitTrendRow
from groundstation.results.frames import row_fields, rows_frame
from groundstation.results.installations import InstallationRow
from groundstation.results.roles import LETTERS

if TYPE_CHECKING:
    import pandas as pd

WHOLE_FLEET = ""  # where an aircraft is named and all of them are meant


@dataclass(frozen=True)
class Densities:
    """Density of the heading error of every flight, on one grid.

    Heading error is INS heading - track, of used samples.

    Parameters
    ----------
    edge_deg : ndarray, shape (m + 1,)
        Bin edges, evenly spaced.
    flight_id : ndarray of str, shape (k,)
        Flights with samples, by flight id; ``aircraft`` and ``samples`` go with them.
    density_per_deg : ndarray, shape (k, m)
        Each row sums to the share of the flight's samples inside the grid, divided by the bin width.
    pooled_per_deg : ndarray, shape (m,)
        The same of all samples together, whatever their aircraft.
    """

    edge_deg: NDArray[np.float64]
    flight_id: NDArray[np.str_]
    aircraft: NDArray[np.str_]
    samples: NDArray[np.int64]
    density_per_deg: NDArray[np.float32]
    pooled_per_deg: NDArray[np.float64]

    def __post_init__(self) -> None:
        for part in fields(self):
            object.__setattr__(self, part.name, frozen(getattr(self, part.name)))

    def __len__(self) -> int:
        return len(self.flight_id)

    @property
    def center_deg(self) -> NDArray[np.float64]:
        """Bin centres, shape (m,)."""
        return np.asarray(0.5 * (self.edge_deg[1:] + self.edge_deg[:-1]))

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the aircraft with samples, in order; flights whose log names none are left out."""
        return tuple(sorted({name for name in self.aircraft.tolist() if name}))

    def pooled_of(self, aircraft: str) -> NDArray[np.float64]:
        """Density of the samples of an aircraft, merged from its flights, shape (m,)."""
        own = self.aircraft == aircraft
        count = self.samples[own]
        return np.asarray(count @ self.density_per_deg[own].astype(np.float64) / max(int(count.sum()), 1))


@dataclass(frozen=True)
class FittedNormal:
    """Normal distribution fitted to samples of the heading error.

    ``aircraft`` is empty for the whole fleet. It is merged from n, mean and M2 of the flights, and is exactly what all
    samples in one array would give.
    """

    aircraft: str
    flights: int
    samples: int
    mean_deg: float
    sigma_deg: float


@dataclass(frozen=True)
class AircraftRow:
    """Heading error of one aircraft over its flights.

    It is that of the whole fleet where ``aircraft`` is :data:`WHOLE_FLEET`.

    Parameters
    ----------
    flights, assessed, averaged, accepted : int
        Flights, those with a heading error, those of them that enter the statistics below (all but those with the
        verdict reject), those with the verdict accept.
    samples : int
        Used samples of the flights that have their samples.
    mean_deg, confidence95_deg
        Mean error over the flights and its 95 % interval, from the spread between flights: each counts as one, however
        many samples it has. No interval with fewer than two flights, nor for several aircraft together: flights of
        one aircraft are alike, and those of a fleet are not so many independent ones.
    sample_mean_deg : float or None
        Mean of all samples.
    sigma_within_deg : float or None
        Spread of the samples about the mean of their flight.
    sigma_between_deg : float or None
        Spread of the flights' true errors about the aircraft's mean, what their standard errors explain taken away.
    heterogeneity : float or None
        Share of the variance of the flights' errors that their standard errors do not explain, 0 to 1.
    """

    aircraft: str
    flights: int
    assessed: int
    averaged: int
    accepted: int
    samples: int
    mean_deg: float | None
    confidence95_deg: tuple[float, float] | None
    sample_mean_deg: float | None
    sigma_within_deg: float | None
    sigma_between_deg: float | None
    heterogeneity: float | None


@dataclass(frozen=True)
class FleetSkill:
    """Forecast skill of a method at a horizon over all flights, or over those of one aircraft.

    ``aircraft`` is :data:`WHOLE_FLEET` for all. Mean squares and coverage are merged by starts. ``rms_m`` is over all
    starts; ``median_flight_rms_m``, ``highest_flight_rms_m`` over the flights' own RMS; ``coverage95`` over the
    ``coverage_starts`` starts that had a band, None without any. Outages of one flight overlap, so a flight's own
    coverage says little: of the ``flights_judged`` with enough independent starts ``flights_within`` had a NEES within
    its 95 % limits.
    """

    method: str
    horizon_min: float
    flights: int
    starts: int
    rms_m: float
    median_flight_rms_m: float
    highest_flight_rms_m: float
    coverage95: float | None
    coverage_starts: int
    flights_judged: int = 0
    flights_within: int = 0
    aircraft: str = WHOLE_FLEET


@dataclass(frozen=True)
class FleetCalibration:
    """Share of independent checks inside the stated 95 % interval.

    Flights with verdict reject are left out.

    Parameters
    ----------
    quantity : str
        ``reference``, ``runway``, ``onboard``: corrected parking heading against its reference, INS heading against the
        runway, the aircraft's own figure; ``truth_*``: heading error and positions against a reference beside the log.
    checks, inside : int
    share_inside, confidence95 : float, (float, float)
        Share and its exact (Clopper and Pearson) interval: honest sigmas have ``stated`` inside it.
    z_mean, z_sigma : float
        Mean and sigma of residual / sigma: honest are 0 and 1.
    pit : tuple of int
        Checks per tenth of the probability integral transform; honest is flat.
    """

    quantity: str
    title: str
    checks: int
    inside: int
    share_inside: float
    confidence95: tuple[float, float]
    z_mean: float
    z_sigma: float | None
    pit: tuple[int, ...]
    stated: float = 0.95


@dataclass(frozen=True)
class FleetDeviationRow:
    """Magnetic deviation found in one flight, beside the mean of its aircraft's ``others``.

    ``coefficients_deg`` A to E are of the error, by the method recommended; ``before_rms_deg`` and ``after_rms_deg`` of
    level flight that no fit has seen. ``difference_rms_deg`` is the RMS over the circle of what the curves differ by,
    ``expected_rms_deg`` what their sigmas lead to expect of it; None where there is nothing to compare with. A
    coefficient that the headings flown do not show is NaN.

    ``sensor`` is ``magnetometer`` or ``flux``, a compass of heading alone.
    """

    aircraft: str
    flight_id: str
    start_utc_ns: int | None
    verdict: str
    method: str
    coefficients_deg: dict[str, float]
    coefficients_sigma_deg: dict[str, float]
    before_rms_deg: float | None
    after_rms_deg: float | None
    others: int
    difference_rms_deg: float | None
    expected_rms_deg: float | None
    sensor: str = "magnetometer"

    def error_deg(self, heading_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Evaluate A + B sin c + C cos c + D sin 2c + E cos 2c, shape (n,).

        c are uncorrected magnetic headings.
        """
        once, twice = np.deg2rad(heading_deg), 2.0 * np.deg2rad(heading_deg)
        a, b, c, d, e = np.nan_to_num([self.coefficients_deg[letter] for letter in LETTERS]).tolist()
        return np.asarray(a + b * np.sin(once) + c * np.cos(once) + d * np.sin(twice) + e * np.cos(twice))


@dataclass(frozen=True)
class OutlierRow:
    """A flight whose figure is far from those of the same aircraft.

    ``typical`` is their median, ``z`` the distance in robust sigmas (of the logarithm for figures that are positive),
    ``reason`` one line for people.
    """

    flight_id: str
    aircraft: str
    quantity: str
    value: float
    typical: float
    z: float
    reason: str


@dataclass(frozen=True)
class NotInFleet:
    """Log that gave no flight, or flight folder that cannot be read.

    ``kind`` is ``failed`` or ``skipped``.
    """

    kind: Literal["failed", "skipped"]
    source: str
    reason: str


@dataclass(frozen=True)
class SessionRow:
    """Session of several aircraft: the algorithm to trust, and its accuracy.

    ``two_sigma_r_m`` is that of the worst aircraft at the end, as computed; ``reckoned_two_sigma_r_m`` that of dead
    reckoning alone; ``rms_m``, ``is_consistent`` and ``diverges`` are None without a truth. ``reason`` says why there
    is no answer. ``report`` and ``recording`` are files relative to the folder of flights, empty where there is none.
    """

    session_id: str
    aircraft: str
    start_utc_ns: int | None
    duration_s: float
    status: str
    algorithm: str = ""
    two_sigma_r_m: float | None = None
    reckoned_two_sigma_r_m: float | None = None
    rms_m: float | None = None
    is_consistent: bool | None = None
    diverges: bool | None = None
    findings_fail: int = 0
    findings_warn: int = 0
    reason: str = ""
    report: str = ""
    recording: str = ""


@dataclass(frozen=True)
class FleetResults:
    """Everything the fleet report, fleet.rrd and notebooks show.

    Parameters
    ----------
    flights : FigureData
        One row per flight by flight id; its columns are :class:`groundstation.results.columns.FlightColumn`.
    densities : Densities
    normals : tuple of FittedNormal
        The whole fleet first, then each named aircraft with samples.
    by_aircraft : tuple of AircraftRow
        The whole fleet first, then each aircraft by name; flights whose log names none count for the former alone, and
        have no trend and no outliers.
    trend : FleetTrend
        Control charts.
    change_points : tuple of ChangePoint
    slopes : tuple of SlopeRow
        The line behind each control chart since its last change.
    skill : tuple of FleetSkill
        All flights together: by method in the order of ``METHODS``, then horizon.
    skill_by_aircraft : tuple of FleetSkill
        The same for each named aircraft, by name.
    skill_flights : FleetSkillFlights
        The shipped method of every flight.
    calibration : tuple of FleetCalibration
    calibration_checks : FleetChecks
        Every check, those of rejected flights too.
    outliers : tuple of OutlierRow
    not_in_fleet : tuple of NotInFleet
        Logs and folders that failed or were skipped and why, failed first, by source.
    stated : mapping of str to number
        Rates and limits the statistics keep to, by name: chance of a false change point per aircraft, and so on.
    deviations : tuple of FleetDeviationRow
        By aircraft, then time.
    sessions : tuple of SessionRow
        By session id.
    installations : tuple of InstallationRow
        By serial and time.
    installation_flights : FleetInstallationFlights
        A row for each flight of them: what earlier ones had taught, its learned answer, its residual.
    units : tuple of FleetUnitRow
        Every INS by its serial.
    unit_trends : tuple of UnitTrendRow
        Their figures over time, by serial.
    unit_events : tuple of UnitEventRow
        Moves, changes of level, pauses, doubts.
    unit_flights : FleetUnitFlights
        Every INS of every flight.
    """

    flights: FigureData
    densities: Densities
    normals: tuple[FittedNormal, ...]
    by_aircraft: tuple[AircraftRow, ...]
    trend: FleetTrend
    change_points: tuple[ChangePoint, ...]
    skill: tuple[FleetSkill, ...]
    skill_flights: FleetSkillFlights
    calibration: tuple[FleetCalibration, ...]
    calibration_checks: FleetChecks
    outliers: tuple[OutlierRow, ...]
    not_in_fleet: tuple[NotInFleet, ...]
    stated: Mapping[str, float] = field(default_factory=dict)
    deviations: tuple[FleetDeviationRow, ...] = ()
    sessions: tuple[SessionRow, ...] = ()
    slopes: tuple[SlopeRow, ...] = ()
    installations: tuple[InstallationRow, ...] = ()
    installation_flights: FleetInstallationFlights = field(default_factory=FleetInstallationFlights.empty)
    units: tuple[FleetUnitRow, ...] = ()
    unit_trends: tuple[UnitTrendRow, ...] = ()
    unit_events: tuple[UnitEventRow, ...] = ()
    unit_flights: FleetUnitFlights = field(default_factory=FleetUnitFlights.empty)
    skill_by_aircraft: tuple[FleetSkill, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "stated", MappingProxyType(dict(self.stated)))

    def __len__(self) -> int:
        return len(self.flights)

    @property
    def aircraft(self) -> tuple[str, ...]:
        """Names of the aircraft in order; an empty name stands for flights whose log names none."""
        return tuple(sorted(set(self.flights["aircraft"].tolist())))

    def normal(self, aircraft: str | None = None) -> FittedNormal | None:
        """Return the fitted normal of the whole fleet, or of one aircraft; None without samples.

        That of the fleet stands first.
        """
        candidates = self.normals[:1] if aircraft is None else self.normals[1:]
        return next((one for one in candidates if aircraft is None or one.aircraft == aircraft), None)

    def to_frame(self, name: str = "flights") -> "pd.DataFrame":
        """A table as a pandas DataFrame, by the name of its field; ``densities`` in long form.

        Times are datetime64[ns, UTC].

        Raises
        ------
        UsageError
            When there is no such table.
        """
        import pandas as pd

        rows = row_fields(FleetResults)
        if name in rows:
            return rows_frame(rows[name], getattr(self, name))
        if name == "densities":
            bins = len(self.densities.pooled_per_deg)
            return pd.DataFrame(
                {
                    "flight_id": np.repeat(self.densities.flight_id, bins),
                    "aircraft": np.repeat(self.densities.aircraft, bins),
                    "heading_error_deg": np.tile(self.densities.center_deg, len(self.densities)),
                    "density_per_deg": self.densities.density_per_deg.ravel(),
                }
            )
        found = getattr(self, name, None)
        if not isinstance(found, FigureData):
            known = [part.name for part in fields(self) if part.name != "stated"]
            raise UnknownNameError("tables", name, known)
        frame = found.to_frame()
        for key, values in found.columns.items():
            if values.dtype.kind == "M":
                frame[key] = frame[key].dt.tz_localize("UTC")
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Return every table as plain JSON values, rounded by its names.

        Tables are lists of rows, densities are columns.
        """
        out: dict[str, Any] = {}
        for part in fields(self):
            found = getattr(self, part.name)
            out[part.name] = _rows(found) if isinstance(found, FigureData) else to_json(found)
        return out


def _rows(table: FigureData) -> list[dict[str, Any]]:
    columns = {name: _values(name, values) for name, values in table.columns.items()}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _values(name: str, values: NDArray[Any]) -> list[Any]:
    if values.dtype.kind == "M":
        return [None if np.isnat(one) else utc_ns_to_iso(int(one.astype(np.int64))) for one in values]
    found: list[Any] = to_json(values, name)
    return found
