"""Topic `imu` of every reader: which source is taken, its units, its times, and what it says of them."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.readers import imu, registry
from groundstation.readers.ulog.canonical import TopicRows
from groundstation.readers.ulog.inertial import IMU_ROLES
from tests.readers import test_bags as bags
from tests.readers.bag_writer import START_NS, Messages, write_ros1
from tests.readers.dataflash_writer import DataFlash
from tests.readers.receiver_writer import COUNTS, measured, novatel, novatel_text, pvt, raw_imu, raw_sensors
from tests.readers.telemetry_writer import Telemetry
from tests.readers.test_dataflash import Log
from tests.readers.test_receiver import Read as ReceiverRead
from tests.readers.test_ulog import Read as UlogRead
from tests.readers.test_ulog import read
from tests.readers.ulog_writer import UlogWriter
from tests.real_logs import real_log

SINGLE = 1e-6  # relative: products of single precision
COMBINED = (
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;uint32_t accelerometer_integral_dt;"
    "uint8_t accelerometer_clipping;uint8_t gyro_clipping;"
)
OLD_COMBINED = (
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;float accelerometer_integral_dt;"
)
VEHICLE_IMU = (
    "vehicle_imu:uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
    "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;uint8_t delta_angle_clipping;uint8_t delta_velocity_clipping;"
)
SPLIT = ("vehicle_angular_velocity", "vehicle_acceleration")


def px4(units: dict[str, int], rows: int = 40) -> UlogWriter:
    """A log with sensor_combined, vehicle_imu (by instance) and the two filtered messages, each as often as told."""

    def is_due(name: str, row: int) -> bool:
        return name in units and row % units[name] == 0

    log = UlogWriter().flags().format(COMBINED).format(VEHICLE_IMU)
    for number, name in enumerate(SPLIT):
        log.format(f"{name}:uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;").subscribe(10 + number, name)
    log.subscribe(0, "sensor_combined").subscribe(1, "vehicle_imu").subscribe(2, "vehicle_imu", 1)
    for row in range(rows):
        at = 10_000_000 + row * 4_000
        if is_due("sensor_combined", row):
            log.row(0, "Q3fIi3fIBB", at, 0.5, -1.0, 2.0, 4_000, 0, 1.0, 2.0, -9.75, 5_000, 0b101, 0b1)
        for instance in range(2):
            if is_due(f"vehicle_imu.{instance}", row):
                angles, velocities = (1e-3, 2e-3, 3e-3 + instance), (0.01, 0.02, -0.04)
                log.row(1 + instance, "QQ3f3fIIBB", at, at - 700, *angles, *velocities, 4_000, 4_000, 0, 0b110)
        for number, name in enumerate(SPLIT):
            if is_due(name, row):
                log.row(10 + number, "QQ3f", at, at - 300, 1.0, 2.0, 3.0)
    return log


def told(found: UlogRead, topic: str = "imu") -> str:
    return next(one.text for one in found.remarks if one.code == "mapped").partition(f"{topic} from ")[2].split(";")[0]


def test_px4_increments_of_each_unit_come_first(tmp_path: Path) -> None:
    found = read(
        tmp_path, px4({"sensor_combined": 1, "vehicle_imu.0": 1, "vehicle_imu.1": 1, SPLIT[0]: 1, SPLIT[1]: 1})
    )
    assert (found.rows("imu.1"), found.rows("imu.2"), found.rows("imu")) == (40, 40, 0)
    assert found.values("imu.2", "delta_angle_z_rad")[0] == pytest.approx(1.003, rel=SINGLE)
    assert found.values("imu.1", "delta_velocity_z_mps")[0] == pytest.approx(-0.04, rel=SINGLE)
    assert found.values("imu.1", "interval_s")[0] == pytest.approx(0.004, rel=SINGLE)
    assert found.values("imu.1", "accel_clipping")[0] == 2.0 and found.values("imu.1", "gyro_clipping")[0] == 0.0
    assert found.values("imu.1", "is_integral") == [True] * 40
    batch = found.batches["imu.1"][0]
    assert "velocity_interval_s" not in batch.columns, "both intervals are one"
    assert batch.validity_time_ns is not None
    assert (batch.device_time_ns.values - batch.validity_time_ns).tolist() == [700_000] * 40


def test_px4_increments_that_were_thinned_out_are_passed_over(tmp_path: Path) -> None:
    found = read(tmp_path, px4({"sensor_combined": 1, "vehicle_imu.0": 10, SPLIT[0]: 2, SPLIT[1]: 5}))
    assert found.rows("imu") == 40 and told(found) == "sensor_combined"
    assert found.values("imu", "delta_angle_z_rad")[0] == pytest.approx(2.0 * 0.004, rel=SINGLE)
    assert found.values("imu", "delta_velocity_z_mps")[0] == pytest.approx(-9.75 * 0.005, rel=SINGLE)
    assert found.values("imu", "velocity_interval_s")[0] == pytest.approx(0.005, rel=SINGLE)
    assert found.values("imu", "accel_clipping")[0] == 2.0 and found.values("imu", "gyro_clipping")[0] == 1.0
    assert any("integration times" in one.text for one in found.remarks if one.topic == "imu")


def test_px4_samples_are_the_last_choice_and_say_so(tmp_path: Path) -> None:
    found = read(tmp_path, px4({SPLIT[0]: 1, SPLIT[1]: 4}))
    assert found.rows("imu") == 50 and set(found.values("imu", "is_integral")) == {False}
    rates = [value for value in found.values("imu", "rate_z_dps") if value is not None]
    assert len(rates) == 40 and rates[0] == pytest.approx(np.rad2deg(3.0), rel=SINGLE)
    assert sum(value is not None for value in found.values("imu", "accel_z_mps2")) == 10
    assert any(imu.POINT_SAMPLES in one.text for one in found.remarks if one.topic == "imu")
    assert read(tmp_path, px4({SPLIT[0]: 1})).rows("imu") == 0, "rates alone are no unit"


def test_px4_integration_times_were_seconds_once(tmp_path: Path) -> None:
    log = UlogWriter().flags().format(OLD_COMBINED).subscribe(0, "sensor_combined")
    log.row(0, "Q3ffi3ff", 10_000_000, 0.5, -1.0, 2.0, 0.004, 0, 1.0, 2.0, -9.75, 0.004)
    log.row(0, "Q3ffi3ff", 10_004_000, 0.5, -1.0, 2.0, 0.004, 0x7FFFFFFF, 1.0, 2.0, -9.75, 0.004)
    log.row(0, "Q3ffi3ff", 10_008_000, 0.5, -1.0, 2.0, 0.0, 0, 1.0, 2.0, -9.75, 0.004)
    found = read(tmp_path, log)
    assert found.values("imu", "delta_angle_z_rad") == [pytest.approx(0.008, rel=SINGLE)] * 2 + [None], "no interval"
    assert found.values("imu", "delta_velocity_z_mps") == [
        pytest.approx(-0.039, rel=SINGLE),
        None,
        pytest.approx(-0.039, rel=SINGLE),
    ], "no sensor"


def test_px4_time_of_validity_must_be_credible(tmp_path: Path) -> None:
    log = UlogWriter().flags().format(VEHICLE_IMU).subscribe(1, "vehicle_imu")
    for at, sample in ((10_000_000, 0), (10_004_000, 10_003_500), (10_008_000, 10_009_000), (10_012_000, 1_000)):
        log.row(1, "QQ3f3fIIBB", at, sample, *[0.0] * 6, 4_000, 4_000, 0, 0)
    validity_ns = read(tmp_path, log).batches["imu"][0].validity_time_ns
    assert validity_ns is not None and validity_ns.tolist() == [
        10_000_000_000,
        10_003_500_000,
        10_008_000_000,
        10_012_000_000,
    ]


def test_every_rule_of_px4_names_fields_that_exist() -> None:
    from groundstation.base.signals import field_of

    for role in (role for roles in IMU_ROLES for role in roles):
        for rule in role.rules:
            columns = rule.columns(TopicRows(np.ones(1, dtype=[(name, "f8") for name in rule.needs])))
            assert columns and all(field_of("imu", name) for name in (*columns, *rule.derived))
            assert {column.values.dtype.kind for column in columns.values()} <= {"f", "b"}


def ardupilot(types: dict[str, int], rows: int = 20) -> DataFlash:
    """A log with some of ArduPilot's inertial records, each as often as told."""
    log = DataFlash()
    log.define(1, "IMU", "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T")
    log.define(2, "IMT", "QBfffffffff", "TimeUS,I,DelT,DelvT,DelaT,DelAX,DelAY,DelAZ,DelVX,DelVY,DelVZ")
    log.define(3, "GYR", "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ")
    log.define(4, "ACC", "QBQfff", "TimeUS,I,SampleUS,AccX,AccY,AccZ")
    values = {
        "IMU": lambda at: (0.5, -1.0, 2.0, 1.0, 2.0, -9.75, 41.5),
        "IMT": lambda at: (0.004, 0.0041, 0.004, 1e-3, 2e-3, 3e-3, 0.01, 0.02, -0.04),
        "GYR": lambda at: (at - 120, 0.5, -1.0, 2.0),
        "ACC": lambda at: (at - 80, 1.0, 2.0, -9.75),
    }
    log._types |= {"FMU": (200, "QBNN")}
    for row in range(rows):
        for name, (every, units) in types.items():
            for unit in range(units):
                if row % every == 0:
                    at = 1_000_000 + row * 4_000 + unit
                    log.write(name, at, unit, *values[name](at))
    return log


