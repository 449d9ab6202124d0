"""The schema of summary.json beside the dataclasses it describes."""

import json
from dataclasses import fields
from pathlib import Path

SCHEMA = json.loads((Path(__file__).parents[1] / "schemas" / "summary.schema.json").read_text(encoding="utf-8"))


def expect_fields(definition: str, dataclass: type) -> None:
    """A definition lists what a dataclass holds, in its order, and requires all of it; figures are saved elsewhere."""
    names = [field.name for field in fields(dataclass) if field.name != "figures"]
    assert list(SCHEMA["$defs"][definition]["properties"]) == names
    assert SCHEMA["$defs"][definition]["required"] == names
