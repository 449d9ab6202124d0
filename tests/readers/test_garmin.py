"""Garmin's family: what a column counts from is settled in each log, by its names and by its data.

The layouts are those of recorded logs: G3X of 9.18 and 9.52, G5 of 6.00 and 6.40, the older G3X.
"""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.timescales import iso_to_utc_ns
from groundstation.readers import registry
from groundstation.readers.norths import NorthSamples, by_motion
from groundstation.readers.told import told
from tests.readers.garmin_writer import G3X, G5, G5_TOP, G1000, G1000_TOP, KT, MPS, Flight, log
from tests.readers.test_flat_csv import Read

CELL = 0.01  # of directions and velocities, as they are written
WEST = Flight(declination_deg=13.0, variation_sign=-1)  # California: 12.8 deg east, a G3X logs -12.8


def read(tmp_path: Path, text: str) -> Read:
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    return Read(path)


def one(log: Read, topic: str, field: str) -> float:
    """The value that a field has in every row."""
    values = set(log.values(topic, field))
    assert len(values) == 1, values
    return float(values.pop())


def motion(log: Read) -> tuple[float, float]:
    return one(log, "gnss", "velocity_north_mps"), one(log, "gnss", "velocity_east_mps")


@pytest.mark.parametrize("name", ["GPS Ground Track (deg true)", "GPS Ground Track (degt)", "GPS Ground Track (deg)"])
@pytest.mark.parametrize("without", [(), ("variation",), ("east", "north"), ("variation", "east", "north")])
def test_a_true_track_stays_true(tmp_path: Path, name: str, without: tuple[str, ...]) -> None:
    found = read(tmp_path, log(WEST, G3X, without=without, renamed={"track": name}))
    assert found.header.reader == "csv-profile garmin-g3x"
    assert one(found, "gnss", "track_deg") == pytest.approx(90.0, abs=CELL)
    assert motion(found) == pytest.approx((0.0, MPS), abs=CELL)


def test_velocities_win_over_what_track_and_speed_would_give(tmp_path: Path) -> None:
    text = log(WEST, G3X).replace(f"{KT:.3f}", "17.0")  # a speed of another moment
    assert motion(read(tmp_path, text)) == pytest.approx((0.0, MPS), abs=CELL)


@pytest.mark.parametrize("track_deg", [3.0, 90.0, 181.0, 355.0])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("without", [(), ("east", "north")])
def test_the_way_tells_a_magnetic_track(tmp_path: Path, track_deg: float, sign: int, without: tuple[str, ...]) -> None:
    """Velocities, else positions, show that the track is magnetic, and which way the variation counts."""
    flight = Flight(track_deg, declination_deg=13.0, variation_sign=sign, track_is_true=False)
    found = read(tmp_path, log(flight, G3X, without=without))
    assert one(found, "gnss", "track_deg") == pytest.approx(track_deg, abs=2 * CELL)
    assert one(found, "ins", "true_heading_deg") == pytest.approx(93.0, abs=2 * CELL)
    assert "magnetic north" in found.remarks["north"].text
    expected = MPS * np.cos(np.deg2rad(track_deg)), MPS * np.sin(np.deg2rad(track_deg))
    assert motion(found) == pytest.approx(expected, abs=0.05)


def test_a_magnetic_track_without_variation_is_none(tmp_path: Path) -> None:
    flight = Flight(track_is_true=False)
    text = log(flight, G3X, without=("variation", "east", "north"), renamed={"track": "GPS Ground Track (deg mag)"})
    found = read(tmp_path, text)
    assert all("track_deg" not in batch.columns for batch in found.batches if batch.topic == "gnss")
    assert "no variation" in found.remarks["magnetic_track"].text
    assert one(found, "raw.g3x", "GPS Ground Track (deg mag)") == pytest.approx(77.0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("names", "top"), [(G3X, None), (G5, G5_TOP)])
