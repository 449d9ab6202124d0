"""Posterior of a few parameters: its maximum, and weighted draws from it.

The target is a log density that takes many points at once, shape (k, p), and gives shape (k,). ``scale``, shape (p,),
is the prior sigma of each parameter: steps and limits are in units of it.

Source: J. Nocedal, S. Wright, Numerical Optimization, second edition, 2006, algorithm 6.1 (BFGS); A. Gelman et al.,
Bayesian Data Analysis, third edition, 2013, sections 10.4 (importance sampling) and 13.3 (normal approximation at the
mode); E. Veach, L. Guibas, Optimally combining sampling techniques, 1995 (weights of several rounds together).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]

T_DEGREES = 6.0  # of the multivariate t that draws: heavier tails than any posterior met
MOST_ROUNDS, LEAST_EFFECTIVE_DRAWS = 6, 60.0


def _gradient(log_density: LogDensity, theta: FloatArray, scale: FloatArray) -> tuple[float, FloatArray]:
    """Minus the log density and its gradient by central differences, all points in one call."""
    step = 1e-4 * scale
    size = len(theta)
    points = theta + np.vstack([np.zeros(size), np.diag(step), -np.diag(step)])
    values = -log_density(points)
    return float(values[0]), (values[1 : size + 1] - values[size + 1 :]) / (2.0 * step)


def find_mode(
    log_density: LogDensity, start: FloatArray, scale: FloatArray, most_steps: int = 60
) -> tuple[FloatArray, bool]:
    """Maximum of the log density by the BFGS method with step halving, in units of the prior sigmas.

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
    """Inverse of the curvature; no direction wider than the prior nor narrower than a thousandth of it."""
    scaled = hessian * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    inverse = (vectors / np.clip(values, 1.0, 1e6)) @ vectors.T
    return np.asarray(inverse * np.outer(scale, scale))


@dataclass(frozen=True)
class _Proposal:
    """A multivariate t to draw from: center (p,), triangular factor (p, p) of its scale."""

    center: FloatArray
    factor: FloatArray

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        normal = rng.standard_normal((count, len(self.center)))
        spread = np.sqrt(T_DEGREES / rng.chisquare(T_DEGREES, count))
        return np.asarray(self.center + spread[:, None] * (normal @ self.factor.T))

    def log_density(self, points: FloatArray) -> FloatArray:
        """Up to a constant common to all proposals."""
        whitened = np.linalg.solve(self.factor, (points - self.center).T)
        size = len(self.center)
        tail = -0.5 * (T_DEGREES + size) * np.log1p(np.sum(whitened**2, axis=0) / T_DEGREES)
        return np.asarray(tail - np.sum(np.log(np.abs(np.diag(self.factor)))))


def _root(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)


def _normalised(log_weight: FloatArray) -> FloatArray:
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(weight / weight.sum())


def sample(
    log_density: LogDensity, mode: FloatArray, scale: FloatArray, draws: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Draws of the posterior, shape (k, p), and their weights, shape (k,).

    Rounds of draws; each proposal is fitted to the weighted draws so far. At least two rounds, more while few draws
    carry the weight.
    """
    proposals = [_Proposal(mode, _root(_covariance(_curvature(log_density, mode), scale) * 1.3))]
    size = draws // 2
    points, log_target = np.zeros((0, len(mode))), np.zeros(0)
    weight = np.zeros(0)
    for number in range(MOST_ROUNDS):
        fresh = proposals[-1].draw(rng, size)
        points = np.vstack([points, fresh])
        log_target = np.concatenate([log_target, log_density(fresh)])
        mixture = np.logaddexp.reduce([proposal.log_density(points) for proposal in proposals], axis=0)
        weight = _normalised(log_target - mixture)
        effective = 1.0 / float(np.sum(weight**2))
        if number > 0 and effective > LEAST_EFFECTIVE_DRAWS:
            break
        tempered = np.minimum(weight, 10.0 / len(weight))  # so that one draw does not make the fit
        tempered = tempered / tempered.sum()
        center = tempered @ points
        spread = (points - center) * np.sqrt(tempered)[:, None]
        covariance = 0.8 * spread.T @ spread + 0.2 * proposals[0].factor @ proposals[0].factor.T
        proposals.append(_Proposal(center, _root(covariance)))
    return points, weight
