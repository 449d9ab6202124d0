"""Errors of an on-board filter at its samples: constants found and taken off."""

import numpy as np

from groundstation.base.angles import mean_heading, wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import north_east_m
from groundstation.systems.trajectory.figures import offsets_m
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
from groundstation.systems.trajectory.onboard_output import FEWEST, FilterOutput
from groundstation.systems.trajectory.quantity_answer import SURE_DEG
from groundstation.systems.trajectory.sampling import at_times
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates

RATE_S = 0.1  # half the time over which rates are taken
SHIFT_STEPS, MOST_SHIFT_S = 4, 1.0
STEEP_DEG = 80.0  # pitch beyond which roll and heading say little


@dataclass(frozen=True)
class ErrorsOfOutput:
    """Errors at the samples, constants taken off, and these.

    ``attitude_judged`` is the share of the samples of roll, pitch and heading beside which ours is sure enough.
    """

    ours: TrackOfStates
    attitude_deg: FloatArray
    attitude_offsets: tuple[Constant, Constant, Constant]
    attitude_judged: FloatArray
    velocity_mps: FloatArray
    plane_m: FloatArray
    place: PlaceOffset
    height_m: FloatArray
    height_offset: Constant


def delay_of(track: TrackOfStates, output: FilterOutput) -> Constant:
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


def _turn(output: FilterOutput, ours: TrackOfStates) -> FloatArray | None:
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


def errors_of(track: TrackOfStates, output: FilterOutput, delay_s: float) -> ErrorsOfOutput:
    at_s = output.time_s - delay_s
    ours, length_s = at_times(track, at_s), float(at_s[-1] - at_s[0])
    attitude, offsets, judged = _attitude(output, ours, length_s)
    before, after = (at_times(track, at_s + part).heading_deg for part in (-RATE_S, RATE_S))
    rate = np.deg2rad(wrap_180(after - before)) / (2.0 * RATE_S)
    velocity = output.velocity_mps - ours.velocity_mps
    plane, place = _plane(output, ours, length_s, arm_by_turning(velocity[:, :2], ours.heading_deg, rate))
    swing = _swing_mps(place, ours.heading_deg, rate)
    velocity[:, :2] -= np.where(np.isfinite(swing), swing, 0.0)
    height = output.height_m - ours.height_m
    level = centre_of(height, ours.position_sigma_m[:, 2], length_s)
    return ErrorsOfOutput(ours, attitude, offsets, judged, velocity, plane, place, height - level.value, level)


def _attitude(
    output: FilterOutput, ours: TrackOfStates, length_s: float
) -> tuple[FloatArray, tuple[Constant, Constant, Constant], FloatArray]:
    """Return errors of roll, pitch and heading, what was constant in them, and judged shares.

    Where ours is not sure itself no error is told.
    """
    turn = _turn(output, ours)
    expected = _expected(ours, turn)[:, :3]
    difference = output.attitude_deg - expected
    constant = _means(difference) if turn is None else euler_deg(turn[None])[0]
    error = _flat(difference) if turn is None else np.asarray(wrap_180(difference))
    is_steep = np.repeat(np.abs(expected[:, 1:2]) > STEEP_DEG, 3, axis=1)
    error = np.where(is_steep, np.nan, error)
    is_sure = ours.attitude_sigma_deg < SURE_DEG
    judged = np.sum(is_sure & np.isfinite(error), axis=0) / np.maximum(np.sum(np.isfinite(error), axis=0), 1)
    error = np.where(is_sure, error, np.nan)
    found = [centre_of(one, sigma, length_s) for one, sigma in zip(error.T, ours.attitude_sigma_deg.T, strict=True)]
    roll, pitch, heading = (
        Constant(float(wrap_180(base + one.value)), one.sigma) for base, one in zip(constant, found, strict=True)
    )
    return error - np.array([one.value for one in found]), (roll, pitch, heading), judged


def _plane(
    output: FilterOutput, ours: TrackOfStates, length_s: float, arm: tuple[Constant, Constant]
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
