"""Solutions that a receiver tells: of which message, in how many dimensions, measured or not, and where none is."""

from pathlib import Path
from typing import Any

import pytest

from tests.readers.receiver_writer import gga, nmea, novatel, pvt, rmc, ubx, ubx_frame, week_ms
from tests.readers.test_receiver import NOON, Read

LATER = "2026-05-04T12:00:01Z"
FLAT = nmea("GNGSA,A,2,01,02,03,,,,,,,,,,3.0,2.0,1.0")
UPRIGHT = nmea("GNGSA,A,3,01,02,03,04,,,,,,,,,3.0,2.0,1.0")


def second_solution(utc: str, **members: Any) -> bytes:
    return ubx_frame(0x2907, pvt(utc, **members)[6:-2])


def high_rate(utc: str, **members: int | float) -> bytes:
    date = {"year": 2026, "month": 5, "day": 4, "hour": 12, "second": int(utc[-3:-1])}
    usual = {"valid": 7, "gpsFix": 3, "flags": 1, "lat": 515_000_000, "lon": -7_000_000, "gSpeed": 10_000}
    return ubx("HNR-PVT", iTOW=week_ms(utc), **(usual | date | members))


# --- several solutions of one receiver


def test_a_stream_of_the_second_solution_alone_gives_its_fixes(tmp_path: Path) -> None:
    dop = ubx_frame(0x2904, ubx("NAV-DOP", iTOW=week_ms(NOON), gDOP=150)[6:-2])
    read = Read(tmp_path, second_solution(NOON) + dop + second_solution(LATER, fixType=0, flags=0))
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:01.000000000Z"]
    assert read.values("gnss", "latitude_deg") == [51.5, None] and read.values("gnss", "gdop") == [1.5, None]
    assert read.remark("mapped") == "gnss from NAV2-PVT with NAV2-DOP of the same epoch"
    assert not read.remark("no_position")


def test_the_second_solution_stays_raw_beside_the_first(tmp_path: Path) -> None:
    """It is of the same antenna and measurements: as a second receiver it would look like one that agrees."""
    other = ubx_frame(0x2904, ubx("NAV-DOP", iTOW=week_ms(NOON), gDOP=990)[6:-2])
    read = Read(tmp_path, second_solution(NOON, lat=520_000_000) + pvt(NOON) + other)
    assert read.values("gnss", "latitude_deg") == [51.5] and read.values("gnss", "gdop") == [None]
    assert read.values("raw.NAV2-PVT", "lat") == [52.0]
    assert "NAV2-PVT (1) stays raw: the receiver's second solution" in read.remark("skipped")


def test_a_stream_of_the_high_rate_solution_alone_gives_its_fixes(tmp_path: Path) -> None:
    content = high_rate(NOON, headMot=9_000_000, sAcc=150) + high_rate(LATER, gpsFix=0, flags=0)
    read = Read(tmp_path, content)
    assert read.times("gnss")[0] == "2026-05-04T12:00:00.000000000Z" and read.values("gnss", "fix") == ["3d", "none"]
    assert read.values("gnss", "velocity_east_mps") == [pytest.approx(10.0), None]
    assert read.values("gnss", "latitude_deg") == [51.5, None] and read.values("gnss", "velocity_sigma_mps")[0] == 0.15
    assert read.remark("derived").endswith("derived from ground speed and track") and not read.batches("ins")


def test_attitude_of_the_high_rate_solution(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    attitude = ubx("NAV-ATT", iTOW=itow, roll=-150_000, heading=9_000_000, accRoll=1, accHeading=50_000)[6:-2]
    rates = ubx("ESF-INS", iTOW=itow, flags=7 << 8, zAngRate=-2000)[6:-2]
    read = Read(tmp_path, high_rate(NOON) + ubx_frame(0x2801, attitude) + ubx_frame(0x2802, rates))
    assert read.values("ins", "true_heading_deg") == [90.0] and read.values("ins", "rate_z_dps") == [-2.0]
    assert read.header.metadata["ins_kind"] == "gnss_aided"
    fused = Read(tmp_path, high_rate(NOON, flags=1 | 1 << 4, headVeh=4_500_000))
    assert fused.values("ins", "true_heading_deg") == [45.0]


def test_a_stream_that_tells_no_week_has_times_of_the_week(tmp_path: Path) -> None:
    """As sentences without a date have times of the day: no absolute time, and nothing is lost."""
    last, first = 604_799_000, 0
    content = b"".join(
        ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=1)
        + ubx_frame(0x2801, ubx("NAV-ATT", iTOW=itow, heading=9_000_000, accHeading=1)[6:-2])
        for itow in (last, first)
    )
    read = Read(tmp_path, content)
    assert read.header.utc_of_zero_ns is None and read.values("gnss", "latitude_deg") == [51.5, 51.5]
    for topic in ("gnss", "ins"):
        (batch,) = read.batches(topic)
        assert batch.device_time_ns.values.tolist() == [604_799 * 10**9, 604_800 * 10**9]


