"""Canonical values of DataFlash logs are what the log meant: units and multipliers of every firmware, and its slips.

Sources: ArduPilot, libraries/AP_Logger/README.md, and LogStructure.h of the versions named below.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from groundstation.base.records import Damage
from groundstation.readers.dataflash.definitions import Units, parse
from groundstation.readers.dataflash.values import rows_of
from tests.readers.dataflash_writer import DataFlash
from tests.readers.test_dataflash import Log
from tests.real_logs import real_log

ROUNDING = 1e-6  # single precision, relative
TEXTS = {
    "-": "",
    "s": "s",
    "A": "A",
    "d": "deg",
    "h": "degheading",
    "D": "deglatitude",
    "U": "deglongitude",
    "k": "deg/s",
}
TEXTS |= {"E": "rad/s", "G": "Gauss", "m": "m", "n": "m/s", "o": "m/s/s", "S": "satellites", "P": "Pa", "#": "instance"}
TEXTS |= {"Y": "us", "?": "UNKNOWN", "x": "furlong", "r": "rad"}
MULTIPLIERS = {"-": 0.0, "?": 1.0, "0": 1.0, "A": 0.1, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}
STATED = {"0": 1.0, "A": 0.1, "B": 1e-2, "C": 1e-3, "G": 1e-7}
SCALED = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
INTEGERS = "bBhHiI"
RAD = 180.0 / np.pi


@dataclass(frozen=True)
class Case:
    """A field as ArduPilot documents it, and one value of it in that unit."""

    source: str
    topic: str
    field: str
    unit: str  # its id
    characters: str  # that can hold the value
    value: float
    factor: float = 1.0  # documented unit -> canonical
    of_integers: float = 1.0  # documented unit of a plain integer whose multiplier the log does not give
    slips: str = ""  # other units that some firmware gives it

    def stored(self, character: str, multiplier: str) -> float | int:
        """The number that the log holds."""
        if character in SCALED:
            return round(self.value * SCALED[character])
        if character in INTEGERS:
            return round(self.value / STATED.get(multiplier, self.of_integers))
        return self.value


GPS = (
    Case("NSats", "gnss", "satellites_used", "S", "B", 12, slips="-"),
    Case("HDop", "gnss", "hdop", "-", "cCeEfdiI", 9.9, of_integers=0.01, slips="mS"),
    Case("Lat", "gnss", "latitude_deg", "D", "Ldi", -35.3600001, of_integers=1e-7, slips="d"),
    Case("Lng", "gnss", "longitude_deg", "U", "Ldi", 149.1600002, of_integers=1e-7, slips="Y"),
    Case("Alt", "gnss", "altitude_msl_m", "m", "eEfdiI", 584.2, of_integers=0.01),
    Case("Spd", "gnss", "ground_speed_mps", "n", "eEcCfdiI", 12.0, of_integers=0.01),
    Case("GCrs", "gnss", "track_deg", "h", "eEcfdiI", 90.0, of_integers=0.01, slips="d"),
    Case("VZ", "gnss", "velocity_down_mps", "n", "ecfdi", -3.0, of_integers=0.01),
)
ATT = (
    Case("Roll", "ins", "roll_deg", "d", "cefdi", 15.0, of_integers=0.01),
    Case("Pitch", "ins", "pitch_deg", "d", "cefdi", -25.0, of_integers=0.01),
    Case("Yaw", "ins", "true_heading_deg", "h", "CeEfdI", 359.0, of_integers=0.01, slips="d"),
)
IMU = (
    Case("GyrX", "ins", "rate_x_dps", "E", "fd", 0.25, RAD),
    Case("AccZ", "ins", "accel_z_mps2", "o", "fd", -9.75, slips="n"),
)
OTHERS = {
    "XKF1": (Case("VN", "ins", "velocity_north_mps", "n", "fd", 10.0),),
    "XKF2": (Case("VWE", "air", "wind_east_mps", "n", "cfd", -4.0),),
    "BAT": (Case("Curr", "electric", "current_a", "A", "fdiI", 7.0, of_integers=0.01),),
    "GPA": (Case("SAcc", "gnss", "velocity_sigma_mps", "n", "CcfdiI", 0.3, of_integers=0.01),),
    "MAG": (Case("MagX", "magnetometer", "field_forward_nt", "G", "hif", 0.25, 1e5, of_integers=1e-3),),
}
TYPES = {"GPS": GPS, "ATT": ATT, "IMU": IMU, **OTHERS}
CASES = [(name, case) for name, cases in TYPES.items() for case in cases]
LEADING = {"GPS": ("QBIH", "TimeUS,Status,GMS,GWk", (3, 200_000_000, 2300))}  # before the fields of a case
KNOWN, SLIP, EMPTY, NO_UNIT, UNKNOWN, QUESTION = range(6)


@st.composite
def ways(draw: st.DrawFn) -> dict[str, tuple[str, str, str, bool]]:
    """For each field: format character, unit, multiplier, and whether its value is to be read."""
    chosen = {}
    for name, case in CASES:
        character = draw(st.sampled_from(case.characters))
        kind = draw(st.sampled_from((KNOWN, KNOWN, SLIP, EMPTY, NO_UNIT, UNKNOWN, QUESTION)))
        slip = draw(st.sampled_from(case.slips)) if case.slips else case.unit
        unit = (case.unit, slip, "-", "~", "x", "?")[kind]
        codes = "-?~0ABCG"
        if character in INTEGERS:  # those with which the number fits into its bytes and is whole
            stated = [code for code, factor in STATED.items() if abs(case.value / factor) < 30_000 and factor <= 1e-2]
            codes = "-?~" + "".join(stated) if case.source != "NSats" else "-?~0"
            codes = "-?~G" if case.field in ("latitude_deg", "longitude_deg") else codes
        elif name == "MAG":
            codes = "0"  # a float in gauss
        chosen[f"{name}.{case.source}"] = (character, unit, draw(st.sampled_from(codes)), kind < UNKNOWN)
    return chosen


def log_of(chosen: dict[str, tuple[str, str, str, bool]], with_tables: bool = True) -> DataFlash:
    """Three records of each type."""
    log = DataFlash()
    log.define_units(TEXTS if with_tables else {}, MULTIPLIERS if with_tables else {})
    rows = {}
    for type_id, (name, cases) in enumerate(TYPES.items(), 1):
        characters, labels, values = LEADING.get(name, ("Q", "TimeUS", ()))
        picked = [chosen[f"{name}.{case.source}"] for case in cases]
        log.define(
            type_id,
            name,
            characters + "".join(one[0] for one in picked),
            ",".join((labels, *(case.source for case in cases))),
        )
        blank = "-" * (len(characters) - 1)
        log.units(
            name, f"s{blank}" + "".join(one[1] for one in picked), f"F{blank}" + "".join(one[2] for one in picked)
        )
        rows[name] = (*values, *(case.stored(one[0], one[2]) for case, one in zip(cases, picked, strict=True)))
    for time in (1, 2, 3):
        for name, row in rows.items():
            log.write(name, time * 1_000_000, *row)
    return log


@settings(derandomize=True, max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(chosen=ways())
def test_values_are_raw_times_the_documented_factor(
    chosen: dict[str, tuple[str, str, str, bool]], tmp_path: Path
) -> None:
    log = Log(tmp_path / "log.BIN", log_of(chosen).content)
    counted = {damage.place: damage for damage in log.damages}
    for name, case in CASES:
        character, unit, multiplier, is_known = chosen[f"{name}.{case.source}"]
        where = (name, case.source, character, TEXTS.get(unit), multiplier)
        if is_known:
            expected = pytest.approx([case.value * case.factor] * 3, rel=ROUNDING)
            assert log.present(case.topic, case.field) == expected, where
            assert f"raw.{name}.{case.source}" not in counted, where
        else:
            table = log.flight[case.topic] if case.topic in log.flight.topics() else None
            assert table is None or not table.has(case.field), where
            damage = counted[f"raw.{name}.{case.source}"]
            assert (damage.count, damage.topic, damage.loses_data) == (3, case.topic, False)
            assert TEXTS[unit] in damage.what
            assert len(log.present(f"raw.{name}", case.source)) == 3, "raw keeps it"


@pytest.mark.parametrize("with_tables", [True, False], ids=["UNIT and MULT", "neither"])
def test_records_of_units_and_multipliers_may_be_missing(tmp_path: Path, with_tables: bool) -> None:
    chosen = {f"{name}.{case.source}": (case.characters[0], case.unit, "-", True) for name, case in CASES}
    log = Log(tmp_path / "log.BIN", log_of(chosen, with_tables).content)
    for _name, case in CASES:
        expected = pytest.approx([case.value * case.factor] * 3, rel=ROUNDING)
        assert log.present(case.topic, case.field) == expected, case


@pytest.mark.parametrize("multiplier", [np.nan, np.inf, -np.inf, -0.01, 0.0])
def test_a_multiplier_that_is_no_factor_counts_as_none(multiplier: float) -> None:
    definition = parse(1, 13, "ATT", "Qh", ["TimeUS", "Roll"])
    units = Units({"d": "deg"}, {"B": multiplier}, {definition: ("sd", "FB")})
    assert units.of(definition, "Roll").multiplier is None and units.of(definition, "Roll").text == "deg"


GPS_3 = ("QBIHBcLLefffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,U")
GPS_4 = ("QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")
ATT_3 = ("QccccCCCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw", "sddddhhdh", "FBBBBBBBB")
ATT_4 = ("QccccCCCCB", f"{ATT_3[1]},AEKF", "sddddhhdh-", "FBBBBBBBB-")
ATT_46 = ("QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", "sddddhh-", "F000000-")
MAG_3 = ("QhhhB", "TimeUS,MagX,MagY,MagZ,Health", "sGGG-", "FCCC-")
# Firmware, GPS and ATT as it defines them with units and multipliers (empty: it has no FMTU).
ERAS = {
    "Plane 3.8": ((*GPS_3, "", ""), (*ATT_3[:2], "", "")),
    "Plane 3.9 beta": ((*GPS_3, "s---SmDUmnhn-", "F---0BGGBBB0-"), ATT_3),  # multipliers of floats, pull request 8643
    "Copter 3.6": ((*GPS_3, "s---SmDUmnhn-", "F---0BGGB000-"), ATT_3),  # U is us, too
    "Plane 4.2": ((*GPS_4, "s#---SmDUmnhnh-", "F----0BGGB000--"), ATT_4),
    "Plane 4.5": ((*GPS_4, "s#-s-S-DUmnhnh-", "F--C-0BGGB000--"), ATT_4),
    "Plane 4.6": ((*GPS_4, "s#-s-S-DUmnhnh-", "F--C-0BGGB000--"), ATT_46),
    "base types": (
        ("QBBIHBHiiiffffB", GPS_4[1], "s#-s-S-DUmnhnh-", "F--C-0BGGB000--"),
        ("QhhhhHHHHB", ATT_4[1], *ATT_4[2:]),
    ),
}
GPS_ROW: dict[str, float] = {
    "Status": 3,
    "GMS": 200_000_000,
    "GWk": 2300,
    "NSats": 4,
    "HDop": 990,
    "Lat": -353_600_001,
    "Lng": 1_491_600_002,
}
GPS_ROW |= {"Alt": 58_425, "Spd": 12.0, "GCrs": 90.0, "VZ": -0.25}
ATT_ROW: dict[str, float] = {"Roll": 150, "Pitch": -250, "Yaw": 35_900}


@pytest.mark.parametrize("era", ERAS)
def test_firmware_of_every_era(tmp_path: Path, era: str) -> None:
    log = DataFlash()
    gps, att = ERAS[era]
    if gps[2]:
        log.define_units({**TEXTS, "U": "us"} if era == "Copter 3.6" else TEXTS, MULTIPLIERS)
    for type_id, (name, layout) in enumerate((("GPS", gps), ("ATT", att), ("MAG", MAG_3)), 1):
        log.define(type_id, name, *layout[:2])
        if gps[2]:
            log.units(name, *layout[2:])
    for time in (1_000_000, 1_200_000):
        log.write("GPS", time, *(GPS_ROW.get(label, 0) for label in gps[1].split(",")[1:]))
        row = {name: value / 100 for name, value in ATT_ROW.items()} if att is ATT_46 else ATT_ROW
        log.write("ATT", time, *(row.get(label, 0) for label in att[1].split(",")[1:]))
        log.write("MAG", time, 250, -120, 480, 1)
    read = Log(tmp_path / "log.BIN", log.content)
    expected = {"satellites_used": 4.0, "hdop": 9.9, "latitude_deg": -35.3600001, "longitude_deg": 149.1600002}
    expected |= {"altitude_msl_m": 584.25, "ground_speed_mps": 12.0, "track_deg": 90.0, "velocity_down_mps": -0.25}
    for field, value in expected.items():
        assert read.present("gnss", field) == pytest.approx([value] * 2, rel=ROUNDING), field
    for field, value in (("roll_deg", 1.5), ("pitch_deg", -2.5), ("true_heading_deg", 359.0)):
        assert read.present("ins", field) == pytest.approx([value] * 2, rel=ROUNDING), field
    assert read.present("magnetometer", "field_forward_nt") == pytest.approx([25_000.0] * 2)
    assert not read.damages
    told = [remark.text for remark in read.remarks if remark.code == "converted" and remark.topic == "gnss"]
    assert len(told) == (2 if era == "Plane 3.9 beta" else 0), "multipliers of Spd and GCrs are not applied"
    assert all("multiplier 0.01" in text for text in told)


def test_scale_of_a_format_character_is_no_factor_that_is_left(tmp_path: Path) -> None:
    log = DataFlash()
    log.define_units(TEXTS, MULTIPLIERS)
    log.define(1, "NTUN", "Qeh", "TimeUS,TAW,X")
    log.units("NTUN", "smm", "F0B")  # Plane 4: 0 for an e, whose hundredths are in the values already
    log.write("NTUN", 1, 12_345, 7)
    read = Log(tmp_path / "log.BIN", log.content)
    assert read.present("raw.NTUN", "TAW") == [123.45]
    assert read.header.metadata["units.raw.NTUN"] == "TimeUS s x 1e-06, TAW m, X m x 0.01"


def test_units_of_a_second_log_in_the_file_are_not_those_of_the_first(tmp_path: Path) -> None:
    old, new = DataFlash(), DataFlash()
    old.define(1, "MAG", "QhhhB", "TimeUS,MagX,MagY,MagZ,Health")
    new.define_units(TEXTS, MULTIPLIERS)
    new.define(1, "ATT", "QBhhH", "TimeUS,I,Roll,Pitch,Yaw")
    new.units("ATT", "s#ddh", "F-BBB")
    for time in (1, 2, 3):
        old.write("MAG", time * 1_000_000, 250, -120, 480, 1)
        new.write("ATT", time * 1_000_000, 0, 150, -250, 35_900)
    read = Log(tmp_path / "log.BIN", old.content + new.content)
    assert read.present("raw.MAG", "MagX") == [250, 250, 250], "no instance of that type"
    assert read.present("magnetometer", "field_right_nt") == pytest.approx([-12_000.0] * 3)


def test_zeros_of_a_fix_are_no_position(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(1, "GPS", "QBIHBcLLeffffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")
    log.define(2, "POS", "QLLf", "TimeUS,Lat,Lng,Alt")
    log.define(3, "AHR2", "QccCfLL", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng")
    places = [(0, 0, 0), (3, 0, 0), (3, 0, 0), (3, 5, 0), (3, 0, -1), (2, 0, 0), (2, 7, 7)]
    for at, (status, latitude, longitude) in enumerate(places):
        time = 1_000_000 * (at + 1)
        log.write("GPS", time, status, 1000 * at, 2300, 9, 100, latitude, longitude, 500, 3.0, 0.0, 0.5, 0.0, 1)
        log.write("POS", time, latitude, longitude, 5.0)
        log.write("AHR2", time, 0, 0, 0, 5.0, latitude, longitude)
    read = Log(tmp_path / "zero.BIN", log.content)
    assert read.present("gnss", "latitude_deg") == pytest.approx([5e-7, 0.0, 7e-7])
    assert read.present("gnss", "longitude_deg") == pytest.approx([0.0, -1e-7, 7e-7])
    assert read.present("gnss", "altitude_msl_m") == [5.0, 5.0], "of 3D fixes with a position"
    assert len(read.present("gnss", "ground_speed_mps")) == 4, "a speed is no position"
    for topic in ("ins", "ins.2"):
        assert len(read.present(topic, "latitude_deg")) == len(read.present(topic, "altitude_msl_m")) == 3, topic
    assert len(read.present("raw.GPS", "Lat")) == len(places), "raw keeps the zeros"
    counts = {damage.topic: damage for damage in read.damages}
    assert {topic: damage.count for topic, damage in counts.items()} == {"gnss": 3, "ins": 4, "ins.2": 4}
    assert all("no position" in damage.what and not damage.loses_data for damage in counts.values())
    assert not read.flight["gnss"].has("integrity_ok")
    assert read.flight["gnss"].text("fix").tolist() == ["none", "3d", "3d", "3d", "3d", "2d", "2d"]


def test_a_receiver_without_a_status_has_a_fix_where_it_has_a_position(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(1, "GPS", "QIHBLLef", "TimeUS,GMS,GWk,NSats,Lat,Lng,Alt,Spd")
    log.write("GPS", 1_000_000, 1000, 2300, 0, 0, 0, 0, 0.0)
    log.write("GPS", 2_000_000, 2000, 2300, 9, 10, 20, 500, 3.0)
    read = Log(tmp_path / "log.BIN", log.content)
    assert read.present("gnss", "ground_speed_mps") == [3.0] and read.present("gnss", "altitude_msl_m") == [5.0]
    assert read.present("gnss", "satellites_used") == [0.0, 9.0]


def test_before_the_first_word_of_the_core_in_use_it_was_the_first_one_told(tmp_path: Path) -> None:
    log = DataFlash()
    log.define_units(TEXTS, MULTIPLIERS)
    log.define(1, "XKF1", "QBfff", "TimeUS,C,VN,VE,VD")
    log.define(2, "XKF4", "QBb", "TimeUS,C,PI")
    log.units("XKF1", "s#nnn", "F-000")
    log.units("XKF4", "s#-", "F--")
    for time in (1, 2):
        for core in (0, 1):
            log.write("XKF1", time, core, 10.0 + core, 0.0, 0.0)
        for core in (0, 1):
            log.write("XKF4", time, core, 1)
    assert Log(tmp_path / "log.BIN", log.content).present("ins", "velocity_north_mps") == [11.0, 11.0]


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ({"COMPASS_AUTODEC": 0.0, "COMPASS_DEC": 0.0}, "magnetic_heading_deg"),
        ({"COMPASS_AUTODEC": 0.0}, "true_heading_deg"),
        ({"COMPASS_DEC": 0.0}, "true_heading_deg"),
        ({}, "true_heading_deg"),
    ],
)
def test_a_declination_that_the_log_does_not_tell_is_not_zero(
    tmp_path: Path, parameters: dict[str, float], field: str
) -> None:
    log = DataFlash()
    log.define(1, "PARM", "QNf", "TimeUS,Name,Value")
    log.define(2, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    for name, value in parameters.items():
        log.write("PARM", 1, name, value)
    log.write("ATT", 5_000_000, 100, 200, 300)
    read = Log(tmp_path / "log.BIN", log.content)
    assert read.present("ins", field) == [3.0]
    assert ("does not tell" in read.derived("ins", field)) == (len(parameters) < 2)


def test_instances_that_no_autopilot_has_leave_no_inertial_sensor(tmp_path: Path) -> None:
    log = DataFlash()
    log.define_units(TEXTS, MULTIPLIERS)
    log.define(1, "IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ")
    log.units("IMU", "s#EEE", "F-000")
    log.write("IMU", 1, 200, 0.1, 0.2, 0.3)
    read = Log(tmp_path / "log.BIN", log.content)
    assert "ins" not in read.flight.topics() and isinstance(read.damages[0], Damage)


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "satellites", "hdop"),
    [
        ("dataflash/copter_3.6.7_log0041.BIN", {11, 12, 13}, (0.5, 1.5)),
        ("dataflash/plane_4.2.3_pilot0004.BIN", {0, 5, 6}, (1.0, 100.0)),
        ("cases/d12_hdop_9_9.bin", {4}, (9.9, 9.9)),
        ("cases/d12_hdop_9_9_units_of_4.2.bin", {4}, (9.9, 9.9)),
    ],
)
def test_satellites_and_dilution_of_recorded_logs(
    tmp_path: Path, name: str, satellites: set[int], hdop: tuple[float, float]
) -> None:
    read = Log(tmp_path / "log.BIN", real_log(name).read_bytes())
    assert set(read.present("gnss", "satellites_used")) == satellites
    assert min(read.present("gnss", "hdop")) >= hdop[0] and max(read.present("gnss", "hdop")) <= hdop[1]


def test_a_column_is_made_once_and_cannot_be_changed() -> None:
    definition = parse(1, 3 + 2 + 4 + 2, "ATT", "cfh", ["Roll", "Pitch", "Yaw"])
    records = np.zeros(2, dtype=definition.dtype)
    records["Roll"], records["Pitch"], records["Yaw"] = (150, -250), (0.5, np.nan), (7, -7)
    rows = rows_of(definition, records, np.arange(2))
    raw = rows.columns()
    assert rows.doubles("Roll").tolist() == [1.5, -2.5] and rows.doubles("Yaw", 0.5).tolist() == [3.5, -3.5]
    assert np.shares_memory(rows.doubles("Roll"), raw["Roll"].values)
    assert rows.doubles("Pitch", 2.0) is rows.doubles("Pitch", 2.0)
    with pytest.raises(ValueError, match="read-only"):
        rows.doubles("Roll")[0] = 0.0
