"""Ground stations judged: found when off, left alone when right, and what their error does to the answer."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.datums import DATUMS
from groundstation.base.errors import SettingsError
from groundstation.chapters.parts import Grid
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import SessionPoint, load_session
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.estimate import estimate_session
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.smoother.smoothed import run_smoothed
from groundstation.systems.cooperative.stations import hypotheses, response
from groundstation.systems.cooperative.stations.hypotheses import FOUND, chance_of, noncentrality
from groundstation.systems.cooperative.stations.information import EACH, station_information
from groundstation.systems.cooperative.stations.judge import StationJudgement, judge_stations, survey_of
from groundstation.systems.cooperative.stations.rows import station_findings, stations_answer
from groundstation.systems.cooperative.stations_chapter import stations_parts, stations_warning
from groundstation.systems.cooperative.study.station_cases import CASES, KNOWN_CLOCKS, StationCase
from groundstation.systems.cooperative.study.station_runs import drawn
from groundstation.systems.cooperative.study.stations import study_stations
from groundstation.tables.session import Session
from groundstation.tables.session_assemble import session_from_flights
from groundstation.tables.session_settings import Station, Stations

BY_NAME = {case.name: case for case in CASES}
SEED = 4711
# Believed less true place of 55.75 N, 37.6 E (north, east, m): PROJ 9, pipelines of the EPSG operations by their codes
# (pyproj, Transformer.from_pipeline), laid off by pyproj.Geod.
OF_PROJ = {
    "SK-42": (-4.704, 117.708),
    "SK-95": (-6.606, 116.365),
    "ED50": (46.813, 24.561),
    "NAD27": (198.035, -131.639),
    "Tokyo": (-284.896, -491.326),
}


def moved(session: Session, station: int, north_m: float, east_m: float) -> Session:
    points = list(session.points)
    x, y, z = points[station].position_m
    points[station] = replace(points[station], position_m=(x + north_m, y + east_m, z))
    return replace(session, points=tuple(points))


def judged(name: str, run: int = 0) -> tuple[StationCase, StationJudgement, dict[int, np.ndarray]]:
    case = BY_NAME[name]
    _, session, wrong = drawn(case, SEED, run)
    return case, judge_stations(session, case.settings()), wrong


def test_a_metre_of_a_station_moves_the_answer_as_it_is_said_to() -> None:
    """Against the smoother itself, with the station elsewhere; weights that do not follow the residuals."""
    scenario = replace(load_session("local-three-two-points"), duration_s=100.0)
    settings = BY_NAME["two-right"].settings()
    settings = replace(settings, smoother=replace(settings.smoother, robust_sigmas=0.0, correlated_share=0.0))
    session = simulate_session(scenario, SEED).session
    information, solved, _ = station_information(session, settings)
    before = run_smoothed(prepare(session, settings), settings)
    for axis in (0, 1):
        other = moved(session, 1, 10.0 * (axis == 0), 10.0 * (axis == 1))
        after = run_smoothed(prepare(other, settings), settings)
        for vehicle, (one, two) in enumerate(zip(before.tracks, after.tracks, strict=True)):
            real = (two.position_m - one.position_m)[:, :2] / 10.0
            said = information.answer[:, vehicle, :, EACH + axis]
            at = np.searchsorted(one.time_s, solved.knots.time_s).clip(0, len(real) - 1)
            assert np.abs(real[at] - said).max() < 0.02


def test_a_long_session_is_passed_in_pieces_with_the_same_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Covariances at all knots of 20 aircraft over two hours are more than a gigabyte."""
    scenario = replace(load_session("local-three-two-points"), duration_s=120.0)
    session = simulate_session(scenario, SEED).session
    _, solved, _ = station_information(session, BY_NAME["two-right"].settings())
    columns = np.random.default_rng(1).standard_normal((len(solved.problem.residual), 2))
    one_covariance = 8 * len(solved.problem.start) ** 2
    found, most = [], []
    for kept in (1e8, 10.0 * one_covariance):
        monkeypatch.setattr(response, "KEPT_BYTES", kept)
        tracemalloc.start()
        found.append(response.respond(solved.problem, columns))
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    for name in ("moved", "left", "duals"):
        assert getattr(found[1], name) == pytest.approx(getattr(found[0], name), abs=1e-9)
    assert most[0] - most[1] > 0.5 * one_covariance * solved.problem.knots


