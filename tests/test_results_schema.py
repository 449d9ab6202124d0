"""schemas/summary.schema.json lists what the dataclasses hold, and summaries obey it."""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from groundstation.base.findings import Finding
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.results.files import json_text
from groundstation.results.flight import FlightResults, NotAssessable, Source
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.results.roles import AzimuthEstimate
from groundstation.results.schema import schema_text
from groundstation.results.summary import SCHEMA_VERSION, summary_of
from groundstation.systems import systems
from groundstation.systems.heading import answer as answers
from groundstation.systems.inertial import answer as errors
from groundstation.systems.inertial import forecast_answer as outlook
from tests.real_logs import real_log
from tests.report_example import example, heading_result
from tests.saved import load
from tests.systems.inertial.example import forecast_result, inertial_result

SCHEMA_FILE = Path(__file__).parents[1] / "schemas" / "summary.schema.json"
SCHEMA = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def written(results: FlightResults) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json_text(summary_of(results)))
    return document


def bare() -> FlightResults:
    return FlightResults("NOTIME_00000000", Source("a.csv", "00" * 32, 0, "flat-csv"), {}, None, 0.0, "failed")


def least_heading() -> answers.HeadingResult:
    """A heading result with everything optional absent and every estimate unknown."""
    unknown = float("nan")
    return answers.HeadingResult(
        *("ins", "gnss", "true heading", "reject", "no sample"),
        *(unknown, unknown, (unknown, unknown), unknown, unknown, unknown, unknown, 0, 0.0),
        *(None, None, None, 0.1, (answers.Gate("taxi", "Taxi", None, 20.0, "s", "not_measured"),), None, ()),
    )


def system_2(inertial: errors.InertialResult | None, forecast: outlook.ForecastResult | None) -> FlightResults:
    return example(inertial, forecast)


def least_inertial() -> errors.InertialResult:
    """INS errors with everything optional absent and every estimate unknown."""
    unknown = float("nan")
    states = tuple(
        errors.StateEstimate(state.name, state.title, state.unit, unknown, unknown, unknown, None)
        for state in inertial_result().channels[0].states
    )
    channels = tuple(
        errors.ChannelResult(name, states, unknown, None, None, unknown, 0, 0, None, None) for name in ("north", "east")
    )
    azimuth = AzimuthEstimate(False, None, None, 0, unknown, "no turn")
    return errors.InertialResult(
        *("ins", "gnss", "unaided", "", 0, 0.0, "navigation", "default", "first_order", *channels),
        outages=(errors.RealOutage(0.0, 1.0, 1.0, None, None),),
        azimuth=azimuth,
    )


def least_forecast() -> outlook.ForecastResult:
    return outlook.ForecastResult("last_estimate", float("nan"), 300.0, False, "short", ())


def test_the_kept_schema_is_the_one_the_types_give() -> None:
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(systems().answer_types), "run `make schemas`"


SAMPLES = ("taxi-good.csv", "taxi-damaged.csv", "taxi-notime.csv")
RECORDED = ("g1000/log_220502_135932_EGPN.csv", "dataflash/erle_plane_4-12-2014_329.BIN", "inertial/gv_ff02.csv")


@pytest.mark.parametrize("log", [*SAMPLES, *RECORDED])
def test_what_a_run_writes_obeys_the_schema_and_comes_back_equal(log: str, tmp_path: Path) -> None:
    path = Path(__file__).parents[1] / "sample_logs" / log if log in SAMPLES else real_log(log)
    (outcome,) = run_many([path], tmp_path / "out", Configuration(), jobs=1, only_results=True)
    text = (Path(outcome.folder) / "summary.json").read_text(encoding="utf-8")
    VALIDATOR.validate(json.loads(text))
    assert json_text(summary_of(load(Path(outcome.folder)).results)) == text


def test_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["properties"]["schema_version"]["const"] == SCHEMA_VERSION


@pytest.mark.parametrize(
    "results",
    [
        *(example(heading_result()), example(least_heading()), example(None), bare(), example(None, start_utc_ns=None)),
        system_2(inertial_result(), forecast_result()),
        system_2(least_inertial(), least_forecast()),
        system_2(inertial_result(), None),
        system_2(inertial_result(kind="unknown", reopened=2, other_ins=("ins.1",)), None),
    ],
    ids=[
        *("full", "least heading", "no heading", "bare", "no time"),
        *("system 2", "least of system 2", "no forecast", "unknown kind"),
    ],
)
def test_summaries_obey_the_schema(results: FlightResults) -> None:
    VALIDATOR.validate(written(results))


