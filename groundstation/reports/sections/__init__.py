"""Chapters of the flight report: one module each.

``build(saved)`` gives a Section, or None when there is nothing to say. A later system adds its module here and its name
to :data:`CHAPTERS`.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from groundstation.chapters.forecast import forecast
from groundstation.chapters.inertial import inertial
from groundstation.chapters.latency import latency
from groundstation.chapters.magnetic import magnetic
from groundstation.chapters.parts import Note, Section
from groundstation.reports.figures import with_drawings
from groundstation.reports.sections import (
    findings,
    heading,
    overview,
    provenance,
    quality,
)
from groundstation.results.files import SavedFlight


def _inertial(saved: SavedFlight) -> Section | None:
    return on_a_page(inertial(saved.results), saved)


def _forecast(saved: SavedFlight) -> Section | None:
    return on_a_page(forecast(saved.results), saved)


def _latency(saved: SavedFlight) -> Section | None:
    return on_a_page(latency(saved.results), saved)


def _magnetic(saved: SavedFlight) -> Section | None:
    return on_a_page(magnetic(saved.results), saved)


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


CHAPTERS: tuple[Callable[[SavedFlight], Section | None], ...] = (
    heading.build,
    _inertial,
    _forecast,
    _latency,
    _magnetic,
    overview.build,
    quality.build,
    findings.build,
    provenance.build,
)
