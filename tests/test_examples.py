"""The scripts of docs/examples run as they stand, on simulated logs, and print what they promise."""

import runpy
from pathlib import Path

import matplotlib as mpl
import pandas as pd
import pytest

from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.verbs.synthesis import simulate_to
from tests.readers.ulog_writer import UlogWriter

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "docs" / "examples"
SAMPLES = ROOT / "sample_logs"
SHORT_UNIT = 'title = "short"\nfamily = "uav"\nseed = 2\n[unit]\nduration_s = 150.0\nrate_hz = 20.0\n'
SITE = """[[runways]]
name = "06"
true_bearing_deg = 60.51
latitude_deg = 56.0386
longitude_deg = 37.6285
elevation_m = 205
length_m = 3000
"""
LONGEST_LINES = 26


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the logs that the scripts name."""
    made = tmp_path_factory.mktemp("examples")
    (made / "logs").mkdir()
    simulate_to("approach-beacons", made)[0].rename(made / "approach.csv")
    (made / "site.toml").write_text(SITE, encoding="utf-8")
    (made / "flight.csv").symlink_to(SAMPLES / "taxi-short.csv")
    (made / "logs" / "first.csv").symlink_to(SAMPLES / "taxi-short.csv")
    (made / "logs" / "second.csv").symlink_to(made / "approach.csv")
    (made / "short.toml").write_text(SHORT_UNIT, encoding="utf-8")
    simulate_to(str(made / "short.toml"), made, form="ulog")
    (made / "flight.ulg").write_bytes((made / "short.ulg").read_bytes() + parameters())
    run_many([made / "flight.csv"], made / "out", Configuration(), jobs=1, only_results=True)
    return made


def parameters() -> bytes:
    """Messages of a ULog: one parameter off its default, one changed later."""
    log = UlogWriter()
    log.data.clear()
    log.parameter("MC_ROLL_P", 6.5, "Q", 1).parameter("MC_ROLL_P", 8.0)
    log.parameter("EKF2_GPS_DELAY", 110.0).parameter("EKF2_GPS_DELAY", 150.0)
    return bytes(log.data)


@pytest.fixture
def run(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Runs a script in the folder and returns what it printed."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(mpl, "rcParams", mpl.rcParams.copy())

    def _run(name: str) -> str:
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        return capsys.readouterr().out

    return _run


def test_heading_correction(run) -> None:
    told = run("heading_correction")
    assert "verdict     advisory" in told and "error       -0.86 deg" in told


def test_ins_errors_of_a_folder(run, folder: Path) -> None:
    told = run("ins_errors_of_a_folder")
    assert "first.csv: inertial: no INS position in the log" in told
    table = pd.read_csv(folder / "ins_errors.csv")
    assert set(table["log"]) == {"second.csv"} and set(table["channel"]) == {"north", "east"}


def test_best_trajectory(run, folder: Path) -> None:
    assert run("best_trajectory").startswith("accepted, 79 s in motion")
    assert "true_heading_deg" in pd.read_csv(folder / "trajectory.csv")
    assert (folder / "trajectory_sigmas.png").read_bytes().startswith(b"\x89PNG")


def test_autopilot_health(run, folder: Path) -> None:
    told = run("autopilot_health")
    _, _, off = told.partition("off their defaults")
    off, _, changed = off.partition("changed while the log was recorded")
    assert "firmware" in told and "MC_ROLL_P" in off and "EKF2_GPS_DELAY" in changed and "MC_ROLL_P" not in changed
    assert len(pd.read_csv(folder / "health_measures.csv"))


def test_approach(run) -> None:
    told = run("approach")
    assert "landing on runway" in told and "beyond the threshold" in told
    assert "sink rate at the touchdown" in told and "touchdown" in told.rpartition("event")[2]


def test_compare_settings(run) -> None:
    told = run("compare_settings")
    assert "as shipped" in told and "above 5 m/s" in told
    assert "largest heading error: 20260505T073000Z_SIM-1_102" in told


def test_every_script_is_short_tested_and_listed() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    for path in EXAMPLES.glob("*.py"):
        assert f"def test_{path.stem}(" in Path(__file__).read_text(encoding="utf-8"), path
        assert f"examples/{path.name}" in page, path
        assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST_LINES, path
