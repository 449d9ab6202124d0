"""Chapters of the flight report, in its order, with their figures drawn.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its chapter to
:data:`CHAPTERS`.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from groundstation.chapters.cooperative import cooperative
from groundstation.chapters.findings import findings
from groundstation.chapters.heading import heading as heading_chapter
from groundstation.chapters.latency import latency
from groundstation.chapters.magnetic import magnetic
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Note, Section
from groundstation.chapters.provenance import provenance
from groundstation.chapters.quality import quality
from groundstation.reports.figures import with_drawings
from groundstation.reports.sections import forecast, inertial
from groundstation.results.chosen import chosen_intervals
from groundstation.results.files import SavedFlight
from groundstation.results.flight import FlightResults


def _drawn(tell: Callable[[FlightResults], Section | None]) -> Callable[[SavedFlight], Section | None]:
    """A chapter of the results alone; None where it has nothing to say, or nothing but figures without arrays."""

    def build(saved: SavedFlight) -> Section | None:
        drawn = on_a_page(tell(saved.results), saved)
        return drawn if drawn is not None and drawn.parts else None

    return build


def on_a_page(section: Section | None, saved: SavedFlight) -> Section | None:
    """The section as a report shows it: its figures drawn, of the files beside the report those that are there."""
    if section is None:
        return None
    drawn = with_drawings(section, saved.results)
    parts = (
        _of_files_there(part, saved.folder) if isinstance(part, Note) and part.files else part for part in drawn.parts
    )
    return replace(drawn, parts=tuple(part for part in parts if part is not None))


def _of_files_there(note: Note, folder: Path) -> Note | None:
    files = [name for name in note.files if (folder / name).is_file()]
    return replace(note, files=files) if files else None


def _heading(saved: SavedFlight) -> Section:
    return with_drawings(heading_chapter(saved.results, chosen_intervals(saved.manifest.configuration)), saved.results)


CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    _heading,
    inertial.build,
    forecast.build,
    _drawn(latency),
    _drawn(magnetic),
    _drawn(overview),
    _drawn(quality),
    _drawn(findings),
    _drawn(provenance),
)
# Of a session of several aircraft.
SESSION_CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    _drawn(cooperative),
    _drawn(findings),
    _drawn(provenance),
)
