"""Users' settings files: every mistake is told in one line that names file and key."""

from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.base.errors import SettingsError
from groundstation.integrity.limits import shipped
from groundstation.pipeline.one_flight.configuration import Configuration, WrittenInterval, load_configuration
from groundstation.systems.heading.settings import HeadingSettings


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_no_files_give_the_defaults() -> None:
    assert load_configuration() == Configuration()


def test_a_file_for_a_section_wins_over_the_section(tmp_path: Path) -> None:
    config = written(tmp_path, "c.toml", "[heading]\ntaxi_speed_min_mps = 5\n[aircraft]\nentry_step_deg = 1.0\n")
    aircraft = written(tmp_path, "l39.toml", "antenna_arm_m = 4.2\n")
    settings = load_configuration(config, aircraft).settings
    assert settings.of(HeadingSettings).taxi_speed_min_mps == 5.0
    assert settings.aircraft.antenna_arm_m == 4.2
    assert settings.aircraft.entry_step_deg == Configuration().settings.aircraft.entry_step_deg


def test_intervals_are_read_with_their_reasons(tmp_path: Path) -> None:
    path = written(tmp_path, "i.toml", '[[exclude]]\nfrom = "+01:00"\nto = "+01:30"\nreason = "towed"\n')
    assert load_configuration(intervals=path).exclude == (WrittenInterval("+01:00", "+01:30", "towed"),)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[heding]\nx = 1\n", "heding"),
        ("heading = 3\n", "heading"),
        ("exclude = 3\n", "exclude"),
        ("[[exclude]]\nfrom = 3\n", "from and to"),
        ("[[exclude]]\nfrom = 3\nto = 4\nbecause = 1\n", "because"),
        ("not toml at all", "not TOML"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        load_configuration(written(tmp_path, "c.toml", text))


@pytest.mark.parametrize(
    ("section", "values", "says"),
    [
        ("heading", {"no_such_gate": 1.0}, "no_such_gate"),
        ("heading", {"taxi_speed_min_mps": "fast"}, "taxi_speed_min_mps"),
        ("aircraft", {"entry_step_deg": True}, "entry_step_deg"),
        ("site", {"stands": [{"name": "4A"}]}, "heading_deg"),
    ],
)
def test_a_wrong_value_is_named(section: str, values: dict[str, object], says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        Configuration({section: values})


def test_a_missing_file_is_told() -> None:
    with pytest.raises(SettingsError, match=r"nowhere\.toml"):
        load_configuration(Path("nowhere.toml"))


def test_thresholds_are_a_section_and_a_file(tmp_path: Path) -> None:
    config = written(tmp_path, "c.toml", "[thresholds]\nversion = 1\ngaps.min_s = 0.5\n")
    assert load_configuration(config).thresholds.gaps.min_s == 0.5
    own = written(tmp_path, "t.toml", "version = 1\n[gaps]\nperiods = 4\n")
    found = load_configuration(config, thresholds=own)
    assert found.thresholds.gaps == replace(shipped().gaps, periods=4.0)
    assert found.to_dict() == {"thresholds": {"version": 1, "gaps": {"periods": 4}}}
    with pytest.raises(SettingsError, match=r"c.toml, key thresholds.version"):
        load_configuration(written(tmp_path, "c.toml", "[thresholds]\ngaps.min_s = 0.5\n"))


def test_metar_lines_of_a_file_and_of_the_settings(tmp_path: Path) -> None:
    file = tmp_path / "metar.txt"
    file.write_text("# the day\nMETAR UUEE 040600Z 27010MPS CAVOK=\nMETAR UUEE 040630Z NIL=\n", encoding="utf-8")
    found = load_configuration(weather=file)
    assert found.weather == ("METAR UUEE 040600Z 27010MPS CAVOK=",)
    again = load_configuration(found.to_dict())
    assert again.weather == found.weather
    file.write_text("sunny\n", encoding="utf-8")
    with pytest.raises(SettingsError, match=r"metar\.txt: found no METAR line with a wind, expected lines such as"):
        load_configuration(weather=file)
    file.write_bytes(b"")
    with pytest.raises(SettingsError, match=r"metar\.txt: found no METAR line with a wind, expected lines such as"):
        load_configuration(weather=file)
    file.write_bytes(b"METAR UUEE 040600Z 27010MPS CAVOK=\n# \xff\xfe\n")
    with pytest.raises(
        SettingsError, match=r"metar\.txt: found text that is not UTF-8 \(byte 38: 0xff\), expected a text"
    ):
        load_configuration(weather=file)
    with pytest.raises(SettingsError, match="expected a list of METAR lines"):
        load_configuration({"weather": [1]})
