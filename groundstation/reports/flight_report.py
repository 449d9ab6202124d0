"""Report of one flight: one self-contained HTML file, and its PDF on demand.

Made from the saved results alone.
"""

import re
from collections.abc import Callable
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.failures import Failure, attempt, failures, gathered_failures
from groundstation.chapters.by_answer import answer_chapters
from groundstation.chapters.front import front
from groundstation.chapters.parts import Document, Front
from groundstation.reports.drawing import Drawing
from groundstation.reports.exports import write_exports
from groundstation.reports.page import TEMPLATES, live_figures, render
from groundstation.reports.pdf import PdfError, write_pdf
from groundstation.reports.sections import flight_sections
from groundstation.results.file_names import SUMMARY
from groundstation.results.files import SavedFlight, has_text, load, put_failures, write_text
from groundstation.systems.system import Systems

PARTS = "chapter", "figure", "report"  # of a report, by their kinds as failures tell them
REPORT = "report.html"
PDF = "report.pdf"
SESSION, PLAN, ACCEPTANCE = "Session report", "Plan", "Acceptance report"
VERDICT_OF = {SESSION: "the session", PLAN: "the plan", ACCEPTANCE: "the INS against the standard"}
_NOT_IN_AN_ID = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True)
class Written:
    """The files of a report, summary.json among them where its findings changed.

    ``problem`` says why there is no PDF where one was asked for; ``failures`` are the parts that failed by a defect,
    where they are gathered.
    """

    paths: tuple[Path, ...]
    problem: str = ""
    failures: tuple[Failure, ...] = ()


def write_flight_report(folder: Path, systems: Systems, *, with_pdf: bool = False) -> Written:
    """Write report.html into a flight folder, and the files that systems write beside it.

    A part that fails by a defect is left out; summary.json and the report
    name it, and those that failed before.

    Parameters
    ----------
    folder : Path
        Holds summary.json, manifest.json and arrays/: nothing else is read, and equal files give equal bytes
        whatever the time, the host or the number of workers.
    systems : Systems
        Those whose answers it has.
    with_pdf : bool
        Write report.pdf too. Without it an old one is removed: it would show other results.

    Raises
    ------
    UnreadableLogError
        When the folder has no saved results.
    """
    with gathered_failures():
        saved = load(folder, systems.answer_types)
        # first: the report links to those that are there
        exports = attempt("report", "exports", write_exports, saved, systems, unless=(OSError,))
        written, problem = exports or ((), "")
        document = flight_document(saved, systems)
        is_changed = put_failures(folder, failures(), PARTS)
        if is_changed:
            document = flight_document(load(folder, systems.answer_types), systems)
        pages = write_pages(folder / REPORT, flight_report_html, document, document, with_pdf=with_pdf)
        is_changed |= put_failures(folder, failures())
        problems = "; ".join(filter(None, (pages.problem, problem)))
        summary = (folder / SUMMARY,) if is_changed else ()
        return Written((*pages.paths, *written, *summary), problems, failures())


def add_pdf(folder: Path, systems: Systems) -> Written:
    """Write report.pdf beside the page of a flight folder.

    Parameters are those of :func:`write_flight_report`.

    The page and all else stay as they are, unless a part fails by a defect now: then both are written and tell it.
    """
    with gathered_failures():
        document = flight_document(load(folder, systems.answer_types), systems)
        if failures():
            return write_flight_report(folder, systems, with_pdf=True)
        problem = _put_pdf(document, folder / PDF)
        summary = (SUMMARY,) if put_failures(folder, failures()) else ()
        paths = (folder / name for name in (PDF, *summary))
        return Written(tuple(path for path in paths if path.is_file()), problem, failures())


def write_pages(
    page: Path,
    render: Callable[[Document], str],
    shown: Document,
    on_paper: Document,
    *,
    with_pdf: bool,
    keeps_pdf: bool = False,
) -> Written:
    """Write a page and, with ``with_pdf``, a document as PDF beside it.

    A PDF of an earlier run goes; with ``keeps_pdf`` that of an equal page stays.
    """
    pdf = page.with_suffix(".pdf")
    html = attempt("report", page.name, render, shown)
    if not (keeps_pdf and html is not None and has_text(page, html)):
        pdf.unlink(missing_ok=True)  # before the page is another one: a kill leaves no two that differ
    if html is None:
        page.unlink(missing_ok=True)
    else:
        write_text(page, html)
    problem = _put_pdf(on_paper, pdf) if with_pdf else ""
    return Written(tuple(path for path in (page, pdf) if path.is_file()), problem, failures())


def _put_pdf(document: Document, pdf: Path) -> str:
    """Write a document as PDF in place of what is there; returns why there is none."""
    pdf.unlink(missing_ok=True)
    try:
        attempt("report", pdf.name, write_pdf, document, pdf, unless=(OSError, PdfError))
    except PdfError as error:
        return str(error)
    return ""


def flight_document(saved: SavedFlight, systems: Systems) -> Document:
    """Return the report of a saved flight, session or plan, its figures drawn."""
    results = saved.results
    kind = PLAN if results.is_plan else SESSION if results.is_session else "Flight report"
    answers = None if results.is_plan or results.is_session else answer_chapters(results, systems.chapters)
    top = attempt("chapter", "front", front, results, systems.chapters, answers) or Front(results.flight_id)
    return Document(kind, results.flight_id, top, flight_sections(saved, systems, answers))


def flight_report_html(document: Document, beside: str = "manifest.json") -> str:
    """Render the report of a flight as a complete HTML document.

    Its figures are drawn live where scripts may run. ``beside`` is the file that the foot of the page leads to.
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
