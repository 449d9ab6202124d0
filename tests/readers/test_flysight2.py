"""FlySight 2: fixes, pressures, UTC of the counter, records side by side, damage."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Item, RecordBatch
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers import flysight2, flysight2_log, registry
from groundstation.readers.source import Source
from tests.readers.test_contract import check
from tests.readers.test_flat_csv import Read

UTC = iso_to_utc_ns("2024-05-06T10:00:00Z")[0]
WEEK, SECOND = 2313, 122_418  # of UTC
TOP = "$FLYS,1\n$VAR,FIRMWARE_VER,v2024.05.25\n$VAR,DEVICE_ID,abc123\n$VAR,SESSION_ID,def456\n"
FIXES = "$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV\n$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m,m,m/s,\n"
SENSORS = (
    "$COL,BARO,time,pressure,temperature\n$UNIT,BARO,s,Pa,deg C\n"
    "$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature\n$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g,deg C\n"
    "$COL,TIME,time,tow,week\n$UNIT,TIME,s,s,\n"
)
FIX = "$GNSS,2024-05-06T10:00:{:06.3f}Z,47.5,-122.25,100.5,3.00,4.00,-2.00,1.5,2.5,0.25,9\n"
ROWS = "".join(
    f"$IMU,{500 + k / 10:.3f},1.5,-2,0,0,0,1.0,25.5\n$BARO,{500.05 + k / 10:.3f},101325.00,20.5\n"
    + (f"$TIME,{500 + k / 10:.3f},{SECOND + k / 10:.3f},{WEEK}\n" if k % 10 == 0 else "")
    for k in range(40)
)


def read(tmp_path: Path, text: str) -> Read:
    path = tmp_path / "x.csv"
    path.write_text(text, newline="")
    return Read(path)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_fixes(tmp_path: Path, end: str) -> None:
    text = "\ufeff" * (end == "\r\n") + TOP + FIXES + "$DATA\n" + FIX.format(0.2) + FIX.format(0.4)
    found = read(tmp_path, text.replace("\n", end))
    assert found.header.reader == "flysight2" and found.header.utc_of_zero_ns == 0
    assert found.header.metadata["serial_number"] == "abc123" and found.rows("gnss") == [8, 9]
    assert found.times("gnss") == [UTC + 200_000_000, UTC + 400_000_000]
    expected = {
        "latitude_deg": 47.5,
        "longitude_deg": -122.25,
        "altitude_msl_m": 100.5,
        "velocity_north_mps": 3.0,
        "velocity_east_mps": 4.0,
        "velocity_down_mps": -2.0,
        "horizontal_sigma_m": 1.5,
        "vertical_sigma_m": 2.5,
        "velocity_sigma_mps": 0.25,
        "satellites_used": 9.0,
    }
    assert {name: found.values("gnss", name)[0] for name in expected} == expected
    assert not found.damages and not found.remarks


def test_sensors_have_utc_by_the_gps_week(tmp_path: Path) -> None:
    found = read(tmp_path, TOP + SENSORS + "$DATA\n" + ROWS)
    assert found.header.utc_of_zero_ns == UTC - 500 * NS_PER_S and found.header.utc_readings is not None
    assert found.times("baro")[0] == 500_050_000_000
    assert found.values("baro", "pressure_altitude_m")[0] == pytest.approx(0.0, abs=0.01)
    assert found.values("raw.flysight.IMU", "wy")[0] == -2.0 and found.times("raw.flysight.IMU")[-1] == 503_900_000_000
    assert found.values("raw.flysight.BARO", "temperature")[0] == 20.5
    assert not found.damages


def test_fixes_and_sensors_in_one_file_are_on_one_clock(tmp_path: Path) -> None:
    found = read(tmp_path, TOP + FIXES + SENSORS + "$DATA\n" + FIX.format(0.2) + ROWS)
    assert found.times("gnss") == [500_200_000_000] and found.times("baro")[0] == 500_050_000_000
    alone = read(tmp_path, TOP + FIXES + SENSORS + "$DATA\n" + FIX.format(0.2) + ROWS.replace("$TIME", "$NONE"))
    assert alone.times("gnss") == [UTC + 200_000_000] and alone.header.utc_of_zero_ns == 0
    assert alone.times("baro")[0] is None and "no_utc" in alone.remarks
    assert alone.damage("dropped_rows").count == 4


def test_sensors_without_a_week_have_no_absolute_time(tmp_path: Path) -> None:
    found = read(tmp_path, TOP + SENSORS + "$DATA\n$IMU,500,1,2,3,4,5,6,7\n")
    assert found.header.utc_of_zero_ns is None and "no_utc" in found.remarks
    assert found.times("raw.flysight.IMU") == [500 * NS_PER_S]


def test_a_column_in_another_unit_is_kept_raw(tmp_path: Path) -> None:
    text = TOP + FIXES.replace(",deg,deg,m,", ",deg,deg,ft,") + "$DATA\n" + FIX.format(0.2)
    found = read(tmp_path, text)
    assert found.values("raw.flysight.GNSS", "hMSL") == [100.5] and found.values("gnss", "velocity_down_mps") == [-2.0]


def test_damage_is_counted(tmp_path: Path) -> None:
    bad = FIX.format(1).replace("47.5", "47x5") + FIX.format(2)[:30] + "\n" + "$LOST,1,2\nnothing\n\n"
    bad += FIX.format(3).replace("47.5", "0").replace("-122.25", "0") + FIX.format(4).replace("2024-05-06T", "later")
    found = read(tmp_path, TOP + FIXES + "$DATA\n" + FIX.format(0) + bad + FIX.format(5)[:-4])
    lost = {(one.kind, one.what): one.count for one in found.damages}
    assert lost[("dropped_rows", "rows with another number of cells than their record has")] == 1
    assert lost[("dropped_rows", "rows of no record that a $COL line names")] == 2
    assert sum(one.count for one in found.damages if one.kind == "unreadable_cells") == 2
    assert found.damage("truncated").count == 1 and found.damage("no_position").count == 1
    assert found.values("gnss", "latitude_deg") == [47.5, None, None, 47.5] and found.times("gnss")[3] is None


def test_a_pressure_that_is_no_number_is_counted(tmp_path: Path) -> None:
    found = read(tmp_path, TOP + SENSORS + "$DATA\n$BARO,1.0,10x325,20\n$BARO,1.1,101325,20\n$BARO,1.2,-5,20\n")
    assert found.values("baro", "pressure_altitude_m") == pytest.approx([0.0], abs=0.01)
    assert sum(one.count for one in found.damages if one.kind == "unreadable_cells") == 2


def test_a_header_below_rows_governs_those_below_it(tmp_path: Path) -> None:
    other = "$COL,GNSS,time,lon,lat\n$GNSS,2024-05-06T10:00:01.000Z,8.5,48.5\n"
    found = read(tmp_path, TOP + FIXES + "$DATA\n" + FIX.format(0) + other)
    assert found.values("gnss", "latitude_deg") == [47.5, 48.5] and not found.damages


def items_of(path: Path) -> list[Item]:
    return list(registry.read(path))


def test_pieces_of_a_file_read_as_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.csv"
    path.write_text(TOP + FIXES + SENSORS + "$DATA\n" + FIX.format(0.2) + ROWS)
    whole, parts = items_of(path), list[list[Item]]()
    monkeypatch.setattr(flysight2_log, "LINES", 7)
    parts.append(items_of(path))
    for items in (whole, *parts):
        check(items)

    def series(items: list[Item], topic: str, name: str) -> list[float]:
        found = [one for one in items if isinstance(one, RecordBatch) and one.topic == topic]
        return np.concatenate([one.columns[name].values for one in found]).tolist()

    for topic, name in (("baro", "pressure_altitude_m"), ("raw.flysight.IMU", "wx"), ("gnss", "latitude_deg")):
        assert series(whole, topic, name) == series(parts[0], topic, name)


@pytest.mark.parametrize("text", ["$FLYS,1\n", "$COL,GNSS,time\n", "a,b\n1,2\n"])
def test_other_texts_are_not_claimed(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.txt"
    path.write_text(text)
    assert flysight2.sniff(Source(path)) is None
