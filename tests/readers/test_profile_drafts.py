"""Drafts of profiles and checks against tables: the forms that people's tables have, and what is said of bad ones."""

import json
import math
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.base.errors import GroundstationError, UnclaimedLogError, UnreadableLogError
from groundstation.cli.main import app
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.resume import Keys, keys_of
from groundstation.pipeline.verbs.profiles import findings_of, new_profile, try_profile
from groundstation.readers import profile_sources, registry
from groundstation.readers.drafts.words import meaning_of
from groundstation.readers.profile_file import load
from tests.conftest import forget_profiles
from tests.readers.test_flat_csv import Read

RADIUS_M, SPEED_MPS, LATITUDE_DEG = 100.0, 10.0, 50.0
M_PER_DEG = 111_195.0
Write = Callable[[str, str], Path]


def circle(count: int = 200, step_s: float = 0.5) -> Iterator[tuple[float, float, float, float]]:
    """Time, latitude, longitude and track, clockwise on a circle."""
    for row in range(count):
        time_s = row * step_s
        angle = SPEED_MPS * time_s / RADIUS_M
        north_m, east_m = RADIUS_M * math.sin(angle), RADIUS_M * (1.0 - math.cos(angle))
        longitude_deg = 30.0 + east_m / (M_PER_DEG * math.cos(math.radians(LATITUDE_DEG)))
        yield time_s, LATITUDE_DEG + north_m / M_PER_DEG, longitude_deg, math.degrees(angle) % 360.0


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    assert "Traceback" not in result.stderr
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return written


def drafted(table: Path) -> tuple[Path, str]:
    """The profile that is drafted for a table, as a file and as text."""
    text = new_profile(table).text
    path = table.with_suffix(".toml")
    path.write_text(text, encoding="utf-8")
    return path, text


def test_a_table_of_a_lap_timer_is_read_by_its_draft(write: Write) -> None:
    """Preamble, rows of units and of sources, Unix seconds, names that occur twice."""
    head = "This file is created using Some App.\nFormat,3\nCreated,31/12/2025,02:54\n\n"
    head += "timestamp,lap,altitude,altitude_precision,bearing,latitude,longitude,satellites,speed,lean,speed\n"
    head += "unix time,,m,DOP,deg,deg,deg,sats,m/s,deg,m/s\n,,100: gps,,100: gps,,,,100: gps,calc,200: obd\n"
    rows = "".join(
        f"{1767150797.5 + t:.2f},1,1.5,2.0,{track:.2f},{lat:.7f},{lon:.7f},8,{SPEED_MPS},0,9\n"
        for t, lat, lon, track in circle()
    )
    profile, text = drafted(write("laps.csv", head + rows))
    assert "rows_after_header = 2" in text and '"altitude_precision" =' not in text  # a DOP is no metre
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.header.utc_of_zero_ns == 0 and read.times("gnss")[0] == 1_767_150_797_500_000_000
    assert read.values("gnss", "ground_speed_mps")[:2] == [SPEED_MPS, SPEED_MPS]
    assert read.values("gnss", "velocity_north_mps")[0] == pytest.approx(SPEED_MPS)
    assert read.values("gnss", "satellites_used")[0] == 8.0 and read.values("gnss", "altitude_msl_m")[0] == 1.5


def test_a_table_of_a_drone_is_read_by_its_draft(write: Write) -> None:
    """Dates with slashes in one column, units in brackets, height beside altitude, positions of other things."""
    head = "CUSTOM.updateTime,OSD.latitude,OSD.longitude,OSD.height [m],OSD.altitude [m],OSD.yaw"
    head += ",OSD.gpsNum,HOME.latitude\n"
    rows = "".join(
        f"2018/07/04 09:19:{t:06.3f},{lat:.6f},{lon:.6f},{t:.1f},{t + 30:.1f},{300 - t:.1f},13,{lat:.6f}\n"
        for t, lat, lon, _track in circle(100)
    )
    profile, text = drafted(write("drone.csv", head + rows))
    assert '"HOME.latitude" =' not in text and '"OSD.height [m]" =' not in text
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.times("gnss")[1] == 1_530_695_940_500_000_000  # 2018-07-04T09:19:00.5Z
    assert read.values("gnss", "altitude_msl_m")[0] == 30.0 and read.values("ins", "true_heading_deg")[0] == 300.0
    assert "assumed_utc" in read.remarks


