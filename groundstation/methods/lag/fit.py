"""Delay between two series of samples, with an interval.

The interval holds for errors correlated over seconds.

The other sensor shows the reference as it was ``delay`` seconds ago, beside what its own errors add:

    other(t) = (1, theta) . reference(t - delay) + polynomial of each window(t) + noise,

``reference`` being the signal and what else may be in it (scale, azimuth error, antenna arm), each with a prior.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import student_quantile
from groundstation.methods.lag.settings import LatencySettings
from groundstation.methods.lag.windows import (
    Noise,
    ReferenceSignals,
    Whitened,
    Windows,
    noise_of,
    reweighted,
    spread_of,
)

FloatArray = NDArray[np.float64]
MOST_STEPS, LONGEST_STEP_S, CONVERGED_S = 12, 0.3, 1e-4
STEPS_WITH_WEIGHTS = 4  # after them the weights stay
WINDOWS_FOR_SEARCH = 16
NO_PRIOR = 1e6
MOVING_SHARE = 0.1  # least motion as a share of the liveliest component's: less may be noise alone
At = tuple[float, FloatArray]  # delay, nuisances
LEAST_RATIO = 1e-9  # directions that one window alone determines leave nothing to be judged by


@dataclass(frozen=True)
class DelayFit:
    """Delay, and its uncertainty.

    ``sigma_s`` allows for errors correlated within a window and for the priors; ``modelled_sigma_s`` is what the noise
    model would give; ``freedom`` the number of degrees it rests on; ``motion`` the RMS rate of the reference,
    ``residual`` that of what is left (units of the signal); ``explained`` the share of the other's motion.
    ``search_s``, ``search_residual``: residual against delay. ``nuisance`` with its sigma and freedom is that of
    the one that was asked for.
    """

    delay_s: float
    sigma_s: float
    modelled_sigma_s: float
    freedom: float
    motion: float
    residual: float
    explained: float
    samples: int
    windows: int
    is_converged: bool
    search_s: FloatArray
    search_residual: FloatArray
    nuisance: float = 0.0
    nuisance_sigma: float = float("inf")
    nuisance_freedom: float = 1.0

    @property
    def half_width_s(self) -> float:
        """Half of the 95 % interval, by Student's quantile."""
        return student_quantile(0.975, self.freedom) * self.sigma_s


@dataclass(frozen=True)
class _Step:
    """One step of Gauss-Newton: design (w, r, 1 + q), residual (w, r), normal matrix, answer.

    ``residuals`` are the raw ones.
    """

    rows: FloatArray
    left: FloatArray
    normal: FloatArray
    solved: FloatArray
    residuals: FloatArray


