"""Chapters of the fleet report; those of one system stand in its folder."""

from groundstation.chapters.fleet import (
    flights,
    rest,
    trend,
)
from groundstation.chapters.fleet.chapter import FleetChapter
from groundstation.results.fleet import FleetResults


def _has_changes(fleet: FleetResults) -> bool:
    return bool(fleet.change_points or fleet.slopes)


def _has_outliers(fleet: FleetResults) -> bool:
    return bool(fleet.outliers)


CHAPTERS = (
    FleetChapter("flights", 0, flights.build),
    FleetChapter("trend", 500, trend.build, "aircraft", _has_changes),
    FleetChapter("outliers", 900, rest.outliers, "aircraft", _has_outliers),
    FleetChapter("not_in_fleet", 910, rest.not_in_fleet),
    FleetChapter("method", 920, rest.method),
)
