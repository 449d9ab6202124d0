"""Fit of the model's numbers to a log: penalised likelihood, one number after the other.

The likelihood is that of the filter's innovations; each number has a prior about that of its class, wide in the
logarithm, and bounds.

Source: F. C. Schweppe, Evaluation of likelihood functions for Gaussian signals, IEEE
Trans. Information Theory 11, 1965; R. K. Mehra, On the identification of variances and adaptive Kalman filtering, IEEE
Trans. Automatic Control 15, 1970.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from groundstation.systems.trajectory.model import Model
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
FIRST_STEP, LEAST_STEP = 0.7, 0.12  # of the logarithm
SWEEPS = 4


@dataclass(frozen=True)
class Fit:
    """Fitted model, with its penalised log-likelihood.

    ``at_bound`` names the numbers that stand at a bound.
    """

    model: Model
    value: float
    evaluations: int
    at_bound: tuple[str, ...]


def fit_model(prior: Model, likelihood: Callable[[Model], float], numbers: tuple[Number, ...] = NUMBERS) -> Fit:
    """Return the model of largest penalised likelihood near ``prior``.

    Parameters
    ----------
    prior : Model
    likelihood : callable
        Logarithm of the likelihood of a log under a model.
    """
    logs = np.zeros(len(numbers))
    count = 0

    def model_of(at: FloatArray) -> Model:
        return prior.changed({one.name: float(np.exp(step)) for one, step in zip(numbers, at, strict=True)})

    def value_of(at: FloatArray) -> float:
        nonlocal count
        count += 1
        penalty = sum(0.5 * (step / one.spread) ** 2 for one, step in zip(numbers, at, strict=True))
        found = likelihood(model_of(at))
        return float((found if np.isfinite(found) else -1e300) - penalty)

    best = value_of(logs)
    steps = np.full(len(numbers), FIRST_STEP)
    for _ in range(SWEEPS):
        before = best
        for i, one in enumerate(numbers):
            low, high = np.log(one.least), np.log(one.most)
            best, logs, moved = _along(value_of, logs, i, steps[i], low, high, best)
            steps[i] = max(LEAST_STEP, steps[i] if moved else 0.4 * steps[i])
        if best - before < 1.0 and steps.max() <= FIRST_STEP * 0.4:
            break
    at_bound = tuple(
        one.name
        for one, step in zip(numbers, logs, strict=True)
        if not np.log(one.least) + 1e-9 < step < np.log(one.most) - 1e-9
    )
    return Fit(model_of(logs), best, count, at_bound)


def _along(
    value_of: Callable[[FloatArray], float], logs: FloatArray, i: int, step: float, low: float, high: float, best: float
) -> tuple[float, FloatArray, bool]:
    """Walk along one number while it gets better.

    The last step goes to the top of the parabola through the last three.
    """

    def at(number: float) -> FloatArray:
        moved = logs.copy()
        moved[i] = min(max(number, low), high)
        return moved

    seen = {float(logs[i]): best}

    def look(number: float) -> float:
        number = float(min(max(number, low), high))
        if number not in seen:
            seen[number] = value_of(at(number))
        return seen[number]

    centre = float(logs[i])
    up, down = look(centre + step), look(centre - step)
    for _ in range(6):
        if up > seen[centre] and up >= down and centre < high:
            centre = float(min(centre + step, high))
            up = look(centre + step)
            down = look(centre - step)
        elif down > seen[centre] and centre > low:
            centre = float(max(centre - step, low))
            up = look(centre + step)
            down = look(centre - step)
        else:
            break
    bend = up - 2.0 * seen[centre] + down
    if bend < 0.0:
        look(centre - 0.5 * step * (up - down) / bend)
    top = max(seen, key=lambda number: seen[number])
    return seen[top], at(top), top != float(logs[i])
