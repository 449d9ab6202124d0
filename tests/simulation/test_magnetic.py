"""Magnetometer, current and deviation against formulas; figure-eights of the scenarios; the family for Monte Carlo."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.angles import FloatArray, unwrap, wrap_180
from groundstation.base.declination import declination_along
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.simulation.deviation import (
    BIN_MIDDLES_DEG,
    deviation_truth,
    levelled_heading_deg,
    scenario_deviation,
)
from groundstation.simulation.flight import Simulated, scenario_truth, simulate
from groundstation.simulation.legs import AirTurn
from groundstation.simulation.magnetic_family import (
    MagneticFamilySettings,
    draw_magnetic_scenario,
    simulate_magnetic_family,
)
from groundstation.simulation.magnetometer import world_field_nt
from groundstation.simulation.scenario import Anomaly, MagnetometerSettings, load_scenario
from groundstation.systems.heading.estimate import estimate_heading_error
from groundstation.tables.table import Flight
from tests.simulated_flights import FLIGHT_LEGS, TAXI_LEGS, quiet, scenario

HORIZONTAL_NT, DOWN_NT = 17e3, 50e3  # the design's field: the sensor lies in a field that dips by 71 deg
FIELD_NT = np.array([HORIZONTAL_NT, 0.0, DOWN_NT])
PERFECT = MagnetometerSettings(hard_iron_nt=(0.0, 0.0, 0.0))
EXACT = {"hard_iron_nt": [0.0, 0.0, 0.0], "noise_nt": 0.0, "resolution_nt": 0.001}
ROUND_TURN = [{"kind": "parked", "duration_s": 5}, {"kind": "ground_turn", "angle_deg": 370}]
LONG_STAND = [{"kind": "parked", "duration_s": 3000}]
BIN_DEG = 0.01  # what linear interpolation in tables of 0.25 and 1 deg leaves of deviations of some degrees


def field_body_nt(flight: Flight) -> FloatArray:
    return np.stack(
        [flight["magnetometer"].values(f"field_{axis}_nt") for axis in ("forward", "right", "down")], axis=1
    )


def shown_deg(flight: Flight, attitude: str) -> FloatArray:
    """Magnetic heading at the samples of the magnetometer, levelled with roll and pitch of a topic."""
    table, at_ns = flight[attitude], flight["magnetometer"].time_ns
    roll, pitch = (np.interp(at_ns, table.time_ns, table.values(name)) for name in ("roll_deg", "pitch_deg"))
    return levelled_heading_deg(field_body_nt(flight), roll, pitch)


def truth_at_magnetometer(flight: Flight, name: str) -> FloatArray:
    place = np.searchsorted(flight["truth"].time_ns, flight["magnetometer"].time_ns)
    return flight["truth"].values(name)[place]


def with_matrix(matrix: FloatArray, **changes: Any) -> MagnetometerSettings:
    one, two, three = (tuple(row) for row in matrix.tolist())
    return replace(PERFECT, soft_iron=(one, two, three), **changes)


@pytest.mark.parametrize("seed", range(5))
def test_hard_iron_is_the_semicircular_deviation(seed: int) -> None:
    """B = -P / H, C = -Q / H (radians), to the first order; R does nothing in level flight."""
    iron = 100.0 * np.random.default_rng(seed).standard_normal(3)
    found = deviation_truth(replace(PERFECT, hard_iron_nt=tuple(iron.tolist())), FIELD_NT).coefficients_deg
    second_order = float(np.rad2deg(np.max((iron[:2] / HORIZONTAL_NT) ** 2)))
    assert found["B"] == pytest.approx(-np.rad2deg(iron[0] / HORIZONTAL_NT), abs=second_order)
    assert found["C"] == pytest.approx(-np.rad2deg(iron[1] / HORIZONTAL_NT), abs=second_order)
    assert max(abs(found[letter]) for letter in "ADE") < second_order


@pytest.mark.parametrize("seed", range(5))
def test_soft_iron_is_the_quadrantal_and_the_circular_deviation(seed: int) -> None:
    """I + (a b c; d e f; ...): D = (e - a) / 2, E = -(b + d) / 2, A = (b - d) / 2; c and f with Z are B and C."""
    added = 0.003 * np.random.default_rng(seed).standard_normal((3, 3))
    (a, b, c), (d, e, f), _last = added.tolist()
    found = deviation_truth(with_matrix(np.eye(3) + added), FIELD_NT).coefficients_deg
    dip = DOWN_NT / HORIZONTAL_NT
    expected = {"A": (b - d) / 2, "B": -c * dip, "C": -f * dip, "D": (e - a) / 2, "E": -(b + d) / 2}
    second_order = float(np.rad2deg(2.0 * max(abs(a), abs(b), abs(c) * dip, abs(d), abs(e), abs(f) * dip) ** 2))
    for letter, value in expected.items():
        assert found[letter] == pytest.approx(np.rad2deg(value), abs=second_order), letter


def test_a_turned_sensor_is_a_circular_error_and_scale_a_quadrantal_one() -> None:
    """A sensor whose forward axis points 1.5 deg to the right shows 1.5 deg too much: worked example of the sign."""
    turned = deviation_truth(replace(PERFECT, misalignment_deg=(0.0, 0.0, 1.5)), FIELD_NT)
    assert np.allclose(turned.compass_error_deg, 1.5, atol=1e-9) and np.allclose(turned.deviation_deg, -1.5, atol=1e-9)
    rolled = deviation_truth(replace(PERFECT, misalignment_deg=(0.2, 0.0, 0.0)), FIELD_NT).coefficients_deg
    assert rolled["C"] == pytest.approx(-0.2 * DOWN_NT / HORIZONTAL_NT, abs=0.01)  # down leaks into right
    scaled = deviation_truth(replace(PERFECT, scale=(1.0, 1.004, 1.0)), FIELD_NT).coefficients_deg
    assert scaled["D"] == pytest.approx(np.rad2deg(0.002), abs=0.001)


def test_declination_stands_in_the_error_and_not_in_the_deviation() -> None:
    east = deviation_truth(PERFECT, np.array([HORIZONTAL_NT, HORIZONTAL_NT * np.tan(np.deg2rad(10.0)), DOWN_NT]))
    assert east.declination_deg == pytest.approx(10.0)
    assert np.allclose(east.compass_error_deg, -10.0, atol=1e-9)  # true = magnetic + declination
    assert np.allclose(east.deviation_deg, 0.0, atol=1e-9)


def test_iron_stronger_than_the_field_has_no_table() -> None:
    truth = deviation_truth(replace(PERFECT, hard_iron_nt=(20e3, 0.0, 0.0)), FIELD_NT)
    assert np.isnan(truth.compass_error_deg).all() and np.isnan(truth.coefficients_deg["B"])


def patent_average_deg(settings: MagnetometerSettings, bank_deg: float) -> FloatArray:
    """Both branches averaged at equal magnetic headings, by 1 deg bins."""
    right, left = (deviation_truth(settings, FIELD_NT, roll_deg=side * bank_deg) for side in (1.0, -1.0))
    return 0.5 * (right.compass_error_deg + left.compass_error_deg)


def test_average_over_branches_is_biased_as_the_square_of_the_bank() -> None:
    """The design's figures: 0.12, 0.46, 1.04 deg rms for 1500 nT and 0.02 (sigma of every element), 17 and 50 uT."""
    rng, banks = np.random.default_rng(1), (10.0, 20.0, 30.0)
    squares, one_branch = np.zeros(3), 0.0
    draws = 120
    for _ in range(draws):
        soft, hard = np.eye(3) + 0.02 * rng.standard_normal((3, 3)), 1500.0 * rng.standard_normal(3)
        settings = with_matrix(soft, hard_iron_nt=tuple(hard.tolist()))
        level = deviation_truth(settings, FIELD_NT).compass_error_deg
        squares += [np.mean((patent_average_deg(settings, bank) - level) ** 2) / draws for bank in banks]
        alone = deviation_truth(settings, FIELD_NT, roll_deg=20.0).compass_error_deg
        one_branch += float(np.mean((alone - level) ** 2)) / draws
    # some five free harmonics a draw: sampling error of an rms 1 / sqrt(2 * 5 * 120) = 3 %, four times that allowed
    assert np.sqrt(squares).tolist() == pytest.approx([0.12, 0.46, 1.04], rel=0.12)
    assert np.sqrt(one_branch) > 3.0 * np.sqrt(squares[1])


