"""UTC of a ULog: which receiver tells it, the autopilot's own clock, wrong dates; values that are none."""

from pathlib import Path

import pytest

from groundstation.base.errors import UnclaimedLogError, UnreadableLogError
from groundstation.base.timescales import ROLLOVER_NS, WEEK_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.integrity import ledger_findings, survey
from groundstation.readers import registry
from tests.readers.test_ulog import Read, one, read
from tests.readers.ulog_writer import GPS, GPS_CODE, UlogWriter
from tests.real_logs import real_log

ZERO = "2024-05-06T10:00:00.000Z"
ZERO_US = iso_to_utc_ns(ZERO)[0] // 1000
ROLLOVER_US, WEEK_US = ROLLOVER_NS // 1000, WEEK_NS // 1000
LATE_US = 100_000  # delay of a receiver's messages
RELATIVE = GPS.replace("float hdop", "int32_t timestamp_time_relative;float hdop")
NUMBERS = (500_000_000, 100_000_000, 30_000, 70_000, 0.3)
MOTION = (0.9, 5.0, 3.0, -4.0, 0.5, -0.9, 3, 1, 11)


def started(release: str = "", formats: tuple[str, ...] = (GPS,)) -> UlogWriter:
    log = UlogWriter(start_us=1_000_000).flags()
    for text in formats:
        log.format(text)
    if release:
        major, minor, patch = (int(part) for part in release.split("."))
        log.keyed("I", "uint32_t ver_sw_release", bytes([255, patch, minor, major]))
    return log


def fixes(log: UlogWriter, number: int, off_us: list[int], fix: int = 3) -> UlogWriter:
    """Fixes of one receiver, 200 ms apart; each tells a UTC so many microseconds off."""
    for row, away_us in enumerate(off_us):
        time_us = 1_000_000 + 200_000 * row
        utc_us = ZERO_US + time_us - LATE_US + away_us
        log.row(number, GPS_CODE, time_us, utc_us, *NUMBERS, *MOTION[:6], fix, *MOTION[7:])
    return log


def zero_of(found: Read) -> str | None:
    zero = found.header.utc_of_zero_ns
    return None if zero is None else utc_ns_to_iso(zero + LATE_US * 1000)


def told(found: Read, code: str) -> str:
    return " | ".join(remark.text for remark in found.remarks if remark.code == code)


# --- which clock


@pytest.mark.parametrize("live", [0, 1, 2])
@pytest.mark.parametrize("topic", ["vehicle_gps_position", "sensor_gps"])
def test_any_receiver_with_a_fix_tells_utc(tmp_path: Path, live: int, topic: str) -> None:
    log = started(formats=(GPS.replace("vehicle_gps_position", topic),))
    for number in range(3):
        log.subscribe(number, topic, number)
        fixes(log, number, [0 if number == live else -ZERO_US] * 10, 3 if number == live else 0)
    found = read(tmp_path, log)
    assert zero_of(found) == ZERO and found.rows(f"gnss.{live + 1}") == 10
    assert f"from {topic}.{live}:" in told(found, "utc_from_gnss") or live == 0


def test_a_receiver_that_falls_silent_gives_way(tmp_path: Path) -> None:
    log = started().subscribe(0, "vehicle_gps_position").subscribe(1, "vehicle_gps_position", 1)
    fixes(log, 0, [5_000_000] * 4)
    assert zero_of(read(tmp_path, fixes(log, 1, [0] * 100))) == ZERO


def test_the_topic_with_a_fix_is_gnss(tmp_path: Path) -> None:
    log = started(formats=(GPS, GPS.replace("vehicle_gps_position", "sensor_gps")))
    log.subscribe(0, "vehicle_gps_position").subscribe(1, "sensor_gps")
    found = read(tmp_path, fixes(fixes(log, 0, [0] * 5, fix=0), 1, [0] * 5))
    assert found.values("gnss", "latitude_deg") == pytest.approx([50.0] * 5) and zero_of(found) == ZERO


