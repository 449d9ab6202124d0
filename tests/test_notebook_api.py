"""The Python API: lazy, the same for a log and a flight folder, one line for every error."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
import pandas as pd
import pytest

import groundstation
from groundstation.base.errors import GroundstationError, NotAssessableError, UnreadableLogError, UsageError
from groundstation.chapters.parts import Figure
from groundstation.pipeline import notebook
from groundstation.pipeline.api import OpenLog, SavedRun
from groundstation.pipeline.verbs.clip import Wanted, clip
from groundstation.reports.notebook.plots import name_of
from groundstation.results.files import SavedFlight, save
from groundstation.results.flight import FlightResults
from groundstation.results.manifest import Manifest
from groundstation.results.summary import summary_of
from groundstation.systems import systems
from groundstation.viewer import inline
from tests import report_example
from tests.saved import load
from tests.systems.inertial import example as inertial_example
from tests.told import PLOTS

ROOT = Path(__file__).parents[1]
SAMPLES = ROOT / "sample_logs"
GOOD = SAMPLES / "taxi-good.csv"
ROUNDED_DEG = 5e-5  # summary.json has four decimals of a degree
NAMES = (
    "series difference density convergence taxi forest spectrum components mean-speed growth calibration map-hindcast "
    "inertial inertial-tilt inertial-radial inertial-innovations inertial-observability inertial-differences "
    "inertial-own-innovations landing-beacons landing-space landing-accuracy landing-trials latency-search together "
    "magnetic-deviation magnetic-held-out magnetic-track magnetic-branches magnetic-modulus magnetic-ground "
    "magnetic-flux-legs magnetic-flux-turns "
    "landing-deviations landing-final landing-motion landing-protection landing-runway "
    "map profile attitude states gaps reference reference-track reference-claims "
    "cooperative-map cooperative-errors cooperative-geometry cooperative-links "
    "control-paths control-measures control-law placement-map placement-accuracy "
    "units-errors units-pairs units-radial causes-along causes-velocity "
    "gnss-states gnss-quality gnss-standstill gnss-steps gnss-pair health-lanes health-motors health-panels "
    "trajectory-attitude trajectory-biases trajectory-map trajectory-onboard-attitude trajectory-onboard-motion "
    "trajectory-outages trajectory-residuals trajectory-separation trajectory-sigmas"
)


@pytest.fixture(scope="module")
def flight() -> OpenLog:
    opened = groundstation.open(GOOD)
    assert isinstance(opened, OpenLog)
    return opened


@pytest.fixture(scope="module")
def folder(flight: OpenLog, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flight.save(tmp_path_factory.mktemp("saved") / "out").folder


def test_import_is_light_and_the_names_are_there() -> None:
    code = (
        "import sys, groundstation\n"
        "print([name for name in sys.modules if name.startswith('groundstation.')], 'numpy' in sys.modules)\n"
        "print(set(groundstation.__all__) <= set(dir(groundstation)))\n"
        "print([name for name in groundstation.__all__ if not hasattr(groundstation, name)])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[] False", "True", "[]"]


def test_opening_and_the_ledger_need_neither_rerun_nor_matplotlib() -> None:
    code = (
        "import sys, groundstation\n"
        f"flight = groundstation.open({str(GOOD)!r})\n"
        "assert flight.info and flight.ledger and flight.clock and len(flight.tables['ins'])\n"
        "heavy = ('rerun', 'matplotlib', 'typst', 'IPython', 'groundstation.systems.inertial.filter')\n"
        "print([name for name in heavy if name in sys.modules], 'results' in vars(flight))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[] False"]


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        _ = groundstation.opne


def test_the_page_names_what_there_is() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`groundstation\.(\w+)", text))
    assert named == set(groundstation.__all__) - {"__version__"}
    _, _, about = text.partition("## An open flight")
    cells = [line.split("|")[1] for line in about.splitlines() if line.startswith("| `")]
    members = {name for cell in cells for name in re.findall(r"`(\w+)", cell)}
    public = {name for name in (*dir(OpenLog), *dir(SavedRun)) if not name.startswith("_")}
    only_made = {"configuration", "folder", "saved"}
    assert members == public | only_made | {"to_xarray"}


def test_a_log_is_described_without_an_estimate() -> None:
    opened = groundstation.open(str(GOOD))
    assert opened.info["format"] == "flat-csv" and opened.info["aircraft"] == "SIM-1"
    assert opened.ledger.topics["ins"].rows == len(opened.tables["ins"])
    assert opened.clock and opened.source.name == "taxi-good.csv"
    assert "results" not in vars(opened)
    assert repr(opened) == "<OpenLog taxi-good.csv (flat-csv)>"


def test_tables_are_indexed_by_utc_and_by_flight_time(flight: OpenLog) -> None:
    table = flight.tables["ins"]
    frame, since = table.to_frame(), table.to_frame("flight_time")
    assert isinstance(frame.index, pd.DatetimeIndex) and str(frame.index.tz) == "UTC"
    assert frame.index.as_unit("ns").asi8.tolist() == table.time_ns.tolist()
    assert isinstance(since.index, pd.TimedeltaIndex)
    assert np.allclose(since.index.total_seconds(), flight.flight.time_s("ins"), atol=1e-9, rtol=0.0)
    assert frame.attrs["units"]["true_heading_deg"] == since.attrs["units"]["true_heading_deg"] == "deg"
    assert table.take(slice(3, 5)).to_frame().index.equals(frame.index[3:5])


def test_tables_are_subscripted_and_short_when_printed(flight: OpenLog) -> None:
    ins = flight.tables["ins"]
    assert np.array_equal(ins["roll_deg"], ins.values("roll_deg"), equal_nan=True)
    assert ins.utc.dtype == "datetime64[ns]" and ins.utc.astype(np.int64).tolist() == ins.time_ns.tolist()
    assert np.allclose(ins.flight_time_s, flight.flight.time_s("ins"), atol=0.0, rtol=0.0)
    assert repr(ins).startswith(f"<TimedTable ins: {len(ins)} rows of ") and len(repr(ins)) < 400
    for shown in (flight.tables, flight.flight, flight.results, ins.columns["roll_deg"]):
        assert len(repr(shown)) < 400, shown
    assert f"ins ({len(ins)})" in repr(flight.tables)


def test_an_unknown_name_is_told_with_those_near_to_it(flight: OpenLog) -> None:
    for ask in (lambda: flight.tables["ins"]["roll"], lambda: flight.tables["ins"].values("roll")):
        with pytest.raises(UsageError, match=r"^table ins: found no .roll., expected (one of )?roll_deg"):
            ask()
    for ask in (lambda: flight.tables["gns"], lambda: flight.flight["gns"]):
        with pytest.raises(UsageError, match="found no 'gns', expected gnss"):
            ask()
    assert np.isnan(flight.tables["gnss"].values("gdop")).all() == ("gdop" not in flight.tables["gnss"])
    with pytest.raises(UsageError, match="found no 'rate_x_dps'"):
        _ = flight.tables["gnss"]["rate_x_dps"]
    assert flight.tables.get("gns") is None
    with pytest.raises(UsageError, match="found no 'heading_sample', expected heading_samples"):
        flight.results.to_frame("heading_sample")


def test_arrays_have_utc_beside_flight_seconds(flight: OpenLog) -> None:
    samples = flight.results.to_frame("heading_samples")
    start_ns = flight.results.start_utc_ns
    assert start_ns is not None and str(samples["utc"].dt.tz) == "UTC"
    since_s = (samples["utc"] - pd.Timestamp(start_ns, tz="UTC")).dt.total_seconds()
    assert np.allclose(since_s, samples["time_s"], atol=1e-6, rtol=0.0)
    phases = flight.results.to_frame("phases")
    assert phases.columns[:2].tolist() == ["start_utc", "end_utc"]


def test_without_utc_tables_are_indexed_by_flight_time() -> None:
    table = groundstation.open(SAMPLES / "taxi-notime.csv").tables["ins"]
    assert isinstance(table.to_frame().index, pd.TimedeltaIndex)
    with pytest.raises(NotAssessableError, match="no UTC"):
        table.to_frame("utc")


def test_results_are_frames(flight: OpenLog) -> None:
    heading = flight.heading()
    gates = heading.to_frame()
    assert gates.equals(heading.to_frame("gates")) and gates["name"].tolist() == [gate.name for gate in heading.gates]
    assert gates["value"].dtype == np.float64
    assert flight.results.to_frame()["code"].tolist() == [finding.code for finding in flight.results.findings]
    samples = flight.results.to_frame("heading_samples")
    assert int(samples["is_used"].sum()) == heading.samples
    for results in (heading, flight.results):
        for name in results.table_names():
            assert len(results.to_frame(name).columns), name
        with pytest.raises(UsageError, match="one of "):
            results.to_frame("nonsense")


def test_states_of_both_channels_are_one_frame() -> None:
    result = inertial_example.inertial_result()
    frame = result.to_frame()
    assert frame["channel"].unique().tolist() == ["north", "east"]
    assert frame["sigma"].tolist() == [state.sigma for channel in result.channels for state in channel.states]
    assert "states" not in result.to_frame("channels")


def test_an_analysis_that_did_not_run_says_why(flight: OpenLog) -> None:
    for ask in (flight.inertial, flight.forecast):
        with pytest.raises(NotAssessableError, match="no INS position in the log"):
            ask()


def test_every_figure_of_the_report_can_be_had(flight: OpenLog) -> None:
    assert {"density", "map", "gaps"} <= set(flight.figures)
    for name in flight.figures:
        figure = flight.figure(name)
        assert isinstance(figure, matplotlib.figure.Figure) and figure.axes
    shown = flight.figure("heading_distribution")
    assert shown._repr_png_().startswith(b"\x89PNG")
    assert shown.axes[0].get_xlabel() == flight.figure("density").axes[0].get_xlabel()
    with pytest.raises(UsageError, match="one of map, profile, attitude"):
        flight.figure("nonsense")


def test_names_of_figures_are_those_that_scripts_rely_on() -> None:
    assert sorted(name_of(Figure(name), systems()) for name in PLOTS) == sorted(NAMES.split())
    assert name_of(Figure("reference.errors", "gnss position"), systems()) == "reference-gnss-position"


def test_matplotlib_comes_with_the_first_figure_and_never_pyplot(folder: Path) -> None:
    code = (
        "import sys, groundstation\n"
        f"flight = groundstation.open({str(folder)!r})\n"
        "flight.heading(), flight.results.to_frame('heading_samples'), flight.figures\n"
        "print('matplotlib' in sys.modules)\n"
        "flight.figure('density')._repr_png_()\n"
        "print('matplotlib' in sys.modules, 'matplotlib.pyplot' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False", "True False"]


def test_a_figure_may_be_changed_and_saved(flight: OpenLog, tmp_path: Path) -> None:
    figure = flight.figure("density")
    before = figure._repr_png_()
    figure.axes[0].set_xlim(-5.0, 5.0)
    assert figure._repr_png_() != before and flight.figure("density")._repr_png_() == before
    for ending, start in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        figure.savefig(tmp_path / f"density{ending}")
        assert (tmp_path / f"density{ending}").read_bytes().startswith(start)


def test_a_setting_changes_the_answer_and_not_the_flight(flight: OpenLog) -> None:
    shorter = flight.with_settings(heading={"taxi_speed_min_mps": 10.0})
    assert shorter.flight is flight.flight
    assert shorter.heading().taxi_seconds < flight.heading().taxi_seconds
    assert shorter.configuration.tables["heading"] == {"taxi_speed_min_mps": 10.0}
    again = shorter.with_settings(heading={"taxi_speed_min_mps": 6.0}, exclude=[{"from": 0, "to": 1}])
    assert again.heading().error_deg == flight.heading().error_deg
    assert again.configuration.exclude[0].end == "1"
    same = groundstation.open(GOOD, config={"heading": {"taxi_speed_min_mps": 10.0}})
    assert same.heading().error_deg == shorter.heading().error_deg


def test_other_thresholds_count_the_log_anew(flight: OpenLog) -> None:
    stricter = flight.with_settings(thresholds={"version": 1, "gaps": {"periods": 1.01}})
    assert stricter.ledger.thresholds != flight.ledger.thresholds


def test_a_flight_folder_answers_as_the_log_does(flight: OpenLog, folder: Path) -> None:
    saved = groundstation.open(folder)
    assert saved.info == flight.info
    assert saved.heading().verdict == flight.heading().verdict
    assert saved.heading().error_deg == pytest.approx(flight.heading().error_deg, abs=ROUNDED_DEG)
    assert saved.heading().gates[0].name == flight.heading().gates[0].name
    assert saved.results.table_names() == tuple(sorted_figures(flight.results.table_names()))
    assert list(saved.figures) == list(flight.figures)
    assert saved._repr_html_() == flight._repr_html_()
    for topic, table in flight.tables.items():
        pd.testing.assert_frame_equal(saved.tables[topic].to_frame(), table.to_frame())
    assert saved.with_settings().heading().error_deg == flight.heading().error_deg


def sorted_figures(names: tuple[str, ...]) -> list[str]:
    """Table names as a folder has them: its arrays in the order of their files."""
    return [*names[:2], *sorted(names[2:])]


@pytest.mark.slow
def test_settings_of_a_run_come_back_with_its_folder(tmp_path: Path) -> None:
    opened = groundstation.open(GOOD, config={"heading": {"taxi_speed_min_mps": 10.0}})
    assert isinstance(opened, OpenLog)
    saved = opened.save(tmp_path / "out")
    again = saved.with_settings(exclude=[{"from": 0, "to": 1, "reason": "towed"}])
    assert again.configuration.tables["heading"] == {"taxi_speed_min_mps": 10.0}
    assert again.configuration.exclude[0].reason == "towed"


def results_of_everything() -> FlightResults:
    inertial, forecast = inertial_example.inertial_result(), inertial_example.forecast_result()
    return report_example.example(inertial, forecast)


@pytest.mark.parametrize("make", [report_example.example, results_of_everything])
def test_saved_results_are_restored_as_they_were(make: Callable[[], FlightResults], tmp_path: Path) -> None:
    results = make()
    save(tmp_path / "flight", results, Manifest())
    saved = load(tmp_path / "flight")
    again = saved.results
    assert summary_of(again) == saved.summary
    assert {figure.name for figure in again.figures} == {figure.name for figure in results.figures}
    assert list(again.answers) == list(results.answers)


def test_a_summary_that_lacks_something_is_one_line(folder: Path) -> None:
    saved = load(folder)
    for spoil in (
        {"results": None},
        {"status": 3},
        {"flight": {}},
        {"results": {"heading": {"verdict": "accept"}}},
        {"results": {"heading": {**saved.summary["results"]["heading"], "error_deg": "much"}}},
        {"results": {"inertial": 7}},
        {"findings": [{"severity": "info"}]},
    ):
        with pytest.raises(UnreadableLogError, match="run the log again"):
            assert SavedFlight(folder, {**saved.summary, **spoil}, Manifest(), {}, systems().answer_types).results


def test_the_card_shows_no_markup_of_a_log(tmp_path: Path) -> None:
    hostile = tmp_path / "hostile.csv"
    text = GOOD.read_text(encoding="utf-8").replace("aircraft: SIM-1", "aircraft: <script>alert(1)</script>")
    hostile.write_text(text, encoding="utf-8")
    card = groundstation.open(hostile)._repr_html_()
    assert "<script>" not in card and "&lt;script&gt;" in card
    assert "Accept" in card and "ins (3043)" in card


def test_what_cannot_be_opened_is_one_line(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "empty.csv").touch()
    (tmp_path / "one.csv").write_text("time_s,ins.true_heading_deg\n0,nan\n", encoding="utf-8")
    for path in (tmp_path / "none.csv", tmp_path, tmp_path / "empty.csv", folder.parent):
        with pytest.raises(GroundstationError) as told:
            groundstation.open(path)
        assert str(told.value).count("\n") == 0
    with pytest.raises(UsageError, match="with_settings"):
        groundstation.open(folder, config={"heading": {}})
    one = groundstation.open(tmp_path / "one.csv")
    assert len(one.tables["ins"].to_frame()) == 1
    with pytest.raises(NotAssessableError):
        one.heading()
    assert "Recorded" in one._repr_html_()


@pytest.mark.parametrize(
    "wrong",
    [
        {"config": {"nonsense": {}}},
        {"config": {"heading": {"taxi_speed_min_mps": "fast"}}},
        {"config": {"heading": 3}},
        {"config": "none.toml"},
        {"aircraft": {"nonsense": 1}},
        {"intervals": {"exclude": [{"from": 1}]}},
        {"profile": "none.toml"},
    ],
)
def test_a_wrong_setting_is_told_on_opening(wrong: dict[str, Any]) -> None:
    with pytest.raises(GroundstationError):
        groundstation.open(GOOD, **wrong)


def test_a_notebook_shows_the_line_of_an_error_alone() -> None:
    error = GroundstationError("a.csv", "nothing")
    assert error._render_traceback_() == ["GroundstationError: a.csv: nothing"]


def test_a_folder_without_its_mcap_still_has_its_answers(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    next(copy.glob("*.mcap")).unlink()
    saved = groundstation.open(copy)
    assert saved.heading().verdict == "accept" and saved.figures and "Accept" in saved._repr_html_()
    with pytest.raises(UsageError, match="0 files"):
        _ = saved.tables


def test_a_part_beside_the_flight_is_not_taken_for_it(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / folder.name
    shutil.copytree(folder, copy)
    clip(copy, copy / "part.mcap", Wanted("60", "90"))
    assert set(groundstation.open(copy).tables) == set(groundstation.open(folder).tables)
    assert len(groundstation.open(copy).tables["ins"]) == len(groundstation.open(folder).tables["ins"])


@pytest.mark.parametrize(
    ("ledger", "place"),
    [({"topics": True}, "ledger.topics"), ({"topics": {"ins": 1}}, "ledger.topics.ins"), (True, "ledger")],
)
def test_an_odd_ledger_is_named_with_its_place(folder: Path, tmp_path: Path, ledger: object, place: str) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    summary = json.loads((copy / "summary.json").read_text(encoding="utf-8"))
    (copy / "summary.json").write_text(json.dumps(summary | {"ledger": ledger}), encoding="utf-8")
    with pytest.raises(UnreadableLogError, match=rf"summary\.json: .*\({place}: found .*, expected an object\)"):
        groundstation.open(copy)._repr_html_()


def test_a_broken_folder_is_one_line(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    (copy / "summary.json").write_text("{", encoding="utf-8")
    with pytest.raises(UnreadableLogError):
        groundstation.open(copy)


def test_a_log_that_cannot_be_saved_is_one_line(flight: OpenLog, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(GroundstationError, match="a file"):
        flight.save(tmp_path / "file")
    (tmp_path / "strange").mkdir()
    (tmp_path / "strange" / "thing").touch()
    with pytest.raises(GroundstationError, match="did not make"):
        flight.save(tmp_path / "strange")


def test_the_recording_is_a_file_and_a_window(flight: OpenLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.viewer import launch

    assert flight.recording(tmp_path / "a.rrd").read_bytes()[:3] == b"RRF"
    seen: list[bytes] = []
    monkeypatch.setattr(launch, "open_viewer", lambda path: (seen.append(path.read_bytes()[:3]), len(seen) - 1)[1])
    assert flight.show() is None  # no notebook: the viewer's window
    assert seen == [b"RRF"]
    with pytest.raises(GroundstationError, match="ended with code 1"):
        flight.show(inline=False)
    with pytest.raises(GroundstationError):
        flight.recording(tmp_path / "none" / "a.rrd")


def test_without_the_extra_show_says_what_to_install(flight: OpenLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inline.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(GroundstationError, match=re.escape("groundstation[notebook]")):
        flight.show(inline=True)


def test_without_the_extra_a_figure_says_what_to_install(flight: OpenLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=re.escape("no package matplotlib: pip install 'groundstation[notebook]'")):
        flight.figure("density")


def test_a_fleet_is_a_frame(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="folder of flights"):
        groundstation.open_fleet(tmp_path)
    frame = pd.DataFrame({"flight_id": ["a", "b"], "error_deg": [1.0, np.nan]})
    frame.to_parquet(tmp_path / "fleet.parquet")
    pd.testing.assert_frame_equal(groundstation.open_fleet(tmp_path), frame)
    (tmp_path / "fleet.parquet").write_bytes(b"PAR1")
    with pytest.raises(GroundstationError, match="run the logs again"):
        groundstation.open_fleet(tmp_path)


def test_results_show_their_numbers_and_not_their_arrays(flight: OpenLog) -> None:
    shown = flight.heading()._repr_html_()
    assert "correction_deg" in shown and "-1.2" in shown and flight.heading().gates[0].title not in shown
    assert repr(flight.results.figure("heading_normal")).startswith("<FigureData heading_normal: ")
    hostile = replace(flight.heading(), verdict_reason="<b>")._repr_html_()
    assert "<b>" not in hostile and "&lt;b&gt;" in hostile


def test_what_the_system_refuses_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("groundstation.pipeline.api.open_log", refuse)
    with pytest.raises(GroundstationError, match="Permission denied"):
        groundstation.open(GOOD)


def test_rows_of_an_empty_list_have_their_columns(flight: OpenLog) -> None:
    without = replace(flight.heading(), runway=())
    frame = without.to_frame("runway")
    assert len(frame) == 0 and "true_bearing_deg" in frame
