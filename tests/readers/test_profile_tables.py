"""Tables as people have them: blanks, fixed widths, GPS weeks, degrees and minutes, counters, several vehicles."""

import re
from pathlib import Path

import numpy as np
import pytest

from groundstation.base import arrow_values
from groundstation.base.errors import SettingsError
from groundstation.base.records import NewLog, RecordBatch
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.integrity.survey import survey
from groundstation.readers import cells, csv_profile, dms, profile_file, registry, row_shapes, rows, spaced
from groundstation.readers.profile_sources import known_as
from groundstation.readers.row_shapes import cell_places, shape_of
from groundstation.readers.source import Source
from groundstation.readers.spaced import SpacedSource
from tests.readers.test_flat_csv import Read
from tests.readers.test_profile import BASIC, files

PLACES = (
    'lat = { field = "gnss.latitude_deg", unit = "dms" }\nlon = { field = "gnss.longitude_deg", unit = "dms" }\n'
    'h = { field = "gnss.altitude_ellipsoid_m", unit = "m" }\n'
)
BLANKS = f'name = "p"\n[recognise]\ndelimiter = "blanks"\nheader_tells = true\nrows_after_header = 1\n{BASIC[11:]}'
UTC = iso_to_utc_ns("2024-05-06T10:00:00Z")[0]
DAY = 86_400 * NS_PER_S


def read(tmp_path: Path, text: str, table: str) -> Read:
    return Read(*files(tmp_path, text, table))


def test_blanks_part_the_columns_and_degrees_minutes_seconds_are_one(tmp_path: Path) -> None:
    table = (
        "Program: X\n\n   t          lat            lon         h\n (s)   (+/-D M S)    (+/-D M S)      (ft)\n"
        "  0   47 30 00.00  -122 15 36.0  1000\n 10    -0 30 00.00    -0 00 36.0    10\n\n 11  47 30 00.0 -122 15\n"
    )
    found = read(tmp_path, f"{BLANKS}[columns]\n{PLACES}", table)
    assert found.values("gnss", "latitude_deg") == [47.5, -0.5]
    assert found.values("gnss", "longitude_deg") == pytest.approx([-122.26, -0.01])
    assert found.values("gnss", "altitude_ellipsoid_m") == pytest.approx([304.8, 3.048])  # the row of units says feet
    assert found.rows("gnss") == [5, 6] and found.times("gnss") == [0, 10 * NS_PER_S]
    assert found.damage("dropped_rows").count == 1


@pytest.mark.parametrize("end", ["", "\n 12  47 30 03.0  -122 15 33.0  1000\n"], ids=["cut", "torn"])
@pytest.mark.parametrize("cells", range(1, 8))
def test_a_part_of_a_row_is_never_taken_for_a_row(tmp_path: Path, cells: int, end: str) -> None:
    head = "   t          lat            lon         h\n (s)   (+/-D M S)    (+/-D M S)      (m)\n"
    whole = " 10  47 30 00.0  -122 15 36.0  1000\n"
    part = "  ".join(["11", "47", "30", "01.0", "-122", "15", "35.0", "1000"][:cells])
    found = read(tmp_path, f"{BLANKS}[columns]\n{PLACES}", head + whole + " " + part + end)
    assert found.values("gnss", "longitude_deg") == pytest.approx(
        [-122.26, -122 - 15 / 60 - 33 / 3600][: 1 + bool(end)]
    )
    assert found.damage("dropped_rows" if end else "truncated").count == 1


def test_plain_degrees_of_the_same_column_have_a_cell_each(tmp_path: Path) -> None:
    found = read(tmp_path, f"{BLANKS}[columns]\n{PLACES}", "t lat lon h\n(s) (deg) (deg) (m)\n0\t47.5   -122.25\t1\n")
    assert found.values("gnss", "latitude_deg") == [47.5] and found.values("gnss", "longitude_deg") == [-122.25]


