"""Streams of satellite receivers: frames of several protocols, epochs, times, attitude, damage."""

from pathlib import Path

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import GroundstationError, NotAssessableError
from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.timescales import iso_to_utc_ns, utc_ns_to_iso
from groundstation.readers import registry
from groundstation.readers.receiver import stream
from tests.readers.receiver_writer import gga, nmea, pvt, rmc, rtcm, ubx, ubx_frame, week_ms
from tests.readers.test_contract import check

NOON = "2026-05-04T12:00:00Z"


class Read:
    """What a stream was read as; every stream passes the contract of readers."""

    def __init__(self, folder: Path, content: bytes) -> None:
        path = folder / "stream.ubx"
        path.write_bytes(content)
        self.items: list[Item] = list(registry.read(path))
        check(self.items)

    @property
    def header(self) -> LogHeader:
        first = self.items[0]
        assert isinstance(first, LogHeader)
        return first

    def batches(self, topic: str) -> list[RecordBatch]:
        return [item for item in self.items if isinstance(item, RecordBatch) and item.topic == topic]

    def values(self, topic: str, name: str) -> list[object]:
        """Values of a column, None where absent."""
        found: list[object] = []
        for batch in self.batches(topic):
            column = batch.columns.get(name)
            if column is None:
                found += [None] * len(batch)
            else:
                found += [
                    value if there else None for value, there in zip(column.values.tolist(), column.mask, strict=True)
                ]
        return found

    def times(self, topic: str) -> list[str | None]:
        return [
            utc_ns_to_iso(time, 9) if there else None
            for batch in self.batches(topic)
            for time, there in zip(batch.device_time_ns.values.tolist(), batch.device_time_ns.mask, strict=True)
        ]

    @property
    def damages(self) -> list[Damage]:
        return [item for item in self.items if isinstance(item, Damage)]

    def remark(self, code: str) -> str:
        return next((item.text for item in self.items if isinstance(item, Remark) and item.code == code), "")


# --- frames


def test_protocols_in_one_stream_and_what_belongs_to_none(tmp_path: Path) -> None:
    bad = bytearray(pvt("2026-05-04T12:00:01Z"))
    bad[40] ^= 4
    content = pvt(NOON) + rtcm(1077) + gga("120000.00") + b"noise!" + bytes(bad) + rtcm(1077) + rtcm(1230)
    read = Read(tmp_path, content + pvt("2026-05-04T12:00:02Z") + pvt("2026-05-04T12:00:03Z")[:50])
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:02.000000000Z"]
    assert "3 frames of RTCM 3 are not read (by message 1077: 2, 1230: 1)" in read.remark("skipped")
    assert [(one.kind, one.count) for one in read.damages] == [("corrupt", 6 + len(bad)), ("truncated", 50)]
    assert read.values("raw.GNGGA", "lat") == [51.5] and "the sentences" in read.remark("mapped")


def test_a_frame_inside_a_damaged_one_is_found(tmp_path: Path) -> None:
    """A length that damage made long takes the frames behind it along in a reader that believes it."""
    damaged = bytearray(pvt(NOON))
    damaged[5] = 0x40  # 16 kB longer
    seconds = [f"2026-05-04T12:00:{second:02d}Z" for second in range(1, 4)]
    read = Read(tmp_path, pvt("2026-05-04T11:59:59Z") + bytes(damaged) + b"".join(pvt(utc) for utc in seconds))
    assert len(read.times("gnss")) == 4 and sum(one.count for one in read.damages) == len(damaged)


def test_blocks_cut_no_epoch_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def epoch(second: int) -> bytes:
        utc = f"2026-05-04T12:{second // 60:02d}:{second % 60:02d}Z"
        dop = ubx("NAV-DOP", iTOW=week_ms(utc), gDOP=150 + second % 7)
        return pvt(utc) + ubx_frame(0x0213, bytes(40)) + dop

    content = b"".join(epoch(second) for second in range(1200)) + b"?" * 30 + epoch(1201)
    whole = Read(tmp_path, content)
    monkeypatch.setattr(stream, "BLOCK_BYTES", 30_011)
    pieces = Read(tmp_path, content)
    assert len(pieces.batches("gnss")) > 3
    for topic, name in (("gnss", "gdop"), ("gnss", "latitude_deg"), ("raw.RXM-SFRBX", "svId")):
        assert whole.values(topic, name) == pieces.values(topic, name) and None not in whole.values(topic, name)
        assert whole.times(topic) == pieces.times(topic)
    assert [str(one) for one in whole.damages] == [str(one) for one in pieces.damages] and len(whole.damages) == 1


