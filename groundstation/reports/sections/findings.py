"""Chapter: what a user must know about the flight, gravest first, and what could not be assessed."""

from groundstation.reports.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.reports.sections.saved import objects
from groundstation.reports.wording import number
from groundstation.results.files import SavedFlight

MOST_FINDINGS = 200
MARKS = {"fail": Mark("bad", "fail"), "warn": Mark("warn", "warn"), "info": Mark("plain", "info")}
GRAVITY = {"fail": 0, "warn": 1, "info": 2}


def build(saved: SavedFlight) -> Section:
    """Build the chapter; no findings is an answer too."""
    parts: list[Part] = [_findings(saved) or Note("No findings.", "good")]
    rows = [
        (str(entry.get("analysis", "")), str(entry.get("reason", "")))
        for entry in objects(saved.summary, "not_assessable")
    ]
    if rows:
        parts.append(Grid("Not assessable", (Head("Analysis"), Head("Reason")), rows))
    return Section("findings", "Findings", "What was noticed about this log, gravest first.", parts)


def _findings(saved: SavedFlight) -> Grid | None:
    found = sorted(objects(saved.summary, "findings"), key=lambda item: GRAVITY.get(str(item.get("severity")), 0))
    rows: list[tuple[Cell, ...]] = []
    for item in found[:MOST_FINDINGS]:
        severity = str(item.get("severity"))
        count = item.get("count")
        where = " · ".join(str(item.get(key)) for key in ("topic", "place") if item.get(key))
        rows.append(
            (
                MARKS.get(severity, Mark("bad", severity)),
                str(item.get("text", "")),
                where,
                "" if count is None else number(count, 0),
                str(item.get("code", "")),
            )
        )
    heads = (Head("Severity"), Head("Finding"), Head("Where"), Head("Count", True), Head("Code"))
    more = len(found) - len(rows)
    caption = f"{more} more in summary.json." if more else ""
    return Grid("Findings", heads, rows, caption) if rows else None
