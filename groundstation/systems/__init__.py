"""The systems of the ground station: one folder each, with everything that belongs to it.

Ours are a line each below. Other people's come by entry points of the group ``groundstation.systems``: the object is
a :class:`System`. One that fails is a line of text and never hides the others.
"""

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from groundstation.systems.system import Systems

ENTRY_POINT_GROUP = "groundstation.systems"
OURS = (  # in the order they are shown
    "groundstation.systems.heading.system",
    "groundstation.systems.inertial.system",
    "groundstation.systems.latency.system",
    "groundstation.systems.trajectory.system",
    "groundstation.systems.magnetic.system",
    "groundstation.systems.landing.system",
    "groundstation.systems.health.system",
    "groundstation.systems.several_logs.system",
    "groundstation.systems.reference.system",
    "groundstation.systems.cooperative.system",
    "groundstation.systems.planning.system",
    "groundstation.systems.gnss.system",
)


@cache
def systems() -> "Systems":
    """Return all systems, ours first, then other people's by their names."""
    from groundstation.systems.loading import load_systems

    return load_systems(OURS, ENTRY_POINT_GROUP)


@cache
def systems_for(name: str) -> "Systems":
    """Return our system of that name alone, all systems where none of ours has it.

    What one system serves loads no other.
    """
    path = f"{__name__}.{name}.system"
    if path not in OURS:
        return systems()
    from groundstation.systems.system import Systems

    return Systems((import_module(path).SYSTEM,))