def test_a_table_of_a_phone_is_read_by_its_draft(write: Write) -> None:
    """Radians and camel case; the device stands upright, so its y axis reads gravity."""
    head = "time,horizontalAccuracy,speed,bearing,altitude,longitude,latitude,roll,pitch,yaw"
    head += ",acc_z,acc_y,acc_x,gyro_z,gyro_y,gyro_x\n"
    rows = "".join(
        f"2025-03-01 16:46:{t:06.3f}+00:00,4.0,{SPEED_MPS},{track:.3f},90,{lon:.7f},{lat:.7f},0.1,-0.2,"
        f"{math.radians((track + 180) % 360 - 180):.5f},0.2,9.8,0.1,0.01,-0.1,0.02\n"
        for t, lat, lon, track in circle(100)
    )
    profile, text = drafted(write("phone.csv", head + rows))
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.values("ins", "roll_deg")[0] == pytest.approx(math.degrees(0.1))
    assert read.values("imu", "accel_z_mps2")[0] == -9.8  # down, where y is up
    assert read.values("imu", "accel_y_mps2")[0] == 0.1 and read.values("imu", "accel_x_mps2")[0] == -0.2
    assert read.values("imu", "rate_z_dps")[0] == pytest.approx(math.degrees(0.1))
    assert "y reads +1 g" in text and read.header.utc_of_zero_ns == 0


@pytest.mark.parametrize(
    ("factor", "unit"), [(1.0, '"mps"'), (3.6, '"kmh"'), (3600 / 1852, '"kt"'), (1 / 0.44704, "scale = 0.44704")]
)
def test_the_positions_show_the_unit_of_a_speed(write: Write, factor: float, unit: str) -> None:
    rows = "".join(f"{int(t * 1000)},{lat:.8f},{lon:.8f},{SPEED_MPS * factor:.3f}\n" for t, lat, lon, _ in circle())
    profile, text = drafted(write("a.csv", "time_ms,lat,lon,spd\n" + rows))
    (line,) = [one for one in text.splitlines() if one.startswith('"spd"')]
    assert unit in line and "by the motion" in line
    assert Read(profile.with_suffix(".csv"), profile).values("gnss", "ground_speed_mps")[5] == pytest.approx(
        10.0, rel=1e-3
    )


def test_a_name_that_the_motion_contradicts_is_doubted(write: Write) -> None:
    rows = "".join(f"{t},{lat:.8f},{lon:.8f},{SPEED_MPS * 3.6:.3f},{track:.2f}\n" for t, lat, lon, track in circle())
    draft = new_profile(write("a.csv", "time_s,lat,lon,speed [m/s],heading\n" + rows))
    assert any("its name says mps, the motion of the positions kmh" in one for one in draft.doubts)
    assert any(one.startswith("heading: follows the motion") for one in draft.doubts)


@pytest.mark.parametrize(("zero_deg", "expected"), [(90.0, "sign = -1, offset = 1.57079633"), (0.0, "sign = -1 }")])
def test_a_yaw_that_turns_against_the_motion_is_turned(write: Write, zero_deg: float, expected: str) -> None:
    """A yaw as robots have it, anticlockwise from east in radians, and one anticlockwise from north."""
    rows = "".join(
        f"{t},{lat:.8f},{lon:.8f},{math.radians((zero_deg - track + 180.0) % 360.0 - 180.0):.6f}\n"
        for t, lat, lon, track in circle()
    )
    profile, text = drafted(write("a.csv", "time_s,lat,lon,yaw\n" + rows))
    assert expected in text and "turns against the motion" in text
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.values("ins", "true_heading_deg")[40] == pytest.approx(list(circle())[40][3], abs=1e-3)


