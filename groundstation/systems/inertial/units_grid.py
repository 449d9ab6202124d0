"""Several tracks on one grid of times, and the difference of two of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import curvature_radii_m, on_earth
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack

GRID_S = 1.0
MOST_ROWS = 200_000  # a longer flight gets a coarser grid
GAP_S = 1.5  # tracks are interpolated over no longer gap, or three of their own intervals
GAP_STEPS = 3.0


@dataclass(frozen=True)
class OnGrid:
    """Track at the times of the grid; NaN in its gaps.

    ``velocity_mps`` (n, 2) is north and east.
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    heading_deg: FloatArray

    @property
    def has_place(self) -> BoolArray:
        """Tell which rows have a position."""
        return np.asarray(np.isfinite(self.latitude_deg) & np.isfinite(self.longitude_deg))

    def hidden(self, rows: BoolArray, *, axes: tuple[int, ...] = (0, 1), place: bool = False) -> "OnGrid":
        """Return it without the velocities, and the places, of some rows."""
        velocity = self.velocity_mps.copy()
        for axis in axes:
            velocity[rows, axis] = np.nan
        kept = replace(self, velocity_mps=velocity)
        if not place:
            return kept
        latitude, longitude = np.where(rows, np.nan, self.latitude_deg), np.where(rows, np.nan, self.longitude_deg)
        return replace(kept, latitude_deg=latitude, longitude_deg=longitude)


def grid_of(tracks: Sequence[UnitTrack | ReferenceTrack]) -> FloatArray:
    """Return the times of the grid: whole seconds from the first sample of a unit to the last."""
    first = min(float(one.time_s[0]) for one in tracks)
    last = max(float(one.time_s[-1]) for one in tracks)
    step = max(GRID_S, float(np.ceil((last - first) / MOST_ROWS)))
    return np.arange(np.ceil(first), np.floor(last) + 0.5 * step, step)


def in_time(time_s: FloatArray, grid_s: FloatArray, late_s: float, more_s: float) -> FloatArray:
    """Return stamps on the common clock."""
    middle, half = 0.5 * (grid_s[0] + grid_s[-1]), max(0.5 * (grid_s[-1] - grid_s[0]), 1.0)
    return np.asarray(time_s - late_s - more_s * (time_s - late_s - middle) / half)


def on_grid(track: UnitTrack | ReferenceTrack, grid_s: FloatArray) -> OnGrid:
    """Interpolate a track to the grid."""
    latitude, longitude = on_earth(track.latitude_deg, track.longitude_deg)
    longitude = _unwrapped(longitude)
    heading = np.full(len(track.time_s), np.nan) if track.heading_deg is None else track.heading_deg
    altitude = getattr(track, "altitude_m", None)
    columns = [
        *(latitude, longitude, np.zeros(len(latitude)) if altitude is None else np.nan_to_num(altitude)),
        *(*track.velocity_mps.T, np.rad2deg(_unwrapped_rad(np.deg2rad(heading)))),
    ]
    found = [_interpolated(track.time_s, column, grid_s) for column in columns]
    velocity = np.column_stack(found[3:5])
    return OnGrid(grid_s, found[0], found[1], np.nan_to_num(found[2]), velocity, found[5])


def _unwrapped(longitude_deg: FloatArray) -> FloatArray:
    return np.asarray(np.rad2deg(_unwrapped_rad(np.deg2rad(longitude_deg))))


def _unwrapped_rad(angle_rad: FloatArray) -> FloatArray:
    out, known = angle_rad.copy(), np.isfinite(angle_rad)
    out[known] = np.unwrap(angle_rad[known])
    return out


def _interpolated(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    known = np.isfinite(values)
    if known.sum() < 2:
        return np.full(len(at_s), np.nan)
    time, value = time_s[known], values[known]
    gap_s = max(GAP_S, GAP_STEPS * float(np.median(np.diff(time))))
    after = np.clip(np.searchsorted(time, at_s), 1, len(time) - 1)
    inside = (at_s >= time[0] - 1e-6) & (at_s <= time[-1] + 1e-6) & (time[after] - time[after - 1] <= gap_s)
    return np.where(inside, np.interp(at_s, time, value), np.nan)


def apart_m(one: OnGrid, other: OnGrid) -> FloatArray:
    """Return the position of one less that of another, metres north and east, shape (n, 2)."""
    meridian, prime_vertical = curvature_radii_m(np.nan_to_num(other.latitude_deg))
    altitude = one.altitude_m
    north = np.deg2rad(one.latitude_deg - other.latitude_deg) * (meridian + altitude)
    parallel = (prime_vertical + altitude) * np.cos(np.deg2rad(other.latitude_deg))
    return np.stack([north, np.deg2rad(wrap_180(one.longitude_deg - other.longitude_deg)) * parallel], axis=1)


def heading_apart_deg(one: OnGrid, other: OnGrid) -> float | None:
    """Return the median of the heading of one less that of another, None without one."""
    apart = wrap_180(one.heading_deg - other.heading_deg)
    known = apart[np.isfinite(apart)]
    return float(np.median(known)) if len(known) else None


def moved_m(one: OnGrid) -> FloatArray:
    """Return how far its position moves from row to row, metres, shape (n - 1, 2)."""
    later = replace(one, **{name: getattr(one, name)[1:] for name in _ROWS})
    earlier = replace(one, **{name: getattr(one, name)[:-1] for name in _ROWS})
    return apart_m(later, earlier)


_ROWS = ("time_s", "latitude_deg", "longitude_deg", "altitude_m", "velocity_mps", "heading_deg")