@pytest.mark.parametrize("name", ["lat", "# t"])
def test_blanks_before_a_comment_header_and_after_the_last_cell(tmp_path: Path, name: str) -> None:
    text = (
        BLANKS.replace("rows_after_header = 1\n", "")
        + '[columns]\nlat = { field = "gnss.latitude_deg", unit = "deg" }\n'
    )
    table = "# t  lat\n  1  47  \n2 48\n" if name == "# t" else "t  lat \n  1  47  \n2 48\n"
    assert read(tmp_path, text, table).values("gnss", "latitude_deg") == [47.0, 48.0]


def test_any_place_of_a_table_with_blanks_reads_as_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, path = np.random.default_rng(3), tmp_path / "x.txt"
    monkeypatch.setattr(spaced, "_PIECE_BYTES", 2048)
    for _ in range(40):
        path.write_bytes(bytes(rng.choice(np.frombuffer(b"  \tab1\n\n\r#", np.uint8), rng.integers(1, 9000))))
        source = SpacedSource(path, Source(path), 3, (1,))
        with source.open() as stream:
            assert stream.read() == source.head
            for place in rng.integers(0, source.size, 5).tolist():
                stream.seek(place)
                assert stream.read(13) == source.head[place : place + 13]


def test_columns_of_fixed_width_may_touch_or_be_empty(tmp_path: Path) -> None:
    text = f'name = "p"\n[recognise]\nwidths = [4, 8, 9, 6]\n{BASIC[11:]}[columns]\n{PLACES}'.replace("dms", "deg")
    table = "   t     lat      lon     h\n   147.50000-122.2500  10.0\n   2        -122.5000\n"
    found = read(tmp_path, text, table)
    assert found.values("gnss", "latitude_deg") == [47.5, None]
    assert found.values("gnss", "longitude_deg") == [-122.25, -122.5]
    assert found.values("gnss", "altitude_ellipsoid_m") == [10.0, None]
    assert found.times("gnss") == [NS_PER_S, 2 * NS_PER_S]


@pytest.mark.parametrize(
    ("last", "count"), [("   2 48.0000-122.", 0), ("   2 48.0000", 0), ("   2 48.0000-122.2500  1", 1)]
)
def test_a_row_of_fixed_width_that_is_cut_is_lost_as_others_are(tmp_path: Path, last: str, count: int) -> None:
    text = f'name = "p"\n[recognise]\nwidths = [4, 8, 9, 6]\n{BASIC[11:]}[columns]\n{PLACES}'.replace("dms", "deg")
    found = read(tmp_path, text, f"   t     lat      lon     h\n   1 47.5000-122.2500  10.0\n{last}")
    assert len(found.values("gnss", "latitude_deg")) == 1 + count
    if count:
        assert "no_final_newline" in found.remarks and not found.damages
    else:
        assert found.damage("truncated").count == 1


def numbers_of(rng: np.random.Generator, rows: int) -> list[list[str]]:
    """Cells of three columns, some of them empty."""
    return [
        [f"{number}", f"{rng.uniform(-90.0, 90.0):.{rng.integers(1, 9)}f}", rng.choice(["", "-1.5", "nan"])]
        for number in range(rows)
    ]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_many_rows_of_fixed_width_are_parted_as_few_are(monkeypatch: pytest.MonkeyPatch, end: str) -> None:
    rng = np.random.default_rng(5)
    rows = ["".join(cell.rjust(14) for cell in row).rstrip() for row in numbers_of(rng, 200)]
    lines = end.join([*rows, "", "# note  of   blanks", " a    text ", "  -  3", ""]).encode()
    source = spaced.FixedSource(Path("x"), Source(Path("x")), (14, 14, 14))
    plain = b"".join(source._parted(lines))
    monkeypatch.setattr(spaced, "COMPILED_BYTES", 0)
    compiled = b"".join(source._parted(lines))
    assert trimmed_cells(compiled) == trimmed_cells(plain) and len(compiled) < len(plain)
    kept = [line for line in plain.splitlines() if b"te" in line]
    assert [line for line in compiled.splitlines() if b"te" in line] == kept


