"""Coupled north-east model: its matrix against a strapdown mechanisation and the simulation, its filter, its gain."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.linalg import expm

from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.base.records import Int64Array
from groundstation.methods.ins_noise import GnssNoise, InsNoise
from groundstation.simulation.inertial_family import ErrorBatch, FamilySettings, simulate_family
from groundstation.simulation.ins_errors import SensorErrors, TrueMotion, propagate
from groundstation.systems.inertial import coupled, coupled_forecast
from groundstation.systems.inertial.coupled import (
    AZIMUTH,
    AZIMUTH_DRIFT,
    CHANNELS,
    EAST,
    NORTH,
    CoupledRun,
)
from groundstation.systems.inertial.craft_motion import CraftMotion
from groundstation.systems.inertial.differences import InsDifferences, drag_per_s
from groundstation.systems.inertial.filter import DifferenceEpochs, run_filter
from groundstation.systems.inertial.hindcast import hindcast
from groundstation.systems.inertial.leads import built_up, start_epochs
from groundstation.systems.inertial.model import (
    DRIFT,
    POSITION,
    RANDOM_DRIFT,
    TILT,
    VELOCITY,
    ChannelModel,
    FloatArray,
    normal_gravity_mps2,
)
from groundstation.systems.inertial.seams import PATIENCE_S
from groundstation.systems.inertial.settings import InertialSettings

TYPICAL = (100.0, 0.1, 1e-5, 5e-8, 1e-12, 5e-8)  # sizes of the six states, SI units
SETTINGS = InertialSettings()
PLATFORM = InsNoise(is_strapdown=False, accelerometer_ug=20.0)  # its sensors stay north and east
LEADS_S: FloatArray = np.arange(1, 13, dtype=np.float64) * 600.0
NO_COVARIANCE: FloatArray = np.zeros((0, coupled.SIZE, coupled.SIZE))
QUIET = GnssNoise(10.0, 0.0, 300.0, 1e-3, 0.0, 60.0)
BETA = 1.0 / 3600.0
LINEAR_SHARE = 5e-3  # gravity changes with the position error, and radii do, which the matrix leaves out
RADII_SHARE = 2e-3  # the simulation leaves out that radii change with the latitude error
LEFT_OUT_SHARE = 3e-4  # the same against the largest term of a row
USED_SHARE = 0.999  # five sigmas of the gate, which white noise hardly leaves
FOLLOWED_SIGMAS = 1.0  # an undisturbed estimate differs by what the disturbance made it forget: less than its sigma
ROUNDING = 1e-9  # one part in a billion: the same sums in another order
AS_GOOD_SHARE = 1.8  # what was learned of tilt and drift is kept, but for a minute of a velocity step not yet believed


def craft(latitude_deg: float, velocity: tuple[float, float], acceleration: tuple[float, float]) -> CraftMotion:
    place = np.array([latitude_deg]), np.array([10_000.0])
    return CraftMotion(*place, np.array([velocity]), np.array([acceleration]), np.zeros(1))


def differences_of(motion: TrueMotion, position: FloatArray, velocity: FloatArray) -> InsDifferences:
    """Of one flight whose INS has these errors against GNSS."""
    n = len(motion.time_s)
    speed = np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1)
    latitude, altitude = motion.latitude_deg[0], motion.altitude_m[0]
    drag = drag_per_s(latitude, altitude, speed)
    epochs = DifferenceEpochs(motion.time_s, position, velocity, drag, np.zeros(n, dtype=bool))
    return InsDifferences("ins", "gnss", epochs, latitude, np.zeros(n), altitude, speed, 0.0, ())


def of_batch(batch: ErrorBatch, row: int = 0) -> InsDifferences:
    zero = np.zeros((1, len(batch.time_s)))
    motion = TrueMotion(
        time_s=batch.time_s,
        latitude_deg=batch.latitude_deg[row],
        altitude_m=batch.altitude_m[row],
        velocity_north_mps=batch.velocity_north_mps[row],
        velocity_east_mps=batch.velocity_east_mps[row],
        velocity_down_mps=zero,
        heading_deg=batch.heading_deg[row],
        roll_deg=zero,
    )
    return differences_of(
        motion,
        batch.position_error_m[row] - batch.gnss_position_error_m[row],
        batch.velocity_error_mps[row] - batch.gnss_velocity_error_mps[row],
    )


def straight(
    seconds: float, latitude_deg: float, north: float, east: float, turn_at: float | None = None
) -> TrueMotion:
    """Level flight at constant speeds, the latitude exact for them to first order; a turn by 90 deg if asked for."""
    time_s = np.arange(seconds + 1.0)
    angle = np.zeros_like(time_s) if turn_at is None else np.clip((time_s - turn_at) / 60.0, 0.0, 1.0) * 0.5 * np.pi
    v_north, v_east = north * np.cos(angle) - east * np.sin(angle), north * np.sin(angle) + east * np.cos(angle)
    meridian, _ = curvature_radii_m(latitude_deg)
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (v_north[1:] + v_north[:-1]))])
    zero = np.zeros_like(time_s)
    return TrueMotion(
        time_s=time_s,
        latitude_deg=latitude_deg + np.rad2deg(moved / (float(meridian) + 10_000.0)),
        altitude_m=zero + 10_000.0,
        velocity_north_mps=v_north,
        velocity_east_mps=v_east,
        velocity_down_mps=zero,
        heading_deg=zero,
        roll_deg=zero,
    )


def drifting(motion: TrueMotion, north_dph: float, east_dph: float, azimuth_rad: float) -> SensorErrors:
    """North-slaved sensors whose constant drifts are those of the channels."""
    none = SensorErrors.none(1, len(motion.time_s))
    gyro = np.array(none.gyro_radps)
    gyro[..., 1], gyro[..., 0] = np.deg2rad(north_dph / 3600.0), -np.deg2rad(east_dph / 3600.0)
    return replace(none, gyro_radps=gyro, azimuth_rad=np.array([azimuth_rad]))


# The matrix


def strapdown_rates(state: FloatArray, rate_ib: FloatArray, force_b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nonlinear mechanisation at a fixed altitude: derivatives of [latitude rad, longitude rad, v_N, v_E], and of C.

    ``state`` holds these four and then C (body to north-east-down) row by row. Source: Titterton and Weston 2004,
    section 3.5.
    """
    latitude, north, east, C = state[0], state[2], state[3], state[4:].reshape(3, 3)
    meridian, normal = (float(part) + 10_000.0 for part in curvature_radii_m(np.rad2deg(latitude)))
    earth = EARTH_RATE_RADPS * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    transport = np.array([east / normal, -north / meridian, -east * np.tan(latitude) / normal])
    gravity = np.array([0.0, 0.0, normal_gravity_mps2(np.rad2deg(latitude), 10_000.0)])
    acceleration = C @ force_b - np.cross(2.0 * earth + transport, np.array([north, east, 0.0])) + gravity
    moved = np.array([north / meridian, east / (normal * np.cos(latitude)), *acceleration[:2]])
    return moved, C @ skew(rate_ib) - skew(earth + transport) @ C


