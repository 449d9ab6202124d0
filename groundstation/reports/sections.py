"""Chapters of the flight report, in its order, with their figures drawn."""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from string import ascii_uppercase
from typing import Any

from groundstation.base.failures import attempt
from groundstation.chapters.by_answer import answer_chapters, chapters_of
from groundstation.chapters.chapter import Chapters
from groundstation.chapters.findings import findings
from groundstation.chapters.next_steps import next_steps
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Facts, Grid, Note, Part, Section, kept
from groundstation.chapters.provenance import provenance, sources
from groundstation.chapters.quality import quality
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.files import SavedFlight
from groundstation.results.flight import FlightResults
from groundstation.systems.system import Systems

Build = Callable[[FlightResults], Section | None]
BuildWithChapters = Callable[[FlightResults, Chapters], Section | None]
BEFORE_THE_ANSWERS: dict[str, BuildWithChapters] = {
    "overview": lambda results, _: overview(results),
    "next_steps": next_steps,
}
ON_THE_DATA: dict[str, Build] = {"findings": findings, "quality": quality}  # behind the chapters on the answers
ON_THE_SESSION: dict[str, Build] = {"findings": findings, "provenance": provenance}  # and of a plan
APPENDICES: dict[str, BuildWithChapters] = {
    "provenance": lambda results, _: provenance(results),
    "sources": sources,
}


def flight_sections(
    saved: SavedFlight, systems: Systems, answers: Sequence[Section] | None = None
) -> tuple[Section, ...]:
    """Return the chapters and appendices of a flight's report.

    The flight itself, what to do next, its answers, the best first, its data. Of a session of several aircraft, and of
    a plan: those on its answers, its findings, its source.

    A chapter that has nothing to say is left out, one of nothing but figures without arrays, and one that fails.
    """
    chapters, appendices = told_sections(saved, systems, answers)
    numbered = _numbered(chapters, saved, systems, count(1))
    return (*numbered, *_numbered(appendices, saved, systems, ascii_uppercase))


def told_sections(
    saved: SavedFlight, systems: Systems, answers: Sequence[Section] | None = None
) -> tuple[list[Section], list[Section]]:
    """Return the chapters and appendices of a report, no figure drawn.

    ``answers`` are the chapters on the answers of a flight where they are built already.
    """
    results = saved.results
    is_flight = not (results.is_session or results.is_plan)
    if is_flight and answers is None:
        answers = answer_chapters(results, systems.chapters)
    told = (
        (
            *_built_with_chapters(BEFORE_THE_ANSWERS, results, systems.chapters),
            *(answers or ()),
            *_built(ON_THE_DATA, results),
        )
        if is_flight
        else (*chapters_of(results, systems.chapters), *_built(ON_THE_SESSION, results))
    )
    chapters = [section for section in told if section is not None]
    workings = (_workings(section, saved.manifest.configuration) for section in chapters)
    appendices = [*workings, *(_built_with_chapters(APPENDICES, results, systems.chapters) if is_flight else ())]
    shown = [replace(section, appendix=()) for section in chapters if not section.is_open]
    return shown, [section for section in appendices if section is not None]


def _built(builds: Mapping[str, Build], results: FlightResults) -> tuple[Section | None, ...]:
    return tuple(attempt("chapter", name, build, results) for name, build in builds.items())


def _built_with_chapters(
    builds: Mapping[str, BuildWithChapters], results: FlightResults, chapters: Chapters
) -> tuple[Section | None, ...]:
    return tuple(attempt("chapter", name, build, results, chapters) for name, build in builds.items())


def _numbered(
    sections: Sequence[Section], saved: SavedFlight, systems: Systems, numbers: Iterable[object]
) -> tuple[Section, ...]:
    """The sections as a page shows them, those without parts left out."""
    drawn = (attempt("chapter", section.key, on_a_page, section, saved, systems) for section in sections)
    shown = (section for section in drawn if section is not None and section.parts)
    return tuple(replace(section, number=str(number)) for section, number in zip(shown, numbers, strict=False))


def _workings(section: Section, configuration: Mapping[str, Any]) -> Section:
    """Return the part of a chapter that belongs in the appendix.

    Settings are cut down to those that the user set.
    """
    every = (*section.parts, *section.appendix) if section.is_open else section.appendix
    parts = kept(_as_set(part, configuration) for part in every)
    return Section(f"{section.key}-workings", f"{section.title}: workings", "", parts)


def _as_set(part: Part, configuration: Mapping[str, Any]) -> Part | None:
    """Cut settings down to those that the user set, None where there is none.

    Any other part stays as it is.
    """
    if not isinstance(part, Facts) or not part.settings_of:
        return part
    given = configuration.get(part.settings_of)
    pairs = [pair for pair in part.pairs if isinstance(given, Mapping) and pair[0].partition(".")[0] in given]
    return replace(part, pairs=pairs) if pairs else None


def on_a_page(section: Section, saved: SavedFlight, systems: Systems) -> Section:
    """Return a section as a report shows it.

    Its figures are drawn; of the files beside the report, and of the tables behind it, it names those that exist.
    """
    drawn = drawn_by(systems.plots, section, saved.results)
    tables = frozenset(saved.results.figure_names)
    parts = (
        _of_files_there(part, saved.folder) if isinstance(part, Note) and part.files else with_tables_of(tables, part)
        for part in drawn.parts
    )
    return replace(drawn, parts=tuple(part for part in parts if part is not None))


def with_tables_of(known: Container[str], part: Part) -> Part:
    """Return a part that names, of the tables behind it, those that the flight has."""
    if not isinstance(part, Grid | Drawing):
        return part
    return replace(part, numbers=tuple(name for name in part.numbers if name in known))


def _of_files_there(note: Note, folder: Path) -> Note | None:
    files = [name for name in note.files if (folder / name).is_file()]
    return replace(note, files=files) if files else None