def fit_delay(
    reference: ReferenceSignals,
    windows: Windows,
    prior_sigma: FloatArray,
    settings: LatencySettings,
    *,
    wanted: int | None = None,
) -> DelayFit:
    """Fit the delay of windows behind a reference.

    Parameters
    ----------
    reference : ReferenceSignals
    windows : Windows
        Two or more.
    prior_sigma : ndarray, shape (q,)
        Prior sigma of each nuisance about zero.
    wanted : int, optional
        The nuisance that is told of with its standard error.

    Returns
    -------
    DelayFit

    Notes
    -----
    A search over ``search_s`` either way, then generalised least squares by Gauss-Newton with Huber's weights and a
    noise model (white and exponentially correlated) found from the residuals. The variance is the sandwich over
    windows with the CR2 correction for few of them, its degrees of freedom those of Bell and McCaffrey. The priors add
    their own variance.

    Source: Bell and McCaffrey, Bias reduction in standard errors for linear regression with multi-stage samples, Survey
    Methodology 28 (2002) 169; Huber, Robust Statistics, 1981, chapter 7; Carter, Coherence and time delay estimation,
    Proc. IEEE 75 (1987) 236 (variance of a delay ~ noise over the squared rate of the signal).
    """
    prior = np.diag(1.0 / np.square(np.concatenate([[NO_PRIOR], np.maximum(prior_sigma, 1e-12)])))
    plain = Whitened.plain(windows, settings.degree)
    search_s, profile = _search(reference, windows, prior, settings)
    at = float(search_s[int(np.argmin(profile))]), np.zeros(len(prior_sigma))
    step = _step(reference, windows, plain, prior, at)
    spread = spread_of(step.left)
    at, step, _ = _iterated(reference, windows, plain, None, spread**2 * prior, at, settings)
    left = plain.rows(step.residuals[..., None]).reshape(windows.values.shape)
    windows = reweighted(windows, left, spread_of(left), settings.robust_sigmas)
    noise = noise_of(windows, left, settings.degree)
    at, step, is_converged = _iterated(reference, windows, plain, noise, prior, at, settings)
    variance, freedom, modelled = _variance(step, prior, 0)
    aside = {}
    if wanted is not None:
        spread, degrees, _modelled = _variance(step, prior, 1 + wanted)
        aside = {"nuisance": float(at[1][wanted]), "nuisance_sigma": spread**0.5, "nuisance_freedom": degrees}
    shown, rate = (part[..., :1] for part in reference.at(windows.time_s - at[0]))
    left, seen, shown, rate = (
        _squares(plain.rows(part), windows)
        for part in (step.residuals[..., None], windows.values[..., None], shown, rate)
    )
    count = float(np.sum(windows.known)) * windows.values.shape[2]
    return DelayFit(
        delay_s=at[0],
        sigma_s=float(np.hypot(np.sqrt(variance), settings.sigma_floor_s)),
        modelled_sigma_s=float(np.sqrt(modelled)),
        freedom=freedom,
        motion=float(np.sqrt(np.sum(rate) / count)),
        residual=float(np.sqrt(np.sum(left) / count)),
        explained=_explained(left, seen, shown),
        samples=int(np.sum(windows.known)),
        windows=len(windows),
        is_converged=is_converged and abs(at[0]) < settings.search_s - settings.search_step_s,
        search_s=search_s,
        search_residual=profile,
        **aside,
    )


def _squares(rows: FloatArray, windows: Windows) -> FloatArray:
    """Sum of squares of each component, shape (c,)."""
    return np.asarray(np.sum(np.square(rows.reshape(windows.values.shape)), axis=(0, 1)))


def _explained(left: FloatArray, seen: FloatArray, shown: FloatArray) -> float:
    """Return the share of the other's motion explained, of the worst component that moves.

    Arguments are sums of squares (c,).
    """
    size = np.maximum(seen, shown)
    moving = size >= MOVING_SHARE * np.max(size)
    return float(np.min(1.0 - left[moving] / np.maximum(np.maximum(seen, left)[moving], 1e-300)))


def _search(
    reference: ReferenceSignals, windows: Windows, prior: FloatArray, settings: LatencySettings
) -> tuple[FloatArray, FloatArray]:
    """Return the delays tried, and the RMS residual at each with the nuisances fitted.

    Some of the windows are enough for it.
    """
    search_s = np.arange(-settings.search_s, settings.search_s + 1e-9, settings.search_step_s)
    windows = windows.some(WINDOWS_FOR_SEARCH)
    plain = Whitened.plain(windows, settings.degree)
    variance = spread_of(plain.rows(windows.values[..., None])) ** 2
    left = []
    for delay in search_s:
        value = reference.signal_at(windows.time_s - delay)
        parts = np.concatenate([value[..., 1:], (windows.values - value[..., 0])[..., None]], axis=-1)
        rows = plain.rows(parts).reshape(-1, parts.shape[-1])
        rows, target = rows[:, :-1], rows[:, -1]
        solved = np.linalg.solve(rows.T @ rows + variance * prior[1:, 1:], rows.T @ target)
        left.append(np.mean(np.square(target - rows @ solved)))
    return search_s, np.sqrt(np.array(left) * plain.known.size / np.sum(plain.known))


