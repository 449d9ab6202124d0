"""Scenarios of plans: the shipped ones, by name, and a user's own."""

from pathlib import Path
from typing import Generic

from groundstation.base.dataclasses import dataclass
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import settings_from
from groundstation.systems.plan import Plan, ScenarioT


@dataclass(frozen=True)
class LoadedPlan(Generic[ScenarioT]):
    """A scenario, its name, and the text of its file."""

    name: str
    text: str
    scenario: ScenarioT


def plan_names(plan: Plan[ScenarioT]) -> tuple[str, ...]:
    """Return names of the shipped scenarios of a kind of plan."""
    return _shipped(plan).names()


def load_plan(plan: Plan[ScenarioT], name_or_path: str | Path) -> LoadedPlan[ScenarioT]:
    """Load a shipped scenario by name, or a user's by the path of its TOML file.

    Raises
    ------
    SettingsError
        For an unknown name, a file that cannot be read, an unknown key or a value out of range.
    """
    file = _shipped(plan).read(name_or_path)
    return LoadedPlan(file.name, file.text, settings_from(plan.scenario, file.table, file.where))


def _shipped(plan: Plan[ScenarioT]) -> ShippedToml:
    return ShippedToml("groundstation", f"plans/{plan.name}", f"plan of a {plan.name}")
