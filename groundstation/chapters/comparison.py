"""Chapters of a comparison of two flights.

Their sources, and the answers, settings and findings that differ.
"""

from collections.abc import Sequence

from groundstation.base.findings import Finding
from groundstation.chapters.findings import MARKS
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, any_value, number, significant
from groundstation.results.comparison import Comparison, Delta, Value

SHARED = (
    "Both come from {}: they share its noise, and all differences come from {} alone. A difference within the stated "
    "sigmas does not prove that these do not matter."
)


def opening(comparison: Comparison) -> list[Part]:
    """Return who A and B are, and how their clocks are aligned."""
    sides = comparison.a, comparison.b
    rows = [
        ("Aircraft, flight", *(f"{side.aircraft} {side.flight}".strip() or ABSENT for side in sides)),
        ("Source", *(side.source_name for side in sides)),
        ("SHA-256", *(side.source_sha256[:16] for side in sides)),
        ("Start, UTC", *(side.start_utc or "unknown" for side in sides)),
    ]
    alignment = comparison.alignment
    when = "" if alignment.event == "utc" else f", A at {alignment.a_s:.1f} s, B at {alignment.b_s:.1f} s"
    told = f"Clocks aligned on {alignment.event}{when}: clock of B {number(alignment.offset_s, 3, 's', signed=True)}."
    heads = (Head(""), Head(f"A: {comparison.a.flight_id}"), Head(f"B: {comparison.b.flight_id}"))
    shared = [Note(SHARED.format(comparison.origin, comparison.cause), "warn")] if comparison.is_same_log else []
    return [Grid("", heads, rows), Note(f"{told} Times in the figures are flight times of A."), *shared]


def answers(comparison: Comparison) -> Section:
    """Return the answers that both flights have."""
    heads = (
        Head("Answer"),
        Head("A", True),
        Head("B", True),
        Head("B − A", True),
        Head("σ", True),
        Head("Beyond 1.96 σ"),
    )
    rows = [_row(delta) for delta in comparison.shown]
    differing = sum(delta.is_different for delta in comparison.deltas)
    caption = (
        f"The main answers, and any other that differs beyond its sigma; {differing} of {len(comparison.deltas)} "
        "common answers differ at all (see compare.csv). σ of the difference: from the sigmas of both, taken as "
        "independent; empty where one states none."
    )
    lead = "Answers that both flights have; names as in summary.json."
    return Section("answers", "Answers", lead, (Grid("", heads, rows, caption),))


def _row(delta: Delta) -> tuple[Cell, ...]:
    change = "" if delta.delta is None else significant(delta.delta, 6)
    sigma = "" if delta.sigma is None else significant(delta.sigma, 3)
    marks: dict[bool | None, Cell] = {None: "", True: Mark("warn", "beyond"), False: "within"}
    return (delta.name, _value(delta.a), _value(delta.b), change, sigma, marks[delta.is_significant])


def _value(value: Value) -> str:
    return ABSENT if value is None else any_value(value)


def settings(comparison: Comparison) -> Section | None:
    """Return the settings that differ; None where none does."""
    if not comparison.settings:
        return None
    rows = [(pair.name, _value(pair.a), _value(pair.b)) for pair in comparison.settings]
    lead = "Settings as set and as each analysis used them, and versions, where A and B differ."
    grid = Grid("", (Head("Setting"), Head("A", True), Head("B", True)), rows)
    return Section("settings", "Settings that differ", lead, (grid,))


def findings(comparison: Comparison) -> Section | None:
    """Return the findings that one flight has and the other has not; None without any."""
    sides = (
        ("A", comparison.findings_a, comparison.not_assessable_a),
        ("B", comparison.findings_b, comparison.not_assessable_b),
    )
    grids = [
        Grid(f"Only in {letter}", (Head("Severity"), Head("Finding"), Head("Code")), rows)
        for letter, findings, reasons in sides
        if (
            rows := [
                *_finding_rows(findings),
                *((Mark("unknown", "not assessed"), f"{one.analysis}: {one.reason}", "") for one in reasons),
            ]
        )
    ]
    lead = "Findings that only one of the two has, by severity, code and topic."
    return Section("findings", "Findings of only one", lead, grids) if grids else None


def _finding_rows(findings: Sequence[Finding]) -> list[tuple[Cell, ...]]:
    return [(MARKS[finding.severity], finding.text, finding.code) for finding in findings]
