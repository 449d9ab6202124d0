"""Chapter on findings: what a user must know, most severe first; what was not assessed."""

from collections.abc import Sequence

from groundstation.base.findings import Finding
from groundstation.base.words import counted
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import number
from groundstation.results.flight import FlightResults
from groundstation.results.grouped_findings import NAMED, grouped

MOST_FINDINGS = 200
TOLD_ABOVE = (".not_assessable", *(f"heading.{one}" for one in ("accept", "advisory", "reject", "extend", "undecided")))
TITLE, LEAD = "Findings", "The most severe first; all of them in summary.json."
MARKS = {"fail": Mark("bad", "fail"), "warn": Mark("warn", "warn"), "info": Mark("plain", "info")}
GRAVITY = {"fail": 0, "warn": 1, "info": 2}
HEADS = (Head("Severity"), Head("Finding"), Head("Where"), Head("Count", True))


def findings(results: FlightResults) -> Section:
    """Return the chapter on findings: warnings and failures, remarks in the appendix.

    A flight without findings has the chapter too, which then says so. What the front tells is left out: verdicts, and
    what could not be assessed.
    """
    found = [item for item in grouped(results.findings) if not item.code.endswith(TOLD_ABOVE)]
    grave = [item for item in found if item.severity != "info"]
    remarks = [item for item in found if item.severity == "info"]
    parts: list[Part] = [_table(grave) if grave else Note("No warnings.", "good")]
    where = _where(results.findings, len(_one_of_each(remarks)))
    if where:
        parts.append(Note(where))
    return Section("findings", TITLE, LEAD, parts, appendix=(_table(_one_of_each(remarks)),) if remarks else ())


def _where(every: Sequence[Finding], lines: int) -> str:
    """Return where the findings stand that this chapter does not list.

    With those listed they are all that the front counts.
    """
    above = [item for item in every if item.code.endswith(TOLD_ABOVE)]
    remarks = sum(item.severity == "info" for item in every)
    remarks_above = sum(item.severity == "info" for item in above)
    grave_above, below = len(above) - remarks_above, remarks - remarks_above
    told = [f"{counted(grave_above, 'warning')} at the top of the report"] if grave_above else []
    if remarks_above:
        told.append(f"{counted(remarks_above, 'remark')} at the top of the report")
    if below:
        shared = "" if below == lines else f" ({counted(lines, 'line')}, one for each kind)"
        told.append(f"{counted(below, 'remark')} in the appendix{shared}")
    return f"{'; '.join(told)}." if told else ""


def _one_of_each(remarks: Sequence[Finding]) -> list[Finding]:
    """Return the first remark of every kind, with all topics and the summed count of the kind."""
    kinds: dict[str, list[Finding]] = {}
    for remark in remarks:
        kinds.setdefault(remark.code, []).append(remark)
    return [alike[0] if len(alike) == 1 else _joined(alike) for alike in kinds.values()]


def _joined(alike: Sequence[Finding]) -> Finding:
    topics = list(dict.fromkeys(remark.topic for remark in alike if remark.topic))
    more = f" and {len(topics) - NAMED} more" if len(topics) > NAMED else ""
    counts = [remark.count for remark in alike if remark.count is not None]
    text = f"{alike[0].text}; {len(alike) - 1} more of this kind"
    return Finding("info", alike[0].code, text, ", ".join(topics[:NAMED]) + more, "", sum(counts) if counts else None)


def _table(found: Sequence[Finding]) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for item in sorted(found, key=lambda item: GRAVITY[item.severity])[:MOST_FINDINGS]:
        where = " · ".join(text for text in (item.topic, item.place) if text and text not in item.text)
        count = "" if item.count is None else number(item.count, 0)
        rows.append((MARKS[item.severity], item.text, where, count))
    more = len(found) - len(rows)
    return Grid("Findings", HEADS, rows, f"{more} more in summary.json." if more else "")
