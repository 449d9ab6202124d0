"""Stationary random processes of sensor models, drawn exactly at any step.

There is no integration error.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def gauss_markov(
    rng: np.random.Generator, shape: tuple[int, ...], step_s: float, sigma: float, correlation_time_s: float
) -> FloatArray:
    """Draw a first-order Gauss-Markov process, stationary from the start.

    Its autocovariance is sigma^2 exp(-|t| / tau).

    Parameters
    ----------
    rng : numpy.random.Generator
    shape : tuple of int
        Time runs along the last axis.
    step_s, correlation_time_s : float
        Step and tau, seconds. tau = 0 gives white noise.
    sigma : float
        Standard deviation, in the unit of the answer.

    Source: Gelb, Applied Optimal Estimation, 1974, section 3.8.
    """
    from scipy.signal import lfilter

    white = rng.standard_normal(shape)
    if correlation_time_s <= 0.0:
        return np.asarray(sigma * white)
    keep = float(np.exp(-step_s / correlation_time_s))
    drive = white * np.sqrt(1.0 - keep * keep)
    drive[..., 0] = white[..., 0]
    return np.asarray(sigma * lfilter([1.0], [1.0, -keep], drive, axis=-1))


def damped_oscillation(
    rng: np.random.Generator, shape: tuple[int, ...], step_s: float, sigma: float, frequency_hz: float, damping: float
) -> FloatArray:
    """Draw a noise-driven damped oscillator: narrow-band sway.

    It has a given natural frequency and damping ratio. The state (displacement, rate) obeys x'' + 2 z w x' + w^2 x =
    white noise; it is started from its stationary distribution and stepped with the exact exponential, so the sample
    statistics hold at any step.

    Parameters
    ----------
    shape : tuple of int
        Time runs along the last axis.
    sigma : float
        Standard deviation of the displacement.
    frequency_hz, damping : float
        Undamped natural frequency w / 2 pi and damping ratio z in (0, 1).

    Source: Gelb, Applied Optimal Estimation, 1974, section 3.8 (second-order Gauss-Markov processes).
    """
    from scipy.signal import lfilter

    natural = 2.0 * np.pi * frequency_hz
    damped, decay = natural * np.sqrt(1.0 - damping**2), damping * natural

    def autocovariance(lag_s: float) -> float:
        return float(
            sigma**2 * np.exp(-decay * lag_s) * (np.cos(damped * lag_s) + decay / damped * np.sin(damped * lag_s))
        )

    # Sampled, the displacement is ARMA(2, 1): poles from the exponential, the moving-average part from the lags 0 to 2.
    shrink = np.exp(-decay * step_s)
    a1, a2 = -2.0 * shrink * np.cos(damped * step_s), shrink**2
    c0, c1, c2 = (autocovariance(lag * step_s) for lag in range(3))
    m0 = c0 * (1 + a1 * a1 + a2 * a2) + 2 * c1 * (a1 + a1 * a2) + 2 * c2 * a2
    m1 = c0 * (a1 + a1 * a2) + c1 * (1 + a1 * a1 + a2 + a2 * a2) + c2 * (a1 + a1 * a2)
    m1 += a2 * autocovariance(3 * step_s)
    root = np.sqrt(max(m0 * m0 - 4.0 * m1 * m1, 0.0))
    b0 = np.sqrt(0.5 * (m0 + root))
    b1 = m1 / b0
    settle = int(np.ceil(8.0 / (decay * step_s)))
    white = rng.standard_normal((*shape[:-1], shape[-1] + settle))
    return np.asarray(lfilter([b0, b1], [1.0, a1, a2], white, axis=-1)[..., settle:])
