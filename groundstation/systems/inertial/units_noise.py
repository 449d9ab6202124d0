"""Noise of two units in their difference: rounding and white noise of what they write."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.geodesy import MEAN_RADIUS_M
from groundstation.base.quantiles import NORMAL_95
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_grid import OnGrid, apart_m
from groundstation.systems.inertial.units_growth import Noise
from groundstation.systems.inertial.units_track import UnitTrack

# Seconds over which an error of rounding stays the same, of a position and of a velocity, and noise of a heading.
POSITION_S, VELOCITY_S, HEADING_S = 60.0, 10.0, 60.0
SIGMA_OF_MEDIAN = np.sqrt(np.pi / 2.0)  # times that of the mean
SIGMA_PER_MAD, SECOND_DIFFERENCES = 1.4826, np.sqrt(6.0)
SMALLEST_DEG, SMALLEST_MPS = 1e-9, 1e-7  # steps below are those of the numbers themselves


def pair_noise(first: UnitTrack, second: UnitTrack, grids: tuple[OnGrid, OnGrid]) -> Noise:
    """Return what the outputs of two units do to their difference, one axis."""
    both = first, second
    one, other = grids
    metres_per_deg = np.deg2rad(MEAN_RADIUS_M)
    places = [metres_per_deg * max(_step(track.latitude_deg), _step(track.longitude_deg)) for track in both]
    speeds = [max(_step(axis, SMALLEST_MPS) for axis in track.velocity_mps.T) for track in both]
    return Noise(
        max(_rounding(places), _white(apart_m(one, other))),
        max(_rounding(speeds), _white(one.velocity_mps - other.velocity_mps)),
        POSITION_S,
        VELOCITY_S,
    )


def heading_apart(first: UnitTrack, second: UnitTrack, grids: tuple[OnGrid, OnGrid]) -> Measured | None:
    """Return the median of the second heading less the first; None where one has none."""
    one, other = grids
    apart = wrap_180(other.heading_deg - one.heading_deg)
    known = apart[np.isfinite(apart)]
    if not len(known):
        return None
    value = float(np.median(known))
    steps = [0.0 if track.heading_deg is None else _step(track.heading_deg) for track in (first, second)]
    lasting = 2.0 * HEADING_S / max(float(np.ptp(one.time_s[np.isfinite(apart)])), 1.0)
    noise = SIGMA_OF_MEDIAN * _white(wrap_180(apart - value)[:, None]) * np.sqrt(min(lasting, 1.0))
    return Measured(value, float(NORMAL_95 * np.hypot(_rounding(steps), noise)))  # rounding lasts on a straight leg


def _step(values: FloatArray, smallest: float = SMALLEST_DEG) -> float:
    """Return the resolution of a series: its smallest change, 0 where it has none."""
    change = np.abs(np.diff(values))
    change = change[np.isfinite(change) & (change > smallest)]
    return float(change.min()) if len(change) else 0.0


def _rounding(steps: list[float]) -> float:
    return float(np.linalg.norm(steps) / np.sqrt(12.0))


def _white(values: FloatArray) -> float:
    """Return one sigma of the white part of a series, the larger of its columns."""
    change = np.abs(np.diff(values, n=2, axis=0))
    known = change[np.isfinite(change).all(axis=1)]
    if not len(known):
        return 0.0
    return float(np.max(np.median(known, axis=0)) * SIGMA_PER_MAD / SECOND_DIFFERENCES)
