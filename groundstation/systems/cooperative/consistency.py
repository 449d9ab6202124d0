"""Consistency: errors against the sigmas that a filter claims, and divergence."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.cooperative.tracks import VehicleTrack
from groundstation.tables.session import DeadReckoning, Odometry

DIVERGED = 3.0  # horizontal error over the computed sigma_r
LAST_PART = 0.1
LONGEST_GAP_S = 1.0  # of the truth, unless it comes more seldom


@dataclass(frozen=True)
class TrackJudgement:
    """One track against truth, horizontal.

    Parameters
    ----------
    error_m : ndarray, shape (n, 2)
        Estimate minus truth, north and east; NaN where there is no truth.
    nees : ndarray, shape (n,)
        Normalised squared error; 2 on average is honest.
    """

    error_m: FloatArray
    nees: FloatArray

    @property
    def rms_m(self) -> float:
        """RMS of the horizontal error over all epochs."""
        return float(np.sqrt(np.nanmean((self.error_m**2).sum(axis=1)))) if np.isfinite(self.error_m).any() else np.nan

    def diverges(self, track: VehicleTrack) -> bool:
        """Tell whether the error of the session's last tenth exceeds three computed sigma_r.

        An error without a sigma counts as well.
        """
        error = np.linalg.norm(self.error_m, axis=1)
        sigma = 0.5 * track.two_sigma_r_m
        last = slice(int((1.0 - LAST_PART) * len(error)), None)
        known = np.isfinite(error[last])
        ratio = (error[last] / sigma[last])[known]
        return bool(len(ratio) and not np.sqrt(np.mean(ratio**2)) <= DIVERGED)  # no sigma is no number


def judge(
    track: VehicleTrack, vehicle: DeadReckoning | Odometry, time_s: FloatArray, position_m: FloatArray
) -> TrackJudgement:
    """Compare a track with the true positions of its vehicle (m, 3).

    The truth is interpolated to the epochs of the track, not over long gaps.
    """
    true = np.column_stack(
        [np.interp(track.time_s, time_s, position_m[:, axis], left=np.nan, right=np.nan) for axis in range(3)]
    )
    error = np.where(_in_gap(track.time_s, time_s)[:, None], np.nan, track.position_m - true)
    if isinstance(vehicle, DeadReckoning):
        nearest = np.clip(np.searchsorted(vehicle.time_s, track.time_s), 0, len(vehicle) - 1)
        horizontal = np.einsum("nij,ni->nj", vehicle.axes[nearest], error)[:, :2]
    else:
        horizontal = error[:, :2]
    return TrackJudgement(horizontal, normalised(horizontal, track.horizontal_m2))


def _in_gap(at_s: FloatArray, time_s: FloatArray) -> BoolArray:
    """Tell which times lie between two samples that are too far apart.

    Examples
    --------
    >>> _in_gap(np.array([0.0, 5.0, 10.0, 10.5]), np.array([0.0, 10.0, 11.0, 12.0])).tolist()
    [False, True, False, False]
    """
    if len(time_s) < 2:
        return np.zeros(len(at_s), dtype=bool)
    steps = np.diff(time_s)
    is_long = steps > max(LONGEST_GAP_S, 2.0 * float(np.median(steps)))
    after = np.clip(np.searchsorted(time_s, at_s), 1, len(steps))
    return np.asarray(is_long[after - 1] & (at_s != time_s[after]) & (at_s != time_s[after - 1]))


def normalised(error: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared error over covariance, shape (n,), NaN where the error is."""
    out = np.full(len(error), np.nan)
    known = np.isfinite(error).all(axis=1)
    if known.any():
        solved = np.linalg.solve(covariance[known], error[known][..., None])[..., 0]
        out[known] = (error[known] * solved).sum(axis=1)
    return out
