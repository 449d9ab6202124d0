"""``compare``: differences with their sigmas, clocks aligned on events, both flights in one recording and page."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from rerun.experimental import ViewerClient
from typer.testing import CliRunner

from groundstation.base.errors import UnreadableLogError, UsageError
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.comparison import conclusion, plain_name
from groundstation.chapters.plots.comparison import sides_of
from groundstation.cli.flights import comparison_text
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.inputs import collect
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.verbs.alignment import align, events_of
from groundstation.pipeline.verbs.clip import Wanted, clip
from groundstation.pipeline.verbs.compare import compare, compare_to, deltas_of
from groundstation.plots.marks import Curve
from groundstation.results.answer import by_analysis
from groundstation.results.comparison import Comparison, Delta
from groundstation.results.figures import FigureData
from groundstation.results.files import SavedFlight, save
from groundstation.results.manifest import Manifest
from groundstation.results.summary import summary_of
from groundstation.simulation.samples import write_scenario
from groundstation.systems import systems
from groundstation.systems.health.answer import AutopilotHealth
from groundstation.systems.inertial.answer import InertialResult, RealOutage
from groundstation.systems.inertial.arrays import InertialStates
from groundstation.systems.landing.answer import LandingResult
from groundstation.viewer.comparison import OVER_TIME
from tests.recording_contents import Contents
from tests.saved import load
from tests.systems.inertial.example import inertial_result
from tests.told import COMPARED, comparison_html, write_comparison
from tests.viewer_example import make_flight, make_results
from tests.viewer_shots import ALL_OR_SOME, chosen, colourful, drawn_in, pages

SAMPLES = Path(__file__).parents[1] / "sample_logs"
SCENARIOS = Path(__file__).parents[1] / "groundstation" / "simulation" / "scenarios"
GRID_S = 0.2  # step of the grid on which phases are told apart
LATER_S = 23.7
LEAST_PIXELS = 40
OVER_EACH_OTHER = {
    name: tell for name, tell in COMPARED.items() if not name.endswith("-difference")
}  # not on the page alone
SPEEDS = [f"/comparison/overview-ground_speed_mps/ground_speed/b0{place}_lines" for place in range(2)]  # of A, of B


def groundstation(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a call in this process."""
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


