"""Two receivers of one vehicle against each other: distance, velocity, delay."""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.geodesy import curvature_radii_m
from groundstation.systems.gnss.answer import ReceiverPair
from groundstation.systems.gnss.motion import LEAST_STEPS
from groundstation.systems.gnss.series import ReceiverRows
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.spells import known

LEAST_SPEEDS_MPS = 3.0  # spread of the speed that shows a delay
NEIGHBOURS = 4.0  # samples that are one independent value


class ComparedReceivers(NamedTuple):
    """Pair with second minus first at the times of the first.

    Places north, east, up; velocities north, east.
    """

    answer: ReceiverPair
    time_s: FloatArray
    place_m: FloatArray
    velocity_mps: FloatArray


def compare(first: ReceiverRows, second: ReceiverRows, settings: GnssSettings) -> ComparedReceivers | None:
    """Compare two receivers while both have a fix.

    None where they are not together for long enough. The second is interpolated to the times of the first between
    neighbours without a gap.
    """
    usable = first.has_fix & np.isfinite(first.latitude_deg) & np.isfinite(first.longitude_deg)
    rows = np.flatnonzero(usable & _covered(second, first.time_s))
    if len(rows) < 2:
        return None
    time_s = first.time_s[rows]
    seconds = float(first.held_s[rows].sum())
    if seconds < settings.pair_seconds_min:
        return None
    latitude, longitude = first.latitude_deg[rows], first.longitude_deg[rows]
    meridian, prime_vertical = curvature_radii_m(latitude)
    reference = float(second.longitude_deg[np.isfinite(second.longitude_deg)][0])
    there = reference + _at(second, wrap_180(second.longitude_deg - reference), time_s)
    north = np.deg2rad(_at(second, second.latitude_deg, time_s) - latitude) * meridian
    east = np.deg2rad(wrap_180(there - longitude)) * prime_vertical * np.cos(np.deg2rad(latitude))
    up = _at(second, second.up_m, time_s) - first.up_m[rows]
    velocity = np.column_stack([_at(second, second.velocity_mps[:, axis], time_s) for axis in (0, 1)])
    velocity -= first.velocity_mps[rows, :2]
    place = np.column_stack([north, east, up])
    distance = np.hypot(north, east)
    forward, right, lag_s, sigma_s = _along(first.velocity_mps[rows, :2], place[:, :2], settings)
    sigmas = [one.values("horizontal_sigma_m") for one in (first, second)]
    claimed = [float(np.nanmedian(one)) if np.isfinite(one).any() else np.nan for one in sigmas]
    has_velocity = np.isfinite(velocity).all(axis=1)
    answer = ReceiverPair(
        first.topic,
        second.topic,
        seconds,
        float(np.median(distance)),
        float(np.std(distance)),
        known(float(np.nanmedian(up))) if np.isfinite(up).any() else None,
        known(float(np.nanstd(up))) if np.isfinite(up).any() else None,
        known(float(np.hypot(claimed[0], claimed[1]))),
        float(np.sqrt(np.mean(np.sum(velocity[has_velocity] ** 2, axis=1)))) if has_velocity.any() else None,
        forward,
        right,
        lag_s,
        sigma_s,
    )
    return ComparedReceivers(answer, time_s, place, velocity)


def _covered(one: ReceiverRows, time_s: FloatArray) -> np.ndarray:
    """Tell which moments lie between two neighbouring rows of a receiver.

    Both rows have a fix and a place.
    """
    if len(one.time_s) < 2:
        return np.zeros(len(time_s), dtype=bool)
    sound = one.has_fix & np.isfinite(one.latitude_deg) & np.isfinite(one.longitude_deg)
    joined = sound[1:] & sound[:-1] & ~one.is_gap
    at = np.clip(np.searchsorted(one.time_s, time_s, side="right") - 1, 0, len(joined) - 1)
    inside = (time_s >= one.time_s[0]) & (time_s <= one.time_s[-1])
    return np.asarray(inside & joined[at])


def _at(one: ReceiverRows, values: FloatArray, time_s: FloatArray) -> FloatArray:
    """Interpolate values of a receiver linearly; NaN beside rows without one."""
    return np.asarray(np.interp(time_s, one.time_s, values))


def _along(
    velocity_mps: FloatArray, apart_m: FloatArray, settings: GnssSettings
) -> tuple[float | None, float | None, float | None, float | None]:
    """Return place of the second antenna (forward, right) and delay of the second receiver.

    The delay has its sigma. The part of the distance along the motion is that of the antennas, less speed times delay.
    """
    speed = np.hypot(velocity_mps[:, 0], velocity_mps[:, 1])
    moving = np.isfinite(speed) & (speed > settings.moving_mps)
    if np.count_nonzero(moving) < LEAST_STEPS:
        return None, None, None, None
    speed, track = speed[moving], velocity_mps[moving] / speed[moving, None]
    along = np.sum(apart_m[moving] * track, axis=1)
    right = apart_m[moving, 1] * track[:, 0] - apart_m[moving, 0] * track[:, 1]
    centred = speed - speed.mean()
    power = float(np.sum(centred**2))
    if np.ptp(speed) >= LEAST_SPEEDS_MPS and power > 0.0:
        slope = float(np.sum(centred * along) / power)
        left = along - along.mean() - slope * centred
        sigma_s = float(np.sqrt(NEIGHBOURS * np.mean(left**2) / power))
        if sigma_s <= settings.lag_sigma_max_s:
            forward = float(along.mean() - slope * speed.mean())
            return forward, float(np.median(right)), -slope, sigma_s
    return None, float(np.median(right)), None, None