def test_datums_are_those_of_proj() -> None:
    assert {datum.name for datum in DATUMS} == set(OF_PROJ)
    for datum in DATUMS:
        assert datum.error_m(55.75, 37.6) == pytest.approx(OF_PROJ[datum.name], abs=0.06)  # a plane, and height 0
    assert DATUMS[0].is_used_at(56.0, 38.0) and DATUMS[0].is_used_at(66.0, -170.0)
    assert not DATUMS[0].is_used_at(40.0, -75.0)


def test_a_stations_file_in_another_datum_is_taken_to_wgs_84() -> None:
    """The latitude and longitude of PROJ for 55.75 N, 37.6 E in SK-42 (EPSG operation 5044)."""
    one = Station("N1", 55.75, 37.6, 100.0)
    session = session_from_flights((), Stations((one,), datum="SK-42")).session
    assert session.points[0].place_deg == pytest.approx((55.75004226860743, 37.598125509681964), abs=1e-9)
    assert session_from_flights((), Stations((one,))).session.points[0].place_deg == (55.75, 37.6)
    with pytest.raises(SettingsError, match="SK-42, SK-95"):
        Stations((one,), datum="SK42")


def test_the_smallest_detectable_error_is_found_as_often_as_it_says() -> None:
    rng, questions, level = np.random.default_rng(1), 4, 0.01
    noise = rng.standard_normal((40_000, 2))
    noise[:, 0] += np.sqrt(noncentrality(questions, level))
    found = [chance_of(float(square), 2) * questions < level for square in (noise**2).sum(axis=1)]
    assert np.mean(found) == pytest.approx(FOUND, abs=0.005)


def test_right_stations_are_left_alone() -> None:
    for name in ("two-right", "three-right"):
        _, judgement, _ = judged(name)
        assert judgement.doubts == () and judgement.raised == {}
        assert judgement.session.points[0].position_sigma_m == 0.0
        best, worst = judgement.detectable_m(0)
        assert 10.0 < best <= worst < 500.0


def test_a_station_500_m_off_is_found_and_named_where_a_third_one_tells() -> None:
    _, judgement, wrong = judged("three-500")
    assert judgement.named() == tuple(wrong) == (1,)
    (doubt,) = judgement.doubts
    shift = doubt.place
    assert shift is not None
    miss = shift.error_m - wrong[1]
    assert miss @ np.linalg.solve(shift.covariance_m2, miss) < 13.8  # one in a thousand
    survey = survey_of(judgement, 1)
    assert survey is not None
    assert np.abs((survey[0] + wrong[1]) / survey[1]).max() < 4.0


def test_two_stations_that_contradict_each_other_are_both_in_doubt_and_said_so() -> None:
    case = BY_NAME["two-500"]
    simulated, session, _ = drawn(case, SEED, 1)
    truth = {one.name: (one.time_s, one.position_m) for one in simulated.truth}
    names = ("dead_reckoning", "centralised", "smoothed")
    answer, findings = estimate_session(session, settings=case.settings(), algorithms=names, truth=truth)
    assert answer.stations is not None
    doubted = [row for row in answer.stations.rows if row.verdict != "fits"]
    assert "N2" in {row.station for row in doubted}
    (finding,) = (one for one in findings if one.code == "cooperative.station_drift")
    assert finding.severity == "warn" and all(row.station in finding.text for row in doubted)
    assert all(row.used_sigma_m > 400.0 for row in doubted)
    unjudged, none = estimate_session(
        session, settings=replace(case.settings(), judges_stations=False), algorithms=names, truth=truth
    )
    assert unjudged.stations is None and not [one for one in none if one.code == "cooperative.station_drift"]
    before, after = (next(row for row in one.algorithms if row.algorithm == "smoothed") for one in (unjudged, answer))
    assert before.nees is not None and after.nees is not None
    assert before.nees > 100.0 and after.nees < 10.0


def test_a_station_with_a_wrong_clock_is_told_from_one_that_stands_elsewhere() -> None:
    _, judgement, _ = judged("three-delay-300")
    (doubt,) = judgement.doubts
    assert doubt.station == 1 and doubt.left_out
    assert doubt.tests[0].error_m[0] == pytest.approx(300.0, abs=4.0 * doubt.tests[0].size_sigma_m)
    assert judgement.session.points[1].name not in set(judgement.session.ranges.source.tolist())


def test_the_delay_of_a_station_left_out_is_inside_its_interval() -> None:
    """One linear step about an answer that leans on the late ranges finds 133 of 150 m, sigma 5 m."""
    case = replace(BY_NAME["delay-300"], delay_m=150.0, believed=KNOWN_CLOCKS)
    _, session, _ = drawn(case, SEED, 2)
    judgement = judge_stations(session, case.settings())
    (doubt,) = (one for one in judgement.doubts if one.left_out)
    (delay,) = doubt.tests
    assert doubt.station == 1 and delay.size_sigma_m < 5.0
    assert delay.error_m[0] == pytest.approx(150.0, abs=2.0 * delay.size_sigma_m)


