"""Chapter: what a user must know about the flight, most severe first, and what could not be assessed."""

from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import number
from groundstation.results.flight import FlightResults
from groundstation.results.grouped_findings import grouped
from groundstation.results.reasons import explained

MOST_FINDINGS = 200
MARKS = {"fail": Mark("bad", "fail"), "warn": Mark("warn", "warn"), "info": Mark("plain", "info")}
GRAVITY = {"fail": 0, "warn": 1, "info": 2}
HEADS = (Head("Severity"), Head("Finding"), Head("Where"), Head("Count", True), Head("Code"))


def findings(results: FlightResults) -> Section:
    """The chapter; no findings is an answer too."""
    parts: list[Part] = [_findings(results) or Note("No findings.", "good")]
    missing = not_assessable(results)
    if missing is not None:
        parts.append(missing)
    return Section("findings", "Findings", "What was noticed about this log, the most severe first.", parts)


def not_assessable(results: FlightResults) -> Grid | None:
    """The analyses that could not be carried out, each with its reason; None where all could."""
    rows = [(entry.analysis, explained(entry.analysis, entry.reason)) for entry in results.not_assessable]
    return Grid("Not assessable", (Head("Analysis"), Head("Reason")), rows) if rows else None


def _findings(results: FlightResults) -> Grid | None:
    found = sorted(grouped(results.findings), key=lambda item: GRAVITY[item.severity])
    rows: list[tuple[Cell, ...]] = []
    for item in found[:MOST_FINDINGS]:
        where = " · ".join(text for text in (item.topic, item.place) if text)
        count = "" if item.count is None else number(item.count, 0)
        rows.append((MARKS[item.severity], item.text, where, count, item.code))
    more = len(found) - len(rows)
    caption = f"{more} more in summary.json." if more else ""
    every = len(results.findings)
    if len(found) < every:
        caption = f"Remarks on raw topics are joined by kind; summary.json lists all {every}. {caption}".strip()
    return Grid("Findings", HEADS, rows, caption) if rows else None
