"""Drafts of tables of other makers, whose layouts are public: each reads right without an edit, or with the one told.

Layouts: Flightradar24 (playback), Danish Maritime Authority (AIS), Columbus V-1000, Racelogic VBOX, Torque, RaceBox.
"""

import math
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta

import pytest

from groundstation.base.errors import UnclaimedLogError, UnreadableLogError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.verbs.profiles import findings_of, new_profile, try_profile
from groundstation.readers import registry
from tests.readers.test_flat_csv import Read
from tests.readers.test_profile_drafts import SPEED_MPS, Write, circle, drafted, groundstation
from tests.readers.test_profile_drafts import write as write  # a fixture

START = datetime(2024, 5, 18, 10)
UTC = iso_to_utc_ns("2024-05-18T10:00:00Z")[0]
EAST_DEG = 30.0
Rows = Iterator[tuple[datetime, float, float, float]]


def unix_s(moment: datetime) -> float:
    return (moment - datetime(1970, 1, 1)).total_seconds()


def flown() -> Rows:
    """Time, latitude, longitude and track of a circle."""
    return ((START + timedelta(seconds=t), lat, lon, track) for t, lat, lon, track in circle(120, 1.0))


def table(head: str, row: Callable[[datetime, float, float, float], str]) -> str:
    return head + "".join(row(*one) for one in flown())


def assert_flown(read: Read, first_ns: int = UTC) -> None:
    """The circle is what was read: places, times, speed."""
    assert read.times("gnss")[:2] == [first_ns, first_ns + NS_PER_S]
    assert read.values("gnss", "latitude_deg")[30] == pytest.approx(list(circle(31, 1.0))[30][1], abs=2e-6)
    assert read.values("gnss", "longitude_deg")[30] == pytest.approx(list(circle(31, 1.0))[30][2], abs=2e-6)
    assert read.values("gnss", "ground_speed_mps")[5] == pytest.approx(SPEED_MPS, rel=0.03)
    assert not [one for one in read.damages if one.loses_data]


def test_a_place_in_one_cell(write: Write) -> None:
    head = "Timestamp,UTC,Callsign,Position,Altitude,Speed,Direction\n"
    at = write(
        "fr.csv",
        table(head, lambda t, n, e, d: f'{unix_s(t):.0f},{t:%Y-%m-%dT%H:%M:%SZ},X,"{n:.6f},{e:.6f}",900,19,{d:.0f}\n'),
    )
    profile, text = drafted(at)
    assert "part = 1" in text and 'kind = "unix"' in text and '"Direction" = { field = "gnss.track_deg"' in text
    assert_flown(Read(at, profile))


def test_ships_in_one_table_with_the_day_first(write: Write) -> None:
    head = "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,ROT,SOG,COG,Heading\n"

    def rows(moment: datetime, north: float, east: float, track: float) -> str:
        stamp = f"{moment:%d/%m/%Y %H:%M:%S}"
        ship = f"{stamp},Class A,219024000,{north:.6f},{east:.6f},,19.4,{track:.1f},{track:.0f}\n"
        return f"{ship}{stamp},Base Station,,56.7,11.5,,,,\n"

    at = write("ais.csv", table(head, rows))
    profile, text = drafted(at)
    assert 'date_formats = ["%d/%m/%Y"]' in text and 'column = "MMSI"' not in text  # one vessel alone has a number
    read = Read(at, profile)
    assert read.values("gnss", "ground_speed_mps")[0] == pytest.approx(19.4 * 1852 / 3600)
    several = write("two.csv", at.read_text().replace("Base Station,,", "Class B,219024001,"))
    profile, text = drafted(several)
    assert 'column = "MMSI"' in text and Read(several, profile).header.metadata["aircraft"] in (
        "219024000",
        "219024001",
    )


def test_digits_of_date_and_time_and_a_letter_behind_degrees(write: Write) -> None:
    head = "INDEX,TAG,DATE,TIME,LATITUDE N/S,LONGITUDE E/W,HEIGHT,SPEED,HEADING\n"
    at = write(
        "columbus.csv",
        table(head, lambda t, n, e, d: f"1,T,{t:%y%m%d},{t:%H%M%S},{n:.6f}N,{e:010.6f}E,100,36.0,{d:.0f}\n"),
    )
    profile, text = drafted(at)
    assert 'date_formats = ["%y%m%d"]' in text and "? six digits of a date: year, month, day assumed" in text
    assert_flown(Read(at, profile))
    south = write("s.csv", at.read_text().replace("N,", "S,").replace("E,1", "W,1"))
    read = Read(south, profile)
    assert read.values("gnss", "latitude_deg")[0] == -50.0 and read.values("gnss", "longitude_deg")[0] == -EAST_DEG


def test_sections_minutes_of_arc_and_a_date_above(write: Write) -> None:
    head = "File created on 18/05/2024 @ 10:00:00\n\n[header]\nsatellites\ntime\n\n[column names]\n"
    head += "sats time lat long velocity heading height \n\n[data]\n"
    at = write(
        "a.vbo",
        table(head, lambda t, n, e, d: f"012 {t:%H%M%S}.000 {n * 60:+.8f} {-e * 60:+.8f} 036.000 {d:07.3f} +0100.0 \n"),
    )
    profile, text = drafted(at)
    assert 'unit = "arcmin", sign = -1' in text and "positive to the west by the heading" in text
    assert 'kind = "time_of_day"' in text and "the date is that above" in text
    assert_flown(Read(at, profile))


