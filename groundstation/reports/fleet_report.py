"""Report of a folder of flights, with every flight: one HTML file, and a PDF on demand.

The HTML file is self-contained.
"""

from dataclasses import replace
from pathlib import Path

from groundstation.base.failures import attempt, gathered_failures
from groundstation.chapters.fleet import flights, front
from groundstation.chapters.parts import Document, Front, shortened
from groundstation.reports.drawing import drawn_by
from groundstation.reports.flight_report import Written, write_pages
from groundstation.reports.page import TEMPLATES, digest_of, render
from groundstation.results.fleet import FleetResults
from groundstation.systems.system import Systems

PAGE, PDF = "summary.html", "summary.pdf"
MOST_ROWS_ON_PAPER = 60


def write_fleet_report(out: Path, fleet: FleetResults, systems: Systems, *, with_pdf: bool = False) -> Written:
    """Write summary.html into a folder of flights.

    Parameters
    ----------
    out : Path
        Holds the flight folders: links are relative to it.
    fleet : FleetResults
        Equal results give equal bytes, whatever the time, the host or the order of the logs.
    systems : Systems
    with_pdf : bool
        Write summary.pdf too. Without it one that is there stays if the page is as it was.

    Notes
    -----
    The page has a row for every flight; of more than 10 000, for those with remarks and the latest. Paper has at most
    60 rows of any table, flights with remarks first, and says how many more there are. The page's one script sorts and
    filters the table of flights; without it the table stays as it is.

    Raises
    ------
    OSError
        When a file cannot be written.
    """
    with gathered_failures():
        document = fleet_document(fleet, systems)
        return write_pages(
            out / PAGE,
            lambda shown: fleet_report_html(shown, fleet),
            document,
            on_paper(document),
            with_pdf=with_pdf,
            keeps_pdf=True,
        )


def fleet_document(fleet: FleetResults, systems: Systems) -> Document:
    """Put the report of a fleet together, its tables at full length."""
    chapters, plots = systems.fleet_chapters, systems.fleet_plots
    told = [attempt("chapter", one.key, one.build, fleet) for one in chapters]
    drawn = (attempt("chapter", one.key, drawn_by, plots, one, fleet) for one in told if one is not None)
    sections = tuple(section for section in drawn if section is not None)
    top = attempt("chapter", "front", front.build, fleet, chapters) or Front("Fleet")
    return Document("Fleet report", top.title, top, sections)


def on_paper(document: Document) -> Document:
    """Return the document with long tables cut."""
    return replace(document, sections=[shortened(one, MOST_ROWS_ON_PAPER, PAGE) for one in document.sections])


def fleet_report_html(document: Document, fleet: FleetResults) -> str:
    """Render the report of a fleet as a complete HTML document.

    Its flights are a table with links.
    """
    script = (TEMPLATES / "fleet.js").read_text(encoding="utf-8").strip()
    return render(
        "fleet.html.j2",
        kind=document.kind,
        label=document.label,
        front=document.front,
        sections=document.sections,
        table_key=flights.KEY,
        heads=flights.heads_of(fleet),
        lines=flights.lines(fleet),
        table_caption=flights.caption_of(fleet),
        script=script,
        script_digest=digest_of(script),
        style=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
    )
