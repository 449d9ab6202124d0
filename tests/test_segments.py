"""Several power-ups in one file: a flight of each, in every format, from the log and from its MCAP, in every verb."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.base.timescales import GPS_EPOCH_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.files import load_document, load_manifest
from groundstation.store.reader import read_info
from tests.readers import chapter10_packets as made
from tests.readers.dataflash_writer import DataFlash
from tests.readers.receiver_writer import gga, pvt, rmc
from tests.readers.test_g1000 import TOP, row
from tests.readers.ulog_writer import ATTITUDE, GPS, GPS_CODE, UlogWriter
from tests.real_logs import real_log
from tests.test_parts import COLUMNS, assert_close, figures, flights, head, later, rows, run, text
from tests.test_remote import fetched, memory  # noqa: F401

LEAP_NS = 18 * NS_PER_S
Writer = Callable[[str, int], bytes]  # of a power-up: when it begins, for how many seconds


def ns_of(start: str) -> int:
    return iso_to_utc_ns(start)[0]


def times(start: str, seconds: int) -> list[str]:
    return [utc_ns_to_iso(ns_of(start) + second * NS_PER_S, 0) for second in range(seconds)]


def dataflash(start: str, seconds: int) -> bytes:
    log = DataFlash()
    log.define(5, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw")
    log.define(8, "GPS", "QBIHBcLLefff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ")
    for tick in range(5 * seconds):
        time_us = 1_000_000 + 200_000 * tick
        log.write("ATT", time_us, 0, tick, 0, -tick, 0, (10 * tick) % 36_000)
        if tick % 5 == 0:
            since_ns = ns_of(start) + tick // 5 * NS_PER_S - GPS_EPOCH_NS + LEAP_NS
            week, rest_ns = divmod(since_ns, 604_800 * NS_PER_S)
            place = 500_000_000 + tick, 200_000_000, 10_000
            log.write("GPS", time_us, 3, rest_ns // 1_000_000, week, 12, 100, *place, 5.0, 90.0, 0.0)
    return log.content


def flat_csv(start: str, seconds: int) -> bytes:
    return text(*head(start=start), COLUMNS, *rows(0, seconds)).encode()


def ulog(start: str, seconds: int) -> bytes:
    log = UlogWriter().flags().format(ATTITUDE).format(GPS)
    log.subscribe(0, "vehicle_attitude").subscribe(1, "vehicle_gps_position")
    for tick in range(5 * seconds):
        time_us = 1_000_000 + 200_000 * tick
        log.row(0, "Q4f", time_us, 1.0, 0.001 * tick, 0.0, 0.0)
        if tick % 5 == 0:
            utc_us = ns_of(start) // 1000 + 200_000 * tick
            place = 500_000_000 + tick, 200_000_000, 10_000, 0
            log.row(1, GPS_CODE, time_us, utc_us, *place, 0.05, 1.0, 5.0, 0.0, 5.0, 0.0, 0.0, 3, 1, 12)
    return bytes(log.data)


def ubx(start: str, seconds: int) -> bytes:
    return b"".join(pvt(time, lat=500_000_000 + at) for at, time in enumerate(times(start, seconds)))


def nmea(start: str, seconds: int) -> bytes:
    clocks = [
        (f"{time[11:13]}{time[14:16]}{time[17:19]}.00", f"{time[8:10]}{time[5:7]}{time[2:4]}")
        for time in times(start, seconds)
    ]
    return b"".join(gga(clock) + rmc(clock, date) for clock, date in clocks)


def g1000(start: str, seconds: int) -> bytes:
    local = utc_ns_to_iso(ns_of(start) + 2 * 3600 * NS_PER_S)
    return (TOP + "".join(row(time[11:19], time[:10]) for time in times(local, seconds))).encode()


def chapter10(start: str, seconds: int) -> bytes:
    """A counter of its own from nought, sequence numbers of its own."""
    day, since_s = int(np.datetime64(start[:10]).astype(object).timetuple().tm_yday), ns_of(start[:10] + "T00:00:00Z")
    first_s = (ns_of(start) - since_s) // NS_PER_S
    out = [made.packet(0, 0x01, made.tmats("G\\TA:Test;R-1\\TK1-1:7;R-1\\CDT-1:1553IN;"), 0, checksum=2)]
    year, month, day_of_month = int(start[:4]), int(start[5:7]), int(start[8:10])
    for second in range(seconds):
        rtc = second * 10_000_000
        told = made.time_of_day(day, first_s + second, year=year, month=month, day_of_month=day_of_month)
        out.append(made.packet(1, 0x11, told, rtc, sequence=second))
        messages = [(rtc + at * 400_000, 0, [0x37A0, 0x3000, *range(at, at + 32)]) for at in range(25)]
        out.append(made.packet(4, 0x19, made.messages_1553(messages), rtc, sequence=second, checksum=3))
    return b"".join(out)


@dataclass(frozen=True)
class Form:
    """A format: its writer, the name of a file, when its power-ups begin, whether its clock tells UTC."""

    write: Writer
    name: str
    starts: tuple[str, str] = ("2024-05-06T10:00:00Z", "2024-05-06T10:11:40Z")
    seconds: tuple[int, int] = (60, 45)


HOURS_APART = "2024-05-06T10:00:00Z", "2024-05-06T14:11:40Z"  # a clock that tells UTC goes on; only silence tells
FORMS = {
    "dataflash": Form(dataflash, "log.bin"),
    "flat csv": Form(flat_csv, "log.csv"),
    "ulog": Form(ulog, "log.ulg"),
    "chapter10": Form(chapter10, "log.ch10"),
    "ubx": Form(ubx, "log.ubx", HOURS_APART, (120, 100)),
    "ubx, the later one first": Form(ubx, "log.ubx", HOURS_APART[::-1], (120, 100)),
    "nmea": Form(nmea, "log.nmea", HOURS_APART, (120, 100)),
    "g1000": Form(g1000, "log.csv", HOURS_APART, (120, 100)),
    "g1000, the later one first": Form(g1000, "log.csv", HOURS_APART[::-1], (120, 100)),
}


def written(folder: Path, form: Form) -> tuple[Path, list[Path]]:
    """A file of two power-ups, and a file of each."""
    paths = []
    for number, (start, seconds) in enumerate(zip(form.starts, form.seconds, strict=True), start=1):
        alone = folder / f"alone{number}"
        alone.mkdir()
        paths.append(alone / form.name)
        paths[-1].write_bytes(form.write(start, seconds))
    both = folder / form.name
    both.write_bytes(b"".join(path.read_bytes() for path in paths))
    return both, paths


def by_start(out: Path) -> list[Path]:
    """Flights of an OUT in the order of their power-ups."""
    return sorted(flights(out), key=lambda flight: told.number if (told := load_manifest(flight).power_up) else 0)


@pytest.mark.parametrize("name", FORMS)
def test_each_power_up_is_the_flight_that_it_is_alone(tmp_path: Path, name: str) -> None:
    """Run of the log, and of the MCAP that convert makes of it, gives what runs of two files give."""
    form = FORMS[name]
    both, alone = written(tmp_path, form)
    mcap = tmp_path / "converted.mcap"
    segments = convert_log(open_log(both), mcap).info.segments
    assert [one["number"] for one in segments] == [1, 2] and read_info(mcap).segments == segments
    for source, out in ((both, tmp_path / "out"), (mcap, tmp_path / "out-mcap")):
        outcomes = run(source, out)
        found = by_start(out)
        assert len(found) == 2 and [one.power_up for one in outcomes] == [1, 2]
        for number, (flight, path) in enumerate(zip(found, alone, strict=True), start=1):
            run(path, tmp_path / f"out{number}")
            (expected,) = flights(tmp_path / f"out{number}")
            assert flight.name == expected.name
            assert_close(figures(flight), figures(expected))
            document = json.loads((flight / "summary.json").read_text())
            assert document["flight"]["start_utc"].startswith(form.starts[number - 1][:19])
            assert [one.code for one in load_document(flight).findings].count("log.power_up") == 1


def test_names_of_power_ups_that_clash_end_in_their_number(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text(text(*head(start=""), COLUMNS, *rows(0, 60), *rows(0, 45)))
    one, other = (flight.name for flight in (run(log, tmp_path / "out"), by_start(tmp_path / "out"))[1])
    assert one.startswith("NOTIME_") and (one[-2:], other[-2:]) == ("_1", "_2") and one[:-2] == other[:-2]
    twice = tmp_path / "twice.csv"
    start = "2024-05-06T10:00:00Z"
    twice.write_bytes(flat_csv(start, 60) + flat_csv(start, 45))
    run(twice, tmp_path / "out2")
    sha8 = load_manifest(flights(tmp_path / "out2")[0]).source.sha256[:8]
    assert [flight.name for flight in by_start(tmp_path / "out2")] == [
        f"20240506T100000Z_T-1_{sha8}_{at}" for at in (1, 2)
    ]


FIRST, OTHER = rows(0, 60), rows(0, 45)
OTHER_COLUMNS = COLUMNS.replace("longitude_deg", "pdop")


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ([*head(), COLUMNS, *FIRST, COLUMNS, *OTHER], [("T-1", 0), ("T-1", None)]),
        ([*head(), COLUMNS, *FIRST, OTHER_COLUMNS, *OTHER], [("T-1", 0), ("T-1", None)]),
        ([*head(), COLUMNS, *FIRST, *head("B", later(500)), COLUMNS, *OTHER], [("T-1", 0), ("B", 500)]),
        ([*head(), COLUMNS, *FIRST, *head("B", later(500)), OTHER_COLUMNS, *OTHER], [("T-1", 0), ("B", 500)]),
        ([*head(start=later(500)), COLUMNS, *FIRST, *head("B"), COLUMNS, *OTHER], [("T-1", 500), ("B", 0)]),
        ([*head(start=""), COLUMNS, *FIRST, *head("B"), COLUMNS, *OTHER], [("T-1", None), ("B", 0)]),
        ([*head(), COLUMNS, *FIRST, *head("B"), COLUMNS, *OTHER], [("T-1", 0), ("B", 0)]),
    ],
)
def test_a_header_in_a_table_says_whose_and_when(
    tmp_path: Path, lines: list[str], expected: list[tuple[str, int | None]]
) -> None:
    log = tmp_path / "log.csv"
    log.write_text(text(*lines))
    run(log, tmp_path / "out")
    told = [json.loads((flight / "summary.json").read_text())["flight"] for flight in by_start(tmp_path / "out")]
    times = [None if one["start_utc"] is None else ns_of(one["start_utc"]) - ns_of(later(0)) for one in told]
    shown = [time if time is None else time // NS_PER_S for time in times]
    assert [(one["aircraft"], time) for one, time in zip(told, shown, strict=True)] == expected


def test_a_restart_without_utc_and_a_wrap_are_told(tmp_path: Path) -> None:
    """The counter wraps after half a minute, later it starts again: two power-ups, the first with a wrap."""
    modulus_s = 2**32 * 1e-3
    wrapping = [f"{(modulus_s - 30.3 + half / 2) % modulus_s:.3f},{half % 360}" for half in range(120)]
    again = [f"{half / 2:.3f},{half % 360}" for half in range(1, 90)]
    log = tmp_path / "log.csv"
    log.write_text(text("time_s,ins.true_heading_deg", *wrapping, *again))
    run(log, tmp_path / "out")
    first, second = by_start(tmp_path / "out")
    codes = [[one.code for one in load_document(flight).findings] for flight in (first, second)]
    assert "clock.wrapped" in codes[0] and "clock.wrapped" not in codes[1]
    durations_s = [
        json.loads((flight / "summary.json").read_text())["flight"]["duration_s"] for flight in (first, second)
    ]
    assert durations_s == [pytest.approx(59.5, abs=0.01), pytest.approx(44.0, abs=0.01)]


def test_chapter_10_loses_no_packet_where_it_starts_again(tmp_path: Path) -> None:
    both, _alone = written(tmp_path, FORMS["chapter10"])
    info = convert_log(open_log(both), tmp_path / "x.mcap").info
    assert not any(one["loses_data"] for one in info.damages)
    assert not any(one.code == "data.sequence" for one in info.findings)


def test_chapter_10_counts_on_behind_the_end_of_its_48_bits(tmp_path: Path) -> None:
    start, seconds = "2026-05-04T06:00:00Z", 60
    plain = chapter10(start, seconds)
    late = moved(plain, (1 << 48) - 20 * 10_000_000)
    mcaps = [tmp_path / name for name in ("plain.mcap", "late.mcap")]
    for mcap, content in zip(mcaps, (plain, late), strict=True):
        (tmp_path / "log.ch10").write_bytes(content)
        convert_log(open_log(tmp_path / "log.ch10"), mcap)
    one, other = map(read_info, mcaps)
    assert [finding.code for finding in other.findings].count("clock.wrapped") == 1 and not other.segments
    for topic, entry in one.ledger.topics.items():
        told = other.ledger.topics[topic]
        assert (told.first, told.last, told.rows) == (entry.first, entry.last, entry.rows), topic


def moved(content: bytes, counts: int) -> bytes:
    """A recording with its counter moved: in headers, and in the words of 1553 messages."""
    out, at = b"", 0
    while at < len(content):
        length = int.from_bytes(content[at + 4 : at + 8], "little")
        size = int.from_bytes(content[at + 8 : at + 12], "little")
        channel, kind = int.from_bytes(content[at + 2 : at + 4], "little"), content[at + 15]
        rtc = (int.from_bytes(content[at + 16 : at + 22], "little") + counts) % (1 << 48)
        data = bytearray(content[at + 24 : at + 24 + size])
        place = 4
        while kind == 0x19 and place < len(data):
            stamp = (int.from_bytes(data[place : place + 6], "little") + counts) % (1 << 48)
            data[place : place + 6] = stamp.to_bytes(6, "little")
            place += 14 + int.from_bytes(data[place + 12 : place + 14], "little")
        out += made.packet(channel, kind, bytes(data), rtc, sequence=content[at + 13], checksum=content[at + 14] & 3)
        at += length
    return out


# The verbs.


def groundstation(*arguments: object) -> tuple[int, str]:
    """Exit code and output of a call in this process."""
    result = CliRunner().invoke(app, [str(one) for one in arguments])
    return result.exit_code, result.stdout


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A DataFlash log of two power-ups."""
    return written(tmp_path_factory.mktemp("both"), FORMS["dataflash"])[0]


