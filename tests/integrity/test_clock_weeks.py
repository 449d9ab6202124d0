"""GPS weeks that are late, rolled over or impossible, as the ledger tells them; in logs of autopilots and tables."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.findings import Finding
from groundstation.base.records import Int64Array
from groundstation.base.timescales import GPS_EPOCH_NS, WEEK_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.integrity import Survey, ledger_findings, survey
from groundstation.integrity.clock_dates import doubtful_date
from groundstation.readers import registry
from tests.readers.chapter10_packets import packet, time_of_day, word_429, words_429
from tests.readers.dataflash_writer import DataFlash
from tests.readers.receiver_writer import gga, rmc
from tests.readers.test_chapter10 import COUNTS_PER_S
from tests.readers.ulog_writer import GPS, GPS_CODE, UlogWriter

START_NS = iso_to_utc_ns("2024-05-06T10:00:00Z")[0]
LEAP_NS = 18 * NS_PER_S
POWER_UP_S = 20
ROWS = 120


def dataflash(path: Path, weeks: Int64Array, messages: tuple[str, ...] = ()) -> Path:
    """Fixes at 1 Hz; each tells a GPS week so many weeks behind."""
    log = DataFlash()
    log.define(8, "GPS", "QBIHBcLLefff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ")
    log.define(9, "MSG", "QZ", "TimeUS,Message")
    for text in messages:
        log.write("MSG", 1_000_000, text)
    for second, behind in enumerate(weeks.tolist()):
        week, rest_ns = divmod(START_NS + second * NS_PER_S - GPS_EPOCH_NS + LEAP_NS, WEEK_NS)
        device_us = (POWER_UP_S + second) * 1_000_000
        told = max(week - behind, 0)
        log.write("GPS", device_us, 3, rest_ns // 1_000_000, told, 12, 100, 500_000_000, 10, 0, 0.0, 0.0, 0.0)
    path.write_bytes(log.content)
    return path


def ulog(path: Path, weeks: Int64Array) -> Path:
    log = UlogWriter(start_us=POWER_UP_S * 1_000_000).flags().format(GPS).subscribe(0, "vehicle_gps_position")
    for second, behind in enumerate(weeks.tolist()):
        utc_us = (START_NS + second * NS_PER_S - behind * WEEK_NS) // 1000
        numbers = (500_000_000, 100_000_000, 0, 0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3, 1, 12)
        log.row(0, GPS_CODE, (POWER_UP_S + second) * 1_000_000, utc_us, *numbers)
    path.write_bytes(bytes(log.data))
    return path


def table(path: Path, weeks: Int64Array) -> Path:
    lines = ["# start_utc: 2024-05-06T10:00:00Z", "time_s,gnss.latitude_deg,gnss_time_of_week_s,gnss_week"]
    for second, behind in enumerate(weeks.tolist()):
        week, rest_ns = divmod(START_NS + second * NS_PER_S - GPS_EPOCH_NS + LEAP_NS, WEEK_NS)
        lines.append(f"{second},50.0,{rest_ns // NS_PER_S},{week - behind}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


WRITERS: tuple[Callable[[Path, Int64Array], Path], ...] = (dataflash, ulog, table)


def behind(rows: range, weeks: int) -> Int64Array:
    return np.where(np.isin(np.arange(ROWS), rows), weeks, 0)


def findings(found: Survey) -> dict[str, Finding]:
    return {one.code: one for one in ledger_findings(found.ledger)}


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
@pytest.mark.parametrize("weeks", [1, 3, 557, 1024])
@pytest.mark.parametrize("rows", [range(4), range(60, 64), range(116, 120), range(10, 11)], ids=str)
def test_epochs_of_another_week_are_set_aside_and_named(
    write: Callable[[Path, Int64Array], Path], weeks: int, rows: range, tmp_path: Path
) -> None:
    found = survey(registry.read(write(tmp_path / "log", behind(rows, weeks))))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "2024-05-06T10:00:00.000Z"
    (relation,) = found.clock.relations
    (segment,) = relation.segments
    assert not relation.breaks and abs(segment.offset_ns) < NS_PER_S and len(rows) + segment.samples == ROWS
    told = findings(found)
    text, count = told["clock.week_number"].text, len(rows)
    assert told["clock.week_number"].count == count and "clock.relation_step" not in told
    number = f"{-weeks:+d} week{'s' if weeks > 1 else ''}"
    assert f"{count} reading{'s' if count > 1 else ''} of one week: GPS week number off by {number}" in text
    assert utc_ns_to_iso(START_NS + rows[0] * NS_PER_S) in text


@pytest.mark.parametrize("write", [dataflash, ulog], ids=lambda write: write.__name__)
@pytest.mark.parametrize("right", [4, 60])
def test_the_week_that_a_receiver_learns_last_is_believed(
    write: Callable[[Path, Int64Array], Path], right: int, tmp_path: Path
) -> None:
    found = survey(registry.read(write(tmp_path / "log", behind(range(ROWS - right), 1))))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "2024-05-06T10:00:00.000Z"
    assert f"{ROWS - right} readings told a date 1 week before" in findings(found)["reader.week_number"].text


def test_fixes_without_a_week_are_counted(tmp_path: Path) -> None:
    found = survey(registry.read(dataflash(tmp_path / "log.BIN", behind(range(4), 5_000))))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "2024-05-06T10:00:00.000Z"
    assert "4 fixes told week 0" in findings(found)["reader.week_number"].text


@pytest.mark.parametrize("firmware", ["ArduCopter V3.6.7 (c1ae9d07)", "ArduPlane V4.5.1 (1a2b3c4d)"])
@pytest.mark.parametrize("weeks", [1024, 2048])
def test_the_firmware_of_an_autopilot_shows_a_rollover(firmware: str, weeks: int, tmp_path: Path) -> None:
    """Also one that counts to 1023 alone: week 265 for 2313."""
    all_behind = behind(range(ROWS), weeks)
    found = survey(registry.read(dataflash(tmp_path / "log.BIN", all_behind, (firmware,))))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "2024-05-06T10:00:00.000Z"
    assert "came in" in findings(found)["reader.week_rollover"].text
    unknown = survey(registry.read(dataflash(tmp_path / "log.BIN", all_behind)))
    kept = utc_ns_to_iso(unknown.ledger["gnss"].first_ns)
    assert kept.startswith("2004-09-20T10:00:05" if weeks == 1024 else "1985-02-04T10:00:15")
    assert findings(unknown)["reader.week_rollover"].severity == "warn"


def test_leap_seconds_that_a_receiver_learns_are_named(tmp_path: Path) -> None:
    log = UlogWriter(start_us=1_000_000).flags().format(GPS).subscribe(0, "vehicle_gps_position")
    for second in range(100):
        utc_us = START_NS // 1000 + (second + (2 if second < 60 else 0)) * 1_000_000
        numbers = (500_000_000, 100_000_000, 0, 0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3, 1, 12)
        log.row(0, GPS_CODE, (1 + second) * 1_000_000, utc_us, *numbers)
    (tmp_path / "log.ulg").write_bytes(bytes(log.data))
    told = findings(survey(registry.read(tmp_path / "log.ulg")))
    assert "learns the leap seconds" in told["clock.leap_seconds"].text and "clock.relation_step" in told


# --- dates that a log cannot have, or hardly


@pytest.mark.parametrize(
    ("reader", "date", "code"),
    [
        ("receiver", "1999-09-13", "week_rollover"),
        ("rtklib-pos", "1987-03-02", "week_rollover"),
        ("px4-ulog", "2015-12-31", "week_rollover"),
        ("px4-ulog", "2016-01-01", None),
        ("csv profile garmin-g1000", "2004-09-20", "week_rollover"),
        ("receiver", "2004-09-20", None),
        ("receiver", "2019-04-09", "date_of_rollover"),
        ("receiver", "2019-04-15", None),
        ("flightdata-hdf5", "1996-05-04", None),
    ],
)
def test_dates_that_are_doubted(reader: str, date: str, code: str | None) -> None:
    found = doubtful_date(reader, iso_to_utc_ns(f"{date}T12:00:00Z")[0], ())
    assert (None if found is None else found.code) == code
    assert (
        found is None
        or doubtful_date(reader, iso_to_utc_ns(f"{date}T12:00:00Z")[0], (found,)) is None
        or code != "week_rollover"
    )


def test_a_stream_before_2000_is_kept_and_named(tmp_path: Path) -> None:
    path = tmp_path / "stream.nmea"
    path.write_bytes(b"".join(gga(f"1000{at:02d}.00") + rmc(f"1000{at:02d}.00", "130999") for at in range(30)))
    found = survey(registry.read(path))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "1999-09-13T10:00:00.000Z"
    told = findings(found)["reader.week_rollover"]
    assert told.severity == "warn" and "it is of 2019-04-29" in told.text


# --- time packets of recorders


def recording(dates: list[tuple[int, int, int]], tmats: str = "") -> bytes:
    """A time packet each second, with a date (year, month, day)."""
    out = [packet(0, 0x01, bytes(4) + tmats.encode(), 0, checksum=2)]
    for second, (year, month, day) in enumerate(dates):
        rtc = second * COUNTS_PER_S
        told = time_of_day(0, 36_000 + second, year=year, month=month, day_of_month=day)
        out += [packet(1, 0x11, told, rtc, sequence=second)]
        out += [packet(7, 0x38, words_429([(0, 1_000, word_429(0o314, second))]), rtc, sequence=second, checksum=1)]
    return b"".join(out)


def test_a_time_source_that_locks_in_the_recording(tmp_path: Path) -> None:
    """Its default date is told for longer than the true one."""
    path = tmp_path / "recorded"
    path.write_bytes(recording([(2010, 1, 1)] * 30 + [(2024, 5, 6)] * 10))
    found = survey(registry.read(path))
    assert utc_ns_to_iso(found.ledger.start_ns) == "2024-05-06T10:00:00.000Z"
    assert any("30 readings told a" in one.text for one in found.ledger.remarks)


def test_a_time_source_behind_by_a_rollover(tmp_path: Path) -> None:
    path = tmp_path / "recorded"
    for tmats, start in ((r"G\OD:05-02-2024;", "2024-05-06"), ("", "2004-09-20"), (r"G\OD:05-02-2019;", "2004-09-20")):
        path.write_bytes(recording([(2004, 9, 20)] * 20, tmats))
        found = survey(registry.read(path))
        assert utc_ns_to_iso(found.ledger.start_ns) == f"{start}T10:00:00.000Z", tmats


@pytest.mark.parametrize("late", [1, 4, 9])
def test_the_turn_of_a_week_with_a_number_that_comes_late(late: int, tmp_path: Path) -> None:
    """The time of the week is zero again, and for some epochs the week is still the old one."""
    log = DataFlash()
    log.define(8, "GPS", "QBIHBcLLefff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ")
    week_ms = 604_800_000
    for epoch in range(200):
        since_ms = (epoch - 100) * 200
        told = (week_ms + since_ms, 2312) if since_ms < 0 else (since_ms, 2312 if epoch < 100 + late else 2313)
        log.write("GPS", 20_000_000 + epoch * 200_000, 3, *told, 12, 100, 500_000_000, 10, 0, 0.0, 0.0, 0.0)
    (tmp_path / "log.BIN").write_bytes(log.content)
    found = survey(registry.read(tmp_path / "log.BIN"))
    assert utc_ns_to_iso(found.ledger["gnss"].first_ns) == "2024-05-04T23:59:22.000Z"
    (relation,) = found.clock.relations
    assert not relation.breaks and f"{late} reading" in findings(found)["clock.week_number"].text