def test_a_magnetic_heading_is_made_true_by_the_variation_of_the_table(write: Write) -> None:
    text = "time_s,mag_heading,variation\n" + "".join(f"{t},{10 + t},5\n" for t in range(10))
    profile, _ = drafted(write("a.csv", text))
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.values("ins", "true_heading_deg")[0] == 15.0 and read.values("ins", "magnetic_heading_deg")[0] == 10.0


def test_date_and_time_of_day_in_two_columns(write: Write) -> None:
    text = "Date;Time;Lat;Lon\n" + "".join(f"23.06.2021;14:13:{t:02d};55,{t:02d}1;37,5\n" for t in range(10))
    profile, toml = drafted(write("a.csv", text))
    read = Read(profile.with_suffix(".csv"), profile)
    assert read.times("gnss")[0] == 1_624_457_580_000_000_000 and read.values("gnss", "latitude_deg")[0] == 55.001
    us = write("us.csv", text.replace("23.06.2021", "06/23/2021"))
    assert '"%m/%d/%Y"' in new_profile(us).text and "month before day" in new_profile(us).text
    assert '"%d.%m.%Y"' in toml


def test_utc_in_whole_seconds_beside_a_counter(write: Write) -> None:
    head = "time(millisecond),datetime(utc),latitude,longitude,speed(mph),compass_heading(degrees)\n"
    rows = "".join(
        f"{int(t * 1000)},2026-07-14 11:45:{int(t):02d},{lat:.7f},{lon:.7f},{SPEED_MPS / 0.44704:.4f},{track:.1f}\n"
        for t, lat, lon, track in circle(100)
    )
    profile, text = drafted(write("air.csv", head + rows))
    assert 'kind = "utc_counter"' in text
    read = Read(profile.with_suffix(".csv"), profile)
    times = read.times("gnss")
    assert times[5] - times[4] == 500_000_000 and read.header.utc_of_zero_ns is not None
    assert read.values("gnss", "ground_speed_mps")[9] == pytest.approx(SPEED_MPS, rel=1e-4)


def test_gps_week_blanks_degrees_and_minutes_and_signs_for_no_value(write: Write) -> None:
    rows = "".join(f"2300 {100000 + t} 50:00:{t:04.1f}N 30:30:00E {'-' if t % 2 else 5 + t}\n" for t in range(20))
    profile, text = drafted(write("week.txt", "Week TOW Lat Lon Speed_kt\n" + rows))
    assert 'kind = "gps_week"' in text and 'delimiter = "blanks"' in text and 'missing = ["-"]' in text
    read = Read(profile.with_suffix(".txt"), profile)
    assert read.values("gnss", "latitude_deg")[1] == pytest.approx(50 + 1 / 3600)
    assert read.values("gnss", "longitude_deg")[0] == 30.5
    assert read.times("gnss")[1] - read.times("gnss")[0] == 1_000_000_000


def test_several_vehicles_in_one_table(write: Write) -> None:
    rows = "".join(
        f"{1_700_000_000 + t},{name},50.{t:02d},30.0,100\n" for t in range(20) for name in ("4b1814", "4b1815")
    )
    profile, text = drafted(write("a.csv", "time,icao24,lat,lon,velocity\n" + rows))
    assert "[key]" in text and 'column = "icao24"' in text and 'kind = "unix"' in text
    assert len(Read(profile.with_suffix(".csv"), profile).values("gnss", "latitude_deg")) == 40


@pytest.mark.parametrize(
    ("name", "target", "unit"),
    [
        ("GPS_Speed [kt]", "gnss.ground_speed_mps", "kt"),
        ("velN", "gnss.velocity_north_mps", ""),
        ("ins_vel_e", "ins.velocity_east_mps", ""),
        ("compass_heading(degrees)", "ins.magnetic_heading_deg", "deg"),
        ("altitudeAboveMeanSeaLevel", "gnss.altitude_msl_m", ""),
        ("Широта", "gnss.latitude_deg", ""),
        ("wx_rads", "imu.rate_x_dps", "radps"),
        ("height_above_takeoff(feet)", "", ""),
        ("HOME.latitude", "", ""),
        ("altitude (DOP)", "", ""),
    ],
)
def test_names_and_what_they_mean(name: str, target: str, unit: str) -> None:
    found = meaning_of(name)
    assert (found.target if found else "", found.unit if found else "") == (target, unit)


