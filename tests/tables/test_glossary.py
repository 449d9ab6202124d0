"""docs/glossary.md says of every signal what base/signals says, and of every phase what tables/phases knows."""

import re
from pathlib import Path

from groundstation.base.signals import TOPICS
from groundstation.tables.phases import PHASES

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"


def rows_under(heading: str) -> list[list[str]]:
    text = GLOSSARY.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_signals_of_the_glossary_are_those_of_the_code() -> None:
    written = [(topic, name) for topic, fields, _ in rows_under("Signals") for name in re.findall(r"`(\w+)`", fields)]
    known = {(topic, field.name) for topic, fields in TOPICS.items() if topic != "truth" for field in fields}
    assert set(written) == known and len(written) == len(known)
    assert TOPICS["truth"] == TOPICS["ins"]
    assert all(sense for _, _, sense in rows_under("Signals"))


def test_phases_of_the_glossary_are_those_of_the_code() -> None:
    assert [row[0] for row in rows_under("Phases")] == list(PHASES)
