"""Posterior of a few parameters: its maximum, and weighted draws from it.

The target is a log density that takes many points at once, shape (k, p), and gives shape (k,). ``scale``, shape (p,),
is the prior sigma of each parameter: steps and limits are in units of it.

Source: J. Nocedal, S. Wright, Numerical Optimization, second edition, 2006, algorithm 6.1 (BFGS); A. Gelman et al.,
Bayesian Data Analysis, third edition, 2013, sections 10.4 (importance sampling) and 13.3 (normal approximation at the
mode); E. Veach, L. Guibas, Optimally combining sampling techniques, 1995 (weights of several rounds together).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]

T_DEGREES = 6.0  # degrees of freedom of the multivariate t: heavier tails than any posterior met
ROUNDS, LEAST_IN_ROUND = 20, 50  # rounds of draws: each proposal learns from all rounds before it
MOST_TIMES, LEAST_EFFECTIVE_DRAWS = 3, 60.0  # so many times the draws asked for, until so many carry the weight
FIRST_SHARE = 0.1  # share of the first proposal's covariance in all later ones
HEAVIEST_IN_FIT, HEAVIEST = 100.0, 0.5  # weight of one draw: times the mean; times the mean and the root of all draws
TINIEST = 1e-12  # distance of a point of the sequence from 0 and 1


def _gradient(log_density: LogDensity, theta: FloatArray, scale: FloatArray) -> tuple[float, FloatArray]:
    """Return minus the log density and its gradient by central differences.

    All points are evaluated in one call.
    """
    step = 1e-4 * scale
    size = len(theta)
    points = theta + np.vstack([np.zeros(size), np.diag(step), -np.diag(step)])
    values = -log_density(points)
    return float(values[0]), (values[1 : size + 1] - values[size + 1 :]) / (2.0 * step)


def find_mode(
    log_density: LogDensity, start: FloatArray, scale: FloatArray, most_steps: int = 60
) -> tuple[FloatArray, bool]:
    """Maximise the log density by the BFGS method with step halving.

    Steps are in units of the prior sigmas.

    Source: J. Nocedal, S. Wright, Numerical Optimization, second edition, 2006, algorithm 6.1. Letters: H inverse of
    the second derivatives, s step, y change of the gradient.
    """
    theta = start.copy()
    value, gradient = _gradient(log_density, theta, scale)
    gradient = gradient * scale
    H = 0.01 * np.eye(len(theta))
    for _ in range(most_steps):
        s = -H @ gradient
        longest = float(np.max(np.abs(s)))
        if longest > 1.0:
            s = s / longest
        for _halving in range(12):
            trial = theta + s * scale
            new_value, new_gradient = _gradient(log_density, trial, scale)
            if new_value < value + 1e-4 * float(s @ gradient):
                break
            s = 0.5 * s
        else:
            return theta, float(np.max(np.abs(gradient))) < 0.1
        new_gradient = new_gradient * scale
        y = new_gradient - gradient
        gain, theta, value, gradient = value - new_value, trial, new_value, new_gradient
        if gain < 1e-3 and float(np.max(np.abs(gradient))) < 0.05:
            return theta, True
        curvature = float(s @ y)
        if curvature > 1e-10:
            left = np.eye(len(s)) - np.outer(s, y) / curvature
            H = left @ H @ left.T + np.outer(s, s) / curvature
    return theta, False


def _curvature(log_density: LogDensity, mode: FloatArray) -> FloatArray:
    """Second derivatives of minus the log density by central differences, shape (p, p)."""
    size, step = len(mode), 0.05
    points = [mode]
    for i in range(size):
        for j in range(i, size):
            for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                offset = np.zeros(size)
                offset[i] += a * step
                offset[j] += b * step
                points.append(mode + offset)
    values = -log_density(np.array(points))
    hessian = np.empty((size, size))
    place = 1
    for i in range(size):
        for j in range(i, size):
            pp, pm, mp, mm = values[place : place + 4]
            hessian[i, j] = hessian[j, i] = (pp - pm - mp + mm) / (4.0 * step * step)
            place += 4
    return hessian


def _covariance(hessian: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the inverse of the curvature.

    No direction is wider than the prior nor narrower than a thousandth of it.
    """
    scaled = hessian * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    inverse = (vectors / np.clip(values, 1.0, 1e6)) @ vectors.T
    return np.asarray(inverse * np.outer(scale, scale))


