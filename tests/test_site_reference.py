"""Pages of the site that the code writes: every code of a finding, however it is made."""

import importlib.util
from pathlib import Path

import typer.main

from groundstation.cli.main import app

SOURCE = Path(__file__).parent.parent / "docs" / "site" / "reference.py"


def test_codes_that_stand_in_a_row_or_by_name_are_listed() -> None:
    found = importlib.util.spec_from_file_location("site_reference", SOURCE)
    assert found is not None and found.loader is not None
    reference = importlib.util.module_from_spec(found)
    found.loader.exec_module(reference)
    reference.PACKAGE = SOURCE.parents[2] / "groundstation" / "systems" / "landing"
    rows = {row.split(" | ")[0]: row for row in reference._findings().splitlines() if row[:3] == "| `"}
    assert "info" in rows["| `landing.runway_of_table`"], "in a row with its severity"
    assert "closed in the table" in rows["| `landing.runway_closed`"]
    assert "| `landing.sensitivity`" in rows, "by name"
    assert "| `landing.second_contact`" in rows and "| `landing.motion`" not in rows


def test_every_verb_has_a_row_in_the_manual() -> None:
    text = (SOURCE.parents[1] / "verbs.md").read_text(encoding="utf-8")
    verbs = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    assert [name for name, verb in verbs.items() if not verb.hidden and f"`{name} " not in text] == []
