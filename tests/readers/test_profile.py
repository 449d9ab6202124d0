"""Profiles: every conversion, every check of a slip, derived fields with their signs."""

import math
import re
from pathlib import Path

import pytest

from groundstation.base.errors import SettingsError, UnreadableLogError
from groundstation.base.records import Damage, RecordBatch, Remark
from groundstation.base.signals import TOPICS
from groundstation.base.source_units import source_units
from groundstation.base.units import CONVERSIONS, NS_PER_S
from groundstation.readers import profile_file as profiles
from groundstation.readers import registry
from groundstation.readers.layout import METHODS
from groundstation.readers.profile import TIME_UNITS
from groundstation.readers.profile_heads import SHIPPED, head_of, that_may_fit
from groundstation.readers.source import Source
from tests.readers.test_flat_csv import Read

BASIC = 'name = "p"\n[time]\nkind = "seconds"\ncolumn = "t"\n'
# One canonical field of each unit, to feed 1.0 through.
FIELD_OF_UNIT = {
    "deg": "ins.roll_deg",
    "m": "ins.altitude_msl_m",
    "mps": "ins.velocity_north_mps",
    "dps": "ins.rate_x_dps",
    "mps2": "ins.accel_x_mps2",
    "nt": "magnetometer.field_down_nt",
    "a": "electric.current_a",
    "dots": "guidance.lateral_deviation_dots",
    "mhz": "guidance.frequency_mhz",
    "dbhz": "gnss.cn0_dbhz",
    "s": "gnss.age_of_corrections_s",
    "c": "imu.temperature_c",
    "": "gnss.hdop",
}
FACTORS = {
    "deg": 1.0,
    "rad": 57.29577951308232,
    "arcmin": 1 / 60,
    "arcsec": 1 / 3600,
    "deg1e7": 1e-7,
    "semicircle": 180.0,
    "m": 1.0,
    "mm": 1e-3,
    "cm": 1e-2,
    "km": 1e3,
    "ft": 0.3048,
    "nmi": 1852.0,
    "mps": 1.0,
    "cmps": 1e-2,
    "mmps": 1e-3,
    "kt": 0.5144444444444445,
    "kmh": 1 / 3.6,
    "fpm": 0.00508,
    "fps": 0.3048,
    "dps": 1.0,
    "radps": 57.29577951308232,
    "mps2": 1.0,
    "g": 9.80665,
    "fps2": 0.3048,
    "nt": 1.0,
    "ut": 1e3,
    "gauss": 1e5,
    "mgauss": 100.0,
    "a": 1.0,
    "ma": 1e-3,
    "dots": 1.0,
    "fsd": 2.0,
    "mhz": 1.0,
    "dbhz": 1.0,
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "c": 1.0,
    "": 1.0,
    "percent": 0.01,
}


def files(tmp_path: Path, profile: str, table: str) -> tuple[Path, Path]:
    log, settings = tmp_path / "log.txt", tmp_path / "my.toml"
    log.write_text(table, encoding="utf-8")
    settings.write_text(profile, encoding="utf-8")
    return log, settings


def test_every_unit_has_a_factor_here() -> None:
    assert FACTORS.keys() == CONVERSIONS.keys()


@pytest.mark.parametrize("unit", CONVERSIONS)
def test_one_through_every_unit(tmp_path: Path, unit: str) -> None:
    field = FIELD_OF_UNIT[CONVERSIONS[unit][0]]
    given = f', unit = "{unit}"' if unit else ""
    log, settings = files(tmp_path, BASIC + f'[columns]\nv = {{ field = "{field}"{given} }}\n', "t,v\n0,1.0\n")
    topic, _, name = field.rpartition(".")
    assert Read(log, settings).values(topic, name) == [pytest.approx(FACTORS[unit], rel=1e-15)]


