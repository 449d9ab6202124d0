"""Plots of a planned session: ways from above, accuracy and geometry with time, laws."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import unwrap
from groundstation.chapters.plots.common import M_PER_KM, label
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Curve, Dots, Emphasis, Floats, Limit, Points, Role, Told, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import finite, padded
from groundstation.results.arrays.typed import Flags, T
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan, ControlRow
from groundstation.systems.planning.session.arrays import ControlMeasures, ControlPaths, ControlPoints
from groundstation.systems.planning.session.chapter import title_of

PANEL_MM = 34.0
MARKS_ON_A_WAY = 5
ROLES: dict[str, Role] = {
    UNCONTROLLED: "faint",
    "determinant": "ins",
    "eigenvalue": "gnss",
    "dop": "series 5",
    "covariance": "answer",
}
EMPHASES: dict[str, Emphasis] = {"determinant": "bold"}  # laws that agree lie over each other and stay visible


def _data(results: FlightResults, kind: type[T]) -> tuple[ControlPlan, T] | None:
    answer, data = results.answer(ControlPlan), results.rows_of(kind)
    return None if answer is None or data is None else (answer, data)


def paths(results: FlightResults) -> Plot | None:
    """Return ways of all aircraft from above: under the recommended law, and without control."""
    found = _data(results, ControlPaths)
    if found is None:
        return None
    answer, data = found
    x, y = data.east_m / M_PER_KM, data.north_m / M_PER_KM
    marks: list[AnyMark] = []
    for number, name in enumerate(answer.aircraft):
        role = series(number)
        nominal = np.flatnonzero((data.law == UNCONTROLLED) & (data.aircraft == name))
        mine = np.flatnonzero((data.law == answer.recommended) & (data.aircraft == name))
        title = label(f"{name}{' (exact)' if name in answer.exact else ''}", 20)
        at = mine[np.linspace(0, len(mine) - 1, MARKS_ON_A_WAY).astype(np.int64)]
        marks.append(Curve(x=x[nominal], y=y[nominal], role=role, dash="dashed", emphasis="thin"))
        marks.append(Curve(x=x[mine], y=y[mine], role=role, name=title, emphasis="bold"))
        marks.append(Dots(x=x[at], y=y[at], role=role, emphasis="bold"))
        marks.append(Points(x=x[mine[-1:]], y=y[mine[-1:]], role=role))
    mine = np.flatnonzero(data.law == answer.recommended)
    marks.append(Told(x=x[mine], y=y[mine], value=data.time_s[mine], title="flight time", is_time=True))
    points = results.rows_of(ControlPoints)
    if points is not None:
        names = tuple(label(str(name), 16) for name in points.label)
        east, north = points.east_m / M_PER_KM, points.north_m / M_PER_KM
        marks.append(Points(x=east, y=north, symbol="triangle", labels=names, role="ink"))
    between = answer.duration_s / (MARKS_ON_A_WAY - 1)
    return Plot(
        "control.paths",
        "Paths",
        f"Paths from above: {title_of(answer.recommended)}; dashed: without control. Small dots are {between:g} s "
        "apart, the large one is at the end." + (" Triangles: ground points." if points is not None else ""),
        "Paths of the aircraft.",
        one_panel(Panel(marks, Axis("east, km"), Axis("north, km"), is_map=True), 92.0),
        ("control_paths", *(("control_points",) if points is not None else ())),
    )


def measures(results: FlightResults) -> Plot | None:
    """Return accuracy and geometry of the judged aircraft with time, every law in its colour."""
    found = _data(results, ControlMeasures)
    if found is None:
        return None
    answer, data = found
    time = time_axis(float(data.time_s.min()), float(data.time_s.max()))
    listed = (
        (data.two_sigma_north_m, Axis("2σ north, m", "log")),
        (data.two_sigma_east_m, Axis("2σ east, m", "log")),
        (data.determinant, Axis("det(H'H)")),
        (data.dop, Axis("DOP")),
    )
    rows: list[Row] = []
    for values, y in listed:
        marks = [_law(answer_law.law, data.law == answer_law.law, data.time_s, values) for answer_law in answer.laws]
        rows.append(Row((Panel(marks, time, y, legend="" if rows else "above"),), PANEL_MM, y.title != "DOP"))
    return Plot(
        "control.measures",
        "Accuracy and geometry",
        f"Accuracy of {answer.judged} as the centralised filter computes it, and geometry of its sources, under every "
        "control law. Laws of each step that agree overlap.",
        "Two sigma and geometry with time.",
        tuple(rows),
        ("control_measures",),
    )


def _law(name: str, mine: Flags, time: Floats, values: Floats) -> Curve:
    role, heavy = ROLES.get(name, "ink"), EMPHASES.get(name, "usual")
    return Curve(x=time[mine], y=values[mine], role=role, name=title_of(name), emphasis=heavy)


def law(results: FlightResults) -> Plot | None:
    """Return every control with time under every law, with its bounds."""
    found = _data(results, ControlPaths)
    if found is None or not found[0].controls:
        return None
    answer, data = found
    panels = [_control(answer, data, row, legend=row is answer.controls[0]) for row in answer.controls]
    return Plot(
        "control.law",
        "Control laws",
        "The control laws with time; straight grey: no control; dashed: bounds.",
        "Controls with time.",
        tuple(Row((panel,), PANEL_MM, shares_x=panel is not panels[-1]) for panel in panels),
        ("control_paths",),
    )


def _control(answer: ControlPlan, data: ControlPaths, row: ControlRow, *, legend: bool) -> Panel:
    is_speed = row.control == "speed"
    curves: list[Curve] = []
    for one in answer.laws:
        mine = (data.law == one.law) & (data.aircraft == row.aircraft)
        values = data.speed_mps[mine] if is_speed else _unwrapped(data, mine, row.start)
        everywhere = np.ones(len(values), dtype=bool)
        curves.append(_law(one.law, everywhere, data.time_s[mine], values))
    known = finite(*(curve.y for curve in curves))
    low, high = padded(float(known.min()), float(known.max()), 0.1, 0.5)
    limits = [Limit(value=value) for value in (row.low, row.high) if low <= value <= high]
    y = Axis(f"{label(row.aircraft, 12)}: {row.control}, {'m/s' if is_speed else '°'}", low=low, high=high)
    time = time_axis(float(data.time_s.min()), float(data.time_s.max()))
    return Panel((*curves, *limits), time, y, legend="above" if legend else "")


def _unwrapped(data: ControlPaths, rows: Flags, start_deg: float) -> Floats:
    """Return headings without jumps through north, beginning at the start."""
    track = unwrap(data.track_deg[rows])
    return np.asarray(start_deg + track - track[0])


PLOTS: Mapping[str, Describe] = {
    "control.paths": paths,
    "control.measures": measures,
    "control.law": law,
}
