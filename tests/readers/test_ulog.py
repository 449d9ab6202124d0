"""The ULog reader: every type of message, nested formats, instances, units, UTC, in hand-built logs."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.integrity import corrected, survey
from groundstation.readers import registry
from groundstation.readers.ulog import blocks
from groundstation.readers.ulog.canonical import ROLES
from tests.readers.test_contract import check, summary
from tests.readers.ulog_writer import ATTITUDE, BARO, GPS, GPS_CODE, UlogWriter, small_flight

T0_US = 1_000_000
UTC_US = 1_700_000_000_000_000


class Read:
    """Items of a log, by kind and topic."""

    def __init__(self, path: Path) -> None:
        self.items: list[Item] = list(registry.read(path))
        check(self.items)
        header = self.items[0]
        assert isinstance(header, LogHeader)
        self.header = header
        self.damages = [item for item in self.items if isinstance(item, Damage)]
        self.remarks = [item for item in self.items if isinstance(item, Remark)]
        self.batches: dict[str, list[RecordBatch]] = {}
        for item in self.items:
            if isinstance(item, RecordBatch):
                self.batches.setdefault(item.topic, []).append(item)

    def rows(self, topic: str) -> int:
        return sum(len(batch) for batch in self.batches.get(topic, ()))

    def values(self, topic: str, name: str) -> list[Any]:
        """Values of a column, None where absent."""
        out: list[Any] = []
        for batch in self.batches[topic]:
            column = batch.columns[name]
            pairs = zip(column.values.tolist(), column.mask.tolist(), strict=True)
            out += [value if present else None for value, present in pairs]
        return out

    def times_us(self, topic: str) -> list[int | None]:
        out: list[int | None] = []
        for batch in self.batches[topic]:
            column = batch.device_time_ns
            pairs = zip(column.values.tolist(), column.mask.tolist(), strict=True)
            out += [value // 1000 if present else None for value, present in pairs]
        return out


def read(tmp_path: Path, log: UlogWriter) -> Read:
    path = tmp_path / "log.bin"  # the name means nothing
    path.write_bytes(log.data)
    return Read(path)


def one(tmp_path: Path, definition: str, code: str, *values: float) -> Read:
    """A log of a single message at T0_US."""
    log = UlogWriter().flags().format(definition).subscribe(0, definition.partition(":")[0])
    return read(tmp_path, log.row(0, "Q" + code, T0_US, *values))


def test_nested_formats_arrays_and_padding(tmp_path: Path) -> None:
    log = UlogWriter().flags()
    log.format("outer:uint64_t timestamp;inner[2] part;bool ok;uint8_t _padding0;int16_t last;uint8_t[2] _padding1;")
    log.format("inner:float a;uint8_t[2] b;uint8_t[2] _padding0;").subscribe(3, "outer")  # used before it is defined
    log.row(3, "Qf2B2sf2B2s?BhH", T0_US, 1.5, 1, 2, b"xx", 2.5, 3, 4, b"xx", True, 7, -9, 0)
    log.row(3, "Qf2B2sf2B2s?Bh", T0_US + 1, 3.5, 5, 6, b"xx", 4.5, 7, 8, b"xx", False, 7, 9)  # end padding left out
    found = read(tmp_path, log)
    names = ["part[0].a", "part[0].b[0]", "part[0].b[1]", "part[1].a", "part[1].b[0]", "part[1].b[1]", "ok", "last"]
    assert list(found.batches["raw.outer"][0].columns) == names
    rows = list(zip(*(found.values("raw.outer", name) for name in names), strict=True))
    assert rows == [(1.5, 1, 2, 2.5, 3, 4, True, -9), (3.5, 5, 6, 4.5, 7, 8, False, 9)]
    assert found.times_us("raw.outer") == [T0_US, T0_US + 1] and not found.damages


def test_every_basic_type(tmp_path: Path) -> None:
    kinds = ["int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t", "uint64_t", "float"]
    kinds += ["double", "bool", "char"]
    fields = "".join(f"{kind} v{number};" for number, kind in enumerate(kinds))
    values = (-128, 255, -32768, 65535, -(2**31), 2**32 - 1, -(2**63), 2**64 - 1, 0.5, math.pi, True, 65)
    found = one(tmp_path, f"every:uint64_t timestamp;{fields}", "bBhHiIqQfd?b", *values)
    assert tuple(found.values("raw.every", f"v{number}")[0] for number in range(len(kinds))) == values


def test_instances_are_topics_of_their_own(tmp_path: Path) -> None:
    log = UlogWriter().flags().format("imu:uint64_t timestamp;float x;")
    log.subscribe(0, "imu").subscribe(7, "imu", instance=2)
    log.row(0, "Qf", T0_US, 1.0).row(7, "Qf", T0_US, 2.0)
    found = read(tmp_path, log)
    assert found.values("raw.imu", "x") == [1.0] and found.values("raw.imu.2", "x") == [2.0]


def test_definitions_may_come_late_and_change(tmp_path: Path) -> None:
    log = UlogWriter().flags().format("a:uint64_t timestamp;float x;").subscribe(0, "a").row(0, "Qf", T0_US, 1.0)
    log.format("b:uint64_t timestamp;double y;").subscribe(1, "b").row(1, "Qd", T0_US, 2.0)
    log.subscribe(0, "b").row(0, "Qd", T0_US + 1, 3.0)  # the id means another topic now
    found = read(tmp_path, log)
    assert found.values("raw.a", "x") == [1.0] and found.values("raw.b", "y") == [2.0, 3.0]


def test_text_parameters_information_dropouts(tmp_path: Path) -> None:
    log = UlogWriter().flags().info("sys_name", "PX4").info("sys_uuid", "00010203040506070809")
    log.keyed("I", "uint32_t ver_sw_release", bytes([0xFF, 2, 11, 1])).keyed("M", "char[2] console", b"ab", b"\0")
    log.keyed("M", "char[2] console", b"cd", b"\1").keyed("M", "uint8_t[2] blob", b"\x01\xfe", b"\0")
    log.parameter("SYS_AUTOSTART", 2100).parameter("GAIN", 0.25).parameter("GAIN", 0.5, "Q", defaults=3)
    log.format(BARO).subscribe(0, "vehicle_air_data").row(0, "Qf", T0_US, 1e5)
    log.text(T0_US + 7, "Takeoff détecté", level=4).tagged(T0_US + 8, "from a process", tag=300)
    log.parameter("GAIN", 0.75).dropout(120).dropout(0)
    found = read(tmp_path, log)
    assert found.values("raw.ulog.text", "text") == ["Takeoff détecté", "from a process"]
    assert found.values("raw.ulog.text", "severity") == ["warning", "info"]
    assert found.values("raw.ulog.text", "tag") == [None, 300]
    assert found.times_us("raw.ulog.text") == [T0_US + 7, T0_US + 8]
    assert found.values("raw.ulog.parameters", "value") == [2100.0, 0.25, 0.5, 0.75]
    kinds = ["initial", "initial", "system default and default of the configuration", "changed"]
    assert found.values("raw.ulog.parameters", "kind") == kinds
    texts = ["PX4", "00010203040506070809", "17498879", "ab", "cd", "01fe"]
    assert found.values("raw.ulog.information", "text") == texts
    assert found.values("raw.ulog.information", "is_continued") == [False] * 4 + [True, False]
    assert found.values("raw.ulog.dropouts", "duration_ms") == [120.0, 0.0]
    assert [(damage.kind, damage.count, damage.loses_data) for damage in found.damages] == [("dropout", 120, True)]
    facts = found.header.metadata
    assert facts["sys_name"] == "PX4" and facts["aircraft"] == "PX4-040506070809" and facts["airframe"] == "2100"
    assert facts["ver_sw_release"] == "v1.11.2"


def test_appended_sections(tmp_path: Path) -> None:
    log = small_flight(3)
    log.data += log.data[log.starts[-1] : log.starts[-1] + 7]  # logging stopped within a message
    log.append_section().text(T0_US + 90_000, "crash dump").append_section().row(1, "Qf", T0_US + 90_001, 1e5)
    found = read(tmp_path, log)
    assert found.values("raw.ulog.text", "text") == ["crash dump"] and found.rows("raw.vehicle_air_data") == 4
    assert [(damage.kind, damage.count) for damage in found.damages] == [("truncated", 7)]
    assert "appended" in found.damages[0].what


def test_unknown_flags_are_refused_and_unknown_messages_skipped(tmp_path: Path) -> None:
    log = UlogWriter().flags(incompat=b"\4" + bytes(7)).format(BARO)
    with pytest.raises(UnreadableLogError, match="flags 0400"):
        read(tmp_path, log)
    log = UlogWriter().flags(compat=b"\xff" * 8).format(BARO).subscribe(0, "vehicle_air_data")
    log.message("Z", b"from the future").row(0, "Qf", T0_US, 1e5).message("B", bytes(44)).row(0, "Qf", T0_US, 1e5)
    found = read(tmp_path, log)
    assert found.rows("raw.vehicle_air_data") == 2 and not found.damages


@pytest.mark.parametrize("is_kept", [True, False])
def test_block_borders_change_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_kept: bool) -> None:
    log = small_flight(6_000)
    whole = read(tmp_path, log)
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 10_007)
    monkeypatch.setattr(blocks.scan, "LOOKAHEAD", 1_000)
    if not is_kept:
        monkeypatch.setattr(blocks, "KEPT_BYTES", 0)
    pieces = read(tmp_path, log)
    assert sum(isinstance(item, RecordBatch) for item in pieces.items) > 40
    for topic in whole.batches:
        assert pieces.times_us(topic) == whole.times_us(topic)
        for name in whole.batches[topic][0].columns:
            assert pieces.values(topic, name) == whole.values(topic, name)
    others = [[item for item in found.items if not isinstance(item, RecordBatch)] for found in (whole, pieces)]
    assert summary(others[0]) == summary(others[1])


# --- Canonical signals: 1.0 of the log's unit goes in, the factor comes out. ---


def test_attitude_turns_body_into_north_east_down(tmp_path: Path) -> None:
    half = math.radians(30.0) / 2.0
    cases = {
        (math.cos(half), math.sin(half), 0.0, 0.0): (30.0, 0.0, 0.0),
        (math.cos(half), 0.0, math.sin(half), 0.0): (0.0, 30.0, 0.0),
        (math.cos(half), 0.0, 0.0, -math.sin(half)): (0.0, 0.0, 330.0),
    }
    for quaternion, angles in cases.items():
        found = one(tmp_path, ATTITUDE, "4f", *quaternion)
        names = ("roll_deg", "pitch_deg", "true_heading_deg")
        assert [found.values("ins", name)[0] for name in names] == pytest.approx(angles, abs=1e-5)
    assert "ins" not in one(tmp_path, ATTITUDE, "4f", 0.0, 0.0, 0.0, 0.0).batches, "zeros are no attitude"
    heading = next(remark for remark in found.remarks if "true_heading_deg" in remark.fields)
    assert heading.topic == "ins" and "filter" in heading.text


@pytest.mark.parametrize(
    ("definition", "code", "values", "topic", "expected"),
    [
        ("vehicle_angular_velocity:uint64_t timestamp;float[3] xyz;", "3f", (1, 2, 3), "ins",
         {"rate_x_dps": 57.29577951308232, "rate_z_dps": 3 * 57.29577951308232}),
        ("vehicle_attitude:uint64_t timestamp;float rollspeed;float pitchspeed;float yawspeed;", "3f", (1, 2, 3), "ins",
         {"rate_y_dps": 2 * 57.29577951308232}),
        ("vehicle_attitude:uint64_t timestamp;float roll;float pitch;float yaw;", "3f", (1, 0.5, -1), "ins",
         {"roll_deg": 57.29577951308232, "true_heading_deg": 360 - 57.29577951308232}),
        ("sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", "6f", (1, 2, 3, 4, 5, 6),
         "ins", {"rate_x_dps": 57.29577951308232, "accel_y_mps2": 5.0}),
        ("vehicle_acceleration:uint64_t timestamp;float[3] xyz;", "3f", (1, 2, 3), "ins", {"accel_z_mps2": 3.0}),
        ("vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;float alt_ellipsoid;", "2d2f",
         (1, 2, 3, 4), "ins", {"latitude_deg": 1.0, "altitude_msl_m": 3.0, "altitude_ellipsoid_m": 4.0}),
        ("vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;float vel_n;float vel_e;"
         "float vel_d;", "2d4f", (1, 2, 3, 4, 5, 6), "ins", {"velocity_north_mps": 4.0, "velocity_down_mps": 6.0}),
        ("vehicle_local_position:uint64_t timestamp;float vx;float vy;float vz;bool v_xy_valid;bool v_z_valid;",
         "3f2?", (1, 2, 3, False, True), "ins", {"velocity_north_mps": None, "velocity_down_mps": 3.0}),
        ("vehicle_magnetometer:uint64_t timestamp;float[3] magnetometer_ga;", "3f", (1, 2, 3), "magnetometer",
         {"field_forward_nt": 1e5, "field_down_nt": 3e5}),
        ("sensor_mag:uint64_t timestamp;float x;float y;float z;", "3f", (1, 2, 3), "magnetometer",
         {"field_right_nt": 2e5}),
        ("battery_status:uint64_t timestamp;float current_a;", "f", (1,), "electric", {"current_a": 1.0}),
        (BARO, "f", (101_325,), "baro", {"pressure_altitude_m": 0.0}),
        ("sensor_combined:uint64_t timestamp;float baro_alt_meter;", "f", (1,), "baro", {"pressure_altitude_m": 1.0}),
        ("sensor_baro:uint64_t timestamp;float pressure;", "f", (1_013.25,), "baro", {"pressure_altitude_m": 0.0}),
        ("sensor_baro:uint64_t timestamp;float pressure;", "f", (101_325,), "baro", {"pressure_altitude_m": 0.0}),
        ("airspeed:uint64_t timestamp;float true_airspeed_m_s;", "f", (1,), "air", {"true_airspeed_mps": 1.0}),
        ("wind:uint64_t timestamp;float windspeed_north;float windspeed_east;", "2f", (1, 2), "air",
         {"wind_north_mps": 1.0, "wind_east_mps": 2.0}),
        ("distance_sensor:uint64_t timestamp;float current_distance;uint8_t orientation;", "fB", (1, 25),
         "radio_altimeter", {"height_m": 1.0}),
        ("vehicle_land_detected:uint64_t timestamp;bool landed;", "?", (True,), "discrete", {"weight_on_wheels": True}),
    ],
    ids=lambda value: value.partition(":")[0] if isinstance(value, str) and ":" in value else "",
)  # fmt: skip
def test_units(
    tmp_path: Path, definition: str, code: str, values: tuple[float, ...], topic: str, expected: dict[str, Any]
) -> None:
    found = one(tmp_path, definition, code, *values)
    for name, value in expected.items():
        got = found.values(topic, name)[0]
        assert got is None if value is None else got == pytest.approx(value, rel=1e-6, abs=1e-2)


def test_what_does_not_apply_is_left_out(tmp_path: Path) -> None:
    sideways = "distance_sensor:uint64_t timestamp;float current_distance;uint8_t orientation;"
    assert "radio_altimeter" not in one(tmp_path, sideways, "fB", 1.0, 0).batches
    unknown = "battery_status:uint64_t timestamp;float current_a;"
    assert "electric" not in one(tmp_path, unknown, "f", -1.0).batches


def test_pressure_altitude_above_the_tropopause_and_refused_pressures(tmp_path: Path) -> None:
    log = UlogWriter().flags().format(BARO).subscribe(0, "vehicle_air_data")
    pressures = [22_632.06, 12_044.6, 0.0, 5_474.89, -3.0, 2e5, math.nan]
    for number, pressure in enumerate(pressures):
        log.row(0, "Qf", T0_US + number, pressure)
    found = read(tmp_path, log)
    altitudes = found.values("baro", "pressure_altitude_m")
    assert altitudes[:3] == [
        pytest.approx(11_000.0, abs=1.0),
        pytest.approx(15_000.0, abs=1.0),
        pytest.approx(2e4, abs=1.0),
    ]
    assert len(altitudes) == 4 and math.isnan(altitudes[3]), "a NaN that the device wrote is NaN"
    assert len(found.values("raw.vehicle_air_data", "baro_pressure_pa")) == len(pressures)
    (damage,) = found.damages
    assert (damage.kind, damage.count, damage.topic, damage.loses_data) == ("unreadable_cells", 3, "baro", False)
    assert "pressures outside 5 to 1200 hPa" in damage.what


def gps_log(fixes: list[tuple[int, int]], instances: int = 1) -> UlogWriter:
    """A log of receivers; ``fixes`` are (UTC of power-up in microseconds, fix type), 200 ms apart."""
    log = UlogWriter().flags().format(GPS)
    for instance in range(instances):
        log.subscribe(instance, "vehicle_gps_position", instance)
    for row, (zero_us, fix) in enumerate(fixes):
        time_us = T0_US + 200_000 * row
        for instance in range(instances):
            numbers = (
                455_000_000,
                -931_000_000,
                250_000,
                220_000,
                0.3,
                0.9,
                5.0,
                3.0,
                -4.0,
                0.5,
                -0.9272952,
                fix,
                1,
                11,
            )
            log.row(instance, GPS_CODE, time_us, zero_us + time_us if zero_us else 0, *numbers)
    return log


def test_gnss(tmp_path: Path) -> None:
    found = read(tmp_path, gps_log([(UTC_US, 3)]))
    expected = {
        "latitude_deg": 45.5, "longitude_deg": -93.1, "altitude_msl_m": 250.0, "altitude_ellipsoid_m": 220.0,
        "velocity_north_mps": 3.0, "velocity_east_mps": -4.0, "velocity_down_mps": 0.5, "ground_speed_mps": 5.0,
        "track_deg": 306.8699, "hdop": 0.9, "velocity_sigma_mps": 0.3, "satellites_used": 11.0, "integrity_ok": True,
    }  # fmt: skip
    assert {name: found.values("gnss", name)[0] for name in expected} == pytest.approx(expected, rel=1e-6)
    none = read(tmp_path, gps_log([(0, 0)]))
    assert none.values("gnss", "latitude_deg") == [None] and none.values("gnss", "integrity_ok") == [False]
    assert none.values("gnss", "velocity_north_mps") == [None]
    two = read(tmp_path, gps_log([(UTC_US, 3)], instances=2))
    assert {"gnss.1", "gnss.2"} <= set(two.batches) and "gnss" not in two.batches
    definition = (
        "sensor_gps:uint64_t timestamp;double latitude_deg;double longitude_deg;double altitude_msl_m;uint8_t fix_type;"
    )
    newer = one(tmp_path, definition, "3dB", 45.5, -93.1, 250.0, 3)
    assert newer.values("gnss", "latitude_deg") == [45.5] and newer.values("gnss", "altitude_msl_m") == [250.0]


def test_utc_of_power_up_is_the_median_over_good_fixes(tmp_path: Path) -> None:
    fixes = [
        (0, 0),
        (UTC_US + 10**9, 2),
        (UTC_US + 4 * 10**12, 3),
        *[(UTC_US + jitter, 3) for jitter in (-9, 0, 4, 7, 11)],
    ]
    found = read(tmp_path, gps_log(fixes))
    assert found.header.utc_of_zero_ns == (UTC_US + 7) * 1000
    assert any(remark.code == "utc_from_gnss" for remark in found.remarks)
    assert read(tmp_path, gps_log([(0, 3), (UTC_US, 2)])).header.utc_of_zero_ns is None
    assert read(tmp_path, gps_log([(10**15, 3)])).header.utc_of_zero_ns is None, "before 2004: no date"


def test_whole_seconds_are_right_when_they_are_told_first(tmp_path: Path) -> None:
    """Five messages tell each second: only the first of them tells it when it begins."""
    begun_us = 1_500_000_000_000_000
    old = [(begun_us + 10**6 * (late // 5) - T0_US - 200_000 * row, 3) for row, late in enumerate(range(3, 43))]
    found = read(tmp_path, gps_log(old))
    assert found.header.utc_of_zero_ns == (begun_us + 10**6 - T0_US - 400_000) * 1000


def test_mode_follows_the_satellite_fix(tmp_path: Path) -> None:
    log = gps_log([(UTC_US, 3)]).format(ATTITUDE).subscribe(5, "vehicle_attitude").row(5, "Q4f", T0_US, 1, 0, 0, 0)
    assert read(tmp_path, log).values("ins", "mode") == ["gnss_aided"]
    assert one(tmp_path, ATTITUDE, "4f", 1, 0, 0, 0).values("ins", "mode") == ["attitude"]


def test_sources_of_ins_are_merged_in_the_order_of_the_log(tmp_path: Path) -> None:
    log = (
        UlogWriter()
        .flags()
        .format(ATTITUDE)
        .format("vehicle_local_position:uint64_t timestamp;float vx;float vy;float vz;")
    )
    log.subscribe(0, "vehicle_attitude").subscribe(1, "vehicle_local_position")
    for row in range(4):
        log.row(row % 2, "Q4f" if row % 2 == 0 else "Q3f", T0_US + row, *((1, 0, 0, 0) if row % 2 == 0 else (1, 2, 3)))
    found = read(tmp_path, log)
    assert found.times_us("ins") == [T0_US, T0_US + 1, T0_US + 2, T0_US + 3]
    assert found.values("ins", "roll_deg") == [0.0, None, 0.0, None]
    assert found.values("ins", "velocity_east_mps") == [None, 2.0, None, 2.0]
    assert found.values("ins", "mode") == ["attitude", None, "attitude", None]


def test_arming_makes_events(tmp_path: Path) -> None:
    log = (
        UlogWriter()
        .flags()
        .format("vehicle_status:uint64_t timestamp;uint8_t arming_state;")
        .subscribe(0, "vehicle_status")
    )
    for row, state in enumerate((1, 1, 2, 2, 1)):
        log.row(0, "QB", T0_US + row, state)
    found = read(tmp_path, log)
    assert found.values("event", "name") == ["disarmed", "armed", "disarmed"]
    assert found.times_us("event") == [T0_US, T0_US + 2, T0_US + 4]


def test_flight_modes_make_events_and_changed_meanings_stay_numbers(tmp_path: Path) -> None:
    log = (
        UlogWriter()
        .flags()
        .format("vehicle_status:uint64_t timestamp;uint8_t nav_state;")
        .subscribe(0, "vehicle_status")
    )
    for row, state in enumerate((4, 4, 17, 7, 7, 5)):
        log.row(0, "QB", T0_US + row, state)
    found = read(tmp_path, log)
    assert found.values("event", "name") == ["mode AUTO_LOITER", "mode AUTO_TAKEOFF", "mode 7", "mode AUTO_RTL"]
    assert found.times_us("event") == [T0_US, T0_US + 2, T0_US + 3, T0_US + 5]


def test_times_that_are_none(tmp_path: Path) -> None:
    log = UlogWriter().flags().format(BARO).subscribe(0, "vehicle_air_data")
    for time_us in (0, T0_US, 2**63, 2**64 - 1):
        log.row(0, "Qf", time_us, 1e5)
    found = read(tmp_path, log)
    assert found.times_us("raw.vehicle_air_data") == [None, T0_US, None, None]
    assert [(damage.kind, damage.count) for damage in found.damages] == [("unreadable_cells", 2)]


def test_interleaved_topics_are_no_clock_steps(tmp_path: Path) -> None:
    """Slow topics are written late and the first values are old: the clock has no steps, and the flight its length."""
    log = UlogWriter(start_us=60_000_000).flags().format(BARO).format("slow:uint64_t timestamp;float x;")
    log.format("never:uint64_t timestamp;float x;").subscribe(0, "vehicle_air_data").subscribe(1, "slow").subscribe(
        2, "never"
    )
    log.row(1, "Qf", 400_000, 0.0)  # published 0.4 s after power-up, a minute before logging began
    for row in range(500):
        time_us = 60_000_000 + 20_000 * row
        log.row(0, "Qf", time_us, 1e5).row(2, "Qf", 7_000_000, 1.0)
        if row % 50 == 49:
            log.row(1, "Qf", time_us - 900_000, 1.0)
    found = read(tmp_path, log)
    result = survey(found.items)
    assert not result.clock.steps and not result.clock.stray_rows and not result.clock.is_unordered
    assert result.clock.stale_times == 501 and result.clock.implausible_times == 0
    times = np.concatenate([batch.time_ns for batch in corrected(found.items, result.clock)])
    assert times.min() == 60_000_000_000 and times.max() == 60_000_000_000 + 499 * 20_000_000


def test_every_rule_names_fields_that_exist() -> None:
    from groundstation.base.signals import field_of
    from groundstation.readers.ulog.canonical import TopicRows

    for role in ROLES:
        for rule in role.rules:
            rows = np.zeros(1, dtype=[(name, "f8") for name in rule.needs])
            columns = rule.columns(TopicRows(rows))
            assert columns and all(field_of(role.topic, name) for name in (*columns, *rule.derived))


def test_the_documentation_names_every_source() -> None:
    text = (Path(__file__).parents[2] / "docs" / "ulog.md").read_text(encoding="utf-8")
    missing = {rule.source for role in ROLES for rule in role.rules if f"`{rule.source}`" not in text}
    assert not missing
