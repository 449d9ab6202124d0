"""Evidence of ArduPilot logs of all eras: what each logs, in which units, and input that is missing or wrong."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.systems.health import ardupilot
from groundstation.systems.health.analysis import HEALTH
from groundstation.systems.health.answer import AutopilotHealth
from groundstation.systems.health.chapter import health
from groundstation.systems.health.ending import ends_in_the_air
from groundstation.systems.health.evidence import Event, Evidence, in_the_air, not_flown
from groundstation.systems.health.logged import low_pass, mean_over
from groundstation.systems.health.settings import HealthSettings
from groundstation.systems.known import Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table
from tests.readers.dataflash_writer import flight_log
from tests.real_logs import real_log
from tests.report_example import example
from tests.systems.health.made import END_S, KNOWN, NS, seconds, table

TIME = seconds()
HEALTHY = {"SV": 0.1, "SP": 0.2, "SH": 0.1, "SM": 0.1, "SVT": 0.0, "OFN": 0.0, "OFE": 0.0, "FS": 0.0, "TS": 0.0}
HEALTHY |= {"SS": 831.0, "PI": 0.0}


def parameters(**values: float) -> Table:
    made = table("raw.PARM", np.zeros(len(values)), Value=list(values.values()))
    columns = {**made.columns, "Name": Column(np.array(list(values)))}
    return Table("raw.PARM", made.time_ns, columns, made.record_index, made.device_time_ns)


def texts(topic: str, time_s: list[float], field: str, said: list[str], **more: object) -> Table:
    made = table(topic, time_s, **more)  # type: ignore[arg-type]
    columns = {**made.columns, field: Column(np.array(said))}
    return Table(topic, made.time_ns, columns, made.record_index, made.device_time_ns)


def flight(*tables: Table) -> Flight:
    """A plane of 100 s that says of itself that it flies from 10 to 90 s."""
    every = np.arange(0.0, END_S + 0.5, 1.0)
    flies = ((every >= 10.0) & (every < 90.0)).astype(np.float64)
    own = (table("raw.FMT", [0.0], Type=128.0), parameters(AHRS_EKF_TYPE=3.0), table("raw.STAT", every, isFlying=flies))
    return Flight({one.topic: one for one in (*own, *tables)}, {}, 0, False, "made.bin")


def found(made: Flight, quantity: str, sensor: str = "") -> Evidence:
    each = [one for one in ardupilot.evidence(made) if one.quantity == quantity and sensor in one.sensor]
    assert len(each) == 1, [one.sensor for one in each]
    return each[0]


def answer(made: Flight) -> AutopilotHealth:
    return HEALTH.run(made, KNOWN, HealthSettings()).answer


def verdict(made: Flight, check: str) -> str:
    try:
        return next(one.verdict for one in answer(made).checks if one.key == check)
    except NotAssessableError:
        return "not_logged"


def said(made: Flight, check: str) -> list[Event]:
    return [one for one in ardupilot.events(made) if one.check == check]


# Filters


@pytest.mark.parametrize(
    ("topic", "kind"), [("raw.XKF4.0", 3.0), ("raw.XKF4", 3.0), ("raw.NKF4", 2.0), ("raw.EKF4", 1.0)]
)
def test_roots_of_test_ratios_are_the_same_in_every_era(topic: str, kind: float) -> None:
    rejected = np.where((TIME > 20.0) & (TIME < 40.0), 1.3, 0.1)
    made = flight(parameters(AHRS_EKF_TYPE=kind), table(topic, TIME, **{**HEALTHY, "SP": rejected}))
    one = found(made, "test_ratio_root", "GNSS position")
    assert one.source == f"{topic}.SP" and one.value.max() == pytest.approx(1.3)
    assert not [each for each in ardupilot.evidence(made) if each.sensor == "airspeed"]  # never fused
    assert verdict(made, "innovations") == "fail"


def test_the_three_axes_of_an_old_magnetometer_are_one() -> None:
    old = {key: value for key, value in HEALTHY.items() if key not in ("SM", "PI", "SS", "TS")}
    made = flight(parameters(AHRS_EKF_USE=1.0), table("raw.EKF4", TIME, **old, SMX=0.1, SMY=0.9, SMZ=0.2))
    assert found(made, "test_ratio_root", "magnetic").value.max() == pytest.approx(0.9)


def test_a_root_that_ran_over_sixteen_bits_is_large() -> None:
    made = flight(table("raw.XKF4.0", TIME, **{**HEALTHY, "SV": -300.0}))
    assert found(made, "test_ratio_root", "velocity").value[0] == pytest.approx(355.36)


def test_only_the_lane_in_use_counts() -> None:
    first = np.where(TIME < 50.0, 0.0, 1.0)
    lanes = [
        table(f"raw.XKF4.{lane}", TIME, **{**HEALTHY, "PI": first, "SV": 0.1 + 2.0 * (lane == 1)}) for lane in (0, 1)
    ]
    one = found(flight(*lanes), "test_ratio_root", "velocity")
    assert one.value[one.time_ns < 50 * NS].max() == pytest.approx(0.1)
    assert one.value[one.time_ns >= 50 * NS].min() == pytest.approx(2.1)
    switches = said(flight(*lanes), "switches")
    assert [(one.time_ns, one.text) for one in switches] == [(50 * NS, "EKF3 switched to lane 1")]
    assert verdict(flight(*lanes), "switches") == "warn"


def test_lanes_that_old_firmware_numbered_by_type() -> None:
    lanes = [
        table(topic, TIME, **{**HEALTHY, "PI": 1.0, "SV": value})
        for topic, value in (("raw.NKF4", 0.1), ("raw.NKF9", 0.7))
    ]
    made = flight(parameters(AHRS_EKF_TYPE=2.0), *lanes)
    assert found(made, "test_ratio_root", "velocity").source == "raw.NKF9.SV"


def test_a_filter_that_did_not_fly_warns_and_never_fails() -> None:
    made = flight(parameters(AHRS_EKF_USE=0.0), table("raw.EKF4", TIME, **{**HEALTHY, "SP": 3.0}))
    one = found(made, "test_ratio_root_unused", "position")
    assert one.sensor == "GNSS position (EKF1, not in use)"
    assert verdict(made, "innovations") == "warn"
    assert "not in use" in answer(made).sentence


def test_dcm_that_flies_in_place_of_the_filter_fails() -> None:
    attitude = table("raw.ATT", TIME, Roll=0.0, Pitch=0.0, AEKF=np.where(TIME < 50.0, 3.0, 0.0))
    made = flight(table("raw.XKF4.0", TIME, **HEALTHY), attitude)
    assert verdict(made, "innovations") == "fail"
    assert [one.text for one in said(made, "switches")] == ["DCM took over from EKF3"]
    one = found(made, "test_ratio_root", "velocity")
    assert np.isnan(one.value[one.time_ns > 51 * NS]).all()  # nobody flew by it then


def test_faults_and_the_filters_own_warnings() -> None:
    late = (TIME > 30.0) & (TIME < 60.0)
    made = flight(
        table("raw.XKF4.0", TIME, **{**HEALTHY, "FS": late * 2.0, "TS": late * 1.0, "SS": 831.0 + late * 16384.0})
    )
    assert found(made, "fault", "velocity not a number").value.max() == 1.0
    assert found(made, "aiding_timeout", "GNSS position").value.max() == 1.0
    assert found(made, "filter_warning", "GNSS glitch").value.max() == 1.0
    assert verdict(made, "faults") == "fail"


def test_resets_are_told_by_the_filter_or_seen_in_its_position() -> None:
    told = np.where(TIME < 40.0, 0.0, 7.0)
    state = {"VN": 10.0, "VE": 0.0, "PN": 10.0 * TIME + np.where(TIME < 40.0, 0.0, 7.0), "PE": 0.0}
    both = flight(table("raw.XKF4.0", TIME, **{**HEALTHY, "OFN": told}), table("raw.XKF1.0", TIME, **state))
    assert [one.text for one in said(both, "resets")] == ["EKF3 reset its position by 7.0 m"]
    seen = flight(table("raw.XKF4.0", TIME, **HEALTHY), table("raw.XKF1.0", TIME, **state))
    assert [one.text for one in said(seen, "resets")] == ["EKF3 moved its position by 7.0 m at once"]
    assert verdict(seen, "resets") == "warn"


def test_biases_are_in_si_in_every_era() -> None:
    turned = {"GX": 3.0, "GY": 0.0, "GZ": 4.0}
    made = flight(
        parameters(AHRS_EKF_TYPE=2.0),
        table("raw.NKF4", TIME, **HEALTHY),
        table("raw.NKF1", TIME, **turned),
        table("raw.NKF2", TIME, AZbias=np.full(len(TIME), 50, dtype=np.int8)),
    )
    assert found(made, "gyro_bias_radps").value[0] == pytest.approx(np.deg2rad(5.0))
    assert found(made, "accel_bias_mps2").value[0] == pytest.approx(0.5)
    assert verdict(made, "imu") == "warn"


def test_the_second_estimate_is_set_against_the_first() -> None:
    where = {"Roll": 0.0, "Pitch": 0.0, "Lat": 50.0, "Lng": 179.9999}
    apart = (TIME > 30.0) & (TIME < 40.0)
    second = {"Roll": apart * 12.0, "Pitch": 0.0, "Lat": 50.0, "Lng": np.where(apart, -179.9999, 179.9999)}
    made = flight(table("raw.ATT", TIME, **where), table("raw.POS", TIME, **where), table("raw.AHR2", TIME, **second))
    assert found(made, "attitude_difference_deg").value.max() == pytest.approx(12.0)
    assert found(made, "position_difference_m").value.max() == pytest.approx(14.3, abs=0.1)  # across the date line
    assert verdict(made, "resets") == "fail"


# Sensors


def test_receivers_and_what_disturbs_them() -> None:
    made = flight(
        table("gnss", TIME, satellites_used=4.0, hdop=99.99),
        table("raw.GPS.0", TIME, Status=3.0),
        table("raw.GPA.0", TIME, HAcc=655.35, VAcc=2.0),
        table("raw.UBX1.0", TIME, noisePerMS=90.0, jamInd=90.0),
    )
    assert np.isnan(found(made, "hdop").value).all() and np.isnan(found(made, "eph_m").value).all()
    assert verdict(made, "gnss") == "fail" and verdict(made, "interference") == "fail"


@pytest.mark.parametrize("mixed", [True, False])
def test_instances_mixed_in_a_topic_are_told_apart(mixed: bool) -> None:
    if mixed:
        one = table(
            "raw.UBX1",
            np.repeat(TIME, 2),
            noisePerMS=90.0,
            jamInd=np.tile([10.0, 50.0], len(TIME)),
            Instance=np.tile([0.0, 1.0], len(TIME)),
        )
        tables: tuple[Table, ...] = (one,)
    else:
        tables = tuple(
            table(f"raw.UBX1.{k}", TIME, noisePerMS=90.0, jamInd=10.0 + 40.0 * k, Instance=float(k)) for k in (0, 1)
        )
    made = flight(*tables)
    assert found(made, "jamming_indicator", "GNSS 1").value.max() == 10.0
    assert found(made, "jamming_indicator", "GNSS 2").value.min() == 50.0


def test_vibration_and_clipping_of_old_and_new_layouts() -> None:
    old = table("raw.VIBE", TIME, VibeX=10.0, VibeY=70.0, VibeZ=1.0, Clip0=TIME, Clip1=0.0, Clip2=0.0)
    new = table("raw.VIBE.0", TIME, IMU=0.0, VibeX=10.0, VibeY=70.0, VibeZ=1.0, Clip=TIME)
    for one in (old, new):
        assert verdict(flight(one), "vibration") == "fail"
        assert found(flight(one), "clipping", "IMU 1").value.max() == pytest.approx(TIME[-1])
        assert verdict(flight(one), "clipping") == "warn"
    off = flight(parameters(AHRS_EKF_TYPE=3.0, INS_USE=0.0), new)
    assert verdict(off, "vibration") == "not_logged"


def test_a_field_that_follows_the_throttle() -> None:
    power = np.clip(np.sin(TIME / 5.0), 0.0, 1.0)
    field = table(
        "magnetometer", TIME, field_forward_nt=30_000.0 * (1.0 + 0.8 * power), field_right_nt=0.0, field_down_nt=0.0
    )
    for throttle, kind in ((power, np.float64), (power * 100.0, np.int16), (power * 1000.0, np.int16)):
        name = "ThO" if kind is np.float64 else "ThrOut"
        made = flight(field, table("raw.CTUN", TIME, **{name: throttle.astype(kind)}))
        assert found(made, "field_with_throttle").value.max() == pytest.approx(0.8, abs=0.02)
    assert verdict(made, "magnetometer") == "fail"
    still = flight(field, table("raw.CTUN", TIME, ThO=0.5))
    assert not [one for one in ardupilot.evidence(still) if one.quantity == "field_with_throttle"]
    unused = flight(parameters(COMPASS_USE=0.0), field)
    assert verdict(unused, "magnetometer") == "not_logged"


def test_the_difference_of_accelerometers_is_filtered_as_a_loop_does() -> None:
    rng = np.random.default_rng(4)
    time_s = np.cumsum(rng.uniform(0.001, 0.15, 2_000))
    value = rng.normal(size=(2_000, 3)) + 1.0
    value[700:720] = np.nan
    expected, state, before = [], np.zeros(3), time_s[0]
    for now, one in zip(time_s, value, strict=True):
        if np.isfinite(one).all():
            state = state + (one - state) * min(now - before, 0.1) / 5.0
        expected.append(state)
        before = now
    np.testing.assert_allclose(low_pass(time_s, value, 5.0, 0.1), expected, rtol=1e-9)


def test_the_mean_of_a_window() -> None:
    time_s = np.arange(0.0, 10.0, 0.1)
    value = time_s[:, None].copy()
    value[50] = np.nan
    mean = mean_over(time_s, value, 2.0)
    assert np.isnan(mean[:20]).all() and mean[40, 0] == pytest.approx(np.mean(time_s[21:41]))
    assert np.isfinite(mean[50:70]).all()


def test_inertial_units_against_each_other() -> None:
    fast = np.arange(0.0, 100.0, 0.02)
    still = {"GyrX": 0.0, "GyrY": 0.0, "GyrZ": 0.0, "AccX": 0.0, "AccY": 0.0, "AccZ": -9.8}
    drifts = {**still, "GyrY": np.where((fast > 30.0) & (fast < 50.0), 0.2, 0.0), "AccX": 2.0}
    for names in (("raw.IMU", "raw.IMU2"), ("raw.IMU.0", "raw.IMU.1")):
        made = flight(table(names[0], fast, **still), table(names[1], fast + 0.003, **drifts))
        assert found(made, "gyro_difference_radps").value[
            np.isfinite(found(made, "gyro_difference_radps").value)
        ].max() == pytest.approx(0.2)
        assert found(made, "accel_difference_mps2").value[-1] == pytest.approx(2.0, abs=0.01)
        assert verdict(made, "imu") == "fail"
    alone = flight(table("raw.IMU", fast, **still))
    assert verdict(alone, "imu") == "not_logged"


# Power, links, control


def test_a_battery_is_judged_by_the_limits_in_the_log_alone() -> None:
    low = np.where(TIME < 60.0, 11.5, 10.0)
    volts = (low, (low * 100.0).astype(np.int16))
    for name, volt in zip(("BAT", "CURR"), volts, strict=True):
        limits = parameters(AHRS_EKF_TYPE=3.0, BATT_LOW_VOLT=10.5)
        made = flight(limits, table(f"raw.{name}", TIME, Volt=volt))
        state = found(made, "battery_warning")
        first = state.time_ns[state.value > 0.0][0] / NS
        assert first == pytest.approx(70.0, abs=0.2)  # after ten seconds
        assert verdict(made, "battery") == "fail" or verdict(made, "battery") == "warn"
        assert verdict(flight(table(f"raw.{name}", TIME, Volt=volt)), "battery") == "not_logged"


def test_the_supply_in_millivolts_and_in_volts() -> None:
    for value in (np.full(len(TIME), 4_300, dtype=np.uint16), 4.3):
        assert found(flight(table("raw.POWR", TIME, Vcc=value)), "supply_v").value[0] == pytest.approx(4.3)


def test_links() -> None:
    weak = table("raw.RAD", TIME, RSSI=60.0, Noise=50.0, RemRSSI=0.0, RemNoise=0.0)
    packets = table(
        "raw.MAV.0",
        TIME,
        chan=0.0,
        rxp=np.mod(np.arange(len(TIME)) * 300.0, 65_536.0),
        rxdp=np.mod(np.arange(len(TIME)) * 100.0, 65_536.0),
    )
    made = flight(weak, packets)
    assert found(made, "radio_margin_db", "aircraft").value[0] == pytest.approx(10.0 / 1.9)
    assert np.nanmax(found(made, "packets_lost").value) == pytest.approx(0.25)
    assert verdict(made, "link") == "warn"


def test_setpoints_count_in_modes_that_have_them() -> None:
    attitude = table("raw.ATT", TIME, DesRoll=0.0, Roll=15.0, DesPitch=0.0, Pitch=0.0)
    manual = flight(attitude, table("raw.MODE", [0.0], ModeNum=0.0))
    assert verdict(manual, "tracking") == "not_logged"
    assert verdict(flight(attitude, table("raw.MODE", [0.0], ModeNum=5.0)), "tracking") == "warn"


def test_an_attitude_that_is_lost_fails_and_comes_first() -> None:
    """A copter that lies on its side for 3 s while level flight is asked for has lost control; 1 s is a gust."""
    for length_s, expected in ((1.0, "warn"), (3.0, "fail")):
        roll = np.where((TIME >= 50.0) & (50.0 + length_s > TIME), 70.0, 1.0)
        attitude = table("raw.ATT", TIME, DesRoll=0.0, Roll=roll, DesPitch=0.0, Pitch=0.0)
        made = flight(attitude, table("raw.MODE", [0.0], ModeNum=5.0))
        assert verdict(made, "tracking") == expected
    assert answer(made).sentence.startswith("Control of attitude lost 0:50.0-0:53.0")


def test_a_log_that_ends_in_a_fall() -> None:
    every = np.arange(0.0, 60.0, 0.1)
    landed = table("raw.vehicle_land_detected", every, landed=np.where(every < 10.0, 1.0, 0.0))
    for down, expected in ((13.2, ["log ends in the air, sinking at 13 m/s"]), (3.0, [])):
        tables = {"ins": table("ins", every, velocity_down_mps=np.where(every > 57.0, down, 0.0)), landed.topic: landed}
        made = Flight(tables, {}, 0, False, "made.bin")
        assert [one.text for one in ends_in_the_air(made, in_the_air(made, KNOWN))] == expected


def test_outputs_at_their_end() -> None:
    ends = {"SERVO1_FUNCTION": 33.0, "SERVO2_FUNCTION": 4.0, "SERVO2_MIN": 1000.0, "SERVO2_MAX": 2000.0}
    ends |= {"MOT_PWM_MIN": 1000.0, "MOT_PWM_MAX": 2000.0, "AHRS_EKF_TYPE": 3.0}
    made = flight(parameters(**ends), table("raw.RCOU", TIME, C1=2000.0, C2=1500.0))
    assert (
        found(made, "output_full", "motors").value.min() == 1.0
        and found(made, "output_full", "surfaces").value.max() == 0.0
    )
    assert verdict(flight(table("raw.RCOU", TIME, C1=2000.0)), "saturation") == "not_logged"


# What was said


def test_text_codes_and_modes_are_graded() -> None:
    made = flight(
        texts(
            "raw.MSG",
            [20.0, 21.0, 22.0],
            "Message",
            ["Throttle failsafe on", "Throttle failsafe off", "Reached waypoint"],
        ),
        table("raw.ERR", [30.0, 31.0, 32.0], Subsys=[6.0, 6.0, 24.0], ECode=[1.0, 0.0, 1.0]),
        table("raw.EV", [33.0], Id=62.0),
        table("raw.MODE", [40.0, 50.0], ModeNum=[5.0, 11.0], Rsn=[1.0, 3.0]),
    )
    told = {(one.check, one.grade, one.text) for one in ardupilot.events(made)}
    assert told == {
        ("faults", "fail", "Throttle failsafe on"),
        ("faults", "info", "Throttle failsafe off"),
        ("faults", "info", "Reached waypoint"),
        ("faults", "fail", "failsafe of the battery"),
        ("faults", "info", "failsafe of the battery over"),
        ("switches", "warn", "EKF lane changed to 1"),
        ("resets", "warn", "EKF yaw reset"),
        ("modes", "info", "mode 5, reason: remote control"),
        ("faults", "fail", "mode 11, reason: radio failsafe"),
    }


def test_the_alignment_of_yaw_in_flight_is_no_reset() -> None:
    said_so = texts("raw.MSG", [40.0], "Message", ["EKF2 IMU0 in-flight yaw alignment complete"])
    made = flight(said_so, table("raw.EV", [40.1, 60.0], Id=62.0))
    assert [(one.time_ns / NS, one.grade) for one in said(made, "resets")] == [(40.1, "info"), (60.0, "warn")]


# Input that is missing or wrong


def wrong(one: Table, how: str) -> Table:
    columns = dict(one.columns)
    for name in list(columns):
        values = columns[name].values
        if how == "nan":
            columns[name] = Column(np.full(len(values), np.nan))
        elif how == "text":
            columns[name] = Column(np.full(len(values), "x"))
        elif how == "absent":
            columns[name] = Column(values, np.zeros(len(values), dtype=bool))
        elif how == "renamed":
            columns[f"{name}x"] = columns.pop(name)
    return Table(one.topic, one.time_ns, columns, one.record_index, one.device_time_ns)


def everything(step_s: float) -> tuple[Table, ...]:
    time_s = seconds(step_s)
    still = {"GyrX": 0.0, "GyrY": 0.0, "GyrZ": 0.0, "AccX": 0.0, "AccY": 0.0, "AccZ": -9.8, "GH": 1.0, "AH": 1.0}
    attitude = {"DesRoll": 0.0, "Roll": 1.0, "DesPitch": 0.0, "Pitch": 1.0, "AEKF": 3.0}
    return (
        table("raw.XKF4.0", time_s, **HEALTHY),
        table("raw.XKF1.0", time_s, GX=0.01, GY=0.0, GZ=0.0, PN=0.0, PE=0.0, VN=0.0, VE=0.0),
        table("raw.XKF2.0", time_s, AX=0.01, AY=0.0, AZ=0.0),
        table("raw.XKFS.0", time_s, MI=0.0, BI=0.0, GI=0.0, AI=0.0),
        table("raw.ATT", time_s, **attitude),
        table("raw.AHR2", time_s, Roll=1.0, Pitch=1.0, Lat=50.0, Lng=8.0),
        table("raw.POS", time_s, Lat=50.0, Lng=8.0),
        table("raw.GPS.0", time_s, Status=3.0, U=1.0),
        table("raw.GPA.0", time_s, HAcc=0.8, VAcc=1.0),
        table("raw.UBX1.0", time_s, jamInd=10.0, noisePerMS=90.0),
        table("raw.VIBE.0", time_s, VibeX=1.0, VibeY=1.0, VibeZ=1.0, Clip=0.0),
        table("raw.MAG.0", time_s, MagX=200.0, OfsX=10.0, OfsY=0.0, OfsZ=0.0),
        table("raw.IMU.0", time_s, **still),
        table("raw.IMU.1", time_s, **still),
        table("raw.PM", time_s, NLon=0.0, NL=4000.0, Load=300.0, IntE=0.0),
        table("raw.DSF", time_s, Dp=0.0),
        table("raw.BAT.0", time_s, Volt=12.0, Curr=5.0, RemPct=80.0),
        table("raw.POWR", time_s, Vcc=5.0),
        table("raw.RSSI", time_s, RXRSSI=0.9),
        table("raw.RCI2", time_s, Flags=1.0),
        table("raw.RAD", time_s, RSSI=150.0, Noise=50.0, RemRSSI=150.0, RemNoise=50.0),
        table("raw.MAV.0", time_s, rxp=1.0, rxdp=0.0),
        table("raw.RATE", time_s, RDes=0.0, R=1.0, PDes=0.0, P=1.0),
        table("raw.RCOU", time_s, C1=1500.0),
        table("raw.CTUN", time_s, ThO=0.4),
        table("raw.ERR", [20.0], Subsys=6.0, ECode=0.0),
        table("raw.EV", [21.0], Id=25.0),
        table("raw.MODE", [0.0], ModeNum=5.0, Rsn=1.0),
    )


@pytest.mark.parametrize("step_s", [0.04, 1.0])
def test_a_healthy_flight_passes_at_any_rate(step_s: float) -> None:
    limits = parameters(
        AHRS_EKF_TYPE=3.0, BATT_LOW_VOLT=10.5, SERVO1_FUNCTION=4.0, SERVO1_MIN=1000.0, SERVO1_MAX=2000.0
    )
    gnss = table("gnss", seconds(step_s), satellites_used=12.0, hdop=0.8, velocity_sigma_mps=0.3)
    found_out = answer(flight(limits, gnss, *everything(step_s)))
    assert {one.key: one.verdict for one in found_out.checks if one.verdict != "pass"} == {
        "settings": "not_logged",
        "yaw": "not_logged",
    }


@pytest.mark.parametrize("how", ["nan", "text", "absent", "renamed"])
@pytest.mark.parametrize("place", range(len(everything(1.0))))
def test_bad_input_is_never_a_pass_of_its_own(how: str, place: int) -> None:
    one = everything(1.0)[place]
    told = ardupilot.evidence(flight(wrong(one, how)))
    assert not [each for each in told if np.isfinite(each.value).any() and one.topic in each.source]
    ardupilot.events(flight(wrong(one, how)))


def test_empty_topics_are_passed_over() -> None:
    made = flight(*(one.take(slice(0, 0)) for one in everything(1.0)))
    assert ardupilot.evidence(made) == () and ardupilot.events(made) == ()


# Logs


def test_when_it_flew() -> None:
    assert in_the_air(flight(), KNOWN).method == "STAT.isFlying"
    armed = Flight(
        {"raw.EV": table("raw.EV", [5.0, 60.0, 70.0], Id=[10.0, 11.0, 10.0]), "x": table("x", [0.0, 100.0], a=0.0)}
    )
    spans = in_the_air(armed, KNOWN)
    assert spans.words == "while armed" and spans.seconds == pytest.approx(55.0 + 30.0)
    assert not_flown(armed, spans) == "", "no flag says it"


def test_a_log_that_says_so_did_not_fly() -> None:
    time = np.arange(0.0, 100.0)
    stat = table("raw.STAT", time, isFlying=0.0, Armed=1.0)
    parameters_set = parameters(COMPASS_OFS_X=1.0)
    offset = table("raw.MAG", time, MagX=200.0, MagY=0.0, MagZ=400.0, OfsX=700.0, OfsY=0.0, OfsZ=0.0)
    logged = table("raw.FMT", [0.0], Type=128.0)
    moved = Flight({one.topic: one for one in (logged, stat, parameters_set, offset)}, {}, 0, False, "made.bin")
    found = answer(moved)
    assert (found.judged_over, found.not_flown) == ("while armed", "STAT.isFlying 0")
    assert found.sentence.startswith("Did not fly; ")
    told = str(health(replace(example(), answers={"health": found})))
    assert "It did not fly (STAT.isFlying 0)." in told and "time in the air" not in told
    flown = answer(flight(parameters_set, offset))
    assert flown.not_flown == "" and "not fly" not in str(health(replace(example(), answers={"health": flown})))


def test_a_log_of_todays_layout(tmp_path: object) -> None:
    import groundstation

    path = tmp_path / "made.bin"  # type: ignore[operator]
    path.write_bytes(flight_log(30).content)
    opened = groundstation.open(path)
    assert ardupilot.applies(opened.flight)
    quantities = {one.quantity for one in ardupilot.evidence(opened.flight)}
    assert {
        "satellites",
        "hdop",
        "speed_accuracy_mps",
        "fix_type",
        "field_length_gauss",
        "gyro_difference_radps",
    } <= quantities


REAL: Iterable[tuple[str, dict[str, str]]] = (
    (
        "copter_3.6.7_log0041.BIN",
        {"gnss": "pass", "vibration": "pass", "innovations": "pass", "tracking": "fail", "faults": "fail"},
    ),
    ("erle_plane_4-12-2014_329.BIN", {"gnss": "pass", "innovations": "warn", "resets": "warn", "interference": "warn"}),
    ("plane_4.2.3_pilot0004.BIN", {"gnss": "fail", "innovations": "fail", "timing": "warn", "tracking": "not_logged"}),
)


@pytest.mark.parametrize(("name", "expected"), REAL)
def test_recorded_logs(name: str, expected: dict[str, str]) -> None:
    import groundstation

    opened = groundstation.open(real_log(f"dataflash/{name}"))
    known = Known(flight_phases(opened.flight))
    found_out = HEALTH.run(opened.flight, known, HealthSettings()).answer
    assert {one.key: one.verdict for one in found_out.checks if one.key in expected} == expected
