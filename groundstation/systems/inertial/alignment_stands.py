"""Stands of the aircraft by GNSS, by the INS alone where there is none."""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import on_earth
from groundstation.base.records import BoolArray, frozen
from groundstation.systems.inertial.differences import POSITION_FIELDS, VELOCITY_FIELDS, mean_in
from groundstation.systems.inertial.navigation_start import INS_STAND_MPS, STAND_MPS
from groundstation.tables.motion import runs
from groundstation.tables.table import Flight, Table

LEAST_STAND_S = 5.0
HALF_WIDTH = 2  # seconds on either side over which a velocity is averaged
CHANGE_S = 5  # the velocity of an INS that stands hardly changes over so long on either side
CHANGE_MPS = 0.15
EARTH_M = 6.371e6
LONGEST_S = 2_000_000  # seconds of a log for which a second-by-second picture is made


@dataclass(frozen=True)
class GroundMotion:
    """Motion second by second: velocities of GNSS and INS, places by GNSS; NaN where unknown.

    ``stands`` is true where the aircraft is seen to stand, ``moves`` where it is seen to move.
    """

    time_s: FloatArray
    gnss_mps: FloatArray
    ins_mps: FloatArray
    place_m: FloatArray
    stands: BoolArray
    moves: BoolArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    def spans(self) -> tuple[tuple[float, float], ...]:
        """Stands of some seconds at least, flight seconds; short gaps of knowledge are bridged."""
        found: list[list[float]] = []
        for first, end in runs(self.stands):
            start_s, end_s = float(self.time_s[first]), float(self.time_s[end - 1]) + 1.0
            between = slice(int(np.searchsorted(self.time_s, found[-1][1])), first) if found else slice(0, 0)
            if found and start_s - found[-1][1] <= LEAST_STAND_S and not self.moves[between].any():
                found[-1][1] = end_s
            else:
                found.append([start_s, end_s])
        return tuple((start_s, end_s) for start_s, end_s in found if end_s - start_s >= LEAST_STAND_S)

    def within(self, start_s: float, end_s: float) -> BoolArray:
        """Rows of a span."""
        return np.asarray((self.time_s >= start_s) & (self.time_s < end_s))


def ground_motion(
    flight: Flight, ins: Table, gnss: Table | None, excluded_s: tuple[tuple[float, float], ...] = ()
) -> GroundMotion:
    """Return the motion second by second, from the INS samples given and GNSS.

    GNSS tells where there is any; elsewhere the INS does, by a velocity that is small and steady.
    """
    ins_s = flight.seconds(ins.time_ns)
    gnss_s = np.zeros(0) if gnss is None else flight.seconds(gnss.time_ns)
    if gnss is not None:
        kept = np.ones(len(gnss_s), dtype=bool)
        for start_s, end_s in excluded_s:
            kept &= (gnss_s < start_s) | (gnss_s > end_s)
        if "integrity_ok" in gnss:
            column = gnss.columns["integrity_ok"]
            kept &= ~(column.mask & ~np.asarray(column.values, dtype=bool))
        gnss, gnss_s = gnss.take(kept), gnss_s[kept]
    ends_s = [float(end) for part in (ins_s, gnss_s) if len(part) for end in (part.min(), part.max())]
    if not ends_s or max(ends_s) - min(ends_s) > LONGEST_S:
        nothing, no = np.zeros((0, 2)), np.zeros(0, dtype=bool)
        return GroundMotion(np.zeros(0), nothing, nothing, nothing, no, no)
    first_s = float(np.floor(min(ends_s)))
    time_s = first_s + np.arange(int(max(ends_s) - first_s) + 1, dtype=np.float64)
    ins_mps = _second_by_second(ins, ins_s - first_s, len(time_s))
    gnss_mps = np.full((len(time_s), 2), np.nan)
    place_m = np.full((len(time_s), 2), np.nan)
    if gnss is not None and len(gnss):
        gnss_mps = _second_by_second(gnss, gnss_s - first_s, len(time_s))
        place_m = _places(gnss, gnss_s - first_s, len(time_s))
    by_gnss, by_ins = _speed(gnss_mps), _speed(ins_mps)
    seen = np.isfinite(by_gnss)
    steady = (by_ins < INS_STAND_MPS) & (_change(ins_mps) < CHANGE_MPS)
    stands = np.where(seen, by_gnss < STAND_MPS, np.isfinite(by_ins) & steady)
    moves = np.where(seen, by_gnss >= STAND_MPS, np.isfinite(by_ins) & (by_ins >= INS_STAND_MPS))
    return GroundMotion(time_s, gnss_mps, ins_mps, place_m, stands, moves)


def _second_by_second(table: Table, since_s: FloatArray, count: int) -> FloatArray:
    second = np.floor(since_s).astype(np.int64)
    return np.column_stack([mean_in(second, table.values(name)[:, None], count) for name in VELOCITY_FIELDS])


def _places(gnss: Table, since_s: FloatArray, count: int) -> FloatArray:
    """Place north and east of the first one, metres."""
    latitude, longitude = on_earth(*(gnss.values(name) for name in POSITION_FIELDS))
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not len(known):
        return np.full((count, 2), np.nan)
    at = known[0]
    north = EARTH_M * np.deg2rad(latitude - latitude[at])
    east = EARTH_M * np.deg2rad(wrap_180(longitude - longitude[at])) * np.cos(np.deg2rad(latitude[at]))
    return mean_in(np.floor(since_s).astype(np.int64), np.column_stack([north, east]), count)


def _speed(velocity_mps: FloatArray) -> FloatArray:
    """Length of the mean velocity over some seconds, NaN where the middle one is unknown."""
    known = np.isfinite(velocity_mps).all(axis=1)
    window = np.ones(2 * HALF_WIDTH + 1)
    number = np.convolve(known, window, "full")[HALF_WIDTH:-HALF_WIDTH]
    total = [np.convolve(np.where(known, axis, 0.0), window, "full")[HALF_WIDTH:-HALF_WIDTH] for axis in velocity_mps.T]
    return np.where(known, np.hypot(*total) / np.maximum(number, 1.0), np.nan)


def _change(velocity_mps: FloatArray) -> FloatArray:
    """Return the largest change of a velocity over some seconds; 0 where unknown."""
    largest = np.zeros(len(velocity_mps))
    step = min(CHANGE_S, len(velocity_mps))
    moved = np.hypot(*(velocity_mps[step:] - velocity_mps[: len(velocity_mps) - step]).T)
    moved = np.nan_to_num(moved)
    largest[step:] = moved
    largest[: len(moved)] = np.maximum(largest[: len(moved)], moved)
    return largest
