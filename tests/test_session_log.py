"""A simulated session as logs: the same bytes every time, and the same session when they are read again."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.base.errors import UsageError
from groundstation.base.toml_settings import settings_from
from groundstation.cli.main import main
from groundstation.pipeline.verbs.catalogue import catalogue
from groundstation.pipeline.verbs.synthesis import kind_of, simulate_to
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_log import write_session
from groundstation.simulation.session_scenario import SessionScenario, load_session, session_names
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.tables.session import DeadReckoning
from groundstation.tables.session_assemble import session_from_flights
from groundstation.tables.session_settings import SessionSettings, Stations
from tests.session_example import LOCAL, SEED, WITH_POINTS, through_the_log
from tests.systems.cooperative.example import believed

LOGGED_M, LOGGED_MPS = 2e-4, 2e-5  # steps of 1e-9 deg, 0.1 mm and 0.01 mm/s, in three axes
TOML = """
title = "two"
frame = "ecef"
duration_s = 3.0

[[aircraft]]
name = "A 1"
north_m = 0
east_m = 0

[[aircraft]]
name = "B"
north_m = 0
east_m = 9000
"""


@pytest.fixture(scope="module", params=[WITH_POINTS, LOCAL], ids=["globe", "plane"])
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[SessionScenario, Path]:
    folder = tmp_path_factory.mktemp("session")
    scenario = replace(request.param, duration_s=20.0)
    write_session(scenario, folder, "example", SEED)
    return scenario, folder


def test_logs_give_the_session_within_their_resolution(written: tuple[SessionScenario, Path], tmp_path: Path) -> None:
    scenario, folder = written
    stations = settings_from(Stations, tomllib.loads((folder / "stations.toml").read_text()), "stations.toml")
    found = session_from_flights([through_the_log(path, tmp_path) for path in folder.glob("*.csv")], stations)
    expected = simulate_session(scenario, SEED).session
    assert not found.findings
    assert found.session.frame == scenario.frame
    assert found.session.ranks == expected.ranks
    for one, other in zip(found.session.vehicles, expected.vehicles, strict=True):
        assert isinstance(one, DeadReckoning)
        assert isinstance(other, DeadReckoning)
        assert one.time_s == pytest.approx(other.time_s, abs=1e-9)
        assert one.position_m == pytest.approx(other.position_m, abs=LOGGED_M)
        assert one.velocity_mps == pytest.approx(other.velocity_mps, abs=LOGGED_MPS)
    ranges, others = found.session.ranges, expected.ranges
    assert ranges.receiver.tolist() == others.receiver.tolist()
    assert ranges.source.tolist() == others.source.tolist()
    assert ranges.time_s == pytest.approx(others.time_s, abs=2e-9)
    assert ranges.pseudorange_m == pytest.approx(others.pseudorange_m, abs=LOGGED_M)
    for point, other_point in zip(found.session.points, expected.points, strict=True):
        assert point.position_m == pytest.approx(other_point.position_m, abs=LOGGED_M)
    assert len(found.session.satellites) == len(expected.satellites)


def test_settings_beside_the_logs_are_what_the_scenario_draws_from(written: tuple[SessionScenario, Path]) -> None:
    scenario, folder = written
    tables = tomllib.loads((folder / "settings.toml").read_text())
    assert settings_from(SessionSettings, tables["session"], "settings.toml") == SessionSettings()
    assert settings_from(CooperativeSettings, tables["cooperative"], "settings.toml") == believed(scenario)


def test_the_same_bytes_every_time(written: tuple[SessionScenario, Path], tmp_path: Path) -> None:
    scenario, folder = written
    again = write_session(scenario, tmp_path, "example", SEED)
    assert [path.name for path in again] == [
        *("example-A.csv", "example-B.csv", "example-C.csv", "stations.toml", "settings.toml"),
    ]
    for path in again:
        assert path.read_bytes() == (folder / path.name).read_bytes()
    other = write_session(scenario, tmp_path / "other", "example", SEED + 1)
    assert other[0].read_bytes() != again[0].read_bytes()


def test_simulate_takes_sessions_by_name_and_by_file(tmp_path: Path) -> None:
    file = tmp_path / "Two.toml"
    file.write_text(TOML)
    assert kind_of(str(file)) == "session"
    assert kind_of("taxi-good") == "flight"
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(file), "-o", str(tmp_path / "logs"), "-q"])
    assert ended.value.code == 0
    names = sorted(path.name for path in (tmp_path / "logs").iterdir())
    assert names == ["settings.toml", "stations.toml", "two-A-1.csv", "two-B.csv"]
    assert "# aircraft: A 1\n" in (tmp_path / "logs" / "two-A-1.csv").read_text()
    with pytest.raises(UsageError, match="two-A-1"):
        simulate_to(str(file), tmp_path / "logs")
    assert simulate_to(str(file), tmp_path / "logs", force=True)


def test_list_names_the_sessions() -> None:
    listed = {entry["name"]: entry["title"] for entry in catalogue() if entry["kind"] == "session"}
    assert set(listed) == set(session_names())
    assert listed["three-no-gnss"] == load_session("three-no-gnss").title
