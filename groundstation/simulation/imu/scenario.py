"""Scenarios of logs of an inertial unit: shipped ones and the user's, as TOML."""

from dataclasses import field
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import check_ranges, number, settings_from
from groundstation.simulation.imu.families import FAMILIES, Family
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.imu_class import load_imu_class
from groundstation.simulation.imu.settings import ImuSettings

_SCENARIOS = ShippedToml("groundstation.simulation.imu", "scenarios", "scenario")


@dataclass(frozen=True)
class ImuScenario:
    """Everything that determines a simulated log of an inertial unit with GNSS.

    ``truth_rate_hz`` is the rate of the truth in the log, 0 for none.
    """

    family: Family
    name: str = "imu"
    title: str = ""
    seed: int = number(1, 0)
    aircraft: str = "SIM-IMU"
    start_utc: str = "2026-05-04T06:00:00Z"
    truth_rate_hz: float = number(10.0, 0.0, 1000.0)
    unit: ImuSettings = field(default_factory=ImuSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
        if iso_to_utc_ns(self.start_utc)[0] < 0:
            raise SettingsError("start_utc", self.start_utc, "a date after 1970")

    @property
    def start_utc_ns(self) -> int:
        """UTC of log second 0, nanoseconds since 1970."""
        return iso_to_utc_ns(self.start_utc)[0]


def imu_scenario_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, in alphabetical order.

    Examples
    --------
    >>> imu_scenario_names()
    ('imu-drive', 'imu-hard', 'imu-hover', 'imu-in-flight', 'imu-uav')
    """
    return _SCENARIOS.names()


def load_imu_scenario(name_or_path: str | Path) -> ImuScenario:
    """Load a shipped scenario by name, or the user's file (``.toml``) by its path.

    Raises
    ------
    SettingsError
        Naming the file and the key that cannot be used.

    Examples
    --------
    >>> load_imu_scenario("imu-hover").unit.rate_hz
    250.0
    """
    file = _SCENARIOS.read(name_or_path)
    table: dict[str, Any] = {"name": file.name} | file.table
    if table.get("family") not in FAMILIES:
        raise SettingsError(f"{file.where}, key family", repr(table.get("family")), f"one of {', '.join(FAMILIES)}")
    scenario = settings_from(ImuScenario, table, file.where)
    load_imu_class(scenario.unit.imu_class)
    return scenario


def fly(scenario: ImuScenario, seed: int | None = None) -> ImuFlight:
    """Simulate a scenario, with a seed in place of its own where one is given."""
    return simulate_imu(
        scenario.family,
        scenario.seed if seed is None else seed,
        settings=scenario.unit,
        start_utc_ns=scenario.start_utc_ns,
    )
