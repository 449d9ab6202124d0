"""Families of flights: the same run whatever the number of runs, switches that switch one thing, figures of a class."""

from dataclasses import fields, replace
from typing import get_args

import numpy as np
import pytest

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import curvature_radii_m, north_east_m
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.simulation.channel_truth import channel_matrix, channel_noise, channel_sigmas, channel_truth
from groundstation.simulation.inertial_family import (
    ErrorBatch,
    FamilySettings,
    GnssErrorModel,
    iterate_family,
    simulate_family,
)
from groundstation.simulation.ins_class import HeadingWander, InsClass, ins_class_names, load_ins_class
from groundstation.simulation.ins_draw import DPH, draw_heading_wander, spatial_gauss_markov
from groundstation.simulation.ins_errors import TrueMotion
from groundstation.simulation.routes import RouteKind

SEED = 11
ROUTES: tuple[RouteKind, ...] = get_args(RouteKind)
QUIET = InsClass(
    gyro_constant_dph=0.01, gyro_random_dph=0.005, initial_velocity_mps=0.0, initial_tilt_rad=0.0, deflection_arcsec=0.0
)


def radial_rate_nmph(batch: ErrorBatch) -> FloatArray:
    """Slope through the origin of the radial position error of each flight, nmi/h, shape (f,)."""
    radial = np.hypot(*np.moveaxis(batch.position_error_m, -1, 0)) / M_PER_NAUTICAL_MILE
    hours = batch.time_s / 3600.0
    return np.asarray(np.sum(radial * hours, axis=1) / np.sum(hours**2))


def assert_same(first: ErrorBatch, second: ErrorBatch, *but: str) -> None:
    for item in fields(ErrorBatch):
        if item.name not in but:
            assert np.array_equal(getattr(first, item.name), getattr(second, item.name)), item.name


@pytest.mark.parametrize("truth", ["full", "channel"])
def test_a_run_is_the_same_whatever_the_number_of_runs(truth: str) -> None:
    family = FamilySettings(truth=truth, duration_s=900.0)  # type: ignore[arg-type]
    batch = simulate_family(family, 5, SEED)
    assert_same(simulate_family(family, 5, SEED), batch)
    chunks = list(iterate_family(family, 5, SEED, chunk=2))
    assert [len(chunk) for chunk in chunks] == [2, 2, 1]
    for name in ("position_error_m", "gnss_position_error_m", "latitude_deg"):
        assert np.array_equal(np.concatenate([getattr(chunk, name) for chunk in chunks]), getattr(batch, name))
    other = simulate_family(family, 5, SEED + 1)
    assert not np.any(np.isclose(batch.position_error_m[:, 0], other.position_error_m[:, 0]))
    assert len({float(value) for value in batch.position_error_m[:, -1, 0]}) == 5


def test_instruments_of_a_class_differ_and_leave_route_and_receiver_alone() -> None:
    family = FamilySettings(route="dogleg", duration_s=900.0)
    alike, own = (simulate_family(replace(family, each_its_own=each), 3, SEED) for each in (False, True))
    assert_same(
        own,
        alike,
        *(
            "position_error_m",
            "velocity_error_mps",
            "tilt_rad",
            "drift_radps",
            "azimuth_error_rad",
            "heading_error_rad",
        ),
    )
    assert not np.any(np.isclose(own.position_error_m[:, -1], alike.position_error_m[:, -1]))


def test_switches_change_what_they_name_and_nothing_else() -> None:
    family = FamilySettings(duration_s=900.0)
    plain = simulate_family(family, 2, SEED)
    ins = (
        "position_error_m",
        "velocity_error_mps",
        "tilt_rad",
        "drift_radps",
        "azimuth_error_rad",
        "heading_error_rad",
    )
    for changes in ({"earth_rate": False}, {"body_fixed": False}, {"deflection": False}, {"truth": "channel"}):
        other = simulate_family(replace(family, **changes), 2, SEED)  # type: ignore[arg-type]
        assert_same(plain, other, *ins)
        assert not np.array_equal(plain.position_error_m, other.position_error_m), changes
    louder = simulate_family(replace(family, gnss=GnssErrorModel(position_white_m=20.0)), 2, SEED)
    assert_same(plain, louder, "gnss_position_error_m")
    assert np.allclose(louder.gnss_position_error_m, 2.0 * plain.gnss_position_error_m, rtol=1e-12)


