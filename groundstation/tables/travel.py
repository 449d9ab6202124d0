"""Speed and height of a vehicle from all that a log has.

They serve to find its kind and its likely phases; they prove nothing.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.signals import topics_of_kind
from groundstation.tables.motion import (
    RATE_HZ,
    Motion,
    first_of_kind,
    grid_size,
    largest_over_sources,
    on_grid,
    running_mean,
    window_sum,
)
from groundstation.tables.table import Flight

STEP_S = 2.0  # half the time over which positions give a speed
CLIMB_S = 5.0  # half the time over which a climb is seen
LOW_M, RUNS_MPS, RUNS_S = 2.5, 60.0, 30.0  # no aircraft runs so fast on the ground for so long
PLACE_M = 20.0  # side of what counts as one place
AGREES = 0.5  # share of a climb that a second source must show


@dataclass(frozen=True)
class Travel:
    """Signals on the grid of :class:`Motion`, NaN where the log has none.

    Parameters
    ----------
    speed_mps : ndarray, shape (n,)
        Ground speed; where there is none, that of the wheels; where there is none either, that of the positions.
    airspeed_mps : ndarray, shape (n,)
    above_ground_m : ndarray, shape (n,)
        Height that the log itself counts from the ground: above the airfield, else by radio altimeter.
    altitude_m : ndarray, shape (3, n)
        Inertial, satellite and pressure altitude, smoothed over 2 s, each with a datum of its own.
    climbed_m, travelled_m : ndarray, shape (n,)
        Change of altitude across 10 s that two sources show, and the distance travelled in it.
    risen_m : ndarray, shape (n,)
        Sum of the upward speed.
    north_m, east_m : ndarray, shape (n,)
        Displacement from the first known position.
    """

    speed_mps: FloatArray
    airspeed_mps: FloatArray
    above_ground_m: FloatArray
    altitude_m: FloatArray
    climbed_m: FloatArray
    travelled_m: FloatArray
    risen_m: FloatArray
    north_m: FloatArray
    east_m: FloatArray

    def __len__(self) -> int:
        return len(self.speed_mps)

    @property
    def slow_speed_mps(self) -> FloatArray:
        """Mean speed over 1 s."""
        return running_mean(self.speed_mps, 0.5)


def travel_of(flight: Flight, motion: Motion) -> Travel:
    """Gather speed and height from all sources of a flight."""
    size = grid_size(flight)
    speed = _first_known(motion.speed_mps, _wheels_mps(flight, size), _positions_mps(motion))
    altitude = running_mean(motion.all_altitudes_m, 1.0)
    climbed, travelled = _climbed_m(motion, altitude, speed)
    rising = _first_known(*motion.climb_mps[::-1])  # the receiver's before the inertial one
    risen = np.where(np.isfinite(rising), np.cumsum(np.nan_to_num(rising)) / RATE_HZ, np.nan)
    return Travel(
        speed_mps=speed,
        airspeed_mps=_airspeed_mps(flight, size),
        above_ground_m=_above_ground_m(flight, speed),
        altitude_m=altitude,
        climbed_m=climbed,
        travelled_m=travelled,
        risen_m=risen,
        north_m=motion.north_m,
        east_m=motion.east_m,
    )


def _first_known(*sources: FloatArray) -> FloatArray:
    out = sources[0]
    for other in sources[1:]:
        out = np.where(np.isfinite(out), out, other)
    return out


def _wheels_mps(flight: Flight, size: int) -> FloatArray:
    table = first_of_kind(flight, "odometry")
    return on_grid(flight, table, np.abs(table.values("speed_mps")), size)


def _positions_mps(motion: Motion) -> FloatArray:
    """Speed by the positions STEP_S before and after."""
    half, size = round(STEP_S * RATE_HZ), len(motion)
    out = np.full(size, np.nan)
    if size > 2 * half:
        north, east = running_mean(motion.north_m, 0.5), running_mean(motion.east_m, 0.5)
        moved = np.hypot(north[2 * half :] - north[: -2 * half], east[2 * half :] - east[: -2 * half])
        out[half:-half] = moved / (2.0 * STEP_S)
        known = np.flatnonzero(np.isfinite(out))
        if known.size:  # the ends of the log are as its first and last known speed
            near = np.isfinite(motion.north_m)
            out[: known[0]] = np.where(near[: known[0]], out[known[0]], np.nan)
            out[known[-1] :] = np.where(near[known[-1] :], out[known[-1]], np.nan)
    return out


def _airspeed_mps(flight: Flight, size: int) -> FloatArray:
    air = first_of_kind(flight, "air")
    fields = [on_grid(flight, air, air.values(name), size) for name in ("true_airspeed_mps", "indicated_airspeed_mps")]
    return _first_known(*fields)


def _above_ground_m(flight: Flight, speed_mps: FloatArray) -> FloatArray:
    """Height above the ground as logged.

    A source that stays low on a run without end is stuck and not believed.
    """
    size = len(speed_mps)
    sources = [("baro", "height_above_airfield_m"), ("radio_altimeter", "height_m")]
    for kind, name in sources:
        for topic in topics_of_kind(kind, flight.topics()):
            if flight[topic].has(name):
                height = on_grid(flight, flight[topic], flight[topic].values(name), size)
                if not lasts((height <= LOW_M) & (speed_mps > RUNS_MPS), RUNS_S):
                    return height
    return np.full(size, np.nan)


def _climbed_m(motion: Motion, altitude_m: FloatArray, speed_mps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the climb across the centred window, and the way travelled in it.

    The climb is what two sources agree on. A satellite altitude alone may wander by tens of metres: its upward speed or
    the pressure has to show the same.
    """
    half, size = round(CLIMB_S * RATE_HZ), len(motion)
    row = np.arange(size)
    before, after = np.maximum(row - half, 0), np.minimum(row + half, max(size - 1, 0))
    length_s = (after - before) / RATE_HZ
    changes = np.abs(altitude_m[:, after] - altitude_m[:, before])
    rates = np.abs(running_mean(motion.climb_mps, CLIMB_S)) * length_s
    shown = np.array([np.fmax.reduce(changes[:-1]), changes[-1], np.fmax.reduce(rates)])
    ordered = np.sort(np.where(np.isfinite(shown), shown, -1.0), axis=0)  # what is not known first
    agreed = ordered[-2] >= np.maximum(AGREES * ordered[-1], 0.0)
    known = np.nan_to_num(speed_mps, nan=0.0)
    return np.where(agreed, ordered[-2], 0.0), window_sum(known, half) / RATE_HZ


