"""Chapters of the flight report: one module each.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its module here and its name
to :data:`CHAPTERS`.
"""

from collections.abc import Callable

from groundstation.chapters.forecast import forecast
from groundstation.chapters.inertial import inertial
from groundstation.chapters.latency import latency
from groundstation.chapters.parts import Section
from groundstation.reports.figures import with_drawings
from groundstation.reports.sections import (
    findings,
    heading,
    magnetic,
    overview,
    provenance,
    quality,
)
from groundstation.results.files import SavedFlight


def _inertial(saved: SavedFlight) -> Section | None:
    section = inertial(saved.results)
    return None if section is None else with_drawings(section, saved.results)


def _forecast(saved: SavedFlight) -> Section | None:
    section = forecast(saved.results)
    return None if section is None else with_drawings(section, saved.results)


def _latency(saved: SavedFlight) -> Section | None:
    section = latency(saved.results)
    return None if section is None else with_drawings(section, saved.results)


CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    heading.build,
    _inertial,
    _forecast,
    _latency,
    magnetic.build,
    overview.build,
    quality.build,
    findings.build,
    provenance.build,
)
