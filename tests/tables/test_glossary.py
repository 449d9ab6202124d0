"""docs/glossary.md says of every signal what base/signals says, and of every phase what tables/phases knows."""

import math
from pathlib import Path

from groundstation.base.signals import TOPICS, Field
from groundstation.tables.phases import PHASES

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"


def rows_under(heading: str) -> list[list[str]]:
    text = GLOSSARY.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def range_text(field: Field) -> str:
    if field.is_heading:
        return "[0, 360)"
    if field.kind != "double" or (math.isinf(field.low) and math.isinf(field.high)):
        return ""
    return f"at least {field.low:g}" if math.isinf(field.high) else f"[{field.low:g}, {field.high:g}]"


def test_signals_of_the_glossary_are_those_of_the_code() -> None:
    written = [tuple(row[:5]) for row in rows_under("Signals")]
    known = [
        (topic, field.name, field.unit, field.kind, range_text(field))
        for topic, fields in TOPICS.items()
        if topic != "truth"
        for field in fields
    ]
    assert written == known
    assert TOPICS["truth"] == TOPICS["ins"]
    assert all(row[5] for row in rows_under("Signals"))


def test_phases_of_the_glossary_are_those_of_the_code() -> None:
    assert [row[0] for row in rows_under("Phases")] == list(PHASES)