def with_units(log: DataFlash) -> DataFlash:
    """The field `I` tells instances apart: that needs FMTU."""
    head = DataFlash()
    head.define_units({"s": "s", "#": "instance", "-": ""}, {"-": 0.0, "F": 1e-6})
    for name, (type_id, characters) in log._types.items():
        if name in ("IMU", "IMT", "GYR", "ACC"):
            head._types[name] = (type_id, characters)
            head.units(name, "s#" + "-" * (len(characters) - 2), "F" + "-" * (len(characters) - 1))
    log.records = [*log.records[:5], *head.records[1:], *log.records[5:]]
    return log


@pytest.mark.parametrize(
    ("types", "topics", "is_integral"),
    [
        ({"IMT": (1, 2), "IMU": (1, 2)}, ["imu.1", "imu.2"], True),
        ({"IMT": (10, 2), "IMU": (1, 2)}, ["imu.1", "imu.2"], False),
        ({"IMU": (1, 1)}, ["imu"], False),
        ({"GYR": (1, 2), "ACC": (1, 2), "IMU": (10, 2)}, ["imu.1", "imu.2"], False),
    ],
    ids=["increments", "thinned", "samples", "apart"],
)
def test_ardupilot_takes_the_best_that_is_whole(
    tmp_path: Path, types: dict[str, tuple[int, int]], topics: list[str], is_integral: bool
) -> None:
    found = Log(tmp_path / "log.BIN", with_units(ardupilot(types)).content)
    assert [topic for topic in found.flight.topics() if topic.startswith("imu")] == topics
    assert set(found.present(topics[0], "is_integral")) == {is_integral}
    if is_integral:
        assert found.present(topics[1], "delta_velocity_z_mps")[0] == pytest.approx(-0.04, rel=SINGLE)
        assert found.present(topics[1], "velocity_interval_s")[0] == pytest.approx(0.0041, rel=SINGLE)
        assert "increments" in found.derived(topics[0], "interval_s")
    else:
        assert found.present(topics[0], "rate_z_dps")[0] == pytest.approx(np.rad2deg(2.0), rel=SINGLE)
        assert found.present(topics[0], "accel_z_mps2")[0] == pytest.approx(-9.75, rel=SINGLE)
        assert imu.POINT_SAMPLES in found.derived(topics[0], "rate_z_dps")


