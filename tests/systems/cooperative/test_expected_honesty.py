"""The check of the pairwise filter: NEES to expect, worked out from a session without its truth."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.methods.intervals import nees_limits
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionScenario, load_session
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import normalised
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.expected_honesty import expected_nees
from groundstation.systems.cooperative.joint_covariance import joint_covariances
from groundstation.systems.cooperative.relative import relative_covariances
from groundstation.systems.cooperative.settings import CooperativeSettings, InsBelief
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
    assert rows["dense"].refused.startswith("refused: a NEES of ") and rows["dense"].two_sigma_r_m is None
    assert "10 pairs (6 loops)" in rows["dense"].refused
    assert rows["sparse"].refused == "" and rows["sparse"].expected_nees == pytest.approx(2.0, abs=0.1)


def test_the_table_of_the_family_says_what_was_expected_and_what_came() -> None:
    data = pairwise_table([Net(3, 0, 250.0), Net(5, 1, 250.0)], 2, SEED, 1)
    assert data["verdict"].tolist() == ["runs", "refused"]
    assert np.isfinite(data["measured_nees"]).all()
    assert data["refused_or_consistent"].tolist()[1] == "yes"


def test_the_joint_covariance_along_a_run_is_that_of_the_centralised_filter() -> None:
    """Its own blocks, which the filter keeps; about the outputs instead of each estimate: some parts in a thousand."""
    prepared, settings = _prepared(scenario_of(Net(3, 1, 20.0)))
    run = run_algorithm(prepared, settings, "centralised")
    times = []
    for number, (at_s, joint) in enumerate(joint_covariances(prepared, settings, run)):
        times.append(at_s)
        for place, track in zip(joint.places, run.tracks, strict=True):
            sigma = np.sqrt(np.diag(track.covariance[number]))
            assert joint.P[place, place] / np.outer(sigma, sigma) == pytest.approx(
                track.covariance[number] / np.outer(sigma, sigma), abs=0.02
            )
    assert times == run.tracks[0].time_s.tolist()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("known", ["position_m", "velocity_mps", "clock_mps", "baro_m"])
def test_what_is_known_exactly_makes_no_expected_nees_that_is_no_number(known: str) -> None:
    scenario = replace(scenario_of(Net(3, 2, 10.0)), duration_s=40.0)
    settings = replace(settings_of(scenario, CASES[0]), map_window_s=0.0, judges_stations=False)
    ins = InsBelief(**{**vars(settings.ins), known: 0.0})
    settings = replace(settings, pairwise_nees_limit=100.0, ins=ins)
    session = simulate_session(scenario, SEED).session
    answer, _ = estimate_session(session, settings=settings, algorithms=("centralised", "pairwise"))
    (row,) = (one for one in answer.algorithms if one.algorithm == "pairwise")
    assert row.refused == "" and row.expected_nees is not None and 1.0 < row.expected_nees < 100.0
    assert row.two_sigma_r_m is not None and np.isfinite(row.two_sigma_r_m)


def test_relative_places_of_two_are_claimed_alike_by_centralised_and_pairwise() -> None:
    prepared, settings = _prepared(scenario_of(Net(2, 0, 20.0)))
    found = {
        name: relative_covariances(prepared, settings, run_algorithm(prepared, settings, name))
        for name in ("dead_reckoning", "centralised", "pairwise", "ranked")
    }
    assert found["ranked"] == {}
    for one, two in zip(found["centralised"][0, 1], found["pairwise"][0, 1], strict=True):
        assert one == pytest.approx(two, rel=0.01, abs=1.0)
    alone_m2, together_m2 = (np.linalg.eigvalsh(found[name][0, 1][1][-1]) for name in ("dead_reckoning", "centralised"))
    assert together_m2[0] < 0.1 * alone_m2[0]  # along the range
    assert together_m2[1] > 0.9 * alone_m2[1]  # across it nothing is measured


def test_errors_of_relative_places_are_what_the_centralised_filter_claims() -> None:
    scenario, nees = scenario_of(Net(3, 0, 20.0)), []
    for run in range(12):
        simulated = simulate_session(scenario, SEED, run)
        settings = replace(settings_of(scenario, CASES[0]), output_step_s=100.0, map_window_s=0.0)
        prepared = prepare(simulated.session, settings)
        done = run_algorithm(prepared, settings, "centralised")
        errors = [
            track.state[:, :2] - truth.states[np.searchsorted(truth.time_s, track.time_s - 1e-6), :2]
            for track, truth in zip(done.tracks, simulated.truth, strict=True)
        ]
        for (i, j), (_, covariance) in relative_covariances(prepared, settings, done).items():
            nees.append(normalised(errors[i] - errors[j], covariance)[-1])
    low, high = nees_limits(2, 12, 0.999)
    assert low < float(np.mean(nees)) < high
