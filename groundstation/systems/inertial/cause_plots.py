"""Plots of the errors by cause: velocity error in its parts, errors along the track."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import has_values, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Curve, Dots, Spans, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.cause_answer import CausesResult
from groundstation.systems.inertial.cause_arrays import CausesAlong, CausesOverTime, PartsOfChannel

PANEL_MM = 44.0
PARTS = (
    ("schuler_mps", "Schuler from the start"),
    ("drift_mps", "constant drift"),
    ("azimuth_mps", "azimuth in turns"),
    ("body_mps", "fixed to the aircraft"),
    ("reset_mps", "resets"),
)


def velocity(results: FlightResults) -> Plot | None:
    """Return the velocity error of both channels with the part of each cause."""
    data = results.rows_of(CausesOverTime)
    if data is None or not has_values(data.north.measured_mps, data.east.measured_mps):
        return None
    rows = tuple(
        Row((_parts(data, part, name, has_legend=name == "north"),), PANEL_MM, shares_x=name == "north")
        for name, part in (("north", data.north), ("east", data.east))
    )
    return Plot(
        "causes.velocity",
        "Velocity error by cause",
        "Grey: INS − GNSS, means over ten seconds. Each curve is what one cause makes of it; what they leave is thin.",
        "Velocity error north and east over flight time with the part of each cause.",
        rows,
        ("causes_over_time",),
    )


def _parts(data: CausesOverTime, part: PartsOfChannel, channel: str, *, has_legend: bool) -> Panel:
    marks: list[AnyMark] = [ZERO, Dots(x=data.time_s, y=part.measured_mps, role="unused", name="INS − GNSS")]
    for place, (column, name) in enumerate(PARTS):
        values = getattr(part, column)
        if np.any(values != 0.0):
            marks.append(Curve(x=data.time_s, y=values, role=series(place), name=name))
    marks.append(Curve(x=data.time_s, y=part.unexplained_mps, role="ink", name="unexplained", emphasis="thin"))
    y = Axis(f"{channel} velocity error, m/s")
    return Panel(marks, time_axis(*span(data.time_s)), y, legend="above" if has_legend else "")


def along(results: FlightResults) -> Plot | None:
    """Return velocity and position errors along and across the track, with the straight legs."""
    data, answer = results.rows_of(CausesAlong), results.answer(CausesResult)
    if data is None or not has_values(data.along_mps, data.across_mps):
        return None
    legs = () if answer is None else answer.legs
    shade: tuple[AnyMark, ...] = ()
    if legs:
        start, end = np.array([one.start_s for one in legs]), np.array([one.end_s for one in legs])
        kind = np.full(len(legs), "")
        shade = (Spans(start=start, end=end, kind=kind, role="faint", name="straight leg", emphasis="faint"),)
    both = (
        ("velocity error, m/s", data.along_mps, data.across_mps),
        ("position error, m", data.along_m, data.across_m),
    )
    shown = [one for one in both if has_values(*one[1:])]
    rows = []
    for place, (title, ahead, right) in enumerate(shown):
        marks = (
            *shade,
            ZERO,
            Curve(x=data.time_s, y=ahead, role=series(0), name="along the track"),
            Curve(x=data.time_s, y=right, role=series(1), name="across, to the right"),
        )
        is_last = place == len(shown) - 1
        panel = Panel(marks, time_axis(*span(data.time_s)), Axis(title), legend="above" if place == 0 else "")
        rows.append(Row((panel,), PANEL_MM, shares_x=not is_last))
    return Plot(
        "causes.along",
        "Errors along and across the track",
        "What changes its sign when the aircraft turns back is fixed to north and east, what keeps it to the aircraft.",
        "Errors of velocity and position along and across the track over flight time, straight legs shaded.",
        tuple(rows),
        ("causes_along",),
    )


PLOTS: Mapping[str, Describe] = {"causes.velocity": velocity, "causes.along": along}
