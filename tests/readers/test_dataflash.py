"""The DataFlash reader on hand-built logs: decoding, units, instances, time, mapping."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Column, Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.timescales import gps_week_to_utc_ns, iso_to_utc_ns
from groundstation.integrity.survey import survey
from groundstation.readers import registry
from groundstation.readers.dataflash import blocks
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.table import Flight
from tests.readers.dataflash_writer import DataFlash, flight_log
from tests.readers.test_contract import check

DEGREES_OF_A_FLOAT = 1e-6  # single precision


class Log:
    """A log read through the registry."""

    def __init__(self, path: Path, content: bytes) -> None:
        path.write_bytes(content)
        self.items: list[Item] = list(registry.read(path))
        check(self.items)
        header = self.items[0]
        assert isinstance(header, LogHeader)
        self.header = header
        self.remarks = [item for item in self.items if isinstance(item, Remark)]
        self.damages = [item for item in self.items if isinstance(item, Damage)]
        self.batches = [item for item in self.items if isinstance(item, RecordBatch)]

    @property
    def flight(self) -> Flight:
        """Tables on the device's own clock."""
        timed = [
            RecordBatch(b.topic, b.record_index, b.device_time_ns, b.columns, np.array(b.device_time_ns.values))
            for b in self.batches
        ]
        return flight_from_batches(timed, metadata={}, has_utc=False, source_name="log.BIN")

    def column(self, topic: str, field: str) -> Column:
        """One field of a topic."""
        return self.flight[topic].columns[field]

    def present(self, topic: str, field: str) -> list[float]:
        """Its values where present."""
        column = self.column(topic, field)
        return list(column.values[column.mask].tolist())

    def derived(self, topic: str, field: str) -> str:
        """What a field was derived from."""
        return next(r.text for r in self.remarks if r.code == "derived" and r.topic == topic and field in r.fields)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return Log(tmp_path_factory.mktemp("dataflash") / "log.BIN", flight_log().content)


def test_every_record_is_kept_in_its_place(log: Log) -> None:
    written = flight_log()
    indices = np.concatenate([batch.record_index for batch in log.batches if batch.topic.startswith("raw.")])
    assert sorted(indices.tolist()) == list(range(len(written.records)))
    assert not log.damages
    names = [written.names[at] for at in log.flight["raw.GPS.0"].record_index]
    assert set(names) == {"GPS"}


def test_values_have_the_scales_that_the_format_implies(log: Log) -> None:
    assert log.present("raw.ATT", "Roll")[:2] == [1.5, 1.54]
    assert log.present("raw.POS", "Lat")[0] == -35.36
    assert log.column("raw.IMU.1", "GyrX").values.dtype == np.float32
    assert log.column("raw.GPS.0", "GWk").values.dtype == np.uint16
    assert log.present("raw.PARM", "Name")[0] == "AHRS_EKF_TYPE"


def test_instances_are_topics_of_their_own(log: Log) -> None:
    assert len(log.flight["raw.IMU.0"]) == len(log.flight["raw.IMU.1"]) == 80
    assert "raw.IMU" not in log.flight and "raw.ATT" in log.flight


def test_units_are_metadata(log: Log) -> None:
    assert log.header.metadata["units.raw.GPA"] == "TimeUS s x 1e-06, VDop m, HAcc m, VAcc m, SAcc m/s"
    assert "MagX Gauss x 0.001" in log.header.metadata["units.raw.MAG"]


def test_header_tells_firmware_and_key_parameters(log: Log) -> None:
    metadata = log.header.metadata
    assert metadata["firmware"] == "ArduPlane V4.5.7 (0358a9c2)" and metadata["vehicle"] == "ArduPlane"
    assert metadata["parameter.AHRS_EKF_TYPE"] == "3" and "parameter.RC1_MIN" not in metadata
    assert log.header.has_counting_clock


def test_power_up_is_placed_by_gps_time_less_18_leap_seconds(log: Log) -> None:
    first_fix_ns = int(gps_week_to_utc_ns(2300, 200_000_500))
    assert log.header.utc_of_zero_ns == first_fix_ns - (1_100_000 + 500_000 + 100) * 1000
    assert any(remark.code == "utc_from_gps" for remark in log.remarks)


