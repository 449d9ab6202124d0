"""UTIAS multi-robot files: the reader, the session made of a set, and the study on recorded sets."""

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError, UnreadableLogError, UsageError
from groundstation.readers import registry
from groundstation.readers.source import Source
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import Odometry
from tests.readers.logged_facts import RAD
from tests.readers.logs_of_every_format import RNG_SEED
from tests.readers.test_contract import check
from tests.readers.test_flat_csv import Read
from tests.readers.test_values_as_logged import assert_file_agrees
from tests.real_logs import real_log

pytest.importorskip("recorded_robots", reason="the plug-in is not installed: make robots")
from recorded_robots import utias
from recorded_robots.sets import recorded_sets
from recorded_robots.study import SETTINGS, study_recorded

HEAD = (
    "# UTIAS Multi-Robot Cooperative Localization and Mapping Dataset\n# produced by a test\n"
    "# {kind} Data Fomat:\n# {columns}\n"
)
ZERO_S, DURATION_S = 1_248_444_000.0, 60.0
MARKS = {6: (3.0, 0.5), 7: (-2.0, 2.5), 8: (0.5, -3.5)}
BARCODES = {1: 5, 2: 14, 6: 72, 7: 27, 8: 54}
EXACT_M = 0.002  # ranges are written to a millimetre, odometry to 1e-6


def pose(robot: int, time_s: np.ndarray) -> np.ndarray:
    """x, y and angle (left positive) on a circle, shape (n, 3)."""
    angle = 0.1 * robot + 0.2 * time_s
    radius = 0.15 / 0.2
    return np.column_stack(
        [robot + radius * (np.sin(angle) - np.sin(0.1 * robot)), -radius * (np.cos(angle) - 1.0), angle]
    )


def write_set(folder: Path, change: Callable[[str, str], str] = lambda _name, text: text) -> Path:
    """A set of two robots that drive circles and see everything ahead; ``change`` may spoil a file's text."""
    folder.mkdir(exist_ok=True)
    files = {
        "Barcodes": ("Barcode", "Subject #    Barcode #", [f"{s} \t {b}" for s, b in BARCODES.items()]),
        "Landmark_Groundtruth": (
            "Landmark Groundtruth",
            "Subject #    x [m]    y [m]",
            [f"{s} \t {x:.6f} \t {y:.6f} \t 0.0001 \t 0.0001" for s, (x, y) in MARKS.items()],
        ),
    }
    fast, slow = np.arange(0.0, DURATION_S, 0.02), np.arange(1.0, DURATION_S - 1.0, 0.5)
    for robot in (1, 2):
        truth = [
            f"{ZERO_S + t:.3f} \t {x:.8f} \t {y:.8f} \t {a:.8f}"
            for t, (x, y, a) in zip(fast, pose(robot, fast), strict=True)
        ]
        wheels = [f"{ZERO_S + t:.3f} \t 0.150000 \t 0.200000" for t in fast]
        files[f"Robot{robot}_Groundtruth"] = ("Robot Groundtruth", "Time [s]    x [m]", truth)
        files[f"Robot{robot}_Odometry"] = ("Odometry", "Time [s]    forward velocity [m/s]", wheels)
        files[f"Robot{robot}_Measurement"] = ("Measurement", "Time [s]    Subject #", sightings(robot, slow))
    for name, (kind, columns, rows) in files.items():
        text = change(name, HEAD.format(kind=kind, columns=columns) + "\n".join(rows) + "\n")
        if text:
            (folder / f"{name}.dat").write_text(text)
    return folder


def sightings(robot: int, time_s: np.ndarray) -> list[str]:
    """What a camera with 60 deg to either side writes: distance along its axis, angle to the left."""
    rows = []
    for t, (x, y, angle) in zip(time_s, pose(robot, time_s), strict=True):
        places = dict(MARKS) | {3 - robot: tuple(pose(3 - robot, np.array([t]))[0, :2])}
        for subject, (to_x, to_y) in places.items():
            bearing = (np.arctan2(to_y - y, to_x - x) - angle + np.pi) % (2.0 * np.pi) - np.pi
            if abs(bearing) < np.deg2rad(60.0):
                along = np.hypot(to_x - x, to_y - y) * np.cos(bearing)
                rows.append(f"{ZERO_S + t:.3f} \t {BARCODES[subject]} \t {along:.4f} \t {bearing:.6f}")
    return rows


