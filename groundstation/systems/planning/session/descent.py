"""Spectral projected gradient method over controls with bounds and limits of their change.

Source: Birgin, Martinez and Raydan, Nonmonotone spectral projected gradient methods on convex sets, SIAM Journal on
Optimization 10(4), 2000 (algorithm SPG1); Frank and Wolfe, An algorithm for quadratic programming, 1956 (the gap that
tells how far from a stationary point one is).
"""

from collections import deque
from collections.abc import Callable

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen

Project = Callable[[FloatArray], FloatArray]
Measure = Callable[[FloatArray], tuple[float, FloatArray]]
REMEMBERED = 10  # losses that a step may stay below
SUFFICIENT = 1e-4  # share of the first-order gain that a step must bring
SHORTEST, LONGEST = 1e-12, 1e12  # of the spectral step, in units of the first
MOST_HALVINGS = 40
FAR = 1e3  # in widths of the set: a step so long ends where the linear model is least


@dataclass(frozen=True)
class Minimum:
    """End of a descent.

    Parameters
    ----------
    x : ndarray
        In the shape of the start.
    loss : float
    gap : float
        Most that any point within reach would gain to first order, over the size of the loss; 0 at a stationary point.
    iterations, evaluations : int
    has_converged : bool
        Gap below the tolerance.
    """

    x: FloatArray
    loss: float
    gap: float
    iterations: int
    evaluations: int
    has_converged: bool

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", frozen(self.x))


def minimise(
    measure: Measure,
    project: Project,
    start: FloatArray,
    width: float,
    *,
    iterations: int,
    tolerance: float,
    reach: float = FAR,
) -> Minimum:
    """Least loss over a set from a start.

    Parameters
    ----------
    measure : callable
        Loss and its gradient; a loss that is not finite is never stepped to.
    project : callable
        Nearest point of the set.
    start : ndarray
        From an infinite loss there is no way: the descent ends there and has not converged.
    width : float
        About the size of the set: the first step goes so far.
    iterations : int
        At most.
    tolerance : float
        Of the gap.
    reach : float
        How far the gap looks, in widths. In a set that is not convex something near: a gain beyond what is forbidden is
        no gain here.

    Examples
    --------
    >>> bowl = lambda x: (float(((x - 3.0) ** 2).sum()), 2.0 * (x - 3.0))
    >>> found = minimise(bowl, lambda x: np.clip(x, 0.0, 2.0), np.zeros(2), 2.0, iterations=50, tolerance=1e-9)
    >>> found.x.tolist(), found.has_converged
    ([2.0, 2.0], True)
    """
    x = project(start)
    value, slope = measure(x)
    evaluations, recent, best = 1, deque([value], REMEMBERED), (value, x)
    unit = width / _largest(slope)
    step, gap, done = unit, np.inf, 0
    for done in range(iterations + 1):
        gap = _gap(x, value, slope, project, reach * width)
        if gap <= tolerance or done == iterations or not np.isfinite(value):
            break
        share = 1.0
        for _ in range(MOST_HALVINGS):
            trial = project(x - share * step * slope)
            gain = min(float((slope * (trial - x)).sum()), 0.0)
            reached, rise = measure(trial)
            evaluations += 1
            if reached <= max(recent) + SUFFICIENT * gain:
                break
            share *= _shorter(value, reached, gain)
        else:
            break
        moved, turned = trial - x, rise - slope
        curve = float((moved * turned).sum())
        step = unit * LONGEST if curve <= 0.0 else float((moved * moved).sum()) / curve
        step = float(np.clip(step, unit * SHORTEST, unit * LONGEST))
        x, value, slope = trial, reached, rise
        recent.append(value)
        if value < best[0]:
            best = value, x
    if best[0] < value:
        value, x = best
        gap = _gap(x, value, measure(x)[1], project, reach * width)
        evaluations += 1
    return Minimum(x, value, gap, done, evaluations, gap <= tolerance)


def _largest(slope: FloatArray) -> float:
    return max(float(np.abs(slope).max(initial=0.0)), 1e-300)


def _shorter(value: float, reached: float, gain: float) -> float:
    """Return the factor on a step that was too long.

    It is the minimum of the parabola through what is known, kept within bounds.
    """
    if not np.isfinite(reached):
        return 0.1
    bend = reached - value - gain
    return float(np.clip(-0.5 * gain / bend, 0.1, 0.5)) if bend > 0.0 else 0.5


def _gap(x: FloatArray, value: float, slope: FloatArray, project: Project, reach: float) -> float:
    if not np.isfinite(value):
        return float("inf")
    far = project(x - reach / _largest(slope) * slope)
    return max(float((slope * (x - far)).sum()), 0.0) / max(abs(value), 1e-300)


def nearest_law(wanted: FloatArray, start: float, low: float, high: float, change: float) -> FloatArray:
    """Return the nearest control (least squares) within bounds and within a change per step.

    Parameters
    ----------
    wanted : ndarray, shape (steps,)
    start : float
        The control before the first step, within the bounds.
    low, high, change : float

    Notes
    -----
    Dynamic programming over the steps: f_k(v), the least cost of steps 1 to k that end at v, is convex and piecewise
    quadratic. Its derivative is kept as knots (v, f'). The least over all v' with abs(v' - v) <= change moves what is
    left of the lowest point to the left by that much, and the rest to the right.

    Source: Johnson, A dynamic programming algorithm for the fused lasso, Journal of Computational and Graphical
    Statistics 22(2), 2013, whose recursion holds with a limit of the change in place of its penalty.

    Examples
    --------
    >>> nearest_law(np.array([5.0, 5.0, 0.0, 0.0]), 0.0, -1.0, 4.0, 2.0).tolist()
    [2.0, 3.5, 1.5, 0.0]
    """
    at, slope = np.array([start]), np.array([0.0])
    lowest = np.empty(len(wanted) + 1)
    for step in range(len(wanted) + 1):
        lowest[step] = _lowest(at, slope)
        if step == len(wanted):
            break
        left, middle = slope < 0.0, lowest[step]
        at = np.concatenate([at[left] - change, [middle - change, middle + change], at[~left] + change])
        slope = np.concatenate([slope[left], [0.0, 0.0], slope[~left]])
        at, slope = _within(at, slope, low, high)
        slope = slope + at - wanted[step]
    found = np.empty(len(wanted))
    value = lowest[-1]
    for step in range(len(wanted) - 1, -1, -1):
        found[step] = value
        value = float(np.clip(lowest[step], value - change, value + change))
    return found


def _lowest(at: FloatArray, slope: FloatArray) -> float:
    """Return where a non-decreasing derivative passes zero, or the end nearest to it."""
    right = int(np.searchsorted(slope, 0.0))
    if right == 0 or right == len(at):
        return float(at[min(right, len(at) - 1)])
    rise = slope[right] - slope[right - 1]
    return float(at[right - 1] + (at[right] - at[right - 1]) * (-slope[right - 1] / rise))


def _within(at: FloatArray, slope: FloatArray, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Return the knots between two ends, with at least one at each.

    Where the derivative jumps there are two at one place.
    """
    low, high = max(low, float(at[0])), min(high, float(at[-1]))
    first, last = np.searchsorted(at, low), np.searchsorted(at, high, side="right")
    ends = np.interp([low, high], at, slope)
    at, slope = at[first:last], slope[first:last]
    if not len(at) or at[0] > low:
        at, slope = np.append(low, at), np.append(ends[0], slope)
    if at[-1] < high:
        at, slope = np.append(at, high), np.append(slope, ends[1])
    return at, slope
