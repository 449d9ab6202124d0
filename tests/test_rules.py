"""Other limits over past verdicts: from the gates that flights saved, without their logs."""

import csv
import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.base.errors import SettingsError, UsageError
from groundstation.cli.main import app
from groundstation.cli.rules import rules_text
from groundstation.pipeline.api import open_flight, simulate
from groundstation.pipeline.verbs.rules import RulesTest, rules_test
from groundstation.results.files import save
from groundstation.results.manifest import Manifest
from groundstation.systems import systems
from groundstation.systems.heading.answer import HeadingResult
from tests.saved import load

SAMPLES = sorted((Path(__file__).parents[1] / "sample_logs").glob("*.csv"))


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every sample log, and a flight with an approach, analysed and saved; the logs are gone."""
    folder, logs = tmp_path_factory.mktemp("out"), tmp_path_factory.mktemp("logs")
    for log in (*SAMPLES, simulate("approach-beacons", logs)):
        results = open_flight(log).results
        manifest = Manifest(groundstation="0.1.0", configuration={})
        save(folder / f"{results.flight_id}_{log.stem}", results, manifest)
    return folder


def under(out: Path, text: str, tmp_path: Path) -> RulesTest:
    file = tmp_path / "new.toml"
    file.write_text(text, encoding="utf-8")
    return rules_test(file, out)


def test_unchanged_rules_give_the_verdicts_that_were_given(out: Path, tmp_path: Path) -> None:
    found = under(out, "", tmp_path)
    assert found.flights == len(SAMPLES) + 1 and found.judged >= found.flights
    assert (found.changed, found.need_log, found.rows) == (0, 0, ())


def test_a_stricter_limit_changes_the_verdict_and_says_why(out: Path, tmp_path: Path) -> None:
    heading = {folder.name: load(folder).results.answer(HeadingResult) for folder in out.iterdir()}
    accepted = {name: answer for name, answer in heading.items() if answer is not None and answer.verdict == "accept"}
    assert accepted
    least = min(_half_width_deg(answer) for answer in accepted.values())
    found = under(out, f'[rules]\nversion = "2026-12"\n[heading]\nwhole_half_width_max_deg = {0.9 * least}\n', tmp_path)
    assert found.no_longer_accepted == len(accepted) <= found.changed and found.need_log == 0
    assert "2026-12" in found.rules
    for row in found.rows:
        assert row.gate == "whole_half_width" and (row.limit_before, row.state_after) == ("<= 0.333333", "failed")
        if row.flight_id in accepted:
            assert row.verdict_before == "accept" and row.verdict_after in ("extend", "advisory")
    text = rules_text(found)
    assert all(name in text for name in accepted) and f"{len(accepted)} no longer accepted" in text


def _half_width_deg(answer: HeadingResult) -> float:
    (value,) = (gate.value for gate in answer.gates if gate.name == "whole_half_width")
    assert value is not None
    return value


def test_rules_agree_with_a_run_under_them(out: Path, tmp_path: Path) -> None:
    """Limits that choose no data: every gate and verdict is that of a run with the new settings."""
    limits = {"precision_max_deg": 0.01, "quality_max_deg": 0.05, "variance_ratio_range": [0.9, 1.1]}
    limits |= {"precision_decides": True, "half_width_decides": True, "half_width_max_deg": 0.1}
    limits |= {"skewness_max": 0.1, "drift_sigmas_max": 0.5, "whole_half_width_max_deg": 0.9, "whole_decides": False}
    (tmp_path / "new.toml").write_text(
        "[heading]\n" + "\n".join(f"{key} = {json.dumps(limits[key])}" for key in limits)
    )
    found = rules_test(tmp_path / "new.toml", out)
    log = next(path for path in SAMPLES if path.stem == "taxi-good")
    again = open_flight(log, config={"heading": limits}).results.answer(HeadingResult)
    assert again is not None
    rows = [row for row in found.rows if row.flight_id.endswith("taxi-good")]
    assert {row.verdict_after for row in rows} == {again.verdict}
    states = {gate.name: gate.state for gate in again.gates}
    assert rows and all(states[row.gate] == row.state_after for row in rows)


def test_a_setting_that_chooses_data_needs_the_log(out: Path, tmp_path: Path) -> None:
    found = under(out, "[heading]\ntaxi_speed_min_mps = 5.0\n[aircraft]\nantenna_arm_m = 3.0\n", tmp_path)
    assert found.changed == 0 and found.need_log == found.judged
    told = {row.subject: row.needs_log for row in found.rows}
    assert told["heading"] == "taxi_speed_min_mps, aircraft"
    assert "are not sure without the log" in rules_text(found)


def test_criteria_of_an_approach_are_judged_again(out: Path, tmp_path: Path) -> None:
    found = under(out, "[landing]\nsink_rate_max_mps = 0.6\n", tmp_path)
    rows = [row for row in found.rows if row.subject.startswith("approach")]
    assert rows and {row.gate for row in rows} == {"sink_rate"}
    assert {row.verdict_after for row in rows if row.state_after == "failed"} == {"not stabilised"}
    assert found.changed > 0


def test_every_analysis_with_gates_has_rules_and_its_limits_are_settings() -> None:
    ruled = {analysis.name: analysis for analysis in systems().analyses if analysis.rules is not None}
    assert set(ruled) == {"heading", "magnetic", "magnetic_flux", "landing"}
    for analysis in ruled.values():
        assert analysis.rules.limits <= set(analysis.settings.__dataclass_fields__)


def test_the_verb_writes_a_table_and_answers_by_its_exit_code(out: Path, tmp_path: Path) -> None:
    new, table = tmp_path / "new.toml", tmp_path / "changes.csv"
    new.write_text("[heading]\nwhole_half_width_max_deg = 0.001\n")
    run, call = CliRunner(), ["rules", "test", str(new), "--over", str(out), "-o", str(table), "-f"]
    assert [run.invoke(app, [*call, "--fail-on", level]).exit_code for level in ("none", "warn", "fail")] == [0, 4, 4]
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert {row["gate"] for row in rows} == {"whole_half_width"} and {row["limit_after"] for row in rows} == {
        "<= 0.001"
    }
    lines = run.invoke(app, call).stdout.splitlines()  # a line for each changed verdict, their heads, the totals
    assert len(lines) == rules_test(new, out).changed + 2 and "?" not in "".join(lines)
    assert run.invoke(app, call[:-1]).exit_code == 2  # the table is there already
    told = json.loads(run.invoke(app, [*call, "--json"]).stdout)
    assert told["changed"] == rules_test(new, out).changed
    new.write_text("[heading]\nwhole_half_width_max_degrees = 0.001\n")
    assert run.invoke(app, call).exit_code == 2
    assert run.invoke(app, ["rules", "test", str(table), "--over", str(tmp_path / "none")]).exit_code == 2


def test_a_flight_that_cannot_be_read_stops_nothing(out: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    broken = next(copy.iterdir())
    (broken / "summary.json").write_text("{")
    found = under(copy, "", tmp_path)
    assert len(found.unread) == 1 and broken.name in found.unread[0]
    ended = CliRunner().invoke(app, ["rules", "test", str(tmp_path / "new.toml"), "--over", str(copy)])
    assert ended.exit_code == 1 and f"{len(list(copy.iterdir()))} flights" in ended.stdout
    with pytest.raises(UsageError, match="no results"):
        rules_test(tmp_path / "new.toml", tmp_path / "nothing")
    with pytest.raises(SettingsError, match="rules"):
        under(copy, "[rules]\nversion = 3\n", tmp_path)
