"""Autopilots whose logs are known, each with the source of its evidence."""

from collections.abc import Callable

from groundstation.base.dataclasses import dataclass
from groundstation.systems.health import ardupilot, mavlink, px4
from groundstation.systems.health.evidence import Event, Evidence
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class Autopilot:
    """One kind of autopilot's log."""

    name: str
    applies: Callable[[Flight], bool]
    evidence: Callable[[Flight], tuple[Evidence, ...]]
    events: Callable[[Flight], tuple[Event, ...]]


AUTOPILOTS = (
    Autopilot("PX4", px4.applies, px4.evidence, px4.events),
    Autopilot("ArduPilot", ardupilot.applies, ardupilot.evidence, ardupilot.events),
    Autopilot("MAVLink telemetry", mavlink.applies, mavlink.evidence, mavlink.events),
)


def autopilot_of(flight: Flight) -> Autopilot | None:
    """Return the autopilot that wrote a log, None where it is none that is known."""
    return next((one for one in AUTOPILOTS if one.applies(flight)), None)