def test_ardupilot_samples_of_sensors_apart_have_their_own_times(tmp_path: Path) -> None:
    found = Log(tmp_path / "log.BIN", with_units(ardupilot({"GYR": (1, 1), "ACC": (1, 1)})).content)
    batch = next(one for one in found.batches if one.topic == "imu")
    assert batch.validity_time_ns is not None
    late_us = ((batch.device_time_ns.values - batch.validity_time_ns) // 1000).tolist()
    assert sorted(set(late_us)) == [80, 120]


def test_ardupilot_temperature_of_a_unit(tmp_path: Path) -> None:
    found = Log(tmp_path / "log.BIN", with_units(ardupilot({"IMU": (1, 1)})).content)
    assert found.present("imu", "temperature_c")[0] == 41.5


def test_ardupilot_fixes_are_valid_when_their_message_came(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(1, "GPS", "QBIHBcLLeffff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw")
    log.define(2, "GPA", "QCCCCBIH", "TimeUS,VDop,HAcc,VAcc,SAcc,VV,SMS,Delta")
    for at in range(3):
        now = 2_000_500 + at * 200_000
        log.write("GPS", now, 3, 1000 * at, 2200, 9, 100, 10, 20, 30, 1.0, 0.0, 0.0, 0.0)
        log.write("GPA", now, 100, 100, 100, 10, 1, (now - 8_500) // 1000 if at else 0, 200)
    found = Log(tmp_path / "log.BIN", log.content)
    batch = next(one for one in found.batches if one.topic == "gnss")
    assert batch.validity_time_ns is not None
    assert (batch.device_time_ns.values - batch.validity_time_ns).tolist() == [0, 8_500_000, 8_500_000]


def test_ros_samples_are_turned_and_each_unit_is_a_topic(tmp_path: Path) -> None:
    messages = Messages(is_ros1=True)
    for row in range(50):
        stamp_ns = START_NS + row * 10_000_000
        messages.imu("/a/imu", stamp_ns, (0.0, 0.0, 0.0, 1.0), (0.1, 0.2, 0.3), (1.0, 2.0, 9.8))
        messages.imu("/b/imu", stamp_ns, (0.0, 0.0, 0.0, 1.0), (1.1, 0.2, 0.3), (1.0, 2.0, 9.8))
        messages.imu("/c/imu", stamp_ns, (0.0, 0.0, 0.0, 1.0))
    flight = bags.flight_of(write_ros1(tmp_path / "a.bag", messages), tmp_path)
    assert [topic for topic in flight.topics() if topic.startswith("imu")] == ["imu.1", "imu.2"]
    one = flight["imu.1"]
    assert one.values("rate_y_dps")[0] == pytest.approx(-np.rad2deg(0.2), rel=SINGLE)
    assert one.values("accel_z_mps2")[0] == pytest.approx(-9.8, rel=SINGLE)
    assert flight["imu.2"].values("rate_x_dps")[0] == pytest.approx(np.rad2deg(1.1), rel=SINGLE)
    assert not one.values("is_integral").any() and (np.diff(one.time_ns) == 10_000_000).all()
    assert "rate_x_dps" in flight["ins.1"].columns, "what scripts read of `ins` stays"


def test_ublox_measurements_by_their_counter(tmp_path: Path) -> None:
    content = b""
    for second in range(3):
        content += pvt(f"2026-05-04T12:00:{second:02d}Z")
        for part in range(10):
            tick = 5_000 + second * 1_000 + part * 100 + 60
            content += measured(tick, (14, 4096), (13, -4096), (5, 8192), (16, 1024), (17, 0), (18, -10 * 1024))
            content += measured(tick + 1, (12, 4150))
    found = ReceiverRead(tmp_path, content)
    assert found.values("imu", "rate_x_dps")[0] == 1.0 and found.values("imu", "rate_y_dps")[0] == -1.0
    assert found.values("imu", "rate_z_dps")[0] == 2.0 and found.values("imu", "accel_z_mps2")[0] == -10.0
    assert len(found.values("imu", "rate_x_dps")) == 30, "a temperature alone is no row"
    times = found.times("imu")
    assert times[0] == "2026-05-04T12:00:00.000000000Z" and times[-1] == "2026-05-04T12:00:02.900000000Z"
    assert any(
        imu.POINT_SAMPLES in one.text
        for one in found.items
        if getattr(one, "topic", "") == "imu" and hasattr(one, "code")
    )


def test_ublox_raw_samples_by_milliseconds_and_the_counter_of_the_sensor(tmp_path: Path) -> None:
    content, tag = b"", (1 << 24) - 700  # the counter runs over within the first message
    for second in range(3):
        content += pvt(f"2026-05-04T12:00:{second:02d}Z")
        for part in range(10):
            content += raw_sensors(5_000 + second * 1_000 + part * 100 + 60, tag % (1 << 24), 10)
            tag += 2_560
    found = ReceiverRead(tmp_path, content)
    rates = found.values("imu", "rate_x_dps")
    assert len(rates) == 300 and rates[1] == pytest.approx(4097 / 4096, rel=SINGLE)
    assert found.values("imu", "rate_y_dps")[0] == -1.0 and found.values("imu", "accel_z_mps2")[-1] == -10.0
    times = found.times("imu")
    assert times[:3] == [f"2026-05-04T12:00:00.0{at}0000000Z" for at in range(3)]
    assert times[-1] == "2026-05-04T12:00:02.990000000Z" and len(set(times)) == 300


def test_ublox_raw_samples_without_milliseconds_stay_raw(tmp_path: Path) -> None:
    content = pvt("2026-05-04T12:00:00Z") + b"".join(raw_sensors(0, 2_560 * at, 10) for at in range(10))
    found = ReceiverRead(tmp_path, content)
    assert not found.batches("imu") and len(found.values("raw.ESF-RAW.group", "sTtag")) == 600
    assert any("no milliseconds" in getattr(one, "text", "") for one in found.items)


def test_ublox_message_with_more_samples_gives_the_unit(tmp_path: Path) -> None:
    content = b""
    for second in range(3):
        content += pvt(f"2026-05-04T12:00:{second:02d}Z") + raw_sensors(5_060 + second * 1_000, 2_560 * second, 10)
        content += measured(5_060 + second * 1_000, (14, 4096), (13, -4096), (5, 8192))
    found = ReceiverRead(tmp_path, content)
    assert len(found.values("imu", "rate_x_dps")) == 30
    assert any("ESF-MEAS (3) stays raw: ESF-RAW has more" in getattr(one, "text", "") for one in found.items)


def test_novatel_without_gravity_is_no_specific_force(tmp_path: Path) -> None:
    content = b"".join(
        novatel("CORRIMUDATA", 1_000 * at, week=2417, seconds=at, corr_accel_z=0.1) for at in range(1, 9)
    )
    found = ReceiverRead(tmp_path, content)
    assert not found.batches("imu")
    assert any("without gravity" in getattr(one, "text", "") for one in found.items)


def test_mavlink_samples_and_the_bits_of_what_is_new(tmp_path: Path) -> None:
    log = Telemetry()
    for row in range(30):
        time_us = 1_000_000 + row * 20_000
        log.add("attitude", row * 20, 0.1, -0.2, 0.3, 0.01, 0.02, 0.03)
        new = 0b111111 if row % 2 else 0b111000
        log.add("highres_imu", time_us, 1.0, 2.0, -9.75, 0.5, -1.0, 2.0, 0, 0, 0, 1013.0, 0, 0, 41.5, new | 1 << 12)
        log.add("raw_imu", time_us, 0, 0, -1000, 0, 0, 0, 0, 0, 0)
    path = tmp_path / "a.tlog"
    path.write_bytes(bytes(log.data))
    found = UlogRead(path)
    assert found.values("imu", "rate_z_dps")[0] == pytest.approx(np.rad2deg(2.0), rel=SINGLE)
    assert found.values("imu", "accel_z_mps2")[:2] == [None, pytest.approx(-9.75, rel=SINGLE)]
    assert found.values("imu", "temperature_c")[0] == 41.5


@pytest.mark.parametrize(
    ("name", "topic", "rows", "field"),
    [
        ("ulog/px4_rs_6ba1abc7.ulg", "imu", 4_445, "delta_angle_x_rad"),
        ("ulog/quadrotor_local.ulg", "imu", 20_236, "delta_angle_x_rad"),
        ("dataflash/TestLog2_REENCODED_plane.BIN", "imu", 30_650, "rate_x_dps"),
        ("dataflash/copter_3.6.7_log0041.BIN", "imu.3", 1_480, "rate_x_dps"),
        ("foreign/robot_localization_husky_test1.bag", "imu", 11_865, "rate_x_dps"),
        ("tlog/uavlogviewer_vtol.tlog", "imu", 795, "rate_x_dps"),
        ("reference_heading/pntos_drive_first_half_imu.csv.gz", "imu", 130_000, "delta_angle_x_rad"),
    ],
)
def test_recorded_logs(name: str, topic: str, rows: int, field: str) -> None:
    path = real_log(name)
    count = 0
    for item in registry.read(path):
        if getattr(item, "columns", None) is not None and item.topic == topic:
            count += int(item.columns[field].mask.sum())
    assert count == rows


@pytest.mark.parametrize("name", ["RAWIMUX", "RAWIMUSX"])
def test_novatel_counts_are_scaled_by_the_type_and_turned(tmp_path: Path, name: str) -> None:
    found = ReceiverRead(tmp_path, b"".join(raw_imu(name, 100.0 + 0.005 * at, 58, **COUNTS) for at in range(8)))
    velocity, angle = 2.0**-29, 2.0**-33  # HG4930
    expected = {"delta_velocity_x_mps": -2 * velocity, "delta_velocity_y_mps": 3 * velocity}
    expected |= {"delta_velocity_z_mps": -1 * velocity, "delta_angle_x_rad": -5 * angle}
    expected |= {"delta_angle_y_rad": 6 * angle, "delta_angle_z_rad": -4 * angle}
    for field, value in expected.items():
        assert found.values("imu", field)[0] == pytest.approx(value, rel=SINGLE), field
    assert set(found.values("imu", "is_integral")) == {True} and "interval_s" not in found.batches("imu")[0].columns
    assert [time[20:29] for time in found.times("imu")[:3]] == ["000000000", "005000000", "010000000"]
    assert any("HG4930 AN01" in getattr(one, "text", "") for one in found.items)


def test_novatel_example_of_the_manual_shows_gravity(tmp_path: Path) -> None:
    """RAWIMUSX, ASCII example of the OEM7 manual: an EPSON G320N, 125 Hz, that stands."""
    body = "04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-1000837"
    content = novatel_text("RAWIMUSXA,2209,491674.014", body, "%") * 4
    found = ReceiverRead(tmp_path, content)
    force = [125.0 * found.values("imu", f"delta_velocity_{axis}_mps")[0] for axis in "xyz"]
    assert force[2] == pytest.approx(-9.856, abs=1e-3) and np.linalg.norm(force) == pytest.approx(9.858, abs=2e-3)
    assert force[0] == pytest.approx(0.0810, abs=1e-4) and force[1] == pytest.approx(0.1349, abs=1e-4)
    rate = [125.0 * np.rad2deg(found.values("imu", f"delta_angle_{axis}_rad")[0]) for axis in "xyz"]
    assert rate == pytest.approx([-0.0509, -0.1222, -0.0239], abs=1e-4)


def test_novatel_units_that_are_not_known_and_counts_that_are_none(tmp_path: Path) -> None:
    content = b"".join(raw_imu("RAWIMUX", 100.0 + at, **COUNTS) for at in range(4))
    content += raw_imu("RAWIMUX", 104.0, 47, **COUNTS) + raw_imu("RAWIMUX", 105.0, status=1, **COUNTS)
    content += raw_imu("RAWIMUX", 106.0, status=2, **COUNTS)
    found = ReceiverRead(tmp_path, content)
    assert len(found.values("imu", "delta_angle_x_rad")) == 4 and len(found.values("raw.RAWIMUX", "imu_type")) == 7
    assert any("of a unit of type 47" in getattr(one, "text", "") for one in found.items)


@pytest.mark.parametrize("name", ["RAWIMU", "RAWIMUS"])
def test_novatel_counts_without_a_type_stay_raw(tmp_path: Path, name: str) -> None:
    found = ReceiverRead(tmp_path, b"".join(raw_imu(name, 100.0 + at, **COUNTS) for at in range(8)))
    assert not found.batches("imu") and found.values(f"raw.{name}", "del_ang_body_x") == [6.0] * 8
    assert any(f"{name} (8) stays raw" in getattr(one, "text", "") for one in found.items)
