"""Pages of the site that the code writes: every code of a finding, however it is made."""

import importlib.util
import json
import re
from pathlib import Path
from typing import Any

import typer.main

from groundstation.base.signals import TOPICS
from groundstation.cli.main import app

SOURCE = Path(__file__).parent.parent / "docs" / "site" / "reference.py"


def loaded() -> Any:
    """The module of the pages, anew."""
    found = importlib.util.spec_from_file_location("site_reference", SOURCE)
    assert found is not None and found.loader is not None
    reference = importlib.util.module_from_spec(found)
    found.loader.exec_module(reference)
    return reference


def test_codes_that_stand_in_a_row_or_by_name_are_listed() -> None:
    reference = loaded()
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


def test_every_object_of_summary_json_has_its_fields_once() -> None:
    reference = loaded()
    schema = json.loads(reference.SCHEMA.read_text(encoding="utf-8"))
    page = reference._summary(schema)
    heads = re.findall(r"^##+ (\w+)$", page, re.MULTILINE)
    assert sorted(heads) == sorted(schema["$defs"])
    assert set(re.findall(r"\]\(#(\w+)\)", page)) <= set(heads)
    told = page.partition("## heading\n")[2].partition("\n##")[0]
    assert [line.split("`")[1] for line in told.splitlines() if line.startswith("| `")] == list(
        schema["$defs"]["heading"]["properties"]
    )
    assert "| `confidence95_deg` | list of 2 number or null | deg |" in told
    assert "[gate](#gate)" in told


def test_every_signal_has_its_range() -> None:
    page = loaded()._signals()
    assert "| `true_heading_deg` | double | deg | [0, 360) | nose, clockwise |" in page
    assert page.count("| `") == sum(len(fields) for topic, fields in TOPICS.items() if topic != "truth")