@pytest.mark.parametrize(
    ("latitude_deg", "longitude_deg", "declination_deg"),
    [(37.7, -122.2, 12.9), (44.9, -89.6, -2.9), (-6.8, -79.8, -2.5), (47.0, -122.0, 13.0)],
)
def test_the_field_tells_which_way_the_variation_counts(
    tmp_path: Path,
    sign: int,
    names: dict[str, tuple[str, str]],
    top: str | None,
    latitude_deg: float,
    longitude_deg: float,
    declination_deg: float,
) -> None:
    """A G5 of 6.00 logs -2.9 in Wisconsin, one of 6.40 2.9; a G3X -12.8 in California and 2.4 in Peru."""
    place = {"latitude_deg": latitude_deg, "longitude_deg": longitude_deg}
    flight = Flight(declination_deg=declination_deg, variation_sign=sign, **place)
    found = read(tmp_path, log(flight, names, **({} if top is None else {"top": top})))
    assert one(found, "ins", "true_heading_deg") == pytest.approx(93.0, abs=0.1)
    assert one(found, "ins", "magnetic_heading_deg") == pytest.approx(93.0 - declination_deg, abs=0.1)


def test_a_variation_of_zero_before_the_first_fix_is_none(tmp_path: Path) -> None:
    rows = log(WEST, G3X).splitlines()
    rows[3:8] = [row.rpartition(",")[0] + ",-0.0" for row in rows[3:8]]
    found = read(tmp_path, "\n".join([*rows, ""]))
    assert found.values("ins", "true_heading_deg")[:6] == [None] * 5 + [pytest.approx(93.0)]
    assert found.values("ins", "magnetic_heading_deg")[0] == pytest.approx(80.0)


def test_a_g5_is_read(tmp_path: Path) -> None:
    text = log(Flight(), G5, top=G5_TOP).replace(",-0.5,", ",+-0.5,").replace(",1.5,", ",+1.5,")
    found = read(tmp_path, text)
    assert found.header.reader == "csv-profile garmin-g5" and found.header.utc_of_zero_ns == 0
    assert found.times("gnss")[0] == iso_to_utc_ns("2024-05-06T10:00:00Z")[0] and "assumed_utc" not in found.remarks
    assert motion(found) == pytest.approx((0.0, MPS), abs=CELL)
    assert one(found, "ins", "roll_deg") == -0.5 and one(found, "ins", "pitch_deg") == 1.5  # it writes +-0.5
    assert one(found, "gnss", "altitude_ellipsoid_m") == pytest.approx(100.0, abs=0.1)
    assert one(found, "ins", "accel_z_mps2") == pytest.approx(-9.80665)
    assert one(found, "gnss", "velocity_down_mps") == -1.5 and not found.damages


def test_pressure_altitude_of_a_g5_is_not_the_sea_s(tmp_path: Path) -> None:
    """The short name AltMSL stands below Pressure Altitude."""
    names = G5 | {"altitude": ("Pressure Altitude (ft)", "AltMSL")}
    found = read(tmp_path, log(Flight(), names, top=G5_TOP))
    assert one(found, "baro", "pressure_altitude_m") == pytest.approx(100.0, abs=0.1)
    assert all("altitude_msl_m" not in batch.columns for batch in found.batches)


def test_the_older_g3x_has_no_first_line(tmp_path: Path) -> None:
    text = log(Flight(), G5, short=False).partition("\n")[2].replace("2024-05-06", "5/6/2024")
    found = read(tmp_path, text)
    assert found.header.reader == "csv-profile garmin-g5" and motion(found) == pytest.approx((0.0, MPS), abs=CELL)
    assert len(found.rows("gnss")) == 60 and found.times("gnss")[0] == iso_to_utc_ns("2024-05-06T10:00:00Z")[0]


def test_a_header_behind_a_hash(tmp_path: Path) -> None:
    """Garmin Pilot puts a # before the long names and leaves the short ones out."""
    text = log(WEST, G3X, short=False).replace("\nDate (", "\n#Date (")
    found = read(tmp_path, text)
    assert len(found.rows("gnss")) == 60 and motion(found) == pytest.approx((0.0, MPS), abs=CELL)