@pytest.mark.parametrize("route", ROUTES)
def test_true_motion_is_one_motion_and_can_be_flown(route: RouteKind) -> None:
    batch = simulate_family(FamilySettings(route=route, ins="i-21", duration_s=16_000.0), 2, SEED)
    meridian, normal = curvature_radii_m(batch.latitude_deg)
    parallel = (normal + batch.altitude_m) * np.cos(np.deg2rad(batch.latitude_deg))
    north = np.diff(np.deg2rad(batch.latitude_deg)) * (meridian + batch.altitude_m)[:, :-1]
    east = np.deg2rad(wrap_180(np.diff(batch.longitude_deg))) * parallel[:, :-1]
    for moved, speed in ((north, batch.velocity_north_mps), (east, batch.velocity_east_mps)):
        assert np.max(np.abs(moved - 0.5 * (speed[:, 1:] + speed[:, :-1]))) < 0.05  # the turn inside a step: V w^2 / 12
    turn_dps = np.abs(wrap_180(np.diff(batch.heading_deg)))
    speed = np.hypot(batch.velocity_north_mps, batch.velocity_east_mps)
    bank_deg = np.rad2deg(np.arctan(speed[:, 1:] * np.deg2rad(turn_dps) / 9.81))
    assert np.max(bank_deg) < 32.0 and np.max(speed) < 260.0 and np.max(np.abs(batch.latitude_deg)) < 85.0
    acceleration = np.hypot(np.diff(batch.velocity_north_mps), np.diff(batch.velocity_east_mps))
    assert np.max(acceleration) < 6.5  # 32 deg of bank
    assert np.max(np.abs(np.diff(batch.altitude_m))) < 20.0 and np.min(batch.altitude_m) > -1.0
    turns = np.sum(turn_dps, axis=1)
    often = ("manoeuvring", "racetrack", "late_survey")
    assert np.all(turns > 1000.0) if route in often else np.all(turns < 1500.0)


def test_norilsk_to_moscow_goes_from_norilsk_to_moscow() -> None:
    batch = simulate_family(FamilySettings(route="norilsk_moscow", ins="i-21"), 6, SEED)
    assert np.allclose(batch.latitude_deg[:, 0], 69.31) and np.allclose(batch.longitude_deg[:, 0], 87.33)
    north, east = north_east_m(batch.latitude_deg[:, -1], batch.longitude_deg[:, -1], 55.60, 37.30)
    assert np.max(np.hypot(north, east)) < 100e3
    cruise = (batch.time_s > 600.0) & (batch.time_s < 14_000.0)
    assert np.max(np.abs(wrap_180(np.diff(batch.heading_deg[:, cruise])))) < 0.05  # a great circle, no turn
    ends = (batch.time_s < 400.0) | (batch.time_s > 14_600.0)
    assert np.all(np.sum(np.abs(wrap_180(np.diff(batch.heading_deg[:, ends]))), axis=1) > 200.0)


@pytest.mark.parametrize(
    ("name", "route", "low", "high"),
    [
        ("navigation", "straight", 0.5, 1.5),
        ("navigation", "manoeuvring", 0.35, 1.5),  # turns average body-fixed drifts out
        ("i-21", "norilsk_moscow", 0.5, 1.5),
        ("tactical", "straight", 40.0, 120.0),  # 60 nmi/h is 1 deg/h on one axis
    ],
)
def test_radial_error_rate_is_that_of_the_class(name: str, route: RouteKind, low: float, high: float) -> None:
    batch = simulate_family(FamilySettings(ins=name, route=route, step_s=2.0), 60, SEED)
    rates = radial_rate_nmph(batch)
    assert low < float(np.median(rates)) < high
    assert float(np.quantile(rates, 0.95)) < 2.0 * high


def test_mems_runs_away_within_minutes() -> None:
    batch = simulate_family(FamilySettings(ins="mems", duration_s=600.0), 20, SEED)
    radial = np.hypot(*np.moveaxis(batch.position_error_m[:, -1], -1, 0))
    assert 1000.0 < float(np.median(radial)) < 30_000.0


