"""Errors of the on-board filter: its output minus the smoothed solution, constants apart.

An offset that is the same all through the log is how the units are mounted, or where their antennas are, or a height
of another datum. It is told and taken off; the filter is never blamed for it. A delay of its stamps likewise.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import mean_heading, wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.geodesy import has_position, north_east_m
from groundstation.base.records import HEADING_IS_TRACK
from groundstation.methods.intervals import effective_samples
from groundstation.systems.trajectory.arrays import TrajectoryOnboard
from groundstation.systems.trajectory.figures import offsets_m
from groundstation.systems.trajectory.onboard_answer import OffsetCause, OnboardError, OnboardErrors
from groundstation.systems.trajectory.onboard_offsets import (
    Constant,
    PlaceOffset,
    arm_by_turning,
    centre_of,
    constant_turn,
    euler_deg,
    place_offset,
    time_shift,
)
from groundstation.systems.trajectory.onboard_spans import wrong_spans
from groundstation.systems.trajectory.quantity_answer import LEAST_ERROR, UNITS, Quantity
from groundstation.systems.trajectory.sampling import at_times, every, thinned
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates
from groundstation.tables.table import Flight, Table

STEP_S = 0.1  # faster output says no more
STATE_STEP_S = 0.04  # states between which ours is a straight line
MOST_SAMPLES = 100_000
BIN_S, MOST_BINS = 1.0, 20_000  # errors are judged and shown as medians over it
FEWEST = 30  # samples beside the track
RATE_S = 0.1  # half the time over which rates are taken
SHIFT_STEPS, MOST_SHIFT_S = 4, 1.0
OPPOSITE = -0.8  # correlation with ours below which the sign of a velocity is the other one
STEEP_DEG = 80.0  # pitch beyond which roll and heading say little
ANGLES: tuple[Quantity, ...] = ("roll", "pitch", "heading")
NOTHING = Constant(0.0, 0.0)


@dataclass(frozen=True)
class ComparedFilter:
    """Errors by quantity, and the columns of their figure."""

    errors: OnboardErrors
    figure: TrajectoryOnboard


@dataclass(frozen=True)
class _Output:
    """Output of the filter, NaN where not logged.

    Roll, pitch, heading and velocity have shape (n, 3). ``plane_m`` is north and east of an origin that is not logged,
    where there is no latitude.
    """

    time_s: FloatArray
    attitude_deg: FloatArray
    velocity_mps: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    plane_m: FloatArray


@dataclass(frozen=True)
class _Errors:
    """Errors at the samples, constants taken off, and these."""

    ours: TrackOfStates
    attitude_deg: FloatArray
    attitude_offsets: tuple[Constant, Constant, Constant]
    velocity_mps: FloatArray
    plane_m: FloatArray
    place: PlaceOffset
    height_m: FloatArray
    height_offset: Constant


def compare_onboard(track: TrackOfStates, flight: Flight, topic: str) -> ComparedFilter | None:
    """Compare the output of an on-board filter with the smoothed solution.

    Parameters
    ----------
    track : TrackOfStates
        Smoothed, sigmas already raised.
    flight : Flight
    topic : str
        ``ins``, or one of its kind.

    Returns
    -------
    ComparedFilter, or None where fewer than 30 samples stand beside the track.

    Notes
    -----
    The attitude of the filter is ours times a constant turn, found as the robust mean of all; so a case that lies on
    its side does as well. Its place is ours and a constant on the vehicle (antenna) and on the earth (datum). All of
    its stamps may be late by one delay, found by the rates of attitude and velocity.

    It ignores a filter that is wrong by the same all through the log: that is taken for mounting.
    """
    output, track = _output(flight, topic), every(track, STATE_STEP_S)
    if output is None or np.isfinite(at_times(track, output.time_s).heading_deg).sum() < FEWEST:
        return None
    output, is_upward = _with_down(output, at_times(track, output.time_s).velocity_mps[:, 2])
    delay = _delay(track, output)
    found = _errors(track, output, delay.value if delay.is_told else 0.0)
    bins = _Bins(output.time_s)
    figure = _figure(found, output, bins)
    rows = tuple(_rows(found, figure, bins, UPWARD if is_upward else _Told()))
    if not rows:
        return None
    is_seen = np.isfinite(delay.sigma)
    errors = OnboardErrors(topic, rows, delay.value if is_seen else None, delay.sigma if is_seen else None)
    return ComparedFilter(errors, figure)


def _output(flight: Flight, topic: str) -> _Output | None:
    table: Table = flight[topic].trusted().unique_times()
    if len(table) < FEWEST:
        return None
    time_s = flight.seconds(table.time_ns)
    step_s = max(STEP_S, float(time_s[-1] - time_s[0]) / MOST_SAMPLES)
    table = table.take(thinned(time_s, step_s))
    is_track = f"{HEADING_IS_TRACK}.{topic}.true_heading_deg" in flight.metadata
    heading = np.full(len(table), np.nan) if is_track else table.values("true_heading_deg")
    height = table.values("altitude_ellipsoid_m")
    for values in (table.values("altitude_msl_m"), -table.values("position_down_m")):
        height = height if np.isfinite(height).any() else values
    latitude, longitude = table.values("latitude_deg"), table.values("longitude_deg")
    is_place = has_position(latitude, longitude)
    return _Output(
        flight.seconds(table.time_ns),
        np.column_stack([table.values("roll_deg"), table.values("pitch_deg"), heading]),
        np.column_stack([table.values(f"velocity_{axis}_mps") for axis in ("north", "east", "down")]),
        np.where(is_place, latitude, np.nan),
        np.where(is_place, longitude, np.nan),
        height,
        np.column_stack([table.values(f"position_{axis}_m") for axis in ("north", "east")]),
    )


def _with_down(output: _Output, down_mps: FloatArray) -> tuple[_Output, bool]:
    """Return the output with its velocity downward, and whether it logs it upward."""
    theirs = output.velocity_mps[:, 2]
    known = np.isfinite(theirs) & np.isfinite(down_mps)
    if known.sum() < FEWEST or not np.std(down_mps[known]) * np.std(theirs[known]) > 0.0:
        return output, False
    if np.corrcoef(theirs[known], down_mps[known])[0, 1] > OPPOSITE:
        return output, False
    return replace(output, velocity_mps=output.velocity_mps * np.array([1.0, 1.0, -1.0])), True


def _delay(track: TrackOfStates, output: _Output) -> Constant:
    """Return how much later than ours the stamps of the filter are."""
    shift = Constant(0.0, float("inf"))
    for _ in range(SHIFT_STEPS):
        at_s = output.time_s - shift.value
        ours = at_times(track, at_s)
        turn = _turn(output, ours)
        before, after = (_expected(at_times(track, at_s + part), turn) for part in (-RATE_S, RATE_S))
        error = np.column_stack([output.attitude_deg, output.velocity_mps]) - _expected(ours, turn)
        error[:, :3] = _flat(error[:, :3])
        rate = (after - before) / (2.0 * RATE_S)
        rate[:, :3] = wrap_180(after[:, :3] - before[:, :3]) / (2.0 * RATE_S)
        step = time_shift(*(_without_sideways(one, ours.heading_deg) for one in (error, rate)))
        if not np.isfinite(step.sigma) or abs(shift.value + step.value) > MOST_SHIFT_S:
            return Constant(0.0, float("inf"))
        shift = Constant(shift.value + step.value, step.sigma)
    return shift


def _without_sideways(values: FloatArray, heading_deg: FloatArray) -> FloatArray:
    """Return angles and velocities without the part across the heading.

    There a delay looks as an antenna ahead of ours.
    """
    heading = np.deg2rad(heading_deg)
    along = values[:, 3] * np.cos(heading) + values[:, 4] * np.sin(heading)
    return np.column_stack([values[:, :3], along, values[:, 5]])


def _flat(angle_deg: FloatArray) -> FloatArray:
    """Return differences of angles about their mean, so that none lies at the seam."""
    return np.asarray(wrap_180(angle_deg - _means(angle_deg)))


def _means(angle_deg: FloatArray) -> FloatArray:
    return np.asarray(np.nan_to_num([mean_heading(one) for one in angle_deg.T]))


def _turn(output: _Output, ours: TrackOfStates) -> FloatArray | None:
    """Return the constant turn of the filter's axes; None where an angle is not logged."""
    mine = np.column_stack([ours.roll_deg, ours.pitch_deg, ours.heading_deg])
    known = np.isfinite(mine).all(axis=1) & np.isfinite(output.attitude_deg).all(axis=1)
    if known.sum() < FEWEST:
        return None
    return constant_turn(rotation_n_from_b(mine[known]), rotation_n_from_b(output.attitude_deg[known]))