def skew(a: FloatArray) -> FloatArray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def perturbed(truth: FloatArray, x: FloatArray) -> FloatArray:
    """State of an INS with errors x: computed C = (I - [phi x]) C, phi = (east tilt, -north tilt, -azimuth)."""
    meridian, normal = (float(part) + 10_000.0 for part in curvature_radii_m(np.rad2deg(truth[0])))
    phi = np.array([x[EAST + TILT], -x[NORTH + TILT], -x[AZIMUTH]])
    out = np.array(truth)
    out[:4] += [x[0] / meridian, x[EAST] / (normal * np.cos(truth[0])), x[1], x[EAST + 1]]
    out[4:] = ((np.eye(3) - skew(phi)) @ truth[4:].reshape(3, 3)).ravel()
    return out


@pytest.mark.parametrize("latitude, north, east", [(45.0, 120.0, 200.0), (-30.0, -150.0, 90.0), (60.0, 10.0, -240.0)])
def test_matrix_is_the_jacobian_of_a_strapdown_mechanisation(latitude: float, north: float, east: float) -> None:
    acceleration = np.array([1.5, -2.5])
    motion = craft(latitude, (north, east), (1.5, -2.5))
    A = coupled.coupled_matrix(motion, BETA)[0]
    C = expm(skew(np.array([0.1, -0.05, 0.7])))
    truth = np.concatenate([[np.deg2rad(latitude), 0.3, north, east], C.ravel()])
    force = motion.specific_force_mps2()[0]
    # the mechanisation at the true state accelerates as the craft does
    assert np.allclose(strapdown_rates(truth, np.zeros(3), C.T @ force)[0][2:], acceleration, atol=1e-9)
    rate = C.T @ np.array([0.01, -0.02, 0.05])
    states = [NORTH, NORTH + 1, NORTH + 2, EAST, EAST + 1, EAST + 2, AZIMUTH]
    sizes = np.array([100.0, 0.1, 1e-5, 100.0, 0.1, 1e-5, 1e-5])
    largest = np.array([0.1, 1e-4, 1.6e-8, 0.1, 1e-4, 1.6e-8, 1.6e-8])  # velocity, g x tilt, velocity / R
    for state, size in zip(states, sizes, strict=True):
        both = []
        for sign in (1.0, -1.0):
            x = np.zeros(coupled.SIZE)
            x[state] = sign * size
            both.append(error_rates(truth, perturbed(truth, x), rate, C.T @ force, north))
        numeric, ours = 0.5 * (both[0] - both[1]), A[states, state] * size
        assert (np.abs(numeric - ours) < LINEAR_SHARE * np.abs(ours) + LEFT_OUT_SHARE * largest).all(), state


