"""Evidence of PX4 logs, old and new topics: what each era logs, and input that is missing, wrong or absent."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.systems.health import px4
from groundstation.systems.health.analysis import HEALTH
from groundstation.systems.health.answer import AutopilotHealth, Check
from groundstation.systems.health.evidence import Evidence
from groundstation.systems.health.px4_topics import counted
from groundstation.systems.health.settings import HealthSettings
from groundstation.tables.table import Flight, Table
from tests.systems.health.made import KNOWN, NS, flight, seconds, table

TIME = seconds()
STATUS = {
    "control_mode_flags": 535.0,
    "filter_fault_flags": 0.0,
    "gps_check_fail_flags": 0.0,
    "vel_test_ratio": 0.05,
    "pos_test_ratio": 0.04,
    "hgt_test_ratio": 0.03,
    "mag_test_ratio": 0.02,
    "tas_test_ratio": 0.0,
    "time_slip": 0.0,
    "output_tracking_error__0": 1e-4,
    "output_tracking_error__1": 1e-3,
    "output_tracking_error__2": 1e-2,
}
GPS = {
    "fix_type": 3.0,
    "satellites_used": 14.0,
    "hdop": 0.8,
    "eph": 0.6,
    "epv": 0.9,
    "s_variance_m_s": 0.2,
    "jamming_indicator": 8.0,
    "noise_per_ms": 90.0,
}
LEVEL = {"q__0": 1.0, "q__1": 0.0, "q__2": 0.0, "q__3": 0.0}


def old(**changes: object) -> tuple[Table, ...]:
    """PX4 up to 1.10: estimator_status with vibe, states and check flags, ekf2_innovations."""
    status = {**STATUS, "innovation_check_flags": 0.0, "vibe__0": 1e-6, "vibe__1": 1e-4, "vibe__2": 1e-3}
    status |= {f"states__{place}": 1e-6 for place in range(16)}
    return (
        table("raw.estimator_status", TIME, **{**status, **changes}),
        table("raw.ekf2_innovations", TIME, heading_innov=0.0),
        table("raw.vehicle_gps_position", TIME, **GPS),
    )


def new(**changes: object) -> tuple[Table, ...]:
    """PX4 from 1.13: flags, biases and vibration in topics of their own, two estimators and two IMUs."""
    status = {**STATUS, "reset_count_quat": 1.0, "reset_count_pos_ne": 3.0, **changes}
    tables = [
        table("raw.estimator_selector_status", np.arange(100.0), primary_instance=0.0, instance_changed_count=0.0),
        table("raw.vehicle_gps_position", TIME, **GPS, jamming_state=1.0, spoofing_state=1.0),
        table(
            "raw.sensors_status_imu",
            TIME,
            **{f"gyro_device_ids__{one}": 5.0 + one for one in (0, 1)},
            **{f"gyro_inconsistency_rad_s__{one}": 0.001 for one in (0, 1)},
        ),
    ]
    for instance in ("", ".1"):
        flags = {"reject_hor_pos": 0.0, "reject_ver_pos": 0.0, "fs_bad_acc_clipping": 0.0}
        bias = {f"{what}_bias__{axis}": 1e-3 for what in ("gyro", "accel") for axis in range(3)}
        metrics = {"accel_vibration_metric": 1.5, "gyro_vibration_metric": 0.02, "delta_angle_coning_metric": 1e-9}
        clipping = {f"accel_clipping__{axis}": 0.0 for axis in range(3)}
        tables += [
            table(f"raw.estimator_status{instance}", TIME, **status),
            table(f"raw.estimator_status_flags{instance}", TIME, **flags),
            table(f"raw.estimator_sensor_bias{instance}", TIME, **bias),
            table(f"raw.vehicle_imu_status{instance}", TIME, **metrics, **clipping),
            table(f"raw.estimator_attitude{instance}", TIME, **LEVEL),
        ]
    return tuple(tables)


def answered(*tables: Table, changed: Callable[[Flight], Flight] = lambda one: one) -> AutopilotHealth:
    return HEALTH.run(changed(flight(*tables)), KNOWN, HealthSettings()).answer


def verdicts(*tables: Table) -> dict[str, str]:
    return {one.key: one.verdict for one in answered(*tables).checks}


def replaced(tables: Iterable[Table], *others: Table) -> tuple[Table, ...]:
    named = {one.topic: one for one in others}
    return tuple(named.pop(one.topic, one) for one in tables) + tuple(named.values())


def during(start_s: float, end_s: float, value: float, otherwise: float) -> np.ndarray:
    return np.where((start_s <= TIME) & (end_s > TIME), value, otherwise)


@pytest.mark.parametrize("tables", [old(), new()], ids=["1.10", "1.13"])
def test_a_quiet_flight_passes_in_both_eras(tables: tuple[Table, ...]) -> None:
    answer = answered(*tables)
    assert {one.key: one.verdict for one in answer.checks if one.is_bad} == {}
    judged = {one.key for one in answer.checks if one.verdict == "pass"}
    assert judged >= {"gnss", "interference", "innovations", "vibration", "imu", "timing", "faults"}
    assert answer.sentence == "GNSS good, filter healthy, vibration low"
    assert answer.verdict == "pass"


@pytest.mark.parametrize("make", [old, new], ids=["1.10", "1.13"])
def test_a_ratio_above_the_limits_is_told_with_sensor_span_and_share(make: Callable[..., tuple[Table, ...]]) -> None:
    answer = answered(*make(pos_test_ratio=during(40.0, 60.0, 1.4, 0.1)))
    check = answer.check("innovations")
    measure = check.decisive
    assert measure is not None
    assert (check.verdict, measure.sensor) == ("fail", "horizontal position")
    assert (measure.span_start_s, measure.span_end_s) == pytest.approx((40.0, 60.0), abs=0.21)
    assert measure.red_share == pytest.approx(0.25, abs=0.01)
    assert "Filter rejects its sensors 0:40-" in answer.sentence


def test_a_ratio_that_stays_zero_is_of_a_sensor_that_is_not_used() -> None:
    sensors = {one.sensor for one in answered(*old()).check("innovations").measures if one.quantity == "test_ratio"}
    assert "airspeed" not in sensors
    assert "magnetic field" in sensors


def test_a_filter_that_never_ran_is_not_logged() -> None:
    silent = old(**dict.fromkeys(STATUS, 0.0), vibe__0=0.0, vibe__1=0.0, vibe__2=0.0)
    found = verdicts(*silent)
    assert {found[key] for key in ("innovations", "vibration", "imu", "resets", "faults")} == {"not_logged"}


def test_bits_of_rejections_are_read_by_era() -> None:
    """Bit 1 is the horizontal position up to 1.10, the vertical velocity from 1.11, which has two for velocity."""
    flags = during(40.0, 41.0, 2.0, 0.0)
    before = old(innovation_check_flags=flags)
    after = tuple(one for one in before if one.topic != "raw.ekf2_innovations")
    told = [answered(*tables).check("innovations").decisive for tables in (before, after)]
    assert [one.sensor for one in told if one is not None] == ["horizontal position", "vertical velocity"]


def test_resets_are_counted_in_the_air_across_the_wrap_of_their_counter() -> None:
    wrapped = np.where(TIME < 5.0, 254.0, np.where(TIME < 50.0, 255.0, 1.0))
    answer = answered(*new(reset_count_quat=wrapped))
    measure = answer.check("resets").decisive
    assert measure is not None
    assert (measure.sensor, measure.figure) == ("attitude and heading", 2.0)
    assert [one.text for one in answer.happenings if one.check == "resets" and one.in_the_air][:1] == [
        "attitude and heading reset"
    ]


def test_the_alignment_of_heading_in_flight_is_no_reset() -> None:
    flags = np.where(TIME < 30.0, 535.0, 535.0 + 2.0**23)
    answer = answered(*new(control_mode_flags=flags, reset_count_quat=np.where(TIME < 30.0, 1.0, 2.0)))
    assert answer.check("resets").verdict == "pass"
    assert "heading aligned in flight" in [one.text for one in answer.happenings]
    twice = np.where(TIME < 30.0, 1.0, np.where(TIME < 50.0, 2.0, 3.0))
    measure = answered(*new(control_mode_flags=flags, reset_count_quat=twice)).check("resets").decisive
    assert measure is not None
    assert measure.figure == 1.0


@pytest.mark.parametrize(
    ("values", "expected"),
    [([1, 1, 2], [0, 0, 1]), ([255, 0, 1], [0, 1, 2]), ([200, 3, 4], [0, 59, 60]), ([5, 4, 5], [0, 0, 1])],
)
def test_counters_that_wrap_or_begin_again(values: list[float], expected: list[float]) -> None:
    assert counted(np.array(values, dtype=np.float64)).tolist() == expected


def test_the_estimator_that_flew_is_judged_when_it_is_switched_in_the_air() -> None:
    """The second estimator is bad while the first flies, and good when it takes over: no failure, but a switch."""
    primary = np.where(np.arange(100.0) < 50.0, 0.0, 1.0)
    selector = table("raw.estimator_selector_status", np.arange(100.0), primary_instance=primary)
    bad_then_good = table("raw.estimator_status.1", TIME, **{**STATUS, "vel_test_ratio": during(0.0, 49.0, 3.0, 0.05)})
    good_then_bad = table("raw.estimator_status", TIME, **{**STATUS, "vel_test_ratio": during(51.5, 100.0, 3.0, 0.05)})
    answer = answered(*replaced(new(), selector, bad_then_good, good_then_bad))
    assert answer.check("innovations").verdict == "pass"
    assert (answer.check("switches").verdict, answer.check("switches").reason) == ("warn", "estimator switched")


def test_estimators_are_compared_with_the_one_that_flew() -> None:
    half = np.deg2rad(12.0) / 2.0
    turned = table("raw.estimator_attitude.1", TIME, q__0=np.cos(half), q__1=np.sin(half), q__2=0.0, q__3=0.0)
    measure = answered(*replaced(new(), turned)).check("resets").decisive
    assert measure is not None
    assert (measure.quantity, measure.sensor) == ("attitude_difference_deg", "estimator 1")
    assert measure.worst == pytest.approx(12.0, abs=1e-6)


def test_gnss_without_a_fix_claims_nothing_and_fails() -> None:
    lost = table(
        "raw.vehicle_gps_position",
        TIME,
        **{**GPS, "fix_type": 0.0, "satellites_used": 0.0, "eph": 4294967.5, "hdop": 99.99},
    )
    answer = answered(*replaced(new(), lost))
    check = answer.check("gnss")
    assert check.verdict == "fail"
    assert {one.quantity for one in check.measures} & {"eph_m", "hdop", "speed_accuracy_mps"} == set()
    assert answer.sentence.startswith("GNSS never had a fix; ")


def test_states_that_the_receiver_does_not_know_are_not_logged() -> None:
    unknown = table(
        "raw.vehicle_gps_position", TIME, **{**GPS, "jamming_indicator": 0.0}, jamming_state=0.0, spoofing_state=0.0
    )
    assert verdicts(*replaced(new(), unknown))["interference"] == "not_logged"
    spoofed = table("raw.vehicle_gps_position", TIME, **GPS, spoofing_state=during(40.0, 60.0, 3.0, 1.0))
    assert verdicts(*replaced(new(), spoofed))["interference"] == "fail"


def test_vibration_is_read_in_the_unit_of_its_era() -> None:
    """The same number is quiet in m/s2 (from 1.13) and loud as a change of velocity in one step (up to 1.12)."""
    old_names = table("raw.vehicle_imu_status", TIME, accel_vibration_metric=0.12, gyro_coning_vibration=1e-9)
    new_names = table("raw.vehicle_imu_status", TIME, accel_vibration_metric=0.12, delta_angle_coning_metric=1e-9)
    rest = [one for one in new() if "imu_status" not in one.topic]
    assert verdicts(*rest, old_names)["vibration"] == "warn"
    assert verdicts(*rest, new_names)["vibration"] == "pass"
    shaken = table(
        "raw.vehicle_imu_status",
        TIME,
        accel_vibration_metric=during(40.0, 60.0, 34.4, 3.1),
        delta_angle_coning_metric=1e-9,
    )
    answer = answered(*rest, shaken)  # its mean is small, as of a log that another tool called good
    assert answer.check("vibration").verdict == "fail"
    assert "Vibration high 0:40-1:00" in answer.sentence


def test_one_imu_is_not_compared_with_itself() -> None:
    alone = table("raw.sensors_status_imu", TIME, gyro_device_ids__0=5.0, gyro_inconsistency_rad_s__0=0.0)
    quantities = {one.quantity for one in answered(*replaced(new(), alone)).check("imu").measures}
    assert "gyro_difference_radps" not in quantities


def test_the_field_that_follows_thrust_is_found() -> None:
    thrust = 0.3 + 0.3 * np.sin(TIME)
    field = 0.4 + 0.35 * thrust
    tables = (
        table(
            "raw.vehicle_magnetometer", TIME, magnetometer_ga__0=field, magnetometer_ga__1=0.0, magnetometer_ga__2=0.0
        ),
        table("raw.vehicle_thrust_setpoint", TIME, xyz__2=-thrust),
    )
    answer = answered(*new(), *tables)
    measure = next(one for one in answer.check("magnetometer").measures if one.quantity == "field_with_throttle")
    assert measure.worst == pytest.approx(0.35 * 0.6 / 0.505, rel=0.02)
    assert measure.verdict == "warn"


def test_a_failsafe_is_a_warning_and_an_error_a_failure() -> None:
    texts = {
        10.0: ("info", "[logger] start"),
        40.0: ("info", "[commander] Failsafe mode: RTL"),
        45.0: ("error", "Motor 2 failed"),
        50.0: ("error", "[health_and_arming_checks] Low battery"),
    }
    text = table(
        "raw.ulog.text",
        list(texts),
        severity=[one for one, _ in texts.values()],
        text=[one for _, one in texts.values()],
    )
    answer = answered(*new(), text)
    check = answer.check("faults")
    assert (check.verdict, check.reason, check.first_event_s) == ("fail", "Motor 2 failed", 45.0)
    assert (answer.check("battery").verdict, answer.check("battery").reason) == ("fail", "Low battery")
    assert answer.sentence.startswith("First: “Motor 2 failed” at 0:45.0, then “Low battery” at 0:50.0")
    only = table("raw.ulog.text", [40.0], severity=["info"], text=["\x1b[33m[commander] Failsafe mode: RTL\x1b[0m"])
    check = answered(*new(), only).check("faults")
    assert (check.verdict, check.reason) == ("warn", "Failsafe mode: RTL")


def test_a_flag_counts_only_in_a_mode_that_needs_what_it_misses() -> None:
    needs_position = float(1 << 2)  # Position mode
    flags = {"local_position_invalid": 1.0, "mode_req_local_position": needs_position}
    for mode, verdict in ((15.0, "pass"), (2.0, "fail")):
        status = table("raw.vehicle_status", TIME, nav_state=mode, arming_state=2.0, failsafe=0.0)
        tables = (*new(), status, table("raw.failsafe_flags", TIME, **flags))
        assert verdicts(*tables)["faults"] == verdict


def test_links_that_were_never_there_are_not_logged_and_lost_ones_warn() -> None:
    never = table("raw.vehicle_status", TIME, rc_signal_lost=1.0, nav_state=3.0, arming_state=2.0)
    assert verdicts(*new(), never)["link"] == "not_logged"
    lost = table(
        "raw.vehicle_status", TIME, rc_signal_lost=during(40.0, 45.0, 1.0, 0.0), nav_state=3.0, arming_state=2.0
    )
    assert verdicts(*new(), lost)["link"] == "warn"


def test_the_battery_is_judged_where_one_is_connected() -> None:
    left = np.interp(TIME, [0.0, 90.0], [0.3, 0.05])
    there = table("raw.battery_status", TIME, connected=1.0, remaining=left, warning=np.where(left < 0.07, 2.0, 0.0))
    absent = table("raw.battery_status", TIME, connected=0.0, remaining=-1.0, warning=0.0)
    assert verdicts(*new(), there)["battery"] == "fail"
    assert verdicts(*new(), absent)["battery"] == "not_logged"


def test_a_tilt_that_lags_its_setpoint_is_found_whatever_the_heading() -> None:
    heading = np.deg2rad(137.0) / 2.0
    roll = np.deg2rad(during(40.0, 60.0, 12.0, 0.0)) / 2.0
    attitude = {
        "q__0": np.cos(heading) * np.cos(roll),
        "q__1": np.cos(heading) * np.sin(roll),
        "q__2": np.sin(heading) * np.sin(roll),
        "q__3": np.sin(heading) * np.cos(roll),
    }
    tables = (
        table("raw.vehicle_attitude", TIME, **attitude),
        table("raw.vehicle_attitude_setpoint", TIME, roll_body=0.0, pitch_body=0.0, yaw_body=0.0),
    )
    measure = answered(*new(), *tables).check("tracking").decisive
    assert measure is not None
    assert measure.worst == pytest.approx(12.0, abs=1e-6)
    assert measure.red_share == pytest.approx(0.25, abs=0.01)


def test_a_log_without_gnss_filter_and_vibration_passes_nothing() -> None:
    answer = answered(table("raw.vehicle_attitude", TIME, **LEVEL), table("raw.cpuload", TIME, load=0.4))
    assert answer.check("timing").verdict == "pass"
    assert (answer.verdict, answer.sentence) == ("not_logged", "GNSS, filter and vibration not logged")


def test_drop_outs_of_the_log_are_told_and_none_is_a_pass() -> None:
    information = table("raw.ulog.information", [0.0], name=["sys_name"], text=["PX4"])
    status = table("raw.vehicle_status", TIME, nav_state=2.0)
    assert verdicts(information, status)["timing"] == "pass"
    lost = table("raw.ulog.dropouts", [30.0, 50.0], duration_ms=[31.0, 62.0])
    measure = answered(information, status, lost).check("timing").decisive
    assert measure is not None
    assert (measure.figure, measure.unit) == (93.0, "ms")


def _without(column: str) -> Callable[[Flight], Flight]:
    def change(one: Flight) -> Flight:
        tables = {
            name: replace(each, columns={key: value for key, value in each.columns.items() if key != column})
            for name, each in one.tables.items()
        }
        return replace(one, tables=tables)

    return change


def _filled(value: float) -> Callable[[Flight], Flight]:
    def change(one: Flight) -> Flight:
        def fill(each: Table) -> Table:
            return replace(each, columns={key: Column(np.full(len(each), value)) for key in each.columns})

        kept = ("raw.vehicle_land_detected",)
        return replace(one, tables={name: each if name in kept else fill(each) for name, each in one.tables.items()})

    return change


@pytest.mark.parametrize("tables", [old(), new()], ids=["1.10", "1.13"])
def test_text_in_place_of_numbers_is_not_logged(tables: tuple[Table, ...]) -> None:
    def change(one: Flight) -> Flight:
        def words(each: Table) -> Table:
            return replace(each, columns={key: Column(np.full(len(each), "high")) for key in each.columns})

        kept = ("raw.vehicle_land_detected",)
        return replace(one, tables={name: each if name in kept else words(each) for name, each in one.tables.items()})

    with pytest.raises(NotAssessableError, match="holds no field"):
        answered(*tables, changed=change)


COLUMNS = sorted({column for one in (*old(), *new()) for column in one.columns})


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize("tables", [old(), new()], ids=["1.10", "1.13"])
def test_a_field_that_is_missing_never_fails_or_breaks(tables: tuple[Table, ...], column: str) -> None:
    answer = answered(*tables, changed=_without(column))
    assert not [one for one in answer.checks if one.is_bad]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, -1.0, 0.0])
@pytest.mark.parametrize("tables", [old(), new()], ids=["1.10", "1.13"])
def test_absurd_numbers_break_nothing(tables: tuple[Table, ...], value: float) -> None:
    """Every field of every topic is one absurd number: checks may fail, and not-a-number passes nowhere."""
    with np.errstate(all="raise", under="ignore"):
        try:
            answer = answered(*tables, changed=_filled(value))
        except NotAssessableError:
            return
    if np.isnan(value):
        assert not [one for one in answer.checks if one.verdict == "pass"]


def test_a_log_of_one_hertz_and_of_one_row_is_judged() -> None:
    slow = [one.take(slice(None, None, 5)) for one in new() if one.topic != "raw.estimator_selector_status"]
    assert {one.key for one in answered(*slow).checks if one.verdict == "pass"} >= {"gnss", "innovations", "vibration"}
    single = [one.take(slice(0, 1)) for one in new()]
    assert all(one.verdict in ("pass", "not_logged") for one in answered(*single).checks)


def test_a_log_of_another_make_is_not_of_px4() -> None:
    assert not px4.applies(
        Flight({"raw.GPS": table("raw.GPS", TIME, NSats=8.0), "ins": table("ins", TIME, roll_deg=0.0)})
    )


def test_evidence_is_in_order_of_time_and_of_one_length() -> None:
    pieces: tuple[Evidence, ...] = px4.evidence(flight(*old(), *new()))
    assert pieces
    for one in pieces:
        assert len(one.time_ns) == len(one.value)
        assert np.all(np.diff(one.time_ns) >= 0)
        assert one.time_ns[-1] <= 101 * NS


def test_a_finding_has_the_time_and_the_figure() -> None:
    tables = new(pos_test_ratio=during(40.0, 60.0, 1.4, 0.1))
    findings = HEALTH.run(flight(*tables), KNOWN, HealthSettings()).findings
    found = next(one for one in findings if one.code == "health.innovations")
    assert found.severity == "warn"
    assert found.place.startswith("40.0 to ")
    assert "(horizontal position) up to 1.4" in found.text


def test_examine_says_which_checks_have_nothing_to_judge() -> None:
    assert HEALTH.examine is not None
    (found,) = HEALTH.examine(flight(*old()), KNOWN, HealthSettings())
    assert found.text.startswith("not logged: ")
    assert "battery and supply" in found.text
    with pytest.raises(NotAssessableError):
        HEALTH.examine(
            Flight({"raw.vehicle_attitude": table("raw.vehicle_attitude", TIME, q__0=1.0)}), KNOWN, HealthSettings()
        )


@pytest.mark.parametrize("tables", [old(), new(), new()[:2]], ids=["1.10", "1.13", "few"])
def test_examine_and_run_agree_on_what_is_not_logged(tables: tuple[Table, ...]) -> None:
    assert HEALTH.examine is not None
    (found,) = HEALTH.examine(flight(*tables), KNOWN, HealthSettings())
    missing = [one.title for one in answered(*tables).checks if one.verdict == "not_logged"]
    assert found.text == f"not logged: {', '.join(missing)}"


def test_measures_of_checks_are_those_of_the_answer_in_their_order() -> None:
    answer = answered(*new())
    checks: tuple[Check, ...] = answer.checks
    assert answer.measures == tuple(one for check in checks for one in check.measures)
    assert all(measure.check == check.key for check in checks for measure in check.measures)