def test_field_that_is_odd_in_bank_averages_out_and_an_even_one_does_not() -> None:
    odd, even = replace(PERFECT, bank_odd_nt=(0.0, 300.0, 0.0)), replace(PERFECT, bank_even_nt=(300.0, 0.0, 0.0))
    alone = deviation_truth(odd, FIELD_NT, roll_deg=20.0).compass_error_deg
    assert np.max(np.abs(alone)) == pytest.approx(np.rad2deg(300.0 * np.sin(np.deg2rad(20.0)) / 17e3), rel=0.1)
    assert np.max(np.abs(patent_average_deg(odd, 20.0))) < 0.02
    as_iron = replace(PERFECT, hard_iron_nt=(300.0 * np.sin(np.deg2rad(20.0)) ** 2, 0.0, 0.0))
    assert np.allclose(patent_average_deg(even, 20.0), patent_average_deg(as_iron, 20.0), atol=1e-9)


def test_half_a_degree_of_roll_is_one_and_a_half_degrees_of_heading() -> None:
    """Where Z / H = 3 the error is 3 * 0.5 deg * cos(heading), as the design says."""
    field = [HORIZONTAL_NT, 0.0, 3.0 * HORIZONTAL_NT]
    flight = simulate(
        quiet(legs=ROUND_TURN, ins={"roll_error_deg": 0.5}, magnetometer=EXACT | {"world_field_nt": field})
    ).flight
    heading = truth_at_magnetometer(flight, "true_heading_deg")
    error = wrap_180(shown_deg(flight, "ins") - heading)
    assert np.max(np.abs(error)) == pytest.approx(1.5, abs=0.02)
    assert np.allclose(np.abs(error), np.abs(1.5 * np.cos(np.deg2rad(heading))), atol=0.03)
    assert np.max(np.abs(wrap_180(shown_deg(flight, "truth") - heading))) < 1e-3


