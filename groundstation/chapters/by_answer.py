"""Chapters on the answers of a flight, a session or a plan, in the order of the report."""

from collections.abc import Iterable
from typing import NamedTuple

from groundstation.base.failures import attempt
from groundstation.chapters.chapter import Chapter, Chapters
from groundstation.chapters.generic import generic
from groundstation.chapters.parts import Claim, Rank, Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults
from groundstation.results.recorded import great_loss


class Told(NamedTuple):
    """Chapter of a flight, and the analyses whose answers it tells."""

    analyses: tuple[str, ...]
    section: Section

    @property
    def place(self) -> tuple[bool, Rank]:
        """Place among the chapters of a flight: that of its claim."""
        return (True, Rank.OTHER) if self.section.claim is None else self.section.claim.place


def answer_chapters(results: FlightResults, chapters: Chapters) -> tuple[Section, ...]:
    """Build the chapters of a flight that have an answer, the best first."""
    return tuple(one.section for one in answers_in_order(results, chapters))


def answers_in_order(results: FlightResults, chapters: Chapters) -> tuple[Told, ...]:
    """Build the chapters on the answers of a flight, in the order of their claims.

    The page of a flight has this order, and so has its line on the terminal.
    """
    listed = [chapter for chapter in chapters.flight if any(map(results.answer, chapter.answers))]
    names = [tuple(answer.analysis for answer in chapter.answers) for chapter in listed]
    own = zip(names, _built(listed, results), strict=True)
    left = without_chapter(results, chapters)
    generic = zip([(one.analysis,) for one in left], _generic(left, results), strict=True)
    found = [Told(names, section) for names, section in (*own, *generic) if section is not None]
    return tuple(sorted(found, key=lambda one: one.place))


def loss_above(results: FlightResults, first: Claim | None) -> str:
    """Return the loss of data that stands above every answer but a danger; empty without one."""
    return "" if first is not None and first.is_danger else great_loss(results)


def chapters_of(results: FlightResults, chapters: Chapters) -> tuple[Section, ...]:
    """Build the chapters on all answers: their own, then a generic one for every other.

    First those written for an answer, then a generic one for each other answer. A chapter of a flight without its
    answer says why there is none.
    """
    left = without_chapter(results, chapters)
    every = (*_built(chapters.of(results), results), *_generic(left, results))
    return tuple(section for section in every if section is not None)


def _built(chapters: Iterable[Chapter], results: FlightResults) -> tuple[Section | None, ...]:
    """Build chapters, None for those with nothing to say and those that fail."""
    return tuple(attempt("chapter", one.name, one.build, results) for one in chapters)


def _generic(answers: Iterable[Answer], results: FlightResults) -> tuple[Section | None, ...]:
    """Build the generic chapters of answers that have none of their own."""
    return tuple(attempt("chapter", one.analysis, generic, results, one) for one in answers)


def chapter_of(results: FlightResults, answer: Answer, chapters: Chapters) -> Section:
    """Build the chapter that tells an answer: its own, else the generic one."""
    listed = (*chapters.flight, *chapters.session)
    own = (one.build(results) for one in listed if isinstance(answer, one.answers))
    return next((section for section in own if section is not None), None) or generic(results, answer)


def without_chapter(results: FlightResults, chapters: Chapters) -> tuple[Answer, ...]:
    """Return the answers that no chapter of its own tells."""
    return tuple(answer for answer in results.answers.values() if not isinstance(answer, chapters.told))
