"""check --for: what a log can be used for, told without an estimate, agrees with what the analyses then answer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.cli.main import app
from groundstation.integrity.limits import shipped
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs import usable
from groundstation.pipeline.verbs.check import checked_with_flight
from groundstation.pipeline.verbs.usable import (
    Usability,
    flight_purposes,
    session_purposes,
    usability_of_flight,
    usability_of_session,
)
from groundstation.systems import systems, systems_for
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.gates_answer import GATES
from groundstation.systems.heading.wording import told
from groundstation.tables.session_settings import Stations
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.session_example import SHORT, recorded, stations_of
from tests.systems.inertial.flights import batch_of, flight_of, without_rows
from tests.systems.landing.example import approach_scenario, flown
from tests.systems.magnetic.example import EIGHT, LEVEL, make

SAMPLES = Path(__file__).parents[1] / "sample_logs"
ORDINARY = Configuration()


def groundstation(*arguments: str | Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.stdout, result.stderr


def read(path: Path) -> Flight:
    _, flight = checked_with_flight(open_log(path), shipped(), "none", with_flight=True)
    assert flight is not None
    return flight


def agreeing(purpose: str, flight: Flight) -> tuple[Usability, object]:
    """What is told of a flight, and the answer of its analysis: none, and for the reason told, or some."""
    usability = usability_of_flight(purpose, flight, ORDINARY)
    seen = seen_by_analyses(flight, ORDINARY)
    found = run_analyses((flight_purposes()[purpose],), seen, known_of(seen, ORDINARY))
    assert (usability.state == "no") == (purpose not in found.answers)
    if usability.state == "no":
        assert usability.shortfalls[0].text.startswith(found.reasons[purpose])
    return usability, found.answers.get(purpose)


def test_the_page_and_a_wrong_name_tell_every_purpose() -> None:
    purposes = [*flight_purposes(), *session_purposes()]
    assert {one.name for one in (*systems().analyses, *systems().session_analyses)} == set(purposes), "as list names"
    page = Path(__file__).parents[1] / "docs" / "integrity.md"
    assert "`--for NAME`" in page.read_text(encoding="utf-8")
    refused = CliRunner().invoke(app, ["check", str(SAMPLES / "taxi-short.csv"), "--for", "taxi"])
    assert refused.exit_code != 0
    assert f"one of {', '.join(purposes)}" in refused.output


def test_heading_is_told_by_the_gates_of_the_answer() -> None:
    usability, answer = agreeing("heading", read(SAMPLES / "taxi-notime.csv"))
    assert isinstance(answer, HeadingResult)
    of_data = [gate for gate in answer.gates if GATES[gate.name].from_data_alone]
    against = [gate for gate in of_data if gate.required and gate.state != "passed"]
    assert usability.state == "in part"
    assert [one.text for one in usability.shortfalls] == [told((gate,)) for gate in against]


def test_too_little_taxi_is_told_with_its_place() -> None:
    flight = read(SAMPLES / "taxi-short.csv")
    asking = Configuration(tables={"heading": {"taxi_min_s": 60.0}})
    (lacking,) = usability_of_flight("heading", flight, asking).shortfalls
    assert lacking.text.endswith("s of straight taxi, 60 s needed")
    gnss = flight["gnss"]
    speed = np.hypot(gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps"))
    for start_s, end_s in lacking.spans_s:
        inside = (flight.time_s("gnss") >= start_s) & (flight.time_s("gnss") <= end_s)
        assert speed[inside].min() > 5.5


def test_a_flight_that_stands_is_of_no_use_for_a_heading_and_says_what_the_run_says() -> None:
    flight = read(SAMPLES / "taxi-short.csv")
    gnss = flight["gnss"]
    is_slow = np.hypot(gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps")) < 1.0
    usability, _ = agreeing("heading", without_rows(flight, "gnss", is_slow))
    assert usability.text.startswith("usable for heading: no: ground speed never above 6 m/s")


def test_inertial_is_told_by_kind_cover_and_length() -> None:
    flight = flight_of(batch_of())
    time_s = flight.time_s("gnss")
    assert time_s[-1] > 7200.0
    assert usability_of_flight("inertial", flight, ORDINARY).state == "yes"
    out_s = (2000.0, 3500.0)
    holed = without_rows(flight, "gnss", (time_s < out_s[0]) | (time_s > out_s[1]))
    (lacking,) = usability_of_flight("inertial", holed, ORDINARY).shortfalls
    assert lacking.spans_s == (pytest.approx(out_s, abs=2.0),)
    brief = without_rows(without_rows(flight, "gnss", time_s < 1200.0), "ins", flight.time_s("ins") < 1200.0)
    assert "20 min with GNSS; one Schuler period" in usability_of_flight("inertial", brief, ORDINARY).text
    usability, _ = agreeing("inertial", without_rows(flight, "gnss", time_s < 200.0))
    assert "s with INS and GNSS together" in usability.text


def test_an_ins_that_gnss_corrects_is_of_use_in_part() -> None:
    batch = batch_of()
    still = replace(
        batch,
        position_error_m=np.zeros_like(batch.position_error_m),
        velocity_error_mps=np.zeros_like(batch.velocity_error_mps),
    )
    usability = usability_of_flight("inertial", flight_of(still), ORDINARY)
    assert usability.state == "in part"
    assert "GNSS corrects this INS" in usability.text


def test_magnetic_is_told_by_turns_and_level_flight() -> None:
    assert agreeing("magnetic", make().flight)[0].state == "yes"
    one_way, _ = agreeing("magnetic", make(turns=(*LEVEL[:4], EIGHT[0])).flight)
    assert one_way.state == "no"
    asking = Configuration(tables={"magnetic": {"held_out_samples_min": 1_000_000}})
    bare = usability_of_flight("magnetic", make().flight, asking)
    assert [one.text.partition(" (")[0] for one in bare.shortfalls] == ["no level flight beside the figure to judge by"]


def test_landing_is_told_by_finals_and_runways() -> None:
    flight = flown(approach_scenario())[0].flight
    usability, _ = agreeing("landing", flight)
    assert usability.shortfalls[0].text.startswith("no ")


def test_a_session_is_judged_together() -> None:
    flights, stations = recorded(SHORT), stations_of(SHORT)
    assert usability_of_session("cooperative", flights, ORDINARY, stations).state == "yes"
    alone = usability_of_session("cooperative", flights[:1], ORDINARY, Stations())
    assert alone.state == "in part"
    assert "but no log of them is named" in alone.text
    deaf = [flight.without("link") for flight in flights]
    assert "no ranges to another aircraft" in usability_of_session("cooperative", deaf, ORDINARY, stations).text
    blind = [flight.without("ins") for flight in flights]
    assert usability_of_session("cooperative", blind, ORDINARY, stations).state == "no"


@pytest.mark.parametrize(
    ("arguments", "code", "first"),
    [
        (("taxi-good.csv", "--for", "heading"), 0, "usable for heading: yes"),
        (("taxi-notime.csv", "--for", "heading"), 0, "usable for heading: in part: "),
        (("taxi-notime.csv", "--for", "heading", "--fail-on", "warn"), 4, "usable for heading: in part: "),
        (("taxi-good.csv", "--for", "magnetic"), 4, "usable for magnetic: no: no turn of steady bank in flight"),
    ],
)
def test_the_first_line_and_the_exit_code_answer(arguments: tuple[str, ...], code: int, first: str) -> None:
    done, out, _ = groundstation("check", SAMPLES / arguments[0], *arguments[1:])
    assert done == code
    assert out.splitlines()[0].startswith(first)


def test_an_mcap_is_told_as_its_log_is(tmp_path: Path) -> None:
    groundstation("convert", SAMPLES / "taxi-notime.csv", "-o", tmp_path / "a.mcap")
    told_of = [
        json.loads(groundstation("check", path, "--for", "heading", "--json")[1])[0]["usability"]
        for path in (SAMPLES / "taxi-notime.csv", tmp_path / "a.mcap")
    ]
    assert told_of[0] == told_of[1]
    assert told_of[0]["lacking"]


def test_every_analysis_that_list_names_is_told_as_it_runs() -> None:
    """Those that examine nothing are run: yes exactly where they answer, else the reason that the run gives."""
    flight = read(SAMPLES / "taxi-good.csv")
    seen = seen_by_analyses(flight, ORDINARY)
    every = tuple(one for one in systems().analyses if not one.judges)
    ran = run_analyses(every, seen, known_of(seen, ORDINARY))
    for analysis in every:
        told_of = usability_of_flight(analysis.name, flight, ORDINARY)
        assert (told_of.state == "no") == (analysis.name not in ran.answers), analysis.name
        if analysis.name in ran.reasons and analysis.examine is None:
            assert told_of.shortfalls[0].text == ran.reasons[analysis.name]
    assert usability_of_flight("latency", flight, ORDINARY).state != "no"
    assert "no truth" in usability_of_flight("reference", seen, ORDINARY).text


@pytest.mark.parametrize("sample", ["taxi-good.csv", "taxi-short.csv"])
def test_a_system_loaded_alone_says_the_same_as_among_all(sample: str, monkeypatch: pytest.MonkeyPatch) -> None:
    flight = read(SAMPLES / sample)
    examined = [one.name for one in systems().analyses if one.examine is not None]
    alone = {name: usability_of_flight(name, flight, ORDINARY) for name in examined}
    assert [name for name in examined if len(systems_for(name).every) == 1] == [
        name for name in examined if name != "magnetic_flux"
    ]
    monkeypatch.setattr(usable, "systems_for", lambda _name: systems())
    assert alone == {name: usability_of_flight(name, flight, ORDINARY) for name in examined}


def test_no_two_systems_offer_the_same_role() -> None:
    offered = [role for one in systems().analyses for role in one.offers]
    assert len(offered) == len(set(offered))


def test_a_purpose_that_is_none_is_a_usage_error() -> None:
    code, _, error = groundstation("check", SAMPLES / "taxi-good.csv", "--for", "cooking")
    assert code == 2
    assert ", ".join((*flight_purposes(), *session_purposes())) in error


def test_a_recorded_flight_is_told_as_it_runs() -> None:
    flight = read(real_log("g1000/log_220502_135932_EGPN.csv"))
    for purpose in ("magnetic", "landing"):
        agreeing(purpose, flight)
