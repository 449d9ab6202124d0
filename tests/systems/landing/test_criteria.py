"""Criteria of an approach against simulated truth: configuration, wind, speed, threshold, touchdown; bad input."""

from dataclasses import replace
from datetime import datetime, timedelta
from functools import cache

import numpy as np
import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.records import Column
from groundstation.base.toml_settings import settings_from
from groundstation.chapters.parts import Facts
from groundstation.simulation.approach import ApproachScenario, FinalMotion, Recorded, TrueRunway, simulate_approach
from groundstation.systems.known import Known, Runway, SiteData
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import Approach, LandingResult, StabilisedAt
from groundstation.systems.landing.criteria import _Value as Value
from groundstation.systems.landing.criteria import judged
from groundstation.systems.landing.criteria_answer import KINDS, Criterion
from groundstation.systems.landing.criteria_settings import CriteriaSettings, Limits
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.stabilised import rejudge
from groundstation.systems.landing.sustained import worst_sustained
from groundstation.systems.landing.touchdown_chapter import touchdown_parts
from groundstation.systems.landing.verdict_answer import in_feet_too
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table

RUNWAY = TrueRunway(56.0, 38.0, 90.0)
EXACT = ApproachScenario(RUNWAY, flown=FinalMotion(start_distance_m=14_000.0), recorded=Recorded(step_deg=0.0))
SAMPLE_M = 15.0  # height that is lost in the 4 s between two samples of a switch
SECOND_M = 75.0  # way of a second


@cache
def flown() -> Flight:
    return simulate_approach(EXACT).flight


