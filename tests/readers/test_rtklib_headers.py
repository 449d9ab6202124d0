"""RTKLIB solutions: a header governs the rows below it, and numbers of fixed width may touch."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.base.ecef import ecef_from_n, ecef_m
from groundstation.readers import registry, sections
from groundstation.readers.rtklib_header import _reference
from tests.readers.test_trajectories import Read
from tests.readers.trajectory_writer import (
    BASELINE,
    ECEF,
    ECEF_VELOCITY,
    GEODETIC,
    LATITUDE,
    LONGITUDE,
    MINUTES,
    PLACE,
    pos,
)
from tests.real_logs import real_log

DEGREES, METRES = 1e-8, 1e-3  # of nine decimals, of four
UTC = "2025-08-28T17:30:21.749000000Z"
TIMES = {"GPST": "2025/08/28 17:30:39.749", "UTC": "2025/08/28 17:30:21.749", "JST": "2025/08/29 02:30:21.749"}
WEEK = "2381 408639.749"
DMS = "51 30 00.00000  -0 42 00.00000 147.0000"
XYZ = "  ".join(f"{part:.4f}" for part in ecef_m(51.5, -0.7, 147.0))
BASE = (40.086179918, -105.206044414, 1575.6355)


def solution(form: str, cells: str, scale: str = "GPST", time: str = "", top: str = "") -> bytes:
    content = pos(form, cells, scale, time or TIMES[scale], top)
    return content.replace(b" vn(m/s) ve(m/s) vu(m/s)", ECEF_VELOCITY.encode()) if form == ECEF else content


FORMS = {
    **{scale: solution(GEODETIC, PLACE, scale) for scale in TIMES},
    "week": solution(GEODETIC, PLACE, time=WEEK),
    "minutes": solution(MINUTES, DMS),
    "ecef": solution(ECEF, XYZ, "UTC"),
    "no velocity": b"\n".join(
        line.partition(b" vn(m/s)")[0] if line.startswith(b"%") else line[: line.index(b"999.9") + 5]
        for line in solution(GEODETIC, PLACE).splitlines()
    )
    + b"\n",
}


def parts(read: Read, field: str) -> list[float]:
    return [float(value) for value in read.values("gnss", field) if value is not None]


@pytest.mark.parametrize("first", FORMS)
@pytest.mark.parametrize("second", FORMS)
def test_solutions_that_were_appended(tmp_path: Path, first: str, second: str) -> None:
    read = Read(tmp_path / "a.pos", FORMS[first] + FORMS[second])
    assert read.times("gnss") == [UTC] * 6 and not read.damages
    assert parts(read, "latitude_deg") == pytest.approx([LATITUDE] * 6, abs=DEGREES)
    assert parts(read, "longitude_deg") == pytest.approx([LONGITUDE] * 6, abs=DEGREES)
    assert parts(read, "altitude_ellipsoid_m") == pytest.approx([147.0] * 6, abs=METRES)
    lines = FORMS[first].count(b"\n")
    index = [int(row) for batch in read.batches("gnss") for row in batch.record_index]
    assert index == [3, 4, 5, lines + 3, lines + 4, lines + 5]


@given(st.lists(st.sampled_from(sorted(FORMS)), min_size=1, max_size=8), st.sampled_from([97, 1000, 1 << 20]))
@settings(max_examples=25, deadline=None)
def test_any_order_of_solutions(tmp_path_factory: pytest.TempPathFactory, forms: list[str], piece: int) -> None:
    before = sections._PIECE_BYTES
    sections._PIECE_BYTES = piece
    try:
        read = Read(tmp_path_factory.mktemp("p") / "a.pos", b"".join(FORMS[form] for form in forms))
    finally:
        sections._PIECE_BYTES = before
    assert read.times("gnss") == [UTC] * 3 * len(forms) and not read.damages
    assert parts(read, "latitude_deg") == pytest.approx([LATITUDE] * 3 * len(forms), abs=DEGREES)


def test_a_file_whose_second_part_is_in_utc_is_not_22_s_early(tmp_path: Path) -> None:
    """Rows of 10 Hz in GPST, then the same recorder's in UTC."""
    read = Read(tmp_path / "a.pos", FORMS["GPST"] + solution(GEODETIC, PLACE, "UTC", "2025/08/28 17:30:22.749"))
    assert read.times("gnss") == [UTC] * 3 + ["2025-08-28T17:30:22.749000000Z"] * 3
    assert "times in UTC" in read.remark("second_header")


