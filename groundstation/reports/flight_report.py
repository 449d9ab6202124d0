"""The report of one flight: one self-contained HTML file and its PDF, made from the saved results alone."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from groundstation.chapters.cooperative import is_session
from groundstation.chapters.front import front
from groundstation.chapters.parts import Document
from groundstation.chapters.plan import is_plan
from groundstation.reports.drawing import Drawing
from groundstation.reports.page import TEMPLATES, live_figures, render
from groundstation.reports.painting import document_begun, with_painted_figures
from groundstation.reports.pdf import PdfError, write_pdf
from groundstation.reports.sections import flight_sections
from groundstation.reports.steer_card import write_exports
from groundstation.results.answer import Answer
from groundstation.results.files import SavedFlight, load, write_text

REPORT = "report.html"
PDF = "report.pdf"
SESSION, PLAN, ACCEPTANCE = "Session report", "Plan", "Acceptance report"
VERDICT_OF = {SESSION: "the session", PLAN: "the plan", ACCEPTANCE: "the INS against the standard"}
_NOT_IN_AN_ID = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True)
class Written:
    """The files of a report; ``problem`` says why there is no PDF where one was asked for."""

    paths: tuple[Path, ...]
    problem: str = ""


def write_flight_report(
    folder: Path, answer_types: Mapping[str, type[Answer]], *, with_pdf: bool = True, painters: int = 1
) -> Written:
    """Write report.html and report.pdf into a flight folder; with a magnetic deviation its table and steer card too.

    Parameters
    ----------
    folder : Path
        Holds summary.json, manifest.json and arrays/: nothing else is read, and equal files give equal bytes
        whatever the time, the host or the number of workers.
    answer_types : mapping of analysis name to dataclass
        What its answers become.
    with_pdf : bool
        Without it there is neither report.pdf nor steer_card.pdf afterwards: those of an earlier run would tell of
        other results.
    painters : int
        Processes that paint the figures, this one among them.

    Raises
    ------
    UnreadableLogError
        When the folder has no saved results.
    """
    with flight_report_begun(folder, answer_types, with_pdf=with_pdf, painters=painters) as finish:
        return finish()


@contextmanager
def flight_report_begun(
    folder: Path, answer_types: Mapping[str, type[Answer]], *, with_pdf: bool = True, painters: int = 1
) -> Iterator[Callable[[], Written]]:
    """Begin a report, parameters as of :func:`write_flight_report`: the other painters paint while this process does
    something else. Yields what finishes it.
    """
    saved = load(folder, answer_types)
    exports, problem = write_exports(saved, with_pdf=with_pdf)  # first: the report links to those that are there
    with document_begun(lambda: sketched_document(saved), painters) as finish:

        def finished() -> Written:
            document = finish()
            written = write_pages(folder / REPORT, flight_report_html(document), document, with_pdf=with_pdf)
            return Written((*written.paths, *exports), "; ".join(filter(None, (written.problem, problem))))

        yield finished


def write_pages(page: Path, html: str, document: Document, *, with_pdf: bool) -> Written:
    """Write a page and, beside it, the document as PDF; a PDF of an earlier run is removed."""
    pdf = page.with_suffix(".pdf")
    write_text(page, html)
    pdf.unlink(missing_ok=True)
    if not with_pdf:
        return Written((page,))
    try:
        write_pdf(document, pdf)
    except PdfError as error:
        return Written((page,), str(error))
    return Written((page, pdf))


def flight_document(saved: SavedFlight, painters: int = 1) -> Document:
    """Put the report of one saved flight, a session of several or a plan, together; so many processes paint figures."""
    return with_painted_figures(lambda: sketched_document(saved), painters)


def sketched_document(saved: SavedFlight) -> Document:
    """The report of a flight as it is told; within :func:`sketching` no figure is painted."""
    kind = PLAN if is_plan(saved.results) else SESSION if is_session(saved.results) else "Flight report"
    return Document(kind, saved.results.flight_id, front(saved.results), flight_sections(saved))


def flight_report_html(document: Document, beside: str = "manifest.json") -> str:
    """Render the report of a flight as a complete HTML document; its figures are drawn live where scripts may run.

    ``beside`` is the file that the foot of the page leads to.
    """
    parts = (part for section in document.sections for part in section.parts)
    drawn = [part.svg for part in parts if isinstance(part, Drawing)]
    live, pictures = [svg.panels for svg in drawn if svg.panels], [svg.frames for svg in drawn if svg.frames]
    return render(
        "flight.html.j2",
        kind=document.kind,
        label=document.label,
        front=document.front,
        sections=document.sections,
        beside=beside,
        verdict_of=VERDICT_OF.get(document.kind, "the heading correction"),
        page_label=_NOT_IN_AN_ID.sub("-", document.label),  # stands inside a CSS string
        **live_figures(live, pictures),
        style=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
    )