@dataclass(frozen=True)
class _Proposal:
    """A multivariate t to draw from: center (p,), triangular factor (p, p) of its scale."""

    center: FloatArray
    factor: FloatArray

    def at(self, places: FloatArray) -> FloatArray:
        """The draws, shape (k, p), that belong to places in the unit cube, shape (k, p + 1).

        The first place gives the last parameter, which depends on no other: what is asked first is spread most evenly.
        """
        from scipy.special import gammaincinv, ndtri

        places = np.clip(places, TINIEST, 1.0 - TINIEST)
        normal = ndtri(places[:, -2::-1])
        spread = np.sqrt(0.5 * T_DEGREES / gammaincinv(0.5 * T_DEGREES, places[:, -1]))
        return np.asarray(self.center + spread[:, None] * (normal @ self.factor.T))

    def log_density(self, points: FloatArray) -> FloatArray:
        """Return the log density up to a constant common to all proposals."""
        whitened = (points - self.center) @ np.linalg.inv(self.factor).T  # solving takes three times as long
        size = len(self.center)
        tail = -0.5 * (T_DEGREES + size) * np.log1p(np.sum(whitened**2, axis=1) / T_DEGREES)
        return np.asarray(tail - np.sum(np.log(np.abs(np.diag(self.factor)))))


def _root(covariance: FloatArray) -> FloatArray:
    """Return the upper triangular factor.

    The last parameter then depends on one normal number alone.
    """
    return np.asarray(np.linalg.cholesky(covariance[::-1, ::-1])[::-1, ::-1], dtype=np.float64)


def _even_places(first: int, count: int, shift: FloatArray) -> FloatArray:
    """Return points of an additive recurrence in the unit cube, shape (count, d).

    They are points ``first`` to ``first + count``.

    Source: M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018 (the generalised golden ratio).
    """
    ratio = 1.5
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (len(shift) + 1.0))
    steps = ratio ** -np.arange(1.0, len(shift) + 1.0)
    return np.asarray((shift + np.arange(first + 1, first + count + 1)[:, None] * steps) % 1.0)


def _weights(log_weight: FloatArray) -> FloatArray:
    """Return weights of sum 1, none so large that one draw makes the answer.

    Source: E. Ionides, Truncated importance sampling, Journal of Computational and Graphical Statistics 17 (2008).
    """
    weight = np.exp(log_weight - log_weight.max())
    weight = np.minimum(weight / weight.sum(), HEAVIEST / np.sqrt(len(weight)))
    return np.asarray(weight / weight.sum())


def _next_proposal(first: _Proposal, points: FloatArray, weight: FloatArray) -> _Proposal:
    """Fit a proposal to weighted draws, with a share of the first one.

    The first one is never too narrow.
    """
    fitted = np.minimum(weight, HEAVIEST_IN_FIT / len(weight))
    fitted = fitted / fitted.sum()
    center = fitted @ points
    spread = (points - center) * np.sqrt(fitted)[:, None]
    covariance = (1.0 - FIRST_SHARE) * spread.T @ spread + FIRST_SHARE * first.factor @ first.factor.T
    return _Proposal(center, _root(covariance))


def sample(
    log_density: LogDensity,
    mode: FloatArray,
    scale: FloatArray,
    draws: int,
    rng: np.random.Generator,
    evaluate: LogDensity | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Draws of the posterior, shape (k, p), and their weights, shape (k,).

    Rounds of draws; each proposal is fitted to the weighted draws so far. More rounds than asked for while few draws
    carry the weight. ``evaluate``, where given, takes the place of ``log_density`` for the draws, each once and in
    order: it may keep what else it finds.
    """
    evaluate = evaluate or log_density
    proposals = [_Proposal(mode, _root(_covariance(_curvature(log_density, mode), scale) * 1.3))]
    size = max(draws // ROUNDS, LEAST_IN_ROUND)
    rounds, shift = max(-(-draws // size), 2), rng.random(len(mode) + 1)
    points, log_target, mixture = np.zeros((0, len(mode))), np.zeros(0), np.zeros(0)
    weight = np.zeros(0)
    for number in range(MOST_TIMES * rounds):
        fresh = proposals[-1].at(_even_places(len(points), size, shift))
        mixture = np.logaddexp(mixture, proposals[-1].log_density(points)) if number else mixture
        of_fresh = np.logaddexp.reduce([proposal.log_density(fresh) for proposal in proposals], axis=0)
        points, mixture = np.vstack([points, fresh]), np.concatenate([mixture, of_fresh])
        log_target = np.concatenate([log_target, evaluate(fresh)])
        weight = _weights(log_target - mixture)
        if number >= rounds - 1 and 1.0 / float(np.sum(weight**2)) > LEAST_EFFECTIVE_DRAWS:
            break
        proposals.append(_next_proposal(proposals[0], points, weight))
    return points, weight