def test_the_worlds_field_has_its_error_and_a_wave_of_the_crust() -> None:
    """Phase 90 deg at the stand: all along the wave; a quarter of a wave further all down, and sideways no change."""
    made = scenario(legs=ROUND_TURN)
    still = simulate(made).trajectory.at(np.array([0, 0, 0]))
    quarter_deg = float(np.rad2deg(2_500.0 / SEMI_MAJOR_M))
    moved = replace(still, latitude_deg=still.latitude_deg + np.array([0.0, 0.0, quarter_deg]))
    moved = replace(moved, longitude_deg=moved.longitude_deg + np.array([0.0, 0.1, 0.0]))
    settings = MagnetometerSettings(
        world_field_nt=(16e3, 3e3, 50e3),
        field_error_nt=(1.0, 2.0, 3.0),
        anomaly=Anomaly(amplitude_nt=100.0, wavelength_m=10_000.0, direction_deg=0.0, phase_deg=90.0),
    )
    more = world_field_nt(moved, made, settings) - np.array([16_001.0, 3_002.0, 50_003.0])
    assert more == pytest.approx(np.array([[100.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 0.0, 100.0]]), abs=1e-6)


@pytest.mark.parametrize("name", ["magnetic-eight", "magnetic-hard"])
def test_heading_shown_with_its_deviation_is_the_true_heading(name: str) -> None:
    loaded = load_scenario(name)
    assert loaded.magnetometer is not None
    exact = replace(loaded.magnetometer, noise_nt=0.0, correlated_nt=0.0, latency_s=0.0, resolution_nt=0.001)
    exact = replace(exact, world_field_nt=(16e3, 3e3, 50e3))
    ins = replace(loaded.ins, attitude_noise_deg=0.0, attitude_wander_deg=0.0, attitude_resolution_deg=1e-6)
    simulated = simulate(replace(loaded, magnetometer=exact, ins=ins))
    deviation = scenario_deviation(simulated.scenario, simulated.trajectory)
    assert deviation is not None and abs(scenario_truth(simulated)["deviation_b_deg"]) > 1.0
    flight = simulated.flight
    base = np.interp(flight["magnetometer"].time_ns, flight["electric"].time_ns, flight["electric"].values("current_a"))
    level = (np.abs(truth_at_magnetometer(flight, "roll_deg")) < 1e-6) & (base < 13.0)
    level &= np.abs(truth_at_magnetometer(flight, "pitch_deg") - 4.0) < 1e-6
    shown = shown_deg(flight, "ins")[level]
    correction = np.interp(shown, BIN_MIDDLES_DEG, deviation.deviation_deg, period=360.0)
    corrected = shown + correction + deviation.declination_deg
    error = wrap_180(corrected - truth_at_magnetometer(flight, "true_heading_deg")[level])
    assert level.sum() > 500 and np.max(np.abs(error)) < BIN_DEG


