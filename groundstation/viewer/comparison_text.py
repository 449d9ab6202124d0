"""The text panel of a comparison: who A and B are, how their clocks are aligned, what differs."""

from collections.abc import Sequence

from groundstation.base.findings import Finding
from groundstation.base.timescales import duration_text
from groundstation.chapters.markdown import table
from groundstation.results.comparison import Comparison, Delta, Side, Value
from groundstation.viewer.markdown import markdown_text

SIGNIFICANCE = {None: "", True: "**beyond**", False: "within"}
MOST_FINDINGS = 12


def comparison_text(comparison: Comparison) -> str:
    """Markdown of the panel."""
    moments = ", ".join(duration_text(abs(moment)) for moment in (comparison.alignment.a_s, comparison.alignment.b_s))
    aligned = (
        f"Aligned on **{markdown_text(comparison.alignment.event)}** ({markdown_text(moments)}): "
        f"clock of B {markdown_text(f'{comparison.alignment.offset_s:+.3f} s')}; flight time is that of A."
    )
    parts = [
        table(["", "A", "B"], _sides(comparison.a, comparison.b)),
        aligned,
        table(["", "A", "B", "B − A", "± 1.96 σ"], [_row(delta) for delta in comparison.shown]),
    ]
    if comparison.settings:
        rows = [[markdown_text(pair.name), _value(pair.a), _value(pair.b)] for pair in comparison.settings]
        parts += ["## Settings that differ", table(["setting", "A", "B"], rows)]
    for letter, findings in (("A", comparison.findings_a), ("B", comparison.findings_b)):
        if findings:
            parts += [f"## Findings of {letter} alone", _findings(findings)]
    return "\n\n".join(parts)


def _sides(a: Side, b: Side) -> list[list[str]]:
    rows = [
        ["flight", a.flight_id, b.flight_id],
        ["source", a.source_name, b.source_name],
        ["start, UTC", a.start_utc or "unknown", b.start_utc or "unknown"],
    ]
    return [[markdown_text(cell) for cell in row] for row in rows]


def _row(delta: Delta) -> list[str]:
    change = "" if delta.delta is None else markdown_text(f"{delta.delta:+.6g}")
    return [markdown_text(delta.name), _value(delta.a), _value(delta.b), change, SIGNIFICANCE[delta.is_significant]]


def _value(value: Value) -> str:
    return "–" if value is None else markdown_text(f"{value:.8g}" if isinstance(value, float) else str(value))


def _findings(findings: Sequence[Finding]) -> str:
    lines = [f"- {finding.severity}: {markdown_text(finding.text)}" for finding in findings[:MOST_FINDINGS]]
    more = len(findings) - MOST_FINDINGS
    return "\n".join([*lines, *([f"- {more} more in the page"] if more > 0 else [])])