def test_scale_sign_and_offset_are_in_the_unit_of_the_column(tmp_path: Path) -> None:
    entry = '{ field = "ins.accel_z_mps2", unit = "g", scale = 0.001, sign = -1, offset = -1.0 }'
    log, settings = files(tmp_path, BASIC + f"[columns]\nv = {entry}\n", "t,v\n0,500\n")
    assert Read(log, settings).values("ins", "accel_z_mps2") == [pytest.approx(-1.5 * 9.80665)]


@pytest.mark.parametrize(
    ("unit", "ns"), [("s", 1.5e9), ("ms", 1.5e6), ("us", 1500), ("ns", 1), ("min", 9e10), ("h", 5.4e12)]
)
def test_units_of_time(tmp_path: Path, unit: str, ns: float) -> None:
    text = BASIC + f'unit = "{unit}"\n[columns]\nv = {{ field = "gnss.hdop" }}\n'
    log, settings = files(tmp_path, text, "t,v\n1.5,1\n")
    assert Read(log, settings).times("gnss") == [int(ns)]
    log.write_text("t,v\n1700000000123456.789,1\n")
    expected = {"us": [1700000000123456789], "ns": [1700000000123456], "ms": [1700000000123456789000]}
    if unit in expected:
        time = expected[unit] if expected[unit][0] < 2**62 else [None]
        assert Read(log, settings).times("gnss") == time


def test_other_columns_are_kept_raw_and_text_fields_go_through(tmp_path: Path) -> None:
    text = BASIC + '[columns]\nm = { field = "ins.mode" }\nw = { field = "discrete.weight_on_wheels" }\n'
    log, settings = files(tmp_path, text, "t;m;w;volts\n0;nav;true;28\n")
    read = Read(log, settings)
    assert read.header.reader == "csv-profile p" and read.header.utc_of_zero_ns is None
    assert read.values("ins", "mode") == ["nav"] and read.values("discrete", "weight_on_wheels") == [True]
    assert read.values("raw.p", "volts") == [28.0] and read.rows("ins") == [2]


def test_preamble_units_row_and_metadata(tmp_path: Path) -> None:
    text = """
name = "lab"
[recognise]
columns = ["t", "v"]
rows_after_header = 1
[time]
kind = "seconds"
column = "t"
[metadata.find]
tail = 'Tail:\\s*(\\S+)'
start_utc = 'Start: (\\S+)'
nothing = 'Nowhere: (\\S+)'
[metadata.set]
type = "Il-76"
[metadata.join]
aircraft = "{type} {tail}"
[columns]
v = { field = "gnss.hdop" }
"""
    table = "Lab recorder\nTail: RA-7\nStart: 1970-01-01T00:00:05Z\n\n t , v \n s , - \n0,1\n t,v\n1,2\n"
    read = Read(*files(tmp_path, text, table))
    assert read.values("gnss", "hdop") == [1.0, 2.0] and read.rows("gnss") == [7, 9]
    assert read.header.metadata["aircraft"] == "Il-76 RA-7" and read.header.utc_of_zero_ns == 5 * NS_PER_S
    assert "nothing" not in read.header.metadata and not read.damages[0].loses_data
    assert read.header.metadata["units.raw.lab"] == "t s"


def test_units_above_the_header_stay_with_the_flight(tmp_path: Path) -> None:
    text = """
name = "lab"
[recognise]
columns = ["t", "oil"]
[time]
kind = "seconds"
column = "t"
[columns]
"""
    read = Read(*files(tmp_path, text, "#Lab, 7\n# s,  deg C, \nt,oil,mode\n0,80,1\n"))
    assert source_units(read.header.metadata, "raw.lab", ("t", "oil", "mode")) == {"t": "s", "oil": "deg C"}


def test_columns_that_the_file_lacks_are_told(tmp_path: Path) -> None:
    text = BASIC + '[columns]\nv = { field = "gnss.hdop" }\nw = { field = "gnss.pdop" }\n'
    read = Read(*files(tmp_path, text, "t,v\n0,1\n"))
    assert read.topics == ["gnss"] and "w" in read.remarks["missing_columns"].text