def error_rates(truth: FloatArray, wrong: FloatArray, rate: FloatArray, force: FloatArray, north: float) -> FloatArray:
    """Rates of [pN vN tN pE vE tE azimuth] of an INS at ``wrong``."""
    (true_rates, true_C), (rates, C) = (strapdown_rates(part, rate, force) for part in (truth, wrong))
    meridian, normal = (float(part) + 10_000.0 for part in curvature_radii_m(np.rad2deg(truth[0])))
    change = rates - true_rates
    d_latitude, beyond = wrong[0] - truth[0], curvature_radii_m(np.rad2deg(truth[0]) + 0.01)[0]
    growth = (float(beyond) + 10_000.0 - meridian) / np.deg2rad(0.01) * north / meridian  # of the meridian's radius
    # the parallel shrinks on the way to the pole: (d_lon R cos lat)'
    d_longitude = wrong[1] - truth[1]
    east = change[1] * normal * np.cos(truth[0]) - d_longitude * np.sin(truth[0]) * normal * north / meridian
    C_true, C_wrong = truth[4:].reshape(3, 3), wrong[4:].reshape(3, 3)
    phi_dot = -(C @ C_true.T + C_wrong @ true_C.T)  # derivative of -(C_wrong C_true')
    phi = np.array([phi_dot[2, 1] - phi_dot[1, 2], phi_dot[0, 2] - phi_dot[2, 0], phi_dot[1, 0] - phi_dot[0, 1]]) / 2.0
    return np.array([change[0] * meridian + d_latitude * growth, change[2], -phi[1], east, change[3], phi[0], -phi[2]])


def test_signs_of_the_coupling_by_example() -> None:
    at_rest = coupled.coupled_matrix(craft(60.0, (0.0, 0.0), (0.0, 0.0)), BETA)[0]
    # heading error to the right (+) while the craft gains speed to the north: the INS believes it drifts east
    speeding_up = coupled.coupled_matrix(craft(60.0, (0.0, 0.0), (2.0, 0.0)), BETA)[0]
    assert speeding_up[EAST + VELOCITY, AZIMUTH] == pytest.approx(2.0)
    assert speeding_up[NORTH + VELOCITY, AZIMUTH] == 0.0
    # Earth rate north x azimuth tilts the north channel as a drift does: 0.1 deg at 60 deg are 0.013 deg/h
    assert at_rest[TILT, AZIMUTH] * 0.1 * 3600.0 == pytest.approx(0.01313, rel=1e-3)
    # Foucault: the plane of oscillation turns with 2 x Earth rate x sin(latitude) in the velocities, to the right
    assert at_rest[VELOCITY, EAST + VELOCITY] == pytest.approx(-2.0 * EARTH_RATE_RADPS * np.sin(np.pi / 3.0))


def test_without_rotation_the_blocks_are_the_channels() -> None:
    A = coupled.coupled_matrix(craft(45.0, (0.0, 0.0), (0.0, 0.0)), BETA)[0]
    for channel in CHANNELS:
        model = ChannelModel.at(45.0, 10_000.0, BETA).matrix()
        assert np.allclose(A[np.ix_(channel, channel)], model, rtol=2e-3)


def test_schuler_and_foucault_periods_come_out() -> None:
    A = coupled.coupled_matrix(craft(55.0, (0.0, 0.0), (0.0, 0.0)), BETA)[0]
    rates = np.unique(np.round(np.abs(np.linalg.eigvals(A).imag), 9))
    rates = rates[rates > 1e-5]
    schuler = np.sqrt(normal_gravity_mps2(55.0, 10_000.0) / 6.385e6)
    foucault = EARTH_RATE_RADPS * np.sin(np.deg2rad(55.0))
    assert rates[0] == pytest.approx(EARTH_RATE_RADPS, rel=0.02)  # the 24 h oscillation
    assert rates[1:] == pytest.approx([schuler - foucault, schuler + foucault], rel=3e-3)


def test_exponential_of_the_filter_is_the_exponential() -> None:
    motion = craft(50.0, (100.0, 220.0), (3.0, -1.0))
    values = coupled.coupled_values(motion, BETA)[:1]
    transition = coupled.RATES.transition(values, np.array([10.0]), np.zeros(coupled.SIZE))
    E = np.eye(coupled.SIZE)
    E[coupled.RATES.reach] = transition.dynamics.F[0]
    exact, term = np.eye(coupled.SIZE), np.eye(coupled.SIZE)
    for order in range(1, 12):
        term = term @ coupled.coupled_matrix(motion, BETA)[0] * 10.0 / order
        exact = exact + term
    sizes = np.array([*TYPICAL, *TYPICAL, 1e-3, 5e-8, 1e-4, 1e-4])
    assert np.abs((E - exact) * sizes / sizes[:, None]).max() < 1e-8


# The filter and the forecast