def test_attitude_position_and_rates_become_ins(log: Log) -> None:
    assert log.present("ins", "roll_deg")[:2] == [1.5, 1.54]
    assert log.present("ins", "pitch_deg")[0] == -2.5
    assert log.present("ins", "true_heading_deg")[0] == pytest.approx(359.0)
    assert log.present("ins", "latitude_deg")[0] == -35.36
    assert log.present("ins", "altitude_msl_m")[0] == 584.25
    assert log.present("ins", "rate_z_dps")[0] == pytest.approx(np.rad2deg(-0.5), abs=DEGREES_OF_A_FLOAT)
    assert log.present("ins", "rate_x_dps")[0] == 0.0, "the first of the inertial sensors, not the second"
    assert set(log.present("ins", "mode")) == {"gnss_aided"}
    assert "declination by the autopilot's own table" in log.derived("ins", "true_heading_deg")
    table = log.flight["ins"]
    assert not (table.valid("roll_deg") & table.valid("rate_x_dps")).any(), "a row has the fields of its source"


def test_velocity_is_that_of_the_core_in_use(log: Log) -> None:
    north = log.present("ins", "velocity_north_mps")
    assert north == [10.0] * 11 + [11.0] * 10, "core 1 took over at 2 s, between the records of the two"


def test_gnss_has_what_a_fix_gives(log: Log) -> None:
    table = log.flight["gnss"]
    assert len(table) == 8 and table.valid("latitude_deg").sum() == 7, "no fix at first"
    assert table.valid("satellites_used").all()
    assert log.present("gnss", "hdop")[0] == 0.77
    assert log.present("gnss", "altitude_msl_m")[0] == 584.25
    assert log.present("gnss", "velocity_east_mps")[0] == pytest.approx(5.0)
    assert log.present("gnss", "velocity_north_mps")[0] == pytest.approx(0.0, abs=1e-12)
    assert log.present("gnss", "velocity_down_mps")[0] == -0.25
    assert log.present("gnss", "velocity_sigma_mps") == [0.3] * 7
    assert "course over ground" in log.derived("gnss", "velocity_north_mps")


def test_magnetic_field_is_in_nanotesla(log: Log) -> None:
    fields = [log.present("magnetometer", f"field_{axis}_nt")[0] for axis in ("forward", "right", "down")]
    assert fields == pytest.approx([25_000.0, -12_000.0, 48_000.0])


def test_old_log_without_units_counts_milliseconds(tmp_path: Path) -> None:
    old = DataFlash()
    old.define(1, "GPS", "BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T")
    old.define(2, "ATT", "IhhH", "TimeMS,Roll,Pitch,Yaw")
    old.define(3, "MAG", "Ihhh", "TimeMS,MagX,MagY,MagZ")
    old.define(4, "CURR", "IhhhhH", "TimeMS,Thr,Volt,Curr,Vcc,CurrTot")
    old.define(5, "MSG", "Z", "Message")
    old.define(6, "ACC1", "IIf", "TimeMS,TimeUS,AccX")
    old.write("MSG", "APM:Copter V3.1")
    for at in range(6):
        old.write("ATT", 1000 + 100 * at, 150, -20, 35_999)
        old.write("MAG", 1000 + 100 * at, 200, -10, -400)
        old.write("CURR", 1000 + 100 * at, 0, 1251, 350, 0, 0)
        old.write("GPS", 3, 511_214_500 + 100 * at, 1768, 7, 199, 1, 2, 0, 1578, 203, 27_885, 2.5, 1010 + 100 * at)
        old.write("ACC1", 7, 7, 0.0)
    log = Log(tmp_path / "old.log", old.content)
    assert log.header.metadata["vehicle"] == "APM:Copter"
    assert log.column("ins", "roll_deg").values[0] == 1.5, "plain integers of old firmware are hundredths"
    assert log.present("ins", "true_heading_deg")[0] == pytest.approx(359.99)
    assert log.present("electric", "current_a")[0] == pytest.approx(3.5)
    assert log.present("magnetometer", "field_down_nt")[0] == pytest.approx(-40_000.0)
    times = {batch.topic: batch.device_time_ns for batch in log.batches}
    assert times["raw.GPS"].values[0] == 1_010_000_000 and times["raw.ATT"].values[0] == 1_000_000_000
    assert not times["raw.ACC1"].mask.any(), "its TimeMS is that of another clock"
    assert not times["raw.MSG"].mask.any()
    assert log.header.utc_of_zero_ns == iso_to_utc_ns("2013-11-29T21:59:57.490Z")[0], "16 leap seconds in 2013"


