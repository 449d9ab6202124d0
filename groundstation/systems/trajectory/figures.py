"""Accuracy, separation and arrays of a solution, from its states."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.quantiles import NORMAL_95, length_quantile
from groundstation.results.arrays.states import BodyStates
from groundstation.systems.trajectory.answer import TrajectoryAccuracy, TrajectorySegment
from groundstation.systems.trajectory.arrays import TrajectorySeparation, TrajectoryTrack
from groundstation.systems.trajectory.checks_answer import SeparationRow
from groundstation.systems.trajectory.quantity_answer import UNITS, Quantity
from groundstation.systems.trajectory.sampling import at_times, thinned
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates

MOST_ROWS = 20_000  # of an array that a page shows


def segments_of(track: TrackOfStates) -> tuple[TrajectorySegment, ...]:
    """Return the spans of the segments."""
    breaks = np.flatnonzero(np.diff(track.segment)) + 1
    starts, ends = np.append(0, breaks), np.append(breaks, len(track)) - 1
    return tuple(
        TrajectorySegment(float(track.time_s[start]), float(track.time_s[end]))
        for start, end in zip(starts, ends, strict=True)
    )


def accuracy_of(track: TrackOfStates) -> tuple[TrajectoryAccuracy, ...]:
    """Return median and worst sigma of each quantity, and the bound of 95 % at the median.

    The radius of a horizontal quantity is that of both axes alike: 2.45 times the sigma of one.
    """
    position, velocity, attitude = track.position_sigma_m, track.velocity_sigma_mps, track.attitude_sigma_deg
    plane = length_quantile(0.95, 0.0, 1.0) / 2.0**0.5
    every: tuple[tuple[Quantity, FloatArray, float], ...] = (
        ("heading", attitude[:, 2], NORMAL_95),
        ("tilt", np.max(attitude[:, :2], axis=1), NORMAL_95),
        ("horizontal position", np.hypot(position[:, 0], position[:, 1]), plane),
        ("vertical position", position[:, 2], NORMAL_95),
        ("horizontal velocity", np.hypot(velocity[:, 0], velocity[:, 1]), plane),
        ("vertical velocity", velocity[:, 2], NORMAL_95),
    )
    rows = []
    for quantity, sigma, factor in every:
        known = np.flatnonzero(np.isfinite(sigma))
        if len(known):
            median, worst = float(np.median(sigma[known])), int(known[np.argmax(sigma[known])])
            found = (median, float(sigma[worst]), factor * median, float(track.time_s[worst]))
            rows.append(TrajectoryAccuracy(quantity, UNITS[quantity], *found))
    return tuple(rows)


def track_figure(track: TrackOfStates, other_heading_deg: FloatArray | None = None) -> TrajectoryTrack:
    """Return the columns of a track; of a long one not every state."""
    rows = rows_shown(track.time_s)
    north, east, down = (track.position_sigma_m[rows, axis] for axis in range(3))
    moving = [track.velocity_mps[rows, axis] for axis in range(3)]
    moving_sigma = [track.velocity_sigma_mps[rows, axis] for axis in range(3)]
    turning_sigma = [track.attitude_sigma_deg[rows, axis] for axis in range(3)]
    return TrajectoryTrack(
        time_s=track.time_s[rows],
        segment=track.segment[rows],
        latitude_deg=track.latitude_deg[rows],
        longitude_deg=track.longitude_deg[rows],
        height_m=track.height_m[rows],
        velocity_north_mps=moving[0],
        velocity_east_mps=moving[1],
        velocity_down_mps=moving[2],
        roll_deg=track.roll_deg[rows],
        pitch_deg=track.pitch_deg[rows],
        heading_deg=track.heading_deg[rows],
        position_north_sigma_m=north,
        position_east_sigma_m=east,
        position_down_sigma_m=down,
        velocity_north_sigma_mps=moving_sigma[0],
        velocity_east_sigma_mps=moving_sigma[1],
        velocity_down_sigma_mps=moving_sigma[2],
        roll_sigma_deg=turning_sigma[0],
        pitch_sigma_deg=turning_sigma[1],
        heading_sigma_deg=turning_sigma[2],
        other_heading_deg=None if other_heading_deg is None else other_heading_deg[rows],
    )


def states_of(track: TrackOfStates, height: str) -> BodyStates:
    """Return every state of a track.

    ``height`` is the datum of its heights: ellipsoid, msl, or empty.
    """
    position, velocity, attitude = track.position_sigma_m, track.velocity_sigma_mps, track.attitude_sigma_deg
    return BodyStates(
        time_s=track.time_s,
        segment=track.segment,
        latitude_deg=track.latitude_deg,
        longitude_deg=track.longitude_deg,
        altitude_ellipsoid_m=track.height_m if height == "ellipsoid" else None,
        altitude_msl_m=track.height_m if height == "msl" else None,
        velocity_north_mps=track.velocity_mps[:, 0],
        velocity_east_mps=track.velocity_mps[:, 1],
        velocity_down_mps=track.velocity_mps[:, 2],
        roll_deg=track.roll_deg,
        pitch_deg=track.pitch_deg,
        true_heading_deg=track.heading_deg,
        position_north_sigma_m=position[:, 0],
        position_east_sigma_m=position[:, 1],
        vertical_sigma_m=position[:, 2],
        velocity_north_sigma_mps=velocity[:, 0],
        velocity_east_sigma_mps=velocity[:, 1],
        velocity_down_sigma_mps=velocity[:, 2],
        roll_sigma_deg=attitude[:, 0],
        pitch_sigma_deg=attitude[:, 1],
        true_heading_sigma_deg=attitude[:, 2],
    )


def separation_of(
    forward: TrackOfStates, smoothed: TrackOfStates
) -> tuple[tuple[SeparationRow, ...], TrajectorySeparation]:
    """Return forward filter minus smoothed solution: rows and columns.

    Rows have RMS and worst of each quantity. The forward filter is taken from its own times; they need not be those of
    the smoothed solution.
    """
    rows = rows_shown(forward.time_s)
    time_s = forward.time_s[rows]
    true = at_times(smoothed, time_s)
    position = offsets_m(
        (forward.latitude_deg[rows], forward.longitude_deg[rows], forward.height_m[rows]),
        (true.latitude_deg, true.longitude_deg, true.height_m),
    )
    velocity = forward.velocity_mps[rows] - true.velocity_mps
    attitude = [
        wrap_180(getattr(forward, name)[rows] - getattr(true, name))
        for name in ("roll_deg", "pitch_deg", "heading_deg")
    ]
    figure = TrajectorySeparation(
        time_s=time_s,
        position_north_m=position[:, 0],
        position_east_m=position[:, 1],
        position_down_m=position[:, 2],
        velocity_north_mps=velocity[:, 0],
        velocity_east_mps=velocity[:, 1],
        velocity_down_mps=velocity[:, 2],
        roll_deg=attitude[0],
        pitch_deg=attitude[1],
        heading_deg=attitude[2],
    )
    every: tuple[tuple[Quantity, FloatArray], ...] = (
        ("heading", np.abs(attitude[2])),
        ("tilt", np.maximum(np.abs(attitude[0]), np.abs(attitude[1]))),
        ("horizontal position", np.hypot(position[:, 0], position[:, 1])),
        ("vertical position", np.abs(position[:, 2])),
        ("horizontal velocity", np.hypot(velocity[:, 0], velocity[:, 1])),
        ("vertical velocity", np.abs(velocity[:, 2])),
    )
    return tuple(_separated(every, time_s)), figure


def offsets_m(
    place: tuple[FloatArray, FloatArray, FloatArray], of: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """Return places minus others: north, east, down, shape (n, 3).

    Each place is latitude, longitude, height.
    """
    latitude_deg = 0.5 * (place[0] + of[0])
    meridian, prime_vertical = curvature_radii_m(latitude_deg)
    north = np.deg2rad(place[0] - of[0]) * (meridian + of[2])
    east = np.deg2rad(wrap_180(place[1] - of[1])) * (prime_vertical + of[2]) * np.cos(np.deg2rad(latitude_deg))
    return np.column_stack([north, east, of[2] - place[2]])


def rows_shown(time_s: FloatArray) -> NDArray[np.intp]:
    """Return the places of at most 20 000 states, evenly over time, the last among them."""
    if len(time_s) <= MOST_ROWS:
        return np.arange(len(time_s))
    chosen = thinned(time_s, float(time_s[-1] - time_s[0]) / (MOST_ROWS - 2))
    chosen[-1] = True
    return np.flatnonzero(chosen)


def _separated(every: Sequence[tuple[Quantity, FloatArray]], time_s: FloatArray) -> list[SeparationRow]:
    rows = []
    for quantity, size in every:
        known = np.flatnonzero(np.isfinite(size))
        if len(known):
            worst = int(known[np.argmax(size[known])])
            rms = float(np.sqrt(np.mean(size[known] ** 2)))
            rows.append(SeparationRow(quantity, UNITS[quantity], rms, float(size[worst]), float(time_s[worst])))
    return rows