def test_a_file_without_the_time_column_is_refused(tmp_path: Path) -> None:
    log, settings = files(tmp_path, BASIC + '[columns]\nv = { field = "gnss.hdop" }\n', "time,v\n0,1\n")
    with pytest.raises(UnreadableLogError, match=r"profile p.* t\b"):
        registry.identify(log, settings)


LOCAL = """
name = "local"
[time]
kind = "local"
date = "d"
time = "t"
offset = "o"
date_formats = ["%Y-%m-%d", "%d/%m/%Y", "%d.%m.%y"]
[columns]
v = { field = "gnss.hdop" }
"""


def test_local_time_minus_offset_is_utc_in_several_date_formats(tmp_path: Path) -> None:
    table = (
        "d,t,o,v\n1970-01-02,03:00:00,+03:00,1\n02/01/1970,00:00:01.25,,2\n02.01.70,00:00:02,-00:30,3\n"
        ",,,4\n1970-13-45,00:00:00,,5\n1970-01-02,25:00:00,,6\n1970-01-02,00:00:03,soon,7\n1970-01-02,,,8\n"
    )
    read = Read(*files(tmp_path, LOCAL, table))
    day = 86_400 * NS_PER_S
    late = [day, day + 1_250_000_000, day + 1802 * NS_PER_S]
    assert read.times("gnss") == [*late, None, None, None, None, None] and read.header.utc_of_zero_ns == 0
    assert read.damage("unreadable_cells").count == 3 and read.values("gnss", "hdop") == [1, 2, 3, 4, 5, 6, 7, 8]


def test_local_time_without_offset_is_assumed_utc(tmp_path: Path) -> None:
    read = Read(*files(tmp_path, LOCAL, "d,t,v\n1970-01-01,00:00:01,1\n"))
    assert read.times("gnss") == [NS_PER_S] and "assumed_utc" in read.remarks


def test_derived_fields_and_their_signs(tmp_path: Path) -> None:
    text = (
        BASIC
        + """
[columns]
hdg = { field = "ins.magnetic_heading_deg", unit = "deg" }
gs = { field = "gnss.ground_speed_mps", unit = "kt" }
[[derived]]
field = "ins.true_heading_deg"
method = "true_from_magnetic"
magnetic = "ins.magnetic_heading_deg"
variation = { column = "var", unit = "deg" }
[[derived]]
field = "gnss.track_deg"
method = "true_from_magnetic"
magnetic = { column = "trk", unit = "deg" }
variation = { column = "var", unit = "deg" }
[[derived]]
topic = "gnss"
method = "velocity_from_track"
track = "gnss.track_deg"
speed = "gnss.ground_speed_mps"
[[derived]]
topic = "air"
method = "wind_from_direction"
direction = { column = "wd", unit = "deg" }
speed = { column = "ws", unit = "kt" }
"""
    )
    table = "t,hdg,gs,trk,var,wd,ws\n0,355,100,80,10,0,10\n1,355,100,80,,0,10\n2,355,100,80,bad,0,10\n"
    read = Read(*files(tmp_path, text, table))
    assert read.values("ins", "true_heading_deg") == [5.0, None, None]  # true = magnetic + variation, east positive
    assert read.values("gnss", "track_deg") == [90.0, None, None]
    assert read.values("gnss", "velocity_east_mps")[0] == pytest.approx(100 * 1852 / 3600)
    assert read.values("gnss", "velocity_north_mps")[0] == pytest.approx(0.0, abs=1e-12)
    assert read.values("air", "wind_north_mps")[0] == pytest.approx(-10 * 1852 / 3600)  # from the north: blows south
    assert read.values("raw.p", "var") == [10.0, None, None] and read.damage("unreadable_cells").count == 1