def test_the_first_solution_leads_the_high_rate_one(tmp_path: Path) -> None:
    read = Read(tmp_path, b"".join(high_rate(NOON, lat=520_000_000 + k) for k in range(3)) + pvt(NOON))
    assert read.values("gnss", "latitude_deg") == [51.5] and "HNR-PVT (3) stays raw" in read.remark("skipped")


def test_a_dilution_of_9999_is_none(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    read = Read(tmp_path, pvt(NOON, pDOP=9999) + ubx("NAV-DOP", iTOW=itow, gDOP=9999, hDOP=9998))
    assert read.values("gnss", "pdop") == [None] and read.values("gnss", "gdop") == [None]
    oem = novatel("BESTPOS", 129_618_000, latitude=51.5) + novatel("PSRDOP", 129_618_000, gdop=9999.0, hdop=1.5)
    read = Read(tmp_path, oem)
    assert read.values("gnss", "gdop") == [None] and read.values("gnss", "hdop") == [1.5]


def test_an_integrated_navigation_beside_a_receiver_stays_raw(tmp_path: Path) -> None:
    other = gga("120000.00", "5230.00000,N").replace(b"GNGGA", b"INGGA")
    other = nmea(other[1:-5].decode())
    read = Read(tmp_path, gga("120000.00") + other + rmc("120000.00", "040526"))
    assert read.values("gnss", "latitude_deg") == [51.5] and "INGGA" in read.remark("skipped")
    assert Read(tmp_path, other + other).values("gnss", "latitude_deg") == [52.5]


def test_one_address_gives_the_heading_of_a_whole_stream(tmp_path: Path) -> None:
    compass = b"".join(nmea(f"HEHDT,{100 + k}.0,T") for k in range(2))
    receiver = b"".join(nmea(f"GPHDT,{200 + k}.0,T") for k in range(3))
    read = Read(tmp_path, gga("120000.00") + rmc("120000.00", "040526") + compass + receiver)
    assert read.values("ins", "true_heading_deg") == [200.0, 201.0, 202.0]


def test_an_empty_heading_gives_way_to_one_that_is_there(tmp_path: Path) -> None:
    dated = gga("120000.00") + rmc("120000.00", "040526")
    for empty in ("PASHR,120000.00,,,,,,,,,0,0", "PASHR,120000.00,77.0,M,1.0,1.0,,.1,.1,.1,2,1"):
        read = Read(tmp_path, dated + nmea(empty) + nmea("GNHDT,12.5,T"))
        assert read.values("ins", "true_heading_deg") == [12.5]


# --- two dimensions


def test_a_fix_in_two_dimensions_has_no_integrity(tmp_path: Path) -> None:
    """Its height was assumed, so that it is neither good nor bad: absent."""
    read = Read(tmp_path, pvt(NOON, fixType=2) + pvt(LATER) + pvt("2026-05-04T12:00:02Z", fixType=2, flags=0))
    assert read.values("gnss", "integrity_ok") == [None, True, False] and read.values("gnss", "fix")[0] == "2d"
    sentences = Read(
        tmp_path, gga("120000.00") + FLAT + gga("120001.00") + UPRIGHT + gga("120002.00", quality=0) + FLAT
    )
    assert sentences.values("gnss", "integrity_ok") == [None, True, False]
    assert sentences.values("gnss", "fix") == ["2d", "3d", "none"]
    assert sentences.values("gnss", "altitude_msl_m") == [None, 100.0, None]
    with_status = Read(tmp_path, gga("120000.00") + rmc("120000.00", "040526") + FLAT)
    assert with_status.values("gnss", "integrity_ok") == [None]
    text: dict[str, Any] = {"latitude": 51.5, "longitude": -0.7, "num_soln_svs": 3, "orthometric_height": 100.0}
    oem = Read(
        tmp_path,
        novatel("BESTPOS", 129_618_000, position_type=2, **text)
        + novatel("BESTPOS", 129_619_000, position_type=16, **text),
    )
    assert oem.values("gnss", "integrity_ok") == [None, True] and oem.values("gnss", "altitude_msl_m") == [None, 100.0]


def test_older_receivers_tell_the_fix_apart_from_the_position(tmp_path: Path) -> None:
    def epoch(utc: str, **solution: int) -> bytes:
        itow = week_ms(utc)
        place = ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=-7_000_000, height=100_000)
        return place + ubx("NAV-SOL", iTOW=itow, numSV=7, pDOP=210, **solution)

    clock = ubx("NAV-TIMEGPS", iTOW=week_ms(NOON), week=2417, valid=7)
    content = (
        clock
        + epoch(NOON, gpsFix=0)
        + epoch(LATER, gpsFix=2, flags=1)
        + epoch("2026-05-04T12:00:02Z", gpsFix=3, flags=1)
    )
    read = Read(tmp_path, content)
    assert read.values("gnss", "latitude_deg") == [None, 51.5, 51.5], "without a fix it is the last known place"
    assert read.values("gnss", "altitude_ellipsoid_m") == [None, None, 100.0]
    assert (
        read.values("gnss", "integrity_ok") == [False, None, True]
        and read.values("gnss", "satellites_used") == [7.0] * 3
    )