def test_short_names_alone(tmp_path: Path) -> None:
    long, short = log(WEST, G3X).split("\n", 2)[1:3]
    text = log(WEST, G3X).replace(long + "\n", "")
    assert short.startswith("Lcl Date")
    found = read(tmp_path, text)
    assert found.header.reader == "csv-profile garmin-g1000"
    assert motion(found) == pytest.approx((0.0, MPS), abs=CELL)
    assert one(found, "gnss", "track_deg") == pytest.approx(90.0) and "true north" in found.remarks["north"].text


def test_long_names_below_the_short_ones(tmp_path: Path) -> None:
    top, long, short, rows = log(WEST, G3X).split("\n", 3)
    found = read(tmp_path, "\n".join((top, short, long, rows)))
    assert found.header.reader == "csv-profile garmin-g3x" and not found.damages
    assert motion(found) == pytest.approx((0.0, MPS), abs=CELL) and len(found.rows("gnss")) == 60


def test_columns_without_a_short_name_are_kept(tmp_path: Path) -> None:
    names = G3X | {"up": ("AHRS 1 Dev (%)", "")}
    found = read(tmp_path, log(WEST, names))
    assert one(found, "raw.g3x", "AHRS 1 Dev (%)") == 1.5 and found.header.metadata["aircraft"] == "N1"


def test_a_true_heading_by_its_name(tmp_path: Path) -> None:
    flight = Flight(heading_deg=93.0, declination_deg=13.0, variation_sign=-1)
    text = log(flight, G3X, renamed={"heading": "Magnetic Heading (deg true)"})  # 80 deg, said to be true
    found = read(tmp_path, text)
    assert one(found, "ins", "true_heading_deg") == pytest.approx(80.0)
    assert all("magnetic_heading_deg" not in batch.columns for batch in found.batches)


@pytest.mark.parametrize(
    ("field", "old", "new", "expected"),
    [
        ("ground_speed_mps", "GPS Ground Speed (kt)", "GPS Ground Speed (km/h)", KT / 3.6),
        ("ground_speed_mps", "GPS Ground Speed (kt)", "GPS Ground Speed (mph)", KT * 0.44704),
        ("ground_speed_mps", "GPS Ground Speed (kt)", "GPS Ground Speed (m/s)", KT),
        ("altitude_msl_m", "GPS Altitude (ft)", "GPS Altitude (m)", 100.0 / 0.3048),
        ("altitude_ellipsoid_m", "GPS Altitude (ft)", "GPS Altitude (WGS84 ft)", 100.0),
        ("altitude_msl_m", "GPS Altitude (ft)", "GPS Altitude (ft msl)", 100.0),
    ],
)
def test_units_and_heights_by_the_name(tmp_path: Path, field: str, old: str, new: str, expected: float) -> None:
    found = read(tmp_path, log(WEST, G3X).replace(old, new, 1))
    assert one(found, "gnss", field) == pytest.approx(expected, rel=1e-3)


def test_a_unit_of_another_dimension_keeps_the_column_raw(tmp_path: Path) -> None:
    found = read(tmp_path, log(WEST, G3X).replace("GPS Altitude (ft)", "GPS Altitude (kt)", 1))
    assert all("altitude_msl_m" not in batch.columns for batch in found.batches)
    assert "GPS Altitude (kt)" in found.batches[-1].columns and "kept raw" in found.remarks["other_unit"].text