def test_several_receivers_and_magnetometers_are_numbered(tmp_path: Path) -> None:
    two = DataFlash()
    for type_id, name in ((1, "GPS"), (2, "GPS2")):
        two.define(type_id, name, "QBIHBcLLeffff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw")
    for type_id, name in ((3, "MAG"), (4, "MAG2"), (5, "MAG3")):
        two.define(type_id, name, "Qhhh", "TimeUS,MagX,MagY,MagZ")
    for at in range(3):
        for name in ("GPS", "GPS2"):
            two.write(name, at * 10**6, 3, 1000 * at, 2200, 9, 100, 10, 20, 30, 1.0, 0.0, 0.0, 0.0)
        for name in ("MAG", "MAG2", "MAG3"):
            two.write(name, at * 10**6, 1, 2, 3)
    topics = Log(tmp_path / "two.BIN", two.content).flight.topics()
    canonical = [topic for topic in topics if not topic.startswith("raw.")]
    assert canonical == ["gnss.1", "gnss.2", "magnetometer.1", "magnetometer.2", "magnetometer.3"]


def test_no_gps_time_leaves_the_log_without_utc(tmp_path: Path) -> None:
    blind = DataFlash()
    blind.define(1, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    blind.write("ATT", 5_000_000, 100, 200, 300)
    log = Log(tmp_path / "blind.BIN", blind.content)
    assert log.header.utc_of_zero_ns is None
    assert log.present("ins", "mode") == ["attitude"], "nothing aided it"


def test_yaw_without_declination_is_magnetic(tmp_path: Path) -> None:
    compass = DataFlash()
    compass.define(1, "PARM", "QNf", "TimeUS,Name,Value")
    compass.define(2, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    for name in ("COMPASS_AUTODEC", "COMPASS_DEC"):
        compass.write("PARM", 1, name, 0.0)
    compass.write("ATT", 5_000_000, 100, 200, 300)
    log = Log(tmp_path / "compass.BIN", compass.content)
    assert log.present("ins", "magnetic_heading_deg") == [3.0] and not log.flight["ins"].has("true_heading_deg")


def test_events_and_landed_flag(tmp_path: Path) -> None:
    copter = DataFlash()
    copter.define(1, "MSG", "QZ", "TimeUS,Message")
    copter.define(2, "EV", "QB", "TimeUS,Id")
    copter.define(3, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn")
    copter.define(4, "ARM", "QBI", "TimeUS,ArmState,ArmChecks")
    copter.define(5, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    copter.define(6, "ERR", "QBB", "TimeUS,Subsys,ECode")
    copter.write("MSG", 1, "ArduCopter V4.3.0")
    copter.write("ATT", 2, 0, 0, 0)
    copter.write("ARM", 3, 1, 0)
    copter.write("MODE", 4, 5, 5, 1)
    copter.write("EV", 5, 28)
    copter.write("ATT", 6, 0, 0, 0)
    copter.write("EV", 7, 18)
    copter.write("ATT", 8, 0, 0, 0)
    copter.write("EV", 9, 11)
    copter.write("EV", 10, 250)
    copter.write("ERR", 11, 16, 2)
    log = Log(tmp_path / "copter.BIN", copter.content)
    assert log.present("event", "name") == [
        *("ArduCopter V4.3.0", "armed", "mode LOITER", "not landed", "land complete", "disarmed", "event 250"),
        "EKF check: bad variance",
    ]
    assert log.present("event", "severity") == [*(["info"] * 7), "fail"]
    assert log.present("discrete", "weight_on_wheels") == [False, True], "unknown before the first event"
    assert "land" in log.derived("discrete", "weight_on_wheels")


def test_baro_range_finder_and_battery(tmp_path: Path) -> None:
    sensors = DataFlash()
    sensors.define(1, "BARO", "Qff", "TimeUS,Alt,Press")
    sensors.define(2, "RFND", "QBCBB", "TimeUS,Instance,Dist,Stat,Orient")
    sensors.define(3, "BAT", "Qff", "TimeUS,Volt,Curr")
    sensors.define(4, "XKF2", "Qcc", "TimeUS,VWN,VWE")
    sensors.define(5, "XKF1", "Qfff", "TimeUS,VN,VE,VD")
    sensors.write("BARO", 1, 0.0, 89_874.6)
    sensors.write("RFND", 2, 0, 1234, 4, 25)
    sensors.write("RFND", 3, 0, 1234, 1, 25)
    sensors.write("RFND", 4, 0, 1234, 4, 0)
    sensors.write("BAT", 5, 12.0, 7.5)
    sensors.write("XKF2", 6, 300, -450)
    sensors.write("XKF1", 7, 1.0, 2.0, 3.0)
    log = Log(tmp_path / "sensors.BIN", sensors.content)
    assert log.present("baro", "pressure_altitude_m") == pytest.approx([1000.0], abs=0.1)
    assert log.present("radio_altimeter", "height_m") == [12.34], "facing down and in range"
    assert log.present("electric", "current_a") == [7.5]
    assert (log.present("air", "wind_north_mps"), log.present("air", "wind_east_mps")) == ([3.0], [-4.5])


def test_refused_pressures_are_counted_and_a_missing_one_stays_missing(tmp_path: Path) -> None:
    sensors = DataFlash()
    sensors.define(1, "BARO", "Qff", "TimeUS,Alt,Press")
    for number, pressure in enumerate((12_044.6, 0.0, -3.0, 2e5, np.nan)):
        sensors.write("BARO", 1 + number, 0.0, pressure)
    log = Log(tmp_path / "pressures.BIN", sensors.content)
    altitudes = log.present("baro", "pressure_altitude_m")
    assert altitudes == pytest.approx([15_000.0, np.nan], abs=1.0, nan_ok=True)
    assert len(log.present("raw.BARO", "Press")) == 5
    (damage,) = log.damages
    assert (damage.kind, damage.count, damage.topic, damage.loses_data) == ("unreadable_cells", 3, "baro", False)
    assert "pressures outside 5 to 1200 hPa" in damage.what


def test_every_format_character_is_read(tmp_path: Path) -> None:
    every = DataFlash()
    characters = "abBhHiIqQfdgnNcCeELM"  # one more than a FMT record can name: in two types
    numbers: list[object] = [list(range(-16, 16)), -1, 255, -300, 65_535, -70_000, 4_000_000_000, -(2**62), 2**63]
    numbers += [0.5, 1.25, -2.5, "abcd", "sixteen letters.", -150, 40_000, -123_456, 4_000_000_000, 1_234_567_890, 7]
    for type_id, part in ((1, slice(0, 10)), (2, slice(10, 20))):
        labels = ",".join(f"F{at}" for at in range(10))
        every.define(type_id, f"T{type_id}", characters[part], labels)
        every.write(f"T{type_id}", *numbers[part])
    log = Log(tmp_path / "every.BIN", every.content)
    first = [log.present("raw.T1", name)[0] for name in ("F0_0", "F0_31", *(f"F{at}" for at in range(1, 10)))]
    assert first == [-16, 15, -1, 255, -300, 65_535, -70_000, 4_000_000_000, -(2**62), 2**63, 0.5]
    second = [log.present("raw.T2", f"F{at}")[0] for at in range(10)]
    assert second == [1.25, -2.5, "abcd", "sixteen letters.", -1.5, 400.0, -1234.56, 40_000_000.0, 123.456789, 7]


def test_contradicting_definitions(tmp_path: Path) -> None:
    odd = DataFlash()
    odd.define(1, "BAD", "Qf", "TimeUS,X", length=9)
    odd.define(2, "WEIRD", "B", "A")
    odd.define(3, "LONG", "B", "A,B,C", length=8)
    odd.define(4, "Q Q", "BB", "X,X")
    odd.define(5, "GPS", "B", "Status")
    odd.define(6, "GPS", "H", "Status")
    odd.write("WEIRD", 7)
    odd.records.append(b"\xa3\x95\x01" + bytes(6))
    odd.records.append(b"\xa3\x95\x03" + b"\x09" + bytes(4))
    odd.write("Q Q", 1, 2)
    odd.records.append(b"\xa3\x95\x05\x01")
    odd.write("GPS", 300)
    odd.define(2, "WEIR", "d", "A")
    odd.write("FMT", 0, 0, b"ZERO", b"", b"")
    odd.records.append(b"\xa3\x95\x02\x08")
    log = Log(tmp_path / "odd.BIN", odd.content)
    odd_ones = {("corrupt", topic) for topic in ("", "raw.LONG", "raw.Q_Q")}
    assert {(damage.kind, damage.topic) for damage in log.damages} == {("dropped_channel", "raw.BAD"), *odd_ones}
    assert log.present("raw.LONG", "A") == [9] and log.present("raw.WEIR", "A") == [7, 8]
    assert log.present("raw.Q_Q", "X_2") == [2]
    assert log.present("raw.GPS", "Status") == [1] and log.present("raw.GPS_6", "Status") == [300]


def test_logs_joined_end_to_end_bring_their_own_definitions(tmp_path: Path) -> None:
    one, other = DataFlash(), DataFlash()
    one.define(1, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    other.define(1, "POS", "QLLf", "TimeUS,Lat,Lng,Alt")
    one.write("ATT", 1, 100, 0, 0)
    other.write("POS", 2, 10_000_000, 20_000_000, 5.0)
    log = Log(tmp_path / "joined.BIN", one.content + other.content)
    assert log.present("raw.ATT", "Roll") == [1.0] and log.present("raw.POS", "Lat") == [1.0] and not log.damages


def test_two_hundred_fifty_five_types(tmp_path: Path) -> None:
    many = DataFlash()
    ids = [type_id for type_id in range(256) if type_id != 128]
    for type_id in ids:
        many.define(type_id, f"T{type_id:03d}", "QB", "TimeUS,X")
    for type_id in ids:
        many.write(f"T{type_id:03d}", type_id, type_id)
    log = Log(tmp_path / "many.BIN", many.content)
    assert len(log.flight.topics()) == 256 and not log.damages


def test_blocks_give_the_same_as_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = flight_log(20).content
    content = content[:9_000] + bytes(40) + content[9_000:20_000] + content[20_010:]
    whole = Log(tmp_path / "a.BIN", content)
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 1_500)
    pieces = Log(tmp_path / "b.BIN", content)
    assert len(pieces.batches) > 5 * len(whole.batches) and pieces.damages == whole.damages
    assert pieces.header == whole.header and pieces.remarks == whole.remarks
    one, other = whole.flight, pieces.flight
    assert one.topics() == other.topics()
    for topic in one.topics():
        assert np.array_equal(one[topic].record_index, other[topic].record_index)
        for name, column in one[topic].columns.items():
            assert np.array_equal(column.mask, other[topic].columns[name].mask), (topic, name)
            mask = column.mask
            assert np.array_equal(column.values[mask], other[topic].columns[name].values[mask]), (topic, name)


def test_a_file_without_definitions_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "log.BIN"
    for content in (b"\xa3\x95\x80" + bytes(4000), b"\xa3\x95\x04" + bytes(40)):
        path.write_bytes(content)
        with pytest.raises(UnreadableLogError, match="ArduPilot DataFlash without its definitions"):
            registry.read(path)


@pytest.mark.parametrize(
    ("week", "week_s", "expected"),
    [
        (0, 0, "1980-01-06T00:00:00Z"),
        (1653, 265_600, "2011-09-14T01:46:25Z"),  # GPS second 10^9; 15 leap seconds, Lombardi (NIST) 2011
        (1851, 259_215, "2015-06-30T23:59:59Z"),
        (1851, 259_217, "2015-07-01T00:00:00Z"),
        (2300, 0, "2024-02-03T23:59:42Z"),
    ],
)
def test_gps_weeks_less_leap_seconds(week: int, week_s: int, expected: str) -> None:
    assert int(gps_week_to_utc_ns(week, 1000 * week_s + 250)) == iso_to_utc_ns(expected)[0] + 250_000_000


def test_interleaved_topics_make_no_clock_step(log: Log) -> None:
    written = np.concatenate([batch.device_time_ns.values for batch in log.batches if batch.topic.startswith("raw.")])
    order = np.argsort(np.concatenate([b.record_index for b in log.batches if b.topic.startswith("raw.")]))
    assert (np.diff(written[order]) < 0).any(), "times of different types go back and forth"
    clock = survey(log.items).clock
    assert clock.is_absolute and not clock.steps
    assert not (clock.stray_rows or clock.implausible_times or clock.stale_times or clock.is_unordered)


def test_a_clock_that_runs_slow_is_told(tmp_path: Path) -> None:
    slow = DataFlash()
    slow.define(1, "GPS", "QBIHBcLLeffff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw")
    for at in range(200):
        slow.write("GPS", at * 950_000, 3, 1000 * at, 2200, 9, 100, 10, 20, 30, 1.0, 0.0, 0.0, 0.0)
    log = Log(tmp_path / "slow.BIN", slow.content)
    text = next(remark.text for remark in log.remarks if remark.code == "clock_disagrees")
    assert "runs 5.0% slow" in text
