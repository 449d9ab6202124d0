"""One address or number, several layouts: sentences by the word behind the address, messages by their length."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.records import RecordBatch
from groundstation.readers import registry
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.novatel_messages import LAYOUTS as NOVATEL_LAYOUTS
from groundstation.readers.receiver.novatel_messages import NAMES
from groundstation.readers.receiver.ubx_messages import LAYOUTS, is_version, layout_of, name_of
from tests.readers.receiver_writer import (
    gga,
    nmea,
    novatel,
    novatel_frame,
    novatel_text,
    pvt,
    rmc,
    ubx,
    ubx_frame,
    week_ms,
)
from tests.readers.test_receiver import NOON, Read
from tests.real_logs import real_log

DATED = gga("120000.00") + rmc("120000.00", "040526")
ATTITUDE = "PASHR,120000.00,301.50,T,-1.25,2.50,0.10,0.021,0.022,0.031,2,1"
OTHERS = (
    "PASHR,POS,3,14,120000.00,5130.0000000,N,00042.0000000,W,30.00,1.2,90.0,23.3,0.1,1.1,0.7,0.9,0.5,A101",
    "PASHR,ARR,1,3,12,160159.00,123.45,123.45,-123.45,12.34,12.34,12.34,2.34,2.34,-2.34,S,0,2,1",
    "PASHR,BTS,C,1,btsdev1,hs-344-fg,87,H,1,btsdev2,pc-377xs,68,T,0,,,",
    "PASHR,HPR,120000.00,123.4,1.0,2.0,0.1,0.1,0,0,FULL,1.2",
    "PASHR,ATT,12345.0,123.4,1.0,2.0,0.1,0.1,0",
    "PASHR,LTN,3",
    "PASHR,ACK",
)


def rows_of(read: Read, topic: str) -> int:
    return sum(len(batch) for batch in read.batches(topic))


def topics_of(read: Read, begin: str) -> set[str]:
    return {item.topic for item in read.items if isinstance(item, RecordBatch) and item.topic.startswith(begin)}


# --- sentences: the word behind a maker's address


def test_attitude_stands_only_in_the_layout_that_has_it(tmp_path: Path) -> None:
    read = Read(tmp_path, DATED + nmea(ATTITUDE) + b"".join(nmea(other) for other in OTHERS))
    assert read.values("ins", "true_heading_deg") == [301.5] and read.values("ins", "pitch_deg") == [2.5]
    assert rows_of(read, "raw.PASHR") == 1 and read.values("raw.PASHR", "roll") == [-1.25]
    for other in OTHERS:
        topic = ".".join(other.split(",")[:2])
        assert rows_of(read, f"raw.{topic}") == 1
    assert read.values("raw.PASHR.POS", "lat") == [51.5] and read.values("raw.PASHR.POS", "sog") == [23.3]
    assert read.values("raw.PASHR.ARR", "text") == [OTHERS[1].removeprefix("PASHR,ARR,")]
    assert not read.damages


@pytest.mark.parametrize(
    ("text", "roll"),
    [
        (ATTITUDE, -1.25),
        (ATTITUDE.replace("120000.00", "120000"), -1.25),
        (ATTITUDE.replace(",T,", ",M,"), None),
        (ATTITUDE.replace(",T,", ",,"), None),
        (ATTITUDE.replace("120000.00", ""), None),
        (ATTITUDE.replace("120000.00", "256199.00"), None),
        (ATTITUDE.replace("-1.25", "-180.01"), None),
        (ATTITUDE.replace("2.50", "90.5"), None),
        (ATTITUDE.replace("301.50", "450.0"), None),
        (ATTITUDE.replace(",2,1", ",0,0"), None),
        (ATTITUDE.replace(",2,1", ""), -1.25),
        (ATTITUDE.replace("301.50", "-58.5"), -1.25),
    ],
)
def test_attitude_by_what_the_sentence_says(tmp_path: Path, text: str, roll: float | None) -> None:
    """The whole attitude of a row is absent where its layout does not say so, or an angle of it cannot be."""
    read = Read(tmp_path, DATED + nmea(ATTITUDE) + nmea(text))
    expected = [-1.25] if roll is None else [-1.25, roll]
    assert read.values("ins", "roll_deg") == expected
    assert read.values("ins", "true_heading_deg") == [301.5] * len(expected)
    assert rows_of(read, "raw.PASHR") == 2, "raw keeps what was refused"


def test_attitudes_that_cannot_be_are_counted(tmp_path: Path) -> None:
    bad = nmea(ATTITUDE.replace("2.50", "100159.00"))
    read = Read(tmp_path, DATED + nmea(ATTITUDE) + bad + bad)
    (damage,) = read.damages
    assert (damage.kind, damage.count, damage.topic, damage.loses_data) == ("impossible", 2, "ins", False)
    assert damage.place == f"ins, the first at byte {len(DATED) + len(nmea(ATTITUDE))}"
    itow = week_ms(NOON)
    upside_down = {"iTOW": itow, "roll": 18_100_000, "heading": 9_000_000, "accRoll": 1, "accHeading": 1}
    read = Read(tmp_path, pvt(NOON) + ubx("NAV-ATT", **upside_down))
    assert not read.batches("ins") and [one.count for one in read.damages] == [1]
    known: dict[str, Any] = {"azimuth": 90.0, "roll": 1.0, "ins_solution_status": 3, "week": 2417, "seconds": 129_618.0}
    for wrong in ({"pitch": -91.0}, {"roll": float("inf")}, {"azimuth": 1e300}):
        read = Read(
            tmp_path, novatel("INSATT", 129_618_000, **(known | wrong)) + novatel("INSATT", 129_618_000, **known)
        )
        assert read.values("ins", "true_heading_deg") == [None, 90.0] and [one.count for one in read.damages] == [1]


@pytest.mark.parametrize(
    ("sentence", "topic"),
    [
        ("PUBX,00,120000.00,5130.0,N,00042.0,W,104.4,G3,2.9,3.1,7.2,90.0,-0.1,,1.0,1.1,1.2,9,0,0", "PUBX.00"),
        ("PUBX,03,02,23,-,014,06,08,000,12,U,207,43,28,009", "PUBX.03"),
        ("PUBX,04,103607.00,060321,556567.00,2147,18,-384839,-53.623,16", "PUBX.04"),
        ("PUBX,05,1,2,3", "PUBX.05"),
        ("PTNL,VGK,160159.00,010997,-0000.161,00009.985,-0000.002,3,07,1,4,M", "PTNL.VGK"),
        ("PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,3,1.4,16", "PTNL.AVR"),
        ("PTNL,PJT,NAD83(Conus),California Zone 4 0404,", "PTNL.PJT"),
        ("PSTI,030,120000.000,A,5130.0,N,00042.0,W,103.3,0.0,0.0,0.0,040526,A,1.2,4.2", "PSTI.030"),
        ("PSTI,036,054314.000,030521,191.69,-16.35,0.00,R", "PSTI.036"),
        ("PSAT,HPR,120000.00,232.24,-2.3,1.1,N", "PSAT.HPR"),
        ("PSAT,INTLT,1,2", "PSAT.INTLT"),
        ("PGPPADV,110,39.88113582,-105.07838455,1614.125", "PGPPADV.110"),
        ("PFEC,GPatt,12.345,23.456,34.567,", "PFEC.GPatt"),
        ("PSSN,HRP,120000.00,040526,90.0,1.0,2.0,0.1,0.1,0.1,12,2", "PSSN.HRP"),
        ("PSXN,23,1.0,2.0,90.0,0.1", "PSXN.23"),
        ("PFUGDP,GN,033615.00,3953.88002,N,10506.75324,W,13,9,FF,0.1,0.1,149,0.1", "PFUGDP"),
        ("PGRME,15.0,M,45.0,M,25.0,M", "PGRME"),
        ("PQTMTAR,1,165331.000,1,0.5,1.0,2.0,3.0,90.0,0.1,0.1,0.1,12", "PQTMTAR"),
        ("PQTMCFGMSGRATE,OK,GGA,1", "PQTMCFGMSGRATE"),
        ("PQTMCFGMSGRATES,OK", "PQTMCFGMSGRATES"),
        ("PMTK001,604,3", "PMTK001"),
    ],
)
def test_layouts_of_makers_have_topics_of_their_own(tmp_path: Path, sentence: str, topic: str) -> None:
    read = Read(tmp_path, DATED + nmea(sentence) + nmea(sentence))
    assert rows_of(read, f"raw.{topic}") == 2
    assert topics_of(read, "raw.P") == {f"raw.{topic}"}
    if read.values(f"raw.{topic}", "text") != [None, None]:
        assert read.values(f"raw.{topic}", "text")[0] == sentence[len(topic) + 1 :]


def test_addresses_that_begin_alike_are_not_mixed(tmp_path: Path) -> None:
    read = Read(tmp_path, DATED + nmea("PQTMDRCAL,1,2,3") + nmea("PQTMDRCLR,OK") + nmea("PQTMDRCA,9"))
    assert [rows_of(read, f"raw.PQTMDRC{rest}") for rest in ("AL", "LR", "A")] == [1, 1, 1]


def test_sentences_with_no_address_are_kept_as_text(tmp_path: Path) -> None:
    read = Read(tmp_path, DATED + nmea("GP-GA,1,2") + nmea(",1"))
    assert sorted(map(str, read.values("raw.sentence", "text"))) == [",1", "GP-GA,1,2"]


@pytest.mark.real_log
def test_the_recorded_sentences_of_many_layouts() -> None:
    """Of three PASHR one is an attitude; the others gave headings of 1 and pitches of 160 159 deg."""
    items = registry.read(real_log("gnss/pynmeagps_trimble_nmea.log"))
    ins = [item for item in items if isinstance(item, RecordBatch) and item.topic == "ins"]
    assert [batch.columns["true_heading_deg"].values.tolist() for batch in ins] == [[179.885]]


# --- fixes of makers' sentences


def test_a_log_of_a_makers_own_fixes_has_positions(tmp_path: Path) -> None:
    text = "PUBX,00,120000.00,5130.0,N,00042.0,W,104.4,{},2.9,3.1,36.0,90.0,-0.1,,1.0,1.1,1.2,9,0,0"
    clock = nmea("PUBX,04,120000.00,040526,129600.00,2417,18,-384839,-53.623,16")
    read = Read(tmp_path, clock + nmea(text.format("G3")) + nmea(text.format("NF").replace("00.00", "01.00")))
    assert read.times("gnss")[0] == "2026-05-04T12:00:00.000000000Z", "by the date of PUBX 04"
    assert read.values("gnss", "latitude_deg") == [51.5, None] and read.values("gnss", "fix") == ["3d", "none"]
    assert read.values("gnss", "velocity_east_mps")[0] == pytest.approx(10.0)
    assert read.values("gnss", "velocity_down_mps") == [-0.1, None] and read.values("gnss", "integrity_ok") == [
        True,
        False,
    ]
    flat = Read(tmp_path, nmea(text.format("G2")))
    assert flat.values("gnss", "integrity_ok") == [None] and flat.values("gnss", "altitude_ellipsoid_m") == [None]
    both = Read(tmp_path, DATED + nmea(text.format("G3").replace("5130", "5140")))
    assert both.values("gnss", "latitude_deg") == [51.5], "the standard sentences come first"


def test_the_fixes_of_trimble_and_ashtech(tmp_path: Path) -> None:
    """The date of GGK has the month in front; its height is above the ellipsoid where it says so."""
    text = "PTNL,GGK,120000.00,050426,5130.0,N,00042.0,W,{},09,1.9,{},M"
    read = Read(tmp_path, nmea(text.format(3, "EHT150.790")) + nmea(text.format(0, "EHT1").replace("00.00", "01.00")))
    assert read.times("gnss") == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:01.000000000Z"]
    assert read.values("gnss", "fix") == ["rtk_fixed", "none"] and read.values("gnss", "latitude_deg") == [51.5, None]
    assert read.values("gnss", "altitude_ellipsoid_m") == [150.79, None] and read.values("gnss", "pdop") == [1.9, 1.9]
    grid = Read(tmp_path, nmea(text.format(1, "GHT150.790")))
    assert grid.values("gnss", "altitude_ellipsoid_m") == [None] and grid.values("gnss", "fix") == ["3d"]
    ashtech = Read(tmp_path, nmea(OTHERS[0]))
    assert ashtech.values("gnss", "latitude_deg") == [51.5] and ashtech.values("gnss", "fix") == ["rtk_fixed"]
    assert "as no standard sentence tells a position" in ashtech.remark("mapped")


# --- messages: the length of the payload

_DICE = np.random.default_rng(7)
FULL = {name: _DICE.integers(0, 256, layout(text).size, dtype=np.uint8).tobytes() for name, text in LAYOUTS.items()}


@pytest.mark.parametrize("name", [name for name in LAYOUTS if not name.endswith("-V0")])
def test_ubx_messages_of_every_length(tmp_path: Path, name: str) -> None:
    """None brings the reader down; each that is not as long as a version of the message is counted."""
    code = next(code for code in range(1 << 16) if name_of(code, 999) == name)
    size = layout(layout_of(name)).size
    lengths = [length for length in range(size + 3) if name_of(code, length) == name]
    content = pvt(NOON) + b"".join(ubx_frame(code, (FULL[name] + b"\0\0")[:length]) for length in lengths)
    read = Read(tmp_path, content + pvt("2026-05-04T12:00:01Z"))
    assert "2026-05-04T12:00:01.000000000Z" in read.times("gnss")
    short = sum(0 < length < size and not is_version(name, length) for length in lengths)
    counts = {one.what.partition(" than")[0]: one.count for one in read.damages if one.kind == "corrupt"}
    assert counts.get("messages shorter", 0) == short
    topics = {topic for topic in topics_of(read, f"raw.{name}") if not topic.endswith(".group")}
    assert sum(rows_of(read, topic) for topic in topics) >= len(lengths)


@pytest.mark.parametrize("name", list(NOVATEL_LAYOUTS))
def test_novatel_messages_of_every_length(tmp_path: Path, name: str) -> None:
    number = next(number for number, known in NAMES.items() if known == name)
    body = np.random.default_rng(5).integers(0, 256, layout(NOVATEL_LAYOUTS[name]).size + 2, dtype=np.uint8).tobytes()
    good = novatel("BESTPOS", 129_618_000, latitude=51.5, longitude=-0.7, num_soln_svs=9)
    content = good + b"".join(
        novatel_frame(number, body[:length], 2417, 129_619_000 + length) for length in range(len(body) + 1)
    )
    read = Read(tmp_path, content + good)
    assert any(one.kind == "corrupt" and one.count == len(body) - 2 and "shorter" in one.what for one in read.damages)


def test_a_short_payload_costs_nothing_else(tmp_path: Path) -> None:
    """A NAV-PVAT of 32 bytes; it ended in an internal error."""
    read = Read(tmp_path, ubx_frame(0x0117, bytes(range(32))) + pvt(NOON))
    assert read.values("gnss", "latitude_deg") == [51.5] and not read.batches("ins")
    assert [(one.count, one.place) for one in read.damages] == [(1, "NAV-PVAT, the first at byte 0")]
    only = Read(tmp_path, ubx_frame(0x0117, bytes(range(32))))
    assert rows_of(only, "raw.NAV-PVAT.32") == 1 and not only.batches("gnss")


def test_what_stands_behind_a_layout_is_counted_and_an_older_version_is_read(tmp_path: Path) -> None:
    older, longer = pvt(NOON)[6:-2][:84], pvt("2026-05-04T12:00:01Z")[6:-2] + bytes(4)
    read = Read(tmp_path, ubx_frame(0x0107, older) + ubx_frame(0x0107, longer))
    assert read.values("raw.NAV-PVT.84", "lat") == [51.5] and read.values("raw.NAV-PVT", "lat") == [51.5]
    assert [(one.count, one.what.partition(":")[0]) for one in read.damages] == [
        (1, "messages of another length than their layout")
    ]
    assert not Read(tmp_path, ubx_frame(0x0107, older) * 3).damages
    satellites = struct.pack("<IBB2x", week_ms(NOON), 1, 3) + bytes(24)  # says 3, holds 2
    read = Read(tmp_path, pvt(NOON) + ubx_frame(0x0135, satellites))
    assert rows_of(read, "raw.NAV-SAT.group") == 2 and [one.count for one in read.damages] == [1]
    meas = struct.pack("<IHH", 1, 1 << 11 | 1 << 3, 0) + bytes(8)  # one value and a time of calibration behind it
    assert not Read(tmp_path, pvt(NOON) + ubx_frame(0x1002, meas)).damages
    assert not Read(tmp_path, pvt(NOON) + ubx_frame(0x0A04, b"")).damages, "a poll has no payload"


def test_text_logs_of_other_lengths(tmp_path: Path) -> None:
    header = "BESTVELA,COM1,0,80.0,FINESTEERING,2417,129618.000,02000020,1234,16809"
    body = "SOL_COMPUTED,DOPPLER_VELOCITY,0.15,0.0,10.0,90.0,-1.0,0.0"
    assert not Read(tmp_path, novatel_text(header, body)).damages
    longer = Read(tmp_path, novatel_text(header, f"{body},7"))
    assert longer.values("raw.BESTVEL", "horizontal_speed") == [10.0] and [one.count for one in longer.damages] == [1]
    shorter = Read(tmp_path, novatel_text(header, body.rpartition(",")[0]))
    assert rows_of(shorter, "raw.BESTVEL-text") == 1 and not shorter.damages, "nothing of it is lost"
    assert ": 1 (BESTVEL-text, the first at byte 0)" in shorter.remark("odd_text")
