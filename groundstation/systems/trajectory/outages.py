"""Outages of GNSS that are replayed on a log's own data.

Errors are against the undisturbed solution, with their sigmas.
"""

from dataclasses import field, replace
from typing import Literal

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.halves import two_at_once
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray, Int64Array
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.layout import Plan
from groundstation.systems.trajectory.passes import Pass, run_pass
from groundstation.systems.trajectory.states import (
    ATT,
    NAVIGATION,
    NO_RATE,
    POSITION,
    STILL,
    VEL,
    VELOCITY,
    FloatArray,
)

LENGTHS_S = (10.0, 30.0, 60.0, 120.0)
ENOUGH = 10  # outages of a length
MOST_RUNS = 4
APART_S = 60.0  # GNSS between two outages of one run, and as long as an outage
LEAD_S = 60.0  # of the log before the first
TAIL_S = 20.0  # and behind the last
MOVING_SHARE = 0.5
CHI2_95_OF_2 = 5.991464547107979


@dataclass(frozen=True)
class Outages:
    """Replayed outages, a row each.

    Parameters
    ----------
    start_s, length_s : ndarrays, shape (n,)
    error_m, sigma_m : ndarrays, shape (n,)
        Largest horizontal error of the smoothed solution inside, and the root of the sum of both variances there.
    ratio : ndarray, shape (n,)
        That error over its sigma: root of the squared Mahalanobis distance over its 95 % bound; 1 is the bound.
    forward_end_m : ndarray, shape (n,)
        Horizontal error of the filter at the end.
    velocity_ratio : ndarray, shape (n, 3)
        Error of the velocity in the middle over its sigma; north, east, down.
    attitude : ndarray, shape (n, 3)
        Change of the attitude at the end, rad, about north, east, down.
    attitude_variance : ndarray, shape (n, 3)
        What is to be expected of it: the variance that leaving out the data added.
    down_m, down_ratio : ndarrays, shape (n,)
        Largest vertical error of the smoothed solution inside, and it over its 95 % bound.
    left_out_length_s, left_out_standing : ndarrays, shape (k,)
        Outages that were not replayed: length, and 1 where the vehicle mostly stood, 0 where GNSS is not there.
    """

    start_s: FloatArray
    length_s: FloatArray
    error_m: FloatArray
    sigma_m: FloatArray
    ratio: FloatArray
    forward_end_m: FloatArray
    velocity_ratio: FloatArray
    attitude: FloatArray
    attitude_variance: FloatArray
    down_m: FloatArray
    down_ratio: FloatArray
    left_out_length_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    left_out_standing: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.start_s)

    def of_length(self, length_s: float) -> BoolArray:
        """Tell which rows are of a length."""
        return np.asarray(self.length_s == length_s)

    def left_out(self, length_s: float, *, standing: bool) -> int:
        """Return how many outages of a length were not replayed.

        The vehicle stood in them; else GNSS is not there.
        """
        return int(np.count_nonzero((self.left_out_length_s == length_s) & (self.left_out_standing == standing)))


def replay(estimate: Estimate, lengths_s: tuple[float, ...] = LENGTHS_S) -> Outages:
    """Replay outages of each length; several lie in one run, apart from each other."""
    runs: list[tuple[float, FloatArray]] = []
    left: list[tuple[float, float]] = []
    for length_s in lengths_s:
        for starts in starts_of(estimate, length_s):
            windows = np.column_stack([starts, starts + length_s])
            why = [_why_not(estimate, start, end) for start, end in windows]
            left += [(length_s, float(one == "stands")) for one in why if one]
            windows = windows[[not one for one in why]] if len(windows) else windows
            if len(windows):
                runs.append((length_s, windows))

    def rows_of(run: tuple[float, FloatArray]) -> list[tuple[float, ...]]:
        length_s, windows = run
        done = without(estimate, windows)
        return [_row(estimate.result, done, start, end, length_s) for start, end in windows]

    rows = [row for found in two_at_once(rows_of, runs) for row in found]
    table = np.array(rows, dtype=np.float64).reshape(-1, 17)
    start, length, error, sigma, ratio, end = table[:, :6].T
    return Outages(
        start,
        length,
        error,
        sigma,
        ratio,
        end,
        table[:, 6:9],
        table[:, 9:12],
        table[:, 12:15],
        *table[:, 15:].T,
        *np.array(left, dtype=np.float64).reshape(-1, 2).T,
    )


