"""Checks of an estimate on its own log.

They are innovations, and the heading against the track.
"""

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.systems.trajectory.checks_answer import AgainstOwnTrack, InnovationRow
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.slip import FASTER_MPS, STRAIGHT_DPS, turn_rate_dps
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates
from groundstation.systems.trajectory.states import (
    HEADING,
    HEIGHT,
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
