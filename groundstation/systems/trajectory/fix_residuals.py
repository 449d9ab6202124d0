"""Residuals of GNSS against the smoothed solution, and of fixes that were held out of it."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.arrays import TrajectoryResiduals
from groundstation.systems.trajectory.checks_answer import HeldOutRow
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.figures import rows_shown
from groundstation.systems.trajectory.observe import NO_ROW
from groundstation.systems.trajectory.outages import hidden, without
from groundstation.systems.trajectory.passes import Pass
from groundstation.systems.trajectory.quantity_answer import UNITS, Quantity
from groundstation.systems.trajectory.solution import FloatArray
from groundstation.systems.trajectory.states import KEPT_ROWS, MNT, POSITION, SLOW, VELOCITY

HELD_S, HELD_EVERY_S = 10.0, 100.0
OF_KIND: tuple[tuple[int, tuple[int, ...], Quantity], ...] = (
    (POSITION, (0, 1), "horizontal position"),
    (POSITION, (2,), "vertical position"),
    (VELOCITY, (0, 1), "horizontal velocity"),
    (VELOCITY, (2,), "vertical velocity"),
)


@dataclass(frozen=True)
class FixResiduals:
    """Residuals of the measurements of a segment, GNSS minus solution.

    Parameters
    ----------
    estimate : Estimate
    error : ndarray, shape (m, 3)
        Of a fix that was held out against the solution without it; NaN: absent.
    is_held_out : ndarray of bool, shape (m,)
    apart : Pass or None
        The solution without them; None where the log is too short.
    """

    estimate: Estimate
    error: FloatArray
    is_held_out: BoolArray
    apart: Pass | None


def residuals_of(estimate: Estimate) -> FixResiduals:
    """Return the residuals of a segment.

    Those of every tenth run of 10 s of GNSS are against a solution without it. The correction to the line is that of
    navigation and biases; the constants are those of the whole solution.
    """
    done = estimate.result
    times = done.plan.epoch_s
    starts = np.arange(times[0] + HELD_EVERY_S - HELD_S, times[-1] - HELD_S, HELD_EVERY_S)
    error, away = _errors(done, done.x), np.zeros(len(done.plan.seen.kind), dtype=bool)
    if not len(starts):
        return FixResiduals(estimate, error, away, None)
    windows = np.column_stack([starts, starts + HELD_S])
    apart, away = without(estimate, windows), hidden(done.plan, windows)
    error[away] = _errors(done, apart.x)[away]
    return FixResiduals(estimate, error, away, apart)


def _errors(done: Pass, navigation: FloatArray) -> FloatArray:
    """Return measured minus predicted with corrections of navigation and biases, shape (m, 3)."""
    linear, epoch = done.linear, done.plan.epoch
    x = np.tile(done.constants - linear.value[-1], (len(done.plan.epoch_s), 1))
    x[:, :KEPT_ROWS] = navigation
    x[:, SLOW:MNT] = 0.0
    predicted = (linear.h * np.take_along_axis(x[np.repeat(epoch, 3)], linear.columns, axis=1)).sum(axis=1)
    return np.asarray(np.where(np.abs(linear.z) < 0.5 * NO_ROW, linear.z - predicted, np.nan).reshape(-1, 3))


def held_out_rows(found: FixResiduals) -> tuple[HeldOutRow, ...]:
    """Return what the solution without some GNSS says of it, beside the GNSS that it used."""
    if found.apart is None:
        return ()
    base, apart, done = found.estimate.result, found.apart, found.estimate
    noise, kinds, used = done.problem.noise(done.model), base.plan.seen.kind, _used(base)
    rows = []
    for kind, axes, quantity in OF_KIND:
        m = np.flatnonzero(found.is_held_out & (kinds == kind))
        at = (3 * m[:, None] + np.array(axes)).ravel()
        axis, of = np.tile(axes, len(m)), np.repeat(m, len(axes))
        columns, h = base.linear.columns[at], base.linear.h[at]
        near, epoch = columns < KEPT_ROWS, base.plan.epoch[of][:, None]
        spread = np.where(near, apart.variance[epoch, np.minimum(columns, KEPT_ROWS - 1)], 0.0)
        expected = (h * h * spread).sum(axis=1) + base.plan.seen.variance[of, axis]
        if kind == POSITION:
            expected = expected + noise.variance[axis] + noise.variance[3 + axis]
        error = found.error[of, axis]
        known = np.isfinite(error) & np.isfinite(expected)
        beside = found.error[~found.is_held_out & used & (kinds == kind)][:, axes]
        beside = beside[np.isfinite(beside)]
        if known.any():
            inside = np.abs(error[known]) <= NORMAL_95 * np.sqrt(expected[known])
            rows.append(
                HeldOutRow(
                    quantity,
                    UNITS[quantity],
                    int(known.sum()),
                    float(np.sqrt(np.mean(error[known] ** 2))),
                    float(np.sqrt(np.mean(expected[known]))),
                    float(np.mean(inside)),
                    float(np.sqrt(np.mean(beside**2))) if len(beside) else None,
                    len(beside),
                )
            )
    return tuple(rows)


def _used(done: Pass) -> BoolArray:
    """Tell which measurements were used, each by any of its scalars."""
    return np.asarray(done.solved.mark.reshape(-1, 3).max(axis=1) == 1)


def residuals_figure(every: list[FixResiduals]) -> TrajectoryResiduals:
    """Return GNSS minus the smoothed solution at the antenna."""
    parts = [_by_fix(one) for one in every]
    time_s, place, moving, used, held = (np.concatenate([part[i] for part in parts]) for i in range(5))
    rows = rows_shown(time_s)
    return TrajectoryResiduals(
        time_s=time_s[rows],
        position_north_m=place[rows, 0],
        position_east_m=place[rows, 1],
        position_down_m=place[rows, 2],
        velocity_north_mps=moving[rows, 0],
        velocity_east_mps=moving[rows, 1],
        velocity_down_mps=moving[rows, 2],
        is_used=used[rows],
        is_held_out=held[rows],
    )


def _by_fix(found: FixResiduals) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray, BoolArray]:
    """Return times, residuals of position and of the nearest velocity, used, held out."""
    done = found.estimate.result
    kind, valid_s = done.plan.seen.kind, done.plan.valid_s
    position, velocity = np.flatnonzero(kind == POSITION), np.flatnonzero(kind == VELOCITY)
    beside = np.full((len(position), 3), np.nan)
    if len(velocity):
        near = np.clip(np.searchsorted(valid_s[velocity], valid_s[position]), 0, len(velocity) - 1)
        before = np.maximum(near - 1, 0)
        closer = np.abs(valid_s[velocity[before]] - valid_s[position]) < np.abs(
            valid_s[velocity[near]] - valid_s[position]
        )
        beside = found.error[velocity[np.where(closer, before, near)]]
    held = found.is_held_out[position]
    return valid_s[position], found.error[position], beside, _used(done)[position] & ~held, held