def with_topic(flight: Flight, topic: str, **columns: np.ndarray) -> Flight:
    """The flight with a topic on the times of its INS, every ``k``-th row where the columns are shorter."""
    size = len(next(iter(columns.values())))
    every = -(-len(flight["ins"]) // size)
    like = flight["ins"].take(slice(None, None, every))
    found = {name: Column(np.nan_to_num(values), np.isfinite(values.astype(float))) for name, values in columns.items()}
    table = Table(topic, like.time_ns, found, like.record_index, like.device_time_ns)
    return replace(flight, tables={**flight.tables, topic: table})


def heights(every: int = 1) -> np.ndarray:
    return flown()["baro"].values("height_above_airfield_m")[::every]


def site() -> SiteData:
    return SiteData(
        runways=(Runway("09", 90.0, 0.001, latitude_deg=56.0, longitude_deg=38.0, length_m=RUNWAY.length_m),)
    )


def result(flight: Flight, where: SiteData | None = None, **settings: object) -> LandingResult:
    known = Known(flight_phases(flight), site=site() if where is None else where)
    return LANDING.run(flight, known, LandingSettings(**settings)).answer  # type: ignore[arg-type]


def approach(flight: Flight, where: SiteData | None = None, **settings: object) -> Approach:
    (one,) = result(flight, where, **settings).approaches
    return one


def criterion(one: Approach, name: str) -> Criterion:
    return next(row for row in one.criteria if row.name == name)


def gate_state(at: StabilisedAt, name: str) -> str:
    return next(gate.state for gate in at.gates if gate.name == name)


def configured(flap_from_m: float, gear_from_m: float, *, every: int = 4, is_reversed: bool = False) -> Flight:
    height = heights(every)
    gear = (height < gear_from_m) ^ is_reversed
    return with_topic(
        flown(), "configuration", flap_deg=np.where(height < flap_from_m, 30.0, 5.0), gear_down=gear.astype(bool)
    )


@pytest.mark.parametrize(("flap_m", "gear_m"), [(400.0, 500.0), (250.0, 400.0), (400.0, 100.0)])
def test_flap_and_gear_are_judged_by_the_height_from_which_they_stayed(flap_m: float, gear_m: float) -> None:
    high, low = approach(configured(flap_m, gear_m)).stabilised
    for at in (high, low):
        for name, truth_m in (("flap", flap_m), ("gear", gear_m)):
            gate = next(gate for gate in at.gates if gate.name == name)
            assert gate.value == pytest.approx(truth_m - 0.5 * SAMPLE_M, abs=SAMPLE_M)
            assert gate.state == ("passed" if truth_m > at.height_m else "failed")
    if flap_m < high.height_m:
        assert high.verdict == "not stabilised" and high.lost is not None and high.lost.is_from_the_start
        assert high.stable_m == pytest.approx(flap_m, abs=2 * SAMPLE_M)


def test_a_gear_switch_that_reads_the_other_way_round_is_told_and_turned() -> None:
    found = LANDING.run(
        configured(400.0, 500.0, is_reversed=True), Known(flight_phases(flown()), site=site()), LandingSettings()
    )
    (one,) = found.answer.approaches
    gate = next(gate for gate in one.stabilised[0].gates if gate.name == "gear")
    # It reads down above 500 m and up on the wheels: the leg that is up on the ground shows the sense.
    assert gate.state == "passed" and "reverse" in gate.reason
    assert "landing.gear_reversed" in {finding.code for finding in found.findings}


def test_a_flap_that_never_moves_judges_nothing_and_fixed_gear_is_down() -> None:
    size = len(heights(4))
    flight = with_topic(flown(), "configuration", flap_deg=np.zeros(size), gear_down=np.ones(size, dtype=bool))
    low = approach(flight).stabilised[1]
    assert gate_state(low, "flap") == "not_measured" and gate_state(low, "gear") == "passed"
    up = with_topic(flown(), "configuration", gear_down=np.zeros(size, dtype=bool))
    assert gate_state(approach(up).stabilised[1], "gear") == "not_measured"


def test_a_gust_is_no_excess_of_speed_and_what_lasts_is() -> None:
    height, speed = heights(), np.full(len(heights()), 70.0)
    at = int(np.flatnonzero(height < 100.0)[0])
    for seconds, state in ((2, "passed"), (6, "failed")):
        gusty = speed.copy()
        gusty[at : at + seconds + 1] += 15.0
        flight = with_topic(flown(), "air", indicated_airspeed_mps=gusty)
        low = approach(flight).stabilised[1]
        assert gate_state(low, "speed") == state
        if state == "failed":
            place = next(place.at for place in low.places if place.name == "speed")
            assert place.height_m == pytest.approx(float(height[at]), abs=1.0)
            assert low.lost is not None and low.lost.height_m == pytest.approx(float(height[at]), abs=1.0)


def test_a_reference_speed_makes_slow_a_fault_too() -> None:
    flight = with_topic(flown(), "air", indicated_airspeed_mps=np.full(len(heights()), 63.0))
    assert gate_state(approach(flight).stabilised[1], "speed") == "passed"
    assert gate_state(approach(flight, reference_speed_mps=65.0).stabilised[1], "speed") == "failed"
    assert criterion(approach(flight, reference_speed_mps=60.0), "threshold_speed").value == pytest.approx(3.0)


@pytest.mark.parametrize(("east_mps", "state"), [(12.0, "not met"), (6.0, "undecided"), (-8.0, "met")])
def test_the_wind_is_split_along_the_course(east_mps: float, state: str) -> None:
    size = len(heights())
    flight = with_topic(flown(), "air", wind_north_mps=np.full(size, 3.0), wind_east_mps=np.full(size, east_mps))
    one = approach(flight)
    tail, cross = criterion(one, "tailwind"), criterion(one, "crosswind")
    assert tail.value == pytest.approx(east_mps, abs=0.1) and tail.state == state
    assert cross.value == pytest.approx(3.0, abs=0.1) and "right" in cross.reason  # it blows to the north
    assert cross.state == "no limit"


def test_touchdown_threshold_and_remaining_runway_are_those_flown() -> None:
    one = approach(flown())
    truth_m = one.touchdown.past_threshold_m if one.touchdown else None
    assert truth_m is not None
    touchdown = criterion(one, "touchdown")
    assert touchdown.sigma is not None and touchdown.value is not None
    assert abs(touchdown.value - truth_m) < 3.0 * touchdown.sigma
    remaining, aiming = criterion(one, "runway_remaining"), criterion(one, "aiming_point")
    assert remaining.value == pytest.approx(RUNWAY.length_m - touchdown.value)
    assert aiming.value == pytest.approx(touchdown.value - 400.0)  # 3000 m of runway
    height = criterion(one, "threshold_height")
    assert height.value == pytest.approx(RUNWAY.threshold_crossing_height_m, abs=5.0)
    flare, floating = criterion(one, "flare"), criterion(one, "floating")
    assert flare.value is not None and floating.value is not None
    assert 2.0 < flare.value < 15.0 and floating.value < flare.value * SECOND_M


def touchdown_facts(one: Approach) -> dict[str, tuple[str, str]]:
    facts = touchdown_parts(one, 1_315_842_233_000_000_000)[0]
    assert isinstance(facts, Facts)
    return {str(pair[0]): (str(pair[1]).replace("\u202f", " "), str(pair[2])) for pair in facts.pairs}


def test_the_touchdown_is_told_in_utc_and_in_feet_and_without_a_correction_as_recorded() -> None:
    one = approach(flown())
    assert one.touchdown is not None and one.touchdown.past_threshold_m is not None
    told = touchdown_facts(one)
    utc = datetime(2011, 9, 12, 15, 43, 53) + timedelta(seconds=round(one.touchdown.time_s, 1))
    assert told["UTC"][0] == utc.isoformat(" ", "milliseconds")[:-2]
    past_m = one.touchdown.past_threshold_m
    assert touchdown_facts(replace(one, criteria=()))["Beyond the threshold"] == (in_feet_too(past_m), "as recorded")


def test_a_figure_less_the_error_of_the_positions_leads_and_names_the_recorded_one_beside_it() -> None:
    off_m = (-250.0, 120.0)
    recorded = replace(EXACT.recorded, along_m=off_m[0], across_m=off_m[1])
    one = approach(simulate_approach(replace(EXACT, recorded=recorded)).flight)
    truth = approach(flown())
    found = {name: (criterion(one, name), criterion(truth, name)) for name in ("touchdown", "centre_line")}
    for shown, true in found.values():
        assert shown.value == pytest.approx(true.value, abs=25.0), "corrected"
        assert shown.reason.count("corrected: positions less") == 1 and "as recorded" in shown.reason
    assert one.touchdown is not None and one.touchdown.past_threshold_m is not None
    assert truth.touchdown is not None and truth.touchdown.past_threshold_m is not None
    raw_m = one.touchdown.past_threshold_m
    assert raw_m == pytest.approx(truth.touchdown.past_threshold_m + off_m[0], abs=1.0)
    value, remark = touchdown_facts(one)["Beyond the threshold"]
    assert value.startswith(f"{found['touchdown'][0].value:.0f} ± ") and f"{in_feet_too(raw_m)} as recorded" in remark
    assert "121 m (396 ft) right as recorded" in found["centre_line"][0].reason, "a metre of it was flown"
    for name in ("aiming_point", "runway_remaining"):
        assert criterion(one, name).reason.endswith("; corrected")
        assert criterion(truth, name).reason.endswith(("; corrected", "; as recorded"))


def test_nothing_is_said_of_a_threshold_that_the_positions_placed() -> None:
    one = approach(flown(), SiteData())
    found = {name: criterion(one, name) for name in ("touchdown", "runway_remaining", "threshold_height")}
    assert {row.state for row in found.values()} == {"not measured"}
    assert all("placed by the positions" in row.reason for row in found.values())


def test_what_a_log_lacks_is_not_logged() -> None:
    one = approach(flown())
    for name in ("thrust", "tailwind", "landing_flap", "landing_pitch", "landing_load"):
        assert criterion(one, name).state == "not logged", name
    assert one.score is None, "no weights of the user"
    air = criterion(one, "threshold_speed")
    assert (air.state, air.reason) == ("not logged", "not in the log"), "no airspeed at all"


def test_an_airspeed_that_ends_before_the_threshold_is_not_measured_there() -> None:
    heights_m = heights()
    speed = np.where(heights_m > 60.0, 70.0, np.nan)
    one = approach(with_topic(flown(), "air", indicated_airspeed_mps=speed))
    air = criterion(one, "threshold_speed")
    assert (air.state, air.reason) == ("not measured", "no indicated airspeed at the threshold")


def test_a_go_around_has_criteria_of_the_air_alone() -> None:
    scenario = replace(EXACT, flown=replace(EXACT.flown, go_around_height_m=120.0))
    (one,) = result(simulate_approach(scenario).flight).approaches
    assert one.outcome == "go-around" and {row.name for row in one.criteria} == {"thrust", "tailwind", "crosswind"}


def test_no_height_and_one_sample_judge_nothing_and_break_nothing() -> None:
    plain = flown()
    tables = {topic: table for topic, table in plain.tables.items() if topic not in ("baro", "radio_altimeter")}
    one = approach(replace(plain, tables=tables))
    assert all(at.verdict == "not measured" for at in one.stabilised)
    single = with_topic(plain, "air", indicated_airspeed_mps=np.full(1, 70.0))
    assert criterion(approach(single), "threshold_speed").state in ("not logged", "not measured")


def test_thrust_is_judged_only_by_a_limit_of_the_user() -> None:
    flight = with_topic(flown(), "engine.1", n1_share=np.where(heights() < 120.0, 0.3, 0.6))
    one = approach(flight)
    assert criterion(one, "thrust").value == pytest.approx(30.0) and criterion(one, "thrust").state == "no limit"
    assert "thrust" not in {gate.name for gate in one.stabilised[1].gates}
    limited = approach(flight, criteria=CriteriaSettings(thrust=Limits(at_least=40.0)))
    assert gate_state(limited.stabilised[1], "thrust") == "failed" and limited.stabilised[1].verdict == "not stabilised"


def test_the_score_is_the_share_of_the_users_own_weights() -> None:
    flight = with_topic(
        flown(), "air", wind_north_mps=np.zeros(len(heights())), wind_east_mps=np.full(len(heights()), 12.0)
    )
    criteria = CriteriaSettings(bank=Limits(weight=1.0), tailwind=Limits(at_most=5.0, weight=2.0))
    one = approach(flight, criteria=criteria)
    assert one.score is not None and one.score.judged == 4.0  # the bank from both check heights
    assert one.score.share == pytest.approx(0.5)


def test_other_limits_are_applied_to_stored_values() -> None:
    size = len(heights())
    answer = result(with_topic(flown(), "air", wind_north_mps=np.zeros(size), wind_east_mps=np.full(size, 12.0)))
    other = LandingSettings(criteria=CriteriaSettings(tailwind=Limits(at_most=15.0), bank=Limits(at_most=0.5)))
    runway = next(one for one in rejudge(answer, other) if "runway" in one.subject)
    assert (runway.before, runway.after) == ("not met", "met")


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"criteria": {"tailwnd": {"at_most": 5.0}}}, "tailwnd"),
        ({"criteria": {"tailwind": {"at_most": "5 kt"}}}, "a number"),
        ({"criteria": {"touchdown": {"at_least": 9.0, "at_most": 3.0}}}, "at_most"),
    ],
)
def test_limits_that_cannot_be_used_are_told_by_their_key(table: dict[str, object], said: str) -> None:
    with pytest.raises(SettingsError, match=said):
        settings_from(LandingSettings, table, "a.toml", "landing")


def test_every_criterion_has_a_kind_and_a_place_in_the_settings() -> None:
    assert list(KINDS) == list(CriteriaSettings.__dataclass_fields__)
    assert judged("bank", Value(3.0, 1.0), Limits(at_most=4.0)).state == "undecided"
    assert judged("bank", Value(3.0, 0.1), Limits(at_most=4.0)).state == "met"


def test_a_level_that_lasts_is_the_greatest_kept() -> None:
    time_s = np.arange(6.0)
    assert worst_sustained(time_s, np.array([1.0, np.nan, 8.0, 7.0, 6.0, 1.0]), 2.0) == (6.0, 2)
    assert worst_sustained(time_s, np.full(6, np.nan), 2.0) is None
    assert worst_sustained(time_s, np.array([9.0, np.nan, 8.0, 7.0, 6.0, 1.0]), 2.0) == (6.0, 2), "a lone sample"
    assert worst_sustained(time_s, np.array([3.0, 4.0, np.nan, np.nan, 9.0, 8.0]), 2.0) == (8.0, 4), "none lasts"