def test_the_message_tells_when_its_utc_was_true(tmp_path: Path) -> None:
    """A receiver of whole seconds at 5 Hz: ``timestamp_time_relative`` says how old each of them is."""
    log = started(formats=(RELATIVE,)).subscribe(0, "vehicle_gps_position")
    for row in range(20):
        time_us, since_us = 1_300_000 + 200_000 * row, 300_000 + 200_000 * (row % 5)
        numbers = (*NUMBERS, -since_us, *MOTION)
        log.row(0, "QQiiiififfffffBBB", time_us, ZERO_US + time_us - since_us, *numbers)
    zero_ns = read(tmp_path, log).header.utc_of_zero_ns
    assert zero_ns is not None and utc_ns_to_iso(zero_ns) == ZERO


def test_the_clock_of_the_ground_station(tmp_path: Path) -> None:
    value = ZERO_US.to_bytes(8, "little")
    dead = fixes(
        started().keyed("I", "uint64_t boot_time_utc_us", value).subscribe(0, "vehicle_gps_position"), 0, [0], 0
    )
    found = read(tmp_path, dead)
    assert found.header.utc_of_zero_ns == ZERO_US * 1000
    assert "as the ground station" in told(found, "utc_from_boot_time")
    assert "not GNSS time" in told(found, "utc_from_boot_time") and not told(found, "utc_from_gnss")
    for unset in (0, 1, 200_000_000_000_000, 946_684_800_000_000):
        log = started().keyed("I", "uint64_t boot_time_utc_us", unset.to_bytes(8, "little"))
        assert read(tmp_path, log.text(2_000_000, "a line")).header.utc_of_zero_ns is None


def test_gnss_time_comes_before_the_clock_of_the_ground_station(tmp_path: Path) -> None:
    log = started().keyed("I", "uint64_t boot_time_utc_us", (ZERO_US + 7_500_000).to_bytes(8, "little"))
    found = read(tmp_path, fixes(log.subscribe(0, "vehicle_gps_position"), 0, [0] * 10))
    assert zero_of(found) == ZERO
    assert "boot_time_utc_us tells a power-up +7.600 s off" in told(found, "clock_disagrees")


@pytest.mark.parametrize("offset_s", [0, 7_200, -28_800])
def test_the_name_of_the_log_has_the_date(tmp_path: Path, offset_s: int) -> None:
    """The autopilot writes the name of its log, in local time, into it."""
    log = started().keyed("I", "int32_t time_ref_utc", offset_s.to_bytes(4, "little", signed=True))
    name = utc_ns_to_iso(iso_to_utc_ns(ZERO)[0] + (offset_s + 12) * 10**9, 0)
    path = f"/fs/microsd/log/{name[:10]}/{name[11:19].replace(':', '_')}.ulg"
    found = read(tmp_path, log.text(12_000_000, "[logger] Start file log").tagged(12_000_000, f"[logger] {path}", 3))
    assert found.header.utc_of_zero_ns == ZERO_US * 1000
    assert path.partition("log/")[2] in told(found, "utc_from_log_name")
    for bad in ("/log/2024-13-45/99_99_99.ulg", "/log/sess001/log100.ulg", "/log/2000-01-01/00_00_12.ulg"):
        assert read(tmp_path, started().text(12_000_000, bad)).header.utc_of_zero_ns is None


# --- wrong dates


def test_leap_seconds_learnt_in_flight(tmp_path: Path) -> None:
    log = started().subscribe(0, "vehicle_gps_position")
    path = tmp_path / "log.bin"
    path.write_bytes(fixes(log, 0, [2_000_000] * 70 + [0] * 30).data)
    found = Read(path)
    assert zero_of(found) == ZERO and "70 readings told UTC 2 s late" in told(found, "leap_seconds")
    codes = {one.code for one in ledger_findings(survey(registry.read(path)).ledger)}
    assert "clock.leap_seconds" in codes


def test_a_week_that_comes_late(tmp_path: Path) -> None:
    for weeks in (1, 557, 1024, 2313):
        found = read(
            tmp_path, fixes(started().subscribe(0, "vehicle_gps_position"), 0, [-weeks * WEEK_US] * 4 + [0] * 4)
        )
        assert zero_of(found) == ZERO and f"{weeks} week" in told(found, "week_number")


