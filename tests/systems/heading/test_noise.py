"""The noise model's filter against dense matrices, and the interval made from it."""

from dataclasses import replace
from functools import partial
from threading import current_thread

import numpy as np
import pytest

from groundstation.methods.intervals import mixture_quantile
from groundstation.methods.taxi_error import interval, noise
from groundstation.methods.taxi_error.interval import (
    NO_STANDSTILL,
    HeadingDifferences,
    Regressor,
    StandstillVelocities,
    _Target,
    error_posterior,
    fixed_noise_estimate,
    sample_weights,
)
from groundstation.methods.taxi_error.priors import PRIOR_MEAN, PRIOR_SIGMA
from groundstation.simulation.processes import damped_oscillation, gauss_markov

DENSE_TOLERANCE = 1e-8  # relative: rounding of two ways to the same number


def random_differences(rng: np.random.Generator, count: int = 60) -> HeadingDifferences:
    speed = rng.uniform(6.0, 9.0, count)
    return HeadingDifferences(
        time_s=np.cumsum(rng.uniform(0.05, 0.5, count)),
        difference_deg=rng.normal(2.0, 1.0, count),
        direction_deg=rng.uniform(0.0, 360.0, count),
        speed_mps=speed,
        regressors=(Regressor(rng.normal(size=count), 3.0, 2.0),),
        segment=np.sort(rng.integers(1, 4, count)),
    )


