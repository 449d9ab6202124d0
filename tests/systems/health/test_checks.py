"""Judging: shares of time and not of samples, only in the air, and what is not logged is never a pass."""

import numpy as np
import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import settings_from
from groundstation.systems.health.answer import Check, Measure
from groundstation.systems.health.checks import CHECKS, judge
from groundstation.systems.health.evidence import Event, Evidence, Spans, in_the_air
from groundstation.systems.health.limits import Limit, Threshold, shipped, thresholds
from groundstation.systems.health.sentence_answer import told
from groundstation.systems.health.settings import HealthSettings
from groundstation.systems.known import Known
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight
from tests.systems.health.made import KNOWN, NS, flight, seconds, table
from tests.systems.health.thresholds_table import PAGE, page

AIR = Spans(np.array([10 * NS]), np.array([90 * NS]), "made")


def evidence(quantity: str, time_s: np.ndarray, value: np.ndarray) -> Evidence:
    time_ns = np.round(time_s * NS).astype(np.int64)
    return Evidence(shipped()[quantity].check, quantity, "one", "raw.made.field", "", time_ns, value)


def checked(*pieces: Evidence, events: tuple[Event, ...] = (), **limits: Limit) -> dict[str, Check]:
    checks, _ = judge(flight(), pieces, events, AIR, thresholds(limits))
    return {one.key: one for one in checks}


def measure(quantity: str, time_s: np.ndarray, value: np.ndarray, **limits: Limit) -> Measure:
    check = checked(evidence(quantity, time_s, value), **limits)[shipped()[quantity].check]
    return check.measures[0]


def test_shares_are_of_time_and_not_of_samples() -> None:
    """Forty samples a second while it is bad, one a second while it is good: a tenth of the time is bad."""
    time = np.concatenate([np.arange(0.0, 50.0), np.arange(50.0, 58.0, 0.025), np.arange(58.0, 100.0)])
    value = np.where((time >= 50.0) & (time < 58.0), 0.7, 0.1)
    found = measure("test_ratio", time, value)
    assert np.mean(value > 0.5) > 0.7
    assert found.amber_share == pytest.approx(0.1, abs=0.002)
    assert found.verdict == "warn"
    assert (found.span_start_s, found.span_end_s) == pytest.approx((50.0, 58.0))


def test_lanes_show_what_decided_by_a_median_and_when_a_counter_rose() -> None:
    """A lane that stays green beside a check that fails hides where it is bad."""
    time = seconds()
    offset = evidence("compass_offset", time, np.where(time < 40.0, 200.0, 715.0))
    dropped = evidence("dropped_records", time, np.where(time < 50.0, 18.0, np.where(time < 60.0, 540.0, 541.0)))
    checks, judged = judge(flight(), (offset, dropped), (), AIR, thresholds({}))
    lanes = {one.evidence.quantity: one.grade for one in judged}
    assert set(lanes["compass_offset"][time < 40.0]) == {0} and set(lanes["compass_offset"][time >= 40.0]) == {2}
    assert time[lanes["dropped_records"] == 1].tolist() == pytest.approx([50.0, 60.0])
    verdicts = {one.key: one.verdict for one in checks}
    assert (verdicts["magnetometer"], verdicts["timing"]) == ("fail", "warn")


def test_a_lane_in_the_air_is_no_worse_than_its_counter_is_judged() -> None:
    time = seconds()
    clipped = evidence("clipping", time, np.where(time < 5.0, 0.0, np.where(time < 50.0, 150.0, 151.0)))
    checks, (one,) = judge(flight(), (clipped,), (), AIR, thresholds({}))
    assert {check.key: check.verdict for check in checks}["clipping"] == "warn"
    rows = np.flatnonzero(one.grade > 0)
    assert (time[rows].tolist(), one.grade[rows].tolist()) == (pytest.approx([5.0, 50.0]), [2, 1])


def test_what_is_on_the_ground_does_not_count() -> None:
    time = seconds()
    found = measure("vibration_mps2", time, np.where(time < 10.0, 90.0, 5.0))
    assert found.verdict == "pass"
    assert found.amber_share == 0.0
    assert found.amber_share_log == pytest.approx(0.1, abs=0.005)
    assert found.worst == 5.0


