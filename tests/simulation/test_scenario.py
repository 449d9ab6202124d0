"""Scenario files are read strictly: every mistake names the file and the key."""

from pathlib import Path
from typing import Any

import pytest

from groundstation.base.errors import SettingsError
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario, scenario_names
from tests.simulated_flights import TAXI_LEGS, scenario


@pytest.mark.parametrize("name", scenario_names())
def test_every_shipped_scenario_loads(name: str) -> None:
    loaded = load_scenario(name)
    assert loaded.name == name and loaded.title


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"airprot": {}}, "airprot"),
        ({"airport": {"latitude_deg": 95.0, "longitude_deg": 0.0}}, "airport.latitude_deg"),
        ({"airport": {"latitude_deg": 55.0}}, "airport.longitude_deg"),
        ({"gnss": {"rate_hz": 7}}, "gnss.rate_hz"),
        ({"gnss": {"rate_hz": 10, "repeat": 3}}, "gnss.repeat"),
        ({"gnss": {"rate_hz": "10"}}, "gnss.rate_hz"),
        ({"gnss": {"satellites": 7.5}}, "gnss.satellites"),
        ({"gnss": {"outages": [{"from_s": 5, "to_s": 4}]}}, "gnss.outages"),
        ({"legs": []}, "legs"),
        ({"legs": [{"kind": "fly_home"}]}, "legs[0].kind"),
        ({"legs": [*TAXI_LEGS, {"kind": "taxi", "length": 5}]}, "legs[5].length"),
        ({"start_utc": "yesterday"}, "start_utc"),
        ({"magnetometer": {"hard_iron_nt": [1.0, 2.0]}}, "magnetometer.hard_iron_nt"),
        ({"log": {"delimiter": "|"}}, "log.delimiter"),
        ({"ins": {"fields": ["true_heading"]}}, "ins.fields"),
        ({"faults": [{"kind": "fire"}]}, "faults[0].kind"),
        ({"faults": [{"kind": "dropout", "from_s": 3, "to_s": 2}]}, "faults"),
        ({"seed": True}, "seed"),
    ],
)
def test_mistakes_name_the_file_and_the_key(changes: dict[str, Any], key: str) -> None:
    with pytest.raises(SettingsError) as caught:
        scenario(**changes)
    assert f"test.toml, key {key}:" in str(caught.value)


def test_scenario_file_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        '[airport]\nlatitude_deg = -33.9\nlongitude_deg = 151.2\n[[legs]]\nkind = "parked"\nduration_s = 3\n',
        encoding="utf-8",
    )
    simulated = simulate(load_scenario(path))
    assert simulated.scenario.name == "mine" and simulated.flight.duration_s == 3.0


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text("[airport", encoding="utf-8")
    for name, text in (("nowhere", "taxi-good"), (tmp_path / "none.toml", "none.toml"), (broken, "not TOML")):
        with pytest.raises(SettingsError, match=text):
            load_scenario(name)
