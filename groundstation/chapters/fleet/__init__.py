"""Chapters of the fleet report.

``build(fleet)`` returns a Section, or None when there is nothing to say.
"""

from collections.abc import Callable

from groundstation.chapters.fleet import (
    aircraft,
    calibration,
    densities,
    deviation,
    flights,
    installations,
    rest,
    sessions,
    skill,
    trend,
)
from groundstation.chapters.parts import Section
from groundstation.results.fleet import FleetResults

CHAPTERS: dict[str, Callable[[FleetResults], Section | None]] = {
    "flights": flights.build,
    "sessions": sessions.build,
    "densities": densities.build,
    "heading": aircraft.heading,
    "installations": installations.build,
    "trend": trend.build,
    "ins": aircraft.ins,
    "skill": skill.build,
    "calibration": calibration.build,
    "deviation": deviation.build,
    "outliers": rest.outliers,
    "not_in_fleet": rest.not_in_fleet,
    "method": rest.method,
}
