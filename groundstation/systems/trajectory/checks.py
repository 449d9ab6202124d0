"""Checks of an estimate on its own log.

They are innovations, GNSS held out, and the heading against the track.
"""

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.quantiles import NORMAL_95
from groundstation.systems.trajectory.checks_answer import AgainstOwnTrack, HeldOutRow, InnovationRow
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.outages import hidden, without
from groundstation.systems.trajectory.slip import FASTER_MPS, STRAIGHT_DPS, turn_rate_dps
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates
from groundstation.systems.trajectory.states import (
    HEADING,
    HEIGHT,
    KEPT_ROWS,
    NO_SLIP,
    POSITION,
    VELOCITY,
    WHEEL,
)

SENSORS = {
    POSITION: "GNSS position",
    VELOCITY: "GNSS velocity",
    NO_SLIP: "no sideways or upward motion",
    HEIGHT: "barometric height",
    HEADING: "magnetic heading",
    WHEEL: "wheel speed",
}
HELD_S, HELD_EVERY_S = 10.0, 100.0
BLOCK_S = 100.0
LEAST_IN_BLOCK, LEAST_BLOCKS = 10, 4
GAUSSIAN_MAD = 1.4826


def innovations_of(estimate: Estimate) -> tuple[InnovationRow, ...]:
    """Return the mean squared innovation of each sensor over what its covariance expects."""
    solved, kinds = estimate.result.solved, np.repeat(estimate.result.plan.seen.kind, 3)
    rows = []
    for kind, name in SENSORS.items():
        used = (solved.mark == 1) & (kinds == kind)
        if used.any():
            expected, low = solved.S[used], InnovationRow.low
            if kind == HEADING:  # an observation is as sure as stated; it has one error, which may be small
                low = 0.0
                stated = np.repeat(estimate.result.plan.seen.variance[:, :1], 3, axis=0)[used, 0]
                expected = expected - stated + estimate.problem.heading_sigma_rad**2
            ratio = float(np.mean(solved.y[used] ** 2 / expected))
            rows.append(InnovationRow(name, ratio, int(used.sum()), low))
    return tuple(rows)


def used_share(estimate: Estimate) -> float:
    """Return the share of the scalars of GNSS that the gate let in."""
    solved, kinds = estimate.result.solved, np.repeat(estimate.result.plan.seen.kind, 3)
    of = np.isin(kinds, (POSITION, VELOCITY)) & (solved.mark != 0)
    return float(np.mean(solved.mark[of] == 1)) if of.any() else 0.0


def held_out(estimate: Estimate) -> tuple[HeldOutRow, ...]:
    """Return what a solution without every tenth run of 10 s of GNSS says of that GNSS.

    The correction to the line is that of navigation and biases; the constants are those of the whole solution.
    """
    base = estimate.result
    times = base.plan.epoch_s
    starts = np.arange(times[0] + HELD_EVERY_S - HELD_S, times[-1] - HELD_S, HELD_EVERY_S)
    if not len(starts):
        return ()
    windows = np.column_stack([starts, starts + HELD_S])
    done = without(estimate, windows)
    away = hidden(base.plan, windows)
    noise = estimate.problem.noise(estimate.model)
    rows = []
    for kind, horizontal, vertical, unit in (
        (POSITION, "horizontal position", "vertical position", "m"),
        (VELOCITY, "horizontal velocity", "vertical velocity", "m/s"),
    ):
        m = np.flatnonzero(away & (base.plan.seen.kind == kind))
        for axes, quantity in (((0, 1), horizontal), ((2,), vertical)):
            at = (3 * m[:, None] + np.array(axes)).ravel()
            axis, of = np.tile(axes, len(m)), np.repeat(m, len(axes))
            z, variance = base.linear.z[at], base.plan.seen.variance[of, axis]
            columns, h = base.linear.columns[at], base.linear.h[at]
            near = columns < KEPT_ROWS
            e = base.plan.epoch[of][:, None]
            x = np.where(near, done.x[e, np.minimum(columns, KEPT_ROWS - 1)], 0.0)
            spread = np.where(near, done.variance[e, np.minimum(columns, KEPT_ROWS - 1)], 0.0)
            error = (h * x).sum(axis=1) - z
            expected = (h * h * spread).sum(axis=1) + variance
            if kind == POSITION:
                expected = expected + noise.variance[axis] + noise.variance[3 + axis]
            known = np.isfinite(z) & (np.abs(z) < 1e8) & np.isfinite(expected)
            if known.any():
                inside = np.abs(error[known]) <= NORMAL_95 * np.sqrt(expected[known])
                rows.append(
                    HeldOutRow(
                        quantity,  # type: ignore[arg-type]
                        unit,
                        int(known.sum()),
                        float(np.sqrt(np.mean(error[known] ** 2))),
                        float(np.sqrt(np.mean(expected[known]))),
                        float(np.mean(inside)),
                    )
                )
    return tuple(rows)


def against_own_track(track: TrackOfStates) -> AgainstOwnTrack | None:
    """Return how the heading stands to the track on straights, its mean apart.

    None where there are no straights.
    """
    speed = np.linalg.norm(track.velocity_mps[:, :2], axis=1)
    straight = (speed > 2.0 * FASTER_MPS) & (np.abs(turn_rate_dps(track)) < STRAIGHT_DPS)
    if straight.sum() < LEAST_IN_BLOCK:
        return None
    course = np.degrees(np.arctan2(track.velocity_mps[:, 1], track.velocity_mps[:, 0]))
    slip: FloatArray = np.asarray(wrap_180(track.heading_deg - course))[straight]
    centre = np.degrees(np.angle(np.mean(np.exp(1j * np.radians(slip)))))
    slip = np.asarray(wrap_180(slip - centre))
    slip = slip - np.median(slip)
    block = np.floor((track.time_s[straight] - track.time_s[0]) / BLOCK_S)
    medians = [np.median(slip[block == one]) for one in np.unique(block) if (block == one).sum() >= LEAST_IN_BLOCK]
    scatter = float(np.std(medians, ddof=1)) if len(medians) >= LEAST_BLOCKS else None
    return AgainstOwnTrack(int(straight.sum()), GAUSSIAN_MAD * float(np.median(np.abs(slip))), scatter)
