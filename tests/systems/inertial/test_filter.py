"""The channel model, its filter and smoothers: against independent means, invariances, outliers, consistency."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import chi2

from groundstation.base.angles import FloatArray
from groundstation.base.units import MPS2_PER_G
from groundstation.methods.ins_noise import GnssNoise, InsNoise
from groundstation.methods.kalman import smoother
from groundstation.simulation.channel_truth import RADIUS_M
from groundstation.systems.inertial.channel_group import RESET_POSITION_M, RESET_VELOCITY_MPS
from groundstation.systems.inertial.filter import (
    ChannelsRun,
    DifferenceEpochs,
    measurement_variances,
    run_filter,
    smooth,
)
from groundstation.systems.inertial.leads import start_epochs
from groundstation.systems.inertial.model import (
    POSITION,
    SIZE,
    TILT,
    VELOCITY,
    ChannelModel,
)
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.start_covariance import (
    LAG_STEP_S,
    WINDOW_METHODS,
    WITH_COVARIANCE,
    start_covariance,
)
from groundstation.systems.inertial.starts import start_states, windows_of
from groundstation.systems.inertial.study.consistency import consistency_table, matched_run

MODEL = ChannelModel(MPS2_PER_G, RADIUS_M, 1.0 / 3600.0)
TYPICAL = np.array([100.0, 0.1, 1e-5, 5e-8, 1e-12, 5e-8])  # sizes of the six states, SI units
NOISE = InsNoise(
    position_m=20.0,
    velocity_mps=0.5,
    tilt_rad=1e-4,
    drift_dph=0.01,
    drift_rate_dphph=0.003,
    random_drift_dph=0.005,
    velocity_walk_mps_per_sqrt_s=1e-3,
    tilt_walk_deg_per_sqrt_h=0.002,
    drift_walk_dph_per_sqrt_h=0.002,
    drift_rate_walk_dphph_per_sqrt_h=1e-4,
    gnss=GnssNoise(10.0, 0.0, 0.0, 0.05, 0.0, 0.0, is_inflated=False),
)
NO_GATE = 1e12
ROUNDING = 1e-9  # of typical sizes: double precision over some hundred products of six by six
RTS_ROUNDING = 1e-6  # in sigmas: the textbook's smoother inverts covariances of condition 1e8
SIMPSON = 1e-4  # of one step of 10 s: position gathers higher powers of time than Simpson's rule integrates
WINDOW_GRID = 0.02  # share of a window's variance that its sums in steps of 50 s leave
SEED = 41
NEES_SEED, START_SEED = 1, 2
TAIL = 0.005


def scaled(matrix: FloatArray) -> FloatArray:
    """A transition between states of typical size."""
    return np.asarray(matrix * TYPICAL[None, :] / TYPICAL[:, None])


def unscaled(matrix: FloatArray) -> FloatArray:
    """A transition between states in SI units."""
    return np.asarray(matrix * TYPICAL[:, None] / TYPICAL[None, :])


def irregular_epochs(seed: int = SEED, n: int = 400) -> DifferenceEpochs:
    """Epochs with jittered intervals, a gap, missing positions and velocities, a drag and an INS reset."""
    rng = np.random.default_rng(seed)
    interval = np.round(rng.choice([0.5, 1.0, 1.0, 2.5, 13.0], n) + rng.uniform(-0.05, 0.05, n), 3)
    interval[200] = 700.0
    time_s = np.cumsum(interval)
    rate = MODEL.schuler_rate_radps
    position = rng.normal(0.0, 10.0, (n, 2)) + 40.0 * np.sin(rate * time_s)[:, None]
    velocity = rng.normal(0.0, 0.05, (n, 2)) + 40.0 * rate * np.cos(rate * time_s)[:, None]
    position[50:90], velocity[70:120] = np.nan, np.nan
    position[rng.random(n) < 0.2] = np.nan
    drag = 1e-5 * rng.normal(size=(n, 2, 2))
    reset = np.zeros(n, dtype=bool)
    reset[300] = True
    return DifferenceEpochs(time_s, position, velocity, drag, reset)


@dataclass(frozen=True)
class Textbook:
    """States (n, 12) and covariances (n, 12, 12) of both channels in one filter, and those before each update."""

    x: FloatArray
    P: FloatArray
    predicted_x: FloatArray
    predicted_covariance: FloatArray
    F: FloatArray


@lru_cache(maxsize=1)
def textbook_run() -> tuple[ChannelsRun, Textbook]:
    """The same epochs filtered by ours and by the textbook's."""
    epochs = irregular_epochs()
    return run_filter(epochs, MODEL, NOISE, gate=NO_GATE), textbook(epochs, MODEL, NOISE)


