"""Chapters of the flight report, in its order, with their figures drawn."""

from dataclasses import replace
from pathlib import Path

from groundstation.chapters import chapters_of
from groundstation.chapters.cooperative import is_session
from groundstation.chapters.findings import findings
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Note, Section
from groundstation.chapters.plan import is_plan
from groundstation.chapters.provenance import provenance
from groundstation.chapters.quality import quality
from groundstation.reports.figures import with_drawings
from groundstation.results.files import SavedFlight

ON_THE_FLIGHT = (overview, quality, findings, provenance)  # behind the chapters on its answers
ON_THE_SESSION = (findings, provenance)  # and of a plan


def flight_sections(saved: SavedFlight) -> tuple[Section, ...]:
    """The chapters of a flight: those on its answers, then the flight itself, its data and findings, its source.

    Of a session of several aircraft, and of a plan: those on its answers, its findings, its source.

    A chapter that has nothing to say is left out, and one of nothing but figures without arrays.
    """
    results = saved.results
    on_the_rest = ON_THE_SESSION if is_session(results) or is_plan(results) else ON_THE_FLIGHT
    told = (*chapters_of(results), *(build(results) for build in on_the_rest))
    drawn = (on_a_page(section, saved) for section in told if section is not None)
    return tuple(section for section in drawn if section.parts)


def on_a_page(section: Section, saved: SavedFlight) -> Section:
    """The section as a report shows it: its figures drawn, of the files beside the report those that are there."""
    drawn = with_drawings(section, saved.results)
    parts = (
        _of_files_there(part, saved.folder) if isinstance(part, Note) and part.files else part for part in drawn.parts
    )
    return replace(drawn, parts=tuple(part for part in parts if part is not None))


def _of_files_there(note: Note, folder: Path) -> Note | None:
    files = [name for name in note.files if (folder / name).is_file()]
    return replace(note, files=files) if files else None
