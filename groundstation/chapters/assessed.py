"""A chapter without an answer: the reason why there is none."""

from groundstation.chapters.parts import Note, Section
from groundstation.results.flight import FlightResults
from groundstation.results.reasons import explained


def reason_of(results: FlightResults, analysis: str) -> str:
    """Why an analysis could not be carried out, in plain words; empty where nothing is said about it."""
    reasons = results.reasons(analysis)
    return explained(analysis, reasons[0]) if reasons else ""


def without_answer(results: FlightResults, analysis: str, title: str, lead: str) -> Section | None:
    """The chapter of an analysis that has no answer; None where no reason is known."""
    reason = reason_of(results, analysis)
    return Section(analysis, title, lead, (Note(f"Not assessable: {reason}", "unknown"),)) if reason else None
