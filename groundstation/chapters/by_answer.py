"""Chapters on the answers of a flight, a session or a plan, in the order of the report."""

from collections.abc import Iterable

from groundstation.base.failures import attempt
from groundstation.chapters.chapter import Chapter, Chapters
from groundstation.chapters.generic import generic
from groundstation.chapters.parts import Rank, Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults


def answer_chapters(results: FlightResults, chapters: Chapters) -> tuple[Section, ...]:
    """Build the chapters of a flight that have an answer, the best first."""
    listed = [chapter for chapter in chapters.flight if any(map(results.answer, chapter.answers))]
    every = (one for one in (*_built(listed, results), *_generic(results, chapters)) if one is not None)
    return tuple(sorted(every, key=_place))


def dangers(results: FlightResults, chapters: Chapters) -> frozenset[str]:
    """Return the names of the analyses whose chapters tell of a danger."""
    listed = [chapter for chapter in chapters.flight if any(map(results.answer, chapter.answers))]
    sections = zip(listed, _built(listed, results), strict=True)
    claims = ((one.name, section.claim) for one, section in sections if section is not None)
    return frozenset(name for name, claim in claims if claim is not None and claim.is_danger)


def _place(section: Section) -> tuple[bool, Rank]:
    return (True, Rank.OTHER) if section.claim is None else section.claim.place


def chapters_of(results: FlightResults, chapters: Chapters) -> tuple[Section, ...]:
    """Build the chapters on all answers: their own, then a generic one for every other.

    First those written for an answer, then a generic one for each other answer. A chapter of a flight without its
    answer says why there is none.
    """
    every = (*_built(chapters.of(results), results), *_generic(results, chapters))
    return tuple(section for section in every if section is not None)


def _built(chapters: Iterable[Chapter], results: FlightResults) -> tuple[Section | None, ...]:
    """Build chapters, None for those with nothing to say and those that fail."""
    return tuple(attempt("chapter", one.name, one.build, results) for one in chapters)


def _generic(results: FlightResults, chapters: Chapters) -> tuple[Section | None, ...]:
    """Build the generic chapters of answers that have none of their own."""
    left = without_chapter(results, chapters)
    return tuple(attempt("chapter", one.analysis, generic, results, one) for one in left)


def chapter_of(results: FlightResults, answer: Answer, chapters: Chapters) -> Section:
    """Build the chapter that tells an answer: its own, else the generic one."""
    listed = (*chapters.flight, *chapters.session)
    own = (one.build(results) for one in listed if isinstance(answer, one.answers))
    return next((section for section in own if section is not None), None) or generic(results, answer)


def without_chapter(results: FlightResults, chapters: Chapters) -> tuple[Answer, ...]:
    """Return the answers that no chapter of its own tells."""
    return tuple(answer for answer in results.answers.values() if not isinstance(answer, chapters.told))
