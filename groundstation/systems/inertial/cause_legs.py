"""Straight legs of a flight from its track, and errors along and across it."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.methods.ins_noise import GnssNoise
from groundstation.systems.inertial.cause_answer import AlongAcross, StraightLeg
from groundstation.systems.inertial.differences import TRACK_MPS, InsDifferences
from groundstation.systems.inertial.units_answer import Measured
from groundstation.tables.motion import runs

LEAST_LEG_S = 180.0
TURN_DPS = 0.15  # a great circle turns by less than 0.02 deg/s below 80 deg of latitude
OVER_S = 15.0  # to either side, over which a turn rate is taken
END_S = 30.0  # averaged at each end of a leg
LEAST_END = 0.5  # share of it with GNSS
MOST_LEGS = 30
# Slow errors of a receiver, which do not average out in half a minute; those of a class are tuned for forecasts.
RECEIVER = GnssNoise()
S_PER_H = 3600.0


@dataclass(frozen=True)
class TrackErrors:
    """Errors along and across the track, shapes (n,), NaN where the aircraft hardly moves."""

    along_mps: FloatArray
    across_mps: FloatArray
    along_m: FloatArray
    across_m: FloatArray

    def rms(self) -> tuple[AlongAcross, ...]:
        """Return the RMS of both quantities; one that is not known anywhere is left out."""
        both = (
            ("velocity", "m/s", self.along_mps, self.across_mps),
            ("position", "m", self.along_m, self.across_m),
        )
        return tuple(
            AlongAcross(name, unit, *(float(np.sqrt(np.nanmean(np.square(one)))) for one in (along, across)))
            for name, unit, along, across in both
            if np.isfinite(along).any()
        )


def along_track(vectors: FloatArray, course_rad: FloatArray | float) -> FloatArray:
    """Return vectors (n, 2) north-east as parts along a course and to its right, (n, 2).

    Examples
    --------
    >>> along_track(np.array([[0.0, 2.0]]), np.deg2rad(90.0)).round(6).tolist()
    [[2.0, 0.0]]
    >>> along_track(np.array([[0.0, 2.0]]), 0.0).round(6).tolist()
    [[0.0, 2.0]]
    """
    sine, cosine = np.sin(course_rad), np.cos(course_rad)
    north, east = vectors.T
    return np.stack([north * cosine + east * sine, east * cosine - north * sine], axis=1)


def track_errors(differences: InsDifferences, position_m: FloatArray, velocity_mps: FloatArray) -> TrackErrors:
    """Return errors (n, 2) north and east along and across the track of the INS."""
    track = _track_rad(differences)
    velocity, position = along_track(velocity_mps, track), along_track(position_m, track)
    return TrackErrors(*velocity.T, *position.T)


def straight_legs(
    differences: InsDifferences, position_m: FloatArray, velocity_mps: FloatArray
) -> tuple[tuple[StraightLeg, ...], int]:
    """Return the longest straight legs in the order of time, and the count of those left out.

    Parameters
    ----------
    differences : InsDifferences
    position_m, velocity_mps : ndarrays, shape (n, 2)
        Errors north and east, NaN where GNSS is missing or was rejected.

    A leg turns by less than 0.15 deg/s, for three minutes or more, without a reset of the INS.
    """
    epochs = differences.epochs
    found = []
    for first, end in runs(_is_straight(differences) & ~epochs.is_reset):
        if epochs.time_s[end - 1] - epochs.time_s[first] >= LEAST_LEG_S:
            found.append(_leg(differences, slice(first, end), position_m, velocity_mps))
    longest = sorted(found, key=lambda one: one.start_s - one.end_s)[:MOST_LEGS]
    return tuple(sorted(longest, key=lambda one: one.start_s)), len(found) - len(longest)


def _track_rad(differences: InsDifferences) -> FloatArray:
    """Course over ground, shape (n,), NaN below :data:`TRACK_MPS`."""
    north, east = differences.velocity_mps.T
    return np.where(np.hypot(north, east) > TRACK_MPS, np.arctan2(east, north), np.nan)


def _is_straight(differences: InsDifferences) -> BoolArray:
    time_s, track = differences.epochs.time_s, _track_rad(differences)
    known = np.isfinite(track)
    if not known.any():
        return known
    course = np.interp(time_s, time_s[known], np.unwrap(track[known]))
    turned = np.interp(time_s + OVER_S, time_s, course) - np.interp(time_s - OVER_S, time_s, course)
    return np.asarray(known & (np.abs(turned) < np.deg2rad(TURN_DPS) * 2.0 * OVER_S))


def _leg(differences: InsDifferences, use: slice, position_m: FloatArray, velocity_mps: FloatArray) -> StraightLeg:
    time_s, ground = differences.epochs.time_s[use], differences.velocity_mps[use]
    north, east = ground.mean(axis=0)
    course_rad = float(np.arctan2(east, north))
    speed = np.hypot(*ground.T)
    length_m = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)))
    rates = _change(time_s, along_track(position_m[use], course_rad), is_position=True)
    changes = _change(time_s, along_track(velocity_mps[use], course_rad), is_position=False)
    nmiph = S_PER_H / M_PER_NAUTICAL_MILE / max(float(time_s[-1] - time_s[0]) - END_S, 1.0)
    along, across = (None if one is None else Measured(one.value * nmiph, one.half95 * nmiph) for one in rates)
    return StraightLeg(
        start_s=float(time_s[0]),
        end_s=float(time_s[-1]),
        course_deg=float(wrap_360(np.rad2deg(course_rad))),
        length_km=length_m / 1000.0,
        along_rate_nmiph=along,
        across_rate_nmiph=across,
        along_change_mps=changes[0],
        across_change_mps=changes[1],
    )


def _change(time_s: FloatArray, error: FloatArray, *, is_position: bool) -> tuple[Measured | None, Measured | None]:
    """Return the change of an error (n, 2) from the first half minute to the last, both parts.

    The interval is that of GNSS: white noise averaged, the slow part as far as it changes in between.
    """
    ends = [error[time_s <= time_s[0] + END_S], error[time_s >= time_s[-1] - END_S]]
    count = [int(np.isfinite(one).all(axis=1).sum()) for one in ends]
    if min(count) < max(1.0, LEAST_END * min(len(one) for one in ends)):
        return None, None
    change = np.nanmean(ends[1], axis=0) - np.nanmean(ends[0], axis=0)
    white, slow, memory_s = (
        (RECEIVER.position_white_m, RECEIVER.position_correlated_m, RECEIVER.position_correlation_s)
        if is_position
        else (RECEIVER.velocity_white_mps, RECEIVER.velocity_correlated_mps, RECEIVER.velocity_correlation_s)
    )
    gone = -np.expm1(-(time_s[-1] - time_s[0] - END_S) / memory_s)
    variance = white**2 * (1.0 / count[0] + 1.0 / count[1]) + 2.0 * slow**2 * gone
    half95 = float(NORMAL_95 * np.sqrt(variance))
    return Measured(float(change[0]), half95), Measured(float(change[1]), half95)