def test_what_is_logged_on_the_ground_alone_is_not_logged() -> None:
    time = np.arange(0.0, 9.0, 0.2)
    check = checked(evidence("vibration_mps2", time, np.full(len(time), 5.0)))["vibration"]
    assert check.verdict == "not_logged"
    assert check.reason == "logged, but not in the air"


def test_a_single_sample_in_the_air_is_not_told_as_outside_it() -> None:
    check = checked(evidence("hdop", np.array([40.0]), np.array([20.0])))["gnss"]
    assert (check.verdict, check.reason) == ("not_logged", "logged at one moment alone: no time to judge")


def test_nothing_but_nan_is_not_logged() -> None:
    check = checked(evidence("hdop", seconds(), np.full(len(seconds()), np.nan)))["gnss"]
    assert (check.verdict, check.measures) == ("not_logged", ())


def test_every_check_is_told_and_none_passes_without_evidence() -> None:
    assert {key: one.verdict for key, one in checked().items()} == dict.fromkeys(CHECKS, "not_logged")


@pytest.mark.parametrize(
    ("bad", "verdict"), [(0.0, "pass"), (0.04, "pass"), (0.06, "warn"), (0.49, "warn"), (0.52, "fail")]
)
def test_amber_warns_above_a_twentieth_and_fails_above_half(bad: float, verdict: str) -> None:
    time = seconds(0.1)
    assert measure("test_ratio", time, np.where(time < 10.0 + 80.0 * bad, 0.7, 0.1)).verdict == verdict


def test_a_hole_in_the_samples_is_not_time_in_the_air() -> None:
    """A sample speaks for two seconds at most, not for the half minute until the next one."""
    time = np.concatenate([np.arange(0.0, 40.0, 0.2), np.arange(70.0, 100.0, 0.2)])
    found = measure("hdop", time, np.where(time < 40.0, 1.0, 1.2))
    assert found.logged_share == pytest.approx(51.8 / 80.0, abs=0.01)


def test_a_short_excursion_counts_only_where_it_lasts() -> None:
    time = seconds(0.1)
    short, long = (np.where((time >= 30.0) & (time < 30.0 + length), 7.0, 0.0) for length in (0.35, 0.7))
    assert measure("attitude_difference_deg", time, short).verdict == "pass"
    assert measure("attitude_difference_deg", time, long).verdict == "warn"


def test_a_counter_counts_its_rise_in_the_air() -> None:
    time = np.arange(0.0, 100.0)
    before = measure("clipping", time, np.where(time < 5.0, 0.0, 40.0))
    within = measure("clipping", time, np.where(time < 50.0, 40.0, 43.0))
    assert (before.verdict, before.figure) == ("pass", 0.0)
    assert (within.verdict, within.figure) == ("warn", 3.0)


def test_values_below_a_limit_are_bad_where_it_says_so() -> None:
    time = seconds()
    found = measure("satellites", time, np.where((time > 39.9) & (time < 42.3), 4.0, 12.0))
    assert (found.verdict, found.worst, found.is_below) == ("warn", 4.0, True)
    assert found.told == "satellites used (one) down to 4, below 5 for 3.0 % of the time"


def test_events_in_the_air_decide_and_those_on_the_ground_do_not() -> None:
    at_gate = Event("faults", 5 * NS, "fail", "preflight fail", "text")
    in_air = Event("faults", 50 * NS, "warn", "failsafe activated", "text")
    check = checked(events=(at_gate, in_air))["faults"]
    assert (check.verdict, check.reason, check.first_event_s) == ("warn", "failsafe activated", 50.0)


def test_messages_without_a_warning_are_a_pass() -> None:
    assert checked(events=(Event("faults", 50 * NS, "info", "take-off", "text"),))["faults"].verdict == "pass"


def test_a_user_sets_one_limit_and_the_others_stay() -> None:
    time = seconds()
    usual = measure("hdop", time, np.full(len(time), 2.5))
    strict = measure("hdop", time, np.full(len(time), 2.5), hdop=Limit(amber=2.0))
    assert (usual.verdict, strict.verdict) == ("pass", "warn")
    assert (strict.red, strict.threshold_source) == (10.0, "set by the user")


