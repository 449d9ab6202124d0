"""The report of one flight: one self-contained HTML file, made from the saved results alone."""

import re
from pathlib import Path

from groundstation.reports.page import TEMPLATES, render
from groundstation.reports.sections import CHAPTERS, front
from groundstation.reports.sections.saved import mapping
from groundstation.results.files import SavedFlight, load, write_text

REPORT = "report.html"
_NOT_IN_AN_ID = re.compile(r"[^A-Za-z0-9_-]+")


def write_flight_report(folder: Path) -> Path:
    """Write report.html into a flight folder and return its path.

    Parameters
    ----------
    folder : Path
        Holds summary.json, manifest.json and results.parquet/: nothing else is read, and equal files give equal bytes
        whatever the time, the host or the number of workers.

    Raises
    ------
    UnreadableLogError
        When the folder has no saved results.
    """
    path = folder / REPORT
    write_text(path, flight_report_html(load(folder)))
    return path


def flight_report_html(saved: SavedFlight) -> str:
    """Render the report of one saved flight as a complete HTML document."""
    sections = [section for section in (build(saved) for build in CHAPTERS) if section is not None]
    flight_id = str(mapping(saved.summary, "flight").get("id", ""))
    return render(
        "flight.html.j2",
        front=front.build(saved),
        sections=sections,
        flight_id=flight_id,
        page_label=_NOT_IN_AN_ID.sub("-", flight_id),  # stands inside a CSS string
        style=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
    )
