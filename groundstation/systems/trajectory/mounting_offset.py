"""Constant offset of the case to the travel of what rolls, with sigmas."""

from dataclasses import dataclass

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180

BLOCK_S = 30.0  # longer than errors of GNSS velocity and of tilt hang together
FEWEST_BLOCKS = 4
GAUSSIAN_MAD = 1.4826
MEDIAN_LOSS = 1.2533  # sigma of a median over that of a mean


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
