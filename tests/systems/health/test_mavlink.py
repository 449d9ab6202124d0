"""Evidence of telemetry, of ArduPilot and of PX4, and input that is missing or wrong."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.systems.health import mavlink
from groundstation.systems.health.analysis import HEALTH
from groundstation.systems.health.answer import AutopilotHealth
from groundstation.systems.health.evidence import Evidence
from groundstation.systems.health.messages import findings
from groundstation.systems.health.settings import HealthSettings
from groundstation.systems.known import Known
from groundstation.tables.estimator_in_use import estimator_in_use
from groundstation.tables.parameters import parameters_of
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.real_logs import real_log

pytest.importorskip("pymavlink")
ARDUPILOT, PX4 = 3, 12
Write = Callable[[Telemetry, int], None]


def flight(
    tmp_path: Path, write: Write, seconds: int = 60, autopilot: int = ARDUPILOT, silent: range = range(0)
) -> Flight:
    """Heartbeats once a second, armed from 5 s on, and what a test writes each second."""
    log = Telemetry()
    for second in range(seconds):
        time_us = START_US + second * 1_000_000
        if second in silent:
            continue
        armed = 209 if second >= 5 else 81
        log.add("heartbeat", 2, autopilot, armed, 5, 4, 3, time_us=time_us)
        write(log, time_us + 1_000)
    path = tmp_path / "made.tlog"
    path.write_bytes(bytes(log.data))
    return groundstation.open(path).flight


def found(made: Flight, quantity: str, sensor: str = "") -> Evidence:
    each = [one for one in mavlink.evidence(made) if one.quantity == quantity and sensor in one.sensor]
    assert len(each) == 1, [one.sensor for one in each]
    return each[0]


def answer(made: Flight) -> AutopilotHealth:
    return HEALTH.run(made, Known(flight_phases(made)), HealthSettings()).answer


def verdict(made: Flight, check: str) -> str:
    return next(one.verdict for one in answer(made).checks if one.key == check)


def test_ardupilots_variances_are_roots(tmp_path: Path) -> None:
    def write(log: Telemetry, time_us: int) -> None:
        log.add("ekf_status_report", 831 | 1 << 15, 1.2, 0.1, 0.0, 0.2, 0.0, 0.0, time_us=time_us)

    made = flight(tmp_path, write)
    assert found(made, "test_ratio_root", "velocity").value[0] == pytest.approx(1.2)
    assert not [one for one in mavlink.evidence(made) if one.sensor == "height"]  # never fused
    assert found(made, "filter_warning", "glitch").value.min() == 1.0
    assert verdict(made, "innovations") == "fail" and answer(made).judged_over == "while armed"


def test_px4_sends_ratios_and_its_own_vibration(tmp_path: Path) -> None:
    def write(log: Telemetry, time_us: int) -> None:
        log.add("estimator_status", 0, 831, 0.1, 0.2, 0.3, 0.6, 0.0, 0.0, 1.0, 1.0, time_us=time_us)
        log.add("vibration", 0, 1e-4, 1e-3, 90.0, 0, 0, 0, time_us=time_us + 1)

    made = flight(tmp_path, write, autopilot=PX4)
    assert found(made, "test_ratio", "magnetic").value[0] == pytest.approx(0.6)
    assert not [one for one in mavlink.evidence(made) if one.quantity == "vibration_mps2"]
    assert verdict(made, "innovations") == "fail" and verdict(made, "clipping") == "pass"


def test_receivers_vibration_power_and_sensors(tmp_path: Path) -> None:
    gyro, used = 1, 1 | 1 << 5

    def write(log: Telemetry, time_us: int) -> None:
        log.add("gps_raw_int", 0, 2, 500_000_000, 80_000_000, 0, 99, 99, 0, 0, 4, 0, 2_500, 0, 0, 0, time_us=time_us)
        log.add("vibration", 0, 10.0, 70.0, 5.0, 0, 0, 0, time_us=time_us + 1)
        log.add("sys_status", used, used, used - gyro, 300, 10_000, 100, 5, 0, 0, 0, 0, 0, 0, time_us=time_us + 2)
        log.add("power_status", 4_300, 0, 0, time_us=time_us + 3)
        log.add("param_value", b"BATT_LOW_VOLT", 10.5, 9, 2, 0, time_us=time_us + 4)
        log.add("param_value", b"AHRS_EKF_TYPE", 3.0, 9, 2, 1, time_us=time_us + 5)

    made = flight(tmp_path, write)
    assert found(made, "fix_type").value[0] == 2.0 and found(made, "eph_m").value[0] == pytest.approx(2.5)
    assert found(made, "caution", "gyro").value.min() == 1.0
    assert found(made, "supply_v").value[0] == pytest.approx(4.3)
    assert found(made, "battery_warning").value[-1] == 1.0  # 10.0 V for a minute, the limit is 10.5 V
    assert found(made, "battery_remaining").value[0] == pytest.approx(0.05)
    used_estimator = estimator_in_use(made)
    assert used_estimator is not None and used_estimator.name == "EKF3"
    told = {one.key: one.verdict for one in answer(made).checks}
    assert {told[key] for key in ("gnss", "vibration", "battery")} == {"fail"} and told["faults"] == "warn"


def test_a_link_that_was_lost_and_a_weak_radio(tmp_path: Path) -> None:
    def write(log: Telemetry, time_us: int) -> None:
        log.add("radio_status", 60, 255, 100, 50, 50, 0, 0, time_us=time_us)

    made = flight(tmp_path, write, seconds=120, silent=range(30, 60))
    lost = found(made, "data_link_lost")
    assert lost.value.sum() == pytest.approx(25.0, abs=1.0)
    assert found(made, "radio_margin_db", "ground").value[0] == pytest.approx(10.0 / 1.9)
    assert np.isnan(found(made, "radio_margin_db", "aircraft").value).all()  # 255: unknown


def test_what_was_said(tmp_path: Path) -> None:
    said = {
        10: (6, b"EKF2 IMU0 switching to compass 1"),
        20: (2, b"Battery 1 low 10.2V used 4000 mAh"),
        30: (6, b"Failsafe activated"),
        40: (2, b"PreArm: Need 3D Fix"),
        50: (6, b"Mission: 3 WP"),
    }

    def write(log: Telemetry, time_us: int) -> None:
        second = (time_us - START_US) // 1_000_000
        if second in said:
            log.add("statustext", *said[second], time_us=time_us)
            log.add("heartbeat", 2, ARDUPILOT, 209, 6, 5, 3, time_us=time_us + 1)

    told = {(one.check, one.grade, one.text) for one in mavlink.events(flight(tmp_path, write))}
    assert {
        ("switches", "info", "EKF2 IMU0 switching to compass 1"),  # the autopilot's own level
        ("battery", "fail", "Battery 1 low 10.2V used 4000 mAh"),
        ("faults", "warn", "Failsafe activated"),
        ("faults", "warn", "PreArm: Need 3D Fix"),
        ("faults", "info", "Mission: 3 WP"),
        ("modes", "info", "mode RTL"),
        ("modes", "info", "armed"),
        ("faults", "fail", "state critical"),
    } <= told


def test_messages_have_their_own_level_and_only_equal_ones_are_one(tmp_path: Path) -> None:
    said = {
        10: (6, b"EKF2 IMU0 switching to compass 1"),
        12: (6, b"EKF2 IMU1 switching to compass 1"),
        14: (6, b"EKF2 IMU1 switching to compass 1"),
        20: (4, b"GPS 1: unhealthy for 10.2 s"),
        22: (4, b"GPS 2: unhealthy for 10.2 s"),
        24: (4, b"GPS 2: unhealthy for 11.0 s"),
    }

    def write(log: Telemetry, time_us: int) -> None:
        second = (time_us - START_US) // 1_000_000
        if second in said:
            log.add("statustext", *said[second], time_us=time_us)

    made = flight(tmp_path, write)
    switches = next(one for one in answer(made).checks if one.key == "switches")
    assert switches.verdict == "pass" and switches.events_in_air == 0
    assert switches.reason == "EKF2 IMU0 switching to compass 1; EKF2 IMU1 switching to compass 1 (2 times)"
    assert [one.text for one in findings(made)] == [
        "GPS 1: unhealthy for 10.2 s",
        "GPS 2: unhealthy for 10.2 s, 2 times with other values",
    ]


def test_px4_modes_and_parameters_that_are_bits(tmp_path: Path) -> None:
    bits = float(np.array([2], dtype=np.int32).view(np.float32)[0])

    def write(log: Telemetry, time_us: int) -> None:
        log.add("heartbeat", 2, PX4, 209, 5 << 24 | 4 << 16, 4, 3, time_us=time_us)
        log.add("param_value", b"SYS_MC_EST_GROUP", bits, 6, 1, 0, time_us=time_us + 1)

    made = flight(tmp_path, write, autopilot=PX4)
    assert parameters_of(made).value("SYS_MC_EST_GROUP") == 2.0
    assert "mode Auto, Return" in {one.text for one in mavlink.events(made)}


def test_a_recorded_log_of_a_simulator_without_its_filter() -> None:
    made = groundstation.open(real_log("tlog/uavlogviewer_vtol.tlog")).flight
    told = {one.key: one.verdict for one in answer(made).checks}
    assert told["gnss"] == "pass" and told["vibration"] == "pass"
    assert told["innovations"] == "not_logged"  # every ratio is zero and no flag is set
    why = {one.key: one.reason for one in answer(made).checks}
    assert why["innovations"] == "logged, but EKF_STATUS_REPORT is zero throughout"
    assert why["battery"].startswith("battery 1 not measured (SYS_STATUS.voltage_battery: no voltage); supply")
    assert "filter logged without values" in answer(made).sentence


def test_messages_of_zeros_are_logged_without_values(tmp_path: Path) -> None:
    def write(log: Telemetry, time_us: int) -> None:
        log.add("ekf_status_report", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, time_us=time_us)
        log.add("vibration", 0, 0.0, 0.0, 0.0, 67, 0, 0, time_us=time_us + 1)
        log.add("sys_status", 1, 1, 1, 300, 0, -1, -1, 0, 0, 0, 0, 0, 0, time_us=time_us + 2)
        log.add("power_status", 5_000, 0, 0, time_us=time_us + 3)

    found_in = answer(flight(tmp_path, write))
    told = {one.key: (one.verdict, one.reason) for one in found_in.checks}
    assert told["innovations"] == ("not_logged", "logged, but EKF_STATUS_REPORT is zero throughout")
    assert told["vibration"] == ("not_logged", "logged, but VIBRATION is zero throughout")
    unmeasured = "battery 1 not measured (SYS_STATUS.voltage_battery: no voltage)"
    assert told["battery"] == ("pass", f"{unmeasured}; supply of the board up to 5 V")
    clipping = found_in.check("clipping")
    assert clipping.measures[0].told == "accelerometer clipped (IMU 1): none, its counter stood at 67 throughout"
    assert clipping.measures[1].told == "accelerometer clipped (IMU 2): none"
