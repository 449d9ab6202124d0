"""Sensor models: the errors are the ones asked for, seeds and sensors are independent, outputs are rounded."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.simulation.flight import scenario_truth, simulate
from groundstation.simulation.flight_errors import (
    EARTH_RADIUS_M,
    SCHULER_RADPS,
    schuler_error,
    turned_velocity_error,
)
from groundstation.simulation.readings import quantised
from groundstation.simulation.scenario import InsSettings, load_scenario
from groundstation.tables.table import Flight
from tests.simulated_flights import FLIGHT_LEGS, TAXI_LEGS, quiet, scenario

LONG_STAND = [{"kind": "parked", "duration_s": 2000}]
SEEDS = (1, 2, 3)


def assert_equal_topics(first: Flight, second: Flight, topics: tuple[str, ...]) -> None:
    for topic in topics:
        assert np.array_equal(first[topic].time_ns, second[topic].time_ns)
        for name in first[topic].columns:
            assert np.array_equal(first[topic].columns[name].values, second[topic].columns[name].values), (topic, name)


def lagged(values: FloatArray, lag: int) -> float:
    centred = values - values.mean()
    return float(np.mean(centred[:-lag] * centred[lag:]) / np.mean(centred**2))


@pytest.mark.parametrize("seed", SEEDS)
def test_gnss_velocity_errors_have_the_deviation_and_correlation_asked_for(seed: int) -> None:
    simulated = simulate(scenario(legs=LONG_STAND), seed)
    for name in ("velocity_north_mps", "velocity_east_mps"):
        error = simulated.flight["gnss"].values(name)
        white, slow, tau = 0.05, 0.025, 5.0
        # 200 correlation times: the slow variance is known to about sqrt(2 / 200) = 10 %, five times that allowed
        assert float(np.var(error)) == pytest.approx(white**2 + slow**2, rel=0.12)
        correlation = slow**2 * np.exp(-1.0 / tau) / (white**2 + slow**2)  # at a lag of 1 s
        assert lagged(error, 10) == pytest.approx(correlation, abs=0.08)


@pytest.mark.parametrize("seed", SEEDS)
def test_noise_of_ins_and_baro_is_white_and_of_its_size(seed: int) -> None:
    flight = simulate(quiet(legs=LONG_STAND, ins={"heading_noise_deg": 0.02, "azimuth_drift_dph": 0.0}, baro={}), seed)
    heading = flight.flight["ins"].values("true_heading_deg")
    noise = wrap_180(heading - 1.0)  # parked at 0 with an azimuth error of 1
    relative = 5.0 / np.sqrt(2 * len(noise))  # five sampling errors of a standard deviation
    assert float(np.std(noise)) == pytest.approx(0.02, rel=relative)
    assert abs(lagged(noise, 1)) < 5.0 / np.sqrt(len(noise))
    baro = flight.flight["baro"].values("pressure_altitude_m")
    assert float(np.mean(baro)) == pytest.approx(200.0 - 15.0, abs=5.0 * 0.5 / np.sqrt(len(baro)))


def test_the_same_seed_repeats_and_another_differs() -> None:
    first, again, other = (simulate(scenario(), seed).flight for seed in (4, 4, 5))
    assert_equal_topics(first, again, first.topics())
    assert not np.array_equal(first["gnss"].values("latitude_deg"), other["gnss"].values("latitude_deg"))


def test_changing_one_sensor_leaves_the_others_alone() -> None:
    plain = simulate(scenario(baro={}, air={}, magnetometer={}))
    louder = simulate(scenario(gnss={"velocity_white_mps": 0.5, "rate_hz": 5}, baro={}, air={}, magnetometer={}))
    assert_equal_topics(plain.flight, louder.flight, ("ins", "baro", "air", "magnetometer", "discrete", "truth"))
    without = simulate(scenario(baro={}))
    assert_equal_topics(without.flight, plain.flight, ("ins", "gnss", "baro"))


def test_noiseless_taxi_shows_the_azimuth_error_on_straights() -> None:
    """Heading minus track is the azimuth error to the rounding of the log, here 1e-6."""
    fine = {"heading_resolution_deg": 1e-6, "azimuth_error_deg": 1.25, "azimuth_drift_dph": 0.0, "boresight_deg": 0.1}
    simulated = simulate(quiet(ins=fine, gnss={"velocity_resolution_mps": 1e-6, "antenna_forward_m": 4.0}))
    flight = simulated.flight
    heading = flight["ins"].values("true_heading_deg")[np.searchsorted(flight["ins"].time_ns, flight["gnss"].time_ns)]
    north, east = flight["gnss"].values("velocity_north_mps"), flight["gnss"].values("velocity_east_mps")
    rate = flight["truth"].values("rate_z_dps")
    straight = (np.hypot(north, east) > 2.0) & (np.abs(rate) < 1e-9)
    difference = wrap_180(heading - direction_of(north, east))
    assert straight.sum() > 200
    assert np.max(np.abs(difference[straight] - 1.35)) < 1e-4  # 1e-6 m/s at 2 m/s is 3e-5 deg
    turning = (np.hypot(north, east) > 2.0) & (np.abs(rate) > 5.0)
    assert np.max(np.abs(difference[turning] - 1.35)) > 1.0  # the lever arm shows in turns
    assert scenario_truth(simulated)["heading_error_deg"] == pytest.approx(1.35)


def test_antenna_velocity_in_a_turn_is_that_of_the_arm() -> None:
    """An antenna ahead of the axle swings outwards: its sideways velocity is rate times arm, left of track negative."""
    simulated = simulate(quiet(gnss={"antenna_forward_m": 5.0, "velocity_resolution_mps": 1e-6}))
    truth, gnss = simulated.flight["truth"], simulated.flight["gnss"]
    heading_rad = np.deg2rad(truth.values("true_heading_deg"))
    right = -np.sin(heading_rad) * gnss.values("velocity_north_mps") + np.cos(heading_rad) * gnss.values(
        "velocity_east_mps"
    )
    assert np.allclose(right, 5.0 * np.deg2rad(truth.values("rate_z_dps")), atol=1e-5)


def test_gnss_outage_latency_repeat_and_integrity() -> None:
    gnss = {
        "latency_s": 0.07,
        "repeat": 2,
        "outages": [{"from_s": 10.0, "to_s": 12.0}],
        "low_integrity": [{"from_s": 5.0, "to_s": 6.0}],
        "jump_mps": 3.0,
    }
    flight = simulate(quiet(gnss=gnss)).flight
    time_s = flight.time_s("gnss") - 0.07
    assert time_s[0] == pytest.approx(0.0) and time_s[1] == pytest.approx(0.05)
    assert not np.any((time_s > 9.96) & (time_s < 11.999))
    latitude = flight["gnss"].values("latitude_deg")
    assert np.array_equal(latitude[0::2][: len(latitude) // 2], latitude[1::2])
    doubtful = flight["gnss"].values("integrity_ok") == 0.0
    assert doubtful.sum() == 20 and np.all(flight["gnss"].values("velocity_east_mps")[doubtful] == 3.0)


def test_rates_and_rounding() -> None:
    flight = simulate(scenario(ins={"rate_hz": 20, "heading_resolution_deg": 0.05}, baro={"rate_hz": 2})).flight
    assert set(np.diff(flight["ins"].time_ns)) == {50_000_000} and set(np.diff(flight["baro"].time_ns)) == {500_000_000}
    steps = flight["ins"].values("true_heading_deg") / 0.05
    assert np.allclose(steps, np.rint(steps), atol=1e-9)
    assert (
        flight["ins"].values("true_heading_deg").min() >= 0.0 and flight["ins"].values("true_heading_deg").max() < 360
    )


def test_rounding_does_not_hang_on_the_last_bit() -> None:
    edge = np.array([0.0005, 0.0015, 2.5005])
    assert np.array_equal(quantised(np.nextafter(edge, 0.0), 0.001), quantised(np.nextafter(edge, 9.0), 0.001))


def test_schuler_period_is_84_minutes_and_the_solution_obeys_its_equations() -> None:
    assert 2.0 * np.pi / SCHULER_RADPS / 60.0 == pytest.approx(84.4, abs=0.01)
    settings = replace(InsSettings(), velocity_error_mps=(0.3, 0.0), tilt_arcsec=(12.0, 0.0), drift_dph=(0.02, 0.0))
    time_s = np.arange(0.0, 10_000.0, 1.0)
    position, velocity = schuler_error(time_s, settings, 0)
    assert np.allclose(np.gradient(position, time_s)[1:-1], velocity[1:-1], atol=1e-6)
    curvature = np.gradient(np.gradient(velocity, time_s), time_s)[2:-2]
    drift = EARTH_RADIUS_M * SCHULER_RADPS**2 * np.deg2rad(0.02 / 3600.0)
    assert np.allclose(curvature, -(SCHULER_RADPS**2) * velocity[2:-2] - drift, atol=1e-8)


def test_weight_on_wheels_and_airspeed() -> None:
    flight = simulate(scenario(legs=FLIGHT_LEGS, air={})).flight
    on_wheels = flight["discrete"].values("weight_on_wheels")
    assert on_wheels[0] == 1.0 and on_wheels[-1] == 1.0 and np.count_nonzero(np.diff(on_wheels)) == 2
    airspeed = flight["air"].values("true_airspeed_mps")
    assert airspeed.max() == pytest.approx(70.0, abs=2.5)
    lift_off_s = flight.time_s("discrete")[np.flatnonzero(on_wheels == 0.0)[0]]
    altitude = flight["truth"].values("altitude_ellipsoid_m")
    assert np.all(altitude[flight.time_s("truth") <= lift_off_s] == 200.0)


def test_magnetometer_sees_the_field_and_its_iron() -> None:
    legs = [*TAXI_LEGS, {"kind": "ground_turn", "angle_deg": 300}]
    perfect = {"hard_iron_nt": [0.0, 0.0, 0.0], "noise_nt": 0.0, "resolution_nt": 0.01}
    flight = simulate(quiet(legs=legs, magnetometer=perfect)).flight
    forward, right, down = (flight["magnetometer"].values(f"field_{axis}_nt") for axis in ("forward", "right", "down"))
    magnetic_heading = direction_of(forward, -right)  # level on the ground
    truth = flight["truth"].values("true_heading_deg")
    declination = wrap_180(truth - magnetic_heading)
    assert np.allclose(declination, 12.17, atol=0.01)  # WMM2025 at 55.97 N 37.41 E, 2026.34
    assert np.allclose(down, 50_461.0, atol=10.0)
    iron = simulate(quiet(legs=legs, magnetometer=perfect | {"hard_iron_nt": [300.0, -200.0, 100.0]})).flight
    assert np.allclose(iron["magnetometer"].values("field_right_nt") - right, -200.0, atol=0.011)


def test_onboard_reuses_gnss_samples_and_enters_a_rounded_correction() -> None:
    simulated = simulate(load_scenario("taxi-good"))
    onboard = simulated.flight["onboard"]
    status = onboard.text("status")
    assert status[0] == "wait" and status[-1] == "entered"
    cycles = onboard.values("cycles")
    assert np.all(np.diff(cycles) >= 0) and cycles[-1] > 800  # 20 cycles a second on 10 Hz GNSS
    error = onboard.values("heading_error_deg")
    assert error[-1] == pytest.approx(simulated.scenario.ins.azimuth_error_deg, abs=0.15)
    entered = onboard.values("correction_entered_deg")
    assert entered[-1] == pytest.approx(-round(float(error[-1]), 1))
    assert np.isnan(entered[status != "entered"]).all()


def test_without_a_start_time_there_is_no_absolute_time() -> None:
    flight = simulate(scenario(start_utc="")).flight
    assert not flight.has_utc and flight.start_ns == 0 and "start_utc" not in flight.metadata


def test_a_minute_of_taxi_is_good_to_some_arcminutes() -> None:
    """The published order of magnitude: with the defaults the mean of heading - track errs by 2-7 arcmin in 60 s."""
    legs = [{"kind": "taxi", "length_m": 700, "speed_mps": 8}]
    flights = [simulate(scenario(legs=legs, ins={"azimuth_drift_dph": 0.0, "rate_hz": 10}), seed) for seed in range(40)]
    errors_arcmin = []
    for simulated in flights:
        gnss, heading = simulated.flight["gnss"], simulated.flight["ins"].values("true_heading_deg")
        north, east = gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps")
        fast = np.flatnonzero(np.hypot(north, east) > 6.0)[:600]
        difference = wrap_180(heading - direction_of(north, east))[fast]
        errors_arcmin.append(60.0 * float(np.mean(difference) - 1.0))
    assert len(fast) == 600
    assert 1.0 < float(np.sqrt(np.mean(np.square(errors_arcmin)))) < 7.0
    assert abs(np.mean(errors_arcmin)) < 4.0 * float(np.std(errors_arcmin)) / np.sqrt(len(flights))


def test_an_azimuth_error_turns_each_change_of_velocity_and_swings_with_schuler() -> None:
    """1 deg and 60 m/s to the north: 1.05 m/s too far east, which a quarter of 84.4 min later is gone."""
    settings = replace(InsSettings(), azimuth_error_deg=1.0, azimuth_drift_dph=0.0, boresight_deg=3.0)
    time_s = np.arange(0.0, 2.0 * np.pi / SCHULER_RADPS, 0.5)
    north = 60.0 * np.clip(time_s / 20.0, 0.0, 1.0)
    (_, of_north), (east_m, of_east) = turned_velocity_error(time_s, north, np.zeros_like(north), settings)
    turned = 60.0 * np.deg2rad(1.0)
    assert np.all(of_north == 0.0)
    assert of_east[60] == pytest.approx(turned, abs=1e-3)
    quarter = len(time_s) // 4
    assert of_east[quarter + 20] == pytest.approx(0.0, abs=0.01 * turned)
    assert of_east[2 * quarter + 20] == pytest.approx(-turned, rel=1e-3)
    assert np.allclose(np.gradient(east_m, time_s)[1:-1], of_east[1:-1], atol=0.02)  # trapezoids at a kink