def test_units_signs_and_names(tmp_path: Path) -> None:
    folder = write_set(tmp_path / "set")
    for path in sorted(folder.glob("Robot*")):
        check(list(registry.read(path)))
    wheels = Read(folder / "Robot1_Odometry.dat")
    assert wheels.header.metadata["aircraft"] == "R1" and wheels.header.utc_of_zero_ns == 0
    assert wheels.values("odometry", "speed_mps")[0] == 0.15
    assert wheels.values("odometry", "turn_rate_dps")[0] == pytest.approx(-np.rad2deg(0.2))  # to the left
    assert wheels.times("odometry")[1] == 1_248_444_000_020_000_000
    truth = Read(folder / "Robot2_Groundtruth.dat")
    assert truth.values("truth", "position_east_m")[500] == pytest.approx(-pose(2, np.array([10.0]))[0, 1], abs=1e-7)
    assert truth.values("truth", "true_heading_deg")[500] == pytest.approx(360.0 - np.rad2deg(2.2), abs=1e-5)
    camera = Read(folder / "Robot1_Measurement.dat")
    assert set(camera.topics) <= {f"link.{barcode}" for barcode in BARCODES.values()} and "link.14" in camera.topics
    rows = [row.split() for row in sightings(1, np.arange(1.0, 59.0, 0.5)) if row.split()[1] == "72"]
    assert camera.values("link.72", "pseudorange_m") == [float(row[2]) for row in rows]
    assert camera.values("link.72", "relative_bearing_deg") == pytest.approx(
        [-np.rad2deg(float(row[3])) for row in rows]
    )


def test_values_of_wheels(tmp_path: Path) -> None:
    """UTIAS: speed forward, and rate of turn in rad/s to the left."""
    rng, path = np.random.default_rng(RNG_SEED), tmp_path / "Robot1_Odometry.dat"
    rows = (f"{1_248_444_000 + at / 50:.3f} \t {rng.uniform():.3f} \t {rng.uniform():.3f}" for at in range(30))
    path.write_text("\n".join((HEAD.format(kind="Odometry", columns="Time [s]    v    w"), *rows, "")))
    columns = {"odometry.speed_mps": (1, 1.0), "odometry.turn_rate_dps": (2, -RAD)}
    assert assert_file_agrees(path, columns, " ") == 2


def test_compressed_and_under_another_name(tmp_path: Path) -> None:
    folder = write_set(tmp_path / "set")
    text = (folder / "Robot1_Odometry.dat").read_bytes()
    other = tmp_path / "wheels.txt.gz"
    other.write_bytes(gzip.compress(text))
    read = Read(other)
    assert read.times("odometry") == Read(folder / "Robot1_Odometry.dat").times("odometry")
    assert "aircraft" not in read.header.metadata and "no_robot" in read.remarks


def test_tables_of_a_set_are_no_logs(tmp_path: Path) -> None:
    folder = write_set(tmp_path / "set")
    with pytest.raises(UnreadableLogError, match="table 'Barcode Data' of a UTIAS set, no log"):
        registry.identify(folder / "Barcodes.dat")
    assert utias.barcodes(Source(folder / "Barcodes.dat")) == ({b: s for s, b in BARCODES.items()}, ())
    marks, _ = utias.landmarks(Source(folder / "Landmark_Groundtruth.dat"))
    assert marks[0] == (6, 3.0, -0.5)
    with pytest.raises(UnreadableLogError, match="other text"):
        utias.landmarks(Source(folder / "Barcodes.dat"))


def test_damaged_files_are_counted(tmp_path: Path) -> None:
    def spoil(name: str, text: str) -> str:
        lines = text.splitlines()
        if name == "Robot1_Measurement":
            lines[10] = lines[10].replace(lines[10].split()[1], "7x2", 1)
            lines[11] = "1248444010.0 \t 72.5 \t 3.0 \t 0.1"
            lines[12] = lines[12][:14]
        if name == "Barcodes":
            lines[5] = "x \t 14"
        return "\n".join([*lines, ""])

    folder = write_set(tmp_path / "set", spoil)
    read = Read(folder / "Robot1_Measurement.dat")
    check(list(registry.read(folder / "Robot1_Measurement.dat")))
    assert sum(damage.count for damage in read.damages if "barcode" in damage.what) == 2
    assert any(damage.kind == "dropped_rows" and damage.count == 1 for damage in read.damages), read.damages
    (found,) = recorded_sets(folder)
    texts = [finding.text for finding in found.findings]
    assert any("1 rows that are none of Barcode Data" in text for text in texts)
    assert any("sightings of a barcode that is no landmark" in text for text in texts), texts


def test_a_set_becomes_a_session(tmp_path: Path) -> None:
    """Without noise every algorithm stays with the truth: signs, barcodes, frames and times are right."""
    (found,) = recorded_sets(write_set(tmp_path / "set"))
    (session,) = found.sessions
    assert session.names == ("R1", "R2") and not found.findings
    assert all(isinstance(track, Odometry) for track in session.vehicles)
    distance = np.hypot(*(np.array(session.points[0].position_m[:2]) - (1.0, -0.0)))
    first = session.ranges
    assert first.is_two_way and (np.diff(first.time_s) >= 0.0).all() and distance > 0.0
    result = study_recorded([found], algorithms=("dead_reckoning", "centralised", "split_intersection", "pairwise"))
    (table,) = result.tables
    assert (table["rms_m"] < 10.0 * EXACT_M).all(), table.to_frame()
    assert not table["diverges"].any()


