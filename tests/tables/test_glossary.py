"""docs/signals.md says what the code says of every signal, docs/glossary.md knows every phase."""

from pathlib import Path

from groundstation.base.signal_senses import SENSES
from groundstation.base.signals import TOPICS
from groundstation.tables.phases import PHASES
from tests import signals_page

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"


def rows_under(heading: str) -> list[list[str]]:
    text = GLOSSARY.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_every_signal_has_a_sense_once() -> None:
    written = [(topic, name) for topic, names, _sense in SENSES for name in names]
    known = {(topic, field.name) for topic, fields in TOPICS.items() if topic != "truth" for field in fields}
    assert set(written) == known and len(written) == len(known)
    assert TOPICS["truth"] == TOPICS["ins"] and all(sense for _topic, _names, sense in SENSES)


def test_the_page_of_signals_is_that_of_the_code() -> None:
    """Written by ``python -m tests.signals_page``."""
    assert signals_page.PAGE.read_text(encoding="utf-8") == signals_page.page()


def test_phases_of_the_glossary_are_those_of_the_code() -> None:
    assert [row[0] for row in rows_under("Phases")] == list(PHASES)