# --- measured or not


@pytest.mark.parametrize(
    ("quality", "fix", "integrity"),
    [
        (0, "none", False),
        (1, "3d", True),
        (2, "dgnss", True),
        (4, "rtk_fixed", True),
        (5, "rtk_float", True),
        (6, "dead_reckoning", False),
        (7, "manual", False),
        (8, "simulated", False),
        (9, "dgnss", True),
        (12, "other", None),
        (-1, "other", None),
    ],
)
def test_qualities(tmp_path: Path, quality: int, fix: str, integrity: bool | None) -> None:
    read = Read(tmp_path, gga("120000.00", quality=quality))
    assert read.values("gnss", "fix") == [fix] and read.values("gnss", "integrity_ok") == [integrity]
    assert ("1 fix is simulated" in read.remark("not_measured")) == (fix in ("manual", "simulated"))


@pytest.mark.parametrize(
    ("mode", "status", "fix", "integrity"),
    [
        ("A", "A", "3d", True),
        ("D", "A", "dgnss", True),
        ("R", "A", "rtk_fixed", True),
        ("F", "A", "rtk_float", True),
        ("E", "A", "dead_reckoning", False),
        ("S", "A", "simulated", False),
        ("N", "A", "none", False),
        ("N", "V", "none", False),
        ("C", "A", "other", True),
        ("", "A", None, True),
    ],
)
def test_modes_of_rmc(tmp_path: Path, mode: str, status: str, fix: str | None, integrity: bool) -> None:
    text = f"GNRMC,120000.00,{status},5130.00000,N,00042.00000,W,19.4384,90.0,040526,,,{mode}"
    read = Read(tmp_path, nmea(text) + rmc("120001.00", "040526"))
    assert read.values("gnss", "fix")[0] == fix and read.values("gnss", "integrity_ok")[0] is integrity
    has_fix = mode != "N"
    assert read.values("gnss", "latitude_deg")[0] == (51.5 if has_fix else None)
    assert (read.values("gnss", "velocity_east_mps")[0] is not None) == has_fix


def test_modes_of_gns(tmp_path: Path) -> None:
    text = "GNGNS,12000{}.00,5130.00000,N,00042.00000,W,{},12,0.8,100.0,47.0,,"
    content = b"".join(nmea(text.format(at, mode)) for at, mode in enumerate(("NN", "AN", "AD", "RRNN", "EE")))
    read = Read(tmp_path, content)
    assert read.values("gnss", "fix") == ["none", "3d", "dgnss", "rtk_fixed", "dead_reckoning"]
    assert read.values("gnss", "latitude_deg") == [None] + 4 * [51.5]


