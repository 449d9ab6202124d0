"""Approaches against simulated truth: found, measured against the runway, the localizer as reference; bad input."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.api import open_flight
from groundstation.simulation.approach import (
    ApproachScenario,
    FinalMotion,
    Recorded,
    SimulatedApproach,
    TrueRunway,
    load_approach,
    simulate_approach,
)
from groundstation.systems.analysis import Found
from groundstation.systems.known import Known, Runway, SiteData
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.path import step_of
from groundstation.systems.landing.runway_chapter import path_told
from groundstation.systems.landing.settings import LandingSettings
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log

CAPTURE_DEG = 0.5  # an offset that dies away along the final turns the line through its positions
RUNWAY = TrueRunway(56.0, 38.0, 47.0)
PLAIN = ApproachScenario(RUNWAY, flown=FinalMotion(start_distance_m=18_000.0, start_across_m=600.0))
EXACT = Recorded(step_deg=0.0, dot_step=1e-6)


def site(scenario: ApproachScenario, **other: Any) -> SiteData:
    runway = scenario.runway
    told = {"length_m": runway.length_m, "localizer_width_m": runway.localizer_width_m, "sigma_deg": 0.001} | other
    return SiteData(runways=(Runway("05", runway.true_course_deg, latitude_deg=56.0, longitude_deg=38.0, **told),))


def found(flight: Flight, where: SiteData | None = None, **settings: Any) -> Found[LandingResult]:
    known = Known(flight_phases(flight), site=where or SiteData())
    return LANDING.run(flight, known, LandingSettings(**settings))


def only(simulated: SimulatedApproach, where: SiteData | None = None, **settings: Any) -> Approach:
    (one,) = found(simulated.flight, where, **settings).answer.approaches
    return one


def without(flight: Flight, *topics: str) -> Flight:
    return replace(flight, tables={topic: table for topic, table in flight.tables.items() if topic not in topics})


def changed(flight: Flight, topic: str, name: str, values: np.ndarray) -> Flight:
    table: Table = flight[topic]
    known = Column(np.nan_to_num(values), np.isfinite(values))
    return replace(flight, tables={**flight.tables, topic: replace(table, columns={**table.columns, name: known})})


def test_a_landing_against_the_runway_of_the_site_file() -> None:
    simulated = simulate_approach(replace(PLAIN, recorded=EXACT))
    one = only(simulated, site(PLAIN))
    assert one.outcome == "landing" and one.runway.name == "05" and one.runway.placed_by == "site file"
    assert simulated.touchdown_s is not None and one.touchdown is not None and one.touchdown.confidence95_s is not None
    low_s, high_s = one.touchdown.confidence95_s  # the contact lies between two samples of a second
    assert one.end_s == one.touchdown.time_s and low_s < simulated.touchdown_s and high_s > simulated.touchdown_s - 1.0
    assert one.guidance_source == "110.30 MHz" and one.established is not None
    assert abs(float(wrap_180(one.established.line_course_deg - 47.0))) < CAPTURE_DEG
    assert [row.verdict for row in one.stabilised] == ["stabilised", "stabilised"]
    touchdown = one.touchdown
    assert touchdown is not None and touchdown.past_threshold_m is not None
    assert 100.0 < touchdown.past_threshold_m < 700.0
    assert touchdown.ground_speed_mps == pytest.approx(70.0, abs=2.5)


def test_exact_positions_and_an_exact_localizer_give_the_error_at_rounding() -> None:
    recorded = replace(EXACT, across_m=120.0, across_rate_mps=0.4)
    one = only(simulate_approach(replace(PLAIN, recorded=recorded)), site(PLAIN), positions_rounded="nearest")
    (error,) = one.position_errors
    assert error.error_m == pytest.approx(120.0, abs=0.2)  # the site file is flat, the localizer an angle
    assert error.rate_mps == pytest.approx(0.4, abs=0.002)
    assert error.sigma_m is not None and error.sigma_m > 5.0, "the course line may lie 10.5 m off"


@pytest.mark.parametrize("course_deg", [0.0, 90.0, 137.0, 301.0])
def test_turning_the_world_changes_nothing(course_deg: float) -> None:
    recorded = replace(EXACT, across_m=120.0, across_rate_mps=0.4)
    scenario = replace(PLAIN, runway=replace(RUNWAY, true_course_deg=course_deg), recorded=recorded)
    one = only(simulate_approach(scenario), site(scenario), positions_rounded="nearest")
    assert one.position_errors[0].error_m == pytest.approx(120.0, abs=0.2)


def test_coarse_positions_are_told_and_the_interval_holds_the_truth() -> None:
    scenario = load_approach("ils-approach")
    simulated = simulate_approach(scenario)
    result = found(simulated.flight, site(scenario))
    one = result.answer.approaches[0]
    error = one.position_errors[0]
    assert error.confidence95_m is not None
    assert error.confidence95_m[0] < simulated.across_m < error.confidence95_m[1]
    assert "landing.position_error" in {finding.code for finding in result.findings}
    assert one.position_step_m is not None and one.position_step_m[0] == pytest.approx(153.0, abs=1.0)
    assert error.rollout_error_m is not None and abs(error.rollout_error_m - 300.0) < 150.0
    assert error.change_m is not None and error.change_sigma_m is not None
    assert abs(error.change_m) < 3.0 * error.change_sigma_m


def test_without_a_site_file_only_the_change_is_measured() -> None:
    one = only(simulate_approach(load_approach("ils-approach")))
    (error,) = one.position_errors
    assert one.runway.placed_by == "positions" and error.state == "not measured" and error.error_m is None
    assert "these positions placed the runway" in error.reason and error.change_m is not None
    assert one.touchdown is not None and one.touchdown.past_threshold_m is None


def test_a_go_around_is_one() -> None:
    scenario = replace(PLAIN, flown=replace(PLAIN.flown, go_around_height_m=150.0))
    simulated = simulate_approach(scenario)
    one = only(simulated)
    assert one.outcome == "go-around" and one.touchdown is None
    assert one.lowest_height_m == pytest.approx(148.0, abs=5.0)
    assert one.stabilised[1].reason == "" or "lowest" in one.stabilised[1].reason


def test_an_unstable_final_is_not_stabilised() -> None:
    scenario = replace(PLAIN, flown=replace(PLAIN.flown, above_path_m=120.0), recorded=EXACT)
    result = found(simulate_approach(scenario).flight, site(scenario), established_vertical_dots=2.0)
    assert result.answer.approaches[0].stabilised[1].verdict == "not stabilised"
    assert "landing.not_stabilised" in {finding.code for finding in result.findings}


@pytest.mark.parametrize(
    ("site_off_m", "displaced_m", "told"),
    [(0.0, None, ""), (300.0, None, "another one."), (300.0, 280.0, "or the threshold was not displaced yet (by 280")],
)
def test_satellite_guidance_to_another_touchdown_zone_is_questioned(
    site_off_m: float, displaced_m: float | None, told: str
) -> None:
    """The site file has the threshold so far beyond that which the guidance leads to."""
    flight = simulate_approach(replace(PLAIN, recorded=EXACT)).flight
    guidance = flight["guidance"]
    named = Column(np.full(len(guidance), "GPS"))
    table = replace(guidance, columns={**guidance.columns, "source": named})
    latitude_deg, longitude_deg = latitude_longitude_deg(
        *(site_off_m * part for part in (np.cos(np.deg2rad(47.0)), np.sin(np.deg2rad(47.0)))), 56.0, 38.0
    )
    where = site(PLAIN)
    moved = replace(where.runways[0], latitude_deg=float(latitude_deg), longitude_deg=float(longitude_deg))
    (one,) = found(
        replace(flight, tables={**flight.tables, "guidance": table}), SiteData(runways=(moved,))
    ).answer.approaches
    assert one.path_offset is not None and one.path_offset.sigma_m is not None and not one.along_errors
    assert one.path_offset.error_m == pytest.approx(-site_off_m, abs=2.0 * one.path_offset.sigma_m)
    if displaced_m is not None:
        offset = replace(one.path_offset, error_from_end_m=one.path_offset.error_m + displaced_m)
        one = replace(one, runway=replace(one.runway, displaced_m=displaced_m), path_offset=offset)
    sentence = path_told(one)
    assert bool(sentence) is bool(told) and told in sentence.replace("\u202f", " ")
    assert not told or "before the touchdown zone assumed" in sentence


def test_a_reversed_localizer_is_told_and_is_no_reference() -> None:
    scenario = replace(PLAIN, recorded=Recorded(is_reversed=True))
    result = found(simulate_approach(scenario).flight, site(scenario))
    assert "landing.deviation_reversed" in {finding.code for finding in result.findings}
    assert all(error.state == "not measured" for error in result.answer.approaches[0].position_errors)


def test_a_saturated_localizer_establishes_nothing() -> None:
    simulated = simulate_approach(PLAIN)
    rows = len(simulated.flight["guidance"])
    flight = changed(simulated.flight, "guidance", "lateral_deviation_dots", np.full(rows, 4.0))
    one = found(flight, site(PLAIN)).answer.approaches[0]
    assert one.established is None and not one.position_errors


def test_a_runway_far_off_is_not_this_one() -> None:
    scenario = replace(PLAIN, runway=replace(RUNWAY, latitude_deg=56.2))
    assert only(simulate_approach(scenario), site(PLAIN)).runway.placed_by == "positions"


def test_positions_missing_for_half_of_the_final() -> None:
    simulated = simulate_approach(PLAIN)
    latitude = simulated.flight["ins"].values("latitude_deg").copy()
    latitude[60:140] = np.nan
    one = found(changed(simulated.flight, "ins", "latitude_deg", latitude), site(PLAIN)).answer.approaches[0]
    assert one.outcome == "landing" and np.isfinite(one.final_length_m)


def test_a_log_that_ends_before_the_touchdown_has_no_approach() -> None:
    simulated = simulate_approach(PLAIN)
    flight = simulated.flight
    cut = {
        topic: table.take(table.time_ns < flight.start_ns + 200 * NS_PER_S) for topic, table in flight.tables.items()
    }
    with pytest.raises(NotAssessableError, match="no landing in the log"):
        found(replace(flight, tables=cut))


def test_no_positions_are_refused_with_the_reason() -> None:
    with pytest.raises(NotAssessableError, match="no position of the aircraft"):
        found(without(simulate_approach(PLAIN).flight, "ins"))


def test_heights_of_a_radio_altimeter_alone_are_used_and_named() -> None:
    one = only_of(without(simulate_approach(PLAIN).flight, "baro"))
    assert one.height_source == "radio_altimeter.height_m"


def only_of(flight: Flight) -> Approach:
    return found(flight).answer.approaches[0]


def test_a_runway_of_no_length_is_refused() -> None:
    with pytest.raises(SettingsError, match="length_m"):
        Runway("05", 47.0, length_m=0.0)


def test_the_step_of_positions_is_seen_and_fine_ones_have_none() -> None:
    fine = 56.0 + 1e-6 * np.arange(500) * 7
    assert step_of(fine) == 0.0
    assert step_of(np.round(fine * 1e3 / 1.37329) * 1.37329e-3) == pytest.approx(1.37329e-3, rel=1e-3)


@pytest.mark.real_log
def test_facts_of_the_recorded_approaches() -> None:
    oslo, both = (
        open_flight(real_log(f"approach/{name}.hdf5")).flight
        for name in ("Specimen_Flight", "flight_with_go_around_and_landing")
    )
    landing = found(oslo).answer.approaches[0]
    kandahar, dubai = found(both).answer.approaches
    assert [one.outcome for one in (landing, kandahar, dubai)] == ["landing", "go-around", "landing"]
    for one, course_deg, lateral, vertical in (
        (landing, 16.2, 0.078, 0.220),
        (kandahar, 234.9, 0.042, 0.272),
        (dubai, 301.1, 0.075, 0.443),
    ):
        assert one.established is not None and one.established.vertical_rms_dots is not None
        assert one.established.line_course_deg == pytest.approx(course_deg, abs=0.2)
        assert one.established.lateral_rms_dots == pytest.approx(lateral, abs=0.005)
        assert one.established.vertical_rms_dots == pytest.approx(vertical, abs=0.005)
        assert one.position_errors[0].state == "not measured"
    assert landing.end_s == pytest.approx(2252.7 - 56.0, abs=0.3), "the load jumps there, 1.8 s before the switch"
    assert dubai.end_s == pytest.approx(13279.0 - 0.5, abs=2.0)


@pytest.mark.real_log
def test_the_recorded_file_without_positions_is_refused() -> None:
    with pytest.raises(NotAssessableError, match="never established"):
        found(open_flight(real_log("approach/coreg.hdf5")).flight)


@pytest.mark.real_log
def test_the_recorded_satellite_approach() -> None:
    (one,) = found(open_flight(real_log("g1000/log_220417_125002_LFQA.csv")).flight).answer.approaches
    assert one.guidance_source == "GPS" and one.protection is not None
    assert one.protection.horizontal_alarm_limit_m == 556.0 and one.protection.within_share == 1.0
    assert one.protection.vertical_alarm_limit_m is None


def test_an_approach_written_as_a_table_gives_the_same_answer(tmp_path: Path) -> None:
    from groundstation.simulation.approach import write_approach

    scenario = load_approach("ils-approach")
    written = open_flight(write_approach(scenario, tmp_path)).flight
    told, direct = found(written).answer.approaches[0], found(simulate_approach(scenario).flight).answer.approaches[0]
    assert told.end_s == direct.end_s and told.established is not None and direct.established is not None
    assert told.established.line_course_deg == pytest.approx(direct.established.line_course_deg, abs=1e-3)


def with_altitude(error_m: float, name: str = "altitude_msl_m") -> Flight:
    """A landing 100 m above the sea whose INS has an altitude, of a place 3 m above its wheels."""
    flight = simulate_approach(replace(PLAIN, recorded=EXACT)).flight
    height_m = flight["baro"].values("height_above_airfield_m")
    return changed(flight, "ins", name, height_m + 100.0 + 3.0 + error_m)


def test_the_runway_shows_the_error_of_an_altitude_without_gnss() -> None:
    for error_m in (-25.0, 0.0, 40.0):
        (one,) = found(with_altitude(error_m), site(PLAIN, elevation_m=100.0)).answer.approaches
        (height,) = one.height_errors
        assert height.state == "measured" and height.error_m == pytest.approx(error_m, abs=0.2)
        assert height.sigma_m is not None and 2.0 < height.sigma_m < 8.0
        assert height.confidence95_m is not None and height.confidence95_m[0] < error_m < height.confidence95_m[1]


@pytest.mark.parametrize(
    ("name", "elevation_m", "said"),
    [("altitude_msl_m", None, "no elevation"), ("altitude_ellipsoid_m", 100.0, "above the ellipsoid")],
)
def test_an_altitude_that_the_runway_cannot_judge_is_not_measured(
    name: str, elevation_m: float | None, said: str
) -> None:
    (one,) = found(with_altitude(5.0, name), site(PLAIN, elevation_m=elevation_m)).answer.approaches
    (height,) = one.height_errors
    assert height.state == "not measured" and said in height.reason and height.error_m is None
