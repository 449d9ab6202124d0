"""Chapters of the flight report, in its order, with their figures drawn.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its chapter to
:data:`CHAPTERS`.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from groundstation.chapters.findings import findings
from groundstation.chapters.forecast import forecast
from groundstation.chapters.heading import heading
from groundstation.chapters.inertial import inertial
from groundstation.chapters.latency import latency
from groundstation.chapters.magnetic import magnetic
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Note, Section
from groundstation.chapters.provenance import provenance
from groundstation.chapters.quality import quality
from groundstation.reports.figures import with_drawings
from groundstation.results.chosen import chosen_intervals
from groundstation.results.files import SavedFlight
from groundstation.results.flight import FlightResults

Chapter = Callable[[SavedFlight], Section | None]


def on_a_page(section: Section | None, saved: SavedFlight) -> Section | None:
    """The section as a report shows it: its figures drawn, of the files beside the report those that are there.

    None where nothing is left: there were figures alone, and no arrays.
    """
    if section is None:
        return None
    drawn = with_drawings(section, saved.results)
    parts = (
        _of_files_there(part, saved.folder) if isinstance(part, Note) and part.files else part for part in drawn.parts
    )
    shown = tuple(part for part in parts if part is not None)
    return replace(drawn, parts=shown) if shown else None


def _of_files_there(note: Note, folder: Path) -> Note | None:
    files = [name for name in note.files if (folder / name).is_file()]
    return replace(note, files=files) if files else None


def _page(chapter: Callable[[FlightResults], Section | None]) -> Chapter:
    return lambda saved: on_a_page(chapter(saved.results), saved)


def _heading(saved: SavedFlight) -> Section | None:
    return on_a_page(heading(saved.results, chosen_intervals(saved.manifest.configuration)), saved)


CHAPTERS: tuple[Chapter, ...] = (
    _heading,
    _page(inertial),
    _page(forecast),
    _page(latency),
    _page(magnetic),
    _page(overview),
    _page(quality),
    _page(findings),
    _page(provenance),
)
