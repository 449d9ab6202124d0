"""Chapters of the flight report, in its order, with their figures drawn.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its chapter to
:data:`CHAPTERS`.
"""

from collections.abc import Callable

from groundstation.chapters.findings import findings
from groundstation.chapters.heading import heading as heading_chapter
from groundstation.chapters.latency import latency
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Section
from groundstation.chapters.provenance import provenance
from groundstation.chapters.quality import quality
from groundstation.reports.figures import with_drawings
from groundstation.reports.sections import forecast, inertial, magnetic
from groundstation.results.chosen import chosen_intervals
from groundstation.results.files import SavedFlight
from groundstation.results.flight import FlightResults


def _drawn(tell: Callable[[FlightResults], Section | None]) -> Callable[[SavedFlight], Section | None]:
    """A chapter of the results alone; None where it has nothing to say, or nothing but figures without arrays."""

    def build(saved: SavedFlight) -> Section | None:
        told = tell(saved.results)
        drawn = None if told is None else with_drawings(told, saved.results)
        return drawn if drawn is not None and drawn.parts else None

    return build


def _heading(saved: SavedFlight) -> Section:
    return with_drawings(heading_chapter(saved.results, chosen_intervals(saved.manifest)), saved.results)


CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    _heading,
    inertial.build,
    forecast.build,
    _drawn(latency),
    magnetic.build,
    _drawn(overview),
    _drawn(quality),
    _drawn(findings),
    _drawn(provenance),
)
