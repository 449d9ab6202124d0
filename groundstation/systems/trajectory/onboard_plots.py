"""Plots of the errors of the on-board filter, in the 95 % band of the smoothed solution."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import has_values, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Floats
from groundstation.plots.plot import Axis, Panel, Plot, Row
from groundstation.plots.ranges import broken_at_gaps, broken_at_wrap, finite, symmetric
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.arrays import TrajectoryOnboard

PANEL_MM = 26.0
USUAL_SHARE = 0.99  # of the values that an axis holds; a few far ones may leave it


def onboard_attitude(results: FlightResults) -> Plot | None:
    """Return errors of heading, roll and pitch of the on-board filter, and our 95 %."""
    data = results.rows_of(TrajectoryOnboard)
    if data is None:
        return None
    shown = (
        ("heading error, °", data.heading_deg, data.heading_sigma_deg),
        ("roll error, °", data.roll_deg, data.roll_sigma_deg),
        ("pitch error, °", data.pitch_deg, data.pitch_sigma_deg),
    )
    return _errors(data, shown, "attitude", "Errors of the on-board filter: heading, roll, pitch")


def onboard_motion(results: FlightResults) -> Plot | None:
    """Return errors of velocity and place of the on-board filter, and our 95 %."""
    data = results.rows_of(TrajectoryOnboard)
    if data is None:
        return None
    one_axis = 0.5**0.5
    speed, place = one_axis * data.horizontal_velocity_sigma_mps, one_axis * data.horizontal_position_sigma_m
    shown = (
        ("north, m/s", data.velocity_north_mps, speed),
        ("east, m/s", data.velocity_east_mps, speed),
        ("down, m/s", data.velocity_down_mps, data.vertical_velocity_sigma_mps),
        ("north, m", data.position_north_m, place),
        ("east, m", data.position_east_m, place),
        ("height, m", data.height_m, data.vertical_position_sigma_m),
    )
    return _errors(data, shown, "motion", "Errors of the on-board filter: velocity, place", 24.0)


def _errors(
    data: TrajectoryOnboard,
    shown: Sequence[tuple[str, Floats, Floats]],
    name: str,
    title: str,
    height_mm: float = PANEL_MM,
) -> Plot | None:
    known = [one for one in shown if has_values(one[1])]
    if not known:
        return None
    ends = time_axis(*span(data.time_s))
    rows: list[Row] = []
    for axis, values, sigma in known:
        time_s, error, half = broken_at_gaps(data.time_s, values, NORMAL_95 * sigma)
        line_s, line = broken_at_wrap(time_s, error) if axis.endswith("°") else (time_s, error)
        marks: list[AnyMark] = [
            Band(x=time_s, low=-half, high=half, role="answer", name="95 % of the smoothed solution"),
            ZERO,
            Curve(x=line_s, y=line, role="ins", name="on-board − smoothed"),
        ]
        low, high = symmetric(np.append(usual(values), usual(half[np.isfinite(error)])), 1e-3)
        panel = Panel(marks, ends, Axis(axis, low=low, high=high), legend="" if rows else "above")
        rows.append(Row((panel,), height_mm, shares_x=axis != known[-1][0]))
    return Plot(
        f"trajectory.onboard_{name}",
        title,
        "On-board filter minus smoothed solution, each a median over a second; what is constant all through the log is "
        "taken off. Beyond the band the filter is wrong.",
        f"{title} over flight time, with the 95 % band of the smoothed solution.",
        tuple(rows),
        ("trajectory_onboard",),
    )


def usual(values: Floats) -> Floats:
    """Return values without the few that are far beyond the others."""
    known = finite(values)
    if not len(known):
        return known
    size = np.abs(known)
    most = float(np.quantile(size, USUAL_SHARE))
    return known if size.max() < 4.0 * most else np.asarray(known[size <= 1.5 * most])
