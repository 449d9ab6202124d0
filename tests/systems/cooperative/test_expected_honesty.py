"""The check of the pairwise filter: NEES to expect, worked out from a session without its truth."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionScenario, load_session
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.expected_honesty import expected_nees
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.study.cases import CASES, settings_of
from groundstation.systems.cooperative.study.pairwise_family import Net, pairwise_table, scenario_of

ROUNDING = 1e-6
SEED = 11


def _prepared(scenario: SessionScenario) -> tuple[Prepared, CooperativeSettings]:
    settings = replace(settings_of(scenario, CASES[0]), output_step_s=20.0, map_window_s=0.0)
    return prepare(simulate_session(scenario, SEED).session, settings), settings


@pytest.mark.parametrize("net", [Net(2, 0, 20.0), Net(2, 1, 20.0)])
def test_two_aircraft_are_one_filter_and_honest(net: Net) -> None:
    """No third vehicle: nothing is approximated but that a range to a point corrects its receiver alone."""
    found = expected_nees(*_prepared(scenario_of(net)), ())
    assert found.is_whole
    assert found.nees == pytest.approx(2.0, abs=ROUNDING)


def test_a_loop_with_a_point_is_overconfident_and_a_chain_is_less_so() -> None:
    loop, chain = (expected_nees(*_prepared(scenario_of(Net(5, 1, 20.0, form))), ()) for form in ("all", "chain"))
    assert loop.worst > 20.0
    assert chain.worst < 0.5 * loop.worst


def test_the_work_ends_at_the_limit() -> None:
    found = expected_nees(*_prepared(scenario_of(Net(5, 1, 20.0))), (), limit=4.0)
    assert not found.is_whole and found.nees[-1] > 4.0 >= found.nees[-2]


def test_an_uncertain_point_is_an_error_that_stays() -> None:
    """The filter takes it for white noise at each range; what it really makes is more."""
    base = load_session("local-three-one-point")
    scenario = replace(base, aircraft=base.aircraft[:1], points=(replace(base.points[0], position_sigma_m=100.0),))
    found = expected_nees(*_prepared(replace(scenario, link=replace(scenario.link, frame_s=5.0))), ())
    assert found.nees[-1] > 3.0


def test_a_dense_session_refuses_and_a_sparse_one_runs() -> None:
    rows = {}
    for name, net in {"dense": Net(5, 1, 20.0), "sparse": Net(3, 0, 60.0)}.items():
        scenario = scenario_of(net)
        settings = replace(settings_of(scenario, CASES[0]), output_step_s=20.0, map_window_s=0.0)
        session = simulate_session(scenario, SEED).session
        algorithms = ("dead_reckoning", "centralised", "pairwise")
        answer, findings = estimate_session(session, settings=settings, algorithms=algorithms)
        assert tuple(row.algorithm for row in answer.algorithms) == algorithms
        rows[name] = answer.algorithms[-1]
        assert ("cooperative.refused" in {one.code for one in findings}) == (name == "dense")
        assert {row.vehicle for row in answer.vehicles if row.algorithm == "pairwise"} == (
            set() if name == "dense" else set(answer.vehicle_names)
        )
        unchecked, _ = estimate_session(
            session, settings=replace(settings, pairwise_nees_limit=0.0), algorithms=algorithms
        )
        assert not unchecked.algorithms[-1].refused
        if name == "sparse":
            assert unchecked.algorithms[-1].two_sigma_r_m == rows[name].two_sigma_r_m
    assert rows["dense"].refused.startswith("refused: NEES ") and rows["dense"].two_sigma_r_m is None
    assert "10 pairs (6 loops)" in rows["dense"].refused
    assert rows["sparse"].refused == "" and rows["sparse"].expected_nees == pytest.approx(2.0, abs=0.1)


def test_the_table_of_the_family_says_what_was_expected_and_what_came() -> None:
    data = pairwise_table([Net(3, 0, 250.0), Net(5, 1, 250.0)], 2, SEED, 1)
    assert data["verdict"].tolist() == ["runs", "refused"]
    assert np.isfinite(data["measured_nees"]).all()
    assert data["refused_or_consistent"].tolist()[1] == "yes"
