"""Trajectory in the files of other programs: read back by our reader, and as a second program lays out the format."""

import struct
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.exports.kml import write_kml
from groundstation.exports.table import frame_of
from groundstation.exports.tracks import ELLIPSOID, MSL, Track, tracks_of
from groundstation.pipeline.verbs.export import WRITERS_OF_ONE
from groundstation.results.arrays.states import BodyStates
from groundstation.systems.trajectory.figures import states_of
from groundstation.tables.table import Flight, Table
from tests.systems.trajectory.made import track
from tests.systems.trajectory.made_answers import accepted, doubtful, results_of

START_NS = 1_777_874_400_000_000_000  # 2026-05-04T06:00Z
GEOID_M = 14.5
KML = "{http://www.opengis.net/kml/2.2}"
STATES = states_of(track(60.0), "ellipsoid")


def flight(has_utc: bool = True) -> Flight:
    """A flight whose receiver gives both heights."""
    time_ns = START_NS + np.arange(61) * 1_000_000_000
    heights = {ELLIPSOID: np.full(61, 150.0), MSL: np.full(61, 150.0 - GEOID_M)}
    place = {"latitude_deg": np.full(61, 55.0), "longitude_deg": np.full(61, 37.0)}
    columns = {name: Column(values) for name, values in {**place, **heights}.items()}
    gnss = Table("gnss", time_ns, columns, np.arange(61), Column(time_ns))
    return Flight({"gnss": gnss}, {}, START_NS, has_utc, "a.csv")


def best(states: BodyStates = STATES, has_utc: bool = True, make: object = accepted) -> Track:
    """The track of the trajectory of a flight."""
    answer = accepted(track(60.0)) if make is accepted else doubtful()
    results = replace(results_of(answer), figures=(states,))
    return next(one for one in tracks_of(flight(has_utc), results) if one.name == "trajectory")


def test_every_state_is_in_the_track_with_both_heights() -> None:
    found = best()
    assert len(found) == 1200 and found.is_best
    assert np.allclose(found.column(MSL), found.column(ELLIPSOID) - GEOID_M)
    above_sea = best(states_of(track(60.0), "msl"))
    assert np.allclose(above_sea.column(ELLIPSOID), above_sea.column(MSL) + GEOID_M)
    assert not best(make=doubtful).is_best
    assert "doubtful: innovations of GNSS velocity" in best(make=doubtful).title


def test_sbet_and_its_accuracies_are_read_back(tmp_path: Path) -> None:
    assert WRITERS_OF_ONE[".out"](tmp_path / "sbet_20260504.out", best()) == 0
    read = groundstation.open(tmp_path / "sbet_20260504.out").flight["ins"]
    assert np.abs(read.time_ns - START_NS - np.rint(STATES.time_s * 1e9)).max() < 1000
    for name in ("velocity_down_mps", "roll_deg", "pitch_deg", "true_heading_deg", "altitude_ellipsoid_m"):
        assert np.allclose(read.values(name), getattr(STATES, name), atol=1e-6), name
    for name in ("vertical_sigma_m", "roll_sigma_deg", "pitch_sigma_deg", "true_heading_sigma_deg"):
        assert np.allclose(read.values(name), getattr(STATES, name), rtol=1e-9), name
    horizontal = np.hypot(STATES.position_north_sigma_m, STATES.position_east_sigma_m)
    assert np.allclose(read.values("horizontal_sigma_m"), horizontal)


def test_accuracies_are_ten_doubles_with_angles_in_minutes_of_arc(tmp_path: Path) -> None:
    WRITERS_OF_ONE[".out"](tmp_path / "sbet_20260504.out", best())
    content = (tmp_path / "smrmsg_20260504.out").read_bytes()
    assert len(content) == 80 * len(STATES)
    first = struct.unpack("<10d", content[:80])
    of_week = 86_400 + 6 * 3600 + 18  # Monday, 06:00 UTC, 18 leap seconds
    assert first == pytest.approx((of_week, 0.2, 0.25, 0.4, 0.02, 0.02, 0.03, 3.0, 3.0, 9.0))
    bare = replace(best(), columns={name: one for name, one in best().columns.items() if "sigma" not in name})
    WRITERS_OF_ONE[".out"](tmp_path / "sbet_20260504.out", bare)
    assert not (tmp_path / "smrmsg_20260504.out").exists(), "an SBET that replaces another has not its accuracies"
    WRITERS_OF_ONE[".sbet"](tmp_path / "flight.sbet", best())
    assert [one.name for one in tmp_path.iterdir() if "smrmsg" in one.name] == [], "no name for them"


def test_without_utc_an_sbet_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotAssessableError, match="no UTC"):
        WRITERS_OF_ONE[".out"](tmp_path / "sbet_1.out", best(has_utc=False))
    assert not list(tmp_path.iterdir())


def test_earth_and_table_have_the_trajectory_beside_the_receiver(tmp_path: Path) -> None:
    results = replace(results_of(accepted(track(60.0))), figures=(STATES,))
    tracks = tracks_of(flight(), results)
    assert [one.name for one in tracks] == ["gnss", "trajectory"]
    write_kml(tmp_path / "a.kml", "a", tracks)
    root = ET.parse(tmp_path / "a.kml").getroot()
    assert [one.findtext(f"{KML}name") for one in root.iter(f"{KML}Placemark")] == ["gnss", "trajectory"]
    frame = frame_of(tracks)
    own = frame[frame["track"] == "trajectory"]
    assert np.allclose(own["true_heading_sigma_deg"], STATES.true_heading_sigma_deg)
    assert frame[frame["track"] == "gnss"]["true_heading_sigma_deg"].isna().all()
