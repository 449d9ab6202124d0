"""Motion of a table's positions: it shows the unit of a speed, and a track."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass

_M_PER_DEG = 111_195.0  # on a sphere: a unit shows at a hundredth
_FEWEST = 20  # moving samples that show anything
_BASELINE_S, _MOST_S = 1.0, 30.0
_MOVED_M = 3.0
_NEAR, _SPREAD = 0.12, 0.35  # relative: of a unit's factor, of the ratios among each other
_FOLLOWS_DEG, _SAME = 6.0, 0.9
_ALIGNED, _TURNED = 0.8, 0.7  # lengths of mean unit vectors
_SPEEDS = {"mps": 1.0, "kt": 1852 / 3600, "kmh": 1 / 3.6, "mph": 0.44704, "fps": 0.3048, "cmps": 0.01, "mmps": 0.001}


@dataclass(frozen=True)
class Motion:
    """Speed and direction between positions, where something moved.

    Parameters
    ----------
    rows : ndarray of int, shape (n,)
        Row in the middle of each step.
    speed_mps, direction_deg : ndarray, shape (n,)
    """

    rows: np.ndarray
    speed_mps: FloatArray
    direction_deg: FloatArray

    def unit_of_speed(self, values: FloatArray) -> tuple[str, float] | None:
        """Return the unit of a speed and by which share it is off; None if nothing shows it."""
        there = values[self.rows]
        use = np.isfinite(there) & (there > 0.2 * np.nanmax(there, initial=0.0)) & (there > 0.0)
        if np.count_nonzero(use) < _FEWEST:
            return None
        ratios = self.speed_mps[use] / there[use]
        low, middle, high = np.percentile(ratios, (25, 50, 75))
        if not middle > 0.0 or (high - low) > _SPREAD * middle:
            return None
        unit = min(_SPEEDS, key=lambda one: abs(np.log(middle / _SPEEDS[one])))
        off = float(middle / _SPEEDS[unit] - 1.0)
        return (unit, off) if abs(off) < _NEAR else None

    def turn_dps(self, seconds: FloatArray) -> float | None:
        """Return the median rate of turn, degrees per second; None where nothing shows it.

        Parameters
        ----------
        seconds : ndarray, shape (n,)
            Times of the rows of the table.
        """
        if len(self.rows) < _FEWEST:
            return None
        steps_s = np.diff(seconds[self.rows])
        turns = np.abs(wrap_180(np.diff(self.direction_deg)))
        use = (steps_s > 0.0) & (steps_s < _MOST_S) & (turns < 90.0)
        return float(np.median(turns[use] / steps_s[use])) if np.count_nonzero(use) >= _FEWEST else None

    def is_followed(self, values_deg: FloatArray) -> bool:
        """Tell whether a direction is that of the motion nearly always."""
        there = values_deg[self.rows]
        use = np.isfinite(there)
        if np.count_nonzero(use) < _FEWEST or np.ptp(there[use]) < 20.0:
            return False
        away = np.abs(wrap_180(there[use] - self.direction_deg[use]))
        return bool(np.mean(away < _FOLLOWS_DEG) > _SAME)

    def against(self, values_deg: FloatArray) -> float | None:
        """Return the offset of a direction that turns against the motion; None where it does not.

        The direction of the motion is then the offset less the value: 90 where angles count from east, anticlockwise.
        """
        there = values_deg[self.rows]
        use = np.isfinite(there)
        if np.count_nonzero(use) < _FEWEST:
            return None
        heading, direction = np.deg2rad(there[use]), np.deg2rad(self.direction_deg[use])
        with_it, against = (abs(np.mean(np.exp(1j * (direction - sign * heading)))) for sign in (1, -1))
        spread = abs(np.mean(np.exp(1j * direction)))  # near 1 where nothing turned
        if against < _ALIGNED or with_it > _ALIGNED or spread > _TURNED:
            return None
        return float(np.degrees(np.angle(np.mean(np.exp(1j * (direction + heading))))))


def motion_of(latitude_deg: FloatArray, longitude_deg: FloatArray, seconds: FloatArray, sizes: list[int]) -> Motion:
    """Return the motion between positions a second or more apart, within each piece.

    Parameters
    ----------
    latitude_deg, longitude_deg, seconds : ndarray, shape (n,)
        NaN where there is none.
    sizes : list of int
        Rows of each piece; they add up to n.
    """
    found = [*_steps(latitude_deg, longitude_deg, seconds, sizes)]
    if not found:
        return Motion(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    return Motion(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _steps(
    latitude_deg: FloatArray, longitude_deg: FloatArray, seconds: FloatArray, sizes: list[int]
) -> Iterator[tuple[np.ndarray, FloatArray, FloatArray]]:
    start = 0
    for size in sizes:
        rows = start + np.flatnonzero(
            np.isfinite(latitude_deg[start : start + size])
            & np.isfinite(longitude_deg[start : start + size])
            & np.isfinite(seconds[start : start + size])
            & (np.abs(latitude_deg[start : start + size]) < 90.0)
            & (np.abs(longitude_deg[start : start + size]) <= 360.0)
            & ((latitude_deg[start : start + size] != 0.0) | (longitude_deg[start : start + size] != 0.0))
        )
        start += size
        if len(rows) < 2 or np.any(np.diff(seconds[rows]) < 0.0):
            continue
        later = np.searchsorted(seconds[rows], seconds[rows] + _BASELINE_S)
        first = np.flatnonzero(later < len(rows))
        ends, begins = rows[later[first]], rows[first]
        took_s = seconds[ends] - seconds[begins]
        north_m = _M_PER_DEG * (latitude_deg[ends] - latitude_deg[begins])
        east_m = _M_PER_DEG * wrap_180(longitude_deg[ends] - longitude_deg[begins])
        east_m = east_m * np.cos(np.deg2rad(latitude_deg[begins]))
        moved_m = np.hypot(north_m, east_m)
        use = (moved_m > _MOVED_M) & (took_s < _MOST_S) & (took_s > 0.0)
        middle = rows[(first + later[first]) // 2][use]
        yield middle, moved_m[use] / took_s[use], np.degrees(np.arctan2(east_m, north_m))[use]
