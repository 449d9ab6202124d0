"""Advice against an interval too wide: so long a taxi as reaches the limit, or what keeps any from it."""

from dataclasses import replace

import pytest

from groundstation.chapters.parts import Facts
from groundstation.results.gates import Gate
from tests.report_example import example, heading_result
from tests.told import next_steps

NARROW = "\N{NARROW NO-BREAK SPACE}"


def advice(value: float, taxi_s: float, wander_deg: float = 0.02, name: str = "half_width") -> dict[str, str]:
    gate = Gate(name, "", value, 0.2, "deg", "failed")
    answer = heading_result(verdict="extend", gates=(gate,))
    wide = replace(answer, taxi_seconds=taxi_s, wander_spread_deg=wander_deg, wander_s=109.0)
    section = next_steps(example(wide, not_assessable=()))
    assert section is not None and isinstance(section.parts[0], Facts)
    return {line: str(text).replace(NARROW, " ") for line, text, _ in section.parts[0].pairs}


@pytest.mark.parametrize("name", ["half_width", "precision"])
def test_a_short_taxi_is_told_how_long(name: str) -> None:
    """Twice the limit after 40 s: four times as long."""
    assert "taxi straight for 160 s or more in all (now 40 s)" in advice(0.4, 40.0, name=name)["Fly"]


def test_a_heading_that_wanders_is_named_in_place_of_a_longer_taxi() -> None:
    told = advice(0.23, 639.0, wander_deg=0.214)
    assert "Fly" not in told
    assert "wanders by 0.21" in told["Check"] and "109" in told["Check"] and "repeat the run" in told["Check"]


def test_a_taxi_longer_than_any_taxiway_is_not_asked_for() -> None:
    told = advice(0.23, 639.0)["Fly"]
    assert "repeat the run" in told and "845" in told
