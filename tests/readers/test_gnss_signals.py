"""Kind of fix, satellites tracked, C/N0 and age of corrections as the readers give them."""

import struct
from pathlib import Path

import numpy as np
import pytest

from groundstation.readers.bags.canonical import navsatfix
from groundstation.readers.tlog.canonical import gnss as of_mavlink
from groundstation.readers.ulog.canonical import gnss as of_px4
from tests.readers.receiver_writer import nmea, pvt, ubx_frame, week_ms
from tests.readers.test_receiver import NOON, Read

CODE_NAV_SAT, CODE_RAWX = 0x0135, 0x0215


def nav_sat(utc: str, *satellites: tuple[int, int, int, bool]) -> bytes:
    """NAV-SAT of satellites: system, number, C/N0, whether it is in the solution."""
    head = struct.pack("<IBBxx", week_ms(utc), 1, len(satellites))
    rows = (
        struct.pack("<BBBbhhI", system, number, cno, 45, 90, 0, 8 * used) for system, number, cno, used in satellites
    )
    return ubx_frame(CODE_NAV_SAT, head + b"".join(rows))


def rawx(utc: str, *signals: tuple[int, int, int]) -> bytes:
    """RXM-RAWX of signals: system, number, C/N0; received 2 ms before the epoch."""
    head = struct.pack("<dHbBBBxx", week_ms(utc) / 1e3 - 0.002, 2400, 18, len(signals), 1, 1)
    rows = (
        struct.pack("<ddfBBBBHBBBBBx", 2e7, 1e8, 100.0, system, number, 0, 0, 1000, cno, 1, 1, 1, 7)
        for system, number, cno in signals
    )
    return ubx_frame(CODE_RAWX, head + b"".join(rows))


def test_ubx_satellites_and_their_strength(tmp_path: Path) -> None:
    seen = nav_sat(NOON, (0, 1, 40, True), (0, 2, 44, True), (6, 2, 20, False), (0, 9, 0, False))
    read = Read(tmp_path, pvt(NOON) + seen + rawx(NOON, (0, 1, 10)))
    assert read.values("gnss", "satellites_tracked") == [3.0] and read.values("gnss", "cn0_dbhz") == [42.0]


def test_raw_measurements_serve_where_no_satellites_are_told(tmp_path: Path) -> None:
    later = "2026-05-04T12:00:01Z"
    read = Read(tmp_path, pvt(NOON) + rawx(NOON, (0, 1, 40), (0, 1, 30), (2, 1, 50)) + pvt(later))
    assert read.values("gnss", "satellites_tracked") == [2.0, None], "two signals of one satellite"
    assert read.values("gnss", "cn0_dbhz") == [40.0, None]


@pytest.mark.parametrize(("told", "age_s"), [(0, None), (1, 1.0), (4, 10.0), (12, 120.0), (15, 120.0)])
def test_age_of_corrections_of_ubx_is_the_upper_end_of_its_class(
    tmp_path: Path, told: int, age_s: float | None
) -> None:
    differential = Read(tmp_path, pvt(NOON, flags=3, flags3=told << 1))
    assert differential.values("gnss", "age_of_corrections_s") == [age_s]
    alone = Read(tmp_path, pvt(NOON, flags=1, flags3=told << 1))
    assert alone.values("gnss", "age_of_corrections_s") == [None]


def gga(quality: int, age: str) -> bytes:
    return nmea(f"GNGGA,120000.00,5130.00000,N,00042.00000,W,{quality},12,0.80,100.0,M,47.0,M,{age},0000")


def test_nmea_satellites_strength_and_age(tmp_path: Path) -> None:
    first = nmea("GPGSV,1,1,03,01,55,175,46,02,29,043,40,03,10,100,,1")
    second = nmea("GPGSV,1,1,01,01,55,175,38,6")  # another signal of the first satellite
    third = nmea("GLGSV,1,1,01,01,55,175,36,1")
    read = Read(tmp_path, gga(4, "1.5") + first + second + third)
    assert read.values("gnss", "cn0_dbhz") == [40.0] and read.values("gnss", "age_of_corrections_s") == [1.5]
    assert read.values("gnss", "satellites_tracked") == [3.0]
    assert Read(tmp_path, gga(1, "0.0")).values("gnss", "age_of_corrections_s") == [None], "a filler"


class Rows(dict[str, np.ndarray]):
    """Columns of messages."""


def test_px4_states_its_fix_and_errors() -> None:
    kinds = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 9.0])
    count = len(kinds)
    rows = Rows(fix_type=kinds, lat=np.full(count, 5e8), lon=np.full(count, 3e8), eph=np.full(count, 0.7))
    rows["epv"] = np.zeros(count)
    columns = of_px4(rows)
    names = ["none", "none", "2d", "3d", "dgnss", "rtk_float", "rtk_fixed", "dead_reckoning", "other"]
    assert columns["fix"].values.tolist() == names
    assert not columns["integrity_ok"].values[[0, 1, 2, 7]].any() and columns["integrity_ok"].values[3:7].all()
    assert columns["horizontal_sigma_m"].mask.tolist() == [False] * 2 + [True] * 7
    assert not columns["vertical_sigma_m"].mask.any(), "0 is unknown"


def test_mavlink_states_its_fix_and_errors() -> None:
    kinds = np.array([1.0, 2.0, 3.0, 6.0, 8.0])
    names = ("lat", "lon", "alt", "vel", "cog", "eph", "satellites_visible", "h_acc", "dgps_age")
    rows = Rows({name: np.full(5, 1000.0) for name in names} | {"fix_type": kinds})
    rows["v_acc"] = np.zeros(5)
    columns = of_mavlink(rows)
    assert columns["fix"].values.tolist() == ["none", "2d", "3d", "rtk_fixed", "ppp"]
    assert columns["horizontal_sigma_m"].values[2] == 1.0 and not columns["vertical_sigma_m"].mask.any()
    assert columns["age_of_corrections_s"].mask.tolist() == [False, False, False, True, True]
    assert columns["integrity_ok"].values.tolist() == [False, False, True, True, True]


def test_status_of_navsatfix() -> None:
    status = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    rows = Rows({name: np.full(5, 50.0) for name in ("latitude", "longitude", "altitude")} | {"status.status": status})
    fix = navsatfix(rows)["fix"]  # type: ignore[arg-type]
    assert fix.values[fix.mask].tolist() == ["none", "3d", "dgnss", "dgnss"] and not fix.mask[0]
