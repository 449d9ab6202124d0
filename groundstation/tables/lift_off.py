"""Lift-off and touch-down by altitude: where a flight leaves and meets proven ground.

The ground may rise along a runway: the line through the roll, carried under the flight, is the ground there. What still
sinks against it does not touch it.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.tables.detector import Detection, GroundSettings, lasting
from groundstation.tables.motion import RATE_HZ, Motion, known_mean, largest_over_sources, running_mean, runs

LIFTED_M = 1.5  # height at which a lift-off is seen, in smoothed altitudes
CARRIED_M, CARRIED_S = 5.0, 5.0  # up to that height what is too slow to fly for so long is carried
ROLLED_S = 20.0  # of the proven ground that a flight borders on, through which the line goes
LEVEL_S = 5.0  # of it, at whose middle the line has the mean altitude
SLOPE_SIGMA = 0.01  # of a runway; ICAO Annex 14, volume I, 3.1.13 to 3.1.15: 1 % of the length, parts up to 1.5 %
SINKING_S = 3.0  # over which a descent against the ground is taken


def between_lift_off_and_touch_down(
    motion: Motion, ground: BoolArray, detection: Detection, settings: GroundSettings
) -> BoolArray:
    """Widen sure flight to where its altitude leaves and meets that of the ground.

    The ground is the one proven before and after. A little above it, and slower than it ever was in sure flight, it
    does not fly yet: it is carried to its launch. A lift-off is steep and a flare is not: what still sinks against the
    ground faster than ``climb_mps``, as a mean of 3 s, has not touched down.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    sure, slow = detection.airborne, lasting(motion.speed_mps < detection.speed_limit_mps, CARRIED_S)
    airborne = np.zeros(len(ground), dtype=bool)
    altitude = running_mean(motion.all_altitudes_m, 1.0)
    for start, end in runs(~ground):
        flying = start + np.flatnonzero(sure[start:end])
        if not flying.size:
            continue
        lift_off, touch_down = int(flying[0]), int(flying[-1]) + 1
        if start > 0:
            height_m = _height_m(motion, altitude, _beside(ground, start - 1, -1), settings)[:, start:lift_off]
            low = np.flatnonzero(largest_over_sources(height_m) <= _lifted_m(slow[start:lift_off]))
            lift_off = start + (int(low[-1]) + 1 if low.size else 0)
        if end < len(ground):
            height_m = _height_m(motion, altitude, _beside(ground, end, 1), settings)
            is_low = largest_over_sources(height_m) <= _lifted_m(slow)
            sinks = largest_over_sources(_sink_mps(height_m)) > settings.climb_mps
            low = np.flatnonzero((is_low & ~(sinks & ~slow))[touch_down:end])
            touch_down = touch_down + int(low[0]) if low.size else end
        airborne[lift_off:touch_down] = True
    return airborne


def _beside(ground: BoolArray, edge: int, step: int) -> NDArray[np.intp]:
    """Return the rows of proven ground from its edge on, at most ``ROLLED_S`` of them."""
    rows = edge + step * np.arange(round(ROLLED_S * RATE_HZ))
    rows = rows[(rows >= 0) & (rows < len(ground))]
    air = np.flatnonzero(~ground[rows])
    return rows[: air[0]] if air.size else rows


def _lifted_m(slow: BoolArray) -> FloatArray:
    """Return the height at which flight begins: slow rows may be carried so high."""
    return np.where(slow, CARRIED_M, LIFTED_M)


def _height_m(motion: Motion, altitude_m: FloatArray, rolled: NDArray[np.intp], settings: GroundSettings) -> FloatArray:
    """Return the height by each source above the ground, shape (k, n).

    The ground is the line through what was rolled over, carried no farther than it was rolled over, level from there.
    """
    level = rolled[: round(LEVEL_S * RATE_HZ)]
    slope = _slopes(motion.path_m[rolled], altitude_m[:, rolled], settings)
    length_m = float(np.ptp(motion.path_m[rolled]))
    along_m = np.clip(motion.path_m - float(np.mean(motion.path_m[level])), -length_m, length_m)
    return np.asarray(altitude_m - known_mean(altitude_m[:, level])[:, None] - slope[:, None] * along_m)


def _sink_mps(height_m: FloatArray) -> FloatArray:
    """Return the loss of height a second across each centred window of SINKING_S."""
    row, half = np.arange(height_m.shape[-1]), round(0.5 * SINKING_S * RATE_HZ)
    before, after = np.maximum(row - half, 0), np.minimum(row + half, len(row) - 1)
    return np.asarray((height_m[:, before] - height_m[:, after]) * RATE_HZ / np.maximum(after - before, 1))


def _slopes(path_m: FloatArray, altitude_m: FloatArray, settings: GroundSettings) -> FloatArray:
    """Return the slope of the ground by each source, shape (k,), metres per metre of path.

    Least squares, weighed against the slopes of runways: a drift of the altitude looks like a slope, the steeper the
    slower it was rolled over.
    """
    slopes = np.zeros(len(altitude_m))
    for row, altitude in enumerate(altitude_m):
        known = np.isfinite(altitude)
        length_m = float(np.ptp(path_m[known])) if known.any() else 0.0
        if length_m > 0.0:
            along, rise = path_m[known] - np.mean(path_m[known]), altitude[known] - np.mean(altitude[known])
            drift = settings.altitude_drift_mps * len(path_m) / RATE_HZ / length_m
            slopes[row] = float(along @ rise / (along @ along)) / (1.0 + (drift / SLOPE_SIGMA) ** 2)
    return slopes
