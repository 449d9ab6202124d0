"""Likely ground and flight where nothing proves them.

They come from speed, height and their rates, by the kind of vehicle. They name phases for people. No method that needs
ground contact reads them.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen
from groundstation.tables.detector import Detection, GroundSettings, detect_ground, lasting
from groundstation.tables.motion import RATE_HZ, Motion, largest_over_sources, runs, window_sum
from groundstation.tables.travel import Travel, height_above_m
from groundstation.tables.vehicle import STANDS_MPS, VehicleKind

AIR_M, GROUND_M = 5.0, 2.5  # height above the ground: more is flight, less is not
SETTLES_M = 4.0  # an altitude off by less may be noise
FLIGHT_S = 3.0  # nothing flies shorter
SPEED_SHARE = 0.8  # of the lowest speed in flight: as fast is flight too
LEAST_FLYING_MPS = 12.0  # what flies slower than this tells nothing by its speed
TAXI_MPS, TAXI_S = 15.0, 20.0  # below any aeroplane's flight, and for so long
FAST_MPS = 60.0  # the same in a log that shows no other flight
GAP_S = 10.0  # a gap so short between two like stretches is like them
WITHOUT_ATTITUDE = GroundSettings(standstill_s=6.0, steady_altitude_m=3.0, margin_s=0.0)


@dataclass(frozen=True)
class Likely:
    """Likely ground, standstill and flight on the grid, arrays of shape (n,).

    The rest is not known. ``moving`` is travel of which not even that is known: on the ground or in the air.
    """

    ground: BoolArray
    standing: BoolArray
    airborne: BoolArray
    moving: BoolArray

    def __post_init__(self) -> None:
        for name in ("ground", "standing", "airborne", "moving"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def likely_of(
    travel: Travel,
    motion: Motion,
    kind: VehicleKind | None,
    proven: tuple[BoolArray, BoolArray],
    detection: Detection,
) -> Likely:
    """Return what is likely of each grid time.

    What rolls, walks or floats is on the ground wherever it is known at all. What flies is where its height above the
    ground says so: as the log counts it, else above the ground touched before and after. As fast as in flight is
    flight. A vehicle of unknown kind stands where it is slow and level, and moves elsewhere.

    Parameters
    ----------
    travel : Travel
    motion : Motion
        Of the same flight.
    kind : str, optional
        Kind of vehicle, as stated or found.
    proven : pair of ndarray of bool, shape (n,)
        Ground and flight that are proven: they stay.
    detection : Detection
        What the detector proves of it.
    """
    speed = travel.slow_speed_mps
    is_known, is_slow = np.isfinite(speed), speed <= STANDS_MPS
    nothing = np.zeros(len(travel), dtype=bool)
    if kind == "flies":
        ground, airborne = _ground_and_air(travel, motion, proven, detection)
        moving = is_known & ~is_slow & ~ground & ~airborne
        return Likely(ground, ground & is_slow, airborne, moving)
    if kind is not None:
        return Likely(is_known, is_known & is_slow, nothing, nothing)
    stands = _stands(travel, is_slow)
    return Likely(stands, stands, nothing, is_known & ~stands)


def _stands(travel: Travel, is_slow: BoolArray) -> BoolArray:
    """Tell where a vehicle of unknown kind is at rest: slow, and not climbing."""
    return np.asarray(is_slow & (travel.climbed_m <= SETTLES_M))


def _ground_and_air(
    travel: Travel, motion: Motion, proven: tuple[BoolArray, BoolArray], detection: Detection
) -> tuple[BoolArray, BoolArray]:
    ground, airborne = (mask.copy() for mask in proven)
    height = travel.above_ground_m
    counts = np.isfinite(height)  # the log itself counts the height from the ground
    _add(airborne, lasting(height > AIR_M, FLIGHT_S), ground)
    _add(ground, (height <= GROUND_M) & ~_near(airborne, 1.0), airborne)
    guess = _detected(motion, detection)
    _add(airborne, guess.airborne & ~counts, ground)
    _add(ground, guess.ground & ~counts, airborne)
    fly_mps = _fly_mps(travel, airborne)
    _add(airborne, lasting((travel.speed_mps > fly_mps) & ~counts, FLIGHT_S), ground)
    taxis = _taxis(travel, airborne) & ~counts & ~proven[1]
    airborne &= ~taxis
    ground |= taxis
    above = height_above_m(travel, ground)
    _add(airborne, lasting((above > AIR_M + SETTLES_M) & ~counts, GAP_S), ground)
    low = (np.abs(above) <= SETTLES_M) & (travel.speed_mps <= min(fly_mps, LEAST_FLYING_MPS)) & ~counts
    _add(ground, lasting(low, FLIGHT_S), airborne)
    _land(airborne, ground, (np.abs(above) <= GROUND_M) & ~counts & ~proven[1])
    if not airborne.any():
        _add(ground, _stands(travel, travel.slow_speed_mps <= STANDS_MPS), airborne)
    return _bridged(ground, airborne), _bridged(airborne, ground)


def _taxis(travel: Travel, airborne: BoolArray) -> BoolArray:
    """Tell where something that flies fast is slow and level for long.

    It has landed, perhaps on another airfield than it left.
    """
    speeds = travel.speed_mps[airborne & np.isfinite(travel.speed_mps)]
    if not speeds.size or float(np.median(speeds)) < FAST_MPS:
        return np.zeros(len(travel), dtype=bool)
    half = round(0.5 * TAXI_S * RATE_HZ)
    row = np.arange(len(travel))
    before, after = np.maximum(row - half, 0), np.minimum(row + half, len(travel) - 1)
    change = largest_over_sources(np.abs(travel.altitude_m[:, after] - travel.altitude_m[:, before]))
    return lasting((travel.slow_speed_mps <= TAXI_MPS) & (change <= GROUND_M), TAXI_S)


def _land(airborne: BoolArray, ground: BoolArray, low: BoolArray) -> None:
    """Give to the ground the low rows by which a flight begins or ends beside it."""
    for start, end in runs(airborne):
        up = np.flatnonzero(~low[start:end])
        if not up.size:
            continue
        if start > 0 and ground[start - 1]:
            airborne[start : start + int(up[0])] = False
            ground[start : start + int(up[0])] = True
        if end < len(ground) and ground[end]:
            airborne[start + int(up[-1]) + 1 : end] = False
            ground[start + int(up[-1]) + 1 : end] = True


def _add(mask: BoolArray, more: BoolArray, other: BoolArray) -> None:
    """Add to a mask what is not in the other one."""
    mask |= more & ~other


def _near(mask: BoolArray, seconds: float) -> BoolArray:
    return np.asarray(window_sum(mask.astype(np.float64), round(seconds * RATE_HZ)) > 0.5)


def _detected(motion: Motion, detection: Detection) -> Detection:
    """Return the detector's proof; where it had none, its guess with a level attitude."""
    if not detection.reason:
        return detection
    size = len(motion)
    nothing = np.zeros(size)
    level = replace(motion, roll_deg=nothing, pitch_deg=nothing, heading_deg=np.full(size, np.nan))
    return detect_ground(level, WITHOUT_ATTITUDE)


def _fly_mps(travel: Travel, airborne: BoolArray) -> float:
    """Return the speed above which it flies.

    It is learnt from flight, and infinite where it flies as slow as it rolls.
    """
    speeds = travel.speed_mps[airborne & np.isfinite(travel.speed_mps)]
    if speeds.size < FLIGHT_S * RATE_HZ:
        return FAST_MPS
    limit = SPEED_SHARE * float(np.percentile(speeds, 1.0))
    return limit if limit >= LEAST_FLYING_MPS else np.inf


def _bridged(mask: BoolArray, other: BoolArray) -> BoolArray:
    """Fill short gaps between two stretches of a mask in which the other does not hold."""
    out = mask.copy()
    for start, end in runs(~mask):
        inside = start > 0 and end < len(mask)
        if inside and end - start <= GAP_S * RATE_HZ and not other[start:end].any():
            out[start:end] = True
    return out
