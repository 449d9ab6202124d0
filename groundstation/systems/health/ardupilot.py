"""Evidence of health in the logs of ArduPilot (DataFlash), old and new."""

from groundstation.systems.health import ardupilot_control, ardupilot_filter, ardupilot_sensors
from groundstation.systems.health.evidence import Event, Evidence
from groundstation.systems.health.messages import events as message_events
from groundstation.tables.table import Flight

_EVIDENCE = (
    ardupilot_filter.evidence,
    ardupilot_sensors.gnss,
    ardupilot_sensors.receivers,
    ardupilot_sensors.receiver_switches,
    ardupilot_sensors.vibration,
    ardupilot_sensors.magnetometers,
    ardupilot_sensors.inertial,
    ardupilot_sensors.timing,
    ardupilot_control.battery,
    ardupilot_control.link,
    ardupilot_control.tracking,
    ardupilot_control.saturation,
)
_EVENTS = (ardupilot_filter.events, ardupilot_sensors.receiver_events, message_events)


def applies(flight: Flight) -> bool:
    """Tell whether a flight is from a DataFlash log: all of them define their messages."""
    return "raw.FMT" in flight and ("raw.PARM" in flight or "raw.ATT" in flight or "raw.MSG" in flight)


def evidence(flight: Flight) -> tuple[Evidence, ...]:
    """Return what was logged of the aircraft's health."""
    return tuple(one for of_kind in _EVIDENCE for one in of_kind(flight) if len(one.time_ns))


def events(flight: Flight) -> tuple[Event, ...]:
    """Return what happened, in order of time."""
    every = [one for of_kind in _EVENTS for one in of_kind(flight)]
    return tuple(sorted(every, key=lambda one: one.time_ns))
