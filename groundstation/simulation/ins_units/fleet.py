"""Logs of a fleet over months: aircraft whose INS age, are moved and are replaced."""

from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.toml_settings import check_ranges, number, required_number, settings_from
from groundstation.simulation.ins_units.log import write_units
from groundstation.simulation.ins_units.scenario import UnitsScenario
from groundstation.simulation.ins_units.settings import MOST_UNITS, AnyUnitFault, UnitAided, UnitDrift, UnitsSettings
from groundstation.simulation.routes import RouteKind

_FLEETS = ShippedToml("groundstation.simulation.ins_units", "fleets", "fleet")
NS_PER_DAY = 86_400_000_000_000
MOST_FLIGHTS = 1000


@dataclass(frozen=True)
class FlownPeriod:
    """Flights of one aircraft with the same units.

    Parameters
    ----------
    aircraft : str
    serials : tuple of str
        Of its units; an empty one is not stated.
    first_utc : str
        Start of the first flight, ISO 8601.
    flights : int
    every_days : float
    drift_times, drift_times_at_end : float
        Drift added to the first unit, in gyro constants of the class: at the first and at the last flight.
    is_aided : bool
        GNSS corrects the units.
    """

    aircraft: str
    serials: tuple[str, ...]
    first_utc: str
    flights: int = required_number(1, MOST_FLIGHTS)
    every_days: float = number(1.0, 0.1, 1000.0)
    drift_times: float = number(0.0, 0.0, 1e4)
    drift_times_at_end: float | None = number(None, 0.0, 1e4)
    is_aided: bool = False

    def __post_init__(self) -> None:
        check_ranges(self)
        if not 1 <= len(self.serials) <= MOST_UNITS:
            raise SettingsError("serials", f"{len(self.serials)}", f"1 to {MOST_UNITS}")
        if iso_to_utc_ns(self.first_utc)[0] < 0:
            raise SettingsError("first_utc", self.first_utc, "a date after 1970")

    def faults(self, flight: int) -> tuple[AnyUnitFault, ...]:
        """Return what is wrong with the units in a flight, counted from 0."""
        if self.is_aided:
            return tuple(UnitAided(unit, is_stated=True) for unit in range(1, len(self.serials) + 1))
        last = self.drift_times if self.drift_times_at_end is None else self.drift_times_at_end
        times = self.drift_times + (last - self.drift_times) * flight / max(self.flights - 1, 1)
        return (UnitDrift(1, times=times),) if times else ()


@dataclass(frozen=True)
class UnitsFleet:
    """Everything that determines the logs of a fleet."""

    flown: tuple[FlownPeriod, ...]
    name: str = "fleet"
    title: str = ""
    seed: int = number(1, 0)
    duration_s: float = number(3600.0, 600.0, 50_000.0)
    step_s: float = number(2.0, 0.1, 10.0)
    route: RouteKind = "straight"

    def __post_init__(self) -> None:
        check_ranges(self)
        if not self.flown:
            raise SettingsError("flown", "none", "at least one [[flown]]")

    def scenarios(self) -> tuple[UnitsScenario, ...]:
        """Return the scenario of each flight."""
        found: list[UnitsScenario] = []
        for place, period in enumerate(self.flown, 1):
            for flight in range(period.flights):
                start_ns = iso_to_utc_ns(period.first_utc)[0] + round(flight * period.every_days * NS_PER_DAY)
                found.append(
                    UnitsScenario(
                        name=f"{self.name}-{place:02d}-{flight + 1:03d}",
                        seed=self.seed,
                        run=len(found),
                        aircraft=period.aircraft,
                        serials=period.serials,
                        start_utc=utc_ns_to_iso(start_ns),
                        flown=UnitsSettings(
                            units=len(period.serials),
                            route=self.route,
                            duration_s=self.duration_s,
                            step_s=self.step_s,
                            faults=period.faults(flight),
                        ),
                    )
                )
        return tuple(found)


def units_fleet_names() -> tuple[str, ...]:
    """Names of the shipped fleets, in alphabetical order.

    Examples
    --------
    >>> units_fleet_names()
    ('ins-fleet', 'ins-fleet-odd')
    """
    return _FLEETS.names()


def load_units_fleet(name_or_path: str | Path) -> UnitsFleet:
    """Load a shipped fleet by name, or the user's file (``.toml``) by its path.

    Raises
    ------
    SettingsError
        Naming the file and the key that cannot be used.

    Examples
    --------
    >>> len(load_units_fleet("ins-fleet").scenarios())
    32
    """
    file = _FLEETS.read(name_or_path)
    table: dict[str, Any] = {"name": file.name} | file.table
    return settings_from(UnitsFleet, table, file.where)


def write_units_fleet(fleet: UnitsFleet, folder: str | Path, seed: int | None = None) -> list[Path]:
    """Simulate the flights of a fleet and write their logs."""
    return [write_units(one, folder, seed) for one in fleet.scenarios()]