def test_a_derivation_stands_in_for_an_optional_column(tmp_path: Path) -> None:
    settings = BASIC + EAST + BY_TRACK
    own = Read(*files(tmp_path, settings, "t,e,trk,gs\n0,7,90,5\n1,,90,5\n"))  # not 5: an empty cell is none
    assert own.values("gnss", "velocity_east_mps") == [7.0, None]
    assert own.values("gnss", "velocity_north_mps") == pytest.approx([0.0, 0.0])  # the file has no column of it
    without = Read(*files(tmp_path, settings, "t,trk,gs\n0,90,5\n"))
    assert without.values("gnss", "velocity_east_mps") == [5.0] and "missing_columns" not in without.remarks


def test_times_in_utc_need_no_column_of_offsets(tmp_path: Path) -> None:
    settings = LOCAL.replace('offset = "o"', 'offset = "UTC"')
    read = Read(*files(tmp_path, settings, "d,t,v\n1970-01-01,00:00:01,1\n"))
    assert read.times("gnss") == [NS_PER_S] and "assumed_utc" not in read.remarks


def test_a_local_time_with_an_empty_offset_is_told(tmp_path: Path) -> None:
    rows = ["1970-01-02,03:00:00,+03:00,1", "1970-01-02,00:00:01,,2"]
    assert "assumed_utc" not in Read(*files(tmp_path, LOCAL, "\n".join(["d,t,o,v", rows[0], ""]))).remarks
    assert "assumed_utc" in Read(*files(tmp_path, LOCAL, "\n".join(["d,t,o,v", *rows, ""]))).remarks


TELLS = """
name = "tells"
[recognise]
header_tells = true
second_names = true
[time]
kind = "seconds"
column = "Time"
[variation]
column = "Magvar"
sign = -1
[columns]
"Speed" = { field = "gnss.ground_speed_mps", unit = "kt" }
"Height" = { field = "gnss.altitude_msl_m", unit = "m" }
"Track" = { field = "gnss.track_deg", unit = "deg", north = "magnetic" }
"""


@pytest.mark.parametrize(
    ("header", "below", "expected"),
    [
        ("Time,Speed,Height,Track,Magvar", "", (36 * 1852 / 3600, "altitude_msl_m", 36.0, 23.0)),
        ("Time (s),Speed (km/h),Height (ft),Track (deg),Magvar (deg)", "", (10.0, "altitude_msl_m", 10.9728, 23.0)),
        ("Time,Speed (m/s),Height (WGS84 m),Track (deg true),Magvar", "", (36.0, "altitude_ellipsoid_m", 36.0, 36.0)),
        ("Time,Speed,Height,Track,Magvar", "t,Speed (kph),h,Track true,mv\n", (10.0, "altitude_msl_m", 36.0, 36.0)),
        ("Time,Speed (ft),Height,Track,Magvar", "", (None, "altitude_msl_m", 36.0, 23.0)),  # no speed is in feet
    ],
)
def test_headers_that_tell_settle_unit_north_and_height(
    tmp_path: Path, header: str, below: str, expected: tuple[float | None, str, float, float]
) -> None:
    read = Read(*files(tmp_path, TELLS, f"{header}\n{below}0,36,36,36,13\n"))
    speed, altitude, height, track = expected
    assert read.values("gnss", "track_deg") == pytest.approx([track])
    assert read.values("gnss", altitude) == pytest.approx([height])
    is_fed = any("ground_speed_mps" in batch.columns for batch in read.batches)
    assert is_fed == (speed is not None) and ("other_unit" in read.remarks) == (speed is None)
    if speed is not None:
        assert read.values("gnss", "ground_speed_mps") == pytest.approx([speed])


