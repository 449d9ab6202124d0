"""Direction of travel in the axes of the unit; what rolls does not slip."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.systems.trajectory.states import NO_SLIP, FloatArray

FASTER_MPS = 3.0
STRAIGHT_DPS = 3.0
EVERY_S = 1.0
LEAST_SAMPLES = 30  # seconds of straight travel
ROLLS_SCATTER_DEG = 2.5  # of the direction of travel in the unit: what flies or slides shows more
TURN_ARM_M = 1.0  # the unit's unknown place ahead of the axle: it moves sideways in turns


@dataclass(frozen=True)
class Travel:
    """Direction of travel in the axes of the unit, and its scatter.

    The scatter is the MAD sigma, deg.
    """

    yaw_rad: float
    pitch_rad: float
    yaw_scatter_deg: float
    pitch_scatter_deg: float
    samples: int

    @property
    def does_roll(self) -> bool:
        """Tell whether the direction is as constant as that of what rolls."""
        return self.samples >= LEAST_SAMPLES and max(self.yaw_scatter_deg, self.pitch_scatter_deg) < ROLLS_SCATTER_DEG


def velocity_in_unit(track: TrackOfStates) -> FloatArray:
    """Return velocity along the axes of the unit, shape (k, 3)."""
    r, p, h = (np.radians(one) for one in (track.roll_deg, track.pitch_deg, track.heading_deg))
    n, e, d = track.velocity_mps.T
    forward = n * np.cos(h) + e * np.sin(h)
    right = e * np.cos(h) - n * np.sin(h)
    x = forward * np.cos(p) - d * np.sin(p)
    down = forward * np.sin(p) + d * np.cos(p)
    return np.stack([x, right * np.cos(r) + down * np.sin(r), down * np.cos(r) - right * np.sin(r)], axis=1)


def turn_rate_dps(track: TrackOfStates) -> FloatArray:
    """Return the rate of the heading, shape (k,)."""
    if len(track) < 2:
        return np.zeros(len(track))
    heading = np.unwrap(np.radians(track.heading_deg))
    return np.asarray(np.degrees(np.gradient(heading, track.time_s)))


def direction_of_travel(track: TrackOfStates) -> Travel:
    """Return the direction of travel on straights."""
    v = velocity_in_unit(track)
    speed = np.linalg.norm(v, axis=1)
    straight = (speed > FASTER_MPS) & (np.abs(turn_rate_dps(track)) < STRAIGHT_DPS)
    seconds = float(straight.sum()) * float(np.median(np.diff(track.time_s))) if len(track) > 1 else 0.0
    if not straight.any():
        return Travel(0.0, 0.0, np.inf, np.inf, 0)
    unit = v[straight] / speed[straight, None]
    mean = np.median(unit, axis=0)
    yaw, pitch = np.arctan2(mean[1], mean[0]), -np.arcsin(np.clip(mean[2] / np.linalg.norm(mean), -1.0, 1.0))
    sideways = unit @ np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    upward = unit @ np.array([np.sin(pitch) * np.cos(yaw), np.sin(pitch) * np.sin(yaw), np.cos(pitch)])
    scatter = [1.4826 * float(np.median(np.abs(one - np.median(one)))) for one in (sideways, upward)]
    yaw_deg, pitch_deg = np.degrees(scatter).tolist()
    return Travel(float(yaw), float(pitch), yaw_deg, pitch_deg, int(seconds))


def observations_of(track: TrackOfStates) -> Observations:
    """Return no sideways and no upward velocity once a second of travel.

    The variance is in units of the model's: 1 plus what a turn adds.
    """
    speed = np.linalg.norm(track.velocity_mps[:, :2], axis=1)
    number = np.floor(track.time_s / EVERY_S)
    first = np.concatenate([[True], np.diff(number) > 0])
    at = np.flatnonzero(first & (speed > FASTER_MPS))
    count = len(at)
    turning = np.radians(turn_rate_dps(track)[at])
    variance = np.full((count, 3), np.nan)
    variance[:, 0] = 1.0 + (turning * TURN_ARM_M / 0.1) ** 2
    variance[:, 1] = 1.0
    value = np.full((count, 3), np.nan)
    value[:, :2] = 0.0
    return Observations(
        track.time_s[at],
        np.full(count, NO_SLIP, dtype=np.int64),
        value,
        variance,
        np.zeros(count, dtype=bool),
        np.zeros((count, 3)),
    )