def test_heights_by_each_header(tmp_path: Path) -> None:
    tops = [f"\n% (lat/lon/height=WGS84/{heights},Q=1:fix)" for heights in ("ellipsoidal", "geodetic")]
    content = b"".join(solution(GEODETIC, PLACE, top=top) for top in tops) + FORMS["GPST"]
    read = Read(tmp_path / "a.pos", content)
    assert read.values("gnss", "altitude_ellipsoid_m") == [147.0] * 3 + [None] * 3 + [147.0] * 3
    assert read.values("gnss", "altitude_msl_m") == [None] * 3 + [147.0] * 3 + [None] * 3
    assert "does not say" in read.remark("assumed")


def test_a_path_of_that_name_says_nothing_of_heights(tmp_path: Path) -> None:
    read = Read(tmp_path / "a.pos", solution(GEODETIC, PLACE, top="\n% inp file  : /data/geodetic/a.obs"))
    assert read.values("gnss", "altitude_ellipsoid_m") == [147.0] * 3


def test_a_line_of_names_that_stands_again_alone_keeps_what_was_known(tmp_path: Path) -> None:
    top = "\n% (lat/lon/height=WGS84/geodetic,Q=1:fix)"
    content = solution(GEODETIC, PLACE, top=top)
    names = next(line for line in content.splitlines() if b"GPST" in line)
    rows = [line for line in content.splitlines() if not line.startswith(b"%")]
    read = Read(tmp_path / "a.pos", content + b"\n".join([names, *rows, b"% a remark", *rows, b""]))
    assert read.values("gnss", "altitude_msl_m") == [147.0] * 9 and not read.remark("second_header")


def test_each_base_station_for_its_rows(tmp_path: Path) -> None:
    """A second base in the middle moves the rows below it; a header without one has none."""
    cells = "0.0000 0.0000 0.0000"
    tops = [
        "\n% ref pos   : 51.500000000  -0.700000000   147.0000",
        "\n% ref pos   : 52.500000000  -0.700000000 147.0000",
    ]
    content = b"".join(solution(BASELINE, cells, top=top) for top in (*tops, ""))
    read = Read(tmp_path / "a.pos", content)
    latitude = read.values("gnss", "latitude_deg")
    assert latitude == [pytest.approx(51.5)] * 3 + [pytest.approx(52.5)] * 3 + [None] * 3
    moved = solution(BASELINE, cells, top=tops[0]) + tops[1].strip().encode() + b"\n"
    moved += b"\n".join(solution(BASELINE, cells).splitlines()[2:]) + b"\n"
    again = Read(tmp_path / "b.pos", moved).values("gnss", "latitude_deg")
    assert again == [pytest.approx(51.5)] * 3 + [pytest.approx(52.5)] * 3


REFERENCES = [
    ("40.086179918-105.206044414 1575.6355", BASE),
    (" 40.086179918 -105.206044414  1575.6355", BASE),
    ("-40.086179918-105.206044414-1575.6355", (-BASE[0], BASE[1], -BASE[2])),
    ("40.086179918,-105.206044414,1575.6355", BASE),
    ("40.086179918 105.20604441412575.6355", (BASE[0], -BASE[1], 12575.6355)),  # 10 km up: three numbers that touch
    ("40 05 10.24770-105 12 21.75989 1575.6355", BASE),
    ("40 05 10.24770 -105 12 21.75989-1575.6355", (BASE[0], BASE[1], -BASE[2])),
    (" -0 30 00.00000  -0 12 36.00000   10.0000", (-0.5, -0.21, 10.0)),
    ("".join(f"{part:14.4f}" for part in ecef_m(*BASE)), BASE),
    ("".join(f"{part:13.4f}" for part in ecef_m(*BASE)), BASE),
    ("-1.0 2.0", None),
    ("91.0 0.0 0.0", None),
    ("somewhere", None),
]


