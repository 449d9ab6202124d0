"""Chapter: what a user must know about the flight, gravest first, and what could not be assessed."""

from collections.abc import Mapping
from typing import Any

from groundstation.base.findings import Finding
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import is_number, number
from groundstation.reports.sections.saved import objects
from groundstation.results.explain import explained
from groundstation.results.files import SavedFlight
from groundstation.results.noticed import grouped

MOST_FINDINGS = 200
MARKS = {"fail": Mark("bad", "fail"), "warn": Mark("warn", "warn"), "info": Mark("plain", "info")}
GRAVITY = {"fail": 0, "warn": 1, "info": 2}


def build(saved: SavedFlight) -> Section:
    """Build the chapter; no findings is an answer too."""
    parts: list[Part] = [_findings(saved) or Note("No findings.", "good")]
    rows = [
        (str(entry.get("analysis", "")), explained(str(entry.get("analysis", "")), str(entry.get("reason", ""))))
        for entry in objects(saved.summary, "not_assessable")
    ]
    if rows:
        parts.append(Grid("Not assessable", (Head("Analysis"), Head("Reason")), rows))
    return Section("findings", "Findings", "What was noticed about this log, gravest first.", parts)


def _findings(saved: SavedFlight) -> Grid | None:
    every = [_finding(item) for item in objects(saved.summary, "findings")]
    found = sorted(grouped(every), key=lambda item: GRAVITY.get(item.severity, 0))
    rows: list[tuple[Cell, ...]] = []
    for item in found[:MOST_FINDINGS]:
        where = " · ".join(text for text in (item.topic, item.place) if text)
        count = "" if item.count is None else number(item.count, 0)
        mark = MARKS.get(item.severity, Mark("bad", item.severity))
        rows.append((mark, item.text, where, count, item.code))
    heads = (Head("Severity"), Head("Finding"), Head("Where"), Head("Count", True), Head("Code"))
    more = len(found) - len(rows)
    caption = f"{more} more in summary.json." if more else ""
    if len(found) < len(every):
        caption = f"Remarks on raw topics are joined by kind; summary.json lists all {len(every)}. {caption}".strip()
    return Grid("Findings", heads, rows, caption) if rows else None


def _finding(item: Mapping[str, Any]) -> Finding:
    """A saved finding; whatever a key holds, it is shown."""
    severity: Any = str(item.get("severity"))
    code, text, topic, place = (str(item.get(key) or "") for key in ("code", "text", "topic", "place"))
    count = item.get("count")
    return Finding(severity, code, text, topic, place, int(count) if is_number(count) else None)
