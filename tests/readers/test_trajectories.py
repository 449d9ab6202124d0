"""Trajectories computed elsewhere: RTKLIB's .pos in its forms, SBET with its accuracies."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.ecef import ecef_from_n, ecef_m
from groundstation.base.errors import GroundstationError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers import registry
from groundstation.readers.sbet import ACCURACY, RECORD
from tests.readers.test_contract import check
from tests.readers.test_receiver import Read as ReadStream
from tests.readers.trajectory_writer import GEODETIC, HEIGHT, LATITUDE, LONGITUDE, PLACE, pos, sbet
from tests.real_logs import real_log

DEGREES = 1e-9
FIRST_NS = iso_to_utc_ns("2025-08-28T17:30:21.749Z")[0]


class Read(ReadStream):
    """What a file of this name was read as."""

    def __init__(self, path: Path, content: bytes) -> None:
        path.write_bytes(content)
        self.items = list(registry.read(path))
        check(self.items)


def test_geodetic_form_in_gps_time(tmp_path: Path) -> None:
    read = Read(tmp_path / "a.pos", pos(GEODETIC, PLACE, top="\n% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix)"))
    row = {name: read.values("gnss", name)[0] for name in read.batches("gnss")[0].columns}
    assert (
        row["latitude_deg"] == LATITUDE and row["longitude_deg"] == LONGITUDE and row["altitude_ellipsoid_m"] == HEIGHT
    )
    assert (row["velocity_north_mps"], row["velocity_east_mps"], row["velocity_down_mps"]) == (1.5, -2.5, -0.25)
    assert row["horizontal_sigma_m"] == pytest.approx(0.05) and row["velocity_sigma_mps"] == pytest.approx(0.05)
    assert row["fix"] == "rtk_fixed" and row["satellites_used"] == 21.0 and row["vertical_sigma_m"] == 0.08
    assert read.times("gnss")[0] == "2025-08-28T17:30:21.749000000Z" and not read.remark("assumed")
    assert read.header.metadata["rtklib.program"] == "RTKLIB ver.2.4.3"
    assert read.values("raw.pos", "ratio") == [999.9] * 3


@pytest.mark.parametrize(
    ("scale", "time"),
    [("UTC", "2025/08/28 17:30:21.749"), ("JST", "2025/08/29 02:30:21.749"), ("GPST", "2381 408639.749")],
)
def test_scales_of_time(tmp_path: Path, scale: str, time: str) -> None:
    read = Read(tmp_path / "a.pos", pos(GEODETIC, PLACE, scale, time))
    assert read.times("gnss")[0] == "2025-08-28T17:30:21.749000000Z"


def test_degrees_minutes_and_seconds(tmp_path: Path) -> None:
    read = Read(
        tmp_path / "a.pos", pos("latitude(d'\") longitude(d'\") height(m)", "51 30 00.00000  -0 42 00.00000 147.0")
    )
    assert read.values("gnss", "latitude_deg")[0] == LATITUDE
    assert read.values("gnss", "longitude_deg")[0] == pytest.approx(LONGITUDE, abs=DEGREES)


def test_heights_above_the_geoid(tmp_path: Path) -> None:
    read = Read(tmp_path / "a.pos", pos(GEODETIC, PLACE, top="\n% (lat/lon/height=WGS84/geodetic)"))
    assert read.values("gnss", "altitude_msl_m")[0] == HEIGHT and not read.values("gnss", "altitude_ellipsoid_m")[0]
    assert "does not say above what" in Read(tmp_path / "b.pos", pos(GEODETIC, PLACE)).remark("assumed")


def test_ecef_form(tmp_path: Path) -> None:
    place = "  ".join(f"{part:.4f}" for part in ecef_m(LATITUDE, LONGITUDE, HEIGHT))
    content = pos("x-ecef(m) y-ecef(m) z-ecef(m)", place).replace(
        b" vn(m/s) ve(m/s) vu(m/s)", b" vx(m/s) vy(m/s) vz(m/s)"
    )
    velocity = ecef_from_n(LATITUDE, LONGITUDE) @ np.array([1.5, -2.5, -0.25])
    content = content.replace(b"1.50000 -2.50000 0.25000", " ".join(f"{part:.9f}" for part in velocity).encode())
    read = Read(tmp_path / "a.pos", content)
    assert read.values("gnss", "latitude_deg")[0] == pytest.approx(LATITUDE, abs=DEGREES)
    assert read.values("gnss", "altitude_ellipsoid_m")[0] == pytest.approx(HEIGHT, abs=1e-4)
    found = [read.values("gnss", f"velocity_{axis}_mps")[0] for axis in ("north", "east", "down")]
    assert found == pytest.approx([1.5, -2.5, -0.25], abs=1e-8)


def test_a_baseline_needs_the_place_of_its_base(tmp_path: Path) -> None:
    form, cells = "e-baseline(m) n-baseline(m) u-baseline(m)", "30.0000 40.0000 -5.0000"
    top = f"\n% ref pos   : {LATITUDE:.9f} {LONGITUDE:.9f} {HEIGHT:.4f}"
    read = Read(tmp_path / "a.pos", pos(form, cells, top=top))
    expected = ecef_m(LATITUDE, LONGITUDE, HEIGHT) + ecef_from_n(LATITUDE, LONGITUDE) @ np.array([40.0, 30.0, 5.0])
    names = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m")
    found = ecef_m(*(read.values("gnss", name)[0] for name in names))  # type: ignore[arg-type]
    assert np.abs(found - expected).max() < 1e-6
    alone = Read(tmp_path / "b.pos", pos(form, cells))
    assert alone.values("gnss", "latitude_deg") == [None] * 3 and "no position" in alone.remark("no_position")


def test_commas_and_lines_that_are_cut(tmp_path: Path) -> None:
    content = pos(GEODETIC, PLACE).decode().splitlines()
    commas = "\n".join([*content[:2], *(", ".join(line.split()).replace(", ", " ", 1) for line in content[2:])])
    read = Read(tmp_path / "a.pos", commas.encode()[:-90])
    assert len(read.times("gnss")) == 2 and [one.kind for one in read.damages] == ["truncated"]


@pytest.mark.parametrize("damage", [(b"longitude(deg)", b"lon"), (b"height(m)", b"latitude"), (b" sdu(m)", b" sdn(m)")])
def test_a_damaged_name_costs_its_column(tmp_path: Path, damage: tuple[bytes, bytes]) -> None:
    read = Read(tmp_path / "a.pos", pos(GEODETIC, PLACE).replace(*damage, 1))
    assert read.values("gnss", "latitude_deg") == [LATITUDE] * 3


@pytest.mark.real_log
def test_recorded_solutions() -> None:
    """The walk's solution was made of its receiver's own fixes: positions and velocities are equal."""
    solution = ReadStream.__new__(ReadStream)
    solution.items = list(registry.read(real_log("gnss/walk_0827_gnss_1730_sf.pos")))
    walk = ReadStream.__new__(ReadStream)
    walk.items = list(registry.read(real_log("gnss/walk_0827_gnss_1730.ubx")))
    fixes = solution.values("gnss", "fix")
    assert fixes.count("rtk_fixed") == 349 and fixes.count("rtk_float") == 187 and fixes == walk.values("gnss", "fix")
    for name in ("latitude_deg", "velocity_east_mps", "velocity_sigma_mps"):
        np.testing.assert_allclose(solution.values("gnss", name), walk.values("gnss", name), atol=2e-7)  # type: ignore[arg-type]
    drive = list(registry.read(real_log("gnss/drive_0708_gnss_1934_sf.pos")))
    check(drive)


# --- SBET


@pytest.mark.parametrize("wander_sign", [-1, 1])
def test_sbet_turns_the_platform_back(tmp_path: Path, wander_sign: int) -> None:
    read = Read(tmp_path / "sbet_20250828.out", sbet(wander_sign=wander_sign).tobytes())
    assert read.values("ins", "true_heading_deg")[0] == pytest.approx(65.0)
    assert read.values("ins", "velocity_north_mps")[0] == pytest.approx(25.0)
    assert read.values("ins", "velocity_east_mps")[0] == pytest.approx(50.0 * np.sin(np.deg2rad(60.0)))
    assert read.values("ins", "roll_deg")[0] == pytest.approx(2.0) and read.values("ins", "rate_y_dps")[0] == 0.5
    assert read.values("ins", "accel_z_mps2")[0] == -9.81 and read.values("ins", "mode")[0] == "gnss_aided"
    assert read.times("ins")[0] == "2025-08-28T17:30:03.000000000Z"


def test_sbet_without_a_date_in_its_name_has_none(tmp_path: Path) -> None:
    read = Read(tmp_path / "sbet_Mission 1.out", sbet(gravity=False).tobytes())
    assert read.header.utc_of_zero_ns is None and "does not name" in read.remark("week_unknown")
    assert read.batches("ins")[0].device_time_ns.values[0] == 408_621 * NS_PER_S
    assert "accel_z_mps2" not in read.batches("ins")[0].columns


def test_sbet_with_the_file_of_its_accuracies(tmp_path: Path) -> None:
    accuracies = np.zeros(3, ACCURACY)
    accuracies["time"] = 408_620.0 + np.arange(3)
    accuracies["north_m"], accuracies["east_m"], accuracies["down_m"] = 0.03, 0.04, 0.08
    accuracies["heading_arcmin"] = (1.2, 1.2, 2.4)
    (tmp_path / "smrmsg_20250828.out").write_bytes(accuracies.tobytes())
    read = Read(tmp_path / "sbet_20250828.out", sbet().tobytes())
    assert read.values("ins", "horizontal_sigma_m")[0] == pytest.approx(0.05)
    assert read.values("ins", "true_heading_sigma_deg")[0] == pytest.approx(0.02)
    assert read.values("ins", "true_heading_sigma_deg")[20] == pytest.approx(0.022), "between two of them"


def test_sbet_cut_and_over_the_end_of_the_week(tmp_path: Path) -> None:
    records = sbet()
    records["time"] = (604_799.9 + np.arange(len(records)) / 200.0) % 604_800.0
    read = Read(tmp_path / "sbet_20250830.out", records.tobytes()[:-50])
    assert [(one.kind, one.count) for one in read.damages] == [("truncated", 86)]
    times = read.batches("ins")[0].device_time_ns.values
    assert (np.diff(times) == 5_000_000).all() and read.times("ins")[0] == "2025-08-30T23:59:41.900000000Z"


@pytest.mark.parametrize(("inserted", "lost"), [(0, 1), (7, 0), (13, 0)])
def test_sbet_behind_damage_is_found_again(tmp_path: Path, inserted: int, lost: int) -> None:
    content = bytearray(sbet().tobytes())
    at = 30 * RECORD.itemsize
    content[at + 8 : at + 16] = b"\xff" * 8 if not inserted else content[at + 8 : at + 16]
    content[at:at] = b"\x55" * inserted
    read = Read(tmp_path / "sbet_20250828.out", bytes(content))
    assert len(read.times("ins")) == 60 - lost and [one.kind for one in read.damages] == ["corrupt"]
    assert sum(one.count for one in read.damages) == inserted + lost * RECORD.itemsize


def test_other_doubles_are_no_sbet(tmp_path: Path) -> None:
    path = tmp_path / "sbet_20250828.out"
    path.write_bytes(np.random.default_rng(1).normal(size=1700).tobytes())
    with pytest.raises(GroundstationError):
        registry.identify(path)