def test_field_is_that_of_the_declination_tables() -> None:
    simulated = simulate(quiet(legs=ROUND_TURN, magnetometer=EXACT))
    flight, motion = simulated.flight, simulated.trajectory
    here = motion.latitude_deg[:1], motion.longitude_deg[:1], motion.altitude_m[:1]
    expected = declination_along(*here, flight.start_ns)
    found = scenario_deviation(simulated.scenario, simulated.trajectory)
    # the decimal years of the two are up to three days apart, and the field changes by 0.15 deg and 50 nT a year
    assert found is not None and found.declination_deg == pytest.approx(float(expected.values_deg[0]), abs=2e-3)
    assert found.horizontal_nt == pytest.approx(float(expected.horizontal_nt[0]), abs=0.5)


def test_current_couples_into_the_field_and_is_logged() -> None:
    loads = [{"from_s": 10, "to_s": 20, "current_a": 30.0}, {"from_s": 15, "to_s": 30, "current_a": 10.0}]
    electric = {"base_a": 5.0, "loads": loads, "rate_hz": 10, "noise_a": 0.0}
    still: dict[str, Any] = {"legs": [{"kind": "parked", "duration_s": 40}], "electric": electric}
    plain = simulate(quiet(magnetometer=EXACT, **still)).flight
    coupled = simulate(quiet(magnetometer=EXACT | {"current_nt_per_a": [2.0, -1.0, 0.5]}, **still)).flight
    current, time_s = coupled["electric"].values("current_a"), coupled.time_s("electric")
    expected = 5.0 + 30.0 * ((time_s >= 10) & (time_s < 20)) + 10.0 * ((time_s >= 15) & (time_s < 30))
    assert np.array_equal(current, expected) and np.array_equal(time_s, coupled.time_s("magnetometer"))
    difference = field_body_nt(coupled) - field_body_nt(plain)
    assert np.allclose(difference, current[:, None] * [2.0, -1.0, 0.5], atol=0.002)


@pytest.mark.parametrize("seed", (1, 2))
def test_noise_is_white_and_correlated_as_asked(seed: int) -> None:
    noise = EXACT | {"noise_nt": 20.0, "correlated_nt": 30.0, "correlation_s": 5.0}
    field = field_body_nt(simulate(quiet(legs=LONG_STAND, magnetometer=noise), seed).flight)
    centred = field - field.mean(axis=0)
    # 3 axes x 300 correlation times: the slow variance is known to 5 %, four times that allowed
    assert float(np.mean(centred**2)) == pytest.approx(20.0**2 + 30.0**2, rel=0.15)
    assert float(np.mean(centred[50:] * centred[:-50])) == pytest.approx(30.0**2 * np.exp(-1.0), rel=0.4)


def test_latency_moves_the_record_and_not_the_field() -> None:
    prompt, late = (
        simulate(quiet(magnetometer=EXACT | {"latency_s": latency_s}, legs=ROUND_TURN)).flight
        for latency_s in (0.0, 0.2)
    )
    assert np.array_equal(late["magnetometer"].time_ns, prompt["magnetometer"].time_ns[:-2] + 200_000_000)
    assert np.array_equal(field_body_nt(late), field_body_nt(prompt)[:-2])


def test_attitude_of_the_ins_errs_as_asked() -> None:
    ins = {"roll_error_deg": 0.4, "pitch_error_deg": -0.2, "attitude_wander_deg": 0.1, "attitude_wander_s": 10.0}
    flight = simulate(quiet(legs=LONG_STAND, ins=ins | {"rate_hz": 10})).flight
    for name, mean in (("roll_deg", 0.4), ("pitch_deg", -0.2)):
        values = flight["ins"].values(name)
        # 300 correlation times: the mean errs by 0.1 sqrt(2 / 300), the deviation by 6 %; four times that allowed
        assert float(np.mean(values)) == pytest.approx(mean, abs=0.033)
        assert float(np.std(values)) == pytest.approx(0.1, rel=0.25)