@pytest.mark.parametrize(("text", "expected"), REFERENCES, ids=[text.strip()[:30] for text, _place in REFERENCES])
def test_places_of_a_base(text: str, expected: tuple[float, float, float] | None) -> None:
    found = _reference(f"% program : RTKLIB\n% ref pos   : {text}\n%")
    if expected is None:
        assert found is None
    else:
        assert found is not None and found[:2] == pytest.approx(expected[:2], abs=DEGREES)
        assert found[2] == pytest.approx(expected[2], abs=METRES)


@given(
    st.floats(-89.0, 89.0),
    st.floats(-180.0, 180.0),
    st.floats(-999.0, 9999.0),
    st.booleans(),
    st.sampled_from(["", " "]),
)
@settings(max_examples=100, deadline=None)
def test_any_base_as_rtklib_writes_it(
    latitude: float, longitude: float, height: float, in_ecef: bool, separator: str
) -> None:
    """%13.9f%14.9f%10.4f, or %14.4f three times, with a blank between or without."""
    numbers = ecef_m(latitude, longitude, height) if in_ecef else (latitude, longitude, height)
    formats = ("14.4f",) * 3 if in_ecef else ("13.9f", "14.9f", "10.4f")
    text = separator.join(format(float(number), form) for number, form in zip(numbers, formats, strict=True))
    found = _reference(f"% ref pos   : {text}")
    assert found is not None
    assert np.abs(ecef_m(*found) - ecef_m(latitude, longitude, height)).max() < 1e-2


@pytest.mark.parametrize(
    ("form", "touching"),
    [
        (GEODETIC, "51.500000000-0.700000000 147.0000"),
        (MINUTES, "51 30 00.00000-0 42 00.00000 147.0000"),
        (ECEF, XYZ.replace("  -", "-")),
    ],
)
def test_cells_of_rows_that_touch(tmp_path: Path, form: str, touching: str) -> None:
    read = Read(
        tmp_path / "a.pos", solution(form, touching).replace(b" 0.0000 0.0000 0.0000", b" 0.0000-0.1000-0.2000")
    )
    assert parts(read, "latitude_deg") == pytest.approx([LATITUDE] * 3, abs=DEGREES)
    assert parts(read, "longitude_deg") == pytest.approx([LONGITUDE] * 3, abs=DEGREES)
    assert read.values("raw.pos", "sdun") == [-0.2] * 3 and not read.damages


def test_a_number_with_an_exponent_is_one(tmp_path: Path) -> None:
    read = Read(tmp_path / "a.pos", solution(GEODETIC, PLACE).replace(b" 0.0300 ", b" 3.0e-02 "))
    assert read.values("raw.pos", "sdn") == [0.03] * 3 and not read.damages


def test_too_many_headers_leave_the_rest_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.readers.rtklib_header.MOST", 2)
    content = (FORMS["GPST"] + FORMS["UTC"]) * 2
    read = Read(tmp_path / "a.pos", content)
    assert len(read.times("gnss")) == 6 and [one.kind for one in read.damages] == ["dropped_rows"]
    assert read.damages[0].place == "rows 11 to 20" and read.damages[0].loses_data


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["cases/p1_refpos_run_together.pos", "gnss/rtklib_demo1_out.pos"])
def test_recorded_solutions_from_a_base_west_of_100_w(name: str) -> None:
    read = Read.__new__(Read)
    read.items = list(registry.read(real_log(name)))
    latitude, longitude = parts(read, "latitude_deg"), parts(read, "longitude_deg")
    east_m, north_m, up_m = (read.values("raw.pos", f"{axis}-baseline")[0] for axis in "enu")
    axes = ecef_from_n(*BASE[:2])
    first = ecef_m(*BASE) + axes @ np.array([north_m, east_m, -up_m], dtype=float)
    assert np.abs(ecef_m(latitude[0], longitude[0], parts(read, "altitude_ellipsoid_m")[0]) - first).max() < METRES
    if "demo1" in name:
        assert (round(latitude[0], 8), round(longitude[0], 8)) == (40.08618098, -105.20605258)
    assert not read.remark("no_position")
