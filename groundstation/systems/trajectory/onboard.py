"""Errors of the on-board filter: its output minus the smoothed solution, constants apart.

An offset that is the same all through the log is how the units are mounted, or where their antennas are, or a height
of another datum. It is told and taken off; the filter is never blamed for it. A delay of its stamps likewise.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.systems.trajectory.arrays import TrajectoryOnboard
from groundstation.systems.trajectory.onboard_answer import OnboardErrors
from groundstation.systems.trajectory.onboard_errors import delay_of, errors_of
from groundstation.systems.trajectory.onboard_output import FEWEST, output_of, with_down
from groundstation.systems.trajectory.onboard_rows import UPWARD, TimeBins, ToldConstant, figure_of, rows_of
from groundstation.systems.trajectory.sampling import at_times, every
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.tables.table import Flight

STATE_STEP_S = 0.04  # states between which ours is a straight line


@dataclass(frozen=True)
class ComparedFilter:
    """Errors by quantity, and the columns of their figure."""

    errors: OnboardErrors
    figure: TrajectoryOnboard


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
    output, track = output_of(flight, topic), every(track, STATE_STEP_S)
    if output is None or np.isfinite(at_times(track, output.time_s).heading_deg).sum() < FEWEST:
        return None
    output, is_upward = with_down(output, at_times(track, output.time_s).velocity_mps[:, 2])
    delay = delay_of(track, output)
    found = errors_of(track, output, delay.value if delay.is_told else 0.0)
    bins = TimeBins(output.time_s)
    figure = figure_of(found, output, bins)
    rows = tuple(rows_of(found, figure, bins, UPWARD if is_upward else ToldConstant()))
    if not rows:
        return None
    is_seen = np.isfinite(delay.sigma)
    errors = OnboardErrors(topic, rows, delay.value if is_seen else None, delay.sigma if is_seen else None)
    return ComparedFilter(errors, figure)
