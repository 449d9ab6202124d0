"""Runway table: places, thresholds, courses, the source's faults, damaged and hostile files."""

import gzip
import io
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.geodesy import latitude_longitude_deg, north_east_m
from groundstation.base.runways.kept import SHIPPED, bytes_of, runways, shipped_runways, user_file
from groundstation.base.runways.ourairports import IMPOSSIBLE, NO_COORDINATES, NOT_A_RUNWAY, read_ourairports
from groundstation.base.runways.table import THRESHOLD_SIGMA_M, RunwayTable
from groundstation.base.units import M_PER_FOOT
from groundstation.cli.runways import runways_text
from groundstation.pipeline.verbs.runways import runways_near, runways_of

MOST_BYTES = 1_000_000
HEAD = (
    '"id","airport_ref","airport_ident","length_ft","width_ft","surface","lighted","closed","le_ident",'
    '"le_latitude_deg","le_longitude_deg","le_elevation_ft","le_heading_degT","le_displaced_threshold_ft","he_ident",'
    '"he_latitude_deg","he_longitude_deg","he_elevation_ft","he_heading_degT","he_displaced_threshold_ft"'
)
LATITUDE, LONGITUDE, COURSE_DEG, LENGTH_FT = 52.0, 20.0, 70.0, 8000
SMALL_M = 0.2  # coordinates are kept in steps of 0.1 m


def line(
    *,
    airport: str = "EPXX",
    length_ft: float | str = LENGTH_FT,
    between_ft: float = LENGTH_FT,
    displaced_ft: tuple[object, object] = ("", ""),
    elevation_ft: tuple[object, object] = (300, 340),
    closed: int = 0,
    names: tuple[str, str] = ("07", "25"),
    surface: str = "ASP",
    place: tuple[float, float] = (LATITUDE, LONGITUDE),
) -> str:
    """A row of the source: a runway from a place on, on a course."""
    along = between_ft * M_PER_FOOT * np.array([np.cos(np.deg2rad(COURSE_DEG)), np.sin(np.deg2rad(COURSE_DEG))])
    far = [float(one) for one in latitude_longitude_deg(along[0], along[1], *place)]
    first = f'"{names[0]}",{place[0]:.7f},{place[1]:.7f},{elevation_ft[0]},70,{displaced_ft[0]}'
    second = f'"{names[1]}",{far[0]:.7f},{far[1]:.7f},{elevation_ft[1]},250,{displaced_ft[1]}'
    return f'1,2,"{airport}",{length_ft},148,"{surface}",1,{closed},{first},{second}'


def table_of(tmp_path: Path, *rows: str) -> RunwayTable:
    path = tmp_path / "runways.csv"
    path.write_text("\n".join((HEAD, *rows)) + "\n", encoding="utf-8")
    return read_ourairports(path, "2026-08-22")


def test_shipped_table_is_small_and_told() -> None:
    table = shipped_runways()
    assert SHIPPED.stat().st_size < MOST_BYTES
    assert len(table) > 15_000
    assert len(table) + sum(table.left_out.values()) == table.rows
    assert table.left_out[NO_COORDINATES] > 20_000
    assert table.version == "OurAirports 2026-08-22 (4b01f389)"
    assert "public domain" in table.licence


def test_table_survives_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    made = table_of(tmp_path, line(displaced_ft=(400, "")), line(names=("16", "34"), closed=1, place=(10.0, 179.999)))
    user_file().parent.mkdir(parents=True)
    user_file().write_bytes(bytes_of(made))
    kept = runways()
    assert (kept.version, kept.rows, kept.left_out, len(kept)) == (made.version, 2, {}, 2)
    for one, other in zip(made.of_airport("EPXX"), kept.of_airport("epxx"), strict=True):
        assert one.full_name == other.full_name
        assert one.is_closed == other.is_closed
        assert one.displaced_m == pytest.approx(other.displaced_m)
        assert one.elevation_m == pytest.approx(other.elevation_m)
        moved = north_east_m(one.latitude_deg, one.longitude_deg, other.latitude_deg, other.longitude_deg)
        assert np.hypot(*moved) < SMALL_M
    user_file().unlink()
    assert runways().version == shipped_runways().version