def dense_covariance(data: HeadingDifferences, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the differences, and what each GNSS component does to them, straight from autocovariances."""
    white, correlated, tau, sway, frequency, damping, heading_white, motion, own, wander, wander_s = np.exp(theta)
    natural = 2 * np.pi * frequency
    damped = natural * np.sqrt(1 - damping**2)
    lag = np.abs(data.time_s[:, None] - data.time_s[None, :])
    angle = np.deg2rad(data.direction_deg)
    effect = np.rad2deg(np.column_stack([np.sin(angle), -np.cos(angle)]) / data.speed_mps[:, None])
    shape = np.cos(damped * lag) + damping * natural / damped * np.sin(damped * lag)
    covariance = effect @ effect.T * (motion * correlated) ** 2 * np.exp(-lag / tau)
    covariance += sway**2 * np.exp(-damping * natural * lag) * shape
    covariance += own**2 * (data.segment[:, None] == data.segment[None, :])
    covariance += wander**2 * np.exp(-lag / wander_s)
    covariance += np.diag(white**2 * np.sum(effect**2, axis=1) + heading_white**2)
    return covariance, effect


def draw_theta(rng: np.random.Generator) -> np.ndarray:
    theta = PRIOR_MEAN + 0.3 * rng.standard_normal(len(PRIOR_MEAN))
    theta[[noise.SEGMENT, noise.WANDER]] += np.log(10.0)  # large enough to be seen beside the rest
    theta[noise.DAMPING] = min(theta[noise.DAMPING], np.log(0.9))
    return theta


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_filter_gives_the_dense_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    data, theta = random_differences(rng), draw_theta(rng)
    covariance, _effect = dense_covariance(data, theta)
    columns = np.column_stack([np.ones(len(data.time_s)), data.regressors[0].values])
    inverse = np.linalg.inv(covariance)
    information = columns.T @ inverse @ columns + np.diag([0.0, 1 / 2.0**2])
    right = columns.T @ inverse @ data.difference_deg + np.array([0.0, 3.0 / 2.0**2])
    mean, sigma = fixed_noise_estimate(data, theta[None, :])
    assert mean == pytest.approx(np.linalg.solve(information, right), rel=DENSE_TOLERANCE)
    assert sigma == pytest.approx(np.sqrt(np.diag(np.linalg.inv(information))), rel=DENSE_TOLERANCE)


def test_each_draw_is_judged_as_if_it_were_alone() -> None:
    rng = np.random.default_rng(9)
    data = random_differences(rng)
    still = StandstillVelocities(np.arange(40) * 0.2 - 20.0, *rng.normal(0.0, 0.05, (2, 40)), gap_s=1.0)
    target = _Target(still, data)
    thetas = np.array([draw_theta(rng) for _ in range(noise.LANES + 7)])
    together = target.evaluate(thetas, target.last)
    for draw, theta in enumerate(thetas):
        alone = target.evaluate(theta[None, :], target.last)
        assert all(np.array_equal(a[draw], b[0]) for a, b in zip(together, alone, strict=True))


@pytest.mark.parametrize("count", [40, 41, 115, 200])
def test_draws_on_two_cores_are_judged_as_on_one(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(count)
    data = random_differences(rng)
    thetas = np.array([draw_theta(rng) for _ in range(count)])
    found, threads, evaluate = [], set[str](), noise.evaluate
    monkeypatch.setattr(noise, "evaluate", lambda *a: threads.add(current_thread().name) or evaluate(*a))
    for has_two in (False, True):
        monkeypatch.setattr(interval, "cores", partial(int, 1 + has_two))
        found.append(_Target(NO_STANDSTILL, data).evaluate(thetas, np.array([20, 60])))
    assert ("half" in threads) == (count > noise.LANES)
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)


def test_weights_are_the_row_sums_of_the_inverse_covariance() -> None:
    rng = np.random.default_rng(4)
    data, theta = random_differences(rng), draw_theta(rng)
    covariance, _effect = dense_covariance(data, theta)
    expected = np.linalg.solve(covariance, np.ones(len(data.time_s)))
    assert sample_weights(data, theta) == pytest.approx(expected / expected.sum(), abs=DENSE_TOLERANCE)


def test_likelihood_of_standstill_and_taxi_together_is_the_dense_one() -> None:
    rng = np.random.default_rng(5)
    data, theta = random_differences(rng, 30), draw_theta(rng)
    still = np.arange(-25.0, -5.0)
    north, east = rng.normal(size=(2, len(still)))
    covariance, effect = dense_covariance(data, theta)
    white, correlated, tau, motion = np.exp(theta[[noise.WHITE, noise.CORRELATED, noise.TAU, noise.MOTION]])
    decay = np.exp(-np.abs(still[:, None] - still[None, :]) / tau)
    own = correlated**2 * decay + white**2 * np.eye(len(still))
    across = motion * correlated**2 * np.exp(-(data.time_s[:, None] - still[None, :]) / tau)
    size = len(still)
    joint = np.zeros((2 * size + len(data.time_s),) * 2)
    joint[:size, :size] = joint[size : 2 * size, size : 2 * size] = own
    joint[2 * size :, 2 * size :] = covariance
    joint[2 * size :, :size] = effect[:, :1] * across
    joint[2 * size :, size : 2 * size] = effect[:, 1:] * across
    joint[: 2 * size, 2 * size :] = joint[2 * size :, : 2 * size].T
    columns = np.zeros((len(joint), 1))
    columns[2 * size :] = 1.0
    values = np.concatenate([north, east, data.difference_deg])
    inverse = np.linalg.inv(joint)
    information = float((columns.T @ inverse @ columns)[0, 0])
    mean = float((columns.T @ inverse @ values)[0]) / information
    squares = float(values @ inverse @ values) - information * mean**2
    expected = -0.5 * (np.linalg.slogdet(joint)[1] + np.log(information) + squares)
    expected -= size * np.log(2 * np.pi)

    log_likelihood, estimate, variance = np.empty(1), np.empty((1, 1)), np.empty((1, 1, 1))
    columns = np.column_stack([data.difference_deg, np.ones(len(data.time_s))])
    taxi = (data.time_s, columns, *effect.T.copy(), np.diff(data.segment, prepend=data.segment[0]) != 0)
    prior = (np.zeros(1), np.zeros(1))
    ends = np.array([len(data.time_s)], dtype=np.int64)
    gap_s = float(data.time_s[0] - still[-1])
    alone = np.empty((1, 2))
    found, still_velocities = (log_likelihood, estimate, variance, prior, alone), (still, north, east, 0, gap_s)
    noise.evaluate(theta[None, :], still_velocities, taxi, prior, ends, *found, noise.room_for(2))
    assert log_likelihood[0] == pytest.approx(expected, rel=DENSE_TOLERANCE)
    assert estimate[0, 0] == pytest.approx(mean, rel=DENSE_TOLERANCE)
    assert variance[0, 0, 0] == pytest.approx(1 / information, rel=DENSE_TOLERANCE)
    assert alone[0] == pytest.approx([mean, 1 / information], rel=DENSE_TOLERANCE), "no term to be told apart"


def test_terms_told_apart_are_left_out_of_what_is_found_alone() -> None:
    rng = np.random.default_rng(5)
    data, theta = random_differences(rng), draw_theta(rng)
    term = Regressor(np.cos(np.deg2rad(data.direction_deg)), 0.0, 0.3, is_apart=True)
    joint = _Target(NO_STANDSTILL, replace(data, regressors=(*data.regressors, term)), 1)
    plain = _Target(NO_STANDSTILL, data)
    found, expected = (target.evaluate(theta[None, :], target.last) for target in (joint, plain))
    assert found.alone[0] == pytest.approx(expected.alone[0], rel=DENSE_TOLERANCE)
    assert found.alone[0] == pytest.approx([expected.estimate[0, 0], expected.variance[0, 0, 0]], rel=DENSE_TOLERANCE)
    assert found.variance[0, 0, 0] > found.alone[0, 1]


def test_a_crosswind_there_and_back_is_no_disagreement_of_the_ins() -> None:
    """Sideslip of 0.3 deg out and -0.3 back: without the term the segments seem to have errors of their own."""
    taxi, still = simulated(np.random.default_rng(8), 80.0, 0.01)
    is_back = taxi.time_s > np.median(taxi.time_s)
    crab = np.where(is_back, -1.0, 1.0)
    both = replace(
        taxi,
        difference_deg=taxi.difference_deg + 0.3 * crab,
        direction_deg=(taxi.direction_deg + 180.0 * is_back) % 360.0,
        segment=1 + is_back.astype(np.int64),
    )
    told = replace(both, regressors=(Regressor(crab, 0.0, 0.2, is_apart=True),))
    untold, found = error_posterior(both, still), error_posterior(told, still)
    assert found.measured_sigma_deg @ found.weight < 0.6 * (untold.measured_sigma_deg @ untold.weight)
    assert found.error_deg == pytest.approx(untold.error_deg, abs=0.1)
    assert abs(found.error_deg - error_posterior(taxi, still).error_deg) < 2.0 * found.standard_error_deg


def simulated(
    rng: np.random.Generator, seconds: float, correlated_mps: float
) -> tuple[HeadingDifferences, StandstillVelocities]:
    count, speed = round(seconds * 10), 8.0
    velocity = gauss_markov(rng, (2, 2000 + count), 0.1, correlated_mps, 3.0) + 0.05 * rng.standard_normal(
        (2, 2000 + count)
    )
    sway = damped_oscillation(rng, (count,), 0.1, 0.5, 0.4, 0.1)
    time_s = 0.1 * np.arange(2000 + count)
    difference = sway - np.rad2deg(velocity[1, 2000:] / speed)
    taxi = HeadingDifferences(time_s[2000:], difference, np.zeros(count), np.full(count, speed))
    return taxi, StandstillVelocities(time_s[:1900], velocity[0, :1900], velocity[1, :1900], 0, 10.0)


def test_interval_narrows_with_time_and_widens_with_correlated_noise() -> None:
    def half_width(seconds: float, correlated_mps: float) -> float:
        taxi, still = simulated(np.random.default_rng(6), seconds, correlated_mps)
        low, high = error_posterior(taxi, still).interval_deg()
        return 0.5 * (high - low)

    short, long, noisy = half_width(20.0, 0.02), half_width(120.0, 0.02), half_width(120.0, 0.08)
    assert long < 0.7 * short
    assert noisy > 1.8 * long


def test_posterior_finds_the_noise_of_a_long_run() -> None:
    taxi, still = simulated(np.random.default_rng(7), 120.0, 0.04)
    posterior = error_posterior(taxi, still)
    assert posterior.parameter("white_mps") == pytest.approx(0.05, rel=0.1)
    assert posterior.parameter("correlated_mps") == pytest.approx(0.04, rel=0.4)
    assert posterior.parameter("sway_hz") == pytest.approx(0.4, rel=0.1)
    assert posterior.has_converged
    assert posterior.effective_draws > 50


def test_same_data_give_the_same_interval() -> None:
    taxi, still = simulated(np.random.default_rng(8), 30.0, 0.03)
    assert error_posterior(taxi, still).interval_deg() == error_posterior(taxi, still).interval_deg()


@pytest.mark.parametrize("count", [2, 3, 10])
@pytest.mark.parametrize("value", ["constant", "noisy"])
def test_few_samples_and_no_standstill_give_a_wide_finite_interval(count: int, value: str) -> None:
    rng = np.random.default_rng(9)
    difference = np.full(count, 1.5) if value == "constant" else 1.5 + 0.5 * rng.standard_normal(count)
    taxi = HeadingDifferences(0.1 * np.arange(count), difference, np.zeros(count), np.full(count, 8.0))
    low, high = error_posterior(taxi).interval_deg()
    assert low < 1.5 < high
    assert 0.1 < high - low < 20.0


def test_mixture_quantile_of_unequal_normals() -> None:
    from scipy.stats import norm

    mean, sigma, weight = np.array([0.0, 1.0]), np.array([1.0, 3.0]), np.array([0.4, 0.6])
    quantile = mixture_quantile(0.9, mean, sigma, weight)
    assert float(weight @ norm.cdf((quantile - mean) / sigma)) == pytest.approx(0.9, abs=1e-9)


@pytest.mark.parametrize("kind", ["alike", "far apart", "of all sizes"])
def test_quantiles_of_many_normals_are_found_in_few_steps(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interval asks for quantiles of thousands of draws: bisection took 60 passes over them."""
    import scipy.special

    passes, ndtr = [], scipy.special.ndtr
    monkeypatch.setattr(scipy.special, "ndtr", lambda values: (passes.append(1), ndtr(values))[1])
    rng = np.random.default_rng(7)
    mean, sigma, weight = rng.normal(0.3, 0.02, 3000), np.exp(rng.normal(-3.0, 0.3, 3000)), rng.dirichlet(np.ones(3000))
    if kind == "far apart":
        mean = np.where(rng.random(3000) < 0.5, -40.0, 40.0)
    if kind == "of all sizes":
        sigma = np.exp(rng.normal(-3.0, 4.0, 3000))
    for probability in (1e-6, 0.025, 0.5, 0.975):
        passes.clear()
        quantile = mixture_quantile(probability, mean, sigma, weight)
        assert float(weight @ ndtr((quantile - mean) / sigma)) == pytest.approx(probability, abs=1e-12)
        assert len(passes) <= (12 if kind == "alike" else 62)


def test_priors_are_broader_than_the_family() -> None:
    """Two sigma of every prior reach beyond what docs/evidence/heading.md draws."""
    family = {
        "white_mps": (0.03, 0.07),
        "correlated_mps": (0.02, 0.05),
        "correlation_s": (1.0, 10.0),
        "sway_deg": (0.25, 0.75),
        "sway_hz": (0.2, 0.6),
        "sway_damping": (0.02, 0.5),
    }
    for name, (low, high) in family.items():
        index = noise.PARAMETER_NAMES.index(name)
        assert PRIOR_MEAN[index] - 2.0 * PRIOR_SIGMA[index] < np.log(low)
        assert PRIOR_MEAN[index] + 2.0 * PRIOR_SIGMA[index] > np.log(high)


def test_segments_that_disagree_widen_the_interval_and_are_seen_as_such() -> None:
    taxi, still = simulated(np.random.default_rng(10), 80.0, 0.01)
    segment = 1 + np.arange(800) // 200
    apart = replace(
        taxi, segment=segment, difference_deg=taxi.difference_deg + np.array([0.0, 0.5, 0.1, -0.4])[segment - 1]
    )
    alike, found = (error_posterior(data, still) for data in (replace(taxi, segment=segment), apart))
    (low, high), (least, most) = alike.interval_deg(), found.interval_deg()
    assert most - least > 1.5 * (high - low)
    spread = found.parameter("segment_deg"), found.parameter("wander_deg")
    assert max(spread) > 0.1 > max(alike.parameter("segment_deg"), alike.parameter("wander_deg"))


def test_what_is_told_apart_widens_the_whole_interval_alone() -> None:
    """One direction: a steady term of 0.3 deg is all in the whole interval, none of it in the measured one."""
    taxi, still = simulated(np.random.default_rng(11), 60.0, 0.01)
    steady = replace(taxi, regressors=(Regressor(np.ones(len(taxi.time_s)), 0.0, 0.3, is_apart=True),))
    plain, found = error_posterior(taxi, still), error_posterior(steady, still)
    assert found.apart_sigma_deg == pytest.approx(0.3, abs=0.003)
    assert found.standard_error_deg == pytest.approx(np.hypot(0.3, plain.standard_error_deg), rel=0.05)
    assert found.interval_deg(is_measured=True) == pytest.approx(plain.interval_deg(), abs=0.02)


def test_the_interval_does_not_hang_on_the_seed() -> None:
    taxi, still = simulated(np.random.default_rng(12), 25.0, 0.02)
    data = replace(taxi, segment=np.ones(len(taxi.time_s), dtype=np.int64))

    def half_width(seed: int, **more: int) -> float:
        low, high = error_posterior(data, still, seed=seed, **more).interval_deg()
        return 0.5 * (high - low)

    widths = [half_width(seed) for seed in range(3)]
    assert widths == pytest.approx([half_width(77, draws=16_000)] * 3, rel=0.05)
