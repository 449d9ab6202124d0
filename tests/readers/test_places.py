"""Latitude and longitude 0 are no position: in no table a place, counted, and kept raw."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from groundstation.base.geodesy import NO_POSITION, NO_POSITION_DEG
from groundstation.base.units import DEG_PER_RAD
from groundstation.readers import rows
from tests.readers.garmin_writer import G3X, G1000, G1000_TOP, Flight, log
from tests.readers.test_flat_csv import Read
from tests.readers.test_trajectories import Read as ReadTrajectory
from tests.readers.trajectory_writer import ECEF, ECEF_VELOCITY, GEODETIC, MINUTES, pos, sbet
from tests.real_logs import real_log

COLUMNS = "latitude_deg,{0}.longitude_deg,{0}.altitude_msl_m,{0}.velocity_north_mps,{0}.velocity_east_mps"
PROFILE = """
name = "p"
[time]
kind = "seconds"
column = "t"
[columns]
"la" = {{ field = "gnss.latitude_deg", unit = "{unit}" }}
"lo" = {{ field = "gnss.longitude_deg", unit = "{unit}" }}
"""


def flat(tmp_path: Path, topic: str, places: list[tuple[str, str]], motion: str = "1,2") -> Read:
    path = tmp_path / "log.csv"
    lines = [f"time_s,{topic}.{COLUMNS.format(topic)}"]
    lines += [f"{at},{lat},{lon},100,{motion}" for at, (lat, lon) in enumerate(places)]
    path.write_text("\n".join([*lines, ""]))
    return Read(path)


@pytest.mark.parametrize("topic", ["gnss", "gnss.2", "ins", "ins.1"])
def test_zeros_are_no_place_in_the_flat_csv(tmp_path: Path, topic: str) -> None:
    found = flat(tmp_path, topic, [("0", "0"), ("-0.00000000", "3e-8"), ("0", "38"), ("52", "0"), ("52.1", "38")])
    assert found.values(topic, "latitude_deg") == [None, None, 0.0, 52.0, 52.1]
    assert found.values(topic, "longitude_deg") == [None, None, 38.0, 0.0, 38.0]
    assert found.values(topic, "altitude_msl_m") == [None, None, 100.0, 100.0, 100.0]
    assert found.values(topic, "velocity_north_mps") == [1.0] * 5
    damage = found.damage("no_position")
    assert (damage.count, damage.place, damage.topic, damage.what) == (2, "rows 2 to 3", topic, NO_POSITION)
    assert not damage.loses_data
    assert found.values(f"raw.{topic}", "latitude_deg") == [0.0, -0.0, 0.0, 52.0, 52.1]
    assert found.values(f"raw.{topic}", "longitude_deg")[1] == 3e-8


def test_a_receiver_without_a_place_stands_still_by_no_measurement(tmp_path: Path) -> None:
    found = flat(tmp_path, "gnss", [("0", "0"), ("52", "38")], motion="0,0")
    assert found.values("gnss", "velocity_north_mps") == [0.0] and found.rows("gnss") == [3]
    assert found.values("raw.gnss", "velocity_north_mps") == [0.0, 0.0]
    inertial = flat(tmp_path, "ins", [("0", "0"), ("52", "38")], motion="0,0")
    assert inertial.values("ins", "velocity_north_mps") == [0.0, 0.0]  # an INS at rest has one


def test_a_log_with_places_throughout_has_no_raw_copy(tmp_path: Path) -> None:
    found = flat(tmp_path, "gnss", [("0", "1e-7"), ("-1e-7", "0"), ("nan", "0")])
    assert found.topics == ["gnss"] and not found.damages
    assert np.isnan(found.values("gnss", "latitude_deg")[2])  # the device wrote it


def test_truth_of_a_simulator_may_be_there(tmp_path: Path) -> None:
    found = flat(tmp_path, "truth", [("0", "0"), ("0", "0")])
    assert found.values("truth", "latitude_deg") == [0.0, 0.0] and not found.damages


@pytest.mark.parametrize(("unit", "scale"), [("deg", 1.0), ("rad", DEG_PER_RAD), ("deg1e7", 1e-7)])
def test_zeros_in_any_unit_of_a_profile(tmp_path: Path, unit: str, scale: float) -> None:
    settings_path, path = tmp_path / "p.toml", tmp_path / "log.txt"
    settings_path.write_text(PROFILE.format(unit=unit))
    path.write_text(f"t,la,lo\n0,0,0\n1,{52 / scale:.17g},{38 / scale:.17g}\n")
    found = Read(path, settings_path)
    assert found.values("gnss", "latitude_deg") == [pytest.approx(52.0)] and found.rows("gnss") == [3]
    assert found.values("raw.p", "la")[0] == 0.0 and found.damage("no_position").count == 1


@pytest.mark.parametrize(("names", "top"), [(G1000, G1000_TOP), (G3X, None)])
def test_zeros_of_garmin(tmp_path: Path, names: dict[str, tuple[str, str]], top: str | None) -> None:
    """A G3X wrote +0.0000000 and velocities of 0 in flight, at 138 kt."""
    text = log(Flight(), names, **({} if top is None else {"top": top}))
    text = text.replace("37.7000000,-122.2000000", "+0.0000000,+0.0000000").replace("50.000,0.000,1.5", "0,0,0.00", 1)
    path = tmp_path / "log.csv"
    path.write_text(text)
    found = Read(path)
    assert found.values("gnss", "latitude_deg")[0] is None and found.values("gnss", "latitude_deg")[1] is not None
    assert found.damage("no_position").count == 1


@pytest.mark.parametrize(
    ("form", "zero"),
    [(GEODETIC, "0.000000000 0.000000000 0.0"), (MINUTES, "0 00 00.00000 0 00 00.00000 0.0"), (ECEF, "0.0 0.0 0.0")],
)
def test_zeros_of_rtklib(tmp_path: Path, form: str, zero: str) -> None:
    text = pos(form, zero).decode()
    if form == ECEF:
        text = text.replace(" vn(m/s) ve(m/s) vu(m/s)", ECEF_VELOCITY)
    found = ReadTrajectory(tmp_path / "a.pos", text.encode())
    assert all(
        "latitude_deg" not in one.columns or not one.columns["latitude_deg"].mask.any() for one in found.batches("gnss")
    )
    assert found.values("gnss", "satellites_used") == [21.0] * 3
    assert [(one.kind, one.count, one.place) for one in found.damages] == [("no_position", 3, "rows 3 to 5")]


@pytest.mark.parametrize("first", [0, 13, 600])
def test_zeros_of_an_sbet(tmp_path: Path, first: int) -> None:
    """Before a first fix, or in the middle: records that are no damage, and no place."""
    records = sbet(count=1000)
    for name in ("latitude", "longitude"):
        records[name][first : first + 300] = 0.0
    found = ReadTrajectory(tmp_path / "sbet_20250828.out", records.tobytes())
    latitude = found.values("ins", "latitude_deg")
    assert latitude.count(None) == 300 and latitude[first] is None and len(latitude) == 1000
    assert found.values("ins", "true_heading_deg")[first] == pytest.approx(65.0)
    assert found.values("raw.sbet", "latitude")[first] == 0.0
    assert [(one.kind, one.place) for one in found.damages] == [("no_position", f"records {first} to {first + 299}")]


angles = st.sampled_from([0.0, -0.0, 9e-8, -9e-8, 1e-7, 1e-6, 0.5, 38.0, -90.0, 179.9])


@given(st.lists(st.tuples(angles, angles), min_size=1, max_size=40))
@example([(0.0, 0.0)] * 3 + [(52.0, 38.0)])
@settings(max_examples=50, deadline=None)
def test_a_place_is_kept_unless_both_are_zero(
    tmp_path_factory: pytest.TempPathFactory, places: list[tuple[float, float]]
) -> None:
    found = flat(tmp_path_factory.mktemp("t"), "gnss", [(repr(lat), repr(lon)) for lat, lon in places])
    is_zero = [abs(lat) < NO_POSITION_DEG and abs(lon) < NO_POSITION_DEG for lat, lon in places]
    told = found.values("gnss", "latitude_deg")
    assert told == [None if zero else lat for zero, (lat, _lon) in zip(is_zero, places, strict=True)]
    assert sum(one.count for one in found.damages) == sum(is_zero)


def test_places_are_the_same_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    places = [("0", "0") if at % 7 == 3 else ("52", "38") for at in range(200)]
    whole = flat(tmp_path, "gnss", places)
    monkeypatch.setattr(rows, "BLOCK_BYTES", 300)
    pieces = flat(tmp_path, "gnss", places)
    for field in ("latitude_deg", "altitude_msl_m"):
        assert pieces.values("gnss", field) == whole.values("gnss", field)
    assert pieces.damages == whole.damages
    assert pieces.rows("raw.gnss")[-1] == 201, "raw from the first such row to the end"


@pytest.mark.real_log
def test_case_f_zero() -> None:
    found = Read(real_log("cases/f_zero_fix_first_60s.csv.gz"))
    latitude = found.values("gnss", "latitude_deg")
    assert latitude.count(None) == 60 and min(one for one in latitude if one is not None) > 50.0
    assert (found.damage("no_position").count, found.damage("no_position").place) == (60, "rows 4 to 63")
