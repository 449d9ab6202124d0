"""Ugly truths of real tables: what a draft makes of them is right, or is told."""

from pathlib import Path

import pytest

from groundstation.base.errors import SettingsError, UnreadableLogError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.verbs.profiles import new_profile, try_profile
from groundstation.readers import csv_profile, registry
from groundstation.readers.profile_file import load
from groundstation.readers.profile_sources import known_as
from tests.readers.test_flat_csv import Read
from tests.readers.test_profile_drafts import Write, drafted
from tests.readers.test_profile_drafts import write as write  # a fixture


def table(header: str, *rows: str) -> str:
    return "\n".join((header, *rows, ""))


def rows(form: str, count: int = 40, first: int = 0) -> tuple[str, ...]:
    """Rows of a place that moves: {t}, {n}, {e} of the form."""
    return tuple(form.format(t=t, n=55.0 + 1e-4 * t, e=37.0 + 2e-4 * t) for t in range(first, first + count))


def test_letters_beside_plain_degrees_give_the_sign(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,ns,lon,ew", *rows("{t},{n:.5f},S,{e:.5f},W")))
    profile, text = drafted(at)
    assert 'side = "ns"' in text and '"ns"  #' not in text
    read = Read(at, profile)
    assert read.values("gnss", "latitude_deg")[1] == -55.0001 and read.values("gnss", "longitude_deg")[1] == -37.0002
    check = try_profile(profile, at)
    assert [one.became for one in check.columns if one.name == "ew"] == ["sign of gnss.longitude_deg"]


@pytest.mark.parametrize("letter", ["", "X", "E"])
def test_a_latitude_without_its_letter_is_no_place(write: Write, letter: str) -> None:
    given = rows("{t},{n:.5f},N,{e:.5f},E")
    at = write("a.csv", table("time_s,lat,ns,lon,ew", *given))
    profile, _text = drafted(at)
    at = write("b.csv", table("time_s,lat,ns,lon,ew", *given[:5], given[5].replace("N", letter), *given[6:]))
    read = Read(at, profile)
    assert read.values("gnss", "latitude_deg")[5] is None and read.values("gnss", "latitude_deg")[6] is not None
    assert any("no N or S" in one.what and one.count == 1 for one in read.damages)


def test_a_file_without_the_column_of_letters_has_no_latitude(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,ns,lon,ew", *rows("{t},{n:.5f},S,{e:.5f},W")))
    profile, _text = drafted(at)
    other = write("b.csv", table("time_s,lat,hemi,lon,ew", *rows("{t},{n:.5f},S,{e:.5f},W")))
    read = Read(other, profile)
    assert all("latitude_deg" not in batch.columns for batch in read.batches)
    assert "ns" in read.remarks["missing_columns"].text
    assert [one.name for one in try_profile(profile, other).missing] == ["ns"]


def test_a_side_is_for_places_alone(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(
        'name = "p"\n[time]\nkind = "seconds"\ncolumn = "t"\n[columns]\n'
        'h = { field = "ins.true_heading_deg", unit = "deg", side = "s" }\n'
    )
    with pytest.raises(SettingsError, match=r"columns\.h\.side"):
        load(path)


def test_a_week_that_stays_where_its_seconds_begin_anew(write: Write) -> None:
    at = write(
        "a.csv", table("Week,TOW,Lat,Lon", *(f"2190,{s},55.{n},37.{n}" for n, s in enumerate((604798, 604799, 0, 1))))
    )
    profile, _text = drafted(at)
    first = iso_to_utc_ns("2022-01-01T23:59:40Z")[0]  # 18 leap seconds
    assert Read(at, profile).times("gnss") == [first + n * NS_PER_S for n in range(4)]


@pytest.mark.parametrize(
    "cells", [(0, 1, 1, 3, 2, 4), (65000, 65200, 65400, 64, 264, 464), (604798, 604799, 0, 1, 2, 3)]
)
@pytest.mark.parametrize("name", ["Time (s)", "ms", "GPS TOW [s]", "Counter (ms)"])
def test_times_that_go_back_are_read_and_told(write: Write, name: str, cells: tuple[int, ...]) -> None:
    at = write("a.csv", table(f"{name},lat,lon", *(f"{t},55.{n},37.{n}" for n, t in enumerate(cells))))
    draft = new_profile(at)
    assert draft.time_names == (name,) and "1 of 5 steps go back" in draft.time.doubt
    profile, _text = drafted(at)
    scale = 10**6 if "ms" in name else NS_PER_S
    assert Read(at, profile).times("gnss") == [t * scale for t in cells]


def test_one_row_is_a_table(write: Write) -> None:
    at = write("a.csv", table("Time,Lat,Lon", "7,55.5,37.5"))
    profile, text = drafted(at)
    assert "one row alone" in text and Read(at, profile).values("gnss", "latitude_deg") == [55.5]


@pytest.mark.parametrize(
    "day", ["31 Dez 2021", "31. Dez. 2021", "31-déc-21", "31/дек/2021", "Dec 31 2021", "31 December 2021"]
)
def test_a_month_by_its_name_in_another_language(write: Write, day: str) -> None:
    at = write("a.csv", table("Date;Time;Lat;Lon", *rows(day + ";23:59:{t:02d};{n:.5f};{e:.5f}")))
    profile, _text = drafted(at)
    assert Read(at, profile).times("gnss")[0] == iso_to_utc_ns("2021-12-31T23:59:00Z")[0]


def test_a_number_for_no_value_counts_in_its_column_alone(write: Write) -> None:
    cells = (f"{t},55.{t},37.{t},{9999 if t % 5 == 0 else t},{9990 + t}" for t in range(1, 30))
    at = write("a.csv", table("time_s,lat,lon,roll_deg,alt_ft", *cells))
    profile, _text = drafted(at)
    read = Read(at, profile)
    assert read.values("gnss", "altitude_msl_m")[8] == pytest.approx(9999 * 0.3048)
    assert read.values("ins", "roll_deg").count(None) == 0 and len(read.values("ins", "roll_deg")) == 24


@pytest.mark.parametrize("mark", ["***", "--.-", "N/A", "unknown", "-", "#VALUE!"])
def test_marks_for_no_value(write: Write, mark: str) -> None:
    cells = (f"{t},55.{t},37.{t},{mark if t % 3 == 0 else t}" for t in range(1, 31))
    at = write("a.csv", table("time_s,lat,lon,roll_deg", *cells))
    profile, _text = drafted(at)
    read = Read(at, profile)
    assert len(read.values("ins", "roll_deg")) == 20 and not read.damages


def test_numbers_of_ships_for_no_value(write: Write) -> None:
    cells = (f"366,{t},{n},{e},{s},{c},{h}" for t, n, e, s, c, h in [
        ("2021-03-12T12:00:00Z", 55.1, 37.1, 5.0, 90.0, 91), ("2021-03-12T12:00:10Z", 91.0, 181.0, 102.3, 360.0, 511),
        *((f"2021-03-12T12:01:{t:02d}Z", 55.2, 37.2, 5.1, 90.1, 92) for t in range(20)),
    ])  # fmt: skip
    at = write("a.csv", table("MMSI,BaseDateTime,LAT,LON,SOG,COG,Heading", *cells))
    profile, _text = drafted(at)
    read = Read(at, profile)
    assert max(one for one in read.values("ins", "true_heading_deg") if one is not None) == 92.0
    assert len(read.values("gnss", "latitude_deg")) == 21  # the row without a value is none


def test_places_in_radians_as_the_angles(write: Write) -> None:
    cells = (f"{t},{0.96 + 1e-6 * t:.8f},{0.65 + 1e-6 * t:.8f},{0.3 * t % 6.28:.3f}" for t in range(40))
    at = write("a.csv", table("time_s,lat,lon,yaw", *cells))
    profile, text = drafted(at)
    assert text.count("radians, as the angles") == 1 and "# ? lat, lon: " in text
    assert Read(at, profile).values("gnss", "latitude_deg")[0] == pytest.approx(55.0039483, abs=1e-7)


def test_degrees_and_minutes_with_leading_zeros(write: Write) -> None:
    cells = (f"{t},{100 + t / 100:09.4f},N,{230 + t / 100:010.4f},W" for t in range(40))
    at = write("a.csv", table("time_s,lat,ns,lon,ew", *cells))
    profile, text = drafted(at)
    read = Read(at, profile)
    assert text.count('unit = "ddmm"') == 2 and read.values("gnss", "latitude_deg")[0] == 1.0
    assert read.values("gnss", "longitude_deg")[0] == -2.5


def test_the_matrix_of_a_position_of_a_robot(write: Write) -> None:
    names = ",".join(f"field.position_covariance{n}" for n in range(9))
    cells = (f"{1615550400 + t}000000000,55.{t},37.{t},{n}" for t in range(30) for n in ["0.04,7,7,7,0.09,7,7,7,0.25"])
    at = write("a.csv", table(f"%time,field.latitude,field.longitude,{names}", *cells))
    read = Read(at, drafted(at)[0])
    found = [
        read.values("gnss", name)[0] for name in ("position_east_sigma_m", "position_north_sigma_m", "vertical_sigma_m")
    ]
    assert found == pytest.approx([0.2, 0.3, 0.5])


def test_a_doubt_that_columns_share_is_told_once_and_goes_with_one_line(write: Write) -> None:
    cells = (f"{10 * n},0.01,-0.02,1.0,{n % 7},{-(n % 5)},{n % 3}" for n in range(300))
    at = write("a.csv", table("time_ms,ax,ay,az,gx,gy,gz", *cells))
    profile, text = drafted(at)
    marks = [line for line in text.splitlines() if "? " in line]
    assert text.count("z reads +1 g") == 1 and text.count("degrees per second assumed") <= 1
    assert marks[0].startswith("# ? ax, ay, az, gx, gy, gz: z reads +1 g")
    assert Read(at, profile).remarks["unchecked_draft"].text.count("z reads +1 g") == 1
    profile.write_text("\n".join(line for line in text.splitlines() if line not in marks))
    assert "unchecked_draft" not in Read(at, profile).remarks


def test_question_marks_of_a_draft_are_told_until_they_are_taken_away(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,lon,alt", *rows("{t},{n:.5f},{e:.5f},{t}")))
    profile, text = drafted(at)
    assert "a.toml has question marks: alt: m assumed" in Read(at, profile).remarks["unchecked_draft"].text
    profile.write_text(text.replace("; ? m assumed", ""))
    assert "unchecked_draft" not in Read(at, profile).remarks


def test_a_profile_of_the_users_folder_by_its_name_and_at_once(own_profiles: Path, write: Write) -> None:
    at = write("a.csv", table("time_s,breite,laenge", *rows("{t},{n:.5f},{e:.5f}")))
    assert csv_profile.sniff(registry.Source(at)) is None
    (own_profiles / "file.toml").write_text(
        'name = "boat"\n[time]\nkind = "seconds"\ncolumn = "time_s"\n[columns]\n'
        'breite = { field = "gnss.latitude_deg", unit = "deg" }\n'
        'laenge = { field = "gnss.longitude_deg", unit = "deg" }\n'
    )
    assert known_as(Path("boat")) == known_as(Path("file")) == own_profiles / "file.toml"
    assert csv_profile.sniff(registry.Source(at)) is not None
    assert registry.identify(at, Path("boat")).title == "csv-profile boat"
    assert known_as(Path("garmin-g5")).name == "garmin_g5.toml"


def test_degrees_minutes_seconds_in_three_cells_below_one_name(write: Write) -> None:
    cells = (f"  {t}.0  -0 30 {t:02d}.000   -0 00 {59 - t:02d}.5  120.0  {t}.0" for t in range(30))
    head = "Export\n\n  UTCTime  Latitude  Longitude  H-Ell  Heading\n  (sec)  (+/-D M S)  (+/-D M S)  (m)  (deg)"
    at = write("a.txt", table(head, *cells))
    read = Read(at, drafted(at)[0])
    assert read.values("gnss", "latitude_deg")[3] == pytest.approx(-0.5 - 3.0 / 3600.0, abs=1e-12)
    assert read.values("gnss", "longitude_deg")[0] == pytest.approx(-59.5 / 3600.0, abs=1e-12)
    assert read.values("gnss", "altitude_ellipsoid_m")[0] == 120.0 and read.values("ins", "true_heading_deg")[7] == 7.0


@pytest.mark.parametrize("unit", ["deg mag", "deg M", "mag", "M", "°M", "degm"])
def test_directions_from_magnetic_north_by_their_unit(write: Write, unit: str) -> None:
    given = rows("{t},{n:.5f},{e:.5f},85.0,84.0")
    at = write("a.csv", table(f"time_s,lat,lon,Track ({unit}),Hdg ({unit})", *given))
    read = Read(at, drafted(at)[0])
    assert read.values("ins", "magnetic_heading_deg")[0] == 84.0
    assert "no gnss.track_deg" in read.remarks["magnetic_track"].text
    at = write("b.csv", table(f"time_s,lat,lon,Track ({unit}),Hdg ({unit}),MagVar", *(f"{row},5.0" for row in given)))
    read = Read(at, drafted(at)[0])
    assert read.values("ins", "true_heading_deg")[0] == 89.0


def test_longitudes_from_0_to_360(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,lon", *(f"{t},33.{t},289.5{t}" for t in range(10, 40))))
    assert Read(at, drafted(at)[0]).values("gnss", "longitude_deg")[0] == pytest.approx(-70.49)
    at = write("b.csv", table("time_s,lat,lon", *(f"{t},33.{t},{170 + t}.5" for t in range(40))))
    assert any("counts from 0 to 360" in one for one in new_profile(at).doubts)


def test_degrees_and_minutes_with_a_letter_in_the_cell(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,lon", *(f"{t},5530.{t}N,W03730.{t}" for t in range(10, 40))))
    read = Read(at, drafted(at)[0])
    assert read.values("gnss", "latitude_deg")[0] == pytest.approx(55.0 + 30.1 / 60.0)
    assert read.values("gnss", "longitude_deg")[0] == pytest.approx(-37.0 - 30.1 / 60.0)


@pytest.mark.parametrize(("name", "unit"), [("Millisec", 1e-3), ("Fraction", 1.0), ("ms", 1e-3), ("usec", 1e-6)])
def test_a_column_with_the_fraction_of_the_second(write: Write, name: str, unit: float) -> None:
    cells = (f"2021-03-12,12:00:{t // 4:02d},{round(t % 4 * 0.25 / unit, 6):g},55.{t},37.{t}" for t in range(100))
    at = write("a.csv", table(f"Date,Time,{name},Lat,Lon", *cells))
    profile, text = drafted(at)
    first = iso_to_utc_ns("2021-03-12T12:00:00Z")[0]
    assert "fraction of the second" in text
    assert Read(at, profile).times("gnss") == [first + t * NS_PER_S // 4 for t in range(100)]


def test_whole_seconds_without_a_fraction_are_told(write: Write) -> None:
    at = write("a.csv", table("UTC,Lat,Lon", *(f"2021-03-12T12:00:{t // 4:02d}Z,55.{t},37.{t}" for t in range(100))))
    assert "rows repeat the time of others" in new_profile(at).time.doubt


def test_days_as_excel_counts_them_are_the_cause(write: Write) -> None:
    at = write("a.csv", table("Date,Lat,Lon", *(f"{44267.5 + t / 86400:.9f},55.{t},37.{t}" for t in range(20))))
    with pytest.raises(UnreadableLogError, match="days since 1900"):
        new_profile(at)


def test_widths_count_characters(tmp_path: Path) -> None:
    profile = tmp_path / "p.toml"
    profile.write_text(
        'name = "p"\n[recognise]\nwidths = [6, 6, 9, 11]\n[time]\nkind = "seconds"\ncolumn = "t"\n[columns]\n'
        'lat = { field = "gnss.latitude_deg", unit = "deg" }\nlon = { field = "gnss.longitude_deg", unit = "deg" }\n'
    )
    rows = "".join(f"{t:6.1f}{'Жук °'[: t % 6]:>6}{55.0:9.5f}{-137.0:11.6f}\n" for t in range(12))
    for encoding in ("utf-8", "cp1251"):
        at = tmp_path / f"{encoding}.txt"
        at.write_bytes(("     t  name      lat        lon\n" + rows).encode(encoding))
        read = Read(at, profile)
        assert read.values("gnss", "latitude_deg") == [55.0] * 12 and not read.damages
        assert read.values("gnss", "longitude_deg") == [-137.0] * 12


def test_a_week_that_rolls_over_in_the_file(write: Write) -> None:
    at = write("a.csv", "w,s,lat,lon\n1023,604799,1,2\n0,0,1,2\n0,1,1,2\n")
    profile = at.with_suffix(".toml")
    profile.write_text(
        'name = "p"\n[time]\nkind = "gps_week"\nweek = "w"\nseconds = "s"\nearliest_year = 2010\n[columns]\n'
        'lat = { field = "gnss.latitude_deg", unit = "deg" }\n'
    )
    first = iso_to_utc_ns("2019-04-06T23:59:41Z")[0]
    assert Read(at, profile).times("gnss") == [first + t * NS_PER_S for t in range(3)]


def test_a_name_that_occurs_twice_is_told(write: Write) -> None:
    at = write("a.csv", table("time_s,lat,lon,lat", *rows("{t},{n:.5f},{e:.5f},9")))
    read = Read(at, drafted(at)[0])
    assert read.values("gnss", "latitude_deg")[0] == 55.0 and read.remarks["duplicate_column"].text.startswith("lat:")


def test_a_delay_in_milliseconds_is_no_counter(write: Write) -> None:
    cells = (f"2021-03-12T12:00:{t // 4:02d}Z,{40 + 7 * t % 11 + t / 100},55.{t},37.{t}" for t in range(100))
    at = write("a.csv", table("UTC,Latency (ms),Lat,Lon", *cells))
    draft = new_profile(at)
    assert draft.time_names == ("UTC",) and "rows repeat" in draft.time.doubt


@pytest.mark.parametrize("bits", [16, 32])
def test_a_counter_beside_utc_that_wraps_is_counted_on(write: Write, bits: int) -> None:
    counts = [((1 << bits) - 30_000 + 250 * t) for t in range(800)]
    cells = (
        f"2021-03-12 12:{(t + 1) // 240:02d}:{(t + 1) // 4 % 60:02d},{count % (1 << bits)},55.{t},37.{t}"
        for t, count in enumerate(counts)
    )
    at = write("a.csv", table("UTC,Counter (ms),Lat,Lon", *cells))
    read = Read(at, drafted(at)[0])
    assert read.times("gnss") == [count * 10**6 for count in counts]
    first = read.header.utc_of_zero_ns + counts[0] * 10**6
    assert first == iso_to_utc_ns("2021-03-12T12:00:00.25Z")[0]
    assert "counter_wraps" in read.remarks and "agree within 0.00 s" in read.remarks["utc_from_seconds"].text