def test_names_of_months_and_a_dash_for_no_value(write: Write) -> None:
    head = "GPS Time, Device Time, Longitude, Latitude,GPS Speed (Meters/second), Altitude, Bearing\n"
    at = write(
        "torque.csv",
        table(head, lambda t, n, e, d: f"{t:%a %b %d %H:%M:%S} GMT 2024,{t:%d-%b-%Y %H:%M:%S}.000,"
              + (f"{e:.7f},{n:.7f},10.0,30.0,{d:.1f}\n" if t.second % 7 else "-,-,-,-,-\n")),
    )  # fmt: skip
    profile, text = drafted(at)
    assert 'date_formats = ["%d-%b-%Y"]' in text and 'missing = ["-"]' in text
    read = Read(at, profile)
    assert read.times("gnss")[0] == UTC + NS_PER_S and not read.damages


def test_degrees_and_minutes_run_together_with_the_side_in_a_column(write: Write) -> None:
    def run_together(value: float) -> str:
        return f"{int(value) * 100 + value % 1.0 * 60.0:.5f}"

    head = "UTC,Lat,NS,Lon,EW,Speed_kn,Course\n"
    text = table(head, lambda t, n, e, d: f"{t:%H%M%S}.00,{run_together(n)},N,{run_together(e)},E,19.4384,{d:.1f}\n")
    at = write("log_20240518.csv", text)
    profile, draft = drafted(at)
    assert 'unit = "ddmm", side = "EW"' in draft and "[metadata.find_in_name]" in draft
    assert_flown(Read(at, profile))
    west = write("log_20240519.csv", text.replace(",E,", ",W,"))
    profile, draft = drafted(west)
    assert Read(west, profile).values("gnss", "longitude_deg")[0] == -EAST_DEG
    both = Read(write("log_20240520.csv", text.replace(",E,", ",W,", 50)), profile).values("gnss", "longitude_deg")
    assert all(one < 0.0 for one in both[:50]) and all(one > 0.0 for one in both[50:])
    nameless = new_profile(write("c.csv", text.replace(",E,", ",W,", 50).replace(",EW,", ",,")))
    assert any("has both E and W" in one for one in nameless.doubts)


def test_rates_in_the_unit_that_the_turns_show(write: Write) -> None:
    head = "Record,Time,Latitude,Longitude,Speed,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ\n"
    for scale, unit in ((1.0, "dps"), (math.pi / 180.0, "radps")):
        rate = math.degrees(SPEED_MPS / 100.0) * scale
        text = table(
            head,
            lambda t, n, e, d, rate=rate: f"1,{t:%Y-%m-%dT%H:%M:%S}Z,{n:.7f},{e:.7f},36,0.01,0.1,1.0,0,0,{rate:.5f}\n",
        )  # type: ignore[misc]
        profile, draft = drafted(write(f"{unit}.csv", text))
        assert (
            f'"GyroZ" = {{ field = "imu.rate_z_dps", unit = "{unit}"' in draft and "by the turns of the motion" in draft
        )
        read = Read(profile.with_suffix(".csv"), profile)
        assert read.values("imu", "accel_z_mps2")[0] == pytest.approx(-9.80665)


OF_DAY = "Time,Lat,Lon,Speed_mps\n"


def of_day(form: str = "%H:%M:%S") -> str:
    return table(OF_DAY, lambda t, n, e, d: f"{t:{form}},{n:.7f},{e:.7f},10.0\n")


@pytest.mark.parametrize("name", ["flight_2024-05-18.csv", "18.05.2024 7.csv", "LOG-20240518-1.csv"])
@pytest.mark.parametrize("form", ["%H:%M:%S", "%I:%M:%S %p", "%H%M%S.00"])
def test_times_of_day_get_the_date_of_the_files_name(write: Write, name: str, form: str) -> None:
    at = write(name, of_day(form))
    profile, _text = drafted(at)
    assert_flown(Read(at, profile))


def test_times_of_day_without_a_date_are_told_and_a_date_can_be_stated(write: Write) -> None:
    at = write("a.csv", of_day())
    with pytest.raises(UnclaimedLogError, match="times of day without a date"):
        registry.identify(at)
    profile, text = drafted(at)
    assert any("times of day without a date: put it below" in one for one in new_profile(at).doubts)
    assert Read(at, profile).header.utc_of_zero_ns is None and "no_date" in Read(at, profile).remarks
    profile.write_text(text.replace('"unknown"', '"2024-05-18"'))
    assert_flown(Read(at, profile))


