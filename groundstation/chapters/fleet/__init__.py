"""Chapters of the fleet report that speak of all flights; those of one system stand in its folder."""

from groundstation.chapters.fleet import (
    aircraft,
    calibration,
    densities,
    flights,
    installations,
    rest,
    skill,
    trend,
)
from groundstation.chapters.fleet.chapter import FleetChapter
from groundstation.results.fleet import FleetResults


def _has_changes(fleet: FleetResults) -> bool:
    return bool(fleet.change_points)


def _has_outliers(fleet: FleetResults) -> bool:
    return bool(fleet.outliers)


def _has_checks(fleet: FleetResults) -> bool:
    return bool(fleet.calibration)


CHAPTERS = (
    FleetChapter("flights", 0, flights.build),
    FleetChapter("densities", 200, densities.build),
    FleetChapter("heading", 300, aircraft.heading, "aircraft", figures=aircraft.heading_figures),
    FleetChapter("installations", 400, installations.build),
    FleetChapter("trend", 500, trend.build, "aircraft", _has_changes),
    FleetChapter("ins", 600, aircraft.ins, figures=aircraft.ins_figures),
    FleetChapter("skill", 650, skill.build, figures=skill.figures),
    FleetChapter("calibration", 700, calibration.build, "aircraft", _has_checks, calibration.figures),
    FleetChapter("outliers", 900, rest.outliers, "aircraft", _has_outliers),
    FleetChapter("not_in_fleet", 910, rest.not_in_fleet),
    FleetChapter("method", 920, rest.method),
)