def test_a_derivation_without_its_columns_is_left_out(tmp_path: Path) -> None:
    text = (
        BASIC
        + '[columns]\nhdg = { field = "ins.magnetic_heading_deg", unit = "deg" }\n[[derived]]\n'
        + 'field = "ins.true_heading_deg"\nmethod = "true_from_magnetic"\nmagnetic = "ins.magnetic_heading_deg"\n'
        + 'variation = { column = "var", unit = "deg" }\n'
    )
    read = Read(*files(tmp_path, text, "t,hdg\n0,1\n"))
    assert all("true_heading_deg" not in batch.columns for batch in read.batches)


HDOP = '[columns]\nv = { field = "gnss.hdop" }\n'
EAST = (
    '[columns]\ne = { field = "gnss.velocity_east_mps", unit = "mps", optional = true }\n'
    'trk = { field = "gnss.track_deg", unit = "deg" }\ngs = { field = "gnss.ground_speed_mps", unit = "mps" }\n'
)
BY_TRACK = (
    '[[derived]]\ntopic = "gnss"\nmethod = "velocity_from_track"\n'
    'track = "gnss.track_deg"\nspeed = "gnss.ground_speed_mps"\n'
)
SLIPS = [
    ("name = ", "TOML"),
    ('nmae = "x"\n' + BASIC + HDOP, "nmae"),
    (BASIC, "columns"),
    ('[columns]\n[time]\nkind = "seconds"\ncolumn = "t"\n', "name"),
    ('name = "p"\n[time]\nkind = "sundial"\ncolumn = "t"\n' + HDOP, "time.kind"),
    ('name = "p"\n[time]\nkind = "seconds"\n' + HDOP, "time.column"),
    (BASIC + 'unit = "fortnight"\n' + HDOP, "time.unit"),
    ('name = "p"\n[time]\nkind = "iso"\ncolumn = "t"\nunit = "s"\n' + HDOP, "time.unit"),
    (LOCAL.replace("%d.%m.%y", "%Q"), "time.date_formats"),
    (BASIC + "[columns]\nv = 3\n", "columns.v"),
    (BASIC + '[columns]\nv = { field = "gnss.hdopp" }\n', "columns.v.field"),
    (BASIC + '[columns]\nv = { field = "gps.hdop" }\n', "columns.v.field"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg" }\n', "columns.v.unit"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "degrees" }\n', "columns.v.unit"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "kt" }\n', "columns.v.unit"),
    (BASIC + '[columns]\nv = { field = "gnss.hdop", unit = "m" }\n', "columns.v.unit"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", sign = 2 }\n', "columns.v.sign"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", scale = 0 }\n', "columns.v.scale"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", scale = "1" }\n', "columns.v.scale"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", offset = nan }\n', "columns.v.offset"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", factor = 2 }\n', "columns.v.factor"),
    (BASIC + '[columns]\nv = { field = "ins.mode", unit = "deg" }\n', "columns.v.unit"),
    (BASIC + HDOP + 'w = { field = "gnss.hdop" }\n', "columns.w.field"),
    (BASIC + "derived = 3\n" + HDOP, "time.derived"),
    ("derived = 3\n" + BASIC + HDOP, "derived"),
    (BASIC + HDOP + '[[derived]]\nmethod = "magic"\n', "derived[0].method"),
    (BASIC + HDOP + '[[derived]]\nmethod = "velocity_from_track"\ntopic = "gnss"\n', "derived[0].track"),
    (
        BASIC + HDOP + '[[derived]]\nmethod = "velocity_from_track"\ntopic = "baro"\ntrack = "a.b"\nspeed = "c.d"\n',
        "derived[0].topic",
    ),
    (
        BASIC + HDOP + '[[derived]]\nmethod = "velocity_from_track"\ntopic = "gnss"\ntrack = "a.b"\nspeed = "c.d"\n',
        "derived[0].track",
    ),
    ('[metadata.find]\na = "("\n' + BASIC.replace("name", "x", 0) + HDOP, "name"),
    (BASIC + HDOP + '[metadata.find]\na = "("\n', "metadata.find.a"),
    (BASIC + HDOP + '[metadata.find]\na = "b"\n', "metadata.find.a"),
    (BASIC + HDOP + '[metadata.join]\na = "{b}"\n', "metadata.join.a"),
    (BASIC + HDOP + "[recognise]\nrows_after_header = 1.5\n", "recognise.rows_after_header"),
    (BASIC + HDOP + "[recognise]\ncolumns = []\n", "recognise.columns"),
    (BASIC + HDOP + '[recognise]\nfirst_line = ["#a", 3]\n', "recognise.first_line"),
    (BASIC + HDOP + "[recognise]\nheader_tells = 1\n", "recognise.header_tells"),
    (BASIC + HDOP + '[recognise]\nsecond_names = "yes"\n', "recognise.second_names"),
    (BASIC + HDOP + "[variation]\n", "variation.column"),
    (BASIC + HDOP + '[variation]\ncolumn = "m"\nsign = 2\n', "variation.sign"),
    (BASIC + HDOP + '[variation]\ncolumn = "m"\nunit = "kt"\n', "variation.unit"),
    (BASIC + '[columns]\nv = { field = "gnss.track_deg", unit = "deg", north = "up" }\n', "columns.v.north"),
    (BASIC + '[columns]\nv = { field = "ins.roll_deg", unit = "deg", north = "true" }\n', "columns.v.north"),
    (BASIC + '[columns]\nv = { field = "gnss.hdop", optional = "yes" }\n', "columns.v.optional"),
    (BASIC + EAST.replace(", optional = true", "") + BY_TRACK, "derived[0]"),
    (BASIC + EAST + BY_TRACK + BY_TRACK, "derived[1]"),
]


