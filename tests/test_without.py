"""Analyses that the user leaves out."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.base.errors import SettingsError
from groundstation.cli.main import app
from groundstation.pipeline.one_flight.configuration import load_configuration

SHORT = Path(__file__).parents[1] / "sample_logs" / "taxi-short.csv"


def test_a_name_that_is_none_is_refused() -> None:
    with pytest.raises(SettingsError, match="'nonsense', expected one of heading"):
        load_configuration(without=["nonsense"])
    with pytest.raises(SettingsError, match="a list of names"):
        load_configuration({"without": "heading"})


def test_a_settings_file_and_the_command_line_are_taken_together() -> None:
    found = load_configuration({"without": ["heading"]}, without=["latency", "heading"])
    assert found.without == ("heading", "latency") and found.to_dict()["without"] == ["heading", "latency"]


def test_a_run_leaves_it_out_says_so_and_makes_it_anew_without_the_option(tmp_path: Path) -> None:
    given = ["run", str(SHORT), "-o", str(tmp_path), "--only", "results"]
    first = CliRunner().invoke(app, [*given, "--without", "latency", "--without", "gnss"])
    assert first.exit_code == 0, first.output
    (summary,) = tmp_path.glob("*/summary.json")
    saved = json.loads(summary.read_text())
    assert not {"latency", "gnss"} & saved["results"].keys()
    reasons = {one["analysis"]: one["reason"] for one in saved["not_assessable"]}
    assert all(reasons[name].endswith("left out (--without)") for name in ("latency", "gnss"))
    assert CliRunner().invoke(app, given).exit_code == 0
    assert "gnss" in json.loads(summary.read_text())["results"]