def test_what_is_finished_is_not_done_again(both: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(both, out)
    before = [(flight / "summary.json").stat().st_mtime_ns for flight in by_start(out)]
    assert all(one.was_finished for one in run(both, out))
    shutil.rmtree(by_start(out)[1])
    run(both, out)
    assert len(by_start(out)) == 2
    assert all(one.was_finished for one in run(both, out)) and len(before) == 2


def test_json_has_both(both: Path, tmp_path: Path) -> None:
    mcap = tmp_path / "converted.mcap"
    convert_log(open_log(both), mcap)
    expected = [
        {"number": 1, "start": "2024-05-06T10:00:00.000Z", "end": "2024-05-06T10:00:59.800Z"},
        {"number": 2, "start": "2024-05-06T10:11:40.000Z", "end": "2024-05-06T10:12:24.800Z"},
    ]
    for verb, source in (("info", both), ("info", mcap), ("check", both), ("check", mcap)):
        document = json.loads(groundstation(verb, source, "--json")[1])
        told = (document[0] if verb == "check" else document)["power_ups"]
        assert [{key: one[key] for key in ("number", "start", "end")} for one in told] == expected
        assert all(one["is_utc"] for one in told)
    alone = json.loads(groundstation("check", both, "--json")[1])[0]["power_ups"]
    for more in (("--timeout", "60"), ("--isolate",)):  # from a process of its own
        assert json.loads(groundstation("check", both, "--json", *more)[1])[0]["power_ups"] == alone, more
    code, printed = groundstation("run", both, "-o", tmp_path / "out", "--only", "results", "--json")
    assert code == 0 and [one["power_up"] for one in json.loads(printed)] == [1, 2]


def test_clip_takes_one(both: Path, tmp_path: Path) -> None:
    options = "--no-recording", "-o"
    assert groundstation("clip", both, "--power-up", 2, *options, tmp_path / "two.mcap")[0] == 0
    assert read_info(tmp_path / "two.mcap").ledger.topics["ins"].rows == 5 * 45
    within = "--from", "2024-05-06T10:11:50Z", "--to", "2024-05-06T10:12:00Z"
    assert groundstation("clip", both, *within, *options, tmp_path / "range.mcap")[0] == 0
    assert 45 <= read_info(tmp_path / "range.mcap").ledger.topics["ins"].rows <= 55
    assert groundstation("clip", both, "--from", "5", *options, tmp_path / "none.mcap")[0] == 2
    assert groundstation("clip", both, "--power-up", 3, *options, tmp_path / "none.mcap")[0] == 2
    assert not (tmp_path / "none.mcap").exists()


def test_elsewhere_each_is_a_flight(both: Path, tmp_path: Path, memory: str) -> None:  # noqa: F811
    out = f"{memory}out"
    first = run_many([both], out, Configuration(), jobs=1, only_results=True)
    again = run_many([both], out, Configuration(), jobs=1, only_results=True)
    assert [one.flight_id for one in first] == [one.flight_id for one in again] and len(first) == 2
    assert all(one.was_finished for one in again)
    assert len(flights(fetched(out, tmp_path / "copy"))) == 2


@pytest.mark.real_log
def test_case_d7(tmp_path: Path) -> None:
    log = real_log("cases/d7_two_power_ups.bin")
    run(log, tmp_path / "out")
    assert [flight.name for flight in by_start(tmp_path / "out")] == ["20240506T100000Z", "20240506T101139Z"]