def textbook(epochs: DifferenceEpochs, model: ChannelModel, noise: InsNoise) -> Textbook:
    """Kalman's filter with full matrices, both channels in twelve states, all measurements of an epoch at once.

    Source: Grewal and Andrews, Kalman Filtering, 4th ed. 2015, table 4.3; P in Joseph's form.
    """
    n, size = len(epochs), 2 * SIZE
    x, P = np.zeros(size), np.kron(np.eye(2), np.diag(noise.initial_variances()))
    out = Textbook(*(np.zeros((n, size, *rest)) for rest in ((), (size,), (), (size,), (size,))))
    R_each = measurement_variances(epochs, noise)[0]
    reset = np.kron(np.eye(2), np.diag(np.square([RESET_POSITION_M, RESET_VELOCITY_MPS, 0.0, 0.0, 0.0, 0.0])))
    for k in range(n):
        seconds = 0.0 if k == 0 else epochs.time_s[k] - epochs.time_s[k - 1]
        F = np.kron(np.eye(2), unscaled(expm(scaled(model.matrix()) * seconds)))
        if k:
            drag = np.zeros((size, size))
            drag[np.ix_([0, SIZE], [0, SIZE])] = epochs.drag_per_s[k] * seconds
            x = F @ x + drag @ x
            P = F @ P @ F.T + np.kron(np.eye(2), model.process_noise_over(seconds, noise.densities()))
        P = P + reset if epochs.is_reset[k] else P
        out.predicted_x[k], out.predicted_covariance[k], out.F[k] = x, P, F
        rows = [
            (channel * SIZE + state, values[k, channel], R)
            for channel in range(2)
            for state, values, R in zip(
                (POSITION, VELOCITY), (epochs.position_m, epochs.velocity_mps), R_each, strict=True
            )
            if np.isfinite(values[k, channel])
        ]
        if rows:
            H = np.zeros((len(rows), size))
            H[np.arange(len(rows)), [row[0] for row in rows]] = 1.0
            R = np.diag([row[2] for row in rows])
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x = x + K @ (np.array([row[1] for row in rows]) - H @ x)
            left = np.eye(size) - K @ H
            P = left @ P @ left.T + K @ R @ K.T
        out.x[k], out.P[k] = x, P
    return out


def van_loan(model: ChannelModel, noise: InsNoise, seconds: float) -> FloatArray:
    """Process noise over a time. Source: Van Loan, IEEE Trans. Automatic Control 23, 1978."""
    scale = np.diag(1.0 / TYPICAL)
    A = scale @ model.matrix() @ np.diag(TYPICAL)
    density = np.diag(noise.densities() / TYPICAL**2)
    block = expm(np.block([[-A, density], [np.zeros((SIZE, SIZE)), A.T]]) * seconds)
    return np.asarray(np.diag(TYPICAL) @ (block[SIZE:, SIZE:].T @ block[:SIZE, SIZE:]) @ np.diag(TYPICAL))


def both(values: FloatArray) -> FloatArray:
    """The textbook's twelve states as (n, 6, 2)."""
    return np.stack([values[:, :SIZE], values[:, SIZE:]], axis=2)


