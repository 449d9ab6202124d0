"""Rows and figure of the errors of an on-board filter."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from groundstation.methods.intervals import effective_samples
from groundstation.systems.trajectory.arrays import TrajectoryOnboard
from groundstation.systems.trajectory.onboard_answer import OffsetCause, OnboardError
from groundstation.systems.trajectory.onboard_changes import Absolute, judged
from groundstation.systems.trajectory.onboard_errors import ErrorsOfOutput
from groundstation.systems.trajectory.onboard_offsets import (
    Constant,
    PlaceOffset,
)
from groundstation.systems.trajectory.onboard_output import FEWEST, FilterOutput
from groundstation.systems.trajectory.quantity_answer import LEAST_ERROR, UNITS, Quantity
from groundstation.systems.trajectory.solution import FloatArray

BIN_S, MOST_BINS = 1.0, 20_000  # errors are judged and shown as medians over it
ANGLES: tuple[Quantity, ...] = ("roll", "pitch", "heading")
NOTHING = Constant(0.0, 0.0)
PLACE_SIGMA_M = 15.0  # of the point of a filter on its vehicle
HEIGHT_SIGMA_M = 60.0  # of one datum of heights against another
KNOWN_DEG = 10.0  # axes of a filter that are less sure are not known
AbsoluteAngles = tuple[Absolute, Absolute, Absolute]


class TimeBins:
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


def figure_of(found: ErrorsOfOutput, output: FilterOutput, bins: TimeBins) -> TrajectoryOnboard:
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


class ToldConstant(NamedTuple):
    """Constant of a quantity with its sigma, its cause and the words for it."""

    value: float | None = None
    sigma: float | None = None
    cause: OffsetCause = ""
    words: str = ""


UPWARD = ToldConstant(cause="sign", words="logged with the other sign: up, not down")


def rows_of(
    found: ErrorsOfOutput, figure: TrajectoryOnboard, bins: TimeBins, down: ToldConstant, axes: AbsoluteAngles
) -> list[OnboardError]:
    """Return a row for each quantity that the filter logs."""
    ours = found.ours
    rows: list[OnboardError | None] = []
    binned = ((figure.roll_deg, figure.roll_sigma_deg), (figure.pitch_deg, figure.pitch_sigma_deg))
    for axis, (shown, sigma) in enumerate((*binned, (figure.heading_deg, figure.heading_sigma_deg))):
        offset = found.attitude_offsets[axis]
        told = _told(offset, "mounting", f"{ANGLES[axis] if axis < 2 else 'yaw'} {offset.value:+.2f} deg")
        own = ours.attitude_sigma_deg[:, axis]
        row = _row(ANGLES[axis], found.attitude_deg[:, axis], own, told, (shown, sigma), bins, axes[axis])
        rows.append(None if row is None else replace(row, judged_share=float(found.attitude_judged[axis])))
    rows = [rows[2], rows[0], rows[1]]
    plane = (
        np.column_stack([figure.velocity_north_mps, figure.velocity_east_mps]),
        figure.horizontal_velocity_sigma_mps,
    )
    own = np.hypot(ours.velocity_sigma_mps[:, 0], ours.velocity_sigma_mps[:, 1])
    rows.append(_row("horizontal velocity", found.velocity_mps[:, :2], own, ToldConstant(), plane, bins))
    climb = (figure.velocity_down_mps, figure.vertical_velocity_sigma_mps)
    own = ours.velocity_sigma_mps[:, 2]
    rows.append(_row("vertical velocity", found.velocity_mps[:, 2], own, down, climb, bins))
    place = (np.column_stack([figure.position_north_m, figure.position_east_m]), figure.horizontal_position_sigma_m)
    own = np.hypot(ours.position_sigma_m[:, 0], ours.position_sigma_m[:, 1])
    far = Absolute(bins.medians(np.linalg.norm(found.plane_m + found.place.fitted, axis=1)), PLACE_SIGMA_M)
    rows.append(_row("horizontal position", found.plane_m, own, _told_place(found.place), place, bins, far))
    level = (figure.height_m, figure.vertical_position_sigma_m)
    told = _told(found.height_offset, "datum", f"height {found.height_offset.value:+.2f} m (datum or antenna)")
    high = Absolute(figure.height_m + found.height_offset.value, HEIGHT_SIGMA_M)
    rows.append(_row("vertical position", found.height_m, ours.position_sigma_m[:, 2], told, level, bins, high))
    return [one for one in rows if one is not None]


def _told(offset: Constant, cause: OffsetCause, words: str) -> ToldConstant:
    if not np.isfinite(offset.sigma):
        return ToldConstant()
    return ToldConstant(offset.value, offset.sigma, *((cause, words) if offset.is_told else ("", "")))


def _told_place(place: PlaceOffset) -> ToldConstant:
    """Return the constant place: on the vehicle and on the earth where they differ from zero."""
    if not np.isfinite(place.forward.sigma):
        return ToldConstant()
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
    return ToldConstant(
        told.value, told.sigma, "antenna" if cause == "antenna" else "datum" if cause else "", "; ".join(words)
    )


def _length(first: Constant, second: Constant) -> Constant:
    return Constant(float(np.hypot(first.value, second.value)), float(np.hypot(first.sigma, second.sigma)) / 2.0**0.5)


def _row(
    quantity: Quantity,
    error: FloatArray,
    own_sigma: FloatArray,
    told: ToldConstant,
    binned: tuple[FloatArray, FloatArray],
    bins: TimeBins,
    absolute: Absolute | None = None,
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
    by_axes = absolute.sigma if quantity in ANGLES and absolute is not None else float("inf")
    by_parts = judged(bins.time_s, shown, axis_sigma, told.sigma or 0.0, LEAST_ERROR[quantity], absolute)
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
        spans=by_parts.spans,
        changes=by_parts.changes,
        axes_sigma=by_axes if by_axes < KNOWN_DEG else None,
    )