def _expected(ours: TrackOfStates, turn: FloatArray | None) -> FloatArray:
    """Return attitude in the axes of the filter, and velocity, shape (n, 6)."""
    attitude = np.column_stack([ours.roll_deg, ours.pitch_deg, ours.heading_deg])
    if turn is not None:
        turned = euler_deg(rotation_n_from_b(attitude) @ turn)
        attitude = turned + 0.0 * attitude.sum(axis=1, keepdims=True)  # not known where one of ours is not
    return np.column_stack([attitude, ours.velocity_mps])


def _errors(track: TrackOfStates, output: _Output, delay_s: float) -> _Errors:
    at_s = output.time_s - delay_s
    ours, length_s = at_times(track, at_s), float(at_s[-1] - at_s[0])
    attitude, offsets = _attitude(output, ours, length_s)
    before, after = (at_times(track, at_s + part).heading_deg for part in (-RATE_S, RATE_S))
    rate = np.deg2rad(wrap_180(after - before)) / (2.0 * RATE_S)
    velocity = output.velocity_mps - ours.velocity_mps
    plane, place = _plane(output, ours, length_s, arm_by_turning(velocity[:, :2], ours.heading_deg, rate))
    swing = _swing_mps(place, ours.heading_deg, rate)
    velocity[:, :2] -= np.where(np.isfinite(swing), swing, 0.0)
    height = output.height_m - ours.height_m
    level = centre_of(height, ours.position_sigma_m[:, 2], length_s)
    return _Errors(ours, attitude, offsets, velocity, plane, place, height - level.value, level)


