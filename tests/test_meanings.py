"""Every field of summary.json says what it is: for the schema, and for the reference made from it."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from groundstation.results.meanings import meanings_of

SCHEMA = json.loads((Path(__file__).parents[1] / "schemas" / "summary.schema.json").read_text(encoding="utf-8"))
LEAST_SHARE = 0.99  # of the fields; it may rise alone
EMPTY = {"a", "an", "the", "of", "its", "this", "that", "it", "in", "is", "value", "field", "data", "number", "object"}
HEADLINES = (
    *("heading", "inertial", "forecast", "magnetic", "landing_result", "approach", "best_trajectory"),
    *("autopilot_health", "gnss_reception", "latency", "cooperative_result", "ins_units", "reference_result"),
    *("installation_result", "magnetic_ground", "magnetic_flux", "flight", "finding", "gate", "skill"),
)


def fields() -> Iterator[tuple[str, str, str]]:
    """Object, field and meaning of every field."""
    for name, one in {"summary": SCHEMA, **SCHEMA["$defs"]}.items():
        for field, described in one["properties"].items():
            yield name, field, described.get("description", "")


def test_every_field_has_a_meaning() -> None:
    every = list(fields())
    missing = [f"{name}.{field}" for name, field, meaning in every if not meaning]
    assert len(every) > 1700 and 1.0 - len(missing) / len(every) >= LEAST_SHARE, missing


@pytest.mark.parametrize("name", HEADLINES)
def test_headline_answers_are_described_whole(name: str) -> None:
    assert [field for field, one in SCHEMA["$defs"][name]["properties"].items() if not one.get("description")] == []


def test_no_meaning_only_says_the_name_again() -> None:
    """A meaning has a word that neither the name nor every sentence has."""
    empty = []
    for name, field, meaning in fields():
        told = set(re.findall(r"[a-z0-9]+", meaning.lower()))
        own = set(field.lower().split("_"))
        if meaning and not told - own - {f"{word}s" for word in own} - EMPTY:
            empty.append(f"{name}.{field}: {meaning}")
    assert empty == []


def test_units_and_senses_are_told() -> None:
    told = {(name, field): meaning for name, field, meaning in fields()}
    assert told["heading", "error_deg"].startswith("INS heading minus true heading")
    assert told["latency", "latency_s"].startswith("Positive: the other shows a motion later")
    assert "right of the course positive" in told["position_error", "error_m"]
    assert "forward positive" in told["along_error", "error_m"]
    assert told["magnetic", "coefficients_deg"].startswith("A to E of error = A + B sin c")
    assert "east positive" in told["declination", "value_deg"]


@dataclass(frozen=True)
class Base:
    """Base.

    Parameters
    ----------
    first, second : float
        Shared by both.
    third : str
    """

    first: float
    second: float  #: Told behind it.
    third: str


@dataclass(frozen=True)
class Example(Base):
    """Example."""

    #: Told above it,
    #: on two lines.
    fourth: float = 0.0
    start_s: float = 0.0
    fifth: float = 0.0  # a comment is no meaning


def test_meanings_are_read_where_the_types_stand() -> None:
    told: dict[str, Any] = meanings_of(Example)
    assert told["first"] == "Shared by both." and told["second"] == "Told behind it."
    assert told["fourth"] == "Told above it, on two lines." and told["start_s"] == "Flight second of the beginning."
    assert "third" not in told and "fifth" not in told