@pytest.mark.parametrize("turn_at", [None, 3000.0])
def test_forecast_from_the_true_state_follows_the_simulation(turn_at: float | None) -> None:
    motion = straight(9000.0, 50.0, 30.0, 240.0, turn_at)
    truth = propagate(motion, drifting(motion, 0.01, -0.02, 1e-3), body_fixed=False)
    differences = differences_of(motion, truth.position_m[0], truth.velocity_mps[0])
    at = np.array([1800])
    x = np.zeros((len(motion.time_s), coupled.SIZE))
    x[at[0], CHANNELS[:, VELOCITY]] = truth.velocity_mps[0, at[0]]
    x[at[0], CHANNELS[:, TILT]] = truth.tilt_rad[0, at[0]]
    x[at[0], CHANNELS[:, DRIFT]] = np.deg2rad(np.array([0.01, -0.02]) / 3600.0)
    x[at[0], AZIMUTH] = truth.azimuth_rad[0, at[0]]
    empty = np.zeros((len(x), 2, 2))
    run = coupled.CoupledRun(
        differences, PLATFORM, x, np.zeros_like(x), empty, empty, empty.astype(np.int8), NO_COVARIANCE
    )
    forecast = coupled_forecast.hindcast_coupled(run, at, LEADS_S, SETTINGS)[0]
    actual = truth.position_m[0, at[0] + LEADS_S.astype(int)] - truth.position_m[0, at[0]]
    largest = np.abs(actual).max()
    assert largest > 1000.0
    assert np.abs(forecast - actual).max() < RADII_SHARE * largest


def strapdown(seconds: float, turn_at: float) -> tuple[TrueMotion, SensorErrors]:
    """A flight that turns by 90 deg; constant gyro drifts and accelerometer biases fixed to the body."""
    flown = straight(seconds, 50.0, 240.0, 30.0, turn_at)
    heading = np.rad2deg(np.arctan2(flown.velocity_east_mps, flown.velocity_north_mps))
    none = SensorErrors.none(1, len(flown.time_s))
    gyro, accelerometer = np.array(none.gyro_radps), np.array(none.accelerometer_mps2)
    gyro[..., :2] = np.deg2rad(np.array([0.01, -0.02]) / 3600.0)
    accelerometer[..., :2] = 3e-4, -5e-4
    return replace(flown, heading_deg=heading), replace(none, gyro_radps=gyro, accelerometer_mps2=accelerometer)


def test_sensors_of_a_strapdown_turn_with_it() -> None:
    """Forecast across a turn, from the true state: drifts and biases act on the other channel behind it."""
    motion, sensors = strapdown(9000.0, 3000.0)
    truth = propagate(motion, sensors)
    differences = differences_of(motion, truth.position_m[0], truth.velocity_mps[0])
    at, x = np.array([1800]), np.zeros((len(motion.time_s), coupled.SIZE))
    x[at[0], CHANNELS[:, VELOCITY]] = truth.velocity_mps[0, at[0]]
    x[at[0], CHANNELS[:, TILT]] = truth.tilt_rad[0, at[0]]
    # heading north the north channel feels the right gyro, the east channel the forward one with its sign turned
    x[at[0], CHANNELS[:, DRIFT]] = np.deg2rad(np.array([-0.02, -0.01]) / 3600.0)
    x[at[0], [coupled.FORWARD_BIAS, coupled.RIGHT_BIAS]] = 3e-4, -5e-4
    x[at[0], AZIMUTH] = truth.azimuth_rad[0, at[0]]
    empty = np.zeros((len(x), 2, 2))
    actual = truth.position_m[0, at[0] + LEADS_S.astype(int)] - truth.position_m[0, at[0]]
    apart = {}
    for noise in (InsNoise(), PLATFORM):
        run = coupled.CoupledRun(
            differences, noise, x, np.zeros_like(x), empty, empty, empty.astype(np.int8), NO_COVARIANCE
        )
        apart[noise.is_strapdown] = np.abs(
            coupled_forecast.hindcast_coupled(run, at, LEADS_S, SETTINGS)[0] - actual
        ).max()
    largest = np.abs(actual).max()
    assert largest > 1000.0
    assert apart[True] < RADII_SHARE * largest
    assert apart[False] > 0.2 * largest


def test_a_turn_shows_the_accelerometer_biases() -> None:
    motion, sensors = strapdown(5000.0, 2500.0)
    truth = propagate(motion, sensors)
    differences = differences_of(motion, truth.position_m[0], truth.velocity_mps[0])
    noise = replace(
        InsNoise(accelerometer_ug=100.0), gnss=QUIET, velocity_walk_mps_per_sqrt_s=1e-6, tilt_walk_deg_per_sqrt_h=1e-5
    )
    run = coupled.run_coupled(differences, noise, replace(SETTINGS, gate_sigmas=1000.0))
    biases = [coupled.FORWARD_BIAS, coupled.RIGHT_BIAS]
    assert run.x[-1, biases] == pytest.approx([3e-4, -5e-4], abs=3e-5)
    assert (run.sigma[-1, biases] < 0.1 * run.sigma[2400, biases]).all()


def test_heading_is_that_of_the_ins_else_of_its_track() -> None:
    motion = straight(60.0, 50.0, -30.0, 0.0)
    nothing = np.zeros((61, 2))
    south = differences_of(motion, nothing, nothing)
    assert np.abs(south.unwrapped_heading_rad) == pytest.approx(np.pi)
    told = np.where(np.arange(61) < 30, 359.0, 2.0)
    told[40:] = np.nan
    of_both = replace(south, heading_deg=told).unwrapped_heading_rad
    assert np.rad2deg(of_both[[0, 30]]) == pytest.approx([359.0, 362.0])
    assert np.abs(np.rad2deg(of_both[50]) - 360.0) == pytest.approx(180.0)
    slow = differences_of(straight(60.0, 50.0, 3.0, 0.0), nothing, nothing)
    assert (slow.unwrapped_heading_rad == 0.0).all()


