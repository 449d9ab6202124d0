"""Python API: a method for each system, lists as frames, the log's own facts, fleets that open flights."""

import inspect
import pickle
import re
import typing
from dataclasses import dataclass, is_dataclass, replace
from pathlib import Path
from types import UnionType
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest

import groundstation
from groundstation.base.errors import NotAssessableError, UnknownNameError, UsageError
from groundstation.pipeline.answer_methods import AnswerMethods
from groundstation.pipeline.api import OpenLog, SavedRun
from groundstation.pipeline.fleet_frame import Fleet
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.notebook import OpenFlight
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.frames import Tabular, tables_of
from groundstation.results.gates import Gate
from groundstation.systems import OURS, systems
from groundstation.systems.analysis import Analysis, Found
from groundstation.systems.landing.answer import Approach, LandingResult, StabilisedAt, StabilityLost
from groundstation.systems.landing.criteria_answer import Criterion, Place
from groundstation.systems.landing.runway_answer import RunwayUsed
from groundstation.systems.landing.touchdown_answer import SecondContact, Touchdown
from groundstation.systems.system import System, Systems
from groundstation.tables import table as table_module
from tests import report_example
from tests.readers.ulog_writer import UlogWriter
from tests.systems.inertial import example as inertial_example

ROOT = Path(__file__).parents[1]
GOOD, SHORT = ROOT / "sample_logs" / "taxi-good.csv", ROOT / "sample_logs" / "taxi-short.csv"
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
UNITS = re.compile(r"\b(unit|units|degrees|deg|metres|m|m/s|seconds|s|nmi/h|ppm|minutes)\b")
MOST_WORDS, MOST_LINES, MOST_CHARACTERS = 800, 4, 450


def methods() -> dict[str, type[Answer]]:
    """Methods of the answers, by what they return."""
    own = {name: one for name, one in vars(AnswerMethods).items() if inspect.isfunction(one) and name != "answer"}
    known = {kind.__name__: kind for kind in systems().answer_types.values()}
    return {name: known[one.__annotations__["return"]] for name, one in own.items() if not name.startswith("_")}


@pytest.fixture(scope="module")
def flight() -> OpenLog:
    opened = groundstation.open(GOOD)
    assert isinstance(opened, OpenLog)
    return opened


def landing() -> LandingResult:
    """Two approaches: one that lost a limit and landed, one that went around."""
    runway = RunwayUsed(
        name="06",
        placed_by="site file",
        latitude_deg=56.0,
        longitude_deg=37.0,
        true_course_deg=60.0,
        course_sigma_deg=0.1,
        elevation_m=None,
        glide_angle_deg=3.0,
        threshold_crossing_height_m=15.0,
        localizer_width_m=210.0,
        localizer_distance_m=3000.0,
    )
    touchdown = Touchdown(
        time_s=90.0,
        time_sigma_s=0.2,
        found_by="pitch",
        latitude_deg=56.0,
        longitude_deg=37.0,
        past_threshold_m=350.0,
        ground_speed_mps=None,
        sink_rate_mps=1.0,
        peak_load_g=None,
        rollout_course_deg=None,
        second_contacts=(SecondContact(91.0, 1.3, "load"),),
    )
    lost = StabilityLost(200.0, 50.0, "sink rate", False)
    gate = Gate("sink_rate", "sink rate", 6.0, 5.08, "m/s", "failed", True, "", "at_most")
    check = StabilisedAt(304.8, "not stabilised", 40.0, (gate,), lost=lost)
    criterion = Criterion(
        name="bank", state="not met", unit="deg", value=9.0, at_most=7.0, at=Place(60.0, 150.0, 2000.0)
    )
    common = {
        "final_length_m": 9000.0,
        "lowest_height_m": 0.0,
        "position_topic": "ins",
        "guidance_topic": "",
        "guidance_source": "",
        "height_source": "baro",
        "runway": runway,
        "established": None,
        "sensitivity": None,
        "position_errors": (),
        "protection": None,
        "claim": "",
    }
    first = Approach(
        number=1,
        outcome="landing",
        start_s=10.0,
        end_s=95.0,
        touchdown=touchdown,
        stabilised=(check,),
        criteria=(criterion,),
        **common,
    )
    second = Approach(
        number=2, outcome="go-around", start_s=200.0, end_s=300.0, touchdown=None, stabilised=(), **common
    )
    return LandingResult((first, second))


def test_every_system_has_its_method_and_every_answer_one() -> None:
    found = methods()
    ours = [one for one in systems().every if one.name in {path.split(".")[2] for path in OURS}]
    for system in ours:
        answers = {analysis.answer for analysis in (*system.analyses, *system.session_analyses)}
        if answers:
            assert found.get(system.name) in answers, f"no method {system.name}()"
        assert answers <= set(found.values()), system.name


