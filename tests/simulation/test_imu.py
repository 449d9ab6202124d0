"""Simulated inertial units: exact increments on analytic motion, errors as their class says, truth beside them."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.ecef import ecef_from_n, ecef_m
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.gravity import normal_gravity_mps2
from groundstation.simulation.imu.families import FAMILIES, Family, motion_of
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.imu_class import imu_class_names, load_imu_class
from groundstation.simulation.imu.motion import Motion, Origin, exact_increments, true_states
from groundstation.simulation.imu.settings import (
    ImuSettings,
    MountingSettings,
    ReceiverSettings,
    StampSettings,
    VibrationSettings,
)
from groundstation.simulation.imu.unit import draw_errors
from groundstation.simulation.scenario import LogInterval

SEED = 20
LONG_S = 600.0
EXACT = 1e-12  # rad and m/s in an interval
CLOSURE_MPS = 1e-8  # Runge and Kutta's rule at 10 ms, over a minute
PERFECT = ReceiverSettings(position_white_m=0, position_slow_m=0, position_fast_m=0, velocity_white_mps=0)
FIVE_SIGMA = 5.0  # one test in a million fails by chance


def _motion(family: Family, seed: int = SEED) -> Motion:
    return motion_of(family, np.random.default_rng(seed), Origin(56.0, 38.0, 200.0), LONG_S, 0.3)


def test_gravity_is_that_of_the_tables() -> None:
    """NIMA TR8350.2, table 3.4: gravity at the equator and at the poles, and its mean over the ellipsoid."""
    assert normal_gravity_mps2([0.0, 90.0], 0.0) == pytest.approx([9.7803253359, 9.8321849378], abs=1e-10)
    sine = (np.arange(100_000) + 0.5) / 100_000  # bands of a sphere: all the same area, to the flattening squared
    assert normal_gravity_mps2(np.rad2deg(np.arcsin(sine)), 0.0).mean() == pytest.approx(9.7976432222, abs=1e-4)
    inverse_square = 9.7803253359 * (6_378_137.0 / 6_379_137.0) ** 2
    assert normal_gravity_mps2(0.0, 1000.0) == pytest.approx(inverse_square, abs=4e-5)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("rate_hz", [50.0, pytest.param(250.0, marks=pytest.mark.slow)])
def test_increments_are_exact(family: Family, rate_hz: float) -> None:
    """Every interval against three parts of it, each by a rule of twice as many nodes."""
    motion, step_s = _motion(family), 1.0 / rate_hz
    start_s = np.arange(0.0, LONG_S, 7.3 * step_s)
    found = exact_increments(motion, start_s, start_s + step_s)
    finer = sum(
        exact_increments(motion, start_s + part * step_s / 3.0, start_s + (part + 1) * step_s / 3.0, 8)
        for part in range(3)
    )
    assert np.abs(found - finer).max() < EXACT


@pytest.mark.parametrize("family", FAMILIES)
def test_rates_and_forces_close_the_motion(family: Family) -> None:
    """Integrate them for a minute in Earth-fixed axes, which the simulation does not use."""
    motion, step_s, first_s = _motion(family), 0.01, 150.0
    half = true_states(motion, first_s + 0.5 * step_s * np.arange(12_001))
    place = ecef_m(half.latitude_deg, half.longitude_deg, half.height_m)
    to_e = ecef_from_n(half.latitude_deg, half.longitude_deg)
    earth = np.array([0.0, 0.0, EARTH_RATE_RADPS])
    gravity = normal_gravity_mps2(half.latitude_deg, half.height_m)[:, None] * to_e[:, :, 2]

    def slope(at: int, state: np.ndarray) -> np.ndarray:
        e_from_b, velocity = state[:9].reshape(3, 3), state[9:12]
        turn = e_from_b @ _skew(half.rate_radps[at]) - _skew(earth) @ e_from_b
        change = e_from_b @ half.force_mps2[at] + gravity[at] - 2.0 * np.cross(earth, velocity)
        return np.concatenate([turn.ravel(), change, velocity])

    state = np.concatenate([(to_e[0] @ half.n_from_b[0]).ravel(), to_e[0] @ half.velocity_mps[0], np.zeros(3)])
    for at in range(0, 12_000, 2):
        one = slope(at, state)
        two = slope(at + 1, state + 0.5 * step_s * one)
        three = slope(at + 1, state + 0.5 * step_s * two)
        four = slope(at + 2, state + step_s * three)
        state = state + step_s / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    assert np.abs(state[:9].reshape(3, 3) - to_e[-1] @ half.n_from_b[-1]).max() < CLOSURE_MPS / 10.0
    assert np.abs(state[9:12] - to_e[-1] @ half.velocity_mps[-1]).max() < CLOSURE_MPS
    assert np.abs(state[12:] - (place[-1] - place[0])).max() < 60.0 * CLOSURE_MPS


def _skew(vector: np.ndarray) -> np.ndarray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@pytest.mark.parametrize("family", FAMILIES)
def test_a_perfect_unit_measures_the_truth(family: Family) -> None:
    flight = simulate_imu(family, SEED, settings=ImuSettings(duration_s=100.0, error_factor=0.0, gnss=PERFECT))
    exact = exact_increments(flight.motion, flight.time_s - flight.interval_s, flight.time_s)
    assert np.array_equal(flight.true_time_s, flight.time_s)
    assert np.abs(np.concatenate([flight.delta_angle_rad, flight.delta_velocity_mps], axis=1) - exact).max() < EXACT
    truth = true_states(flight.motion, flight.gnss.validity_s)
    arm_n = truth.n_from_b @ flight.lever_arm_m
    antenna = ecef_m(flight.gnss.latitude_deg, flight.gnss.longitude_deg, flight.gnss.height_m)
    unit = ecef_m(truth.latitude_deg, truth.longitude_deg, truth.height_m)
    to_e = ecef_from_n(truth.latitude_deg, truth.longitude_deg)
    assert np.abs(np.einsum("nji,nj->ni", to_e, antenna - unit) - arm_n).max() < 1e-6


def test_velocity_of_the_antenna_is_the_change_of_its_place() -> None:
    settings = ImuSettings(duration_s=200.0, gnss=replace(PERFECT, rate_hz=100.0))
    fixes = simulate_imu("hover", SEED, settings=settings).gnss
    place = ecef_m(fixes.latitude_deg, fixes.longitude_deg, fixes.height_m)
    to_e = ecef_from_n(fixes.latitude_deg[1:-1], fixes.longitude_deg[1:-1])
    change = np.einsum("nji,nj->ni", to_e, (place[2:] - place[:-2]) / 0.02)
    assert np.abs(change - fixes.velocity_mps[1:-1]).max() < 1e-3  # central differences over 20 ms


def test_motion_is_of_its_family() -> None:
    time_s = np.arange(0.0, LONG_S, 0.1)
    for seed in range(5):
        drive, wing, hover, late = (true_states(_motion(family, seed), time_s) for family in FAMILIES)
        speed = [np.hypot(*one.velocity_mps[:, :2].T) for one in (drive, wing, hover, late)]
        for standing in (drive, wing, hover):
            assert np.abs(standing.velocity_mps[time_s < 15.0]).max() < 1e-6
        assert (speed[0] < 1e-6).mean() > 0.1 and speed[0].max() < 20.0
        assert speed[3].min() > 5.0 and np.ptp(late.height_m) > 10.0
        flying = time_s > 100.0
        assert speed[1][flying].min() > 5.0 and speed[1].max() < 45.0
        assert wing.height_m[flying].min() > 220.0 and 20.0 < np.abs(wing.roll_deg).max() < 60.0
        assert np.abs(wing.force_mps2[flying, 1]).max() < 0.02  # no force to the side
        track = np.rad2deg(np.arctan2(wing.velocity_mps[:, 1], wing.velocity_mps[:, 0]))
        assert np.abs(wrap_180(wing.heading_deg - track))[flying].max() > 5.0  # wind
        assert speed[2].max() < 12.0 and np.abs(hover.roll_deg).max() < 35.0


def test_a_car_goes_where_its_nose_points() -> None:
    time_s = np.arange(0.0, LONG_S, 0.05)
    for slip in (0.0, 0.3):
        motion = motion_of("drive", np.random.default_rng(SEED), Origin(56.0, 38.0, 200.0), LONG_S, slip)
        truth = true_states(motion, time_s)
        moving = np.hypot(*truth.velocity_mps[:, :2].T) > 1.0
        track = np.rad2deg(np.arctan2(truth.velocity_mps[:, 1], truth.velocity_mps[:, 0]))
        off = np.abs(wrap_180(truth.heading_deg - track))[moving].max()
        assert off < 1e-9 if slip == 0.0 else 0.3 < off < 3.0


def _residual(flight: ImuFlight) -> tuple[np.ndarray, np.ndarray]:
    """Noise of the increments: what is left of them beside truth, matrix and bias."""
    true = exact_increments(flight.motion, flight.true_time_s - flight.interval_s, flight.true_time_s)
    turned = true[:, :3] @ flight.case_from_body.T, true[:, 3:] @ flight.case_from_body.T
    angle = flight.delta_angle_rad - turned[0] @ (np.eye(3) + flight.gyro_matrix).T
    velocity = flight.delta_velocity_mps - turned[1] @ (np.eye(3) + flight.accelerometer_matrix).T
    step_s = flight.interval_s[:, None]
    return angle - flight.gyro_bias_radps * step_s, velocity - flight.accelerometer_bias_mps2 * step_s


@pytest.mark.parametrize("name", imu_class_names())
def test_noise_is_that_of_the_class(name: str) -> None:
    unit = load_imu_class(name)
    flight = simulate_imu("uav", SEED, settings=ImuSettings(duration_s=200.0, imu_class=name))
    step_s = 1.0 / flight.settings.rate_hz
    walks = np.deg2rad(unit.angle_random_walk_deg_per_sqrt_h) / 60.0, unit.velocity_random_walk_mps_per_sqrt_s
    steps = np.deg2rad(unit.rate_resolution_dps) * step_s, unit.acceleration_resolution_mps2 * step_s
    for noise, walk, step in zip(_residual(flight), walks, steps, strict=True):
        expected = np.sqrt(walk * walk * step_s + 2.0 * step * step / 12.0)  # the rest of a step is carried on
        assert noise.std() == pytest.approx(expected, rel=FIVE_SIGMA / np.sqrt(2.0 * noise.size))
        assert np.abs(noise.mean(axis=0)).max() < FIVE_SIGMA * expected / np.sqrt(len(noise))


@pytest.mark.parametrize("name", imu_class_names())
def test_constants_are_those_of_the_class(name: str) -> None:
    unit, rng, runs = load_imu_class(name), np.random.default_rng(SEED), 400
    drawn = [draw_errors(unit, rng, 2, ImuSettings(imu_class=name)) for _ in range(runs)]
    dph, micro_g = np.deg2rad(1.0 / 3600.0), 9.80665e-6
    band = FIVE_SIGMA / np.sqrt(2.0 * 3 * runs)
    gyro = np.hypot(unit.gyro_constant_dph, unit.gyro_random_dph) * dph
    accelerometer = np.hypot(unit.accelerometer_constant_ug, unit.accelerometer_random_ug) * micro_g
    assert np.std([one.bias[0] for one, _ in drawn]) == pytest.approx(gyro, rel=band)
    assert np.std([one.bias[0] for _, one in drawn]) == pytest.approx(accelerometer, rel=band)
    scale = np.std([np.diag(one.matrix) for one, _ in drawn])
    assert scale == pytest.approx(1e-6 * unit.gyro_scale_factor_ppm, rel=band)


def test_stated_scale_and_misalignment_take_the_place_of_the_class() -> None:
    settings, rng = ImuSettings(scale_factor=0.005, misalignment_deg=0.3), np.random.default_rng(SEED)
    drawn = [part.matrix for _ in range(300) for part in draw_errors(load_imu_class("navigation"), rng, 2, settings)]
    beside = np.array(drawn)[:, ~np.eye(3, dtype=bool)]
    assert np.std([np.diag(one) for one in drawn]) == pytest.approx(0.005, rel=0.1)
    assert beside.std() == pytest.approx(np.deg2rad(0.3), rel=0.1)


def test_mounting_turns_the_axes_of_the_case() -> None:
    plain = simulate_imu("hover", SEED, settings=ImuSettings(duration_s=50.0, error_factor=0.0))
    for mirrored, determinant in (("", 1.0), ("y", -1.0)):
        mounting = MountingSettings((0.0, 0.0, 90.0), (0.0, 2.0, 0.0), mirrored)
        settings = ImuSettings(duration_s=50.0, error_factor=0.0, mounting=mounting)
        turned = simulate_imu("hover", SEED, settings=settings)
        assert np.linalg.det(turned.case_from_body) == pytest.approx(determinant)
        expected = plain.delta_velocity_mps @ turned.case_from_body.T
        assert turned.delta_velocity_mps == pytest.approx(expected, abs=EXACT)
    nose = MountingSettings((0.0, 0.0, 90.0))
    turned = simulate_imu("hover", SEED, settings=ImuSettings(duration_s=1.0, error_factor=0.0, mounting=nose))
    assert turned.case_from_body @ [0.0, 1.0, 0.0] == pytest.approx([1.0, 0.0, 0.0])  # its x points to the right


def test_stamps_have_jitter_gaps_doubles_and_steps_back() -> None:
    stamps = StampSettings(jitter_s=0.003, gaps=(LogInterval(100.0, 101.5),))
    flight = simulate_imu("drive", SEED, settings=ImuSettings(stamps=stamps))
    late = flight.time_s - flight.true_time_s
    assert np.diff(flight.time_s).min() > 0.0
    assert late.std() == pytest.approx(0.003, rel=0.05)
    assert len(late) == 60_000 - 150 and np.diff(flight.true_time_s).max() == pytest.approx(1.51)
    broken = StampSettings(duplicated=0.01, backward=0.02)
    steps = np.diff(simulate_imu("drive", SEED, settings=ImuSettings(stamps=broken)).time_s)
    assert (steps == 0.0).mean() == pytest.approx(0.01, abs=0.002)
    assert (steps < 0.0).mean() == pytest.approx(0.02, abs=0.003)


def test_point_samples_are_not_integrals() -> None:
    settings = ImuSettings(duration_s=100.0, error_factor=0.0, is_integral=False)
    flight = simulate_imu("uav", SEED, settings=settings)
    truth = true_states(flight.motion, flight.true_time_s)
    assert flight.delta_velocity_mps == pytest.approx(truth.force_mps2 * flight.interval_s[:, None], abs=EXACT)
    integral = simulate_imu("uav", SEED, settings=replace(settings, is_integral=True))
    assert np.abs(flight.delta_velocity_mps - integral.delta_velocity_mps).max() > 1e-4


def test_vibration_is_averaged_by_a_unit_that_integrates() -> None:
    vibration = VibrationSettings(rate_dps=5.0, acceleration_mps2=3.0, frequency_hz=83.0)
    spread = []
    for is_integral in (True, False):
        settings = ImuSettings(100.0, error_factor=0.0, is_integral=is_integral, vibration=vibration)
        still = simulate_imu("hover", SEED, settings=replace(settings, vibration=VibrationSettings()))
        shaken = simulate_imu("hover", SEED, settings=settings)
        spread.append((shaken.delta_velocity_mps - still.delta_velocity_mps).std() * settings.rate_hz)
    assert spread[1] == pytest.approx(3.0, rel=0.05) and spread[0] < 0.5 * spread[1]


@pytest.mark.slow
def test_fixes_have_the_errors_that_are_stated() -> None:
    settings = ReceiverSettings(1.0, latency_s=0.3, stated_factor=0.5, outages=(LogInterval(200.0, 260.0),))
    runs = [simulate_imu("hover", seed, settings=ImuSettings(600.0, 10.0, gnss=settings)).gnss for seed in range(30)]
    error = np.concatenate([one.position_error_m for one in runs]) / [1.0, 1.0, 1.5]
    assert error.std() == pytest.approx(np.sqrt(0.5**2 + 1.0 + 0.3**2), rel=0.2)  # 30 runs of 2 times 300 s
    change = np.concatenate([np.diff(one.position_error_m[:200, :2], axis=0) for one in runs])
    fast, slow = 0.3**2 * (1.0 - np.exp(-0.1)), 1.0 - np.exp(-1.0 / 300.0)
    assert change.std() == pytest.approx(np.sqrt(2.0 * (0.5**2 + fast + slow)), rel=0.05)
    one = runs[0]
    assert one.time_s - one.validity_s == pytest.approx(0.3, abs=1e-9)
    assert len(one.time_s) == 540 and np.diff(one.time_s).max() == pytest.approx(61.0)
    assert one.position_sigma_m[0, 0] == pytest.approx(0.5 * np.sqrt(0.5**2 + 1.0 + 0.3**2))
    assert one.velocity_error_mps[:, :2].std() == pytest.approx(0.05, rel=0.15)


def test_the_same_seed_gives_the_same_motion_under_other_errors() -> None:
    one = simulate_imu("uav", SEED, settings=ImuSettings(duration_s=100.0))
    two = simulate_imu("uav", SEED, settings=ImuSettings(duration_s=100.0, imu_class="navigation"))
    other = simulate_imu("uav", SEED + 1, settings=ImuSettings(duration_s=100.0))
    assert np.array_equal(one.latitude_deg, two.latitude_deg)
    assert not np.array_equal(one.delta_angle_rad, two.delta_angle_rad)
    assert not np.array_equal(one.latitude_deg, other.latitude_deg)


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(SettingsError, match="family: found 'boat'"):
        simulate_imu("boat", SEED)  # type: ignore[arg-type]
    with pytest.raises(SettingsError, match="imu_class"):
        simulate_imu("uav", SEED, settings=ImuSettings(imu_class="toy"))
    with pytest.raises(SettingsError, match="rate_hz"):
        ImuSettings(rate_hz=0.0)
