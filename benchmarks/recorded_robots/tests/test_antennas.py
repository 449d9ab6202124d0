"""MILUV and MURP: readers, lever arms, sessions with simulated dead reckoning, the study on them."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError, UnreadableLogError, UsageError
from groundstation.readers import registry
from groundstation.readers.source import Source
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import judge
from groundstation.systems.cooperative.events import prepare
from tests.readers.test_contract import check
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

pytest.importorskip("recorded_robots", reason="the plug-in is not installed: make robots")
from recorded_robots import miluv, sets
from recorded_robots.antennas import Poses
from recorded_robots.reckoning import ReckoningErrors, drifting_reckoning
from recorded_robots.sets import recorded_sets
from recorded_robots.study import SETTINGS, study_recorded

TAGS = {"ifo001": {10: (0.2, -0.1, 0.05), 11: (-0.2, 0.1, 0.05)}, "ifo002": {20: (0.1, 0.2, 0.0)}}
ANCHORS = {0: (3.0, 3.0, 1.5), 1: (-3.0, 3.0, 1.7), 2: (0.0, -4.0, 1.2)}
ZERO_S, DURATION_S, STEP_S = 1_706_982_142.0, 20.0, 0.05
EXACT_M = 1e-5  # of ranges from poses interpolated between rows


def pose(name: str, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Place and rotation from body to world in the axes of the data: z up, forward-left-up."""
    sign = 1.0 if name == "ifo001" else -1.0
    yaw, pitch = sign * 0.3 * time_s, 0.2
    place = sign * np.array([np.cos(0.3 * time_s), np.sin(0.3 * time_s), 0.0]) + (0.0, 0.0, 1.0)
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return place, np.array([[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]])


def quaternion(name: str, time_s: float) -> str:
    """As the data write it: x y z w."""
    sign = 1.0 if name == "ifo001" else -1.0
    yaw, pitch = sign * 0.15 * time_s, 0.1
    x, y = -np.sin(yaw) * np.sin(pitch), np.cos(yaw) * np.sin(pitch)
    return f"[{x:.10f} {y:.10f} {np.sin(yaw) * np.cos(pitch):.10f} {np.cos(yaw) * np.cos(pitch):.10f}]"


def place_of(number: int, time_s: float) -> np.ndarray:
    for name, own in TAGS.items():
        if number in own:
            place, turn = pose(name, time_s)
            return place + turn @ np.array(own[number])
    return np.array(ANCHORS[number])


def write_miluv(folder: Path) -> Path:
    folder.mkdir()

    def lists(groups: dict[str, dict[int, tuple[float, float, float]]]) -> str:
        return "".join(
            f"{name}:\n" + "".join(f'  "{number}": "{list(arm)}"\n' for number, arm in own.items())
            for name, own in groups.items()
        )

    (folder / "tags.yaml").write_text(lists(TAGS))
    (folder / "anchors.yaml").write_text("# anchors\n" + lists({'"0"': ANCHORS}))
    names = [f"{start}{name}" for name in TAGS for start in ("r_iw_a_", "q_ai_")]
    rows = [",".join(["range", "from_id", "to_id", *names, "pair", "gt_range", "timestamp"])]
    pairs = [(10, 0), (20, 10), (11, 1), (20, 2), (11, 20), (20, 0), (10, 2)]
    for number, time_s in enumerate(np.arange(0.0, DURATION_S, STEP_S)):
        one, two = pairs[number % len(pairs)]
        distance = np.linalg.norm(place_of(one, time_s) - place_of(two, time_s))
        poses = []
        for name in TAGS:
            x, y, z = pose(name, time_s)[0]
            poses += [f"[{x:.10f} {y:.10f} {z:.10f}]", quaternion(name, time_s)]
        rows.append(f'{distance:.9f},{one},{two},{",".join(poses)},"({one}, {two})",9.9,{ZERO_S + time_s:.6f}')
    (folder / "range_data.csv").write_text("\n".join([*rows, ""]))
    return folder