def test_own_variance_is_that_of_the_model_carried_along() -> None:
    """Against exponentials of the whole matrix at steps of ten seconds: ours of a minute cost 0.8 % of sigma."""
    motion, _ = strapdown(4000.0, 1500.0)
    nothing = np.zeros((4001, 2))
    differences = differences_of(motion, nothing, nothing)
    run = coupled.run_coupled(differences, InsNoise(accelerometer_ug=50.0), SETTINGS)
    variance = coupled_forecast.coupled_variance(run, np.array([1000]), np.array([600.0, 1200.0]))[0]
    P = np.array(run.P[100])
    P[CHANNELS[:, POSITION]] = P[:, CHANNELS[:, POSITION]] = 0.0
    _, density = coupled.noise_of(run.noise, differences, differences.epochs, 0.0)
    between = CraftMotion.between(differences, 1000.0 + 10.0 * np.arange(121))
    expected = []
    for k, A in enumerate(coupled.coupled_matrix(between, run.noise.beta_per_s)):
        F = expm(10.0 * A)
        P = F @ (P + 5.0 * np.diag(density)) @ F.T + 5.0 * np.diag(density)
        if k in (59, 119):
            expected.append(np.diag(P)[CHANNELS[:, POSITION]])
    assert np.sqrt(variance) == pytest.approx(np.sqrt(expected), rel=0.01)


def test_filter_finds_the_azimuth_in_a_turn_and_every_drift() -> None:
    motion = straight(9000.0, 50.0, 30.0, 240.0, turn_at=4000.0)
    truth = propagate(motion, drifting(motion, 0.01, -0.02, 1e-3), body_fixed=False)
    differences = differences_of(motion, truth.position_m[0], truth.velocity_mps[0])
    noise = replace(PLATFORM, gnss=QUIET, velocity_walk_mps_per_sqrt_s=1e-6, tilt_walk_deg_per_sqrt_h=1e-5)
    noise = replace(noise, random_drift_dph=1e-5)
    run = coupled.run_coupled(differences, noise, replace(SETTINGS, gate_sigmas=1000.0))
    assert run.x[-1, AZIMUTH] == pytest.approx(truth.azimuth_rad[0, -1], rel=0.02)
    assert np.rad2deg(run.x[-1, CHANNELS[:, DRIFT]]) * 3600.0 == pytest.approx([0.01, -0.02], abs=5e-4)
    assert run.sigma[-1, AZIMUTH] < 0.1 * run.sigma[3900, AZIMUTH]


def test_consistent_on_matched_truth() -> None:
    """NEES of every state over 60 runs drawn from the model itself, inside its 99 % chi-square band."""
    from scipy.stats import chi2

    motion = straight(1800.0, 45.0, 50.0, 230.0, turn_at=900.0)
    noise = replace(PLATFORM, gnss=GnssNoise(5.0, 0.0, 300.0, 0.05, 0.0, 60.0), velocity_walk_mps_per_sqrt_s=1e-3)
    differences = differences_of(motion, np.zeros((1801, 2)), np.zeros((1801, 2)))
    values = coupled.coupled_matrix(
        CraftMotion.between(differences, motion.time_s, is_strapdown=False), noise.beta_per_s
    )
    covariance, density = coupled.noise_of(noise, differences, differences.epochs, 0.0)
    root = np.linalg.cholesky(covariance + 1e-30 * np.eye(coupled.SIZE))
    runs, total = 60, np.zeros(coupled.SIZE)
    rng = np.random.default_rng(5)
    states = [root @ rng.standard_normal((coupled.SIZE, runs))]
    for matrix in values:
        step = np.eye(coupled.SIZE) + matrix + 0.5 * matrix @ matrix + matrix @ matrix @ matrix / 6.0
        states.append(step @ states[-1] + np.sqrt(density)[:, None] * rng.standard_normal((coupled.SIZE, runs)))
    for true in np.moveaxis(np.array(states), 2, 0):
        z = true[:, CHANNELS[:, [POSITION, VELOCITY]]] + rng.standard_normal((1801, 2, 2)) * [5.0, 0.05]
        run = coupled.run_coupled(differences_of(motion, z[:, :, 0], z[:, :, 1]), noise, SETTINGS)
        total += np.square((run.x[-1] - true[-1]) / run.sigma[-1])
    low, high = (float(chi2.ppf(share, runs)) for share in (0.0005, 0.9995))  # 16 states: one in sixty tests at random
    assert (total > low).all() and (total < high).all(), total / runs