def sigmas_apart(run: ChannelsRun, x: FloatArray) -> float:
    """Largest difference of states (n, 6, 2) from a run's, in its sigmas."""
    sigma = np.stack([run.sigma(0), run.sigma(1)], axis=2)
    return float(np.max(np.abs(run.x - x) / sigma))


@pytest.mark.parametrize("seconds", [0.1, 1.0, 10.0, 600.0, 5064.0, 16_000.0])
@pytest.mark.parametrize("beta", [0.0, 1e-9, 1.0 / 3600.0, 1.0 / 60.0])
def test_closed_exponential_is_the_matrix_exponential(seconds: float, beta: float) -> None:
    model = replace(MODEL, beta_per_s=beta)
    expected = expm(scaled(model.matrix()) * seconds)
    assert np.max(np.abs(scaled(model.transition_over(seconds)) - expected)) < ROUNDING * np.max(np.abs(expected))


def test_transitions_chain() -> None:
    half = scaled(MODEL.transition_over(1234.5))
    assert half @ half == pytest.approx(scaled(MODEL.transition_over(2469.0)), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("seconds", "steps"), [(1.0, 1), (0.4, 1), (2.5, 3), (100.0, 100)])
def test_first_order_is_the_papers_step_of_at_most_a_second(seconds: float, steps: int) -> None:
    model = replace(MODEL, transition="first_order")
    once = np.eye(SIZE) + model.matrix() * (seconds / steps)
    expected = np.eye(SIZE)
    for _ in range(steps):
        expected = once @ expected
    assert scaled(model.transition_over(seconds)) == pytest.approx(scaled(expected), rel=1e-10, abs=1e-12)


def test_first_order_gains_amplitude_and_the_exponential_does_not() -> None:
    """(1 + Schuler rate^2 T^2)^(n / 2) after n steps: 1 % over 16 000 s."""
    n, block = 16_000, np.ix_([VELOCITY, TILT], [VELOCITY, TILT])
    gains = [
        abs(np.linalg.det(replace(MODEL, transition=kind).transition_over(float(n))[block])) ** 0.5  # type: ignore[arg-type]
        for kind in ("first_order", "exact")
    ]
    assert gains[0] == pytest.approx((1.0 + MODEL.schuler_rate_radps**2) ** (0.5 * n), rel=1e-9)
    assert gains[0] > 1.01
    assert gains[1] == pytest.approx(1.0, abs=1e-12)


def test_schuler_period_is_84_4_minutes() -> None:
    """The model swings back to where it began, and not before; on the ellipsoid within 0.3 min of it."""
    period_s = 60.0 * MODEL.schuler_period_min
    assert MODEL.schuler_period_min == pytest.approx(84.4, abs=0.05)
    start = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    assert MODEL.transition_over(period_s) @ start == pytest.approx(start, abs=1e-6)
    assert (MODEL.transition_over(0.5 * period_s) @ start)[VELOCITY] == pytest.approx(-1.0, abs=1e-9)
    for latitude in (0.0, 45.0, 69.0):
        assert ChannelModel.at(latitude, 0.0, 0.0).schuler_period_min == pytest.approx(84.4, abs=0.3)


@pytest.mark.parametrize("seconds", [0.5, 1.0, 10.0, 95.0, 3600.0])
def test_process_noise_is_van_loans(seconds: float) -> None:
    expected = van_loan(MODEL, NOISE, seconds)
    found = MODEL.process_noise_over(seconds, NOISE.densities())
    size = np.sqrt(np.diag(expected))
    assert np.max(np.abs(found - expected) / np.outer(size, size)) < SIMPSON
    assert np.array_equal(found, found.T)