def test_epochs_of_sentences_are_not_cut_apart_either(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def epoch(second: int) -> bytes:
        time = f"12{second // 60:02d}{second % 60:02d}.00"
        return gga(time) + rmc(time, "040526", speed_mps=second / 10)

    content = b"".join(epoch(second) for second in range(1500))
    whole = Read(tmp_path, content)
    monkeypatch.setattr(stream, "BLOCK_BYTES", 30_011)
    pieces = Read(tmp_path, content)
    assert len(pieces.batches("gnss")) > 3 and whole.times("gnss") == pieces.times("gnss")
    assert whole.values("gnss", "ground_speed_mps") == pieces.values("gnss", "ground_speed_mps")


def test_a_message_that_is_not_known_keeps_its_bytes(tmp_path: Path) -> None:
    payload = bytes(range(256)) * 5
    read = Read(tmp_path, pvt(NOON) + ubx_frame(0x7711, payload) + ubx_frame(0x0107, bytes(84)))
    assert "".join(str(piece) for piece in read.values("raw.UBX-77-11", "payload")) == payload.hex()
    assert read.values("raw.UBX-77-11", "piece") == [0.0, 1.0, 2.0]
    assert read.values("raw.NAV-PVT.84", "numSV") == [0], "an older version stands beside the newer"


def test_rtcm_alone_is_no_log(tmp_path: Path) -> None:
    with pytest.raises(GroundstationError):
        Read(tmp_path, rtcm(1077) * 50)


# --- times


def test_nanoseconds_may_be_negative(tmp_path: Path) -> None:
    read = Read(tmp_path, pvt(NOON, nano=-250_457, itow=week_ms(NOON)))
    assert read.times("gnss") == ["2026-05-04T11:59:59.999749543Z"]


def test_leap_seconds_of_a_receiver_without_an_almanac(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    content = pvt("2026-05-04T12:00:02Z", itow=itow) + pvt("2026-05-04T12:00:01Z", itow=itow + 1000)
    read = Read(tmp_path, content)
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:01.000000000Z"]
    assert "1 fix told UTC 2 s late" in read.remark("leap_seconds")


def test_the_week_rolls_over_between_two_messages(tmp_path: Path) -> None:
    """Sunday 00:00 GPS time is 23:59:42 UTC of Saturday; NAV-DOP tells no week."""
    content = pvt("2026-05-09T23:59:41Z", itow=604_799_000)
    content += ubx("NAV-DOP", iTOW=604_799_000, gDOP=150) + ubx("NAV-DOP", iTOW=0, gDOP=160)
    read = Read(tmp_path, content + pvt("2026-05-09T23:59:42Z", itow=0))
    assert read.times("raw.NAV-DOP") == ["2026-05-09T23:59:41.000000000Z", "2026-05-09T23:59:42.000000000Z"]
    assert read.times("gnss") == read.times("raw.NAV-DOP")


def test_times_before_the_clock_was_set_are_absent(tmp_path: Path) -> None:
    unset = pvt("2015-10-18T00:00:00Z", itow=12_000, valid=0, fixType=0, flags=0)
    read = Read(tmp_path, unset + pvt(NOON))
    assert read.times("raw.NAV-PVT") == [None, "2026-05-04T12:00:00.000000000Z"]
    assert read.values("gnss", "fix") == ["none", "3d"] and read.values("gnss", "latitude_deg") == [None, 51.5]


def test_midnight_and_the_date_that_came_before_it(tmp_path: Path) -> None:
    content = gga("235959.00") + rmc("235959.00", "311225") + gga("000000.00") + gga("000001.00")
    read = Read(tmp_path, content)
    expected = ["2025-12-31T23:59:59", "2026-01-01T00:00:00", "2026-01-01T00:00:01"]
    assert read.times("gnss") == [f"{time}.000000000Z" for time in expected]


def test_the_date_of_zda_serves_as_well_and_two_digits_of_a_year_are_of_this_century(tmp_path: Path) -> None:
    read = Read(tmp_path, gga("120000.00") + nmea("GPZDA,120000.00,04,05,2026,00,00"))
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z"]
    assert Read(tmp_path, rmc("120000", "040598")).times("gnss") == ["1998-05-04T12:00:00.000000000Z"]


def test_without_a_date_there_is_no_utc(tmp_path: Path) -> None:
    read = Read(tmp_path, gga("235959.50") + gga("000000.00"))
    assert read.header.utc_of_zero_ns is None
    times = np.concatenate([batch.device_time_ns.values for batch in read.batches("gnss")])
    assert times.tolist() == [86_399_500_000_000, 86_400_000_000_000]


def test_a_date_of_the_wrong_week_is_told(tmp_path: Path) -> None:
    read = Read(tmp_path, pvt(NOON) + rmc("120000.00", "180906"))  # 1024 weeks earlier
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z"]
    assert "the binary ones are believed" in read.remark("date_disagrees")


# --- what is canonical


def test_sentences_of_one_epoch_are_one_row(tmp_path: Path) -> None:
    second = [
        gga("120000.50", quality=4),
        nmea("GNGSA,A,3,01,02,03,04,,,,,,,,,1.50,0.90,1.20"),
        nmea("GNGST,120000.50,,,,,0.030,0.040,0.080"),
        nmea("GNRMC,120000,A,5130.00000,N,00042.00000,W,19.438444924,090.0,040526,,,R"),  # its fraction is cut off
    ]
    read = Read(tmp_path, b"".join(second) + gga("120001.00", quality=5))
    assert read.times("gnss") == ["2026-05-04T12:00:00.500000000Z", "2026-05-04T12:00:01.000000000Z"]
    row = {name: read.values("gnss", name)[0] for batch in read.batches("gnss") for name in batch.columns}
    assert row["latitude_deg"] == 51.5 and row["longitude_deg"] == -0.7
    assert row["altitude_msl_m"] == 100.0 and row["altitude_ellipsoid_m"] == 147.0
    assert row["velocity_east_mps"] == pytest.approx(10.0) and row["velocity_north_mps"] == pytest.approx(0.0, abs=1e-8)
    assert row["pdop"] == 1.5 and row["hdop"] == 0.8 and row["satellites_used"] == 12.0
    assert row["horizontal_sigma_m"] == pytest.approx(0.05) and row["vertical_sigma_m"] == 0.08
    assert read.values("gnss", "fix") == ["rtk_fixed", "rtk_float"] and row["integrity_ok"] is True


def test_no_fix_gives_no_position(tmp_path: Path) -> None:
    content = gga("120000.00", quality=0) + rmc("120000.00", "040526", status="V") + gga("120001.00")
    read = Read(tmp_path, content)
    assert read.values("gnss", "latitude_deg") == [None, 51.5] and read.values("gnss", "integrity_ok") == [False, True]
    assert read.values("gnss", "ground_speed_mps") == [None, None]


def test_a_separation_that_no_geoid_has(tmp_path: Path) -> None:
    content = nmea("GNGGA,120000.00,5130.0,N,00042.0,W,1,12,0.8,0.00,M,1382.35,M,,") + rmc("120000.00", "040526")
    read = Read(tmp_path, content)
    assert read.values("gnss", "altitude_ellipsoid_m") == [1382.35] and read.values("gnss", "altitude_msl_m") == [None]
    assert "in 1 row, as the receiver says" in read.remark("odd_height")


def test_high_precision_position_and_dilution_of_the_same_epoch(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    finer = ubx(
        "NAV-HPPOSLLH", iTOW=itow, lat=515_000_000, latHp=-37, lon=-7_000_000, lonHp=12, height=100_000, heightHp=-4
    )
    other = ubx("NAV-HPPOSLLH", iTOW=itow + 1000, flags=1, lat=1, lon=1)
    content = pvt(NOON, hAcc=20) + finer + ubx("NAV-DOP", iTOW=itow, gDOP=213, hDOP=80)
    read = Read(tmp_path, content + pvt("2026-05-04T12:00:01Z") + other)
    assert read.values("gnss", "latitude_deg") == [51.499999963, 51.5]
    assert read.values("gnss", "longitude_deg") == [-0.699999988, -0.7]
    assert read.values("gnss", "altitude_ellipsoid_m")[0] == pytest.approx(99.9996, abs=1e-9)
    assert read.values("gnss", "gdop") == [2.13, None] and read.values("gnss", "hdop") == [0.8, None]


def test_older_receivers_tell_position_velocity_and_status_apart(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    content = ubx("NAV-TIMEGPS", iTOW=itow, week=2417, valid=7) + ubx("NAV-POSLLH", iTOW=itow, lat=515_000_000, lon=1)
    content += ubx("NAV-VELNED", iTOW=itow, velN=-150, velE=20, velD=7, gSpeed=151, heading=17_240_000, sAcc=12)
    read = Read(tmp_path, content + ubx("NAV-STATUS", iTOW=itow, gpsFix=3, flags=1))
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z"]
    assert read.values("gnss", "velocity_north_mps") == [-1.5] and read.values("gnss", "track_deg") == [172.4]
    assert read.values("gnss", "fix") == ["3d"] and read.values("gnss", "integrity_ok") == [True]


def relative(flags: int) -> bytes:
    return ubx("NAV-RELPOSNED", iTOW=week_ms(NOON), version=1, relPosHeading=35_912_345, accHeading=21_000, flags=flags)


def test_heading_of_two_antennas_on_the_vehicle(tmp_path: Path) -> None:
    moving = 1 | 1 << 2 | 2 << 3 | 1 << 5 | 1 << 8
    read = Read(tmp_path, pvt(NOON) + relative(moving))
    assert read.values("ins", "true_heading_deg") == [359.12345] and read.values("ins", "mode") == ["gnss_aided"]
    assert read.values("ins", "true_heading_sigma_deg") == [0.21]
    assert read.header.metadata["ins_kind"] == "gnss_aided"


def test_the_bearing_of_a_base_on_the_ground_is_no_heading(tmp_path: Path) -> None:
    fixed_base = 1 | 1 << 2 | 2 << 3 | 1 << 8
    read = Read(tmp_path, pvt(NOON) + relative(fixed_base))
    assert not read.batches("ins") and "ins_kind" not in read.header.metadata
    assert read.values("raw.NAV-RELPOSNED", "relPosHeading") == [359.12345]


def test_attitude_of_a_filter_with_inertial_sensors(tmp_path: Path) -> None:
    itow = week_ms(NOON)
    known = ubx("NAV-ATT", iTOW=itow, roll=-150_000, pitch=250_000, heading=36_000_000, accRoll=1, accHeading=50_000)
    rates = ubx("ESF-INS", iTOW=itow, flags=1 | 7 << 8, xAngRate=1500, zAngRate=-2000)
    read = Read(tmp_path, pvt(NOON) + known + rates)
    assert read.values("ins", "roll_deg") == [-1.5] and read.values("ins", "true_heading_deg") == [0.0]
    assert read.values("ins", "pitch_deg") == [None], "an accuracy of zero says that the angle is not known"
    assert read.values("ins", "rate_x_dps") == [1.5] and read.values("ins", "rate_z_dps") == [-2.0]


@pytest.mark.parametrize("apart_deg", [0.0, 0.5])
def test_a_heading_that_is_the_track_is_told(tmp_path: Path, apart_deg: float) -> None:
    heading = 9_000_000
    vehicle = {"vehHeading": heading + round(apart_deg * 1e5), "motHeading": heading, "gSpeed": 5_000, "accHeading": 60}
    flags = 1 | 1 << 5
    fixes = [
        ubx("NAV-PVAT", iTOW=week_ms(NOON) + at * 1000, fixType=4, flags=flags, lat=1, lon=1, **vehicle)
        for at in range(9)
    ]
    read = Read(tmp_path, pvt("2026-05-04T11:59:59Z") + b"".join(fixes))
    assert ("same in 9 of 9" in read.remark("heading_is_track")) == (apart_deg == 0.0)
    assert read.values("ins", "true_heading_deg")[0] == 90.0 + apart_deg
    if apart_deg == 0.0:
        (tmp_path / "track.ubx").write_bytes(pvt("2026-05-04T11:59:59Z") + b"".join(fixes))
        with pytest.raises(NotAssessableError, match="the heading of ins is the receiver's own track"):
            groundstation.open(tmp_path / "track.ubx").heading()


@pytest.mark.parametrize(
    ("sentence", "field", "heading"),
    [
        ("GPHDT,360.0,T", "true_heading_deg", 0.0),
        ("HEHDT,12.5,T", "true_heading_deg", 12.5),
        ("GNTHS,77.25,A", "true_heading_deg", 77.25),
        ("GNTHS,77.25,V", "true_heading_deg", None),
        ("HCHDM,200.0,M", "magnetic_heading_deg", 200.0),
    ],
)
def test_headings_are_true_or_magnetic_as_the_sentence_says(
    tmp_path: Path, sentence: str, field: str, heading: float | None
) -> None:
    read = Read(tmp_path, gga("120000.00") + rmc("120000.00", "040526") + nmea(sentence))
    assert read.values("ins", field) == ([] if heading is None else [heading])
    other = {"true_heading_deg", "magnetic_heading_deg"} - {field}
    assert read.values("ins", other.pop()) in ([], [None])


def test_pashr(tmp_path: Path) -> None:
    text = "PASHR,120000.00,301.50,T,-1.25,2.50,0.10,0.021,0.022,0.031,2,1"
    read = Read(tmp_path, gga("120000.00") + rmc("120000.00", "040526") + nmea(text))
    assert read.values("ins", "roll_deg") == [-1.25] and read.values("ins", "pitch_deg") == [2.5]
    assert read.values("ins", "true_heading_deg") == [301.5] and read.values("ins", "true_heading_sigma_deg") == [0.031]
    assert read.times("ins") == ["2026-05-04T12:00:00.000000000Z"]


# --- sentences


def test_numbers_that_are_none_and_fields_that_are_empty(tmp_path: Path) -> None:
    content = gga("120000.00") + nmea("GNGGA,120001.00,51x0.0,N,,,1,12,0.8,100.0,M,47.0,M,,") + nmea("GNGGA,1")
    read = Read(tmp_path, content)
    assert read.values("raw.GNGGA", "lat") == [51.5, None, None]
    assert ("unreadable_cells", "raw.GNGGA.lat") in [(one.kind, one.place) for one in read.damages]


def test_sentences_without_a_checksum(tmp_path: Path) -> None:
    bare = [line.split(b"*")[0] + b"\r\n" for line in (gga("120000.00"), rmc("120000.00", "040526"))]
    read = Read(tmp_path, b"".join(bare) * 3)
    assert len(read.values("raw.GNRMC", "spd")) == 3 and "not seen" in read.remark("no_checksum")
    mixed = Read(tmp_path, gga("120000.00") * 3 + bare[1])
    assert not mixed.batches("raw.GNRMC") and mixed.damages, "where others have one, its lack is damage"


def test_satellites_in_view_with_and_without_a_signal(tmp_path: Path) -> None:
    content = nmea("GBGSV,2,2,06,14,55,175,46,40,29,043,18,B") + nmea("GPGSV,1,1,01,14,55,175,")
    read = Read(tmp_path, content + gga("120000.00"))
    assert read.values("raw.GBGSV", "signalID") == ["B"] and read.values("raw.GBGSV", "svid_03") == [None]
    assert read.values("raw.GPGSV", "svid_01") == [14.0] and read.values("raw.GPGSV", "cno_01") == [None]
    assert not read.damages


def test_utc_of_the_first_fix_is_that_of_the_receiver(tmp_path: Path) -> None:
    read = Read(tmp_path, pvt(NOON, nano=749_542_955, itow=week_ms(NOON) + 750))
    assert read.batches("gnss")[0].device_time_ns.values[0] == iso_to_utc_ns("2026-05-04T12:00:00.749542955Z")[0]