def _attitude(
    output: _Output, ours: TrackOfStates, length_s: float
) -> tuple[FloatArray, tuple[Constant, Constant, Constant]]:
    """Return errors of roll, pitch and heading, and what was constant in them."""
    turn = _turn(output, ours)
    expected = _expected(ours, turn)[:, :3]
    difference = output.attitude_deg - expected
    constant = _means(difference) if turn is None else euler_deg(turn[None])[0]
    error = _flat(difference) if turn is None else np.asarray(wrap_180(difference))
    is_steep = np.repeat(np.abs(expected[:, 1:2]) > STEEP_DEG, 3, axis=1)
    error = np.where(is_steep, np.nan, error)
    found = [centre_of(one, sigma, length_s) for one, sigma in zip(error.T, ours.attitude_sigma_deg.T, strict=True)]
    roll, pitch, heading = (
        Constant(float(wrap_180(base + one.value)), one.sigma) for base, one in zip(constant, found, strict=True)
    )
    return error - np.array([one.value for one in found]), (roll, pitch, heading)


def _plane(
    output: _Output, ours: TrackOfStates, length_s: float, arm: tuple[Constant, Constant]
) -> tuple[FloatArray, PlaceOffset]:
    """Return errors north and east, and what was constant in them."""
    if np.isfinite(output.latitude_deg).any():
        theirs = (output.latitude_deg, output.longitude_deg, output.height_m)
        error = offsets_m(theirs, (ours.latitude_deg, ours.longitude_deg, ours.height_m))[:, :2]
    else:
        first = int(np.argmax(np.isfinite(ours.latitude_deg)))
        origin = (float(ours.latitude_deg[first]), float(ours.longitude_deg[first]))
        error = output.plane_m - np.column_stack(north_east_m(ours.latitude_deg, ours.longitude_deg, *origin))
    sigma = np.hypot(ours.position_sigma_m[:, 0], ours.position_sigma_m[:, 1]) / 2.0**0.5
    place = place_offset(error, ours.heading_deg, sigma, length_s, arm)
    return error - place.fitted, place