def test_gaps_irregular_epochs_missing_channel_and_an_outlier() -> None:
    motion = straight(6000.0, 50.0, 30.0, 240.0)
    truth = propagate(motion, drifting(motion, 0.01, -0.02, 0.0), body_fixed=False)
    rng = np.random.default_rng(3)
    position = truth.position_m[0] + 3.0 * rng.standard_normal((6001, 2))
    velocity = truth.velocity_mps[0] + 0.05 * rng.standard_normal((6001, 2))
    whole = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    position[4000:4600], velocity[4000:4600] = np.nan, np.nan
    position[1000, 0] = np.nan
    position[2000] += 1100.0
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    assert np.isfinite(run.x).all() and np.isfinite(run.sigma).all()
    assert (run.used[2000, 0] == -1).all() and (run.used[2000, 1] == 1).all()
    assert run.used[1000, 0].tolist() == [0, 1]
    assert (run.used[4000:4600] == 0).all()
    assert (np.abs(run.x[2001] - whole.x[2001]) < run.sigma[2001]).all()
    assert (run.sigma[4599, :3] > run.sigma[3999, :3]).all()
    assert (np.abs(run.x[-1] - whole.x[-1]) < run.sigma[-1]).all()


def test_gap_without_the_ins_is_crossed_in_short_steps() -> None:
    motion = straight(7200.0, 50.0, 0.0, 0.0)
    truth = propagate(motion, drifting(motion, 0.01, -0.02, 1e-3), body_fixed=False)
    keep = np.r_[0:3600, 7200]
    few = TrueMotion(*(getattr(motion, item.name)[..., keep] for item in fields(motion)))
    kept = differences_of(few, truth.position_m[0, keep], truth.velocity_mps[0, keep])
    noise = replace(PLATFORM, gnss=QUIET, velocity_walk_mps_per_sqrt_s=1e-7, tilt_walk_deg_per_sqrt_h=1e-6)
    noise = replace(noise, random_drift_dph=1e-5, drift_rate_dphph=1e-6)
    run = coupled.run_coupled(kept, noise, replace(SETTINGS, gate_sigmas=1000.0))
    grown = np.abs(truth.position_m[0, 7200] - truth.position_m[0, 3599]).max()
    assert np.abs(run.innovation[-1, 0]).max() < 0.02 * grown


def eastbound(latitude_deg: float = 50.0) -> tuple[TrueMotion, FloatArray, FloatArray]:
    """Two hours and a half: the motion, position and velocity differences with white noise of GNSS."""
    motion = straight(9000.0, latitude_deg, 30.0, 240.0)
    truth = propagate(motion, drifting(motion, 0.01, -0.02, 1e-4), body_fixed=False)
    rng = np.random.default_rng(4)
    shape = truth.position_m[0].shape
    position = truth.position_m[0] + 3.0 * rng.standard_normal(shape)
    return motion, position, truth.velocity_mps[0] + 0.05 * rng.standard_normal(shape)


def with_resets(plain: InsDifferences, at: list[int]) -> InsDifferences:
    marks = np.zeros(len(plain.epochs), dtype=bool)
    marks[at] = True
    return replace(plain, epochs=replace(plain.epochs, is_reset=marks))


def grown_from(step: FloatArray, motion: TrueMotion, at: int) -> FloatArray:
    """What a step of position (row 0) and velocity (row 1) at an epoch grows to, shape (n, 16): zero before it."""
    nothing = np.zeros((len(motion.time_s), 2))
    between = CraftMotion.between(differences_of(motion, nothing, nothing), motion.time_s, is_strapdown=False)
    out = np.zeros((len(motion.time_s), coupled.SIZE))
    out[at, CHANNELS[:, [POSITION, VELOCITY]]] = step.T
    for k, A in enumerate(coupled.coupled_matrix(between, BETA)[at:], start=at):
        out[k + 1] = out[k] + A @ (out[k] + 0.5 * A @ out[k])
    return out


def assert_follows(run: CoupledRun, whole: CoupledRun, added: FloatArray, since: int) -> None:
    """The estimate is that of the undisturbed run plus what was added."""
    apart = run.x[since:] - whole.x[since:] - added[since:]
    assert (np.abs(apart) < FOLLOWED_SIGMAS * run.sigma[since:]).all()


def assert_forecasts_as_well(run: CoupledRun, whole: CoupledRun, at: Int64Array) -> None:
    """Outages replayed from ``at`` come out as in the undisturbed flight."""
    lead_s: FloatArray = np.array([600.0, 1200.0])
    rms = []
    for one in (run, whole):
        error = coupled_forecast.hindcast_coupled(one, at, lead_s, SETTINGS) - built_up(one.epochs, at, lead_s)
        rms.append(np.sqrt(np.mean(np.square(error), axis=(0, 2))))
    assert (rms[0] < AS_GOOD_SHARE * rms[1]).all(), rms


SHIFT: FloatArray = np.array([[1600.0, -1200.0], [1.5, -1.0]])  # 2 km and 1.8 m/s