def test_an_answer_is_had_by_its_type_its_name_and_its_method(flight: OpenLog) -> None:
    heading = flight.heading()
    assert flight.answer("heading") is heading and flight.answer(type(heading)) is heading
    with pytest.raises(NotAssessableError, match="expected several logs of one flight, run with --together"):
        flight.answer("several_logs")
    with pytest.raises(UnknownNameError, match="found no 'headin', expected heading"):
        flight.answer("headin")
    with pytest.raises(NotAssessableError, match="found one flight, expected the folder of a session"):
        flight.cooperative()
    with pytest.raises(NotAssessableError, match="found a flight, expected the folder of a plan"):
        flight.answer("control")


@dataclass(frozen=True)
class Wind(Answer):
    """Answer of somebody else's system."""

    analysis: ClassVar[str] = "wind"

    speed_mps: float
    figures: tuple[FigureData, ...] = ()


def test_the_answer_of_a_plug_in_is_had_by_its_type_and_name(flight: OpenLog, monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Nothing:
        """No settings."""

    analysis = Analysis("wind", "wind", "wind", "airspeed", Nothing, Wind, lambda *_: Found(Wind(3.0)))
    theirs = Systems((*systems().every, System("wind_and_weather", analyses=(analysis,))))
    monkeypatch.setattr("groundstation.systems.systems", lambda: theirs)
    with pytest.raises(NotAssessableError, match="wind: found no answer, expected airspeed"):
        flight.answer("wind")
    opened = groundstation.open(GOOD)
    answers = {**flight.results.answers, "wind": Wind(3.0)}
    opened.__dict__["results"] = replace(flight.results, answers=answers)
    assert opened.answer("wind") == opened.answer(Wind) == opened.answer("wind_and_weather") == Wind(3.0)


def test_every_method_answers_or_says_why_in_a_line(flight: OpenLog) -> None:
    for name, kind in methods().items():
        try:
            found = getattr(flight, name)()
        except NotAssessableError as error:
            assert str(error).count("\n") == 0 and len(str(error)) > len(kind.analysis) + 10, name
        else:
            assert isinstance(found, kind), name


def test_the_page_is_short_and_its_names_are_there(flight: OpenLog) -> None:
    assert len(PAGE.split()) <= MOST_WORDS
    for line in PAGE.splitlines():
        cells = line.split("|")
        if not line.startswith("| `"):
            continue
        for name in re.findall(r"`(?!groundstation\.)(\w+)", cells[1]):
            assert (
                hasattr(flight, name)
                or hasattr(SavedRun, name)
                or hasattr(flight.tables["ins"], name)
                or name
                in (
                    "folder",
                    "saved",
                )
            ), name
        for name in re.findall(r"`groundstation\.(\w+)", cells[1]):
            assert getattr(groundstation, name).__doc__, name
        if len(cells) > 4:
            kinds = [methods()[name] for name in re.findall(r"`(\w+)\(", cells[1])]
            known = {table for kind in kinds for table in (*tables_of(kind), "states", "channels")}
            assert set(re.findall(r"`([\w.]+)`", cells[3])) <= known, line


def test_public_names_have_docstrings_with_units() -> None:
    for kind in (OpenFlight, OpenLog, SavedRun):
        for name in dir(kind):
            if not name.startswith("_"):
                assert inspect.getdoc(getattr(kind, name)), f"{kind.__name__}.{name}"
    for name in methods():
        assert UNITS.search(inspect.getdoc(getattr(AnswerMethods, name)) or ""), name


def test_dir_has_no_private_names(flight: OpenLog) -> None:
    names = dir(flight)
    assert {"heading", "tables", "parameters"} <= set(names)
    assert not [name for name in names if name.startswith("_") and not name.startswith("__")]


def test_lists_inside_lists_are_frames_with_their_holder() -> None:
    found = landing()
    criteria, gates, contacts = (found.to_frame(name) for name in ("criteria", "gates", "second_contacts"))
    assert criteria[["approach", "name", "at.time_s", "title"]].values.tolist() == [[1, "bank", 60.0, "bank"]]
    assert criteria.attrs["units"] == {"at.time_s": "s", "at.height_m": "m", "at.before_threshold_m": "m"}
    assert gates[["approach", "stabilised_at_m", "name", "value"]].values.tolist() == [[1, 304.8, "sink_rate", 6.0]]
    assert contacts["time_s"].tolist() == [91.0]
    approaches = found.to_frame()
    assert approaches["runway.name"].tolist() == ["06", "06"] and np.isnan(approaches["touchdown.time_s"][1])
    assert approaches.attrs["units"]["touchdown.sink_rate_mps"] == "m/s"
    assert found.to_frame("position_errors.parts").columns.tolist() == ["approach", "position_error", "name", "sigma_m"]


def test_events_of_approaches_stand_in_order_of_time() -> None:
    events = landing().to_frame("events")
    told = list(zip(events["approach"], events["time_s"], events["event"], events["what"], strict=True))
    assert told == [
        (1, 10.0, "start", ""),
        (1, 50.0, "limit left", "sink rate"),
        (1, 60.0, "criterion not met", "bank"),
        (1, 90.0, "touchdown", "pitch"),
        (1, 91.0, "second contact", "load"),
        (1, 95.0, "end", "landing"),
        (2, 200.0, "start", ""),
        (2, 300.0, "end", "go-around"),
    ]
    assert events["before_threshold_m"].tolist()[3] == -350.0 and events.attrs["units"]["height_m"] == "m"


def test_every_table_of_every_answer_is_a_frame_with_units() -> None:
    results = report_example.example(inertial_example.inertial_result(), inertial_example.forecast_result())
    for answer in (*results.answers.values(), landing()):
        for name in answer.table_names():
            frame = answer.to_frame(name)
            assert len(frame.columns) and isinstance(frame.attrs["units"], dict), name
            for column in frame.columns:
                assert not any(is_dataclass(value) for value in frame[column]), f"{answer.analysis} {name} {column}"


def test_texts_are_short(flight: OpenLog) -> None:
    results = report_example.example(inertial_example.inertial_result(), inertial_example.forecast_result())
    shown = [*results.answers.values(), results, results.ledger, results.clock, landing(), landing().approaches[0]]
    shown += [flight, flight.ledger, flight.clock, flight.tables, flight.heading(), flight.gnss().receivers[0]]
    shown += [flight.tables["ins"], flight.flight, flight.results, flight.source]
    for one in shown:
        text = repr(one)
        assert len(text) <= MOST_CHARACTERS and text.count("\n") < MOST_LINES, text
    assert repr(landing()) == "<LandingResult 1: landing on runway 06; 2: go-around on runway 06>"
    assert "verdict='accept'" in repr(flight.heading()) and "gates (26)" in repr(flight.heading())


def test_texts_of_all_answers_come_from_the_short_one() -> None:
    for kind in systems().answer_types.values():
        assert "__repr__" in vars(kind) and issubclass(kind, Tabular), kind
        for inside in tables_of(kind).values():
            holds_rows = any(_is_list(hint) for hint in typing.get_type_hints(inside.row).values())
            assert not holds_rows or "__repr__" in vars(inside.row), f"the text of {inside.row.__name__} is long: Brief"


def _is_list(hint: object) -> bool:
    if typing.get_origin(hint) in (UnionType, typing.Union):
        return False
    arguments = typing.get_args(hint)
    return typing.get_origin(hint) is tuple and bool(arguments) and is_dataclass(arguments[0])


def ulog(path: Path) -> Path:
    log = UlogWriter().flags().info("sys_name", "PX4").info("ver_hw", "FMU_V5")
    log.parameter("MC_ROLL_P", 6.5, "Q", 1).parameter("MC_ROLL_P", 8.0).parameter("EKF2_GPS_DELAY", 110.0)
    log.format("vehicle_attitude:uint64_t timestamp;float[4] q;").subscribe(0, "vehicle_attitude")
    for at in range(50):
        log.row(0, "Q4f", 1_000_000 + 20_000 * at, 1.0, 0.0, 0.0, 0.0)
    log.parameter("EKF2_GPS_DELAY", 150.0)
    path.write_bytes(log.data)
    return path


def test_parameters_and_metadata_are_the_logs_own(tmp_path: Path, flight: OpenLog) -> None:
    opened = groundstation.open(ulog(tmp_path / "a.ulg"))
    parameters = opened.parameters
    assert parameters.loc["MC_ROLL_P"].tolist() == [8.0, 6.5, True, 8.0, False]
    assert parameters.index[parameters["changed"]].tolist() == ["EKF2_GPS_DELAY"]
    assert parameters["value"]["EKF2_GPS_DELAY"] == 150.0 and parameters["first"]["EKF2_GPS_DELAY"] == 110.0
    assert opened.metadata["hardware"] == "FMU_V5" and opened.metadata["sys_name"] == "PX4"
    assert not [name for name in opened.metadata.index if name.startswith(("derived.", "units."))]
    assert flight.parameters.empty and list(flight.parameters) == ["value", "default", "differs", "first", "changed"]
    assert flight.metadata["aircraft"] == "SIM-1"


def test_events_phases_and_findings_are_frames(flight: OpenLog) -> None:
    events = flight.events
    assert events["name"].tolist() == ["recording"] and str(events.index.tz) == "UTC"
    assert events["time_s"].tolist() == [2.0] and events.attrs["units"] == {"time_s": "s"}
    (at,) = flight.utc(events["time_s"])
    assert at == events.index[0]
    assert {"start_utc", "phase"} <= set(flight.phases) and flight.findings["code"][0] == "heading.accept"
    silent = groundstation.open(ROOT / "sample_logs" / "taxi-notime.csv")
    assert isinstance(silent.events.index, pd.TimedeltaIndex)
    with pytest.raises(NotAssessableError, match="no UTC"):
        silent.utc(0.0)


def test_a_reference_judges_as_the_option_of_run_does(fleet: Fleet, tmp_path: Path) -> None:
    gnss = groundstation.open(SHORT).tables["gnss"]
    columns = {f"gnss.{name}": gnss[name] for name in ("latitude_deg", "longitude_deg")}
    times = {"time_utc": np.char.add(np.datetime_as_string(gnss.utc, unit="ms"), "Z")}
    pd.DataFrame(times | columns).to_csv(tmp_path / "reference.csv", index=False)
    judged = groundstation.open(SHORT, reference=tmp_path / "reference.csv")
    assert isinstance(judged, OpenLog) and judged.reference().to_frame("errors")["subject"].tolist()[0] == "gnss"
    again = judged.with_settings(heading={"taxi_speed_min_mps": 7.0})
    assert again.configuration.references == judged.configuration.references and again.flight is judged.flight
    assert groundstation.open(SHORT, without="heading").configuration.without == ("heading",)
    with pytest.raises(UsageError, match="no such file"):
        groundstation.open(SHORT, reference=tmp_path / "none.csv")
    with pytest.raises(UsageError, match="settings for saved results"):
        groundstation.open(fleet.flight(fleet["flight_id"][0]).folder, reference=tmp_path / "reference.csv")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    out = tmp_path_factory.mktemp("fleet") / "out"
    run_many([GOOD], out, Configuration(), jobs=1, only_results=True)
    return groundstation.open_fleet(out)


def test_a_fleet_opens_its_flights(fleet: Fleet) -> None:
    name = fleet["flight_id"][0]
    opened = fleet.flight(name)
    assert isinstance(opened, SavedRun) and opened.heading().verdict == "accept"
    assert fleet.set_index("flight_id").flight(name).source == opened.source
    with pytest.raises(UnknownNameError, match=f"expected {name}"):
        fleet.flight(name[:-1])
    assert fleet.attrs["units"]["error_deg"] == "deg"


def test_a_fleet_is_an_ordinary_frame_in_all_else(fleet: Fleet, tmp_path: Path) -> None:
    plain = pd.DataFrame(fleet)
    assert type(plain) is pd.DataFrame and isinstance(fleet["error_deg"], pd.Series)
    assert fleet["flight"].tolist() == plain["flight"].tolist()
    pd.testing.assert_frame_equal(fleet, plain, check_frame_type=False)
    extra = pd.DataFrame({"flight_id": fleet["flight_id"], "note": ["first"]})
    for made in (
        fleet[fleet["error_deg"] > 0.0],
        fleet.sort_values("error_deg").head(1),
        fleet.assign(twice=2.0 * fleet["error_deg"]),
        fleet.merge(extra, on="flight_id"),
        pd.concat([fleet, fleet]),
        pickle.loads(pickle.dumps(fleet)),
        fleet.copy(),
    ):
        assert made.flight(fleet["flight_id"][0]).heading().verdict == "accept"
    assert fleet.groupby("aircraft")["error_deg"].mean().tolist() == plain["error_deg"].tolist()
    with pytest.raises(UsageError, match="no column flight_id"):
        fleet[["error_deg"]].flight("a")
    fleet.to_parquet(tmp_path / "a.parquet")
    assert pd.read_parquet(tmp_path / "a.parquet").columns.tolist() == plain.columns.tolist()


def test_a_table_becomes_a_dataset_where_xarray_is_installed(flight: OpenLog) -> None:
    xarray = pytest.importorskip("xarray")
    ins, silent = flight.tables["ins"], groundstation.open(ROOT / "sample_logs" / "taxi-notime.csv").tables["ins"]
    dataset = ins.to_xarray()
    assert isinstance(dataset, xarray.Dataset) and dict(dataset.sizes) == {"time": len(ins)}
    assert dataset["roll_deg"].attrs["units"] == "deg" and dataset["time"].dtype.kind == "M"
    assert np.array_equal(dataset["roll_deg"], ins["roll_deg"], equal_nan=True)
    assert silent.to_xarray()["time"].dtype.kind == "m"


def test_without_xarray_the_error_says_what_to_install(flight: OpenLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_module, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=re.escape("no package xarray: pip install 'groundstation[xarray]'")):
        flight.tables["ins"].to_xarray()