@pytest.mark.parametrize(("text", "key"), SLIPS, ids=[f"{at}-{key}" for at, (_, key) in enumerate(SLIPS)])
def test_a_slip_names_file_and_key(tmp_path: Path, text: str, key: str) -> None:
    log, settings = files(tmp_path, text, "t,v\n0,1\n")
    with pytest.raises(SettingsError, match=re.escape(key)) as caught:
        registry.identify(log, settings)
    assert "my.toml" in str(caught.value) and "\n" not in str(caught.value)


WHOLE = (Path(SHIPPED) / "garmin_g1000.toml").read_text(encoding="utf-8")
JUNK = ["3", "-1.5", "nan", '""', '"junk"', "[]", "[1]", '["a", 2]', "{}", "{ a = 1 }", "true", "2020-01-01"]


@pytest.mark.parametrize("junk", JUNK)
def test_junk_in_any_place_is_a_settings_error_or_harmless(tmp_path: Path, junk: str) -> None:
    lines = WHOLE.splitlines()
    path = tmp_path / "junk.toml"
    for at, line in enumerate(lines):
        if "=" not in line or line.startswith("#"):
            continue
        changes = {line.partition(" = ")[0] + " = " + junk}
        changes |= {line.replace(part, f"= {junk}", 1) for part in re.findall(r"= [^,{}]+", line)}
        for change in sorted(changes):
            path.write_text("\n".join([*lines[:at], change, *lines[at + 1 :]]), encoding="utf-8")
            try:
                profiles.load(path)
            except SettingsError as error:
                assert "junk.toml" in str(error)


def test_the_time_column_may_feed_a_field_too(tmp_path: Path) -> None:
    log, settings = files(tmp_path, BASIC + '[columns]\nt = { field = "gnss.hdop" }\n', "t,v\n7,1\n")
    read = Read(log, settings)
    assert read.times("gnss") == [7 * NS_PER_S] and read.values("gnss", "hdop") == [7.0]


def test_an_absent_profile_is_a_settings_error(tmp_path: Path) -> None:
    log, _settings = files(tmp_path, "", "t,v\n0,1\n")
    with pytest.raises(SettingsError, match="no readable file"):
        registry.identify(log, tmp_path / "none.toml")