def _iterated(
    reference: ReferenceSignals,
    windows: Windows,
    plain: Whitened,
    noise: Noise | None,
    prior: FloatArray,
    at: At,
    settings: LatencySettings,
) -> tuple[At, _Step, bool]:
    """Iterate Gauss-Newton from a delay and nuisances until the delay stands.

    With a noise model the windows are weighted after each step.
    """
    delay, theta = at
    for number in range(MOST_STEPS):
        if noise is None:
            whitened = plain
        elif number < STEPS_WITH_WEIGHTS:
            whitened = Whitened.of(windows, noise, settings.degree)
        step = _step(reference, windows, whitened, prior, (delay, theta))
        change, theta = float(np.clip(step.solved[0], -LONGEST_STEP_S, LONGEST_STEP_S)), step.solved[1:]
        delay = float(np.clip(delay + change, -settings.search_s, settings.search_s))
        if abs(change) < CONVERGED_S:
            break
        if noise is not None:
            left = plain.rows(step.residuals[..., None]).reshape(windows.values.shape)
            windows = reweighted(windows, left, noise.total, settings.robust_sigmas)
    return (delay, theta), step, abs(change) < CONVERGED_S


def _step(reference: ReferenceSignals, windows: Windows, whitened: Whitened, prior: FloatArray, at: At) -> _Step:
    """Linearise at a delay and nuisances and solve.

    The solution is a change of delay, and the nuisances.
    """
    delay, theta = at
    value, rate = reference.at(windows.time_s - delay)
    later = -rate @ np.concatenate([[1.0], theta])
    parts = np.concatenate([later[..., None], value[..., 1:], (windows.values - value[..., 0])[..., None]], axis=-1)
    rows = whitened.rows(parts)
    rows, target = rows[..., :-1], rows[..., -1]
    flat = rows.reshape(-1, rows.shape[-1])
    normal = flat.T @ flat + prior
    solved = np.asarray(np.linalg.solve(normal, flat.T @ target.reshape(-1)), dtype=np.float64)
    return _Step(rows, target - rows @ solved, normal, solved, parts[..., -1] - parts[..., :-1] @ solved)


def _variance(step: _Step, prior: FloatArray, number: int) -> tuple[float, float, float]:
    """Return the variance of the delay (0) or a nuisance, and its degrees of freedom.

    The latter come from the windows' scores (Satterthwaite). The third is the variance that the noise model alone would
    give.
    """
    inverse = np.linalg.inv(step.normal)
    basis, factor = np.linalg.qr(step.rows)
    own = np.eye(factor.shape[1]) - factor @ inverse @ np.swapaxes(factor, 1, 2)
    size, axes = np.linalg.eigh(0.5 * (own + np.swapaxes(own, 1, 2)))
    scale = np.where(size > LEAST_RATIO, 1.0 / np.sqrt(np.maximum(size, LEAST_RATIO)), 0.0)
    corrected = ((axes * scale[:, None, :]) @ np.swapaxes(axes, 1, 2) @ factor @ inverse[:, [number]])[..., 0]
    scores = np.sum(corrected * np.einsum("wip,wi->wp", basis, step.left), axis=1)
    across = np.einsum("wpq,wp->wq", factor, corrected)
    spectrum = np.diag(np.sum(corrected**2, axis=1)) - across @ inverse @ across.T
    degrees = float(np.trace(spectrum)) ** 2 / max(float(np.sum(spectrum**2)), 1e-300)
    of_data, of_priors = inverse[number] @ (step.normal - prior), inverse[number] @ prior
    modelled = float(of_data @ inverse[number])
    from_data, from_priors = float(np.sum(scores**2)), float(of_priors @ inverse[number])
    total = from_data + from_priors
    freedom = max(degrees * (total / max(from_data, 1e-300)) ** 2, 1.0)
    return total, freedom, modelled + from_priors