def test_a_shift_of_one_station_or_a_delay_of_another_is_told_as_either() -> None:
    case = replace(BY_NAME["delay-300"], delay_m=60.0, believed=KNOWN_CLOCKS)
    _, session, _ = drawn(case, 90_000, 0)
    answer = stations_answer(judge_stations(session, case.settings()), session, session.names)
    assert [row.verdict for row in answer.rows] == ["one of several", "left out"]
    either, late = (finding.text for finding in station_findings(answer))
    assert "or ranges of station N2 are off by a delay: the session does not tell which" in either
    assert late.startswith("ranges of station N2 are off by")
    result = CooperativeResult("local", "smoothed", (), (), stations=answer)
    assert "contradict" not in either + stations_warning(result) and "Station N1 is " in stations_warning(result)


def test_a_station_that_nobody_hears_does_not_fit() -> None:
    case = BY_NAME["two-right"]
    _, session, _ = drawn(case, SEED, 0)
    unheard = replace(session.points[0], name="N9", position_m=(1e4, 2e4, 0.0))
    session = replace(session, points=(*session.points, unheard))
    answer = stations_answer(judge_stations(session, case.settings()), session, session.names)
    assert [row.verdict for row in answer.rows] == ["fits", "fits", "not judged"]
    assert answer.in_doubt == () and station_findings(answer) == ()
    (table, *_) = stations_parts(CooperativeResult("local", "smoothed", (), (), stations=answer))
    assert isinstance(table, Grid) and table.rows[2][3] == ""


def test_stations_in_another_datum_are_told_where_the_answer_puts_them() -> None:
    case = BY_NAME["two-datum"]
    _, session, wrong = drawn(case, SEED, 0)
    answer = stations_answer(judge_stations(session, case.settings()), session, session.names)
    for station, row in enumerate(answer.rows):
        assert (row.used_sigma_m, row.survey_sigma_north_m) == (0.0, 0.0)
        assert [row.survey_north_m, row.survey_east_m] == pytest.approx(
            (-wrong[station]).tolist(), abs=3.0
        )  # SK-95 is told as well


def test_no_station_that_is_refused_fits_however_many_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hypotheses, "CANNOT_TELL", 1e-9)  # each round puts one station in doubt
    points = tuple(SessionPoint(f"P{i}", 60e3 * np.cos(i), 60e3 * np.sin(i)) for i in range(5))
    case = replace(BY_NAME["two-right"], points=points)
    scenario = replace(case.scenario(), duration_s=30.0)
    session = simulate_session(scenario, SEED).session
    for station in range(5):
        session = moved(session, station, 400.0 * np.cos(2.4 * station), 400.0 * np.sin(2.4 * station))
    answer = stations_answer(judge_stations(session, case.settings()), session, session.names)
    assert [row.station for row in answer.rows if row.chance < 0.001 and row.verdict == "fits"] == []
    assert len(answer.in_doubt) >= 5


def test_ins_worse_than_believed_is_taken_as_it_is_and_accuses_no_station() -> None:
    _, judgement, _ = judged("worse-ins")
    assert judgement.doubts == ()
    assert 1.3 < judgement.raised["velocity_mps"] < 3.0 and "clock_mps" not in judgement.raised


def test_stations_in_another_datum_are_told_where_the_ins_is_good_enough() -> None:
    _, judgement, wrong = judged("two-datum")
    assert judgement.doubts == ()
    for station, before in enumerate(drawn(BY_NAME["two-datum"], SEED, 0)[1].points):
        taken = np.array(judgement.session.points[station].position_m) - before.position_m
        assert taken[:2] == pytest.approx(-wrong[station], abs=3.0)  # SK-95 lies 2 m from SK-42
    assert [one.name for one in judgement.datums if one.is_told][:1] == ["SK-42"]
    _, poor, _ = judged("two-datum-poor")
    assert {one.name for one in poor.datums} == {"SK-42", "SK-95", "ED50"}
    assert not any(one.is_decidable or one.is_told for one in poor.datums)


@pytest.mark.slow
def test_a_small_study_twice_is_the_same() -> None:
    cases = [BY_NAME["two-right"]]
    one, two = (study_stations(1, 1, cases=cases, workers=1) for _ in range(2))
    assert one.markdown == two.markdown and one.tables[0]["found_count"][0] == 0
