"""Standstill of a vehicle, from GNSS and from how quiet the inertial unit is."""

import numpy as np

from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import GnssFixes
from groundstation.systems.trajectory.layout import Samples
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.states import NO_RATE, STILL, FloatArray

WINDOW_S = 1.0
STANDS_MPS = 0.3  # GNSS shows less
QUIET = 3.0  # of the unit's quietest windows
QUIETEST_SHARE = 0.05
SHAKES_DPS, SHAKES_MPS2 = 1.0, 0.5  # what shakes more is in the air, or its engine is not to be trusted
EDGE_S = 2.0  # at both ends of a standstill the vehicle may be moving already
STILL_MPS, STILL_DPS = 0.02, 0.03


def windows_of(samples: Samples) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the middles of windows, mean rates, spreads of rate and of force.

    Shapes (w,), (w, 3), (w,), (w,).
    """
    number = np.floor((samples.time_s - samples.time_s[0]) / WINDOW_S).astype(np.int64)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(number) > 0]))
    count = np.diff(np.append(starts, len(number)))[:, None]
    found = []
    for values in (samples.imu.angle, samples.imu.velocity):
        rate = values / samples.imu.interval_s[:, None]
        mean = np.add.reduceat(rate, starts, axis=0) / count
        spread = np.add.reduceat((rate - np.repeat(mean, count[:, 0], axis=0)) ** 2, starts, axis=0) / count
        found += [mean, np.sqrt(spread.max(axis=1))]
    middle = np.add.reduceat(samples.time_s, starts) / count[:, 0]
    return middle, found[0], found[1], found[3]


def still_windows(
    samples: Samples, gnss: GnssFixes, latency_s: float, *, may_stop: bool
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return the windows' middles, where the vehicle stands still, and the mean rates.

    Parameters
    ----------
    may_stop : bool
        True of what rolls, walks or floats: it may stand still anywhere. What flies stands before its first and after
        its last motion alone: a hover is quiet too.
    """
    middle, rate, shakes, jolts = windows_of(samples)
    motion = motion_of(gnss)
    speed = np.linalg.norm(np.nan_to_num(motion[:, :2]), axis=1)
    known = np.isfinite(motion[:, :2]).all(axis=1)
    moving = (
        np.interp(middle, gnss.time_s[known] - latency_s, speed[known]) if known.any() else np.full(len(middle), np.inf)
    )
    slow = moving < STANDS_MPS
    if slow.sum() < 3:
        return middle, np.zeros(len(middle), dtype=bool), rate
    limits = [
        min(QUIET * float(np.quantile(spread[slow], QUIETEST_SHARE)), most)
        for spread, most in ((shakes, SHAKES_DPS * np.pi / 180.0), (jolts, SHAKES_MPS2))
    ]
    quiet = slow & (shakes <= limits[0]) & (jolts <= limits[1])
    usual = np.median(rate[quiet], axis=0) if quiet.any() else np.zeros(3)
    quiet &= np.abs(rate - usual).max(axis=1) < 0.5 * np.pi / 180.0
    if not may_stop:
        moves = np.flatnonzero(~quiet)
        first, last = (moves[0], moves[-1]) if len(moves) else (len(quiet), -1)
        inside = (np.arange(len(quiet)) > first) & (np.arange(len(quiet)) < last)
        quiet &= ~inside
    # the windows beside a motion may hold its start
    return middle, quiet & _shifted(quiet, 1) & _shifted(quiet, -1), rate


def _shifted(mask: BoolArray, by: int) -> BoolArray:
    out = np.roll(mask, by)
    if by > 0:
        out[:by] = True
    else:
        out[by:] = True
    return out


def observations_of(middle: FloatArray, still: BoolArray, rate: FloatArray) -> Observations:
    """Return no velocity and no rate in each window of standstill."""
    at = middle[still]
    count = len(at)
    kinds = np.repeat([STILL, NO_RATE], count).astype(np.int64)
    value = np.concatenate([np.zeros((count, 3)), rate[still]])
    sigma = np.repeat([STILL_MPS, STILL_DPS * np.pi / 180.0], count)
    return Observations(
        np.tile(at, 2),
        kinds,
        value,
        np.tile(sigma[:, None] ** 2, (1, 3)),
        np.zeros(2 * count, dtype=bool),
        np.zeros((2 * count, 3)),
    )