def _swing_mps(place: PlaceOffset, heading_deg: FloatArray, rate_radps: FloatArray) -> FloatArray:
    """Return the velocity north and east that turning gives a place on the vehicle."""
    forward, right = (one.value if one.is_told else 0.0 for one in (place.forward, place.right))
    heading = np.deg2rad(heading_deg)
    north = -forward * np.sin(heading) - right * np.cos(heading)
    east = forward * np.cos(heading) - right * np.sin(heading)
    return rate_radps[:, None] * np.column_stack([north, east])


class _Bins:
    """Bins of a second, or longer where the log is long, that have a sample."""

    def __init__(self, time_s: FloatArray) -> None:
        self.width_s = max(BIN_S, float(time_s[-1] - time_s[0]) / MOST_BINS)
        _slots, self.of, self.counts = np.unique(
            np.floor((time_s - time_s[0]) / self.width_s), return_inverse=True, return_counts=True
        )
        self.time_s = np.bincount(self.of, time_s) / self.counts

    def medians(self, values: FloatArray) -> FloatArray:
        """Return the median of each bin, NaN where it has none."""
        order = np.lexsort((values, self.of))  # NaN stands last
        known = np.bincount(self.of, np.isfinite(values)).astype(np.int64)
        starts = np.cumsum(self.counts) - self.counts
        ordered = values[order]
        low, high = starts + np.maximum(known - 1, 0) // 2, starts + known // 2
        middle = 0.5 * (ordered[low] + ordered[np.minimum(high, len(values) - 1)])
        return np.where(known > 0, middle, np.nan)


def _figure(found: _Errors, output: _Output, bins: _Bins) -> TrajectoryOnboard:
    ours, medians = found.ours, bins.medians
    velocity_sigma, position_sigma = ours.velocity_sigma_mps, ours.position_sigma_m
    attitude, angle_sigma = found.attitude_deg, ours.attitude_sigma_deg
    middle = np.searchsorted(output.time_s, bins.time_s).clip(0, len(output.time_s) - 1)
    return TrajectoryOnboard(
        time_s=bins.time_s,
        heading_deg=medians(attitude[:, 2]),
        heading_sigma_deg=medians(angle_sigma[:, 2]),
        roll_deg=medians(attitude[:, 0]),
        roll_sigma_deg=medians(angle_sigma[:, 0]),
        pitch_deg=medians(attitude[:, 1]),
        pitch_sigma_deg=medians(angle_sigma[:, 1]),
        velocity_north_mps=medians(found.velocity_mps[:, 0]),
        velocity_east_mps=medians(found.velocity_mps[:, 1]),
        horizontal_velocity_sigma_mps=medians(np.hypot(velocity_sigma[:, 0], velocity_sigma[:, 1])),
        velocity_down_mps=medians(found.velocity_mps[:, 2]),
        vertical_velocity_sigma_mps=medians(velocity_sigma[:, 2]),
        position_north_m=medians(found.plane_m[:, 0]),
        position_east_m=medians(found.plane_m[:, 1]),
        horizontal_position_sigma_m=medians(np.hypot(position_sigma[:, 0], position_sigma[:, 1])),
        height_m=medians(found.height_m),
        vertical_position_sigma_m=medians(position_sigma[:, 2]),
        latitude_deg=output.latitude_deg[middle],
        longitude_deg=output.longitude_deg[middle],
    )


class _Told(NamedTuple):
    """Constant of a quantity with its sigma, its cause and the words for it."""

    value: float | None = None
    sigma: float | None = None
    cause: OffsetCause = ""
    words: str = ""


UPWARD = _Told(cause="sign", words="logged with the other sign: up, not down")


