"""The cooperative study: its table, its verdicts and its page, on few runs."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.methods.intervals import nees_limits
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import load_session, session_names
from groundstation.systems.cooperative.consistency import normalised
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.geometry import dilution
from groundstation.systems.cooperative.study.cases import CASES, FIRST_SEED, settings_of
from groundstation.systems.cooperative.study.cooperative import study_cooperative
from groundstation.systems.cooperative.study.page import is_near, measured
from groundstation.systems.cooperative.study.runs import CaseRun, diverges
from groundstation.systems.cooperative.study.source_formula import RULES, run_rule


def outcome(error_m: tuple[float, float], late_ratio: float = 1.0) -> CaseRun:
    error, sigma = np.array(error_m), np.array([3.0, 4.0])
    return CaseRun(error, sigma, 2.0, 3.0 * error, 2.0 * sigma, error[::-1], late_ratio, 1.0, float("nan"), 0.0)


def test_every_case_names_a_session_and_one_of_its_aircraft() -> None:
    for case in CASES:
        assert case.session in session_names()
        scenario = load_session(case.session)
        assert case.aircraft in {one.name for one in scenario.aircraft}
        assert case.at_s is None or case.at_s <= scenario.duration_s
        assert settings_of(scenario, case).ins.position_m == scenario.errors.position_m
    assert len({case.name for case in CASES}) == len(CASES)


def test_metrics_by_hand() -> None:
    """Errors (6, 8) and (-6, -8): 10 m radial; sigma 5 m; twice that under the other algorithm, errors thrice."""
    several = [outcome((6.0, 8.0)), outcome((-6.0, -8.0)), outcome((6.0, 8.0))]
    case = CASES[0]
    assert measured(case, several) == pytest.approx((10.0, 20.0))
    assert measured(replace(case, metric="sigma_r_m"), several) == pytest.approx((5.0, 10.0))
    assert measured(replace(case, metric="gain_over_ins"), several) == pytest.approx((2.0, 3.0))
    assert measured(replace(case, metric="sigma_x_m"), several) == pytest.approx((3.0, 6.0))
    assert measured(replace(case, metric="sigma_y_m"), several) == pytest.approx((4.0, 8.0))
    assert measured(replace(case, metric="correlation"), several)[1] == pytest.approx(1.0)


def test_verdicts() -> None:
    case = replace(CASES[0], low=10.0, high=20.0)
    assert [is_near(case, value) for value in (4.9, 5.1, 39.0, 41.0)] == [False, True, True, False]
    assert is_near(replace(case, high=float("inf")), 1e9) is True
    assert is_near(replace(case, low=float("nan"), high=float("nan")), 1.0) is None
    assert not diverges([outcome((1.0, 1.0), 2.9)]) and diverges([outcome((1.0, 1.0), 3.1)])


@pytest.mark.slow
def test_a_small_study_twice_is_the_same_and_says_what_it_did() -> None:
    cases = [case for case in CASES if case.name in ("one-four-satellites", "exact-alone")]
    one, two = (study_cooperative(1, 1, cases=cases, nets=(), workers=1) for _ in range(2))
    assert one.markdown == two.markdown
    table = one.tables[0]
    assert str(FIRST_SEED + 1) in one.markdown and "3-4 m" in one.markdown
    assert table["measured"][0] < 10.0 and table["diverges"][1] == "yes"
    assert np.isnan(table["spectral_radius"][0]) and table["spectral_radius"][1] > 1.0


def test_dilution_of_two_ranges_is_one_over_the_sine() -> None:
    for angle_deg in (20.0, 90.0, 137.0):
        angle = np.deg2rad(angle_deg)
        H = np.array([[1.0, 0.0], [np.cos(angle), np.sin(angle)]])
        assert np.linalg.det(H.T @ H) == pytest.approx(np.sin(angle) ** 2)
        assert dilution(H, has_clock=False)[0] == pytest.approx(np.sqrt(2.0) / np.sin(angle))
        assert all(np.isnan(value) for value in dilution(H, has_clock=True))


def test_cases_that_differ_in_the_axis_alone_share_their_runs() -> None:
    cases = {case.name: case for case in CASES}
    assert cases["turn-after"].run == cases["turn-after-y"].run != cases["turn-before"].run
    assert cases["turn-after"].metric == "sigma_x_m" and np.isnan(cases["turn-after-y"].low)
    assert cases["formula-25"].run != cases["considered-25"].run


def test_the_published_formula_claims_a_gain_that_its_errors_do_not_show() -> None:
    """Errors of the rule that considers those of the primaries stay inside its sigma."""
    shipped = load_session("ranked-25-degrees")
    scenario = replace(shipped, link=replace(shipped.link, frame_s=5.0), epoch_s=5.0)
    settings = replace(settings_of(scenario, replace(CASES[0], update="simultaneous")), output_step_s=50.0)
    runs = 6
    nees = dict.fromkeys(RULES, 0.0)
    sigma_m: dict[str, float] = {}
    for run in range(runs):
        simulated = simulate_session(scenario, 4, run)
        prepared = prepare(simulated.session, settings)
        for rule in RULES:
            track, truth = run_rule(prepared, settings, rule).tracks[2], simulated.truth[2]
            error = track.state[:, :2] - truth.states[np.searchsorted(truth.time_s, track.time_s - 1e-6), :2]
            nees[rule] += float(normalised(error, track.horizontal_m2)[-1]) / runs
            sigma_m[rule] = float(track.two_sigma_r_m[-1])
    assert sigma_m["multilevel_noise"] / sigma_m["published_formula"] > 1.5
    low, high = nees_limits(2, runs, 0.999)
    assert low < nees["considered_errors"] < high < 0.1 * nees["published_formula"]


def test_a_verdict_is_given_on_what_was_published() -> None:
    for case in CASES:
        is_published = case.published not in ("not given", "none (beyond the source)")
        assert (case.verdict == "beyond the source") != is_published, case.name
        assert case.why or case.verdict in ("reproduced", "beyond the source"), case.name
