"""Touchdown by the states of a best trajectory, told beside the figure of the recorded height."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.chapters.markdown import markdown
from groundstation.results.answer import by_analysis
from groundstation.results.arrays.states import BodyStates
from groundstation.simulation.approach import ApproachScenario, FinalMotion, Recorded, TrueRunway, simulate_approach
from groundstation.systems.known import Known, Runway, SiteData
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import LandingResult
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.touchdown_answer import LAST_SINK_S, SINK_S, Touchdown
from groundstation.tables.phases import flight_phases
from tests.report_example import example
from tests.states_example import MadeStates, states_of
from tests.told import chapter_of

RUNWAY = TrueRunway(56.0, 38.0, 47.0)
SIMULATED = simulate_approach(
    ApproachScenario(
        RUNWAY, flown=FinalMotion(start_distance_m=18_000.0), recorded=Recorded(step_deg=0.0, dot_step=1e-6)
    )
)
SITE = SiteData(runways=(Runway("05", 47.0, latitude_deg=56.0, longitude_deg=38.0, length_m=RUNWAY.length_m),))
SIGMA = 0.1
FLARED_MPS, FLARED_S = 0.4, LAST_SINK_S + 0.1  # sink rate behind the flare, and for how long


def states() -> BodyStates:
    """States at the recorded places, that sink at 3 m/s and from FLARED_S before the touchdown at 0.4 m/s."""
    flight = SIMULATED.flight
    topic = next(one for one in flight.topics() if flight[one].has("latitude_deg"))
    time_s = np.arange(0.0, flight.duration_s, 0.05)
    place = {
        name: np.interp(time_s, flight.time_s(topic), flight[topic].values(name))
        for name in ("latitude_deg", "longitude_deg")
    }
    down = np.where(time_s < touchdown(None).time_s - FLARED_S, 3.0, FLARED_MPS)
    return states_of(time_s, SIGMA, velocity_down_mps=down, **place)


def answer(made: MadeStates | None) -> LandingResult:
    known = Known(flight_phases(SIMULATED.flight), site=SITE, answers=by_analysis(made))
    return LANDING.run(SIMULATED.flight, known, LandingSettings()).answer


def touchdown(made: MadeStates | None) -> Touchdown:
    found = answer(made).approaches[0].touchdown
    assert found is not None
    return found


def test_sink_rate_and_place_stand_beside_the_recorded_ones() -> None:
    recorded, made = touchdown(None), touchdown(MadeStates(states()))
    assert recorded.by_states is None and made.by_states is not None
    assert replace(made, by_states=None) == recorded, "nothing that is recorded changes"
    expected = (3.0 * (SINK_S - FLARED_S) + FLARED_MPS * FLARED_S) / SINK_S
    assert made.by_states.sink_rate_mps == pytest.approx(expected, abs=0.1)
    assert made.by_states.last_sink_rate_mps == pytest.approx(FLARED_MPS, abs=1e-9)
    assert made.by_states.past_threshold_m == pytest.approx(recorded.past_threshold_m, abs=3.0)
    assert made.by_states.sink_rate_sigma_mps == pytest.approx(SIGMA)


def test_it_is_told_with_its_origin_and_interval() -> None:
    found = answer(MadeStates(states()))
    section = chapter_of(replace(example(), answers=by_analysis(found), figures=found.figures), found)
    told = markdown(section).replace("\u202f", " ")
    assert "Sink rate of the trajectory" in told and "by the best trajectory" in told
    assert "± 0.20 m/s" in told and "0.40 m/s" in told


@pytest.mark.parametrize("made", [MadeStates(states(), accepted=False), MadeStates(None)], ids=["doubtful", "not kept"])
def test_states_that_do_not_hold_are_not_used(made: MadeStates) -> None:
    assert touchdown(made).by_states is None


def test_states_that_end_before_the_touchdown_are_not_used() -> None:
    whole = states()
    assert touchdown(MadeStates(whole.where(whole.time_s < touchdown(None).time_s - 1.0))).by_states is None
