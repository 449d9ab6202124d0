"""Second interval of the heading error, by states of their own: it stands beside the taxi number."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import wrap_360
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.arrays.states import BodyStates
from groundstation.simulation.taxi import TaxiCase, simulate_taxi, taxi_flight
from groundstation.systems.heading.analysis import HEADING
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.chapter import heading
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftData, Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.made_states import BY, MadeStates, made_states
from tests.report_example import example
from tests.section_contents import notes

ERROR_DEG, SIGMA_DEG = 0.7, 0.05
CASE = TaxiCase(heading_error_deg=ERROR_DEG)


@pytest.fixture(scope="module")
def flight() -> Flight:
    return taxi_flight(simulate_taxi(CASE, np.random.default_rng(1)))


def states(flight: Flight, error_deg: float = ERROR_DEG) -> BodyStates:
    """States whose heading is the INS heading less an error."""
    true = np.asarray(wrap_360(flight["ins"].values("true_heading_deg") - error_deg))
    return made_states(flight.time_s("ins"), true_heading_deg=true, true_heading_sigma_deg=SIGMA_DEG)


def run(flight: Flight, *answers: Answer) -> tuple[HeadingResult, list[str]]:
    known = Known(flight_phases(flight), settings={"heading": HeadingSettings()}, answers=by_analysis(*answers))
    found = run_analyses((HEADING,), flight, known)
    answer = found.answers["heading"]
    assert isinstance(answer, HeadingResult)
    return answer, [one.code for one in found.findings["heading"]]


def test_it_stands_beside_the_taxi_number_and_changes_nothing(flight: Flight) -> None:
    plain, codes = run(flight)
    beside, told = run(flight, MadeStates(states(flight)))
    second = beside.by_states
    assert plain.by_states is None and second is not None and told == codes
    assert replace(beside, by_states=None, figures=()) == replace(plain, figures=())
    assert second.error_deg == pytest.approx(ERROR_DEG, abs=1e-6) and second.agrees
    mounting = HeadingSettings().mounting_sigma_deg
    assert second.sigma_deg == pytest.approx(np.hypot(SIGMA_DEG, mounting), rel=1e-3)
    low, high = second.confidence95_deg
    assert (low + high) / 2.0 == pytest.approx(second.error_deg) and high - low == pytest.approx(
        3.92 * second.sigma_deg, rel=1e-3
    )
    assert second.difference_deg == pytest.approx(beside.error_deg - second.error_deg)


def test_intervals_that_do_not_meet_are_a_finding_and_a_warning_in_the_chapter(flight: Flight) -> None:
    apart, codes = run(flight, MadeStates(states(flight, ERROR_DEG + 2.0)))
    assert apart.by_states is not None and not apart.by_states.agrees and codes.count("heading.by_states") == 1
    assert apart.by_states.difference_deg == pytest.approx(-2.0, abs=0.2)
    (note,) = [text for text in notes(heading(example(apart))) if BY in text]
    assert "do not meet" in note and "not combined" in note and "GNSS velocity" in note
    (calm,) = [text for text in notes(heading(example(run(flight, MadeStates(states(flight)))[0]))) if BY in text]
    assert "Their intervals meet" in calm


def test_states_that_no_reference_are_not_used(flight: Flight) -> None:
    assert run(flight, MadeStates(states(flight), is_good=False))[0].by_states is None
    after = replace(states(flight), time_s=states(flight).time_s + 1e5)
    assert run(flight, MadeStates(after))[0].by_states is None


def test_the_stated_mounting_sigma_is_used(flight: Flight) -> None:
    settings = {"heading": HeadingSettings()}
    known = Known(
        flight_phases(flight),
        settings=settings,
        aircraft=AircraftData(mounting_sigma_deg=0.0),
        answers=by_analysis(MadeStates(states(flight))),
    )
    found = run_analyses((HEADING,), flight, known).answers["heading"]
    assert isinstance(found, HeadingResult) and found.by_states is not None
    assert found.by_states.sigma_deg == pytest.approx(SIGMA_DEG, rel=1e-3)
