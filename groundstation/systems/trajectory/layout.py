"""Lay out a pass: samples with their gaps filled, epochs, measurements in their order."""

from functools import cached_property

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.states import VELOCITY, FloatArray, Imu, Schedule, Seen

LONGEST_EPOCH_S = 0.2  # the transition is linear over it
GAP_SHARE = 0.5  # of an interval: a sample that begins so much later than the last ended has a gap before it
OUTPUT_HZ = 20.0  # of states
MEAN_S = 0.2  # vibration is averaged away, manoeuvres are not


@dataclass(frozen=True)
class Samples:
    """Increments as the loops take them, gaps filled by made samples.

    ``time_s`` is the end of each; the first begins at ``begin_s``. ``is_made`` marks those that fill a gap.
    """

    time_s: FloatArray
    imu: Imu
    begin_s: float
    is_made: FloatArray


def fill_gaps(imu: ImuIncrements) -> Samples:
    """Return the increments with a made sample in each gap.

    It is the mean of its neighbours, opened by their spread.
    """
    missing = np.diff(imu.time_s) - imu.interval_s[1:]
    at = np.flatnonzero(missing > GAP_SHARE * imu.interval_s[1:]) + 1
    gap_s = missing[at - 1]
    rate, force = (one / imu.interval_s[:, None] for one in (imu.delta_angle_rad, imu.delta_velocity_mps))
    spread = [float(np.sqrt(np.mean((one - np.median(one, axis=0)) ** 2))) for one in (rate, force)]
    made = [0.5 * (one[at - 1] + one[at]) * gap_s[:, None] for one in (rate, force)]
    zero = np.zeros(len(imu))

    def joined(values: FloatArray, filled: FloatArray) -> FloatArray:
        return np.ascontiguousarray(np.insert(values, at, filled, axis=0))

    loops = Imu(
        joined(imu.interval_s, gap_s),
        joined(imu.delta_angle_rad, made[0]),
        joined(imu.delta_velocity_mps, made[1]),
        joined(zero, (spread[0] * gap_s) ** 2),
        joined(zero, (spread[1] * gap_s) ** 2),
    )
    time_s = joined(imu.time_s, imu.time_s[at] - imu.interval_s[at])
    return Samples(time_s, loops, float(imu.time_s[0] - imu.interval_s[0]), joined(zero, np.ones(len(at))))


def means_about(samples: Samples, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return angular rate and specific force about each time, shapes (m, 3).

    They are means over ``MEAN_S``.
    """
    ends = np.concatenate([[samples.begin_s], samples.time_s])
    lowest, highest = time_s - 0.5 * MEAN_S, time_s + 0.5 * MEAN_S
    at = [np.clip(np.searchsorted(ends, edge), 0, len(ends) - 1) for edge in (lowest, highest)]
    at[0] = np.minimum(at[0], len(ends) - 2)
    at[1] = np.maximum(at[1], at[0] + 1)
    length_s = np.concatenate([[0.0], np.cumsum(samples.imu.interval_s)])
    span_s = (length_s[at[1]] - length_s[at[0]])[:, None]
    found = []
    for values in (samples.imu.angle, samples.imu.velocity):
        total = np.concatenate([np.zeros((1, 3)), np.cumsum(values, axis=0)])
        found.append(np.ascontiguousarray((total[at[1]] - total[at[0]]) / span_s))
    return found[0], found[1]


@dataclass(frozen=True)
class Plan:
    """Epochs of a pass, and its measurements in their order.

    Epoch 0 has no samples: it is the start.
    """

    schedule: Schedule
    seen: Seen
    order: Int64Array  # of the observations, as the pass uses them
    epoch_s: FloatArray

    @cached_property
    def epoch(self) -> Int64Array:
        """Epoch of each measurement, shape (m,)."""
        return np.repeat(np.arange(len(self.epoch_s)), np.diff(self.schedule.seen))

    @cached_property
    def valid_s(self) -> FloatArray:
        """Time of validity of each measurement, shape (m,)."""
        return np.asarray(self.epoch_s[self.epoch] - self.seen.back_s)


def output_samples(samples: Samples, first: int, rate_hz: float = OUTPUT_HZ) -> Int64Array:
    """Return the samples from ``first`` on at which states are given: at most ``rate_hz``."""
    step = np.floor((samples.time_s[first:] - samples.time_s[first]) * rate_hz + 1e-6)
    return np.flatnonzero(np.concatenate([[True], np.diff(step) > 0.0])) + first


def _slots(samples: Samples, first: Int64Array, ends: Int64Array) -> Int64Array:
    """Return the row that keeps the estimate after each sample.

    At ends of epochs and where states are given.
    """
    is_kept = np.zeros(len(samples.time_s), dtype=bool)
    is_kept[ends - 1] = True
    is_kept[output_samples(samples, int(first[0]))] = True
    return np.where(is_kept, np.cumsum(is_kept) - 1, -1).astype(np.int64)


def lay_out(samples: Samples, seen_at: Observations, begin_s: float, latency_s: float, lag_s: float = 0.0) -> Plan:
    """Lay out the epochs from ``begin_s`` on.

    GNSS is shifted by its latency, its velocities by their lag as well.
    """
    first_sample = int(np.searchsorted(samples.time_s, begin_s, side="right"))
    start_s = samples.time_s[first_sample - 1] if first_sample else samples.begin_s
    late_s = latency_s + np.where(seen_at.kind == VELOCITY, lag_s, 0.0)
    valid_s = seen_at.time_s - np.where(seen_at.is_gnss, late_s, 0.0)
    inside = (valid_s >= start_s) & (valid_s <= samples.time_s[-1])
    order = np.flatnonzero(inside)[np.argsort(valid_s[inside], kind="stable")]
    sample = np.searchsorted(samples.time_s[first_sample:], valid_s[order], side="left") + first_sample
    count = len(samples.time_s)
    grid = np.arange(samples.time_s[first_sample], samples.time_s[-1], LONGEST_EPOCH_S)
    regular = np.searchsorted(samples.time_s, grid, side="left")
    ends = np.unique(np.concatenate([sample + 1, regular + 1, [count]]))
    ends = ends[ends > first_sample]
    at_start = valid_s[order] <= start_s
    epoch = np.where(at_start, 0, np.searchsorted(ends, sample + 1) + 1)
    first = np.concatenate([[first_sample, first_sample], ends])
    epoch_s = np.concatenate([[start_s], samples.time_s[ends - 1]])
    seen = np.searchsorted(epoch, np.arange(len(epoch_s) + 1))
    back_s = epoch_s[epoch] - valid_s[order]
    return Plan(
        Schedule(first.astype(np.int64), seen.astype(np.int64), _slots(samples, first, ends)),
        Seen(
            np.ascontiguousarray(seen_at.kind[order]),
            np.ascontiguousarray(back_s),
            np.ascontiguousarray(seen_at.value[order]),
            np.ascontiguousarray(seen_at.variance[order]),
            *means_about(samples, valid_s[order]),
        ),
        order,
        epoch_s,
    )