def test_filter_is_the_textbooks() -> None:
    """Twelve states at once, irregular times, gaps of either measurement, drag over the sphere, an INS reset."""
    run, reference = textbook_run()
    epochs = run.epochs
    assert sigmas_apart(run, both(reference.x)) < ROUNDING
    for channel in range(2):
        block = slice(channel * SIZE, (channel + 1) * SIZE)
        sigma = run.sigma(channel)
        difference = np.abs(run.covariance(channel) - reference.P[:, block, block])
        assert np.max(difference / (sigma[:, :, None] * sigma[:, None, :])) < ROUNDING
    assert np.array_equal(run.used[:, 0] == 1, np.isfinite(epochs.position_m))


def test_innovations_are_measured_minus_predicted() -> None:
    run, reference = textbook_run()
    epochs = run.epochs
    expected = epochs.position_m - both(reference.predicted_x)[:, POSITION]
    assert run.innovation[:, 0] == pytest.approx(expected, rel=1e-6, abs=1e-6, nan_ok=True)
    assert np.array_equal(np.isnan(run.innovation_variance[:, 0]), np.isnan(epochs.position_m))


def test_smoother_is_rauch_tung_striebels() -> None:
    """x_s = x + C (x_s next - x predicted), C = P F' P predicted^-1, backwards."""
    (run, reference), size = textbook_run(), np.tile(TYPICAL, 2)
    xs, Ps = np.array(reference.x), np.array(reference.P)
    for k in range(len(run.epochs) - 2, -1, -1):
        before = reference.predicted_covariance[k + 1] / np.outer(size, size)
        joint = (reference.F[k + 1] @ reference.P[k]) / np.outer(size, size)
        C = size[:, None] * np.linalg.solve(before, joint).T / size[None, :]
        xs[k] += C @ (xs[k + 1] - reference.predicted_x[k + 1])
        Ps[k] += C @ (Ps[k + 1] - reference.predicted_covariance[k + 1]) @ C.T
    smoothed = smooth(run)
    sigma = np.sqrt(both(np.einsum("nii->ni", Ps)))
    assert np.max(np.abs(smoothed.x - both(xs)) / sigma) < RTS_ROUNDING
    assert np.max(np.abs(np.sqrt(smoothed.variance) - sigma) / sigma) < RTS_ROUNDING


def test_last_smoothed_estimate_is_the_filters() -> None:
    run = run_filter(irregular_epochs(), MODEL, NOISE, gate=NO_GATE)
    smoothed = smooth(run)
    assert np.array_equal(smoothed.x[-1], run.x[-1])
    assert np.all(np.sqrt(smoothed.variance[:, :, 0]) <= run.sigma(0) * (1.0 + ROUNDING))


def test_fixed_lag_is_smoothing_up_to_the_start() -> None:
    """States and covariance of epoch ``first`` given the data up to ``last``; (I - K H) Phi chained between."""
    run = run_filter(irregular_epochs(), MODEL, NOISE)
    assert (run.used == -1).sum() == 0
    first, last = np.array([0, 30, 150, 399]), np.array([250, 130, 320, 399])
    past = smoother.smooth_lags(run.parts[0], first, last)
    spread, closed = smoother.lag_covariances(run.parts[0], first, last)
    for channel in range(2):
        for row, (begin, end) in enumerate(zip(first, last, strict=True)):
            whole = smooth(run, int(begin), int(end))
            sigma = np.sqrt(whole.variance[begin, :, channel])
            assert np.max(np.abs(past[row, :, channel] - whole.x[begin, :, channel]) / sigma) < ROUNDING
            assert np.sqrt(np.diag(spread[row])) == pytest.approx(sigma, rel=ROUNDING)
            assert scaled(closed[row]) == pytest.approx(scaled(chained(run, begin, end)), rel=1e-7, abs=ROUNDING)


def chained(run: ChannelsRun, begin: int, end: int) -> FloatArray:
    """Error at ``end`` that an error at ``begin`` leaves, both channels sharing it."""
    out = np.eye(SIZE)
    for k in range(begin + 1, end + 1):
        out = run.steps.transitions[run.steps.index[k]] @ out
        for state in (POSITION, VELOCITY):
            if run.used[k, state, 0] == 1:
                out = out - np.outer(run.gain[0, k, state], out[state])
    return out