def test_bank_grows_through_a_turn_and_the_angle_is_kept() -> None:
    turn = {"kind": "air_turn", "angle_deg": 300, "bank_deg": 24, "bank_change_deg": 8}
    simulated = simulate(quiet(legs=[*FLIGHT_LEGS[:7], turn, {"kind": "fly", "duration_s": 10, "airspeed_mps": 70}]))
    motion = simulated.trajectory
    turning = np.flatnonzero(motion.roll_deg > 1.0)
    bank = motion.roll_deg[turning]
    assert bank[501] == pytest.approx(20.0, abs=0.3) and bank[-501] == pytest.approx(28.0, abs=0.3)
    assert np.ptp(motion.altitude_m[turning]) < 1e-6
    heading = unwrap(motion.heading_deg[turning[0] - 200 : turning[-1] + 200])
    assert heading[-1] - heading[0] == pytest.approx(300.0, abs=1e-6)


def turns_of(simulated: Simulated) -> list[tuple[float, float, float]]:
    """Turns above 8 deg of bank: angle, middle bank, lowest altitude."""
    motion = simulated.trajectory
    edges = np.flatnonzero(np.diff(np.abs(motion.roll_deg) > 8.0)) + 1
    stretches = [slice(first, last) for first, last in edges.reshape(-1, 2)]
    return [
        (
            float(np.ptp(unwrap(motion.heading_deg[one]))),
            float(np.median(motion.roll_deg[one])),
            float(np.min(motion.altitude_m[one])),
        )
        for one in stretches
    ]


def test_scenario_has_two_figures_and_six_straights() -> None:
    simulated = simulate(load_scenario("magnetic-eight"))
    figures = [turn for turn in turns_of(simulated) if turn[0] > 200.0]
    assert [round(bank) for _, bank, _ in figures] == [20, -20, 20, -20]
    assert all(angle > 360.0 and altitude == pytest.approx(1500.0) for angle, _, altitude in figures)
    motion = simulated.trajectory
    straight = (motion.altitude_m > 1499.9) & (np.abs(motion.roll_deg) < 1e-9)
    _headings, samples = np.unique(np.round(motion.heading_deg[straight]), return_counts=True)
    assert np.sum(samples > 3000) == 6
    assert not motion.airborne[-1] and motion.altitude_m[-1] == pytest.approx(205.0)
    result = estimate_heading_error(simulated.flight)
    assert result.verdict == simulated.scenario.expected_verdict
    assert result.confidence95_deg[0] < scenario_truth(simulated)["heading_error_deg"] < result.confidence95_deg[1]


def test_hard_scenario_is_incomplete_and_unequal() -> None:
    (right, right_bank, _), (left, left_bank, _), *_ = turns_of(simulate(load_scenario("magnetic-hard")))
    assert right > 360.0 and left < 260.0 and abs(left_bank) > 1.4 * right_bank


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"magnetometer": {"current_nt_per_a": [1.0, 0.0, 0.0]}}, "magnetometer.current_nt_per_a"),
        ({"magnetometer": {"scale": [1.0, 1.0]}}, "magnetometer.scale"),
        ({"magnetometer": {"latency_s": -1.0}}, "magnetometer.latency_s"),
        ({"electric": {"loads": [{"from_s": 5, "to_s": 4, "current_a": 1}]}}, "electric.loads"),
        ({"electric": {"rate_hz": 7}}, "electric.rate_hz"),
        ({"legs": [{"kind": "air_turn", "angle_deg": 90, "bank_change_deg": 40}]}, "legs[0].bank_change_deg"),
    ],
)
def test_mistakes_name_the_key(changes: dict[str, Any], key: str) -> None:
    with pytest.raises(SettingsError) as caught:
        scenario(**changes)
    assert f"test.toml, key {key}:" in str(caught.value)


