"""Magnetic deviation in a whole run: verdict and coefficients beside the truth, reasons where there is none, files."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.clock import Clock
from groundstation.base.errors import SettingsError
from groundstation.base.ledger import Ledger
from groundstation.methods import harmonics
from groundstation.pipeline.many_flights.fleet.columns import answer_values
from groundstation.pipeline.one_flight import analyse as pipeline
from groundstation.pipeline.one_flight.analyse import Given, analyse, known_of, run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight, sentence
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.files import SavedFlight, save
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Manifest
from groundstation.results.roles import LETTERS
from groundstation.simulation.deviation import BIN_MIDDLES_DEG, scenario_deviation
from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.scenario import load_scenario
from groundstation.systems import systems
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.magnetic import answer as answers
from groundstation.systems.magnetic.analysis import MAGNETIC
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.saved import load
from tests.schema_fields import SCHEMA, expect_fields
from tests.told import front, shipped_but


@cache
def simulated(name: str) -> Simulated:
    return simulate(load_scenario(name))


@contextmanager
def magnetic_alone() -> Iterator[pytest.MonkeyPatch]:
    """Within, runs have the magnetic analysis and what it builds on: the others take longer, and no test asks them."""
    with pytest.MonkeyPatch.context() as patch:
        asked = tuple(one for one in systems().analyses if one.name in ("latency", "heading", "magnetic"))
        patch.setattr(pipeline, "systems", lambda: shipped_but(analyses=asked))
        yield patch


def analysed(flight: Flight, configuration: Configuration | None = None) -> FlightResults:
    source = Source("flight.csv", "ab" * 32, 1, "flat-csv")
    given = Given("NOTIME_abababab", source, Ledger(), Clock(), (), has_lost_data=False)
    with magnetic_alone():
        return analyse(flight, given, configuration or Configuration())


@cache
def figure_eight() -> FlightResults:
    return analysed(simulated("magnetic-eight").flight)


def reason_of(results: FlightResults) -> str:
    (reason,) = (entry.reason for entry in results.not_assessable if entry.analysis == "magnetic")
    return reason


def test_a_figure_eight_is_accepted_with_its_coefficients() -> None:
    """The truth is taken at the mean current of the figure: what the iron fit refers to."""
    results, flown = figure_eight(), simulated("magnetic-eight")
    found = results.answer(MagneticResult)
    assert found is not None
    assert found.poisson is not None
    assert flown.scenario.electric is not None
    electric = replace(flown.scenario.electric, base_a=found.poisson.current_reference_a)
    truth = scenario_deviation(replace(flown.scenario, electric=electric), flown.trajectory)
    assert truth is not None
    assert (found.verdict, found.recommended_method) == ("accept", "poisson_attitude")
    expected = harmonics.fit(BIN_MIDDLES_DEG, wrap_180(truth.compass_error_deg + truth.declination_deg))[0]
    for method in (found.method("compass_table"), found.method("poisson_attitude")):
        for letter, value in zip(LETTERS, expected, strict=True):
            sigma = method.coefficients_sigma_deg[letter]
            assert abs(method.coefficients_deg[letter] - value) < 3.0 * sigma, (method.name, letter)
    assert found.alignment.aligned_at_s is not None
    assert found.residual_rms_deg is not None
    assert found.residual_rms_deg.after < 0.2 < 3.0 < found.residual_rms_deg.before
    assert [finding.severity for finding in results.findings if finding.code == "magnetic.accept"] == ["info"]
    assert "magnetic deviation accept: 3.34 deg RMS before, 0.12 after" in sentence(results)


def test_a_bad_figure_is_refused_with_the_reason() -> None:
    results = analysed(simulated("magnetic-hard").flight)
    assert results.answer(MagneticResult) is None
    assert "no opposite turn of equal bank" in reason_of(results)
    assert "unsteady bank" in reason_of(results)
    (finding,) = (finding for finding in results.findings if finding.code.startswith("magnetic."))
    assert (finding.severity, finding.code) == ("info", "magnetic.not_assessable")
    assert "magnetic" not in sentence(results)


def test_a_rejected_figure_is_a_warning() -> None:
    strict = Configuration({"magnetic": {"held_out_rms_max_deg": 0.01}})
    results = analysed(simulated("magnetic-eight").flight, strict)
    (finding,) = (finding for finding in results.findings if finding.code.startswith("magnetic."))
    assert (finding.severity, finding.code) == ("warn", "magnetic.reject")
    assert "rms error after correction" in finding.text
    assert "magnetic deviation reject (rms error after correction" in sentence(results)


def test_without_magnetometer_there_is_a_reason_and_no_finding() -> None:
    flight = simulated("magnetic-eight").flight
    tables = {topic: table for topic, table in flight.tables.items() if topic != "magnetometer"}
    results = analysed(Flight(tables, flight.metadata, flight.start_ns, flight.has_utc, flight.source_name))
    assert "magnetometer" in reason_of(results)
    assert not [finding for finding in results.findings if finding.code.startswith("magnetic.")]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("fixedwing/umn_thor_flight75.csv", "other sensors correct ins"),
        ("inertial/gv_ff02.csv", "no three-axis magnetometer"),
        ("g1000/log_220417_125002_LFQA.csv", "no three-axis magnetometer"),
        ("ulog/pyulog_sample.ulg", "no turn of steady bank"),
    ],
)
def test_recorded_flights_are_refused_with_the_reason(name: str, reason: str, tmp_path: Path) -> None:
    mcap = tmp_path / "flight.mcap"
    flight = read_flight(mcap, convert_log(open_log(real_log(name)), mcap))
    found = run_analyses((INERTIAL, MAGNETIC), flight, known_of(flight, Configuration()))
    assert "magnetic" not in found.answers
    assert found.reasons["magnetic"].startswith(reason)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> SavedFlight:
    """The figure of eight as it was saved."""
    folder = tmp_path_factory.mktemp("eight")
    save(folder, figure_eight(), Manifest())
    return load(folder)


@pytest.mark.parametrize("name", [field.name for field in fields(answers.MagneticResult)])
def test_every_answer_is_saved_and_comes_back(name: str, saved: SavedFlight) -> None:
    before, after = (found.answer(MagneticResult) for found in (figure_eight(), saved.results))
    if name == "figures":
        assert {"magnetic_samples", "magnetic_table", "magnetic_modulus"} <= set(saved.figures)
        return
    value, back = getattr(before, name), getattr(after, name)
    assert type(back) is type(value)
    if isinstance(value, str):
        assert back == value
    elif name.endswith("_deg") and isinstance(value, tuple):
        assert np.allclose(back, value, rtol=0.0, atol=1e-4)


def test_index_and_front_page_tell_the_deviation(saved: SavedFlight) -> None:
    found, row = figure_eight().answer(MagneticResult), answer_values(saved.results)
    assert found is not None and found.residual_rms_deg is not None
    method = found.method(found.recommended_method)
    assert (row["magnetic_verdict"], row["magnetic_method"]) == (found.verdict, found.recommended_method)
    assert row["magnetic_after_rms_deg"] == pytest.approx(found.residual_rms_deg.after, abs=1e-4)
    for letter in "ABCDE":
        assert row[f"magnetic_{letter.lower()}_deg"] == pytest.approx(method.coefficients_deg[letter], abs=1e-4)
        sigma = row[f"magnetic_{letter.lower()}_sigma_deg"]
        assert sigma == pytest.approx(method.coefficients_sigma_deg[letter], abs=1e-4)
    told = front(saved.results)
    (value,) = [tile.claim.value for tile in told.others if tile.key == "magnetic"] or [told.figures[0][1]]
    assert f"{found.residual_rms_deg.after:.2f}" in value


def test_summary_obeys_the_schema(saved: SavedFlight) -> None:
    summary = saved.summary
    own = {"$schema": SCHEMA["$schema"], "$ref": "#/$defs/magnetic", "$defs": SCHEMA["$defs"]}
    jsonschema.Draft202012Validator(own).validate(summary["results"]["magnetic"])
    assert len(summary["results"]["magnetic"]["deviation_deg"]) == 360


@pytest.mark.parametrize(
    ("definition", "dataclass"),
    [
        ("magnetic", answers.MagneticResult),
        ("alignment", answers.Alignment),
        ("declination", answers.DeclinationUsed),
        ("turn", answers.Turn),
        ("swing", answers.Swing),
        ("sigma_part", answers.SigmaPart),
        ("coverage", answers.Coverage),
        ("residual", answers.Residual),
        ("held_out", answers.HeldOut),
        ("magnetic_method", answers.Method),
        ("poisson", answers.PoissonParameters),
        ("bank_bias", answers.BankBias),
        ("card_row", answers.CardRow),
    ],
)
def test_schema_lists_what_the_dataclasses_hold(definition: str, dataclass: type) -> None:
    expect_fields(definition, dataclass)


def test_settings_are_read_and_mistakes_named(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text("[magnetic]\ncard_step_deg = 15\n", encoding="utf-8")
    assert load_configuration(path).settings.of(MagneticSettings).card_step_deg == 15
    path.write_text("[magnetic]\ncard_step = 15\n", encoding="utf-8")
    with pytest.raises(SettingsError, match="card_step"):
        load_configuration(path)