def test_nan_in_one_channel_leaves_the_other_alone() -> None:
    epochs = irregular_epochs()
    epochs = replace(epochs, drag_per_s=np.zeros_like(epochs.drag_per_s))
    whole = run_filter(epochs, MODEL, NOISE)
    position, velocity = np.array(epochs.position_m), np.array(epochs.velocity_mps)
    position[100:250, 1], velocity[130:, 1] = np.nan, np.nan
    holed = run_filter(replace(epochs, position_m=position, velocity_mps=velocity), MODEL, NOISE)
    assert holed.P.shape[0] == 2
    assert np.array_equal(holed.x[:, :, 0], whole.x[:, :, 0])
    assert np.array_equal(holed.covariance(0), whole.covariance(0))
    assert np.all(holed.sigma(1)[399] > whole.sigma(1)[399])
    assert np.isfinite(holed.x).all()


def test_nothing_depends_on_the_origin_of_time_or_on_which_channel_is_first() -> None:
    epochs = irregular_epochs()
    run = run_filter(epochs, MODEL, NOISE)
    later = run_filter(replace(epochs, time_s=epochs.time_s + 65_536.0), MODEL, NOISE)
    assert sigmas_apart(run, later.x) < ROUNDING
    swapped = DifferenceEpochs(
        epochs.time_s,
        epochs.position_m[:, ::-1],
        epochs.velocity_mps[:, ::-1],
        epochs.drag_per_s[:, ::-1, ::-1],
        epochs.is_reset,
    )
    assert sigmas_apart(run, run_filter(swapped, MODEL, NOISE).x[:, :, ::-1]) < ROUNDING


