"""Trajectory in Python: answer and states of a log, and of one that lacks them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError
from groundstation.pipeline.api import OpenLog
from groundstation.results.answer import by_analysis
from groundstation.systems.trajectory.figures import states_of
from tests.systems.trajectory.made import track
from tests.systems.trajectory.made_answers import accepted

GOOD = Path(__file__).parents[3] / "sample_logs" / "taxi-good.csv"


@pytest.fixture(scope="module")
def flight() -> OpenLog:
    """A log whose results hold a made trajectory."""
    opened = groundstation.open(GOOD)
    assert isinstance(opened, OpenLog)
    states = track(60.0)
    answer = accepted(states)
    figures = (*opened.results.figures, states_of(states, "ellipsoid"))
    opened.__dict__["results"] = replace(opened.results, answers=by_analysis(answer), figures=figures)
    return opened


def test_states_are_a_table_on_the_clock_of_the_flight(flight: OpenLog) -> None:
    assert flight.trajectory().state == "accepted"
    states, was = flight.states(), track(60.0)
    assert np.array_equal(states["true_heading_deg"], was.heading_deg)
    assert np.allclose(states.flight_time_s, was.time_s)
    assert states.units["velocity_down_sigma_mps"] == "m/s"
    frame = states.to_frame()
    assert str(frame.index[0]) == str(flight.results.to_frame("trajectory_states")["utc"][0])
    assert list(flight.trajectory().to_frame("outages")["length_s"]) == [10.0, 30.0, 60.0, 120.0]


def test_a_flight_without_states_says_so(flight: OpenLog) -> None:
    bare = groundstation.open(GOOD)
    with pytest.raises(NotAssessableError, match="trajectory"):
        bare.states()
    kept = tuple(one for one in flight.results.figures if one.name != "trajectory_states")
    bare.__dict__["results"] = replace(flight.results, figures=kept)
    with pytest.raises(NotAssessableError, match=r"its states are not kept.*run the log again"):
        bare.states()