def trimmed_cells(lines: bytes) -> list[list[bytes]]:
    """Cells between tabs; a carriage return ends a line too."""
    return [
        [b" ".join(cell.split()) for cell in line.split(b"\t")] for line in lines.replace(b"\r", b"\n").split(b"\n")
    ]


def test_many_lines_with_blanks_are_tabbed_as_few_are(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, alphabet = np.random.default_rng(3), np.frombuffer(b"    \t12-x#\n\n\r.\x1a", np.uint8)
    for _ in range(300):
        lines = bytes(rng.choice(alphabet, rng.integers(0, 200))) + b"\n"
        source = SpacedSource(Path("x"), Source(Path("x")), *((0, ()), (4, (0, 1)), (3, (1,)))[rng.integers(3)])
        monkeypatch.setattr(spaced, "COMPILED_BYTES", 1 << 20)
        plain, none = source.rows(lines)
        monkeypatch.setattr(spaced, "COMPILED_BYTES", 0)
        assert none is None and spaced.tabbed(lines, source.cells, source.joined) == plain
        tight, shape = source.rows(lines)
        counted = shape_of(tight, "\t")
        assert trimmed_cells(tight) == trimmed_cells(plain) and shape is not None
        assert (shape.ends.tolist(), shape.cells.tolist()) == (counted.ends.tolist(), counted.cells.tolist())
        ours, theirs = (re.split(rb"[\r\n]", one) for one in (tight, plain))
        assert [line for line in ours if line[:1] == b"#"] == [line for line in theirs if line[:1] == b"#"]


def test_shapes_by_compiled_loops_are_those_by_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = b"1,ab,3\n,,\n4,c d,\n"
    plain, places = shape_of(lines, ","), cell_places(lines, ",", 3, 1)
    monkeypatch.setattr(row_shapes, "COMPILED_BYTES", 0)
    compiled = shape_of(lines, ",", is_compiled=True)
    assert compiled.ends.tolist() == plain.ends.tolist() and compiled.cells.tolist() == plain.cells.tolist() == [3] * 3
    assert [one.tolist() for one in cell_places(lines, ",", 3, 1)] == [one.tolist() for one in places]


ANGLES = (
    *(
        "-0 30 00",
        "47:12:36.0",
        "8 30.5 W",
        "12°30′18″S",
        "-8.5",
        "47 61 0",
        "47 12 60",
        "N 1 2 3",
        "- 1 2",
        "+5",
        "-5",
    ),
    *(
        "1.",
        "nan",
        "5e1",
        "0x1",
        "é",
        "",
        "  ",
        "8d30m12s",
        "8d30m12.25s w",
        "8 30 s",
        "8:30",
        "8:30:",
        "1000 2 3",
        "\t7",
    ),
    *(
        "3 4 5.123456789012345",
        "8 30 12 5",
        "12.5 30",
        "S12 30",
        "12 30 S N",
        "8 5.",
        "8'30",
        "8 30'12\"",
        "x",
        "1234.56 ",
    ),
)


@pytest.mark.parametrize("missing", [(), ("x", "9999")])
def test_many_angles_are_read_as_few_are(missing: tuple[str, ...]) -> None:
    rng = np.random.default_rng(4)
    columns = [(one,) for one in ANGLES] + [tuple(rng.choice(ANGLES, 20)) for _ in range(50)]
    assert dms.is_quick(missing, dms.COMPILED_ROWS) and not dms.is_quick(("9 9 9",), dms.COMPILED_ROWS)
    for column in columns:
        text = arrow_values.texts(column)
        few = cells.degrees(cells.cleaned(text, missing))
        many = dms.degrees(text, lambda part: cells.cleaned(part, missing))
        assert (
            many.unreadable.tolist() == few.unreadable.tolist()
            and many.column.mask.tolist() == few.column.mask.tolist()
        )
        assert many.column.values.tobytes() == few.column.values.tobytes(), column


WEEKS = (
    'name = "p"\n[time]\nkind = "gps_week"\nweek = "w"\nseconds = "s"\nearliest_year = 2006\n'
    '[columns]\nv = { field = "gnss.hdop" }\n'
)


def test_gps_weeks_become_utc_less_the_leap_seconds_of_the_day(tmp_path: Path) -> None:
    found = read(
        tmp_path, WEEKS, "w,s,v\n2313,122418.25,1\n2313,604799.5,2\n2314,0,3\n-1,5,4\n2313.5,5,5\n2313,-4,6\n,,7\n"
    )
    utc_ns = [UTC + 250_000_000, UTC + (604_799_500 - 122_418_000) * 1_000_000, UTC + (604_800 - 122_418) * NS_PER_S]
    assert found.times("gnss") == [*utc_ns, None, None, None, None] and found.header.utc_of_zero_ns == 0
    assert found.damage("unreadable_cells").count == 3 and "leap seconds" in found.remarks["converted"].text


def test_a_leap_second_between_two_rows_counts(tmp_path: Path) -> None:
    found = read(tmp_path, WEEKS, "w,s,v\n1930,16,1\n1930,18,2\n")
    assert found.times("gnss") == [iso_to_utc_ns(f"2016-12-31T23:59:{s}Z")[0] for s in (59, 60)]


def test_weeks_that_rolled_over_are_moved_and_told(tmp_path: Path) -> None:
    found = read(tmp_path, WEEKS, f"w,s,v\n{2313 - 1024},122418,1\n")
    assert (
        found.times("gnss") == [UTC]
        and "so the GPS week rolled over: read as 2024-05-06" in found.remarks["week_rollover"].text
    )
    kept = read(tmp_path, WEEKS.replace("earliest_year = 2006\n", ""), "w,s,v\n1289,122418,1\n")
    assert kept.times("gnss") == [iso_to_utc_ns("2004-09-20T10:00:05Z")[0]]  # 13 leap seconds at that time


def test_a_week_that_stays_at_midnight_of_saturday_is_counted_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some writers keep the week of the first row: the seconds begin anew, also between two blocks of rows."""
    monkeypatch.setattr(rows, "BLOCK_BYTES", 60)
    seconds = [604_790 + k for k in range(20)]
    table = "w,s,v\n" + "".join(f"2313,{s % 604_800},1\n" for s in seconds) + "2314,10,1\n2313,9,1\n"
    found = read(tmp_path, WEEKS, table)
    times = np.array(found.times("gnss"))
    assert np.diff(times[:21]).tolist() == [NS_PER_S] * 20 and times[21] < times[0]  # the last row is of its own week
    assert found.remarks["late_week"].text.startswith("10 rows")
    assert "late_week" not in read(tmp_path, WEEKS, "w,s,v\n2313,604799,1\n2314,0,1\n2313,604799,1\n").remarks


@pytest.mark.parametrize(
    ("unit", "text"), [("s", "1714989600.5"), ("ms", "1714989600500"), ("ns", "1714989600500000000")]
)
def test_unix_times(tmp_path: Path, unit: str, text: str) -> None:
    settings = BASIC.replace("seconds", "unix") + f'unit = "{unit}"\n[columns]\nv = {{ field = "gnss.hdop" }}\n'
    found = read(tmp_path, settings, f"t,v\n{text},1\n")
    assert found.times("gnss") == [UTC + NS_PER_S // 2] and found.header.utc_of_zero_ns == 0


OF_DAY = (
    'name = "p"\n[time]\nkind = "time_of_day"\ncolumn = "t"\ndate = "day"\ndate_formats = ["%m/%d/%y"]\n'
    "[metadata.find]\nday = 'Log of (\\S+)'\n[columns]\nv = { field = \"gnss.hdop\" }\n"
)


def test_times_of_the_day_pass_midnight(tmp_path: Path) -> None:
    found = read(tmp_path, OF_DAY, "Log of 5/6/24\nt,v\n23:59:59.5,1\n00:00:01,2\n23:59:58,3\n00:00:02,4\nlater,5\n")
    day = iso_to_utc_ns("2024-05-06T00:00:00Z")[0]
    seconds = [86_399.5, 86_401, 86_398, 86_402]
    assert found.times("gnss") == [*(day + int(s * NS_PER_S) for s in seconds), None]
    assert "assumed_utc" in found.remarks and found.header.utc_of_zero_ns == 0
    assert read(tmp_path, OF_DAY, "Log of today\nt,v\n10:00:00,1\n").header.utc_of_zero_ns is None


def test_midnight_between_two_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BLOCK_BYTES", 40)
    table = "".join(f"23:59:{s},1\n" for s in range(50, 60)) + "".join(f"00:00:0{s},1\n" for s in range(10))
    times = read(tmp_path, OF_DAY, f"Log of 5/6/24\nt,v\n{table}").times("gnss")
    assert np.diff(np.array(times)).tolist() == [NS_PER_S] * 19


COUNTED = (
    'name = "p"\n[time]\nkind = "utc_counter"\nutc = "utc"\ncounter = "c"\n[columns]\nv = { field = "gnss.hdop" }\n'
)


def test_a_counter_that_runs_on_gets_its_zero_by_the_changes_of_the_second(tmp_path: Path) -> None:
    counts = 1_000.03 + np.arange(160) / 16.0  # the first row is 30 ms after a second
    table = "".join(f"2024-05-06 10:00:{int(c - 1_000.0):02d},{c:.4f},1\n" for c in counts)
    found = read(tmp_path, COUNTED, f"utc,c,v\n,999.9,1\n{table}")
    zero_ns = UTC - 1_000 * NS_PER_S
    assert found.header.utc_of_zero_ns == pytest.approx(zero_ns - 30_000_000, abs=1_000_000)  # at most a period late
    assert found.times("gnss")[:2] == [999_900_000_000, 1_000_030_000_000]
    assert found.header.utc_readings is not None and "utc_from_seconds" in found.remarks


def test_a_counter_that_begins_anew_is_the_fraction(tmp_path: Path) -> None:
    settings = COUNTED.replace('counter = "c"', 'counter = "c"\nunit = "ms"')
    table = "".join(f"2024-05-06T10:00:0{k // 4}Z,{k % 4 * 250},1\n" for k in range(12))
    found = read(tmp_path, settings, f"utc,c,v\n{table}")
    assert found.times("gnss") == [UTC + k * NS_PER_S // 4 for k in range(12)] and found.header.utc_of_zero_ns == 0


def test_a_counter_beside_no_utc_has_no_absolute_time(tmp_path: Path) -> None:
    found = read(tmp_path, COUNTED, "utc,c,v\n,1,1\n,2,1\n")
    assert (
        found.header.utc_of_zero_ns is None
        and "no_utc" in found.remarks
        and found.times("gnss") == [NS_PER_S, 2 * NS_PER_S]
    )


KEYED = (
    'name = "p"\n[time]\nkind = "unix"\ncolumn = "t"\n[key]\ncolumn = "id"\n[columns]\n'
    'lat = { field = "gnss.latitude_deg", unit = "deg" }\n'
)


def mixed(seconds: int = 300) -> str:
    """Rows of three vehicles side by side, and one that names none."""
    lines = [
        f"{1714989600 + s},{one},{47 + 0.001 * s + number:.3f}"
        for s in range(seconds)
        for number, one in enumerate(("aa", "bb", "cc"))
    ]
    return "\n".join(["t,id,lat", *lines, "1714989600,,1", ""])


def test_each_vehicle_of_a_table_has_a_log_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "BLOCK_BYTES", 1000)
    log, settings = files(tmp_path, KEYED, mixed())
    items = list(registry.read(log, settings))
    starts = [one for one in items if isinstance(one, NewLog)]
    assert [one.metadata["aircraft"] for one in starts] == ["bb", "aa"]
    found = Read(log, settings)
    assert found.header.metadata["aircraft"] == "cc" and "3 vehicles" in found.remarks["vehicles"].text
    values, index = np.array(found.values("gnss", "latitude_deg")), np.array(found.rows("gnss"))
    assert (np.diff(index) > 0).all() and found.damage("dropped_rows").count == 1
    for place, first in ((0, 49.0), (300, 48.0), (600, 47.0)):
        assert values[place : place + 300] == pytest.approx(first + 0.001 * np.arange(300))
    parts = survey(iter(items)).ledger.power_ups
    assert len(parts) == 3 and [one.metadata.get("aircraft") for one in parts][1:] == ["bb", "aa"]
    assert [one.start_ns for one in parts] == [UTC] * 3


def test_only_some_vehicles_are_read(tmp_path: Path) -> None:
    found = read(tmp_path, KEYED.replace('"id"\n', '"id"\nonly = ["bb"]\n'), mixed(5))
    assert found.values("gnss", "latitude_deg") == pytest.approx([48.0, 48.001, 48.002, 48.003, 48.004])
    assert found.header.metadata["aircraft"] == "bb"


def test_more_vehicles_than_logs_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.readers.vehicles.MOST", 2)
    found = read(tmp_path, KEYED, "t,id,lat\n1,a,1\n1,b,1\n1,c,1\n2,a,1\n2,c,1\n")
    assert len(found.values("gnss", "latitude_deg")) == 4
    assert sum(one.count for one in found.damages if one.kind == "dropped_rows") == 1


def test_variances_qualities_and_texts_by_value(tmp_path: Path) -> None:
    text = BASIC + (
        '[columns]\nvar = { field = "gnss.position_north_sigma_m", unit = "cm", variance = true }\n'
        'q = [{ field = "gnss.fix", values = { "1" = "rtk_fixed", "2" = "3d" } },\n'
        ' { field = "gnss.horizontal_sigma_m", unit = "cm", values = { "1" = 2, "2" = 300 } }]\n'
        'ok = { field = "gnss.integrity_ok", values = { A = true, V = false } }\n'
    )
    found = read(tmp_path, text, "t,var,q,ok\n0,4,1,A\n1,-1,2.0,V\n2,,7,?\n")
    assert found.values("gnss", "position_north_sigma_m") == [0.02, None]  # the last row has nothing
    assert found.values("gnss", "fix") == ["rtk_fixed", "3d"]
    assert found.values("gnss", "horizontal_sigma_m") == [0.02, 3.0]
    assert found.values("gnss", "integrity_ok") == [True, False]
    assert sum(one.count for one in found.damages if one.kind == "unreadable_cells") == 4


def test_values_that_mean_missing(tmp_path: Path) -> None:
    text = (
        'missing = ["N/A", "-", 9999]\n'
        + BASIC
        + (
            '[columns]\nv = { field = "gnss.hdop" }\nm = { field = "ins.mode", missing = ["?"] }\n'
            'w = { field = "gnss.pdop", missing = [-1] }\n'
        )
    )
    found = read(tmp_path, text, "t,v,m,w,r\n0,1,nav,2,5\n1, N/A ,-,-1.0,N/A\n2,9999.0,?,3,9999\n3,-,N/A,-,7\n")
    assert found.rows("gnss") == [2, 4]  # the others have neither
    assert found.values("gnss", "hdop") == [1.0, None] and found.values("gnss", "pdop") == [2.0, 3.0]
    assert [one for one in found.values("ins", "mode") if one] == ["nav"]
    assert [one for one in found.values("raw.p", "r") if one is not None] == [5.0, 9999.0, 7.0]  # no rule: as it stands
    assert not found.damages


def test_words_of_one_cell(tmp_path: Path) -> None:
    text = BASIC + (
        '[columns]\nGPS = [{ field = "gnss.latitude_deg", unit = "deg", part = 1 },\n'
        ' { field = "gnss.longitude_deg", unit = "deg", part = 2 }]\n'
    )
    found = read(tmp_path, text, "t,GPS\n0,47.5 -8.25\n1,\n2,46\n")
    assert found.values("gnss", "latitude_deg") == [47.5, 46.0]
    assert found.values("gnss", "longitude_deg") == [-8.25, None]


def test_degrees_minutes_and_seconds_in_three_columns(tmp_path: Path) -> None:
    text = BASIC + (
        "[columns]\n[[derived]]\n"
        'field = "gnss.latitude_deg"\nmethod = "from_degrees_minutes_seconds"\n'
        'degrees = { column = "d", unit = "deg" }\nminutes = { column = "m", unit = "arcmin" }\n'
        'seconds = { column = "s", unit = "arcsec" }\n'
    )
    found = read(tmp_path, text, "t,d,m,s\n0,-0,30,36\n1,47,0,36\n2,47,,0\n")
    assert found.values("gnss", "latitude_deg") == pytest.approx([-0.51, 47.01])  # not -0 as 0


HDOP = '[columns]\nv = { field = "gnss.hdop" }\n'


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (BASIC.replace("seconds", "gps_week") + HDOP, "time.column"),
        (BASIC.replace("seconds", "time_of_day") + HDOP, "time.date"),
        (COUNTED.replace('utc = "utc"\n', 'date = "d"\n'), "time.time"),
        (OF_DAY.replace('date = "day"', 'date = "dat"'), "time.date"),
        (WEEKS.replace("2006", "1904"), "time.earliest_year"),
        (WEEKS.replace("2006", '"old"'), "time.earliest_year"),
        (f'name = "p"\n[recognise]\ndelimiter = "."\n{BASIC[11:]}{HDOP}', "recognise.delimiter"),
        (f'name = "p"\n[recognise]\ndelimiter = "blanks"\nwidths = [3]\n{BASIC[11:]}{HDOP}', "recognise.delimiter"),
        (f'name = "p"\n[recognise]\nwidths = [0]\n{BASIC[11:]}{HDOP}', "recognise.widths"),
        (f'name = "p"\n[recognise]\nwidths = [1.5]\n{BASIC[11:]}{HDOP}', "recognise.widths"),
        (f'name = "p"\n[recognise]\nwidths = 7\n{BASIC[11:]}{HDOP}', "recognise.widths"),
        (f"missing = 7\n{BASIC}{HDOP}", "missing"),
        (f"missing = [true]\n{BASIC}{HDOP}", "missing"),
        (f'{BASIC}[key]\nname = "id"\n{HDOP}', "key.name"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.hdop", variance = true }}\n', "columns.v.variance"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.hdop", values = {{}} }}\n', "columns.v.values"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.hdop", values = {{ a = "b" }} }}\n', "columns.v.values.a"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.fix", values = {{ a = 1 }} }}\n', "columns.v.values.a"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.hdop", part = -1 }}\n', "columns.v.part"),
        (f'{BASIC}[columns]\nv = {{ field = "gnss.hdop", unit = "dms" }}\n', "columns.v.unit"),
    ],
)
def test_a_mistake_names_its_key(tmp_path: Path, text: str, key: str) -> None:
    _log, settings = files(tmp_path, text, "")
    with pytest.raises(SettingsError, match=rf"my\.toml, {key}"):
        profile_file.load(settings)


def test_a_shipped_profile_is_known_by_its_name(tmp_path: Path) -> None:
    assert profile_file.load(known_as(Path("garmin-g5"))).name == "garmin-g5"
    own = tmp_path / "garmin-g5"
    own.write_text(f"{BASIC}{HDOP}")
    assert profile_file.load(known_as(own)).name == "p"


def test_a_block_that_ends_inside_a_line_loses_no_row(tmp_path: Path) -> None:
    settings = BLANKS.replace("rows_after_header = 1\n", "") + '[columns]\nv = { field = "gnss.hdop" }\n'
    log, own = files(tmp_path, settings, "t v\n" + "".join(f" {k}   {k % 50}\n" for k in range(300_000)))
    batches = [one for one in csv_profile.read(Source(log), own) if isinstance(one, RecordBatch)]
    assert sum(map(len, batches)) == 300_000