def test_shipped_profiles_load_and_have_distinct_names() -> None:
    names = [profiles.load(path).name for path in SHIPPED.glob("*.toml")]
    assert "garmin-g1000" in names and len(set(names)) == len(names)


def test_the_manual_names_every_unit_method_and_key() -> None:
    manual = (Path(__file__).parents[2] / "docs" / "profiles.md").read_text(encoding="utf-8")
    for word in (*(unit for unit in CONVERSIONS if unit), *METHODS, *TIME_UNITS):
        assert f"`{word}`" in manual, word
    for method in METHODS.values():
        assert all(f"`{name}`" in manual for name in method.inputs)


def test_canonical_units_are_all_convertible() -> None:
    known = {unit for unit, _factor in CONVERSIONS.values()}
    for fields in TOPICS.values():
        for field in fields:
            assert field.kind != "double" or field.unit in known | {"s", "m2", "rad"}, field.name


def test_angles_of_increments_are_read_in_radians_or_degrees(tmp_path: Path) -> None:
    columns = "".join(
        f'{axis} = {{ field = "imu.delta_angle_{axis}_rad", unit = "{unit}" }}\n'
        for axis, unit in (("x", "rad"), ("y", "deg"), ("z", "semicircle"))
    )
    log, settings = files(tmp_path, BASIC + f"[columns]\n{columns}", "t,x,y,z\n0,0.1,1.0,0.5\n")
    read = Read(log, settings)
    got = [read.values("imu", f"delta_angle_{axis}_rad")[0] for axis in "xyz"]
    assert got == pytest.approx([0.1, math.radians(1.0), math.pi / 2], rel=1e-15)


HEADERLESS = """
name = "imu-without-header"
[recognise]
names = ["ax", "gx", "ms"]
[time]
kind = "seconds"
column = "ms"
unit = "ms"
[columns]
"ax" = { field = "imu.accel_x_mps2", unit = "g" }
"gx" = { field = "imu.rate_x_dps", unit = "dps", sign = -1 }
"""


@pytest.mark.parametrize("first", ["", "0.5,9\n", "# board 7\n", "\n"], ids=["whole", "cut", "comment", "empty"])
def test_a_file_without_a_header_has_the_names_of_the_profile(tmp_path: Path, first: str) -> None:
    log, settings = files(tmp_path, HEADERLESS, first + "0.1,2,10\n0.2,3,20\n0.3,nan,30\n")
    read = Read(log, settings)
    assert read.times("imu") == [10_000_000, 20_000_000, 30_000_000]
    assert read.values("imu", "accel_x_mps2") == pytest.approx([0.980665, 1.96133, 2.941995], rel=1e-12)
    assert read.values("imu", "rate_x_dps")[:2] == [-2.0, -3.0]


def test_a_file_of_another_width_is_refused_with_the_number_of_cells(tmp_path: Path) -> None:
    log, settings = files(tmp_path, HEADERLESS, "1,2\n3,4\n")
    with pytest.raises(UnreadableLogError, match="rows of 3 cells"):
        registry.identify(log, settings)


def test_names_must_have_every_column_of_the_profile(tmp_path: Path) -> None:
    log, settings = files(tmp_path, HEADERLESS.replace('"gx", ', ""), "1,2\n")
    with pytest.raises(SettingsError, match=r"recognise\.names"):
        registry.identify(log, settings)


def test_increments_of_an_imu_need_no_profile(tmp_path: Path) -> None:
    names = [f"delta_{what}" for what in (*(f"velocity_{a}_mps" for a in "xyz"), *(f"angle_{a}_rad" for a in "xyz"))]
    log = tmp_path / "imu.csv"
    head = "# start_utc: 2025-05-19T18:54:39.543049Z; VN-100, 100 Hz\n" + ",".join(["time_s", *names])
    log.write_text(head + "\n-0.003249,1,2,3,4,5,6\n0.006758,1,2,3,4,5,7\n", encoding="utf-8")
    read = Read(log)
    assert [read.values("imu", name)[1] for name in names] == [1.0, 2.0, 3.0, 4.0, 5.0, 7.0]
    assert read.times("imu") == [-3_249_000, 6_758_000]


