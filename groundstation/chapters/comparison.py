"""Chapters of a comparison of two flights.

Their sources, and the answers, settings and findings that differ.
"""

from collections.abc import Sequence

from groundstation.base.findings import Finding
from groundstation.base.words import capitalised
from groundstation.chapters.findings import MARKS
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, any_value, named_quantity, number, significant, words
from groundstation.results.comparison import Comparison, Delta, Value

SHARED = (
    "Both come from {}: they share its noise, and all differences come from {} alone. A difference within the stated "
    "sigmas does not prove that these do not matter."
)


MOST_TOLD = 4  # differences in the sentence


def conclusion(comparison: Comparison) -> Note:
    """Return what the comparison comes to, in a sentence or two."""
    shown = comparison.shown
    beyond = [one for one in shown if one.is_significant]
    judged = sum(one.is_significant is not None for one in shown)
    texts = [one for one in shown if one.delta is None and one.is_different and one.is_main]
    told = []
    if beyond:
        few = "; ".join(_change(one) for one in beyond[:MOST_TOLD])
        more = f"; and {len(beyond) - MOST_TOLD} more" if len(beyond) > MOST_TOLD else ""
        told.append(f"{len(beyond)} of {judged} answers with a σ differ beyond it: {few}{more}.")
    elif judged:
        told.append(f"None of the {judged} answers with a σ differs beyond it.")
    if texts:
        told.append(
            "; ".join(f"{plain_name(one)}: {_value(one.a)} in A, {_value(one.b)} in B" for one in texts[:4]) + "."
        )
    verdicts = [one for one in shown if one.is_main and one.name.endswith("verdict") and one.a is not None]
    if verdicts and not any(one.is_different for one in verdicts):
        told.append("The verdicts are the same.")
    if not any(one.is_different for one in comparison.deltas):
        told = ["Both gave the same answers." if comparison.deltas else "They have no answer in common."]
    if not told:
        told = ["No answer in common has a σ: whether the differences matter is not known."]
    return Note("Conclusion: " + " ".join(told), "warn" if beyond or texts else "plain")


def _change(delta: Delta) -> str:
    return f"{plain_name(delta)} {significant(delta.delta, 3)} (σ {significant(delta.sigma, 2)})"


def plain_name(delta: Delta) -> str:
    """Return the name of an answer in words, with its unit.

    Examples
    --------
    >>> plain_name(Delta("heading.confidence95_low_deg", 1.0, 2.0)), plain_name(Delta("status", "ok", "ok"))
    ('Heading: 95 % low, °', 'Status')
    >>> plain_name(Delta("forecast.skill.windows.5min.rms_m", 1.0, 2.0))
    'Forecast: rms, m (skill, windows, 5min)'
    """
    if delta.title:
        return delta.title
    first, *middle = delta.name.split(".")
    if not middle:
        return subject(first)
    what, unit = named_quantity(middle[-1].replace("confidence95", "95_%"))
    places = [words(part) for part in middle[:-1] if part != "rows"]
    inside = f" ({', '.join(places)})" if places else ""
    return f"{subject(first)}: {what}{f', {unit}' if unit else ''}{inside}"


def subject(name: str) -> str:
    """Return the name of an analysis in words.

    Examples
    --------
    >>> subject("ins_ground"), subject("magnetic_ground"), subject("gnss")
    ('INS ground', 'Magnetic ground', 'GNSS')
    """
    told = " ".join(word.upper() if word in ("ins", "gnss") else word for word in words(name).split())
    return capitalised(told)


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
    return [
        conclusion(comparison),
        Grid("", heads, rows),
        Note(f"{told} Times in the figures are flight times of A."),
        *shared,
    ]


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
    lead = "Answers that both flights have; compare.csv has their names in summary.json."
    return Section("answers", "Answers", lead, (Grid("", heads, rows, caption),))


def _row(delta: Delta) -> tuple[Cell, ...]:
    change = "" if delta.delta is None else significant(delta.delta, 6)
    sigma = "" if delta.sigma is None else significant(delta.sigma, 3)
    marks: dict[bool | None, Cell] = {None: "", True: Mark("warn", "beyond"), False: "within"}
    return (plain_name(delta), _value(delta.a), _value(delta.b), change, sigma, marks[delta.is_significant])


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
                *((Mark("unknown", "not assessed"), f"{subject(one.analysis)}: {one.reason}", "") for one in reasons),
            ]
        )
    ]
    lead = "Findings that only one of the two has, by severity, code and topic."
    return Section("findings", "Findings of only one", lead, grids) if grids else None


def _finding_rows(findings: Sequence[Finding]) -> list[tuple[Cell, ...]]:
    return [(MARKS[finding.severity], finding.text, finding.code) for finding in findings]
