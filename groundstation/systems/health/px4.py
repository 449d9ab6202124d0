"""Evidence of a PX4 log, old and new topics, and what it says happened."""

from collections.abc import Iterator, Mapping
from itertools import chain

import numpy as np

from groundstation.systems.health.evidence import Event, Evidence, Grade
from groundstation.systems.health.messages import texts
from groundstation.systems.health.px4_control import CHANGED, control_evidence
from groundstation.systems.health.px4_estimator import RESETS, RESETS_OF_OUTPUT, estimator_evidence, resets_of
from groundstation.systems.health.px4_sensors import sensor_evidence
from groundstation.systems.health.px4_topics import Topic, estimators, topic
from groundstation.tables.table import Flight

OWN = (
    "raw.vehicle_status",
    "raw.estimator_status",
    "raw.vehicle_attitude",
    "raw.sensor_combined",
    "raw.vehicle_gps_position",
)
MODES: Mapping[int, str] = {
    0: "Manual",
    1: "Altitude",
    2: "Position",
    3: "Mission",
    4: "Hold",
    5: "Return",
    6: "Position slow",
    10: "Acro",
    12: "Descend",
    13: "Termination",
    14: "Offboard",
    15: "Stabilized",
    17: "Take-off",
    18: "Land",
    19: "Follow target",
    20: "Precision land",
    21: "Orbit",
    22: "VTOL take-off",
}


def applies(flight: Flight) -> bool:
    """Tell whether the log is of PX4."""
    return any(name in flight for name in OWN)


def evidence(flight: Flight) -> tuple[Evidence, ...]:
    """Return what the log holds of the autopilot's health."""
    return tuple(chain(estimator_evidence(flight), sensor_evidence(flight), control_evidence(flight)))


def events(flight: Flight) -> tuple[Event, ...]:
    """Return what happened, by time.

    Messages are graded by their own level; then changes of mode and arming, resets and switches.
    """
    found = chain(texts(flight), _modes(flight), _resets(flight), _switches(flight))
    return tuple(sorted(found, key=lambda one: one.time_ns))


def _modes(flight: Flight) -> Iterator[Event]:
    status = topic(flight, "vehicle_status")
    if status is None:
        return
    for row in _changes(status, "nav_state"):
        number = int(status.values("nav_state")[row])
        name = MODES.get(number, f"external {number - 22}" if number >= 23 else f"number {number}")
        yield Event("modes", int(status.time_ns[row]), "info", f"mode {name}", status.source("nav_state"))
    for row in _changes(status, "arming_state"):
        text = "armed" if status.values("arming_state")[row] == 2.0 else "disarmed"
        yield Event("modes", int(status.time_ns[row]), "info", text, status.source("arming_state"))


def _changes(one: Topic, field: str) -> list[int]:
    """Return the first row with a value, and each in which it is another."""
    value = one.values(field)
    known = np.flatnonzero(np.isfinite(value))
    if not known.size:
        return []
    return [int(row) for row in known[np.concatenate([[True], np.diff(value[known]) != 0.0])]]


def _resets(flight: Flight) -> Iterator[Event]:
    position = topic(flight, "vehicle_local_position")
    places: list[tuple[Topic, Mapping[str, str]]] = [(one, RESETS) for one, _ in estimators(flight, "estimator_status")]
    if not any(one.has(*RESETS) for one, _ in places) and position is not None:
        places = [(position, RESETS_OF_OUTPUT)]
    for one, fields in places:
        for field, what in fields.items():
            for row, is_by_design in zip(*resets_of(one, field), strict=True):
                grade: Grade = "info" if is_by_design else "warn"
                text = "heading aligned in flight" if is_by_design else f"{what} reset"
                yield Event("resets", int(one.time_ns[row]), grade, text, one.source(field))


def _switches(flight: Flight) -> Iterator[Event]:
    for name, field, what in CHANGED:
        one = topic(flight, name)
        if one is not None and one.has(field):
            for row in _changes(one, field)[1:]:
                yield Event("switches", int(one.time_ns[row]), "warn", f"{what} switched", one.source(field))
