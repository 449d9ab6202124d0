"""The installed heading sensor on straight ground runs: known deviations come back, with honest errors and reasons."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from scipy.signal import lfilter

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.clock import Clock
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError, SettingsError
from groundstation.base.ledger import Ledger
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.chapters.markdown import escaped
from groundstation.chapters.parts import Grid, Note
from groundstation.chapters.wording import number
from groundstation.methods import harmonics
from groundstation.pipeline.one_flight.analyse import Answered, Given, analyse, known_of, run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration, load_configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight, sentence
from groundstation.pipeline.one_flight.log import open_log
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.files import save
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Manifest
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic import ground_answer as answers
from groundstation.systems.magnetic.analysis import MAGNETIC_GROUND
from groundstation.systems.magnetic.chapter import magnetic
from groundstation.systems.magnetic.ground_answer import GroundDeviation
from groundstation.systems.magnetic.ground_fit import fit_curve
from groundstation.systems.magnetic.ground_runs import estimate_ground_deviation
from groundstation.systems.magnetic.ground_settings import MagneticGroundSettings
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.recording_contents import Contents
from tests.saved import load
from tests.schema_fields import SCHEMA, expect_fields
from tests.told import PLOTS, write_recording

START_NS = iso_to_utc_ns("2026-05-09T08:00:00Z")[0]
LATITUDE_DEG, LONGITUDE_DEG = 55.97, 37.41
TURN_DPS, PARKED_S, RUN_S, SPEED_MPS = 10.0, 20.0, 25.0, 8.0
EIGHT = tuple(range(20, 380, 45))
NOISELESS = 0.05  # deg: declination changes along the way, and a run is longer than its middle
M_PER_DEG = 111_195.0
SAMPLED = 1e-3  # deg: the noise model is sampled, and its draws hang on the data
COEFFICIENTS = (1.2, -3.0, 2.0, 0.8, -0.5)


@dataclass(frozen=True)
class Case:
    """Runs to be made, one after the other with turns between; 1 Hz as a flight recorder writes.

    ``flown`` adds a leg in the air with ``drift_deg`` between nose and track behind the runs; ``lag_s`` is the time
    constant of a heading that lags, ``place_deg`` gives each run an error of its own, ``speeds_mps`` a speed.
    """

    true_headings_deg: Sequence[float] = EIGHT
    coefficients_deg: tuple[float, ...] = COEFFICIENTS
    run_s: float = RUN_S
    speed_mps: float = SPEED_MPS
    speeds_mps: Sequence[float] = ()
    heading_noise_deg: float = 0.0
    velocity_noise_mps: float = 0.0
    place_deg: float = 0.0
    declination_error_deg: float = 0.0
    lag_s: float = 0.0
    step_deg: float = 0.0
    flown: bool = False
    drift_deg: float = 12.0
    seed: int = 1


def correlated(rng: np.random.Generator, count: int, time_s: float) -> np.ndarray:
    """First-order Gauss-Markov noise of unit variance, one a second."""
    keep = np.exp(-1.0 / time_s)
    white = rng.standard_normal(count) * np.sqrt(1.0 - keep**2)
    white[0] = rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -keep], white))


def motion(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """True heading (continuous), speed, number of the run (-1 in turns) and whether in the air; one row a second."""
    headings = [np.full(int(PARKED_S), float(case.true_headings_deg[0]))]
    numbers = [np.full(int(PARKED_S), -1)]
    for place, wanted in enumerate(case.true_headings_deg):
        last = headings[-1][-1]
        turn = float(wrap_180(wanted - last))
        steps = int(abs(turn) / TURN_DPS)
        headings += [last + np.sign(turn) * TURN_DPS * np.arange(1, steps + 1), np.full(int(case.run_s), last + turn)]
        numbers += [np.full(steps, -1), np.full(int(case.run_s), place)]
    in_air = [np.zeros(sum(map(len, headings)), dtype=bool)]
    speeds = np.append(case.speeds_mps or [case.speed_mps] * len(case.true_headings_deg), case.speed_mps)  # last: turns
    speed = [np.where(np.arange(len(in_air[0])) < PARKED_S, 0.0, speeds[np.concatenate(numbers)])]
    if case.flown:
        seconds = 120
        headings.append(np.full(seconds, headings[-1][-1]))
        numbers.append(np.full(seconds, -1))
        speed.append(np.full(seconds, 55.0))
        in_air.append(np.ones(seconds, dtype=bool))
    return np.concatenate(headings), np.concatenate(speed), np.concatenate(numbers), np.concatenate(in_air)


def table(topic: str, time_ns: np.ndarray, columns: dict[str, np.ndarray]) -> Table:
    rows = np.arange(len(time_ns))
    return Table(topic, time_ns, {name: Column(values) for name, values in columns.items()}, rows, Column(time_ns))


def reading_of(magnetic_deg: np.ndarray, coefficients_deg: Sequence[float]) -> np.ndarray:
    """What a sensor shows whose error hangs on its own reading."""
    reading = magnetic_deg.copy()
    for _ in range(50):
        reading = magnetic_deg + harmonics.design(reading) @ np.asarray(coefficients_deg)
    return reading


def make(**changes: Any) -> Flight:
    case = replace(Case(), **changes)
    rng = np.random.default_rng(case.seed)
    heading, speed, number, in_air = motion(case)
    count = len(heading)
    time_ns = START_NS + np.arange(count) * NS_PER_S
    place = np.full(1, LATITUDE_DEG), np.full(1, LONGITUDE_DEG), np.zeros(1)
    declination = float(declination_along(*place, START_NS).values_deg[0]) + case.declination_error_deg
    magnetic = heading - declination
    keep = np.exp(-1.0 / case.lag_s) if case.lag_s else 0.0
    late = magnetic[0] + lfilter([1.0 - keep], [1.0, -keep], magnetic - magnetic[0])
    own = case.place_deg * rng.standard_normal(len(case.true_headings_deg) + 1)  # the last: turns and standstill
    shown = reading_of(late, case.coefficients_deg) + own[number]
    shown = shown + case.heading_noise_deg * correlated(rng, count, 3.0)
    if case.step_deg:
        shown = np.round(shown / case.step_deg) * case.step_deg
    track_rad = np.deg2rad(heading + np.where(in_air, case.drift_deg, 0.0))
    moving = case.velocity_noise_mps * (speed > 0.0)
    north, east = (
        speed * along + moving * (rng.standard_normal(count) + correlated(rng, count, 4.0))
        for along in (np.cos(track_rad), np.sin(track_rad))
    )
    gnss = {
        "latitude_deg": LATITUDE_DEG + np.cumsum(north) / M_PER_DEG,
        "longitude_deg": LONGITUDE_DEG + np.cumsum(east) / M_PER_DEG / np.cos(np.deg2rad(LATITUDE_DEG)),
        "velocity_north_mps": north,
        "velocity_east_mps": east,
    }
    tables = {
        "ins": table("ins", time_ns, {"magnetic_heading_deg": wrap_360(shown)}),
        "gnss": table("gnss", time_ns, gnss),
        "discrete": table("discrete", time_ns, {"weight_on_wheels": (~in_air).astype(np.float64)}),
    }
    return Flight(tables, {"aircraft": "SIM-G"}, START_NS, True, "made.csv")


def found(flight: Flight, **settings: Any) -> GroundDeviation:
    return estimate_ground_deviation(flight, settings=MagneticGroundSettings(**settings))


def without(flight: Flight, topic: str, *names: str) -> Flight:
    """The flight without some fields of a topic."""
    source = flight[topic]
    kept = {name: column for name, column in source.columns.items() if name not in names}
    return replace(flight, tables={**flight.tables, topic: replace(source, columns=kept)})


def test_a_compass_that_shows_too_much_has_a_positive_error() -> None:
    """It shows 92.5 where magnetic heading is 90: the error is + 2.5, whatever the declination."""
    place = np.full(1, LATITUDE_DEG), np.full(1, LONGITUDE_DEG), np.zeros(1)
    declination = float(declination_along(*place, START_NS).values_deg[0])
    flight = make(true_headings_deg=(90.0 + declination,), coefficients_deg=(2.5, 0.0, 0.0, 0.0, 0.0))
    (run,) = found(flight).used
    assert run.magnetic_heading_deg == pytest.approx(92.5, abs=1e-6)
    assert run.track_deg == pytest.approx(90.0 + declination, abs=1e-6)
    assert run.error_deg == pytest.approx(2.5, abs=NOISELESS)


def test_every_run_and_the_curve_come_back_without_noise() -> None:
    answer = found(make())
    assert len(answer.used) == len(EIGHT) == answer.directions
    for run in answer.used:
        expected = float(harmonics.design(np.array([run.magnetic_heading_deg]))[0] @ COEFFICIENTS)
        assert run.error_deg == pytest.approx(expected, abs=NOISELESS)
    for letter, value in zip(LETTERS, COEFFICIENTS, strict=True):
        row = answer.coefficient(letter)
        assert row.state == "found"
        assert row.value_deg is not None
        assert abs(row.value_deg - value) < 3.0 * row.sigma_deg
    assert all(run.phase == "taxi" for run in answer.used)
    line = next(figure for figure in answer.figures if figure.name == "magnetic_ground_curve")
    expected = harmonics.design(line["magnetic_heading_deg"]) @ COEFFICIENTS
    assert np.all(np.abs(line["heading_error_deg"] - expected) < 3.0 * line["heading_error_sigma_deg"])


@pytest.mark.slow
def test_sigma_covers_the_truth() -> None:
    """100 logs (seeds 1 to 100) with their own deviation, noise, place errors and declination error."""
    scores, runs = [], []
    for seed in range(1, 101):
        rng = np.random.default_rng([seed, 7])
        truth = rng.normal(0.0, [1.0, 3.0, 3.0, 1.0, 1.0])
        off = float(rng.normal(0.0, 0.4))
        flight = make(
            coefficients_deg=tuple(truth),
            heading_noise_deg=0.4,
            velocity_noise_mps=0.03,
            place_deg=0.4,
            declination_error_deg=off,
            step_deg=0.1,
            true_headings_deg=tuple(rng.uniform(0.0, 360.0, 8)),
            speeds_mps=tuple(rng.uniform(3.5, 20.0, 8)),
            seed=seed,
        )
        answer = found(flight)
        for letter, value in zip(LETTERS, truth, strict=True):
            row = answer.coefficient(letter)
            if row.value_deg is not None:
                scores.append((row.value_deg - value) / row.sigma_deg)
        for run in answer.used:
            assert run.error_deg is not None
            assert run.sigma_deg is not None
            curve = float(harmonics.design(np.array([run.magnetic_heading_deg]))[0] @ truth)
            runs.append(float(wrap_180(run.error_deg - curve)) / np.hypot(run.sigma_deg, 0.4))
    z, along = np.array(scores), np.array(runs)
    assert len(z) > 300
    assert 0.90 <= np.mean(np.abs(z) < 1.96) <= 0.995
    assert np.mean(np.abs(z) < 3.0) > 0.99
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.15
    assert 0.90 <= np.mean(np.abs(along) < 1.96) <= 0.995


def test_turning_the_world_turns_nothing_but_the_headings() -> None:
    here = found(make(coefficients_deg=(1.0, 0.0, 0.0, 0.0, 0.0)))
    there = found(
        make(coefficients_deg=(1.0, 0.0, 0.0, 0.0, 0.0), true_headings_deg=tuple(part + 137.0 for part in EIGHT))
    )
    for one, other in zip(here.used, there.used, strict=True):
        assert other.error_deg == pytest.approx(one.error_deg, abs=SAMPLED)
        assert float(wrap_180(other.track_deg - one.track_deg)) == pytest.approx(137.0, abs=1e-6)


def test_a_flight_with_a_drift_angle_changes_nothing() -> None:
    grounded, flown = found(make()), found(make(flown=True))
    assert [run.error_deg for run in flown.used] == pytest.approx([run.error_deg for run in grounded.used], abs=1e-6)
    left = {row.reason: row.epochs for row in flown.left_out}
    assert left["airborne, or ground contact not proven"] == 120


def test_a_heading_that_lags_in_turns_is_left_to_settle() -> None:
    """Time constant 3 s: what is left of it where a run begins goes with the settle time, and without one it counts."""
    late = make(lag_s=3.0, true_headings_deg=(0, 90, 180, 270))
    worst = []
    for settle_s in (0.0, 3.0, 12.0):
        points = found(late, settle_s=settle_s).figures[0]
        expected = harmonics.design(points["magnetic_heading_deg"]) @ COEFFICIENTS
        worst.append(float(np.max(np.abs(wrap_180(points["heading_error_deg"] - expected)))))
    assert worst[0] > 1.0
    assert worst[1] < 0.6 * worst[0]
    assert worst[2] < 0.1


def test_one_direction_does_not_tell_a_from_b_and_c() -> None:
    answer = found(make(true_headings_deg=(60.0, 60.0), heading_noise_deg=0.2, velocity_noise_mps=0.02))
    assert answer.directions == 1
    assert {item.state for item in answer.coefficients} == {"not observable"}
    assert all(item.value_deg is None for item in answer.coefficients)
    assert "B" in answer.coefficient("A").reason and "C" in answer.coefficient("A").reason
    assert answer.along is None
    assert any(remark.startswith("A: not separable from") for remark in answer.remarks)


def test_opposite_runs_show_a_and_one_axis() -> None:
    """Along 040 and 220 degrees: A, and of B and C their sum on that axis alone."""
    answer = found(make(true_headings_deg=(50.0, 230.0, 50.0, 230.0), coefficients_deg=(1.0, -3.0, 2.0, 0.0, 0.0)))
    level = answer.coefficient("A")
    assert level.state == "found"
    assert level.value_deg is not None
    assert abs(level.value_deg - 1.0) < 3.0 * level.sigma_deg
    assert answer.coefficient("B").state == answer.coefficient("C").state == "not observable"
    assert answer.along is not None
    axis_rad = np.deg2rad(answer.along.axis_deg)
    nearest = min(abs(float(wrap_180(answer.along.axis_deg - run.magnetic_heading_deg))) for run in answer.used)
    assert min(nearest, abs(nearest - 180.0)) < 5.0
    truth = -3.0 * np.sin(axis_rad) + 2.0 * np.cos(axis_rad)
    assert abs(answer.along.value_deg - truth) < 3.0 * answer.along.sigma_deg
    assert 0.0 <= answer.along.axis_deg < 180.0


def test_opposite_runs_along_a_cardinal_axis_show_b_alone() -> None:
    rows = {
        run: found(make(true_headings_deg=(base, base + 180.0, base, base + 180.0)))
        for run, base in (("B", 102.0), ("C", 12.0))
    }
    for letter, other in (("B", "C"), ("C", "B")):
        assert rows[letter].coefficient(letter).state == "found"
        assert rows[letter].coefficient(other).state == "not observable"


def test_runs_that_repeat_a_heading_show_their_spread() -> None:
    steady = found(make(true_headings_deg=(60.0, 150.0) * 3, heading_noise_deg=0.2, velocity_noise_mps=0.02))
    scattered = found(
        make(true_headings_deg=(60.0, 150.0) * 3, heading_noise_deg=0.2, velocity_noise_mps=0.02, place_deg=3.0)
    )
    assert [row.runs for row in steady.repeats] == [3, 3]
    assert all(row.spread_deg < 3.0 * row.expected_deg for row in steady.repeats)
    assert max(row.spread_deg for row in scattered.repeats) > 3.0 * max(row.expected_deg for row in scattered.repeats)
    assert scattered.place_sigma_deg > 2.0 * steady.place_sigma_deg
    assert any("iron in the ground" in remark for remark in scattered.remarks)
    assert not any("iron in the ground" in remark for remark in steady.remarks)


def test_short_and_curved_runs_are_rejected_with_the_reason() -> None:
    short = found(make(true_headings_deg=(20.0, 110.0), run_s=14.0), run_min_s=10.5)
    assert {run.state for run in short.runs} == {"used", "rejected"}
    assert all("short" in run.reason and run.error_deg is None for run in short.runs if run.state == "rejected")
    flight = make(true_headings_deg=tuple(float(part) for part in np.arange(0.0, 60.0, 0.5)), run_s=1.0)
    with pytest.raises(NotAssessableError, match=r"curved: (heading|track) changed by"):
        found(flight)


def answered(flight: Flight) -> Answered:
    """The analysis of ground runs alone."""
    return run_analyses((MAGNETIC_GROUND,), flight, known_of(flight, Configuration()))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda flight: without(flight, "ins", "magnetic_heading_deg"), "no magnetic heading in the log"),
        (lambda flight: without(flight, "gnss", "velocity_north_mps"), "no GNSS velocity in the log"),
        (lambda flight: without(flight, "gnss", "latitude_deg"), "no position on the ground"),
        (
            lambda flight: without(flight, "discrete", "weight_on_wheels"),
            "ground contact is not proven: no roll and pitch",
        ),
        (lambda flight: replace(flight, has_utc=False), "no date, so no declination"),
        (lambda flight: replace(flight, tables={}), "no magnetic heading in the log"),
    ],
)
def test_what_lacks_is_said_in_a_line(change: Callable[[Flight], Flight], reason: str) -> None:
    flight = change(make())
    with pytest.raises(NotAssessableError, match=reason) as told:
        found(flight)
    assert "\n" not in str(told.value)
    answer = answered(flight)
    assert not answer.answers
    assert reason in answer.not_assessable[0].reason
    assert answer.not_assessable[0].analysis == "magnetic_ground"


@pytest.mark.parametrize(
    ("topic", "name", "value", "reason"),
    [
        ("ins", "magnetic_heading_deg", 10.0, "curved: track changed by"),
        ("ins", "magnetic_heading_deg", np.nan, "no INS heading"),
        ("gnss", "latitude_deg", 95.0, "no position on the ground"),
    ],
)
def test_a_stuck_or_impossible_sensor_gives_no_answer(topic: str, name: str, value: float, reason: str) -> None:
    flight = make()
    source = flight[topic]
    columns = {**source.columns, name: Column(np.full(len(source), value))}
    with pytest.raises(NotAssessableError, match=reason):
        found(replace(flight, tables={**flight.tables, topic: replace(source, columns=columns)}))


def test_too_slow_names_the_highest_speed() -> None:
    with pytest.raises(NotAssessableError, match=r"never above 3 m/s .* highest 2\.0 m/s"):
        found(make(speed_mps=2.0))


def test_a_stated_declination_stands_in_for_date_and_place() -> None:
    flight = replace(make(coefficients_deg=(0.0, 0.0, 0.0, 0.0, 0.0)), has_utc=False)
    place = np.full(1, LATITUDE_DEG), np.full(1, LONGITUDE_DEG), np.zeros(1)
    declination = float(declination_along(*place, START_NS).values_deg[0])
    answer = found(flight, declination_deg=declination + 1.0)
    assert answer.declination.model == "as stated"
    assert [run.error_deg for run in answer.used] == pytest.approx([1.0] * len(EIGHT), abs=NOISELESS)


def test_what_the_user_leaves_out_is_left_out() -> None:
    flight = make()
    first = found(flight).used[0]
    answer = estimate_ground_deviation(flight, excluded_s=((first.start_s - 5.0, first.end_s + 1.0),))
    assert [run.start_s for run in answer.used] == [run.start_s for run in found(flight).used[1:]]


def test_a_large_error_is_a_warning_and_a_small_one_is_not() -> None:
    for level, severities in ((1.0, ["info"]), (9.0, ["info", "warn"])):
        flight = make(coefficients_deg=(level, 0.0, 0.0, 0.0, 0.0))
        findings = answered(flight).findings["magnetic_ground"]
        assert [finding.severity for finding in findings] == severities
        assert f"{level:+.1f}" in findings[-1].text


def test_two_runs_are_not_taken_for_more_than_they_are() -> None:
    """The spread between runs is hardly known from two: sigma is no smaller than its prior makes it."""
    heading, sigma = np.array([10.0, 190.0]), np.full(2, 0.05)
    few = fit_curve(heading, np.array([1.0, 1.0]), sigma, MagneticGroundSettings())
    many = fit_curve(np.tile(heading, 10), np.ones(20), np.full(20, 0.05), MagneticGroundSettings())
    assert few.place_sigma_deg > 3.0 * many.place_sigma_deg
    quiet = MagneticGroundSettings(place_sigma_deg=0.001)
    assert np.trace(few.covariance) > np.trace(fit_curve(heading, np.ones(2), sigma, quiet).covariance)


@pytest.mark.parametrize(
    ("name", "used", "rejected", "found_letters", "reason"),
    [
        ("g1000/log_210623_141501_TEST1.csv", 5, 2, "ABC", ""),
        ("g1000/log_220416_161856_LFQA.csv", 0, 0, "", "no valid straight ground run: at 123 s: short: 3.0 s"),
        ("g1000/log_220417_125002_LFQA.csv", 4, 1, "ABC", ""),
        ("g1000/log_220502_135932_EGPN.csv", 2, 0, "", ""),
    ],
)
def test_recorded_flights(name: str, used: int, rejected: int, found_letters: str, reason: str, tmp_path: Path) -> None:
    mcap = tmp_path / "flight.mcap"
    flight = read_flight(mcap, convert_log(open_log(real_log(name)), mcap))
    answer = answered(flight)
    if reason:
        assert answer.not_assessable[0].reason.startswith(reason)
        return
    ground = answer.answers.get("magnetic_ground")
    assert isinstance(ground, GroundDeviation)
    assert ground is not None
    assert [len(ground.used), len(ground.runs) - len(ground.used)] == [used, rejected]
    assert "".join(item.letter for item in ground.coefficients if item.state == "found") == found_letters
    assert (ground.heading_step_deg, ground.track_step_deg) == (0.1, 0.1)
    assert ground.logged_variation_deg is not None
    assert abs(ground.logged_variation_deg - ground.declination.value_deg) < 0.05
    assert all(run.error_deg is not None and abs(run.error_deg) < 2.0 for run in ground.used)


# ------------------------------------------------------------------------------------------------ whole runs


@cache
def whole() -> FlightResults:
    source = Source("made.csv", "ab" * 32, 1, "flat-csv")
    given = Given("NOTIME_abababab", source, Ledger(), Clock(), (), has_lost_data=False)
    flight = make(heading_noise_deg=0.3, velocity_noise_mps=0.03, place_deg=0.3, flown=True, step_deg=0.1)
    return analyse(flight, given, Configuration())


def test_a_whole_run_tells_it_and_saves_it(tmp_path: Path) -> None:
    results = whole()
    on_ground = results.answer(GroundDeviation)
    assert on_ground is not None
    (finding,) = (one for one in results.findings if one.code.startswith("magnetic_ground."))
    assert (finding.severity, finding.code) == ("info", "magnetic_ground.found")
    assert finding.text in sentence(results)
    save(tmp_path, results, Manifest())
    saved = load(tmp_path)
    assert {"magnetic_ground_epochs", "magnetic_ground_curve"} <= set(saved.figures)
    own = {"$schema": SCHEMA["$schema"], "$ref": "#/$defs/magnetic_ground", "$defs": SCHEMA["$defs"]}
    jsonschema.Draft202012Validator(own).validate(saved.summary["results"]["magnetic_ground"])
    back = saved.results.answer(GroundDeviation)
    assert back is not None
    assert len(back.runs) == len(on_ground.runs)
    for run, other in zip(on_ground.used, back.used, strict=True):
        assert other.error_deg == pytest.approx(run.error_deg, abs=1e-4)
    assert back.to_frame("runs")["error_deg"].notna().sum() == len(back.used)


def test_the_report_shows_the_runs_without_system_3(tmp_path: Path) -> None:
    save(tmp_path, whole(), Manifest())
    section = magnetic(load(tmp_path).results)
    assert section is not None
    section = drawn_by(PLOTS, section, load(tmp_path).results)
    titles = [part.title for part in section.parts if isinstance(part, Grid | Drawing)]
    assert titles[:2] == ["Ground runs: error by heading", "Ground runs"]
    assert "Ground runs: coefficients" in [part.title for part in section.appendix if isinstance(part, Grid)]
    notes = [part.text for part in section.parts if isinstance(part, Note)]
    assert notes[0].startswith("Heading sensor: 8 straight runs in 8 directions")


def test_the_tab_shows_the_runs_without_system_3(tmp_path: Path) -> None:
    results = whole()
    write_recording(tmp_path / "flight.rrd", make(), results)
    fixed = Contents(tmp_path / "flight.rrd").fixed
    assert {
        f"/magnetic/ground_runs/error_of_the_heading/{mark}" for mark in ("01_dots/0", "03_curve", "04_bars")
    } <= set(fixed)
    on_ground = results.answer(GroundDeviation)
    assert on_ground is not None
    text = Contents(tmp_path / "flight.rrd").text("/magnetic/answer")
    assert text.startswith("# Heading sensor off by")
    run = on_ground.used[0]
    assert run.error_deg is not None and run.sigma_deg is not None
    assert escaped(f"{number(run.error_deg, 2, signed=True)} ± {run.sigma_deg:.2f}") in text


@pytest.mark.parametrize(
    ("definition", "dataclass"),
    [
        ("magnetic_ground", answers.GroundDeviation),
        ("ground_run", answers.GroundRun),
        ("left_out", answers.LeftOut),
        ("ground_coefficient", answers.GroundCoefficient),
        ("along_axis", answers.AlongAxis),
        ("repeat", answers.Repeat),
    ],
)
def test_schema_lists_what_the_dataclasses_hold(definition: str, dataclass: type) -> None:
    expect_fields(definition, dataclass)


def test_settings_are_read_and_mistakes_named(tmp_path: Path) -> None:
    path = tmp_path / "c.toml"
    path.write_text("[magnetic_ground]\nsettle_s = 5\n", encoding="utf-8")
    assert load_configuration(path).settings.of(MagneticGroundSettings).settle_s == 5.0
    path.write_text("[magnetic_ground]\nsettle = 5\n", encoding="utf-8")
    with pytest.raises(SettingsError, match="settle"):
        load_configuration(path)
    with pytest.raises(SettingsError, match="speed_min_mps"):
        MagneticGroundSettings(speed_min_mps=90.0)