def test_threshold_is_the_end_and_the_displacement_along_the_runway(tmp_path: Path) -> None:
    table = table_of(tmp_path, line(displaced_ft=(400, 1000)))
    first, second = table.of_airport("EPXX")
    assert (first.name, second.name, second.opposite) == ("07", "25", "07")
    north, east = north_east_m(first.latitude_deg, first.longitude_deg, LATITUDE, LONGITUDE)
    assert np.hypot(north, east) == pytest.approx(400 * M_PER_FOOT, abs=0.1)
    assert np.rad2deg(np.arctan2(east, north)) == pytest.approx(COURSE_DEG, abs=0.01)
    north, east = north_east_m(second.latitude_deg, second.longitude_deg, LATITUDE, LONGITUDE)
    assert np.hypot(north, east) == pytest.approx(7000 * M_PER_FOOT, abs=0.1)
    assert wrap_180(second.true_course_deg - first.true_course_deg) == pytest.approx(-180.0, abs=0.05)
    assert first.landing_length_m == pytest.approx(7600 * M_PER_FOOT)
    assert first.elevation_m == pytest.approx((300 + 40 * 400 / 8000) * M_PER_FOOT)
    assert second.slope == pytest.approx(-40 / 8000)
    assert first.coordinates_of == "end"


def test_length_tells_thresholds_that_were_written_for_ends(tmp_path: Path) -> None:
    first, second = table_of(tmp_path, line(displaced_ft=(1000, ""), between_ft=7000)).of_airport("EPXX")
    assert (first.coordinates_of, second.coordinates_of) == ("threshold", "end")
    assert np.hypot(*north_east_m(first.latitude_deg, first.longitude_deg, LATITUDE, LONGITUDE)) < SMALL_M
    behind = north_east_m(first.end_latitude_deg, first.end_longitude_deg, LATITUDE, LONGITUDE)
    assert np.hypot(*behind) == pytest.approx(1000 * M_PER_FOOT, abs=0.1)
    unsure, _other = table_of(tmp_path, line(displaced_ft=(1000, ""), between_ft=7500)).of_airport("EPXX")
    assert unsure.coordinates_of == "end or threshold"
    assert unsure.along_sigma_m > 500 * M_PER_FOOT
    plain, _other = table_of(tmp_path, line()).of_airport("EPXX")
    assert THRESHOLD_SIGMA_M < plain.along_sigma_m < 1.1 * THRESHOLD_SIGMA_M


def test_a_length_that_does_not_fit_widens_the_sigmas(tmp_path: Path) -> None:
    plain, _second = table_of(tmp_path, line()).of_airport("EPXX")
    wrong, _second = table_of(tmp_path, line(between_ft=LENGTH_FT + 1000)).of_airport("EPXX")
    assert wrong.mismatch_m == pytest.approx(1000 * M_PER_FOOT, abs=0.5)
    assert wrong.across_sigma_m > 200.0 > 20.0 > plain.across_sigma_m
    assert wrong.course_sigma_deg > 4.0 * plain.course_sigma_deg
    unknown, _second = table_of(tmp_path, line(length_ft="")).of_airport("EPXX")
    assert unknown.mismatch_m is None
    assert unknown.length_m == pytest.approx(LENGTH_FT * M_PER_FOOT, abs=0.5)


def test_near_finds_directions_by_place_and_course(tmp_path: Path) -> None:
    table = table_of(
        tmp_path, line(), line(airport="NZXX", place=(-40.0, 179.999)), line(airport="POLE", place=(89.9, 0.0))
    )
    assert [one.name for one in table.near(LATITUDE, LONGITUDE, 500.0)] == ["07", "25"]
    assert [one.name for one in table.near(LATITUDE, LONGITUDE, 500.0, 75.0, 12.0)] == ["07"]
    assert table.near(LATITUDE, LONGITUDE, 500.0, 160.0, 12.0) == ()
    assert table.near(LATITUDE + 0.1, LONGITUDE, 500.0) == ()
    assert {one.airport for one in table.near(-40.0, -179.999, 500.0)} == {"NZXX"}
    assert {one.airport for one in table.near(89.9, 0.0, 5_000.0)} == {"POLE"}
    assert table.near(float("nan"), 0.0, 5_000.0) == ()
    far = table.of_airport("EPXX")[0]
    assert far.distance_m(far.far_latitude_deg, far.far_longitude_deg) < SMALL_M


