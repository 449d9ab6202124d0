"""Dates of receivers' streams: weeks that come late, leap seconds that are learnt, rollovers; in every protocol."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.timescales import GPS_EPOCH_NS, ROLLOVER_NS, WEEK_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.novatel_messages import LAYOUTS, NAMES
from tests.readers.receiver_writer import (
    LEAP_S,
    gga,
    nmea,
    novatel_frame,
    novatel_text,
    pvt,
    rmc,
    ubx,
    ubx_frame,
    week_ms,
)
from tests.readers.test_receiver import Read

START = "2024-05-06T10:00:00Z"
START_NS = iso_to_utc_ns(START)[0]
EPOCHS = 30
Epoch = Callable[[int, int], bytes]  # an epoch by its second, and by how many weeks it is behind


def stamp(second: float, weeks: int = 0, late_s: int = 0) -> str:
    return utc_ns_to_iso(START_NS + round((second + late_s) * NS_PER_S) - weeks * WEEK_NS, 3)


def gps_week(second: int) -> tuple[int, int]:
    return divmod((START_NS + second * NS_PER_S - GPS_EPOCH_NS + LEAP_S * NS_PER_S) // 1_000_000, 604_800_000)


def of_pvt(second: int, weeks: int) -> bytes:
    return pvt(stamp(second, weeks), itow=week_ms(stamp(second)))


def of_timegps(second: int, weeks: int) -> bytes:
    week, itow = gps_week(second)
    position = ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=-7_000_000, hAcc=1_000)
    return position + ubx("NAV-TIMEGPS", iTOW=itow, week=week - weeks, leapS=LEAP_S, valid=7)


def of_old_solution(second: int, weeks: int) -> bytes:
    week, itow = gps_week(second)
    position = ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=-7_000_000, hAcc=1_000)
    return position + ubx("NAV-SOL", iTOW=itow, week=week - weeks, gpsFix=3, flags=13, numSV=9)


def of_rawx(second: int, weeks: int) -> bytes:
    week, itow = gps_week(second)
    record = np.zeros(1, layout_of_rawx())
    record["rcvTow"], record["week"], record["leapS"], record["recStat"] = itow / 1e3, week - weeks, LEAP_S, 1
    position = ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=-7_000_000, hAcc=1_000)
    return position + ubx_frame(0x0215, record.tobytes())


def layout_of_rawx() -> np.dtype:
    from groundstation.readers.receiver.ubx_messages import LAYOUTS as OF_UBX

    return layout(OF_UBX["RXM-RAWX"]).head.dtype


def of_novatel(second: int, weeks: int, name: str = "BESTPOS", **members: float) -> bytes:
    record = np.zeros(1, layout(LAYOUTS[name]).head.dtype)
    for member, value in ({"latitude": 51.5, "num_soln_svs": 9} | members).items():
        if member in (record.dtype.names or ()):
            record[member] = value
    number = next(number for number, known in NAMES.items() if known == name)
    week, itow = gps_week(second)
    return novatel_frame(number, record.tobytes(), week - weeks, itow)


def of_novatel_text(second: int, weeks: int) -> bytes:
    week, itow = gps_week(second)
    place = f"{week - weeks},{itow / 1e3:.3f}"
    return novatel_text(f"INSPVASA,{place}", f"{place},55.0,37.5,135.0,0,10,1,1.5,-2,90.5,INS_SOLUTION_GOOD", "%")


def of_nmea(second: float, weeks: int, late_s: int = 0, decimals: int = 2) -> bytes:
    told = stamp(second, weeks, late_s)
    time = told[11:19].replace(":", "") + told[19:23][: decimals + 1]
    return gga(time) + rmc(time, told[8:10] + told[5:7] + told[2:4])


PROTOCOLS: dict[str, tuple[Epoch, str]] = {
    "NAV-PVT": (of_pvt, "gnss"),
    "NAV-TIMEGPS": (of_timegps, "gnss"),
    "NAV-SOL": (of_old_solution, "gnss"),
    "RXM-RAWX": (of_rawx, "gnss"),
    "NovAtel": (of_novatel, "gnss"),
    "NovAtel text": (of_novatel_text, "ins"),
    "NMEA": (of_nmea, "gnss"),
}


def true_times(count: int = EPOCHS) -> list[str]:
    return [utc_ns_to_iso(START_NS + second * NS_PER_S, 9) for second in range(count)]


@pytest.mark.parametrize("name", PROTOCOLS)
@pytest.mark.parametrize("weeks", [1, 557, 1024])
@pytest.mark.parametrize("behind", [range(4), range(13, 17), range(26)], ids=["first", "middle", "nearly all"])
def test_a_week_or_date_that_comes_late(tmp_path: Path, name: str, weeks: int, behind: range) -> None:
    epoch, topic = PROTOCOLS[name]
    read = Read(tmp_path, b"".join(epoch(second, weeks if second in behind else 0) for second in range(EPOCHS)))
    assert read.times(topic) == true_times()
    assert f"told a date {weeks} week" in read.remark("week_number") and "put right" in read.remark("week_number")


@pytest.mark.parametrize("name", PROTOCOLS)
def test_four_epochs_are_of_one_week(tmp_path: Path, name: str) -> None:
    epoch, topic = PROTOCOLS[name]
    read = Read(tmp_path, b"".join(epoch(second, 1 if second < 2 else 0) for second in range(4)))
    assert read.times(topic) == true_times(4) and "told a date 1 week before" in read.remark("week_number")


def test_a_date_that_is_late_at_midnight(tmp_path: Path) -> None:
    """GGA has no date, and RMC keeps that of yesterday for ten seconds."""
    content = b""
    for second in range(40):
        time = utc_ns_to_iso(iso_to_utc_ns("2024-05-06T23:59:50Z")[0] + second * NS_PER_S, 0)[11:19].replace(":", "")
        content += gga(f"{time}.00") + rmc(f"{time}.00", "060524" if second < 20 else "070524")
    times = Read(tmp_path, content).times("gnss")
    assert times[9:12] == [f"2024-05-{end}.000000000Z" for end in ("06T23:59:59", "07T00:00:00", "07T00:00:01")]
    assert times[-1] == "2024-05-07T00:00:29.000000000Z"


@pytest.mark.parametrize("days", [0.5, 6.99, 20.3])
def test_two_power_ups_keep_their_days(tmp_path: Path, days: float) -> None:
    """A gap that is no number of whole days is one."""
    content = b"".join(of_nmea(second + (days * 86_400 if second >= 15 else 0), 0) for second in range(EPOCHS))
    read = Read(tmp_path, content)
    assert read.times("gnss")[14:16] == [
        utc_ns_to_iso(iso_to_utc_ns(stamp(at))[0], 9) for at in (14, 15 + days * 86_400)
    ]
    assert not read.remark("week_number")


# --- leap seconds


@pytest.mark.parametrize("late_s", [2, 3, 18])
@pytest.mark.parametrize(("rate_hz", "learnt"), [(1, 40), (5, 100), (10, 7)])
def test_leap_seconds_learnt_in_a_stream_of_sentences(tmp_path: Path, late_s: int, rate_hz: int, learnt: int) -> None:
    count = learnt + 40
    epochs = [of_nmea(at / rate_hz, 0, late_s if at < learnt else 0) for at in range(count)]
    for content in (b"".join(epochs), b"".join(_dated_first(one) for one in epochs)):
        read = Read(tmp_path, content)
        truth = [utc_ns_to_iso(START_NS + round(at / rate_hz * 1e9) // 10**7 * 10**7, 9) for at in range(count)]
        assert read.times("gnss") == truth and read.times("raw.GNRMC") == truth
        assert f"sentences told UTC {late_s} s late" in read.remark("leap_seconds")


def _dated_first(epoch: bytes) -> bytes:
    """RMC before GGA."""
    first, second = epoch.split(b"\r\n")[:2]
    return second + b"\r\n" + first + b"\r\n"


def test_sentences_out_of_order_are_no_leap_seconds(tmp_path: Path) -> None:
    order = [*range(20), 22, 20, 21, *range(23, 40)]
    read = Read(tmp_path, b"".join(of_nmea(second, 0) for second in order))
    assert sorted(map(str, read.times("gnss"))) == true_times(40) and not read.remark("leap_seconds")


# --- rollovers


def rolled(epoch: Epoch) -> bytes:
    return b"".join(epoch(second, 1024) for second in range(EPOCHS))


PUBX = nmea("PUBX,04,100000.00,200904,122417.00,1289,18,53,0.5,21")
PUBX_DEFAULT = nmea("PUBX,04,100000.00,200904,122417.00,1289,18D,53,0.5,21")
GARMIN = nmea("PGRMF,265,122417,200904,100000,18,5130.0,N,00042.0,W,A,2,0,0,2,1")
HARDWARE = nmea("GNTXT,01,01,02,HW UBX-M8030 00080000")
TIME = of_novatel(0, 1024, "TIME", utc_offset=-18.0, utc_status=1)


@pytest.mark.parametrize(
    ("content", "topic", "why"),
    [
        (rolled(of_pvt), "gnss", "18 leap seconds are stated, and that day had 13"),
        (rolled(of_timegps), "gnss", "18 leap seconds"),
        (rolled(of_rawx), "gnss", "18 leap seconds"),
        (TIME + rolled(of_novatel), "gnss", "18 leap seconds"),
        (TIME + rolled(of_novatel_text), "ins", "18 leap seconds"),
        (PUBX + rolled(of_nmea), "gnss", "18 leap seconds"),
        (PUBX_DEFAULT + rolled(of_nmea), "gnss", "18 leap seconds"),
        (GARMIN + rolled(of_nmea), "gnss", "18 leap seconds"),
        (HARDWARE + rolled(of_nmea), "gnss", "hardware (00080000) came in 2013"),
        (rolled(lambda second, weeks: of_pvt(second, weeks) + of_nmea(second, 0)), "gnss", "18 leap seconds"),
        (rolled(lambda second, weeks: of_novatel(second, weeks) + of_nmea(second, 0)), "gnss", "other protocol"),
    ],
    ids=["pvt", "timegps", "rawx", "novatel", "text", "pubx", "default", "garmin", "txt", "ubx+nmea", "novatel+nmea"],
)
def test_a_rollover_is_put_right_where_the_stream_shows_it(
    tmp_path: Path, content: bytes, topic: str, why: str
) -> None:
    read = Read(tmp_path, content)
    assert read.times(topic) == true_times()
    assert why in read.remark("week_rollover") and "read as 2024-05-06" in read.remark("week_rollover")
    assert not read.remark("leap_seconds")


def test_sentences_beside_rolled_over_messages_have_the_same_time(tmp_path: Path) -> None:
    for weeks in (0, 1024):
        content = b"".join(of_pvt(second, 1024) + of_nmea(second, weeks) for second in range(EPOCHS))
        read = Read(tmp_path, content)
        assert read.times("raw.NAV-PVT") == read.times("raw.GNRMC") == true_times()


def test_a_date_that_nothing_contradicts_is_kept(tmp_path: Path) -> None:
    read = Read(tmp_path, rolled(of_nmea))
    assert read.times("gnss")[0] == utc_ns_to_iso(START_NS - ROLLOVER_NS, 9) and not read.remark("week_rollover")


def test_default_leap_seconds_are_no_rollover(tmp_path: Path) -> None:
    """A receiver that takes 16 leap seconds for 18 tells a time of its own day."""
    content = b"".join(pvt(stamp(second, late_s=2), itow=week_ms(stamp(second))) for second in range(EPOCHS))
    read = Read(tmp_path, content)
    assert read.times("gnss") == true_times() and not read.remark("week_rollover")
    assert "30 fixes told UTC 2 s late" in read.remark("leap_seconds")
