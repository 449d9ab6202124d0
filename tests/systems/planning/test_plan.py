"""Plans: what the verb writes, what it refuses, and the scenarios that come with the package."""

import json
import re
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
from typer.testing import CliRunner

from groundstation.cli.main import app
from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.inputs import flight_folders, plan_folders
from groundstation.pipeline.verbs.plan import run_plan, shipped_scenarios
from groundstation.results.files import load, load_manifest
from groundstation.systems import systems
from groundstation.systems.plan import Plan
from groundstation.systems.planning.landing.scenario import RangeApproach
from groundstation.systems.planning.session.scenario import SessionPlan
from groundstation.systems.shipped_plans import load_plan, plan_names
from tests.recording_contents import Contents

SCHEMA = json.loads((Path(__file__).parents[3] / "schemas" / "summary.schema.json").read_text(encoding="utf-8"))
LEAST = """
title = "short"
duration_s = 4
[[aircraft]]
name = "user"
north_m = 0
east_m = 0
control = ["speed"]
[[points]]
name = "P"
north_m = 3000
east_m = 1000
[[points]]
name = "Q"
north_m = -1000
east_m = 2000
"""


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


def scenario(tmp_path: Path, text: str = LEAST, name: str = "mine") -> str:
    path = tmp_path / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("plan")
    outcome = run_plan("session", scenario(out), out / "out")
    assert outcome.state == "done", outcome.text
    return Path(outcome.folder)