CAUSES = {
    "minutes and seconds alone": "time,lat,lon\n12:03.5,1.5,2\n12:03.6,1.5,2\n12:03.7,1.5,2\n",
    "a decimal comma in quotes": 'time,lat,lon\n"1,5","55,1","37,1"\n"2,5","55,1","37,1"\n',
}


@pytest.mark.parametrize("cause", CAUSES)
def test_errors_name_the_cause(write: Write, cause: str) -> None:
    table = write("a.csv", CAUSES[cause])
    with pytest.raises(UnreadableLogError, match=re.escape(cause)):
        new_profile(table)
    profile = write("p.toml", PROFILE)
    told = " ".join(one.text for one in findings_of(try_profile(profile, table)))
    assert cause in told and told.count(cause) == (3 if "quotes" in cause else 1)
    code, _, err = groundstation("profile", "check", str(profile), str(table))
    assert code in (1, 3) and err.count("\n") <= 1


US = "time,lat,lon\n" + "".join(f"{{0}}/{{1}}/2021 2:13:{s} PM,55.{s},37.5\n" for s in range(50, 60))


def test_us_dates_are_told_and_read_by_the_draft(write: Write) -> None:
    table = write("a.csv", US.format(6, 23))
    profile, text = drafted(table)
    assert 'date_formats = ["%m/%d/%Y"]' in text and "month before day, as in the US" in text
    assert Read(table, profile).times("gnss")[0] == 1_624_457_630_000_000_000  # 2021-06-23T14:13:50Z
    with pytest.raises(UnclaimedLogError, match="time: month before day, as in the US"):
        registry.identify(table)
    by_another = " ".join(one.text for one in findings_of(try_profile(write("p.toml", PROFILE), table)))
    assert "US dates (month/day/year), such as '6/23/2021 2:13:50 PM'" in by_another
    assert "day and month cannot be told apart" in " ".join(new_profile(write("b.csv", US.format(5, 6))).doubts)


@pytest.mark.parametrize("coding", ["utf-16", "utf-16-le"])
def test_utf_16_is_named(tmp_path: Path, coding: str) -> None:
    table = tmp_path / "a.csv"
    table.write_bytes(("time,lat,lon\n" + "1,2.5,3\n" * 30).encode(coding))
    for verb in (["profile", "new"], ["info"]):
        code, _, err = groundstation(*verb, str(table))
        assert code == 1 and "UTF-16" in err and "save it as CSV in UTF-8" in err


PROFILE = """name = "p"
[time]
kind = "seconds"
column = "time"
[columns]
lat = { field = "gnss.latitude_deg", unit = "deg" }
lon = { field = "gnss.longitude_deg", unit = "deg" }
Hdg = { field = "ins.true_heading_deg", unit = "deg" }
"""
TABLE = "time,lat,lon,Heading,volts\n0,55.0,37.0,10,28\n1,55.1,37.1,11,28\n2,55.2,37.2,x,27\n"


def test_a_check_lists_what_each_column_became_and_what_is_left(write: Write) -> None:
    profile, table = write("p.toml", PROFILE.replace("Hdg", "Heading")), write("a.csv", TABLE)
    checked = try_profile(profile, table)
    became = {one.name: (one.became, one.values, one.shown) for one in checked.columns}
    assert became["lat"] == ("gnss.latitude_deg", 3, "55 to 55.2") and became["time"][0] == "time"
    assert became["Heading"][1] == 2 and became["volts"] == ("", 3, "27 to 28")
    assert (checked.header, checked.rows, checked.delimiter) == (1, 3, ",")
    code, out, _ = groundstation("profile", "check", str(profile), str(table))
    assert code == 3 and "left: volts" in out and "header row 1" in out  # a cell was lost
    assert json.loads(groundstation("profile", "check", str(profile), str(table), "--json")[1])["profile"] == "p"