@pytest.mark.parametrize("is_marked", [True, False], ids=["marked", "unmarked"])
@pytest.mark.parametrize("step", [np.diag([1.0, 0.0]) @ SHIFT, SHIFT], ids=["position", "both"])
def test_a_reset_of_the_ins_is_followed(is_marked: bool, step: FloatArray) -> None:
    motion, position, velocity = eastbound()
    whole = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    at = 4000
    added = grown_from(step, motion, at)
    position += added[:, CHANNELS[:, POSITION]]
    velocity += added[:, CHANNELS[:, VELOCITY]]
    disturbed = differences_of(motion, position, velocity)
    run = coupled.run_coupled(with_resets(disturbed, [at] if is_marked else []), PLATFORM, SETTINGS)
    since = at if is_marked else at + round(PATIENCE_S) + 1
    assert run.reopened == (0 if is_marked else 1)
    assert (run.used[since:] == 1).mean() > USED_SHARE and (run.used[:at] == 1).mean() > USED_SHARE
    assert_follows(run, whole, added, since)
    assert_forecasts_as_well(run, whole, np.arange(since + 300, 7800, 300))


def test_a_log_that_starts_in_flight_with_the_ins_far_off_is_followed() -> None:
    motion, position, velocity = eastbound()
    whole = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    added = grown_from(np.array([[4000.0, -3000.0], [6.0, -5.0]]), motion, 0)
    position += added[:, CHANNELS[:, POSITION]]
    velocity += added[:, CHANNELS[:, VELOCITY]]
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    assert run.reopened == 0 and (run.used == 1).mean() > USED_SHARE
    assert_follows(run, whole, added, 60)
    assert_forecasts_as_well(run, whole, np.arange(3600, 7800, 300))


def test_patience_is_counted_in_seconds_for_each_kind_and_channels_may_be_missing() -> None:
    """Positions every ten seconds, none of the east channel, velocities every second; a jump north of 2 km."""
    motion, position, velocity = eastbound()
    position[np.arange(len(position)) % 10 != 0] = np.nan
    position[:, 1] = np.nan
    position[4000:, 0] += 2000.0
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    assert run.reopened == 1
    rejected = np.flatnonzero((run.used == -1).any(axis=(1, 2)))
    assert 4000 + PATIENCE_S - 10.0 <= rejected[rejected >= 4000][-1] <= 4000 + PATIENCE_S
    assert np.abs(run.innovation[4100::10, 0, 0]).max() < 50.0


def test_what_velocity_alone_shows_of_the_drift_is_not_hidden_by_an_unknown_position() -> None:
    motion, position, velocity = eastbound()
    run = coupled.run_coupled(differences_of(motion, np.full_like(position, np.nan), velocity), PLATFORM, SETTINGS)
    both = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    drifts = CHANNELS[:, DRIFT]
    assert (run.sigma[-1, drifts] < 1.5 * both.sigma[-1, drifts]).all()


def test_weight_of_gnss_depends_on_its_own_interval_not_on_that_of_the_epochs() -> None:
    """Positions every 10 s, velocities every 5 s: epochs of the INS alone between them change nothing."""
    motion, position, velocity = eastbound()
    row = np.arange(len(position))
    position[row % 10 != 0], velocity[row % 5 != 0] = np.nan, np.nan
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    keep = row[::5]
    few = TrueMotion(*(getattr(motion, item.name)[..., keep] for item in fields(motion)))
    alone = coupled.run_coupled(differences_of(few, position[keep], velocity[keep]), PLATFORM, SETTINGS)
    assert run.sigma[keep] == pytest.approx(alone.sigma, rel=0.02)
    assert (np.abs(run.x[keep] - alone.x) < 0.1 * alone.sigma).all()


def test_gate_is_as_wide_as_a_single_measurement_errs() -> None:
    """200 m: 2.7 sigmas of a position as it is weighted for slow errors (73 m), far beyond what one errs (4 m)."""
    motion, position, velocity = eastbound()
    position[3000] += [200.0, 0.0]
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    assert (run.used[3000] == [[-1, -1], [1, 1]]).all()
    assert run.reopened == 0


def test_position_at_the_start_of_a_forecast_is_the_estimate_where_gnss_shows_none() -> None:
    """No GNSS there, or a position that was rejected: as if GNSS had shown the estimate."""
    motion = straight(4000.0, 60.0, 200.0, 100.0)
    at, lead_s = np.array([1000]), np.array([600.0, 1200.0])
    x = np.zeros((4001, coupled.SIZE))
    x[1000, CHANNELS[:, POSITION]] = 20_000.0, -30_000.0
    built = []
    for measured, mark in (((20_000.0, -30_000.0), 1), ((np.nan, np.nan), 0), ((1e7, -30_000.0), -1), ((0.0, 0.0), 1)):
        position = np.tile(measured, (4001, 1))
        differences, empty = differences_of(motion, position, np.zeros_like(position)), np.zeros((4001, 2, 2))
        used = np.full((4001, 2, 2), mark, dtype=np.int8)
        run = coupled.CoupledRun(differences, PLATFORM, x, np.zeros_like(x), empty, empty, used, NO_COVARIANCE)
        built.append(coupled_forecast.hindcast_coupled(run, at, lead_s, SETTINGS))
    assert np.array_equal(built[0], built[1]) and np.array_equal(built[0], built[2])
    assert np.abs(built[0] - built[3]).max() > 100.0  # m: what it matters


