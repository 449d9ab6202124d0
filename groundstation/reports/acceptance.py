"""Acceptance report: a page and a PDF ready to sign, from an acceptance alone."""

from pathlib import Path

from groundstation.base.failures import attempt, gathered_failures
from groundstation.chapters import acceptance as chapters
from groundstation.chapters.acceptance_front import front
from groundstation.chapters.parts import Document
from groundstation.chapters.plots.acceptance import JUDGED
from groundstation.reports.drawing import drawn_by
from groundstation.reports.flight_report import ACCEPTANCE, Written, flight_report_html, write_pages
from groundstation.results.acceptance import Acceptance


def write_acceptance_report(page: Path, found: Acceptance) -> Written:
    """Write the page and, beside it, the PDF; equal acceptances give equal bytes.

    Raises
    ------
    OSError
        When a file cannot be written.
    """
    beside = page.with_suffix(".json").name
    with gathered_failures():
        document = acceptance_document(found)
        return write_pages(page, lambda shown: flight_report_html(shown, beside), document, document, with_pdf=True)


def acceptance_document(found: Acceptance) -> Document:
    """Put the report of an acceptance together, its figures drawn."""
    drawn = (attempt("chapter", one.key, drawn_by, JUDGED, one, found) for one in chapters.sections(found))
    sections = tuple(section for section in drawn if section is not None)
    return Document(ACCEPTANCE, f"{ACCEPTANCE} {found.name}", front(found), sections)
