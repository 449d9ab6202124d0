"""Fit of the model's numbers to a log: penalised likelihood, climbed by its derivatives.

The likelihood is that of the filter's innovations; each number has a prior about that of its class, wide in the
logarithm, and bounds.

Source: F. C. Schweppe, Evaluation of likelihood functions for Gaussian signals, IEEE
Trans. Information Theory 11, 1965; R. K. Mehra, On the identification of variances and adaptive Kalman filtering, IEEE
Trans. Automatic Control 15, 1970; J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition, 2006, chapter 6
(BFGS); H. Zhou, L. Hu, J. Zhou, K. Lange, MM algorithms for variance components models, 2019 (first steps).
"""

from collections.abc import Callable

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.model import Model
from groundstation.systems.trajectory.score import Scored
from groundstation.systems.trajectory.states import FloatArray


@dataclass(frozen=True)
class Number:
    """Number of the model that is fitted.

    It has its name, the sigma of the prior's logarithm, and bounds as factors of the prior.
    """

    name: str
    spread: float
    least: float
    most: float


NUMBERS = (
    Number("gyro_noise_deg_rth", 1.5, 0.02, 40.0),
    Number("accel_noise_mps_rth", 1.5, 0.02, 60.0),
    Number("velocity_scale", 1.0, 0.1, 20.0),
    Number("velocity_down_scale", 0.7, 0.2, 5.0),
    Number("position_scale", 1.0, 0.02, 20.0),
    Number("slow_scale", 1.0, 0.05, 10.0),
    Number("fast_scale", 1.0, 0.02, 10.0),
    Number("gyro_imperfection", 0.5, 0.03, 2.5),
    Number("accel_imperfection", 0.5, 0.03, 2.5),
    Number("jitter_s", 1.0, 0.1, 30.0),
    Number("gyro_walk_dps_rth", 1.0, 0.02, 30.0),
    Number("accel_walk_mg_rth", 1.0, 0.02, 30.0),
)
LONGEST_STEP = 1.5  # of a logarithm
FIRST_STEPS = 4  # by the degrees of freedom alone
MOST_STEPS = 40
SHORTER, SHORTEST = 0.3, 0.02  # a step that gains nothing is made shorter
ENOUGH = 0.5  # log units that the next step may still gain


@dataclass(frozen=True)
class Fit:
    """Fitted model, with its penalised log-likelihood.

    ``at_bound`` names the numbers that stand at a bound.
    """

    model: Model
    value: float
    evaluations: int
    at_bound: tuple[str, ...]


Scores = Callable[[Callable[[FloatArray], Model], FloatArray], Scored]


def fit_model(prior: Model, scored: Scores, numbers: tuple[Number, ...] = NUMBERS, begin: Model | None = None) -> Fit:
    """Return the model of largest penalised likelihood near ``prior``.

    Parameters
    ----------
    prior : Model
    scored : callable
        Log-likelihood of a log and its derivatives; it takes the model as a function of the logarithms of the factors
        on the numbers, and those logarithms, shape (n,).
    begin : Model, optional
        Where the search begins; the prior where there is none.
    """
    spread = np.array([one.spread for one in numbers])
    low, high = np.log([one.least for one in numbers]), np.log([one.most for one in numbers])
    count = 0

    def model_at(at: FloatArray) -> Model:
        return prior.changed({one.name: float(np.exp(step)) for one, step in zip(numbers, at, strict=True)})

    def penalised(at: FloatArray) -> Scored:
        nonlocal count
        count += 1
        found = scored(model_at, at)
        value = found.value if np.isfinite(found.value) else -1e300
        return Scored(float(value - 0.5 * np.sum((at / spread) ** 2)), found.gradient - at / spread**2, found.expected)

    logs = np.zeros(len(numbers))
    if begin is not None:
        logs = np.log([getattr(begin, one.name) / getattr(prior, one.name) for one in numbers])
    best = penalised(logs)
    inverse = _bound(best, spread)
    for number in range(MOST_STEPS):
        if begin is None and number < FIRST_STEPS:
            inverse = _bound(best, spread)
        step = _step(best, inverse, logs, low, high)
        if float(best.gradient @ step) < 2.0 * ENOUGH:
            break
        share = 1.0
        while share > SHORTEST:
            tried = np.clip(logs + share * step, low, high)
            found = penalised(tried)
            if found.value > best.value:
                break
            share *= SHORTER
        if found.value <= best.value:
            break
        inverse = _learned(inverse, tried - logs, best.gradient - found.gradient)
        logs, best = tried, found
    is_free = (logs > low + 1e-9) & (logs < high - 1e-9)
    at_bound = tuple(one.name for one, free in zip(numbers, is_free, strict=True) if not free)
    return Fit(model_at(logs), best.value, count, at_bound)


def _bound(at: Scored, spread: FloatArray) -> FloatArray:
    """Return a bound for the inverse of the information, shape (n, n).

    Steps by it never go too far.
    """
    return np.diag(1.0 / (2.0 * at.expected + spread**-2.0 + np.maximum(at.gradient, 0.0)))


def _learned(inverse: FloatArray, step: FloatArray, fell: FloatArray) -> FloatArray:
    """Return the inverse of the information after a step (BFGS).

    It is learned from what the derivatives fell by.
    """
    curved = float(step @ fell)
    if curved <= 1e-6:
        return inverse
    left = np.eye(len(step)) - np.outer(step, fell) / curved
    return np.asarray(left @ inverse @ left.T + np.outer(step, step) / curved)


def _step(at: Scored, inverse: FloatArray, logs: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the next step of the numbers; one that stands at a bound and would pass it stays."""
    free = ~(((logs <= low) & (at.gradient < 0.0)) | ((logs >= high) & (at.gradient > 0.0)))
    step = np.zeros(len(logs))
    step[free] = inverse[np.ix_(free, free)] @ at.gradient[free]
    return np.asarray(step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-9)))