def test_rows_that_are_no_runways_are_counted(tmp_path: Path) -> None:
    helipad = '1,2,"00A",80,80,"ASPH-G",1,0,"H1",40,-75,11,,,,,,,,'
    unknown = '1,2,"00AK",2500,40,"GRVL",0,0,"N",,,,,,"S",,,,,'
    one_end = '1,2,"00AL",2500,40,"GRVL",0,0,"N",52,20,,,,"S",,,,,'
    other_sign = line(place=(43.9, 124.1)).replace(",124.", ",-124.", 1)
    rows = (
        *(line(), helipad, unknown, one_end, other_sign, line(elevation_ft=("1e9", 0)), line(displaced_ft=(9000, 0))),
        *(line(names=("nineteen.", "x")), line(airport="\x1b[2J"), line(length_ft="nan"), line(place=(91.0, 0.0))),
        *(line(elevation_ft=("high", 0)), "1,2"),
    )
    table = table_of(tmp_path, *rows)
    assert len(table) == 1
    assert table.left_out[NOT_A_RUNWAY] == 1
    assert table.left_out[NO_COORDINATES] == 3
    assert table.left_out[IMPOSSIBLE] == 7
    assert sum(table.left_out.values()) == len(rows) - 1


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "no column airport_ident"),
        (b"\xff\xfe\x00r", "no text in UTF-8"),
        (b"a,b\n1,2\n", "no column airport_ident"),
        (f"{HEAD}\n".encode(), "no runway in 0 rows"),
        (f"{HEAD}\n{'x' * 200_000}\n".encode(), "field larger than field limit"),
        (gzip.compress(HEAD.encode())[:-20], "damaged gzip"),
        (b"\x1f\x8bnonsense", "Unknown compression method|damaged gzip|Not a gzipped"),
        (gzip.compress(bytes(70_000_000)), "more than 64 MB"),
    ],
)
def test_a_hostile_file_is_a_line(content: bytes, told: str, tmp_path: Path) -> None:
    path = tmp_path / "runways.csv"
    path.write_bytes(content)
    with pytest.raises(GroundstationError, match=told) as error:
        read_ourairports(path, "2026-08-22")
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_is_a_line(tmp_path: Path) -> None:
    with pytest.raises(GroundstationError, match="No such file"):
        read_ourairports(tmp_path / "none.csv", "2026-08-22")
    with pytest.raises(GroundstationError, match="directory"):
        read_ourairports(tmp_path, "2026-08-22")


def damaged() -> dict[str, bytes]:
    """Tables that were made, and then damaged."""
    whole = SHIPPED.read_bytes()
    table = shipped_runways()
    other = io.BytesIO()
    np.savez(other, a=np.arange(3))
    turned = replace(table, latitude_deg=table.latitude_deg[:, ::-1])
    pickled = io.BytesIO()
    np.savez(pickled, about=np.array([object()]))
    kept = dict(np.load(SHIPPED))
    elsewhere, numbered = io.BytesIO(), io.BytesIO()
    np.savez(elsewhere, **(kept | {"surface": np.full_like(kept["surface"], 60_000)}))
    np.savez(numbered, **(kept | {"about": np.frombuffer(b"5", np.uint8)}))
    swollen = io.BytesIO()
    with zipfile.ZipFile(swollen, "w") as archive:
        archive.writestr("about.npy", b"\x93NUMPY")
    return {
        "cut": whole[: len(whole) // 2],
        "empty": b"",
        "text": b"not a table",
        "another archive": other.getvalue(),
        "another order": bytes_of(turned),
        "objects": pickled.getvalue(),
        "a surface that is not there": elsewhere.getvalue(),
        "a number for what it is about": numbered.getvalue(),
        "a cut array": swollen.getvalue(),
        "a changed byte": whole[:200_000] + bytes([whole[200_000] ^ 0xFF]) + whole[200_001:],
    }


@pytest.mark.parametrize("what", damaged())
def test_a_damaged_table_is_a_line(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    user_file().parent.mkdir(parents=True)
    user_file().write_bytes(damaged()[what])
    with pytest.raises(GroundstationError, match="not a table of runways") as error:
        runways()
    assert "\n" not in str(error.value)


def test_the_table_is_printed_with_its_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    found = runways_near(60.187, 11.074, 1.0)
    head, first = runways_text(found, everything=True).splitlines()[:2]
    assert "course deg" in head and "sigma along m" in head and "sigma course deg" in head
    assert first.split()[:2] == ["ENGM", "19R"] and first.endswith(" end")


@pytest.mark.parametrize(("ident", "expected"), [("zzzz", "such as ENGM"), ("ENGN", "one of EN"), ("ENGM 02", "01L")])
def test_an_unknown_airport_is_a_line_that_helps(
    ident: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(UsageError, match=expected):
        runways_of(ident)