@pytest.mark.parametrize(
    ("head", "delimiter"), [("% my logger\n% metres, degrees\n", " "), ("Logger;v2\n\n", ";"), ("# x\n", ",")]
)
def test_a_table_without_names_below_a_preamble(write: Write, head: str, delimiter: str) -> None:
    rows = "".join(delimiter.join((f"{t:.1f}", f"{n:.7f}", f"{e:.7f}", "10.0")) + "\n" for t, n, e, _ in circle())
    at = write("a.txt", head + rows)
    with pytest.raises(UnclaimedLogError, match=r"a table without a row of names \(4 columns"):
        registry.identify(at)
    assert "--names" in new_profile(at).text
    target = at.with_suffix(".toml")
    code, _out, err = groundstation("profile", "new", str(at), "--names", "t_s,lat,lon,speed", "-o", str(target))
    assert (code, err) == (0, "")
    read = Read(at, target)
    assert len(read.values("gnss", "latitude_deg")) == 200 and not read.damages
    assert read.values("gnss", "ground_speed_mps")[0] == 10.0
    assert not findings_of(try_profile(target, at))
    for names in ("t,lat", "t,lat,lon,lat"):
        code, _out, err = groundstation("profile", "new", str(at), "--names", names)
        assert code == 1 and "expected 4 names, one for each column" in err
    with pytest.raises(UnreadableLogError, match="names of its own in row 1"):
        new_profile(write("b.csv", of_day()), ("a", "b", "c", "d"))


def test_nines_that_are_far_from_all_other_values_are_none(write: Write) -> None:
    rows = "".join(
        "\t".join(
            map(str, (t, *((9999, 9999) if t % 5 == 0 else (n, e)), -999.0 if t % 3 == 0 else 100, 999 + t, "\r\n"))
        )
        for t, n, e, _ in circle(50, 1.0)
    )
    at = write("a.tsv", "\ufefftime_s\tlat\tlon\talt_m\trpm\r\n" + rows)
    profile, text = drafted(at)
    assert "missing = [9999]" in text and "missing = [-999]" in text  # each in its column alone
    read = Read(at, profile)
    assert len([one for one in read.values("gnss", "latitude_deg") if one is not None]) == 40 and not read.damages
    assert {one for one in read.values("gnss", "altitude_msl_m") if one is not None} == {100.0}


def test_names_behind_the_sign_of_a_comment_with_blanks(write: Write) -> None:
    rows = "".join(f"{t:.1f} {n:.7f} {e:.7f}\n" for t, n, e, _ in circle(50))
    at = write("a.txt", "# t lat lon\n" + rows)
    profile, _text = drafted(at)
    assert len(Read(at, profile).values("gnss", "latitude_deg")) == 50


def test_a_comment_below_the_names_is_no_row_of_units(write: Write) -> None:
    rows = "".join(f"{1000 * t:.0f};{n:.7f};{e:.7f};\n".replace(".", ",") for t, n, e, _ in circle(20))
    at = write("a.csv", "# logger\ntime_ms;lat;lon;\n# mark 1\n" + rows)
    profile, text = drafted(at)
    assert "rows_after_header" not in text
    assert len(Read(at, profile).values("gnss", "latitude_deg")) == 20


def test_variances_become_sigmas(write: Write) -> None:
    head = '"time","lat","lon","cov_ee","cov_nn (m^2)","height_var"\n'
    at = write("a.csv", table(head, lambda t, n, e, d: f"{unix_s(t)},{n:.7f},{e:.7f},0.04,0.09,4\n"))
    profile, text = drafted(at)
    assert '"cov_nn (m^2)" = { field = "gnss.position_north_sigma_m", unit = "m", variance = true }' in text
    read = Read(at, profile)
    sigmas = ("position_north_sigma_m", "position_east_sigma_m", "vertical_sigma_m")
    assert [read.values("gnss", name)[0] for name in sigmas] == pytest.approx([0.3, 0.2, 2.0])


def test_seconds_of_the_week_alone_and_weeks_that_rolled_over(write: Write) -> None:
    rows = [(604_780 + t, n, e) for t, n, e, _ in circle(60)]
    alone = write("a.csv", "iTOW,lat,lon\n" + "".join(f"{1000 * (s % 604_800):.0f},{n},{e}\n" for s, n, e in rows))
    draft = new_profile(alone)
    assert 'unit = "ms"' in draft.text and any("without the week: no absolute time" in one for one in draft.doubts)
    weeks = write(
        "b.csv",
        "Week,SOW,lat,lon\n" + "".join(f"{265 + int(s // 604_800)},{s % 604_800},{n},{e}\n" for s, n, e in rows),
    )
    profile, text = drafted(weeks)
    assert "earliest_year = 2000" in text
    read = Read(weeks, profile)
    times = read.times("gnss")
    assert times[0] == iso_to_utc_ns("2004-09-25T23:59:27Z")[0] and times[-1] - times[0] == 29_500_000_000
    assert "week_rollover" in read.remarks


def test_a_comma_between_date_and_time_in_quotes(write: Write) -> None:
    at = write(
        "a.csv", table("Date,lat,lon,mps\n", lambda t, n, e, d: f'"5/18/2024, {t:%I:%M:%S %p}",{n:.7f},{e:.7f},1\n')
    )
    profile, _text = drafted(at)
    assert Read(at, profile).times("gnss")[0] == UTC
