"""Motion of a flight on a coarse, even grid of times, for the ground detector and phases."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, unwrap
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import BoolArray, Int64Array
from groundstation.tables.sources import sources_of_kind
from groundstation.tables.table import Flight, Table

RATE_HZ = 5.0
LARGEST_GAP_S = 2.5  # bridges 1 Hz logs with one lost second, nothing more
LONGEST_GRID = 2_000_000  # 4.6 days, 0.6 GB: a clock that jumps must not fill the memory
FEWEST_SATELLITES = 4
FROZEN_S, FROZEN_SPEED_MPS = 60.0, 20.0
# By any of these fields an instance is the one that gives the quantity.
SPEED, PLACE, ATTITUDE = ("velocity_north_mps", "ground_speed_mps"), ("latitude_deg",), ("roll_deg",)
ALTITUDE, CLIMB = ("altitude_msl_m", "altitude_ellipsoid_m", "pressure_altitude_m"), ("velocity_down_mps",)
ROWS_AT_ONCE = 1 << 18  # of a table: working arrays do not grow with a log
Values = Callable[[Table], FloatArray]  # of the rows of a part of a table


@dataclass(frozen=True)
class Motion:
    """Signals on the grid ``time_s = i / RATE_HZ``, NaN where no sample is near.

    Parameters
    ----------
    speed_mps : ndarray, shape (n,)
        Ground speed: satellite receiver where it has one, else inertial.
    roll_deg, pitch_deg, heading_deg : ndarray, shape (n,)
        Inertial attitude; the heading (true, else magnetic) is continuous, without jumps at north.
    altitude_m : ndarray, shape (k, n)
        Altitudes of k sources (inertial, satellite), each with a datum of its own: only changes count.
    pressure_altitude_m : ndarray, shape (n,)
        Kept apart: on the ground full throttle moves it by 12 m (propeller wash on a light aircraft's static port).
    climb_mps : ndarray, shape (m, n)
        Upward speeds of m sources.
    north_m, east_m : ndarray, shape (n,)
        Displacement from the first known position.
    path_m : ndarray, shape (n,)
        Distance travelled; stands still where the speed is unknown.
    """

    speed_mps: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    heading_deg: FloatArray
    altitude_m: FloatArray
    pressure_altitude_m: FloatArray
    climb_mps: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    path_m: FloatArray

    def __len__(self) -> int:
        return len(self.speed_mps)

    @property
    def all_altitudes_m(self) -> FloatArray:
        """Every altitude, shape (k + 1, n), the pressure altitude last."""
        return np.concatenate([self.altitude_m, self.pressure_altitude_m[None, :]])

    def distance_m(self, origin: NDArray[np.intp], at: slice | NDArray[np.intp]) -> FloatArray:
        """Return the distance between rows of the grid.

        It is straight where positions are known, else along the path.
        """
        straight = np.hypot(self.north_m[at] - self.north_m[origin], self.east_m[at] - self.east_m[origin])
        along = np.abs(self.path_m[at] - self.path_m[origin])
        return np.asarray(np.where(np.isfinite(straight), straight, along))


def grid_size(flight: Flight) -> int:
    """Return the number of grid times from the start of the flight to its end.

    It is 0 where there are none, or for a span of many days.
    """
    size = int(flight.duration_s * RATE_HZ) + 1
    return size if any(len(table) for table in flight.tables.values()) and size <= LONGEST_GRID else 0


def motion_of(flight: Flight) -> Motion:
    """Resample the flight's motion to the grid.

    It takes means of the samples around each grid time, and straight lines in between.
    """
    size = grid_size(flight)
    ins = first_of_kind(flight, "ins", *ATTITUDE)
    fast, fast_gnss = (first_of_kind(flight, kind, *SPEED) for kind in ("ins", "gnss"))
    high, high_gnss = (first_of_kind(flight, kind, *ALTITUDE) for kind in ("ins", "gnss"))
    rising = (first_of_kind(flight, kind, *CLIMB) for kind in ("ins", "gnss"))
    speed = on_grid(flight, fast_gnss, _usable_speed_mps, size)
    speed = np.where(np.isfinite(speed), speed, on_grid(flight, fast, horizontal_speed_mps, size))
    true_heading, magnetic = ins.values("true_heading_deg"), ins.values("magnetic_heading_deg")
    heading = true_heading if np.isfinite(true_heading).any() else magnetic
    north, east = _positions(flight, [first_of_kind(flight, kind, *PLACE) for kind in ("gnss", "ins")], size)
    moving = np.nan_to_num(speed, nan=0.0)
    return Motion(
        speed,
        on_grid(flight, ins, unwrap(ins.values("roll_deg")), size),
        on_grid(flight, ins, ins.values("pitch_deg"), size),
        on_grid(flight, ins, unwrap(heading), size),
        np.array([_altitude(flight, table, speed) for table in (high, high_gnss)]),
        _altitude(flight, first_of_kind(flight, "baro"), speed),
        np.array([on_grid(flight, table, _climb_mps, size) for table in rising]).reshape(2, size),
        north,
        east,
        np.concatenate([[0.0], np.cumsum(0.5 * (moving[1:] + moving[:-1]))])[:size] / RATE_HZ,
    )


def first_of_kind(flight: Flight, kind: str, *names: str) -> Table:
    """Return the first instance of a topic, in order of preference, that has samples.

    It is the first with any of the named fields, where one has them: an INS that gives a heading alone stands before
    one with velocities. The table is empty when there is none.
    """
    tables = [flight[topic] for topic in sources_of_kind(flight, kind) if len(flight[topic])]
    first = tables[0] if tables else Table.empty(kind)
    return next((table for table in tables if any(table.has(name) for name in names)), first)


def horizontal_speed_mps(table: Table) -> FloatArray:
    """Ground speed of a topic, shape (n,): from the velocities, else as logged."""
    from_velocity = np.hypot(table.values("velocity_north_mps"), table.values("velocity_east_mps"))
    return np.where(np.isfinite(from_velocity), from_velocity, table.values("ground_speed_mps"))


def running_mean(values: FloatArray, half_width_s: float) -> FloatArray:
    """Average the known values within ``half_width_s`` on either side, along the last axis.

    NaN stays NaN.
    """
    half = round(half_width_s * RATE_HZ)
    known = np.isfinite(values)
    total, count = window_sum(np.where(known, values, 0.0), half), window_sum(known.astype(np.float64), half)
    return np.where(known, total / np.maximum(count, 1.0), np.nan)


def known_mean(values: FloatArray) -> FloatArray:
    """Mean of the known values along the last axis, NaN where there are none."""
    known = np.isfinite(values)
    count = np.count_nonzero(known, axis=-1)
    total = np.sum(np.where(known, values, 0.0), axis=-1)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def largest_over_sources(deviation_m: FloatArray) -> FloatArray:
    """Return the largest deviation among all altitudes, shape (k + 1, n) -> (n,).

    The pressure altitude, the last row, counts only where no other is known.
    """
    geometric = np.fmax.reduce(deviation_m[:-1], axis=0)
    return np.asarray(np.where(np.isfinite(geometric), geometric, deviation_m[-1]))


def window_sum(values: FloatArray, half: int) -> FloatArray:
    """Sum over the rows i - half ... i + half along the last axis, cut at the ends."""
    size = values.shape[-1]
    reach = min(half, size)
    total = np.empty((*values.shape[:-1], size + 1))  # sum of the values before each row
    total[..., 0] = 0.0
    np.cumsum(values, axis=-1, out=total[..., 1:])
    sums = np.empty(values.shape)
    sums[..., : size - reach] = total[..., reach + 1 :]
    sums[..., size - reach :] = total[..., size:]
    sums[..., reach:] -= total[..., : size - reach]
    return sums


def runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Runs of True as half-open pairs of rows.

    Examples
    --------
    >>> runs(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def _usable_fixes(gnss: Table) -> BoolArray:
    """Tell which fixes the receiver itself trusts; one that says nothing is trusted."""
    is_doubtful = (gnss.values("integrity_ok") == 0.0) | (gnss.values("satellites_used") < FEWEST_SATELLITES)
    return np.asarray(~is_doubtful)


def _usable_speed_mps(gnss: Table) -> FloatArray:
    return np.where(_usable_fixes(gnss), horizontal_speed_mps(gnss), np.nan)


def _climb_mps(table: Table) -> FloatArray:
    return -table.values("velocity_down_mps")


def _displaced(origin_deg: tuple[float, float], axis: int) -> Values:
    """Return the function of the displacement from an origin, north (axis 0) or east, m."""

    def values(table: Table) -> FloatArray:
        return north_east_m(table.values("latitude_deg"), table.values("longitude_deg"), *origin_deg)[axis]

    return values


def _positions(flight: Flight, tables: Sequence[Table], size: int) -> tuple[FloatArray, FloatArray]:
    for table in tables:
        known = table.valid("latitude_deg", "longitude_deg")
        if known.any():
            latitude, longitude = table.values("latitude_deg"), table.values("longitude_deg")
            first = int(np.argmax(known))
            origin = float(latitude[first]), float(longitude[first])
            north, east = (on_grid(flight, table, _displaced(origin, axis), size) for axis in (0, 1))
            return north, east
    unknown = np.full(size, np.nan)
    return unknown, unknown


def _altitude(flight: Flight, table: Table, speed_mps: FloatArray) -> FloatArray:
    for name in ALTITUDE:
        values = table.values(name)
        if np.isfinite(values).any():
            altitude_m = on_grid(flight, table, values, len(speed_mps))
            return np.where(_is_frozen(altitude_m, speed_mps), np.nan, altitude_m)
    return np.full(len(speed_mps), np.nan)


def _is_frozen(altitude_m: FloatArray, speed_mps: FloatArray) -> BoolArray:
    """Tell where an altitude is stuck: equal to the last digit for a minute at speed.

    A stuck altitude proves nothing.
    """
    frozen = np.zeros(len(altitude_m), dtype=bool)
    for start, end in runs(np.diff(altitude_m, append=np.nan) == 0.0):
        if end - start >= FROZEN_S * RATE_HZ and np.any(speed_mps[start : end + 1] > FROZEN_SPEED_MPS):
            frozen[start : end + 1] = True
    return frozen


def on_grid(flight: Flight, table: Table, values: FloatArray | Values, size: int) -> FloatArray:
    """Average the samples nearest to each grid time.

    Gaps of at most LARGEST_GAP_S are filled by straight lines. ``values``, shape (n,), or the function that gives them
    of a part of the table.
    """
    count, total = np.zeros(size, dtype=np.int64), np.zeros(size)
    for rows, cell in _cells(flight, table, size):
        part = values[rows] if isinstance(values, np.ndarray) else values(table.take(rows))
        known = np.isfinite(part)
        if not known.all():
            cell, part = cell[known], part[known]
        if len(cell):
            first, end = int(cell[0]), int(cell[-1]) + 1
            count[first:end] += np.bincount(cell - first)
            total[first:end] += np.bincount(cell - first, weights=part)
    at = np.flatnonzero(count)
    if not len(at):
        return np.full(size, np.nan)
    out = np.interp(np.arange(size), at, total[at] / count[at], left=np.nan, right=np.nan)
    wide = np.flatnonzero(np.diff(at) > LARGEST_GAP_S * RATE_HZ)
    inside = np.zeros(size + 1, dtype=np.int64)
    inside[at[wide] + 1] += 1
    inside[at[wide + 1]] -= 1
    return np.where(np.cumsum(inside[:-1]) > 0, np.nan, out)


def _cells(flight: Flight, table: Table, size: int) -> Iterator[tuple[slice, Int64Array]]:
    """Yield the rows of a table in parts, and the grid time nearest to each row.

    No grid time is in two parts.
    """
    start = 0
    while size and start < len(table):
        end, kept = start, 0
        while not kept:  # all of a part at one grid time: more of them
            end += ROWS_AT_ONCE
            cell = np.rint(flight.seconds(table.time_ns[start:end]) * RATE_HZ).astype(np.int64)
            np.minimum(cell, size - 1, out=cell)
            kept = len(cell) if end >= len(table) else int(np.searchsorted(cell, cell[-1]))
        yield slice(start, start + kept), cell[:kept]
        start += kept
