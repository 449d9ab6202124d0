"""Axes of an on-board filter against ours, by how both see the vehicle turn.

The filter tells ``E @ ours @ T``: E is its error in the navigation frame, T the turn of its axes against ours. The
increments of attitude are ``T.T @ increment @ T``: an error that stays drops out of them. So a roll or a pitch
shows the yaw of T, whatever the filter's heading is; a vehicle that only yaws leaves it open. A tilt that is wrong by a
constant in the body cannot be told from T: of tilt only an autopilot's own axes are known.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.onboard_offsets import euler_deg
from groundstation.systems.trajectory.onboard_output import FEWEST, FilterOutput
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates

LAG_S = 1.0  # of an increment
BLOCK_S = 60.0  # blocks whose even and odd ones are compared
STEPS = 6
FLOOR_DEG = 0.3  # squareness of two units, and what a filter's errors have in common with the motion
OWN_SIGMA_DEG = 1.0  # an autopilot's axes against those of its own samples: the level of its board
Places = NDArray[np.intp]
OPEN = 1e-9  # information, 1/rad2, so small that nothing is known


@dataclass(frozen=True)
class FilterAxes:
    """Turn of the filter's axes against ours.

    Parameters
    ----------
    turn : ndarray, shape (3, 3)
        b from c: ``theirs = error @ ours @ turn``.
    sigma_deg : ndarray, shape (3,)
        About roll, pitch and yaw; infinite where nothing tells it.
    """

    turn: FloatArray
    sigma_deg: FloatArray

    def errors_deg(self, ours: TrackOfStates, output: FilterOutput) -> FloatArray:
        """Return errors of roll, pitch and heading with nothing taken off, shape (n, 3)."""
        mine = np.column_stack([ours.roll_deg, ours.pitch_deg, ours.heading_deg])
        error = output.attitude_deg - euler_deg(rotation_n_from_b(mine) @ self.turn)
        if np.isfinite(self.sigma_deg[0]):
            error[:, :2] = (output.attitude_deg - mine)[:, :2]
        return np.asarray(wrap_180(error))


def axes_of(ours: TrackOfStates, output: FilterOutput, *, is_own: bool) -> FilterAxes | None:
    """Find the axes of a filter by increments of both attitudes over a second.

    Parameters
    ----------
    ours : TrackOfStates
        At the times of ``output``.
    output : FilterOutput
    is_own : bool
        The filter is the autopilot's own, and so are the samples: their axes are the same to 1 deg.

    Returns
    -------
    FilterAxes, or None where an angle is not logged.

    Notes
    -----
    Weighted fit of one rotation to two sets of vectors, outliers held back (G. Wahba, A least squares estimate of
    satellite attitude, SIAM Review 7, 1965; solved by singular values, Markley 1988). Its sigma is by the residuals,
    and by the difference between even and odd minutes.
    """
    mine = np.column_stack([ours.roll_deg, ours.pitch_deg, ours.heading_deg])
    known = np.isfinite(mine).all(axis=1) & np.isfinite(output.attitude_deg).all(axis=1)
    if known.sum() < FEWEST:
        return None
    time_s = output.time_s[known]
    before, after = _pairs(time_s)
    if len(before) < FEWEST:
        return None
    turned = _increments(rotation_n_from_b(mine[known]), before, after)
    seen = _increments(rotation_n_from_b(output.attitude_deg[known]), before, after)
    prior = np.deg2rad(OWN_SIGMA_DEG) ** -2 if is_own else OPEN
    turn, covariance = _fitted(turned, seen, prior)
    is_even = np.floor(time_s[before] / BLOCK_S) % 2 == 0
    apart = np.zeros(3)
    if min(is_even.sum(), (~is_even).sum()) >= FEWEST:
        halves = [_fitted(turned[part], seen[part], prior)[0] for part in (is_even, ~is_even)]
        apart = np.deg2rad(euler_deg((halves[0].T @ halves[1])[None])[0]) / 2.0
    yaw_deg = float(np.rad2deg(np.sqrt(covariance[2, 2] + apart[2] ** 2 + np.deg2rad(FLOOR_DEG) ** 2)))
    tilt_deg = OWN_SIGMA_DEG if is_own else np.inf
    return FilterAxes(turn, np.array([tilt_deg, tilt_deg, yaw_deg]))


def _pairs(time_s: FloatArray) -> tuple[Places, Places]:
    """Return the ends of increments that do not overlap, none over a gap."""
    number = np.floor((time_s - time_s[0]) / LAG_S)
    first = np.flatnonzero(np.diff(number, prepend=-1.0) > 0)
    before, after = first[:-1], first[1:]
    near = time_s[after] - time_s[before] < 1.5 * LAG_S
    return before[near], after[near]


def _increments(n_from_b: FloatArray, before: Places, after: Places) -> FloatArray:
    """Return rotation vectors of the steps, in the axes of the body, rad, shape (n, 3)."""
    step = np.einsum("nji,njk->nik", n_from_b[before], n_from_b[after])
    twice = np.column_stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]]
    )
    sine = 0.5 * np.linalg.norm(twice, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(step, axis1=1, axis2=2) - 1.0))
    return np.asarray(0.5 * twice * (angle / np.maximum(sine, 1e-12))[:, None])


def _fitted(ours: FloatArray, theirs: FloatArray, prior: float) -> tuple[FloatArray, FloatArray]:
    """Return the turn of ``ours = turn @ theirs`` and its covariance, rad2.

    The latter is about the axes of theirs.
    """
    weight, variance, turn = np.ones(len(ours)), 1.0, np.eye(3)
    information = np.eye(3)
    for _ in range(STEPS):
        joint = np.einsum("n,ni,nj->ij", weight, ours, theirs) / variance + 0.5 * prior * np.eye(3)
        left, _sizes, right = np.linalg.svd(joint)
        turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        rest = np.linalg.norm(ours - theirs @ turn.T, axis=1)
        variance = max((float(np.median(rest)) / 1.5382) ** 2, 1e-14)  # the median of a length in space, in sigmas
        weight = np.clip(3.0 * np.sqrt(variance) / np.maximum(rest, 1e-12), 0.0, 1.0) ** 2
        information = turn.T @ _information(ours, weight, variance) @ turn + prior * np.eye(3)
    return turn, np.asarray(np.linalg.inv(information + OPEN * np.eye(3)), dtype=np.float64)


def _information(ours: FloatArray, weight: FloatArray, variance: float) -> FloatArray:
    """Return what increments say of a turn about each axis, 1/rad2.

    Noise as large as the residuals says nothing.
    """
    sizes, axes = np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, ours, ours) / variance)
    sizes = np.maximum(sizes - weight.sum(), 0.0)
    across = axes @ np.diag(sizes) @ axes.T
    return np.asarray(np.trace(across) * np.eye(3) - across)