@pytest.mark.parametrize(("start_utc", "found"), [("1999-05-04T06:00:00Z", "1999"), ("", "no date")])
def test_a_date_that_no_model_serves_is_said(start_utc: str, found: str) -> None:
    with pytest.raises(SettingsError, match=found):
        simulate(scenario(legs=TAXI_LEGS, start_utc=start_utc, magnetometer={}))


def test_family_flights_are_those_of_their_seeds() -> None:
    settings = MagneticFamilySettings(figures=1, straights=2, straight_s=10.0)
    alone = next(simulate_magnetic_family(settings, [4])).flight
    first, among = simulate_magnetic_family(settings, [3, 4])
    for topic in alone.topics():
        for name, column in alone[topic].columns.items():
            assert np.array_equal(column.values, among.flight[topic].columns[name].values), (topic, name)
    assert not np.array_equal(field_body_nt(first.flight), field_body_nt(among.flight))
    louder = draw_magnetic_scenario(replace(settings, hard_iron_sigma_nt=1600.0), 4)
    drawn, twice = among.scenario.magnetometer, louder.magnetometer
    assert drawn is not None and twice is not None
    assert np.allclose(np.array(twice.hard_iron_nt), 2.0 * np.array(drawn.hard_iron_nt))
    assert replace(twice, hard_iron_nt=drawn.hard_iron_nt) == drawn and louder.legs == among.scenario.legs


def test_family_has_the_sizes_asked_for() -> None:
    settings = MagneticFamilySettings(load_a=20.0, coupling_sigma_nt_per_a=1.0)
    drawn = [draw_magnetic_scenario(settings, seed) for seed in range(300)]
    sensors = [one.magnetometer for one in drawn if one.magnetometer is not None]
    sampling = 4.0 / np.sqrt(2.0 * 3 * len(drawn))  # four standard errors of a standard deviation of 900 values
    assert float(np.std([one.hard_iron_nt for one in sensors])) == pytest.approx(800.0, rel=sampling)
    assert float(np.std([one.current_nt_per_a for one in sensors])) == pytest.approx(1.0, rel=sampling)
    assert float(np.std(np.array([one.soft_iron for one in sensors]) - np.eye(3))) == pytest.approx(0.01, rel=sampling)
    roll = [one.ins.roll_error_deg for one in drawn]
    assert float(np.std(roll)) == pytest.approx(0.1, rel=4.0 / np.sqrt(2.0 * len(drawn)))
    banks = [leg.bank_deg for one in drawn for leg in one.legs if isinstance(leg, AirTurn)]
    assert float(np.mean(banks)) == pytest.approx(20.0, abs=0.05) and float(np.std(banks)) == pytest.approx(
        0.5, rel=0.1
    )


def test_family_flight_is_whole_and_shows_its_deviation() -> None:
    settings = MagneticFamilySettings(load_a=20.0, attitude_error_sigma_deg=0.5, attitude_wander_deg=0.0, latency_s=0.0)
    simulated = next(simulate_magnetic_family(settings, [8]))
    flight, deviation = simulated.flight, scenario_deviation(simulated.scenario, simulated.trajectory)
    assert set(flight.topics()) == {"baro", "discrete", "electric", "gnss", "ins", "magnetometer", "truth"}
    assert [angle > 360.0 for angle, _, _ in turns_of(simulated)].count(True) == 4
    assert deviation is not None
    level = np.abs(truth_at_magnetometer(flight, "roll_deg")) < 1e-6
    level &= truth_at_magnetometer(flight, "altitude_ellipsoid_m") > 1499.9
    shown = shown_deg(flight, "ins")[level]
    error = wrap_180(shown - truth_at_magnetometer(flight, "true_heading_deg")[level])
    expected = np.interp(shown, BIN_MIDDLES_DEG, deviation.compass_error_deg, period=360.0)
    # noise of 36 nT in a horizontal field above 15 uT is below 0.15 deg; 0.1 deg for the way of 40 km
    assert float(np.sqrt(np.mean(wrap_180(error - expected) ** 2))) < 0.25
    assert float(np.std(error)) > 0.5


@pytest.mark.parametrize(
    "changes", [{"latitude_deg": (60.0, 50.0)}, {"longitude_deg": (0.0, 181.0)}, {"bank_deg": float("nan")}]
)
def test_family_settings_out_of_range_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match=next(iter(changes))):
        MagneticFamilySettings(**changes)
