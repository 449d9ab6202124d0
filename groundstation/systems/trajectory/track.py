"""States over time from a pass: smoothed, or as the filter had them."""

from dataclasses import fields, replace

import numpy as np

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import Int64Array
from groundstation.systems.trajectory.layout import Samples, output_samples
from groundstation.systems.trajectory.model import DEG
from groundstation.systems.trajectory.passes import Pass, turned
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.systems.trajectory.states import ATT, NAVIGATION, VEL, FloatArray

LEAST_LEVEL = 0.05  # cosine of the pitch where heading and roll still have a sigma of their own


def smoothed_track(samples: Samples, one: Pass, at: Int64Array | None = None, *, segment: int = 0) -> TrackOfStates:
    """Return the smoothed states at samples ``at``.

    The correction at the end of each epoch, and at the start of the next, is that of the smoother; between them it
    grows in a straight line.
    """
    at = output_samples(samples, int(one.plan.schedule.first[0])) if at is None else at
    epoch, share = _place(samples, one, at)
    ends = one.x[:, :NAVIGATION]
    begins = ends - one.linear.closed[:, :NAVIGATION]
    correction = begins[epoch - 1] * (1.0 - share) + ends[epoch] * share
    variance = np.maximum(one.variance, 0.0)
    spread = variance[epoch - 1] * (1.0 - share) + variance[epoch] * share
    tilt = one.plane[epoch - 1, 1:] * (1.0 - share) + one.plane[epoch, 1:] * share
    return _states(samples, one, at, correction, spread[:, :NAVIGATION], tilt[:, 0], segment)


def forward_track(samples: Samples, one: Pass, at: Int64Array | None = None, *, segment: int = 0) -> TrackOfStates:
    """Return the states of the filter, which knows the past alone."""
    at = output_samples(samples, int(one.plan.schedule.first[0])) if at is None else at
    epoch, share = _place(samples, one, at)
    before = one.before_variance
    after = one.solved.variance[:, :NAVIGATION]
    spread = after[epoch - 1] * (1.0 - share) + before[epoch] * share
    begins = (one.solved.after - one.linear.closed)[:, :NAVIGATION]
    correction = begins[epoch - 1] * (1.0 - share) + one.solved.before[epoch, :NAVIGATION] * share
    tilt = one.solved.tilt[epoch - 1, 1:] * (1.0 - share) + one.solved.tilt[epoch, :1] * share
    return _states(samples, one, at, correction, spread, tilt[:, 0], segment)


def _place(samples: Samples, one: Pass, at: Int64Array) -> tuple[Int64Array, FloatArray]:
    """Return the epoch that each sample leads to, and its place in it, shape (k, 1)."""
    epoch = np.searchsorted(one.plan.schedule.first[1:], at, side="right")
    start, end = one.plan.epoch_s[epoch - 1], one.plan.epoch_s[epoch]
    return epoch, ((samples.time_s[at] - start) / np.maximum(end - start, 1e-9))[:, None]


def _states(
    samples: Samples,
    one: Pass,
    at: Int64Array,
    correction: FloatArray,
    variance: FloatArray,
    tilt: FloatArray,
    segment: int,
) -> TrackOfStates:
    nav = one.linear.nav[one.plan.schedule.slot[at]]
    north, east = curvature_radii_m(np.degrees(nav[:, 0]))
    latitude = nav[:, 0] + correction[:, 0] / (north + nav[:, 2])
    longitude = nav[:, 1] + correction[:, 1] / ((east + nav[:, 2]) * np.cos(nav[:, 0]))
    roll, pitch, heading = angles_of(turned(nav[:, 6:], correction[:, ATT:NAVIGATION]))
    sigma = np.sqrt(variance)
    return TrackOfStates(
        samples.time_s[at],
        np.full(len(at), segment, dtype=np.int64),
        np.degrees(latitude),
        wrap_180(np.degrees(longitude)),
        nav[:, 2] - correction[:, 2],
        nav[:, 3:6] + correction[:, VEL:ATT],
        np.degrees(roll),
        np.degrees(pitch),
        wrap_360(np.degrees(heading)),
        sigma[:, :3],
        sigma[:, VEL:ATT],
        _attitude_sigma(pitch, heading, variance[:, ATT:NAVIGATION], tilt) / DEG,
    )


def angles_of(quaternion: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch and heading, rad, of quaternions n from b (wxyz), shape (n, 4)."""
    w, x, y, z = quaternion.T
    roll = np.arctan2(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    pitch = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
    heading = np.arctan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)
    return roll, pitch, heading


def _attitude_sigma(
    pitch: FloatArray, heading: FloatArray, variance: FloatArray, north_with_east: FloatArray
) -> FloatArray:
    """Return sigmas of roll, pitch and heading from those of the rotation vector in n.

    Its vertical part is taken as uncorrelated with the others.
    """
    c, s = np.cos(heading) ** 2, np.sin(heading) ** 2
    both = np.sin(2.0 * heading) * north_with_east
    along = np.maximum(c * variance[:, 0] + s * variance[:, 1] + both, 0.0)
    across = np.maximum(s * variance[:, 0] + c * variance[:, 1] - both, 0.0)
    level = np.maximum(np.cos(pitch), LEAST_LEVEL)
    roll = along / level**2
    return np.asarray(np.sqrt(np.stack([roll, across, variance[:, 2] + np.tan(np.arccos(level)) ** 2 * along], axis=1)))


def joined(parts: list[TrackOfStates]) -> TrackOfStates:
    """Return the tracks of several segments as one."""
    first = parts[0]
    return replace(
        first,
        **{item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(TrackOfStates)},
    )
