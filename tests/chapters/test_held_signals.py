"""Advice asks for nothing that the log holds, whichever system it is of."""

import ast
from pathlib import Path

import pytest

import groundstation
from groundstation.base.ledger import Ledger
from groundstation.base.signals import TOPICS
from groundstation.chapters.chapter import Advice
from groundstation.chapters.held_signals import ASKED, is_held, without_held
from groundstation.chapters.parts import Facts
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.gates import NO_CONTACT, Gate
from tests.report_example import example, heading_result
from tests.test_recorded import topic
from tests.told import next_steps

PACKAGE = Path(groundstation.__file__).parent
NO_SIGNALS = {  # what no field of a log shows to be there
    "the free-inertial output of the INS",
    "a true heading with no compass in it",
    "GNSS velocity at 10 Hz (now {value})",
}


def holding(*signals: str, **changes: object) -> FlightResults:
    """An example whose log holds these, "kind.field"."""
    kinds = dict.fromkeys(one.partition(".")[0] for one in signals)
    topics = {
        kind: topic(1.0, 80.0, *(one.partition(".")[2] for one in signals if one.startswith(f"{kind}.")))
        for kind in kinds
    }
    return example(None, ledger=Ledger(topics=topics), **changes)  # type: ignore[arg-type]


def told(results: FlightResults) -> dict[str, str]:
    section = next_steps(results)
    parts = () if section is None else section.parts
    return {label: text for part in parts if isinstance(part, Facts) for label, text, _ in part.pairs}


def asked_in_code() -> dict[str, str]:
    """Texts under "Record", of remedies, advice and gates, with their file."""
    found = {}
    for path in (*(PACKAGE / "systems").rglob("*.py"), *(PACKAGE / "chapters").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if '"Record"' in text else ():
            parts: list[ast.expr] = []
            if isinstance(node, ast.Tuple) and len(node.elts) == 2:
                parts = node.elts
            elif isinstance(node, ast.Call):
                named = {one.arg: one.value for one in node.keywords}
                parts = [named["line"], named["advice"]] if {"line", "advice"} <= set(named) else node.args
            texts = [one.value if isinstance(one, ast.Constant) else None for one in parts[:2]]
            if len(texts) == 2 and texts[0] == "Record" and isinstance(texts[1], str):
                found[texts[1]] = path.name
    return found


def test_every_signal_that_advice_asks_for_has_its_fields() -> None:
    found = asked_in_code()
    assert {"GNSS velocity", "GDOP, PDOP or HDOP"} <= set(found)
    assert {text: file for text, file in found.items() if text not in ASKED and text not in NO_SIGNALS} == {}
    fields = {one for ways in ASKED.values() for way in ways for one in way}
    known = {f"{kind}.{field.name}" for kind, held in TOPICS.items() for field in held}
    assert fields <= known


@pytest.mark.parametrize("text", sorted(ASKED))
def test_a_signal_that_the_log_holds_is_not_asked_for(text: str) -> None:
    asked = Advice("Record", text, "heading correction")
    for way in ASKED[text]:
        assert is_held(holding(*way), text)
        left = without_held(asked, holding(*way))
        assert left.line == "Check" and left.text.startswith(f"{text} (logged")
    short = ASKED[text][0][1:]
    assert without_held(asked, holding(*short)) == asked


def test_a_log_in_the_air_with_weight_on_wheels_is_asked_for_its_ground_run() -> None:
    missing = (NotAssessable("heading", NO_CONTACT),)
    without = told(holding("gnss.gdop", not_assessable=missing))
    assert without["Record"] == "For the heading correction: weight on wheels."
    with_it = told(holding("discrete.weight_on_wheels", not_assessable=missing))
    assert with_it["Record"].endswith(": the ground run too (by weight on wheels this log holds none).")


@pytest.mark.parametrize(
    ("landed", "metadata"),
    [
        ("set down between 2:50 and 3:01 without rolling: no approach to a runway", {}),
        ("no landing in the log", {"firmware": "ArduCopter V3.6.7"}),
    ],
)
def test_what_has_no_wheels_is_not_asked_for_weight_on_wheels(landed: str, metadata: dict[str, str]) -> None:
    missing = (NotAssessable("heading", NO_CONTACT), NotAssessable("landing", landed))
    assert "Record" not in told(holding("gnss.gdop", not_assessable=missing, metadata=metadata))
    rolls = (missing[0], NotAssessable("landing", "no landing in the log"))
    assert "weight on wheels" in told(holding("gnss.gdop", not_assessable=rolls))["Record"]


def test_a_gate_of_a_signal_that_is_there_asks_to_check_it() -> None:
    gate = Gate("geometry", "", 0.4, 0.9, "", "failed", sense="at_least")
    results = example(heading_result(verdict="reject", gates=(gate,)), not_assessable=())
    held = example(
        heading_result(verdict="reject", gates=(gate,)),
        not_assessable=(),
        ledger=Ledger(topics={"gnss.1": topic(1.0, 80.0, "hdop")}),
    )
    assert "Record" in told(results) and "Record" not in told(held)
    assert "GDOP, PDOP or HDOP (logged" in told(held)["Check"]
