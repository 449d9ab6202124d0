"""Scenarios of flights with several units: shipped ones and the user's, as TOML."""

from dataclasses import field
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import check_ranges, number, settings_from
from groundstation.simulation.ins_class import load_ins_class
from groundstation.simulation.ins_units.settings import UnitsSettings

_SCENARIOS = ShippedToml("groundstation.simulation.ins_units", "scenarios", "scenario")


@dataclass(frozen=True)
class UnitsScenario:
    """Everything that determines the log of a flight with several units.

    ``serials`` are those of the units in place of the usual ones; an empty one is not stated.
    """

    name: str = "units"
    title: str = ""
    seed: int = number(1, 0)
    run: int = number(0, 0)
    aircraft: str = "SIM-UNITS"
    start_utc: str = "2026-05-04T06:00:00Z"
    serials: tuple[str, ...] = ()
    with_truth: bool = False
    flown: UnitsSettings = field(default_factory=UnitsSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
        if iso_to_utc_ns(self.start_utc)[0] < 0:
            raise SettingsError("start_utc", self.start_utc, "a date after 1970")

    @property
    def start_utc_ns(self) -> int:
        """UTC of flight second 0, nanoseconds since 1970."""
        return iso_to_utc_ns(self.start_utc)[0]

    @property
    def log_name(self) -> str:
        """Name of the log."""
        return f"{self.name}.csv"


def units_scenario_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, in alphabetical order.

    Examples
    --------
    >>> "units-three" in units_scenario_names()
    True
    """
    return _SCENARIOS.names()


def load_units_scenario(name_or_path: str | Path) -> UnitsScenario:
    """Load a shipped scenario by name, or the user's file (``.toml``) by its path.

    Raises
    ------
    SettingsError
        Naming the file and the key that cannot be used.

    Examples
    --------
    >>> load_units_scenario("units-three").flown.units
    3
    """
    file = _SCENARIOS.read(name_or_path)
    table: dict[str, Any] = {"name": file.name} | file.table
    scenario = settings_from(UnitsScenario, table, file.where)
    if isinstance(scenario.flown.ins, str):
        load_ins_class(scenario.flown.ins)
    if scenario.flown.ins_of_others:
        load_ins_class(scenario.flown.ins_of_others)
    return scenario