def test_forecast_from_inside_a_gap_goes_on_as_the_filter_does() -> None:
    motion, position, velocity = eastbound(60.0)
    position += np.array([4000.0, -3000.0])
    position[5000:7001], velocity[5000:7001] = np.nan, np.nan
    run = coupled.run_coupled(differences_of(motion, position, velocity), PLATFORM, SETTINGS)
    at = np.array([5300])
    forecast = coupled_forecast.hindcast_coupled(run, at, np.array([600.0, 1200.0]), SETTINGS)[0]
    states = CHANNELS[:, POSITION]
    assert forecast == pytest.approx(run.x[[5900, 6500]][:, states] - run.x[5300, states], abs=1.0)


def test_starts_carried_together_are_those_carried_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two starts on one raster of steps share their steps, one between does not, and few steps are held at once."""
    motion, sensors = strapdown(5000.0, 2500.0)
    truth = propagate(motion, sensors)
    differences = differences_of(motion, truth.position_m[0], truth.velocity_mps[0])
    run = coupled.run_coupled(differences, InsNoise(accelerometer_ug=50.0), SETTINGS)
    at, lead_s = np.array([1000, 1300, 1937, 2200]), 60.0 * np.arange(1.0, 31.0)
    (shared,) = coupled_forecast.steps_ahead(differences, run.noise, at[:2].astype(float), lead_s, 10.0)
    assert len(shared.values) == 180 + 30 and shared.step.shape == (2, 180)

    def found(one: Int64Array) -> FloatArray:
        forecast = coupled_forecast.hindcast_coupled(run, one, lead_s, SETTINGS)
        return np.stack([forecast, coupled_forecast.coupled_variance(run, one, lead_s)])

    together = found(at)
    monkeypatch.setattr(coupled_forecast, "STEPS_AT_ONCE", 1)
    assert np.array_equal(found(at), np.concatenate([found(at[place : place + 1]) for place in range(4)], axis=1))
    assert together == pytest.approx(found(at), rel=ROUNDING)
    assert found(at[:0]).shape == (2, 0, 30, 2)


def test_without_gnss_at_all_nothing_is_claimed() -> None:
    motion = straight(600.0, 50.0, 30.0, 240.0)
    nothing = np.full((601, 2), np.nan)
    run = coupled.run_coupled(differences_of(motion, nothing, nothing), PLATFORM, SETTINGS)
    assert (run.x == 0.0).all() and np.isnan(run.innovation).all()


def test_random_drift_decays() -> None:
    A = coupled.coupled_matrix(craft(45.0, (0.0, 0.0), (0.0, 0.0)), BETA)[0]
    for channel in CHANNELS:
        assert A[channel[RANDOM_DRIFT], channel[RANDOM_DRIFT]] == -BETA
    assert A[AZIMUTH, AZIMUTH_DRIFT] == 1.0


# The gain


def test_gain_is_given_against_the_separate_channels_at_the_same_starts() -> None:
    """Eastbound at 60 deg, Earth rate and craft rate are what the channels lack: the coupled model must gain much."""
    motion = straight(14_000.0, 60.0, 0.0, 240.0)
    truth = propagate(motion, drifting(motion, 0.01, -0.01, 3e-4), body_fixed=False)
    rng = np.random.default_rng(6)
    position = truth.position_m[0] + 3.0 * rng.standard_normal(truth.position_m[0].shape)
    velocity = truth.velocity_mps[0] + 0.05 * rng.standard_normal(truth.velocity_mps[0].shape)
    differences = differences_of(motion, position, velocity)
    noise = PLATFORM
    run = run_filter(differences.epochs, ChannelModel.at(60.0, 10_000.0, noise.beta_per_s), noise)
    at = start_epochs(differences.epochs, 5400.0, 600.0)
    separate = hindcast(run, at, LEADS_S, ["last_estimate"], SETTINGS)
    ours = coupled.run_coupled(differences, noise, SETTINGS)
    forecast = coupled_forecast.hindcast_coupled(ours, separate.at, separate.lead_s, SETTINGS)
    rows = coupled_forecast.coupled_rows(forecast, separate)
    assert [row.horizon_min for row in rows] == [10.0, 30.0, 60.0, 90.0, 120.0]  # 1 and 5 are no leads of it
    lead = 11
    apart = np.sqrt(np.nanmean(np.square(separate.radial_m("last_estimate")[:, lead])))
    assert rows[-1].gain == pytest.approx(1.0 - rows[-1].rms_m / apart)
    assert rows[-1].gain > 0.3


def test_a_simulated_family_runs_through() -> None:
    differences = of_batch(simulate_family(FamilySettings(route="manoeuvring", duration_s=2000.0), 1, 7))
    run = coupled.run_coupled(differences, PLATFORM, SETTINGS)
    assert (run.used == 1).mean() > 0.99
    assert coupled_forecast.hindcast_coupled(run, np.array([1000]), np.zeros(0), SETTINGS).shape == (1, 0, 2)
