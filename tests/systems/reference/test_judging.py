"""Against the reference: errors with known truth, intervals of correlated errors, arms, clocks, what judges nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Rank
from groundstation.pipeline.many_flights.fleet.rows import shares_of
from groundstation.pipeline.one_flight.analyse import Answered, answers_of
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.results.files import save
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Manifest
from groundstation.simulation.flight import simulate
from groundstation.simulation.processes import gauss_markov
from groundstation.systems.known import Known
from groundstation.systems.reference.analysis import REFERENCE
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.systems.reference.chapter import reference as chapter
from groundstation.systems.reference.columns import REFERENCE_COLUMNS
from groundstation.systems.reference.errors import Errors, errors_of, turned_arm
from groundstation.systems.reference.paths import path_rows
from groundstation.systems.reference.placing import fit_place
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.systems.reference.statistics import share_of, spread_of
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight, Table
from tests.report_example import example
from tests.saved import load
from tests.simulated_flights import FLIGHT_LEGS, quiet
from tests.told import chapter_of

START_NS = 1_777_874_400_000_000_000
ORIGIN = 55.97, 37.41
ROUNDING_M = 2e-3  # of metres on the ellipsoid to degrees and back, by radii at slightly different places
RESOLUTION_DEG = 1e-2  # of what the simulated INS writes


def motion(count: int = 3_000, step_s: float = 0.2) -> tuple[np.ndarray, ...]:
    """A ride with a full turn every two minutes and a speed that changes: times, place, velocity, heading."""
    time_s = np.arange(count) * step_s
    heading = np.cumsum(np.where(time_s % 120.0 < 20.0, 18.0, 0.0) * step_s)
    speed = 8.0 + 3.0 * np.sin(2.0 * np.pi * time_s / 97.0)
    velocity = speed[:, None] * np.stack([np.cos(np.deg2rad(heading)), np.sin(np.deg2rad(heading))], axis=1)
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * step_s, axis=0)])
    return time_s, place, velocity, heading % 360.0


def table(topic: str, time_s: np.ndarray, place: np.ndarray, **columns: np.ndarray) -> Table:
    latitude, longitude = latitude_longitude_deg(place[:, 0], place[:, 1], *ORIGIN)
    found = {"latitude_deg": latitude, "longitude_deg": longitude, **columns}
    time_ns = START_NS + np.round(time_s * NS_PER_S).astype(np.int64)
    index = np.arange(len(time_s))
    return Table(topic, time_ns, {name: Column(np.asarray(one)) for name, one in found.items()}, index, Column(time_ns))


def ride(away: np.ndarray | float = 0.0, **sigmas: float) -> Flight:
    """A receiver that errs by ``away`` (n, 2) metres, and the truth beside it."""
    time_s, place, velocity, heading = motion()
    speeds = {"velocity_north_mps": velocity[:, 0], "velocity_east_mps": velocity[:, 1]}
    claims = {name: np.full(len(time_s), value) for name, value in sigmas.items()}
    true = table("truth", time_s, place, true_heading_deg=heading, **speeds)
    return Flight({"truth": true, "gnss": table("gnss", time_s, place + away, **speeds, **claims)}, {}, START_NS, True)


def judged(flight: Flight, **settings: float) -> ReferenceResult:
    known = Known(flight_phases(flight.without("truth")))
    return REFERENCE.run(flight, known, ReferenceSettings(**settings)).answer


def codes(flight: Flight, **settings: float) -> dict[str, str]:
    known = Known(flight_phases(flight.without("truth")))
    return {one.code: one.text for one in REFERENCE.run(flight, known, ReferenceSettings(**settings)).findings}


def error_of(answer: ReferenceResult, axis: str, quantity: str = "position", subject: str = "gnss") -> float:
    row = answer.error(subject, quantity, axis)
    assert row is not None
    return row.spread.mean


@pytest.fixture(scope="module")
def flown() -> Flight:
    """A flight whose INS errs by 1 deg in heading and by nothing else."""
    return simulate(quiet(legs=FLIGHT_LEGS, ins={"azimuth_error_deg": 1.0})).flight


@pytest.fixture(scope="module")
def answered(flown: Flight) -> Answered:
    return answers_of(flown, Configuration())[0]


def test_a_flight_without_errors_has_none(answered: Answered) -> None:
    answer = answered.answers["reference"]
    assert isinstance(answer, ReferenceResult)
    assert answer.is_judge
    rows = {(row.subject, row.quantity, row.axis): row.spread for row in answer.errors}
    assert {row.subject for row in answer.errors} >= {"gnss", "ins", "heading"}
    assert (
        max(spread.rmse for (subject, of, _axis), spread in rows.items() if (subject, of) == ("ins", "velocity")) < 1e-3
    )
    assert max(rows["ins", "attitude", axis].rmse for axis in ("roll", "pitch")) < RESOLUTION_DEG
    assert rows["ins", "attitude", "heading"].mean == pytest.approx(1.0, abs=RESOLUTION_DEG)
    (check,) = answer.headings
    assert check.seen_deg == pytest.approx(1.0, abs=RESOLUTION_DEG)
    assert check.is_inside


@pytest.mark.parametrize("sigma", [5e-324, 1e-320, 1e-300, 1e-160, 0.0])
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_sigma_of_nothing_is_no_claim(sigma: float) -> None:
    """What is left over of a zero is told by no device: nothing is divided by it, and the errors are judged as ever."""
    away = np.random.default_rng(39).normal(0.0, 1.0, (3_000, 2))
    names = ("horizontal_sigma_m", "velocity_sigma_mps", "vertical_sigma_m", "true_heading_sigma_deg")
    answer = judged(ride(away, **dict.fromkeys(names, sigma)))
    assert not answer.claims
    assert answer.errors == judged(ride(away)).errors
    assert judged(ride(away, horizontal_sigma_m=1.4)).claims


def test_signs_of_every_axis() -> None:
    """Error = subject - reference: ahead, to the right and above are positive."""
    time_s = np.arange(0.0, 100.0, 1.0)
    place = np.stack([np.zeros(100), 10.0 * time_s], axis=1)  # eastwards: right is south
    speeds = {"velocity_north_mps": np.zeros(100), "velocity_east_mps": np.full(100, 10.0)}
    true = table(
        "truth", time_s, place, altitude_msl_m=np.full(100, 50.0), true_heading_deg=np.full(100, 359.0), **speeds
    )
    down = {"velocity_down_mps": np.full(100, -2.0)}
    seen = table(
        "ins",
        time_s,
        place + np.array([-3.0, 4.0]),
        altitude_msl_m=np.full(100, 57.0),
        true_heading_deg=np.full(100, 2.0),
        **speeds,
        **down,
    )
    true = replace(true, columns={**true.columns, "velocity_down_mps": Column(np.zeros(100))})
    answer = judged(Flight({"truth": true, "ins": seen}, {}, START_NS, True))
    expected = {
        ("position", "along"): 4.0,
        ("position", "cross"): 3.0,
        ("position", "horizontal"): 5.0,
        ("position", "vertical"): 7.0,
        ("velocity", "vertical"): 2.0,
        ("attitude", "heading"): 3.0,
    }
    for (quantity, axis), value in expected.items():
        assert error_of(answer, axis, quantity, "ins") == pytest.approx(value, abs=ROUNDING_M)


def test_heights_of_different_kinds_are_not_compared() -> None:
    flight = ride()
    tables = dict(flight.tables)
    height = {"altitude_ellipsoid_m": Column(np.full(3_000, 200.0))}
    tables["truth"] = replace(tables["truth"], columns={**tables["truth"].columns, **height})
    tables["gnss"] = replace(
        tables["gnss"], columns={**tables["gnss"].columns, "altitude_msl_m": height["altitude_ellipsoid_m"]}
    )
    assert judged(replace(flight, tables=tables)).error("gnss", "position", "vertical") is None


@pytest.mark.parametrize("shown_hz", [1.0, 5.0])
def test_the_faster_of_the_two_is_interpolated(shown_hz: float) -> None:
    time_s, place, _velocity, _heading = motion()
    rows = slice(None, None, round(5.0 / shown_hz))
    fast, slow = table("gnss", time_s, place), table("truth", time_s[rows], place[rows])
    for seen, true in ((fast, slow), (slow, fast)):
        errors = errors_of("gnss", seen, true, START_NS, settings=ReferenceSettings())
        assert errors is not None
        assert len(errors) == len(slow)
        assert float(np.nanmax(errors.horizontal_m)) < ROUNDING_M


def test_intervals_hold_for_correlated_errors() -> None:
    """Coverage of 95 % intervals: 100 series of 20 correlation times; 0.05 is two sigmas of a share of 0.95."""
    rng = np.random.default_rng(11)
    held = np.zeros(3)
    series = gauss_markov(rng, (100, 1_000), 1.0, 1.0, 25.0)
    for values in series:
        found = spread_of(values)
        assert found.mean95 and found.rmse95 and found.std95
        for place, (bounds, true) in enumerate(((found.mean95, 0.0), (found.rmse95, 1.0), (found.std95, 1.0))):
            held[place] += bounds[0] <= true <= bounds[1]
    assert (held / 100 >= 0.90).all()
    states = [share_of(np.abs(values) <= 1.96, values[:, None]).state for values in series]
    assert sum(state in ("too_sure", "too_careful") for state in states) <= 10


def test_claims_are_told_apart() -> None:
    rng = np.random.default_rng(12)
    values = gauss_markov(rng, (1, 3_000), 1.0, 1.0, 5.0)[0]
    expected = {1.0: "consistent", 0.5: "too_sure", 4.0: "too_careful"}
    for sigma, state in expected.items():
        assert share_of(np.abs(values) <= 1.96 * sigma, values[:, None] / sigma).state == state
    lasting = np.full((3_000, 1), 1.5)
    assert share_of(np.abs(lasting[:, 0]) <= 1.96, lasting).effective_samples == pytest.approx(1.0, abs=0.1)
    assert share_of(np.abs(lasting[:, 0]) <= 1.96, lasting).state == "too_few"
    assert share_of(np.zeros(3_000, dtype=bool), np.full((3_000, 1), 10.0)).state == "too_sure"


def test_a_reference_that_is_the_logs_own_solution_judges_nothing() -> None:
    for sigmas, away in (({}, 0.0), ({"horizontal_sigma_m": 0.014}, 0.001)):
        answer = judged(ride(np.array([away, 0.0]), **sigmas))
        assert not answer.is_judge
        assert "the solution of gnss itself" in answer.reason
        assert all(row.state != "too_sure" for row in answer.claims)


def test_arm_and_clock_are_found_and_the_arm_is_taken_out() -> None:
    time_s, _place, velocity, heading = motion()
    rng = np.random.default_rng(13)
    noise = gauss_markov(rng, (2, len(time_s)), 0.2, 0.1, 3.0).T
    flight = ride(turned_arm(heading, 2.0, -0.7) - 0.15 * velocity + noise + (1.0, -2.0))
    (placed,) = judged(flight).placed
    assert (placed.arm_state, placed.is_arm_taken_out) == ("observed", True)
    assert placed.arm_half_width_m is not None
    assert placed.clock_offset95_s is not None
    assert placed.arm_forward_m == pytest.approx(2.0, abs=placed.arm_half_width_m)
    assert placed.arm_right_m == pytest.approx(-0.7, abs=placed.arm_half_width_m)
    low, high = placed.clock_offset95_s
    assert low < 0.15 < high
    assert high - low < 0.1
    assert placed.rmse_m < placed.rmse_with_arm_m


def test_a_stated_arm_is_taken_at_its_word() -> None:
    _time_s, _place, _velocity, heading = motion()
    (placed,) = judged(ride(turned_arm(heading, 3.0, 1.0)), arm_forward_m=3.0, arm_right_m=1.0).placed
    assert placed.arm_state == "stated"
    assert placed.rmse_m < ROUNDING_M < 3.0 < placed.rmse_with_arm_m


def test_without_turns_an_arm_is_not_observable() -> None:
    time_s = np.arange(0.0, 600.0, 0.5)
    place = np.stack([8.0 * time_s, np.zeros(len(time_s))], axis=1)
    nothing = np.zeros((len(time_s), 3))
    error = np.column_stack([np.full(len(time_s), 2.0), nothing[:, 0], nothing[:, 0]])
    velocity = np.stack([np.full(len(time_s), 8.0), nothing[:, 0]], axis=1)
    errors = Errors("gnss", time_s, error, nothing, nothing, place, velocity, nothing[:, 0], {}, {})
    assert fit_place(errors) is None


def test_a_turned_path_is_turned_back() -> None:
    time_s, place, velocity, heading = motion()
    turn = np.deg2rad(2.0)
    turned = place @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    nothing = np.zeros((len(time_s), 3))
    error = np.column_stack([turned - place + (3.0, 4.0), nothing[:, 0]])
    rows = {
        row.alignment: row
        for row in path_rows(Errors("a", time_s, error, nothing, nothing, place, velocity, heading, {}, {}))
    }
    assert rows["shift_and_yaw"].rmse_m < 1e-6 < rows["shift"].rmse_m < rows["none"].rmse_m
    assert rows["shift_and_yaw"].yaw_deg == pytest.approx(-2.0)


def test_the_corrected_heading_is_interpolated_across_north(answered: Answered) -> None:
    time_s, place, _velocity, heading = motion()
    nose_deg = np.unwrap(heading, period=360.0) + 40.0
    between_s = time_s[:-2:3] + 0.1  # a reference with other, fewer samples
    middle = np.stack([np.interp(between_s, time_s, axis) for axis in place.T], axis=1)
    true_deg = np.interp(between_s, time_s, nose_deg) % 360.0
    true = table("truth", between_s, middle, true_heading_deg=true_deg)
    ins = table("ins", time_s, place, true_heading_deg=(nose_deg + 3.0) % 360.0)
    flight = Flight({"truth": true, "ins": ins}, {}, START_NS, True)
    found = replace(answered.answers["heading"], ins_topic="ins", error_deg=3.0)
    known = Known(flight_phases(flight.without("truth")), answers={"heading": found})
    row = REFERENCE.run(flight, known, ReferenceSettings()).answer.error("heading", "attitude", "heading")
    assert row is not None
    assert max(abs(row.spread.smallest), abs(row.spread.largest)) < 1e-6


def test_a_clock_off_by_leap_seconds_judges_nothing_until_it_is_shifted() -> None:
    flight = ride(np.array([2.0, 0.0]))
    truth = flight["truth"]
    late = replace(flight, tables={**flight.tables, "truth": replace(truth, time_ns=truth.time_ns + 18 * NS_PER_S)})
    answer = judged(late)
    assert not answer.is_judge
    assert "clock" in answer.reason
    told = codes(late)["reference.clock"]
    assert "the log shows the motion 18.00 s earlier" in told
    assert "leap seconds" in told
    assert judged(late).reason == "its clock is 18.0 s fast by motion"
    assert "clock_offset_s = -18.00" in told
    mended = judged(late, clock_offset_s=-18.0)
    assert mended.is_judge
    assert error_of(mended, "horizontal") == pytest.approx(2.0, abs=ROUNDING_M)


def test_another_place_datum_and_a_coarse_reference_are_told() -> None:
    far = judged(ride(np.array([5_000.0, 0.0])))
    assert not far.is_judge
    assert "5.0 km away" in far.reason
    flight = ride(np.array([5_000.0, 0.0]))
    later = replace(flight, tables={"truth": flight["truth"], "gnss.b": replace(flight["gnss"], topic="gnss.b")})
    assert "5.0 km away" in judged(later).reason
    assert "datum" in codes(ride(np.array([90.0, 70.0])))["reference.constant_offset"]
    rng = np.random.default_rng(14)
    flight = ride(rng.normal(0.0, 1.0, (3_000, 2)), horizontal_sigma_m=1.4)
    truth = flight["truth"]
    coarse = {**truth.columns, "horizontal_sigma_m": Column(np.full(3_000, 5.0))}
    only_place = {name: one for name, one in coarse.items() if "velocity" not in name and "heading" not in name}
    answer = judged(replace(flight, tables={**flight.tables, "truth": replace(truth, columns=only_place)}))
    assert not answer.is_judge
    assert {row.state for row in answer.claims} == {"reference_too_coarse"}
    told = chapter(replace(example(), answers={"reference": answer}))
    assert told is not None and told.claim is not None and told.claim.rank is Rank.OTHER, "no page opens with it"


def test_too_little_in_common_is_a_reason() -> None:
    flight = ride()
    one = replace(flight, tables={**flight.tables, "truth": flight["truth"].take(slice(0, 1))})
    found, _known = answers_of(one, Configuration())
    assert "reference" not in found.answers
    assert "samples of the log and the reference together" in found.reasons["reference"]
    nothing = {name: Column(np.full(3_000, np.nan)) for name in flight["truth"].columns}
    absent = replace(flight, tables={**flight.tables, "truth": replace(flight["truth"], columns=nothing)})
    assert "reference" not in answers_of(absent, Configuration())[0].answers


def test_gaps_are_not_interpolated_over() -> None:
    flight = ride()
    keep = np.ones(3_000, dtype=bool)
    keep[500:1500] = False
    answer = judged(replace(flight, tables={**flight.tables, "truth": flight["truth"].take(keep)}))
    row = answer.error("gnss", "position", "horizontal")
    assert row is not None
    assert row.spread.samples == 2_000
    assert answer.longest_gap_s == pytest.approx(200.2)
    assert answer.covered_share == pytest.approx(2 / 3, abs=0.01)


def test_no_answer_but_the_judgement_depends_on_the_truth(flown: Flight, answered: Answered) -> None:
    without = answers_of(flown.without("truth"), Configuration())[0]
    assert set(answered.answers) - set(without.answers) == {"reference"}
    for name, answer in without.answers.items():
        assert repr(answered.answers[name]) == repr(answer)
    assert without.not_assessable == answered.not_assessable


def test_the_chapter_tells_claimed_against_seen_and_a_fleet_counts_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(15)
    flight = ride(rng.normal(0.0, 2.0, (3_000, 2)), horizontal_sigma_m=1.4)
    found = answers_of(flight, Configuration())[0]
    results = FlightResults(
        "A", Source("a.csv", "ab" * 32, 1, "test"), {}, START_NS, 600.0, "ok", answers=found.answers
    )
    text = markdown(chapter_of(results, found.answers["reference"]))
    assert "too sure" in text
    assert "Claimed against seen" in text
    figures = found.answers["reference"].figures
    save(tmp_path, replace(results, figures=figures), Manifest())
    checks = [check for share in shares_of(load(tmp_path)) for check in share.checks]
    claim = judged(flight).claim("gnss", "position", "horizontal")
    assert claim is not None
    assert {check.quantity for check in checks} == {"truth_gnss"}
    assert len(checks) == int(claim.effective_samples)
    share = sum(check.is_inside for check in checks) / len(checks)
    assert share == pytest.approx(claim.share_inside95, abs=0.05)


def test_the_columns_of_a_fleet_are_those_of_the_first_of_a_kind_whatever_its_name() -> None:
    """In a joined flight the one receiver is ``gnss.b``, where the first log has none."""
    rng = np.random.default_rng(15)
    flight = ride(rng.normal(0.0, 2.0, (3_000, 2)), horizontal_sigma_m=1.4)
    tables = {("gnss.b" if topic == "gnss" else topic): one for topic, one in flight.tables.items()}
    alone, joined = judged(flight), judged(replace(flight, tables=tables))
    for column in REFERENCE_COLUMNS:
        assert column.value(joined) == column.value(alone), column.name
    by_name = {column.name: column.value(joined) for column in REFERENCE_COLUMNS}
    assert by_name["gnss_reference_rmse_m"] == pytest.approx(2.0 * np.sqrt(2.0), rel=0.05)
    assert by_name["gnss_inside95_share"] is not None