def test_ranges_fit_the_poses_with_their_lever_arms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rotations, signs and owners: with the true attitude the recorded range is that of the antennas."""
    folder = write_miluv(tmp_path / "set")
    check(list(registry.read(folder / "range_data.csv")))
    monkeypatch.setitem(sets.DRAWS, "miluv", 1)
    exact = ReckoningErrors(0.0, 0.0, 30.0, 0.0, 100.0, 0.0)
    monkeypatch.setattr(sets, "drifting_reckoning", lambda poses, rng: drifting_reckoning(poses, rng, exact))
    (found,) = recorded_sets(folder)
    (session,) = found.sessions
    assert session.names == ("ifo001", "ifo002") and [point.name for point in session.points] == ["N0", "N1", "N2"]
    ranges, points = session.ranges, {point.name: np.array(point.position_m) for point in session.points}
    assert len(ranges) == DURATION_S / STEP_S and ranges.is_two_way and ranges.arm_m is not None
    for row in range(0, len(ranges), 7):
        ends = []
        for name in (str(ranges.receiver[row]), str(ranges.source[row])):
            at, position = found.truth.get(name, (None, None))
            ends.append(
                points[name] if at is None else [np.interp(ranges.time_s[row], at, axis) for axis in position.T]
            )
        distance = np.linalg.norm(np.subtract(*ends) + ranges.arm_m[row])
        assert ranges.pseudorange_m[row] == pytest.approx(distance, abs=EXACT_M)
    settings = SETTINGS["miluv"]
    run = run_algorithm(prepare(session, settings), settings, "centralised")
    assert not run.counts.get("gated")
    for track, vehicle in zip(run.tracks, session.vehicles, strict=True):
        assert judge(track, vehicle, *found.truth[track.name]).rms_m < 0.01


def test_attitude_of_miluv(tmp_path: Path) -> None:
    read = Read(write_miluv(tmp_path / "set") / "range_data.csv")
    assert read.header.metadata["vehicles"] == "ifo001, ifo002" and "no_truth_range" in read.remarks
    at = 100  # 5 s
    assert read.values("truth.ifo001", "true_heading_deg")[at] == pytest.approx(360.0 - np.rad2deg(1.5), abs=1e-6)
    assert read.values("truth.ifo001", "pitch_deg")[at] == pytest.approx(-np.rad2deg(0.2), abs=1e-6)  # nose down
    assert read.values("truth.ifo001", "roll_deg")[at] == pytest.approx(0.0, abs=1e-6)
    assert read.values("truth.ifo001", "position_down_m")[at] == -1.0
    assert read.values("raw.miluv", "gt_range")[at] == 9.9


def test_damage_in_miluv(tmp_path: Path) -> None:
    folder = write_miluv(tmp_path / "set")
    path = folder / "range_data.csv"
    lines = path.read_text().splitlines()
    lines[5] = lines[5].replace(",11,", ",1.5,", 1)
    lines[6] = lines[6].replace("[", "[x ", 1)
    lines[9] = lines[9][:40]
    path.write_text("\n".join([*lines, ""]))
    check(list(registry.read(path)))
    whats = {damage.what: damage.count for damage in Read(path).damages}
    assert whats["rows without two tags"] == 1 and whats["poses that cannot be read"] == 1, whats
    with pytest.raises(UnreadableLogError, match="no places of tags or anchors"):
        miluv.arms(Source(path))
    (folder / "anchors.yaml").unlink()
    with pytest.raises(UsageError, match=r"0 files named anchors.yaml\*, expected one"):
        recorded_sets(folder)


def test_simulated_reckoning_drifts_as_stated() -> None:
    time_s = np.arange(0.0, 60.0, 0.1)
    poses = Poses("A", time_s, np.column_stack([time_s, 0.0 * time_s, 0.0 * time_s]), np.zeros((len(time_s), 3)))
    errors = ReckoningErrors(velocity_mps=0.1, velocity_s=20.0)
    ends, starts = [], []
    for seed in range(300):
        track, _ = drifting_reckoning(poses, np.random.default_rng([7, seed]), errors)
        off = track.position_m[:, :2] - np.column_stack([track.time_s, 0.0 * track.time_s])
        starts.append(off[0])
        ends.append(off[-1] - off[0])
    t, tau = float(track.time_s[-1]), 20.0
    expected = 0.1 * np.sqrt(
        2.0 * tau * (t - tau * (1.0 - np.exp(-t / tau)))
    )  # Gelb 1974, 3.8: integral of the process
    assert np.std(ends) == pytest.approx(expected, rel=0.12)  # three sigma of 600 draws
    assert np.std(starts) == pytest.approx(errors.position_m, rel=0.12)


@pytest.mark.real_log
def test_recorded_quadrotors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sets.DRAWS, "miluv", 1)
    (found,) = recorded_sets(real_log("cooperative/miluv_30s"))
    assert len(found.sessions[0].ranges) == 2599 and found.sessions[0].names == ("ifo001", "ifo002", "ifo003")
    (table,) = study_recorded([found], algorithms=("dead_reckoning", "centralised")).tables
    full = table["case"] == "full map"
    dead, both = table["rms_m"][full]
    assert both < 0.15 < 0.3 < dead and table["nees"][full][1] < 4.0


@pytest.mark.real_log
def test_recorded_pairs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first 40 s of a run: places of the agents to one another, which is what ranges between them can tell."""
    for path in real_log("cooperative/murp").glob("16_*.csv"):
        (tmp_path / path.name).write_text("\n".join(path.read_text().splitlines()[:41]) + "\n")
        check(list(registry.read(path)))
    monkeypatch.setitem(sets.DRAWS, "murp", 1)
    (found,) = recorded_sets(tmp_path)
    assert found.name.endswith(" 16") and found.sessions[0].names == ("M1", "M2", "M3")
    (table,) = study_recorded([found], algorithms=("dead_reckoning", "centralised")).tables
    dead, both = table["relative_m"]
    assert both < 0.4 and both < 0.5 * dead, table.to_frame()


def test_a_compressed_set_and_one_without_logs(tmp_path: Path) -> None:
    folder = write_miluv(tmp_path / "set")
    path = folder / "range_data.csv"
    (folder / "range_data.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    assert recorded_sets(folder)[0].kind == "miluv"
    (folder / "range_data.csv.gz").unlink()
    with pytest.raises(GroundstationError, match="no poses"):
        recorded_sets(folder)
