"""Tracks for other programs: written files read back, by our own readers and by the peers' where there are any."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pyarrow.parquet as pq
import pynmeagps
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError, UsageError
from groundstation.base.records import Column, frozen
from groundstation.exports.nmea import write_nmea
from groundstation.exports.sbet import write_sbet
from groundstation.exports.tracks import HALF_WIDTH, MSL, Track, tracks_of
from groundstation.pipeline.verbs.export import WRITERS_OF_ONE, _written_alone, export
from groundstation.pipeline.verbs.export_figures import export_figures
from groundstation.results.answer import by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, Source
from groundstation.systems.inertial.answer import InertialResult
from groundstation.tables.table import Flight, Table
from tests.figure_arrays import filled
from tests.fleet_example import save_flight
from tests.saved import load

SAMPLES = Path(__file__).parents[1] / "sample_logs"
START_NS = 1_777_874_400_000_000_000  # 2026-05-04T06:00Z
KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
BARE = FlightResults("NOTIME_00000000", Source("a.csv", "00" * 32, 0, "flat-csv"), {}, None, 0.0, "ok")
GPX, OWN = "{http://www.topografix.com/GPX/1/1}", "{https://groundstation.invalid/gpx/1}"


def table(topic: str, time_s: np.ndarray, **columns: np.ndarray) -> Table:
    time_ns = START_NS + np.rint(time_s * 1e9).astype(np.int64)
    return Table(
        topic,
        time_ns,
        {name: Column(frozen(values)) for name, values in columns.items()},
        np.arange(len(time_ns)),
        Column(time_s),
    )


def flight(has_utc: bool = True, **left_out: None) -> Flight:
    """A turn over the south-west: positions at 5 Hz, attitude between them at 20 Hz in rows of its own."""
    time_s = np.arange(0.0, 10.0, 0.05)
    fix = np.arange(len(time_s)) % 4 == 1
    heading = np.mod(350.0 + 4.0 * time_s, 360.0)

    def at_fix(values: np.ndarray) -> np.ndarray:
        return np.where(fix, values, np.nan)

    ins = {
        "latitude_deg": at_fix(-33.5 - 1e-4 * time_s),
        "longitude_deg": at_fix(-70.6 - 2e-4 * time_s),
        "altitude_ellipsoid_m": at_fix(530.0 + time_s),
        "velocity_north_mps": np.where(fix, np.nan, -11.0 + 0.1 * time_s),
        "velocity_east_mps": np.where(fix, np.nan, -18.0),
        "velocity_down_mps": np.where(fix, np.nan, -1.0),
        "roll_deg": np.where(fix, np.nan, 10.0 - time_s),
        "pitch_deg": np.where(fix, np.nan, 2.0),
        "true_heading_deg": np.where(fix, np.nan, heading),
    }
    gnss = {
        "latitude_deg": np.linspace(-33.5, -33.501, 11),
        "longitude_deg": np.linspace(-70.6, -70.602, 11),
        "altitude_msl_m": np.linspace(500.0, 510.0, 11),
        "velocity_north_mps": np.full(11, -3.0),
        "velocity_east_mps": np.full(11, -4.0),
        "hdop": np.full(11, 0.8),
        "satellites_used": np.full(11, 9.0),
        "integrity_ok": np.where(np.arange(11) == 4, 0.0, 1.0),
    }
    kept = {name: values for name, values in ins.items() if name not in left_out}
    tables = {"ins": table("ins", time_s, **kept), "gnss": table("gnss", np.arange(11.0), **gnss)}
    return Flight(tables, {}, START_NS, has_utc, "a<b>.csv")


def estimated(figures: tuple[FigureData, ...], ins_topic: str = "ins") -> FlightResults:
    """Results with the answer on the errors of an INS."""
    answer = InertialResult(ins_topic, "gnss", "unaided", "", epochs=3, gnss_seconds=10.0)
    return replace(BARE, answers=by_analysis(answer), figures=figures)


def track_of(name: str, **options: bool) -> Track:
    (found,) = (one for one in tracks_of(flight(**options), None) if one.name == name)
    return found


def test_a_fix_that_the_receiver_does_not_trust_is_left_out() -> None:
    assert track_of("gnss").time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]


def test_attitude_of_other_rows_is_interpolated_over_a_short_time_alone() -> None:
    ins = track_of("ins")
    expected = np.mod(350.0 + 4.0 * ins.time_s, 360.0)
    assert np.allclose(ins.column("true_heading_deg"), expected, atol=1e-6), "through north"
    assert np.allclose(ins.column("roll_deg"), 10.0 - ins.time_s, atol=1e-9)
    sparse = table(
        "ins",
        np.array([0.0, 0.5, 1.0]),
        latitude_deg=np.array([math.nan, 1.0, math.nan]),
        longitude_deg=np.array([math.nan, 1.0, math.nan]),
        roll_deg=np.array([0.0, math.nan, 1.0]),
    )
    (alone,) = tracks_of(Flight({"ins": sparse}, {}, START_NS, True, "b.csv"), None)
    assert np.isnan(alone.column("roll_deg")).all()


def test_the_corrected_track_has_its_interval() -> None:
    at_s = np.array([0.0, 5.0, 10.0])
    place = {"corrected_latitude_deg": at_s * 1e-4, "corrected_longitude_deg": at_s * 0.0}
    sigmas = {"north_position_sigma_m": np.full(3, 3.0), "east_position_sigma_m": np.array([4.0, 1.0, 4.0])}
    figures = filled("inertial_track", time_s=at_s, **place), filled("inertial_states", time_s=at_s, **sigmas)
    (track,) = (one for one in tracks_of(flight(), estimated(figures)) if one.name == "corrected")
    assert np.allclose(track.column(HALF_WIDTH), math.sqrt(-2.0 * math.log(0.05)) * np.array([4.0, 3.0, 4.0]))


def test_the_smoothed_track_is_not_called_as_the_reference_that_judges_is() -> None:
    place = {"reference_latitude_deg": np.array([1.0, 2.0]), "reference_longitude_deg": np.array([3.0, 4.0])}
    figures = (filled("inertial_track", time_s=np.array([0.0, 5.0]), **place),)
    (track,) = (one for one in tracks_of(flight(), estimated(figures)) if one.name == "smoothed")
    assert track.latitude_deg.tolist() == [1.0, 2.0]


def test_sentences_are_what_another_program_reads(tmp_path: Path) -> None:
    track = track_of("gnss")
    write_nmea(tmp_path / "a.nmea", track)
    with (tmp_path / "a.nmea").open("rb") as stream:
        found = [message for _, message in pynmeagps.NMEAReader(stream, quitonerror=pynmeagps.ERR_RAISE)]
    gga = [message for message in found if message.msgID == "GGA"]
    rmc = [message for message in found if message.msgID == "RMC"]
    assert np.allclose([message.lat for message in gga], track.latitude_deg, atol=1e-8)
    assert np.allclose([message.lon for message in gga], track.longitude_deg, atol=1e-8)
    assert [message.alt for message in gga] == track.column(MSL).tolist()
    assert {str(message.date) for message in rmc} == {"2026-05-04"}
    assert np.allclose([message.spd for message in rmc], 5.0 / 0.514444, atol=1e-3)
    assert np.allclose([message.cog for message in rmc], 180.0 + math.degrees(math.atan2(4.0, 3.0)), atol=1e-3)


def test_our_reader_reads_the_trajectory_back(tmp_path: Path) -> None:
    track = track_of("ins")
    assert write_sbet(tmp_path / "sbet_20260504.out", track) == 0
    read = groundstation.open(tmp_path / "sbet_20260504.out").flight["ins"]
    assert read.time_ns.tolist() == pytest.approx(track.time_ns.tolist(), abs=1000)
    for name in ("altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps", "roll_deg", "true_heading_deg"):
        assert np.allclose(read.values(name), track.column(name), atol=1e-6), name
    assert np.allclose(read.values("latitude_deg"), track.latitude_deg, atol=1e-9)


def test_leap_seconds_and_the_end_of_a_week_are_read_back(tmp_path: Path) -> None:
    track = track_of("ins")
    for name, before in (("sbet_20161231.out", "2016-12-31T23:59:56"), ("sbet_20170107.out", "2017-01-07T23:59:38")):
        start_ns = int(np.datetime64(before, "ns").astype(np.int64))
        moved = replace(track, time_ns=track.time_ns - START_NS + start_ns, start_ns=start_ns)
        write_sbet(tmp_path / name, moved)
        read = groundstation.open(tmp_path / name).flight["ins"]
        assert np.abs(read.time_ns - moved.time_ns).max() < 1000, name


def test_the_number_of_positions_that_sbet_leaves_out_is_told(tmp_path: Path) -> None:
    track = track_of("ins")
    lacking = {**track.columns, "roll_deg": np.where(np.arange(len(track)) < 3, math.nan, track.column("roll_deg"))}
    told = _written_alone(WRITERS_OF_ONE[".out"], tmp_path / "a.out", (replace(track, columns=lacking),), False)
    assert told == f"ins ({len(track) - 3}, 3 left out: they lack what the format needs)"
    assert (tmp_path / "a.out").stat().st_size == (len(track) - 3) * 136


def test_moments_of_sentences_are_rounded(tmp_path: Path) -> None:
    track = track_of("gnss")
    write_nmea(tmp_path / "a.nmea", replace(track, time_ns=track.time_ns - 1))
    (first, *_) = (tmp_path / "a.nmea").read_text(encoding="ascii").splitlines()
    assert first.startswith("$GPGGA,060000.000,")


def test_places_off_the_earth_and_heights_that_lack(tmp_path: Path) -> None:
    from groundstation.exports.kml import write_kml

    log = table(
        "gnss",
        np.arange(6.0),
        latitude_deg=np.array([10.0, 912.0, 10.0, 10.0, 10.0, math.inf]),
        longitude_deg=np.array([190.0, 10.0, 180.0, -180.0, 359.0, 0.0]),
        altitude_msl_m=np.array([math.nan, 1.0, 100.0, math.nan, math.nan, 1.0]),
        altitude_ellipsoid_m=np.array([math.nan, 1.0, 120.0, math.nan, 140.0, 1.0]),
    )
    (track,) = tracks_of(Flight({"gnss": log}, {}, START_NS, True, "b.csv"), None)
    assert track.longitude_deg.tolist() == [-170.0, 180.0, -180.0, -1.0] and np.all(track.latitude_deg == 10.0)
    write_kml(tmp_path / "a.kml", "b", [track])
    root = ET.parse(tmp_path / "a.kml").getroot()
    assert "above the ellipsoid" in str(root.findtext(f".//{KML}description"))
    assert [str(one.text).split()[2] for one in root.iter(f"{GX}coord")] == ["120", "120", "130", "140"]


def test_what_a_format_needs_and_the_flight_lacks_is_told(tmp_path: Path) -> None:
    (gnss, ins) = tracks_of(flight(altitude_ellipsoid_m=None), None)
    with pytest.raises(NotAssessableError, match="ins: found no position with altitude above the ellipsoid"):
        write_sbet(tmp_path / "a.out", ins)
    with pytest.raises(NotAssessableError, match="gnss: found no UTC"):
        write_nmea(tmp_path / "a.nmea", track_of("gnss", has_utc=False))
    assert len(gnss) and not list(tmp_path.iterdir())


@pytest.mark.parametrize("has_utc", [True, False])
def test_pages_of_the_earth_hold_every_position(tmp_path: Path, has_utc: bool) -> None:
    from groundstation.exports.gpx import write_gpx
    from groundstation.exports.kml import write_kml

    tracks = tracks_of(flight(has_utc=has_utc), None)
    write_kml(tmp_path / "a.kml", "a<b>", tracks)
    root = ET.parse(tmp_path / "a.kml").getroot()
    places = root.findall(f".//{KML}Placemark")
    assert [place.findtext(f"{KML}name") for place in places] == ["gnss", "ins"]
    assert "above sea level" in str(places[0].findtext(f"{KML}description"))
    if has_utc:
        spots = [coord.text.split() for coord in places[1].iter(f"{GX}coord")]
        assert len(spots) == len(list(places[1].iter(f"{KML}when"))) == len(tracks[1])
        values = places[1].find(f".//{GX}SimpleArrayData[@name='roll_deg']")
        assert [float(one.text) for one in values] == pytest.approx(tracks[1].column("roll_deg").tolist(), abs=1e-4)
    else:
        spots = [spot.split(",") for spot in str(places[1].findtext(f".//{KML}coordinates")).split()]
    assert np.allclose(np.array(spots, dtype=float)[:, 1], tracks[1].latitude_deg, atol=1e-9)

    write_gpx(tmp_path / "a.gpx", "a<b>", tracks)
    root = ET.parse(tmp_path / "a.gpx").getroot()
    points = root.findall(f"{GPX}trk")[0].findall(f".//{GPX}trkpt")
    assert [float(point.get("lat")) for point in points] == pytest.approx(tracks[0].latitude_deg.tolist(), abs=1e-9)
    assert [float(point.findtext(f"{GPX}ele")) for point in points] == tracks[0].column(MSL).tolist()
    assert (points[0].find(f"{GPX}time") is not None) == has_utc
    children = [child.tag.removeprefix(GPX) for child in points[0]]
    assert children == [*["ele"], *(["time"] if has_utc else []), "sat", "hdop", "extensions"], "the schema's order"


def test_a_flight_becomes_a_table(tmp_path: Path) -> None:
    log = SAMPLES / "taxi-good.csv"
    outcome = export(log, tmp_path / "a.csv")
    assert outcome.state == "done" and "gnss (" in outcome.text
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    gnss = groundstation.open(log).flight["gnss"]
    assert [float(row["latitude_deg"]) for row in rows if row["track"] == "gnss"] == gnss.values(
        "latitude_deg"
    ).tolist()
    assert rows[0]["time_utc"].startswith("2026-05-04T06:00:0")
    export(log, tmp_path / "a.parquet", names=["gnss", "gnss"])
    assert pq.read_table(tmp_path / "a.parquet").num_rows == len(gnss)


def test_refusals_are_one_line_and_leave_nothing(tmp_path: Path) -> None:
    log = SAMPLES / "taxi-good.csv"
    with pytest.raises(UsageError, match=r"suffix \.shp"):
        export(log, tmp_path / "a.shp")
    with pytest.raises(UsageError, match=r"track gnss\.9: found not in taxi-good\.csv, expected one of gnss"):
        export(log, tmp_path / "a.csv", names=["gnss.9"])
    (tmp_path / "b.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(UsageError, match="a file that exists"):
        export(log, tmp_path / "b.csv")
    with pytest.raises(UsageError, match="no such file"):
        export(tmp_path / "none.csv", tmp_path / "a.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["b.csv"]


def test_a_made_track_has_the_height_of_its_ins_and_no_other() -> None:
    at_s = np.array([1.0, 5.0, 40.0])  # the last is long after the log's end
    place = {"corrected_latitude_deg": at_s * 1e-4, "corrected_longitude_deg": at_s * 0.0}
    figures = (filled("inertial_track", time_s=at_s, **place),)

    def made(ins_topic: str) -> Track:
        (track,) = (one for one in tracks_of(flight(), estimated(figures, ins_topic)) if one.name == "corrected")
        return track

    height_m = made("ins").column("altitude_ellipsoid_m")
    assert np.allclose(height_m[:2], 530.0 + at_s[:2], atol=0.051)
    assert np.isnan(height_m[2])
    assert "altitude_ellipsoid_m" not in made("").columns


def test_figures_are_written_with_units_and_utc(tmp_path: Path) -> None:
    folder = save_flight(tmp_path / "out", 0)
    target = tmp_path / "taxi.csv"
    export_figures(folder, target, ["heading_samples"])
    with target.open() as file:
        rows = list(csv.DictReader(file))
    saved = load(folder).figures["heading_samples"]
    assert list(rows[0]) == ["utc", *saved.columns]
    assert rows[0]["utc"] == "2026-05-04T06:01:00.000Z"
    assert [float(row["ground_speed_mps"]) for row in rows] == saved["ground_speed_mps"].tolist()
    assert rows[0]["track_deg"] == ""
    export_figures(folder, tmp_path / "all")
    assert {path.stem for path in (tmp_path / "all").iterdir()} == set(load(folder).figures)


def test_the_tables_of_a_run_are_not_overwritten(tmp_path: Path) -> None:
    folder = save_flight(tmp_path / "out", 0)
    table = folder / "tables" / "heading_samples.csv"
    before = table.read_bytes()
    for target, names in ((table.parent, ()), (table, ("heading_samples",)), (folder / "arrays", ())):
        with pytest.raises(UsageError, match="run's own"):
            export_figures(folder, target, names, force=True)
    assert table.read_bytes() == before


def test_figures_need_a_flight_folder_and_a_name_that_is_there(tmp_path: Path) -> None:
    folder = save_flight(tmp_path / "out", 0)
    with pytest.raises(UsageError, match="heading_samples"):
        export_figures(folder, tmp_path / "a.csv", ["headings"])
    with pytest.raises(UsageError, match="flight folder"):
        export_figures(SAMPLES / "taxi-good.csv", tmp_path / "a.csv", ["heading_samples"])
    with pytest.raises(UsageError, match="suffix"):
        export_figures(folder, tmp_path / "a.kml", ["heading_samples"])
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(UsageError, match="overwrites"):
        export_figures(folder, tmp_path / "a.csv", ["heading_samples"])
