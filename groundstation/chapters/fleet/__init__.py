"""Chapters of the fleet report: ``build(fleet)`` gives a Section, or None when there is nothing to say."""

from collections.abc import Callable

from groundstation.chapters.fleet import (
    aircraft,
    calibration,
    densities,
    deviation,
    flights,
    rest,
    sessions,
    skill,
    trend,
)
from groundstation.chapters.parts import Section
from groundstation.results.fleet import FleetResults

CHAPTERS: tuple[Callable[[FleetResults], Section | None], ...] = (
    flights.build,
    sessions.build,
    densities.build,
    aircraft.heading,
    trend.build,
    aircraft.ins,
    skill.build,
    calibration.build,
    deviation.build,
    rest.outliers,
    rest.not_in_fleet,
    rest.method,
)
