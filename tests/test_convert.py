"""`convert` takes the ledger's limits as `run` and `check` do; records a counter misses are told, not called lost."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from groundstation.base.ledger import Ledger
from groundstation.cli.main import app
from groundstation.store.reader import read_info

ROWS = 400
MISSING = range(100, 105)  # the recorder's counter goes on, the rows are not there
LIMITS = 'version = 1\nname = "mine"\n[gaps]\nmin_s = 0.05\n'


def groundstation(*arguments: Any) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A sound flat CSV in which the recorder left out five records, as its counter tells."""
    lines = ["# start_utc: 2026-05-04T06:00:00Z", "time_s,ins.roll_deg,ins.pitch_deg,seq"]
    lines += [f"{row / 50:.3f},{row % 7 - 3.5},{row % 5 - 2.5},{row}" for row in range(ROWS) if row not in MISSING]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def ledger_of(log: Path, *options: Any) -> Ledger:
    target = log.with_name("out.mcap")
    assert groundstation("convert", log, "-o", target, "-f", *options)[0] == 0
    return read_info(target).ledger


def test_limits_of_a_file_reach_the_ledger(log: Path) -> None:
    limits, config = log.with_name("mine.toml"), log.with_name("config.toml")
    limits.write_text(LIMITS, encoding="utf-8")
    config.write_text("[thresholds]\n" + LIMITS.replace("[gaps]", "[thresholds.gaps]"), encoding="utf-8")
    default = ledger_of(log)
    by_file, by_config = ledger_of(log, "--thresholds", limits), ledger_of(log, "--config", config)
    assert by_file == by_config
    assert default.thresholds.name != by_file.thresholds.name == "mine"
    assert default.topics["ins"].gaps.count == 0 and by_file.topics["ins"].gaps.count == 1


def test_wrong_limits_are_a_usage_error_and_write_nothing(log: Path) -> None:
    limits, target = log.with_name("mine.toml"), log.with_name("out.mcap")
    limits.write_text("version = 1\n[gaps]\nleast_s = 1.0\n", encoding="utf-8")
    code, _, err = groundstation("convert", log, "-o", target, "--thresholds", limits)
    assert code == 2 and "mine.toml" in err and "gaps.least_s" in err and err.count("\n") == 1
    assert groundstation("convert", log, "-o", target, "--thresholds", log.with_name("none.toml"))[0] == 2
    assert not target.exists()


def test_records_missing_by_a_counter_are_a_warning_and_not_data_lost(log: Path) -> None:
    """The recorder lost them, nothing of the log is lost: exit 0, and 4 where a warning shall count."""
    target = log.with_name("a.mcap")
    assert groundstation("convert", log, "-o", target)[0] == 0
    for path in (log, target):
        code, out, _ = groundstation("check", path, "--json")
        (entry,) = json.loads(out)
        (finding,) = (one for one in entry["findings"] if one["code"] == "data.sequence")
        assert (code, entry["state"]) == (0, "done")
        assert (finding["severity"], finding["count"]) == ("warn", len(MISSING))
        assert groundstation("check", path, "--fail-on", "warn", "-q")[0] == 4
        assert groundstation("info", path)[0] == 0
    code, _, _ = groundstation("run", log, "-o", log.with_name("out"), "-q", "-j", "1")
    assert code == 0
