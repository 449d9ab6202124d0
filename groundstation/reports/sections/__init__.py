"""Chapters of the flight report: one module each.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its module here and its name
to :data:`CHAPTERS`.
"""

from collections.abc import Callable

from groundstation.reports.parts import Section
from groundstation.reports.sections import (
    findings,
    forecast,
    heading,
    inertial,
    latency,
    magnetic,
    overview,
    provenance,
    quality,
)
from groundstation.results.files import SavedFlight

CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    heading.build,
    inertial.build,
    forecast.build,
    latency.build,
    magnetic.build,
    overview.build,
    quality.build,
    findings.build,
    provenance.build,
)