def test_settings_refuse_a_quantity_that_no_check_judges_and_limits_that_cross() -> None:
    with pytest.raises(SettingsError, match=r"thresholds\.hdopp.*no check judges"):
        settings_from(HealthSettings, {"thresholds": {"hdopp": {"amber": 2.0}}}, "a.toml", "health")
    with pytest.raises(SettingsError, match="red"):
        settings_from(HealthSettings, {"thresholds": {"hdop": {"amber": 20.0}}}, "a.toml", "health")
    with pytest.raises(SettingsError, match=r"ambre"):
        settings_from(HealthSettings, {"thresholds": {"hdop": {"ambre": 20.0}}}, "a.toml", "health")
    assert settings_from(HealthSettings, {"thresholds": {"hdop": {"amber": 2.0}}}, "a.toml", "health").thresholds == {
        "hdop": Limit(amber=2.0)
    }


def test_the_shipped_thresholds_hold_under_the_strict_rules_for_users() -> None:
    tables = ShippedToml("groundstation.systems", "health", "thresholds").read("thresholds").table
    strictly = {name: settings_from(Threshold, table, "thresholds.toml", name) for name, table in tables.items()}
    assert strictly == shipped()
    assert all(isinstance(one.red, float | None) for one in shipped().values())  # 5 in the file is 5.0


def test_every_threshold_names_its_source_and_a_check() -> None:
    for quantity, limit in shipped().items():
        assert limit.source, quantity
        assert limit.check in CHECKS, quantity
        levels = (limit.amber, limit.red, limit.amber_below, limit.red_below)
        is_told_only = quantity in ("battery_v", "battery_a")  # airframes differ: no limit holds for all
        assert any(level is not None for level in levels) != is_told_only, quantity


def test_flight_is_found_by_the_landed_flag_then_by_arming_then_it_is_the_whole_log() -> None:
    found = in_the_air(flight(), KNOWN)
    assert (found.words, found.seconds) == ("in the air", 80.0)
    time = np.arange(0.0, 100.5)
    armed = table("raw.vehicle_status", time, arming_state=np.where((time >= 20.0) & (time < 60.0), 2.0, 1.0))
    found = in_the_air(Flight({armed.topic: armed}), KNOWN)
    assert (found.words, found.seconds, found.is_flown) == ("while armed", 40.0, True)
    found = in_the_air(Flight({"raw.cpuload": table("raw.cpuload", time, load=0.5)}), KNOWN)
    assert (found.words, round(found.seconds, 6), found.is_flown) == ("in the whole log", 100.0, False)


def test_spans_tell_time_before_and_within() -> None:
    spans = Spans(np.array([10, 50]) * NS, np.array([20, 60]) * NS)
    assert spans.until(np.array([0, 15, 30, 55, 99]) * NS).tolist() == [0.0, 5.0, 10.0, 15.0, 20.0]
    assert spans.hold(np.array([9, 10, 19, 20, 55]) * NS).tolist() == [False, True, True, False, True]


def test_page_has_the_shipped_thresholds() -> None:
    """Written by ``python -m tests.systems.health.thresholds_table``."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_a_flight_that_speed_and_height_make_likely_is_judged() -> None:
    proven = PhaseInterval(20.0, 40.0, "airborne")
    likely = (proven, PhaseInterval(40.0, 80.0, "airborne", is_proven=False))
    bare = Flight({"raw.X": table("raw.X", [0.0, 100.0], a=1.0)}, {}, 0, False, "made.bin")
    air = in_the_air(bare, Known(Phases((proven,), "motion", likely=likely)))
    assert air.seconds == pytest.approx(60.0)
    assert in_the_air(bare, Known(Phases((proven,), "motion"))).seconds == pytest.approx(20.0)


@pytest.mark.parametrize(("share", "words"), [(0.82, "82 % of the time"), (1.0, "throughout")])
def test_throughout_is_all_of_the_time_and_less_is_told_as_a_share(share: float, words: str) -> None:
    time_s = np.arange(0.0, 100.0, 0.1)
    few = evidence("satellites", time_s, np.where(time_s < 10.0 + 80.0 * share, 0.0, 12.0))
    assert told(tuple(checked(few).values())).startswith(f"GNSS bad {words}")