def test_a_date_behind_by_a_rollover_is_moved_where_the_log_shows_it(tmp_path: Path) -> None:
    def rolled(release: str = "") -> UlogWriter:
        return fixes(started(release).subscribe(0, "vehicle_gps_position"), 0, [-ROLLOVER_US] * 20)

    by_firmware = read(tmp_path, rolled("1.13.2"))
    assert zero_of(by_firmware) == ZERO and "PX4 v1.13.2 came in 2021" in told(by_firmware, "week_rollover")
    second = rolled().subscribe(1, "vehicle_gps_position", 1)
    assert zero_of(read(tmp_path, fixes(second, 1, [0] * 20))) == ZERO
    by_name = rolled().text(2_000_000, "[logger] /fs/microsd/log/2024-05-06/10_00_02.ulg")
    assert zero_of(read(tmp_path, by_name)) == ZERO
    kept = read(tmp_path, rolled())
    assert zero_of(kept) == "2004-09-20T10:00:00.000Z"
    assert "cannot be true" in told(kept, "week_rollover") and "2024-05-06" in told(kept, "week_rollover")


def test_a_rollover_before_2004_is_a_date_too(tmp_path: Path) -> None:
    """Flights of 2019 to 2023 come out in 1999 to 2003: such dates were taken for none."""
    log = started("1.11.0").subscribe(0, "vehicle_gps_position")
    off_us = iso_to_utc_ns("2021-03-04T10:00:00Z")[0] // 1000 - ZERO_US - ROLLOVER_US
    assert zero_of(read(tmp_path, fixes(log, 0, [off_us] * 20))) == "2021-03-04T10:00:00.000Z"


# --- values that are none


def test_zeros_that_a_driver_leaves_are_no_values(tmp_path: Path) -> None:
    log = started().subscribe(0, "vehicle_gps_position")
    log.row(0, GPS_CODE, 1_000_000, 0, 500_000_000, 100_000_000, 30_000, 0, 0.0, 0.0, *MOTION[1:])
    log.row(0, GPS_CODE, 1_200_000, 0, 500_000_000, 100_000_000, 0, 0, 0.2, 0.8, *MOTION[1:])
    found = read(tmp_path, log)
    assert found.values("gnss", "hdop") == [None, pytest.approx(0.8)]
    assert found.values("gnss", "velocity_sigma_mps") == [None, pytest.approx(0.2)]
    assert found.values("gnss", "altitude_ellipsoid_m") == [None, 0.0]
    assert found.values("raw.vehicle_gps_position", "hdop") == [0.0, pytest.approx(0.8)]


def test_a_position_0_0_is_none(tmp_path: Path) -> None:
    log = started().subscribe(0, "vehicle_gps_position")
    for row, (latitude, longitude) in enumerate([(0, 0), (500_000_000, 0), (0, 100_000_000), (0, 0)]):
        log.row(0, GPS_CODE, 1_000_000 + row, 0, latitude, longitude, *NUMBERS[2:], *MOTION)
    found = read(tmp_path, log)
    assert found.values("gnss", "latitude_deg") == [None, 50.0, 0.0, None]
    assert found.values("gnss", "altitude_msl_m") == [None, 30.0, 30.0, None]
    assert found.values("gnss", "velocity_north_mps") == [3.0] * 4
    assert found.values("raw.vehicle_gps_position", "lat") == [0, 500_000_000, 0, 0]
    (damage,) = found.damages
    assert (damage.kind, damage.count, damage.topic, damage.loses_data) == ("no_position", 2, "gnss", False)
    place = "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;"
    assert one(tmp_path, place, "2df", 0.0, 3e-8, 12.0).batches.keys() == {"raw.vehicle_global_position"}


