"""Constant offsets: of the case to the travel, of an on-board filter to our attitude.

A constant offset is mounting: how a case stands to the body, or how a filter's axes stand to the case. It is never
counted as error of a filter.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.records import frozen
from groundstation.systems.trajectory.axis_hypotheses import rotations
from groundstation.systems.trajectory.axis_turns import angles_of

BLOCK_S = 30.0  # longer than errors of GNSS velocity and of tilt hang together
FEWEST_BLOCKS = 4
GAUSSIAN_MAD = 1.4826
MEDIAN_LOSS = 1.2533  # sigma of a median over that of a mean
ROUNDS = 20
LARGE = 3.0  # sigmas of a robust spread, beyond which a sample counts less


@dataclass(frozen=True)
class TravelOffset:
    """Yaw and pitch of the case to the travel of what rolls; NaN where not seen.

    Parameters
    ----------
    yaw_deg, yaw_sigma_deg : float
        Heading of the case minus track.
    pitch_deg, pitch_sigma_deg : float
        Pitch of the case minus slope of the path.
    blocks : int
        Stretches that were independent.
    seconds : float
        Time on straights at speed.
    """

    yaw_deg: float
    yaw_sigma_deg: float
    pitch_deg: float
    pitch_sigma_deg: float
    blocks: int
    seconds: float


def travel_offset(
    time_s: FloatArray,
    heading_deg: FloatArray,
    pitch_deg: FloatArray,
    velocity_mps: FloatArray,
    *,
    speed_min_mps: float = 5.0,
    turn_rate_max_dps: float = 1.0,
) -> TravelOffset:
    """Return the constant yaw and pitch of the case to the travel, from straights at speed.

    Parameters
    ----------
    time_s, heading_deg, pitch_deg : ndarrays, shape (n,)
        Attitude of the case, in order of time.
    velocity_mps : ndarray, shape (n, 3)
        North, east, down, at the same times.
    speed_min_mps, turn_rate_max_dps : float
        What is slower, or turns faster, tells nothing: a car slips to the side in turns.

    Notes
    -----
    Medians of stretches of 30 s, and their median; its sigma is from the scatter of the stretches, and is as good as
    these are independent. Braking and gusts average out; a camber that is the same on all roads does not.
    """
    speed = np.hypot(velocity_mps[:, 0], velocity_mps[:, 1])
    track = np.rad2deg(np.arctan2(velocity_mps[:, 1], velocity_mps[:, 0]))
    slope = np.rad2deg(np.arctan2(-velocity_mps[:, 2], np.maximum(speed, 1e-9)))
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = np.abs(wrap_180(np.diff(heading_deg)) / np.diff(time_s))
    calm = np.ones(len(time_s), dtype=bool)
    calm[1:] &= rate <= turn_rate_max_dps
    calm[:-1] &= rate <= turn_rate_max_dps
    used = calm & (speed >= speed_min_mps) & np.isfinite(heading_deg) & np.isfinite(pitch_deg)
    each_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    yaw = wrap_180(heading_deg - track)
    centre = _centre(yaw[used])
    yaws = _blocks(time_s[used], centre + wrap_180(yaw[used] - centre))
    pitches = _blocks(time_s[used], (pitch_deg - slope)[used])
    return TravelOffset(
        *_median_and_sigma(yaws, is_angle=True), *_median_and_sigma(pitches), len(yaws), each_s * int(used.sum())
    )


def _centre(angles_deg: FloatArray) -> float:
    """Return the direction of the mean of unit vectors, degrees; 0 without angles."""
    if not len(angles_deg):
        return 0.0
    rad = np.deg2rad(angles_deg)
    return float(np.rad2deg(np.arctan2(np.sin(rad).mean(), np.cos(rad).mean())))


def _blocks(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Return the medians of stretches of time with enough samples."""
    if not len(time_s):
        return np.zeros(0)
    _, place, counts = np.unique(np.floor((time_s - time_s[0]) / BLOCK_S), return_inverse=True, return_counts=True)
    enough = np.flatnonzero(counts >= max(3.0, 0.2 * counts.max()))
    return np.array([np.median(values[place == one]) for one in enough])