def _rows(found: _Errors, figure: TrajectoryOnboard, bins: _Bins, down: _Told) -> list[OnboardError]:
    ours = found.ours
    rows: list[OnboardError | None] = []
    binned = ((figure.roll_deg, figure.roll_sigma_deg), (figure.pitch_deg, figure.pitch_sigma_deg))
    for axis, (shown, sigma) in enumerate((*binned, (figure.heading_deg, figure.heading_sigma_deg))):
        offset = found.attitude_offsets[axis]
        told = _told(offset, "mounting", f"{ANGLES[axis] if axis < 2 else 'yaw'} {offset.value:+.2f} deg")
        own = ours.attitude_sigma_deg[:, axis]
        rows.append(_row(ANGLES[axis], found.attitude_deg[:, axis], own, told, (shown, sigma), bins))
    rows = [rows[2], rows[0], rows[1]]
    plane = (
        np.column_stack([figure.velocity_north_mps, figure.velocity_east_mps]),
        figure.horizontal_velocity_sigma_mps,
    )
    own = np.hypot(ours.velocity_sigma_mps[:, 0], ours.velocity_sigma_mps[:, 1])
    rows.append(_row("horizontal velocity", found.velocity_mps[:, :2], own, _Told(), plane, bins))
    climb = (figure.velocity_down_mps, figure.vertical_velocity_sigma_mps)
    own = ours.velocity_sigma_mps[:, 2]
    rows.append(_row("vertical velocity", found.velocity_mps[:, 2], own, down, climb, bins))
    place = (np.column_stack([figure.position_north_m, figure.position_east_m]), figure.horizontal_position_sigma_m)
    own = np.hypot(ours.position_sigma_m[:, 0], ours.position_sigma_m[:, 1])
    rows.append(_row("horizontal position", found.plane_m, own, _told_place(found.place), place, bins))
    level = (figure.height_m, figure.vertical_position_sigma_m)
    told = _told(found.height_offset, "datum", f"height {found.height_offset.value:+.2f} m (datum or antenna)")
    rows.append(_row("vertical position", found.height_m, ours.position_sigma_m[:, 2], told, level, bins))
    return [one for one in rows if one is not None]


def _told(offset: Constant, cause: OffsetCause, words: str) -> _Told:
    if not np.isfinite(offset.sigma):
        return _Told()
    return _Told(offset.value, offset.sigma, *((cause, words) if offset.is_told else ("", "")))


def _told_place(place: PlaceOffset) -> _Told:
    """Return the constant place: on the vehicle and on the earth where they differ from zero."""
    if not np.isfinite(place.forward.sigma):
        return _Told()
    words, cause, told = [], "", NOTHING
    on_vehicle = (("forward", "aft", place.forward), ("right", "left", place.right))
    on_earth = (("north", "south", place.north), ("east", "west", place.east))
    for kind, what, pair in (("antenna", "antenna or reference point", on_vehicle), ("datum", "datum", on_earth)):
        if any(one.is_told for _positive, _negative, one in pair):
            where = ", ".join(
                f"{abs(one.value):.2f} m {positive if one.value >= 0.0 else negative}"
                for positive, negative, one in pair
            )
            words.append(f"{what} {where}")
            cause = cause or kind
            told = told if told is not NOTHING else _length(pair[0][2], pair[1][2])
    if told is NOTHING:
        told = _length(place.forward, place.right)
    return _Told(
        told.value, told.sigma, "antenna" if cause == "antenna" else "datum" if cause else "", "; ".join(words)
    )


def _length(first: Constant, second: Constant) -> Constant:
    return Constant(float(np.hypot(first.value, second.value)), float(np.hypot(first.sigma, second.sigma)) / 2.0**0.5)


def _row(
    quantity: Quantity,
    error: FloatArray,
    own_sigma: FloatArray,
    told: _Told,
    binned: tuple[FloatArray, FloatArray],
    bins: _Bins,
) -> OnboardError | None:
    """Return the row of a quantity; None where the filter does not log it."""
    size = np.hypot(error[:, 0], error[:, 1]) if error.ndim > 1 else np.abs(error)
    known = np.isfinite(size) & np.isfinite(own_sigma)
    if known.sum() < FEWEST:
        return None
    shown, sigma = binned
    first = shown[:, 0] if shown.ndim > 1 else shown
    seen = first[np.isfinite(first)]
    axis_sigma = sigma / 2.0**0.5 if shown.ndim > 1 else sigma
    length_s = len(seen) * bins.width_s
    return OnboardError(
        quantity,
        UNITS[quantity],
        int(known.sum()),
        told.value,
        told.sigma,
        told.cause,
        told.words,
        rms=float(np.sqrt(np.mean(size[known] ** 2))),
        sigma_rms=float(np.sqrt(np.mean(own_sigma[known] ** 2))),
        correlation_s=0.5 * length_s / effective_samples(seen),
        spans=wrong_spans(bins.time_s, shown, axis_sigma, told.sigma or 0.0, LEAST_ERROR[quantity]),
    )