def test_a_missing_column_is_a_warning_with_the_nearest_names(write: Write) -> None:
    profile, table = write("p.toml", PROFILE), write("a.csv", TABLE.replace("x", "12"))
    (missing,) = try_profile(profile, table).missing
    assert missing.near[0] == "Heading" and missing.target == "ins.true_heading_deg"
    code, out, _ = groundstation("profile", "check", str(profile), str(table), "--fail-on", "warn")
    assert code == 4 and "column 'Hdg' (ins.true_heading_deg) is not there: nearest 'Heading'" in out
    _, out, _ = groundstation("info", str(table), "--profile", str(profile))
    assert "warn  profile p names columns that are not there: Hdg (nearest: Heading)" in out


def test_a_header_that_lacks_what_is_asked_for_is_told_with_the_nearest_names(write: Write) -> None:
    code, _, err = groundstation(
        "info", str(write("a.csv", "t,lat,lon\n1,2,3\n2,2,3\n")), "--profile", str(write("p.toml", PROFILE))
    )
    assert code == 1 and "row 1, which looks like the header, lacks 'time' (nearest: 't')" in err


def test_a_table_that_nothing_claims_gets_the_names_it_needs(write: Write) -> None:
    table = write("a.csv", "time,lat,lon,heading\n0,55.0,37.0,10\n1,55.1,37.1,11\n2,55.2,37.2,12\n")
    names = "name them time_s, gnss.latitude_deg, gnss.longitude_deg, ins.true_heading_deg"
    for verb in (["info"], ["run", "-o", str(table.parent / "out")]):
        code, _, err = groundstation(*verb, str(table))
        assert code == 1 and names in err and "or: groundstation profile new a.csv" in err and err.count("\n") == 1
    renamed = write("b.csv", table.read_text().replace("time,lat,lon,heading", names.removeprefix("name them ")))
    assert Read(renamed).values("ins", "true_heading_deg") == [10.0, 11.0, 12.0]


def test_the_nearest_profile_and_what_is_missing_are_told(write: Write) -> None:
    g5 = next(one for one in profile_sources.known_profiles() if one.name == "garmin-g5")
    gone = g5.time.columns[0]
    names = [name for name in dict.fromkeys((*g5.time.columns, *(rule.name for rule in g5.columns))) if name != gone]
    table = write("a.csv", "\n".join([",".join(names), *[",".join(["1.5"] * len(names))] * 3]) + "\n")
    with pytest.raises(UnclaimedLogError, match=f"nearest is profile garmin-g[35]x?: it lacks .*{re.escape(gone)}"):
        registry.identify(table)


def test_a_profile_in_the_users_folder_is_found_by_the_header(own_profiles: Path, write: Write) -> None:
    (own_profiles / "mine.toml").write_text(PROFILE.replace("Hdg", "Heading").replace('"p"', '"mine"'))
    (own_profiles / "bad.toml").write_text("name = 1")
    table = write("a.csv", TABLE)
    assert registry.identify(table).title == "csv-profile mine"
    read = Read(table)
    assert read.values("ins", "true_heading_deg")[:2] == [10.0, 11.0]
    assert "bad.toml is left out" in read.remarks["plug_in"].text
    code, out, err = groundstation("profile", "list")
    assert code == 0 and str(own_profiles / "mine.toml") in out and "bad.toml" in err
    other = write("b.csv", TABLE.replace("Heading", "Head"))
    with pytest.raises(UnclaimedLogError, match="nearest is profile mine: it lacks Heading"):
        registry.identify(other)


def test_what_a_profile_of_the_user_says_is_part_of_the_key_of_a_run(own_profiles: Path, write: Write) -> None:
    """A run that is continued after the profile was changed makes the results anew."""
    table, text = write("a.csv", TABLE), PROFILE.replace("Hdg", "Heading").replace('"p"', '"mine"')

    def keys() -> Keys:
        forget_profiles()
        return keys_of(open_log(table).source, Configuration())

    (own_profiles / "mine.toml").write_text(text)
    first = keys()
    (own_profiles / "other.toml").write_text(PROFILE.replace("Hdg", "Foo").replace('"p"', '"other"'))
    assert keys() == first  # nothing that the log was read by
    (own_profiles / "mine.toml").write_text(text.replace("ins.true_heading_deg", "ins.magnetic_heading_deg"))
    assert keys().conversion != first.conversion
    (own_profiles / "mine.toml").unlink()
    with pytest.raises(UnclaimedLogError):
        keys()


