"""Several INS of a flight: read off its tables, told on the page, counted in the acceptance, found by check."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from groundstation.chapters.front import front
from groundstation.chapters.parts import Mark
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import sentence
from groundstation.pipeline.one_flight.join import _metadata
from groundstation.pipeline.one_flight.line import verdict_first
from groundstation.pipeline.verbs.acceptance import accept
from groundstation.pipeline.verbs.usable import usability_of_flight
from groundstation.results.answer import by_analysis
from groundstation.results.files import load, save
from groundstation.systems import systems
from groundstation.systems.inertial.analysis import UNITS
from groundstation.systems.inertial.units import judge_units
from groundstation.systems.inertial.units_answer import UnitsResult
from groundstation.systems.inertial.units_arrays import UnitsErrors
from groundstation.systems.inertial.units_chapter import units as chapter
from groundstation.systems.inertial.units_plots import errors, pairs, radial
from groundstation.systems.joining import name_in_flight
from groundstation.tables.table import Flight
from tests.acceptance_example import save_flight
from tests.report_example import MANIFEST, example, heading_result
from tests.section_contents import grid, notes, rows
from tests.systems.inertial.flights import table_of
from tests.systems.inertial.units_example import drift_of, gnss, stepped, units

ORDINARY = Configuration()


def flight(number: int, *, has_gnss: bool = True, bad: float = 0.0, **metadata: str) -> Flight:
    """Return a flight with several INS; the second drifts by ``bad`` deg/h more."""
    made = units(number, bad=drift_of(bad) if bad else None)
    tracks = [*made, gnss()] if has_gnss else made
    tables = {
        one.topic: table_of(
            one.topic,
            one.time_s,
            {
                "latitude_deg": one.latitude_deg,
                "longitude_deg": one.longitude_deg,
                "velocity_north_mps": one.velocity_mps[:, 0],
                "velocity_east_mps": one.velocity_mps[:, 1],
            },
        )
        for one in tracks
    }
    return Flight(tables=tables, metadata=metadata)


def answer_of(one: Flight) -> tuple[UnitsResult | None, list[str]]:
    """Return the answer, and the codes of the findings."""
    seen = seen_by_analyses(one, ORDINARY)
    found = run_analyses((UNITS,), seen, known_of(seen, ORDINARY))
    answer = found.answers.get(UNITS.name)
    assert answer is None or isinstance(answer, UnitsResult)
    return answer, [finding.code for several in found.findings.values() for finding in several]


def test_units_of_a_log_are_judged_and_named_by_their_serials() -> None:
    answer, codes = answer_of(
        flight(3, bad=0.3, **{"ins_serial": "A1", "ins_serial.ins.1": "B2, C3 from 900", "ins_kind.ins.2": "unaided"})
    )
    assert answer is not None and answer.off == ("ins.1",) and answer.against == "gnss"
    assert [one.serials for one in answer.units] == [("A1",), ("B2", "C3"), ()]
    assert {"ins_units.drift", "ins_units.serial"} <= set(codes)
    assert UNITS.sentence({UNITS.name: answer}).startswith("ins.1 is off: ")
    assert UNITS.values({UNITS.name: answer})["units_off"] == "ins.1"


def test_a_unit_that_is_off_stands_first_in_the_line_of_the_flight() -> None:
    answer, _codes = answer_of(flight(3, bad=0.3))
    assert answer is not None
    results = example(heading_result())
    with_it = replace(results, answers={**results.answers, **by_analysis(answer)})
    before, after = sentence(results), sentence(with_it)
    assert before.startswith("accept: heading error")
    assert (
        after == f"{verdict_first('Off', answer.sentence)}; {before}"
        and front(with_it, systems().chapters).subject == "Several INS"
    )
    agree = replace(with_it, answers={**with_it.answers, UNITS.name: replace(answer, verdict="one_of")})
    assert sentence(agree).startswith("accept: heading error")


def test_nothing_is_said_of_one_unit() -> None:
    one = flight(1)
    assert not UNITS.applies(one, known_of(one, ORDINARY))
    assert not [line for line in usability_of_flight("inertial", one, ORDINARY).gives if "units" in line]


@pytest.mark.parametrize(
    ("number", "has_gnss", "says"),
    [
        (2, True, "several units (ins and ins.1): each against gnss, and in pairs"),
        (2, False, "several units (ins and ins.1) without GNSS: a difference shows, not which one is off"),
        (3, False, "several units (ins, ins.1 and ins.2) without GNSS: parity names the one that is off"),
    ],
)
def test_check_tells_what_several_units_give(number: int, has_gnss: bool, says: str) -> None:
    usability = usability_of_flight("inertial", flight(number, has_gnss=has_gnss), ORDINARY)
    assert usability.gives[0] == says and f"; gives: {says}" in usability.text
    assert (usability.state == "no") == (not has_gnss)


def test_a_unit_without_numbers_is_left_out_without_a_traceback() -> None:
    one = flight(3, has_gnss=False)
    empty = {name: np.full(3600, np.nan) for name in ("latitude_deg", "longitude_deg", "velocity_north_mps")}
    empty["velocity_east_mps"] = np.full(3600, np.nan)
    blank = table_of("ins.1", np.arange(3600.0), empty)
    answer, _ = answer_of(replace(one, tables={**one.tables, "ins.1": blank}))
    assert answer is not None and answer.unit("ins.1").state == "not_judged" and answer.verdict == "agree"


def test_page_has_a_row_for_each_unit_and_pair_and_one_figure() -> None:
    answer = judge_units(units(3, bad=drift_of(0.3)), gnss())
    section = chapter(example(answer, figures=answer.figures))
    assert section is not None and section.headline == "ins.1 off"
    assert notes(section)[0].startswith("ins.1 is off: ")
    assert [row[1] for row in rows(section, "Units")] == ["✓ Good", "✗ Off", "✓ Good"]
    assert [row[:2] for row in rows(section, "Pairs")] == [
        ("ins.1 − ins", "▲ Beyond"),
        ("ins.2 − ins", "✓ Within"),
        ("ins.2 − ins.1", "▲ Beyond"),
    ]
    assert "Heading, °" not in [head.title for head in grid(section, "Units").heads]  # GNSS has none
    assert section.claim is not None and section.claim.mark == Mark("bad", "Off")


def test_without_a_reference_the_figure_is_of_the_pairs() -> None:
    for reference, names in ((gnss(), ["ins", "ins.1"]), (None, ["ins.1 − ins"])):
        answer = judge_units(units(2), reference)
        results = example(answer, figures=answer.figures)
        plot = radial(results)
        assert plot is not None
        assert [mark.name for mark in plot.rows[0].panels[0].marks] == names
        assert (errors(results, "velocity") is None) == (reference is None)
        assert pairs(results, "heading") is not None


def test_acceptance_counts_every_unit_of_a_flight(tmp_path: Path) -> None:
    """Two more units: one counts under its serial, one was set in flight and does not."""
    folder = save_flight(tmp_path, 0, 0.5, ins="S-1")
    alone = accept(tmp_path, "app-g")
    made = units(3)
    made[1] = replace(made[1], serials=((0.0, "S-2"),))
    made[2] = replace(units(3, bad=stepped(500.0))[1], topic="ins.2", serials=((0.0, "S-3"),))
    answer = judge_units(made, gnss())
    saved = load(folder, systems().answer_types)
    figures = (*saved.results.figures, *answer.figures)
    results = replace(saved.results, answers={**saved.results.answers, **by_analysis(answer)}, figures=figures)
    save(folder, results, MANIFEST)
    found = accept(tmp_path, "app-g")
    assert [one.ins for one in alone.flights] == ["S-1"]
    told = {one.ins: one.reason for one in found.flights}
    assert told["S-2"] == "" and told["S-3"] == "the position of the INS was set in flight"
    rate = next(one for one in found.flights if one.ins == "S-2").values["radial_rate_fit_nmiph"]
    expected = answer.unit("ins.1").rate_fit_nmiph
    assert expected is not None and rate == pytest.approx(expected.value, rel=0.02)
    assert answer.figures[0].name == UnitsErrors.figure


def test_the_serial_of_each_log_stays_with_its_unit_when_logs_are_joined() -> None:
    def part(label: str, metadata: dict[str, str]) -> Any:
        info = SimpleNamespace(metadata=metadata)
        return SimpleNamespace(
            label=label, converted=SimpleNamespace(info=info), name=lambda topic: name_in_flight(topic, label)
        )

    logs = [part("a", {"ins_serial": "A1"}), part("b", {"ins_serial": "B2", "ins_kind": "unaided"})]
    found = _metadata([*logs, part("c", {"ins_serial": "C3", "ins_serial.ins.1": "C4"})], "joined")
    told = {key: value for key, value in found.items() if key.startswith("ins_")}
    assert told == {
        "ins_serial": "A1",
        f"ins_serial.{name_in_flight('ins', 'b')}": "B2",
        f"ins_kind.{name_in_flight('ins', 'b')}": "unaided",
        f"ins_serial.{name_in_flight('ins', 'c')}": "C3",
        f"ins_serial.{name_in_flight('ins.1', 'c')}": "C4",
    }
