"""One order of claims: the line on the terminal begins with what the page opens with."""

from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.base.ledger import Ledger
from groundstation.chapters import by_answer
from groundstation.chapters.by_answer import answers_in_order
from groundstation.chapters.chapter import Chapters
from groundstation.cli.lines import line_of
from groundstation.pipeline.one_flight.flight import sentence
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.reports import flight_report
from groundstation.results.files import SavedFlight
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Manifest
from groundstation.systems import systems
from groundstation.systems.health.answer import AutopilotHealth
from tests.report_example import example, heading_result
from tests.systems.inertial.example import inertial_result
from tests.test_recorded import topic
from tests.told import front

ACCEPT, UNDECIDED = heading_result(), heading_result(verdict="undecided", correction_deg=None, verdict_reason="no GDOP")
MEASURED = inertial_result()
FAILED = AutopilotHealth("fail", "Gyros disagree 1:20-1:21", "px4", "in the air", "landed flag", 600.0, ())


@pytest.mark.parametrize(
    ("results", "first", "behind"),
    [
        (example(ACCEPT, MEASURED), "accept: heading error", "INS"),
        (example(MEASURED, UNDECIDED), "measured: INS", "undecided: heading error"),
        (example(ACCEPT, FAILED), "bad: autopilot health: Gyros disagree", "accept: heading error"),
    ],
    ids=["decided", "undecided", "danger"],
)
def test_the_line_has_the_order_of_the_page(results: FlightResults, first: str, behind: str) -> None:
    line, top = sentence(results), front(results)
    assert line.startswith(first) and top.verdict is not None and line.lower().startswith(top.verdict.text.lower())
    assert f"; {behind}" in line
    keys = [one.section.key for one in answers_in_order(results, systems().chapters)]
    assert keys == [top.key, *(tile.key for tile in top.others)]


def test_a_great_loss_stands_first_on_both_and_once() -> None:
    lost = Ledger(topics={"gnss": topic(1.0, 80.0, "latitude_deg", gaps=(21.0,))})
    results = replace(example(ACCEPT), ledger=lost, status="degraded")
    line, top = sentence(results), front(results)
    assert top.line == "✗ Data lost · 21 s of GNSS missing (26 %), in one gap"
    assert line.startswith("data lost: 21 s of GNSS missing (26 %), in one gap; accept: heading error")
    assert line_of(Outcome("a.csv", "data_lost", line)).count("data lost") == 1
    danger = replace(results, answers=example(ACCEPT, FAILED).answers)
    assert sentence(danger).startswith("bad: ") and front(danger).key == "health"


def test_a_page_builds_the_chapters_on_its_answers_once(monkeypatch: pytest.MonkeyPatch) -> None:
    built = []

    def counted(results: FlightResults, chapters: Chapters) -> tuple[by_answer.Told, ...]:
        built.append(results.flight_id)
        return answers_in_order(results, chapters)

    monkeypatch.setattr(by_answer, "answers_in_order", counted)
    results = example(ACCEPT, FAILED)
    saved = SavedFlight(Path("none"), {}, Manifest(), {}, systems().answer_types)
    saved.__dict__["results"] = results  # in place of those of summary.json
    document = flight_report.flight_document(saved, systems())
    assert built == [results.flight_id] and document.front.key == "health"
