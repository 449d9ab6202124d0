"""Landing by locators: bearings to places and back, their errors, a simulated approach from end to end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.methods.bearings import (
    BearingFix,
    distance_from_bearing_m,
    distance_sigma_m,
    relative_bearings,
    side_from_difference_m,
    side_sigma_m,
    solve_bearings,
)
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import load_configuration
from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.results.answer import by_analysis
from groundstation.results.flight import FlightResults, Source
from groundstation.simulation.scenario import Scenario
from groundstation.systems.analysis import Found
from groundstation.systems.known import Beacon, Ground, Runway, SiteData
from groundstation.systems.landing.beacons.analysis import LANDING_BEACONS
from groundstation.systems.landing.beacons.answer import BeaconLanding
from groundstation.systems.landing.beacons.approach import Deviations, over_known_ground
from groundstation.systems.landing.beacons.settings import LandingBeaconsSettings
from tests.recording_contents import Contents
from tests.saved import load
from tests.systems.landing.example import BEACONS, approach_scenario, flown, known_of
from tests.told import write_recording

PLACES = np.array([(-one.before_threshold_m, one.right_m) for one in BEACONS])
EXACT_M = 1e-3  # of a solution of exact bearings
SETTINGS = LandingBeaconsSettings(bearing_sigma_deg=1.0)
SHARE, COUNTING = 0.95, 0.02  # of 2000 draws, and curvature of the bearings


def analysed(scenario: Scenario, beacons: tuple[Beacon, ...] = BEACONS) -> Found[BeaconLanding]:
    simulated, places = flown(scenario)
    return LANDING_BEACONS.run(simulated.flight, known_of(simulated, places, beacons), SETTINGS)


@pytest.mark.parametrize("turn_deg", [0.0, 137.0, -12.0])
def test_exact_bearings_give_the_exact_place(turn_deg: float) -> None:
    before = np.array([9000.0, 6000.0, 3000.0, 2000.0, 1500.0, 700.0, 300.0, 0.0, -200.0])
    right = np.linspace(-60.0, 60.0, len(before))
    seen = relative_bearings(-before, right, turn_deg, PLACES)
    found = solve_bearings(seen, PLACES, 1.0)
    assert found.along_m == pytest.approx(-before, abs=EXACT_M)
    assert found.right_m == pytest.approx(right, abs=EXACT_M)
    assert wrap_180(found.off_course_deg - turn_deg) == pytest.approx(0.0, abs=1e-6)


def test_no_place_found_is_a_wrong_one() -> None:
    rng = np.random.default_rng(3)
    before, right = rng.uniform(-250.0, 9000.0, 4000), rng.uniform(-60.0, 60.0, 4000)
    found = solve_bearings(relative_bearings(-before, right, rng.uniform(-12.0, 12.0, 4000), PLACES), PLACES, 1.0)
    known = np.isfinite(found.along_m)
    assert known.mean() > 0.95
    assert np.abs(found.along_m[known] + before[known]).max() < 0.1


def test_jacobian_by_which_errors_travel_is_that_of_central_differences() -> None:
    place, step = np.array([-1500.0, 30.0]), 1e-3
    exact = relative_bearings([place[0]], [place[1]], [4.0], PLACES)
    moved = [solve_bearings(exact + step * one, PLACES, 1.0) for one in (*np.eye(3), *-np.eye(3))]
    places = np.array([(one.along_m[0], one.right_m[0]) for one in moved])
    slope = (places[:3] - places[3:]) / (2.0 * np.deg2rad(step))
    expected = solve_bearings(exact, PLACES, 1.0).covariance[0]
    assert slope.T @ slope * np.deg2rad(1.0) ** 2 == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("before_m", [2000.0, 500.0, 320.0, 0.0])
def test_drawn_errors_stay_in_the_band_in_95_percent(before_m: float) -> None:
    rng = np.random.default_rng(8)
    exact = relative_bearings(np.full(2000, -before_m), np.zeros(2000), 5.0, PLACES)
    found = solve_bearings(exact + rng.standard_normal(exact.shape), PLACES, 1.0)
    sigma = np.sqrt(solve_bearings(exact[:1], PLACES, 1.0).covariance[0].diagonal())
    for error, one in ((found.along_m + before_m, sigma[0]), (found.right_m, sigma[1])):
        assert np.mean(np.abs(error) < 1.959964 * one) == pytest.approx(SHARE, abs=COUNTING)


def test_difference_of_bearings_tells_the_side_and_changes_sign_at_each_locator() -> None:
    before = np.array([6000.0, 2500.0, 500.0])
    seen = relative_bearings(-before, np.full(3, 40.0), np.array([9.0, -9.0, 3.0]), PLACES)
    difference = seen[:, 0] - seen[:, 1]
    assert side_from_difference_m(difference, before, 4000.0, 1000.0) == pytest.approx(40.0, abs=1e-6)
    assert np.sign(wrap_180(difference[[0, 2]])).tolist() == [-1.0, -1.0]
    assert abs(wrap_180(difference[1])) > 90.0  # between them one is ahead and one behind


def test_bearing_from_the_nose_alone_misreads_the_distance_by_the_crab() -> None:
    """1000 m before the threshold, beacon 1000 m aside, 5 degrees of crab: 839 or 1192 m."""
    side = np.array([[0.0, 1000.0]])
    for crab_deg, read_m in ((-5.0, 839.0), (5.0, 1192.0), (0.0, 1000.0)):
        bearing = relative_bearings([-1000.0], [0.0], [crab_deg], side)[0]
        assert distance_from_bearing_m(bearing, 1000.0)[0] == pytest.approx(read_m, abs=0.5)


def test_category_two_is_refuted_laterally_and_met_in_height_near_the_threshold_alone() -> None:
    assert 2.0 * side_sigma_m(320.0, 1.0, 4000.0, 1000.0) == pytest.approx(41.0, abs=0.5)
    slope = np.tan(np.deg2rad(3.0))
    glide_95 = 1.96 * slope * distance_sigma_m(np.array([0.0, 250.0, 1000.0]), 1.0, 500.0)
    assert (glide_95 < 2.0).tolist() == [True, True, False]


@pytest.fixture(scope="module")
def found() -> Found[BeaconLanding]:
    return analysed(approach_scenario())


def test_deviations_of_a_simulated_approach_agree_with_the_truth(found: Found[BeaconLanding]) -> None:
    simulated, places = flown(approach_scenario())
    data = found.answer.figures[0]
    rows = np.searchsorted(simulated.trajectory.time_ns / 1e9, data["time_s"])
    near = np.isfinite(data["lateral_m"]) & (data["before_threshold_m"] < 2500.0)
    slope = np.tan(np.deg2rad(3.0))
    true_glide = places.up_m - (15.0 - places.along_m * slope)
    for values, true, sigma in (
        (data["lateral_m"], places.right_m[rows], data["lateral_sigma_m"]),
        (data["before_threshold_m"], -places.along_m[rows], data["distance_sigma_m"]),
        (data["glide_path_m"], true_glide[rows], data["glide_path_sigma_m"]),
    ):
        normal = np.abs((values - true) / sigma)[near]
        assert np.mean(normal < 1.959964) > 0.9
        assert np.median(normal) > 0.3
    assert found.answer.approaches[0].terrain_m < 4.0
    assert found.findings == ()


def test_the_answer_tells_distance_side_and_category(found: Found[BeaconLanding]) -> None:
    row = next(one for one in found.answer.rows if one.before_threshold_m == 750.0)
    assert row.lateral_m == pytest.approx(-20.0, abs=row.lateral_95_m)  # the threshold lies 20 m right of the flight
    assert {one.lateral_category for one in found.answer.rows} <= {"", "CAT I"}
    assert LANDING_BEACONS.sentence({"landing_beacons": found.answer}).startswith("1 approach by bearings")


def test_the_tab_has_every_position_on_its_axes(found: Found[BeaconLanding], tmp_path: Path) -> None:
    simulated, _ = flown(approach_scenario())
    flight, answer = simulated.flight, found.answer
    source = Source("a.csv", "00" * 32, 0, "flat-csv")
    bare = FlightResults("20260504T060000Z_a", source, {}, flight.start_ns, flight.duration_s, "ok")
    results = FlightResults(**{**vars(bare), "answers": by_analysis(answer), "figures": answer.figures})
    write_recording(tmp_path / "flight.rrd", flight, results)
    contents = Contents(tmp_path / "flight.rrd")
    data = answer.figures[0]
    near = (data["straight_before_threshold_m"] < 5000.0) & (data["straight_before_threshold_m"] > -500.0)
    for part, name, most_m in (("right_of_course", "lateral_m", 150.0), ("above_glide_path", "glide_path_m", 40.0)):
        entities = [one for one in contents.fixed if part in one and one.endswith("_dots/0")]
        drawn = [batch.column("Points2D:positions")[0].as_py() for one in entities for batch in contents.fixed[one]]
        assert sum(map(len, drawn)) == (near & (np.abs(data[name]) <= most_m)).sum() > 100


def test_bearings_that_run_the_wrong_way_give_no_numbers() -> None:
    with pytest.raises(NotAssessableError, match="wrong sign or quadrant"):
        analysed(approach_scenario(is_reversed=True))


def test_a_beacon_on_the_other_side_gives_no_numbers() -> None:
    with pytest.raises(NotAssessableError, match="wrong side"):
        analysed(approach_scenario(), (*BEACONS[:2], Beacon("side", 0.0, -500.0)))


def test_beacons_at_wrong_distances_are_told() -> None:
    moved = analysed(
        approach_scenario(), (Beacon("outer", 8000.0), Beacon("inner", 2000.0), Beacon("side", 0.0, 1000.0))
    )
    assert "landing_beacons.speed" in {one.code for one in moved.findings}


def test_over_rising_ground_there_is_no_deviation_from_the_glide_path(found: Found[BeaconLanding]) -> None:
    rising = analysed(approach_scenario(rise_m_per_km=10.0))
    (told,) = [one for one in rising.findings if one.code == "landing_beacons.terrain"]
    assert "no deviation from the glide path" in told.text and "[[runways.ground]]" in told.text
    rows = {one.before_threshold_m: one for one in rising.answer.rows}
    assert rows[2000.0].glide_path_m is None and rows[2000.0].vertical_category == ""
    level = next(one.glide_path_m for one in found.answer.rows if one.before_threshold_m == 100.0)
    assert level is not None and rows[100.0].glide_path_m == pytest.approx(level - 1.0, abs=0.5)
    data = rising.answer.figures[0]
    far = data["straight_before_threshold_m"] > 1000.0
    assert not np.isfinite(data["glide_path_m"][far]).any()


@pytest.mark.parametrize(("rise_m", "kept"), [([0.0, 9.0, np.nan], [True, False, False]), ([np.nan] * 3, [True] * 3)])
def test_ground_whose_rise_is_unknown_is_kept_only_where_no_altitude_tells_any(
    rise_m: list[float], kept: list[bool]
) -> None:
    every = np.zeros(3)
    fix = BearingFix(every, every, every, np.zeros((3, 2, 2)))
    found = over_known_ground(Deviations(fix, every, every, every, every), np.array(rise_m), 5.0)
    assert np.isfinite(found.glide_path_m).tolist() == kept


def test_a_profile_of_the_ground_gives_the_glide_path_back() -> None:
    scenario = approach_scenario(rise_m_per_km=10.0)
    simulated, places = flown(scenario)
    known = known_of(simulated, places)
    ground = (Ground(-3000.0, 0.0), Ground(0.0, 0.0), Ground(12_000.0, 120.0))
    runway = replace(known.site.runways[0], ground=ground)
    found = LANDING_BEACONS.run(simulated.flight, replace(known, site=replace(known.site, runways=(runway,))), SETTINGS)
    assert found.findings == () and found.answer.approaches[0].terrain_m < 4.0
    data = found.answer.figures[0]
    near = np.isfinite(data["glide_path_m"]) & (data["before_threshold_m"] < 2500.0)
    rows = np.searchsorted(simulated.trajectory.time_ns / 1e9, data["time_s"])
    true = (places.up_m - (15.0 - places.along_m * np.tan(np.deg2rad(3.0))))[rows]
    normal = np.abs((data["glide_path_m"] - true) / data["glide_path_sigma_m"])[near]
    assert np.mean(normal < 1.959964) > 0.9


def test_a_profile_out_of_order_is_refused() -> None:
    with pytest.raises(SettingsError, match="growing distance"):
        Runway("06", 60.0, ground=(Ground(100.0, 0.0), Ground(0.0, 0.0)))


def test_without_any_altitude_the_ground_is_told_to_be_taken_for_level() -> None:
    simulated, places = flown(approach_scenario())
    ins = simulated.flight["ins"]
    kept = {name: column for name, column in ins.columns.items() if not name.startswith("altitude")}
    tables = {name: table for name, table in simulated.flight.tables.items() if not name.startswith("baro")}
    flight = replace(simulated.flight, tables=tables | {"ins": replace(ins, columns=kept)})
    found = LANDING_BEACONS.run(flight, known_of(simulated, places), SETTINGS)
    (told,) = [one for one in found.findings if one.code == "landing_beacons.terrain"]
    assert told.severity == "warn" and "level ground" in told.text


@pytest.mark.parametrize(
    ("beacons", "said"),
    [
        ((), "site file"),
        (BEACONS[:2], "three beacons"),
        ((*BEACONS[:2], Beacon("side", 0.0, 1.0)), "on one line"),
    ],
)
def test_what_the_site_lacks_is_the_reason(beacons: tuple[Beacon, ...], said: str) -> None:
    with pytest.raises(NotAssessableError, match=said):
        analysed(approach_scenario(), beacons)


def test_an_approach_cut_short_is_told() -> None:
    simulated, places = flown(approach_scenario())
    table = simulated.flight["adf.outer"]
    threshold_s = simulated.trajectory.time_ns[np.argmin(np.abs(places.along_m + 700.0))]
    cut = table.take(table.time_ns - simulated.flight.start_ns < threshold_s)
    flight = replace(simulated.flight, tables=dict(simulated.flight.tables) | {"adf.outer": cut})
    found = LANDING_BEACONS.run(flight, known_of(simulated, places), SETTINGS)
    assert any("before the threshold" in one.text for one in found.findings)
    assert min(one.before_threshold_m for one in found.answer.rows) >= 500.0


def test_a_flight_without_bearings_has_a_reason() -> None:
    simulated, places = flown(approach_scenario())
    tables = {name: table for name, table in simulated.flight.tables.items() if not name.startswith("adf")}
    flight = replace(simulated.flight, tables=tables)
    with pytest.raises(NotAssessableError, match="no bearings"):
        LANDING_BEACONS.run(flight, known_of(simulated, places), SETTINGS)
    assert not LANDING_BEACONS.is_expected(flight, None)


def test_a_beacon_of_a_runway_that_is_not_there_is_refused() -> None:
    with pytest.raises(SettingsError, match="beacons"):
        SiteData(runways=(Runway("06", 60.0),), beacons=(Beacon("outer", 4000.0, runway="24"),))


@pytest.mark.slow
def test_a_log_of_a_simulated_approach_from_file_to_summary(tmp_path: Path) -> None:
    log, site = simulate_to("approach-beacons", tmp_path / "log")
    configuration = load_configuration(site=site)
    (outcome,) = run_many([str(log)], str(tmp_path / "out"), configuration, jobs=1, with_pdf=False)
    assert "approach by bearings" in outcome.text
    back = load(Path(outcome.folder)).results.answer(BeaconLanding)
    assert back is not None
    assert back.rows[-1].glide_path_95_m > 0.0
    assert "Landing by locators" in (Path(outcome.folder) / "report.html").read_text(encoding="utf-8")
