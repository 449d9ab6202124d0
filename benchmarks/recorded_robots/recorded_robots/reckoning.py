"""Dead reckoning made from true poses.

It serves recorded sets that hold poses and ranges, and no inertial sensor.
"""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.simulation.processes import gauss_markov
from groundstation.tables.session import DeadReckoning
from recorded_robots.antennas import Poses


@dataclass(frozen=True)
class ReckoningErrors:
    """Sigmas of the errors added to the truth.

    They are start, velocity and height (Gauss-Markov), and a constant heading error.
    """

    position_m: float = 0.1
    velocity_mps: float = 0.05
    velocity_s: float = 30.0
    height_m: float = 0.05
    height_s: float = 100.0
    heading_deg: float = 1.0
    step_s: float = 0.1


def drifting_reckoning(
    poses: Poses, rng: np.random.Generator, errors: ReckoningErrors | None = None
) -> tuple[DeadReckoning, Poses]:
    """Return dead reckoning of one vehicle, and the poses that it believes in.

    The attitude of these poses has its heading error. Position is truth plus the integral of a Gauss-Markov velocity
    error; error = reading - truth.
    """
    errors = errors or ReckoningErrors()
    time_s = np.arange(poses.time_s[0], poses.time_s[-1], errors.step_s)
    true = np.column_stack([np.interp(time_s, poses.time_s, column) for column in poses.position_m.T])
    n = len(time_s)
    drift = gauss_markov(rng, (2, n), errors.step_s, errors.velocity_mps, errors.velocity_s).T
    moved = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (drift[1:] + drift[:-1]) * errors.step_s, axis=0)])
    position = true.copy()
    position[:, :2] += errors.position_m * rng.standard_normal(2) + moved
    position[:, 2] -= gauss_markov(rng, (n,), errors.step_s, errors.height_m, errors.height_s)
    velocity = np.gradient(true, time_s, axis=0)
    velocity[:, :2] += drift
    attitude = poses.attitude_deg + np.array([0.0, 0.0, errors.heading_deg * rng.standard_normal()])
    heading = np.interp(time_s, poses.time_s, attitude[:, 2])
    track = DeadReckoning(
        poses.name,
        time_s,
        position,
        velocity,
        np.broadcast_to(np.eye(3), (n, 3, 3)),
        np.full(n, np.nan),
        np.mod(heading, 360.0),
    )
    return track, replace(poses, attitude_deg=attitude)