def starts_of(estimate: Estimate, length_s: float) -> list[FloatArray]:
    """Return the starts of outages of a length, those of one run together."""
    times = estimate.result.plan.epoch_s
    period_s = length_s + max(APART_S, length_s)
    first_s, last_s = times[0] + LEAD_S, times[-1] - TAIL_S
    places = max(0.0, (last_s - first_s - length_s) / period_s)
    runs = int(np.clip(np.ceil(ENOUGH / max(1.0, places)), 1, MOST_RUNS))
    return [np.arange(first_s + run * period_s / runs, last_s - length_s, period_s) for run in range(runs)]


def _why_not(estimate: Estimate, start_s: float, end_s: float) -> Literal["", "no GNSS", "stands"]:
    """Return why an outage tells nothing; empty where it does.

    GNSS is not there in any case, or the vehicle hardly moves.
    """
    plan = estimate.result.plan
    inside = (plan.valid_s >= start_s) & (plan.valid_s < end_s)
    fixes = inside & (plan.seen.kind == POSITION)
    still = inside & (plan.seen.kind == STILL)
    if fixes.sum() < 2:
        return "no GNSS"
    return "stands" if still.sum() >= MOVING_SHARE * (end_s - start_s) else ""


def hidden(plan: Plan, windows: FloatArray) -> BoolArray:
    """Tell which measurements are not there in outages.

    GNSS, and the standstill that it showed.
    """
    at = np.searchsorted(windows[:, 0], plan.valid_s, side="right") - 1
    inside = (at >= 0) & (plan.valid_s < windows[np.maximum(at, 0), 1])
    return np.asarray(inside & np.isin(plan.seen.kind, (POSITION, VELOCITY, STILL, NO_RATE)))


def without(estimate: Estimate, windows: FloatArray) -> Pass:
    """Solve again without GNSS in windows of time, shape (w, 2).

    It is smoothed inside them, both ends included.
    """
    base, problem = estimate.result, estimate.problem
    times, gone = base.plan.epoch_s, hidden(base.plan, windows)
    wanted = np.zeros(len(times), dtype=bool)
    for first, end in zip(
        np.searchsorted(times, windows[:, 0]), np.searchsorted(times, windows[:, 1], side="right"), strict=True
    ):
        wanted[first:end] = True
    wanted[base.plan.epoch[gone]] = True  # a measurement is used at the end of its epoch
    variance = base.plan.seen.variance.copy()
    variance[gone] = np.nan
    plan = replace(base.plan, seen=base.plan.seen._replace(variance=variance))
    return run_pass(
        problem.samples,
        plan,
        problem.noise(estimate.model),
        estimate.gate,
        base.begun,
        known=base.linear,
        wanted=wanted,
    )


def _row(full: Pass, done: Pass, start_s: float, end_s: float, length_s: float) -> tuple[float, ...]:
    times = full.plan.epoch_s
    inside: Int64Array = np.flatnonzero((times >= start_s) & (times <= end_s))
    error = done.x[inside, :NAVIGATION] - full.x[inside, :NAVIGATION]
    size = np.hypot(error[:, 0], error[:, 1])
    worst = int(np.argmax(size))
    at, (n, e) = inside[worst], error[worst, :2]
    a, b, c = done.variance[at, 0], done.variance[at, 1], done.plane[at, 0]
    squared = (b * n * n - 2.0 * c * n * e + a * e * e) / max(a * b - c * c, 1e-12)
    down = np.abs(error[:, 2])
    lowest = int(np.argmax(down))
    middle, last = inside[len(inside) // 2], inside[-1]
    moving = done.x[middle, VEL:ATT] - full.x[middle, VEL:ATT]
    forward = done.solved.before[last, :2] - full.x[last, :2]
    return (
        start_s,
        length_s,  # end_s - start_s is another number by rounding
        float(size[worst]),
        float(np.sqrt(max(a + b, 1e-12))),
        float(np.sqrt(max(squared, 0.0) / CHI2_95_OF_2)),
        float(np.hypot(*forward)),
        *(moving / np.sqrt(np.maximum(done.variance[middle, VEL:ATT], 1e-12))).tolist(),
        *(done.x[last, ATT:NAVIGATION] - full.x[last, ATT:NAVIGATION]).tolist(),
        *np.maximum(done.variance[last, ATT:NAVIGATION] - full.variance[last, ATT:NAVIGATION], 0.0).tolist(),
        float(down[lowest]),
        float(down[lowest] / np.sqrt(max(done.variance[inside[lowest], 2], 1e-12)) / NORMAL_95),
    )