@pytest.mark.parametrize(("fix", "ok"), [(0, False), (1, False), (2, False), (3, True), (6, True), (8, False)])
def test_integrity_is_that_of_a_fix_in_three_dimensions(tmp_path: Path, fix: int, ok: bool) -> None:
    found = read(tmp_path, fixes(started().subscribe(0, "vehicle_gps_position"), 0, [0], fix))
    assert found.values("gnss", "integrity_ok") == [ok]


def test_a_sensor_that_says_it_is_not_there_gives_nothing(tmp_path: Path) -> None:
    layout = (
        "sensor_combined:uint64_t timestamp;float[3] magnetometer_ga;int32_t magnetometer_timestamp_relative;"
        "float baro_alt_meter;int32_t baro_timestamp_relative;"
    )
    log = UlogWriter().flags().format(layout).subscribe(0, "sensor_combined")
    for row, (magnetometer, baro) in enumerate([(-20_000, 0x7FFFFFFF), (0x7FFFFFFF, -300)]):
        log.row(0, "Q3fifi", 1_000_000 + row, 0.1, 0.2, 0.3, magnetometer, 120.0, baro)
    found = read(tmp_path, log)
    assert found.values("baro", "pressure_altitude_m") == [120.0] and found.rows("magnetometer") == 1
    assert found.rows("raw.sensor_combined") == 2 and not found.damages


@pytest.mark.parametrize("name", ["covariance", "variance"])
def test_wind_of_a_filter_that_has_not_started_is_none(tmp_path: Path, name: str) -> None:
    layout = (
        f"wind_estimate:uint64_t timestamp;float windspeed_north;float windspeed_east;float {name}_north;"
        f"float {name}_east;"
    )
    log = UlogWriter().flags().format(layout).subscribe(0, "wind_estimate")
    log.row(0, "Q4f", 1_000_000, 0.0, 0.0, 0.0, 0.0).row(0, "Q4f", 1_000_001, 0.0, 2.0, 0.5, 0.5)
    found = read(tmp_path, log)
    assert found.rows("air") == 1 and found.values("air", "wind_east_mps") == [2.0]


# --- encrypted logs


@pytest.mark.parametrize("name", ["log.ulge", "log.ulg", "whatever.bin"])
def test_an_encrypted_log_says_so(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"ULogEnc\x01" + bytes(range(256)) * 40)
    with pytest.raises(UnreadableLogError, match=r"encrypted PX4 ULog: decrypt it .*Tools/decrypt_ulog\.py"):
        registry.read(path)


def test_encrypted_data_and_keys_of_older_autopilots(tmp_path: Path) -> None:
    (tmp_path / "log.ulgc").write_bytes(bytes(range(1, 256)) * 40)
    with pytest.raises(UnreadableLogError, match="encrypted PX4 ULog"):
        registry.read(tmp_path / "log.ulgc")
    (tmp_path / "log.ulgk").write_bytes(b"ULogKey\x01" + bytes(300))
    with pytest.raises(UnclaimedLogError, match="key of an encrypted PX4 ULog"):
        registry.read(tmp_path / "log.ulgk")


# --- recorded logs


@pytest.mark.parametrize(
    ("name", "zero", "tolerance_s"),
    [
        ("cases/u1_boot_time_utc.ulg", "2024-05-06T10:00:00Z", 0.0),
        ("cases/u3_first_receiver_dead.ulg", "2024-05-06T10:00:00Z", 0.0),
        ("ulog/sample_px4_events.ulg", "1970-01-01T00:00:00Z", 0.0),  # its clock counts from 1970
        ("ulog/quadrotor_local.ulg", "2026-03-09T11:00:50Z", 1.0),  # no fix: by the name of the log
    ],
)
def test_recorded_logs(name: str, zero: str, tolerance_s: float) -> None:
    zero_ns = Read(real_log(name)).header.utc_of_zero_ns
    assert zero_ns is not None and abs(zero_ns - iso_to_utc_ns(zero)[0]) <= tolerance_s * 1e9


def test_the_encrypted_log_is_named() -> None:
    with pytest.raises(UnreadableLogError, match="encrypted"):
        registry.read(real_log("cases/u2_encrypted.ulge"))