def test_a_plan_has_the_files_of_a_run_and_obeys_the_schema(made: Path) -> None:
    names = {path.name for path in made.iterdir()}
    assert names == {
        *("summary.json", "manifest.json", "report.html", "tables", "arrays"),
        *("mine.rrd", "plan.toml"),
    }
    summary = json.loads((made / "summary.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(summary)
    assert summary["flight"]["id"] == "mine" and list(summary["results"]) == ["control"]
    assert (made / "plan.toml").read_text(encoding="utf-8") == LEAST
    manifest = load_manifest(made)
    assert manifest.source.sha256 == summary["flight"]["source"]["sha256"]
    assert manifest.configuration["scenario"]["duration_s"] == 4.0


def test_equal_scenarios_give_equal_bytes(made: Path, tmp_path: Path) -> None:
    again = Path(run_plan("session", scenario(tmp_path), tmp_path / "out").folder)
    for name in ("summary.json", "report.html", "plan.toml"):
        assert (again / name).read_bytes() == (made / name).read_bytes(), name
    for table in sorted((made / "tables").iterdir()):
        assert (again / "tables" / table.name).read_bytes() == table.read_bytes(), table.name


def test_a_plan_is_no_flight_and_its_report_is_made_again(made: Path) -> None:
    out = made.parent
    assert flight_folders(out) == [] and plan_folders(out) == [made]
    html = (made / "report.html").read_bytes()
    (made / "report.html").unlink()
    report_again(out)
    assert (made / "report.html").read_bytes() == html
    assert json.loads((out / "index.json").read_text(encoding="utf-8"))["rows"] == []


def test_a_plan_comes_back_as_it_was_saved(made: Path) -> None:
    results = load(made, systems().answer_types).results
    assert [type(answer).analysis for answer in results.answers.values()] == ["control"]
    page = (made / "report.html").read_text(encoding="utf-8")
    assert "Control of the session" in page and 'id="provenance"' in page and "Heading" not in page


def test_the_recording_has_a_tab_of_the_plan(made: Path) -> None:
    recording = Contents(made / "mine.rrd")
    assert {"/plan/user/now", "/plan/ranges", "/control/law/user__speed/b00_lines"} <= set(recording.batches)


def test_a_plan_is_made_again_in_its_folder_and_nowhere_else(tmp_path: Path) -> None:
    out, file = tmp_path / "out", scenario(tmp_path)
    first = groundstation("plan", "session", file, "-o", str(out), "--no-pdf", "-q")
    assert first[0] == 0
    assert groundstation("plan", "session", file, "-o", str(out), "--no-pdf", "-q")[0] == 0
    (out / "mine" / "plan.toml").unlink()
    code, _, err = groundstation("plan", "session", file, "-o", str(out), "--no-pdf")
    assert code == 2 and "no plan" in err
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").touch()
    assert groundstation("plan", "session", file, "-o", str(other), "--no-pdf")[0] == 2


def test_a_warning_stands_in_the_line_of_the_plan(tmp_path: Path) -> None:
    on_one_line = LEAST.replace("east_m = 1000", "east_m = 0").replace("east_m = 2000", "east_m = 0")
    file, out = scenario(tmp_path, on_one_line), str(tmp_path / "out")
    code, text, _ = groundstation("plan", "session", file, "-o", out, "--no-pdf")
    assert code == 0 and "warning: the sources do not separate north and east" in text
    assert groundstation("plan", "session", file, "-o", out, "--no-pdf", "--fail-on", "warn")[0] == 4


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("duration_s = 4", "duration_s = nan"), "duration_s"),
        (("duration_s = 4", "duration_s = 0"), "duration_s"),
        (("duration_s = 4", "duration_s = 4\nstep_s = 3"), "whole steps"),
        (("duration_s", "duration"), "key duration"),
        (('control = ["speed"]', 'control = ["height"]'), "control"),
        (('control = ["speed"]', "speed_low_mps = 300"), "speed_mps"),
        (('control = ["speed"]', "is_exact = true"), "is exact"),
        (('name = "Q"', 'name = "P"'), "given twice"),
        (('title = "short"', 'title = "short"\njudged = "nobody"'), "judged"),
    ],
)
def test_a_wrong_scenario_is_told_in_a_line(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    code, out, err = groundstation("plan", "session", scenario(tmp_path, LEAST.replace(*change)), "-o", str(tmp_path))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and "mine.toml" in err and told in err


def test_the_scenario_of_the_documentation_is_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "control.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    loaded = load_plan(systems().plans[0], scenario(tmp_path, text)).scenario
    assert loaded.user.control == ("speed",) and loaded.placement.keep_out[0].name == "lake"


def test_the_scenarios_that_are_shipped_are_listed_and_read() -> None:
    code, text, _ = groundstation("plan", "session", "--list")
    assert code == 0 and "speed-three-points" in text
    listed = json.loads(groundstation("plan", "session", "--list", "--json")[1])
    assert [one["name"] for one in listed] == [one.name for one in shipped_scenarios("session")]
    code, _, err = groundstation("plan", "session", "no-such-plan", "-o", "x")
    assert code == 2 and "speed-three-points" in err
    assert groundstation("plan", "session")[0] == 2


def quick(scenario: object) -> object:
    """The scenario with few iterations, trials and measurements: the study's tests make plans in full."""
    if isinstance(scenario, RangeApproach):
        noise = replace(scenario.noise, interval_s=max(scenario.noise.interval_s, 0.1))
        return replace(scenario, trials=min(scenario.trials, 3), noise=noise)
    if not isinstance(scenario, SessionPlan):
        return scenario
    if not any(point.is_placed for point in scenario.points):
        scenario = replace(scenario, duration_s=min(scenario.steps, 10) * scenario.step_s)
    control = replace(scenario.control, starts=0, iterations=5)
    return replace(scenario, control=control, placement=replace(scenario.placement, starts=0, iterations=5, map_side=5))


@pytest.mark.parametrize(("plan", "name"), [(plan, name) for plan in systems().plans for name in plan_names(plan)])
def test_every_shipped_scenario_gives_a_plan(plan: Plan[object], name: str) -> None:
    planned = plan.run(quick(load_plan(plan, name).scenario))
    assert planned.answers and plan.sentence(planned.answers)
    assert not [finding for finding in planned.findings if finding.severity == "fail"]


LANDING = """
title = "short final"
trials = 3
[path]
start_m = 1500
[noise]
interval_s = 0.1
white_m = 1
correlated_m = 1
[moving]
[[points]]
name = "left"
before_threshold_m = 0
right_m = -1000
[[points]]
name = "right"
before_threshold_m = 0
right_m = 1000
[[points]]
name = "third"
before_threshold_m = 100
right_m = 0
"""


def test_a_landing_is_planned_into_a_folder_with_its_answer_in_a_line(tmp_path: Path) -> None:
    file = scenario(tmp_path, LANDING)
    code, text, _ = groundstation("plan", "landing", file, "-o", str(tmp_path / "out"))
    assert code == 0 and "touchdown, 95 %" in text and "CAT IIIB" in text
    folder = tmp_path / "out" / "mine"
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(summary)
    assert [row["place"] for row in summary["results"]["landing_ranges"]["rows"]][-1] == "touchdown"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Landing by ranges" in page and "integrity, continuity and availability are not shown" in page
    assert {"landing_ranges_path.csv", "landing_ranges_errors.csv"} <= {
        one.name for one in (folder / "tables").iterdir()
    }
    recording = Contents(folder / "mine.rrd")
    assert {"/landing/aircraft/now", "/landing/ranges"} <= set(recording.batches)
    assert "/landing_ranges/trials/error_up/01_curve" in recording.fixed
    assert sum(path.startswith("/landing/corridor/") for path in recording.fixed) == 3


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("start_m = 1500", "runway_length_m = 0"), "runway_length_m"),
        (("before_threshold_m = 100\nright_m = 0", "before_threshold_m = 0\nright_m = 0\nup_m = 15"), "off the path"),
        (("white_m = 1", "white_m = 0"), "white_m"),
        (("[moving]", "[moving]\nspeed_mps = 10"), "its bounds"),
        (("[moving]", "[moving]\nheight_m = nan"), "height_m"),
    ],
)
def test_a_wrong_landing_is_told_in_a_line(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    file = scenario(tmp_path, LANDING.replace(*change))
    code, out, err = groundstation("plan", "landing", file, "-o", str(tmp_path / "out"))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and "mine.toml" in err and told in err
