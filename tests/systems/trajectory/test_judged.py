"""Trajectory judged by a reference, by its role: claims that hold, claims that do not, mounting and lever arm."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import wrap_360
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.results.arrays.states import BodyStates
from groundstation.simulation.processes import gauss_markov
from groundstation.systems.known import Known
from groundstation.systems.reference.analysis import REFERENCE
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.systems.trajectory.figures import states_of
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table
from tests.systems.trajectory.made import STEP_S, track
from tests.systems.trajectory.made_answers import accepted

START_NS = 1_777_874_400_000_000_000
LASTS_S = 3.0  # of the errors
MOUNTING_DEG = 1.5
CLAIMED = {
    "velocity_north_mps": "velocity_north_sigma_mps",
    "velocity_east_mps": "velocity_east_sigma_mps",
    "roll_deg": "roll_sigma_deg",
    "pitch_deg": "pitch_sigma_deg",
    "true_heading_deg": "true_heading_sigma_deg",
}


def flight() -> Flight:
    """A flight with nothing but its truth: that of the antenna, at 10 Hz."""
    exact = states_of(track(), "ellipsoid").at_point(*accepted().antenna_arm_m)
    rows = slice(0, None, 2)
    time_ns = START_NS + np.rint(exact.time_s[rows] * NS_PER_S).astype(np.int64)
    columns = {
        name: Column(np.asarray(values[rows], dtype=np.float64))
        for name, values in exact.columns.items()
        if "sigma" not in name and name not in ("time_s", "segment")
    }
    truth = Table("truth", time_ns, columns, np.arange(len(time_ns)), Column(time_ns))
    return Flight({"truth": truth}, {}, START_NS, True, "a.csv")


def judged(factor: float) -> ReferenceResult:
    """Judgement of a trajectory whose errors are so many times what it claims, its case turned by the mounting."""
    states = states_of(track(), "ellipsoid")
    errors = gauss_markov(np.random.default_rng(4), (len(CLAIMED), len(states)), STEP_S, factor, LASTS_S)
    wrong = dict(states.columns)
    for error, (name, sigma) in zip(errors, CLAIMED.items(), strict=True):
        wrong[name] = wrong[name] + error * wrong[sigma]
    wrong["true_heading_deg"] = wrap_360(wrong["true_heading_deg"] + MOUNTING_DEG)
    made = accepted()
    figures = tuple(one for one in made.figures if one.name != "trajectory_states")
    answer = replace(made, figures=(*figures, BodyStates(**wrong)))
    of = flight()
    known = Known(flight_phases(of.without("truth")), answers={"trajectory": answer})
    return REFERENCE.run(of, known, ReferenceSettings()).answer


@pytest.mark.parametrize(("factor", "states"), [(1.0, {"consistent"}), (3.0, {"too_sure"})], ids=["honest", "sure"])
def test_claims_of_a_trajectory_are_judged(factor: float, states: set[str]) -> None:
    answer = judged(factor)
    assert answer.is_judge, answer.reason
    claims = {(row.quantity, row.axis): row for row in answer.claims}
    wanted = [("velocity", "horizontal"), ("attitude", "roll"), ("attitude", "pitch"), ("attitude", "heading")]
    assert {claims[one].state for one in wanted} == states, {one: claims[one].share_inside95 for one in wanted}
    heading = answer.error("trajectory", "attitude", "heading")
    assert heading is not None and heading.spread.mean == pytest.approx(MOUNTING_DEG, abs=0.1 * factor)


def test_the_antenna_is_what_is_judged() -> None:
    row = judged(1.0).error("trajectory", "position", "horizontal")
    assert row is not None and row.spread.rmse < 0.05, "the arm of 0.61 m is at its place"
