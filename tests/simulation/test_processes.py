"""The random processes have the autocovariance they promise, at any step."""

import numpy as np
import pytest

from groundstation.simulation.processes import damped_oscillation, gauss_markov

RUNS, SAMPLES = 1500, 1200
RELATIVE_TOLERANCE = 0.06  # five times the sampling error of the least certain lag, in units of the variance


def measured(paths: np.ndarray, lag: int) -> float:
    return float(np.mean(paths[:, : paths.shape[1] - lag] * paths[:, lag:]))


@pytest.mark.parametrize(("frequency_hz", "damping", "step_s"), [(0.4, 0.02, 0.1), (0.2, 0.5, 0.02), (0.6, 0.1, 0.1)])
def test_oscillation_has_its_autocovariance(frequency_hz: float, damping: float, step_s: float) -> None:
    sigma = 0.5
    paths = damped_oscillation(np.random.default_rng(1), (RUNS, SAMPLES), step_s, sigma, frequency_hz, damping)
    natural = 2 * np.pi * frequency_hz
    damped = natural * np.sqrt(1 - damping**2)
    for lag in (0, 1, 5, 17):
        time = lag * step_s
        shape = np.cos(damped * time) + damping * natural / damped * np.sin(damped * time)
        expected = sigma**2 * np.exp(-damping * natural * time) * shape
        assert measured(paths, lag) == pytest.approx(expected, abs=RELATIVE_TOLERANCE * sigma**2)


def test_gauss_markov_has_its_autocovariance() -> None:
    paths = gauss_markov(np.random.default_rng(2), (RUNS, SAMPLES), 0.1, 2.0, 3.0)
    for lag in (0, 10, 30, 60):
        expected = 4.0 * np.exp(-lag * 0.1 / 3.0)
        assert measured(paths, lag) == pytest.approx(expected, abs=RELATIVE_TOLERANCE * 4.0)


def test_gauss_markov_without_correlation_is_white() -> None:
    paths = gauss_markov(np.random.default_rng(3), (RUNS, SAMPLES), 0.1, 1.0, 0.0)
    assert measured(paths, 0) == pytest.approx(1.0, abs=RELATIVE_TOLERANCE)
    assert measured(paths, 1) == pytest.approx(0.0, abs=RELATIVE_TOLERANCE)