def test_bad_cells_are_counted_under_the_field(tmp_path: Path) -> None:
    log, settings = files(tmp_path, BASIC + HDOP, "t,v\n0,1\n1,?\n")
    damages = [item for item in registry.read(log, settings) if isinstance(item, Damage)]
    assert [damage.place for damage in damages] == ["gnss.hdop, row 3"]
    kinds = {type(item) for item in registry.read(log, settings)}
    assert RecordBatch in kinds and Remark not in kinds


def test_fixes_of_a_receiver_need_no_profile(tmp_path: Path) -> None:
    names = "latitude_deg,longitude_deg,altitude_ellipsoid_m,velocity_down_mps,north_sigma_m,down_sigma_m,other"
    log = tmp_path / "gnss.csv"
    log.write_text(f"# start_utc: 2025-05-19T18:54:39Z; F9T\ntime_s,{names}\n0.5,39,-84,225,-0.1,0.4,0.8,7\n", "utf-8")
    read = Read(log)
    assert (
        read.header.reader == "csv-profile gnss-fixes" and read.header.metadata["start_utc"] == "2025-05-19T18:54:39Z"
    )
    fields = ("latitude_deg", "altitude_ellipsoid_m", "velocity_down_mps", "position_north_sigma_m", "vertical_sigma_m")
    assert [read.values("gnss", name)[0] for name in fields] == [39.0, 225.0, -0.1, 0.4, 0.8]
    assert read.values("raw.gnss", "other") == [7.0] and read.times("gnss") == [500_000_000]


def test_two_columns_may_feed_a_field_where_both_are_optional(tmp_path: Path) -> None:
    field = '"{}" = {{ field = "gnss.hdop"{} }}\n'
    both = BASIC + "[columns]\n" + "".join(field.format(name, ", optional = true") for name in "ab")
    log, settings = files(tmp_path, both, "t,b\n0,1.5\n")
    assert Read(log, settings).values("gnss", "hdop") == [1.5]
    log, settings = files(tmp_path, both, "t,b,a\n0,1.5,2.5\n")
    assert Read(log, settings).values("gnss", "hdop") == [2.5]
    _log, settings = files(tmp_path, both.replace(", optional = true", "", 1), "")
    with pytest.raises(SettingsError, match="does not feed already"):
        profiles.load(settings)


def test_the_head_of_a_shipped_profile_is_that_of_the_whole() -> None:
    heads = [head_of(path) for path in sorted(SHIPPED.glob("*.toml"))]
    assert len(heads) > 10
    for head in heads:
        whole = profiles.load(head.path)
        assert head.first_lines == whole.first_lines
        assert head.required == (() if whole.names else whole.required)


@pytest.mark.parametrize(
    ("text", "fitting"),
    [
        ("time_s,ins.heading_true_deg\n0,1\n", []),
        ("#airframe_info,a\n#b\nLcl Date, Lcl Time\n", ["garmin_g1000", "garmin_g3x"]),
        ("torn\ntime,icao24,lat,lon,velocity\n", ["opensky_states"]),
        ("1,2,3\n#airframe_info,a\n", ["garmin_g1000", "garmin_g3x"]),
    ],
)
def test_a_table_loads_the_profiles_that_its_first_lines_allow(tmp_path: Path, text: str, fitting: list[str]) -> None:
    log = tmp_path / "a.csv"
    log.write_text(text, encoding="utf-8")
    assert [path.stem for path in that_may_fit(Source(log))] == fitting
