"""Errors of the on-board filter: its output minus the smoothed solution, constants apart.

An offset that is the same all through the log is how the units are mounted, or where their antennas are, or a height
of another datum. It is told and taken off; the filter is never blamed for it. A delay of its stamps likewise.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory.arrays import TrajectoryOnboard
from groundstation.systems.trajectory.onboard_answer import OnboardErrors
from groundstation.systems.trajectory.onboard_axes import FilterAxes, axes_of
from groundstation.systems.trajectory.onboard_changes import Absolute, judged
from groundstation.systems.trajectory.onboard_errors import ErrorsOfOutput, delay_of, errors_of
from groundstation.systems.trajectory.onboard_filters import LoggedFilter
from groundstation.systems.trajectory.onboard_offsets import Constant
from groundstation.systems.trajectory.onboard_output import FEWEST, FilterOutput, output_of, with_down
from groundstation.systems.trajectory.onboard_rows import ANGLES, UPWARD, TimeBins, ToldConstant, figure_of, rows_of
from groundstation.systems.trajectory.quantity_answer import LEAST_ERROR
from groundstation.systems.trajectory.sampling import at_times, every
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.tables.table import Flight

STATE_STEP_S = 0.04  # states between which ours is a straight line


@dataclass(frozen=True)
class ComparedFilter:
    """Errors by quantity, and the columns of their figure."""

    errors: OnboardErrors
    figure: TrajectoryOnboard


def compare_onboard(
    track: TrackOfStates, flight: Flight, of: LoggedFilter, *, is_own: bool = False
) -> ComparedFilter | None:
    """Compare the output of an on-board filter with the smoothed solution.

    Parameters
    ----------
    track : TrackOfStates
        Smoothed, sigmas already raised.
    flight : Flight
    of : LoggedFilter
    is_own : bool
        The filter is the autopilot's own, and so are the samples of the unit.

    Returns
    -------
    ComparedFilter, or None where fewer than 30 samples stand beside the track.

    Notes
    -----
    The attitude of the filter is ours times a constant turn, found as the robust mean of all; so a case that lies on
    its side does as well. Its place is ours and a constant on the vehicle (antenna) and on the earth (datum). All of
    its stamps may be late by one delay, found by the rates of attitude and velocity.

    A constant that changes was right in one part of the log. In which is told where the axes of the filter against ours
    are known, by how both see the vehicle turn, and one part alone agrees with them; else it is left open.

    It ignores a filter that is wrong by the same all through the log: that is taken for mounting.
    """
    output, track = output_of(flight, of), every(track, STATE_STEP_S)
    if output is None or np.isfinite(at_times(track, output.time_s).heading_deg).sum() < FEWEST:
        return None
    output, is_upward = with_down(output, at_times(track, output.time_s).velocity_mps[:, 2])
    delay = delay_of(track, output)
    found = errors_of(track, output, delay.value if delay.is_told else 0.0)
    bins = TimeBins(output.time_s)
    axes = _absolute(found, output, bins, axes_of(found.ours, output, is_own=is_own))
    found = _by_axes(found, bins, axes)
    figure = figure_of(found, output, bins)
    rows = tuple(rows_of(found, figure, bins, UPWARD if is_upward else ToldConstant(), axes))
    if not rows:
        return None
    errors = OnboardErrors(of.topic, rows, name=of.name, flew=of.flew, flew_source=of.source)
    if np.isfinite(delay.sigma):
        errors = replace(errors, delay_s=delay.value, delay_sigma_s=delay.sigma)
    return ComparedFilter(errors, figure)


def _absolute(
    found: ErrorsOfOutput, output: FilterOutput, bins: TimeBins, axes: FilterAxes | None
) -> tuple[Absolute, Absolute, Absolute]:
    """Return errors of roll, pitch and heading with nothing taken off."""
    if axes is None:
        nothing = Absolute(np.full(len(bins.time_s), np.nan), float("inf"))
        return nothing, nothing, nothing
    error = axes.errors_deg(found.ours, output)
    roll, pitch, heading = (
        Absolute(bins.medians(error[:, axis]), float(axes.sigma_deg[axis])) for axis in range(len(ANGLES))
    )
    return roll, pitch, heading


def _by_axes(found: ErrorsOfOutput, bins: TimeBins, axes: tuple[Absolute, Absolute, Absolute]) -> ErrorsOfOutput:
    """Return the errors with the constant of the part in which the filter was right."""
    attitude, offsets = found.attitude_deg.copy(), list(found.attitude_offsets)
    for axis, quantity in enumerate(ANGLES):
        shown = bins.medians(attitude[:, axis])
        sigma = bins.medians(found.ours.attitude_sigma_deg[:, axis])
        offset = offsets[axis]
        spread = offset.sigma if np.isfinite(offset.sigma) else 0.0
        shift = judged(bins.time_s, shown, sigma, spread, LEAST_ERROR[quantity], axes[axis]).shift
        attitude[:, axis] -= shift
        offsets[axis] = Constant(float(wrap_180(offset.value + shift)), offset.sigma)
    roll, pitch, heading = offsets
    return replace(found, attitude_deg=attitude, attitude_offsets=(roll, pitch, heading))