def test_turning_the_world_by_137_deg_turns_the_estimates() -> None:
    angle = np.deg2rad(137.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    epochs = irregular_epochs()
    turned = replace(
        epochs,
        position_m=epochs.position_m @ turn.T,
        velocity_mps=epochs.velocity_mps @ turn.T,
        drag_per_s=turn @ epochs.drag_per_s @ turn.T,
    )
    run, other = run_filter(epochs, MODEL, NOISE), run_filter(turned, MODEL, NOISE)
    assert (run.used != -1).all() and (other.used != -1).all()
    assert sigmas_apart(other, run.x @ turn.T) < ROUNDING
    assert sigmas_apart(replace(other, x=smooth(other).x), smooth(run).x @ turn.T) < ROUNDING


@pytest.mark.parametrize("at", [0, 5, 600, 3600])
def test_an_outlier_of_1100_m_moves_the_estimate_by_less_than_one_sigma(at: int) -> None:
    clean = matched_run(SEED, 0, duration_s=4000).run
    position = np.array(clean.epochs.position_m)
    position[at, 1] += 1100.0
    hit = run_filter(replace(clean.epochs, position_m=position), clean.model, clean.noise)
    assert sigmas_apart(clean, hit.x) < 1.0
    assert (clean.used == -1).sum() == 0
    assert [tuple(place) for place in np.argwhere(hit.used == -1)] == [(at, 0, 0), (at, 0, 1)]
    assert abs(hit.innovation[at, 0, 1]) > 1000.0  # kept, so that it can be listed


@pytest.mark.parametrize("runs", [25, pytest.param(100, marks=pytest.mark.slow)])
def test_filter_is_consistent_over_matched_runs(runs: int) -> None:
    """NEES of the six states at seven times, NIS of position and velocity: 99 % chi-square, seeds (1, 0) to (1, 99)."""
    table = consistency_table(NEES_SEED, runs)
    assert table["freedom"][0] == 12 * runs
    assert list(table["measure"][-2:]) == ["NIS position", "NIS velocity"]
    assert table["inside"].all(), dict(zip(table["measure"], table["mean"], strict=True))


def test_a_filter_told_too_little_noise_is_not_consistent() -> None:
    """The same measures see a GNSS sigma that is 10 % too small."""
    matched = matched_run(NEES_SEED, 0)
    noise = replace(matched.run.noise, gnss=replace(matched.run.noise.gnss, position_white_m=9.0))
    run = run_filter(matched.run.epochs, matched.run.model, noise)
    ratio = np.square(run.innovation[:, 0]) / run.innovation_variance[:, 0]
    assert np.mean(ratio) > chi2.ppf(1.0 - TAIL, ratio.size) / ratio.size


@pytest.mark.parametrize("method", WINDOW_METHODS)
def test_covariance_of_a_window_is_the_sum_over_all_pairs_of_lags(method: str) -> None:
    """The younger of two estimates is correlated with the older one as with that carried to it."""
    settings, run = InertialSettings(), matched_run(NEES_SEED, 0, duration_s=4000).run
    at, lengths_s = np.array([70, 1300, 3900]), windows_of(method, settings).lengths_s
    known = run.covariance_without_data - run.covariance(0)
    found = start_covariance(method, run, at, 0, settings)
    for row, epoch in enumerate(at.tolist()):
        lags = np.arange(0.0, min(epoch, max(lengths_s)) + 1e-9, LAG_STEP_S)
        phi = [run.model.transition_over(float(lag)) for lag in lags]
        share = [np.sum(lags[:, None] < np.maximum(lengths_s, 1e-9), axis=0), np.maximum(lengths_s, 1e-9)]
        V = []
        for place, lag in enumerate(lags):
            mean = np.where(lag < share[1], 1.0 / share[0], 0.0)[:, None] * np.eye(SIZE)
            if method == "consistent_windows":
                mean = mean @ phi[place]
            V.append(mean - np.eye(SIZE) * (place == 0))
        expected = np.array(run.covariance(0)[epoch])
        for younger in range(len(lags)):
            for older in range(younger, len(lags)):
                shared = phi[older - younger] @ known[round(epoch - lags[older])]
                part = V[younger] @ shared @ V[older].T
                expected += part if older == younger else part + part.T
        expected[POSITION] = expected[:, POSITION] = 0.0
        sigma = np.sqrt(np.diag(expected))[VELOCITY:]
        off = (found[row] - expected)[VELOCITY:, VELOCITY:] / np.outer(sigma, sigma)
        assert np.max(np.abs(off)) < 1e-12
        assert not found[row][POSITION].any()


@pytest.mark.slow
@pytest.mark.parametrize("method", WITH_COVARIANCE)
def test_start_covariance_is_that_of_the_starts(method: str) -> None:
    """NEES of the start states (but position, which is known) over 100 matched runs, seeds (2, 0) to (2, 99)."""
    settings, runs, states = InertialSettings(), 100, slice(VELOCITY, SIZE)
    total: FloatArray = np.zeros(3)
    for number in range(runs):
        matched = matched_run(START_SEED, number, uses_velocity=False)
        at = start_epochs(matched.run.epochs, 5400.0, 3600.0)
        start = start_states(method, matched.run, at, settings)
        for channel in range(2):
            error = start[:, states, channel] - matched.truth[at, states, channel]
            P = start_covariance(method, matched.run, at, channel, settings)[:, states, states]
            size = np.sqrt(np.einsum("nii->ni", P))
            correlation = P / (size[:, :, None] * size[:, None, :])
            normal = error / size
            total += np.einsum("ni,ni->n", normal, np.linalg.solve(correlation, normal[:, :, None])[:, :, 0])
    freedom = 2 * (SIZE - 1) * runs
    low, high = (chi2.ppf(part, freedom) / freedom for part in (TAIL, 1.0 - TAIL))
    assert np.all(total / freedom > low - WINDOW_GRID) and np.all(total / freedom < high + WINDOW_GRID), total / freedom
