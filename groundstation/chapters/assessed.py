"""Subjects that could not be assessed, and the reasons in plain words."""

from groundstation.chapters.chapter import Chapters
from groundstation.chapters.generic import titled
from groundstation.chapters.parts import Note, Section
from groundstation.chapters.wording import typeset, words
from groundstation.results.flight import FlightResults
from groundstation.results.gates import in_plain_words


def reason_of(results: FlightResults, analysis: str) -> str:
    """Return why an analysis could not be carried out, in plain words.

    Empty where the results give no reason.
    """
    reasons = results.reasons(analysis)
    return in_plain_words(reasons[0]) if reasons else ""


def not_assessed(results: FlightResults, chapters: Chapters) -> tuple[tuple[str, str], ...]:
    """Return the subject and reason of every analysis that could not be carried out."""
    return tuple(
        (chapters.titles.get(one.analysis) or titled(words(one.analysis)), typeset(in_plain_words(one.reason)))
        for one in results.not_assessable
    )


def without_answer(results: FlightResults, analysis: str, title: str, lead: str) -> Section | None:
    """Return the chapter of an analysis that has no answer; None where no reason is known."""
    reason = reason_of(results, analysis)
    return Section(analysis, title, lead, (Note(f"Not assessable: {reason}", "unknown"),)) if reason else None
