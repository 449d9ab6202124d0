"""The latency estimator: exact without noise, signs by worked example, silent with a reason where it cannot know."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.methods.lag.settings import LatencySettings
from groundstation.methods.lag.windows import Noise, ReferenceSignals, Windows, noise_of
from groundstation.pipeline.one_flight.analyse import Answered, known_of, run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.files import save
from groundstation.results.manifest import Manifest
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftData
from groundstation.systems.latency import answer as answers
from groundstation.systems.latency.analysis import LATENCY
from groundstation.systems.latency.chapter import latency
from groundstation.systems.latency.estimate import estimate_latencies
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.report_example import example
from tests.saved import load
from tests.schema_fields import SCHEMA, expect_fields
from tests.simulated_flights import FLIGHT_LEGS, QUIET_GNSS, QUIET_INS, scenario

EXACT_S = 0.002  # interpolation between samples 0.1 s apart, and means over 0.4 s
NOISY_S = 0.05
TICK_NS = 200_000_000  # time stamps rounded up to it would make the INS late


@cache
def flown(latency_s: float = 0.2, *, quiet: bool = False) -> Flight:
    """A taxi and a flight with turns, all sensors; GNSS late by ``latency_s``."""
    changes: dict[str, object] = {"gnss": {"latency_s": latency_s}, "magnetometer": {}, "baro": {"rate_hz": 10.0}}
    if quiet:
        changes |= {
            "ins": QUIET_INS | {"velocity_resolution_mps": 1e-6, "azimuth_error_deg": 0.5, "azimuth_drift_dph": 0.0},
            "gnss": QUIET_GNSS | {"latency_s": latency_s, "velocity_resolution_mps": 1e-6},
        }
    return simulate(scenario(legs=FLIGHT_LEGS, **changes)).flight


def changed(flight: Flight, topic: str, change: Callable[[Table], Table]) -> Flight:
    return replace(flight, tables={**flight.tables, topic: change(flight[topic])})


def later(seconds: float) -> Callable[[Table], Table]:
    return lambda table: replace(table, time_ns=table.time_ns + round(seconds * NS_PER_S))


def with_column(name: str, values: np.ndarray) -> Callable[[Table], Table]:
    return lambda table: replace(table, columns={**table.columns, name: Column(values)})


def only(flight: Flight, *topics: str) -> Flight:
    return replace(flight, tables={name: flight[name] for name in topics})


def row_of(flight: Flight, other: str, **options: object) -> answers.Latency:
    found = estimate_latencies(flight, **options)  # type: ignore[arg-type]
    return next(row for row in found.rows if row.other == other)


def latency_of(flight: Flight, other: str) -> float:
    row = row_of(flight, other)
    assert row.latency_s is not None, row.reason
    return row.latency_s


@pytest.mark.parametrize("latency_s", [0.0, 0.137, 0.5])
def test_noiseless_gnss_is_exact_and_later_is_positive(latency_s: float) -> None:
    """Worked example: each GNSS velocity is stamped 0.137 s after the motion it shows; latency +0.137 s."""
    assert latency_of(flown(latency_s, quiet=True), "gnss") == pytest.approx(latency_s, abs=EXACT_S)


def test_a_sensor_ahead_of_the_ins_is_negative() -> None:
    flight = changed(flown(0.0), "gnss", later(-0.25))
    assert latency_of(flight, "gnss") == pytest.approx(-0.25, abs=NOISY_S)


def test_magnetometer_shows_its_latency() -> None:
    flight = changed(flown(), "magnetometer", later(0.15))
    assert latency_of(flight, "magnetometer") == pytest.approx(0.15, abs=0.02)


def test_baro_shows_its_latency_where_the_climb_changes() -> None:
    flight = only(flown(quiet=True), "ins", "baro")
    down = flight["ins"].values("velocity_down_mps")
    time_s = flight.time_s("ins")
    wave = 3.0 * np.sin(2.0 * np.pi * time_s / 12.0)
    flight = changed(flight, "ins", with_column("velocity_down_mps", down - wave))
    height = 18.0 / np.pi * (1.0 - np.cos(2.0 * np.pi * flight.time_s("baro") / 12.0))
    flight = changed(
        flight, "baro", with_column("pressure_altitude_m", flight["baro"].values("pressure_altitude_m") + height)
    )
    assert latency_of(changed(flight, "baro", later(0.3)), "baro") == pytest.approx(0.3, abs=NOISY_S)


def test_second_ins_is_compared_by_attitude() -> None:
    flight = flown()
    twin = replace(later(0.08)(flight["ins"]), topic="ins.2")
    flight = replace(flight, tables={"ins.1": replace(flight["ins"], topic="ins.1"), "ins.2": twin})
    row = row_of(flight, "ins.2")
    assert (row.reference, row.quantity) == ("ins.1", "attitude")
    assert row.latency_s == pytest.approx(0.08, abs=EXACT_S)


def test_turning_the_world_and_shifting_time_change_nothing() -> None:
    flight = only(flown(), "ins", "gnss")
    angle = np.deg2rad(137.0)

    def turned(table: Table) -> Table:
        north, east = table.values("velocity_north_mps"), table.values("velocity_east_mps")
        table = with_column("velocity_north_mps", north * np.cos(angle) - east * np.sin(angle))(table)
        table = with_column("velocity_east_mps", north * np.sin(angle) + east * np.cos(angle))(table)
        if "true_heading_deg" not in table:
            return table
        return with_column("true_heading_deg", (table.values("true_heading_deg") + 137.0) % 360.0)(table)

    other = changed(changed(flight, "ins", turned), "gnss", turned)
    shifted = changed(changed(flight, "ins", later(5e6)), "gnss", later(5e6))
    shifted = replace(shifted, start_ns=flight.start_ns + 5_000_000 * NS_PER_S)
    before = latency_of(flight, "gnss")
    assert latency_of(other, "gnss") == pytest.approx(before, abs=1e-3)
    assert latency_of(shifted, "gnss") == pytest.approx(before, abs=1e-6)


def test_wild_values_gaps_and_lost_samples_do_little() -> None:
    flight = only(flown(), "ins", "gnss")
    rng = np.random.default_rng(5)
    wild = flight["gnss"].values("velocity_north_mps").copy()
    wild[rng.integers(0, len(wild), 40)] += rng.choice([-1, 1], 40) * 400.0
    wild[rng.integers(0, len(wild), 40)] = np.nan
    flight = changed(flight, "gnss", with_column("velocity_north_mps", wild))
    flight = changed(flight, "gnss", lambda table: table.take(rng.random(len(table)) > 0.3))
    time_s = flight.time_s("ins")
    flight = changed(flight, "ins", lambda table: table.take((time_s < 100.0) | (time_s > 112.0)))
    assert latency_of(flight, "gnss") == pytest.approx(0.2, abs=NOISY_S)


def test_series_knows_where_it_has_gaps() -> None:
    time_s = np.array([0.0, 1.0, 2.0, 8.0, 9.0, 10.0])
    series = ReferenceSignals(time_s, time_s[:, None] ** 2, lambda base: base[..., None], 1.5)
    assert series.covers(np.array([0.4, 1.0, 1.6, 5.0, 8.4, 9.0, 9.6]), 0.5).tolist() == [
        *(False, True, False, False, False, True, False)
    ]
    value, rate = series.at(np.array([1.0, 9.0]))
    assert value[..., 0, 0].tolist() == [1.0, 81.0]
    assert rate[0, 0, 0] == pytest.approx(2.0)
    assert np.array_equal(series.signal_at(np.array([1.0, 9.0])), value)


def test_no_noise_is_tried_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """The three searches share one grid: the best of one is met again in the next."""
    rng, tried = np.random.default_rng(3), list[Noise]()
    time_s = np.arange(240.0).reshape(8, 30)
    white = Windows(time_s, rng.normal(size=(8, 30, 1)), np.ones((8, 30)))
    whitener = Windows.whitener
    monkeypatch.setattr(Windows, "whitener", lambda self, noise: tried.append(noise) or whitener(self, noise))
    found = noise_of(white, white.values, 2)
    assert found.sigma == pytest.approx(1.0, abs=0.1) and len(tried) == len(set(tried)) > 10


# Not observable


def test_an_ins_that_gnss_corrects_gives_the_same_latency_less_surely() -> None:
    """One installation has one answer, whether its flight is long enough to see that GNSS corrects the INS or not."""
    free, row = row_of(flown(), "gnss"), row_of(flown(), "gnss", kinds={"ins": "gnss_aided"})
    assert (row.state, row.latency_s) == (free.state, free.latency_s) == ("observed", free.latency_s)
    assert row.sigma_s == pytest.approx(np.hypot(free.sigma_s or 0.0, 0.03))
    assert "GNSS corrects this INS, whose filter may hide 0.03 s of latency" in row.reason
    flight = flown()
    by_mode = changed(flight, "ins", with_column("mode", np.full(len(flight["ins"]), "gnss_aided")))
    assert row_of(by_mode, "gnss").reason == row.reason


def every(step: int) -> Callable[[Table], Table]:
    return lambda table: table.take(slice(0, None, step))


@pytest.mark.parametrize(
    ("topic", "change", "reason"),
    [
        ("ins", every(50), "ins is too slow"),
        ("gnss", every(50), "gnss is too slow"),
        ("gnss", lambda table: replace(table, time_ns=table.time_ns // NS_PER_S * NS_PER_S), "coarser than its rate"),
        ("ins", lambda table: replace(table, time_ns=-(-table.time_ns // TICK_NS) * TICK_NS), "coarser than its rate"),
        ("gnss", lambda table: table.take(slice(0, 1)), "no samples"),
        ("gnss", lambda table: table.take(slice(0, 300)), "fewer than two stretches"),
        ("ins", lambda table: table.take(slice(0, 2)), "too few samples"),
        ("gnss", lambda table: with_column("velocity_east_mps", np.zeros(len(table)))(table), ""),
        ("ins", lambda table: with_column("velocity_east_mps", np.zeros(len(table)))(table), ""),
        ("gnss", later(40.0), ""),
    ],
)
def test_what_cannot_be_compared_says_why(topic: str, change: Callable[[Table], Table], reason: str) -> None:
    row = row_of(changed(only(flown(), "ins", "gnss"), topic, change), "gnss")
    assert (row.state, row.latency_s, row.confidence95_s) == ("not_observable", None, None)
    assert row.reason
    assert reason in row.reason


@pytest.mark.parametrize("scale", [np.nan, np.inf, 0.0, 1e300])
@pytest.mark.filterwarnings("error")
def test_hostile_numbers_give_no_latency_and_no_warning(scale: float) -> None:
    flight = only(flown(), "ins", "gnss", "magnetometer", "baro")
    for topic, name in (
        ("gnss", "velocity_north_mps"),
        ("magnetometer", "field_right_nt"),
        ("baro", "pressure_altitude_m"),
    ):
        flight = changed(flight, topic, with_column(name, np.full(len(flight[topic]), scale)))
    try:
        found = estimate_latencies(flight)
    except NotAssessableError:
        return
    assert {row.state for row in found.rows} == {"not_observable"}


def answered(flight: Flight) -> Answered:
    """The analysis of latencies alone."""
    return run_analyses((LATENCY,), flight, known_of(flight, Configuration()))


def test_no_pair_at_all_is_not_assessable() -> None:
    with pytest.raises(NotAssessableError, match="no INS with another sensor"):
        estimate_latencies(only(flown(), "gnss"))
    assert answered(Flight(tables={})).not_assessable[0].analysis == "latency"


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(SettingsError):
        LatencySettings(window_s=0.0)


# Use by system 1


def test_heading_puts_gnss_back_by_an_observed_latency() -> None:
    flight = flown(0.3)
    latencies = estimate_latencies(flight)
    used = estimate_heading_error(flight, latencies=latencies)
    never = estimate_heading_error(flight, latencies=latencies, settings=HeadingSettings(use_latency="never"))
    stated = estimate_heading_error(flight, latencies=latencies, aircraft=AircraftData(gnss_latency_s=0.1))
    assert used.latency_used_s == pytest.approx(0.3, abs=NOISY_S)
    assert (used.latency_origin, stated.latency_origin, never.latency_origin) == ("motion", "aircraft file", "")
    assert (stated.latency_used_s, never.latency_used_s) == (0.1, None)
    assert never.time_offset_s is None or never.time_offset_s > 0.1


def test_heading_is_shifted_exactly() -> None:
    late = estimate_heading_error(flown(0.3), aircraft=AircraftData(gnss_latency_s=0.3))
    prompt = estimate_heading_error(flown(0.0), aircraft=AircraftData(gnss_latency_s=0.0))
    assert late.error_deg == pytest.approx(prompt.error_deg, abs=1e-9)


# Results, report


def test_results_are_saved_obey_the_schema_and_are_told(tmp_path: Path) -> None:
    found = estimate_latencies(flown())
    results = example(None, found)
    save(tmp_path, replace(results, figures=(*results.figures, *found.figures)), Manifest())
    saved = load(tmp_path)
    jsonschema.Draft202012Validator(SCHEMA).validate(saved.summary)
    assert saved.summary["results"]["latency"]["rows"][0]["latency_s"] == pytest.approx(0.2, abs=NOISY_S)
    section = latency(saved.results)
    assert section is not None
    assert [part.kind for part in section.parts] == ["grid", "figure"]


@pytest.mark.parametrize(("definition", "dataclass"), [("latencies", answers.Latencies), ("latency", answers.Latency)])
def test_schema_lists_what_the_dataclasses_hold(definition: str, dataclass: type) -> None:
    expect_fields(definition, dataclass)


def test_a_large_latency_is_a_finding() -> None:
    (finding,) = (finding for finding in answered(flown()).findings["latency"] if finding.topic == "gnss")
    assert finding.code == "latency.observed"
    assert "velocity of gnss later than that of ins by 0.2" in finding.text


def test_scenarios_without_latency_show_none() -> None:
    row = row_of(simulate(load_scenario("taxi-good")).flight, "gnss")
    assert row.confidence95_s is not None
    assert row.confidence95_s[0] <= 0.0 <= row.confidence95_s[1]


@pytest.mark.real_log
def test_one_installation_has_one_latency_in_the_whole_drive_and_in_its_parts(tmp_path: Path) -> None:
    """A car with an INS of two antennas, GNSS 0.28 s late by the correlation of velocities; it stands at first."""
    mcap = tmp_path / "drive.mcap"
    drive = read_flight(mcap, convert_log(open_log(real_log("reference_heading/pntos_drive_first_half.csv")), mcap))
    parts = [(0.0, 1300.0), *((start, start + 325.0) for start in (0.0, 325.0, 650.0, 975.0))]
    for start_s, end_s in parts:
        tables = {}
        for topic in drive.topics():
            time_s = drive.time_s(topic)
            tables[topic] = drive[topic].take((time_s >= start_s) & (time_s < end_s))
        (row,) = estimate_latencies(replace(drive, tables=tables), kinds={"ins": "gnss_aided"}).rows
        assert row.state == "observed", row.reason
        assert row.confidence95_s is not None and row.confidence95_s[0] < 0.28 < row.confidence95_s[1]
        assert row.latency_s == pytest.approx(0.28, abs=0.01)