def test_classes_are_in_order_and_read_strictly() -> None:
    constants = [load_ins_class(name).gyro_constant_dph for name in ("navigation", "i-21", "tactical", "mems")]
    assert constants == sorted(constants) and set(ins_class_names()) == {"i-21", "mems", "navigation", "tactical"}
    with pytest.raises(SettingsError, match="one of i-21, mems"):
        load_ins_class("strategic")
    with pytest.raises(SettingsError, match="position_white_m"):
        GnssErrorModel(position_white_m=-1.0)


def test_drift_and_tilt_belong_together() -> None:
    """tilt' = velocity / R + drift, on real routes with every coupling, without white noise."""
    batch = simulate_family(FamilySettings(ins=QUIET, route="manoeuvring", duration_s=3000.0), 3, SEED)
    meridian, normal = curvature_radii_m(batch.latitude_deg)
    radius = np.stack([meridian + batch.altitude_m, normal + batch.altitude_m], axis=-1)
    speed = batch.velocity_error_mps / radius
    change = np.diff(batch.tilt_rad, axis=1)
    left = change - 0.5 * (speed[:, 1:] + speed[:, :-1]) - batch.drift_radps[:, :-1]  # inputs are held over a step
    assert np.max(np.abs(left)) < 2e-3 * np.max(np.abs(batch.drift_radps))


def test_aligned_ins_stands_still() -> None:
    """Levelled and gyrocompassed, nothing moves on the stand but for what was put on top of the alignment."""
    ins = replace(QUIET, accelerometer_constant_ug=50.0, initial_position_m=0.0, gyro_random_dph=0.0)
    batch = simulate_family(FamilySettings(ins=ins, duration_s=20.0), 5, SEED)
    assert np.min(np.max(np.abs(batch.tilt_rad), axis=(1, 2))) > 1e-6
    north, east = (np.max(np.abs(batch.velocity_error_mps[..., channel])) for channel in (0, 1))
    assert north < 1e-6 and east > 1e-5  # the north gyro's drift is what gyrocompassing cannot balance
    assert np.max(np.abs(batch.drift_radps[..., 0])) < 1e-3 * np.max(np.abs(batch.drift_radps[..., 1]))
    for changes, channel in (({"is_levelled": False}, 1), ({"is_gyrocompassed": False}, 0)):
        other = simulate_family(FamilySettings(ins=replace(ins, **changes), duration_s=20.0), 5, SEED)
        assert np.max(np.abs(other.velocity_error_mps[..., channel])) > 1e-5, changes


def test_heading_wander_drifts_in_straight_flight_and_turns_take_it_back() -> None:
    """A real Laseref IV: 0.02 +- 0.03 deg, up to 0.1 deg in half an hour of straight flight, reset by turns."""
    settings = load_ins_class("navigation").heading
    time_s = np.arange(0.0, 3600.0)
    straight, turned = [], []
    for seed in range(300):
        heading = np.where(time_s < 1900.0, 40.0, 40.0 + np.clip(3.0 * (time_s - 1900.0), 0.0, 180.0))
        wander = draw_heading_wander(np.random.default_rng(seed), time_s, heading, settings)
        straight.append(wander[1800] - wander[0])
        turned.append(wander[2000])
    sampling = 4.0 / np.sqrt(2.0 * 300)  # four standard errors of a standard deviation
    assert np.std(straight) == pytest.approx(settings.drift_deg_per_sqrt_h * np.sqrt(0.5), rel=sampling)
    assert 0.02 < float(np.mean(np.abs(straight) > 0.1)) < 0.10  # 0.1 deg happens, and is not the rule
    left = settings.drift_deg_per_sqrt_h * np.sqrt(1900.0 / 3600.0) * np.exp(-180.0 / settings.turn_deg)
    own = settings.drift_deg_per_sqrt_h * np.sqrt(70.0 / 3600.0)  # upper bound of what came since and within the turn
    assert np.std(turned) == pytest.approx(settings.offset_deg, rel=0.25)
    assert np.std(turned) < np.sqrt(settings.offset_deg**2 + left**2 + own**2) * (1.0 + sampling)
    batch = simulate_family(FamilySettings(route="manoeuvring", duration_s=10_000.0), 20, SEED)
    output = np.rad2deg(batch.heading_error_rad - batch.azimuth_error_rad)
    assert 0.02 < float(np.std(output)) < 0.05