@pytest.mark.parametrize(
    ("definition", "dataclass"),
    [
        ("heading", answers.HeadingResult),
        ("gate", answers.Gate),
        ("standstill", answers.Standstill),
        ("segment", answers.TaxiSegment),
        ("runway", answers.RunwayCheck),
        ("onboard", answers.OnboardComparison),
        ("channel", errors.ChannelResult),
        ("state", errors.StateEstimate),
        ("outage", errors.RealOutage),
        ("azimuth", AzimuthEstimate),
        ("forecast", outlook.ForecastResult),
        ("skill", outlook.SkillRow),
        ("gap", outlook.GapRow),
        ("phase_outage", outlook.PhaseRow),
        ("classic_start", outlook.ClassicStart),
        ("calibration", outlook.CalibrationRow),
        ("coupled", outlook.CoupledRow),
        ("finding", Finding),
        ("not_assessable", NotAssessable),
        ("source", Source),
    ],
)
def test_schema_and_dataclasses_list_the_same_keys(definition: str, dataclass: type) -> None:
    listed = SCHEMA["$defs"][definition]
    names = [field.name for field in fields(dataclass) if field.name != "figures"]
    assert list(listed["properties"]) == names
    assert sorted(listed["required"]) == sorted(names) and listed["additionalProperties"] is False


def test_channels_of_the_ins_errors_stand_under_their_names() -> None:
    names = [field.name for field in fields(errors.InertialResult) if field.name != "figures"]
    listed = SCHEMA["$defs"]["inertial"]
    assert {"north", "east"} < set(names)
    assert list(listed["properties"]) == names and sorted(listed["required"]) == sorted(names)
    assert list(written(system_2(inertial_result(), None))["results"]["inertial"]) == names


def test_methods_of_the_schema_are_those_of_the_forecast() -> None:
    for name, field in (("skill", "method"), ("forecast", "default_method")):
        assert SCHEMA["$defs"][name]["properties"][field]["enum"] == list(FORECAST_METHODS)


def test_top_level_keys_stand_in_the_order_of_the_contract() -> None:
    assert list(written(bare())) == list(SCHEMA["properties"]) == SCHEMA["required"]
    assert list(written(bare())["flight"]) == list(SCHEMA["$defs"]["flight"]["properties"])


def test_contract_keys_are_required() -> None:
    promised = {
        *("error_deg", "standard_error_deg", "confidence95_deg", "precision_deg", "estimate_sd_deg", "samples"),
        *("taxi_seconds", "drift_deg_per_h", "segments", "standstill", "gates", "verdict", "correction_deg"),
        *("parking_heading_deg", "reference_residual_arcmin", "onboard"),
    }
    assert promised <= set(SCHEMA["$defs"]["heading"]["required"])
    skill = {"method", "horizon_min", "starts", "rms_m", "median_m", "p95_m", "coverage95"}
    assert skill <= set(SCHEMA["$defs"]["skill"]["required"])
    gaps = {"method", "length_min", "starts", "max_error_rms_m", "coverage95"}
    assert gaps <= set(SCHEMA["$defs"]["gap"]["required"])
    assert {"skill", "gaps", "classic_starts", "default_method"} <= set(SCHEMA["$defs"]["forecast"]["required"])


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("status",), "fine"),
        (("flight", "start_utc"), "yesterday"),
        (("flight", "id"), "a/b"),
        (("results", "heading", "verdict"), "maybe"),
        (("results", "heading", "error_deg"), "1.0"),
        (("results", "heading", "extra"), 1),
        (("results", "heading", "confidence95_deg"), [1.0]),
        (("results", "unheard_of"), {}),
    ],
)
def test_schema_refuses_what_is_wrong(path: tuple[str, ...], value: object) -> None:
    document = written(example(heading_result()))
    place: Any = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert not VALIDATOR.is_valid(document)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("inertial", "kind"), "good"),
        (("inertial", "outages", 0, "missing"), "nothing"),
        (("inertial", "reopened"), -1),
        (("inertial", "other_ins"), "ins.1"),
        (("inertial", "north"), "none"),
        (("inertial", "channels"), []),
        (("inertial", "east", "share_inside95"), 1.2),
        (("forecast", "default_method"), "best"),
        (("forecast", "skill", 0, "method"), "best"),
        (("forecast", "gaps", 0, "method"), "windows"),
        (("forecast", "best_method"), {"10": "best"}),
    ],
)
def test_schema_refuses_what_is_wrong_in_system_2(path: tuple[Any, ...], value: object) -> None:
    document = written(system_2(inertial_result(), forecast_result()))
    place: Any = document["results"]
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert not VALIDATOR.is_valid(document)


def test_missing_key_is_refused() -> None:
    document = written(replace(example(heading_result())))
    del document["results"]["heading"]["verdict"]
    assert not VALIDATOR.is_valid(document)
