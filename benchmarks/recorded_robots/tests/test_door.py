"""The plug-in comes through the doors that are open to anyone: listed, read and run by groundstation's own verbs."""

import json
from pathlib import Path

import numpy as np
import pytest

from groundstation.readers import registry
from groundstation.systems import systems
from tests.architecture_picture import PACKAGE
from tests.test_verbs import groundstation

pytest.importorskip("recorded_robots", reason="the plug-in is not installed: make robots")
from recorded_robots import murp

PAIR = "16_base-1_targ-2_win-1_step-1.csv"


def write_pair(folder: Path) -> Path:
    """Two agents that turn about one another, and what their antennas measure."""
    folder.mkdir()
    pairs = [f"{one}_{two}" for one in range(1, 7) for two in range(1, 7)]
    poses = [f"{start}{name}" for start in ("", "A_", "B_") for name in ("x", "y", "z", "roll", "pitch", "yaw")]
    ring = np.deg2rad(60.0 * np.arange(1, 7) - 30.0)
    rows = [",".join(["t", *poses, *pairs])]
    for t in np.arange(0.0, 30.0, 0.5):
        yaw, places, antennas = 0.1 * t, [], []
        for side in (1.0, -1.0):
            place = side * 2.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0]) + (0.0, 0.0, 1.0)
            places += [*place, 0.0, 0.0, np.rad2deg(yaw)]
            antennas.append(place[:2] + 0.32 * np.column_stack([np.cos(yaw + ring), np.sin(yaw + ring)]))
        ranges = np.linalg.norm(antennas[0][:, None] - antennas[1][None], axis=2).ravel()
        cells = [t, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *places, *ranges]
        rows.append(",".join(f"{cell:.6f}" for cell in cells))
    (folder / PAIR).write_text("\n".join([*rows, ""]))
    return folder


def test_list_names_what_the_plug_in_brings() -> None:
    code, text, _ = groundstation("list", "--json")
    listed = {(one["kind"], one["name"]) for one in json.loads(text)}
    assert code == 0
    assert listed >= {*(("format", name) for name in ("utias", "miluv", "murp")), ("study", "recorded")}
    assert not registry.plug_in_failures() and not systems().failures


def test_groundstation_names_the_plug_in_nowhere() -> None:
    for path in PACKAGE.rglob("*"):
        assert path.suffix not in (".py", ".toml") or "recorded_robots" not in path.read_text(encoding="utf-8"), path


def test_a_pair_is_read_and_its_study_runs(tmp_path: Path) -> None:
    folder = write_pair(tmp_path / "set")
    code, text, _ = groundstation("info", str(folder / PAIR), "--json")
    assert code == 0 and json.loads(text)["facts"]["format"] == murp.NAME
    assert registry.identify(folder / PAIR).reader == murp.NAME
    code, page, told = groundstation("study", "recorded", "--input", str(folder), "-o", str(tmp_path / "out"))
    assert code == 0, told
    assert page.strip() == (tmp_path / "out/recorded.md").read_text(encoding="utf-8").strip()
    assert "set 16" in page and (tmp_path / "out/tables/cooperative_recorded.csv").is_file()


def test_the_study_asks_for_its_folder(tmp_path: Path) -> None:
    code, _, told = groundstation("study", "recorded", "-o", str(tmp_path / "out"))
    assert code == 2 and "recorded without --input, expected a folder with sets of recorded robots" in told