def test_no_wander_leaves_the_azimuth_error() -> None:
    ins = replace(load_ins_class("navigation"), heading=HeadingWander())
    batch = simulate_family(FamilySettings(ins=ins, duration_s=100.0), 2, SEED)
    assert np.array_equal(batch.heading_error_rad, batch.azimuth_error_rad)


def test_deflection_is_correlated_along_the_path_and_not_in_time() -> None:
    time_s = np.arange(0.0, 20_000.0)
    still = np.zeros(len(time_s))

    def path(speed_mps: float) -> FloatArray:
        motion = TrueMotion(time_s, still, still, still + speed_mps, still, still, still, still)
        rng = np.random.default_rng(3)
        return np.concatenate([spatial_gauss_markov(rng, motion, 40e3).T for _ in range(40)])

    for speed_mps in (50.0, 250.0):
        drawn, lag = path(speed_mps), round(20e3 / speed_mps)
        assert float(np.mean(drawn**2)) == pytest.approx(1.0, rel=0.35)  # 80 paths of 25 lengths or more: 4 sigma
        assert float(np.mean(drawn[:, lag:] * drawn[:, :-lag])) == pytest.approx(np.exp(-0.5), abs=0.25)
    assert np.ptp(path(0.0)[0]) == 0.0


def test_gnss_errors_have_their_size_and_correlation() -> None:
    noise = GnssErrorModel(position_white_m=3.0, position_correlated_m=10.0, velocity_correlated_mps=0.05)
    batch = simulate_family(FamilySettings(gnss=noise, truth="channel"), 20, SEED)
    error = batch.gnss_position_error_m
    # 20 flights x 2 axes x 53 correlation times: the slow variance is known to 3 %, four times that allowed
    assert float(np.var(error)) == pytest.approx(109.0, rel=0.12)
    assert float(np.mean(error[:, 300:] * error[:, :-300])) == pytest.approx(100.0 * np.exp(-1.0), abs=12.0)
    assert float(np.var(batch.gnss_velocity_error_mps)) == pytest.approx(0.03**2 + 0.05**2, rel=0.12)


def test_channel_truth_without_noise_is_the_exponential() -> None:
    from scipy.linalg import expm

    ins = replace(load_ins_class("i-21"), velocity_random_walk_mps_per_sqrt_s=0.0, gyro_random_dph=0.0)
    states = channel_truth(ins, 7201, 1.0, np.random.default_rng(1), channels=3).states
    expected = states[:, 0] @ np.linalg.matrix_power(expm(channel_matrix(1.0 / 3600.0)), 7200).T
    # 7200 products in SI units round by some 1e-8; the random drift, which is zero, by 1e-16
    assert np.allclose(states[:, -1], expected, rtol=1e-7, atol=1e-8 * np.max(np.abs(states), axis=(0, 1)) + 1e-15)


def test_channel_truth_has_the_covariance_of_its_model() -> None:
    ins, channels, epochs = load_ins_class("i-21"), 1500, 361
    states = channel_truth(ins, epochs, 10.0, np.random.default_rng(2), channels=channels).states[:, -1]
    transition, noise = channel_noise(ins, channel_matrix(1.0 / ins.gyro_correlation_s), 3600.0)
    covariance = transition @ np.diag(channel_sigmas(ins) ** 2) @ transition.T + noise
    assert np.sqrt(covariance[5, 5]) == pytest.approx(0.005 * DPH)  # stationary
    scale = np.sqrt(np.diag(covariance))
    measured = states.T @ states / channels
    # a covariance of n samples errs by sqrt((1 + r^2) / n) of the product of the sigmas; four times that allowed
    assert np.max(np.abs(measured - covariance) / np.outer(scale, scale)) < 4.0 * np.sqrt(2.0 / channels)
