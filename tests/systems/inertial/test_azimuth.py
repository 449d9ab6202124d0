"""Azimuth error from turns: signs, invariances, honesty of its sigma, and when it is not offered."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.methods.ins_noise import InsNoise
from groundstation.results.roles import AzimuthEstimate
from groundstation.simulation.inertial_family import FamilySettings, GnssErrorModel, simulate_family
from groundstation.simulation.ins_class import load_ins_class
from groundstation.simulation.ins_errors import SensorErrors, TrueMotion, propagate
from groundstation.systems.inertial import azimuth, velocity_changes
from groundstation.systems.inertial.azimuth import estimate_azimuth
from groundstation.systems.inertial.differences import InsDifferences, drag_per_s
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.model import ChannelModel, FloatArray
from groundstation.systems.inertial.settings import InertialSettings

SETTINGS = InertialSettings()
LIMITS = velocity_changes.AzimuthLimits()
SPEED = 200.0
LEFT_OUT_SHARE = 0.03  # Earth's rotation between the channels, which the channel filter does not know


def track_rad(seconds: int, turns: tuple[tuple[float, float], ...]) -> FloatArray:
    """Track at whole seconds: of (start s, angle deg) each turn takes a minute."""
    time_s = np.arange(seconds + 1.0)
    angle = sum((np.clip((time_s - at) / 60.0, 0.0, 1.0) * angle for at, angle in turns), np.zeros_like(time_s))
    return np.asarray(np.deg2rad(angle))


TURNS = ((600.0, 90.0), (1200.0, -90.0), (1800.0, 180.0), (2400.0, 90.0))


def flying(velocity: FloatArray, error_mps: FloatArray) -> InsDifferences:
    """INS with these velocities (n, 2), whose difference from GNSS is ``error_mps``; no positions."""
    n = len(velocity)
    latitude, altitude = np.full(n, 50.0), np.zeros(n)
    time_s = np.arange(float(n))
    drag = drag_per_s(latitude, altitude, velocity)
    epochs = DifferenceEpochs(time_s, np.full((n, 2), np.nan), error_mps, drag, np.zeros(n, dtype=bool))
    return InsDifferences("ins", "gnss", epochs, latitude, np.zeros(n), altitude, velocity, 0.0, ())


def of_track(track: FloatArray, azimuth_rad: float = 0.0, seed: int | None = None) -> InsDifferences:
    velocity = SPEED * np.stack([np.cos(track), np.sin(track)], axis=1)
    error = azimuth_rad * np.stack([-velocity[:, 1], velocity[:, 0]], axis=1)
    error -= error[0]
    if seed is not None:
        error = error + 0.05 * np.random.default_rng(seed).standard_normal(error.shape)
    return flying(velocity, error)


def filtered(differences: InsDifferences) -> ChannelsRun:
    noise = InsNoise()
    return run_filter(differences.epochs, ChannelModel.at(50.0, 0.0, noise.beta_per_s), noise)


def estimated(differences: InsDifferences, limit_deg: float = SETTINGS.azimuth_sigma_max_deg) -> AzimuthEstimate:
    settings = replace(SETTINGS, azimuth_sigma_max_deg=limit_deg)
    return estimate_azimuth(differences, filtered(differences), settings)


def test_sign_by_example() -> None:
    """North at 200 m/s, then east: an INS turned by +0.1 deg (clockwise) believes in 0.35 m/s of south."""
    differences = of_track(track_rad(3000, TURNS), np.deg2rad(0.1))
    change = differences.epochs.velocity_mps[700] - differences.epochs.velocity_mps[500]
    assert change == pytest.approx([-0.349, -0.349], abs=1e-3)
    result = estimated(differences)
    assert result.observable and result.error_deg is not None and result.sigma_deg is not None
    assert result.error_deg == pytest.approx(0.1, abs=0.003)
    assert 0.0 < result.sigma_deg < 0.05
    assert result.turns == 4
    assert result.velocity_change_mps == pytest.approx(400.0, rel=0.01)
    assert "4 changes of velocity" in result.reason


@pytest.mark.parametrize("azimuth_rad", [2e-3, -1e-3])
def test_azimuth_of_the_simulation_comes_back(azimuth_rad: float) -> None:
    track = track_rad(3000, TURNS)
    zero = np.zeros_like(track)
    motion = TrueMotion(
        time_s=np.arange(len(track), dtype=np.float64),
        latitude_deg=zero + 50.0,
        altitude_m=zero,
        velocity_north_mps=SPEED * np.cos(track),
        velocity_east_mps=SPEED * np.sin(track),
        velocity_down_mps=zero,
        heading_deg=np.rad2deg(track),
        roll_deg=zero,
    )
    sensors = replace(SensorErrors.none(1, len(track)), azimuth_rad=np.array([azimuth_rad]))
    truth = propagate(motion, sensors, body_fixed=False)
    result = estimated(flying(SPEED * np.stack([np.cos(track), np.sin(track)], axis=1), truth.velocity_mps[0]))
    last = float(np.rad2deg(truth.azimuth_rad[0, 2430]))
    assert result.error_deg == pytest.approx(last, rel=LEFT_OUT_SHARE)


def test_turning_the_world_changes_nothing() -> None:
    plain = estimated(of_track(track_rad(3000, TURNS), 1e-3, seed=2))
    differences = of_track(track_rad(3000, TURNS), 1e-3, seed=2)
    c, s = np.cos(np.deg2rad(137.0)), np.sin(np.deg2rad(137.0))
    turn = np.array([[c, s], [-s, c]])
    turned = estimated(flying(differences.velocity_mps @ turn, differences.epochs.velocity_mps @ turn))
    assert plain.error_deg is not None and plain.sigma_deg is not None
    # a measurement is judged by each channel's gate, nothing else knows north
    assert turned.error_deg == pytest.approx(plain.error_deg, abs=1e-6)
    assert turned.sigma_deg == pytest.approx(plain.sigma_deg, rel=1e-3)


def test_time_offset_and_scale_are_not_taken_for_azimuth() -> None:
    track = track_rad(3000, TURNS)
    velocity = SPEED * np.stack([np.cos(track), np.sin(track)], axis=1)
    acceleration = np.gradient(velocity, axis=0)
    error = 0.2 * acceleration + 5e-4 * (velocity - velocity[0])
    error = error + 0.02 * np.random.default_rng(1).standard_normal(error.shape)
    result = estimated(flying(velocity, error))
    assert result.error_deg is not None and result.sigma_deg is not None
    assert abs(result.error_deg) < 2.0 * result.sigma_deg


@pytest.mark.parametrize("both_ways", [True, False])
def test_time_offset_in_endless_turns(both_ways: bool) -> None:
    """Circling one way, an offset of time is an error of azimuth; only turns both ways tell them apart."""
    rate = np.deg2rad(4.0) * np.where(both_ways & (np.arange(901) // 100 % 2 == 1), -1.0, 1.0)
    angle = np.cumsum(rate)
    velocity = 25.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    acceleration = np.gradient(velocity, axis=0)
    error = 0.1 * acceleration + 0.02 * np.random.default_rng(1).standard_normal(velocity.shape)
    differences = flying(velocity, error)
    limits = velocity_changes.AzimuthLimits(average_s=4.0, longest_s=20.0)
    known = np.ones(901, dtype=bool)
    changes = velocity_changes.changes_of(differences, known, limits)
    fit = azimuth.fit_azimuth(differences, filtered(differences), SETTINGS, changes, known, limits)
    assert len(changes) > 20
    assert abs(fit.values[velocity_changes.AZIMUTH]) < 2.0 * fit.sigma_rad
    if both_ways:
        assert fit.values[velocity_changes.LATENCY] == pytest.approx(0.1, abs=0.02)
    else:
        assert np.rad2deg(fit.sigma_rad) > 1.0


def test_regression_recovers_its_parameters() -> None:
    rng = np.random.default_rng(8)
    columns, true = rng.standard_normal((40, 2, 6)), np.array([1e-3, 2e-8, 0.1, 1e-3, 1e-3, -1e-3])
    fit = azimuth._regression(columns, columns @ true, np.full(40, 1e-16), np.ones(6))
    assert fit.values == pytest.approx(true, abs=1e-12)
    assert fit.freedom == pytest.approx(74.0, abs=1e-6)


def test_sigma_grows_with_residuals_and_with_few_turns() -> None:
    normal = np.ones((2, 2))
    plain = azimuth.AzimuthFit(np.zeros(6), np.eye(6), normal * 0.5, 3.0)
    wild = replace(plain, normalised=normal * 3.0)
    assert plain.sigma_rad == 1.0
    assert wild.sigma_rad == pytest.approx(np.sqrt(36.0 / 3.0) * 3.1824 / 1.96, rel=1e-3)


# When it is not offered


def test_straight_flight_does_not_show_it() -> None:
    result = estimated(of_track(track_rad(3000, ()), 1e-3, seed=1))
    assert not result.observable
    assert result.error_deg is None and result.sigma_deg is None and result.turns == 0
    assert "at least 3 are needed" in result.reason


def test_one_turn_is_too_few() -> None:
    assert not estimated(of_track(track_rad(3000, TURNS[:1]), 1e-3, seed=1)).observable


def test_changes_all_one_way_are_not_enough() -> None:
    time_s = np.arange(2001.0)
    speed = 100.0 + sum(20.0 * np.clip((time_s - at) / 40.0, 0.0, 1.0) for at in (300.0, 800.0, 1300.0))
    velocity = np.stack([speed, np.zeros_like(speed)], axis=1)
    result = estimated(flying(velocity, np.zeros_like(velocity)))
    assert not result.observable and "same way" in result.reason


def test_a_sigma_above_the_limit_is_said() -> None:
    result = estimated(of_track(track_rad(3000, TURNS), 1e-3, seed=1), limit_deg=1e-4)
    assert not result.observable and result.error_deg is None
    assert result.sigma_deg is not None and "above the limit" in result.reason


def test_without_gnss_velocity_it_says_so() -> None:
    differences = of_track(track_rad(3000, TURNS))
    nothing = np.full_like(differences.epochs.velocity_mps, np.nan)
    result = estimated(replace(differences, epochs=replace(differences.epochs, velocity_mps=nothing)))
    assert not result.observable and result.reason == "no velocity of both INS and GNSS"


def test_turns_without_gnss_around_them_or_with_a_reset_do_not_count() -> None:
    differences = of_track(track_rad(3000, TURNS), 1e-3, seed=1)
    velocity = np.array(differences.epochs.velocity_mps)
    velocity[580:600] = np.nan
    marks = np.zeros(len(velocity), dtype=bool)
    marks[1230] = True
    epochs = replace(differences.epochs, velocity_mps=velocity, is_reset=marks)
    result = estimated(replace(differences, epochs=epochs))
    assert result.turns == 2 and not result.observable


def test_an_ins_silent_for_a_while_is_no_trouble() -> None:
    differences = of_track(track_rad(3000, TURNS), 1e-3, seed=1)
    velocity = np.array(differences.velocity_mps)
    velocity[1500:1600] = np.nan
    result = estimated(replace(differences, velocity_mps=velocity))
    assert result.error_deg == pytest.approx(np.rad2deg(1e-3), abs=0.02)


# Honesty


def standardised(runs: int, seed: int, ins: str, route: str, gnss: GnssErrorModel) -> tuple[FloatArray, int]:
    """Errors over sigma of the simulated flights on which it is offered, and how many those are not."""
    family = FamilySettings(ins=load_ins_class(ins), route=route, duration_s=9000.0, gnss=gnss)  # type: ignore[arg-type]
    out, refused = [], 0
    for run in range(runs):
        batch = simulate_family(family, 1, seed, first_run=run)
        velocity = np.stack([batch.velocity_north_mps[0], batch.velocity_east_mps[0]], axis=1)
        velocity = velocity + batch.velocity_error_mps[0]
        differences = flying(velocity, batch.velocity_error_mps[0] - batch.gnss_velocity_error_mps[0])
        result = estimated(differences)
        if result.error_deg is None or result.sigma_deg is None:
            refused += 1
            continue
        changes = velocity_changes.changes_of(differences, np.ones(len(velocity), dtype=bool), LIMITS)
        truth = np.interp(changes.reference_s, batch.time_s, batch.azimuth_error_rad[0])
        out.append((result.error_deg - np.rad2deg(truth)) / result.sigma_deg)
    return np.array(out), refused


GNSS = GnssErrorModel(3.0, 3.0, 300.0, 0.05, 0.03, 60.0)


def test_truth_is_within_the_claimed_sigma() -> None:
    errors, refused = standardised(12, 1, "navigation", "manoeuvring", GNSS)
    assert refused == 0
    assert np.abs(errors).max() < 3.5
    assert 0.3 < np.sqrt(np.mean(np.square(errors))) < 1.7


@pytest.mark.slow
@pytest.mark.parametrize(
    "ins, route, gnss",
    [
        ("navigation", "manoeuvring", GNSS),
        ("navigation", "manoeuvring", GnssErrorModel(3.0, 0.0, 300.0, 0.02, 0.0, 60.0)),
        ("i-21", "norilsk_moscow", GNSS),
    ],
)
def test_95_per_cent_interval_holds_the_truth_as_often(ins: str, route: str, gnss: GnssErrorModel) -> None:
    """200 flights each: 0.89 is the lower 99.9 % binomial bound of 0.95; an interval too wide is allowed."""
    errors, refused = standardised(200, 21, ins, route, gnss)
    assert refused < 40
    assert 0.89 < np.mean(np.abs(errors) < 1.96) <= 1.0


def early_errors(runs: int, seed: int, initial_azimuth_deg: float, duration_s: float) -> FloatArray:
    """Errors over sigma of the azimuth carried back to the first minute, INS with a stored heading."""
    ins = replace(load_ins_class("navigation"), initial_azimuth_deg=initial_azimuth_deg)
    family = FamilySettings(ins=ins, route="manoeuvring", duration_s=duration_s, gnss=GNSS)
    out = []
    for run in range(runs):
        batch = simulate_family(family, 1, seed, first_run=run)
        velocity = np.stack([batch.velocity_north_mps[0], batch.velocity_east_mps[0]], axis=1)
        velocity = velocity + batch.velocity_error_mps[0]
        early = estimated(flying(velocity, batch.velocity_error_mps[0] - batch.gnss_velocity_error_mps[0])).early
        assert early is not None and early.time_s < 5400.0
        error_deg, sigma_deg = early.at(60.0)
        truth_deg = float(np.rad2deg(np.interp(60.0, batch.time_s, batch.azimuth_error_rad[0])))
        out.append((error_deg - truth_deg) / sigma_deg)
    return np.array(out)


@pytest.mark.slow
def test_azimuth_on_taxi_of_an_ins_a_degree_off_is_not_taken_from_hours_later() -> None:
    """An azimuth error of a degree oscillates: a straight line through 2.5 h missed it by 1.8 sigma rms."""
    errors = early_errors(12, 77, 1.0, 9000.0)
    assert np.abs(errors).max() < 3.5
    assert 0.3 < np.sqrt(np.mean(np.square(errors))) < 1.7


def test_few_turns_in_the_first_hour_tell_nothing_of_the_taxi() -> None:
    turns = ((600.0, 90.0), (5000.0, -90.0), (5600.0, 180.0), (6200.0, 90.0))
    result = estimated(of_track(track_rad(7000, turns), 1e-3, seed=1))
    assert result.observable and result.early is None


def test_short_flight_has_one_fit() -> None:
    result = estimated(of_track(track_rad(3000, TURNS), 1e-3, seed=1))
    assert result.early is not None
    assert (result.early.error_deg, result.early.sigma_deg) == (result.error_deg, result.sigma_deg)