@pytest.mark.parametrize(("unit", "factor"), [("kt", 1852.0 / 3600.0), ("km/h", 1.0 / 3.6)])
def test_a_g1000_by_its_row_of_units(tmp_path: Path, unit: str, factor: float) -> None:
    flight = Flight(declination_deg=-13.0, track_is_true=False)
    text = log(flight, G1000, top=G1000_TOP).replace(",kt,", f",{unit},", 1)
    found = read(tmp_path, text)
    assert found.header.reader == "csv-profile garmin-g1000"
    assert one(found, "gnss", "ground_speed_mps") == pytest.approx(KT * factor, rel=1e-5)
    assert one(found, "gnss", "track_deg") == pytest.approx(90.0, abs=0.1)
    assert one(found, "ins", "true_heading_deg") == pytest.approx(93.0, abs=0.1)


@pytest.mark.parametrize("mark", ["#", ""])
@pytest.mark.parametrize("is_below", [False, True])
def test_a_row_of_units_on_either_side_of_the_names(tmp_path: Path, mark: str, is_below: bool) -> None:
    flight = Flight(declination_deg=-13.0, track_is_true=False)
    top, units, names, rows = log(flight, G1000, top=G1000_TOP).replace(",kt,", ",km/h,", 1).split("\n", 3)
    units = mark + units.lstrip("#")
    found = read(tmp_path, "\n".join((top, names, units, rows) if is_below else (top, units, names, rows)))
    assert not found.damages and len(found.rows("gnss")) == 60
    assert one(found, "gnss", "ground_speed_mps") == pytest.approx(KT / 3.6, rel=1e-5)
    assert one(found, "gnss", "track_deg") == pytest.approx(90.0, abs=0.1)


def test_a_row_with_a_broken_time_is_no_row_of_units(tmp_path: Path) -> None:
    text = log(Flight(), G1000, top=G1000_TOP).replace(",03:00:00,", ",--:--:--,", 1)
    found = read(tmp_path, text)
    assert len(found.rows("gnss")) == 60 and found.damage("unreadable_cells").count == 1


@pytest.mark.parametrize(
    ("text", "north"),
    [
        *(
            ("GPS Ground Track (deg true)", "true"),
            ("Track (degT)", "true"),
            ("True Heading", "true"),
            ("TRK (T)", "true"),
        ),
        *(("Hdg (deg mag)", "magnetic"), ("Magnetic Heading (deg)", "magnetic"), ("HDG (M)", "magnetic")),
        *(("HDG", ""), ("TRK (deg)", ""), ("True or magnetic", ""), ("Structure (deg)", "")),
    ],
)
def test_words_of_a_name(text: str, north: str) -> None:
    assert told([text]).north == north


def test_nothing_is_decided_by_what_does_not_move() -> None:
    n = np.full(100, np.nan)
    still = NorthSamples(n * 0 + 77.0, n * 0 + 13.0, n * 0 + 0.1, n * 0, n, n)
    assert by_motion(still).track == "" and by_motion(NorthSamples(*[n] * 6)).track == ""


@pytest.mark.real_log
def test_case_e2_and_e3() -> None:
    from tests.real_logs import real_log

    for name, fix in (("cases/e2_g3x_touch_magvar.csv", "dgnss"), ("cases/e3_g5.csv", "3d")):
        found = Read(real_log(name))
        assert one(found, "gnss", "track_deg") == 90.0 and one(found, "ins", "true_heading_deg") == 90.0
        assert motion(found) == (0.0, 12.0)
        assert set(found.values("gnss", "fix")) == {fix}


def test_text_of_inertial_explorer_is_not_misread(tmp_path: Path) -> None:
    path = tmp_path / "ie.txt"
    path.write_text(
        "Project:     test\nProgram:     Inertial Explorer Version 8.90\n\n"
        " Week    GPSTime       Latitude      Longitude        H-Ell    VEast   VNorth      VUp    Heading Q\n"
        "           (sec)      (+/-D M S)     (+/-D M S)        (m)    (m/s)    (m/s)    (m/s)      (deg)\n"
        + " 2313 122418.000 47 00 00.00000 -122 00 00.00000  91.440   12.000    0.000    0.000   90.0000000 1\n"
        * 50
    )
    assert registry.identify(path).detail == "inertial-explorer"
    assert one(Read(path), "ins", "longitude_deg") == -122.0