def ran(log: Path, out: Path, **settings: Any) -> Path:
    """The folder of a log that was run."""
    outcome = run_flight(Job(log, out, Configuration(settings), only_results=True))
    assert outcome.folder, outcome.text
    return Path(outcome.folder)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Flights: the good sample, the same with another threshold, as a part, and with a longer wait before taxi."""
    out = tmp_path_factory.mktemp("flights")
    scenario = (SCENARIOS / "taxi-good.toml").read_text(encoding="utf-8")
    parked = re.compile(r'(kind = "parked"\nduration_s = )([\d.]+)')
    longer = parked.sub(lambda found: f"{found[1]}{float(found[2]) + LATER_S}", scenario, count=1)
    (out / "later.toml").write_text(longer, encoding="utf-8")
    later = write_scenario(out / "later.toml", out, 5)
    clip(SAMPLES / "taxi-good.csv", out / "part.mcap", Wanted("30", None), with_recording=False)
    return {
        "good": ran(SAMPLES / "taxi-good.csv", out),
        "faster": ran(SAMPLES / "taxi-good.csv", out, heading={"taxi_speed_min_mps": 8.0}),
        "part": ran(out / "part.mcap", out),
        "later": ran(later, out),
        "short": ran(SAMPLES / "taxi-short.csv", out),
        "notime": ran(SAMPLES / "taxi-notime.csv", out),
    }


def saved_example(folder: Path, **changes: Any) -> SavedFlight:
    """A saved flight with figures of every analysis."""
    flight = make_flight(240.0, 20.0)
    save(folder, replace(make_results(flight), **changes), Manifest())
    return load(folder)


def compared(a: Path, b: Path, event: Any = None) -> Comparison:
    return compare(a, b, event)[0]


def by_name(comparison: Comparison) -> dict[str, Delta]:
    return {delta.name: delta for delta in comparison.deltas}


# ---------------------------------------------------------------------------------------------------- answers


def summary(**results: Any) -> dict[str, Any]:
    return {"status": "ok", "flight": {"duration_s": 1.0}, "completeness": {}, "results": results}


def test_every_number_is_paired_by_what_identifies_its_row() -> None:
    skill = [
        {"method": "raw_ins", "horizon_min": 5, "rms_m": 10.0},
        {"method": "windows", "horizon_min": 5, "rms_m": 2.0},
    ]
    a = summary(forecast={"skill": skill, "default_method": "windows"})
    b = summary(forecast={"skill": [{**row, "rms_m": row["rms_m"] + 1.5} for row in reversed(skill)]})  # type: ignore[operator]
    found = {delta.name: delta for delta in deltas_of(a, b)}
    assert found["forecast.skill.raw_ins.5min.rms_m"].delta == 1.5
    assert found["forecast.skill.windows.5min.rms_m"].is_main
    assert not found["forecast.skill.raw_ins.5min.rms_m"].is_main
    assert found["forecast.skill.count"].delta == 0.0


@pytest.mark.parametrize(
    ("answer", "other", "name", "delta", "sigma"),
    [
        (
            {"error_deg": 1.0, "standard_error_deg": 0.3},
            {"error_deg": 1.5, "standard_error_deg": 0.4},
            "error_deg",
            0.5,
            0.5,
        ),
        ({"error_deg": 359.5}, {"error_deg": 0.5}, "error_deg", 1.0, None),
        (
            {"drift_deg_per_h": 1.0, "drift_sigma_deg_per_h": 3.0},
            {"drift_deg_per_h": 0.0, "drift_sigma_deg_per_h": 4.0},
            "drift_deg_per_h",
            -1.0,
            5.0,
        ),
        ({"confidence95_deg": [0.5, 1.5]}, {"confidence95_deg": [0.25, 1.5]}, "confidence95_low_deg", -0.25, None),
        ({"a_m": 1.0, "a_sigma_m": 1.0}, {"a_m": 2.0, "a_sigma_m": None}, "a_m", 1.0, None),
        ({"a_m": None}, {"a_m": 2.0}, "a_m", None, None),
    ],
)
def test_differences_and_their_sigmas(
    answer: Any, other: Any, name: str, delta: float | None, sigma: float | None
) -> None:
    found = {one.name: one for one in deltas_of(summary(heading=answer), summary(heading=other))}[f"heading.{name}"]
    assert found.delta == (None if delta is None else pytest.approx(delta, abs=1e-9))
    assert found.sigma == (None if sigma is None else pytest.approx(sigma))


def test_as_many_differences_are_called_significant_as_should_be() -> None:
    """Two flights with the same truth and honest sigmas: one difference in twenty is beyond (seed 3, 4000 draws)."""
    rng = np.random.default_rng(3)
    sigmas = rng.uniform(0.01, 0.1, (4000, 2))
    errors = 1.0 + rng.normal(0.0, sigmas)
    beyond = 0
    for error, sigma in zip(errors.tolist(), sigmas.tolist(), strict=True):
        sides = [summary(heading={"error_deg": e, "standard_error_deg": s}) for e, s in zip(error, sigma, strict=True)]
        beyond += bool({one.name: one for one in deltas_of(*sides)}["heading.error_deg"].is_significant)
    assert 0.04 < beyond / len(errors) < 0.06  # 95 % of binomials lie within 0.043 and 0.057


def test_odd_summaries_are_compared_as_far_as_they_go() -> None:
    odd: dict[str, Any] = {
        "results": {"heading": {"error_deg": "?", "gates": [1, None], "segments": "none", "x": [[]], "y": {"": None}}}
    }
    assert deltas_of({}, {}) == (Delta("status", "", "", is_main=True),)
    assert deltas_of(odd, summary(heading={"error_deg": 1.0}))[-1] == Delta("heading.error_deg", "?", 1.0, is_main=True)


def test_a_setting_and_its_effect_are_told(folders: dict[str, Path]) -> None:
    comparison = compared(folders["good"], folders["faster"])
    assert [(pair.name, pair.a, pair.b) for pair in comparison.settings] == [("heading.taxi_speed_min_mps", 6.0, 8.0)]
    found = by_name(comparison)
    before, after = (load(folders[name]).summary["results"]["heading"] for name in ("good", "faster"))
    assert found["heading.samples"].delta == after["samples"] - before["samples"] < 0
    error = found["heading.error_deg"]
    assert error.delta == pytest.approx(after["error_deg"] - before["error_deg"])
    assert error.sigma == pytest.approx(np.hypot(before["standard_error_deg"], after["standard_error_deg"]), abs=1e-9)
    assert comparison.is_same_log and comparison.alignment.event == "utc" and comparison.alignment.offset_s == 0.0
    assert comparison.cause == "the settings"


def test_findings_and_reasons_of_one_alone(folders: dict[str, Path]) -> None:
    comparison = compared(folders["good"], folders["notime"])
    texts = " ".join(finding.text for finding in (*comparison.findings_a, *comparison.findings_b))
    mirrored = compared(folders["notime"], folders["good"])
    assert (mirrored.findings_a, mirrored.findings_b) == (comparison.findings_b, comparison.findings_a)
    assert texts and not comparison.is_same_log
    assert not compared(folders["good"], folders["good"]).findings_a


# ---------------------------------------------------------------------------------------------------- alignment


def test_first_movement_and_lift_off_align_the_same_manoeuvre(folders: dict[str, Path]) -> None:
    """The second flight waits longer before it taxis; its truth is otherwise that of the first."""
    comparison = compared(folders["good"], folders["later"])
    assert comparison.alignment.event == "first-movement"
    for event in ("first-movement", "lift-off"):
        offset_s = compared(folders["good"], folders["later"], event).alignment.offset_s
        assert offset_s == pytest.approx(-LATER_S, abs=GRID_S), event


def test_a_part_is_known_for_the_flight_it_was_cut_from(folders: dict[str, Path]) -> None:
    comparison = compared(folders["good"], folders["part"])
    assert comparison.is_same_log and comparison.cause == "the parts they hold and the settings"
    assert comparison.alignment.event == "utc" and comparison.alignment.offset_s == pytest.approx(30.0)
    assert compared(folders["good"], folders["part"], "start").alignment.offset_s == pytest.approx(30.0)


def test_an_event_that_is_missing_is_one_line_with_what_there_is(folders: dict[str, Path]) -> None:
    with pytest.raises(UsageError, match=r"no lift-off, expected one of start .*first-movement .*utc"):
        compare(folders["good"], folders["short"], "lift-off")
    with pytest.raises(UsageError, match="no utc"):
        compare(folders["notime"], folders["good"], "utc")
    code, out, err = groundstation("compare", str(folders["good"]), str(folders["short"]), "--align", "lift-off")
    assert (code, out) == (2, "") and err.count("\n") == 1


def lanes(**columns: Any) -> FigureData:
    return FigureData("x", {name: np.array(values) for name, values in columns.items()}, {})


def saved_with(figures: dict[str, FigureData], inertial: InertialResult | None = None) -> SavedFlight:
    document = summary_of(replace(make_results(make_flight()), answers=by_analysis(inertial), figures=()))
    return SavedFlight(Path("x"), document, Manifest(), figures, systems().answer_types)


@pytest.mark.parametrize(
    ("phases", "expected"),
    [
        (["standstill", "taxi", "take-off run", "airborne"], {"start": 0.0, "first-movement": 10.0, "lift-off": 30.0}),
        (["taxi", "standstill", "taxi"], {"start": 0.0}),
        (["standstill", "unknown", "taxi", "airborne"], {"start": 0.0, "lift-off": 30.0}),
        (["airborne", "landing roll"], {"start": 0.0}),
        (["unknown", "airborne"], {"start": 0.0}),
        (["standstill"], {"start": 0.0}),
    ],
)
def test_events_that_a_log_did_not_see_are_none(phases: list[str], expected: dict[str, float]) -> None:
    start_s = 10.0 * np.arange(len(phases))
    figures = {"phases": lanes(start_s=start_s, end_s=start_s + 10.0, phase=phases)}
    assert events_of(saved_with(figures)) == expected


def test_an_outage_is_the_first_interval_without_gnss() -> None:
    ends_s = {"ins": 40.0, "gnss": 90.0}
    outages = tuple(RealOutage(start_s, start_s + 5.0, 5.0, None, None, name) for name, start_s in ends_s.items())
    inertial = replace(inertial_result(), outages=outages)
    figures = {
        "gnss_lanes": lanes(start_s=[0.0, 95.0, 99.0], end_s=[95.0, 99.0, 120.0], state=["good", "no GNSS", "good"])
    }
    assert events_of(saved_with({}, inertial))["outage"] == 90.0
    assert events_of(saved_with(figures))["outage"] == 95.0
    other = saved_with(figures, inertial)
    assert align(other, saved_with(figures), "outage", is_same_log=False).offset_s == -5.0


def test_a_reference_that_judges_nothing_is_not_compared() -> None:
    for is_judge in (True, False):
        summary = {"results": {"reference": {"is_judge": is_judge, "offset_s": 1.0}}}
        assert any(one.name.startswith("reference.") for one in deltas_of(summary, summary)) == is_judge


def test_two_flights_are_not_compared_by_their_stands_and_come_to_a_conclusion(folders: dict[str, Path]) -> None:
    one, two = compared(folders["good"], folders["faster"]), compared(folders["good"], folders["later"])
    assert "heading.parking_heading_deg" in by_name(one)
    assert not [name for name in by_name(two) if "parking" in name and name.endswith("heading_deg")]
    text = conclusion(two).text
    judged = [delta for delta in two.shown if delta.is_significant is not None]
    assert judged and f"{len(judged)} answers with a σ" in text
    for delta in two.shown:
        assert (plain_name(delta) in text) >= bool(delta.is_significant and sum(map(_beyond, two.shown)) <= 4)
    code, out, _ = groundstation("compare", str(folders["good"]), str(folders["later"]))
    assert code == 0 and "Conclusion: " in out
    same = compared(folders["good"], folders["good"])
    assert conclusion(same).text == "Conclusion: Both gave the same answers."


def _beyond(delta: Delta) -> bool:
    return bool(delta.is_significant)


def test_names_are_plain_and_landing_and_health_are_compared(tmp_path: Path) -> None:
    told = make_results(make_flight(240.0, 20.0)).answers
    for name, verdict in (("a", "pass"), ("b", "fail")):
        health = AutopilotHealth(verdict, "", "PX4", "flight", "", 100.0, ())  # type: ignore[arg-type]
        saved_example(tmp_path / name, answers={**told, "health": health, "landing": LandingResult(())})
    a, b = (load(tmp_path / name) for name in "ab")
    comparison = compared(tmp_path / "a", tmp_path / "b")
    titles = [plain_name(delta) for delta in comparison.shown]
    assert "Heading: error, °" in titles and not [title for title in titles if "_" in title.partition(" (")[0]]
    assert "Approaches: approaches found" in titles
    text = "Autopilot health: worst of the checks: pass in A, fail in B."
    assert conclusion(comparison).text.endswith(text) and conclusion(comparison).tone == "warn"
    shown = comparison_text(comparison)
    assert "\nHeading: error, °" in shown and "heading.error_deg" not in shown, "the terminal has the page's names"
    assert "heading.error_deg" not in re.sub("<svg.*?</svg>", "", comparison_html(comparison, a, b), flags=re.DOTALL)


def test_differences_are_drawn_at_the_same_time(folders: dict[str, Path]) -> None:
    whole, part = load(folders["good"]), load(folders["part"])
    sides = sides_of(compared(folders["good"], folders["part"]), whole, part)
    plot = COMPARED["overview-heading_deg-difference"](sides)
    assert plot is not None and plot.title == "INS heading, B − A"
    curve = plot.rows[0].panels[0].marks[-1]
    assert isinstance(curve, Curve)
    known = np.isfinite(curve.y)
    assert known.sum() > 100 and np.abs(curve.y[known]).max() < 0.5 and curve.x[known].min() >= 30.0
    lone = sides_of(compared(folders["good"], folders["good"]), whole, whole)
    same = COMPARED["overview-altitude_m-difference"](lone)
    assert same is not None
    flat = same.rows[0].panels[0].marks[-1]
    assert isinstance(flat, Curve) and np.isfinite(flat.y).any() and not np.nan_to_num(flat.y).any()


def test_a_reference_that_judges_nothing_judges_nothing() -> None:
    errors = [{"quantity": "position", "rms_m": 2.0}]
    judge, none = (summary(reference={"is_judge": one, "errors": errors}) for one in (True, False))
    assert "reference.errors.position.rms_m" in {delta.name for delta in deltas_of(judge, judge)}
    for sides in ((none, none), (judge, none), (none, judge)):
        assert not [delta.name for delta in deltas_of(*sides) if delta.name.startswith("reference.")]


# ---------------------------------------------------------------------------------------------------- files


def test_the_recording_holds_both_on_the_clock_of_a(folders: dict[str, Path], tmp_path: Path) -> None:
    comparison = compare_to(folders["good"], folders["later"], tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"compare.html", "compare.csv", "compare.rrd"}
    contents = Contents(tmp_path / "out" / "compare.rrd")
    assert contents.timelines == {"flight_time"}, "the clock of B is moved: it is no UTC"
    for entity, name, offset_s in zip(SPEEDS, ("good", "later"), (0.0, comparison.alignment.offset_s), strict=True):
        figure = load(folders[name]).figures["overview"]
        time_ns, values = contents.scalars(entity)
        known = np.isfinite(values[:, 0])
        expected = np.isfinite(figure["ground_speed_mps"])
        assert np.array_equal(values[known, 0], figure["ground_speed_mps"][expected])
        assert np.abs(time_ns[known] / 1e9 - figure["time_s"][expected] - offset_s).max() < 1e-6
    speeds = [contents.scalars(entity) for entity in SPEEDS]
    grid_ns = np.arange(70, 240) * 10**9
    a, b = (np.interp(grid_ns, time_ns, values[:, 0]) for time_ns, values in speeds)
    assert np.sqrt(np.mean((a - b) ** 2)) < 0.5, "the same taxi does not lie over itself"


def test_runs_of_one_log_keep_utc(folders: dict[str, Path], tmp_path: Path) -> None:
    compare_to(folders["good"], folders["part"], tmp_path / "out")
    contents = Contents(tmp_path / "out" / "compare.rrd")
    assert contents.timelines == {"flight_time", "utc"}
    batch = contents.batches[SPEEDS[1]][0]
    flight_ns, utc_ns = (np.asarray(batch.column(name).cast(pa.int64())) for name in ("flight_time", "utc"))
    assert flight_ns[0] == 30 * 10**9
    assert (utc_ns - flight_ns == 1_777_874_400_000_000_000).all()  # 2026-05-04T06:00:00Z
    assert "clock of B" in contents.text("/comparison")


def test_every_figure_of_every_analysis_is_laid_over(tmp_path: Path) -> None:
    a, b = saved_example(tmp_path / "a"), saved_example(tmp_path / "b")
    comparison = compare_to(tmp_path / "a", tmp_path / "b", tmp_path / "out", "start")
    contents = Contents(tmp_path / "out" / "compare.rrd")
    both = [
        *(f"/comparison/phases/{letter}" for letter in "AB"),
        *(f"/comparison/tracks/north/02_told/{n}" for n in "01"),
    ]
    assert set(both) <= set(contents.batches)
    drawn = {entity.split("/")[2] for entity in {*contents.batches, *contents.fixed} if entity.count("/") > 2}
    assert drawn >= {name for name, tell in OVER_EACH_OTHER.items() if tell(sides_of(comparison, a, b)) is not None}
    assert len(drawn) > 10
    html = comparison_html(comparison, a, b)
    for title in ("Tracks", "Altitude", "Heading error, running mean", "North position error", "Forecast"):
        assert f"<h3>{title}</h3>" in html


def test_every_figure_of_the_page_has_its_place_in_the_recording() -> None:
    rows = (*OVER_TIME, *(row for one in systems().compared for row in one.rows))
    assert {"tracks", *(name for row in rows for name in row)} == set(OVER_EACH_OTHER)


def test_each_line_of_the_recording_has_its_band_and_its_values(tmp_path: Path) -> None:
    saved_example(tmp_path / "a"), saved_example(tmp_path / "b")
    compare_to(tmp_path / "a", tmp_path / "b", tmp_path / "out", "start")
    contents = Contents(tmp_path / "out" / "compare.rrd")
    states = load(tmp_path / "a").rows_of(InertialStates)
    assert states is not None
    for place in range(2):
        _, middle, half = contents.band(
            f"/comparison/inertial_states-east_velocity_mps/east_velocity_error/c0{place}_band"
        )
        known = np.isfinite(middle)
        assert np.array_equal(middle[known], states.east.velocity_mps)
        assert half[known] == pytest.approx(NORMAL_95 * states.east.velocity_sigma_mps)


def test_the_page_is_whole_and_says_what_differs(folders: dict[str, Path], tmp_path: Path) -> None:
    comparison, *saved = compare(folders["good"], folders["faster"])
    html = comparison_html(comparison, *saved)
    assert html == comparison_html(comparison, *saved)
    assert "heading.taxi_speed_min_mps" in html and "Both come from one log: they share its noise" in html
    assert (
        re.findall(r'(?:src|href)="(?!#|compare\.csv)[^"]*"', re.sub(r"<svg.*?</svg>", "", html, flags=re.DOTALL)) == []
    )
    assert "<script" not in html


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    name = "<script>alert(1)</script>\x1b[2J"
    a = saved_example(tmp_path / "a", metadata={"aircraft": name, "flight": "=1+1"})
    b = saved_example(tmp_path / "b", flight_id=name)
    comparison = compare(tmp_path / "a", tmp_path / "b", "start")[0]
    html = comparison_html(comparison, a, b)
    assert "<script" not in html and "&lt;script&gt;" in html
    write_comparison(tmp_path / "x.rrd", comparison, a, b)
    assert re.search(r"(?<!\\)<", Contents(tmp_path / "x.rrd").text("/comparison")) is None
    code, out, err = groundstation("compare", str(tmp_path / "a"), str(tmp_path / "b"), "--align", "start")
    assert (code, err) == (0, "") and "\x1b" not in out


def test_flights_that_have_little_are_compared(tmp_path: Path) -> None:
    """A log of one topic and one without positions: no figure, no phase, no answer in common."""
    for name, column in (("a", "baro.pressure_altitude_m"), ("b", "ins.roll_deg")):
        rows = "".join(f"{second},{second}\n" for second in range(3))
        (tmp_path / f"{name}.csv").write_text(f"time_s,{column}\n{rows}", encoding="utf-8")
    a, b = (ran(tmp_path / f"{name}.csv", tmp_path / "out") for name in "ab")
    comparison = compare_to(a, b, tmp_path / "compared")
    assert comparison.alignment.event == "start"
    assert by_name(comparison)["flight.duration_s"].delta == 0.0
    assert (tmp_path / "compared" / "compare.html").stat().st_size > 1000


# ---------------------------------------------------------------------------------------------------- the verb


def test_the_verb_prints_a_table_or_json_and_writes_nothing(folders: dict[str, Path]) -> None:
    arguments = ["compare", str(folders["good"]), str(folders["later"])]
    code, text, err = groundstation(*arguments)
    assert (code, err) == (0, "")
    assert re.search(r"^Heading: error, ° +\S+ +\S+ +\S+ +\S+ +(within|beyond)$", text, re.MULTILINE)
    assert f"clock of B -{LATER_S:.1f}"[:15] in text
    code, text, _ = groundstation(*arguments, "--json")
    document = json.loads(text)
    (error,) = [one for one in document["deltas"] if one["name"] == "heading.error_deg"]
    assert code == 0 and error["delta"] == pytest.approx(error["b"] - error["a"], abs=1e-6)
    assert document["alignment"]["offset_s"] == pytest.approx(-LATER_S, abs=GRID_S)
    assert len(groundstation(*arguments, "-v")[1]) > len(groundstation(*arguments)[1])
    assert groundstation(*arguments, "-q") == (0, "", "")


def test_only_flight_folders_are_taken_and_nothing_is_overwritten(folders: dict[str, Path], tmp_path: Path) -> None:
    good, out = str(folders["good"]), tmp_path / "out"
    for other in (tmp_path / "none", tmp_path, SAMPLES / "taxi-good.csv"):
        code, _, err = groundstation("compare", good, str(other))
        assert code == 2 and err.count("\n") == 1
    assert groundstation("compare", good, good, "-o", str(out))[0] == 0
    assert groundstation("compare", good, good, "-o", str(out))[0] == 2
    assert groundstation("compare", good, good, "-o", str(out), "-f")[0] == 0
    assert groundstation("compare", good, good, "-o", good, "-f")[0] == 2
    for name in ("compare.csv", "compare.rrd"):
        (tmp_path / f"with {name}").mkdir()
        mine = tmp_path / f"with {name}" / name
        mine.write_text("mine", encoding="utf-8")
        assert groundstation("compare", good, good, "-o", str(mine.parent))[0] == 2
        assert mine.read_text(encoding="utf-8") == "mine"
        shutil.rmtree(mine.parent)
    flights = tmp_path / "flights"
    flights.mkdir()
    for name in ("index.json", "index.csv"):
        (flights / name).touch()
    assert groundstation("compare", good, good, "-o", str(flights), "-f")[0] == 2
    assert collect([tmp_path]) == (), "what groundstation made is no input"
    broken = tmp_path / "broken"
    shutil.copytree(folders["good"], broken)
    (broken / "summary.json").write_text("{", encoding="utf-8")
    code, _, err = groundstation("compare", good, str(broken))
    assert code == 1 and err.count("\n") == 1 and "Traceback" not in err


@pytest.mark.parametrize("forecast", [[], "none", 1.0])
def test_a_forecast_of_another_kind_is_refused(tmp_path: Path, forecast: Any) -> None:
    save(tmp_path / "a", make_results(make_flight()), Manifest())
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    summary = json.loads((tmp_path / "b" / "summary.json").read_text(encoding="utf-8"))
    summary["results"]["forecast"] = forecast
    (tmp_path / "b" / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    with pytest.raises(UnreadableLogError, match=r"b.summary\.json.*results\.forecast: found .*run the log again"):
        compare_to(tmp_path / "a", tmp_path / "b", tmp_path / "out")


@pytest.mark.viewer
@ALL_OR_SOME
def test_views_of_the_recording_draw_both(
    tmp_path: Path, headless_viewer: Callable[[Path], ViewerClient], is_every: bool
) -> None:
    a, b = saved_example(tmp_path / "a"), saved_example(tmp_path / "b")
    comparison = compare(tmp_path / "a", tmp_path / "b", "start")[0]
    write_comparison(tmp_path / "x.rrd", comparison, a, b)
    client = headless_viewer(tmp_path / "x.rrd")
    drawn = {
        view.name: drawn_in(client, view.view_id, colourful, LEAST_PIXELS)
        for _, views in pages(client, at_rest=False)
        for view in chosen([view for view in views if view.view_class != "TextDocument"], is_every)
    }
    assert [name for name, pixels in drawn.items() if pixels <= LEAST_PIXELS] == []
    state = client.get_state()
    assert {view.name: view.reports for view in state.views if view.reports} == {}
    assert len(drawn) > 3
    assert not is_every or drawn.keys() == {view.name for view in state.views if view.view_class != "TextDocument"}