def height_above_m(travel: Travel, ground: BoolArray) -> FloatArray:
    """Return the height above the ground that was last or is next touched, shape (n,).

    It is NaN where there is none. Every altitude is compared with its own on the ground, in a straight line over time
    between two stretches.
    """
    if not ground.any():
        return np.full(len(travel), np.nan)
    row = np.arange(len(travel))
    heights = np.full(travel.altitude_m.shape, np.nan)
    for source, altitude in enumerate(travel.altitude_m):
        known = np.flatnonzero(ground & np.isfinite(altitude))
        if known.size:
            heights[source] = altitude - np.interp(row, known, altitude[known])
    return largest_over_sources(heights)


def apart_at_one_place_m(travel: Travel) -> tuple[float, float]:
    """Return the largest difference of altitude between two visits of one place, metres.

    Ground has one altitude at a place. The first figure is what both the altitude and the sum of the upward speed show,
    as a satellite altitude may wander by tens of metres, and a sum by its drift; the second is by altitude alone.
    """
    ins, gnss, pressure = travel.altitude_m
    altitude = next((one for one in (gnss, ins) if np.isfinite(one).any()), pressure)
    known = np.isfinite(altitude) & np.isfinite(travel.north_m)
    if not known.any():
        return 0.0, 0.0
    cells = np.floor(np.stack([travel.north_m[known], travel.east_m[known]]) / PLACE_M).astype(np.int64)
    place = (cells[0] - cells[0].min()) * (np.ptp(cells[1]) + 1) + cells[1] - cells[1].min()
    order = np.argsort(place, kind="stable")
    first = np.flatnonzero(np.diff(place[order], prepend=-1))

    def spans(values: FloatArray) -> FloatArray:
        return np.asarray(np.fmax.reduceat(values[order], first) - np.fmin.reduceat(values[order], first))

    by_altitude = spans(altitude[known])
    both = np.minimum(by_altitude, np.nan_to_num(spans(travel.risen_m[known])))
    return float(np.max(both)), float(np.max(by_altitude))


def lasts(mask: BoolArray, least_s: float) -> float:
    """Return the time that a mask holds in stretches of at least ``least_s``, seconds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    length_s = (edges[1::2] - edges[::2]) / RATE_HZ
    return float(np.sum(length_s[length_s >= least_s]))
