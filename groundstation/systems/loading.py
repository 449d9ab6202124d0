"""Loading of systems: ours by the paths of their modules, other people's by entry points."""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from groundstation.base.plug_ins import load_plug_ins
from groundstation.systems.system import System, Systems


def load_systems(ours: Sequence[str], group: str) -> Systems:
    """Load our systems by their modules' paths and others by entry points.

    Returns
    -------
    Systems
        With a line for each stranger's system that cannot be used: it raised, is no :class:`System`, or has a name
        that is taken, by a system or by one of its analyses, plans, studies, settings or steps.
    """
    every: list[System] = [import_module(path).SYSTEM for path in ours]

    def take(system: Any) -> str:
        if not isinstance(system, System):
            raise TypeError(f"{type(system).__name__} is no System")
        taken = _names(system) & set().union(*map(_names, every))
        if taken:
            return f"{', '.join(sorted(taken))} is taken"
        every.append(system)
        return ""

    failures = load_plug_ins(group, "system", take)
    return Systems(tuple(every), failures)


def _names(system: System) -> set[str]:
    """Names that must differ between systems, with what they name."""
    analyses = (*system.analyses, *system.session_analyses)
    return {
        f"system {system.name}",
        *(f"analysis {one.name}" for one in analyses),
        *(f"settings table {one.settings_table}" for one in analyses),
        *(f"column {column.name}" for one in analyses for column in one.columns),
        *(f"plan {one.name}" for one in system.plans),
        *(f"study {one.name}" for one in system.studies),
        *(f"step --{step}" for step, made in (("apply", system.apply), ("together", system.join)) if made is not None),
    }