def _median_and_sigma(blocks: FloatArray, *, is_angle: bool = False) -> tuple[float, float]:
    if len(blocks) < FEWEST_BLOCKS:
        return float("nan"), float("nan")
    middle = float(np.median(blocks))
    spread = GAUSSIAN_MAD * float(np.median(np.abs(blocks - middle)))
    sigma = MEDIAN_LOSS * spread / float(np.sqrt(len(blocks)))
    return (float(wrap_180(middle)) if is_angle else middle), sigma


@dataclass(frozen=True)
class SplitAttitude:
    """Attitude of a filter against ours: a constant offset, which is mounting, and the rest.

    Parameters
    ----------
    offset_deg, offset_sigma_deg : ndarrays, shape (3,)
        Roll, pitch and yaw of the filter's axes to ours, constant in the body, and their sigmas; the offset is zero and
        the sigmas NaN where there are too few stretches.
    rest_deg : ndarray, shape (n, 3)
        What remains in roll, pitch and heading, filter minus ours; NaN where either is unknown.
    """

    offset_deg: FloatArray
    offset_sigma_deg: FloatArray
    rest_deg: FloatArray


def split_attitude(time_s: FloatArray, onboard_deg: FloatArray, ours_deg: FloatArray) -> SplitAttitude:
    """Split the attitude of a filter against ours into a constant offset and the rest.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    onboard_deg, ours_deg : ndarrays, shape (n, 3)
        Roll, pitch, heading at the same times.

    Notes
    -----
    With n_from_filter = n_from_ours M, the offset is the constant M, found as the robust mean of the rotations
    (weights of Huber about the mean, iterated), and the rest is between n_from_filter M' and n_from_ours. On level
    ground a constant error of heading looks the same as a yaw of the mounting: it is taken for mounting.
    """
    known = np.isfinite(onboard_deg).all(axis=1) & np.isfinite(ours_deg).all(axis=1)
    rest = np.full((len(time_s), 3), np.nan)
    if not known.any():
        return SplitAttitude(frozen(np.zeros(3)), frozen(np.full(3, np.nan)), frozen(rest))
    filters, ours = rotation_n_from_b(onboard_deg[known]), rotation_n_from_b(ours_deg[known])
    between = np.swapaxes(ours, 1, 2) @ filters
    mean, sigma = _mean_rotation(time_s[known], between)
    corrected = angles_of(filters @ mean.T)
    rest[known] = wrap_180(corrected - angles_of(ours))
    return SplitAttitude(frozen(angles_of(mean)), frozen(sigma), frozen(rest))


def _mean_rotation(time_s: FloatArray, between: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the robust mean of rotations, and sigmas of its vector in degrees.

    The identity where there is too little of them.
    """
    mean = _nearest_rotation(between.mean(axis=0))
    for _ in range(ROUNDS):
        vectors = _vectors(mean.T @ between)
        size = np.linalg.norm(vectors, axis=1)
        limit = LARGE * GAUSSIAN_MAD * float(np.median(size)) + 1e-12
        weight = np.minimum(1.0, limit / np.maximum(size, 1e-15))
        step = (weight[:, None] * vectors).sum(axis=0) / weight.sum()
        mean = mean @ rotations(step)
        if float(np.linalg.norm(step)) < 1e-10:
            break
    vectors = np.rad2deg(_vectors(mean.T @ between))
    each = [_blocks(time_s, vectors[:, k]) for k in range(3)]
    if len(each[0]) < FEWEST_BLOCKS:
        return np.eye(3), np.full(3, np.nan)
    return mean, np.array([_median_and_sigma(one)[1] for one in each])


def _nearest_rotation(matrix: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(matrix)
    fix = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(left @ right)))])
    found: FloatArray = left @ fix @ right
    return found


def _vectors(rotation: FloatArray) -> FloatArray:
    """Return rotation vectors, shape (n, 3), in radians, of rotations below a half turn."""
    cross = 0.5 * np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    cosine = np.clip(0.5 * (np.einsum("nii->n", rotation) - 1.0), -1.0, 1.0)
    sine = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(sine, cosine)
    factor = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-12), 1.0)
    found: FloatArray = cross * factor[:, None]
    return found