def test_a_gap_of_the_odometry_is_told_and_widens_the_sigma(tmp_path: Path) -> None:
    """Ten seconds without a reading: the motion itself may be wrong, all the gap long, and the filters know it."""

    def change(name: str, text: str) -> str:
        if name != "Robot1_Odometry":
            return text
        lines = text.splitlines()
        kept = [one for one in lines if one.startswith("#") or not 20.0 < float(one.split()[0]) - ZERO_S < 30.0]
        return "\n".join(kept) + "\n"

    (found,) = recorded_sets(write_set(tmp_path / "set", change))
    (told,) = found.findings
    assert told.code == "session.odometry_gap" and "10.0 s at a time" in told.text
    gapped, whole = found.sessions[0].vehicles
    assert isinstance(gapped, Odometry) and isinstance(whole, Odometry) and not whole.gap_s.any()
    assert np.count_nonzero(gapped.gap_s) == pytest.approx(50, abs=1)
    noise = [WheeledVehicle(one, SETTINGS["utias"]).step(np.zeros(10), 20.0, 30.0)[2] for one in (gapped, whole)]
    added = np.diag(noise[0] - noise[1])
    assert np.sqrt(added[2]) == pytest.approx(0.2 * 10.0, rel=0.05), "radians: the whole turn of the gap"
    assert np.sqrt(0.5 * (added[0] + added[1])) >= 0.15 * 10.0


def test_robots_that_lack_a_file_are_left_out(tmp_path: Path) -> None:
    folder = write_set(tmp_path / "set", lambda name, text: "" if name == "Robot2_Odometry" else text)
    (found,) = recorded_sets(folder)
    assert found.sessions[0].names == ("R1",)
    assert any(finding.text == "R2 is left out: no odometry" for finding in found.findings)
    assert any("sightings of a barcode that is no landmark and no other robot" in one.text for one in found.findings)


def test_sets_that_cannot_be_run_say_so_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no folder"):
        recorded_sets(tmp_path / "nothing")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match="no set of recorded robots"):
        recorded_sets(tmp_path / "empty")
    with pytest.raises(UsageError, match=r"0 files named landmark_groundtruth\*, expected one"):
        recorded_sets(write_set(tmp_path / "a", lambda name, text: "" if name.startswith("Landmark") else text))
    with pytest.raises(GroundstationError, match="no robot to run"):
        recorded_sets(
            write_set(
                tmp_path / "b",
                lambda name, text: "" if "_" in name and "Mark" not in name and name.startswith("Robot") else text,
            )
        )


@pytest.mark.real_log
def test_a_minute_of_a_recorded_set(tmp_path: Path) -> None:
    """Set 6, its first minute: no algorithm is calibrated, and ranging beats dead reckoning."""
    folder, last_s = real_log("cooperative/utias_mrclam6"), 1_248_444_250.0
    for path in folder.glob("*.dat.gz"):
        lines = gzip.decompress(path.read_bytes()).decode().splitlines()
        kept = [line for line in lines if not line.startswith("12484") or float(line.split()[0]) < last_s]
        (tmp_path / path.stem).write_text("\n".join([*kept, ""]))
    (found,) = recorded_sets(tmp_path)
    assert found.sessions[0].names == ("R1", "R2", "R3", "R4", "R5") and len(found.sessions[0].points) == 15
    names = ("dead_reckoning", "centralised", "split_intersection", "smoothed")
    (table,) = study_recorded([found], algorithms=names).tables
    rms = dict(zip(zip(table["case"].tolist(), table["algorithm"].tolist(), strict=True), table["rms_m"], strict=True))
    nees = table["nees"][table["algorithm"] == "centralised"]
    for case in found.cases():
        assert rms[case, "smoothed"] < rms[case, "centralised"] < 0.1 < rms[case, "dead_reckoning"]
        assert rms[case, "split_intersection"] < rms[case, "dead_reckoning"]
    assert (nees < 3.0).all() and SETTINGS["utias"].camera.lag_s > 0.0


@pytest.mark.slow
@pytest.mark.real_log
def test_the_smoother_on_set_6() -> None:
    """Over the time that all truths have in common; no parameter of a single robot was found with the truth."""
    sets = recorded_sets(real_log("cooperative/utias_mrclam6"))
    (table,) = study_recorded(sets, algorithms=("smoothed",)).tables
    for case, limit_m in (("full map", 0.042), ("R3, R4, R5 blind", 0.055)):
        (row,) = np.flatnonzero(table["case"] == case)
        assert table["common_m"][row] < limit_m and 1.0 < table["common_nees"][row] < 2.5
