"""Chapters of the flight report, in its order, with their figures drawn."""

from dataclasses import replace
from pathlib import Path

from groundstation.chapters import chapters_of
from groundstation.chapters.parts import Note, Section
from groundstation.reports.figures import with_drawings
from groundstation.reports.sections import findings, forecast, heading, overview, provenance, quality
from groundstation.results.files import SavedFlight

FORECAST_IS_BEHIND = "inertial"


def flight_sections(saved: SavedFlight) -> tuple[Section, ...]:
    """The chapters of a flight: those on its answers, then the flight itself, its data and findings, its source."""
    told = [on_a_page(section, saved) for section in chapters_of(saved.results)]
    place = sum(section.key == FORECAST_IS_BEHIND for section in told)  # it stands first where there is one
    sections = (
        heading.build(saved),
        *told[:place],
        forecast.build(saved),
        *told[place:],
        *(module.build(saved) for module in (overview, quality, findings, provenance)),
    )
    return tuple(section for section in sections if section is not None)


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
