"""Sentences as strangers' devices write them: units by their letters, hemispheres, old forms, several systems."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Remark
from groundstation.base.units import MPS_PER_KNOT
from groundstation.readers.receiver import stream
from tests.readers.receiver_writer import gga, nmea, rmc
from tests.readers.test_receiver import Read

KNOTS_10 = 10.0 * MPS_PER_KNOT


@pytest.mark.parametrize(
    ("text", "track_deg", "speed_mps"),
    [
        ("GPVTG,89.0,T,85.0,M,10.0,N,18.52,K,A", 89.0, KNOTS_10),
        ("GPVTG,89.0,T,,M,10.0,N,18.52,K", 89.0, KNOTS_10),
        ("GPVTG,89.0,T,,,,,18.52,K,A", 89.0, KNOTS_10),
        ("GPVTG,85.0,M,89.0,T,10.0,N,18.52,K,A", 89.0, KNOTS_10),
        ("GPVTG,,T,85.0,M,10.0,N,18.52,K,A", None, KNOTS_10),
        ("GPVTG,89.0,T,85.0,M,18.52,K,10.0,N,A", 89.0, KNOTS_10),
        ("GPVTG,89.0,T,85.0,M,10.0,M,,,A", 89.0, None),
        ("GPVTG,89.0,,85.0,,10.0,,18.52,", 89.0, KNOTS_10),
        ("GPVTG,89.0,85.0,10.0,18.52", 89.0, KNOTS_10),
        ("GPVTG,89.0,T,85.0,M,10.0,N,18.52,K,N", None, None),
    ],
)
def test_track_and_speed_by_the_letters_of_their_units(
    tmp_path: Path, text: str, track_deg: float | None, speed_mps: float | None
) -> None:
    read = Read(tmp_path, gga("120000.00") + nmea(text))
    assert read.values("gnss", "track_deg") == [track_deg]
    assert read.values("gnss", "ground_speed_mps") == [None if speed_mps is None else pytest.approx(speed_mps)]
    assert (read.values("gnss", "velocity_east_mps")[0] is None) == (track_deg is None or speed_mps is None)


def test_the_old_form_of_vtg_is_laid_out_as_such(tmp_path: Path) -> None:
    read = Read(tmp_path, gga("120000.00") + nmea("GPVTG,89.0,85.0,10.0,18.52") + nmea("GPVTG,1.0,T,2.0,M,3.0,N,4.0,K"))
    assert [read.values("raw.GPVTG", name) for name in ("cogt", "cogm", "sogn", "sogk")] == [
        *([89.0, 1.0], [85.0, 2.0], [10.0, 3.0], [18.52, 4.0])
    ]
    assert read.values("raw.GPVTG", "cogtUnit") == [None, "T"]


def test_speed_without_a_fix_is_none(tmp_path: Path) -> None:
    read = Read(tmp_path, gga("120000.00", quality=0) + nmea("GPVTG,0.0,T,,M,0.0,N,0.0,K"))
    assert read.values("gnss", "ground_speed_mps") == [None] and read.values("gnss", "fix") == ["none"]


def test_vtg_fills_what_rmc_leaves_out(tmp_path: Path) -> None:
    slow = nmea("GNRMC,120000.00,A,5130.0,N,00042.0,W,,,040526,,,A")
    read = Read(tmp_path, slow + nmea("GNVTG,90.0,T,,M,10.0,N,,K,A") + rmc("120001.00", "040526", 5.0, 45.0))
    assert read.values("gnss", "ground_speed_mps") == [pytest.approx(KNOTS_10), pytest.approx(5.0)]


@pytest.mark.parametrize(
    ("latitude", "longitude", "expected"),
    [
        ("5130.0,N", "00042.0,W", (51.5, -0.7)),
        ("5130.0,S", "00042.0,E", (-51.5, 0.7)),
        ("5130.0,n", "00042.0,w", (51.5, -0.7)),
        ("5130.0,N", "-00042.0,W", (51.5, -0.7)),
        ("5160.0,N", "00042.0,W", (52.0, -0.7)),
        ("5130.0,", "00042.0,W", None),
        ("5130.0,N", "00042.0,", None),
        ("5130.0,X", "00042.0,W", None),
        ("5199.0,N", "00042.0,W", None),
    ],
)
def test_hemispheres(tmp_path: Path, latitude: str, longitude: str, expected: tuple[float, float] | None) -> None:
    """A place without its hemisphere is none: it could be on either side of the equator."""
    read = Read(tmp_path, gga("120000.00", latitude, longitude))
    found = read.values("gnss", "latitude_deg")[0], read.values("gnss", "longitude_deg")[0]
    assert found == (expected or (None, None))
    assert bool(read.damages) == (expected is None)


def test_without_a_date_times_count_on_past_midnight_from_block_to_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def at(second: int) -> str:
        return f"{second // 3600 % 24:02d}{second // 60 % 60:02d}{second % 60:02d}.00"

    monkeypatch.setattr(stream, "BLOCK_BYTES", 30_011)
    read = Read(tmp_path, b"".join(gga(at(85_400 + k)) for k in range(4_000)))
    batches = read.batches("gnss")
    times = np.concatenate([batch.device_time_ns.values for batch in batches])
    assert len(batches) > 4 and set(np.diff(times).tolist()) == {10**9}


def test_heights_in_another_unit_are_left_out(tmp_path: Path) -> None:
    content = nmea("GNGGA,120000.00,5130.0,N,00042.0,W,1,12,0.8,300.0,F,47.0,M,,") + gga("120001.00")
    read = Read(tmp_path, content)
    assert read.values("gnss", "altitude_msl_m") == [None, 100.0] and read.values("raw.GNGGA", "alt") == [300.0, 100.0]


def test_dilution_is_that_of_the_systems_in_the_solution(tmp_path: Path) -> None:
    """A system without a satellite writes 99.99, or what it likes; 99.99 is no dilution."""
    used = nmea("GNGSA,A,3,01,02,03,04,,,,,,,,,1.5,0.9,1.2,1")
    unused = nmea("GNGSA,A,3,,,,,,,,,,,,,99.99,99.99,99.99,2")
    assert Read(tmp_path, gga("120000.00") + used + unused).values("gnss", "pdop") == [1.5]
    assert Read(tmp_path, gga("120000.00") + unused).values("gnss", "pdop") == [None]
    low = gga("120000.00").replace(b"0.80", b"99.9")
    assert Read(tmp_path, nmea(low[1:-5].decode())).values("gnss", "hdop") == [99.9]


def test_a_dilution_that_cannot_be_is_none_and_is_told_with_its_values(tmp_path: Path) -> None:
    """PDOP² = HDOP² + VDOP²: accuracies in place of HDOP and VDOP, and the PDOP as HDOP of GGA, as one maker has it."""
    fields = "A,3,01,02,03,04,,,,,,,,"
    first, second = (nmea(gga(f"12000{number}.00").replace(b"0.80", b"1.20")[1:-5].decode()) for number in (0, 1))
    wrong = nmea(f"GNGSA,{fields},1.2,2.0,3.0"), nmea(f"GNGSA,{fields},1.2,3.0,5.0")
    read = Read(tmp_path, first + wrong[0] + second + wrong[1])
    assert read.values("gnss", "pdop") == [1.2, 1.2] and read.values("gnss", "hdop") in ([], [None, None])
    assert "PDOP 1.2, HDOP 2 to 3 and VDOP 3 to 5 in 2 rows, which cannot be" in read.remark("impossible_dilution")
    assert "HDOP of GGA or GNS (1.2) is the PDOP of that GSA in 2 rows" in read.remark("same_dilution")
    own = Read(tmp_path, gga("120000.00") + wrong[0])
    assert own.values("gnss", "hdop") == [0.8], "that of GGA is another number"
    sound = Read(tmp_path, first + nmea(f"GNGSA,{fields},1.5,0.9,1.2"))
    assert (sound.values("gnss", "pdop"), sound.values("gnss", "hdop")) == ([1.5], [1.2])
    assert "HDOP differs between sentences in 1 row: 1.2 (GGA), 0.9 (GSA)" in sound.remark("hdops_differ")


@pytest.mark.parametrize("sign", ["50.0", "99.9", "25.5"])
def test_one_number_for_every_dilution_says_that_there_is_no_fix(tmp_path: Path, sign: str) -> None:
    none = nmea(f"GNGGA,120000.00,4730.0000,N,00830.0000,E,0,00,{sign},400.0,M,47.0,M,,")
    read = Read(tmp_path, none + nmea(f"GNGSA,A,1,01,02,03,04,,,,,,,,,{sign},{sign},{sign}"))
    assert not {"impossible_dilution", "same_dilution", "hdops_differ"} & {
        one.code for one in read.items if isinstance(one, Remark)
    }


@pytest.mark.parametrize(("unit", "heading"), [("T", 12.5), ("", 12.5), ("M", None)])
def test_a_heading_is_true_where_it_says_so(tmp_path: Path, unit: str, heading: float | None) -> None:
    read = Read(tmp_path, gga("120000.00") + rmc("120000.00", "040526") + nmea(f"GPHDT,12.5,{unit}"))
    assert read.values("ins", "true_heading_deg") == ([] if heading is None else [heading])


@pytest.mark.parametrize("talker", ["GP", "GN", "GL", "GA", "GB", "BD", "GQ", "QZ", "II"])
def test_talkers(tmp_path: Path, talker: str) -> None:
    text = f"{talker}GGA,120000.00,5130.0,N,00042.0,W,1,12,0.8,100.0,M,47.0,M,,"
    assert Read(tmp_path, nmea(text)).values("gnss", "latitude_deg") == [51.5]


def test_small_letters_in_the_checksum_and_lines_that_run_into_each_other(tmp_path: Path) -> None:
    first, second = gga("120000.00"), gga("120001.00")
    lower = first[:-4] + first[-4:].lower()
    joined = lower.rstrip() + second
    read = Read(tmp_path, joined + first[:30] + second)
    assert read.values("raw.GNGGA", "lat") == [51.5] * 3 and sum(one.count for one in read.damages) == 30