# --- no position


def test_zero_zero_is_no_position(tmp_path: Path) -> None:
    zero = "0000.00000,N", "00000.00000,E"
    read = Read(tmp_path, gga("120000.00", *zero) + gga("120001.00", zero[0]) + gga("120002.00", longitude=zero[1]))
    assert read.values("gnss", "latitude_deg") == [None, 0.0, 51.5]
    assert read.values("gnss", "longitude_deg") == [None, -0.7, 0.0]
    assert read.values("raw.GNGGA", "lat") == [0.0, 0.0, 51.5]
    (damage,) = read.damages
    assert (damage.kind, damage.count, damage.place, damage.loses_data) == (
        *("no_position", 1, "gnss, the first at byte 0"),
        False,
    )


@pytest.mark.parametrize(
    "content",
    [
        pvt(NOON, lat=0, lon=0) + pvt(LATER),
        high_rate(NOON, lat=0, lon=0) + high_rate(LATER),
        ubx("NAV-TIMEGPS", iTOW=week_ms(NOON), week=2417, valid=7)
        + ubx("NAV-POSLLH", iTOW=week_ms(NOON), height=1)
        + ubx("NAV-POSLLH", iTOW=week_ms(LATER), lat=515_000_000, lon=1),
        novatel("BESTPOS", 129_618_000, num_soln_svs=9)
        + novatel("BESTPOS", 129_619_000, latitude=51.5, longitude=-0.7, num_soln_svs=9),
        novatel("BESTPOS", 129_618_000, latitude=float("nan"), longitude=0.0)
        + novatel("BESTPOS", 129_619_000, latitude=51.5, longitude=-0.7, num_soln_svs=9),
    ],
)
def test_zeros_of_every_protocol(tmp_path: Path, content: bytes) -> None:
    *before, last = Read(tmp_path, content).values("gnss", "latitude_deg")
    assert last == 51.5 and before in ([], [None]), "a row of which nothing is left is none"


@pytest.mark.parametrize(
    "content",
    [
        gga("120000.00", "0000.0,N", "00000.0,E")
        + nmea("GNRMC,120000.00,A,0000.0,N,00000.0,E,0.0,0.0,040526,,,A")
        + gga("120001.00"),
        pvt(NOON, lat=0, lon=0, hMSL=100_000, height=147_000, hAcc=9) + pvt(LATER),
        novatel("BESTPOS", 129_618_000, orthometric_height=100.0, num_soln_svs=9)
        + novatel("BESTPOS", 129_619_000, latitude=51.5, longitude=-0.7),
    ],
)
def test_what_goes_with_a_position_of_zeros(tmp_path: Path, content: bytes) -> None:
    read = Read(tmp_path, content)
    found = next(batch.columns for batch in read.batches("gnss"))
    for name in ("altitude_msl_m", "altitude_ellipsoid_m", "horizontal_sigma_m", "velocity_north_mps"):
        assert name not in found or not found[name].mask[0]
    assert not found["integrity_ok"].values[0] and found["satellites_used"].mask[0]


def test_zeros_of_an_inertial_solution(tmp_path: Path) -> None:
    known: dict[str, Any] = {"week": 2417, "seconds": 129_618.0, "ins_solution_status": 3, "azimuth": 90.0}
    read = Read(tmp_path, novatel("INSPVA", 129_618_000, **known))
    assert read.values("ins", "latitude_deg") == [None] and read.values("ins", "true_heading_deg") == [90.0]
    assert [(one.kind, one.topic) for one in read.damages] == [("no_position", "ins")]


def test_a_receiver_that_never_had_a_fix_is_told_with_its_rows_and_satellites(tmp_path: Path) -> None:
    content = b"".join(pvt(f"2026-05-04T12:00:{at:02d}Z", fixType=0, flags=0, numSV=at % 3) for at in range(20))
    read = Read(tmp_path, content)
    assert read.remark("no_position").startswith(
        "no position in this file: GNSS never had a fix: 20 rows, at most 2 satellites; NAV-PVT (20)"
    )
    bare = Read(tmp_path, ubx("NAV-ATT", iTOW=1))
    assert bare.remark("no_position") == "no position in this file: NAV-ATT (1)"