def test_a_shipped_profile_asked_for_by_its_name_has_a_key(write: Write) -> None:
    table = write("track.txt", "1714989600.0 0 0 0 0 0 0 1\n1714989600.1 1 0 0 0 0 0 1\n")
    source = open_log(table, Path("tum")).source
    assert keys_of(source, Configuration(profile="tum")) != keys_of(source, Configuration(profile="kitti-oxts"))


def test_a_profile_of_a_plug_in_is_found(own_profiles: Path, write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = write("theirs.toml", PROFILE.replace("Hdg", "Heading").replace('"p"', '"theirs"'))

    def load_plug_ins(group: str, what: str, take: Callable[[object], str]) -> tuple[str, ...]:
        return (take([str(shown), shown]),) if group == "groundstation.profiles" else ()

    monkeypatch.setattr(profile_sources, "load_plug_ins", load_plug_ins)
    assert registry.identify(write("a.csv", TABLE)).title == "csv-profile theirs"
    (told,) = profile_sources.other_profiles().failures
    assert "'theirs' is that of" in told  # the second of a name


def test_the_verb_writes_a_profile_that_the_other_verbs_take(write: Write, tmp_path: Path) -> None:
    table, target = write("a.csv", TABLE), tmp_path / "deep/my.toml"
    code, out, err = groundstation("profile", "new", str(table), "-o", str(target))
    assert (code, err) == (0, "") and "ins.true_heading_deg in deg" not in out  # one of its three cells is no number
    assert load(target).name == "a" and "gnss.latitude_deg in deg" in out
    assert groundstation("profile", "new", str(table), "-o", str(target))[0] == 2
    assert groundstation("profile", "new", str(table), "-o", str(target), "-f", "-q")[:2] == (0, "")
    code, out, err = groundstation("profile", "new", str(table))
    assert out == target.read_text() and "look at" in err
    assert json.loads(groundstation("profile", "new", str(table), "--json")[1])["profile"] == out
    assert groundstation("info", str(table), "--profile", str(target))[0] == 0
    assert groundstation("profile", "new", str(tmp_path / "none.csv"))[0] == 2
    assert groundstation("profile", "check", str(target), str(tmp_path))[0] == 2
    assert groundstation("profile", "check", str(table), str(table))[0] == 2  # no TOML


def test_the_tutorial_tells_what_the_verbs_print(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[2] / "docs/profiles.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"```csv\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("boat.csv").write_text(table, encoding="utf-8")
    calls = re.findall(r"    \$ groundstation (.*)\n((?:    .*\n)+)", page)
    assert [call.split()[:2] for call, _ in calls] == [["info", "boat.csv"], ["profile", "new"], ["profile", "check"]]
    for call, shown in calls:
        _, out, err = groundstation(*call.split())
        assert out + err == re.sub("^    ", "", shown, flags=re.MULTILINE)
        draft = Path("boat.toml")
        if call.startswith("profile new"):
            drafted_lines, edited = re.findall(
                r"```toml\n(\[recognise\].*?)```\n.*?```toml\n(.*?)```", page, re.DOTALL
            )[0]
            assert drafted_lines in draft.read_text()
            draft.write_text(re.sub(r'"Hdg" = .*\n', edited, draft.read_text()))
    Path("boat.csv").write_text(table.replace("Hdg", "Compass"), encoding="utf-8")
    code, out, _ = groundstation("profile", "check", "boat.toml", "boat.csv", "--fail-on", "warn")
    assert code == 4 and (line := out[out.index("warn") :].splitlines()[0]) and f"    {line}\n" in page


def test_a_check_tells_every_field_of_a_column_and_the_inputs_of_derived_ones(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,place,hdg,var,depth\n0,47.2 8.5,7,3,1\n1,47.3 8.6,8,3,1\n", encoding="utf-8")
    (tmp_path / "a.toml").write_text(
        """name = "a"
[time]
kind = "seconds"
column = "t"
[columns]
"place" = [{ field = "gnss.latitude_deg", unit = "deg", part = 1 },
           { field = "gnss.longitude_deg", unit = "deg", part = 2 }]
"hdg" = { field = "ins.magnetic_heading_deg", unit = "deg" }
[[derived]]
field = "ins.true_heading_deg"
method = "true_from_magnetic"
magnetic = "ins.magnetic_heading_deg"
variation = { column = "var", unit = "deg" }
""",
        encoding="utf-8",
    )
    checked = try_profile(tmp_path / "a.toml", tmp_path / "a.csv")
    assert [(one.name, one.became) for one in checked.columns] == [
        ("t", "time"),
        ("place", "gnss.latitude_deg"),
        ("place", "gnss.longitude_deg"),
        ("hdg", "ins.magnetic_heading_deg"),
        ("var", "input of ins.true_heading_deg"),
        ("depth", ""),
    ]
    assert sum(one.is_first for one in checked.columns) == 5
    with pytest.raises(GroundstationError, match="profile list"):
        registry.identify(tmp_path / "a.csv", Path("absent"))


def bad_tables() -> Iterator[bytes]:
    rng = random.Random(7)
    rows = "".join(f"{t},{lat:.6f},{lon:.6f},{track:.1f}\n" for t, lat, lon, track in circle(40))
    whole = ("# made\ntime,lat,lon,heading\n" + rows).encode()
    yield from (
        b"",
        b"\0" * 500,
        rng.randbytes(3000),
        b"time,lat,lon\n",
        b"hello\n",
        b'"""\n' * 50,
        b"," * 5000,
        whole[:-7],
    )
    yield from (b"time," + b"a" * 2_000_000 + b"\n1,2\n", b"time,lat\n" + b"9" * 400 + b",1\n" * 4)
    yield from (b'ti\x1bme,"la\nt",l\x7fon\n1,2,3\n2,3,4\n', b'time,"a""b]=",\'x\'\n1,2,3\n2,3,4\n3,4,5\n')
    yield (
        ",".join(f"c{at}" for at in range(10_000)) + "\n" + "\n".join(",".join(["1.5"] * 10_000) for _ in range(3))
    ).encode()
    for number in range(24):
        content = bytearray(whole[: rng.randrange(1, len(whole))] if number % 3 == 0 else whole)
        for _ in range(rng.randrange(1, 20)):
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        yield bytes(content)


def test_bad_tables_are_one_line(tmp_path: Path, write: Write) -> None:
    table, target, profile = (
        tmp_path / "a.csv",
        tmp_path / "new.toml",
        write("p.toml", PROFILE.replace("Hdg", "heading")),
    )
    drafts = 0
    for content in bad_tables():
        table.write_bytes(content)
        try:
            target.write_text(new_profile(table).text, encoding="utf-8")
            load(target)
            drafts += 1
            try_profile(target, table)
        except GroundstationError as error:
            assert "\n" not in str(error)
        for told in (lambda: findings_of(try_profile(profile, table)), lambda: registry.identify(table)):
            try:
                told()
            except GroundstationError as error:
                assert "\n" not in str(error)
    assert drafts > 15


def test_a_shipped_profile_is_checked_by_its_name(tmp_path: Path) -> None:
    table = tmp_path / "track.txt"
    table.write_text("# timestamp tx ty tz qx qy qz qw\n1714989600.0 0 0 0 0 0 0 1\n1714989600.1 1 0 0 0 0 0 1\n")
    by_name = CliRunner().invoke(app, ["profile", "check", "tum", str(table)])
    assert by_name.exit_code == 0 and "qw" in by_name.output
    unknown = CliRunner().invoke(app, ["profile", "check", "no-such", str(table)])
    assert unknown.exit_code == 2 and "no-such: no such file" in unknown.output
